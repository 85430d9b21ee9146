//! Runs a live source on a thread of its own, with a bounded queue of its events. Frames that arrive line by line are assembled here, so
//! that all later stages get whole frames. If the queue is full, a source that can wait is kept waiting; a source that cannot wait loses
//! frames, the oldest first, which are counted. The thread also records the frames.

use crate::gpu::Wake;
use crate::source::live::{Event, Live};
use crate::source::parts::WholeFrames;
use crate::source::posed::Posed;
use crate::source::recorder::{Header, Writer};
use crate::sync::locked;
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Largest total size of the queued frames, bytes. A single larger frame is still queued.
const MAX_BYTES: usize = 256 << 20;
/// Most events in the queue.
const MAX_EVENTS: usize = 4096;
/// Longest wait of the thread before it checks whether it is to stop.
const PATIENCE: Duration = Duration::from_millis(50);

/// An event of a source and its time of arrival.
#[derive(Clone, Debug)]
pub struct Arrived {
    pub event: Event,
    pub at: Instant,
}

/// A function that is called with the events of a source, before they are queued.
pub type Observer = Box<dyn FnMut(&Event) + Send>;

/// What a feed lost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FeedCounts {
    /// Number of frames that were lost because the queue was full.
    pub lost: u64,
    /// Number of frames that could not be recorded, and of other failures of the recording.
    pub unrecorded: u64,
    /// Number of times that the source was disconnected.
    pub disconnected: u64,
    /// Number of 2D frames of a freehand sweep that are not, or not wholly, compounded into a volume.
    pub left_out: u64,
}

impl FeedCounts {
    /// The sums of both counts.
    pub(super) fn plus(self, other: FeedCounts) -> FeedCounts {
        FeedCounts {
            lost: self.lost + other.lost,
            unrecorded: self.unrecorded + other.unrecorded,
            disconnected: self.disconnected + other.disconnected,
            left_out: self.left_out + other.left_out,
        }
    }
}

/// A live source that a thread of its own reads, and the queue of its events. It may also be without a source.
pub struct Feed {
    shared: Arc<Shared>,
    can_wait: bool,
    is_recording: bool,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    queue: Mutex<Queue>,
    /// Signalled when an event is added or removed.
    changed: Condvar,
    stop: AtomicBool,
    wake: Option<Wake>,
}

#[derive(Default)]
struct Queue {
    events: VecDeque<Arrived>,
    bytes: usize,
    /// The volume of the last frame that arrived.
    newest: Option<u32>,
    /// A frame of this volume was lost. Its remaining frames are of no use.
    lost_volume: Option<u32>,
    /// Why the source is not connected at the moment.
    disconnected: Option<String>,
    counts: FeedCounts,
}

impl Queue {
    /// Loses the oldest volume that is queued, if a newer one has come before `volume`: it would not be shown. False if there is none.
    fn discard_before(&mut self, volume: u32) -> bool {
        let volume_of = |arrived: &Arrived| match &arrived.event {
            Event::Frame(frame) => Some(frame.volume),
            _ => None,
        };
        let oldest = self.events.iter().find_map(volume_of);
        let Some(oldest) = oldest.filter(|oldest| oldest.saturating_add(1) < volume) else { return false };
        let before = self.events.len();
        self.events.retain(|arrived| volume_of(arrived) != Some(oldest));
        self.bytes = self.events.iter().map(|arrived| bytes_of(&arrived.event)).sum();
        self.counts.lost += (before - self.events.len()) as u64;
        true
    }
}

fn bytes_of(event: &Event) -> usize {
    match event {
        Event::Frame(frame) => frame.bytes.len(),
        _ => 0,
    }
}

impl Shared {
    fn set_disconnected(&self, why: Option<String>) {
        let mut queue = locked(&self.queue);
        if queue.disconnected != why {
            queue.counts.disconnected += u64::from(queue.disconnected.is_none());
            queue.disconnected = why;
            drop(queue);
            self.wake.iter().for_each(|wake| wake());
        }
    }

