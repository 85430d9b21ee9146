//! The four stages on one device: frames go in, and pictures come out. Each batch of frames uses an entry of a ring (staging buffer, layers
//! of the frame array, command buffer), so that several are in flight. A picture runs only the passes whose inputs changed.

mod draw;
mod drawing;
mod ingest;
mod volumes;

use super::bands::Bands;
use super::buffers::Readback;
use super::command_recorder::Dispatch;
use super::context::Context;
use super::device_queues::DeviceQueues;
use super::error::GpuError;
use super::formats::TexelAccess;
use super::pipeline_compiler::{SceneMaker, Wake};
use super::pipelines::{Pipeline, Shaders, embedded};
use super::resources::SlotResources;
use super::scene_compiler::SceneCompiler;
use super::timing::TimeStamps;
use crate::passes::slots::{Format, Initializer, encoded};
use crate::passes::{DispatchArgs, Frequency, PassTime, Slot, Span, Stage, Texels};
use crate::plan::{Contents, Plan, Rerun, Step};
use crate::probe::Frame;
use crate::queues::MAX_QUEUES;
use crate::queues::oracle::SubmissionLog;
use crate::scene::{Scene, VisibleBounds};
use crate::tree::Defaults;
use drawing::Drawing;
use ingest::{Ring, frame_bytes};
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;
use volumes::Volumes;

/// How a [`Renderer`] works.
#[derive(Clone, Defaults)]
pub struct RendererOptions {
    /// Number of volume images, copies of the volume on the device: 1 for a still picture, 2 or 3 (double or triple buffering) while frames arrive
    /// during rendering.
    #[value(1)]
    pub volume_images: u32,
    /// Source of the SPIR-V of a shader. The default is the embedded shaders.
    #[value(embedded())]
    pub shaders: Arc<Shaders>,
    /// Records the span of time (begin and end) of each operation of host and device ([`Renderer::take_spans`]). If each pass is timed, shader
    /// invocations are counted, too.
    pub spans: bool,
    /// On a device that is the CPU, measures the CPU time of each pass ([`Renderer::take_cpu_times`]). Each pass is then submitted alone
    /// and waited for.
    pub cpu_times: bool,
    /// The operations that are timed on the device.
    pub time_stamps: TimeStamps,
    /// How dispatches over the volume and the picture are divided, so that no submission takes too long.
    pub bands: Bands,
    /// Holds back bands of a picture while the device has enough work, so that a window's panels can be drawn between them. [`Renderer::is_drawing`]
    /// submits them, and so does every wait. With several queues nothing is held back.
    pub paced: bool,
    /// How single texels are read. `None` selects the faster way on the device.
    pub texel_access: Option<TexelAccess>,
    /// Largest number of frames that go through stage 1 (the conversion of frames into the volume) at once, at least 1. `None` selects the best
    /// number for the device.
    pub frames_at_once: Option<u32>,
    /// Number of queues, 1..=3. `None` uses all queues of the device. If the device has fewer queues, several roles share one.
    pub queues: Option<usize>,
    /// True: every picture is copied to the host. False: pictures stay on the device, for presentation.
    #[value(true)]
    pub readback: bool,
    /// A function that is called after each pipeline that was compiled in the background for [`Renderer::prepare`].
    pub wake: Option<Wake>,
    /// Keeps a log of everything that is recorded and submitted ([`Renderer::log`]).
    pub log: bool,
}

impl RendererOptions {
    /// Makes the compiler of scenes that a renderer with these options uses.
    pub(super) fn compiler(&self, context: &Arc<Context>) -> Result<SceneCompiler, GpuError> {
        SceneCompiler::new(context, &self.shaders, self.texel_access, self.frames_at_once, self.wake.clone())
    }
}

/// A scene, with the fields that the device resolves, and what runs for it.
struct Program {
    scene: Scene,
    plan: Plan,
    /// By step of the plan.
    pipelines: Vec<Arc<Pipeline>>,
}

impl Program {
    /// A dispatch of a step.
    fn dispatch<'a>(&'a self, step: usize, slots: &'a SlotResources, args: &'a DispatchArgs) -> Dispatch<'a> {
        let pass = self.plan.steps[step].pass;
        Dispatch { slots, pipeline: &self.pipelines[step], scene: &self.scene, pass, args }
    }
}

