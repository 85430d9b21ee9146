//! Operations along rays, against formulas: clip planes, growing steps, the sliding filter, pre-integration, hits, volume layers, and
//! several rays a pixel.

use crate::common::gpu::*;
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::probe::{Axis, Geometry, Grid};
use echolume::low_level::scene::Scene;
use echolume::low_level::statistics::mix;
use glam::DVec3;

/// A block of n^3 voxels of 0.5 mm, including half a voxel beyond the outer centres.
fn block(n: usize) -> Geometry {
    Geometry::Cartesian(Grid { size: [n; 3], spacing: [0.5; 3], origin: [0.0; 3] })
}

fn slot(device: &Device, scene: &Scene, body: impl Fn(DVec3) -> f64, slot: Slot) -> Texels {
    let mut renderer = rendered(device, scene.clone(), &body_frames(scene, body));
    renderer.picture().expect("picture");
    renderer.read(slot).expect("read").expect("there")
}

fn even(opacity: f64) -> String {
    format!("transfer = [{{ at = 0.0, colour = [1.0, 1.0, 1.0], opacity = {opacity} }}]")
}

/// Beer-Lambert over the part of each ray that an oblique plane leaves.
#[test]
fn a_clip_plane_cuts_each_ray_where_it_meets_it() {
    let device = Device::new();
    let (at, normal) = (DVec3::new(5.0, 6.0, 5.0), DVec3::new(0.9, -1.0, 0.3));
    let toml = format!(
        "mode = 'vr'\npicture = {{ size = [16, 16] }}\npost.floats = true\nray = {{ step = 0.7, early_end = 0.0 }}\nvolume = {{ {} }}\n\
         clip = [{{ at = {:?}, normal = {:?} }}]",
        even(0.05),
        at.to_array(),
        normal.to_array()
    );
    let scene = scene(block(20), BYTES, &toml);
    let picture = slot(&device, &scene, |_| 0.5, Slot::Picture);
    let (mut cut, mut gone) = (0, 0);
    for (x, y) in (0..256).map(|i| (i % 16, i / 16)) {
        let (origin, _) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        // Kept is normal . (p - at) <= 0 along y: everything below one depth.
        let depth = (normal.dot(at) - normal.x * origin.x - normal.z * origin.z) / normal.y;
        let path = (9.75 - depth.max(-0.25)).max(0.0);
        let expected = -(path / 0.5 * (-0.05f64).ln_1p()).exp_m1();
        assert!((picture.get([x, y, 0])[3] - expected).abs() < 1e-3, "at {x}, {y}");
        cut += u32::from(depth > -0.25 && path > 0.0);
        gone += u32::from(path == 0.0);
    }
    assert!(cut > 100 && gone > 5, "{cut} rays are cut, {gone} are gone");
}

fn sphere_scene(ray: &str) -> Scene {
    let mut probe = wobbler();
    probe.lines = Axis::centred(1.1 / 127.0, 128);
    probe.slices = Axis::centred(0.8 / 60.0, 61);
    (probe.sample_pitch, probe.samples) = (0.2, 256);
    let toml = format!(
        "mode = 'sr'\npicture = {{ size = [48, 48] }}\nray = {{ step = 0.2, {ray} }}\nsurface = {{ threshold = 0.2, edge = 0.8 }}
         camera = {{ zoom = 3.0, target = [1.5, 30.0, -2.0], elevation = 10, field_of_view = 20 }}"
    );
    scene(Geometry::Sweep(probe), FLOATS, &toml)
}

/// The filter's deviation is one step, 0.2 mm grown to 0.4: towards the limb it rounds the edge off.
/// A surface keeps its position with uniform samples, with steps that grow with the range, and with the sliding filter.
#[test]
fn a_sphere_stays_with_growing_steps_and_with_the_sliding_filter() {
    let device = Device::new();
    let (centre, radius) = (DVec3::new(1.5, 50.0, -2.0), 9.0);
    for (ray, limit, figure) in [
        ("spread = 1.0", 0.15, "growing-steps"),
        ("sliding = 3", 0.12, "sliding-filter"),
        ("sliding = 5, spread = 1.0", 0.35, "growing-and-sliding"),
    ] {
        let scene = sphere_scene(ray);
        let body = |p: DVec3| ((radius - p.distance(centre)) / 0.6 + 0.5).clamp(0.0, 1.0);
        let (hits, worst) = sphere_error(&scene, &slot(&device, &scene, body, Slot::Distance), centre, radius);
        println!("{ray}: {hits} hits, at most {worst:.3} mm off");
        assert!(hits > 250 && worst < limit, "{ray}: {hits} hits, {worst} mm");
        device.figure(figure, &format!("{worst:.2}"));
    }
}

