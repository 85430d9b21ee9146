//! Runs compared with earlier ones.

use super::profile;
use super::profile::Random;
use super::simulated::{any_run, check, fail, outcome, run, slower};
use echolume::low_level::baselines::Threshold;
use echolume::low_level::verify::report::baseline::{BaselineComparison, Class, compare};
use echolume::low_level::verify::report::{self, Figure, Level, Run, Unit, Verdict};
use proptest::prelude::*;
use std::time::Duration;

fn compared(old: &Run, new: &Run) -> BaselineComparison {
    compare(old, new, Threshold::default())
}

/// Class and text of every change.
fn told(compared: &BaselineComparison) -> Vec<(Class, String)> {
    compared.changes.iter().map(|c| (c.class, c.to_string())).collect()
}

/// Two runs with the same errors and different times of the same distribution.
fn changed(change: impl Fn(&mut Run)) -> BaselineComparison {
    let old = run(1);
    let mut new = old.clone();
    change(&mut new);
    compared(&old, &new)
}

#[test]
fn a_run_compared_with_itself_reports_nothing() {
    let mut same = run(1);
    fail(&mut same, "passes", "shade");
    check(&mut same, "passes", "tone").figures[0].value = f64::NAN;
    let itself = compared(&same, &same);
    assert!(itself.lines().is_empty() && !itself.is_worse(), "{:?}", itself.lines());
    assert_eq!(itself.conclusion(), "nothing changed: 21 checks are as before; 1 failed before and fail still");
    assert_eq!(compared(&run(1), &run(1)).conclusion(), "nothing changed: 21 checks are as before");
}

#[test]
fn an_error_that_grew_is_reported_even_if_it_passes() {
    let grew = changed(|new| check(new, "passes", "raycast_volume").figures[0].value = 1.9);
    let line = "passes / raycast_volume: largest error 0.74 -> 1.9 levels, still under 2".to_string();
    assert_eq!(told(&grew), [(Class::Changed, line.clone())]);
    assert_eq!((grew.lines(), grew.is_worse(), grew.same), (vec![line], false, 20));
    let shrank = changed(|new| check(new, "passes", "raycast_volume").figures[0].value = 0.2);
    assert_eq!(told(&shrank)[0].0, Class::Better);
}

#[test]
fn errors_beyond_their_tolerance_or_not_finite_are_worse() {
    for (value, shown) in [(2.5, "2.5"), (f64::NAN, "NaN"), (f64::INFINITY, "infinity")] {
        let left = changed(|new| check(new, "passes", "median").figures[0].value = value);
        let line = format!("passes / median: largest error 0.8 -> {shown} levels, now over 2");
        assert_eq!(told(&left), [(Class::Worse, line)]);
        assert!(left.is_worse());
    }
}

#[test]
fn a_difference_of_a_rounding_is_none_and_a_single_pixel_is_one() {
    let rounding = changed(|new| {
        check(new, "passes", "median").figures[0].value *= 1.005;
        check(new, "passes", "median").figures[1].value += 1e-7;
    });
    assert_eq!(told(&rounding), []);
    let pixel = changed(|new| check(new, "modes", "mip").figures[1].value = 18.0);
    assert_eq!(told(&pixel), [(Class::Changed, "modes / mip: pixels that differ 17 -> 18".into())]);
}

#[test]
fn what_fails_now_is_worse_and_what_passes_now_is_better() {
    let failing = changed(|new| fail(new, "passes", "sigma"));
    let line = "passes / sigma: passed -> failed: the output differs by more than its tolerance";
    assert_eq!(told(&failing), [(Class::Worse, line.into())]);
    let old = failing.clone();
    assert!(old.is_worse());
    let mut broken = run(1);
    fail(&mut broken, "passes", "sigma");
    let mended = compared(&broken, &run(1));
    assert_eq!(told(&mended), [(Class::Better, "passes / sigma: failed -> passed".into())]);
    let left_out = changed(|new| {
        let check = check(new, "passes", "sigma");
        check.verdict = Verdict::LeftOut;
        check.notes.push("the driver no longer has it".into());
    });
    let line = "passes / sigma: passed -> left out: the driver no longer has it";
    assert_eq!(told(&left_out), [(Class::Changed, line.into())]);
}

