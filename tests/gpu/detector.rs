//! The position of surfaces found by the detector on analytic walls and spheres.

use crate::common::gpu::*;
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use glam::DVec3;

pub const STEP: f64 = 0.4;

/// Columns of voxels; parallel rays along +Y run through their centres, one a pixel.
pub fn columns(size: [usize; 3], depth_spacing: f64, surface: &str) -> Scene {
    let geometry = Geometry::Cartesian(Grid { size, spacing: [1.0, depth_spacing, 1.0], origin: [0.0; 3] });
    let toml = format!(
        "mode = 'sr'\npicture = {{ size = [{}, {}] }}\nray = {{ step = {STEP}, sampling = 'exact' }}\n\
         slices = {{ format = 'r32f' }}\n[surface]\nedge = {}\n{surface}",
        size[0],
        size[2],
        4.0 * STEP
    );
    scene(geometry, FLOATS, &toml)
}

fn distances(device: &Device, scene: &Scene, frames: &[Texels]) -> Texels {
    let mut renderer = rendered(device, scene.clone(), frames);
    renderer.picture().expect("picture");
    renderer.read(Slot::Distance).expect("read").expect("there")
}

/// Depth of the surface in each column, none if it was missed.
pub fn depths(device: &Device, scene: &Scene, frames: &[Texels]) -> Vec<([usize; 2], Option<f64>)> {
    let map = distances(device, scene, frames);
    let mut found = Vec::new();
    for y in 0..map.size[1] {
        for x in 0..map.size[0] {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let column = [origin.x.round() as usize, origin.z.round() as usize];
            assert!(direction.distance(DVec3::Y) < 1e-12 && (origin.x - column[0] as f64).abs() < 1e-9);
            let distance = map.one(x, y, 0);
            found.push((column, is_hit(distance).then_some(origin.y + distance)));
        }
    }
    found
}

/// 0 before the edge's middle, 1 behind it, straight in between.
pub fn ramp(depth: f64, edge: f64, width: f64) -> f64 {
    if width > 0.0 { ((depth - edge) / width + 0.5).clamp(0.0, 1.0) } else { f64::from(u8::from(depth >= edge)) }
}

/// Prevents a position that depends on how the samples fall on the edge, on its width, height or sign, or on the rough
/// detector. An edge narrower than a step does not define its position between two samples: half a step there. (A
/// parabola through an edge one step wide is 0.086 off at most, by its algebra; wider ones less.)
#[test]
fn a_step_wall_is_within_a_tenth_of_a_step_wherever_the_samples_fall() {
    let device = Device::new();
    // Edges move by a voxel from column to column and their corners are on voxels: the data equal the formula.
    let (voxel, offsets, widths) = (STEP / 20.0, 20, [0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0]);
    let edge = |x: usize| voxel * (680 + x) as f64;
    let mut largest = [0.0f64; 7];
    for sign in ["bright", "dark"] {
        for (low, high) in [(0.0, 1.0), (0.3, 0.6)] {
            let mut first = Vec::new();
            for rough in [1, 2, 3] {
                let surface = format!("threshold = 0.08\nsign = '{sign}'\nrough = {rough}");
                let scene = columns([offsets, 1400, widths.len()], voxel, &surface);
                let frames = frames(&scene, |[x, y, z]| {
                    let share = ramp(y as f64 * voxel, edge(x), widths[z] * STEP);
                    low + (high - low) * if sign == "bright" { share } else { 1.0 - share }
                });
                let mut worst = [0.0f64; 7];
                let found = depths(&device, &scene, &frames);
                for &([x, z], depth) in &found {
                    let off = (depth.expect("the wall is there") - edge(x)) / STEP;
                    worst[z] = worst[z].max(off.abs());
                }
                println!("{sign} {low} to {high}, rough {rough}: {worst:.3?} steps at widths of {widths:?}");
                assert!(worst[0] < 0.55, "a sharp edge: {worst:?}");
                largest = std::array::from_fn(|z| largest[z].max(worst[z]));
                assert!(worst[1..].iter().all(|w| *w < 0.1), "{sign}, rough {rough}: {worst:?}");
                if rough == 1 {
                    first = found;
                } else {
                    for ((_, a), (_, b)) in first.iter().zip(&found) {
                        assert!((a.unwrap() - b.unwrap()).abs() < 0.01 * STEP, "rough {rough} moves the place");
                    }
                }
            }
        }
    }
    device.figure("wall-sharp", &format!("{:.3}", largest[0]));
    device.figure("wall-step", &format!("{:.3}", largest[1]));
    device.figure("wall-wide", &format!("{:.3}", largest[2..].iter().copied().fold(0.0, f64::max)));
}

