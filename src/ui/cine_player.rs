//! Plays the volumes of a cine loop: a part of it, at a speed, in one direction or back and forth. Pure: the volumes and the clock are passed in.

use crate::live::cine::CineVolume;
use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

/// The speeds, as multiples of that of the acquisition.
pub(super) const SPEEDS: [f64; 7] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// The index of 1 in them.
const NORMAL: i32 = 3;
/// Time from a volume to the next where their time stamps do not say it, s.
const UNKNOWN_INTERVAL: f64 = 0.2;
/// Intervals that time stamps can state, s. Longer ones are pauses of the acquisition.
const INTERVALS: RangeInclusive<f64> = 1e-3..=5.0;

/// What is played, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CinePlayer {
    /// When the next volume is due, while the loop plays.
    next: Option<Instant>,
    /// Steps along [`SPEEDS`] from the speed of the acquisition.
    speed: i32,
    goes_back_and_forth: bool,
    is_backwards: bool,
    /// Numbers of the first and the last volume that are played. The loop may lose volumes meanwhile.
    marks: [Option<u32>; 2],
}

/// What the panel shows of a loop.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CineState {
    /// Number of volumes.
    pub(super) count: usize,
    /// Index of the volume that is shown.
    pub(super) shown: Option<usize>,
    /// Indices of the volumes that are played.
    pub(super) range: RangeInclusive<usize>,
    pub(super) is_trimmed: bool,
    pub(super) is_playing: bool,
    pub(super) speed: f64,
    pub(super) goes_back_and_forth: bool,
    /// Time of the shown volume after the first of the loop, s.
    pub(super) seconds: Option<f64>,
    /// Volumes a second as they were acquired, of the part that is played.
    pub(super) rate: Option<f64>,
}

impl CinePlayer {
    pub(super) fn is_playing(&self) -> bool {
        self.next.is_some()
    }

    /// When the next volume is due.
    pub(super) fn due(&self) -> Option<Instant> {
        self.next
    }

    pub(super) fn stop(&mut self) {
        self.next = None;
    }

    /// Plays from `now` on, or stops.
    pub(super) fn toggle(&mut self, volumes: &VecDeque<CineVolume>, now: Instant) {
        self.next = match self.next {
            None if self.range(volumes).count() > 1 => Some(now),
            _ => None,
        };
    }

    /// Moves so many steps along [`SPEEDS`].
    pub(super) fn step_speed(&mut self, by: i32) {
        self.speed = self.speed.saturating_add(by).clamp(-NORMAL, SPEEDS.len() as i32 - 1 - NORMAL);
    }

    fn speed(&self) -> f64 {
        SPEEDS[(NORMAL + self.speed) as usize]
    }

    pub(super) fn set_back_and_forth(&mut self, on: bool) {
        (self.goes_back_and_forth, self.is_backwards) = (on, false);
    }

    /// The loop begins (`end` false) or ends with this volume. A mark that leaves nothing takes the other one away.
    pub(super) fn mark(&mut self, volumes: &VecDeque<CineVolume>, index: usize, end: bool) {
        let Some(volume) = volumes.get(index) else { return };
        self.marks[usize::from(end)] = Some(volume.volume);
        if let [Some(first), Some(last)] = self.marks
            && first > last
        {
            self.marks[usize::from(!end)] = None;
        }
    }

    /// Plays the complete loop again.
    pub(super) fn unmark(&mut self) {
        self.marks = [None; 2];
    }

    /// Indices of the volumes between the marks; of all where none of them is left.
    pub(super) fn range(&self, volumes: &VecDeque<CineVolume>) -> RangeInclusive<usize> {
        let [first, last] = self.marks;
        let all = 0..=volumes.len().saturating_sub(1);
        let low = first.map_or(Some(0), |first| volumes.iter().position(|v| v.volume >= first));
        let high = last.map_or(Some(*all.end()), |last| volumes.iter().rposition(|v| v.volume <= last));
        match (low, high) {
            (Some(low), Some(high)) if low <= high => low..=high,
            _ => all,
        }
    }

