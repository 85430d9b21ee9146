//! Two samples against each other by ranks: whether one is larger, and by how much.

use super::statistics::{Sample, SampleError};

/// Up to this many samples together the distribution of the rank sum is counted out; beyond it is near enough to normal.
const COUNTED: usize = 60;

/// The Mann-Whitney test, two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MannWhitney {
    /// Pairs in which the first sample's is the larger, ties for a half.
    pub u: f64,
    /// Probability of a U at least as extreme if both samples come from one distribution.
    pub p: f64,
    /// Counted out, and not from the normal approximation.
    pub is_exact: bool,
}

/// Shift of the second sample against the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    pub estimate: f64,
    pub low: f64,
    pub high: f64,
    /// Probability that the interval covers the true shift, if the distributions differ by a shift only.
    pub coverage: f64,
}

/// H. B. Mann and D. R. Whitney, On a test of whether one of two random variables is stochastically larger than the other,
/// 1947. Small samples: the exact permutation distribution of the midranks, so that ties need no correction. Large ones: the
/// normal approximation with the variance corrected for ties, and half a step for continuity.
pub fn mann_whitney(a: &[f64], b: &[f64]) -> Result<MannWhitney, SampleError> {
    let (first, second) = (Sample::new(a)?, Sample::new(b)?);
    let (n, m) = (first.count(), second.count());
    let all = Sample::new(&[a, b].concat())?;
    let all = all.sorted();
    // Twice the midrank of every sample of both: whole numbers.
    let mut doubled = Vec::with_capacity(n + m);
    let mut ties = 0.0;
    while doubled.len() < all.len() {
        let from = doubled.len();
        let to = from + all[from..].iter().take_while(|v| **v == all[from]).count();
        doubled.resize(to, from + to + 1);
        let tied = (to - from) as f64;
        ties += tied.powi(3) - tied;
    }
    let rank = |v: f64| doubled[all.partition_point(|x| *x < v)];
    let sum: usize = a.iter().map(|v| rank(*v)).sum();
    let u = (sum - n * (n + 1)) as f64 / 2.0;
    if n + m <= COUNTED {
        let ways = rank_sums(&doubled, n);
        let total: f64 = ways.iter().sum();
        let below: f64 = ways[..=sum].iter().sum();
        let above: f64 = ways[sum..].iter().sum();
        return Ok(MannWhitney { u, p: (2.0 * below.min(above) / total).min(1.0), is_exact: true });
    }
    let (n, m) = (n as f64, m as f64);
    let variance = n * m / 12.0 * (n + m + 1.0 - ties / ((n + m) * (n + m - 1.0)));
    let off = ((u - n * m / 2.0).abs() - 0.5).max(0.0);
    let p = if variance > 0.0 { (2.0 * normal_tail(off / variance.sqrt())).min(1.0) } else { 1.0 };
    Ok(MannWhitney { u, p, is_exact: false })
}

/// In how many ways `chosen` of these ranks add up to each sum.
fn rank_sums(ranks: &[usize], chosen: usize) -> Vec<f64> {
    let most: usize = ranks[ranks.len() - chosen..].iter().sum();
    let mut ways = vec![vec![0.0; most + 1]; chosen + 1];
    ways[0][0] = 1.0;
    for rank in ranks {
        for k in (1..=chosen).rev() {
            let (less, here) = ways.split_at_mut(k);
            for sum in *rank..=most {
                here[0][sum] += less[k - 1][sum - rank];
            }
        }
    }
    ways.swap_remove(chosen)
}

/// The least p that two samples of `n` each can give: 2 / C(2n, n).
pub fn least_p(n: usize) -> f64 {
    2.0 / (1..=n).map(|i| (n + i) as f64 / i as f64).product::<f64>()
}

/// J. L. Hodges and E. L. Lehmann, Estimates of location based on rank tests, 1963: the median of all differences b - a. The
/// interval holds every shift that the Mann-Whitney test would not refuse; `coverage` is below `level` where the samples are
/// too few. Takes memory for all pairs.
pub fn hodges_lehmann(a: &[f64], b: &[f64], level: f64) -> Result<Shift, SampleError> {
    let (first, second) = (Sample::new(a)?, Sample::new(b)?);
    let (n, m) = (first.count(), second.count());
    let pairs: Vec<f64> = second.sorted().iter().flat_map(|y| first.sorted().iter().map(move |x| y - x)).collect();
    let differences = Sample::new(&pairs)?;
    let sorted = differences.sorted();
    // The k-th difference from below and from above, by P(U < k).
    let mut k = 1;
    let mut tail;
    if n + m <= COUNTED {
        let ranks: Vec<usize> = (1..=n + m).collect();
        let ways = rank_sums(&ranks, n);
        let total: f64 = ways.iter().sum();
        let least = n * (n + 1) / 2;
        tail = ways[least] / total;
        let mut below = tail;
        for next in 2..=(n * m).div_ceil(2) {
            below += ways[least + next - 1] / total;
            if 1.0 - 2.0 * below < level {
                break;
            }
            (k, tail) = (next, below);
        }
    } else {
        let (n, m) = (n as f64, m as f64);
        let deviation = (n * m * (n + m + 1.0) / 12.0).sqrt();
        let below = |k: usize| normal_tail((n * m / 2.0 - (k as f64 - 0.5)) / deviation);
        tail = below(1);
        for next in 2..=sorted.len().div_ceil(2) {
            if 1.0 - 2.0 * below(next) < level {
                break;
            }
            (k, tail) = (next, below(next));
        }
    }
    let coverage = (1.0 - 2.0 * tail).max(0.0);
    Ok(Shift { estimate: differences.median(), low: sorted[k - 1], high: sorted[sorted.len() - k], coverage })
}

/// S. Holm, A simple sequentially rejective multiple test procedure, 1979: p values, in their order, such that calling those
/// at most alpha different is wrong anywhere with probability at most alpha, however they depend on each other.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|i, j| p[*i].total_cmp(&p[*j]));
    let mut adjusted = vec![0.0; p.len()];
    let mut least: f64 = 0.0;
    for (rank, i) in order.into_iter().enumerate() {
        least = least.max((p[i] * (p.len() - rank) as f64).min(1.0));
        adjusted[i] = least;
    }
    adjusted
}

/// P(Z > z) of the standard normal distribution, to about 1e-14 of itself.
pub fn normal_tail(z: f64) -> f64 {
    let x = z.abs() / std::f64::consts::SQRT_2;
    let bell = (-x * x).exp() / std::f64::consts::PI.sqrt();
    let upper = if x < 1.5 {
        // erf(x) = 2 bell sum of 2^n x^(2n+1) / (2n+1)!! (Abramowitz and Stegun 7.1.6): all terms positive.
        let (mut term, mut sum, mut n) = (x, x, 0.0);
        while term > sum * 1e-17 {
            n += 1.0;
            term *= 2.0 * x * x / (2.0 * n + 1.0);
            sum += term;
        }
        0.5 - bell * sum
    } else {
        // erfc(x) = bell / (x + (1/2) / (x + 1 / (x + (3/2) / (x + ...)))) (7.1.14), from the inside.
        0.5 * bell / (1..=120).rev().fold(x, |inner, n| x + 0.5 * f64::from(n) / inner)
    };
    if z >= 0.0 { upper } else { 1.0 - upper }
}
