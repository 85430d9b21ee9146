//! Voxels that pixels are given to.

use super::{COUNTS, FORGET, Overlap, Splat, WEIGHTLESS};
use glam::DVec3;

/// Weighted sums, lateral fastest, then depth, then elevation.
pub(super) struct Voxels {
    pub size: [usize; 3],
    overlap: Overlap,
    /// Sum of weighted values, and of weights; the second is 0 where nothing came.
    sums: Vec<[f32; 2]>,
    /// The frame that a voxel's sums are of; only with [`Overlap::Latest`].
    frames: Vec<u32>,
    frame: u32,
    /// By row: lowest and highest lateral index that anything came to; reversed where nothing did.
    rows: Vec<[u32; 2]>,
}

impl Voxels {
    pub fn new(size: [usize; 3], overlap: Overlap) -> Voxels {
        let [x, y, z] = size;
        let frames = if overlap == Overlap::Latest { vec![0; x * y * z] } else { Vec::new() };
        Voxels { size, overlap, sums: vec![[0.0; 2]; x * y * z], frames, frame: 0, rows: vec![[u32::MAX, 0]; y * z] }
    }

    /// What follows is of another frame.
    pub fn begin(&mut self) {
        // 0 is of none.
        self.frame = self.frame.wrapping_add(1).max(1);
    }

    /// Gives a pixel's value to the voxels around a place, in indices. `touched`: slices that something came to. False: no voxel is there.
    pub fn splat(&mut self, at: DVec3, value: f32, splat: Splat, touched: &mut [bool]) -> bool {
        let size = DVec3::from_array(self.size.map(|n| n as f64));
        // No voxel is within reach. NaN is in no range.
        if !(at.cmpgt(DVec3::NEG_ONE).all() && at.cmplt(size).all()) {
            return false;
        }
        if splat == Splat::Nearest {
            let near = (at + 0.5).floor();
            return near.cmpge(DVec3::ZERO).all() && near.cmplt(size).all() && {
                self.add(near.to_array().map(|n| n as usize), value, 1.0, touched);
                true
            };
        }
        let (low, mut inside) = (at.floor(), false);
        let share = (at - low).to_array();
        let low = low.to_array().map(|n| n as isize);
        for corner in 0..8usize {
            let high = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let weight: f64 = (0..3).map(|a| if high[a] == 1 { share[a] } else { 1.0 - share[a] }).product();
            let cell = [0, 1, 2].map(|a| low[a] + high[a] as isize);
            let there = (0..3).all(|a| cell[a] >= 0 && (cell[a] as usize) < self.size[a]);
            if weight >= WEIGHTLESS && there {
                self.add(cell.map(|n| n as usize), value, weight as f32, touched);
                inside = true;
            }
        }
        inside
    }

    fn add(&mut self, [x, y, z]: [usize; 3], value: f32, weight: f32, touched: &mut [bool]) {
        let row = z * self.size[1] + y;
        let n = row * self.size[0] + x;
        let sums = &mut self.sums[n];
        match self.overlap {
            Overlap::Mean => {}
            Overlap::Latest if self.frames[n] != self.frame => {
                self.frames[n] = self.frame;
                *sums = [0.0; 2];
            }
            Overlap::Latest => {}
            Overlap::Maximum if weight < COUNTS || (sums[1] > 0.0 && sums[0] >= value) => return,
            Overlap::Maximum => *sums = [0.0; 2],
        }
        let weight = if self.overlap == Overlap::Maximum { 1.0 } else { weight };
        *sums = [sums[0] + value * weight, sums[1] + weight];
        if sums[1] > FORGET {
            *sums = sums.map(|sum| sum / 2.0);
        }
        let [first, last] = self.rows[row];
        self.rows[row] = [first.min(x as u32), last.max(x as u32)];
        touched[z] = true;
    }

    /// The value of voxel `n` of all, if anything came to it.
    pub fn value(&self, n: usize) -> Option<f32> {
        self.sums.get(n).filter(|[_, weight]| *weight > 0.0).map(|[sum, weight]| sum / weight)
    }

    /// Lowest and highest lateral and depth index, ends included, that anything came to in some slices.
    pub fn bounds(&self, slices: std::ops::Range<usize>) -> Option<[[usize; 2]; 2]> {
        let depth = self.size[1];
        let rows = self.rows.get(slices.start * depth..slices.end * depth)?;
        let mut bounds: Option<[[usize; 2]; 2]> = None;
        for (n, [first, last]) in rows.iter().enumerate().filter(|(_, [first, last])| first <= last) {
            let (first, last, y) = (*first as usize, *last as usize, n % depth);
            let [x_bounds, y_bounds] = bounds.unwrap_or([[first, last], [y, y]]);
            let x_bounds = [x_bounds[0].min(first), x_bounds[1].max(last)];
            bounds = Some([x_bounds, [y_bounds[0].min(y), y_bounds[1].max(y)]]);
        }
        bounds
    }
}
