//! Dispatches in bands: the same texels as in one piece, in any band, on any number of queues; and no band where none is needed.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Bands, Renderer, RendererOptions};
use echolume::low_level::passes::{DispatchArgs, Frequency, PASSES, Slot, Texels, by_name};
use echolume::low_level::probe::{Axis, Geometry, Probe};
use echolume::low_level::queues::oracle::Event;
use echolume::low_level::scene::Scene;
use echolume::low_level::verify::built_in::labelled;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// One workgroup: bands are as small as they can be, a row of workgroups.
const INVOCATIONS: u64 = 64;

/// Together they need every pass, each with several rows of workgroups.
const SCENES: [&str; 20] = [
    ALL_FILTERS,
    "mode = 'vr'\nray = { brick = 4 }\nfloating = 5.0",
    "mode = 'vr'\ncuts = [{ contour = [[-8, -6], [9, -5], [3, 9]], view = { at = [0, 20, 0], direction = [0.2, 1, 0], up = [0, 0, 1] } }]",
    "mode = 'sr'\nray = { brick = 4 }",
    "mode = 'sr'\nsurface = { detector = 'consistent' }",
    "mode = 'vr'\nlight = { volume = { cell = 1.5 } }",
    "mode = 'vr'\nray = { brick = 4 }\nstill = { samples = 3, batch = 2, events = 4 }",
    "mode = 'vr'\nray = { rays = 2, adaptive = true }",
    "mode = 'vr'\nray = { tolerance = 1 }",
    "mode = 'mip'",
    "mode = 'vr'\nclip = [{ at = [0, 30, 0], normal = [0.3, -1, 0.2] }]",
    "mode = 'orthogonal'",
    "mode = 'orthogonal'\npost = { floats = true }",
    "mode = 'cube'",
    "mode = 'sr'\nlayout = 'four'\nlabels = { shell = 0.5 }",
    "mode = 'mixed'\nlayout = 'four'\nplanes = { smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 } }",
    "mode = 'sr'\nlayout = 'pair'",
    "mode = 'sr'\nlight = { shadow = {}, occlusion = {}, skin = {} }\nslices = { smooth = { elevation = 1.0 } }\n\
     ray = { sampling = 'quads' }",
    "mode = 'sr'\nslices = { smooth = { lateral = 1.0, depth = 1.0, elevation = 1.0 } }\n\
     distance = { enhanced_sigma = {}, perona_malik = { repeat = 2 } }\n\
     post = { enhanced_sigma = {}, perona_malik = { repeat = 2 } }",
    "mode = 'sr'\npost = { perona_malik = { scheme = 'aos', step = 2.0, repeat = 1 } }",
];

fn band_scenes() -> Vec<Scene> {
    let probe = Probe {
        lines: Axis::centred(1.1 / 95.0, 96),
        slices: Axis::centred(0.8 / 32.0, 33),
        sample_pitch: 0.25,
        samples: 240,
        ..wobbler()
    };
    let build = |toml: &&str| {
        let mut built = scene(Geometry::Sweep(probe.clone()), BYTES, toml);
        if toml.contains("labels") {
            built = labelled(built).expect("labels");
        }
        built.settings.picture.size = [84, 76];
        built.settings.slices.pixels = 200;
        Scene::new(built.geometry, built.input, built.settings).expect("scene")
    };
    SCENES.iter().map(build).collect()
}

fn frames_of(scene: &Scene) -> Vec<Texels> {
    let mut noise = Noise(5);
    let speckle: Vec<f64> = (0..4096).map(|_| noise.next()).collect();
    let at = |p: f64| (p * 37.0).abs() as usize;
    body_frames(scene, |p| {
        let level = if p.y > 40.0 { 0.8 } else { 0.2 };
        level * (0.5 + 0.5 * speckle[(at(p.x) + 61 * at(p.y) + 977 * at(p.z)) % 4096])
    })
}

fn renderer(device: &Device, scene: &Scene, options: &RendererOptions) -> Renderer {
    let mut renderer = Renderer::new(device, scene.clone(), options).expect("renderer");
    send(&mut renderer, &frames_of(scene), 0);
    renderer
}

