//! Error against run time without a device: the metrics, the Pareto front, the choice, the file, the plot.

use crate::common::files::data;
use echolume::low_level::baselines::Stored;
use echolume::low_level::error_report::budget::{Budget, FLOOR, Share};
use echolume::low_level::error_report::choose::{self, Bound, choose, contenders, proposals};
use echolume::low_level::error_report::convergence::{Range, fit};
use echolume::low_level::error_report::metrics::{
    Levels, SurfaceError, changed_rays, levels, normals, pictures, surfaces,
};
use echolume::low_level::error_report::plot::Figure;
use echolume::low_level::error_report::{
    Combination, Dial, Errors, Kind, Measure, OwnError, Point, Reference, Report, Sizes, Time, Times, export,
    pareto_front, plot,
};
use echolume::low_level::passes::{MISS, Texels};
use proptest::prelude::*;

fn texels(width: usize, channels: usize, values: &[f64]) -> Texels {
    let height = values.len() / channels / width;
    Texels { size: [width, height, 1], channels, values: values.to_vec() }
}

/// About a median in ms, with a spread of a hundredth.
fn times(ms: f64) -> Times {
    let about = |ms: f64| Time { median: ms * 1e6, low: ms * 0.99e6, high: ms * 1.01e6, p95: ms * 1.01e6 };
    Times { volume: about(0.2 * ms), picture: about(0.8 * ms), total: about(ms) }
}

fn errors(rmse: f64) -> Errors {
    let levels = Levels {
        rms: 255.0 * rmse,
        median: 127.0 * rmse,
        p95: 510.0 * rmse,
        max: 1020.0 * rmse,
        over_1: 0.5,
        over_8: 0.0,
    };
    Errors { rmse, max: 4.0 * rmse, levels, ..Errors::default() }
}

/// A point; the default takes 10 ms.
fn point(label: &str, set: &[&str], value: f64, rmse: f64, ms: f64) -> Point {
    let set = set.iter().map(|s| s.to_string()).collect();
    let ratio = Time { median: ms / 10.0, low: ms / 10.1, high: ms / 9.9, p95: ms / 9.9 };
    let ratios = Some(Times { volume: ratio, picture: ratio, total: ratio });
    Point { label: label.into(), set, value, errors: errors(rmse), times: Some(times(ms)), ratios, is_default: false }
}

fn combination(set: &[&str], rmse: f64, ms: f64) -> Combination {
    let set: Vec<String> = set.iter().map(|s| s.to_string()).collect();
    let changed = set.iter().map(|s| ("dial".to_string(), s.clone())).collect();
    Combination { changed, set, errors: errors(rmse), reference_error: OwnError::default(), times: Some(times(ms)) }
}

fn dial(name: &str, unit: &str, default: usize, mut points: Vec<Point>) -> Dial {
    points[default].is_default = true;
    Dial {
        name: name.into(),
        kind: Kind::Numerical,
        is_ordered: !unit.is_empty(),
        unit: unit.into(),
        reference: Reference::F64,
        points,
        order: None,
        floor: None,
        note: None,
    }
}

fn report(dials: Vec<Dial>) -> Report {
    Report {
        format: Report::FORMAT.into(),
        device: "Device <1>, \"quoted\"".into(),
        driver: "driver & 2.0".into(),
        date: "2026-11-21T09:00:00Z".into(),
        scene: "sweep.mha".into(),
        sizes: Sizes { volume: [400, 128, 31], picture: [512, 512] },
        repeats: 9,
        dials,
        choices: Vec::new(),
        budget: Budget {
            reference: Reference::Converged { set: vec!["ray.step=0.01".into()], rmse: 1e-5 },
            reference_error: OwnError { rmse: 1e-5, levels: 0.01 },
            shares: vec![
                Share { source: "step".into(), label: "0.5".into(), errors: errors(0.03) },
                Share { source: "format".into(), label: "r16f".into(), errors: errors(0.004) },
                Share { source: FLOOR.into(), label: "everything as fine as it gets".into(), errors: errors(1e-6) },
            ],
            total: errors(0.031),
        },
    }
}

