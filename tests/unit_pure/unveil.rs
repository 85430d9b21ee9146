//! The render start that follows the fluid: where it is, and when it cannot be told.

use crate::common::probes::wobbler;
use crate::common::scenes::{BYTES, scene};
use echolume::low_level::passes::unveil::{self, Outcome, Unveiled};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::{Scene, Settings};
use glam::DVec3;
use proptest::prelude::*;

/// Voxels about the axis: lateral and elevation -15 to 15 mm, 30 mm deep.
fn voxels(size: [usize; 3], more: &str) -> Scene {
    let spacing = [30.0 / size[0] as f64, 30.0 / size[1] as f64, 30.0 / size[2] as f64];
    let origin = [-15.0 + spacing[0] / 2.0, spacing[1] / 2.0, -15.0 + spacing[2] / 2.0];
    let toml = format!("mode = 'vr'\nunveil.enabled = true\n{more}");
    scene(Geometry::Cartesian(Grid { size, spacing, origin }), BYTES, &toml)
}

fn volume(scene: &Scene, echo: impl Fn(DVec3) -> f64) -> Texels {
    let size = Slot::Volume.array_size(scene);
    let stored = Texels::from_fn(size, 1, |at, _| echo(scene.texel_place(at.map(|n| n as u32))));
    let format = Slot::Volume.format(scene);
    Texels::decode(size, format, &stored.encode(format))
}

/// What is found, the same by the reference.
fn found(scene: &Scene, volume: &Texels) -> Unveiled {
    let found = unveil::find(scene, &volume.encode(Slot::Volume.format(scene)));
    let (rows, outcome) = unveil::reference(scene, volume);
    assert_eq!(found.outcome, outcome);
    let rows: Vec<f32> = rows.values.iter().map(|v| *v as f32).collect();
    assert!(found.rows == rows, "{:?}", found.rows.iter().zip(&rows).position(|(a, b)| a != b));
    found
}

/// Depth at which rendering starts, mm, by column and slice.
fn depths(scene: &Scene, unveiled: &Unveiled) -> Vec<(DVec3, f64)> {
    let [width, _, slices] = scene.volume_size();
    let at = |x: u32, z: u32| {
        let row = f64::from(unveiled.rows[(z * width + x) as usize]);
        (scene.texel_place([x, 0, z]), scene.grid.place(0.0, row).1)
    };
    (0..slices).flat_map(|z| (0..width).map(move |x| (x, z))).map(|(x, z)| at(x, z)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Blobs of any size and level in a lattice of any size: cell for cell the same surface, the same outcome.
    #[test]
    fn what_is_found_is_what_the_reference_finds(
        size in [6usize..48, 8usize..60, 2usize..9],
        levels in [0.0f64..1.0, 0.0f64..1.0],
        wall in 1.0f64..14.0,
        slope in [-0.6f64..0.6, -0.6f64..0.6],
        thickness in 0.5f64..9.0,
        noise in 0.0f64..0.5,
        format in prop::sample::select(vec!["r8", "r16", "r16f", "r32f"]),
        smoothing in prop::sample::select(vec![0.0, 1.0, 4.0, 20.0]),
        region in prop::sample::select(vec!["", "region = { lateral = [-6, 3], elevation = [-20, 4] }"]),
        seed in any::<u64>(),
    ) {
        let more = format!("unveil.smoothing = {smoothing}\nunveil.offset = 0.7\nslices.format = '{format}'\n{region}");
        let scene = voxels(size, &more);
        let mut state = seed;
        let random: Vec<f64> = (0..size.iter().product::<usize>()).map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        }).collect();
        let mut texels = volume(&scene, |p| {
            let face = wall + slope[0] * p.x + slope[1] * p.z;
            if p.y >= face && p.y < face + thickness { levels[0] } else { levels[1] }
        });
        texels.values.iter_mut().zip(&random).for_each(|(v, r)| *v = (*v + noise * (r - 0.5)).clamp(0.0, 1.0));
        let format = Slot::Volume.format(&scene);
        let texels = Texels::decode(texels.size, format, &texels.encode(format));
        found(&scene, &texels);
    }
}

const WALL: f64 = 0.6;
const FLUID: f64 = 0.1;
const FACE: f64 = 0.75;

