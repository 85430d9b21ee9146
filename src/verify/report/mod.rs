//! The result of `echolume verify`: every check with its errors, times and faults, and the device it ran on. Reports as JSON and as text
//! for a terminal are here; JUnit XML and HTML have modules of their own. No code here uses a device.
//!
//! The text has lines of groups, failures, the summary, and the comparison with a baseline. Numbers with units have as many digits as a
//! reader needs.

pub mod baseline;
pub mod html;
pub mod junit;
pub mod prometheus;

use crate::baselines::Stored;
use crate::machine::Device;
use crate::passes::Texels;
use crate::picture::Picture;
use crate::profile::statistics::{Sample, SampleError};
use crate::text::escaped;
use crate::tree::{FromNode, Name, ToNode};
use baseline::{BaselineComparison, Class};
use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::hash::Hash;
use std::time::Duration;

/// How thoroughly a device is checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, FromNode, Name, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Level {
    /// For CI: every pass, mode and path once.
    Quick,
    /// Every pass on noise in every scene that needs it, on the other kinds of input once for each different dispatch, and a stress test of some
    /// minutes.
    Full,
}

/// One run of `echolume verify` on one device.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Run {
    /// The name of the file format: [`Stored::FORMAT`].
    pub format: String,
    /// Name, version and build of the program.
    pub program: String,
    /// When the run ended, RFC 3339.
    pub date: String,
    pub device: Device,
    pub level: Level,
    /// True if the validation layer with synchronization validation was active and, if that was tried, detected a missing barrier.
    pub validation: bool,
    /// Duration of the run, s.
    pub seconds: f64,
    /// The outcomes in running order.
    pub outcomes: Vec<Outcome>,
}

impl Run {
    /// The outcomes of the checks that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|o| o.verdict == Verdict::Failed)
    }

    /// The outcomes of the checks that failed at first and passed when they were run again.
    pub(crate) fn flaky(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().filter(|o| o.failed_before > 0)
    }

    /// True if the device could not be started, so that no check was run.
    pub fn is_unstarted(&self) -> bool {
        self.outcomes.iter().any(|o| o.group == START)
    }

    /// Number of outcomes with this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.outcomes.iter().filter(|o| o.verdict == verdict).count()
    }

    /// The outcomes by group; groups are in the order in which they first ran.
    pub fn groups(&self) -> Vec<(&str, Vec<&Outcome>)> {
        grouped(self.outcomes.iter().map(|outcome| (outcome.group.as_str(), outcome)))
    }
}

/// Values by their keys, which are in the order in which they first occur.
fn grouped<K: Clone + Eq + Hash, V>(pairs: impl IntoIterator<Item = (K, V)>) -> Vec<(K, Vec<V>)> {
    let mut places = HashMap::new();
    let mut groups: Vec<(K, Vec<V>)> = Vec::new();
    for (key, value) in pairs {
        let place = *places.entry(key.clone()).or_insert(groups.len());
        match groups.get_mut(place) {
            Some((_, values)) => values.push(value),
            None => groups.push((key, vec![value])),
        }
    }
    groups
}

/// The result of running one check.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Outcome {
    /// Group of checks: `passes`, `modes`, `known answers` ...
    pub group: String,
    /// Name of the check, unique in its group and the same in every run of this version.
    pub name: String,
    pub verdict: Verdict,
    /// Duration by the clock of the host, s; it includes the computation of the reference.
    pub seconds: f64,
    /// Measured errors and times.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
    /// Remarks, such as the reason why the check was skipped, and fallbacks that were used.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// How often the check failed before it passed. If it is not 0, the check is flaky.
    #[tree(default, skip_serializing_if = "is_zero")]
    pub failed_before: u32,
    /// Comparison pictures, also those of passed checks.
    #[tree(skip)]
    pub pictures: Vec<PictureComparison>,
}

/// Names a check by its group and its name.
#[derive(Clone, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct CheckName {
    pub group: String,
    /// Name of the check, unique in its group.
    pub name: String,
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(rename_all = "kebab-case")]
pub enum Verdict {
    Passed,
    Failed,
    /// Not run, because this device or system lacks something that the notes name.
    LeftOut,
    /// Not run, or not to its end, because a signal ended the run. It says nothing about the device.
    Interrupted,
}

