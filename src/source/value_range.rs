//! The range of the values of a file: that of all samples, or of all but outliers. A few samples of 1e30 among echoes of 0 to 1 would
//! map every echo to 0.
//!
//! An outlier is a sample that lies beyond a gap: between it and the rest no sample is, over a distance of more than [`GAP`] times the
//! span of the rest. Percentiles would cut the brightest echoes of clean data; and echoes, whose distribution is continuous
//! over all their decades, have no such gap. Outliers are recognised up to a share of [`MOST`].

use super::describe::number;
use super::samples::{not_empty, widen};
use crate::StoredType;

/// Least empty distance to an outlier, spans of the rest: 60 dB.
const GAP: f64 = 1000.0;
/// Largest share of samples that are outliers. More are taken for data.
const MOST: f64 = 0.05;
/// Bins of the histogram: sign, exponent and seven bits of the mantissa of an f32, 1/128 of a value wide.
const BINS: usize = 1 << 16;

/// Samples with the same upper 16 bits.
#[derive(Clone, Copy)]
struct Bin {
    count: u64,
    low: f32,
    high: f32,
}

/// Determines the range of the samples of a file, frame by frame, without outliers.
pub(super) struct ValueRange {
    stored: StoredType,
    full: [f64; 2],
    /// In the order of the values. Of f32 samples only: others have no room for outliers.
    bins: Vec<Bin>,
}

/// The range of the samples of a file, and how many lie outside of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    pub range: [f64; 2],
    /// Number of samples outside of `range`; `of` is the number of all samples. Both are 0 if samples are not f32.
    pub beyond: u64,
    pub of: u64,
    /// Smallest and largest sample of the file, outliers included. If they are equal, the second value is made larger.
    pub full: [f64; 2],
}

impl Measured {
    /// A warning for users that outliers are clamped: the range, their share, and the setting that sets another range. None if there are no
    /// outliers.
    pub(super) fn remark(&self) -> Option<String> {
        let ([low, high], [smallest, largest]) = (self.range.map(number), self.full.map(number));
        let share = 100.0 * self.beyond as f64 / self.of.max(1) as f64;
        (self.beyond > 0).then(|| {
            format!(
                "{} % of the samples are outliers ({smallest} .. {largest}) and are clamped to {low} .. {high}; samples.range sets another range",
                number(share)
            )
        })
    }
}

impl ValueRange {
    pub(super) fn new(stored: StoredType) -> ValueRange {
        let bins = if stored == StoredType::F32 { BINS } else { 0 };
        let empty = Bin { count: 0, low: f32::INFINITY, high: f32::NEG_INFINITY };
        ValueRange { stored, full: [f64::INFINITY, f64::NEG_INFINITY], bins: vec![empty; bins] }
    }

    /// Adds the stored samples of a frame; those of f32 must be finite.
    pub(super) fn take(&mut self, bytes: &[u8]) {
        if self.stored != StoredType::F32 {
            widen(&mut self.full, self.stored, bytes);
            return;
        }
        for word in bytes.as_chunks::<4>().0 {
            let value = f32::from_le_bytes(*word);
            // Negative floats order backwards by their bits, and before all others.
            let bits = value.to_bits();
            let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
            if let Some(bin) = self.bins.get_mut((ordered >> 16) as usize) {
                *bin = Bin { count: bin.count + 1, low: bin.low.min(value), high: bin.high.max(value) };
            }
        }
    }

    pub(super) fn measured(self) -> Measured {
        let bins: Vec<Bin> = self.bins.into_iter().filter(|bin| bin.count > 0).collect();
        let (Some(first), Some(last)) = (bins.first(), bins.last()) else {
            let full = not_empty(self.full);
            return Measured { range: full, beyond: 0, of: 0, full };
        };
        let full = [f64::from(first.low), f64::from(last.high)];
        let count = |bins: &[Bin]| bins.iter().map(|bin| bin.count).sum::<u64>();
        let of = count(&bins);
        let body = body(&bins);
        let beyond = of - count(body);
        let is_outlier = beyond > 0 && beyond as f64 <= MOST * of as f64;
        let range = match (body.first(), body.last()) {
            (Some(first), Some(last)) if is_outlier => [f64::from(first.low), f64::from(last.high)],
            _ => full,
        };
        let beyond = if is_outlier { beyond } else { 0 };
        Measured { range: not_empty(range), beyond, of, full: not_empty(full) }
    }
}

