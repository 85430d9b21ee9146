//! `render --turntable` and `--volumes`: several pictures of one recording, as files and as a film.

use crate::common::program::*;
use echolume::picture::Picture;
use std::fs;
use std::path::Path;

const LOOK: [&str; 4] = ["--preset", "bone", "--size", "40x30"];

fn picture(folder: &str, n: usize) -> Picture {
    Picture::load(Path::new(&format!("{folder}/picture-{n:06}.png"))).expect("a picture")
}

/// Mean difference of two pictures, levels of 255.
fn difference(a: &Picture, b: &Picture) -> f64 {
    assert_eq!([a.width, a.height], [b.width, b.height]);
    a.rgba.iter().zip(&b.rgba).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / a.rgba.len() as f64
}

/// Prevents a turn that jumps where it closes, and one that zooms.
#[test]
fn a_turn_that_starts_elsewhere_has_the_same_pictures() {
    let folder = Folder::new("turn");
    let [turn, later] = ["turn", "later"].map(|name| folder.path(name));
    // Level, so that the vertical axis of both views is the same.
    let level = ["--set", "camera.elevation=0"];
    let said = done(&[&["render", BONE, "--turntable", "4", "-o", &format!("{turn}/")][..], &LOOK, &level].concat());
    let last = format!("pictures: {turn}/picture-000000.png to {turn}/picture-000003.png, 4");
    assert!(said.ends_with(&format!("{last}\n")), "{said}");
    let quarter = ["render", BONE, "--turntable", "4", "--camera", "azimuth=90", "-o", &later];
    done(&[&quarter[..], &LOOK, &level].concat());
    let all = |folder: &str| [0, 1, 2, 3].map(|n| picture(folder, n));
    let (turn, later) = (all(&turn), all(&later));
    for n in 0..4 {
        let (same, other) = (difference(&later[n], &turn[(n + 1) % 4]), difference(&later[n], &turn[n]));
        // Angles of 90 degrees are rounded; a pixel on an edge may change.
        assert!(same < 0.5 && other > 4.0 * same.max(0.5), "picture {n}: {same}, {other} from the one before");
    }
}

#[test]
fn volumes_in_time_are_those_that_are_drawn_alone() {
    let folder = Folder::new("loop");
    let sweep = folder.path("sweep.mha");
    done(&["phantom", "-o", &sweep, "--volumes", "3", "--both-ways", "--frames", "9", "--lines", "24"]);
    let look = ["--preset", "face", "--size", "24x20"];
    let pattern = folder.path("loop-%02d.png");
    done(&[&["render", &sweep, "--volumes", "1:2", "-o", &pattern][..], &look].concat());
    for n in [1, 2] {
        let alone = folder.path("alone.png");
        done(&[&["render", &sweep, "--volume", &n.to_string(), "-o", &alone][..], &look].concat());
        let (alone, drawn) = (fs::read(&alone).expect("a picture"), fs::read(folder.path(&format!("loop-0{n}.png"))));
        assert!(drawn.expect("a picture") == alone, "volume {n}");
    }
    assert!(!folder.names().contains("loop-00.png"));
}

#[test]
fn a_series_that_would_be_wrong_is_not_begun() {
    let folder = Folder::new("series-wrong");
    let slices = folder.path("slices");
    fs::create_dir_all(&slices).expect("a folder");
    for n in 0..2 {
        fs::write(format!("{slices}/picture-{n:06}.pgm"), b"P5 4 4 255\n0123456789abcdef").expect("a slice");
    }
    let (one, out, over) = (folder.path("one.png"), folder.path("out"), format!("{slices}/picture-%06d.pgm"));
    let film = folder.path("film.mp4");
    let stack = format!("{slices}/*.pgm");
    let mut rows: Vec<(Vec<&str>, &str)> = vec![
        (vec!["--turntable", "3", "-o", &one], "a pattern (face-%03d.png)"),
        (vec!["--turntable", "3", "-o", "-"], "a pattern (face-%03d.png)"),
        (vec!["--turntable", "3", "-o", &out, "--mode", "mpr"], "--turntable: this mode shows planes"),
        (vec!["--volumes", "0:1", "-o", &out], "--volume 1: there are 1"),
        (vec!["--volumes", "all", "--volume", "1", "-o", &out], "give one of them"),
        (vec!["--turntable", "3", "-o", &out, "--dump", &out], "--dump: is for one picture"),
        (vec!["--turntable", "2", "-o", &over], "would replace an input"),
    ];
    if !cfg!(feature = "video") {
        rows.push((vec!["--turntable", "3", "-o", &film], "--features video"));
    }
    for (more, named) in rows {
        let all = [&["render", &stack, "--voxel-spacing", "1,1,1", "--size", "8x8"][..], &more].concat();
        refuses(&all, &run(&all), 2, &[named]);
    }
    assert_eq!(folder.names().into_iter().collect::<Vec<_>>(), ["slices"]);
    assert_eq!(fs::read(format!("{slices}/picture-000001.pgm")).expect("a slice"), b"P5 4 4 255\n0123456789abcdef");
}

/// The film against the pictures, by a decoder of others.
#[cfg(feature = "video")]
#[test]
fn a_film_has_the_pictures_of_its_series() {
    use std::process::Command;
    let output = |program: &str, arguments: &[&str]| {
        Command::new(program).args(arguments).output().ok().filter(|output| output.status.success())
    };
    if output("ffprobe", &["-version"]).is_none() {
        eprintln!("ffprobe is not installed: the film is not decoded");
        return;
    }
    let folder = Folder::new("film");
    let [pictures, film] = ["pictures", "turn.mp4"].map(|name| folder.path(name));
    // An odd size: its planes of colour are rounded up.
    let look = ["--preset", "bone", "--size", "161x121", "--turntable", "12"];
    done(&[&["render", BONE, "-o", &pictures][..], &look].concat());
    let said = done(&[&["render", BONE, "-o", &film, "--rate", "8"][..], &look].concat());
    assert!(said.ends_with(&format!("film: {film}, 12 pictures, 8 a second\n")), "{said}");
    let asked =
        "stream=codec_name,profile,width,height,r_frame_rate,nb_read_frames,color_space,color_range:format=duration";
    let probe = ["-v", "error", "-count_frames", "-show_entries", asked, "-of", "default=noprint_wrappers=1", &film];
    let said = output("ffprobe", &probe).expect("it is read").stdout;
    let said = String::from_utf8(said).expect("text");
    for line in [
        "codec_name=av1",
        "profile=Main",
        "width=161",
        "height=121",
        "r_frame_rate=8/1",
        "nb_read_frames=12",
        "color_space=bt709",
        "color_range=tv",
        "duration=1.500000",
    ] {
        assert!(said.lines().any(|there| there == line), "no {line} in {said}");
    }
    let decoded = ["-v", "error", "-i", &film, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"];
    let decoded = output("ffmpeg", &decoded).expect("it is decoded").stdout;
    let size = 161 * 121 * 3;
    assert_eq!(decoded.len(), 12 * size);
    for (n, frame) in decoded.chunks_exact(size).enumerate() {
        let own = picture(&pictures, n);
        let own = own.rgba.chunks_exact(4).flat_map(|p| &p[..3]);
        let squares: f64 = own.zip(frame).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
        let psnr = 10.0 * (255.0f64.powi(2) * size as f64 / squares).log10();
        assert!(psnr > 38.0, "picture {n}: {psnr:.1} dB");
        eprintln!("picture {n}: {psnr:.1} dB");
    }
}
