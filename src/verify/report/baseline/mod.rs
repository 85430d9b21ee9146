//! A run against an earlier one: what changed, also where it stays inside its tolerance. A driver that computes something else
//! than the last one is worth knowing of before it fails anything.

mod errors;
mod times;

use super::{Figure, Outcome, Run, Verdict};
use crate::text::escaped;
use std::collections::{HashMap, HashSet};
use std::fmt::{Display, Formatter};

/// What makes a difference worth telling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    threshold: f64,
}

impl Default for Options {
    fn default() -> Options {
        Options { threshold: 1.05 }
    }
}

impl Options {
    /// `threshold`: the ratio of times, at least 1, beyond which a check that is slower fails the run.
    ///
    /// # Errors
    /// One line: it is no such ratio.
    pub fn new(threshold: f64) -> Result<Options, String> {
        match threshold.is_finite() && threshold >= 1.0 {
            true => Ok(Options { threshold }),
            false => Err(format!("threshold: {threshold} is not a ratio of at least 1 (1.05 is five percent slower)")),
        }
    }

    pub fn threshold(&self) -> f64 {
        self.threshold
    }
}

/// What a change means for the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Fails it: a check that did not fail before, an error that left its tolerance, a time beyond the threshold.
    Worse,
    /// Told, and fails nothing.
    Changed,
    Better,
}

impl Class {
    pub const ALL: [Class; 3] = [Class::Worse, Class::Changed, Class::Better];

    pub fn word(self) -> &'static str {
        match self {
            Class::Worse => "worse",
            Class::Changed => "changed",
            Class::Better => "better",
        }
    }
}

/// One thing that is not as it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    pub class: Class,
    pub group: String,
    pub name: String,
    /// One line, old before new.
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

/// A run held against an earlier one.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The earlier run, in words.
    pub baseline: String,
    /// What the two ran on and how, one line a difference, old before new.
    pub differences: Vec<String>,
    /// What could not be compared and why, and what to think of the rest.
    pub notes: Vec<String>,
    /// The worst first, else in the order of the new run.
    pub changes: Vec<Change>,
    /// Checks of both runs that nothing changed in.
    pub same: usize,
    /// Checks that fail in both.
    pub still_failing: usize,
}

impl Compared {
    /// Fails the run, whatever its own checks say.
    pub fn is_worse(&self) -> bool {
        self.changes.iter().any(|c| c.class == Class::Worse)
    }

    /// Checks with a change that fails the run.
    pub fn worse_checks(&self) -> usize {
        let worse = self.changes.iter().filter(|c| c.class == Class::Worse);
        worse.map(|c| (&c.group, &c.name)).collect::<HashSet<_>>().len()
    }

    /// What differs between the devices and programs, then every change with the check it is of, the worst first. Empty where
    /// nothing changed.
    pub fn lines(&self) -> Vec<String> {
        self.differences.iter().cloned().chain(self.changes.iter().map(Change::to_string)).collect()
    }

    /// How many checks are as they were: the last line.
    pub fn conclusion(&self) -> String {
        let first = if self.changes.is_empty() { "nothing changed" } else { "nothing else changed" };
        let failing = match self.still_failing {
            0 => String::new(),
            count => format!("; {count} failed before and fail still"),
        };
        format!("{first}: {} checks are as before{failing}", self.same)
    }
}

/// A figure that both runs have.
struct Pair<'a> {
    of: &'a Outcome,
    old: &'a Figure,
    new: &'a Figure,
}

/// Every check and figure of `new` against those of the same name in `old`.
pub fn compare(old: &Run, new: &Run, options: &Options) -> Compared {
    let before: HashMap<_, _> = old.outcomes.iter().map(|o| ((&o.group, &o.name), o)).collect();
    let now: HashSet<_> = new.outcomes.iter().map(|o| (&o.group, &o.name)).collect();
    let (mut changes, mut notes, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    let (mut still_failing, mut only_new) = (0, 0);
    for outcome in &new.outcomes {
        let Some(earlier) = before.get(&(&outcome.group, &outcome.name)) else {
            only_new += 1;
            changes.extend(arrived(outcome, old.level == new.level));
            continue;
        };
        still_failing += usize::from([earlier.verdict, outcome.verdict] == [Verdict::Failed; 2]);
        changes.extend(verdict(earlier, outcome));
        changes.extend(figures(earlier, outcome, &mut pairs));
    }
    let gone: Vec<&Outcome> = old.outcomes.iter().filter(|o| !now.contains(&(&o.group, &o.name))).collect();
    if old.level == new.level {
        let missing = |o: &&Outcome| Change::new(Class::Changed, o, format!("missing; before it {}", was(o.verdict)));
        changes.extend(gone.iter().map(missing));
    } else {
        let [was, is] = [old, new].map(|run| run.level.word());
        notes.push(format!(
            "the levels differ ({was} -> {is}), and with them the inputs of passes: an error that is another may say nothing of the device"
        ));
        if gone.len() + only_new > 0 {
            let gone = gone.len();
            notes.push(format!(
                "checks that only the earlier run has, {gone}, and that only this one has, {only_new}, are not compared"
            ));
        }
    }
    let times = times::judged(&pairs, [old, new], options);
    changes.extend(errors::judged(&pairs));
    changes.extend(times.changes);
    notes.extend(times.notes);
    // Stable: within a class the order stays.
    changes.sort_by_key(|c| c.class);
    let touched: HashSet<_> = changes.iter().map(|c| (&c.group, &c.name)).collect();
    let is_same = |o: &&Outcome| before.contains_key(&(&o.group, &o.name)) && !touched.contains(&(&o.group, &o.name));
    let same = new.outcomes.iter().filter(is_same).count();
    Compared { baseline: described(old), differences: differences(old, new), notes, changes, same, still_failing }
}

fn was(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Passed => "passed",
        Verdict::Failed => "failed",
        Verdict::LeftOut => "was left out",
    }
}