/// One sample a ray, on the lattice of voxels: the filter keeps a linear field and reduces noise by the sum of its
/// squared weights.
#[test]
fn the_sliding_filter_keeps_a_linear_field_and_quietens_noise_as_its_weights_say() {
    let device = Device::new();
    // The third of five samples of the ray, with all neighbours within the volume.
    let at = |sliding: u32| {
        let toml = format!(
            "mode = 'mean'\npicture = {{ size = [24, 24] }}\nregion = {{ depth = [5.75, 6.25] }}
             ray = {{ step = 0.5, sliding = {sliding}, sampling = 'exact' }}\nslices = {{ format = 'r32f' }}"
        );
        scene(block(24), FLOATS, &toml)
    };
    let noise = |p: DVec3| {
        // SplitMix64 of the voxel's index.
        let n = (p * 2.0).round();
        let index = n.x as u64 * 1_000_003 + n.y as u64 * 10_007 + n.z as u64;
        (mix(index.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let inner = |picture: &Texels| -> Vec<f64> { (0..400).map(|i| picture.one(2 + i % 20, 2 + i / 20, 0)).collect() };
    let variance = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64
    };
    let raw = variance(&inner(&slot(&device, &at(0), noise, Slot::Picture)));
    let mut largest = 0.0f64;
    for sliding in [3, 5] {
        let scene = at(sliding);
        let field = |p: DVec3| 0.1 + 0.03 * p.x + 0.02 * p.y + 0.01 * p.z;
        let picture = slot(&device, &scene, field, Slot::Picture);
        for (x, y) in (0..400).map(|i| (2 + i % 20, 2 + i / 20)) {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let place = origin + direction * ((6.0 - origin.y) / direction.y);
            assert!((picture.one(x, y, 0) - field(place)).abs() < 5e-4, "sliding {sliding} at {x}, {y}");
        }
        let reach = (sliding / 2) as i32;
        let weight = |k: i32| (-f64::from(k * k) / f64::from(reach)).exp();
        let sum: f64 = (-reach..=reach).map(weight).sum();
        let squares: f64 = (-reach..=reach).map(|k| (weight(k) / sum).powi(2)).sum();
        let quiet = variance(&inner(&slot(&device, &scene, noise, Slot::Picture)));
        println!("sliding {sliding}: variance {:.4} of the noise's, weights say {:.4}", quiet / raw, squares.powi(3));
        let off = (quiet / raw / squares.powi(3) - 1.0).abs();
        assert!(off < 0.25, "sliding {sliding}: {}", quiet / raw);
        largest = largest.max(off);
    }
    device.figure("sliding-noise", &format!("{:.0}", 100.0 * largest));
}

/// A thin opaque layer of the transfer function, which long steps miss.
#[test]
fn pre_integration_finds_a_layer_that_long_steps_miss() {
    let device = Device::new();
    let opacity = |step: f64, compositing: &str| {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [4, 4] }}\nray = {{ step = {step}, early_end = 0.0, sampling = 'exact' }}
             slices = {{ format = 'r32f' }}\n[volume]\ncompositing = '{compositing}'
             transfer = [{{ at = 0.48, colour = [1.0, 0.2, 0.1], opacity = 0.0 }}, {{ at = 0.5, colour = [1.0, 0.2, 0.1], opacity = 0.4 }},
                         {{ at = 0.52, colour = [1.0, 0.2, 0.1], opacity = 0.0 }}]"
        );
        let scene = scene(block(20), FLOATS, &toml);
        slot(&device, &scene, |p| 0.03 + p.y / 10.0, Slot::Picture).get([2, 2, 0])[3]
    };
    let fine = opacity(0.004, "corrected");
    device.figure("layer", &format!("{fine:.4}"));
    for (step, figures) in [
        (0.3, ["layer-1", "layer-corrected-1"]),
        (1.1, ["layer-2", "layer-corrected-2"]),
        (2.7, ["layer-3", "layer-corrected-3"]),
    ] {
        let (corrected, integrated) = (opacity(step, "corrected"), opacity(step, "pre-integrated"));
        device.figure(figures[0], &format!("{integrated:.4}"));
        device.figure(figures[1], &format!("{corrected:.2}"));
        println!("step {step}: corrected {corrected:.4}, pre-integrated {integrated:.4}, truth {fine:.4}");
        assert!((integrated / fine - 1.0).abs() < 0.03, "step {step}: {integrated} for {fine}");
        assert!((corrected / fine - 1.0).abs() > 0.1, "step {step} should miss or exaggerate it: {corrected}");
    }
    // Riemann's a = y exceeds one in a thick medium: it is clamped to opaque.
    assert_eq!(opacity_of_thick(&device), 1.0);
}

