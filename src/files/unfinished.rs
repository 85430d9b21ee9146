//! Files that are whole or not there.

use super::signals::Writing;
use std::fs::metadata;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file under a name of its own until it is whole; gone if it is dropped before. After a signal it takes no more, so that whoever
/// writes it gives up, and the signal does its work when it is gone.
pub struct Unfinished {
    file: BufWriter<Part>,
    target: PathBuf,
}

struct Part {
    file: NamedTempFile,
    // Behind the file: it is gone before a signal ends the process.
    signals: Writing,
}

impl Unfinished {
    /// # Errors
    /// What the system says of the folder; something that is no regular file is there.
    pub fn create(target: &Path) -> io::Result<Unfinished> {
        // Through a link to the file itself, and beside it, so that renaming is one step within one file system.
        let target = target.canonicalize().unwrap_or_else(|_| target.to_path_buf());
        if metadata(&target).is_ok_and(|there| !there.is_file()) {
            return Err(io::Error::other("what is there is no regular file"));
        }
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut named = tempfile::Builder::new();
        named.prefix(".echolume-").suffix(".part");
        #[cfg(unix)]
        {
            // As any other new file: the process' mask decides.
            use std::os::unix::fs::PermissionsExt;
            named.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let signals = Writing::begin();
        let file = named.tempfile_in(folder)?;
        Ok(Unfinished { file: BufWriter::new(Part { file, signals }), target })
    }

    /// Everything is on the disk.
    ///
    /// # Errors
    /// A disk that is full; a signal came.
    pub fn finish(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.file.get_ref().file.as_file().sync_all()
    }

    /// Gives it its name, in one step.
    ///
    /// # Errors
    /// A disk that is full; a signal came before all was written.
    pub fn rename(self) -> io::Result<()> {
        let Part { file, signals } = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        let named = file.persist(&self.target).map_err(|e| e.error);
        drop(signals);
        named.map(drop)
    }
}

impl Write for Unfinished {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Write for Part {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.signals.signal() {
            Some(signal) => Err(io::Error::other(format!("stopped by {signal}"))),
            None => self.file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
