//! Compares two profiles of the same work: which passes became faster or slower, and which differ by no more than the noise
//! of the machine.
//!
//! Times of neighbouring repeats are correlated (clocks, heat, other programs), so a rank test on the raw samples reports
//! differences between identical runs far too often. A difference must therefore pass two tests:
//!
//! 1. Each series is cut into a few blocks. The Mann-Whitney test compares the logarithms of the block medians. Its p values
//!    are corrected by Holm over all lines, so that a false alarm anywhere in the report is rare.
//! 2. The Hodges-Lehmann shift must exceed the noise floor, which is the range of the block medians within one run. A line
//!    whose blocks happen to be close together is not steadier than the device: the floor is at least the range of the typical
//!    pass (median over the passes, weighted by their time) and one clock tick per dispatch.
//!
//! [`in_turn`] compares runs whose repeats were measured in turn, A B B A: neighbours had the same conditions, so that what both runs share is no noise.
//! Each block, which is a pair of processes, has the median of the ratios of its neighbours, and these are tested (Wilcoxon's signed ranks).
//!
//! What is not called slower is not therefore as fast: [`Line::limit`] is the smallest slowdown that would have been called so.
//!
//! On a device that is the CPU the CPU time of each pass is compared: it varies less with the load of the machine.
//!
//! No test on two runs can detect conditions that held during one whole run and not the other. A common shift of all passes
//! is reported for that reason.

use super::statistics::{
    Sample, SampleError, Shift, block_medians, hodges_lehmann, holm, mann_whitney, min_p, min_signed_p, paired_shift,
    signed_rank,
};
use super::{LEVEL, PassProfile, Profile};
use crate::baselines::{Stored, Threshold, differing, matched};
use crate::tree::ToNode;
use std::collections::{BTreeMap, BTreeSet};
use toml::{Table, Value};

/// What counts as a difference in a comparison of profiles.
#[derive(Clone, Copy, Debug)]
pub struct CompareOptions {
    /// Largest allowed ratio of new times to old ones ([`Ratio::estimate`]). A pass, or the wall or CPU time, that is slower by more is a regression.
    pub threshold: Threshold,
    /// Probability, 0..1, of at least one false alarm in the whole report.
    pub alpha: f64,
    /// Passes whose share of the time of all passes (0..1) is below this may hide a slowdown without failing the comparison.
    pub minor: f64,
    /// True: compare even if the profiles ran different work.
    pub force: bool,
}

impl Default for CompareOptions {
    fn default() -> CompareOptions {
        CompareOptions { threshold: Threshold::default(), alpha: 0.05, minor: 0.0, force: false }
    }
}

/// Why two profiles cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error("{which} profile: {fault}")]
    Profile { which: &'static str, fault: String },
    #[error("the profiles ran different work ({}); profile the same, or pass --force", .0.join("; "))]
    DifferentWork(Vec<String>),
    #[error("times: {fault}")]
    Times { fault: SampleError },
    #[error("alpha: {0} is not a probability between 0 and 1")]
    Alpha(f64),
    #[error("minor: {0} is not a share from 0 to 1")]
    Minor(f64),
}

/// Result of the comparison of one line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Verdict {
    Faster,
    Slower,
    WithinNoise,
    New,
    Gone,
    NotComparable,
}

/// What a line's times are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Kind {
    Pass,
    /// A span of the host, or the wall time where CPU times are compared. It is reported, but is never a regression.
    Host,
    /// Wall time of a repeat, from its first frame to its picture in host memory.
    Wall,
    /// CPU time of all threads of the process, from the first frame of a repeat to its picture in host memory.
    Cpu,
}

/// Ratio of the new times to the old ones; below 1 is faster.
#[derive(Clone, Copy, Debug, PartialEq, ToNode)]
pub struct Ratio {
    pub estimate: f64,
    /// Confidence interval of the ratio (`low`, `high`), of this line alone and not corrected for the other lines.
    pub low: f64,
    pub high: f64,
    pub coverage: f64,
    /// p value of the test, not corrected for the other lines.
    pub p: f64,
    /// p value after Holm's correction over all lines.
    pub p_holm: f64,
    /// Noise floor as a ratio, at least 1: a change by a smaller factor, up or down, is noise.
    pub floor: f64,
}

