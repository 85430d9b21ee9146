//! How the pipelines of a scene are made: at the same time, and each once.

use crate::common::gpu::*;
use echolume::gpu::{GpuError, Renderer, RendererOptions, Shaders};
use echolume::plan::Plan;
use echolume::spirv;
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
    let scene = scene(echolume::probe::Geometry::Sweep(wobbler()), BYTES, SETTINGS);
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
            format!("{} {:?} {formats:?}", step.pass.shader(scene, &args), (step.pass.constants)(scene, &args))
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
    let of = |settings: &str| scene(echolume::probe::Geometry::Sweep(wobbler()), BYTES, settings);
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
    let scene = scene(echolume::probe::Geometry::Sweep(wobbler()), BYTES, SETTINGS);
    let plan = Plan::new(&scene);
    let first = plan.steps[0].pass.shader(&scene, &plan.steps[0].args());
    for _ in 0..4 {
        let shaders: Arc<Shaders> = Arc::new(|name| Err(format!("{name} is missing")));
        let error = Renderer::new(&device, scene.clone(), &options(shaders)).err().expect("no shader");
        assert!(matches!(&error, GpuError::Shader { shader, .. } if shader == first), "{error}");
    }
}
