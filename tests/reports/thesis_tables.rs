//! The tables of the thesis: scenes of exactly the stated sizes and passes, a surface where the body has one, and all rows run.

use crate::scenes::alone;
use crate::scenes::device;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{DispatchArgs, Slot, Stage, Texels, is_hit};
use echolume::low_level::picture::Grey;
use echolume::low_level::plan::Plan;
use echolume::low_level::reference;
use echolume::low_level::scene::{MAX_WINDOW, Scene};
use echolume::low_level::thesis_tables::growth::{CENTRES, Growth, SIGMAS, WINDOWS, growth, growth_settings};
use echolume::low_level::thesis_tables::row_times::{
    BALL_RADIUS, TableOptions, run, scene, surface_depth, sweep_frames,
};
use echolume::low_level::thesis_tables::{Conditions, Filter3d, export, tables};

fn pass_names(plan: &Plan, first: bool) -> Vec<&'static str> {
    let steps = plan.steps.iter().filter(|s| (s.pass.stage == Stage::Preprocess) == first);
    steps.map(|s| s.pass.name).collect()
}

/// A specialization constant of a pass of the plan.
fn constant(plan: &Plan, scene: &Scene, pass: &str, name: &str) -> i32 {
    let step = plan.steps.iter().find(|s| s.pass.name == pass).expect("pass");
    let constants = step.pass.constants(scene, &DispatchArgs::default());
    constants.iter().find(|c| c.0 == name).expect("constant").1
}

#[test]
fn scenes_have_exactly_the_stated_sizes_and_passes() {
    let _alone = alone();
    for quick in [false, true] {
        for row in tables(quick).into_iter().flat_map(|t| t.rows) {
            let c = row.conditions;
            let scene = scene(&c).expect("scene");
            let plan = Plan::new(&scene);
            let n = c.volume;
            assert_eq!(scene.frame_size(), [512, c.lines as u32], "{}", row.label);
            assert_eq!(scene.volume_size(), [n, n, c.frames as u32], "{}", row.label);
            assert_eq!((scene.picture_size(), scene.ray_size()), ([c.picture; 2], [c.picture; 2]), "{}", row.label);
            assert!((scene.high.y - scene.low.y - f64::from(n) * scene.step).abs() < 1e-9, "{} samples", row.label);
            assert!((scene.high.y - scene.low.y - 160.0).abs() < 1e-9 && !scene.rays.is_perspective);
            // Pixels reach exactly to the ends of the sector.
            let (low, high) = scene.probe().expect("a sweep").plane_bounds();
            let (right, lower) = scene.grid.place(f64::from(n - 1), f64::from(n - 1));
            assert!((right - high[0]).abs() + (lower - high[1]).abs() < 1e-9 && scene.grid.origin == low);

            let gaussian = ["gaussian_lateral", "gaussian_depth", "gaussian_elevation"];
            let (sliding, taps) = match c.filter_3d {
                Filter3d::None => (0, 0),
                Filter3d::Sliding(n) => (n, 0),
                Filter3d::Stored(n) => (0, n),
            };
            let growing: &[&str] = if c.is_composited { &["enhanced_sigma_slice"] } else { &[] };
            let expected = [&["scan_convert"][..], growing, if taps > 0 { &gaussian } else { &[] }].concat();
            assert_eq!(pass_names(&plan, true), expected, "{}", row.label);
            if c.is_composited {
                let marched = [
                    "raycast_surface_and_volume",
                    "enhanced_sigma_distance",
                    "light",
                    "enhanced_sigma_picture",
                    "tone",
                ];
                assert_eq!(pass_names(&plan, false), marched, "{}", row.label);
                for pass in ["enhanced_sigma_slice", "enhanced_sigma_distance", "enhanced_sigma_picture"] {
                    let windows = ["RADIUS", "MAX_RADIUS"].map(|name| constant(&plan, &scene, pass, name));
                    assert_eq!(windows, [(c.filter_2d / 2) as i32, 10], "{pass}");
                }
                continue;
            }
            assert_eq!(
                pass_names(&plan, false),
                ["raycast_surface", "sigma_distance", "light", "tone"],
                "{}",
                row.label
            );
            assert_eq!(constant(&plan, &scene, "raycast_surface", "SLIDING"), sliding as i32);
            assert_eq!(constant(&plan, &scene, "raycast_surface", "ROUGH"), 1);
            assert_eq!(constant(&plan, &scene, "sigma_distance", "RADIUS"), (c.filter_2d / 2) as i32);
            for pass in gaussian.iter().filter(|_| taps > 0) {
                assert_eq!(constant(&plan, &scene, pass, "RADIUS"), (taps / 2) as i32, "{pass}");
            }
        }
    }
}

