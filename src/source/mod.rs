//! Sources of frames: files, the phantom, a pipe, and OpenIGTLink, whose tracked frames are compounded. Frames of a free-running probe are
//! placed by the motor's position.
//!
//! Every reader is total: any bytes give frames or an [`InputError`], never a panic. No reader takes more memory than the bytes of its
//! file account for, or than a live source documents.

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
pub mod piped;
pub mod recorder;
pub mod recording;
pub mod samples;
pub mod sequence;
mod value_range;

pub use crate::files::InputError;
pub use crate::probe::{Geometry, Grid};
pub use frame::{Frame, Header, Source};
pub use recording::Recording;
pub use samples::{SampleType, StoredType};

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

/// Opens a `.frames` file or any other recording; the content decides which. `probe`: the probe file to use, see [`Recording::open`].
///
/// # Errors
/// As [`recorder::Reader::open`] and [`Recording::open`].
pub fn open(path: &Path, probe: Option<&Path>) -> Result<Box<dyn Source>, InputError> {
    match is_frames(path) {
        true => Ok(Box::new(recorder::Reader::open(path)?)),
        false => Ok(Box::new(Recording::open(path, probe)?)),
    }
}

/// A description of such a file for users: pairs of title and value. Never a patient's name or number.
///
/// # Errors
/// As [`open`]; a `.frames` file is read completely, and may fail while that is done.
pub fn description(path: &Path, probe: Option<&Path>) -> Result<Vec<(String, String)>, InputError> {
    match is_frames(path) {
        true => recorder::Reader::open(path)?.description(),
        false => Ok(Recording::open(path, probe)?.description()),
    }
}

fn is_frames(path: &Path) -> bool {
    let mut start = Vec::new();
    // A file that cannot be read is reported by the reader. Opening a pipe may block for ever.
    if fs::metadata(path).is_ok_and(|m| m.is_file()) {
        let _ = File::open(path).and_then(|file| file.take(64).read_to_end(&mut start));
    }
    recorder::Reader::is_one(&start)
}
