//! Images and buffers that own their memory, and those of the slots in a scene's plan.

use super::context::Context;
use super::error::{ErrorContext, GpuError};
use super::faults::InjectionPoint;
use super::formats;
use crate::passes::Slot;
use crate::passes::slots::{Format, Initializer, Shape};
use crate::plan::Plan;
use crate::scene::Scene;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// An image, its memory and its views.
pub struct Image {
    context: Arc<Context>,
    pub handle: vk::Image,
    /// A view of the complete image.
    pub view: vk::ImageView,
    /// A view of each layer of an array: frames are read through these.
    pub layers: Vec<vk::ImageView>,
    pub extent: vk::Extent3D,
    pub shape: Shape,
    pub format: Format,
    allocation: Option<Allocation>,
}

/// A buffer and its memory, mapped as long as it lives.
pub struct Buffer {
    context: Arc<Context>,
    pub handle: vk::Buffer,
    pub size: u64,
    /// For a lookup table: views with texels of one, two and four floats.
    texels: [vk::BufferView; 3],
    allocation: Option<Allocation>,
}

/// The purpose of a buffer. It decides the kind of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A lookup table that shaders read.
    Table,
    /// Uniform numbers of passes, written by the CPU.
    Params,
    /// Data to upload, written by the CPU.
    Staging,
    /// Results to download, read by the CPU.
    Readback,
}

pub(super) fn allocate(
    context: &Context,
    name: &str,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
    operation: &dyn Fn() -> String,
) -> Result<Allocation, GpuError> {
    context.faults.check(InjectionPoint::Allocate).context(operation)?;
    context.counts.allocations.fetch_add(1, Ordering::Relaxed);
    let mut allocator = context.allocator.lock().unwrap_or_else(|e| e.into_inner());
    let Some(allocator) = allocator.as_mut() else {
        return Err(GpuError::Memory { operation: operation(), fault: "the context is shutting down".into() });
    };
    if let Some(budget) = context.memory_budget() {
        let required = match location {
            MemoryLocation::GpuOnly => vk::MemoryPropertyFlags::DEVICE_LOCAL,
            _ => vk::MemoryPropertyFlags::HOST_VISIBLE,
        };
        let check =
            |reserve| budget.check(operation, requirements.size, requirements.memory_type_bits, required, reserve);
        // What is allocated and free is only added up where it decides.
        if check(0).is_err() {
            let report = allocator.generate_report();
            check(report.total_capacity_bytes.saturating_sub(report.total_allocated_bytes))?;
        }
    }
    allocator
        .allocate(&AllocationCreateDesc {
            name,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        })
        .map_err(|e| GpuError::Memory { operation: operation(), fault: e.to_string() })
}

pub(super) fn free(context: &Context, allocation: Option<Allocation>) {
    let mut allocator = context.allocator.lock().unwrap_or_else(|e| e.into_inner());
    if let (Some(allocator), Some(allocation)) = (allocator.as_mut(), allocation) {
        // Freeing an allocation of this allocator cannot fail, and a Drop could not report it.
        let _ = allocator.free(allocation);
    }
}

