//! The curved render start: which rows of the volume it leaves, and what it changes of a plan.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::passes::{Slot, unveil};
use echolume::low_level::plan::{Plan, Rerun};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Scene, Settings};
use echolume::low_level::verify::built_in::geometries;

/// An arc 20 mm wide, whose middle is 8 mm deeper than its ends: a parabola.
const ARC: &str = "region.start_curve = [[-10, 30], [0, 38], [10, 30]]";

fn arc(lateral: f64) -> f64 {
    38.0 - 0.08 * lateral.clamp(-10.0, 10.0).powi(2)
}

/// The rows are those of the texels' places, one by one, in every geometry, also where the motor moves within a frame.
#[test]
fn the_first_row_of_each_column_is_the_first_behind_the_curve() {
    let mut seen = 0;
    for (name, geometry) in geometries() {
        let toml = if name == "Cartesian" { ARC.replace("30]", "3]").replace("38]", "11]") } else { ARC.into() };
        let raised = if name == "Cartesian" { 27.0 } else { 0.0 };
        let scene = scene(geometry, BYTES, &format!("mode = 'vr'\nslices.pixels = 60\n{toml}"));
        let offset = scene.place_of([0.0; 3]).y;
        let [columns, rows, slices] = scene.volume_size();
        let start = scene.start_curve_rows();
        assert_eq!(start.len(), (columns * slices) as usize);
        for (slice, column) in (0..slices).flat_map(|z| (0..columns).map(move |x| (z, x))) {
            let first = start[(slice * columns + column) as usize];
            for row in 0..rows {
                let place = scene.texel_place([column, row, slice]);
                let is_before = place.y - offset < arc(place.x) - raised;
                assert_eq!(row < first, is_before, "{name}: column {column}, row {row}, slice {slice}: {first}");
            }
            seen += u32::from(first > 0 && first < rows);
        }
    }
    assert!(seen > 1000, "{seen} columns start within the volume");
}

/// Prevents a second volume where nothing starts at a curve, planes that lose what is in front of it, and frames that are sent again for a curve.
#[test]
fn only_renderings_that_start_at_a_curve_have_a_volume_for_it() {
    let fan = |toml: &str| scene(Geometry::Sweep(wobbler()), BYTES, &format!("slices.pixels = 40\n{toml}"));
    for (mode, expected) in
        [("vr", true), ("sr", true), ("mip", true), ("plane", false), ("tomography", false), ("cube", false)]
    {
        let with = Plan::new(&fan(&format!("mode = '{mode}'\n{ARC}"))).slots;
        assert_eq!(with.contains(&Slot::StartCurve) && with.contains(&Slot::CutVolume), expected, "{mode}");
        assert!(!with.contains(&Slot::StartSurface) && !with.contains(&Slot::Cuts), "{mode}");
        let without = Plan::new(&fan(&format!("mode = '{mode}'"))).slots;
        assert!(!without.contains(&Slot::StartCurve), "{mode}");
    }
    let four = fan(&format!("mode = 'vr'\nlayout = 'four'\n{ARC}"));
    assert_eq!((Slot::of_planes(&four), Slot::of_rays(&four)), (Slot::Volume, Slot::CutVolume));
    let [old, new] = [ARC.to_string(), ARC.replace("38", "37")].map(|arc| fan(&format!("mode = 'vr'\n{arc}")));
    let plan = Plan::new(&new);
    let Rerun::Steps { steps, slots } = plan.rerun(&old, &new) else { panic!("frames again") };
    assert_eq!((slots, plan.steps[steps[0]].pass.name), (vec![Slot::StartCurve], "cut"));
    let refused = |toml: &str| {
        let settings: Settings = Settings::from_toml(toml).expect("settings");
        Scene::new(Geometry::Sweep(wobbler()), BYTES, settings).expect_err("refused").to_string()
    };
    let all = "mode = 'vr'\nvolume.transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }, { at = 1, colour = [1, 1, 1], opacity = 1 }]";
    let said = refused(&format!("{ARC}\n{all}"));
    assert!(said.starts_with("scene: region.start_curve: ") && said.ends_with("set region.start_curve=none"), "{said}");
}

/// By a flag, over a preset, and taken back.
#[test]
fn it_is_set_by_a_flag_and_none_removes_it() {
    let mut layers = Layers::default();
    layers.preset("face").expect("a preset");
    layers.set("region.start_curve=[[-20,30],[0,36.5],[20,30]]").expect("a curve");
    let settings = layers.clone().finish().expect("settings");
    assert_eq!(settings.region.start_curve, Some(vec![[-20.0, 30.0], [0.0, 36.5], [20.0, 30.0]]));
    let again: Settings = Settings::from_toml(&settings.to_toml().expect("text")).expect("settings");
    assert_eq!(again, settings);
    layers.set("region.start_curve=none").expect("none");
    assert_eq!(layers.clone().finish().expect("settings").region.start_curve, None);
    for (wrong, said) in [
        ("[[0,1],[2,3]]", "region.start_curve: has 2 points, must have 3 to 5"),
        ("[[0,1],[2,3],[4,5],[6,7],[8,9],[10,11]]", "region.start_curve: has 6 points, must have 3 to 5"),
        ("[[0,1],[2,nan],[4,5]]", "region.start_curve: is NaN"),
        ("[[0,1],[4,3],[2,5]]", "region.start_curve: point 3: lateral 2 mm"),
    ] {
        let mut layers = Layers::default();
        layers.set(&format!("region.start_curve={wrong}")).expect("of the right form");
        let fault = layers.finish().expect("settings").check().expect_err(wrong).to_string();
        assert!(fault.contains(said) && !fault.contains('\n'), "{fault}");
    }
    assert!(Layers::default().set("region.start_curve=[[0,1],[4,3],[2]]").is_err());
}

/// On the planes the line is the curve: an arc on A, level on B, and on C where the curve has the plane's depth.
#[test]
fn the_line_on_planes_is_the_curve_within_the_region() {
    let grid = Grid { size: [60, 60, 30], spacing: [0.5, 0.5, 0.9], origin: [-14.75, 0.25, -13.05] };
    let curve = "region = { lateral = [-12, 12], start_curve = [[-10, 6], [0, 14], [10, 6]] }";
    let four = |toml: &str| {
        let toml =
            format!("mode = 'vr'\nlayout = 'four'\npicture.size = [300, 300]\nplanes.position = [0, 12, 0]\n{toml}");
        scene(Geometry::Cartesian(grid), BYTES, &toml)
    };
    let scene = four(curve);
    let lines = unveil::lines(&scene, None);
    let (tiling, depth) = (scene.tiling(), |x: f64| arc(x) - 24.0);
    assert_eq!(lines.len(), 3);
    let mut extents = [0.0_f64; 3];
    for ((line, tile), extent) in lines.iter().zip(&tiling.tiles).zip(&mut extents) {
        for end in line.pieces.iter().flatten() {
            let place = tiling.point(tile, *end);
            assert!((place.y - depth(place.x)).abs() < 0.1 && place.x.abs() <= 12.0, "{place}");
            *extent = extent.max(if tile.plane.normal.x.abs() > 0.5 { place.z } else { place.x });
        }
    }
    // C, at a depth of 12 mm: 5 mm from the middle.
    assert!(extents[0] > 11.0 && extents[1] > 12.0 && (extents[2] - 5.0).abs() < 0.1, "{extents:?}");
    assert!(unveil::lines(&four(""), None).is_empty());
    assert!(unveil::lines(&four(&format!("{curve}\nplanes.lines = false")), None).is_empty());
}
