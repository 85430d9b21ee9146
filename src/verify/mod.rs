//! Checks that a device and its driver render correctly: every pass, every mode and every kind of failure, on inputs that are built
//! into the program, so that no source tree is needed. The result is a [`Run`]; [`report`] writes it as text, JSON, JUnit XML and HTML
//! and compares it with an earlier run.
//!
//! A [`Check`] runs on a [`DeviceUnderTest`] and returns [`Findings`]. Modules are named like the groups that `echolume verify --list`
//! prints. [`self_test`] proves the checks by fault injection: it injects faults on the device's side and records which check
//! detects each.

pub mod built_in;
mod check;
pub(crate) mod command;
mod compare;
pub mod determinism;
pub mod failures;
pub mod formats;
pub mod hazards;
mod known_answers;
pub mod memory;
pub mod modes;
pub mod passes;
pub mod render;
pub mod report;
pub mod self_test;
mod speed;
pub mod stress;
pub mod time_stamps;

pub use check::{Check, DeviceUnderTest, Findings};
pub use compare::{Comparison, ExtraTolerance, compare_outputs, compare_picture, expect_same_picture};

use report::{Level, Outcome, Run};
use std::time::Instant;

/// All checks of a level, in running order.
pub fn checks(level: Level) -> Vec<Check> {
    let groups = [
        passes::checks,
        known_answers::checks,
        modes::checks,
        determinism::checks,
        memory::checks,
        failures::checks,
        formats::checks,
        hazards::checks,
        time_stamps::checks,
        speed::checks,
        stress::checks,
    ];
    groups.into_iter().flat_map(|group| group(level)).collect()
}

/// Runs checks one after the other and calls `tell` after each. Once `stop` returns a reason, the remaining checks are left out.
pub fn run(
    dut: &mut DeviceUnderTest,
    checks: &[Check],
    stop: impl Fn() -> Option<&'static str>,
    mut tell: impl FnMut(&Outcome),
) -> Run {
    let begun = Instant::now();
    let mut outcomes = Vec::new();
    let mut group = checks.first().map_or("", |check| check.group);
    for check in checks {
        if let Some(why) = stop() {
            outcomes.push(check.stopped(why));
            continue;
        }
        // State that the validation layer keeps of one group must not affect the next: see `IsolatedContext`.
        if dut.options.validation && std::mem::replace(&mut group, check.group) != check.group {
            let renewed = dut.renew();
            renewed.unwrap_or_else(|error| tracing::warn!("the old device goes on: {error}"));
        }
        // Logged first, because a driver that crashes ends the process.
        tracing::info!("check: {} / {}", check.group, check.name);
        let outcome = check.run(dut);
        tell(&outcome);
        outcomes.push(outcome);
    }
    dut.run_of(outcomes, begun)
}

/// The outcome for the checks that a signal left out: an incomplete run must not pass.
pub fn stopped(signal: &str, left: usize) -> Outcome {
    Check::new("run", "every check was run", |_| Ok(Findings::default()))
        .failed(format!("{signal}: {left} checks were not"))
}
