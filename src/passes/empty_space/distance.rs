//! The Chebyshev distance to the nearest brick of another kind, in bricks (Deakin and Knackstedt 2020): one axis per
//! dispatch, by d(p) = min over the line through p of max(|q - p|, d(q)).

use super::{ACTIVE, EMPTY};
use crate::passes::pass::*;
use crate::probe::Geometry;
use crate::scene::Scene;

pub const SURFACE: Pass = Pass {
    name: "brick_distance_surface",
    stage: Stage::Raycast,
    frequency: Frequency::Picture,
    link: Link::None,
    shader: |_, _| "empty_space/distance.plain",
    needed: super::classify::SURFACE.needed,
    reads: |_, t| vec![whole("source", link(Slot::SurfaceBrickDistances, t).0)],
    writes: |_, t| vec![whole("target", link(Slot::SurfaceBrickDistances, t).1)],
    extent: |s, _| s.bricks().count,
    repeat: |_| 3,
    params: |_, _| Params::default(),
    constants: |s, t| constants(beyond_surface(s), t),
    tolerance: Tolerance { absolute: 0.0, relative: 0.0, outliers: 0.0, why: "whole numbers" },
    reference: |s, t, reads, writes| reference(beyond_surface(s), t, reads, writes),
};

pub const VOLUME: Pass = Pass {
    name: "brick_distance_volume",
    needed: super::classify::VOLUME.needed,
    reads: |_, t| vec![whole("source", link(Slot::VolumeBrickDistances, t).0)],
    writes: |_, t| vec![whole("target", link(Slot::VolumeBrickDistances, t).1)],
    constants: |_, t| constants(EMPTY, t),
    reference: |_, t, reads, writes| reference(EMPTY, t, reads, writes),
    ..SURFACE
};

/// The slots that the dispatch of an axis reads and writes.
fn link(last: Slot, args: &DispatchArgs) -> (Slot, Slot) {
    match args.iteration {
        0 => (Slot::BrickKinds, Slot::BrickDistancesX),
        1 => (Slot::BrickDistancesX, Slot::BrickDistancesXy),
        _ => (Slot::BrickDistancesXy, last),
    }
}

/// The kind of the space beyond the bricks. The detector takes samples there, where a Cartesian volume repeats its last texels.
fn beyond_surface(scene: &Scene) -> u32 {
    if matches!(scene.geometry, Geometry::Cartesian(_)) { ACTIVE } else { EMPTY }
}

fn constants(beyond: u32, args: &DispatchArgs) -> Vec<(&'static str, i32)> {
    vec![("AXIS", args.iteration as i32), ("BEYOND", beyond as i32)]
}

fn reference(beyond: u32, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let source = reads.get("source");
    let target = writes.get_mut("target");
    let axis = args.iteration as usize;
    let size = source.size;
    let code = |at: [usize; 3]| (source.one(at[0], at[1], at[2]) * 255.0).round() as u32;
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let at = [x, y, z];
                let (kind, own) = (code(at) >> 6, code(at) & 63);
                let mut best = own;
                for along in 0..size[axis] {
                    let away = along.abs_diff(at[axis]) as u32;
                    let mut there = at;
                    there[axis] = along;
                    let other = code(there);
                    if away > 0 {
                        best = best.min(if other >> 6 == kind { away.max(other & 63) } else { away });
                    }
                }
                if beyond != kind {
                    best = best.min(at[axis] as u32 + 1).min((size[axis] - at[axis]) as u32);
                }
                target.set(at, &[f64::from(kind * 64 + best) / 255.0]);
            }
        }
    }
}
