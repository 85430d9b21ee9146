//! Unveiling: where rendering starts in each column of the volume, so that what lies in front of the fluid before a face is not drawn. The CPU finds the
//! surface when a volume is complete, and [`cut`](super::cut) removes what is in front of it.
//!
//! Cells of about a millimetre are divided into fluid and tissue by Otsu's threshold (Otsu 1979). Of the connected parts of the fluid the pocket is
//! the one that most columns in view meet first in front of tissue. Its near face begins where a column enters it. Faces of neighbouring columns
//! belong together unless one lies far behind the other; the largest of these patches is the near face, and where it has holes, such as where the
//! fetus touches the wall, a membrane spans them. The surface is smoothed by a Gaussian in mm and moved by an offset.
//!
//! Everything is integers, so that the same volume gives the same surface on every machine, with any number of threads.

mod lines;
mod reference;

pub use lines::{StartLine, lines};
pub use reference::reference;

use super::components::{Lattice, stretches};
use super::pass::*;
use crate::scene::Scene;
use crate::scene::unveil::FluidLattice;
use rayon::prelude::*;
use std::fmt;
use std::ops::Range;

/// Levels of a cell's mean: 1 is so many.
const LEVELS: u32 = 1024;
/// Levels that share a bin of the histogram.
const BIN: usize = 8;
/// A cell with less than half of its texels in the sector.
const OUTSIDE: u16 = u16::MAX;
/// Cells of a pocket along a column, at least.
const THICKNESS: usize = 2;
/// Heights are in so many parts of a cell.
const PARTS: i64 = 256;
/// Steps of the membrane that spans holes.
const RELAXATIONS: usize = 200;
/// Passes of the kernel 1 2 1 from which on means of more neighbours come first: as many as that are not noticed.
const FEW_PASSES: u32 = 64;
/// Least difference of tissue and pocket, levels.
const LEAST_CONTRAST: u32 = LEVELS / 8;
/// Least share of the columns in view that have a near face, per cent.
const LEAST_SHARE: u32 = 40;

/// The start surface, at which rendering starts in each column of the volume, as the search for the pocket of fluid in front of a face found it.
#[derive(Clone, Debug, PartialEq)]
pub struct Unveiled {
    pub outcome: Outcome,
    /// Row at which rendering starts, which may be fractional, for each column and slice of the volume, the column fastest. It follows from the near
    /// face of the pocket of fluid. All 0 if the pocket was not recognised, or if nothing lies in front of it.
    pub rows: Vec<f32>,
}

/// Whether the search recognised the pocket of fluid in front of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The pocket was recognised: rendering starts at its near face.
    Found(Evidence),
    /// No fluid lies in front of tissue.
    NoPocket,
    /// The pocket is less than an eighth of the grey range darker than the tissue around it, so that it is not used.
    NoContrast(Evidence),
    /// Too few of the columns in view meet the pocket ([`Evidence::share`] is below 40), so that it is not used.
    TooSmall(Evidence),
}

/// What was measured on the pocket. Grey levels are whole numbers, 0..=1023 for sample values of 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// Mean grey level of the tissue in front of the pocket or behind it, whichever is darker; `pocket` is that of the pocket.
    pub tissue: u32,
    pub pocket: u32,
    /// Share of the columns in view, of all slices together, in which the pocket's near face was found or which begin inside the pocket, per cent.
    pub share: u32,
}

impl Outcome {
    /// True if the pocket was recognised, so that rendering starts at its near face.
    pub fn is_found(&self) -> bool {
        matches!(self, Outcome::Found(_))
    }
}