    /// Adds an event. For a frame, waits until it fits, or loses volumes that are over to the newest one, or it together with the rest of its
    /// volume. Other events are never lost.
    fn put(&self, arrived: Arrived, can_wait: bool) {
        let bytes = bytes_of(&arrived.event);
        let mut queue = locked(&self.queue);
        let is_full = |q: &Queue| !q.events.is_empty() && (q.bytes + bytes > MAX_BYTES || q.events.len() >= MAX_EVENTS);
        if let Event::Frame(frame) = &arrived.event {
            while can_wait && is_full(&queue) && !self.stop.load(Ordering::Relaxed) {
                queue = self.changed.wait_timeout(queue, PATIENCE).map_or_else(|e| e.into_inner().0, |w| w.0);
            }
            queue.newest = Some(frame.volume);
            while !can_wait && is_full(&queue) && queue.discard_before(frame.volume) {}
            if is_full(&queue) {
                queue.lost_volume = Some(frame.volume);
            }
            if queue.lost_volume == Some(frame.volume) {
                queue.counts.lost += 1;
                return;
            }
        }
        queue.bytes += bytes;
        queue.events.push_back(arrived);
        drop(queue);
        self.changed.notify_all();
        self.wake.iter().for_each(|wake| wake());
    }

    /// Changes the counts. It takes the lock of the queue.
    fn count(&self, by: impl FnOnce(&mut FeedCounts)) {
        by(&mut locked(&self.queue).counts);
    }
}

impl Feed {
    /// Reads a source until it ends or the feed is dropped. If `record` is given, every frame is also written to this `.frames` file. Each
    /// further geometry gets a file of its own: NAME-2.frames, NAME-3.frames ...
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn new(source: Box<dyn Live>, record: Option<&Path>) -> io::Result<Feed> {
        Feed::observed(source, record, None, None)
    }

    /// A feed without a source: no event ever arrives.
    pub fn none() -> Feed {
        Feed { shared: Arc::default(), can_wait: true, is_recording: false, thread: None }
    }

    /// Reads a source and records it as [`Feed::new`] does. `wake` is called after each event that was queued, and when the connection to the source
    /// is lost or found. `observer` is called with every event of the source except [`Event::Idle`] before it is queued, on
    /// the thread of the source. It also gets frames that are then lost because the queue is full. It does not get faults of the recording.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn observed(
        source: Box<dyn Live>,
        record: Option<&Path>,
        wake: Option<Wake>,
        observer: Option<Observer>,
    ) -> io::Result<Feed> {
        let shared = Arc::new(Shared { wake, ..Shared::default() });
        let (can_wait, is_recording) = (source.can_wait(), source.is_recording());
        let theirs = shared.clone();
        let tap = record.map(RecordingTap::new);
        let thread =
            std::thread::Builder::new().name("source".into()).spawn(move || listen(source, tap, observer, &theirs))?;
        Ok(Feed { shared, can_wait, is_recording, thread: Some(thread) })
    }

    /// Takes the oldest event from the queue. If there is none, waits at most `patience` for one; None if none arrives.
    pub fn next(&self, patience: Duration) -> Option<Arrived> {
        let mut queue = locked(&self.shared.queue);
        if queue.events.is_empty() && !patience.is_zero() {
            let woken = self.shared.changed.wait_timeout_while(queue, patience, |q| q.events.is_empty());
            queue = woken.map_or_else(|e| e.into_inner().0, |w| w.0);
        }
        let arrived = queue.events.pop_front()?;
        queue.bytes -= bytes_of(&arrived.event);
        drop(queue);
        self.shared.changed.notify_all();
        Some(arrived)
    }

    /// True if the source loses nothing while its events are not taken, and without a source.
    pub fn can_wait(&self) -> bool {
        self.can_wait
    }

    /// True if the source is a recording that is read as fast as its frames are taken.
    pub fn is_recording(&self) -> bool {
        self.is_recording
    }

    /// Number of queued events.
    pub fn waiting(&self) -> usize {
        locked(&self.shared.queue).events.len()
    }

    /// The reason on one line why the source is not connected at present. None while it is connected.
    pub fn disconnected(&self) -> Option<String> {
        locked(&self.shared.queue).disconnected.clone()
    }

    /// True if the source cannot wait and the volume after `volume` is over too, because a frame of a still newer one has arrived. Then `volume` need
    /// not be drawn.
    pub fn is_behind(&self, volume: u32) -> bool {
        !self.can_wait && locked(&self.shared.queue).newest.is_some_and(|newest| newest > volume.saturating_add(1))
    }

    /// The counts so far.
    pub fn counts(&self) -> FeedCounts {
        locked(&self.shared.queue).counts
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic of the source was reported as its end.
            let _ = thread.join();
        }
    }
}

