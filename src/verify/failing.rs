//! What happens when the device refuses or is lost: an error that says what was being done, nothing left behind, and pictures that are
//! right afterwards. Failures are made in front of the driver, on contexts of their own.

use super::built_in::{BYTES, scene, wall, wobbler};
use super::isolated_context::IsolatedContext;
use super::repeats::same;
use super::{Bench, Check, Found, drawn};
use crate::gpu::faults::{InjectedFailure, InjectionPoint};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::{Slot, Texels};
use crate::picture::Picture;
use crate::probe::Geometry;
use crate::queues::MAX_QUEUES;
use crate::scene::Scene;
use crate::verify::report::{Figure, Level, Unit};
use std::sync::Arc;

pub fn checks(_: Level) -> Vec<Check> {
    let of = |name: &str, work: fn(&mut Bench) -> Result<Found, GpuError>| Check::new("failures", name, work);
    vec![
        of("out of memory at every allocation", every_allocation),
        of("out of memory in a change of scene", a_change),
        of("submissions that fail", submissions),
        of("a lost device and a time-out", lost),
        of("frames that do not belong", frames),
    ]
}

/// A scene of every stage, its frames, and what it looks like.
struct Sound {
    scene: Scene,
    frames: Vec<Texels>,
    picture: Picture,
}

const SMALL: &str = "mode = 'sr'\npicture = { size = [16, 16] }\nslices = { pixels = 20 }\ndistance = { median = 3 }";
const LARGER: &str = "mode = 'sr'\npicture = { size = [24, 20] }\nslices = { pixels = 26, median = true }\n\
                      distance = { median = 3, bilateral = { pixels = 1.0, distance = 1.0 } }";

fn sound(context: &Arc<Context>, toml: &str) -> Result<Sound, GpuError> {
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)?;
    let frames = wall(&scene, 0);
    let picture = drawn::picture(context, &scene, &frames)?;
    Ok(Sound { scene, frames, picture })
}

/// A number that is only told.
pub(super) fn count(what: &str, value: usize) -> Figure {
    Figure { allowed: None, ..Figure::error(what, value as f64, 0.0, Unit::Count) }
}

/// A fault where device memory is held that was not held before.
pub fn returned(found: &mut Found, context: &Context, before: u64, after_what: &str) {
    let now = context.allocated();
    found.expect(now <= before, || format!("{after_what}: {} bytes of device memory are still held", now - before));
}

/// Wherever memory runs out while a renderer is made, the error names what was to be made, and nothing is left behind.
fn every_allocation(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, aside) = (Found::default(), IsolatedContext::new(bench)?);
    let context = &aside.context;
    let sound = sound(context, SMALL)?;
    let before = context.allocated();
    let mut refused = 0;
    for after in 0..1000 {
        context.faults.inject(InjectionPoint::Allocate, after, InjectedFailure::OutOfDeviceMemory.result());
        let made = Renderer::new(context, sound.scene.clone(), &RendererOptions::default());
        context.faults.forget();
        match made {
            Ok(_) => break,
            Err(error) => {
                let text = error.to_string();
                found.expect(text.starts_with("create ") && text.ends_with("out of device memory"), || {
                    format!("allocation {after} was refused, and the error says: {text}")
                });
                refused += 1;
            }
        }
        returned(&mut found, context, before, &format!("allocation {after} was refused"));
    }
    found.expect(refused > 10, || format!("only {refused} allocations could be refused"));
    let picture = drawn::picture(context, &sound.scene, &sound.frames)?;
    same(&mut found, "the first picture after that", &sound.picture, &picture);
    found.figures.push(count("allocations refused", refused));
    aside.tell(&mut found);
    Ok(found)
}

