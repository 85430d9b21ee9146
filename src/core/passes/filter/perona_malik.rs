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
    let flows = flows(&p, source, valid);
    target.fill_slices(z..z + 1, |[x, y, _]| {
        let channels = source.get([x, y, 0]).iter().zip(flows.get([x, y, 0]));
        channels.map(|(value, flow)| value + p.step * flow).collect::<Vec<f64>>()
    });
}

/// What flows into each pixel per unit of time: what flows between two neighbours leaves the one and enters the other. Neighbours that are not `valid`
/// exchange nothing.
pub(super) fn flows(p: &PeronaMalik, u: &Texels, valid: fn(f64) -> bool) -> Texels {
    let ([width, height, _], channels) = (u.size, u.channels);
    let mut flows = Texels::from_fn(u.size, channels, |_, _| 0.0);
    let mut exchange = |a: usize, b: usize| {
        let [from, to] = [a, b].map(|n| &u.values[n * channels..(n + 1) * channels]);
        if valid(from[0]) && valid(to[0]) {
            let conductance = conductance(p, from, to);
            for c in 0..channels {
                let flow = conductance * (to[c] - from[c]);
                flows.values[a * channels + c] += flow;
                flows.values[b * channels + c] -= flow;
            }
        }
    };
    for n in 0..width * height {
        if n % width + 1 < width {
            exchange(n, n + 1);
        }
        if n / width + 1 < height {
            exchange(n, n + width);
        }
    }
    flows
}
