//! Group "failures": if the device refuses an allocation or is lost, the error names the operation, nothing leaks, and pictures are correct
//! afterwards. Pictures and volumes beyond the limits are refused by name before anything is created, and at the limits they are rendered
//! correctly. Failures are simulated above the driver, on isolated contexts.

use super::built_in::{BYTES, FLOATS, frames, scene, wall, wobbler};
use super::compare::{count_figure, expect_same_picture};
use super::render::Drawn;
use super::{Check, DeviceUnderTest, Findings, IsolatedContext, render};
use crate::gpu::faults::{InjectedFailure, InjectionPoint};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::passes::Slot;
use crate::probe::{Geometry, Grid};
use crate::queues::MAX_QUEUES;
use crate::report::{Fault, Figure, Level, Unit, Worst};
use crate::scene::{MAX_PICTURE, Scene};
use std::sync::Arc;
use std::sync::atomic::Ordering;

pub fn checks(_: Level) -> Vec<Check> {
    let of =
        |name: &str, work: fn(&mut DeviceUnderTest) -> Result<Findings, GpuError>| Check::new("failures", name, work);
    vec![
        of("out of memory at every allocation", every_allocation),
        of("out of memory in a change of scene", a_change),
        of("submissions that fail", submissions),
        of("a lost device and a time-out", lost),
        of("frames that do not belong", unexpected_frames),
        of("pictures and volumes beyond the limits", beyond),
        of("volumes beyond the memory", beyond_memory),
        of("the largest pictures", largest),
    ]
}

const SMALL: &str = "mode = 'sr'\npicture = { size = [16, 16] }\nslices = { pixels = 20 }\ndistance = { median = 3 }";
const LARGER: &str = "mode = 'sr'\npicture = { size = [24, 20] }\nslices = { pixels = 26, median = true }\n\
                      distance = { median = 3, bilateral = { pixels = 1.0, distance = 1.0 } }";

/// A scene with passes of every stage, and its expected picture.
fn case(context: &Arc<Context>, toml: &str) -> Result<Drawn, GpuError> {
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)?;
    let frames = wall(&scene, 0);
    let picture = render::picture(context, &scene, &frames)?;
    Ok(Drawn { name: toml.into(), scene, frames, picture })
}

/// Adds a fault if the context has more device memory allocated than `before`, bytes. `after_what`: what was done since then.
pub fn expect_memory_returned(findings: &mut Findings, context: &Context, before: u64, after_what: &str) {
    let now = context.allocated();
    findings.expect(now <= before, || format!("{after_what}: {} bytes of device memory are still held", now - before));
}

/// Adds a fault unless an action failed with the right error. `is`: whether an error, also given as text, is right.
fn expect_error<T>(
    findings: &mut Findings,
    done: Result<T, GpuError>,
    what: &str,
    is: impl FnOnce(&GpuError, &str) -> bool,
) {
    match done.map_err(|error| (error.to_string(), error)) {
        Ok(_) => findings.expect(false, || format!("{what}: there was no error")),
        Err((text, error)) => findings.expect(is(&error, &text), || format!("{what}: the error says: {text}")),
    }
}

/// If any allocation fails while a renderer is created, the error names the resource, and nothing leaks.
fn every_allocation(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, isolated) = (Findings::default(), IsolatedContext::new(dut)?);
    let context = &isolated.context;
    let case = case(context, SMALL)?;
    let before = context.allocated();
    let mut refused = 0;
    for after in 0..1000 {
        context.faults.inject(InjectionPoint::Allocate, after, InjectedFailure::ERROR_OUT_OF_DEVICE_MEMORY);
        let made = Renderer::new(context, case.scene.clone(), &RendererOptions::default());
        context.faults.forget();
        if made.is_ok() {
            break;
        }
        let what = format!("allocation {after} was refused");
        expect_error(&mut findings, made, &what, |_, text| {
            text.starts_with("create ") && text.ends_with("out of device memory")
        });
        refused += 1;
        expect_memory_returned(&mut findings, context, before, &what);
    }
    findings.expect(refused > 10, || format!("only {refused} allocations could be refused"));
    let picture = render::picture(context, &case.scene, &case.frames)?;
    expect_same_picture(&mut findings, "the first picture after that", &case.picture, &picture);
    findings.figures.push(count_figure("allocations refused", refused));
    isolated.report_validation(&mut findings);
    Ok(findings)
}

