//! Bilateral filter of the distance map (Tomasi and Manduchi 1998), repeated if asked. Misses stay and weigh nothing.

use crate::passes::pass::*;
use crate::scene::{Bilateral, Scene};

pub(crate) const DISTANCE: Pass = Pass {
    name: "bilateral_distance",
    shader: |_, _| "filter/bilateral.distance",
    needed: |s| s.distance.bilateral.map(|_| "asked for").ok_or("not asked for"),
    extent: |s, t| in_runs(ray_extent(s, t), 1),
    repeat: |s| settings(s).repeat,
    params: |s, t| {
        let b = settings(s);
        Params::default()
            .f32("place_narrowness", 0.5 / (b.pixels * b.pixels))
            .f32("distance_narrowness", 0.5 / (b.distance * b.distance))
            .i32("slice", t.slice)
    },
    constants: |s, _| vec![("RADIUS", radius(s) as i32)],
    tolerance: Tolerance::absolute(2e-5).relative(1e-6).because(
        "sums of differences from the centre in f32, whose weights are off by a few ulp; then f32's own rounding of mm",
    ),
    reference: |scene, _, reads, writes| {
        let b = settings(scene);
        let source = reads.get("source");
        let [width, height, _] = source.size;
        let radius = radius(scene) as usize;
        writes.get_mut("target").fill(|x, y| {
            let centre = source.one(x, y, 0);
            if !is_hit(centre) {
                return [centre];
            }
            let (mut sum, mut weight) = (0.0, 0.0);
            for j in y.saturating_sub(radius)..=(y + radius).min(height - 1) {
                for i in x.saturating_sub(radius)..=(x + radius).min(width - 1) {
                    let value = source.one(i, j, 0);
                    if is_hit(value) {
                        let place = (i as f64 - x as f64).powi(2) + (j as f64 - y as f64).powi(2);
                        let away = ((value - centre) / b.distance).powi(2);
                        let w = (-0.5 * (place / (b.pixels * b.pixels) + away)).exp();
                        sum += w * value;
                        weight += w;
                    }
                }
            }
            [sum / weight]
        });
    },
    ..Pass::OF_DISTANCES
};

fn settings(scene: &Scene) -> Bilateral {
    scene.distance.bilateral.unwrap_or(Bilateral { pixels: 1.0, mm: None, distance: 1.0, repeat: 1 })
}

/// Two standard deviations hold 95 % of the weight.
fn radius(scene: &Scene) -> u32 {
    (2.0 * settings(scene).pixels).ceil() as u32
}
