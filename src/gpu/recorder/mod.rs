//! One command buffer: operations with the barriers they need, labels, time stamps, and their parameters.

mod bind;
mod copies;
mod sets;

use super::GpuError;
use super::barrier_recorder::BarrierRecorder;
use super::context::Context;
use super::error::Doing;
use super::measured::Measured;
use super::pipelines::Pipeline;
use super::resources::{Buffer, Purpose};
use super::slots::Slots;
use super::timeline::Timelines;
use super::timing::Stamps;
use crate::barriers::{self, Access};
use crate::passes::{DispatchArgs, Pass, Slot, interface_check};
use crate::scene::Scene;
use ash::vk;
use sets::Sets;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Room for the parameters of one command buffer.
const PARAMS_BYTES: u64 = 64 << 10;
const STAMPS: u32 = 128;

/// One dispatch: a pass, and what it runs on.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    pub slots: &'a Slots,
    pub pipeline: &'a Pipeline,
    pub scene: &'a Scene,
    pub pass: &'static Pass,
    pub args: &'a DispatchArgs,
}

/// Parts of a slot: layers of an array, slices of a 3D image; of one of the images that take turns.
#[derive(Clone, Debug)]
pub struct Place {
    pub slot: Slot,
    pub copy: u32,
    pub parts: Range<u32>,
}

pub struct Recorder {
    context: Arc<Context>,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    params: Buffer,
    params_used: u64,
    /// Where descriptors are not pushed.
    sets: Sets,
    pub stamps: Option<Stamps>,
    /// Value of the timeline at which the last submission is done.
    done_at: u64,
    /// The submission whose times were added last.
    collected_to: u64,
    label: &'static str,
    /// The queue that it is submitted to.
    queue: usize,
}

