//! How far the window of the enhanced sigma filter grew at each pixel of a slice: what Tables 7-9 of the thesis count.

use super::enhanced_sigma::{Enhanced, constants, params};
use super::estimator::LEAST;
use crate::passes::chain::slice_link;
use crate::passes::*;
use crate::scene::Scene;

/// What the enhanced sigma filter of slices reads is read again.
pub const SLICE: Pass = Pass {
    name: "growth_slice",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    shader: |_, _| "filter/enhanced_sigma.growth",
    needed: |s| match s.settings.slices.enhanced_sigma {
        Some(e) if e.growth && e.sigma > 0.0 => Ok("the windows' growth is asked for"),
        Some(e) if e.growth => Err("a sigma of 0 grows no window"),
        _ => Err("not asked for"),
    },
    reads: |s, t| vec![whole("source", slice_link(s, "enhanced_sigma_slice", t).0)],
    writes: |_, _| vec![whole("target", Slot::Growth)],
    extent: slice_extent,
    repeat: once,
    params: |s, t| params(s.settings.slices.enhanced_sigma, LEAST, t),
    constants: |s, _| constants(s, s.settings.slices.enhanced_sigma),
    tolerance: Tolerance {
        absolute: 0.0,
        relative: 0.0,
        outliers: 2e-3,
        why: "whole rings; a pixel at exactly 2 sigma may count or not, and with it a ring",
    },
    reference: |s, t, reads, writes| {
        let enhanced = Enhanced::new(s, s.settings.slices.enhanced_sigma, LEAST, |_| true);
        enhanced.filter(t, reads, writes, |found| vec![f64::from(found.rings)]);
    },
};

/// Shares of the pixels, within the sector, whose window's edge grew by +0, +2, +4 ... up to the largest (thesis Tables 7-9),
/// from the map that the pass above writes. They sum to 1.
pub fn shares(scene: &Scene, growth: &Texels) -> Vec<f64> {
    let enhanced = scene.settings.slices.enhanced_sigma.unwrap_or_default();
    let rings = (enhanced.largest / 2).saturating_sub(enhanced.window / 2) as usize;
    let mut counts = vec![0u64; rings + 1];
    for y in 0..growth.size[1] {
        for x in 0..growth.size[0] {
            if is_insonified(scene, x, y) {
                counts[(growth.one(x, y, 0).max(0.0) as usize).min(rings)] += 1;
            }
        }
    }
    let all = counts.iter().sum::<u64>().max(1) as f64;
    counts.into_iter().map(|n| n as f64 / all).collect()
}

/// Whether a line passes through the slice's pixel; beyond the sector it only repeats what lies at its rim.
fn is_insonified(scene: &Scene, x: usize, y: usize) -> bool {
    let Some(probe) = scene.probe() else { return true };
    let (lateral, depth) = scene.grid.place(x as f64, y as f64);
    let (sample, line) = probe.plane_indices(lateral, depth);
    let within = |at: f64, count: usize| at >= 0.0 && at <= (count - 1) as f64;
    within(sample, probe.samples) && within(line, probe.lines.len())
}