/// The comparison of one pass, host span, or of the wall or CPU time.
#[derive(Clone, Debug, PartialEq, ToNode)]
pub struct Line {
    pub name: String,
    pub stage: String,
    pub kind: Kind,
    pub verdict: Verdict,
    /// Median of the old profile, ns. None if it lacks the line or has no times for it.
    pub old_ns: Option<f64>,
    /// Median of the new profile, ns. None if it lacks the line or has no times for it.
    pub new_ns: Option<f64>,
    /// How the times differ. None if there was nothing to compare.
    pub ratio: Option<Ratio>,
    /// Why the line is not comparable, or another remark.
    pub note: Option<String>,
    /// True if the verdict is slower, by more than the threshold. Always false for [`Kind::Host`].
    pub is_regression: bool,
    /// The smallest slowdown, as a ratio, that would have been detected with this noise. None if none would, or there was nothing to compare.
    pub limit: Option<f64>,
    /// True if a slowdown by more than the threshold may have been overlooked. Always false for [`Kind::Host`].
    pub is_unseen: bool,
    /// True for a compared pass whose share of the time is below [`CompareOptions::minor`], so that `is_unseen` does not fail the comparison.
    pub is_minor: bool,
}

/// The comparison of two profiles.
#[derive(Clone, Debug, PartialEq, ToNode)]
pub struct Comparison {
    pub format: &'static str,
    /// Which times are compared, in words.
    pub time: &'static str,
    /// The statistical test that was used, in words.
    pub test: String,
    /// Largest allowed ratio of new times to old ones.
    pub threshold: f64,
    /// Differing settings and conditions, and what else to know about the comparison, one line each.
    pub notes: Vec<String>,
    pub lines: Vec<Line>,
}

impl Comparison {
    /// The lines with `is_regression`.
    pub fn regressions(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().filter(|l| l.is_regression)
    }

    /// Why a slowdown by more than the threshold cannot be excluded, in one line: up to which size one may have been overlooked, and up to four of
    /// the lines that may hide one, each with its limit. Lines with `is_minor` do not count. None if every such slowdown would have been detected.
    pub fn cannot_tell(&self) -> Option<String> {
        let (worst, named) = hidden(self.lines.iter().filter(|line| line.is_unseen && !line.is_minor))?;
        Some(format!("cannot tell {worst}: {named}"))
    }
}

/// What the noise hides of these lines: the most, and where. None of none.
fn hidden<'a>(lines: impl Iterator<Item = &'a Line>) -> Option<(String, String)> {
    let mut unseen: Vec<&Line> = lines.collect();
    unseen.sort_by(|a, b| b.limit.unwrap_or(f64::MAX).total_cmp(&a.limit.unwrap_or(f64::MAX)));
    let below = |line: &Line| {
        line.limit.map_or("anything".to_string(), |limit| format!("below {:.1} %", 100.0 * (limit - 1.0)))
    };
    let listed: Vec<String> = unseen.iter().map(|line| format!("{} {}", line.name, below(line))).collect();
    let more = listed.len().saturating_sub(MAX_NAMED);
    let named = listed[..listed.len() - more].join(", ");
    let rest = if more > 0 { format!(", and {more} more") } else { String::new() };
    unseen.first().map(|worst| (below(worst), format!("{named}{rest}")))
}

/// A note of the passes that may hide a slowdown.
fn excused(lines: &[Line], options: &CompareOptions) -> Option<String> {
    let (_, named) = hidden(lines.iter().filter(|line| line.is_unseen && line.is_minor))?;
    let share = 100.0 * options.minor;
    Some(format!("passes with less than {share} % of the time may hide a slowdown: {named}"))
}

/// Most lines that [`Comparison::cannot_tell`] names.
const MAX_NAMED: usize = 4;

/// Compares two profiles. The lines are in this order: passes of the new profile, passes that only the old one has, host spans, wall time,
/// and CPU time if it is compared.
///
/// # Errors
/// An option is out of range, a profile is inconsistent, or the profiles are of different work and `force` is not set.
pub fn compare(old: &Profile, new: &Profile, options: &CompareOptions) -> Result<Comparison, CompareError> {
    compare_repeats(old, new, options, false)
}

