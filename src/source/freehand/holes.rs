//! Holes between the voxels that pixels came to.

use super::accumulate::Voxels;
use crate::probe::Grid;
use crate::source::StoredType;

/// Widest hole, in voxels.
const MOST: f64 = 64.0;

/// Straight lines through a voxel along which a hole may be bridged.
pub(super) struct Sticks {
    sticks: Vec<Stick>,
}

struct Stick {
    /// Voxels along each axis, -1, 0 or 1.
    step: [isize; 3],
    /// Of a step, mm.
    length: f64,
    /// Empty voxels between both ends.
    most: usize,
}

impl Sticks {
    /// # Errors
    /// A width that is no length, or of more voxels than are looked through.
    pub fn new(grid: &Grid, widest: f64) -> Result<Sticks, String> {
        let finest = grid.spacing.into_iter().fold(f64::INFINITY, f64::min);
        if !(widest >= 0.0 && widest / finest <= MOST) {
            return Err(format!("widest hole {widest} mm: must be 0 to {MOST} voxels of {finest} mm"));
        }
        let steps = (0..27isize).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
        // Each line once, in the direction whose last step that is not 0 is 1.
        let once = steps.filter(|s| s.iter().rev().find(|v| **v != 0) == Some(&1));
        let stick = |step: [isize; 3]| {
            let length = (0..3).map(|a| (step[a] as f64 * grid.spacing[a]).powi(2)).sum::<f64>().sqrt();
            // A width of whole voxels is not one less by rounding.
            Stick { step, length, most: (widest / length + 1e-9) as usize }
        };
        Ok(Sticks { sticks: once.map(stick).filter(|s| s.most > 0).collect() })
    }

    /// How many slices off a voxel may be that fills another.
    pub fn reach(&self) -> usize {
        self.sticks.iter().filter(|s| s.step[2] != 0).map(|s| s.most).max().unwrap_or(0)
    }

    /// A slice with its holes filled, little-endian.
    pub fn filled(&self, voxels: &Voxels, z: usize, stored: StoredType) -> Vec<u8> {
        let [width, height, depth] = voxels.size;
        let mut bytes = vec![0; width * height * stored.bytes()];
        let slices = z.saturating_sub(self.reach())..(z + self.reach() + 1).min(depth);
        // What lies between two voxels lies within the bounds of all.
        let Some([[left, right], [top, bottom]]) = voxels.bounds(slices) else { return bytes };
        for y in top..=bottom {
            for x in left..=right {
                let n = (z * height + y) * width + x;
                let value = voxels.value(n).or_else(|| self.bridged(voxels, [x, y, z], n));
                if let Some(value) = value {
                    put(&mut bytes, stored, y * width + x, value);
                }
            }
        }
        bytes
    }

    /// The mean of the ends of all sticks that are whole, weighted by one over their distance: along a single stick the straight line
    /// between its ends.
    fn bridged(&self, voxels: &Voxels, cell: [usize; 3], n: usize) -> Option<f32> {
        let [width, height, _] = voxels.size;
        let (mut sum, mut weights) = (0.0, 0.0);
        for Stick { step, length, most } in &self.sticks {
            let stride = step[0] + width as isize * (step[1] + height as isize * step[2]);
            // The first voxel with a value, at most `steps` off, and how far.
            let end = |sign: isize, steps: usize| {
                let room = |a: usize| match step[a] * sign {
                    0 => usize::MAX,
                    1 => voxels.size[a] - 1 - cell[a],
                    _ => cell[a],
                };
                let steps = steps.min(room(0)).min(room(1)).min(room(2));
                let at = |s: usize| n.wrapping_add_signed(sign * stride * s as isize);
                (1..=steps).find_map(|s| voxels.value(at(s)).map(|value| (s, f64::from(value))))
            };
            let Some((forth, a)) = end(1, *most) else { continue };
            let Some((back, b)) = end(-1, most + 1 - forth) else { continue };
            let [near, far] = [forth, back].map(|steps| 1.0 / (steps as f64 * length));
            sum += a * near + b * far;
            weights += near + far;
        }
        (weights > 0.0).then(|| (sum / weights) as f32)
    }
}

/// Stores a value, rounded to nearest where the type is whole.
fn put(bytes: &mut [u8], stored: StoredType, n: usize, value: f32) {
    let at = n * stored.bytes();
    let Some(place) = bytes.get_mut(at..at + stored.bytes()) else { return };
    match stored {
        StoredType::U8 => place.copy_from_slice(&[value.round() as u8]),
        StoredType::U16 => place.copy_from_slice(&(value.round() as u16).to_le_bytes()),
        // As no reader lets a denormal through, neither does a mean.
        StoredType::F32 if value.is_subnormal() => {}
        StoredType::F32 => place.copy_from_slice(&value.to_le_bytes()),
    }
}
