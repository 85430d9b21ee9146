//! One pass alone on inputs of the caller's: what the tests hold against its reference, and what benches time.

use super::barrier_recorder::BarrierRecorder;
use super::context::Context;
use super::measured::Measured;
use super::pipelines::{Fetch, Pipeline, Pipelines, embedded};
use super::recorder::{Place, Recorder, Work};
use super::renderer::size_of;
use super::resources::{Buffer, Purpose};
use super::slots::Slots;
use super::timeline::Timelines;
use super::{GpuError, formats};
use crate::passes::slots::{Initializer, Shape};
use crate::passes::{Arrays, Bind, DispatchArgs, Frequency, Part, Pass, Slot, Texels};
use crate::plan::Plan;
use crate::scene::Scene;
use std::sync::Arc;

/// Runs passes one at a time.
pub struct PassRunner {
    context: Arc<Context>,
    pipelines: Pipelines,
    fetch: Fetch,
}

impl PassRunner {
    pub fn new(context: &Arc<Context>) -> Result<PassRunner, GpuError> {
        PassRunner::fetching(context, Fetch::of(&context.candidate))
    }

    /// With texels read in a way that may not be the device's fastest.
    pub fn fetching(context: &Arc<Context>, fetch: Fetch) -> Result<PassRunner, GpuError> {
        Ok(PassRunner { context: context.clone(), pipelines: Pipelines::new(context, embedded(), fetch)?, fetch })
    }

    /// Bits of the weights that the device's own filter has, as it says.
    pub fn filter_bits(&self) -> u32 {
        self.context.limits.sub_texel_precision_bits
    }

    /// Dispatches `pass` once. `inputs` are named as in the shader; what the scene makes itself need not be there. Outputs hold
    /// `poison` before, so that what the pass leaves out can be told.
    pub fn run(
        &mut self,
        scene: &Scene,
        pass: &'static Pass,
        args: &DispatchArgs,
        inputs: &Arrays,
        poison: f64,
    ) -> Result<Arrays, GpuError> {
        let scene = &formats::suited(&self.context, self.fetch, scene.clone());
        let (reads, writes) = ((pass.reads)(scene, args), (pass.writes)(scene, args));
        let plan = Plan { steps: Vec::new(), slots: reads.iter().chain(&writes).map(|b| b.slot).collect() };
        let mut slots = Slots::new(&self.context, args.image + 1);
        let mut timelines = Timelines::new(&self.context, 1)?;
        let mut recorder = Recorder::new(&self.context, 0, pass.name, false)?;
        let mut order = BarrierRecorder::default();
        let pipeline = self.pipelines.get(pass, scene, args)?;
        let new = slots.fit(&plan, scene)?;

        let mut staged = Vec::new();
        for bind in &reads {
            let Some(bytes) = input(scene, bind, inputs) else { continue };
            let bytes = self.context.faults.given(bind.slot, scene, bytes);
            match slots.buffer_mut(bind.slot) {
                Some(buffer) => {
                    let length = buffer.bytes().len().min(bytes.len());
                    buffer.bytes_mut()[..length].copy_from_slice(&bytes[..length]);
                }
                None => staged.push((*bind, bytes)),
            }
        }
        for bind in &writes {
            let format = bind.slot.format(scene);
            let poisoned = Texels::from_fn(size_of(bind.slot.shape(scene)), format.channels(), |_, _| poison);
            staged.push((Bind { part: Part::Whole, ..*bind }, poisoned.encode(format)));
        }

        recorder.begin(&mut order, &timelines)?;
        recorder.clear_new(&mut order, &slots, &new);
        let mut keep = Vec::new();
        for (bind, bytes) in staged {
            let Some(image) = slots.image(bind.slot, args.image) else { continue };
            let mut staging = Buffer::new(&self.context, "input", bytes.len() as u64, Purpose::Staging)?;
            staging.bytes_mut().copy_from_slice(&bytes);
            let parts = match bind.part {
                Part::Layer => args.layer..args.layer + 1,
                _ => 0..image.shape.parts(),
            };
            let copy = if bind.slot.is_multibuffered() { args.image } else { 0 };
            recorder.copy_in(&mut order, &staging, image, Place { slot: bind.slot, copy, parts });
            keep.push(staging);
        }
        recorder.dispatch(&mut order, &Work { slots: &slots, pipeline: &pipeline, scene, pass, args })?;
        let mut results = Vec::new();
        for bind in &writes {
            let Some(image) = slots.image(bind.slot, args.image) else { continue };
            let buffer = Buffer::new(&self.context, "output", bind.slot.bytes(scene), Purpose::Readback)?;
            let copy = if bind.slot.is_multibuffered() { args.image } else { 0 };
            recorder.copy_out(&mut order, image, bind.slot, copy, &buffer);
            results.push((bind.name, size_of(image.shape), image.format, buffer));
        }
        recorder.submit(&mut order, &mut timelines)?;
        let done = timelines.wait_all();
        // Everything above is freed at the end, also when waiting failed.
        timelines.drain();
        done?;
        let mut outputs = Arrays::default();
        for (name, size, format, buffer) in results {
            outputs.insert(name, Texels::decode(size, format, buffer.bytes()));
        }
        Ok(outputs)
    }
}

