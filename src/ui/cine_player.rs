//! Plays the cine loop: a part of it, at a speed, in one direction or back and forth, by its settings. Pure: settings, volumes and the time are
//! passed in.

use crate::live::cine::CineVolume;
use crate::scene::Cine;
use std::collections::VecDeque;
use std::ops::RangeInclusive;
use std::time::{Duration, Instant};

/// The speeds that can be selected, as multiples of the speed of the acquisition.
pub(super) const SPEEDS: [f64; 7] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Time from a volume to the next where their time stamps do not say it, s.
const UNKNOWN_INTERVAL: f64 = 0.2;
/// Intervals that time stamps can state, s. Longer ones are pauses of the acquisition.
const INTERVALS: RangeInclusive<f64> = 1e-3..=5.0;

/// Decides which volume of the cine loop is shown next while it is played, and when.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct CinePlayer {
    /// When the next volume is due; None while the loop does not play.
    pub(super) next: Option<Instant>,
    is_backwards: bool,
}

/// The volumes of the cine loop, and the settings of its playback.
#[derive(Clone, Copy)]
pub(super) struct Loop<'a> {
    pub(super) cine: &'a Cine,
    pub(super) volumes: &'a VecDeque<CineVolume>,
}

/// The speed that is `by` steps along [`SPEEDS`] from `speed`, within their range.
pub(super) fn stepped(speed: f64, by: i32) -> f64 {
    let last = SPEEDS.len() as i32 - 1;
    let at = match by >= 0 {
        true => SPEEDS.iter().rposition(|step| *step <= speed).map_or(-1, |at| at as i32),
        false => SPEEDS.iter().position(|step| *step >= speed).map_or(last + 1, |at| at as i32),
    };
    SPEEDS[at.saturating_add(by).clamp(0, last) as usize]
}

/// The playback settings with the volume of this number as the first (`end` false) or the last one that is played. If no volume would then be
/// left, the mark at the other end is removed.
pub(super) fn marked(cine: Cine, volume: u32, end: bool) -> Cine {
    match end {
        false => Cine { first: Some(volume), last: cine.last.filter(|last| *last >= volume), ..cine },
        true => Cine { last: Some(volume), first: cine.first.filter(|first| *first <= volume), ..cine },
    }
}

impl Loop<'_> {
    /// Indices of the volumes between the first and the last one that are marked; of all volumes if none is left between the marks, because the
    /// loop drops its oldest volumes.
    pub(super) fn range(&self) -> RangeInclusive<usize> {
        let Loop { cine, volumes } = self;
        let all = 0..=volumes.len().saturating_sub(1);
        let low = cine.first.map_or(Some(0), |first| volumes.iter().position(|v| v.volume >= first));
        let high = cine.last.map_or(Some(*all.end()), |last| volumes.iter().rposition(|v| v.volume <= last));
        match (low, high) {
            (Some(low), Some(high)) if low <= high => low..=high,
            _ => all,
        }
    }

    /// Volumes a second as they were acquired, between the marks. A rate that some of the volumes do not state would be a guess.
    fn rate(&self) -> Option<f64> {
        let (range, volumes) = (self.range(), self.volumes);
        let has_times = range.clone().all(|index| volumes.get(index).and_then(begins).is_some());
        let intervals = (*range.start()..*range.end()).filter_map(|index| interval(volumes, index));
        let known = Some(intervals.collect::<Vec<f64>>()).filter(|known| has_times && !known.is_empty());
        known.map(|intervals| intervals.len() as f64 / intervals.iter().sum::<f64>())
    }

    /// Volumes shown a second at the selected speed.
    pub(super) fn played_rate(&self) -> f64 {
        self.rate().unwrap_or(1.0 / UNKNOWN_INTERVAL) * self.cine.speed
    }
}

