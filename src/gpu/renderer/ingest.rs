//! Stage 1: frames arrive complete or line by line, in a ring of staging buffers, and are converted into slices of a volume
//! image. If frames need no conversion, consecutive slices are copied in batches.

use super::*;
use crate::source::StoredType;

impl InFlight {
    /// The recorder that reads the staging buffer.
    fn first(&mut self) -> &mut Recorder {
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

    /// Copies the staging buffer into an image, in a submission of its own if there is a queue for copies. The recorder of the
    /// frame is open afterwards.
    fn copy(
        &mut self,
        barriers: &mut BarrierRecorder,
        timelines: &mut Timelines,
        slots: &SlotResources,
        place: SlotParts,
    ) -> Result<(), GpuError> {
        if let Some(target) = slots.image(place.slot, place.copy) {
            let InFlight { copier, recorder, staging } = self;
            let by = copier.as_mut().unwrap_or(recorder);
            by.copy_in(barriers, (staging, BufferLayout::default()), target, place);
            by.stamp(barriers, "upload");
        }
        if let Some(copier) = &mut self.copier {
            copier.submit(barriers, timelines)?;
            self.recorder.begin(barriers, timelines)?;
        }
        Ok(())
    }
}

impl Renderer {
    /// Submits one frame to stage 1, which writes slice `slice` of volume image `image`. `bytes` are samples of the stored type,
    /// line by line. Returns when the bytes are copied; waits only if the ring is full. A frame that is not visible in this
    /// scene is skipped and counted.
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

