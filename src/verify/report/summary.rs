//! A run as text for a terminal: lines of groups, failures, the summary, and the comparison with a baseline.

use super::baseline::{BaselineComparison, Class};
use super::numbers::{expected_and_got, number, percent, seconds, value_of_limit};
use super::{Fault, Outcome, Run, Verdict, Worst};
use crate::text::escaped;
use std::fmt::Write as _;

/// Maximum number of changes of a class that are listed, except those that fail the run.
const MAX_CHANGES: usize = 40;

/// One line on a group, without line break: verdicts, duration, and the check that is closest to its tolerance.
pub fn group_line(group: &str, outcomes: &[&Outcome]) -> String {
    let count = |verdict| outcomes.iter().filter(|o| o.verdict == verdict).count();
    let mut line =
        format!("{:<18} {}", escaped(group), counts([Verdict::Passed, Verdict::Failed, Verdict::LeftOut].map(count)));
    let _ = write!(line, " in {}", seconds(outcomes.iter().map(|o| o.seconds).sum()));
    let passed = outcomes.iter().filter(|o| o.verdict == Verdict::Passed);
    let used = passed.filter_map(|o| Some((o, o.tightest()?.used()?))).filter(|(_, used)| *used > 0.0);
    if let Some((outcome, used)) = used.reduce(|a, b| if b.1 > a.1 { b } else { a }) {
        let _ = write!(line, "; nearest to its tolerance: {}, {}", escaped(&outcome.name), percent(used));
    }
    line
}

/// Numbers of passed, failed and left out checks; zeros are omitted.
fn counts(of: [usize; 3]) -> String {
    let words = [Verdict::Passed, Verdict::Failed, Verdict::LeftOut].map(Verdict::word);
    let texts = of.iter().zip(words).filter(|(count, _)| **count > 0).map(|(count, word)| format!("{count} {word}"));
    let texts: Vec<String> = texts.collect();
    if texts.is_empty() { "no checks".into() } else { texts.join(", ") }
}

/// A failed check in full, one line per item, each with line break.
pub fn failure(outcome: &Outcome) -> String {
    let mut text = format!("{}: {}\n", outcome.title(), outcome.verdict.word());
    for fault in &outcome.faults {
        let _ = writeln!(text, "  {}", escaped(&fault.what));
        for (name, value) in fault_items(fault) {
            let _ = writeln!(text, "    {name}: {value}");
        }
    }
    for figure in outcome.figures.iter().filter(|f| f.used().is_some_and(|used| used > 1.0)) {
        let _ = writeln!(text, "  {}: {}", escaped(&figure.what), value_of_limit(figure));
    }
    for note in &outcome.notes {
        let _ = writeln!(text, "  {}", escaped(note));
    }
    text
}

/// Details of a fault as names and values, one line each.
pub(super) fn fault_items(fault: &Fault) -> Vec<(&'static str, String)> {
    let mut items = Vec::new();
    items.extend(fault.pass.as_deref().map(|pass| ("pass", escaped(pass))));
    if !fault.input.is_empty() {
        items.push(("input", escaped(&fault.input)));
    }
    if let Some(worst) = &fault.worst {
        let [expected, got] = expected_and_got(worst.expected, worst.got);
        items.push(("worst pixel", place(worst)));
        items.push(("expected", expected));
        items.push(("got", got));
        items.push(("beyond tolerance", beyond(worst)));
    }
    if !fault.files.is_empty() {
        items.push(("files", fault.files.iter().map(|f| escaped(f)).collect::<Vec<_>>().join(", ")));
    }
    items
}

/// Position of the worst texel.
fn place(worst: &Worst) -> String {
    let [x, y, z] = worst.at;
    format!("at ({x}, {y}, {z}) of {}, channel {}", escaped(&worst.output), worst.channel)
}

fn beyond(worst: &Worst) -> String {
    let share = 100.0 * worst.beyond as f64 / worst.texels.max(1) as f64;
    format!("{} of {} texels ({} %)", worst.beyond, worst.texels, number(share))
}

/// The last line of a run, without line break.
pub fn summary(run: &Run) -> String {
    let device = &run.device;
    let validation = if run.validation { ", validation layer watching" } else { "" };
    format!(
        "passed {}, failed {}, left out {} in {} on {}, {}, Vulkan {} ({}{validation})",
        run.count(Verdict::Passed),
        run.count(Verdict::Failed),
        run.count(Verdict::LeftOut),
        seconds(run.seconds),
        escaped(&device.name),
        escaped(&device.driver),
        escaped(&device.api),
        run.level.word(),
    )
}

/// Changes since an earlier run, the worst first, in lines. Changes that fail the run are all listed; of the others only some, with
/// the number of the rest.
pub fn comparison(compared: &BaselineComparison) -> String {
    let mut text = format!("compared with {}\n", compared.baseline);
    for line in compared.differences.iter().chain(&compared.notes) {
        let _ = writeln!(text, "{line}");
    }
    for class in Class::ALL {
        let changes: Vec<_> = compared.changes.iter().filter(|c| c.class == class).collect();
        let listed = if class == Class::Worse { changes.len() } else { changes.len().min(MAX_CHANGES) };
        if listed > 0 {
            let _ = writeln!(text, "{}:", class.word());
        }
        for change in &changes[..listed] {
            let _ = writeln!(text, "  {change}");
        }
        if listed < changes.len() {
            let _ = writeln!(text, "  and {} more", changes.len() - listed);
        }
    }
    let _ = writeln!(text, "{}", compared.conclusion());
    text
}
