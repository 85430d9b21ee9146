//! Bodies that are brighter or darker than what is around them: found by threshold or grown from a seed, counted, and measured.

use crate::distance::distances;
use crate::field::{Field, Scale};
use crate::labels::Labels;
use crate::lattice::{self, Region, nearest, voxel};
use crate::probe::{Grid, World};
use crate::source::convert::Volume;
use crate::volume::{self, Measured};
use glam::DVec3;

/// Most bodies that are labelled.
const MAX_BODIES: usize = 255;
/// Steps of the search for the level, and the share of the step between the classes at which it ends.
const MAX_STEPS: usize = 4;
const SETTLED: f64 = 0.01;
/// Most voxels by which the means next to the surface are computed.
const MAX_SAMPLES: usize = 1 << 21;
/// Bins of the histogram of the first threshold.
const BINS: usize = 512;

/// The usual [`Search::smoothing`], mm.
pub const SMOOTHING: f64 = 1.2;
/// The usual [`Search::opening`] with a seed, mm: gaps that speckle leaves in a wall are narrower than twice this radius.
pub const OPENING: f64 = 1.0;
/// Widest smoothing and opening, in the shortest edge of a voxel: slices within it are kept in memory.
const MAX_REACH: f64 = 32.0;

/// How connected bodies, such as cysts or follicles, are searched for in the echoes of a volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// True if bodies are darker than what is around them, false if brighter.
    pub is_dark: bool,
    /// Level of the echo at the surface of bodies, 0..=1, in the scale of `Scale::searched`. None: half of the step between the two classes of echoes
    /// next to the surface.
    pub level: Option<f64>,
    /// Standard deviation, mm, of the Gaussian that smooths the echoes before the search.
    pub smoothing: f64,
    /// Radius of the morphological opening, mm: necks thinner than twice the radius do not connect bodies, and belong to none. 0: no opening.
    pub opening: f64,
    /// A position within the only body that is searched for, mm in the coordinates of the grid. None: all bodies are searched for.
    pub seed: Option<DVec3>,
    /// Smallest volume of a body, mm^3; smaller ones are ignored. Without effect if there is a seed.
    pub least: f64,
}

impl Search {
    /// The usual search on a grid: smoothing by 1.2 mm, and with a seed an opening by 1 mm, or less where that would be more than
    /// [`Search::most`]; any size.
    pub fn usual(grid: &Grid, is_dark: bool, seed: Option<DVec3>) -> Search {
        let most = Search::most(grid);
        let opening = if seed.is_some() { OPENING.min(most) } else { 0.0 };
        Search { is_dark, level: None, smoothing: SMOOTHING.min(most), opening, seed, least: 0.0 }
    }

