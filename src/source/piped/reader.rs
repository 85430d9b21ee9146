//! The thread that reads the stream.

use super::header::Stream;
use super::queue::{Queue, weight};
use super::{FRAMES_WAITING, MOST_WAITING, NAME};
use crate::probe::ProbeFile;
use crate::source::live::Event;
use crate::source::samples::{self, Replaced};
use crate::source::{Frame, InputError};
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

/// Longest first line, bytes.
const LONGEST: u64 = 64 << 10;
/// Memory follows what came, in steps of so many bytes, until a whole piece of a frame has come once.
const STEP: usize = 1 << 20;

/// Says that nothing comes any more, however it came to that.
pub(super) struct Finish(pub Arc<Queue>);

impl Drop for Finish {
    fn drop(&mut self) {
        self.0.end(Some(format!("{NAME}: its thread ended")));
    }
}

pub(super) struct Reader<'a, R> {
    input: BufReader<R>,
    queue: &'a Queue,
    replaced: Replaced,
    /// A whole piece has come, so that the next may be allocated at once.
    proven: bool,
}

fn fault(field: &str, fault: impl AsRef<str>) -> InputError {
    InputError::new(Path::new(NAME), field, fault)
}

impl<'a, R: Read> Reader<'a, R> {
    pub fn new(input: R, queue: &'a Queue) -> Reader<'a, R> {
        Reader { input: BufReader::new(input), queue, replaced: Replaced::default(), proven: false }
    }

    /// Until the stream ends, or nobody takes any more.
    ///
    /// # Errors
    /// A first line that is no header, an end within a frame, what the operating system says.
    pub fn run(&mut self, probe: Option<ProbeFile>) -> Result<(), InputError> {
        let stream = Stream::parse(&self.first_line()?, probe)?;
        let begin = Event::Begin(Box::new(stream.header.clone()));
        let pieces = stream.lines.div_ceil(stream.lines_at_once);
        let frame = stream.header.frame_bytes().unwrap_or(0) as usize + pieces * weight(&Event::Idle);
        self.queue.set_room(FRAMES_WAITING.saturating_mul(frame).min(MOST_WAITING));
        let mut index = 0;
        let mut goes_on = Ok(self.queue.push(begin));
        while let Ok(true) = goes_on {
            goes_on = self.frame(&stream, index);
            index += 1;
        }
        let Replaced { not_finite, denormal } = self.replaced;
        if self.replaced != Replaced::default() {
            let what = format!("{NAME}: {not_finite} samples were not finite, {denormal} denormal; they read as 0");
            self.queue.push(Event::Fault(what));
        }
        goes_on.map(|_| ())
    }

    fn first_line(&mut self) -> Result<Vec<u8>, InputError> {
        let mut line = Vec::new();
        let read = Read::take(&mut self.input, LONGEST).read_until(b'\n', &mut line);
        read.map_err(|e| fault("header", format!("cannot be read: {e}")))?;
        match line.pop() {
            Some(b'\n') => Ok(line),
            Some(_) if line.len() as u64 + 1 == LONGEST => {
                Err(fault("header", format!("is longer than {LONGEST} bytes; its line must end before that")))
            }
            _ => Err(fault("header", "the stream ends before its first line does")),
        }
    }

    /// The next frame, in one piece or in several. False: there is none, or nobody takes it.
    fn frame(&mut self, stream: &Stream, index: u64) -> Result<bool, InputError> {
        let whole = stream.header.frame_bytes().unwrap_or(0) as usize;
        let (line, stamp) = (whole / stream.lines, if stream.stamped { size_of::<f64>() } else { 0 });
        let mut came = 0;
        // Nothing at all of a frame is the end of a whole stream.
        let cut = |error: io::Error, came: usize| match error.kind() {
            io::ErrorKind::UnexpectedEof if came == 0 => Ok(false),
            io::ErrorKind::UnexpectedEof => {
                let Frame { volume, number, .. } = stream.frame(index, None);
                let there = format!("{came} of {} bytes of frame {number} of volume {volume} came", whole + stamp);
                Err(fault("samples", format!("cut short, {there} (both numbered from 0)")))
            }
            _ => Err(fault("samples", format!("cannot be read: {error}"))),
        };
        let mut time = None;
        if stream.stamped {
            let mut bytes = Vec::with_capacity(stamp);
            if let Err(error) = self.fill(stamp, &mut bytes, &mut came) {
                return cut(error, came);
            }
            time = bytes.first_chunk().map(|b| f64::from_le_bytes(*b)).filter(|t| t.is_finite());
        }
        let mut first = 0;
        while first < stream.lines {
            let lines = stream.lines_at_once.min(stream.lines - first);
            let mut frame = stream.frame(index, time);
            if let Err(error) = self.fill(lines * line, &mut frame.bytes, &mut came) {
                return cut(error, came);
            }
            let known = self.replaced == Replaced::default();
            self.replaced += samples::store(stream.sample, false, &mut frame.bytes);
            if known && self.replaced != Replaced::default() {
                let Frame { volume, number, .. } = frame;
                let what = "has samples that are not finite or are denormal; from here on they read as 0";
                self.queue.push(Event::Fault(format!("{NAME}: frame {number} of volume {volume} {what}")));
            }
            let event = match lines == stream.lines {
                true => Event::Frame(frame),
                false => Event::Lines { frame, first },
            };
            if !self.queue.push(event) {
                return Ok(false);
            }
            first += lines;
        }
        Ok(true)
    }

    /// Appends so many bytes; `came` counts them also where they are not all there.
    fn fill(&mut self, count: usize, bytes: &mut Vec<u8>, came: &mut usize) -> io::Result<()> {
        if self.proven {
            bytes.reserve_exact(count);
        }
        let mut left = count;
        while left > 0 {
            let step = left.min(STEP);
            let before = bytes.len();
            let read = Read::take(&mut self.input, step as u64).read_to_end(bytes);
            *came += bytes.len() - before;
            read?;
            if bytes.len() - before < step {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            left -= step;
        }
        // A time stamp proves nothing about the samples.
        self.proven |= count > size_of::<f64>();
        Ok(())
    }
}
