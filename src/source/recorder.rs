//! The `.frames` file: frames as they arrived, with their times, bit for bit. If writing is interrupted, every frame but the last is
//! preserved. All numbers are little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `ECHOFRMS` |
//! | 4 | version, 1 |
//! | 4 | length n of what follows, at most 16 MiB |
//! | n | JSON of [`Header`]: geometry of forward and backward sweeps, stored type, stored values shown as 0 and 1 |
//! | 4 | CRC-32 (ISO-HDLC, zlib's) of everything so far |
//! | ... | frames, each `FRAM`, volume, number, slice, flags (bit 0 backward, bit 1 stamped, bit 2 of the phantom), length m (six words of 4 in all), time stamp and time of arrival in s (two f64), a pose if the header says `posed`, m bytes of samples, CRC-32 of all preceding bytes of the frame |
//! | ... | at a clean end: `INDX`, count (4), for each frame its offset (8) and volume (4), CRC-32 of the index, offset of `INDX` (8), `XEND` |
//!
//! A pose is the upper three rows of a 4 x 4 matrix, row by row (12 f64; NaN for none): from the space of the geometry, mm, to the world or the
//! space of a tracker. Files without poses are the same as before there were any; a program of that time refuses the others by their header.
//!
//! If the index is missing or damaged, all frames are read once. A frame with a wrong checksum is left out and counted. Frames after a
//! gap of 1 GiB without a valid one are lost.

pub use super::frame::Header;

use super::describe::{Rows, number};
use super::frame::{POSE_BYTES, Source, read_pose, stored_pose};
use super::piped_record::CRC;
use crate::files::progress::CountedFile;
use crate::files::{InputError, private, progress};
use crate::frame::check_volume;
use crate::probe::{Geometry, World};
use crate::tree;
use crate::{Frame, SampleType, StoredType};
use glam::{DAffine3, DQuat};
use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"ECHOFRMS";
const VERSION: u32 = 1;
const FRAME: &[u8; 4] = b"FRAM";
const INDEX: &[u8; 4] = b"INDX";
const END: &[u8; 4] = b"XEND";
/// Length of a frame before its pose, or else its samples, bytes.
const FRAME_HEAD: usize = 40;
/// Offset of the flags of a frame, bytes.
const FLAGS_AT: u64 = 16;
/// The flags of a frame. Other bits are not read.
const BACKWARD: u32 = 1;
const STAMPED: u32 = 1 << 1;
const SYNTHETIC: u32 = 1 << 2;
/// Longest header, bytes. It may have tables of lines and slices.
const MAX_HEADER_BYTES: u32 = 16 << 20;

/// Writes a `.frames` file. Without [`Writer::finish`] the file has no index, but can still be read.
pub struct Writer {
    path: PathBuf,
    file: File,
    header: Header,
    /// Offset and volume of each frame.
    index: Vec<(u64, u32)>,
    at: u64,
    /// Buffer of a frame, so that it is written by one system call.
    frame: Vec<u8>,
    /// The last write failed. What it left is truncated before the next one.
    torn: bool,
}

impl Writer {
    /// Creates a file, and never overwrites one.
    ///
    /// # Errors
    /// The header is not valid, or the file exists or cannot be created.
    pub fn create(path: &Path, header: Header) -> Result<Writer, InputError> {
        header.check().map_err(|(field, fault)| InputError::new(path, field, fault))?;
        let text = tree::to_json(&header).map_err(|e| InputError::new(path, "header", e.to_string()))?;
        if text.len() > MAX_HEADER_BYTES as usize {
            let why = format!("has {} bytes, at most {MAX_HEADER_BYTES}", text.len());
            return Err(InputError::new(path, "header", why));
        }
        let file = private(OpenOptions::new().write(true).create_new(true))
            .open(path)
            .map_err(|e| InputError::unwritable(path, &e))?;
        let mut start = Vec::with_capacity(text.len() + 20);
        start.extend(MAGIC);
        start.extend(VERSION.to_le_bytes());
        start.extend((text.len() as u32).to_le_bytes());
        start.extend(text.as_bytes());
        start.extend(CRC.checksum(&start).to_le_bytes());
        let mut writer =
            Writer { path: path.into(), file, header, index: Vec::new(), at: 0, frame: start, torn: false };
        if let Err(e) = writer.append() {
            writer.discard();
            return Err(e);
        }
        Ok(writer)
    }