/// A number that a check measured.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Figure {
    /// Name of the number, unique in its check.
    pub what: String,
    /// The measured number: an error (the largest), a count, a time (the median of `samples`, if there are any) or a share. NaN if the output was
    /// NaN.
    #[tree(with = "any_number")]
    pub value: f64,
    /// The largest value that passes. None if every value passes.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub allowed: Option<f64>,
    pub unit: Unit,
    /// The single measurements in their order: times of which `value` is the median, or shares of which `value` is the largest. Empty for errors,
    /// counts, and times that were measured once.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub samples: Vec<f64>,
    /// True if the figure depends on circumstances of the run and not on the device. It is reported, but not compared with a baseline.
    #[tree(default, skip_serializing_if = "std::ops::Not::not")]
    pub fleeting: bool,
}

/// Unit of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode, FromNode)]
#[tree(rename_all = "kebab-case")]
pub enum Unit {
    /// The unit of the compared output: mm for distances, 1 for values from 0 to 1.
    Value,
    /// Levels of a picture of 8 bits.
    Levels,
    Millimetres,
    /// Nanoseconds.
    Ns,
    /// A share, 0..1.
    Share,
    Count,
}

/// A fault that a check found in the device.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Fault {
    /// One line that describes the fault.
    pub what: String,
    /// The pass that computes wrongly, if known.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub pass: Option<String>,
    /// Description of the input with which it occurred.
    #[tree(default, skip_serializing_if = "String::is_empty")]
    pub input: String,
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub worst: Option<Worst>,
    /// Names of the picture files once they are written: actual, expected, difference.
    #[tree(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
}

/// The texel with the largest error.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Worst {
    /// Name of the output, as in the shader.
    pub output: String,
    /// Position of the texel: column, row, slice.
    pub at: [usize; 3],
    pub channel: usize,
    #[tree(with = "any_number")]
    pub expected: f64,
    #[tree(with = "any_number")]
    pub got: f64,
    /// Number of values of the output that are beyond tolerance; a texel has one for each channel.
    pub beyond: usize,
    /// Number of all values of the output.
    pub texels: usize,
}

/// An actual picture, the expected one, and their difference.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
pub struct PictureComparison {
    /// Short description of what is compared.
    pub what: String,
    #[tree(with = "encoded")]
    pub actual: Picture,
    #[tree(with = "encoded")]
    pub expected: Picture,
    /// The absolute difference of each channel, multiplied by `gain`; alpha is 255.
    #[tree(with = "encoded")]
    pub difference: Picture,
    pub gain: u32,
    /// Index in [`Outcome::faults`] of the fault that the pictures show; None if they show none.
    pub fault: Option<usize>,
}

impl Worst {
    /// A value of an output. `index`: of the value in the texels of the expected output, `values`; the number beyond tolerance is 0.
    pub(crate) fn of(output: &str, values: &Texels, index: usize, [expected, got]: [f64; 2]) -> Worst {
        let (texel, [w, h, _]) = (index / values.channels, values.size);
        let at = [texel % w, texel / w % h, texel / w / h];
        let (channel, texels) = (index % values.channels, values.values.len());
        Worst { output: output.into(), at, channel, expected, got, beyond: 0, texels }
    }
}

impl Fault {
    /// A fault of which only a description is known.
    pub fn new(what: impl Into<String>) -> Fault {
        Fault { what: what.into(), pass: None, input: String::new(), worst: None, files: Vec::new() }
    }
}

impl Figure {
    /// The figure of an error, with the largest value that passes.
    pub fn error(what: impl Into<String>, value: f64, allowed: f64, unit: Unit) -> Figure {
        Figure { what: what.into(), value, allowed: Some(allowed), unit, samples: Vec::new(), fleeting: false }
    }

    /// A figure without a limit.
    pub(crate) fn informative(what: impl Into<String>, value: f64, unit: Unit) -> Figure {
        Figure { allowed: None, ..Figure::error(what, value, 0.0, unit) }
    }

    /// The figure of times, ns, of the same work in the order of measurement.
    ///
    /// # Errors
    /// There is no time, or one is not finite.
    pub fn times(what: impl Into<String>, samples: Vec<f64>) -> Result<Figure, SampleError> {
        let value = Sample::new(&samples)?.median();
        Ok(Figure { samples, ..Figure::informative(what, value, Unit::Ns) })
    }

