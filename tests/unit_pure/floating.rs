//! Parts of a volume that float.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::passes::slots::Format;
use echolume::low_level::passes::{Slot, Texels, floating};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use proptest::prelude::*;

fn voxels(size: [usize; 3], more: &str) -> Scene {
    let grid = Grid { size, spacing: [0.5, 0.25, 2.0], origin: [0.0; 3] };
    scene(Geometry::Cartesian(grid), BYTES, &format!("mode = 'vr'\nvolume.transfer = 'grey'\n{more}"))
}

/// The texels that are dropped, by the union of runs and by filling parts.
fn both(scene: &Scene, is_set: impl Fn([usize; 3]) -> bool) -> [Vec<bool>; 2] {
    let volume = Texels::from_fn(Slot::WholeVolume.array_size(scene), 1, |at, _| if is_set(at) { 0.8 } else { 0.05 });
    let format = Slot::WholeVolume.format(scene);
    let bytes = volume.encode(format);
    let united = floating::find(scene, &bytes).into_iter().map(|b| b == 255).collect();
    let filled = floating::reference(scene, &Texels::decode(volume.size, format, &bytes));
    [united, filled.values.iter().map(|v| *v > 0.5).collect()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    /// Densities around the one at which parts join to one that spans the volume.
    #[test]
    fn runs_that_are_joined_are_the_parts_that_are_filled(
        size in [1usize..14, 1usize..12, 2usize..9],
        density in 0.01f64..0.4,
        least in 0.3f64..40.0,
        format in prop::sample::select(vec!["r8", "r16", "r16f", "r32f"]),
        elevation in prop::sample::select(vec!["linear", "bspline"]),
        seed in any::<u64>(),
    ) {
        let more = format!("floating = {least}\nslices.format = '{format}'\nray.elevation = '{elevation}'");
        let scene = voxels(size, &more);
        let set: Vec<bool> = {
            let mut state = seed;
            (0..size.iter().product::<usize>()).map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                ((state >> 40) as f64) < density * (1u64 << 24) as f64
            }).collect()
        };
        let [united, filled] = both(&scene, |[x, y, z]| set[(z * size[1] + y) * size[0] + x]);
        prop_assert_eq!(&united, &filled);
        prop_assert!(united.iter().zip(&set).all(|(floats, set)| !floats || *set));
    }
}

/// A voxel has a quarter of a mm^3.
#[test]
fn a_part_is_what_one_sample_after_another_touches() {
    let dropped = |more: &str, set: &[[usize; 3]]| {
        let scene = voxels([12, 12, 12], more);
        let [united, filled] = both(&scene, |at| set.contains(&at));
        assert_eq!(united, filled);
        set.iter().map(|[x, y, z]| united[(z * 12 + y) * 12 + x]).collect::<Vec<_>>()
    };
    // Corner to corner, through all three axes.
    let diagonal: Vec<_> = (0..12).map(|n| [n, 11 - n, n]).collect();
    assert_eq!(dropped("floating = 3.0", &diagonal), [false; 12], "3 mm^3 are not less than 3");
    assert_eq!(dropped("floating = 3.01", &diagonal), [true; 12]);
    // A column apart they are two, in either interpolation; a slice apart a B-spline joins them.
    for (apart, elevation, is_one) in [
        ([2, 0, 0], "linear", false),
        ([2, 0, 0], "bspline", false),
        ([0, 0, 2], "linear", false),
        ([0, 0, 3], "bspline", true),
        ([0, 0, 4], "bspline", false),
    ] {
        let other = [3 + apart[0], 3 + apart[1], 3 + apart[2]];
        let of = dropped(&format!("floating = 0.5\nray.elevation = '{elevation}'"), &[[3, 3, 3], other]);
        assert_eq!(of, [!is_one; 2], "{apart:?}, {elevation}");
    }
    // A spiral: its arms meet at the end only.
    let spiral = (0..8).map(|x| [x, 1, 5]).chain((1..8).map(|y| [8, y, 5])).chain((2..8).map(|x| [x, 7, 5]));
    let spiral: Vec<_> = spiral.chain((3..7).map(|y| [2, y, 5])).chain([[4, 4, 5], [4, 11, 5]]).collect();
    let of = dropped("floating = 5", &spiral);
    assert!(of[..spiral.len() - 2].iter().all(|d| !d) && of[spiral.len() - 2..] == [true; 2], "{of:?}");
}

