//! Finds the rigid motion between two volumes of one body by least squares of their echoes.
//!
//! The levels of both volumes are smoothed by the same Gaussian on lattices of the same spacing. For a place p of the fixed volume, the moving
//! volume's level at R (p - c) + c + t is to be g F(p) + o, with a gain g and an offset o that are found with the motion: two sweeps differ in
//! their gain. The steps are those of Levenberg and Marquardt, from coarse to fine. On the coarsest lattice they start from the best of many
//! shifts. Computed in f64.
//!
//! Behind bone a sweep shows a shadow, which turns about the probe and does not move with the body. A voxel of a fixed sweep therefore counts by the
//! weight exp(-D / 5 mm), where D is the length of its scan line before it, mm, each sample multiplied by its brightness above a floor.
//!
//! The quantity that falls is the share of the variance of the moving volume's levels that a line through the fixed volume's does not explain, 1 -
//! correlation^2: other than a sum of squares it does not fall when the volumes overlap less.

use crate::lattice;
use crate::memory;
use crate::mesh::smooth::Smoother;
use crate::probe::{Geometry, Grid, Rigid};
use crate::source::convert::{self, Volume};
use crate::source::{Frame, StoredType};
use glam::{DAffine3, DQuat, DVec3};
use rayon::prelude::*;

/// Spacings of the lattices from coarse to fine, mm.
const SPACINGS: [f64; 3] = [4.0, 2.0, 1.0];
/// Standard deviation of the Gaussian, spacings: 2.4 mm in the end, by which speckle is averaged.
const DEVIATION: f64 = 2.4;
/// The length of the brightest echo behind which a sample counts by 1/e, mm.
const SHADOW: f64 = 5.0;
/// The brightness from which an echo throws a shadow, as a share of the range of the values.
const SHADOW_FLOOR: f64 = 0.15;
/// Bytes of a voxel: two volumes and the weights with their smoothed levels, and f64 while they are smoothed.
const BYTES: u64 = 32;
/// Shifts that are tried first, along each axis, in spacings of the coarsest lattice: its Gaussian leads from each to the next.
const TRIED: [f64; 5] = [-4.0, -2.0, 0.0, 2.0, 4.0];
/// The best of them, from which the search begins.
const STARTS: usize = 6;
/// Least overlap of the volumes, as a share of the fixed volume.
const LEAST_OVERLAP: f64 = 0.25;
/// Least share of the Gaussian around a voxel that lies in the insonified region: at its border the mean is of another place.
const LEAST_KNOWN: f64 = 0.8;
const MAX_STEPS: usize = 60;
/// The search ends with a step that moves by less, mm and degrees.
const LEAST_STEP: f64 = 1e-4;
/// Unknowns: rotation vector, shift, gain and offset.
const UNKNOWNS: usize = 8;

/// A motion that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registered {
    /// Maps positions in the moving volume's space to those of the same tissue in the fixed volume's. It turns about the [`centre`] of the fixed one.
    pub motion: Rigid,
    /// Correlation of the smoothed levels where the volumes overlap, each with its weight, -1..=1.
    pub correlation: f64,
    /// Share of the fixed volume's insonified region that the moved volume covers, 0..=1.
    pub overlap: f64,
}

