//! Stage 3: lighting of the distance map, with the shadow and the ambient occlusion that it takes; then camera parameters, positions and
//! normals that its passes share.

use crate::passes::pass::*;
use crate::passes::raycast::cap;
use crate::scene::{Dims, Mode, Scene, Shadow, Skin, SurfaceColour};
use glam::DVec3;

/// Lights the distance map: Blinn-Phong (thesis 4-4..4-7) with a directional or point light, with shadow, occlusion and the look of skin where
/// requested.
pub const LIGHT: Pass = Pass {
    name: "light",
    link: Link::Observer(Chain::Distances),
    shader: |_, _| "shade/light",
    needed: |s| match (s.has_distance(), s.lights_volume()) {
        (true, false) => Ok("a surface is lit"),
        (true, true) => Ok("the volume is lit where rays hit it first"),
        (false, _) => Err("no surface in this mode"),
    },
    reads: |s, t| {
        let mut reads = vec![whole("distance_map", t.source())];
        reads.extend(s.lights_by_echo().then_some(whole("surface", Slot::Surface)));
        reads.extend((lit_thing(s) != Lit::Surface).then_some(whole("volume_layer", Slot::VolumeLayer)));
        reads.extend(casts_shadow(s).then_some(whole("shadow", Slot::Shadow)));
        reads.extend(is_occluded(s).then_some(whole("occlusion", Slot::Occlusion)));
        reads.extend(cap::reads(s));
        reads
    },
    writes: |s, _| vec![whole("picture", rendered(s))],
    params: |s, _| {
        let light = &s.settings.light;
        let [ambient, diffuse] = coefficients(s);
        camera_params(s)
            .vec3("light_at", light_at(s))
            .f32("ambient", ambient)
            .f32("diffuse", diffuse)
            .f32("specular", light.specular)
            .f32("shininess", light.shininess)
            .vec3("light_colour", light.colour)
            .vec3("surface_colour", light.surface_colour)
            .f32("texture_share", light.texture)
            .f32("shadow_strength", light.shadow.map_or(0.0, |s| s.strength))
            .vec3("wrap", skin_wrap(s.skin()))
            .vec3("through", through(s.skin()))
            .f32("layer_share", s.settings.volume.veil)
    },
    constants: |s, _| {
        let light = &s.settings.light;
        let dims_pixel = light.shadow.is_some_and(|shadow| shadow.dims == Dims::Pixel);
        vec![
            ("POINT", light.position.is_some() as i32),
            ("SKIN", s.skin().is_some() as i32),
            ("DIMS_PIXEL", dims_pixel as i32),
            ("AMBIENT_ONLY", keeps_ambient(s) as i32),
            ("ECHO", s.lights_by_echo() as i32),
            ("SUBJECT", lit_thing(s) as i32),
            ("SHADOWED", casts_shadow(s) as i32),
            ("OCCLUDED", is_occluded(s) as i32),
            cap::constant(s),
        ]
    },
    tolerance: Tolerance::absolute(6e-3).relative(6e-3).outliers(5e-3).because(
        "a slope is off by 1e-6 in f32, and a shininess of 1e6 multiplies what that does to a cosine; a neighbour at \
         exactly the cliff's height may count or not",
    ),
    reference: |scene, _, reads, writes| {
        writes.get_mut("picture").fill(|x, y| {
            // Echoes are not lit.
            let cut = cap::cut_at(scene, reads, x, y);
            let behind = match cut.filter(|cut| cut.ends_ray()) {
                Some(_) => [0.0; 4],
                None => reference_pixel(scene, reads, lit(scene, reads, x, y), x, y),
            };
            cut.map_or(behind, |cut| cut.over(behind))
        });
    },
    ..Pass::OF_DISTANCES
};

/// What is lit: the numbers of SUBJECT in light.comp.
#[derive(PartialEq)]
enum Lit {
    Surface = 0,
    /// A surface behind a composited volume.
    BehindLayer = 1,
    /// The volume itself, where rays hit it first.
    Composited = 2,
    /// A surface with the colour that volume rendering gives its ray.
    Coloured = 3,
}

fn lit_thing(scene: &Scene) -> Lit {
    match (scene.lights_volume(), scene.settings.mode) {
        (true, _) => Lit::Composited,
        (false, Mode::Mixed) => Lit::BehindLayer,
        (false, _) if scene.colours_surface() => Lit::Coloured,
        (false, _) => Lit::Surface,
    }
}

/// True if the rendered colour is that of ambient light, which the light does not colour (thesis 4-5).
fn keeps_ambient(scene: &Scene) -> bool {
    lit_thing(scene) == Lit::Coloured && scene.settings.surface.colour == SurfaceColour::Rendered
}

