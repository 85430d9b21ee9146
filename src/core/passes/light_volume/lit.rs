//! The light volume as the passes see it that take the light of samples from it, and the film that the light falls on.

use super::{clamped, light_of};
use crate::passes::pass::*;
use crate::scene::{Ground, LightLattice, Mode, Scene};
use glam::DVec3;

/// Reciprocal, 1/mm, of the length over which matter fades towards the faces of the region; 0 without a fade.
pub(in crate::passes) fn fade_density(scene: &Scene) -> f64 {
    scene.region_fade().map_or(0.0, |fade| 1.0 / fade)
}

/// The slots of the light volume that a pass that composites reads. Empty if the scene has no light volume.
pub(in crate::passes) fn reads(scene: &Scene) -> Vec<Bind> {
    let filtered = scene.filters_in_hardware();
    if scene.lit_by_volume().is_none() {
        return Vec::new();
    }
    [("light_shade", Slot::LightShade), ("light_normals", Slot::LightNormals)]
        .map(|(name, slot)| Bind { filtered, ..whole(name, slot) })
        .to_vec()
}

/// Adds the parameters of the light volume to those of a pass that composites.
pub(in crate::passes) fn params(scene: &Scene, params: Params) -> Params {
    let light = &scene.settings.light;
    let volume = light_of(scene);
    let ground = volume.ground.unwrap_or_default();
    let (low, density) = match scene.lit_by_volume() {
        Some(_) => (scene.light_lattice().low, 1.0 / scene.light_lattice().cell),
        None => (scene.local_origin(), 0.0),
    };
    params
        .f32("fade_density", fade_density(scene))
        .vec3("light_low", scene.to_local(low))
        .f32("light_density", density)
        .vec3("light_towards", scene.light_direction(light.direction))
        .vec3("light_colour", light.colour)
        .f32("specular", light.specular)
        .f32("shininess", light.shininess)
        .f32("exposure", volume.exposure)
        .vec3("ground_middle", ground.middle)
        .vec3("ground_edge", ground.edge)
}

/// Specialization constants for a pass that composites. `is_alone`: its output is the whole picture, so that the ground (the backdrop) is drawn.
pub(in crate::passes) fn constants(scene: &Scene, is_alone: bool) -> [(&'static str, i32); 4] {
    [
        ("FADE", scene.region_fade().is_some() as i32),
        ("LIT", scene.lit_by_volume().is_some() as i32),
        ("LIT_STEPS", scene.lit_steps() as i32),
        ("GROUND", ground_of(scene, is_alone).is_some() as i32),
    ]
}

fn ground_of(scene: &Scene, is_alone: bool) -> Option<Ground> {
    scene.lit_by_volume().filter(|_| is_alone)?.ground
}

/// Applies the response curve (`light.volume.exposure`) to the composited light of a ray, premultiplied; if `is_alone`, also composites it over the
/// backdrop. `at`: position in the picture, in rays from its upper left corner. Without a light volume the light is unchanged.
pub(in crate::passes) fn developed(scene: &Scene, is_alone: bool, rgba: [f64; 4], at: [f64; 2]) -> [f64; 4] {
    match scene.lit_by_volume() {
        Some(volume) => on_film(scene, volume.exposure, ground_of(scene, is_alone), rgba, at),
        None => rgba,
    }
}

/// Colour of the backdrop (`light.volume.ground`), after the response curve, where a ray meets no matter. `at`: position in the picture, in rays
/// from its upper left corner. None if the scene draws no backdrop.
pub fn bare_ground(scene: &Scene, at: [f64; 2]) -> Option<[f64; 3]> {
    let is_alone = scene.settings.mode == Mode::Volume && !scene.lights_volume() && scene.still().is_none();
    ground_of(scene, is_alone)?;
    let [r, g, b, _] = developed(scene, true, [0.0; 4], at);
    Some([r, g, b])
}

/// Applies the response curve to linear premultiplied light, and composites it over the backdrop if there is one. `at`: position in the picture, in
/// rays from its upper left corner.
pub(in crate::passes) fn on_film(
    scene: &Scene,
    exposure: f64,
    ground: Option<Ground>,
    rgba: [f64; 4],
    at: [f64; 2],
) -> [f64; 4] {
    let film = |light: f64| {
        let c = light * exposure;
        (c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14)).clamp(0.0, 1.0).powf(1.0 / 2.2)
    };
    let opacity = rgba[3];
    let Some(ground) = ground else {
        let shown = |c: usize| if opacity > 0.0 { opacity * film(rgba[c] / opacity) } else { 0.0 };
        return [shown(0), shown(1), shown(2), opacity];
    };
    let size = scene.ray_size().map(f64::from);
    let edge = size[0].min(size[1]);
    let [right, down] = [0, 1].map(|a| (at[a] - size[a] / 2.0) / edge + if a == 1 { 0.05 } else { 0.0 });
    let share = (1.0 - 2.6 * (right * right + down * down)).clamp(0.0, 1.0);
    let shown =
        |c: usize| film(rgba[c] + (1.0 - opacity) * (ground.edge[c] + (ground.middle[c] - ground.edge[c]) * share));
    [shown(0), shown(1), shown(2), 1.0]
}