/// A check that only the new run has: told where both should have it, and always where it fails.
fn arrived(outcome: &Outcome, same_level: bool) -> Option<Change> {
    match outcome.verdict {
        Verdict::Failed => Some(Change::new(Class::Worse, outcome, format!("new, and fails{}", reason(outcome)))),
        _ => same_level.then(|| Change::new(Class::Changed, outcome, format!("new; {}", outcome.verdict.word()))),
    }
}

/// The first fault or note, after a colon.
fn reason(outcome: &Outcome) -> String {
    let fault = outcome.faults.first().map(|f| &f.what);
    let note = outcome.notes.first().filter(|_| outcome.verdict == Verdict::LeftOut);
    fault.or(note).map_or_else(String::new, |what| format!(": {}", escaped(what)))
}

fn verdict(old: &Outcome, new: &Outcome) -> Option<Change> {
    let class = match (old.verdict, new.verdict) {
        (a, b) if a == b => return None,
        (_, Verdict::Failed) => Class::Worse,
        (_, Verdict::Passed) => Class::Better,
        (_, Verdict::LeftOut) => Class::Changed,
    };
    Some(Change::new(class, new, format!("{} -> {}{}", old.verdict.word(), new.verdict.word(), reason(new))))
}

/// Pairs the figures of a check; what only one run measured is a change where both passed.
fn figures<'a>(old: &'a Outcome, new: &'a Outcome, pairs: &mut Vec<Pair<'a>>) -> Vec<Change> {
    let mut changes = Vec::new();
    let both_passed = [old.verdict, new.verdict] == [Verdict::Passed; 2];
    let mut told = |figure: &Figure, what: &str| {
        changes.push(Change::new(Class::Changed, new, format!("{}: {what}", escaped(&figure.what))));
    };
    for figure in new.figures.iter().filter(|f| !f.fleeting) {
        match old.figures.iter().find(|f| f.what == figure.what) {
            Some(earlier) if earlier.unit == figure.unit => pairs.push(Pair { of: new, old: earlier, new: figure }),
            Some(_) => told(figure, "measured in another unit than before, not compared"),
            None if both_passed => told(figure, "not measured before"),
            None => {}
        }
    }
    for figure in
        old.figures.iter().filter(|f| both_passed && !f.fleeting && new.figures.iter().all(|g| g.what != f.what))
    {
        told(figure, "measured before, and not now");
    }
    changes
}

fn described(run: &Run) -> String {
    let parts = [&run.date, &run.program, &run.device.name, &run.device.driver].map(|part| escaped(part));
    let [date, program, device, driver] = parts;
    format!("the run of {date} ({program}, {}) on {device}, {driver}", run.level.word())
}

fn differences(old: &Run, new: &Run) -> Vec<String> {
    let of = |what: fn(&Run) -> String| [old, new].map(|run| escaped(&what(run)));
    let conditions = [
        ("device", of(|r| r.device.name.clone())),
        ("driver", of(|r| r.device.driver.clone())),
        ("Vulkan", of(|r| r.device.api.clone())),
        ("clocks", of(|r| r.device.clocks.clone().unwrap_or_else(|| "not known".into()))),
        ("program", of(|r| r.program.clone())),
        ("level", of(|r| r.level.word().into())),
        ("validation layer", of(|r| if r.validation { "watching" } else { "not watching" }.into())),
    ];
    let differing = conditions.into_iter().filter(|(_, [old, new])| old != new);
    differing.map(|(what, [old, new])| format!("{what}: {old} -> {new}")).collect()
}
