//! Anisotropic diffusion (Perona and Malik 1990; thesis 5-9..5-12) on slices, distance maps and pictures, in explicit steps: a
//! pixel moves towards its four neighbours, the less the more they differ. Nothing flows across the border.

use super::estimator::{quotient, storable_edge};
use crate::passes::pass::*;
use crate::scene::{Conductance, PeronaMalik, Scheme};

const WHY: &str = "five values in f32, exp to 3 ulp of an exponent of at most 87; then what the target's format stores";

pub const SLICE: Pass = Pass {
    name: "perona_malik_slice",
    link: Link::Filter(Filter::of_slices(|_| Some([1; 2]))),
    shader: |_, _| "filter/perona_malik.slice",
    needed: |s| need(s.slice_filters.perona_malik, Scheme::Explicit),
    repeat: |s| repeat(s.slice_filters.perona_malik),
    params: |s, t| params(s.slice_filters.perona_malik, t),
    constants: |s, _| vec![constant(s.slice_filters.perona_malik)],
    tolerance: Tolerance::absolute(1e-6).because(WHY),
    reference: |s, t, reads, writes| reference(s.slice_filters.perona_malik, t, reads, writes, |_| true),
    ..Pass::OF_SLICES
};

pub(crate) const DISTANCE: Pass = Pass {
    name: "perona_malik_distance",
    shader: |_, _| "filter/perona_malik.distance",
    needed: |s| need(s.distance.perona_malik, Scheme::Explicit),
    repeat: |s| repeat(s.distance.perona_malik),
    params: |s, t| params(s.distance.perona_malik, t),
    constants: |s, _| vec![constant(s.distance.perona_malik)],
    tolerance: Tolerance::absolute(1e-5).relative(1e-6).because(WHY),
    reference: |s, t, reads, writes| reference(s.distance.perona_malik, t, reads, writes, is_hit),
    ..Pass::OF_DISTANCES
};

pub const PICTURE: Pass = Pass {
    name: "perona_malik_picture",
    shader: |_, _| "filter/perona_malik.picture",
    needed: |s| need(s.settings.post.perona_malik, Scheme::Explicit),
    repeat: |s| repeat(s.settings.post.perona_malik),
    params: |s, t| params(s.settings.post.perona_malik, t),
    constants: |s, _| vec![constant(s.settings.post.perona_malik)],
    tolerance: Tolerance::absolute(1e-6).relative(1e-6).because(WHY),
    reference: |s, t, reads, writes| reference(s.settings.post.perona_malik, t, reads, writes, |_| true),
    ..Pass::OF_PICTURES
};

/// Whether the filter of this scheme is needed. An edge constant of 0 changes no pixel, so that no pass is needed.
pub(super) fn need(settings: Option<PeronaMalik>, scheme: Scheme) -> Need {
    match settings {
        Some(p) if p.edge == 0.0 => Err("an edge of 0 changes nothing"),
        Some(p) if p.scheme == scheme => Ok("asked for"),
        Some(_) => Err("another scheme was asked for"),
        None => Err("not asked for"),
    }
}

fn repeat(settings: Option<PeronaMalik>) -> u32 {
    settings.unwrap_or_default().repeat
}

pub(super) fn constant(settings: Option<PeronaMalik>) -> (&'static str, i32) {
    ("CONDUCTANCE", i32::from(settings.unwrap_or_default().conductance == Conductance::Exponential))
}

fn params(settings: Option<PeronaMalik>, args: &DispatchArgs) -> Params {
    let p = settings.unwrap_or_default();
    Params::default().f32("edge", storable_edge(p.edge)).f32("lambda", p.step).i32("slice", args.slice)
}

/// Conductance between two texels, 0..1. For colours the difference is the root mean square over the channels (Gerig et al. 1992).
pub(super) fn conductance(p: &PeronaMalik, a: &[f64], b: &[f64]) -> f64 {
    let colours = a.len().min(3);
    let squares: f64 = (0..colours).map(|c| (a[c] - b[c]).powi(2)).sum();
    let difference = (squares / colours as f64).sqrt();
    match p.conductance {
        _ if p.edge == 0.0 => 0.0,
        Conductance::Quotient => quotient(difference, p.edge),
        Conductance::Exponential => (-(difference / p.edge).powi(2)).exp(),
    }
}

fn reference(p: Option<PeronaMalik>, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays, valid: fn(f64) -> bool) {
    let p = p.unwrap_or_default();
    let (source, target, z) = filtered(reads, writes, args);
    let [width, height, _] = source.size;
    let mut next = source.clone();
    // What flows between two neighbours leaves the one and enters the other.
    let mut exchange = |a: [usize; 3], b: [usize; 3]| {
        let (from, to) = (source.get(a), source.get(b));
        if !(valid(from[0]) && valid(to[0])) {
            return;
        }
        let flow = p.step * conductance(&p, from, to);
        let moved = |at, sign: f64| -> Vec<f64> {
            let now: &[f64] = next.get(at);
            now.iter().zip(to.iter().zip(from)).map(|(n, (t, f))| n + sign * flow * (t - f)).collect()
        };
        let (at_a, at_b) = (moved(a, 1.0), moved(b, -1.0));
        next.set(a, &at_a);
        next.set(b, &at_b);
    };
    for (x, y) in pixels([width, height]) {
        if x + 1 < width {
            exchange([x, y, 0], [x + 1, y, 0]);
        }
        if y + 1 < height {
            exchange([x, y, 0], [x, y + 1, 0]);
        }
    }
    for (x, y) in pixels([width, height]) {
        target.set([x, y, z], next.get([x, y, 0]));
    }
}
