//! Images that own their memory, and the images and buffers of the slots in a scene's plan.

use super::buffers::{Buffer, Purpose, SlotParts};
use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::formats;
use super::memory::{Reserve, free, reserve};
use crate::passes::Slot;
use crate::passes::slots::{Format, Initializer, Shape, ring_entry_end};
use crate::plan::Plan;
use crate::scene::Scene;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::collections::BTreeMap;
use std::sync::Arc;

/// An image of the device, its memory and its views.
pub(crate) struct RawImage {
    context: Arc<Context>,
    pub handle: vk::Image,
    pub views: Vec<vk::ImageView>,
    allocation: Option<Allocation>,
}

impl RawImage {
    /// Makes an image with a single mip level in layout UNDEFINED, with views of these ranges. `operation`: for errors.
    ///
    /// # Errors
    /// Memory is exhausted, or the device fails.
    fn new(
        context: &Arc<Context>,
        name: &str,
        create: vk::ImageCreateInfo,
        (kind, ranges): (vk::ImageViewType, impl IntoIterator<Item = vk::ImageSubresourceRange>),
        operation: &dyn Fn() -> String,
    ) -> Result<RawImage, GpuError> {
        let create = create.mip_levels(1).samples(vk::SampleCountFlags::TYPE_1).tiling(vk::ImageTiling::OPTIMAL);
        let device = &context.device;
        // SAFETY: the create structure is complete and its pointers live; limits and formats of slots were checked for the plan.
        let handle = unsafe { device.create_image(&create, None) }.context(operation)?;
        // From here on, dropping `image` cleans up after a failure.
        let mut image = RawImage { context: context.clone(), handle, views: Vec::new(), allocation: None };
        // SAFETY: the image was just made by this device.
        let requirements = unsafe { device.get_image_memory_requirements(handle) };
        let wanted = Reserve { name, requirements, location: MemoryLocation::GpuOnly, linear: false };
        let allocation = reserve(context, wanted, operation)?;
        // SAFETY: the allocation fits the requirements and lives as long as the image.
        let bound = unsafe { device.bind_image_memory(handle, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound.context(operation)?;
        for range in ranges {
            let create = vk::ImageViewCreateInfo::default()
                .image(handle)
                .view_type(kind)
                .format(create.format)
                .subresource_range(range);
            // SAFETY: the image is bound to memory and alive.
            let view = unsafe { device.create_image_view(&create, None) };
            let view = view.context(|| format!("create a view of image '{name}'"))?;
            context.name(view, name);
            image.views.push(view);
        }
        context.name(handle, name);
        Ok(image)
    }

    /// Makes a 2D image in layout UNDEFINED, with one view.
    ///
    /// # Errors
    /// The device has no memory for it, or fails.
    #[cfg(feature = "view")]
    pub fn flat(
        context: &Arc<Context>,
        name: &'static str,
        format: vk::Format,
        [width, height]: [u32; 2],
        usage: vk::ImageUsageFlags,
    ) -> Result<RawImage, GpuError> {
        let create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .array_layers(1)
            .usage(usage);
        let views = (vk::ImageViewType::TYPE_2D, [WHOLE]);
        RawImage::new(context, name, create, views, &|| format!("create a {name} ({width}x{height})"))
    }
}

/// The image of a slot.
pub struct Image {
    /// Its first view is of the complete image, all layers included. That of the frame array has another one for each layer: from that layer to the
    /// last one of its ring entry. A batch of frames begins with the first layer of its view. Validation assumes that every layer of a view is read, so a
    /// view contains no layers of other entries, which may be being written.
    pub(crate) raw: RawImage,
    /// That of `raw`.
    pub handle: vk::Image,
    pub extent: vk::Extent3D,
    pub shape: Shape,
    pub format: Format,
}

impl Image {
    /// Makes an image of a slot, in layout UNDEFINED.
    ///
    /// # Errors
    /// Memory is exhausted, or the device fails.
    pub fn new(context: &Arc<Context>, slot: Slot, shape: Shape, format: Format) -> Result<Image, GpuError> {
        let (kind, view_kind, [width, height, depth], layers) = match shape {
            Shape::Two([w, h]) => (vk::ImageType::TYPE_2D, vk::ImageViewType::TYPE_2D, [w, h, 1], 1),
            Shape::Layers([w, h, n]) => (vk::ImageType::TYPE_2D, vk::ImageViewType::TYPE_2D_ARRAY, [w, h, 1], n),
            Shape::Three(size) => (vk::ImageType::TYPE_3D, vk::ImageViewType::TYPE_3D, size, 1),
            Shape::Buffer(_) => {
                return Err(GpuError::Memory {
                    operation: format!("create image '{}'", slot.name()),
                    fault: "the slot is a buffer".into(),
                });
            }
        };
        let mebibytes = shape.texels() * format.texel_bytes() as u64 / (1 << 20);
        let operation = || {
            format!(
                "create image '{}' ({width}x{height}x{} {format:?}, {mebibytes} MiB)",
                slot.name(),
                depth.max(layers)
            )
        };
        let extent = vk::Extent3D { width, height, depth };
        let mut create = vk::ImageCreateInfo::default()
            .image_type(kind)
            .format(formats::vulkan(format))
            .extent(extent)
            .array_layers(layers)
            .usage(formats::usage(context, slot));
        if slot.crosses_queues() && context.queue_families.len() > 1 {
            create = create.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(&context.queue_families);
        }
        let from_layer = |layer| {
            let count = ring_entry_end(layers, layer) - layer;
            vk::ImageSubresourceRange { base_array_layer: layer, layer_count: count, ..WHOLE }
        };
        let batches = (0..layers).filter(|_| slot == Slot::Frames).map(from_layer);
        let views = (view_kind, std::iter::once(WHOLE).chain(batches));
        let raw = RawImage::new(context, slot.name(), create, views, &operation)?;
        tracing::debug!("image '{}': {width}x{height}x{} {format:?}, {mebibytes} MiB", slot.name(), depth.max(layers));
        Ok(Image { handle: raw.handle, raw, extent, shape, format })
    }

    /// Records a copy of the complete image to `to`, an image of the same shape and format that nothing in flight uses. This image must be in layout
    /// GENERAL and written before a barrier for copies. Afterwards `to` is in layout GENERAL, and its content is visible to copies.
    #[cfg(feature = "view")]
    pub(super) fn copy_to(&self, device: &ash::Device, commands: vk::CommandBuffer, to: &Image) {
        let (stage, general) = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::ImageLayout::GENERAL);
        let barrier = |from: vk::ImageLayout, [before, after]: [vk::AccessFlags2; 2]| {
            // SAFETY: the command buffer is being recorded; the image is alive.
            unsafe { image_barrier(device, commands, [to.handle], (stage, before, from), (stage, after, general)) };
        };
        let copy = [vk::ImageCopy::default().src_subresource(COLOUR).dst_subresource(COLOUR).extent(self.extent)];
        // The last copy is done; older layers do not know it.
        let write = vk::AccessFlags2::TRANSFER_WRITE;
        barrier(vk::ImageLayout::UNDEFINED, [write, write]);
        // SAFETY: both images are alive, in these layouts, and of one size and format.
        unsafe { device.cmd_copy_image(commands, self.handle, general, to.handle, general, &copy) };
        barrier(general, [write, vk::AccessFlags2::TRANSFER_READ]);
    }

    /// The image's shape and format.
    pub fn layout(&self) -> (Shape, Format) {
        (self.shape, self.format)
    }

    /// All parts of the image, which is that of this slot for this volume image.
    pub(crate) fn all_parts(&self, (slot, image): (Slot, u32)) -> SlotParts {
        SlotParts { slot, copy: copy_of(slot, image), parts: 0..self.shape.parts() }
    }
}

/// Which copy of a slot belongs to a volume image.
fn copy_of(slot: Slot, image: u32) -> u32 {
    if slot.is_multibuffered() { image } else { 0 }
}

/// The first layer of an image, for copies.
pub(crate) const COLOUR: vk::ImageSubresourceLayers = vk::ImageSubresourceLayers {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    mip_level: 0,
    base_array_layer: 0,
    layer_count: 1,
};

/// One side of a barrier: stages, their accesses, and the layout of the images.
pub(crate) type Side = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// Records a barrier of complete images.
///
/// # Safety
/// The command buffer is being recorded, outside dynamic rendering; the images are alive.
pub(crate) unsafe fn image_barrier(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    images: impl IntoIterator<Item = vk::Image>,
    from: Side,
    to: Side,
) {
    let barrier = vk::ImageMemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)
        .old_layout(from.2)
        .new_layout(to.2)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(WHOLE);
    let barriers: Vec<_> = images.into_iter().map(|image| barrier.image(image)).collect();
    let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: as of this function.
    unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
}

