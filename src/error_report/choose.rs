//! Which settings to use: the cheapest within an error, the most accurate within a time, over all dials of a report.
//!
//! A report turns one dial at a time. What several turned at once come to is predicted: their squared errors add (as errors do
//! that know nothing of each other), and each multiplies the time by what it did alone. Measure the choice before it is trusted.

use super::{Dial, Measure, Report};

/// Two times closer than this share count as the same while dials are combined, so that the combinations stay few; it may
/// cost as much for every dial.
const SAME_TIME: f64 = 1e-4;

/// Settings, and what they are predicted to come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// What differs from the default: dial and label of the point.
    pub turned: Vec<(String, String)>,
    /// Their assignments, "key=value" as `--set` takes them.
    pub set: Vec<String>,
    /// By the measure that was asked for, without margin.
    pub error: f64,
    /// ns, without margin.
    pub time: f64,
    /// Dials that could not be combined: they have no default point, or it has no time or no such error.
    pub left_out: Vec<String>,
}

/// The fastest settings whose predicted error, made larger by the share `margin`, is at most `error`.
///
/// # Errors
/// One line: nothing was timed, or no combination is as accurate; the most accurate one is named.
pub fn cheapest_under(report: &Report, measure: Measure, error: f64, margin: f64) -> Result<Choice, String> {
    let (all, base) = combinations(report, measure)?;
    let within = |c: &&Combination| c.square.sqrt() * (1.0 + margin) <= error;
    // In order of time, errors falling.
    match (all.iter().find(within), all.last()) {
        (Some(found), _) => Ok(base.choice(report, found)),
        (None, Some(best)) => {
            let best = base.choice(report, best);
            Err(format!(
                "no setting has {} or less{}: the most accurate {}",
                measure.say(error),
                said(margin),
                best.say(measure)
            ))
        }
        (None, None) => Err("error report: no setting was measured".into()),
    }
}

/// The most accurate settings whose predicted time, made longer by the share `margin`, is at most `time` ns.
///
/// # Errors
/// One line: nothing was timed, or no combination is as fast; the fastest one is named.
pub fn most_accurate_under(report: &Report, measure: Measure, time: f64, margin: f64) -> Result<Choice, String> {
    let (all, base) = combinations(report, measure)?;
    let within = |c: &&Combination| base.time * c.log_time.exp() * (1.0 + margin) <= time;
    match (all.iter().rev().find(within), all.first()) {
        (Some(found), _) => Ok(base.choice(report, found)),
        (None, Some(best)) => {
            let (wanted, best) = (time * 1e-6, base.choice(report, best));
            Err(format!("no setting takes {wanted:.3} ms or less{}: the fastest {}", said(margin), best.say(measure)))
        }
        (None, None) => Err("error report: no setting was measured".into()),
    }
}

/// Every choice that no other beats, from the fastest to the most accurate, and the time of all defaults, ns.
///
/// # Errors
/// One line: nothing was timed.
pub fn front(report: &Report, measure: Measure) -> Result<(Vec<Choice>, f64), String> {
    let (all, base) = combinations(report, measure)?;
    Ok((all.iter().map(|c| base.choice(report, c)).collect(), base.time))
}

fn said(margin: f64) -> String {
    if margin > 0.0 { format!(" with a margin of {:.0} %", margin * 100.0) } else { String::new() }
}

impl Choice {
    /// "(ray.step=0.25) has RMSE 1.0e-3 and takes 12.000 ms".
    pub fn say(&self, measure: Measure) -> String {
        let set = if self.set.is_empty() { "the default".to_string() } else { self.set.join(" ") };
        format!("({set}) has {} and takes {:.3} ms", measure.say(self.error), self.time * 1e-6)
    }
}

/// One setting of dials of which only one is turned.
struct Turn {
    /// Dial and point; none leaves all at their defaults.
    point: Option<(usize, usize)>,
    square: f64,
    log_time: f64,
}

