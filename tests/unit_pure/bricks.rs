//! Bricks against the geometry itself: the texels sampled at a point are within the reach of its brick, and a brick
//! is inside or outside of the sector only if all of its points are.

use crate::common::probes::wobbler;
use crate::common::scenes::{self, BYTES};
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};
use echolume::low_level::scene::{Scene, Side, TILE};
use glam::DVec3;
use proptest::prelude::*;

fn scene(geometry: Geometry, brick: u32, pixels: u32) -> Scene {
    let toml = format!(
        "mode = 'vr'\npicture = {{ size = [8, 8] }}\nslices = {{ pixels = {pixels} }}\nray = {{ brick = {brick} }}"
    );
    scenes::scene(geometry, BYTES, &toml)
}

fn probes() -> impl Strategy<Value = Probe> {
    let array = prop_oneof![Just(Array::Linear), (0.0..60.0f64).prop_map(|radius| Array::Curved { radius })];
    let motion = (0..3, 0.0..40.0f64);
    let rest = (2..40usize, 2..20usize, 0.2..1.0f64, -1.0..1.0f64, any::<u64>(), 0.5..20.0f64);
    (array, motion, rest).prop_map(|(array, (motion, wobble), (lines, slices, spread, share, seed, start_depth))| {
        let motion = match motion {
            0 => Motion::Fan { wobble_radius: wobble },
            1 => Motion::Translated,
            _ => Motion::Still { thickness: 4.0 },
        };
        let lines = match array {
            Array::Linear => Axis::centred(40.0 * spread / lines as f64, lines),
            Array::Curved { .. } => Axis::centred(1.3 * spread / lines as f64, lines),
        };
        let count = if matches!(motion, Motion::Still { .. }) { 1 } else { slices };
        let pitch =
            if matches!(motion, Motion::Fan { .. }) { spread / count as f64 } else { 30.0 * spread / count as f64 };
        let uneven = |k: usize| pitch * (k as f64 + 0.2 * ((seed as usize + k) as f64).sin());
        let slices = if seed % 3 == 0 {
            Axis::from_table((0..count).map(uneven).collect())
        } else {
            Axis::centred(pitch, count)
        };
        let advance = match seed % 4 {
            0 => Advance::None,
            1 => Advance::Same(share * pitch),
            2 => Advance::Each((0..count).map(|k| 0.3 * share * pitch * if k % 2 == 0 { 1.0 } else { -1.0 }).collect()),
            _ => Advance::Same(0.0),
        };
        Probe { array, lines, start_depth, sample_pitch: 0.7, samples: 60, motion, slices, advance, ..wobbler() }
    })
}

/// Texture indices of a point, and whether it is in the insonified region.
fn texel(scene: &Scene, p: DVec3) -> ([f64; 3], bool) {
    let grid = &scene.grid;
    let place = |x: f64, y: f64| [(x - grid.origin[0]) / grid.pitch[0], (y - grid.origin[1]) / grid.pitch[1]];
    match &scene.geometry {
        Geometry::Cartesian(volume) => {
            let [i, j] = place(p.x, p.y);
            ([i, j, (p.z - volume.origin[2]) / volume.spacing[2]], true)
        }
        Geometry::Sweep(probe) => {
            let (x, y, _) = probe.inverse_sweep_map(p);
            let at = probe.to_indices(p);
            let within = |v: f64, count: usize| v >= 0.0 && v <= (count - 1) as f64;
            let inside = within(at.sample, probe.samples)
                && within(at.line, probe.lines.len())
                && within(at.slice, probe.slices.len());
            let [i, j] = place(x, y);
            ([i, j, at.slice], inside)
        }
    }
}

