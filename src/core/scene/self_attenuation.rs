//! Self-attenuated steps of emission and absorption: the light of a step along which the sampled value goes linearly from one end to the
//! other, dimmed by the step's own matter in front of it. The full ray integral of Engel, Kraus and Ertl 2001 over one segment (they
//! tabulate it without that dimming, which is [`pre_integrated`](super::transfer::pre_integrated)).
//!
//! With the value v(s) = front + (back - front) s for s in 0..1, the absorption kappa(v) of one reference length, the colour c(v), and
//! the length of the step y in reference lengths:
//!
//! ```text
//! C = integral over 0..1 of c(v(s)) kappa(v(s)) y exp(-T(s)) ds     T(s) = y integral over 0..s of kappa(v(t)) dt     A = 1 - exp(-T(1))
//! ```
//!
//! kappa and c are linear between the entries of the transfer table, so that the integral is a sum over pieces.

use super::transfer::opacity;

/// Light behind this optical depth is below 1e-17 of the step's.
const DARK: f64 = 40.0;
/// Largest optical depth of one quadrature: five points are then good to 1e-11.
const THICK: f64 = 1.0;
/// Up to this optical depth two points are good to 1e-10.
const THIN: f64 = 0.05;

/// Gauss-Legendre nodes in 0..1 and weights, of two and of five points.
const TWO: [[f64; 2]; 2] = [[0.211_324_865_405_187_1, 0.5], [0.788_675_134_594_812_9, 0.5]];
const FIVE: [[f64; 2]; 5] = [
    [0.046_910_077_030_668, 0.118_463_442_528_094_54],
    [0.230_765_344_947_158_45, 0.239_314_335_249_683_23],
    [0.5, 0.284_444_444_444_444_44],
    [0.769_234_655_052_841_6, 0.239_314_335_249_683_23],
    [0.953_089_922_969_332, 0.118_463_442_528_094_54],
];

/// Premultiplied red, green, blue, and the opacity, of a step of `length` reference lengths from the value `front` to the value `back`,
/// both in 0..1. `table`: red, green, blue and absorption at equidistant values from 0 to 1, at least two.
pub fn step(table: &[[f64; 4]], front: f64, back: f64, length: f64) -> [f64; 4] {
    let last = table.len() - 1;
    let [from, to] = [front, back].map(|v| v.clamp(0.0, 1.0) * last as f64);
    let entry = |at: f64| {
        let n = (at as usize).min(last - 1);
        let share = at - n as f64;
        let (low, high) = (table[n], table[n + 1]);
        std::array::from_fn::<f64, 4, _>(|c| low[c] + (high[c] - low[c]) * share)
    };
    let mut light = Light { colour: [0.0; 3], depth: 0.0 };
    if from == to {
        light.piece(entry(from), entry(from), length);
    } else {
        let (mut at, rises) = (from, to > from);
        while at != to && light.depth < DARK {
            // The next entry on the way, or the end.
            let next = if rises { (at.floor() + 1.0).min(to) } else { (at.ceil() - 1.0).max(to) };
            light.piece(entry(at), entry(next), length * (next - at).abs() / (to - from).abs());
            at = next;
        }
    }
    let [r, g, b] = light.colour;
    [r, g, b, opacity(light.depth)]
}

/// The light so far, and the optical depth of what it came through.
struct Light {
    colour: [f64; 3],
    depth: f64,
}

impl Light {
    /// Adds a piece of `length` reference lengths over which colour and absorption are linear. By parts, the integral of c kappa exp(-T)
    /// is c(0) - c(1) exp(-T(1)) + (c(1) - c(0)) times the integral of exp(-T).
    fn piece(&mut self, front: [f64; 4], back: [f64; 4], length: f64) {
        let (near, far) = (front[3] * length, back[3] * length);
        let depth = (near + far) / 2.0;
        if depth == 0.0 {
            return;
        }
        let through = (-self.depth).exp();
        // 1 - the integral of exp(-T), so that a thin piece keeps its digits.
        let lost = lost(near, far);
        for (c, sum) in self.colour.iter_mut().enumerate() {
            *sum += through * (front[c] * lost + back[c] * (opacity(depth) - lost));
        }
        self.depth += depth;
    }
}

/// The integral over 0..1 of 1 - exp(-T(u)), with the optical depth T(u) = near u + (far - near) u^2 / 2. Both ends are at least 0.
fn lost(near: f64, far: f64) -> f64 {
    let depth = |u: f64| (near + (far - near) * u / 2.0) * u;
    let all = depth(1.0);
    let between = |from: f64, to: f64, nodes: &[[f64; 2]]| {
        let sum = nodes.iter().map(|[node, weight]| weight * opacity(depth(from + (to - from) * node))).sum::<f64>();
        (to - from) * sum
    };
    if all <= THICK {
        return between(0.0, 1.0, if all <= THIN { &TWO } else { &FIVE });
    }
    // Up to each multiple of the optical depth that one quadrature takes; behind the last, nothing gets through.
    let (mut sum, mut from) = (0.0, 0.0);
    for n in 1..=(DARK / THICK) as u32 {
        let to = if f64::from(n) * THICK >= all { 1.0 } else { place_of(near, far, f64::from(n) * THICK) };
        sum += between(from, to, &FIVE);
        from = to;
        if to >= 1.0 {
            break;
        }
    }
    sum + (1.0 - from)
}

