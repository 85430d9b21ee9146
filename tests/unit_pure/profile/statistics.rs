//! Expected numbers: scipy 1.17.1 and numpy, in the calls named beside them.

use echolume::low_level::profile::statistics::{
    Sample, SampleError, block_medians, drift, hodges_lehmann, holm, mann_whitney, min_p, min_signed_p, normal_tail,
    paired_shift, signed_rank,
};

fn close(got: f64, expected: f64, relative: f64) {
    assert!((got - expected).abs() <= relative * expected.abs(), "{got}, expected {expected}");
}

fn sample(values: &[f64]) -> Sample {
    Sample::new(values).expect("a sample")
}

#[test]
fn quantiles_are_those_of_type_7() {
    let s = sample(&[2.31, 1.87, 2.05, 9.4, 1.99, 2.12, 2.4]);
    // numpy.quantile, scipy.stats.median_abs_deviation
    for (share, expected) in
        [(0.0, 1.87), (0.05, 1.906), (0.25, 2.02), (0.5, 2.12), (0.9, 5.2), (0.95, 7.3), (1.0, 9.4)]
    {
        close(s.quantile(share), expected, 1e-14);
    }
    close(s.mad(), 0.19, 1e-14);
    assert_eq!((s.min(), s.median(), s.max(), s.count()), (1.87, 2.12, 9.4, 7));
    assert_eq!(sample(&[3.0, 1.0]).median(), 2.0);
}

#[test]
fn the_interval_of_the_median_has_the_binomials_coverage() {
    // k by scipy.stats.quantile_test(...).confidence_interval(0.95), coverage 1 - 2 scipy.stats.binom.cdf(k - 1, n, 0.5).
    for (n, k, coverage) in [
        (6, 1, 0.96875),
        (10, 2, 0.978515625),
        (30, 10, 0.9572260547429323),
        (101, 41, 0.9539559330706572),
        (2000, 956, 0.9534471795082164),
    ] {
        let ranks: Vec<f64> = (1..=n).rev().map(f64::from).collect();
        let interval = sample(&ranks).median_interval(0.95);
        assert_eq!((interval.low, interval.high), (f64::from(k), f64::from(n + 1 - k)), "n = {n}");
        close(interval.coverage, coverage, 1e-10);
        assert!(interval.reaches(0.95));
    }
}

#[test]
fn too_few_samples_say_how_little_their_range_covers() {
    for (n, coverage) in [(1, 0.0), (2, 0.5), (3, 0.75), (5, 0.9375)] {
        let ranks: Vec<f64> = (1..=n).map(f64::from).collect();
        let interval = sample(&ranks).median_interval(0.95);
        assert_eq!((interval.low, interval.high), (1.0, f64::from(n)));
        close(interval.coverage, coverage, 1e-15);
        assert!(!interval.reaches(0.95));
    }
}

#[test]
fn empty_and_non_finite_samples_are_refused() {
    assert_eq!(Sample::new(&[]), Err(SampleError::Empty));
    let Err(SampleError::NotFinite { at: 1, .. }) = Sample::new(&[1.0, f64::NAN]) else { panic!("NaN was ordered") };
    assert_eq!(
        Sample::new(&[f64::INFINITY]).map(|s| s.count()),
        Err(SampleError::NotFinite { at: 0, value: f64::INFINITY })
    );
    assert!(mann_whitney(&[], &[1.0]).is_err() && mann_whitney(&[1.0], &[f64::NAN]).is_err());
    assert!(hodges_lehmann(&[1.0], &[], 0.95).is_err());
    assert!(drift(&[]).is_err() && drift(&[1.0, f64::NAN]).is_err());
}

#[test]
fn equal_samples_are_one_value_and_no_difference() {
    let s = sample(&[4.0; 9]);
    assert_eq!((s.quantile(0.05), s.median(), s.mad()), (4.0, 4.0, 0.0));
    for n in [5, 200] {
        let test = mann_whitney(&vec![4.0; n], &vec![4.0; n]).expect("a test");
        assert_eq!((test.u, test.p), ((n * n) as f64 / 2.0, 1.0));
    }
    let shift = hodges_lehmann(&[4.0; 6], &[4.0; 6], 0.95).expect("a shift");
    assert_eq!((shift.estimate, shift.low, shift.high), (0.0, 0.0, 0.0));
}

