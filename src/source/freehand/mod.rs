//! Freehand compounding: 2D frames whose pose is tracked become a Cartesian volume.
//!
//! Two steps, as in the pixel-based methods of Rohling, Gee and Berman, *A comparison of freehand three-dimensional ultrasound
//! reconstruction techniques*, Med. Image Anal. 3 (1999), and Solberg et al., *Freehand 3D ultrasound reconstruction algorithms: a
//! review*, Ultrasound Med. Biol. 33 (2007): every pixel is added to the voxels around its position as it arrives, so that a voxel is the weighted mean of its pixels, and
//! voxels without a pixel are filled from those around them. The second step bridges gaps along straight lines that end in
//! reached voxels on both sides (Vaughan et al., *Hole filling with oriented sticks in ultrasound volume reconstruction*, J. Med. Imaging
//! 2 (2015)): holes up to a width are closed, wider ones stay 0, and nothing is added beyond the border of the swept region.

mod file;
mod given;
mod growth;
mod lattice;
mod sweep;

pub(super) use file::{FreehandFile, PlacedPicture, PlacedPictures};
pub use given::FreehandArguments;
pub use lattice::Lattice;
pub use sweep::{Refusal, Schedule, Sweep};

use crate::probe::{Grid, StoredType};
use crate::samples::put;
use crate::tree::Defaults;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;

/// Text for users: why pictures outside the volume are left out, and what to do.
pub(super) const AT_ITS_LIMIT: &str = "it may not grow further; a larger --freehand-size or --spacing lets it";

/// Default limit of the voxels of a volume: 2^25, about 320 along each edge.
const DEFAULT_MAX_VOXELS: usize = 1 << 25;
/// Largest possible limit.
const MAX_VOXELS: usize = 1 << 31;
/// Largest weight of a voxel, in pixels at its centre. Above it, sum and weight are halved: with larger sums, rounding in f32 would
/// affect the mean, and after 2^24 further pixels would have no effect. Earlier pixels then count less.
const MAX_WEIGHT: f32 = 4096.0;
/// Larger samples are left out: they cannot be added up in f32, and are no echoes.
const MAX_SAMPLE: f32 = 1e30;
/// Smaller weights are rounding errors: a pixel at the centre of a voxel is not added to its neighbours.
const MIN_WEIGHT: f64 = 1e-6;

/// Options of a [`Compounder`].
#[derive(Clone, Debug, PartialEq, Defaults)]
pub struct CompoundingOptions {
    /// Widest gap between pictures that is filled, mm; at most 64 times the smallest distance between voxels. 0 fills none.
    #[value(2.0)]
    pub max_hole: f64,
    /// The part of each frame that is used: first column, first row, columns, rows. `None`: the whole frame.
    pub clip: Option<[usize; 4]>,
    /// Distance between voxels along each axis, mm. `None`: the distance between the frames' pixels.
    pub spacing: Option<f64>,
    /// Distance that the volume extends beyond the frames around which it is placed, on all sides, mm.
    #[value(5.0)]
    pub margin: f64,
    /// Least length of the volume along the normal of the frames, mm, without `margin`. A shorter volume is extended in the direction in which the
    /// frames move, or alike to both sides if they do not move. `None`: no longer than the frames need.
    pub extent: Option<f64>,
    /// Largest number of voxels of the volume. More than 2^31 are refused in any case.
    #[value(DEFAULT_MAX_VOXELS)]
    pub max_voxels: usize,
}

/// Numbers of frames and pixels that a [`Compounder`] has processed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompoundingCounts {
    /// Number of compounded frames.
    pub frames: u64,
    /// Number of compounded frames that have no pixel in the volume.
    pub outside: u64,
    /// Number of frames that were refused: without a valid pose, with a wrong number of samples, or without a pixel in `clip`.
    pub refused: u64,
    /// Number of pixels that were left out: not finite, or beyond 1e30.
    pub pixels: u64,
}

