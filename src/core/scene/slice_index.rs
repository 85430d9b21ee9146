//! The slice index at a position of the sweep, as the ray casters compute it for every sample: by a polynomial where a short one is
//! exact enough, or by a look-up table.

use super::{Scene, SliceIndex};
use crate::probe::{Motion, Probe};
use std::f64::consts::{FRAC_PI_2, PI};

/// Largest error of the polynomial, slices. From slice 16 on f32 itself is less exact.
pub(crate) const MAX_ERROR: f64 = 1e-6;
/// Terms that the shaders have parameters for.
const MAX_TERMS: usize = 10;

/// A polynomial for the slice index, in mean slice pitches: `offset + t (terms[0] + terms[1] t^2 + terms[2] t^4 ...)` at a position t within the
/// limits.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SlicePolynomial {
    /// Lowest and highest argument t of the polynomial, a little beyond the outermost slices: the slice position in mm, or for a fan the tangent of
    /// half its angle about the wobble axis.
    pub limits: [f64; 2],
    pub offset: f64,
    pub terms: Vec<f64>,
}

impl Scene {
    /// Number of terms of the polynomial for the slice index at a slice position, which replaces a look-up table. 0 where the table is used: it was
    /// asked for, a fan is wider than 180 degrees, more than 10 terms would be needed, or there is no sweep.
    pub fn slice_terms(&self) -> usize {
        match self.probe() {
            Some(probe) if self.settings.ray.slice_index == SliceIndex::Auto => term_count(probe),
            _ => 0,
        }
    }

    /// The polynomial for the slice index at a slice position, which replaces a look-up table. None where the table is used.
    pub(crate) fn slice_polynomial(&self) -> Option<SlicePolynomial> {
        let count = self.slice_terms();
        self.probe().filter(|_| count > 0).map(|probe| polynomial(probe, count))
    }
}

/// The sweep's first and last position with a margin, rad or mm.
fn span(probe: &Probe) -> [f64; 2] {
    let (first, last) = probe.slice_bounds();
    // Ten times what counts as inside beyond the outermost slices, and what f32 rounds.
    let margin = (1e-3 + 1e-6 * probe.slices.len() as f64) * probe.slices.pitch();
    [first - margin, last + margin]
}

fn term_count(probe: &Probe) -> usize {
    match probe.motion {
        Motion::Still { .. } => 0,
        Motion::Translated => 1,
        Motion::Fan { .. } => {
            let widest = span(probe).map(f64::abs).into_iter().fold(0.0, f64::max);
            if widest > FRAC_PI_2 {
                return 0;
            }
            let t = (widest / 2.0).tan();
            let error = |count: usize| error_bound(t * t, count) * 2.0 * t / probe.slices.pitch();
            (1..=MAX_TERMS).find(|count| error(*count) <= MAX_ERROR).unwrap_or(0)
        }
    }
}

/// Largest error of the interpolation of f(u) = atan(sqrt u) / sqrt u, 0 <= u <= limit, at that many Chebyshev nodes: 2 (limit / 4)^n / n! times
/// the largest nth derivative. f is the integral of 1 / (1 + u s^2) over s from 0 to 1, so that this derivative is at most n! / (2 n + 1).
fn error_bound(limit: f64, count: usize) -> f64 {
    2.0 * (limit / 4.0).powi(count as i32) / (2 * count + 1) as f64
}

fn polynomial(probe: &Probe, count: usize) -> SlicePolynomial {
    let pitch = probe.slices.pitch();
    let offset = -probe.slices.first() / pitch;
    let [low, high] = span(probe);
    match probe.motion {
        Motion::Fan { .. } => {
            let limits = [(low / 2.0).tan(), (high / 2.0).tan()];
            let widest = limits[0].abs().max(limits[1].abs());
            let terms = arctangent_terms(widest * widest, count).into_iter().map(|c| 2.0 * c / pitch).collect();
            SlicePolynomial { limits, offset, terms }
        }
        Motion::Translated | Motion::Still { .. } => {
            SlicePolynomial { limits: [low, high], offset, terms: vec![1.0 / pitch] }
        }
    }
}