/// Compares two profiles that were measured alternately in blocks. Each slice has one profile for each block. The times of repeat i of block n of
/// both were measured next to each other.
///
/// # Errors
/// An option is out of range, a profile has no blocks or is inconsistent, its blocks are of different work, the profiles have different numbers of
/// blocks, or they are of different work and `force` is not set.
pub fn in_turn(old: &[Profile], new: &[Profile], options: &CompareOptions) -> Result<Comparison, CompareError> {
    let [old, new] = [("old", old), ("new", new)]
        .map(|(which, blocks)| blocks_as_repeats(blocks, old).map_err(|fault| CompareError::Profile { which, fault }));
    compare_repeats(&old?, &new?, options, true)
}

/// The number of blocks of each profile that [`in_turn`] needs to detect differences of `passes` passes if all blocks agree, plus two; 10 to 100.
/// It is even, so that each profile goes first equally often. `alpha`: probability of a false alarm in the whole report.
pub fn blocks_in_turn(passes: usize, alpha: f64) -> usize {
    let lines = passes as f64 + 1.0;
    (10..100).step_by(2).find(|n| min_signed_p(n - 2) * lines <= alpha).unwrap_or(100)
}

/// The median of times; where there are as many of a neighbour, by the median of the ratios to them, and theirs.
fn median_beside(times: &[f64], neighbours: Option<Vec<f64>>) -> Option<f64> {
    let median = |list: &[f64]| Some(Sample::new(list).ok()?.median());
    let is_usable = |other: &Vec<f64>| other.len() == times.len() && times.iter().chain(other).all(|ns| *ns > 0.0);
    let Some(other) = neighbours.filter(is_usable) else { return median(times) };
    let ratios: Vec<f64> = times.iter().zip(&other).map(|(ns, other)| ns / other).collect();
    Some(median(&other)? * median(&ratios)?)
}

/// A run of one repeat for each block, with the medians of its times beside those of `neighbours`.
fn blocks_as_repeats(blocks: &[Profile], neighbours: &[Profile]) -> Result<Profile, String> {
    let Some(first) = blocks.first() else { return Err("has no blocks".into()) };
    for block in blocks {
        block.check()?;
        if work(block) != work(first) || block.scene != first.scene {
            return Err("its blocks ran different work".into());
        }
    }
    let medians = |times: &dyn Fn(&Profile) -> Option<Vec<f64>>| -> Vec<f64> {
        let each = blocks.iter().zip(neighbours).map(|(block, other)| median_beside(&times(block)?, times(other)));
        each.collect::<Option<_>>().unwrap_or_default()
    };
    let of = |block: &Profile, name: &str| block.passes.iter().find(|pass| pass.name == name).cloned();
    let in_all = |pass: &&PassProfile| blocks.iter().all(|block| of(block, &pass.name).is_some());
    let pass = |pass: &PassProfile| PassProfile {
        samples_ns: medians(&|block| Some(of(block, &pass.name)?.samples_ns)),
        cpu_ns: medians(&|block| Some(of(block, &pass.name)?.cpu_ns)),
        ..pass.clone()
    };
    Ok(Profile {
        repeats: blocks.len(),
        passes: first.passes.iter().filter(in_all).map(pass).collect(),
        host: Vec::new(),
        wall_ns: medians(&|block| Some(block.wall_ns.clone())),
        cpu_ns: medians(&|block| Some(block.cpu_ns.clone())),
        device_ns: medians(&|block| Some(block.device_ns.clone())),
        ..first.clone()
    })
}

