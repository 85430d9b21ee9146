//! The volume of a body by the echoes at its surface.
//!
//! The power of echoes adds up: where a voxel or the beam of the probe is partly in a body, the mean echo lies between those of the two
//! classes by that share. So the volume is that of what lies deeper than the shell around the surface, plus that of the shell times
//!
//! (mean of the shell - mean outside) / (mean inside - mean outside)
//!
//! with the means of the bands next to the shell on both sides. The blur of the probe, voxels at the border, smoothing, and a surface that is
//! off by less than the shell is thick cancel; speckle averages out. Half of the step between the classes at the surface is the same
//! condition at one place.
//!
//! The interval of 95 % has three parts, added as squares: 2.5 and 97.5 % of the bootstrap, which draws the patches again that the
//! surface and the bands consist of; what a shell of 0.7 times the thickness gives instead; and what a range of the log compression gives
//! that is 10 % larger or smaller.

use crate::distance::distances;
use crate::field::{Field, smoothed};
use crate::labels::Labels;
use crate::lattice::{self, Region, voxel};
use crate::statistics::{self, mix};
use std::collections::BTreeMap;

/// Half of the thickness of the shell, in standard deviations of the smoothing that found the surface, and the most, in inner radii.
const SHELL: f64 = 1.75;
const MOST_OF_RADIUS: f64 = 0.45;
/// Standard deviation of the rounding of the surface that the shell lies around, in those of the smoothing that found it.
const ROUNDING: f64 = 2.0;
/// Far end of the bands, in halves of the shell.
const BAND: f64 = 3.0;
/// Share of the thickness of the shell that it is compared with.
const THINNER: f64 = 0.7;
/// Edge of the patches, in halves of the shell.
const PATCH: f64 = 2.5;
/// Times that patches are drawn.
const DRAWS: usize = 400;
/// Exponents of the echo: as it is, and with a range of the log compression that is 10 % smaller and larger.
const EXPONENTS: [f64; 3] = [1.0, 0.9, 1.1];

/// An estimated volume and its 95 % confidence interval (`low` to `high`), mm^3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    pub volume: f64,
    pub low: f64,
    pub high: f64,
}

/// The estimated volume of a body, and the shell of voxels around its surface.
pub(crate) struct Shell {
    pub measured: Measured,
    /// Numbers of the voxels that belong to the body beyond doubt.
    core: usize,
    /// Voxels of the shell.
    shell: Vec<u32>,
}

/// Number of voxels, of those that are labelled, and the sums of their echoes with each exponent.
#[derive(Clone, Copy, Default)]
struct Sum {
    count: f64,
    labelled: f64,
    echoes: [f64; 3],
}

impl Sum {
    fn take(&mut self, echo: f64, is_labelled: bool, count: usize) {
        self.count += 1.0;
        self.labelled += f64::from(u8::from(is_labelled));
        for (sum, exponent) in self.echoes.iter_mut().zip(&EXPONENTS).take(count) {
            *sum += if *exponent == 1.0 { echo } else { echo.powf(*exponent) };
        }
    }

    fn add(&mut self, other: &Sum) {
        self.count += other.count;
        self.labelled += other.labelled;
        self.echoes.iter_mut().zip(other.echoes).for_each(|(sum, more)| *sum += more);
    }
}

/// Sums of a patch: inside, shell, outside.
type Patch = [Sum; 3];

