//! Adaptive supersampling: one ray through the middle of each pixel tells which pixels lie at an edge, and only these have all the rays.
//!
//! A pixel is the mean of its rays. Where the picture is straight across a pixel the ray in its middle is that mean; where it bends evenly by d per
//! pixel, the mean of 2 x 2 rays differs by d / 16 at most. At a step the pixels on both sides bend by its height, and a step of two levels makes a
//! difference of one at most.

use crate::passes::pass::*;
use crate::passes::postprocess::{on_screen, tone_constants, tone_params};
use crate::scene::Scene;

/// Second difference of a pixel's colour on the screen beyond which it has all rays: two levels of the screen.
const THRESHOLD: f64 = 2.0 / 255.0;

/// The need of a pass of adaptive supersampling, with the reason why.
pub(super) fn need(scene: &Scene, why: &'static str) -> Need {
    scene.adapts_rays().then_some(why).ok_or("no pixel has more rays than another")
}

/// Marks the pixels at edges, which get all rays of adaptive supersampling.
pub(crate) const MARK_EDGES: Pass = Pass {
    name: "mark_edges",
    shader: |_, _| "raycast/mark_edges",
    needed: |s| need(s, "only pixels at edges have several rays"),
    reads: |_, _| vec![whole("picture", Slot::PixelRays)],
    writes: |_, _| vec![whole("marks", Slot::EdgeMarks)],
    extent: rendering_extent,
    params: |s, _| tone_params(s, Params::default()).f32("threshold", THRESHOLD),
    constants: |s, _| tone_constants(s).into_iter().filter(|(name, _)| *name != "CROSSING").collect(),
    tolerance: Tolerance::absolute(0.0).outliers(1e-3).because(
        "a sum of three colours is off by 1e-6 in f32: a difference at the threshold itself may be on either side",
    ),
    reference: |scene, _, reads, writes| {
        let picture = reads.get("picture");
        let marks = writes.get_mut("marks");
        let [width, height, _] = marks.size;
        marks.fill(|x, y| {
            let at = |dx: i64, dy: i64| {
                let inside = |n: usize, by: i64, size: usize| (n as i64 + by).clamp(0, size as i64 - 1) as usize;
                on_screen(scene, picture.get([inside(x, dx, width), inside(y, dy, height), 0]))
            };
            let bends = |(dx, dy): (i64, i64)| {
                let (before, here, after) = (at(-dx, -dy), at(0, 0), at(dx, dy));
                (0..3).any(|c| (before[c] + after[c] - 2.0 * here[c]).abs() > THRESHOLD)
            };
            let is_marked = [(1, 0), (0, 1), (1, 1), (1, -1)].into_iter().any(bends);
            [f64::from(u8::from(is_marked))]
        });
    },
    ..Pass::OF_RAYS
};