/// If any allocation fails during a change of scene, the renderer reports it and renders nothing until the next change succeeds.
fn a_change(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, isolated) = (Findings::default(), IsolatedContext::new(dut)?);
    let context = &isolated.context;
    let (small, larger) = (case(context, SMALL)?, case(context, LARGER)?);
    let step = if dut.level == Level::Quick { 4 } else { 1 };
    let mut refused = 0;
    for after in (0..1000).step_by(step) {
        let mut renderer = render::sent(context, &small.scene, &small.frames, &RendererOptions::default())?;
        renderer.picture()?;
        context.faults.inject(InjectionPoint::Allocate, after, InjectedFailure::ERROR_OUT_OF_DEVICE_MEMORY);
        let changed = renderer.change(larger.scene.clone());
        context.faults.forget();
        let is_refused = changed.is_err();
        if is_refused {
            refused += 1;
            let what = |what: &str| format!("allocation {after} of a change was refused, and {what}");
            findings.expect(matches!(renderer.picture(), Err(GpuError::Broken(_))), || what("a picture was drawn"));
            let frame = vec![0; renderer.frame_bytes()];
            let sent = renderer.frame(0, &frame, 0);
            findings.expect(matches!(sent, Err(GpuError::Broken(_))), || what("a frame was taken"));
            renderer.change(larger.scene.clone())?;
        }
        render::send(&mut renderer, &larger.frames, 0)?;
        let what = format!("after a change whose allocation {after} was refused");
        expect_same_picture(&mut findings, &what, &larger.picture, &renderer.picture()?);
        if !is_refused {
            break;
        }
    }
    findings.expect(refused > 3, || format!("only {refused} allocations could be refused"));
    findings.figures.push(count_figure("allocations refused", refused));
    isolated.report_validation(&mut findings);
    Ok(findings)
}

/// After a failed submission the same work can be submitted again, and later work is still ordered after it. Each submission of a volume
/// and its picture fails once, for every number of queues.
fn submissions(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let mut all = 0;
    for queues in 1..=MAX_QUEUES {
        let isolated = IsolatedContext::of_queues(dut, queues)?;
        let case = case(&isolated.context, SMALL)?;
        let mut after = 0;
        while failed_once(&mut findings, &isolated.context, &case, queues, after)? {
            after += 1;
        }
        let least = case.frames.len() as u32 + 1;
        findings.expect(after >= least, || format!("{queues} queues: only {after} submissions could fail"));
        all += after;
        isolated.report_validation(&mut findings);
    }
    findings.figures.push(count_figure("submissions that failed", all as usize));
    Ok(findings)
}

