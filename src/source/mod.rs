//! Where frames come from: files, the phantom, a pipe, and OpenIGTLink, whose tracked frames are compounded; frames without a place
//! of their own get one from the motor. Every reader is total: any bytes give frames or an [`InputError`], never a panic, and no more
//! memory is taken than the file's own bytes account for, or a live source says.

pub mod convert;
mod describe;
mod frame;
pub mod freehand;
pub mod igtl;
mod kretz;
mod layout;
pub mod live;
mod metaimage;
pub mod motor_tracking;
pub mod phantom;
pub mod phantom_source;
pub mod piped;
pub mod recorder;
pub mod recording;
pub mod samples;
pub mod sequence;

pub use crate::files::InputError;
pub use crate::probe::{Geometry, Grid};
pub use frame::{Frame, Header, Source};
pub use recording::Recording;
pub use samples::{SampleType, StoredType};

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

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