/// `in_turn`: the n-th repeats of both runs are neighbours in time; otherwise one run came after the other.
fn compare_repeats(
    old: &Profile,
    new: &Profile,
    options: &CompareOptions,
    in_turn: bool,
) -> Result<Comparison, CompareError> {
    if !(options.alpha > 0.0 && options.alpha < 1.0) {
        return Err(CompareError::Alpha(options.alpha));
    }
    if !(0.0..=1.0).contains(&options.minor) {
        return Err(CompareError::Minor(options.minor));
    }
    for (which, profile) in [("old", old), ("new", new)] {
        profile.check().map_err(|fault| CompareError::Profile { which, fault })?;
    }
    let mut notes = settings(&old.scene, &new.scene);
    notes.extend(differing(work(old), work(new)));
    if !notes.is_empty() && !options.force {
        return Err(CompareError::DifferentWork(notes));
    }
    let counted = [old, new].map(counts_cpu);
    let cpu = counted == [true; 2];
    let pairs = pairs(old, new, cpu, in_turn);
    let both = pairs.iter().filter(|p| p.old.is_some() && p.new.is_some()).count();
    let method = match in_turn {
        true => Method::InTurn,
        false => Method::Apart { blocks: blocks_needed(both, options.alpha) },
    };
    let tick = old.device.timestamp_period_ns.max(new.device.timestamp_period_ns);
    let lines = judge(pairs, method, tick, options).map_err(|fault| CompareError::Times { fault })?;
    notes.extend(differing(conditions(old), conditions(new)));
    notes.extend(common_shift(&lines));
    notes.extend(excused(&lines, options));
    let alpha = options.alpha * 100.0;
    let test = match method {
        Method::Apart { blocks } => format!(
            "Mann-Whitney on the medians of {blocks} blocks a run, Holm over {both} lines at {alpha:.0} %, and a shift beyond what the \
             blocks of a run range over"
        ),
        Method::InTurn => {
            format!(
                "Wilcoxon's signed ranks of {} blocks of repeats in turn, Holm over {both} lines at {alpha:.0} %",
                old.repeats
            )
        }
    };
    if !cpu && old.device.is_software && new.device.is_software {
        let which = if counted[0] { "new" } else { "old" };
        notes.push(format!(
            "the {which} profile has no CPU time of passes, which varies less than the time that is compared"
        ));
    }
    let time = if cpu { "CPU time of each pass" } else { "time of each pass by the device's clock" };
    Ok(Comparison { format: "echolume-comparison-2", time, test, threshold: options.threshold.ratio(), notes, lines })
}

/// True if the device is the CPU and every pass that runs has its CPU time.
fn counts_cpu(profile: &Profile) -> bool {
    let has = |pass: &PassProfile| pass.runs_per_picture == 0 || !pass.cpu_ns.is_empty();
    profile.device.is_software && !profile.cpu_ns.is_empty() && profile.passes.iter().all(has)
}

/// The times of one line in one profile, ns, one for each repeat; `runs` is the number of dispatches in a repeat.
#[derive(Clone, Copy)]
pub struct Series<'a> {
    pub stage: &'a str,
    pub runs: u32,
    pub times: &'a [f64],
}

/// The times of one line in both profiles; None where a profile lacks it.
pub struct Pair<'a> {
    pub kind: Kind,
    pub name: &'a str,
    pub old: Option<Series<'a>>,
    pub new: Option<Series<'a>>,
}

fn pairs<'a>(old: &'a Profile, new: &'a Profile, cpu: bool, in_turn: bool) -> Vec<Pair<'a>> {
    let series = |p: &'a PassProfile| {
        let times = if cpu && p.runs_per_picture > 0 && p.stage != "host" { &p.cpu_ns } else { &p.samples_ns };
        Series { stage: &p.stage, runs: p.runs_per_picture, times }
    };
    let mut pairs = Vec::new();
    for (kind, old, new) in [(Kind::Pass, &old.passes, &new.passes), (Kind::Host, &old.host, &new.host)] {
        for (old, new) in matched(old, new, |p| &p.name) {
            let name = new.or(old).map_or("", |p| &p.name);
            pairs.push(Pair { kind, name, old: old.map(series), new: new.map(series) });
        }
    }
    let whole = |times: &'a [f64]| Some(Series { stage: "", runs: 1, times });
    if !cpu || !in_turn {
        // Beside the CPU time it is told, but not judged.
        let kind = if cpu { Kind::Host } else { Kind::Wall };
        pairs.push(Pair { kind, name: "wall", old: whole(&old.wall_ns), new: whole(&new.wall_ns) });
    }
    if cpu {
        pairs.push(Pair {
            kind: Kind::Cpu,
            name: "CPU, all threads",
            old: whole(&old.cpu_ns),
            new: whole(&new.cpu_ns),
        });
    }
    pairs
}