/// Renders one scene: takes frames into volume images, and draws pictures of them. The scene can be changed at any time.
pub struct Renderer {
    // Fields are dropped in this order, after `drop` has waited for the device.
    ring: Ring,
    drawing: Drawing,
    slots: SlotResources,
    program: Program,
    compiler: SceneCompiler,
    queues: DeviceQueues,
    context: Arc<Context>,
    volumes: Volumes,
    /// By step of the plan: it has to run before the next picture.
    stale: Vec<bool>,
    /// The step that last wrote each slot.
    contents: Contents,
    /// The error that left the last change of scene incomplete.
    broken: Option<String>,
    /// Frames that are not visible in their scene.
    skipped: u64,
}

impl Renderer {
    /// Allocates the slots and compiles the pipelines that the scene needs.
    ///
    /// # Errors
    /// The device cannot hold a slot or a shader does not compile, which the error names, or the device fails.
    pub fn new(context: &Arc<Context>, scene: Scene, options: &RendererOptions) -> Result<Renderer, GpuError> {
        let compiler = options.compiler(context)?;
        let (scene, plan) = compiler.plan(scene);
        let pipelines = compiler.compile(&plan, &scene)?;
        let queues = options.queues.unwrap_or(context.queue_count()).clamp(1, MAX_QUEUES);
        let mut queues = DeviceQueues::new(context, queues, options.spans)?;
        queues.log = options.log.then(SubmissionLog::default);
        if options.cpu_times && context.candidate.is_software() {
            queues.timings.start_cpu();
        }
        let images = options.volume_images.max(1);
        let mut renderer = Renderer {
            ring: Ring::new(context, &scene, &queues, options.time_stamps, options.spans)?,
            drawing: Drawing::new(context, &scene, options, &mut queues)?,
            slots: SlotResources::new(context, images),
            stale: vec![true; plan.steps.len()],
            contents: Contents::new(),
            volumes: Volumes::new(images, &scene),
            program: Program { scene, plan, pipelines },
            compiler,
            queues,
            context: context.clone(),
            broken: None,
            skipped: 0,
        };
        renderer.fit()?;
        Ok(renderer)
    }

    /// The plan of the current scene: its passes and slots.
    pub fn plan(&self) -> &Plan {
        &self.program.plan
    }

    /// The current scene; its fields that depend on the device are set.
    pub fn scene(&self) -> &Scene {
        &self.program.scene
    }

    /// How single texels are read.
    pub fn texel_access(&self) -> TexelAccess {
        self.compiler.texel_access
    }

    /// Size of a frame of the current scene, bytes.
    pub fn frame_bytes(&self) -> usize {
        frame_bytes(&self.program.scene) as usize
    }

    /// Allocates and fills the slots that are missing. What passes over the volume and the picture wrote into those that were replaced has
    /// to be made again.
    fn fit(&mut self) -> Result<(), GpuError> {
        let Program { scene, plan, .. } = &self.program;
        let new = self.slots.fit(plan, scene)?;
        let is_new = |slot: &Slot| new.iter().any(|(made, _)| made == slot);
        self.volumes.keep_found(|slot| plan.slots.contains(&slot) && !is_new(&slot));
        let is_lost = |step: &Step| step.pass.frequency != Frequency::Frame && step.writes(scene).iter().any(is_new);
        let lost: Vec<_> = plan.steps.iter().enumerate().filter(|(_, step)| is_lost(step)).collect();
        lost.iter().for_each(|(i, _)| self.stale[*i] = true);
        if lost.iter().any(|(_, step)| step.pass.frequency == Frequency::Volume) {
            self.volumes.invalidate(scene);
        }
        self.drawing.clear(&mut self.queues, &self.slots, &new)?;
        if new.is_empty() {
            return Ok(());
        }
        for (slot, _) in new {
            self.fill(slot)?;
        }
        self.queues.timelines.wait_all()?;
        // The next frame may write what was cleared here.
        self.context.show_layer_the_wait()
    }

