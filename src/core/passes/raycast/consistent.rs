//! The surface as neighbouring rays agree on it. A march keeps two candidates of each ray; paths along rows and columns sum what choices on
//! neighbours cost (semi-global matching: Hirschmueller 2008); the cheapest candidate of each ray is its surface, or none is. An edge is as
//! likely as the mean echo over two lengths of an edge behind it exceeds the mean in front of it, over the detector's memory: that tells walls from noise
//! better than the height of the difference.

use super::cap;
use super::detector::{FOLLOW_LEVEL, Noise, polarity};
use super::ray;
use super::surface;
use crate::passes::empty_space::surface_skipping;
use crate::passes::pass::*;
use crate::scene::Scene;

/// Contrasts in thresholds: at the first an edge has weight 0, so many above it weight 1.
const WEAK: f64 = 1.0;
const SURE: f64 = 3.0;
/// Cost of no surface. A candidate costs 1 less its weight, and the weight of the candidate in front of it.
const MISSING: f64 = 0.5;
/// Price of a border of the surface, or of a jump, and of a mm between the places of neighbours, where rays are 1 mm apart. A candidate is judged by the
/// area of its pixel, a border by its length: so rays twice as close have borders twice as dear.
const JUMP: f64 = 1.2;
const SLOPE: f64 = 0.16;
/// Noise in front of a wall has the wall's contrast: an edge that the next one exceeds by this factor within a ring is a part of that.
const OUTGROWN: f64 = 1.5;
/// Cost of a candidate that a ray does not have.
const ABSENT: f64 = 1e4;

const PATHS_OF: [(&str, Slot); 4] = [
    ("from_left", Slot::PathsFromLeft),
    ("from_right", Slot::PathsFromRight),
    ("from_top", Slot::PathsFromTop),
    ("from_bottom", Slot::PathsFromBottom),
];

fn needed(scene: &Scene) -> Need {
    let why_not = "each ray finds its own surface, or none is shown";
    scene.chooses_surface().then_some("neighbouring rays choose the surface").ok_or(why_not)
}

pub(crate) const CANDIDATES: Pass = Pass {
    name: "raycast_candidates",
    shader: |_, _| "raycast/candidates",
    needed,
    reads: |s, _| ray::marching_reads(s, surface_skipping(s)),
    writes: |_, _| vec![whole("candidates", Slot::Candidates)],
    params: |s, _| {
        let threshold = s.settings.surface.threshold;
        surface::params(s)
            .f32("weak_contrast", WEAK * threshold)
            .f32("weight_density", 1.0 / (SURE * threshold.max(1e-6)))
    },
    constants: |s, _| {
        let detector = vec![("ROUGH", 1), ("PLACE", 1), ("NUMBER", 1), ("DETECTOR", 1)];
        let ring = vec![("HALF", s.ring.half as i32), ("FOLLOW_LENGTH", s.ring.follow as i32)];
        [ray::marching_constants(s, surface_skipping(s)), detector, ring].concat()
    },
    tolerance: Tolerance::absolute(4e-3).relative(1e-5).outliers(2e-2).because(
        "of places, that of raycast_surface; a weight is a contrast, off by 1e-6, over three thresholds; a difference \
         within that of the threshold or of 0.7 of the peak, or two edges of the same weight, may go either way",
    ),
    reference: |scene, _, reads, writes| {
        writes.get_mut("candidates").fill(|x, y| {
            let ray = ray::Ray::cast(scene, reads.get("volume"), scene.surface_view(), scene.ring.step, x, y);
            let [(first, weight), (second, other)] = candidates_of(scene, &ray);
            [first, second, weight, other]
        });
    },
    ..Pass::OF_RAYS
};

