//! The four stages on one device: frames in, pictures out. Each frame takes a lane of a ring (staging buffer, layer of the
//! frame array, command buffer), so that several are on their way at once; a picture re-runs what changed and nothing else.

mod change;
mod inspect;
mod slab;

use super::GpuError;
use super::context::Context;
use super::measured::Measured;
use super::order::Order;
use super::pipelines::{Fetch, Pipeline, Pipelines, Shaders, embedded};
use super::recorder::{Place, Recorder, Work};
use super::resources::{Buffer, Purpose};
use super::slots::Slots;
use super::timeline::Timeline;
use crate::passes::chain;
use crate::passes::slots::{FRAMES_IN_FLIGHT, Filled, Format, Shape};
use crate::passes::{PassTime, Slot, Span, Texels, Turn, When};
use crate::picture::Picture;
use crate::plan::{Contents, Plan, Rerun, affected};
use crate::scene::{Scene, Seen};
use std::sync::Arc;

#[derive(Clone)]
pub struct Options {
    /// Volume images that take turns: 1 for a still picture, 2 or 3 while frames arrive during rendering.
    pub volume_images: u32,
    pub shaders: Arc<Shaders>,
    /// Keep every span of time, host and device, and count invocations.
    pub spans: bool,
    /// How single texels are read; what is fast on the device unless given.
    pub fetch: Option<Fetch>,
}

impl Default for Options {
    fn default() -> Self {
        Options { volume_images: 1, shaders: embedded(), spans: false, fetch: None }
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
    /// Which step wrote each slot last.
    contents: Contents,
    /// By volume image and slice: what the passes over the volume have not seen yet.
    unseen: Vec<Vec<bool>>,
    /// Why the last change of scene was left half done.
    broken: Option<String>,
    /// One-shot staging buffers, kept until the device is done with them.
    uploads: Vec<Buffer>,
    volume_images: u32,
    next_lane: usize,
    /// Slices that wait to be copied together.
    slab: Option<slab::Slab>,
    /// The volume image that is shown.
    shown: u32,
    /// What all frames that were sent have been filtered over, at least.
    filtered: Seen,
    skipped: u64,
    measured: Measured,
    spans: bool,
    fetch: Fetch,
}

impl Renderer {
    /// Makes everything the scene needs, and nothing else.
    ///
    /// # Errors
    /// What the device cannot hold or compile, named.
    pub fn new(context: &Arc<Context>, scene: Scene, options: &Options) -> Result<Renderer, GpuError> {
        let fetch = options.fetch.unwrap_or(Fetch::of(&context.candidate));
        let scene = super::formats::suited(context, fetch, scene);
        let plan = Plan::new(&scene);
        super::formats::check(context, &plan, &scene)?;
        let mut pipelines = Pipelines::new(context, options.shaders.clone(), fetch)?;
        let steps = pipelines_of(&mut pipelines, &plan, &scene)?;
        let mut renderer = Renderer {
            lanes: Vec::new(),
            picture: Recorder::new(context, "picture", options.spans)?,
            readback: readback(context, &scene)?,
            slots: Slots::new(context, options.volume_images.max(1)),
            steps,
            pipelines,
            timeline: Timeline::new(context)?,
            order: Order::default(),
            context: context.clone(),
            stale: vec![true; plan.steps.len()],
            contents: Contents::new(),
            unseen: Vec::new(),
            broken: None,
            uploads: Vec::new(),
            volume_images: options.volume_images.max(1),
            plan,
            filtered: scene.seen,
            skipped: 0,
            scene,
            next_lane: 0,
            slab: None,
            shown: 0,
            measured: Measured::new(context, options.spans),
            spans: options.spans,
            fetch,
        };
        renderer.lanes = lanes(context, &renderer.scene, options.spans)?;
        renderer.forget_volumes();
        renderer.fit()?;
        Ok(renderer)
    }

    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The scene that is shown, with what the device decides of it decided.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How single texels are read.
    pub fn fetch(&self) -> Fetch {
        self.fetch
    }

