//! Sources of frames: files, the phantom, a pipe, and OpenIGTLink, whose tracked frames are compounded. Frames of a free-running probe are
//! placed by the motor's position.
//!
//! Every reader is total: any bytes give frames or an [`InputError`], never a panic. No reader takes more memory than the bytes of its
//! file account for, or than a live source documents.

pub mod convert;
mod describe;
mod drawn;
mod formats;
mod frame;
pub mod freehand;
pub mod igtl;
mod kretz;
mod layout;
pub mod live;
mod metaimage;
pub mod motor_tracking;
mod nifti;
mod nrrd;
mod packed;
pub mod phantom;
pub mod piped;
mod pixel;
pub mod recorder;
pub mod recording;
pub mod samples;
pub mod sequence;
mod value_range;
pub mod volume_file;

pub use crate::files::InputError;
pub use crate::probe::{DepthAxis, Geometry, Grid};
pub use frame::{Frame, Header, Source};
pub use recording::Recording;
pub use samples::{SampleType, StoredType};

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

/// What a user can say about a file that is opened.
#[derive(Clone, Copy, Debug, Default)]
pub struct OpenOptions<'a> {
    /// The probe file to use.
    pub probe: Option<&'a Path>,
    /// The stored axis of a Cartesian volume that is drawn as depth; None: that of the file's orientation, or y.
    pub depth_axis: Option<DepthAxis>,
}

/// As [`open_with`], with the stored order of axes. `probe`: the probe file to use.
///
/// # Errors
/// As [`open_with`].
pub fn open(path: &Path, probe: Option<&Path>) -> Result<Box<dyn Source>, InputError> {
    open_with(path, OpenOptions { probe, depth_axis: None })
}

/// Opens a `.frames` file or any other recording; the content decides which.
///
/// # Errors
/// As [`recorder::Reader::open`] and [`Recording::open_with`].
pub fn open_with(path: &Path, options: OpenOptions) -> Result<Box<dyn Source>, InputError> {
    match is_frames(path) {
        true => Ok(Box::new(frames(path, options)?)),
        false => Ok(Box::new(Recording::open_with(path, options)?)),
    }
}

/// A description of such a file for users: pairs of title and value. Never a patient's name or number.
///
/// # Errors
/// As [`open_with`]; a `.frames` file is read completely, and may fail while that is done.
pub fn description(path: &Path, options: OpenOptions) -> Result<Vec<(String, String)>, InputError> {
    match is_frames(path) {
        true => frames(path, options)?.description(),
        false => Ok(Recording::open_with(path, options)?.description()),
    }
}

fn frames(path: &Path, options: OpenOptions) -> Result<recorder::Reader, InputError> {
    match options.depth_axis {
        Some(_) => {
            Err(InputError::new(path, "--depth-axis", "is not for .frames files, whose frames are as they arrived"))
        }
        None => recorder::Reader::open(path),
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
