//! The reference of [`find`](super::find): where rendering starts, computed cell by cell from the definition, without runs, threads or
//! 16-bit cells. All values are integers, and equal to those of [`find`](super::find).

use super::{Evidence, Kernels, LEAST_CONTRAST, LEAST_SHARE, Outcome, PARTS, RELAXATIONS, THICKNESS, level_of};
use crate::passes::pass::*;
use crate::scene::Scene;
use crate::scene::unveil::FluidLattice;

/// Levels by cell, none outside the sector.
type Cells = Vec<Option<i64>>;

/// The search of [`find`](super::find) by another method: the row at which rendering starts (x is the column, y the slice), and whether the pocket
/// was recognised.
pub fn reference(scene: &Scene, volume: &Texels) -> (Texels, Outcome) {
    let lattice = scene.fluid_lattice();
    let [width, _, slices] = volume.size;
    let cells = seen(&lattice, means(scene, &lattice, volume));
    let none = Texels::from_fn([width, slices, 1], 1, |_, _| 0.0);
    let (heights, evidence) = match near_face(scene, &lattice, &cells) {
        None => return (none, Outcome::NoPocket),
        Some(found) => found,
    };
    if evidence.tissue < evidence.pocket + LEAST_CONTRAST {
        return (none, Outcome::NoContrast(evidence));
    }
    if evidence.share < LEAST_SHARE {
        return (none, Outcome::TooSmall(evidence));
    }
    if heights.iter().all(Option::is_none) {
        return (none, Outcome::Found(evidence));
    }
    let heights = smooth(&lattice, span(&lattice, &heights), scene.settings.unveil.smoothing);
    let [wide, tall] = lattice.cell.map(|n| n as i64);
    let offset = (scene.settings.unveil.offset / scene.grid.pitch[1] * PARTS as f64).round() as i64;
    let start = |[x, slice, _]: [usize; 3], _: usize| {
        let at = 2 * x as i64 - (wide - 1);
        let low = at.div_euclid(2 * wide);
        let share = at - low * 2 * wide;
        let of = |column: i64| {
            let column = column.clamp(0, lattice.size[0] as i64 - 1) as usize;
            heights[column + lattice.size[0] * slice] * tall + (tall - 1) * PARTS / 2 + offset
        };
        (of(low) * (2 * wide - share) + of(low + 1) * share).div_euclid(2 * wide) as f64 / PARTS as f64
    };
    (Texels::from_fn([width, slices, 1], 1, start), Outcome::Found(evidence))
}

fn index(lattice: &FluidLattice, [x, y, z]: [usize; 3]) -> usize {
    (z * lattice.size[1] + y) * lattice.size[0] + x
}

fn each(lattice: &FluidLattice) -> impl Iterator<Item = [usize; 3]> + use<> {
    let [columns, rows, slices] = lattice.size;
    (0..slices).flat_map(move |z| (0..rows).flat_map(move |y| (0..columns).map(move |x| [x, y, z])))
}

fn means(scene: &Scene, lattice: &FluidLattice, volume: &Texels) -> Cells {
    let mask = scene.sector_mask();
    let [width, height, _] = volume.size;
    let mean = |[x, y, z]: [usize; 3]| {
        let texels: Vec<[usize; 2]> = (y * lattice.cell[1]..((y + 1) * lattice.cell[1]).min(height))
            .flat_map(|row| {
                (x * lattice.cell[0]..((x + 1) * lattice.cell[0]).min(width)).map(move |column| [column, row])
            })
            .collect();
        // Voxels without an echo before them in their column, or without one behind them, lie beside a sector.
        let has_echo =
            |column: usize, mut rows: std::ops::Range<usize>| rows.any(|row| volume.one(column, row, z) != 0.0);
        let is_inside = |column: usize, row: usize| {
            scene.probe().is_some() || has_echo(column, 0..row + 1) && has_echo(column, row..height)
        };
        let values = texels.iter().filter(|[column, row]| mask[row * width + column] && is_inside(*column, *row));
        let levels: Vec<i64> = values.map(|[column, row]| i64::from(level_of(volume.one(*column, *row, z)))).collect();
        (2 * levels.len() >= texels.len()).then(|| levels.iter().sum::<i64>() / levels.len() as i64)
    };
    each(lattice).map(mean).collect()
}

/// The cells, smoothed along columns, then along rows, as often as the lattice says.
fn seen(lattice: &FluidLattice, mut cells: Cells) -> Cells {
    for axis in [0, 1].repeat(lattice.smoothing as usize) {
        let smooth = |at: [usize; 3]| {
            let here = cells[index(lattice, at)]?;
            let beside = |by: i64| {
                let mut other = at.map(|n| n as i64);
                other[axis] += by;
                let is_there = other[axis] >= 0 && other[axis] < lattice.size[axis] as i64;
                is_there.then(|| cells[index(lattice, other.map(|n| n as usize))]).flatten().unwrap_or(here)
            };
            Some((beside(-1) + 2 * here + beside(1)) / 4)
        };
        cells = each(lattice).map(smooth).collect();
    }
    cells
}

