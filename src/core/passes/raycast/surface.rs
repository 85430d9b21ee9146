//! SR: the first surface on each ray (thesis 4-3), as the detector of `detector.rs` finds it.

use super::cap;
use super::detector::{detect, polarity};
use super::ray;
use crate::passes::empty_space;
use crate::passes::pass::*;
use crate::scene::{Detector, Place, Scene};

pub(crate) const PASS: Pass = Pass {
    name: "raycast_surface",
    shader: |_, _| "raycast/surface",
    needed: |s| match (s.detects_surface(), s.marches_once()) {
        (false, _) => Err("no surface in this mode"),
        (true, _) if s.chooses_surface() => Err("chosen among the candidates of neighbouring rays"),
        (true, Ok(_)) => Err("found in the march that composites"),
        (true, Err(_)) => Ok("the mode shows a surface"),
    },
    reads: |s, _| [ray::marching_reads(s, empty_space::surface_skipping(s)), cap::reads(s)].concat(),
    writes: |s, _| writes(s),
    params: |s, _| params(s),
    constants: |s, _| constants(s),
    tolerance: Tolerance::absolute(2e-3).relative(1e-5).outliers(2e-2).because(
        "a parabola through three differences that are off by 1e-6 moves by 1e-3 of a step; a difference within that \
         of the threshold, two equal peaks, or a sample at the border of the sector may go either way and move the \
         place",
    ),
    reference: |scene, _, reads, writes| {
        for (x, y) in writes.get("distance_map").pixels() {
            reference_ray(scene, reads, writes, x, y);
        }
    },
    ..Pass::OF_RAYS
};

/// The slots that the surface detector writes: the distance map, and the echo at the surface where light depends on it.
pub(super) fn writes(scene: &Scene) -> Vec<Bind> {
    [vec![whole("distance_map", Slot::Distance)], whole_if(scene.lights_by_echo(), "surface", Slot::Surface)].concat()
}

/// Parameters of the surface detector and its rays.
pub(super) fn params(scene: &Scene) -> Params {
    let surface = &scene.settings.surface;
    ray::params(scene, scene.surface_view(), scene.ring.step)
        .f32("threshold", surface.threshold)
        .f32("rough_threshold", surface.rough_threshold.unwrap_or(surface.threshold))
        .f32("polarity", polarity(scene))
        .f32("noise", surface.noise)
        .f32("quiet_level", empty_space::quiet_level(scene))
        .f32("behind_step", scene.step_behind())
}

/// Specialization constants of the surface detector and its rays.
pub(super) fn constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let surface = &scene.settings.surface;
    let mut constants = ray::marching_constants(scene, empty_space::surface_skipping(scene));
    let detector = match surface.detector {
        Detector::Threshold | Detector::Consistent => 0,
        Detector::Adaptive => 1,
        Detector::Lasting => 2,
    };
    let place = match surface.place {
        Place::FirstCrossing => 0,
        Place::Peak => 1,
        Place::Middle => 2,
    };
    constants.extend([
        ("ROUGH", surface.rough as i32),
        ("PLACE", place),
        ("HALF", scene.ring.half as i32),
        ("FOLLOW_LENGTH", scene.ring.follow as i32),
        ("NUMBER", surface.number as i32),
        ("DETECTOR", detector),
        ("BEHIND", scene.samples_behind() as i32),
        ("ECHO", scene.lights_by_echo() as i32),
        cap::constant(scene),
    ]);
    constants
}

/// Finds the surface on a pixel's ray and writes its distance, and its echo where the scene stores it. On a ray that ends at a cut face, the face is
/// the surface.
pub(super) fn reference_ray(scene: &Scene, reads: &Arrays, writes: &mut Arrays, x: usize, y: usize) {
    let ray = ray::Ray::cast(scene, reads.get("volume"), scene.surface_view(), scene.ring.step, x, y);
    let count = ray.steps_to(ray.path().max(0.0)).floor() as i64;
    // Half a rough ring before the region, and behind it that and a ring to follow an edge to its peak.
    let half = i64::from(scene.ring.half * scene.settings.surface.rough);
    let first = (-half).max((ray.steps_to(-ray.enter) - 0.5).ceil() as i64);
    let end = if count > 0 { count + half + i64::from(scene.ring.samples()) } else { first };
    let samples: Vec<Option<f64>> =
        (first..end).map(|i| i as f64 + 0.5).map(|n| ray.sample(ray.offset(n), n)).collect();
    let within = |place: f64| (0.0..=ray.path()).contains(&ray.offset(place + 0.5));
    let found = detect(scene, &samples, first).map(|(place, echo)| (place + first as f64, echo));
    let is_capped = cap::cut_at(scene, reads, x, y).is_some();
    let (distance, surface) = match found.filter(|(place, _)| within(*place)) {
        _ if is_capped => (ray.enter_or_miss(), [0.0; 4]),
        Some((place, echo)) => {
            let distance = ray.enter + ray.offset(place + 0.5);
            (distance, [echo, 1.0, behind(scene, &ray, distance), 0.0])
        }
        None => (MISS, [0.0; 4]),
    };
    write(scene, writes, [x, y, 0], distance, surface);
}

/// Writes the surface of a ray: its distance, and `surface` (the echo and what follows it) where the scene stores it.
pub(super) fn write(scene: &Scene, writes: &mut Arrays, at: [usize; 3], distance: f64, surface: [f64; 4]) {
    writes.get_mut("distance_map").set(at, &[distance]);
    if scene.lights_by_echo() {
        let map = writes.get_mut("surface");
        map.set(at, &surface[..map.channels]);
    }
}

/// Mean sample over the depth that skin shading looks behind the surface, which is at `distance` mm along the ray. Samples outside the insonified
/// region count as 0.
pub(super) fn behind(scene: &Scene, ray: &ray::Ray, distance: f64) -> f64 {
    let count = scene.samples_behind();
    let sum: f64 = (1..=count).filter_map(|i| ray.echo(distance + f64::from(i) * scene.step_behind())).sum();
    sum / f64::from(count.max(1))
}