    /// Appends a frame that arrived at `arrived` s on the recorder's clock. When this returns, the operating system has the frame, and earlier
    /// volumes are on the disk.
    ///
    /// # Errors
    /// The size or the slice of the frame does not fit the header, its volume is before that of the last frame, or the file cannot be written.
    /// Earlier frames are kept, and the next call may succeed.
    pub fn frame(&mut self, frame: &Frame, arrived: f64) -> Result<(), InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(&self.path, field, fault));
        let expected = self.header.frame_bytes().unwrap_or(0);
        if frame.bytes.len() as u64 != expected {
            return fault("frame", format!("has {} bytes, {expected} are expected", frame.bytes.len()));
        }
        let slices = self.header.forward.slices();
        if frame.slice >= slices {
            return fault("slice", format!("is {}, there are {slices}, numbered from 0", frame.slice));
        }
        if self.index.last().is_some_and(|(_, volume)| frame.volume < *volume) {
            return fault("volume", format!("is {}, after a later one", frame.volume));
        }
        let flag = |is: bool, flag: u32| if is { flag } else { 0 };
        let flags = flag(frame.backward, BACKWARD)
            | flag(frame.time.is_some(), STAMPED)
            | flag(self.header.synthetic, SYNTHETIC);
        self.frame.clear();
        self.frame.extend(FRAME);
        for word in [frame.volume, frame.number, frame.slice as u32, flags, frame.bytes.len() as u32] {
            self.frame.extend(word.to_le_bytes());
        }
        for time in [frame.time.unwrap_or(0.0), arrived] {
            self.frame.extend(time.to_le_bytes());
        }
        if self.header.posed {
            self.frame.extend(stored_pose(frame.pose.as_ref()));
        }
        assert_eq!(self.frame.len(), head_bytes(&self.header));
        self.frame.extend(&frame.bytes);
        self.frame.extend(CRC.checksum(&self.frame).to_le_bytes());
        let offset = self.at;
        self.append()?;
        let begins = self.index.last().is_some_and(|(_, volume)| *volume != frame.volume);
        self.index.push((offset, frame.volume));
        // Synchronised once a volume: a written frame survives the end of this process, and a power cut costs one volume at most.
        let synchronised = if begins { self.file.sync_data() } else { Ok(()) };
        synchronised.map_err(|e| InputError::unwritable(&self.path, &e))
    }

    /// Deletes the file.
    pub fn discard(self) {
        // If it cannot be removed, nothing else can be done.
        let _ = std::fs::remove_file(&self.path);
    }

    /// Number of frames written so far.
    pub fn frames(&self) -> usize {
        self.index.len()
    }

    /// Writes the index and flushes the file to the disk.
    ///
    /// # Errors
    /// The file cannot be written. It may then have no index.
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

    /// Appends the buffer to the complete frames.
    fn append(&mut self) -> Result<(), InputError> {
        let unwritten = |e| InputError::unwritable(&self.path, &e);
        if std::mem::replace(&mut self.torn, true) {
            self.file.set_len(self.at).map_err(unwritten)?;
            self.file.seek(SeekFrom::Start(self.at)).map_err(unwritten)?;
        }
        self.file.write_all(&self.frame).map_err(unwritten)?;
        self.torn = false;
        self.at += self.frame.len() as u64;
        Ok(())
    }
}

/// Length of the index after its entries, bytes: checksum, offset, end mark.
const TAIL: u64 = 16;
/// Length of an entry, bytes.
const ENTRY: u64 = 12;
/// Most entries of an index that is used: a sparse file could claim any number. A longer one is rebuilt.
const MAX_ENTRIES: u64 = 1 << 24;
/// After so many bytes without a valid frame, the search ends.
const MAX_GAP: u64 = 1 << 30;

/// Reads a `.frames` file frame by frame.
pub struct Reader {
    path: PathBuf,
    file: CountedFile,
    header: Header,
    /// Offset and volume of each valid frame.
    index: Vec<(u64, u32)>,
    /// First frame of each volume, in order.
    volumes: Vec<usize>,
    next: usize,
    arrived: f64,
    /// Offsets of frames that were left out.
    damaged: BTreeSet<u64>,
    lost: u64,
    rebuilt: bool,
}

impl Reader {
    /// True if a file that begins with these bytes is a `.frames` file.
    pub fn is_one(start: &[u8]) -> bool {
        start.starts_with(MAGIC)
    }

