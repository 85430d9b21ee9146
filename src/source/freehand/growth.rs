//! Growth of a freehand volume around pictures that leave it.

use super::lattice::MAX_EDGE;
use super::{Compounder, Lattice, MAX_VOXELS, Pose, Sticks, Voxels};
use crate::probe::Grid;
use glam::DVec3;

/// Least share of its length that a volume grows by along an axis: whoever shows it begins again each time.
const LEAST_GROWTH: f64 = 0.25;
/// How much coarser the voxels become when there would be too many: there is room for twice the volume then.
const COARSER: f64 = 1.26;
/// How many times as coarse they may become in all.
const MAX_COARSENING: f64 = 2.01;

impl Compounder {
    /// Enlarges the volume until it contains a picture of this pose. Returns false, without a change, if the volume would have more than 2048
    /// voxels along an edge, or more voxels than its options allow even at twice its first spacing. A pose that [`Compounder::push`] refuses
    /// changes nothing and gives true.
    ///
    /// Memory: that of both volumes while the old one is copied to the new one.
    pub(crate) fn grow_around(&mut self, pose: &Pose) -> bool {
        let Some([low, high]) = self.reach_of(pose) else { return true };
        let last = DVec3::from(self.lattice.grid.size.map(|n| n as f64 - 1.0));
        if low.cmpge(DVec3::splat(-0.5)).all() && high.cmple(last + 0.5).all() {
            return true;
        }
        match self.grown(low, high, last) {
            Some(grid) => self.take_grid(grid).is_ok(),
            None => false,
        }
    }

    /// The corners of the box around a picture, in voxels. None of a picture that is refused.
    fn reach_of(&self, pose: &Pose) -> Option<[DVec3; 2]> {
        pose.check().ok()?;
        let corners = pose.corners(pose.clipped(self.options.clip).ok()?).map(|corner| self.lattice.index_of(corner));
        Some([corners.into_iter().fold(corners[0], DVec3::min), corners.into_iter().fold(corners[0], DVec3::max)])
    }

    /// The grid with more voxels, or coarser ones, from `low` to `high` and beyond where these are outside of it.
    fn grown(&self, low: DVec3, high: DVec3, last: DVec3) -> Option<Grid> {
        let Grid { size, spacing, origin } = self.lattice.grid;
        let most = self.options.max_voxels.min(MAX_VOXELS);
        let more = |axis: usize, beyond: f64| match beyond > 0.5 {
            true => (beyond + (LEAST_GROWTH * size[axis] as f64).max(self.options.margin / spacing[axis])).ceil(),
            false => 0.0,
        };
        let before = [0, 1, 2].map(|a| more(a, -low[a]));
        let after = [0, 1, 2].map(|a| more(a, high[a] - last[a]));
        let count = [0, 1, 2].map(|a| before[a] + size[a] as f64 + after[a]);
        let begin = [0, 1, 2].map(|a| origin[a] - before[a] * spacing[a]);
        if count.iter().product::<f64>() <= most as f64 && count.iter().all(|n| *n <= MAX_EDGE) {
            return Some(Grid { size: count.map(|n| n as usize), spacing, origin: begin });
        }
        let end = DVec3::from_array([0, 1, 2].map(|a| begin[a] + (count[a] - 1.0) * spacing[a]));
        let coarse = super::lattice::grid(begin.into(), end, DVec3::from(spacing) * COARSER, most).ok()?;
        (coarse.spacing[0] <= self.first_spacing * MAX_COARSENING).then_some(coarse)
    }

    /// Moves the pixels so far into another grid. With the same spacing they stay exactly what they are; otherwise each voxel is one pixel of the
    /// new ones.
    fn take_grid(&mut self, grid: Grid) -> Result<(), String> {
        grid.check().map_err(|e| e.fault)?;
        let sticks = Sticks::new(&grid, self.options.max_hole)?;
        let old = self.lattice.grid;
        let mut voxels = Voxels::new(grid.size);
        let mut touched = vec![false; grid.size[2]];
        let offset = (DVec3::from(old.origin) - DVec3::from(grid.origin)) / DVec3::from(grid.spacing);
        if grid.spacing == old.spacing {
            voxels.copy(&self.voxels, offset.to_array().map(|n| n.round() as usize), &mut touched);
        } else {
            let scale = DVec3::from(old.spacing) / DVec3::from(grid.spacing);
            let [width, height, depth] = old.size;
            for (z, y, x) in (0..depth).flat_map(|z| (0..height).flat_map(move |y| (0..width).map(move |x| (z, y, x))))
            {
                let Some((value, weight)) = self.voxels.weighed((z * height + y) * width + x) else { continue };
                let at = DVec3::new(x as f64, y as f64, z as f64) * scale + offset;
                voxels.splat(at, value, weight, &mut touched);
            }
        }
        let [x, y, z] = grid.size;
        (self.slices, self.zero) = (vec![Vec::new(); z], vec![0; x * y * self.stored.bytes()]);
        (self.lattice.grid, self.voxels, self.sticks, self.touched) = (grid, voxels, sticks, touched);
        Ok(())
    }
}

impl Lattice {
    /// The fractional voxel index of a position in the tracker's space, mm.
    pub(super) fn index_of(&self, place: DVec3) -> DVec3 {
        (self.to_volume.transform_point3(place) - DVec3::from(self.grid.origin)) / DVec3::from(self.grid.spacing)
    }
}

impl Voxels {
    /// Takes all voxels of a smaller volume whose first one is voxel `first` of this one.
    fn copy(&mut self, old: &Voxels, first: [usize; 3], touched: &mut [bool]) {
        let ([width, height, _], [old_width, old_height, _]) = (self.size, old.size);
        for (n, [left, right]) in old.rows.iter().enumerate().filter(|(_, [left, right])| left <= right) {
            let (y, z) = (n % old_height + first[1], n / old_height + first[2]);
            let (from, to) = (n * old_width, (z * height + y) * width + first[0]);
            self.sums[to..to + old_width].copy_from_slice(&old.sums[from..from + old_width]);
            self.rows[z * height + y] = [left + first[0] as u32, right + first[0] as u32];
            touched[z] = true;
        }
    }

    /// Value and weight of voxel `n`, if it has pixels.
    fn weighed(&self, n: usize) -> Option<(f32, f32)> {
        self.sums.get(n).filter(|[_, weight]| *weight > 0.0).map(|[sum, weight]| (sum / weight, *weight))
    }
}
