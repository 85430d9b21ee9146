//! Folders and patterns of numbered pictures as volumes.

use crate::common::files::{BONE, Folder};
use echolume::Source;
use echolume::low_level::picture::{Grey, Picture};
use echolume::low_level::probe::Geometry;
use echolume::low_level::source::{InputError, OpenOptions, Recording, SampleType};
use std::path::Path;

const SPACING: [f64; 3] = [0.2, 0.3, 0.5];

fn open(path: &Path, voxel_spacing: Option<[f64; 3]>) -> Result<Recording, InputError> {
    Recording::open_with(path, OpenOptions { voxel_spacing, ..OpenOptions::default() })
}

fn grey(width: u32, height: u32, sixteen: bool, value: impl Fn(u32) -> u16) -> Grey {
    Grey { width, height, sixteen, values: (0..width * height).map(value).collect(), from_colour: false }
}

fn frames(mut recording: Recording) -> Vec<Vec<u8>> {
    std::iter::from_fn(|| recording.next_frame().expect("a frame")).map(|frame| frame.bytes).collect()
}

/// The fault of opening something.
fn fault(path: &Path, voxel_spacing: Option<[f64; 3]>) -> String {
    open(path, voxel_spacing).err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn a_folder_of_pictures_is_a_volume_in_the_order_of_their_numbers() {
    let folder = Folder::new("stack");
    folder.write("notes 7.txt", "no picture");
    for n in 8..12u16 {
        grey(5, 4, false, |i| n * 20 + i as u16).save(&folder.0.join(format!("s{n}.png"))).expect("written");
    }
    // Of another stack, which a pattern leaves out.
    let recording = open(&folder.0, Some(SPACING)).expect("read");
    assert_eq!(
        (recording.format(), recording.sample_type(), recording.volumes()),
        ("stack of pictures", SampleType::U8, 1)
    );
    let Geometry::Cartesian(grid) = recording.geometry(0) else { panic!("a Cartesian volume") };
    assert_eq!((grid.size, grid.spacing, grid.origin), ([5, 4, 4], SPACING, [0.0; 3]));
    assert!(recording.files().iter().any(|file| file.ends_with("s11.png")));
    let said = recording.description();
    assert!(said.iter().any(|(title, text)| title == "pictures" && text == "'s8.png' to 's11.png'"), "{said:?}");
    let expected: Vec<Vec<u8>> = (8..12u8).map(|n| (0..20).map(|i| n * 20 + i).collect()).collect();
    assert_eq!(frames(recording), expected);
    grey(5, 4, false, |_| 1).save(&folder.0.join("mask-1.bmp")).expect("written");
    assert!(fault(&folder.0, Some(SPACING)).contains("differ in more than a number"));
    assert_eq!(frames(open(&folder.0.join("s*.png"), Some(SPACING)).expect("read")), expected);
    let mut turned = open(&folder.0.join("s?*.png"), Some(SPACING)).expect("read");
    turned.skip_to_volume(0).expect("the only one");
    assert_eq!(turned.next_frame().expect("a frame").expect("a frame").bytes, expected[0]);
}

#[test]
fn colours_become_luminance_and_sixteen_bits_stay() {
    let folder = Folder::new("stack-kinds");
    let colour = Picture { width: 2, height: 1, rgba: vec![255, 0, 0, 255, 0, 0, 255, 255] };
    colour.save(&folder.0.join("c1.png")).expect("written");
    grey(2, 1, false, |i| 9 + i as u16).save(&folder.0.join("c2.png")).expect("written");
    let recording = open(&folder.0.join("c*.png"), Some(SPACING)).expect("read");
    assert!(recording.description().iter().any(|(_, text)| text.contains("colours read as their luminance")));
    // 0.299 and 0.114 of 255; grey stays what it is.
    assert_eq!(frames(recording), [[76, 29], [9, 10]]);
    grey(2, 2, true, |i| 1000 * i as u16 + 7).save(&folder.0.join("deep.png")).expect("written");
    let recording = open(&folder.0.join("dee?.png"), Some(SPACING)).expect("one picture is one slice");
    assert_eq!(recording.sample_type(), SampleType::U16);
    assert_eq!(frames(recording), [[7u16, 1007, 2007, 3007].map(u16::to_le_bytes).concat()]);
}

#[test]
fn what_is_no_even_stack_is_refused_with_its_reason() {
    let folder = Folder::new("stack-wrong");
    let save = |name: &str, width: u32, sixteen: bool| {
        grey(width, 3, sixteen, |i| i as u16).save(&folder.0.join(name)).expect("written");
    };
    let pattern = |name: &str| folder.0.join(name);
    for (name, width, sixteen) in [
        ("gap1.png", 4, false),
        ("gap2.png", 4, false),
        ("gap4.png", 4, false),
        ("wide1.png", 4, false),
        ("wide2.png", 5, false),
        ("deep1.png", 4, false),
        ("deep2.png", 4, true),
        ("fine1.png", 4, false),
        ("fine2.png", 4, false),
    ] {
        save(name, width, sixteen);
    }
    folder.write("text1.png", "no picture");
    folder.write("cut1.png", &std::fs::read(pattern("fine1.png")).expect("a picture")[..40]);
    std::fs::create_dir(pattern("empty")).expect("a folder");
    for (name, spacing, named) in [
        ("gap*.png", Some(SPACING), "number 2 is followed by 4"),
        ("wide*.png", Some(SPACING), "wide2.png: picture: has 5 x 3 pixels"),
        ("deep*.png", Some(SPACING), "deep2.png"),
        ("text*.png", Some(SPACING), "PNG, JPEG, PNM and BMP are read"),
        ("fine*.png", None, "--voxel-spacing X,Y,Z"),
        ("fine*.png", Some([0.2, -1.0, 1.0]), "voxel spacing: spacing"),
        ("none*.png", Some(SPACING), "no file has such a name"),
        ("empty", Some(SPACING), "is a folder without pictures"),
        ("gone", Some(SPACING), "gone: file: cannot be read"),
    ] {
        let said = fault(&pattern(name), spacing);
        assert!(said.contains(named) && said.lines().count() == 1, "{name}: {said}");
    }
    assert!(fault(Path::new(BONE), Some(SPACING)).contains("--voxel-spacing"));
    // The header is whole, the pixels are not.
    let cut = open(&pattern("cut*.png"), Some(SPACING)).map(|mut cut| cut.next_frame());
    assert!(!matches!(cut, Ok(Ok(_))), "a picture that is cut short is read");
}

#[test]
fn pictures_of_scan_lines_take_a_probe_file() {
    let folder = Folder::new("stack-polar");
    for n in 1..4u16 {
        // Four lines of six samples.
        grey(6, 4, false, |i| n * 30 + i as u16).save(&folder.0.join(format!("f{n}.png"))).expect("written");
    }
    let probe = "[array]\nkind = 'curved'\nradius_mm = 40\n[lines]\nsector_angle_deg = 70\n[depth]\nend_mm = 120\n\
                 [motion]\nkind = 'fan'\nwobble_radius_mm = 25\nfan_angle_deg = 60\n";
    folder.write("probe.toml", probe);
    let recording = open(&folder.0, None).expect("a sweep");
    let Geometry::Sweep(found) = recording.geometry(0) else { panic!("a sweep") };
    assert_eq!((found.samples, found.lines.len(), found.slices.len()), (6, 4, 3));
    // A stated spacing is the recording's own geometry.
    assert!(matches!(open(&folder.0, Some(SPACING)).expect("read").geometry(0), Geometry::Cartesian(_)));
    // A file may state a spacing instead of scan lines.
    folder.write("probe.toml", "[voxels]\nspacing_mm = [0.2, 0.3, 0.5]\n");
    for probe in [None, Some(folder.0.join("probe.toml"))] {
        let options = OpenOptions { probe: probe.as_deref(), ..OpenOptions::default() };
        let recording = Recording::open_with(&folder.0, options).expect("read");
        assert!(matches!(recording.geometry(0), Geometry::Cartesian(grid) if grid.spacing == SPACING));
        assert!(
            recording.description().iter().any(|(title, text)| title == "spacing from" && text.ends_with("probe.toml"))
        );
    }
    folder.write("probe.toml", "[voxels]\nspacing_mm = [0.2, 0.3]\n");
    assert!(fault(&folder.0, None).contains("probe.toml: voxels: "), "{}", fault(&folder.0, None));
    let both = OpenOptions {
        probe: Some(&folder.0.join("probe.toml")),
        voxel_spacing: Some(SPACING),
        ..OpenOptions::default()
    };
    assert!(Recording::open_with(&folder.0, both).is_err_and(|e| e.to_string().contains("say different things")));
}
