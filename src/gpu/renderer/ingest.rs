//! Stage 1: frames arrive in a ring of staging buffers and are converted into slices of a volume image. Consecutive frames form a batch:
//! one submission, and one dispatch of each pass. Frames that need no conversion are only copied.

use super::Program;
use crate::buffers::{Buffer, Purpose, SlotParts};
use crate::command_recorder::{BufferLayout, CommandRecorder};
use crate::context::Context;
use crate::device_queues::DeviceQueues;
use crate::error::GpuError;
use crate::passes::slots::{BATCHES_IN_FLIGHT, Format, batch_bytes, frames_per_batch};
use crate::passes::{DispatchArgs, Frequency, Slot, chain};
use crate::probe::StoredType;
use crate::queues::QueueRole;
use crate::resources::SlotResources;
use crate::scene::Scene;
use crate::timing::TimeStamps;
use std::mem::MaybeUninit;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// An entry of the ring: one upload in flight.
struct InFlight {
    /// Copies the samples, if the device has a queue for copies.
    copier: Option<CommandRecorder>,
    recorder: CommandRecorder,
    staging: Buffer,
}

/// How frames are written into the staging buffers.
#[derive(Clone, Copy)]
struct Staging {
    /// The slot that they are copied into, if no pass converts them.
    copied: Option<Slot>,
    /// Bytes of each.
    bytes: usize,
    /// Number of frames that a buffer holds.
    frames: u32,
    /// A batch may arrive in descending order: its frames are copied one by one, from offsets that every queue can copy from.
    descends: bool,
    write: fn(&[u8], &mut Space),
}

impl Staging {
    /// `max_buffer`: bytes of the largest buffer of the device.
    fn new(scene: &Scene, max_buffer: u64) -> Staging {
        let bytes = staged_bytes(scene);
        let copied = chain::copied(scene);
        let frames = match copied {
            Some(_) => (batch_bytes(scene) / bytes).clamp(1, scene.slices().into()) as u32,
            None => frames_per_batch(scene),
        };
        let frames = u64::from(frames).min(max_buffer / bytes.max(1)).max(1) as u32;
        Staging { copied, bytes: bytes as usize, frames, descends: bytes.is_multiple_of(4), write: stage_of(scene) }
    }
}

/// Consecutive slices in the staging buffer of a ring entry that are not submitted yet, in the order in which they arrived.
struct SliceBatch {
    image: u32,
    first: u32,
    count: u32,
    is_descending: bool,
}

impl SliceBatch {
    /// The slices that would continue it: of the first, both neighbours. None if the buffer is full.
    fn continuations(&self, staging: &Staging) -> impl Iterator<Item = u32> {
        let (is_full, is_first) = (self.count >= staging.frames, self.count == 1);
        let up = (is_first || !self.is_descending).then_some(self.first + self.count);
        let descends = self.is_descending || (is_first && staging.descends);
        let down = descends.then(|| self.first.checked_sub(self.count)).flatten();
        up.into_iter().chain(down).filter(move |_| !is_full)
    }

    fn add(&mut self, slice: u32) {
        self.is_descending = slice < self.first;
        self.count += 1;
    }

    fn slices(&self) -> Range<u32> {
        let low = if self.is_descending { self.first + 1 - self.count } else { self.first };
        low..low + self.count
    }
}

impl InFlight {
    /// Waits until the entry is free, and adds up its times.
    fn collect(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        self.copier.iter_mut().try_for_each(|copier| copier.collect(queues))?;
        self.recorder.collect(queues)
    }

    /// Waits until the entry is free, and keeps its time stamps for [`InFlight::collect`].
    fn set_aside(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        self.copier.iter_mut().try_for_each(|copier| copier.set_aside(queues))?;
        self.recorder.set_aside(queues)
    }

    /// Records a copy of the staging buffer into parts of a slot. Returns what recorded it, for the queue of copies if there is one.
    fn copy(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        (place, layout): (SlotParts, BufferLayout),
        runs: u32,
    ) -> Result<&mut CommandRecorder, GpuError> {
        let by = self.copier.as_mut().unwrap_or(&mut self.recorder);
        by.begin(queues)?;
        by.runs = runs;
        if let Some(target) = slots.image(place.slot, place.copy) {
            by.copy_in(queues, (&self.staging, layout), target, place);
            by.stamp(queues, "upload")?;
        }
        Ok(by)
    }
}

/// The staging ring: frames on their way into volume images. Every method that returns a [`GpuError`] does so if the device fails or has no memory.
pub(super) struct Ring {
    entries: Vec<InFlight>,
    /// The entry of the batch, or of the next one.
    at: usize,
    staging: Staging,
    /// Frames that will be submitted together.
    batch: Option<SliceBatch>,
    context: Arc<Context>,
    time_stamps: TimeStamps,
    spans: bool,
}

