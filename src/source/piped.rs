//! Raw frames from a pipe, such as the standard output of an acquisition program.
//!
//! The stream begins with one line of JSON, at most 64 KiB up to its end of line:
//!
//! | key | meaning |
//! |---|---|
//! | `echolume` | 1, 2 or 3, the version of this format; 2 has `posed`, 3 has it too, and markers and checksums |
//! | `samples`, `lines`, `frames` | samples a line, lines a frame, frames a volume; each 1 to 65536 |
//! | `type` | `"u8"`, `"u16"` or `"f32"`, little-endian |
//! | `range` | the two values that are shown as 0 and 1; otherwise `samples.range` of the probe, otherwise all of an integer type. f32 needs one |
//! | `both_ways` | every second volume is swept backwards; otherwise that of the probe |
//! | `speed_ratio` | fraction of the distance to the next frame that the motor travels during one, 0..=1; otherwise that of the probe |
//! | `stamped` | `true`: each frame is preceded by its time stamp, an f64 in s, 0 to 1e10, at most 60 s before that of the last frame and a day behind it. NaN means none. Another value ends the stream: bytes were lost or added |
//! | `posed` | `true`: each frame is preceded by its pose, after its time stamp: 12 f64, the upper three rows of a 4 x 4 matrix, row by row. It takes mm in the space of the probe or the lattice to those of a tracker or the world (LPS), and must be rigid. NaN means none. Frames of a lattice of one slice become a freehand volume |
//! | `lines_at_once` | frames are passed on in parts of so many lines. Not in version 3, whose checksums are of whole frames |
//! | `probe` | the tables of a probe file as objects: `{"array": {"kind": "curved", ...}, ...}`. A probe file given by the user takes precedence |
//! | `cartesian` | instead of a probe: `{"size": [x, y, z], "spacing": [x, y, z], "origin": [x, y, z]}`, mm; `samples`, `lines` and `frames` may then be left out |
//!
//! The frames follow in order of acquisition, line by line (samples fastest), with nothing between them but their time stamps and poses. The
//! stream may end after any frame. `tools/pipe_frames.py` writes such a stream.
//!
//! In version 3 each frame is: the 8 bytes `89 45 43 48 4f 46 52 0a`, its number from 0 (u64), its time stamp and its pose if the first line says so, its samples,
//! and the CRC-32 (ISO-HDLC, zlib's) of all of this but the marker (u32), little-endian. A frame that is damaged is left out up to the next marker, and a line says so;
//! the frames after it keep their places by their numbers. Frames whose number is not above that of the last one are left out, too.

use super::frame::{Header, POSE_BYTES, read_pose};
use super::freehand::CompoundingOptions;
use super::live::{Event, Live};
use super::piped_record::{self, OVERHEAD, Stamps};
use super::samples::{self, Replaced};
use crate::files::InputError;
use crate::probe::{Geometry, Grid, ProbeFile, Volumes};
use crate::sync::locked;
use crate::tree::{FromNode, Node};
use crate::{Frame, SampleType};
use glam::DAffine3;
use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Name of the stream in messages.
const NAME: &str = "pipe";
/// Most memory of the queued frames, bytes. A single larger one is still queued.
const MAX_WAITING_BYTES: usize = 256 << 20;
/// Most queued frames.
const MAX_WAITING_FRAMES: usize = 4;

/// A stream of frames, such as from standard input, as a live source.
///
/// Memory: up to four queued frames of at most 256 MiB in total (or a single one), and the one that is being read, of at most 1 GiB (2 GiB in version
/// 3 of the format). Before the first complete frame, no more than twice the bytes that arrived.
pub struct Piped {
    queue: Arc<Queue>,
    compounding: CompoundingOptions,
}

impl Piped {
    /// Starts to read the stream on a thread. `probe`: path of the probe file to use instead of the probe in the stream.
    ///
    /// # Errors
    /// The probe file is not valid, or the thread cannot be started. Errors of the stream are reported as [`Event::End`].
    pub fn new(reader: impl Read + Send + 'static, probe: Option<&Path>) -> Result<Piped, InputError> {
        let probe = probe.map(ProbeFile::read).transpose()?;
        let queue = Arc::new(Queue::new());
        let theirs = EndOnExit(queue.clone());
        let started = thread::Builder::new().name(NAME.into()).spawn(move || {
            let end = Reader::new(reader, &theirs.0).run(probe);
            theirs.0.end(end.err().map(|error| error.to_string()));
        });
        started.map_err(|e| InputError::unreadable(Path::new(NAME), &e))?;
        let compounding = CompoundingOptions { margin: MARGIN, ..CompoundingOptions::default() };
        Ok(Piped { queue, compounding })
    }

