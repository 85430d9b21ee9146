//! Convergence orders of the compositing rules in f64, and what degrades them.

use crate::common::figures::figure;
use crate::compositing_problem::{Field, Flaw, NONE, errors, steps, stiffness};
use echolume::low_level::error_report::convergence::{Fit, Range, fit};
use echolume::low_level::passes::raycast::composite::Rule;

const STEPS: [f64; 2] = [1.0 / 32.0, 0.7];
const RAYS: usize = 256;
/// How far an order may deviate from theory.
const WITHIN: f64 = 0.2;

struct Found {
    fit: Fit,
    /// Error at the finest step.
    finest: f64,
}

fn found(rule: Rule, field: Field, flaw: Flaw) -> Found {
    let (pairs, own) = errors(rule, field, flaw, &steps(STEPS[0], STEPS[1], 10), RAYS);
    // The reference must be more accurate than what it is compared with.
    assert!(own < 1e-3 * pairs[0][1], "the truth is only good to {own:.1e}, the finest step to {:.1e}", pairs[0][1]);
    let fit = fit(&pairs, Range { step: STEPS, floor: own }).expect("ten steps");
    assert_eq!(fit.points, 10);
    Found { fit, finest: pairs[0][1] }
}

fn is_order(fit: &Fit, order: f64) -> bool {
    (fit.order - order).abs() < WITHIN
}

#[test]
fn every_rule_has_its_order() {
    let orders = [
        (Rule::Riemann, 1.0, "order-riemann"),
        (Rule::CorrectedLeft, 1.0, "order-left"),
        (Rule::Corrected, 2.0, "order-midpoint"),
        (Rule::PreIntegrated, 2.0, "order-pre-integrated"),
        (Rule::Exponential, 2.0, "order-exponential"),
        (Rule::PreIntegratedUnshaded, 1.0, "order-unshaded"),
    ];
    for (rule, order, name) in orders {
        let Found { fit, .. } = found(rule, Field::Open, NONE);
        assert!(is_order(&fit, order), "{rule:?}: order {:.3}, expected {order}", fit.order);
        assert!(fit.standard_error < 0.02, "{rule:?}: the points lie on no line: +-{:.3}", fit.standard_error);
        figure(name, &format!("{:.2}", fit.order));
    }
}

/// The table of docs/numerics.md: run with --nocapture.
#[test]
fn the_order_of_a_rule_falls_where_a_step_is_opaque() {
    let depths = [1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0];
    let curve = |rule: Rule| {
        let points = stiffness(rule, 0.5, &depths, 64);
        let shown: Vec<String> = points.iter().map(|p| format!("{:.2} ({:.1e})", p.order, p.error)).collect();
        println!("| {rule:?} | {} |", shown.join(" | "));
        points
    };
    println!("| kappa h | {} |", depths.map(|d| d.to_string()).join(" | "));
    let riemann = curve(Rule::Riemann);
    let midpoint = curve(Rule::Corrected);
    let mean = curve(Rule::PreIntegrated);
    let own = curve(Rule::Exponential);
    // Thin steps: what theory says of each rule.
    for (points, order) in [(&midpoint, 2.0), (&mean, 2.0), (&own, 2.0)] {
        assert!((points[0].order - order).abs() < WITHIN && (points[2].order - order).abs() < WITHIN, "{points:?}");
    }
    assert!((riemann[2].order - 1.0).abs() < WITHIN && riemann[2].error > 10.0 * midpoint[2].error, "{riemann:?}");
    // Opaque steps: a colour from the middle of the first step is wrong by the step, to first order; light from the face is not.
    for points in [&midpoint, &mean] {
        assert!((points[8].order - 1.0).abs() < WITHIN, "{points:?}");
    }
    for (own, other) in own.iter().zip(&midpoint).skip(6) {
        assert!(own.error < 0.1 * other.error, "{own:?}, {other:?}");
    }
}

/// Why the test field must not vanish smoothly at its ends: a rule of order 1 would seem to be of order 2.
#[test]
fn left_samples_look_second_order_where_the_field_vanishes_at_both_ends() {
    assert!(is_order(&found(Rule::CorrectedLeft, Field::Vanishing, NONE).fit, 2.0));
    assert!(is_order(&found(Rule::CorrectedLeft, Field::Open, NONE).fit, 1.0));
}

#[test]
fn a_dropped_last_step_spoils_order_2() {
    for rule in [Rule::Corrected, Rule::PreIntegrated, Rule::Exponential] {
        let dropped = found(rule, Field::Open, Flaw { drops_last_step: true, ..NONE });
        assert!(is_order(&dropped.fit, 1.0), "{rule:?}: order {:.3}", dropped.fit.order);
    }
}

