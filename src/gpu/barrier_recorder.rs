//! Records the barriers that [`crate::barriers`] derives as Vulkan commands.

use super::context::Context;
use crate::barriers::{Access, Barrier, PipelineStage, PipelineStages};
use crate::queues::oracle::SubmissionLog;
use crate::queues::{QueueTracker, Wait};
use ash::vk;

/// The barriers and waits of everything that uses the same slots, and a count of the barriers.
#[derive(Default)]
pub struct BarrierRecorder {
    pub queues: QueueTracker,
    pub count: u32,
    /// The names and invocations of the dispatched passes, in order, while they are counted.
    pub dispatched: Option<Vec<(&'static str, [u32; 3])>>,
    /// Fault injection: leaves out the n-th barrier.
    pub drop_barrier: Option<u32>,
    /// Everything recorded and submitted, if it is logged.
    pub log: Option<SubmissionLog>,
}

impl BarrierRecorder {
    /// Records the barrier that an operation with these accesses needs, if it needs one.
    pub(super) fn before(&mut self, context: &Context, queue: usize, commands: vk::CommandBuffer, accesses: &[Access]) {
        let barrier = self.queues.record(queue, accesses);
        self.count += u32::from(barrier.is_some());
        let is_dropped = self.drop_barrier == Some(self.count);
        // A transfer queue has no shader stages.
        let computes = context.queue(queue).computes;
        let supported = |all: PipelineStages| if computes { all } else { all.without(PipelineStage::Compute) };
        let barrier = barrier.filter(|_| !is_dropped).map(|b| Barrier { from: supported(b.from), to: supported(b.to) });
        if let Some(log) = &mut self.log {
            log.record(queue, barrier, accesses);
        }
        let Some(Barrier { from, to }) = barrier else { return };
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(stages(from))
            .src_access_mask(writes(from))
            .dst_stage_mask(stages(to))
            .dst_access_mask(reads(to) | writes(to))];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the command buffer is being recorded, outside any render pass.
        unsafe { context.device.cmd_pipeline_barrier2(commands, &dependency) };
    }

    /// Begins the recording of a submission to this queue.
    pub(super) fn begin(&mut self, queue: usize) {
        self.queues.begin(queue);
        self.log.iter_mut().for_each(|log| log.begin(queue));
    }

    /// The recording of this queue was submitted with these waits; it is done at this value of the queue's timeline.
    pub(super) fn submitted(&mut self, queue: usize, waits: &[Wait], value: u64) {
        self.queues.submitted(queue, waits, value);
        self.log.iter_mut().for_each(|log| log.submit(queue, waits, value));
    }
}

fn flags<T: std::ops::BitOr<Output = T> + Default>(workers: PipelineStages, of: [(PipelineStage, T); 3]) -> T {
    of.into_iter().filter(|(worker, _)| workers.has(*worker)).fold(T::default(), |all, (_, flags)| all | flags)
}

fn stages(workers: PipelineStages) -> vk::PipelineStageFlags2 {
    flags(
        workers,
        [
            (PipelineStage::Compute, vk::PipelineStageFlags2::COMPUTE_SHADER),
            (PipelineStage::Copy, vk::PipelineStageFlags2::ALL_TRANSFER),
            (PipelineStage::Host, vk::PipelineStageFlags2::HOST),
        ],
    )
}

fn writes(workers: PipelineStages) -> vk::AccessFlags2 {
    flags(
        workers,
        [
            (PipelineStage::Compute, vk::AccessFlags2::SHADER_STORAGE_WRITE),
            (PipelineStage::Copy, vk::AccessFlags2::TRANSFER_WRITE),
            (PipelineStage::Host, vk::AccessFlags2::NONE),
        ],
    )
}

fn reads(workers: PipelineStages) -> vk::AccessFlags2 {
    flags(
        workers,
        [
            (PipelineStage::Compute, vk::AccessFlags2::SHADER_SAMPLED_READ | vk::AccessFlags2::SHADER_STORAGE_READ),
            (PipelineStage::Copy, vk::AccessFlags2::TRANSFER_READ),
            (PipelineStage::Host, vk::AccessFlags2::HOST_READ),
        ],
    )
}
