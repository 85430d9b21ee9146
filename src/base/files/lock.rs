//! A lock on a file or folder that only one process at a time may write to: metrics, a log, results. The operating system releases the lock
//! when the process ends in any way.

use std::fs::{File, OpenOptions, TryLockError, metadata, remove_file};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// A lock of a file or a folder against other processes; dropping it releases the lock. What is locked is a hidden file: `.NAME.lock` beside a
/// file, `.echolume.lock` in a folder. After a crash this file remains, unlocked.
#[derive(Debug)]
pub struct Lock {
    /// None: the place cannot be locked.
    held: Option<(PathBuf, File)>,
}

impl Lock {
    /// False if nothing is locked: the place is a device or a pipe, or no lock file can be made there, for example because the folder is missing.
    pub fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// Locks a file or a folder. For devices, pipes and places where no lock file can be made it succeeds without a lock ([`Lock::is_held`]):
    /// writing there reports the fault.
    ///
    /// # Errors
    /// Another [`Lock`], usually of another process, holds the lock: one line with the path, and with the process if it is known.
    pub fn take(place: &Path) -> Result<Lock, String> {
        let Some(path) = file_of(place) else { return Ok(Lock { held: None }) };
        loop {
            let Some(mut file) = opened(&path) else { return Ok(Lock { held: None }) };
            match file.try_lock() {
                // Whoever held it before may have removed the file meanwhile.
                Ok(()) if !is_at(&file, &path) => continue,
                Ok(()) => {
                    // Who holds it, for others: it is no fault if that cannot be written.
                    let _ = file.set_len(0).and_then(|()| write!(file, "{}", std::process::id()));
                    return Ok(Lock { held: Some((path, file)) });
                }
                Err(TryLockError::Error(_)) => return Ok(Lock { held: None }),
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    let _ = file.take(20).read_to_string(&mut holder);
                    let by = match holder.parse::<u32>() {
                        Ok(id) => format!("process {id}"),
                        Err(_) => "another process".into(),
                    };
                    return Err(format!("{}: is in use by {by}; end it, or give another name", place.display()));
                }
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if let Some((path, file)) = &self.held
            && is_at(file, path)
        {
            // While it is locked: who opened it before finds that it is gone.
            let _ = remove_file(path);
        }
    }
}

/// True if a file is the one at a path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    file.metadata().ok().map(of) == metadata(path).ok().map(of)
}

#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

/// The file that is locked.
fn file_of(place: &Path) -> Option<PathBuf> {
    match metadata(place) {
        Ok(there) if there.is_dir() => Some(place.join(".echolume.lock")),
        Ok(there) if !there.is_file() => None,
        _ => Some(place.with_file_name(format!(".{}.lock", place.file_name()?.to_string_lossy()))),
    }
}

/// The file to read and write, or to read alone if it belongs to another user.
fn opened(path: &Path) -> Option<File> {
    let written = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
    written.or_else(|_| File::open(path)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_locked_once_and_its_holder_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.prom");
        for place in [file.as_path(), folder.path()] {
            let held = Lock::take(place).expect("free");
            let why = Lock::take(place).expect_err("held");
            assert!(why.contains(&format!("is in use by process {}", std::process::id())), "{why}");
            assert!(why.starts_with(&place.display().to_string()) && why.lines().count() == 1, "{why}");
            drop(held);
            Lock::take(place).expect("free again");
        }
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 0, "nothing is left");
        // What a crash left.
        std::fs::write(folder.path().join(".a.prom.lock"), "1").expect("written");
        Lock::take(&file).expect("nobody holds it");
        // What cannot be locked is left to who writes there.
        Lock::take(Path::new("/dev/null")).and_then(|_| Lock::take(&folder.path().join("none/a"))).expect("not locked");
    }
}