pub(crate) const PATHS: Pass = Pass {
    name: "surface_paths",
    shader: |_, _| "raycast/surface_paths",
    reads: |_, _| vec![whole("candidates", Slot::Candidates)],
    writes: |_, t| vec![whole("path", PATHS_OF[t.iteration as usize].1)],
    // A workgroup of 8 x 8 takes 64 lines.
    extent: |s, t| {
        let lines = s.ray_size()[if t.iteration < 2 { 1 } else { 0 }];
        [GROUP * lines.div_ceil(GROUP * GROUP), GROUP, 1]
    },
    repeat: |_| PATHS_OF.len() as u32,
    params: |s, t| {
        let [slope, jump] = prices(s);
        Params::default().i32("way", t.iteration).f32("slope", slope).f32("jump", jump).f32("missing", MISSING)
    },
    constants: no_constants,
    tolerance: Tolerance::absolute(2e-3).relative(1e-5).because(
        "sums of numbers up to 1e4, of which f32 has 1e-3: minima are continuous, and each step takes the least away, \
         so that errors do not add up",
    ),
    reference: |scene, t, reads, writes| {
        let (prices, way) = (prices(scene), t.iteration);
        let candidates = reads.get("candidates");
        let [width, height, _] = candidates.size;
        let (lines, count) = if way < 2 { (height, width) } else { (width, height) };
        for line in 0..lines {
            let mut before: Option<([f64; 3], [f64; 4])> = None;
            for n in 0..count {
                let at = if way % 2 == 0 { n } else { count - 1 - n };
                let pixel = if way < 2 { [at, line, 0] } else { [line, at, 0] };
                let here: [f64; 4] = std::array::from_fn(|c| candidates.get(pixel)[c]);
                let cost = path_cost(here, before, prices);
                writes.get_mut("path").set(pixel, &[cost[0] - cost[2], cost[1] - cost[2]]);
                before = Some((cost, here));
            }
        }
    },
    ..CANDIDATES
};

pub(crate) const CHOICE: Pass = Pass {
    name: "choose_surface",
    shader: |_, _| "raycast/choose_surface",
    reads: |s, _| {
        let mut reads = ray::marching_reads(s, None);
        reads.push(whole("candidates", Slot::Candidates));
        reads.extend(PATHS_OF.map(|(name, slot)| whole(name, slot)));
        reads.extend(cap::reads(s));
        reads
    },
    writes: |s, _| surface::writes(s),
    params: |s, _| ray::params(s, s.surface_view(), s.ring.step).f32("behind_step", s.step_behind()),
    constants: |s, _| {
        let (echo, behind) = (("ECHO", s.lights_by_echo() as i32), ("BEHIND", s.samples_behind() as i32));
        let with = [echo, behind, ("HALF", s.ring.half as i32), cap::constant(s)];
        replaced(ray::marching_constants(s, None), &["SKIP", "SLIDING", "SPREAD"], with)
    },
    tolerance: Tolerance::absolute(2e-3).relative(1e-5).outliers(1e-2).because(
        "a place is copied; costs that differ by less than 1e-5 may choose either; a sample at the border of the \
         sector may be left out of an echo",
    ),
    reference: |scene, _, reads, writes| {
        for (x, y) in writes.get("distance_map").pixels() {
            let more: [f64; 2] =
                std::array::from_fn(|c| PATHS_OF.iter().map(|(name, _)| reads.get(name).get([x, y, 0])[c]).sum());
            let places = reads.get("candidates").get([x, y, 0]);
            let chosen = if more[1] < more[0] { places[1] } else { places[0] };
            let ray = ray::Ray::cast(scene, reads.get("volume"), scene.surface_view(), scene.ring.step, x, y);
            let is_capped = cap::cut_at(scene, reads, x, y).is_some();
            let distance = if more[0].min(more[1]) > 0.0 { MISS } else { chosen };
            let mut echo = [0.0; 4];
            if is_hit(distance) && !is_capped {
                let half = scene.ring.half;
                let at = |n: u32| distance + (f64::from(n) + 0.5) * scene.ring.step;
                let sum: f64 = (0..half).filter_map(|n| ray.echo(at(n))).sum();
                echo = [sum / f64::from(half), 1.0, surface::behind(scene, &ray, distance), 0.0];
            }
            let distance = if is_capped { ray.enter_or_miss() } else { distance };
            surface::write(scene, writes, [x, y, 0], distance, echo);
        }
    },
    ..CANDIDATES
};

