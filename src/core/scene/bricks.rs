//! The brick grid of empty-space skipping. It divides the box that rays cross into cells of a few texels, so that rays can skip cells
//! that cannot change the picture. Bricks are aligned to space, where rays are straight, and not to the texture, where a sweep bends
//! them. The texels that a brick can touch, and its position relative to the sector's border, follow from the geometry alone.

use super::Scene;
use super::region::insonified_box;
use super::visible_bounds::{marched_box, reach};
use crate::probe::{Array, Geometry, Motion, Probe};
use glam::DVec3;

/// Edge of a brick where no setting says another, texels.
const EDGE: u32 = 8;
/// Edge length, texels, of the square tiles that each slice is divided into. The minimum and the maximum of every tile are stored for empty-space
/// skipping.
pub const TILE: u32 = 4;
/// Maximum number of bricks of a scene: a table of 8 MB.
const MAX_BRICKS: f64 = 524_288.0;
/// Margin of a brick relative to its size. Rounding errors of f32 positions and distances are far smaller.
const MARGIN: f64 = 4e-3;
/// Error bound of the sweep's look-up table in slices, and the number of entries from which it holds.
const MIN_ENTRIES: u32 = 65;
const SLICE_MARGIN: f64 = 0.01;

/// The grid of bricks: boxes of a few texels, aligned with the axes of space, which rays skip where nothing in them can change the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bricks {
    /// Lower corner of brick (0, 0, 0), mm in space.
    pub low: DVec3,
    /// Edge length of a brick along each axis, mm.
    pub edge: DVec3,
    pub count: [u32; 3],
}

/// Position of a brick relative to the insonified region. Of two bounds the lesser one holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// Entirely outside the insonified region: no sample is taken there.
    Outside,
    /// Across the border of the insonified region, or not known.
    Across,
    /// Entirely inside the insonified region.
    Inside,
}

/// The texels that samples within a brick may read, as inclusive ranges [first, last]: `tiles` has those of the columns and rows of tiles ([`TILE`]),
/// `slices` that of the slices. `side` is the brick's position relative to the insonified region.
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
    /// Edge of a brick, texels: the setting `ray.brick`, or 8 where it is absent; 0 if the setting switches bricks off.
    pub fn brick(&self) -> u32 {
        self.settings.ray.brick.unwrap_or(EDGE)
    }

    /// True if rays skip bricks: they are switched on (`ray.brick`, or `bricks_pay` where it is absent), and the mode renders the volume by rays.
    /// False where the look-up table of the sweep, or positions in f32, are too coarse for bricks.
    pub fn skips(&self) -> bool {
        let swept = self.probe().is_some_and(|p| !matches!(p.motion, Motion::Still { .. }));
        let is_wanted = self.settings.ray.brick.map_or(self.bricks_pay, |edge| edge > 0);
        if !self.renders()
            || !is_wanted
            || (swept && self.slice_terms() == 0 && self.settings.ray.entries < MIN_ENTRIES)
        {
            return false;
        }
        // No skipping where f32 cannot resolve positions to a brick's margin, as with a camera kilometres away.
        let bricks = self.bricks();
        let farthest = [self.low, self.high, self.rays.origin].map(|place| self.to_local(place).abs().max_element());
        let farthest = farthest.into_iter().fold(0.0, f64::max);
        farthest * 1e-6 < MARGIN * bricks.edge.min_element()
    }

    /// The bricks in which rays may take samples, on a lattice that does not depend on the region of interest. With `slices.everything` they cover
    /// the whole insonified region, so that a region that is dragged changes no table.
    pub fn bricks(&self) -> Bricks {
        let (low, high) = insonified_box(&self.geometry);
        let size = f64::from(self.brick().max(TILE));
        let [x, y] = self.grid.pitch;
        let (pitch, first) = match &self.geometry {
            // Offset by half a texel, so that the samples of a brick of n texels lie between n + 1 texels.
            Geometry::Cartesian(grid) => (DVec3::from(grid.spacing), DVec3::from(grid.spacing) * (1.0 - size)),
            Geometry::Sweep(_) => (DVec3::splat(x.min(y)), DVec3::ZERO),
        };
        let (low, mut edge) = (low + first, pitch * size);
        let count = |edge: DVec3| ((high - low) / edge).ceil().max(DVec3::ONE);
        while count(edge).x * count(edge).y * count(edge).z > MAX_BRICKS {
            // Along the axis with the most bricks.
            let n = count(edge);
            let axis = (0..3).max_by(|a, b| n[*a].total_cmp(&n[*b])).unwrap_or(0);
            edge[axis] *= 2.0;
        }
        let count = count(edge);
        // One brick more on each side than samples reach.
        let marched = self.shared.as_ref().map_or_else(|| marched_box(self), |shared| shared.marched);
        let (first, last) = match marched {
            Some((from, to)) => {
                let first = (((from - low) / edge).floor() - 1.0).clamp(DVec3::ZERO, count - 1.0);
                (first, (((to - low) / edge).ceil() + 1.0).clamp(first + 1.0, count))
            }
            None => (DVec3::ZERO, count),
        };
        Bricks { low: low + first * edge, edge, count: (last - first).to_array().map(|n| n as u32) }
    }

    /// Number of tiles along columns and rows of a slice, and number of slices.
    pub(crate) fn tile_counts(&self) -> [u32; 3] {
        let [width, height, slices] = self.volume_size();
        [width.div_ceil(TILE), height.div_ceil(TILE), slices]
    }

    /// The tiles and slices that samples within the brick `cell` (index along each axis) may touch.
    pub fn reach(&self, bricks: &Bricks, cell: [u32; 3]) -> Reach {
        let margin = bricks.edge * MARGIN;
        let (low, high) = (bricks.place(cell) - margin, bricks.place(cell) + bricks.edge + margin);
        let mut extent = Extent::of(self, low, high);
        let taps = self.tap_reach();
        if taps > 0.0 {
            // The side of a sample follows from its position, its value from its taps.
            extent.texels = Extent::of(self, low - taps, high + taps).texels;
        }
        if self.takes_bspline() {
            // Slices k - 1 to k + 2 around k..k + 1.
            let [from, to] = &mut extent.texels[2];
            (*from, *to) = (*from - 1.0, *to + 1.0);
        }
        let [columns, rows, slices] = std::array::from_fn(|axis| {
            let last = f64::from(self.volume_size()[axis] - 1);
            let [from, to] = extent.texels[axis];
            [from.floor().clamp(0.0, last) as u32, to.ceil().clamp(0.0, last) as u32]
        });
        Reach { tiles: [columns, rows].map(|r| r.map(|n| n / TILE)), slices, side: extent.side }
    }

    /// Largest distance of a tap of the sliding filter from the sample, mm: along the ray and to both sides of it.
    pub(super) fn tap_reach(&self) -> f64 {
        let own = reach(self, self.step.max(self.ring.step), self.settings.ray.sliding / 2) * 3f64.sqrt();
        self.shared.as_ref().map_or(own, |shared| shared.taps)
    }

    /// A key of the values, apart from the geometry, that determine the brick tables: scenes with equal keys have equal tables.
    pub(crate) fn brick_basis(&self) -> impl PartialEq + use<> {
        (self.bricks(), self.grid, self.tap_reach(), self.takes_bspline())
    }
}

