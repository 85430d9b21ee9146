//! Stage 2 of a scene by exact rays, in place of the passes that sample.

use super::coordinates::Line;
use super::field::segments;
use super::projection::projected;
use super::surface;
use super::volume::Medium;
use crate::passes::raycast::cap;
use crate::passes::raycast::ray::span;
use crate::passes::{Arrays, MISS, Texels, is_hit};
use crate::scene::{Mode, Scene, SurfaceColour, View};
use rayon::prelude::*;

/// A piece of a ray is halved until the 7-point Gauss rule and the 15-point Gauss-Kronrod rule differ by at most this on it; light is 0..1.
pub const TOLERANCE: f64 = 1e-12;

/// The cost of the exact rays of a picture, and their estimated error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effort {
    /// Estimated error of the rays: the root mean square over the rays of a pass; of several passes, the largest. The unit is that of a channel
    /// (0..1) for pictures and mm for distances of surfaces. The true error may be larger.
    pub estimate: f64,
    /// Number of pieces of rays that were integrated or searched.
    pub pieces: u64,
    pub rays: u64,
}

/// Why stage 2 (raycast) of the scene has no exact reference, and what to set instead. The text follows a colon. None if it has one. Every setting
/// that a ray reads is either used by [`replace`] or named here (tests/unit_pure/ray_keys).
pub fn fault(scene: &Scene) -> Option<String> {
    fault_of(scene).map(str::to_string)
}

fn fault_of(scene: &Scene) -> Option<&'static str> {
    let s = &scene.settings;
    if scene.is_flat() || s.mode == Mode::Cube {
        return Some("the mode casts no ray: set mode to volume, surface, mixed, mip, minip or mean");
    }
    if scene.still().is_some() {
        return Some("a still is a mean of random paths: set still=none");
    }
    if scene.lit_by_volume().is_some() {
        return Some("light.volume takes light from a lattice of cells: set light.volume=none");
    }
    if scene.tolerance().is_some() {
        return Some("ray.tolerance chooses the steps of each pixel: set ray.tolerance=0");
    }
    if s.ray.sliding != 0 {
        return Some("ray.sliding filters samples, at distances of one step: set ray.sliding=0");
    }
    scene.detects_surface().then(|| surface::fault(scene)).flatten()
}

/// Approximate number of segments ([`Segment`](super::Segment)) of all rays of a scene. The time that exact rays take is proportional to it.
pub fn cost(scene: &Scene) -> f64 {
    let rays = scene.ray_size().iter().map(|n| f64::from(*n)).product::<f64>();
    // A ray crosses a face of a cell on each axis about once a texel.
    let across = (scene.high - scene.low).length();
    let pitch = scene.grid.pitch[0].min(scene.grid.pitch[1]);
    rays * 2.0 * across / pitch
}

/// Computes the outputs `writes` of a pass of stage 2 (raycast) by exact rays, in place of the pass's own reference, and adds the cost to `effort`.
/// Returns false, with `writes` unchanged, if the pass casts no ray through the volume.
pub fn replace(scene: &Scene, pass: &str, reads: &Arrays, writes: &mut Arrays, effort: &mut Effort) -> bool {
    match pass {
        "raycast_volume" => {
            let surface = &scene.settings.surface;
            let is_behind = scene.settings.mode == Mode::Surface && surface.colour == SurfaceColour::Behind;
            // With adaptive supersampling, first one ray through the middle of each pixel.
            let apart = if scene.adapts_rays() { f64::from(scene.settings.ray.rays) } else { 1.0 };
            volume(scene, reads, writes, effort, is_behind, &|at| Some(middle(at, apart)));
        }
        "raycast_refined" => {
            let (marks, rays) = (reads.get("marks"), scene.settings.ray.rays as usize);
            let is_marked = |[x, y]: [usize; 2]| marks.one(x / rays, y / rays, 0) != 0.0;
            volume(scene, reads, writes, effort, false, &|at| is_marked(at).then(|| middle(at, 1.0)));
        }
        "raycast_surface_and_volume" => {
            surfaces(scene, reads, writes, effort);
            volume(scene, reads, writes, effort, false, &|at| Some(middle(at, 1.0)));
        }
        "raycast_projection" => projection(scene, reads, writes, effort),
        "raycast_surface" => surfaces(scene, reads, writes, effort),
        _ => return false,
    }
    true
}

/// Where the ray of a texel goes through the picture, rays from its corner; `apart`: rays between two texels.
fn middle([x, y]: [usize; 2], apart: f64) -> [f64; 2] {
    [x, y].map(|n| (n as f64 + 0.5) * apart)
}

/// Calls `each` with the texel, the line of its ray through a place of the picture, its path and the distance of its beginning, mm, in
/// parallel. A line begins where its ray enters the region of the view. Texels without a place have no ray.
fn for_each_ray<T: Send>(
    scene: &Scene,
    view: View,
    size: [usize; 3],
    place: &(dyn Fn([usize; 2]) -> Option<[f64; 2]> + Sync),
    each: impl Fn([usize; 2], &Line, f64, f64) -> T + Sync,
) -> Vec<([usize; 3], T)> {
    let [width, height, _] = size;
    let one = |n: usize| {
        let at = [n % width, n / width];
        let [x, y] = place(at)?;
        let (origin, direction) = scene.rays.at(x, y);
        let (enter, leave) = span(scene, view, origin, direction);
        let line = Line { scene, base: origin + direction * enter, direction };
        Some(([at[0], at[1], 0], each(at, &line, leave - enter, enter)))
    };
    (0..width * height).into_par_iter().with_min_len(8).filter_map(one).collect()
}

