//! A log that stays within bounds: a file that is full becomes NAME.1, NAME.1 becomes NAME.2, and the oldest goes.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Of a file of the program's own log, bytes.
pub const USUAL_BYTES: u64 = 10 << 20;
/// Files of it, the one that is written included.
pub const USUAL_FILES: u32 = 5;
/// A line that is longer than a file would never find room, so a file has some, bytes.
const FEWEST_BYTES: u64 = 4096;
/// Ends a line that was longer than a file.
const CUT: &[u8] = b" ... (cut)\n";

/// What a log is written to; the tests have one that is full.
trait Sink: Write + Send {
    /// Takes back what was written beyond so many bytes.
    fn cut(&self, bytes: u64) -> io::Result<()>;
}

impl Sink for File {
    fn cut(&self, bytes: u64) -> io::Result<()> {
        self.set_len(bytes)
    }
}

type Opener = Box<dyn FnMut(&Path) -> io::Result<Box<dyn Sink>> + Send>;

/// The writer of such a log. What is written up to an end of line is one event, whole or not there.
///
/// It never fails: what cannot be written, on a full disk or in a folder that is gone, is counted in lines, every later write tries
/// again, and the first one that works says how many are missing. No line is ever divided between two files, and together they hold
/// at most `bytes` times `files`. One process at a time may write to a log.
pub struct Rotating {
    path: PathBuf,
    bytes: u64,
    files: u32,
    open: Opener,
    sink: Option<Box<dyn Sink>>,
    /// Of the file that is written, bytes.
    size: u64,
    /// What somebody left there did not end its last line.
    within_line: bool,
    /// Devices and pipes cannot be renamed.
    rotates: bool,
    /// The beginning of a line, when it comes in parts; no longer than a file.
    begun: Vec<u8>,
    /// Lines since the last one that was written.
    lost: u64,
}

impl Rotating {
    /// Goes on with the log at `path`, or begins it. `bytes`: of one file, 4096 at least; `files`: in all, 1 or more.
    ///
    /// # Errors
    /// One line that names the file: it cannot be written, or it, or a file that rotation would move, is there and is no log.
    pub fn open(path: &Path, bytes: u64, files: u32) -> Result<Rotating, String> {
        for number in 0..files.max(1) {
            let file = numbered(path, number);
            match fs::metadata(&file) {
                Ok(there) if there.is_file() && !holds_a_log(&file) => {
                    return Err(format!("{}: holds something else than a log; give another name", file.display()));
                }
                // Renaming the next newer one onto a folder would never work.
                Ok(there) if number > 0 && !there.is_file() => {
                    return Err(format!("{}: is in the way of the log; give another name", file.display()));
                }
                _ => {}
            }
        }
        let opener = |path: &Path| -> io::Result<Box<dyn Sink>> {
            Ok(Box::new(OpenOptions::new().create(true).append(true).open(path)?))
        };
        Rotating::with(path, bytes, files, Box::new(opener))
            .map_err(|e| format!("{}: cannot be written: {e}", path.display()))
    }

    fn with(path: &Path, bytes: u64, files: u32, mut open: Opener) -> io::Result<Rotating> {
        let sink = open(path)?;
        let (bytes, files) = (bytes.max(FEWEST_BYTES), files.max(1));
        let rotates = fs::metadata(path).is_ok_and(|there| there.is_file());
        let mut log = Rotating {
            path: path.into(),
            bytes,
            files,
            open,
            sink: Some(sink),
            size: 0,
            within_line: false,
            rotates,
            begun: Vec::new(),
            lost: 0,
        };
        log.measure();
        Ok(log)
    }

    /// Takes up what is there: the power may have gone in the middle of a line.
    fn measure(&mut self) {
        (self.size, self.within_line) = match self.rotates {
            true => File::open(&self.path).and_then(|file| end_of(&file)).unwrap_or_default(),
            false => (0, false),
        };
    }

    fn keep(&mut self, event: &[u8]) {
        match self.write_event(event) {
            Ok(()) => self.lost = 0,
            Err(_) => self.lost = self.lost.saturating_add(event.iter().filter(|b| **b == b'\n').count() as u64),
        }
    }

    /// All of an event, or an error and nothing of it.
    fn write_event(&mut self, event: &[u8]) -> io::Result<()> {
        let mut whole = Vec::with_capacity(event.len() + 128);
        if self.lost > 0 {
            let now = humantime::format_rfc3339_micros(SystemTime::now());
            writeln!(whole, "{now}  WARN {} lines of the log could not be written", self.lost)?;
        }
        whole.extend_from_slice(event);
        // With room for the end of a line that was left without.
        if self.rotates && whole.len() as u64 >= self.bytes {
            let mut room = self.bytes as usize - CUT.len() - 1;
            // Not within a character.
            room -= (0..3).take_while(|back| whole[room - back] & 0xc0 == 0x80).count();
            whole.truncate(room);
            whole.extend_from_slice(CUT);
        }
        if self.rotates && self.size > 0 && self.size + whole.len() as u64 >= self.bytes {
            self.rotate()?;
        }
        if self.sink.is_none() {
            self.sink = Some((self.open)(&self.path)?);
            self.measure();
        }
        if self.within_line {
            whole.insert(0, b'\n');
        }
        let Some(sink) = &mut self.sink else { return Ok(()) };
        let written = sink.write_all(&whole);
        match written {
            Ok(()) => {
                self.size += whole.len() as u64;
                self.within_line = false;
            }
            Err(_) => {
                // A full disk takes a part of a line. Where that cannot be taken back, it is found when the file is opened anew.
                if self.rotates {
                    let _ = sink.cut(self.size);
                }
                self.sink = None;
            }
        }
        written
    }

