//! A live source on a thread of its own, and what has arrived and not been taken yet: bounded, whole frames or lines in order. Where it
//! overflows a source that can wait is kept waiting, and one that cannot loses frames, which are counted.

use super::recording::RecordingTap;
use crate::gpu::Wake;
use crate::source::live::{Event, Live};
use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Bytes of frames that wait at most, unless a single frame is larger.
const MOST_BYTES: usize = 256 << 20;
/// Frames and other events that wait at most.
const MOST_EVENTS: usize = 4096;
/// How long the thread goes without looking whether it is to end.
const PATIENCE: Duration = Duration::from_millis(50);

/// Something that arrived, and when.
#[derive(Clone, Debug)]
pub struct Arrived {
    pub event: Event,
    pub at: Instant,
}

/// A source that is listened to, or none.
pub struct Feed {
    shared: Arc<Shared>,
    can_wait: bool,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    waiting: Mutex<Waiting>,
    /// Something was put in or taken out.
    moved: Condvar,
    stop: AtomicBool,
    lost: AtomicU64,
    unrecorded: AtomicU64,
    wake: Option<Wake>,
}

#[derive(Default)]
struct Waiting {
    events: VecDeque<Arrived>,
    bytes: usize,
    /// The volume whose frame came last.
    newest: Option<u32>,
    /// Of this volume a frame was lost: the rest of it would be of no use.
    lost_volume: Option<u32>,
}

fn bytes_of(event: &Event) -> usize {
    match event {
        Event::Frame(frame) | Event::Lines { frame, .. } => frame.bytes.len(),
        _ => 0,
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Puts an event behind the others: waits for room, or loses it, and all that is left of its volume with it. What is no frame is
    /// never lost.
    fn put(&self, arrived: Arrived, can_wait: bool) {
        let bytes = bytes_of(&arrived.event);
        let mut waiting = self.lock();
        let is_full =
            |w: &Waiting| !w.events.is_empty() && (w.bytes + bytes > MOST_BYTES || w.events.len() >= MOST_EVENTS);
        if let Event::Frame(frame) | Event::Lines { frame, .. } = &arrived.event {
            while can_wait && is_full(&waiting) && !self.stop.load(Ordering::Relaxed) {
                waiting = self.moved.wait_timeout(waiting, PATIENCE).map_or_else(|e| e.into_inner().0, |w| w.0);
            }
            waiting.newest = Some(frame.volume);
            if is_full(&waiting) {
                waiting.lost_volume = Some(frame.volume);
            }
            if waiting.lost_volume == Some(frame.volume) {
                self.lost.fetch_add(1, Ordering::Relaxed);
                return;
            }
        }
        waiting.bytes += bytes;
        waiting.events.push_back(arrived);
        drop(waiting);
        self.moved.notify_all();
        if let Some(wake) = &self.wake {
            wake();
        }
    }
}

impl Feed {
    /// Listens to a source until it ends or the feed is dropped, and writes every frame to a file of frames where one is given. Another
    /// geometry begins another file: NAME-2.frames.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn new(source: Box<dyn Live>, record: Option<&Path>) -> io::Result<Feed> {
        Feed::waking(source, record, None)
    }

    /// A source that never says anything.
    pub fn none() -> Feed {
        Feed { shared: Arc::default(), can_wait: true, thread: None }
    }

    /// The same as [`Feed::new`], with something to call after each event.
    ///
    /// # Errors
    /// A thread that cannot be started.
    pub fn waking(source: Box<dyn Live>, record: Option<&Path>, wake: Option<Wake>) -> io::Result<Feed> {
        let (shared, can_wait) = (Arc::new(Shared { wake, ..Shared::default() }), source.can_wait());
        let theirs = shared.clone();
        let tape = record.map(RecordingTap::new);
        let thread = std::thread::Builder::new().name("source".into()).spawn(move || listen(source, tape, &theirs))?;
        Ok(Feed { shared, can_wait, thread: Some(thread) })
    }

    /// What came next, waiting for it at most so long.
    pub fn next(&self, patience: Duration) -> Option<Arrived> {
        let mut waiting = self.shared.lock();
        if waiting.events.is_empty() && !patience.is_zero() {
            let woken = self.shared.moved.wait_timeout_while(waiting, patience, |w| w.events.is_empty());
            waiting = woken.map_or_else(|e| e.into_inner().0, |w| w.0);
        }
        let arrived = waiting.events.pop_front()?;
        waiting.bytes -= bytes_of(&arrived.event);
        drop(waiting);
        self.shared.moved.notify_all();
        Some(arrived)
    }

    /// Whether the source loses nothing by being kept waiting.
    pub fn can_wait(&self) -> bool {
        self.can_wait
    }

    /// Frames and other events that wait.
    pub fn waiting(&self) -> usize {
        self.shared.lock().events.len()
    }

    /// Frames that were to be recorded and could not be, and what else went wrong with the recording.
    pub fn unrecorded(&self) -> u64 {
        self.shared.unrecorded.load(Ordering::Relaxed)
    }

    /// Whether a volume that is about to be taken is stale: a whole one has come after it, and the source does not wait.
    pub fn is_behind(&self, volume: u32) -> bool {
        !self.can_wait && self.shared.lock().newest.is_some_and(|newest| newest > volume.saturating_add(1))
    }

    /// Frames, or parts of frames that came line by line, for which there was no room.
    pub fn lost(&self) -> u64 {
        self.shared.lost.load(Ordering::Relaxed)
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.moved.notify_all();
        if let Some(thread) = self.thread.take() {
            // A source that panicked has nothing more to say.
            let _ = thread.join();
        }
    }
}

