//! Order statistics, rank tests and multiple-test correction. They assume no distribution: run times have long tails and outliers, so
//! medians and ranks are used throughout, and never means or standard deviations.

use crate::statistics;

/// Why a list of numbers is no sample.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    #[error("there are no samples")]
    Empty,
    #[error("sample {at} is {value}: only finite numbers can be ordered")]
    NotFinite { at: usize, value: f64 },
}

/// One or more finite numbers, sorted in ascending order, in the caller's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample(Vec<f64>);

/// Confidence interval of a median (or of a shift), and its coverage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
    /// Probability, 0..1, that the interval contains the true value. Exact for independent draws from one continuous distribution; too high if
    /// neighbours are correlated.
    pub coverage: f64,
}

impl Interval {
    /// True if the coverage is at least `level` (0..1). False if there are too few samples for that.
    pub fn reaches(&self, level: f64) -> bool {
        self.coverage >= level
    }
}

impl Sample {
    /// Sorts the values.
    ///
    /// # Errors
    /// There is no value, or one is not finite.
    pub fn new(values: &[f64]) -> Result<Sample, SampleError> {
        if let Some((at, value)) = values.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(SampleError::NotFinite { at, value: *value });
        }
        if values.is_empty() {
            return Err(SampleError::Empty);
        }
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Ok(Sample(sorted))
    }

    pub fn count(&self) -> usize {
        self.0.len()
    }

    pub fn sorted(&self) -> &[f64] {
        &self.0
    }

    pub fn min(&self) -> f64 {
        self.0[0]
    }

    pub fn max(&self) -> f64 {
        self.0[self.0.len() - 1]
    }

    /// The quantile at `share`, which is clamped to 0..1: 0 is the minimum, 1 the maximum. It is linear between neighbouring values.
    pub fn quantile(&self, share: f64) -> f64 {
        statistics::quantile(&self.0, share).unwrap_or(f64::NAN)
    }

    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    /// Median absolute deviation from the median, not scaled to any distribution.
    pub fn mad(&self) -> f64 {
        let median = self.median();
        let mut distances: Vec<f64> = self.0.iter().map(|v| (v - median).abs()).collect();
        distances.sort_by(f64::total_cmp);
        Sample(distances).median()
    }

    /// Distribution-free confidence interval of the median: from the k-th smallest to the k-th largest sample. The number of
    /// samples below the true median is binomial with p = 1/2 (David and Nagaraja, Order Statistics, 2003, section 7.1). k is the
    /// largest that still covers `level`; if none does, the interval is the full range.
    pub fn median_interval(&self, level: f64) -> Interval {
        let n = self.0.len();
        // P(fewer than k samples are below), by its logarithm: 2^-n underflows from 1075 samples on.
        let (mut log_share, mut below) = (-(n as f64) * std::f64::consts::LN_2, 0.0);
        self.covering(level, |k| {
            if k > 1 {
                log_share += ((n + 2 - k) as f64 / (k - 1) as f64).ln();
            }
            below += log_share.exp();
            below
        })
    }

    /// From the k-th sample from below to the k-th from above, for the largest k for which what lies between two tails of P(fewer than k), `below`,
    /// is at least `level`. If none is, k is 1. `below` is called for every k from 1 on.
    fn covering(&self, level: f64, mut below: impl FnMut(usize) -> f64) -> Interval {
        let n = self.0.len();
        let (mut k, mut tail) = (1, below(1));
        // Beyond the middle the two order statistics would swap.
        for next in 2..=n.div_ceil(2) {
            let next_tail = below(next);
            if 1.0 - 2.0 * next_tail < level {
                break;
            }
            (k, tail) = (next, next_tail);
        }
        Interval { low: self.0[k - 1], high: self.0[n - k], coverage: (1.0 - 2.0 * tail).max(0.0) }
    }
}

/// Drift of a series: the median of its second half divided by that of the first; 1 is steady. None if there is only one value, or the median of a
/// half is not positive. The middle value of an odd number belongs to neither half.
///
/// # Errors
/// The series is empty, or a value is not finite.
pub fn drift(series: &[f64]) -> Result<Option<f64>, SampleError> {
    let half = series.len() / 2;
    if half == 0 {
        return Sample::new(series).map(|_| None);
    }
    let (first, second) = (Sample::new(&series[..half])?, Sample::new(&series[series.len() - half..])?);
    let ratio = second.median() / first.median();
    Ok((first.median() > 0.0 && ratio > 0.0).then_some(ratio))
}

