//! The cut faces of clip planes: the echo of the section, as planes show it, where a ray enters tissue through a clip plane. The rays of
//! surface and volume rendering end there, and nothing lights it.
//!
//! Means over parts of a disc of the face tell tissue from fluid: single grains of speckle neither pierce the face of tissue nor lie in
//! fluid. Where the disc reaches into fluid, the face ends half-way between the disc's darkest and brightest part. That is the middle of the edge,
//! where the surface is, so that the two meet whatever the level is.

use super::ray;
use crate::passes::pass::*;
use crate::scene::cube::HalfSpace;
use crate::scene::{Scene, windowed};
use glam::DVec3;
use std::f64::consts::FRAC_PI_6;

pub(crate) const PASS: Pass = Pass {
    name: "raycast_cap",
    shader: |_, _| "raycast/cap",
    needed: |s| match (s.settings.clip.is_empty(), s.has_caps()) {
        (true, _) => Err("no clip plane cuts"),
        (false, false) => Err("not asked for, or no bright tissue that they cut is drawn"),
        (false, true) => Ok("clip planes have cut faces"),
    },
    reads: |s, _| ray::reads(s),
    writes: |_, _| vec![whole("cap", Slot::Cap)],
    params: |s, _| {
        ray::params(s, s.cap_view(), s.step)
            // Beyond every mean where nothing is capped.
            .f32("level", s.cap_level().unwrap_or(f64::from(f32::MAX)))
            .f32("radius", s.cap_radius())
            .f32("fade_density", s.region_fade().map_or(0.0, |fade| 1.0 / fade))
    },
    constants: |s, _| replaced(ray::constants(s), &["SPREAD"], [("FADE", s.fades_caps() as i32)]),
    tolerance: Tolerance::absolute(1e-3).outliers(1e-2).because(
        "a place is off by 1e-5 mm in f32, so a sample by as much of a voxel's contrast, and the device's filter may \
         round its weights; a place at the very border of the sector or the box, or a mean echo at the level itself, \
         may fall on either side",
    ),
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        writes.get_mut("cap").fill(|x, y| reference_pixel(scene, volume, x, y).unwrap_or([0.0; 2]));
    },
    ..Pass::OF_RAYS
};

/// The slot of cut faces, for passes that end rays there. Empty if the scene has no cut faces.
pub(in crate::passes) fn reads(scene: &Scene) -> Vec<Bind> {
    whole_if(scene.has_caps(), "cap", Slot::Cap)
}

/// The specialization constant that tells a pass whether rays end at cut faces.
pub(in crate::passes) fn constant(scene: &Scene) -> (&'static str, i32) {
    ("CAPPED", scene.has_caps() as i32)
}

/// The cut face that the ray of pixel (x, y) shows. None if it shows none.
pub(crate) fn cut_at(scene: &Scene, reads: &Arrays, x: usize, y: usize) -> Option<Cut> {
    let cut = scene.has_caps().then(|| reads.get("cap").get([x, y, 0]))?;
    (cut[1] > 0.0).then_some(Cut { echo: cut[0], opacity: cut[1] })
}

/// What a ray shows of a cut face, which is where a clip plane cuts tissue: its echo as a grey value, and its opacity, both 0..1.
#[derive(Clone, Copy)]
pub struct Cut {
    echo: f64,
    opacity: f64,
}

impl Cut {
    /// True if the face is opaque, so that the ray ends here.
    pub(crate) fn ends_ray(self) -> bool {
        self.opacity >= 1.0
    }

    /// Composites the cut face over the colour `behind` it. Both are premultiplied.
    pub fn over(self, behind: [f64; 4]) -> [f64; 4] {
        let front = [self.echo, self.echo, self.echo, 1.0];
        std::array::from_fn(|c| self.opacity * front[c] + (1.0 - self.opacity) * behind[c])
    }
}

/// Echo, after the window, and opacity of the cut face; none where the ray has none.
fn reference_pixel(scene: &Scene, volume: &Texels, x: usize, y: usize) -> Option<[f64; 2]> {
    let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
    let level = scene.cap_level()?;
    let view = scene.cap_view();
    let solid: Vec<HalfSpace> = ray::solid(scene, view).collect();
    let (enter, _, face) = ray::entry(solid.iter().copied(), origin, direction)?;
    // A clip plane, and no side of the box.
    let face = face.filter(|face| *face >= ray::SIDES)?;
    let place = origin + direction * enter;
    let is_on_face = |place: &DVec3| solid.iter().enumerate().all(|(i, half)| i == face || half.room(*place) >= 0.0);
    let echo = |place: DVec3| ray::texel(scene, place).map(|at| ray::interpolated(scene, volume, at));
    let own = echo(place)?;
    let [u, v] = axes(solid[face].normal).map(|axis| axis * scene.cap_radius());
    // At a share of the radius, in a direction given in steps of 30 degrees.
    let beside = |share: f64, step: usize| {
        let (sin, cos) = (step as f64 * FRAC_PI_6).sin_cos();
        Some(place + (u * cos + v * sin) * share).filter(is_on_face).and_then(echo)
    };
    let mean = |echoes: &mut dyn Iterator<Item = Option<f64>>| {
        let (sum, count) = echoes.flatten().fold((0.0, 0.0), |(sum, count), echo| (sum + echo, count + 1.0));
        (count > 0.0).then(|| sum / count)
    };
    let middle = mean(&mut (0..6).map(|n| beside(0.5, 2 * n)).chain([Some(own)]))?;
    let parts = (0..6).filter_map(|n| mean(&mut (0..3).map(|i| beside(1.0, 2 * n + 11 + i))));
    let (least, most) = parts.fold((middle, middle), |(least, most), part| (least.min(part), most.max(part)));
    let is_tissue = middle >= level && (least >= level || middle >= (least + most) / 2.0);
    let opacity = if scene.fades_caps() { scene.faded(place) } else { 1.0 };
    is_tissue.then(|| [windowed(view.window, own), opacity])
}

/// Axes of the plane with this unit normal (Duff et al. 2017, Building an orthonormal basis, revisited).
pub(super) fn axes(n: DVec3) -> [DVec3; 2] {
    let side = if n.z < 0.0 { -1.0 } else { 1.0 };
    let scale = -1.0 / (side + n.z);
    let both = n.x * n.y * scale;
    [
        DVec3::new(1.0 + side * n.x * n.x * scale, side * both, -side * n.x),
        DVec3::new(both, side + n.y * n.y * scale, -n.y),
    ]
}
