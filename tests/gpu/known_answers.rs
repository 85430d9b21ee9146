//! Scenes whose answer is a formula.

use crate::common::*;
use echolume::passes::shade::normal;
use echolume::passes::{MISS, Slot, Texels};
use echolume::probe::{Geometry, Grid};
use echolume::scene::Scene;
use glam::DVec3;

fn block(spacing: f64, size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [spacing; 3], origin: [0.0; 3] })
}

/// SPEC's opacity over a path L through a constant medium of voxel opacity a is 1 - (1 - a)^(L / voxel), whatever the step.
#[test]
fn light_through_a_constant_medium_follows_beer_and_lambert_at_any_step() {
    let device = Device::new();
    let thickness = 10.0;
    for step in [0.07, 0.33, 0.5, 3.0, 40.0] {
        for opacity in [1e-4, 0.02, 0.3, 1.0] {
            let toml = format!(
                "mode = 'vr'\npicture = {{ size = [8, 8] }}\nray = {{ step = {step}, early_end = 0.0 }}\n\
                 [volume]\ntransfer = [{{ at = 0.0, colour = [1.0, 0.5, 0.0], opacity = {opacity} }}]"
            );
            // Half a voxel beyond the outer centres is part of the volume: 20 voxels of 0.5 mm are 10 mm.
            let scene = scene(block(0.5, [20, 20, 20]), BYTES, &toml);
            let frames = frames(&scene, |_| 0.6);
            let mut renderer = rendered(&device, scene, &frames);
            renderer.picture().expect("picture");
            let picture = renderer.read(Slot::Picture).expect("read").expect("there");
            let expected = 1.0 - (1.0f64 - opacity).powf(thickness / 0.5);
            let got = picture.get([4, 4, 0]);
            // The picture is R16F: 11 bits.
            assert!((got[3] - expected).abs() <= expected / 1500.0 + 1e-7, "step {step}, opacity {opacity}: {got:?}");
            assert!((got[1] - expected / 2.0).abs() <= expected / 1500.0 + 1e-7);
        }
    }
}

#[test]
fn ten_thousand_thin_samples_and_an_opaque_one_keep_their_digits() {
    let device = Device::new();
    for (opacity, step, tolerance) in
        [(1e-4f64, 0.002, 1e-3), (1e-7, 0.002, 2e-3), (1.0, 1e-3, 0.0), (0.999, 30.0, 1e-3)]
    {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [2, 2] }}\nray = {{ step = {step}, early_end = 0.0 }}\n\
             [volume]\ntransfer = [{{ at = 0.0, colour = [1.0, 1.0, 1.0], opacity = {opacity} }}]"
        );
        let scene = scene(block(0.5, [4, 40, 4]), BYTES, &toml);
        let frames = frames(&scene, |_| 1.0);
        let mut renderer = rendered(&device, scene, &frames);
        renderer.picture().expect("picture");
        let got = renderer.read(Slot::Picture).expect("read").expect("there").get([1, 1, 0])[3];
        let expected = -(40.0 * (-opacity).ln_1p()).exp_m1();
        assert!(got.is_finite() && (0.0..=1.0).contains(&got));
        // 4e-6 is below R16F's normal numbers, which are 6e-8 apart there.
        assert!((got - expected).abs() <= tolerance * expected + 6e-8, "opacity {opacity}: {got} for {expected}");
    }
}

/// A sphere through scan conversion, sweep map and detector.
#[test]
fn a_sphere_in_a_sweep_is_where_it_is() {
    let device = Device::new();
    let mut probe = wobbler();
    probe.lines = echolume::probe::Axis::centred(1.1 / 127.0, 128);
    probe.slices = echolume::probe::Axis::centred(0.8 / 60.0, 61);
    probe.sample_pitch = 0.2;
    probe.samples = 256;
    let (centre, radius) = (DVec3::new(1.5, 50.0, -2.0), 9.0);
    let toml = "mode = 'sr'\npicture = { size = [64, 64] }\nray = { step = 0.2 }\nsurface = { threshold = 0.2 }
                camera = { zoom = 3.0, target = [1.5, 30.0, -2.0], elevation = 10, field_of_view = 20 }";
    let scene = scene(Geometry::Sweep(probe), FLOATS, toml);
    let frames = body_frames(&scene, |p| ((radius - p.distance(centre)) / 0.6 + 0.5).clamp(0.0, 1.0));
    let mut renderer = rendered(&device, scene.clone(), &frames);
    renderer.picture().expect("picture");
    let distances = renderer.read(Slot::Distance).expect("read").expect("there");
    let (hits, worst) = sphere_error(&scene, &distances, centre, radius);
    assert!(hits > 400, "the sphere fills the picture: {hits}");
    // Half a step: the lattice of frames, 0.013 rad at 45 mm, is 0.6 mm wide across a curved edge.
    assert!(worst < 0.1, "off by {worst} mm");
}

#[test]
fn normals_of_a_sphere_point_outwards_within_a_degree_away_from_the_limb() {
    let toml =
        "picture = { size = [200, 160] }\ncamera = { field_of_view = 35, azimuth = 15 }\nlight = { cliff = 3.0 }";
    let scene = scene(block(1.0, [40, 40, 40]), BYTES, toml);
    let (centre, radius) = (DVec3::splat(20.0), 15.0);
    let distances = sphere_distances(&scene, centre, radius);
    let mut checked = 0;
    for y in 0..160 {
        for x in 0..200 {
            let distance = distances.one(x, y, 0);
            let Some(normal) = normal(&scene, &distances, x as i64, y as i64) else { continue };
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let outwards = (origin + direction * distance - centre).normalize();
            if outwards.dot(-direction) > 0.5 {
                assert!(normal.angle_between(outwards).to_degrees() < 1.0, "at {x}, {y}");
                checked += 1;
            }
        }
    }
    assert!(checked > 3000, "{checked}");
}

fn sphere_distances(scene: &Scene, centre: DVec3, radius: f64) -> Texels {
    let [width, height] = scene.picture_size().map(|n| n as usize);
    Texels::from_fn([width, height, 1], 1, |[x, y, _], _| {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let along = (centre - origin).dot(direction);
        let offset = (origin + direction * along).distance(centre);
        if offset < radius { along - (radius * radius - offset * offset).sqrt() } else { MISS }
    })
}
