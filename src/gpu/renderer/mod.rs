//! The four stages on one device: frames in, pictures out. Each batch of frames uses an entry of a ring (staging buffer, layers of the
//! frame array, command buffer), so that several are in flight. A picture runs only the passes whose inputs changed.

mod draw;
mod ingest;

use super::bands::{BandLimit, Bands};
use super::buffers::{Buffer, Purpose, Readback, Upload};
use super::command_recorder::{BarrierRecorder, BufferLayout, CommandRecorder, Dispatch, SlotParts};
use super::context::Context;
use super::error::GpuError;
use super::formats::{self, TexelAccess};
use super::pipeline_compiler::{AsyncPipelineCompiler, SceneMaker, Wake};
use super::pipelines::{Pipeline, Pipelines, Shaders, embedded};
use super::resources::SlotResources;
use super::timeline::Timelines;
use super::timing::{TimeStamps, Timings};
use crate::passes::chain;
use crate::passes::slots::{BATCHES_IN_FLIGHT, Format, Initializer, batch_bytes, frames_per_batch};
use crate::passes::unveil::Unveiled;
use crate::passes::{DispatchArgs, Frequency, PassTime, Slot, Span, Stage, Texels};
use crate::picture::Picture;
use crate::plan::{Contents, Plan, Rerun, Work, affected};
use crate::queues::oracle::SubmissionLog;
use crate::queues::{MAX_QUEUES, QueueRole, QueueTracker};
use crate::scene::{Scene, VisibleBounds};
use ingest::{SliceBatch, Staging};
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

/// How a [`Renderer`] runs.
#[derive(Clone)]
pub struct RendererOptions {
    /// Number of volume images: 1 for a still picture, 2 or 3 (double or triple buffering) while frames arrive during rendering.
    pub volume_images: u32,
    /// Where the SPIR-V of a shader comes from; the embedded shaders by default.
    pub shaders: Arc<Shaders>,
    /// Record a span of time for each host and device operation; where each pass is timed, count shader invocations too.
    pub spans: bool,
    /// What is timed on the device.
    pub time_stamps: TimeStamps,
    /// How the passes over the volume and the picture are divided, so that no submission takes too long.
    pub bands: Bands,
    /// Hold back bands of a picture while the device has enough to do, so that a window's panels are drawn between them. They are submitted
    /// by [`Renderer::is_drawing`], and by whatever waits. On a device with several queues nothing is held back.
    pub paced: bool,
    /// How single texels are read; `None` selects what is fast on the device.
    pub texel_access: Option<TexelAccess>,
    /// Maximum number of frames that go through stage 1 at once, 1..; `None` selects what is fast on the device.
    pub frames_at_once: Option<u32>,
    /// Number of queues, 1..=3; `None` uses all that the device has. With fewer on the device than given, several of them share
    /// one.
    pub queues: Option<usize>,
    /// Copy every picture to the host. Otherwise it stays on the device, for presentation.
    pub readback: bool,
    /// Called when a pipeline has been compiled in the background.
    pub wake: Option<Wake>,
    /// Keep a log of everything that is recorded and submitted: [`Renderer::log`].
    pub log: bool,
}

impl Default for RendererOptions {
    fn default() -> Self {
        RendererOptions {
            volume_images: 1,
            shaders: embedded(),
            spans: false,
            time_stamps: TimeStamps::default(),
            bands: Bands::default(),
            paced: false,
            texel_access: None,
            frames_at_once: None,
            queues: None,
            readback: true,
            wake: None,
            log: false,
        }
    }
}

/// An entry of the ring: one upload in flight.
struct InFlight {
    /// Copies the samples, if the device has a queue for copies.
    copier: Option<CommandRecorder>,
    recorder: CommandRecorder,
    staging: Buffer,
}

/// A frame of which some lines have arrived.
struct PartialFrame {
    slice: u32,
    image: u32,
}

