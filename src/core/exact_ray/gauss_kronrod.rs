//! Gauss-Kronrod quadrature with 7 and 15 nodes on -1..1, and the integral from -1 to each node.
//!
//! Nodes and weights: Piessens, de Doncker-Kapenga, Ueberhuber, Kahaner, *QUADPACK*, 1983 (rule QK15). The rule of 15 nodes is exact
//! for polynomials of degree 22, the rule of 7 for degree 13.

use std::sync::LazyLock;

/// Number of nodes of the Kronrod rule.
pub const COUNT: usize = 15;

const POSITIVE: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

/// A quadrature rule on -1..1: nodes in rising order with their weights.
#[derive(Debug)]
pub struct Rule {
    pub nodes: [f64; COUNT],
    pub(crate) kronrod: [f64; COUNT],
    /// Weights of the 7-point Gauss rule; 0 at the nodes that only the 15-point rule has.
    pub(crate) gauss: [f64; COUNT],
    /// `inner[i][j]`: weight of the value at node j in the integral from -1 to node i of the polynomial of degree 14 through the values at all nodes.
    pub inner: [[f64; COUNT]; COUNT],
}

/// The 15-point Gauss-Kronrod rule over -1..1, with its embedded 7-point Gauss rule. The nodes ascend.
pub static RULE: LazyLock<Rule> = LazyLock::new(|| {
    let positive = |i: usize| if i < 8 { i } else { COUNT - 1 - i };
    let nodes: [f64; COUNT] = std::array::from_fn(|i| if i < 8 { -POSITIVE[i] } else { POSITIVE[positive(i)] });
    let gauss = |i: usize| if positive(i) % 2 == 1 { GAUSS[positive(i) / 2] } else { 0.0 };
    Rule {
        nodes,
        kronrod: std::array::from_fn(|i| KRONROD[positive(i)]),
        gauss: std::array::from_fn(gauss),
        inner: antiderivative(&nodes),
    }
});

impl Rule {
    /// Integrals over -1..1 by Kronrod's 15-point rule and by Gauss' 7-point rule, of a function with these values at the nodes.
    pub fn integrals(&self, values: &[f64; COUNT]) -> [f64; 2] {
        let sum = |weights: &[f64; COUNT]| weights.iter().zip(values).map(|(w, v)| w * v).sum();
        [sum(&self.kronrod), sum(&self.gauss)]
    }

    /// Integrals from -1 to every node, of the polynomial through these values at the nodes.
    pub fn running(&self, values: &[f64; COUNT]) -> [f64; COUNT] {
        std::array::from_fn(|i| self.inner[i].iter().zip(values).map(|(w, v)| w * v).sum())
    }
}

/// Legendre polynomials P0 .. P15 at x, by their recurrence.
fn legendre(x: f64) -> [f64; COUNT + 1] {
    let mut p = [1.0; COUNT + 1];
    p[1] = x;
    for n in 1..COUNT {
        let k = n as f64;
        p[n + 1] = ((2.0 * k + 1.0) * x * p[n] - k * p[n - 1]) / (k + 1.0);
    }
    p
}

/// The interpolating polynomial is expanded in Legendre polynomials, whose integral from -1 to x is (P(n+1) - P(n-1)) / (2n + 1).
fn antiderivative(nodes: &[f64; COUNT]) -> [[f64; COUNT]; COUNT] {
    // Rows of [ transposed Legendre matrix | transposed integrals ]: solving gives the weights, one column for each node.
    let mut rows = [[0.0; 2 * COUNT]; COUNT];
    for (j, x) in nodes.iter().enumerate() {
        let p = legendre(*x);
        for n in 0..COUNT {
            rows[n][j] = p[n];
            rows[n][COUNT + j] = if n == 0 { x + 1.0 } else { (p[n + 1] - p[n - 1]) / (2 * n + 1) as f64 };
        }
    }
    // Gauss-Jordan elimination with the largest pivot of a column.
    for column in 0..COUNT {
        let pivot = (column..COUNT).max_by(|a, b| rows[*a][column].abs().total_cmp(&rows[*b][column].abs()));
        rows.swap(column, pivot.unwrap_or(column));
        let scale = 1.0 / rows[column][column];
        rows[column].iter_mut().for_each(|v| *v *= scale);
        let lead = rows[column];
        for (_, row) in rows.iter_mut().enumerate().filter(|(n, _)| *n != column) {
            let factor = row[column];
            row.iter_mut().zip(lead).for_each(|(v, l)| *v -= factor * l);
        }
    }
    std::array::from_fn(|i| std::array::from_fn(|j| rows[j][COUNT + i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_rules_are_exact_up_to_their_degree_and_not_beyond() {
        let integrals = |degree: i32| RULE.integrals(&RULE.nodes.map(|x| x.powi(degree)));
        let expected = |degree: i32| if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
        for degree in 0..=22 {
            let [kronrod, gauss] = integrals(degree);
            assert!((kronrod - expected(degree)).abs() < 1e-15, "{degree}: {kronrod}");
            assert_eq!((gauss - expected(degree)).abs() < 1e-15, degree <= 13 || degree % 2 == 1, "{degree}: {gauss}");
        }
        assert!((integrals(24)[0] - expected(24)).abs() > 1e-10);
    }

    #[test]
    fn inner_integrals_are_exact_up_to_degree_14() {
        for degree in 0..=14 {
            let running = RULE.running(&RULE.nodes.map(|x| x.powi(degree)));
            for (x, value) in RULE.nodes.iter().zip(running) {
                let expected = (x.powi(degree + 1) - (-1f64).powi(degree + 1)) / f64::from(degree + 1);
                assert!((value - expected).abs() < 1e-14, "{degree} at {x}: {value}");
            }
        }
    }
}
