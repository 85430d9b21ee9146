//! Distances of voxels from a set of voxels, exact up to a reach.

use rayon::prelude::*;

/// For each voxel of a lattice the distance, centre to centre, from the nearest voxel of a set, mm; infinite if that is more than `reach` away
/// along an axis. The squared distance is separable: a minimum along each axis in turn.
pub(crate) fn distances(
    size: [usize; 3],
    spacing: [f64; 3],
    reach: f64,
    is_in: impl Fn(usize) -> bool + Sync,
) -> Vec<f32> {
    let [width, height, depth] = size;
    let slice = width * height;
    let steps: [Vec<f32>; 3] = [0, 1, 2].map(|axis| {
        let count = ((reach / spacing[axis]).floor() as usize).min(size[axis] - 1);
        (0..=count).map(|n| (n as f64 * spacing[axis]).powi(2) as f32).collect()
    });
    let mut within = vec![f32::INFINITY; slice * depth];
    within.par_chunks_mut(slice).enumerate().for_each(|(z, out)| {
        let set: Vec<f32> = (0..slice).map(|n| if is_in(z * slice + n) { 0.0 } else { f32::INFINITY }).collect();
        if set.iter().all(|value| value.is_infinite()) {
            return;
        }
        let mut rows = vec![f32::INFINITY; slice];
        for (row, out) in set.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            if row.iter().all(|value| value.is_infinite()) {
                continue;
            }
            for (n, step) in steps[0].iter().enumerate() {
                lower(&mut out[n..], &row[..width - n], *step);
                lower(&mut out[..width - n], &row[n..], *step);
            }
        }
        for (y, out) in out.chunks_exact_mut(width).enumerate() {
            lowest(out, &steps[1], y, height, |y| &rows[y * width..][..width]);
        }
    });
    let mut found = vec![f32::INFINITY; slice * depth];
    found.par_chunks_mut(slice).enumerate().for_each(|(z, out)| {
        for (y, out) in out.chunks_exact_mut(width).enumerate() {
            lowest(out, &steps[2], z, depth, |z| &within[z * slice + y * width..][..width]);
            out.iter_mut().for_each(|value| *value = value.sqrt());
        }
    });
    found
}

/// The least sums of the rows around one of `count` and what their distance adds. Ends where further rows cannot be less.
fn lowest<'a>(out: &mut [f32], steps: &[f32], at: usize, count: usize, row: impl Fn(usize) -> &'a [f32]) {
    for (n, step) in steps.iter().enumerate() {
        if out.iter().all(|value| value <= step) {
            return;
        }
        let near = [at.checked_sub(n), Some(at + n).filter(|at| *at < count)];
        near.into_iter().flatten().for_each(|at| lower(out, row(at), *step));
    }
}

/// Without a branch, so that several are compared at once.
fn lower(least: &mut [f32], values: &[f32], more: f32) {
    for (least, value) in least.iter_mut().zip(values) {
        *least = least.min(value + more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_the_nearest_voxel_up_to_the_reach() {
        let (size, spacing) = ([9, 8, 7], [0.5, 1.0, 1.5]);
        let set = [[2, 3, 1], [7, 0, 6], [8, 7, 0]];
        let place = |[x, y, z]: [usize; 3]| [x as f64 * 0.5, y as f64, z as f64 * 1.5];
        let number = |[x, y, z]: [usize; 3]| (z * 8 + y) * 9 + x;
        let found = distances(size, spacing, 100.0, |n| set.iter().any(|at| number(*at) == n));
        for (n, found) in found.iter().enumerate() {
            let here = place([n % 9, n / 9 % 8, n / 72]);
            let from = |at: &[usize; 3]| (0..3).map(|a| (place(*at)[a] - here[a]).powi(2)).sum::<f64>().sqrt();
            let truth = set.iter().map(from).fold(f64::INFINITY, f64::min);
            assert!((f64::from(*found) - truth).abs() < 1e-5, "{n}: {found}, {truth}");
        }
        let near = distances(size, spacing, 1.0, |n| n == number([2, 3, 1]));
        assert_eq!((near[number([4, 3, 1])], near[number([5, 3, 1])]), (1.0, f32::INFINITY));
    }
}
