//! Tracked pictures of the PLUS toolkit in a file become a freehand volume in its place.

use crate::common::files::{BONE, Folder, SWEEP, data};
use crate::common::program::run;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::source::{Calibration, OpenOptions, Source, description, open_with};
use glam::{DMat4, DVec3};
use std::path::Path;

const SIZE: [usize; 2] = [7, 5];
const PICTURES: usize = 6;
const PITCH: f64 = 0.5;

/// A place in the frame of the reference as a value.
fn value(place: DVec3) -> f64 {
    3.0 * place.x - 2.0 * place.y + 1.5 * place.z + 40.0
}

fn reference_to_tracker() -> DMat4 {
    DMat4::from_rotation_y(0.4) * DMat4::from_translation(DVec3::new(20.0, -7.0, 3.0))
}

/// Pictures half a millimetre apart, as the probe moves along its normal.
fn probe_to_tracker(n: usize) -> DMat4 {
    let turn = DMat4::from_rotation_z(0.3) * DMat4::from_rotation_x(-0.5);
    DMat4::from_translation(DVec3::new(100.0, 50.0, -30.0))
        * turn
        * DMat4::from_translation(DVec3::Z * PITCH * n as f64)
}

fn image_to_probe() -> DMat4 {
    DMat4::from_translation(DVec3::new(-1.5, 2.0, 0.0)) * DMat4::from_scale(DVec3::splat(PITCH))
}

fn rows(matrix: DMat4) -> String {
    matrix.transpose().to_cols_array().map(|v| v.to_string()).join(" ")
}

/// The sequence. `orientation`: of the stored pictures; UN has the last pixel first.
fn sequence(orientation: &str, lost: &[usize]) -> Vec<u8> {
    let mut header = format!(
        "ObjectType = Image\nNDims = 3\nDimSize = {} {} {PICTURES}\nElementType = MET_FLOAT\nElementSpacing = 1 1 1\n\
         UltrasoundImageOrientation = {orientation}\nUltrasoundImageType = BRIGHTNESS\n",
        SIZE[0], SIZE[1]
    );
    let mut samples = Vec::new();
    for n in 0..PICTURES {
        let status = if lost.contains(&n) { "INVALID" } else { "OK" };
        header += &format!(
            "Seq_Frame{n:04}_ProbeToTrackerTransform = {}\nSeq_Frame{n:04}_ProbeToTrackerTransformStatus = {status}\n\
             Seq_Frame{n:04}_ReferenceToTrackerTransform = {}\nSeq_Frame{n:04}_ReferenceToTrackerTransformStatus = OK\n",
            rows(probe_to_tracker(n)),
            rows(reference_to_tracker())
        );
        let to_reference = reference_to_tracker().inverse() * probe_to_tracker(n) * image_to_probe();
        let pixel = |k: usize| {
            let k = if orientation == "UN" { SIZE[0] * SIZE[1] - 1 - k } else { k };
            value(to_reference.transform_point3(DVec3::new((k % SIZE[0]) as f64, (k / SIZE[0]) as f64, 0.0)))
        };
        samples.extend((0..SIZE[0] * SIZE[1]).flat_map(|k| (pixel(k) as f32).to_le_bytes()));
    }
    [header.into_bytes(), b"ElementDataFile = LOCAL\n".to_vec(), samples].concat()
}

fn plus_config(reference: &str) -> String {
    format!(
        "<PlusConfiguration><CoordinateDefinitions><Transform From=\"Image\" To=\"Probe\" Matrix=\"{}\"/></CoordinateDefinitions>\
         <VolumeReconstructor ImageCoordinateFrame=\"Image\" ReferenceCoordinateFrame=\"{reference}\"/></PlusConfiguration>",
        rows(image_to_probe())
    )
}

/// All voxels with their places in the world.
fn voxels(mut source: Box<dyn Source>) -> Vec<(DVec3, f64)> {
    let (world, Geometry::Cartesian(grid)) = (source.world().expect("a place"), source.geometry(0)) else {
        panic!("a Cartesian volume")
    };
    let mut all = Vec::new();
    while let Some(frame) = source.next_frame().expect("a frame") {
        for (n, bytes) in frame.bytes.as_chunks::<4>().0.iter().enumerate() {
            let cell = [n % grid.size[0], n / grid.size[0], frame.slice].map(|n| n as f64);
            all.push((world.at(DVec3::from(cell)), f64::from(f32::from_le_bytes(*bytes))));
        }
    }
    all
}