/// The subresource range of all layers of a color image's only mip level.
pub const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: vk::REMAINING_ARRAY_LAYERS,
};

/// A sampler that takes the texel at the edge for places beyond it.
///
/// # Errors
/// The device fails.
pub(crate) fn sampler(context: &Context, filter: vk::Filter) -> Result<vk::Sampler, GpuError> {
    let create = vk::SamplerCreateInfo::default()
        .mag_filter(filter)
        .min_filter(filter)
        .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
        .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE)
        .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE);
    // SAFETY: the create structure is complete.
    unsafe { context.device.create_sampler(&create, None) }.context(|| "create sampler".into())
}

impl Drop for RawImage {
    fn drop(&mut self) {
        self.context.destroy(|device| {
            // SAFETY: whoever drops an image has waited for the device to be done with it.
            unsafe {
                self.views.iter().for_each(|view| device.destroy_image_view(*view, None));
                device.destroy_image(self.handle, None);
            }
            free(&self.context, self.allocation.take());
        });
    }
}

/// The image or buffer of a slot.
pub enum Resource {
    Image(Image),
    Buffer(Buffer),
}

/// The images and buffers of all slots, by slot and index of the volume image.
pub(crate) struct SlotResources {
    context: Arc<Context>,
    resources: BTreeMap<(Slot, u32), Resource>,
    /// Number of volume images.
    images: u32,
}

