//! Antialiasing of surfaces by the distance map: outlines of many rays from one ray a pixel.

use crate::common::gpu::*;
use crate::shading::{map, plate, run};
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::{Arrays, DispatchArgs, MISS, Texels, by_name};
use echolume::low_level::plan::Plan;
use echolume::low_level::scene::Scene;

/// The scene of outlines and cut faces alone: one colour wherever something is hit.
fn ball(rays: u32, antialias: bool, look: &str, grey: f64) -> Scene {
    let toml = format!(
        "{look}
        picture.size = [120, 110]
        surface = {{ threshold = 0.2, window = [0, 1] }}
        slices = {{ median = false }}
        distance = {{ median = 0 }}
        light = {{ ambient = 1, diffuse = 0, specular = 0, texture = 0, surface_colour = [{grey}, {grey}, {grey}] }}
        post.antialias = {antialias}
        ray.rays = {rays}"
    );
    scene(cartesian([48, 48, 48]), BYTES, &toml)
}

/// A picture of a ball of 14 mm whose border is soft over two voxels: brightness, 0..1.
fn outline(device: &Device, scene: Scene) -> Vec<f64> {
    let frame = |z: usize| {
        Texels::from_fn([48, 48, 1], 1, |[x, y, _], _| {
            let from_middle = [x, y, z].map(|n| (n as f64 - 23.5).powi(2)).iter().sum::<f64>().sqrt();
            (0.5 * (16.3 - from_middle)).clamp(0.0, 1.0)
        })
    };
    let frames: Vec<Texels> = (0..48).map(frame).collect();
    let picture = rendered(device, scene, &frames).picture().expect("picture");
    picture.rgba.chunks_exact(4).map(|p| f64::from(p[1]) / 255.0).collect()
}

/// The error at a round outline, at that of an opaque volume, and where cut faces meet the surface that they cut, is seven tenths of that of one ray at most. The
/// truth is the mean of 4 x 4.
#[test]
fn an_outline_is_that_of_many_rays() {
    let device = Device::new();
    let view = "camera = { field_of_view = 0, azimuth = 20, elevation = 15 }";
    // Cut faces are white, what they cut is half as bright.
    let cut = "camera = { field_of_view = 0, azimuth = 35, elevation = 20 }
        clip = [{ at = [1, 0, 0], normal = [-1, 0.1, 0.05] }, { at = [0, 11, 0], normal = [0.1, -1, 0.2] }]
        planes.window = [0, 0.3]
        cap.level = 0.3";
    let opaque = "mode = 'vr'\nvolume.threshold = 0.45\nvolume.transfer = [{ at = 0, colour = [0.5, 0.5, 0.5], opacity = 1 }]\nray.step = 0.1";
    for (name, look, grey) in [
        ("surface", format!("mode = 'sr'\n{view}"), 1.0),
        ("first hit", format!("{opaque}\nvolume.shading = 'first-hit'\n{view}"), 1.0),
        ("cut surface", format!("mode = 'sr'\n{cut}"), 0.5),
        ("cut volume", format!("{opaque}\n{cut}"), 1.0),
    ] {
        let truth = outline(&device, ball(4, true, &look, grey));
        let error = |rays, antialias| {
            let picture = outline(&device, ball(rays, antialias, &look, grey));
            let at_edges = truth.iter().zip(&picture).filter(|(t, p)| (*t - *p).abs() > 0.02);
            at_edges.map(|(t, p)| (t - p).powi(2)).sum::<f64>().sqrt()
        };
        let [one, four, antialiased] = [error(1, false), error(2, false), error(1, true)];
        println!("{name}: one ray {one:.3?}, 2 x 2 {four:.3?}, antialiased {antialiased:.3?}");
        assert!(one > 1.0 && antialiased < 0.7 * one, "{name}: {antialiased} {one}");
    }
}

/// A slanted edge is smooth from a step of a cliff on, and fades in from half a cliff.
#[test]
fn a_step_becomes_an_edge_between_half_a_cliff_and_a_cliff() {
    let device = Device::new();
    let scene = plate("mode = 'surface'\nlight.cliff = 2");
    let is_near = |x: usize, y: usize| 5 * x < 500 + y;
    let hard = Texels::from_fn([244, 244, 1], 4, |[x, y, _], c| if c == 3 || is_near(x, y) { 1.0 } else { 0.25 });
    let mut runner = PassRunner::new(&device).expect("runner");
    let mut drawn = |step: f64| {
        let mut inputs = Arrays::default();
        inputs.insert("guide", map(&scene, |x, y| if is_near(x, y) { 40.0 } else { 40.0 + step }));
        inputs.insert("rendered", hard.clone());
        let pass = by_name("assemble").expect("pass");
        let outputs = runner.run(&scene, pass, &DispatchArgs::default(), &inputs, 0.5).expect("dispatch");
        outputs.get("picture").clone()
    };
    let smooth = drawn(4.0);
    let between = smooth.values.chunks_exact(4).filter(|c| (0.35..0.9).contains(&c[0])).count();
    assert!(between > 80, "{between}");
    for (step, share) in [(0.5, 0.0), (1.0, 0.0), (1.2, 0.2), (1.5, 0.5), (1.9, 0.9), (2.0, 1.0), (30.0, 1.0)] {
        let picture = drawn(step);
        for ((got, own), edge) in picture.values.iter().zip(&hard.values).zip(&smooth.values) {
            // R16F stores 1 to 4.9e-4, and a distance of 40 mm to 4e-6.
            assert!((got - (own + share * (edge - own))).abs() < 1e-3, "{step}: {got} {own} {edge}");
        }
    }
}