#[test]
fn every_voxel_is_the_pixel_at_its_place_in_the_reference() {
    let folder = Folder::new("tracked");
    let xml = folder.write("plus.xml", plus_config("Reference"));
    let calibration: Calibration = format!("ImageToProbe={}", rows(image_to_probe())).parse().expect("a calibration");
    for orientation in ["MF", "UN"] {
        let path = folder.write("sweep.mha", sequence(orientation, &[]));
        let by_file = OpenOptions { plus_config: Some(Path::new(&xml)), ..OpenOptions::default() };
        let by_hand = OpenOptions { calibration: std::slice::from_ref(&calibration), ..OpenOptions::default() };
        for options in [by_file, by_hand] {
            let source = open_with(Path::new(&path), options).expect("a freehand volume");
            assert_eq!((source.volumes(), source.frames_per_volume()), (1, PICTURES));
            let all = voxels(source);
            assert_eq!(all.len(), SIZE[0] * SIZE[1] * PICTURES);
            for (place, found) in all {
                assert!((found - value(place)).abs() < 1e-3, "{orientation}: {found} at {place}, not {}", value(place));
            }
        }
        // In the frame of the tracker, the same values are elsewhere.
        let in_tracker = OpenOptions { reference: Some("Tracker"), ..by_file };
        let back = reference_to_tracker().inverse();
        for (place, found) in voxels(open_with(Path::new(&path), in_tracker).expect("a freehand volume")) {
            assert!((found - value(back.transform_point3(place))).abs() < 1e-3);
        }
        let said = description(Path::new(&path), by_file).expect("a description");
        assert!(
            said.rows.iter().any(|(title, text)| title == "placed" && text == "from Image to Reference"),
            "{said:?}"
        );
        // Without a calibration the pictures are what they were, and say what they are tracked by.
        let plain = open_with(Path::new(&path), OpenOptions::default()).expect("pictures");
        assert_eq!((plain.volumes(), plain.frames_per_volume()), (PICTURES, 1));
        let said = description(Path::new(&path), OpenOptions::default()).expect("a description");
        assert!(
            said.rows
                .iter()
                .any(|(title, text)| title == "tracking" && text.contains("ProbeToTracker, ReferenceToTracker"))
        );
    }
}

#[test]
fn pictures_without_a_pose_are_left_out() {
    let folder = Folder::new("tracked-lost");
    let xml = folder.write("plus.xml", plus_config("Reference"));
    let path = folder.write("sweep.mha", sequence("MF", &[0, 5]));
    let options = OpenOptions { plus_config: Some(Path::new(&xml)), ..OpenOptions::default() };
    let source = open_with(Path::new(&path), options).expect("a freehand volume");
    assert_eq!(source.frames_per_volume(), PICTURES - 2);
    assert!(voxels(source).into_iter().all(|(place, found)| (found - value(place)).abs() < 1e-3));
    let said = description(Path::new(&path), options).expect("a description");
    assert!(said.rows.iter().any(|(_, text)| text == "6, 4 with a valid pose"), "{said:?}");
}

#[test]
fn what_does_not_apply_is_refused() {
    let folder = Folder::new("tracked-wrong");
    let path = folder.write("sweep.mha", sequence("MF", &[]));
    let nowhere = folder.write("nowhere.xml", plus_config("Phantom"));
    let xml = folder.write("plus.xml", plus_config("Reference"));
    let frames = folder.write("lattice", std::fs::read("tests/fuzz/seeds/piped/lattice").expect("a seed"));
    let all_lost = folder.write("lost.mha", sequence("MF", &[0, 1, 2, 3, 4, 5]));
    fn config(xml: &str) -> OpenOptions<'_> {
        OpenOptions { plus_config: Some(Path::new(xml)), ..OpenOptions::default() }
    }
    let reference = OpenOptions { reference: Some("Reference"), ..OpenOptions::default() };
    for (file, options, named) in [
        (path.as_str(), config(&nowhere), "no chain leads from Image to Phantom; the pictures have ProbeToTracker"),
        (&path, reference, "no chain leads from Image to Reference"),
        (BONE, config(&xml), "this recording has no poses"),
        (SWEEP, config(&xml), "these are scan lines"),
        (&frames, config(&xml), "frames as they arrived"),
        (&all_lost, config(&xml), "none of 6 pictures has a valid one"),
        (
            &path,
            OpenOptions { depth_axis: Some("x".parse().expect("an axis")), ..config(&xml) },
            "--depth-axis are not",
        ),
        (&path, config("gone.xml"), "gone.xml"),
    ] {
        let said = open_with(Path::new(file), options).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(said.contains(named) && said.lines().count() == 1, "{file}: {said}, not {named}");
    }
}

/// A volume with its place, for any place in it.
struct Volume {
    grid: Grid,
    to_voxel: DMat4,
    voxels: Vec<u8>,
}

