//! Frames on their way in: whole or line by line, through the ring of lanes and stage 1 into their slices.

use super::*;

/// A frame some of whose lines lie in a lane's staging buffer.
pub struct Arriving {
    slice: u32,
    image: u32,
    /// Bytes that are there.
    there: usize,
}

impl Arriving {
    /// Its slice, its volume image, and the bytes of it that are there.
    pub(super) fn place(&self) -> (u32, u32, usize) {
        (self.slice, self.image, self.there)
    }
}

impl Lane {
    /// The first recorder of the two: what the staging buffer is read by.
    fn first(&mut self) -> &mut Recorder {
        self.copier.as_mut().unwrap_or(&mut self.recorder)
    }

    /// Waits until the lane is free, and adds up what it measured.
    pub(super) fn collect(&mut self, timelines: &Timelines, measured: &mut Measured) -> Result<(), GpuError> {
        if let Some(copier) = &mut self.copier {
            copier.collect(timelines, measured)?;
        }
        self.recorder.collect(timelines, measured)
    }

    /// Copies what lies in the staging buffer to its place, and sends that off where a queue of its own does it. The recorder of the
    /// frame is open afterwards.
    pub(super) fn copy(
        &mut self,
        order: &mut BarrierRecorder,
        timelines: &mut Timelines,
        slots: &Slots,
        place: Place,
    ) -> Result<(), GpuError> {
        if let Some(target) = slots.image(place.slot, place.copy) {
            let Lane { copier, recorder, staging } = self;
            let by = copier.as_mut().unwrap_or(recorder);
            by.copy_in(order, staging, target, place);
            by.stamp("upload");
        }
        if let Some(copier) = &mut self.copier {
            copier.submit(order, timelines)?;
            self.recorder.begin(order, timelines)?;
        }
        Ok(())
    }
}

impl Renderer {
    /// Sends one frame through stage 1 into its slice of volume image `image`. Returns once the frame's bytes are copied; the
    /// device works on. Waits only when the ring is full. A frame that nothing of this scene can see is left out and counted.
    ///
    /// # Errors
    /// A frame of the wrong size, a slice that is not there, a device that fails.
    pub fn frame(&mut self, slice: u32, bytes: &[u8], image: u32) -> Result<(), GpuError> {
        self.check(image)?;
        if bytes.len() != self.frame_bytes() {
            return Err(GpuError::FrameSize { got: bytes.len(), expected: self.frame_bytes() });
        }
        self.lines(slice, 0, bytes, image).map(|_| ())
    }

    /// Lines of a frame as they arrive, from line `first` on; true when the frame was whole with them and went through stage 1. Lines of
    /// a frame follow one another; with line 0 a frame begins, and one that was not whole is given up and counted.
    ///
    /// # Errors
    /// Lines that are no whole ones, do not follow those before, or are too many; a slice or an image that is not there; a device that
    /// fails.
    pub fn lines(&mut self, slice: u32, first: u32, bytes: &[u8], image: u32) -> Result<bool, GpuError> {
        self.check(image)?;
        if slice >= self.scene.slices() {
            return Err(GpuError::FrameSlice { slice, slices: self.scene.slices() });
        }
        let (whole, line) = (self.frame_bytes(), self.frame_bytes() / self.scene.frame_size()[1] as usize);
        let at = first as usize * line;
        let follows = self.arriving.as_ref().is_some_and(|a| (a.slice, a.image, a.there) == (slice, image, at));
        // Of what is not seen nothing is kept, so nothing is there to follow.
        let seen = self.scene.frames_seen().contains(&slice);
        if !bytes.len().is_multiple_of(line) || at + bytes.len() > whole || !(first == 0 || follows || !seen) {
            let there = self.arriving.as_ref().map_or(0, |a| a.there / line) as u32;
            return Err(GpuError::FrameLines { slice, first, bytes: bytes.len(), there });
        }
        self.filtered = self.scene.seen;
        if !seen {
            self.skipped += u64::from(first == 0);
            return Ok(at + bytes.len() == whole);
        }
        if first == 0 && self.arriving.take().is_some() {
            self.torn += 1;
        }
        let offset = match chain::copied(&self.scene) {
            Some(_) => self.gather(slice, image)?,
            None if first == 0 => {
                self.free_lane()?;
                0
            }
            None => 0,
        };
        let staging = self.lanes[self.next_lane].staging.bytes_mut();
        let (from, to) = (offset + at, offset + at + bytes.len());
        self.measured.host("stage", || staging[from..to].copy_from_slice(bytes));
        if at + bytes.len() == whole {
            self.context.faults.frame(&self.scene, &mut staging[offset..offset + whole]);
        }
        if at + bytes.len() < whole {
            self.arriving = Some(Arriving { slice, image, there: at + bytes.len() });
            return Ok(false);
        }
        self.arriving = None;
        match chain::copied(&self.scene) {
            Some(_) => self.gathered()?,
            None => self.ingest(slice, image)?,
        }
        self.unseen[image as usize][slice as usize] = true;
        Ok(true)
    }

    /// Waits until the next lane is free, and adds up what it measured.
    pub(super) fn free_lane(&mut self) -> Result<(), GpuError> {
        let lane = &mut self.lanes[self.next_lane];
        // lavapipe waits for all of the device before it gives any time stamp (Mesa 22.3, `lvp_GetQueryPoolResults`), and so for a picture
        // that is on its way: the lane's times are then left out, of which frames in between pictures have enough.
        match self.drawing && self.context.candidate.is_software() {
            true => lane.first().wait(&self.timelines),
            false => lane.collect(&self.timelines, &mut self.measured),
        }
    }

    /// The frame that lies in the next lane's staging buffer, to its layer and through stage 1.
    fn ingest(&mut self, slice: u32, image: u32) -> Result<(), GpuError> {
        let layer = self.next_lane;
        self.next_lane = (layer + 1) % self.lanes.len();
        let (lane, layer) = (&mut self.lanes[layer], layer as u32);
        lane.first().begin(&mut self.order, &self.timelines)?;
        let place = Place { slot: Slot::Frames, copy: 0, parts: layer..layer + 1 };
        lane.copy(&mut self.order, &mut self.timelines, &self.slots, place)?;
        for (i, step) in self.plan.steps_of(Frequency::Frame) {
            let args = DispatchArgs { layer, slice, slices: 1, iteration: step.iteration, image };
            let (slots, pipeline, scene) = (&self.slots, &*self.steps[i], &self.scene);
            lane.recorder.dispatch(&mut self.order, &Work { slots, pipeline, scene, pass: step.pass, args: &args })?;
        }
        let (recorder, order, timelines) = (&mut lane.recorder, &mut self.order, &mut self.timelines);
        self.measured.host("submit", || recorder.submit(order, timelines))
    }

    /// Frames that were given up because another began before all of their lines had come.
    pub fn torn(&self) -> u64 {
        self.torn
    }
}
