//! Real and simulated recordings against known facts.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::lookup_tables::scan_index;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Geometry, Probe};
use echolume::low_level::scene::{Input, Scene, SliceGrid};
use echolume::low_level::source::Recording;
use glam::DVec3;

/// The conversion that the PLUS toolkit stored beside the frames: 820 x 616 pixels of 0.15 mm, apex at (410, 87).
fn plus_scene(recording: &Recording) -> Scene {
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let settings =
        settings("mode = 'vr'\nslices = { format = 'r32f', everything = true }\npicture = { size = [8, 8] }");
    let mut scene = Scene::new(recording.geometry(0), input, settings).expect("scene");
    scene.apron = 0.0;
    let origin = [-(410.0 - 0.5) * 0.15, 10.0 - 87.0 * 0.15];
    scene.on_grid(SliceGrid { size: [820, 616], origin, pitch: [0.15, 0.15] })
}

fn frames_of(name: &str) -> (Recording, Vec<Vec<u8>>) {
    let mut recording = Recording::open(&data(name), None).expect("recording");
    let mut frames = Vec::new();
    while let Some(frame) = recording.next_frame().expect("frame") {
        frames.push(frame.bytes);
    }
    (recording, frames)
}

#[test]
fn five_real_frames_are_converted_as_the_plus_toolkit_did() {
    let device = Device::new();
    let (recording, frames) = frames_of("ultrasonix-curvilinear/brightness.mha");
    let (_, stored) = frames_of("ultrasonix-curvilinear/scan-converted.mha");
    assert_eq!((frames.len(), stored.len()), (5, 5));
    let scene = plus_scene(&recording);
    let probe = scene.probe().expect("polar");
    // The source position of each pixel, once for all five frames.
    let lut: Vec<Option<(f64, f64)>> = (0..616 * 820)
        .map(|i| scene.grid.place(f64::from(i % 820), f64::from(i / 820)))
        .map(|(x, y)| scan_index(&scene, probe, x, y))
        .collect();
    let mut renderer = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
    let (mut equal, mut largest) = (0usize, 0i32);
    for (frame, stored) in frames.iter().zip(&stored) {
        let value = |i: usize, j: usize| f64::from(frame[j * 3640 + i]);
        for (at, &stored) in lut.iter().zip(stored) {
            let expected = at.map_or(0.0, |(sample, line)| {
                let (i, j) = (sample.floor(), line.floor());
                let (u, v) = (sample - i, line - j);
                let (i, j) = (i as usize, j as usize);
                let near = (1.0 - u) * value(i, j) + u * value(i + 1, j);
                (1.0 - v) * near + v * ((1.0 - u) * value(i, j + 1) + u * value(i + 1, j + 1))
            });
            // PLUS rounds by adding one half and truncating.
            assert_eq!((expected + 0.5).floor() as u8, stored, "the f64 reference equals the stored conversion");
        }
        renderer.frame(0, frame, 0).expect("frame");
        renderer.show(0).expect("show");
        let slice = renderer.read(Slot::Volume).expect("read").expect("there");
        for (got, &stored) in slice.values.iter().zip(stored) {
            let off = ((got * 255.0 + 0.5).floor() as i32 - i32::from(stored)).abs();
            equal += usize::from(off == 0);
            largest = largest.max(off);
        }
    }
    let share = equal as f64 / (5.0 * 820.0 * 616.0);
    println!("equal to the PLUS toolkit: {:.4} % of pixels, largest difference {largest}", 100.0 * share);
    device.figure("plus-pixels", &format!("{:.2}", 100.0 * share));
    // f32 rounds an index near 3640 by 2.4e-4 of a sample, which can change the rounding of values that close to a half.
    assert!(share >= 0.999 && largest <= 1, "{share}, {largest}");

    // The half pixel matters: without it most pixels differ.
    let mut shifted = scene.clone();
    shifted.grid.origin[0] -= 0.5 * 0.15;
    let mut renderer = Renderer::new(&device, shifted, &RendererOptions::default()).expect("renderer");
    renderer.frame(0, &frames[0], 0).expect("frame");
    let slice = renderer.read(Slot::Volume).expect("read").expect("there");
    let differ = slice.values.iter().zip(&stored[0]).filter(|(g, s)| (*g * 255.0 + 0.5).floor() as u8 != **s).count();
    assert!(differ > 820 * 616 / 8, "half a pixel went unnoticed: {differ}");
}

