//! Progress of reading a recording, for a thread that waits for it, and a way to cancel the reading.
//!
//! The reading thread has a [`Progress`] during its work. Files that it opens as [`CountedFile`] count the bytes that are read from them; a
//! reader only announces how many there will be ([`expect_bytes`], [`expect_files`]). Without a [`Progress`] these functions do nothing.

use std::cell::RefCell;
use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Progress of reading input files: the thread that reads counts, and any other thread may query it. All clones share the counts.
#[derive(Clone, Debug, Default)]
pub struct Progress(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    /// All bytes that were read.
    bytes: AtomicU64,
    /// How many of them had been read when the last pass over the data began, and how many that pass has.
    before: AtomicU64,
    expected: AtomicU64,
    /// Files whose headers were read, and how many there are.
    files: AtomicU64,
    expected_files: AtomicU64,
    is_cancelled: AtomicBool,
}

/// Progress of the reading of the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// The total is not known yet.
    Unknown,
    /// `done` of `count` headers of the files of a folder were read.
    Files { done: u64, count: u64 },
    /// Share of the announced data ([`expect_bytes`]) that was read, 0 to 100 per cent.
    Percent(u8),
}

thread_local! {
    static OF_THREAD: RefCell<Option<Progress>> = const { RefCell::new(None) };
}

impl Progress {
    /// Runs `work` on this thread and adds all bytes that it reads from [`CountedFile`]s to this progress.
    pub fn during<T>(&self, work: impl FnOnce() -> T) -> T {
        /// Puts back what was there before, also if the work panics.
        struct Before(Option<Progress>);
        impl Drop for Before {
            fn drop(&mut self) {
                OF_THREAD.set(self.0.take());
            }
        }
        let _before = Before(OF_THREAD.replace(Some(self.clone())));
        work()
    }

    /// Cancels the reading: every later read from a [`CountedFile`] that was opened within [`Progress::during`] fails, and so does [`add_bytes`].
    pub fn cancel(&self) {
        self.0.is_cancelled.store(true, Ordering::Relaxed);
    }

    pub fn is_cancelled(&self) -> bool {
        self.0.is_cancelled.load(Ordering::Relaxed)
    }

    /// How much of the input was read so far.
    pub fn share(&self) -> Share {
        let get = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let counts = &*self.0;
        match (get(&counts.expected), get(&counts.expected_files)) {
            (0, 0) => Share::Unknown,
            (0, count) => Share::Files { done: get(&counts.files).min(count), count },
            (expected, _) => {
                let done = get(&counts.bytes).saturating_sub(get(&counts.before)).min(expected);
                Share::Percent((u128::from(done) * 100 / u128::from(expected)) as u8)
            }
        }
    }

    fn add(&self, bytes: u64) {
        self.0.bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    fn check(&self) -> io::Result<()> {
        if self.is_cancelled() { Err(io::Error::other("reading was cancelled")) } else { Ok(()) }
    }
}

/// The progress of this thread, if its reading counts.
fn of_thread() -> Option<Progress> {
    OF_THREAD.with_borrow(Clone::clone)
}

/// Announces that this thread will read `bytes` bytes of input; [`Share::Percent`] counts from 0 to them from now on. Ignored if at least as many
/// bytes of an earlier announcement are still to be read, because this reading is then a part of that. Does nothing outside [`Progress::during`].
pub fn expect_bytes(bytes: u64) {
    if let Some(Progress(counts)) = of_thread() {
        let done = counts.bytes.load(Ordering::Relaxed) - counts.before.load(Ordering::Relaxed);
        if counts.expected.load(Ordering::Relaxed).saturating_sub(done) >= bytes {
            return;
        }
        counts.before.store(counts.bytes.load(Ordering::Relaxed), Ordering::Relaxed);
        counts.expected.store(bytes, Ordering::Relaxed);
    }
}

/// Announces that this thread will read the headers of `count` files next. Does nothing outside [`Progress::during`].
pub fn expect_files(count: u64) {
    if let Some(Progress(counts)) = of_thread() {
        counts.files.store(0, Ordering::Relaxed);
        counts.expected_files.store(count, Ordering::Relaxed);
    }
}

/// Counts the header of one more file as read by this thread. Does nothing outside [`Progress::during`].
pub fn file_read() {
    if let Some(Progress(counts)) = of_thread() {
        counts.files.fetch_add(1, Ordering::Relaxed);
    }
}

/// Counts bytes that were read on this thread by a library which opens its file itself. Does nothing outside [`Progress::during`].
///
/// # Errors
/// The reading was cancelled.
pub fn add_bytes(bytes: u64) -> io::Result<()> {
    let Some(progress) = of_thread() else { return Ok(()) };
    progress.add(bytes);
    progress.check()
}

/// A file whose bytes count for the [`Progress`] of the thread that opened it, and whose reads fail once that reading is cancelled.
#[derive(Debug)]
pub struct CountedFile {
    file: File,
    progress: Option<Progress>,
}

impl CountedFile {
    pub fn open(path: &Path) -> io::Result<CountedFile> {
        Ok(CountedFile { file: File::open(path)?, progress: of_thread() })
    }

    pub fn metadata(&self) -> io::Result<Metadata> {
        self.file.metadata()
    }
}

impl Read for CountedFile {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let Some(progress) = &self.progress else { return self.file.read(out) };
        progress.check()?;
        let bytes = self.file.read(out)?;
        progress.add(bytes as u64);
        Ok(bytes)
    }
}

impl Seek for CountedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_of_the_pass_that_began_last_and_ends_at_100() {
        let progress = Progress::default();
        assert_eq!(progress.share(), Share::Unknown);
        progress.during(|| {
            expect_files(3);
            file_read();
            assert_eq!(progress.share(), Share::Files { done: 1, count: 3 });
            add_bytes(500).expect("not cancelled");
            expect_bytes(1000);
            assert_eq!(progress.share(), Share::Percent(0));
            add_bytes(439).expect("not cancelled");
            assert_eq!(progress.share(), Share::Percent(43));
            add_bytes(1 << 40).expect("not cancelled");
            assert_eq!(progress.share(), Share::Percent(100), "more than was expected");
            expect_bytes(200);
            add_bytes(100).expect("not cancelled");
            expect_bytes(100);
            assert_eq!(progress.share(), Share::Percent(50), "the second pass was expected with the first");
        });
        expect_bytes(7);
        assert_eq!(progress.share(), Share::Percent(50), "what is read afterwards does not count");
    }

    #[test]
    fn a_file_counts_for_the_thread_that_opened_it_until_it_is_cancelled() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("data");
        std::fs::write(&path, vec![7; 1000]).expect("file");
        let (progress, mut out) = (Progress::default(), [0; 100]);
        let mut file = progress.during(|| {
            expect_bytes(1000);
            CountedFile::open(&path).expect("file")
        });
        file.read_exact(&mut out).expect("bytes");
        assert_eq!(progress.share(), Share::Percent(10));
        progress.cancel();
        assert!(file.read(&mut out).is_err_and(|e| e.to_string().contains("cancelled")));
        assert_eq!(progress.share(), Share::Percent(10));
        // Another reader of the same file goes on.
        CountedFile::open(&path).expect("file").read_exact(&mut out).expect("bytes");
    }

    #[test]
    fn a_panic_takes_the_progress_from_the_thread() {
        let progress = Progress::default();
        let panicked =
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| progress.during(|| panic!("injected"))));
        assert!(panicked.is_err() && of_thread().is_none());
    }
}
