//! Volumes as nibabel, pynrrd and SimpleITK write them: every voxel has the value and the place in the world that those programs read
//! (tests/data/formats/make.py), and files that are written here say the same.

use crate::common::files::{Folder, data, repository};
use crate::common::program;
use echolume::Source;
use echolume::low_level::probe::{Geometry, World};
use echolume::low_level::source::convert::{Target, Volume};
use echolume::low_level::source::{OpenOptions, Recording, SampleType, StoredType};
use glam::{DMat4, DVec3};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
pub struct Expected {
    /// Upper three rows: stored indices to LPS, mm.
    pub affine: [[f64; 4]; 3],
    pub size: [usize; 3],
    pub volumes: usize,
    pub values: Vec<f64>,
    /// Of each slice, s; none if no times are stated.
    #[serde(default)]
    pub times: Vec<f64>,
    /// Largest difference of a value.
    #[serde(default)]
    pub tolerance: f64,
}

pub fn expected() -> BTreeMap<String, Expected> {
    let text = std::fs::read_to_string(data("formats/expected.json")).expect("the expected values");
    serde_json::from_str(&text).expect("JSON")
}

fn open(path: &Path) -> Recording {
    Recording::open(path, None).unwrap_or_else(|e| panic!("{e}"))
}

/// Every value of a recording with its place in the world and its volume, in the units of the file.
pub fn voxels(mut recording: Recording) -> Vec<(usize, DVec3, f64)> {
    let Geometry::Cartesian(grid) = recording.geometry(0) else { panic!("a Cartesian volume") };
    let world = recording.world().expect("a place in the world");
    let (stored, shift) = (recording.stored_type(), recording.sample_type().shift());
    let mut all = Vec::new();
    while let Some(frame) = recording.next_frame().expect("a frame") {
        for (n, bytes) in frame.bytes.chunks(stored.bytes()).enumerate() {
            let value = match (stored, bytes) {
                (StoredType::U8, [a]) => f64::from(*a),
                (StoredType::U16, [a, b]) => f64::from(u16::from_le_bytes([*a, *b])),
                (StoredType::F32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
                _ => panic!("a part of a sample"),
            };
            let cell = [n % grid.size[0], n / grid.size[0], frame.slice].map(|n| n as f64);
            all.push((frame.volume as usize, world.at(DVec3::from(cell)), value - shift));
        }
    }
    all
}

/// Checks each voxel against what another program read.
pub fn agrees(recording: Recording, expected: &Expected, name: &str) {
    let [x, y, z] = expected.affine;
    let to_world = DMat4::from_cols_array_2d(&[x, y, z, [0.0, 0.0, 0.0, 1.0]]).transpose();
    let to_index = to_world.inverse();
    let [columns, rows, slices] = expected.size;
    let all = voxels(recording);
    assert_eq!(all.len(), columns * rows * slices * expected.volumes, "{name}");
    let mut seen = vec![false; all.len()];
    for (volume, place, value) in all {
        let index = to_index.transform_point3(place);
        assert!(index.distance(index.round()) < 1e-4, "{name}: {place} lies between voxels: {index}");
        let cell = index.round().to_array().map(|n| n as usize);
        let n = ((volume * slices + cell[2]) * rows + cell[1]) * columns + cell[0];
        assert!(!std::mem::replace(&mut seen[n], true), "{name}: a voxel comes twice");
        assert!(
            (value - expected.values[n]).abs() <= expected.tolerance.max(1e-5),
            "{name}: {value} at {cell:?}, not {}",
            expected.values[n]
        );
    }
}

#[test]
fn every_voxel_has_the_value_and_place_that_other_programs_read() {
    let all = expected();
    assert!(all.len() >= 15);
    for (name, expected) in &all {
        let recording = open(&data("formats").join(name));
        assert!(!recording.world().expect("a world").is_left_handed(), "{name} is drawn right-handed");
        agrees(recording, expected, name);
    }
}

#[test]
fn any_depth_axis_keeps_every_voxel_in_its_place() {
    for axis in ["x", "y", "z", "-x", "-y", "-z"] {
        for name in ["mirrored.nii.gz", "big-endian-4d.nii", "raw-ras.nrrd"] {
            let options = OpenOptions { depth_axis: Some(axis.parse().expect("an axis")), ..OpenOptions::default() };
            let path = data("formats").join(name);
            let recording = Recording::open_with(&path, options).expect("read");
            let (Geometry::Cartesian(grid), world) = (recording.geometry(0), recording.world().expect("a world"))
            else {
                panic!("a Cartesian volume")
            };
            assert!(!world.is_left_handed());
            // The depth of the drawing runs along the axis that was asked for.
            let all = expected();
            let [x, y, z] = all[name].affine;
            let n = ["x", "y", "z"].iter().position(|a| axis.ends_with(a)).expect("an axis");
            let along = DVec3::new(x[n], y[n], z[n]) * if axis.starts_with('-') { -1.0 } else { 1.0 };
            assert!(world.axis(1).distance(along) < 1e-6, "{name} {axis}: {} {along}", world.axis(1));
            assert_eq!(grid.size[1], all[name].size[n]);
            agrees(recording, &all[name], name);
        }
    }
    let sweep = Recording::open_with(
        &data("wobbler-4dc7/sweep.mha"),
        OpenOptions { depth_axis: Some("x".parse().expect("an axis")), ..OpenOptions::default() },
    );
    assert!(sweep.is_err_and(|e| e.to_string().contains("--depth-axis")));
}

/// A volume of one slice whose pixels tell where they are drawn.
fn image(matrix: &str, more: &str) -> Vec<u8> {
    let header = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n\
         TransformMatrix = {matrix}\n{more}ElementDataFile = LOCAL\n"
    );
    [header.into_bytes(), (0..12).collect()].concat()
}