impl Image {
    /// An image in layout UNDEFINED.
    ///
    /// # Errors
    /// Out of memory; a device that fails.
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
            .mip_levels(1)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(formats::usage(context, slot));
        if slot.crosses_queues() && context.queue_families.len() > 1 {
            create = create.sharing_mode(vk::SharingMode::CONCURRENT).queue_family_indices(&context.queue_families);
        }
        let device = &context.device;
        // SAFETY: the create structure is complete and its pointers live; limits and formats were checked for the plan.
        let handle = unsafe { device.create_image(&create, None) }.context(operation)?;
        // From here on, dropping `image` cleans up after a failure.
        let mut image = Image {
            context: context.clone(),
            handle,
            view: vk::ImageView::null(),
            layers: Vec::new(),
            extent,
            shape,
            format,
            allocation: None,
        };
        // SAFETY: the image was just made by this device.
        let requirements = unsafe { device.get_image_memory_requirements(handle) };
        let allocation = allocate(context, slot.name(), requirements, MemoryLocation::GpuOnly, false, &operation)?;
        // SAFETY: the allocation fits the requirements and lives as long as the image.
        let bound = unsafe { device.bind_image_memory(handle, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound.context(operation)?;
        image.view = image.create_view(slot.name(), view_kind, 0, layers)?;
        if let Shape::Layers(_) = shape {
            for layer in 0..layers {
                let view = image.create_view(slot.name(), vk::ImageViewType::TYPE_2D, layer, 1)?;
                image.layers.push(view);
            }
        }
        context.name(handle, slot.name());
        tracing::debug!("image '{}': {width}x{height}x{} {format:?}, {mebibytes} MiB", slot.name(), depth.max(layers));
        Ok(image)
    }

    fn create_view(
        &self,
        name: &str,
        kind: vk::ImageViewType,
        layer: u32,
        layers: u32,
    ) -> Result<vk::ImageView, GpuError> {
        let range = vk::ImageSubresourceRange { base_array_layer: layer, layer_count: layers, ..WHOLE };
        let create = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(kind)
            .format(formats::vulkan(self.format))
            .subresource_range(range);
        // SAFETY: the image is bound to memory and alive.
        let view = unsafe { self.context.device.create_image_view(&create, None) };
        let view = view.context(|| format!("create a view of image '{name}'"))?;
        self.context.name(view, name);
        Ok(view)
    }
}

/// All layers of the only mip level.
pub const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: vk::REMAINING_ARRAY_LAYERS,
};

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: whoever drops an image has waited for the device to be done with it; null handles are allowed.
        unsafe {
            for view in self.layers.drain(..).chain([self.view]) {
                self.context.device.destroy_image_view(view, None);
            }
            self.context.device.destroy_image(self.handle, None);
        }
        free(&self.context, self.allocation.take());
    }
}

const TEXELS: [vk::Format; 3] = [vk::Format::R32_SFLOAT, vk::Format::R32G32_SFLOAT, vk::Format::R32G32B32A32_SFLOAT];

/// True if a lookup table of this size can be a texel buffer, for any size of its entries.
pub fn has_texels(context: &Context, bytes: u64) -> bool {
    bytes >= 16 && bytes / 4 <= u64::from(context.limits.max_texel_buffer_elements)
}

impl Buffer {
    pub fn new(context: &Arc<Context>, name: &str, size: u64, purpose: Purpose) -> Result<Buffer, GpuError> {
        let operation = || format!("create buffer '{name}' ({} KiB)", size.div_ceil(1024));
        let (usage, location) = match purpose {
            Purpose::Table => (
                vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER,
                MemoryLocation::CpuToGpu,
            ),
            Purpose::Params => (vk::BufferUsageFlags::UNIFORM_BUFFER, MemoryLocation::CpuToGpu),
            Purpose::Staging => (vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu),
            Purpose::Readback => (vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu),
        };
        if size > context.candidate.max_bytes {
            return Err(GpuError::Limit { what: operation(), needed: size, allowed: context.candidate.max_bytes });
        }
        let create = vk::BufferCreateInfo::default().size(size.max(4)).usage(usage);
        let device = &context.device;
        // SAFETY: the create structure is complete.
        let handle = unsafe { device.create_buffer(&create, None) }.context(operation)?;
        let mut buffer =
            Buffer { context: context.clone(), handle, size, texels: Default::default(), allocation: None };
        // SAFETY: the buffer was just made by this device.
        let requirements = unsafe { device.get_buffer_memory_requirements(handle) };
        let allocation = allocate(context, name, requirements, location, true, &operation)?;
        // SAFETY: the allocation fits the requirements and lives as long as the buffer.
        let bound = unsafe { device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) };
        buffer.allocation = Some(allocation);
        bound.context(operation)?;
        context.name(handle, name);
        if let Some(poison) = context.faults.poisoned() {
            buffer.bytes_mut().fill(poison.byte);
        }
        if purpose == Purpose::Table && has_texels(context, size) {
            for (n, format) in TEXELS.into_iter().enumerate() {
                let create = vk::BufferViewCreateInfo::default().buffer(handle).format(format).range(vk::WHOLE_SIZE);
                // SAFETY: the buffer is bound to memory and alive; every device has these formats as texel buffers.
                buffer.texels[n] = unsafe { device.create_buffer_view(&create, None) }.context(operation)?;
                context.name(buffer.texels[n], name);
            }
        }
        Ok(buffer)
    }

    /// The view of a lookup table with texels of 1, 2 or 4 floats.
    pub fn texels(&self, components: u32) -> vk::BufferView {
        self.texels[components.ilog2().min(2) as usize]
    }

    /// The mapped bytes. Buffers of every purpose are visible to the host.
    pub fn bytes(&self) -> &[u8] {
        let bytes = self.allocation.as_ref().and_then(|a| a.mapped_slice()).unwrap_or(&[]);
        &bytes[..bytes.len().min(self.size as usize)]
    }

    pub fn bytes_mut(&mut self) -> &mut [u8] {
        let size = self.size as usize;
        let bytes = self.allocation.as_mut().and_then(|a| a.mapped_slice_mut()).unwrap_or(&mut []);
        let end = bytes.len().min(size);
        &mut bytes[..end]
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: whoever drops a buffer has waited for the device to be done with it; null handles are allowed.
        unsafe {
            for view in self.texels {
                self.context.device.destroy_buffer_view(view, None);
            }
            self.context.device.destroy_buffer(self.handle, None);
        }
        free(&self.context, self.allocation.take());
    }
}