    /// Sets the options for compounding pictures that have poses.
    pub fn compounded(mut self, compounding: CompoundingOptions) -> Piped {
        self.compounding = compounding;
        self
    }
}

impl Live for Piped {
    fn next(&mut self, patience: Duration) -> Event {
        self.queue.next(patience)
    }

    fn can_wait(&self) -> bool {
        true
    }

    fn compounding(&self) -> Option<CompoundingOptions> {
        Some(self.compounding.clone())
    }
}

impl Drop for Piped {
    /// Does not wait for the thread, which may be blocked in a read: it ends with the next byte, or with the stream.
    fn drop(&mut self) {
        self.queue.close();
    }
}

/// Most samples, lines and frames.
const MAX_EXTENT: usize = 1 << 16;
/// The versions that are read. The second one has `posed`, the third checksums.
const VERSIONS: [u64; 3] = [1, 2, 3];
/// Margin of a freehand volume around its first pictures, mm: more come.
const MARGIN: f64 = 20.0;

#[derive(FromNode)]
#[tree(deny_unknown_fields)]
struct Keys {
    #[tree(rename = "echolume")]
    version: u64,
    samples: Option<usize>,
    lines: Option<usize>,
    frames: Option<usize>,
    #[tree(rename = "type")]
    sample: Sample,
    range: Option<[f64; 2]>,
    both_ways: Option<bool>,
    speed_ratio: Option<f64>,
    #[tree(default)]
    stamped: bool,
    #[tree(default)]
    posed: bool,
    lines_at_once: Option<usize>,
    probe: Option<Node>,
    cartesian: Option<Lattice>,
}

#[derive(Clone, Copy, FromNode)]
#[tree(rename_all = "lowercase")]
enum Sample {
    U8,
    U16,
    F32,
}

#[derive(FromNode)]
#[tree(deny_unknown_fields)]
struct Lattice {
    size: [usize; 3],
    spacing: [f64; 3],
    #[tree(default)]
    origin: [f64; 3],
}

/// The header of a stream, its first line: the properties of its frames.
pub(super) struct StreamHeader {
    pub header: Header,
    pub sample: SampleType,
    pub stamped: bool,
    /// True if each frame has a marker, a number and a checksum (version 3).
    pub checked: bool,
    lines: usize,
    /// Equal to `lines` if frames are passed on as a whole.
    lines_at_once: usize,
    pub volumes: Volumes,
}

/// The time stamp, pose and samples of a frame in a stream.
pub(super) struct Parts<'a> {
    pub time: Option<f64>,
    /// None: the frame states that it has no pose, or frames have none; Some(None): what it states is not a valid pose.
    pub pose: Option<Option<DAffine3>>,
    pub samples: &'a [u8],
}

fn fault<T>(key: &str, fault: impl AsRef<str>) -> Result<T, InputError> {
    Err(stream_error(key, fault))
}