    /// Bytes of a frame as this scene expects it.
    pub fn frame_bytes(&self) -> usize {
        frame_bytes(&self.scene) as usize
    }

    /// No slice of any volume image has been seen by the passes over the volume.
    fn forget_volumes(&mut self) {
        self.unseen = vec![vec![true; self.scene.slices() as usize]; self.volume_images as usize];
    }

    /// Makes and fills the slots that are not there yet.
    fn fit(&mut self) -> Result<(), GpuError> {
        let new = self.slots.fit(&self.plan, &self.scene)?;
        if new.is_empty() {
            return Ok(());
        }
        self.picture.begin(&mut self.order, &self.timeline)?;
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
        self.picture.begin(&mut self.order, &self.timeline)?;
        self.picture.copy_in(&mut self.order, &staging, image, Place { slot, copy, parts: 0..image.shape.parts() });
        self.uploads.push(staging);
        self.picture.submit(&mut self.timeline)?;
        self.timeline.wait_all()?;
        self.uploads.clear();
        Ok(())
    }

    /// Refuses to go on with a scene that was left half changed, or an image that is not there.
    fn check(&self, image: u32) -> Result<(), GpuError> {
        if let Some(fault) = &self.broken {
            return Err(GpuError::Broken(fault.clone()));
        }
        match image < self.volume_images {
            true => Ok(()),
            false => Err(GpuError::VolumeImage { image, images: self.volume_images }),
        }
    }

    /// Sends one frame through stage 1 into its slice of volume image `image`. Returns once the frame's bytes are copied; the
    /// device works on. Waits only when the ring is full. A frame that nothing of this scene can see is left out and counted.
    ///
    /// # Errors
    /// A frame of the wrong size, a slice that is not there, a device that fails.
    pub fn frame(&mut self, slice: u32, bytes: &[u8], image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        if bytes.len() != self.frame_bytes() {
            return Err(GpuError::FrameSize { got: bytes.len(), expected: self.frame_bytes() });
        }
        if slice >= self.scene.slices() {
            return Err(GpuError::FrameSlice { slice, slices: self.scene.slices() });
        }
        self.filtered = self.scene.seen;
        if !self.scene.frames_seen().contains(&slice) {
            self.skipped += 1;
            return Ok(());
        }
        if chain::copied(&self.scene).is_some() {
            return self.gather(slice, bytes, image);
        }
        let layer = self.next_lane;
        self.next_lane = (layer + 1) % self.lanes.len();
        let Lane { recorder, staging } = &mut self.lanes[layer];
        recorder.collect(&self.timeline, &mut self.measured)?;
        recorder.begin(&mut self.order, &self.timeline)?;
        self.measured.host("stage", || staging.bytes_mut().copy_from_slice(bytes));
        if let Some(frames) = self.slots.image(Slot::Frames, 0) {
            let place = Place { slot: Slot::Frames, copy: 0, parts: layer as u32..layer as u32 + 1 };
            recorder.copy_in(&mut self.order, staging, frames, place);
            recorder.stamp("upload");
        }
        for (i, step) in self.plan.steps_of(When::Frame) {
            let turn = Turn { layer: layer as u32, slice, slices: 1, iteration: step.iteration, image };
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            recorder.dispatch(&mut self.order, &Work { slots, pipeline, scene, pass: step.pass, turn: &turn })?;
        }
        self.measured.host("submit", || recorder.submit(&mut self.timeline))?;
        self.unseen[image as usize][slice as usize] = true;
        Ok(())
    }

    /// All frames of volume image `image` have been sent: the next picture shows it.
    pub fn show(&mut self, image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        self.flush()?;
        self.shown = image;
        self.stale.iter_mut().for_each(|stale| *stale = true);
        Ok(())
    }

