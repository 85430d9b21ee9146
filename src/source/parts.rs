//! Assembles frames that arrive in groups of lines, so that consumers see complete frames only.

use crate::Frame;
use crate::freehand::CompoundingOptions;
use crate::live::{Event, Live};
use std::time::Duration;

/// The frame whose parts are arriving.
///
/// Memory: one frame.
#[derive(Debug, Default)]
struct FrameParts(Option<Frame>);

impl FrameParts {
    /// Adds a part, `at` bytes into a frame of `total` bytes. Returns the frame when it is complete. A part at 0 begins a frame.
    ///
    /// # Errors
    /// The bytes before a part that does not continue them, or is too long. It is discarded with all of its frame.
    fn add(&mut self, part: Frame, at: usize, total: usize) -> Result<Option<Frame>, usize> {
        let before = self.0.take();
        let came = before.as_ref().map_or(0, |frame| frame.bytes.len());
        let end = at.checked_add(part.bytes.len()).filter(|end| *end <= total).ok_or(came)?;
        let frame = match before {
            _ if at == 0 => part,
            Some(mut frame) if came == at && (frame.volume, frame.slice) == (part.volume, part.slice) => {
                frame.bytes.extend_from_slice(&part.bytes);
                frame
            }
            _ => return Err(came),
        };
        if end == total {
            return Ok(Some(frame));
        }
        self.0 = Some(frame);
        Ok(None)
    }
}

/// A live source of complete frames only: groups of lines ([`Event::Lines`]) of the wrapped source are collected until their frame is complete.
pub struct WholeFrames {
    source: Box<dyn Live>,
    /// Of a line and of a frame, bytes.
    sizes: (usize, usize),
    parts: FrameParts,
}

impl WholeFrames {
    pub fn new(source: Box<dyn Live>) -> WholeFrames {
        WholeFrames { source, sizes: (0, 0), parts: FrameParts::default() }
    }

    /// A frame if these lines complete one, nothing if more have to follow, or why they are left out.
    fn lines(&mut self, lines: Frame, first: usize) -> Event {
        let ((line, total), slice, bytes) = (self.sizes, lines.slice, lines.bytes.len());
        match self.parts.add(lines, first.saturating_mul(line), total) {
            Ok(whole) => whole.map_or(Event::Idle, Event::Frame),
            Err(came) => {
                let came = came / line.max(1);
                Event::Fault(format!(
                    "frame for slice {slice}: {bytes} bytes from line {first} on are not lines that follow the {came} that have arrived"
                ))
            }
        }
    }
}

impl Live for WholeFrames {
    fn next(&mut self, patience: Duration) -> Event {
        match self.source.next(patience) {
            Event::Begin(header) => {
                (self.sizes, self.parts) = (header.line_and_frame(), FrameParts::default());
                Event::Begin(header)
            }
            Event::Lines { frame, first } => self.lines(frame, first),
            other => other,
        }
    }

    passed_on! { self to self.source;
        can_wait() -> bool;
        is_recording() -> bool;
        compounding() -> Option<CompoundingOptions>;
        left_out() -> u64;
        disconnected() -> Option<String>;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Geometry, Grid};
    use crate::{Header, StoredType};
    use std::collections::VecDeque;

