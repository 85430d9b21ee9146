//! The barrier derivation in Vulkan's words: which barrier goes in front of an operation, if any.

use super::context::Context;
use crate::barriers::{Access, Barrier, Worker, Workers};
use crate::queues::Queues;
use ash::vk;

/// The barrier derivation of everything that uses the same slots, and a count of what was recorded.
#[derive(Default)]
pub struct Order {
    pub queues: Queues,
    pub barriers: u32,
    /// Names and extents of the passes dispatched, in order, while someone counts them.
    pub dispatched: Option<Vec<(&'static str, [u32; 3])>>,
    /// Leaves out the n-th barrier, to show that something notices.
    pub drop_barrier: Option<u32>,
}

impl Order {
    /// Records the barrier that an operation with these accesses needs, if it needs one.
    pub(super) fn before(&mut self, context: &Context, queue: usize, commands: vk::CommandBuffer, accesses: &[Access]) {
        let Some(Barrier { mut from, mut to }) = self.queues.before(queue, accesses) else { return };
        self.barriers += 1;
        if self.drop_barrier == Some(self.barriers) {
            return;
        }
        // A queue that only copies knows no shaders.
        if !context.queue(queue).computes {
            (from, to) = (from.without(Worker::Compute), to.without(Worker::Compute));
        }
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(stages(from))
            .src_access_mask(writes(from))
            .dst_stage_mask(stages(to))
            .dst_access_mask(reads(to) | writes(to))];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the command buffer is being recorded, outside any render pass.
        unsafe { context.device.cmd_pipeline_barrier2(commands, &dependency) };
    }
}

fn flags<T: std::ops::BitOr<Output = T> + Default>(workers: Workers, of: [(Worker, T); 3]) -> T {
    of.into_iter().filter(|(worker, _)| workers.has(*worker)).fold(T::default(), |all, (_, flags)| all | flags)
}

fn stages(workers: Workers) -> vk::PipelineStageFlags2 {
    flags(
        workers,
        [
            (Worker::Compute, vk::PipelineStageFlags2::COMPUTE_SHADER),
            (Worker::Copy, vk::PipelineStageFlags2::ALL_TRANSFER),
            (Worker::Host, vk::PipelineStageFlags2::HOST),
        ],
    )
}

fn writes(workers: Workers) -> vk::AccessFlags2 {
    flags(
        workers,
        [
            (Worker::Compute, vk::AccessFlags2::SHADER_STORAGE_WRITE),
            (Worker::Copy, vk::AccessFlags2::TRANSFER_WRITE),
            (Worker::Host, vk::AccessFlags2::NONE),
        ],
    )
}

fn reads(workers: Workers) -> vk::AccessFlags2 {
    flags(
        workers,
        [
            (Worker::Compute, vk::AccessFlags2::SHADER_SAMPLED_READ | vk::AccessFlags2::SHADER_STORAGE_READ),
            (Worker::Copy, vk::AccessFlags2::TRANSFER_READ),
            (Worker::Host, vk::AccessFlags2::HOST_READ),
        ],
    )
}