    /// The next volume to show, if one is due.
    pub(super) fn advance(
        &mut self,
        volumes: &VecDeque<CineVolume>,
        shown: Option<usize>,
        now: Instant,
    ) -> Option<usize> {
        let due = self.next.filter(|due| now >= *due)?;
        let range = self.range(volumes);
        let (low, high) = (*range.start(), *range.end());
        if low >= high {
            self.next = None;
            return None;
        }
        let Some(at) = shown.filter(|at| range.contains(at)) else {
            self.is_backwards = false;
            return self.show(volumes, low, (due, now));
        };
        self.is_backwards = match self.goes_back_and_forth {
            true if at == low => false,
            true if at == high => true,
            true => self.is_backwards,
            false => false,
        };
        let next = match self.is_backwards {
            true => at - 1,
            false if at == high => low,
            false => at + 1,
        };
        self.show(volumes, next, (due, now))
    }

    /// Shows a volume for as long as it lasted.
    fn show(&mut self, volumes: &VecDeque<CineVolume>, index: usize, (due, now): (Instant, Instant)) -> Option<usize> {
        let range = self.range(volumes);
        // The last lasts as long as the one before it: nothing follows it.
        let from = if self.is_backwards { index.saturating_sub(1) } else { index };
        let from = from.clamp(*range.start(), range.end().saturating_sub(1));
        let seconds = interval(volumes, from).unwrap_or(UNKNOWN_INTERVAL) / self.speed();
        // Time that was lost is not caught up.
        self.next = Some((due + Duration::from_secs_f64(seconds)).max(now));
        Some(index)
    }

    pub(super) fn state(&self, volumes: &VecDeque<CineVolume>, shown: Option<usize>) -> CineState {
        let range = self.range(volumes);
        // A recording or the phantom that is played again begins its time stamps again: nothing states how long that took.
        let step = |n: usize| Some((begins(volumes.get(n + 1)?)? - begins(volumes.get(n)?)?).max(0.0));
        let since = |index: usize| -> Option<f64> {
            begins(volumes.get(index)?)?;
            (0..index).map(step).try_fold(0.0, |sum, step| Some(sum + step?))
        };
        // A rate that some of the volumes do not state would be a guess.
        let has_times = range.clone().all(|index| volumes.get(index).and_then(begins).is_some());
        let intervals = (*range.start()..*range.end()).filter_map(|index| interval(volumes, index));
        let intervals = Some(intervals.collect::<Vec<f64>>()).filter(|known| has_times && !known.is_empty());
        CineState {
            count: volumes.len(),
            shown,
            is_trimmed: range.clone().count() < volumes.len(),
            range,
            is_playing: self.is_playing(),
            speed: self.speed(),
            goes_back_and_forth: self.goes_back_and_forth,
            seconds: shown.and_then(since).filter(|s| s.is_finite() && *s >= 0.0),
            rate: intervals.map(|intervals| intervals.len() as f64 / intervals.iter().sum::<f64>()),
        }
    }

    /// Volumes a second as they are played.
    pub(super) fn played_rate(&self, volumes: &VecDeque<CineVolume>) -> f64 {
        self.state(volumes, None).rate.unwrap_or(1.0 / UNKNOWN_INTERVAL) * self.speed()
    }
}

/// When a volume begins, s on the clock of its device.
fn begins(volume: &CineVolume) -> Option<f64> {
    volume.frames.iter().filter_map(|frame| frame.time).filter(|time| time.is_finite()).min_by(f64::total_cmp)
}