/// The scene with the fields that the device resolves, and this many frames through stage 1 at once if that is given.
pub(super) fn adapted(
    context: &Context,
    texel_access: TexelAccess,
    frames_at_once: Option<u32>,
    scene: Scene,
) -> Scene {
    let adapted = formats::adapt_scene(context, texel_access, scene);
    Scene { frames_at_once: frames_at_once.unwrap_or(adapted.frames_at_once), ..adapted }
}

/// Renders one scene: frames are sent into volume images, and pictures come out. The scene can be changed at any time.
pub struct Renderer {
    // Fields are dropped in this order, after `drop` has waited for the device.
    ring: Vec<InFlight>,
    picture: CommandRecorder,
    /// `None` if pictures stay on the device.
    readback: Option<Readback>,
    slots: SlotResources,
    steps: Vec<Arc<Pipeline>>,
    /// Started at its first use.
    compiler: Option<AsyncPipelineCompiler>,
    pipelines: Arc<Pipelines>,
    timelines: Timelines,
    barriers: BarrierRecorder,
    context: Arc<Context>,
    plan: Plan,
    scene: Scene,
    /// By step of the plan: it has to run before the next picture.
    stale: Vec<bool>,
    /// The step that last wrote each slot.
    contents: Contents,
    /// By volume image and slice: the passes over the volume have not processed it yet.
    unprocessed: Vec<Vec<bool>>,
    /// By volume image: what the CPU found of its volume, where the render start follows the fluid.
    unveiled: Vec<Option<Unveiled>>,
    /// What the CPU found and the device has: the slot that holds it, and the volume image that it was found in.
    found: Vec<(Slot, u32)>,
    /// The error that left the last change of scene incomplete.
    broken: Option<String>,
    /// Buffers of a single copy, kept until the device is done with them.
    uploads: Vec<Upload>,
    unread: Vec<Readback>,
    volume_images: u32,
    ring_index: usize,
    /// The frame whose lines are arriving.
    partial: Option<PartialFrame>,
    /// Its bytes that have arrived, in host memory: staging memory is slow to read, and a batch may be submitted before they are complete.
    received: Vec<u8>,
    /// Frames that were dropped because another began before all of their lines had arrived.
    incomplete: u64,
    /// Frames that will be submitted together.
    batch: Option<SliceBatch>,
    /// As [`RendererOptions::frames_at_once`].
    frames_at_once: Option<u32>,
    staging: Staging,
    /// A picture has been submitted and not waited for.
    drawing: bool,
    /// The picture's image holds a picture, or will when the device is done.
    drawn: bool,
    /// How much of the picture was drawn last.
    drawn_work: Work,
    /// The value of queue 0's timeline at which the last presentation is done.
    presented: u64,
    /// The volume image that pictures show.
    shown: u32,
    /// The smallest region that stage 1 has filtered for any frame since the last reset.
    filtered_bounds: VisibleBounds,
    /// Frames that are not visible in their scene.
    skipped: u64,
    timings: Timings,
    spans: bool,
    time_stamps: TimeStamps,
    /// `None` if no dispatch is divided.
    limit: Option<BandLimit>,
    texel_access: TexelAccess,
    wake: Option<Wake>,
}

