//! Error against run time without a device: the metrics, the Pareto front, the choice, the file, the plot.

use crate::common::files::data;
use echolume::error_report::choose::{cheapest_under, most_accurate_under};
use echolume::error_report::convergence::{Range, fit};
use echolume::error_report::metrics::{distances, normals, pictures};
use echolume::error_report::{
    Dial, Errors, FORMAT, Measure, Point, Reference, Report, Sizes, Time, export, pareto_front, plot,
};
use echolume::passes::{MISS, Texels};
use proptest::prelude::*;

fn texels(width: usize, channels: usize, values: &[f64]) -> Texels {
    let height = values.len() / channels / width;
    Texels { size: [width, height, 1], channels, values: values.to_vec() }
}

fn point(label: &str, set: &[&str], value: f64, rmse: f64, ms: f64) -> Point {
    let errors = Errors { rmse, max: 4.0 * rmse, psnr: None, ssim: None, mm: None, degrees: None };
    let time = Time { median: ms * 1e6, low: ms * 0.99e6, high: ms * 1.01e6 };
    let set = set.iter().map(|s| s.to_string()).collect();
    Point { label: label.into(), set, value, errors, time: Some(time), is_default: false }
}

fn dial(name: &str, unit: &str, default: usize, mut points: Vec<Point>) -> Dial {
    points[default].is_default = true;
    Dial { name: name.into(), unit: unit.into(), reference: Reference::F64, points, order: None, floor: None }
}

