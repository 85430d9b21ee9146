//! Images of several slices: Cartesian volumes, whole or slice by slice, and where they are.

use super::message::{Coordinates, Image, Scalar};
use super::pixels::{range_of, samples, stored};
use crate::frame::Header;
use crate::probe::{AxisOrder, Geometry, Grid, StoredType, World, is_rigid};
use crate::value_range::ValueRange;
use glam::{DAffine3, DVec3};
use std::ops::Range;

/// Relative difference of spacings that count as equal: the spacing of a rotated volume is computed again in f32.
const SPACING_TOLERANCE: f64 = 1e-5;

/// The order of a left-handed image's voxels that makes it right-handed.
const ROWS_REVERSED: AxisOrder = AxisOrder { reversed: [true, false, false], ..AxisOrder::STORED };

/// A Cartesian volume that is assembled from images of an OpenIGTLink server.
pub(super) struct CartesianVolume {
    scalar: Scalar,
    components: u8,
    stored: StoredType,
    grid: Grid,
    /// The image's axes are left-handed: its rows are read from last pixel to first, so that it is not shown mirrored.
    mirrored: bool,
    /// Pose of the volume according to the last message; None if its axes are not perpendicular.
    pub(super) pose: Option<DAffine3>,
    range: [f64; 2],
    bytes: Vec<u8>,
    /// Slices that came since the volume was last whole; none where it comes in one message.
    came: Vec<bool>,
    /// A message brought all slices: parts that follow change it, and each shows.
    was_whole: bool,
}

/// The effect of an image on the volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Taken {
    /// Number of samples that were replaced by 0 because they are not finite or denormal.
    pub(super) replaced: u64,
    /// True if all slices of the volume have arrived.
    pub(super) is_whole: bool,
    /// Number of slices that were missing when one arrived a second time. The incomplete volume is then dropped; 0 if none was.
    pub(super) missing: usize,
}

impl CartesianVolume {
    /// Stores the slices of an image. If the image does not fit the present volume, a new volume begins. A volume that is sent in parts is
    /// complete when all of its slices have arrived.
    ///
    /// The image's i is lateral, j depth, k elevation. Lateral and elevation are centred on 0, depth begins at 0. The rows of a left-handed
    /// image are reversed. The values that are displayed as 0 and 1 are 0 and 255 for 8 bits, otherwise the smallest and largest of the first
    /// message.
    ///
    /// # Errors
    /// One line: the image cannot be used, for example because the volume has more than `max_bytes` bytes. The volume is not changed.
    pub(super) fn take(volume: &mut Option<CartesianVolume>, image: Image, max_bytes: usize) -> Result<Taken, String> {
        let [i, j, _] = image.size;
        let ([x, y, first], [columns, rows, slices]) = (image.region.offset, image.region.size);
        if (x, y, columns, rows) != (0, 0, i, j) {
            return Err(format!("a part of {columns} x {rows} of {i} x {j} pixels; whole slices are taken only"));
        }
        let (grid, scalar, components) = (grid(&image), image.scalar, image.components);
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        let stored = stored(scalar);
        let slice = usize::from(i) * usize::from(j) * stored.bytes();
        let all = slice.checked_mul(grid.size[2]).filter(|all| *all <= max_bytes);
        let Some(all) = all else {
            let [x, y, z] = grid.size;
            return Err(format!("a volume of {x} x {y} x {z} voxels; at most {max_bytes} bytes are taken"));
        };
        let mirrored = is_left_handed(&image);
        let pose = pose(&image, &grid, mirrored);
        let (mut brought, replaced) = samples(image)?;
        if mirrored {
            brought =
                ROWS_REVERSED.reorder(&brought, [usize::from(i), usize::from(j), usize::from(slices)], stored.bytes());
        }
        let is_same = |w: &&mut CartesianVolume| {
            let is_like = w.scalar == scalar && w.components == components && w.mirrored == mirrored;
            is_like && w.grid.size == grid.size && w.is_at(&grid)
        };
        let whole = match volume.as_mut().filter(is_same) {
            Some(whole) => whole,
            None => {
                let mut values = ValueRange::new(stored);
                values.take(&brought);
                let range = range_of(stored, values);
                if mirrored {
                    tracing::warn!(
                        "the axes of the image are left-handed: its rows are reversed, so that it is not shown mirrored"
                    );
                }
                volume.insert(CartesianVolume {
                    scalar,
                    components,
                    stored,
                    grid,
                    mirrored,
                    pose,
                    range,
                    bytes: vec![0; all],
                    came: vec![false; grid.size[2]],
                    was_whole: false,
                })
            }
        };
        whole.pose = pose;
        let at = usize::from(first) * slice;
        match whole.bytes.get_mut(at..at + usize::from(slices) * slice).filter(|part| part.len() == brought.len()) {
            Some(part) => part.copy_from_slice(&brought),
            None => return Err(format!("{slices} slices from {first} on, which are not all there")),
        }
        let (is_whole, missing) = whole.came(usize::from(first)..usize::from(first) + usize::from(slices));
        Ok(Taken { replaced, is_whole, missing })
    }

