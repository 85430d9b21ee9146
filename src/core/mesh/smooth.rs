//! A Gaussian filter over the slices of a lattice in their order, as a normalized convolution that leaves out unknown values.

use rayon::prelude::*;
use std::collections::VecDeque;

/// Reach of the kernel, standard deviations.
const REACH: f64 = 3.0;

/// Smooths a volume with a Gaussian, slice by slice. It keeps as many slices in memory as the kernel has taps.
pub struct Smoother {
    width: usize,
    /// Half kernels along the axes: the weight of the middle, then of each distance. They are not normalized.
    kernels: [Vec<f64>; 3],
    depth: usize,
    /// Slices smoothed within themselves, and the number of the first of them.
    slices: VecDeque<Vec<f64>>,
    first: usize,
}

impl Smoother {
    /// For a lattice of `size` voxels with this `spacing` along each axis, mm. `deviation`: standard deviation of the Gaussian, mm; 0 changes
    /// nothing.
    pub fn new(size: [usize; 3], spacing: [f64; 3], deviation: f64) -> Smoother {
        let kernel = |axis: usize| {
            let sigma = deviation / spacing[axis];
            let reach = ((REACH * sigma).ceil() as usize).min(size[axis].saturating_sub(1));
            let weight = |n: usize| if n == 0 { 1.0 } else { (-0.5 * (n as f64 / sigma).powi(2)).exp() };
            (0..=reach).map(weight).collect()
        };
        Smoother { width: size[0], kernels: [0, 1, 2].map(kernel), depth: size[2], slices: VecDeque::new(), first: 0 }
    }

    /// Writes the smoothed slice `z` to `out`. Slices must be requested in rising order. `raw(n, slice)` fills `slice` with the values of slice n
    /// before smoothing, NaN where they are not known; these stay NaN.
    pub fn slice(&mut self, z: usize, out: &mut [f64], raw: impl Fn(usize, &mut [f64])) {
        let reach = self.kernels[2].len() - 1;
        let (from, to) = (z.saturating_sub(reach), (z + reach).min(self.depth.saturating_sub(1)));
        while self.first + self.slices.len() <= to {
            let next = self.first + self.slices.len();
            raw(next, out);
            self.slices.push_back(self.within(out));
        }
        while self.first < from {
            self.slices.pop_front();
            self.first += 1;
        }
        let (slices, kernel, first) = (&self.slices, &self.kernels[2], self.first);
        let width = self.width.max(1);
        out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let row = |k: usize| &slices[k - first][y * width..][..out.len()];
            let mean = Mean::of(out.len(), (from..=to).map(|k| (row(k), kernel[k.abs_diff(z)])));
            mean.over(row(z), out);
        });
    }

    /// A slice smoothed along its rows and columns.
    fn within(&self, slice: &[f64]) -> Vec<f64> {
        let [along, down, _] = &self.kernels;
        let width = self.width.max(1);
        let (height, reach) = (slice.len() / width, down.len() - 1);
        let mut rows = vec![f64::NAN; slice.len()];
        rows.par_chunks_mut(width).zip(slice.par_chunks(width)).for_each(|(out, row)| {
            let mut mean = Mean::new(width);
            for (k, weight) in (1 - along.len() as isize..).zip(along.iter().rev().chain(&along[1..])) {
                // What lies k further along, where that is within the row.
                let (to, from) = ((-k).max(0) as usize, k.max(0) as usize);
                mean.add(to, &row[from..width - to], *weight);
            }
            mean.over(row, out);
        });
        let mut smoothed = vec![f64::NAN; slice.len()];
        smoothed.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let row = |k: usize| &rows[k * width..][..width];
            let near = y.saturating_sub(reach)..(y + reach + 1).min(height);
            Mean::of(width, near.map(|k| (row(k), down[k.abs_diff(y)]))).over(row(y), out);
        });
        smoothed
    }
}

/// Weighted means of the known values of rows, one for each place.
struct Mean {
    sums: Vec<f64>,
    weights: Vec<f64>,
}

impl Mean {
    fn new(width: usize) -> Mean {
        Mean { sums: vec![0.0; width], weights: vec![0.0; width] }
    }

    fn of<'a>(width: usize, rows: impl Iterator<Item = (&'a [f64], f64)>) -> Mean {
        let mut mean = Mean::new(width);
        rows.for_each(|(row, weight)| mean.add(0, row, weight));
        mean
    }

    /// Adds values to the means from a place on. Without a branch, so that several are added at once.
    fn add(&mut self, from: usize, values: &[f64], weight: f64) {
        let means = self.sums[from..].iter_mut().zip(&mut self.weights[from..]);
        for ((sum, weights), value) in means.zip(values) {
            let is_known = !value.is_nan();
            *sum += if is_known { weight * value } else { 0.0 };
            *weights += if is_known { weight } else { 0.0 };
        }
    }

    /// Writes the means where a row is known.
    fn over(&self, row: &[f64], out: &mut [f64]) {
        for (n, out) in out.iter_mut().enumerate() {
            *out = if row[n].is_nan() { f64::NAN } else { self.sums[n] / self.weights[n] };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function of the voxel, smoothed.
    fn smoothed(size: [usize; 3], deviation: f64, value: impl Fn([usize; 3]) -> f64) -> Vec<Vec<f64>> {
        let mut smoother = Smoother::new(size, [0.5, 1.0, 2.0], deviation);
        let raw = |z: usize, out: &mut [f64]| {
            out.iter_mut().enumerate().for_each(|(n, out)| *out = value([n % size[0], n / size[0], z]));
        };
        let slice = |z| {
            let mut out = vec![0.0; size[0] * size[1]];
            smoother.slice(z, &mut out, raw);
            out
        };
        (0..size[2]).map(slice).collect()
    }

    #[test]
    fn a_point_becomes_a_gaussian_in_mm() {
        let size = [41, 21, 11];
        let out = smoothed(size, 1.5, |at| f64::from(u8::from(at == [20, 10, 5])));
        let at = |[x, y, z]: [usize; 3]| out[z][y * size[0] + x];
        let top = at([20, 10, 5]);
        // One, two and four thirds of a standard deviation away, and out of reach.
        let places: [([usize; 3], f64); 4] = [
            ([23, 10, 5], (-0.5f64).exp()),
            ([20, 13, 5], (-2.0f64).exp()),
            ([20, 10, 6], (-8.0 / 9.0f64).exp()),
            ([0, 0, 0], 0.0),
        ];
        for (place, share) in places {
            assert!((at(place) / top - share).abs() < 1e-12, "{place:?}: {} {share}", at(place) / top);
        }
    }

    #[test]
    fn constants_stay_and_the_unknown_is_left_out() {
        let out = smoothed([7, 6, 5], 1.2, |[x, y, z]| if x + y + z == 6 { f64::NAN } else { 3.25 });
        for (z, slice) in out.iter().enumerate() {
            for (n, value) in slice.iter().enumerate() {
                let is_unknown = n % 7 + n / 7 + z == 6;
                assert!(if is_unknown { value.is_nan() } else { (value - 3.25).abs() < 1e-12 }, "{n} {z}: {value}");
            }
        }
        let as_it_is = smoothed([4, 3, 2], 0.0, |[x, y, z]| (x + 4 * (y + 3 * z)) as f64);
        assert_eq!(as_it_is.concat(), (0..24).map(f64::from).collect::<Vec<_>>());
    }
}