/// One line, for people.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let level = |levels: u32| f64::from(levels) / f64::from(LEVELS);
        let echoes =
            |e: &Evidence| format!("echoes of {:.2} in it and {:.2} around it", level(e.pocket), level(e.tissue));
        match self {
            Outcome::Found(e) => {
                let (echoes, share) = (echoes(e), e.share);
                write!(f, "rendering starts at the fluid: {echoes}, found in {share} % of the view")
            }
            Outcome::NoPocket => write!(f, "no fluid is found in front of tissue, so the start line stays"),
            Outcome::NoContrast(e) => {
                write!(f, "the fluid cannot be told from tissue ({}), so the start line stays", echoes(e))
            }
            Outcome::TooSmall(e) => write!(
                f,
                "fluid is found in {} % of the view only (at least {LEAST_SHARE}), so the start line stays",
                e.share
            ),
        }
    }
}

pub(super) const SEARCH: Search = Search {
    name: "unveil",
    within: Slot::Volume,
    find: |scene, bytes| {
        let unveiled = find(scene, bytes);
        Found { texels: bytemuck::cast_slice(&unveiled.rows).to_vec(), unveiled: Some(unveiled) }
    },
    reference: |scene, volume| reference(scene, volume).0,
};

/// Searches a volume for the pocket of fluid. `bytes`: all texels of the volume, not only the visible ones, in the format of [`Slot::Volume`].
pub fn find(scene: &Scene, bytes: &[u8]) -> Unveiled {
    let lattice = scene.fluid_lattice();
    let cells = smoothed_cells(&lattice, cells(scene, &lattice, bytes));
    let in_view = scene.columns_in_view(&lattice);
    let (heights, outcome) = match near_face(&lattice, &cells, &in_view) {
        Ok((heights, evidence)) => (heights, Outcome::Found(evidence)),
        Err(outcome) => (Vec::new(), outcome),
    };
    let rows = if heights.iter().any(Option::is_some) {
        let heights = smoothed(&lattice, spanned(&lattice, &heights), scene.settings.unveil.smoothing);
        start_rows(scene, &lattice, &heights)
    } else {
        // The pocket was not recognised, or nothing lies in front of it.
        vec![0.0; scene.grid.size[0] as usize * lattice.size[2]]
    };
    Unveiled { outcome, rows }
}

/// The mean of each cell's texels within the sector, in levels; [`OUTSIDE`] where less than half of them are.
fn cells(scene: &Scene, lattice: &FluidLattice, bytes: &[u8]) -> Vec<u16> {
    let format = Slot::Volume.format(scene);
    let [width, height, _] = scene.volume_size().map(|n| n as usize);
    let mask = scene.sector_mask();
    let ([wide, tall], [columns, rows, slices]) = (lattice.cell, lattice.size);
    let has_empty = scene.probe().is_none();
    let of_slice = |slice: usize| {
        let texels = width * height * format.texel_bytes();
        let bytes = bytes.get(slice * texels..(slice + 1) * texels).unwrap_or(&[]);
        let values = Texels::decode([width, height, 1], format, bytes).values;
        // In voxels, what is black down to the first echo of a column or from its last one on lies beside a sector; between them it is fluid.
        let mut echoes = vec![(0, if has_empty { 0 } else { height }); width];
        for (x, echoes) in echoes.iter_mut().enumerate().filter(|_| has_empty) {
            let has_echo = |y: &usize| values.get(y * width + x).is_some_and(|value| *value != 0.0);
            if let Some(first) = (0..height).find(has_echo) {
                *echoes = (first, (first..height).rfind(has_echo).unwrap_or(first) + 1);
            }
        }
        let mut sums = vec![(0u32, 0u32, 0u32); columns * rows];
        for (y, row) in values.chunks_exact(width).enumerate() {
            for (x, value) in row.iter().enumerate() {
                let sum = &mut sums[y / tall * columns + x / wide];
                sum.2 += 1;
                if mask[y * width + x] && (echoes[x].0..echoes[x].1).contains(&y) {
                    sum.0 += level_of(*value);
                    sum.1 += 1;
                }
            }
        }
        sums.into_iter().map(|(sum, inside, all)| if 2 * inside < all { OUTSIDE } else { (sum / inside) as u16 })
    };
    (0..slices).into_par_iter().flat_map_iter(of_slice).collect()
}

