//! How the pipelines of a scene are made: at the same time, and each once.

use crate::common::gpu::*;
use crate::common::wait;
use echolume::low_level::gpu::{ContextOptions, GpuError, Renderer, RendererOptions, Shaders};
use echolume::low_level::plan::Plan;
use echolume::low_level::spirv;
use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

const SETTINGS: &str =
    "mode = 'sr'\nlayout = 'four'\nslices = { pixels = 24, median = true }\npicture = { size = [32, 32] }";
/// A limit far above what a second thread needs to start.
const BOUND: Duration = Duration::from_secs(60);

fn embedded(name: &str) -> Result<Vec<u32>, String> {
    spirv::embedded(name).map(spirv::words).ok_or_else(|| "is not embedded".into())
}

fn options(shaders: Arc<Shaders>) -> RendererOptions {
    RendererOptions { shaders, ..RendererOptions::default() }
}

/// Prevents a start that compiles one pipeline after the other: the first one that asks for its shader waits here for another to ask.
#[test]
fn the_pipelines_of_a_scene_are_compiled_at_the_same_time_and_once() {
    let device = Device::alone();
    let scene = scene(echolume::low_level::probe::Geometry::Sweep(wobbler()), BYTES, SETTINGS);
    let several = rayon::current_num_threads() > 1;
    let asked = Arc::new((Mutex::new(0u32), Condvar::new()));
    let met = Arc::new(Mutex::new(false));
    let (counted, found) = (asked.clone(), met.clone());
    let shaders: Arc<Shaders> = Arc::new(move |name| {
        let (count, changed) = &*counted;
        let mut asking = count.lock().expect("lock");
        *asking += 1;
        changed.notify_all();
        if several && *asking == 1 {
            let waited = changed.wait_timeout_while(asking, BOUND, |asking| *asking < 2).expect("lock");
            *found.lock().expect("lock") = !waited.1.timed_out();
        }
        embedded(name)
    });
    let before = device.counts.pipelines.load(Ordering::Relaxed);
    let renderer = Renderer::new(&device, scene, &options(shaders)).expect("renderer");
    assert!(*met.lock().expect("lock") || !several, "no second pipeline was begun before the first was made");
    let keys: BTreeSet<String> = (renderer.plan().steps.iter())
        .map(|step| {
            let (args, scene) = (step.args(), renderer.scene());
            let formats: Vec<_> = step.pass.reads(scene, &args).iter().map(|b| b.slot.format(scene)).collect();
            format!("{} {:?} {formats:?}", step.pass.shader(scene, &args), step.pass.constants(scene, &args))
        })
        .collect();
    let made = device.counts.pipelines.load(Ordering::Relaxed) - before;
    assert!(keys.len() > 5, "{keys:?}");
    assert_eq!(made, keys.len() as u64, "{keys:?}");
}

/// A second renderer of a scene compiles nothing while the first holds its pipelines, and draws the same; shaders of its own are compiled.
#[test]
fn renderers_of_a_device_share_the_pipelines_of_the_embedded_shaders() {
    let device = Device::alone();
    let of = |settings: &str| scene(echolume::low_level::probe::Geometry::Sweep(wobbler()), BYTES, settings);
    let made = || device.counts.pipelines.load(Ordering::Relaxed);
    let frames = body_frames(&of(SETTINGS), |p| 0.5 + 0.4 * (0.3 * p.y).sin());
    let mut first = rendered(&device, of(SETTINGS), &frames);
    let compiled = made();
    assert!(compiled > 5);
    let mut second = rendered(&device, of(SETTINGS), &frames);
    assert_eq!(made(), compiled, "the second renderer compiles what the first has");
    let pictures = [&mut first, &mut second].map(|renderer| renderer.picture().expect("a picture").rgba);
    assert!(pictures[0] == pictures[1], "the pictures differ");
    drop(Renderer::new(&device, of(SETTINGS), &options(Arc::new(embedded))).expect("renderer"));
    assert_eq!(made(), 2 * compiled, "shaders of another source are not those of the first");
    drop((first, second));
    drop(Renderer::new(&device, of(SETTINGS), &RendererOptions::default()).expect("renderer"));
    assert_eq!(made(), 3 * compiled, "nobody held the pipelines");
}

