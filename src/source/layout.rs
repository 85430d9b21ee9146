//! The layout of a recorded file: what a reader finds out before any sample is read, and the samples as a stream of bytes.

use super::samples::SampleType;
use crate::files::InputError;
use crate::probe::{Grid, Probe};
use flate2::{Decompress, FlushDecompress, Status};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Most samples, lines or frames.
const MAX_EXTENT: u64 = 65_536;
/// Largest frame, bytes.
const MAX_FRAME_BYTES: u64 = 1 << 30;

/// The layout of a recorded file, and the geometry that is stored in it.
pub(super) struct Layout {
    pub format: &'static str,
    pub sample: SampleType,
    pub big_endian: bool,
    /// Samples and lines, or width and height; the first index is the fastest.
    pub frame_size: [usize; 2],
    pub frames: usize,
    pub pixels: Pixels,
    pub line_order: LineOrder,
    pub geometry: StoredGeometry,
    /// The file states where its samples lie. If not, a `probe.toml` of the folder applies.
    pub states_geometry: bool,
    /// Time stamps by frame, s.
    pub times: BTreeMap<usize, f64>,
    /// Remarks for users: title and text. Never a patient field.
    pub remarks: Vec<(String, String)>,
}

/// How the rows of a frame relate to scan lines.
pub(super) enum LineOrder {
    InOrder,
    /// The last line comes first.
    Reversed,
    /// They are not scan lines: the frames are pictures. Holds the value in the file that says so.
    Pictures(String),
}

/// The geometry that is stored in a file.
pub(super) enum StoredGeometry {
    /// One polar volume.
    Sweep(Box<Probe>),
    /// Cartesian volumes, and how many there are.
    Pictures(Grid, usize),
    /// None, although the file needs one.
    Missing(InputError),
}

impl Layout {
    pub fn frame_bytes(&self) -> u64 {
        self.frame_size[0] as u64 * self.frame_size[1] as u64 * self.sample.bytes() as u64
    }

    /// Refuses sizes that are impossible for a file of this length, so that a false header never causes a large allocation.
    pub fn check(&self, file: &Path, size_field: &str) -> Result<(), InputError> {
        let fault = |field: &str, fault: String| Err(InputError::new(file, field, fault));
        if self.frame_bytes() > MAX_FRAME_BYTES {
            return fault(size_field, format!("one frame has {} bytes, at most 1 GiB is read", self.frame_bytes()));
        }
        // Cannot overflow: at most 2^16 frames of at most 2^30 bytes.
        let claimed = self.frame_bytes() * self.frames as u64;
        let there = self.pixels.length;
        if !self.pixels.compressed && claimed > there {
            return fault("data", format!("cut short, {there} of {claimed} bytes are there"));
        }
        if self.pixels.compressed && claimed > there.saturating_mul(MAX_INFLATED).saturating_add(1024) {
            return fault("data", format!("{there} compressed bytes cannot hold the {claimed} bytes of {size_field}"));
        }
        Ok(())
    }
}

/// Checks a number of samples, lines or frames.
pub(super) fn extent(file: &Path, field: &str, which: &str, value: u64) -> Result<usize, InputError> {
    match value {
        0 => Err(InputError::new(file, field, format!("{which}is 0, must be at least 1"))),
        1..=MAX_EXTENT => Ok(value as usize),
        _ => Err(InputError::new(file, field, format!("{which}is {value}, must be at most {MAX_EXTENT}"))),
    }
}

/// Largest ratio that deflate can reach: 258 bytes from two bits, so 1032 (zlib, "technical details").
const MAX_INFLATED: u64 = 1032;

/// The location of the samples: file and range of bytes.
#[derive(Clone, Debug)]
pub(super) struct Pixels {
    pub path: PathBuf,
    /// Offset of the first byte.
    pub offset: u64,
    /// Length in the file, bytes, compressed or not.
    pub length: u64,
    pub compressed: bool,
}

/// The samples as a stream.
pub(super) enum PixelStream {
    Raw(BufReader<File>),
    Zlib(Box<Inflate>),
}

impl Pixels {
    /// Opens the stream `skip` bytes after its beginning. A compressed stream is inflated up to there.
    pub fn open(&self, skip: u64) -> io::Result<PixelStream> {
        let mut file = File::open(&self.path)?;
        if !self.compressed {
            file.seek(SeekFrom::Start(self.offset.saturating_add(skip)))?;
            return Ok(PixelStream::Raw(BufReader::new(file)));
        }
        file.seek(SeekFrom::Start(self.offset))?;
        let input = BufReader::new(file.take(self.length));
        let mut stream = PixelStream::Zlib(Box::new(Inflate { input, state: Decompress::new(true), ended: false }));
        stream.skip(skip)?;
        Ok(stream)
    }
}

impl PixelStream {
    pub fn skip(&mut self, bytes: u64) -> io::Result<()> {
        match self {
            PixelStream::Raw(file) => file.seek_relative(i64::try_from(bytes).map_err(io::Error::other)?),
            PixelStream::Zlib(inflate) => {
                let skipped = io::copy(&mut inflate.as_mut().take(bytes), &mut io::sink())?;
                if skipped == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
            }
        }
    }

    /// Appends `bytes` bytes to `out`, or as many as there are. The buffer grows with the data that arrive and not with the requested
    /// number, which may come from a false header.
    pub fn fill(&mut self, bytes: u64, out: &mut Vec<u8>) -> io::Result<()> {
        match self {
            PixelStream::Raw(file) => file.take(bytes).read_to_end(out)?,
            PixelStream::Zlib(inflate) => inflate.as_mut().take(bytes).read_to_end(out)?,
        };
        Ok(())
    }

    /// Reads a compressed stream to its end, where its checksum is verified. Returns the number of bytes that were left.
    pub fn finish(&mut self) -> io::Result<u64> {
        match self {
            PixelStream::Raw(_) => Ok(0),
            PixelStream::Zlib(inflate) => io::copy(inflate.as_mut(), &mut io::sink()),
        }
    }
}

/// A zlib stream. Unlike flate2's own reader it detects a stream that is cut short.
pub(super) struct Inflate {
    input: BufReader<io::Take<File>>,
    state: Decompress,
    ended: bool,
}

impl Read for Inflate {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while !self.ended && !out.is_empty() {
            let input = self.input.fill_buf()?;
            let no_more = input.is_empty();
            let (taken, made) = (self.state.total_in(), self.state.total_out());
            let status = self
                .state
                .decompress(input, out, FlushDecompress::None)
                .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "the compressed stream is corrupt"))?;
            let taken = (self.state.total_in() - taken) as usize;
            let made = (self.state.total_out() - made) as usize;
            self.input.consume(taken);
            self.ended = status == Status::StreamEnd;
            if made > 0 {
                return Ok(made);
            }
            if !self.ended && no_more {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            if !self.ended && taken == 0 {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "the compressed stream is stuck"));
            }
        }
        Ok(0)
    }
}