/// The frames of a file in the order of their slices.
fn drawn(path: &str) -> Vec<Vec<u8>> {
    let mut recording = open(Path::new(path));
    let mut slices = BTreeMap::new();
    while let Some(frame) = recording.next_frame().expect("a frame") {
        slices.insert(frame.slice, frame.bytes);
    }
    slices.into_values().collect()
}

#[test]
fn a_mirrored_volume_looks_mirrored_and_a_turned_one_does_not() {
    let folder = Folder::new("mirrored");
    let at = |name: &str, matrix: &str| folder.write(name, image(matrix, ""));
    let plain = drawn(&at("plain.mha", "1 0 0 0 1 0 0 0 1"));
    assert_eq!(plain[0], [0, 1, 2, 3, 4, 5]);
    let rows = |frame: &[u8]| frame.chunks(3).flat_map(|row| row.iter().rev().copied()).collect::<Vec<u8>>();
    let mirrored = at("mirrored.mha", "-1 0 0 0 1 0 0 0 1");
    assert_eq!(drawn(&mirrored), plain.iter().map(|f| rows(f)).collect::<Vec<_>>());
    let said = open(Path::new(&mirrored)).description();
    assert!(said.iter().any(|(title, text)| title == "handedness" && text.contains("mirrored")), "{said:?}");
    let upside = at("upside.mha", "1 0 0 0 1 0 0 0 -1");
    assert_eq!(drawn(&upside), [plain[1].clone(), plain[0].clone()]);
    assert_eq!(drawn(&at("turned.mha", "-1 0 0 0 -1 0 0 0 1")), plain, "half a turn is no mirror");
}

#[test]
fn plus_orientations_are_drawn_marked_far_ascending() {
    let folder = Folder::new("plus");
    let frame = |word: &str| {
        let more = format!("UltrasoundImageOrientation = {word}\nSeq_Frame0000_Timestamp = 0\n");
        drawn(&folder.write("p.mha", image("1 0 0 0 1 0 0 0 1", &more)))[0].clone()
    };
    assert_eq!(frame("MF"), [6, 7, 8, 9, 10, 11], "the last frame of one slice");
    assert_eq!(frame("UF"), [8, 7, 6, 11, 10, 9]);
    assert_eq!(frame("MN"), [9, 10, 11, 6, 7, 8]);
    assert_eq!(frame("UN"), [11, 10, 9, 8, 7, 6]);
    let volume = |word: &str| {
        let more = format!("UltrasoundImageOrientation = {word}\n");
        drawn(&folder.write("v.mha", image("1 0 0 0 1 0 0 0 1", &more))).concat()
    };
    assert_eq!(volume("MFD"), [6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5]);
    assert_eq!(volume("AMF"), [0, 3, 6, 9, 1, 4, 7, 10, 2, 5, 8, 11], "x ascends, y is lateral, z is depth");
}

