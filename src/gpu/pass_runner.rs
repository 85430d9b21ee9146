//! Runs a single pass on given inputs: tests compare it with its CPU reference, benchmarks time it.

use super::bands::BandLimit;
use super::buffers::{Readback, SlotParts, Upload};
use super::command_recorder::{CommandRecorder, Dispatch};
use super::context::Context;
use super::device_queues::DeviceQueues;
use super::error::GpuError;
use super::formats::{self, TexelAccess};
use super::pipelines::{Pipeline, Pipelines, Prepared, embedded};
use super::resources::SlotResources;
use super::timing::TimeStamps;
use crate::passes::slots::{Initializer, encoded};
use crate::passes::{Arrays, Bind, DispatchArgs, Frequency, Part, Pass, Slot, Texels};
use crate::plan::Plan;
use crate::scene::{DeviceFacts, Scene};
use std::sync::Arc;

/// Runs single passes on inputs that the caller gives, for tests and verification.
pub struct PassRunner {
    context: Arc<Context>,
    pipelines: Arc<Pipelines>,
    texel_access: TexelAccess,
}

impl PassRunner {
    /// Makes a runner with the device's faster way to read texels ([`TexelAccess::for_device`]).
    ///
    /// # Errors
    /// The device fails.
    pub fn new(context: &Arc<Context>) -> Result<PassRunner, GpuError> {
        PassRunner::with_texel_access(context, TexelAccess::for_device(&context.candidate))
    }

    /// Makes a runner whose shaders read single texels by `texel_access`.
    ///
    /// # Errors
    /// The device fails.
    pub fn with_texel_access(context: &Arc<Context>, texel_access: TexelAccess) -> Result<PassRunner, GpuError> {
        Ok(PassRunner {
            context: context.clone(),
            pipelines: Pipelines::shared(context, embedded(), texel_access)?,
            texel_access,
        })
    }

    /// Number of fractional bits of the weights in the device's linear texture filter.
    pub fn filter_bits(&self) -> u32 {
        self.context.candidate.limits.sub_texel_precision_bits
    }

    /// The scene as [`PassRunner::run`] runs it: fields that depend on the device are set, except shared memory and frames at once, which decide the
    /// number of dispatches and which callers choose.
    pub fn adapted(&self, scene: &Scene) -> Scene {
        let adapted = formats::adapt_scene(&self.context, self.texel_access, scene.clone());
        let DeviceFacts { shared_memory, frames_at_once, .. } = scene.device;
        Scene { device: DeviceFacts { shared_memory, frames_at_once, ..adapted.device }, ..adapted }
    }

    /// The SPIR-V and the reflected declarations of a pass in an adapted scene, as the driver gets them.
    ///
    /// # Errors
    /// The shader does not exist, or disagrees with the declaration of the pass.
    pub fn shader(&self, scene: &Scene, pass: &Pass, args: &DispatchArgs) -> Result<Prepared, GpuError> {
        self.pipelines.prepare(&self.pipelines.key(pass, scene, args), pass, scene, args)
    }

    /// Dispatches `pass` once and returns its outputs. `inputs` have the names of the shader's bindings; tables that the CPU computes from the scene
    /// may be missing. Every texel of the outputs holds `poison` before the dispatch, so that texels that the pass does not write can be recognised.
    ///
    /// # Errors
    /// The device cannot hold a slot, a shader does not compile, or the device fails.
    pub fn run(
        &mut self,
        scene: &Scene,
        pass: &'static Pass,
        args: &DispatchArgs,
        inputs: &Arrays,
        poison: f64,
    ) -> Result<Arrays, GpuError> {
        self.run_within(scene, pass, args, inputs, poison, u64::MAX)
    }