/// A sample in levels.
fn level_of(value: f64) -> u32 {
    (value * f64::from(LEVELS)).clamp(0.0, f64::from(LEVELS - 1)) as u32
}

/// The cells after the kernel 1 2 1 along columns and rows, as often as the lattice says. A neighbour outside the sector counts as the cell itself.
fn smoothed_cells(lattice: &FluidLattice, mut cells: Vec<u16>) -> Vec<u16> {
    let [columns, rows, slices] = lattice.size;
    for axis in (0..lattice.smoothing).flat_map(|_| [0, 1]) {
        let before = cells.clone();
        let (step, count) = if axis == 0 { (1, columns) } else { (columns, rows) };
        for n in (0..columns * rows * slices).filter(|n| before[*n] != OUTSIDE) {
            let at = if axis == 0 { n % columns } else { n / columns % rows };
            let here = u32::from(before[n]);
            let or_here = |cell: u16| if cell == OUTSIDE { here } else { u32::from(cell) };
            let low = if at > 0 { or_here(before[n - step]) } else { here };
            let high = if at + 1 < count { or_here(before[n + step]) } else { here };
            cells[n] = ((low + 2 * here + high) / 4) as u16;
        }
    }
    cells
}

/// The level below which a cell is fluid: the first of the brighter class. None if all are alike. Of equal thresholds it is the lowest.
fn threshold(cells: &[u16]) -> Option<u16> {
    let mut bins = [0u128; LEVELS as usize / BIN];
    cells.iter().filter(|cell| **cell != OUTSIDE).for_each(|cell| bins[usize::from(*cell) / BIN] += 1);
    let all: u128 = bins.iter().sum();
    let total: u128 = (0..).zip(&bins).map(|(bin, count)| bin * count).sum();
    let (mut below, mut below_total, mut best) = (0, 0, (0, None));
    for (bin, count) in (0..).zip(&bins) {
        (below, below_total) = (below + count, below_total + bin * count);
        let above = all - below;
        if below == 0 || above == 0 {
            continue;
        }
        // The variance between the classes, times the square of the number of cells.
        let apart = (below_total * all).abs_diff(total * below);
        let between = apart * apart / (below * above);
        if between > best.0 {
            best = (between, Some((bin as usize + 1) * BIN));
        }
    }
    best.1.map(|level| level as u16)
}

/// A run of fluid in a column.
struct Entry {
    part: u32,
    /// Its rows.
    first: usize,
    end: usize,
    /// Tissue lies behind it.
    is_covering: bool,
}

/// The near face of the pocket, by column of cells, then slice: its height in parts of a row; none in a hole, and where the column begins in the
/// pocket.
type Heights = Vec<Option<i64>>;

