//! The lattice of the light volume: how large its cells are and why, and the cones of its ambient light.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;

const LIT: &str = "mode = 'vr'";

/// Voxels of 0.5 mm in a box of 50 x 40 x 30 mm.
fn lit(toml: &str) -> Scene {
    let grid = Grid { size: [100, 80, 60], spacing: [0.5; 3], origin: [0.0; 3] };
    scene(Geometry::Cartesian(grid), BYTES, &format!("{LIT}\n{toml}"))
}

fn cell(scene: &Scene) -> f64 {
    scene.light_lattice().cell
}

/// Prevents a default in mm: a volume of other voxels, or smoothed otherwise, gets cells that resolve it.
#[test]
fn cells_follow_the_smoothing_and_the_pixels_of_a_volume_and_what_is_set_stays() {
    let smoothed = |mm: f64| {
        lit(&format!("light.volume = {{}}\nslices.smooth = {{ lateral = {mm}, depth = {}, elevation = 1 }}", 1.2 * mm))
    };
    assert!((cell(&smoothed(2.0)) - 1.0).abs() < 1e-12 && (cell(&smoothed(1.4)) - 0.7).abs() < 1e-12);
    assert_eq!(cell(&smoothed(0.5)), 0.5, "a pixel");
    assert_eq!(cell(&lit("light.volume = {}")), 0.5);
    assert_eq!(cell(&lit("light.volume = { cell = 0.8 }")), 0.8);
}

/// 60000 mm^3 in at most N cells.
#[test]
fn explain_says_which_lattice_a_scene_took_and_why() {
    let said = |scene: &Scene| {
        let text = Plan::new(scene).explain(scene);
        text.lines().find(|line| line.starts_with("light volume: ")).map(str::to_string)
    };
    for (toml, expected) in [
        ("light.volume = { cell = 1.0 }", "light volume: 50 x 40 x 30 cells of 1.000 mm, 60000: as set"),
        ("light.volume = {}", "light volume: 100 x 80 x 60 cells of 0.500 mm, 480000: a slice pixel, 0.500 mm"),
        (
            "light.volume = {}\nslices.smooth = { lateral = 2.0, depth = 2.5 }",
            "light volume: 50 x 40 x 30 cells of 1.000 mm, 60000: 0.5 of the smoothing's standard deviation, 2.000 mm",
        ),
        (
            "light.volume = { cell = 0.2 }",
            "light volume: 198 x 158 x 118 cells of 0.255 mm, 3691512: at most 4000000 (light.volume.cells) force larger ones than 0.200 mm, as set",
        ),
        (
            "light.volume = { cells = 1000 }",
            "light volume: 14 x 10 x 8 cells of 4.041 mm, 1120: at most 1000 (light.volume.cells) force larger ones than 0.500 mm, a slice pixel, 0.500 mm",
        ),
    ] {
        assert_eq!(said(&lit(toml)).as_deref(), Some(expected), "{toml}");
    }
    assert_eq!(said(&lit("")), None, "nothing is lit by a light volume");
    let long = Geometry::Cartesian(Grid { size: [4000, 4, 4], spacing: [0.25; 3], origin: [0.0; 3] });
    let line = said(&scene(long, BYTES, "mode = 'vr'\nlight.volume = {}")).expect("a line");
    assert!(line.contains("at most 1024 along an edge force larger ones than 0.250 mm"), "{line}");
}

/// Prevents ambient light that changes with the lattice: cones whose width is that of its cells.
#[test]
fn cones_of_ambient_light_have_the_same_width_in_every_lattice() {
    // Of the nth place, the square of the width is the mean of those of the cells of its two levels: variances add up.
    let width = |scene: &Scene, n: i32| {
        let (cones, cell) = (scene.ambient_cones(), cell(scene));
        let finer = 2.0 * cell * f64::from(1 << cones.level(n));
        finer * if cones.narrowest + n >= 0 { (1.0 + 3.0 * cones.wider).sqrt() } else { 1.0 }
    };
    for mm in [0.2, 0.25, 0.3, 0.4, 0.5, 0.8] {
        let scene = lit(&format!("light.volume = {{ cell = {mm}, cells = 100000000 }}"));
        for n in 0..4 {
            let expected = 1.6 * f64::from(1 << n);
            assert!((width(&scene, n) / expected - 1.0).abs() < 1e-9, "{mm} mm, place {n}: {}", width(&scene, n));
        }
    }
    // Cells that are too coarse for the nearest places: these are as narrow as there are, the others as always.
    let coarse = lit("light.volume.cell = 3.2");
    assert_eq!([0, 1, 2, 3].map(|n| width(&coarse, n)), [6.4, 6.4, 6.4, 12.8]);
    assert_eq!((coarse.ambient_cones().narrowest, coarse.ambient_cones().levels()), (-2, 3));
    let usual = lit("light.volume.cell = 0.8");
    assert_eq!(
        (usual.ambient_cones().narrowest, usual.ambient_cones().wider, usual.ambient_cones().levels()),
        (0, 0.0, 5)
    );
}

/// Prevents a lattice of a sweep that is told by a pitch of another unit.
#[test]
fn cells_of_a_sweep_follow_its_slice_pixels() {
    let sweep = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'vr'\nslices.pixels = 96\nlight.volume = {}");
    assert_eq!(cell(&sweep), sweep.grid.pitch[0].min(sweep.grid.pitch[1]));
}
