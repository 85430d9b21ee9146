//! What the program tells Prometheus: the table of all metrics ([`table`]), the text format that they are written in ([`text_format`]), and
//! the file that holds them while the program runs ([`textfile`]). Who measures something writes it by a metric of the table, so that
//! rules and dashboards are tested against the same names.

pub mod histogram;
pub mod table;
pub mod text_format;
pub mod textfile;

/// What a metric counts or measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Only grows, until the program starts again.
    Counter,
    /// Goes up and down.
    Gauge,
    /// Counts of values by limits.
    Histogram,
    /// Sum and number of values.
    Summary,
}

impl Kind {
    /// As the line `# TYPE` names it.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Counter => "counter",
            Kind::Gauge => "gauge",
            Kind::Histogram => "histogram",
            Kind::Summary => "summary",
        }
    }
}

/// A metric: its name with the unit, what it is, and the names of its labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metric {
    pub name: &'static str,
    pub kind: Kind,
    /// One sentence without backslashes and line breaks.
    pub help: &'static str,
    pub labels: &'static [&'static str],
}