fn listen(source: Box<dyn Live>, mut tap: Option<RecordingTap>, mut observer: Option<Observer>, shared: &Shared) {
    let mut source = WholeFrames::new(source);
    let (can_wait, records) = (source.can_wait(), tap.is_some());
    // After the recording: that has the pictures themselves.
    let mut posed = source.compounding().map(Posed::new);
    let _guard = EndOnPanic(shared);
    let mut left_out_before = 0;
    while !shared.stop.load(Ordering::Relaxed) {
        let event = source.next(PATIENCE);
        let at = Instant::now();
        shared.set_disconnected(source.disconnected());
        let is_frame = matches!(event, Event::Frame(_));
        if records && is_frame && tap.is_none() {
            shared.count(|counts| counts.unrecorded += 1);
        }
        if let Some(Err(fault)) = tap.as_mut().map(|tap| tap.write(&event, at)) {
            // Without a file the recording ends. A frame that cannot be written does not prevent the next; failures in a row are
            // reported once.
            shared.count(|counts| counts.unrecorded += 1);
            let ends = matches!(event, Event::Begin(_));
            let is_reported = tap.as_mut().is_some_and(|tap| std::mem::replace(&mut tap.is_failing, true));
            tap = tap.filter(|_| !ends);
            if !is_reported {
                let what = if ends { "the recording ends" } else { "the recording lacks a frame" };
                shared.put(Arrived { event: Event::Fault(format!("{what}: {fault}")), at }, can_wait);
            }
        } else if let Some(tap) = tap.as_mut().filter(|_| is_frame) {
            tap.is_failing = false;
        }
        let ends = matches!(event, Event::End(_));
        if ends && let Some(Err(fault)) = tap.take().map(|mut tap| tap.finish()) {
            shared.put(Arrived { event: Event::Fault(format!("the recording has no index: {fault}")), at }, can_wait);
        }
        let events = match &mut posed {
            Some(posed) => posed.take(event),
            None => vec![event],
        };
        let left_out = source.left_out() + posed.as_ref().map_or(0, Posed::lost);
        if left_out != left_out_before {
            shared.count(|counts| counts.left_out = left_out);
            left_out_before = left_out;
        }
        for event in events.into_iter().filter(|event| !matches!(event, Event::Idle)) {
            observer.iter_mut().for_each(|observer| observer(&event));
            shared.put(Arrived { event, at }, can_wait);
        }
        if ends {
            return;
        }
    }
    if let Some(Err(fault)) = tap.map(|mut tap| tap.finish()) {
        tracing::warn!("the recording has no index: {fault}");
    }
}

/// Reports the end of the source if its thread panics.
struct EndOnPanic<'a>(&'a Shared);

impl Drop for EndOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let event = Event::End(Some("the source panicked".into()));
            self.0.put(Arrived { event, at: Instant::now() }, false);
        }
    }
}

/// Writes what arrives to `.frames` files, one for each geometry.
struct RecordingTap {
    path: PathBuf,
    /// Number of file names tried so far.
    files: u32,
    writer: Option<Writer>,
    header: Option<Header>,
    /// The last frame could not be written.
    is_failing: bool,
}

impl RecordingTap {
    fn new(path: &Path) -> RecordingTap {
        RecordingTap { path: path.into(), files: 0, writer: None, header: None, is_failing: false }
    }

    /// Writes a frame, or begins the next file.
    ///
    /// # Errors
    /// A file that cannot be created, or a frame that cannot be written. The next frame may succeed.
    fn write(&mut self, event: &Event, at: Instant) -> Result<(), String> {
        // Readers of a recording use differences only, so any steady clock will do.
        static BEGAN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        let seconds = at.saturating_duration_since(*BEGAN.get_or_init(|| at)).as_secs_f64();
        match event {
            Event::Begin(header) if self.header.as_ref() != Some(header) => {
                self.finish()?;
                let path = self.free_name();
                self.writer = Some(Writer::create(&path, (**header).clone()).map_err(|e| e.to_string())?);
                self.header = Some((**header).clone());
                Ok(())
            }
            Event::Frame(frame) => {
                self.writer.as_mut().map_or(Ok(()), |w| w.frame(frame, seconds)).map_err(|e| e.to_string())
            }
            _ => Ok(()),
        }
    }

