//! The order of an error: the slope of its logarithm over that of the step.

use serde::{Deserialize, Serialize};

/// What is fitted, and what is not: an order shows only between the steps that are too coarse to be in the limit and the
/// errors that are too small to be the step's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Least and largest step, in the dial's unit.
    pub step: [f64; 2],
    /// What the error goes to whatever the step (rounding, the texture's format). Points below `ABOVE_FLOOR` times it are
    /// left out: there it bends the line by more than 5 %.
    pub floor: f64,
}

/// Errors that add as squares: at three times the floor the step's own part is sqrt(1 - 1/9) = 94 % of the whole.
pub const ABOVE_FLOOR: f64 = 3.0;

/// error = coefficient * step^order, by least squares on the logarithms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    pub order: f64,
    /// Standard error of the order, from how far the points lie off the line.
    pub standard_error: f64,
    pub coefficient: f64,
    /// What was fitted.
    pub range: Range,
    /// Points within it.
    pub points: usize,
}

impl Fit {
    pub fn at(&self, step: f64) -> f64 {
        self.coefficient * step.powf(self.order)
    }
}

/// Fits pairs of step and error within a range.
///
/// # Errors
/// One line when fewer than three different steps are left in the range: a line through two points has no standard error.
pub fn fit(pairs: &[[f64; 2]], range: Range) -> Result<Fit, String> {
    let [low, high] = range.step;
    let fitted = |[step, error]: &&[f64; 2]| {
        let counts = error.is_finite() && *error > 0.0 && *error >= ABOVE_FLOOR * range.floor;
        // A share of 1e-9 forgives steps that were computed.
        counts && *step > 0.0 && *step >= low * (1.0 - 1e-9) && *step <= high * (1.0 + 1e-9)
    };
    let logs: Vec<[f64; 2]> = pairs.iter().filter(fitted).map(|p| p.map(f64::ln)).collect();
    let mut steps: Vec<f64> = logs.iter().map(|p| p[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.dedup();
    if steps.len() < 3 {
        let (floor, left) = (ABOVE_FLOOR * range.floor, steps.len());
        return Err(format!(
            "order: {left} steps in {low}..={high} with errors above {floor:.1e}, at least 3 are fitted"
        ));
    }
    let n = logs.len() as f64;
    let mean = |axis: usize| logs.iter().map(|p| p[axis]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let spread: f64 = logs.iter().map(|p| (p[0] - x).powi(2)).sum();
    let order = logs.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>() / spread;
    let level = y - order * x;
    let off: f64 = logs.iter().map(|p| (p[1] - level - order * p[0]).powi(2)).sum();
    let standard_error = (off / (n - 2.0) / spread).sqrt();
    Ok(Fit { order, standard_error, coefficient: level.exp(), range, points: logs.len() })
}
