//! Prometheus' text format, for the textfile collector of its node exporter.

use super::Metric;
use super::histogram::Histogram;
use crate::text::escaped;
use std::fmt::Write as _;

/// Text in Prometheus' format that is being composed. Metrics without a sample are left out.
#[derive(Default)]
pub struct Exposition(String);

impl Exposition {
    /// Appends a metric without labels and its value.
    pub fn number(&mut self, metric: &Metric, value: f64) {
        self.numbers(metric, [(Vec::new(), value)]);
    }

    /// Appends a metric with labels. Each sample has the values of its labels, in the order of [`Metric::labels`], and its value. No two samples
    /// may have the same labels.
    pub fn numbers(&mut self, metric: &Metric, samples: impl IntoIterator<Item = (Vec<String>, f64)>) {
        for (n, (labels, value)) in samples.into_iter().enumerate() {
            if n == 0 {
                self.head(metric);
            }
            self.sample(metric.name, metric.labels, &labels, value);
        }
    }

    /// Appends a metric of the kind [`Kind::Histogram`](super::Kind::Histogram).
    pub fn histogram(&mut self, metric: &Metric, values: &Histogram) {
        self.head(metric);
        let name = metric.name;
        for (limit, count) in values.cumulative() {
            self.sample(&format!("{name}_bucket"), &["le"], &[number(limit)], count as f64);
        }
        self.sample(&format!("{name}_sum"), &[], &[], values.sum());
        self.sample(&format!("{name}_count"), &[], &[], values.count() as f64);
    }

    /// Appends a metric of the kind [`Kind::Summary`](super::Kind::Summary). Each sample has the values of its labels, the sum of its
    /// observations and their number.
    pub fn summary(&mut self, metric: &Metric, samples: impl IntoIterator<Item = (Vec<String>, f64, u64)>) {
        for (n, (labels, sum, count)) in samples.into_iter().enumerate() {
            if n == 0 {
                self.head(metric);
            }
            self.sample(&format!("{}_sum", metric.name), metric.labels, &labels, sum);
            self.sample(&format!("{}_count", metric.name), metric.labels, &labels, count as f64);
        }
    }

    /// The complete text.
    pub fn into_text(self) -> String {
        self.0
    }

    fn head(&mut self, Metric { name, kind, help, .. }: &Metric) {
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {}", kind.name());
    }

    fn sample(&mut self, name: &str, labels: &[&str], values: &[String], value: f64) {
        let labels: Vec<String> =
            labels.iter().zip(values).map(|(label, value)| format!("{label}=\"{}\"", quoted(value))).collect();
        let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
        let _ = writeln!(self.0, "{name}{labels} {}", number(value));
    }
}

/// A label's value: bounded, on one line, with backslashes and quotes escaped.
fn quoted(text: &str) -> String {
    escaped(text).replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// A value as Go parses it.
fn number(value: f64) -> String {
    match value {
        v if v.is_nan() => "NaN".into(),
        v if v.is_infinite() => if v > 0.0 { "+Inf" } else { "-Inf" }.into(),
        v => format!("{v}"),
    }
}