/// A setting of every dial so far.
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
            turned: found.points.iter().map(point).map(|(d, p)| (d.name.clone(), p.label.clone())).collect(),
            set: found.points.iter().flat_map(|at| point(at).1.set.clone()).collect(),
            error: found.square.sqrt(),
            time: self.time * found.log_time.exp(),
            left_out: self.left_out.clone(),
        }
    }
}

/// The Pareto front of all combinations, from the fastest to the most accurate. Both sums grow dial by dial, so what is beaten
/// halfway stays beaten.
fn combinations(report: &Report, measure: Measure) -> Result<(Vec<Combination>, Base), String> {
    let default = |dial: &Dial| {
        let point = dial.points.iter().find(|p| p.is_default)?;
        Some((point.time.filter(|t| t.median > 0.0)?, measure.of(&point.errors)?))
    };
    if !report.dials.iter().flat_map(|d| &d.points).any(|p| p.time.is_some()) {
        return Err(format!("{}: no time was measured, this device has no time stamps", report.device));
    }
    let (usable, unusable): (Vec<_>, Vec<_>) =
        (0..report.dials.len()).partition(|d| default(&report.dials[*d]).is_some());
    let left_out = unusable.iter().map(|d| report.dials[*d].name.clone()).collect();
    // The same picture was timed once for every dial.
    let mut times: Vec<f64> = usable.iter().filter_map(|d| Some(default(&report.dials[*d])?.0.median)).collect();
    times.sort_by(f64::total_cmp);
    let Some(time) = times.get(times.len() / 2) else {
        return Err("error report: no dial has a default point with a time and this error to compare with".into());
    };
    let mut all = vec![Combination { points: vec![], square: 0.0, log_time: 0.0 }];
    for group in groups(report, &usable) {
        let turns = turns(report, measure, &group);
        let turned = all.iter().flat_map(|c| {
            turns.iter().map(|t| Combination {
                points: c.points.iter().copied().chain(t.point).collect(),
                square: c.square + t.square,
                log_time: c.log_time + t.log_time,
            })
        });
        all = thinned(turned.collect());
    }
    Ok((all, Base { time: *time, left_out }))
}

/// All defaults, and each other point alone.
fn turns(report: &Report, measure: Measure, group: &[usize]) -> Vec<Turn> {
    let mut turns = Vec::new();
    for &d in group {
        let dial = &report.dials[d];
        let others: f64 = group.iter().filter(|o| **o != d).map(|o| default_square(&report.dials[*o], measure)).sum();
        let Some(base) = dial.points.iter().find(|p| p.is_default).and_then(|p| p.time) else { continue };
        for (p, point) in dial.points.iter().enumerate().filter(|(_, p)| !p.is_default) {
            let (Some(time), Some(error)) = (point.time.filter(|t| t.median > 0.0), measure.of(&point.errors)) else {
                continue;
            };
            // A gain that lies within the spread of the repeats is none; a loss counts in full.
            let factor =
                if time.high >= base.low { (time.median / base.median).max(1.0) } else { time.median / base.median };
            turns.push(Turn { point: Some((d, p)), square: others + error * error, log_time: factor.ln() });
        }
    }
    let square = group.iter().map(|d| default_square(&report.dials[*d], measure)).sum();
    turns.push(Turn { point: None, square, log_time: 0.0 });
    turns
}

fn default_square(dial: &Dial, measure: Measure) -> f64 {
    let error = dial.points.iter().find(|p| p.is_default).and_then(|p| measure.of(&p.errors));
    error.map_or(0.0, |e| e * e)
}

/// Dials that assign the same setting, or one within the other, cannot be turned together: of each group one is.
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
        let (touched, mut apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(|g| g.iter().any(|o| clash(*o, d)));
        apart.push(touched.into_iter().flatten().chain([d]).collect());
        groups = apart;
    }
    groups
}

/// What no other beats, from the fastest; of nearly equal times the most accurate, of equal ones what turns the fewest dials.
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
            // The fastest of all stays what it is, or a time that can be held would be refused.
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
