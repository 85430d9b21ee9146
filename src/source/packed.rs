//! Files that may be packed as a whole (.gz), and the samples in them as a stream of bytes.
//!
//! A packed file is read through its decompressor from the start, each time anew; nothing is unpacked to a disk.

use super::describe;
use super::dicom::Coding;
use super::gathered::Gathered;
use crate::files::InputError;
use crate::files::progress::CountedFile;
use bzip2::bufread::MultiBzDecoder;
use flate2::bufread::GzDecoder;
use flate2::{Decompress, FlushDecompress, Status};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The mark of a file that is packed as a whole, and of each member of one.
pub(super) const GZIP: [u8; 2] = [0x1f, 0x8b];

/// How the samples of a file are compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Raw,
    Zlib,
    Gzip,
    Bzip2,
    /// A stack of pictures, each compressed as its own format says.
    Pictures,
    /// Frames of DICOM files, compressed as given.
    Dicom(Coding),
}

impl Encoding {
    /// Name of the compression for users, and its largest ratio.
    ///
    /// Deflate: 258 bytes from two bits, so 1032 (zlib, "technical details"). Bzip2: a block of 900 kB holds runs of 259 bytes in 5, 46 MB from about 40
    /// bytes. PNG: that of deflate, whose bits may be pixels of 3 bytes. RLE: 128 bytes from 2. JPEG: one bit for a block of 64 pixels; with shared
    /// colours 6 bits for 256 pixels of 3 bytes. Lossless JPEG: one bit for a number of 2 bytes. JPEG 2000 has no limit, as a few bytes can state that a
    /// whole picture is 0; a ratio is refused that real data do not reach.
    fn about(self) -> (&'static str, u64) {
        match self {
            Encoding::Raw | Encoding::Dicom(Coding::Native) => ("none", 1),
            Encoding::Zlib => ("zlib", 1032),
            Encoding::Gzip => ("gzip", 1032),
            Encoding::Bzip2 => ("bzip2", 1_200_000),
            Encoding::Pictures => ("that of the pictures", 1032 * 24),
            Encoding::Dicom(Coding::Rle) => ("RLE", 64),
            Encoding::Dicom(Coding::Jpeg) => ("JPEG", 1024),
            Encoding::Dicom(Coding::JpegLossless) => ("lossless JPEG", 16),
            Encoding::Dicom(Coding::Jpeg2000) => ("JPEG 2000", 1032 * 24),
        }
    }

    /// Name of the compression for users; "none" without one.
    pub fn name(self) -> &'static str {
        self.about().0
    }

    /// Largest ratio of decompressed to compressed bytes that is accepted.
    pub fn most(self) -> u64 {
        self.about().1
    }
}

/// A regular file that is read from its start, and unpacked if it is packed by gzip.
pub(super) struct InputFile<'a> {
    pub path: &'a Path,
    packed: bool,
    /// Length on the disk, or of the part.
    bytes: u64,
    /// The part of the unpacked file that is meant: first byte and length. None: all.
    part: Option<(u64, u64)>,
}

impl<'a> InputFile<'a> {
    /// Opens a file, and finds out by its first bytes whether it is packed.
    ///
    /// # Errors
    /// The file cannot be read, or is not a regular file.
    pub fn new(path: &'a Path) -> Result<InputFile<'a>, InputError> {
        let unreadable = |e| InputError::unreadable(path, &e);
        let metadata = fs::metadata(path).map_err(unreadable)?;
        // A pipe or a folder has no size to check claims against, and opening a pipe may block for ever.
        if !metadata.is_file() {
            return Err(InputError::new(path, "file", "is not a regular file"));
        }
        let mut start = Vec::new();
        File::open(path).and_then(|file| file.take(2).read_to_end(&mut start)).map_err(unreadable)?;
        Ok(InputFile { path, packed: start == GZIP, bytes: metadata.len(), part: None })
    }

    /// A part of this file as a file of its own: `length` unpacked bytes from `offset` on. It must lie within the unpacked file.
    pub fn window(&self, offset: u64, length: u64) -> InputFile<'a> {
        InputFile { part: Some((offset, length)), ..*self }
    }

    /// True if the whole file is packed by gzip.
    pub(crate) fn is_packed(&self) -> bool {
        self.packed
    }

    /// Opens the unpacked bytes from the start of the file.
    ///
    /// # Errors
    /// The file cannot be opened, or a packed one is cut short or corrupt before the start of its [`InputFile::window`].
    pub fn open(&self) -> io::Result<PixelStream> {
        self.pixels(0).open(0)
    }

