//! Frames from a file, as they were.

use super::{CRC, END, FRAME, FRAME_HEAD, Header, INDEX, LONGEST_HEADER, MAGIC, VERSION};
use crate::probe::Geometry;
use crate::source::{Frame, InputError, Source, StoredType};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes of the index behind its entries: its checksum, where it begins, and the end's mark.
const TAIL: u64 = 16;
/// Bytes of an entry.
const ENTRY: u64 = 12;
/// Longest index that is believed, entries: a file with holes in it has room for any. A longer one is made anew.
const MOST_ENTRIES: u64 = 1 << 24;
/// Where there was no frame for so many bytes, none is looked for behind.
const WIDEST_GAP: u64 = 1 << 30;

/// A file of frames that is read.
pub struct Reader {
    path: PathBuf,
    file: File,
    header: Header,
    /// Of each frame that is whole: its offset and its volume.
    index: Vec<(u64, u32)>,
    /// First frame of each volume, in order.
    volumes: Vec<usize>,
    next: usize,
    arrived: f64,
    damaged: u64,
    lost: u64,
    rebuilt: bool,
}

impl Reader {
    /// Whether a file begins as ours do.
    pub fn is_one(start: &[u8]) -> bool {
        start.starts_with(MAGIC)
    }

    /// # Errors
    /// A file that cannot be read, is of another format or version, or whose header is damaged.
    pub fn open(path: &Path) -> Result<Reader, InputError> {
        let unreadable = |e: std::io::Error| InputError::unreadable(path, &e);
        let fault = |field: &str, fault: String| InputError::new(path, field, fault);
        let mut file = File::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        let mut start = [0; 16];
        file.read_exact(&mut start).map_err(|_| fault("header", "the file ends before it".into()))?;
        let word = |at: usize| u32::from_le_bytes([start[at], start[at + 1], start[at + 2], start[at + 3]]);
        if !Reader::is_one(&start) {
            return Err(fault("file", "is no file of frames".into()));
        }
        let (version, size) = (word(8), word(12));
        if version != VERSION {
            return Err(fault("version", format!("is {version}, this program reads {VERSION}")));
        }
        if size > LONGEST_HEADER || u64::from(size) + 20 > length {
            return Err(fault(
                "header",
                format!("claims {size} bytes; the file has {length}, a header at most {LONGEST_HEADER}"),
            ));
        }
        let mut text = vec![0; size as usize + 4];
        file.read_exact(&mut text).map_err(unreadable)?;
        let (text, sum) = text.split_at(size as usize);
        let mut digest = CRC.digest();
        digest.update(&start);
        digest.update(text);
        if digest.finalize().to_le_bytes() != sum {
            return Err(fault("header", "its checksum is wrong".into()));
        }
        let header: Header = serde_json::from_slice(text).map_err(|e| fault("header", e.to_string()))?;
        header.check().map_err(|(field, wrong)| fault(field, wrong))?;
        let mut replay = Reader {
            path: path.into(),
            file,
            header,
            index: Vec::new(),
            volumes: Vec::new(),
            next: 0,
            arrived: 0.0,
            damaged: 0,
            lost: 0,
            rebuilt: false,
        };
        let first = u64::from(size) + 20;
        match replay.stored_index(first, length) {
            Some(index) => replay.index = index,
            None => replay.rebuild(first, length).map_err(unreadable)?,
        }
        let mut before = None;
        for (n, (_, volume)) in replay.index.iter().enumerate() {
            if before.replace(*volume) != Some(*volume) {
                replay.volumes.push(n);
            }
        }
        Ok(replay)
    }

    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Frames that are whole.
    pub fn frames(&self) -> usize {
        self.index.len()
    }

    /// Frames that were left out because their checksum is wrong.
    pub fn damaged(&self) -> u64 {
        self.damaged
    }

    /// Bytes at the end that are no whole frame.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// The index was not there or not right, and was made anew.
    pub fn rebuilt(&self) -> bool {
        self.rebuilt
    }

    /// When the frame that was given last arrived, s on the recorder's clock.
    pub fn arrived(&self) -> f64 {
        self.arrived
    }

    fn record_bytes(&self) -> u64 {
        FRAME_HEAD as u64 + self.header.frame_bytes().unwrap_or(0) + 4
    }