/// Bounds of a box in texture indices, and its position relative to the sector. The bounds are conservative.
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
                // Beyond the border the nearest texel is repeated.
                Extent { texels: [columns, rows([low.y, high.y]), slices], side: Side::Inside }
            }
            Geometry::Sweep(probe) => {
                let (depths, positions) = unswept(probe, low, high);
                let sector_side = in_plane(probe, [low.x, high.x], depths);
                let (slices, sweep_side) = sliced(probe, positions);
                Extent { texels: [columns, rows(depths), slices], side: sector_side.min(sweep_side) }
            }
        }
    }
}

/// In-plane depths and slice positions of a box. None if the box contains the wobble axis or lies behind it.
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

/// Minimum and maximum distance of the points of a rectangle from the origin.
fn distances(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let nearest = |r: [f64; 2]| if r[0] > 0.0 { r[0] } else { (-r[1]).max(0.0) };
    let farthest = |r: [f64; 2]| r[0].abs().max(r[1].abs());
    [nearest(a).hypot(nearest(b)), farthest(a).hypot(farthest(b))]
}

/// Minimum and maximum angle to the second axis of a rectangle on its positive side. The extremes lie at corners.
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

/// Position of an in-plane rectangle relative to the sector.
fn in_plane(probe: &Probe, x: [f64; 2], y: [f64; 2]) -> Side {
    let (ranges, lines) = match probe.array {
        Array::Linear => (y, Some(x)),
        Array::Curved { .. } => (distances(x, y), (y[0] > 0.0).then(|| angles(x, y))),
    };
    let by_range = side(ranges, [probe.first_range(), probe.last_range()]);
    let by_line = lines.map_or(Side::Across, |l| side(l, [probe.lines.first(), probe.lines.last()]));
    by_range.min(by_line)
}

/// Range of slice indices of all lines at these positions, and its position relative to the sweep.
fn sliced(probe: &Probe, positions: Option<[f64; 2]>) -> ([f64; 2], Side) {
    let count = probe.slices.len();
    let all = [0.0, (count - 1) as f64];
    if matches!(probe.motion, Motion::Still { .. }) || count < 2 {
        return ([0.0, 0.0], Side::Inside);
    }
    let Some([from, to]) = positions else { return (all, Side::Across) };
    let margin = SLICE_MARGIN * probe.slices.pitch();
    let (from, to) = (from - margin, to + margin);
    // Both sweep directions, so that bricks stay valid when the motor reverses.
    let least = |k: usize| probe.slices.at(k as f64) - probe.advance_of(k).abs();
    let most = |k: usize| probe.slices.at(k as f64) + probe.advance_of(k).abs();
    if to < least(0) || from > most(count - 1) {
        return (all, Side::Outside);
    }
    let first = (0..count).rev().find(|k| most(*k) <= from);
    let last = (0..count).find(|k| least(*k) >= to);
    let side = if first.is_some() && last.is_some() { Side::Inside } else { Side::Across };
    ([first.unwrap_or(0) as f64, last.unwrap_or(count - 1) as f64], side)
}