impl Ring {
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        queues: &DeviceQueues,
        time_stamps: TimeStamps,
        spans: bool,
    ) -> Result<Ring, GpuError> {
        let count = queues.tracker.count();
        let staging = Staging::new(scene, context.candidate.max_buffer);
        let bytes = u64::from(staging.frames) * staging.bytes as u64;
        let (copy, ingest) = (QueueRole::Copy.queue(count), QueueRole::Ingest.queue(count));
        // Slices of a 3D image are not subresources: not every queue can copy a single one.
        let copies = copy != ingest && (staging.copied.is_none() || context.queue(copy).copies_slices);
        let entry = |_| {
            let copier = || CommandRecorder::new(context, copy, "copy", time_stamps, false);
            Ok(InFlight {
                copier: copies.then(copier).transpose()?,
                recorder: CommandRecorder::new(context, ingest, "frame", time_stamps, spans)?,
                staging: Buffer::new(context, "staging", bytes, Purpose::Staging)?,
            })
        };
        let entries = (0..BATCHES_IN_FLIGHT).map(entry).collect::<Result<_, GpuError>>()?;
        Ok(Ring { entries, at: 0, staging, batch: None, context: context.clone(), time_stamps, spans })
    }

    /// Makes the staging buffers again for frames of another size, and drops the batch. The device must be idle.
    pub fn restart(&mut self, scene: &Scene, queues: &DeviceQueues) -> Result<(), GpuError> {
        self.batch = None;
        *self = Ring::new(&self.context, scene, queues, self.time_stamps, self.spans)?;
        Ok(())
    }

    /// True if a slice of volume image `image` can be added to the batch; false if no batch has begun.
    pub fn continues(&self, image: u32, slice: u32) -> bool {
        self.batch
            .as_ref()
            .is_some_and(|batch| batch.image == image && batch.continuations(&self.staging).any(|next| next == slice))
    }

    /// True if none of the `visible` slices can be added to the batch, so that it may be submitted.
    pub fn is_complete(&self, visible: Range<u32>) -> bool {
        let grows = |batch: &SliceBatch| batch.continuations(&self.staging).any(|next| visible.contains(&next));
        !self.batch.as_ref().is_some_and(grows)
    }

    /// Appends a frame, which becomes `slice` of volume image `image`, to the batch in the staging buffer. Call [`Ring::wait`] before the
    /// first frame of a batch.
    pub fn write(&mut self, queues: &mut DeviceQueues, image: u32, slice: u32, bytes: &[u8]) {
        let Staging { bytes: length, write, .. } = self.staging;
        let at = self.batch.as_ref().map_or(0, |batch| batch.count as usize) * length;
        let space = self.entries[self.at].staging.space();
        queues.host("stage", |_| write(bytes, &mut space[at..at + length]));
        self.context.counts.staged.fetch_add(length as u64, Ordering::Relaxed);
        match &mut self.batch {
            Some(batch) => batch.add(slice),
            None => self.batch = Some(SliceBatch { image, first: slice, count: 1, is_descending: false }),
        }
    }

    /// True if the next frame can be written without waiting for the device.
    pub fn is_free(&self, queues: &DeviceQueues) -> Result<bool, GpuError> {
        // The buffer of a batch that has begun was waited for; it ends with a frame that needs the next one.
        let next = if self.batch.is_some() { self.at + 1 } else { self.at };
        let entry = &self.entries[next % self.entries.len()];
        let is_copied = entry.copier.as_ref().map_or(Ok(true), |copier| copier.is_done(queues))?;
        Ok(is_copied && entry.recorder.is_done(queues)?)
    }

    /// True if frames are only copied into the volume and no pass converts them. Submitting a slice then takes longer than copying it.
    pub(crate) fn only_copies(&self) -> bool {
        self.staging.copied.is_some()
    }

    /// Waits until the next entry of the ring is free, and adds up the times of its last submission. `is_drawing`: a picture is in flight.
    pub fn wait(&mut self, queues: &mut DeviceQueues, is_drawing: bool) -> Result<(), GpuError> {
        let entry = &mut self.entries[self.at];
        // Reading time stamps makes lavapipe wait for the complete device (Mesa 22.3, `lvp_GetQueryPoolResults`), also for a picture in
        // flight. Those of this entry are then read when no picture is in flight.
        match is_drawing && self.context.candidate.is_software() {
            true => entry.set_aside(queues),
            false => entry.collect(queues),
        }
    }

    /// Waits until all entries of the ring are free, and adds up the times of their last submissions.
    pub fn collect(&mut self, queues: &mut DeviceQueues) -> Result<(), GpuError> {
        self.entries.iter_mut().try_for_each(|entry| entry.collect(queues))
    }

    /// Submits the batch. If that fails it is kept, and submitted again with the next frame.
    pub fn flush(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        program: &Program,
    ) -> Result<(), GpuError> {
        let Some(batch) = &self.batch else { return Ok(()) };
        let (image, slices) = (batch.image, batch.slices());
        let layout = BufferLayout {
            descending: (batch.is_descending && batch.count > 1).then_some(self.staging.bytes as u64),
            ..BufferLayout::default()
        };
        match self.staging.copied {
            Some(slot) => {
                let copy = copy_of_slices(slot, image, slices, &program.scene, layout);
                let by = self.entries[self.at].copy(queues, slots, copy, 1)?;
                queues.host("submit", |queues| by.submit(queues))?;
            }
            None => self.convert(queues, slots, program, (image, slices, layout))?,
        }
        self.batch = None;
        self.at = (self.at + 1) % self.entries.len();
        Ok(())
    }

    /// Submits the frames in the entry's staging buffer: a copy to its layers of the frame array, in a submission of its own if there is a queue for
    /// copies, then the passes of stage 1.
    fn convert(
        &mut self,
        queues: &mut DeviceQueues,
        slots: &SlotResources,
        program: &Program,
        (image, slices, layout): (u32, Range<u32>, BufferLayout),
    ) -> Result<(), GpuError> {
        let (slice, slices) = (slices.start, slices.end - slices.start);
        let layer = self.at as u32 * self.staging.frames;
        let entry = &mut self.entries[self.at];
        let place = SlotParts { slot: Slot::Frames, copy: 0, parts: layer..layer + slices };
        entry.copy(queues, slots, (place, layout), slices)?;
        if let Some(copier) = &mut entry.copier {
            copier.submit(queues)?;
            entry.recorder.begin(queues)?;
            entry.recorder.runs = slices;
        }
        for (i, step) in program.plan.steps_of(Frequency::Frame) {
            let args = DispatchArgs { layer, slice, slices, iteration: step.iteration, image };
            entry.recorder.dispatch(queues, &program.dispatch(i, slots, &args), None)?;
        }
        queues.host("submit", |queues| entry.recorder.submit(queues))
    }
}

