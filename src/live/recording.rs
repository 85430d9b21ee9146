//! What arrives, written to files of frames: a file for each geometry.

use crate::source::Frame;
use crate::source::live::Event;
use crate::source::recorder::{Header, Writer};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The file that everything is written to.
pub struct RecordingTap {
    path: PathBuf,
    files: u32,
    writer: Option<Writer>,
    header: Option<Header>,
    /// A frame whose lines are arriving.
    lines: Option<Frame>,
    /// The last frame could not be written.
    pub failing: bool,
}

impl RecordingTap {
    pub fn new(path: &Path) -> RecordingTap {
        RecordingTap { path: path.into(), files: 0, writer: None, header: None, lines: None, failing: false }
    }

    /// Writes what is a frame, or makes one whole.
    ///
    /// # Errors
    /// A file that cannot be made, a frame that cannot be written; the next one may be.
    pub fn write(&mut self, event: &Event, at: Instant) -> Result<(), String> {
        // Of a recording only the differences count: any clock that runs evenly does.
        static BEGAN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        let seconds = at.saturating_duration_since(*BEGAN.get_or_init(|| at)).as_secs_f64();
        match event {
            Event::Begin(header) if self.header.as_ref() != Some(header) => {
                self.finish_one()?;
                self.lines = None;
                let path = self.free_name();
                self.writer = Some(Writer::create(&path, (**header).clone()).map_err(|e| e.to_string())?);
                self.header = Some((**header).clone());
                Ok(())
            }
            Event::Frame(frame) => self.frame(frame, seconds),
            Event::Lines { frame, first } => {
                match &mut self.lines {
                    Some(there) if follows(there, frame, *first, self.header.as_ref()) => {
                        there.bytes.extend(&frame.bytes);
                    }
                    lines => *lines = Some(frame.clone()),
                }
                let whole = self.header.as_ref().and_then(Header::frame_bytes);
                match self.lines.take_if(|l| Some(l.bytes.len() as u64) == whole) {
                    Some(frame) => self.frame(&frame, seconds),
                    None => Ok(()),
                }
            }
            _ => Ok(()),
        }
    }

    /// The name that was given, or with the next number that is free: an exam is never written over.
    fn free_name(&mut self) -> PathBuf {
        loop {
            self.files += 1;
            let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
            let path = match self.files {
                1 => return self.path.clone(),
                n => self.path.with_file_name(format!("{stem}-{n}.frames")),
            };
            if !path.exists() {
                return path;
            }
        }
    }

    fn frame(&mut self, frame: &Frame, at: f64) -> Result<(), String> {
        self.writer.as_mut().map_or(Ok(()), |w| w.frame(frame, at)).map_err(|e| e.to_string())
    }

    fn finish_one(&mut self) -> Result<(), String> {
        self.writer.take().map_or(Ok(()), Writer::finish).map_err(|e| e.to_string())
    }

    /// Ends the file that is being written with its index.
    pub fn finish(mut self) -> Result<(), String> {
        self.finish_one()
    }
}

/// Whether lines from `first` on go on where those that are there end.
fn follows(there: &Frame, frame: &Frame, first: usize, header: Option<&Header>) -> bool {
    let line = header.map_or(0, |h| h.forward.frame_size()[0] * h.stored.bytes());
    first > 0 && there.bytes.len() == first * line && (there.volume, there.slice) == (frame.volume, frame.slice)
}
