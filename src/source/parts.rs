//! Frames that arrive in parts of lines, put together.

use crate::Frame;
use std::borrow::Cow;

/// The frame whose parts are arriving.
///
/// Memory: one frame.
#[derive(Debug, Default)]
pub struct FrameParts(Option<Frame>);

impl FrameParts {
    /// Adds a part, `at` bytes into a frame of `total` bytes. Returns the frame when it is complete. A part at 0 begins a frame; one that
    /// does not continue the part before, or is too long, is discarded with all of its frame.
    pub fn add(&mut self, part: Cow<Frame>, at: usize, total: usize) -> Option<Frame> {
        let before = self.0.take();
        let end = at.checked_add(part.bytes.len()).filter(|end| *end <= total)?;
        let frame = match before {
            _ if at == 0 => part.into_owned(),
            Some(mut frame) if frame.bytes.len() == at && (frame.volume, frame.slice) == (part.volume, part.slice) => {
                frame.bytes.extend_from_slice(&part.bytes);
                frame
            }
            _ => return None,
        };
        if end == total {
            return Some(frame);
        }
        self.0 = Some(frame);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents frames of lines that were lost, swapped, of another frame or too many.
    #[test]
    fn only_parts_that_follow_one_another_make_a_frame() {
        let part = |slice: usize, bytes: &[u8]| Cow::Owned::<Frame>(Frame::of_slice(0, slice, bytes.to_vec()));
        let whole = Frame::of_slice(0, 3, vec![1, 2, 3, 4, 5, 6]);
        let mut parts = FrameParts::default();
        let mut add = |slice, bytes: &[u8], at| parts.add(part(slice, bytes), at, 6);
        for _ in 0..2 {
            assert_eq!(add(3, &[1, 2], 0), None);
            assert_eq!(add(3, &[3, 4], 2), None);
            assert_eq!(add(3, &[5, 6], 4), Some(whole.clone()));
        }
        assert_eq!(add(3, &[5, 6], 4), None, "its beginning is gone");
        assert_eq!(add(3, &[1, 2, 3, 4, 5, 6], 0), Some(whole.clone()), "all in one");
        // A part that is missing, one of another slice, one that goes too far: nothing is made of the rest.
        for (slice, bytes, at) in [(3, &[5, 6][..], 4), (2, &[3, 4], 2), (3, &[3, 4, 5, 6, 7], 2)] {
            assert_eq!(add(3, &[1, 2], 0), None);
            assert_eq!(add(slice, bytes, at), None);
            assert_eq!(add(3, &[3, 4, 5, 6], 2), None, "slice {slice}, {bytes:?} at {at}");
        }
        // A frame that begins again.
        assert_eq!(add(3, &[9, 9], 0), None);
        assert_eq!(add(3, &[1, 2], 0), None);
        assert_eq!(add(3, &[3, 4, 5, 6], 2), Some(whole));
    }
}
