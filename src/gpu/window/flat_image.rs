//! A two-dimensional colour image with its view, in the device's memory. Panels are drawn from such images, and the composed window is
//! drawn into one.

use crate::context::Context;
use crate::error::{ErrorContext, GpuError};
use crate::memory::{self, Reserve};
use crate::resources::WHOLE;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use std::sync::Arc;

pub(super) struct FlatImage {
    context: Arc<Context>,
    pub handle: vk::Image,
    pub view: vk::ImageView,
    allocation: Option<Allocation>,
    pub format: vk::Format,
    /// Width and height, pixels.
    pub size: [u32; 2],
}

impl FlatImage {
    /// Makes a 2D image in layout UNDEFINED.
    ///
    /// # Errors
    /// The device has no memory for it, or fails.
    pub(super) fn new(
        context: &Arc<Context>,
        name: &'static str,
        format: vk::Format,
        size: [u32; 2],
        usage: vk::ImageUsageFlags,
    ) -> Result<FlatImage, GpuError> {
        let device = &context.device;
        let operation = || format!("create a {name} ({}x{})", size[0], size[1]);
        let create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        // SAFETY: the create structure is complete.
        let handle = unsafe { device.create_image(&create, None) }.context(operation)?;
        // From here on, dropping it cleans up after a failure.
        let view = vk::ImageView::null();
        let mut image = FlatImage { context: context.clone(), handle, view, allocation: None, format, size };
        // SAFETY: the image was just made by this device.
        let requirements = unsafe { device.get_image_memory_requirements(handle) };
        let wanted = Reserve { name, requirements, location: MemoryLocation::GpuOnly, linear: false };
        let allocation = memory::reserve(context, wanted, &operation)?;
        // SAFETY: the allocation fits the requirements and lives as long as the image.
        let bound = unsafe { device.bind_image_memory(handle, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound.context(operation)?;
        let create = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(WHOLE);
        // SAFETY: the image is bound to memory and alive.
        image.view = unsafe { device.create_image_view(&create, None) }.context(operation)?;
        context.name(handle, name);
        Ok(image)
    }
}

impl Drop for FlatImage {
    fn drop(&mut self) {
        if self.context.is_given_up() {
            return;
        }
        // SAFETY: the owner waited for what was drawn with it; a null view is allowed.
        unsafe {
            self.context.device.destroy_image_view(self.view, None);
            self.context.device.destroy_image(self.handle, None);
        }
        memory::free(&self.context, self.allocation.take());
    }
}
