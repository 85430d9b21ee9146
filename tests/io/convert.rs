//! Sweeps converted to Cartesian volumes: correct inside the sector, empty outside, and read back without a change.

use crate::common::files::{Folder, SWEEP};
use crate::common::probes::wobbler;
use crate::common::program;
use echolume::Source;
use echolume::low_level::probe::{Advance, Axis, Geometry, Grid, Indices, Probe};
use echolume::low_level::source::convert::{Target, Volume, lattice};
use echolume::low_level::source::volume_file::VolumeFile;
use echolume::low_level::source::{Frame, Recording, SampleType, StoredType};
use glam::DVec3;
use std::io::Read;
use std::path::Path;

fn probe() -> Probe {
    Probe {
        lines: Axis::centred(0.02, 60),
        sample_pitch: 0.4,
        samples: 128,
        slices: Axis::centred(0.02, 27),
        advance: Advance::Same(0.008),
        ..wobbler()
    }
}

/// Linear in every coordinate, so that only the curvature of the polar lattice between samples remains as an error.
fn field(p: DVec3) -> f64 {
    20_000.0 + 150.0 * p.x + 90.0 * p.y - 120.0 * p.z
}

fn filled(probe: &Probe) -> Volume {
    let mut volume = Volume::new(Geometry::Sweep(probe.clone()), StoredType::U16);
    for k in 0..probe.slices.len() {
        let value = |i: usize, j: usize| {
            field(probe.to_space(Indices { sample: i as f64, line: j as f64, slice: k as f64 })).round() as u16
        };
        let lines = 0..probe.lines.len();
        let bytes = lines.flat_map(|j| (0..probe.samples).flat_map(move |i| value(i, j).to_le_bytes())).collect();
        volume.take(Frame::of_slice(0, k, bytes));
    }
    volume
}

#[test]
fn converted_voxels_have_the_fields_value_and_none_outside_the_sector() {
    let probe = probe();
    let volume = filled(&probe);
    let (mut inside, mut outside, mut worst) = (0, 0, 0.0f64);
    let grid = lattice(&Geometry::Sweep(probe.clone()), 2.3).expect("a lattice");
    for n in 0..grid.size.iter().product() {
        let cell = [n % grid.size[0], n / grid.size[0] % grid.size[1], n / (grid.size[0] * grid.size[1])];
        let place = DVec3::from(grid.origin) + 2.3 * DVec3::from_array(cell.map(|n| n as f64));
        let at = probe.to_indices(place);
        let within = |i: f64, n: usize| i >= 0.0 && i <= (n - 1) as f64;
        let is_inside = within(at.sample, probe.samples)
            && within(at.line, probe.lines.len())
            && within(at.slice, probe.slices.len());
        match volume.at(place) {
            Some(value) => {
                inside += 1;
                worst = worst.max((value - field(place)).abs());
                assert!(is_inside, "{place} lies outside");
            }
            None => {
                outside += 1;
                assert!(!is_inside, "{place} lies inside");
            }
        }
    }
    println!("{inside} places inside, {outside} outside, worst error {worst} of 65535");
    assert!(inside > 1000 && outside > 1000);
    // The chord of a line's pitch at 73 mm is off its arc by 3.7 um, of a slice's by 3.2 um: a unit at most, and one for rounding.
    assert!(worst < 2.0, "{worst}");
}

