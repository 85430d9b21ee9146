//! The kind of each brick to a mode. A change of transfer function, threshold or window classifies bricks again and reads no
//! voxel.

use super::{ACTIVE, EMPTY, HOMOGENEOUS, MAX_DISTANCE};
use crate::passes::lookup_tables::brick_reaches;
use crate::passes::pass::*;
use crate::scene::{Compositing, Mode, Scene, Side, View, transfer};

/// For the surface detector.
pub const SURFACE: Pass = Pass {
    name: "classify_bricks_surface",
    stage: Stage::Raycast,
    frequency: Frequency::Picture,
    link: Link::None,
    shader: |_, _| "empty_space/classify.plain",
    needed: |s| match (s.detects_surface(), super::asked(s)) {
        (true, Ok(_)) => Ok("where no sample exceeds the threshold the detector cannot fire"),
        (true, not) => not,
        (false, _) => Err("no surface in this mode"),
    },
    reads: |_, _| ranges(),
    writes: |_, _| vec![whole("kinds", Slot::BrickKinds)],
    extent: |s, _| s.bricks().count,
    repeat: once,
    params: |s, _| window(s, s.surface_view()).f32("quiet_level", quiet_level(s)),
    constants: |_, _| vec![("MAX_DISTANCE", MAX_DISTANCE as i32)],
    tolerance: Tolerance {
        absolute: 0.0,
        relative: 0.0,
        outliers: 1e-3,
        why: "kinds are whole numbers; a range that ends within rounding of the threshold may fall on either side",
    },
    reference: |s, _, reads, writes| {
        let bar = quiet_level(s);
        reference(s, s.surface_view(), reads, writes, |side, range| match side {
            Side::Outside => EMPTY,
            Side::Inside if range[1] + 1e-6 <= bar => HOMOGENEOUS,
            _ => ACTIVE,
        });
    },
};

/// For the mode that composites, or takes the mean.
pub const VOLUME: Pass = Pass {
    name: "classify_bricks_volume",
    shader: |s, _| if s.composites() { "empty_space/classify.transparent" } else { "empty_space/classify.plain" },
    needed: |s| match (s.composites(), s.settings.mode, super::asked(s)) {
        (true, _, Ok(_)) => Ok("what is transparent or outside is left out"),
        (_, Mode::Mean, Ok(_)) => Ok("what is zero or outside is counted without looking"),
        (true, _, not) | (_, Mode::Mean, not) => not,
        _ => Err("nothing is composited or averaged in this mode"),
    },
    reads: |s, _| {
        let mut reads = ranges();
        reads.extend(s.composites().then_some(whole("opaque_before", Slot::OpaqueBefore)));
        reads
    },
    params: |s, _| match s.composites() {
        true => window(s, s.volume_view()),
        false => window(s, s.projection_view()).f32("quiet_level", 0.0),
    },
    constants: |s, _| {
        let mut constants = vec![("MAX_DISTANCE", MAX_DISTANCE as i32)];
        if s.composites() {
            constants.push(("FROM_ZERO", between_samples(s) as i32));
            constants.push(("ENTRIES", transfer::ENTRIES as i32));
        }
        constants
    },
    reference: |s, _, reads, writes| {
        if !s.composites() {
            return reference(s, s.projection_view(), reads, writes, |side, range| match side {
                Side::Outside => EMPTY,
                Side::Inside if range[1] == 0.0 => HOMOGENEOUS,
                _ => ACTIVE,
            });
        }
        let opaque = reads.get("opaque_before").values.clone();
        let last_entry = (transfer::ENTRIES - 1) as f64;
        let entry = |value: f64| (value * last_entry).clamp(0.0, last_entry) as usize;
        reference(s, s.volume_view(), reads, writes, |side, [low, high]| {
            let first = if between_samples(s) { 0 } else { entry(low - 1e-6) };
            let last = (entry(high + 1e-6) + 1).min(transfer::ENTRIES - 1);
            let transparent = opaque[last + 1] == opaque[first];
            if side == Side::Outside || transparent { EMPTY } else { ACTIVE }
        });
    },
    ..SURFACE
};

/// The slots that every kind follows from.
fn ranges() -> Vec<Bind> {
    vec![whole("brick_table", Slot::BrickTable), whole("brick_ranges", Slot::BrickRanges)]
}

/// The level that no sample of a quiet brick exceeds: two means of samples in 0..=q differ by at most q, so that the detector
/// cannot fire where q is below the lower threshold.
pub(in crate::passes) fn quiet_level(scene: &Scene) -> f64 {
    let surface = &scene.settings.surface;
    let threshold = surface.threshold.min(surface.rough_threshold.unwrap_or(surface.threshold));
    // Larger than 0, which means exact zeros.
    (threshold * (1.0 - 1e-4) - 1e-5).max(1e-30)
}

/// True if a step uses every value between two samples, which may be in two bricks.
fn between_samples(scene: &Scene) -> bool {
    scene.settings.volume.compositing == Compositing::PreIntegrated
}

/// Ratio by which rounding may raise a sample above its largest texel: for a weighted mean, some ulps.
fn beyond(scene: &Scene) -> f64 {
    if scene.settings.ray.sliding > 0 { 1.0 + 1e-5 } else { 1.0 }
}

fn window(scene: &Scene, view: View) -> Params {
    let [low, high] = view.window;
    Params::default().f32("window_low", low).f32("window_scale", 1.0 / (high - low)).f32("beyond", beyond(scene))
}

fn reference(scene: &Scene, view: View, reads: &Arrays, writes: &mut Arrays, kind: impl Fn(Side, [f64; 2]) -> u32) {
    let ranges = reads.get("brick_ranges");
    let target = writes.get_mut("kinds");
    let [low, high] = view.window;
    let windowed = |v: f64| ((v - low) / (high - low)).clamp(0.0, 1.0);
    for (n, reach) in brick_reaches(scene, &scene.bricks()).into_iter().enumerate() {
        let range = [ranges.values[2 * n] / beyond(scene), ranges.values[2 * n + 1] * beyond(scene)];
        let kind = kind(reach.side, range.map(windowed));
        target.values[n] = f64::from(kind * 64 + MAX_DISTANCE) / 255.0;
    }
}
