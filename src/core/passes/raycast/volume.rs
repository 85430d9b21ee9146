//! VR: emission and absorption along each ray, front to back (thesis 4-1, 4-2), with opacity corrected for the step.

use super::cap;
use super::composite::{March, Medium, Place};
use super::{ray, refine};
use crate::passes::empty_space;
use crate::passes::light_volume::{self, Lit};
use crate::passes::pass::*;
use crate::scene::{Compositing, Mode, Scene, Shading, SurfaceColour, self_attenuation};
use glam::DVec3;

pub(crate) const PASS: Pass = Pass {
    name: "raycast_volume",
    shader: |_, _| "raycast/volume",
    needed: |s| match (s.composites(), s.marches_once()) {
        _ if s.still().is_some() => Err("a still is drawn in its place"),
        _ if s.tolerance().is_some() => Err("each pixel has steps of its own"),
        (false, _) => Err("nothing is composited in this mode"),
        (true, Ok(_)) if kind(s) == Kind::Colour => Err("composited in the march that finds the surface"),
        (true, _) => Ok("samples are composited"),
    },
    reads: |s, _| {
        let mut reads = ray::marching_reads(s, empty_space::volume_skipping(s));
        reads.push(match s.settings.volume.compositing {
            Compositing::PreIntegrated => whole("transfer", Slot::PreIntegrated),
            Compositing::Exponential => whole("transfer", Slot::SelfAttenuated),
            Compositing::Riemann | Compositing::Corrected => whole("transfer", Slot::Transfer),
        });
        let needs_distance = matches!(kind(s), Kind::Layer | Kind::Behind);
        reads.extend(light_volume::reads(s));
        reads.extend(cap::reads(s));
        reads.extend(needs_distance.then_some(whole("distance_map", Slot::Distance)));
        reads
    },
    writes: |s, _| match kind(s) {
        Kind::Alone if s.adapts_rays() => vec![whole("picture", Slot::PixelRays)],
        Kind::Alone => vec![whole("picture", rendered(s))],
        Kind::Layer | Kind::Colour | Kind::Behind => vec![whole("picture", Slot::VolumeLayer)],
        Kind::Hit => vec![whole("picture", Slot::VolumeLayer), whole("hit_distance", Slot::Distance)],
    },
    extent: |s, args| match s.adapts_rays() {
        true => rendering_extent(s, args),
        false => ray_extent(s, args),
    },
    params: |s, _| {
        let params = ray::params(s, s.volume_view(), s.step);
        compositing_params(s, params, s.step)
            .f32("hit_opacity", s.settings.volume.hit)
            .f32("colour_depth", s.settings.surface.colour_depth)
    },
    constants: |s, _| {
        let mut constants = ray::marching_constants(s, empty_space::volume_skipping(s));
        constants.extend(compositing_constants(s, kind(s) == Kind::Alone));
        let part = match kind(s) {
            Kind::Alone | Kind::Colour => 0,
            Kind::Layer => 1,
            Kind::Behind => 2,
            Kind::Hit => 3,
        };
        let middle_of = if s.adapts_rays() { s.settings.ray.rays as i32 } else { 1 };
        constants.extend([("PART", part), cap::constant(s), ("MIDDLE_OF", middle_of), ("REFINED", 0)]);
        constants.push(("STEPS_AT_ONCE", if s.is_for_cpu() { s.lit_steps() as i32 } else { 1 }));
        constants
    },
    tolerance: Tolerance::absolute(4e-3).outliers(4e-3).because(
        "places are off by 1e-5 mm in f32, so by as much of a voxel's contrast a sample, and in noise that counts \
         where a threshold makes absorption jump; an early end leaves 1/512; a sample at the very border of the sector \
         may fall on either side",
    ),
    reference: |scene, _, reads, writes| {
        let middle_of = if scene.adapts_rays() { f64::from(scene.settings.ray.rays) } else { 1.0 };
        reference_rays(scene, reads, writes, |x, y| Some(ray::middle_of(x, y).map(|n| n * middle_of)));
    },
    ..Pass::OF_RAYS
};

