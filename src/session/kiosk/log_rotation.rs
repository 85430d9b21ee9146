//! Log rotation: a full file becomes NAME.1, NAME.1 becomes NAME.2, and the oldest one is deleted.

use crate::files::private;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Default of the largest size of one log file, bytes.
pub const DEFAULT_FILE_BYTES: u64 = 10 << 20;
/// Default number of log files, the current one included.
pub const DEFAULT_FILES: u32 = 5;
/// Minimum size of a log file, bytes: a line that is longer than a file is cut.
const MIN_FILE_BYTES: u64 = 4096;
/// The end of a line that was cut.
const CUT_MARK: &[u8] = b" ... (cut)\n";

/// What a log is written to. Tests use one that gets full.
trait Sink: Write + Send {
    /// Truncates the file to so many bytes.
    fn truncate(&self, bytes: u64) -> io::Result<()>;
}

impl Sink for File {
    fn truncate(&self, bytes: u64) -> io::Result<()> {
        self.set_len(bytes)
    }
}

type Opener = Box<dyn FnMut(&Path) -> io::Result<Box<dyn Sink>> + Send>;

/// Writes a log to several files in rotation. The text up to the end of a line is one event, which is written completely or not at all.
///
/// Writing never fails. Lines that cannot be written, on a full disk or in a deleted folder, are counted. Every later write tries again, and the
/// first one that succeeds reports how many lines are missing. No line is split between two files; a line that is longer than a file is cut. All
/// files together hold at most `bytes` times `files` of `RotatingLog::open`. Only one process at a time may write to a log
/// ([`files::Lock`](crate::files::Lock)).
pub struct RotatingLog {
    path: PathBuf,
    bytes: u64,
    files: u32,
    open: Opener,
    sink: Option<Box<dyn Sink>>,
    /// Size of the current file, bytes.
    size: u64,
    /// The existing file ends in the middle of a line.
    within_line: bool,
    /// False for devices and pipes, which cannot be renamed.
    rotates: bool,
    /// The start of a line that is written in parts; at most the size of a file.
    partial_line: Vec<u8>,
    /// Number of lines that were lost since the last one that was written.
    lost_lines: u64,
    /// Becomes true when the file is to be opened again: it was renamed.
    reopens: Arc<AtomicBool>,
}

impl RotatingLog {
    /// Opens the log at `path`, or creates it. `bytes`: largest size of one file, where less than 4096 counts as 4096; `files`: number of files with
    /// the current one, where 0 counts as 1.
    ///
    /// # Errors
    /// One line that names the file: it cannot be written, or it or a file that rotation would move exists and is not a log.
    pub fn open(path: &Path, bytes: u64, files: u32) -> Result<RotatingLog, String> {
        for number in 0..files.max(1) {
            let file = rotated_name(path, number);
            match fs::metadata(&file) {
                Ok(there) if there.is_file() && !is_log_file(&file) => {
                    return Err(format!("{}: exists and is not a log; use another name", file.display()));
                }
                // A file cannot be renamed to an existing folder.
                Ok(there) if number > 0 && !there.is_file() => {
                    return Err(format!("{}: is in the way of the log; use another name", file.display()));
                }
                _ => {}
            }
        }
        let opener = |path: &Path| -> io::Result<Box<dyn Sink>> {
            Ok(Box::new(private(OpenOptions::new().create(true).append(true)).open(path)?))
        };
        RotatingLog::with(path, bytes, files, Box::new(opener))
            .map_err(|e| format!("{}: cannot be written: {e}", path.display()))
    }

    fn with(path: &Path, bytes: u64, files: u32, mut open: Opener) -> io::Result<RotatingLog> {
        let sink = open(path)?;
        let (bytes, files) = (bytes.max(MIN_FILE_BYTES), files.max(1));
        let rotates = fs::metadata(path).is_ok_and(|there| there.is_file());
        let mut log = RotatingLog {
            path: path.into(),
            bytes,
            files,
            open,
            sink: Some(sink),
            size: 0,
            within_line: false,
            rotates,
            partial_line: Vec::new(),
            lost_lines: 0,
            reopens: Arc::default(),
        };
        log.measure();
        Ok(log)
    }

    /// The same log, which opens its file anew before the next line whenever `reopens` has become true. When another program has renamed the
    /// file, lines then go to a new one.
    #[must_use]
    pub fn reopened(mut self, reopens: Arc<AtomicBool>) -> RotatingLog {
        self.reopens = reopens;
        self
    }