    /// The given name for the first file, then the name with the next number that is free: no recording is overwritten.
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

    /// Ends the current file, if there is one, with its index.
    fn finish(&mut self) -> Result<(), String> {
        self.writer.take().map_or(Ok(()), Writer::finish).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Frame;

    /// Volumes of three frames, as fast as they are asked for.
    struct FastSource {
        next: u32,
        frames: u32,
        bytes: usize,
        waits: bool,
    }

    impl Live for FastSource {
        fn next(&mut self, _: Duration) -> Event {
            if self.next == self.frames {
                return Event::End(None);
            }
            let number = self.next;
            self.next += 1;
            Event::Frame(Frame {
                volume: number / 3,
                number: number % 3,
                slice: (number % 3) as usize,
                backward: false,
                time: None,
                pose: None,
                bytes: vec![0; self.bytes],
            })
        }

        fn can_wait(&self) -> bool {
            self.waits
        }
    }

    fn all(feed: &Feed, pause: Duration) -> Vec<u32> {
        let mut numbers = Vec::new();
        loop {
            match feed.next(Duration::from_secs(20)).map(|a| a.event) {
                Some(Event::Frame(frame)) => numbers.push(3 * frame.volume + frame.number),
                Some(Event::End(_)) | None => return numbers,
                _ => {}
            }
            std::thread::sleep(pause);
        }
    }

    #[test]
    fn a_source_that_can_wait_loses_nothing() {
        let source = FastSource { next: 0, frames: 30, bytes: MAX_BYTES / 4, waits: true };
        let feed = Feed::new(Box::new(source), None).expect("thread");
        assert_eq!(all(&feed, Duration::from_millis(1)), (0..30).collect::<Vec<_>>());
        assert_eq!(feed.counts(), FeedCounts::default());
    }

    #[test]
    fn a_source_that_cannot_wait_loses_the_rest_of_a_volume_and_memory_stays_bounded() {
        let source = FastSource { next: 0, frames: 30, bytes: MAX_BYTES / 4, waits: false };
        let feed = Feed::new(Box::new(source), None).expect("thread");
        let begun = Instant::now();
        while feed.counts().lost == 0 {
            assert!(locked(&feed.shared.queue).bytes <= MAX_BYTES);
            assert!(begun.elapsed() < Duration::from_secs(60), "nothing is lost");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(locked(&feed.shared.queue).bytes <= MAX_BYTES);
        let came = all(&feed, Duration::ZERO);
        assert_eq!(came.len() as u64 + feed.counts().lost, 30);
        for pair in came.windows(2).filter(|w| w[0] + 1 != w[1]) {
            assert_eq!(pair[1] % 3, 0, "what follows a gap begins a volume: {came:?}");
        }
    }

    #[test]
    fn a_full_queue_keeps_the_newest_volume() {
        let source = FastSource { next: 0, frames: 30, bytes: MAX_BYTES / 8, waits: false };
        let feed = Feed::new(Box::new(source), None).expect("thread");
        let begun = Instant::now();
        while !locked(&feed.shared.queue).events.back().is_some_and(|last| matches!(last.event, Event::End(_))) {
            assert!(begun.elapsed() < Duration::from_secs(60), "the source does not end");
            std::thread::sleep(Duration::from_millis(1));
        }
        let came = all(&feed, Duration::ZERO);
        assert_eq!(came, (24..30).collect::<Vec<_>>());
        assert_eq!(feed.counts().lost, 24);
    }

    #[test]
    fn a_feed_that_is_dropped_ends_its_source() {
        let source = FastSource { next: 0, frames: u32::MAX, bytes: 1 << 20, waits: true };
        let begun = Instant::now();
        drop(Feed::new(Box::new(source), None).expect("thread"));
        assert!(begun.elapsed() < Duration::from_secs(10));
    }
}