impl SlotResources {
    pub fn new(context: &Arc<Context>, images: u32) -> SlotResources {
        SlotResources { context: context.clone(), resources: BTreeMap::new(), images }
    }

    /// Allocates the slots of the plan that are missing or have another shape, and frees those that it does not need. Returns the new images (slot,
    /// index of the volume image), which are in layout UNDEFINED. They must be cleared, which moves them to GENERAL, before their first use.
    ///
    /// # Errors
    /// The device cannot hold a slot; then nothing new is kept.
    pub fn fit(&mut self, plan: &Plan, scene: &Scene) -> Result<Vec<(Slot, u32)>, GpuError> {
        formats::check(&self.context, plan, scene)?;
        self.resources.retain(|(slot, _), resource| plan.slots.contains(slot) && resource.matches(*slot, scene));
        let mut made = BTreeMap::new();
        for &slot in &plan.slots {
            let copies = if slot.is_multibuffered() { self.images } else { 1 };
            for key in (0..copies).map(|copy| (slot, copy)).filter(|key| !self.resources.contains_key(key)) {
                made.insert(key, Resource::new(&self.context, slot, scene)?);
            }
        }
        let is_image = |resource: &Resource| matches!(resource, Resource::Image(_));
        let new = made.iter().filter(|(_, resource)| is_image(resource)).map(|(key, _)| *key).collect();
        let tables: Vec<Slot> = made.iter().filter(|(_, resource)| !is_image(resource)).map(|(key, _)| key.0).collect();
        self.resources.extend(made);
        tables.into_iter().for_each(|slot| self.fill(slot, scene));
        Ok(new)
    }

    /// Writes the content of a slot that the CPU computes from the scene, if the slot is a buffer. Images are uploaded through staging buffers
    /// instead.
    pub fn fill(&mut self, slot: Slot, scene: &Scene) {
        if let (Initializer::ByScene(make), Some(Resource::Buffer(buffer))) =
            (slot.initializer(), self.resources.get_mut(&(slot, 0)))
        {
            let values = self.context.faults.table(slot, scene, make(scene));
            buffer.write(0, bytemuck::cast_slice(&values));
        }
    }

    /// The image or buffer of a slot; for a multibuffered slot, the copy of volume image `image`.
    ///
    /// # Panics
    /// If the plan has no such slot. A plan lists every slot that its passes declare.
    pub fn get(&self, slot: Slot, image: u32) -> &Resource {
        let key = (slot, copy_of(slot, image));
        match self.resources.get(&key) {
            Some(resource) => resource,
            None => panic!("slot '{}' {} is not in the plan", slot.name(), key.1),
        }
    }

    pub fn image(&self, slot: Slot, image: u32) -> Option<&Image> {
        match self.resources.get(&(slot, copy_of(slot, image))) {
            Some(Resource::Image(image)) => Some(image),
            _ => None,
        }
    }

    pub(crate) fn buffer_mut(&mut self, slot: Slot) -> Option<&mut Buffer> {
        match self.resources.get_mut(&(slot, 0)) {
            Some(Resource::Buffer(buffer)) => Some(buffer),
            _ => None,
        }
    }

    /// Frees all slots.
    pub fn clear(&mut self) {
        self.resources.clear();
    }
}

impl Resource {
    fn new(context: &Arc<Context>, slot: Slot, scene: &Scene) -> Result<Resource, GpuError> {
        match slot.shape(scene) {
            Shape::Buffer(bytes) => {
                Buffer::new(context, slot.name(), bytes.into(), Purpose::Table).map(Resource::Buffer)
            }
            shape => Image::new(context, slot, shape, slot.format(scene)).map(Resource::Image),
        }
    }

    /// True if it has the shape and format that the slot has in a scene.
    fn matches(&self, slot: Slot, scene: &Scene) -> bool {
        match self {
            Resource::Image(image) => image.layout() == (slot.shape(scene), slot.format(scene)),
            Resource::Buffer(buffer) => Shape::Buffer(buffer.size as u32) == slot.shape(scene),
        }
    }
}