impl Renderer {
    /// Allocates the slots and compiles the pipelines that the scene needs.
    ///
    /// # Errors
    /// A slot that the device cannot hold, or a shader that does not compile; the error names it.
    pub fn new(context: &Arc<Context>, scene: Scene, options: &RendererOptions) -> Result<Renderer, GpuError> {
        let texel_access = options.texel_access.unwrap_or(TexelAccess::for_device(&context.candidate));
        let scene = adapted(context, texel_access, options.frames_at_once, scene);
        let plan = Plan::new(&scene);
        formats::check(context, &plan, &scene)?;
        let pipelines = Pipelines::shared(context, options.shaders.clone(), texel_access)?;
        let steps = pipelines.of_plan(&plan, &scene)?;
        let staging = Staging::new(&scene, context.candidate.max_buffer);
        let queues = options.queues.unwrap_or(context.queue_count()).clamp(1, MAX_QUEUES);
        let mut renderer = Renderer {
            ring: Vec::new(),
            picture: CommandRecorder::new(context, 0, "picture", options.time_stamps, options.spans)?,
            readback: options.readback.then(|| readback(context, &scene)).transpose()?,
            slots: SlotResources::new(context, options.volume_images.max(1)),
            steps,
            compiler: None,
            pipelines,
            timelines: Timelines::new(context, queues)?,
            barriers: BarrierRecorder {
                queues: QueueTracker::new(queues),
                log: options.log.then(SubmissionLog::default),
                ..BarrierRecorder::default()
            },
            context: context.clone(),
            stale: vec![true; plan.steps.len()],
            contents: Contents::new(),
            unprocessed: Vec::new(),
            unveiled: Vec::new(),
            found: Vec::new(),
            broken: None,
            uploads: Vec::new(),
            unread: Vec::new(),
            volume_images: options.volume_images.max(1),
            plan,
            filtered_bounds: scene.visible_bounds,
            skipped: 0,
            scene,
            ring_index: 0,
            partial: None,
            received: Vec::new(),
            incomplete: 0,
            batch: None,
            frames_at_once: options.frames_at_once,
            staging,
            drawing: false,
            drawn: false,
            drawn_work: Work::Rays,
            presented: 0,
            shown: 0,
            timings: Timings::new(context, options.spans),
            spans: options.spans,
            time_stamps: options.time_stamps,
            limit: match options.paced && queues == 1 {
                true => BandLimit::paced(options.bands, context.candidate.is_software()),
                false => BandLimit::new(options.bands, context.candidate.is_software()),
            },
            texel_access,
            wake: options.wake.clone(),
        };
        if let Some(limit) = renderer.limit.filter(|_| options.paced) {
            renderer.timelines.pace(limit.in_flight());
        }
        renderer.ring = renderer.new_ring()?;
        renderer.invalidate_volumes();
        renderer.fit()?;
        Ok(renderer)
    }

    /// The passes and slots of the current scene.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The current scene, with the fields that the device resolves.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How single texels are read.
    pub fn texel_access(&self) -> TexelAccess {
        self.texel_access
    }

    /// Bytes of a frame of the current scene.
    pub fn frame_bytes(&self) -> usize {
        frame_bytes(&self.scene) as usize
    }

    /// Marks every slice of every volume image as unprocessed.
    fn invalidate_volumes(&mut self) {
        self.unprocessed = vec![vec![true; self.scene.slices() as usize]; self.volume_images as usize];
    }

    /// Allocates and fills the slots that are missing. What passes over the volume and the picture wrote into those that were replaced has
    /// to be made again.
    fn fit(&mut self) -> Result<(), GpuError> {
        let new = self.slots.fit(&self.plan, &self.scene)?;
        self.found.retain(|(slot, _)| self.plan.slots.contains(slot) && new.iter().all(|(made, _)| made != slot));
        let mut is_volume_lost = false;
        for (i, step) in self.plan.steps.iter().enumerate() {
            let is_lost = step.writes(&self.scene).iter().any(|slot| new.iter().any(|(made, _)| made == slot));
            if is_lost && step.pass.frequency != Frequency::Frame {
                self.stale[i] = true;
                is_volume_lost |= step.pass.frequency == Frequency::Volume;
            }
        }
        if is_volume_lost {
            self.invalidate_volumes();
        }
        self.drawn &= !new.iter().any(|(slot, _)| *slot == Slot::Screen);
        if new.is_empty() {
            return Ok(());
        }
        self.picture.begin(&mut self.barriers, &self.timelines)?;
        self.picture.clear_new(&mut self.barriers, &self.slots, &new);
        self.picture.submit(&mut self.barriers, &mut self.timelines)?;
        for (slot, _) in new {
            self.fill(slot)?;
        }
        self.timelines.wait_all()?;
        // The next frame may write what was cleared here.
        self.context.show_layer_the_wait()
    }

