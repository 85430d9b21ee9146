//! Planes with places in space, in any order, as the slices of one or more Cartesian volumes.

use glam::DVec3;
use std::collections::BTreeMap;

/// Largest distance of a plane from its place in an even stack, slices.
const MAX_OFF: f64 = 0.01;
/// Places that differ by no more are the same, mm.
const SAME: f64 = 1e-4;
/// Largest difference of two directions.
const SAME_DIRECTION: f64 = 1e-4;

/// A picture that is a slice of a volume, with its position and orientation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// Position of the centre of the first pixel, mm. All vectors here are in the patient's space, or in that of the volume if the
    /// file does not place it in the patient.
    pub position: DVec3,
    /// Unit vector along a row, towards larger columns; `column` is the one towards larger rows.
    pub row: DVec3,
    pub column: DVec3,
    /// Index in time of the volume that the plane belongs to; None if the file does not state it.
    pub index: Option<u32>,
    /// Temporal Position Time Offset (0020,930D), s, from a zero that the file chooses; None if the file does not state it.
    pub time: Option<f64>,
}

/// The order in which planes are the slices of volumes.
#[derive(Debug)]
pub(super) struct Sorted {
    /// For each slice the index of its plane, volume after volume.
    pub order: Vec<usize>,
    pub slices: usize,
    pub volumes: usize,
    /// Vector from a slice to the next, mm. None for a single slice.
    pub step: Option<DVec3>,
    /// Time stamp of each slice, s, by its index in `order`; no entry if it has none.
    pub times: BTreeMap<usize, f64>,
}

/// Sorts planes by time, and those of a volume along their normal.
///
/// # Errors
/// One line: there are no planes, they are not parallel or not evenly spaced, or the volumes have different slices.
pub(super) fn sorted(planes: &[Plane]) -> Result<Sorted, String> {
    let Some(first) = planes.first() else { return Err("there are none".into()) };
    let finite = |p: &Plane| p.position.is_finite() && p.row.is_finite() && p.column.is_finite();
    if !planes.iter().all(finite) {
        return Err("one has a number that is not finite".into());
    }
    let is_apart = |a: DVec3, b: DVec3| a.distance(b) > SAME_DIRECTION;
    if planes.iter().any(|p| is_apart(p.row, first.row) || is_apart(p.column, first.column)) {
        return Err("they are not parallel to each other".into());
    }
    let normal = first.row.cross(first.column).normalize_or_zero();
    let along = |n: &usize| planes[*n].position.dot(normal);
    let mut all: Vec<usize> = (0..planes.len()).collect();
    all.sort_by(|a, b| along(a).total_cmp(&along(b)));
    let volumes = in_time(planes, all, along);
    let slices = volumes.values().next().map_or(0, Vec::len);
    let reference: Vec<DVec3> = volumes.values().flatten().take(slices).map(|n| planes[*n].position).collect();
    for (number, volume) in volumes.values().enumerate() {
        if volume.len() != slices {
            return Err(format!("volume {number} in time has {} slices, the first has {slices}", volume.len()));
        }
        if volume.iter().zip(&reference).any(|(n, there)| planes[*n].position.distance(*there) > SAME) {
            return Err(format!("volume {number} in time lies elsewhere than the first"));
        }
    }
    let step = match reference.as_slice() {
        [first, .., last] => Some((*last - *first) / (slices - 1) as f64),
        _ => None,
    };
    if let (Some(step), Some(first)) = (step, reference.first()) {
        let off = reference.iter().enumerate().map(|(n, p)| p.distance(*first + step * n as f64));
        let off = off.fold(0.0, f64::max);
        if step.length() <= SAME || off > MAX_OFF * step.length() {
            return Err(format!("they are not evenly spaced: one of {slices} is {off:.3} mm off its place"));
        }
    }
    let order: Vec<usize> = volumes.values().flatten().copied().collect();
    let times = order.iter().enumerate().filter_map(|(place, n)| Some((place, planes[*n].time?))).collect();
    Ok(Sorted { order, slices, volumes: volumes.len(), step, times })
}

/// The planes of each volume in time, in the order of `all`: by the stated number, else by the time, else one after another where
/// several are at one place.
fn in_time(planes: &[Plane], all: Vec<usize>, along: impl Fn(&usize) -> f64) -> BTreeMap<u64, Vec<usize>> {
    let mut volumes: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    let has_index = planes.iter().all(|p| p.index.is_some());
    let mut times: Vec<f64> = planes.iter().filter_map(|p| p.time).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    // A time for every plane of its own would be one volume for each.
    let has_times = planes.iter().all(|p| p.time.is_some()) && planes.len().is_multiple_of(times.len().max(1));
    let has_times = has_times && times.len() < planes.len();
    let (mut last, mut copies) = (f64::NAN, 0);
    for n in all {
        let here = along(&n);
        copies = if (here - last).abs() <= SAME { copies + 1 } else { 0 };
        last = here;
        let key = match (planes[n].index, planes[n].time) {
            (Some(index), _) if has_index => u64::from(index),
            (_, Some(time)) if has_times => times.partition_point(|t| *t < time) as u64,
            _ => copies,
        };
        volumes.entry(key).or_default().push(n);
    }
    volumes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(z: f64, index: Option<u32>, time: Option<f64>) -> Plane {
        Plane { position: DVec3::new(3.0, 4.0, z), row: DVec3::X, column: DVec3::Y, index, time }
    }

    #[test]
    fn planes_are_sorted_by_volume_and_place() {
        let at = [(2.0, 2), (0.0, 1), (1.0, 2), (2.0, 1), (0.0, 2), (1.0, 1)];
        let planes: Vec<Plane> = at.iter().map(|(z, t)| plane(*z, Some(*t), Some(f64::from(*t) * 0.5))).collect();
        let found = sorted(&planes).expect("even");
        assert_eq!((found.order.as_slice(), found.slices, found.volumes), ([1, 5, 3, 4, 2, 0].as_slice(), 3, 2));
        assert_eq!((found.step, found.times[&0], found.times[&3]), (Some(DVec3::Z), 0.5, 1.0));
        // By the times alone, and by nothing but the order in the file.
        for hide in [|p: Plane| Plane { index: None, ..p }, |p: Plane| Plane { index: None, time: None, ..p }] {
            let planes: Vec<Plane> = planes.iter().copied().map(hide).collect();
            assert_eq!(sorted(&planes).expect("even").volumes, 2);
        }
    }

    #[test]
    fn what_is_no_even_stack_is_refused() {
        let of = |places: &[f64]| sorted(&places.iter().map(|z| plane(*z, None, None)).collect::<Vec<_>>());
        assert_eq!(of(&[5.0]).expect("one").step, None);
        assert!(of(&[0.0, 1.0, 3.0]).is_err_and(|why| why.contains("evenly")));
        assert!(of(&[0.0, f64::NAN]).is_err());
        assert!(of(&[]).is_err());
        assert!(of(&[0.0, 0.0, 1.0]).is_err_and(|why| why.contains("has 1 slices")));
        let mut planes = vec![plane(0.0, None, None), plane(1.0, None, None)];
        planes[1].row = DVec3::new(0.8, 0.6, 0.0);
        assert!(sorted(&planes).is_err_and(|why| why.contains("parallel")));
        let moved = [(0.0, 1), (1.0, 1), (0.5, 2), (1.5, 2)].map(|(z, t)| plane(z, Some(t), None));
        assert!(sorted(&moved).is_err_and(|why| why.contains("elsewhere")));
    }
}
