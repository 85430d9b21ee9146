//! What Prometheus is told: the text format, read back by a parser that takes no more than it allows; and the rules and the dashboard of
//! tools/fleet, which name what the program exports.

mod fleet;
mod live;

use echolume::low_level::metrics::{Kind, Metric, table};
use std::collections::{BTreeMap, BTreeSet};

/// Labels of a sample and its value.
type Labelled = (BTreeMap<String, String>, f64);
type Samples = Vec<Labelled>;

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

/// Samples by name: that of the metric, with `_bucket`, `_sum` and `_count` those of histograms and summaries.
pub type Metrics = BTreeMap<String, Samples>;

/// A line: name, labels, value.
fn sample(line: &str) -> (String, BTreeMap<String, String>, f64) {
    let mut reader = Reader(line.chars().peekable());
    let (name, mut labels) = (reader.name(true), BTreeMap::new());
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
    (name, labels, value.parse().unwrap_or_else(|_| panic!("{value:?}")))
}

/// The names that samples of a metric have.
fn sample_names(metric: &Metric) -> Vec<String> {
    let endings: &[&str] = match metric.kind {
        Kind::Counter | Kind::Gauge => &[""],
        Kind::Summary => &["_sum", "_count"],
        Kind::Histogram => &["_bucket", "_sum", "_count"],
    };
    endings.iter().map(|ending| format!("{}{ending}", metric.name)).collect()
}

/// Reads a file of metrics. HELP and TYPE come first and once and are those of the table, samples of a metric together, with its labels, and
/// no two with the same.
pub fn parsed(text: &str) -> Metrics {
    assert!(text.is_empty() || text.ends_with('\n'), "the last line ends");
    let mut metrics = Metrics::new();
    let mut lines = text.split_terminator('\n').peekable();
    while let Some(help) = lines.next() {
        let (name, said) = help.strip_prefix("# HELP ").and_then(|rest| rest.split_once(' ')).expect("HELP first");
        let metric = table::ALL.iter().find(|metric| metric.name == name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(said, metric.help);
        assert_eq!(lines.next(), Some(format!("# TYPE {name} {}", metric.kind.name()).as_str()));
        let (names, mut found) = (sample_names(metric), Metrics::new());
        while let Some(line) = lines.next_if(|line| !line.starts_with('#')) {
            let (of, labels, value) = sample(line);
            assert!(names.contains(&of), "{line} after {help}");
            let told: Vec<&str> = labels.keys().map(String::as_str).filter(|label| *label != "le").collect();
            assert_eq!(
                told,
                BTreeSet::from_iter(metric.labels.iter().copied()).into_iter().collect::<Vec<_>>(),
                "{line}"
            );
            assert!(metric.kind != Kind::Counter || value >= 0.0, "{line}");
            found.entry(of).or_default().push((labels, value));
        }
        assert_eq!(BTreeSet::from_iter(found.keys()), BTreeSet::from_iter(&names), "{name}");
        if metric.kind == Kind::Histogram {
            histogram_holds(name, &found);
        }
        for (of, samples) in found {
            let distinct: BTreeSet<_> = samples.iter().map(|(labels, _)| labels).collect();
            assert_eq!(distinct.len(), samples.len(), "{of} has two samples with the same labels");
            assert!(metrics.insert(of, samples).is_none(), "{name} is there twice");
        }
    }
    metrics
}

/// Limits rise to infinity, where all values are counted.
fn histogram_holds(name: &str, found: &Metrics) {
    let limits = found[&format!("{name}_bucket")].iter().map(|(labels, count)| (labels["le"].parse::<f64>(), *count));
    let limits: Vec<(f64, f64)> = limits.map(|(limit, count)| (limit.expect("a limit"), count)).collect();
    assert!(limits.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 <= w[1].1), "{name}: {limits:?}");
    assert_eq!(limits.last(), Some(&(f64::INFINITY, found[&format!("{name}_count")][0].1)), "{name}");
}

#[test]
fn the_table_keeps_to_the_conventions_of_prometheus() {
    let mut names = BTreeSet::new();
    for Metric { name, kind, help, labels } in table::ALL {
        assert!(names.insert(*name), "{name} stands twice");
        assert!(name.starts_with("echolume_") && name.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{name}");
        assert_eq!(*kind == Kind::Counter, name.ends_with("_total"), "{name}");
        assert!(
            !["_count", "_sum", "_bucket", "_ms", "_ns", "_us", "_mib"].iter().any(|end| name.ends_with(end)),
            "{name}"
        );
        assert!(!help.is_empty() && !help.contains(['\\', '\n']), "{name}: {help}");
        assert!(labels.iter().all(|label| label.chars().all(|c| c.is_ascii_lowercase()) && *label != "le"), "{name}");
    }
}