/// Compounds tracked 2D frames into a volume.
///
/// Memory: 8 bytes a voxel, and the stored samples of each slice near a frame.
pub struct Compounder {
    lattice: Lattice,
    stored: StoredType,
    options: CompoundingOptions,
    voxels: Voxels,
    sticks: Sticks,
    /// Slices with new pixels since the last [`Compounder::changed_slices`].
    touched: Vec<bool>,
    /// Filled slices; an empty one is all zero.
    slices: Vec<Vec<u8>>,
    zero: Vec<u8>,
    counts: CompoundingCounts,
    /// Lateral distance of the voxels before the volume grew, mm.
    first_spacing: f64,
}

impl Compounder {
    /// An empty volume with voxels of type `stored`. Frames may have samples of any type; their values are not scaled.
    ///
    /// # Errors
    /// One line: a lattice or options that are not valid, or more voxels than the options allow. Nothing is allocated then.
    pub fn new(lattice: Lattice, stored: StoredType, options: CompoundingOptions) -> Result<Compounder, String> {
        let grid = &lattice.grid;
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        if !lattice.to_volume.is_finite() {
            return Err("the volume's own place is not finite".into());
        }
        let [x, y, z] = grid.size;
        let count = x.saturating_mul(y).saturating_mul(z);
        let most = options.max_voxels.min(MAX_VOXELS);
        if count > most {
            return Err(format!("{x} x {y} x {z} voxels: at most {most} are allowed; take a larger spacing"));
        }
        let sticks = Sticks::new(grid, options.max_hole)?;
        Ok(Compounder {
            lattice,
            stored,
            options,
            voxels: Voxels::new(grid.size),
            sticks,
            touched: vec![false; z],
            slices: vec![Vec::new(); z],
            zero: vec![0; x * y * stored.bytes()],
            counts: CompoundingCounts::default(),
            first_spacing: lattice.grid.spacing[0],
        })
    }

    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    pub fn stored(&self) -> StoredType {
        self.stored
    }

    pub fn counts(&self) -> CompoundingCounts {
        self.counts
    }

    /// Compounds a frame into the volume. Returns the number of its pixels that are in the volume.
    ///
    /// # Errors
    /// One line: why the frame is refused. The frame is counted as refused, and the volume is not changed.
    pub fn push(&mut self, frame: &TrackedFrame) -> Result<u64, String> {
        let checked = frame.check().and_then(|()| frame.pose.clipped(self.options.clip));
        let [columns, rows] = checked.inspect_err(|_| self.counts.refused += 1)?;
        let to_index = |place: DVec3| self.lattice.index_of(place);
        let origin = to_index(frame.pose.place(0.0, 0.0));
        let (right, down) =
            (to_index(frame.pose.place(1.0, 0.0)) - origin, to_index(frame.pose.place(0.0, 1.0)) - origin);
        let mut inside = 0;
        for row in rows.0..rows.1 {
            let start = origin + down * row as f64;
            for column in columns.0..columns.1 {
                let at = start + right * column as f64;
                let Some(value) = frame.sample(column, row) else { continue };
                if value.is_nan() || value.abs() > MAX_SAMPLE {
                    self.counts.pixels += 1;
                    continue;
                }
                inside += u64::from(self.voxels.splat(at, value, 1.0, &mut self.touched));
            }
        }
        self.counts.frames += 1;
        self.counts.outside += u64::from(inside == 0);
        Ok(inside)
    }

    /// Recomputes the samples of the slices that new pixels have changed, and returns the indices of these slices in rising order.
    pub fn changed_slices(&mut self) -> Vec<usize> {
        let (reach, last) = (self.sticks.reach(), self.touched.len());
        let near = |k: usize| self.touched[k.saturating_sub(reach)..(k + reach + 1).min(last)].contains(&true);
        let changed: Vec<usize> = (0..last).filter(|k| near(*k)).collect();
        let fill = |k: &usize| (*k, self.sticks.filled(&self.voxels, *k, self.stored));
        let filled: Vec<(usize, Vec<u8>)> = changed.par_iter().map(fill).collect();
        for (k, bytes) in filled {
            self.slices[k] = bytes;
        }
        self.touched.fill(false);
        changed
    }

