//! Runs as JSON, which comes back as it went but for its pictures.

use super::{FORMAT, Figure, Outcome, Run, VerifyError, Worst};
use crate::text::escaped;
use serde::Deserialize;
use std::collections::HashSet;

/// Outcomes of a run: a file beyond is none of ours.
pub const MOST_OUTCOMES: usize = 100_000;
/// Times of one figure.
pub const MOST_SAMPLES: usize = 100_000;

/// Every number as it is, also those that JSON has no numbers for. Pictures are left out.
///
/// # Errors
/// One line: [`Run::check`] refuses it.
pub fn to_json(run: &Run) -> Result<String, VerifyError> {
    run.check()?;
    let mut text = serde_json::to_string_pretty(run).map_err(|e| VerifyError::Json(escaped(&e.to_string())))?;
    text.push('\n');
    Ok(text)
}

/// Total: any text gives a run that agrees with itself, or an error.
///
/// # Errors
/// One line: another format, no JSON of a run, or contents that [`Run::check`] refuses.
pub fn from_json(text: &str) -> Result<Run, VerifyError> {
    /// Read first: a run of another version is told from a file that is none.
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

/// A field, what is wrong with it.
type Fault = (String, String);

impl Run {
    /// That names are unique, lists bounded, and times and tolerances are numbers. Errors and values may be anything: that a
    /// device gave no number is a finding.
    ///
    /// # Errors
    /// One line: the first field that is not so.
    pub fn check(&self) -> Result<(), VerifyError> {
        if self.format != FORMAT {
            return Err(VerifyError::Format { found: escaped(&self.format) });
        }
        self.fault().map_or(Ok(()), |(field, fault)| Err(VerifyError::Contents { field, fault }))
    }

    fn fault(&self) -> Option<Fault> {
        if let Some(fault) = not_a_time(self.seconds) {
            return Some(("seconds".into(), fault));
        }
        if let Some(fault) = not_a_time(self.device.timestamp_period_ns) {
            return Some(("timestamp_period_ns".into(), fault));
        }
        if self.outcomes.len() > MOST_OUTCOMES {
            let count = self.outcomes.len();
            return Some(("outcomes".into(), format!("are {count}, of which at most {MOST_OUTCOMES} are read")));
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
    if count > MOST_SAMPLES {
        return Some(format!("has {count} samples, of which at most {MOST_SAMPLES} are read"));
    }
    let sample = |(at, value): (usize, &f64)| Some(format!("sample {at}: {}", not_a_time(*value)?));
    figure.samples.iter().enumerate().find_map(sample)
}

/// Numbers that need not be finite. JSON has no such numbers: they are the texts `NaN`, `Infinity` and `-Infinity`.
pub(super) mod any_number {
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
