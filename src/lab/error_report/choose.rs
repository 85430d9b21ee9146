//! Chooses settings: the fastest within an error bound, or the most accurate within a time bound. Only numerical settings are varied, so
//! that the chosen settings compute the same picture.
//!
//! Each dial is measured alone, and neither the errors nor the times of several changes follow from those of each. So the dials only
//! propose combinations ([`proposals`]). [`errors_and_times`] renders each proposal, and the choice is made among the measured ones.
//!
//! [`errors_and_times`]: super::errors_and_times

use super::{Combination, Dial, Kind, Measure, Point, Report, Time, Times};
use std::fmt::Write as _;

/// Relative difference below which two predicted times count as equal. It bounds the number of proposals.
const SAME_TIME: f64 = 1e-4;
/// Margin of a time bound: 1.25 times the 95th percentile of a choice must be within it, because another run may be slower. With a tenth, 3 of 39
/// choices on random scenes took longer when they were measured again (lavapipe, two cores).
pub const TIME_MARGIN: f64 = 0.25;

/// What a chosen combination has to keep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Largest error, in the unit of the [`Measure`]. The error of a combination plus the estimated error of its reference must not exceed it. For
    /// distances and normals there is no such estimate.
    Error(f64),
    /// Longest time for a volume and its picture, ns. The 95th percentile, increased by the share [`TIME_MARGIN`], must not exceed it.
    Time(f64),
}

/// Largest number of combinations that are measured again to find the fastest.
pub const MAX_CONTENDERS: usize = 6;

/// Chooses a combination; returns its index in [`Report::choices`]. With an error bound it is the one with the shortest median time that keeps the
/// bound, with a time bound the most accurate one. Combinations with too many changed rays are not considered, as in [`front`]. `refused`: indices of
/// combinations that must not be chosen.
///
/// # Errors
/// One line: no combination has both a time and an error by `measure`, or none that may be chosen keeps the bound. The message then names the most
/// accurate combination, or the fastest one for a time bound.
pub fn choose(report: &Report, measure: Measure, bound: Bound, refused: &[usize]) -> Result<usize, String> {
    let all: Vec<Candidate> = candidates(report, measure).collect();
    if all.is_empty() {
        return Err(match report.choices.iter().any(|c| c.times.is_some()) {
            true => format!("error report: no settings have an {}", measure.name()),
            false => format!("{}: no time was measured, this device has no time stamps", report.device),
        });
    }
    let open = |c: &&Candidate| !refused.contains(&c.index);
    let by_time = |a: &&Candidate, b: &&Candidate| a.times[1].total_cmp(&b.times[1]);
    let by_error = |a: &&Candidate, b: &&Candidate| a.error.total_cmp(&b.error).then(a.times[1].total_cmp(&b.times[1]));
    let describe = |c: &Candidate| report.choices[c.index].describe(measure);
    match bound {
        Bound::Error(error) => {
            let kept = |c: &&Candidate| c.error <= error && open(c);
            let fastest = |a: &&Candidate, b: &&Candidate| by_time(a, b).then(a.error.total_cmp(&b.error));
            let found = all.iter().filter(kept).min_by(fastest).ok_or_else(|| {
                let best = all.iter().min_by(by_error).map_or(String::new(), describe);
                format!("no settings hold {}: the most accurate are {best}", measure.format(error))
            })?;
            Ok(found.index)
        }
        Bound::Time(time) => {
            let kept = |c: &&Candidate| c.p95 * (1.0 + TIME_MARGIN) <= time && open(c);
            let found = all.iter().filter(kept).min_by(by_error).ok_or_else(|| {
                let best = all.iter().min_by(by_time).map_or(String::new(), describe);
                format!(
                    "no settings take {:.3} ms or less with a margin of {:.0} %: the fastest are {best}",
                    time * 1e-6,
                    100.0 * TIME_MARGIN
                )
            })?;
            Ok(found.index)
        }
    }
}

/// The combinations that may be the fastest within an error bound, as indices of [`Report::choices`]. Their error by `measure`, with the estimated
/// error of the reference added, is at most `error`, and the confidence interval of their time overlaps that of the fastest of them. The fastest is
/// first; there are at most [`MAX_CONTENDERS`]. More runs have to decide between them. `refused`: indices of combinations that must not be chosen.
pub fn contenders(report: &Report, measure: Measure, error: f64, refused: &[usize]) -> Vec<usize> {
    let mut kept: Vec<Candidate> =
        candidates(report, measure).filter(|c| c.error <= error && !refused.contains(&c.index)).collect();
    kept.sort_by(|a, b| a.times[1].total_cmp(&b.times[1]).then(a.error.total_cmp(&b.error)));
    let reach = kept.first().map_or(0.0, |fastest| fastest.times[2]);
    kept.into_iter().filter(|c| c.times[0] <= reach).map(|c| c.index).take(MAX_CONTENDERS).collect()
}