fn opacity_of_thick(device: &Device) -> f64 {
    let toml = format!(
        "mode = 'vr'\npicture = {{ size = [2, 2] }}\nray = {{ step = 5.0, early_end = 0.0 }}\nvolume = {{ compositing = 'riemann', {} }}",
        even(0.5)
    );
    let scene = scene(block(20), BYTES, &toml);
    slot(device, &scene, |_| 0.5, Slot::Picture).get([1, 1, 0])[3]
}

/// In a uniform medium, opacity h is reached after -ln(1 - h) / kappa; the volume layer is the part before the surface.
#[test]
fn a_hit_is_where_opacity_reaches_the_threshold_and_the_volume_layer_ends_there() {
    let device = Device::new();
    for step in [0.07, 0.5, 1.5] {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [4, 4] }}\nray = {{ step = {step}, early_end = 0.0 }}
             volume = {{ shading = 'first-hit', hit = 0.4, {} }}",
            even(0.05)
        );
        let scene = scene(block(20), BYTES, &toml);
        let distance = slot(&device, &scene, |_| 0.5, Slot::Distance).one(2, 2, 0);
        let (origin, _) = scene.rays.at(2.5, 2.5);
        let expected = -0.25 - origin.y + 0.5 * (1.0f64 - 0.4).ln() / (1.0f64 - 0.05).ln();
        // Within a step it is placed in proportion to the opacity, which deviates from a line by kappa h / 8.
        assert!((distance - expected).abs() < 0.02 * step + 1e-4, "step {step}: {distance} for {expected}");
    }
    let toml = format!(
        "mode = 'mixed'\npicture = {{ size = [4, 4] }}\nray = {{ step = 0.2, early_end = 0.0 }}
         volume = {{ {} }}\nsurface = {{ threshold = 0.2 }}",
        even(0.03)
    );
    let scene = scene(block(20), FLOATS, &toml);
    let body = |p: DVec3| ((p.y - 5.7) / 0.8 + 0.5).clamp(0.1, 0.9);
    let distance = slot(&device, &scene, body, Slot::Distance).one(2, 2, 0);
    assert!(is_hit(distance));
    let (origin, _) = scene.rays.at(2.5, 2.5);
    assert!((origin.y + distance - 5.7).abs() < 0.05, "the surface lies at {}", origin.y + distance);
    let veil = slot(&device, &scene, body, Slot::VolumeLayer).get([2, 2, 0])[3];
    let expected = -((origin.y + distance + 0.25) / 0.5 * (-0.03f64).ln_1p()).exp_m1();
    assert!((veil - expected).abs() < 5e-4, "{veil} for {expected}");
}

/// The edge of an opaque block covers parts of pixels: to an eighth with 4 x 4 rays.
#[test]
fn several_rays_a_pixel_show_how_much_of_it_is_covered() {
    let device = Device::new();
    let toml = format!(
        "mode = 'vr'\npicture = {{ size = [21, 21] }}\npost.floats = true\nray = {{ rays = 4 }}\ncamera = {{ zoom = 0.7 }}\nvolume = {{ {} }}",
        even(1.0)
    );
    let scene = scene(block(20), BYTES, &toml);
    assert_eq!(scene.ray_size(), [84, 84]);
    let picture = slot(&device, &scene, |_| 0.5, Slot::Picture);
    // mm of a pixel, and of its left edge: rays belong to the finer lattice.
    let pixel = 4.0 * scene.rays.origin_dx.x;
    let mut partly = 0;
    for x in 0..21 {
        let left = scene.rays.origin.x + pixel * x as f64;
        let covered = (((left + pixel).min(9.75) - left.max(-0.25)) / pixel).clamp(0.0, 1.0);
        let got = picture.get([x, 10, 0])[3];
        assert!((got - covered).abs() <= 0.126, "column {x}: {got} for {covered}");
        partly += u32::from(covered > 0.0 && covered < 1.0);
    }
    assert!(partly >= 2);
}

