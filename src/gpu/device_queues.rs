//! The queues of a device as one renderer uses them: the barriers and waits that order its work, which submissions are done, and their
//! times.

use super::context::Context;
use super::error::GpuError;
use super::timeline::Timelines;
use super::timing::Timings;
use crate::barriers::{Access, Barrier, PipelineStage, PipelineStages};
use crate::queues::oracle::{Event, SubmissionLog};
use crate::queues::{QueueTracker, Wait};
use ash::vk;
use std::sync::Arc;

/// The queues of a device in use. It orders all operations on the same slots: the barriers that [`crate::barriers`] derives are recorded as Vulkan
/// commands. It also holds the timelines and times.
pub(crate) struct DeviceQueues {
    pub tracker: QueueTracker,
    pub(super) timelines: Timelines,
    pub timings: Timings,
    /// Number of barriers that were needed so far, a dropped one included.
    pub count: u32,
    /// The names and numbers of invocations of the passes dispatched so far, in order. `None` while they are not recorded.
    pub dispatched: Option<Vec<(&'static str, [u32; 3])>>,
    /// Fault injection: the barrier with this number, from 1, is left out.
    pub drop_barrier: Option<u32>,
    /// The log of everything recorded and submitted. `None` if nothing is logged.
    pub log: Option<SubmissionLog>,
}

impl DeviceQueues {
    /// Uses the first `count` queues. `spans`: records a span for each operation of host and device.
    pub fn new(context: &Arc<Context>, count: usize, spans: bool) -> Result<DeviceQueues, GpuError> {
        Ok(DeviceQueues {
            tracker: QueueTracker::new(count),
            timelines: Timelines::new(context, count)?,
            timings: Timings::new(context, spans),
            count: 0,
            dispatched: None,
            drop_barrier: None,
            log: None,
        })
    }

    /// Runs host work, and records its span if spans are enabled.
    pub fn host<T>(&mut self, name: &'static str, work: impl FnOnce(&mut DeviceQueues) -> T) -> T {
        let begin = self.timings.since_began();
        let done = work(self);
        self.timings.add_host(name, begin);
        done
    }

    /// Records the barrier in front of an operation with these accesses, if it needs one.
    pub(super) fn before(&mut self, context: &Context, queue: usize, commands: vk::CommandBuffer, accesses: &[Access]) {
        let barrier = self.tracker.record(queue, accesses);
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
        let ((before, written, _), (after, writes, reads)) = (masks(from), masks(to));
        // SAFETY: the command buffer is being recorded, outside any render pass.
        unsafe { memory_barrier(&context.device, commands, (before, written), (after, reads | writes)) };
    }

    /// Notes in the log that a time stamp was recorded on this queue.
    pub(super) fn stamped(&mut self, queue: usize) {
        self.log.iter_mut().for_each(|log| log.event(queue, Event::Stamp));
    }

    /// Begins the recording of a submission to this queue, in the tracker of barriers and in the log.
    pub(super) fn begin(&mut self, queue: usize) {
        self.tracker.begin(queue);
        self.log.iter_mut().for_each(|log| log.begin(queue));
    }

    /// Notes that the recording of this queue was submitted with these waits. It is done when the queue's timeline has this value.
    pub(super) fn submitted(&mut self, queue: usize, waits: &[Wait], value: u64) {
        self.tracker.submitted(queue, waits, value);
        self.log.iter_mut().for_each(|log| log.submit(queue, waits, value));
    }
}

/// Records a barrier of memory between accesses of some stages and those of others.
///
/// # Safety
/// The command buffer is being recorded, outside any render pass.
pub(super) unsafe fn memory_barrier(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    (before, written): (vk::PipelineStageFlags2, vk::AccessFlags2),
    (after, memory): (vk::PipelineStageFlags2, vk::AccessFlags2),
) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(before)
        .src_access_mask(written)
        .dst_stage_mask(after)
        .dst_access_mask(memory)];
    let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: as of this function.
    unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
}

/// Pipeline stages, writes and reads of these workers.
fn masks(workers: PipelineStages) -> (vk::PipelineStageFlags2, vk::AccessFlags2, vk::AccessFlags2) {
    use vk::{AccessFlags2 as A, PipelineStageFlags2 as P};
    // Numbers of passes are written by the host, and need no barrier. But their buffer may take memory that a readback had before: the host
    // waited in between, which layers older than 1.3.297 do not know of timelines.
    let shader_reads = A::SHADER_SAMPLED_READ | A::SHADER_STORAGE_READ | A::UNIFORM_READ;
    let all = [
        (PipelineStage::Compute, P::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE, shader_reads),
        (PipelineStage::Copy, P::ALL_TRANSFER, A::TRANSFER_WRITE, A::TRANSFER_READ),
        (PipelineStage::Host, P::HOST, A::NONE, A::HOST_READ),
    ];
    let there = all.into_iter().filter(|(worker, ..)| workers.has(*worker));
    there.fold(Default::default(), |(stages, writes, reads), (_, stage, write, read)| {
        (stages | stage, writes | write, reads | read)
    })
}
