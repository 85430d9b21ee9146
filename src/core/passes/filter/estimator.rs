//! Local estimators of a pixel from its neighbours, which thesis 5.3.1 compares: as a filter of slices, and as the centre of the
//! enhanced sigma filter. Beyond the border the nearest pixel repeats; of distances, misses are ignored.

use crate::passes::pass::*;
use crate::scene::{Estimator, Scene};

pub const SLICE: Pass = Pass {
    name: "estimator_slice",
    link: Link::Filter(Filter::of_slices(|s| Some([s.settings.slices.estimator.map_or(0, reach); 2]))),
    shader: |_, _| "filter/estimator",
    needed: |s| s.settings.slices.estimator.map_or(Err("not asked for"), |_| Ok("asked for")),
    params: |s, t| params(Params::default(), s.settings.slices.estimator_edge, LEAST).i32("slice", t.slice),
    constants: |s, _| vec![("ESTIMATOR", constant(s.settings.slices.estimator.unwrap_or_default()))],
    tolerance: Tolerance::absolute(6e-4).outliers(1e-3).because(
        "at most 25 values in f32; of two masks that vary alike to f32's rounding either may win; R16F stores 1 to \
         4.9e-4",
    ),
    reference: |scene, args, reads, writes| {
        let slices = &scene.settings.slices;
        let (source, target, z) = filtered(reads, writes, args);
        for (x, y) in source.pixels() {
            let around = |dx: i64, dy: i64| source.clamped(x as i64 + dx, y as i64 + dy, 0);
            let estimator = slices.estimator.unwrap_or_default();
            target.set([x, y, z], &[estimate(estimator, &around, |_| true, slices.estimator_edge, LEAST)]);
        }
    },
    ..Pass::OF_SLICES
};

/// Smallest difference of sample values (0..1) that counts as a gradient: half a level of 255, as Wang, Vagnucci and Li do on integer levels.
pub(super) const LEAST: f64 = 0.5 / 255.0;
/// Smallest difference of distances that counts as a gradient, mm: 1/32 of the detector's step, which is below its resolution.
pub(super) fn least_distance(scene: &Scene) -> f64 {
    scene.ring.step / 32.0
}

/// The value of the shader's constant ESTIMATOR.
pub(super) fn constant(estimator: Estimator) -> i32 {
    match estimator {
        Estimator::Median => 0,
        Estimator::PeronaMalik => 1,
        Estimator::GradientInverse => 2,
        Estimator::NagaoMatsuyama => 3,
    }
}

/// How many pixels away from the centre the estimator reads.
pub(super) fn reach(estimator: Estimator) -> u32 {
    if estimator == Estimator::NagaoMatsuyama { 2 } else { 1 }
}

pub(super) fn params(params: Params, edge: f64, least: f64) -> Params {
    params.f32("edge", storable_edge(edge)).f32("least", least)
}

/// Clamps an edge constant so that f32 can divide by it: 1e-30 acts as 0 and 1e30 as infinity on every difference that occurs.
pub(super) fn storable_edge(edge: f64) -> f64 {
    edge.clamp(1e-30, 1e30)
}

/// Estimates the noise-free value of a pixel. `around` gives the value at an offset (columns, rows) from it; neighbours that are not `valid` are left
/// out, and the pixel itself must be valid. `edge`: edge constant of Perona-Malik; `least`: smallest difference that counts as a gradient.
pub(super) fn estimate(
    estimator: Estimator,
    around: &dyn Fn(i64, i64) -> f64,
    valid: fn(f64) -> bool,
    edge: f64,
    least: f64,
) -> f64 {
    let here = around(0, 0);
    let square = || (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)));
    match estimator {
        Estimator::Median => {
            let mut values: Vec<f64> = square().map(|(dx, dy)| around(dx, dy)).filter(|v| valid(*v)).collect();
            values.sort_by(f64::total_cmp);
            values[(values.len() - 1) / 2]
        }
        Estimator::PeronaMalik => {
            let four = [(0, -1), (-1, 0), (0, 1), (1, 0)].map(|(dx, dy)| around(dx, dy));
            let flux = four.into_iter().filter(|v| valid(*v)).map(|v| (v - here) * quotient(v - here, edge));
            here + 0.2 * flux.sum::<f64>()
        }
        Estimator::GradientInverse => {
            let eight = square().filter(|at| *at != (0, 0)).map(|(dx, dy)| around(dx, dy));
            let weighted: Vec<(f64, f64)> =
                eight.filter(|v| valid(*v)).map(|v| (1.0 / (v - here).abs().max(least), v)).collect();
            let weights: f64 = weighted.iter().map(|(w, _)| w).sum();
            if weighted.is_empty() {
                return here;
            }
            0.5 * here + 0.5 * weighted.iter().map(|(w, v)| w * v).sum::<f64>() / weights
        }
        Estimator::NagaoMatsuyama => {
            let mut best = (f64::INFINITY, here);
            for mask in masks() {
                let values: Vec<f64> = mask.iter().map(|&(dx, dy)| around(dx, dy)).collect();
                if !values.iter().all(|v| valid(*v)) {
                    continue;
                }
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
                if variance < best.0 {
                    best = (variance, mean);
                }
            }
            best.1
        }
    }
}

/// The conductance 1 / (1 + (g/k)^2) for a difference g and the edge constant k; 0 where k is 0.
pub(super) fn quotient(difference: f64, edge: f64) -> f64 {
    if edge > 0.0 { 1.0 / (1.0 + (difference / edge).powi(2)) } else { 0.0 }
}

/// Nagao and Matsuyama's nine: the square of 3x3, and a mask towards an edge and one towards a corner, each in four rotations.
fn masks() -> Vec<Vec<(i64, i64)>> {
    let square = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))).collect();
    let mut edge = vec![(0, 0), (-1, -1), (0, -1), (1, -1), (-1, -2), (0, -2), (1, -2)];
    let mut corner = vec![(0, 0), (-1, 0), (0, -1), (-1, -1), (-2, -1), (-1, -2), (-2, -2)];
    let (mut edges, mut corners) = (Vec::new(), Vec::new());
    for _ in 0..4 {
        edges.push(edge.clone());
        corners.push(corner.clone());
        edge.iter_mut().chain(&mut corner).for_each(|at| *at = (-at.1, at.0));
    }
    [vec![square], edges, corners].concat()
}
