//! Labels that are drawn or grown, and their files, against closed formulas.

use super::speckle::{cube, speckled};
use echolume::low_level::probe::{Grid, World};
use echolume::low_level::segment::bodies::{Search, find};
use echolume::low_level::segment::{Brush, Field, Labels, Scale, Shape, contours, files};
use echolume::low_level::source::OpenOptions;
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

const BALL: f64 = 4.0 / 3.0 * PI;

fn labels(count: usize, spacing: f64) -> Labels {
    let grid = cube(count, spacing);
    Labels::new(grid, World::of(&grid)).expect("labels")
}

fn volume(labels: &Labels, label: u8) -> f64 {
    let count = labels.voxels().iter().filter(|voxel| **voxel == label).count();
    count as f64 * labels.grid().spacing.iter().product::<f64>()
}

/// The section of a map of the unit ball by a plane of the ball's space: a closed ring.
fn ring(map: impl Fn(DVec3) -> DVec3, normal: DVec3, off: f64) -> Option<Vec<DVec3>> {
    let radius = (1.0 - off * off).max(0.0).sqrt();
    let (u, v) = normal.any_orthonormal_pair();
    let point = |n: u32| {
        let (sin, cos) = (2.0 * PI * f64::from(n) / 90.0).sin_cos();
        map(normal * off + (u * cos + v * sin) * radius)
    };
    (radius > 0.0).then(|| (0..90).map(point).collect())
}

fn fill(found: &mut Labels, label: u8, contours: &[Vec<DVec3>]) {
    let voxels = contours::voxels(found.grid(), contours).expect("a body");
    found.set(&voxels, label);
}

#[test]
fn contours_of_an_ellipsoid_on_parallel_planes_give_its_volume_with_both_ends() {
    let (turn, semi) = (DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -0.3, 0.8), DVec3::new(9.0, 13.0, 17.0));
    let map = |p: DVec3| turn * (p * semi) + DVec3::new(1.0, -2.0, 0.5);
    // Oblique to the axes of the ellipsoid, so that the sections drift; ends at any share of the step.
    for (normal, count, first) in
        [(DVec3::Z, 7, 0.5), (DVec3::new(0.3, 0.2, 1.0).normalize(), 6, 0.15), (DVec3::X, 9, 0.9)]
    {
        let step = 2.0 / f64::from(count);
        let rings = (0..=count).filter_map(|n| ring(map, normal, (f64::from(n) + first) * step - 1.0));
        let rings: Vec<Vec<DVec3>> = rings.collect();
        let mut found = labels(90, 0.5);
        fill(&mut found, 3, &rings);
        let error = volume(&found, 3) / (BALL * 9.0 * 13.0 * 17.0) - 1.0;
        assert!(error.abs() < 0.01, "{normal}, {count} planes: {error}");
        // No voxel is further from the ellipsoid than interpolation between few sections leaves it.
        let grid = *found.grid();
        for (n, voxel) in found.voxels().iter().enumerate() {
            let at = [n % 90, n / 90 % 90, n / 8100].map(|i| i as f64);
            let place = DVec3::from(grid.origin) + DVec3::from(at) * 0.5;
            let out = ((turn.inverse() * (place - DVec3::new(1.0, -2.0, 0.5))) / semi).length();
            assert!(if *voxel == 3 { out < 1.12 } else { out > 0.88 }, "{normal}: {out} at {place}");
        }
    }
}

#[test]
fn a_cylinder_ends_half_a_step_beyond_its_last_plane() {
    let ring = |z: f64| ring(|p| p * 8.0 + DVec3::Z * z, DVec3::Z, 0.0).expect("a ring");
    let mut found = labels(80, 0.5);
    fill(&mut found, 1, &[ring(-6.0), ring(-2.0), ring(2.0), ring(6.0)]);
    let error = volume(&found, 1) / (PI * 64.0 * 16.0) - 1.0;
    assert!(error.abs() < 0.01, "{error}");
}