/// What the panels show about the cine loop.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CineState {
    /// Number of volumes in the cine loop.
    pub(super) count: usize,
    /// Index of the volume that is shown; None if it is not in the cine loop.
    pub(super) shown: Option<usize>,
    /// Indices of the volumes that are played.
    pub(super) range: RangeInclusive<usize>,
    pub(super) is_trimmed: bool,
    pub(super) is_playing: bool,
    pub(super) speed: f64,
    pub(super) goes_back_and_forth: bool,
    /// Time stamp of the shown volume minus that of the first of the loop, s; None if not known.
    pub(super) seconds: Option<f64>,
    /// Time stamp of the last volume of the loop minus that of the first, s; None if not known.
    pub(super) length: Option<f64>,
    /// Rate at which the played volumes were acquired, volumes a second; None if not known.
    pub(super) rate: Option<f64>,
}

impl CinePlayer {
    pub(super) fn is_playing(&self) -> bool {
        self.next.is_some()
    }

    pub(super) fn stop(&mut self) {
        self.next = None;
    }

    /// Starts to play at `now`, or stops if the loop is being played. A loop of one volume does not start.
    pub(super) fn toggle(&mut self, of: Loop, now: Instant) {
        self.next = match self.next {
            None if of.range().count() > 1 => Some(now),
            _ => None,
        };
    }

    /// Index of the volume to show now; None if none is due. `shown`: index of the one that is shown.
    pub(super) fn advance(&mut self, of: Loop, shown: Option<usize>, now: Instant) -> Option<usize> {
        let due = self.next.filter(|due| now >= *due)?;
        let range = of.range();
        let (low, high) = (*range.start(), *range.end());
        if low >= high {
            self.next = None;
            return None;
        }
        let Some(at) = shown.filter(|at| range.contains(at)) else {
            self.is_backwards = false;
            return self.show(of, low, (due, now));
        };
        // Back and forth, it turns at each end; otherwise it always goes forwards.
        self.is_backwards = of.cine.back_and_forth && at != low && (at == high || self.is_backwards);
        let next = match self.is_backwards {
            true => at - 1,
            false if at == high => low,
            false => at + 1,
        };
        self.show(of, next, (due, now))
    }

    /// Shows a volume for as long as it lasted.
    fn show(&mut self, of: Loop, index: usize, (due, now): (Instant, Instant)) -> Option<usize> {
        let range = of.range();
        // The last lasts as long as the one before it: nothing follows it.
        let from = if self.is_backwards { index.saturating_sub(1) } else { index };
        let from = from.clamp(*range.start(), range.end().saturating_sub(1));
        let seconds = interval(of.volumes, from).unwrap_or(UNKNOWN_INTERVAL) / of.cine.speed;
        // Time that was lost is not caught up.
        self.next = Some((due + Duration::from_secs_f64(seconds)).max(now));
        Some(index)
    }

    pub(super) fn state(&self, of: Loop, shown: Option<usize>) -> CineState {
        let (range, volumes) = (of.range(), of.volumes);
        // A recording or the phantom that is played again begins its time stamps again: nothing states how long that took.
        let step = |n: usize| Some((begins(volumes.get(n + 1)?)? - begins(volumes.get(n)?)?).max(0.0));
        let since = |index: usize| -> Option<f64> {
            begins(volumes.get(index)?)?;
            (0..index).map(step).try_fold(0.0, |sum, step| Some(sum + step?))
        };
        CineState {
            count: volumes.len(),
            shown,
            is_trimmed: range.clone().count() < volumes.len(),
            range,
            is_playing: self.is_playing(),
            speed: of.cine.speed,
            goes_back_and_forth: of.cine.back_and_forth,
            seconds: shown.and_then(since).filter(|s| s.is_finite() && *s >= 0.0),
            length: volumes.len().checked_sub(1).and_then(since).filter(|s| s.is_finite() && *s >= 0.0),
            rate: of.rate(),
        }
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
        cine: &Cine,
        volumes: &VecDeque<CineVolume>,
        mut shown: Option<usize>,
        steps: usize,
    ) -> Vec<(usize, u128)> {
        let begun = Instant::now();
        let mut now = begun;
        let (mut player, of) = (CinePlayer::default(), Loop { cine, volumes });
        player.toggle(of, now);
        let mut seen = Vec::new();
        for _ in 0..steps {
            let Some(due) = player.next else { break };
            now = now.max(due);
            let Some(index) = player.advance(of, shown, now) else { break };
            shown = Some(index);
            seen.push((index, (now - begun).as_micros().div_ceil(1000)));
        }
        seen
    }

