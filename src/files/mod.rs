//! Files: bounded reading, atomic replacement, and signal handling while a file is written.
//!
//! Some errors omit the file's name, because the caller adds it.

mod input_error;
pub mod signals;
mod unfinished;

pub use input_error::InputError;
pub(crate) use input_error::{escaped, quoted};
pub use unfinished::Unfinished;

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;

/// Reads a file of at most `max_bytes` bytes. `what` names its kind in messages.
///
/// # Errors
/// The fault without the file's name: it is not a regular file, is longer than `max_bytes`, or cannot be read.
pub fn read(path: &Path, max_bytes: u64, what: &str) -> Result<Vec<u8>, String> {
    let unreadable = |e: std::io::Error| format!("cannot be read: {e}");
    let too_long = || Err(format!("is longer than {} MiB, which no {what} is", max_bytes >> 20));
    let about = std::fs::metadata(path).map_err(unreadable)?;
    // Reading a pipe would block, and a device may never end.
    if !about.is_file() {
        return Err("is not a regular file".into());
    }
    if about.len() > max_bytes {
        return too_long();
    }
    let mut bytes = Vec::new();
    // The file may grow meanwhile, and files of the kernel report no length.
    File::open(path).and_then(|file| file.take(max_bytes + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > max_bytes { too_long() } else { Ok(bytes) }
}

/// Like [`read`], for text.
///
/// # Errors
/// Those of [`read`], and bytes that are not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64, what: &str) -> Result<String, String> {
    String::from_utf8(read(path, max_bytes, what)?).map_err(|_| "cannot be read: it is not UTF-8 text".into())
}

/// Replaces a file atomically: writes a temporary file next to it, then renames. A full disk or a signal leaves the old file unchanged.
///
/// # Errors
/// One line that names the file and the fault.
pub fn replace(file: &Path, bytes: &[u8]) -> Result<(), String> {
    let cannot = |e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", file.display());
    if is_special(file) {
        // Write to a device or a pipe directly: renaming would replace it.
        let opened = OpenOptions::new().write(true).open(file);
        return opened.and_then(|mut f| f.write_all(bytes)).map_err(|e| cannot(&e));
    }
    check_place(file)?;
    let mut unfinished = Unfinished::create(file).map_err(|e| cannot(&e))?;
    unfinished
        .write_all(bytes)
        .and_then(|()| unfinished.finish())
        .and_then(|()| unfinished.rename())
        .map_err(|e| cannot(&e))
}

/// Checks that a file can be written there, before any work is done.
///
/// # Errors
/// One line: the folder does not exist or cannot be written, or the name is a folder.
pub fn check_target(file: &Path) -> Result<(), String> {
    check_place(file)?;
    match is_special(file) {
        true => Ok(()),
        false => match Unfinished::create(file) {
            Ok(_) => Ok(()),
            Err(e) => Err(format!("{}: cannot be written: {e}", file.display())),
        },
    }
}

fn check_place(file: &Path) -> Result<(), String> {
    let cannot = |fault: &str| Err(format!("{}: cannot be written: {fault}", file.display()));
    if file.is_dir() || file.file_name().is_none() {
        return cannot("it is a folder");
    }
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
            cannot(&format!("there is no folder {}; make it first", folder.display()))
        }
        _ => Ok(()),
    }
}

fn is_special(file: &Path) -> bool {
    std::fs::metadata(file).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_the_limit_is_read_and_one_byte_more_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("text");
        std::fs::write(&path, vec![b'x'; 1 << 20]).expect("written");
        assert_eq!(read_text(&path, 1 << 20, "scene").expect("read").len(), 1 << 20);
        std::fs::write(&path, vec![b'x'; (1 << 20) + 1]).expect("written");
        assert_eq!(read(&path, 1 << 20, "scene"), Err("is longer than 1 MiB, which no scene is".into()));
        std::fs::write(&path, [0xff]).expect("written");
        assert!(read_text(&path, 1 << 20, "scene").is_err_and(|e| e.contains("UTF-8")));
        assert_eq!(read(folder.path(), 1, "scene"), Err("is not a regular file".into()));
    }

    #[cfg(unix)]
    #[test]
    fn what_is_replaced_through_a_link_is_the_file_and_no_device_is() {
        let folder = tempfile::tempdir().expect("a folder");
        let (file, link, null) = (folder.path().join("file"), folder.path().join("link"), folder.path().join("null"));
        std::fs::write(&file, "old").expect("written");
        std::os::unix::fs::symlink(&file, &link).expect("a link");
        std::os::unix::fs::symlink("/dev/null", &null).expect("a link");
        replace(&link, b"new").expect("written");
        assert_eq!(std::fs::read(&file).expect("the file"), b"new");
        assert!(std::fs::symlink_metadata(&link).expect("the link").is_symlink());
        replace(&null, b"new").expect("a device takes all");
        assert!(Unfinished::create(&null).is_err_and(|e| e.to_string().contains("regular file")));
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 3, "nothing is left beside it");
    }

    #[test]
    fn several_files_of_one_folder_are_written_at_the_same_time() {
        let folder = tempfile::tempdir().expect("a folder");
        std::thread::scope(|scope| {
            for n in 0..8 {
                let file = folder.path().join(n.to_string());
                scope.spawn(move || replace(&file, &vec![n; 1 << 16]).expect("written"));
            }
        });
        for n in 0..8u8 {
            assert_eq!(std::fs::read(folder.path().join(n.to_string())).expect("read"), vec![n; 1 << 16]);
        }
    }
}