    /// Samples of slice `k` as of the last [`Compounder::changed_slices`]: lateral fastest, rows along depth, each of the type
    /// [`Compounder::stored`], little-endian. 0 in voxels that no pixel reached and that are in no filled gap. `None` beyond the last slice.
    pub fn slice(&self, k: usize) -> Option<&[u8]> {
        self.slices.get(k).map(|slice| if slice.is_empty() { &self.zero[..] } else { &slice[..] })
    }
}

/// Largest coordinate of a pixel, mm.
const MAX_DISTANCE: f64 = 1e6;
/// Least sine of the angle between rows and columns. Below it, the frame is a line.
const MIN_SINE: f64 = 1e-3;
/// Most columns and rows.
const MAX_PIXELS: usize = 1 << 16;

/// Ranges of columns and rows: first, and one past the last.
type PixelRange = [(usize, usize); 2];

/// Position, orientation and size of a 2D frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Map from (column, row, 0) of a pixel's centre, counted from 0, to the space of the tracker, mm. The third axis is not used.
    pub to_space: DAffine3,
    /// Columns and rows of the frame.
    pub size: [usize; 2],
}

/// The samples of a 2D frame, and its pose in the tracker's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedFrame<'a> {
    pub pose: Pose,
    pub stored: StoredType,
    /// Samples of the frame, row by row, little-endian.
    pub bytes: &'a [u8],
}

impl Pose {
    /// The position in the space of the tracker of a fractional column and row, mm.
    pub fn place(&self, column: f64, row: f64) -> DVec3 {
        self.to_space.transform_point3(DVec3::new(column, row, 0.0))
    }

    /// Checks the pose.
    ///
    /// # Errors
    /// One line: no pixels or more than 65536 along a side, or a pose that is not finite, that makes a line or a point of the frame, or whose pixels
    /// lie beyond 1e6 mm or less than 1e-6 mm apart.
    pub fn check(&self) -> Result<(), String> {
        let [columns, rows] = self.size;
        if !(1..=MAX_PIXELS).contains(&columns) || !(1..=MAX_PIXELS).contains(&rows) {
            return Err(format!("a frame of {columns} x {rows} pixels; each must be 1 to {MAX_PIXELS}"));
        }
        if !self.to_space.is_finite() {
            return Err("a pose with a number that is not finite".into());
        }
        let (right, down) = (self.to_space.matrix3.x_axis, self.to_space.matrix3.y_axis);
        let sine = right.cross(down).length() / (right.length() * down.length());
        // NaN where an axis is zero.
        if sine.is_nan() || sine < MIN_SINE {
            return Err("a pose that makes a line or a point of the frame".into());
        }
        let corners = self.corners([(0, columns), (0, rows)]);
        let near = corners.iter().all(|corner| corner.abs().max_element() <= MAX_DISTANCE);
        let steps = [right, down].iter().all(|step| (1.0 / MAX_DISTANCE..=MAX_DISTANCE).contains(&step.length()));
        match near && steps {
            true => Ok(()),
            false => Err("a pose with pixels beyond 1e6 mm, or closer than 1e-6 mm to one another".into()),
        }
    }

    /// The positions of the first and last pixels of some rows and columns, in the space of the tracker, mm.
    fn corners(&self, [columns, rows]: PixelRange) -> [DVec3; 4] {
        let (left, right, top, bottom) = (columns.0, columns.1 - 1, rows.0, rows.1 - 1);
        [(left, top), (right, top), (left, bottom), (right, bottom)]
            .map(|(column, row)| self.place(column as f64, row as f64))
    }