fn check(scene: &Scene, shares: &[[f64; 3]]) {
    let bricks = scene.bricks();
    let (low, high) = echolume::low_level::scene::insonified_box(&scene.geometry);
    let (mut inside, mut outside) = (0, 0);
    for share in shares {
        let p = low + (high - low) * DVec3::from(*share);
        let at = ((p - bricks.low) / bricks.edge).floor();
        let cell: [u32; 3] = std::array::from_fn(|a| (at[a].max(0.0) as u32).min(bricks.count[a] - 1));
        let reach = scene.reach(&bricks, cell);
        let (texel, is_inside) = texel(scene, p);
        match reach.side {
            Side::Inside => assert!(is_inside, "{p} is outside, its brick is said to be inside"),
            Side::Outside => assert!(!is_inside, "{p} is inside, its brick is said to be outside"),
            Side::Across => {}
        }
        inside += u32::from(reach.side == Side::Inside);
        outside += u32::from(reach.side == Side::Outside);
        if !is_inside {
            continue;
        }
        for (axis, at) in texel.into_iter().enumerate() {
            let at = at.clamp(0.0, f64::from(scene.volume_size()[axis] - 1));
            let (from, to) = (at.floor() as u32, at.ceil() as u32);
            let [first, last] = if axis < 2 { reach.tiles[axis] } else { reach.slices };
            let [from, to] = if axis < 2 { [from / TILE, to / TILE] } else { [from, to] };
            assert!(first <= from && to <= last, "axis {axis} at {p}: {from}..={to} of {first}..={last}");
        }
    }
    // A trivial bound would pass, too.
    if let (Geometry::Sweep(_), true) = (&scene.geometry, shares.len() > 1000) {
        assert!(inside + outside > shares.len() as u32 / 3, "{inside} inside, {outside} outside of {}", shares.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn every_point_samples_only_within_its_bricks_reach(
        probe in probes(),
        brick in prop_oneof![Just(4u32), Just(7), Just(16)],
        pixels in 24..90u32,
        shares in proptest::collection::vec(proptest::array::uniform3(0.0..1.0f64), 60),
    ) {
        prop_assume!(probe.check().is_ok());
        check(&scene(Geometry::Sweep(probe), brick, pixels), &shares);
    }
}

#[test]
fn bricks_of_a_wobbler_and_of_a_cartesian_volume_are_tight() {
    let shares: Vec<[f64; 3]> =
        (0..8000).map(|n| [0.618, 0.755, 0.570].map(|a: f64| (f64::from(n) * a).fract())).collect();
    let probe = Probe {
        array: Array::Curved { radius: 40.0 },
        lines: Axis::centred(0.01, 128),
        sample_pitch: 0.25,
        samples: 400,
        motion: Motion::Fan { wobble_radius: 27.0 },
        slices: Axis::centred(0.0255, 31),
        ..wobbler()
    };
    let sweep = scene(Geometry::Sweep(probe), 8, 400);
    check(&sweep, &shares);
    let grid = Grid { size: [64, 48, 40], spacing: [0.5, 0.4, 0.9], origin: [-4.0, 1.0, -3.0] };
    let volume = scene(Geometry::Cartesian(grid), 8, 64);
    check(&volume, &shares);
    // A brick of eight texels touches ten: three tiles, ten slices.
    let bricks = volume.bricks();
    let reach = volume.reach(&bricks, [3, 3, 3]);
    assert_eq!(reach.tiles.map(|[a, b]| b - a + 1), [3, 3]);
    assert_eq!(reach.slices[1] - reach.slices[0] + 1, 10);
    assert!(bricks.total() <= 8 * 7 * 7, "{:?}", bricks.count);
}

#[test]
fn empty_space_skipping_is_off_where_f32_cannot_resolve_positions() {
    // Where a volume lies does not matter: shaders get places relative to its box. How far away the camera is does.
    let grid = Grid { size: [64, 64, 64], spacing: [1e-3; 3], origin: [900.0, 0.0, 0.0] };
    assert!(scene(Geometry::Cartesian(grid), 8, 64).skips());
    let mut settings = scene(Geometry::Cartesian(grid), 8, 64).settings;
    (settings.camera.zoom, settings.camera.field_of_view) = (1e-3, 1.0);
    assert!(!Scene::new(Geometry::Cartesian(grid), BYTES, settings).expect("scene").skips());
    let grid = Grid { size: [64, 64, 64], spacing: [1.0, 1.0, 1e-3], origin: [0.0; 3] };
    let flat = scene(Geometry::Cartesian(grid), 8, 64);
    assert!(flat.bricks().total() < 2000, "{:?}", flat.bricks());
    let huge = Grid { size: [512, 512, 512], spacing: [0.3; 3], origin: [0.0; 3] };
    assert!(scene(Geometry::Cartesian(huge), 4, 64).bricks().total() <= 524_288);
}
