//! The render start as lines on the planes beside a rendering: the start surface, the curve that the user drew, or the deeper of both.

use super::Unveiled;
use crate::passes::raycast::ray;
use crate::passes::texels::pixels;
use crate::scene::Scene;
use crate::scene::planes::{Tile, Tiling};
use crate::scene::start_curve::StartCurve;
use glam::DVec3;

/// Cells along each edge of a tile between whose corners a line is straight: surface and curve are smooth.
const CELLS: usize = 72;

/// The line on one tile (the part of the picture that shows one plane) along which its plane cuts the start surface or start curve, in straight
/// pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct StartLine {
    /// Upper left corner and size of the tile, pixels of the picture.
    pub tile: [[f64; 2]; 2],
    /// The ends of each piece, pixels of the picture.
    pub pieces: Vec<[[f64; 2]; 2]>,
}

/// The lines at which the planes beside a rendering cut the start surface or start curve, one entry a tile. Empty if nothing is removed in front of
/// the render start, or if no lines are drawn over planes. `unveiled`: the result of the search in the volume that is drawn; None: there is no start
/// surface.
pub fn lines(scene: &Scene, unveiled: Option<&Unveiled>) -> Vec<StartLine> {
    let removes = |unveiled: &&Unveiled| unveiled.outcome.is_found() && unveiled.rows.iter().any(|row| *row > 0.0);
    let start = Start {
        surface: unveiled.filter(|_| scene.unveils()).filter(removes),
        curve: scene.start_curve(),
        least: scene.start_depth(),
    };
    let is_shown = scene.settings.layout.has_planes() && scene.draws_lines();
    if !is_shown || (start.surface.is_none() && start.curve.is_none()) {
        return Vec::new();
    }
    let tiling = scene.tiling();
    tiling.tiles.iter().map(|tile| on_tile(scene, &start, &tiling, tile)).collect()
}

/// What rendering starts at.
struct Start<'a> {
    surface: Option<&'a Unveiled>,
    curve: Option<StartCurve>,
    /// The start depth, which counts where it is deeper than the curve.
    least: f64,
}

impl Start<'_> {
    /// How far a place is behind the render start, mm, negative in front of it; none outside the sector.
    fn behind(&self, scene: &Scene, place: DVec3) -> Option<f64> {
        let surface = self.surface.and_then(|surface| Some(behind(scene, surface, place)? * scene.grid.pitch[1]));
        let within = |axis: usize| place[axis] >= scene.low[axis] && place[axis] <= scene.high[axis];
        let is_there = within(0) && within(2) && ray::texel(scene, place).is_some();
        let start = |curve: &StartCurve| curve.depth(place.x).max(self.least);
        let curve = self.curve.as_ref().filter(|_| is_there).map(|curve| place.y - start(curve));
        surface.into_iter().chain(curve).reduce(f64::min)
    }
}

/// Rows from the start surface to a place, negative in front of it; none outside the sector.
fn behind(scene: &Scene, unveiled: &Unveiled, place: DVec3) -> Option<f64> {
    let [column, row, slice] = ray::texel(scene, place)?;
    let (width, slices) = (scene.grid.size[0] as usize, scene.slices() as usize);
    let axis = |at: f64, count: usize| {
        let at = at.clamp(0.0, (count - 1) as f64);
        (at as usize, (at as usize + 1).min(count - 1), at.fract())
    };
    let ((x0, x1, u), (z0, z1, v)) = (axis(column, width), axis(slice, slices));
    let start = |x: usize, z: usize| unveiled.rows.get(z * width + x).map(|row| f64::from(*row));
    let along = |z: usize| Some(start(x0, z)? * (1.0 - u) + start(x1, z)? * u);
    Some(row - (along(z0)? * (1.0 - v) + along(z1)? * v))
}

/// Marching squares (Lorensen and Cline 1987, in the plane) over cells of the tile.
fn on_tile(scene: &Scene, start: &Start, tiling: &Tiling, tile: &Tile) -> StartLine {
    let [corner, size] = [tile.corner, tile.size].map(|edge| edge.map(f64::from));
    let at = |x: usize, y: usize| -> [f64; 2] {
        let share = [x, y].map(|n| n as f64 / CELLS as f64);
        std::array::from_fn(|a| corner[a] + size[a] * share[a])
    };
    let width = CELLS + 1;
    let points: Vec<[usize; 2]> = (0..width).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
    let values: Vec<Option<f64>> =
        points.iter().map(|[x, y]| start.behind(scene, tiling.point(tile, at(*x, *y)))).collect();
    let mut pieces = Vec::new();
    for (x, y) in pixels([CELLS, CELLS]) {
        // Around the cell.
        let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
        let crossing = |n: usize| {
            let ((x0, y0), (x1, y1)) = (corners[n], corners[(n + 1) % 4]);
            let (a, b) = (values[y0 * width + x0]?, values[y1 * width + x1]?);
            let (from, to) = (at(x0, y0), at(x1, y1));
            ((a < 0.0) != (b < 0.0)).then(|| std::array::from_fn(|i| from[i] + (to[i] - from[i]) * a / (a - b)))
        };
        let crossings: Vec<[f64; 2]> = (0..4).filter_map(crossing).collect();
        pieces.extend(crossings.chunks_exact(2).map(|ends| [ends[0], ends[1]]));
    }
    StartLine { tile: [corner, size], pieces }
}
