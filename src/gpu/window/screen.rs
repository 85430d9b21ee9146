//! Presents a picture and panels: composes them, and copies them into the next image of the swapchain. One such drawing is in flight at a
//! time, because a copy and a few triangles take little time compared with a picture.

use super::PresentMode;
use super::composition::{self, Composition};
use super::panel_textures::{PanelTextures, failed};
use super::swapchain::{Swapchain, SwapchainImage};
use super::target::{Target, choose_monitor};
use crate::barriers::{Access, PipelineStage};
use crate::context::Context;
use crate::device_queues::DeviceQueues;
use crate::error::{ErrorContext, GpuError};
use crate::formats;
use crate::passes::Slot;
use crate::resources::{COLOUR, Image, Side, WHOLE, image_barrier};
use ash::vk;
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time-out for acquiring an image of the window, ns. A window that is covered or unplugged may never provide one.
const ACQUIRE_TIMEOUT_NS: u64 = 100_000_000;
/// The colour around the picture, which is the background of the panels.
const BACKGROUND: [f32; 4] = [0.035, 0.04, 0.05, 1.0];

/// The result of presenting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PresentOutcome {
    Presented,
    /// Nothing can be presented now: the window is minimised or covered, or its monitor is disconnected.
    NotPresentable,
}

/// The picture of a renderer that is to be presented, and the queues that order its use among the renderer's work.
pub struct Drawn<'a> {
    pub image: &'a Image,
    pub(crate) queues: &'a mut DeviceQueues,
    /// The upper left corner of the picture in the window, pixels.
    pub at: [u32; 2],
    /// True if the screen keeps a copy of the picture, to show it again while the next one is drawn.
    pub is_kept: bool,
}

/// What is shown beside the panels.
enum Content<'a> {
    Nothing,
    Picture(Drawn<'a>),
    /// The picture that was kept, with its upper left corner here.
    Kept([u32; 2]),
}

/// A window or monitor on which pictures are presented.
pub struct Screen {
    // Fields are dropped in this order, after `drop` has waited for the device.
    overlay: Option<Overlay>,
    /// Picture and panels together. None without panels, where the picture is copied to the window at once.
    composition: Option<Composition>,
    /// A copy of the last picture that was presented, in layout GENERAL, where it is shown again while the next one is drawn.
    kept: Option<Image>,
    chain: Swapchain,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    /// Signalled when the acquired image may be written.
    free: vk::Semaphore,
    /// Signalled when the last drawing is done.
    done: vk::Fence,
    /// When the last drawing was submitted.
    submitted: Instant,
    context: Arc<Context>,
    /// The swapchain no longer matches the surface.
    stale: bool,
    /// The surface was lost.
    lost: bool,
    /// An image was acquired but not presented, so its semaphore cannot be used again.
    unused_acquire: bool,
    wanted: [u32; 2],
    shown: u64,
}