/// Where slices of a volume image lie in the staging buffer, if no pass converts them.
fn copy_of_slices(
    slot: Slot,
    image: u32,
    slices: Range<u32>,
    scene: &Scene,
    layout: BufferLayout,
) -> (SlotParts, BufferLayout) {
    let [column, row, first] = slot.first_texel(scene);
    let place = SlotParts { slot, copy: image, parts: slices.start - first..slices.end - first };
    // Of each frame what is stored.
    let [row_length, image_height] = scene.frame_size();
    let texel = u64::from(row) * u64::from(row_length) + u64::from(column);
    let offset = texel * slot.format(scene).texel_bytes() as u64;
    (place, BufferLayout { offset, row_length, image_height, ..layout })
}

/// Size of a frame, bytes.
pub(super) fn frame_bytes(scene: &Scene) -> u64 {
    Slot::Frames.bytes(scene) / u64::from(Slot::Frames.shape(scene).parts())
}

/// Bytes of a frame in the staging buffer: where it is copied into the volume, in the volume's format.
fn staged_bytes(scene: &Scene) -> u64 {
    let [width, height] = scene.frame_size().map(u64::from);
    chain::copied(scene).map_or(frame_bytes(scene), |slot| width * height * slot.format(scene).texel_bytes() as u64)
}

/// Staging memory, which cannot be read.
type Space = [MaybeUninit<u8>];

/// How samples are written into the staging buffer. A format that holds v/255 or v/65535 only rounded gets the nearest value to it.
fn stage_of(scene: &Scene) -> fn(&[u8], &mut Space) {
    match (scene.input.stored, chain::copied(scene).map(|slot| slot.format(scene))) {
        // 65535 is 255 times 257.
        (StoredType::U8, Some(Format::R16)) => |from, to| widen(from, to, |[v]| (257 * u16::from(v)).to_ne_bytes()),
        (StoredType::U8, Some(Format::R32f)) => |from, to| widen(from, to, |[v]| (f32::from(v) / 255.0).to_ne_bytes()),
        (StoredType::U16, Some(Format::R32f)) => {
            |from, to| widen(from, to, |v| (f32::from(u16::from_ne_bytes(v)) / 65535.0).to_ne_bytes())
        }
        (StoredType::F32, Some(_)) => copy_clamped,
        _ => |from, to| _ = to.write_copy_of_slice(from),
    }
}

/// Writes each sample of N bytes as one of M bytes.
fn widen<const N: usize, const M: usize>(from: &[u8], to: &mut Space, wide: impl Fn([u8; N]) -> [u8; M]) {
    let (from, _) = from.as_chunks::<N>();
    let (to, _) = to.as_chunks_mut::<M>();
    from.iter().zip(to).for_each(|(from, to)| *to = wide(*from).map(MaybeUninit::new));
}

/// Copies 32-bit floats, as 0..1: no pass clamps them where they are stored unchanged.
fn copy_clamped(from: &[u8], to: &mut Space) {
    widen(from, to, |sample| {
        let value = f32::from_ne_bytes(sample);
        let value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        value.to_ne_bytes()
    });
}
