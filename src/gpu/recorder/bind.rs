//! What a dispatch's shader names, as descriptors: slots by their names, and the parameters. They are pushed, where the device can.

use super::{Recorder, Work};
use crate::gpu::GpuError;
use crate::gpu::pipelines::descriptor_type;
use crate::gpu::slots::Resource;
use crate::passes::Part;
use crate::spirv::Kind;
use ash::vk;

/// Where a binding's entry is while a dispatch is bound.
enum Listed {
    Image(usize),
    Buffer(usize),
    Texels(usize),
}

impl Recorder {
    pub(super) fn bind(&mut self, work: &Work, params_offset: u64, params_size: u64) -> Result<(), GpuError> {
        let Work { slots, pipeline, scene, pass, args } = *work;
        let binds = [(pass.reads)(scene, args), (pass.writes)(scene, args)].concat();
        let mut images = Vec::with_capacity(binds.len());
        let mut buffers = Vec::with_capacity(binds.len());
        let mut texels = Vec::with_capacity(binds.len());
        // Which of the three lists a binding's entry went to, and where.
        let mut places = Vec::with_capacity(binds.len());
        for binding in &pipeline.module.bindings {
            let bound = binds.iter().find(|b| b.name == binding.name);
            match (binding.kind, bound.map(|b| (b, slots.get(b.slot, args.image)))) {
                (Kind::Params, _) => {
                    places.push((binding, Listed::Buffer(buffers.len())));
                    buffers.push([vk::DescriptorBufferInfo {
                        buffer: self.params.handle,
                        offset: params_offset,
                        range: params_size,
                    }]);
                }
                (Kind::Texels(components), Some((_, Resource::Buffer(buffer)))) => {
                    places.push((binding, Listed::Texels(texels.len())));
                    texels.push([buffer.texels(components)]);
                }
                (_, Some((_, Resource::Buffer(buffer)))) => {
                    places.push((binding, Listed::Buffer(buffers.len())));
                    buffers.push([vk::DescriptorBufferInfo {
                        buffer: buffer.handle,
                        offset: 0,
                        range: vk::WHOLE_SIZE,
                    }]);
                }
                (_, Some((bind, Resource::Image(image)))) => {
                    let view = match bind.part {
                        Part::Layer => image.layers[args.layer as usize],
                        _ => image.view,
                    };
                    places.push((binding, Listed::Image(images.len())));
                    images.push([vk::DescriptorImageInfo {
                        sampler: vk::Sampler::null(),
                        image_view: view,
                        image_layout: vk::ImageLayout::GENERAL,
                    }]);
                }
                // The contract of pass and shader was checked when the pipeline was made.
                (_, None) => {}
            }
        }
        // Pushed descriptors go to no set.
        let set = match self.context.push_descriptor {
            Some(_) => vk::DescriptorSet::null(),
            None => self.sets.take(pipeline)?,
        };
        let writes: Vec<_> = places
            .iter()
            .map(|(binding, listed)| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(binding.binding)
                    .descriptor_type(descriptor_type(binding.kind));
                match *listed {
                    Listed::Image(at) => write.image_info(&images[at]),
                    Listed::Buffer(at) => write.buffer_info(&buffers[at]),
                    Listed::Texels(at) => write.texel_buffer_view(&texels[at]),
                }
            })
            .collect();
        let (commands, point, layout) = (self.commands, vk::PipelineBindPoint::COMPUTE, pipeline.layout);
        // SAFETY: every view and buffer named is alive until the device is done, since slots are only freed after a wait. A set of a
        // pool was taken just now, so that nothing uses it yet.
        unsafe {
            match &self.context.push_descriptor {
                Some(push) => push.cmd_push_descriptor_set(commands, point, layout, 0, &writes),
                None => {
                    let device = &self.context.device;
                    device.update_descriptor_sets(&writes, &[]);
                    device.cmd_bind_descriptor_sets(commands, point, layout, 0, &[set], &[]);
                }
            }
        }
        Ok(())
    }
}
