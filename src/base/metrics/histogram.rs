//! A Prometheus histogram: counts of values up to fixed limits, and the sum of the values.

/// A histogram of values with fixed limits, so that its memory does not depend on the number of values.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Rising. A value belongs to the first limit that it does not exceed.
    limits: &'static [f64],
    /// By limit; the last one is of the values beyond all limits.
    counts: Vec<u64>,
    sum: f64,
}

impl Histogram {
    /// An empty histogram. `limits`: the inclusive upper limit of each bin, finite and ascending; a last bin holds larger values.
    pub fn new(limits: &'static [f64]) -> Histogram {
        Histogram { limits, counts: vec![0; limits.len() + 1], sum: 0.0 }
    }

    /// Counts a value. NaN and infinities are ignored.
    pub fn record(&mut self, value: f64) {
        if value.is_finite() {
            self.counts[self.limits.partition_point(|limit| *limit < value)] += 1;
            self.sum += value;
        }
    }

    /// Adds the counts of another histogram, which must have the same limits.
    pub fn add(&mut self, other: &Histogram) {
        self.counts.iter_mut().zip(&other.counts).for_each(|(sum, count)| *sum += count);
        self.sum += other.sum;
    }

    /// Sets all counts and the sum to 0.
    pub fn reset(&mut self) {
        self.counts.fill(0);
        self.sum = 0.0;
    }

    /// Each upper limit, infinity last, with the number of values that do not exceed it.
    pub(super) fn cumulative(&self) -> impl Iterator<Item = (f64, u64)> + '_ {
        let limits = self.limits.iter().copied().chain([f64::INFINITY]);
        limits.zip(self.counts.iter().scan(0, |sum, count| {
            *sum += count;
            Some(*sum)
        }))
    }

    pub(super) fn sum(&self) -> f64 {
        self.sum
    }

    /// Number of values that were counted.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_belongs_to_the_first_limit_that_it_does_not_exceed() {
        let mut histogram = Histogram::new(&[0.1, 1.0]);
        for value in [0.0, 0.1, 0.100001, 1.0, 1.5, f64::NAN, f64::INFINITY] {
            histogram.record(value);
        }
        let limits: Vec<_> = histogram.cumulative().collect();
        assert_eq!(limits, [(0.1, 2), (1.0, 4), (f64::INFINITY, 5)]);
        assert!((histogram.sum() - 2.700001).abs() < 1e-12);
        let mut twice = histogram.clone();
        twice.add(&histogram);
        assert_eq!((twice.count(), twice.sum()), (10, 2.0 * histogram.sum()));
        twice.reset();
        assert_eq!(twice, Histogram::new(&[0.1, 1.0]));
    }
}