/// What a profile worked on: times of different work are not comparable.
fn work(profile: &Profile) -> [(&'static str, String); 6] {
    let [frame, volume, picture] = [&profile.sizes.frame[..], &profile.sizes.volume, &profile.sizes.picture]
        .map(|size| size.iter().map(u32::to_string).collect::<Vec<_>>().join(" x "));
    [
        ("input", profile.input.clone()),
        ("frame", frame + " samples"),
        ("slices", profile.sizes.slices.to_string()),
        ("volume", volume + " texels"),
        ("turn", format!("{} deg", profile.turn)),
        ("picture", picture + " pixels"),
    ]
}

/// What it was measured on and how: comparable if it differs, but worth reporting.
fn conditions(profile: &Profile) -> impl Iterator<Item = (&'static str, String)> {
    let measured = [
        ("ns a tick", profile.device.timestamp_period_ns.to_string()),
        ("time stamp bits", profile.device.valid_bits.to_string()),
        ("program", profile.program.clone()),
        ("repeats", profile.repeats.to_string()),
        ("warm-up", profile.warm_up.to_string()),
    ];
    profile.device.conditions().into_iter().chain(measured)
}

/// Differences of settings, each under its full key.
fn settings(old: &str, new: &str) -> Vec<String> {
    if old == new {
        return Vec::new();
    }
    let (Ok(old), Ok(new)) = (old.parse::<Table>(), new.parse::<Table>()) else {
        return vec!["scene: the settings differ, and at least one side is not TOML".into()];
    };
    let [mut a, mut b] = [BTreeMap::new(), BTreeMap::new()];
    flatten("", &Value::Table(old), &mut a);
    flatten("", &Value::Table(new), &mut b);
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let [old, new] = [&a, &b].map(|side| {
        let value = |key: &&String| side.get(*key).map_or("not set".into(), String::clone);
        keys.iter().map(move |key| (format!("scene {key}"), value(key)))
    });
    differing(old, new)
}

fn flatten(key: &str, value: &Value, into: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) if !table.is_empty() || key.is_empty() => {
            for (name, inner) in table {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                flatten(&key, inner, into);
            }
        }
        other => {
            into.insert(key.into(), other.to_string());
        }
    }
}

/// Minimum number of blocks that a series is cut into. Fewer blocks are longer, so neighbours are less correlated.
const MIN_BLOCKS: usize = 6;

/// Minimum number of passes in which a common shift is looked for.
const MIN_COMMON: usize = 3;

/// The smallest number of blocks per profile, 6 to 100, with which the Mann-Whitney test can report any difference among `lines` lines. `alpha`:
/// probability of a false alarm in the whole report.
pub fn blocks_needed(lines: usize, alpha: f64) -> usize {
    (MIN_BLOCKS..100).find(|b| min_p(*b) * lines as f64 <= alpha).unwrap_or(100)
}

/// By which method two series of times are compared.
#[derive(Clone, Copy)]
pub enum Method {
    /// By the medians of `blocks` consecutive blocks of each series.
    Apart { blocks: usize },
    /// Pair by pair, for series that were measured alternately.
    InTurn,
}

/// Test result of two series, before correction for the other lines.
struct BlockTest {
    p: f64,
    /// Of the logarithms of times.
    shift: Shift,
    /// The smallest shift that the test would have reported, whatever the other lines.
    seen: f64,
    /// Largest range of block medians within one run, logarithm of a ratio.
    range: f64,
    /// One clock tick per dispatch, logarithm of a ratio.
    tick: f64,
    /// Median time of the new run, ns.
    weight: f64,
}

