//! Every pass by the device's own time stamps, and frames on their way in by the wall's.
//!
//! `cargo bench --bench gpu` measures all, `cargo bench --bench gpu -- 'raycast|light'` those whose `pass/scene` matches; what
//! comes after `--` is criterion's: `--save-baseline before` and later `--baseline before` say what a change cost.
//! `cargo bench --bench gpu -- --test`, or `cargo test --bench gpu`, runs each once, small, with validation on: a message, a
//! pass that nothing times, or an input without content fails it. ECHOLUME_DEVICE picks the device by number or name.
//!
//! What is read: `time: [low mean high]` of one run of the pass with all its iterations, low and high enclosing the mean with
//! 95 % confidence; `--verbose` adds the median. It is the device's time between the stamps around each dispatch, so without
//! submission and waiting; `thrpt` is the invocations of its first iteration a second. Nothing is asserted about time. Inputs
//! are what the phantom's sweep leaves in each slot when the scene is rendered whole, so that rays hit, end early and miss as
//! they do in use; the frame at hand is the middle one.

#[path = "../common/mod.rs"]
mod common;
mod ingestion;
mod scenes;

use common::Run;
use criterion::{Criterion, SamplingMode, Throughput};
use echolume::low_level::gpu::pass_runner::PassTimer;
use echolume::low_level::gpu::{Context, ContextOptions, DeviceChoice, GpuError, Renderer, RendererOptions};
use echolume::low_level::passes::slots::Initializer;
use echolume::low_level::passes::{DispatchArgs, Pass, Slot, Texels, device_limits};
use echolume::low_level::scene::Scene;
use echolume::low_level::source::Frame;
use echolume::low_level::statistics::mix;
use scenes::{FULL, SCENES, SMALL, check_that_none_is_forgotten};
use std::cell::LazyCell;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

fn main() -> ExitCode {
    match all(Run::from_arguments()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(fault) => {
            eprintln!("gpu bench: {fault}");
            ExitCode::FAILURE
        }
    }
}

/// Criterion's closures return a time and nothing else, so a device that fails in one ends the run there.
fn or_end<T, E: std::fmt::Display>(what: &str, done: Result<T, E>) -> T {
    done.unwrap_or_else(|fault| {
        eprintln!("gpu bench: {what}: {fault}");
        std::process::exit(1)
    })
}

fn all(run: Run) -> Result<(), String> {
    let mut criterion = common::criterion();
    check_that_none_is_forgotten()?;
    let sizes = if run == Run::Bench { &FULL } else { &SMALL };
    let Ok(device) = std::env::var("ECHOLUME_DEVICE").map_or(Ok(DeviceChoice::Best), |name| name.parse());
    let options = ContextOptions { device, validation: run == Run::Test, ..ContextOptions::default() };
    let context = Context::new(&options).map_err(|e| e.to_string())?;
    // Inputs are made on a context of their own: synchronization validation does not see that the host waits for a timeline,
    // so memory that one has read back from and the other then takes anew would look like a hazard.
    let rendering = Context::new(&options).map_err(|e| e.to_string())?;
    let candidate = &context.candidate;
    if run != Run::List {
        println!("device: {} ({}), {}", candidate.name, candidate.kind_name(), candidate.driver.trim());
    }
    if run == Run::Bench && candidate.valid_bits() == 0 {
        return Err("the device has no time stamps, so nothing can be measured; ECHOLUME_DEVICE picks another".into());
    }
    let phantom = common::phantom(sizes.frames, sizes.lines, sizes.samples)?;
    let frames = LazyCell::new(|| phantom.volume(0));
    for stated in SCENES {
        let scene = stated.scene(&phantom, sizes)?;
        let passes = stated.passes(&scene)?;
        let mut rendered = None;
        for pass in passes {
            bench(&mut criterion, &context, &scene, pass, stated.name, || {
                let renderer = match rendered.take() {
                    Some(renderer) => renderer,
                    None => render(&rendering, &scene, &frames).map_err(|e| e.to_string())?,
                };
                contents(rendered.insert(renderer), pass)
            });
        }
    }
    let (edge, pixels) = (sizes.pixels as usize, sizes.picture);
    let scene = device_limits::scene(edge, pixels).map_err(|e| e.to_string())?;
    for pass in device_limits::MEASURES {
        bench(&mut criterion, &context, &scene, pass, "noise", || Ok(noise(&scene, pass)));
    }
    ingestion::bench(&mut criterion, &rendering, &phantom, run)?;
    criterion.final_summary();
    match context.messages().into_iter().chain(rendering.messages()).next() {
        Some(message) => Err(format!("validation: {message}")),
        None => Ok(()),
    }
}