    /// The figure of a time that was measured once. A comparison with a baseline reports it only if it changed by a factor above 3 and by more than
    /// 0.1 s.
    pub fn single_time(what: impl Into<String>, time: Duration) -> Figure {
        Figure::informative(what, time.as_nanos() as f64, Unit::Ns)
    }

    /// True for the figure of a time that was measured once.
    pub(crate) fn is_single_time(&self) -> bool {
        self.unit == Unit::Ns && self.samples.is_empty()
    }

    /// The value divided by its limit; above 1 the limit is exceeded. NaN gives infinity, and so does a value above a limit of 0. None without a
    /// limit.
    pub fn used(&self) -> Option<f64> {
        let allowed = self.allowed?;
        Some(match self.value {
            value if value <= 0.0 && value <= allowed => 0.0,
            value if value.is_nan() || allowed <= 0.0 => f64::INFINITY,
            value => value / allowed,
        })
    }
}

impl Outcome {
    /// An outcome with nothing measured, found or noted, after 0 s.
    pub(crate) fn new(CheckName { group, name }: CheckName, verdict: Verdict) -> Outcome {
        let (figures, faults, notes, pictures) = Default::default();
        Outcome { group, name, verdict, seconds: 0.0, figures, faults, notes, failed_before: 0, pictures }
    }

    /// The outcome of a check that was not run. `why`: the fault if the verdict is failed, otherwise a note.
    pub(crate) fn unrun(check: &CheckName, verdict: Verdict, why: String) -> Outcome {
        let (faults, notes) = match verdict {
            Verdict::Failed => (vec![Fault::new(why)], Vec::new()),
            _ => (Vec::new(), vec![why]),
        };
        Outcome { faults, notes, ..Outcome::new(check.clone(), verdict) }
    }

    /// Runs a check that failed again, to find the cause. `again` runs it once more; `waiting` runs it while the host waits for each submission
    /// before it makes the next. A check that passes in `again` is flaky. One that passes only in `waiting` lacks synchronization.
    pub(crate) fn explained(self, mut again: impl FnMut() -> Outcome, waiting: impl FnOnce() -> Outcome) -> Outcome {
        let first = self.faults.first().map_or_else(String::new, |fault| format!(": {}", fault.what));
        for failed in 1..=RERUNS {
            let next = again();
            match next.verdict {
                Verdict::Failed => {}
                Verdict::Passed => {
                    let note = format!("flaky: it failed {failed} of {} times{first}", failed + 1);
                    let notes = [vec![note], next.notes].concat();
                    return Outcome { notes, failed_before: failed, seconds: self.seconds + next.seconds, ..next };
                }
                _ => return self,
            }
        }
        let mut outcome = self;
        if waiting().verdict == Verdict::Passed {
            outcome.notes.push(
                "it passes while the host waits for each submission before the next: synchronization is the likely cause".into(),
            );
        }
        outcome
    }

    /// The figure that is closest to its limit, or exceeds it most. None if no figure has a limit.
    pub fn tightest(&self) -> Option<&Figure> {
        let used = self.figures.iter().filter_map(|f| Some((f, f.used()?)));
        used.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(figure, _)| figure)
    }

    /// The name of the check that this is the outcome of.
    pub fn check(&self) -> CheckName {
        CheckName { group: self.group.clone(), name: self.name.clone() }
    }

    /// Group and name of the check, as text.
    pub fn title(&self) -> String {
        format!("{} / {}", escaped(&self.group), escaped(&self.name))
    }
}

impl Verdict {
    /// All verdicts, in the order in which reports count them. Every outcome has exactly one, so that the counts add up.
    pub const ALL: [Verdict; 4] = [Verdict::Passed, Verdict::Failed, Verdict::LeftOut, Verdict::Interrupted];

    pub fn word(self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed => "failed",
            Verdict::LeftOut => "left out",
            Verdict::Interrupted => "interrupted",
        }
    }
}

/// Maximum number of outcomes of a run in a file.
pub const MAX_OUTCOMES: usize = 100_000;
/// Maximum number of times of one figure in a file.
pub const MAX_SAMPLES: usize = 100_000;

/// Names are unique, lists bounded, and times and limits finite. Errors and values may be anything, since NaN from a device is a valid
/// finding. Pictures are not written.
impl Stored for Run {
    const FORMAT: &'static str = "echolume-verify-1";
    const WHAT: &'static str = "a verification";
    const AGAIN: &'static str = "verify again with it";
    const KIND: &'static str = "--json of verify";
    const MAX_BYTES: u64 = 256 << 20;

