//! Files: bounded reading and its progress, atomic replacement, and signal handling while a file is written.
//!
//! [`Unfinished`] is a file that is either complete or absent. [`InputError`] is an error of an input file: one line that names the file,
//! the field and the fault. Some errors omit the file's name, because the caller adds it.

mod lock;
pub mod progress;
pub mod signals;
mod spool;

pub use lock::Lock;
pub use spool::Spool;

use crate::text::push_visible;
use signals::Writing;
use std::fs::{File, OpenOptions, metadata};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use tempfile::NamedTempFile;

/// Reads a file of at most `max_bytes` bytes. `what` names its kind in messages.
///
/// # Errors
/// The fault without the file's name: it is not a regular file, is longer than `max_bytes`, or cannot be read.
pub fn read(path: &Path, max_bytes: u64, what: &str) -> Result<Vec<u8>, String> {
    let unreadable = |e: io::Error| format!("cannot be read: {e}");
    let too_long = || Err(format!("is longer than {} MiB, which no {what} is", max_bytes >> 20));
    let about = metadata(path).map_err(unreadable)?;
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

/// Reads a text file of at most `max_bytes` bytes. `what` names its kind in messages.
///
/// # Errors
/// The fault without the file's name: it is not a regular file, is longer than `max_bytes`, cannot be read, or is not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64, what: &str) -> Result<String, String> {
    String::from_utf8(read(path, max_bytes, what)?).map_err(|_| "cannot be read: it is not UTF-8 text".into())
}

/// Who may read a new file. Only its owner writes to it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Readers {
    /// The owner alone, because the file may hold frames of a patient, unless [`follow_umask`] was called or `ECHOLUME_PRIVATE` is 0.
    Owner,
    /// The users that the umask allows.
    Umask,
    /// Everyone, whatever the umask says.
    All,
}

/// The files of this process follow the umask.
static FOLLOWS_UMASK: AtomicBool = AtomicBool::new(false);

/// From now on the umask decides who may read files that may hold patients' frames and that this process creates. Without this call only their owner
/// may read them.
pub fn follow_umask() {
    FOLLOWS_UMASK.store(true, Ordering::Relaxed);
}

/// Sets the options for a file that may hold frames of a patient: only its owner may read a new file, unless [`follow_umask`] was called. Without
/// effect except on Unix.
pub fn private(options: &mut OpenOptions) -> &mut OpenOptions {
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(options, Readers::Owner.mode());
    options
}

impl Readers {
    /// The mode of a new file, before the umask.
    #[cfg(unix)]
    fn mode(self) -> u32 {
        let follows_umask =
            || FOLLOWS_UMASK.load(Ordering::Relaxed) || std::env::var_os(PRIVATE).is_some_and(|is| is == "0");
        if self == Readers::Owner && !follows_umask() { 0o600 } else { 0o666 }
    }
}

/// Name of the environment variable whose value 0 has the effect of [`follow_umask`].
pub const PRIVATE: &str = "ECHOLUME_PRIVATE";

/// Replaces a file atomically: writes a temporary file next to it, then renames. A full disk or a signal leaves the old file unchanged. Only
/// its owner may read the new one, unless [`follow_umask`] was called. A device or a pipe is written to directly.
///
/// # Errors
/// One line that names the file and the fault.
pub fn replace(file: &Path, bytes: &[u8]) -> Result<(), String> {
    replace_file(file, bytes, Readers::Owner)
}

/// Replaces a file atomically, as [`replace`] does, but the umask decides who may read it: for content that tells nothing about patients.
///
/// # Errors
/// One line that names the file and the fault.
pub fn replace_shared(file: &Path, bytes: &[u8]) -> Result<(), String> {
    replace_file(file, bytes, Readers::Umask)
}

/// Replaces a file atomically, as [`replace`] does, but every user may read it, whatever the umask is, because another service has to read it.
///
/// # Errors
/// One line that names the file and the fault.
pub fn replace_for_all(file: &Path, bytes: &[u8]) -> Result<(), String> {
    replace_file(file, bytes, Readers::All)
}

fn replace_file(file: &Path, bytes: &[u8], readers: Readers) -> Result<(), String> {
    let cannot = |e: &dyn std::fmt::Display| format!("{}: cannot be written: {e}", file.display());
    if is_special(file) {
        // Write to a device or a pipe directly: renaming would replace it.
        let opened = OpenOptions::new().write(true).open(file);
        return opened.and_then(|mut f| f.write_all(bytes)).map_err(|e| cannot(&e));
    }
    check_place(file)?;
    let mut unfinished = Unfinished::with(file, readers).map_err(|e| cannot(&e))?;
    unfinished.write_all(bytes).and_then(|()| unfinished.complete()).map_err(|e| cannot(&e))
}

