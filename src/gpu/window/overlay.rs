//! Panels over a picture: what egui laid out, drawn with dynamic rendering.

use crate::gpu::context::Context;
use crate::gpu::error::{ErrorContext, GpuError};
use ash::vk;
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};
use std::sync::Arc;

/// What there is to draw, as egui lays it out.
#[derive(Default)]
pub struct Panels {
    pub shapes: Vec<egui::ClippedPrimitive>,
    /// Images, letters among them, that came, changed or went since the last time. They must all be drawn with: each is told once.
    pub textures: egui::TexturesDelta,
    /// Pixels of the screen for one of its points.
    pub scale: f32,
}

impl Drop for Panels {
    fn drop(&mut self) {
        // Undrawn: whoever has a screen again lays them out anew, and is told of every image. egui panics where some are left.
        self.textures.clear();
    }
}

pub struct Overlay {
    context: Arc<Context>,
    // Taken in `drop`, before the pool goes.
    renderer: Option<Renderer<DefaultAllocator>>,
    /// Of the copies that bring images in.
    pool: vk::CommandPool,
    /// Images that what is being drawn may still use for the last time.
    going: Vec<egui::TextureId>,
}

fn failed(error: egui_ash_renderer::RendererError) -> GpuError {
    match error {
        egui_ash_renderer::RendererError::Vulkan(result) => {
            GpuError::Vulkan { operation: "draw the panels".into(), result }
        }
        other => GpuError::Window(format!("the panels cannot be drawn: {other}")),
    }
}

impl Overlay {
    /// `format`: of the images that it draws on.
    pub fn new(context: &Arc<Context>, format: vk::Format) -> Result<Overlay, GpuError> {
        let create = vk::CommandPoolCreateInfo::default()
            .queue_family_index(context.queue(0).family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the create structure is complete.
        let pool = unsafe { context.device.create_command_pool(&create, None) }.context(|| "create commands".into())?;
        let mut overlay = Overlay { context: context.clone(), renderer: None, pool, going: Vec::new() };
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let (instance, device) = (&context.instance, context.device.clone());
        let made =
            Renderer::with_default_allocator(instance, context.candidate.handle, device, mode, Options::default());
        overlay.renderer = Some(made.map_err(failed)?);
        Ok(overlay)
    }

    /// Takes the images that came or changed, and forgets those that went the last time. Nothing drawn with it may be in flight.
    pub fn take_textures(&mut self, mut textures: egui::TexturesDelta) -> Result<(), GpuError> {
        let (Some(renderer), pool) = (&mut self.renderer, self.pool) else { return Ok(()) };
        self.going.drain(..).try_for_each(|id| renderer.free_texture(id)).map_err(failed)?;
        for (id, deltas) in textures.set.drain() {
            for delta in deltas {
                // It waits for the copy on the queue itself.
                self.context.on_queue(|queue| renderer.set_texture(queue, pool, id, &delta)).map_err(failed)?;
            }
        }
        self.going.extend(textures.free.drain());
        Ok(())
    }

    /// Records the drawing, inside dynamic rendering onto an image of this size.
    pub fn record(&mut self, commands: vk::CommandBuffer, size: [u32; 2], panels: &Panels) -> Result<(), GpuError> {
        let extent = vk::Extent2D { width: size[0], height: size[1] };
        match &mut self.renderer {
            Some(renderer) => renderer.cmd_draw(commands, extent, panels.scale, &panels.shapes).map_err(failed),
            None => Ok(()),
        }
    }
}

impl Drop for Overlay {
    fn drop(&mut self) {
        self.renderer = None;
        // SAFETY: its owner waited for the device.
        unsafe { self.context.device.destroy_command_pool(self.pool, None) };
    }
}