#[test]
fn checks_and_figures_of_only_one_run_are_reported() {
    let differing = changed(|new| {
        new.outcomes.retain(|o| o.name != "shadow" || o.group != "passes");
        new.outcomes.push(outcome("passes", "glow", Verdict::Passed));
        new.outcomes.push(outcome("passes", "fog", Verdict::Failed));
        let tone = check(new, "passes", "tone");
        tone.figures[0].what = "error".into();
        tone.figures[1].unit = Unit::Millimetres;
        check(new, "passes", "median").figures[0].allowed = Some(3.0);
    });
    let expected = [
        (Class::Worse, "passes / fog: new, and fails"),
        (Class::Changed, "passes / tone: error: not measured before"),
        (Class::Changed, "passes / tone: largest error of floats: measured in another unit than before, not compared"),
        (Class::Changed, "passes / tone: largest error: measured before, and not now"),
        (Class::Changed, "passes / glow: new; passed"),
        (Class::Changed, "passes / shadow: missing; before it passed"),
        (Class::Changed, "passes / median: largest error: allowed 2 -> 3 levels"),
    ];
    assert_eq!(told(&differing), expected.map(|(class, line)| (class, line.to_string())));
}

#[test]
fn the_terminal_lists_every_worse_check_and_some_others() {
    let many = |value: f64| {
        let mut many = run(1);
        for i in 0..100 {
            let mut check = outcome("every input", &format!("input {i}"), Verdict::Passed);
            check.figures.push(Figure::error("largest error", value, 2.0, Unit::Levels));
            many.outcomes.push(check);
        }
        many
    };
    let text = report::comparison(&compared(&many(0.5), &many(1.0)));
    assert!(
        text.contains("input 39: ") && !text.contains("input 40: ") && text.contains("\n  and 60 more\n"),
        "{text}"
    );
    let text = report::comparison(&compared(&many(0.5), &many(3.0)));
    assert!(text.contains("input 99: ") && !text.contains(" more\n"), "{text}");
}

/// 5 % of 400 are 20.
#[test]
fn noise_is_rarely_called_a_change() {
    let alarm = |i: &u64| !compared(&run(2 * i + 100), &run(2 * i + 101)).changes.is_empty();
    let alarms = (0..400).filter(alarm).count();
    println!("{alarms} of 400");
    assert!(alarms <= 20, "{alarms} of 400");
}

#[test]
fn fourteen_percent_slower_is_worse_and_faster_is_better() {
    for i in 0..100 {
        let (old, mut new) = (run(2 * i + 1000), run(2 * i + 1001));
        slower(&mut new, "shade", 1.14);
        slower(&mut new, "tone", 1.0 / 1.2);
        let compared = compared(&old, &new);
        let classes: Vec<(Class, &str)> = compared.changes.iter().map(|c| (c.class, c.name.as_str())).collect();
        assert!(classes.contains(&(Class::Worse, "shade")), "{i}: {classes:?}");
        assert!(classes.contains(&(Class::Better, "tone")), "{i}: {classes:?}");
        assert!(compared.is_worse());
    }
    let steady = |factor: f64| {
        let mut run = run(7);
        let times = (0..30).map(|i| factor * (1e6 + 100.0 * f64::from(i % 7))).collect();
        check(&mut run, "speed", "shade").figures = vec![Figure::times("device time", times).expect("times")];
        run
    };
    let line = &told(&compared(&steady(1.0), &steady(1.14)))[0];
    assert_eq!(line.1, "speed / shade: device time 14 % slower (1.14..1.14), 1 -> 1.14 ms");
}

/// Prevents a shader that suddenly takes seconds to compile, and an alarm because another program ran meanwhile.
#[test]
fn a_pass_that_compiles_much_longer_is_worse_and_a_busy_machine_is_not() {
    let with = |ms: u64| {
        let mut run = run(1);
        let figure = Figure::single_time("time to compile", Duration::from_millis(ms));
        check(&mut run, "speed", "shade").figures.push(figure);
        run
    };
    for (old, new, expected) in [
        (100, 700, Some((Class::Worse, "speed / shade: time to compile 100 -> 700 ms: more than 3 times"))),
        (700, 100, Some((Class::Better, "speed / shade: time to compile 700 -> 100 ms: more than 3 times"))),
        (300, 880, None),
        (2, 90, None),
        (100, 100, None),
    ] {
        let compared = compared(&with(old), &with(new));
        let expected: Vec<_> = expected.into_iter().map(|(class, line)| (class, line.to_string())).collect();
        assert_eq!(told(&compared), expected, "{old} -> {new} ms");
    }
    // A baseline of an earlier version, and another device.
    assert!(compared(&run(1), &with(700)).changes.is_empty());
    let mut other = with(700);
    other.device.name = "another".into();
    let informative = compared(&with(100), &other);
    assert!(!informative.is_worse() && told(&informative).iter().any(|(_, line)| line.contains("100 -> 700")));
}