/// One pass of a scene, with slots and pipelines of its own, to be run and timed as often as wanted.
pub struct Timed {
    // Dropped in this order, after `drop` has waited for the device.
    recorder: Recorder,
    /// Every iteration of the pass.
    dispatches: Vec<(DispatchArgs, Arc<Pipeline>)>,
    _pipelines: Pipelines,
    slots: Slots,
    timelines: Timelines,
    order: BarrierRecorder,
    context: Arc<Context>,
    scene: Scene,
    pass: &'static Pass,
}

impl Timed {
    /// `contents` is what images hold before the first run; those left out hold zeros. What the scene makes itself is there in
    /// any case. A pass of frames works on layer 0 and the middle slice, one of volumes on all slices. Runs once, because
    /// drivers compile then.
    ///
    /// # Errors
    /// What the device cannot hold or compile, named.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        pass: &'static Pass,
        contents: &[(Slot, Texels)],
    ) -> Result<Timed, GpuError> {
        Timed::fetching(context, scene, pass, contents, Fetch::of(&context.candidate))
    }

    /// The same with texels read in a way that may not be the device's fastest.
    pub fn fetching(
        context: &Arc<Context>,
        scene: &Scene,
        pass: &'static Pass,
        contents: &[(Slot, Texels)],
        fetch: Fetch,
    ) -> Result<Timed, GpuError> {
        let scene = &formats::suited(context, fetch, scene.clone());
        let first = DispatchArgs { slice: scene.slices() / 2, ..DispatchArgs::default() };
        let first = if pass.frequency == Frequency::Frame {
            first
        } else {
            DispatchArgs { slice: 0, slices: scene.slices(), ..first }
        };
        let turns: Vec<DispatchArgs> =
            (0..(pass.repeat)(scene)).map(|iteration| DispatchArgs { iteration, ..first }).collect();
        let mut plan = Plan { steps: Vec::new(), slots: Vec::new() };
        let pipelines = Pipelines::new(context, embedded(), fetch)?;
        let mut dispatches = Vec::new();
        for args in turns {
            let binds = [(pass.reads)(scene, &args), (pass.writes)(scene, &args)].concat();
            plan.slots.extend(binds.iter().map(|b| b.slot));
            dispatches.push((args, pipelines.get(pass, scene, &args)?));
        }
        plan.slots.sort();
        plan.slots.dedup();
        let mut timed = Timed {
            recorder: Recorder::new(context, 0, pass.name, false)?,
            dispatches,
            _pipelines: pipelines,
            slots: Slots::new(context, 1),
            timelines: Timelines::new(context, 1)?,
            order: BarrierRecorder::default(),
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
        self.recorder.begin(&mut self.order, &self.timelines)?;
        self.recorder.clear_new(&mut self.order, &self.slots, &new);
        let mut keep = Vec::new();
        for &(slot, copy) in &new {
            let given = contents.iter().find(|(s, _)| *s == slot).map(|(_, t)| t.encode(slot.format(&self.scene)));
            let bytes = match (given, slot.filled()) {
                (Some(bytes), _) => bytes,
                (None, Initializer::ByScene(make)) => bytemuck::cast_slice(&make(&self.scene)).to_vec(),
                _ => continue,
            };
            let Some(image) = self.slots.image(slot, copy) else { continue };
            // As large as the image, whatever was given.
            let mut staging = Buffer::new(&self.context, "contents", slot.bytes(&self.scene), Purpose::Staging)?;
            let length = bytes.len().min(staging.bytes().len());
            staging.bytes_mut()[..length].copy_from_slice(&bytes[..length]);
            let place = Place { slot, copy, parts: 0..image.shape.parts() };
            self.recorder.copy_in(&mut self.order, &staging, image, place);
            keep.push(staging);
        }
        self.recorder.submit(&mut self.order, &mut self.timelines)?;
        let done = self.timelines.wait_all();
        // The staging buffers are freed at the end, also when waiting failed.
        self.timelines.drain();
        done
    }

    /// Runs every iteration of the pass once, in one submission, and waits: the device's time for them all, ns; none where it
    /// has no time stamps. A pass that repeats works on what it left there the last time.
    pub fn run(&mut self) -> Result<Option<f64>, GpuError> {
        self.recorder.begin(&mut self.order, &self.timelines)?;
        for (args, pipeline) in &self.dispatches {
            let work = Work { slots: &self.slots, pipeline, scene: &self.scene, pass: self.pass, args };
            self.recorder.dispatch(&mut self.order, &work)?;
        }
        self.recorder.submit(&mut self.order, &mut self.timelines)?;
        let mut measured = Measured::new(&self.context, false);
        self.recorder.collect(&self.timelines, &mut measured)?;
        Ok(measured.take_times().iter().find(|t| t.name == self.pass.name).map(|t| t.total))
    }

    /// What an image holds now; none for a slot that the pass does not touch, or that is a table.
    pub fn read(&mut self, slot: Slot) -> Result<Option<Texels>, GpuError> {
        let Some(image) = self.slots.image(slot, 0) else { return Ok(None) };
        let buffer = Buffer::new(&self.context, "read", slot.bytes(&self.scene), Purpose::Readback)?;
        self.recorder.begin(&mut self.order, &self.timelines)?;
        self.recorder.copy_out(&mut self.order, image, slot, 0, &buffer);
        self.recorder.submit(&mut self.order, &mut self.timelines)?;
        let done = self.timelines.wait_all();
        // The buffer is freed at the end, also when waiting failed.
        self.timelines.drain();
        done.map(|()| Some(Texels::decode(size_of(image.shape), image.format, buffer.bytes())))
    }
}

impl Drop for Timed {
    fn drop(&mut self) {
        self.timelines.drain();
    }
}

/// Times of `count` runs of one pass in a row, ns, each of all its iterations, over slots that hold zeros; empty where the
/// device has no time stamps. A run before them, which compiles, is left out.
pub fn time(context: &Arc<Context>, scene: &Scene, pass: &'static Pass, count: u32) -> Result<Vec<f64>, GpuError> {
    let mut timed = Timed::new(context, scene, pass, &[])?;
    let mut times = Vec::new();
    for _ in 0..count {
        times.extend(timed.run()?);
    }
    Ok(times)
}

/// The bytes that a slot read by a pass holds: the caller's, or the scene's own.
fn input(scene: &Scene, bind: &Bind, inputs: &Arrays) -> Option<Vec<u8>> {
    let format = bind.slot.format(scene);
    if let Some((_, texels)) = inputs.iter().find(|(name, _)| *name == bind.name) {
        return Some(texels.encode(format));
    }
    match (bind.slot.filled(), bind.slot.shape(scene)) {
        (Initializer::ByScene(make), Shape::Two(_) | Shape::Buffer(_)) => {
            Some(bytemuck::cast_slice(&make(scene)).to_vec())
        }
        _ => None,
    }
}
