//! The result of `echolume verify`: every check with its errors, times and faults, and the device it ran on; and its reports as JSON (here),
//! text, JUnit XML and HTML. Nothing here runs a device.

pub mod baseline;
pub mod html;
pub mod junit;
pub mod numbers;
pub mod summary;

use crate::machine::Device;
use crate::picture::Picture;
use crate::profile::statistics::{Sample, SampleError};
use crate::text::escaped;
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, HashSet};

/// Version of the JSON format.
pub const FORMAT: &str = "echolume-verify-1";

/// Why a run cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    #[error("format is '{found}', this program reads '{FORMAT}'; verify again with it")]
    Format { found: String },
    #[error("not a verification: {0}")]
    Json(String),
    /// Inconsistent contents.
    #[error("{field}: {fault}")]
    Contents { field: String, fault: String },
}

/// How much to check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// For CI: every pass, mode and path once.
    Quick,
    /// Every input of every pass in every scene, and a stress test of some minutes.
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
    /// Time of the run, RFC 3339.
    pub date: String,
    pub device: Device,
    pub level: Level,
    /// True if the validation layer with synchronization validation was active.
    pub validation: bool,
    /// Duration of all checks, s.
    pub seconds: f64,
    /// In running order.
    pub outcomes: Vec<Outcome>,
}

impl Run {
    /// Outcomes of the failed checks.
    pub fn failures(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|o| o.verdict == Verdict::Failed)
    }

    /// Number of checks with this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.outcomes.iter().filter(|o| o.verdict == verdict).count()
    }

    /// Outcomes by group, groups in the order in which they first ran.
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

/// The result of one check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// Group of checks: `passes`, `modes`, `known answers` ...
    pub group: String,
    /// Unique in its group, and the same in every run of this version.
    pub name: String,
    pub verdict: Verdict,
    /// Duration by the clock of the host, reference included, s.
    pub seconds: f64,
    /// Measured errors and times.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// Remarks: why it was left out, which fallbacks were used.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Comparison pictures, of passed checks too.
    #[serde(skip)]
    pub pictures: Vec<PictureComparison>,
}

/// Verdict of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Passed,
    Failed,
    /// Not run, because this device or system lacks something; the notes say what.
    LeftOut,
}

/// A number that a check measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Unique in its check.
    pub what: String,
    /// The largest error, or the median of times. NaN if the output was NaN.
    #[serde(with = "any_number")]
    pub value: f64,
    /// The maximum value that passes; None if any does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allowed: Option<f64>,
    pub unit: Unit,
    /// Single times, in the order measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub samples: Vec<f64>,
    /// Depends on circumstances of the run, not on the device: reported, but never compared.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fleeting: bool,
}

/// Unit of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// The unit of the compared output: mm for distances, 1 for values from 0 to 1.
    Value,
    /// Levels of an 8-bit picture.
    Levels,
    Millimetres,
    /// Nanoseconds.
    Ns,
    /// A share, 0..1.
    Share,
    Count,
}

/// A detected fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// One line: what is wrong.
    pub what: String,
    /// The pass at fault, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pass: Option<String>,
    /// Description of the input.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub input: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst: Option<Worst>,
    /// Picture files once they are written: actual, expected, difference.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
}

/// The texel with the largest error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Worst {
    /// Name of the output in the shader.
    pub output: String,
    /// Column, row, slice.
    pub at: [usize; 3],
    pub channel: usize,
    #[serde(with = "any_number")]
    pub expected: f64,
    #[serde(with = "any_number")]
    pub got: f64,
    /// Number of texels beyond tolerance.
    pub beyond: usize,
    /// Number of texels.
    pub texels: usize,
}

/// A picture with the expected one and their difference.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureComparison {
    /// Short description.
    pub what: String,
    pub actual: Picture,
    pub expected: Picture,
    /// Differences on black, multiplied by the gain.
    pub difference: Picture,
    pub gain: u32,
    /// Index of the fault, in the outcome, that they belong to.
    pub fault: Option<usize>,
}

