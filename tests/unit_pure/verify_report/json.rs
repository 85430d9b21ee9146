//! Runs as JSON.

use super::simulated::{any_run, check, empty, fail, run};
use echolume::low_level::baselines::Stored;
use echolume::low_level::verify::report::{Figure, Run, Unit};
use echolume::low_level::verify::report::{MAX_OUTCOMES, MAX_SAMPLES};
use proptest::prelude::*;

/// Non-finite numbers make runs unequal to themselves: they are compared by their text.
fn comes_back(run: &Run) {
    let text = run.to_json().expect("JSON");
    let again = Run::from_json(&text).expect("run");
    assert_eq!(again.to_json().expect("JSON"), text);
    assert_eq!(format!("{again:?}"), format!("{run:?}"));
}

#[test]
fn a_run_round_trips_without_a_change() {
    let whole = run(1);
    assert_eq!(Run::from_json(&whole.to_json().expect("JSON")).expect("run"), whole);
    comes_back(&whole);
    comes_back(&empty());
}

#[test]
fn non_finite_findings_are_kept() {
    for (value, word) in [(f64::NAN, "NaN"), (f64::INFINITY, "Infinity"), (f64::NEG_INFINITY, "-Infinity")] {
        let mut run = run(2);
        fail(&mut run, "passes", "shade");
        let shade = check(&mut run, "passes", "shade");
        shade.pictures.clear();
        let worst = shade.faults[0].worst.as_mut().expect("worst");
        (worst.got, worst.expected) = (value, -0.0);
        shade.figures[0].value = value;
        let text = run.to_json().expect("JSON");
        assert!(text.contains(&format!("\"got\": \"{word}\"")) && !text.contains("null"), "{text}");
        comes_back(&run);
    }
}

#[test]
fn pictures_are_not_written() {
    let mut run = run(3);
    fail(&mut run, "passes", "shade");
    let again = Run::from_json(&run.to_json().expect("JSON")).expect("run");
    assert!(again.outcomes.iter().all(|o| o.pictures.is_empty()));
}

#[test]
fn other_versions_other_files_and_contradictions_are_refused_in_one_line() {
    let good = run(4).to_json().expect("JSON");
    let error = |text: &str| {
        let line = Run::from_json(text).expect_err("refused").to_string();
        assert!(!line.chars().any(char::is_control) && line.len() < 1000, "{line:?}");
        line
    };
    let other = good.replace("echolume-verify-1", "echolume-verify-9");
    assert_eq!(
        error(&other),
        "format is 'echolume-verify-9', this program reads 'echolume-verify-1'; verify again with it"
    );
    for text in [
        "",
        "[]",
        "{}",
        "{\"format\": 3}",
        "nonsense",
        &good[..good.len() / 2],
        &good.replace("\"seconds\"", "\"sec\\nonds\""),
        &good.replace("\"passed\"", "\"passed\\u001b[2J\""),
        &good.replace("\"passed\"", "\"fine\""),
        &good.replace("\"value\": 17.0", "\"value\": null"),
        &good.replace("\"value\": 17.0", "\"value\": \"nan\""),
        &good.replace("\"value\": 17.0", "\"value\": 1e999"),
        &good.replace("\"allowed\": 3.0", "\"allowed\": \"NaN\""),
        &good.replace("\"levels\"", &format!("\"{}\"", "l".repeat(5000))),
    ] {
        assert_ne!(text, good);
        assert!(error(text).starts_with("not a verification: "), "{}", error(text));
    }
    assert!(error(&good.replace("\"value\": 17.0", "\"value\": null")).contains("expected a number, \"NaN\""));
    assert!(error(&format!("{{\"format\": \"{}\"}}", "\\n".repeat(5000))).starts_with("format is "));
}

#[test]
fn what_contradicts_itself_is_neither_read_nor_written() {
    let broken = |change: &dyn Fn(&mut Run)| {
        let mut run = run(5);
        change(&mut run);
        let line = run.to_json().expect_err("refused").to_string();
        assert_eq!(line.lines().count(), 1, "{line}");
        line
    };
    let speed =
        |change: &dyn Fn(&mut Figure)| broken(&|run: &mut Run| change(&mut check(run, "speed", "shade").figures[0]));
    let again = |run: &mut Run| run.outcomes.push(run.outcomes[3].clone());
    assert_eq!(broken(&again), "passes / raycast_volume: is there twice");
    assert_eq!(broken(&|r| r.seconds = f64::NAN), "seconds: NaN is not finite and at least 0");
    assert_eq!(broken(&|r| r.outcomes[1].seconds = -1.0), "passes / median: seconds: -1 is not finite and at least 0");
    assert_eq!(broken(&|r| r.outcomes[1].name.clear()), "outcome 1: has no group or no name");
    assert!(broken(&|r| r.device.timestamp_period_ns = f64::INFINITY).starts_with("timestamp_period_ns: inf"));
    assert!(
        broken(&|r| r.outcomes = vec![r.outcomes[0].clone(); MAX_OUTCOMES + 1]).starts_with("outcomes: are 100001")
    );
    let twice = |r: &mut Run| {
        let figure = Figure::error("largest error", 0.0, 1.0, Unit::Count);
        check(r, "passes", "tone").figures.push(figure);
    };
    assert_eq!(broken(&twice), "passes / tone: figure 'largest error' is there twice");
    assert!(speed(&|f| f.allowed = Some(f64::INFINITY)).starts_with("speed / shade: figure 'device time' allows inf"));
    assert!(speed(&|f| f.samples[7] = f64::NAN).contains("sample 7: NaN is not finite"));
    assert!(speed(&|f| f.samples = vec![1.0; MAX_SAMPLES + 1]).contains("100001 samples"));
    let beyond = |r: &mut Run| {
        fail(r, "passes", "tone");
        check(r, "passes", "tone").faults[0].worst.as_mut().expect("worst").beyond = 5000;
    };
    assert_eq!(broken(&beyond), "passes / tone: 5000 values beyond their tolerance, of 4096");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_run_round_trips(run in any_run()) {
        comes_back(&run);
    }

    #[test]
    fn any_text_gives_a_run_or_one_line(text in any::<String>()) {
        if let Err(error) = Run::from_json(&text) {
            prop_assert_eq!(error.to_string().lines().count(), 1);
        }
    }
}
