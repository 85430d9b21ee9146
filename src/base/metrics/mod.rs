//! Metrics for Prometheus: the table of all metrics ([`table`]), their text format ([`text_format`]), and the file that holds them while
//! the program runs ([`textfile`]). Every value is written by a metric of the table, so that rules and dashboards are tested against the
//! same names.

pub mod histogram;
pub mod table;
pub mod text_format;
pub mod textfile;

use crate::tree::Name;

/// Kind of a metric in the Prometheus sense. Its name is the word of the line `# TYPE` of Prometheus' text format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Name)]
#[tree(rename_all = "lowercase")]
pub enum Kind {
    /// A value that only grows until the program restarts.
    Counter,
    /// A value that rises and falls.
    Gauge,
    /// A histogram: numbers of values up to given limits.
    Histogram,
    /// Sum and number of values.
    Summary,
}

/// Declaration of a Prometheus metric: its name, which includes the unit, its kind, its help text and the names of its labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metric {
    pub name: &'static str,
    pub kind: Kind,
    /// Description of the metric: one sentence without backslashes and line breaks.
    pub help: &'static str,
    pub labels: &'static [&'static str],
}