/// Copies a file by the program.
fn converted(name: &str, to: &str, folder: &Folder) -> PathBuf {
    let from = data("formats").join(name);
    let out = folder.path(to);
    let (code, _, said) = program::run(&["convert", from.to_str().expect("a plain name"), &out]);
    assert_eq!(code, Some(0), "{name} to {to}: {said}");
    out.into()
}

#[test]
fn converted_volumes_keep_lattice_values_and_place() {
    let folder = Folder::new("kept");
    let all = expected();
    for name in ["both.nii", "mirrored.nii.gz", "char.mha", "raw-ras.nrrd", "bzip2-las.nrrd"] {
        for to in ["copy.mha", "copy.nrrd", "copy.nii", "copy.nii.gz"] {
            let recording = open(&converted(name, to, &folder));
            agrees(recording, &all[name], &format!("{name} to {to}"));
        }
    }
    assert_eq!(folder.names().len(), 4, "nothing is left beside the volumes");
}

/// nibabel wrote the same image with both matrices: the same header, where it says anything of the image, and the same samples.
#[test]
fn a_written_nifti_header_is_that_of_nibabel() {
    let folder = Folder::new("nifti");
    let ours = std::fs::read(converted("both.nii", "ours.nii", &folder)).expect("written");
    let theirs = std::fs::read(data("formats/both.nii")).expect("stored");
    assert_eq!(ours.len(), theirs.len());
    // Sizes, number type and bits, offset, units, codes, magic, and the samples.
    for range in [0..4, 40..56, 70..74, 108..112, 123..124, 252..256, 344..348, 352..ours.len()] {
        assert_eq!(ours[range.clone()], theirs[range.clone()], "bytes {range:?}");
    }
    let real = |bytes: &[u8], at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    for at in (76..92).chain(256..328).step_by(4) {
        let (a, b) = (real(&ours, at), real(&theirs, at));
        assert!((a - b).abs() <= 2e-6 * b.abs().max(1.0), "byte {at}: {a}, not {b}");
    }
}

/// The fields of a MetaImage header that SimpleITK wrote, and those written here for the same image.
#[test]
fn a_written_metaimage_header_is_that_of_simpleitk() {
    let folder = Folder::new("metaimage");
    let fields = |path: &Path| {
        let bytes = std::fs::read(path).expect("read");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let lines = text.lines().filter_map(|line| line.split_once(" = "));
        lines.map(|(key, value)| (key.to_string(), value.to_string())).collect::<BTreeMap<_, _>>()
    };
    let ours = fields(&converted("short.mha", "ours.mha", &folder));
    let theirs = fields(&data("formats/short.mha"));
    for key in ["TransformMatrix", "Offset", "ElementSpacing", "DimSize"] {
        let numbers = |fields: &BTreeMap<String, String>| -> Vec<f64> {
            fields[key].split(' ').map(|word| word.parse().expect("a number")).collect()
        };
        let (a, b) = (numbers(&ours), numbers(&theirs));
        assert!(a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9), "{key}: {a:?}, not {b:?}");
    }
    assert_eq!(ours["ElementType"], theirs["ElementType"]);
}