/// Price of a mm between places and of a jump, from the distance between rays in the middle of the region.
fn prices(scene: &Scene) -> [f64; 2] {
    let (view, rays) = (scene.surface_view(), &scene.rays);
    let [width, height] = scene.ray_size().map(|n| f64::from(n) / 2.0);
    let (origin, direction) = rays.at(width, height);
    let away = ((view.low + view.high) / 2.0 - origin).dot(direction).max(0.0);
    // Between the unit directions of neighbours.
    let turn = rays.at(width + 1.0, height).1 - direction;
    let apart = (rays.origin_dx + turn * away).length().max(1e-9);
    [SLOPE / apart, JUMP / apart]
}

/// The cheapest path up to a pixel for each choice on it. `before`: the same of the pixel before, and its candidates.
fn path_cost(here: [f64; 4], before: Option<([f64; 3], [f64; 4])>, [slope, jump]: [f64; 2]) -> [f64; 3] {
    let [first, second, weight, other] = here;
    let costs = [
        if is_hit(first) { 1.0 - weight } else { ABSENT },
        if is_hit(second) { 1.0 - other + weight } else { ABSENT },
        MISSING + weight + other,
    ];
    let Some((paths, places)) = before else { return costs };
    let step = |from: f64, to: f64| (slope * (from - to).abs().min(1e6)).min(jump);
    let arrival =
        |place: f64| (paths[0] + step(places[0], place)).min(paths[1] + step(places[1], place)).min(paths[2] + jump);
    let least = paths[0].min(paths[1]).min(paths[2]);
    let cheapest = [arrival(first), arrival(second), (paths[0].min(paths[1]) + jump).min(paths[2])];
    std::array::from_fn(|n| costs[n] + cheapest[n] - least)
}

/// An edge that is being followed.
struct Edge {
    crossing: i64,
    best: f64,
    best_at: i64,
    before: f64,
    after: f64,
    /// Mean echo in front of it, and how far the mean behind it exceeds that, by polarity.
    level: f64,
    contrast: f64,
    is_followed: bool,
}

/// Places and weights of the two candidates of a ray, in order of depth; MISS and 0 where there is none.
fn candidates_of(scene: &Scene, ray: &ray::Ray) -> [(f64, f64); 2] {
    let (half, follow) = (i64::from(scene.ring.half), i64::from(scene.ring.follow));
    let (threshold, polarity) = (scene.settings.surface.threshold, polarity(scene));
    let mut kept = Kept { candidates: [(MISS, 0.0); 2], best: 0.0, at: i64::MIN / 2, certain_at: i64::MAX };
    let count = ray.steps_to(ray.path().max(0.0)).floor() as i64;
    if ray.path() <= 0.0 || count == 0 {
        return kept.candidates;
    }
    let first = (-half).max((ray.steps_to(-ray.enter) - 0.5).ceil() as i64);
    // Samples since the last gap, the newest last.
    let mut samples: Vec<f64> = Vec::new();
    let (mut noise, mut previous, mut edge) = (Noise::default(), 0.0, None::<Edge>);
    for i in first..count + 3 * half {
        let Some(sample) = ray.sample(ray.offset(i as f64 + 0.5), i as f64 + 0.5) else {
            (samples, noise, edge) = (Vec::new(), Noise::default(), None);
            continue;
        };
        samples.push(sample);
        let length = half as usize;
        let Some(oldest) = samples.len().checked_sub(2 * length) else { continue };
        let ring = &samples[oldest..];
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
        let older: Vec<f64> = ring[..length].iter().rev().copied().collect();
        noise.learn(&older);
        let difference = polarity * (mean(&ring[length..]) - mean(&older));
        let is_first = oldest == 0;
        let peak = |crossing| Edge {
            crossing,
            best: difference,
            best_at: i,
            before: if is_first { difference } else { previous },
            after: 0.0,
            level: noise.mean,
            contrast: 0.0,
            is_followed: false,
        };
        match &mut edge {
            None if difference > threshold && i >= half && (is_first || difference > previous) => edge = Some(peak(i)),
            None => {}
            Some(e) => {
                if i == e.best_at + 1 {
                    e.after = difference;
                }
                if i == e.best_at + half {
                    e.contrast = polarity * (mean(ring) - e.level);
                }
                if !e.is_followed {
                    e.is_followed = difference < FOLLOW_LEVEL * e.best || i >= e.crossing + follow;
                    if !e.is_followed && difference > e.best {
                        *e = peak(e.crossing);
                    }
                }
                if e.is_followed && i >= e.best_at + half {
                    kept.keep(scene, ray, e);
                    edge = None;
                }
            }
        }
        previous = difference;
        // What outgrows an edge that is certain is still found.
        if i - 3 * half >= kept.certain_at {
            break;
        }
    }
    kept.candidates
}

