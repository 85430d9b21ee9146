//! Samples that are not one range of one file, as a stream of bytes.

use std::io::{self, Cursor, Read};
use std::path::PathBuf;
use std::sync::Arc;

/// Samples of a recording that do not lie in one range of one file, such as those of several files.
pub(super) trait Gathered: Send + Sync {
    /// Opens the samples as one stream, from `skip` bytes after their beginning.
    ///
    /// # Errors
    /// A file cannot be opened or read.
    fn open(self: Arc<Self>, skip: u64) -> io::Result<Box<dyn Read + Send>>;
    /// The files that hold the samples.
    fn files(&self) -> Vec<PathBuf>;
}

/// A sequence of pictures or frames of equal size that are decoded one by one.
pub(super) trait Decoded: Send + Sync + 'static {
    /// Bytes of the decoded samples of one picture or frame.
    fn each(&self) -> usize;
    /// The decoded samples of the picture or frame with this index; empty behind the last.
    ///
    /// # Errors
    /// The picture or frame cannot be read or decoded.
    fn decode(&self, number: usize) -> io::Result<Vec<u8>>;
    fn files(&self) -> &[PathBuf];
}

impl<D: Decoded> Gathered for D {
    fn open(self: Arc<Self>, skip: u64) -> io::Result<Box<dyn Read + Send>> {
        let each = self.each().max(1) as u64;
        let next = usize::try_from(skip / each).unwrap_or(usize::MAX);
        let mut stream = DecodedStream { from: self, next, samples: Cursor::default() };
        if !skip.is_multiple_of(each) {
            stream.decode()?;
            stream.samples.set_position(skip % each);
        }
        Ok(Box::new(stream))
    }

    fn files(&self) -> Vec<PathBuf> {
        Decoded::files(self).to_vec()
    }
}

struct DecodedStream<D> {
    from: Arc<D>,
    next: usize,
    samples: Cursor<Vec<u8>>,
}

impl<D: Decoded> DecodedStream<D> {
    fn decode(&mut self) -> io::Result<()> {
        self.samples = Cursor::new(self.from.decode(self.next)?);
        self.next = self.next.saturating_add(1);
        Ok(())
    }
}

impl<D: Decoded> Read for DecodedStream<D> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.samples.position() >= self.samples.get_ref().len() as u64 {
            self.decode()?;
        }
        self.samples.read(out)
    }
}
