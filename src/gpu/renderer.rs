//! The four stages on one device: frames in, pictures out. Each frame takes a lane of a ring (staging buffer, layer of the
//! frame array, command buffer), so that several are on their way at once; a picture re-runs what changed and nothing else.

use super::GpuError;
use super::context::Context;
use super::order::Order;
use super::pipelines::{Pipeline, Pipelines, Shaders, embedded};
use super::recorder::{Place, Recorder, Work};
use super::resources::{Buffer, Purpose};
use super::slots::Slots;
use super::timeline::Timeline;
use crate::passes::slots::{FRAMES_IN_FLIGHT, Filled, Format, Shape};
use crate::passes::{PassTime, Slot, Texels, Turn, When};
use crate::picture::Picture;
use crate::plan::{Plan, Rerun};
use crate::scene::Scene;
use std::sync::Arc;

#[derive(Clone)]
pub struct Options {
    /// Volume images that take turns: 1 for a still picture, 2 or 3 while frames arrive during rendering.
    pub volume_images: u32,
    pub shaders: Arc<Shaders>,
}

impl Default for Options {
    fn default() -> Self {
        Options { volume_images: 1, shaders: embedded() }
    }
}

struct Lane {
    recorder: Recorder,
    staging: Buffer,
}

pub struct Renderer {
    // Dropped in this order, after `drop` has waited for the device.
    lanes: Vec<Lane>,
    picture: Recorder,
    readback: Buffer,
    slots: Slots,
    steps: Vec<Arc<Pipeline>>,
    pipelines: Pipelines,
    timeline: Timeline,
    order: Order,
    context: Arc<Context>,
    plan: Plan,
    scene: Scene,
    /// Steps of the volume and the picture that have to run before the next picture.
    stale: Vec<bool>,
    next_lane: usize,
    /// The volume image that is shown.
    shown: u32,
    times: Vec<PassTime>,
}

impl Renderer {
    /// Makes everything the scene needs, and nothing else.
    ///
    /// # Errors
    /// What the device cannot hold or compile, named.
    pub fn new(context: &Arc<Context>, scene: Scene, options: &Options) -> Result<Renderer, GpuError> {
        let plan = Plan::new(&scene);
        super::formats::check(context, &plan, &scene)?;
        let mut pipelines = Pipelines::new(context, options.shaders.clone())?;
        let steps = pipelines_of(&mut pipelines, &plan, &scene)?;
        let mut renderer = Renderer {
            lanes: Vec::new(),
            picture: Recorder::new(context, "picture")?,
            readback: readback(context, &scene)?,
            slots: Slots::new(context, options.volume_images),
            steps,
            pipelines,
            timeline: Timeline::new(context)?,
            order: Order::default(),
            context: context.clone(),
            stale: vec![true; plan.steps.len()],
            plan,
            scene,
            next_lane: 0,
            shown: 0,
            times: Vec::new(),
        };
        renderer.make_lanes()?;
        renderer.fit()?;
        Ok(renderer)
    }

    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Bytes of a frame as this scene expects it.
    pub fn frame_bytes(&self) -> usize {
        let layers = u64::from(FRAMES_IN_FLIGHT);
        (Slot::Frames.bytes(&self.scene) / layers) as usize
    }

    fn make_lanes(&mut self) -> Result<(), GpuError> {
        self.lanes.clear();
        let bytes = self.frame_bytes() as u64;
        for _ in 0..FRAMES_IN_FLIGHT {
            self.lanes.push(Lane {
                recorder: Recorder::new(&self.context, "frame")?,
                staging: Buffer::new(&self.context, "staging", bytes, Purpose::Staging)?,
            });
        }
        Ok(())
    }

    /// Makes and fills the slots that are not there yet.
    fn fit(&mut self) -> Result<(), GpuError> {
        let new = self.slots.fit(&self.plan, &self.scene)?;
        if new.is_empty() {
            return Ok(());
        }
        self.picture.begin(&self.timeline)?;
        self.picture.clear_new(&mut self.order, &self.slots, &new);
        self.picture.submit(&mut self.timeline)?;
        for (slot, _) in new {
            self.fill(slot)?;
        }
        self.timeline.wait_all()
    }

