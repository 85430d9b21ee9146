//! Records one command buffer: dispatches and copies with the barriers that they need, labels, time stamps, and parameters.

use super::bands::{Band, BandLimit, Work};
use super::buffers::{Buffer, Purpose, Readback, SlotParts, Upload};
use super::context::Context;
use super::descriptor_sets::DescriptorSets;
use super::device_queues::{DeviceQueues, memory_barrier};
use super::error::{ErrorContext, GpuError};
use super::formats;
use super::pipelines::{Pipeline, descriptor_type};
use super::resources::{COLOUR, Image, Resource, SlotResources, WHOLE, image_barrier};
use super::timeline::Submission;
use super::timing::{Stamps, TimeStamps};
use crate::barriers::{self, Access, PipelineStage};
use crate::passes::fault_injection::Command;
use crate::passes::slots::Shape;
use crate::passes::{DispatchArgs, Part, Pass, Slot, interface_check};
use crate::queues::oracle::Event;
use crate::scene::Scene;
use crate::spirv::{Binding, Kind};
use ash::vk;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Size of the uniform buffer for the parameters of one command buffer, bytes.
const PARAMS_BYTES: u64 = 64 << 10;
/// Capacity for time stamps. A picture in bands has two for each.
const STAMPS: u32 = 1024;
/// Maximum number of submissions of a command buffer whose time stamps wait to be read.
const MAX_UNREAD: usize = 64;

/// A dispatch of a pass with everything that it needs.
#[derive(Clone, Copy)]
pub struct Dispatch<'a> {
    pub slots: &'a SlotResources,
    pub pipeline: &'a Pipeline,
    pub scene: &'a Scene,
    pub pass: &'static Pass,
    pub args: &'a DispatchArgs,
}

/// Layout of copied texels in a buffer, as in VkBufferImageCopy.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BufferLayout {
    /// Byte offset of the first texel in the buffer.
    pub offset: u64,
    /// Texels from the beginning of one row to the next; 0: rows follow each other without gaps.
    pub row_length: u32,
    /// Rows from the beginning of one slice or layer to the next; 0: without gaps.
    pub image_height: u32,
    /// If the slices or layers lie in descending order, bytes from one to the next. None if they ascend.
    pub descending: Option<u64>,
}

/// Records and submits command buffers again and again on one queue. A recording needs one of them, and several only for work in bands. Every method
/// that returns a [`GpuError`] does so if the device fails or has no memory.
pub(crate) struct CommandRecorder {
    context: Arc<Context>,
    pool: vk::CommandPool,
    /// The one that is being recorded.
    commands: vk::CommandBuffer,
    /// All of the pool, and how many of them the recording uses.
    allocated: Vec<vk::CommandBuffer>,
    used: usize,
    /// The passes in the command buffer that is being recorded, if they are timed.
    open: Vec<Work>,
    /// Expected time of the command buffer that is being recorded, ns.
    expected: f64,
    params: Buffer,
    params_used: u64,
    /// Workgroups of the dispatches that passes count.
    groups: Option<Buffer>,
    /// For a device without push descriptors.
    sets: DescriptorSets,
    pub stamps: Option<Stamps>,
    /// Time stamps of earlier submissions that are done but not read.
    unread: Vec<Stamps>,
    /// Time stamps that were read, for later submissions.
    spare: Vec<Stamps>,
    time_stamps: TimeStamps,
    /// How many runs each pass and copy of the recording counts as: the number of frames of a batch, otherwise 1.
    pub runs: u32,
    /// Invocations are counted.
    statistics: bool,
    /// Value of the queue's timeline at which the last submission is done.
    done_at: u64,
    /// The last submission whose times were added.
    collected_to: u64,
    label: &'static str,
    /// The number of its queue.
    queue: usize,
}

