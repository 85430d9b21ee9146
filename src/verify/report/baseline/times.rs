//! Times of two runs, judged as `profile --compare` judges them.

use super::{Change, Class, Options, Pair};
use crate::profile::compare as profile;
use crate::profile::compare::{Kind, Line, Series, Verdict};
use crate::text::escaped;
use crate::verify::report::numbers::{change, number};
use crate::verify::report::{Figure, Run, Unit};
use std::collections::BTreeMap;

/// Probability of any false alarm in all times of a comparison.
const ALPHA: f64 = 0.05;

#[derive(Default)]
pub(super) struct Judged {
    pub changes: Vec<Change>,
    pub notes: Vec<String>,
}

/// Which times differ by more than the device differs from itself. `runs`: old, new.
pub(super) fn judged(pairs: &[Pair], runs: [&Run; 2], options: &Options) -> Judged {
    let times: Vec<&Pair> = pairs.iter().filter(|p| p.new.unit == Unit::Ns).collect();
    if times.is_empty() {
        return Judged::default();
    }
    let both = times.iter().filter(|p| !usable(p.old).is_empty() && !usable(p.new).is_empty()).count();
    let blocks = profile::blocks_needed(both, ALPHA);
    let tick = runs[0].device.timestamp_period_ns.max(runs[1].device.timestamp_period_ns);
    let series = |figure| Some(Series { stage: "", runs: 1, times: usable(figure) });
    let lines = times.iter().map(|p| profile::Pair {
        kind: Kind::Pass,
        name: &p.new.what,
        old: series(p.old),
        new: series(p.new),
    });
    let criteria = profile::CompareOptions { threshold: options.threshold(), alpha: ALPHA, force: true };
    let lines = match profile::judge(lines.collect(), blocks, tick, &criteria) {
        Ok(lines) => lines,
        Err(fault) => return Judged { changes: Vec::new(), notes: vec![format!("times are not compared: {fault}")] },
    };
    let because = incomparable(runs);
    let mut found = Judged::default();
    let mut left: BTreeMap<String, usize> = BTreeMap::new();
    for (pair, line) in times.iter().zip(&lines) {
        match &line.note {
            Some(why) if line.verdict == Verdict::NotComparable => *left.entry(why.clone()).or_default() += 1,
            _ => found.changes.extend(told(pair, line, options, because.is_some())),
        }
    }
    found.notes.extend(because.map(|why| format!("{why}: times are told, and fail nothing")));
    found.notes.extend(left.into_iter().map(|(why, count)| format!("{count} times are not compared: {why}")));
    found.notes.extend(profile::common_shift(&lines));
    found
}

/// None where one is not a number: a file may hold anything.
fn usable(figure: &Figure) -> &[f64] {
    if figure.samples.iter().all(|ns| ns.is_finite()) { &figure.samples } else { &[] }
}

/// Why a time of one run is no measure for the other.
fn incomparable([old, new]: [&Run; 2]) -> Option<&'static str> {
    match () {
        _ if old.device.name != new.device.name => Some("the devices differ"),
        _ if old.validation != new.validation => Some("the validation layer watched one run only"),
        _ => None,
    }
}

fn told(pair: &Pair, line: &Line, options: &Options, is_only_told: bool) -> Option<Change> {
    let ratio = line.ratio?;
    let class = match line.verdict {
        Verdict::Slower if line.is_regression && !is_only_told => Class::Worse,
        Verdict::Slower => Class::Changed,
        Verdict::Faster => Class::Better,
        _ => return None,
    };
    let (share, word) = match ratio.estimate {
        r if r >= 1.0 => (r - 1.0, "slower"),
        r => (1.0 - r, "faster"),
    };
    let medians = line.old_ns.zip(line.new_ns).map_or_else(String::new, |(old, new)| change(old, new, Unit::Ns));
    let under = match line.verdict == Verdict::Slower && !line.is_regression {
        true => format!(", within the threshold of {} %", number(100.0 * (options.threshold() - 1.0))),
        false => String::new(),
    };
    let what = format!(
        "{} {} % {word} ({:.2}..{:.2}), {medians}{under}",
        escaped(&pair.new.what),
        rounded(100.0 * share),
        ratio.low,
        ratio.high
    );
    Some(Change::new(class, pair.of, what))
}

/// Whole from 10 on.
fn rounded(percent: f64) -> String {
    if percent >= 10.0 { format!("{percent:.0}") } else { format!("{percent:.1}") }
}