fn near_face(lattice: &FluidLattice, cells: &[u16], in_view: &[bool]) -> Result<(Heights, Evidence), Outcome> {
    let [columns, rows, slices] = lattice.size;
    let level = threshold(cells).ok_or(Outcome::NoPocket)?;
    // An outside cell is brighter than every level.
    let parts = Lattice { size: lattice.size, slices: 1, sizes: &[] }.parts(|n| cells[n] < level);
    let parts = parts.numbers(cells.len());
    let of_column = |n: usize| -> Vec<Entry> {
        let at = |row: usize| (n / columns * rows + row) * columns + n % columns;
        let runs = stretches(rows, |row| parts[at(row)] != 0).filter(|run| run.len() >= THICKNESS);
        let entry = |Range { start: first, end }: Range<usize>| {
            let is_covering = end < rows && cells[at(end)] != OUTSIDE;
            Entry { part: parts[at(first)], first, end, is_covering }
        };
        runs.map(entry).collect()
    };
    let entries: Vec<Vec<Entry>> = (0..columns * slices).into_par_iter().map(of_column).collect();
    let mut votes = vec![0u32; parts.iter().copied().max().unwrap_or(0) as usize + 1];
    for (column, _) in entries.iter().zip(in_view).filter(|(_, in_view)| **in_view) {
        if let Some(entry) = column.iter().find(|entry| entry.is_covering) {
            votes[entry.part as usize] += 1;
        }
    }
    let pocket = (1..votes.len()).rev().max_by_key(|part| votes[*part]).filter(|part| votes[*part] > 0);
    let pocket = pocket.ok_or(Outcome::NoPocket)? as u32;
    let height = |(n, column): (usize, &Vec<Entry>)| {
        let entry = column.iter().find(|entry| entry.part == pocket)?;
        let at = |row: usize| cells[(n / columns * rows + row) * columns + n % columns];
        let above = entry.first.checked_sub(1).map(at).filter(|cell| *cell != OUTSIDE)?;
        // Where the level is crossed, linear between the two cells.
        let (above, below, level) = (i64::from(above), i64::from(at(entry.first)), i64::from(level));
        Some(PARTS * (entry.first as i64 - 1) + PARTS * (above - level) / (above - below))
    };
    let heights: Heights = entries.iter().enumerate().map(height).collect();
    let heights = largest_patch(lattice, &heights, in_view);
    let evidence = evidence(lattice, cells, &heights, &entries, pocket, in_view);
    match evidence {
        e if e.tissue < e.pocket + LEAST_CONTRAST => Err(Outcome::NoContrast(e)),
        e if e.share < LEAST_SHARE => Err(Outcome::TooSmall(e)),
        e => Ok((heights, e)),
    }
}

/// The heights of the patch with the most columns in view, the first of equal ones. Two neighbours belong to one patch unless the face between them would be
/// steeper than 45 degrees, with a cell to spare.
fn largest_patch(lattice: &FluidLattice, heights: &Heights, in_view: &[bool]) -> Heights {
    let [columns, _, slices] = lattice.size;
    let steepest = |axis: usize| PARTS + (PARTS as f64 * lattice.pitch[axis] / lattice.pitch[1]).round() as i64;
    let (across, along) = (steepest(0), steepest(2));
    let mut patches = vec![0usize; heights.len()];
    let mut counts = vec![0u32];
    for start in 0..heights.len() {
        if heights[start].is_none() || patches[start] != 0 {
            continue;
        }
        let patch = counts.len();
        counts.push(0);
        let mut waiting = vec![start];
        patches[start] = patch;
        while let Some(n) = waiting.pop() {
            counts[patch] += u32::from(in_view[n]);
            let (x, z) = (n % columns, n / columns);
            let neighbours = [
                (x > 0).then(|| (n - 1, across)),
                (x + 1 < columns).then(|| (n + 1, across)),
                (z > 0).then(|| (n - columns, along)),
                (z + 1 < slices).then(|| (n + columns, along)),
            ];
            for (other, steepest) in neighbours.into_iter().flatten() {
                let is_near = heights[n].zip(heights[other]).is_some_and(|(a, b)| (a - b).abs() <= steepest);
                if is_near && patches[other] == 0 {
                    patches[other] = patch;
                    waiting.push(other);
                }
            }
        }
    }
    let largest = (1..counts.len()).rev().max_by_key(|patch| counts[*patch]).unwrap_or(0);
    heights.iter().zip(&patches).map(|(height, patch)| height.filter(|_| *patch == largest)).collect()
}