impl Screen {
    /// Makes a screen on `target`. `size`: width and height of the window, pixels; ignored for a monitor.
    ///
    /// # Errors
    /// The device cannot present on the target, or fails.
    pub fn new(
        context: &Arc<Context>,
        target: Target,
        size: [u32; 2],
        present_mode: PresentMode,
    ) -> Result<Screen, GpuError> {
        let chain = Swapchain::new(context, target, present_mode)?;
        let device = &context.device;
        let mut screen = Screen {
            overlay: None,
            composition: None,
            kept: None,
            chain,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            free: vk::Semaphore::null(),
            done: vk::Fence::null(),
            submitted: Instant::now(),
            context: context.clone(),
            stale: true,
            lost: false,
            unused_acquire: false,
            wanted: size,
            shown: 0,
        };
        let create = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue(0).family);
        // SAFETY: the create structures are complete; a failure drops `screen`, which frees what is made (null is allowed).
        unsafe {
            screen.pool = device.create_command_pool(&create, None).context(|| "create commands".into())?;
            let allocate = vk::CommandBufferAllocateInfo::default().command_pool(screen.pool).command_buffer_count(1);
            screen.commands = device.allocate_command_buffers(&allocate).context(|| "create commands".into())?[0];
            let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
            screen.done = device.create_fence(&signalled, None).context(|| "create a fence".into())?;
            screen.free = device.create_semaphore(&Default::default(), None).context(|| "create a semaphore".into())?;
        }
        context.name(screen.commands, "window");
        Ok(screen)
    }

    /// Width and height of the images that are presented, pixels; 0 before the first.
    pub fn size(&self) -> [u32; 2] {
        self.chain.size
    }

    /// Sets the size of the window, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.stale |= size != self.wanted || size != self.chain.size;
        self.wanted = size;
    }

    /// Number of presented images.
    pub fn shown(&self) -> u64 {
        self.shown
    }

    /// The times from handing a picture to the presentation to its first pixel on the monitor, as measured since the last call. Empty if the device
    /// cannot measure them.
    pub fn take_latencies(&mut self) -> Vec<Duration> {
        self.chain.take_latencies()
    }

    /// Presents panels without a picture.
    ///
    /// # Errors
    /// The device fails, or a lost surface cannot be recreated.
    pub fn show(&mut self, panels: Option<Panels>) -> Result<PresentOutcome, GpuError> {
        self.show_with(Content::Nothing, panels)
    }

    /// Presents a picture and panels over it. If the picture is in flight, the device waits for it.
    ///
    /// # Errors
    /// The device fails, or a lost surface cannot be recreated.
    pub(crate) fn show_picture(&mut self, drawn: Drawn, panels: Option<Panels>) -> Result<PresentOutcome, GpuError> {
        self.show_with(Content::Picture(drawn), panels)
    }

    /// Presents the picture of which a copy was kept ([`Drawn::is_kept`]), with its upper left corner at pixel `at` of the window, and panels over
    /// it; without a copy only the panels.
    ///
    /// # Errors
    /// The device fails, or a lost surface cannot be recreated.
    pub fn show_kept(&mut self, at: [u32; 2], panels: Option<Panels>) -> Result<PresentOutcome, GpuError> {
        self.show_with(Content::Kept(at), panels)
    }

    fn show_with(&mut self, mut content: Content, mut panels: Option<Panels>) -> Result<PresentOutcome, GpuError> {
        self.wait()?;
        if let Content::Picture(drawn) = &content {
            // What is held back of the picture comes before its copy.
            drawn.queues.timelines.release()?;
            let (shape, format) = drawn.image.layout();
            if drawn.is_kept && self.kept.as_ref().is_none_or(|kept| kept.layout() != (shape, format)) {
                self.kept = None;
                self.kept = Some(Image::new(&self.context, Slot::Screen, shape, format)?);
            }
        }
        if let Some(panels) = &mut panels {
            if self.overlay.is_none() {
                self.overlay = Some(Overlay::new(&self.context, self.chain.format)?);
            }
            // What shows a texture that changed is drawn again.
            let has_new_textures = !panels.textures.set.is_empty() || !panels.textures.free.is_empty();
            if let Some(composition) = self.composition.as_mut().filter(|_| has_new_textures) {
                composition.content = None;
            }
            // Also if nothing can be presented: each change is reported only once.
            if let Some(overlay) = &mut self.overlay {
                overlay.textures.take(&mut overlay.renderer, std::mem::take(&mut panels.textures))?;
                overlay.textures.translate(&mut panels.shapes);
            }
        }
        // Tries again if the swapchain turns out to be out of date.
        for _ in 0..2 {
            if !self.fit()? {
                return Ok(PresentOutcome::NotPresentable);
            }
            match self.chain.acquire(ACQUIRE_TIMEOUT_NS, self.free) {
                Ok(image) => {
                    self.unused_acquire = true;
                    let picture = self.draw(image, &mut content, panels.as_ref())?;
                    self.unused_acquire = false;
                    if let (Some(composition), Some(picture), Some(panels)) =
                        (&mut self.composition, picture, &mut panels)
                    {
                        let (shapes, scale) = (std::mem::take(&mut panels.shapes), panels.scale);
                        composition.content = Some(composition::Content { shapes, scale, picture });
                    }
                    return self.present(image);
                }
                Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(PresentOutcome::NotPresentable),
                Err(result) => self.note(result)?,
            }
        }
        Ok(PresentOutcome::NotPresentable)
    }

    /// Notes an error of the surface. What can be recreated is recreated at the next call.
    fn note(&mut self, result: vk::Result) -> Result<(), GpuError> {
        match result {
            vk::Result::ERROR_OUT_OF_DATE_KHR => self.stale = true,
            vk::Result::ERROR_SURFACE_LOST_KHR | vk::Result::ERROR_FULL_SCREEN_EXCLUSIVE_MODE_LOST_EXT => {
                (self.lost, self.stale) = (true, true);
            }
            result => return Err(GpuError::Vulkan { operation: "show a picture".into(), result }),
        }
        Ok(())
    }

    fn present(&mut self, image: u32) -> Result<PresentOutcome, GpuError> {
        match self.chain.present(image) {
            Ok(unfit) => self.stale |= unfit,
            Err(result) => {
                self.note(result)?;
                return Ok(PresentOutcome::NotPresentable);
            }
        }
        self.shown += 1;
        Ok(PresentOutcome::Presented)
    }

    /// Waits for the last drawing.
    fn wait(&self) -> Result<(), GpuError> {
        self.context.wait_fence(self.done, self.submitted, "draw on the window")
    }

    /// Recreates what no longer matches the surface; false if nothing can be presented.
    fn fit(&mut self) -> Result<bool, GpuError> {
        if self.lost {
            self.chain.renew_surface()?;
            // Another surface may need another format.
            self.overlay = None;
            self.lost = false;
            return Ok(false);
        }
        if !(self.stale || self.unused_acquire) {
            return Ok(true);
        }
        self.context.wait_idle()?;
        if self.unused_acquire {
            // SAFETY: the device is idle.
            unsafe {
                self.context.device.destroy_semaphore(self.free, None);
                self.free = vk::Semaphore::null();
                let made = self.context.device.create_semaphore(&Default::default(), None);
                self.free = made.context(|| "create a semaphore".into())?;
            }
            self.unused_acquire = false;
        }
        match self.chain.fit(self.wanted) {
            Ok(fits) => {
                self.stale = !fits;
                Ok(fits)
            }
            Err(GpuError::Vulkan { result, .. }) if result == vk::Result::ERROR_SURFACE_LOST_KHR => {
                self.lost = true;
                Ok(false)
            }
            Err(error) => Err(error),
        }
    }

    /// Makes the composition fit the window, and returns what it holds, which is not known from here on.
    fn fit_composition(&mut self, has_panels: bool) -> Result<Option<composition::Content>, GpuError> {
        let (format, size) = (self.chain.format, self.chain.size);
        // Its last drawing is done.
        let fits = |composition: &Composition| (composition.format, composition.size) == (format, size);
        self.composition = self.composition.take().filter(|composition| has_panels && fits(composition));
        if has_panels && self.composition.is_none() {
            self.composition = Some(Composition::new(&self.context, format, size)?);
        }
        Ok(self.composition.as_mut().and_then(|composition| composition.content.take()))
    }

    /// Composes and submits. Returns where the picture is in the composition, pixels: corner and size; None without a picture.
    fn draw(
        &mut self,
        image: u32,
        content: &mut Content,
        panels: Option<&Panels>,
    ) -> Result<Option<[[u32; 2]; 2]>, GpuError> {
        let (device, commands) = (self.context.device.clone(), self.commands);
        let (size, format) = (self.chain.size, self.chain.format);
        let last = self.fit_composition(panels.is_some())?;
        let SwapchainImage { handle: shown, drawn: after } = self.chain.images[image as usize];
        let target = self.composition.as_ref().map_or(shown, |composition| composition.image.handle);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the last drawing is done, so the pool's only command buffer is free.
        unsafe {
            device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .and_then(|()| device.begin_command_buffer(commands, &begin))
        }
        .context(|| "record the window".into())?;
        let is_laid_out = self.composition.as_ref().is_some_and(|composition| composition.is_laid_out);
        let mut at = match (is_laid_out, &self.composition) {
            (true, _) => Stage::Composed,
            (false, Some(_)) => Stage::New,
            (false, None) => Stage::Acquired,
        };
        let mut go = |to: Stage| {
            barrier(&device, commands, target, at, to);
            at = to;
        };
        go(Stage::Copied);
        let picture = match (&*content, &self.kept) {
            (Content::Picture(drawn), _) => Some((drawn.image, drawn.at)),
            (Content::Kept(at), Some(kept)) => Some((kept, *at)),
            (Content::Kept(_), None) | (Content::Nothing, _) => None,
        };
        let region = picture.map(|(from, at)| region(from, at, size));
        let place = picture.zip(region).map(|((_, at), (_, covered))| [at, covered]);
        // Where the panels beside the picture stay, they are not drawn.
        let damage = match (last, place, panels) {
            (Some(last), Some(place), Some(panels)) => last.damage(&panels.shapes, panels.scale, place, size),
            _ => None,
        };
        if damage.is_none() && region.is_none_or(|(_, [w, h])| [w, h] != size) {
            let colour = vk::ClearColorValue { float32: BACKGROUND };
            let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            // SAFETY: the image is in this layout since the barrier above.
            unsafe { device.cmd_clear_color_image(commands, target, layout, &colour, &[WHOLE]) };
            go(Stage::Copied);
        }
        if let Content::Picture(drawn) = content {
            drawn.queues.begin(0);
            let read = Access::of_slot(Slot::Screen, 0, 0..drawn.image.shape.parts(), false, PipelineStage::Copy);
            drawn.queues.before(&self.context, 0, commands, &[read]);
        }
        let mut is_converted = false;
        let visible = region.filter(|(_, [w, h])| *w > 0 && *h > 0);
        if let (Some((from, _)), Some((region, _))) = (picture, visible) {
            is_converted = formats::vulkan(from.format) != format;
            put(&device, commands, from, target, region, is_converted);
        }
        let mut queued = None;
        if let Content::Picture(drawn) = content {
            if let Some(kept) = self.kept.as_ref().filter(|_| drawn.is_kept) {
                drawn.image.copy_to(&device, commands, kept);
            }
            queued = Some(&mut *drawn.queues);
        }
        if let (Some(panels), Some(overlay), Some(composition)) = (panels, &mut self.overlay, &self.composition) {
            overlay.textures.record(commands);
            go(Stage::Drawn);
            let area = vk::Rect2D { extent: vk::Extent2D { width: size[0], height: size[1] }, ..Default::default() };
            let colour = [vk::RenderingAttachmentInfo::default()
                .image_view(composition.image.views[0])
                .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .load_op(vk::AttachmentLoadOp::LOAD)
                .store_op(vk::AttachmentStoreOp::STORE)];
            let rendering = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colour);
            // SAFETY: the view is alive and its image in this layout; what is recorded between is egui's drawing alone.
            unsafe { device.cmd_begin_rendering(commands, &rendering) };
            if let Some(damage) = &damage {
                clear(&device, commands, &damage.cleared);
            }
            let shapes = damage.as_ref().map_or(&panels.shapes, |damage| &damage.shapes);
            let recorded = overlay.record(commands, size, shapes, panels.scale);
            // SAFETY: ends what was begun above.
            unsafe { device.cmd_end_rendering(commands) };
            recorded?;
        }
        match &self.composition {
            None => go(Stage::Shown),
            Some(_) => {
                go(Stage::Composed);
                barrier(&device, commands, shown, Stage::Acquired, Stage::Copied);
                let (from, to) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
                let extent = vk::Extent3D { width: size[0], height: size[1], depth: 1 };
                let whole = [vk::ImageCopy::default().src_subresource(COLOUR).dst_subresource(COLOUR).extent(extent)];
                // SAFETY: both images are alive, of this size and of one format, and in these layouts since the barriers above.
                unsafe { device.cmd_copy_image(commands, target, from, shown, to, &whole) };
                barrier(&device, commands, shown, Stage::Copied, Stage::Shown);
            }
        }
        if panels.is_some() {
            let how = if is_converted { "converted" } else { "as it is" };
            let beside = match &damage {
                Some(damage) => damage.cleared.iter().map(|[from, to]| (to[0] - from[0]) * (to[1] - from[1])).sum(),
                None => size[0] * size[1],
            };
            tracing::debug!("window: the picture {how}, {beside} pixels of panels");
        }
        // SAFETY: the command buffer is being recorded.
        unsafe { device.end_command_buffer(commands) }.context(|| "record the window".into())?;
        self.submit(after, queued)?;
        if let Some(composition) = &mut self.composition {
            composition.is_laid_out = true;
        }
        Ok(place)
    }

    fn submit(&mut self, drawn: vk::Semaphore, queued: Option<&mut DeviceQueues>) -> Result<(), GpuError> {
        let everything = vk::PipelineStageFlags2::ALL_COMMANDS;
        let semaphore = |handle| vk::SemaphoreSubmitInfo::default().semaphore(handle);
        let mut waits = vec![semaphore(self.free).stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)];
        let mut signals = vec![semaphore(drawn).stage_mask(everything)];
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let mut after = Vec::new();
        if let Some(queues) = &queued {
            after = queues.tracker.waits(0);
            let wait = |w: &crate::queues::Wait| {
                semaphore(queues.timelines.0[w.queue].semaphore).value(w.value).stage_mask(everything)
            };
            waits.extend(after.iter().map(wait));
            // Later work of the renderer waits for this too.
            let timeline = &queues.timelines.0[0];
            signals.push(semaphore(timeline.semaphore).value(timeline.submitted + 1).stage_mask(everything));
        }
        let submit = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals);
        // SAFETY: its last submission is done.
        unsafe { self.context.device.reset_fences(&[self.done]) }.context(|| "reset a fence".into())?;
        self.submitted = Instant::now();
        let sent = self.context.submit(0, &submit, self.done, || "submit 'window'".into());
        sent.inspect_err(|_| {
            // No submission in flight would signal the fence: an empty one does. If that fails too, the device is lost and nothing waits for it.
            // SAFETY: the fence is not in use.
            let _ = self.context.on_queue(|queue| unsafe { self.context.device.queue_submit2(queue, &[], self.done) });
        })?;
        if let Some(queues) = queued {
            queues.timelines.0[0].advance("window");
            queues.submitted(0, &after, queues.timelines.0[0].submitted);
        }
        Ok(())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // A device that was lost is idle.
        let _ = self.context.wait_idle();
        if self.context.is_given_up() {
            // egui's renderer would destroy what the device still uses.
            std::mem::forget(self.overlay.take());
            return;
        }
        (self.overlay, self.composition) = (None, None);
        // SAFETY: the device is idle; null handles are allowed.
        unsafe {
            self.context.device.destroy_command_pool(self.pool, None);
            self.context.device.destroy_semaphore(self.free, None);
            self.context.device.destroy_fence(self.done, None);
        }
    }
}