/// The colour of a pixel: its light (body and highlight), with the composited volume in front of it or lit by it.
fn reference_pixel(scene: &Scene, reads: &Arrays, light: Option<(DVec3, DVec3)>, x: usize, y: usize) -> [f64; 4] {
    let layer = |share: f64| {
        let layer = reads.get("volume_layer").get([x, y, 0]);
        (DVec3::new(layer[0], layer[1], layer[2]) * share, layer[3] * share)
    };
    let (colour, opacity) = match (lit_thing(scene), light) {
        (Lit::Surface | Lit::Coloured, light) => {
            light.map_or((DVec3::ZERO, 0.0), |(body, highlight)| (body + highlight, 1.0))
        }
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

/// How far light wraps around the surface in red, green and blue, for the setting `share` (0..1). Red wraps furthest, because long wavelengths travel
/// furthest through skin.
pub(super) fn wrap(share: f64) -> DVec3 {
    DVec3::new(1.0, 0.55, 0.35) * share
}

fn skin_wrap(skin: Option<Skin>) -> DVec3 {
    wrap(skin.map_or(0.0, |s| s.wrap))
}

fn through(skin: Option<Skin>) -> DVec3 {
    skin.map_or(DVec3::ZERO, |s| DVec3::from(s.colour) * s.translucency)
}

/// Ambient and diffuse coefficient of a surface. Those of a light volume are made for its film curve, which takes any brightness. A surface has none, so
/// there they are scaled to where one that faces the light has at most its own colour.
fn coefficients(scene: &Scene) -> [f64; 2] {
    let light = &scene.settings.light;
    let most = light.volume.map_or(1.0, |_| (light.ambient + light.diffuse).max(1.0));
    [light.ambient / most, light.diffuse / most]
}

/// Light from a pixel's surface: from its body, and its highlight.
fn lit(scene: &Scene, reads: &Arrays, x: usize, y: usize) -> Option<(DVec3, DVec3)> {
    let distances = reads.get("distance_map");
    let (place, _) = place(scene, distances, x as i64, y as i64)?;
    let normal = normal(scene, distances, x as i64, y as i64)?;
    let light = &scene.settings.light;
    let (_, along) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let (to_light, _) = to_light(scene, place, normal);
    let cosine = normal.dot(to_light);
    let facing = cosine.max(0.0);
    let halfway = (to_light - along).try_normalize().unwrap_or(DVec3::ZERO);
    let gloss = normal.dot(halfway).max(0.0).powf(light.shininess);
    // Colours of ambient and of diffuse light.
    let (ambient_colour, colour, found, behind) = match lit_thing(scene) {
        Lit::Composited => (DVec3::ONE, DVec3::ONE, 1.0, 1.0),
        lit => {
            let (echo, found, behind) = match scene.lights_by_echo() {
                true => {
                    let surface = reads.get("surface").get([x, y, 0]);
                    (surface[0], surface[1], surface.get(2).copied().unwrap_or(0.0))
                }
                false => (1.0, 1.0, 0.0),
            };
            let texture = 1.0 + (echo - 1.0) * light.texture * found;
            let colour = match lit {
                Lit::Coloured => DVec3::from_slice(&reads.get("volume_layer").get([x, y, 0])[..3]),
                _ => DVec3::from(light.surface_colour),
            };
            let own = if keeps_ambient(scene) { DVec3::splat(texture) } else { colour * texture };
            (colour * texture, own, found, behind)
        }
    };

    let arrives = light.shadow.map_or(1.0, |s| match casts_shadow(scene) {
        true => 1.0 - s.strength * (1.0 - reads.get("shadow").one(x, y, 0)),
        false => 1.0,
    });
    let dims_pixel = light.shadow.is_some_and(|s| s.dims == Dims::Pixel);
    let (arrives, dimmed) = if dims_pixel { (1.0, arrives) } else { (arrives, 1.0) };
    let open = if is_occluded(scene) { reads.get("occlusion").one(x, y, 0) } else { 1.0 };
    let (diffused, glow) = match scene.skin() {
        None => (DVec3::splat(facing * arrives), DVec3::ZERO),
        Some(_) => {
            let wrap = skin_wrap(scene.skin());
            let wrapped = ((DVec3::splat(cosine) + wrap) / (1.0 + wrap)).max(DVec3::ZERO);
            // What a shadow leaves is red first.
            let softened = DVec3::splat(arrives) + (1.0 - arrives) * 0.5 * wrap;
            let thin = found * (1.0 - behind.clamp(0.0, 1.0));
            (wrapped * softened, through(scene.skin()) * thin * (0.35 + 0.65 * (-cosine).max(0.0)))
        }
    };
    let shine = if facing > 0.0 { light.specular * gloss * arrives } else { 0.0 };
    let [ambient, diffuse] = coefficients(scene);
    let ambient = ambient_colour * ambient * open;
    let diffused = colour * diffuse * diffused * (1.0 + 0.3 * (open - 1.0));
    let colour = DVec3::from(light.colour);
    let body = match keeps_ambient(scene) {
        true => ambient + colour * (diffused + glow * open),
        false => colour * (ambient + diffused + glow * open),
    };
    Some((body * dimmed, colour * shine * dimmed))
}

/// Stride of a shadow's samples across the view, pixels.
const STRIDE: f64 = 1.0;

/// The most samples of a shadow, so that a view from close by does not take for ever.
const MOST_STEPS: u32 = 2048;

/// The greatest distance of an obstacle, mm: the setting, or what the rendered box and the assumed thickness of its surface leave.
fn reach(scene: &Scene) -> f64 {
    let shadow = scene.settings.light.shadow.unwrap_or_default();
    shadow.reach.min((scene.high - scene.low).length() + shadow.thickness)
}

/// Stride across the view, mm, and mm per mm of distance.
fn pitch(scene: &Scene) -> [f64; 2] {
    let rays = &scene.rays;
    let smaller = |dx: DVec3, dy: DVec3| STRIDE * dx.length().min(dy.length());
    [smaller(rays.origin_dx, rays.origin_dy), smaller(rays.direction_dx, rays.direction_dy)]
}

/// Stride per mm of distance to the surface, mm, where that is more than a pixel: a third of the width of the shadow's edge there, which no finer
/// obstacle shows in.
fn growth(shadow: Shadow) -> f64 {
    (shadow.softness / 3.0).min(0.1)
}

/// Stride towards the light, mm: a pixel across the view, and at most half of the thickness along it, but no less than a quarter of a pixel.
fn stride(scene: &Scene, distance: f64, to_light: DVec3, along: DVec3) -> f64 {
    let shadow = scene.settings.light.shadow.unwrap_or_default();
    let [own, per_distance] = pitch(scene);
    let (pixel, across) = (own + per_distance * distance, to_light.cross(along).length());
    let behind = (1.0 - across * across).max(0.0).sqrt();
    (pixel / across.max(1e-6)).min(0.5 * shadow.thickness / behind.max(1e-6)).max(0.25 * pixel)
}

/// Computes the shadow by tracing the distance map towards the light (thesis Fig. 41). The map is taken as the front of matter of the depth
/// `light.shadow.thickness`; the light is blocked where the way towards it goes through that matter.
pub const SHADOW: Pass = Pass {
    name: "shadow",
    link: Link::Observer(Chain::Distances),
    shader: |_, _| "shade/shadow",
    needed: |s| need(s, s.settings.light.shadow.map(|shadow| shadow.strength), "a strength of 0 casts none"),
    reads: |_, t| vec![whole("distance_map", t.source())],
    writes: |_, _| vec![whole("shadow", Slot::Shadow)],
    params: |s, _| {
        let shadow = s.settings.light.shadow.unwrap_or_default();
        camera_params(s)
            .vec3("forward", s.rays.forward)
            .vec3("light_at", light_at(s))
            .f32("reach", reach(s))
            .vec2("pitch", pitch(s))
            .f32("thickness", shadow.thickness)
            .f32("bias", shadow.bias)
            .f32("softness", shadow.softness)
            .f32("growth", growth(shadow))
    },
    constants: |s, _| {
        let soft = s.settings.light.shadow.is_some_and(|s| s.softness > 0.0);
        vec![
            ("POINT", s.settings.light.position.is_some() as i32),
            ("PERSPECTIVE", s.rays.is_perspective as i32),
            ("SOFT", soft as i32),
            ("MOST_STEPS", MOST_STEPS as i32),
        ]
    },
    tolerance: Tolerance::absolute(5e-3).outliers(3e-2).because(
        "a place is off by 2e-5 mm in f32, and an edge of softness 0.15 at 0.4 mm makes 3e-4 of that; where the map \
         has a cliff, a thickness or a border, a place may fall on either side and the whole step counts or not",
    ),
    reference: |scene, _, reads, writes| {
        let distances = reads.get("distance_map");
        writes.get_mut("shadow").fill(|x, y| {
            let place = place(scene, distances, x as i64, y as i64);
            [place.map_or(1.0, |(place, distance)| arriving(scene, distances, x, y, place, distance))]
        });
    },
    ..Pass::OF_DISTANCES
};

/// Whether what darkens a surface with this strength is needed; `weak`: why not with a strength of 0.
fn need(scene: &Scene, strength: Option<f64>, weak: &'static str) -> Need {
    match strength {
        _ if !scene.has_distance() => Err("no surface in this mode"),
        None => Err("not asked for"),
        Some(0.0) => Err(weak),
        Some(_) => Ok("asked for"),
    }
}

/// True if the light casts a shadow in this scene.
fn casts_shadow(scene: &Scene) -> bool {
    (SHADOW.needed)(scene).is_ok()
}

/// Share of the light that arrives at a place which pixel (x, y) sees.
fn arriving(scene: &Scene, distances: &Texels, x: usize, y: usize, place: DVec3, distance: f64) -> f64 {
    let shadow = scene.settings.light.shadow.unwrap_or_default();
    let (_, along) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let (direction, far) = to_light(scene, place, -along);
    let stride = stride(scene, distance, direction, along);
    let next = |gone: &f64| Some(gone + stride.max(growth(shadow) * gone));
    let places = std::iter::successors(Some(stride), next).take(MOST_STEPS as usize);
    let mut arrives = 1.0f64;
    for gone in places.take_while(|gone| *gone <= reach(scene).min(far)) {
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
        if depth <= 0.0 {
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
    let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| hit_at(distances, x + dx, y + dy));
    let own = || hit_at(distances, at[0].floor() as i64, at[1].floor() as i64);
    let [Some(a), Some(b), Some(c), Some(d)] = corners else { return own() };
    let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    if high - low > scene.cliff() {
        return own();
    }
    Some((1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d))
}

/// Samples around a pixel.
const OCCLUSION_SAMPLES: u32 = 32;
/// pi (3 - sqrt 5), rad: turning by it never comes back to a direction.
const GOLDEN_ANGLE: f64 = 2.399_963_23;
/// Cosine above the tangent plane that is ignored: the map's own roughness.
const ROUGHNESS: f64 = 0.1;

/// Computes ambient occlusion in image space: surfaces that rise above a pixel's tangent plane nearby occlude ambient light. (Mittring 2007; Bavoil
/// and Sainz 2008.)
pub(crate) const OCCLUSION: Pass = Pass {
    name: "occlusion",
    link: Link::Observer(Chain::Distances),
    shader: |_, _| "shade/occlusion",
    needed: |s| {
        need(s, s.settings.light.occlusion.map(|occlusion| occlusion.strength), "a strength of 0 takes nothing")
    },
    reads: |_, t| vec![whole("distance_map", t.source())],
    writes: |_, _| vec![whole("occlusion", Slot::Occlusion)],
    params: |s, _| {
        let occlusion = s.settings.light.occlusion.unwrap_or_default();
        camera_params(s).f32("radius", occlusion.radius).f32("strength", occlusion.strength)
    },
    tolerance: Tolerance::absolute(4e-3).outliers(3e-2).because(
        "a sum of 32 cosines in f32; a place on the spiral at a pixel's very border may be read from its neighbour, \
         and a neighbour at exactly the cliff's height may tilt the normal or not",
    ),
    reference: |scene, _, reads, writes| {
        let distances = reads.get("distance_map");
        writes.get_mut("occlusion").fill(|x, y| [open(scene, distances, x as i64, y as i64).unwrap_or(1.0)]);
    },
    ..Pass::OF_DISTANCES
};

/// The direction of a sample, x and y: the constants of the shader, which takes no sine itself. The precision of a device's sine is
/// bounded only from -pi to pi, and the last sample's angle is 74 rad.
fn occlusion_direction(sample: u32) -> [f32; 2] {
    let (sin, cos) = (GOLDEN_ANGLE * f64::from(sample)).sin_cos();
    [cos as f32, sin as f32]
}

/// True if ambient occlusion darkens this scene.
fn is_occluded(scene: &Scene) -> bool {
    (OCCLUSION.needed)(scene).is_ok()
}

fn open(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<f64> {
    let settings = scene.settings.light.occlusion.unwrap_or_default();
    let (here, distance) = place(scene, distances, x, y)?;
    let normal = normal(scene, distances, x, y)?;
    let rays = &scene.rays;
    let pixels = settings.radius / (rays.origin_dx + rays.direction_dx * distance).length();
    let mut taken = 0.0;
    for i in 0..OCCLUSION_SAMPLES {
        let share = ((f64::from(i) + 0.5) / f64::from(OCCLUSION_SAMPLES)).sqrt();
        let [cos, sin] = occlusion_direction(i).map(f64::from);
        let tap = |at: i64, along: f64| (at as f64 + 0.5 + pixels * share * along).floor() as i64;
        let Some((there, _)) = place(scene, distances, tap(x, cos), tap(y, sin)) else { continue };
        let far = there.distance(here);
        if far >= 1e-7 * settings.radius {
            let falls = (1.0 - (far / settings.radius).powi(2)).max(0.0);
            taken += (normal.dot(there - here) / far - ROUGHNESS).max(0.0) * falls;
        }
    }
    Some((1.0 - settings.strength * 2.0 * taken / f64::from(OCCLUSION_SAMPLES)).clamp(0.0, 1.0))
}

fn camera_params(scene: &Scene) -> Params {
    ray_params(scene).f32("cliff", scene.cliff())
}

/// Unit direction to a light that is infinitely far away.
fn direction_to_light(scene: &Scene) -> DVec3 {
    scene.light_direction(scene.settings.light.direction)
}

/// Unit direction to a directional light, or the position of a point light as the shaders get it.
fn light_at(scene: &Scene) -> DVec3 {
    scene.light_place().map_or_else(|| direction_to_light(scene), |place| scene.to_local(place))
}

/// Unit direction from a place to the light, and the distance to it; the direction is `otherwise` for a light at that place.
fn to_light(scene: &Scene, place: DVec3, otherwise: DVec3) -> (DVec3, f64) {
    match scene.light_place() {
        Some(light) => ((light - place).try_normalize().unwrap_or(otherwise), light.distance(place)),
        None => (direction_to_light(scene), f64::MAX),
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

/// Unit normal of the surface at a pixel, towards the viewer; None where nothing was hit. No difference is taken across a cliff (another surface). Of
/// the two differences along an axis the steeper one counts less, by weights as in a WENO scheme of second order (Liu, Osher and Chan 1994). If both
/// neighbours along an axis are beyond cliffs, the lower cliff gives the slope where the distance changes the same way across both; otherwise the
/// slope is 0. A miss counts as an infinitely high cliff.
pub fn normal(scene: &Scene, distances: &Texels, x: i64, y: i64) -> Option<DVec3> {
    let (here, distance) = place(scene, distances, x, y)?;
    let slope = |dx: i64, dy: i64, facing: DVec3| {
        // Up to a slope of 45 degrees, the two sides count much alike.
        let alike = facing.length_squared();
        // Rise and displacement over one pixel; nothing is infinitely far.
        let sides = [-1, 1].map(|sign| match place(scene, distances, x + sign * dx, y + sign * dy) {
            Some((there, away)) => ((away - distance) * sign as f64, (there - here) * sign as f64),
            None => (f64::INFINITY * sign as f64, facing),
        });
        let is_smooth = |rise: f64| rise.abs() <= scene.cliff();
        let weights = sides.map(|(rise, _)| if is_smooth(rise) { (alike + rise * rise).powi(-2) } else { 0.0 });
        let [(before, back), (after, on)] = sides;
        match weights[0] + weights[1] {
            0.0 if before.signum() != after.signum() => facing,
            0.0 if before.abs() <= after.abs() => back,
            0.0 => on,
            sum => (back * weights[0] + on * weights[1]) / sum,
        }
    };
    let rays = &scene.rays;
    let sx = slope(1, 0, rays.origin_dx + rays.direction_dx * distance);
    let sy = slope(0, 1, rays.origin_dy + rays.direction_dy * distance);
    let (_, along) = rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let normal = sy.cross(sx).try_normalize().unwrap_or(-along);
    Some(if normal.dot(along) > 0.0 { -normal } else { normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a shader whose directions differ from the reference's.
    #[test]
    fn the_shaders_directions_of_occlusion_are_those_of_the_reference() {
        let source = include_str!("../../../glsl/shade/occlusion.comp");
        let (_, table) = source.split_once("= vec2[](").expect("the table");
        let (table, rest) = table.split_once(");").expect("its end");
        assert!(!rest.contains("sin(") && !rest.contains("cos("), "the shader takes a sine itself");
        let pairs: Vec<[f32; 2]> = table
            .split("vec2(")
            .skip(1)
            .map(|pair| {
                let (pair, _) = pair.split_once(')').expect("a pair");
                let (x, y) = pair.split_once(", ").expect("two numbers");
                [x.parse().expect("a number"), y.parse().expect("a number")]
            })
            .collect();
        assert_eq!(pairs, (0..OCCLUSION_SAMPLES).map(occlusion_direction).collect::<Vec<_>>());
    }
}
