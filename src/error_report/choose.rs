//! Chooses settings from a report: the cheapest within an error bound, or the most accurate within a time bound, over all dials that
//! trade error for time. A dial of another look is never turned.
//!
//! A report varies one dial at a time. The effect of several changes is predicted: squared errors add (as those of independent
//! errors do), and each change multiplies the time by its own factor. Verify a choice by measuring it.

use super::{Dial, Measure, Report};

/// Relative difference below which two times count as equal while dials are combined. It bounds the number of combinations, and may
/// add the same relative error for every dial.
const SAME_TIME: f64 = 1e-4;

/// Chosen settings, with predicted error and time.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Changes from the default: name of the dial and label of the point.
    pub changed: Vec<(String, String)>,
    /// Their assignments, "key=value" as `--set` takes them.
    pub set: Vec<String>,
    /// Predicted error by the requested measure, without margin.
    pub error: f64,
    /// Predicted time, ns, without margin.
    pub time: f64,
    /// Dials that could not be combined: their default point is missing, or has no time or no such error.
    pub left_out: Vec<String>,
}

/// The fastest settings whose predicted error, made larger by the share `margin`, is at most `error`.
///
/// # Errors
/// One line: nothing was timed, or no combination is as accurate. It names the most accurate one.
pub fn cheapest_under(report: &Report, measure: Measure, error: f64, margin: f64) -> Result<Choice, String> {
    let (all, base) = combinations(report, measure)?;
    let within = |c: &&Combination| c.square.sqrt() * (1.0 + margin) <= error;
    // Sorted by time; errors decrease.
    match (all.iter().find(within), all.last()) {
        (Some(found), _) => Ok(base.choice(report, found)),
        (None, Some(best)) => {
            let best = base.choice(report, best);
            Err(format!(
                "no setting has {} or less{}: the most accurate {}",
                measure.format(error),
                with_margin(margin),
                best.describe(measure)
            ))
        }
        (None, None) => Err("error report: no setting was measured".into()),
    }
}

/// The most accurate settings whose predicted time, made longer by the share `margin`, is at most `time` ns.
///
/// # Errors
/// One line: nothing was timed, or no combination is as fast. It names the fastest one.
pub fn most_accurate_under(report: &Report, measure: Measure, time: f64, margin: f64) -> Result<Choice, String> {
    let (all, base) = combinations(report, measure)?;
    let within = |c: &&Combination| base.time * c.log_time.exp() * (1.0 + margin) <= time;
    match (all.iter().rev().find(within), all.first()) {
        (Some(found), _) => Ok(base.choice(report, found)),
        (None, Some(best)) => {
            let (limit, best) = (time * 1e-6, base.choice(report, best));
            Err(format!(
                "no setting takes {limit:.3} ms or less{}: the fastest {}",
                with_margin(margin),
                best.describe(measure)
            ))
        }
        (None, None) => Err("error report: no setting was measured".into()),
    }
}

/// The Pareto front of all choices, from the fastest to the most accurate, and the time of all defaults, ns.
///
/// # Errors
/// One line: nothing was timed.
pub fn front(report: &Report, measure: Measure) -> Result<(Vec<Choice>, f64), String> {
    let (all, base) = combinations(report, measure)?;
    Ok((all.iter().map(|c| base.choice(report, c)).collect(), base.time))
}

fn with_margin(margin: f64) -> String {
    if margin > 0.0 { format!(" with a margin of {:.0} %", margin * 100.0) } else { String::new() }
}

impl Choice {
    /// "(ray.step=0.25) has RMSE 1.0e-3 and takes 12.000 ms".
    pub fn describe(&self, measure: Measure) -> String {
        let set = if self.set.is_empty() { "the default".to_string() } else { self.set.join(" ") };
        format!("({set}) has {} and takes {:.3} ms", measure.format(self.error), self.time * 1e-6)
    }
}

/// A candidate change within a group of dials of which at most one may change.
struct Step {
    /// Dial and point; None leaves all at their defaults.
    point: Option<(usize, usize)>,
    square: f64,
    log_time: f64,
}

/// Settings of all dials combined so far.
#[derive(Clone)]
struct Combination {
    points: Vec<(usize, usize)>,
    square: f64,
    log_time: f64,
}

struct Base {
    time: f64,
    left_out: Vec<String>,
}

impl Base {
    fn choice(&self, report: &Report, found: &Combination) -> Choice {
        let point = |(d, p): &(usize, usize)| (&report.dials[*d], &report.dials[*d].points[*p]);
        Choice {
            changed: found.points.iter().map(point).map(|(d, p)| (d.name.clone(), p.label.clone())).collect(),
            set: found.points.iter().flat_map(|at| point(at).1.set.clone()).collect(),
            error: found.square.sqrt(),
            time: self.time * found.log_time.exp(),
            left_out: self.left_out.clone(),
        }
    }
}

