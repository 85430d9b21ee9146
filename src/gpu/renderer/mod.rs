//! The four stages on one device: frames in, pictures out. Each frame takes a lane of a ring (staging buffer, layer of the
//! frame array, command buffer), so that several are on their way at once; a picture re-runs what changed and nothing else.

mod change;
mod draw;
mod frames;
mod inspect;
#[cfg(feature = "view")]
mod present;
mod slab;

use super::GpuError;
use super::barrier_recorder::BarrierRecorder;
use super::context::Context;
use super::measured::Measured;
use super::pipelines::{AsyncPipelineCompiler, Fetch, Pipeline, Pipelines, Shaders, Wake, embedded};
use super::recorder::{Place, Recorder, Work};
use super::resources::{Buffer, Purpose};
use super::slots::Slots;
use super::timeline::Timelines;
use crate::barriers::oracle::Log;
use crate::passes::chain;
use crate::passes::slots::{FRAMES_IN_FLIGHT, Format, Initializer, Shape};
use crate::passes::{DispatchArgs, Frequency, PassTime, Slot, Span, Texels};
use crate::picture::Picture;
use crate::plan::{Contents, Plan, Rerun, affected};
use crate::queues::{Queues, Work as Task};
use crate::scene::{Scene, VisibleBounds};
use std::collections::HashSet;
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
    /// Queues that share the work, 1..=3; as many as the device has for different work unless given. Where it has fewer than given,
    /// several are one.
    pub queues: Option<usize>,
    /// Bring every picture back; otherwise it stays on the device, where it is shown.
    pub readback: bool,
    /// Called when something was made beside the drawing.
    pub wake: Option<Wake>,
    /// Keep a log of all that is recorded: [`Renderer::log`].
    pub log: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            volume_images: 1,
            shaders: embedded(),
            spans: false,
            fetch: None,
            queues: None,
            readback: true,
            wake: None,
            log: false,
        }
    }
}

struct Lane {
    /// Copies the samples in, where a queue of its own does that.
    copier: Option<Recorder>,
    recorder: Recorder,
    staging: Buffer,
}

