//! Pictures of the recordings with their presets: not black, without holes, and objects in their true positions.

use crate::common::gpu::*;
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene};
use echolume::low_level::source::Recording;
use glam::DVec3;

fn preset(device: &Device, file: &str, preset: &str, mode: &str) -> (Scene, Renderer) {
    let mut recording = Recording::open(&data(file), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let mut layers = Layers::default();
    layers.preset(preset).expect("preset");
    for set in [format!("mode={mode}"), "picture.size=[256,256]".into()] {
        layers.set(&set).expect("set");
    }
    let scene = Scene::new(recording.geometry(0), input, layers.finish().expect("settings")).expect("scene");
    let mut renderer = Renderer::new(device, scene.clone(), &RendererOptions::default()).expect("renderer");
    while let Some(frame) = recording.next_frame().expect("frame") {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    (scene, renderer)
}

/// Share of pixels that are lit, and their mean level.
fn lit(renderer: &mut Renderer) -> (f64, f64) {
    let picture = renderer.picture().expect("picture");
    let levels: Vec<f64> =
        picture.rgba.chunks_exact(4).map(|p| f64::from(p[0].max(p[1]).max(p[2]))).filter(|v| *v > 16.0).collect();
    (levels.len() as f64 / (256.0 * 256.0), levels.iter().sum::<f64>() / levels.len().max(1) as f64)
}

/// Position of the surface at a pixel.
fn place(scene: &Scene, distances: &Texels, x: usize, y: usize) -> Option<DVec3> {
    let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let distance = distances.one(x, y, 0);
    is_hit(distance).then(|| origin + direction * distance)
}

#[test]
fn the_presets_fill_their_pictures() {
    let device = Device::new();
    for (file, name) in [("wobbler-4dc7/sweep.mha", "fetal"), ("bone-l14/bone.mha", "bone")] {
        for mode in ["sr", "vr"] {
            let (_, mut renderer) = preset(&device, file, name, mode);
            let (share, level) = lit(&mut renderer);
            println!("{name} {mode}: {:.0} % lit, mean level {level:.0}", 100.0 * share);
            assert!(share > 0.15 && share < 0.95, "{name} {mode}: {share} of the picture is lit");
            assert!(level > 60.0, "{name} {mode} is dark: {level}");
        }
    }
}

/// Prevents a readback that keeps the rows of a picture of another shape with as many bytes.
#[test]
fn a_picture_of_another_shape_with_as_many_bytes_is_that_of_a_new_renderer() {
    let device = Device::new();
    let sized = |size: [u32; 2]| {
        let (scene, renderer) = preset(&device, "bone-l14/bone.mha", "bone", "mip");
        let mut settings = scene.settings.clone();
        settings.picture.size = size;
        let scene = Scene::new(scene.geometry.clone(), scene.input, settings).expect("scene");
        (scene, renderer)
    };
    let [(wide, mut changed), (tall, mut fresh)] = [[96, 40], [40, 96]].map(sized);
    changed.change(wide).expect("change");
    changed.picture().expect("picture");
    changed.change(tall.clone()).expect("change");
    fresh.change(tall).expect("change");
    let [changed, fresh] = [changed.picture().expect("picture"), fresh.picture().expect("picture")];
    assert!([changed.width, changed.height] == [40, 96] && changed.rgba == fresh.rgba);
}

/// The head of sweep.json: an ellipsoid with a nose and two eye sockets, viewed from the probe.
#[test]
fn the_wobblers_head_has_its_nose_and_eyes_where_the_truth_has_them() {
    let device = Device::new();
    let (scene, mut renderer) = preset(&device, "wobbler-4dc7/sweep.mha", "fetal", "sr");
    renderer.picture().expect("picture");
    let distances = renderer.read(Slot::Distance).expect("read").expect("there");
    let axis = scene.probe().expect("a sweep").axis_depth();
    let centre = DVec3::new(4.0, 95.0 + axis, -3.0);
    let semi = DVec3::new(26.0, 26.0, 22.0);
    // Height of the surface over the plain ellipsoid, as a share of its radius, around a direction (lateral, elevation).
    let height = |lateral: f64, elevation: f64| {
        let mut heights = Vec::new();
        for y in 0..256 {
            for x in 0..256 {
                let Some(p) = place(&scene, &distances, x, y) else { continue };
                let u = (p - centre) / semi;
                if (u.x / u.length() - lateral).hypot(u.z / u.length() - elevation) < 0.06 && u.y < 0.0 {
                    heights.push(u.length() - 1.0);
                }
            }
        }
        heights.sort_by(f64::total_cmp);
        assert!(heights.len() > 5, "no surface about ({lateral}, {elevation})");
        heights[heights.len() / 2]
    };
    let (nose, left, right) = (height(-0.05, 0.05), height(0.38, 0.30), height(-0.48, 0.30));
    let (low_left, low_right) = (height(0.38, -0.30), height(-0.48, -0.30));
    println!("nose {nose:.3}, eyes {left:.3} {right:.3}, mirrored in elevation {low_left:.3} {low_right:.3}");
    assert!(nose > 0.08, "the nose stands out: {nose}");
    assert!(left < low_left - 0.02 && right < low_right - 0.02, "the eyes are hollows above the nose, not below it");
}