/// Size of a target without a window, pixels: that of the chosen monitor mode, or of the surface that nobody sees.
///
/// # Errors
/// There is no such monitor or mode, or the context was not opened for this target.
pub fn fixed_size(context: &Context, target: &Target) -> Result<[u32; 2], GpuError> {
    let choice = match target {
        Target::Monitor(choice) => choice,
        Target::Unseen(size) => return Ok(*size),
        Target::Window(_) => return Err(GpuError::Window("the size of a window is its own".into())),
    };
    let displays = context.presentation.as_ref().and_then(|p| p.displays.as_ref());
    let displays = displays.ok_or_else(|| GpuError::Window("the device was not opened for a monitor".into()))?;
    let region = choose_monitor(displays, context.candidate.handle, choice)?.mode.parameters.visible_region;
    Ok([region.width, region.height])
}

/// The copy of a picture to pixel `at` of a window of this size, and the size that it covers. Pictures are cropped, never scaled.
fn region(image: &Image, at: [u32; 2], size: [u32; 2]) -> (vk::ImageCopy, [u32; 2]) {
    let from = [image.extent.width, image.extent.height];
    let [w, h] = std::array::from_fn(|i| from[i].min(size[i].saturating_sub(at[i])));
    let copy = vk::ImageCopy {
        src_subresource: COLOUR,
        dst_subresource: COLOUR,
        dst_offset: vk::Offset3D { x: at[0] as i32, y: at[1] as i32, z: 0 },
        extent: vk::Extent3D { width: w, height: h, depth: 1 },
        ..Default::default()
    };
    (copy, [w, h])
}