    /// The pixels in a clip rectangle.
    ///
    /// # Errors
    /// There are none.
    fn clipped(&self, clip: Option<[usize; 4]>) -> Result<PixelRange, String> {
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
    /// Checks the pose and the number of samples.
    ///
    /// # Errors
    /// One line: a pose that [`Pose::check`] refuses, or a number of samples that is not that of the pixels.
    pub fn check(&self) -> Result<(), String> {
        self.pose.check()?;
        let [columns, rows] = self.pose.size;
        let expected = columns * rows * self.stored.bytes();
        match self.bytes.len() == expected {
            true => Ok(()),
            false => Err(format!("a frame of {} bytes; {columns} x {rows} pixels have {expected}", self.bytes.len())),
        }
    }

    /// A sample; None beyond the last.
    fn sample(&self, column: usize, row: usize) -> Option<f32> {
        let n = row * self.pose.size[0] + column;
        let of = |bytes: usize| self.bytes.get(n * bytes..);
        match self.stored {
            StoredType::U8 => self.bytes.get(n).map(|v| f32::from(*v)),
            StoredType::U16 => of(2)?.first_chunk().map(|v| f32::from(u16::from_le_bytes(*v))),
            StoredType::F32 => of(4)?.first_chunk().map(|v| f32::from_le_bytes(*v)),
        }
    }
}

/// Weighted sums of the pixels of each voxel: lateral fastest, then depth, then elevation.
struct Voxels {
    size: [usize; 3],
    /// Sum of weighted values, and of weights; the latter is 0 for a voxel without pixels.
    sums: Vec<[f32; 2]>,
    /// By row: lowest and highest lateral index with pixels; reversed if there are none.
    rows: Vec<[u32; 2]>,
}

impl Voxels {
    fn new(size: [usize; 3]) -> Voxels {
        let [x, y, z] = size;
        Voxels { size, sums: vec![[0.0; 2]; x * y * z], rows: vec![[u32::MAX, 0]; y * z] }
    }

    /// Adds pixels of a weight to the eight voxels around a position in voxel indices, with the weights of trilinear interpolation. Sets
    /// `touched` for their slices. False if no voxel is there.
    fn splat(&mut self, at: DVec3, value: f32, pixels: f32, touched: &mut [bool]) -> bool {
        let size = DVec3::from_array(self.size.map(|n| n as f64));
        // No voxel is within reach, or NaN.
        if !(at.cmpgt(DVec3::NEG_ONE).all() && at.cmplt(size).all()) {
            return false;
        }
        let (low, mut inside) = (at.floor(), false);
        let share = (at - low).to_array();
        let low = low.to_array().map(|n| n as isize);
        for corner in 0..8usize {
            let high = [corner & 1, corner >> 1 & 1, corner >> 2 & 1];
            let weight: f64 = (0..3).map(|a| if high[a] == 1 { share[a] } else { 1.0 - share[a] }).product();
            let cell = [0, 1, 2].map(|a| low[a] + high[a] as isize);
            let there = (0..3).all(|a| cell[a] >= 0 && (cell[a] as usize) < self.size[a]);
            if weight >= MIN_WEIGHT && there {
                self.add(cell.map(|n| n as usize), value, pixels * weight as f32, touched);
                inside = true;
            }
        }
        inside
    }

    fn add(&mut self, [x, y, z]: [usize; 3], value: f32, weight: f32, touched: &mut [bool]) {
        let row = z * self.size[1] + y;
        let n = row * self.size[0] + x;
        let sums = &mut self.sums[n];
        *sums = [sums[0] + value * weight, sums[1] + weight];
        if sums[1] > MAX_WEIGHT {
            *sums = sums.map(|sum| sum / 2.0);
        }
        let [first, last] = self.rows[row];
        self.rows[row] = [first.min(x as u32), last.max(x as u32)];
        touched[z] = true;
    }

    /// The value of voxel `n`, if it has pixels.
    fn value(&self, n: usize) -> Option<f32> {
        self.sums.get(n).filter(|[_, weight]| *weight > 0.0).map(|[sum, weight]| sum / weight)
    }

