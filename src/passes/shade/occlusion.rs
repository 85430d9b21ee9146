//! Ambient occlusion in image space: surfaces that rise above a pixel's tangent plane nearby occlude ambient light. (Mittring 2007;
//! Bavoil and Sainz 2008.)

use super::{camera_params, normal, place};
use crate::passes::pass::*;
use crate::scene::Scene;

/// Samples around a pixel.
const SAMPLES: u32 = 32;
/// pi (3 - sqrt 5), rad: turning by it never comes back to a direction.
const GOLDEN_ANGLE: f64 = 2.399_963_23;
/// Cosine above the tangent plane that is ignored: the map's own roughness.
const ROUGHNESS: f64 = 0.1;

pub const PASS: Pass = Pass {
    name: "occlusion",
    stage: Stage::Shade,
    frequency: Frequency::Picture,
    link: Link::Observer(Chain::Distances),
    shader: |_, _| "shade/occlusion",
    needed: |s| match (s.has_distance(), s.settings.light.occlusion) {
        (false, _) => Err("no surface in this mode"),
        (true, None) => Err("not asked for"),
        (true, Some(occlusion)) if occlusion.strength == 0.0 => Err("a strength of 0 takes nothing"),
        _ => Ok("asked for"),
    },
    reads: |_, t| vec![whole("distance_map", t.source())],
    writes: |_, _| vec![whole("occlusion", Slot::Occlusion)],
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        let occlusion = s.settings.light.occlusion.unwrap_or_default();
        camera_params(s).f32("radius", occlusion.radius).f32("strength", occlusion.strength)
    },
    constants: |_, _| vec![("SAMPLES", SAMPLES as i32)],
    tolerance: Tolerance {
        absolute: 4e-3,
        relative: 0.0,
        outliers: 3e-2,
        why: "a sum of 32 cosines in f32; a place on the spiral at a pixel's very border may be read from its neighbour, and a \
              neighbour at exactly the cliff's height may tilt the normal or not",
    },
    reference: |scene, _, reads, writes| {
        let distances = reads.get("distance_map");
        let occlusion = writes.get_mut("occlusion");
        for y in 0..occlusion.size[1] {
            for x in 0..occlusion.size[0] {
                occlusion.set([x, y, 0], &[open(scene, distances, x as i64, y as i64).unwrap_or(1.0)]);
            }
        }
    },
};

/// True if ambient occlusion darkens this scene.
pub(super) fn is_asked(scene: &Scene) -> bool {
    (PASS.needed)(scene).is_ok()
}

fn open(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<f64> {
    let settings = scene.settings.light.occlusion.unwrap_or_default();
    let (here, distance) = place(scene, distances, x, y)?;
    let normal = normal(scene, distances, x, y)?;
    let rays = &scene.rays;
    let pixels = settings.radius / (rays.origin_dx + rays.direction_dx * distance).length().max(1e-9);
    let mut taken = 0.0;
    for i in 0..SAMPLES {
        let share = ((f64::from(i) + 0.5) / f64::from(SAMPLES)).sqrt();
        let (sin, cos) = (GOLDEN_ANGLE * f64::from(i)).sin_cos();
        let tap = |at: i64, along: f64| (at as f64 + 0.5 + pixels * share * along).floor() as i64;
        let Some((there, _)) = place(scene, distances, tap(x, cos), tap(y, sin)) else { continue };
        let far = there.distance(here);
        if far >= 1e-6 {
            let falls = (1.0 - (far / settings.radius).powi(2)).max(0.0);
            taken += (normal.dot(there - here) / far - ROUGHNESS).max(0.0) * falls;
        }
    }
    Some((1.0 - settings.strength * 2.0 * taken / f64::from(SAMPLES)).clamp(0.0, 1.0))
}