/// Records the copy of a picture in layout GENERAL into an image of the window in layout TRANSFER_DST_OPTIMAL. If their formats differ, a blit converts it,
/// which takes a software device ten times as long.
fn put(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    from: &Image,
    to: vk::Image,
    copy: vk::ImageCopy,
    is_converted: bool,
) {
    let (layout, target) = (vk::ImageLayout::GENERAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
    let (corner, extent) = (copy.dst_offset, copy.extent);
    let [width, height] = [extent.width as i32, extent.height as i32];
    let blit = vk::ImageBlit {
        src_subresource: copy.src_subresource,
        src_offsets: [vk::Offset3D::default(), vk::Offset3D { x: width, y: height, z: 1 }],
        dst_subresource: copy.dst_subresource,
        dst_offsets: [corner, vk::Offset3D { x: corner.x + width, y: corner.y + height, z: 1 }],
    };
    // SAFETY: both images are alive and in these layouts; the region is inside both. A copy is between images of one format.
    unsafe {
        match is_converted {
            false => device.cmd_copy_image(commands, from.handle, layout, to, target, &[copy]),
            true => device.cmd_blit_image(commands, from.handle, layout, to, target, &[blit], vk::Filter::NEAREST),
        }
    };
}

/// Fills areas (from, to) of what is drawn to with the background, inside dynamic rendering.
fn clear(device: &ash::Device, commands: vk::CommandBuffer, areas: &[[[u32; 2]; 2]]) {
    if areas.is_empty() {
        return;
    }
    let rects = areas.iter().map(|[from, to]| {
        let offset = vk::Offset2D { x: from[0] as i32, y: from[1] as i32 };
        let extent = vk::Extent2D { width: to[0] - from[0], height: to[1] - from[1] };
        vk::ClearRect { rect: vk::Rect2D { offset, extent }, base_array_layer: 0, layer_count: 1 }
    });
    let rects: Vec<_> = rects.collect();
    let clear_value = vk::ClearValue { color: vk::ClearColorValue { float32: BACKGROUND } };
    let background =
        [vk::ClearAttachment { aspect_mask: vk::ImageAspectFlags::COLOR, color_attachment: 0, clear_value }];
    // SAFETY: the command buffer is being recorded, inside dynamic rendering to one attachment; the areas are inside it and none is empty.
    unsafe { device.cmd_clear_attachments(commands, &background, &rects) };
}

/// The stages of an image of the window, in order.
#[derive(Clone, Copy)]
enum Stage {
    /// Nothing is in it. Its memory may have been that of something else, which is done; layers before 2024 do not know it.
    New,
    Acquired,
    Copied,
    Drawn,
    /// It is copied to the window.
    Composed,
    Shown,
}

impl Stage {
    /// Pipeline stages, accesses and layout of an image in this stage.
    fn side(self) -> Side {
        use vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as P};
        match self {
            Stage::New => (P::ALL_COMMANDS, A::MEMORY_WRITE, L::UNDEFINED),
            // The stage of the wait for the semaphore of the acquired image.
            Stage::Acquired => (P::ALL_TRANSFER, A::NONE, L::UNDEFINED),
            Stage::Copied => (P::ALL_TRANSFER, A::TRANSFER_WRITE, L::TRANSFER_DST_OPTIMAL),
            Stage::Drawn => {
                let accesses = A::COLOR_ATTACHMENT_WRITE | A::COLOR_ATTACHMENT_READ;
                (P::COLOR_ATTACHMENT_OUTPUT, accesses, L::COLOR_ATTACHMENT_OPTIMAL)
            }
            Stage::Composed => (P::ALL_TRANSFER, A::TRANSFER_READ, L::TRANSFER_SRC_OPTIMAL),
            // The stage of the semaphore that presentation waits for.
            Stage::Shown => (P::ALL_COMMANDS, A::NONE, L::PRESENT_SRC_KHR),
        }
    }
}