pub struct Renderer {
    // Dropped in this order, after `drop` has waited for the device.
    lanes: Vec<Lane>,
    picture: Recorder,
    /// None: pictures stay on the device.
    readback: Option<Buffer>,
    slots: Slots,
    steps: Vec<Arc<Pipeline>>,
    /// Started when it is needed first.
    beside: Option<AsyncPipelineCompiler>,
    pipelines: Arc<Pipelines>,
    timelines: Timelines,
    order: BarrierRecorder,
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
    /// The frame whose lines are arriving.
    arriving: Option<frames::Arriving>,
    /// Frames that were given up because another began before all of their lines had come.
    torn: u64,
    /// Slices that wait to be copied together.
    slab: Option<slab::Slab>,
    /// A picture is on its way.
    drawing: bool,
    /// The picture's image holds one.
    drawn: bool,
    /// The value of the first queue's timeline at which it has been shown.
    presented: u64,
    /// The volume image that is shown.
    shown: u32,
    /// What all frames that were sent have been filtered over, at least.
    filtered: VisibleBounds,
    skipped: u64,
    measured: Measured,
    spans: bool,
    fetch: Fetch,
    wake: Option<Wake>,
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
        let pipelines = Arc::new(Pipelines::new(context, options.shaders.clone(), fetch)?);
        let steps = pipelines_of(&pipelines, &plan, &scene)?;
        let queues = options.queues.unwrap_or(context.queue_count()).clamp(1, crate::queues::MOST);
        let mut renderer = Renderer {
            lanes: Vec::new(),
            picture: Recorder::new(context, 0, "picture", options.spans)?,
            readback: options.readback.then(|| readback(context, &scene)).transpose()?,
            slots: Slots::new(context, options.volume_images.max(1)),
            steps,
            beside: None,
            pipelines,
            timelines: Timelines::new(context, queues)?,
            order: BarrierRecorder {
                queues: Queues::new(queues),
                log: options.log.then(Log::default),
                ..BarrierRecorder::default()
            },
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
            arriving: None,
            torn: 0,
            slab: None,
            drawing: false,
            drawn: false,
            presented: 0,
            shown: 0,
            measured: Measured::new(context, options.spans),
            spans: options.spans,
            fetch,
            wake: options.wake.clone(),
        };
        renderer.lanes = renderer.new_lanes()?;
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
        self.drawn &= !new.iter().any(|(slot, _)| *slot == Slot::Screen);
        if new.is_empty() {
            return Ok(());
        }
        self.picture.begin(&mut self.order, &self.timelines)?;
        self.picture.clear_new(&mut self.order, &self.slots, &new);
        self.picture.submit(&mut self.order, &mut self.timelines)?;
        for (slot, _) in new {
            self.fill(slot)?;
        }
        self.timelines.wait_all()
    }

    /// Uploads a slot that is made from the scene. Nothing that reads it may be in flight.
    fn fill(&mut self, slot: Slot) -> Result<(), GpuError> {
        let Initializer::ByScene(make) = slot.filled() else { return Ok(()) };
        if self.slots.image(slot, 0).is_none() {
            self.slots.fill(slot, &self.scene);
            return Ok(());
        }
        let values = self.context.faults.table(slot, &self.scene, make(&self.scene));
        self.upload(slot, 0, bytemuck::cast_slice(&values))
    }

    fn upload(&mut self, slot: Slot, copy: u32, bytes: &[u8]) -> Result<(), GpuError> {
        let Some(image) = self.slots.image(slot, copy) else { return Ok(()) };
        let mut staging = Buffer::new(&self.context, "upload", slot.bytes(&self.scene), Purpose::Staging)?;
        let length = bytes.len().min(staging.bytes().len());
        staging.bytes_mut()[..length].copy_from_slice(&bytes[..length]);
        self.picture.begin(&mut self.order, &self.timelines)?;
        self.picture.copy_in(&mut self.order, &staging, image, Place { slot, copy, parts: 0..image.shape.parts() });
        self.uploads.push(staging);
        self.picture.submit(&mut self.order, &mut self.timelines)?;
        self.timelines.wait_all()?;
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

    /// Waits until the device has done everything, and adds up what was measured.
    fn collect(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.timelines.wait_all()?;
        for lane in &mut self.lanes {
            lane.collect(&self.timelines, &mut self.measured)?;
        }
        self.picture.collect(&self.timelines, &mut self.measured)
    }

    fn new_lanes(&self) -> Result<Vec<Lane>, GpuError> {
        let (context, count) = (&self.context, self.order.queues.count());
        let bytes = slab::frames_a_lane(&self.scene) * frame_bytes(&self.scene);
        let (copy, ingest) = (Task::Copy.queue(count), Task::Ingest.queue(count));
        // Slices of a 3D image are not sub-resources: not every queue may copy one alone.
        let copies = copy != ingest && (chain::copied(&self.scene).is_none() || context.queue(copy).copies_slices);
        let lane = |_| {
            let copier = || Recorder::new(context, copy, "copy", false);
            Ok(Lane {
                copier: copies.then(copier).transpose()?,
                recorder: Recorder::new(context, ingest, "frame", self.spans)?,
                staging: Buffer::new(context, "staging", bytes, Purpose::Staging)?,
            })
        };
        (0..FRAMES_IN_FLIGHT).map(lane).collect()
    }
}

fn pipelines_of(pipelines: &Pipelines, plan: &Plan, scene: &Scene) -> Result<Vec<Arc<Pipeline>>, GpuError> {
    plan.steps.iter().map(|step| pipelines.get(step.pass, scene, &step.args())).collect()
}

fn frame_bytes(scene: &Scene) -> u64 {
    Slot::Frames.bytes(scene) / u64::from(FRAMES_IN_FLIGHT)
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
        self.timelines.drain();
    }
}