/// The light volume, sampled by the references of passes that composite.
pub(in crate::passes) struct Lit<'a> {
    shade: &'a Texels,
    normals: &'a Texels,
    lattice: LightLattice,
    towards: DVec3,
}

/// Share of the ambient light that a grazing view adds: SHEEN of lit.glsl.
const SHEEN: f64 = 0.3;

impl<'a> Lit<'a> {
    pub fn new(scene: &Scene, reads: &'a Arrays) -> Option<Lit<'a>> {
        scene.lit_by_volume()?;
        Some(Lit {
            shade: reads.get("light_shade"),
            normals: reads.get("light_normals"),
            lattice: scene.light_lattice(),
            towards: scene.light_direction(scene.settings.light.direction),
        })
    }

    /// At a place, seen along the unit vector `along`: the light that white matter scatters towards the viewer, sheen included, the normal, as long as it is certain, and the fourth channel of the normals.
    fn at(&self, place: DVec3, along: DVec3) -> ([f64; 3], DVec3, f64) {
        let cells = (place - self.lattice.low) / self.lattice.cell - 0.5;
        let at = clamped(cells.to_array(), self.shade);
        let [x, y, z, rest] = self.normals.interpolated(at);
        let (shade, direction) = (self.shade.interpolated(at), DVec3::new(x, y, z));
        let grazing = match direction.length() {
            certain if certain < 1e-4 => 0.0,
            certain => 1.0 - (-direction.dot(along) / certain).max(0.0),
        };
        (std::array::from_fn(|c| shade[c] + shade[3] * SHEEN * grazing.powi(3)), direction, rest)
    }

    /// Light (red, green, blue) that white matter at a place in space, mm, scatters towards the viewer, without a highlight. `along`: unit direction
    /// of the ray.
    pub fn scattered(&self, place: DVec3, along: DVec3) -> [f64; 3] {
        self.at(place, along).0
    }

    /// Light that matter of the colour `albedo` at a place, mm in space, sends towards the viewer, with its highlight. `along`: unit direction of the
    /// ray.
    pub fn light(&self, scene: &Scene, albedo: [f64; 3], place: DVec3, along: DVec3) -> [f64; 3] {
        let (scattered, direction, kept) = self.at(place, along);
        let certain = direction.length();
        if certain < 1e-4 {
            return std::array::from_fn(|c| albedo[c] * scattered[c]);
        }
        let normal = direction / certain;
        let halfway = (self.towards - along).try_normalize().unwrap_or(DVec3::ZERO);
        let gloss = if normal.dot(self.towards) > 0.0 { normal.dot(halfway).max(0.0) } else { 0.0 };
        let light = &scene.settings.light;
        let highlight = light.specular * gloss.powf(light.shininess) * certain * kept;
        std::array::from_fn(|c| albedo[c] * scattered[c] + highlight * light.colour[c])
    }
}