    /// Opens a file. If its index is missing or damaged, all frames are read once.
    ///
    /// # Errors
    /// A file that cannot be read, has another format or version, or has a damaged header.
    pub fn open(path: &Path) -> Result<Reader, InputError> {
        let unreadable = |e: std::io::Error| InputError::unreadable(path, &e);
        let fault = |field: &str, fault: String| InputError::new(path, field, fault);
        let mut file = CountedFile::open(path).map_err(unreadable)?;
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
        if size > MAX_HEADER_BYTES || u64::from(size) + 20 > length {
            let why = format!("claims {size} bytes; the file has {length}, a header at most {MAX_HEADER_BYTES}");
            return Err(fault("header", why));
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
        let header: Header = tree::from_json(text).map_err(|e| fault("header", e.to_string()))?;
        header.check().map_err(|(field, wrong)| fault(field, wrong))?;
        let mut replay = Reader {
            path: path.into(),
            file,
            header,
            index: Vec::new(),
            volumes: Vec::new(),
            next: 0,
            arrived: 0.0,
            damaged: BTreeSet::new(),
            lost: 0,
            rebuilt: false,
        };
        let first = u64::from(size) + 20;
        match replay.stored_index(first, length) {
            Some(index) => replay.index = index,
            None => replay.rebuild(first, length).map_err(unreadable)?,
        }
        let volume = |n: usize| replay.index[n].1;
        replay.volumes = (0..replay.index.len()).filter(|n| *n == 0 || volume(*n) != volume(*n - 1)).collect();
        // All frames say the same of this.
        replay.header.synthetic = !replay.index.is_empty() && replay.flags(0) & SYNTHETIC != 0;
        Ok(replay)
    }

    /// The properties that all frames have in common.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Number of frames that the index lists. If the index is the stored one, damaged frames among them are noticed only when they are read.
    pub fn frames(&self) -> usize {
        self.index.len()
    }

    /// Number of frames that were left out so far because of a wrong checksum or field. One that is left out again counts once.
    pub fn damaged(&self) -> u64 {
        self.damaged.len() as u64
    }

    /// Number of bytes at the end of the file that were not read as frames when the index was rebuilt. 0 if the stored index is used.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// True if the index was missing or damaged and was rebuilt.
    pub fn rebuilt(&self) -> bool {
        self.rebuilt
    }

    /// Time of arrival of the last frame that was returned, s on the recorder's clock; 0 before the first.
    pub fn arrived(&self) -> f64 {
        self.arrived
    }

    fn record_bytes(&self) -> u64 {
        head_bytes(&self.header) as u64 + self.header.frame_bytes().unwrap_or(0) + 4
    }

    /// The index at the end of the file, if it is valid.
    fn stored_index(&mut self, first: u64, length: u64) -> Option<Vec<(u64, u32)>> {
        let mut tail = [0; TAIL as usize];
        self.file.seek(SeekFrom::Start(length.checked_sub(TAIL)?)).ok()?;
        self.file.read_exact(&mut tail).ok()?;
        let at = u64::from_le_bytes(tail[4..12].try_into().ok()?);
        if tail[12..] != *END || at < first || at > length - TAIL || length - TAIL - at > 8 + ENTRY * MAX_ENTRIES {
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
        let entry = |e: &[u8]| Some((u64::from_le_bytes(*e.first_chunk()?), u32::from_le_bytes(*e.last_chunk()?)));
        let entries = index[8..].chunks_exact(ENTRY as usize).map(entry).collect::<Option<Vec<_>>>()?;
        let record = self.record_bytes();
        let fits = entries.iter().all(|(offset, _)| *offset >= first && offset.saturating_add(record) <= at);
        let rises = entries.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 <= w[1].1);
        (fits && rises).then_some(entries)
    }

    /// Rebuilds the index from the frames. All have the same length, so a damaged one does not hide those after it.
    fn rebuild(&mut self, first: u64, length: u64) -> std::io::Result<()> {
        self.rebuilt = true;
        progress::expect_bytes(length.saturating_sub(first));
        let record = self.record_bytes();
        // A header may claim frames that are larger than the file.
        let mut bytes = vec![0; if first + record <= length { record as usize } else { 0 }];
        let (mut at, mut empty_from) = (first, first);
        self.file.seek(SeekFrom::Start(at))?;
        while at + record <= length {
            self.file.read_exact(&mut bytes)?;
            // The index of a file that was cut short after it.
            if bytes.starts_with(INDEX) {
                break;
            }
            match parsed(&bytes, self.header.posed) {
                Some((frame, _)) if self.index.last().is_none_or(|(_, volume)| frame.volume >= *volume) => {
                    self.index.push((at, frame.volume));
                    empty_from = at + record;
                }
                _ => _ = self.damaged.insert(at),
            }
            at += record;
            if at - empty_from > MAX_GAP.max(4 * record) {
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
        Ok(parsed(&bytes, self.header.posed).filter(|(frame, _)| frame.slice < slices))
    }
}

/// Length of a frame before its samples, bytes.
fn head_bytes(header: &Header) -> usize {
    FRAME_HEAD + if header.posed { POSE_BYTES } else { 0 }
}

/// Parses a frame and its time of arrival; None if its checksum or a field is wrong.
fn parsed(record: &[u8], posed: bool) -> Option<(Frame, f64)> {
    let (body, sum) = record.split_at_checked(record.len().checked_sub(4)?)?;
    let word = |n: usize| body.get(4 * n..4 * n + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let time = |at: usize| body.get(at..at + 8)?.try_into().ok().map(f64::from_le_bytes);
    if !body.starts_with(FRAME) || CRC.checksum(body).to_le_bytes() != sum {
        return None;
    }
    let (pose, samples) = match (posed, body.get(FRAME_HEAD..)?) {
        (false, samples) => (None, samples),
        (true, rest) => rest.split_first_chunk().map(|(pose, samples)| (read_pose(pose), samples))?,
    };
    if word(5)? as usize != samples.len() {
        return None;
    }
    let flags = word(4)?;
    let frame = Frame {
        volume: word(1)?,
        number: word(2)?,
        slice: word(3)? as usize,
        backward: flags & BACKWARD != 0,
        time: if flags & STAMPED != 0 { Some(time(24)?) } else { None },
        pose,
        bytes: samples.to_vec(),
    };
    Some((frame, time(32)?))
}

impl Source for Reader {
    fn geometry(&self, volume: usize) -> Geometry {
        // The direction is that of the first frame, read without moving the position.
        let backward = self.volumes.get(volume).is_some_and(|n| self.flags(*n) & BACKWARD != 0);
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
        check_volume(&self.path, volume, self.volumes.len())?;
        self.next = self.volumes[volume];
        Ok(())
    }

    fn number_of(&self, volume: usize) -> Option<u32> {
        self.volumes.get(volume).map(|first| self.index[*first].1)
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
                None => _ = self.damaged.insert(self.index[n].0),
            }
        }
        Ok(None)
    }

    fn header(&self) -> Header {
        self.header.clone()
    }

    fn is_synthetic(&self) -> bool {
        self.header.synthetic
    }

    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn arrival(&self) -> Option<f64> {
        Some(self.arrived)
    }

    fn world(&self) -> Option<World> {
        self.world_within(0..self.index.len())
    }

    fn world_of(&self, volume: usize) -> Option<World> {
        let first = self.volumes.get(volume).copied().unwrap_or(self.index.len());
        let end = self.volumes.get(volume + 1).copied().unwrap_or(self.index.len());
        self.world_within(first..end).or_else(|| self.world())
    }

    /// Each frame states its pose, or that it has none.
    fn pose(&self) -> Option<DAffine3> {
        None
    }
}

impl Reader {
    /// The flags of a frame, read without moving the position; none if it cannot be read.
    fn flags(&self, n: usize) -> u32 {
        let mut flags = [0; 4];
        let read = File::open(&self.path).and_then(|mut file| {
            file.seek(SeekFrom::Start(self.index[n].0 + FLAGS_AT))?;
            file.read_exact(&mut flags)
        });
        read.map_or(0, |()| u32::from_le_bytes(flags))
    }

    /// Where the first of these frames that has a pose places the lattice.
    fn world_within(&self, frames: Range<usize>) -> Option<World> {
        let Geometry::Cartesian(grid) = &self.header.forward else { return None };
        World::posed(&self.first_pose(frames)?, grid)
    }

    /// The first pose of these frames, read without moving the position.
    fn first_pose(&self, frames: Range<usize>) -> Option<DAffine3> {
        let frames = self.index.get(frames).filter(|_| self.header.posed)?;
        let mut file = File::open(&self.path).ok()?;
        let mut read =
            |at: u64, bytes: &mut [u8]| file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(bytes)).ok();
        for (offset, _) in frames {
            let mut pose = [0; POSE_BYTES];
            read(offset + FRAME_HEAD as u64, &mut pose)?;
            if read_pose(&pose).is_none() {
                continue;
            }
            // A damaged frame is left out, and its pose with it.
            let mut record = vec![0; self.record_bytes() as usize];
            read(*offset, &mut record)?;
            if let Some((Frame { pose: Some(pose), .. }, _)) = parsed(&record, true) {
                return Some(pose);
            }
        }
        None
    }

    /// A description of the file for users: pairs of title and value. Reads all frames once to check them.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn description(mut self) -> Result<Vec<(String, String)>, InputError> {
        let summary = self.summarize()?;
        let mut rows = Vec::new();
        let header = self.header();
        rows.add("format", "frames as they arrived");
        rows.add("samples", SampleType::from(header.stored).to_string());
        let each = header.forward.slices();
        rows.add_frame(matches!(header.forward, Geometry::Sweep(_)), header.forward.frame_size());
        rows.add("frames", summary.frames.to_string());
        let backward =
            if summary.backward > 0 { format!(", {} swept backwards", summary.backward) } else { String::new() };
        rows.add("volumes", format!("{} of {each} frames, {} whole{backward}", summary.volumes, summary.whole));
        rows.add_geometry(&header.forward);
        rows.extend(summary.place());
        rows.add_range(header.range, "");
        if let Some([first, last]) = summary.times {
            rows.add("time stamps", format!("{} .. {} s, {} of them", number(first), number(last), summary.stamped));
        }
        if let Some([first, last]) =
            summary.begins.filter(|[first, last]| last > first && summary.begun == summary.volumes)
        {
            rows.add("volume rate", format!("{} a second", number((summary.volumes - 1) as f64 / (last - first))));
        }
        if let Some([first, last]) = summary.arrivals {
            let rate = match last - first {
                span if span > 0.0 && span.is_finite() => {
                    let (rate, gap) = ((summary.frames - 1) as f64 / span, summary.gap * 1e3);
                    format!("{} frames a second, at most {} ms apart", number(rate), number(gap))
                }
                _ => "all at once".into(),
            };
            rows.add("arrival", format!("{} .. {} s, {rate}", number(first), number(last)));
        }
        rows.add("damaged", format!("{} frames", self.damaged()));
        rows.add("lost", format!("{} bytes at the end", self.lost()));
        rows.add("index", if self.rebuilt() { "missing or wrong; made anew" } else { "as it was written" });
        Ok(rows)
    }