/// Wherever memory runs out while a scene changes, the renderer says so, draws nothing wrong, and the next change heals it.
fn a_change(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, aside) = (Found::default(), IsolatedContext::new(bench)?);
    let context = &aside.context;
    let (small, larger) = (sound(context, SMALL)?, sound(context, LARGER)?);
    let step = if bench.level == Level::Quick { 4 } else { 1 };
    let mut refused = 0;
    for after in (0..1000).step_by(step) {
        let mut renderer = drawn::sent(context, &small.scene, &small.frames, &RendererOptions::default())?;
        renderer.picture()?;
        context.faults.inject(InjectionPoint::Allocate, after, InjectedFailure::OutOfDeviceMemory.result());
        let changed = renderer.change(larger.scene.clone());
        context.faults.forget();
        let is_refused = changed.is_err();
        if is_refused {
            refused += 1;
            let what = |what: &str| format!("allocation {after} of a change was refused, and {what}");
            found.expect(matches!(renderer.picture(), Err(GpuError::Broken(_))), || what("a picture was drawn"));
            let frame = vec![0; renderer.frame_bytes()];
            let sent = renderer.frame(0, &frame, 0);
            found.expect(matches!(sent, Err(GpuError::Broken(_))), || what("a frame was taken"));
            renderer.change(larger.scene.clone())?;
        }
        drawn::send(&mut renderer, &larger.frames, 0)?;
        let what = format!("after a change whose allocation {after} was refused");
        same(&mut found, &what, &larger.picture, &renderer.picture()?);
        if !is_refused {
            break;
        }
    }
    found.expect(refused > 3, || format!("only {refused} allocations could be refused"));
    found.figures.push(count("allocations refused", refused));
    aside.tell(&mut found);
    Ok(found)
}

/// After a submission that failed the same work can be sent again: its successors are ordered still. Each of a volume and its picture
/// fails once, however many there are with so many queues.
fn submissions(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let mut all = 0;
    for queues in 1..=MAX_QUEUES {
        let aside = IsolatedContext::of_queues(bench, queues)?;
        let sound = sound(&aside.context, SMALL)?;
        let mut after = 0;
        while failed_once(&mut found, &aside.context, &sound, queues, after)? {
            after += 1;
        }
        let least = sound.frames.len() as u32 + 1;
        found.expect(after >= least, || format!("{queues} queues: only {after} submissions could fail"));
        all += after;
        aside.tell(&mut found);
    }
    found.figures.push(count("submissions that failed", all as usize));
    Ok(found)
}

/// One submission fails, the `after`th, and what sent it is done once more. Whether there was such a submission.
fn failed_once(
    found: &mut Found,
    context: &Arc<Context>,
    sound: &Sound,
    queues: usize,
    after: u32,
) -> Result<bool, GpuError> {
    let format = Slot::Frames.format(&sound.scene);
    let options = RendererOptions { queues: Some(queues), ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, sound.scene.clone(), &options)?;
    context.faults.inject(InjectionPoint::Submit, after, InjectedFailure::OutOfHostMemory.result());
    let mut failed = 0;
    for (k, frame) in sound.frames.iter().enumerate() {
        let bytes = frame.encode(format);
        if renderer.frame(k as u32, &bytes, 0).is_err() {
            failed += 1;
            renderer.frame(k as u32, &bytes, 0)?;
        }
    }
    renderer.show(0)?;
    let picture = renderer.picture().or_else(|_| {
        failed += 1;
        renderer.picture()
    })?;
    context.faults.forget();
    let what = format!("{queues} queues, submission {after} failed and was sent again");
    same(found, &what, &sound.picture, &picture);
    found.expect(failed <= 1, || format!("{queues} queues, submission {after} failed: {failed} errors"));
    Ok(failed > 0)
}