    /// Uploads a slot that the CPU computes from the scene. Nothing that reads it may be in flight.
    fn fill(&mut self, slot: Slot) -> Result<(), GpuError> {
        let Initializer::ByScene(make) = slot.initializer() else { return Ok(()) };
        let scene = &self.program.scene;
        if self.slots.image(slot, 0).is_none() {
            self.slots.fill(slot, scene);
            return Ok(());
        }
        let values = self.context.faults.table(slot, scene, make(scene));
        let texels = encoded(slot.format(scene), &values);
        self.drawing.upload(&mut self.queues, &self.slots, slot, &texels)
    }

    /// An error if the last change of scene failed, or if there is no such volume image.
    fn check(&self, image: u32) -> Result<(), GpuError> {
        if let Some(fault) = &self.broken {
            return Err(GpuError::Broken(fault.clone()));
        }
        self.volumes.check(image)
    }

    /// Waits until the device is idle, and adds up the measured times.
    fn collect(&mut self) -> Result<(), GpuError> {
        self.flush()?;
        self.queues.timelines.wait_all()?;
        self.ring.collect(&mut self.queues)?;
        self.drawing.collect(&mut self.queues)
    }
}

impl Renderer {
    /// Sends the frames of a volume to volume image 0, which the next picture shows.
    ///
    /// # Errors
    /// Those of [`Renderer::frame`] and [`Renderer::show`].
    pub fn volume<'a>(&mut self, frames: impl IntoIterator<Item = &'a Frame>) -> Result<(), GpuError> {
        for frame in frames {
            self.frame(frame.slice as u32, &frame.bytes, 0)?;
        }
        self.show(0)
    }

    /// Sends one frame to stage 1, which converts it into slice `slice` of the volume image with index `image`, both from 0. `bytes` are samples of
    /// the stored type, line by line. Returns when the bytes are copied, and waits only if all staging buffers are in use. A frame that is not
    /// visible in this scene is skipped and counted.
    ///
    /// Consecutive slices, up or down, go through stage 1 together. A frame waits for its successors until the batch is full, no visible
    /// slice can follow, another slice arrives, [`Renderer::submit_frames`] is called, the volume is read, or the scene changes.
    ///
    /// # Errors
    /// The frame has the wrong size, the slice or image does not exist, the device fails, or the last change of the scene failed.
    pub fn frame(&mut self, slice: u32, bytes: &[u8], image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        self.check_frame(slice as usize, bytes)?;
        self.volumes.filtered = self.program.scene.visible_bounds;
        if !self.program.scene.visible_frames().contains(&slice) {
            self.skipped += 1;
            return Ok(());
        }
        if !self.ring.continues(image, slice) {
            self.flush()?;
            self.ring.wait(&mut self.queues, self.drawing.is_in_flight)?;
        }
        let bytes = self.context.faults.changed_frame(&self.program.scene, bytes);
        self.ring.write(&mut self.queues, image, slice, &bytes);
        self.volumes.replaced(image, slice);
        if self.ring.is_complete(self.program.scene.visible_frames()) { self.flush() } else { Ok(()) }
    }

    /// Checks that a slice exists and that a frame has the right size.
    ///
    /// # Errors
    /// The slice does not exist, or the frame has not [`Renderer::frame_bytes`] bytes.
    pub fn check_frame(&self, slice: usize, bytes: &[u8]) -> Result<(), GpuError> {
        let (slices, expected) = (self.program.scene.slices(), self.frame_bytes());
        match (slice < slices as usize, bytes.len() == expected) {
            (false, _) => Err(GpuError::FrameSlice { slice, slices }),
            (_, false) => Err(GpuError::FrameSize { got: bytes.len(), expected }),
            _ => Ok(()),
        }
    }

    /// True if the next frame can be sent without waiting for the device.
    ///
    /// # Errors
    /// The device fails.
    pub fn takes_frame(&self) -> Result<bool, GpuError> {
        self.ring.is_free(&self.queues)
    }

    /// Submits the frames that wait for their successors, so that the device works on them until more arrive. Frames that are only copied
    /// stay in the batch: submitting a slice takes longer than copying it.
    ///
    /// # Errors
    /// The device fails.
    pub fn submit_frames(&mut self) -> Result<(), GpuError> {
        if self.ring.only_copies() { Ok(()) } else { self.flush() }
    }

    /// Submits the batch.
    fn flush(&mut self) -> Result<(), GpuError> {
        self.ring.flush(&mut self.queues, &self.slots, &self.program)
    }
}

