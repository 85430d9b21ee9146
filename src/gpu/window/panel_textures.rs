//! The textures of the panels: glyphs and pictures that egui reports as they change. They are copied by the command buffer that draws
//! the panels, so that nothing waits for the queue: a picture may take long, and egui adds a glyph at any time.

use crate::buffers::{Buffer, Purpose};
use crate::context::Context;
use crate::error::{ErrorContext, GpuError};
use crate::resources::{self, COLOUR, RawImage, image_barrier};
use ash::vk;
use egui::epaint::{ImageData, ImageDelta, Primitive};
use egui_ash_renderer::Renderer;
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::vulkan::{create_vulkan_descriptor_set, create_vulkan_descriptor_set_layout};
use half::f16;
use std::collections::HashMap;
use std::sync::Arc;

/// Number of textures at a time. egui has one for its glyphs, the panels one for each small picture: of looks, and of volumes of the loop.
const MAX_TEXTURES: u32 = 160;
/// Linear, with the precision of dark greys.
const FORMAT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// The library's shader raises what it reads to the power of 1 / 2.2. A texture in sRGB has another curve: dark greys would be 8 levels of 255 brighter.
const GAMMA: f64 = 2.2;

/// The textures of the panels, by egui's texture ids.
pub(super) struct PanelTextures {
    context: Arc<Context>,
    layout: vk::DescriptorSetLayout,
    sets: vk::DescriptorPool,
    sampler: vk::Sampler,
    textures: HashMap<egui::TextureId, Texture>,
    /// Copies that no command buffer has recorded yet, in order.
    pending: Vec<Upload>,
    /// What the command buffer in flight copies from.
    in_flight: Vec<Buffer>,
    /// Freed textures that the drawing in flight may still use.
    freed: Vec<egui::TextureId>,
}

struct Texture {
    image: RawImage,
    set: vk::DescriptorSet,
    /// The number under which the renderer draws it.
    drawn_as: egui::TextureId,
    /// A copy into it was recorded: it has a layout and content.
    is_filled: bool,
}

struct Upload {
    texture: egui::TextureId,
    staging: Buffer,
    at: [u32; 2],
    size: [u32; 2],
}

/// Converts an error of the library that draws the panels.
pub(super) fn failed(error: egui_ash_renderer::RendererError) -> GpuError {
    match error {
        egui_ash_renderer::RendererError::Vulkan(result) => {
            GpuError::Vulkan { operation: "draw the panels".into(), result }
        }
        other => GpuError::Window(format!("the panels cannot be drawn: {other}")),
    }
}

impl PanelTextures {
    pub(super) fn new(context: &Arc<Context>) -> Result<PanelTextures, GpuError> {
        let device = &context.device;
        let mut textures = PanelTextures {
            context: context.clone(),
            layout: create_vulkan_descriptor_set_layout(device).map_err(failed)?,
            sets: vk::DescriptorPool::null(),
            sampler: vk::Sampler::null(),
            textures: HashMap::new(),
            pending: Vec::new(),
            in_flight: Vec::new(),
            freed: Vec::new(),
        };
        let sizes =
            [vk::DescriptorPoolSize { ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER, descriptor_count: MAX_TEXTURES }];
        let pool = vk::DescriptorPoolCreateInfo::default()
            .pool_sizes(&sizes)
            .max_sets(MAX_TEXTURES)
            .flags(vk::DescriptorPoolCreateFlags::FREE_DESCRIPTOR_SET);
        // SAFETY: the create structure is complete; a failure drops `textures`, which frees what is made (null is allowed).
        let sets = unsafe { device.create_descriptor_pool(&pool, None) };
        textures.sets = sets.context(|| "create a descriptor pool".into())?;
        textures.sampler = resources::sampler(context, vk::Filter::LINEAR)?;
        Ok(textures)
    }

    /// Takes added and changed textures, and frees those that the last call listed as freed. Nothing drawn with them may be in flight.
    pub(super) fn take(
        &mut self,
        renderer: &mut Renderer<DefaultAllocator>,
        mut changes: egui::TexturesDelta,
    ) -> Result<(), GpuError> {
        self.in_flight.clear();
        for id in std::mem::take(&mut self.freed) {
            self.remove(renderer, id);
        }
        for (id, deltas) in changes.set.drain() {
            for delta in deltas {
                self.set(renderer, id, &delta)?;
            }
        }
        self.freed.extend(changes.free.drain());
        Ok(())
    }