#[test]
fn a_resampled_volume_stays_where_it_is() {
    let folder = Folder::new("resampled");
    let from = data("formats/both.nii");
    let out = folder.path("finer.nrrd");
    let (code, _, said) = program::run(&["convert", from.to_str().expect("a plain name"), &out, "--spacing", "0.25"]);
    assert_eq!(code, Some(0), "{said}");
    let (coarse, fine) = (open(&from), open(Path::new(&out)));
    let (a, b) = (coarse.world().expect("a world"), fine.world().expect("a world"));
    // Voxel (2, 3, 5) of 0.25 mm is (1, 1, 1) of 0.5 x 0.75 x 1.25 mm.
    assert!(b.at(DVec3::new(2.0, 3.0, 5.0)).distance(a.at(DVec3::ONE)) < 1e-5);
    let there: Vec<f64> = voxels(coarse).into_iter().map(|(_, _, v)| v).collect();
    let Geometry::Cartesian(grid) = fine.geometry(0) else { panic!("a Cartesian volume") };
    let resampled: Vec<f64> = voxels(fine).into_iter().map(|(_, _, v)| v).collect();
    let n = (5 * grid.size[1] + 3) * grid.size[0] + 2;
    assert_eq!(resampled[n], there[(4 + 1) * 5 + 1]);
}

/// Decibels of no echo in UFF: what is drawn black.
const DECIBELS: f64 = -60.0;

#[test]
fn outside_is_told_from_zero_by_a_value_or_a_mask() {
    let folder = Folder::new("outside");
    let sweep = data("wobbler-4dc7/sweep.mha");
    let (volume, mask) = (folder.path("volume.mha"), folder.path("mask.nrrd"));
    let from = sweep.to_str().expect("a plain name");
    let (code, _, said) =
        program::run(&["convert", from, &volume, "--spacing", "3", "--outside", "7", "--mask", &mask]);
    assert_eq!(code, Some(0), "{said}");
    let values = |path: &str| voxels(open(Path::new(path))).into_iter().map(|(_, _, v)| v).collect::<Vec<_>>();
    let (volume, mask) = (values(&volume), values(&mask));
    assert!(mask.contains(&0.0) && mask.contains(&1.0) && mask.iter().all(|v| *v == 0.0 || *v == 1.0));
    assert!(volume.iter().zip(&mask).all(|(v, inside)| *inside == 1.0 || *v == 7.0));
    for (value, named) in [("256", "256"), ("-1", "-1"), ("0.5", "0.5")] {
        let (code, _, said) = program::run(&["convert", from, &folder.path("no.mha"), "--outside", value]);
        assert!(code == Some(2) && said.contains(named) && said.contains("--outside"), "{said}");
    }
    // Without a value it is that of no echo: of decibels their floor.
    for (recording, floor) in
        [("wobbler-4dc7/sweep.mha", 0.0), ("uff/decibels.uff", DECIBELS), ("uff/sector.uff", DECIBELS)]
    {
        let from = data(recording);
        let from = from.to_str().expect("a plain name");
        let (volume, mask) = (folder.path("v.mha"), folder.path("m.nrrd"));
        let (code, out, said) = program::run(&["convert", from, &volume, "--spacing", "1", "--mask", &mask]);
        assert_eq!(code, Some(0), "{said}");
        let (volume, mask) = (values(&volume), values(&mask));
        assert!(
            mask.contains(&0.0) && volume.iter().zip(&mask).all(|(v, inside)| *inside == 1.0 || *v == floor),
            "{recording}"
        );
        assert!(out.contains(&format!(", {floor} outside of the sector")), "{out}");
    }
    let (code, _, said) = program::run(&["convert", from, &folder.path("few.mha"), "--spacing", "50"]);
    assert!(code == Some(0) && said.contains("--spacing 50 mm leaves"), "{said}");
}

#[test]
fn a_volume_in_memory_is_written_with_its_own_voxels() {
    let folder = Folder::new("memory");
    let mut recording = open(&data("formats/short.mha"));
    let geometry = recording.geometry(0);
    let Geometry::Cartesian(grid) = geometry else { panic!("a Cartesian volume") };
    let mut volume = Volume::new(geometry, recording.stored_type());
    while let Some(frame) = recording.next_frame().expect("a frame") {
        volume.take(frame);
    }
    let target = Target::new(grid, SampleType::I16);
    let path = folder.join("v.nii.gz");
    volume.write(&target, &path, || ()).expect("written");
    assert_eq!(open(&path).world().map(|w| w.nearest()), Some(World::of(&grid).nearest()));
    let missing = folder.join("no/v.nii.gz");
    assert!(volume.write(&target, &missing, || ()).is_err() && !missing.exists());
}