/// The Pareto front of the measured combinations by median time and error, from the fastest to the most accurate, as indices of [`Report::choices`].
/// A combination is left out if too many of its rays are changed: they hit another surface than the reference's, or only one of the two hits. The
/// limit is 0.1 % of the rays, or the share with the scene's own settings if that is larger.
pub fn front(report: &Report, measure: Measure) -> Vec<usize> {
    let all: Vec<Candidate> = candidates(report, measure).collect();
    let pairs: Vec<[f64; 2]> = all.iter().map(|c| [c.times[1], c.error]).collect();
    super::pareto_front(&pairs).into_iter().map(|i| all[i].index).collect()
}

struct Candidate {
    index: usize,
    /// The error, and that of its reference in addition: an upper limit.
    error: f64,
    /// Least, median and greatest, ns.
    times: [f64; 3],
    p95: f64,
}

fn candidates(report: &Report, measure: Measure) -> impl Iterator<Item = Candidate> {
    report.choices.iter().enumerate().filter(|(_, c)| keeps_surfaces(report, c)).filter_map(move |(index, c)| {
        let (error, time) = (c.error_limit(measure)?, c.times?.total);
        Some(Candidate { index, error, times: [time.low, time.median, time.high], p95: time.p95 })
    })
}

impl Combination {
    /// An upper limit of the combination's error by the triangle inequality: its error plus that of its reference. For levels it is nearly one. For
    /// distances and normals, whose reference has no error estimate, it is the error alone. None if the measure was not taken.
    pub(crate) fn error_limit(&self, measure: Measure) -> Option<f64> {
        let own = match measure {
            Measure::Rmse => self.reference_error.rmse,
            Measure::Levels => self.reference_error.levels,
            Measure::Mm | Measure::Degrees => 0.0,
        };
        measure.of(&self.errors).map(|error| error + own)
    }

    /// One line for the user, such as "(ray.step=0.25): RMSE 1.000e-3, 12.000 ms (95th percentile 13.100)".
    pub fn describe(&self, measure: Measure) -> String {
        let mut text =
            format!("({})", if self.set.is_empty() { "the scene as it is".into() } else { self.set.join(" ") });
        if let Some(error) = measure.of(&self.errors) {
            let _ = write!(text, ": {}", measure.format(error));
        }
        if let Some(times) = &self.times {
            let _ =
                write!(text, ", {:.3} ms (95th percentile {:.3})", times.total.median * 1e-6, times.total.p95 * 1e-6);
        }
        text
    }
}

/// Share of all pixels that find another surface than the reference, or none, which any choice may have: single rays at an edge.
const FEW_RAYS: f64 = 1e-3;

/// True if a choice has no more rays that find something else than the scene as it is: they are in no error of its picture.
fn keeps_surfaces(report: &Report, choice: &Combination) -> bool {
    let changed = |c: &Combination| c.errors.mm.map_or(0.0, |mm| mm.missed_hits + mm.false_hits + mm.jumps);
    changed(choice) <= report.choices.first().map_or(0.0, changed).max(FEW_RAYS)
}

/// Changes of several dials at once: index of the dial, and index of its point.
pub type Changes = Vec<(usize, usize)>;

