//! What `echolume verify` found: every check with its errors, times and faults, and what it ran on. Reports and comparisons with an
//! earlier run follow from it; nothing here runs a device.

pub mod baseline;
pub mod html;
pub mod json;
pub mod junit;
pub mod numbers;
pub mod words;

use crate::machine::Device;
use crate::picture::Picture;
use crate::profile::statistics::{Sample, SampleError};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Version of the JSON; another layout gets another name.
pub const FORMAT: &str = "echolume-verify-1";

#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    #[error("format is '{found}', this program reads '{FORMAT}'; verify again with it")]
    Format { found: String },
    #[error("not a verification: {0}")]
    Json(String),
    /// Contents that contradict themselves.
    #[error("{field}: {fault}")]
    Contents { field: String, fault: String },
}

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// What CI has time for: every pass, mode and path once.
    Quick,
    /// Every input of every pass in every scene, and a stress of minutes.
    Full,
}

/// One run of `echolume verify` on one device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// [`FORMAT`].
    pub format: String,
    /// Name, version and build of the program.
    pub program: String,
    /// When, by RFC 3339.
    pub date: String,
    pub device: Device,
    pub level: Level,
    /// Whether the validation layer with synchronization validation watched.
    pub validation: bool,
    /// s, all checks.
    pub seconds: f64,
    /// In running order.
    pub outcomes: Vec<Outcome>,
}

impl Run {
    pub fn failures(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|o| o.verdict == Verdict::Failed)
    }

    pub fn count(&self, verdict: Verdict) -> usize {
        self.outcomes.iter().filter(|o| o.verdict == verdict).count()
    }

    /// Outcomes of each group, groups in the order in which they first ran.
    pub fn groups(&self) -> Vec<(&str, Vec<&Outcome>)> {
        let mut places = HashMap::new();
        let mut groups: Vec<(&str, Vec<&Outcome>)> = Vec::new();
        for outcome in &self.outcomes {
            let place = *places.entry(outcome.group.as_str()).or_insert_with(|| {
                groups.push((&outcome.group, Vec::new()));
                groups.len() - 1
            });
            groups[place].1.push(outcome);
        }
        groups
    }
}

/// What came of one check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// What kind of check: `passes`, `modes`, `known answers` ...
    pub group: String,
    /// Unique in its group, and the same in every run of this version.
    pub name: String,
    pub verdict: Verdict,
    /// s, host's clock, reference included.
    pub seconds: f64,
    /// Errors and times that it measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// What a reader should know of it: why it was left out, what fell back to what.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Pictures that show it, right or wrong.
    #[serde(skip)]
    pub pictures: Vec<Shown>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Passed,
    Failed,
    /// Not run, because this device or system has not what it needs: the note says what.
    LeftOut,
}

/// A number that a check measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Unique in its check.
    pub what: String,
    /// The largest error; the median of times. Not a number where the output was none.
    #[serde(with = "json::any_number")]
    pub value: f64,
    /// The largest value that passes; none where any does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allowed: Option<f64>,
    pub unit: Unit,
    /// Times one by one, in the order measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub samples: Vec<f64>,
    /// Depends on when it was measured, and says nothing of the device: told, and never compared.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fleeting: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// In the units of what was compared: mm of distances, 1 of values that go from 0 to 1.
    Value,
    /// Steps of a picture of 8 bits.
    Levels,
    Millimetres,
    /// Nanoseconds.
    Ns,
    /// Of one.
    Share,
    Count,
}

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// One line: what is wrong.
    pub what: String,
    /// The pass at fault, where one is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pass: Option<String>,
    /// What it was given, in words.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub input: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst: Option<Worst>,
    /// Files that show it, once they are written: actual, expected, difference.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
}

/// The texel that is furthest off.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Worst {
    /// The output, by the shader's name.
    pub output: String,
    /// Column, row, slice.
    pub at: [usize; 3],
    pub channel: usize,
    #[serde(with = "json::any_number")]
    pub expected: f64,
    #[serde(with = "json::any_number")]
    pub got: f64,
    /// Texels beyond their tolerance.
    pub beyond: usize,
    pub texels: usize,
}

/// Two pictures that should be one.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// What they show, in a few words.
    pub what: String,
    pub actual: Picture,
    pub expected: Picture,
    /// Differences, as many times as they are as [`Shown::gain`] says, on black.
    pub difference: Picture,
    pub gain: u32,
    /// Index in the outcome's faults that they belong to.
    pub fault: Option<usize>,
}

impl Fault {
    pub fn new(what: impl Into<String>) -> Fault {
        Fault { what: what.into(), pass: None, input: String::new(), worst: None, files: Vec::new() }
    }
}

impl Figure {
    /// An error and what is allowed of it.
    pub fn error(what: impl Into<String>, value: f64, allowed: f64, unit: Unit) -> Figure {
        Figure { what: what.into(), value, allowed: Some(allowed), unit, samples: Vec::new(), fleeting: false }
    }

    /// Times of one and the same work in the order measured, ns.
    ///
    /// # Errors
    /// There are none, or one of them is not finite.
    pub fn times(what: impl Into<String>, samples: Vec<f64>) -> Result<Figure, SampleError> {
        let value = Sample::new(&samples)?.median();
        Ok(Figure { what: what.into(), value, allowed: None, unit: Unit::Ns, samples, fleeting: false })
    }

    /// How much of what is allowed it takes: beyond 1 fails, and what is not a number takes infinitely much. None where any
    /// value is allowed.
    pub fn used(&self) -> Option<f64> {
        let allowed = self.allowed?;
        Some(match self.value {
            value if value <= 0.0 && value <= allowed => 0.0,
            value if value.is_nan() || allowed <= 0.0 => f64::INFINITY,
            value => value / allowed,
        })
    }
}

impl Outcome {
    /// The figure that is nearest to what is allowed of it, or furthest beyond.
    pub fn tightest(&self) -> Option<&Figure> {
        let used = self.figures.iter().filter_map(|f| Some((f, f.used()?)));
        used.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(figure, _)| figure)
    }

    /// Group and name, as one would ask for it.
    pub fn title(&self) -> String {
        format!("{} / {}", crate::text::escaped(&self.group), crate::text::escaped(&self.name))
    }
}

impl Verdict {
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed => "failed",
            Verdict::LeftOut => "left out",
        }
    }
}

impl Level {
    pub fn word(self) -> &'static str {
        match self {
            Level::Quick => "quick",
            Level::Full => "full",
        }
    }
}
