//! Recordings as commands open them: the probe file that was taken is said on one line.

use crate::source::{self, Source};
use crate::terminal::{Failure, input, say};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The probe file that was said last: a recording that is opened again says nothing new.
static SAID: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Opens a recording and says which probe file its geometry is from, if any. `probe`: the one that was asked for.
pub fn open_recording(path: &Path, probe: Option<&Path>) -> Result<Box<dyn Source>, Failure> {
    let source = source::open(path, probe).map_err(input)?;
    say_probe_file(source.probe_file());
    Ok(source)
}

/// Says on one line which probe file is used.
pub fn say_probe_file(file: Option<&Path>) {
    let mut said = SAID.lock().unwrap_or_else(|e| e.into_inner());
    if let Some(file) = file.filter(|file| said.as_deref() != Some(*file)) {
        say!("probe: {}", file.display());
        *said = Some(file.into());
    }
}