    /// Does what [`PassRunner::run`] does, which explains the other arguments, in bands of about `most` invocations
    /// ([`Bands::Fixed`](super::Bands::Fixed)). An indirect dispatch is not divided.
    ///
    /// # Errors
    /// The device cannot hold a slot, a shader does not compile, or the device fails.
    pub fn run_within(
        &mut self,
        scene: &Scene,
        pass: &'static Pass,
        args: &DispatchArgs,
        inputs: &Arrays,
        poison: f64,
        most: u64,
    ) -> Result<Arrays, GpuError> {
        let scene = &self.adapted(scene);
        let (reads, writes) = (pass.reads(scene, args), pass.writes(scene, args));
        let plan = Plan { steps: Vec::new(), slots: reads.iter().chain(&writes).map(|b| b.slot).collect() };
        let mut slots = SlotResources::new(&self.context, args.image + 1);
        let mut queues = DeviceQueues::new(&self.context, 1, false)?;
        let mut recorder = CommandRecorder::new(&self.context, 0, pass.name, TimeStamps::None, false)?;
        let pipeline = self.pipelines.get(pass, scene, args)?;
        let new = slots.fit(&plan, scene)?;

        let mut staged = Vec::new();
        for bind in &reads {
            let given = inputs.iter().find(|(name, _)| *name == bind.name).map(|(_, texels)| texels);
            let Some(bytes) = content(scene, bind.slot, given) else { continue };
            let bytes = self.context.faults.given(bind.slot, scene, bytes);
            match slots.buffer_mut(bind.slot) {
                Some(buffer) => buffer.write(0, &bytes),
                None => staged.push((*bind, bytes)),
            }
        }
        for bind in &writes {
            let format = bind.slot.format(scene);
            let poisoned = Texels::from_fn(bind.slot.shape(scene).size(), format.channels(), |_, _| poison);
            staged.push((Bind { part: Part::Whole, ..*bind }, poisoned.encode(format)));
        }

        recorder.begin(&mut queues)?;
        recorder.clear_new(&mut queues, &slots, &new);
        let mut keep = Vec::new();
        for (bind, bytes) in staged {
            let Some(image) = slots.image(bind.slot, args.image) else { continue };
            let all = image.all_parts((bind.slot, args.image));
            let to = match bind.part {
                Part::Layers => SlotParts { parts: args.layer..args.layer + args.slices, ..all },
                _ => all,
            };
            let upload = Upload::new(&self.context, "input", image.layout(), to, &bytes)?;
            recorder.upload(&mut queues, &upload, image);
            keep.push(upload);
        }
        let dispatch = Dispatch { slots: &slots, pipeline: &pipeline, scene, pass, args };
        recorder.dispatch(&mut queues, &dispatch, Some(&BandLimit::Invocations(most)))?;
        let mut results = Vec::new();
        for bind in &writes {
            let Some(image) = slots.image(bind.slot, args.image) else { continue };
            let buffer = Readback::new(&self.context, "output", image.layout())?;
            recorder.copy_out(&mut queues, image, (bind.slot, args.image), &buffer);
            results.push((bind, buffer));
        }
        finish(&mut recorder, &mut queues)?;
        let mut outputs = Arrays::default();
        for (bind, buffer) in results {
            let outside = Texels::stored(buffer.image.1, poison);
            outputs.insert(bind.name, buffer.texels()?.with_outside(bind.slot, scene, outside));
        }
        Ok(outputs)
    }
}

/// Submits what was recorded and waits. What the caller frees afterwards is not in use any more, also when waiting failed.
fn finish(recorder: &mut CommandRecorder, queues: &mut DeviceQueues) -> Result<(), GpuError> {
    recorder.submit(queues)?;
    let done = queues.timelines.wait_all();
    queues.timelines.drain();
    done
}

/// Measures the GPU time of a single pass of a scene, with slots of its own.
pub struct PassTimer {
    // Fields are dropped in this order, after `drop` has waited for the device.
    recorder: CommandRecorder,
    /// Every iteration of the pass.
    dispatches: Vec<(DispatchArgs, Arc<Pipeline>)>,
    _pipelines: Arc<Pipelines>,
    slots: SlotResources,
    queues: DeviceQueues,
    context: Arc<Context>,
    scene: Scene,
    pass: &'static Pass,
}

