//! Median of a square window, on slices (3x3) and on distance maps.

use crate::passes::pass::*;
use crate::scene::Scene;

pub const SLICE: Pass = Pass {
    name: "median_slice",
    link: Link::Filter(Filter::of_slices(|_| Some([1; 2]))),
    shader: |_, _| "filter/median.slice",
    needed: |s| if s.settings.slices.median { Ok("asked for") } else { Err("not asked for") },
    extent: |s, t| in_runs_of(columns(s), in_runs(slice_extent(s, t), 1), 0),
    params: |_, t| Params::default().i32("slice", t.slice),
    constants: |s, _| vec![("COLUMNS", columns(s) as i32)],
    tolerance: Tolerance::absolute(5e-4).because("a value that is there, chosen exactly; only storing in R16F rounds"),
    reference: |_, args, reads, writes| reference(1, args, reads, writes, |_| true),
    ..Pass::OF_SLICES
};

/// Adjacent columns that an invocation makes: one or RUN, which is the filter's run along both axes. A CPU then loads 36 texels for 16
/// instead of 72. A GPU has them in its cache, and stores a row of adjacent invocations together.
fn columns(scene: &Scene) -> u32 {
    if scene.is_for_cpu() { RUN } else { 1 }
}

pub(crate) const DISTANCE: Pass = Pass {
    name: "median_distance",
    shader: |_, _| "filter/median.distance",
    needed: |s| if s.distance.median > 0 { Ok("asked for") } else { Err("not asked for") },
    extent: |s, t| in_runs(ray_extent(s, t), 1),
    params: |_, t| Params::default().i32("slice", t.slice),
    constants: |s, _| vec![("RADIUS", (s.distance.median / 2) as i32)],
    tolerance: Tolerance::exact("a value that is there, chosen exactly"),
    reference: |s, args, reads, writes| reference(s.distance.median / 2, args, reads, writes, is_hit),
    ..Pass::OF_DISTANCES
};

/// The middle of the sorted window; of an even number, the lower. Hits and misses vote first: a tie is a miss.
fn reference(radius: u32, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays, valid: fn(f64) -> bool) {
    let (source, target, z) = filtered(reads, writes, args);
    let radius = i64::from(radius);
    for (x, y) in source.pixels() {
        let around = (-radius..=radius).flat_map(|j| (-radius..=radius).map(move |i| (i, j)));
        let mut window: Vec<f64> = around.map(|(i, j)| source.clamped(x as i64 + i, y as i64 + j, 0)).collect();
        let all = window.len();
        window.retain(|v| valid(*v));
        window.sort_by(f64::total_cmp);
        let median = if 2 * window.len() <= all { MISS } else { window[(window.len() - 1) / 2] };
        target.set([x, y, z], &[median]);
    }
}