impl CommandRecorder {
    /// With `statistics` and [`TimeStamps::EachPass`], the invocations of every dispatch are counted, if the device supports that.
    pub fn new(
        context: &Arc<Context>,
        queue: usize,
        label: &'static str,
        time_stamps: TimeStamps,
        statistics: bool,
    ) -> Result<CommandRecorder, GpuError> {
        let create = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue(queue).family);
        let params = Buffer::new(context, "params", PARAMS_BYTES, Purpose::Params)?;
        let statistics = statistics && time_stamps == TimeStamps::EachPass;
        let stamps = match time_stamps {
            TimeStamps::None => None,
            TimeStamps::Ends | TimeStamps::EachPass => Stamps::new(context, queue, STAMPS, statistics)?,
        };
        // SAFETY: the create structure is complete.
        let pool = unsafe { context.device.create_command_pool(&create, None) }.context(|| "create commands".into())?;
        context.name(pool, label);
        let mut recorder = CommandRecorder {
            context: context.clone(),
            pool,
            commands: vk::CommandBuffer::null(),
            allocated: Vec::new(),
            used: 0,
            open: Vec::new(),
            expected: 0.0,
            params,
            params_used: 0,
            groups: None,
            sets: DescriptorSets::new(context),
            stamps,
            unread: Vec::new(),
            spare: Vec::new(),
            time_stamps,
            runs: 1,
            statistics,
            done_at: 0,
            collected_to: 0,
            label,
            queue,
        };
        recorder.allocate()?;
        Ok(recorder)
    }

    fn allocate(&mut self) -> Result<(), GpuError> {
        let allocate = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is alive; one buffer is asked for.
        let commands = unsafe { self.context.device.allocate_command_buffers(&allocate) };
        let commands = commands.context(|| "create commands".into())?[0];
        self.context.name(commands, self.label);
        self.allocated.push(commands);
        Ok(())
    }

    /// Waits until this recorder's last submission is done, then begins a new recording.
    pub fn begin(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        queues.timings.cpu_of(None);
        queues.begin(self.queue);
        self.wait(queues)?;
        // SAFETY: the device is done with every command buffer of this pool.
        unsafe { self.context.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()) }
            .context(|| format!("record '{}'", self.label))?;
        self.used = 0;
        self.runs = 1;
        self.params_used = 0;
        self.sets.begin()?;
        if let Some(stamps) = &mut self.stamps {
            stamps.begin();
        }
        self.begin_commands(queues)
    }

    /// Begins the next command buffer of the recording.
    fn begin_commands(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        if self.used == self.allocated.len() {
            self.allocate()?;
        }
        self.commands = self.allocated[self.used];
        self.used += 1;
        self.open.clear();
        self.expected = 0.0;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is in its initial state: it is new, or its pool was reset, and it was not used since.
        unsafe { self.context.device.begin_command_buffer(self.commands, &begin) }
            .context(|| format!("record '{}'", self.label))?;
        if let Some(stamps) = &mut self.stamps {
            if self.time_stamps == TimeStamps::EachPass {
                serialize(&self.context.device, self.commands, self.queue, queues);
            }
            stamps.start(self.commands);
            self.after_stamp(queues);
        }
        Ok(())
    }

    /// Submits the command buffer, and continues the recording in another one.
    pub fn cut(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        self.submit(queues)?;
        // Where each pass is timed, that of a band is a run of its own.
        if let Some(stamps) = self.stamps.as_mut().filter(|_| self.time_stamps == TimeStamps::Ends) {
            stamps.continues();
        }
        queues.begin(self.queue);
        self.begin_commands(queues)?;
        if self.context.presentation.is_some() {
            // Older layers ignore dispatches with a base, and forget the barrier of a command buffer that has no other: those of bands. Headless,
            // nothing hides what they see.
            self.show_layer_the_wait();
        }
        Ok(())
    }

    /// Where CPU time is counted, waits until what was recorded is done: the time since the last call is that of `pass`.
    fn count_cpu(&mut self, queues: &mut DeviceQueues, pass: &'static str) -> Result<(), GpuError> {
        if queues.timings.cpu.is_some() {
            self.cut(queues)?;
            self.wait(queues)?;
            queues.timings.cpu_of(Some(pass));
        }
        Ok(())
    }

    /// Notes a time stamp and records what has to follow it: where passes are timed, nothing may begin before the stamp.
    fn after_stamp(&self, queues: &mut DeviceQueues) {
        queues.stamped(self.queue);
        // Once anything was drawn on a window, llvmpipe (Mesa 22.3, `lp_setup_end_query`) writes a time stamp only at its next flush, so
        // that the following dispatch would seem to take no time. A barrier is a flush.
        let needs_flush = self.context.presentation.is_some() && self.context.candidate.is_software();
        if self.time_stamps == TimeStamps::EachPass || needs_flush {
            serialize(&self.context.device, self.commands, self.queue, queues);
        }
    }

    /// Waits for this recorder's last submission, and adds its times and those that were set aside to the queues' timings. Each is added once.
    pub fn collect(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        let (bits, period) =
            (self.context.queue(self.queue).valid_bits, self.context.candidate.limits.timestamp_period);
        while let Some(stamps) = self.unread.first() {
            queues.timings.add(&stamps.read(bits, period)?, bits, period);
            self.spare.push(self.unread.remove(0));
        }
        if self.collected_to == self.done_at {
            return Ok(());
        }
        self.wait(queues)?;
        self.collected_to = self.done_at;
        if let Some(stamps) = &self.stamps {
            queues.timings.add(&stamps.read(bits, period)?, bits, period);
            queues.timings.untimed += stamps.left_out;
        }
        Ok(())
    }

    /// Waits for this recorder's last submission, and keeps its time stamps for a later [`CommandRecorder::collect`]. If too many are kept already,
    /// its work is counted as not timed.
    pub fn set_aside(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        self.wait(queues)?;
        if self.collected_to == self.done_at {
            return Ok(());
        }
        self.collected_to = self.done_at;
        let Some(stamps) = &self.stamps else { return Ok(()) };
        if self.unread.len() >= MAX_UNREAD {
            queues.timings.untimed += stamps.count();
            return Ok(());
        }
        let next = match self.spare.pop() {
            Some(next) => Some(next),
            None => Stamps::new(&self.context, self.queue, STAMPS, self.statistics)?,
        };
        self.unread.extend(std::mem::replace(&mut self.stamps, next));
        Ok(())
    }

    /// Blocks until this recorder's last submission is done.
    pub fn wait(&self, queues: &DeviceQueues) -> Result<(), GpuError> {
        queues.timelines.0[self.queue].wait(self.done_at)
    }

    /// True if this recorder's last submission is done.
    pub fn is_done(&self, queues: &DeviceQueues) -> Result<bool, GpuError> {
        queues.timelines.0[self.queue].is_done(self.done_at)
    }

    /// Submits the recording. The queue first waits for the other queues that it depends on.
    pub fn submit(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        if let Some(stamps) = self.stamps.as_mut().filter(|_| self.time_stamps == TimeStamps::Ends) {
            stamps.end_of(self.commands, self.label, self.runs, std::mem::take(&mut self.open));
            self.after_stamp(queues);
        }
        // SAFETY: the command buffer is being recorded.
        unsafe { self.context.device.end_command_buffer(self.commands) }
            .context(|| format!("record '{}'", self.label))?;
        let waits = queues.tracker.waits(self.queue);
        let waited = waits.iter().map(|wait| (queues.timelines.0[wait.queue].semaphore, wait.value)).collect();
        let (queue, commands, label) = (self.queue, self.commands, self.label);
        let expected = std::mem::take(&mut self.expected);
        let work = Submission { queue, commands, waits: waited, label, expected };
        self.done_at = queues.timelines.0[queue].submit(work)?;
        queues.submitted(self.queue, &waits, self.done_at);
        Ok(())
    }

    /// Records a dispatch with the barrier that it needs. With `limit` it is divided into bands, of which no two share a submission; an indirect
    /// dispatch stays whole.
    ///
    /// # Errors
    /// The recording has too many parameters, or the device fails.
    pub fn dispatch(
        &mut self,
        queues: &mut DeviceQueues,
        dispatch: &Dispatch,
        limit: Option<&BandLimit>,
    ) -> Result<(), GpuError> {
        let Dispatch { pipeline, scene, pass, args, .. } = *dispatch;
        let accesses = barriers::accesses(scene, pass, args);
        let Some(args) = &self.context.faults.args(pass, scene, args) else {
            self.barrier(queues, &accesses);
            return Ok(());
        };
        let dispatch = &Dispatch { args, ..*dispatch };
        let extent = self.context.faults.invocations(pass, scene, args);
        let local = pipeline.module.local_size;
        let groups: [u32; 3] = std::array::from_fn(|i| extent[i].div_ceil(local[i]));
        let invocations = |of: [u32; 3]| of.iter().map(|n| u64::from(*n)).product::<u64>();
        let counted = pass.reads(scene, args).into_iter().find(|bind| bind.part == Part::Groups);
        let mut bands = vec![Band { base: [0; 3], groups }];
        let mut expected = 0.0;
        if let Some(limit) = limit {
            expected = limit.expected(pass, &pipeline.time, invocations(extent));
            if limit.is_full(self.open.iter().map(|work| work.expected).sum(), expected) {
                self.cut(queues)?;
            }
            // Only the device knows how many workgroups a counted dispatch has.
            if counted.is_none() {
                bands = limit.bands(groups, invocations(extent), expected);
            }
        }
        if let Some(bind) = counted {
            self.copy_groups(queues, dispatch, bind.slot)?;
        }
        let block = interface_check::pack(&pipeline.module, &self.context.faults.numbers(pass, scene, args));
        let offset = self.place_params(&block)?;
        let last = bands.len() - 1;
        for (n, band) in bands.iter().enumerate() {
            // Of the invocations that the band's workgroups have, those inside the dispatch's extent.
            let size = std::array::from_fn(|i| {
                let from = band.base[i] * local[i];
                (band.groups[i] * local[i]).min(extent[i].saturating_sub(from))
            });
            let share = invocations(size) as f64 / invocations(extent).max(1) as f64;
            let work = Work { time: pipeline.time.clone(), expected: share * expected, invocations: invocations(size) };
            self.barrier(queues, &accesses);
            self.context.begin_label(self.commands, pass.name);
            self.context.loss.mark(self.commands, pass.name);
            self.bind(dispatch, offset, block.len() as u64)?;
            self.dispatch_band(queues, dispatch, band, work);
            self.context.end_label(self.commands);
            if let Some(dispatched) = &mut queues.dispatched {
                dispatched.push((pass.name, size));
            }
            if limit.is_some() && n < last {
                self.cut(queues)?;
            }
        }
        self.count_cpu(queues, pass.name)
    }

    fn dispatch_band(&mut self, queues: &mut DeviceQueues, dispatch: &Dispatch, band: &Band, work: Work) {
        self.expected += work.expected;
        let Dispatch { pipeline, pass, .. } = *dispatch;
        let (device, commands) = (&self.context.device, self.commands);
        // Before any query begins, because lavapipe reads the pipeline then.
        // SAFETY: the pipeline is alive until the device is done.
        unsafe { device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, pipeline.handle) };
        let is_first = band.base == [0, 0, 0] || self.context.faults.breaks(Command::DispatchBase);
        let ([x, y, z], [wide, high, deep]) = (band.base, band.groups);
        let is_counted = pass.reads(dispatch.scene, dispatch.args).iter().any(|bind| bind.part == Part::Groups);
        let repeat = || {
            for n in 0..self.context.faults.times(pass.name) {
                // Repetitions of a slowed pass must not overlap.
                if n > 0 {
                    flush(device, commands, vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
                }
                // SAFETY: everything the pipeline's layout names was bound, and it allows a base; extents are within limits checked with
                // the formats.
                unsafe {
                    match &self.groups {
                        Some(_) if is_counted && self.context.faults.breaks(Command::DispatchIndirect) => {}
                        Some(groups) if is_counted => device.cmd_dispatch_indirect(commands, groups.handle, 0),
                        // Synchronization validation of older layers (1.3.239) ignores dispatches with a base.
                        _ if is_first => device.cmd_dispatch(commands, wide, high, deep),
                        _ => device.cmd_dispatch_base(commands, x, y, z, wide, high, deep),
                    }
                }
            }
        };
        match (&mut self.stamps, self.time_stamps) {
            (Some(stamps), TimeStamps::EachPass) => {
                stamps.dispatch(commands, pass.name, self.runs, vec![work], repeat);
                self.after_stamp(queues);
            }
            _ => {
                repeat();
                self.open.push(work);
            }
        }
        self.context.counts.dispatches.fetch_add(1, Ordering::Relaxed);
    }

    /// Copies the numbers of workgroups that passes have left in a slot to where the next counted dispatch reads them.
    fn copy_groups(&mut self, queues: &mut DeviceQueues, dispatch: &Dispatch, slot: Slot) -> Result<(), GpuError> {
        let Some(image) = dispatch.slots.image(slot, 0) else { return Ok(()) };
        self.barrier(queues, &[Access::of_slot(slot, 0, 0..1, false, PipelineStage::Copy)]);
        if self.groups.is_none() {
            let bytes = image.shape.texels() * image.format.texel_bytes() as u64;
            self.groups = Some(Buffer::new(&self.context, "groups", bytes, Purpose::Groups)?);
        }
        let Some(groups) = &self.groups else { return Ok(()) };
        let (device, commands) = (&self.context.device, self.commands);
        let indirect = (vk::PipelineStageFlags2::DRAW_INDIRECT, vk::AccessFlags2::INDIRECT_COMMAND_READ);
        let copied = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE);
        // The buffer belongs to this recorder alone: an earlier dispatch may still read it.
        // SAFETY: the command buffer is being recorded, outside any render pass.
        unsafe { memory_barrier(device, commands, (indirect.0, vk::AccessFlags2::NONE), copied) };
        let region = region(image, 0..1, 0..image.extent.height, BufferLayout::default());
        // SAFETY: the buffer is as large as the image and both live until the device is done.
        unsafe {
            device.cmd_copy_image_to_buffer(commands, image.handle, vk::ImageLayout::GENERAL, groups.handle, &[region]);
            memory_barrier(device, commands, copied, indirect);
        }
        Ok(())
    }

    /// Copies parameters into the uniform buffer; returns their byte offset.
    fn place_params(&mut self, block: &[u8]) -> Result<u64, GpuError> {
        let alignment = self.context.candidate.limits.min_uniform_buffer_offset_alignment.max(16);
        let offset = self.params_used.next_multiple_of(alignment);
        let end = offset + block.len() as u64;
        if end > PARAMS_BYTES {
            let what = "parameters of one command buffer".into();
            return Err(GpuError::Limit { what, needed: end, allowed: PARAMS_BYTES });
        }
        self.params.write(offset as usize, block);
        self.params_used = end;
        Ok(offset)
    }

    /// Writes a time stamp if each pass is timed. `name`: the work since the previous stamp. Where CPU time is counted, this submits what was
    /// recorded and waits for it.
    ///
    /// # Errors
    /// The device fails, where CPU time is counted.
    pub fn stamp(&mut self, queues: &mut DeviceQueues, name: &'static str) -> Result<(), GpuError> {
        if let Some(stamps) = self.stamps.as_mut().filter(|_| self.time_stamps == TimeStamps::EachPass) {
            stamps.end_of(self.commands, name, self.runs, Vec::new());
            self.after_stamp(queues);
        }
        self.count_cpu(queues, name)
    }

    fn barrier(&self, queues: &mut DeviceQueues, accesses: &[Access]) {
        queues.before(&self.context, self.queue, self.commands, accesses);
    }
}