impl StreamHeader {
    /// Parses the first line of a stream. `probe`: the probe file to use instead of the probe in the stream.
    ///
    /// # Errors
    /// The line is not a header, or its frames are too large, without a geometry, or without a range of values. Nothing is allocated for them.
    pub fn parse(line: &[u8], probe: Option<ProbeFile>) -> Result<StreamHeader, InputError> {
        let mut node = Node::parse_json(line).map_err(|e| {
            stream_error("header", format!("is no line of JSON ({e}); a stream begins as that of tools/pipe_frames.py"))
        })?;
        // Checked before the keys: another version may have other keys.
        match node.at("echolume").map(|version| version.as_u64()) {
            Some(Some(version)) if VERSIONS.contains(&version) => {}
            Some(_) => return fault("echolume", "must be 1, 2 or 3, the versions that this program reads"),
            None => return fault("header", "has no key \"echolume\": this is no stream of frames"),
        }
        let keys = Keys::from_node(node).map_err(|e| stream_error("header", e.to_string()))?;
        if keys.posed && keys.version < 2 {
            return fault("posed", "needs version 2: \"echolume\": 2");
        }
        let (size, posed) = (keys.size()?, keys.posed);
        let sample = match keys.sample {
            Sample::U8 => SampleType::U8,
            Sample::U16 => SampleType::U16,
            Sample::F32 => SampleType::F32,
        };
        let (forward, backward, volumes, range) = match keys.cartesian {
            Some(_) if keys.probe.is_some() || probe.is_some() => {
                return fault("cartesian", "and a probe say different things; only one can be there");
            }
            Some(_) if keys.speed_ratio.is_some() => {
                return fault("speed_ratio", "belongs to a probe, not to a lattice");
            }
            Some(Lattice { size, spacing, origin }) => {
                let geometry = Geometry::Cartesian(Grid { size, spacing, origin });
                let both_ways = keys.both_ways.unwrap_or(false);
                (geometry.clone(), geometry, Volumes { both_ways, ..Volumes::forward(size[2], 1) }, None)
            }
            None => {
                let of_stream = keys.probe.map(|tables| ProbeFile::from_tables(Path::new(NAME), tables)).transpose()?;
                let Some(file) = probe.or(of_stream) else {
                    let why = "is missing: neither it nor \"cartesian\" is there, and no probe file was given";
                    return fault("probe", why);
                };
                let (forward, backward, volumes) = geometries(&file, size, keys.both_ways, keys.speed_ratio)?;
                (forward, backward, volumes, file.range())
            }
        };
        let range = match (keys.range.or(range), sample) {
            (Some(range), _) => range,
            (None, SampleType::U8) => [0.0, 255.0],
            (None, SampleType::U16 | SampleType::I16) => [0.0, 65535.0],
            (None, SampleType::F32) => return fault("range", "is missing: f32 needs the values that are 0 and 1"),
        };
        let header = Header { forward, backward, stored: sample.stored(), range, posed, synthetic: false };
        header.check().or_else(|(key, wrong)| fault(key, wrong))?;
        let lines = size[1];
        let checked = keys.version == 3;
        let lines_at_once = match keys.lines_at_once {
            Some(_) if checked => {
                return fault("lines_at_once", "is for versions 1 and 2; the checksums of 3 are of whole frames");
            }
            Some(0) => return fault("lines_at_once", "is 0, must be at least 1"),
            given => given.unwrap_or(lines).min(lines),
        };
        Ok(StreamHeader { header, sample, stamped: keys.stamped, checked, lines, lines_at_once, volumes })
    }

    /// Size of a frame in the stream, bytes.
    pub(super) fn record_bytes(&self) -> usize {
        // A header with frames of no size was refused.
        self.before() + self.header.frame_bytes().unwrap_or(1) as usize + if self.checked { OVERHEAD } else { 0 }
    }

    /// Size of the time stamp and the pose of a frame, bytes.
    fn before(&self) -> usize {
        let stamp = if self.stamped { size_of::<f64>() } else { 0 };
        stamp + if self.header.posed { POSE_BYTES } else { 0 }
    }

    /// Splits the bytes of a frame into time stamp, pose and samples.
    ///
    /// # Errors
    /// The time stamp is impossible.
    pub fn parts<'a>(&self, bytes: &'a [u8], stamps: &mut Stamps) -> Result<Parts<'a>, InputError> {
        let (mut time, mut pose, mut samples) = (None, None, bytes);
        if let Some((stamp, rest)) = samples.split_first_chunk().filter(|_| self.stamped) {
            let taken = stamps.take(f64::from_le_bytes(*stamp));
            (time, samples) = (taken.map_err(|wrong| stream_error("time stamp", wrong))?, rest);
        }
        if let Some((stated, rest)) = samples.split_first_chunk::<POSE_BYTES>().filter(|_| self.header.posed) {
            // All NaN is a frame that states that it has none.
            let is_stated = stated.as_chunks::<8>().0.iter().any(|word| !f64::from_le_bytes(*word).is_nan());
            pose = is_stated.then(|| read_pose(stated));
            samples = rest;
        }
        Ok(Parts { time, pose, samples })
    }

    /// The frame at an index of the stream, from 0, with its place in a volume but without samples.
    pub fn frame(&self, index: u64, time: Option<f64>) -> Frame {
        let each = self.volumes.frames as u64;
        let (volume, number) = (index / each, (index % each) as usize);
        // The direction depends on the parity only.
        let backward = self.volumes.backward((volume % 2) as usize);
        let slice = if backward { self.volumes.frames - 1 - number } else { number };
        let volume = u32::try_from(volume).unwrap_or(u32::MAX);
        Frame { number: number as u32, backward, time, ..Frame::of_slice(volume, slice, Vec::new()) }
    }
}