/// Tests two series; Err(reason) if there is nothing to compare. `tick` in ns, `alpha` of one line.
fn test(
    old: &Series,
    new: &Series,
    method: Method,
    tick: f64,
    alpha: f64,
) -> Result<Result<BlockTest, String>, SampleError> {
    let blocks = match method {
        Method::Apart { blocks } => blocks,
        Method::InTurn => old.times.len().max(1),
    };
    let mut logs = Vec::new();
    for (which, series) in [("old", old), ("new", new)] {
        let Some(medians) = block_medians(series.times, blocks)? else {
            let count = series.times.len();
            let fault = match count {
                0 => format!("the {which} run has no times"),
                _ => format!("the {which} run has {count} repeats; with fewer than {blocks} nothing can be told apart"),
            };
            return Ok(Err(fault));
        };
        if medians.iter().any(|ns| *ns <= 0.0) {
            return Ok(Err(format!("the {which} run has times of 0 ns: below what its clock resolves")));
        }
        logs.push(medians.into_iter().map(f64::ln).collect::<Vec<f64>>());
    }
    let differences: Vec<f64> = logs[0].iter().zip(&logs[1]).map(|(old, new)| new - old).collect();
    let (p, shift, strict) = match method {
        Method::Apart { .. } => {
            let shift = |level| hodges_lehmann(&logs[0], &logs[1], level);
            (mann_whitney(&logs[0], &logs[1])?.p, shift(LEVEL)?, shift(1.0 - alpha)?)
        }
        Method::InTurn => {
            let shift = |level| paired_shift(&differences, level);
            (signed_rank(&differences)?, shift(LEVEL)?, shift(1.0 - alpha)?)
        }
    };
    let seen = if strict.coverage < 1.0 - alpha { f64::INFINITY } else { strict.estimate - strict.low };
    let mut range: f64 = 0.0;
    // What neighbours share is no noise.
    for medians in logs.iter().filter(|_| !matches!(method, Method::InTurn)) {
        let sample = Sample::new(medians)?;
        range = range.max(sample.max() - sample.min());
    }
    let (old_ns, new_ns) = (Sample::new(old.times)?.median(), Sample::new(new.times)?.median());
    let runs = f64::from(old.runs.max(new.runs));
    Ok(Ok(BlockTest { p, shift, seen, range, tick: (tick * runs / old_ns.min(new_ns)).ln_1p(), weight: new_ns }))
}

/// Median range over the passes, weighted by their time.
fn typical_range(passes: &[&BlockTest]) -> f64 {
    let mut ordered: Vec<(f64, f64)> = passes.iter().map(|t| (t.range, t.weight)).collect();
    ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = ordered.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut below = 0.0;
    let middle = ordered.iter().find(|(_, weight)| {
        below += weight;
        below >= half
    });
    middle.map_or(0.0, |(range, _)| *range)
}

/// Compares all pairs, and returns a line for each. `tick`: resolution of the device's clock, ns.
///
/// # Errors
/// A time is not finite.
pub fn judge(pairs: Vec<Pair>, method: Method, tick: f64, options: &CompareOptions) -> Result<Vec<Line>, SampleError> {
    let both = pairs.iter().filter(|pair| pair.old.is_some() && pair.new.is_some()).count();
    let alpha = options.alpha / both.max(1) as f64;
    let mut tested = Vec::new();
    for pair in &pairs {
        // The host's clock has a resolution of 1 ns.
        let tick = if pair.kind == Kind::Pass { tick } else { 1.0 };
        tested.push(match (&pair.old, &pair.new) {
            (Some(old), Some(new)) => test(old, new, method, tick, alpha)?,
            _ => Err(String::new()),
        });
    }
    let passes = pairs.iter().zip(&tested).filter(|(pair, _)| pair.kind == Kind::Pass);
    let passes: Vec<&BlockTest> = passes.filter_map(|(_, t)| t.as_ref().ok()).collect();
    let typical = typical_range(&passes);
    let least = options.minor * passes.iter().map(|t| t.weight).sum::<f64>();
    let p: Vec<f64> = tested.iter().flatten().map(|t| t.p).collect();
    let mut corrected = holm(&p).into_iter();
    let lines = pairs.into_iter().zip(tested).map(|(pair, tested)| {
        let is_minor = pair.kind == Kind::Pass && tested.as_ref().is_ok_and(|tested| tested.weight < least);
        let (ratio, fault) = match tested {
            Ok(tested) => (corrected.next().map(|p_holm| (ratio(&tested, typical, p_holm), tested.seen.exp())), None),
            Err(fault) => (None, Some(fault)),
        };
        Line { is_minor, ..line(pair, ratio, fault, options) }
    });
    Ok(lines.collect())
}

