//! A lattice on which a surface is found for a mesh, and the slab of it that a device works on at a time. No picture has one.

use super::{Input, Scene, SceneError, Settings, refuse};
use crate::probe::StoredType;
use crate::probe::{Geometry, Grid};
use glam::DVec3;

/// Most slices of a slab, without those that smoothing needs: every device has images so deep.
const SLICES: usize = 256;
/// Reach of the Gaussian, standard deviations.
const REACH: f64 = 3.0;

/// Slices `first..first + count` of a lattice of voxels, and those around them that smoothing needs. Of a closed surface the first slab has
/// cells before the lattice, and the last one behind it.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// The samples that the values are interpolated from.
    pub source: Geometry,
    pub stored: StoredType,
    /// The whole lattice.
    pub grid: Grid,
    /// Standard deviation of the Gaussian that smooths the values, mm.
    pub deviation: f64,
    /// Stored values from here on are inside.
    pub threshold: f64,
    /// The surface is closed at the border of the lattice and of what is known.
    pub closed: bool,
    /// Rows that count as not known.
    pub left_out: usize,
    /// Rows of a lattice that is filled behind the surface; none: it is not filled.
    pub filled_rows: Option<usize>,
    /// Voxels of a slab, if its least number of slices is not larger.
    pub most: usize,
    /// Slices whose cells are looked for: a layer of cells between each and the next.
    pub first: usize,
    pub count: usize,
}

impl Lattice {
    /// Voxels of a slab that are enough to occupy every device: 64 MiB of floats.
    pub const MOST: usize = 1 << 24;

    /// A scene for the passes that find the surface; it shows nothing.
    ///
    /// # Errors
    /// A lattice with more voxels along an axis than cells can name.
    pub fn scene(self) -> Result<Scene, SceneError> {
        let [width, height, depth] = self.grid.size;
        if width.max(self.rows()).max(height).max(depth) >= 1 << 16 {
            return refuse(
                "lattice",
                format!("has {width} x {} x {depth} voxels, at most 65535 along an axis", self.rows()),
            );
        }
        let shown = Grid { size: [2; 3], spacing: [1.0; 3], origin: [0.0; 3] };
        let input = Input { stored: self.stored, range: [0.0, 1.0] };
        let scene = Scene::new(Geometry::Cartesian(shown), input, Settings::default())?;
        Ok(Scene { lattice: Some(self), ..scene })
    }

    /// The slabs of a whole lattice, each as its first slice and the number of them. Neighbours share a slice: cells lie between slices.
    pub fn slabs(&self) -> Vec<(usize, usize)> {
        let [width, _, depth] = self.grid.size;
        let around = 2 * self.reach()[2];
        let most = (self.most / (width * self.rows()).max(1)).saturating_sub(around).clamp(2, SLICES);
        let step = most - 1;
        let mut slabs: Vec<_> =
            (0..depth.saturating_sub(1)).step_by(step).map(|first| (first, most.min(depth - first))).collect();
        if slabs.is_empty() && depth > 0 {
            slabs.push((0, depth));
        }
        slabs
    }

    /// The same lattice, another slab of it.
    pub fn slab(&self, (first, count): (usize, usize)) -> Lattice {
        Lattice { first, count, ..self.clone() }
    }

    pub(crate) fn is_smoothed(&self) -> bool {
        self.deviation > 0.0
    }

    /// Standard deviation of the Gaussian along each axis, voxels.
    pub fn deviations(&self) -> [f64; 3] {
        self.grid.spacing.map(|spacing| self.deviation / spacing)
    }

    /// How many voxels away the Gaussian reaches along each axis.
    pub fn reach(&self) -> [usize; 3] {
        let deviations = self.deviations();
        std::array::from_fn(|axis| {
            ((REACH * deviations[axis]).ceil() as usize).min(self.grid.size[axis].saturating_sub(1))
        })
    }

    /// Rows of the values that cells are looked for in.
    pub fn rows(&self) -> usize {
        self.filled_rows.unwrap_or(self.grid.size[1])
    }

    /// The first slice that is stored, and the number of them.
    pub(crate) fn stored_slices(&self) -> (usize, usize) {
        let reach = self.reach()[2];
        let first = self.first.saturating_sub(reach);
        (first, (self.first + self.count + reach).min(self.grid.size[2]) - first)
    }

    /// Voxels of the slab before it is filled.
    pub fn size(&self) -> [u32; 3] {
        let [width, height, _] = self.grid.size;
        [width, height, self.stored_slices().1].map(|n| n as u32)
    }

    /// Voxels before the lattice that a closed surface has cells at.
    pub fn pad(&self) -> usize {
        usize::from(self.closed)
    }

    /// Cells of a row, rows, and layers of cells of the slab.
    pub fn cells(&self) -> [u32; 3] {
        let pad = 2 * self.pad();
        let ends = usize::from(self.closed && self.first == 0) + usize::from(self.closed && self.is_last());
        [self.grid.size[0] + pad - 1, self.rows() + pad - 1, self.count + ends - 1].map(|n| n as u32)
    }

    fn is_last(&self) -> bool {
        self.first + self.count == self.grid.size[2]
    }

    /// The stored slice before the slab's first layer of cells; -1 if it is not known.
    pub(crate) fn first_layer(&self) -> i64 {
        let before = if self.first == 0 { self.pad() } else { 0 };
        (self.first - self.stored_slices().0) as i64 - before as i64
    }

    /// The place of the lattice's first voxel and the way to the next: mm, of a Cartesian source indices of its voxels.
    pub fn places(&self) -> (DVec3, DVec3) {
        let step = DVec3::from(self.grid.spacing);
        let first = DVec3::from(self.grid.origin);
        match &self.source {
            Geometry::Sweep(_) => (first, step),
            Geometry::Cartesian(own) => {
                let (origin, spacing) = (DVec3::from(own.origin), DVec3::from(own.spacing));
                ((first - origin) / spacing, step / spacing)
            }
        }
    }

    /// Samples of a line, lines of a frame, frames.
    pub fn samples(&self) -> [u32; 3] {
        let [samples, lines] = self.source.frame_size();
        [samples, lines, self.source.slices()].map(|n| n as u32)
    }
}
