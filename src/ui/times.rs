//! Times that the view measures of itself, for the display and for the summary at the end.

use crate::live::Statistics;
use crate::statistics::quantile_of;
use std::collections::VecDeque;
use std::time::Duration;

/// Number of recent times that percentiles are taken from.
const MAX_RECENT: usize = 256;

/// The most recent durations of something that happens repeatedly, ms.
#[derive(Clone, Debug, Default)]
pub(super) struct RecentTimes(VecDeque<f64>);

impl RecentTimes {
    pub(super) fn add(&mut self, time: Duration) {
        self.0.push_back(time.as_secs_f64() * 1e3);
        if self.0.len() > MAX_RECENT {
            self.0.pop_front();
        }
    }

    /// Quantile of the durations at `share` (0..=1), ms. None before the first one.
    pub(super) fn percentile(&self, share: f64) -> Option<f64> {
        quantile_of(self.0.iter().copied(), share)
    }

    pub(super) fn newest(&self) -> Option<f64> {
        self.0.back().copied()
    }
}

/// Longest delay of a live picture that is not told, ms.
const UNTOLD_DELAY: f64 = 1000.0;

/// The times and counts that the display of times shows.
#[derive(Clone, Debug, Default)]
pub(super) struct Times {
    /// For each pass its name, its mean time in ms and its number of runs, over the last second in which it ran.
    pub(super) passes: Vec<(&'static str, f64, u32)>,
    /// Times from the start of a picture to its completion.
    pub(super) pictures: RecentTimes,
    /// Times from an input to the picture that shows its effect.
    pub(super) input_latency: RecentTimes,
    /// Times from the arrival of the last frame of a picture to its presentation.
    pub(super) frame_latency: RecentTimes,
    /// Times from the presentation of a picture to its first pixel on the monitor. Empty if the device cannot measure them.
    pub(super) scan_out: RecentTimes,
    /// Frames received a second, over the last complete second; `volumes` and `shown` are volumes shown and pictures drawn a second.
    pub(super) frames: f64,
    pub(super) volumes: f64,
    pub(super) shown: f64,
    /// 95th percentile over the last second of the time from the arrival of a frame to the picture that shows it, ms; None if there was none.
    pub(super) latency: Option<f64>,
    /// Number of volumes dropped since the start; `lost` is the number of frames.
    pub(super) dropped: u64,
    pub(super) lost: u64,
    /// Shortest time in which a volume can be acquired at the speed of sound, s; None if not known.
    pub(super) acquisition_time: Option<f64>,
}

impl Times {
    /// Time by which the pictures are behind the frames, s; None if it is too short to be shown. The time that a frame waits for the last one of
    /// its volume does not count.
    pub(super) fn delay(&self) -> Option<f64> {
        let acquired = 1e3 * self.acquisition_time.unwrap_or(0.0);
        self.latency.map(|ms| ms - acquired).filter(|ms| *ms > UNTOLD_DELAY).map(|ms| ms / 1e3)
    }

    /// Adds the statistics of about a second.
    pub(super) fn add(&mut self, statistics: &Statistics, acquisition_time: Option<f64>) {
        let rate = |n: u64| n as f64 / statistics.time.as_secs_f64().max(1e-3);
        (self.frames, self.volumes, self.shown) =
            (rate(statistics.frames), rate(statistics.volumes.shown), rate(statistics.pictures));
        self.dropped += statistics.volumes.dropped;
        self.lost += statistics.lost;
        self.acquisition_time = acquisition_time;
        if !statistics.latency.is_empty() {
            self.latency = Some(statistics.latency_ms(0.95));
        }
        for pass in statistics.passes.iter().filter(|p| p.runs > 0) {
            let mean = pass.total / 1e6 / f64::from(pass.runs);
            match self.passes.iter_mut().find(|(name, ..)| *name == pass.name) {
                Some(known) => *known = (pass.name, mean, pass.runs),
                None => self.passes.push((pass.name, mean, pass.runs)),
            }
        }
        // Passes that no longer run are removed.
        if statistics.passes.iter().any(|p| p.runs > 0) {
            self.passes.retain(|(name, ..)| statistics.passes.iter().any(|p| p.name == *name && p.runs > 0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::PassTime;

    #[test]
    fn the_time_to_acquire_a_volume_is_no_delay() {
        let times = Times { latency: Some(2500.0), acquisition_time: Some(0.5), ..Times::default() };
        assert_eq!(times.delay(), Some(2.0));
        assert_eq!(Times { acquisition_time: Some(1.5), ..times }.delay(), None);
    }

    #[test]
    fn percentiles_are_of_the_recent_times() {
        let mut recent = RecentTimes::default();
        assert_eq!(recent.percentile(0.5), None);
        (0..1000).for_each(|ms| recent.add(Duration::from_millis(ms)));
        assert_eq!(recent.percentile(0.0), Some(744.0));
        assert_eq!(recent.percentile(1.0), Some(999.0));
        assert_eq!(recent.newest(), Some(999.0));
    }

    #[test]
    fn a_pass_that_no_longer_runs_is_removed_and_an_idle_second_changes_nothing() {
        let ran = |name| PassTime { name, runs: 2, total: 6e6 };
        let second = |passes| Statistics { time: Duration::from_secs(1), passes, ..Default::default() };
        let mut times = Times::default();
        times.add(&second(vec![ran("surface"), ran("light")]), None);
        times.add(&second(vec![]), None);
        assert_eq!(times.passes, [("surface", 3.0, 2), ("light", 3.0, 2)]);
        times.add(&second(vec![ran("light")]), None);
        assert_eq!(times.passes, [("light", 3.0, 2)]);
    }
}
