//! Metrics of a verification, for the textfile collector.

use super::simulated::{any_run, check, fail, run};
use crate::metrics::{Metrics, parsed};
use echolume::low_level::baselines::Threshold;
use echolume::low_level::verify::report::baseline::compare;
use echolume::low_level::verify::report::prometheus::prometheus;
use echolume::low_level::verify::report::{Run, Verdict};
use proptest::prelude::*;
use std::collections::BTreeMap;

fn value(metrics: &Metrics, name: &str, label: Option<(&str, &str)>) -> Option<f64> {
    let has = |labels: &BTreeMap<String, String>| {
        label.is_none_or(|(name, value)| labels.get(name).map(String::as_str) == Some(value))
    };
    metrics.get(&format!("echolume_verify_{name}"))?.iter().find(|(labels, _)| has(labels)).map(|(_, value)| *value)
}

fn count(metrics: &Metrics, result: &str) -> Option<f64> {
    value(metrics, "checks", Some(("result", result)))
}

#[test]
fn counts_times_and_conditions_come_back() {
    let mut run = run(1);
    fail(&mut run, "passes", "shade");
    check(&mut run, "modes", "plane").verdict = Verdict::Interrupted;
    let metrics = parsed(&prometheus(&run, None));
    let counts = ["passed", "failed", "skipped", "interrupted"].map(|result| count(&metrics, result));
    assert_eq!(counts, [Some(18.0), Some(1.0), Some(1.0), Some(1.0)]);
    assert_eq!(value(&metrics, "check_failed", Some(("check", "shade"))), Some(1.0));
    let median = check(&mut run, "speed", "tone").figures[0].value;
    let seconds = value(&metrics, "pass_seconds", Some(("pass", "tone"))).expect("a time");
    assert!((seconds / (1e-9 * median) - 1.0).abs() < 1e-12, "{seconds}");
    assert_eq!(value(&metrics, "duration_seconds", None), Some(48.2));
    // 2026-01-02T03:04:05Z.
    assert_eq!(value(&metrics, "timestamp_seconds", None), Some(1_767_323_045.0));
    let (labels, one) = &metrics["echolume_verify_info"][0];
    let told = ["device", "driver", "vulkan", "program", "level", "validation"].map(|name| labels[name].as_str());
    assert_eq!(told, ["simulated", "none 1.0", "1.3.0", "echolume 0.1.0, release", "quick", "true"]);
    assert_eq!(*one, 1.0);
}

#[test]
fn checks_that_became_worse_are_counted_where_there_is_a_baseline() {
    let (old, mut new) = (run(1), run(1));
    fail(&mut new, "passes", "shade");
    fail(&mut new, "modes", "plane");
    assert_eq!(value(&parsed(&prometheus(&new, None)), "checks_worse", None), None);
    for (run, worse) in [(&old, 0.0), (&new, 2.0)] {
        let compared = compare(&old, run, Threshold::default());
        assert_eq!(value(&parsed(&prometheus(run, Some(&compared))), "checks_worse", None), Some(worse));
    }
}

#[test]
fn a_hostile_device_name_stays_a_label() {
    let mut run = run(1);
    run.device.name = "x\"} 1\necholume_verify_checks{result=\"failed\"} 0\n# HELP \\\u{1b}[2J".into();
    let metrics = parsed(&prometheus(&run, None));
    assert_eq!(metrics["echolume_verify_checks"].len(), 4);
    let name = &metrics["echolume_verify_info"][0].0["device"];
    assert_eq!(name, "x\"} 1\\necholume_verify_checks{result=\"failed\"} 0\\n# HELP \\\\u{1b}[2J");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn any_run_makes_metrics_that_add_up(run in any_run()) {
        let run: Run = run;
        let metrics = parsed(&prometheus(&run, None));
        let all: f64 = ["passed", "failed", "skipped", "interrupted"].iter().filter_map(|r| count(&metrics, r)).sum();
        prop_assert_eq!(all, run.outcomes.len() as f64);
    }
}
