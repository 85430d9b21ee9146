//! Stage 1: frames arrive complete or line by line, in a ring of staging buffers, and are converted into slices of a volume
//! image, consecutive ones in a batch: one submission, and one dispatch of each pass. If frames need no conversion, the batch is copied.

use super::*;
use crate::probe::StoredType;
use std::mem::MaybeUninit;
use std::ops::Range;

/// How frames are written into the staging buffers.
#[derive(Clone, Copy)]
pub(super) struct Staging {
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
    pub(super) fn new(scene: &Scene, max_buffer: u64) -> Staging {
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
pub(super) struct SliceBatch {
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
    /// The recorder that reads the staging buffer.
    fn first(&mut self) -> &mut CommandRecorder {
        self.copier.as_mut().unwrap_or(&mut self.recorder)
    }

    /// Waits until the entry is free, and adds up its times.
    pub(super) fn collect(&mut self, timelines: &Timelines, timings: &mut Timings) -> Result<(), GpuError> {
        if let Some(copier) = &mut self.copier {
            copier.collect(timelines, timings)?;
        }
        self.recorder.collect(timelines, timings)
    }

    /// Waits until the entry is free, and keeps its time stamps for [`InFlight::collect`].
    fn set_aside(&mut self, timelines: &Timelines, timings: &mut Timings) -> Result<(), GpuError> {
        if let Some(copier) = &mut self.copier {
            copier.set_aside(timelines, timings)?;
        }
        self.recorder.set_aside(timelines, timings)
    }

    /// Copies the staging buffer into layers of the frame array, in a submission of its own if there is a queue for copies. The
    /// recorder of the frames is open afterwards.
    fn copy(
        &mut self,
        barriers: &mut BarrierRecorder,
        timelines: &mut Timelines,
        slots: &SlotResources,
        (place, layout): (SlotParts, BufferLayout),
    ) -> Result<(), GpuError> {
        let frames = place.parts.len() as u32;
        let by = self.first();
        by.begin(barriers, timelines)?;
        by.runs = frames;
        if let Some(target) = slots.image(place.slot, place.copy) {
            let InFlight { copier, recorder, staging } = self;
            let by = copier.as_mut().unwrap_or(recorder);
            by.copy_in(barriers, (staging, layout), target, place);
            by.stamp(barriers, "upload");
        }
        if let Some(copier) = &mut self.copier {
            copier.submit(barriers, timelines)?;
            self.recorder.begin(barriers, timelines)?;
            self.recorder.runs = frames;
        }
        Ok(())
    }
}

impl Renderer {
    /// Sends one frame to stage 1, which writes slice `slice` of volume image `image`. `bytes` are samples of the stored type,
    /// line by line. Returns when the bytes are copied; waits only if the ring is full. A frame that is not visible in this
    /// scene is skipped and counted.
    ///
    /// Consecutive slices, up or down, go through stage 1 together. The frame waits for its successors until the batch is full, no
    /// visible slice can follow, another slice comes, [`Renderer::submit_frames`] is called, anything reads the volume, or the scene
    /// changes.
    ///
    /// # Errors
    /// A frame of the wrong size, a slice or image that does not exist, a device that fails.
    pub fn frame(&mut self, slice: u32, bytes: &[u8], image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        if bytes.len() != self.frame_bytes() {
            return Err(GpuError::FrameSize { got: bytes.len(), expected: self.frame_bytes() });
        }
        self.lines(slice, 0, bytes, image).map(|_| ())
    }

    /// Takes scan lines of a frame as they arrive, from line `first` on. Returns true if they completed the frame, which then goes
    /// to stage 1 as with [`Renderer::frame`]. Lines arrive in order. Line 0 begins a frame; a frame that was not complete is dropped and counted.
    ///
    /// # Errors
    /// A partial line, lines out of order, or too many; a slice or image that does not exist; a device that fails.
    pub fn lines(&mut self, slice: u32, first: u32, bytes: &[u8], image: u32) -> Result<bool, GpuError> {
        self.check(image)?;
        if slice >= self.scene.slices() {
            return Err(GpuError::FrameSlice { slice, slices: self.scene.slices() });
        }
        let (frame_bytes, line) = (self.frame_bytes(), self.frame_bytes() / self.scene.frame_size()[1] as usize);
        let (at, received) = (first as usize * line, self.received.len());
        let follows = self.partial.as_ref().is_some_and(|a| (a.slice, a.image) == (slice, image)) && received == at;
        // No lines are kept of a frame that is not visible, so the order of its lines is not checked.
        let is_visible = self.scene.visible_frames().contains(&slice);
        if !bytes.len().is_multiple_of(line)
            || at + bytes.len() > frame_bytes
            || !(first == 0 || follows || !is_visible)
        {
            let received = self.partial.as_ref().map_or(0, |_| received / line) as u32;
            return Err(GpuError::FrameLines { slice, first, bytes: bytes.len(), received });
        }
        self.filtered_bounds = self.scene.visible_bounds;
        if !is_visible {
            self.skipped += u64::from(first == 0);
            return Ok(at + bytes.len() == frame_bytes);
        }
        if first == 0 {
            self.received.clear();
            self.incomplete += u64::from(self.partial.take().is_some());
        }
        if at + bytes.len() < frame_bytes {
            self.received.extend_from_slice(bytes);
            self.partial = Some(PartialFrame { slice, image });
            return Ok(false);
        }
        self.partial = None;
        if first == 0 {
            self.send(slice, image, bytes)?;
        } else {
            let mut whole = std::mem::take(&mut self.received);
            whole.extend_from_slice(bytes);
            let sent = self.send(slice, image, &whole);
            // Its memory is for the next frame.
            self.received = whole;
            sent?;
        }
        Ok(true)
    }

    /// Writes a complete frame into the staging buffer, after the batch or after submitting it, and submits the batch that nothing can
    /// follow.
    fn send(&mut self, slice: u32, image: u32, bytes: &[u8]) -> Result<(), GpuError> {
        let follows =
            |batch: &SliceBatch| batch.image == image && batch.continuations(&self.staging).any(|next| next == slice);
        if !self.batch.as_ref().is_some_and(follows) {
            self.flush()?;
            self.wait_for_ring()?;
        }
        let bytes = self.context.faults.changed_frame(&self.scene, bytes);
        let Staging { bytes: length, write, .. } = self.staging;
        let at = self.batch.as_ref().map_or(0, |batch| batch.count as usize) * length;
        let space = self.ring[self.ring_index].staging.space();
        self.timings.host("stage", || write(&bytes, &mut space[at..at + length]));
        match &mut self.batch {
            Some(batch) => batch.add(slice),
            None => self.batch = Some(SliceBatch { image, first: slice, count: 1, is_descending: false }),
        }
        self.unprocessed[image as usize][slice as usize] = true;
        self.found.retain(|(_, of)| *of != image);
        let visible = self.scene.visible_frames();
        let grows = |batch: &SliceBatch| batch.continuations(&self.staging).any(|next| visible.contains(&next));
        if self.batch.as_ref().is_some_and(grows) { Ok(()) } else { self.flush() }
    }

    /// True if the next frame is taken without a wait for the device.
    ///
    /// # Errors
    /// A device that fails.
    pub fn takes_frame(&self) -> Result<bool, GpuError> {
        // The buffer of a batch that has begun was waited for; it ends with a frame that needs the next one.
        let next = if self.batch.is_some() { self.ring_index + 1 } else { self.ring_index };
        let entry = &self.ring[next % self.ring.len()];
        let is_copied = entry.copier.as_ref().map_or(Ok(true), |copier| copier.is_done(&self.timelines))?;
        Ok(is_copied && entry.recorder.is_done(&self.timelines)?)
    }

    /// Submits the frames that wait for their successors, so that the device works on them until more arrive. What is only copied goes on
    /// waiting: submitting a slice takes longer than copying it.
    ///
    /// # Errors
    /// A device that fails.
    pub fn submit_frames(&mut self) -> Result<(), GpuError> {
        if self.staging.copied.is_some() { Ok(()) } else { self.flush() }
    }

    /// Waits until the next entry is free, and adds up its times.
    fn wait_for_ring(&mut self) -> Result<(), GpuError> {
        let entry = &mut self.ring[self.ring_index];
        // Reading time stamps makes lavapipe wait for the complete device (Mesa 22.3, `lvp_GetQueryPoolResults`), also for a picture in
        // flight. Those of this entry are then read when no picture is in flight.
        match self.drawing && self.context.candidate.is_software() {
            true => entry.set_aside(&self.timelines, &mut self.timings),
            false => entry.collect(&self.timelines, &mut self.timings),
        }
    }

    /// Submits the batch. If that fails it is kept, and submitted again with the next frame.
    pub(super) fn flush(&mut self) -> Result<(), GpuError> {
        let Some(batch) = &self.batch else { return Ok(()) };
        let (image, slices) = (batch.image, batch.slices());
        let layout = BufferLayout {
            descending: (batch.is_descending && batch.count > 1).then_some(self.staging.bytes as u64),
            ..BufferLayout::default()
        };
        match self.staging.copied {
            Some(slot) => self.copy_slices(slot, image, slices, layout)?,
            None => self.convert(image, slices, layout)?,
        }
        self.batch = None;
        self.ring_index = (self.ring_index + 1) % self.ring.len();
        Ok(())
    }

    /// Submits the frames in the entry's staging buffer: a copy to its layers, then the passes of stage 1.
    fn convert(&mut self, image: u32, slices: Range<u32>, layout: BufferLayout) -> Result<(), GpuError> {
        let (slice, slices) = (slices.start, slices.end - slices.start);
        let layer = self.ring_index as u32 * self.staging.frames;
        let entry = &mut self.ring[self.ring_index];
        let place = SlotParts { slot: Slot::Frames, copy: 0, parts: layer..layer + slices };
        entry.copy(&mut self.barriers, &mut self.timelines, &self.slots, (place, layout))?;
        for (i, step) in self.plan.steps_of(Frequency::Frame) {
            let args = DispatchArgs { layer, slice, slices, iteration: step.iteration, image };
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            entry
                .recorder
                .dispatch(&mut self.barriers, &Dispatch { slots, pipeline, scene, pass: step.pass, args: &args })?;
        }
        let (recorder, barriers, timelines) = (&mut entry.recorder, &mut self.barriers, &mut self.timelines);
        self.timings.host("submit", || recorder.submit(barriers, timelines))
    }

    /// Submits a copy of the slices in the entry's staging buffer into a volume image. No pass follows it.
    fn copy_slices(
        &mut self,
        slot: Slot,
        image: u32,
        slices: Range<u32>,
        layout: BufferLayout,
    ) -> Result<(), GpuError> {
        let [column, row, first] = slot.first_texel(&self.scene);
        let place = SlotParts { slot, copy: image, parts: slices.start - first..slices.end - first };
        // Of each frame what is stored.
        let [row_length, image_height] = self.scene.frame_size();
        let texel = u64::from(row) * u64::from(row_length) + u64::from(column);
        let offset = texel * slot.format(&self.scene).texel_bytes() as u64;
        let layout = BufferLayout { offset, row_length, image_height, ..layout };
        let entry = &mut self.ring[self.ring_index];
        entry.submit_copy(&mut self.barriers, &mut self.timelines, &self.slots, (place, layout), &mut self.timings)
    }

    /// Number of frames that were dropped because another began before all of their lines had arrived.
    pub fn incomplete_frames(&self) -> u64 {
        self.incomplete
    }
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

impl Renderer {
    /// Allocates the ring.
    pub(super) fn new_ring(&self) -> Result<Vec<InFlight>, GpuError> {
        let (context, count) = (&self.context, self.barriers.queues.count());
        let bytes = u64::from(self.staging.frames) * self.staging.bytes as u64;
        let (copy, ingest) = (QueueRole::Copy.queue(count), QueueRole::Ingest.queue(count));
        // Slices of a 3D image are not subresources: not every queue can copy a single one.
        let copies = copy != ingest && (self.staging.copied.is_none() || context.queue(copy).copies_slices);
        let entry = |_| {
            let copier = || CommandRecorder::new(context, copy, "copy", self.time_stamps, false);
            Ok(InFlight {
                copier: copies.then(copier).transpose()?,
                recorder: CommandRecorder::new(context, ingest, "frame", self.time_stamps, self.spans)?,
                staging: Buffer::new(context, "staging", bytes, Purpose::Staging)?,
            })
        };
        (0..BATCHES_IN_FLIGHT).map(entry).collect()
    }
}

impl InFlight {
    /// Submits the copy of the staging buffer into an image. No pass follows it.
    fn submit_copy(
        &mut self,
        barriers: &mut BarrierRecorder,
        timelines: &mut Timelines,
        slots: &SlotResources,
        (place, layout): (SlotParts, BufferLayout),
        timings: &mut Timings,
    ) -> Result<(), GpuError> {
        let by = self.copier.as_mut().unwrap_or(&mut self.recorder);
        by.begin(barriers, timelines)?;
        if let Some(target) = slots.image(place.slot, place.copy) {
            by.copy_in(barriers, (&self.staging, layout), target, place);
            by.stamp(barriers, "upload");
        }
        timings.host("submit", || by.submit(barriers, timelines))
    }
}