    /// Uploads a slot that is made from the scene. Nothing that reads it may be in flight.
    fn fill(&mut self, slot: Slot) -> Result<(), GpuError> {
        let Filled::ByScene(make) = slot.filled() else { return Ok(()) };
        if self.slots.image(slot, 0).is_none() {
            self.slots.fill(slot, &self.scene);
            return Ok(());
        }
        let values = make(&self.scene);
        self.upload(slot, 0, bytemuck::cast_slice(&values))
    }

    fn upload(&mut self, slot: Slot, copy: u32, bytes: &[u8]) -> Result<(), GpuError> {
        let Some(image) = self.slots.image(slot, copy) else { return Ok(()) };
        let mut staging = Buffer::new(&self.context, "upload", slot.bytes(&self.scene), Purpose::Staging)?;
        let length = bytes.len().min(staging.bytes().len());
        staging.bytes_mut()[..length].copy_from_slice(&bytes[..length]);
        self.picture.begin(&self.timeline)?;
        self.picture.copy_in(&mut self.order, &staging, image, Place { slot, copy, parts: 0..image.shape.parts() });
        self.picture.submit(&mut self.timeline)?;
        self.timeline.wait_all()
    }

    /// Sends one frame through stage 1 into its slice of volume image `image`. Returns once the frame's bytes are copied; the
    /// device works on. Waits only when the ring is full.
    ///
    /// # Errors
    /// A frame of the wrong size, a slice that is not there, a device that fails.
    pub fn frame(&mut self, slice: u32, bytes: &[u8], image: u32) -> Result<(), GpuError> {
        if bytes.len() != self.frame_bytes() {
            return Err(GpuError::FrameSize { got: bytes.len(), expected: self.frame_bytes() });
        }
        if slice >= self.scene.slices() {
            return Err(GpuError::FrameSlice { slice, slices: self.scene.slices() });
        }
        let layer = self.next_lane;
        self.next_lane = (layer + 1) % self.lanes.len();
        let Lane { recorder, staging } = &mut self.lanes[layer];
        recorder.collect(&self.timeline, &mut self.times)?;
        recorder.begin(&self.timeline)?;
        staging.bytes_mut().copy_from_slice(bytes);
        if let Some(frames) = self.slots.image(Slot::Frames, 0) {
            let place = Place { slot: Slot::Frames, copy: 0, parts: layer as u32..layer as u32 + 1 };
            recorder.copy_in(&mut self.order, staging, frames, place);
            recorder.stamp("upload");
        }
        for (i, step) in self.plan.steps_of(When::Frame) {
            let turn = Turn { layer: layer as u32, slice, iteration: step.iteration, image };
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            recorder.dispatch(&mut self.order, &Work { slots, pipeline, scene, pass: step.pass, turn: &turn })?;
        }
        recorder.submit(&mut self.timeline)
    }

    /// All frames of volume image `image` have been sent: the next picture shows it.
    pub fn show(&mut self, image: u32) {
        self.shown = image;
        self.stale.iter_mut().for_each(|stale| *stale = true);
    }

    /// Runs what changed since the last picture and brings the result back.
    pub fn picture(&mut self) -> Result<Picture, GpuError> {
        self.picture.collect(&self.timeline, &mut self.times)?;
        self.picture.begin(&self.timeline)?;
        let steps = self.plan.steps_of(When::Volume).chain(self.plan.steps_of(When::Picture));
        for (i, step) in steps.filter(|(i, _)| self.stale[*i]) {
            let turn = Turn { image: self.shown, ..step.turn() };
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            self.picture.dispatch(&mut self.order, &Work { slots, pipeline, scene, pass: step.pass, turn: &turn })?;
        }
        if let Some(screen) = self.slots.image(Slot::Screen, 0) {
            self.picture.copy_out(&mut self.order, screen, Slot::Screen, 0, &self.readback);
            self.picture.stamp("readback");
        }
        self.picture.submit(&mut self.timeline)?;
        self.timeline.wait_all()?;
        self.stale.iter_mut().for_each(|stale| *stale = false);
        let [width, height] = self.scene.picture_size();
        Ok(Picture { width, height, rgba: self.readback.bytes().to_vec() })
    }