impl Renderer {
    /// True if `scene` differs from the current one; fields that depend on the device are ignored.
    pub fn differs_from(&self, scene: &Scene) -> bool {
        let old = &self.program.scene;
        (&scene.geometry, &scene.settings, scene.input, scene.visible_bounds, &scene.shared)
            != (&old.geometry, &old.settings, old.input, old.visible_bounds, &old.shared)
    }

    /// True if the last change of the scene failed halfway. Nothing can be drawn until another change succeeds.
    pub fn needs_rebuild(&self) -> bool {
        self.broken.is_some()
    }

    /// True if every pipeline of this scene is compiled. Otherwise the missing ones are compiled in the background from now on, and
    /// [`RendererOptions::wake`] is called after each.
    ///
    /// # Errors
    /// A shader does not compile, the device cannot hold a slot, or the thread cannot be started.
    pub fn prepare(&mut self, scene: &Scene) -> Result<bool, GpuError> {
        self.compiler.prepare(scene)
    }

    /// Frees the renderer but not its compiled pipelines: until what is returned is dropped, a new renderer of the context finds them.
    pub fn into_pipelines(self) -> impl Sized {
        self.compiler.pipelines.clone()
    }

    /// Compiles the pipelines of further scenes in the background while no other pipeline is needed, in this order. They replace the scenes
    /// of an earlier call. Scenes that this device cannot draw are left out.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn warm(&mut self, scenes: Vec<SceneMaker>) -> Result<(), GpuError> {
        self.compiler.warm(scenes)
    }

    /// Drops the scenes of [`Renderer::warm`] that are left. A pipeline that is being compiled is finished.
    pub fn stop_warming(&self) {
        self.compiler.stop_warming();
    }

    /// True while pipelines of [`Renderer::warm`] are left to compile.
    pub fn is_warming(&self) -> bool {
        self.compiler.is_warming()
    }

    /// Changes the scene. The next picture runs the passes that the change affects. If this returns [`Rerun::Everything`] or
    /// [`Rerun::Frames`], all frames must be sent again first.
    ///
    /// # Errors
    /// If a shader does not compile or the device can never hold a slot, the old scene stays in use. If memory is exhausted or the
    /// device fails halfway, nothing can be drawn until another change succeeds, which rebuilds everything.
    pub fn change(&mut self, scene: Scene) -> Result<Rerun, GpuError> {
        // Frames that wait go through the stage 1 that they were sent to.
        self.flush()?;
        let old = &self.program;
        let (mut scene, plan) = self.compiler.plan(scene.keeping(&old.scene));
        // After the visible region shrank, the volume still holds the larger one.
        let before = Scene { visible_bounds: self.volumes.filtered, ..old.scene.clone() };
        let rerun = if self.broken.is_some() { Rerun::Everything } else { plan.rerun(&before, &scene) };
        let sends_frames = !matches!(rerun, Rerun::Steps { .. });
        if sends_frames {
            scene.kept_bounds = VisibleBounds::default();
        }
        let pipelines = self.compiler.compile(&plan, &scene)?;
        // Frames in flight use nothing that such a change touches, so only the picture is waited for.
        let touched = |slots: &[Slot]| {
            plan.steps_of(Frequency::Frame).any(|(_, s)| s.reads(&scene).iter().any(|r| slots.contains(r)))
        };
        // Frames in flight may run a pass that the new plan leaves out, such as that of packed neighbours for a picture with fewer rays: its
        // pipeline ends with the old plan.
        let steps = old.plan.steps.iter().zip(&old.pipelines);
        let mut of_frames = steps.filter(|(step, _)| step.pass.frequency != Frequency::Picture);
        let ends_a_pipeline = of_frames.any(|(_, old)| !pipelines.iter().any(|new| Arc::ptr_eq(old, new)));
        self.drawing.wait_presented(&self.queues)?;
        match &rerun {
            Rerun::Steps { slots, .. } if !touched(slots) && !ends_a_pipeline => self.wait_drawn()?,
            _ => self.collect()?,
        }
        let old = &self.program;
        // Of slots that are made again with the images, `fit` uploads the content.
        let changed: Vec<Slot> = match &rerun {
            Rerun::Steps { slots, .. } => slots.clone(),
            Rerun::Frames => plan.slots.iter().copied().filter(|s| s.differs(&old.scene, &scene)).collect(),
            Rerun::Everything => Vec::new(),
        };
        let kept: Vec<_> = old.plan.steps.iter().zip(&self.stale).filter(|s| *s.1).map(|s| s.0.id()).collect();
        self.stale = plan.steps.iter().map(|s| kept.contains(&s.id())).collect();
        // Of frames that were not sent, none may be counted on where smoothing across slices reaches further than it did for them.
        if sends_frames || scene.reach_across_slices() != old.scene.reach_across_slices() {
            self.volumes.filtered = scene.visible_bounds;
        }
        // Rays of smaller steps take longer than the last ones did, and so do cuts of more corners.
        for (step, pipeline) in plan.steps.iter().zip(&pipelines) {
            if step.pass.stage == Stage::Raycast {
                pipeline.time.lengthen(old.scene.step / scene.step);
            } else if step.writes(&scene).contains(&Slot::CutVolume) {
                pipeline.time.lengthen(scene.cut_corners() as f64 / old.scene.cut_corners().max(1) as f64);
            }
        }
        self.program = Program { scene, plan, pipelines };
        self.broken = None;
        self.rebuild(&rerun, &changed).inspect_err(|error| self.broken = Some(error.to_string()))?;
        Ok(rerun)
    }

    /// Compiles the pipelines that use `shaders` again, because the source of these shaders changed. Returns what must run again, as
    /// [`Renderer::change`] does.
    ///
    /// # Errors
    /// A shader does not exist, disagrees with the declaration of its pass, or is refused by the driver: the previous pipelines stay. The device
    /// fails, or the last change of the scene failed.
    pub fn reload_shaders(&mut self, shaders: &HashSet<String>) -> Result<Rerun, GpuError> {
        if let Some(fault) = &self.broken {
            return Err(GpuError::Broken(fault.clone()));
        }
        self.drawing.wait_presented(&self.queues)?;
        self.collect()?;
        let Program { scene, plan, pipelines } = &mut self.program;
        *pipelines = self.compiler.recompile(shaders, plan, scene)?;
        let rerun = plan.rerun_shaders(scene, |shader| shaders.contains(shader));
        self.rebuild(&rerun, &[]).inspect_err(|error| self.broken = Some(error.to_string()))?;
        Ok(rerun)
    }

    /// Prepares what has to run again. `changed`: the slots whose content the CPU makes differently of the current scene.
    fn rebuild(&mut self, rerun: &Rerun, changed: &[Slot]) -> Result<(), GpuError> {
        match rerun {
            Rerun::Steps { steps, .. } => {
                steps.iter().for_each(|i| self.stale[*i] = true);
                if steps.iter().any(|i| self.program.plan.steps[*i].pass.frequency == Frequency::Volume) {
                    self.volumes.invalidate(&self.program.scene);
                }
            }
            Rerun::Frames | Rerun::Everything => {
                self.volumes.keep_found(|_| false);
                self.stale.fill(true);
                self.volumes.invalidate(&self.program.scene);
                if *rerun == Rerun::Everything {
                    // The next frames may have another size.
                    self.slots.clear();
                    self.ring.restart(&self.program.scene, &self.queues)?;
                }
            }
        }
        self.fit()?;
        self.volumes.keep_found(|slot| !changed.contains(&slot));
        for slot in changed {
            self.fill(*slot)?;
        }
        self.drawing.fit(&self.program.scene)
    }
}

