//! Frames as they arrived, appended to a file (`.frames`), and given back byte for byte. Whatever interrupts the writing, every frame but
//! the last is there. All numbers are little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `ECHOFRMS` |
//! | 4 | version, 1 |
//! | 4 | length n of what follows, at most 16 MiB |
//! | n | JSON: where samples lie swept forwards and backwards, what is stored, which stored values are 0 and 1 |
//! | 4 | CRC-32 (ISO-HDLC, zlib's) of everything so far |
//! | ... | frames, each `FRAM`, volume, number, slice, flags (bit 0 backward, bit 1 stamped), length m (six words of 4 in all), time stamp and time of arrival in s (two f64), m bytes of samples, CRC-32 of all of the frame before it |
//! | ... | at a clean end: `INDX`, count (4), for each frame its offset (8) and volume (4), CRC-32 of the index, offset of `INDX` (8), `XEND` |
//!
//! Without an index, or with one that is damaged, the frames are gone through once. A frame whose checksum is wrong is left out and
//! counted; where the lengths lead nowhere, or no frame is for 1 GiB, what is behind is lost.

mod facts;
mod read;
mod write;

pub use read::Reader;
pub use write::Writer;

use super::StoredType;
use crate::probe::Geometry;
use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::{Deserialize, Serialize};

const MAGIC: &[u8; 8] = b"ECHOFRMS";
const VERSION: u32 = 1;
const FRAME: &[u8; 4] = b"FRAM";
const INDEX: &[u8; 4] = b"INDX";
const END: &[u8; 4] = b"XEND";
/// Bytes of a frame before its samples.
const FRAME_HEAD: usize = 40;
/// Longest header, bytes: tables of lines and slices.
const LONGEST_HEADER: u32 = 16 << 20;
/// Most frames a volume: as many as any reader takes.
const MOST_SLICES: usize = 1 << 16;
/// Largest frame, bytes.
const LARGEST_FRAME: u64 = 1 << 30;

static CRC: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// What every frame of a file has in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Where samples lie in a volume that is swept forwards.
    pub forward: Geometry,
    /// The same backwards; the same where the motor has no part in it.
    pub backward: Geometry,
    pub stored: StoredType,
    /// Stored values that become 0 and 1.
    pub range: [f64; 2],
}

impl Header {
    /// Bytes of a frame.
    pub fn frame_bytes(&self) -> Option<u64> {
        let [width, height] = self.forward.frame_size();
        let samples = (width as u64).checked_mul(height as u64)?;
        samples.checked_mul(self.stored.bytes() as u64).filter(|n| *n > 0 && *n <= LARGEST_FRAME)
    }

    /// # Errors
    /// The field and what is wrong with it.
    pub(super) fn check(&self) -> Result<(), (&'static str, String)> {
        for geometry in [&self.forward, &self.backward] {
            // First, since the rest looks at each.
            if geometry.slices() > MOST_SLICES {
                return Err(("slices", format!("are {}, at most {MOST_SLICES} a volume", geometry.slices())));
            }
            let checked = match geometry {
                Geometry::Sweep(probe) => probe.check(),
                Geometry::Cartesian(grid) => grid.check(),
            };
            checked.map_err(|e| (e.field, e.fault))?;
        }
        let of = |geometry: &Geometry| (geometry.frame_size(), geometry.slices());
        if of(&self.forward) != of(&self.backward) {
            return Err(("backward", "has frames of another size or number than forward".into()));
        }
        if !self.forward.equals_except_advance(&self.backward) {
            return Err(("backward", "differs from forward in more than the motor's way during a frame".into()));
        }
        if self.frame_bytes().is_none() {
            return Err(("forward", format!("makes frames of more than {LARGEST_FRAME} bytes")));
        }
        let [low, high] = self.range;
        match low.is_finite() && high.is_finite() && low < high {
            true => Ok(()),
            false => Err(("range", format!("[{low}, {high}] must be finite and rise"))),
        }
    }
}