/// Prevents another error each time, depending on which thread is faster: the first fault of the plan is reported.
#[test]
fn of_several_shaders_that_fail_the_first_of_the_plan_is_named() {
    let device = Device::alone();
    let scene = scene(echolume::low_level::probe::Geometry::Sweep(wobbler()), BYTES, SETTINGS);
    let plan = Plan::new(&scene);
    let first = plan.steps[0].pass.shader(&scene, &plan.steps[0].args());
    for _ in 0..4 {
        let shaders: Arc<Shaders> = Arc::new(|name| Err(format!("{name} is missing")));
        let error = Renderer::new(&device, scene.clone(), &options(shaders)).err().expect("no shader");
        assert!(matches!(&error, GpuError::Shader { shader, .. } if shader == first), "{error}");
    }
}

const MODES: [&str; 4] = [
    "mode = 'sr'\ndistance.median = 3",
    "mode = 'vr'\nslices.median = true",
    "mode = 'mip'\nray.slice_index = 'table'",
    "mode = 'orthogonal'",
];

fn in_mode(mode: &str) -> echolume::low_level::scene::Scene {
    let settings = format!("{mode}\nslices.pixels = 24\npicture.size = [32, 32]");
    scene(echolume::low_level::probe::Geometry::Sweep(wobbler()), BYTES, &settings)
}

/// Prevents memory that grows with every change of a kiosk's settings, and pipelines destroyed while they are used or asked for.
#[test]
fn forgotten_pipelines_are_compiled_again_and_draw_the_same() {
    // None is kept but the one compiled last: fewer than any plan has.
    let device = Device::watched_with(ContextOptions { max_unused_pipelines: Some(0), ..ContextOptions::default() });
    let made = || device.counts.pipelines.load(Ordering::Relaxed);
    let frames = body_frames(&in_mode(MODES[0]), |p| 0.5 + 0.4 * (0.3 * p.y).sin());
    // With every pipeline kept.
    let keeping = Device::watched_with(ContextOptions::default());
    let expected: Vec<_> = MODES
        .iter()
        .map(|mode| rendered(&keeping, in_mode(mode), &frames).picture().expect("a picture").rgba)
        .collect();
    let mut renderer = Renderer::new(&device, in_mode(MODES[0]), &RendererOptions::default()).expect("renderer");
    let mut compiled = Vec::new();
    for round in 0..3 {
        let before = made();
        for (mode, expected) in MODES.iter().zip(&expected) {
            // In the second round by the compiler in the background, and in the third by it again, which has been asked for all of them before.
            let begun = std::time::Instant::now();
            while round > 0 && !renderer.prepare(&in_mode(mode)).expect("pipelines") {
                assert!(begun.elapsed() < BOUND, "{mode} is never compiled");
                wait::poll();
            }
            renderer.change(in_mode(mode)).expect("a change");
            send(&mut renderer, &frames, 0);
            let drawn = renderer.picture().expect("a picture").rgba;
            let differ = drawn.iter().zip(expected).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "{mode} in round {round}: values of {} that differ", drawn.len());
        }
        compiled.push(made() - before);
    }
    assert!(compiled[1] > 6 && compiled[2] > 6, "what was compiled is kept: {compiled:?}");
}

/// Prevents a shortcut of the tests that hides what the program does: modules with values written into them draw the bits that modules
/// specialized by the driver draw.
#[test]
fn modules_specialized_here_draw_what_those_of_the_driver_draw() {
    let drawn = |specialize: bool| {
        let device = Device::watched_with(ContextOptions { specialize: Some(specialize), ..ContextOptions::default() });
        MODES.map(|mode| {
            let frames = body_frames(&in_mode(mode), |p| 0.5 + 0.4 * (0.3 * p.y).sin());
            rendered(&device, in_mode(mode), &frames).picture().expect("a picture").rgba
        })
    };
    let (here, by_driver) = (drawn(true), drawn(false));
    for (mode, (here, by_driver)) in MODES.iter().zip(here.iter().zip(&by_driver)) {
        assert!(here == by_driver, "{mode}");
        assert!(here.chunks(4).any(|pixel| pixel[..3] != here[..3]), "{mode}: one colour");
    }
}
