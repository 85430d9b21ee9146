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
mod tests;