/// A device that is lost or does not come back says what it was doing; another context on it draws as before.
fn lost(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let aside = IsolatedContext::new(bench)?;
    let context = &aside.context;
    let sound = sound(context, SMALL)?;
    let before = context.allocated();
    for (what, seam, after, failure) in [
        ("a device lost at a submission", InjectionPoint::Submit, 0, InjectedFailure::DeviceLost),
        ("a device lost at a wait", InjectionPoint::Wait, 1, InjectedFailure::DeviceLost),
        ("a device that does not come back", InjectionPoint::Wait, 1, InjectedFailure::TimeOut),
    ] {
        let mut renderer = drawn::sent(context, &sound.scene, &sound.frames, &RendererOptions::default())?;
        renderer.picture()?;
        renderer.show(0)?;
        context.faults.inject(seam, after, failure.result());
        let told = renderer.picture();
        context.faults.forget();
        match told {
            Ok(_) => found.expect(false, || format!("{what}: a picture was drawn")),
            Err(error) => {
                let text = error.to_string();
                let as_it_is = match failure {
                    InjectedFailure::TimeOut => matches!(error, GpuError::TimedOut { .. }),
                    _ => error.is_device_lost(),
                };
                found.expect(as_it_is && text.contains("picture"), || format!("{what}: the error says: {text}"));
            }
        }
        drop(renderer);
        returned(&mut found, context, before, what);
    }
    aside.tell(&mut found);
    let other = IsolatedContext::new(bench)?;
    let picture = drawn::picture(&other.context, &sound.scene, &sound.frames)?;
    same(&mut found, "another context after that", &sound.picture, &picture);
    other.tell(&mut found);
    found.figures.push(count("failures", 3));
    found
        .notes
        .push("failures are made in front of the driver: a device that really hangs cannot be made safely".into());
    Ok(found)
}

/// Frames of another size, slice or volume image, and lines that do not follow, are refused by name; what is drawn stays as it is.
fn frames(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, aside) = (Found::default(), IsolatedContext::new(bench)?);
    let context = &aside.context;
    let sound = sound(context, SMALL)?;
    let mut renderer = drawn::sent(context, &sound.scene, &sound.frames, &RendererOptions::default())?;
    let (whole, slices) = (renderer.frame_bytes(), sound.scene.slices());
    let frame = vec![255; whole];
    let line = whole / sound.scene.frame_size()[1] as usize;
    let size = |e: &GpuError| matches!(e, GpuError::FrameSize { .. });
    let slice = |e: &GpuError| matches!(e, GpuError::FrameSlice { .. });
    let image = |e: &GpuError| matches!(e, GpuError::VolumeImage { .. });
    let lines = |e: &GpuError| matches!(e, GpuError::FrameLines { .. });
    type Named = (&'static str, Result<(), GpuError>, fn(&GpuError) -> bool);
    let tried: Vec<Named> = vec![
        ("7 bytes", renderer.frame(0, &frame[..7], 0), size),
        ("nothing", renderer.frame(0, &[], 0), size),
        ("a byte too many", renderer.frame(0, &[frame.clone(), vec![0]].concat(), 0), size),
        ("a slice that is not there", renderer.frame(slices, &frame, 0), slice),
        ("the last of all numbers", renderer.frame(u32::MAX, &frame, 0), slice),
        ("a volume image that is not there", renderer.frame(0, &frame, 1), image),
        ("showing an image that is not there", renderer.show(3), image),
        ("half a line", renderer.lines(0, 0, &frame[..line / 2], 0).map(|_| ()), lines),
        ("lines that follow nothing", renderer.lines(0, 5, &frame[..line], 0).map(|_| ()), lines),
        ("lines beyond the frame", renderer.lines(0, 0, &[&frame[..], &frame[..line]].concat(), 0).map(|_| ()), lines),
    ];
    found.figures.push(count("refused", tried.len()));
    for (what, done, is) in tried {
        match done {
            Ok(()) => found.expect(false, || format!("{what} was taken")),
            Err(error) => found.expect(is(&error), || format!("{what}: the error says: {error}")),
        }
    }
    same(&mut found, "the picture after that", &sound.picture, &renderer.picture()?);
    drop(renderer);
    aside.tell(&mut found);
    Ok(found)
}
