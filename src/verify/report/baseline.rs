//! Compares a run with an earlier one, also within tolerances: if the results of a driver differ from those of its previous version, this
//! is worth reporting before any check fails.

use super::{Figure, Outcome, Run, Unit, Verdict, amount, change, number};
use crate::baselines::{Threshold, differing, matched};
use crate::profile::compare as profile;
use crate::profile::compare::{Kind, Line, Series};
use crate::text::escaped;
use crate::tree::{All, Name};
use std::collections::{BTreeMap, HashSet};
use std::fmt::{Display, Formatter};

/// How bad a change is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, All, Name)]
#[tree(rename_all = "lowercase")]
pub enum Class {
    /// The change fails the run: a check fails that did not before, an error now exceeds its tolerance, a time has grown beyond the threshold, or a
    /// time that was measured once has more than tripled.
    Worse,
    /// The change is reported, and does not fail the run.
    Changed,
    Better,
}

/// A difference between an outcome and that of the earlier run.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub class: Class,
    pub group: String,
    pub name: String,
    /// What changed, in one line: the old value before the new one.
    pub what: String,
}

impl Change {
    fn new(class: Class, of: &Outcome, what: impl Into<String>) -> Change {
        Change { class, group: of.group.clone(), name: of.name.clone(), what: what.into() }
    }
}

impl Display for Change {
    fn fmt(&self, to: &mut Formatter) -> std::fmt::Result {
        write!(to, "{} / {}: {}", escaped(&self.group), escaped(&self.name), self.what)
    }
}

/// The comparison of a run with an earlier one, the baseline.
#[derive(Clone, Debug, PartialEq)]
pub struct BaselineComparison {
    /// Description of the earlier run.
    pub baseline: String,
    /// Differences of the conditions of both runs (device, driver, program and the like), one line each, the old value before the new one.
    pub differences: Vec<String>,
    /// What could not be compared, with the reasons, and other remarks.
    pub notes: Vec<String>,
    /// The changes, the worst class first. Within a class those of verdicts and of which figures there are come first, then those of errors, then
    /// those of times.
    pub changes: Vec<Change>,
    /// Number of checks that did not change.
    pub same: usize,
    /// Number of checks that fail in both runs.
    pub(crate) still_failing: usize,
}

impl BaselineComparison {
    /// True if the comparison fails the run.
    pub fn is_worse(&self) -> bool {
        self.changes.iter().any(|c| c.class == Class::Worse)
    }

    /// Number of checks with a change that fails the run.
    pub fn worse_checks(&self) -> usize {
        let worse = self.changes.iter().filter(|c| c.class == Class::Worse);
        worse.map(|c| (&c.group, &c.name)).collect::<HashSet<_>>().len()
    }

    /// Lines to print: differences of the conditions, then all changes with their checks, the worst first. Empty if there are neither.
    pub fn lines(&self) -> Vec<String> {
        self.differences.iter().cloned().chain(self.changes.iter().map(Change::to_string)).collect()
    }

    /// The last line to print: how many checks are unchanged.
    pub fn conclusion(&self) -> String {
        let first = if self.changes.is_empty() { "nothing changed" } else { "nothing else changed" };
        let failing = match self.still_failing {
            0 => String::new(),
            count => format!("; {count} failed before and fail still"),
        };
        format!("{first}: {} checks are as before{failing}", self.same)
    }
}

/// A figure of both runs.
struct Pair<'a> {
    of: &'a Outcome,
    old: &'a Figure,
    new: &'a Figure,
}

