//! Where frames come from: files, the phantom, a pipe, and OpenIGTLink, whose tracked frames are compounded; frames without a place
//! of their own get one from the motor. Every reader is total: any bytes give frames or an [`InputError`], never a panic, and no more
//! memory is taken than the file's own bytes account for, or a live source says.

mod contents;
pub mod convert;
mod describe;
pub mod error;
pub mod freehand;
pub mod igtl;
mod kretz;
pub mod live;
mod metaimage;
pub mod motor_tracking;
pub mod phantom;
pub mod phantom_source;
pub mod piped;
mod pixels;
pub mod recorder;
pub mod recording;
pub mod samples;
pub mod sequence;

pub use crate::probe::{Geometry, Grid};
pub use error::InputError;
pub use recording::Recording;
pub use samples::{SampleType, StoredType};

use contents::Contents;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

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

/// Chooses the reader: by content, then by the name's ending.
fn read_contents(path: &Path) -> Result<Contents, InputError> {
    let unreadable = |e| InputError::unreadable(path, &e);
    // A pipe or a folder has no end to measure claims against, and opening a pipe may wait for ever.
    if !fs::metadata(path).map_err(unreadable)?.is_file() {
        return Err(InputError::new(path, "file", "is not a regular file"));
    }
    let file = File::open(path).map_err(unreadable)?;
    let mut start = Vec::new();
    file.take(64).read_to_end(&mut start).map_err(unreadable)?;
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if start.starts_with(b"KRETZFILE") {
        kretz::read(path)
    } else if start.starts_with(b"ObjectType") || start.starts_with(b"NDims") || ["mha", "mhd"].contains(&&*ending) {
        metaimage::read(path)
    } else if recorder::Reader::is_one(&start) {
        Err(InputError::new(path, "file", "holds frames as they arrived, not a recording"))
    } else {
        Err(InputError::new(path, "file", "is of no known format; MetaImage (.mha, .mhd) and Kretz (.vol) are read"))
    }
}

/// A file of frames or any other recording, by its content.
///
/// # Errors
/// As of [`recorder::Reader::open`] and [`Recording::open`].
pub fn open(path: &Path, probe: Option<&Path>) -> Result<Box<dyn Source>, InputError> {
    match is_frames(path) {
        true => Ok(Box::new(recorder::Reader::open(path)?)),
        false => Ok(Box::new(Recording::open(path, probe)?)),
    }
}

/// What such a file is, for people to read: title and value. Never a patient's name or number.
///
/// # Errors
/// As of [`open`], and what cannot be read of a file of frames, all of which is gone through.
pub fn description(path: &Path, probe: Option<&Path>) -> Result<Vec<(String, String)>, InputError> {
    match is_frames(path) {
        true => recorder::Reader::open(path)?.description(),
        false => Ok(Recording::open(path, probe)?.description()),
    }
}

fn is_frames(path: &Path) -> bool {
    let mut start = Vec::new();
    // What cannot be read here is named by the reader. Opening a pipe may wait for ever.
    if fs::metadata(path).is_ok_and(|m| m.is_file()) {
        let _ = File::open(path).and_then(|file| file.take(64).read_to_end(&mut start));
    }
    recorder::Reader::is_one(&start)
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
    fn header(&self) -> recorder::Header {
        live::header_of(self)
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

impl Source for Recording {
    fn geometry(&self, volume: usize) -> Geometry {
        self.geometry(volume)
    }

    fn stored_type(&self) -> StoredType {
        self.stored_type()
    }

    fn sample_type(&self) -> SampleType {
        self.sample_type()
    }

    fn range(&self) -> [f64; 2] {
        self.range()
    }

    fn volumes(&self) -> usize {
        self.volumes()
    }

    fn frames_per_volume(&self) -> usize {
        self.frames_per_volume()
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        self.skip_to_volume(volume)
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        self.next_frame()
    }

    fn files(&self) -> Vec<PathBuf> {
        self.files()
    }
}