/// Records the transition of a window's image from one stage to another.
fn barrier(device: &ash::Device, commands: vk::CommandBuffer, image: vk::Image, from: Stage, to: Stage) {
    // SAFETY: the command buffer is being recorded, outside dynamic rendering; the image was acquired.
    unsafe { image_barrier(device, commands, [image], from.side(), to.side()) };
}

/// The panels to draw, as egui lays them out.
#[derive(Default)]
pub struct Panels {
    pub shapes: Vec<egui::ClippedPrimitive>,
    /// Textures (also of glyphs) that were added, changed or freed since the last frame. egui reports each change only once, so none may be
    /// skipped.
    pub textures: egui::TexturesDelta,
    /// Pixels of the window per point of egui.
    pub scale: f32,
}

impl Drop for Panels {
    fn drop(&mut self) {
        // egui panics if undrawn changes are left. Whoever has a screen again lays the panels out again with all textures.
        self.textures.clear();
    }
}

/// Draws the panels that egui laid out over the picture, with dynamic rendering.
struct Overlay {
    renderer: Renderer<DefaultAllocator>,
    textures: PanelTextures,
}

impl Overlay {
    /// `format`: the format of the images that it draws on.
    fn new(context: &Arc<Context>, format: vk::Format) -> Result<Overlay, GpuError> {
        let textures = PanelTextures::new(context)?;
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let (instance, device) = (&context.instance, context.device.clone());
        let made =
            Renderer::with_default_allocator(instance, context.candidate.handle, device, mode, Options::default());
        Ok(Overlay { renderer: made.map_err(failed)?, textures })
    }

    /// Records the drawing, inside dynamic rendering to an image of this size, pixels.
    fn record(
        &mut self,
        commands: vk::CommandBuffer,
        size: [u32; 2],
        shapes: &[egui::ClippedPrimitive],
        scale: f32,
    ) -> Result<(), GpuError> {
        let extent = vk::Extent2D { width: size[0], height: size[1] };
        self.renderer.cmd_draw(commands, extent, scale, shapes).map_err(failed)
    }
}
