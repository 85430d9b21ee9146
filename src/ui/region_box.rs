//! The region as a box that is shown and grabbed: its section by each plane beside a rendering, with a handle on each side, and its edges in the
//! rendering.

use super::command::Face;
use super::picking::{Picker, nearest};
use super::view::{FACES, below_face, drawn_axis, face_axis, start_depth};
use crate::scene::Scene;
use crate::scene::planes::{Plane, Tile, Tiling};
use crate::scene::start_curve::StartCurve;
use glam::DVec3;

/// A shorter side of a section has no handle, pixels.
const MIN_SIDE: f64 = 12.0;

/// A side of the outline in which a plane cuts the region: its ends, pixels of the picture, and the face of the region on which it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    pub(super) face: Face,
    pub(super) ends: [[f64; 2]; 2],
    /// Position of its handle, in the middle of its visible part, pixels of the picture; None if it is too short to be dragged.
    pub(super) handle: Option<[f64; 2]>,
}

/// The part of the region that is at a position on a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Part {
    Face(Face),
    Inside,
}

/// An edge of the region's box in the rendering: its ends, pixels of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) ends: [[f64; 2]; 2],
    /// True if both faces at the edge are turned away from the viewer.
    pub(super) is_behind: bool,
}

/// True if planes show the outline of the region: those beside a rendering do, as they are not cropped to the region.
pub(super) fn is_on_planes(scene: &Scene) -> bool {
    scene.has_sections()
}

/// The sides of the outline in which the plane of a tile cuts the region; empty if it misses the region.
pub(super) fn section(scene: &Scene, tiling: &Tiling, tile: &Tile) -> Vec<Side> {
    let plane = &tile.plane;
    let reach = 4.0 * (scene.high - scene.low).length() + 2.0 * (plane.at - (scene.low + scene.high) / 2.0).length();
    // A square beyond the region, cut to it face by face. With each corner, the face of the side that begins there.
    let corner = |x: f64, y: f64| (plane.at + (plane.right * x + plane.down * y) * reach, None);
    let mut outline: Vec<(DVec3, Option<Face>)> =
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    for face in FACES {
        let (middle, out) = face_axis(scene, face);
        let beyond = |place: DVec3| (place - middle).dot(out);
        let count = outline.len();
        let mut kept = Vec::with_capacity(count + 1);
        for n in 0..count {
            let ((from, side), (to, _)) = (outline[n], outline[(n + 1) % count]);
            let (here, there) = (beyond(from), beyond(to));
            if here <= 0.0 {
                kept.push((from, side));
            }
            if (here <= 0.0) != (there <= 0.0) {
                let on_face = from + (to - from) * (here / (here - there));
                kept.push((on_face, if here <= 0.0 { Some(face) } else { side }));
            }
        }
        outline = kept;
    }
    let count = outline.len();
    let sides = (0..count).filter_map(|n| {
        let ((from, face), (to, _)) = (outline[n], outline[(n + 1) % count]);
        let ends = [from, to].map(|place| tiling.project(tile, place).0);
        Some(Side { face: face?, ends, handle: handle(tile, ends) })
    });
    sides.collect()
}

/// The tile of plane A, on which the start line is drawn and bent.
const START_TILE: usize = 0;
/// A plane that is turned further towards the lateral and the depth axis does not show the line's form: the least share of elevation in its normal.
const LEAST_FACING: f64 = 0.3;
/// Straight pieces of a curved start line.
const PIECES: usize = 96;

/// The start curve of the region as drawn on plane A, pixels of the picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StartLine {
    /// The vertices of the curve, from the left to the right side of the region, pixels of the picture.
    pub(super) line: Vec<[f64; 2]>,
    /// Lateral positions of the vertices, mm.
    lateral: Vec<f64>,
    /// Positions of the handles; empty while the curve is straight.
    pub(super) handles: Vec<[f64; 2]>,
}

/// The part of the start curve that is at a position on a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum StartPart {
    Handle(usize),
    /// The curve itself, at this lateral position, mm.
    Line(f64),
}

/// The drawing of the start curve through `points` (lateral, depth, mm; none for a straight one). None unless the tile shows plane A beside a
/// rendering and the plane is not rotated too far. The points may be newer than the scene of the shown picture.
pub(super) fn start_line(scene: &Scene, tiling: &Tiling, tile: usize, points: &[[f64; 2]]) -> Option<StartLine> {
    let is_shown = tile == START_TILE && is_on_planes(scene) && scene.renders();
    let tile = tiling.tiles.get(tile).filter(|_| is_shown)?;
    let Plane { at, normal, .. } = tile.plane;
    if normal.z.abs() < LEAST_FACING {
        return None;
    }
    let on_tile = |x: f64, y: f64| {
        let z = at.z - (normal.x * (x - at.x) + normal.y * (y - at.y)) / normal.z;
        tiling.project(tile, DVec3::new(x, y, z)).0
    };
    let offset = -below_face(scene, DVec3::ZERO).y;
    let curve = (!points.is_empty()).then(|| StartCurve::new(points));
    let pieces = if curve.is_some() { PIECES } else { 1 };
    let across = |n: usize| scene.low.x + (scene.high.x - scene.low.x) * n as f64 / pieces as f64;
    let lateral: Vec<f64> = (0..=pieces).map(across).collect();
    let depth =
        |x: f64| curve.as_ref().map_or(f64::NEG_INFINITY, |curve| curve.depth(x) + offset).max(start_depth(scene));
    let handles = points.iter().map(|[x, depth]| on_tile(*x, depth + offset)).collect();
    Some(StartLine { line: lateral.iter().map(|x| on_tile(*x, depth(*x))).collect(), lateral, handles })
}

