//! Blinn-Phong (thesis 4-4..4-7) with a directional or point light, with shadow, occlusion and the look of skin where requested.

use super::{camera_params, light_at, normal, occlusion, shadow, to_light};
use crate::passes::pass::*;
use crate::scene::{Mode, Scene, Skin};
use glam::DVec3;

pub const PASS: Pass = Pass {
    name: "light",
    stage: Stage::Shade,
    frequency: Frequency::Picture,
    link: Link::Observer(Chain::Distances),
    shader: |s, _| {
        let arrives = (shadow::is_cast(s), occlusion::is_asked(s));
        match (lit_thing(s), arrives) {
            (Lit::Surface, (false, false)) => "shade/light.plain",
            (Lit::Surface, (true, false)) => "shade/light.shadowed",
            (Lit::Surface, (false, true)) => "shade/light.occluded",
            (Lit::Surface, (true, true)) => "shade/light.shadowed_occluded",
            (Lit::BehindLayer, (false, false)) => "shade/light.behind_layer_plain",
            (Lit::BehindLayer, (true, false)) => "shade/light.behind_layer_shadowed",
            (Lit::BehindLayer, (false, true)) => "shade/light.behind_layer_occluded",
            (Lit::BehindLayer, (true, true)) => "shade/light.behind_layer_shadowed_occluded",
            (Lit::Composited, (false, false)) => "shade/light.composited_plain",
            (Lit::Composited, (true, false)) => "shade/light.composited_shadowed",
            (Lit::Composited, (false, true)) => "shade/light.composited_occluded",
            (Lit::Composited, (true, true)) => "shade/light.composited_shadowed_occluded",
        }
    },
    needed: |s| match (s.has_distance(), s.lights_volume()) {
        (true, false) => Ok("a surface is lit"),
        (true, true) => Ok("the volume is lit where rays hit it first"),
        (false, _) => Err("no surface in this mode"),
    },
    reads: |s, t| {
        let mut reads = vec![whole("distance_map", t.source())];
        reads.extend((lit_thing(s) != Lit::Composited).then_some(whole("surface", Slot::Surface)));
        reads.extend((lit_thing(s) != Lit::Surface).then_some(whole("volume_layer", Slot::VolumeLayer)));
        reads.extend(shadow::is_cast(s).then_some(whole("shadow", Slot::Shadow)));
        reads.extend(occlusion::is_asked(s).then_some(whole("occlusion", Slot::Occlusion)));
        reads
    },
    writes: |s, _| vec![whole("picture", rendered(s))],
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
            .f32("layer_share", s.settings.volume.veil)
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
                let light = lit(scene, reads, x, y);
                picture.set([x, y, 0], &shown(scene, reads, light, x, y));
            }
        }
    },
};

#[derive(PartialEq)]
enum Lit {
    Surface,
    /// A surface behind a composited volume.
    BehindLayer,
    /// The volume itself, where rays hit it first.
    Composited,
}

fn lit_thing(scene: &Scene) -> Lit {
    match (scene.lights_volume(), scene.settings.mode) {
        (true, _) => Lit::Composited,
        (false, Mode::Mixed) => Lit::BehindLayer,
        (false, _) => Lit::Surface,
    }
}

/// The colour of a pixel: its light (body and highlight), with the composited volume in front of it or lit by it.
fn shown(scene: &Scene, reads: &Arrays, light: Option<(DVec3, DVec3)>, x: usize, y: usize) -> [f64; 4] {
    let layer = |share: f64| {
        let layer = reads.get("volume_layer").get([x, y, 0]);
        (DVec3::new(layer[0], layer[1], layer[2]) * share, layer[3] * share)
    };
    let (colour, opacity) = match (lit_thing(scene), light) {
        (Lit::Surface, light) => light.map_or((DVec3::ZERO, 0.0), |(body, highlight)| (body + highlight, 1.0)),
        (Lit::BehindLayer, light) => {
            let (before, opacity) = layer(scene.settings.volume.veil);
            light.map_or((before, opacity), |(body, highlight)| (before + (1.0 - opacity) * (body + highlight), 1.0))
        }
        (Lit::Composited, light) => {
            let (colour, opacity) = layer(1.0);
            match light {
                Some((body, highlight)) => (colour * (1.0 - opacity + opacity * body) + opacity * highlight, opacity),
                None => (colour, opacity),
            }
        }
    };
    [colour.x, colour.y, colour.z, opacity]
}

/// Red wraps furthest: light travels furthest through skin at long wavelengths.
fn wrap(skin: Option<Skin>) -> DVec3 {
    DVec3::new(1.0, 0.55, 0.35) * skin.map_or(0.0, |s| s.wrap)
}

fn through(skin: Option<Skin>) -> DVec3 {
    skin.map_or(DVec3::ZERO, |s| DVec3::from(s.colour) * s.translucency)
}

/// Light from a pixel's surface: from its body, and its highlight.
fn lit(scene: &Scene, reads: &Arrays, x: usize, y: usize) -> Option<(DVec3, DVec3)> {
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
    let (colour, found, behind) = match lit_thing(scene) {
        Lit::Composited => (DVec3::ONE, 1.0, 1.0),
        _ => {
            let surface = reads.get("surface").get([x, y, 0]);
            let (echo, found, behind) = (surface[0], surface[1], surface.get(2).copied().unwrap_or(0.0));
            (DVec3::from(light.surface_colour) * (1.0 + (echo - 1.0) * light.texture * found), found, behind)
        }
    };

    let arrives = light.shadow.map_or(1.0, |s| match shadow::is_cast(scene) {
        true => 1.0 - s.strength * (1.0 - reads.get("shadow").one(x, y, 0)),
        false => 1.0,
    });
    let open = if occlusion::is_asked(scene) { reads.get("occlusion").one(x, y, 0) } else { 1.0 };
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
    let colour = DVec3::from(light.colour);
    Some((colour * (body + glow * open), colour * shine))
}