/// Finds the motion that takes the body of `moving` to where it is in `fixed`. Both geometries have their own space, in mm.
///
/// # Errors
/// One line: volumes that take too much memory, a volume without any structure, or an overlap of less
/// than a quarter of the fixed volume.
pub fn register(fixed: &Volume, moving: &Volume) -> Result<Registered, String> {
    let finest = SPACINGS[SPACINGS.len() - 1];
    let grids = [fixed, moving].map(|volume| convert::lattice(volume.geometry(), finest));
    let [own, other] = [grids[0].clone()?, grids[1].clone()?];
    let voxels = lattice::voxels(&own)? as u64 + lattice::voxels(&other)? as u64;
    memory::check(voxels.saturating_mul(BYTES)).map_err(|why| format!("the registration {why}"))?;
    let (about, other_centre) = (centre(fixed.geometry()), centre(moving.geometry()));
    let weights = shadow_weights(fixed).map(|weights| Levels::of(&weights, own));
    let [fixed, moving] = [(fixed, own), (moving, other)].map(|(volume, grid)| Levels::of(volume, grid));
    let mut found: Option<Fit> = None;
    for spacing in SPACINGS {
        let (step, deviation) = ((spacing / finest).round() as usize, DEVIATION * spacing);
        // Of the fixed volume a voxel for each standard deviation is enough; the moving one is interpolated.
        let (fixed, moving) = (fixed.smoothed(deviation, 2 * step), moving.smoothed(deviation, step));
        let weights = weights.as_ref().map(|weights| weights.smoothed(deviation, 2 * step));
        let problem = Problem { fixed: &fixed, moving: &moving, weights: weights.as_ref(), about };
        let starts = match &found {
            Some(fit) => vec![fit.place],
            None => problem.starts(spacing, other_centre - about),
        };
        let best = starts.into_iter().filter_map(|start| problem.fit(start));
        found = best.min_by(|a, b| a.cost().total_cmp(&b.cost()));
        if found.is_none() {
            break;
        }
    }
    let fit = found.ok_or("the volumes overlap by less than a quarter, or hold no structure")?;
    let motion = Rigid::of(&fit.place.map(about).inverse(), about);
    Ok(Registered { motion, correlation: fit.sums.correlation(), overlap: fit.overlap })
}

/// The middle of the box around the insonified region of a volume, mm. A motion of [`register`] turns about the centre of the fixed volume.
pub fn centre(geometry: &Geometry) -> DVec3 {
    let (low, high) = match geometry {
        Geometry::Sweep(probe) => probe.bounds(),
        Geometry::Cartesian(grid) => {
            let last = DVec3::from_array(grid.size.map(|n| n as f64 - 1.0));
            (lattice::place(grid, DVec3::ZERO), lattice::place(grid, last))
        }
    };
    0.5 * (low + high)
}

/// The weight of each sample of a sweep, 0 to 255 for 0 to 1: see above. None for a Cartesian volume, whose scan lines are not known.
fn shadow_weights(volume: &Volume) -> Option<Volume> {
    let Geometry::Sweep(probe) = volume.geometry() else { return None };
    let stored = volume.stored();
    let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
    let mut range = |value| (least, most) = (f64::min(least, value), f64::max(most, value));
    volume.frames().iter().for_each(|frame| stored.for_each(frame, &mut range));
    let mut weights = Volume::new(volume.geometry().clone(), StoredType::U8);
    for (slice, frame) in volume.frames().iter().enumerate() {
        let mut bytes = Vec::with_capacity(frame.len() / stored.bytes());
        for line in frame.chunks_exact(probe.samples * stored.bytes()) {
            let mut before = 0.0;
            stored.for_each(line, |value| {
                StoredType::U8.append(255.0 * f64::exp(-before / SHADOW), &mut bytes);
                // A constant volume has no range: its samples are NaN here, and max gives 0.
                before += ((value - least) / (most - least) - SHADOW_FLOOR).max(0.0) * probe.sample_pitch;
            });
        }
        weights.take(Frame::of_slice(0, slice, bytes));
    }
    Some(weights)
}

/// Levels of a lattice, NaN outside the insonified region.
struct Levels {
    grid: Grid,
    values: Vec<f32>,
}

impl Levels {
    fn of(volume: &Volume, grid: Grid) -> Levels {
        let mut slice = vec![0.0; grid.size[0] * grid.size[1]];
        let mut values = Vec::with_capacity(slice.len() * grid.size[2]);
        for z in 0..grid.size[2] {
            volume.slice(&grid, z, &mut slice);
            values.extend(slice.iter().map(|value| *value as f32));
        }
        Levels { grid, values }
    }