/// The bits of the values in each slot.
type Contents = Vec<(Slot, Vec<u64>)>;
/// Passes with their invocations.
type Dispatched = Vec<(&'static str, [u32; 3])>;

/// All that the passes over volume and picture left, by slot, and the dispatches that made it.
fn made(renderer: &mut Renderer) -> (Contents, Dispatched) {
    let dispatched = renderer.dispatch_extents(|r| r.picture()).expect("picture");
    let slots = renderer.plan().slots.clone();
    let read = slots.into_iter().filter_map(|slot| {
        let texels = renderer.read(slot).expect("read")?;
        Some((slot, texels.values.iter().map(|v| v.to_bits()).collect()))
    });
    (read.collect(), dispatched)
}

fn invocations(extent: [u32; 3]) -> u64 {
    extent.iter().map(|n| u64::from(*n)).product()
}

/// Every pass over the volume or the picture leaves the same bits in bands as in one piece, with as many invocations.
#[test]
fn bands_leave_the_bits_of_one_dispatch_in_every_pass() {
    let device = Device::alone();
    let mut divided: BTreeMap<&str, bool> = BTreeMap::new();
    for (name, scene) in SCENES.iter().zip(band_scenes()) {
        let (whole, dispatched) = made(&mut renderer(&device, &scene, &RendererOptions::default()));
        let bands = Bands::Fixed(INVOCATIONS);
        let (parts, in_bands) = made(&mut renderer(&device, &scene, &RendererOptions { bands, ..Default::default() }));
        for ((slot, whole), (_, parts)) in whole.iter().zip(&parts) {
            assert!(whole == parts, "{name}: {} differs", slot.name());
        }
        let sum = |list: &[(&'static str, [u32; 3])]| {
            let mut sums: BTreeMap<&str, (u64, usize)> = BTreeMap::new();
            for (pass, extent) in list {
                let sum = sums.entry(*pass).or_default();
                *sum = (sum.0 + invocations(*extent), sum.1 + 1);
            }
            sums
        };
        let (one, many) = (sum(&dispatched), sum(&in_bands));
        assert_eq!(one.keys().collect::<Vec<_>>(), many.keys().collect::<Vec<_>>(), "{name}");
        for (pass, (total, count)) in &one {
            let (in_parts, parts) = many[pass];
            assert_eq!(in_parts, *total, "{name}: {pass} has other invocations in bands");
            assert!(parts >= *count, "{name}: {pass}");
            *divided.entry(*pass).or_default() |= parts > *count;
        }
    }
    // One is a single workgroup; how many the other has, only the device knows.
    let undivided = ["tolerance_list", "tolerance_refine"];
    let over_all = PASSES.iter().filter(|p| p.frequency != Frequency::Frame && !undivided.contains(&p.name));
    let never: Vec<_> = over_all.filter(|p| divided.get(p.name) != Some(&true)).map(|p| p.name).collect();
    assert!(never.is_empty(), "no scene divides {never:?}");
}

fn shaded() -> Scene {
    let toml = "mode = 'sr'\npicture = { size = [40, 52] }\nslices = { pixels = 40, smooth = { elevation = 0.7 } }\n\
                distance = { median = 3 }\nlight = { shadow = {}, occlusion = {} }";
    scene(Geometry::Sweep(wobbler()), BYTES, toml)
}

/// Where nothing has to be divided, each step of the plan is one dispatch and a picture one submission.
#[test]
fn a_picture_that_needs_no_bands_has_none() {
    let device = Device::alone();
    let mut renderer = renderer(&device, &shaded(), &RendererOptions { log: true, ..Default::default() });
    let steps = renderer.plan().steps.iter().filter(|s| s.pass.frequency != Frequency::Frame).count();
    let submitted = renderer.log().expect("log").submissions.len();
    let before = device.counts.dispatches.load(Ordering::Relaxed);
    renderer.picture().expect("picture");
    if device.candidate.is_software() {
        assert_eq!(device.counts.dispatches.load(Ordering::Relaxed) - before, steps as u64);
        assert_eq!(renderer.log().expect("log").submissions.len() - submitted, 1);
    }
    // Its passes are measured now, also on a GPU: none of so few invocations takes long.
    let submitted = renderer.log().expect("log").submissions.len();
    renderer.show(0).expect("show");
    let before = device.counts.dispatches.load(Ordering::Relaxed);
    renderer.picture().expect("picture");
    let pictures = renderer.plan().steps.iter().filter(|s| s.pass.frequency == Frequency::Picture).count() as u64;
    assert_eq!(device.counts.dispatches.load(Ordering::Relaxed) - before, pictures);
    assert_eq!(renderer.log().expect("log").submissions.len() - submitted, 1);
}

/// Each band is a submission of its own, so that a watchdog counts it alone, and it is as large as asked for; the last one also holds
/// what follows. On any number of queues every conflict stays ordered.
#[test]
fn each_band_is_a_submission_and_all_are_ordered() {
    let device = Device::alone();
    let bands = Bands::Fixed(INVOCATIONS);
    let scene = shaded();
    for queues in 1..=device.queue_count() {
        let options = RendererOptions { bands, queues: Some(queues), log: true, ..Default::default() };
        let mut renderer = renderer(&device, &scene, &options);
        let submitted = renderer.log().expect("log").submissions.len();
        let steps: Vec<_> = renderer
            .plan()
            .steps
            .iter()
            .filter(|s| s.pass.frequency != Frequency::Frame)
            .map(|s| s.pass.name)
            .collect();
        renderer.take_times().expect("idle");
        let dispatched = renderer.dispatch_extents(|r| r.picture()).expect("picture");
        let times = renderer.take_times().expect("times");
        let pictures: Vec<_> = times.iter().map(|t| (t.name, t.runs)).collect();
        assert_eq!(pictures, [("picture", 1)], "one run, in whatever submissions");
        let log = renderer.log().expect("log");
        let cuts = dispatched.len() - steps.len();
        assert!(cuts > 20, "{cuts}");
        assert_eq!(log.submissions.len() - submitted, cuts + 1);
        for submission in &log.submissions[submitted..submitted + cuts] {
            let works = submission.events.iter().filter(|e| matches!(e, Event::Operation(_))).count();
            assert!((1..=steps.len()).contains(&works), "{works}");
        }
        assert_eq!(log.find_hazard(&scene), None, "{queues} queues");
        let pass = by_name("raycast_surface").expect("pass");
        let [width, height, _] = pass.invocations(renderer.scene(), &DispatchArgs::default());
        let rays: Vec<_> = dispatched.iter().filter(|(name, _)| *name == "raycast_surface").collect();
        assert!(rays.len() > 2);
        for (_, extent) in &rays {
            // A row of workgroups is the least.
            assert!(extent[0] == width && invocations(*extent) <= INVOCATIONS.max(8 * u64::from(width)), "{extent:?}");
        }
        assert_eq!(rays.iter().map(|(_, extent)| extent[1]).sum::<u32>(), height);
    }
}

/// A renderer whose bands are held back, each until the one before is done.
fn paced(device: &Device, scene: &Scene) -> Renderer {
    let options = RendererOptions {
        bands: Bands::Fixed(INVOCATIONS),
        paced: true,
        volume_images: 2,
        queues: Some(1),
        ..Default::default()
    };
    renderer(device, scene, &options)
}

/// Asks until the picture is done. Returns how often something was held back.
fn poll(renderer: &mut Renderer) -> usize {
    let mut held = 0;
    while renderer.is_drawing().expect("asked") {
        held += usize::from(renderer.held_back() > 0);
        std::thread::yield_now();
    }
    held
}

/// Bands that are held back are submitted by asking and by waiting, before whatever came later, and leave the same picture.
#[test]
fn bands_that_are_held_back_give_the_same_pictures_in_the_same_order() {
    let device = Device::alone();
    let scene = &band_scenes()[2];
    let other: Vec<Texels> = frames_of(scene).into_iter().rev().collect();
    let expected = |frames: &[Texels]| {
        let mut plain = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
        send(&mut plain, frames, 0);
        plain.picture().expect("picture")
    };
    let wanted = [expected(&frames_of(scene)), expected(&other)];

    let mut renderer = paced(&device, scene);
    assert!(renderer.is_paced());
    renderer.begin_picture().expect("begun");
    assert!(renderer.held_back() > 1 && poll(&mut renderer) > 1 && renderer.held_back() == 0);
    assert!(renderer.end_picture().expect("picture") == wanted[0]);

    // Frames of the next volume come behind the bands, and the picture of it behind the frames.
    renderer.show(0).expect("shown again");
    renderer.begin_picture().expect("begun");
    assert!(renderer.takes_frame().expect("asked"));
    send(&mut renderer, &other, 1);
    assert!(renderer.end_picture().expect("picture") == wanted[0], "of the volume that it was begun with");
    renderer.show(1).expect("the other");
    renderer.begin_picture().expect("begun");
    assert!(renderer.held_back() > 1, "nobody asked");
    assert!(renderer.end_picture().expect("picture") == wanted[1]);

    // A change of scene, and the end, wait for all of it.
    renderer.show(1).expect("again");
    renderer.begin_picture().expect("begun");
    let mut smaller = scene.clone();
    smaller.settings.picture.size = [40, 44];
    renderer.change(Scene::new(smaller.geometry, smaller.input, smaller.settings).expect("scene")).expect("change");
    assert_eq!(renderer.held_back(), 0);
    renderer.begin_picture().expect("begun");
    assert!(renderer.held_back() > 1);
    drop(renderer);
}

/// Nobody waits on a device with several queues for what is not submitted yet.
#[test]
fn nothing_is_held_back_where_several_queues_wait_for_each_other() {
    let device = Device::alone();
    let options = RendererOptions { paced: true, queues: Some(2), ..Default::default() };
    let renderer = renderer(&device, &band_scenes()[0], &options);
    assert!(!renderer.is_paced() && renderer.held_back() == 0);
}