    /// The index at the file's end, if every word of it can be true.
    fn stored_index(&mut self, first: u64, length: u64) -> Option<Vec<(u64, u32)>> {
        let mut tail = [0; TAIL as usize];
        self.file.seek(SeekFrom::Start(length.checked_sub(TAIL)?)).ok()?;
        self.file.read_exact(&mut tail).ok()?;
        let at = u64::from_le_bytes(tail[4..12].try_into().ok()?);
        if tail[12..] != *END || at < first || at > length - TAIL || length - TAIL - at > 8 + ENTRY * MOST_ENTRIES {
            return None;
        }
        let mut index = vec![0; usize::try_from(length - TAIL - at).ok()?];
        self.file.seek(SeekFrom::Start(at)).ok()?;
        self.file.read_exact(&mut index).ok()?;
        if CRC.checksum(&index).to_le_bytes() != tail[..4] || !index.starts_with(INDEX) {
            return None;
        }
        let count = u32::from_le_bytes(index.get(4..8)?.try_into().ok()?);
        if index.len() as u64 != 8 + ENTRY * u64::from(count) {
            return None;
        }
        let entry = |e: &[u8; ENTRY as usize]| {
            let [a, b, c, d, e, f, g, h, i, j, k, l] = *e;
            (u64::from_le_bytes([a, b, c, d, e, f, g, h]), u32::from_le_bytes([i, j, k, l]))
        };
        let entries: Vec<_> = index[8..].as_chunks::<{ ENTRY as usize }>().0.iter().map(entry).collect();
        let record = self.record_bytes();
        let fits = entries.iter().all(|(offset, _)| *offset >= first && offset.saturating_add(record) <= at);
        let rises = entries.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 <= w[1].1);
        (fits && rises).then_some(entries)
    }

    /// Goes through the frames from the first. All have the same length, so one that is damaged hides none behind it.
    fn rebuild(&mut self, first: u64, length: u64) -> std::io::Result<()> {
        self.rebuilt = true;
        let record = self.record_bytes();
        // A header may claim frames that the file has no room for.
        let mut bytes = vec![0; if first + record <= length { record as usize } else { 0 }];
        let (mut at, mut empty_from) = (first, first);
        self.file.seek(SeekFrom::Start(at))?;
        while at + record <= length {
            self.file.read_exact(&mut bytes)?;
            // The index of a file that was cut behind it.
            if bytes.starts_with(INDEX) {
                break;
            }
            match parsed(&bytes) {
                Some((frame, _)) if self.index.last().is_none_or(|(_, volume)| frame.volume >= *volume) => {
                    self.index.push((at, frame.volume));
                    empty_from = at + record;
                }
                _ => self.damaged += 1,
            }
            at += record;
            if at - empty_from > WIDEST_GAP.max(4 * record) {
                break;
            }
        }
        self.lost = length - at;
        Ok(())
    }

    fn read(&mut self, n: usize) -> Result<Option<(Frame, f64)>, InputError> {
        let mut bytes = vec![0; self.record_bytes() as usize];
        let read = self.file.seek(SeekFrom::Start(self.index[n].0)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|e| InputError::unreadable(&self.path, &e))?;
        let slices = self.header.forward.slices();
        Ok(parsed(&bytes).filter(|(frame, _)| frame.slice < slices))
    }
}

/// A frame and when it arrived; none if its checksum or its words are wrong.
fn parsed(record: &[u8]) -> Option<(Frame, f64)> {
    let (body, sum) = record.split_at_checked(record.len().checked_sub(4)?)?;
    let word = |n: usize| body.get(4 * n..4 * n + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let time = |at: usize| body.get(at..at + 8)?.try_into().ok().map(f64::from_le_bytes);
    if !body.starts_with(FRAME) || CRC.checksum(body).to_le_bytes() != sum {
        return None;
    }
    let samples = body.get(FRAME_HEAD..)?;
    if word(5)? as usize != samples.len() {
        return None;
    }
    let flags = word(4)?;
    let frame = Frame {
        volume: word(1)?,
        number: word(2)?,
        slice: word(3)? as usize,
        backward: flags & 1 != 0,
        time: if flags & 2 != 0 { Some(time(24)?) } else { None },
        bytes: samples.to_vec(),
    };
    Some((frame, time(32)?))
}

impl Source for Reader {
    fn geometry(&self, volume: usize) -> Geometry {
        // Which way it was swept, its first frame says; that is looked up without moving on.
        let backward = self.volumes.get(volume).is_some_and(|n| self.backward(*n));
        if backward { self.header.backward.clone() } else { self.header.forward.clone() }
    }

    fn stored_type(&self) -> StoredType {
        self.header.stored
    }

    fn range(&self) -> [f64; 2] {
        self.header.range
    }

    fn volumes(&self) -> usize {
        self.volumes.len()
    }

    fn frames_per_volume(&self) -> usize {
        self.header.forward.slices()
    }

    fn skip_to_volume(&mut self, volume: usize) -> Result<(), InputError> {
        self.next = self.volumes.get(volume).copied().unwrap_or(self.index.len());
        Ok(())
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, InputError> {
        while self.next < self.index.len() {
            let n = self.next;
            self.next += 1;
            match self.read(n)? {
                Some((frame, arrived)) => {
                    self.arrived = arrived;
                    return Ok(Some(frame));
                }
                None => self.damaged += 1,
            }
        }
        Ok(None)
    }

    fn header(&self) -> Header {
        self.header.clone()
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn arrival(&self) -> Option<f64> {
        Some(self.arrived)
    }
}

impl Reader {
    /// Whether a frame was swept backwards; what cannot be read was not.
    fn backward(&self, n: usize) -> bool {
        let mut flags = [0; 4];
        let read = File::open(&self.path).and_then(|mut file| {
            file.seek(SeekFrom::Start(self.index[n].0 + 16))?;
            file.read_exact(&mut flags)
        });
        read.is_ok() && flags[0] & 1 != 0
    }
}