/// A wall down to a tilted plane, fluid, and a ball; rendering starts within a fifth of a millimetre of the plane, plus the offset.
#[test]
fn rendering_starts_at_the_near_face_of_the_fluid() {
    // Fluid may be black, which in voxels is also what lies beside a sector.
    for (offset, cells, fluid) in
        [(0.0, [60, 60, 30], FLUID), (1.5, [60, 60, 30], FLUID), (0.0, [60, 60, 30], 0.0), (-2.0, [100, 75, 20], FLUID)]
    {
        let scene = voxels(cells, &format!("unveil.offset = {offset}\nunveil.smoothing = 1"));
        let plane = |p: DVec3| 8.0 + 0.15 * p.x - 0.1 * p.z;
        let echo = |p: DVec3| {
            let ball = p.distance(DVec3::new(1.0, 21.0, 0.0)) < 8.0;
            if p.y < plane(p) {
                WALL
            } else if ball {
                FACE
            } else if p.y > 28.0 {
                WALL
            } else {
                fluid
            }
        };
        let start = found(&scene, &volume(&scene, echo));
        assert!(start.outcome.is_found(), "{:?}", start.outcome);
        // The smoothing flattens what lies at the border.
        let inner = |p: &DVec3| p.x.abs() < 11.0 && p.z.abs() < 11.0;
        for (place, depth) in depths(&scene, &start).into_iter().filter(|(place, _)| inner(place)) {
            assert!((depth - offset - plane(place)).abs() < 0.35, "{place}: {depth}, {}", plane(place));
        }
    }
}

/// Where the fetus touches the wall there is no fluid: the surface goes on as it does around it. Fluid behind the fetus is no near face.
#[test]
fn a_hole_in_the_pocket_is_spanned() {
    let scene = voxels([60, 60, 30], "unveil.offset = 0");
    let echo = |p: DVec3| {
        let ball = p.distance(DVec3::new(0.0, 13.0, 0.0)) < 6.0;
        if p.y < 8.0 {
            WALL
        } else if ball {
            FACE
        } else if p.y > 26.0 {
            WALL
        } else {
            FLUID
        }
    };
    let start = found(&scene, &volume(&scene, echo));
    assert!(start.outcome.is_found(), "{:?}", start.outcome);
    assert!(depths(&scene, &start).iter().all(|(_, depth)| (depth - 8.0).abs() < 0.5));
}

/// Fluid as bright as tissue, no fluid, and fluid in a corner of the view: nothing is removed, and the reason is known.
#[test]
fn where_the_pocket_cannot_be_told_nothing_is_removed() {
    let scene = voxels([60, 60, 30], "");
    let layers =
        |fluid: f64, reach: f64| move |p: DVec3| if p.y > 8.0 && p.y < 15.0 && p.x < reach { fluid } else { WALL };
    let of = |echo: &dyn Fn(DVec3) -> f64| {
        let start = found(&scene, &volume(&scene, echo));
        assert!(start.outcome.is_found() || start.rows.iter().all(|row| *row == 0.0));
        start.outcome
    };
    assert!(of(&layers(FLUID, 20.0)).is_found());
    assert!(matches!(of(&layers(0.52, 20.0)), Outcome::NoContrast(_)));
    assert!(matches!(of(&layers(FLUID, -5.0)), Outcome::TooSmall(_)));
    // Nothing lies in front of the fluid.
    let bath = found(&scene, &volume(&scene, |p| if p.y < 15.0 { FLUID } else { WALL }));
    assert!(bath.outcome.is_found() && bath.rows.iter().all(|row| *row == 0.0), "{:?}", bath.outcome);
    assert_eq!(of(&|_| WALL), Outcome::NoPocket);
    assert_eq!(of(&|_| 0.0), Outcome::NoPocket);
    let said = of(&layers(0.52, 20.0)).to_string();
    assert!(said.ends_with("so the start line stays") && said.contains("0.52 in it"), "{said}");
    assert!(of(&layers(FLUID, -5.0)).to_string().starts_with("fluid is found in 3"), "{}", of(&layers(FLUID, -5.0)));
}