/// The memory of a slot.
pub enum Resource {
    Image(Image),
    Buffer(Buffer),
}

/// The allocated slots, by slot and number of the volume image.
pub struct SlotResources {
    context: Arc<Context>,
    resources: BTreeMap<(Slot, u32), Resource>,
    /// Number of volume images.
    images: u32,
}

impl SlotResources {
    pub fn new(context: &Arc<Context>, images: u32) -> SlotResources {
        SlotResources { context: context.clone(), resources: BTreeMap::new(), images }
    }

    /// Allocates the slots of the plan that are missing or have another shape, and frees those that it does not need. New images are
    /// in layout UNDEFINED. They are returned and must be cleared, which moves them to GENERAL, before their first use.
    ///
    /// # Errors
    /// A slot that the device cannot hold; then nothing new is kept.
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

    /// Writes a slot that the CPU computes from the scene, if it is a buffer. Images are uploaded through staging instead.
    pub fn fill(&mut self, slot: Slot, scene: &Scene) {
        if let (Initializer::ByScene(make), Some(Resource::Buffer(buffer))) =
            (slot.initializer(), self.resources.get_mut(&(slot, 0)))
        {
            let values = self.context.faults.table(slot, scene, make(scene));
            let bytes: &[u8] = bytemuck::cast_slice(&values);
            let target = buffer.bytes_mut();
            let length = bytes.len().min(target.len());
            target[..length].copy_from_slice(&bytes[..length]);
        }
    }

    /// The memory of a slot.
    ///
    /// # Panics
    /// If the plan has no such slot. A plan lists every slot that its passes declare.
    pub fn get(&self, slot: Slot, image: u32) -> &Resource {
        let key = (slot, if slot.is_multibuffered() { image } else { 0 });
        match self.resources.get(&key) {
            Some(resource) => resource,
            None => panic!("slot '{}' {} is not in the plan", slot.name(), key.1),
        }
    }

    pub fn image(&self, slot: Slot, image: u32) -> Option<&Image> {
        match self.resources.get(&(slot, if slot.is_multibuffered() { image } else { 0 })) {
            Some(Resource::Image(image)) => Some(image),
            _ => None,
        }
    }

    pub fn buffer_mut(&mut self, slot: Slot) -> Option<&mut Buffer> {
        match self.resources.get_mut(&(slot, 0)) {
            Some(Resource::Buffer(buffer)) => Some(buffer),
            _ => None,
        }
    }

    /// Frees everything.
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
            Resource::Image(image) => image.shape == slot.shape(scene) && image.format == slot.format(scene),
            Resource::Buffer(buffer) => Shape::Buffer(buffer.size as u32) == slot.shape(scene),
        }
    }
}
