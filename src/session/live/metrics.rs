//! Metrics of a live run for Prometheus, in a file that is rewritten at intervals.

use super::statistics::Statistics;
use super::stream::Stream;
use crate::gpu::{Context, GpuError};
use crate::machine;
use crate::metrics::table;
use crate::metrics::text_format::Exposition;
use crate::metrics::textfile::Textfile;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Time between two writes of the metrics file.
pub const INTERVAL: Duration = Duration::from_secs(15);

/// Values that are exported as metrics besides the [`Statistics`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conditions {
    /// Name of the subcommand, such as `stream`.
    pub command: &'static str,
    pub device: String,
    pub driver: String,
    /// Vulkan version of the device.
    pub vulkan: String,
    /// True while the program runs, false in the last metrics of a run.
    pub is_running: bool,
    /// Time at which the counters began, s since 1970; `now` is the current time.
    pub started: f64,
    pub now: f64,
    /// Number of times that the metrics file could not be written.
    pub write_failures: u64,
    /// Resident memory of the process, bytes; None if it is not known.
    pub memory: Option<u64>,
    /// Number of times that the device was lost. `device_stalls` is how many of these happened because it did not finish in time.
    pub device_losses: u64,
    pub device_stalls: u64,
    /// Time for which the device has been busy without finishing anything; 0 if it is idle.
    pub busy: Duration,
    pub source: SourceStatus,
}

/// Whether the source is connected, whether the display is frozen, and how often the source could not be opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SourceStatus {
    pub is_connected: bool,
    pub is_frozen: bool,
    /// Number of times that the source could not be opened.
    pub not_opened: u64,
}

/// The metrics in Prometheus' text format. `totals`: statistics since the run began.
pub fn text(totals: &Statistics, conditions: &Conditions) -> String {
    let Conditions { command, device, driver, vulkan, .. } = conditions;
    let truth = |is: bool| f64::from(u8::from(is));
    let labelled = |label: &str, count: u64| (vec![label.to_string()], count as f64);
    let info = [command, env!("CARGO_PKG_VERSION"), device, driver, vulkan].map(str::to_string).to_vec();
    let (volumes, faults, source) = (totals.volumes, totals.faults, conditions.source);
    let passes = totals.passes.iter().filter(|pass| pass.runs > 0);
    let passes = passes.map(|pass| (vec![pass.name.to_string()], 1e-9 * pass.total, u64::from(pass.runs)));

    let mut text = Exposition::default();
    text.numbers(&table::INFO, [(info, 1.0)]);
    text.number(&table::RUNNING, truth(conditions.is_running));
    text.number(&table::START, conditions.started);
    text.number(&table::WRITTEN, conditions.now);
    text.number(&table::WRITE_FAILURES, conditions.write_failures as f64);
    text.numbers(&table::MEMORY, conditions.memory.map(|bytes| (Vec::new(), bytes as f64)));
    text.number(&table::FRAMES, totals.frames as f64);
    let dropped =
        [("full", totals.lost), ("refused", totals.refused), ("late", volumes.left_out), ("frozen", totals.frozen)];
    text.numbers(&table::FRAMES_DROPPED, dropped.map(|(reason, count)| labelled(reason, count)));
    text.number(&table::FRAMES_UNRECORDED, totals.unrecorded as f64);
    let results = [("shown", volumes.shown), ("dropped", volumes.dropped), ("incomplete", volumes.incomplete)];
    text.numbers(&table::VOLUMES, results.map(|(result, count)| labelled(result, count)));
    text.number(&table::PICTURES, totals.pictures as f64);
    text.histogram(&table::LATENCY, &totals.latencies);
    text.summary(&table::PASS_SECONDS, passes);
    text.number(&table::DEVICE_LOSSES, conditions.device_losses as f64);
    text.number(&table::DEVICE_STALLS, conditions.device_stalls as f64);
    text.number(&table::DEVICE_BUSY, conditions.busy.as_millis() as f64 / 1e3);
    text.number(&table::SOURCE_CONNECTED, truth(source.is_connected));
    let faults = [
        ("reported", faults.reported),
        ("ended", faults.ended),
        ("disconnected", faults.disconnected),
        ("not_opened", source.not_opened),
    ];
    text.numbers(&table::SOURCE_FAULTS, faults.map(|(kind, count)| labelled(kind, count)));
    text.number(&table::FROZEN, truth(source.is_frozen));
    text.into_text()
}

/// Collects the metrics of a run and writes them to a file.
pub struct LiveMetrics {
    file: Textfile,
    totals: Statistics,
    /// What does not change, or is counted here.
    kept: Conditions,
    /// Time of the next write of the file.
    due: Instant,
}

impl LiveMetrics {
    /// Starts to collect metrics of the subcommand `command` for `file`. The first write is due at once.
    ///
    /// # Errors
    /// One line: a thread cannot be started.
    pub fn new(file: &Path, command: &'static str) -> Result<LiveMetrics, String> {
        let kept = Conditions { command, started: seconds(SystemTime::now()), ..Conditions::default() };
        Ok(LiveMetrics { file: Textfile::new(file)?, totals: Statistics::default(), kept, due: Instant::now() })
    }

    /// Adds the statistics of a period.
    pub fn add(&mut self, later: &Statistics) {
        self.totals.add(later);
    }

    /// Counts a lost device.
    pub fn device_lost(&mut self, why: &GpuError) {
        self.kept.device_losses += 1;
        self.kept.device_stalls += u64::from(why.is_given_up());
    }

    /// Time at which the file is to be written next.
    pub fn due(&self) -> Instant {
        self.due
    }

    /// Writes the file. The next write is due one [`INTERVAL`] after `now`, even if this one was late.
    pub fn write(&mut self, now: Instant, stream: &Stream, context: &Context, source: SourceStatus) {
        self.due = now + INTERVAL;
        self.put(true, stream, context, source);
    }

    /// Writes the file for the last time.
    pub fn end(mut self, stream: &Stream, context: &Context) {
        let source = SourceStatus { not_opened: self.kept.source.not_opened, ..SourceStatus::default() };
        self.put(false, stream, context, source);
    }

    fn put(&mut self, is_running: bool, stream: &Stream, context: &Context, source: SourceStatus) {
        let candidate = &context.candidate;
        self.kept.source = source;
        let conditions = Conditions {
            device: candidate.name.clone(),
            driver: candidate.driver.trim().into(),
            vulkan: candidate.api_version(),
            is_running,
            now: seconds(SystemTime::now()),
            write_failures: self.file.failures(),
            memory: machine::resident_bytes(),
            busy: stream.device_busy_for().unwrap_or_default(),
            ..self.kept.clone()
        };
        self.file.put(text(&self.totals, &conditions));
    }
}

/// Seconds since 1970, to the millisecond.
fn seconds(at: SystemTime) -> f64 {
    at.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_millis() as f64 / 1e3)
}
