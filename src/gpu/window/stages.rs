//! What is done to an image of the window, in Vulkan's words: where a picture goes, and the barriers between.

use crate::gpu::resources::{Image, WHOLE};
use ash::vk;

/// What part of a picture goes where on a window of this size, and how large that is: it is cropped, never scaled.
pub fn region(image: &Image, at: [u32; 2], size: [u32; 2]) -> (vk::ImageBlit, [u32; 2]) {
    let from = [image.extent.width, image.extent.height];
    let [w, h] = std::array::from_fn(|i| from[i].min(size[i].saturating_sub(at[i])));
    let layers =
        vk::ImageSubresourceLayers { aspect_mask: vk::ImageAspectFlags::COLOR, layer_count: 1, ..Default::default() };
    let corner = |x: u32, y: u32, z: i32| vk::Offset3D { x: x as i32, y: y as i32, z };
    let blit = vk::ImageBlit {
        src_subresource: layers,
        src_offsets: [corner(0, 0, 0), corner(w, h, 1)],
        dst_subresource: layers,
        dst_offsets: [corner(at[0], at[1], 0), corner(at[0] + w, at[1] + h, 1)],
    };
    (blit, [w, h])
}

/// What happens to an image of the window, in this order.
#[derive(Clone, Copy)]
pub enum Stage {
    Acquired,
    Copied,
    Drawn,
    Shown,
}

impl Stage {
    fn layout(self) -> vk::ImageLayout {
        match self {
            Stage::Acquired => vk::ImageLayout::UNDEFINED,
            Stage::Copied => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            Stage::Drawn => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            Stage::Shown => vk::ImageLayout::PRESENT_SRC_KHR,
        }
    }

    fn stages(self) -> vk::PipelineStageFlags2 {
        match self {
            // As the semaphore's wait, which comes before it so.
            Stage::Acquired | Stage::Copied => vk::PipelineStageFlags2::ALL_TRANSFER,
            Stage::Drawn => vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
            // As the semaphore that showing it waits for.
            Stage::Shown => vk::PipelineStageFlags2::ALL_COMMANDS,
        }
    }

    fn accesses(self) -> vk::AccessFlags2 {
        match self {
            Stage::Acquired | Stage::Shown => vk::AccessFlags2::NONE,
            Stage::Copied => vk::AccessFlags2::TRANSFER_WRITE,
            Stage::Drawn => vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ,
        }
    }
}

pub fn barrier(device: &ash::Device, commands: vk::CommandBuffer, image: vk::Image, from: Stage, to: Stage) {
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(from.stages())
        .src_access_mask(from.accesses())
        .dst_stage_mask(to.stages())
        .dst_access_mask(to.accesses())
        .old_layout(from.layout())
        .new_layout(to.layout())
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(WHOLE)];
    // SAFETY: the command buffer is being recorded, outside dynamic rendering; the image was acquired.
    unsafe { device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().image_memory_barriers(&barrier)) };
}