    /// Takes a new scene. What it changes is run with the next picture; when it says `Everything` or `Frames`, frames have to
    /// be sent again first.
    pub fn change(&mut self, scene: Scene) -> Result<Rerun, GpuError> {
        let plan = Plan::new(&scene);
        let rerun = plan.rerun(&self.scene, &scene);
        // Compiled before anything is given up, so that a failure leaves the old scene working.
        let steps = pipelines_of(&mut self.pipelines, &plan, &scene)?;
        self.timeline.wait_all()?;
        let resized = scene.picture_size() != self.scene.picture_size();
        let kept: Vec<&str> = self.plan.steps.iter().zip(&self.stale).filter(|s| *s.1).map(|s| s.0.pass.name).collect();
        self.stale = plan.steps.iter().map(|s| kept.contains(&s.pass.name)).collect();
        self.plan = plan;
        self.steps = steps;
        self.scene = scene;
        match &rerun {
            Rerun::Everything => {
                self.stale.iter_mut().for_each(|stale| *stale = true);
                self.make_lanes()?;
                self.fit()?;
                for (slot, _) in self.slots.iter().collect::<Vec<_>>() {
                    self.fill(slot)?;
                }
            }
            Rerun::Frames => {
                self.stale.iter_mut().for_each(|stale| *stale = true);
                self.fit()?;
                for (slot, _) in self.slots.iter().collect::<Vec<_>>() {
                    self.fill(slot)?;
                }
            }
            Rerun::Steps { steps, slots } => {
                self.fit()?;
                steps.iter().for_each(|i| self.stale[*i] = true);
                for slot in slots.clone() {
                    self.fill(slot)?;
                }
            }
        }
        if resized {
            self.readback = readback(&self.context, &self.scene)?;
        }
        Ok(rerun)
    }

    /// A slot's content now; none for a slot that the plan does not have, or one made by the CPU as a table.
    pub fn read(&mut self, slot: Slot) -> Result<Option<Texels>, GpuError> {
        let Some(image) = self.slots.image(slot, self.shown) else { return Ok(None) };
        let buffer = Buffer::new(&self.context, "read", slot.bytes(&self.scene), Purpose::Readback)?;
        let (format, size) = (image.format, size_of(image.shape));
        let copy = if slot.takes_turns() { self.shown } else { 0 };
        self.picture.collect(&self.timeline, &mut self.times)?;
        self.picture.begin(&self.timeline)?;
        self.picture.copy_out(&mut self.order, image, slot, copy, &buffer);
        self.picture.submit(&mut self.timeline)?;
        self.timeline.wait_all()?;
        Ok(Some(Texels::decode(size, format, buffer.bytes())))
    }

    /// Times of every pass since the last call, and of what was copied. Empty where the device has no time stamps.
    pub fn take_times(&mut self) -> Result<Vec<PassTime>, GpuError> {
        self.timeline.wait_all()?;
        for lane in &mut self.lanes {
            lane.recorder.collect(&self.timeline, &mut self.times)?;
        }
        self.picture.collect(&self.timeline, &mut self.times)?;
        Ok(std::mem::take(&mut self.times))
    }

    /// Names of the passes that `work` dispatched, in order.
    pub fn dispatched<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<&'static str>, GpuError> {
        self.order.dispatched = Some(Vec::new());
        let done = work(self);
        let dispatched = self.order.dispatched.take().unwrap_or_default();
        done.map(|_| dispatched)
    }

    /// Barriers recorded so far.
    pub fn barriers(&self) -> u32 {
        self.order.barriers
    }

    /// Leaves out the n-th barrier from here on (1: the first ever recorded), to show that validation notices.
    pub fn drop_barrier(&mut self, n: u32) {
        self.order.drop_barrier = Some(n);
    }
}

fn pipelines_of(pipelines: &mut Pipelines, plan: &Plan, scene: &Scene) -> Result<Vec<Arc<Pipeline>>, GpuError> {
    plan.steps.iter().map(|step| pipelines.get(step.pass, scene)).collect()
}

fn readback(context: &Arc<Context>, scene: &Scene) -> Result<Buffer, GpuError> {
    Buffer::new(context, "readback", Slot::Screen.bytes(scene), Purpose::Readback)
}

/// Texels of a shape, x fastest.
pub fn size_of(shape: Shape) -> [usize; 3] {
    match shape {
        Shape::Two([w, h]) => [w as usize, h as usize, 1],
        Shape::Layers(n) | Shape::Three(n) => n.map(|n| n as usize),
        Shape::Buffer(bytes) => [bytes as usize / Format::Floats.texel_bytes(), 1, 1],
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // A device that is lost has nothing in flight any more.
        let _ = self.timeline.wait_all();
    }
}