    /// Uploads a slot that the CPU computes from the scene. Nothing that reads it may be in flight.
    fn fill(&mut self, slot: Slot) -> Result<(), GpuError> {
        let Initializer::ByScene(make) = slot.initializer() else { return Ok(()) };
        if self.slots.image(slot, 0).is_none() {
            self.slots.fill(slot, &self.scene);
            return Ok(());
        }
        let values = self.context.faults.table(slot, &self.scene, make(&self.scene));
        self.upload(slot, 0, bytemuck::cast_slice(&values))
    }

    fn upload(&mut self, slot: Slot, copy: u32, bytes: &[u8]) -> Result<(), GpuError> {
        let Some(image) = self.slots.image(slot, copy) else { return Ok(()) };
        let place = SlotParts { slot, copy, parts: 0..image.shape.parts() };
        let upload = Upload::new(&self.context, "upload", image.layout(), place.parts.clone(), bytes)?;
        self.picture.begin(&mut self.barriers, &self.timelines)?;
        // A layer that tracks submissions of two threads forgets what was between this upload and the last one.
        self.picture.show_layer_the_wait();
        self.picture.upload(&mut self.barriers, &upload, image, place);
        self.uploads.push(upload);
        self.picture.submit(&mut self.barriers, &mut self.timelines)?;
        self.timelines.wait_all()?;
        self.uploads.clear();
        Ok(())
    }

    /// An error if the last change of scene failed, or if there is no such volume image.
    fn check(&self, image: u32) -> Result<(), GpuError> {
        if let Some(fault) = &self.broken {
            return Err(GpuError::Broken(fault.clone()));
        }
        match image < self.volume_images {
            true => Ok(()),
            false => Err(GpuError::VolumeImage { image, images: self.volume_images }),
        }
    }

    /// Waits until the device is idle, and adds up the measured times.
    fn collect(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.timelines.wait_all()?;
        for entry in &mut self.ring {
            entry.collect(&self.timelines, &mut self.timings)?;
        }
        self.picture.collect(&self.timelines, &mut self.timings)
    }
}

impl Renderer {
    /// True if `scene` differs from the current one, ignoring fields that the device resolves.
    pub fn differs_from(&self, scene: &Scene) -> bool {
        (&scene.geometry, &scene.settings, scene.input, scene.visible_bounds, &scene.shared)
            != (
                &self.scene.geometry,
                &self.scene.settings,
                self.scene.input,
                self.scene.visible_bounds,
                &self.scene.shared,
            )
    }

    /// True if the last change of scene failed halfway: nothing can be drawn until another change succeeds.
    pub fn needs_rebuild(&self) -> bool {
        self.broken.is_some()
    }

    /// True if every pipeline of this scene is compiled. Those that are not are compiled in the background from now on, and
    /// [`RendererOptions::wake`] is called after each.
    ///
    /// # Errors
    /// A shader that does not compile, or a slot that the device cannot hold.
    pub fn prepare(&mut self, scene: &Scene) -> Result<bool, GpuError> {
        let scene = adapted(&self.context, self.texel_access, self.frames_at_once, scene.clone());
        let plan = Plan::new(&scene);
        formats::check(&self.context, &plan, &scene)?;
        self.compiler()?.prepare(&plan, &scene)
    }

    fn compiler(&mut self) -> Result<&mut AsyncPipelineCompiler, GpuError> {
        let compiler = match self.compiler.take() {
            Some(compiler) => compiler,
            None => AsyncPipelineCompiler::new(&self.pipelines, self.texel_access, self.wake.clone())?,
        };
        Ok(self.compiler.insert(compiler))
    }