    fn fault(&self) -> Option<(String, String)> {
        if let Some(fault) = not_a_time(self.seconds) {
            return Some(("seconds".into(), fault));
        }
        if let Some(fault) = not_a_time(self.device.timestamp_period_ns) {
            return Some(("timestamp_period_ns".into(), fault));
        }
        if self.outcomes.len() > MAX_OUTCOMES {
            let count = self.outcomes.len();
            return Some(("outcomes".into(), format!("are {count}, of which at most {MAX_OUTCOMES} are read")));
        }
        let mut names = HashSet::new();
        for (at, outcome) in self.outcomes.iter().enumerate() {
            if outcome.group.is_empty() || outcome.name.is_empty() {
                return Some((format!("outcome {at}"), "has no group or no name".into()));
            }
            if !names.insert((&outcome.group, &outcome.name)) {
                return Some((outcome.title(), "is there twice".into()));
            }
            if let Some(fault) = outcome_fault(outcome) {
                return Some((outcome.title(), fault));
            }
        }
        None
    }
}

fn not_a_time(value: f64) -> Option<String> {
    (!(value.is_finite() && value >= 0.0)).then(|| format!("{value} is not finite and at least 0"))
}

fn outcome_fault(outcome: &Outcome) -> Option<String> {
    let seconds = not_a_time(outcome.seconds).map(|fault| format!("seconds: {fault}"));
    let mut names = HashSet::new();
    let figure = |figure: &Figure| {
        if !names.insert(figure.what.clone()) {
            return Some(format!("figure '{}' is there twice", escaped(&figure.what)));
        }
        figure_fault(figure).map(|fault| format!("figure '{}' {fault}", escaped(&figure.what)))
    };
    let worst = |worst: &Worst| {
        let Worst { beyond, texels, .. } = worst;
        (beyond > texels).then(|| format!("{beyond} values beyond their tolerance, of {texels}"))
    };
    seconds
        .or_else(|| outcome.figures.iter().find_map(figure))
        .or_else(|| outcome.faults.iter().filter_map(|f| f.worst.as_ref()).find_map(worst))
}

fn figure_fault(figure: &Figure) -> Option<String> {
    if let Some(allowed) = figure.allowed.filter(|a| !a.is_finite()) {
        return Some(format!("allows {allowed}, which is not finite; where any value passes nothing is written"));
    }
    let count = figure.samples.len();
    if count > MAX_SAMPLES {
        return Some(format!("has {count} samples, of which at most {MAX_SAMPLES} are read"));
    }
    let sample = |(at, value): (usize, &f64)| Some(format!("sample {at}: {}", not_a_time(*value)?));
    figure.samples.iter().enumerate().find_map(sample)
}

/// Numbers that may not be finite. JSON has no such numbers: they are the strings `NaN`, `Infinity` and `-Infinity`.
mod any_number {
    use crate::tree::{FromNode, Node, NodeError, ToNode};

    pub fn to_node(value: &f64) -> Node {
        match value {
            v if v.is_nan() => "NaN".to_node(),
            v if v.is_infinite() && *v > 0.0 => "Infinity".to_node(),
            v if v.is_infinite() => "-Infinity".to_node(),
            v => v.to_node(),
        }
    }

    pub fn from_node(node: Node) -> Result<f64, NodeError> {
        let word = String::from_node(node.clone());
        match word.as_deref() {
            Ok("NaN") => Ok(f64::NAN),
            Ok("Infinity") => Ok(f64::INFINITY),
            Ok("-Infinity") => Ok(f64::NEG_INFINITY),
            _ => f64::from_node(node.clone())
                .map_err(|_| node.invalid("a number, \"NaN\", \"Infinity\" or \"-Infinity\"")),
        }
    }
}

/// Pictures as their size and their pixels in base64. One that was damaged on its way is empty: the outcome counts without it.
mod encoded {
    use crate::picture::Picture;
    use crate::tree::{FromNode, Node, NodeError, ToNode};
    use base64::Engine as _;
    use base64::prelude::BASE64_STANDARD;

    pub fn to_node(picture: &Picture) -> Node {
        ((picture.width, picture.height), BASE64_STANDARD.encode(&picture.rgba)).to_node()
    }

