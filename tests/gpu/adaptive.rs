//! Several rays in pixels at edges alone: the picture of several rays in every pixel.

use crate::common::gpu::*;
use crate::ladder::Stage;
use echolume::low_level::passes::{DispatchArgs, Slot, by_name};
use echolume::low_level::plan::Plan;
use echolume::low_level::scene::{Scene, Settings};

/// The scene with so many rays along each edge of a pixel.
fn with(scene: &Scene, rays: u32, adaptive: bool) -> Scene {
    let mut settings: Settings = scene.settings.clone();
    (settings.ray.rays, settings.ray.adaptive) = (rays, adaptive);
    Scene::new(scene.geometry.clone(), scene.input, settings).expect("scene")
}

/// Looks: preset, settings, and rays along each edge of a pixel. The first ones have soft and transparent edges.
const LOOKS: [(&str, &str, u32); 6] = [
    ("glass", "", 2),
    ("face-classic", "volume.shading=none", 2),
    ("face", "light.volume.ground={}", 2),
    ("face", "camera.azimuth=40;post.contrast=1.4;post.gamma=1.5", 3),
    ("skeleton", "camera.elevation=-30", 2),
    ("face-classic", "volume.shading=none;layout=four", 2),
];

#[test]
fn the_picture_is_that_of_all_rays_within_a_level() {
    equals_all_rays(&LOOKS[..2]);
}

#[test]
fn the_picture_of_every_other_look_is_that_of_all_rays_within_a_level() {
    equals_all_rays(&LOOKS[2..]);
}

/// One ray alone is further off, or the test would say nothing.
fn equals_all_rays(looks: &[(&str, &str, u32)]) {
    let stage = Stage::new();
    for (preset, view, rays) in looks.iter().copied() {
        let single = stage.scene((preset, "vr", [150, 140]), view);
        let all = with(&single, rays, false);
        let mut renderer = stage.renderer(all.clone());
        let wanted = renderer.picture().expect("picture");
        let mut drawn = |scene: &Scene| {
            renderer.change(scene.clone()).expect("change");
            let picture = renderer.picture().expect("picture");
            let marks = renderer.read(Slot::EdgeMarks).expect("read");
            (picture, marks.map(|m| m.values.iter().sum::<f64>() / m.values.len() as f64))
        };
        let adaptive = with(&single, rays, true);
        assert!(adaptive.adapts_rays());
        let ((picture, marked), (one, none)) = (drawn(&adaptive), drawn(&single));
        let off = |picture: &echolume::low_level::picture::Picture| {
            let levels = picture.rgba.iter().zip(&wanted.rgba).map(|(a, b)| a.abs_diff(*b));
            (levels.clone().filter(|n| *n > 1).count() as f64 / wanted.rgba.len() as f64, levels.max())
        };
        let marked = marked.expect("marks");
        println!("{preset} {view}: {:.1} % marked, {:?}; one ray {:?}", 100.0 * marked, off(&picture), off(&one));
        assert!(none.is_none() && marked > 0.0 && marked < 0.8, "{preset} {view}: {marked}");
        assert!(off(&one).0 > 20.0 * off(&picture).0, "{preset} {view}: {:?}", off(&one));
        // Detail that is finer than the rays of one a pixel can hide between them.
        assert!(off(&picture).0 < 1e-4 && off(&picture).1 <= Some(3), "{preset} {view}: {:?}", off(&picture));
    }
}

/// Pictures that are not the colour along each ray alone have all rays, as without it.
#[test]
fn other_pictures_have_all_rays() {
    for toml in [
        "mode = 'sr'",
        "mode = 'mip'",
        "mode = 'mixed'",
        "mode = 'vr'\nvolume.shading = 'first-hit'",
        "mode = 'vr'\nclip = [{ at = [0, 30, 0], normal = [0.3, -1, 0.2] }]",
        "mode = 'vr'\nstill = { samples = 2 }",
    ] {
        let of = |adaptive: bool| {
            let more = format!("{toml}\n[ray]\nrays = 2\nadaptive = {adaptive}");
            let scene = scene(cartesian([20, 20, 20]), BYTES, &more);
            Plan::new(&scene).steps.iter().map(|s| s.id()).collect::<Vec<_>>()
        };
        assert_eq!(of(true), of(false), "{toml}");
        assert!(!of(true).contains(&("mark_edges", 0)), "{toml}");
    }
}

/// The rays of unmarked pixels are not cast: their texels stay as they were.
#[test]
fn unmarked_pixels_have_no_ray() {
    let device = Device::new();
    let toml = "mode = 'vr'\npicture.size = [24, 16]\nray = { rays = 2, adaptive = true, brick = 0 }";
    let scene = scene(cartesian([20, 20, 20]), BYTES, toml);
    let pass = by_name("raycast_refined").expect("pass");
    let args = DispatchArgs::default();
    let mut inputs = echolume::low_level::verify::each_pass::inputs_of(&scene, pass, &args, "noise", 7);
    let marks = echolume::low_level::passes::Texels::from_fn([24, 16, 1], 1, |[x, y, _], _| {
        f64::from(u8::from(x == 5 && y == 3))
    });
    inputs.insert("marks", marks);
    let mut runner = echolume::low_level::gpu::pass_runner::PassRunner::new(&device).expect("runner");
    let got = runner.run(&scene, pass, &args, &inputs, 0.625).expect("run");
    let texels = got.get("picture");
    for (x, y) in (0..32).flat_map(|y| (0..48).map(move |x| (x, y))) {
        let is_cast = x / 2 == 5 && y / 2 == 3;
        assert_eq!(texels.get([x, y, 0]) != [0.625; 4], is_cast, "{x} {y}");
    }
}
