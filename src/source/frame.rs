//! Frames, what the frames of a source have in common, and the trait of every source that can be read at will.

use super::samples::{SampleType, StoredType};
use crate::files::InputError;
use crate::probe::{Advance, Geometry};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Most frames a volume: as many as any reader takes.
const MAX_SLICES: usize = 1 << 16;
/// Largest frame, bytes.
const MAX_FRAME_BYTES: u64 = 1 << 30;

/// One polar acquisition, or one slice of a Cartesian volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Number of the volume that the frame belongs to, from 0.
    pub volume: u32,
    /// Place in its volume in the order of acquisition, from 0.
    pub number: u32,
    /// Place in its volume in geometric order: K - 1 - `number` when swept backwards.
    pub slice: usize,
    /// The motor was on its way back.
    pub backward: bool,
    /// Time stamp, s, on the recorder's clock.
    pub time: Option<f64>,
    /// Samples of the stored type, little-endian, line by line (samples fastest).
    pub bytes: Vec<u8>,
}

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
        samples.checked_mul(self.stored.bytes() as u64).filter(|n| *n > 0 && *n <= MAX_FRAME_BYTES)
    }

    /// # Errors
    /// The field and what is wrong with it.
    pub(super) fn check(&self) -> Result<(), (&'static str, String)> {
        for geometry in [&self.forward, &self.backward] {
            // First, since the rest looks at each.
            if geometry.slices() > MAX_SLICES {
                return Err(("slices", format!("are {}, at most {MAX_SLICES} a volume", geometry.slices())));
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
            return Err(("forward", format!("makes frames of more than {MAX_FRAME_BYTES} bytes")));
        }
        let [low, high] = self.range;
        match low.is_finite() && high.is_finite() && low < high {
            true => Ok(()),
            false => Err(("range", format!("[{low}, {high}] must be finite and rise"))),
        }
    }
}

/// Where frames come from, in order of acquisition.
pub trait Source: Send {
    /// Where the samples of a volume lie; the direction of its sweep decides about the motor's advance.
    fn geometry(&self, volume: usize) -> Geometry;
    fn stored_type(&self) -> StoredType;
    /// What a sample is in the file that it comes from.
    fn sample_type(&self) -> SampleType {
        self.stored_type().into()
    }
    /// Stored values that become 0 and 1.
    fn range(&self) -> [f64; 2];
    fn volumes(&self) -> usize;
    fn frames_per_volume(&self) -> usize;
    /// The next frame is the first of that volume.
    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError>;
    /// None after the last.
    fn next_frame(&mut self) -> Result<Option<Frame>, InputError>;
    /// What all frames have in common, either way.
    fn header(&self) -> Header {
        header_of(self)
    }
    /// Every file that it is read from.
    fn files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
    /// When the frame that was given last arrived, s on the recorder's clock, where that was recorded.
    fn arrival(&self) -> Option<f64> {
        None
    }
}

/// What the frames of a source have in common. A source that is swept one way only says the same for both.
pub(super) fn header_of<S: Source + ?Sized>(source: &S) -> Header {
    let forward = source.geometry(0);
    let second = if source.volumes() > 1 { source.geometry(1) } else { forward.clone() };
    let (forward, backward) = if goes_back(&forward) { (second, forward) } else { (forward, second) };
    Header { forward, backward, stored: source.stored_type(), range: source.range() }
}

/// Whether the motor is on its way back in this geometry.
fn goes_back(geometry: &Geometry) -> bool {
    let Geometry::Sweep(probe) = geometry else { return false };
    match &probe.advance {
        Advance::None => false,
        Advance::Same(a) => *a < 0.0,
        Advance::Each(table) => table.iter().any(|a| *a < 0.0),
    }
}