impl Renderer {
    /// Reads back the current content of an image slot; of a slot with a copy for each volume image, the copy that is shown. A volume is returned as
    /// a whole, with zeros where the device stores nothing. `None` for a slot that is not in the plan, and for a lookup table in a buffer.
    ///
    /// # Errors
    /// The device fails, or the last change of the scene failed.
    pub fn read(&mut self, slot: Slot) -> Result<Option<Texels>, GpuError> {
        let Some(readback) = self.bring_back(slot)? else { return Ok(None) };
        // What is not stored of a volume is what no pass would have written.
        Ok(Some(readback.texels()?.with_outside(slot, &self.program.scene, 0.0)))
    }

    /// The current texels of an image slot.
    fn bring_back(&mut self, slot: Slot) -> Result<Option<Readback>, GpuError> {
        let shown = self.volumes.shown;
        self.check(shown)?;
        self.flush()?;
        self.drawing.bring_back(&mut self.queues, &self.slots, (slot, shown))
    }

    /// Waits for the device, and returns the times, ns, since the last call of the operations that [`RendererOptions::time_stamps`] selects. Empty if
    /// the device has no time stamps.
    ///
    /// # Errors
    /// The device fails.
    pub fn take_times(&mut self) -> Result<Vec<PassTime>, GpuError> {
        self.collect()?;
        Ok(self.queues.timings.take_times())
    }