/// Candidates of a ray: places and weights, the difference and the sample of the last that was kept, and the sample of the first that is certain.
struct Kept {
    candidates: [(f64, f64); 2],
    best: f64,
    at: i64,
    certain_at: i64,
}

impl Kept {
    /// Keeps an edge in place of a less likely one, if it has a place on the ray and echo behind it.
    fn keep(&mut self, scene: &Scene, ray: &ray::Ray, edge: &Edge) {
        let bend = edge.before - 2.0 * edge.best + edge.after;
        let shift = if bend < 0.0 { (0.5 * (edge.before - edge.after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        let at = ray.offset(edge.best_at as f64 + shift - (f64::from(scene.ring.samples()) - 1.0) / 2.0 + 0.5);
        if edge.contrast <= 0.0 || !(0.0..=ray.path()).contains(&at) {
            return;
        }
        let threshold = scene.settings.surface.threshold;
        let weight = ((edge.contrast - WEAK * threshold) / (SURE * threshold.max(1e-6))).clamp(0.0, 1.0);
        if weight >= 1.0 {
            self.certain_at = self.certain_at.min(edge.best_at);
        }
        let new = (ray.enter + at, weight);
        let [first, second] = self.candidates;
        let last = if is_hit(second.0) { 1 } else { 0 };
        let is_near = edge.best_at - self.at < i64::from(scene.ring.samples());
        if is_near && edge.best > OUTGROWN * self.best && weight >= self.candidates[last].1 {
            self.candidates[last] = new;
        } else if !is_hit(first.0) {
            self.candidates[0] = new;
        } else if !is_hit(second.0) {
            self.candidates[1] = new;
        } else if weight > first.1.min(second.1) {
            self.candidates = [if first.1 <= second.1 { second } else { first }, new];
        } else {
            return;
        }
        (self.best, self.at) = (edge.best, edge.best_at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a path that is not the cheapest of all choices on its pixels: against every choice on six pixels.
    #[test]
    fn a_path_is_the_cheapest_of_all_choices() {
        let prices = [0.16, 1.2];
        let mut seed = 1u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31)
        };
        for _ in 0..200 {
            let pixels: Vec<[f64; 4]> = (0..6)
                .map(|_| {
                    let [first, second] = [10.0 * draw(), 10.0 + 10.0 * draw()];
                    match draw() {
                        few if few < 0.2 => [MISS, MISS, 0.0, 0.0],
                        few if few < 0.4 => [first, MISS, draw(), 0.0],
                        _ => [first, second, draw(), draw()],
                    }
                })
                .collect();
            let (mut before, mut path) = (None, [0.0; 3]);
            for here in &pixels {
                path = path_cost(*here, before, prices);
                before = Some((path, *here));
            }
            let price = |from: [f64; 4], a: usize, to: [f64; 4], b: usize| match (a, b) {
                (2, 2) => 0.0,
                (2, _) | (_, 2) => prices[1],
                _ => ((from[a] - to[b]).abs() * prices[0]).min(prices[1]),
            };
            let mut least = [f64::MAX; 3];
            for choice in 0..3usize.pow(6) {
                let label = |n: usize| choice / 3usize.pow(n as u32) % 3;
                let own: f64 = (0..6).map(|n| path_cost(pixels[n], None, prices)[label(n)]).sum();
                let steps: f64 = (1..6).map(|n| price(pixels[n - 1], label(n - 1), pixels[n], label(n))).sum();
                least[label(5)] = least[label(5)].min(own + steps);
            }
            for n in 0..2 {
                assert!((path[n] - path[2] - (least[n] - least[2])).abs() < 1e-9, "{path:?} {least:?} {pixels:?}");
            }
        }
    }
}
