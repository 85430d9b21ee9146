//! Order statistics.

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
}
