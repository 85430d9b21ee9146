//! Errors and counts of two runs: which grew, which shrank.

use super::{Change, Class, Pair};
use crate::text::escaped;
use crate::verify::report::Unit;
use crate::verify::report::numbers::{amount, change};

/// By what share an error must differ to be told.
const SHARE: f64 = 0.01;

/// And by how much: a rounding of single precision, at the scale of what is compared.
const ROUNDING: f64 = f32::EPSILON as f64;

/// What changed in the figures that are no times.
pub(super) fn judged(pairs: &[Pair]) -> Vec<Change> {
    let others = pairs.iter().filter(|p| p.new.unit != Unit::Ns);
    others.flat_map(|pair| [value(pair), tolerance(pair)]).flatten().collect()
}

/// The same number, as far as rounding can tell; counts are exact.
fn is_same(old: f64, new: f64, unit: Unit) -> bool {
    if unit == Unit::Count || !(old.is_finite() && new.is_finite()) {
        return old == new || (old.is_nan() && new.is_nan());
    }
    let largest = old.abs().max(new.abs());
    (new - old).abs() <= (SHARE * largest).max(ROUNDING * largest.max(1.0))
}

fn value(pair: &Pair) -> Option<Change> {
    let (old, new, unit) = (pair.old.value, pair.new.value, pair.new.unit);
    if is_same(old, new, unit) {
        return None;
    }
    let [was_beyond, is_beyond] = [pair.old, pair.new].map(|f| f.used().is_some_and(|used| used > 1.0));
    // Not a number is worse than any.
    let grew = new > old || (new.is_nan() && !old.is_nan());
    let is_error = pair.new.allowed.is_some() || !matches!(unit, Unit::Count | Unit::Share);
    let class = match (was_beyond, is_beyond) {
        (false, true) => Class::Worse,
        _ if is_error && !grew => Class::Better,
        _ => Class::Changed,
    };
    let still = |allowed| match (was_beyond, is_beyond) {
        (false, false) => format!(", still under {}", bare(allowed, unit)),
        (true, true) => format!(", still over {}", bare(allowed, unit)),
        (false, true) => format!(", now over {}", bare(allowed, unit)),
        (true, false) => format!(", now under {}", bare(allowed, unit)),
    };
    let allowed = pair.new.allowed.map_or_else(String::new, still);
    let what = escaped(&pair.new.what);
    Some(Change::new(class, pair.of, format!("{what} {}{allowed}", change(old, new, unit))))
}

/// The unit was just told.
fn bare(allowed: f64, unit: Unit) -> String {
    let shown = amount(allowed, unit);
    shown.split(' ').next().unwrap_or(&shown).into()
}

/// A tolerance that another version of the program allows.
fn tolerance(pair: &Pair) -> Option<Change> {
    let (old, new, unit) = (pair.old.allowed, pair.new.allowed, pair.new.unit);
    if old == new {
        return None;
    }
    let told = match (old, new) {
        (Some(old), Some(new)) => change(old, new, unit),
        (_, new) => {
            let word = |allowed: Option<f64>| allowed.map_or_else(|| "any".into(), |a| amount(a, unit));
            format!("{} -> {}", word(old), word(new))
        }
    };
    Some(Change::new(Class::Changed, pair.of, format!("{}: allowed {told}", escaped(&pair.new.what))))
}
