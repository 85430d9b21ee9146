//! Polynomials of low degree on -1..1: interpolation in Chebyshev nodes, values, slopes, ranges and all real roots.
//!
//! A polynomial keeps its Chebyshev coefficients, whose evaluation (Clenshaw 1955) loses no digits. Roots are isolated in the
//! Bernstein basis, whose coefficients bound the polynomial (de Casteljau's subdivision), and refined on the Chebyshev form.

use std::sync::LazyLock;

/// The largest number of coefficients: degree 7.
pub const MOST: usize = 8;

/// A polynomial of degree `count - 1` on -1..1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polynomial {
    count: usize,
    /// Coefficients of the Chebyshev polynomials T0, T1, ...
    chebyshev: [f64; MOST],
}

/// Nodes, and the matrix from values at the nodes to Chebyshev coefficients, for one number of coefficients.
struct Tables {
    nodes: [f64; MOST],
    to_chebyshev: [[f64; MOST]; MOST],
    to_bernstein: [[f64; MOST]; MOST],
}

static TABLES: LazyLock<Vec<Tables>> = LazyLock::new(|| (0..=MOST).map(Tables::new).collect());

impl Tables {
    fn new(count: usize) -> Tables {
        let n = count as f64;
        let angle = |k: usize| std::f64::consts::PI * (k as f64 + 0.5) / n;
        let mut tables =
            Tables { nodes: [0.0; MOST], to_chebyshev: [[0.0; MOST]; MOST], to_bernstein: [[0.0; MOST]; MOST] };
        for k in 0..count {
            tables.nodes[k] = angle(k).cos();
            for j in 0..count {
                let share = if j == 0 { 1.0 / n } else { 2.0 / n };
                tables.to_chebyshev[j][k] = share * (j as f64 * angle(k)).cos();
            }
        }
        // T_j has the Bernstein coefficients (-1)^(j-k) C(2j, 2k) / C(j, k) of degree j (Rababah 2003); then the degree is raised.
        for j in 0..count {
            let sign = |k: usize| if (j - k).is_multiple_of(2) { 1.0 } else { -1.0 };
            let mut column: Vec<f64> = (0..=j).map(|k| sign(k) * binomial(2 * j, 2 * k) / binomial(j, k)).collect();
            for degree in j + 1..count {
                let lower = column.clone();
                let at = |k: usize| lower.get(k).copied().unwrap_or(0.0);
                let share = |k: usize| k as f64 / degree as f64;
                column = (0..=degree)
                    .map(|k| share(k) * if k > 0 { at(k - 1) } else { 0.0 } + (1.0 - share(k)) * at(k))
                    .collect();
            }
            for (k, value) in column.into_iter().enumerate() {
                tables.to_bernstein[k][j] = value;
            }
        }
        tables
    }
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
}

impl Polynomial {
    /// The polynomial of degree `count - 1` (`count` in 1..=[`MOST`]) that has the values of `f` at the Chebyshev nodes of -1..1.
    pub fn through(count: usize, f: impl Fn(f64) -> f64) -> Polynomial {
        let count = count.clamp(1, MOST);
        let tables = &TABLES[count];
        let mut values = [0.0; MOST];
        for (value, node) in values.iter_mut().zip(tables.nodes).take(count) {
            *value = f(node);
        }
        let mut chebyshev = [0.0; MOST];
        for (coefficient, row) in chebyshev.iter_mut().zip(&tables.to_chebyshev).take(count) {
            *coefficient = row.iter().zip(values).map(|(a, b)| a * b).sum();
        }
        Polynomial { count, chebyshev }
    }

    /// The value at x in -1..1.
    pub fn at(&self, x: f64) -> f64 {
        let (mut b1, mut b2) = (0.0, 0.0);
        for k in (1..self.count).rev() {
            (b1, b2) = (self.chebyshev[k] + 2.0 * x * b1 - b2, b1);
        }
        self.chebyshev[0] + x * b1 - b2
    }

    /// The derivative with respect to x.
    pub fn slope(&self) -> Polynomial {
        // c'_(k-1) = c'_(k+1) + 2 k c_k, and half of it for k = 1.
        let mut slope = Polynomial { count: (self.count - 1).max(1), chebyshev: [0.0; MOST] };
        let mut higher = [0.0; 2];
        for k in (1..self.count).rev() {
            let value = higher[1] + 2.0 * k as f64 * self.chebyshev[k];
            slope.chebyshev[k - 1] = value;
            higher = [value, higher[0]];
        }
        slope.chebyshev[0] *= 0.5;
        slope
    }

    /// The same polynomial plus a constant.
    pub fn plus(&self, constant: f64) -> Polynomial {
        let mut sum = *self;
        sum.chebyshev[0] += constant;
        sum
    }

    /// Bernstein coefficients: the polynomial's values on -1..1 lie between the smallest and the largest (to rounding), and the
    /// first and the last are its values at the ends.
    fn bernstein(&self) -> [f64; MOST] {
        let rows = &TABLES[self.count].to_bernstein;
        std::array::from_fn(|k| rows[k].iter().zip(self.chebyshev).take(self.count).map(|(a, b)| a * b).sum())
    }

    /// A lower and an upper bound of the values on -1..1: the least and the largest Bernstein coefficient. They are the extreme values, to rounding,
    /// if these coefficients rise or fall throughout; else they may lie beyond them.
    pub fn range(&self) -> [f64; 2] {
        let values = self.bernstein();
        values[..self.count].iter().fold([f64::MAX, f64::MIN], |[low, high], v| [low.min(*v), high.max(*v)])
    }