    /// Takes scan lines of a frame as they arrive, from line `first` on. Returns true if they completed the frame, which then went
    /// to stage 1. Lines arrive in order. Line 0 begins a frame; a frame that was not complete is dropped and counted.
    ///
    /// # Errors
    /// A partial line, lines out of order, or too many; a slice or image that does not exist; a device that fails.
    pub fn lines(&mut self, slice: u32, first: u32, bytes: &[u8], image: u32) -> Result<bool, GpuError> {
        self.check(image)?;
        if slice >= self.scene.slices() {
            return Err(GpuError::FrameSlice { slice, slices: self.scene.slices() });
        }
        let (frame_bytes, line) = (self.frame_bytes(), self.frame_bytes() / self.scene.frame_size()[1] as usize);
        let at = first as usize * line;
        let follows = self.partial.as_ref().is_some_and(|a| (a.slice, a.image, a.received) == (slice, image, at));
        // No lines are kept of a frame that is not visible, so the order of its lines is not checked.
        let is_visible = self.scene.visible_frames().contains(&slice);
        if !bytes.len().is_multiple_of(line)
            || at + bytes.len() > frame_bytes
            || !(first == 0 || follows || !is_visible)
        {
            let received = self.partial.as_ref().map_or(0, |a| a.received / line) as u32;
            return Err(GpuError::FrameLines { slice, first, bytes: bytes.len(), received });
        }
        self.filtered_bounds = self.scene.visible_bounds;
        if !is_visible {
            self.skipped += u64::from(first == 0);
            return Ok(at + bytes.len() == frame_bytes);
        }
        if first == 0 && self.partial.take().is_some() {
            self.incomplete += 1;
        }
        let offset = match chain::copied(&self.scene) {
            Some(_) => self.batch_offset(slice, image)?,
            None if first == 0 => {
                self.wait_for_ring()?;
                0
            }
            None => 0,
        };
        let staging = self.ring[self.ring_index].staging.bytes_mut();
        let staged = staged_bytes(&self.scene) as usize;
        let widening = staged / frame_bytes;
        let (from, to) = (offset + widening * at, offset + widening * (at + bytes.len()));
        let stage = stage_of(&self.scene);
        self.timings.host("stage", || stage(bytes, &mut staging[from..to]));
        if at + bytes.len() == frame_bytes {
            self.context.faults.frame(&self.scene, &mut staging[offset..offset + staged]);
        }
        if at + bytes.len() < frame_bytes {
            self.partial = Some(PartialFrame { slice, image, received: at + bytes.len() });
            return Ok(false);
        }
        self.partial = None;
        match chain::copied(&self.scene) {
            Some(_) => self.extend_batch()?,
            None => self.ingest(slice, image)?,
        }
        self.unprocessed[image as usize][slice as usize] = true;
        Ok(true)
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

    /// Submits the frame in the next entry's staging buffer: a copy to its layer, then the passes of stage 1.
    fn ingest(&mut self, slice: u32, image: u32) -> Result<(), GpuError> {
        let layer = self.ring_index;
        self.ring_index = (layer + 1) % self.ring.len();
        let (entry, layer) = (&mut self.ring[layer], layer as u32);
        entry.first().begin(&mut self.barriers, &self.timelines)?;
        let place = SlotParts { slot: Slot::Frames, copy: 0, parts: layer..layer + 1 };
        entry.copy(&mut self.barriers, &mut self.timelines, &self.slots, place)?;
        for (i, step) in self.plan.steps_of(Frequency::Frame) {
            let args = DispatchArgs { layer, slice, slices: 1, iteration: step.iteration, image };
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            entry
                .recorder
                .dispatch(&mut self.barriers, &Dispatch { slots, pipeline, scene, pass: step.pass, args: &args })?;
        }
        let (recorder, barriers, timelines) = (&mut entry.recorder, &mut self.barriers, &mut self.timelines);
        self.timings.host("submit", || recorder.submit(barriers, timelines))
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

/// How samples are written into the staging buffer. A format that holds v/255 or v/65535 only rounded gets the nearest value to it.
fn stage_of(scene: &Scene) -> fn(&[u8], &mut [u8]) {
    match (scene.input.stored, chain::copied(scene).map(|slot| slot.format(scene))) {
        // 65535 is 255 times 257.
        (StoredType::U8, Some(Format::R16)) => |from, to| widen(from, to, |[v]| (257 * u16::from(v)).to_ne_bytes()),
        (StoredType::U8, Some(Format::R32f)) => |from, to| widen(from, to, |[v]| (f32::from(v) / 255.0).to_ne_bytes()),
        (StoredType::U16, Some(Format::R32f)) => {
            |from, to| widen(from, to, |v| (f32::from(u16::from_ne_bytes(v)) / 65535.0).to_ne_bytes())
        }
        (StoredType::F32, Some(_)) => copy_clamped,
        _ => |from, to| to.copy_from_slice(from),
    }
}

/// Writes each sample of N bytes as one of M bytes.
fn widen<const N: usize, const M: usize>(from: &[u8], to: &mut [u8], wide: impl Fn([u8; N]) -> [u8; M]) {
    let (from, _) = from.as_chunks::<N>();
    let (to, _) = to.as_chunks_mut::<M>();
    from.iter().zip(to).for_each(|(from, to)| *to = wide(*from));
}

/// Copies 32-bit floats, as 0..1: no pass clamps them where they are stored unchanged.
fn copy_clamped(from: &[u8], to: &mut [u8]) {
    for (from, to) in from.chunks_exact(4).zip(to.chunks_exact_mut(4)) {
        let value = f32::from_ne_bytes([from[0], from[1], from[2], from[3]]);
        let value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        to.copy_from_slice(&value.to_ne_bytes());
    }
}

/// Maximum bytes of a batch, unless a single slice is larger. Copying so much takes far longer than submitting it.
const BATCH_BYTES: u64 = 4 << 20;

/// Number of frames that the staging buffer of a ring entry holds.
fn frames_per_upload(scene: &Scene) -> u64 {
    match chain::copied(scene) {
        Some(_) => (BATCH_BYTES / staged_bytes(scene)).clamp(1, u64::from(scene.slices())),
        None => 1,
    }
}

impl Renderer {
    /// Allocates the ring.
    pub(super) fn new_ring(&self) -> Result<Vec<InFlight>, GpuError> {
        let (context, count) = (&self.context, self.barriers.queues.count());
        let bytes = frames_per_upload(&self.scene) * staged_bytes(&self.scene);
        let (copy, ingest) = (QueueRole::Copy.queue(count), QueueRole::Ingest.queue(count));
        // Slices of a 3D image are not subresources: not every queue can copy a single one.
        let copies = copy != ingest && (chain::copied(&self.scene).is_none() || context.queue(copy).copies_slices);
        let entry = |_| {
            let copier = || Recorder::new(context, copy, "copy", self.time_stamps, false);
            Ok(InFlight {
                copier: copies.then(copier).transpose()?,
                recorder: Recorder::new(context, ingest, "frame", self.time_stamps, self.spans)?,
                staging: Buffer::new(context, "staging", bytes, Purpose::Staging)?,
            })
        };
        (0..FRAMES_IN_FLIGHT).map(entry).collect()
    }

    /// Byte offset of this slice in the next entry's staging buffer: after the batch, which is submitted first if the slice does
    /// not follow it.
    fn batch_offset(&mut self, slice: u32, image: u32) -> Result<usize, GpuError> {
        let follows = |s: &SliceBatch| s.image == image && s.first + s.count == slice;
        if self.batch.as_ref().is_some_and(|batch| !follows(batch)) {
            self.flush()?;
            // A batch that is left holds only lines of a dropped frame.
            self.batch = None;
        }
        if self.batch.is_none() {
            self.wait_for_ring()?;
        }
        let batch = self.batch.get_or_insert(SliceBatch { image, first: slice, count: 0 });
        Ok(batch.count as usize * staged_bytes(&self.scene) as usize)
    }

    /// Adds a complete slice to the batch, and submits the batch when it is full.
    fn extend_batch(&mut self) -> Result<(), GpuError> {
        let Some(batch) = &mut self.batch else { return Ok(()) };
        batch.count += 1;
        let next = (u64::from(batch.count) + 1) * staged_bytes(&self.scene);
        match next > self.ring[self.ring_index].staging.size {
            true => self.flush(),
            false => Ok(()),
        }
    }

    /// Submits the batch. The lines of an incomplete frame move to the next entry.
    pub(super) fn flush(&mut self) -> Result<(), GpuError> {
        let Some(slot) = chain::copied(&self.scene) else { return Ok(()) };
        let Some(SliceBatch { image, first, count }) = self.batch.take_if(|batch| batch.count > 0) else {
            return Ok(());
        };
        let from = self.ring_index;
        self.ring_index = (from + 1) % FRAMES_IN_FLIGHT as usize;
        let [column, row, slice] = slot.first_texel(&self.scene);
        let place = SlotParts { slot, copy: image, parts: first - slice..first - slice + count };
        // Of each frame what is stored.
        let [row_length, image_height] = self.scene.frame_size();
        let texel = u64::from(row) * u64::from(row_length) + u64::from(column);
        let offset = texel * slot.format(&self.scene).texel_bytes() as u64;
        let layout = BufferLayout { offset, row_length, image_height };
        let entry = &mut self.ring[from];
        entry.submit_copy(&mut self.barriers, &mut self.timelines, &self.slots, (place, layout), &mut self.timings)?;
        let Some((slice, image, received)) = self.partial.as_ref().map(PartialFrame::place) else { return Ok(()) };
        self.wait_for_ring()?;
        let staged = staged_bytes(&self.scene) as usize;
        let (at, received) = (count as usize * staged, received * (staged / self.frame_bytes()));
        let lines = self.ring[from].staging.bytes()[at..at + received].to_vec();
        self.ring[self.ring_index].staging.bytes_mut()[..received].copy_from_slice(&lines);
        self.batch = Some(SliceBatch { image, first: slice, count: 0 });
        Ok(())
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
