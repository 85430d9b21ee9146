//! Curved planes show what lies along their line, in true lengths.

use crate::common::gpu::*;
use crate::planes::picture;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use glam::{DVec2, DVec3};

/// A cube of noise, 30 mm wide, its middle at (0, 15, 0).
fn cube() -> Geometry {
    Geometry::Cartesian(Grid { size: [31, 31, 31], spacing: [1.0; 3], origin: [-15.0, 0.0, -15.0] })
}

const BASE: &str = "slices = { format = 'r32f' }\nray = { sampling = 'exact' }";

/// What the last tile of a picture shows.
fn last_tile(scene: &Scene, picture: &Texels) -> Texels {
    let tiling = scene.tiling();
    let tile = tiling.tiles.last().expect("tiles");
    let ([left, top], [width, height]) = (tile.corner.map(|n| n as usize), tile.size.map(|n| n as usize));
    Texels::from_fn([width, height, 1], 4, |[x, y, _], c| picture.get([left + x, top + y, 0])[c])
}

/// Prevents a section that is shifted, mirrored or of another scale: along a straight line it is the ordinary plane through that line, level by level.
/// In noise, which a shift of a hundredth of a voxel would show.
#[test]
fn along_a_straight_line_it_is_the_oblique_plane() {
    let device = Device::new();
    let mut noise = Noise(7);
    let values: Vec<f64> = (0..31usize.pow(3)).map(|_| noise.next()).collect();
    let frame = |k: usize| Texels::from_fn([31, 31, 1], 1, |[x, y, _], _| values[(k * 31 + y) * 31 + x]);
    let frames: Vec<Texels> = (0..31).map(frame).collect();
    // The plane, the angle of the line on it, and the ordinary plane that stands there.
    for (plane, degrees, other, turn) in [
        ("a", 0.0, "c", "roll = 0"),
        ("a", 25.0, "c", "roll = -25"),
        ("c", 0.0, "a", "roll = 0"),
        ("c", 20.0, "a", "azimuth = -20"),
        ("b", 90.0, "c", "azimuth = 90, tilt = 0"),
    ] {
        for slab in ["", ", thickness = 2.5, slab = 'max'"] {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let middle = if plane == "c" { [0.0, 0.0] } else { [0.0, 15.0] };
            let end = |side: f64| [middle[0] + side * 11.0 * cos, middle[1] + side * 11.0 * sin];
            let [from, to] = [end(-1.0), end(1.0)];
            // Plane B shows a line down where plane C, turned by 90 degrees, would have to be turned about two axes: it is compared by its points.
            let toml = format!(
                "mode = 'plane'\npicture = {{ size = [128, 64] }}\n{BASE}
                 planes = {{ lines = false, plane = '{plane}', curve = {{ plane = '{plane}', points = [{from:?}, {to:?}] }}{slab} }}"
            );
            let curved = scene(cube(), FLOATS, &toml);
            let tiling = curved.tiling();
            let tile = tiling.tiles[1].clone();
            if plane == "b" {
                let right = tiling.point(&tile, [96.5, 32.0]) - tiling.point(&tile, [95.5, 32.0]);
                assert!((right / tile.pixel - DVec3::Y).length() < 1e-9, "down on B is the depth: {right}");
                continue;
            }
            let plain = |zoom: f64| {
                let toml = format!(
                    "mode = 'plane'\npicture = {{ size = [64, 64] }}\n{BASE}
                     planes = {{ plane = '{other}', {turn}, zoom = {zoom}{slab} }}"
                );
                scene(cube(), FLOATS, &toml)
            };
            let plain = plain(plain(1.0).tiling().pixel / tile.pixel);
            let wanted = picture(&mut rendered(&device, plain.clone(), &frames));
            let got = last_tile(&curved, &picture(&mut rendered(&device, curved.clone(), &frames)));
            let (mut seen, mut worst) = (0, 0.0f64);
            for (x, y) in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let along = (x as f64 + 0.5 - 32.0) * tile.pixel;
                let ([v, .., is_there], [w, .., was_there]) = (
                    <[f64; 4]>::try_from(got.get([x, y, 0])).unwrap(),
                    <[f64; 4]>::try_from(wanted.get([x, y, 0])).unwrap(),
                );
                if along.abs() > 11.0 {
                    assert_eq!(is_there, 0.0, "beyond the ends of the line");
                } else if is_there > 0.0 && was_there > 0.0 {
                    seen += 1;
                    worst = worst.max((v - w).abs());
                }
            }
            println!("{plane} at {degrees} deg{slab}: {seen} pixels, off by {worst:.5}");
            assert!(seen > 1500 && worst < 1.0 / 255.0, "{plane} at {degrees} deg{slab}: {seen}, {worst}");
        }
    }
}