/// Casts all rays of the pixels that adaptive supersampling has marked.
pub(crate) const REFINED: Pass = Pass {
    name: "raycast_refined",
    needed: |s| refine::need(s, "pixels at edges have several rays"),
    reads: |s, dispatch| [(PASS.reads)(s, dispatch), vec![whole("marks", Slot::EdgeMarks)]].concat(),
    writes: |s, _| vec![whole("picture", rendered(s))],
    extent: ray_extent,
    constants: |s, dispatch| {
        let with = [("MIDDLE_OF", 1), ("REFINED", s.settings.ray.rays as i32)];
        replaced((PASS.constants)(s, dispatch), &["MIDDLE_OF", "REFINED"], with)
    },
    reference: |scene, _, reads, writes| {
        let (marks, rays) = (reads.get("marks"), scene.settings.ray.rays as usize);
        let is_marked = |x: usize, y: usize| marks.one(x / rays, y / rays, 0) != 0.0;
        reference_rays(scene, reads, writes, |x, y| is_marked(x, y).then_some(ray::middle_of(x, y)));
    },
    ..PASS
};

/// What the pass makes of each texel, where its ray goes through the picture, rays from the corner; nothing where it has none.
fn reference_rays(
    scene: &Scene,
    reads: &Arrays,
    writes: &mut Arrays,
    place: impl Fn(usize, usize) -> Option<[f64; 2]>,
) {
    let volume = reads.get("volume");
    let table = reads.get("transfer");
    let tables = Tables { of_steps: table, curve: curve(scene, table), lit: Lit::new(scene, reads) };
    for (x, y) in writes.get("picture").pixels() {
        let Some(at) = place(x, y) else { continue };
        let mut ray = ray::Ray::through(scene, volume, scene.volume_view(), scene.step, at);
        match kind(scene) {
            Kind::Layer => ray.leave = ray.leave.min(reads.get("distance_map").one(x, y, 0)),
            Kind::Behind => {
                let distance = reads.get("distance_map").one(x, y, 0);
                ray.enter = ray.enter.max(distance);
                ray.leave = ray.leave.min(distance + scene.settings.surface.colour_depth);
            }
            Kind::Alone | Kind::Colour | Kind::Hit => {}
        }
        let developed = |light| light_volume::developed(scene, kind(scene) == Kind::Alone, light, at);
        let cut = cap::cut_at(scene, reads, x, y);
        let (colour, hit) = match cut.filter(|cut| cut.ends_ray()) {
            Some(_) => (developed([0.0; 4]), ray.enter_or_miss()),
            None => {
                let (light, hit) = composite(scene, &ray, &tables);
                (developed(light), hit)
            }
        };
        // What is lit later is lit without its face.
        let colour = cut.filter(|_| kind(scene) != Kind::Hit).map_or(colour, |cut| cut.over(colour));
        writes.get_mut("picture").set([x, y, 0], &colour);
        if kind(scene) == Kind::Hit {
            writes.get_mut("hit_distance").set([x, y, 0], &[hit]);
        }
    }
}

/// Adds the parameters of compositing with a step of `step` mm to those of a pass.
pub(super) fn compositing_params(scene: &Scene, params: Params, step: f64) -> Params {
    let volume = &scene.settings.volume;
    let (axis, near) = depth_axis(scene);
    let params = params
        .f32("absorption_scale", step / scene.reference_length())
        .f32("opaque_enough", 1.0 - scene.settings.ray.early_end)
        .vec3("near_tint", volume.near_tint)
        .vec3("far_tint", volume.far_tint)
        .vec3("depth_axis", axis)
        .f32("depth_near", scene.limit_to_local(axis, near));
    light_volume::params(scene, params)
}

/// Specialization constants of compositing. `is_alone`: the composited volume is the whole picture.
pub(super) fn compositing_constants(scene: &Scene, is_alone: bool) -> Vec<(&'static str, i32)> {
    let compositing = match scene.settings.volume.compositing {
        Compositing::Riemann => 0,
        Compositing::Corrected => 1,
        Compositing::PreIntegrated => 2,
        Compositing::Exponential => 3,
    };
    let constants = vec![
        ("EARLY_END", (scene.settings.ray.early_end > 0.0) as i32),
        ("COMPOSITING", compositing),
        ("DEPTH_CODED", (scene.settings.volume.shading == Shading::DepthCoded) as i32),
        ("ENTRIES", scene.transfer_entries() as i32),
    ];
    [constants, light_volume::constants(scene, is_alone).to_vec()].concat()
}

/// Red, green, blue and opacity of the whole ray of pixel (x, y) with a step of `step` mm, through the transfer function.
pub(super) fn composited(scene: &Scene, reads: &Arrays, step: f64, [x, y]: [usize; 2]) -> [f64; 4] {
    let ray = ray::Ray::cast(scene, reads.get("volume"), scene.volume_view(), step, x, y);
    let tables = Tables::of_transfer(scene, reads);
    light_volume::developed(scene, false, composite(scene, &ray, &tables).0, ray::middle_of(x, y))
}

