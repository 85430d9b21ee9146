//! SR: the first surface on each ray (thesis 4-3). At sample i, with steps of s, the difference is
//! D = mean(v[i], v[i-s], v[i-2s], v[i-3s]) - mean(v[i-4s] ... v[i-7s]): (2/n) (newer half - older half) for a ring of n = 8.

use super::ray;
use crate::passes::*;
use crate::scene::{Place, RING, Scene, Sign};

pub const PASS: Pass = Pass {
    name: "raycast_surface",
    stage: Stage::Raycast,
    when: When::Picture,
    shader: |s, _| ray::variant!(s, "raycast/surface"),
    needed: |s| if s.detects_surface() { Ok("the mode shows a surface") } else { Err("no surface in this mode") },
    reads: |s, _| ray::reads(s),
    writes: |_, _| vec![whole("distance_map", Slot::Distance), whole("surface", Slot::Surface)],
    extent: ray_extent,
    repeat: once,
    params: |s, _| {
        let surface = &s.settings.surface;
        ray::params(s, s.window())
            .f32("threshold", surface.threshold)
            .f32("rough_threshold", surface.rough_threshold.unwrap_or(surface.threshold))
            .f32("polarity", polarity(s))
    },
    constants: |s, _| {
        let mut constants = ray::constants(s);
        constants.push(("ROUGH", s.settings.surface.rough as i32));
        constants.push(("PEAK", (s.settings.surface.place == Place::Peak) as i32));
        constants.push(("NUMBER", s.settings.surface.number as i32));
        constants.push(("BEHIND", s.samples_behind() as i32));
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
                let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
                let (enter, leave) = ray::span(scene, origin, direction);
                let count = ((leave - enter) / scene.step).max(0.0).floor() as i64;
                // Half a rough ring before the region, and behind it that and a ring to follow an edge to its peak.
                let half = i64::from(RING / 2 * scene.settings.surface.rough);
                let first = (-half).max((-enter / scene.step - 0.5).ceil() as i64);
                let end = if count > 0 { count + half + i64::from(RING) } else { first };
                let at = |i: i64| enter + (i as f64 + 0.5) * scene.step;
                let samples: Vec<Option<f64>> =
                    (first..end).map(|i| ray::sample(scene, volume, origin + direction * at(i))).collect();
                let within = |place: f64| (0.0..=leave - enter).contains(&((place + 0.5) * scene.step));
                let found = detect(scene, &samples, first).map(|(place, echo)| (place + first as f64, echo));
                let (distance, surface) = match found.filter(|(place, _)| within(*place)) {
                    Some((place, echo)) => {
                        let distance = enter + (place + 0.5) * scene.step;
                        (distance, [echo, 1.0, behind(scene, volume, origin, direction, distance), 0.0])
                    }
                    None => (MISS, [0.0; 4]),
                };
                writes.get_mut("distance_map").set([x, y, 0], &[distance]);
                let map = writes.get_mut("surface");
                map.set([x, y, 0], &surface[..map.channels]);
            }
        }
    },
};

/// Mean echo over the samples that the skin look wants, one step after the other behind the surface.
fn behind(scene: &Scene, volume: &Texels, origin: DVec3, direction: DVec3, distance: f64) -> f64 {
    let count = scene.samples_behind();
    let at = |i: u32| origin + direction * (distance + f64::from(i) * scene.step);
    let sum: f64 = (1..=count).filter_map(|i| ray::sample(scene, volume, at(i))).sum();
    sum / f64::from(count.max(1))
}

fn polarity(scene: &Scene) -> f64 {
    match scene.settings.surface.sign {
        Sign::Bright => 1.0,
        Sign::Dark => -1.0,
    }
}