/// Compares the checks and figures of `new` with those of the same name in `old`. `threshold`: ratio of times above which a slower check fails the
/// run.
pub fn compare(old: &Run, new: &Run, threshold: Threshold) -> BaselineComparison {
    let (mut changes, mut notes, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    let (mut still_failing, mut only_new, mut gone, mut both) = (0, 0, 0, Vec::new());
    let is_same_level = old.level == new.level;
    for found in matched(&old.outcomes, &new.outcomes, |o| (&o.group, &o.name)) {
        match found {
            (Some(earlier), Some(outcome)) => {
                both.push(outcome);
                still_failing += usize::from([earlier.verdict, outcome.verdict] == [Verdict::Failed; 2]);
                changes.extend(verdict(earlier, outcome));
                changes.extend(figures(earlier, outcome, &mut pairs));
            }
            (earlier, Some(outcome)) => {
                only_new += usize::from(earlier.is_none());
                changes.extend(arrived(outcome, is_same_level));
            }
            (earlier, None) => {
                gone += 1;
                changes.extend(earlier.filter(|_| is_same_level).map(missing));
            }
        }
    }
    if !is_same_level {
        let [was, is] = [old, new].map(|run| run.level.name());
        notes.push(format!(
            "the levels differ ({was} -> {is}), and with them the inputs of passes: an error that is another may say nothing of the device"
        ));
        if gone + only_new > 0 {
            notes.push(format!(
                "checks that only the earlier run has, {gone}, and that only this one has, {only_new}, are not compared"
            ));
        }
    }
    let (time_changes, time_notes) = judge_times(&pairs, [old, new], threshold);
    changes.extend(error_changes(&pairs));
    changes.extend(time_changes);
    notes.extend(time_notes);
    // The sort is stable: within a class the order stays.
    changes.sort_by_key(|c| c.class);
    let touched: HashSet<_> = changes.iter().map(|c| (&c.group, &c.name)).collect();
    let same = both.iter().filter(|o| !touched.contains(&(&o.group, &o.name))).count();
    BaselineComparison {
        baseline: described(old),
        differences: differing(conditions(old), conditions(new)),
        notes,
        changes,
        same,
        still_failing,
    }
}

/// The change for a check that only the old run has.
fn missing(earlier: &Outcome) -> Change {
    let was = if matches!(earlier.verdict, Verdict::Passed | Verdict::Failed) { "" } else { "was " };
    Change::new(Class::Changed, earlier, format!("missing; before it {was}{}", earlier.verdict.word()))
}

/// The change for a check that only the new run has: reported if both should have it, and always if it fails.
fn arrived(outcome: &Outcome, same_level: bool) -> Option<Change> {
    match outcome.verdict {
        Verdict::Failed => Some(Change::new(Class::Worse, outcome, format!("new, and fails{}", reason(outcome)))),
        _ => same_level.then(|| Change::new(Class::Changed, outcome, format!("new; {}", outcome.verdict.word()))),
    }
}

/// The first fault or note, after a colon.
fn reason(outcome: &Outcome) -> String {
    let fault = outcome.faults.first().map(|f| &f.what);
    let is_unrun = matches!(outcome.verdict, Verdict::LeftOut | Verdict::Interrupted);
    let note = outcome.notes.first().filter(|_| is_unrun);
    fault.or(note).map_or_else(String::new, |what| format!(": {}", escaped(what)))
}

fn verdict(old: &Outcome, new: &Outcome) -> Option<Change> {
    let class = match (old.verdict, new.verdict) {
        (a, b) if a == b => return None,
        (_, Verdict::Failed) => Class::Worse,
        (_, Verdict::Passed) => Class::Better,
        (_, Verdict::LeftOut | Verdict::Interrupted) => Class::Changed,
    };
    Some(Change::new(class, new, format!("{} -> {}{}", old.verdict.word(), new.verdict.word(), reason(new))))
}

/// Pairs the figures of a check. A figure of only one run is a change if both passed.
fn figures<'a>(old: &'a Outcome, new: &'a Outcome, pairs: &mut Vec<Pair<'a>>) -> Vec<Change> {
    let mut changes = Vec::new();
    let both_passed = [old.verdict, new.verdict] == [Verdict::Passed; 2];
    let mut report = |figure: &Figure, what: &str| {
        changes.push(Change::new(Class::Changed, new, format!("{}: {what}", escaped(&figure.what))));
    };
    for found in matched(&old.figures, &new.figures, |figure| &figure.what) {
        match found {
            (_, Some(figure)) | (Some(figure), None) if figure.fleeting => {}
            (Some(old), Some(figure)) if old.unit == figure.unit => pairs.push(Pair { of: new, old, new: figure }),
            (Some(_), Some(figure)) => report(figure, "measured in another unit than before, not compared"),
            // Runs of earlier versions have no times of compilation.
            (None, Some(figure)) if both_passed && !figure.is_single_time() => report(figure, "not measured before"),
            (Some(figure), None) if both_passed => report(figure, "measured before, and not now"),
            _ => {}
        }
    }
    changes
}