/// How sure the near face is, from its columns in view.
fn evidence(
    lattice: &FluidLattice,
    cells: &[u16],
    heights: &Heights,
    entries: &[Vec<Entry>],
    pocket: u32,
    in_view: &[bool],
) -> Evidence {
    let [columns, rows, _] = lattice.size;
    // Sum and number of: tissue in front, the pocket, and tissue behind it.
    let mut sums = [(0u64, 0u64); 3];
    let (mut found, mut all) = (0u64, 0u64);
    for (n, column) in entries.iter().enumerate().filter(|(n, _)| in_view[*n]) {
        all += 1;
        let Some(entry) = column.iter().find(|entry| entry.part == pocket) else { continue };
        let above = entry.first.checked_sub(1).map(|row| cells[(n / columns * rows + row) * columns + n % columns]);
        let is_open = above.is_none_or(|cell| cell == OUTSIDE);
        if heights[n].is_none() && !is_open {
            continue;
        }
        found += 1;
        let mut add = |of: usize, row: Option<usize>| {
            let cell =
                row.filter(|row| *row < rows).map(|row| cells[(n / columns * rows + row) * columns + n % columns]);
            if let Some(cell) = cell.filter(|cell| *cell != OUTSIDE) {
                sums[of] = (sums[of].0 + u64::from(cell), sums[of].1 + 1);
            }
        };
        add(0, entry.first.checked_sub(THICKNESS));
        add(1, Some((entry.first + entry.end) / 2));
        add(2, Some(entry.end + THICKNESS - 1).filter(|_| entry.is_covering));
    }
    let mean = |(sum, count): (u64, u64)| sum.checked_div(count).map(|mean| mean as u32);
    let [front, inside, behind] = sums.map(mean);
    let tissue = [front, behind].into_iter().flatten().min().unwrap_or(0);
    Evidence { tissue, pocket: inside.unwrap_or(0), share: (100 * found).checked_div(all).unwrap_or(0) as u32 }
}

/// The heights with a membrane over their holes.
fn spanned(lattice: &FluidLattice, heights: &Heights) -> Vec<i64> {
    let [columns, _, slices] = lattice.size;
    let neighbours = |n: usize| {
        let (x, z) = (n % columns, n / columns);
        [
            if x > 0 { n - 1 } else { n },
            if x + 1 < columns { n + 1 } else { n },
            if z > 0 { n - columns } else { n },
            if z + 1 < slices { n + columns } else { n },
        ]
    };
    // First the holes fill from their borders, ring by ring.
    let mut filled = heights.clone();
    while filled.iter().any(Option::is_none) && filled.iter().any(Option::is_some) {
        let before = filled.clone();
        for n in (0..before.len()).filter(|n| before[*n].is_none()) {
            let known: Vec<i64> = neighbours(n).into_iter().filter_map(|other| before[other]).collect();
            filled[n] = (!known.is_empty()).then(|| known.iter().sum::<i64>().div_euclid(known.len() as i64));
        }
    }
    let mut spanned: Vec<i64> = filled.into_iter().map(|height| height.unwrap_or(0)).collect();
    let holes: Vec<usize> = (0..heights.len()).filter(|n| heights[*n].is_none()).collect();
    for _ in 0..RELAXATIONS {
        let before = spanned.clone();
        for n in &holes {
            let sum: i64 = neighbours(*n).into_iter().map(|other| before[other]).sum();
            spanned[*n] = (sum + 2).div_euclid(4);
        }
    }
    spanned
}

/// How a Gaussian is approximated along an axis of the lattice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Kernels {
    /// Three means of a cell and so many on each side, whose variance is `half (half + 1) / 3` cells; 0 for none.
    half: [usize; 3],
    /// And then so many passes of the kernel 1 2 1, whose variance is half a cell.
    passes: u32,
}

impl Kernels {
    /// Of a deviation in cells.
    fn of(deviation: f64) -> Kernels {
        let passes = (2.0 * deviation * deviation).round() as u32;
        if passes <= FEW_PASSES {
            return Kernels { half: [0; 3], passes };
        }
        // In sixths of a cell, of which a pass has three.
        let mut left = 3 * u64::from(passes);
        let half = [3, 2, 1].map(|boxes| {
            let share = left / boxes;
            // The largest with 2 half (half + 1) <= share.
            let half = (((1 + 2 * share) as f64).sqrt() as u64).saturating_sub(1) / 2;
            left -= 2 * half * (half + 1);
            half as usize
        });
        Kernels { half, passes: (left / 3) as u32 }
    }
}

