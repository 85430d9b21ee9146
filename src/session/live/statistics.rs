//! Counts of a stream, and the latency from the arrival of a frame to the pixels that show it.

use super::volume_pool::VolumeCounts;
use crate::metrics::histogram;
use crate::passes::PassTime;
use crate::tree::Defaults;
use hdrhistogram::Histogram;
use std::fmt::Write as _;
use std::time::Duration;

/// Largest latency that is resolved, us: one minute. Latencies have three significant digits.
const MAX_LATENCY: u64 = 60_000_000;

/// Limits of [`Statistics::latencies`], s: from one refresh of a monitor to a sweep that stands still.
const LATENCY_LIMITS: &[f64] =
    &[0.005, 0.01, 0.02, 0.035, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 30.0];

/// Numbers of faults of a source, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceFaults {
    /// Number of faults after which the source went on without a part of the data.
    pub reported: u64,
    /// Number of times that the source ended unexpectedly.
    pub ended: u64,
    /// Number of times that the connection was lost or refused.
    pub disconnected: u64,
}

/// Statistics of a stream over a period: since it began, or since they were last taken.
#[derive(Clone, Debug, Defaults)]
pub struct Statistics {
    /// Length of the period.
    pub time: Duration,
    /// Number of frames that were taken from the feed, refused ones included. Frames that were lost or ignored while frozen are not counted.
    pub frames: u64,
    /// Number of frames that were lost because the queue was full.
    pub lost: u64,
    /// Number of frames that the renderer refused, for example because of a wrong size.
    pub refused: u64,
    /// Number of frames that were ignored because the display was frozen.
    pub frozen: u64,
    /// Number of frames that could not be recorded, and of other failures of the recording.
    pub unrecorded: u64,
    pub faults: SourceFaults,
    pub pictures: u64,
    pub volumes: VolumeCounts,
    /// Latency from the arrival of each frame until the host finds the first picture that shows it finished, us.
    // Never fails with these constants.
    #[value(Histogram::new_with_bounds(1, MAX_LATENCY, 3).unwrap_or_else(|_| unreachable!()))]
    pub latency: Histogram<u64>,
    /// The latencies of `latency`, but in s and in bins with fixed limits.
    #[value(histogram::Histogram::new(LATENCY_LIMITS))]
    pub latencies: histogram::Histogram,
    pub passes: Vec<PassTime>,
    /// Number of passes and copies that could not be timed.
    pub untimed: u64,
}

impl Statistics {
    pub(super) fn record_latency(&mut self, latency: Duration) {
        self.latency.saturating_record((latency.as_micros() as u64).max(1));
        self.latencies.record(latency.as_secs_f64());
    }

    /// Removes all latencies.
    pub(super) fn reset_latencies(&mut self) {
        self.latency.reset();
        self.latencies.reset();
    }

    /// Quantile of the latencies at `share` (0..=1), ms; 0 if there is none.
    pub fn latency_ms(&self, share: f64) -> f64 {
        self.latency.value_at_quantile(share) as f64 / 1e3
    }

    /// Everything that is counted, without latencies and what is measured of passes.
    fn counts(&mut self) -> [&mut u64; 13] {
        let Statistics { frames, lost, refused, frozen, unrecorded, pictures, faults, volumes, .. } = self;
        let SourceFaults { reported, ended, disconnected } = faults;
        let VolumeCounts { shown, dropped, incomplete, left_out } = volumes;
        [
            frames,
            lost,
            refused,
            frozen,
            unrecorded,
            pictures,
            reported,
            ended,
            disconnected,
            shown,
            dropped,
            incomplete,
            left_out,
        ]
    }

    /// These statistics minus the earlier ones. Latencies, times of passes and the number of untimed ones are not subtracted, because they are reset
    /// whenever statistics are taken.
    pub fn since(&self, before: &Statistics) -> Statistics {
        let (mut since, mut before) = (self.clone(), before.clone());
        since.time = self.time.saturating_sub(before.time);
        for (now, then) in since.counts().into_iter().zip(before.counts()) {
            *now = now.saturating_sub(*then);
        }
        since
    }

    /// Adds the statistics of a later period.
    pub fn add(&mut self, later: &Statistics) {
        self.time += later.time;
        let mut added = later.clone();
        self.counts().into_iter().zip(added.counts()).for_each(|(sum, more)| *sum += *more);
        // Cannot fail: both histograms have the same bounds.
        let _ = self.latency.add(&later.latency);
        self.latencies.add(&later.latencies);
        self.untimed += later.untimed;
        later.passes.iter().for_each(|pass| pass.add_to(&mut self.passes));
    }