    fn set(
        &mut self,
        renderer: &mut Renderer<DefaultAllocator>,
        id: egui::TextureId,
        delta: &ImageDelta,
    ) -> Result<(), GpuError> {
        let ImageData::Color(image) = &delta.image;
        let size = [image.width() as u32, image.height() as u32];
        let half = |value: f64| f16::from_f64(value).to_le_bytes();
        let share = |level: u8| f64::from(level) / 255.0;
        let linear: [[u8; 2]; 256] = std::array::from_fn(|level| half(share(level as u8).powf(GAMMA)));
        let texel = |colour: &egui::Color32| {
            let [red, green, blue, opacity] = colour.to_array();
            [linear[usize::from(red)], linear[usize::from(green)], linear[usize::from(blue)], half(share(opacity))]
        };
        let bytes: Vec<u8> = image.pixels.iter().flat_map(texel).flatten().collect();
        let at = match delta.pos {
            Some(at) => at.map(|n| n as u32),
            None => {
                self.remove(renderer, id);
                let texture = self.create(renderer, size)?;
                self.textures.insert(id, texture);
                [0; 2]
            }
        };
        let mut staging = Buffer::new(&self.context, "panel texture", bytes.len() as u64, Purpose::Staging)?;
        staging.write(0, &bytes);
        self.pending.push(Upload { texture: id, staging, at, size });
        Ok(())
    }

    fn create(&self, renderer: &mut Renderer<DefaultAllocator>, size: [u32; 2]) -> Result<Texture, GpuError> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::SAMPLED;
        let image = RawImage::flat(&self.context, "panel texture", FORMAT, size, usage)?;
        let device = &self.context.device;
        let set = create_vulkan_descriptor_set(device, self.layout, self.sets, image.views[0], self.sampler)
            .map_err(failed)?;
        Ok(Texture { image, set, drawn_as: renderer.add_user_texture(set), is_filled: false })
    }

    fn remove(&mut self, renderer: &mut Renderer<DefaultAllocator>, id: egui::TextureId) {
        self.pending.retain(|upload| upload.texture != id);
        if let Some(texture) = self.textures.remove(&id) {
            renderer.remove_user_texture(texture.drawn_as);
            // SAFETY: nothing drawn with the set is in flight. Freeing a set of such a pool cannot fail.
            let _ = unsafe { self.context.device.free_descriptor_sets(self.sets, &[texture.set]) };
        }
    }

    /// Replaces egui's texture ids in shapes by those under which the library draws the textures.
    pub(super) fn translate(&self, shapes: &mut [egui::ClippedPrimitive]) {
        for shape in shapes {
            if let Primitive::Mesh(mesh) = &mut shape.primitive
                && let Some(texture) = self.textures.get(&mesh.texture_id)
            {
                mesh.texture_id = texture.drawn_as;
            }
        }
    }

    /// Records the copies of all added and changed textures; outside dynamic rendering.
    pub(super) fn record(&mut self, commands: vk::CommandBuffer) {
        let device = &self.context.device;
        for Upload { texture, staging, at, size } in self.pending.drain(..) {
            let Some(texture) = self.textures.get_mut(&texture) else { continue };
            let (shown, copied) = (vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
            let read = (vk::PipelineStageFlags2::FRAGMENT_SHADER, vk::AccessFlags2::SHADER_SAMPLED_READ, shown);
            let written = (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE, copied);
            let turn = |from, to| {
                // SAFETY: the command buffer is being recorded, outside dynamic rendering; the image is alive.
                unsafe { image_barrier(device, commands, [texture.image.handle], from, to) };
            };
            let region = vk::BufferImageCopy::default()
                .image_subresource(COLOUR)
                .image_offset(vk::Offset3D { x: at[0] as i32, y: at[1] as i32, z: 0 })
                .image_extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 });
            // The memory of a new one may have been that of something else, which is done; layers before 2024 do not know it.
            let last = match texture.is_filled {
                true => (read.0, vk::AccessFlags2::NONE, shown),
                false => {
                    let all = vk::PipelineStageFlags2::ALL_COMMANDS;
                    (all, vk::AccessFlags2::MEMORY_WRITE, vk::ImageLayout::UNDEFINED)
                }
            };
            turn(last, written);
            // SAFETY: the staging buffer holds the bytes of the region, which egui places inside its texture; both live until the device
            // is done.
            unsafe {
                device.cmd_copy_buffer_to_image(commands, staging.handle, texture.image.handle, copied, &[region]);
            }
            turn(written, read);
            texture.is_filled = true;
            self.in_flight.push(staging);
        }
    }
}

impl Drop for PanelTextures {
    fn drop(&mut self) {
        self.textures.clear();
        // SAFETY: the owner waited for the device; null handles are allowed. The pool frees its sets.
        self.context.destroy(|device| unsafe {
            device.destroy_descriptor_pool(self.sets, None);
            device.destroy_descriptor_set_layout(self.layout, None);
            device.destroy_sampler(self.sampler, None);
        });
    }
}
