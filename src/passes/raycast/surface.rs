//! SR: the first surface on each ray (thesis 4-3), as the detector of `detector.rs` finds it.

use super::detector::{detect, polarity};
use super::ray;
use crate::passes::empty_space;
use crate::passes::pass::*;
use crate::scene::{Detector, Place, Scene};

pub const PASS: Pass = Pass {
    name: "raycast_surface",
    stage: Stage::Raycast,
    frequency: Frequency::Picture,
    link: Link::None,
    shader: |s, _| ray::variant!(s, "raycast/surface"),
    needed: |s| if s.detects_surface() { Ok("the mode shows a surface") } else { Err("no surface in this mode") },
    reads: |s, _| ray::marching_reads(s, empty_space::surface_skipping(s)),
    writes: |s, _| {
        let mut writes = vec![whole("distance_map", Slot::Distance)];
        writes.extend(s.lights_by_echo().then_some(whole("surface", Slot::Surface)));
        writes
    },
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        let surface = &s.settings.surface;
        ray::params(s, s.surface_view(), s.ring.step)
            .f32("threshold", surface.threshold)
            .f32("rough_threshold", surface.rough_threshold.unwrap_or(surface.threshold))
            .f32("polarity", polarity(s))
            .f32("noise", surface.noise)
            .f32("quiet_level", empty_space::quiet_level(s))
            .f32("behind_step", s.step_behind())
    },
    constants: |s, _| {
        let mut constants = ray::marching_constants(s, empty_space::surface_skipping(s));
        let detector = match s.settings.surface.detector {
            Detector::Threshold => 0,
            Detector::Adaptive => 1,
            Detector::Lasting => 2,
        };
        constants.push(("ROUGH", s.settings.surface.rough as i32));
        let place = match s.settings.surface.place {
            Place::FirstCrossing => 0,
            Place::Peak => 1,
            Place::Middle => 2,
        };
        constants.push(("PLACE", place));
        constants.push(("HALF", s.ring.half as i32));
        constants.push(("FOLLOW_LENGTH", s.ring.follow as i32));
        constants.push(("NUMBER", s.settings.surface.number as i32));
        constants.push(("DETECTOR", detector));
        constants.push(("BEHIND", s.samples_behind() as i32));
        constants.push(("ECHO", s.lights_by_echo() as i32));
        constants
    },
    tolerance: Tolerance {
        absolute: 2e-3,
        relative: 1e-5,
        outliers: 2e-2,
        why: "a parabola through three differences that are off by 1e-6 moves by 1e-3 of a step; a difference within that of \
              the threshold, two equal peaks, or a sample at the border of the sector may go either way and move the place",
    },
    reference: |scene, _, reads, writes| {
        let volume = reads.get("volume");
        let size = writes.get("distance_map").size;
        for y in 0..size[1] {
            for x in 0..size[0] {
                let ray = ray::Ray::cast(scene, volume, scene.surface_view(), scene.ring.step, x, y);
                let count = ray.steps_to(ray.path().max(0.0)).floor() as i64;
                // Half a rough ring before the region, and behind it that and a ring to follow an edge to its peak.
                let half = i64::from(scene.ring.half * scene.settings.surface.rough);
                let first = (-half).max((ray.steps_to(-ray.enter) - 0.5).ceil() as i64);
                let end = if count > 0 { count + half + i64::from(scene.ring.samples()) } else { first };
                let samples: Vec<Option<f64>> =
                    (first..end).map(|i| i as f64 + 0.5).map(|n| ray.sample(ray.offset(n), n)).collect();
                let within = |place: f64| (0.0..=ray.path()).contains(&ray.offset(place + 0.5));
                let found = detect(scene, &samples, first).map(|(place, echo)| (place + first as f64, echo));
                let (distance, surface) = match found.filter(|(place, _)| within(*place)) {
                    Some((place, echo)) => {
                        let distance = ray.enter + ray.offset(place + 0.5);
                        (distance, [echo, 1.0, behind(scene, &ray, distance), 0.0])
                    }
                    None => (MISS, [0.0; 4]),
                };
                writes.get_mut("distance_map").set([x, y, 0], &[distance]);
                if scene.lights_by_echo() {
                    let map = writes.get_mut("surface");
                    map.set([x, y, 0], &surface[..map.channels]);
                }
            }
        }
    },
};

/// Mean echo over the depth behind the surface that skin shading needs.
fn behind(scene: &Scene, ray: &ray::Ray, distance: f64) -> f64 {
    let count = scene.samples_behind();
    let sum: f64 = (1..=count).filter_map(|i| ray.echo(distance + f64::from(i) * scene.step_behind())).sum();
    sum / f64::from(count.max(1))
}
