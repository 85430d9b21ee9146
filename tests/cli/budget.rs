//! Settings chosen from the measurements of a report.

use crate::common::program::*;
use std::fs;

/// An error report of the bone with two combinations: 20 ms as it is, 8 ms with longer steps.
pub fn error_report(volume: &str) -> String {
    let errors = |rmse: f64| {
        format!(
            "{{\"rmse\": {rmse}, \"max\": 0.1, \"levels\": {{\"rms\": 0.2, \"median\": 0.1, \"p95\": 0.5, \"max\": 2, \"over_1\": 0.01, \"over_8\": 0}}}}"
        )
    };
    let choice = |set: &str, rmse: f64, ms: f64| {
        let changed = if set.is_empty() { "" } else { "[\"step\", \"1.25 mm\"]" };
        let time = |ms: f64| {
            let ns = ms * 1e6;
            format!("{{\"median\": {ns}, \"low\": {ns}, \"high\": {ns}, \"p95\": {ns}}}")
        };
        format!(
            "{{\"changed\": [{changed}], \"set\": [{set}], \"errors\": {}, \"reference_error\": {{\"rmse\": 0, \"levels\": 0}}, \
             \"times\": {{\"volume\": {}, \"picture\": {}, \"total\": {}}}}}",
            errors(rmse),
            time(0.25 * ms),
            time(0.75 * ms),
            time(ms)
        )
    };
    format!(
        "{{\"format\": \"echolume error report 3\", \"device\": \"a card\", \"driver\": \"1\", \"date\": \"2026-11-21\", \
         \"scene\": \"bone\", \"sizes\": {{\"volume\": {volume}, \"picture\": [64, 48]}}, \"repeats\": 3, \"dials\": [], \
         \"choices\": [{}, {}], \"budget\": {{\"reference\": {{\"kind\": \"f64\"}}, \"reference_error\": {{\"rmse\": 0, \"levels\": 0}}, \
         \"shares\": [], \"total\": {}}}}}",
        choice("", 0.001, 20.0),
        choice("\"ray.step=1.25\"", 0.004, 8.0),
        errors(0.001)
    )
}

#[test]
fn a_time_budget_uses_the_report_and_overrides_no_setting_of_the_user() {
    let folder = Folder::new("budget");
    let report = folder.write("error.json", error_report("[160, 216, 33]"));
    let picture = |name: &str, more: &[&str]| {
        // The surface detector chooses its own step.
        let said = render(BONE, &folder.path(name), &[&["--mode", "vr"], more].concat());
        (said, fs::read(folder.path(name)).expect("the picture"))
    };
    let (_, plain) = picture("plain.png", &["--set", "ray.step=0.5"]);
    let (_, coarse) = picture("coarse.png", &["--set", "ray.step=1.25"]);
    assert_ne!(plain, coarse);
    let (said, chosen) = picture("chosen.png", &["--budget", "10ms", "--report", &report]);
    assert!(
        said.contains(
            "budget 10ms: (ray.step=1.25): RMSE 4.000e-3, 8.000 ms (95th percentile 8.000), measured on a card with another scene"
        ),
        "{said}"
    );
    assert!(said.contains("budget 10ms: volume and picture took "), "{said}");
    assert_eq!(chosen, coarse);
    let (said, ample) = picture("ample.png", &["--budget", "0.1s", "--report", &report]);
    assert!(said.contains("(the scene as it is)"), "{said}");
    assert_eq!(ample, picture("default.png", &[]).1);
    let (_, mine) = picture("mine.png", &["--budget", "10ms", "--report", &report, "--set", "ray.step=0.5"]);
    assert_eq!(mine, plain, "what the user sets is above it");

    let other = folder.write("other.json", error_report("[1, 2, 3]"));
    let foreign = folder.write("foreign.json", "{\"format\": \"somebody else's\"}");
    let text = folder.write("text.json", "not a report");
    for (budget, file, named) in [
        ("10ms", &folder.path("missing.json"), "missing.json: cannot be read"),
        ("10ms", &foreign, "somebody else's"),
        ("10ms", &text, "text.json: not an error report: "),
        ("10ms", &other, "1x2x3"),
        ("soon", &report, "--budget soon"),
    ] {
        folder.refuses(&[BONE, "--budget", budget, "--report", file], &[named]);
    }
    let all = ["render", BONE, "--budget", "1ms", "--report", &report, "-o", &folder.path("never.png")];
    refuses(&all, &run(&all), 1, &["--budget 1ms", "no settings take 1.000 ms or less", "8.000 ms"]);
    for alone in [["--budget", "10ms"], ["--report", &report]] {
        assert_eq!(run(&[&["render", BONE][..], &alone].concat()).0, Some(2), "{alone:?}");
    }
}