impl Volume {
    fn of(mut source: Box<dyn Source>) -> Volume {
        let (world, Geometry::Cartesian(grid)) = (source.world().expect("a place"), source.geometry(0)) else {
            panic!("a Cartesian volume")
        };
        let [x, y, z] = [0, 1, 2].map(|n| world.axis(n).extend(0.0));
        let to_voxel = DMat4::from_cols(x, y, z, world.origin().extend(1.0)).inverse();
        let frames = std::iter::from_fn(|| source.next_frame().expect("a frame"));
        let voxels = frames.flat_map(|frame| frame.bytes).collect();
        Volume { grid, to_voxel, voxels }
    }

    fn cell(&self, n: usize) -> DVec3 {
        let [x, y, _] = self.grid.size;
        DVec3::from([n % x, n / x % y, n / (x * y)].map(|n| n as f64))
    }

    /// The trilinear mean of the voxels around a place that a pixel reached; None if those have less than half of the weight.
    fn at(&self, place: DVec3) -> Option<f64> {
        let voxel = self.to_voxel.transform_point3(place);
        let (mut sum, mut weights) = (0.0, 0.0);
        for corner in 0..8usize {
            let there = voxel.floor() + DVec3::from([corner & 1, corner >> 1 & 1, corner >> 2].map(|n| n as f64));
            let [x, y, z] = self.grid.size;
            let size = DVec3::from([x, y, z].map(|n| n as f64));
            if there.cmplt(DVec3::ZERO).any() || there.cmpge(size).any() {
                continue;
            }
            let weight = (DVec3::ONE - (voxel - there).abs()).element_product();
            let [i, j, k] = there.to_array().map(|v| v as usize);
            let value = self.voxels[(k * y + j) * x + i];
            if value > 0 {
                (sum, weights) = (sum + weight * f64::from(value), weights + weight);
            }
        }
        (weights > 0.5).then(|| sum / weights)
    }
}

fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let n = pairs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (a, b) = (mean(|p| p.0), mean(|p| p.1));
    let (ab, aa, bb) = pairs.iter().fold((0.0, 0.0, 0.0), |(ab, aa, bb), (x, y)| {
        (ab + (x - a) * (y - b), aa + (x - a).powi(2), bb + (y - b).powi(2))
    });
    ab / (aa * bb).sqrt()
}

/// The toolkit's own reconstruction of a sweep over wires: the same place, and the same voxels as far as two lattices that are turned
/// against each other allow.
#[test]
fn a_sweep_is_where_the_plus_toolkit_has_it() {
    let (sweep, config) = (data("plus/sweep.mha"), data("plus/config.xml"));
    let options = OpenOptions { plus_config: Some(&config), ..OpenOptions::default() };
    let ours = Volume::of(open_with(&sweep, options).expect("a freehand volume"));
    assert_eq!(ours.grid.spacing, [0.5; 3], "the configuration's");
    // Without it they are drawn as what they are, and that is said.
    let path = sweep.to_str().expect("a plain name");
    let said = |more: &[&str]| run(&[&["render", path, "--explain"], more].concat()).2;
    let warning = "97 single pictures, not one volume; tracking: ProbeToTracker";
    assert!(said(&[]).contains(warning) && said(&[]).contains("--plus-config FILE.xml"), "{}", said(&[]));
    assert!(!said(&["--plus-config", config.to_str().expect("a plain name")]).contains("single pictures"));
    let theirs = Volume::of(open_with(&data("plus/reconstructed.mha"), OpenOptions::default()).expect("a volume"));
    let to_world = theirs.to_voxel.inverse();
    let reached = |n: &usize| theirs.voxels[*n] > 0;
    let places: Vec<(DVec3, f64)> = (0..theirs.voxels.len())
        .filter(reached)
        .map(|n| (to_world.transform_point3(theirs.cell(n)), f64::from(theirs.voxels[n])))
        .collect();
    let compared = |shift: DVec3| -> Vec<(f64, f64)> {
        places.iter().filter_map(|(place, value)| Some((ours.at(*place + shift)?, *value))).collect()
    };
    let here = compared(DVec3::ZERO);
    // Half a voxel thick: the wires of a sweep without overlaps.
    assert!(places.len() > 10_000 && here.len() as f64 > 0.75 * places.len() as f64, "{} {}", places.len(), here.len());
    let found = correlation(&here);
    assert!(found > 0.94, "{found}");
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for shift in [-0.25, 0.25] {
            let shifted = correlation(&compared(axis * shift));
            assert!(shifted < found - 0.01, "{shifted} at {shift} along {axis}, {found} here");
        }
    }
}
