//! Interval arithmetic with outward rounding: the result of an operation contains the exact result for all numbers of its operands.
//!
//! IEEE 754 rounds sums, products, quotients and square roots correctly, so the exact result lies between the neighbours of the computed
//! one. The functions of the C library are not rounded correctly; its manual (glibc, "Known Maximum Errors in Math Functions") gives at most 1 ulp
//! for exp, expm1, log1p, atan2, sin and cos on x86-64 and aarch64, and here they are widened by 4.

use std::ops::{Add, Mul, Neg, Sub};

/// A closed interval: all numbers from `low` to `high`. The result of every arithmetic operation contains all exact results, rounding included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

/// ulps by which a function of the C library may be off, and more.
const LIBRARY: u32 = 4;

fn down(value: f64, ulps: u32) -> f64 {
    (0..ulps).fold(value, |v, _| v.next_down())
}

fn up(value: f64, ulps: u32) -> f64 {
    (0..ulps).fold(value, |v, _| v.next_up())
}

impl Interval {
    pub const ZERO: Interval = Interval { low: 0.0, high: 0.0 };
    pub const ONE: Interval = Interval { low: 1.0, high: 1.0 };

    /// The interval between two numbers, in either order.
    pub fn between(a: f64, b: f64) -> Interval {
        Interval { low: a.min(b), high: a.max(b) }
    }

    /// The interval of a single number, which is taken as exact.
    pub fn of(value: f64) -> Interval {
        Interval { low: value, high: value }
    }

    pub fn width(self) -> f64 {
        (self.high - self.low).next_up()
    }

    pub fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// The smallest interval that contains both.
    pub fn hull(self, other: Interval) -> Interval {
        Interval { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Clamps every number to 0..1.
    pub fn clamped(self) -> Interval {
        Interval { low: self.low.clamp(0.0, 1.0), high: self.high.clamp(0.0, 1.0) }
    }

    /// All minima of a number of this interval and a number of `other`.
    pub fn at_most(self, other: Interval) -> Interval {
        Interval { low: self.low.min(other.low), high: self.high.min(other.high) }
    }

    /// The largest absolute value of a number in the interval.
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Extends the interval by `slack` at both ends. `slack` must not be negative.
    pub fn widened(self, slack: f64) -> Interval {
        Interval { low: (self.low - slack).next_down(), high: (self.high + slack).next_up() }
    }

    /// Divides by positive numbers. If the divisor may be 0 or less, the result is the interval of all numbers.
    pub fn over(self, divisor: Interval) -> Interval {
        if divisor.low <= 0.0 {
            return Interval { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        let low = if self.low >= 0.0 { self.low / divisor.high } else { self.low / divisor.low };
        let high = if self.high >= 0.0 { self.high / divisor.low } else { self.high / divisor.high };
        Interval { low: low.next_down(), high: high.next_up() }
    }

    pub fn square(self) -> Interval {
        let (a, b) = (self.low * self.low, self.high * self.high);
        let low = if self.contains(0.0) { 0.0 } else { a.min(b).next_down().max(0.0) };
        Interval { low, high: a.max(b).next_up() }
    }

    /// The square roots of the numbers of the interval; negative ones count as 0.
    pub fn root(self) -> Interval {
        let root = |v: f64| v.max(0.0).sqrt();
        Interval { low: root(self.low).next_down().max(0.0), high: root(self.high).next_up() }
    }

    /// 1 - exp(-y), a number of 0..1, for the numbers y of the interval; negative ones count as 0.
    pub fn opacity(self) -> Interval {
        let opacity = |y: f64| -(-y.max(0.0)).exp_m1();
        let (low, high) = (opacity(self.low), opacity(self.high));
        Interval { low: down(low, LIBRARY).max(0.0), high: up(high, LIBRARY).min(1.0) }
    }

    /// -ln(1 - a), at most `most`, for the numbers a of the interval, 0..1.
    pub fn absorption(self, most: f64) -> Interval {
        let of = |a: f64| if a >= 1.0 { most } else { (-(-a).ln_1p()).min(most) };
        let (low, high) = (of(self.low.max(0.0)), of(self.high.max(0.0)));
        Interval { low: down(low, LIBRARY).max(0.0), high: up(high, LIBRARY) }
    }

    /// The angle atan(y / x), -pi/2..pi/2, for the numbers y of this interval and x of the other, which must be above 0.
    pub fn angle(self, x: Interval) -> Interval {
        let corners = [self.low, self.high].map(|y| [x.low.max(0.0), x.high.max(0.0)].map(|x| y.atan2(x)));
        let all = corners.iter().flatten();
        let (low, high) = all.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        Interval { low: down(low, LIBRARY), high: up(high, LIBRARY) }
    }
}

impl Add for Interval {
    type Output = Interval;
    fn add(self, other: Interval) -> Interval {
        Interval { low: (self.low + other.low).next_down(), high: (self.high + other.high).next_up() }
    }
}

impl Sub for Interval {
    type Output = Interval;
    fn sub(self, other: Interval) -> Interval {
        Interval { low: (self.low - other.high).next_down(), high: (self.high - other.low).next_up() }
    }
}

impl Neg for Interval {
    type Output = Interval;
    fn neg(self) -> Interval {
        Interval { low: -self.high, high: -self.low }
    }
}

impl Mul for Interval {
    type Output = Interval;
    fn mul(self, other: Interval) -> Interval {
        let products = [self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high];
        let (low, high) = products.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
        Interval { low: low.next_down(), high: high.next_up() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number of an interval, the same in every run.
    fn inner(interval: Interval, n: u32) -> f64 {
        interval.low + (interval.high - interval.low) * (f64::from(n) * 0.618_034).fract()
    }

    #[test]
    fn every_operation_contains_the_results_of_all_numbers() {
        let a = Interval { low: -1.5, high: 2.25 };
        let b = Interval { low: 0.3, high: 7.1 };
        let unit = Interval { low: 0.02, high: 0.98 };
        for n in 0..500 {
            let (x, y, u) = (inner(a, n), inner(b, 3 * n + 1), inner(unit, n));
            assert!((a + b).contains(x + y) && (a - b).contains(x - y) && (a * b).contains(x * y));
            assert!(a.over(b).contains(x / y) && a.square().contains(x * x) && b.root().contains(y.sqrt()));
            assert!(a.angle(b).contains(x.atan2(y)) && (-a).contains(-x) && a.at_most(b).contains(x.min(y)));
            assert!(b.opacity().contains(1.0 - (-y).exp()) && unit.absorption(1e6).contains(-(1.0 - u).ln()));
        }
        // The sum of 0.1 and 0.2 is no f64: it lies strictly between the ends.
        let sum = Interval::of(0.1) + Interval::of(0.2);
        assert!(sum.low < 0.300_000_000_000_000_04 && sum.high > 0.3 && sum.width() < 2e-16);
        assert!(Interval::of(0.0).opacity().contains(0.0) && Interval::of(1.0).absorption(1e6).contains(1e6));
        assert!(a.over(Interval { low: 0.0, high: 1.0 }).contains(1e300));
    }
}
