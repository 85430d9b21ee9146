//! Sizes of filters in mm become the pixels, slices, samples and rays that have this size at the middle of the region.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, FLOATS, scene, settings};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid, Motion, Probe};
use echolume::low_level::scene::Scene;

/// Slice pixels of 0.5 mm, slices of 2 mm, rays of 0.25 mm.
fn cartesian(toml: &str) -> Scene {
    let grid = Grid { size: [64, 64, 32], spacing: [0.5, 0.5, 2.0], origin: [0.0; 3] };
    scene(Geometry::Cartesian(grid), FLOATS, &format!("mode = 'sr'\npicture.size = [256, 256]\n{toml}"))
}

fn sweep(toml: &str) -> Scene {
    scene(Geometry::Sweep(wobbler()), BYTES, toml)
}

#[test]
fn windows_are_the_nearest_odd_number_of_pixels() {
    let ray = cartesian("").rays.origin_dx.length();
    for (mm, window) in [(0.9, 0), (1.9, 0), (2.1, 3), (3.9, 3), (4.1, 5), (15.2, 15), (62.0, 63), (900.0, 63)] {
        let median = format!("distance.median_mm = {}", mm * ray);
        assert_eq!(cartesian(&median).distance.median, window, "{mm} rays");
    }
    let slices = "slices = { sigma = { window_mm = 2.4 }, enhanced_sigma = { window_mm = 0.1, largest_mm = 5.6 } }";
    let filters = cartesian(slices).slice_filters;
    assert_eq!(filters.sigma.map(|s| s.window), Some(5));
    assert_eq!(filters.enhanced_sigma.map(|e| (e.window, e.largest)), Some((3, 11)));
    // A window of the pixel alone filters nothing.
    let none = "slices = { sigma = { window_mm = 0.9 }, enhanced_sigma = { largest_mm = 0.9 } }\n\
                distance.bilateral = { mm = 0.001, distance = 1 }";
    let none = cartesian(none);
    assert_eq!(
        (none.slice_filters.sigma, none.slice_filters.enhanced_sigma, none.distance.bilateral),
        (None, None, None)
    );
}

#[test]
fn sizes_in_mm_cover_the_same_part_of_a_picture_of_any_size() {
    for more in [
        "",
        "camera.field_of_view = 40",
        "ray.rays = 2",
        "ray.subsampling = 2",
        "ray.subsampling = 4",
        "ray.subsampling = 8",
    ] {
        let covers = |size: u32| {
            let filters =
                "distance = { median_mm = 6, bilateral = { mm = 1, distance = 1 }, perona_malik = { width_mm = 3 } }";
            let scene = sweep(&format!("mode = 'sr'\npicture.size = [{size}, {size}]\n{filters}\n{more}"));
            let middle = (scene.low + scene.high) / 2.0;
            let [width, height] = scene.ray_size().map(f64::from);
            // mm between the rays of two neighbouring pixels at the middle.
            let at = |x: f64| {
                let (origin, direction) = scene.rays.at(x, height / 2.0);
                origin + direction * ((middle - origin).dot(scene.rays.forward) / direction.dot(scene.rays.forward))
            };
            let ray = (at(width / 2.0 + 0.5) - at(width / 2.0 - 0.5)).length();
            let diffusion = scene.distance.perona_malik.expect("diffusion");
            let time = diffusion.step * f64::from(diffusion.repeat);
            assert!(diffusion.step <= 0.25, "stable");
            let bilateral = scene.distance.bilateral.expect("bilateral").pixels;
            (ray, [f64::from(scene.distance.median) * ray, bilateral * ray, (2.0 * time).sqrt() * ray])
        };
        for size in [120, 240] {
            let (ray, [median, bilateral, diffusion]) = covers(size);
            // Halving a window more than once may cost a ray more, and none is smaller than 3.
            let slack = if more.contains("subsampling = 4") || more.contains("subsampling = 8") { 2.0 } else { 1.01 };
            assert!((median - 6.0).abs() <= slack * ray, "{size}, {more}: {median} mm, rays of {ray} mm");
            assert!(
                (bilateral - 1.0).abs() < 0.01 && (diffusion - 3.0).abs() < 0.01,
                "{more}: {bilateral}, {diffusion}"
            );
        }
    }
}