/// One bench. `inputs` is asked only if the command line does not filter it out.
fn bench(
    criterion: &mut Criterion,
    context: &Arc<Context>,
    scene: &Scene,
    pass: &'static Pass,
    name: &str,
    mut inputs: impl FnMut() -> Result<Vec<(Slot, Texels)>, String>,
) {
    let args = DispatchArgs { slices: scene.slices(), ..DispatchArgs::default() };
    let invocations = pass.invocations(scene, &args).map(u64::from).iter().product();
    let mut timed = None;
    let mut group = criterion.benchmark_group(pass.name);
    // Every sample of as many runs: they do not depend on what came before.
    group.sampling_mode(SamplingMode::Flat).throughput(Throughput::Elements(invocations));
    group.bench_function(name, |bencher| {
        let timed = timed.get_or_insert_with(|| {
            let made =
                inputs().and_then(|inputs| PassTimer::new(context, scene, pass, &inputs).map_err(|e| e.to_string()));
            or_end(&format!("{}/{name}", pass.name), made)
        });
        bencher.iter_custom(|runs| {
            let one = |_| or_end(pass.name, timed.run()).unwrap_or(0.0);
            Duration::from_secs_f64((0..runs).map(one).sum::<f64>() * 1e-9)
        });
    });
    group.finish();
}

/// The scene rendered whole. Frames from the outside in: what passes of frames left is of the middle ones.
fn render(context: &Arc<Context>, scene: &Scene, frames: &[Frame]) -> Result<Renderer, GpuError> {
    let mut renderer = Renderer::new(context, scene.clone(), &RendererOptions::default())?;
    let mut order: Vec<&Frame> = frames.iter().collect();
    order.sort_by_key(|f| std::cmp::Reverse(f.slice.abs_diff(frames.len() / 2)));
    for frame in order {
        renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
    }
    renderer.show(0)?;
    renderer.picture()?;
    Ok(renderer)
}

/// What the images that a pass reads hold after its scene was rendered. Refuses one that is the same everywhere: a pass that
/// finds nothing ends early, and its time says nothing.
fn contents(renderer: &mut Renderer, pass: &Pass) -> Result<Vec<(Slot, Texels)>, String> {
    let scene = renderer.scene().clone();
    let turns = (0..(pass.repeat)(&scene)).map(|iteration| DispatchArgs { iteration, ..DispatchArgs::default() });
    let mut slots: Vec<Slot> = turns.flat_map(|t| pass.reads(&scene, &t)).map(|b| b.slot).collect();
    slots.sort();
    slots.dedup();
    let mut contents = Vec::new();
    for slot in slots.into_iter().filter(|s| !matches!(s.initializer(), Initializer::ByScene(_))) {
        let Some(texels) = renderer.read(slot).map_err(|e| e.to_string())? else { continue };
        let first = texels.get([0; 3]);
        if texels.values.chunks_exact(texels.channels).all(|t| t == first) {
            return Err(format!("slot '{}' holds {first:?} everywhere; the scene shows nothing", slot.name()));
        }
        contents.push((slot, texels));
    }
    Ok(contents)
}

/// Numbers in 0..1 that no device can compress away (SplitMix64).
fn noise(scene: &Scene, pass: &Pass) -> Vec<(Slot, Texels)> {
    let mut state = 0u64;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(state) >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut filled = |slot: Slot| {
        let mut texels = Texels::untouched(slot.array_size(scene), slot.format(scene).channels());
        texels.values.fill_with(&mut next);
        (slot, texels)
    };
    pass.reads(scene, &DispatchArgs::default()).iter().map(|b| filled(b.slot)).collect()
}
