//! One pass alone on inputs of the caller's: what the tests hold against its reference.

use super::GpuError;
use super::context::Context;
use super::measured::Measured;
use super::order::Order;
use super::pipelines::{Pipelines, embedded};
use super::recorder::{Place, Recorder, Work};
use super::renderer::size_of;
use super::resources::{Buffer, Purpose};
use super::slots::Slots;
use super::timeline::Timeline;
use crate::passes::slots::{Filled, Shape};
use crate::passes::{Arrays, Bind, Part, Pass, Texels, Turn};
use crate::plan::Plan;
use crate::scene::Scene;
use std::sync::Arc;

/// Runs passes one at a time.
pub struct Single {
    context: Arc<Context>,
    pipelines: Pipelines,
}

impl Single {
    pub fn new(context: &Arc<Context>) -> Result<Single, GpuError> {
        Ok(Single { context: context.clone(), pipelines: Pipelines::new(context, embedded())? })
    }

    /// Dispatches `pass` once. `inputs` are named as in the shader; what the scene makes itself need not be there. Outputs hold
    /// `poison` before, so that what the pass leaves out can be told.
    pub fn run(
        &mut self,
        scene: &Scene,
        pass: &'static Pass,
        turn: &Turn,
        inputs: &Arrays,
        poison: f64,
    ) -> Result<Arrays, GpuError> {
        let (reads, writes) = ((pass.reads)(scene, turn), (pass.writes)(scene, turn));
        let plan = Plan { steps: Vec::new(), slots: reads.iter().chain(&writes).map(|b| b.slot).collect() };
        let mut slots = Slots::new(&self.context, turn.image + 1);
        let mut timeline = Timeline::new(&self.context)?;
        let mut recorder = Recorder::new(&self.context, pass.name, false)?;
        let mut order = Order::default();
        let pipeline = self.pipelines.get(pass, scene, turn)?;
        let new = slots.fit(&plan, scene)?;

        let mut staged = Vec::new();
        for bind in &reads {
            let Some(bytes) = input(scene, bind, inputs) else { continue };
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

        recorder.begin(&mut order, &timeline)?;
        recorder.clear_new(&mut order, &slots, &new);
        let mut keep = Vec::new();
        for (bind, bytes) in staged {
            let Some(image) = slots.image(bind.slot, turn.image) else { continue };
            let mut staging = Buffer::new(&self.context, "input", bytes.len() as u64, Purpose::Staging)?;
            staging.bytes_mut().copy_from_slice(&bytes);
            let parts = match bind.part {
                Part::Layer => turn.layer..turn.layer + 1,
                _ => 0..image.shape.parts(),
            };
            let copy = if bind.slot.takes_turns() { turn.image } else { 0 };
            recorder.copy_in(&mut order, &staging, image, Place { slot: bind.slot, copy, parts });
            keep.push(staging);
        }
        recorder.dispatch(&mut order, &Work { slots: &slots, pipeline: &pipeline, scene, pass, turn })?;
        let mut results = Vec::new();
        for bind in &writes {
            let Some(image) = slots.image(bind.slot, turn.image) else { continue };
            let buffer = Buffer::new(&self.context, "output", bind.slot.bytes(scene), Purpose::Readback)?;
            let copy = if bind.slot.takes_turns() { turn.image } else { 0 };
            recorder.copy_out(&mut order, image, bind.slot, copy, &buffer);
            results.push((bind.name, size_of(image.shape), image.format, buffer));
        }
        recorder.submit(&mut timeline)?;
        let done = timeline.wait_all();
        // Everything above is freed at the end, also when waiting failed.
        timeline.drain();
        done?;
        let mut outputs = Arrays::default();
        for (name, size, format, buffer) in results {
            outputs.insert(name, Texels::decode(size, format, buffer.bytes()));
        }
        Ok(outputs)
    }
}

/// Times of `count` dispatches of one pass in a row, ns, over slots that hold zeros; empty where the device has no time stamps.
/// The first, which compiles, is left out.
pub fn time(context: &Arc<Context>, scene: &Scene, pass: &'static Pass, count: u32) -> Result<Vec<f64>, GpuError> {
    let turn = Turn::default();
    let (reads, writes) = ((pass.reads)(scene, &turn), (pass.writes)(scene, &turn));
    let plan = Plan { steps: Vec::new(), slots: reads.iter().chain(&writes).map(|b| b.slot).collect() };
    let mut slots = Slots::new(context, 1);
    let mut timeline = Timeline::new(context)?;
    let mut recorder = Recorder::new(context, pass.name, false)?;
    let mut order = Order::default();
    let mut pipelines = Pipelines::new(context, embedded())?;
    let pipeline = pipelines.get(pass, scene, &turn)?;
    let new = slots.fit(&plan, scene)?;
    let mut times = Vec::new();
    for n in 0..=count {
        recorder.begin(&mut order, &timeline)?;
        if n == 0 {
            recorder.clear_new(&mut order, &slots, &new);
        }
        let work = Work { slots: &slots, pipeline: &pipeline, scene, pass, turn: &turn };
        let done = recorder.dispatch(&mut order, &work).and_then(|()| recorder.submit(&mut timeline));
        timeline.drain();
        done?;
        let mut measured = Measured::new(context, false);
        recorder.collect(&timeline, &mut measured)?;
        let taken = measured.take_times();
        times.extend(taken.iter().filter(|t| n > 0 && t.name == pass.name).map(|t| t.total));
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
        (Filled::ByScene(make), Shape::Two(_) | Shape::Buffer(_)) => Some(bytemuck::cast_slice(&make(scene)).to_vec()),
        _ => None,
    }
}
