//! What a handful of times says without assuming their distribution: order statistics, and how far they can be trusted.
//! Times have long tails and outliers, so medians and ranks are used throughout, means and deviations nowhere.

/// Samples that no statistic can be made of.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    #[error("there are no samples")]
    Empty,
    #[error("sample {at} is {value}: only finite numbers can be ordered")]
    NotFinite { at: usize, value: f64 },
}

/// At least one finite number, in ascending order. Units are the caller's and stay.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample(Vec<f64>);

/// An interval for a median (or a shift), and the probability that it covers the true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
    /// Exact probability, 0..1, for independent draws from one continuous distribution; neighbours that resemble each other
    /// make it too high.
    pub coverage: f64,
}

impl Interval {
    /// False where there were too few samples for the coverage that was asked for.
    pub fn reaches(&self, level: f64) -> bool {
        self.coverage >= level
    }
}

impl Sample {
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

    /// The quantile at `share` (0..1, clamped), type 7 of Hyndman and Fan (Sample quantiles in statistical packages, The
    /// American Statistician 50, 1996): linear between the order statistics, which lie at 0, 1 / (n - 1) ... 1.
    pub fn quantile(&self, share: f64) -> f64 {
        let at = share.clamp(0.0, 1.0) * (self.0.len() - 1) as f64;
        let (below, part) = (at.floor() as usize, at.fract());
        let above = (below + 1).min(self.0.len() - 1);
        self.0[below] + part * (self.0[above] - self.0[below])
    }

    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }

    /// Median of the distances from the median, not scaled to any distribution.
    pub fn mad(&self) -> f64 {
        let median = self.median();
        let mut distances: Vec<f64> = self.0.iter().map(|v| (v - median).abs()).collect();
        distances.sort_by(f64::total_cmp);
        Sample(distances).median()
    }

    /// Between which two order statistics the true median lies: the k-th from below and the k-th from above, where the number
    /// of samples below the true median is binomial with p = 1/2 (David and Nagaraja, BarrierRecorder Statistics, 2003, section 7.1).
    /// k is the largest that still covers `level`; where none does, the whole range is given with what it covers.
    pub fn median_interval(&self, level: f64) -> Interval {
        let n = self.0.len();
        // P(fewer than k samples lie below), by its logarithm: 2^-n underflows from 1075 samples on.
        let mut log_share = -(n as f64) * std::f64::consts::LN_2;
        let mut below = log_share.exp();
        let (mut k, mut tail) = (1, below);
        // Beyond the middle the two order statistics would swap sides.
        for next in 2..=n.div_ceil(2) {
            log_share += ((n + 2 - next) as f64 / (next - 1) as f64).ln();
            below += log_share.exp();
            if 1.0 - 2.0 * below < level {
                break;
            }
            (k, tail) = (next, below);
        }
        Interval { low: self.0[k - 1], high: self.0[n - k], coverage: (1.0 - 2.0 * tail).max(0.0) }
    }
}

/// By what factor the median of the second half of a series differs from that of the first: 1 is steady. None where a half is
/// empty or its median is not positive. The middle one of an odd number belongs to neither.
pub fn drift(series: &[f64]) -> Result<Option<f64>, SampleError> {
    let half = series.len() / 2;
    if half == 0 {
        return Sample::new(series).map(|_| None);
    }
    let (first, second) = (Sample::new(&series[..half])?, Sample::new(&series[series.len() - half..])?);
    let ratio = second.median() / first.median();
    Ok((first.median() > 0.0 && ratio > 0.0).then_some(ratio))
}

/// Medians of `count` stretches of a series in its order, as equal in length as they go. Neighbouring times resemble each
/// other; the medians of stretches do so far less, and one outlier does not move them. None where there are fewer samples.
pub fn block_medians(series: &[f64], count: usize) -> Result<Option<Vec<f64>>, SampleError> {
    if count == 0 || series.len() < count {
        return Ok(None);
    }
    let cut = |i: usize| i * series.len() / count;
    let medians = (0..count).map(|i| Sample::new(&series[cut(i)..cut(i + 1)]).map(|s| s.median()));
    medians.collect::<Result<Vec<_>, _>>().map(Some)
}