/// Estimates the volume of the body with a label from the echoes at its surface. `body`: linear indices of its voxels; `smoothing`: standard
/// deviation, mm, of the Gaussian that was used to find it.
///
/// # Errors
/// One line: the reason why it cannot be measured.
pub(crate) fn measure(
    field: &Field,
    labels: &Labels,
    label: u8,
    body: &[u32],
    smoothing: f64,
) -> Result<Shell, &'static str> {
    let grid = labels.grid();
    let widest = grid.spacing.iter().copied().fold(0.0, f64::max);
    let half = (SHELL * smoothing).max(2.0 * widest);
    let reach = BAND * half + widest;
    let region = Region::around(body, grid, reach);
    let numbers: Vec<u32> = region.indices(grid.size).map(|n| n as u32).collect();
    let is_known = |n: usize| !field.amplitudes()[numbers[n] as usize].is_nan();
    let of = |n: usize| labels.voxels()[numbers[n] as usize];
    let rounded = rounded(region.size, grid.spacing, ROUNDING * smoothing, |n| of(n) == label);
    // What is inside takes no part of another body.
    let is_in = |n: usize| rounded[n] && (of(n) == label || of(n) == 0);
    let is_other = |n: usize| of(n) != label && of(n) != 0;
    let is_alone = !(0..numbers.len()).any(is_other);
    let inwards = distances(region.size, grid.spacing, reach, |n| !is_in(n) && is_known(n));
    let outwards = distances(region.size, grid.spacing, reach, is_in);
    let others = if is_alone { Vec::new() } else { distances(region.size, grid.spacing, reach, is_other) };
    // The surface lies between the centres of voxels.
    let border = grid.spacing.iter().sum::<f64>() / 6.0;
    let deepest = (0..numbers.len()).filter(|n| is_in(*n)).map(|n| f64::from(inwards[n]).min(reach));
    let radius = deepest.fold(0.0, f64::max) - border;
    let half = half.min(MOST_OF_RADIUS * radius).max(widest);
    let signed = |n: usize| match is_in(n) {
        true => border - f64::from(inwards[n]),
        false => f64::from(outwards[n]) - border,
    };
    let exponents = if field.is_from_levels() { EXPONENTS.len() } else { 1 };
    let sums = |half: f64| {
        let mut found = Found::default();
        for n in (0..numbers.len()).filter(|n| is_known(*n)) {
            let (at, away) = (signed(n), others.get(n).map_or(f64::INFINITY, |away| f64::from(*away) - border));
            // What is around another body says nothing of this one.
            if !is_in(n) && (is_other(n) || away <= at.min(half)) {
                continue;
            }
            found.core += usize::from(at <= -half);
            let band = match at {
                _ if at.abs() < half => 1,
                _ if at.abs() > BAND * half => continue,
                _ if at < 0.0 => 0,
                _ => 2,
            };
            let edge = PATCH * half;
            let place = voxel(n, region.size);
            let patch = [0, 1, 2].map(|a| (place[a] as f64 * grid.spacing[a] / edge) as u32);
            found.patches.entry(patch).or_default()[band].take(field.echo(numbers[n] as usize), at < 0.0, exponents);
            if band == 1 {
                found.shell.push(numbers[n]);
            }
        }
        found
    };
    let found = sums(half);
    let each = lattice::voxel_volume(grid);
    let patches: Vec<Patch> = found.patches.into_values().collect();
    let all = total(patches.iter());
    share_of(&all, 0).filter(|share| (0.0..=1.0).contains(share)).ok_or("no step at its surface")?;
    // What the echoes of the shell say beyond the labels: of that the patches differ by speckle alone, not by their shape.
    let beyond = |sums: &Patch, exponent: usize| Some(sums[1].count * share_of(sums, exponent)? - sums[1].labelled);
    let volume_of = |beyond: f64| each * (found.core as f64 + all[1].labelled + beyond);
    let volume = volume_of(beyond(&all, 0).unwrap_or(0.0));
    let mut random = Random(u64::from(label) + 1);
    let mut draws: Vec<f64> = (0..DRAWS)
        .filter_map(|_| beyond(&total((0..patches.len()).map(|_| &patches[random.below(patches.len())])), 0))
        .map(volume_of)
        .collect();
    draws.sort_by(f64::total_cmp);
    let end = |share: f64| statistics::quantile(&draws, share).unwrap_or(volume) - volume;
    let by_range = (1..exponents).filter_map(|n| beyond(&all, n)).map(|beyond| volume_of(beyond) - volume);
    let by_range = by_range.fold(0.0, |most: f64, off| most.max(off.abs()));
    let thinner = sums(THINNER * half);
    let others = total(thinner.patches.values());
    let by_shell =
        beyond(&others, 0).map_or(0.0, |beyond| each * (thinner.core as f64 + others[1].labelled + beyond) - volume);
    let width = |off: f64| (off * off + by_range * by_range + by_shell * by_shell).sqrt();
    let measured = Measured { volume, low: (volume - width(end(0.025))).max(0.0), high: volume + width(end(0.975)) };
    Ok(Shell { measured, core: found.core, shell: found.shell })
}

/// A set without its small dents and bumps: where a Gaussian of the set is at least a half. Speckle made them, and a shell that followed them would
/// have more of the bright speckle inside. A set of which nothing is left stays as it is.
fn rounded(size: [usize; 3], spacing: [f64; 3], deviation: f64, is_in: impl Fn(usize) -> bool + Sync) -> Vec<bool> {
    let shares = |n: usize| f64::from(u8::from(is_in(n)));
    let rounded: Vec<bool> = smoothed(size, spacing, deviation, shares, |share| share >= 0.5);
    if rounded.contains(&true) { rounded } else { (0..rounded.len()).map(is_in).collect() }
}

/// What is found in a region.
#[derive(Default)]
struct Found {
    core: usize,
    /// In their order, so that sums are the same in every run.
    patches: BTreeMap<[u32; 3], Patch>,
    shell: Vec<u32>,
}

fn total<'a>(patches: impl Iterator<Item = &'a Patch>) -> Patch {
    patches.fold(Patch::default(), |mut all, patch| {
        all.iter_mut().zip(patch).for_each(|(all, one)| all.add(one));
        all
    })
}

/// The share of the shell that is body. None if a band is empty or both are alike.
fn share_of(sums: &Patch, exponent: usize) -> Option<f64> {
    let [inside, shell, outside] = sums.map(|sum| sum.echoes[exponent] / sum.count);
    let share = (shell - outside) / (inside - outside);
    share.is_finite().then_some(share)
}

impl Shell {
    /// Changes the labels of the shell so that as many voxels have the label as the estimated volume needs: besides the core, those of the shell
    /// with the largest `order`.
    pub(crate) fn relabel(&self, labels: &mut Labels, label: u8, order: impl Fn(usize) -> f32) {
        let each = lattice::voxel_volume(labels.grid());
        let count = ((self.measured.volume / each).round() as usize).saturating_sub(self.core);
        let mut shell: Vec<u32> = self.shell.clone();
        shell.sort_unstable_by(|a, b| order(*b as usize).total_cmp(&order(*a as usize)));
        let (body, others) = shell.split_at(count.min(shell.len()));
        labels.set(body, label);
        labels.set(others, 0);
    }
}

/// Pseudo-random numbers that are the same in each run (Steele and others, Fast splittable pseudorandom number generators, OOPSLA 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) % count as u64) as usize
    }
}
