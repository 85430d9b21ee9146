//! Freehand compounding: 2D frames whose pose is tracked become a Cartesian volume.
//!
//! Two steps, as in the pixel-based methods of Rohling, Gee and Berman, *A comparison of freehand three-dimensional ultrasound
//! reconstruction techniques*, Med. Image Anal. 3 (1999), and Solberg et al., *Freehand 3D ultrasound reconstruction algorithms: a
//! review*, Ultrasound Med. Biol. 33 (2007): every pixel is given to the voxels around its place as it arrives ([`Splat`], [`Overlap`]),
//! and voxels that no pixel reached are filled from those around them. The second step bridges gaps along straight lines that end in
//! reached voxels on both sides (Vaughan et al., *Hole filling with oriented sticks in ultrasound volume reconstruction*, J. Med. Imaging
//! 2 (2015)): so holes up to a width are closed, wider ones stay 0 all over, and nothing grows beyond the border of what was swept.

mod accumulate;
mod holes;
mod lattice;
mod pose;

pub use lattice::Lattice;
pub use pose::{Pose, TrackedFrame};

use super::StoredType;
use accumulate::Voxels;
use glam::DVec3;
use holes::Sticks;
use rayon::prelude::*;

/// Voxels of a volume unless asked otherwise: 2^25, about 320 along each edge.
pub const MOST_VOXELS: usize = 1 << 25;
/// Most of these that can be asked for.
const LARGEST: usize = 1 << 31;
/// Weight that a voxel remembers, in pixels that hit it squarely. Beyond, it forgets half: to larger sums f32 adds one more pixel with a
/// rounding that shows in their mean, and after 2^24 it adds none.
const FORGET: f32 = 4096.0;
/// What is larger cannot be added up in f32; as a sample it is no echo.
const LARGEST_SAMPLE: f32 = 1e30;
/// Weights below are rounding: a pixel on a voxel's middle is not given to its neighbours.
const WEIGHTLESS: f64 = 1e-6;
/// What a pixel must weigh in a voxel to be its maximum. One of the eight around it always weighs so much.
const COUNTS: f32 = 0.125;

/// Which voxels a pixel is given to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Splat {
    /// The one whose middle is nearest.
    Nearest,
    /// The eight around it, each with the weight that trilinear interpolation has for it.
    #[default]
    Trilinear,
}

/// What a voxel is that several pixels were given to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overlap {
    /// Their weighted mean, whatever their order up to rounding.
    #[default]
    Mean,
    /// The weighted mean of those of the frame that came last.
    Latest,
    /// The largest of those that weigh at least an eighth.
    Maximum,
}

/// How frames are compounded.
#[derive(Clone, Debug, PartialEq)]
pub struct CompoundingOptions {
    pub splat: Splat,
    pub overlap: Overlap,
    /// Widest gap that is bridged, mm; at most 64 voxels. 0: none.
    pub widest_hole: f64,
    /// The part of each frame that is ultrasound: column and row of its first pixel, columns, rows. `None`: all of it.
    pub clip: Option<[usize; 4]>,
    /// Distance between voxels along each axis, mm. `None`: between the frames' pixels.
    pub spacing: Option<f64>,
    /// What the volume has around the frames that it was laid around, mm.
    pub margin: f64,
    pub most_voxels: usize,
}

impl Default for CompoundingOptions {
    fn default() -> CompoundingOptions {
        CompoundingOptions {
            splat: Splat::default(),
            overlap: Overlap::default(),
            widest_hole: 2.0,
            clip: None,
            spacing: None,
            margin: 5.0,
            most_voxels: MOST_VOXELS,
        }
    }
}

/// What became of the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompoundingCounts {
    /// Compounded.
    pub frames: u64,
    /// Of the compounded: those of which no pixel lies in the volume.
    pub outside: u64,
    /// Without a usable pose, or with samples that do not fit their size.
    pub refused: u64,
    /// Pixels left out because they were not finite, or beyond 1e30.
    pub pixels: u64,
}

