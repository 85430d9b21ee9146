//! A run as JUnit XML for CI systems: one suite for each group, one case for each check.

use super::baseline::BaselineComparison;
use super::{Outcome, Run, Verdict, comparison, failure, value_of_limit};
use crate::text::escaped;
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestRerun, TestSuite};
use std::time::Duration;

/// The report as JUnit XML. `compared`, the comparison with a baseline, adds a suite whose only case fails if anything is worse.
///
/// # Errors
/// One line: the XML could not be written.
pub fn junit(run: &Run, compared: Option<&BaselineComparison>) -> Result<String, String> {
    let mut report = Report::new("echolume verify");
    report.timestamp = run.date.parse().ok();
    report.time = duration(run.seconds);
    for (group, outcomes) in run.groups() {
        report.add_test_suite(suite(run, group, &outcomes));
    }
    if let Some(compared) = compared {
        report.add_test_suite(baseline(run, compared));
    }
    report.to_string().map_err(|e| format!("JUnit XML: {}", escaped(&e.to_string())))
}

/// None if `seconds` is no valid duration.
fn duration(seconds: f64) -> Option<Duration> {
    Duration::try_from_secs_f64(seconds).ok()
}

/// An empty suite with the conditions of the run, since readers show suites separately.
fn suite_on(run: &Run, name: &str) -> TestSuite {
    let mut suite = TestSuite::new(escaped(name));
    suite.timestamp = run.date.parse().ok();
    let properties = [
        ("device", escaped(&run.device.name)),
        ("driver", escaped(&run.device.driver)),
        ("api", escaped(&run.device.api)),
        ("program", escaped(&run.program)),
        ("level", run.level.name().into()),
        ("validation", run.validation.to_string()),
        ("date", escaped(&run.date)),
    ];
    suite.add_properties(properties.iter().map(|(name, value)| (*name, value.as_str())));
    suite
}

fn suite(run: &Run, group: &str, outcomes: &[&Outcome]) -> TestSuite {
    let mut suite = suite_on(run, group);
    suite.time = duration(outcomes.iter().map(|o| o.seconds).sum());
    suite.add_test_cases(outcomes.iter().map(|outcome| case(outcome)));
    suite
}

fn case(outcome: &Outcome) -> TestCase {
    let why = |usual: &str| {
        let notes: Vec<String> = outcome.notes.iter().map(|note| escaped(note)).collect();
        if notes.is_empty() { usual.into() } else { notes.join("; ") }
    };
    let status = match outcome.verdict {
        Verdict::Passed => {
            let mut status = TestCaseStatus::success();
            for _ in 0..outcome.failed_before {
                let mut rerun = TestRerun::new(NonSuccessKind::Failure);
                rerun
                    .set_type("flaky")
                    .set_message(outcome.notes.first().map_or_else(String::new, |note| escaped(note)));
                status.add_rerun(rerun);
            }
            status
        }
        Verdict::Failed => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            let first = outcome.faults.first().map_or_else(|| "failed".into(), |fault| escaped(&fault.what));
            let more = match outcome.faults.len() {
                0 | 1 => String::new(),
                count => format!(" (and {} more)", count - 1),
            };
            status.set_message(first + &more).set_type("failed").set_description(failure(outcome));
            status
        }
        Verdict::LeftOut => {
            let mut status = TestCaseStatus::skipped();
            status.set_message(why("left out"));
            status
        }
        // An error, because a run that was ended early must not pass, and no failure, because the device is not at fault.
        Verdict::Interrupted => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Error);
            status.set_message(why("interrupted")).set_type("interrupted");
            status
        }
    };
    let mut case = TestCase::new(escaped(&outcome.name), status);
    case.set_classname(escaped(&outcome.group));
    case.time = duration(outcome.seconds);
    let figures = outcome.figures.iter().map(|f| format!("{}: {}", escaped(&f.what), value_of_limit(f)));
    // Notes of a check that was not run are its message.
    let was_run = matches!(outcome.verdict, Verdict::Passed | Verdict::Failed);
    let notes = outcome.notes.iter().filter(|_| was_run).map(|note| escaped(note));
    let lines: Vec<String> = figures.chain(notes).collect();
    if !lines.is_empty() {
        case.set_system_out(lines.join("\n"));
    }
    case
}

fn baseline(run: &Run, compared: &BaselineComparison) -> TestSuite {
    let worse = compared.worse_checks();
    let status = match worse {
        0 => TestCaseStatus::success(),
        _ => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            let message = format!(
                "{worse} {} worse than in {}",
                if worse == 1 { "check is" } else { "checks are" },
                compared.baseline
            );
            status.set_message(message).set_type("worse").set_description(comparison(compared));
            status
        }
    };
    let mut case = TestCase::new("nothing is worse than before", status);
    case.set_classname("baseline").set_time(Duration::ZERO);
    case.set_system_out(comparison(compared));
    let mut suite = suite_on(run, "baseline");
    suite.set_time(Duration::ZERO).add_test_case(case);
    suite
}