    /// Reads size and end of the existing file: the power may have failed in the middle of a line.
    fn measure(&mut self) {
        (self.size, self.within_line) = match self.rotates {
            true => File::open(&self.path).and_then(|file| end_of(&file)).unwrap_or_default(),
            false => (0, false),
        };
    }

    /// Writes an event, or counts its lines as lost.
    fn write_or_count(&mut self, event: &[u8]) {
        match self.write_event(event) {
            Ok(()) => self.lost_lines = 0,
            Err(_) => {
                self.lost_lines = self.lost_lines.saturating_add(event.iter().filter(|b| **b == b'\n').count() as u64)
            }
        }
    }

    /// Writes a complete event, or returns an error and writes nothing.
    fn write_event(&mut self, event: &[u8]) -> io::Result<()> {
        if self.reopens.swap(false, Ordering::Relaxed) {
            self.sink = None;
            self.measure();
        }
        let mut text = Vec::with_capacity(event.len() + 128);
        if self.lost_lines > 0 {
            let now = humantime::format_rfc3339_micros(SystemTime::now());
            writeln!(text, "{now}  WARN {} lines of the log could not be written", self.lost_lines)?;
        }
        text.extend_from_slice(event);
        // Reserves a byte to end an incomplete line before it.
        if self.rotates && text.len() as u64 >= self.bytes {
            let mut space = self.bytes as usize - CUT_MARK.len() - 1;
            // Does not cut inside of a character.
            space -= (0..3).take_while(|back| text[space - back] & 0xc0 == 0x80).count();
            text.truncate(space);
            text.extend_from_slice(CUT_MARK);
        }
        if self.rotates && self.size > 0 && self.size + text.len() as u64 >= self.bytes {
            self.rotate()?;
        }
        if self.sink.is_none() {
            self.sink = Some((self.open)(&self.path)?);
            self.measure();
        }
        if self.within_line {
            text.insert(0, b'\n');
        }
        let Some(sink) = &mut self.sink else { return Ok(()) };
        let written = sink.write_all(&text);
        match written {
            Ok(()) => {
                self.size += text.len() as u64;
                self.within_line = false;
            }
            Err(_) => {
                // A full disk may take part of a line. If that cannot be truncated, it is detected when the file is opened again.
                if self.rotates {
                    let _ = sink.truncate(self.size);
                }
                self.sink = None;
            }
        }
        written
    }

    /// Renames every file to the next number, from the oldest one, which is replaced.
    fn rotate(&mut self) -> io::Result<()> {
        // Closed first: not every system can rename an open file.
        self.sink = None;
        let ignore_missing = |done: io::Result<()>| match done {
            // The file was deleted by someone else.
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            done => done,
        };
        if self.files == 1 {
            ignore_missing(fs::remove_file(&self.path))?;
        }
        for number in (1..self.files).rev() {
            ignore_missing(fs::rename(rotated_name(&self.path, number - 1), rotated_name(&self.path, number)))?;
        }
        // Even if the new file cannot be created at once, there is nothing to rename any more.
        self.size = 0;
        self.within_line = false;
        Ok(())
    }
}

impl Write for RotatingLog {
    /// Always accepts everything: a fault of the log must not stop the program.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.partial_line.is_empty() && bytes.last() == Some(&b'\n') {
            self.write_or_count(bytes);
        } else if self.partial_line.len() + bytes.len() < self.bytes as usize && bytes.last() != Some(&b'\n') {
            self.partial_line.extend_from_slice(bytes);
        } else {
            let mut event = std::mem::take(&mut self.partial_line);
            event.extend_from_slice(bytes);
            if event.last() != Some(&b'\n') {
                event.push(b'\n');
            }
            self.write_or_count(&event);
        }
        Ok(bytes.len())
    }

    /// Does nothing: every line is written at its end.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for RotatingLog {
    fn drop(&mut self) {
        if !self.partial_line.is_empty() {
            let _ = self.write(b"\n");
        }
    }
}

/// A log whose file may not be available yet. Until it can be opened, lines go to another writer.
///
/// Writing never fails. A write tries to open the file if the last try is at least `pause` ago. The first line that is then written to the file
/// states why it could not be opened before.
pub struct LateLog<O, W> {
    open: O,
    until: W,
    pause: Duration,
    tried: Instant,
    /// The log, or the reason why it is not open yet.
    log: Result<RotatingLog, String>,
}

impl<O: FnMut() -> Result<RotatingLog, String>, W: Write> LateLog<O, W> {
    /// Tries to open the log by calling `open`. `until`: receives the lines until that succeeds; `pause`: shortest time between two tries.
    pub fn new(mut open: O, until: W, pause: Duration) -> LateLog<O, W> {
        LateLog { log: open(), open, until, pause, tried: Instant::now() }
    }