/// A volume that grows frame by frame.
///
/// Memory: 8 bytes a voxel, 4 more with [`Overlap::Latest`], and those of the stored type for each slice that a frame has come near.
pub struct Compounder {
    lattice: Lattice,
    stored: StoredType,
    options: CompoundingOptions,
    voxels: Voxels,
    sticks: Sticks,
    /// Hit since they were last given out.
    touched: Vec<bool>,
    /// As they were last given out; empty: zero all over.
    slices: Vec<Vec<u8>>,
    zero: Vec<u8>,
    counts: CompoundingCounts,
}

impl Compounder {
    /// An empty volume whose voxels are `stored`; frames may be of any type, and are given without scaling.
    ///
    /// # Errors
    /// A lattice or options that cannot be, or more voxels than the options allow; in words, before anything is allocated.
    pub fn new(lattice: Lattice, stored: StoredType, options: CompoundingOptions) -> Result<Compounder, String> {
        let grid = &lattice.grid;
        grid.check().map_err(|e| format!("{} {}", e.field, e.fault))?;
        if !lattice.to_volume.is_finite() {
            return Err("the volume's own place is not finite".into());
        }
        let count = grid.size.iter().try_fold(1usize, |n, m| n.checked_mul(*m)).unwrap_or(usize::MAX);
        if count > options.most_voxels.min(LARGEST) {
            let ([x, y, z], most) = (grid.size, options.most_voxels.min(LARGEST));
            return Err(format!("{x} x {y} x {z} voxels: at most {most} are allowed; take a larger spacing"));
        }
        let sticks = Sticks::new(grid, options.widest_hole)?;
        let [x, y, z] = grid.size;
        let voxels = Voxels::new(grid.size, options.overlap);
        let zero = vec![0; x * y * stored.bytes()];
        let (touched, slices) = (vec![false; z], vec![Vec::new(); z]);
        Ok(Compounder {
            lattice,
            stored,
            options,
            voxels,
            sticks,
            touched,
            slices,
            zero,
            counts: CompoundingCounts::default(),
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

    /// Compounds a frame: how many of its pixels lie in the volume.
    ///
    /// # Errors
    /// What is wrong with a frame that is refused; it is counted, and the volume stays as it is.
    pub fn push(&mut self, frame: &TrackedFrame) -> Result<u64, String> {
        let checked = frame.check().and_then(|()| frame.pose.clipped(self.options.clip));
        let [columns, rows] = match checked {
            Ok(clipped) => clipped,
            Err(fault) => {
                self.counts.refused += 1;
                return Err(fault);
            }
        };
        self.voxels.begin();
        let grid = &self.lattice.grid;
        let to_index = |place: DVec3| {
            let place = self.lattice.to_volume.transform_point3(place);
            (place - DVec3::from(grid.origin)) / DVec3::from(grid.spacing)
        };
        let origin = to_index(frame.pose.place(0.0, 0.0));
        let (right, down) =
            (to_index(frame.pose.place(1.0, 0.0)) - origin, to_index(frame.pose.place(0.0, 1.0)) - origin);
        let mut inside = 0;
        for row in rows.0..rows.1 {
            let start = origin + down * row as f64;
            for column in columns.0..columns.1 {
                let at = start + right * column as f64;
                let Some(value) = frame.sample(column, row) else { continue };
                if value.is_nan() || value.abs() > LARGEST_SAMPLE {
                    self.counts.pixels += 1;
                    continue;
                }
                inside += u64::from(self.voxels.splat(at, value, self.options.splat, &mut self.touched));
            }
        }
        self.counts.frames += 1;
        self.counts.outside += u64::from(inside == 0);
        Ok(inside)
    }

    /// Fills the slices anew that frames have come near since the last time, and names them, lowest first.
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

    /// A slice as it was when [`Compounder::changed_slices`] last named it: rows of depth, lateral fastest, little-endian. Zero where nothing
    /// is; `None` beyond the last.
    pub fn slice(&self, k: usize) -> Option<&[u8]> {
        self.slices.get(k).map(|slice| if slice.is_empty() { &self.zero[..] } else { &slice[..] })
    }
}