#[test]
fn contours_on_rotated_planes_give_the_volume_of_a_body_off_the_axis() {
    let (semi, centre) = (DVec3::new(9.0, 13.0, 15.0), DVec3::new(2.0, 0.0, 1.5));
    for (count, allowed) in [(4, 0.02), (6, 0.01), (12, 0.006)] {
        // The axis passes through the body, but not through its centre: x = z = 0 along y.
        let rings: Vec<Vec<DVec3>> = (0..count)
            .map(|n| {
                let (sin, cos) = (PI * f64::from(n) / f64::from(count)).sin_cos();
                let normal = (DVec3::new(-sin, 0.0, cos) * semi).normalize();
                let off = -(DVec3::new(-sin, 0.0, cos).dot(centre)) / (DVec3::new(-sin, 0.0, cos) * semi).length();
                ring(|p| p * semi + centre, normal, off).expect("a ring")
            })
            .collect();
        let mut found = labels(80, 0.5);
        fill(&mut found, 1, &rings);
        let error = volume(&found, 1) / (BALL * 9.0 * 13.0 * 15.0) - 1.0;
        assert!(error.abs() < allowed, "{count} planes: {error}");
    }
}

#[test]
fn contours_within_contours_are_holes_and_what_is_no_body_is_refused() {
    let ring = |radius: f64, z: f64| ring(|p| p * radius + DVec3::Z * z, DVec3::Z, 0.0).expect("a ring");
    let mut found = labels(80, 0.5);
    let stack: Vec<_> = [-4.0, 0.0, 4.0].iter().flat_map(|z| [ring(10.0, *z), ring(5.0, *z)]).collect();
    fill(&mut found, 1, &stack);
    let error = volume(&found, 1) / (PI * 75.0 * 12.0) - 1.0;
    assert!(error.abs() < 0.02, "{error}");
    let refused = |contours: &[Vec<DVec3>]| contours::voxels(&cube(9, 1.0), contours).expect_err("refused");
    assert!(refused(&[ring(5.0, 0.0)]).contains("two planes"));
    assert!(refused(&[ring(5.0, 0.0), ring(3.0, 0.0)]).contains("one plane"));
    assert!(refused(&[ring(5.0, 0.0), vec![DVec3::ONE; 5]]).contains("no area"));
    let askew: Vec<DVec3> = ring(5.0, 3.0).iter().map(|p| DQuat::from_rotation_x(0.5) * *p + DVec3::X * 9.0).collect();
    let other: Vec<DVec3> = ring(5.0, 7.0).iter().map(|p| DQuat::from_rotation_y(0.9) * *p).collect();
    assert!(refused(&[ring(5.0, 0.0), askew, other]).contains("neither"));
    assert!(refused(&[vec![DVec3::X; 40_000], vec![DVec3::X; 40_000]]).contains("too many"));
}

#[test]
fn a_brush_adds_and_removes_balls_and_discs_in_mm() {
    let mut found = labels(100, 0.4);
    let ball = Brush { from: DVec3::ZERO, to: DVec3::ZERO, radius: 9.0, shape: Shape::Ball };
    let painted = found.paint(&ball, 2, None);
    assert!((volume(&found, 2) / (BALL * 729.0) - 1.0).abs() < 0.01);
    assert_eq!(painted, found.voxels().iter().filter(|voxel| **voxel == 2).count());
    // A stroke of a disc along its plane: a slab with round ends.
    let normal = DVec3::Z;
    let disc =
        Brush { from: DVec3::X * -5.0, to: DVec3::X * 5.0, radius: 6.0, shape: Shape::Disc { normal, thickness: 4.0 } };
    found.paint(&disc, 0, Some(2));
    assert_eq!(found.paint(&disc, 7, Some(2)), 0, "what is removed is not painted over");
    found.paint(&disc, 7, Some(0));
    let slab = (PI * 36.0 + 10.0 * 12.0) * 4.0;
    assert!((volume(&found, 7) / slab - 1.0).abs() < 0.03, "{}", volume(&found, 7) / slab);
    assert_eq!(found.paint(&Brush { from: DVec3::splat(1e9), to: DVec3::splat(1e9), ..ball }, 1, None), 0);
}

