//! Frame budget: keeps the time of a picture below a limit while the view moves, by choosing a rung of the quality ladder. A view at rest
//! has full quality. It is pure: it is given the times of pictures and returns the rung of the next one.

use std::time::{Duration, Instant};

/// The view is at rest so long after its last movement.
const REST_DELAY: Duration = Duration::from_millis(250);
/// Weight of a new time in the running mean of a rung.
const NEW_WEIGHT: f64 = 0.4;
/// A better rung is chosen if its estimated time is below this fraction of the budget, so that it is not left again at once.
const MARGIN: f64 = 0.85;
/// After so many pictures on a rung the measured ratios of the ladder are replaced by the expected ones.
const FORGET_AFTER: u32 = 32;
/// Pictures on a rung before a better one is tried.
const MIN_PICTURES: u32 = 4;

/// Chooses the rung for a view that moves. Rung 0 is full quality; each one after it is faster.
#[derive(Clone, Debug)]
pub(super) struct FrameBudget {
    budget: Option<Duration>,
    /// By rung: the expected time of a picture as a fraction of that on rung 0.
    expected: Vec<f64>,
    /// The same, corrected by measurements.
    measured: Vec<f64>,
    rung: usize,
    /// Mean time of the pictures on this rung, s, and their number.
    mean: f64,
    pictures: u32,
    /// The previous rung and its mean.
    previous: Option<(usize, f64)>,
    moved: Option<Instant>,
}

impl FrameBudget {
    /// `time_shares`: the time on each rung as a fraction of that on the first, decreasing. Without a budget every
    /// picture has full quality.
    pub(super) fn new(budget: Option<Duration>, time_shares: &[f64]) -> FrameBudget {
        let expected = if time_shares.is_empty() { vec![1.0] } else { time_shares.to_vec() };
        let measured = expected.clone();
        FrameBudget { budget, expected, measured, rung: 0, mean: 0.0, pictures: 0, previous: None, moved: None }
    }

    pub(super) fn budget(&self) -> Option<Duration> {
        self.budget
    }

    /// Records that the view moved.
    pub(super) fn view_moved(&mut self, now: Instant) {
        self.moved = Some(now);
    }

    /// Discards the measurements: the scene changed.
    pub(super) fn forget(&mut self) {
        self.measured.clone_from(&self.expected);
        (self.pictures, self.previous) = (0, None);
    }

    /// True if the view moved a moment ago.
    pub(super) fn is_moving(&self, now: Instant) -> bool {
        self.moved.is_some_and(|at| now.saturating_duration_since(at) < REST_DELAY)
    }

    /// When a moving view comes to rest.
    pub(super) fn rests_at(&self, now: Instant) -> Option<Instant> {
        self.moved.map(|at| at + REST_DELAY).filter(|at| *at > now)
    }

    /// The rung of the next picture.
    pub(super) fn rung(&self, now: Instant) -> usize {
        match self.budget.is_some() && self.is_moving(now) {
            true => self.rung,
            false => 0,
        }
    }

    /// Records the time of a picture on a rung, and chooses the next rung. Times of a view at rest are ignored unless it is on the rung of
    /// the moving view.
    pub(super) fn picture_took(&mut self, rung: usize, time: Duration) {
        let Some(budget) = self.budget.map(|b| b.as_secs_f64()) else { return };
        if rung != self.rung {
            return;
        }
        let time = time.as_secs_f64();
        self.mean = if self.pictures == 0 { time } else { self.mean + NEW_WEIGHT * (time - self.mean) };
        self.pictures = self.pictures.saturating_add(1);
        // The expected ratios come from another scene or device.
        if let Some((other, mean)) = self.previous.take_if(|(_, mean)| *mean > 0.0) {
            self.measured[rung] = self.measured[other] * self.mean / mean;
        }
        // A measurement may have been an outlier: return to the expected ratios from time to time.
        if self.pictures.is_multiple_of(FORGET_AFTER) {
            self.measured.clone_from(&self.expected);
        }
        if self.mean > budget {
            let last = self.measured.len() - 1;
            let fast = (rung + 1..=last).find(|r| self.estimate(*r) <= budget * MARGIN);
            self.choose(fast.unwrap_or(last));
        } else if self.pictures >= MIN_PICTURES && rung > 0 && self.estimate(rung - 1) <= budget * MARGIN {
            self.choose(rung - 1);
        }
    }

    fn choose(&mut self, rung: usize) {
        if rung != self.rung {
            self.previous = Some((self.rung, self.mean));
            (self.rung, self.pictures) = (rung, 0);
        }
    }

    /// Estimated time of a picture on another rung, s.
    fn estimate(&self, rung: usize) -> f64 {
        self.mean * self.measured[rung] / self.measured[self.rung].max(1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LADDER: [f64; 5] = [1.0, 0.4, 0.25, 0.15, 0.1];

    /// Draws pictures while the view moves, on a device that takes `full` s at full quality. Returns their rungs.
    fn drag(frame_budget: &mut FrameBudget, full: f64, ratios: &[f64], pictures: usize, now: Instant) -> Vec<usize> {
        let one = |_| {
            frame_budget.view_moved(now);
            let rung = frame_budget.rung(now);
            frame_budget.picture_took(rung, Duration::from_secs_f64(full * ratios[rung]));
            rung
        };
        (0..pictures).map(one).collect()
    }

    #[test]
    fn a_slow_device_goes_down_until_the_budget_is_kept_and_stays_there() {
        let now = Instant::now();
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        let rungs = drag(&mut frame_budget, 0.060, &LADDER, 40, now);
        assert!(rungs[5..].iter().all(|r| 0.060 * LADDER[*r] <= 0.016), "{rungs:?}");
        assert!(rungs[5..].windows(2).filter(|w| w[0] != w[1]).count() <= 2, "it settles: {rungs:?}");
    }

    #[test]
    fn wrong_expected_ratios_are_corrected() {
        let (now, real) = (Instant::now(), [1.0, 0.9, 0.8, 0.5, 0.2]);
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        let rungs = drag(&mut frame_budget, 0.050, &real, 35, now);
        assert!(rungs[10..].iter().all(|r| 0.050 * real[*r] <= 0.016), "{rungs:?}");
    }

    #[test]
    fn a_fast_device_keeps_full_quality_and_recovers_from_an_outlier() {
        let now = Instant::now();
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        assert!(drag(&mut frame_budget, 0.004, &LADDER, 20, now).iter().all(|r| *r == 0));
        drag(&mut frame_budget, 0.200, &LADDER, 3, now);
        assert!(frame_budget.rung(now) > 0);
        let later = drag(&mut frame_budget, 0.004, &LADDER, 60, now);
        assert_eq!(later.last(), Some(&0), "{later:?}");
    }

    #[test]
    fn the_fastest_rung_is_used_if_none_keeps_the_budget() {
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(1)), &LADDER);
        let rungs = drag(&mut frame_budget, 1.0, &LADDER, 10, Instant::now());
        assert_eq!(rungs.last(), Some(&4));
    }

    #[test]
    fn a_view_at_rest_has_full_quality() {
        let now = Instant::now();
        let mut frame_budget = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        drag(&mut frame_budget, 0.1, &LADDER, 10, now);
        assert!(frame_budget.rung(now) > 0);
        assert_eq!(frame_budget.rests_at(now), Some(now + REST_DELAY));
        assert_eq!(frame_budget.rung(now + REST_DELAY), 0);
        let mut unlimited = FrameBudget::new(None, &LADDER);
        drag(&mut unlimited, 9.0, &LADDER, 10, now);
        assert_eq!(unlimited.rung(now), 0);
    }
}
