//! What a reader finds out about a file before any sample is read.

use super::pixels::{MOST_INFLATED, Pixels};
use super::{InputError, SampleType};
use crate::probe::{Grid, Probe};
use std::collections::BTreeMap;
use std::path::Path;

/// Most samples, lines or frames along one dimension.
const LONGEST: u64 = 65_536;
/// Most bytes of one frame.
const LARGEST_FRAME: u64 = 1 << 30;

/// A file's layout, and what it says of its own geometry.
pub(super) struct Contents {
    pub format: &'static str,
    pub sample: SampleType,
    pub big_endian: bool,
    /// Samples and lines, or width and height: the first runs fastest.
    pub frame_size: [usize; 2],
    pub frames: usize,
    pub pixels: Pixels,
    pub lines: Lines,
    pub own: Own,
    /// Time stamps by frame, s.
    pub times: BTreeMap<usize, f64>,
    /// For people to read. Never a patient field.
    pub facts: Vec<(String, String)>,
}

/// How a frame's rows would be scan lines.
pub(super) enum Lines {
    InOrder,
    /// The last line comes first.
    Reversed,
    /// They are not: the frames are pictures. Says by which word.
    Pictures(String),
}

/// The geometry that stands in the file.
pub(super) enum Own {
    /// One polar volume.
    Sweep(Box<Probe>),
    /// So many Cartesian volumes, one after the other.
    Pictures(Grid, usize),
    /// None, and it cannot do without.
    Missing(InputError),
}

impl Contents {
    pub fn frame_bytes(&self) -> u64 {
        self.frame_size[0] as u64 * self.frame_size[1] as u64 * self.sample.bytes() as u64
    }

    /// Refuses sizes that cannot be true of a file of this length, so that no claim of a header is ever allocated.
    pub fn check(&self, file: &Path, size_field: &str) -> Result<(), InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(file, field, fault));
        if self.frame_bytes() > LARGEST_FRAME {
            return fault(size_field, format!("one frame has {} bytes, at most 1 GiB is read", self.frame_bytes()));
        }
        // Cannot overflow: a frame has at most 2^30 bytes and there are at most 2^16 frames.
        let claimed = self.frame_bytes() * self.frames as u64;
        let there = self.pixels.length;
        if !self.pixels.compressed && claimed > there {
            return fault("data", format!("cut short, {there} of {claimed} bytes are there"));
        }
        if self.pixels.compressed && claimed > there.saturating_mul(MOST_INFLATED).saturating_add(1024) {
            return fault("data", format!("{there} compressed bytes cannot hold the {claimed} bytes of {size_field}"));
        }
        Ok(())
    }
}

/// A number of samples, lines or frames as a file states it.
pub(super) fn extent(file: &Path, field: &str, which: &str, value: u64) -> Result<usize, InputError> {
    match value {
        0 => Err(InputError::new(file, field, format!("{which}is 0, must be at least 1"))),
        1..=LONGEST => Ok(value as usize),
        _ => Err(InputError::new(file, field, format!("{which}is {value}, must be at most {LONGEST}"))),
    }
}