fn ratio(tested: &BlockTest, typical: f64, p_holm: f64) -> Ratio {
    let shift = &tested.shift;
    Ratio {
        estimate: shift.estimate.exp(),
        low: shift.low.exp(),
        high: shift.high.exp(),
        coverage: shift.coverage,
        p: tested.p,
        p_holm,
        floor: tested.range.max(typical).max(tested.tick).exp(),
    }
}

/// `ratio` with the smallest one that the test would have reported.
fn line(pair: Pair, ratio: Option<(Ratio, f64)>, fault: Option<String>, options: &CompareOptions) -> Line {
    let (ratio, seen) = (ratio.map(|(ratio, _)| ratio), ratio.map(|(_, seen)| seen));
    let verdict = match (&pair.old, &pair.new, &ratio) {
        (None, _, _) => Verdict::New,
        (_, None, _) => Verdict::Gone,
        (_, _, None) => Verdict::NotComparable,
        (_, _, Some(r)) if r.p_holm > options.alpha => Verdict::WithinNoise,
        (_, _, Some(r)) if r.estimate > r.floor => Verdict::Slower,
        (_, _, Some(r)) if r.estimate < 1.0 / r.floor => Verdict::Faster,
        _ => Verdict::WithinNoise,
    };
    let runs = match (&pair.old, &pair.new) {
        (Some(old), Some(new)) if old.runs != new.runs => Some(format!("runs a picture: {} -> {}", old.runs, new.runs)),
        _ => None,
    };
    let median = |series: &Option<Series>| series.and_then(|s| Sample::new(s.times).ok()).map(|s| s.median());
    let slower_by = ratio.map_or(0.0, |r| r.estimate);
    let threshold = options.threshold.ratio();
    let is_judged = pair.kind != Kind::Host;
    let is_regression = verdict == Verdict::Slower && slower_by > threshold && is_judged;
    // Ties may hide what the interval alone would show.
    let least = if verdict == Verdict::WithinNoise { slower_by } else { 1.0 };
    let limit = ratio.zip(seen).map(|(r, seen)| seen.max(r.floor).max(least)).filter(|limit| limit.is_finite());
    let runs_nowhere = pair.old.is_some_and(|old| old.runs == 0) && pair.new.is_some_and(|new| new.runs == 0);
    let can_hide = match verdict {
        Verdict::WithinNoise | Verdict::Slower => limit.is_none_or(|limit| limit > threshold),
        Verdict::NotComparable => !runs_nowhere,
        Verdict::Faster | Verdict::New | Verdict::Gone => false,
    };
    Line {
        name: pair.name.into(),
        stage: pair.new.or(pair.old).map_or(String::new(), |s| s.stage.into()),
        kind: pair.kind,
        verdict,
        old_ns: median(&pair.old),
        new_ns: median(&pair.new),
        ratio,
        note: fault.filter(|f| !f.is_empty()).or(runs),
        is_regression,
        limit,
        is_unseen: can_hide && is_judged && !is_regression,
        is_minor: false,
    }
}

/// A note if all passes changed by a similar factor, which suggests that the device's clock rate changed and not a pass. None otherwise.
pub fn common_shift(lines: &[Line]) -> Option<String> {
    let passes: Vec<Ratio> = lines.iter().filter(|l| l.kind == Kind::Pass).filter_map(|l| l.ratio).collect();
    let logs: Vec<f64> = passes.iter().map(|r| r.estimate.ln()).collect();
    let sample = Sample::new(&logs).ok().filter(|s| s.count() >= MIN_COMMON)?;
    let floors: Vec<f64> = passes.iter().map(|r| r.floor.ln()).collect();
    let floor = Sample::new(&floors).ok()?.median();
    let (shift, spread) = (sample.median(), sample.max() - sample.min());
    // The shift is more than twice the spread of the passes.
    (shift.abs() > floor && spread < shift.abs() / 2.0).then(|| {
        let each = sample.quantile(0.5).exp();
        format!("all passes changed alike, by a factor of {each:.2}: check whether clocks or other load differ between the runs")
    })
}