impl Keys {
    /// Samples, lines and frames, each 1 to [`MAX_EXTENT`].
    fn size(&self) -> Result<[usize; 3], InputError> {
        let given = [("samples", self.samples), ("lines", self.lines), ("frames", self.frames)];
        let mut size = [0; 3];
        for (axis, (key, given)) in given.into_iter().enumerate() {
            size[axis] = match (given, self.cartesian.as_ref().map(|lattice| lattice.size[axis])) {
                (Some(n), None) | (None, Some(n)) => n,
                (Some(n), Some(same)) if n == same => n,
                (Some(n), Some(other)) => return fault(key, format!("is {n}, but cartesian.size says {other}")),
                (None, None) => return fault(key, "is missing"),
            };
            if !(1..=MAX_EXTENT).contains(&size[axis]) {
                return fault(key, format!("is {}, must be 1 to {MAX_EXTENT}", size[axis]));
            }
        }
        Ok(size)
    }
}

/// The geometries of forward and backward sweeps, and how frames make up volumes.
fn geometries(
    file: &ProbeFile,
    [samples, lines, frames]: [usize; 3],
    both_ways: Option<bool>,
    speed_ratio: Option<f64>,
) -> Result<(Geometry, Geometry, Volumes), InputError> {
    let (probe, mut volumes) = file.geometry(samples, lines, frames)?;
    if volumes.frames != frames {
        return fault("frames", format!("is {frames}, but the probe has {} a volume", volumes.frames));
    }
    volumes.both_ways = both_ways.unwrap_or(volumes.both_ways);
    volumes.speed_ratio = speed_ratio.unwrap_or(volumes.speed_ratio);
    if !(0.0..=1.0).contains(&volumes.speed_ratio) {
        return fault("speed_ratio", format!("is {}, must be 0 to 1", volumes.speed_ratio));
    }
    let swept = |first_backward| Geometry::Sweep(Volumes { first_backward, ..volumes.clone() }.swept(0, &probe));
    Ok((swept(false), swept(true), volumes))
}

/// Longest first line, bytes.
const MAX_HEADER_BYTES: u64 = 64 << 10;

/// Reports the end of the stream when the thread ends, also after a panic.
struct EndOnExit(Arc<Queue>);

impl Drop for EndOnExit {
    fn drop(&mut self) {
        self.0.end(Some(format!("{NAME}: its thread ended")));
    }
}

struct Reader<'a, R> {
    input: BufReader<R>,
    queue: &'a Queue,
    replaced: Replaced,
    /// A complete part has arrived, so that the next one may be allocated at once.
    proven: bool,
    /// A pose was reported as none.
    refused_pose: bool,
    stamps: Stamps,
    /// Bytes that came and are not yet part of a frame with a checksum.
    record: Vec<u8>,
}

/// What the end of a stream means, `came` bytes into a frame: between two frames it is the regular one.
fn cut(stream: &StreamHeader, index: u64, error: &io::Error, came: usize) -> Result<bool, InputError> {
    match error.kind() {
        io::ErrorKind::UnexpectedEof if came == 0 => Ok(false),
        io::ErrorKind::UnexpectedEof => {
            let Frame { volume, number, .. } = stream.frame(index, None);
            let there = format!("{came} of {} bytes of frame {number} of volume {volume} came", stream.record_bytes());
            Err(stream_error("samples", format!("cut short, {there} (both numbered from 0)")))
        }
        _ => Err(stream_error("samples", format!("cannot be read: {error}"))),
    }
}

fn stream_error(field: &str, fault: impl AsRef<str>) -> InputError {
    InputError::new(Path::new(NAME), field, fault)
}

/// Reads the first line of a stream, without its line end.
///
/// # Errors
/// There is no line end within the longest allowed header, or the stream cannot be read.
pub(super) fn first_line(input: &mut impl BufRead) -> Result<Vec<u8>, InputError> {
    let mut line = Vec::new();
    let read = Read::take(input, MAX_HEADER_BYTES).read_until(b'\n', &mut line);
    read.map_err(|e| stream_error("header", format!("cannot be read: {e}")))?;
    match line.pop() {
        Some(b'\n') => Ok(line),
        Some(_) if line.len() as u64 + 1 == MAX_HEADER_BYTES => Err(stream_error(
            "header",
            format!("is longer than {MAX_HEADER_BYTES} bytes; its line must end before that"),
        )),
        _ => Err(stream_error("header", "the stream ends before its first line does")),
    }
}

