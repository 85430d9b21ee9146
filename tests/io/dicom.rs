//! DICOM as pydicom and dcmtk write it: every pixel has the value, the place and the time that tests/data/dicom/make.py computes; and what
//! is written here is read as the same. tests/data/dicom/check.py compares the files that are written with pydicom and dciodvfy.

use crate::common::files::{Folder, data, repository};
use crate::common::program;
use crate::formats::{Expected, agrees, expected, voxels};
use echolume::Source;
use echolume::low_level::probe::Geometry;
use echolume::low_level::source::{OpenOptions, Recording};
use glam::DVec3;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

fn stored(name: &str) -> PathBuf {
    data("dicom").join(name)
}

fn all() -> BTreeMap<String, Expected> {
    let text = std::fs::read_to_string(stored("expected.json")).expect("the expected values");
    serde_json::from_str(&text).expect("JSON")
}

fn open(path: &Path) -> Recording {
    Recording::open(path, None).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(path: &Path, options: OpenOptions) -> String {
    let error = Recording::open_with(path, options).err().expect("refused").to_string();
    assert_eq!(error.lines().count(), 1, "{error}");
    error
}

/// What a user is told of a file.
fn told(path: &Path) -> String {
    open(path).description().into_iter().map(|(title, text)| format!("{title}: {text}\n")).collect()
}

#[test]
fn every_pixel_has_the_value_place_and_time_that_pydicom_says() {
    let all = all();
    assert!(all.len() >= 20, "{} files", all.len());
    for (name, expected) in &all {
        agrees(open(&stored(name)), expected, name);
        let mut recording = open(&stored(name));
        let mut times = Vec::new();
        while let Some(frame) = recording.next_frame().expect("a frame") {
            times.extend(frame.time);
        }
        if recording.frames_per_volume() != expected.size[2] {
            // Drawn along other axes, a slice has the time of its volume.
            assert!(times.iter().all(|time| *time == expected.times[0]), "{name}: {times:?}");
            continue;
        }
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert_eq!(times.len(), expected.times.len(), "{name}");
        assert!(times.iter().zip(&expected.times).all(is_near), "{name}: {times:?}");
    }
}

#[test]
fn a_volume_is_drawn_along_the_axes_of_its_transducer() {
    let all = all();
    let [x, y, z] = all["enhanced-depth-z.dcm"].affine;
    let recording = open(&stored("enhanced-depth-z.dcm"));
    let world = recording.world().expect("a place in the world");
    assert!(world.axis(1).distance(DVec3::new(x[2], y[2], z[2])) < 1e-9, "depth is the third axis");
    assert!(world.axis(2).distance(-DVec3::new(x[1], y[1], z[1])) < 1e-9, "elevation is against the second");
    assert!(!world.is_left_handed());
    // A depth axis that the user gives counts from there.
    let options = OpenOptions { depth_axis: Some("x".parse().expect("an axis")), ..OpenOptions::default() };
    agrees(Recording::open_with(&stored("enhanced.dcm"), options).expect("read"), &all["enhanced.dcm"], "depth x");
}

#[test]
fn volumes_may_be_read_in_any_order() {
    let mut recording = open(&stored("enhanced.dcm"));
    assert_eq!((recording.volumes(), recording.frames_per_volume()), (2, 4));
    let mut frames = Vec::new();
    while let Some(frame) = recording.next_frame().expect("a frame") {
        frames.push(frame);
    }
    for volume in [1, 0] {
        recording.skip_to_volume(volume).expect("there");
        for number in 0..4 {
            assert_eq!(recording.next_frame().expect("read").as_ref(), frames.get(4 * volume + number));
        }
    }
}

#[test]
fn a_kretz_file_in_private_elements_is_read_as_itself() {
    let (inside, alone) = (open(&stored("kretz.dcm")), open(&repository("tests/fuzz/seeds/kretz/small.vol")));
    assert_eq!(inside.geometry(0), alone.geometry(0));
    assert_eq!((inside.format(), inside.volumes()), ("Kretz volume in DICOM", alone.volumes()));
    let frames = |mut recording: Recording| {
        std::iter::from_fn(|| recording.next_frame().expect("a frame")).map(|frame| frame.bytes).collect::<Vec<_>>()
    };
    assert_eq!(frames(inside), frames(alone));
}

#[test]
fn no_identity_is_shown_or_copied() {
    let folder = Folder::new("identity");
    let mut seen = 0;
    for name in all().keys().map(String::as_str).chain(["kretz.dcm"]) {
        let text = told(&stored(name));
        assert!(!text.to_lowercase().contains("secret") && !text.contains("2.25."), "{name}: {text}");
        assert!(text.contains("modality: US\n") && text.contains("scanner: Nobody Formula 1\n"), "{name}: {text}");
        seen += 1;
    }
    assert!(seen > 20);
    let out = folder.path("copy.dcm");
    let from = stored("enhanced-straight.dcm");
    let (code, _, said) = program::run(&["convert", from.to_str().expect("a plain name"), &out]);
    assert_eq!(code, Some(0), "{said}");
    let bytes = std::fs::read(&out).expect("written");
    let text = String::from_utf8_lossy(&bytes).to_lowercase();
    assert!(
        text.contains("echolume") && !text.contains("secret") && !text.contains("1901") && !text.contains("nobody")
    );
}

#[test]
fn what_is_not_read_is_named_in_one_line() {
    let plain = OpenOptions::default();
    let ct = refused(&stored("ct.dcm"), plain);
    assert!(
        ct.contains("is a DICOM CT image") && ct.contains("modality CT") && ct.contains("ultrasound is read"),
        "{ct}"
    );
    let ls = refused(&stored("jpeg-ls.dcm"), plain);
    let what = "JPEG-LS lossless ('1.2.840.10008.1.2.4.80') is not read: uncompressed, RLE, JPEG and JPEG 2000 are";
    assert!(ls.contains(what) && ls.lines().count() == 1, "{ls}");
    let unsized_ = refused(&stored("plain.dcm"), plain);
    assert!(unsized_.contains("--voxel-spacing"), "{unsized_}");
    let spaced = OpenOptions { voxel_spacing: Some([0.5, 0.25, 1.0]), ..plain };
    let recording = Recording::open_with(&stored("plain.dcm"), spaced).expect("read");
    assert!(matches!(recording.geometry(0), Geometry::Cartesian(grid) if grid.spacing == [0.5, 0.25, 1.0]));
    assert!(refused(&stored("multiframe.dcm"), spaced).contains("states its own"));
    assert!(refused(&stored("series"), spaced).contains("state their own"));
    // Slices that are not evenly spaced, and files of two kinds.
    let folder = Folder::new("series");
    for n in ["0", "1", "2", "4"] {
        folder.write(&format!("{n}.dcm"), std::fs::read(stored(&format!("series/{n}.dcm"))).expect("stored"));
    }
    let here = PathBuf::from(folder.path(""));
    assert!(refused(&here, plain).contains("not evenly spaced"));
    folder.write("5.dcm", std::fs::read(stored("plain.dcm")).expect("stored"));
    assert!(refused(&here, plain).contains("5.dcm differs from"));
    folder.write("6.dcm", std::fs::read(stored("enhanced.dcm")).expect("stored"));
    assert!(refused(&here, plain).contains("several frames"));
}

#[test]
fn what_is_cut_out_of_a_picture_is_said() {
    let text = told(&stored("multiframe.dcm"));
    assert!(text.contains("region: one of 3: columns 4 .. 19, rows 2 .. 17 of 24 x 20 pixels"), "{text}");
    assert!(text.contains("frame time: 40 ms"), "{text}");
    let text = told(&stored("enhanced-flow.dcm"));
    assert!(text.contains("more data: frames of FLOW_VELOCITY; not read"), "{text}");
    assert!(text.contains("apex: 1, -4, 2.5 mm"), "{text}");
    assert!(told(&stored("enhanced-rle.dcm")).contains("compression: RLE\n"));
}

#[test]
fn a_packed_file_is_read_where_its_frames_stand_in_order() {
    let folder = Folder::new("packed");
    let packed = |name: &str| {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(&std::fs::read(stored(name)).expect("stored")).expect("packed");
        PathBuf::from(folder.write(&format!("{name}.gz"), packed.finish().expect("packed")))
    };
    agrees(open(&packed("enhanced-straight.dcm")), &all()["enhanced-straight.dcm"], "packed");
    assert_eq!(open(&packed("kretz.dcm")).format(), "Kretz volume in DICOM");
    for name in ["multiframe-rle.dcm", "multiframe.dcm", "enhanced.dcm"] {
        assert!(refused(&packed(name), OpenOptions::default()).contains("unpack it"), "{name}");
    }
}

/// Converts a file by the program.
fn converted(from: &Path, out: &str, more: &[&str]) -> (Option<i32>, String) {
    let (code, _, said) = program::run(&[&["convert", from.to_str().expect("a plain name"), out], more].concat());
    (code, said)
}

#[test]
fn a_written_volume_keeps_values_lattice_and_place() {
    let folder = Folder::new("written");
    let out = folder.path("out.dcm");
    let formats = expected();
    let dicom = all();
    let cases = [
        (data("formats/detached.nhdr"), &formats["detached.nhdr"]),
        (data("formats/rgb.nii"), &formats["rgb.nii"]),
        (stored("enhanced-depth-z.dcm"), &dicom["enhanced-depth-z.dcm"]),
        (stored("series"), &dicom["series"]),
        (stored("image.dcm"), &dicom["image.dcm"]),
    ];
    for (from, expected) in cases {
        let (code, said) = converted(&from, &out, &[]);
        assert_eq!(code, Some(0), "{said}");
        agrees(open(Path::new(&out)), expected, &from.display().to_string());
        let first = std::fs::read(&out).expect("written");
        assert_eq!(converted(&from, &out, &[]).0, Some(0));
        assert!(std::fs::read(&out).expect("written") == first, "the same volume gives the same bytes");
    }
    assert_eq!(folder.names().len(), 1, "nothing is left beside it");
}

#[test]
fn what_dicom_does_not_hold_is_refused_or_written_in_eight_bits() {
    let folder = Folder::new("capture");
    let out = folder.path("out.dcm");
    let from = data("formats/double.mha");
    let (code, said) = converted(&from, &out, &[]);
    assert!(code != Some(0) && said.contains("--secondary-capture") && said.lines().count() == 1, "{said}");
    assert!(folder.names().is_empty(), "no file is left");
    let (code, said) = converted(&from, &out, &["--secondary-capture"]);
    assert_eq!(code, Some(0), "{said}");
    let (wide, shown) = (open(&from), open(Path::new(&out)));
    let [low, high] = wide.range();
    let (Geometry::Cartesian(a), Geometry::Cartesian(b)) = (wide.geometry(0), shown.geometry(0)) else {
        panic!("Cartesian volumes")
    };
    assert_eq!(a.size, b.size);
    assert!((0..3).all(|n| (a.spacing[n] - b.spacing[n]).abs() < 1e-6), "{a:?} {b:?}");
    for ((_, _, value), (_, _, eight)) in voxels(wide).into_iter().zip(voxels(shown)) {
        assert!((255.0 * (value - low) / (high - low) - eight).abs() <= 0.5 + 1e-9, "{value} is {eight}");
    }
    let (code, said) = converted(&from, &folder.path("out.mha"), &["--secondary-capture"]);
    assert!(code != Some(0) && said.contains("is for .dcm"), "{said}");
}
