//! Cartesian volumes as they are drawn: the order of their axes, their lattice and their place in the world.

use super::layout::{Cartesian, Remarks};
use crate::files::InputError;
use crate::probe::file::geometry_error;
use crate::probe::{AxisOrder, DepthAxis, Grid, World};
use std::path::Path;

/// Largest volume whose frames are put together anew in memory, bytes.
const MAX_TURNED_BYTES: u64 = 1 << 31;

/// How the stored Cartesian volumes of a file become the volumes that are drawn.
pub(super) struct Drawn {
    /// The grid of a drawn volume.
    pub grid: Grid,
    /// Map from the drawn voxels to the world.
    pub world: World,
    /// Which stored axes are drawn as lateral, depth and elevation.
    pub order: AxisOrder,
    /// Number of voxels along the stored axes.
    pub stored: [usize; 3],
}

impl Drawn {
    /// Applies the axis order of the file and reverses one axis if the volume would look mirrored. `depth`: the axis, counted in the file's
    /// order, that is drawn as depth; None: the second. `bytes`: size of a stored sample. A reversal is added to `remarks`.
    ///
    /// # Errors
    /// The grid is impossible, or frames have to be put together from more than 2 GiB of voxels.
    pub fn new(
        path: &Path,
        file: &Cartesian,
        depth: Option<DepthAxis>,
        bytes: usize,
        remarks: &mut Remarks,
    ) -> Result<Drawn, InputError> {
        let (mut world, mut order) = (file.world, file.order);
        let size = order.size(file.size);
        if let Some(depth) = depth {
            // The file's world is that of its own order: turn from there.
            let chosen = AxisOrder::with_depth(depth);
            world = world.reordered(&chosen, size);
            order = order.then(&chosen);
        }
        if world.is_left_handed() {
            let before = order;
            let flip = AxisOrder::with_other_hand(&world);
            world = world.reordered(&flip, order.size(file.size));
            order = order.then(&flip);
            let text = format!(
                "the axes {} are left-handed in the world: drawn as {}, so that the volume is not shown mirrored",
                before.names(),
                order.names()
            );
            remarks.push(("handedness".into(), text));
        }
        let grid = world.grid(order.size(file.size));
        grid.check().map_err(|e| geometry_error(path, &e))?;
        let all = file.size.iter().fold(bytes as u64, |all, n| all.saturating_mul(*n as u64));
        if !order.keeps_frames() && all > MAX_TURNED_BYTES {
            let fault = format!("{}: the volume has {all} bytes, at most 2 GiB are turned so", order.names());
            return Err(InputError::new(path, "order of axes", fault));
        }
        Ok(Drawn { grid, world, order, stored: file.size })
    }

    /// True if volumes are drawn in their stored order.
    pub fn is_stored(&self) -> bool {
        self.order == AxisOrder::STORED
    }

    /// A stored frame with its pixels in drawn order, and the index of the slice that it becomes in the drawn volume. The order must keep frames
    /// ([`AxisOrder::keeps_frames`]). `number`: index of the frame in the stored volume. `width`: bytes of a sample.
    pub fn frame(&self, bytes: &[u8], number: usize, width: usize) -> (Vec<u8>, usize) {
        let [columns, rows, slices] = self.stored;
        let slice = if self.order.reversed[2] { slices - 1 - number } else { number };
        (self.order.reorder(bytes, [columns, rows, 1], width), slice)
    }

    /// Rows for users: the order of axes unless it is the stored one, and the directions of the drawn axes and the position unless they are
    /// those of the world.
    pub fn description(&self) -> Vec<(String, String)> {
        let mut rows = Vec::new();
        if !self.is_stored() {
            let text = format!("stored axes {} as lateral, depth and elevation", self.order.names());
            rows.push(("drawn".into(), text));
        }
        if self.world != World::of(&self.grid) {
            let [x, y, z] = self.world.nearest();
            let turned = (0..3).any(|n| self.world.directions().col(n).abs().max_element() < 1.0 - 1e-9);
            let about = if turned { "about to " } else { "to " };
            rows.push(("orientation".into(), format!("lateral, depth and elevation point {about}{x}, {y} and {z}")));
            let [u, v, w] = self.world.origin().to_array().map(super::describe::number);
            rows.push(("position".into(), format!("the first voxel is at {u}, {v}, {w} mm in the world (LPS)")));
        }
        rows
    }
}