/// Slices of n x n non-square pixels show the body in the right place. The first crossing is within a ring of eight samples
/// of the edge.
#[test]
fn rays_meet_the_surface_where_the_body_has_it() {
    let _alone = alone();
    for filter_3d in [Filter3d::None, Filter3d::Sliding(3), Filter3d::Stored(3)] {
        let conditions = Conditions { filter_3d, ..Conditions::usual(true) };
        let scene = scene(&conditions).expect("scene");
        let (step, rays) = (scene.step, scene.rays);
        let face = scene.probe().expect("a sweep").array_radius();
        let mut renderer = Renderer::new(&device(), scene, &RendererOptions::default()).expect("renderer");
        for frame in sweep_frames(conditions.frames, conditions.lines) {
            renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
        }
        renderer.show(0).expect("show");
        renderer.picture().expect("picture");
        let map = renderer.read(Slot::Distance).expect("read").expect("a distance map");
        let mut errors = Vec::new();
        for (i, t) in map.values.iter().enumerate().filter(|(_, t)| is_hit(**t)) {
            let (origin, direction) = rays.at((i % 128) as f64 + 0.5, (i / 128) as f64 + 0.5);
            let place = origin + direction * *t;
            // Near its rim the ball is so steep that frames 4 mm apart smear its edge over more than a ring.
            let beside = place.x.hypot(place.z) / BALL_RADIUS;
            if !(0.8..1.1).contains(&beside) {
                errors.push((place.y - face - surface_depth(place.x, place.z)) / step);
            }
        }
        errors.sort_by(f64::total_cmp);
        let quantile = |share: f64| errors[((errors.len() - 1) as f64 * share) as usize];
        let [low, middle, high] = [0.02, 0.5, 0.98].map(quantile);
        let hits = map.values.iter().filter(|t| is_hit(**t)).count() as f64 / map.values.len() as f64;
        println!("{filter_3d:?}: {:.1} % hit, {low:.2}, {middle:.2}, {high:.2} steps behind the surface", 100.0 * hits);
        assert!(hits > 0.99 && low > -1.5 && middle.abs() < 0.8 && high < 1.8, "{hits} {low} {middle} {high}");
    }
}

#[test]
fn a_quick_run_fills_every_row() {
    let _alone = alone();
    let context = device();
    let asked = TableOptions { quick: true, repeats: 2, warm_up: 1 };
    let mut volumes = 0;
    let report = run(&context, &asked, &mut || volumes += 1).expect("run");
    assert_eq!((volumes, asked.volumes()), (23 * 3, 23 * 3));
    let repeats = if context.candidate.valid_bits() > 0 { 2 } else { 0 };
    for row in report.tables.iter().flat_map(|t| &t.rows) {
        for times in [&row.times.picture, &row.times.preprocess] {
            assert_eq!(times.len(), repeats, "{}", row.label);
            assert!(times.iter().all(|ns| *ns > 0.0), "{}: {times:?}", row.label);
        }
        let met = row.reached.expect("rays");
        assert!(met.share > 0.99 && (60.0..110.0).contains(&met.depth), "{}: {met:?}", row.label);
    }
    let markdown = export::markdown(&report);
    assert!(markdown.contains("- quick:") && markdown.contains(report.device.name.as_str()), "{markdown}");
}

#[test]
fn growth_is_the_reference_s() {
    let _alone = alone();
    // A noisy edge of 40 x 32.
    let value = |x: u32, y: u32| (if x + y / 4 < 22 { 70 } else { 150 }) + ((x * 7919 + y * 104_729) % 61) as u16;
    let values = (0..32).flat_map(|y| (0..40).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
    let grey = Grey { width: 40, height: 32, sixteen: false, values, from_colour: false };
    let grown = growth(&device(), "edge.png", &grey).expect("growth");
    let asked: Vec<_> = grown.rows.iter().map(|r| (r.centre, r.sigma, r.windows)).collect();
    let pairs = || SIGMAS.iter().flat_map(|s| WINDOWS.iter().map(move |w| (*s, *w)));
    let expected: Vec<_> = CENTRES.iter().flat_map(|c| pairs().map(move |(s, w)| (*c, s, w))).collect();
    assert_eq!(asked, expected);
    assert!(WINDOWS.iter().flatten().all(|w| *w <= MAX_WINDOW));
    let frame = Texels { size: [40, 32, 1], channels: 1, values: grey.shares() };
    for row in &grown.rows {
        let scene = echolume::low_level::thesis_tables::growth::scene_of(
            &grey,
            growth_settings(row.centre, row.sigma, row.windows),
        )
        .expect("scene");
        let slots = reference::render(&scene, std::slice::from_ref(&frame));
        let reference = Growth::new(row.centre, row.sigma, row.windows, &slots[&Slot::Growth].values);
        // A pixel whose count depends on rounding may stop a ring earlier or later.
        let moved: u64 = row.counts.iter().zip(&reference.counts).map(|(a, b)| a.abs_diff(*b)).sum();
        assert!(moved <= 2 * 40 * 32 / 200, "{row:?} {reference:?}");
    }
    let still = |sigma: f64| grown.rows.iter().find(|r| r.sigma == sigma).and_then(|r| r.share(0)).expect("a share");
    assert!(still(0.03) < still(0.17), "a wider range needs less growth");
}