/// Medians of `count` consecutive blocks of a series, of nearly equal lengths. Neighbouring times are correlated; block medians are far less so, and
/// robust against outliers. None if there are fewer values than blocks, or `count` is 0.
///
/// # Errors
/// A value is not finite.
pub fn block_medians(series: &[f64], count: usize) -> Result<Option<Vec<f64>>, SampleError> {
    if count == 0 || series.len() < count {
        return Ok(None);
    }
    let cut = |i: usize| i * series.len() / count;
    let medians = (0..count).map(|i| Sample::new(&series[cut(i)..cut(i + 1)]).map(|s| s.median()));
    medians.collect::<Result<Vec<_>, _>>().map(Some)
}

/// Maximum number of samples, both together, for which the exact distribution of the rank sum is computed. Above it the normal
/// approximation is accurate enough.
const MAX_EXACT: usize = 60;

/// The result of a two-sided Mann-Whitney test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MannWhitney {
    /// U: the number of pairs of a value of each sample in which that of the first sample is larger. Ties count half.
    pub u: f64,
    /// p value: the probability of a U at least as extreme if both samples are from one distribution.
    pub p: f64,
    /// True if `p` is from the exact distribution, false if from the normal approximation.
    pub is_exact: bool,
}

/// An estimate of the shift of the second sample relative to the first, with a confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    pub estimate: f64,
    pub low: f64,
    pub high: f64,
    /// Probability, 0..1, that the interval covers the true shift, if the distributions differ by a shift only.
    pub coverage: f64,
}

/// The Mann-Whitney test (H. B. Mann and D. R. Whitney, On a test of whether one of two random variables is stochastically larger than the
/// other, 1947). Small samples use the exact permutation distribution of the midranks, so that ties need no correction. Large samples use
/// the normal approximation with the variance corrected for ties and a continuity correction.
///
/// # Errors
/// `a` or `b` is empty, or a value is not finite.
pub fn mann_whitney(a: &[f64], b: &[f64]) -> Result<MannWhitney, SampleError> {
    let (first, second) = (Sample::new(a)?, Sample::new(b)?);
    let (n, m) = (first.count(), second.count());
    let all = Sample::new(&[a, b].concat())?;
    let all = all.sorted();
    // Twice the midrank of every sample of both: integers.
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
    if n + m <= MAX_EXACT {
        let subsets = rank_sums(&doubled, n);
        let total: f64 = subsets.iter().sum();
        let below: f64 = subsets[..=sum].iter().sum();
        let above: f64 = subsets[sum..].iter().sum();
        return Ok(MannWhitney { u, p: (2.0 * below.min(above) / total).min(1.0), is_exact: true });
    }
    let (n, m) = (n as f64, m as f64);
    let variance = n * m / 12.0 * (n + m + 1.0 - ties / ((n + m) * (n + m - 1.0)));
    let off = ((u - n * m / 2.0).abs() - 0.5).max(0.0);
    let p = if variance > 0.0 { (2.0 * normal_tail(off / variance.sqrt())).min(1.0) } else { 1.0 };
    Ok(MannWhitney { u, p, is_exact: false })
}

/// Number of subsets of `chosen` ranks for each rank sum.
fn rank_sums(ranks: &[usize], chosen: usize) -> Vec<f64> {
    let max_sum: usize = ranks[ranks.len() - chosen..].iter().sum();
    let mut counts = vec![vec![0.0; max_sum + 1]; chosen + 1];
    counts[0][0] = 1.0;
    for rank in ranks {
        for k in (1..=chosen).rev() {
            let (less, here) = counts.split_at_mut(k);
            for sum in *rank..=max_sum {
                here[0][sum] += less[k - 1][sum - rank];
            }
        }
    }
    counts.swap_remove(chosen)
}

/// Smallest p value that the Mann-Whitney test can have for two samples of `n` values each: 2 / C(2n, n).
pub fn min_p(n: usize) -> f64 {
    2.0 / (1..=n).map(|i| (n + i) as f64 / i as f64).product::<f64>()
}