#[test]
fn slower_within_the_threshold_is_reported_and_fails_nothing() {
    let quiet = profile::Noise { spread: 0.002, ..profile::Noise::default() };
    let timed = |seed: u64, factor: f64| {
        let mut run = run(1);
        let times = profile::run(&mut Random(seed), 8, 30, quiet).passes;
        for (check, pass) in run.outcomes.iter_mut().filter(|o| o.group == "speed").zip(times) {
            let factor = if check.name == "shade" { factor } else { 1.0 };
            check.figures[0].samples = pass.samples_ns.iter().map(|ns| factor * ns).collect();
        }
        run
    };
    let (old, new) = (timed(1, 1.0), timed(2, 1.03));
    let small = compared(&old, &new);
    assert!(!small.is_worse() && small.changes.len() == 1, "{:?}", small.lines());
    assert!(small.lines()[0].starts_with("speed / shade: device time 3.0 % slower (1.0"), "{:?}", small.lines());
    assert!(small.lines()[0].ends_with(", within the threshold of 5 %"), "{:?}", small.lines());
    let strict = Threshold::new(1.01).expect("a ratio");
    assert!(compare(&old, &new, strict).is_worse());
}

#[test]
fn too_few_times_and_other_devices_are_not_compared_and_reported() {
    let mut few = run(1);
    few.outcomes.iter_mut().flat_map(|o| &mut o.figures).for_each(|f| f.samples.truncate(3));
    let compared_few = compared(&run(1), &few);
    assert!(!compared_few.is_worse() && compared_few.changes.is_empty(), "{:?}", compared_few.lines());
    let note = "8 times are not compared: the new run has 3 repeats; with fewer than 6 nothing can be told apart";
    assert_eq!(compared_few.notes, [note]);

    let elsewhere = changed(|new| {
        new.device.name = "another".into();
        new.device.driver = "none 2.0".into();
        slower(new, "shade", 3.0);
    });
    assert!(!elsewhere.is_worse());
    let lines = elsewhere.lines();
    assert_eq!(lines[..2], ["device: simulated -> another", "driver: none 1.0 -> none 2.0"]);
    assert!(lines[2].starts_with("speed / shade: device time 200 % slower (2."), "{lines:?}");
    assert_eq!(elsewhere.notes, ["the devices differ: times are reported, but fail nothing"]);
    let unwatched = changed(|new| (new.validation, new.device.clocks) = (false, None));
    assert_eq!(
        unwatched.lines(),
        ["clocks: graphics 1.5 GHz -> not known", "validation layer: watching -> not watching"]
    );
}

#[test]
fn other_levels_compare_what_both_have() {
    let other = changed(|new| {
        new.level = Level::Full;
        new.outcomes.retain(|o| o.group != "modes");
        new.outcomes.push(outcome("stress", "an hour", Verdict::Passed));
        check(new, "passes", "median").figures[0].value = 1.0;
    });
    assert_eq!(
        other.lines(),
        ["level: quick -> full", "passes / median: largest error 0.8 -> 1 levels, still under 2"]
    );
    let inputs = "the levels differ (quick -> full), and with them the inputs of passes: an error that is another may say nothing of \
                  the device";
    let checks = "checks that only the earlier run has, 4, and that only this one has, 1, are not compared";
    assert_eq!(other.notes, [inputs, checks]);
    let same = changed(|new| new.level = Level::Full);
    assert_eq!(same.notes, [inputs]);
}

#[test]
fn the_text_lists_the_worst_first() {
    let both = changed(|new| {
        new.device.driver = "none 1.1".into();
        check(new, "passes", "median").figures[0].value = 1.0;
        fail(new, "modes", "vr");
    });
    let text = report::comparison(&both);
    let expected = "compared with the run of 2026-01-02T03:04:05Z (echolume 0.1.0, release, quick) on simulated, none 1.0\n\
        driver: none 1.0 -> none 1.1\n\
        worse:\n  modes / vr: passed -> failed: the output differs by more than its tolerance\n\
        changed:\n  passes / median: largest error 0.8 -> 1 levels, still under 2\n\
        nothing else changed: 19 checks are as before\n";
    assert_eq!(text, expected);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_two_runs_compare_in_lines_and_none_differs_from_itself(old in any_run(), new in any_run()) {
        let compared = compare(&old, &new, Threshold::default());
        prop_assert!(compared.lines().iter().all(|line| !line.chars().any(char::is_control)));
        let itself = compare(&new, &new, Threshold::default());
        prop_assert!(itself.lines().is_empty(), "{:?}", itself.lines());
    }
}