#[test]
fn a_written_volume_is_read_back_voxel_by_voxel() {
    let folder = Folder::new("round");
    let volume = filled(&probe());
    let grid = lattice(&Geometry::Sweep(probe()), 1.7).expect("a lattice");
    for (sample, shift) in [(SampleType::U16, 0.0), (SampleType::I16, 32768.0)] {
        let path = folder.join("volume.mha");
        let done = std::sync::atomic::AtomicUsize::new(0);
        volume
            .write(&Target::new(grid, sample), &path, || {
                done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            })
            .expect("written");
        assert_eq!(done.into_inner(), grid.size[2]);
        let mut back = Recording::open(&path, None).expect("read");
        let Geometry::Cartesian(there) = back.geometry(0) else { panic!("a Cartesian volume") };
        assert_eq!(there.size, grid.size);
        for axis in 0..3 {
            assert!((there.origin[axis] - grid.origin[axis]).abs() < 1e-9);
            assert!((there.spacing[axis] - 1.7).abs() < 1e-12);
        }
        for z in 0..grid.size[2] {
            let frame = back.next_frame().expect("read").expect("a slice");
            let values: Vec<u16> = frame.bytes.as_chunks::<2>().0.iter().map(|b| u16::from_le_bytes(*b)).collect();
            for (n, stored) in values.into_iter().enumerate() {
                let cell = [n % grid.size[0], n / grid.size[0], z].map(|n| n as f64);
                let place = DVec3::from(grid.origin) + 1.7 * DVec3::from_array(cell);
                // Outside is the file's zero, which an i16 stores as 32768.
                let expected = volume.at(place).map_or(shift, f64::round);
                assert_eq!(f64::from(stored), expected, "{sample} at {place}");
            }
        }
    }
    let path = folder.join("volume.nrrd");
    volume.write(&Target::new(grid, SampleType::U16), &path, || {}).expect("written");
    let bytes = std::fs::read(&path).expect("read");
    let end = bytes.windows(2).position(|w| w == b"\n\n").expect("the header's end") + 2;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let [x, y, z] = grid.size;
    for line in ["NRRD0004", "type: uint16", &format!("sizes: {x} {y} {z}"), "encoding: raw", "endian: little"] {
        assert!(header.lines().any(|l| l == line), "{header}");
    }
    assert_eq!(bytes.len() - end, x * y * z * 2);
}

#[test]
fn no_lattice_is_too_large_to_be_refused() {
    let geometry = Geometry::Sweep(probe());
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e-4, 4e-3] {
        let refused = lattice(&geometry, spacing).expect_err("refused");
        assert!(refused.starts_with(&format!("{spacing} mm: ")), "{refused}");
    }
    assert_eq!(lattice(&geometry, 1e9).expect("a voxel").size, [1; 3]);
    let same = Grid { size: [7, 5, 3], spacing: [0.5; 3], origin: [-1.0, 2.0, 3.0] };
    assert_eq!(lattice(&Geometry::Cartesian(same), 0.5).expect("a lattice"), same);
    assert!(VolumeFile::of(Path::new("a.MHA")).is_ok() && VolumeFile::of(Path::new("a.mhd")).is_err());
}

#[test]
fn the_command_writes_a_volume_or_one_line_and_nothing() {
    let folder = Folder::new("command");
    let out = folder.join("volume.mha");
    let run = |arguments: &[&str]| program::run(&[&["convert"], arguments].concat());
    let to = out.to_str().expect("a plain name");
    assert_eq!(run(&[SWEEP, to, "--spacing", "2"]).0, Some(0));
    let before = std::fs::read(&out).expect("written");
    for (arguments, named) in [
        (vec![SWEEP, to, "--spacing", "0"], "--spacing 0 mm"),
        (vec![SWEEP, to, "--spacing", "-3"], "--spacing -3 mm"),
        (vec![SWEEP, to, "--spacing", "1e-5"], "voxels"),
        (vec![SWEEP, to, "--volume", "9"], "--volume 9"),
        (vec![SWEEP, "/dev/null/volume.mha"], "/dev/null/volume.mha"),
        (vec![SWEEP, "volume.png"], "must end in .mha, .nrrd"),
        (vec![SWEEP, "face.stl"], "`echolume mesh`"),
        (vec!["nothing.mha", to], "nothing.mha"),
        (vec![to, to], "would replace an input"),
    ] {
        let (code, _, said) = run(&arguments);
        assert!(matches!(code, Some(1 | 2)), "{arguments:?}: {code:?} {said}");
        assert!(said.contains(named) && said.trim().lines().count() == 1, "{arguments:?}: {said}");
    }
    assert_eq!(std::fs::read(&out).expect("still there"), before);
    assert!(folder.names().iter().eq(["volume.mha"]), "a part of a file is left: {:?}", folder.names());
}