#[test]
fn mann_whitney_is_scipys() {
    let check = |a: &[f64], b: &[f64], u: f64, p: f64, exact: bool| {
        let test = mann_whitney(a, b).expect("a test");
        assert_eq!((test.u, test.is_exact), (u, exact));
        close(test.p, p, 1e-11);
        let turned = mann_whitney(b, a).expect("a test");
        assert_eq!(turned.u, (a.len() * b.len()) as f64 - u);
        close(turned.p, p, 1e-11);
    };
    // scipy.stats.mannwhitneyu(a, b, method="exact")
    let (a, b) = ([1.1, 2.2, 3.3, 4.4, 5.5], [2.7, 6.1, 7.2, 8.3, 9.4, 10.5]);
    check(&a, &b, 3.0, 0.030303030303030304, true);
    let roots = |scale: f64, offset: f64| (1..=30).map(|i| (f64::from(i) * scale + offset).sqrt()).collect::<Vec<_>>();
    check(&roots(1.0, 0.0), &roots(1.3, 0.37), 335.0, 0.09060257235310637, true);
    // Ties: all 462 ways counted with itertools.combinations over scipy.stats.rankdata, and scipy.stats.permutation_test.
    check(&[1.0, 2.0, 2.0, 3.0, 5.0], &[2.0, 3.0, 4.0, 5.0, 5.0, 6.0], 6.5, 0.16017316017316016, true);
    // scipy.stats.mannwhitneyu(a, b, method="asymptotic"): with ties, and without.
    let modulo = |by: u32, of: u32, plus: u32| (0..50).map(|i| f64::from(i * by % of + plus)).collect::<Vec<_>>();
    check(&modulo(7, 23, 0), &modulo(5, 19, 4), 1046.0, 0.1602005413616503, false);
    let (a, b) = waves();
    check(&a, &b, 717.0, 0.42727890617197617, false);
    // Apart as far as can be: 2 of C(12, 6) ways.
    let low = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    check(&low, &low.map(|v| v + 6.0), 0.0, 2.0 / 924.0, true);
    close(min_p(6), 2.0 / 924.0, 1e-14);
}

fn waves() -> (Vec<f64>, Vec<f64>) {
    let wave = |turn: f64, phase: f64, plus: f64| {
        (0..40).map(|i| (f64::from(i) * turn + phase).sin() * 10.0 + plus).collect::<Vec<_>>()
    };
    (wave(1.7, 0.0, 0.0), wave(2.3, 0.5, 0.9))
}

#[test]
fn the_shift_is_the_median_of_all_differences_and_its_interval_inverts_the_test() {
    // All differences sorted by numpy; k and the coverage from all C(11, 5) rank sums.
    let (a, b) = ([1.1, 2.2, 3.3, 4.4, 5.5], [2.7, 6.1, 7.2, 8.3, 9.4, 10.5]);
    let shift = hodges_lehmann(&a, &b, 0.95).expect("a shift");
    for (got, expected) in
        [(shift.estimate, 4.45), (shift.low, 0.5), (shift.high, 7.2), (shift.coverage, 0.9696969696969697)]
    {
        close(got, expected, 1e-12);
    }
    // Shifts inside the interval are not rejected, shifts outside are.
    let p = |by: f64| mann_whitney(&a.map(|v| v + by), &b).expect("a test").p;
    assert!(p(shift.low + 1e-6) > 0.05 && p(shift.low - 1e-6) < 0.05);
    assert!(p(shift.high - 1e-6) > 0.05 && p(shift.high + 1e-6) < 0.05);
    // The same with the normal approximation.
    let (a, b) = waves();
    let shift = hodges_lehmann(&a, &b, 0.95).expect("a shift");
    close(shift.estimate, 0.9118975155802413, 1e-12);
    let p = |by: f64| mann_whitney(&a.iter().map(|v| v + by).collect::<Vec<_>>(), &b).expect("a test").p;
    assert!(
        p(shift.low + 1e-9) > 0.05 && p(shift.low - 1e-9) < 0.05,
        "{} {}",
        p(shift.low + 1e-9),
        p(shift.low - 1e-9)
    );
    assert!(p(shift.high - 1e-9) > 0.05 && p(shift.high + 1e-9) < 0.05);
    // One against one: the difference, and no coverage at all.
    let single = hodges_lehmann(&[1.0], &[3.0], 0.95).expect("a shift");
    assert_eq!((single.estimate, single.low, single.high, single.coverage), (2.0, 2.0, 2.0, 0.0));
}

