//! Normals from the distance map, and Blinn-Phong (thesis 4-4..4-7) under a directional light.

use crate::passes::chain::distance_end;
use crate::passes::*;
use crate::scene::Scene;

pub const PASS: Pass = Pass {
    name: "light",
    stage: Stage::Shade,
    when: When::Picture,
    shader: |_| "shade/light",
    needed: |s| if s.is_surface() { Ok("a surface is lit") } else { Err("no surface in this mode") },
    reads: |s, _| vec![whole("distance_map", distance_end(s)), whole("surface", Slot::Surface)],
    writes: |_, _| vec![whole("picture", Slot::Picture)],
    extent: picture_extent,
    repeat: once,
    params: |s, _| {
        let (rays, light) = (&s.rays, &s.settings.light);
        Params::default()
            .vec3("origin_dx", rays.origin_dx)
            .vec3("origin_dy", rays.origin_dy)
            .vec3("direction", rays.direction)
            .vec3("direction_dx", rays.direction_dx)
            .vec3("direction_dy", rays.direction_dy)
            .vec3("to_light", to_light(s))
            .f32("ambient", light.ambient)
            .f32("diffuse", light.diffuse)
            .f32("specular", light.specular)
            .f32("shininess", light.shininess)
            .vec3("light_colour", light.colour)
            .vec3("surface_colour", light.surface_colour)
            .f32("texture_share", light.texture)
            .f32("cliff", light.cliff)
    },
    constants: no_constants,
    tolerance: Tolerance {
        absolute: 6e-3,
        relative: 6e-3,
        outliers: 5e-3,
        why: "a place of 100 mm has 8e-6 mm of rounding in f32, a slope over two pixels of 0.2 mm is off by 4e-5, and a \
              shininess of 100 multiplies that; a neighbour at exactly the cliff's height may count or not",
    },
    reference: |scene, _, reads, writes| {
        let distances = reads.get("distance_map");
        let surface = reads.get("surface");
        let picture = writes.get_mut("picture");
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                let colour = lit(scene, distances, surface.get([x, y, 0]), x as i64, y as i64);
                picture.set([x, y, 0], &colour.map_or([0.0; 4], |c| [c.x, c.y, c.z, 1.0]));
            }
        }
    },
};

/// Unit vector towards the light, in space.
fn to_light(scene: &Scene) -> DVec3 {
    scene.rays.from_camera(scene.settings.light.direction.normalize())
}

fn place(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<(DVec3, f64)> {
    let [width, height, _] = distances.size;
    if x < 0 || y < 0 || x >= width as i64 || y >= height as i64 {
        return None;
    }
    let distance = distances.one(x as usize, y as usize, 0);
    let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    is_hit(distance).then(|| (origin + direction * distance, distance))
}

/// Unit normal at a pixel, towards the viewer.
pub fn normal(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<DVec3> {
    let (here, distance) = place(scene, distances, x, y)?;
    let slope = |dx: i64, dy: i64, facing: DVec3| {
        let same = |p: &(DVec3, f64)| (p.1 - distance).abs() <= scene.settings.light.cliff;
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

fn lit(scene: &Scene, distances: &Texels, surface: &[f64], x: i64, y: i64) -> Option<DVec3> {
    let normal = normal(scene, distances, x, y)?;
    let light = &scene.settings.light;
    let (_, along) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let facing = normal.dot(to_light(scene)).max(0.0);
    let halfway = (to_light(scene) - along).try_normalize().unwrap_or(DVec3::ZERO);
    let gloss = normal.dot(halfway).max(0.0).powf(light.shininess);
    let shine = if facing > 0.0 { light.specular * gloss } else { 0.0 };
    let texture = 1.0 + (surface[0] - 1.0) * light.texture * surface[1];
    let colour = DVec3::from(light.surface_colour) * texture;
    Some(DVec3::from(light.colour) * (colour * (light.ambient + light.diffuse * facing) + shine))
}
