//! The last volumes as they arrived, for looking back: frames are kept as acquired, so that every setting, those of stage 1 too, can
//! still be changed. Bounded in volumes and bytes. Pure.

use crate::source::Frame;
use std::collections::VecDeque;
use std::sync::Arc;

/// A volume whose frames have all come.
#[derive(Clone, Debug)]
pub struct CineVolume {
    pub volume: u32,
    /// By slice.
    pub frames: Vec<Arc<Frame>>,
    bytes: usize,
}

/// How much is kept at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CineLimits {
    /// 0: none is.
    pub volumes: usize,
    /// The newest volume is kept also where it alone has more.
    pub bytes: usize,
}

struct Filling {
    volume: u32,
    frames: Vec<Option<Arc<Frame>>>,
    missing: usize,
}

/// The cine loop.
pub struct Cine {
    room: CineLimits,
    slices: usize,
    kept: VecDeque<CineVolume>,
    filling: Option<Filling>,
    /// A frame whose lines are arriving.
    lines: Option<Frame>,
    bytes: usize,
}

impl Cine {
    /// `slices`: frames of a volume.
    pub fn new(room: CineLimits, slices: usize) -> Cine {
        Cine { room, slices, kept: VecDeque::new(), filling: None, lines: None, bytes: 0 }
    }

    /// Whether volumes of so many frames are kept here.
    pub fn is_of(&self, slices: usize) -> bool {
        self.slices == slices
    }

    /// From the oldest to the newest.
    pub fn volumes(&self) -> &VecDeque<CineVolume> {
        &self.kept
    }

    /// Bytes of samples that are kept.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// None of it is wanted any more.
    pub fn clear(&mut self) {
        *self = Cine::new(self.room, self.slices);
    }

    /// What was being filled will not be whole.
    pub fn cut(&mut self) {
        (self.filling, self.lines) = (None, None);
    }

    /// Lines of a frame of `whole` bytes; `at`: how many bytes of it come before them.
    pub fn lines(&mut self, frame: Frame, at: usize, whole: usize) {
        if self.room.volumes == 0 {
            return;
        }
        match &mut self.lines {
            Some(there) if at > 0 => {
                let follows = there.bytes.len() == at && (there.volume, there.slice) == (frame.volume, frame.slice);
                match follows && at + frame.bytes.len() <= whole {
                    true => there.bytes.extend(frame.bytes),
                    false => self.lines = None,
                }
            }
            None if at > 0 => {}
            lines => *lines = Some(frame),
        }
        if let Some(frame) = self.lines.take_if(|l| l.bytes.len() == whole) {
            self.frame(frame);
        }
    }

    /// A whole frame.
    pub fn frame(&mut self, frame: Frame) {
        if self.room.volumes == 0 || frame.slice >= self.slices {
            return;
        }
        if self.filling.as_ref().is_none_or(|f| f.volume != frame.volume) {
            let frames = vec![None; self.slices];
            self.filling = Some(Filling { volume: frame.volume, frames, missing: self.slices });
        }
        let Some(filling) = &mut self.filling else { return };
        let slice = frame.slice;
        filling.missing -= usize::from(filling.frames[slice].replace(Arc::new(frame)).is_none());
        if filling.missing == 0
            && let Some(Filling { volume, frames, .. }) = self.filling.take()
        {
            let frames: Vec<_> = frames.into_iter().flatten().collect();
            let bytes = frames.iter().map(|f| f.bytes.len()).sum();
            self.bytes += bytes;
            self.kept.push_back(CineVolume { volume, frames, bytes });
        }
        while self.kept.len() > self.room.volumes || (self.bytes > self.room.bytes && self.kept.len() > 1) {
            let gone = self.kept.pop_front();
            self.bytes -= gone.map_or(0, |kept| kept.bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(volume: u32, slice: usize, bytes: Vec<u8>) -> Frame {
        Frame { volume, number: slice as u32, slice, backward: false, time: None, bytes }
    }

    fn numbers(cine: &Cine) -> Vec<u32> {
        cine.volumes().iter().map(|kept| kept.volume).collect()
    }

    #[test]
    fn whole_volumes_are_kept_and_the_oldest_go() {
        let mut cine = Cine::new(CineLimits { volumes: 3, bytes: 1000 }, 4);
        for volume in 0..6 {
            // Of volume 2 a frame is missing.
            (0..4).filter(|slice| (volume, *slice) != (2, 1)).for_each(|s| cine.frame(frame(volume, s, vec![0; 10])));
        }
        assert_eq!(numbers(&cine), [3, 4, 5]);
        assert_eq!(cine.bytes(), 120);
        assert!(cine.volumes().iter().all(|k| k.frames.iter().enumerate().all(|(s, f)| f.slice == s)));
    }

    #[test]
    fn bytes_bound_it_too_but_the_newest_stays() {
        let mut cine = Cine::new(CineLimits { volumes: 9, bytes: 100 }, 2);
        for (volume, bytes) in [(0, 30), (1, 30), (2, 10), (3, 200)] {
            (0..2).for_each(|s| cine.frame(frame(volume, s, vec![0; bytes])));
            assert!(cine.bytes() <= 100 || cine.volumes().len() == 1);
        }
        assert_eq!(numbers(&cine), [3]);
    }

    #[test]
    fn a_frame_sent_again_counts_once_and_one_beyond_the_volume_not_at_all() {
        let mut cine = Cine::new(CineLimits { volumes: 2, bytes: 100 }, 2);
        [0, 0, 7].into_iter().for_each(|s| cine.frame(frame(1, s, vec![1])));
        assert!(cine.volumes().is_empty());
        cine.frame(frame(1, 1, vec![2]));
        assert_eq!(numbers(&cine), [1]);
    }

    #[test]
    fn lines_make_frames_and_a_gap_makes_none() {
        let mut cine = Cine::new(CineLimits { volumes: 2, bytes: 100 }, 1);
        cine.lines(frame(0, 0, vec![1, 2]), 0, 4);
        cine.lines(frame(0, 0, vec![3, 4]), 2, 4);
        assert_eq!(cine.volumes()[0].frames[0].bytes, [1, 2, 3, 4]);
        cine.lines(frame(1, 0, vec![1]), 0, 4);
        cine.lines(frame(1, 0, vec![3, 4]), 2, 4);
        cine.lines(frame(1, 0, vec![3, 4]), 2, 4);
        assert_eq!(numbers(&cine), [0]);
    }

    #[test]
    fn without_room_nothing_is_kept() {
        let mut cine = Cine::new(CineLimits::default(), 1);
        cine.frame(frame(0, 0, vec![1]));
        cine.lines(frame(1, 0, vec![1]), 0, 1);
        assert!(cine.volumes().is_empty() && cine.bytes() == 0);
    }
}
