//! Supervises the source of the view: opens it in a background thread, because a network may be slow, and opens it again when it ends.

use crate::gpu::Wake;
use crate::live::Feed;
use crate::source::live::{Live, SourceKind};
use crate::texts;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// A function that opens a source, or returns in one line why it cannot.
pub type OpenSource = Arc<dyn Fn() -> Result<Box<dyn Live>, String> + Send + Sync>;

/// A message about a source: its title, its text, and true if it is a fault.
pub(super) type SourceNotice = (&'static str, String, bool);

/// Whether the source is being opened, is open, or has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum SourceState {
    Opening,
    Open,
    /// The source ended or could not be opened for the given reason, and will be opened again.
    Retrying(String),
    /// The source ended for good; the reason if that was not expected.
    Ended(Option<String>),
    /// The user cancelled the opening of the source.
    Cancelled,
}

impl SourceState {
    /// The message about a source of this kind; None if there is none. `disconnected`: why it is not connected. `is_silent`: no frame arrived
    /// for a while although the program could have taken one. `has_shown`: at least one volume was shown.
    pub(super) fn notice(
        &self,
        kind: SourceKind,
        disconnected: Option<&str>,
        is_silent: bool,
        has_shown: bool,
    ) -> Option<SourceNotice> {
        use SourceKind::{Demo, Pipe, Probe, Recording};
        let silent_pipe = (texts::NO_FRAMES_ON_STANDARD_INPUT, texts::NO_FRAMES_ON_STANDARD_INPUT_ABOUT);
        let silent_probe = (texts::NO_FRAMES_FROM_THE_PROBE, texts::NO_FRAMES_FROM_THE_PROBE_ABOUT);
        // Files and the phantom are read by this program: if they take long, it is busy.
        let (waiting, again, silent) = match kind {
            Demo => (texts::COMPUTING_DEMO_DATA, texts::NO_DEMO_DATA, None),
            Recording => (texts::READING_RECORDING, texts::RECORDING_NOT_OPENED, None),
            Pipe => (texts::WAITING_FOR_STANDARD_INPUT, texts::STANDARD_INPUT_NOT_READ, Some(silent_pipe)),
            Probe => (texts::CONNECTING_TO_PROBE, texts::NO_PROBE, Some(silent_probe)),
        };
        let (title, text, is_fault) = match self {
            SourceState::Opening => (waiting, "", false),
            SourceState::Retrying(why) => (again, why.as_str(), true),
            SourceState::Cancelled => (texts::READING_CANCELLED, texts::READING_CANCELLED_ABOUT, false),
            SourceState::Ended(why) => (texts::SOURCE_ENDED, why.as_deref()?, true),
            SourceState::Open => match (disconnected, silent.filter(|_| is_silent)) {
                (Some(why), _) => (texts::NOT_CONNECTED, why, true),
                (None, Some((title, about))) => (title, about, true),
                (None, None) if !has_shown => (waiting, "", false),
                (None, None) => return None,
            },
        };
        Some((title, text.into(), is_fault))
    }
}

/// Opens a source on a thread, and again after it has ended.
pub(super) struct SourceSupervisor {
    open: OpenSource,
    /// Time between two attempts; `None`: there is only one.
    retry: Option<Duration>,
    record: Option<PathBuf>,
    wake: Wake,
    pub(super) state: SourceState,
    opening: Option<Receiver<Result<Box<dyn Live>, String>>>,
    /// When [`SourceSupervisor::poll`] has to be called even without an event; None if an event comes first.
    pub(super) next_attempt: Option<Instant>,
    /// How often the source could not be opened.
    pub(super) not_opened: u64,
    /// The reason that was logged last; each is logged once.
    logged: Option<String>,
}

impl SourceSupervisor {
    /// `open`: opens the source. `retry`: time after which a source that ended is opened again; `None`: it is not. `record`: path of a file to
    /// which all frames are recorded.
    pub(super) fn new(
        open: OpenSource,
        retry: Option<Duration>,
        record: Option<PathBuf>,
        wake: Wake,
    ) -> SourceSupervisor {
        SourceSupervisor {
            open,
            retry,
            record,
            wake,
            state: SourceState::Opening,
            opening: None,
            next_attempt: Some(Instant::now()),
            not_opened: 0,
            logged: None,
        }
    }