/// Filter weights rounded to 1/256 voxel give an error floor near 2e-6; above it, where a fit must stay, the order
/// does not change.
#[test]
fn filter_weights_of_8_bits_spoil_order_2_down_at_their_floor() {
    for rule in [Rule::Corrected, Rule::PreIntegrated] {
        let flaw = Flaw { weight_bits: Some(8), ..NONE };
        let (exact, rounded) = (found(rule, Field::Open, NONE), found(rule, Field::Open, flaw));
        assert!(rounded.fit.order < 2.0 - WITHIN, "{rule:?}: order {:.3}", rounded.fit.order);
        assert!(rounded.finest > 3.0 * exact.finest, "{rule:?}: {:.1e}", rounded.finest);
        let (pairs, _) = errors(rule, Field::Open, flaw, &steps(STEPS[0], STEPS[1], 10), RAYS);
        let above = fit(&pairs, Range { step: STEPS, floor: 2.0 * rounded.finest }).expect("steps above the floor");
        assert!(above.points < 10 && is_order(&above, 2.0), "{rule:?}: order {:.3} of {}", above.order, above.points);
    }
}

/// The experiment can fail: an absorption that is wrong by 1 % removes the order of 2 and makes the error a thousand times larger.
#[test]
fn a_rule_that_is_one_percent_off_is_noticed() {
    for rule in [Rule::Riemann, Rule::CorrectedLeft, Rule::Corrected, Rule::PreIntegrated] {
        let (right, wrong) =
            (found(rule, Field::Open, NONE), found(rule, Field::Open, Flaw { absorption: 1.01, ..NONE }));
        assert!(wrong.fit.order < right.fit.order - WITHIN, "{rule:?}: order {:.3}", wrong.fit.order);
        assert!(wrong.finest > 2.0 * right.finest, "{rule:?}: {:.1e} and {:.1e}", wrong.finest, right.finest);
    }
    let wrong = found(Rule::Corrected, Field::Open, Flaw { absorption: 1.01, ..NONE });
    assert!(wrong.finest > 1000.0 * found(Rule::Corrected, Field::Open, NONE).finest, "{:.1e}", wrong.finest);
}

#[test]
fn a_fit_finds_the_line_and_says_how_well() {
    let line: Vec<[f64; 2]> = steps(0.1, 10.0, 7).iter().map(|h| [*h, 3.0 * h.powf(1.5)]).collect();
    let range = Range { step: [0.1, 10.0], floor: 0.0 };
    let exact = fit(&line, range).expect("seven points");
    assert!((exact.order - 1.5).abs() < 1e-12 && (exact.coefficient - 3.0).abs() < 1e-12, "{exact:?}");
    assert!(exact.standard_error < 1e-12 && (exact.at(4.0) - 24.0).abs() < 1e-9, "{exact:?}");
    // By hand: logarithms (0, 0), (1, 1), (2, 3): slope 3/2, residuals 1/6 -1/3 1/6, so sqrt((1/6) / 1 / 2).
    let e = std::f64::consts::E;
    let bent = fit(&[[1.0, 1.0], [e, e], [e * e, e.powi(3)]], Range { step: [0.5, 10.0], floor: 0.0 }).expect("three");
    assert!((bent.order - 1.5).abs() < 1e-12, "{bent:?}");
    assert!((bent.standard_error - (1.0f64 / 12.0).sqrt()).abs() < 1e-12, "{bent:?}");
}

#[test]
fn a_fit_leaves_out_what_is_out_of_range_and_refuses_too_few() {
    let mut line: Vec<[f64; 2]> = steps(0.1, 10.0, 7).iter().map(|h| [*h, h * h]).collect();
    line.extend([[0.01, 0.5], [20.0, 1e-9], [1.0, 0.0], [2.0, f64::NAN]]);
    let kept = fit(&line, Range { step: [0.1, 10.0], floor: 0.0 }).expect("seven points");
    assert!((kept.order - 2.0).abs() < 1e-12 && kept.points == 7, "{kept:?}");
    let floored = fit(&line, Range { step: [0.1, 10.0], floor: 0.3 }).expect("the upper points");
    assert!(floored.points == 4, "{floored:?}");
    let refused = fit(&line, Range { step: [0.1, 0.3], floor: 0.0 }).expect_err("two points are too few");
    assert!(refused.contains("2 steps in 0.1..=0.3"), "{refused}");
    // Three points at two steps make no line either.
    assert!(fit(&[[1.0, 1.0], [1.0, 2.0], [2.0, 4.0]], Range { step: [0.5, 3.0], floor: 0.0 }).is_err());
}
