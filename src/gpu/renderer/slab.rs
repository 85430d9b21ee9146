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
    /// Lays a slice behind those that wait, and sends them off when no more fit or it does not follow them.
    pub(super) fn gather(&mut self, slice: u32, bytes: &[u8], image: u32) -> Result<(), GpuError> {
        let follows = |s: &Slab| s.image == image && s.first + s.count == slice;
        if self.slab.as_ref().is_some_and(|slab| !follows(slab)) {
            self.flush()?;
        }
        let slab = match &mut self.slab {
            Some(slab) => slab,
            None => {
                let recorder = &mut self.lanes[self.next_lane].recorder;
                recorder.collect(&self.timeline, &mut self.measured)?;
                recorder.begin(&mut self.order, &self.timeline)?;
                self.slab.insert(Slab { image, first: slice, count: 0 })
            }
        };
        let staging = self.lanes[self.next_lane].staging.bytes_mut();
        let at = slab.count as usize * bytes.len();
        self.measured.host("stage", || staging[at..at + bytes.len()].copy_from_slice(bytes));
        slab.count += 1;
        self.unseen[image as usize][slice as usize] = true;
        match at + 2 * bytes.len() > staging.len() {
            true => self.flush(),
            false => Ok(()),
        }
    }

    /// Sends off what waits.
    pub(super) fn flush(&mut self) -> Result<(), GpuError> {
        let Some(Slab { image, first, count }) = self.slab.take() else { return Ok(()) };
        let lane = self.next_lane;
        self.next_lane = (lane + 1) % self.lanes.len();
        let Lane { recorder, staging } = &mut self.lanes[lane];
        if let Some(slot) = chain::copied(&self.scene)
            && let Some(target) = self.slots.image(slot, image)
        {
            let place = Place { slot, copy: image, parts: first..first + count };
            recorder.copy_in(&mut self.order, staging, target, place);
            recorder.stamp("upload");
        }
        self.measured.host("submit", || recorder.submit(&mut self.timeline))
    }
}
