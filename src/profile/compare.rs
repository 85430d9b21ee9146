//! Two profiles of the same work: which passes became faster, which slower, and which differ by no more than the machine does
//! from itself.
//!
//! Times of neighbouring repeats resemble each other (clocks, heat, other programs), so a rank test on the bare samples calls
//! identical runs different far too often. Hence two hurdles, both of which a difference must take:
//!
//! 1. Each series is cut into a few blocks, and the Mann-Whitney test compares the logarithms of the blocks' medians; its p
//!    values are corrected by Holm over all lines, so that one false alarm in the whole report is rare.
//! 2. The Hodges-Lehmann shift must exceed the floor: what the medians of the blocks of one run range over by themselves.
//!    A line whose blocks happen to lie close together does not count as steadier than the device: the floor is at least the
//!    range of the typical pass (median over the passes, weighted by their time), and one tick of the clock a dispatch.
//!
//! What no test on two runs can see: conditions that held all through one run and not the other. A common shift of all passes
//! is pointed out for that reason.

use super::differences::Differences;
use super::statistics::SampleError;
use super::{PassProfile, Profile, ProfileError, judgement};
use serde::Serialize;

#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// A pass that is slower by more than this ratio of medians is a regression; above 1.
    pub threshold: f64,
    /// Probability of any false alarm in the whole report, 0..1.
    pub alpha: f64,
    /// Compare although the profiles ran different work.
    pub force: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { threshold: 1.05, alpha: 0.05, force: false }
    }
}

#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error("{which} profile: {fault}")]
    Profile { which: &'static str, fault: ProfileError },
    #[error("the profiles ran different work ({}); profile the same, or pass --force", .0.join("; "))]
    DifferentWork(Vec<String>),
    #[error("times: {fault}")]
    Times { fault: SampleError },
    #[error("{field}: {value} {fault}")]
    Option { field: &'static str, value: f64, fault: &'static str },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    Faster,
    Slower,
    WithinNoise,
    New,
    Gone,
    NotComparable,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    Pass,
    /// A span of the host; told, and never a regression: such spans are short, and part of the wall time.
    Host,
    /// From submit to idle.
    Wall,
}

/// New over old; below 1 is faster.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    pub estimate: f64,
    /// The interval of this line by itself, not corrected for the other lines.
    pub low: f64,
    pub high: f64,
    pub coverage: f64,
    /// Uncorrected, and by Holm over all lines.
    pub p: f64,
    pub p_holm: f64,
    /// By what ratio (at least 1) the runs differ from themselves: a smaller difference is noise.
    pub floor: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    pub name: String,
    pub stage: String,
    pub kind: Kind,
    pub verdict: Verdict,
    /// Medians, ns.
    pub old_ns: Option<f64>,
    pub new_ns: Option<f64>,
    /// Where there was something to compare.
    pub ratio: Option<Ratio>,
    /// Why it is not comparable, or what else to know.
    pub note: Option<String>,
    /// Slower by more than the threshold.
    pub is_regression: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    pub format: &'static str,
    /// The test, in words.
    pub test: String,
    pub threshold: f64,
    pub notes: Vec<String>,
    pub lines: Vec<Line>,
}

impl Comparison {
    pub fn regressions(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(|l| l.is_regression)
    }
}

/// Passes in the order of the new profile, then those gone, the host's spans, the wall time.
pub fn compare(old: &Profile, new: &Profile, options: &Options) -> Result<Comparison, CompareError> {
    let refuse = |field, value, fault| Err(CompareError::Option { field, value, fault });
    if !(options.threshold.is_finite() && options.threshold >= 1.0) {
        return refuse("--threshold", options.threshold, "is not a ratio of at least 1 (1.05 is five percent slower)");
    }
    if !(options.alpha > 0.0 && options.alpha < 1.0) {
        return refuse("alpha", options.alpha, "is not a probability between 0 and 1");
    }
    for (which, profile) in [("old", old), ("new", new)] {
        profile.check().map_err(|fault| CompareError::Profile { which, fault })?;
    }
    let differences = Differences::between(old, new);
    if !differences.work.is_empty() && !options.force {
        return Err(CompareError::DifferentWork(differences.work));
    }
    let pairs = pairs(old, new);
    let both = pairs.iter().filter(|p| p.old.is_some() && p.new.is_some()).count();
    let blocks = judgement::blocks(both, options.alpha);
    let tick = old.device.timestamp_period_ns.max(new.device.timestamp_period_ns);
    let lines = judgement::lines(pairs, blocks, tick, options).map_err(|fault| CompareError::Times { fault })?;
    let mut notes = differences.work;
    notes.extend(differences.conditions);
    notes.extend(judgement::common_shift(&lines));
    let test = format!(
        "Mann-Whitney on the medians of {blocks} blocks a run, Holm over {both} lines at {:.0} %, and a shift beyond what the \
         blocks of a run range over",
        options.alpha * 100.0
    );
    Ok(Comparison { format: "echolume-comparison-1", test, threshold: options.threshold, notes, lines })
}

/// The times of one line in one run.
#[derive(Clone, Copy)]
pub(crate) struct Series<'a> {
    pub stage: &'a str,
    pub runs: u32,
    pub times: &'a [f64],
}

/// A line, in the runs that have it.
pub(crate) struct Pair<'a> {
    pub kind: Kind,
    pub name: &'a str,
    pub old: Option<Series<'a>>,
    pub new: Option<Series<'a>>,
}

fn pairs<'a>(old: &'a Profile, new: &'a Profile) -> Vec<Pair<'a>> {
    let series = |list: &'a [PassProfile], name: &str| {
        let found = list.iter().find(|p| p.name == name)?;
        Some(Series { stage: &found.stage, runs: found.runs_per_picture, times: &found.samples_ns })
    };
    let mut pairs = Vec::new();
    for (kind, old, new) in [(Kind::Pass, &old.passes, &new.passes), (Kind::Host, &old.host, &new.host)] {
        let gone = old.iter().filter(|p| series(new, &p.name).is_none());
        for name in new.iter().chain(gone).map(|p| p.name.as_str()) {
            pairs.push(Pair { kind, name, old: series(old, name), new: series(new, name) });
        }
    }
    let wall = |profile: &'a Profile| Some(Series { stage: "", runs: 1, times: &profile.wall_ns });
    pairs.push(Pair { kind: Kind::Wall, name: "wall", old: wall(old), new: wall(new) });
    pairs
}
