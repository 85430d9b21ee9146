//! Numbers in flags.

use crate::terminal::{Failure, input};

/// Refuses the number of a flag unless `is_allowed` returns true for it. None is a flag that was not given. `flag`: its name, and `rule`: which numbers
/// it takes, such as `must lie in 0..=1`, for the message.
pub fn check_number(
    flag: &str,
    number: impl Into<Option<f64>>,
    is_allowed: impl Fn(f64) -> bool,
    rule: &str,
) -> Result<(), Failure> {
    match number.into() {
        Some(number) if !is_allowed(number) => Err(input(format!("{flag} {number}: {rule}"))),
        _ => Ok(()),
    }
}