    /// Prevents frames of lines that were lost, swapped, of another frame or too many.
    #[test]
    fn only_parts_that_follow_one_another_make_a_frame() {
        let part = |slice: usize, bytes: &[u8]| Frame::of_slice(0, slice, bytes.to_vec());
        let whole = Ok(Some(Frame::of_slice(0, 3, vec![1, 2, 3, 4, 5, 6])));
        let mut parts = FrameParts::default();
        let mut add = |slice, bytes: &[u8], at| parts.add(part(slice, bytes), at, 6);
        for _ in 0..2 {
            assert_eq!(add(3, &[1, 2], 0), Ok(None));
            assert_eq!(add(3, &[3, 4], 2), Ok(None));
            assert_eq!(add(3, &[5, 6], 4), whole.clone());
        }
        assert_eq!(add(3, &[5, 6], 4), Err(0), "its beginning is gone");
        assert_eq!(add(3, &[1, 2, 3, 4, 5, 6], 0), whole.clone(), "all in one");
        // A part that is missing, one of another slice, one that goes too far: nothing is made of the rest.
        for (slice, bytes, at) in [(3, &[5, 6][..], 4), (2, &[3, 4], 2), (3, &[3, 4, 5, 6, 7], 2)] {
            assert_eq!(add(3, &[1, 2], 0), Ok(None));
            assert_eq!(add(slice, bytes, at), Err(2));
            assert_eq!(add(3, &[3, 4, 5, 6], 2), Err(0), "slice {slice}, {bytes:?} at {at}");
        }
        // A frame that begins again.
        assert_eq!(add(3, &[9, 9], 0), Ok(None));
        assert_eq!(add(3, &[1, 2], 0), Ok(None));
        assert_eq!(add(3, &[3, 4, 5, 6], 2), whole);
    }

    struct Told(VecDeque<Event>);

    impl Live for Told {
        fn next(&mut self, _: Duration) -> Event {
            self.0.pop_front().unwrap_or(Event::End(None))
        }

        fn can_wait(&self) -> bool {
            true
        }
    }

    /// Prevents lines that were lost on the way without a word, and lines of one geometry in a frame of the next.
    #[test]
    fn lines_of_a_source_are_whole_frames_or_faults() {
        let grid = Geometry::Cartesian(Grid { origin: [0.0; 3], spacing: [1.0; 3], size: [2, 3, 2] });
        let (stored, range) = (StoredType::U8, [0.0, 255.0]);
        let header = Header { forward: grid.clone(), backward: grid, stored, range, posed: false, synthetic: false };
        let begin = || Event::Begin(Box::new(header.clone()));
        let bytes = |first: usize| vec![2 * first as u8, 2 * first as u8 + 1];
        let line = |volume, first| Event::Lines { frame: Frame::of_slice(volume, 1, bytes(first)), first };
        // What comes of lines that come in this order: frames and faults.
        let cases: [(&[usize], usize, usize); 6] = [
            (&[0, 1, 2], 1, 0),
            (&[0, 2], 0, 1),
            (&[0, 2, 1], 0, 2),
            (&[0, 0, 1, 2], 1, 0),
            (&[0, 1, 1], 0, 1),
            (&[1, 2, 2], 0, 3),
        ];
        for (lines, frames, faults) in cases {
            let told = [begin()].into_iter().chain(lines.iter().map(|first| line(7, *first)));
            let mut source = WholeFrames::new(Box::new(Told(told.collect())));
            let (mut whole, mut said) = (Vec::new(), Vec::new());
            loop {
                match source.next(Duration::ZERO) {
                    Event::Frame(frame) => whole.push(frame),
                    Event::Fault(fault) => said.push(fault),
                    Event::End(_) => break,
                    Event::Lines { .. } => panic!("lines {lines:?} are handed on"),
                    Event::Begin(_) | Event::Idle => {}
                }
            }
            assert_eq!((whole.len(), said.len()), (frames, faults), "{lines:?}: {said:?}");
            assert!(whole.iter().all(|frame| *frame == Frame::of_slice(7, 1, vec![0, 1, 2, 3, 4, 5])), "{whole:?}");
            assert!(said.iter().all(|fault| fault.contains("slice 1") && fault.contains("from line")), "{said:?}");
        }
        let told =
            [begin(), line(0, 0), line(0, 1), begin(), line(0, 2), Event::Frame(Frame::of_slice(0, 0, vec![0; 6]))];
        let mut source = WholeFrames::new(Box::new(Told(told.into())));
        let kinds: Vec<_> = (0..7).map(|_| source.next(Duration::ZERO)).collect();
        assert!(matches!(kinds[4], Event::Fault(_)) && matches!(kinds[5], Event::Frame(_)), "{kinds:?}");
    }
}