/// Prevents a size that counts texels: at the end of a fan they are several times as long as near its axis. All of a plane, turned by the
/// fan's angle, is a piece of a ring.
#[test]
fn texels_of_a_fan_have_the_volume_of_the_ring_that_they_fill() {
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'vr'\nslices.pixels = 96");
    let probe = wobbler();
    let [columns, rows, slices] = scene.volume_size();
    let all: u64 = scene.texel_sizes().iter().sum();
    let edge = |row: f64| scene.grid.place(0.0, row).1 - probe.axis_depth();
    let (near, far) = (edge(-0.5), edge(f64::from(rows) - 0.5));
    let angle = probe.slices.pitch() * f64::from(slices);
    let ring = (far * far - near * near) / 2.0 * angle * f64::from(columns) * scene.grid.pitch[0];
    assert!((all as f64 * f64::from(columns) * scene.part_unit() / ring - 1.0).abs() < 1e-4, "{all} {ring}");
    let of_row = |row: usize| scene.texel_sizes()[row] as f64;
    assert!(of_row(rows as usize - 1) / of_row(0) > 1.5);
}

#[test]
fn what_is_drawn_begins_where_the_transfer_function_or_the_detector_does() {
    let points = "volume.transfer = [{ at = 0.25, colour = [1, 1, 1], opacity = 0 }, { at = 0.75, colour = [1, 1, 1], opacity = 1 }]";
    let is_at = |got: f64, expected: f64| {
        assert!((got - expected).abs() <= 1.0 / 255.0 && got <= expected + 1e-12, "{got} {expected}")
    };
    let plain = |toml: &str| {
        let grid = Grid { size: [8; 3], spacing: [1.0; 3], origin: [0.0; 3] };
        scene(Geometry::Cartesian(grid), BYTES, &format!("floating = 1\n{}", toml.replace("$", points)))
    };
    is_at(plain("mode = 'vr'\n$").floating_level().expect("a level"), 0.25);
    is_at(plain("mode = 'vr'\nvolume.window = [0.2, 0.6]\n$").floating_level().expect("a level"), 0.3);
    is_at(plain("mode = 'vr'\nvolume.threshold = 0.5\n$").floating_level().expect("a level"), 0.5);
    is_at(
        plain("mode = 'sr'\nsurface.window = [0.4, 0.9]\nsurface.threshold = 0.2").floating_level().expect("a level"),
        0.5,
    );
    is_at(plain("mode = 'mixed'\nsurface.threshold = 0.1\n$").floating_level().expect("a level"), 0.1);
    // A projection and a plane draw everything.
    assert!(!plain("mode = 'mip'").drops_floating() && !plain("mode = 'plane'").drops_floating());
    assert_eq!(Slot::Floating.format(&plain("mode = 'sr'")), Format::R8);
    let refused = |toml: &str| {
        let grid = Grid { size: [8; 3], spacing: [1.0; 3], origin: [0.0; 3] };
        let settings = echolume::low_level::scene::Settings::from_toml(toml).expect("settings");
        Scene::new(Geometry::Cartesian(grid), BYTES, settings).expect_err("refused").to_string()
    };
    for dark in [
        "floating = 1\nmode = 'sr'\nsurface.sign = 'dark'",
        "floating = 1\nmode = 'vr'\nvolume.transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }, { at = 1, colour = [1, 1, 1], opacity = 0 }]",
    ] {
        let error = refused(dark);
        assert!(error.starts_with("scene: floating: ") && error.ends_with("set floating=0"), "{error}");
    }
    assert!(refused("mode = 'sr'\nfloating = -1").contains("floating"));
}
