//! tools/fleet: rules and dashboard name what the program exports, and every rule has a test.

use super::sample_names;
use crate::common::files::repository;
use echolume::low_level::metrics::{Metric, table};
use serde_json::Value;
use std::collections::BTreeSet;
use std::process::Command;

fn read(name: &str) -> String {
    std::fs::read_to_string(repository("tools/fleet").join(name)).expect(name)
}

/// Every expression of the dashboard.
fn expressions(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            found.extend(object.get("expr").and_then(Value::as_str).map(str::to_string));
            object.values().for_each(|inner| expressions(inner, found));
        }
        Value::Array(array) => array.iter().for_each(|inner| expressions(inner, found)),
        _ => {}
    }
}

/// Every expression of the rules; they may be folded over several lines.
fn rules(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        let Some(first) = line.trim_start().strip_prefix("expr: ") else { continue };
        let indent = line.len() - line.trim_start().len();
        let mut expression = first.trim_start_matches(">-").to_string();
        while let Some(more) = lines.next_if(|next| next.len() - next.trim_start().len() > indent) {
            expression.push(' ');
            expression.push_str(more.trim());
        }
        found.push(expression);
    }
    found
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// The texts between `open` and `close`, without nesting.
fn between<'a>(text: &'a str, open: &str, close: char) -> Vec<&'a str> {
    text.split(open).skip(1).filter_map(|rest| rest.split(close).next()).collect()
}

/// Checks that an expression names metrics that are exported, with labels that they have.
fn names_what_is_exported(expression: &str) {
    // Texts in quotes are values.
    let plain: String = expression.split('"').step_by(2).collect::<Vec<_>>().join("''");
    let mut labels = BTreeSet::from(["instance"]);
    let mut count = 0;
    for word in words(&plain).filter(|word| word.starts_with("echolume_") || word.starts_with("node_")) {
        count += 1;
        if word == "node_textfile_scrape_error" {
            continue;
        }
        let is_it = |metric: &&Metric| sample_names(metric).iter().any(|name| name == word);
        let metric = table::ALL.iter().find(is_it).unwrap_or_else(|| panic!("{word} is not exported: {expression}"));
        labels.extend(metric.labels);
        labels.extend(word.ends_with("_bucket").then_some("le"));
    }
    assert!(count > 0, "no metric in {expression}");
    let matched = between(&plain, "{", '}').into_iter().flat_map(|inside| inside.split(','));
    let matched = matched.filter_map(|matcher| words(matcher).next());
    for label in matched.chain(between(&plain, "by (", ')').into_iter().flat_map(words)) {
        assert!(labels.contains(label), "no metric has the label {label}: {expression}");
    }
}

#[test]
fn the_dashboard_and_the_rules_name_what_is_exported() {
    let dashboard: Value = serde_json::from_str(&read("dashboard.json")).expect("JSON");
    let (mut found, rules) = (Vec::new(), rules(&read("alerts.yml")));
    expressions(&dashboard, &mut found);
    assert!(found.len() > 30 && rules.len() > 15, "{} and {}", found.len(), rules.len());
    found.iter().chain(&rules).for_each(|expression| names_what_is_exported(expression));
    // Nothing is exported that nobody looks at.
    let all = [found, rules].concat().join(" ");
    let named: BTreeSet<&str> = words(&all).collect();
    for metric in table::ALL {
        assert!(sample_names(metric).iter().any(|name| named.contains(name.as_str())), "{}", metric.name);
    }
}

#[test]
#[should_panic(expected = "is not exported")]
fn a_metric_that_is_not_exported_is_found() {
    names_what_is_exported("rate(echolume_frames[5m]) > 1");
}

#[test]
#[should_panic(expected = "no metric has the label")]
fn a_label_that_no_metric_has_is_found() {
    names_what_is_exported(r#"sum by (instance) (echolume_volumes_total{reason="shown"})"#);
}

#[test]
fn every_alert_has_a_test_in_which_it_fires() {
    let (alerts, tests) = (read("alerts.yml"), read("alerts_test.yml"));
    let names: BTreeSet<&str> = alerts.lines().filter_map(|l| l.trim().strip_prefix("- alert: ")).collect();
    assert_eq!(names.len(), rules(&alerts).len(), "each name once");
    for name in names {
        assert!(tests.contains(&format!("alertname: {name}\n        exp_alerts:\n          - exp_labels:")), "{name}");
    }
}

#[test]
fn every_metric_is_described() {
    let [live, verify] =
        ["docs/fleet.md", "docs/verify.md"].map(|page| std::fs::read_to_string(repository(page)).expect(page));
    for Metric { name, labels, .. } in table::ALL {
        let short = name.trim_start_matches("echolume_");
        let (page, short) = short.strip_prefix("verify_").map_or((&live, short), |short| (&verify, short));
        let line = page.lines().find(|line| line.starts_with(&format!("| `{short}` |")));
        let line = line.unwrap_or_else(|| panic!("{name}: no line of a table describes {short}"));
        assert!(labels.iter().all(|label| line.contains(&format!("`{label}`"))), "{name}: {line}");
    }
}

#[test]
fn the_scripts_are_bash() {
    for name in ["check", "verify-nightly"] {
        let checked = Command::new("bash").arg("-n").arg(repository("tools/fleet").join(name)).output().expect("bash");
        assert!(checked.status.success(), "{name}: {}", String::from_utf8_lossy(&checked.stderr));
    }
}
