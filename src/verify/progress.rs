//! The messages of a run in progress: a line for each group and each failure, and on a terminal a bar with the running check.

use super::gtest;
use super::report::{self, CheckName, Outcome, Verdict};
use crate::terminal::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

/// A function that prints a line of another process on standard error, above the bar.
pub fn echo(bar: &ProgressBar) -> Arc<dyn Fn(&str) + Send + Sync> {
    let bar = bar.clone();
    Arc::new(move |line| bar.suspend(|| drop(writeln!(std::io::stderr(), "{line}"))))
}

/// Prints the progress of a run. Call [`Progress::begins`] before each check and [`Progress::ends`] after it.
pub struct Progress {
    style: Style,
    bar: ProgressBar,
    /// All checks, in running order.
    checks: Vec<CheckName>,
    /// The outcomes of the group that runs, without pictures.
    group: Vec<Outcome>,
}

/// In which form the progress is printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// One line for each group, and each failure in full.
    Groups,
    /// The lines that a GoogleTest program prints.
    GoogleTest,
}

impl Progress {
    /// `checks`: the checks that will run. `bar`: a [`progress_bar`](crate::terminal::progress_bar), whose length is set here.
    pub fn new(style: Style, checks: &[CheckName], bar: ProgressBar) -> Progress {
        if style == Style::GoogleTest {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} {elapsed} {wide_msg}") {
            bar.set_style(style);
        }
        bar.set_length(checks.len() as u64);
        bar.enable_steady_tick(Duration::from_millis(500));
        Progress { style, bar, checks: checks.to_vec(), group: Vec::new() }
    }

    pub fn begins(&mut self, check: &CheckName) {
        self.bar.set_message(format!("{} / {}", check.group, check.name));
        if self.style == Style::GoogleTest {
            if self.group.first().is_none_or(|first| first.group != check.group) {
                self.end_group();
                let count = self.checks.iter().filter(|other| other.group == check.group).count();
                say!("{}", gtest::begins_group(&check.group, count));
            }
            say!("{}", gtest::begins(check));
        }
    }

    pub fn ends(&mut self, outcome: &Outcome) {
        self.bar.inc(1);
        match self.style {
            Style::GoogleTest => say!("{}", gtest::ends(outcome).trim_end()),
            Style::Groups => {
                if self.group.first().is_some_and(|first| first.group != outcome.group) {
                    self.end_group();
                }
                // One line per group; a failure is printed at once.
                if outcome.verdict == Verdict::Failed {
                    self.bar.suspend(|| say!("{}", report::failure(outcome).trim_end()));
                }
            }
        }
        self.group.push(Outcome { pictures: Vec::new(), ..outcome.clone() });
    }

    /// Prints the line of the last group, and removes the bar.
    pub fn finish(mut self) {
        self.end_group();
        self.bar.finish_and_clear();
    }

    fn end_group(&mut self) {
        let group = std::mem::take(&mut self.group);
        let Some(first) = group.first() else { return };
        match self.style {
            Style::GoogleTest => say!("{}\n", gtest::ends_group(&group)),
            Style::Groups => {
                let line = report::group_line(&first.group, &group.iter().collect::<Vec<_>>());
                self.bar.suspend(|| say!("{}", line.trim_end()));
            }
        }
    }
}