#[test]
fn files_of_other_kinds_are_named_with_what_is_read() {
    let folder = Folder::new("kinds");
    let kinds: [(&str, &[u8], &str); 3] = [
        ("page.nrrd", b"%PDF-1.4", "is a PDF document"),
        ("beam.uff", b"\x89HDF\r\n", "is an HDF5 file"),
        ("what.bin", b"\x00\x01\x02", "is of no known format"),
    ];
    for (name, bytes, kind) in kinds {
        let error = Recording::open(Path::new(&folder.write(name, bytes)), None).err().expect("refused").to_string();
        assert!(error.contains(kind) && error.contains("NIfTI (.nii, .hdr)") && error.lines().count() == 1, "{error}");
    }
    // The content decides, not the name.
    let renamed = folder.write("renamed.mha", std::fs::read(data("formats/both.nii")).expect("stored"));
    assert_eq!(open(Path::new(&renamed)).format(), "NIfTI-1");
}

#[test]
fn any_recording_may_be_packed_by_gzip() {
    let folder = Folder::new("gzip");
    for name in ["wobbler-4dc7/sweep.vol", "wobbler-4dc7/sweep.mha", "formats/raw-ras.nrrd", "formats/both.nii"] {
        let plain = std::fs::read(data(name)).expect("stored");
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(&plain).expect("packed");
        let packed = packed.finish().expect("packed");
        let path = folder.write("packed.gz", &packed);
        let frames = |mut recording: Recording| {
            let mut all = Vec::new();
            while let Some(frame) = recording.next_frame().expect("a frame") {
                all.push(frame.bytes);
            }
            all
        };
        assert_eq!(open(Path::new(&path)).geometry(0), open(&data(name)).geometry(0), "{name}");
        assert!(frames(open(Path::new(&path))) == frames(open(&data(name))), "{name}");
        let cut = folder.write("cut.gz", &packed[..packed.len() - 9]);
        let read = Recording::open(Path::new(&cut), None).and_then(|mut r| {
            while r.next_frame()?.is_some() {}
            Ok(())
        });
        assert!(read.is_err_and(|e| e.to_string().lines().count() == 1), "{name} is cut short");
    }
}

/// Prevents that a whole recording is refused for what a tape or another program left behind the gzip stream.
#[test]
fn what_follows_a_gzip_stream_does_not_spoil_it() {
    let folder = Folder::new("gzip-tail");
    let plain = std::fs::read(data("formats/both.nii")).expect("stored");
    let member = |bytes: &[u8]| {
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(bytes).expect("packed");
        packed.finish().expect("packed")
    };
    let whole = member(&plain);
    let in_two = [member(&plain[..400]), member(&plain[400..])].concat();
    for (what, bytes) in [
        ("zeros", [&whole[..], &[0; 700]].concat()),
        ("text", [&whole[..], b"signature"].concat()),
        ("half of a mark", [&whole[..], &[0x1f]].concat()),
        ("a mark and no member", [&whole[..], &[0x1f, 0x8b, 9, 9], &[0; 20]].concat()),
        ("two members", in_two.clone()),
        ("two members and zeros", [&in_two[..], &[0; 5]].concat()),
    ] {
        let path = folder.write("tail.nii.gz", &bytes);
        assert!(voxels(open(Path::new(&path))) == voxels(open(&data("formats/both.nii"))), "{what}");
    }
    // Where the second member is cut, the recording is.
    let cut = folder.write("cut.nii.gz", &in_two[..in_two.len() - 9]);
    let read = Recording::open(Path::new(&cut), None).and_then(|mut r| {
        while r.next_frame()?.is_some() {}
        Ok(())
    });
    assert!(read.is_err_and(|e| e.to_string().lines().count() == 1));
}

#[test]
fn the_note_on_the_files_names_every_one() {
    let note = std::fs::read_to_string(repository("tests/data/README.md")).expect("the note");
    assert!(note.contains("formats/make.py") && note.contains("nibabel") && note.contains("pynrrd"));
}