/// The Pareto front of all combinations, from the fastest to the most accurate. Both sums are additive over dials, so a combination
/// that is dominated on the way stays dominated.
fn combinations(report: &Report, measure: Measure) -> Result<(Vec<Combination>, Base), String> {
    let default = |dial: &Dial| {
        let point = dial.points.iter().find(|p| p.is_default)?;
        Some((point.time.filter(|t| t.median > 0.0)?, measure.of(&point.errors)?))
    };
    if !report.dials.iter().flat_map(|d| &d.points).any(|p| p.time.is_some()) {
        return Err(format!("{}: no time was measured, this device has no time stamps", report.device));
    }
    let of_errors = (0..report.dials.len()).filter(|d| !report.dials[*d].is_look());
    let (usable, unusable): (Vec<_>, Vec<_>) = of_errors.partition(|d| default(&report.dials[*d]).is_some());
    let left_out = unusable.iter().map(|d| report.dials[*d].name.clone()).collect();
    // The default picture was timed once for each dial.
    let mut times: Vec<f64> = usable.iter().filter_map(|d| Some(default(&report.dials[*d])?.0.median)).collect();
    times.sort_by(f64::total_cmp);
    let Some(time) = times.get(times.len() / 2) else {
        return Err("error report: no dial has a default point with a time and this error to compare with".into());
    };
    let mut all = vec![Combination { points: vec![], square: 0.0, log_time: 0.0 }];
    for group in groups(report, &usable) {
        let steps = steps(report, measure, &group);
        let combined = all.iter().flat_map(|c| {
            steps.iter().map(|t| Combination {
                points: c.points.iter().copied().chain(t.point).collect(),
                square: c.square + t.square,
                log_time: c.log_time + t.log_time,
            })
        });
        all = thinned(combined.collect());
    }
    Ok((all, Base { time: *time, left_out }))
}

/// The candidates of a group: all defaults, and each other point alone.
fn steps(report: &Report, measure: Measure, group: &[usize]) -> Vec<Step> {
    let mut steps = Vec::new();
    for &d in group {
        let dial = &report.dials[d];
        let others: f64 = group.iter().filter(|o| **o != d).map(|o| default_square(&report.dials[*o], measure)).sum();
        let Some(base) = dial.points.iter().find(|p| p.is_default).and_then(|p| p.time) else { continue };
        for (p, point) in dial.points.iter().enumerate().filter(|(_, p)| !p.is_default) {
            let (Some(time), Some(error)) = (point.time.filter(|t| t.median > 0.0), measure.of(&point.errors)) else {
                continue;
            };
            // A gain within the spread of the repeats does not count; a loss counts in full.
            let factor =
                if time.high >= base.low { (time.median / base.median).max(1.0) } else { time.median / base.median };
            steps.push(Step { point: Some((d, p)), square: others + error * error, log_time: factor.ln() });
        }
    }
    let square = group.iter().map(|d| default_square(&report.dials[*d], measure)).sum();
    steps.push(Step { point: None, square, log_time: 0.0 });
    steps
}

fn default_square(dial: &Dial, measure: Measure) -> f64 {
    let error = dial.points.iter().find(|p| p.is_default).and_then(|p| measure.of(&p.errors));
    error.map_or(0.0, |e| e * e)
}

/// Groups of dials that assign the same setting, or one within the other: at most one dial of each group may change.
fn groups(report: &Report, dials: &[usize]) -> Vec<Vec<usize>> {
    let keys = |d: usize| {
        let sets = report.dials[d].points.iter().filter(|p| !p.is_default).flat_map(|p| &p.set);
        sets.map(|s| s.split('=').next().unwrap_or(s).trim()).collect::<Vec<_>>()
    };
    let within = |a: &str, b: &str| b.strip_prefix(a).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    let clash = |a: usize, b: usize| {
        let (a, b) = (keys(a), keys(b));
        a.iter().any(|a| b.iter().any(|b| within(a, b) || within(b, a)))
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &d in dials {
        let (touched, mut separate): (Vec<_>, Vec<_>) =
            groups.into_iter().partition(|g| g.iter().any(|o| clash(*o, d)));
        separate.push(touched.into_iter().flatten().chain([d]).collect());
        groups = separate;
    }
    groups
}

/// The Pareto front, from the fastest. Of nearly equal times the most accurate stays, of equal ones that with the fewest changes.
fn thinned(mut all: Vec<Combination>) -> Vec<Combination> {
    let order = |a: &Combination, b: &Combination| {
        a.log_time.total_cmp(&b.log_time).then(a.square.total_cmp(&b.square)).then(a.points.len().cmp(&b.points.len()))
    };
    all.sort_by(order);
    let mut kept: Vec<Combination> = Vec::new();
    let mut bin = f64::NEG_INFINITY;
    for c in all {
        match kept.last() {
            Some(last) if last.square <= c.square => {}
            // The fastest of all always stays, otherwise an achievable time bound would be refused.
            Some(_) if c.log_time - bin < SAME_TIME && kept.len() > 1 => {
                kept.pop();
                kept.push(c);
            }
            _ => {
                bin = c.log_time;
                kept.push(c);
            }
        }
    }
    kept
}