    /// The source, if it was opened since the last call; otherwise None.
    pub(super) fn poll(&mut self, now: Instant) -> Option<Feed> {
        if self.next_attempt.is_some_and(|at| now >= at) {
            self.next_attempt = None;
            self.start_opening(now);
        }
        let opened = match self.opening.as_ref()?.try_recv() {
            Ok(opened) => opened,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err(texts::WHY_SOURCE_PANICKED.into()),
        };
        self.opening = None;
        let feed = opened.and_then(|source| {
            // Each source gets its own file: none is overwritten.
            let record = self.record.as_deref().map(unused_name);
            let feed = Feed::observed(source, record.as_deref(), Some(self.wake.clone()), None);
            feed.map_err(texts::why_no_thread_for_source)
        });
        let feed = feed.map_err(|why| self.cannot_open(why, now)).ok()?;
        self.state = SourceState::Open;
        if self.logged.take().is_some() {
            tracing::info!("source: it is open now");
        }
        Some(feed)
    }

    /// Cancels the opening of the source. Returns false if it is not being opened.
    pub(super) fn cancel(&mut self) -> bool {
        let is_opening = self.opening.take().is_some();
        if is_opening {
            self.state = SourceState::Cancelled;
        }
        is_opening
    }

    /// Notes that the source ended. `why`: the reason, if that was not expected.
    pub(super) fn ended(&mut self, why: Option<String>, now: Instant) {
        match self.retry {
            Some(retry) => {
                self.next_attempt = Some(now + retry);
                self.state = SourceState::Retrying(why.unwrap_or(texts::WHY_SOURCE_ENDED.into()));
            }
            None => self.state = SourceState::Ended(why),
        }
    }

    /// The source could not be opened. Without another attempt that is what the program ends with, and the log need not have it.
    fn cannot_open(&mut self, why: String, now: Instant) {
        self.not_opened += 1;
        if self.retry.is_some() && self.logged.as_ref() != Some(&why) {
            tracing::warn!("source: {why}; trying again");
            self.logged = Some(why.clone());
        }
        self.ended(Some(why), now);
    }

    fn start_opening(&mut self, now: Instant) {
        let (sender, opening) = channel();
        let (open, wake) = (self.open.clone(), self.wake.clone());
        let work = move || {
            // The receiver may be gone.
            let _ = sender.send(open());
            wake();
        };
        match std::thread::Builder::new().name("opening".into()).spawn(work) {
            Ok(_) => self.opening = Some(opening),
            Err(e) => self.cannot_open(texts::why_no_thread(e), now),
        }
        // The reason stays visible until the source is open.
        if !matches!(self.state, SourceState::Retrying(_)) {
            self.state = SourceState::Opening;
        }
    }
}

