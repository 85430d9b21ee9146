//! A Cartesian volume that comes over the network, whole or some slices at a time.

use super::samples::{samples, stored};
use crate::probe::{Geometry, Grid};
use crate::source::StoredType;
use crate::source::igtl::image::{Image, Scalar};
use crate::source::recorder::Header;
use crate::source::samples::{not_empty, widen};

/// Lengths that are no more than this share apart are the same: a volume that is turned has its spacing computed anew in f32.
const SAME: f64 = 1e-5;

/// The volume as it is after the last message.
pub(super) struct Whole {
    scalar: Scalar,
    components: u8,
    stored: StoredType,
    grid: Grid,
    range: [f64; 2],
    bytes: Vec<u8>,
}

impl Whole {
    /// Puts an image's slices in their place, in a volume of its own if it is not of the one before; what has not come yet is 0. How many
    /// samples read as 0 because they were not finite or denormal.
    ///
    /// The volume's lateral axis is the image's i, depth is j, elevation is k; lateral and elevation are centred, depth begins at 0. Where
    /// it lies in the patient is not used. Values that are shown as 0 and 1: all of 8 bits, otherwise the smallest and
    /// largest of the first message.
    ///
    /// # Errors
    /// What is wrong with an image that is passed over; the volume stays as it is.
    pub fn take(volume: &mut Option<Whole>, image: Image, most_bytes: usize) -> Result<u64, String> {
        let [i, j, _] = image.size;
        let ([x, y, first], [columns, rows, slices]) = (image.region.offset, image.region.size);
        if (x, y, columns, rows) != (0, 0, i, j) {
            return Err(format!("a part of {columns} x {rows} of {i} x {j} pixels; whole slices are taken only"));
        }
        let (grid, scalar, components) = (grid(&image), image.scalar, image.components);
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        let stored = stored(scalar);
        let slice = usize::from(i) * usize::from(j) * stored.bytes();
        let all = slice.checked_mul(grid.size[2]).filter(|all| *all <= most_bytes);
        let Some(all) = all else {
            let [x, y, z] = grid.size;
            return Err(format!("a volume of {x} x {y} x {z} voxels; at most {most_bytes} bytes are taken"));
        };
        let (brought, replaced) = samples(image)?;
        let is_same = |w: &&mut Whole| {
            w.scalar == scalar && w.components == components && w.grid.size == grid.size && w.is_at(&grid)
        };
        let whole = match volume.as_mut().filter(is_same) {
            Some(whole) => whole,
            None => {
                let range = match stored {
                    StoredType::U8 => [0.0, 255.0],
                    StoredType::U16 | StoredType::F32 => {
                        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
                        widen(&mut range, stored, &brought);
                        not_empty(range)
                    }
                };
                volume.insert(Whole { scalar, components, stored, grid, range, bytes: vec![0; all] })
            }
        };
        let at = usize::from(first) * slice;
        match whole.bytes.get_mut(at..at + usize::from(slices) * slice).filter(|part| part.len() == brought.len()) {
            Some(part) => part.copy_from_slice(&brought),
            None => return Err(format!("{slices} slices from {first} on, which are not all there")),
        }
        Ok(replaced)
    }

    fn is_at(&self, grid: &Grid) -> bool {
        self.grid.spacing.iter().zip(grid.spacing).all(|(a, b)| (a - b).abs() <= SAME * a.max(b))
    }

    pub fn header(&self) -> Header {
        let geometry = Geometry::Cartesian(self.grid);
        Header { forward: geometry.clone(), backward: geometry, stored: self.stored, range: self.range }
    }

    /// None beyond the last.
    pub fn slice(&self, k: usize) -> Option<&[u8]> {
        let [x, y, _] = self.grid.size;
        self.bytes.chunks_exact(x * y * self.stored.bytes()).nth(k)
    }
}

/// Along an axis of one pixel any step may be given, or none.
fn grid(image: &Image) -> Grid {
    let size = image.size.map(usize::from);
    let mut spacing = image.spacing();
    for axis in 0..3 {
        if size[axis] == 1 && spacing[axis] == 0.0 {
            spacing[axis] = 1.0;
        }
    }
    let half = |axis: usize| -spacing[axis] * (size[axis] as f64 - 1.0) / 2.0;
    Grid { size, spacing, origin: [half(0), 0.0, half(2)] }
}
