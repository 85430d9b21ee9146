//! Stage 3: lighting of the distance map. Camera parameters, positions and normals that its passes share.

pub mod light;
pub mod occlusion;
pub mod shadow;

use crate::passes::pass::{Params, Texels, is_hit, ray_params};
use crate::scene::Scene;
use glam::DVec3;

fn camera_params(scene: &Scene) -> Params {
    ray_params(scene).f32("cliff", scene.cliff())
}

/// Unit direction to a directional light, or the position of a point light, in space.
fn light_at(scene: &Scene) -> DVec3 {
    scene.light_place().unwrap_or_else(|| scene.rays.from_camera(scene.settings.light.direction.normalize()))
}

/// Unit direction from a place to the light, and the distance to it; the direction is `otherwise` for a light at that place.
fn to_light(scene: &Scene, place: DVec3, otherwise: DVec3) -> (DVec3, f64) {
    match scene.light_place() {
        Some(light) => ((light - place).try_normalize().unwrap_or(otherwise), light.distance(place)),
        None => (light_at(scene), f64::MAX),
    }
}

/// The distance at a pixel; none for a miss, or beyond the picture.
fn hit_at(distances: &Texels, x: i64, y: i64) -> Option<f64> {
    let [width, height, _] = distances.size;
    if x < 0 || y < 0 || x >= width as i64 || y >= height as i64 {
        return None;
    }
    Some(distances.one(x as usize, y as usize, 0)).filter(|d| is_hit(*d))
}

/// The point of the surface at a pixel in space, and its distance.
fn place(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<(DVec3, f64)> {
    let distance = hit_at(distances, x, y)?;
    let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    Some((origin + direction * distance, distance))
}

/// Unit normal at a pixel, towards the viewer. No difference is taken across a cliff.
pub fn normal(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<DVec3> {
    let (here, distance) = place(scene, distances, x, y)?;
    let slope = |dx: i64, dy: i64, facing: DVec3| {
        let same = |p: &(DVec3, f64)| (p.1 - distance).abs() <= scene.cliff();
        let back = place(scene, distances, x - dx, y - dy).filter(same);
        let on = place(scene, distances, x + dx, y + dy).filter(same);
        match (back, on) {
            (None, None) => facing,
            (back, on) => on.map_or(here, |p| p.0) - back.map_or(here, |p| p.0),
        }
    };
    let rays = &scene.rays;
    let sx = slope(1, 0, rays.origin_dx + rays.direction_dx);
    let sy = slope(0, 1, rays.origin_dy + rays.direction_dy);
    let (_, along) = rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let normal = sy.cross(sx).try_normalize().unwrap_or(-along);
    Some(if normal.dot(along) > 0.0 { -normal } else { normal })
}