    /// Number of passes and copies since the last call that could not be timed, because too many frames arrived while a picture was drawn, or because
    /// one recording needed more time stamps than its queries hold.
    pub fn take_untimed(&mut self) -> u64 {
        std::mem::take(&mut self.queues.timings.untimed)
    }

    /// The times, ns, that were read since the last call of this or of [`Renderer::take_times`]. It does not wait: work in flight appears in a later
    /// call.
    pub fn times_so_far(&mut self) -> Vec<PassTime> {
        self.queues.timings.take_times()
    }

    /// Waits for the device, and returns every span since the last call, ns on the host's clock. Empty without [`RendererOptions::spans`].
    ///
    /// # Errors
    /// The device fails.
    pub fn take_spans(&mut self) -> Result<Vec<Span>, GpuError> {
        self.collect()?;
        Ok(self.queues.timings.take_spans())
    }

    /// CPU time of the passes since the last call, ns, one entry for each run. The time to record a pass is part of it. Empty without
    /// [`RendererOptions::cpu_times`], on a GPU, and if the system does not report CPU times.
    pub fn take_cpu_times(&mut self) -> Vec<(&'static str, f64)> {
        self.queues.timings.take_cpu()
    }

    /// Largest error of the position of device spans on the host's clock, ns. `None` without spans, before the first device span, and if the device's
    /// clock cannot be read.
    pub fn clock_deviation(&self) -> Option<u64> {
        self.queues.timings.clock_deviation()
    }

    /// Runs `work` and returns the names of the passes that it dispatches, in order, as [`Renderer::dispatch_extents`] does.
    ///
    /// # Errors
    /// `work` returns one, or the device fails.
    pub fn dispatched_passes<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<&'static str>, GpuError> {
        Ok(self.dispatch_extents(work)?.into_iter().map(|(name, _)| name).collect())
    }

    /// Runs `work` and returns the names of the passes that it dispatches, also for frames that it leaves waiting, with their invocations along x, y
    /// and z. With bands there is an entry for each band.
    ///
    /// # Errors
    /// `work` returns one, or the device fails.
    pub fn dispatch_extents<T>(
        &mut self,
        work: impl FnOnce(&mut Renderer) -> Result<T, GpuError>,
    ) -> Result<Vec<(&'static str, [u32; 3])>, GpuError> {
        self.flush()?;
        self.queues.dispatched = Some(Vec::new());
        let done = work(self).and_then(|done| self.flush().map(|()| done));
        let dispatched = self.queues.dispatched.take().unwrap_or_default();
        done.map(|_| dispatched)
    }

    /// Number of frames so far that were not visible in their scene and were not uploaded.
    pub fn skipped_frames(&self) -> u64 {
        self.skipped
    }

    /// Number of barriers that were needed so far. One that [`Renderer::drop_barrier`] leaves out counts too.
    pub fn barriers(&self) -> u32 {
        self.queues.count
    }

    /// The log of everything recorded and submitted so far. None without [`RendererOptions::log`].
    pub fn log(&self) -> Option<&SubmissionLog> {
        self.queues.log.as_ref()
    }

    /// Fault injection: leaves out the barrier with this number; 1 is the first one ever recorded.
    pub fn drop_barrier(&mut self, n: u32) {
        self.queues.drop_barrier = Some(n);
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.queues.timelines.drain();
    }
}