/// A step and a format, default 10 ms with errors of 0.03 and 0.004.
fn small() -> Report {
    let steps = vec![
        point("1", &["ray.step=1"], 1.0, 0.12, 5.0),
        point("0.5", &["ray.step=0.5"], 0.5, 0.03, 10.0),
        point("0.25", &["ray.step=0.25"], 0.25, 0.0075, 20.0),
    ];
    let formats = vec![
        point("r8", &["volume_format=r8"], 0.0, 0.02, 8.0),
        point("r16f", &["volume_format=r16f"], 1.0, 0.004, 10.0),
        point("r32f", &["volume_format=r32f"], 2.0, 0.0, 15.0),
    ];
    let choices = vec![
        combination(&[], 0.031, 10.0),
        combination(&["ray.step=1"], 0.11, 5.0),
        combination(&["ray.step=1", "volume_format=r8"], 0.15, 4.5),
        combination(&["ray.step=0.25", "volume_format=r8"], 0.03, 17.0),
        combination(&["ray.step=0.25"], 0.009, 20.0),
        combination(&["ray.step=0.25", "volume_format=r32f"], 0.0075, 28.0),
    ];
    Report { choices, ..report(vec![dial("step", "mm", 1, steps), dial("format", "", 1, formats)]) }
}

#[test]
fn an_exact_reference_prints_its_own_estimate_everywhere() {
    let mut exact = small();
    for dial in &mut exact.dials {
        dial.reference = Reference::Exact { estimate: 1e-12, pieces: 1000 };
    }
    let text = export::summary_table(&exact, Measure::Rmse);
    assert!(text.contains("exact rays of 1000 pieces") && text.contains("1.0e-12"), "{text}");
    assert!(export::csv(&exact).contains("exact rays,0.000000000001"), "{}", export::csv(&exact));
    let svg = plot::svg(&exact, Figure::Errors, Measure::Rmse, [1200, 800]).expect("a plot");
    assert!(svg.contains("estimate 1e-12"));
    assert_eq!(Report::from_json(&exact.to_json().expect("JSON")).expect("its report"), exact);
}

#[test]
fn structural_similarity_is_that_of_scikit_image() {
    #[derive(serde::Deserialize)]
    struct Pair {
        name: String,
        width: usize,
        height: usize,
        ssim: f64,
        a: Vec<f64>,
        b: Vec<f64>,
    }
    let file = data("ssim/pairs.json");
    let pairs: Vec<Pair> = serde_json::from_slice(&std::fs::read(file).expect("pairs.json")).expect("pairs");
    assert_eq!(pairs.len(), 4);
    for p in pairs {
        let read = |v: &[f64]| texels(p.width, 3, &v.iter().map(|v| v / 1000.0).collect::<Vec<_>>());
        let (a, b) = (read(&p.a), read(&p.b));
        assert_eq!(a.size[1], p.height);
        let ssim = pictures(&a, &b).expect("comparable").ssim.expect("large enough");
        assert!((ssim - p.ssim).abs() < 1e-9, "{}: {ssim} and {}", p.name, p.ssim);
        assert!((pictures(&a, &a).expect("comparable").ssim.expect("large enough") - 1.0).abs() < 1e-12);
    }
}

#[test]
fn errors_of_pictures_are_over_colours_and_leave_alpha_out() {
    let a = texels(2, 4, &[0.1, 0.2, 0.3, 1.0, 0.5, 0.5, 0.5, 0.0]);
    let b = texels(2, 4, &[0.1, 0.2, 0.3, 0.0, 0.5, 0.8, 0.5, 1.0]);
    let e = pictures(&a, &b).expect("comparable");
    assert!((e.rmse - 0.3 / 6f64.sqrt()).abs() < 1e-15 && (e.max - 0.3).abs() < 1e-15, "{e:?}");
    assert!((e.psnr.expect("they differ") - 10.0 * (6.0f64 / 0.09).log10()).abs() < 1e-9, "{e:?}");
    assert_eq!(e.ssim, None);
    assert_eq!(pictures(&a, &a).expect("comparable").psnr, None);
}

#[test]
fn what_cannot_be_compared_is_refused_by_name() {
    let a = texels(2, 3, &[0.0; 12]);
    let mut broken = a.clone();
    broken.values[3 * 3 + 1] = f64::NAN;
    let said = pictures(&broken, &a).expect_err("NaN is no result");
    assert!(said.contains("measured: pixel (1, 1) is NaN"), "{said}");
    assert!(pictures(&a, &broken).expect_err("nor in a reference").contains("reference: pixel (1, 1)"));
    let said = pictures(&a, &texels(4, 3, &[0.0; 12])).expect_err("another size");
    assert!(said.contains("2x2x1") && said.contains("4x1x1"), "{said}");
    assert!(pictures(&texels(1, 1, &[0.0]), &texels(1, 1, &[0.0])).is_err());
    assert!(pictures(&texels(1, 3, &[]), &texels(1, 3, &[])).is_err());
    assert!(surfaces(&texels(1, 1, &[f64::INFINITY]), &texels(1, 1, &[1.0]), f64::INFINITY).is_err());
}

