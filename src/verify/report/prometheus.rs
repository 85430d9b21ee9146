//! A run as metrics for Prometheus, for fleets with one file on each machine. Counts are gauges, because each run begins at zero.

use super::baseline::BaselineComparison;
use super::{Run, Unit, Verdict};
use crate::metrics::table;
use crate::metrics::text_format::Exposition;
use std::time::UNIX_EPOCH;

/// The report as metrics for a textfile collector of Prometheus. `compared`: the comparison with a baseline, if there is one.
pub fn prometheus(run: &Run, compared: Option<&BaselineComparison>) -> String {
    let device = &run.device;
    let conditions = [
        &device.name,
        &device.driver,
        &device.api,
        &run.program,
        &run.level.name().to_string(),
        &run.validation.to_string(),
    ];
    let words = [
        (Verdict::Passed, "passed"),
        (Verdict::Failed, "failed"),
        (Verdict::LeftOut, "skipped"),
        (Verdict::Interrupted, "interrupted"),
    ];
    let failed = run.failures().map(|o| (vec![o.group.clone(), o.name.clone()], 1.0));
    let times = run.outcomes.iter().filter(|o| o.group == "speed").filter_map(|outcome| {
        let time = outcome.figures.iter().find(|f| f.unit == Unit::Ns && f.value.is_finite())?;
        Some((vec![outcome.name.clone()], 1e-9 * time.value))
    });
    // A date that another program wrote may be any text.
    let at = humantime::parse_rfc3339(&run.date).ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok());

    let mut text = Exposition::default();
    text.numbers(&table::VERIFY_INFO, [(conditions.map(String::clone).to_vec(), 1.0)]);
    text.numbers(&table::VERIFY_CHECKS, words.map(|(verdict, word)| (vec![word.into()], run.count(verdict) as f64)));
    text.number(&table::VERIFY_CHECKS_FLAKY, run.flaky().count() as f64);
    text.numbers(&table::VERIFY_CHECK_FAILED, failed);
    text.numbers(&table::VERIFY_CHECKS_WORSE, compared.map(|compared| (Vec::new(), compared.worse_checks() as f64)));
    text.numbers(&table::VERIFY_PASS_SECONDS, times);
    text.number(&table::VERIFY_DURATION, run.seconds);
    text.numbers(&table::VERIFY_TIMESTAMP, at.map(|at| (Vec::new(), at.as_secs_f64())));
    text.into_text()
}