fn described(run: &Run) -> String {
    let parts = [&run.date, &run.program, &run.device.name, &run.device.driver].map(|part| escaped(part));
    let [date, program, device, driver] = parts;
    format!("the run of {date} ({program}, {}) on {device}, {driver}", run.level.name())
}

fn conditions(run: &Run) -> impl Iterator<Item = (&'static str, String)> {
    let others = [
        ("program", run.program.clone()),
        ("level", run.level.name().into()),
        ("validation layer", if run.validation { "watching" } else { "not watching" }.into()),
    ];
    run.device.conditions().into_iter().chain(others).map(|(what, text)| (what, escaped(&text)))
}

/// Relative difference above which a change of an error is reported.
const SHARE: f64 = 0.01;

/// Absolute difference above which it is reported: a single-precision rounding error at the scale of the values.
const ROUNDING: f64 = f32::EPSILON as f64;

/// Changes of figures other than times.
fn error_changes(pairs: &[Pair]) -> Vec<Change> {
    let others = pairs.iter().filter(|p| p.new.unit != Unit::Ns);
    others.flat_map(|pair| [value_change(pair), tolerance_change(pair)]).flatten().collect()
}

/// True if equal within rounding; counts must be equal.
fn is_same(old: f64, new: f64, unit: Unit) -> bool {
    if unit == Unit::Count || !(old.is_finite() && new.is_finite()) {
        return old == new || (old.is_nan() && new.is_nan());
    }
    let largest = old.abs().max(new.abs());
    (new - old).abs() <= (SHARE * largest).max(ROUNDING * largest.max(1.0))
}

fn value_change(pair: &Pair) -> Option<Change> {
    let (old, new, unit) = (pair.old.value, pair.new.value, pair.new.unit);
    if is_same(old, new, unit) {
        return None;
    }
    let [was_beyond, is_beyond] = [pair.old, pair.new].map(|f| f.used().is_some_and(|used| used > 1.0));
    // NaN is worse than any number.
    let grew = new > old || (new.is_nan() && !old.is_nan());
    let is_error = pair.new.allowed.is_some() || !matches!(unit, Unit::Count | Unit::Share);
    let class = match (was_beyond, is_beyond) {
        (false, true) => Class::Worse,
        _ if is_error && !grew => Class::Better,
        _ => Class::Changed,
    };
    let still = |allowed| match (was_beyond, is_beyond) {
        (false, false) => format!(", still under {}", bare(allowed, unit)),
        (true, true) => format!(", still over {}", bare(allowed, unit)),
        (false, true) => format!(", now over {}", bare(allowed, unit)),
        (true, false) => format!(", now under {}", bare(allowed, unit)),
    };
    let allowed = pair.new.allowed.map_or_else(String::new, still);
    let what = escaped(&pair.new.what);
    Some(Change::new(class, pair.of, format!("{what} {}{allowed}", change(old, new, unit))))
}

/// A value without its unit, which the text already contains.
fn bare(allowed: f64, unit: Unit) -> String {
    let shown = amount(allowed, unit);
    shown.split(' ').next().unwrap_or(&shown).into()
}

/// A limit that differs between versions of the program.
fn tolerance_change(pair: &Pair) -> Option<Change> {
    let (old, new, unit) = (pair.old.allowed, pair.new.allowed, pair.new.unit);
    if old == new {
        return None;
    }
    let text = match (old, new) {
        (Some(old), Some(new)) => change(old, new, unit),
        (_, new) => {
            let word = |allowed: Option<f64>| allowed.map_or_else(|| "any".into(), |a| amount(a, unit));
            format!("{} -> {}", word(old), word(new))
        }
    };
    Some(Change::new(Class::Changed, pair.of, format!("{}: allowed {text}", escaped(&pair.new.what))))
}

/// Probability of any false alarm among all times of a comparison.
const ALPHA: f64 = 0.05;

