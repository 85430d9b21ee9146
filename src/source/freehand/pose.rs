//! Tracked frames: where their pixels lie.

use crate::source::StoredType;
use glam::{DAffine3, DVec3};

/// No pixel lies further off, mm.
const FAR: f64 = 1e6;
/// Least sine of the angle between rows and columns: below, the frame is a line.
const LEAST_SINE: f64 = 1e-3;
/// Most columns and rows.
const MOST: usize = 1 << 16;

/// First column and the one behind the last, and rows likewise.
pub(super) type Part = [(usize, usize); 2];

/// Where the pixels of a frame lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// From (column, row, 0), of pixels' middles and from 0, to a place in the tracker's space, mm. Its third axis is not used.
    pub to_space: DAffine3,
    /// Columns and rows.
    pub size: [usize; 2],
}

/// A frame and its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedFrame<'a> {
    pub pose: Pose,
    pub stored: StoredType,
    /// Samples row by row, little-endian.
    pub bytes: &'a [u8],
}

impl Pose {
    /// The place of a pixel, mm.
    pub fn place(&self, column: f64, row: f64) -> DVec3 {
        self.to_space.transform_point3(DVec3::new(column, row, 0.0))
    }

    /// # Errors
    /// A frame without pixels, or whose pose is not finite, is flat, or lies beyond 1e6 mm; in words.
    pub fn check(&self) -> Result<(), String> {
        let [columns, rows] = self.size;
        if !(1..=MOST).contains(&columns) || !(1..=MOST).contains(&rows) {
            return Err(format!("a frame of {columns} x {rows} pixels; each must be 1 to {MOST}"));
        }
        if !self.to_space.is_finite() {
            return Err("a pose with a number that is not finite".into());
        }
        let (right, down) = (self.to_space.matrix3.x_axis, self.to_space.matrix3.y_axis);
        let sine = right.cross(down).length() / (right.length() * down.length());
        // NaN where an axis is zero.
        if sine.is_nan() || sine < LEAST_SINE {
            return Err("a pose that makes a line or a point of the frame".into());
        }
        let (last, line) = ((columns - 1) as f64, (rows - 1) as f64);
        let corners = [(0.0, 0.0), (last, 0.0), (0.0, line), (last, line)];
        let near = corners.iter().all(|(c, r)| self.place(*c, *r).abs().max_element() <= FAR);
        let steps = [right, down].iter().all(|step| (1.0 / FAR..=FAR).contains(&step.length()));
        match near && steps {
            true => Ok(()),
            false => Err("a pose with pixels beyond 1e6 mm, or closer than 1e-6 mm to one another".into()),
        }
    }

    /// What a clip rectangle leaves.
    ///
    /// # Errors
    /// Nothing is left.
    pub(super) fn clipped(&self, clip: Option<[usize; 4]>) -> Result<Part, String> {
        let [columns, rows] = self.size;
        let [x, y, width, height] = clip.unwrap_or([0, 0, columns, rows]);
        let part = |first: usize, count: usize, whole| (first, first.saturating_add(count).min(whole));
        let left = [part(x, width, columns), part(y, height, rows)];
        match left.iter().all(|(first, end)| first < end) {
            true => Ok(left),
            false => {
                Err(format!("a clip of {width} x {height} pixels at ({x}, {y}) leaves nothing of {columns} x {rows}"))
            }
        }
    }
}

impl TrackedFrame<'_> {
    /// # Errors
    /// As of [`Pose::check`], and samples that are more or fewer than its pixels.
    pub fn check(&self) -> Result<(), String> {
        self.pose.check()?;
        let [columns, rows] = self.pose.size;
        let expected = columns * rows * self.stored.bytes();
        match self.bytes.len() == expected {
            true => Ok(()),
            false => Err(format!("a frame of {} bytes; {columns} x {rows} pixels have {expected}", self.bytes.len())),
        }
    }

    /// None beyond the last.
    pub(super) fn sample(&self, column: usize, row: usize) -> Option<f32> {
        let n = row * self.pose.size[0] + column;
        let of = |bytes: usize| self.bytes.get(n * bytes..);
        match self.stored {
            StoredType::U8 => self.bytes.get(n).map(|v| f32::from(*v)),
            StoredType::U16 => of(2)?.first_chunk().map(|v| f32::from(u16::from_le_bytes(*v))),
            StoredType::F32 => of(4)?.first_chunk().map(|v| f32::from_le_bytes(*v)),
        }
    }
}