/// What has neither a surface nor cut faces, or no ray through each pixel or several, is drawn as without.
#[test]
fn other_pictures_have_no_pass_for_it() {
    for (toml, is_antialiased) in [
        ("mode = 'sr'", true),
        ("mode = 'mixed'", true),
        ("mode = 'sr'\nlayout = '4up'", true),
        ("mode = 'sr'\nlayout = 'beside'", true),
        ("mode = 'sr'\nlayout = 'pair'", true),
        ("mode = 'sr'\nray.rays = 2", false),
        ("mode = 'sr'\nray.subsampling = 2", false),
        ("mode = 'vr'", false),
        ("mode = 'vr'\nvolume.shading = 'first-hit'", true),
        ("mode = 'vr'\nclip = [{ at = [0, 5, 0], normal = [0, -1, 0] }]", true),
        ("mode = 'vr'\nclip = [{ at = [0, 5, 0], normal = [0, -1, 0] }]\ncap.enabled = false", false),
        ("mode = 'mip'", false),
        ("mode = 'cube'", false),
        ("mode = 'mpr'", false),
    ] {
        let of = |antialias: bool| {
            let scene = scene(cartesian([20, 20, 20]), BYTES, &format!("{toml}\npost.antialias = {antialias}"));
            let steps: Vec<_> = Plan::new(&scene).steps.iter().map(|s| s.id()).collect();
            (scene.antialiases(), steps)
        };
        assert_eq!(of(true).0, is_antialiased, "{toml}");
        assert!(!of(false).0 && (is_antialiased || of(true).1 == of(false).1), "{toml}");
    }
}

/// Folds of less than a cliff are no slopes: neither side of them is lit as if it were steep.
#[test]
fn a_step_below_a_cliff_draws_no_line() {
    let device = Device::new();
    let scene =
        plate("light = { cliff = 1, ambient = 0.2, diffuse = 0.8, specular = 0, direction = [-0.5, 0.3, 0.8] }");
    // 0.25 mm a pixel; a step of 0.9 mm over one pixel is a slope of 74 degrees.
    for step in [0.6, 0.9, 1.1, 5.0] {
        let sheet = |x: usize, y: usize| 40.0 + 0.02 * x as f64 + 0.03 * y as f64 + if x < 120 { 0.0 } else { step };
        let picture = run(&device, &scene, "light", &map(&scene, sheet));
        let [beside, away] = [119, 60].map(|x| picture.one(x, 100, 0));
        assert!((beside - away).abs() < 0.04 * away, "{step}: {beside} {away}");
        assert!((picture.one(120, 100, 0) - away).abs() < 0.04 * away, "{step}: {}", picture.one(120, 100, 0));
    }
    let holed = map(&scene, |x, y| if (x, y) == (120, 100) { MISS } else { 40.0 });
    assert_eq!(run(&device, &scene, "light", &holed).get([120, 100, 0])[3], 0.0);
}

/// A flank of more than a cliff a pixel is lit as if there were no cliffs, up to its outline; a ridge of one pixel faces the viewer.
#[test]
fn a_flank_steeper_than_cliffs_is_lit_as_a_slope() {
    let device = Device::new();
    let lit = |cliff: f64, distance: &dyn Fn(usize, usize) -> f64| {
        let light = "ambient = 0.2, diffuse = 0.8, specular = 0, direction = [-0.5, 0.3, 0.8]";
        let scene = plate(&format!("light = {{ cliff = {cliff}, {light} }}"));
        run(&device, &scene, "light", &map(&scene, distance))
    };
    // 0.25 mm a pixel: a slope of 83 degrees, along columns, rows and both.
    for [right, down] in [[2.0, 0.0], [0.0, -2.0], [-2.0, 2.0]] {
        let flank = |x: usize, y: usize| match x < 130 {
            true => 2000.0 + right * x as f64 + down * y as f64,
            false => MISS,
        };
        let [with, without] = [1.0, 1000.0].map(|cliff| lit(cliff, &flank));
        // The outline of a flank that comes nearer is a ridge.
        let last = if right < 0.0 { 129 } else { 130 };
        for at in (60..last).flat_map(|x| [80, 100].map(|y| [x, y, 0])) {
            let [a, b] = [&with, &without].map(|picture| picture.get(at)[0]);
            assert!((a - b).abs() < 2e-3, "{right}, {down}: {at:?}: {a} {b}");
        }
    }
    let ridge = lit(1.0, &|x, _| if x == 100 { 40.0 } else { 45.0 });
    let level = lit(1.0, &|_, _| 40.0);
    assert_eq!(ridge.get([100, 100, 0]), level.get([100, 100, 0]));
}