    /// Compiles the pipelines of further scenes in the background while nothing else is to be compiled, in this order, instead of those
    /// asked for before. Scenes that this device cannot draw are left out.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn warm(&mut self, scenes: Vec<SceneMaker>) -> Result<(), GpuError> {
        self.compiler()?.warm(scenes);
        Ok(())
    }

    /// Forgets the scenes of [`Renderer::warm`] that are left. A pipeline in the making is finished.
    pub fn stop_warming(&self) {
        self.compiler.iter().for_each(AsyncPipelineCompiler::stop_warming);
    }

    /// True while pipelines of [`Renderer::warm`] are left to compile.
    pub fn is_warming(&self) -> bool {
        self.compiler.as_ref().is_some_and(AsyncPipelineCompiler::is_warming)
    }

    /// Changes the scene. The next picture runs the passes that this affects. If it returns [`Rerun::Everything`] or
    /// [`Rerun::Frames`], all frames have to be sent again first.
    ///
    /// # Errors
    /// If a shader does not compile or the device can never hold a slot, the old scene stays in use. If memory runs out
    /// halfway, nothing can be drawn until another change succeeds; that one rebuilds everything.
    pub fn change(&mut self, scene: Scene) -> Result<Rerun, GpuError> {
        // Frames that wait go through the stage 1 that they were sent to.
        self.flush()?;
        let mut scene = adapted(&self.context, self.texel_access, self.frames_at_once, scene.keeping(&self.scene));
        let plan = Plan::new(&scene);
        // After the visible region shrank, the volume still holds the larger one.
        let before = Scene { visible_bounds: self.filtered_bounds, ..self.scene.clone() };
        let rerun = if self.broken.is_some() { Rerun::Everything } else { plan.rerun(&before, &scene) };
        let sends_frames = !matches!(rerun, Rerun::Steps { .. });
        if sends_frames {
            scene.kept_bounds = VisibleBounds::default();
        }
        formats::check(&self.context, &plan, &scene)?;
        let steps = self.pipelines.of_plan(&plan, &scene)?;
        // Frames in flight use nothing that such a change touches, so only the picture is waited for.
        let touched = |slots: &[Slot]| {
            plan.steps_of(Frequency::Frame).any(|(_, s)| s.reads(&scene).iter().any(|r| slots.contains(r)))
        };
        // Frames in flight may run a pass that the new plan leaves out, such as that of packed neighbours for a picture with fewer rays: its
        // pipeline ends with the old plan.
        let old = self.plan.steps.iter().zip(&self.steps).filter(|(step, _)| step.pass.frequency != Frequency::Picture);
        let ends_a_pipeline = old.clone().any(|(_, old)| !steps.iter().any(|new| Arc::ptr_eq(old, new)));
        self.wait_presented()?;
        match &rerun {
            Rerun::Steps { slots, .. } if !touched(slots) && !ends_a_pipeline => self.wait_drawn()?,
            _ => self.collect()?,
        }
        // Of slots that are made again with the images, `fit` uploads the content.
        let changed: Vec<Slot> = match &rerun {
            Rerun::Steps { slots, .. } => slots.clone(),
            Rerun::Frames => plan.slots.iter().copied().filter(|s| s.differs(&self.scene, &scene)).collect(),
            Rerun::Everything => Vec::new(),
        };
        let kept: Vec<_> = self.plan.steps.iter().zip(&self.stale).filter(|s| *s.1).map(|s| s.0.id()).collect();
        self.stale = plan.steps.iter().map(|s| kept.contains(&s.id())).collect();
        // Of frames that were not sent, none may be counted on where smoothing across slices reaches further than it did for them.
        if sends_frames || scene.reach_across_slices() != self.scene.reach_across_slices() {
            self.filtered_bounds = scene.visible_bounds;
        }
        // Rays of smaller steps take longer than the last ones did, and so do cuts of more corners.
        for (step, pipeline) in plan.steps.iter().zip(&steps) {
            if step.pass.stage == Stage::Raycast {
                pipeline.time.lengthen(self.scene.step / scene.step);
            } else if step.writes(&scene).contains(&Slot::CutVolume) {
                pipeline.time.lengthen(scene.cut_corners() as f64 / self.scene.cut_corners().max(1) as f64);
            }
        }
        (self.plan, self.steps, self.scene) = (plan, steps, scene);
        self.broken = None;
        self.rebuild(&rerun, &changed).inspect_err(|error| self.broken = Some(error.to_string()))?;
        Ok(rerun)
    }

    /// Compiles the pipelines that use `shaders` again, because their source changed. Returns what has to run again, as
    /// [`Renderer::change`] does.
    ///
    /// # Errors
    /// A shader that does not exist, or that disagrees with the declaration of its pass. The previous pipelines stay.
    pub fn reload_shaders(&mut self, shaders: &HashSet<String>) -> Result<Rerun, GpuError> {
        if let Some(fault) = &self.broken {
            return Err(GpuError::Broken(fault.clone()));
        }
        // Its thread may be compiling the previous source.
        self.compiler = None;
        self.wait_presented()?;
        self.collect()?;
        self.steps = self.pipelines.recompile(shaders, &self.plan, &self.scene)?;
        let rerun = self.plan.rerun_shaders(&self.scene, |shader| shaders.contains(shader));
        self.rebuild(&rerun, &[]).inspect_err(|error| self.broken = Some(error.to_string()))?;
        Ok(rerun)
    }

    /// Waits until the last presentation has read the picture's image.
    fn wait_presented(&self) -> Result<(), GpuError> {
        self.timelines.of(0).wait(self.presented)
    }

    /// Prepares what has to run again. `changed`: the slots whose content the CPU makes differently of the current scene.
    fn rebuild(&mut self, rerun: &Rerun, changed: &[Slot]) -> Result<(), GpuError> {
        match rerun {
            Rerun::Steps { steps, .. } => {
                steps.iter().for_each(|i| self.stale[*i] = true);
                if steps.iter().any(|i| self.plan.steps[*i].pass.frequency == Frequency::Volume) {
                    self.invalidate_volumes();
                }
            }
            Rerun::Frames | Rerun::Everything => {
                self.found.clear();
                self.stale.iter_mut().for_each(|stale| *stale = true);
                self.invalidate_volumes();
                if *rerun == Rerun::Everything {
                    // The next frames may have another size.
                    self.incomplete += u64::from(self.partial.take().is_some());
                    self.batch = None;
                    self.slots.clear();
                    self.staging = Staging::new(&self.scene, self.context.candidate.max_buffer);
                    self.ring = self.new_ring()?;
                    self.ring_index = 0;
                }
            }
        }
        self.fit()?;
        self.found.retain(|(slot, _)| !changed.contains(slot));
        for slot in changed {
            self.fill(*slot)?;
        }
        if self.readback.as_ref().is_some_and(|r| r.size != Slot::Screen.bytes(&self.scene)) {
            self.readback = Some(readback(&self.context, &self.scene)?);
        }
        Ok(())
    }
}

