//! Order statistics, and pseudo-random numbers.

/// The quantile at `share` (0..1, clamped) of sorted values, type 7 of Hyndman and Fan (Sample quantiles in statistical packages, The American Statistician
/// 50, 1996): linear between the order statistics, which are at 0, 1 / (n - 1) ... 1. None without values.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let at = share.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let [low, high] = [at.floor(), at.ceil()].map(|n| sorted[n as usize]);
    Some(low + at.fract() * (high - low))
}

/// The quantile at `share` (0..1, clamped) of values in any order, computed by [`quantile`]. None without values.
pub fn quantile_of(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    quantile(&sorted, share)
}

/// The finaliser of SplitMix64 (Steele, Lea, Flood, Fast splittable pseudorandom number generators, OOPSLA 2014): a counter goes in, 64 bits that look
/// independent come out.
#[inline]
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_linear_between_the_values() {
        // By numpy.quantile of [1, 2, 4, 8] at 0, 0.1, 0.5, 0.95, 1.
        for (share, value) in [(0.0, 1.0), (0.1, 1.3), (0.5, 3.0), (0.95, 7.4), (1.0, 8.0), (2.0, 8.0)] {
            let found = quantile_of([4.0, 1.0, 8.0, 2.0], share).expect("values");
            assert!((found - value).abs() < 1e-12, "{share}: {found}");
        }
        assert_eq!((quantile(&[], 0.5), quantile(&[7.0], 0.3)), (None, Some(7.0)));
    }

    /// The first numbers of SplitMix64 from the seed 0, by Vigna's splitmix64.c.
    #[test]
    fn mixed_counters_are_the_numbers_of_splitmix64() {
        let counter = 0x9e37_79b9_7f4a_7c15u64;
        let mixed = [1, 2, 3].map(|n| mix(counter.wrapping_mul(n)));
        assert_eq!(mixed, [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f]);
    }
}
