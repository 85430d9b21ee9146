//! Orders of convergence: a fit of the error over the step size.

use crate::tree::{FromNode, ToNode};

/// Which points an order is fitted to. Points with coarser steps are not yet asymptotic; errors near the floor are not caused by the step.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Range {
    /// Smallest and largest step, in the unit of the dial.
    pub step: [f64; 2],
    /// The error that remains for small steps, by rounding and the texel format. Points whose error is less than three times this are left out,
    /// because it bends the line there by more than 5 %.
    pub floor: f64,
}

/// Factor over the floor from which points are fitted. Squared errors add: at three times the floor the step's share is
/// sqrt(1 - 1/9) = 94 % of the total.
const ABOVE_FLOOR: f64 = 3.0;

/// The fit error = coefficient * step^order, by least squares on the logarithms.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Fit {
    pub order: f64,
    /// Standard error of the order, from the residuals of the fit.
    pub standard_error: f64,
    pub coefficient: f64,
    /// The range that the points were taken from.
    pub range: Range,
    /// Number of points that were fitted.
    pub points: usize,
}

impl Fit {
    /// The error at a step by the fit.
    pub fn at(&self, step: f64) -> f64 {
        self.coefficient * step.powf(self.order)
    }
}

/// Fits an order to pairs of step and error, of which those within `range` are used.
///
/// # Errors
/// One line: fewer than three different steps are in the range. A line through two points has no standard error.
pub fn fit(pairs: &[[f64; 2]], range: Range) -> Result<Fit, String> {
    let [low, high] = range.step;
    let fitted = |[step, error]: &&[f64; 2]| {
        let counts = error.is_finite() && *error > 0.0 && *error >= ABOVE_FLOOR * range.floor;
        // A relative tolerance of 1e-9 accepts steps with rounding errors.
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
