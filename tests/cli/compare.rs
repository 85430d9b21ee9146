//! `render --compare`: tiles, difference, wipe, and a registration with a known answer.

use crate::common::program::*;
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::Rigid;

const LOOK: [&str; 6] = ["--mode", "plane", "--set", "slices.median=false", "--size", "240x160"];

fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 3] {
    let at = 4 * (y * picture.width + x) as usize;
    [0, 1, 2].map(|c| picture.rgba[at + c])
}

fn sweep(folder: &Folder, name: &str, more: &[&str]) -> String {
    let file = folder.path(name);
    done(&[&["phantom", "--still", "-o", &file][..], more].concat());
    file
}

/// The number behind some words.
fn number(said: &str, words: &str) -> f64 {
    let rest = said.split_once(words).unwrap_or_else(|| panic!("{words}: {said}")).1;
    rest.split([' ', ',']).next().and_then(|n| n.parse().ok()).unwrap_or_else(|| panic!("{words}: {said}"))
}

/// A body that was moved by 4.6 mm and 5.8 degrees is laid onto itself: the motion that is found is its inverse, and the difference falls.
#[test]
fn two_sweeps_of_a_moved_body_are_registered_and_compared() {
    let folder = Folder::new("compare");
    let moved: Rigid = "3,-2,-3,3,0,5".parse().expect("a motion");
    let (before, after) =
        (sweep(&folder, "before.mha", &[]), sweep(&folder, "after.mha", &["--seed", "7", "--moved", "3,-2,-3,3,0,5"]));
    let output = folder.path("compared.png");
    let compared =
        |more: &[&str]| done(&[&["render", "--compare", &before, &after, "-o", &output][..], &LOOK, more].concat());
    let apart = number(&compared(&[]), "RMS ");
    let said = compared(&["--register", "find"]);
    let found: String = said.split_once("registration of B: ").expect("a motion").1.split(' ').take(1).collect();
    let motion: Rigid = found.parse().expect("a motion");
    // About the middle of the head, to which the motion of the phantom refers.
    let about = echolume::low_level::source::phantom::PhantomOptions::CENTRE;
    let volume = echolume::low_level::source::open(before.as_ref(), None).expect("a sweep").geometry(0);
    let centre = echolume::low_level::segment::registration::centre(&volume);
    let left = Rigid { about: centre, ..motion }.map() * Rigid { about, ..moved }.map();
    let off = Rigid::of(&left, about);
    assert!(off.shift.length() < 0.2 && off.angle() < 0.2, "{off} is left: {said}");
    let registered = number(&said, "RMS ");
    assert!(registered < 0.85 * apart, "{registered} of {apart}");
    // The motion as a number is the same comparison, to its three decimals.
    let again = number(&compared(&["--register", &found]), "RMS ");
    assert!((again - registered).abs() < 0.1, "{again}, {registered}");
    let picture = Picture::load(output.as_ref()).expect("a picture");
    assert_eq!([picture.width, picture.height], [240, 160]);
}

/// Of a recording and itself: both tiles are the picture of the tile's size, and their difference is nothing.
#[test]
fn a_recording_does_not_differ_from_itself() {
    let folder = Folder::new("same");
    let (output, alone) = (folder.path("same.png"), folder.path("alone.png"));
    let said = done(&[&["render", "--compare", BONE, BONE, "-o", &output][..], &LOOK].concat());
    assert!(said.contains("RMS 0.00 of 255 levels; scale -16 to 16"), "{said}");
    // Three tiles with gaps of two pixels: (240 - 4) / 3.
    done(&[&["render", BONE, "-o", &alone][..], &LOOK[..4], &["--size", "78x160"]].concat());
    let [same, alone] = [&output, &alone].map(|file| Picture::load(file.as_ref()).expect("a picture"));
    // Above the names of the tiles.
    for (x, y) in (0..140).flat_map(|y| (0..78).map(move |x| (x, y))) {
        assert_eq!(pixel(&same, x, y), pixel(&alone, x, y), "A at {x}, {y}");
        assert_eq!(pixel(&same, x + 80, y), pixel(&alone, x, y), "B at {x}, {y}");
        assert_eq!(pixel(&same, x + 160, y), [18, 21, 26], "A - B at {x}, {y}");
    }
    // Other settings of one volume, as a wipe: the second half is the other picture.
    let (wiped, other) = (folder.path("wiped.png"), folder.path("other.png"));
    let wipe = ["--compare-view", "wipe=0.25", "--compare-set", "planes.window=[0.2,0.6]"];
    done(&[&["render", "--compare", BONE, BONE, "-o", &wiped][..], &LOOK, &wipe].concat());
    done(&[&["render", BONE, "-o", &other, "--set", "planes.window=[0.2,0.6]"][..], &LOOK].concat());
    done(&[&["render", BONE, "-o", &output][..], &LOOK].concat());
    let [wiped, other, first] = [&wiped, &other, &output].map(|file| Picture::load(file.as_ref()).expect("a picture"));
    for (x, y) in (0..160).flat_map(|y| (0..240).map(move |x| (x, y))).filter(|(x, _)| *x != 60) {
        let expected = if x < 60 { &first } else { &other };
        assert_eq!(pixel(&wiped, x, y), pixel(expected, x, y), "{x}, {y}");
    }
    assert!(first.rgba != other.rgba);
}

#[test]
fn what_cannot_be_compared_is_refused_in_one_line() {
    let folder = Folder::new("refused");
    for (more, named) in [
        (&["missing.mha"][..], "missing.mha: file: cannot be read"),
        (&[BONE, BONE, BONE, BONE], "--compare: shows at most 4 recordings"),
        (&[BONE, BONE, "--compare-view", "wipe"], "--compare-view wipe: is for two recordings"),
        (&[BONE, "--compare-volume", "9"], "--compare-volume 9: there are 1, numbered from 0"),
        (&[BONE, "--compare-set", "planes.nothing=1"], "--compare-set"),
        (&[BONE, "--timings"], "--timings: is for one volume; leave --compare out"),
        (&[BONE, "--mesh", "x.stl"], "--mesh: is for one volume; leave --compare out"),
        (&[BONE, "--set", "marks.bar=true"], "marks.bar: is for one volume"),
    ] {
        folder.refuses(&[&["--compare", BONE][..], more].concat(), &[named]);
    }
}
