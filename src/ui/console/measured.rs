//! Times that the view measures of itself: for the display, the log, the summary at the end, and metrics in a file.

use crate::gpu::{Context, GpuError};
use crate::live::metrics::{LiveMetrics, SourceStatus};
use crate::live::volume_pool::VolumeCounts;
use crate::live::{Statistics, Stream};
use crate::times::{RecentTimes, Times};
use std::time::{Duration, Instant};

/// Collects the times that the viewer measures, and determines when statistics are due.
pub(super) struct Measured {
    pub(super) times: Times,
    /// When the last frame arrived that the finished picture shows, until that is presented.
    arrived: Option<Instant>,
    /// When statistics were last collected.
    taken: Instant,
    interval: Duration,
    metrics: Option<LiveMetrics>,
}

impl Measured {
    /// `interval`: that of the statistics. Metrics are written at their own interval; None: there are none.
    pub(super) fn new(interval: Duration, metrics: Option<LiveMetrics>, now: Instant) -> Measured {
        Measured { times: Times::default(), arrived: None, taken: now, interval, metrics }
    }

    /// Notes that a picture is finished whose last new frame arrived `latency` ago; 0: it shows no new frame.
    pub(super) fn picture_finished(&mut self, latency: Duration, now: Instant) {
        self.arrived = (!latency.is_zero()).then(|| now.checked_sub(latency)).flatten();
    }

    /// Adds the time from the arrival of the last frame to the presentation of the picture, once for each picture.
    pub(super) fn presented(&mut self, now: Instant) {
        if let Some(arrived) = self.arrived.take() {
            self.times.frame_latency.add(now.saturating_duration_since(arrived));
        }
    }

    /// True once in each interval, when statistics have to be collected.
    pub(super) fn is_due(&mut self, now: Instant) -> bool {
        let is_due = now.saturating_duration_since(self.taken) >= self.interval;
        if is_due {
            self.taken = now;
        }
        is_due
    }

    /// Adds the statistics of an interval. `acquisition_time`: shortest time in which a volume can be acquired, s; `totals`: gives a line about
    /// all intervals. Returns true if anything was received or drawn.
    pub(super) fn add(
        &mut self,
        statistics: &Statistics,
        acquisition_time: Option<f64>,
        totals: impl FnOnce() -> String,
    ) -> bool {
        let is_active = statistics.pictures > 0 || statistics.frames > 0;
        // A volume may also end while nothing arrives.
        if is_active || statistics.volumes != VolumeCounts::default() {
            tracing::debug!("{}; {}", statistics.line(acquisition_time), totals());
        }
        self.times.add(statistics, acquisition_time);
        self.metrics.iter_mut().for_each(|metrics| metrics.add(statistics));
        is_active
    }

    /// Times at which statistics are due, if the display of times is shown and has content, and at which metrics are due.
    pub(super) fn due(&self, shows_times: bool) -> impl Iterator<Item = Instant> {
        let has_pictures = self.times.pictures.newest().is_some();
        let statistics = (shows_times && has_pictures).then_some(self.taken + self.interval);
        statistics.into_iter().chain(self.metrics.as_ref().map(LiveMetrics::due))
    }

    pub(super) fn device_lost(&mut self, why: &GpuError) {
        self.metrics.iter_mut().for_each(|metrics| metrics.device_lost(why));
    }

    /// Writes the metrics if they are due.
    pub(super) fn write(&mut self, stream: &Stream, context: &Context, source: SourceStatus, now: Instant) {
        if let Some(metrics) = self.metrics.as_mut().filter(|metrics| now >= metrics.due()) {
            metrics.write(now, stream, context, source);
        }
    }

    /// Writes the metrics for the last time, when the program ends regularly.
    pub(super) fn end(&mut self, stream: &mut Stream, context: &Context) {
        let Some(mut metrics) = self.metrics.take() else { return };
        if let Ok(statistics) = stream.take_statistics() {
            metrics.add(&statistics);
        }
        metrics.end(stream, context);
    }

    /// Percentiles of the times, in ms, as one line.
    pub(super) fn line(&self) -> String {
        let ms = |value: Option<f64>| value.map_or("-".into(), |ms| format!("{ms:.1}"));
        let percentiles =
            |times: &RecentTimes| format!("p50 {} p95 {}", ms(times.percentile(0.5)), ms(times.percentile(0.95)));
        let Times { pictures, input_latency, frame_latency, scan_out, .. } = &self.times;
        let frames = frame_latency.newest().map(|_| {
            let p99 = ms(frame_latency.percentile(0.99));
            format!(", last frame to presentation {} p99 {p99}", percentiles(frame_latency))
        });
        let frames = frames.unwrap_or_default();
        let monitor = scan_out.newest().map(|_| format!(", presentation to monitor {}", percentiles(scan_out)));
        let monitor = monitor.unwrap_or_default();
        format!(
            "ms: picture {}, input to picture {}{frames}{monitor}",
            percentiles(pictures),
            percentiles(input_latency)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a display of times that keeps the program awake before there is a picture, and lines that a script no longer reads.
    #[test]
    fn statistics_are_taken_once_an_interval_and_wake_only_a_display_that_shows_them() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let mut measured = Measured::new(Duration::from_secs(1), None, begin);
        assert!(!measured.is_due(at(999)) && measured.is_due(at(1000)) && !measured.is_due(at(1001)));
        assert_eq!(measured.due(true).count(), 0, "no picture yet");
        assert_eq!(measured.line(), "ms: picture p50 - p95 -, input to picture p50 - p95 -");
        measured.times.pictures.add(Duration::from_millis(12));
        assert_eq!(measured.due(true).collect::<Vec<_>>(), [at(2000)]);
        assert_eq!(measured.due(false).count(), 0);
        measured.times.scan_out.add(Duration::from_millis(8));
        // A picture that shows no new frame is not measured, and one that does is measured once.
        measured.picture_finished(Duration::ZERO, at(5));
        measured.presented(at(6));
        measured.picture_finished(Duration::from_millis(20), at(30));
        measured.presented(at(35));
        measured.presented(at(90));
        let line = "ms: picture p50 12.0 p95 12.0, input to picture p50 - p95 -, last frame to presentation p50 25.0 p95 25.0 p99 25.0, \
                    presentation to monitor p50 8.0 p95 8.0";
        assert_eq!(measured.line(), line);
        let one = Statistics { time: Duration::from_secs(1), frames: 1, ..Statistics::default() };
        assert!(measured.add(&one, None, String::new) && !measured.add(&Statistics::default(), None, String::new));
    }
}