#[test]
fn the_gaussian_across_elevation_follows_the_slice_pitch() {
    let elevation = |scene: &Scene| scene.smoothing()[2];
    let smooth = "slices.smooth = { elevation_mm = 3 }";
    assert!((elevation(&cartesian(smooth)) - 1.5).abs() < 1e-12);
    let moved = Probe { motion: Motion::Translated, ..wobbler() };
    let (pitch, moved) =
        (moved.slices.pitch(), scene(Geometry::Sweep(moved), BYTES, "slices.smooth = { elevation_mm = 0.1 }"));
    assert!((elevation(&moved) - 0.1 / pitch).abs() < 1e-9);
    // Frames of a fan spread with the distance from the wobble axis.
    let near = sweep(&format!("{smooth}\nregion.depth = [10, 20]"));
    let far = sweep(&format!("{smooth}\nregion.depth = [30, 40]"));
    for scene in [&near, &far] {
        let probe = scene.probe().expect("a sweep");
        let middle = (scene.low + scene.high) / 2.0;
        let arc = probe.slices.pitch() * (middle.y - probe.axis_depth()).hypot(middle.z);
        assert!((elevation(scene) * arc - 3.0).abs() < 1e-9, "{} slices of {arc} mm", elevation(scene));
    }
    assert!(elevation(&near) > 1.2 * elevation(&far));
    // The B-spline takes its part of the variance.
    let bspline = cartesian(&format!("{smooth}\nray.elevation = 'bspline'"));
    assert!((elevation(&bspline) - (1.5f64 * 1.5 - 1.0 / 6.0).sqrt()).abs() < 1e-12);
}

#[test]
fn diffusions_and_low_passes_take_mm() {
    let of = |scheme: &str| {
        let diffusion = format!("slices.perona_malik = {{ scheme = '{scheme}', repeat = 4, width_mm = 2 }}");
        cartesian(&diffusion).slice_filters.perona_malik.expect("diffusion")
    };
    // Four pixels: a time of 8.
    assert_eq!((of("explicit").repeat, of("explicit").step), (40, 0.2));
    for scheme in ["aos", "aos-richardson", "rkl1"] {
        assert_eq!((of(scheme).repeat, of(scheme).step), (4, 2.0), "{scheme}");
    }
    let scene = sweep("conditioning.low_pass_mm = 2");
    assert_eq!(scene.conditioning.deviation(scene.decimation()), 2.0 / wobbler().sample_pitch);
    assert!(scene.conditions());
}

/// A size beyond a filter's largest is cut, and `--explain` says so; what no filter has is refused.
#[test]
fn sizes_are_explained_and_checked() {
    let scene = cartesian(
        "distance = { median_mm = 100, bilateral = { mm = 1, distance = 1 } }\nslices.smooth = { elevation_mm = 500 }",
    );
    let text = Plan::new(&scene).explain(&scene);
    let line = |key: &str| text.lines().find(|line| line.starts_with(key)).expect(key);
    assert!(line("distance.median_mm = 100: 63 rays of 0.").ends_with("asked for)"), "{text}");
    assert!(!line("distance.bilateral.mm = 1: ").contains("asked"), "{text}");
    assert_eq!(
        line("slices.smooth.elevation_mm"),
        "slices.smooth.elevation_mm = 500: 32 slices of 2 mm, the most of this filter (250 asked for)"
    );
    for wrong in [
        "distance.median_mm = 0",
        "distance.bilateral = { distance = 1 }",
        "distance.bilateral = { mm = -1, distance = 1 }",
        "slices.sigma = { window_mm = inf }",
        "slices.smooth = { elevation_mm = -1 }",
        "slices.smooth = { kernel = 3, elevation_mm = 1 }",
        "slices.smooth = { elevation_mm = 1 }\nray.elevation = 'bspline-sharp'",
        "conditioning.low_pass_mm = 1e10",
        "post.sigma = { window_mm = 2 }",
        "post.enhanced_sigma = { largest_mm = 2 }",
        "post.perona_malik = { width_mm = 2 }",
    ] {
        assert!(
            settings(wrong).check().is_err() || Scene::new(Geometry::Sweep(wobbler()), BYTES, settings(wrong)).is_err(),
            "{wrong}"
        );
    }
}