impl Recorder {
    /// With `statistics` the invocations of every dispatch are counted, where the device can.
    pub fn new(
        context: &Arc<Context>,
        queue: usize,
        label: &'static str,
        statistics: bool,
    ) -> Result<Recorder, GpuError> {
        let create = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue(queue).family);
        let params = Buffer::new(context, "params", PARAMS_BYTES, Purpose::Params)?;
        let stamps = Stamps::new(context, queue, STAMPS, statistics)?;
        // SAFETY: the create structure is complete.
        let pool = unsafe { context.device.create_command_pool(&create, None) }.doing(|| "create commands".into())?;
        context.name(pool, label);
        let allocate = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the pool was just made; one buffer is asked for.
        let commands = unsafe { context.device.allocate_command_buffers(&allocate) };
        let mut recorder = Recorder {
            context: context.clone(),
            pool,
            commands: vk::CommandBuffer::null(),
            params,
            params_used: 0,
            sets: Sets::new(context),
            stamps,
            done_at: 0,
            collected_to: 0,
            label,
            queue,
        };
        recorder.commands = commands.doing(|| "create commands".into())?[0];
        context.name(recorder.commands, label);
        Ok(recorder)
    }

    /// Waits until the last submission is done, then starts anew.
    pub fn begin(&mut self, order: &mut BarrierRecorder, timelines: &Timelines) -> Result<(), GpuError> {
        order.begin(self.queue);
        self.wait(timelines)?;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the device is done with this pool's only command buffer.
        unsafe {
            self.context
                .device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .and_then(|()| self.context.device.begin_command_buffer(self.commands, &begin))
        }
        .doing(|| format!("record '{}'", self.label))?;
        self.params_used = 0;
        self.sets.begin()?;
        if let Some(stamps) = &mut self.stamps {
            stamps.begin(self.commands);
            self.settle();
        }
        Ok(())
    }

    /// llvmpipe (Mesa 22.3, `lp_setup_end_query`) writes a time stamp when it next flushes, once anything was ever drawn on a window:
    /// without a flush behind each one the dispatch after it would seem to take no time. A barrier is one.
    fn settle(&self) {
        if self.context.shows.is_none() || !self.context.candidate.is_software() {
            return;
        }
        // Of no memory: what the derivation leaves out is still seen to be missing.
        flush(&self.context.device, self.commands, vk::AccessFlags2::NONE);
    }

    /// Adds the times of the last submission, once, when it is done.
    pub fn collect(&mut self, timelines: &Timelines, measured: &mut Measured) -> Result<(), GpuError> {
        if self.collected_to == self.done_at {
            return Ok(());
        }
        self.wait(timelines)?;
        self.collected_to = self.done_at;
        if let Some(stamps) = &self.stamps {
            let (bits, period) = (self.context.queue(self.queue).valid_bits, self.context.limits.timestamp_period);
            measured.add(&stamps.read()?, bits, period);
        }
        Ok(())
    }

    /// Blocks until the last submission is done.
    pub fn wait(&self, timelines: &Timelines) -> Result<(), GpuError> {
        timelines.of(self.queue).wait(self.done_at)
    }

    /// Whether the last submission is done.
    pub fn is_done(&self, timelines: &Timelines) -> Result<bool, GpuError> {
        timelines.of(self.queue).is_done(self.done_at)
    }

    pub fn submit(&mut self, order: &mut BarrierRecorder, timelines: &mut Timelines) -> Result<(), GpuError> {
        // SAFETY: the command buffer is being recorded.
        unsafe { self.context.device.end_command_buffer(self.commands) }
            .doing(|| format!("record '{}'", self.label))?;
        let waits = order.queues.waits(self.queue);
        let waited: Vec<_> = waits
            .iter()
            .map(|wait| {
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(timelines.of(wait.queue).semaphore)
                    .value(wait.value)
                    .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            })
            .collect();
        let timeline = timelines.of_mut(self.queue);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let signal = [vk::SemaphoreSubmitInfo::default()
            .semaphore(timeline.semaphore)
            .value(timeline.submitted + 1)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waited)
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signal);
        self.context.submit(self.queue, &submit, vk::Fence::null(), || format!("submit '{}'", self.label))?;
        timeline.submitted += 1;
        timeline.doing = self.label.to_string();
        self.done_at = timeline.submitted;
        order.submitted(self.queue, &waits, self.done_at);
        Ok(())
    }

    /// One dispatch of a pass.
    pub fn dispatch(&mut self, order: &mut BarrierRecorder, work: &Work) -> Result<(), GpuError> {
        let Work { pipeline, scene, pass, args, .. } = *work;
        self.barrier(order, &barriers::accesses(scene, pass, args));
        let Some(args) = &self.context.faults.args(pass, scene, args) else { return Ok(()) };
        let work = &Work { args, ..*work };
        self.context.begin_label(self.commands, pass.name);
        let block = interface_check::pack(&pipeline.module, &self.context.faults.numbers(pass, scene, args));
        let offset = self.place_params(&block)?;
        self.bind(work, offset, block.len() as u64)?;
        let extent = self.context.faults.invocations(pass, scene, args);
        let groups: [u32; 3] = std::array::from_fn(|i| extent[i].div_ceil(pipeline.module.local_size[i]));
        let (device, commands) = (&self.context.device, self.commands);
        // Before any query begins: lavapipe looks at the pipeline then.
        // SAFETY: the pipeline is alive until the device is done.
        unsafe { device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, pipeline.handle) };
        let dispatch = || {
            for n in 0..self.context.faults.times(pass.name) {
                // One that is slow is so one after the other, also where there is room for several at once.
                if n > 0 {
                    flush(device, commands, vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
                }
                // SAFETY: everything the pipeline's layout names was bound; extents are within limits checked with the formats.
                unsafe { device.cmd_dispatch(commands, groups[0], groups[1], groups[2]) };
            }
        };
        match &mut self.stamps {
            Some(stamps) => stamps.dispatch(commands, pass.name, dispatch),
            None => dispatch(),
        }
        self.settle();
        self.context.counts.dispatches.fetch_add(1, Ordering::Relaxed);
        self.context.end_label(self.commands);
        if let Some(dispatched) = &mut order.dispatched {
            dispatched.push((pass.name, extent));
        }
        Ok(())
    }

    fn place_params(&mut self, block: &[u8]) -> Result<u64, GpuError> {
        let alignment = self.context.limits.min_uniform_buffer_offset_alignment.max(16);
        let offset = self.params_used.next_multiple_of(alignment);
        let end = offset + block.len() as u64;
        if end > PARAMS_BYTES {
            return Err(GpuError::Limit {
                what: "parameters of one command buffer".into(),
                needed: end,
                allowed: PARAMS_BYTES,
            });
        }
        self.params.bytes_mut()[offset as usize..end as usize].copy_from_slice(block);
        self.params_used = end;
        Ok(offset)
    }

    pub fn stamp(&mut self, name: &'static str) {
        if let Some(stamps) = &mut self.stamps {
            stamps.end_of(self.commands, name);
            self.settle();
        }
    }

    fn barrier(&self, order: &mut BarrierRecorder, accesses: &[Access]) {
        order.before(&self.context, self.queue, self.commands, accesses);
    }
}

/// Everything before it is done, and what was written is there for `memory` behind it.
fn flush(device: &ash::Device, commands: vk::CommandBuffer, memory: vk::AccessFlags2) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(memory & vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_access_mask(memory)];
    let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: the command buffer is being recorded, outside any render pass.
    unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // SAFETY: the owner waited for the device before it drops its recorders. The pool frees its command buffer.
        unsafe { self.context.device.destroy_command_pool(self.pool, None) };
    }
}
