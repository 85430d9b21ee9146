//! What the program tells Prometheus: the table of all metrics ([`table`]) and the text format that they are written in
//! ([`text_format`]). Who measures something writes it by a metric of the table, so that rules and dashboards are tested against the
//! same names.

pub mod table;
pub mod text_format;

/// What a metric counts or measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Goes up or down.
    Gauge,
}

impl Kind {
    /// As the line `# TYPE` names it.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Gauge => "gauge",
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