/// Two bodies with a thin bridge of speckle between them, and a wall with a gap: growth from a seed stays in its body.
#[test]
fn growth_from_a_seed_does_not_leak_through_a_narrow_gap() {
    let grid = cube(96, 0.5);
    let level = |p: DVec3| {
        let is_bridge = p.y.hypot(p.z) < 1.6 && p.x.abs() < 14.0;
        let is_body = p.distance(DVec3::X * 12.0) < 9.5 || p.distance(DVec3::X * -12.0) < 9.5;
        if is_body || is_bridge { -55.0 } else { -15.0 }
    };
    let volume = speckled(grid, 5, level);
    let field = Field::of(&volume, [0.0, 255.0], Scale::Decibels(60.0), grid, || ()).expect("a field");
    let seed = Some(DVec3::new(12.0, 2.0, -1.0));
    let search = Search { is_dark: true, level: None, smoothing: 0.6, opening: 2.0, seed, least: 0.0 };
    let found = find(&field, World::of(&grid), &search).expect("a cyst");
    let truth = BALL * 9.5f64.powi(3);
    assert_eq!(found.bodies.len(), 1);
    let measured = found.bodies[0].measured.expect("a volume");
    assert!((measured.volume / truth - 1.0).abs() < 0.04, "{measured:?} of {truth}");
    assert!(found.bodies[0].centroid.distance(DVec3::X * 12.0) < 0.5 && !found.bodies[0].is_cut);
    // Without the opening both are one.
    let joined = find(&field, World::of(&grid), &Search { opening: 0.0, level: Some(0.08), ..search });
    let joined = joined.expect("both").bodies[0].labelled;
    assert!(joined > 1.6 * truth, "{joined} of {truth}");
    let outside = Search { seed: Some(DVec3::Y * 20.0), level: Some(0.05), ..search };
    assert!(find(&field, World::of(&grid), &outside).is_err_and(|why| why.contains("no body")));
    let beyond = Search { seed: Some(DVec3::Y * 200.0), ..search };
    assert!(find(&field, World::of(&grid), &beyond).is_err_and(|why| why.contains("outside")));
}

#[test]
fn labels_and_names_come_back_from_a_segmentation_and_a_surface_is_closed() {
    let grid = Grid { size: [30, 34, 28], spacing: [0.5, 0.4, 0.6], origin: [-7.0, 20.0, -8.0] };
    let mut made = Labels::new(grid, World::of(&grid)).expect("labels");
    let ball =
        Brush { from: DVec3::new(0.0, 26.0, 0.0), to: DVec3::new(0.0, 26.0, 0.0), radius: 5.0, shape: Shape::Ball };
    made.paint(&ball, 2, None);
    made.paint(&Brush { radius: 2.0, ..ball }, 200, None);
    let path = std::env::temp_dir().join(format!("echolume-labels-{}.seg.nrrd", std::process::id()));
    files::write(&made, &path, |label| format!("body\n{label}")).expect("written");
    let back = files::read(&path, OpenOptions::default());
    let bytes = std::fs::read(&path).expect("bytes");
    // The name of another kind of NRRD says nothing.
    let plain = String::from_utf8_lossy(&bytes).replace("Segment0_ID", "Part0_ID").into_bytes();
    let _ = std::fs::write(&path, plain);
    let refused = files::read(&path, OpenOptions::default());
    let _ = std::fs::remove_file(&path);
    let (back, segments) = back.expect("read");
    assert_eq!(back, made);
    let named: Vec<(u8, &str)> = segments.iter().map(|segment| (segment.label, &*segment.name)).collect();
    assert_eq!(named, [(2, "body 2"), (200, "body 200")]);
    assert!(refused.is_err_and(|e| e.to_string().contains("no segmentation")));
    let mesh = files::surface(&made, 200).expect("a mesh");
    assert_eq!(mesh.open_edges, 0);
    assert!((mesh.volume() / (BALL * 8.0) - 1.0).abs() < 0.06, "{}", mesh.volume());
}

#[test]
fn a_lattice_that_is_none_or_too_large_is_refused() {
    let grid = |size: [usize; 3], spacing: f64| Grid { size, spacing: [spacing; 3], origin: [0.0; 3] };
    let refused = |grid: Grid| Labels::new(grid, World::of(&cube(2, 1.0))).expect_err("refused");
    assert!(refused(grid([4, 0, 4], 1.0)).contains("size"));
    assert!(refused(grid([4, 4, 4], 0.0)).contains("spacing"));
    assert!(refused(grid([usize::MAX, 2, 2], 1.0)).contains("too many"));
    assert!(Labels::of(grid([2, 2, 2], 1.0), World::of(&cube(2, 1.0)), vec![0; 7]).is_err());
}