/// Changes of times by more than the noise of the device, by the method of `profile --compare`, and notes. `runs`: old, new.
fn judge_times(pairs: &[Pair], runs: [&Run; 2], threshold: Threshold) -> (Vec<Change>, Vec<String>) {
    let times: Vec<&Pair> = pairs.iter().filter(|p| p.new.unit == Unit::Ns && !p.new.is_single_time()).collect();
    let because = incomparable(runs);
    let singles = pairs.iter().filter(|p| p.new.is_single_time() && p.old.is_single_time());
    let mut changes: Vec<Change> = singles.filter_map(|pair| single_change(pair, because.is_some())).collect();
    if times.is_empty() {
        return (changes, Vec::new());
    }
    let both = times.iter().filter(|p| !usable(p.old).is_empty() && !usable(p.new).is_empty()).count();
    let method = profile::Method::Apart { blocks: profile::blocks_needed(both, ALPHA) };
    let tick = runs[0].device.timestamp_period_ns.max(runs[1].device.timestamp_period_ns);
    let series = |figure| Some(Series { stage: "", runs: 1, times: usable(figure) });
    let lines = times.iter().map(|p| profile::Pair {
        kind: Kind::Pass,
        name: &p.new.what,
        old: series(p.old),
        new: series(p.new),
    });
    let criteria = profile::CompareOptions { threshold, alpha: ALPHA, force: true, ..Default::default() };
    let lines = match profile::judge(lines.collect(), method, tick, &criteria) {
        Ok(lines) => lines,
        Err(fault) => return (changes, vec![format!("times are not compared: {fault}")]),
    };
    let mut left: BTreeMap<String, usize> = BTreeMap::new();
    for (pair, line) in times.iter().zip(&lines) {
        match &line.note {
            Some(why) if line.verdict == profile::Verdict::NotComparable => *left.entry(why.clone()).or_default() += 1,
            _ => changes.extend(time_change(pair, line, threshold, because.is_some())),
        }
    }
    let because = because.map(|why| format!("{why}: times are reported, but fail nothing"));
    let left = left.into_iter().map(|(why, count)| format!("{count} times are not compared: {why}"));
    (changes, because.into_iter().chain(left).chain(profile::common_shift(&lines)).collect())
}

/// Ratio of times measured once, such as those to compile a pass, beyond which there is a change. Other programs run meanwhile.
const SINGLE_RATIO: f64 = 3.0;

/// A smaller difference is none, ns.
const SINGLE_FLOOR: f64 = 100e6;

/// The change of a time that was measured once in each run.
fn single_change(pair: &Pair, is_informative: bool) -> Option<Change> {
    let (old, new) = (pair.old.value, pair.new.value);
    if !(old.is_finite() && new.is_finite()) || (new - old).abs() <= SINGLE_FLOOR {
        return None;
    }
    let class = match () {
        _ if new > SINGLE_RATIO * old && is_informative => Class::Changed,
        _ if new > SINGLE_RATIO * old => Class::Worse,
        _ if old > SINGLE_RATIO * new => Class::Better,
        _ => return None,
    };
    let bound = format!("more than {} times", number(SINGLE_RATIO));
    Some(Change::new(class, pair.of, format!("{} {}: {bound}", escaped(&pair.new.what), change(old, new, Unit::Ns))))
}

/// The times; empty if one is not finite, since a file may contain anything.
fn usable(figure: &Figure) -> &[f64] {
    if figure.samples.iter().all(|ns| ns.is_finite()) { &figure.samples } else { &[] }
}

/// Why the times of the runs cannot fail the new one.
fn incomparable([old, new]: [&Run; 2]) -> Option<&'static str> {
    match () {
        _ if old.device.identity() != new.device.identity() => Some("the devices differ"),
        _ if old.validation != new.validation => Some("the validation layer watched one run only"),
        _ => None,
    }
}

fn time_change(pair: &Pair, line: &Line, threshold: Threshold, is_informative: bool) -> Option<Change> {
    let ratio = line.ratio?;
    let class = match line.verdict {
        profile::Verdict::Slower if line.is_regression && !is_informative => Class::Worse,
        profile::Verdict::Slower => Class::Changed,
        profile::Verdict::Faster => Class::Better,
        _ => return None,
    };
    let (share, word) = match ratio.estimate {
        r if r >= 1.0 => (r - 1.0, "slower"),
        r => (1.0 - r, "faster"),
    };
    let medians = line.old_ns.zip(line.new_ns).map_or_else(String::new, |(old, new)| change(old, new, Unit::Ns));
    let under = match line.verdict == profile::Verdict::Slower && !line.is_regression {
        true => format!(", within the threshold of {} %", number(100.0 * (threshold.ratio() - 1.0))),
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

/// Without decimals from 10 %.
fn rounded(percent: f64) -> String {
    if percent >= 10.0 { format!("{percent:.0}") } else { format!("{percent:.1}") }
}