#[derive(PartialEq)]
enum Kind {
    /// The picture.
    Alone,
    /// The volume in front of a surface.
    Layer,
    /// Colours that stage 3 lights, and the distance of the first hit.
    Hit,
    /// Colours of whole rays, for a surface that is found on them.
    Colour,
    /// Colours of what lies behind a surface, for that surface.
    Behind,
}

fn kind(scene: &Scene) -> Kind {
    match (scene.settings.mode, scene.lights_volume()) {
        (Mode::Mixed, _) => Kind::Layer,
        (Mode::Surface, _) if scene.settings.surface.colour == SurfaceColour::Behind => Kind::Behind,
        (Mode::Surface, _) => Kind::Colour,
        (_, true) => Kind::Hit,
        (_, false) => Kind::Alone,
    }
}

/// The length that the transfer function's opacities refer to, mm: one slice pixel, along its shorter edge.
pub fn reference_length(scene: &Scene) -> f64 {
    scene.reference_length()
}

/// What compositing looks up: the transfer function and the light volume.
pub(super) struct Tables<'a> {
    /// The table by which a step is looked up: the transfer function over the sample value or, with `volume.compositing` pre-integrated or
    /// exponential, a table over the sample values at both ends of a step. With `ray.tolerance` it is always the transfer function.
    pub of_steps: &'a Texels,
    /// The transfer function over the sample value, from which an incomplete last step is integrated. Empty unless `volume.compositing` is
    /// exponential.
    pub curve: Vec<[f64; 4]>,
    pub lit: Option<Lit<'a>>,
}

impl<'a> Tables<'a> {
    /// Of a pass whose steps are looked up in the transfer function itself.
    pub(crate) fn of_transfer(scene: &Scene, reads: &'a Arrays) -> Tables<'a> {
        Tables { of_steps: reads.get("transfer"), curve: Vec::new(), lit: Lit::new(scene, reads) }
    }
}

/// The transfer function behind the table of steps, if `volume.compositing` is exponential.
fn curve(scene: &Scene, table: &Texels) -> Vec<[f64; 4]> {
    let is_exponential = scene.settings.volume.compositing == Compositing::Exponential;
    let entries = if is_exponential { scene.transfer_entries() } else { 0 };
    (0..entries).map(|n| entry(table, entries * entries + n)).collect()
}

/// A vector and a number: the vector's dot product with a place, less the number, is the depth along the view, 0 at the box's nearest corner and 1 at
/// its farthest.
pub fn depth_axis(scene: &Scene) -> (DVec3, f64) {
    let forward = scene.rays.forward;
    let low = scene.volume_view().low;
    let middle = (low + scene.high) / 2.0;
    let half = forward.abs().dot((scene.high - low) / 2.0);
    (forward / (2.0 * half), (forward.dot(middle) - half) / (2.0 * half))
}

/// The volume along a ray as a [`Medium`]: through the transfer function and the tints by depth.
pub(super) struct RayMedium<'a> {
    scene: &'a Scene,
    ray: &'a ray::Ray<'a>,
    tables: &'a Tables<'a>,
    /// Of the table, along each side.
    entries: usize,
    depth_axis: (DVec3, f64),
}