/// Records a barrier: everything before it is done, and its writes are visible to `memory` accesses after it.
fn flush(device: &ash::Device, commands: vk::CommandBuffer, memory: vk::AccessFlags2) {
    let all = vk::PipelineStageFlags2::ALL_COMMANDS;
    // SAFETY: the command buffer is being recorded, outside any render pass.
    unsafe { memory_barrier(device, commands, (all, memory & vk::AccessFlags2::MEMORY_WRITE), (all, memory)) };
}

/// Records an execution barrier between everything before and after it. It covers no memory, so that validation still notices a
/// memory barrier that is missing.
fn serialize(device: &ash::Device, commands: vk::CommandBuffer, queue: usize, queues: &mut DeviceQueues) {
    flush(device, commands, vk::AccessFlags2::NONE);
    queues.log.iter_mut().for_each(|log| log.event(queue, Event::Serialize));
}

/// What a binding refers to.
enum Descriptor {
    Image([vk::DescriptorImageInfo; 1]),
    Buffer([vk::DescriptorBufferInfo; 1]),
    Texels([vk::BufferView; 1]),
}

impl CommandRecorder {
    /// Binds the slots under the names that the shader gives them, and the parameters.
    fn bind<'a>(&mut self, dispatch: &Dispatch<'a>, params_offset: u64, params_size: u64) -> Result<(), GpuError> {
        let Dispatch { slots, pipeline, scene, pass, args } = *dispatch;
        let binds = [pass.reads(scene, args), pass.writes(scene, args)].concat();
        let buffer = |buffer, offset, range| Descriptor::Buffer([vk::DescriptorBufferInfo { buffer, offset, range }]);
        let described = |binding: &'a Binding| {
            let bound = binds.iter().find(|b| b.name == binding.name);
            let descriptor = match (binding.kind, bound.map(|b| (b, slots.get(b.slot, args.image)))) {
                (Kind::Params, _) => buffer(self.params.handle, params_offset, params_size),
                (Kind::Texels(components), Some((_, Resource::Buffer(table)))) => {
                    Descriptor::Texels([table.texels(components)])
                }
                (_, Some((_, Resource::Buffer(table)))) => buffer(table.handle, 0, vk::WHOLE_SIZE),
                (_, Some((bind, Resource::Image(image)))) => {
                    let image_view = match bind.part {
                        Part::Layers => image.raw.views[1 + args.layer as usize],
                        _ => image.raw.views[0],
                    };
                    // Bindings that have no sampler ignore it.
                    let (sampler, image_layout) = (pipeline.sampler, vk::ImageLayout::GENERAL);
                    Descriptor::Image([vk::DescriptorImageInfo { sampler, image_view, image_layout }])
                }
                // Cannot happen: the interface of pass and shader was checked when the pipeline was made.
                (_, None) => return None,
            };
            Some((binding, descriptor))
        };
        let described: Vec<_> = pipeline.module.bindings.iter().filter_map(described).collect();
        // Push descriptors need no set.
        let set = match self.context.push_descriptor {
            Some(_) => vk::DescriptorSet::null(),
            None => self.sets.take(pipeline)?,
        };
        let writes: Vec<_> = described
            .iter()
            .map(|(binding, descriptor)| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(binding.binding)
                    .descriptor_type(descriptor_type(binding.kind));
                match descriptor {
                    Descriptor::Image(image) => write.image_info(image),
                    Descriptor::Buffer(buffer) => write.buffer_info(buffer),
                    Descriptor::Texels(view) => write.texel_buffer_view(view),
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

impl CommandRecorder {
    /// Moves the images of these slots from UNDEFINED to GENERAL and clears them to zero. Passes rely on that: they never write pixels outside the
    /// sector.
    pub(crate) fn clear_new(&mut self, queues: &mut DeviceQueues, slots: &SlotResources, new: &[(Slot, u32)]) {
        let images: Vec<(&Image, Slot, u32)> =
            new.iter().filter_map(|&(slot, n)| slots.image(slot, n).map(|image| (image, slot, n))).collect();
        // The memory may have belonged to other images before.
        let before =
            (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE, vk::ImageLayout::UNDEFINED);
        let after = (vk::PipelineStageFlags2::ALL_TRANSFER, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::GENERAL);
        let (device, handles) = (&self.context.device, images.iter().map(|(image, ..)| image.handle));
        // SAFETY: the images are new, alive, and used by nothing yet.
        unsafe { image_barrier(device, self.commands, handles, before, after) };
        for (image, slot, n) in images {
            let access = Access::of_slot(slot, n, 0..image.shape.parts(), true, PipelineStage::Copy);
            self.barrier(queues, &[access]);
            let poison = self.context.faults.poisoned().filter(|_| !slot.starts_clear());
            let cleared = if self.context.faults.breaks(Command::Clear) { 1.0 } else { 0.0 };
            let value =
                poison.map_or(vk::ClearColorValue { float32: [cleared; 4] }, |p| formats::clear_value(p, image.format));
            // SAFETY: the image is in GENERAL since the transition above.
            unsafe {
                device.cmd_clear_color_image(self.commands, image.handle, vk::ImageLayout::GENERAL, &value, &[WHOLE]);
            }
        }
    }

    /// Copies texels of a staging buffer into layers or slices of an image.
    pub(crate) fn copy_in(
        &mut self,
        queues: &mut DeviceQueues,
        (from, layout): (&Buffer, BufferLayout),
        image: &Image,
        to: SlotParts,
    ) {
        let parts = to.parts.clone();
        self.barrier(queues, &[Access::of_slot(to.slot, to.copy, to.parts, true, PipelineStage::Copy)]);
        let rows = 0..image.extent.height;
        let regions: Vec<_> = match layout.descending {
            None => vec![region(image, parts, rows, layout)],
            Some(bytes) => std::iter::successors(Some(layout.offset), |offset| Some(offset + bytes))
                .zip(parts.rev())
                .map(|(offset, part)| region(image, part..part + 1, rows.clone(), BufferLayout { offset, ..layout }))
                .collect(),
        };
        // The buffer holds the bytes of these parts: its maker sized it so.
        self.copy_to_image(from, image, regions);
    }

    /// Both must live until the device is done, and the buffer must hold the bytes of the regions.
    fn copy_to_image(&self, from: &Buffer, image: &Image, mut regions: Vec<vk::BufferImageCopy>) {
        let several = |r: &vk::BufferImageCopy| r.image_subresource.layer_count > 1 || r.image_extent.depth > 1;
        if regions.iter().any(several) && self.context.faults.breaks(Command::CopyToImage) {
            regions.iter_mut().for_each(|r| (r.image_subresource.layer_count, r.image_extent.depth) = (1, 1));
        }
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: as the function demands; the image is in GENERAL since it was made.
        unsafe {
            self.context.device.cmd_copy_buffer_to_image(self.commands, from.handle, image.handle, layout, &regions);
        }
    }

    /// For a validation layer that does not see waits for timelines, records a barrier that states that everything submitted so far has finished. For
    /// other layers nothing is recorded.
    pub(crate) fn show_layer_the_wait(&self) {
        if self.context.layer_misses_waits() {
            flush(&self.context.device, self.commands, vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
        }
    }

    /// Copies the texels of an upload into the parts of an image that it was made for.
    pub fn upload(&mut self, queues: &mut DeviceQueues, from: &Upload, image: &Image) {
        let SlotParts { slot, copy, parts } = from.to.clone();
        self.barrier(queues, &[Access::of_slot(slot, copy, parts, true, PipelineStage::Copy)]);
        for (piece, buffer) in &from.pieces {
            let region = region(image, piece.parts.clone(), piece.rows.clone(), BufferLayout::default());
            self.copy_to_image(buffer, image, vec![region]);
        }
    }

    /// Copies a complete image into the buffers of a readback and makes them visible to the host. `of`: its slot, and the volume image.
    pub(crate) fn copy_out(&mut self, queues: &mut DeviceQueues, image: &Image, of: (Slot, u32), to: &Readback) {
        let SlotParts { slot, copy, parts } = image.all_parts(of);
        let read = Access::of_slot(slot, copy, parts, false, PipelineStage::Copy);
        let resource = barriers::Resource::Readback;
        let write = Access { resource, parts: 0..1, write: true, stage: PipelineStage::Copy };
        self.barrier(queues, &[read, write]);
        let (device, general) = (&self.context.device, vk::ImageLayout::GENERAL);
        for (piece, buffer) in &to.pieces {
            let region = [region(image, piece.parts.clone(), piece.rows.clone(), BufferLayout::default())];
            if !self.context.faults.breaks(Command::CopyToBuffer) {
                // SAFETY: the buffer is as large as its piece of the image and both live until the device is done.
                unsafe {
                    device.cmd_copy_image_to_buffer(self.commands, image.handle, general, buffer.handle, &region)
                };
            }
        }
        self.barrier(queues, &[Access { resource, parts: 0..1, write: false, stage: PipelineStage::Host }]);
    }
}

/// The copy region of layers or slices, and of rows in each of them.
fn region(image: &Image, parts: Range<u32>, rows: Range<u32>, layout: BufferLayout) -> vk::BufferImageCopy {
    let (part, parts) = (parts.start, parts.end - parts.start);
    let is_volume = image.extent.depth > 1 || matches!(image.shape, Shape::Three(_));
    let (layer, layers, z, depth) = if is_volume { (0, 1, part, parts) } else { (part, parts, 0, 1) };
    vk::BufferImageCopy {
        buffer_offset: layout.offset,
        buffer_row_length: layout.row_length,
        buffer_image_height: layout.image_height,
        image_subresource: vk::ImageSubresourceLayers { base_array_layer: layer, layer_count: layers, ..COLOUR },
        image_offset: vk::Offset3D { x: 0, y: rows.start as i32, z: z as i32 },
        image_extent: vk::Extent3D { width: image.extent.width, height: rows.end - rows.start, depth },
    }
}

impl Drop for CommandRecorder {
    fn drop(&mut self) {
        // SAFETY: the owner waited for the device before it drops its recorders. The pool frees its command buffer.
        self.context.destroy(|device| unsafe { device.destroy_command_pool(self.pool, None) });
    }
}
