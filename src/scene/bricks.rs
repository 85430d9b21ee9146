//! Bricks: the box that rays cross, cut into cells of a few texels' size, so that rays can leap over cells that cannot change a
//! picture. Bricks lie in space, where rays are straight, not in the texture, where a sweep bends them; what each can see of
//! the texture, and on which side of the sector's border it lies, follows from the geometry once and for all.

use super::Scene;
use super::region::insonified_box;
use super::visible_bounds::reach;
use crate::probe::{Advance, Array, Geometry, Motion, Probe};
use glam::DVec3;

/// Edge of the tiles of a slice whose smallest and largest value are kept, texels.
pub const TILE: u32 = 4;
/// Most bricks of a scene: 8 MB of their table.
const MOST: f64 = 524_288.0;
/// Share of its edge that a brick is taken to be larger by: places and ways in f32 are off by far less.
const MARGIN: f64 = 4e-3;
/// The look-up table of the sweep is off by less than this share of a slice from so many entries on.
const FEWEST_ENTRIES: u32 = 65;
const SLICE_MARGIN: f64 = 0.01;

/// The lattice of bricks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bricks {
    /// Lower corner of brick (0, 0, 0), mm in space.
    pub low: DVec3,
    /// mm.
    pub edge: DVec3,
    pub count: [u32; 3],
}

/// Where a brick lies to the insonified region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Wholly outside: no sample is taken.
    Outside,
    /// Across its border, or not known.
    Across,
    /// Wholly inside.
    Inside,
}

impl Side {
    /// Of what two bounds say.
    fn and(self, other: Side) -> Side {
        match (self, other) {
            (Side::Outside, _) | (_, Side::Outside) => Side::Outside,
            (Side::Inside, Side::Inside) => Side::Inside,
            _ => Side::Across,
        }
    }
}

/// What the samples within a brick may look at: tile columns, tile rows and slices, first and last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    pub tiles: [[u32; 2]; 2],
    pub slices: [u32; 2],
    pub side: Side,
}

impl Bricks {
    pub fn total(&self) -> u64 {
        self.count.iter().map(|n| u64::from(*n)).product()
    }

    fn place(&self, cell: [u32; 3]) -> DVec3 {
        self.low + self.edge * DVec3::from_array(cell.map(f64::from))
    }
}

impl Scene {
    /// Whether rays leap over bricks.
    pub fn skips(&self) -> bool {
        let casts = self.composites() || self.detects_surface() || self.projects();
        let swept = self.probe().is_some_and(|p| !matches!(p.motion, Motion::Still { .. }));
        if !casts || self.settings.ray.brick == 0 || (swept && self.settings.ray.entries < FEWEST_ENTRIES) {
            return false;
        }
        // Where f32 cannot tell places within a brick's margin, as from a camera in another town.
        let bricks = self.bricks();
        let farthest = self.low.abs().max(self.high.abs()).max(self.rays.origin.abs()).max_element();
        farthest * 1e-6 < MARGIN * bricks.edge.min_element()
    }

    /// Bricks over the whole insonified region, whatever part of it is looked at.
    pub fn bricks(&self) -> Bricks {
        let (low, high) = insonified_box(&self.geometry);
        let size = f64::from(self.settings.ray.brick.max(TILE));
        let [x, y] = self.grid.pitch;
        let (pitch, first) = match &self.geometry {
            // From half a texel on, so that a brick's samples lie between as many texels as it has and one more.
            Geometry::Cartesian(grid) => (DVec3::from(grid.spacing), DVec3::from(grid.spacing) * (1.0 - size)),
            Geometry::Sweep(_) => (DVec3::splat(x.min(y)), DVec3::ZERO),
        };
        let (low, mut edge) = (low + first, pitch * size);
        let count = |edge: DVec3| ((high - low) / edge).ceil().max(DVec3::ONE);
        while count(edge).x * count(edge).y * count(edge).z > MOST {
            // Along the axis that has most.
            let n = count(edge);
            let axis = (0..3).max_by(|a, b| n[*a].total_cmp(&n[*b])).unwrap_or(0);
            edge[axis] *= 2.0;
        }
        Bricks { low, edge, count: count(edge).to_array().map(|n| n as u32) }
    }

    /// Tiles of the volume's slices along each axis, and slices.
    pub fn tile_counts(&self) -> [u32; 3] {
        let [width, height, slices] = self.volume_size();
        [width.div_ceil(TILE), height.div_ceil(TILE), slices]
    }

    /// What the samples within one brick of a lattice may look at.
    pub fn reach(&self, bricks: &Bricks, cell: [u32; 3]) -> Reach {
        let margin = bricks.edge * MARGIN;
        let (low, high) = (bricks.place(cell) - margin, bricks.place(cell) + bricks.edge + margin);
        let mut seen = Extent::of(self, low, high);
        let taps = self.tap_reach();
        if taps > 0.0 {
            // A sample has a side by its own place, its value by its taps.
            seen.texels = Extent::of(self, low - taps, high + taps).texels;
        }
        let [columns, rows, slices] = std::array::from_fn(|axis| {
            let last = f64::from(self.volume_size()[axis] - 1);
            let [from, to] = seen.texels[axis];
            [from.floor().clamp(0.0, last) as u32, to.ceil().clamp(0.0, last) as u32]
        });
        Reach { tiles: [columns, rows].map(|r| r.map(|n| n / TILE)), slices, side: seen.side }
    }