/// The heights after a Gaussian of this deviation, mm. Windows are symmetric and end at the border, so the ends stay: a slope is not
/// flattened towards them.
fn smoothed(lattice: &FluidLattice, mut heights: Vec<i64>, deviation: f64) -> Vec<i64> {
    let [columns, _, slices] = lattice.size;
    for (axis, step, count) in [(0, 1, columns), (2, columns, slices)] {
        let kernels = Kernels::of(deviation / lattice.pitch[axis]);
        let mut line = vec![0; count];
        let mut sums = vec![0; count + 1];
        for first in (0..heights.len()).filter(|n| n / step % count == 0) {
            (0..count).for_each(|n| line[n] = heights[first + n * step]);
            for most in kernels.half.into_iter().filter(|half| *half > 0) {
                (0..count).for_each(|n| sums[n + 1] = sums[n] + line[n]);
                for (n, out) in line.iter_mut().enumerate() {
                    let half = most.min(n).min(count - 1 - n);
                    let cells = 2 * half as i64 + 1;
                    *out = (sums[n + half + 1] - sums[n - half] + half as i64).div_euclid(cells);
                }
            }
            for _ in 0..kernels.passes {
                let mut before = line[0];
                for n in 1..count.saturating_sub(1) {
                    let here = line[n];
                    line[n] = (before + 2 * here + line[n + 1] + 2).div_euclid(4);
                    before = here;
                }
            }
            (0..count).for_each(|n| heights[first + n * step] = line[n]);
        }
    }
    heights
}

/// By column and slice of the volume: the row at which rendering starts, between the columns of cells linear.
fn start_rows(scene: &Scene, lattice: &FluidLattice, heights: &[i64]) -> Vec<f32> {
    let [wide, tall] = lattice.cell.map(|n| n as i64);
    let [columns, _, slices] = lattice.size;
    let offset = (scene.settings.unveil.offset / scene.grid.pitch[1] * PARTS as f64).round() as i64;
    // The middle of a cell, in parts of a texel.
    let row = |height: i64| height * tall + (tall - 1) * PARTS / 2 + offset;
    let width = i64::from(scene.grid.size[0]);
    let of = |slice: usize, x: i64| {
        // In half texels from the middle of the first column of cells.
        let at = 2 * x - (wide - 1);
        let (low, share) = (at.div_euclid(2 * wide), at.rem_euclid(2 * wide));
        let height = |column: i64| row(heights[slice * columns + column.clamp(0, columns as i64 - 1) as usize]);
        let between = (height(low) * (2 * wide - share) + height(low + 1) * share).div_euclid(2 * wide);
        between as f32 / PARTS as f32
    };
    (0..slices).flat_map(|slice| (0..width).map(move |x| (slice, x))).map(|(slice, x)| of(slice, x)).collect()
}

#[cfg(test)]
mod tests {
    use super::Kernels;

    /// Prevents smoothing that takes thousands of passes, and one that is narrower along the axis with the finer cells.
    #[test]
    fn the_variance_is_that_of_the_gaussian_and_takes_few_passes() {
        let mut deviation = 0.1;
        while deviation < 500.0 {
            let Kernels { half, passes } = Kernels::of(deviation);
            let variance = half.map(|h| (h * (h + 1)) as f64 / 3.0).iter().sum::<f64>() + f64::from(passes) / 2.0;
            // Passes and sixths are rounded.
            assert!((variance - deviation * deviation).abs() <= 0.6, "{deviation}: {variance} by {half:?}, {passes}");
            assert!(f64::from(passes) <= 64.0f64.max(2.0 * deviation), "{deviation}: {passes} passes");
            assert!(half[0].abs_diff(half[2]) <= 1, "{half:?}");
            deviation *= 1.01;
        }
    }
}