/// Start depths apply to their own mode: that of the surface does not cut the volume layer and the planes next to it.
#[test]
fn a_start_depth_cuts_only_its_own_mode() {
    let device = Device::new();
    let body = |p: DVec3| if p.y < 3.0 { 0.8 } else { ((p.y - 7.0) / 0.8 + 0.5).clamp(0.1, 0.9) };
    let toml = |more: &str| {
        format!(
            "picture = {{ size = [8, 8] }}\nray = {{ step = 0.2, early_end = 0.0 }}\nsurface = {{ threshold = 0.2, start_depth = 5.0 }}
             volume = {{ {} }}\n{more}",
            even(0.03)
        )
    };
    let mixed = scene(block(20), FLOATS, &toml("mode = 'mixed'"));
    let distance = slot(&device, &mixed, body, Slot::Distance).one(4, 4, 0);
    let (origin, _) = mixed.rays.at(4.5, 4.5);
    assert!(
        (origin.y + distance - 7.0).abs() < 0.05,
        "the wall above the start is no surface: {}",
        origin.y + distance
    );
    let veil = slot(&device, &mixed, body, Slot::VolumeLayer).get([4, 4, 0])[3];
    let expected = -(7.25 / 0.5 * (-0.03f64).ln_1p()).exp_m1();
    assert!((veil - expected).abs() < 2e-3, "the veil begins at the region's top: {veil} for {expected}");
    let four = scene(block(20), FLOATS, &toml("mode = 'sr'\nlayout = '4up'"));
    // Upper left: lateral and depth. The topmost row of the block shows the wall.
    let planes = slot(&device, &four, body, Slot::Planes);
    assert!(planes.get([1, 0, 0])[0] > 0.7, "{:?}", planes.get([1, 0, 0]));
}

/// A uniform medium in a sector is as opaque as each ray's path through it is long. A step over the sector's border counts with its part
/// inside: without it the path is short by half a step at each end.
#[test]
fn two_sample_rules_see_all_of_the_path_through_a_sector() {
    let device = Device::new();
    let (probe, opacity) = (wobbler(), 0.01f64);
    let is_inside = |p: DVec3| {
        let at = probe.to_indices(p);
        let within = |index: f64, count: usize| (0.0..=(count - 1) as f64).contains(&index);
        within(at.sample, probe.samples) && within(at.line, probe.lines.len()) && within(at.slice, probe.slices.len())
    };
    let mut largest = [0.0f64; 2];
    for (rule, step) in [("pre-integrated", 1.5), ("exponential", 1.5), ("pre-integrated", 0.4)] {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [24, 24] }}\nray = {{ step = {step}, early_end = 0.0 }}\nslices = {{ pixels = 128 }}\n\
             camera = {{ azimuth = 20, elevation = -10 }}\nvolume = {{ {}, compositing = '{rule}' }}",
            even(opacity)
        );
        let scene = scene(Geometry::Sweep(probe.clone()), BYTES, &toml);
        let picture = slot(&device, &scene, |_| 0.5, Slot::Picture);
        let (mut sum, mut worst, mut seen) = (0.0, 0.0f64, 0);
        for (x, y) in (0..24 * 24).map(|i| (i % 24, i / 24)) {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            // By midpoints, to a fiftieth of a mm.
            let path = (0..10_000).filter(|i| is_inside(origin + direction * (f64::from(*i) + 0.5) * 0.02)).count()
                as f64
                * 0.02;
            // Rays that only graze the border have a path of a few steps.
            if path < 5.0 {
                continue;
            }
            let expected = -(path / scene.reference_length() * (-opacity).ln_1p()).exp_m1();
            let off = picture.get([x, y, 0])[3] - expected;
            (sum, worst, seen) = (sum + off, worst.max(off.abs()), seen + 1);
        }
        let mean = sum / f64::from(seen);
        println!("{rule}, steps of {step} mm: {seen} rays, off by {mean:.5} on average, {worst:.5} at most");
        assert!(seen > 100, "{seen} rays");
        // A picture of R16F is truncated by up to a thousandth.
        assert!(mean.abs() < 1e-3 && worst < 4e-3, "{rule}, steps of {step} mm: {mean}, {worst}");
        largest = [largest[0].max(mean.abs()), largest[1].max(worst)];
    }
    device.figure("path-mean", &format!("{:.0e}", largest[0]));
    device.figure("path-worst", &format!("{:.0e}", largest[1]));
}
