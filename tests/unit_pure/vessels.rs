//! The phantom's tree of vessels: what its labels hold, measured from outside, follows Murray's law and the closed formulas of cones.

use crate::common::files::Folder;
use echolume::Source;
use echolume::low_level::probe::Geometry;
use echolume::low_level::source::Recording;
use echolume::low_level::source::phantom::{
    Body, Label, Phantom, PhantomOptions, Speckle, Truth, Vessel, VesselTree, distance_path,
};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

fn phantom() -> (Phantom, VesselTree) {
    let phantom = Phantom::new(PhantomOptions { body: Body::Vessels, ..PhantomOptions::default() }).expect("a phantom");
    let Truth::Vessels(tree) = phantom.truth() else { panic!("has vessels") };
    (phantom, tree)
}

fn axis(vessel: &Vessel) -> DVec3 {
    (vessel.to - vessel.from).normalize()
}

/// Area of the blood in the plane across a vessel, mm2: by rays from its axis to where the label changes.
fn area(phantom: &Phantom, vessel: &Vessel, share: f64) -> f64 {
    const RAYS: u32 = 64;
    let (u, v) = axis(vessel).any_orthonormal_pair();
    let middle = vessel.from.lerp(vessel.to, share);
    let rays = (0..RAYS).map(|ray| {
        let (sin, cos) = (TAU * f64::from(ray) / f64::from(RAYS)).sin_cos();
        let is_blood = |radius: f64| phantom.label(0, middle + (u * cos + v * sin) * radius).unwrap() == Label::Blood;
        let (mut low, mut high) = (0.0, 6.0);
        for _ in 0..30 {
            let radius = (low + high) / 2.0;
            if is_blood(radius) { low = radius } else { high = radius }
        }
        low * low
    });
    rays.sum::<f64>() * PI / f64::from(RAYS)
}

/// The radius at a division, from areas at two places on a vessel that no other reaches.
fn radius_at(phantom: &Phantom, vessel: &Vessel, share: f64) -> f64 {
    let [near, far] = [0.5, 0.7].map(|at| (area(phantom, vessel, at) / PI).sqrt());
    near + (far - near) * (share - 0.5) / 0.2
}

#[test]
fn cross_sections_of_the_labels_follow_murrays_law() {
    let (phantom, tree) = phantom();
    assert_eq!(tree.vessels.len(), 1 + 2 + 4 + 8 + 16);
    let trunk = radius_at(&phantom, &tree.vessels[0], 0.0);
    assert!((2.0 * trunk - 8.0).abs() < 1e-3, "the trunk is {} mm wide", 2.0 * trunk);
    let mut divisions = 0;
    for (n, parent) in tree.vessels.iter().enumerate() {
        let daughters: Vec<&Vessel> = tree.vessels.iter().filter(|vessel| vessel.parent == Some(n)).collect();
        if daughters.is_empty() {
            continue;
        }
        divisions += 1;
        assert_eq!(daughters.len(), 2);
        assert!(daughters.iter().all(|daughter| daughter.from == parent.to));
        let end = radius_at(&phantom, parent, 1.0);
        let begin: Vec<f64> = daughters.iter().map(|daughter| radius_at(&phantom, daughter, 0.0)).collect();
        let cubes: f64 = begin.iter().map(|radius| radius.powi(3)).sum();
        assert!((cubes / end.powi(3) - 1.0).abs() < 1e-3, "vessel {n}: {end} mm divides into {begin:?}");
        // At Murray's angles forces along the vessels in proportion to r^2 balance.
        let pull: DVec3 = daughters.iter().zip(&begin).map(|(vessel, radius)| axis(vessel) * radius.powi(2)).sum();
        let rest = (pull - axis(parent) * end.powi(2)).length() / end.powi(2);
        assert!(rest < 1e-3, "vessel {n}: {rest} of the force is left");
        assert!(parent.radii[0] > parent.radii[1]);
    }
    assert_eq!(divisions, 15);
}

/// The wall is as thick everywhere, and no vessel comes near another but at a division.
#[test]
fn walls_are_a_millimetre_thick_and_vessels_do_not_touch() {
    let (phantom, tree) = phantom();
    for vessel in &tree.vessels {
        let (u, _) = axis(vessel).any_orthonormal_pair();
        let at = |share: f64, radius: f64| vessel.from.lerp(vessel.to, share) + u * radius;
        let across = (0..800).map(|i| phantom.label(0, at(0.6, 0.01 * f64::from(i))).unwrap());
        let wall = across.filter(|label| *label == Label::VesselWall).count();
        assert!((99..=101).contains(&wall), "{vessel:?}: {wall} hundredths of a mm");
    }
    let shares = || (0..=40).map(|i| f64::from(i) / 40.0);
    for (n, one) in tree.vessels.iter().enumerate() {
        for other in &tree.vessels[..n] {
            let joined = [one.from, one.to].iter().any(|end| [other.from, other.to].contains(end));
            let gap = shares()
                .map(|share| {
                    let radius = one.radii[0] + (one.radii[1] - one.radii[0]) * share;
                    other.distance(one.from.lerp(one.to, share)) - radius
                })
                .fold(f64::MAX, f64::min);
            assert!(joined || gap > 2.0 * tree.wall, "{gap} mm between {one:?} and {other:?}");
        }
    }
}