    /// Runs what changed since the last picture and brings the result back; where nothing changed, nothing runs.
    pub fn picture(&mut self) -> Result<Picture, GpuError> {
        self.check(self.shown)?;
        let [width, height] = self.scene.picture_size();
        if self.stale.iter().any(|stale| *stale) {
            self.draw()?;
        }
        Ok(Picture { width, height, rgba: self.readback.bytes().to_vec() })
    }

    fn draw(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.plan.complete(&self.scene, &mut self.stale, &self.contents);
        self.picture.collect(&self.timeline, &mut self.measured)?;
        self.picture.begin(&mut self.order, &self.timeline)?;
        let unseen = &self.unseen[self.shown as usize];
        let steps = self.plan.steps_of(When::Volume).chain(self.plan.steps_of(When::Picture));
        for (i, step) in steps.filter(|(i, _)| self.stale[*i]) {
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            let runs: Vec<_> = match step.pass.when {
                When::Volume => {
                    let (low, high) = (scene.seen.low[2], scene.seen.high[2]);
                    let runs = affected(unseen, step.reach(scene)).into_iter();
                    runs.map(|run| run.start.max(low)..run.end.min(high)).filter(|run| !run.is_empty()).collect()
                }
                _ => std::iter::once(0..0).collect(),
            };
            if step.pass.when == When::Volume && !runs.is_empty() {
                self.filtered = scene.seen;
            }
            for slices in runs {
                let (slice, slices) = (slices.start, slices.end - slices.start);
                let turn = Turn { image: self.shown, slice, slices, ..step.turn() };
                let work = Work { slots, pipeline, scene, pass: step.pass, turn: &turn };
                self.picture.dispatch(&mut self.order, &work)?;
            }
            // Taken as written from here on: if the submission fails, all of it is stale still.
            self.contents.extend(step.writes(scene).into_iter().map(|slot| (slot, step.id())));
        }
        if let Some(screen) = self.slots.image(Slot::Screen, 0) {
            self.picture.copy_out(&mut self.order, screen, Slot::Screen, 0, &self.readback);
            self.picture.stamp("readback");
        }
        let (picture, timeline) = (&mut self.picture, &mut self.timeline);
        self.measured.host("submit", || picture.submit(timeline))?;
        self.measured.host("wait", || self.timeline.wait_all())?;
        // A frame that has arrived since without its volume being shown is seen the next time.
        if self.plan.steps_of(When::Volume).all(|(i, _)| self.stale[i]) {
            self.unseen[self.shown as usize].iter_mut().for_each(|unseen| *unseen = false);
        }
        self.stale.iter_mut().for_each(|stale| *stale = false);
        Ok(())
    }

    /// Waits until the device has done everything, and adds up what was measured.
    fn collect(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.timeline.wait_all()?;
        for lane in &mut self.lanes {
            lane.recorder.collect(&self.timeline, &mut self.measured)?;
        }
        self.picture.collect(&self.timeline, &mut self.measured)
    }
}

fn pipelines_of(pipelines: &mut Pipelines, plan: &Plan, scene: &Scene) -> Result<Vec<Arc<Pipeline>>, GpuError> {
    plan.steps.iter().map(|step| pipelines.get(step.pass, scene, &step.turn())).collect()
}

fn frame_bytes(scene: &Scene) -> u64 {
    Slot::Frames.bytes(scene) / u64::from(FRAMES_IN_FLIGHT)
}

fn lanes(context: &Arc<Context>, scene: &Scene, spans: bool) -> Result<Vec<Lane>, GpuError> {
    let bytes = slab::frames_a_lane(scene) * frame_bytes(scene);
    let lane = |_| {
        Ok(Lane {
            recorder: Recorder::new(context, "frame", spans)?,
            staging: Buffer::new(context, "staging", bytes, Purpose::Staging)?,
        })
    };
    (0..FRAMES_IN_FLIGHT).map(lane).collect()
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
        self.timeline.drain();
    }
}