    /// The first `bytes` unpacked bytes, or all if there are fewer.
    ///
    /// # Errors
    /// The file cannot be read. A packed file that is cut short or corrupt gives fewer bytes instead.
    pub fn start(&self, bytes: u64) -> Result<Vec<u8>, InputError> {
        let mut start = Vec::new();
        let read = self.open().and_then(|file| file.take(bytes).read_to_end(&mut start));
        match read {
            // What is cut short or corrupt is reported where it is read.
            Err(e) if !self.packed => Err(InputError::unreadable(self.path, &e)),
            _ => Ok(start),
        }
    }

    /// Upper limit of the number of bytes that the file can have unpacked.
    pub(crate) fn most_bytes(&self) -> u64 {
        match self.part {
            Some((_, length)) => length,
            None => self.pixels(0).most_bytes(),
        }
    }

    /// The location of samples in this file, from `offset` unpacked bytes after its start to its end.
    pub fn pixels(&self, offset: u64) -> Pixels {
        let path = self.path.to_path_buf();
        let (begin, there) = self.part.unwrap_or((0, self.bytes));
        let at = begin.saturating_add(offset);
        let (offset, length, encoding, inside) = match self.packed {
            true => (0, self.bytes, Encoding::Gzip, at),
            false => (at, there.saturating_sub(offset), Encoding::Raw, 0),
        };
        Pixels { path, offset, length, encoding, inside, gathered: None }
    }
}

/// The location of the samples of a recording: a file and a range of its bytes, or [`Gathered`].
#[derive(Clone)]
pub(super) struct Pixels {
    pub path: PathBuf,
    /// Offset in the file of the first byte that is read.
    pub offset: u64,
    /// Number of bytes from `offset` on that are read, as they are in the file, compressed or not.
    pub length: u64,
    pub encoding: Encoding,
    /// Number of decompressed bytes that come before the samples; 0 if they are not compressed.
    pub inside: u64,
    /// If given, the samples come from here, decompressed, and `offset` and `inside` do not count. `path` is then what the user named, `length` the
    /// bytes of all files together, and `encoding` what they are packed by.
    pub gathered: Option<Arc<dyn Gathered>>,
}

/// The samples of a recording as a stream, decompressed.
pub(super) enum PixelStream {
    Raw(BufReader<CountedFile>),
    Packed(Box<dyn Read + Send>),
}

impl Pixels {
    /// The location of samples that are not one range of one file. `path`: as the user named it; `length`: bytes in all files.
    pub fn gathered(path: &Path, encoding: Encoding, length: u64, from: impl Gathered + 'static) -> Pixels {
        Pixels { path: path.into(), offset: 0, length, encoding, inside: 0, gathered: Some(Arc::new(from)) }
    }

    /// All files that the samples are read from, after the path that the user named.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        [self.path.clone()].into_iter().chain(self.gathered.iter().flat_map(|gathered| gathered.files())).collect()
    }

    /// Upper limit of the number of bytes that the samples can have decompressed.
    pub(crate) fn most_bytes(&self) -> u64 {
        match self.is_compressed() {
            true => self.length.saturating_mul(self.encoding.most()).saturating_add(1024),
            false => self.length,
        }
    }

    /// Makes the samples begin so many bytes later: decompressed ones, if they are compressed.
    pub(crate) fn leave_out(&mut self, bytes: u64) {
        if self.is_compressed() {
            self.inside = self.inside.saturating_add(bytes);
            return;
        }
        let bytes = bytes.min(self.length);
        (self.offset, self.length) = (self.offset + bytes, self.length - bytes);
    }

    /// True unless the encoding is [`Encoding::Raw`]: pictures and frames of DICOM count as compressed, also where they are not.
    pub(crate) fn is_compressed(&self) -> bool {
        self.encoding != Encoding::Raw
    }

    /// Opens the stream `skip` bytes after the first sample. A compressed stream is decompressed up to there.
    ///
    /// # Errors
    /// The file cannot be read, or is cut short or corrupt.
    pub fn open(&self, skip: u64) -> io::Result<PixelStream> {
        if let Some(gathered) = &self.gathered {
            return Ok(PixelStream::Packed(gathered.clone().open(skip)?));
        }
        let mut file = CountedFile::open(&self.path)?;
        if !self.is_compressed() {
            file.seek(SeekFrom::Start(self.offset.saturating_add(skip)))?;
            return Ok(PixelStream::Raw(BufReader::new(file)));
        }
        file.seek(SeekFrom::Start(self.offset))?;
        let input = BufReader::new(file.take(self.length));
        let packed: Box<dyn Read + Send> = match self.encoding {
            Encoding::Gzip => Box::new(Members::new(input, &self.path)),
            Encoding::Bzip2 => Box::new(MultiBzDecoder::new(input)),
            _ => Box::new(Inflate { input, state: Decompress::new(true), ended: false }),
        };
        let mut stream = PixelStream::Packed(packed);
        stream.skip(self.inside.saturating_add(skip))?;
        Ok(stream)
    }
}

