//! Metrics for the textfile collector, read back by a parser that takes no more than the text format of Prometheus allows.

use super::simulated::{any_run, check, fail, run};
use echolume::verify::report::prometheus::prometheus;
use echolume::verify::report::{Run, Verdict};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Labels of a sample and its value.
type Samples = Vec<(BTreeMap<String, String>, f64)>;

/// A character of a text from which nothing is skipped.
struct Reader<'a>(std::iter::Peekable<std::str::Chars<'a>>);

impl Reader<'_> {
    fn name(&mut self, may_have_colon: bool) -> String {
        let mut name = String::new();
        while let Some(c) = self.0.next_if(|c| c.is_ascii_alphanumeric() || *c == '_' || (may_have_colon && *c == ':'))
        {
            name.push(c);
        }
        assert!(name.starts_with(|c: char| !c.is_ascii_digit()), "{name:?} is no name");
        name
    }

    fn takes(&mut self, expected: char) {
        assert_eq!(self.0.next(), Some(expected));
    }

    /// A value in quotes. Its only escapes are \\, \" and \n.
    fn label(&mut self) -> String {
        self.takes('"');
        let mut value = String::new();
        loop {
            match self.0.next().expect("the quote is closed") {
                '"' => return value,
                '\\' => value.push(match self.0.next() {
                    Some('n') => '\n',
                    Some(c @ ('\\' | '"')) => c,
                    other => panic!("{other:?} is no escape"),
                }),
                '\n' => panic!("a line break in a label"),
                c => value.push(c),
            }
        }
    }
}

/// Every metric with its samples: HELP and TYPE come first and once, samples of a metric together, and no two with the same labels.
fn parsed(text: &str) -> BTreeMap<String, Samples> {
    assert!(text.is_empty() || text.ends_with('\n'), "the last line ends");
    let mut metrics: BTreeMap<String, Samples> = BTreeMap::new();
    let mut lines = text.split_terminator('\n').peekable();
    while let Some(help) = lines.next() {
        let (name, said) = help.strip_prefix("# HELP ").and_then(|rest| rest.split_once(' ')).expect("HELP first");
        assert!(!said.is_empty() && !said.contains('\\'), "{help}");
        assert_eq!(lines.next(), Some(format!("# TYPE {name} gauge").as_str()));
        let mut samples = Samples::new();
        while let Some(line) = lines.next_if(|line| !line.starts_with('#')) {
            let mut reader = Reader(line.chars().peekable());
            assert_eq!(reader.name(true), name, "{line}");
            let mut labels = BTreeMap::new();
            if reader.0.next_if_eq(&'{').is_some() {
                loop {
                    let label = reader.name(false);
                    reader.takes('=');
                    assert!(!label.starts_with("__"), "{label} is reserved");
                    assert!(labels.insert(label, reader.label()).is_none(), "{line}");
                    if reader.0.next_if_eq(&',').is_none() {
                        break;
                    }
                }
                reader.takes('}');
            }
            reader.takes(' ');
            let value: String = reader.0.collect();
            let is_plain = value.chars().all(|c| c.is_ascii_digit() || "+-.eInfNa".contains(c));
            assert!(is_plain, "{value:?} is no number, or a timestamp follows");
            samples.push((labels, value.parse().unwrap_or_else(|_| panic!("{value:?}"))));
        }
        let distinct: BTreeSet<_> = samples.iter().map(|(labels, _)| labels).collect();
        assert_eq!(distinct.len(), samples.len(), "{name} has two samples with the same labels");
        assert!(
            !samples.is_empty() && metrics.insert(name.into(), samples).is_none(),
            "{name} is there twice or empty"
        );
    }
    metrics
}

fn value(metrics: &BTreeMap<String, Samples>, name: &str, label: Option<(&str, &str)>) -> Option<f64> {
    let has = |labels: &BTreeMap<String, String>| {
        label.is_none_or(|(name, value)| labels.get(name).map(String::as_str) == Some(value))
    };
    metrics.get(&format!("echolume_verify_{name}"))?.iter().find(|(labels, _)| has(labels)).map(|(_, value)| *value)
}

fn count(metrics: &BTreeMap<String, Samples>, result: &str) -> Option<f64> {
    value(metrics, "checks", Some(("result", result)))
}

#[test]
fn counts_times_and_conditions_come_back() {
    let mut run = run(1);
    fail(&mut run, "passes", "shade");
    check(&mut run, "modes", "plane").verdict = Verdict::Interrupted;
    let metrics = parsed(&prometheus(&run));
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
fn a_hostile_device_name_stays_a_label() {
    let mut run = run(1);
    run.device.name = "x\"} 1\necholume_verify_checks{result=\"failed\"} 0\n# HELP \\\u{1b}[2J".into();
    let metrics = parsed(&prometheus(&run));
    assert_eq!(metrics["echolume_verify_checks"].len(), 4);
    let name = &metrics["echolume_verify_info"][0].0["device"];
    assert_eq!(name, "x\"} 1\\necholume_verify_checks{result=\"failed\"} 0\\n# HELP \\\\u{1b}[2J");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn any_run_makes_metrics_that_add_up(run in any_run()) {
        let run: Run = run;
        let metrics = parsed(&prometheus(&run));
        let all: f64 = ["passed", "failed", "skipped", "interrupted"].iter().filter_map(|r| count(&metrics, r)).sum();
        prop_assert_eq!(all, run.outcomes.len() as f64);
    }
}