/// The size of the difference finds what either sign does, bit for bit, and both faces of a plate one after the other.
#[test]
fn either_sign_finds_the_edges_of_both() {
    let device = Device::new();
    let (voxel, edge, thick) = (STEP / 20.0, 36.0 * STEP, 16.0 * STEP);
    // Walls that are brighter and darker than what is before them, by column, and a plate of each kind.
    let value = |[x, y, _]: [usize; 3]| {
        let depth = y as f64 * voxel;
        let share = ramp(depth, edge, STEP) - if x >= 2 { ramp(depth, edge + thick, STEP) } else { 0.0 };
        if x % 2 == 0 { 0.2 + 0.6 * share } else { 0.8 - 0.6 * share }
    };
    for rough in [1, 2] {
        let found = |sign: &str, number: u32| -> Vec<Option<f64>> {
            let surface = format!("threshold = 0.1\nsign = '{sign}'\nrough = {rough}\nnumber = {number}");
            let scene = columns([4, 1400, 1], voxel, &surface);
            depths(&device, &scene, &frames(&scene, value)).into_iter().map(|(_, depth)| depth).collect()
        };
        let (bright, dark, any) = (found("bright", 1), found("dark", 1), found("any", 1));
        assert_eq!(any, [bright[0], dark[1], bright[2], dark[3]], "rough {rough}");
        assert!(any.iter().all(|depth| (depth.expect("an edge") - edge).abs() < 0.1 * STEP), "{any:?}");
        // Behind the plate: of one sign the second face of the other kind.
        let second = found("any", 2);
        assert_eq!((second[0], second[1]), (None, None), "a wall has one face");
        for depth in &second[2..] {
            assert!((depth.expect("its other face") - edge - thick).abs() < 0.1 * STEP, "{second:?}");
        }
    }
    let learns = crate::common::scenes::settings("surface = { sign = 'any', detector = 'adaptive' }");
    let error = Scene::new(cartesian([8, 8, 8]), BYTES, learns).expect_err("noise of one side").to_string();
    assert!(error.contains("surface.sign") && error.contains("detector=threshold"), "{error}");
}

/// Prevents the position of the thesis from drifting: the newest sample is between (4 threshold / height - 0.5) and one
/// more step past the edge. The default, the peak, does not depend on the height.
#[test]
fn the_first_crossing_is_late_by_what_the_edges_height_makes_it() {
    let device = Device::new();
    let (voxel, heights) = (STEP / 20.0, [1.0, 0.7, 0.5, 0.35]);
    let edge = |x: usize| voxel * (680 + x) as f64;
    for threshold in [0.06, 0.13, 0.21] {
        for rough in [1, 2] {
            let surface = format!("threshold = {threshold}\nplace = 'first-crossing'\nrough = {rough}");
            let scene = columns([20, 1400, heights.len()], voxel, &surface);
            let frames = frames(&scene, |[x, y, z]| heights[z] * ramp(y as f64 * voxel, edge(x), STEP));
            let found = depths(&device, &scene, &frames);
            for (k, height) in heights.iter().enumerate() {
                let bias = 4.0 * threshold / height - 0.5;
                let late = |([x, z], depth): &([usize; 2], Option<f64>)| {
                    (*z == k).then(|| (depth.expect("the wall is there") - edge(*x)) / STEP)
                };
                let late: Vec<f64> = found.iter().filter_map(late).collect();
                let least = late.iter().copied().fold(f64::MAX, f64::min);
                let most = late.iter().copied().fold(f64::MIN, f64::max);
                let mean = late.iter().sum::<f64>() / late.len() as f64;
                println!("threshold {threshold}, height {height}: late by {least:.3} .. {most:.3}, bias {bias:.3}");
                // The offsets are a twentieth of a step apart.
                assert!(least > bias - 0.01 && least < bias + 0.06, "{least} for {bias}");
                assert!(most < bias + 1.01 && (mean - bias - 0.5).abs() < 0.05, "{most}, {mean} for {bias}");
            }
        }
    }
}

/// Prevents errors on curved and oblique surfaces and off the axes: the rays come from any side.
#[test]
fn a_sphere_is_within_a_tenth_of_a_step_from_any_side() {
    let device = Device::new();
    let (voxel, centre, radius) = (0.2, DVec3::new(12.1, 12.3, 11.8), 7.0);
    let geometry = Geometry::Cartesian(Grid { size: [120; 3], spacing: [voxel; 3], origin: [0.0; 3] });
    let mut largest = 0.0f64;
    for (sign, camera, rough) in [
        ("bright", "", 1),
        ("dark", "azimuth = 20, elevation = -35", 1),
        ("bright", "azimuth = -50, elevation = 15, field_of_view = 30", 2),
        ("dark", "azimuth = 160, elevation = 40", 2),
    ] {
        let toml = format!(
            "mode = 'sr'\npicture = {{ size = [72, 72] }}\nray = {{ step = {STEP}, sampling = 'exact' }}\n\
             slices = {{ format = 'r32f' }}\ncamera = {{ {camera} }}\n\
             surface = {{ threshold = 0.1, sign = '{sign}', rough = {rough}, edge = {} }}",
            4.0 * STEP
        );
        let scene = scene(geometry.clone(), FLOATS, &toml);
        let frames = body_frames(&scene, |p| {
            let share = ramp(radius - p.distance(centre), 0.0, 2.0 * STEP);
            if sign == "bright" { share } else { 1.0 - share }
        });
        let map = distances(&device, &scene, &frames);
        let (hits, worst) = sphere_error(&scene, &map, centre, radius);
        let worst = worst / STEP;
        println!("sphere, {sign}, {camera}: {worst:.3} steps at most over {hits} rays");
        assert!(hits > 200 && worst < 0.1, "{sign}, {camera}: {worst} steps off over {hits} rays");
        largest = largest.max(worst);
    }
    device.figure("wall-sphere", &format!("{largest:.3}"));
}