/// Combinations to measure, at most `most` of them, but at least one. The first is the scene with its own settings. All others lie on the predicted
/// Pareto front of error and time. The prediction adds squares of errors, as for independent errors, and multiplies the time by the factor of each
/// change. With a bound, the half of the others that is predicted nearest to the bound comes next. The rest are spread evenly by rank over the front,
/// from the fastest to the most accurate.
pub fn proposals(dials: &[Dial], bound: Option<Bound>, most: usize) -> Vec<Changes> {
    let turned: Vec<usize> =
        (0..dials.len()).filter(|d| dials[*d].kind == Kind::Numerical && default(&dials[*d]).is_some()).collect();
    let mut all = vec![Proposal { changes: Vec::new(), square: 0.0, log_time: 0.0 }];
    for group in groups(dials, &turned) {
        let steps: Vec<Proposal> = group.iter().flat_map(|d| steps(*d, &dials[*d])).collect();
        let longer = |a: &Proposal, b: &Proposal| Proposal {
            changes: a.changes.iter().chain(&b.changes).copied().collect(),
            square: a.square + b.square,
            log_time: a.log_time + b.log_time,
        };
        let with = all.iter().flat_map(|a| steps.iter().map(move |b| longer(a, b))).collect::<Vec<_>>();
        all.extend(with);
        all = thinned(all);
    }
    // The dials' defaults differ from one another: each is against its own reference.
    let defaults = turned.iter().filter_map(|d| default(&dials[*d]));
    let (square, time) =
        defaults.fold((0.0f64, 0.0f64), |(s, t), (error, times)| (s.max(error.powi(2)), t.max(times.total.median)));
    let away = |p: &Proposal| match bound {
        Some(Bound::Error(error)) => ((p.square + square).max(0.0).sqrt().max(1e-12) / error).ln().abs(),
        Some(Bound::Time(limit)) => (p.log_time.exp() * time / limit).ln().abs(),
        None => 0.0,
    };
    let mut kept = vec![Vec::new()];
    let rest: Vec<&Proposal> = all.iter().filter(|p| !p.changes.is_empty()).collect();
    let count = rest.len().min(most.saturating_sub(1));
    let mut near: Vec<&Proposal> = rest.clone();
    near.sort_by(|a, b| away(a).total_cmp(&away(b)));
    // Half of them near the bound, the others from end to end.
    let nearest = if bound.is_some() { count / 2 } else { 0 };
    let even = (0..count - nearest).map(|i| rest[i * (rest.len() - 1) / (count - nearest).max(2).saturating_sub(1)]);
    for p in near.iter().take(nearest).copied().chain(even) {
        if !kept.contains(&p.changes) {
            kept.push(p.changes.clone());
        }
    }
    kept
}

/// What is predicted for some changes, relative to the scene as it is.
struct Proposal {
    changes: Changes,
    /// Change of the squared error; negative where the error falls.
    square: f64,
    log_time: f64,
}

/// RMSE and median times of the default point.
fn default(dial: &Dial) -> Option<(f64, Times)> {
    let point = dial.points.iter().find(|p| p.is_default)?;
    Some((point.errors.rmse, point.times?)).filter(|(_, times)| times.total.median > 0.0)
}

fn steps(index: usize, dial: &Dial) -> Vec<Proposal> {
    let Some((error, times)) = default(dial) else { return Vec::new() };
    // A ratio whose interval holds 1 is none.
    let beyond_noise = |r: Time| if r.low <= 1.0 && r.high >= 1.0 { 1.0 } else { r.median };
    let step = |(p, point): (usize, &Point)| {
        let (volume, picture) = (times.volume.median, times.picture.median);
        let ratios = point.ratios?;
        let changed = volume * beyond_noise(ratios.volume) + picture * beyond_noise(ratios.picture);
        let log_time = (changed / (volume + picture)).max(1e-9).ln();
        let square = point.errors.rmse.powi(2) - error.powi(2);
        (!point.is_default).then(|| Proposal { changes: vec![(index, p)], square, log_time })
    };
    dial.points.iter().enumerate().filter_map(step).collect()
}

/// Dials that assign the same keys (or tables around them) exclude one another.
fn groups(dials: &[Dial], turned: &[usize]) -> Vec<Vec<usize>> {
    let keys = |d: usize| {
        let sets = dials[d].points.iter().flat_map(|p| &p.set);
        sets.filter_map(|s| s.split_once('=')).map(|(key, _)| key.trim().to_string()).collect::<Vec<_>>()
    };
    let clash = |a: &str, b: &str| {
        let within = |a: &str, b: &str| b.strip_prefix(a).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        within(a, b) || within(b, a)
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for d in turned {
        let meets = |group: &Vec<usize>| {
            group.iter().any(|other| keys(*d).iter().any(|a| keys(*other).iter().any(|b| clash(a, b))))
        };
        let (met, mut apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(meets);
        apart.push(met.into_iter().flatten().chain([*d]).collect());
        groups = apart;
    }
    groups
}

/// The predicted front, from the fastest to the most accurate. Both sums are additive, so what is dominated on the way stays dominated.
fn thinned(mut all: Vec<Proposal>) -> Vec<Proposal> {
    all.sort_by(|a, b| a.log_time.total_cmp(&b.log_time).then(a.square.total_cmp(&b.square)));
    let mut kept: Vec<Proposal> = Vec::new();
    for p in all {
        match kept.last() {
            Some(last) if last.square <= p.square => {}
            Some(last) if p.log_time - last.log_time < SAME_TIME => {
                kept.pop();
                kept.push(p);
            }
            _ => kept.push(p),
        }
    }
    kept
}