/// A NRRD of three volumes of 3 x 2 x 2 bytes, 0 to 35.
fn volumes(folder: &Folder, name: &str, times: &str) -> String {
    let header = format!(
        "NRRD0004\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\nsizes: 3 2 2 3\n\
         space directions: (0.5,0,0) (0,1,0) (0,0,2) none\nspace origin: (-3,7,0)\nkinds: domain domain domain list\n\
         encoding: raw\n{times}\n"
    );
    folder.write(name, [header.as_bytes(), &(0..36).collect::<Vec<u8>>()].concat())
}

/// Volume, slice, time and samples of every frame.
fn frames(path: impl AsRef<Path>) -> Vec<(u32, usize, Option<f64>, Vec<u8>)> {
    let mut recording = Recording::open(path.as_ref(), None).unwrap_or_else(|e| panic!("{e}"));
    let next = || recording.next_frame().unwrap_or_else(|e| panic!("{e}"));
    std::iter::from_fn(next).map(|frame| (frame.volume, frame.slice, frame.time, frame.bytes)).collect()
}

#[test]
fn all_volumes_and_their_times_become_a_sequence() {
    let folder = Folder::new("sequence");
    let timed = "units: \"\" \"\" \"\" \"ms\"\naxis 3 index values:=0 50 125\n";
    let (from, out) = (volumes(&folder, "timed.nrrd", timed), folder.join("out.SEQ.nrrd"));
    let to = out.to_str().expect("a plain name");
    let (code, said, remarks) = program::run(&["convert", &from, to]);
    assert_eq!((code, remarks.as_str()), (Some(0), ""));
    assert!(said.contains("3 volumes of 3 x 2 x 2 voxels"), "{said}");
    let bytes = std::fs::read(&out).expect("written");
    let end = bytes.windows(2).position(|w| w == b"\n\n").expect("an end of the header") + 2;
    let header = String::from_utf8(bytes[..end].to_vec()).expect("text");
    for line in [
        "NRRD0004",
        "dimension: 4",
        "space: left-posterior-superior",
        "sizes: 3 2 2 3",
        "space directions: (0.5,0,0) (0,1,0) (0,0,2) none",
        "space origin: (-3,7,0)",
        "kinds: domain domain domain list",
        "labels: \"\" \"\" \"\" \"time\"",
        "units: \"\" \"\" \"\" \"s\"",
        "encoding: gzip",
        "DataNodeClassName:=vtkMRMLScalarVolumeNode",
        "axis 3 index type:=numeric",
        "axis 3 index values:=0 0.05 0.125",
    ] {
        assert!(header.lines().any(|there| there == line), "no {line} in\n{header}");
    }
    let mut samples = Vec::new();
    flate2::read::GzDecoder::new(&bytes[end..]).read_to_end(&mut samples).expect("unpacked");
    assert_eq!(samples, (0..36).collect::<Vec<u8>>());
    assert_eq!(frames(&out), frames(&from));
    assert_eq!(frames(&out)[5].2, Some(0.125), "the time of the last volume");
    // One of them.
    assert_eq!(program::run(&["convert", &from, to, "--volume", "1"]).0, Some(0));
    assert_eq!(frames(&out), [0, 1].map(|slice| (0, slice, Some(0.05), frames(&from)[2 + slice].3.clone())));
}