impl Renderer {
    /// The current content of an image slot; of the volume all of it, zeros where nothing is stored. `None` for a slot that is not in the plan, and for a lookup table in a buffer.
    ///
    /// # Errors
    /// A device that fails; a failed change of scene.
    pub fn read(&mut self, slot: Slot) -> Result<Option<Texels>, GpuError> {
        let Some((readback, size, format)) = self.bring_back(slot)? else { return Ok(None) };
        let part = Texels::decode(size, format, &readback.bytes()?);
        // What is not stored of a volume is what no pass would have written.
        Ok(Some(part.with_outside(slot, &self.scene, 0.0)))
    }

    /// The current bytes of an image slot, its texels along x, y, z, and their format.
    pub(super) fn bring_back(&mut self, slot: Slot) -> Result<Option<(Readback, [usize; 3], Format)>, GpuError> {
        self.check(self.shown)?;
        self.flush()?;
        let Some(image) = self.slots.image(slot, self.shown) else { return Ok(None) };
        let buffer = Readback::new(&self.context, "read", image.shape, image.format.texel_bytes())?;
        let (format, size) = (image.format, image.shape.size());
        let copy = if slot.is_multibuffered() { self.shown } else { 0 };
        self.picture.collect(&self.timelines, &mut self.timings)?;
        self.picture.begin(&mut self.barriers, &self.timelines)?;
        self.picture.copy_out(&mut self.barriers, image, slot, copy, &buffer);
        self.picture.submit(&mut self.barriers, &mut self.timelines)?;
        let done = self.timelines.wait_all();
        if done.is_err() {
            // The copy may still be running: the buffer must outlive it.
            self.unread.push(buffer);
            return done.map(|()| None);
        }
        Ok(Some((buffer, size, format)))
    }

