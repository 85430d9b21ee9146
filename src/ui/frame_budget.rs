//! Holds the time of a picture while the view moves, by turning the dials of error against run time; full quality as soon as it rests.
//! Pure: it is told how long pictures took, and says which rung of a ladder the next one stands on.

use std::time::{Duration, Instant};

/// After the last move of a hand the view is taken to rest.
const REST: Duration = Duration::from_millis(250);
/// How much of a new time goes into the mean of a rung.
const FRESH: f64 = 0.4;
/// A better rung is taken where its time is below this share of the budget, so that it is not left again at once.
const ROOM: f64 = 0.85;
/// Pictures on a rung before what was found of the others is forgotten.
const BELIEF: u32 = 32;
/// Pictures on a rung before a better one is tried.
const PATIENCE: u32 = 4;

/// Which rung a moving view stands on: 0 is full quality, each one after it is faster.
#[derive(Clone, Debug)]
pub struct FrameBudget {
    budget: Option<Duration>,
    /// By rung: how long a picture takes there, as a share of what the first takes: what the ladder's maker expects.
    given: Vec<f64>,
    /// The same as it was found to be.
    found: Vec<f64>,
    rung: usize,
    /// Mean time of the pictures on this rung, s, and how many they are.
    mean: f64,
    pictures: u32,
    /// The rung before, and its mean.
    before: Option<(usize, f64)>,
    moved: Option<Instant>,
}

impl FrameBudget {
    /// `shares`: the time of each rung as a share of that of the first, falling. Without a budget every picture has full quality.
    pub fn new(budget: Option<Duration>, shares: &[f64]) -> FrameBudget {
        let given = if shares.is_empty() { vec![1.0] } else { shares.to_vec() };
        FrameBudget { budget, found: given.clone(), given, rung: 0, mean: 0.0, pictures: 0, before: None, moved: None }
    }

    pub fn budget(&self) -> Option<Duration> {
        self.budget
    }

    /// A hand moves the view.
    pub fn moves(&mut self, now: Instant) {
        self.moved = Some(now);
    }

    /// The scene is another: what was found says nothing of it.
    pub fn forget(&mut self) {
        self.found.clone_from(&self.given);
        (self.pictures, self.before) = (0, None);
    }

    /// Whether the view moves, or did a moment ago.
    pub fn is_moving(&self, now: Instant) -> bool {
        self.moved.is_some_and(|at| now.saturating_duration_since(at) < REST)
    }

    /// When a view that moves comes to rest.
    pub fn rests_at(&self, now: Instant) -> Option<Instant> {
        self.moved.map(|at| at + REST).filter(|at| *at > now)
    }

    /// The rung of the next picture.
    pub fn rung(&self, now: Instant) -> usize {
        match self.budget.is_some() && self.is_moving(now) {
            true => self.rung,
            false => 0,
        }
    }

    /// How long a picture on a rung took. What a view that rests took says nothing of the rung that it will move on.
    pub fn took(&mut self, rung: usize, time: Duration) {
        let Some(budget) = self.budget.map(|b| b.as_secs_f64()) else { return };
        if rung != self.rung {
            return;
        }
        let time = time.as_secs_f64();
        self.mean = if self.pictures == 0 { time } else { self.mean + FRESH * (time - self.mean) };
        self.pictures = self.pictures.saturating_add(1);
        // The ladder's maker had another scene, or another device.
        if let Some((other, mean)) = self.before.take_if(|(_, mean)| *mean > 0.0) {
            self.found[rung] = self.found[other] * self.mean / mean;
        }
        // What was found may have been a slow moment: now and then the ladder is believed again.
        if self.pictures.is_multiple_of(BELIEF) {
            self.found.clone_from(&self.given);
        }
        if self.mean > budget {
            let last = self.found.len() - 1;
            let fast = (rung + 1..=last).find(|r| self.estimate(*r) <= budget * ROOM);
            self.go(fast.unwrap_or(last));
        } else if self.pictures >= PATIENCE && rung > 0 && self.estimate(rung - 1) <= budget * ROOM {
            self.go(rung - 1);
        }
    }

    fn go(&mut self, rung: usize) {
        if rung != self.rung {
            self.before = Some((self.rung, self.mean));
            (self.rung, self.pictures) = (rung, 0);
        }
    }

    /// How long a picture would take on another rung, s.
    fn estimate(&self, rung: usize) -> f64 {
        self.mean * self.found[rung] / self.found[self.rung].max(1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LADDER: [f64; 5] = [1.0, 0.4, 0.25, 0.15, 0.1];

    /// Pictures of a device that takes `full` s at full quality, moving all the while; the rungs they stood on.
    fn drag(pace: &mut FrameBudget, full: f64, ratios: &[f64], pictures: usize, now: Instant) -> Vec<usize> {
        let one = |_| {
            pace.moves(now);
            let rung = pace.rung(now);
            pace.took(rung, Duration::from_secs_f64(full * ratios[rung]));
            rung
        };
        (0..pictures).map(one).collect()
    }

    #[test]
    fn a_slow_device_goes_down_until_the_budget_holds_and_stays() {
        let now = Instant::now();
        let mut pace = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        let rungs = drag(&mut pace, 0.060, &LADDER, 40, now);
        assert!(rungs[5..].iter().all(|r| 0.060 * LADDER[*r] <= 0.016), "{rungs:?}");
        assert!(rungs[5..].windows(2).filter(|w| w[0] != w[1]).count() <= 2, "it settles: {rungs:?}");
    }

    #[test]
    fn a_ladder_that_lies_is_found_out() {
        let (now, real) = (Instant::now(), [1.0, 0.9, 0.8, 0.5, 0.2]);
        let mut pace = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        let rungs = drag(&mut pace, 0.050, &real, 35, now);
        assert!(rungs[10..].iter().all(|r| 0.050 * real[*r] <= 0.016), "{rungs:?}");
    }

    #[test]
    fn a_fast_device_keeps_full_quality_and_a_slow_moment_is_forgotten() {
        let now = Instant::now();
        let mut pace = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        assert!(drag(&mut pace, 0.004, &LADDER, 20, now).iter().all(|r| *r == 0));
        drag(&mut pace, 0.200, &LADDER, 3, now);
        assert!(pace.rung(now) > 0);
        let later = drag(&mut pace, 0.004, &LADDER, 60, now);
        assert_eq!(later.last(), Some(&0), "{later:?}");
    }

    #[test]
    fn what_no_rung_holds_takes_the_fastest() {
        let mut pace = FrameBudget::new(Some(Duration::from_millis(1)), &LADDER);
        let rungs = drag(&mut pace, 1.0, &LADDER, 10, Instant::now());
        assert_eq!(rungs.last(), Some(&4));
    }

    #[test]
    fn a_view_that_rests_has_full_quality() {
        let now = Instant::now();
        let mut pace = FrameBudget::new(Some(Duration::from_millis(16)), &LADDER);
        drag(&mut pace, 0.1, &LADDER, 10, now);
        assert!(pace.rung(now) > 0);
        assert_eq!(pace.rests_at(now), Some(now + REST));
        assert_eq!(pace.rung(now + REST), 0);
        let mut unlimited = FrameBudget::new(None, &LADDER);
        drag(&mut unlimited, 9.0, &LADDER, 10, now);
        assert_eq!(unlimited.rung(now), 0);
    }
}