/// The bins that no gap separates from the median of the samples that are not 0: 0 is the background of most volumes, and what stands for
/// samples that were not finite. 0 itself counts as part of the body, whether or not there is one.
fn body(bins: &[Bin]) -> &[Bin] {
    let echoes = bins.iter().filter(|bin| bin.low != 0.0 || bin.high != 0.0);
    let all: u64 = echoes.clone().map(|bin| bin.count).sum();
    let mut before = 0;
    let median = echoes.clone().find(|bin| {
        before += bin.count;
        2 * before >= all
    });
    let Some(median) = median else { return bins };
    let (mut low, mut high) = (f64::from(median.low).min(0.0), f64::from(median.high).max(0.0));
    let mut from = bins.partition_point(|bin| f64::from(bin.low) < low);
    let mut to = bins.partition_point(|bin| f64::from(bin.high) <= high);
    loop {
        let near = GAP * (high - low);
        let below = from.checked_sub(1).and_then(|n| bins.get(n)).filter(|bin| low - f64::from(bin.high) <= near);
        let above = bins.get(to).filter(|bin| f64::from(bin.low) - high <= near);
        match (below, above) {
            (Some(bin), _) => (low, from) = (f64::from(bin.low).min(low), from - 1),
            (None, Some(bin)) => (high, to) = (f64::from(bin.high).max(high), to + 1),
            (None, None) => return bins.get(from..to).unwrap_or(bins),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(values: impl IntoIterator<Item = f32>) -> Measured {
        let mut range = ValueRange::new(StoredType::F32);
        let bytes: Vec<u8> = values.into_iter().flat_map(f32::to_le_bytes).collect();
        bytes.chunks(4000).for_each(|frame| range.take(frame));
        range.measured()
    }

    /// An envelope of speckle (Rayleigh) with reflectors up to 70 dB above it.
    fn envelope(i: u32) -> f32 {
        let u = (f64::from(i) * 0.618_033_988_75).fract();
        let speckle = (-2.0 * (1.0 - u).ln()).sqrt();
        (speckle * if i.is_multiple_of(50) { 10f64.powf(3.5 * (f64::from(i) * 0.754_877_666).fract()) } else { 1.0 })
            as f32
    }

    #[test]
    fn clean_data_keep_their_smallest_and_largest_sample() {
        let clean: Vec<Vec<f32>> = vec![
            (0..20_000).map(envelope).collect(),
            (0..20_000).map(|i| -60.0 + 60.0 * (i as f32 * 0.37).sin().abs()).collect(),
            (0..20_000).map(|i| if i % 100 == 0 { 0.3 } else { 0.0 }).collect(),
            (0..20_000).map(|i| 1e6 + (i % 7) as f32).collect(),
            (0..20_000).map(|i| if i % 19 == 0 { 1e30 } else { 1.0 }).collect(),
            vec![0.25, -0.5],
        ];
        for values in clean {
            let exact = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                [low.min(f64::from(*v)), high.max(f64::from(*v))]
            });
            let found = measured(values.iter().copied());
            assert_eq!((found.range, found.full, found.beyond), (exact, exact, 0));
        }
        assert_eq!(measured([2.0; 9]).range, [2.0, 4.0]);
        assert_eq!(measured([]).range, [0.0, 1.0]);
    }

    #[test]
    fn two_percent_of_outliers_do_not_crush_the_rest() {
        let echo = |i: u32| (f64::from(i) * 0.618_033_988_75).fract() as f32;
        let largest = (0..20_000).map(echo).fold(0.0, f32::max);
        for outlier in [1e30, f32::MAX, -32768.0, -1e30] {
            // Most of a volume may be background.
            for background in [1, 8] {
                let value = |i: u32| if i.is_multiple_of(background) { echo(i) } else { 0.0 };
                let found = measured((0..20_000).map(|i| if i % 50 == 7 { outlier } else { value(i) }));
                assert_eq!((found.beyond, found.of), (400, 20_000), "{outlier}");
                let [low, high] = found.range;
                assert!((0.0..1e-3).contains(&low) && high > 0.99 && high <= f64::from(largest), "{:?}", found.range);
                assert!(found.full.contains(&f64::from(outlier)));
            }
        }
        // On both sides at once.
        let both = measured((0..20_000).map(|i| match i % 100 {
            3 => 1e20,
            4 => -1e9,
            _ => echo(i),
        }));
        assert_eq!((both.beyond, both.range[0] >= 0.0, both.range[1] < 1.0), (400, true, true));
    }

    #[test]
    fn bytes_and_words_have_no_outliers() {
        let mut range = ValueRange::new(StoredType::U16);
        range.take(&[7, 0, 7, 0, 255, 255]);
        assert_eq!(range.measured(), Measured { range: [7.0, 65535.0], beyond: 0, of: 0, full: [7.0, 65535.0] });
    }
}
