//! Shadow, by tracing the distance map towards the light (thesis Fig. 41): the map is taken as the front of matter that is
//! `thickness` deep, and a place on the way to the light that lies in it is where the light is blocked.

use super::{camera_params, light_at, to_light};
use crate::passes::pass::*;
use crate::scene::Scene;
use glam::DVec3;

/// Samples on the segment to the light.
const STEPS: u32 = 96;

pub const PASS: Pass = Pass {
    name: "shadow",
    stage: Stage::Shade,
    frequency: Frequency::Picture,
    link: Link::Observer(Chain::Distances),
    shader: |_, _| "shade/shadow",
    needed: |s| match (s.has_distance(), s.settings.light.shadow) {
        (false, _) => Err("no surface in this mode"),
        (true, None) => Err("not asked for"),
        (true, Some(shadow)) if shadow.strength == 0.0 => Err("a strength of 0 casts none"),
        _ => Ok("asked for"),
    },
    reads: |_, t| vec![whole("distance_map", t.source())],
    writes: |_, _| vec![whole("shadow", Slot::Shadow)],
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        let shadow = s.settings.light.shadow.unwrap_or_default();
        camera_params(s)
            .vec3("forward", s.rays.forward)
            .vec3("light_at", light_at(s))
            .f32("reach", shadow.reach)
            .f32("thickness", shadow.thickness)
            .f32("bias", shadow.bias)
            .f32("softness", shadow.softness)
    },
    constants: |s, _| {
        let soft = s.settings.light.shadow.is_some_and(|s| s.softness > 0.0);
        vec![
            ("POINT", s.settings.light.position.is_some() as i32),
            ("PERSPECTIVE", s.rays.is_perspective as i32),
            ("SOFT", soft as i32),
            ("STEPS", STEPS as i32),
        ]
    },
    tolerance: Tolerance {
        absolute: 5e-3,
        relative: 0.0,
        outliers: 3e-2,
        why: "a place is off by 2e-5 mm in f32, and an edge of softness 0.15 at 0.4 mm makes 3e-4 of that; where the map has a \
              cliff, a thickness or a border, a place may fall on either side and the whole step counts or not",
    },
    reference: |scene, _, reads, writes| {
        let distances = reads.get("distance_map");
        let shadow = writes.get_mut("shadow");
        for y in 0..shadow.size[1] {
            for x in 0..shadow.size[0] {
                let arrives = super::place(scene, distances, x as i64, y as i64)
                    .map_or(1.0, |(place, _)| arriving(scene, distances, x, y, place));
                shadow.set([x, y, 0], &[arrives]);
            }
        }
    },
};

/// True if the light casts a shadow in this scene.
pub(super) fn is_cast(scene: &Scene) -> bool {
    (PASS.needed)(scene).is_ok()
}

/// Share of the light that arrives at a place which pixel (x, y) sees.
fn arriving(scene: &Scene, distances: &Texels, x: usize, y: usize, place: DVec3) -> f64 {
    let shadow = scene.settings.light.shadow.unwrap_or_default();
    let (_, along) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let (direction, far) = to_light(scene, place, -along);
    let way = shadow.reach.min(far);
    let mut arrives = 1.0f64;
    for i in 1..=STEPS {
        let gone = f64::from(i) * way / f64::from(STEPS);
        let Some((at, distance)) = seen_at(scene, place + direction * gone, distances.size) else { break };
        let Some(nearest) = map_at(scene, distances, at) else { continue };
        let inside = distance - nearest - shadow.bias;
        if inside > shadow.thickness {
            continue;
        }
        let blocked = match shadow.softness > 0.0 {
            true => (0.5 + inside / (shadow.softness * gone)).clamp(0.0, 1.0),
            false => f64::from(inside > 0.0),
        };
        arrives = arrives.min(1.0 - blocked);
    }
    arrives
}

/// Pixel place of a place in space and its distance along that ray; none beyond the picture or behind the camera.
fn seen_at(scene: &Scene, place: DVec3, size: [usize; 3]) -> Option<([f64; 2], f64)> {
    let rays = &scene.rays;
    let way = place - rays.origin;
    let solve = |v: DVec3, dx: DVec3, dy: DVec3| [v.dot(dx) / dx.length_squared(), v.dot(dy) / dy.length_squared()];
    let (at, distance) = if rays.is_perspective {
        let depth = way.dot(rays.forward);
        if depth <= 1e-6 {
            return None;
        }
        (solve(way / depth - rays.direction, rays.direction_dx, rays.direction_dy), way.length())
    } else {
        (solve(way, rays.origin_dx, rays.origin_dy), way.dot(rays.forward))
    };
    let within = at[0] >= 0.0 && at[1] >= 0.0 && at[0] < size[0] as f64 && at[1] < size[1] as f64;
    (within && distance >= 0.0).then_some((at, distance))
}

/// The distance map between pixel centres; across a cliff or a border, that of the pixel itself.
fn map_at(scene: &Scene, distances: &Texels, at: [f64; 2]) -> Option<f64> {
    let (x, y) = ((at[0] - 0.5).floor(), (at[1] - 0.5).floor());
    let (u, v) = (at[0] - 0.5 - x, at[1] - 0.5 - y);
    let (x, y) = (x as i64, y as i64);
    let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| super::hit_at(distances, x + dx, y + dy));
    let own = || super::hit_at(distances, at[0].floor() as i64, at[1].floor() as i64);
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return own() };
    let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    if high - low > scene.cliff() {
        return own();
    }
    Some((1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d))
}
