//! What is moved without a shader: images that are new, bytes of frames in, pictures out.

use super::{Place, Recorder};
use crate::barriers::{self, Access, Worker};
use crate::gpu::barrier_recorder::BarrierRecorder;
use crate::gpu::formats;
use crate::gpu::resources::{Buffer, Image, WHOLE};
use crate::gpu::slots::Slots;
use crate::passes::Slot;
use ash::vk;

impl Recorder {
    /// New images from UNDEFINED to GENERAL, and all their bits to zero: pixels outside the sector are never written again.
    pub fn clear_new(&mut self, order: &mut BarrierRecorder, slots: &Slots, new: &[(Slot, u32)]) {
        let images: Vec<(&Image, Slot, u32)> =
            new.iter().filter_map(|&(slot, n)| slots.image(slot, n).map(|image| (image, slot, n))).collect();
        let transitions: Vec<_> = images
            .iter()
            .map(|(image, ..)| {
                // The memory may have been another image's a moment ago.
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                    .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                    .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                    .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                    .old_layout(vk::ImageLayout::UNDEFINED)
                    .new_layout(vk::ImageLayout::GENERAL)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .image(image.handle)
                    .subresource_range(WHOLE)
            })
            .collect();
        let device = &self.context.device;
        // SAFETY: the images are new, alive, and used by nothing yet.
        unsafe {
            device.cmd_pipeline_barrier2(
                self.commands,
                &vk::DependencyInfo::default().image_memory_barriers(&transitions),
            );
        }
        for (image, slot, n) in images {
            let access = Access::of_slot(slot, n, 0..image.shape.parts(), true, Worker::Copy);
            self.barrier(order, &[access]);
            let poison = self.context.faults.poisoned().filter(|_| !slot.starts_clear());
            let held = poison.map_or(vk::ClearColorValue { float32: [0.0; 4] }, |p| formats::held(p, image.format));
            // SAFETY: the image is in GENERAL since the transition above.
            unsafe {
                device.cmd_clear_color_image(self.commands, image.handle, vk::ImageLayout::GENERAL, &held, &[WHOLE]);
            }
        }
    }

    /// Bytes of a staging buffer into parts of an image: layers of an array, slices of a 3D image.
    pub fn copy_in(&mut self, order: &mut BarrierRecorder, from: &Buffer, image: &Image, to: Place) {
        let parts = to.parts.clone();
        self.barrier(order, &[Access::of_slot(to.slot, to.copy, to.parts, true, Worker::Copy)]);
        // SAFETY: the buffer holds the bytes of these parts (its maker sized it so) and both live until the device is done.
        unsafe {
            self.context.device.cmd_copy_buffer_to_image(
                self.commands,
                from.handle,
                image.handle,
                vk::ImageLayout::GENERAL,
                &[region(image, parts.start, parts.end - parts.start)],
            );
        }
    }

    /// A whole image into the readback buffer, made visible to the host.
    pub fn copy_out(&mut self, order: &mut BarrierRecorder, image: &Image, slot: Slot, copy: u32, to: &Buffer) {
        let parts = image.shape.parts();
        let read = Access::of_slot(slot, copy, 0..parts, false, Worker::Copy);
        let resource = barriers::Resource::Readback;
        let write = Access { resource, parts: 0..1, write: true, by: Worker::Copy };
        self.barrier(order, &[read, write]);
        // SAFETY: the buffer is as large as the image (its maker sized it so) and both live until the device is done.
        unsafe {
            self.context.device.cmd_copy_image_to_buffer(
                self.commands,
                image.handle,
                vk::ImageLayout::GENERAL,
                to.handle,
                &[region(image, 0, parts)],
            );
        }
        self.barrier(order, &[Access { resource, parts: 0..1, write: false, by: Worker::Host }]);
    }
}

fn region(image: &Image, part: u32, parts: u32) -> vk::BufferImageCopy {
    let is_volume = image.extent.depth > 1 || matches!(image.shape, crate::passes::slots::Shape::Three(_));
    let (layer, layers, z, depth) = if is_volume { (0, 1, part, parts) } else { (part, parts, 0, 1) };
    vk::BufferImageCopy {
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            mip_level: 0,
            base_array_layer: layer,
            layer_count: layers,
        },
        image_offset: vk::Offset3D { x: 0, y: 0, z: z as i32 },
        image_extent: vk::Extent3D { depth, ..image.extent },
        ..vk::BufferImageCopy::default()
    }
}