impl<'a, R: Read> Reader<'a, R> {
    fn new(input: R, queue: &'a Queue) -> Reader<'a, R> {
        Reader {
            input: BufReader::new(input),
            queue,
            replaced: Replaced::default(),
            proven: false,
            refused_pose: false,
            stamps: Stamps::default(),
            record: Vec::new(),
        }
    }

    /// Reads until the stream ends or the receiver is dropped.
    ///
    /// # Errors
    /// A first line that is not a header, an end within a frame, errors of the operating system.
    fn run(&mut self, probe: Option<ProbeFile>) -> Result<(), InputError> {
        let stream = StreamHeader::parse(&first_line(&mut self.input)?, probe)?;
        let begin = Event::Begin(Box::new(stream.header.clone()));
        let pieces = stream.lines.div_ceil(stream.lines_at_once);
        let frame = stream.header.frame_bytes().unwrap_or(0) as usize + pieces * weight(&Event::Idle);
        self.queue.set_limit(MAX_WAITING_FRAMES.saturating_mul(frame).min(MAX_WAITING_BYTES));
        let mut index = 0;
        let mut goes_on = Ok(self.queue.push(begin));
        while let Ok(true) = goes_on {
            goes_on = match stream.checked {
                true => self.checked_frame(&stream, &mut index),
                false => self.frame(&stream, &mut index),
            };
        }
        let Replaced { not_finite, denormal } = self.replaced;
        if self.replaced != Replaced::default() {
            let what = format!("{NAME}: {not_finite} samples were not finite, {denormal} denormal; they read as 0");
            self.queue.push(Event::Fault(what));
        }
        goes_on.map(drop)
    }

    /// Reads the next frame, as a whole or in parts. `next`: the number of frames before it, which increases by 1. False: there is none, or the receiver was dropped.
    fn frame(&mut self, stream: &StreamHeader, next: &mut u64) -> Result<bool, InputError> {
        let (index, before, mut came, mut head) = (*next, stream.before(), 0, Vec::new());
        *next += 1;
        if let Err(error) = self.fill(before, &mut head, &mut came, false) {
            return cut(stream, index, &error, came);
        }
        let Parts { time, pose, .. } = stream.parts(&head, &mut self.stamps)?;
        let pose = self.pose(pose, stream, index);
        let line = (stream.record_bytes() - before) / stream.lines;
        for first in (0..stream.lines).step_by(stream.lines_at_once) {
            let lines = stream.lines_at_once.min(stream.lines - first);
            let mut frame = Frame { pose, ..stream.frame(index, time) };
            if let Err(error) = self.fill(lines * line, &mut frame.bytes, &mut came, true) {
                return cut(stream, index, &error, came);
            }
            self.store(stream, &mut frame);
            let event = match lines == stream.lines {
                true => Event::Frame(frame),
                false => Event::Lines { frame, first },
            };
            if !self.queue.push(event) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Reads the next frame that has a checksum, and leaves out what is none before it. `next`: the number that comes next. False: there is none, or
    /// the receiver was dropped.
    fn checked_frame(&mut self, stream: &StreamHeader, next: &mut u64) -> Result<bool, InputError> {
        let (mut record, mut left_out) = (std::mem::take(&mut self.record), 0);
        let whole = stream.record_bytes();
        let number = loop {
            let mut came = record.len();
            if let Err(error) = self.fill(whole - record.len(), &mut record, &mut came, false) {
                self.left_out(left_out, 0);
                return cut(stream, *next, &error, came);
            }
            if let Some((number, _)) = piped_record::content(&record) {
                if number >= *next {
                    break number;
                }
                let what = format!("{NAME}: frame {number}, counted from 0, came again; it is left out");
                if !self.queue.push(Event::Fault(what)) {
                    return Ok(false);
                }
                record.clear();
                continue;
            }
            // Of a stream without any frame nothing would notice that nobody listens.
            if locked(&self.queue.state).closed {
                return Ok(false);
            }
            let start = piped_record::next_start(&record);
            left_out += start as u64;
            record.drain(..start);
        };
        self.proven = true;
        self.left_out(left_out, number - *next);
        *next = number + 1;
        let Some((_, content)) = piped_record::content(&record) else { return Ok(false) };
        let Parts { time, pose, samples } = stream.parts(content, &mut self.stamps)?;
        let mut frame = Frame { bytes: samples.to_vec(), ..stream.frame(number, time) };
        frame.pose = self.pose(pose, stream, number);
        self.store(stream, &mut frame);
        record.clear();
        self.record = record;
        Ok(self.queue.push(Event::Frame(frame)))
    }

    /// Says what was left out before a frame, if anything was.
    fn left_out(&self, bytes: u64, frames: u64) {
        if bytes + frames > 0 {
            let what = format!("{NAME}: {bytes} bytes are no frame and are left out; {frames} frames are missing");
            self.queue.push(Event::Fault(what));
        }
    }

    /// A pose that is one. The first that is none is reported.
    fn pose(&mut self, stated: Option<Option<DAffine3>>, stream: &StreamHeader, index: u64) -> Option<DAffine3> {
        if stated == Some(None) && !std::mem::replace(&mut self.refused_pose, true) {
            let Frame { volume, number, .. } = stream.frame(index, None);
            let what = "has a pose that is not rigid and finite; it and others like it count as none";
            self.queue.push(Event::Fault(format!("{NAME}: frame {number} of volume {volume} {what}")));
        }
        stated.flatten()
    }

    /// Stores samples as frames have them.
    fn store(&mut self, stream: &StreamHeader, frame: &mut Frame) {
        let known = self.replaced == Replaced::default();
        self.replaced += samples::store(stream.sample, false, &mut frame.bytes);
        if known && self.replaced != Replaced::default() {
            let Frame { volume, number, .. } = frame;
            let what = "has samples that are not finite or are denormal; from here on they read as 0";
            self.queue.push(Event::Fault(format!("{NAME}: frame {number} of volume {volume} {what}")));
        }
    }

    /// Appends `count` bytes. `came` counts the bytes that arrived, also if some are missing. `are_samples`: a complete part of a frame, after
    /// which the next may be allocated at once; a time stamp and a pose prove nothing about the samples.
    fn fill(&mut self, count: usize, bytes: &mut Vec<u8>, came: &mut usize, are_samples: bool) -> io::Result<()> {
        if self.proven {
            bytes.reserve_exact(count);
        }
        let before = bytes.len();
        // Before anything is proven, memory grows with the data that arrive: `count` may come from a false header.
        let read = Read::take(&mut self.input, count as u64).read_to_end(bytes);
        *came += bytes.len() - before;
        if read? < count {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.proven |= are_samples;
        Ok(())
    }
}

struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    waiting: VecDeque<(Event, usize)>,
    /// Memory of all queued events, bytes.
    weight: usize,
    limit: usize,
    /// The stream has ended, and why.
    end: Option<Option<String>>,
    /// The receiver was dropped.
    closed: bool,
}

impl Queue {
    fn new() -> Queue {
        let state = State { waiting: VecDeque::new(), weight: 0, limit: 0, end: None, closed: false };
        Queue { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Limit of the queued bytes. A single event is always queued.
    fn set_limit(&self, limit: usize) {
        locked(&self.state).limit = limit;
    }

    /// Adds an event, waiting until it fits. False: the receiver was dropped.
    fn push(&self, event: Event) -> bool {
        let weight = weight(&event);
        let mut state = locked(&self.state);
        while !state.closed && !state.waiting.is_empty() && state.weight.saturating_add(weight) > state.limit {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if !state.closed {
            state.weight += weight;
            state.waiting.push_back((event, weight));
            self.changed.notify_all();
        }
        !state.closed
    }

    /// Ends the stream. The first reason is kept.
    fn end(&self, why: Option<String>) {
        locked(&self.state).end.get_or_insert(why);
        self.changed.notify_all();
    }

    fn close(&self) {
        let mut state = locked(&self.state);
        state.closed = true;
        state.waiting.clear();
        self.changed.notify_all();
    }

    fn next(&self, patience: Duration) -> Event {
        let started = Instant::now();
        let mut state = locked(&self.state);
        loop {
            if let Some((event, weight)) = state.waiting.pop_front() {
                state.weight -= weight;
                self.changed.notify_all();
                return event;
            }
            if let Some(why) = &state.end {
                return Event::End(why.clone());
            }
            let left = patience.saturating_sub(started.elapsed());
            if left.is_zero() {
                return Event::Idle;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

fn weight(event: &Event) -> usize {
    let bytes = match event {
        Event::Frame(frame) | Event::Lines { frame, .. } => frame.bytes.len(),
        _ => 0,
    };
    // Even an event of a single byte takes memory.
    bytes + size_of::<(Event, usize)>()
}