fn report(dials: Vec<Dial>) -> Report {
    Report {
        format: FORMAT.into(),
        device: "Device <1>, \"quoted\"".into(),
        driver: "driver & 2.0".into(),
        date: "2026-11-21T09:00:00Z".into(),
        scene: "sweep.mha".into(),
        sizes: Sizes { volume: [400, 128, 31], picture: [512, 512] },
        repeats: 9,
        dials,
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
    report(vec![dial("step", "mm", 1, steps), dial("format", "", 1, formats)])
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
    assert!(distances(&texels(1, 1, &[f64::INFINITY]), &texels(1, 1, &[1.0])).is_err());
}

#[test]
fn distances_are_compared_where_both_hit_and_misses_are_counted() {
    let a = texels(5, 1, &[10.0, 12.0, MISS, 7.0, MISS]);
    let b = texels(5, 1, &[10.5, 11.0, 3.0, MISS, MISS]);
    let e = distances(&a, &b).expect("comparable");
    assert_eq!((e.false_hits, e.missed_hits), (0.2, 0.2));
    let s = e.error.expect("two pixels hit in both");
    assert_eq!((s.count, s.median, s.max), (2, 0.75, 1.0));
    assert!((s.rms - (1.25f64 / 2.0).sqrt()).abs() < 1e-15 && (s.p95 - 0.975).abs() < 1e-12, "{s:?}");
    let none = distances(&texels(1, 1, &[MISS]), &texels(1, 1, &[2.0])).expect("comparable");
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

    /// Against every combination: no cheaper one is as accurate, no more accurate one as fast.
    #[test]
    fn a_choice_is_the_best_of_all_combinations(
        points in prop::collection::vec(prop::collection::vec((1e-3f64..0.2, 2.0f64..40.0), 1..5), 1..4),
        limit in 1e-3f64..0.3,
    ) {
        let dials: Vec<Dial> = points.iter().enumerate().map(|(d, points)| {
            let key = |p: usize| format!("dial{d}.key={p}");
            let made = points.iter().enumerate().map(|(p, (e, ms))| {
                // Every default took 10 ms, and no two times lie within their spread of each other.
                let mut made = point("", &[&key(p)], p as f64, *e, if p == 0 { 10.0 } else { *ms });
                made.time = made.time.map(|t| Time { low: t.median, high: t.median, ..t });
                made
            });
            dial("", "", 0, made.collect())
        }).collect();
        let mut all = vec![(0.0, 10.0)];
        for d in &dials {
            let of = |p: &Point| (p.errors.rmse.powi(2), p.time.map_or(0.0, |t| t.median * 1e-7));
            all = all.iter().flat_map(|(e, t)| d.points.iter().map(of).map(move |(pe, pt)| (e + pe, t * pt))).collect();
        }
        let report = report(dials);
        let fastest = all.iter().filter(|(e, _)| e.sqrt() <= limit).map(|c| c.1).fold(f64::MAX, f64::min);
        match cheapest_under(&report, Measure::Rmse, limit, 0.0) {
            Ok(choice) => {
                prop_assert!(choice.error <= limit);
                prop_assert!((choice.time * 1e-6 / fastest - 1.0).abs() < 1e-3, "{:?}, {fastest}", choice);
            }
            Err(_) => prop_assert_eq!(fastest, f64::MAX),
        }
        // As much time as a choice took gives no worse picture.
        let time = fastest.min(1e3) * 1e6 * 1.001;
        if let Ok(choice) = most_accurate_under(&report, Measure::Rmse, time, 0.0) {
            let best = all.iter().filter(|(_, t)| t * 1e6 <= time * 0.999).map(|c| c.0.sqrt()).fold(f64::MAX, f64::min);
            prop_assert!(choice.time <= time && choice.error <= best * (1.0 + 1e-9), "{:?}, {best}", choice);
        }
    }
}

#[test]
fn dials_are_combined_by_squares_and_factors() {
    let cheap = cheapest_under(&small(), Measure::Rmse, 0.04, 0.0).expect("the default is good enough");
    assert_eq!(cheap.set, ["volume_format=r8"]);
    assert_eq!(cheap.changed, [("format".to_string(), "r8".to_string())]);
    assert!((cheap.error - 0.03f64.hypot(0.02)).abs() < 1e-12 && (cheap.time - 8e6).abs() < 1e-3, "{cheap:?}");
    // A margin of 15 % excludes that.
    let safe = cheapest_under(&small(), Measure::Rmse, 0.04, 0.15).expect("the default is");
    assert!(safe.set.is_empty() && (safe.error - 0.03f64.hypot(0.004)).abs() < 1e-12, "{safe:?}");
    let both = most_accurate_under(&small(), Measure::Rmse, 40e6, 0.0).expect("all fits");
    assert_eq!(both.set, ["ray.step=0.25", "volume_format=r32f"]);
    assert!((both.error - 0.0075).abs() < 1e-12 && (both.time - 30e6).abs() < 1e-3, "{both:?}");
    let held = most_accurate_under(&small(), Measure::Rmse, 16e6, 0.0).expect("something fits");
    assert_eq!(held.set, ["ray.step=0.25", "volume_format=r8"]);
}

#[test]
fn what_cannot_be_reached_names_the_nearest() {
    let said = cheapest_under(&small(), Measure::Rmse, 0.001, 0.0).expect_err("nothing is that accurate");
    assert!(said.contains("ray.step=0.25 volume_format=r32f") && said.contains("7.500e-3"), "{said}");
    let said = most_accurate_under(&small(), Measure::Rmse, 3e6, 0.1).expect_err("nothing is that fast");
    let named = ["3.000 ms", "margin of 10 %", "ray.step=1 volume_format=r8", "4.000 ms"];
    assert!(named.iter().all(|n| said.contains(n)), "{said}");
    assert!(cheapest_under(&small(), Measure::Mm, 1.0, 0.0).is_err(), "no distance was measured");
    let mut untimed = small();
    untimed.dials.iter_mut().flat_map(|d| &mut d.points).for_each(|p| p.time = None);
    let said = cheapest_under(&untimed, Measure::Rmse, 0.1, 0.0).expect_err("nothing was timed");
    assert!(said.contains("no time stamps"), "{said}");
    assert!(plot::svg(&untimed, Measure::Rmse, [1200, 800]).is_err());
}

#[test]
fn dials_of_one_setting_are_not_combined() {
    let sigma = vec![point("none", &[], 0.0, 0.05, 10.0), point("7", &["filter.sigma.window=7"], 7.0, 0.01, 12.0)];
    let median = vec![point("none", &[], 0.0, 0.04, 10.0), point("on", &["filter.sigma=off"], 1.0, 0.01, 11.0)];
    let other = vec![point("none", &[], 0.0, 0.03, 10.0), point("on", &["filter.sigmas=1"], 1.0, 0.0, 11.0)];
    let all = report(vec![dial("a", "", 0, sigma), dial("b", "", 0, median), dial("c", "", 0, other)]);
    let best = most_accurate_under(&all, Measure::Rmse, 1e9, 0.0).expect("time enough");
    assert_eq!(best.set, ["filter.sigma.window=7", "filter.sigmas=1"]);
    assert!((best.error - 0.04f64.hypot(0.01)).abs() < 1e-12, "{best:?}");
}

/// Prevents an advice that replaces a filter which somebody chose, because another one looks less like the reference or is faster.
#[test]
fn another_look_is_no_error_and_is_never_chosen() {
    let mut looks = small();
    let mut other = dial(
        "sigma",
        "pixels",
        0,
        vec![point("as it is", &[], 0.0, 0.0, 10.0), point("none", &["slices.sigma=none"], 1.0, 0.001, 0.001)],
    );
    other.reference = Reference::AsItIs;
    looks.dials.push(other);
    for (choice, without) in [
        (cheapest_under(&looks, Measure::Rmse, 0.5, 0.0), cheapest_under(&small(), Measure::Rmse, 0.5, 0.0)),
        (most_accurate_under(&looks, Measure::Rmse, 1e9, 0.0), most_accurate_under(&small(), Measure::Rmse, 1e9, 0.0)),
    ] {
        assert_eq!(choice, without);
    }
    assert_eq!(looks.pareto_front(Measure::Rmse), small().pareto_front(Measure::Rmse));
    let said = export::summary_table(&looks, Measure::Rmse);
    assert!(said.contains("sigma, pixels: difference from the scene as it is; another look is no error"), "{said}");
    assert_eq!(Report::from_json(&looks.to_json().expect("finite")).expect("its own"), looks);
}

#[test]
fn a_gain_within_the_spread_is_none_and_a_dial_without_default_is_left_out() {
    let noisy = vec![point("on", &[], 1.0, 0.01, 10.0), point("off", &["x=0"], 0.0, 0.02, 9.9)];
    let mut lost = dial("lost", "", 0, vec![point("a", &["y=1"], 0.0, 0.01, 1.0)]);
    lost.points[0].is_default = false;
    let all = report(vec![dial("noisy", "", 0, noisy), lost]);
    let choice = cheapest_under(&all, Measure::Rmse, 0.5, 0.0).expect("the default");
    assert!(choice.set.is_empty() && choice.left_out == ["lost"], "{choice:?}");
    assert_eq!(choice.time, 10e6);
}

#[test]
fn a_report_survives_its_file_and_others_are_refused() {
    let mut whole = small();
    let pairs: Vec<[f64; 2]> = whole.dials[0].points.iter().map(|p| [p.value, p.errors.rmse]).collect();
    whole.dials[0].order = Some(fit(&pairs, Range { step: [0.25, 1.0], floor: 1e-5 }).expect("three points"));
    whole.dials[1].reference = Reference::Converged { set: vec!["ray.step=0.01".into()], rmse: 1.0 / 3.0 * 1e-4 };
    let surface = distances(&texels(2, 1, &[1.0, 2.0]), &texels(2, 1, &[1.1, 2.0])).expect("comparable");
    whole.dials[0].points[0].errors.mm = Some(surface);
    whole.dials[0].points[2].time = None;
    let text = whole.to_json().expect("finite");
    assert_eq!(Report::from_json(&text).expect("its own"), whole);
    let newer = text.replace(FORMAT, "echolume error report 2");
    let said = Report::from_json(&newer).expect_err("a newer version");
    assert!(said.contains("echolume error report 2") && said.contains(FORMAT), "{said}");
    assert!(Report::from_json("{").is_err() && Report::from_json("{}").is_err());
    assert!(Report::from_json(&text.replace("\"repeats\"", "\"repeat\"")).is_err());
    whole.dials[0].points[1].errors.rmse = f64::NAN;
    let said = whole.to_json().expect_err("NaN is no result");
    assert!(said.contains("dial 'step', point '0.5'"), "{said}");
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
    // A step of 1 is the fastest, 8 bits next; 16 bits beat the default step in error, 32 bits the finest step in both.
    let on_front: Vec<&str> = (1..7).map(|r| cell(r, "on_front")).collect();
    assert_eq!(on_front, ["true", "false", "false", "true", "true", "true"]);
    assert_eq!(small().pareto_front(Measure::Rmse), [(0, 0), (1, 0), (1, 1), (1, 2)]);
}

#[test]
fn times_are_a_median_and_a_range() {
    assert_eq!(Time::of(&[3.0, 1.0, 2.0, 9.0]), Some(Time { median: 2.5, low: 1.0, high: 9.0 }));
    assert_eq!(Time::of(&[5.0]), Some(Time { median: 5.0, low: 5.0, high: 5.0 }));
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
    let mut all = report(dials.collect());
    all.dials[2].points[5].errors.rmse = 0.0;
    all.dials[3].reference = Reference::Converged { set: vec!["a=1".into()], rmse: 3.2e-5 };
    all
}

#[test]
fn plots_show_every_dial_with_its_text() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (name, shown) in [("small", small()), ("crowded", crowded())] {
        let svg = plot::svg(&shown, Measure::Rmse, [1200, 800]).expect("a plot");
        std::fs::write(folder.join(format!("{name}.svg")), &svg).expect("write the plot");
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{}", &svg[..80]);
        assert!(svg.contains("&lt;1&gt;") && svg.contains("driver &amp; 2.0"), "names are escaped");
        for word in shown.dials.iter().map(|d| d.name.as_str()).chain(["Pareto front", "default", "0 (exact)"]) {
            assert!(svg.contains(word), "{name}: '{word}' is not there");
        }
        let picture = plot::picture(&shown, Measure::Rmse, [1200, 800]).expect("a plot");
        assert_eq!((picture.width, picture.height, picture.rgba.len()), (1200, 800, 4 * 1200 * 800));
        picture.save(&folder.join(format!("{name}.png"))).expect("save the plot");
        // The title's letters cover some, and not most, of their line.
        let dark = |x: usize, y: usize| picture.rgba[4 * (1200 * y + x)] < 128;
        let inked = (24..260).flat_map(|x| (14..40).map(move |y| (x, y))).filter(|(x, y)| dark(*x, *y)).count();
        assert!((400..3000).contains(&inked), "{name}: {inked} dark pixels where the title is");
    }
    assert!(plot::svg(&small(), Measure::Degrees, [1200, 800]).is_err(), "no normals were measured");
    let said = plot::svg(&small(), Measure::Rmse, [100, 100]).expect_err("too small to read");
    assert!(said.contains("100x100") && said.contains("640x400"), "{said}");
}
