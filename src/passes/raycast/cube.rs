//! The volume as a solid block: the sample where each ray enters it, the sector's own border being a face too.

use super::ray;
use crate::passes::*;
use crate::probe::{Array, Geometry, Motion};
use crate::scene::cube::HalfSpace;
use crate::scene::{Mode, Scene};

/// Colour and strength of the lines where faces meet: told from tissue, which is grey.
const EDGE: ([f64; 3], f64) = ([0.55, 0.75, 0.95], 0.8);

pub const PASS: Pass = Pass {
    name: "raycast_cube",
    stage: Stage::Raycast,
    when: When::Picture,
    shader: |s, _| ray::variant!(s, "raycast/cube"),
    needed: |s| match s.settings.mode {
        Mode::Cube => Ok("the volume is a solid block"),
        _ => Err("no block in this mode"),
    },
    reads: |s, _| {
        let mut reads = ray::reads(s);
        reads.push(whole("block", Slot::Block));
        reads
    },
    writes: |s, _| vec![whole("picture", chain::rendered(s))],
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        ray::params(s, s.window())
            .f32("stride", stride(s))
            .f32("shading", s.settings.cube.shading)
            .f32("edge_strength", EDGE.1)
            .vec3("edge_colour", EDGE.0)
    },
    constants: |s, _| {
        let mut constants = ray::constants(s);
        // Clip planes are half-spaces of the block.
        constants.retain(|(name, _)| matches!(*name, "SWEEP" | "ARRAY" | "SAMPLING"));
        constants.push(("EDGES", s.settings.cube.edges as i32));
        constants
    },
    tolerance: Tolerance {
        absolute: 6e-3,
        relative: 0.0,
        outliers: 1e-2,
        why: "the sector's border is found to 1/64 of half a slice pixel, the reference to the end: as much of a voxel's \
              contrast; a ray that grazes a border, and one at an edge, may fall on either side",
    },
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let picture = writes.get_mut("picture");
        let block = scene.block();
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                picture.set([x, y, 0], &shown(scene, volume, &block, x as f64 + 0.5, y as f64 + 0.5));
            }
        }
    },
};

/// Longest step of the search for the sector's border: half a slice pixel, mm.
fn stride(scene: &Scene) -> f64 {
    0.5 * scene.grid.pitch[0].min(scene.grid.pitch[1])
}

/// Where a ray is within all half-spaces, and which of them it enters last.
fn entry(block: &[HalfSpace], origin: DVec3, direction: DVec3) -> Option<(f64, f64, Option<usize>)> {
    let (mut enter, mut leave, mut face) = (0.0f64, f64::MAX, None);
    for (i, half) in block.iter().enumerate() {
        let (towards, room) = (half.normal.dot(direction), half.room(origin));
        if towards.abs() < 1e-12 {
            if room < 0.0 {
                return None;
            }
        } else if towards > 0.0 {
            leave = leave.min(room / towards);
        } else if room / towards > enter {
            (enter, face) = (room / towards, Some(i));
        }
    }
    (leave > enter).then_some((enter, leave, face))
}

fn shown(scene: &Scene, volume: &Texels, block: &[HalfSpace], x: f64, y: f64) -> [f64; 4] {
    let (origin, direction) = scene.rays.at(x, y);
    let Some((enter, leave, face)) = entry(block, origin, direction) else { return [0.0; 4] };
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
    let on_face = face.filter(|_| n == 0.0);
    let normal = match on_face {
        Some(face) => block[face].normal,
        None if n > 0.0 => border_normal(scene, origin + direction * outside),
        // The camera is within the block.
        None => direction,
    };
    let Some(texel) = ray::texel(scene, place) else { return [0.0; 4] };
    let [low, high] = scene.settings.cube.window;
    let value = ((volume.trilinear(texel) - low) / (high - low)).clamp(0.0, 1.0);
    let grey = value * (1.0 - scene.settings.cube.shading * (1.0 - normal.dot(direction).abs()));
    let near = match on_face {
        Some(face) if scene.settings.cube.edges => edge(scene, block, face, place, x, y),
        _ => 0.0,
    };
    let [r, g, b] = EDGE.0.map(|c| grey + (c - grey) * EDGE.1 * near);
    [r, g, b, 1.0]
}

/// How much of a pixel the line where its face meets another covers: the distance to it in pixels by how fast the room to
/// the other half-space shrinks from pixel to pixel, both seen on the face.
fn edge(scene: &Scene, block: &[HalfSpace], face: usize, place: DVec3, x: f64, y: f64) -> f64 {
    // Where the rays of places next to the pixel's centre meet the face.
    let small = 1e-4;
    let on_face = |x: f64, y: f64| {
        let (origin, direction) = scene.rays.at(x, y);
        origin + direction * (block[face].room(origin) / block[face].normal.dot(direction))
    };
    let dx = (on_face(x + small, y) - on_face(x - small, y)) / (2.0 * small);
    let dy = (on_face(x, y + small) - on_face(x, y - small)) / (2.0 * small);
    let others = block.iter().enumerate().filter(|(i, _)| *i != face);
    let cover = others.map(|(_, o)| 1.0 - o.room(place) / o.normal.dot(dx).hypot(o.normal.dot(dy)).max(1e-20));
    cover.fold(0.0, f64::max).clamp(0.0, 1.0)
}

/// Outward normal of the sector's border at a place just outside it: the gradient of what is exceeded there, the range, the
/// line or the slice. (The motor's way over the lines of a frame turns it by less than a degree and is left out.)
fn border_normal(scene: &Scene, place: DVec3) -> DVec3 {
    let Geometry::Sweep(probe) = &scene.geometry else { return DVec3::Y };
    let (x, y, position) = probe.unswept(place);
    let (depth, sweep) = match probe.motion {
        Motion::Fan { .. } => {
            (DVec3::new(0.0, position.cos(), position.sin()), DVec3::new(0.0, -position.sin(), position.cos()))
        }
        _ => (DVec3::Y, DVec3::Z),
    };
    let (along, across) = match probe.array {
        Array::Curved { .. } => {
            let (sin, cos) = x.atan2(y).sin_cos();
            (DVec3::X * sin + depth * cos, DVec3::X * cos - depth * sin)
        }
        Array::Linear => (depth, DVec3::X),
    };
    let at = probe.to_indices(place);
    match (at.sample / (probe.samples - 1) as f64, at.line / (probe.lines.len() - 1) as f64) {
        (sample, _) if sample > 1.0 => along,
        (sample, _) if sample < 0.0 => -along,
        (_, line) if line > 1.0 => across,
        (_, line) if line < 0.0 => -across,
        _ => sweep,
    }
}
