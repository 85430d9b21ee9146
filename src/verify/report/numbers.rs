//! Formatting of numbers with units, with as many digits as a reader needs.

use super::{Figure, Unit};

/// Significant digits.
const DIGITS: usize = 3;
/// Significant digits that distinguish all f64.
const MAX_DIGITS: usize = 17;

/// Three significant digits; scientific notation for very large and very small numbers.
pub fn number(value: f64) -> String {
    to_digits(value, DIGITS)
}

fn to_digits(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "NaN".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "infinity".into() } else { "-infinity".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let power = value.abs().log10().floor() as i32;
    let trimmed = |text: String| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    };
    if (-3..6).contains(&power) {
        let decimals = (digits as i32 - 1 - power).max(0) as usize;
        return trimmed(format!("{value:.decimals$}"));
    }
    let text = format!("{value:.*e}", digits - 1);
    match text.split_once('e') {
        Some((mantissa, power)) => format!("{}e{power}", trimmed(mantissa.into())),
        None => text,
    }
}

/// The factor and the suffix with which values of a unit are printed.
fn scale(unit: Unit, largest: f64) -> (f64, &'static str) {
    match unit {
        Unit::Value | Unit::Count => (1.0, ""),
        Unit::Levels => (1.0, " levels"),
        Unit::Millimetres => (1.0, " mm"),
        Unit::Share => (100.0, " %"),
        Unit::Ns if largest >= 1e9 => (1e-9, " s"),
        Unit::Ns if largest >= 1e6 => (1e-6, " ms"),
        Unit::Ns if largest >= 1e3 => (1e-3, " us"),
        Unit::Ns => (1.0, " ns"),
    }
}

/// A value times a factor with this many significant digits; counts with all digits.
fn shown(value: f64, unit: Unit, factor: f64, digits: usize) -> String {
    match unit {
        Unit::Count if value.fract() == 0.0 && value.abs() < 1e15 => format!("{value:.0}"),
        _ => to_digits(value * factor, digits),
    }
}

/// A value with its unit.
pub fn amount(value: f64, unit: Unit) -> String {
    let (factor, word) = scale(unit, value);
    match shown(value, unit, factor, DIGITS) {
        one if one == "1" && unit == Unit::Levels => "1 level".into(),
        shown => shown + word,
    }
}

/// Two values with enough digits to distinguish them, and their unit.
fn distinguishable(values: [f64; 2], unit: Unit) -> ([String; 2], &'static str) {
    let (factor, word) = scale(unit, values[0].abs().max(values[1].abs()));
    let with = |digits| values.map(|v| shown(v, unit, factor, digits));
    let texts = (DIGITS..=MAX_DIGITS).map(with).find(|[a, b]| a != b || values[0] == values[1]);
    (texts.unwrap_or_else(|| with(DIGITS)), word)
}

/// Expected and actual value with enough digits to distinguish them.
pub fn expected_and_got(expected: f64, got: f64) -> [String; 2] {
    distinguishable([expected, got], Unit::Value).0
}

/// Two values and their unit: `0.8 -> 1.9 levels`.
pub fn change(old: f64, new: f64, unit: Unit) -> String {
    let ([old, new], word) = distinguishable([old, new], unit);
    format!("{old} -> {new}{word}")
}

/// A figure's value and its limit: `0.8 of 2 levels`.
pub fn value_of_limit(figure: &Figure) -> String {
    let Some(allowed) = figure.allowed else { return amount(figure.value, figure.unit) };
    let ([value, allowed], word) = distinguishable([figure.value, allowed], figure.unit);
    let word = if allowed == "1" && figure.unit == Unit::Levels { " level" } else { word };
    format!("{value} of {allowed}{word}")
}

/// A share in integer percent; 100 only if exactly 1.
pub fn percent(share: f64) -> String {
    match share {
        s if !s.is_finite() || s >= 100.0 => "over 9999 %".into(),
        s if s > 1.0 => format!("{:.0} %", (s * 100.0).ceil()),
        s if s > 0.0 && s < 0.01 => "under 1 %".into(),
        s if s < 1.0 => format!("{:.0} %", (s * 100.0).floor()),
        _ => "100 %".into(),
    }
}

/// A duration, given in s.
pub fn seconds(s: f64) -> String {
    match s {
        s if s >= 3600.0 => format!("{} h {} min", (s / 3600.0) as u64, ((s % 3600.0) / 60.0) as u64),
        s if s >= 120.0 => format!("{} min {} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s if s >= 10.0 => format!("{s:.0} s"),
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 0.001 => format!("{:.0} ms", s * 1e3),
        s if s > 0.0 => "under 1 ms".into(),
        _ => "0 s".into(),
    }
}