/// Checks, before any work is done, that a file of this name can be written.
///
/// # Errors
/// One line: the folder does not exist or cannot be written, or the name is a folder.
pub fn check_target(file: &Path) -> Result<(), String> {
    check_place(file)?;
    if is_special(file) {
        return Ok(());
    }
    Unfinished::create(file).map(drop).map_err(|e| format!("{}: cannot be written: {e}", file.display()))
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
    metadata(file).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

/// A temporary folder for incomplete files. Dropping it deletes the folder and its content.
#[derive(Debug)]
pub struct WorkFolder(tempfile::TempDir);

impl WorkFolder {
    /// Creates a folder in `parent`, whose name begins with `prefix`.
    ///
    /// # Errors
    /// One line: the folder cannot be created.
    pub fn new(parent: &Path, prefix: &str) -> Result<WorkFolder, String> {
        let created = tempfile::Builder::new().prefix(prefix).tempdir_in(parent);
        created.map(WorkFolder).map_err(|e| format!("{}: {e}", parent.display()))
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

/// A file that is written under a temporary name until it is complete. Dropping it earlier deletes it. After a signal, writes fail, so that the
/// writer stops; the signal takes effect once the temporary file is deleted or renamed.
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
    /// Creates the temporary file in the folder of `target`. Only its owner may read it, unless [`follow_umask`] was called.
    ///
    /// # Errors
    /// The folder cannot be written, or the target exists and is not a regular file.
    pub fn create(target: &Path) -> io::Result<Unfinished> {
        Unfinished::with(target, Readers::Owner)
    }

    #[cfg_attr(not(unix), expect(unused_variables, reason = "files have no mode"))]
    fn with(target: &Path, readers: Readers) -> io::Result<Unfinished> {
        #[cfg(unix)]
        use std::{fs::Permissions, os::unix::fs::PermissionsExt};
        // Resolve links, and use the target's folder, so that renaming is atomic within one file system.
        let target = target.canonicalize().unwrap_or_else(|_| target.to_path_buf());
        if metadata(&target).is_ok_and(|there| !there.is_file()) {
            return Err(io::Error::other("the target is not a regular file"));
        }
        let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut named = tempfile::Builder::new();
        named.prefix(".echolume-").suffix(".part");
        // The process' umask applies, too, as for any new file.
        #[cfg(unix)]
        named.permissions(Permissions::from_mode(readers.mode()));
        let signals = Writing::begin();
        let file = named.tempfile_in(folder)?;
        #[cfg(unix)]
        if readers == Readers::All {
            file.as_file().set_permissions(Permissions::from_mode(0o644))?;
        }
        Ok(Unfinished { file: BufWriter::new(Part { file, signals }), target })
    }

    /// Overwrites bytes that were written before, from `at` bytes after the beginning of the file.
    ///
    /// # Errors
    /// The disk is full, or a signal arrived.
    pub fn patch(&mut self, at: u64, bytes: &[u8]) -> io::Result<()> {
        self.file.flush()?;
        let mut file = self.file.get_ref().file.as_file();
        file.seek(SeekFrom::Start(at))?;
        file.write_all(bytes)?;
        file.seek(SeekFrom::End(0)).map(drop)
    }

    /// Flushes everything to the disk, and gives the file its name.
    ///
    /// # Errors
    /// The disk is full, or a signal arrived.
    pub fn complete(mut self) -> io::Result<()> {
        self.finish()?;
        self.rename()
    }

    /// Flushes everything to the disk. The file keeps its temporary name until [`Unfinished::rename`].
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
    /// The disk is full, a signal arrived before everything was written, or the file cannot be renamed.
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

/// Longest quotation from a file, characters.
const MAX_QUOTE: usize = 60;
/// Longest part of a message, characters.
const MAX_PART: usize = 300;

/// An error of an input file: one line that names the file, the field and what is wrong with it.
///
/// Everything that comes from the file is escaped and shortened, so that a file cannot send control characters to a terminal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {field}: {fault}")]
pub struct InputError {
    file: String,
    field: String,
    fault: String,
}

impl InputError {
    /// An error of `field` in `file`. All three parts are escaped and shortened.
    pub fn new(file: &Path, field: impl AsRef<str>, fault: impl AsRef<str>) -> InputError {
        InputError {
            file: escaped(&file.display().to_string(), MAX_PART),
            field: escaped(field.as_ref(), MAX_PART),
            fault: escaped(fault.as_ref(), MAX_PART),
        }
    }

    /// The error that the operating system cannot read `file`.
    pub fn unreadable(file: &Path, error: &io::Error) -> InputError {
        InputError::new(file, "file", format!("cannot be read: {error}"))
    }

    /// The error that the operating system cannot write `file`.
    pub fn unwritable(file: &Path, error: &io::Error) -> InputError {
        InputError::new(file, "file", format!("cannot be written: {error}"))
    }

    /// The same error, with `name` in place of the file's name: the name by which the user knows the file.
    pub fn renamed(self, name: &str) -> InputError {
        InputError { file: escaped(name, MAX_PART), ..self }
    }

    /// Name of the faulty field of the file.
    pub fn field(&self) -> &str {
        &self.field
    }

    /// What is wrong with the field of the file.
    pub fn fault(&self) -> &str {
        &self.fault
    }
}

/// A value from a file, for messages: in quotes, escaped and shortened.
pub fn quoted(value: &str) -> String {
    format!("'{}'", escaped(value, MAX_QUOTE))
}

/// The first `longest` characters of a text, with control characters and other invisible ones escaped; `...` follows if the text is longer.
pub fn escaped(text: &str, longest: usize) -> String {
    let mut line = String::new();
    for (i, c) in text.chars().enumerate() {
        if i == longest {
            line.push_str("...");
            break;
        }
        push_visible(&mut line, c);
    }
    line
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

    #[test]
    fn a_file_cannot_break_the_line_or_drive_the_terminal() {
        let error =
            InputError::new(Path::new("a\nb"), "Dim\u{1b}[2J", quoted(&"x\r\n\u{202e}".repeat(400))).to_string();
        assert_eq!(error.lines().count(), 1);
        assert!(!error.chars().any(|c| c.is_control() || c == '\u{202e}'), "{error}");
        assert!(error.len() < 2000);
    }
}
