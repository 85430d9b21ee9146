//! Times in flags.

use crate::terminal::{Failure, input};

/// Parses a time above 0 such as 16ms, 0.25s or 250us, always with a unit; the result is in ns. `flag`: name of the flag for messages.
pub fn parse_nanoseconds(flag: &str, text: &str) -> Result<f64, Failure> {
    let units = [("ms", 1e6), ("us", 1e3), ("ns", 1.0), ("s", 1e9)];
    let parsed =
        units.iter().find_map(|(unit, ns)| text.strip_suffix(unit)?.trim().parse::<f64>().ok().map(|v| v * ns));
    match parsed {
        Some(ns) if ns > 0.0 && ns.is_finite() => Ok(ns),
        _ => Err(input(format!("{flag} {text}: must be a time such as 16ms or 0.25s"))),
    }
}
