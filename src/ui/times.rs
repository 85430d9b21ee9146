//! What the view measured of itself, for the display and for the line at its end.

use crate::live::Statistics;
use std::collections::VecDeque;
use std::time::Duration;

/// How many of the last times percentiles are of.
const LAST: usize = 256;

/// The last times of something.
#[derive(Clone, Debug, Default)]
pub struct Last(VecDeque<f64>);

impl Last {
    pub fn add(&mut self, time: Duration) {
        self.0.push_back(time.as_secs_f64() * 1e3);
        if self.0.len() > LAST {
            self.0.pop_front();
        }
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// ms; `share` 0..=1. Nothing was measured: none.
    pub fn percentile(&self, share: f64) -> Option<f64> {
        let mut sorted: Vec<f64> = self.0.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        sorted.get((share * last as f64).round() as usize).copied()
    }

    pub fn newest(&self) -> Option<f64> {
        self.0.back().copied()
    }
}

/// Everything that the display of times shows.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// By pass, of the last second in which it ran: mean time, ms, and runs.
    pub passes: Vec<(&'static str, f64, u32)>,
    /// From the beginning of a picture to its end.
    pub pictures: Last,
    /// From what a hand did to the picture that shows it.
    pub hands: Last,
    /// Per second, of the last whole one.
    pub frames: f64,
    pub volumes: f64,
    pub shown: f64,
    /// From the arrival of a frame to the picture that shows it, ms; the 95th percentile of the last second.
    pub latency: Option<f64>,
    /// Since the start.
    pub dropped: u64,
    pub lost: u64,
    /// The time that sound needs for a volume, s.
    pub floor: Option<f64>,
}

impl Times {
    /// What happened during about a second.
    pub fn second(&mut self, since: &Statistics, floor: Option<f64>) {
        let rate = |n: u64| n as f64 / since.time.as_secs_f64().max(1e-3);
        (self.frames, self.volumes, self.shown) = (rate(since.frames), rate(since.volumes.shown), rate(since.pictures));
        self.dropped += since.volumes.dropped;
        self.lost += since.lost;
        self.floor = floor;
        if !since.latency.is_empty() {
            self.latency = Some(since.latency_ms(0.95));
        }
        for pass in since.passes.iter().filter(|p| p.runs > 0) {
            let mean = pass.total / 1e6 / f64::from(pass.runs);
            match self.passes.iter_mut().find(|(name, ..)| *name == pass.name) {
                Some(known) => *known = (pass.name, mean, pass.runs),
                None => self.passes.push((pass.name, mean, pass.runs)),
            }
        }
        // What does not run any more is not shown as if it did.
        if since.passes.iter().any(|p| p.runs > 0) {
            self.passes.retain(|(name, ..)| since.passes.iter().any(|p| p.name == *name && p.runs > 0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::PassTime;

    #[test]
    fn percentiles_are_of_the_last_times() {
        let mut last = Last::default();
        assert_eq!(last.percentile(0.5), None);
        (0..1000).for_each(|ms| last.add(Duration::from_millis(ms)));
        assert_eq!(last.percentile(0.0), Some(744.0));
        assert_eq!(last.percentile(1.0), Some(999.0));
        assert_eq!(last.newest(), Some(999.0));
    }

    #[test]
    fn a_pass_that_runs_no_more_goes_and_a_still_second_changes_nothing() {
        let ran = |name| PassTime { name, runs: 2, total: 6e6 };
        let second = |passes| Statistics { time: Duration::from_secs(1), passes, ..Default::default() };
        let mut times = Times::default();
        times.second(&second(vec![ran("surface"), ran("light")]), None);
        times.second(&second(vec![]), None);
        assert_eq!(times.passes, [("surface", 3.0, 2), ("light", 3.0, 2)]);
        times.second(&second(vec![ran("light")]), None);
        assert_eq!(times.passes, [("light", 3.0, 2)]);
    }
}
