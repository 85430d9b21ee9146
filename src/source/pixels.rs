//! The samples of a recording as a stream of bytes, inflated on the way where the file is compressed.

use flate2::{Decompress, FlushDecompress, Status};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::PathBuf;

/// Deflate cannot make more than this many bytes of one: 258 from each two bits, so 1032 (zlib, "technical details").
pub(super) const MOST_INFLATED: u64 = 1032;

/// Where in which file the samples lie.
#[derive(Clone, Debug)]
pub(super) struct Pixels {
    pub path: PathBuf,
    /// First byte.
    pub offset: u64,
    /// Bytes in the file, compressed or not.
    pub length: u64,
    pub compressed: bool,
}

/// The samples from some place on.
pub(super) enum PixelStream {
    Raw(BufReader<File>),
    Zlib(Box<Inflate>),
}

impl Pixels {
    /// The stream from `skip` bytes on. A compressed stream is inflated up to there.
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

    /// Appends `bytes` bytes to `out`, or as many as there are. The buffer grows with what arrives, not with what was
    /// asked for: the number may be a header's mere claim.
    pub fn fill(&mut self, bytes: u64, out: &mut Vec<u8>) -> io::Result<()> {
        match self {
            PixelStream::Raw(file) => file.take(bytes).read_to_end(out)?,
            PixelStream::Zlib(inflate) => inflate.as_mut().take(bytes).read_to_end(out)?,
        };
        Ok(())
    }

    /// Reads on to the end of a compressed stream, where its checksum is compared; bytes that came before the end.
    pub fn finish(&mut self) -> io::Result<u64> {
        match self {
            PixelStream::Raw(_) => Ok(0),
            PixelStream::Zlib(inflate) => io::copy(inflate.as_mut(), &mut io::sink()),
        }
    }
}

/// A zlib stream. Unlike flate2's own reader it tells a stream that was cut off from one that is complete.
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
