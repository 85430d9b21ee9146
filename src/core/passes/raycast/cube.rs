//! The volume as a solid block: the sample where each ray enters it, the sector's own border being a face too.

use super::ray;
use crate::passes::pass::*;
use crate::probe::{Array, Motion, Probe};
use crate::scene::cube::HalfSpace;
use crate::scene::{Mode, Scene, windowed};
use glam::DVec3;

/// Colour and strength of the lines where faces meet: a colour, because tissue is grey.
const EDGE: ([f64; 3], f64) = ([0.55, 0.75, 0.95], 0.7);
/// Pixels from an edge at which its line has faded.
const EDGE_WIDTH: f64 = 1.5;

pub(crate) const PASS: Pass = Pass {
    name: "raycast_cube",
    shader: |_, _| "raycast/cube",
    needed: |s| match s.settings.mode {
        Mode::Cube => Ok("the volume is a solid block"),
        _ => Err("no block in this mode"),
    },
    reads: |s, _| [ray::reads(s), vec![whole("block", Slot::Block)]].concat(),
    writes: |s, _| vec![whole("picture", rendered(s))],
    params: |s, _| {
        ray::params(s, s.whole_view(s.settings.cube.window), s.step)
            .f32("stride", stride(s))
            .f32("shading", s.settings.cube.shading)
            .f32("edge_strength", EDGE.1)
            .vec3("edge_colour", EDGE.0)
            .f32("slice_pitch", s.probe().map_or(0.0, |p| p.slices.pitch()))
    },
    // Clip planes are half-spaces of the block.
    constants: |s, _| replaced(ray::constants(s), &["CLIPS", "SPREAD"], [("EDGES", s.settings.cube.edges as i32)]),
    tolerance: Tolerance::absolute(1e-2).outliers(2e-3).because(
        "the sector's border is found to 1/64 of half a slice pixel, the reference to the end: as much of a voxel's \
         contrast and of an edge line's rise; a ray that grazes a border may fall on either side",
    ),
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let block = scene.block();
        writes.get_mut("picture").fill(|x, y| reference_pixel(scene, volume, &block, x as f64 + 0.5, y as f64 + 0.5));
    },
    ..Pass::OF_RAYS
};

/// Longest step of the search for the sector's border: half a slice pixel, mm.
fn stride(scene: &Scene) -> f64 {
    0.5 * scene.grid.pitch[0].min(scene.grid.pitch[1])
}

fn reference_pixel(scene: &Scene, volume: &Texels, block: &[HalfSpace], x: f64, y: f64) -> [f64; 4] {
    let (origin, direction) = scene.rays.at(x, y);
    let Some((enter, leave, face)) = ray::entry(block.iter().copied(), origin, direction) else { return [0.0; 4] };
    let steps = ((leave - enter) / stride(scene)).ceil().max(1.0);
    let step = (leave - enter) / steps;
    let at = |n: f64| enter + (n + 0.02) * step;
    let is_inside = |t: f64| ray::texel(scene, origin + direction * t).is_some();
    let Some(n) = (0..steps as usize).map(|n| n as f64).find(|n| is_inside(at(*n))) else { return [0.0; 4] };
    let (mut outside, mut inside) = (at(n - 1.0), at(n));
    for _ in 0..if n > 0.0 { 50 } else { 0 } {
        let middle = (outside + inside) / 2.0;
        *(if is_inside(middle) { &mut inside } else { &mut outside }) = middle;
    }
    let place = origin + direction * inside;
    // A block face, a border of the sector, or neither: the camera is within the block.
    let borders = |place| scene.probe().map_or(Vec::new(), |probe| borders(probe, place));
    let before = borders(origin + direction * outside);
    let least = (0..before.len()).min_by(|a, b| before[*a].room.total_cmp(&before[*b].room));
    let (own, normal) = match (face, least) {
        (_, Some(border)) if n > 0.0 => (Some(block.len() + border), before[border].normal),
        (Some(face), _) => (Some(face), block[face].normal),
        (None, _) => (None, direction),
    };
    let Some(texel) = ray::texel(scene, place) else { return [0.0; 4] };
    let value = windowed(scene.settings.cube.window, ray::interpolated(scene, volume, texel));
    let grey = value * (1.0 - scene.settings.cube.shading * (1.0 - normal.dot(direction).abs()));
    let near = match own {
        Some(own) if scene.settings.cube.edges => {
            let faces = block.iter().map(|half| Side { normal: half.normal, room: half.room(place) });
            let sides = faces.chain(borders(place)).enumerate();
            let others = sides.filter(|(i, side)| *i != own && side.normal.dot(normal) < SAME_FACE);
            edge(scene, others.map(|(_, side)| side), normal, place, x, y)
        }
        _ => 0.0,
    };
    let [r, g, b] = EDGE.0.map(|c| grey + (c - grey) * EDGE.1 * near);
    [r, g, b, 1.0]
}