/// The level that divides all cells best: the variance between the classes is n m (a - b)^2 of n and m cells with the means a and b.
fn level(cells: &Cells) -> Option<i64> {
    let bins: Vec<i128> = cells.iter().flatten().map(|cell| i128::from(cell / 8)).collect();
    let score = |first: i128| {
        let (dark, bright): (Vec<i128>, Vec<i128>) = bins.iter().partition(|bin| **bin < first);
        let [n, m] = [dark.len(), bright.len()].map(|count| count as i128);
        let apart = dark.iter().sum::<i128>() * (n + m) - bins.iter().sum::<i128>() * n;
        (n > 0 && m > 0).then(|| apart * apart / (n * m))
    };
    let mut best = (0, None);
    for first in 1..=128 {
        if let Some(score) = score(first).filter(|score| *score > best.0) {
            best = (score, Some(8 * first as i64));
        }
    }
    best.1
}

fn near_face(scene: &Scene, lattice: &FluidLattice, cells: &Cells) -> Option<(Vec<Option<i64>>, Evidence)> {
    let level = level(cells)?;
    let in_view = scene.columns_in_view(lattice);
    let [columns, rows, slices] = lattice.size;
    let is_fluid = |at: [usize; 3]| cells[index(lattice, at)].is_some_and(|cell| cell < level);
    // Parts of fluid, filled from their first cells.
    let mut parts = vec![0usize; cells.len()];
    let mut count = 0;
    for start in each(lattice) {
        if !is_fluid(start) || parts[index(lattice, start)] != 0 {
            continue;
        }
        count += 1;
        parts[index(lattice, start)] = count;
        let mut waiting = vec![start];
        while let Some([x, y, z]) = waiting.pop() {
            let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
            for other in
                near(z, slices).flat_map(|z| near(y, rows).flat_map(move |y| near(x, columns).map(move |x| [x, y, z])))
            {
                if is_fluid(other) && parts[index(lattice, other)] == 0 {
                    parts[index(lattice, other)] = count;
                    waiting.push(other);
                }
            }
        }
    }
    // By column: the part, first and end row of each run.
    let runs = |x: usize, z: usize| {
        let part = |y: usize| parts[index(lattice, [x, y, z])];
        let begins = (0..rows).filter(|y| part(*y) != 0 && (*y == 0 || part(y - 1) == 0));
        let runs = begins.map(|first| (part(first), first, (first..rows).find(|y| part(*y) == 0).unwrap_or(rows)));
        runs.filter(|(_, first, end)| end - first >= THICKNESS).collect::<Vec<_>>()
    };
    let tissue = |x: usize, y: usize, z: usize| if y < rows { cells[index(lattice, [x, y, z])] } else { None };
    let all: Vec<[usize; 2]> = (0..slices).flat_map(|z| (0..columns).map(move |x| [x, z])).collect();
    let viewed: Vec<[usize; 2]> = all.iter().copied().filter(|[x, z]| in_view[z * columns + x]).collect();
    let first_covering = |[x, z]: &[usize; 2]| {
        runs(*x, *z).into_iter().find(|(.., end)| tissue(*x, *end, *z).is_some()).map(|run| run.0)
    };
    let votes: Vec<usize> = viewed.iter().filter_map(first_covering).collect();
    let votes_of = |part: &usize| votes.iter().filter(|vote| *vote == part).count();
    let most = votes.iter().map(votes_of).max()?;
    let pocket = votes.iter().copied().filter(|part| votes_of(part) == most).min()?;
    let entry = |[x, z]: [usize; 2]| runs(x, z).into_iter().find(|run| run.0 == pocket);
    let height = |[x, z]: [usize; 2]| {
        let (_, first, _) = entry([x, z])?;
        let here = cells[index(lattice, [x, first, z])]?;
        let above = cells[index(lattice, [x, first.checked_sub(1)?, z])]?;
        Some(PARTS * (first as i64 - 1) + PARTS * (above - level) / (above - here))
    };
    let heights: Vec<Option<i64>> = all.iter().map(|at| height(*at)).collect();
    // Patches: every column takes the lowest number among its neighbours until nothing changes.
    let steepest = [0, 2].map(|a| PARTS + (PARTS as f64 * lattice.pitch[a] / lattice.pitch[1]).round() as i64);
    let joins = |a: usize, b: usize, steepest: i64| {
        heights[a].zip(heights[b]).is_some_and(|(one, other)| (one - other).abs() <= steepest)
    };
    let mut patches: Vec<usize> = (0..heights.len()).collect();
    loop {
        let before = patches.clone();
        for n in 0..patches.len() {
            let (x, z) = (n % columns, n / columns);
            let right = (x + 1 < columns && joins(n, n + 1, steepest[0])).then_some(n + 1);
            let below = (z + 1 < slices && joins(n, n + columns, steepest[1])).then_some(n + columns);
            for other in right.into_iter().chain(below) {
                let lowest = patches[n].min(patches[other]);
                (patches[n], patches[other]) = (lowest, lowest);
            }
        }
        if before == patches {
            break;
        }
    }
    let size = |patch: usize| (0..patches.len()).filter(|n| patches[*n] == patch && in_view[*n]).count();
    let numbers: std::collections::BTreeSet<usize> =
        (0..patches.len()).filter(|n| heights[*n].is_some()).map(|n| patches[n]).collect();
    let largest = numbers.iter().copied().max_by_key(|patch| (size(*patch), usize::MAX - patch));
    let heights: Vec<Option<i64>> =
        (0..heights.len()).map(|n| heights[n].filter(|_| Some(patches[n]) == largest)).collect();
    // Evidence.
    let is_open = |[x, z]: [usize; 2]| {
        let first = entry([x, z]).map(|(_, first, _)| first);
        first.is_some_and(|first| first == 0 || cells[index(lattice, [x, first - 1, z])].is_none())
    };
    let is_found = |at: &[usize; 2]| heights[at[1] * columns + at[0]].is_some() || is_open(*at);
    let found: Vec<[usize; 2]> = viewed.iter().copied().filter(is_found).collect();
    let mean = |of: &dyn Fn([usize; 2]) -> Option<i64>| {
        let levels: Vec<i64> = found.iter().filter_map(|at| of(*at)).collect();
        (!levels.is_empty()).then(|| (levels.iter().sum::<i64>() / levels.len() as i64) as u32)
    };
    let front = mean(&|[x, z]| tissue(x, entry([x, z])?.1.checked_sub(THICKNESS)?, z));
    let inside = mean(&|[x, z]| entry([x, z]).and_then(|(_, first, end)| tissue(x, (first + end) / 2, z)));
    let behind = mean(&|[x, z]| {
        let (.., end) = entry([x, z])?;
        tissue(x, end, z)?;
        tissue(x, end + THICKNESS - 1, z)
    });
    let evidence = Evidence {
        tissue: [front, behind].into_iter().flatten().min().unwrap_or(0),
        pocket: inside.unwrap_or(0),
        share: if viewed.is_empty() { 0 } else { (100 * found.len() / viewed.len()) as u32 },
    };
    Some((heights, evidence))
}

