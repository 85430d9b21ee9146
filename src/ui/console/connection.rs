//! The source of the console: whether it is open, connected or silent.

use crate::live::Feed;
use crate::silence::Silence;
use crate::source::live::SourceKind;
use crate::source_supervisor::{SourceNotice, SourceState, SourceSupervisor};
use std::time::{Duration, Instant};

/// The source of frames, and what is known about its connection.
pub(super) struct Connection {
    /// Opens the source, and opens it again after a failure.
    pub(super) source: SourceSupervisor,
    pub(super) kind: SourceKind,
    /// How long a live source has sent nothing.
    pub(super) silence: Silence,
    /// The reason shown last why the source is not connected.
    disconnected: Option<String>,
    /// Number of frames received.
    frames: u64,
    /// When a probe or a pipe ended for good.
    ended: Option<Instant>,
}

impl Connection {
    pub(super) fn new(source: SourceSupervisor, kind: SourceKind, now: Instant) -> Connection {
        Connection { source, kind, silence: Silence::new(now), disconnected: None, frames: 0, ended: None }
    }

    pub(super) fn is_opening(&self) -> bool {
        self.source.state == SourceState::Opening
    }

    pub(super) fn is_open(&self) -> bool {
        matches!(self.source.state, SourceState::Open)
    }

    /// True if the source ended for good.
    pub(super) fn is_over(&self) -> bool {
        matches!(self.source.state, SourceState::Ended(_))
    }

    /// Time since a probe or a pipe ended for good, since when the picture is not live; None if it has not.
    pub(super) fn ended_for(&self, now: Instant) -> Option<Duration> {
        self.ended.map(|at| now.saturating_duration_since(at))
    }

    /// The reason why the source could not be opened; None if it was.
    pub(super) fn fault(&self) -> Option<String> {
        match &self.source.state {
            SourceState::Ended(why) if self.source.not_opened > 0 => why.clone(),
            _ => None,
        }
    }

    /// The source, if it was opened since the last call. It is dropped if `is_wanted` is false.
    pub(super) fn poll(&mut self, is_wanted: bool, now: Instant) -> Option<Feed> {
        let feed = self.source.poll(now).filter(|_| is_wanted);
        if feed.is_some() {
            self.silence.frames_came(now);
        }
        feed
    }

    /// Notes the number of frames received so far, and the reason why the source is not connected, if it is not. Returns true if the reason
    /// changed.
    pub(super) fn follow(&mut self, frames: u64, disconnected: Option<String>, now: Instant) -> bool {
        if frames != self.frames {
            self.frames = frames;
            self.silence.frames_came(now);
        }
        let is_other = disconnected != self.disconnected;
        self.disconnected = disconnected;
        is_other
    }

    /// Notes that the source ended. `why`: the fault, if that was not expected.
    pub(super) fn ended(&mut self, why: Option<String>, now: Instant) {
        if let Some(why) = &why {
            tracing::warn!("source: {why}");
        }
        self.source.ended(why, now);
        self.ended = Some(now).filter(|_| self.is_live() && self.is_over());
    }

    /// True if the source is a probe or a pipe.
    pub(super) fn is_live(&self) -> bool {
        matches!(self.kind, SourceKind::Pipe | SourceKind::Probe)
    }

    /// The message about the source, if there is one. `disconnected`: why it is not connected. `has_shown`: at least one volume was shown.
    pub(super) fn notice(
        &self,
        disconnected: Option<&str>,
        is_frozen: bool,
        has_shown: bool,
        now: Instant,
    ) -> Option<SourceNotice> {
        let is_silent = self.silence.is_silent(now) && !is_frozen;
        self.source.state.notice(self.kind, disconnected, is_silent, has_shown)
    }

    /// Times at which the connection has to be polled again.
    pub(super) fn due(&self, is_frozen: bool, now: Instant) -> impl Iterator<Item = Instant> {
        let is_listening = self.is_open() && !is_frozen;
        let silence = Some(self.silence.due()).filter(|at| is_listening && *at > now);
        self.source.next_attempt.into_iter().chain(silence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::live::{Event, Live};
    use std::sync::mpsc::channel;
    use std::sync::{Arc, Barrier};

    struct Silent;

    impl Live for Silent {
        fn next(&mut self, patience: Duration) -> Event {
            std::thread::park_timeout(patience);
            Event::Idle
        }

        fn can_wait(&self) -> bool {
            true
        }
    }

    /// Prevents a probe that is silent unnoticed, and a picture that the user froze called silent.
    #[test]
    fn an_open_source_is_silent_after_three_seconds_without_frames() {
        let (sender, woken) = channel();
        let wake = Arc::new(move || _ = sender.send(()));
        // It opens once it was looked at.
        let may_open = Arc::new(Barrier::new(2));
        let waiting = may_open.clone();
        let open = Arc::new(move || {
            waiting.wait();
            Ok(Box::new(Silent) as Box<dyn Live>)
        });
        let now = Instant::now();
        let mut source = Connection::new(SourceSupervisor::new(open, None, None, wake), SourceKind::Probe, now);
        assert!(source.is_opening() && source.poll(true, Instant::now()).is_none());
        may_open.wait();
        woken.recv().expect("opened");
        let now = Instant::now();
        assert!(source.poll(true, now).is_some() && source.is_open());
        let at = |ms: u64| now + Duration::from_millis(ms);
        let says =
            |source: &Connection, is_frozen, ms| source.notice(None, is_frozen, true, at(ms)).map(|notice| notice.2);
        assert_eq!(says(&source, false, 2999), None);
        assert_eq!(says(&source, false, 3000), Some(true));
        assert_eq!(says(&source, true, 3000), None, "frozen");
        assert_eq!(source.due(false, now).collect::<Vec<_>>(), [at(3000)]);
        assert_eq!(source.due(true, now).count() + source.due(false, at(3000)).count(), 0);
        assert!(!source.follow(1, None, at(2000)));
        assert_eq!(says(&source, false, 3000), None, "a frame came");
        assert!(source.follow(1, Some("cable".into()), at(2000)) && !source.follow(1, Some("cable".into()), at(2000)));
        assert_eq!(source.ended_for(at(9000)), None);
        source.ended(Some("gone".into()), at(9000));
        assert!(source.is_over() && source.fault().is_none(), "it was open before");
        assert_eq!(source.ended_for(at(14_000)), Some(Duration::from_secs(5)), "nothing is live any more");
    }
}
