//! Blinn-Phong (thesis 4-4..4-7) under a far or near light, with shadow, occlusion and the look of skin where asked for.

use super::{camera_params, light_at, normal, to_light};
use crate::passes::chain::distance_end;
use crate::passes::*;
use crate::scene::{Scene, Skin};

pub const PASS: Pass = Pass {
    name: "light",
    stage: Stage::Shade,
    when: When::Picture,
    shader: |s, _| match (super::shadow::PASS.is_needed(s), super::occlusion::PASS.is_needed(s)) {
        (false, false) => "shade/light.plain",
        (true, false) => "shade/light.shadowed",
        (false, true) => "shade/light.occluded",
        (true, true) => "shade/light.shadowed_occluded",
    },
    needed: |s| if s.has_distance() { Ok("a surface is lit") } else { Err("no surface in this mode") },
    reads: |s, _| {
        let mut reads = vec![whole("distance_map", distance_end(s)), whole("surface", Slot::Surface)];
        reads.extend(super::shadow::PASS.is_needed(s).then_some(whole("shadow", Slot::Shadow)));
        reads.extend(super::occlusion::PASS.is_needed(s).then_some(whole("occlusion", Slot::Occlusion)));
        reads
    },
    writes: |s, _| vec![whole("picture", chain::rendered(s))],
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        let light = &s.settings.light;
        camera_params(s)
            .vec3("light_at", light_at(s))
            .f32("ambient", light.ambient)
            .f32("diffuse", light.diffuse)
            .f32("specular", light.specular)
            .f32("shininess", light.shininess)
            .vec3("light_colour", light.colour)
            .vec3("surface_colour", light.surface_colour)
            .f32("texture_share", light.texture)
            .f32("shadow_strength", light.shadow.map_or(0.0, |s| s.strength))
            .vec3("wrap", wrap(s.skin()))
            .vec3("through", through(s.skin()))
    },
    constants: |s, _| {
        let light = &s.settings.light;
        vec![("POINT", light.position.is_some() as i32), ("SKIN", s.skin().is_some() as i32)]
    },
    tolerance: Tolerance {
        absolute: 6e-3,
        relative: 6e-3,
        outliers: 5e-3,
        why: "a slope is off by 1e-6 in f32, and a shininess of 1e6 multiplies what that does to a cosine; a neighbour at \
              exactly the cliff's height may count or not",
    },
    reference: |scene, _, reads, writes| {
        let picture = writes.get_mut("picture");
        for y in 0..picture.size[1] {
            for x in 0..picture.size[0] {
                let colour = lit(scene, reads, x, y);
                picture.set([x, y, 0], &colour.map_or([0.0; 4], |c| [c.x, c.y, c.z, 1.0]));
            }
        }
    },
};

/// Red wraps furthest: light travels furthest through skin at long wavelengths.
fn wrap(skin: Option<Skin>) -> DVec3 {
    DVec3::new(1.0, 0.55, 0.35) * skin.map_or(0.0, |s| s.wrap)
}

fn through(skin: Option<Skin>) -> DVec3 {
    skin.map_or(DVec3::ZERO, |s| DVec3::from(s.colour) * s.translucency)
}

fn lit(scene: &Scene, reads: &Arrays, x: usize, y: usize) -> Option<DVec3> {
    let distances = reads.get("distance_map");
    let (place, _) = super::place(scene, distances, x as i64, y as i64)?;
    let normal = normal(scene, distances, x as i64, y as i64)?;
    let light = &scene.settings.light;
    let (_, along) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let (to_light, _) = to_light(scene, place, normal);
    let cosine = normal.dot(to_light);
    let facing = cosine.max(0.0);
    let halfway = (to_light - along).try_normalize().unwrap_or(DVec3::ZERO);
    let gloss = normal.dot(halfway).max(0.0).powf(light.shininess);
    let surface = reads.get("surface").get([x, y, 0]);
    let (echo, found, behind) = (surface[0], surface[1], surface.get(2).copied().unwrap_or(0.0));
    let colour = DVec3::from(light.surface_colour) * (1.0 + (echo - 1.0) * light.texture * found);

    let arrives = light.shadow.map_or(1.0, |s| match super::shadow::PASS.is_needed(scene) {
        true => 1.0 - s.strength * (1.0 - reads.get("shadow").one(x, y, 0)),
        false => 1.0,
    });
    let open = if super::occlusion::PASS.is_needed(scene) { reads.get("occlusion").one(x, y, 0) } else { 1.0 };
    let (diffused, glow) = match scene.skin() {
        None => (DVec3::splat(facing * arrives), DVec3::ZERO),
        Some(_) => {
            let wrap = wrap(scene.skin());
            let wrapped = ((DVec3::splat(cosine) + wrap) / (1.0 + wrap)).max(DVec3::ZERO);
            // What a shadow leaves is red first.
            let softened = DVec3::splat(arrives) + (1.0 - arrives) * 0.5 * wrap;
            let thin = found * (1.0 - behind.clamp(0.0, 1.0));
            (wrapped * softened, through(scene.skin()) * thin * (0.35 + 0.65 * (-cosine).max(0.0)))
        }
    };
    let shine = if facing > 0.0 { light.specular * gloss * arrives } else { 0.0 };
    let body = colour * (light.ambient * open + light.diffuse * diffused * (1.0 + 0.3 * (open - 1.0)));
    Some(DVec3::from(light.colour) * (body + glow * open + shine))
}