#[test]
fn distances_are_compared_where_both_hit_and_misses_are_counted() {
    let a = texels(5, 1, &[10.0, 12.0, MISS, 7.0, MISS]);
    let b = texels(5, 1, &[10.5, 11.0, 3.0, MISS, MISS]);
    let e = surfaces(&a, &b, f64::INFINITY).expect("comparable");
    assert_eq!((e.false_hits, e.missed_hits), (0.2, 0.2));
    let s = e.error.expect("two pixels hit in both");
    assert_eq!((s.count, s.median, s.max), (2, 0.75, 1.0));
    assert!((s.rms - (1.25f64 / 2.0).sqrt()).abs() < 1e-15 && (s.p95 - 0.975).abs() < 1e-12, "{s:?}");
    let none = surfaces(&texels(1, 1, &[MISS]), &texels(1, 1, &[2.0]), f64::INFINITY).expect("comparable");
    assert_eq!((none.error, none.missed_hits), (None, 1.0));
}

#[test]
fn angles_between_normals_keep_their_digits() {
    let turn = 1e-7f64;
    let a = texels(4, 3, &[0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, turn.cos(), turn.sin(), 0.0]);
    let b = texels(4, 3, &[0.0, 0.0, 1.0, 0.0, 3.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let e = normals(&a, &b).expect("comparable");
    let s = e.error.expect("three normals");
    assert_eq!((s.count, s.max, e.missed_hits), (3, 90.0, 0.25));
    assert!((s.median / turn.to_degrees() - 1.0).abs() < 1e-9, "{s:?}");
}

#[test]
fn ties_stay_on_the_front_in_the_order_given() {
    let points = [[2.0, 1.0], [1.0, 3.0], [2.0, 1.0], [3.0, 1.0], [1.0, 4.0], [f64::NAN, 0.0], [4.0, 0.5]];
    assert_eq!(pareto_front(&points), [1, 0, 2, 6]);
    assert_eq!(pareto_front(&[]), [0usize; 0]);
}

proptest! {
    /// Against the definition, with few values so that ties are common.
    #[test]
    fn the_front_is_what_nothing_dominates(pairs in prop::collection::vec([0u8..6, 0u8..6], 0..24)) {
        let pairs: Vec<[f64; 2]> = pairs.iter().map(|p| p.map(f64::from)).collect();
        let beats = |a: &[f64; 2], b: &[f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
        let mut wanted: Vec<usize> =
            (0..pairs.len()).filter(|i| !pairs.iter().any(|other| beats(other, &pairs[*i]))).collect();
        wanted.sort_by(|a, b| pairs[*a][0].total_cmp(&pairs[*b][0]).then(a.cmp(b)));
        prop_assert_eq!(pareto_front(&pairs), wanted);
    }

    /// Against the definition: no measured combination that keeps the bound is better.
    #[test]
    fn a_choice_is_the_best_of_all_measured_combinations(
        measured in prop::collection::vec((1e-3f64..0.2, 2.0f64..40.0), 1..12),
        limit in 1e-3f64..0.3,
        time in 1e6f64..60e6,
    ) {
        let choices: Vec<_> = measured.iter().map(|(e, ms)| combination(&[], *e, *ms)).collect();
        let all = Report { choices, ..report(Vec::new()) };
        let of = |i: usize| (all.choices[i].errors.rmse, all.choices[i].times.expect("timed").total);
        match choose(&all, Measure::Rmse, Bound::Error(limit), &[]) {
            Ok(found) => {
                let (error, time) = of(found);
                prop_assert!(error <= limit);
                for (e, t) in (0..all.choices.len()).map(of).filter(|(e, _)| *e <= limit) {
                    prop_assert!(t.median >= time.median, "{e} in {t:?}");
                }
            }
            Err(_) => prop_assert!(measured.iter().all(|(e, _)| *e > limit)),
        }
        let fits = |i: usize| of(i).1.p95 * (1.0 + choose::TIME_MARGIN) <= time;
        match choose(&all, Measure::Rmse, Bound::Time(time), &[]) {
            Ok(found) => {
                let best = (0..all.choices.len()).filter(|i| fits(*i)).map(|i| of(i).0).fold(f64::MAX, f64::min);
                prop_assert!(fits(found) && of(found).0 == best);
            }
            Err(_) => prop_assert!(!(0..all.choices.len()).any(fits)),
        }
    }
}

#[test]
fn a_choice_is_made_among_what_was_measured() {
    let set = |bound, refused: &[usize]| {
        let found = choose(&small(), Measure::Rmse, bound, refused).expect("a choice");
        small().choices[found].set.join(" ")
    };
    // By the dials alone, 8 bits would take 8 ms with an error of 0.036; nobody measured it.
    assert_eq!(set(Bound::Error(0.04), &[]), "");
    assert_eq!(set(Bound::Error(0.12), &[]), "ray.step=1");
    assert_eq!(set(Bound::Error(0.02), &[]), "ray.step=0.25");
    assert_eq!(set(Bound::Error(0.02), &[4]), "ray.step=0.25 volume_format=r32f", "the other was refused");
    assert_eq!(set(Bound::Time(40e6), &[]), "ray.step=0.25 volume_format=r32f");
    // 17 ms fit into 21, but not with a margin of a quarter.
    assert_eq!(
        (set(Bound::Time(21e6), &[]), set(Bound::Time(22e6), &[])),
        (String::new(), "ray.step=0.25 volume_format=r8".into())
    );
    let mut coarse = small();
    coarse.choices.iter_mut().for_each(|c| c.reference_error.rmse = 0.015);
    let found = choose(&coarse, Measure::Rmse, Bound::Error(0.04), &[]).expect("a choice");
    assert_eq!(coarse.choices[found].set, ["ray.step=0.25"], "the reference's own error is added");
}

/// Prevents a choice by chance among times that three runs do not tell apart: those that may be the fastest are named, to be run more often.
#[test]
fn times_that_overlap_are_contenders_and_the_fastest_is_chosen() {
    let choices = vec![
        combination(&[], 0.01, 10.0),
        combination(&["x=0"], 0.02, 9.1),
        combination(&["y=0"], 0.02, 9.0),
        combination(&["z=0"], 0.6, 8.0),
    ];
    let noisy = Report { choices, ..report(Vec::new()) };
    let of = |refused: &[usize]| contenders(&noisy, Measure::Rmse, 0.5, refused);
    assert_eq!((of(&[]), of(&[2]), of(&[0, 1, 2])), (vec![2, 1], vec![1], vec![]));
    assert_eq!(choose(&noisy, Measure::Rmse, Bound::Error(0.5), &[]), Ok(2));
    assert_eq!(choose(&noisy, Measure::Rmse, Bound::Error(0.5), &[2]), Ok(1));
    let many = Report { choices: (0..20).map(|_| combination(&[], 0.01, 10.0)).collect(), ..report(Vec::new()) };
    assert_eq!(contenders(&many, Measure::Rmse, 0.5, &[]).len(), choose::MAX_CONTENDERS);
}

/// By hand: tone is left to the caller, so that these are shares and quantiles alone.
#[test]
fn levels_are_of_the_channel_that_differs_most_and_leave_pixels_out() {
    let level = 1.0 / 255.0;
    let a = texels(4, 3, &[0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.2, 0.2, 0.2, 0.9, 0.9, 0.9]);
    let mut b = a.clone();
    b.values[1] += 2.0 * level;
    b.values[2] -= 1.0 * level;
    b.values[3] += 0.5 * level;
    b.values[11] -= 20.0 * level;
    let all = levels(&b, &a, &[]).expect("comparable");
    assert!((all.max - 20.0).abs() < 1e-9 && (all.median - 1.25).abs() < 1e-9, "{all:?}");
    assert_eq!((all.over_1, all.over_8), (0.5, 0.25));
    let without = levels(&b, &a, &[false, false, false, true]).expect("comparable");
    assert!((without.max - 2.0).abs() < 1e-9 && without.over_8 == 0.0 && (without.over_1 - 1.0 / 3.0).abs() < 1e-12);
    assert_eq!(levels(&b, &a, &[true; 4]), Ok(Levels::default()));
}

/// Prevents a choice that is accurate where it finds the surface, and finds half of it: lost rays are in no RMSE.
#[test]
fn a_choice_that_loses_rays_is_none() {
    let lost = |share: f64| {
        let mut choice = combination(&["ray.step=9"], 1e-6, 0.1);
        let surface = surfaces(&texels(1, 1, &[1.0]), &texels(1, 1, &[1.0]), 1.0).expect("comparable");
        choice.errors.mm = Some(SurfaceError { missed_hits: share, ..surface });
        let choices = vec![combination(&[], 0.01, 10.0), choice];
        choose(&Report { choices, ..report(Vec::new()) }, Measure::Rmse, Bound::Error(0.5), &[])
    };
    assert_eq!((lost(0.0), lost(5e-4), lost(0.02)), (Ok(1), Ok(1), Ok(0)));
}

/// Prevents one ray that finds another surface from being most of an RMSE: it is counted, and its pixels are left out of the error of the picture.
#[test]
fn rays_that_jump_are_counted_and_left_out() {
    let a = texels(4, 1, &[10.0, 10.0, 10.0, MISS, 10.0, 10.0, 10.0, MISS]);
    let b = texels(4, 1, &[10.1, 10.0, 10.0, MISS, 10.0, 10.0, 10.0, 14.0]);
    let jumping = texels(4, 1, &[10.1, 10.0, 15.0, MISS, 10.0, 10.0, 10.0, 14.0]);
    let e = surfaces(&a, &jumping, 2.0).expect("comparable");
    assert_eq!((e.jumps, e.missed_hits, e.false_hits), (0.125, 0.125, 0.0));
    let spread = e.error.expect("five pixels");
    assert!(spread.count == 5 && (spread.max - 0.1).abs() < 1e-12, "{spread:?}");
    assert_eq!(surfaces(&a, &b, f64::INFINITY).expect("comparable").jumps, 0.0);
    // Pixel (3, 1) is gained: it and its neighbours are left out.
    assert_eq!(changed_rays(&a, &b, 2.0, [4, 2, 1]), [false, false, true, true, false, false, true, true]);
    // The same rays under a picture of twice the size.
    let large = changed_rays(&a, &b, 2.0, [8, 4, 1]);
    assert_eq!((large[3 * 8 + 7], large[3 * 8 + 6], large[0], large[3 * 8 + 4]), (true, true, false, false));
}

/// Prevents a budget that leaves out what it was measured with.
#[test]
fn the_error_budget_has_a_row_for_each_source_and_their_sum() {
    let text = export::summary_table(&small(), Measure::Rmse);
    let after = text.split("error budget").nth(1).expect("a budget");
    for part in ["step 0.5", "format r16f", "together", "itself off by about 1.0e-5", "RMSE 3.03e-2", "3.10e-2"] {
        assert!(after.contains(part), "{part} is not in {after}");
    }
    let mut broken = small();
    broken.budget.shares[0].errors.levels.p95 = f64::NAN;
    let said = broken.to_json().expect_err("NaN is no result");
    assert!(said.contains("budget, 'step'"), "{said}");
}

/// Prevents a line between the names of a dial, which have no order, and looks among errors.
#[test]
fn names_are_not_joined_and_looks_have_a_figure_of_their_own() {
    let mut shown = small();
    shown.choices.clear();
    let lines = |report: &Report| {
        let svg = plot::svg(report, Figure::Errors, Measure::Rmse, [1200, 800]).expect("a plot");
        svg.matches("<polyline").count()
    };
    let before = lines(&shown);
    shown.dials[0].is_ordered = false;
    assert!(lines(&shown) < before, "the line of the steps stays");
    assert!(!Figure::Looks.is_in(&shown) && Figure::Errors.is_in(&shown));
    shown.dials[1].kind = Kind::Look;
    assert!(Figure::Looks.is_in(&shown));
    let looks = plot::svg(&shown, Figure::Looks, Measure::Rmse, [1200, 800]).expect("a plot");
    let errors = plot::svg(&shown, Figure::Errors, Measure::Rmse, [1200, 800]).expect("a plot");
    // More names than a panel has room for are numbers in it, and a line below.
    let values: Vec<Point> = (0..17).map(|n| point(&format!("scheme {n}"), &[], f64::from(n), 0.01, 10.0)).collect();
    let many = Report { dials: vec![dial("perona-malik", "step", 0, values)], ..shown.clone() };
    let numbered = plot::svg(&many, Figure::Errors, Measure::Rmse, [1200, 800]).expect("a plot");
    assert!(numbered.contains("perona-malik 1: scheme 0, 2: scheme 1"), "the key");
    assert!(numbered.matches("scheme 7").count() == 1, "once, in the key");
    assert!(looks.contains("r16f") && !looks.contains(">step"), "looks alone");
    assert!(!errors.contains("r32f") && errors.contains("step"), "errors alone");
}

#[test]
fn proposals_are_combinations_of_numerical_dials_of_which_some_are_near_the_bound() {
    let small = small();
    let named = |all: Vec<Vec<(usize, usize)>>| -> Vec<String> {
        let label = |(d, p): &(usize, usize)| small.dials[*d].points[*p].set.join(" ");
        all.iter().map(|changes| changes.iter().map(label).collect::<Vec<_>>().join(" ")).collect()
    };
    let all = named(proposals(&small.dials, None, 24));
    assert!(all[0].is_empty(), "the first is the scene as it is: {all:?}");
    for wanted in
        ["ray.step=1 volume_format=r8", "ray.step=0.25 volume_format=r32f", "volume_format=r8", "ray.step=0.25"]
    {
        assert!(all.iter().any(|set| set == wanted), "{wanted} is not in {all:?}");
    }
    assert!(named(proposals(&small.dials, None, 3)).len() <= 3);
    let near = named(proposals(&small.dials, Some(Bound::Time(4e6)), 4));
    assert!(near.contains(&"ray.step=1 volume_format=r8".to_string()), "{near:?}");
    let mut looks = small.dials.clone();
    looks[0].kind = Kind::Pixels;
    assert!(proposals(&looks, None, 24).iter().flatten().all(|(d, _)| *d == 1));
    assert_eq!(proposals(&[], None, 24), [Vec::new()]);
}

#[test]
fn what_cannot_be_reached_names_the_nearest() {
    let said = choose(&small(), Measure::Rmse, Bound::Error(0.001), &[]).expect_err("nothing is that accurate");
    assert!(said.contains("ray.step=0.25 volume_format=r32f") && said.contains("7.500e-3"), "{said}");
    let said = choose(&small(), Measure::Rmse, Bound::Time(3e6), &[]).expect_err("nothing is that fast");
    let named = ["3.000 ms", "margin of 25 %", "ray.step=1 volume_format=r8", "4.500 ms"];
    assert!(named.iter().all(|n| said.contains(n)), "{said}");
    let said = choose(&small(), Measure::Mm, Bound::Error(1.0), &[]).expect_err("no distance was measured");
    assert!(said.contains("RMS error of distance"), "{said}");
    let mut untimed = small();
    untimed.dials.iter_mut().flat_map(|d| &mut d.points).for_each(|p| p.times = None);
    untimed.choices.iter_mut().for_each(|c| c.times = None);
    let said = choose(&untimed, Measure::Rmse, Bound::Error(0.1), &[]).expect_err("nothing was timed");
    assert!(said.contains("no time stamps"), "{said}");
    assert!(plot::svg(&untimed, Figure::Errors, Measure::Rmse, [1200, 800]).is_err());
}

#[test]
fn dials_of_one_setting_are_not_combined() {
    let sigma = vec![point("none", &[], 0.0, 0.05, 10.0), point("7", &["filter.sigma.window=7"], 7.0, 0.01, 12.0)];
    let median = vec![point("none", &[], 0.0, 0.04, 10.0), point("on", &["filter.sigma=off"], 1.0, 0.01, 11.0)];
    let other = vec![point("none", &[], 0.0, 0.03, 10.0), point("on", &["filter.sigmas=1"], 1.0, 0.0, 11.0)];
    let all = [dial("a", "", 0, sigma), dial("b", "", 0, median), dial("c", "", 0, other)];
    let proposed = proposals(&all, None, 24);
    assert!(proposed.contains(&vec![(0, 1), (2, 1)]), "{proposed:?}");
    assert!(proposed.iter().all(|c| !(c.contains(&(0, 1)) && c.contains(&(1, 1)))), "{proposed:?}");
}

/// Prevents an advice that replaces a filter which somebody chose, because another one looks less like the reference or is faster.
#[test]
fn another_look_is_no_error_and_is_never_proposed() {
    let mut looks = small();
    let mut other = dial(
        "sigma",
        "pixels",
        0,
        vec![point("as it is", &[], 0.0, 0.0, 10.0), point("none", &["slices.sigma=none"], 1.0, 0.001, 0.001)],
    );
    (other.reference, other.kind) = (Reference::AsItIs, Kind::Look);
    looks.dials.push(other);
    assert_eq!(proposals(&looks.dials, None, 24), proposals(&small().dials, None, 24));
    assert_eq!(looks.pareto_front(Measure::Rmse), small().pareto_front(Measure::Rmse));
    let said = export::summary_table(&looks, Measure::Rmse);
    assert!(said.contains("sigma, pixels: difference from the scene as it is; another look is no error"), "{said}");
    assert_eq!(Report::from_json(&looks.to_json().expect("finite")).expect("its own"), looks);
}

#[test]
fn a_report_survives_its_file_and_others_are_refused() {
    let mut whole = small();
    let pairs: Vec<[f64; 2]> = whole.dials[0].points.iter().map(|p| [p.value, p.errors.rmse]).collect();
    whole.dials[0].order = Some(fit(&pairs, Range { step: [0.25, 1.0], floor: 1e-5 }).expect("three points"));
    whole.dials[1].reference = Reference::Converged { set: vec!["ray.step=0.01".into()], rmse: 1.0 / 3.0 * 1e-4 };
    let surface = surfaces(&texels(2, 1, &[1.0, 2.0]), &texels(2, 1, &[1.1, 2.0]), f64::INFINITY).expect("comparable");
    whole.dials[0].points[0].errors.mm = Some(surface);
    whole.dials[0].points[2].times = None;
    let text = whole.to_json().expect("finite");
    assert_eq!(Report::from_json(&text).expect("its own"), whole);
    let newer = text.replace(Report::FORMAT, "echolume error report 4");
    let said = Report::from_json(&newer).expect_err("a newer version");
    assert!(said.contains("echolume error report 4") && said.contains(Report::FORMAT), "{said}");
    assert!(Report::from_json("{").is_err() && Report::from_json("{}").is_err());
    assert!(Report::from_json(&text.replace("\"repeats\"", "\"repeat\"")).is_err());
    whole.dials[0].points[1].errors.rmse = f64::NAN;
    let said = whole.to_json().expect_err("NaN is no result");
    assert!(said.contains("dial 'step', point '0.5'"), "{said}");
    let mut broken = small();
    broken.choices[1].reference_error.rmse = -1.0;
    let said = broken.to_json().expect_err("no error is below 0");
    assert!(said.contains("choice 'ray.step=1'"), "{said}");
}

#[test]
fn a_table_has_every_point_under_its_names() {
    let csv = export::csv(&small());
    // Quotes of fields as RFC 4180 has them.
    assert!(csv.contains("\"Device <1>, \"\"quoted\"\"\",driver & 2.0"), "{csv}");
    let plain = csv.replace("\"Device <1>, \"\"quoted\"\"\"", "Device");
    let rows: Vec<Vec<&str>> = plain.lines().map(|l| l.split(',').collect()).collect();
    assert!(rows.len() == 7 && rows.iter().all(|r| r.len() == rows[0].len()), "{plain}");
    let column = |name: &str| rows[0].iter().position(|n| *n == name).expect("a column");
    let cell = |row: usize, name: &str| rows[row][column(name)];
    assert_eq!(
        (cell(3, "dial"), cell(3, "unit"), cell(3, "value"), cell(3, "set")),
        ("step", "mm", "0.25", "ray.step=0.25")
    );
    assert_eq!((cell(3, "rmse"), cell(3, "time_ms"), cell(3, "default")), ("0.0075", "20", "false"));
    assert_eq!((cell(2, "default"), cell(1, "mm_rms"), cell(1, "repeats")), ("true", "", "9"));
    assert!(cell(3, "levels_p95").starts_with("3.82") && cell(3, "share_over_1_level") == "0.5");
    // A step of 1 is the fastest, 8 bits next; 16 bits beat the default step in error, 32 bits the finest step in both.
    let on_front: Vec<&str> = (1..7).map(|r| cell(r, "on_front")).collect();
    assert_eq!(on_front, ["true", "false", "false", "true", "true", "true"]);
    assert_eq!(small().pareto_front(Measure::Rmse), [(0, 0), (1, 0), (1, 1), (1, 2)]);
}

#[test]
fn times_are_a_median_a_range_and_a_percentile() {
    assert_eq!(Time::of(&[3.0, 1.0, 2.0, 9.0]), Some(Time { median: 2.5, low: 1.0, high: 9.0, p95: 9.0 }));
    assert_eq!(Time::of(&[5.0]), Some(Time { median: 5.0, low: 5.0, high: 5.0, p95: 5.0 }));
    let runs: Vec<f64> = (1..=40).map(f64::from).collect();
    // Conover, Practical Nonparametric Statistics: of 40 runs the 14th and the 27th, of 6 the first and the last, of 9 the second and the eighth.
    let interval = |n: usize| Time::of(&runs[..n]).map(|t| (t.low, t.high));
    assert_eq!([40, 9, 6, 5].map(interval), [Some((14.0, 27.0)), Some((2.0, 8.0)), Some((1.0, 6.0)), Some((1.0, 5.0))]);
    assert_eq!(Time::of(&runs).expect("runs").p95, 38.0);
    let both = Times::of(&[[1.0, 10.0], [3.0, 30.0], [2.0, 20.0]]).expect("runs");
    assert_eq!((both.volume.median, both.picture.high, both.total.low), (2.0, 30.0, 11.0));
    assert_eq!(Times::of(&[]), None);
    assert_eq!(Time::of(&[]), None);
}

/// Eleven dials as in a real measurement, all close to one default.
fn crowded() -> Report {
    let names = ["step", "compositing", "format", "filter3d", "termination", "sigma", "perona-malik", "adaptive"];
    let names = names.into_iter().chain(["resolution", "rays", "lut"]);
    let dials = names.enumerate().map(|(d, name)| {
        let points = (0..6).map(|p| {
            let (away, bias) = (p as f64 - 2.0, 1.0 + 0.37 * d as f64);
            let (error, ms) = (0.002 * bias * 2.5f64.powf(-away), 14.0 * 1.45f64.powf(away * (0.3 + 0.07 * d as f64)));
            let label = format!("{}", 0.5f64.powi(p));
            point(&label, &[&format!("{name}={label}")], 0.5f64.powi(p), error, ms)
        });
        let mut dial = dial(name, if d % 3 == 0 { "mm" } else { "" }, 2, points.collect());
        let pairs: Vec<[f64; 2]> = dial.points.iter().map(|p| [p.value, p.errors.rmse]).collect();
        dial.order = (d < 2).then(|| fit(&pairs, Range { step: [0.0, 1.0], floor: 0.0 }).expect("six points"));
        dial
    });
    let mut all = Report { choices: small().choices, ..report(dials.collect()) };
    all.dials[2].points[5].errors.rmse = 0.0;
    all.dials[3].reference = Reference::Converged { set: vec!["a=1".into()], rmse: 3.2e-5 };
    all
}

#[test]
fn plots_show_every_dial_with_its_text() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (name, shown) in [("small", small()), ("crowded", crowded())] {
        let [width, height] = plot::size(&shown, Figure::Errors);
        let svg = plot::svg(&shown, Figure::Errors, Measure::Rmse, [width, height]).expect("a plot");
        std::fs::write(folder.join(format!("{name}.svg")), &svg).expect("write the plot");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{}", &svg[..80]);
        assert!(svg.contains("&lt;1&gt;") && svg.contains("driver &amp; 2.0"), "names are escaped");
        for word in shown.dials.iter().map(|d| d.name.as_str()).chain(["Pareto front", "boxed: the scene as it is"]) {
            assert!(svg.contains(word), "{name}: '{word}' is not there");
        }
        // Every point of every dial has its name.
        for label in shown.dials.iter().flat_map(|d| &d.points).map(|p| &p.label) {
            assert!(
                svg.contains(&format!(">\n{label}\n<")) || svg.contains(&format!(">{label}<")),
                "{name}: '{label}'"
            );
        }
        assert!(svg.contains("0 (exact)"));
        let picture = plot::picture(&shown, Figure::Errors, Measure::Rmse, [width, height]).expect("a plot");
        assert_eq!((picture.width, picture.height), (width, height));
        assert_eq!(picture.rgba.len(), 4 * width as usize * height as usize);
        picture.save(&folder.join(format!("{name}.png"))).expect("save the plot");
        // The title's letters cover some, and not most, of their line.
        let dark = |x: usize, y: usize| picture.rgba[4 * (width as usize * y + x)] < 128;
        let inked = (24..260).flat_map(|x| (14..40).map(move |y| (x, y))).filter(|(x, y)| dark(*x, *y)).count();
        assert!((400..3000).contains(&inked), "{name}: {inked} dark pixels where the title is");
    }
    assert!(plot::svg(&small(), Figure::Errors, Measure::Degrees, [1200, 800]).is_err(), "no normals were measured");
    let said = plot::svg(&small(), Figure::Errors, Measure::Rmse, [100, 100]).expect_err("too small to read");
    assert!(said.contains("100x100") && said.contains("640x400"), "{said}");
}