/// Blood in a lattice of labels, against the truncated cones between the divisions. Round ends and what cones share at a division
/// make up for each other to 2 %.
#[test]
fn the_volume_of_the_blood_is_that_of_the_cones() {
    const PITCH: f64 = 0.5;
    let (phantom, tree) = phantom();
    let cone = |vessel: &Vessel| {
        let [a, b] = vessel.radii;
        PI / 3.0 * (vessel.to - vessel.from).length() * (a * a + a * b + b * b)
    };
    let cones: f64 = tree.vessels.iter().map(cone).sum();
    let ends = || tree.vessels.iter().flat_map(|vessel| [vessel.from, vessel.to]);
    let low = ends().fold(DVec3::MAX, DVec3::min) - 5.0;
    let high = ends().fold(DVec3::MIN, DVec3::max) + 5.0;
    let count = ((high - low) / PITCH).ceil();
    let along = |n: f64| (0..n as u32).map(|i| PITCH * f64::from(i));
    let mut inside = 0u32;
    for z in along(count.z) {
        for y in along(count.y) {
            let line = along(count.x).map(|x| low + DVec3::new(x, y, z));
            inside += line.filter(|place| phantom.label(0, *place).unwrap() == Label::Blood).count() as u32;
        }
    }
    let labelled = f64::from(inside) * PITCH.powi(3);
    println!("{labelled:.1} mm3 of blood, cones of {cones:.1} mm3");
    assert!((labelled / cones - 1.0).abs() < 0.02, "{labelled} mm3 of blood, cones of {cones} mm3");
}

/// A sweep shows all of the tree: each axis is inside of the sector and as dark as blood, its wall brighter than the tissue.
#[test]
fn a_sweep_shows_the_whole_tree() {
    let options = PhantomOptions { body: Body::Vessels, speckle: Speckle::None, ..PhantomOptions::default() };
    let phantom = Phantom::new(options).expect("a phantom");
    let Truth::Vessels(tree) = phantom.truth() else { panic!("has vessels") };
    let (probe, frames) = (phantom.probe(0), phantom.volume(0));
    let size = [probe.samples, probe.lines.len(), probe.slices.len()];
    for vessel in &tree.vessels {
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let at = probe.to_indices(vessel.from.lerp(vessel.to, share));
            let [sample, line, slice] = [at.sample, at.line, at.slice].map(|index| index.round());
            let inside = [sample, line, slice].iter().zip(size).all(|(i, n)| *i >= 0.0 && *i < n as f64);
            assert!(inside, "{vessel:?} leaves the sector: {at:?}");
            let grey = frames[slice as usize].bytes[line as usize * probe.samples + sample as usize];
            // The nearest sample may be half a frame away, which the points of the last vessels do not reach.
            let reach = 0.5 * probe.slices.pitch() * (probe.array_radius() + 60.0);
            if vessel.radii[1] > reach {
                assert_eq!(f64::from(grey), tree.blood.round(), "{vessel:?} at {share}");
            }
        }
    }
    assert!(tree.blood < tree.tissue && tree.tissue < tree.muscle);
}

#[test]
fn the_written_truth_of_vessels_reads_back() {
    let folder = Folder::new("vessels");
    let path = folder.join("truth.mha");
    let (phantom, _) = phantom();
    let grid = phantom.truth_grid(2.0).unwrap();
    phantom.write_truth(&path, &grid).unwrap();
    let read = |path: &std::path::Path| {
        let mut recording = Recording::open(path, None).unwrap();
        let Geometry::Cartesian(read) = recording.geometry(0) else { panic!("is a volume") };
        assert_eq!(read.size, grid.size);
        std::iter::from_fn(move || recording.next_frame().unwrap()).flat_map(|frame| frame.bytes).collect::<Vec<u8>>()
    };
    let (labels, distances) = (read(&path), read(&distance_path(&path)));
    let known = Body::Vessels.labels();
    let mut counts = vec![0; known.len()];
    for (label, distance) in labels.iter().zip(distances.chunks_exact(4)) {
        let distance = f32::from_le_bytes(distance.try_into().unwrap());
        let n = known.iter().position(|known| *known as u8 == *label).expect("a label of the vessels");
        counts[n] += 1;
        assert_eq!(known[n] == Label::Blood, distance <= 0.0);
        assert_eq!(known[n] == Label::Liver, distance > 1.0);
    }
    assert!(counts.iter().all(|n| *n > 300), "{counts:?}");
    // With names: of these labels alone.
    let named = folder.join("named.seg.nrrd");
    phantom.write_truth(&named, &grid).unwrap();
    assert!(read(&named) == labels);
    let header = String::from_utf8_lossy(&std::fs::read(&named).unwrap()).into_owned();
    assert!(header.contains("vessel wall") && !header.contains("skull"));
}