#[test]
fn a_sequence_without_rising_times_has_none_and_says_why() {
    let folder = Folder::new("untimed");
    let out = folder.join("out.seq.nrrd");
    let unit = "units: \"\" \"\" \"\" \"s\"\naxis 3 index values:=";
    for (times, why) in [(String::new(), "have no time stamps"), (format!("{unit}0 2 2\n"), "do not rise")] {
        let from = volumes(&folder, "from.nrrd", &times);
        let (code, _, remarks) = program::run(&["convert", &from, out.to_str().expect("a plain name")]);
        assert_eq!((code, remarks.lines().count()), (Some(0), 1), "{remarks}");
        assert!(remarks.contains(why), "{remarks}");
        let text = std::fs::read(&out).expect("written");
        let text = String::from_utf8_lossy(&text);
        assert!(text.contains("\"frame\"\n") && !text.contains("index") && !text.contains("\nunits"), "{text}");
        let untimed = frames(&from).into_iter().map(|(volume, slice, _, bytes)| (volume, slice, None, bytes));
        assert!(frames(&out).into_iter().eq(untimed), "{why}");
    }
}

#[test]
fn a_sequence_of_a_sweep_holds_its_whole_volumes_as_they_are_alone() {
    let folder = Folder::new("swept");
    let path = |name: &str| folder.join(name).to_str().expect("a plain name").to_string();
    let run = |arguments: &[&str]| {
        let (code, said, remarks) = program::run(arguments);
        assert_eq!(code, Some(0), "{arguments:?}: {remarks}");
        said + &remarks
    };
    let [sweep, whole, cut] = ["sweep.mha", "whole.frames", "cut.frames"].map(path);
    run(&["phantom", "-o", &sweep, "--volumes", "3", "--frames", "4", "--lines", "16"]);
    run(&["convert", &sweep, &whole]);
    let mut bytes = std::fs::read(&whole).expect("recorded");
    bytes.truncate(bytes.len() * 11 / 12 - 100);
    std::fs::write(&cut, bytes).expect("written");
    let (spacing, out) = (["--spacing", "4"], path("out.seq.nrrd"));
    assert!(run(&[&["convert", &cut, &out][..], &spacing].concat()).contains("2 volumes of"));
    let together = frames(&out);
    for volume in ["0", "1"] {
        let alone = path("alone.nrrd");
        run(&[&["convert", &sweep, &alone, "--volume", volume][..], &spacing].concat());
        let alone = frames(&alone).into_iter().map(|(_, slice, _, bytes)| (slice, bytes));
        let there = together.iter().filter(|(number, ..)| number.to_string() == volume);
        assert!(there.map(|(_, slice, _, bytes)| (*slice, bytes.clone())).eq(alone), "volume {volume}");
    }
    let times: Vec<Option<f64>> = together.iter().map(|frame| frame.2).collect();
    assert!(times.is_sorted() && times[0].is_some() && times[0] < times[times.len() - 1], "{times:?}");
}

#[test]
fn a_file_of_one_volume_says_that_there_are_more() {
    let folder = Folder::new("first");
    let from = volumes(&folder, "from.nrrd", "");
    for name in ["out.nrrd", "out.mha", "out.nii.gz", "out.dcm"] {
        let out = folder.join(name);
        let to = out.to_str().expect("a plain name");
        let (code, _, remarks) = program::run(&["convert", &from, to]);
        let said = "volume 1 of 3; NAME.seq.nrrd takes all";
        assert!(code == Some(0) && remarks.contains(said) && remarks.lines().count() == 1, "{name}: {remarks}");
        let (code, _, remarks) = program::run(&["convert", &from, to, "--volume", "0"]);
        assert_eq!((code, remarks.as_str()), (Some(0), ""), "{name}");
    }
    for (more, named) in [
        (["--mask", "mask.seq.nrrd"], "one volume is written"),
        (["--volume", "3"], "--volume 3: there are 3"),
        (["--spacing", "0"], "--spacing 0 mm"),
        (["--outside", "-1"], "--outside"),
    ] {
        let out = folder.join("all.seq.nrrd");
        let all = [&["convert", &from, out.to_str().expect("a plain name")], &more[..]].concat();
        let (code, _, said) = program::run(&all);
        assert!(code == Some(2) && said.contains(named) && said.lines().count() == 1, "{more:?}: {code:?} {said}");
        assert!(!out.exists());
    }
}