/// A file name that does not exist yet: NAME.frames, NAME-2.frames ...
fn unused_name(file: &Path) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let name = |n: u32| match n {
        1 => file.to_path_buf(),
        n => file.with_file_name(format!("{stem}-{n}.frames")),
    };
    (1..u32::MAX).map(name).find(|name| !name.exists()).unwrap_or_else(|| file.to_path_buf())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::live::Event;
    use std::sync::atomic::{AtomicU32, Ordering};

    struct Silent;

    impl Live for Silent {
        fn next(&mut self, patience: Duration) -> Event {
            std::thread::sleep(patience);
            Event::Idle
        }

        fn can_wait(&self) -> bool {
            true
        }
    }

    fn poll(supervisor: &mut SourceSupervisor, ahead: Duration) -> bool {
        let begun = Instant::now();
        loop {
            if supervisor.poll(Instant::now() + ahead).is_some() {
                return true;
            }
            if supervisor.opening.is_none() || begun.elapsed() > Duration::from_secs(20) {
                return false;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_missing_source_is_retried_until_it_opens() {
        let tries = Arc::new(AtomicU32::new(0));
        let counted = tries.clone();
        let open: OpenSource = Arc::new(move || match counted.fetch_add(1, Ordering::Relaxed) {
            0 | 1 => Err("no probe".into()),
            _ => Ok(Box::new(Silent)),
        });
        let mut supervisor = SourceSupervisor::new(open, Some(Duration::from_secs(5)), None, Arc::new(|| ()));
        assert!(!poll(&mut supervisor, Duration::ZERO));
        assert_eq!(supervisor.state, SourceState::Retrying("no probe".into()));
        // Not before the interval has passed.
        assert!(!poll(&mut supervisor, Duration::ZERO));
        assert_eq!((tries.load(Ordering::Relaxed), supervisor.not_opened), (1, 1));
        assert!(!poll(&mut supervisor, Duration::from_secs(6)));
        assert!(poll(&mut supervisor, Duration::from_secs(12)));
        assert_eq!(supervisor.state, SourceState::Open);
        supervisor.ended(None, Instant::now());
        assert_eq!(supervisor.state, SourceState::Retrying("the source ended".into()));
        assert!(poll(&mut supervisor, Duration::from_secs(6)));
        assert_eq!(supervisor.not_opened, 2);
    }

    #[test]
    fn a_notice_names_what_is_missing() {
        let title = |kind: SourceKind, state: &SourceState, gone: Option<&str>, is_silent, has_shown| {
            state.notice(kind, gone, is_silent, has_shown).map(|(title, ..)| title)
        };
        let missing = SourceState::Retrying("a.mha: no such file".into());
        for kind in [SourceKind::Demo, SourceKind::Recording, SourceKind::Pipe] {
            assert!(
                title(kind, &missing, None, false, false).is_some_and(|title| !title.contains("probe")),
                "{kind:?}"
            );
        }
        assert_eq!(title(SourceKind::Probe, &missing, None, false, true), Some("No probe: trying again"));
        let (open, silent) = (SourceState::Open, true);
        assert_eq!(title(SourceKind::Probe, &open, None, silent, true), Some("No frames from the probe"));
        assert_eq!(title(SourceKind::Recording, &open, None, silent, true), None, "the program itself reads it");
        let why = "cannot connect: the connection was refused: no server listens at localhost:1";
        let refused = open.notice(SourceKind::Probe, Some(why), silent, true);
        assert!(refused.is_some_and(|(title, text, is_fault)| is_fault && !title.contains("frames") && text == why));
        assert_eq!(title(SourceKind::Probe, &open, None, false, true), None);
    }

    #[test]
    fn without_a_retry_the_end_is_final() {
        let mut supervisor = SourceSupervisor::new(Arc::new(|| Ok(Box::new(Silent))), None, None, Arc::new(|| ()));
        assert!(poll(&mut supervisor, Duration::ZERO));
        supervisor.ended(Some("cut".into()), Instant::now());
        assert_eq!(supervisor.state, SourceState::Ended(Some("cut".into())));
        assert!(!poll(&mut supervisor, Duration::from_secs(100)) && supervisor.next_attempt.is_none());
    }

    #[test]
    fn a_source_that_is_being_opened_can_be_left() {
        let (open, gate) = channel::<()>();
        let gate = std::sync::Mutex::new(gate);
        let waits: OpenSource = Arc::new(move || {
            let _ = gate.lock().map(|gate| gate.recv());
            Ok(Box::new(Silent))
        });
        let mut supervisor = SourceSupervisor::new(waits, None, None, Arc::new(|| ()));
        assert!(!supervisor.cancel(), "nothing has begun");
        assert!(supervisor.poll(Instant::now()).is_none() && supervisor.cancel());
        drop(open);
        assert!(!poll(&mut supervisor, Duration::from_secs(100)) && supervisor.state == SourceState::Cancelled);
        let notice = supervisor.state.notice(SourceKind::Recording, None, false, false);
        assert_eq!(notice, Some(("Reading was cancelled", "Ctrl+O opens a recording.".into(), false)));
    }

    #[test]
    fn a_panic_while_opening_is_a_fault() {
        let mut supervisor =
            SourceSupervisor::new(Arc::new(|| panic!("injected")), Some(Duration::from_secs(1)), None, Arc::new(|| ()));
        assert!(!poll(&mut supervisor, Duration::ZERO));
        assert!(matches!(supervisor.state, SourceState::Retrying(_)));
    }
}