/// Estimates the shift between two samples: the median of all differences b - a (J. L. Hodges and E. L. Lehmann, Estimates of location based on rank
/// tests, 1963). The interval holds every shift that the Mann-Whitney test would not reject at a coverage of `level` (0..1); `coverage` is below
/// `level` if there are too few samples. Memory: n * m values.
///
/// # Errors
/// `a` or `b` is empty, or a value is not finite.
pub fn hodges_lehmann(a: &[f64], b: &[f64], level: f64) -> Result<Shift, SampleError> {
    let (first, second) = (Sample::new(a)?, Sample::new(b)?);
    let (n, m) = (first.count(), second.count());
    let pairs: Vec<f64> = second.sorted().iter().flat_map(|y| first.sorted().iter().map(move |x| y - x)).collect();
    let differences = Sample::new(&pairs)?;
    // By P(U < k).
    let Interval { low, high, coverage } = if n + m <= MAX_EXACT {
        let subsets = rank_sums(&(1..=n + m).collect::<Vec<_>>(), n);
        let total: f64 = subsets.iter().sum();
        let least = n * (n + 1) / 2;
        let mut below = 0.0;
        differences.covering(level, |k| {
            below += subsets[least + k - 1] / total;
            below
        })
    } else {
        let (n, m) = (n as f64, m as f64);
        let deviation = (n * m * (n + m + 1.0) / 12.0).sqrt();
        differences.covering(level, |k| normal_tail((n * m / 2.0 - (k as f64 - 0.5)) / deviation))
    };
    Ok(Shift { estimate: differences.median(), low, high, coverage })
}

/// Number of subsets of some ranks for each rank sum, whatever their count.
fn all_rank_sums(ranks: &[usize]) -> Vec<f64> {
    let mut counts = vec![0.0; ranks.iter().sum::<usize>() + 1];
    counts[0] = 1.0;
    for rank in ranks {
        for sum in (*rank..counts.len()).rev() {
            counts[sum] += counts[sum - rank];
        }
    }
    counts
}

/// p value of the two-sided signed-rank test (F. Wilcoxon, Individual comparisons by ranking methods, 1945): the probability of rank sums at least as
/// extreme if the differences of pairs lie symmetrically about 0. It uses the exact distribution of the midranks. Differences of 0 are left out.
///
/// # Errors
/// `differences` is empty, or a value is not finite.
pub fn signed_rank(differences: &[f64]) -> Result<f64, SampleError> {
    Sample::new(differences)?;
    let moved: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    // Twice the midrank of each distance: integers.
    let doubled = |d: f64| {
        moved.iter().map(|o| usize::from(o.abs() < d.abs()) + usize::from(o.abs() <= d.abs())).sum::<usize>() + 1
    };
    let ranks: Vec<usize> = moved.iter().map(|d| doubled(*d)).collect();
    let sum: usize = moved.iter().zip(&ranks).filter(|(d, _)| **d > 0.0).map(|(_, rank)| rank).sum();
    let counts = all_rank_sums(&ranks);
    let tail = counts[..=sum].iter().sum::<f64>().min(counts[sum..].iter().sum());
    Ok((2.0 * tail / counts.iter().sum::<f64>()).min(1.0))
}

/// Smallest p value that [`signed_rank`] can return for `n` pairs.
pub fn min_signed_p(n: usize) -> f64 {
    2.0 * 0.5f64.powi(n as i32)
}

/// Estimates the shift of paired samples from the differences of the pairs: the median of the means of every two differences, each also with itself
/// (Hodges and Lehmann, 1963). The interval holds every shift that [`signed_rank`] would not reject at a coverage of `level` (0..1); `coverage` is
/// below `level` if there are too few pairs.
///
/// # Errors
/// `differences` is empty, or a value is not finite.
pub fn paired_shift(differences: &[f64], level: f64) -> Result<Shift, SampleError> {
    let sorted = Sample::new(differences)?;
    let each = sorted.sorted();
    let means: Vec<f64> = (0..each.len()).flat_map(|i| each[..=i].iter().map(move |x| (x + each[i]) / 2.0)).collect();
    let means = Sample::new(&means)?;
    let counts = all_rank_sums(&(1..=each.len()).collect::<Vec<_>>());
    let total: f64 = counts.iter().sum();
    let mut below = 0.0;
    let Interval { low, high, coverage } = means.covering(level, |k| {
        below += counts[k - 1] / total;
        below
    });
    Ok(Shift { estimate: means.median(), low, high, coverage })
}

/// Adjusted p values by Holm's correction (S. Holm, A simple sequentially rejective multiple test procedure, 1979), in the order of `p`. Rejecting
/// those up to alpha gives a family-wise error rate of at most alpha, whatever the dependence of the tests.
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

/// P(Z > z) of the standard normal distribution, with a relative error of about 1e-14.
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
