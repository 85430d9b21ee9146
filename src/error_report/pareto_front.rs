//! The Pareto front: what no other point beats in both error and time.

use super::{Measure, Report};

/// Indices of the pairs that no other pair dominates (is at most as large in both and smaller in one), in order of the first
/// value; equal pairs all stay, in the order given. Pairs that are not finite are never on it.
pub fn front(pairs: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..pairs.len()).filter(|i| pairs[*i].iter().all(|v| v.is_finite())).collect();
    // A stable sort: equal pairs keep their order.
    order.sort_by(|a, b| pairs[*a][0].total_cmp(&pairs[*b][0]).then(pairs[*a][1].total_cmp(&pairs[*b][1])));
    let mut kept: Vec<usize> = Vec::new();
    for i in order {
        let beaten = kept.last().is_some_and(|last| pairs[*last][1] <= pairs[i][1] && pairs[*last] != pairs[i]);
        if !beaten {
            kept.push(i);
        }
    }
    kept
}

/// The front over all dials of a report: dial and point, from the fastest to the most accurate. Points without a time or
/// without this error are not on it.
pub fn of_report(report: &Report, measure: Measure) -> Vec<(usize, usize)> {
    let mut places = Vec::new();
    let mut pairs = Vec::new();
    for (d, dial) in report.dials.iter().enumerate() {
        for (p, point) in dial.points.iter().enumerate() {
            if let (Some(time), Some(error)) = (point.time, measure.of(&point.errors)) {
                places.push((d, p));
                pairs.push([time.median, error]);
            }
        }
    }
    front(&pairs).into_iter().map(|i| places[i]).collect()
}