    /// The reason on one line why the last try could not open the file; None if it is open.
    pub fn fault(&self) -> Option<&str> {
        self.log.as_ref().err().map(String::as_str)
    }
}

impl<O: FnMut() -> Result<RotatingLog, String>, W: Write> Write for LateLog<O, W> {
    /// Always accepts everything: a fault of the log must not stop the program.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(fault) = &mut self.log
            && self.tried.elapsed() >= self.pause
        {
            let opened = (self.open)().map(|mut log| {
                let now = humantime::format_rfc3339_micros(SystemTime::now());
                log.write_or_count(format!("{now}  WARN the log begins here, until now: {fault}\n").as_bytes());
                log
            });
            (self.log, self.tried) = (opened, Instant::now());
        }
        match &mut self.log {
            Ok(log) => log.write(bytes),
            // There is no other place to say that standard error is closed.
            Err(_) => {
                let _ = self.until.write_all(bytes);
                Ok(bytes.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Size of a file, and whether its last line is incomplete.
fn end_of(mut file: &File) -> io::Result<(u64, bool)> {
    let size = file.seek(SeekFrom::End(0))?;
    if size == 0 {
        return Ok((0, false));
    }
    file.seek(SeekFrom::End(-1))?;
    let mut last = [0];
    file.read_exact(&mut last)?;
    Ok((size, last != *b"\n"))
}

/// Path of the log file after it was rotated `number` times; 0 is the current file.
pub(super) fn rotated_name(path: &Path, number: u32) -> PathBuf {
    if number == 0 {
        return path.into();
    }
    let mut name = OsString::from(path);
    name.push(format!(".{number}"));
    name.into()
}

/// True if a file is empty or begins with a time as logs of this program do. Other files, such as recordings, are never written to.
pub(super) fn is_log_file(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|f| f.take(11).read_to_end(&mut start));
    read.is_ok() && (start.is_empty() || (start.get(4) == Some(&b'-') && start.get(10) == Some(&b'T')))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::WorkFolder;
    use std::sync::Mutex;
    use std::sync::atomic::AtomicU64;

    /// A folder of one test, deleted at its end.
    struct Folder(WorkFolder);

    impl Folder {
        fn new() -> Folder {
            Folder(WorkFolder::new(&std::env::temp_dir(), "echolume-rotating-").expect("make a folder for the test"))
        }

        fn log(&self) -> PathBuf {
            self.0.path().join("a.log")
        }

        fn text(&self, number: u32) -> String {
            fs::read_to_string(rotated_name(&self.log(), number)).unwrap_or_default()
        }

        /// Contents of all files, oldest first.
        fn texts(&self) -> Vec<String> {
            (0..20).rev().map(|n| self.text(n)).filter(|t| !t.is_empty()).collect()
        }
    }

    fn line(number: usize) -> String {
        format!("2026-01-01T00:00:00.000000Z  INFO line {number:06} {}\n", "x".repeat(50))
    }

    #[test]
    fn full_files_are_rotated_and_the_oldest_is_deleted() {
        let folder = Folder::new();
        let mut log = RotatingLog::open(&folder.log(), 5000, 3).expect("open");
        let written: String = (0..1000).map(line).collect();
        for n in 0..1000 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        let texts = folder.texts();
        assert_eq!(texts.len(), 3);
        assert!(texts.iter().all(|t| t.len() <= 5000 && t.starts_with("2026-") && t.ends_with('\n')));
        // The files hold the end of what was written, without a gap.
        assert!(written.ends_with(&texts.concat()) && texts.concat().len() > 9000);
    }

    #[test]
    fn a_restart_continues_the_log_and_keeps_the_limits() {
        let folder = Folder::new();
        for n in 0..300 {
            let mut log = RotatingLog::open(&folder.log(), 5000, 2).expect("open");
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        let written: String = (0..300).map(line).collect();
        let texts = folder.texts();
        assert!(texts.len() == 2 && written.ends_with(&texts.concat()));
        // The power fails in the middle of a line.
        fs::write(folder.log(), "2026-01-01T00:00:00.000000Z  INFO half").expect("write");
        let mut log = RotatingLog::open(&folder.log(), 5000, 2).expect("open");
        log.write_all(line(7).as_bytes()).expect("never fails");
        assert_eq!(folder.text(0), format!("2026-01-01T00:00:00.000000Z  INFO half\n{}", line(7)));
    }

    #[test]
    fn a_log_that_was_renamed_is_opened_again_when_that_is_said() {
        let folder = Folder::new();
        let reopens: Arc<AtomicBool> = Arc::default();
        let mut log = RotatingLog::open(&folder.log(), 5000, 2).expect("open").reopened(reopens.clone());
        let mut write = |n: usize| log.write_all(line(n).as_bytes()).expect("never fails");
        write(0);
        let aside = folder.0.path().join("aside");
        fs::rename(folder.log(), &aside).expect("renamed");
        write(1);
        reopens.store(true, Ordering::Relaxed);
        write(2);
        write(3);
        assert_eq!(fs::read_to_string(&aside).expect("aside"), line(0) + &line(1));
        assert_eq!(folder.text(0), line(2) + &line(3));
        // Without a new name the file goes on, and its size counts.
        reopens.store(true, Ordering::Relaxed);
        (4..100).for_each(write);
        let texts = folder.texts();
        assert!(texts.len() == 2 && texts.iter().all(|t| t.len() <= 5000), "{}", texts.len());
    }

    #[test]
    fn a_log_whose_folder_is_made_later_begins_there() {
        let folder = Folder::new();
        let path = folder.0.path().join("later/a.log");
        let shared: Arc<Mutex<Vec<u8>>> = Arc::default();
        struct Until(Arc<Mutex<Vec<u8>>>);
        impl Write for Until {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                self.0.lock().expect("no panic").write(bytes)
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let open = || RotatingLog::open(&path, 5000, 2);
        let late = |pause| LateLog::new(open, Until(shared.clone()), pause);
        let (mut log, mut patient) = (late(Duration::ZERO), late(Duration::MAX));
        assert!(log.fault().is_some_and(|fault| fault.contains("later/a.log: cannot be written")), "{:?}", log.fault());
        (0..2).for_each(|n| log.write_all(line(n).as_bytes()).expect("never fails"));
        fs::create_dir(folder.0.path().join("later")).expect("make the folder");
        patient.write_all(line(2).as_bytes()).expect("never fails");
        assert!(!path.exists(), "the pause between tries was not kept");
        (3..5).for_each(|n| log.write_all(line(n).as_bytes()).expect("never fails"));
        let until = String::from_utf8(shared.lock().expect("no panic").clone()).expect("text");
        assert_eq!(until, line(0) + &line(1) + &line(2));
        let text = fs::read_to_string(&path).expect("the log");
        let (first, rest) = text.split_once('\n').expect("lines");
        assert!(
            first.contains("WARN the log begins here, until now: ") && first.contains("cannot be written"),
            "{first}"
        );
        assert_eq!((rest, log.fault()), ((line(3) + &line(4)).as_str(), None));
        assert!(is_log_file(&path));
    }

    #[test]
    fn a_file_that_is_not_a_log_is_neither_written_nor_renamed() {
        let folder = Folder::new();
        fs::write(folder.log(), "ObjectType = Image").expect("write");
        let refused = |named: &str| {
            let error = RotatingLog::open(&folder.log(), 5000, 3).map(drop).expect_err("refused");
            assert!(error.contains(named) && error.lines().count() == 1, "{error}");
        };
        refused("is not a log");
        fs::write(folder.log(), line(0)).expect("write");
        fs::write(rotated_name(&folder.log(), 2), "mine").expect("write");
        refused("a.log.2");
        fs::remove_file(rotated_name(&folder.log(), 2)).expect("remove");
        fs::create_dir(rotated_name(&folder.log(), 1)).expect("make a folder");
        refused("a.log.1: is in the way");
        // A number that rotation does not reach is not checked.
        assert!(RotatingLog::open(&folder.log(), 5000, 1).is_ok());
        let missing = RotatingLog::open(&folder.0.path().join("none/a.log"), 5000, 3).map(drop).expect_err("refused");
        assert!(missing.contains("none/a.log: cannot be written"), "{missing}");
    }

    #[test]
    fn lines_in_parts_and_lines_longer_than_a_file_stay_within_the_limits() {
        let folder = Folder::new();
        let mut log = RotatingLog::open(&folder.log(), 5000, 3).expect("open");
        for n in 0..200 {
            // In several parts, and as an event of two lines.
            writeln!(log, "2026-01-01T{n:06} {}b", "a".repeat(40)).expect("never fails");
            let event = format!("2026-01-01T{n:06} {}\n{}\n", "a".repeat(40), "b".repeat(40));
            log.write_all(event.as_bytes()).expect("never fails");
        }
        assert!(folder.texts().iter().all(|t| t.starts_with("2026-") && t.len() <= 5000 && t.ends_with("b\n")));
        log.write_all(format!("2026-01-01T {}\n", "ü".repeat(10_000)).as_bytes()).expect("never fails");
        log.write_all("ü".repeat(10_000).as_bytes()).expect("never fails");
        let texts = folder.texts();
        assert!(texts.iter().all(|t| t.len() <= 5000) && texts[2].ends_with(" ... (cut)\n"), "{texts:?}");
        log.write_all(b"2026-01-01T the end").expect("never fails");
        drop(log);
        assert!(folder.text(0).ends_with("T the end\n"));
    }

    #[test]
    fn threads_do_not_mix_their_lines_and_lose_none() {
        let folder = Folder::new();
        let log = Mutex::new(RotatingLog::open(&folder.log(), 20_000, 20).expect("open"));
        std::thread::scope(|scope| {
            for thread in 0..8 {
                let log = &log;
                scope.spawn(move || {
                    for n in 0..200 {
                        log.lock()
                            .expect("no panic")
                            .write_all(line(1000 * thread + n).as_bytes())
                            .expect("never fails");
                    }
                });
            }
        });
        let all = folder.texts().concat();
        let mut lines: Vec<&str> = all.split_inclusive('\n').collect();
        lines.sort();
        let mut expected: Vec<String> = (0..8).flat_map(|t| (0..200).map(move |n| line(1000 * t + n))).collect();
        expected.sort();
        assert_eq!(lines, expected);
    }

    /// A file on a disk with limited space.
    struct Disk {
        file: File,
        space: Arc<AtomicU64>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let space = self.space.load(Ordering::Relaxed).min(bytes.len() as u64);
            if space == 0 {
                return Err(io::Error::from(ErrorKind::StorageFull));
            }
            self.space.fetch_sub(space, Ordering::Relaxed);
            self.file.write(&bytes[..space as usize])
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Sink for Disk {
        fn truncate(&self, bytes: u64) -> io::Result<()> {
            self.file.set_len(bytes)
        }
    }

    #[test]
    fn a_full_disk_leaves_no_partial_line_and_is_reported_when_there_is_space() {
        let folder = Folder::new();
        let space = Arc::new(AtomicU64::new(2 * line(0).len() as u64 + 30));
        let disk_space = space.clone();
        let opener = move |path: &Path| -> io::Result<Box<dyn Sink>> {
            let file = OpenOptions::new().create(true).append(true).open(path)?;
            Ok(Box::new(Disk { file, space: disk_space.clone() }))
        };
        let mut log = RotatingLog::with(&folder.log(), 5000, 20, Box::new(opener)).expect("open");
        for n in 0..9 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        assert_eq!(folder.text(0), format!("{}{}", line(0), line(1)));
        space.store(1 << 20, Ordering::Relaxed);
        for n in 9..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        let all = folder.texts().concat();
        let lines: Vec<&str> = all.lines().collect();
        assert!(lines[2].ends_with("WARN 7 lines of the log could not be written"), "{}", lines[2]);
        assert_eq!((lines.len(), format!("{}\n", lines[3]), format!("{}\n", lines[193])), (194, line(9), line(199)));
    }

    #[test]
    fn a_deleted_folder_loses_lines_only() {
        let folder = Folder::new();
        let mut log = RotatingLog::open(&folder.log(), 4096, 3).expect("open");
        for n in 0..40 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        fs::remove_dir_all(folder.0.path()).expect("remove the folder");
        // Some lines go into the deleted file, until it is full.
        for n in 0..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        fs::create_dir_all(folder.0.path()).expect("make it again");
        log.write_all(line(0).as_bytes()).expect("never fails");
        log.write_all(line(1).as_bytes()).expect("never fails");
        let text = folder.text(0);
        assert!(text.lines().count() == 3 && text.contains("lines of the log could not be written"), "{text}");
    }

    #[test]
    fn a_file_that_cannot_be_renamed_is_not_overwritten() {
        let folder = Folder::new();
        let mut log = RotatingLog::open(&folder.log(), 4096, 2).expect("open");
        fs::create_dir(rotated_name(&folder.log(), 1)).expect("something is in the way");
        for n in 0..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        assert!(folder.text(0).starts_with(&line(0)) && folder.text(0).len() <= 4096);
        fs::remove_dir(rotated_name(&folder.log(), 1)).expect("out of the way");
        log.write_all(line(200).as_bytes()).expect("never fails");
        assert!(folder.text(1).starts_with(&line(0)) && folder.text(0).contains("lines of the log could not be"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_does_not_block_and_is_not_renamed() {
        let full = Path::new("/dev/full");
        let mut log = RotatingLog::open(full, 4096, 5).expect("open");
        for n in 0..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        assert_eq!(log.lost_lines, 200);
        assert!(full.exists() && !rotated_name(full, 1).exists());
    }
}