/// The heights around a column, or its own at a border: left, right, before, behind.
fn around(lattice: &FluidLattice, n: usize) -> [usize; 4] {
    let [columns, _, slices] = lattice.size;
    let (x, z) = ((n % columns) as i64, (n / columns) as i64);
    let at =
        |x: i64, z: i64| (z.clamp(0, slices as i64 - 1) * columns as i64 + x.clamp(0, columns as i64 - 1)) as usize;
    [at(x - 1, z), at(x + 1, z), at(x, z - 1), at(x, z + 1)]
}

fn span(lattice: &FluidLattice, heights: &[Option<i64>]) -> Vec<i64> {
    let mut filled = heights.to_vec();
    while filled.contains(&None) && filled.iter().any(Option::is_some) {
        let ring = |n: usize| {
            filled[n].or_else(|| {
                let known: Vec<i64> = around(lattice, n).iter().filter_map(|other| filled[*other]).collect();
                (!known.is_empty()).then(|| known.iter().sum::<i64>().div_euclid(known.len() as i64))
            })
        };
        filled = (0..filled.len()).map(ring).collect();
    }
    let mut spanned: Vec<i64> = filled.into_iter().map(|height| height.unwrap_or(0)).collect();
    for _ in 0..RELAXATIONS {
        let relax = |n: usize| match heights[n] {
            Some(height) => height,
            None => (around(lattice, n).iter().map(|other| spanned[*other]).sum::<i64>() + 2).div_euclid(4),
        };
        spanned = (0..spanned.len()).map(relax).collect();
    }
    spanned
}

fn smooth(lattice: &FluidLattice, mut heights: Vec<i64>, deviation: f64) -> Vec<i64> {
    let [columns, _, slices] = lattice.size;
    for (axis, step, count) in [(0, 1, columns), (2, columns, slices)] {
        let kernels = Kernels::of(deviation / lattice.pitch[axis]);
        // The mean of a cell and its neighbours, those at both sides as far as there are any.
        let mean = |heights: &[i64], n: usize, half: usize| {
            let at = n / step % count;
            let half = half.min(at).min(count - 1 - at);
            let sum: i64 = (0..=2 * half).map(|k| heights[n + k * step - half * step]).sum();
            (sum + half as i64).div_euclid(2 * half as i64 + 1)
        };
        for half in kernels.half {
            heights = (0..heights.len()).map(|n| mean(&heights, n, half)).collect();
        }
        for _ in 0..kernels.passes {
            let mean = |n: usize| {
                let at = n / step % count;
                if at == 0 || at + 1 == count {
                    return heights[n];
                }
                (heights[n - step] + 2 * heights[n] + heights[n + step] + 2).div_euclid(4)
            };
            heights = (0..heights.len()).map(mean).collect();
        }
    }
    heights
}