    /// Moves every file on by one, from the oldest, which is replaced.
    fn rotate(&mut self) -> io::Result<()> {
        // Closed first: not every system renames what is open.
        self.sink = None;
        let gone = |done: io::Result<()>| match done {
            // Somebody else has cleaned up.
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
            done => done,
        };
        if self.files == 1 {
            gone(fs::remove_file(&self.path))?;
        }
        for number in (1..self.files).rev() {
            gone(fs::rename(numbered(&self.path, number - 1), numbered(&self.path, number)))?;
        }
        // From here on there is nothing to move, even if the new file cannot be made at once.
        self.size = 0;
        self.within_line = false;
        Ok(())
    }
}

impl Write for Rotating {
    /// Takes everything: a log that cannot be written must not stop what it tells of.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.begun.is_empty() && bytes.last() == Some(&b'\n') {
            self.keep(bytes);
        } else if self.begun.len() + bytes.len() < self.bytes as usize && bytes.last() != Some(&b'\n') {
            self.begun.extend_from_slice(bytes);
        } else {
            let mut event = std::mem::take(&mut self.begun);
            event.extend_from_slice(bytes);
            if event.last() != Some(&b'\n') {
                event.push(b'\n');
            }
            self.keep(&event);
        }
        Ok(bytes.len())
    }

    /// Does nothing: every line is written when it ends.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Rotating {
    fn drop(&mut self) {
        if !self.begun.is_empty() {
            let _ = self.write(b"\n");
        }
    }
}

/// Size, and whether a line is left without its end.
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

/// The name of the log's file so many rotations old; 0 is the one that is written.
pub fn numbered(path: &Path, number: u32) -> PathBuf {
    if number == 0 {
        return path.into();
    }
    let mut name = OsString::from(path);
    name.push(format!(".{number}"));
    name.into()
}

