//! Unveiling, resolved to the volume: the cells that fluid is looked for in, and which of their columns are in view.

use super::{Scene, region};
use crate::probe::{Geometry, Motion};

// What is looked for is a pocket of fluid in a body and what is averaged out are the grains of ultrasound, both of a size in mm whatever the
// volume's size is. So these two, and the offset and the smoothing that the settings give, are lengths in mm.

/// Edge of a cell, mm: a pocket of fluid has several, and speckle that is left averages out.
const CELL: f64 = 1.0;
/// Standard deviation of the Gaussian that cells are seen through, with that of the volume itself, mm.
const SMOOTH: f64 = 1.2;

/// The lattice of cells in which the pocket of fluid is searched. Its sizes are integers, so that the same volume gives the same start surface on
/// every machine.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FluidLattice {
    /// Number of the volume's texels in a cell of the lattice along columns and rows. Across slices a cell has one texel.
    pub cell: [usize; 2],
    /// Number of cells of the lattice along columns, rows and slices.
    pub size: [usize; 3],
    /// Size of a cell along columns, rows and slices in the middle of the region, mm.
    pub pitch: [f64; 3],
    /// How often the kernel 1 2 1 is applied to the cells within slices.
    pub smoothing: u32,
}

impl Scene {
    /// True if rendering starts at the start surface: `unveil` is enabled, and something is rendered from a volume of several slices.
    pub fn unveils(&self) -> bool {
        let is_still = region::is_still(&self.geometry);
        self.settings.unveil.enabled && self.renders() && self.slices() > 1 && !is_still
    }

    /// The lattice of cells in which the pocket of fluid is searched.
    pub(crate) fn fluid_lattice(&self) -> FluidLattice {
        let cell = self.grid.pitch.map(|pitch| (CELL / pitch).round().clamp(1.0, 64.0) as usize);
        let [columns, rows, slices] = self.volume_size().map(|n| n as usize);
        let middle = |slice: u32| self.texel_place([columns as u32 / 2, self.middle_row(), slice]);
        let half = self.slices() / 2;
        let across = middle(half).distance(middle(half - half.min(1)));
        let already = self.least_smoothing();
        let side = cell[0] as f64 * self.grid.pitch[0];
        // The kernel 1 2 1 has a variance of half a cell.
        let smoothing = (2.0 * (SMOOTH * SMOOTH - already * already) / (side * side)).round().clamp(0.0, 8.0) as u32;
        FluidLattice {
            cell,
            size: [columns.div_ceil(cell[0]), rows.div_ceil(cell[1]), slices],
            pitch: [side, cell[1] as f64 * self.grid.pitch[1], across.max(f64::MIN_POSITIVE)],
            smoothing,
        }
    }

    /// The row in the middle of the region's depth.
    fn middle_row(&self) -> u32 {
        let y = (self.low.y + self.high.y) / 2.0;
        let row = (y - self.grid.origin[1]) / self.grid.pitch[1];
        row.round().clamp(0.0, f64::from(self.grid.size[1] - 1)) as u32
    }

    /// For each texel of a slice, the column fastest: true if it lies within the sector. All are true for a Cartesian volume.
    pub fn sector_mask(&self) -> Vec<bool> {
        let [columns, rows] = self.grid.size;
        let texels = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let is_inside = |(column, row): (u32, u32)| {
            let Some(probe) = self.probe() else { return true };
            let (x, y) = self.grid.place(f64::from(column), f64::from(row));
            let (sample, line) = probe.plane_indices(x, y);
            let within = |at: f64, count: usize| at >= 0.0 && at <= (count - 1) as f64;
            within(sample, probe.samples) && within(line, probe.lines.len())
        };
        texels.map(is_inside).collect()
    }

    /// For each column of cells and slice, the column fastest: true if it lies within the region at the middle of the region's depth.
    pub(crate) fn columns_in_view(&self, lattice: &FluidLattice) -> Vec<bool> {
        let depth = (self.low.y + self.high.y) / 2.0;
        let is_in_view = |column: usize, slice: u32| {
            let texel = (column * lattice.cell[0]) as f64 + (lattice.cell[0] - 1) as f64 / 2.0;
            let lateral = self.grid.place(texel, 0.0).0;
            let elevation = match &self.geometry {
                Geometry::Cartesian(grid) => grid.origin[2] + f64::from(slice) * grid.spacing[2],
                Geometry::Sweep(probe) => {
                    let at = probe.slices.at(f64::from(slice));
                    match probe.motion {
                        Motion::Fan { .. } => (depth - probe.axis_depth()) * at.tan(),
                        Motion::Translated | Motion::Still { .. } => at,
                    }
                }
            };
            let within = |at: f64, axis: usize| at >= self.low[axis] && at <= self.high[axis];
            within(lateral, 0) && within(elevation, 2)
        };
        let [columns, _, slices] = lattice.size;
        (0..slices as u32).flat_map(|z| (0..columns).map(move |x| (x, z))).map(|(x, z)| is_in_view(x, z)).collect()
    }

    /// A key of the settings that decide where rendering starts: scenes with equal keys find the same start surface in the same volume. Of the region
    /// only the columns in view count.
    pub(crate) fn unveil_basis(&self) -> impl PartialEq + use<> {
        let lattice = self.unveils().then(|| self.fluid_lattice());
        let in_view = lattice.as_ref().map(|lattice| self.columns_in_view(lattice));
        (self.settings.unveil, lattice, in_view)
    }
}