/// Cosine of the least angle between faces that meet at an edge, 8 degrees: where a plane touches an arc there is none.
const SAME_FACE: f64 = 0.99;

/// A face of the block or a border of the sector relative to a point: its outward normal, and its distance, mm.
struct Side {
    normal: DVec3,
    room: f64,
}

/// The share of a pixel that is covered by the line where its face meets another: 1 up to half a pixel from the line, 0 from one
/// and a half. The distance in pixels is the distance to the other face divided by its change per pixel, both on the face.
fn edge(scene: &Scene, others: impl Iterator<Item = Side>, normal: DVec3, place: DVec3, x: f64, y: f64) -> f64 {
    // Where the rays next to the pixel's centre meet the face. A face that is viewed edge-on keeps a finite slope.
    let small = 1e-4;
    let on_face = |x: f64, y: f64| {
        let (origin, direction) = scene.rays.at(x, y);
        let along = (place - origin).dot(direction);
        let near = origin + direction * along;
        near + direction * (normal.dot(place - near) / normal.dot(direction).min(-1e-3))
    };
    let dx = (on_face(x + small, y) - on_face(x - small, y)) / (2.0 * small);
    let dy = (on_face(x, y + small) - on_face(x, y - small)) / (2.0 * small);
    let cover = others.map(|o| EDGE_WIDTH - o.room / o.normal.dot(dx).hypot(o.normal.dot(dy)).max(1e-20));
    cover.fold(0.0, f64::max).clamp(0.0, 1.0)
}

/// First and last range, line and slice of the sector relative to a point. (The motor's motion during a frame rotates the slices
/// by less than a degree and is ignored in their normals.)
fn borders(probe: &Probe, place: DVec3) -> Vec<Side> {
    let (x, y, position) = probe.inverse_sweep_map(place);
    let (depth, sweep, mm) = match probe.motion {
        Motion::Fan { .. } => {
            let (sin, cos) = position.sin_cos();
            (DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos), y - probe.axis_depth())
        }
        _ => (DVec3::Y, DVec3::Z, 1.0),
    };
    let (range, at, along, across) = match probe.array {
        Array::Curved { .. } => {
            let (sin, cos) = x.atan2(y).sin_cos();
            (x.hypot(y), x.atan2(y), DVec3::X * sin + depth * cos, DVec3::X * cos - depth * sin)
        }
        Array::Linear => (y, x, depth, DVec3::X),
    };
    let side = |normal, room| Side { normal, room };
    let line_mm = if matches!(probe.array, Array::Linear) { 1.0 } else { range };
    let mut sides = vec![
        side(-along, range - probe.first_range()),
        side(along, probe.last_range() - range),
        side(-across, (at - probe.lines.first()) * line_mm),
        side(across, (probe.lines.last() - at) * line_mm),
    ];
    if !matches!(probe.motion, Motion::Still { .. }) {
        let line = probe.to_indices(place).line;
        let (first, last) =
            (probe.slice_position(line, 0.0), probe.slice_position(line, (probe.slices.len() - 1) as f64));
        sides.push(side(-sweep, (position - first) * mm));
        sides.push(side(sweep, (last - position) * mm));
    }
    sides
}
