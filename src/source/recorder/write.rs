//! Frames to a file, one after the other.

use super::{CRC, END, FRAME, FRAME_HEAD, Header, INDEX, LONGEST_HEADER, MAGIC, VERSION};
use crate::source::{Frame, InputError};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// A recording that is being made. Dropped without [`Writer::finish`] it has no index and is read all the same.
pub struct Writer {
    path: PathBuf,
    file: File,
    header: Header,
    /// Of each frame: its offset and its volume.
    index: Vec<(u64, u32)>,
    at: u64,
    /// A frame in one piece, so that one call to the system writes it.
    frame: Vec<u8>,
    /// The last write failed: what it left behind is cut off before the next.
    torn: bool,
}

impl Writer {
    /// Begins a file. One that is there already is not written over.
    ///
    /// # Errors
    /// A header that cannot be right, a file that is there or cannot be made.
    pub fn create(path: &Path, header: Header) -> Result<Writer, InputError> {
        header.check().map_err(|(field, fault)| InputError::new(path, field, fault))?;
        let text = serde_json::to_vec(&header).map_err(|e| InputError::new(path, "header", e.to_string()))?;
        if text.len() > LONGEST_HEADER as usize {
            return Err(InputError::new(path, "header", format!("has {} bytes, at most {LONGEST_HEADER}", text.len())));
        }
        let file =
            OpenOptions::new().write(true).create_new(true).open(path).map_err(|e| InputError::unwritable(path, &e))?;
        let mut start = Vec::with_capacity(text.len() + 20);
        start.extend(MAGIC);
        start.extend(VERSION.to_le_bytes());
        start.extend((text.len() as u32).to_le_bytes());
        start.extend(text);
        start.extend(CRC.checksum(&start).to_le_bytes());
        let mut writer =
            Writer { path: path.into(), file, header, index: Vec::new(), at: 0, frame: start, torn: false };
        match writer.append() {
            Ok(()) => Ok(writer),
            Err(e) => {
                writer.discard();
                Err(e)
            }
        }
    }

    /// Appends a frame that arrived at `arrived` s, on the recorder's own clock. It is with the system when this returns; a volume that is
    /// whole is on the disk.
    ///
    /// # Errors
    /// A frame of another size or place than the header's, a disk that is full. The frames before it stay, and the next one may succeed.
    pub fn frame(&mut self, frame: &Frame, arrived: f64) -> Result<(), InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(&self.path, field, fault));
        let expected = self.header.frame_bytes().unwrap_or(0);
        if frame.bytes.len() as u64 != expected {
            return fault("frame", format!("has {} bytes, {expected} are expected", frame.bytes.len()));
        }
        if frame.slice >= self.header.forward.slices() {
            let slices = self.header.forward.slices();
            return fault("slice", format!("is {}, there are {slices}, numbered from 0", frame.slice));
        }
        if self.index.last().is_some_and(|(_, volume)| frame.volume < *volume) {
            return fault("volume", format!("is {}, after a later one", frame.volume));
        }
        let flags = u32::from(frame.backward) | u32::from(frame.time.is_some()) << 1;
        self.frame.clear();
        self.frame.extend(FRAME);
        for word in [frame.volume, frame.number, frame.slice as u32, flags, frame.bytes.len() as u32] {
            self.frame.extend(word.to_le_bytes());
        }
        for time in [frame.time.unwrap_or(0.0), arrived] {
            self.frame.extend(time.to_le_bytes());
        }
        debug_assert_eq!(self.frame.len(), FRAME_HEAD);
        self.frame.extend(&frame.bytes);
        self.frame.extend(CRC.checksum(&self.frame).to_le_bytes());
        let offset = self.at;
        self.append()?;
        let begins = self.index.last().is_some_and(|(_, volume)| *volume != frame.volume);
        self.index.push((offset, frame.volume));
        // Once a volume: a frame in the system's hands outlives this process, and a power cut costs a volume at most.
        match begins {
            true => self.file.sync_data().map_err(|e| InputError::unwritable(&self.path, &e)),
            false => Ok(()),
        }
    }

    /// Takes it back: what is there is not to be taken for all of it.
    pub fn discard(self) {
        // Nothing more can be done about a file that will not go.
        let _ = std::fs::remove_file(&self.path);
    }

    /// Frames so far.
    pub fn frames(&self) -> usize {
        self.index.len()
    }

    /// Ends the file with its index, all of it on the disk.
    ///
    /// # Errors
    /// A disk that is full; the file is then one without an index.
    pub fn finish(mut self) -> Result<(), InputError> {
        let offset = self.at;
        self.frame.clear();
        self.frame.extend(INDEX);
        self.frame.extend((self.index.len() as u32).to_le_bytes());
        for (offset, volume) in &self.index {
            self.frame.extend(offset.to_le_bytes());
            self.frame.extend(volume.to_le_bytes());
        }
        self.frame.extend(CRC.checksum(&self.frame).to_le_bytes());
        self.frame.extend(offset.to_le_bytes());
        self.frame.extend(END);
        self.append()?;
        self.file.sync_all().map_err(|e| InputError::unwritable(&self.path, &e))
    }

    /// Writes what is in hand at the end of what is whole.
    fn append(&mut self) -> Result<(), InputError> {
        let unwritten = |e| InputError::unwritable(&self.path, &e);
        if std::mem::replace(&mut self.torn, true) {
            use std::io::Seek;
            self.file.set_len(self.at).map_err(unwritten)?;
            self.file.seek(std::io::SeekFrom::Start(self.at)).map_err(unwritten)?;
        }
        self.file.write_all(&self.frame).map_err(unwritten)?;
        self.torn = false;
        self.at += self.frame.len() as u64;
        Ok(())
    }
}
