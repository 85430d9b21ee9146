//! Draws the panels that egui laid out over the picture, with dynamic rendering.

use crate::gpu::context::Context;
use crate::gpu::error::{ErrorContext, GpuError};
use ash::vk;
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};
use std::sync::Arc;

/// The panels to draw, as egui lays them out.
#[derive(Default)]
pub struct Panels {
    pub shapes: Vec<egui::ClippedPrimitive>,
    /// Textures (also of glyphs) that were added, changed or freed since the last frame. egui reports each only once, so none may be
    /// skipped.
    pub textures: egui::TexturesDelta,
    /// Pixels per point.
    pub scale: f32,
}

impl Drop for Panels {
    fn drop(&mut self) {
        // egui panics if undrawn changes are left. Whoever has a screen again lays the panels out again with all textures.
        self.textures.clear();
    }
}

/// The renderer of the panels.
pub struct Overlay {
    context: Arc<Context>,
    // Taken in `drop`, before the pool is destroyed.
    renderer: Option<Renderer<DefaultAllocator>>,
    /// For uploads of textures.
    pool: vk::CommandPool,
    /// Freed textures that the drawing in flight may still use.
    freed: Vec<egui::TextureId>,
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
    /// `format`: the format of the images that it draws on.
    pub fn new(context: &Arc<Context>, format: vk::Format) -> Result<Overlay, GpuError> {
        let create = vk::CommandPoolCreateInfo::default()
            .queue_family_index(context.queue(0).family)
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY: the create structure is complete.
        let pool = unsafe { context.device.create_command_pool(&create, None) }.context(|| "create commands".into())?;
        let mut overlay = Overlay { context: context.clone(), renderer: None, pool, freed: Vec::new() };
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

    /// Uploads added and changed textures, and frees those that the last call listed as freed. Nothing drawn with it may be in flight.
    pub fn take_textures(&mut self, mut textures: egui::TexturesDelta) -> Result<(), GpuError> {
        let (Some(renderer), pool) = (&mut self.renderer, self.pool) else { return Ok(()) };
        self.freed.drain(..).try_for_each(|id| renderer.free_texture(id)).map_err(failed)?;
        for (id, deltas) in textures.set.drain() {
            for delta in deltas {
                // This waits on the queue for the upload.
                self.context.on_queue(|queue| renderer.set_texture(queue, pool, id, &delta)).map_err(failed)?;
            }
        }
        self.freed.extend(textures.free.drain());
        Ok(())
    }

    /// Records the drawing, inside dynamic rendering to an image of this size, pixels.
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
