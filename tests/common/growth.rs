//! The growth of the windows of the enhanced sigma filter, as the thesis counts it.

use echolume::low_level::passes::Texels;
use echolume::low_level::scene::Scene;

/// Shares (0..1, summing to 1) of the pixels within the sector whose window's edge grew by +0, +2, +4 ... pixels up to the largest growth (thesis
/// Tables 7-9), from the map that the pass `growth` writes.
pub fn growth_shares(scene: &Scene, growth: &Texels) -> Vec<f64> {
    let enhanced = scene.slice_filters.enhanced_sigma.unwrap_or_default();
    let rings = (enhanced.largest / 2).saturating_sub(enhanced.window / 2) as usize;
    let mut counts = vec![0u64; rings + 1];
    for (x, y) in (0..growth.size[1]).flat_map(|y| (0..growth.size[0]).map(move |x| (x, y))) {
        if is_insonified(scene, x, y) {
            counts[(growth.one(x, y, 0).max(0.0) as usize).min(rings)] += 1;
        }
    }
    let all = counts.iter().sum::<u64>().max(1) as f64;
    counts.into_iter().map(|n| n as f64 / all).collect()
}

/// True if the slice's pixel is inside the sector; pixels beyond it only repeat the values at its rim.
fn is_insonified(scene: &Scene, x: usize, y: usize) -> bool {
    let Some(probe) = scene.probe() else { return true };
    let (lateral, depth) = scene.grid.place(x as f64, y as f64);
    let (sample, line) = probe.plane_indices(lateral, depth);
    let within = |at: f64, count: usize| at >= 0.0 && at <= (count - 1) as f64;
    within(sample, probe.samples) && within(line, probe.lines.len())
}