impl PassTimer {
    /// Allocates the slots and runs the pass once, because drivers compile at the first run. `contents`: texels of image slots before that run; for
    /// the volume they are those of all slices, of which the device may store only a part. Tables that the CPU computes from the scene are filled;
    /// all other slots hold zeros. A pass over frames works on layer 0 and the middle slice, a pass over volumes on all visible slices.
    ///
    /// # Errors
    /// The device cannot hold a slot or a shader does not compile, which the error names, or the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        pass: &'static Pass,
        contents: &[(Slot, Texels)],
    ) -> Result<PassTimer, GpuError> {
        let texel_access = TexelAccess::for_device(&context.candidate);
        let scene = &formats::adapt_scene(context, texel_access, scene.clone());
        let visible = scene.visible_bounds.slices();
        let first = match pass.frequency {
            Frequency::Frame => DispatchArgs { slice: (visible.start + visible.end) / 2, ..DispatchArgs::default() },
            _ => DispatchArgs { slice: visible.start, slices: visible.end - visible.start, ..DispatchArgs::default() },
        };
        let mut plan = Plan { steps: Vec::new(), slots: Vec::new() };
        let pipelines = Pipelines::shared(context, embedded(), texel_access)?;
        let mut dispatches = Vec::new();
        for iteration in 0..(pass.repeat)(scene) {
            let args = DispatchArgs { iteration, ..first };
            let binds = [pass.reads(scene, &args), pass.writes(scene, &args)].concat();
            plan.slots.extend(binds.iter().map(|b| b.slot));
            dispatches.push((args, pipelines.get(pass, scene, &args)?));
        }
        plan.slots.sort();
        plan.slots.dedup();
        let mut timed = PassTimer {
            recorder: CommandRecorder::new(context, 0, pass.name, TimeStamps::EachPass, false)?,
            dispatches,
            _pipelines: pipelines,
            slots: SlotResources::new(context, 1),
            queues: DeviceQueues::new(context, 1, false)?,
            context: context.clone(),
            scene: scene.clone(),
            pass,
        };
        timed.fill(&plan, contents)?;
        timed.run()?;
        Ok(timed)
    }

    fn fill(&mut self, plan: &Plan, contents: &[(Slot, Texels)]) -> Result<(), GpuError> {
        let new = self.slots.fit(plan, &self.scene)?;
        self.recorder.begin(&mut self.queues)?;
        self.recorder.clear_new(&mut self.queues, &self.slots, &new);
        let mut keep = Vec::new();
        for &(slot, copy) in &new {
            let given = contents.iter().find(|(s, _)| *s == slot).map(|(_, texels)| texels);
            let Some(bytes) = content(&self.scene, slot, given) else { continue };
            let Some(image) = self.slots.image(slot, copy) else { continue };
            let to = image.all_parts((slot, copy));
            let upload = Upload::new(&self.context, "contents", image.layout(), to, &bytes)?;
            self.recorder.upload(&mut self.queues, &upload, image);
            keep.push(upload);
        }
        finish(&mut self.recorder, &mut self.queues)
    }

    /// Runs the pass, with as many dispatches in a row as it has in a picture, in one submission, and waits. Returns the device's time for all of
    /// them, ns, or `None` if the device has no time stamps. The slots hold what the previous run left in them.
    ///
    /// # Errors
    /// The device fails.
    pub fn run(&mut self) -> Result<Option<f64>, GpuError> {
        self.recorder.begin(&mut self.queues)?;
        for (args, pipeline) in &self.dispatches {
            let dispatch = Dispatch { slots: &self.slots, pipeline, scene: &self.scene, pass: self.pass, args };
            self.recorder.dispatch(&mut self.queues, &dispatch, None)?;
        }
        self.recorder.submit(&mut self.queues)?;
        self.recorder.collect(&mut self.queues)?;
        Ok(self.queues.timings.take_times().iter().find(|t| t.name == self.pass.name).map(|t| t.total))
    }

    /// The current content of an image slot; `None` for a slot that the pass does not use, or a lookup table in a buffer.
    ///
    /// # Errors
    /// The device fails.
    pub fn read(&mut self, slot: Slot) -> Result<Option<Texels>, GpuError> {
        let Some(image) = self.slots.image(slot, 0) else { return Ok(None) };
        let buffer = Readback::new(&self.context, "read", image.layout())?;
        self.recorder.begin(&mut self.queues)?;
        self.recorder.copy_out(&mut self.queues, image, (slot, 0), &buffer);
        finish(&mut self.recorder, &mut self.queues)?;
        Ok(Some(buffer.texels()?.with_outside(slot, &self.scene, 0.0)))
    }
}

impl Drop for PassTimer {
    fn drop(&mut self) {
        self.queues.timelines.drain();
    }
}

/// Times of `count` consecutive runs of a pass, ns, each with as many dispatches in a row as in a picture. Empty if the device has no time stamps.
/// Slots begin as with [`PassTimer::new`] without `contents`. An additional first run, in which drivers compile, is not counted.
///
/// # Errors
/// The device cannot hold a slot, a shader does not compile, or the device fails.
pub fn time_pass(context: &Arc<Context>, scene: &Scene, pass: &'static Pass, count: u32) -> Result<Vec<f64>, GpuError> {
    let mut timed = PassTimer::new(context, scene, pass, &[])?;
    (0..count).filter_map(|_| timed.run().transpose()).collect()
}

/// The content of a slot: the caller's, or what the scene computes.
fn content(scene: &Scene, slot: Slot, given: Option<&Texels>) -> Option<Vec<u8>> {
    let format = slot.format(scene);
    match (given, slot.initializer()) {
        (Some(texels), _) => Some(texels.stored_part(slot, scene).encode(format)),
        (None, Initializer::ByScene(make)) => Some(encoded(format, &make(scene))),
        _ => None,
    }
}