    /// Every `step`-th voxel along each axis of the levels smoothed by a Gaussian with this standard deviation, mm.
    fn smoothed(&self, deviation: f64, step: usize) -> Levels {
        let Grid { size, spacing, origin } = self.grid;
        let each = size[0] * size[1];
        let coarse = Grid { size: size.map(|n| n.div_ceil(step)), spacing: spacing.map(|s| s * step as f64), origin };
        let [mut smoother, mut shares] = [0, 1].map(|_| Smoother::new(size, spacing, deviation));
        let [mut slice, mut known] = [0, 1].map(|_| vec![0.0; each]);
        let mut values = Vec::with_capacity(coarse.size.iter().product());
        for z in 0..size[2] {
            let fill = |z: usize, out: &mut [f64], of: fn(f32) -> f64| {
                let from = &self.values[z * each..][..each];
                out.iter_mut().zip(from).for_each(|(out, value)| *out = of(*value));
            };
            smoother.slice(z, &mut slice, |z, out| fill(z, out, f64::from));
            shares.slice(z, &mut known, |z, out| fill(z, out, |value| f64::from(u8::from(!value.is_nan()))));
            if z % step == 0 {
                let all = slice.chunks_exact(size[0]).zip(known.chunks_exact(size[0])).step_by(step);
                let voxels = all.flat_map(|(row, known)| row.iter().zip(known).step_by(step));
                values.extend(voxels.map(|(value, known)| if *known < LEAST_KNOWN { f32::NAN } else { *value as f32 }));
            }
        }
        Levels { grid: coarse, values }
    }

    /// The level at a place, interpolated, and its gradient, 1/mm. None outside, and next to an unknown level.
    fn at(&self, place: DVec3) -> Option<(f64, DVec3)> {
        let Grid { size, spacing, origin } = self.grid;
        let index = (place - DVec3::from(origin)) / DVec3::from(spacing);
        let mut low = [0; 3];
        for axis in 0..3 {
            // NaN fails, too.
            if !(index[axis] >= 0.0 && index[axis] < (size[axis] - 1) as f64) {
                return None;
            }
            low[axis] = index[axis] as usize;
        }
        let f = index - DVec3::from_array(low.map(|n| n as f64));
        let base = (low[2] * size[1] + low[1]) * size[0] + low[0];
        let [down, deep] = [size[0], size[0] * size[1]];
        let of = |n: usize| f64::from(self.values[base + n]);
        let row = |n: usize| (of(n) + f.x * (of(n + 1) - of(n)), of(n + 1) - of(n));
        let [a, b, c, d] = [row(0), row(down), row(deep), row(deep + down)];
        let mix = |from: f64, to: f64, share: f64| from + share * (to - from);
        let (near, far) = (mix(a.0, b.0, f.y), mix(c.0, d.0, f.y));
        let gradient =
            DVec3::new(mix(mix(a.1, b.1, f.y), mix(c.1, d.1, f.y), f.z), mix(b.0 - a.0, d.0 - c.0, f.z), far - near);
        let value = mix(near, far, f.z);
        (!value.is_nan()).then(|| (value, gradient / DVec3::from(spacing)))
    }
}

/// Where the search is: the map from the fixed to the moving volume.
#[derive(Clone, Copy)]
struct Place {
    rotation: DQuat,
    shift: DVec3,
}

impl Place {
    fn map(&self, about: DVec3) -> DAffine3 {
        DAffine3::from_translation(about + self.shift)
            * DAffine3::from_quat(self.rotation)
            * DAffine3::from_translation(-about)
    }
}

/// A place of the search with what was found there.
struct Fit {
    place: Place,
    sums: Sums,
    overlap: f64,
}

impl Fit {
    fn cost(&self) -> f64 {
        1.0 - self.sums.correlation().powi(2)
    }
}

/// Sums over the voxels that both volumes have, each with its weight.
#[derive(Clone, Copy)]
struct Sums {
    /// Products of the derivatives of the residual by the unknowns; with its last row and column those with the moving volume's level.
    products: [[f64; UNKNOWNS + 1]; UNKNOWNS + 1],
}