/// Coefficients of the powers of u of the polynomial that equals atan(sqrt u) / sqrt u at Chebyshev nodes of 0..limit.
fn arctangent_terms(limit: f64, count: usize) -> Vec<f64> {
    let node = |i: usize| limit / 2.0 * (1.0 + ((2 * i + 1) as f64 * PI / (2 * count) as f64).cos());
    let nodes: Vec<f64> = (0..count).map(node).collect();
    // Newton's divided differences.
    let mut differences: Vec<f64> = nodes.iter().map(|u| u.sqrt().atan() / u.sqrt()).collect();
    for order in 1..count {
        for i in (order..count).rev() {
            differences[i] = (differences[i] - differences[i - 1]) / (nodes[i] - nodes[i - order]);
        }
    }
    // c = d[n-1]; c = c (u - u[i]) + d[i] from the last but one to the first.
    let mut terms = vec![0.0; count];
    for i in (0..count).rev() {
        for power in (1..count).rev() {
            terms[power] = terms[power - 1] - nodes[i] * terms[power];
        }
        terms[0] = differences[i] - nodes[i] * terms[0];
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Advance, Array, Axis};

    fn at(terms: &[f64], u: f64) -> f64 {
        terms.iter().rev().fold(0.0, |sum, c| sum * u + c)
    }

    #[test]
    fn the_polynomial_is_the_arctangent_within_its_bound() {
        for (limit, count) in [(1e-6, 1), (0.03, 3), (0.15, 6), (0.5, 8), (1.0, 10)] {
            let terms = arctangent_terms(limit, count);
            let bound = error_bound(limit, count) + 1e-15;
            let error = (1..=1000)
                .map(|i| limit * f64::from(i) / 1000.0)
                .map(|u| (at(&terms, u) - u.sqrt().atan() / u.sqrt()).abs())
                .fold(0.0, f64::max);
            assert!(error <= bound, "{count} terms up to {limit}: {error:e}, bound {bound:e}");
            // The bound is no more than what it has to be: a wrong power of it would be far off.
            assert!(error > 1e-3 * bound || bound < 1e-14, "{count} terms up to {limit}: {error:e}, bound {bound:e}");
        }
    }

    #[test]
    fn an_index_is_that_of_the_angle_and_a_wide_fan_keeps_the_table() {
        let fan = |degrees: f64, slices: usize| Probe {
            motion: Motion::Fan { wobble_radius: 20.0 },
            slices: Axis::centred(degrees.to_radians() / (slices - 1) as f64, slices),
            array: Array::Curved { radius: 40.0 },
            lines: Axis::centred(0.01, 40),
            start_depth: 0.0,
            sample_pitch: 0.2,
            samples: 100,
            advance: Advance::None,
            sound_speed: 1540.0,
        };
        for (degrees, slices, expected) in
            [(20.0, 12, 3), (61.0, 37, 4), (85.0, 142, 6), (178.0, 200, 0), (190.0, 100, 0)]
        {
            let probe = fan(degrees, slices);
            assert_eq!(term_count(&probe), expected, "{degrees} degrees, {slices} slices");
            if expected == 0 {
                continue;
            }
            let SlicePolynomial { limits: [low, high], offset, terms } = polynomial(&probe, expected);
            for i in 0..=500 {
                let t = low + (high - low) * f64::from(i) / 500.0;
                let index = (2.0 * t.atan() - probe.slices.first()) / probe.slices.pitch();
                let error = (offset + t * at(&terms, t * t) - index).abs();
                assert!(error <= MAX_ERROR, "{degrees} degrees at {t}: {error:e}");
            }
            // Beyond the outermost slices, and not as far as a slice.
            assert!((-0.01..-5e-4).contains(&(offset + low * at(&terms, low * low))));
        }
    }
}