    pub fn from_node(node: Node) -> Result<Picture, NodeError> {
        let ((width, height), text) = <((u32, u32), String)>::from_node(node)?;
        let rgba = BASE64_STANDARD.decode(text).unwrap_or_default();
        let is_whole = rgba.len() as u64 == 4 * u64::from(width) * u64::from(height);
        Ok(if is_whole { Picture { width, height, rgba } } else { Picture { width: 0, height: 0, rgba: Vec::new() } })
    }
}

/// The name of the group of the outcome that tells that a device could not be started.
pub(crate) const START: &str = "start";

/// How often a check that failed is run once more.
const RERUNS: u32 = 3;

fn is_zero(count: &u32) -> bool {
    *count == 0
}

/// Maximum number of changes of a class that are listed, except those that fail the run.
const MAX_CHANGES: usize = 40;

/// A line on a group, without line break: verdicts, duration, and the check that is closest to its tolerance.
pub fn group_line(group: &str, outcomes: &[&Outcome]) -> String {
    let count = |verdict| outcomes.iter().filter(|o| o.verdict == verdict).count();
    let mut line = format!("{:<18} {}", escaped(group), counts(Verdict::ALL.map(count)));
    let _ = write!(line, " in {}", seconds(outcomes.iter().map(|o| o.seconds).sum()));
    let passed = outcomes.iter().filter(|o| o.verdict == Verdict::Passed);
    let used = passed.filter_map(|o| Some((o, o.tightest()?.used()?))).filter(|(_, used)| *used > 0.0);
    if let Some((outcome, used)) = used.reduce(|a, b| if b.1 > a.1 { b } else { a }) {
        let _ = write!(line, "; nearest to its tolerance: {}, {}", escaped(&outcome.name), percent(used));
    }
    line
}

/// Numbers of checks by verdict, in the order of [`Verdict::ALL`]; zeros are omitted.
fn counts(of: [usize; 4]) -> String {
    let texts = of
        .iter()
        .zip(Verdict::ALL.map(Verdict::word))
        .filter(|(count, _)| **count > 0)
        .map(|(count, word)| format!("{count} {word}"));
    let texts: Vec<String> = texts.collect();
    if texts.is_empty() { "no checks".into() } else { texts.join(", ") }
}

/// The report of a failed check, one line per item, each with line break.
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
fn fault_items(fault: &Fault) -> Vec<(&'static str, String)> {
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
    format!("{} of {} values ({} %)", worst.beyond, worst.texels, number(share))
}

/// The last line of a run, without line break.
pub fn summary(run: &Run) -> String {
    let device = &run.device;
    let validation = if run.validation { ", validation layer watching" } else { "" };
    let interrupted = match run.count(Verdict::Interrupted) {
        0 => String::new(),
        count => format!(", interrupted {count}"),
    };
    let flaky = match run.flaky().count() {
        0 => String::new(),
        count => format!(" (flaky: {count})"),
    };
    format!(
        "passed {}{flaky}, failed {}, left out {}{interrupted} in {} on {}, {}, Vulkan {} ({}{validation})",
        run.count(Verdict::Passed),
        run.count(Verdict::Failed),
        run.count(Verdict::LeftOut),
        seconds(run.seconds),
        escaped(&device.name),
        escaped(&device.driver),
        escaped(&device.api),
        run.level.name(),
    )
}