/// Columns of the gain, the offset and the moving volume's level.
const GAIN: usize = 6;
const OFFSET: usize = 7;
const LEVEL: usize = 8;

impl Sums {
    const NONE: Sums = Sums { products: [[0.0; UNKNOWNS + 1]; UNKNOWNS + 1] };

    fn take(&mut self, columns: &[f64; UNKNOWNS + 1]) {
        for (n, row) in self.products.iter_mut().enumerate() {
            row[n..].iter_mut().zip(&columns[n..]).for_each(|(sum, right)| *sum += columns[n] * right);
        }
    }

    /// Fills what lies below the diagonal.
    fn mirror(&mut self) {
        for (n, k) in (0..=UNKNOWNS).flat_map(|n| (0..n).map(move |k| (n, k))) {
            self.products[n][k] = self.products[k][n];
        }
    }

    fn add(mut self, other: &Sums) -> Sums {
        self.products.iter_mut().flatten().zip(other.products.iter().flatten()).for_each(|(sum, more)| *sum += more);
        self
    }

    fn count(&self) -> f64 {
        self.products[OFFSET][OFFSET]
    }

    /// Correlation of the levels; 0 where one of them is constant.
    fn correlation(&self) -> f64 {
        let (p, n) = (&self.products, self.count());
        let covariance = |a: usize, b: usize| p[a][b] - p[a][OFFSET] * p[b][OFFSET] / n;
        let found = covariance(GAIN, LEVEL) / (covariance(GAIN, GAIN) * covariance(LEVEL, LEVEL)).sqrt();
        if found.is_finite() { found } else { 0.0 }
    }

    /// The rotation vector, rad, and the shift, mm, of a damped Gauss-Newton step.
    fn step(&self, damping: f64) -> Option<[DVec3; 2]> {
        let mut rows: [[f64; UNKNOWNS + 1]; UNKNOWNS] = std::array::from_fn(|n| self.products[n]);
        for (n, row) in rows.iter_mut().enumerate() {
            // The gain and the offset are exact for each motion.
            row[n] *= if n < GAIN { 1.0 + damping } else { 1.0 };
        }
        let found = solved(rows)?;
        // Levels are to equal gain x F + offset - (the change by the motion).
        let vector = |at: usize| -DVec3::new(found[at], found[at + 1], found[at + 2]);
        Some([vector(0), vector(3)])
    }
}

/// Solves a linear system by elimination with pivots; the last column is the right side. None if it has no one solution.
fn solved(mut rows: [[f64; UNKNOWNS + 1]; UNKNOWNS]) -> Option<[f64; UNKNOWNS]> {
    for n in 0..UNKNOWNS {
        let pivot = (n..UNKNOWNS).max_by(|a, b| rows[*a][n].abs().total_cmp(&rows[*b][n].abs()))?;
        rows.swap(n, pivot);
        let first = rows[n];
        for row in &mut rows[n + 1..] {
            let share = row[n] / first[n];
            row.iter_mut().zip(first).for_each(|(value, of)| *value -= share * of);
        }
    }
    let mut found = [0.0; UNKNOWNS];
    for n in (0..UNKNOWNS).rev() {
        let known: f64 = (n + 1..UNKNOWNS).map(|k| rows[n][k] * found[k]).sum();
        found[n] = (rows[n][UNKNOWNS] - known) / rows[n][n];
    }
    found.iter().all(|value| value.is_finite()).then_some(found)
}

/// Two smoothed volumes, and the point that the rotation leaves.
struct Problem<'a> {
    fixed: &'a Levels,
    moving: &'a Levels,
    /// At the voxels of `fixed`, 0..=255; None: all count alike.
    weights: Option<&'a Levels>,
    about: DVec3,
}