/// The part of the start curve through `points` (lateral, depth, mm) at a position on a tile, pixels of the picture; None if there is none.
/// `reach`: largest distances from the curve and from a handle, pixels.
pub(super) fn start_at(
    scene: &Scene,
    tile: usize,
    points: &[[f64; 2]],
    at: [f64; 2],
    reach: [f64; 2],
) -> Option<StartPart> {
    let start = start_line(scene, &scene.tiling(), tile, points)?;
    let [of_line, of_handle] = reach;
    let away = |[x, y]: &[f64; 2]| (x - at[0]).hypot(y - at[1]);
    let handle = nearest(start.handles.iter().map(away).zip(0..), of_handle);
    let pieces = start.line.windows(2).zip(start.lateral.windows(2)).map(|(ends, lateral)| {
        let ends = [ends[0], ends[1]];
        (distance(at, ends), lateral[0] + (lateral[1] - lateral[0]) * share(at, ends))
    });
    handle.map(StartPart::Handle).or_else(|| nearest(pieces, of_line).map(StartPart::Line))
}

/// The middle of the part of a line that is on a tile, if that is long enough.
fn handle(tile: &Tile, [from, to]: [[f64; 2]; 2]) -> Option<[f64; 2]> {
    let way = [to[0] - from[0], to[1] - from[1]];
    let (mut begin, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let low = f64::from(tile.corner[axis]);
        let sides = [low, low + f64::from(tile.size[axis])].map(|side| (side - from[axis]) / way[axis]);
        if way[axis].abs() < 1e-9 {
            if !(low..=low + f64::from(tile.size[axis])).contains(&from[axis]) {
                return None;
            }
        } else {
            begin = begin.max(sides[0].min(sides[1]));
            end = end.min(sides[0].max(sides[1]));
        }
    }
    let middle = (begin + end) / 2.0;
    let is_long = (end - begin) * way[0].hypot(way[1]) >= MIN_SIDE;
    is_long.then(|| [0, 1].map(|axis| from[axis] + way[axis] * middle))
}

/// The part of the region at a position on a tile, pixels of the picture; None if there is none. `reach`: largest distances from a side and from
/// its handle, pixels.
pub(super) fn part_at(scene: &Scene, tile: usize, at: [f64; 2], reach: [f64; 2]) -> Option<Part> {
    if !is_on_planes(scene) {
        return None;
    }
    let tiling = scene.tiling();
    let sides = section(scene, &tiling, tiling.tiles.get(tile)?);
    let [of_side, of_handle] = reach;
    let to_handle = |side: &Side| side.handle.map(|[x, y]| (x - at[0]).hypot(y - at[1]));
    let handle = nearest(sides.iter().filter_map(|side| Some((to_handle(side)?, side.face))), of_handle);
    let line = || nearest(sides.iter().map(|side| (distance(at, side.ends), side.face)), of_side);
    let is_inside = || {
        let place = tiling.point(&tiling.tiles[tile], at);
        place.cmpge(scene.low).all() && place.cmple(scene.high).all()
    };
    handle.or_else(line).map(Part::Face).or_else(|| is_inside().then_some(Part::Inside))
}

/// Distance of a point from a line between two ends.
fn distance(at: [f64; 2], ends: [[f64; 2]; 2]) -> f64 {
    let [from, to] = ends;
    let share = share(at, ends);
    (at[0] - from[0] - share * (to[0] - from[0])).hypot(at[1] - from[1] - share * (to[1] - from[1]))
}

/// How far along a line between two ends the point of it lies that is nearest to another, 0..=1.
fn share(at: [f64; 2], [from, to]: [[f64; 2]; 2]) -> f64 {
    let [way, off] = [[to[0] - from[0], to[1] - from[1]], [at[0] - from[0], at[1] - from[1]]];
    let length = (way[0] * way[0] + way[1] * way[1]).max(1e-30);
    ((off[0] * way[0] + off[1] * way[1]) / length).clamp(0.0, 1.0)
}

/// The edges of the region's box in the rendering, without the parts behind the camera.
pub(super) fn wireframe(scene: &Scene) -> Vec<Edge> {
    if scene.is_flat() {
        return Vec::new();
    }
    let picker = Picker::of(scene);
    let rays = &scene.rays;
    let is_turned_away = |face: Face| {
        let (middle, out) = face_axis(scene, face);
        let towards = if rays.is_perspective { middle - rays.origin } else { rays.forward };
        towards.dot(out) > 0.0
    };
    let corner = |ends: [bool; 3]| {
        let pick = |axis: usize| if ends[axis] { scene.high[axis] } else { scene.low[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let edge = |n: usize| {
        let (axis, others) = (n / 4, [n & 1 == 1, n & 2 == 2]);
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let mut from = [false; 3];
        (from[a], from[b]) = (others[0], others[1]);
        let mut to = from;
        to[axis] = true;
        let faces = [Face { axis: a, high: from[a] }, Face { axis: b, high: from[b] }];
        let ends = [picker.project(corner(from))?, picker.project(corner(to))?];
        Some(Edge { ends, is_behind: faces.into_iter().all(is_turned_away) })
    };
    (0..12).filter_map(edge).collect()
}

/// Positions of the handles of the region's faces in the rendering, pixels of the picture: the middle of each face whose normal does not point
/// at the viewer or away.
pub(super) fn rendered_handles(scene: &Scene) -> Vec<[f64; 2]> {
    if scene.is_flat() {
        return Vec::new();
    }
    let picker = Picker::of(scene);
    FACES.into_iter().filter_map(|face| Some(drawn_axis(scene, &picker, face)?.0)).collect()
}