    /// How far from a sample's place the filter that slides along the ray looks, mm: so many steps along the ray, and as far to
    /// both sides.
    fn tap_reach(&self) -> f64 {
        reach(self, self.settings.ray.sliding / 2) * 3f64.sqrt()
    }

    /// All that bricks and what they look at follow from, beside the geometry: equal numbers make equal tables.
    pub fn brick_basis(&self) -> impl PartialEq + use<> {
        (self.bricks(), self.grid, self.tap_reach())
    }
}

/// A box in space in texture indices, and where it lies to the sector. Bounds, not the least ones.
struct Extent {
    texels: [[f64; 2]; 3],
    side: Side,
}

impl Extent {
    fn of(scene: &Scene, low: DVec3, high: DVec3) -> Extent {
        let grid = &scene.grid;
        let columns = [low.x, high.x].map(|x| (x - grid.origin[0]) / grid.pitch[0]);
        let rows = |y: [f64; 2]| y.map(|y| (y - grid.origin[1]) / grid.pitch[1]);
        match &scene.geometry {
            Geometry::Cartesian(volume) => {
                let slices = [low.z, high.z].map(|z| (z - volume.origin[2]) / volume.spacing[2]);
                // Beyond the border the nearest texel goes on.
                Extent { texels: [columns, rows([low.y, high.y]), slices], side: Side::Inside }
            }
            Geometry::Sweep(probe) => {
                let (depths, positions) = unswept(probe, low, high);
                let sector_side = in_plane(probe, [low.x, high.x], depths);
                let (slices, sweep_side) = sliced(probe, positions);
                Extent { texels: [columns, rows(depths), slices], side: sector_side.and(sweep_side) }
            }
        }
    }
}

/// In-plane depths and slice positions of a box; no positions where the box holds or lies behind the axis.
fn unswept(probe: &Probe, low: DVec3, high: DVec3) -> ([f64; 2], Option<[f64; 2]>) {
    match probe.motion {
        Motion::Translated | Motion::Still { .. } => ([low.y, high.y], Some([low.z, high.z])),
        Motion::Fan { .. } => {
            let axis = probe.axis_depth();
            let (near, far) = ([low.y - axis, high.y - axis], [low.z, high.z]);
            let [shortest, longest] = distances(near, far);
            let depths = [shortest + axis, longest + axis];
            let positions = (near[0] > 0.0).then(|| angles(far, near));
            (depths, positions)
        }
    }
}

/// Shortest and longest distance of a rectangle's points from the origin.
fn distances(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let nearest = |r: [f64; 2]| if r[0] > 0.0 { r[0] } else { (-r[1]).max(0.0) };
    let farthest = |r: [f64; 2]| r[0].abs().max(r[1].abs());
    [nearest(a).hypot(nearest(b)), farthest(a).hypot(farthest(b))]
}

/// Least and largest angle off the second axis of a rectangle that lies on its positive side: corners hold the extremes.
fn angles(across: [f64; 2], along: [f64; 2]) -> [f64; 2] {
    let corners = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| across[i].atan2(along[j]));
    [corners.into_iter().fold(f64::MAX, f64::min), corners.into_iter().fold(f64::MIN, f64::max)]
}

fn side(range: [f64; 2], limits: [f64; 2]) -> Side {
    match range {
        [low, high] if high < limits[0] || low > limits[1] => Side::Outside,
        [low, high] if low > limits[0] && high < limits[1] => Side::Inside,
        _ => Side::Across,
    }
}

/// Where an in-plane rectangle lies to the sector.
fn in_plane(probe: &Probe, x: [f64; 2], y: [f64; 2]) -> Side {
    let (ranges, lines) = match probe.array {
        Array::Linear => (y, Some(x)),
        Array::Curved { .. } => (distances(x, y), (y[0] > 0.0).then(|| angles(x, y))),
    };
    let by_range = side(ranges, [probe.first_range(), probe.last_range()]);
    let by_line = lines.map_or(Side::Across, |l| side(l, [probe.lines.first(), probe.lines.last()]));
    by_range.and(by_line)
}

/// Slice indices that any line may have had at these positions, and where they lie to the sweep.
fn sliced(probe: &Probe, positions: Option<[f64; 2]>) -> ([f64; 2], Side) {
    let count = probe.slices.len();
    let all = [0.0, (count - 1) as f64];
    if matches!(probe.motion, Motion::Still { .. }) || count < 2 {
        return ([0.0, 0.0], Side::Inside);
    }
    let Some([from, to]) = positions else { return (all, Side::Across) };
    let margin = SLICE_MARGIN * probe.slices.pitch();
    let (from, to) = (from - margin, to + margin);
    let advance = |k: usize| match &probe.advance {
        Advance::None => 0.0,
        Advance::Same(a) => *a,
        Advance::Each(table) => table.get(k).copied().unwrap_or(0.0),
    };
    // Each slice while its frame was acquired, swept either way: bricks stay when the motor turns.
    let least = |k: usize| probe.slices.at(k as f64) - advance(k).abs();
    let most = |k: usize| probe.slices.at(k as f64) + advance(k).abs();
    if to < least(0) || from > most(count - 1) {
        return (all, Side::Outside);
    }
    let first = (0..count).rev().find(|k| most(*k) <= from);
    let last = (0..count).find(|k| least(*k) >= to);
    let side = if first.is_some() && last.is_some() { Side::Inside } else { Side::Across };
    ([first.unwrap_or(0) as f64, last.unwrap_or(count - 1) as f64], side)
}