impl Effort {
    /// Adds the rays of a pass: the estimated error of each and its parts.
    fn add(&mut self, rays: impl ExactSizeIterator<Item = (f64, u64)>) {
        let count = rays.len();
        let (squares, pieces) = rays.fold((0.0, 0), |(sum, all), (error, pieces)| (sum + error * error, all + pieces));
        self.estimate = self.estimate.max((squares / count.max(1) as f64).sqrt());
        self.pieces += pieces;
        self.rays += count as u64;
    }
}

/// `is_behind`: only what lies behind the surface is composited. `place`: where the ray of a texel goes through the picture.
fn volume(
    scene: &Scene,
    reads: &Arrays,
    writes: &mut Arrays,
    effort: &mut Effort,
    is_behind: bool,
    place: &(dyn Fn([usize; 2]) -> Option<[f64; 2]> + Sync),
) {
    let texels = reads.get("volume");
    let view = scene.volume_view();
    let size = writes.get("picture").size;
    let surface = &scene.settings.surface;
    let map: Option<&Texels> = (scene.settings.mode == Mode::Mixed || is_behind).then(|| reads.get("distance_map"));
    let lights = for_each_ray(scene, view, size, place, |[x, y], line, path, enter| {
        let cut = cap::cut_at(scene, reads, x, y);
        let ends = match map.map(|map| map.one(x, y, 0) - enter) {
            _ if cut.is_some_and(|cut| cut.ends_ray()) => [0.0, 0.0],
            None => [0.0, path],
            Some(found) if is_behind => [found.max(0.0), path.min(found + surface.colour_depth)],
            Some(found) => [0.0, path.min(found)],
        };
        let segments = segments(line, texels, view.window, ends);
        let mut light = Medium::of(scene, line, TOLERANCE).light(&segments);
        let hit = match cut.filter(|cut| cut.ends_ray()) {
            Some(_) if path > 0.0 => enter,
            Some(_) => MISS,
            None => light.hit.map_or(MISS, |s| enter + s),
        };
        // What is lit later is lit without its face.
        if let Some(cut) = cut.filter(|_| !scene.lights_volume()) {
            light.rgba = cut.over(light.rgba);
        }
        (light, hit)
    });
    effort.add(lights.iter().map(|(_, (light, _))| (light.estimate, light.pieces)));
    for (at, (light, hit)) in lights {
        writes.get_mut("picture").set(at, &light.rgba);
        if scene.lights_volume() {
            writes.get_mut("hit_distance").set(at, &[hit]);
        }
    }
}

fn projection(scene: &Scene, reads: &Arrays, writes: &mut Arrays, effort: &mut Effort) {
    let texels = reads.get("volume");
    let view = scene.projection_view();
    let picture = writes.get_mut("picture");
    let values = for_each_ray(scene, view, picture.size, &|at| Some(middle(at, 1.0)), |_, line, path, _| {
        let segments = segments(line, texels, view.window, [0.0, path]);
        let off = segments.iter().map(|s| s.off).fold(0.0, f64::max);
        (projected(&segments, scene.settings.mode), segments.len() as u64, off)
    });
    effort.add(values.iter().map(|(_, (_, pieces, off))| (*off, *pieces)));
    for (at, (value, ..)) in values {
        picture.set(at, &value.map_or([0.0; 4], |v| [v, v, v, 1.0]));
    }
}

fn surfaces(scene: &Scene, reads: &Arrays, writes: &mut Arrays, effort: &mut Effort) {
    let texels = reads.get("volume");
    let size = writes.get("distance_map").size;
    let view = scene.surface_view();
    let found = for_each_ray(scene, view, size, &|at| Some(middle(at, 1.0)), |[x, y], line, path, enter| {
        if cap::cut_at(scene, reads, x, y).is_some() {
            return ((path > 0.0).then_some((enter, [0.0; 4], 0.0)), 0);
        }
        let mut pieces = 0;
        let found = if path > 0.0 { surface::surface(line, texels, path, enter, &mut pieces) } else { None };
        (found.map(|f| (enter + f.place, [f.echo, 1.0, f.behind, 0.0], f.off)), pieces)
    });
    effort.add(found.iter().map(|(_, (found, pieces))| (found.map_or(0.0, |f| f.2), *pieces)));
    for (at, (found, _)) in found {
        let (distance, surface) = found.map(|f| (f.0, f.1)).filter(|f| is_hit(f.0)).unwrap_or((MISS, [0.0; 4]));
        writes.get_mut("distance_map").set(at, &[distance]);
        if scene.lights_by_echo() {
            let map = writes.get_mut("surface");
            map.set(at, &surface[..map.channels]);
        }
    }
}