    /// Lowest and highest lateral and depth index with pixels in some slices, inclusive.
    fn bounds(&self, slices: std::ops::Range<usize>) -> Option<[[usize; 2]; 2]> {
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

/// Widest hole, voxels.
const MAX_HOLE_VOXELS: f64 = 64.0;

/// Straight lines through a voxel along which a hole may be filled.
struct Sticks {
    sticks: Vec<Stick>,
}

struct Stick {
    /// Voxels along each axis, -1, 0 or 1.
    step: [isize; 3],
    /// Length of a step, mm.
    length: f64,
    /// Most empty voxels between both ends.
    most: usize,
}

impl Sticks {
    /// # Errors
    /// A width that is not a length, or more than 64 voxels.
    fn new(grid: &Grid, widest: f64) -> Result<Sticks, String> {
        let finest = grid.spacing.into_iter().fold(f64::INFINITY, f64::min);
        if !(widest >= 0.0 && widest / finest <= MAX_HOLE_VOXELS) {
            return Err(format!("widest hole {widest} mm: must be 0 to {MAX_HOLE_VOXELS} voxels of {finest} mm"));
        }
        let steps = (0..27isize).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
        // Each line once: in the direction whose last non-zero step is 1.
        let once = steps.filter(|s| s.iter().rev().find(|v| **v != 0) == Some(&1));
        let stick = |step: [isize; 3]| {
            let length = (0..3).map(|a| (step[a] as f64 * grid.spacing[a]).powi(2)).sum::<f64>().sqrt();
            // Tolerates rounding of a width that is a multiple of the spacing.
            Stick { step, length, most: (widest / length + 1e-9) as usize }
        };
        Ok(Sticks { sticks: once.map(stick).filter(|s| s.most > 0).collect() })
    }

    /// Largest distance, in slices, between a voxel and one that it is filled from.
    fn reach(&self) -> usize {
        self.sticks.iter().filter(|s| s.step[2] != 0).map(|s| s.most).max().unwrap_or(0)
    }

    /// A slice with its holes filled, little-endian.
    fn filled(&self, voxels: &Voxels, z: usize, stored: StoredType) -> Vec<u8> {
        let [width, height, depth] = voxels.size;
        let each = stored.bytes();
        let mut bytes = vec![0; width * height * each];
        let slices = z.saturating_sub(self.reach())..(z + self.reach() + 1).min(depth);
        // A voxel between two others is within the bounds of all.
        let Some([[left, right], [top, bottom]]) = voxels.bounds(slices) else { return bytes };
        for y in top..=bottom {
            for x in left..=right {
                let n = (z * height + y) * width + x;
                let value = voxels.value(n).or_else(|| self.bridged(voxels, [x, y, z], n));
                // Denormals are flushed, as in every reader.
                if let Some(value) = value.filter(|value| !value.is_subnormal()) {
                    let at = (y * width + x) * each;
                    put(stored.into(), value.into(), &mut bytes[at..at + each]);
                }
            }
        }
        bytes
    }

    /// The mean of the ends of all sticks that have both, weighted by the inverse of their distance. For a single stick that is the linear
    /// interpolation between its ends.
    fn bridged(&self, voxels: &Voxels, cell: [usize; 3], n: usize) -> Option<f32> {
        let [width, height, _] = voxels.size;
        let (mut sum, mut weights) = (0.0, 0.0);
        for Stick { step, length, most } in &self.sticks {
            let stride = step[0] + width as isize * (step[1] + height as isize * step[2]);
            // The first voxel with a value within `steps` steps, and its distance.
            let end = |sign: isize, steps: usize| {
                let available = |a: usize| match step[a] * sign {
                    0 => usize::MAX,
                    1 => voxels.size[a] - 1 - cell[a],
                    _ => cell[a],
                };
                let steps = steps.min(available(0)).min(available(1)).min(available(2));
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