    /// Waits for the device, and returns the times of what [`RendererOptions::time_stamps`] selects since the last call, ns. Empty if the
    /// device has no time stamps.
    pub fn take_times(&mut self) -> Result<Vec<PassTime>, GpuError> {
        self.collect()?;
        Ok(self.timings.take_times())
    }

    /// Number of passes and copies since the last call that could not be timed: too many frames arrived while a picture was drawn.
    pub fn take_untimed(&mut self) -> u64 {
        self.timings.take_untimed()
    }

    /// As [`Renderer::take_times`], without waiting for work in flight.
    pub fn times_so_far(&mut self) -> Vec<PassTime> {
        self.timings.take_times()
    }

    /// Waits for the device, and returns every span since the last call, ns on the host's clock; empty without
    /// [`RendererOptions::spans`].
    pub fn take_spans(&mut self) -> Result<Vec<Span>, GpuError> {
        self.collect()?;
        Ok(self.timings.take_spans())
    }

    /// The largest error, ns, with which spans of the device were placed on the host's clock; `None` without spans, and if the device's
    /// clock cannot be read.
    pub fn clock_deviation(&self) -> Option<u64> {
        self.timings.clock_deviation()
    }

    /// The names of the passes that `work` dispatches, in order.
    pub fn dispatched_passes<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<&'static str>, GpuError> {
        Ok(self.dispatch_extents(work)?.into_iter().map(|(name, _)| name).collect())
    }

    /// The names of the passes that `work` dispatches, frames that it leaves waiting included, and their invocations along x, y, z; in
    /// bands, those of each band.
    pub fn dispatch_extents<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<(&'static str, [u32; 3])>, GpuError> {
        self.flush()?;
        self.barriers.dispatched = Some(Vec::new());
        let done = work(self).and_then(|done| self.flush().map(|()| done));
        let dispatched = self.barriers.dispatched.take().unwrap_or_default();
        done.map(|_| dispatched)
    }

    /// Number of frames so far that were not visible in their scene and were not uploaded.
    pub fn skipped_frames(&self) -> u64 {
        self.skipped
    }

    /// Number of barriers recorded so far.
    pub fn barriers(&self) -> u32 {
        self.barriers.count
    }

    /// Everything recorded and submitted so far, with [`RendererOptions::log`].
    pub fn log(&self) -> Option<&SubmissionLog> {
        self.barriers.log.as_ref()
    }

    /// Fault injection: leaves out the n-th barrier (1 is the first ever recorded).
    pub fn drop_barrier(&mut self, n: u32) {
        self.barriers.drop_barrier = Some(n);
    }
}

fn frame_bytes(scene: &Scene) -> u64 {
    Slot::Frames.bytes(scene) / u64::from(Slot::Frames.shape(scene).parts())
}

fn readback(context: &Arc<Context>, scene: &Scene) -> Result<Readback, GpuError> {
    Readback::new(context, "readback", Slot::Screen.shape(scene), Slot::Screen.format(scene).texel_bytes())
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.timelines.drain();
    }
}