/// Prevents a second volume where nothing starts at fluid, and planes that lose what is in front of it.
#[test]
fn only_renderings_that_start_at_fluid_have_a_volume_for_it() {
    let fan = |toml: &str| scene(Geometry::Sweep(wobbler()), BYTES, &format!("slices.pixels = 40\n{toml}"));
    let slots = |toml: &str| Plan::new(&fan(toml)).slots;
    for (mode, expected) in
        [("vr", true), ("sr", true), ("mip", true), ("plane", false), ("tomography", false), ("cube", false)]
    {
        let with = slots(&format!("mode = '{mode}'\nunveil.enabled = true"));
        assert_eq!(with.contains(&Slot::StartSurface) && with.contains(&Slot::CutVolume), expected, "{mode}");
        let without = slots(&format!("mode = '{mode}'"));
        assert!(!without.contains(&Slot::StartSurface) && !without.contains(&Slot::CutVolume), "{mode}");
        // Its numbers alone switch nothing on.
        assert_eq!(slots(&format!("mode = '{mode}'\nunveil.offset = 4")), without, "{mode}");
    }
    let four = fan("mode = 'vr'\nlayout = 'four'\nunveil.enabled = true");
    assert_eq!((Slot::of_planes(&four), Slot::of_rays(&four)), (Slot::Volume, Slot::CutVolume));
    // Fluid is looked for in all of the sector, so that a region that moves does not move it.
    let small = fan("mode = 'vr'\nregion.depth = [30, 40]\nunveil.enabled = true");
    assert_eq!(small.visible_share(), 1.0);
    let refused = |toml: &str| {
        let settings: Settings = Settings::from_toml(toml).expect("settings");
        Scene::new(Geometry::Sweep(wobbler()), BYTES, settings).expect_err("refused").to_string()
    };
    let all = "mode = 'vr'\nunveil.enabled = true\nvolume.transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }, { at = 1, colour = [1, 1, 1], opacity = 1 }]";
    assert!(refused(all).starts_with("scene: unveil.enabled: ") && refused(all).ends_with("set unveil.enabled=false"));
    assert!(refused("unveil.smoothing = 21").contains("unveil.smoothing"));
    assert!(refused("unveil.offset = -101").contains("unveil.offset"));
}

/// On the planes the line is where the surface is: level on A and B, and on C, which lies along the surface, nowhere or at its own depth.
#[test]
fn the_line_on_planes_is_where_the_surface_is() {
    let scene = voxels(
        [60, 60, 30],
        "unveil.offset = 0\nlayout = 'four'\npicture.size = [300, 300]\nplanes.position = [0, 20, 0]",
    );
    let plane = |p: DVec3| 8.0 + 0.2 * p.x;
    let echo = |p: DVec3| {
        if p.y < plane(p) {
            WALL
        } else if p.y < 18.0 {
            FLUID
        } else {
            FACE
        }
    };
    let start = found(&scene, &volume(&scene, echo));
    let lines = unveil::lines(&scene, Some(&start));
    let tiling = scene.tiling();
    assert_eq!(lines.len(), 3);
    let mut lengths = [0.0; 3];
    for ((line, tile), length) in lines.iter().zip(&tiling.tiles).zip(&mut lengths) {
        for [from, to] in &line.pieces {
            *length += (to[0] - from[0]).hypot(to[1] - from[1]) * tiling.pixel;
            for end in [from, to] {
                let place = tiling.point(tile, *end);
                // Beyond the middle of the outermost cell the surface is level.
                let least = if place.x.abs() < 14.0 { 0.55 } else { 0.75 };
                assert!((place.y - plane(place)).abs() < least, "{place}");
            }
        }
    }
    // Across the volume, on A a little longer as it is tilted; C lies behind the surface.
    assert!((lengths[0] - 29.5 * 1.04f64.sqrt()).abs() < 2.0 && (lengths[1] - 29.0).abs() < 2.0, "{lengths:?}");
    assert_eq!(lengths[2], 0.0);
    let without = |toml: &str| unveil::lines(&voxels([60, 60, 30], toml), Some(&start));
    assert!(without("").is_empty() && without("layout = 'four'\nplanes.lines = false").is_empty());
    assert!(unveil::lines(&scene, Some(&Unveiled { outcome: Outcome::NoPocket, ..start.clone() })).is_empty());
}