/// Time from a volume to the next, s, if their time stamps state one.
fn interval(volumes: &VecDeque<CineVolume>, index: usize) -> Option<f64> {
    let (this, next) = (begins(volumes.get(index)?)?, begins(volumes.get(index + 1)?)?);
    Some(next - this).filter(|seconds| INTERVALS.contains(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Frame;
    use proptest::prelude::*;
    use std::sync::Arc;

    fn volume(number: u32, time: Option<f64>) -> CineVolume {
        let frame = |k: usize| Frame { time: time.map(|t| t + 0.01 * k as f64), ..Frame::of_slice(number, k, vec![0]) };
        // Swept backwards: in order of the slices, its first frame came last.
        let frames = [frame(1), frame(0)].map(Arc::new).to_vec();
        let mut volume = CineVolume::default();
        (volume.volume, volume.frames) = (number, frames);
        volume
    }

    fn volumes(times: &[Option<f64>]) -> VecDeque<CineVolume> {
        times.iter().zip(7..).map(|(time, number)| volume(number, *time)).collect()
    }

    /// What is shown when, ms after the start, over so many steps.
    fn played(
        player: &mut CinePlayer,
        volumes: &VecDeque<CineVolume>,
        mut shown: Option<usize>,
        steps: usize,
    ) -> Vec<(usize, u128)> {
        let begun = Instant::now();
        let mut now = begun;
        player.toggle(volumes, now);
        let mut seen = Vec::new();
        for _ in 0..steps {
            let Some(due) = player.due() else { break };
            now = now.max(due);
            let Some(index) = player.advance(volumes, shown, now) else { break };
            shown = Some(index);
            seen.push((index, (now - begun).as_micros().div_ceil(1000)));
        }
        seen
    }

    #[test]
    fn volumes_last_as_long_as_they_were_acquired() {
        let loop_of = volumes(&[Some(10.0), Some(10.25), Some(10.35), Some(10.65)]);
        let mut player = CinePlayer::default();
        // The last one has no successor: it lasts as long as the one before.
        let expected = [(0, 0), (1, 250), (2, 350), (3, 650), (0, 950), (1, 1200)];
        assert_eq!(played(&mut player, &loop_of, None, 6), expected);
        let mut fast = CinePlayer::default();
        fast.step_speed(1);
        assert_eq!(played(&mut fast, &loop_of, Some(3), 3), [(0, 0), (1, 125), (2, 175)]);
        let mut slow = CinePlayer::default();
        slow.step_speed(-9);
        assert_eq!(played(&mut slow, &loop_of, None, 2), [(0, 0), (1, 2500)]);
    }

    #[test]
    fn without_times_and_across_pauses_a_volume_lasts_a_fifth_of_a_second() {
        for times in [[None, None, None], [Some(5.0), Some(2.0), None], [Some(0.0), Some(3600.0), Some(f64::NAN)]] {
            let seen = played(&mut CinePlayer::default(), &volumes(&times), None, 4);
            assert_eq!(seen, [(0, 0), (1, 200), (2, 400), (0, 600)], "{times:?}");
        }
    }

    #[test]
    fn back_and_forth_shows_the_ends_once() {
        let mut player = CinePlayer::default();
        player.set_back_and_forth(true);
        let loop_of = volumes(&[Some(0.0), Some(0.1), Some(0.3)]);
        // On the way back a volume lasts as long as the one that it leads to lasted.
        let expected = [(0, 0), (1, 100), (2, 300), (1, 500), (0, 600), (1, 700)];
        assert_eq!(played(&mut player, &loop_of, None, 6), expected);
    }

    #[test]
    fn only_what_is_between_the_marks_is_played() {
        let mut loop_of = volumes(&[None; 6]);
        let mut player = CinePlayer::default();
        player.mark(&loop_of, 2, false);
        player.mark(&loop_of, 4, true);
        let indices = |seen: Vec<(usize, u128)>| seen.into_iter().map(|(index, _)| index).collect::<Vec<_>>();
        assert_eq!(indices(played(&mut player.clone(), &loop_of, Some(0), 5)), [2, 3, 4, 2, 3]);
        let state = player.state(&loop_of, Some(3));
        assert_eq!((state.range, state.is_trimmed, state.count), (2..=4, true, 6));
        // The marks stay on their volumes when the loop moves on.
        loop_of.drain(..3);
        assert_eq!(player.range(&loop_of), 0..=1);
        loop_of.drain(..2);
        assert_eq!(player.range(&loop_of), 0..=0, "none is left: all of them");
        let loop_of = volumes(&[None; 6]);
        player.mark(&loop_of, 5, false);
        assert_eq!(player.range(&loop_of), 5..=5, "the end went");
        player.toggle(&loop_of, Instant::now());
        assert!(!player.is_playing(), "one volume is no loop");
        player.unmark();
        assert_eq!(player.range(&loop_of), 0..=5);
    }

    #[test]
    fn rate_and_time_are_those_of_the_time_stamps() {
        let loop_of = volumes(&[Some(2.0), Some(2.25), Some(2.5), Some(3.0)]);
        let mut player = CinePlayer::default();
        let state = player.state(&loop_of, Some(2));
        assert_eq!((state.seconds, state.rate, state.speed), (Some(0.5), Some(3.0), 1.0));
        player.mark(&loop_of, 2, true);
        player.step_speed(1);
        assert_eq!(player.state(&loop_of, None).rate, Some(4.0));
        assert_eq!(player.played_rate(&loop_of), 8.0);
        let unknown = volumes(&[Some(2.0), None, Some(2.5)]);
        assert_eq!(
            player.state(&unknown, Some(1)),
            CineState { seconds: None, rate: None, ..player.state(&unknown, Some(1)) }
        );
        // Played twice, and with a pause.
        let again = volumes(&[Some(0.0), Some(0.5), Some(1.0), Some(0.0), Some(0.5)]);
        let state = CinePlayer::default().state(&again, Some(4));
        assert_eq!((state.seconds, state.rate), (Some(1.5), Some(2.0)));
        assert_eq!(CinePlayer::default().state(&again, Some(3)).seconds, Some(1.0));
        let paused = volumes(&[Some(0.0), Some(0.5), Some(100.0), Some(100.5)]);
        let state = CinePlayer::default().state(&paused, Some(3));
        assert_eq!((state.seconds, state.rate), (Some(100.5), Some(2.0)));
        let first = CinePlayer::default().state(&again, Some(0)).seconds;
        assert_eq!(first.map(|seconds| format!("{seconds:.1}")), Some("0.0".into()), "not -0.0");
        let none = CinePlayer::default().state(&VecDeque::new(), None);
        assert_eq!((none.count, none.rate, none.is_trimmed), (0, None, false));
    }

    proptest! {
        /// Whatever the marks, the times and the clock: a volume of the range is shown, and the next is not due before.
        #[test]
        fn what_is_shown_is_in_the_range(
            times in prop::collection::vec(prop::option::of(any::<f64>()), 0..7),
            marks in prop::collection::vec((0usize..8, any::<bool>()), 0..3),
            (forth, speed, shown) in (any::<bool>(), -9i32..9, prop::option::of(0usize..9)),
        ) {
            let loop_of = volumes(&times);
            let mut player = CinePlayer::default();
            marks.iter().for_each(|(index, end)| player.mark(&loop_of, *index, *end));
            player.set_back_and_forth(forth);
            player.step_speed(speed);
            let range = player.range(&loop_of);
            let seen = played(&mut player, &loop_of, shown, 12);
            prop_assert!(seen.iter().all(|(index, _)| range.contains(index) && *index < loop_of.len()));
            prop_assert!(seen.windows(2).all(|pair| pair[0].1 <= pair[1].1 && pair[0].0 != pair[1].0));
            prop_assert_eq!(seen.is_empty(), range.clone().count() < 2);
        }
    }
}
