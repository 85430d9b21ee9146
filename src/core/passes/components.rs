//! Connected components of a volume: which of its texels belong to parts below a size. All values are integers, so that the result is exact
//! and does not depend on an order. Runs of set texels along the rows are joined by union-find (Tarjan 1975, path halving). The root of a
//! part is always its first run.

use std::ops::Range;

/// Input of the search for connected parts: a lattice of texels, how far texels may be apart to be connected, and the size of each texel.
pub struct Lattice<'a> {
    /// Columns, rows, slices.
    pub size: [usize; 3],
    /// Two set texels are connected if they are at most this many slices apart, and at most one apart along columns and along rows.
    pub slices: usize,
    /// Size of a texel, in units of the caller, by row and slice: entry `slice * rows + row`.
    pub sizes: &'a [u64],
}

/// Consecutive set texels of a row.
struct Run {
    columns: [u32; 2],
    /// `slice * rows + row`.
    row: u32,
}

/// The connected parts of a lattice, stored as runs of texels along a row.
pub struct Parts {
    columns: usize,
    runs: Vec<Run>,
    /// By run: the first run of its part.
    roots: Vec<usize>,
}

impl Lattice<'_> {
    /// For each texel, the column fastest: true if it belongs to a part whose size is below `least`. Parts consist of the texels for which `is_set`
    /// holds; it gets the index of a texel in the same order.
    pub fn floating(&self, is_set: impl Fn(usize) -> bool, least: u64) -> Vec<bool> {
        let [columns, rows, slices] = self.size;
        let parts = self.parts(is_set);
        let mut sizes = vec![0u64; parts.runs.len()];
        for (run, root) in parts.runs.iter().zip(&parts.roots) {
            let [start, end] = run.columns;
            sizes[*root] =
                sizes[*root].saturating_add(self.sizes[run.row as usize].saturating_mul(u64::from(end - start)));
        }
        let mut floats = vec![false; columns * rows * slices];
        for (run, root) in parts.runs.iter().zip(&parts.roots) {
            if sizes[*root] < least {
                floats[run.texels(columns)].fill(true);
            }
        }
        floats
    }

    /// Finds the connected parts of the texels for which `is_set` holds; it gets the index of a texel, the column fastest, then the row.
    pub fn parts(&self, is_set: impl Fn(usize) -> bool) -> Parts {
        let [columns, rows, slices] = self.size;
        let mut runs: Vec<Run> = Vec::new();
        // The runs of each row, by slice and row.
        let mut of_row: Vec<Range<usize>> = Vec::with_capacity(rows * slices);
        let mut parents: Vec<usize> = Vec::new();
        for (slice, row) in (0..slices).flat_map(|slice| (0..rows).map(move |row| (slice, row))) {
            let first = runs.len();
            let begin = (slice * rows + row) * columns;
            let of_this = stretches(columns, |column| is_set(begin + column));
            runs.extend(
                of_this
                    .map(|run| Run { columns: [run.start as u32, run.end as u32], row: (slice * rows + row) as u32 }),
            );
            parents.extend(first..runs.len());
            of_row.push(first..runs.len());
            for near in slice.saturating_sub(self.slices)..=slice {
                let last = if near == slice { row } else { (row + 2).min(rows) };
                for other in row.saturating_sub(1)..last {
                    join(&runs, &mut parents, of_row[near * rows + other].clone(), first..runs.len());
                }
            }
        }
        let roots = (0..runs.len()).map(|run| root(&mut parents, run)).collect();
        Parts { columns, runs, roots }
    }
}

impl Parts {
    /// For each texel of the lattice, the column fastest: the number of its part, from 1 in the order of the first texels of parts; 0 for a texel of
    /// no part. `texels`: the number of texels of the lattice.
    pub fn numbers(&self, texels: usize) -> Vec<u32> {
        let mut numbers = vec![0; texels];
        let (mut of_root, mut count) = (vec![0; self.runs.len()], 0);
        for (run, root) in self.runs.iter().zip(&self.roots) {
            // The root is the first run of its part.
            if of_root[*root] == 0 {
                count += 1;
                of_root[*root] = count;
            }
            numbers[run.texels(self.columns)].fill(of_root[*root]);
        }
        numbers
    }
}

impl Run {
    fn texels(&self, columns: usize) -> Range<usize> {
        let [start, end] = self.columns.map(|column| self.row as usize * columns + column as usize);
        start..end
    }
}

/// The stretches of consecutive numbers below `count` for which `is_set` holds.
pub(super) fn stretches(count: usize, is_set: impl Fn(usize) -> bool) -> impl Iterator<Item = Range<usize>> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let start = (next..count).find(|n| is_set(*n))?;
        next = (start..count).find(|n| !is_set(*n)).unwrap_or(count);
        Some(start..next)
    })
}

/// Joins the runs of two rows that touch, also diagonally. Both are sorted.
fn join(runs: &[Run], parents: &mut [usize], above: Range<usize>, below: Range<usize>) {
    let (mut a, mut b) = (above.start, below.start);
    while a < above.end && b < below.end {
        let (upper, lower) = (runs[a].columns, runs[b].columns);
        if upper[0] <= lower[1] && lower[0] <= upper[1] {
            let (one, other) = (root(parents, a), root(parents, b));
            parents[one.max(other)] = one.min(other);
        }
        if upper[1] < lower[1] { a += 1 } else { b += 1 }
    }
}

/// The first run of a part. What is passed on the way is brought nearer to it.
fn root(parents: &mut [usize], mut n: usize) -> usize {
    while parents[n] != n {
        parents[n] = parents[parents[n]];
        n = parents[n];
    }
    n
}
