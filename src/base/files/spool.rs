//! A stream that is copied to a temporary file, so that data from a pipe can be read twice and at any offset.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// A temporary file that holds all bytes of a stream. On Linux the file has no name and vanishes however the process ends. Elsewhere it is
/// removed when this value is dropped.
pub struct Spool {
    path: PathBuf,
    // Open, or kept by its name, as long as this lives.
    _file: Kept,
}

#[cfg(target_os = "linux")]
type Kept = std::fs::File;
#[cfg(not(target_os = "linux"))]
type Kept = tempfile::TempPath;

impl Spool {
    /// Reads a stream of at most `most` bytes to its end.
    ///
    /// # Errors
    /// The stream cannot be read or is longer than `most`, or the disk is full.
    pub fn of(input: &mut impl Read, most: u64) -> io::Result<Spool> {
        #[cfg(target_os = "linux")]
        let mut file = tempfile::tempfile()?;
        #[cfg(not(target_os = "linux"))]
        let mut file = tempfile::NamedTempFile::new()?;
        if io::copy(&mut input.take(most.saturating_add(1)), &mut file)? > most {
            return Err(io::Error::other(format!("it is longer than {} GiB", most >> 30)));
        }
        file.flush()?;
        #[cfg(target_os = "linux")]
        let (path, file) = (PathBuf::from(format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&file))), file);
        #[cfg(not(target_os = "linux"))]
        let (path, file) = (file.path().to_path_buf(), file.into_temp_path());
        Ok(Spool { path, _file: file })
    }

    /// A path under which the temporary file can be opened while this value exists.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_read_twice_and_one_that_is_too_long_is_refused() {
        let spool = Spool::of(&mut &b"twice"[..], 5).expect("kept");
        for _ in 0..2 {
            assert_eq!(std::fs::read(spool.path()).expect("read"), b"twice");
        }
        assert!(std::fs::metadata(spool.path()).is_ok_and(|about| about.is_file() && about.len() == 5));
        let path = spool.path().to_path_buf();
        drop(spool);
        assert!(std::fs::read(path).is_err());
        assert!(Spool::of(&mut &b"longer"[..], 5).is_err_and(|e| e.to_string().contains("longer than 0 GiB")));
    }
}
