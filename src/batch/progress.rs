//! Progress of a shard: on a terminal a bar with rate and time left, elsewhere one line a minute.

use crate::terminal::{remark, say};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Interval of the lines where standard error is no terminal.
const LINE: Duration = Duration::from_secs(60);

/// Counts the units of a shard that ended, and shows the progress.
pub struct Progress {
    bar: Option<ProgressBar>,
    begun: Instant,
    said: Instant,
    units: usize,
    /// Numbers of units: all that ended, those of them that were done before, and those that failed.
    ended: usize,
    found: usize,
    failed: usize,
    /// Sums of expected costs: of all units, of those that ended, and of those that were done before.
    cost: f64,
    spent: f64,
    saved: f64,
}

impl Progress {
    /// `units`: number of units of the shard; `cost`: sum of their expected costs.
    pub fn new(units: usize, cost: f64) -> Progress {
        let bar = std::io::stderr().is_terminal().then(|| {
            let bar = ProgressBar::new(units as u64);
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {elapsed} {wide_msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(500));
            bar
        });
        let now = Instant::now();
        Progress { bar, begun: now, said: now, units, ended: 0, found: 0, failed: 0, cost, spent: 0.0, saved: 0.0 }
    }

    /// Counts a unit of this expected cost that an earlier run had done.
    pub fn found(&mut self, cost: f64) {
        self.found += 1;
        self.saved += cost;
        self.done(cost);
    }

    /// Counts a unit of this expected cost that failed, and prints `line`.
    pub fn failed(&mut self, cost: f64, line: &str) {
        self.failed += 1;
        match &self.bar {
            Some(bar) => bar.suspend(|| remark(line)),
            None => remark(line),
        }
        self.done(cost);
    }

    /// Counts a unit of this expected cost that ended.
    pub fn done(&mut self, cost: f64) {
        self.ended += 1;
        self.spent += cost;
        let line = self.line();
        match &self.bar {
            Some(bar) => {
                bar.set_position(self.ended as u64);
                bar.set_message(line);
            }
            None if self.said.elapsed() >= LINE => {
                self.said = Instant::now();
                say!("{}/{}: {line}", self.ended, self.units);
            }
            None => {}
        }
    }

    /// Rate and time left, which follows from the expected costs of the units that this run did.
    fn line(&self) -> String {
        let seconds = self.begun.elapsed().as_secs_f64();
        let rate = (self.ended - self.found) as f64 / seconds.max(1e-3);
        let worked = self.spent - self.saved;
        let left = (worked > 0.0).then(|| seconds * (self.cost - self.spent).max(0.0) / worked);
        let failed = if self.failed > 0 { format!(", {} failed", self.failed) } else { String::new() };
        let left = left.map_or(String::new(), |left| {
            format!(", {} left", humantime::format_duration(Duration::from_secs(left.min(1e9) as u64)))
        });
        format!("{rate:.2} units a second{left}{failed}")
    }

    /// Removes the progress bar and returns a summary in one line.
    pub fn finish(self) -> String {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let seconds = self.begun.elapsed().as_secs_f64();
        let done = self.ended - self.found - self.failed;
        let found = if self.found > 0 { format!(", {} were done before", self.found) } else { String::new() };
        let failed = if self.failed > 0 { format!(", {} failed", self.failed) } else { String::new() };
        format!("{} units: {done} done in {seconds:.1} s{found}{failed}", self.units)
    }
}
