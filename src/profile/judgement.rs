//! The two hurdles of a comparison, line by line; [`compare`](super::compare) says why there are two.

use super::LEVEL;
use super::compare::{Kind, Line, Options, Pair, Ratio, Series, Verdict};
use super::ranks::{Shift, hodges_lehmann, holm, least_p, mann_whitney};
use super::statistics::{Sample, SampleError, block_medians};

/// Fewest blocks that a series is cut into: the fewer, the longer they are, and the less neighbours resemble each other.
const FEWEST_BLOCKS: usize = 6;

/// Passes that a common shift is looked for in, at least.
const COMMON: usize = 3;

/// The fewest blocks a run with which the test can call any of `lines` different at all.
pub(crate) fn blocks(lines: usize, alpha: f64) -> usize {
    (FEWEST_BLOCKS..100).find(|b| least_p(*b) * lines as f64 <= alpha).unwrap_or(100)
}

/// What the blocks of two series say, before the other lines are known.
struct Tested {
    p: f64,
    /// Of logarithms of times.
    shift: Shift,
    /// Largest range of block medians within one run, and the clock's tick: logarithms of ratios.
    range: f64,
    tick: f64,
    /// Median time of the new run, ns.
    weight: f64,
}

/// Blocks apart by more than the tick of a clock, as logarithms; a sentence where there is nothing to compare.
fn test(old: &Series, new: &Series, blocks: usize, tick: f64) -> Result<Result<Tested, String>, SampleError> {
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
    let mut range: f64 = 0.0;
    for medians in &logs {
        let sample = Sample::new(medians)?;
        range = range.max(sample.max() - sample.min());
    }
    let (old_ns, new_ns) = (Sample::new(old.times)?.median(), Sample::new(new.times)?.median());
    let runs = f64::from(old.runs.max(new.runs));
    Ok(Ok(Tested {
        p: mann_whitney(&logs[0], &logs[1])?.p,
        shift: hodges_lehmann(&logs[0], &logs[1], LEVEL)?,
        range,
        tick: (tick * runs / old_ns.min(new_ns)).ln_1p(),
        weight: new_ns,
    }))
}

/// The range of the pass in which the device's time is half over when passes are ordered by it.
fn typical_range(passes: &[&Tested]) -> f64 {
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

/// Every pair's verdict. `tick` is the device clock's, ns.
pub(crate) fn lines(pairs: Vec<Pair>, blocks: usize, tick: f64, options: &Options) -> Result<Vec<Line>, SampleError> {
    let mut tested = Vec::new();
    for pair in &pairs {
        // The host's clock counts single nanoseconds.
        let tick = if pair.kind == Kind::Pass { tick } else { 1.0 };
        tested.push(match (&pair.old, &pair.new) {
            (Some(old), Some(new)) => test(old, new, blocks, tick)?,
            _ => Err(String::new()),
        });
    }
    let passes = pairs.iter().zip(&tested).filter(|(pair, _)| pair.kind == Kind::Pass);
    let typical = typical_range(&passes.filter_map(|(_, t)| t.as_ref().ok()).collect::<Vec<_>>());
    let p: Vec<f64> = tested.iter().flatten().map(|t| t.p).collect();
    let mut corrected = holm(&p).into_iter();
    let lines = pairs.into_iter().zip(tested).map(|(pair, tested)| {
        let (ratio, fault) = match tested {
            Ok(tested) => (corrected.next().map(|p_holm| ratio(&tested, typical, p_holm)), None),
            Err(fault) => (None, Some(fault)),
        };
        line(pair, ratio, fault, options)
    });
    Ok(lines.collect())
}

fn ratio(tested: &Tested, typical: f64, p_holm: f64) -> Ratio {
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

fn line(pair: Pair, ratio: Option<Ratio>, fault: Option<String>, options: &Options) -> Line {
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
    Line {
        name: pair.name.into(),
        stage: pair.new.or(pair.old).map_or(String::new(), |s| s.stage.into()),
        kind: pair.kind,
        verdict,
        old_ns: median(&pair.old),
        new_ns: median(&pair.new),
        ratio,
        note: fault.filter(|f| !f.is_empty()).or(runs),
        is_regression: verdict == Verdict::Slower && slower_by > options.threshold && pair.kind != Kind::Host,
    }
}

/// A sentence where all passes moved by much the same: then a clock did, rather than a pass.
pub(crate) fn common_shift(lines: &[Line]) -> Option<String> {
    let passes: Vec<Ratio> = lines.iter().filter(|l| l.kind == Kind::Pass).filter_map(|l| l.ratio).collect();
    let logs: Vec<f64> = passes.iter().map(|r| r.estimate.ln()).collect();
    let sample = Sample::new(&logs).ok().filter(|s| s.count() >= COMMON)?;
    let floors: Vec<f64> = passes.iter().map(|r| r.floor.ln()).collect();
    let floor = Sample::new(&floors).ok()?.median();
    let (shift, spread) = (sample.median(), sample.max() - sample.min());
    // Twice as far moved as the passes differ in it.
    (shift.abs() > floor && spread < shift.abs() / 2.0).then(|| {
        let each = sample.quantile(0.5).exp();
        format!("all passes changed alike, by a factor of {each:.2}: look whether clocks or other load differ between the runs")
    })
}