impl Fault {
    /// A fault with only a description.
    pub fn new(what: impl Into<String>) -> Fault {
        Fault { what: what.into(), pass: None, input: String::new(), worst: None, files: Vec::new() }
    }
}

impl Figure {
    /// An error with its limit.
    pub fn error(what: impl Into<String>, value: f64, allowed: f64, unit: Unit) -> Figure {
        Figure { what: what.into(), value, allowed: Some(allowed), unit, samples: Vec::new(), fleeting: false }
    }

    /// Times of the same work in the order measured, ns.
    ///
    /// # Errors
    /// There is no time, or one is not finite.
    pub fn times(what: impl Into<String>, samples: Vec<f64>) -> Result<Figure, SampleError> {
        let value = Sample::new(&samples)?.median();
        Ok(Figure { what: what.into(), value, allowed: None, unit: Unit::Ns, samples, fleeting: false })
    }

    /// Value over limit: above 1 fails, and NaN gives infinity. None without limit.
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
    /// The figure that is closest to its limit, or furthest beyond.
    pub fn tightest(&self) -> Option<&Figure> {
        let used = self.figures.iter().filter_map(|f| Some((f, f.used()?)));
        used.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(figure, _)| figure)
    }

    /// Group and name.
    pub fn title(&self) -> String {
        format!("{} / {}", escaped(&self.group), escaped(&self.name))
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

/// Maximum number of outcomes of a run in a file.
pub const MAX_OUTCOMES: usize = 100_000;
/// Maximum number of times of one figure in a file.
pub const MAX_SAMPLES: usize = 100_000;

/// A run as JSON. Every number is exact, including NaN and infinities; pictures are omitted.
///
/// # Errors
/// One line: [`Run::check`] refuses it.
pub fn to_json(run: &Run) -> Result<String, VerifyError> {
    run.check()?;
    let mut text = serde_json::to_string_pretty(run).map_err(|e| VerifyError::Json(escaped(&e.to_string())))?;
    text.push('\n');
    Ok(text)
}

/// Reads a run. Any text gives a consistent run or an error.
///
/// # Errors
/// One line: another format, no JSON of a run, or contents that [`Run::check`] refuses.
pub fn from_json(text: &str) -> Result<Run, VerifyError> {
    /// Read first, to distinguish a run of another version from a file that is none.
    #[derive(Deserialize)]
    struct Version {
        format: String,
    }
    let fault = |e: serde_json::Error| VerifyError::Json(escaped(&e.to_string()));
    let version: Version = serde_json::from_str(text).map_err(fault)?;
    if version.format != FORMAT {
        return Err(VerifyError::Format { found: escaped(&version.format) });
    }
    let run: Run = serde_json::from_str(text).map_err(fault)?;
    run.check()?;
    Ok(run)
}

/// A field, and what is wrong with it.
type FieldFault = (String, String);

impl Run {
    /// Checks that names are unique, lists bounded, and times and limits finite. Errors and values may be anything, since NaN from a
    /// device is a valid finding.
    ///
    /// # Errors
    /// One line: the first inconsistent field.
    pub fn check(&self) -> Result<(), VerifyError> {
        if self.format != FORMAT {
            return Err(VerifyError::Format { found: escaped(&self.format) });
        }
        self.fault().map_or(Ok(()), |(field, fault)| Err(VerifyError::Contents { field, fault }))
    }

    fn fault(&self) -> Option<FieldFault> {
        if let Some(fault) = not_a_time(self.seconds) {
            return Some(("seconds".into(), fault));
        }
        if let Some(fault) = not_a_time(self.device.timestamp_period_ns) {
            return Some(("timestamp_period_ns".into(), fault));
        }
        if self.outcomes.len() > MAX_OUTCOMES {
            let count = self.outcomes.len();
            return Some(("outcomes".into(), format!("are {count}, of which at most {MAX_OUTCOMES} are read")));
        }
        let mut names = HashSet::new();
        for (at, outcome) in self.outcomes.iter().enumerate() {
            if outcome.group.is_empty() || outcome.name.is_empty() {
                return Some((format!("outcome {at}"), "has no group or no name".into()));
            }
            if !names.insert((&outcome.group, &outcome.name)) {
                return Some((outcome.title(), "is there twice".into()));
            }
            if let Some(fault) = outcome_fault(outcome) {
                return Some((outcome.title(), fault));
            }
        }
        None
    }
}

fn not_a_time(value: f64) -> Option<String> {
    (!(value.is_finite() && value >= 0.0)).then(|| format!("{value} is not finite and at least 0"))
}

fn outcome_fault(outcome: &Outcome) -> Option<String> {
    let seconds = not_a_time(outcome.seconds).map(|fault| format!("seconds: {fault}"));
    let mut names = HashSet::new();
    let figure = |figure: &Figure| {
        if !names.insert(figure.what.clone()) {
            return Some(format!("figure '{}' is there twice", escaped(&figure.what)));
        }
        figure_fault(figure).map(|fault| format!("figure '{}' {fault}", escaped(&figure.what)))
    };
    let worst = |worst: &Worst| {
        let Worst { beyond, texels, .. } = worst;
        (beyond > texels).then(|| format!("{beyond} texels beyond their tolerance, of {texels}"))
    };
    seconds
        .or_else(|| outcome.figures.iter().find_map(figure))
        .or_else(|| outcome.faults.iter().filter_map(|f| f.worst.as_ref()).find_map(worst))
}

fn figure_fault(figure: &Figure) -> Option<String> {
    if let Some(allowed) = figure.allowed.filter(|a| !a.is_finite()) {
        return Some(format!("allows {allowed}, which is not finite; where any value passes nothing is written"));
    }
    let count = figure.samples.len();
    if count > MAX_SAMPLES {
        return Some(format!("has {count} samples, of which at most {MAX_SAMPLES} are read"));
    }
    let sample = |(at, value): (usize, &f64)| Some(format!("sample {at}: {}", not_a_time(*value)?));
    figure.samples.iter().enumerate().find_map(sample)
}

/// Serialization of numbers that may not be finite. JSON has no such numbers: they are the strings `NaN`, `Infinity` and `-Infinity`.
mod any_number {
    use serde::de::{Error, Unexpected, Visitor};
    use serde::{Deserializer, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        match value {
            v if v.is_nan() => serializer.serialize_str("NaN"),
            v if v.is_infinite() && *v > 0.0 => serializer.serialize_str("Infinity"),
            v if v.is_infinite() => serializer.serialize_str("-Infinity"),
            v => serializer.serialize_f64(*v),
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        deserializer.deserialize_any(Number)
    }

    struct Number;

    impl Visitor<'_> for Number {
        type Value = f64;

        fn expecting(&self, to: &mut std::fmt::Formatter) -> std::fmt::Result {
            to.write_str("a number, \"NaN\", \"Infinity\" or \"-Infinity\"")
        }

        fn visit_f64<E: Error>(self, value: f64) -> Result<f64, E> {
            Ok(value)
        }

        fn visit_u64<E: Error>(self, value: u64) -> Result<f64, E> {
            Ok(value as f64)
        }

        fn visit_i64<E: Error>(self, value: i64) -> Result<f64, E> {
            Ok(value as f64)
        }

        fn visit_str<E: Error>(self, text: &str) -> Result<f64, E> {
            match text {
                "NaN" => Ok(f64::NAN),
                "Infinity" => Ok(f64::INFINITY),
                "-Infinity" => Ok(f64::NEG_INFINITY),
                _ => Err(E::invalid_value(Unexpected::Str(text), &self)),
            }
        }
    }
}