    fn summarize(&mut self) -> Result<Summary, InputError> {
        self.next = 0;
        let mut summary = Summary::default();
        let each = self.frames_per_volume();
        let (mut volume, mut of_volume) = (None, 0);
        while let Some(frame) = self.next_frame()? {
            summary.frames += 1;
            if volume.replace(frame.volume) != Some(frame.volume) {
                of_volume = 0;
                summary.volumes += 1;
                summary.backward += usize::from(frame.backward);
                if let Some(time) = frame.time.filter(|t| t.is_finite()) {
                    summary.begun += 1;
                    widen(&mut summary.begins, time);
                }
            }
            of_volume += 1;
            if let Some(pose) = frame.pose {
                summary.poses += 1;
                summary.moved |= *summary.first_pose.get_or_insert(pose) != pose;
            }
            summary.whole += usize::from(of_volume == each);
            if let Some(time) = frame.time.filter(|t| t.is_finite()) {
                summary.stamped += 1;
                widen(&mut summary.times, time);
            }
            let arrived = self.arrived();
            if arrived.is_finite() {
                if let Some([_, last]) = summary.arrivals {
                    summary.gap = summary.gap.max(arrived - last);
                }
                widen(&mut summary.arrivals, arrived);
            }
        }
        Ok(summary)
    }
}