    /// Largest smoothing and opening on a grid, mm: 32 times the shortest edge of a voxel.
    pub fn most(grid: &Grid) -> f64 {
        MAX_REACH * grid.spacing.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// A body that was found, and its volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    pub label: u8,
    /// Mean position of its labelled voxels, mm in the coordinates of the grid.
    pub centroid: DVec3,
    /// Volume of its labelled voxels, mm^3.
    pub labelled: f64,
    /// Volume of the body as estimated from the echoes at its surface, or the reason why that is impossible.
    pub measured: Result<Measured, &'static str>,
    /// True if the body touches the border of the grid or voxels without an echo, so that a part of it may be missing.
    pub is_cut: bool,
}

/// The bodies that were found, labelled from 1 on: the largest at [`Found::level`] first.
#[derive(Clone, Debug)]
pub struct Found {
    pub labels: Labels,
    pub bodies: Vec<Body>,
    /// Level of the echo at which the bodies were found, the given one or the one that replaced it, in the scale of `Scale::searched`.
    pub level: f64,
    /// Number of bodies that have no label because there are more than 255.
    pub left_out: usize,
}

/// Finds, within a box, the largest body that is brighter than what is around it. `corners`: the lowest and the highest corner of the box, mm in the
/// space of the volume. Returns the body, and the level at which it was found as a share of the sample range, 0..=1. `range`: the stored values at
/// both ends of the sample range.
///
/// # Errors
/// One line: no voxel lies in the box, there would be too many voxels or too little memory, or as [`find`].
pub fn largest_within(volume: &Volume, range: [f64; 2], corners: [DVec3; 2]) -> Result<(Body, f64), String> {
    let grid = lattice::usual_grid(volume.geometry())?;
    let grid = lattice::cropped(&grid, corners).ok_or("the region is empty")?;
    let scale = Scale::by_speckle(volume, range);
    let field = Field::of(volume, range, scale, grid, || ())?;
    let found = find(&field, World::of(&grid), &Search::usual(&grid, false, None))?;
    let body = found.bodies.into_iter().next().ok_or("there is no body")?;
    Ok((body, scale.share(found.level)))
}

/// Finds, labels and measures bodies. `world`: map from the voxels of the grid to the world, for the labels. If the level is not given, the surface
/// of each measured body is moved to the level of the smoothed echoes that encloses its measured volume.
///
/// # Errors
/// One line: the echoes are not of two classes, there is no body, the seed is in none, or there is no memory for the labels.
pub fn find(field: &Field, world: World, search: &Search) -> Result<Found, String> {
    let grid = *field.grid();
    let mut labels = Labels::new(grid, world)?;
    let smoothed = field.smoothed(search.smoothing);
    let seed_at = |seed| nearest(grid.size, (seed - DVec3::from(grid.origin)) / DVec3::from(grid.spacing));
    let seed = search.seed.map(|seed| seed_at(seed).ok_or("the seed lies outside the box")).transpose()?;
    let (level, mut bodies) = match search.level {
        Some(level) => (level, bodies_at(&smoothed, &grid, search, seed, level)?),
        None => settled(field, &smoothed, search, seed)?,
    };
    let left_out = bodies.len().saturating_sub(MAX_BODIES);
    bodies.truncate(MAX_BODIES);
    bodies.iter().zip(1..=u8::MAX).for_each(|(body, label)| labels.set(body, label));
    let mut measured = Vec::new();
    for (body, label) in bodies.iter().zip(1..=u8::MAX) {
        let shell = volume::measure(field, &labels, label, body, search.smoothing);
        if let (Ok(shell), None) = (&shell, search.level) {
            shell.relabel(&mut labels, label, |n| if search.is_dark { -smoothed[n] } else { smoothed[n] });
        }
        measured.push(shell.map(|shell| shell.measured));
    }
    let bodies = described(field, &labels, measured);
    Ok(Found { labels, bodies, level, left_out })
}

/// The bodies that are labelled from 1 on, with what was measured of them.
fn described(field: &Field, labels: &Labels, measured: Vec<Result<Measured, &'static str>>) -> Vec<Body> {
    let grid = labels.grid();
    let mut sums = vec![(DVec3::ZERO, 0usize, false); measured.len() + 1];
    for (n, label) in labels.voxels().iter().enumerate().filter(|(_, label)| **label > 0) {
        let (sum, count, is_cut) = &mut sums[usize::from(*label)];
        *sum += DVec3::from_array(voxel(n, grid.size).map(|i| i as f64));
        *count += 1;
        let is_known = |near: Option<usize>| near.is_some_and(|near| !field.amplitudes()[near].is_nan());
        *is_cut |= !neighbours(n, grid.size).all(is_known);
    }
    let body = |((label, measured), (sum, count, is_cut)): ((u8, _), &(DVec3, usize, bool))| Body {
        label,
        centroid: lattice::place(grid, *sum / (*count).max(1) as f64),
        labelled: *count as f64 * lattice::voxel_volume(grid),
        measured,
        is_cut: *is_cut,
    };
    (1..=u8::MAX).zip(measured).zip(&sums[1..]).map(body).collect()
}

/// The bodies at the level that lies half of the step between the classes next to their own surface.
fn settled(
    field: &Field,
    smoothed: &[f32],
    search: &Search,
    seed: Option<usize>,
) -> Result<(f64, Vec<Vec<u32>>), String> {
    let (mut level, classes) = two_classes(smoothed).ok_or("the echoes have no two classes; give a threshold")?;
    let inside = classes[usize::from(!search.is_dark)];
    if let Some(seed) = seed {
        let there = f64::from(smoothed[seed]);
        if (there < level) != search.is_dark {
            // A body between the two classes.
            level = (there + classes[usize::from(search.is_dark)]) / 2.0;
        }
    }
    let mut step = (level - inside).abs();
    let mut bodies = bodies_at(smoothed, field.grid(), search, seed, level)?;
    for _ in 0..MAX_STEPS {
        let Some([within, around]) = classes_at_surface(field, search, &bodies) else { break };
        let next = (within + around) / 2.0;
        step = step.min((within - around).abs());
        if (within < around) != search.is_dark || (next - level).abs() < SETTLED * step {
            break;
        }
        // A level at which nothing is left is none.
        let Ok(found) = bodies_at(smoothed, field.grid(), search, seed, next) else { break };
        (level, bodies) = (next, found);
    }
    Ok((level, bodies))
}

/// Mean amplitudes next to the surface, inside and outside of all bodies; None where one of them is not there.
fn classes_at_surface(field: &Field, search: &Search, bodies: &[Vec<u32>]) -> Option<[f64; 2]> {
    let Grid { size, spacing, .. } = *field.grid();
    let gap = 1.5 * search.smoothing + spacing.iter().copied().fold(0.0, f64::max);
    let all: Vec<u32> = bodies.concat();
    let region = Region::around(&all, field.grid(), 3.0 * gap);
    let is_body = region.mask(&all, size);
    // Means need not every voxel.
    let every = (region.voxels().div_ceil(MAX_SAMPLES) as f64).cbrt().ceil() as usize;
    let coarse = region.size.map(|count| count.div_ceil(every));
    let spacing = spacing.map(|mm| mm * every as f64);
    let numbers = (0..coarse.iter().product()).map(|n| voxel(n, coarse).map(|at| at * every));
    let (is_body, values): (Vec<bool>, Vec<f32>) = numbers
        .map(|at| {
            let there = [0, 1, 2].map(|axis| region.low[axis] + at[axis]);
            let n = (there[2] * size[1] + there[1]) * size[0] + there[0];
            (is_body[region.own(there)], field.amplitudes()[n])
        })
        .unzip();
    let inwards = distances(coarse, spacing, 2.5 * gap, |n| !is_body[n] && !values[n].is_nan());
    let outwards = distances(coarse, spacing, 2.5 * gap, |n| is_body[n]);
    let mean = |from: &[f32], [least, most]: [f64; 2]| {
        let band = from.iter().zip(&values).filter(|(d, v)| (least..=most).contains(&f64::from(**d)) && !v.is_nan());
        let (sum, count) = band.fold((0.0, 0usize), |(sum, count), (_, v)| (sum + f64::from(*v), count + 1));
        (count > 0).then(|| sum / count as f64)
    };
    let deepest = inwards.iter().copied().filter(|d| d.is_finite()).fold(0.0f32, f32::max);
    let near = gap.min(f64::from(deepest) / 2.0);
    Some([mean(&inwards, [near, 2.5 * near])?, mean(&outwards, [gap, 2.5 * gap])?])
}

/// The bodies at a level, the largest first; with a seed, the one that it is in.
fn bodies_at(
    smoothed: &[f32],
    grid: &Grid,
    search: &Search,
    seed: Option<usize>,
    level: f64,
) -> Result<Vec<Vec<u32>>, String> {
    let level = level as f32;
    let is_in = |n: usize| if search.is_dark { smoothed[n] <= level } else { smoothed[n] >= level };
    let parts = opened(grid, search.opening, is_in);
    let is_enough = |body: &Vec<u32>| body.len() as f64 * lattice::voxel_volume(grid) >= search.least;
    let mut bodies: Vec<Vec<u32>> = match seed {
        None => parts.into_iter().filter(is_enough).collect(),
        Some(seed) => parts.into_iter().filter(|body| body.contains(&(seed as u32))).collect(),
    };
    bodies.sort_by_key(|body| std::cmp::Reverse(body.len()));
    match seed {
        _ if !bodies.is_empty() => Ok(bodies),
        None => Err("no body is that large at this threshold".into()),
        Some(_) => Err("the seed lies in no body".into()),
    }
}

/// The connected parts of a set after a morphological opening by a ball: what is left if every neck that the ball does not pass is cut. The
/// rest of the set, up to the radius of the ball from a part, belongs to the part.
fn opened(grid: &Grid, radius: f64, is_in: impl Fn(usize) -> bool + Sync) -> Vec<Vec<u32>> {
    let Grid { size, spacing, .. } = *grid;
    let count: usize = size.iter().product();
    if radius <= 0.0 {
        return connected(size, (0..count).map(&is_in).collect());
    }
    // The surface lies between the centres of voxels.
    let reach = radius + spacing.iter().copied().fold(0.0, f64::max);
    let depths = distances(size, spacing, reach, |n| !is_in(n));
    let cores = connected(size, (0..count).map(|n| is_in(n) && f64::from(depths[n]) > radius).collect());
    drop(depths);
    let dilated = |core: &Vec<u32>| {
        let region = Region::around(core, grid, reach);
        let is_core = region.mask(core, size);
        let away = distances(region.size, spacing, reach, |n| is_core[n]);
        let all = region.indices(size).zip(away);
        all.filter(|(n, away)| f64::from(*away) <= radius && is_in(*n)).map(|(n, _)| n as u32).collect()
    };
    cores.iter().map(dilated).collect()
}

/// The parts of a set that are connected by faces. What is left of the set is emptied.
fn connected(size: [usize; 3], mut set: Vec<bool>) -> Vec<Vec<u32>> {
    let mut parts = Vec::new();
    for n in 0..set.len() {
        if !std::mem::take(&mut set[n]) {
            continue;
        }
        let (mut part, mut done) = (vec![n as u32], 0);
        while let Some(at) = part.get(done).copied() {
            done += 1;
            for near in neighbours(at as usize, size).flatten() {
                if std::mem::take(&mut set[near]) {
                    part.push(near as u32);
                }
            }
        }
        parts.push(part);
    }
    parts
}

/// The six neighbours of a voxel; None beyond the border.
fn neighbours(n: usize, size: [usize; 3]) -> impl Iterator<Item = Option<usize>> {
    let at = voxel(n, size);
    let steps = [1, size[0], size[0] * size[1]];
    (0..3).flat_map(move |a| [(at[a] > 0).then(|| n - steps[a]), (at[a] + 1 < size[a]).then(|| n + steps[a])])
}

/// The threshold that separates two classes best, and their means (Otsu, A threshold selection method from gray-level histograms, IEEE
/// Transactions on Systems, Man, and Cybernetics 9, 1979). None without two values.
fn two_classes(values: &[f32]) -> Option<(f64, [f64; 2])> {
    let known = || values.iter().copied().filter(|value| !value.is_nan());
    let (low, high) = known().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low >= high {
        return None;
    }
    let width = f64::from(high - low) / BINS as f64;
    let mut bins = vec![0u64; BINS];
    known().for_each(|value| bins[((f64::from(value - low) / width) as usize).min(BINS - 1)] += 1);
    let middle = |n: usize| f64::from(low) + (n as f64 + 0.5) * width;
    let total: f64 = bins.iter().map(|n| *n as f64).sum();
    let sum: f64 = bins.iter().enumerate().map(|(n, count)| *count as f64 * middle(n)).sum();
    let (mut below, mut sum_below) = (0.0, 0.0);
    let mut best: Option<(f64, f64, [f64; 2])> = None;
    for (n, count) in bins.iter().enumerate().take(BINS - 1) {
        below += *count as f64;
        sum_below += *count as f64 * middle(n);
        let classes = [sum_below / below, (sum - sum_below) / (total - below)];
        let between = below * (total - below) * (classes[1] - classes[0]).powi(2);
        if below > 0.0 && below < total && best.is_none_or(|(most, ..)| between > most) {
            best = Some((between, f64::from(low) + (n + 1) as f64 * width, classes));
        }
    }
    best.map(|(_, level, classes)| (level, classes))
}