    #[test]
    fn volumes_last_as_long_as_they_were_acquired() {
        let loop_of = volumes(&[Some(10.0), Some(10.25), Some(10.35), Some(10.65)]);
        let as_acquired = Cine::default();
        // The last one has no successor: it lasts as long as the one before.
        let expected = [(0, 0), (1, 250), (2, 350), (3, 650), (0, 950), (1, 1200)];
        assert_eq!(played(&as_acquired, &loop_of, None, 6), expected);
        let fast = Cine { speed: stepped(1.0, 1), ..as_acquired };
        assert_eq!(played(&fast, &loop_of, Some(3), 3), [(0, 0), (1, 125), (2, 175)]);
        let slow = Cine { speed: stepped(1.0, -9), ..as_acquired };
        assert_eq!(played(&slow, &loop_of, None, 2), [(0, 0), (1, 2500)]);
    }

    #[test]
    fn without_times_and_across_pauses_a_volume_lasts_a_fifth_of_a_second() {
        for times in [[None, None, None], [Some(5.0), Some(2.0), None], [Some(0.0), Some(3600.0), Some(f64::NAN)]] {
            let seen = played(&Cine::default(), &volumes(&times), None, 4);
            assert_eq!(seen, [(0, 0), (1, 200), (2, 400), (0, 600)], "{times:?}");
        }
    }

    #[test]
    fn back_and_forth_shows_the_ends_once() {
        let back_and_forth = Cine { back_and_forth: true, ..Cine::default() };
        let loop_of = volumes(&[Some(0.0), Some(0.1), Some(0.3)]);
        // On the way back a volume lasts as long as the one that it leads to lasted.
        let expected = [(0, 0), (1, 100), (2, 300), (1, 500), (0, 600), (1, 700)];
        assert_eq!(played(&back_and_forth, &loop_of, None, 6), expected);
    }

    #[test]
    fn only_what_is_between_the_marks_is_played() {
        let mut loop_of = volumes(&[None; 6]);
        // The first of them has the number 7.
        let cine = marked(marked(Cine::default(), 9, false), 11, true);
        assert_eq!((cine.first, cine.last), (Some(9), Some(11)));
        let indices = |seen: Vec<(usize, u128)>| seen.into_iter().map(|(index, _)| index).collect::<Vec<_>>();
        assert_eq!(indices(played(&cine, &loop_of, Some(0), 5)), [2, 3, 4, 2, 3]);
        let state = CinePlayer::default().state(Loop { cine: &cine, volumes: &loop_of }, Some(3));
        assert_eq!((state.range, state.is_trimmed, state.count), (2..=4, true, 6));
        // The marks stay on their volumes when the loop moves on.
        loop_of.drain(..3);
        let range = |cine: &Cine, volumes: &VecDeque<CineVolume>| Loop { cine, volumes }.range();
        assert_eq!(range(&cine, &loop_of), 0..=1);
        loop_of.drain(..2);
        assert_eq!(range(&cine, &loop_of), 0..=0, "none is left: all of them");
        let loop_of = volumes(&[None; 6]);
        let later = marked(cine, 12, false);
        assert_eq!((later.first, later.last), (Some(12), None), "the end went");
        assert_eq!(range(&later, &loop_of), 5..=5);
        assert_eq!(marked(cine, 8, true).first, None, "the beginning went");
        let mut player = CinePlayer::default();
        player.toggle(Loop { cine: &later, volumes: &loop_of }, Instant::now());
        assert!(!player.is_playing(), "one volume is no loop");
        assert_eq!(range(&Cine::default(), &loop_of), 0..=5);
    }