/// Lines on the changes since the baseline, the worst first. All changes that fail the run are listed; of the others only some, with the number of
/// the rest.
pub fn comparison(compared: &BaselineComparison) -> String {
    let mut text = format!("compared with {}\n", compared.baseline);
    for line in compared.differences.iter().chain(&compared.notes) {
        let _ = writeln!(text, "{line}");
    }
    for class in Class::ALL {
        let changes: Vec<_> = compared.changes.iter().filter(|c| c.class == class).collect();
        let listed = if class == Class::Worse { changes.len() } else { changes.len().min(MAX_CHANGES) };
        if listed > 0 {
            let _ = writeln!(text, "{}:", class.name());
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

/// Significant digits.
const DIGITS: usize = 3;
/// Significant digits that distinguish all f64.
const MAX_DIGITS: usize = 17;

/// A number with three significant digits, in scientific notation if it is very large or very small.
pub fn number(value: f64) -> String {
    to_digits(value, DIGITS)
}

fn to_digits(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "NaN".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "infinity".into() } else { "-infinity".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let power = value.abs().log10().floor() as i32;
    let trimmed = |text: String| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    };
    if (-3..6).contains(&power) {
        let decimals = (digits as i32 - 1 - power).max(0) as usize;
        return trimmed(format!("{value:.decimals$}"));
    }
    let text = format!("{value:.*e}", digits - 1);
    match text.split_once('e') {
        Some((mantissa, power)) => format!("{}e{power}", trimmed(mantissa.into())),
        None => text,
    }
}

/// The factor and the suffix with which values of a unit are printed.
fn scale(unit: Unit, largest: f64) -> (f64, &'static str) {
    match unit {
        Unit::Value | Unit::Count => (1.0, ""),
        Unit::Levels => (1.0, " levels"),
        Unit::Millimetres => (1.0, " mm"),
        Unit::Share => (100.0, " %"),
        Unit::Ns if largest >= 1e9 => (1e-9, " s"),
        Unit::Ns if largest >= 1e6 => (1e-6, " ms"),
        Unit::Ns if largest >= 1e3 => (1e-3, " us"),
        Unit::Ns => (1.0, " ns"),
    }
}

/// A value times a factor with this many significant digits; counts with all digits.
fn shown(value: f64, unit: Unit, factor: f64, digits: usize) -> String {
    match unit {
        Unit::Count if value.fract() == 0.0 && value.abs() < 1e15 => format!("{value:.0}"),
        _ => to_digits(value * factor, digits),
    }
}

/// A value with its unit, as text.
pub fn amount(value: f64, unit: Unit) -> String {
    let (factor, word) = scale(unit, value);
    match shown(value, unit, factor, DIGITS) {
        one if one == "1" && unit == Unit::Levels => "1 level".into(),
        shown => shown + word,
    }
}

/// Two values with enough digits to distinguish them, and their unit.
fn distinguishable(values: [f64; 2], unit: Unit) -> ([String; 2], &'static str) {
    let (factor, word) = scale(unit, values[0].abs().max(values[1].abs()));
    let with = |digits| values.map(|v| shown(v, unit, factor, digits));
    let texts = (DIGITS..=MAX_DIGITS).map(with).find(|[a, b]| a != b || values[0] == values[1]);
    (texts.unwrap_or_else(|| with(DIGITS)), word)
}

/// The expected and the actual value as text, with enough digits to tell them apart.
pub fn expected_and_got(expected: f64, got: f64) -> [String; 2] {
    distinguishable([expected, got], Unit::Value).0
}

/// Two values with their unit, as text: `0.8 -> 1.9 levels`.
pub fn change(old: f64, new: f64, unit: Unit) -> String {
    let ([old, new], word) = distinguishable([old, new], unit);
    format!("{old} -> {new}{word}")
}

/// The value of a figure with its limit, as text: `0.8 of 2 levels`.
pub fn value_of_limit(figure: &Figure) -> String {
    let Some(allowed) = figure.allowed else { return amount(figure.value, figure.unit) };
    let ([value, allowed], word) = distinguishable([figure.value, allowed], figure.unit);
    let word = if allowed == "1" && figure.unit == Unit::Levels { " level" } else { word };
    format!("{value} of {allowed}{word}")
}

/// A share (0..1) as text in whole per cent. It is 100 only if the share is exactly 1.
pub fn percent(share: f64) -> String {
    match share {
        s if !s.is_finite() || s >= 100.0 => "over 9999 %".into(),
        s if s > 1.0 => format!("{:.0} %", (s * 100.0).ceil()),
        s if s > 0.0 && s < 0.01 => "under 1 %".into(),
        s if s < 1.0 => format!("{:.0} %", (s * 100.0).floor()),
        _ => "100 %".into(),
    }
}

/// A duration in s, as text.
pub fn seconds(s: f64) -> String {
    match s {
        s if s >= 3600.0 => format!("{} h {} min", (s / 3600.0) as u64, ((s % 3600.0) / 60.0) as u64),
        s if s >= 120.0 => format!("{} min {} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s if s >= 10.0 => format!("{s:.0} s"),
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 0.001 => format!("{:.0} ms", s * 1e3),
        s if s > 0.0 => "under 1 ms".into(),
        _ => "0 s".into(),
    }
}