/// Lets one submission (number `after`) fail and repeats the operation. Returns false if there was no such submission.
fn failed_once(
    findings: &mut Findings,
    context: &Arc<Context>,
    case: &Drawn,
    queues: usize,
    after: u32,
) -> Result<bool, GpuError> {
    let format = Slot::Frames.format(&case.scene);
    let options = RendererOptions { queues: Some(queues), ..RendererOptions::default() };
    let mut renderer = Renderer::new(context, case.scene.clone(), &options)?;
    context.faults.inject(InjectionPoint::Submit, after, InjectedFailure::ERROR_OUT_OF_HOST_MEMORY);
    let mut failed = 0;
    for (k, frame) in case.frames.iter().enumerate() {
        let bytes = frame.encode(format);
        if renderer.frame(k as u32, &bytes, 0).and_then(|()| renderer.submit_frames()).is_err() {
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
    expect_same_picture(findings, &what, &case.picture, &picture);
    findings.expect(failed <= 1, || format!("{queues} queues, submission {after} failed: {failed} errors"));
    Ok(failed > 0)
}

/// A device that is lost or does not finish: the error names the operation, and another context renders as before.
fn lost(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let isolated = IsolatedContext::new(dut)?;
    let context = &isolated.context;
    let case = case(context, SMALL)?;
    let before = context.allocated();
    for (what, seam, after, failure) in [
        ("a device lost at a submission", InjectionPoint::Submit, 0, InjectedFailure::ERROR_DEVICE_LOST),
        ("a device lost at a wait", InjectionPoint::Wait, 1, InjectedFailure::ERROR_DEVICE_LOST),
    ] {
        let mut renderer = render::sent(context, &case.scene, &case.frames, &RendererOptions::default())?;
        renderer.picture()?;
        renderer.show(0)?;
        context.faults.inject(seam, after, failure);
        let result = renderer.picture();
        context.faults.forget();
        expect_error(&mut findings, result, what, |error, text| {
            error.is_device_lost() && !error.is_given_up() && text.contains("picture")
        });
        drop(renderer);
        expect_memory_returned(&mut findings, context, before, what);
    }
    isolated.report_validation(&mut findings);
    // What is submitted from here on never reaches the device. Whatever waited for it without end would wait here for ever.
    let (hung, what) = (IsolatedContext::new(dut)?, "a device that does not finish");
    let mut renderer = render::sent(&hung.context, &case.scene, &case.frames, &RendererOptions::default())?;
    renderer.picture()?;
    renderer.show(0)?;
    hung.context.faults.hang(0);
    hung.context.faults.inject(InjectionPoint::Wait, 1, InjectedFailure::TIMEOUT);
    for turn in ["", ", again"] {
        let said = renderer.picture().map_or_else(|error| error.to_string(), |_| "nothing".into());
        let is_named = said.contains("did not finish within") && said.contains("picture");
        findings.expect(is_named, || format!("{what}{turn}: the error says: {said}"));
    }
    drop(renderer);
    findings.expect(hung.context.is_given_up(), || format!("{what}: its context was not given up"));
    hung.report_validation(&mut findings);
    let other = IsolatedContext::new(dut)?;
    let picture = render::picture(&other.context, &case.scene, &case.frames)?;
    expect_same_picture(&mut findings, "another context after that", &case.picture, &picture);
    other.report_validation(&mut findings);
    findings.figures.push(count_figure("failures", 3));
    findings
        .notes
        .push("failures are made in front of the driver: a device that really hangs cannot be made safely".into());
    Ok(findings)
}

/// Frames of a wrong size, slice or volume image are refused with a specific error; the picture is unchanged.
fn unexpected_frames(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let (mut findings, isolated) = (Findings::default(), IsolatedContext::new(dut)?);
    let context = &isolated.context;
    let case = case(context, SMALL)?;
    let mut renderer = render::sent(context, &case.scene, &case.frames, &RendererOptions::default())?;
    let (frame_bytes, slices) = (renderer.frame_bytes(), case.scene.slices());
    let frame = vec![255; frame_bytes];
    let line = frame_bytes / case.scene.frame_size()[1] as usize;
    let size = |e: &GpuError| matches!(e, GpuError::FrameSize { .. });
    let slice = |e: &GpuError| matches!(e, GpuError::FrameSlice { .. });
    let image = |e: &GpuError| matches!(e, GpuError::VolumeImage { .. });
    type Named = (&'static str, Result<(), GpuError>, fn(&GpuError) -> bool);
    let tried: Vec<Named> = vec![
        ("7 bytes", renderer.frame(0, &frame[..7], 0), size),
        ("nothing", renderer.frame(0, &[], 0), size),
        ("a byte too many", renderer.frame(0, &[frame.clone(), vec![0]].concat(), 0), size),
        ("a slice that is not there", renderer.frame(slices, &frame, 0), slice),
        ("the last of all numbers", renderer.frame(u32::MAX, &frame, 0), slice),
        ("a volume image that is not there", renderer.frame(0, &frame, 1), image),
        ("showing an image that is not there", renderer.show(3), image),
        ("a line too few", renderer.frame(0, &frame[line..], 0), size),
    ];
    findings.figures.push(count_figure("refused", tried.len()));
    for (what, done, is) in tried {
        expect_error(&mut findings, done, what, |error, _| is(error));
    }
    expect_same_picture(&mut findings, "the picture after that", &case.picture, &renderer.picture()?);
    drop(renderer);
    isolated.report_validation(&mut findings);
    Ok(findings)
}

fn block(size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [0.5; 3], origin: [0.0; 3] })
}

fn cartesian_scene(size: [usize; 3], toml: &str) -> Result<Scene, GpuError> {
    scene(block(size), BYTES, toml).map_err(GpuError::Broken)
}

/// Adds a fault unless the scene is refused by an error that contains `names`, without any allocation.
fn refused(findings: &mut Findings, context: &Arc<Context>, what: &str, scene: Scene, names: [&str; 2]) {
    let before = context.counts.allocations.load(Ordering::Relaxed);
    let made = Renderer::new(context, scene, &RendererOptions::default());
    expect_error(findings, made, &format!("{what}: expected {names:?}"), |_, text| {
        names.iter().all(|name| text.contains(name)) && text.lines().count() == 1
    });
    let made = context.counts.allocations.load(Ordering::Relaxed) - before;
    findings.expect(made == 0, || format!("{what}: {made} allocations were made before it was refused"));
}

fn beyond(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let context = &dut.context;
    let three = context.candidate.limits.max_image_dimension3_d as usize;
    let small = "mode = 'vr'\npicture = { size = [4, 4] }";
    for axis in 0..3 {
        let mut size = [2; 3];
        size[axis] = three + 1;
        let what = format!("a volume of {size:?}");
        refused(&mut findings, context, &what, cartesian_scene(size, small)?, ["volume", &three.to_string()]);
    }
    // Every edge is within the limits, but the volume exceeds the maximum allocation.
    let floats = format!("{small}\nslices = {{ format = 'r32f' }}");
    let bytes = context.candidate.max_allocation;
    if 4 * (three as u64).pow(3) > bytes {
        let scene = cartesian_scene([three; 3], &floats)?;
        refused(&mut findings, context, "a volume larger than an allocation", scene, ["image", &bytes.to_string()]);
    }
    let picture = scene(block([2; 3]), BYTES, &format!("mode = 'vr'\npicture = {{ size = [{}, 4] }}", MAX_PICTURE + 1));
    let said = picture.map_or_else(|said| said, |_| "nothing".into());
    findings.expect(said.contains("picture.size") && said.contains(&MAX_PICTURE.to_string()), || {
        format!("a picture of {} pixels: expected picture.size and its limit, the error says: {said}", MAX_PICTURE + 1)
    });
    // A context with lower limits.
    let lesser = IsolatedContext::lacking(dut, |context| {
        context.candidate.limits.max_image_dimension2_d = 64;
        context.candidate.max_allocation = 1 << 20;
    })?;
    let wide = cartesian_scene([4; 3], "mode = 'vr'\npicture = { size = [65, 8] }")?;
    refused(&mut findings, &lesser.context, "a picture wider than a device's images", wide, ["image", "64"]);
    let deep = cartesian_scene([128, 128, 65], "mode = 'vr'\npicture = { size = [8, 8] }\nslices = { format = 'r8' }")?;
    refused(&mut findings, &lesser.context, "a volume of more than a device's bytes", deep, ["image", "1048576"]);
    lesser.report_validation(&mut findings);
    findings.notes.push(format!(
        "images to {0} x {0} and {three} x {three} x {three} texels, allocations to {1} MiB",
        context.candidate.limits.max_image_dimension2_d,
        bytes >> 20
    ));
    Ok(findings)
}

/// More volume images than fit into device memory.
fn beyond_memory(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    if dut.context.candidate.has_unified_memory() {
        return Ok(Findings::left_out(
            "a device in the machine's memory is handed out more than there is, and killed for it",
        ));
    }
    let (mut findings, isolated) = (Findings::default(), IsolatedContext::new(dut)?);
    let context = &isolated.context;
    let edge = (context.candidate.limits.max_image_dimension3_d as usize).min(1024);
    let toml = "mode = 'mip'\npicture = { size = [4, 4] }\nslices = { format = 'r8' }\nray = { sampling = 'exact' }";
    let scene = cartesian_scene([edge; 3], toml)?;
    let images = context.memory() / (edge as u64).pow(3) + 2;
    let before = context.allocated();
    let options = RendererOptions { volume_images: images as u32, ..RendererOptions::default() };
    let (what, made) = (format!("{images} volumes of {edge}^3 bytes"), Renderer::new(context, scene, &options));
    expect_error(&mut findings, made, &what, |_, text| text.contains("image 'volume'"));
    expect_memory_returned(&mut findings, context, before, "more volumes than the memory holds");
    let small = cartesian_scene([16; 3], "mode = 'mip'\npicture = { size = [8, 8] }")?;
    let picture = render::picture(context, &small, &frames(&small, |_| 0.5))?;
    findings
        .expect(picture.rgba[4 * 36].abs_diff(128) <= 1, || "the first picture after that is not what was sent".into());
    findings.figures.push(count_figure("volume images asked for", images as usize));
    isolated.report_validation(&mut findings);
    Ok(findings)
}

/// A triangle wave of 32 voxels along a needle: 2 pixels per level in the largest picture.
fn wave(at: f64) -> f64 {
    let phase = (at / 32.0).rem_euclid(1.0);
    1.0 - (2.0 * phase - 1.0).abs()
}

fn largest(dut: &mut DeviceUnderTest) -> Result<Findings, GpuError> {
    let mut findings = Findings::default();
    let limit = dut.context.candidate.limits.max_image_dimension2_d.min(MAX_PICTURE);
    let other = if dut.level == Level::Quick { 16 } else { limit / 8 };
    let mut largest = 0.0f64;
    let mut pixels = 0;
    for (size, axis) in [([limit, other], 0), ([other, limit], 1)] {
        let (mut voxels, mut spacing) = ([4, 4, 3], [1.0; 3]);
        (voxels[axis], spacing[axis]) = (512, 8.0);
        let grid = Geometry::Cartesian(Grid { size: voxels, spacing, origin: [0.0; 3] });
        let toml = format!(
            "mode = 'plane'\npicture = {{ size = {size:?} }}\nplanes = {{ plane = 'a', lines = false }}\n\
             slices = {{ format = 'r32f' }}\nray = {{ sampling = 'exact' }}"
        );
        let scene = scene(grid, FLOATS, &toml).map_err(GpuError::Broken)?;
        let picture = render::picture(&dut.context, &scene, &frames(&scene, |at| wave(at[axis] as f64)))?;
        let tiling = scene.tiling();
        let [tile] = &tiling.tiles[..] else { return Err(GpuError::Broken("a plane has one tile".into())) };
        let from_middle = |at: u32, axis: usize| (f64::from(at) + 0.5 - f64::from(size[axis]) / 2.0) * tiling.pixel;
        for spot in 0..257 {
            // Points along the needle, from end to end.
            let mut at = size.map(|n| n / 2);
            at[axis] = (u64::from(size[axis] - 1) * spot / 256) as u32;
            let p = tile.plane.at + tile.plane.right * from_middle(at[0], 0) + tile.plane.down * from_middle(at[1], 1);
            let along = p[axis] / 8.0;
            // Outside the centres of the outer voxels the border is mixed in.
            if !(0.5..510.5).contains(&along) {
                continue;
            }
            let (low, share) = (along.floor(), along.fract());
            let expected = 255.0 * (wave(low) * (1.0 - share) + wave(low + 1.0) * share);
            let index = 4 * (at[1] as usize * size[0] as usize + at[0] as usize);
            let got = f64::from(picture.rgba.get(index).copied().unwrap_or(0));
            let error = (got - expected).abs();
            (largest, pixels) = (largest.max(error), pixels + 1);
            if error > 1.0 && findings.faults.len() < 4 {
                let at = [at[0] as usize, at[1] as usize, 0];
                let worst = Worst { output: "screen".into(), at, channel: 0, expected, got, beyond: 1, texels: 257 };
                let what = format!("a picture of {} x {} shows something else", size[0], size[1]);
                findings.faults.push(Fault { worst: Some(worst), ..Fault::new(what) });
            }
        }
    }
    findings.expect(pixels > 400, || format!("only {pixels} spots lie in the pictures"));
    findings.figures.push(Figure::error("largest error", largest, 1.0, Unit::Levels));
    findings.figures.push(count_figure("spots", pixels));
    findings.notes.push(format!("pictures of {limit} x {other} pixels and the other way round"));
    Ok(findings)
}