impl<'a> RayMedium<'a> {
    pub fn new(scene: &'a Scene, ray: &'a ray::Ray<'a>, tables: &'a Tables<'a>) -> RayMedium<'a> {
        RayMedium { scene, ray, tables, entries: scene.transfer_entries(), depth_axis: depth_axis(scene) }
    }

    /// Under the light and the tints of step n, with the colour of the place at an offset.
    fn tinted(&self, [r, g, b, kappa]: [f64; 4], n: f64, offset: f64) -> [f64; 4] {
        let place = self.ray.place(offset);
        // Steps that share their light are lit in their middle.
        let steps = f64::from(self.scene.lit_steps());
        let middle = ((n / steps).floor() + 0.5) * steps;
        let lit_at = if steps > 1.0 { self.ray.place(self.ray.offset(middle)) } else { place };
        let [r, g, b] = self.tinted_at([r, g, b], place, lit_at);
        [r, g, b, kappa * self.scene.faded(place)]
    }

    /// The colour `rgb` at `place` after the light of the light volume at `lit_at` and the tint by depth.
    pub(crate) fn tinted_at(&self, rgb: [f64; 3], place: DVec3, lit_at: DVec3) -> [f64; 3] {
        let settings = &self.scene.settings.volume;
        let lit = self.tables.lit.as_ref();
        let rgb = lit.map_or(rgb, |lit| lit.light(self.scene, rgb, lit_at, self.ray.direction));
        if settings.shading != Shading::DepthCoded {
            return rgb;
        }
        let (axis, near) = self.depth_axis;
        let depth = (place.dot(axis) - near).clamp(0.0, 1.0);
        let tint = |c: usize| settings.near_tint[c] + (settings.far_tint[c] - settings.near_tint[c]) * depth;
        std::array::from_fn(|c| rgb[c] * tint(c))
    }
}

impl Medium for RayMedium<'_> {
    fn part_inside(&self, step: [f64; 2]) -> Option<[f64; 2]> {
        let is_inside = |offset: f64| self.ray.is_inside(offset);
        match step.map(is_inside) {
            [true, true] => Some(step),
            [false, false] => None,
            [front_inside, _] => {
                // The sector's border, by bisection.
                let [mut low, mut high] = step;
                for _ in 0..40 {
                    let middle = (low + high) / 2.0;
                    *(if is_inside(middle) == front_inside { &mut low } else { &mut high }) = middle;
                }
                Some(if front_inside { [step[0], low] } else { [high, step[1]] })
            }
        }
    }

    fn at(&self, place: Place) -> Option<[f64; 4]> {
        let value = self.ray.sample(place.offset, place.n)?;
        Some(self.tinted(looked_up(self.tables.of_steps, self.entries, value), place.n.floor(), place.offset))
    }

    fn between(&self, from: Place, to: Place) -> Option<[f64; 4]> {
        let (front, back) = (self.ray.sample(from.offset, from.n)?, self.ray.sample(to.offset, to.n)?);
        Some(self.tinted(looked_up_between(self.tables.of_steps, self.entries, front, back), from.n, to.offset))
    }

    fn self_attenuated(&self, from: Place, to: Place, length: f64) -> Option<[f64; 4]> {
        let (front, back) = (self.ray.sample(from.offset, from.n)?, self.ray.sample(to.offset, to.n)?);
        // The table is for complete steps; the last one of a ray may be shorter.
        let is_complete = length >= self.scene.optical_step() * (1.0 - 1e-9);
        let light = match is_complete {
            true => looked_up_between(self.tables.of_steps, self.entries, front, back),
            false => self_attenuation::step(&self.tables.curve, front, back, length),
        };
        Some(self.tinted(light, from.n, to.offset))
    }
}

/// Red, green, blue and opacity of one ray, and the distance at which it has become as opaque as a hit is.
fn composite(scene: &Scene, ray: &ray::Ray, tables: &Tables) -> ([f64; 4], f64) {
    let march = March {
        rule: scene.settings.volume.compositing.into(),
        path: ray.path(),
        reference_length: scene.reference_length(),
        early_end: scene.settings.ray.early_end,
        hit: scene.settings.volume.hit,
    };
    let medium = RayMedium::new(scene, ray, tables);
    let (colour, hit) = march.through(&medium, |n| ray.offset(n));
    (colour, hit.map_or(MISS, |offset| ray.enter + offset))
}

pub(super) fn entry(table: &Texels, n: usize) -> [f64; 4] {
    std::array::from_fn(|c| table.values[4 * n + c])
}

fn between(low: [f64; 4], high: [f64; 4], share: f64) -> [f64; 4] {
    std::array::from_fn(|c| low[c] + (high[c] - low[c]) * share)
}

/// For a table of `entries` equidistant entries: index of the entry before a value in 0..1, and the fraction of the way to the next entry.
pub(super) fn placed(value: f64, entries: usize) -> (usize, f64) {
    let at = value * (entries - 1) as f64;
    let n = (at.floor() as usize).min(entries - 2);
    (n, at - n as f64)
}

pub(super) fn looked_up(table: &Texels, entries: usize, value: f64) -> [f64; 4] {
    let (n, share) = placed(value, entries);
    between(entry(table, n), entry(table, n + 1), share)
}

fn looked_up_between(table: &Texels, entries: usize, front: f64, back: f64) -> [f64; 4] {
    let ((row, down), (column, along)) = (placed(front, entries), placed(back, entries));
    let at = |row: usize| {
        let first = row * entries + column;
        between(entry(table, first), entry(table, first + 1), along)
    };
    between(at(row), at(row + 1), down)
}
