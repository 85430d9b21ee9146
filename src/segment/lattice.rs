//! Voxels of a lattice: their number, their places, and boxes of them.

use crate::probe::{Geometry, Grid};
use crate::source::convert;
use glam::DVec3;

/// Most voxels of a lattice: their numbers fit into 32 bits.
const MAX_VOXELS: usize = 1 << 30;

/// Voxel spacing for a sweep, mm: finer than its beam.
const SPACING: f64 = 0.5;

/// The lattice on which a volume is segmented: its own, or that of a box around a sweep with voxels of 0.5 mm.
///
/// # Errors
/// One line: there would be too many voxels.
pub fn usual_grid(geometry: &Geometry) -> Result<Grid, String> {
    match geometry {
        Geometry::Cartesian(grid) => Ok(*grid),
        Geometry::Sweep(_) => convert::lattice(geometry, SPACING),
    }
}

/// The part of a grid whose voxels have their centres between the lowest and the highest corner, inclusive; None if there are none. Corners are in mm
/// in the coordinates of the grid.
pub fn cropped(grid: &Grid, corners: [DVec3; 2]) -> Option<Grid> {
    let Region { low, size } = Region::within(grid, corners)?;
    let origin = place(grid, DVec3::from(low.map(|n| n as f64))).to_array();
    Some(Grid { size, origin, ..*grid })
}

/// The number of voxels of a grid.
///
/// # Errors
/// One line: the grid is not valid, or has too many voxels.
pub(crate) fn voxels(grid: &Grid) -> Result<usize, String> {
    grid.check().map_err(|e| format!("the {} of the lattice {}", e.field, e.fault))?;
    let [x, y, z] = grid.size;
    let count = x.checked_mul(y).and_then(|n| n.checked_mul(z)).filter(|n| *n <= MAX_VOXELS);
    count.ok_or_else(|| format!("{x} x {y} x {z} voxels are too many: at most {MAX_VOXELS}"))
}

/// The position of a fractional voxel index, mm, in the coordinates of the grid.
pub(crate) fn place(grid: &Grid, at: DVec3) -> DVec3 {
    DVec3::from(grid.origin) + at * DVec3::from(grid.spacing)
}

/// The volume of a voxel, mm^3.
pub(crate) fn voxel_volume(grid: &Grid) -> f64 {
    grid.spacing.iter().product()
}

/// A box of voxels of a lattice: the index of its first voxel, and the number of voxels along each axis, at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region {
    pub low: [usize; 3],
    pub size: [usize; 3],
}

impl Region {
    /// The box of voxels whose centres lie between the lowest and the highest corner, inclusive; None if there are none. Corners are in mm in the
    /// coordinates of the grid.
    pub fn within(grid: &Grid, [low, high]: [DVec3; 2]) -> Option<Region> {
        let index = |at: DVec3| (at - DVec3::from(grid.origin)) / DVec3::from(grid.spacing);
        let (from, to) = (index(low), index(high));
        let mut region = Region { low: [0; 3], size: [0; 3] };
        for axis in 0..3 {
            // Saturates; NaN becomes 0.
            let first = from[axis].ceil().max(0.0) as usize;
            let end = ((to[axis].floor() + 1.0).max(0.0) as usize).min(grid.size[axis]);
            region.low[axis] = first;
            region.size[axis] = end.checked_sub(first).filter(|n| *n > 0)?;
        }
        Some(region)
    }

    /// The smallest box that contains the voxels with these linear indices, of which there must be one at least, and a margin of `margin` mm around
    /// them, cut at the border of the lattice.
    pub fn around(voxels: &[u32], grid: &Grid, margin: f64) -> Region {
        let (mut low, mut high) = (grid.size, [0; 3]);
        for n in voxels {
            let at = voxel(*n as usize, grid.size);
            for axis in 0..3 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        let more = grid.spacing.map(|spacing| (margin / spacing).ceil() as usize);
        let low = [0, 1, 2].map(|axis| low[axis].saturating_sub(more[axis]));
        let size = [0, 1, 2].map(|axis| (high[axis] + more[axis]).min(grid.size[axis] - 1) + 1 - low[axis]);
        Region { low, size }
    }

    /// Linear indices in the lattice of the voxels of the box; x is the fastest. `size`: that of the lattice.
    pub fn indices(&self, size: [usize; 3]) -> impl Iterator<Item = usize> + use<> {
        let Region { low, size: [width, height, depth] } = *self;
        (low[2]..low[2] + depth).flat_map(move |z| {
            (low[1]..low[1] + height).flat_map(move |y| {
                let row = (z * size[1] + y) * size[0] + low[0];
                row..row + width
            })
        })
    }

    /// For each voxel of the box its linear index in the lattice, and its centre, mm.
    pub fn places<'a>(&self, grid: &'a Grid) -> impl Iterator<Item = (usize, DVec3)> + use<'a> {
        self.indices(grid.size).map(|n| (n, place(grid, DVec3::from_array(voxel(n, grid.size).map(|i| i as f64)))))
    }

    pub fn voxels(&self) -> usize {
        self.size.iter().product()
    }

    /// For each voxel of the box whether it is one of those with these linear indices in the lattice, which must be in the box. `size`: that of the
    /// lattice.
    pub fn mask(&self, voxels: &[u32], size: [usize; 3]) -> Vec<bool> {
        let mut mask = vec![false; self.voxels()];
        voxels.iter().for_each(|n| mask[self.own(voxel(*n as usize, size))] = true);
        mask
    }

    /// Linear index within the box of the voxel with the index `at` in the lattice. It must be in the box.
    pub fn own(&self, at: [usize; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| at[axis] - self.low[axis]);
        (z * self.size[1] + y) * self.size[0] + x
    }
}

/// The linear index of the voxel that is nearest to a fractional index (x, y, z); None outside of the lattice.
pub(crate) fn nearest(size: [usize; 3], at: DVec3) -> Option<usize> {
    let at = at.round();
    let is_there = (0..3).all(|axis| (0.0..size[axis] as f64).contains(&at[axis]));
    let [x, y, z] = at.to_array().map(|n| n as usize);
    is_there.then(|| (z * size[1] + y) * size[0] + x)
}

/// The index (x, y, z) of the voxel with the linear index `n`.
pub(crate) fn voxel(n: usize, [width, height, _]: [usize; 3]) -> [usize; 3] {
    [n % width, n / width % height, n / (width * height)]
}