impl PixelStream {
    pub fn skip(&mut self, bytes: u64) -> io::Result<()> {
        match self {
            PixelStream::Raw(file) => file.seek_relative(i64::try_from(bytes).map_err(io::Error::other)?),
            PixelStream::Packed(stream) => {
                let skipped = io::copy(&mut stream.take(bytes), &mut io::sink())?;
                if skipped == bytes { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
            }
        }
    }

    /// Appends the next `bytes` bytes to `out`, fewer at the end of the stream. The buffer grows with the data that arrive and not with `bytes`,
    /// which may come from a false header.
    ///
    /// # Errors
    /// The file cannot be read, or is cut short or corrupt.
    pub fn fill(&mut self, bytes: u64, out: &mut Vec<u8>) -> io::Result<()> {
        self.take(bytes).read_to_end(out).map(drop)
    }

    /// Appends the next `bytes` bytes to `out`, as [`PixelStream::fill`] does.
    ///
    /// # Errors
    /// The file cannot be read, or is corrupt, or there are fewer bytes.
    pub(crate) fn fill_whole(&mut self, bytes: u64, out: &mut Vec<u8>) -> io::Result<()> {
        let before = out.len();
        self.fill(bytes, out)?;
        if ((out.len() - before) as u64) < bytes { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(()) }
    }

    /// Reads a compressed stream to its end, where its checksum is verified. Returns how many decompressed bytes it had left; always 0 for samples
    /// that are not compressed.
    ///
    /// # Errors
    /// The file cannot be read, is cut short or corrupt, or its checksum is wrong.
    pub fn finish(&mut self) -> io::Result<u64> {
        match self {
            PixelStream::Raw(_) => Ok(0),
            PixelStream::Packed(stream) => io::copy(stream, &mut io::sink()),
        }
    }
}

impl Read for PixelStream {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        match self {
            PixelStream::Raw(file) => file.read(out),
            PixelStream::Packed(stream) => stream.read(out),
        }
    }
}

/// The members of a gzip file, one after the other. Bytes behind them that are no member end it: zeros fill a tape up (gzip manual, "Using gzip on
/// tapes"), and of others one line says that they are not read.
struct Members {
    /// None behind the last one.
    current: Option<GzDecoder<Member>>,
    path: PathBuf,
    /// Members that were read to their end.
    count: u64,
}

/// The two bytes that tell a member, and what follows them.
type Member = io::Chain<io::Cursor<Vec<u8>>, BufReader<io::Take<CountedFile>>>;

impl Read for Members {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = self.current.as_mut().filter(|_| !out.is_empty()) {
            match member.read(out) {
                Ok(0) => {}
                // A header that is none, behind members that were whole.
                Err(e) if e.kind() == io::ErrorKind::InvalidInput && self.count > 0 => {
                    self.current = None;
                    self.tell_of_others();
                    break;
                }
                found => return found,
            }
            self.count += 1;
            let Some(member) = self.current.take() else { break };
            let (_, mut rest) = member.into_inner().into_inner();
            let mut start = Vec::new();
            (&mut rest).take(2).read_to_end(&mut start)?;
            if start == GZIP {
                self.current = Some(GzDecoder::new(io::Cursor::new(start).chain(rest)));
            } else if start.into_iter().map(Ok).chain(rest.bytes()).any(|byte| !matches!(byte, Ok(0))) {
                self.tell_of_others();
            }
        }
        Ok(0)
    }
}

impl Members {
    fn new(input: BufReader<io::Take<CountedFile>>, path: &Path) -> Members {
        let current = GzDecoder::new(io::Cursor::new(Vec::new()).chain(input));
        Members { current: Some(current), path: path.into(), count: 0 }
    }

    fn tell_of_others(&self) {
        tracing::warn!(file = %describe::path(&self.path), "bytes behind the gzip stream are not read");
    }
}

/// A zlib stream. Unlike flate2's own reader it detects a stream that is cut short.
struct Inflate {
    input: BufReader<io::Take<CountedFile>>,
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
