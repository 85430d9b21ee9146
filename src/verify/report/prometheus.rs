//! A run as metrics in Prometheus' text format, for the textfile collector of its node exporter: one file on each machine of a fleet.
//! Counts are gauges, because each run begins at zero.

use super::{Run, Unit, Verdict};
use crate::text::escaped;
use std::fmt::Write as _;
use std::time::UNIX_EPOCH;

/// A metric of the file: its name after `echolume_verify_`, what it is, and its samples.
struct Metric {
    name: &'static str,
    help: &'static str,
    /// Labels and value.
    samples: Vec<(Vec<(&'static str, String)>, f64)>,
}

/// The file. Metrics without a sample are left out.
pub fn prometheus(run: &Run) -> String {
    let mut text = String::new();
    for metric in metrics(run).iter().filter(|metric| !metric.samples.is_empty()) {
        let Metric { name, help, samples } = metric;
        let _ = writeln!(text, "# HELP echolume_verify_{name} {help}\n# TYPE echolume_verify_{name} gauge");
        for (labels, value) in samples {
            let labels: Vec<String> =
                labels.iter().map(|(name, value)| format!("{name}=\"{}\"", label(value))).collect();
            let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
            let _ = writeln!(text, "echolume_verify_{name}{labels} {}", number(*value));
        }
    }
    text
}

fn metrics(run: &Run) -> Vec<Metric> {
    let device = &run.device;
    let conditions = vec![
        ("device", device.name.clone()),
        ("driver", device.driver.clone()),
        ("vulkan", device.api.clone()),
        ("program", run.program.clone()),
        ("level", run.level.word().into()),
        ("validation", run.validation.to_string()),
    ];
    let words = [
        (Verdict::Passed, "passed"),
        (Verdict::Failed, "failed"),
        (Verdict::LeftOut, "skipped"),
        (Verdict::Interrupted, "interrupted"),
    ];
    let counts = words.map(|(verdict, word)| (vec![("result", word.to_string())], run.count(verdict) as f64));
    let failed = run.failures().map(|o| (vec![("group", o.group.clone()), ("check", o.name.clone())], 1.0));
    let times = run.outcomes.iter().filter(|o| o.group == "speed").filter_map(|outcome| {
        let time = outcome.figures.iter().find(|f| f.unit == Unit::Ns && f.value.is_finite())?;
        Some((vec![("pass", outcome.name.clone())], 1e-9 * time.value))
    });
    let metric = |name, help, samples| Metric { name, help, samples };
    // A date that another program wrote may be any text.
    let at = humantime::parse_rfc3339(&run.date).ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());
    vec![
        metric("info", "The device, its driver and the program, as labels; always 1.", vec![(conditions, 1.0)]),
        metric("checks", "Number of checks of the last run by result.", counts.to_vec()),
        metric("check_failed", "1 for each check that failed in the last run.", failed.collect()),
        metric("pass_seconds", "Median time of one pass on the device.", times.collect()),
        metric("duration_seconds", "Duration of the last run.", vec![(Vec::new(), run.seconds)]),
        metric(
            "timestamp_seconds",
            "End of the last run, seconds since 1970.",
            at.map(|at| (Vec::new(), at.as_secs_f64())).into_iter().collect(),
        ),
    ]
}

/// A label value: bounded, on one line, with backslashes and quotes escaped.
fn label(text: &str) -> String {
    escaped(text).replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// A value as Go parses it.
fn number(value: f64) -> String {
    match value {
        v if v.is_nan() => "NaN".into(),
        v if v.is_infinite() => if v > 0.0 { "+Inf" } else { "-Inf" }.into(),
        v => format!("{v}"),
    }
}
