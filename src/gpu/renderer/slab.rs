//! Slices that are copied as they come, many at once: a submission a slab instead of one a slice.

use super::*;

/// Bytes of a slab at most, unless a single slice is larger: large enough that submitting it is nothing beside copying it.
const SLAB_BYTES: u64 = 4 << 20;

/// Slices that lie side by side in a lane's staging buffer and are not on their way yet.
pub struct Slab {
    image: u32,
    first: u32,
    count: u32,
}

/// Frames that a lane's staging buffer holds.
pub fn frames_a_lane(scene: &Scene) -> u64 {
    match chain::copied(scene) {
        Some(_) => (SLAB_BYTES / frame_bytes(scene)).clamp(1, u64::from(scene.slices())),
        None => 1,
    }
}

impl Renderer {
    /// Where in the next lane's staging buffer this slice goes: behind those that wait, which are sent off first when it does not
    /// follow them.
    pub(super) fn gather(&mut self, slice: u32, image: u32) -> Result<usize, GpuError> {
        let follows = |s: &Slab| s.image == image && s.first + s.count == slice;
        if self.slab.as_ref().is_some_and(|slab| !follows(slab)) {
            self.flush()?;
            // What is left of it is a frame that was given up.
            self.slab = None;
        }
        if self.slab.is_none() {
            self.free_lane()?;
        }
        let slab = self.slab.get_or_insert(Slab { image, first: slice, count: 0 });
        Ok(slab.count as usize * frame_bytes(&self.scene) as usize)
    }

    /// One more slice is there; sends them off when no more fit.
    pub(super) fn gathered(&mut self) -> Result<(), GpuError> {
        let Some(slab) = &mut self.slab else { return Ok(()) };
        slab.count += 1;
        let next = (u64::from(slab.count) + 1) * frame_bytes(&self.scene);
        match next > self.lanes[self.next_lane].staging.size {
            true => self.flush(),
            false => Ok(()),
        }
    }

    /// Sends off the slices that wait. The lines of one that is not whole go on waiting, in the next lane.
    pub(super) fn flush(&mut self) -> Result<(), GpuError> {
        let Some(slot) = chain::copied(&self.scene) else { return Ok(()) };
        let Some(Slab { image, first, count }) = self.slab.take_if(|slab| slab.count > 0) else { return Ok(()) };
        let from = self.next_lane;
        self.next_lane = (from + 1) % FRAMES_IN_FLIGHT as usize;
        let place = Place { slot, copy: image, parts: first..first + count };
        let lane = &mut self.lanes[from];
        lane.send(&mut self.order, &mut self.timelines, &self.slots, place, &mut self.measured)?;
        let Some((slice, image, there)) = self.arriving.as_ref().map(frames::Arriving::place) else { return Ok(()) };
        self.free_lane()?;
        let at = count as usize * frame_bytes(&self.scene) as usize;
        let lines = self.lanes[from].staging.bytes()[at..at + there].to_vec();
        self.lanes[self.next_lane].staging.bytes_mut()[..there].copy_from_slice(&lines);
        self.slab = Some(Slab { image, first: slice, count: 0 });
        Ok(())
    }
}

impl Lane {
    /// Copies what lies in the staging buffer to its place: all there is to do.
    fn send(
        &mut self,
        order: &mut BarrierRecorder,
        timelines: &mut Timelines,
        slots: &Slots,
        place: Place,
        measured: &mut Measured,
    ) -> Result<(), GpuError> {
        let by = self.copier.as_mut().unwrap_or(&mut self.recorder);
        by.begin(order, timelines)?;
        if let Some(target) = slots.image(place.slot, place.copy) {
            by.copy_in(order, &self.staging, target, place);
            by.stamp("upload");
        }
        measured.host("submit", || by.submit(order, timelines))
    }
}