#[derive(Default)]
struct Summary {
    frames: usize,
    volumes: usize,
    /// Number of complete volumes.
    whole: usize,
    /// Number of volumes swept backwards.
    backward: usize,
    /// Number of volumes whose first frame has a time stamp, and the first and last of these, s.
    begun: usize,
    begins: Option<[f64; 2]>,
    stamped: usize,
    /// First and last, s.
    times: Option<[f64; 2]>,
    arrivals: Option<[f64; 2]>,
    /// Longest time between the arrivals of two frames, s.
    gap: f64,
    /// Frames with a pose, the first of the poses, and whether there is another.
    poses: usize,
    first_pose: Option<DAffine3>,
    moved: bool,
}

impl Summary {
    /// Where the frames are, for users: nothing without poses.
    fn place(&self) -> Option<(String, String)> {
        let pose = self.first_pose?;
        let [x, y, z] = pose.translation.to_array().map(number);
        let (axis, angle) = DQuat::from_mat3(&pose.matrix3).normalize().to_axis_angle();
        let [u, v, w] = axis.to_array().map(number);
        let each = if self.moved { "differ from frame to frame; the first is" } else { "are all" };
        let turn = format!("{} deg about {u}, {v}, {w}", number(angle.to_degrees()));
        Some(("poses".into(), format!("{} frames have one; they {each} {x}, {y}, {z} mm, turned {turn}", self.poses)))
    }
}

fn widen(span: &mut Option<[f64; 2]>, time: f64) {
    let [first, last] = span.unwrap_or([time; 2]);
    *span = Some([first.min(time), last.max(time)]);
}