impl Problem<'_> {
    /// Shifts to begin with, the best first: around none, and around that of one centre to the other, `between`.
    fn starts(&self, spacing: f64, between: DVec3) -> Vec<Place> {
        let bases = [DVec3::ZERO, between];
        let bases = &bases[..if between.length() > spacing { 2 } else { 1 }];
        let along = |axis: usize| TRIED.map(move |n| n * spacing * DVec3::AXES[axis]);
        let shifts = bases.iter().flat_map(|base| along(0).map(|x| base + x));
        let shifts = shifts.flat_map(|x| along(1).map(|y| x + y)).flat_map(|xy| along(2).map(|z| xy + z));
        let tried = shifts.filter_map(|shift| self.sums(Place { rotation: DQuat::IDENTITY, shift }));
        let mut tried: Vec<Fit> = tried.collect();
        tried.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        tried.into_iter().take(STARTS).map(|fit| fit.place).collect()
    }

    /// The best place near a start.
    fn fit(&self, start: Place) -> Option<Fit> {
        let (mut fit, mut damping) = (self.sums(start)?, 1e-3);
        for _ in 0..MAX_STEPS {
            let Some([turn, shift]) = fit.sums.step(damping) else { break };
            let rotation = (DQuat::from_scaled_axis(turn) * fit.place.rotation).normalize();
            let next = Place { rotation, shift: fit.place.shift + shift };
            match self.sums(next).filter(|next| next.cost() < fit.cost()) {
                Some(next) => {
                    (fit, damping) = (next, damping * 0.1);
                    if turn.length().to_degrees() < LEAST_STEP && shift.length() < LEAST_STEP {
                        break;
                    }
                }
                None if damping > 1e6 => break,
                None => damping *= 10.0,
            }
        }
        (fit.sums.correlation() != 0.0).then_some(fit)
    }

    /// What holds at a place; None if the volumes overlap too little there.
    fn sums(&self, place: Place) -> Option<Fit> {
        let (map, grid) = (place.map(self.about), &self.fixed.grid);
        let each = grid.size[0] * grid.size[1];
        let slice = |z: usize| {
            let (mut sums, mut known, mut shared) = (Sums::NONE, 0usize, 0usize);
            for (n, level) in self.fixed.values[z * each..][..each].iter().enumerate().filter(|(_, f)| !f.is_nan()) {
                known += 1;
                let own = [n % grid.size[0], n / grid.size[0], z].map(|n| n as f64);
                let there = map.transform_point3(lattice::place(grid, DVec3::from_array(own)));
                let Some((value, gradient)) = self.moving.at(there) else { continue };
                let turned = (there - self.about - place.shift).cross(gradient);
                let ([a, b, c], [d, e, f]) = (turned.to_array(), gradient.to_array());
                let weight = self.weights.map_or(1.0, |weights| f64::from(weights.values[z * each + n]) / 255.0);
                sums.take(&[a, b, c, d, e, f, f64::from(*level), 1.0, value].map(|column| column * weight.sqrt()));
                shared += 1;
            }
            (sums, known, shared)
        };
        // Added in the order of the slices, so that the result does not depend on the number of threads.
        let slices: Vec<(Sums, usize, usize)> = (0..grid.size[2]).into_par_iter().map(slice).collect();
        let [known, shared] = slices.iter().fold([0; 2], |[known, shared], slice| [known + slice.1, shared + slice.2]);
        let mut sums = slices.iter().fold(Sums::NONE, |all, (sums, ..)| all.add(sums));
        sums.mirror();
        let overlap = shared as f64 / known.max(1) as f64;
        (overlap >= LEAST_OVERLAP).then_some(Fit { place, sums, overlap })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::phantom::{Phantom, PhantomOptions};
    use std::str::FromStr;

    fn phantom(seed: u64, moved: Rigid) -> Volume {
        let options = PhantomOptions { seed, moved, still: true, ..PhantomOptions::default() };
        let phantom = Phantom::new(options).expect("options");
        let mut volume = Volume::new(Geometry::Sweep(phantom.probe(0)), StoredType::U8);
        phantom.volume(0).into_iter().for_each(|frame| volume.take(frame));
        volume
    }

    /// The head, moved by what is known, in other speckle. What the sweep itself adds stays where it is, such as the width of the beam across the
    /// frames, 2 mm there, and the noise of each depth: 0.11 mm and 0.19 degrees are left.
    fn is_found(seed: u64, motion: &str) {
        let about = DVec3::new(0.0, 95.0, 0.0);
        let truth = Rigid { about, ..motion.parse().expect("a motion") };
        let found = register(&phantom(1, Rigid::default()), &phantom(seed, truth)).expect("a motion");
        // What was found moves the body back.
        let off = Rigid::of(&(found.motion.map() * truth.map()), about);
        assert!(off.shift.length() < 0.2 && off.angle() < 0.2, "{truth}: {off}, {found:?}");
        assert!(found.correlation > 0.97 && (0.7..=1.0).contains(&found.overlap), "{truth}: {found:?}");
    }

    #[test]
    fn a_known_motion_of_the_phantom_is_found() {
        is_found(9, "3,-2,-3,3,0,5");
    }

    #[test]
    fn a_larger_motion_of_the_phantom_is_found() {
        is_found(12, "2,3,-5,-4,7,3");
    }

    /// A lattice of a function of space.
    fn lattice_of(offset: f64, level: impl Fn(DVec3) -> f64) -> Volume {
        let grid = Grid { size: [40; 3], spacing: [1.5; 3], origin: [offset; 3] };
        let mut volume = Volume::new(Geometry::Cartesian(grid), StoredType::F32);
        for z in 0..40 {
            let places =
                (0..1600).map(|n| lattice::place(&grid, DVec3::new((n % 40) as f64, (n / 40) as f64, z as f64)));
            let bytes = places.flat_map(|place| (level(place) as f32).to_le_bytes()).collect();
            volume.take(Frame::of_slice(0, z, bytes));
        }
        volume
    }

    /// Three bodies with a gain and an offset, without noise: a few micrometres are left, of the interpolation.
    #[test]
    fn volumes_of_other_gain_and_other_space_are_laid_on_each_other() {
        let bodies = [DVec3::new(20.0, 25.0, 30.0), DVec3::new(38.0, 32.0, 24.0), DVec3::new(28.0, 40.0, 38.0)];
        let level = |p: DVec3| bodies.iter().map(|c| (-p.distance_squared(*c) / 50.0).exp()).sum::<f64>();
        let truth = Rigid { about: DVec3::splat(30.0), ..Rigid::from_str("2,-1.5,1,4,-3,5").expect("a motion") };
        let back = truth.map().inverse();
        let fixed = lattice_of(0.0, level);
        let moving = lattice_of(1.0, |p| 0.3 + 2.0 * level(back.transform_point3(p)));
        let found = register(&fixed, &moving).expect("a motion");
        let off = Rigid::of(&(found.motion.map() * truth.map()), truth.about);
        assert!(off.shift.length() < 0.01 && off.angle() < 0.02, "{off}, {found:?}");
        assert!(found.correlation > 0.999, "{found:?}");
    }

    #[test]
    fn volumes_without_structure_are_refused_and_far_ones_found() {
        let flat = lattice_of(0.0, |_| 0.5);
        assert!(register(&flat, &flat).is_err());
        // The body of one in its own space, at the other end of the world.
        let bodies = [DVec3::new(20.0, 25.0, 30.0), DVec3::new(38.0, 32.0, 24.0), DVec3::new(28.0, 40.0, 38.0)];
        let level = |p: DVec3| bodies.iter().map(|c| (-p.distance_squared(*c) / 50.0).exp()).sum::<f64>();
        let [here, away] = [0.0, 500.0].map(|offset| lattice_of(offset, |p| level(p - DVec3::splat(offset))));
        let found = register(&here, &away).expect("a motion");
        assert!((found.motion.shift + DVec3::splat(500.0)).length() < 0.01, "{found:?}");
    }
}
