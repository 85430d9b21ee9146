//! Atomic files: complete, or absent.

use super::signals::Writing;
use std::fs::metadata;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file under a temporary name until it is complete. Dropping it earlier deletes it. After a signal, writes fail, so that the writer
/// stops; the signal takes effect when the file is deleted.
pub struct Unfinished {
    file: BufWriter<Part>,
    target: PathBuf,
}

struct Part {
    file: NamedTempFile,
    // Dropped after the file, so that the file is deleted before a signal ends the process.
    signals: Writing,
}

impl Unfinished {
    /// # Errors
    /// The folder cannot be written, or the target exists and is not a regular file.
    pub fn create(target: &Path) -> io::Result<Unfinished> {
        // Resolve links, and use the target's folder, so that renaming is atomic within one file system.
        let target = target.canonicalize().unwrap_or_else(|_| target.to_path_buf());
        if metadata(&target).is_ok_and(|there| !there.is_file()) {
            return Err(io::Error::other("the target is not a regular file"));
        }
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut named = tempfile::Builder::new();
        named.prefix(".echolume-").suffix(".part");
        #[cfg(unix)]
        {
            // The process' umask applies, as for any new file.
            use std::os::unix::fs::PermissionsExt;
            named.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let signals = Writing::begin();
        let file = named.tempfile_in(folder)?;
        Ok(Unfinished { file: BufWriter::new(Part { file, signals }), target })
    }

    /// Flushes everything to the disk.
    ///
    /// # Errors
    /// The disk is full, or a signal arrived.
    pub fn finish(&mut self) -> io::Result<()> {
        self.file.flush()?;
        self.file.get_ref().file.as_file().sync_all()
    }

    /// Renames the file to its target, atomically.
    ///
    /// # Errors
    /// The disk is full, or a signal arrived before everything was written.
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