    /// Notes slices that came. True if the volume is whole with them; how many lacked if one of them was there already.
    fn came(&mut self, slices: Range<usize>) -> (bool, usize) {
        if slices.len() == self.came.len() {
            (self.was_whole, self.came) = (true, vec![false; self.came.len()]);
            return (true, 0);
        }
        if self.was_whole {
            return (true, 0);
        }
        let is_again = self.came[slices.clone()].contains(&true);
        let missing = if is_again { self.came.iter().filter(|came| !**came).count() } else { 0 };
        if is_again {
            self.came.fill(false);
        }
        self.came[slices].fill(true);
        let is_whole = !self.came.contains(&false);
        if is_whole {
            self.came.fill(false);
        }
        (is_whole, missing)
    }

    fn is_at(&self, grid: &Grid) -> bool {
        self.grid.spacing.iter().zip(grid.spacing).all(|(a, b)| (a - b).abs() <= SPACING_TOLERANCE * a.max(b))
    }

    pub(super) fn header(&self) -> Header {
        Header { posed: true, ..Header::of(Geometry::Cartesian(self.grid), self.stored, self.range) }
    }

    /// Samples of slice `k`; None beyond the last slice.
    pub(super) fn slice(&self, k: usize) -> Option<&[u8]> {
        let [x, y, _] = self.grid.size;
        self.bytes.chunks_exact(x * y * self.stored.bytes()).nth(k)
    }
}

/// The map from RAS to LPS coordinates, which is also its own inverse.
pub(super) fn other_coordinates() -> DAffine3 {
    DAffine3::from_scale(DVec3::new(-1.0, -1.0, 1.0))
}

/// The pose of an image whose voxels are drawn on `grid`, with reversed rows if it is mirrored.
fn pose(image: &Image, grid: &Grid, mirrored: bool) -> Option<DAffine3> {
    let to_lps = image.index_to_mm(Coordinates::Lps);
    let axes = [0, 1, 2].map(|n| to_lps.col(n).truncate());
    let mut world = World::new(axes, to_lps.w_axis.truncate()).ok()?;
    if mirrored {
        world = world.reordered(&ROWS_REVERSED, grid.size);
    }
    let pose = world.pose(grid);
    is_rigid(&pose).then_some(pose)
}

/// True if i, j and k are left-handed. Both coordinate systems of images are right-handed.
fn is_left_handed(image: &Image) -> bool {
    let [i, j, k] = image.axes.map(|axis| DVec3::from(axis.map(f64::from)));
    i.cross(j).dot(k) < 0.0
}

/// The grid of an image. An axis of one pixel may have any spacing, or none.
fn grid(image: &Image) -> Grid {
    let size = image.size.map(usize::from);
    let stated = image.spacing();
    let spacing = [0, 1, 2].map(|axis| if size[axis] == 1 && stated[axis] == 0.0 { 1.0 } else { stated[axis] });
    let half = |axis: usize| -spacing[axis] * (size[axis] as f64 - 1.0) / 2.0;
    Grid { size, spacing, origin: [half(0), 0.0, half(2)] }
}
