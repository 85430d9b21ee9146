//! Standard input as a recording: `-` in place of a file. It is copied once to a temporary file, so that readers can seek.

use super::formats;
use super::frame::{Frame, Header, Source};
use crate::files::{InputError, Spool};
use crate::probe::{Geometry, World};
use crate::sync::locked;
use crate::{SampleType, StoredType};
use glam::DAffine3;
use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Its name for users.
const NAME: &str = "standard input";
/// Longest stream, bytes.
const MAX_BYTES: u64 = 64 << 30;

/// What was read. A recording may be opened more than once, and standard input is read once.
static KEPT: Mutex<Option<Spool>> = Mutex::new(None);

/// True if a path stands for standard input: `-`.
pub(super) fn is_meant(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Deletes the temporary file with the content of standard input. Sources that still read it may fail afterwards.
pub fn forget() {
    locked(&KEPT).take();
}

/// Path of a temporary file with the content of standard input. The first call reads it to its end, provided that it begins as a recording does.
///
/// # Errors
/// Standard input is a terminal, cannot be read, does not begin as a recording, or does not fit on the disk.
pub(super) fn file() -> Result<PathBuf, InputError> {
    let mut kept = locked(&KEPT);
    if let Some(spool) = &*kept {
        return Ok(spool.path().into());
    }
    let fault = |fault: String| InputError::new(Path::new(NAME), "file", fault);
    let input = std::io::stdin();
    if input.is_terminal() {
        return Err(fault("is a terminal; send it a recording, as in: echolume render - <sweep.mha".into()));
    }
    let mut input = input.lock();
    let mut start = Vec::new();
    let looked_at = (&mut input).take(formats::START).read_to_end(&mut start);
    looked_at.map_err(|e| fault(format!("cannot be read: {e}")))?;
    // Whatever is no recording is not kept: it may have no end.
    if let Some(why) = formats::no_format(&start) {
        return Err(fault(why));
    }
    let spool = Spool::of(&mut start.chain(input), MAX_BYTES);
    let spool = spool.map_err(|e| fault(format!("cannot be kept in {}: {e}", std::env::temp_dir().display())))?;
    let path = spool.path().into();
    *kept = Some(spool);
    Ok(path)
}

/// The same error with standard input named in place of the temporary file of [`file`].
pub(super) fn renamed(error: InputError) -> InputError {
    error.renamed(NAME)
}

/// A source that reads the temporary file of [`file`]; its errors name standard input.
pub(super) struct FromInput(pub Box<dyn Source>);

impl Source for FromInput {
    passed_on! { self to self.0;
        geometry(volume: usize) -> Geometry;
        stored_type() -> StoredType;
        sample_type() -> SampleType;
        range() -> [f64; 2];
        volumes() -> usize;
        frames_per_volume() -> usize;
        number_of(volume: usize) -> Option<u32>;
        header() -> Header;
        is_synthetic() -> bool;
        world() -> Option<World>;
        world_of(volume: usize) -> Option<World>;
        pose() -> Option<DAffine3>;
        probe_file() -> Option<&Path>;
        arrival() -> Option<f64>;
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        self.0.skip_to_volume(volume).map_err(renamed)
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        self.0.next_frame().map_err(renamed)
    }

    fn prepare(&mut self) -> Result<(), InputError> {
        self.0.prepare().map_err(renamed)
    }

    fn files(&self) -> Vec<PathBuf> {
        // No output can replace what was read.
        self.0.probe_file().map(Path::to_path_buf).into_iter().collect()
    }
}
