//! How long a message takes that has not ended: a peer that sends or reads a byte a second is not silent.

use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

/// The least rate of a message that takes longer than its time-out, bytes a second.
const LEAST_RATE: f64 = 1e6;

/// Longest time of a message of `length` bytes, from its first byte to its last: the time-out, and a second for each megabyte.
pub(super) fn longest(timeout: Duration, length: usize) -> Duration {
    timeout + Duration::from_secs_f64(length as f64 / LEAST_RATE)
}

/// True if the peer was only not ready within the time-out of the socket, or a signal came.
pub(super) fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

/// Time at which the message that is being received began; None between messages.
#[derive(Default)]
pub(super) struct Begun(Option<Instant>);

impl Begun {
    /// True if the message that is being received takes longer than `most`. `has_begun`: bytes of it have arrived.
    pub(super) fn is_late(&mut self, has_begun: bool, now: Instant, most: Duration) -> bool {
        self.0 = self.0.or(Some(now)).filter(|_| has_begun);
        self.0.is_some_and(|since| now.saturating_duration_since(since) > most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a peer that keeps its place for ever by a byte a second. One that is silent between messages only listens.
    #[test]
    fn a_message_has_a_time_to_end_and_silence_has_none() {
        let (start, most, mut begun) = (Instant::now(), Duration::from_secs(10), Begun::default());
        let at = |seconds: u64| start + Duration::from_secs(seconds);
        assert!((0..100).all(|second| !begun.is_late(false, at(second), most)));
        assert!((100..=110).all(|second| !begun.is_late(true, at(second), most)));
        assert!(begun.is_late(true, at(111), most));
        assert!(!begun.is_late(false, at(112), most) && !begun.is_late(true, at(113), most), "another message");
    }
}