    /// Appends all roots in -1..1, in rising order, each to rounding. A root may be appended twice. Where the polynomial touches 0 without changing
    /// its sign, to within about 1e-7 in x, a root may be added or left out. A polynomial that is 0 everywhere has none.
    pub fn roots(&self, found: &mut Vec<f64>) {
        let bernstein = self.bernstein();
        if bernstein[..self.count].iter().any(|v| v.abs() > 1e-14) {
            self.isolate(bernstein, [-1.0, 1.0], found);
        }
    }

    fn isolate(&self, bernstein: [f64; MOST], [low, high]: [f64; 2], found: &mut Vec<f64>) {
        let values = &bernstein[..self.count];
        if values.iter().all(|v| *v > 0.0) || values.iter().all(|v| *v < 0.0) {
            return;
        }
        let rises = values.windows(2).all(|v| v[0] <= v[1]);
        let falls = values.windows(2).all(|v| v[0] >= v[1]);
        if rises || falls {
            found.extend(bracketed(|x| self.at(x), low, high));
            return;
        }
        if high - low < 1e-7 {
            found.push((low + high) / 2.0);
            return;
        }
        let (left, right) = halves(bernstein, self.count);
        let middle = (low + high) / 2.0;
        self.isolate(left, [low, middle], found);
        self.isolate(right, [middle, high], found);
    }
}

/// The two halves of a polynomial in Bernstein form (de Casteljau).
fn halves(bernstein: [f64; MOST], count: usize) -> ([f64; MOST], [f64; MOST]) {
    let (mut left, mut right, mut row) = ([0.0; MOST], [0.0; MOST], bernstein);
    for level in 0..count {
        left[level] = row[0];
        right[count - 1 - level] = row[count - 1 - level];
        for k in 0..count - 1 - level {
            row[k] = (row[k] + row[k + 1]) / 2.0;
        }
    }
    (left, right)
}

/// The root of a continuous function between two places at which it has different signs, to rounding; none if it has not.
/// The secant rule with halved end values (Illinois; Dowell and Jarratt 1971), bisected where that is slow.
pub(crate) fn bracketed(f: impl Fn(f64) -> f64, low: f64, high: f64) -> Option<f64> {
    let (mut a, mut b) = (low, high);
    let (mut fa, mut fb) = (f(a), f(b));
    if fa == 0.0 {
        return Some(a);
    }
    if fb == 0.0 {
        return Some(b);
    }
    if (fa > 0.0) == (fb > 0.0) || !(fa.is_finite() && fb.is_finite()) {
        return None;
    }
    for n in 0..120 {
        let width = b - a;
        if width <= 4.0 * f64::EPSILON * a.abs().max(b.abs()) {
            break;
        }
        let secant = (a * fb - b * fa) / (fb - fa);
        let next = if n % 4 == 3 || !(secant > a && secant < b) { a + width / 2.0 } else { secant };
        let value = f(next);
        if value == 0.0 {
            return Some(next);
        }
        if (value > 0.0) == (fb > 0.0) {
            (b, fb) = (next, value);
            fa *= if n % 4 == 3 { 1.0 } else { 0.5 };
        } else {
            (a, fa) = (next, value);
            fb *= if n % 4 == 3 { 1.0 } else { 0.5 };
        }
    }
    Some(a + (b - a) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sextic(x: f64) -> f64 {
        (x - 0.9) * (x - 0.3) * (x + 0.2) * (x + 0.20001) * (x * x + 0.5)
    }

    #[test]
    fn values_slopes_and_ranges_are_those_of_the_function() {
        let p = Polynomial::through(8, sextic);
        let slope = p.slope();
        for n in 0..=40 {
            let x = f64::from(n) / 20.0 - 1.0;
            assert!((p.at(x) - sextic(x)).abs() < 2e-14, "{x}");
            let d = 1e-5;
            assert!((slope.at(x) - (sextic(x + d) - sextic(x - d)) / (2.0 * d)).abs() < 1e-6, "{x}");
            let [low, high] = p.range();
            assert!((low - 1e-14..=high + 1e-14).contains(&p.at(x)));
        }
        assert_eq!(Polynomial::through(1, |_| 3.0).slope().at(0.5), 0.0);
        let line = Polynomial::through(4, |x| 2.0 * x + 1.0);
        assert!(line.range().iter().zip([-1.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-14));
    }

    #[test]
    fn all_roots_are_found_even_two_that_nearly_meet() {
        let mut found = Vec::new();
        Polynomial::through(8, sextic).roots(&mut found);
        let expected = [-0.20001, -0.2, 0.3, 0.9];
        assert_eq!(found.len(), 4, "{found:?}");
        // Two roots that are 1e-5 apart amplify rounding by the inverse slope between them.
        let off: Vec<f64> = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).collect();
        assert!(off[0] < 1e-8 && off[1] < 1e-8 && off[2] < 1e-13 && off[3] < 1e-14, "{off:?}");
        found.clear();
        Polynomial::through(4, |_| 0.0).roots(&mut found);
        Polynomial::through(4, |x| x * x + 1e-6).roots(&mut found);
        assert!(found.is_empty(), "{found:?}");
    }
}