fn listen(mut source: Box<dyn Live>, mut tape: Option<RecordingTap>, shared: &Shared) {
    let (can_wait, records) = (source.can_wait(), tape.is_some());
    let _ended = Ended(shared);
    while !shared.stop.load(Ordering::Relaxed) {
        let event = source.next(PATIENCE);
        let at = Instant::now();
        let is_frame = matches!(event, Event::Frame(_) | Event::Lines { .. });
        if records && is_frame && tape.is_none() {
            shared.unrecorded.fetch_add(1, Ordering::Relaxed);
        }
        if let Some(Err(fault)) = tape.as_mut().map(|tape| tape.write(&event, at)) {
            // Without a file nothing can be written; a frame that cannot be leaves the next one its chance, and is told of once.
            shared.unrecorded.fetch_add(1, Ordering::Relaxed);
            let ends = matches!(event, Event::Begin(_));
            let told = tape.as_mut().is_some_and(|tape| std::mem::replace(&mut tape.failing, true));
            tape = tape.filter(|_| !ends);
            if !told {
                let what = if ends { "the recording ends" } else { "the recording lacks a frame" };
                shared.put(Arrived { event: Event::Fault(format!("{what}: {fault}")), at }, can_wait);
            }
        } else if let Some(tape) = tape.as_mut().filter(|_| is_frame) {
            tape.failing = false;
        }
        let ends = matches!(event, Event::End(_));
        if ends && let Some(Err(fault)) = tape.take().map(RecordingTap::finish) {
            shared.put(Arrived { event: Event::Fault(format!("the recording has no index: {fault}")), at }, can_wait);
        }
        if !matches!(event, Event::Idle) {
            shared.put(Arrived { event, at }, can_wait);
        }
        if ends {
            return;
        }
    }
    if let Some(Err(fault)) = tape.map(RecordingTap::finish) {
        tracing::warn!("the recording has no index: {fault}");
    }
}

/// Whatever becomes of the thread, its end is told.
struct Ended<'a>(&'a Shared);

impl Drop for Ended<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let event = Event::End(Some("the source broke down".into()));
            self.0.put(Arrived { event, at: Instant::now() }, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Frame;

    /// Frames of two volumes of three, as fast as they are asked for.
    struct Quick {
        next: u32,
        frames: u32,
        bytes: usize,
        waits: bool,
    }

    impl Live for Quick {
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
        let source = Quick { next: 0, frames: 30, bytes: MOST_BYTES / 4, waits: true };
        let feed = Feed::new(Box::new(source), None).expect("thread");
        assert_eq!(all(&feed, Duration::from_millis(1)), (0..30).collect::<Vec<_>>());
        assert_eq!(feed.lost(), 0);
    }

    #[test]
    fn a_source_that_cannot_wait_loses_the_rest_of_a_volume_and_memory_stays_bounded() {
        let source = Quick { next: 0, frames: 30, bytes: MOST_BYTES / 4, waits: false };
        let feed = Feed::new(Box::new(source), None).expect("thread");
        std::thread::sleep(Duration::from_millis(300));
        assert!(feed.shared.lock().bytes <= MOST_BYTES);
        let came = all(&feed, Duration::ZERO);
        assert_eq!(came.len() as u64 + feed.lost(), 30);
        for pair in came.windows(2).filter(|w| w[0] + 1 != w[1]) {
            assert_eq!(pair[1] % 3, 0, "what follows a gap begins a volume: {came:?}");
        }
    }

    #[test]
    fn a_feed_that_is_dropped_ends_its_source() {
        let source = Quick { next: 0, frames: u32::MAX, bytes: 1 << 20, waits: true };
        let begun = Instant::now();
        drop(Feed::new(Box::new(source), None).expect("thread"));
        assert!(begun.elapsed() < Duration::from_secs(10));
    }
}