/// Where the optical depth near u + (far - near) u^2 / 2 reaches `depth`: the root of the parabola in the form that does not cancel.
fn place_of(near: f64, far: f64, depth: f64) -> f64 {
    let root = (near * near + 2.0 * (far - near) * depth).max(0.0).sqrt();
    (2.0 * depth / (near + root)).min(1.0)
}

/// One row of the table of steps of `length` reference lengths: premultiplied colour and opacity for steps from entry `front` to every entry.
/// `table` is the one that [`step`] takes.
pub fn row(table: &[[f64; 4]], front: usize, length: f64) -> Vec<[f64; 4]> {
    let value = |n: usize| n as f64 / (table.len() - 1) as f64;
    (0..table.len()).map(|back| step(table, value(front), value(back), length)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::settings::{Transfer, TransferName};
    use crate::scene::transfer;

    /// The integral by 200 000 midpoints, without pieces.
    fn by_midpoints(table: &[[f64; 4]], front: f64, back: f64, length: f64) -> [f64; 4] {
        let n = 200_000;
        let (mut sums, mut depth) = ([0.0; 3], 0.0f64);
        for i in 0..n {
            let at = (front + (back - front) * (f64::from(i) + 0.5) / f64::from(n)) * (table.len() - 1) as f64;
            let low = (at as usize).min(table.len() - 2);
            let value = |c: usize| table[low][c] + (table[low + 1][c] - table[low][c]) * (at - low as f64);
            let y = value(3) * length / f64::from(n);
            (0..3).for_each(|c| sums[c] += value(c) * opacity(y) * (-depth).exp());
            depth += y;
        }
        [sums[0], sums[1], sums[2], opacity(depth)]
    }

    #[test]
    fn a_step_is_the_ray_integral() {
        let bone = transfer::table(&transfer::resolved(&Transfer::Named(TransferName::Bone)), 0.4, transfer::ENTRIES);
        for (front, back) in [(0.1, 0.9), (0.9, 0.1), (0.37, 0.371), (0.6, 0.6), (0.0, 1.0), (0.1, 0.3)] {
            for length in [1e-3, 0.3, 1.0, 30.0, 3000.0] {
                let (got, expected) = (step(&bone, front, back, length), by_midpoints(&bone, front, back, length));
                let off = (0..4).map(|c| (got[c] - expected[c]).abs()).fold(0.0, f64::max);
                // Where the threshold cuts in, the first midpoint of a thick step sees 1/200000 of it late.
                assert!(off < 2e-5 * length.clamp(1e-2, 30.0), "{front}..{back} over {length}: {got:?}, {expected:?}");
            }
        }
    }

    #[test]
    fn a_homogeneous_step_has_its_colour_times_its_opacity() {
        for kappa in [1e-9, 1e-3, 0.7, 14.0, transfer::OPAQUE] {
            let table = [[0.2, 0.4, 0.9, kappa]; 5];
            for (front, back) in [(0.3, 0.3), (0.1, 0.8), (1.0, 0.0)] {
                let [r, g, b, a] = step(&table, front, back, 0.5);
                assert!((a / opacity(0.5 * kappa) - 1.0).abs() < 1e-12, "{a}");
                for (got, colour) in [(r, 0.2), (g, 0.4), (b, 0.9)] {
                    assert!((got / (colour * a) - 1.0).abs() < 1e-9, "{kappa}: {got} of {}", colour * a);
                }
            }
        }
    }

    /// A red face in front of blue matter, opaque: what is in front is seen. Without matter there is no light.
    #[test]
    fn a_thick_step_shows_its_front() {
        let table = [[1.0, 0.0, 0.0, 500.0], [0.0, 0.0, 1.0, 500.0]];
        let there = step(&table, 0.0, 1.0, 1.0);
        assert!((there[0] - (1.0 - 1.0 / 500.0)).abs() < 1e-9 && (there[2] - 1.0 / 500.0).abs() < 1e-9, "{there:?}");
        let back = step(&table, 1.0, 0.0, 1.0);
        assert!((back[2] - there[0]).abs() < 1e-12 && (back[0] - there[2]).abs() < 1e-12, "{back:?}");
        assert_eq!(step(&[[0.5, 0.5, 0.5, 0.0]; 3], 0.0, 1.0, 9.0), [0.0; 4]);
    }
}