    /// Prevents a button that is stuck at a speed from a file.
    #[test]
    fn speeds_step_from_wherever_they_are() {
        assert_eq!([stepped(1.0, 1), stepped(1.0, -1), stepped(8.0, 1), stepped(0.1, -1)], [2.0, 0.5, 8.0, 0.1]);
        assert_eq!([stepped(0.7, 1), stepped(0.7, -1), stepped(8.0, -7)], [1.0, 0.5, 0.1]);
    }

    #[test]
    fn rate_and_time_are_those_of_the_time_stamps() {
        let loop_of = volumes(&[Some(2.0), Some(2.25), Some(2.5), Some(3.0)]);
        let state = |cine: &Cine, volumes: &VecDeque<CineVolume>, shown| {
            CinePlayer::default().state(Loop { cine, volumes }, shown)
        };
        let whole = Cine::default();
        let shown = state(&whole, &loop_of, Some(2));
        assert_eq!((shown.seconds, shown.rate, shown.speed), (Some(0.5), Some(3.0), 1.0));
        let short = Cine { speed: stepped(1.0, 1), ..marked(whole, 9, true) };
        assert_eq!(state(&short, &loop_of, None).rate, Some(4.0));
        assert_eq!(Loop { cine: &short, volumes: &loop_of }.played_rate(), 8.0);
        let unknown = volumes(&[Some(2.0), None, Some(2.5)]);
        let shown = state(&short, &unknown, Some(1));
        assert_eq!((shown.seconds, shown.rate), (None, None));
        // Played twice, and with a pause.
        let again = volumes(&[Some(0.0), Some(0.5), Some(1.0), Some(0.0), Some(0.5)]);
        let shown = state(&whole, &again, Some(4));
        assert_eq!((shown.seconds, shown.rate), (Some(1.5), Some(2.0)));
        assert_eq!(state(&whole, &again, Some(3)).seconds, Some(1.0));
        let paused = volumes(&[Some(0.0), Some(0.5), Some(100.0), Some(100.5)]);
        let shown = state(&whole, &paused, Some(3));
        assert_eq!((shown.seconds, shown.rate), (Some(100.5), Some(2.0)));
        let first = state(&whole, &again, Some(0)).seconds;
        assert_eq!(first.map(|seconds| format!("{seconds:.1}")), Some("0.0".into()), "not -0.0");
        let none = state(&whole, &VecDeque::new(), None);
        assert_eq!((none.count, none.rate, none.is_trimmed), (0, None, false));
    }

    proptest! {
        /// Whatever the marks, the times and the clock: a volume of the range is shown, and the next is not due before.
        #[test]
        fn what_is_shown_is_in_the_range(
            times in prop::collection::vec(prop::option::of(any::<f64>()), 0..7),
            marks in prop::collection::vec((0usize..8, any::<bool>()), 0..3),
            (back_and_forth, speed, shown) in (any::<bool>(), -9i32..9, prop::option::of(0usize..9)),
        ) {
            let loop_of = volumes(&times);
            let mut cine = Cine { back_and_forth, speed: stepped(1.0, speed), ..Cine::default() };
            for (volume, end) in marks.iter().filter_map(|(index, end)| Some((loop_of.get(*index)?, *end))) {
                cine = marked(cine, volume.volume, end);
            }
            let range = Loop { cine: &cine, volumes: &loop_of }.range();
            let seen = played(&cine, &loop_of, shown, 12);
            prop_assert!(seen.iter().all(|(index, _)| range.contains(index) && *index < loop_of.len()));
            prop_assert!(seen.windows(2).all(|pair| pair[0].1 <= pair[1].1 && pair[0].0 != pair[1].0));
            prop_assert_eq!(seen.is_empty(), range.clone().count() < 2);
        }
    }
}