/// Balls along an arc of 20 mm, at known heights: on the straightened section their distances are the lengths of the arc, and their heights those over
/// the plane. The line passes points of the arc that are none of the balls', and is within 0.02 mm of it; a ball's centroid is as exact as its 0.5 mm voxels
/// allow, a few hundredths of a mm.
#[test]
fn distances_along_the_section_are_the_lengths_of_the_arc() {
    let device = Device::new();
    let radius = 20.0;
    let balls: Vec<(f64, f64)> =
        (0..6).map(|n| (-65.0 + 26.0 * f64::from(n), [0.0, 4.0, -5.0][n as usize % 3])).collect();
    // Plane, and a point of space from the coordinates on the plane and the height over it.
    type Lifted = fn(DVec2, f64) -> DVec3;
    let planes: [(&str, Lifted); 3] = [
        ("a", |at, up| DVec3::new(at.x, at.y, up)),
        ("b", |at, up| DVec3::new(up, at.y, at.x)),
        ("c", |at, up| DVec3::new(at.x, up + 25.0, -at.y)),
    ];
    for (plane, lifted) in planes {
        let middle = if plane == "c" { DVec2::new(0.0, -10.0) } else { DVec2::new(0.0, 15.0) };
        let on_arc =
            |degrees: f64| middle + DVec2::from_angle((degrees + 90.0).to_radians()) * radius * DVec2::new(-1.0, 1.0);
        let points: Vec<[f64; 2]> = (0..11).map(|n| on_arc(-75.0 + 15.0 * f64::from(n)).to_array()).collect();
        let geometry =
            Geometry::Cartesian(Grid { size: [101, 101, 101], spacing: [0.5; 3], origin: [-25.0, 0.0, -25.0] });
        let toml = format!(
            "mode = 'orthogonal'\npicture = {{ size = [480, 400] }}\n{BASE}
             planes = {{ lines = false, curve = {{ plane = '{plane}', points = {points:?} }} }}"
        );
        let scene = scene(geometry, FLOATS, &toml);
        let places: Vec<DVec3> = balls.iter().map(|(degrees, up)| lifted(on_arc(*degrees), *up)).collect();
        let ball = |p: DVec3| places.iter().map(|place| (-p.distance_squared(*place) / 2.0).exp()).sum::<f64>();
        let frames = body_frames(&scene, ball);
        let picture = last_tile(&scene, &picture(&mut rendered(&device, scene.clone(), &frames)));
        let tile = scene.tiling().tiles.last().expect("a section").clone();
        let length = tile.section.as_ref().expect("a section").line.length();
        assert!((length - radius * 150f64.to_radians()).abs() < 0.02, "{length}");
        let down = if plane == "a" { -1.0 } else { 1.0 };
        let level = if plane == "c" { 25.0 } else { 0.0 };
        let middle_level = (scene.low + scene.high).dot(lifted(DVec2::ZERO, 1.0) - lifted(DVec2::ZERO, 0.0)) / 2.0;
        let found: Vec<DVec2> = balls
            .iter()
            .map(|(degrees, up)| {
                let wanted = DVec2::new((degrees + 75.0).to_radians() * radius, down * (up + level - middle_level));
                let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
                for (x, y) in (0..tile.size[1] as usize).flat_map(|y| (0..tile.size[0] as usize).map(move |x| (x, y))) {
                    let from_middle = DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
                        - DVec2::new(f64::from(tile.size[0]), f64::from(tile.size[1])) / 2.0;
                    let at = from_middle * tile.pixel + DVec2::new(length / 2.0, 0.0);
                    let value = picture.one(x, y, 0);
                    if at.distance(wanted) < 3.0 {
                        (sum, weight) = (sum + at * value, weight + value);
                    }
                }
                let off = (sum / weight).distance(wanted);
                println!("plane {plane}: ball at {wanted:.2}, off by {off:.3} mm");
                assert!(weight > 10.0 && off < 0.1, "plane {plane}: ball at {wanted}: {}", sum / weight);
                sum / weight
            })
            .collect();
        for pair in found.windows(2) {
            let arc = 26f64.to_radians() * radius;
            assert!((pair[1].x - pair[0].x - arc).abs() < 0.1, "plane {plane}: {} of {arc} mm", pair[1].x - pair[0].x);
        }
    }
}

/// What a scene without a curve does not need is not in its plan.
#[test]
fn the_table_of_columns_is_in_the_plans_of_curved_planes_alone() {
    for (toml, has) in [
        ("mode = 'orthogonal'", false),
        ("mode = 'orthogonal'\nplanes.curve = { points = [[-5, 5], [5, 9]] }", true),
        ("mode = 'plane'\nplanes.curve = { points = [[-5, 5], [5, 9]] }", true),
        ("mode = 'plane'\nplanes.plane = 'b'\nplanes.curve = { points = [[-5, 5], [5, 9]] }", false),
        ("mode = 'tomography'\nplanes.curve = { points = [[-5, 5], [5, 9]] }", false),
        ("mode = 'vr'\nlayout = 'four'\nplanes.curve = { points = [[-5, 5], [5, 9]] }", false),
    ] {
        let scene = scene(cube(), FLOATS, toml);
        let plan = Plan::new(&scene);
        assert_eq!(plan.slots.contains(&Slot::CurveColumns), has, "{toml}");
    }
}
