//! Half or a quarter of the rays along each edge while a view moves: nearly the same view, and full resolution afterwards.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::{PASSES, Stage};
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Distance, Scene};

const LOOK: &str = "picture.size = [97, 72]
    slices = { pixels = 120, smooth = { lateral = 0.8, depth = 0.8, elevation = 0.8 } }
    camera = { azimuth = 15, elevation = -20 }
    distance = { median = 7, bilateral = { pixels = 3.0, distance = 2.0 } }
    light = { shadow = {}, occlusion = {} }";

fn look(mode: &str) -> Scene {
    scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = {mode}\n{LOOK}"))
}

/// The view of a moving scene.
fn moving(scene: &Scene) -> Scene {
    Scene::new(scene.geometry.clone(), scene.input, scene.settings.moving()).expect("scene")
}

#[test]
fn a_ray_of_four_pixels_goes_through_their_common_corner() {
    for more in ["", "\ncamera = { field_of_view = 40, azimuth = 20 }", "\nlayout = 'four'\nray.rays = 3"] {
        for size in ["[64, 48]", "[63, 47]"] {
            let full = scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'vr'\npicture.size = {size}{more}"));
            let half = moving(&full);
            let rays = f64::from(full.settings.ray.rays);
            assert_eq!((half.settings.ray.rays, half.visible_bounds), (1, full.visible_bounds));
            for (x, y) in [(0.5, 0.5), (20.5, 3.5), (31.5, 23.5)] {
                let (a, along_a) = half.rays.at(x, y);
                let (b, along_b) = full.rays.at(2.0 * rays * x, 2.0 * rays * y);
                assert!((a - b).length() < 1e-9 && (along_a - along_b).length() < 1e-12, "{more} {size}: {a} {b}");
            }
            let [w, h] = full.ray_size().map(|n| (n / full.settings.ray.rays).div_ceil(2));
            assert_eq!(half.ray_size(), [w, h]);
        }
    }
}

#[test]
fn filters_span_as_much_of_the_picture_with_half_the_rays() {
    let toml = "median = 15, bilateral = { pixels = 4.0, distance = 1.0 }, sigma = { window = 3 }, \
                enhanced_sigma = { window = 5, largest = 19 }, perona_malik = { step = 0.2, repeat = 5 }";
    let distance = settings(&format!("distance = {{ {toml} }}")).distance;
    let half = distance.halved();
    assert_eq!(half.median, 7);
    assert_eq!(half.bilateral.map(|b| (b.pixels, b.distance, b.repeat)), Some((2.0, 1.0, 1)));
    // No window is narrower than three.
    assert_eq!(half.sigma.map(|s| s.window), Some(3));
    assert_eq!(half.enhanced_sigma.map(|e| (e.window, e.largest)), Some((3, 9)));
    let diffused = half.perona_malik.expect("diffusion");
    assert!((diffused.step * f64::from(diffused.repeat) - 0.25).abs() < 1e-12 && diffused.step <= 0.2);
    assert_eq!(Distance::default().halved(), Distance::default());
    for ray in [
        "subsampling = 2, rays = 2",
        "subsampling = 8, rays = 4",
        "subsampling = 0",
        "subsampling = 3",
        "subsampling = 16",
    ] {
        let refused = settings(&format!("ray = {{ {ray} }}"));
        let error = Scene::new(Geometry::Sweep(wobbler()), BYTES, refused).unwrap_err().to_string();
        assert!(error.contains("ray.subsampling"), "{error}");
    }
}

#[test]
fn a_ray_of_16_pixels_goes_through_their_middle() {
    for size in ["[64, 48]", "[63, 47]"] {
        let look =
            |more: &str| scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'vr'\npicture.size = {size}{more}"));
        let (full, quarter) = (look(""), look("\nray.subsampling = 4"));
        assert_eq!((quarter.ray_size(), quarter.visible_bounds), ([16, 12], full.visible_bounds));
        for (x, y) in [(0.5, 0.5), (10.5, 3.5), (15.5, 11.5)] {
            let ((a, along_a), (b, along_b)) = (quarter.rays.at(x, y), full.rays.at(4.0 * x, 4.0 * y));
            assert!((a - b).length() < 1e-9 && (along_a - along_b).length() < 1e-12, "{size}: {a} {b}");
        }
    }
}

#[test]
fn back_from_moving_the_picture_is_whole_again_and_no_frame_was_needed() {
    let device = Device::new();
    for mode in [
        "'sr'",
        "'vr'",
        "'mixed'",
        "'vr'\nvolume.shading = 'first-hit'",
        "'mip'\nlayout = 'four'",
        "'sr'\nlayout = 'beside'",
    ] {
        let full = look(mode);
        let half = moving(&full);
        let body = |p: glam::DVec3| 0.1 + 0.8 / (1.0 + (-(p.y - 42.0 + 3.0 * (0.3 * p.x).sin())).exp());
        let frames = body_frames(&full, body);
        let mut renderer: Renderer = rendered(&device, full.clone(), &frames);
        let picture = renderer.picture().expect("picture");
        let change = |renderer: &mut Renderer, to: &Scene| {
            let rerun = renderer.change(to.clone()).expect("change");
            assert!(matches!(rerun, Rerun::Steps { .. }), "{mode}: {rerun:?}");
            let names = renderer.dispatched_passes(|r| r.picture()).expect("picture");
            let stage_one = |n: &&str| PASSES.iter().any(|p| p.name == *n && p.stage == Stage::Preprocess);
            assert!(
                names.iter().any(|n| ["tone", "assemble_toned"].contains(n)) && !names.iter().any(stage_one),
                "{mode}: {names:?}"
            );
            renderer.picture().expect("picture")
        };
        let mut quarter = half.settings.clone();
        quarter.ray.subsampling = 4;
        let quarter = Scene::new(full.geometry.clone(), full.input, quarter).expect("scene");
        let (mean, _) = difference(&picture, &change(&mut renderer, &quarter));
        assert!(mean > 0.0 && mean < 8.0, "{mode}: a quarter is off by {mean}");
        let coarse = change(&mut renderer, &half);
        let (mean, largest) = difference(&picture, &coarse);
        println!("{mode}: half is off by {mean:.2} levels on average, {largest} at most");
        assert!(mean > 0.0, "{mode}: half the rays are all of them");
        assert!(mean < 3.0, "{mode}: {mean}");
        assert_eq!(change(&mut renderer, &full), picture, "{mode}");
        assert_eq!(rendered(&device, half, &frames).picture().expect("picture"), coarse, "{mode}");
    }
}
