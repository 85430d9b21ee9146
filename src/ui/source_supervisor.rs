//! The source of the view: opened on a thread, since a network may take its time, and opened again when it ends, for as long as it takes.

use crate::gpu::Wake;
use crate::live::Feed;
use crate::source::live::Live;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Opens a source, or says in one line why not.
pub type Open = Arc<dyn Fn() -> Result<Box<dyn Live>, String> + Send + Sync>;

/// What there is to see of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Condition {
    Opening,
    Open,
    /// It ended or could not be opened, and will be tried again.
    Waiting(String),
    /// It ended, and why if that was not to be expected.
    Over(Option<String>),
}

pub struct SourceSupervisor {
    open: Open,
    /// Between two attempts; none: there is one.
    retry: Option<Duration>,
    record: Option<PathBuf>,
    wake: Wake,
    condition: Condition,
    opening: Option<Receiver<Result<Box<dyn Live>, String>>>,
    next: Option<Instant>,
}

impl SourceSupervisor {
    /// `retry`: how long to wait before it is opened again; none ends with the source. `record`: as of [`Feed::new`].
    pub fn new(open: Open, retry: Option<Duration>, record: Option<PathBuf>, wake: Wake) -> SourceSupervisor {
        SourceSupervisor {
            open,
            retry,
            record,
            wake,
            condition: Condition::Opening,
            opening: None,
            next: Some(Instant::now()),
        }
    }

    pub fn condition(&self) -> &Condition {
        &self.condition
    }

    /// When it has to be looked at again, whatever else happens.
    pub fn wakes_at(&self) -> Option<Instant> {
        self.next
    }

    /// The source, when it has been opened since this was asked last.
    pub fn poll(&mut self, now: Instant) -> Option<Feed> {
        if self.next.is_some_and(|next| now >= next) {
            self.next = None;
            self.begin(now);
        }
        let opened = match self.opening.as_ref()?.try_recv() {
            Ok(opened) => opened,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("opening the source broke down".into()),
        };
        self.opening = None;
        let feed = opened.and_then(|source| {
            // Every source has a file of its own: none is written over.
            let record = self.record.as_deref().map(unused);
            Feed::waking(source, record.as_deref(), Some(self.wake.clone()))
                .map_err(|e| format!("a thread for the source cannot be started: {e}"))
        });
        match feed {
            Ok(feed) => {
                self.condition = Condition::Open;
                Some(feed)
            }
            Err(why) => {
                self.ended(Some(why), now);
                None
            }
        }
    }

    /// The source has nothing more to say, and why if that was not to be expected.
    pub fn ended(&mut self, why: Option<String>, now: Instant) {
        match self.retry {
            Some(retry) => {
                self.next = Some(now + retry);
                self.condition = Condition::Waiting(why.unwrap_or("the source ended".into()));
            }
            None => self.condition = Condition::Over(why),
        }
    }

    fn begin(&mut self, now: Instant) {
        let (tell, opening) = channel();
        let (open, wake) = (self.open.clone(), self.wake.clone());
        let work = move || {
            // Whoever asked may have gone.
            let _ = tell.send(open());
            wake();
        };
        match std::thread::Builder::new().name("opening".into()).spawn(work) {
            Ok(_) => self.opening = Some(opening),
            Err(e) => self.ended(Some(format!("a thread cannot be started: {e}")), now),
        }
        // Why it waited stays to be read until something comes.
        if !matches!(self.condition, Condition::Waiting(_)) {
            self.condition = Condition::Opening;
        }
    }
}

/// A name that nothing has: NAME.frames, NAME-2.frames ...
fn unused(file: &Path) -> PathBuf {
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

    fn poll(supply: &mut SourceSupervisor, ahead: Duration) -> bool {
        let begun = Instant::now();
        loop {
            if supply.poll(Instant::now() + ahead).is_some() {
                return true;
            }
            if supply.opening.is_none() || begun.elapsed() > Duration::from_secs(20) {
                return false;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn a_source_that_is_missing_is_tried_again_until_it_is_there() {
        let tries = Arc::new(AtomicU32::new(0));
        let counted = tries.clone();
        let open: Open = Arc::new(move || match counted.fetch_add(1, Ordering::Relaxed) {
            0 | 1 => Err("no probe".into()),
            _ => Ok(Box::new(Silent)),
        });
        let mut supply = SourceSupervisor::new(open, Some(Duration::from_secs(5)), None, Arc::new(|| ()));
        assert!(!poll(&mut supply, Duration::ZERO));
        assert_eq!(supply.condition(), &Condition::Waiting("no probe".into()));
        // Not before its time.
        assert!(!poll(&mut supply, Duration::ZERO));
        assert_eq!(tries.load(Ordering::Relaxed), 1);
        assert!(!poll(&mut supply, Duration::from_secs(6)));
        assert!(poll(&mut supply, Duration::from_secs(12)));
        assert_eq!(supply.condition(), &Condition::Open);
        supply.ended(None, Instant::now());
        assert_eq!(supply.condition(), &Condition::Waiting("the source ended".into()));
        assert!(poll(&mut supply, Duration::from_secs(6)));
    }

    #[test]
    fn without_a_retry_the_end_is_the_end() {
        let mut supply = SourceSupervisor::new(Arc::new(|| Ok(Box::new(Silent))), None, None, Arc::new(|| ()));
        assert!(poll(&mut supply, Duration::ZERO));
        supply.ended(Some("cut".into()), Instant::now());
        assert_eq!(supply.condition(), &Condition::Over(Some("cut".into())));
        assert!(!poll(&mut supply, Duration::from_secs(100)) && supply.wakes_at().is_none());
    }

    #[test]
    fn an_opener_that_panics_is_a_fault() {
        let mut supply =
            SourceSupervisor::new(Arc::new(|| panic!("planted")), Some(Duration::from_secs(1)), None, Arc::new(|| ()));
        assert!(!poll(&mut supply, Duration::ZERO));
        assert!(matches!(supply.condition(), Condition::Waiting(_)));
    }
}
