//! Text for the terminal, and the numbers in it.

use super::simulated::{any_run, check, empty, fail, outcome, run};
use echolume::low_level::text::escaped;
use echolume::low_level::verify::report::{
    self, Figure, Outcome, Unit, Verdict, amount, change, expected_and_got, number, percent, seconds, value_of_limit,
};
use proptest::prelude::*;

#[test]
fn a_failure_is_reported_in_full() {
    let mut run = run(1);
    fail(&mut run, "passes", "shade");
    let shade = check(&mut run, "passes", "shade");
    shade.figures[0].value = 2.0004;
    shade.notes.push("without validation".into());
    let expected = "passes / shade: failed
  the output differs by more than its tolerance
    pass: raycast_volume
    input: a sphere in 64 x 64 x 32, mode vr
    worst pixel: at (12, 34, 0) of picture, channel 2
    expected: 0.5
    got: NaN
    beyond tolerance: 17 of 4096 values (0.415 %)
    files: fail/actual.png, fail/expected.png, fail/difference.png
  largest error: 2.0004 of 2 levels
  without validation
";
    assert_eq!(report::failure(shade), expected);
}

#[test]
fn a_group_and_a_run_have_one_line_each() {
    let mut run = run(1);
    fail(&mut run, "passes", "tone");
    let groups = run.groups();
    assert_eq!(groups.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["passes", "modes", "formats", "speed"]);
    let line = |at: usize| report::group_line(groups[at].0, &groups[at].1);
    assert_eq!(
        line(0),
        "passes             7 passed, 1 failed in 2.0 s; nearest to its tolerance: raycast_surface, 81 %"
    );
    assert_eq!(line(2), "formats            1 left out in 250 ms");
    assert_eq!(report::group_line("none", &[]), "none               no checks in 0 s");
    let expected = "passed 19, failed 1, left out 1 in 48 s on simulated, none 1.0, Vulkan 1.3.0 (quick, validation layer \
                    watching)";
    assert_eq!(report::summary(&run), expected);
    run.validation = false;
    assert!(report::summary(&run).ends_with("Vulkan 1.3.0 (quick)"));
    run.outcomes[3].verdict = Verdict::Interrupted;
    assert!(report::summary(&run).starts_with("passed 18, failed 1, left out 1, interrupted 1 in 48 s"));
    assert!(report::group_line("passes", &run.groups()[0].1).contains("6 passed, 1 failed, 1 interrupted in "));
    assert!(report::summary(&empty()).starts_with("passed 0, failed 0, left out 0 in 48 s"));
}

#[test]
fn numbers_have_as_many_digits_as_a_reader_can_use() {
    let told = [0.0, 1.0, 0.80001, 17.0, 1234.4, 999_999.0, 1e6, 0.00123, 1.234e-7, -2.5, f64::NAN, f64::NEG_INFINITY];
    let expected = ["0", "1", "0.8", "17", "1234", "999999", "1e6", "0.00123", "1.23e-7", "-2.5", "NaN", "-infinity"];
    assert_eq!(told.map(number), expected);
    let amounts = [
        (1.0, Unit::Levels, "1 level"),
        (1.5, Unit::Levels, "1.5 levels"),
        (0.02, Unit::Millimetres, "0.02 mm"),
        (1_234_567.0, Unit::Count, "1234567"),
        (0.125, Unit::Share, "12.5 %"),
        (999.0, Unit::Ns, "999 ns"),
        (1.2e4, Unit::Ns, "12 us"),
        (1.2345e7, Unit::Ns, "12.3 ms"),
        (2e9, Unit::Ns, "2 s"),
    ];
    for (value, unit, expected) in amounts {
        assert_eq!(amount(value, unit), expected);
    }
    assert_eq!(change(0.8, 1.9, Unit::Levels), "0.8 -> 1.9 levels");
    assert_eq!(change(1.2e6, 9e5, Unit::Ns), "1.2 -> 0.9 ms");
    let times = [0.0, 0.0001, 0.25, 3.2, 48.0, 119.9, 130.0, 7300.0].map(seconds);
    assert_eq!(times, ["0 s", "under 1 ms", "250 ms", "3.2 s", "48 s", "120 s", "2 min 10 s", "2 h 1 min"]);
}

#[test]
fn two_numbers_that_differ_look_different() {
    assert_eq!(change(0.8001, 0.8002, Unit::Value), "0.8001 -> 0.8002");
    assert_eq!(expected_and_got(0.5, 0.5 + f64::EPSILON), ["0.5", "0.5000000000000002"]);
    assert_eq!(expected_and_got(0.5, 0.5), ["0.5", "0.5"]);
    assert_eq!(value_of_limit(&Figure::error("", 2.0001, 2.0, Unit::Levels)), "2.0001 of 2 levels");
    assert_eq!(value_of_limit(&Figure::error("", 0.2, 1.0, Unit::Levels)), "0.2 of 1 level");
    assert_eq!(
        [0.0, 0.009, 0.999, 1.0, 1.0001, 2.5, f64::INFINITY].map(percent),
        ["0 %", "under 1 %", "99 %", "100 %", "101 %", "250 %", "over 9999 %"]
    );
}

#[test]
fn how_much_of_a_tolerance_is_used_is_known_of_any_figure() {
    let used = |value, allowed| Figure::error("", value, allowed, Unit::Levels).used();
    assert_eq!(used(0.5, 2.0), Some(0.25));
    assert_eq!(used(0.0, 0.0), Some(0.0), "exact, where exactness is asked for");
    assert_eq!(used(1.0, 0.0), Some(f64::INFINITY));
    assert_eq!(used(f64::NAN, 2.0), Some(f64::INFINITY));
    assert_eq!(used(f64::INFINITY, 2.0), Some(f64::INFINITY));
    assert_eq!(Figure { allowed: None, ..Figure::error("", 1.0, 1.0, Unit::Count) }.used(), None);
    let mut check = outcome("a", "b", Verdict::Passed);
    assert_eq!(check.tightest(), None);
    check.figures.extend([0.2, 0.7, 0.5].map(|v| Figure::error(v.to_string(), v, 1.0, Unit::Value)));
    assert_eq!(check.tightest().map(|f| f.what.as_str()), Some("0.7"));
}

#[test]
fn times_become_their_median() {
    let figure = Figure::times("device time", vec![3.0, 1.0, 2.0]).expect("times");
    assert_eq!((figure.value, figure.unit, figure.allowed), (2.0, Unit::Ns, None));
    assert!(Figure::times("device time", Vec::new()).is_err());
    assert!(Figure::times("device time", vec![f64::NAN]).is_err());
}

#[test]
fn no_text_controls_the_terminal() {
    assert_eq!(escaped("a\u{1b}[2J\n\u{202e}"), "a\\u{1b}[2J\\n\\u{202e}");
    assert_eq!(escaped("'quotes' and \"those\" \\ stay"), "'quotes' and \"those\" \\ stay");
    assert_eq!(escaped(&"x".repeat(5000)).len(), 604);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_run_is_reported_in_lines(run in any_run()) {
        let is_line = |text: &str| !text.chars().any(char::is_control);
        prop_assert!(is_line(&report::summary(&run)));
        for (group, outcomes) in run.groups() {
            prop_assert!(is_line(&report::group_line(group, &outcomes)));
        }
        for text in run.outcomes.iter().map(|o: &Outcome| report::failure(o)) {
            prop_assert!(text.ends_with('\n') && text.lines().all(is_line), "{text:?}");
        }
    }
}
