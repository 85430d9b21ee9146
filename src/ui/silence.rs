//! Measures how long no frame came from a source, without the time in which the program could not take one.

use std::time::{Duration, Instant};

/// A warning is shown if no frame comes for so long.
const SILENCE: Duration = Duration::from_secs(3);
/// An update that takes so long does not count as silence of the source.
const LONG_UPDATE: Duration = Duration::from_millis(100);

/// Measures for how long a source has delivered no frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Silence {
    /// When the last frame came, plus all the time since that the program was busy.
    last: Instant,
    /// When the previous update ended, if the device was busy then.
    busy_since: Option<Instant>,
}

impl Silence {
    pub(super) fn new(now: Instant) -> Silence {
        Silence { last: now, busy_since: None }
    }

    /// Notes that frames arrived.
    pub(super) fn frames_came(&mut self, now: Instant) {
        self.last = now;
    }

    /// Notes that an update of the console begins. If the device was busy since the previous one, that time does not count as silence.
    pub(super) fn begin_update(&mut self, now: Instant) {
        self.last += self.busy_since.take().map_or(Duration::ZERO, |since| now.saturating_duration_since(since));
    }

    /// Notes that the update that began at `now` took the time `took`, which does not count as silence if it was long. `is_busy`: the device
    /// still works.
    pub(super) fn end_update(&mut self, now: Instant, took: Duration, is_busy: bool) {
        // What takes long here keeps no frame from coming, but from being taken.
        self.last += Some(took).filter(|took| *took >= LONG_UPDATE).unwrap_or_default();
        self.busy_since = is_busy.then_some(now);
    }

    /// True if no frame arrived for so long that a warning is due.
    pub(super) fn is_silent(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.last) >= SILENCE
    }

    /// Time at which a warning becomes due if no frame arrives.
    pub(super) fn due(&self) -> Instant {
        self.last + SILENCE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Updates every 10 ms for so many seconds, the device being busy in this share of them, each taking so long. True if it is silent at the end.
    fn silent_after(seconds: u64, is_busy: impl Fn(u64) -> bool, took: Duration) -> bool {
        let start = Instant::now();
        let (mut silence, mut now) = (Silence::new(start), start);
        let mut n = 0;
        while now < start + Duration::from_secs(seconds) {
            silence.begin_update(now);
            silence.end_update(now, took, is_busy(n));
            now += took.max(Duration::from_millis(10));
            n += 1;
        }
        silence.begin_update(now);
        assert_eq!(silence.is_silent(now), now >= silence.due());
        silence.is_silent(now)
    }

    /// Requirement: no "no frames from the probe" because the program itself was busy.
    #[test]
    fn a_busy_program_is_no_silent_probe_and_an_idle_one_says_so_after_three_seconds() {
        let short = Duration::from_millis(1);
        assert!(!silent_after(2, |_| false, short) && silent_after(4, |_| false, short));
        assert!(!silent_after(60, |_| true, short), "the device was busy all the time");
        assert!(!silent_after(5, |n| n % 2 == 0, short), "half of the time: 2.5 s could have brought a frame");
        assert!(silent_after(8, |n| n % 2 == 0, short), "4 s could have");
        assert!(!silent_after(60, |_| false, Duration::from_millis(700)), "its own updates took the time");
    }

    #[test]
    fn a_frame_begins_the_silence_anew() {
        let start = Instant::now();
        let mut silence = Silence::new(start);
        silence.frames_came(start + Duration::from_secs(10));
        assert!(!silence.is_silent(start + Duration::from_millis(12_900)));
        assert!(silence.is_silent(start + Duration::from_secs(13)));
    }
}
