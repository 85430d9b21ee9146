//! Files that are whole or not there.

use super::InputError;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// A file under a name of its own until it is whole; gone if it is dropped before.
pub struct Unfinished {
    path: PathBuf,
    target: PathBuf,
    kept: bool,
}

impl Unfinished {
    pub fn create(target: &Path) -> Result<(Unfinished, BufWriter<File>), InputError> {
        // In the same folder: renaming is then one step.
        let mut name = std::ffi::OsString::from(".");
        name.push(target.file_name().unwrap_or_default());
        name.push(format!(".{}.part", std::process::id()));
        let path = target.with_file_name(name);
        let file = OpenOptions::new().write(true).create_new(true).open(&path).map_err(|e| unwritable(target, &e))?;
        Ok((Unfinished { path, target: target.into(), kept: false }, BufWriter::new(file)))
    }

    /// Everything is on the disk before the name is.
    pub fn finish(&self, file: BufWriter<File>) -> Result<(), InputError> {
        let synced = file.into_inner().map_err(|e| e.into_error()).and_then(|file| file.sync_all());
        synced.map_err(|e| unwritable(&self.target, &e))
    }

    /// Gives it its name, in one step.
    pub fn rename(&mut self) -> Result<(), InputError> {
        fs::rename(&self.path, &self.target).map_err(|e| unwritable(&self.target, &e))?;
        self.kept = true;
        Ok(())
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        if !self.kept {
            // Nothing more can be done about a file that will not go.
            let _ = fs::remove_file(&self.path);
        }
    }
}

pub fn unwritable(path: &Path, error: &io::Error) -> InputError {
    InputError::new(path, "file", format!("cannot be written: {error}"))
}
