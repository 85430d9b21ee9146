//! Sweeps in both directions, and which geometry has precedence.

use super::recordings::*;
use echolume::Source;
use echolume::low_level::probe::ProbeFile;
const TABLE: &str = "[array]\nkind = 'linear'\n[lines]\nwidth_mm = 20\n[depth]\nend_mm = 3\n[motion]\nkind = 'translated'\n\
                     frame_positions_mm = [0, 1, 3]\nframes_per_volume = 3\nboth_ways = true\nspeed_ratio = 0.5\n";

#[test]
fn forward_and_backward_sweeps_keep_their_slices_in_geometric_order() {
    let folder = Folder::new("there-and-back");
    let data: Vec<u8> = (0..7).flat_map(|frame| [frame; 8]).collect();
    folder.write("s.probe.toml", TABLE);
    let more = "UltrasoundImageType = BRIGHTNESS\nUltrasoundImageOrientation = FM\n";
    let mut recording = open(folder.write("s.mha", image("4 2 7", "MET_UCHAR", more, &data)));
    assert_eq!(recording.volumes(), 2);
    let frames = all_frames(&mut recording).unwrap();
    let order: Vec<_> = frames.iter().map(|f| (f.volume, f.number, f.slice, f.backward, f.bytes[0])).collect();
    assert_eq!(order[..3], [(0, 0, 0, false, 0), (0, 1, 1, false, 1), (0, 2, 2, false, 2)]);
    assert_eq!(order[3..], [(1, 0, 2, true, 3), (1, 1, 1, true, 4), (1, 2, 0, true, 5)]);
    let advance = |volume| match recording.geometry(volume) {
        Geometry::Sweep(probe) => probe.advance,
        Geometry::Cartesian(_) => panic!("it is a sweep"),
    };
    assert_eq!(advance(0), Advance::Each(vec![0.5, 1.0, 1.0]));
    assert_eq!(advance(1), Advance::Each(vec![-0.5, -0.5, -1.0]));
}

#[test]
fn a_given_probe_file_wins_over_one_of_the_recording_and_that_over_the_header() {
    let folder = Folder::new("precedence");
    let sweep = folder.write("sweep.mha", fs::read(stored("wobbler-4dc7/sweep.mha")).unwrap());
    let text = fs::read_to_string(stored("wobbler-4dc7/probe.toml")).unwrap();
    let with_radius = |mm: &str| text.replace("radius_mm = 39.8 ", &format!("radius_mm = {mm} "));
    let radius = |given| probe_of(&Recording::open(sweep.as_ref(), given).unwrap()).array_radius();
    assert_eq!(radius(None), 39.8);
    folder.write("probe.toml", with_radius("41"));
    assert_eq!(radius(None), 39.8, "the header states the geometry");
    let rows = Recording::open(sweep.as_ref(), None).unwrap().description();
    assert!(rows.iter().any(|(title, text)| title == "not used" && text.contains("probe.toml")), "{rows:?}");
    folder.write("sweep.probe.toml", with_radius("42"));
    assert_eq!(radius(None), 42.0);
    let given = folder.write("other.toml", with_radius("43"));
    assert_eq!(radius(Some(given.as_ref())), 43.0);
}

#[test]
fn lines_stored_in_reverse_are_put_in_order() {
    let folder = Folder::new("turned");
    folder.write("probe.toml", TABLE.replace("frames_per_volume = 3", ""));
    let data: Vec<u8> = (0..24).collect();
    let path = folder.write("t.mha", image("4 2 3", "MET_UCHAR", "UltrasoundImageOrientation = FU\n", &data));
    assert_eq!(total(&path).unwrap()[..12], [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15]);
}

#[test]
fn the_range_of_the_probe_file_is_in_the_units_of_the_recording() {
    let folder = Folder::new("range");
    folder
        .write("probe.toml", format!("{}[samples]\nrange = [-100, 400]\n", TABLE.replace("frames_per_volume = 3", "")));
    let path = folder.write("r.mha", image("4 2 3", "MET_SHORT", "", &[0; 48]));
    assert_eq!(open(&path).range(), [32668.0, 33168.0]);
}

/// For the motor, too, which asks for it without opening the recording.
#[test]
fn a_packed_recording_has_the_probe_file_of_the_recording() {
    let folder = Folder::new("packed-probe");
    let [packed, shared, own] = ["sweep.mha.gz", "probe.toml", "sweep.probe.toml"].map(|name| folder.join(name));
    assert_eq!(ProbeFile::find_for(&packed), None);
    for file in [shared, own] {
        std::fs::write(&file, "").expect("written");
        assert_eq!(ProbeFile::find_for(&packed), Some(file));
    }
    assert_eq!(ProbeFile::find_for(&folder.join("sweep.mha")), ProbeFile::find_for(&packed));
}

/// The folder's probe.toml is for recordings that do not say where their samples lie. Kretz volumes and converted volumes do.
#[test]
fn the_probe_file_of_the_folder_serves_only_recordings_without_geometry() {
    let folder = Folder::new("folder-probe");
    folder.write("probe.toml", TABLE.replace("frames_per_volume = 3", ""));
    let is_sweep =
        |name: &str, bytes: Vec<u8>| matches!(open(folder.write(name, bytes)).geometry(0), Geometry::Sweep(_));
    let data = [0; 24];
    assert!(is_sweep("bare.mha", image("4 2 3", "MET_UCHAR", "", &data)));
    let lines = "UltrasoundImageOrientation = FM\nElementSpacing = 1 1 1\n";
    assert!(is_sweep("lines.mha", image("4 2 3", "MET_UCHAR", lines, &data)));
    for placed in ["ElementSpacing = 1 1 1\n", "Offset = 0 0 0\n", "TransformMatrix = 1 0 0 0 1 0 0 0 1\n"] {
        assert!(!is_sweep("placed.mha", image("4 2 3", "MET_UCHAR", placed, &data)), "{placed}");
    }
    let volume = open(folder.write("v.vol", kretz(&[-0.1, 0.0, 0.1], &[-0.1, 0.1], b"")));
    assert_eq!(probe_of(&volume).array_radius(), 40.0);
}

/// The PLUS toolkit writes "domain domain list" into volumes that it reconstructs. Only frames with `Seq_` fields are a sequence.
#[test]
fn a_list_without_fields_of_frames_is_a_volume() {
    let folder = Folder::new("kinds");
    let kinds = "Kinds = domain domain list\nElementSpacing = 1 2 3\n";
    let shape = |more: &str| {
        let recording = open(folder.write("k.mha", image("4 2 3", "MET_UCHAR", more, &[7; 24])));
        (recording.volumes(), recording.frames_per_volume())
    };
    assert_eq!(shape(kinds), (1, 3));
    assert_eq!(shape(&format!("{kinds}Seq_Frame0000_Timestamp = 0\n")), (3, 1));
}