    /// The counts on one line, for statistics since the beginning.
    pub fn totals(&self) -> String {
        let VolumeCounts { shown, dropped, incomplete, left_out } = self.volumes;
        let frozen =
            if self.frozen > 0 { format!(", {} passed over while frozen", self.frozen) } else { String::new() };
        format!(
            "in all: {} frames, {} lost, {} refused, {left_out} left out{frozen}; volumes: {shown} shown, {dropped} dropped, {incomplete} incomplete; \
             {} pictures",
            self.frames, self.lost, self.refused, self.pictures
        )
    }

    /// Rates and latencies on one line. `floor`: time that sound needs for a volume, s, if it is known.
    pub fn line(&self, floor: Option<f64>) -> String {
        let seconds = self.time.as_secs_f64().max(1e-9);
        let rate = |n: u64| n as f64 / seconds;
        let VolumeCounts { shown, dropped, incomplete, .. } = self.volumes;
        let mut line = format!(
            "frames {:.1}/s  volumes {:.2}/s  pictures {:.1}/s",
            rate(self.frames),
            rate(shown),
            rate(self.pictures)
        );
        if let Some(floor) = floor {
            let _ = write!(line, " ({:.0} % of what sound allows)", 100.0 * rate(shown) * floor);
        }
        let _ = write!(line, "  dropped {dropped}");
        for (count, what) in [
            (incomplete, "incomplete"),
            (self.lost, "frames lost"),
            (self.refused, "frames refused"),
            (self.frozen, "frames passed over while frozen"),
        ] {
            if count > 0 {
                let _ = write!(line, ", {count} {what}");
            }
        }
        if self.latency.is_empty() {
            line.push_str("  no picture");
        } else {
            let [p50, p95, p99] = [0.5, 0.95, 0.99].map(|share| self.latency_ms(share));
            let max = self.latency.max() as f64 / 1e3;
            let _ = write!(line, "  latency ms p50 {p50:.1} p95 {p95:.1} p99 {p99:.1} max {max:.1}");
        }
        let mut passes: Vec<&PassTime> = self.passes.iter().filter(|p| p.total > 0.0).collect();
        passes.sort_by(|a, b| b.total.total_cmp(&a.total));
        let shown: Vec<_> = passes
            .iter()
            .map(|p| format!("{} {:.2} ms x {}", p.name, p.total / 1e6 / p.runs.max(1) as f64, p.runs))
            .collect();
        if !shown.is_empty() {
            let _ = write!(line, "  {}", shown.join(", "));
        }
        if self.untimed > 0 {
            let _ = write!(line, ", {} passes not timed", self.untimed);
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_has_rates_drops_and_percentiles() {
        let mut statistics = Statistics { time: Duration::from_secs(2), frames: 74, pictures: 4, ..Default::default() };
        (1..=100).for_each(|n| statistics.record_latency(Duration::from_millis(n)));
        statistics.volumes = VolumeCounts { shown: 2, dropped: 1, incomplete: 3, left_out: 0 };
        statistics.passes = vec![PassTime { name: "scan_convert", runs: 74, total: 74e6 }];
        let line = statistics.line(Some(0.25));
        for part in [
            "frames 37.0/s",
            "volumes 1.00/s",
            "pictures 2.0/s",
            "25 % of what sound allows",
            "dropped 1, 3 incomplete",
            "p50 50.",
            "p95 95.",
            "p99 99.",
            "max 100.",
            "scan_convert 1.00 ms x 74",
        ] {
            assert!(line.contains(part), "{part}: {line}");
        }
        let mut twice = statistics.clone();
        twice.add(&statistics);
        assert_eq!((statistics.latencies.count(), twice.latencies.count()), (100, 200));
        let totals =
            "in all: 74 frames, 0 lost, 0 refused, 0 left out; volumes: 2 shown, 1 dropped, 3 incomplete; 4 pictures";
        assert_eq!(statistics.totals(), totals);
        let frozen = Statistics { frozen: 5, ..Statistics::default() };
        twice.add(&frozen);
        assert_eq!((twice.frozen, twice.since(&frozen).frozen), (5, 0));
        for text in [twice.line(None), twice.totals()] {
            assert!(text.contains(", 5 ") && text.contains("passed over while frozen"), "{text}");
        }
        assert!(!line.contains("lost") && !line.contains("not timed") && !line.contains('\n'), "{line}");
        let mut all = statistics.clone();
        all.untimed = 3;
        all.add(&Statistics { untimed: 2, ..Default::default() });
        assert!(all.line(None).ends_with("scan_convert 1.00 ms x 74, 5 passes not timed"), "{}", all.line(None));
    }

    #[test]
    fn latencies_beyond_the_bound_are_recorded_as_the_bound() {
        let mut statistics = Statistics::default();
        statistics.record_latency(Duration::from_secs(1_000_000));
        statistics.record_latency(Duration::ZERO);
        assert_eq!(statistics.latency.len(), 2);
        assert!(statistics.latency_ms(1.0) >= 60_000.0);
    }
}