#[test]
fn the_normal_tail_is_scipys() {
    // scipy.stats.norm.sf
    for (z, expected) in [
        (0.0, 0.5),
        (0.5, 0.3085375387259869),
        (1.959963984540054, 0.025),
        (2.2, 0.013903447513498595),
        (3.0, 0.0013498980316300933),
        (5.0, 2.866515718791933e-07),
        (8.0, 6.22096057427174e-16),
        (-1.0, 0.8413447460685429),
    ] {
        close(normal_tail(z), expected, 2e-14);
    }
}

#[test]
fn holm_steps_down_and_never_back() {
    // p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm") of R, by hand: 3 x 0.01, 0.06 kept, 2 x 0.03, 4 x 0.005.
    let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
    for (got, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
        close(*got, expected, 1e-14);
    }
    assert_eq!(holm(&[0.7, 0.6]), [1.0, 1.0]);
    assert!(holm(&[]).is_empty());
}

#[test]
fn blocks_keep_their_order_and_shrug_off_an_outlier() {
    let mut series: Vec<f64> = (0..30).map(f64::from).collect();
    series[7] = 1e9;
    assert_eq!(block_medians(&series, 6), Ok(Some(vec![2.0, 8.0, 12.0, 17.0, 22.0, 27.0])));
    assert_eq!(block_medians(&series[..3], 2), Ok(Some(vec![0.0, 1.5])));
    assert_eq!(block_medians(&series[..3], 4), Ok(None));
    assert_eq!(block_medians(&[], 6), Ok(None));
}

#[test]
fn drift_is_the_second_half_over_the_first() {
    assert_eq!(drift(&[1.0, 1.0, 50.0, 2.0, 2.0]), Ok(Some(2.0)));
    assert_eq!(drift(&[1.0]), Ok(None));
    assert_eq!(drift(&[0.0, 0.0, 1.0, 1.0]), Ok(None));
}

/// Against scipy.stats.wilcoxon(method="exact"), and by counting.
#[test]
fn signed_ranks_have_the_exact_distribution() {
    let close = |got: f64, expected: f64| assert!((got - expected).abs() < 1e-12, "{got} instead of {expected}");
    close(signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0]).expect("p"), 0.0625);
    close(min_signed_p(5), 0.0625);
    // Rank sums of 0 and 1: two of 64.
    close(signed_rank(&[-1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).expect("p"), 0.0625);
    close(signed_rank(&[-3.0, 1.0, -2.0, 4.0]).expect("p"), 1.0);
    // A difference of 0 tells nothing; of two equal distances either sign is as likely.
    close(signed_rank(&[0.0, 2.0, 2.0]).expect("p"), 0.5);
    close(signed_rank(&[0.0, 0.0]).expect("p"), 1.0);
    assert!(signed_rank(&[]).is_err());
    let shift = paired_shift(&[3.0, 1.0, 2.0, 4.0, 5.0, 6.0], 0.9).expect("shift");
    assert_eq!((shift.estimate, shift.low, shift.high), (3.5, 2.0, 5.0));
    close(shift.coverage, 1.0 - 2.0 * 3.0 / 64.0);
}
