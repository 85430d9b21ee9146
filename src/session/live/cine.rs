//! The cine loop: the most recent volumes, for review. Their frames are kept as acquired, so that every setting, also of stage 1, can still
//! be changed. The loop is limited in volumes and bytes. It has no side effects.

use crate::source::Frame;
use std::collections::VecDeque;
use std::sync::Arc;

/// A complete volume in the cine loop.
#[derive(Clone, Debug, Default)]
pub struct CineVolume {
    pub volume: u32,
    /// The frames of the volume in the order of its slices.
    pub frames: Vec<Arc<Frame>>,
    bytes: usize,
}

/// Limits of a cine loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CineLimits {
    /// Largest number of volumes; 0 switches the cine loop off.
    pub volumes: usize,
    /// Largest memory of all samples, bytes. The newest volume is kept even if it alone is larger.
    pub bytes: usize,
}

struct Filling {
    volume: u32,
    frames: Vec<Option<Arc<Frame>>>,
    missing: usize,
}

/// The cine loop: the most recent complete volumes of a stream.
pub struct Cine {
    limits: CineLimits,
    slices: usize,
    volumes: VecDeque<CineVolume>,
    filling: Option<Filling>,
    bytes: usize,
}

impl Cine {
    /// An empty cine loop for volumes of `slices` frames.
    pub fn new(limits: CineLimits, slices: usize) -> Cine {
        Cine { limits, slices, volumes: VecDeque::new(), filling: None, bytes: 0 }
    }

    /// True if the loop is for volumes of `slices` frames.
    pub fn is_of(&self, slices: usize) -> bool {
        self.slices == slices
    }

    /// The volumes, the oldest first.
    pub fn volumes(&self) -> &VecDeque<CineVolume> {
        &self.volumes
    }

    /// True if the next complete volume, if it is as large as the newest, will remove the oldest.
    pub(crate) fn is_full(&self) -> bool {
        let next = self.volumes.back().map_or(0, |newest| newest.bytes);
        self.volumes.len() >= self.limits.volumes || (next > 0 && self.bytes + next > self.limits.bytes)
    }

    /// Removes all volumes.
    pub fn clear(&mut self) {
        *self = Cine::new(self.limits, self.slices);
    }

    /// Removes the volume that is incomplete, because its remaining frames will not arrive.
    pub(crate) fn discard_partial(&mut self) {
        self.filling = None;
    }

    /// Adds a frame. Returns true if it completes a volume. A frame with another volume number discards the volume that is incomplete. A frame is
    /// ignored if the loop is off, or if its slice is not below the number of slices.
    pub fn frame(&mut self, frame: Frame) -> bool {
        if self.limits.volumes == 0 || frame.slice >= self.slices {
            return false;
        }
        if self.filling.as_ref().is_none_or(|f| f.volume != frame.volume) {
            let frames = vec![None; self.slices];
            self.filling = Some(Filling { volume: frame.volume, frames, missing: self.slices });
        }
        let Some(filling) = &mut self.filling else { return false };
        let slice = frame.slice;
        filling.missing -= usize::from(filling.frames[slice].replace(Arc::new(frame)).is_none());
        let is_complete = filling.missing == 0;
        if is_complete && let Some(Filling { volume, frames, .. }) = self.filling.take() {
            let frames: Vec<_> = frames.into_iter().flatten().collect();
            let bytes = frames.iter().map(|f| f.bytes.len()).sum();
            self.bytes += bytes;
            self.volumes.push_back(CineVolume { volume, frames, bytes });
        }
        while self.volumes.len() > self.limits.volumes || (self.bytes > self.limits.bytes && self.volumes.len() > 1) {
            let removed = self.volumes.pop_front();
            self.bytes -= removed.map_or(0, |volume| volume.bytes);
        }
        is_complete
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(volume: u32, slice: usize, bytes: Vec<u8>) -> Frame {
        Frame::of_slice(volume, slice, bytes)
    }

    fn numbers(cine: &Cine) -> Vec<u32> {
        cine.volumes().iter().map(|kept| kept.volume).collect()
    }

    #[test]
    fn complete_volumes_are_kept_and_the_oldest_removed() {
        let mut cine = Cine::new(CineLimits { volumes: 3, bytes: 1000 }, 4);
        for volume in 0..6 {
            // A frame of volume 2 is missing.
            let came = (0..4).filter(|slice| (volume, *slice) != (2, 1));
            let complete = came.filter(|s| cine.frame(frame(volume, *s, vec![0; 10]))).count();
            assert_eq!(complete, usize::from(volume != 2));
            assert_eq!(cine.is_full(), volume >= 3);
        }
        assert_eq!(numbers(&cine), [3, 4, 5]);
        assert_eq!(cine.bytes, 120);
        assert!(cine.volumes().iter().all(|k| k.frames.iter().enumerate().all(|(s, f)| f.slice == s)));
    }

    #[test]
    fn the_bytes_are_bounded_but_the_newest_volume_stays() {
        let mut cine = Cine::new(CineLimits { volumes: 9, bytes: 100 }, 2);
        for (volume, bytes) in [(0, 30), (1, 30), (2, 10), (3, 200)] {
            assert!(!cine.frame(frame(volume, 0, vec![0; bytes])) && cine.frame(frame(volume, 1, vec![0; bytes])));
            assert!(cine.bytes <= 100 || cine.volumes().len() == 1);
        }
        assert_eq!(numbers(&cine), [3]);
    }

    #[test]
    fn a_repeated_frame_counts_once_and_one_beyond_the_volume_is_ignored() {
        let mut cine = Cine::new(CineLimits { volumes: 2, bytes: 100 }, 2);
        assert!(![0, 0, 7].into_iter().any(|s| cine.frame(frame(1, s, vec![1]))));
        assert!(cine.volumes().is_empty());
        cine.frame(frame(1, 1, vec![2]));
        assert_eq!(numbers(&cine), [1]);
    }

    #[test]
    fn a_loop_of_size_zero_keeps_nothing() {
        let mut cine = Cine::new(CineLimits::default(), 1);
        cine.frame(frame(0, 0, vec![1]));
        assert!(cine.volumes().is_empty() && cine.bytes == 0 && cine.is_full());
    }
}
