//! Frames of version 3 of a stream ([`super::piped`]): marker, number and checksum keep a lost byte from shifting every later frame. And the time stamps
//! that a stream can have, by which earlier versions notice that they were shifted.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// What each frame begins with: no text, and damaged where line ends are changed.
const MARKER: [u8; 8] = *b"\x89ECHOFR\n";
/// Number of bytes of a frame that precede its time stamp: marker and number.
pub(super) const BEFORE: usize = MARKER.len() + size_of::<u64>();
/// Number of bytes of a frame besides its time stamp, pose and samples: marker, number and checksum.
pub(super) const OVERHEAD: usize = BEFORE + size_of::<u32>();
/// How far a time stamp may be before that of the last frame, and behind it, s: a clock may be set, and a probe may pause.
const MOST_BACK: f64 = 60.0;
const MOST_AHEAD: f64 = 86_400.0;
/// Largest time stamp, s: the year 2286.
const LATEST: f64 = 1e10;

/// The checksum of frames (ISO-HDLC, zlib's).
pub(super) static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// Checks the bytes of one frame. Returns its number, and the bytes of time stamp, pose and samples. None if the marker or the checksum is
/// wrong.
pub(super) fn content(record: &[u8]) -> Option<(u64, &[u8])> {
    let (body, sum) = record.strip_prefix(&MARKER)?.split_last_chunk()?;
    let (number, content) = body.split_first_chunk()?;
    (CRC.checksum(body).to_le_bytes() == *sum).then_some((u64::from_le_bytes(*number), content))
}

/// Offset, at least 1, at which the next frame may begin in bytes that do not begin with one: that of the next marker, else of what may be the
/// beginning of a marker at the end.
pub(super) fn next_start(bytes: &[u8]) -> usize {
    let found = bytes.windows(MARKER.len()).skip(1).position(|window| window == MARKER);
    found.map_or_else(|| bytes.len().saturating_sub(MARKER.len() - 1).max(1), |at| at + 1)
}

/// Checks the time stamps of a stream against each other.
#[derive(Default)]
pub(super) struct Stamps {
    last: Option<f64>,
}

impl Stamps {
    /// Checks the time stamp of the next frame, s. None if it is NaN, which means that the frame has none.
    ///
    /// # Errors
    /// The stamp is impossible after the previous one: what it is and what is allowed.
    pub(super) fn take(&mut self, stamp: f64) -> Result<Option<f64>, String> {
        if stamp.is_nan() {
            return Ok(None);
        }
        let span = self.last.map_or(0.0..=LATEST, |last| (last - MOST_BACK).max(0.0)..=(last + MOST_AHEAD).min(LATEST));
        if !span.contains(&stamp) {
            let (first, last) = span.into_inner();
            return Err(format!(
                "is {stamp:e} s, must be {first} to {last} s, by the frame before: bytes were lost or added, and every later frame would be shifted; \
                 version 3 goes on after that"
            ));
        }
        self.last = Some(stamp);
        Ok(self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_may_be_set_and_a_shifted_stamp_is_refused() {
        let mut stamps = Stamps::default();
        for (stamp, is_possible) in [
            (f64::INFINITY, false),
            (-1.0, false),
            (1.6e247, false),
            (1_800_000_000.0, true),
            (f64::NAN, true),
            (1_799_999_941.0, true),
            (1_799_999_880.0, false),
            (1_800_080_000.0, true),
            (1_800_170_000.0, false),
            (-9.8e304, false),
            (f64::MIN_POSITIVE, false),
        ] {
            assert_eq!(stamps.take(stamp).is_ok(), is_possible, "{stamp}");
        }
        assert_eq!(Stamps::default().take(0.0), Ok(Some(0.0)));
    }

    #[test]
    fn the_next_start_is_a_marker_or_what_may_be_the_begin_of_one() {
        let with = |before: &[u8], after: &[u8]| next_start(&[before, &MARKER[..], after].concat());
        assert_eq!((with(b"abc", b"def"), with(b"", b"0123456789")), (3, 11));
        assert_eq!((next_start(b"0123456789"), next_start(b"0"), next_start(b"01234567")), (3, 1, 1));
    }
}