/// Place of the surface in samples, and the echo behind it. Sample n is the ray's sample `first + n`; the region begins at its
/// sample 0, and half a ring later an edge in its middle may be a surface.
fn detect(scene: &Scene, samples: &[Option<f64>], first: i64) -> Option<(f64, f64)> {
    let surface = &scene.settings.surface;
    let ring = RING as usize;
    let rough = surface.rough as usize;
    let rough_threshold = surface.rough_threshold.unwrap_or(surface.threshold);
    let mean = |i: usize, stride: usize, from: usize| -> Option<f64> {
        (from..from + ring / 2).map(|n| samples[i - n * stride]).sum::<Option<f64>>().map(|sum| sum / (ring / 2) as f64)
    };
    // The difference at i, once a full ring since `since` is behind it and none of it lies outside.
    let difference = |i: usize, stride: usize, since: usize| -> Option<f64> {
        (i < samples.len() && i >= since + (ring - 1) * stride)
            .then(|| Some(polarity(scene) * (mean(i, stride, 0)? - mean(i, stride, ring / 2)?)))
            .flatten()
    };
    // Above the threshold here and not just before: an edge that was there before the region began is none of its surfaces.
    let crossing = |i: usize, since: usize| -> Option<f64> {
        let inside = i as i64 + first >= i64::from(RING / 2);
        let rises =
            i == since + ring - 1 || difference(i.wrapping_sub(1), 1, since).is_none_or(|d| d <= surface.threshold);
        difference(i, 1, since).filter(|d| inside && rises && *d > surface.threshold)
    };
    let mut since = 0;
    let mut i = 0;
    let mut seen = 0;
    'rough: while i < samples.len() {
        if samples[i].is_none() {
            i += rough;
            since = i;
            continue;
        }
        let (start, limit) = if rough > 1 {
            match difference(i, rough, since) {
                Some(d) if d > rough_threshold => (i.saturating_sub(ring * rough).max(since), i + ring),
                _ => {
                    i += rough;
                    continue;
                }
            }
        } else {
            (since, usize::MAX)
        };
        // The fine search: forwards from where the rough ring began. A gap sends it back to the rough one behind the gap.
        let mut from = start;
        let mut at = start;
        loop {
            if at >= samples.len() {
                return None;
            }
            if samples[at].is_none() {
                if rough > 1 {
                    i = at + rough;
                    since = i;
                    continue 'rough;
                }
                from = at + 1;
            } else if let Some(d) = crossing(at, from) {
                seen += 1;
                if seen == surface.number {
                    return place(scene, &difference, &|i| mean(i, 1, 0), at, d, from);
                }
                // The next surface is looked for behind this one, if the ray stays inside until then.
                let beyond = at + ring;
                if !(at..=beyond).all(|n| samples.get(n).is_some_and(|s| s.is_some())) {
                    return None;
                }
                (i, since) = (beyond, beyond);
                continue 'rough;
            } else if at >= limit {
                i = limit - (ring - 2) * rough;
                since = i;
                continue 'rough;
            }
            at += 1;
        }
    }
    None
}

/// The largest difference within the ring's length after the crossing, refined by a parabola through its neighbours, minus
/// half a ring: the middle of the edge. Or the crossing itself.
fn place(
    scene: &Scene,
    difference: &dyn Fn(usize, usize, usize) -> Option<f64>,
    echo: &dyn Fn(usize) -> Option<f64>,
    crossing: usize,
    crossing_difference: f64,
    since: usize,
) -> Option<(f64, f64)> {
    if scene.settings.surface.place == Place::FirstCrossing {
        return Some((crossing as f64, echo(crossing)?));
    }
    let (mut best, mut best_at) = (crossing_difference, crossing);
    for i in crossing + 1..crossing + RING as usize {
        match difference(i, 1, since) {
            Some(d) if d > best => (best, best_at) = (d, i),
            Some(_) => {}
            None => break,
        }
    }
    let before = difference(best_at - 1, 1, since).unwrap_or(best);
    // Without the sample after it, it may not be the peak: the ray left the insonified region on a rising edge.
    let after = difference(best_at + 1, 1, since)?;
    let bend = before - 2.0 * best + after;
    // Two equal differences put it in the middle between them.
    let shift = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some((best_at as f64 + shift - (f64::from(RING) - 1.0) / 2.0, echo(best_at)?))
}