/// An empty file, or one whose first line begins with a time as ours do: a recording is never appended to.
pub fn holds_a_log(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|f| f.take(11).read_to_end(&mut start));
    read.is_ok() && (start.is_empty() || (start.get(4) == Some(&b'-') && start.get(10) == Some(&b'T')))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::sync::{Arc, Mutex};

    /// A folder of one test, gone at its end.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Folder {
            let path = std::env::temp_dir().join(format!("echolume-rotating-{}-{name}", std::process::id()));
            fs::create_dir_all(&path).expect("make a folder for the test");
            Folder(path)
        }

        fn log(&self) -> PathBuf {
            self.0.join("a.log")
        }

        fn text(&self, number: u32) -> String {
            fs::read_to_string(numbered(&self.log(), number)).unwrap_or_default()
        }

        /// Every file from the oldest on.
        fn texts(&self) -> Vec<String> {
            (0..20).rev().map(|n| self.text(n)).filter(|t| !t.is_empty()).collect()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn line(number: usize) -> String {
        format!("2026-01-01T00:00:00.000000Z  INFO line {number:06} {}\n", "x".repeat(50))
    }

    #[test]
    fn full_files_are_numbered_and_the_oldest_goes() {
        let folder = Folder::new("count");
        let mut log = Rotating::open(&folder.log(), 5000, 3).expect("open");
        let written: String = (0..1000).map(line).collect();
        for n in 0..1000 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        let texts = folder.texts();
        assert_eq!(texts.len(), 3);
        assert!(texts.iter().all(|t| t.len() <= 5000 && t.starts_with("2026-") && t.ends_with('\n')));
        // What is left is the end of what was written, without a gap.
        assert!(written.ends_with(&texts.concat()) && texts.concat().len() > 9000);
    }

    #[test]
    fn a_restart_goes_on_where_the_log_ended_and_bounds_what_was_there() {
        let folder = Folder::new("restart");
        for n in 0..300 {
            let mut log = Rotating::open(&folder.log(), 5000, 2).expect("open");
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        let written: String = (0..300).map(line).collect();
        let texts = folder.texts();
        assert!(texts.len() == 2 && written.ends_with(&texts.concat()));
        // The power goes in the middle of a line.
        fs::write(folder.log(), "2026-01-01T00:00:00.000000Z  INFO half").expect("write");
        let mut log = Rotating::open(&folder.log(), 5000, 2).expect("open");
        log.write_all(line(7).as_bytes()).expect("never fails");
        assert_eq!(folder.text(0), format!("2026-01-01T00:00:00.000000Z  INFO half\n{}", line(7)));
    }

    #[test]
    fn a_file_that_is_no_log_is_neither_written_to_nor_moved() {
        let folder = Folder::new("foreign");
        fs::write(folder.log(), "ObjectType = Image").expect("write");
        let refused = |named: &str| {
            let error = Rotating::open(&folder.log(), 5000, 3).map(drop).expect_err("refused");
            assert!(error.contains(named) && error.lines().count() == 1, "{error}");
        };
        refused("something else");
        fs::write(folder.log(), line(0)).expect("write");
        fs::write(numbered(&folder.log(), 2), "mine").expect("write");
        refused("a.log.2");
        fs::remove_file(numbered(&folder.log(), 2)).expect("remove");
        fs::create_dir(numbered(&folder.log(), 1)).expect("make a folder");
        refused("a.log.1: is in the way");
        // A number that rotation never reaches is nobody's business.
        assert!(Rotating::open(&folder.log(), 5000, 1).is_ok());
        let missing = Rotating::open(&folder.0.join("none/a.log"), 5000, 3).map(drop).expect_err("refused");
        assert!(missing.contains("none/a.log: cannot be written"), "{missing}");
    }

    #[test]
    fn lines_in_parts_and_lines_longer_than_a_file_stay_whole_and_within_bounds() {
        let folder = Folder::new("parts");
        let mut log = Rotating::open(&folder.log(), 5000, 3).expect("open");
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
        let folder = Folder::new("threads");
        let log = Mutex::new(Rotating::open(&folder.log(), 20_000, 20).expect("open"));
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

    /// A file on a disk with so much room.
    struct Disk {
        file: File,
        room: Arc<AtomicU64>,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let room = self.room.load(Ordering::Relaxed).min(bytes.len() as u64);
            if room == 0 {
                return Err(io::Error::from(ErrorKind::StorageFull));
            }
            self.room.fetch_sub(room, Ordering::Relaxed);
            self.file.write(&bytes[..room as usize])
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Sink for Disk {
        fn cut(&self, bytes: u64) -> io::Result<()> {
            self.file.set_len(bytes)
        }
    }

    #[test]
    fn a_full_disk_leaves_no_half_line_and_is_told_once_there_is_room() {
        let folder = Folder::new("full");
        let room = Arc::new(AtomicU64::new(2 * line(0).len() as u64 + 30));
        let theirs = room.clone();
        let opener = move |path: &Path| -> io::Result<Box<dyn Sink>> {
            let file = OpenOptions::new().create(true).append(true).open(path)?;
            Ok(Box::new(Disk { file, room: theirs.clone() }))
        };
        let mut log = Rotating::with(&folder.log(), 5000, 20, Box::new(opener)).expect("open");
        for n in 0..9 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        assert_eq!(folder.text(0), format!("{}{}", line(0), line(1)));
        room.store(1 << 20, Ordering::Relaxed);
        for n in 9..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        let all = folder.texts().concat();
        let lines: Vec<&str> = all.lines().collect();
        assert!(lines[2].ends_with("WARN 7 lines of the log could not be written"), "{}", lines[2]);
        assert_eq!((lines.len(), format!("{}\n", lines[3]), format!("{}\n", lines[193])), (194, line(9), line(199)));
    }

    #[test]
    fn a_folder_that_is_gone_costs_lines_and_no_more() {
        let folder = Folder::new("gone");
        let mut log = Rotating::open(&folder.log(), 4096, 3).expect("open");
        for n in 0..40 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        fs::remove_dir_all(&folder.0).expect("remove the folder");
        // Some go into a file without a name, until it is full.
        for n in 0..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        fs::create_dir_all(&folder.0).expect("make it again");
        log.write_all(line(0).as_bytes()).expect("never fails");
        log.write_all(line(1).as_bytes()).expect("never fails");
        let text = folder.text(0);
        assert!(text.lines().count() == 3 && text.contains("lines of the log could not be written"), "{text}");
    }

    #[test]
    fn what_cannot_be_moved_is_not_destroyed() {
        let folder = Folder::new("stuck");
        let mut log = Rotating::open(&folder.log(), 4096, 2).expect("open");
        fs::create_dir(numbered(&folder.log(), 1)).expect("something is in the way");
        for n in 0..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        assert!(folder.text(0).starts_with(&line(0)) && folder.text(0).len() <= 4096);
        fs::remove_dir(numbered(&folder.log(), 1)).expect("out of the way");
        log.write_all(line(200).as_bytes()).expect("never fails");
        assert!(folder.text(1).starts_with(&line(0)) && folder.text(0).contains("lines of the log could not be"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_that_is_always_full_stops_nobody_and_is_not_renamed() {
        let full = Path::new("/dev/full");
        let mut log = Rotating::open(full, 4096, 5).expect("open");
        for n in 0..200 {
            log.write_all(line(n).as_bytes()).expect("never fails");
        }
        assert_eq!(log.lost, 200);
        assert!(full.exists() && !numbered(full, 1).exists());
    }
}