/// Probe, scene and volume of a recorded sweep, 700 pixels a slice.
pub fn wobbler_volume(device: &Device, file: &str, more: &str) -> (Probe, Scene, Texels) {
    let mut recording = Recording::open(&data(file), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let slices = "slices = { format = 'r32f', pixels = 700 }";
    let settings = settings(&format!("mode = 'vr'\n{slices}\npicture = {{ size = [8, 8] }}\n{more}"));
    let scene = Scene::new(recording.geometry(0), input, settings).expect("scene");
    let mut renderer = Renderer::new(device, scene.clone(), &RendererOptions::default()).expect("renderer");
    while let Some(frame) = recording.next_frame().expect("frame") {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    let volume = renderer.read(Slot::Volume).expect("read").expect("there");
    let Geometry::Sweep(probe) = recording.geometry(0) else { panic!("a sweep") };
    (probe, scene, volume)
}

/// The five wires by their energy-weighted centroid: 10^(v 4.5) over a ball of 2 mm about the brightest voxel within 2.5 mm of
/// the truth. (45 dB of dynamic range; a centroid of the stored values is off by 0.3 mm.)
#[test]
fn the_wobblers_wires_lie_within_a_tenth_of_a_millimetre() {
    let device = Device::new();
    let (probe, scene, volume) = wobbler_volume(&device, "wobbler-4dc7/sweep.mha", "");
    // Lateral, elevation, depth from the wobble axis, as in sweep.json.
    let wires = [[0.0, 0.0, 60.0], [20.0, 0.0, 60.0], [-20.0, 0.0, 60.0], [0.0, 12.0, 65.0], [0.0, -12.0, 65.0]];
    for mirrored in [false, true] {
        let mut worst = 0.0f64;
        for [lateral, elevation, depth] in wires {
            let side = if mirrored { -1.0 } else { 1.0 };
            let truth =
                DVec3::new(lateral + if mirrored { 0.5 } else { 0.0 }, depth + probe.axis_depth(), side * elevation);
            let found = centroid(&probe, &scene, &volume, truth);
            let off = found.distance(truth);
            println!("wire at {truth:.2}: off by {:.3} mm ({:.3})", off, found - truth);
            worst = worst.max(off);
        }
        if mirrored {
            assert!(worst > 0.3, "half a millimetre of shift went unnoticed: {worst}");
        } else {
            assert!(worst < 0.1, "off by {worst} mm");
            device.figure("wires", &format!("{worst:.3}"));
        }
    }
}

pub fn centroid(probe: &Probe, scene: &Scene, volume: &Texels, truth: DVec3) -> DVec3 {
    let mut near = Vec::new();
    for k in 0..volume.size[2] {
        for row in 0..volume.size[1] {
            for column in 0..volume.size[0] {
                let (x, y) = scene.grid.place(column as f64, row as f64);
                let place = probe.sweep_map(x, y, probe.slices.at(k as f64));
                if place.distance(truth) < 5.0 {
                    // Voxels of a fan grow with the distance from its axis.
                    near.push((place, volume.one(column, row, k), y - probe.axis_depth()));
                }
            }
        }
    }
    let close = near.iter().filter(|(p, ..)| p.distance(truth) < 2.5);
    let brightest = close.max_by(|a, b| a.1.total_cmp(&b.1)).expect("voxels near the wire").0;
    let ball = near.iter().filter(|(p, ..)| p.distance(brightest) < 2.0);
    let (sum, weight) = ball.fold((DVec3::ZERO, 0.0), |(sum, weight), (p, v, size)| {
        let w = 10f64.powf(v * 4.5) * size;
        (sum + *p * w, weight + w)
    });
    sum / weight
}

#[test]
fn the_kretz_file_gives_the_same_volume_as_the_metaimage() {
    let device = Device::new();
    let (a_probe, a_scene, a) = wobbler_volume(&device, "wobbler-4dc7/sweep.mha", "");
    let (b_probe, b_scene, b) = wobbler_volume(&device, "wobbler-4dc7/sweep.vol", "");
    assert_eq!(a_scene.grid.size, b_scene.grid.size);
    assert!((a_probe.first_range() - b_probe.first_range()).abs() < 1e-6);
    let largest = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(largest < 1e-5, "volumes differ by {largest}");
    assert!(a.values.iter().any(|v| *v > 0.5), "there is something in them");
}
