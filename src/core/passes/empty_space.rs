//! Empty-space skipping: value ranges of tiles and bricks, updated slice by slice; the kind of each brick to a mode; and the
//! distance to the nearest brick of another kind. Each mode's rule is exact: the picture is the same bit for bit.

use crate::passes::lookup_tables::brick_reaches;
use crate::passes::pass::*;
use crate::probe::Geometry;
use crate::scene::{Compositing, Mode, Scene, Side, TILE, View, windowed};

/// Kinds of bricks, as in classify.comp. The samples of an active brick are needed.
const ACTIVE: u32 = 0;
/// Outside the insonified region, or transparent.
const EMPTY: u32 = 1;
/// Inside, and the result of its samples is known.
const HOMOGENEOUS: u32 = 2;
/// Largest distance that is stored, bricks; the kind is in the two bits above.
const MAX_DISTANCE: u32 = 16;

/// The specialization constant SKIP of empty_space.glsl for a ray caster that skips empty space by a slot: by the value ranges of bricks, which are
/// compared with the largest (MIP) or smallest (MinIP) sample of the ray so far, or by the kinds of bricks and the distance to the nearest brick of
/// another kind, which any other slot holds. None takes every sample.
pub(in crate::passes) fn skip_constant(slot: Option<Slot>) -> (&'static str, i32) {
    let value = match slot {
        None => 0,
        Some(Slot::BrickRanges) => 2,
        Some(_) => 1,
    };
    ("SKIP", value)
}

/// The slot, which shaders name `bricks`, by which the surface detector skips empty space. None if it does not.
pub(in crate::passes) fn surface_skipping(scene: &Scene) -> Option<Slot> {
    scene.skips().then_some(Slot::SurfaceBrickDistances)
}

/// The slot by which compositing and projections skip empty space. None if they do not.
pub(in crate::passes) fn volume_skipping(scene: &Scene) -> Option<Slot> {
    let has_ranges = matches!(scene.settings.mode, Mode::Mip | Mode::MinIp);
    scene.skips().then_some(if has_ranges { Slot::BrickRanges } else { Slot::VolumeBrickDistances })
}

fn need(scene: &Scene) -> Need {
    match scene.skips() {
        true => Ok("rays skip bricks that cannot change the picture"),
        false => Err("no ray skips bricks: none is cast, or every sample is asked for"),
    }
}

/// Computes the smallest and the largest value of every tile of a slice. Only tiles of the slices that a new frame changes are updated.
pub(crate) const TILE_RANGES: Pass = Pass {
    name: "tile_ranges",
    shader: |_, _| "empty_space/tile_ranges",
    needed: need,
    // A slice changes with the frames that are smoothed into it.
    reads: |s, _| vec![Bind { part: Part::Around(s.reach_to_frames()), ..whole("volume", Slot::of_rays(s)) }],
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("tile_ranges", Slot::TileRanges) }],
    extent: |s, t| {
        let [width, height, _] = s.tile_counts();
        [width, height, t.slices]
    },
    params: |_, t| Params::default().i32("slice", t.slice),
    constants: |_, _| vec![("TILE", TILE as i32)],
    tolerance: Tolerance::absolute(2e-5).because("one of 65535 steps, up or down"),
    reference: |_, args, reads, writes| {
        let volume = reads.get("volume");
        let edge = TILE as usize;
        writes.get_mut("tile_ranges").fill_slices(args.written(), |[x, y, z]| {
            let (mut low, mut high) = (1.0f64, 0.0f64);
            for row in edge * y..(edge * (y + 1)).min(volume.size[1]) {
                for column in edge * x..(edge * (x + 1)).min(volume.size[0]) {
                    let value = volume.one(column, row, z);
                    (low, high) = (low.min(value), high.max(value));
                }
            }
            [(low * 65535.0).floor(), (high * 65535.0).ceil()].map(|step| step / 65535.0)
        });
    },
    ..Pass::AFTER_SLICES
};

/// Computes the smallest and the largest value that samples in each brick may have, from the tiles that they may touch. Only bricks that depend on
/// slices that a new frame changes are updated.
pub(crate) const BRICK_RANGES: Pass = Pass {
    name: "brick_ranges",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    shader: |_, _| "empty_space/brick_ranges",
    needed: need,
    reads: |s, _| {
        let part = Part::Around(s.reach_to_frames());
        vec![whole("brick_table", Slot::BrickTable), Bind { part, ..whole("tile_ranges", Slot::TileRanges) }]
    },
    writes: |_, _| vec![whole("brick_ranges", Slot::BrickRanges)],
    extent: |s, _| s.bricks().count,
    params: |_, t| Params::default().i32("slice", t.slice).i32("slices", t.slices),
    tolerance: Tolerance::exact("the smallest and the largest of values that are stored alike"),
    reference: |scene, args, reads, writes| {
        let tiles = reads.get("tile_ranges");
        let target = writes.get_mut("brick_ranges");
        let bricks = scene.bricks();
        for (n, reach) in brick_reaches(scene, &bricks).into_iter().enumerate() {
            let [first, last] = reach.slices;
            let outside = reach.side == Side::Outside;
            if !outside && (last < args.slice || first >= args.slice + args.slices) {
                continue;
            }
            let (mut low, mut high) = (1.0f64, 0.0f64);
            let [columns, rows] = reach.tiles;
            let within = |[from, to]: [u32; 2]| if outside { 0..0 } else { from as usize..to as usize + 1 };
            for z in within(reach.slices) {
                for y in within(rows) {
                    for x in within(columns) {
                        let at = 2 * ((z * tiles.size[1] + y) * tiles.size[0] + x);
                        (low, high) = (low.min(tiles.values[at]), high.max(tiles.values[at + 1]));
                    }
                }
            }
            let [width, height, _] = bricks.count.map(|n| n as usize);
            target.set([n % width, n / width % height, n / (width * height)], &[low, high]);
        }
    },
    ..Pass::OF_RAYS
};

/// Classifies each brick for the surface detector. After a change of transfer function, threshold or window this runs again and reads no voxel.
pub(crate) const CLASSIFY_SURFACE: Pass = Pass {
    name: "classify_bricks_surface",
    shader: |_, _| "empty_space/classify",
    needed: |s| match (s.detects_surface(), need(s)) {
        (true, Ok(_)) => Ok("where no sample exceeds the threshold the detector cannot fire"),
        (true, not) => not,
        (false, _) => Err("no surface in this mode"),
    },
    reads: |_, _| ranges(),
    writes: |_, _| vec![whole("kinds", Slot::BrickKinds)],
    extent: |s, _| s.bricks().count,
    params: |s, _| window(s, s.surface_view()).f32("quiet_level", quiet_level(s)),
    constants: |_, _| constants(0, false),
    tolerance: Tolerance::absolute(0.0)
        .outliers(1e-3)
        .because("kinds are whole numbers; a range that ends within rounding of the threshold may fall on either side"),
    reference: |s, _, reads, writes| {
        let bar = quiet_level(s);
        classify_reference(s, s.surface_view(), reads, writes, |side, range| match side {
            Side::Outside => EMPTY,
            Side::Inside if range[1] + 1e-6 <= bar => HOMOGENEOUS,
            _ => ACTIVE,
        });
    },
    ..Pass::OF_RAYS
};

/// Classifies each brick for modes that composite or take the mean.
pub(crate) const CLASSIFY_VOLUME: Pass = Pass {
    name: "classify_bricks_volume",
    needed: |s| match (s.composites(), s.settings.mode, need(s)) {
        _ if s.still().is_some() => Err("paths take the majorants of bricks"),
        (true, _, Ok(_)) => Ok("what is transparent or outside is left out"),
        (_, Mode::Mean, Ok(_)) => Ok("what is zero or outside is counted without looking"),
        (true, _, not) | (_, Mode::Mean, not) => not,
        _ => Err("nothing is composited or averaged in this mode"),
    },
    reads: |s, _| [ranges(), whole_if(s.composites(), "opaque_before", Slot::OpaqueBefore)].concat(),
    // What is composited has no quiet bricks; of a mean only those of zeros are.
    params: |s, _| {
        window(s, if s.composites() { s.volume_view() } else { s.projection_view() }).f32("quiet_level", 0.0)
    },
    constants: |s, _| match s.composites() {
        true => constants(s.transfer_entries(), between_samples(s)),
        false => constants(0, false),
    },
    reference: |s, _, reads, writes| {
        if !s.composites() {
            return classify_reference(s, s.projection_view(), reads, writes, |side, range| match side {
                Side::Outside => EMPTY,
                Side::Inside if range[1] == 0.0 => HOMOGENEOUS,
                _ => ACTIVE,
            });
        }
        let opaque = reads.get("opaque_before").values.clone();
        let entries = s.transfer_entries();
        let last_entry = (entries - 1) as f64;
        let entry = |value: f64| (value * last_entry).clamp(0.0, last_entry) as usize;
        classify_reference(s, s.volume_view(), reads, writes, |side, [low, high]| {
            let first = if between_samples(s) { 0 } else { entry(low - 1e-6) };
            let last = (entry(high + 1e-6) + 1).min(entries - 1);
            let transparent = opaque[last + 1] == opaque[first];
            if side == Side::Outside || transparent { EMPTY } else { ACTIVE }
        });
    },
    ..CLASSIFY_SURFACE
};

/// `entries` of the transfer function: 0 where nothing is composited.
fn constants(entries: usize, from_zero: bool) -> Vec<(&'static str, i32)> {
    vec![("MAX_DISTANCE", MAX_DISTANCE as i32), ("ENTRIES", entries as i32), ("FROM_ZERO", from_zero as i32)]
}

/// The bindings that classify bricks: the table of bricks and the ranges of their values.
pub(super) fn ranges() -> Vec<Bind> {
    vec![whole("brick_table", Slot::BrickTable), whole("brick_ranges", Slot::BrickRanges)]
}

/// The largest sample value q of a brick in which the detector cannot fire: two means of samples in 0..=q differ by at most q, which is below the
/// lower threshold.
pub(in crate::passes) fn quiet_level(scene: &Scene) -> f64 {
    let surface = &scene.settings.surface;
    let threshold = surface.threshold.min(surface.rough_threshold.unwrap_or(surface.threshold));
    // Larger than 0, which means exact zeros.
    (threshold * (1.0 - 1e-4) - 1e-5).max(1e-30)
}

/// True if a step uses every value between two samples, which may be in two bricks.
fn between_samples(scene: &Scene) -> bool {
    matches!(scene.settings.volume.compositing, Compositing::PreIntegrated | Compositing::Exponential)
}

/// Factor by which rounding may raise a sample above the largest texel that it is interpolated from: 1 + 1e-5 for weighted means of many texels,
/// otherwise 1.
pub(super) fn beyond(scene: &Scene) -> f64 {
    if scene.settings.ray.sliding > 0 || scene.takes_bspline() { 1.0 + 1e-5 } else { 1.0 }
}

pub(super) fn window(scene: &Scene, view: View) -> Params {
    let [low, high] = view.window;
    Params::default().f32("window_low", low).f32("window_scale", 1.0 / (high - low)).f32("beyond", beyond(scene))
}

fn classify_reference(
    scene: &Scene,
    view: View,
    reads: &Arrays,
    writes: &mut Arrays,
    kind: impl Fn(Side, [f64; 2]) -> u32,
) {
    let ranges = reads.get("brick_ranges");
    let target = writes.get_mut("kinds");
    for (n, reach) in brick_reaches(scene, &scene.bricks()).into_iter().enumerate() {
        let range = [ranges.values[2 * n] / beyond(scene), ranges.values[2 * n + 1] * beyond(scene)];
        let kind = kind(reach.side, range.map(|v| windowed(view.window, v)));
        target.values[n] = f64::from(kind * 64 + MAX_DISTANCE) / 255.0;
    }
}

/// Computes for each brick the Chebyshev distance to the nearest brick of another kind, in bricks (Deakin and Knackstedt 2020), for the surface
/// detector. Each of three dispatches handles one axis, by d(p) = min over the line through p of max(|q - p|, d(q)).
pub(crate) const DISTANCE_SURFACE: Pass = Pass {
    name: "brick_distance_surface",
    shader: |_, _| "empty_space/distance",
    needed: CLASSIFY_SURFACE.needed,
    reads: |_, t| vec![whole("source", link(Slot::SurfaceBrickDistances, t).0)],
    writes: |_, t| vec![whole("target", link(Slot::SurfaceBrickDistances, t).1)],
    extent: |s, _| s.bricks().count,
    repeat: |_| 3,
    constants: |s, t| distance_constants(beyond_surface(s), t),
    tolerance: Tolerance::exact("whole numbers"),
    reference: |s, t, reads, writes| distance_reference(beyond_surface(s), t, reads, writes),
    ..Pass::OF_RAYS
};

/// Computes the same as [`DISTANCE_SURFACE`] for modes that composite or take the mean.
pub(crate) const DISTANCE_VOLUME: Pass = Pass {
    name: "brick_distance_volume",
    needed: CLASSIFY_VOLUME.needed,
    reads: |_, t| vec![whole("source", link(Slot::VolumeBrickDistances, t).0)],
    writes: |_, t| vec![whole("target", link(Slot::VolumeBrickDistances, t).1)],
    constants: |_, t| distance_constants(EMPTY, t),
    reference: |_, t, reads, writes| distance_reference(EMPTY, t, reads, writes),
    ..DISTANCE_SURFACE
};

/// The slots that the dispatch of an axis reads and writes.
fn link(last: Slot, args: &DispatchArgs) -> (Slot, Slot) {
    match args.iteration {
        0 => (Slot::BrickKinds, Slot::BrickDistancesX),
        1 => (Slot::BrickDistancesX, Slot::BrickDistancesXy),
        _ => (Slot::BrickDistancesXy, last),
    }
}

/// The kind of the space beyond the bricks. The detector takes samples there, where a Cartesian volume repeats its last texels.
fn beyond_surface(scene: &Scene) -> u32 {
    if matches!(scene.geometry, Geometry::Cartesian(_)) { ACTIVE } else { EMPTY }
}

fn distance_constants(beyond: u32, args: &DispatchArgs) -> Vec<(&'static str, i32)> {
    vec![("AXIS", args.iteration as i32), ("BEYOND", beyond as i32)]
}

fn distance_reference(beyond: u32, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let source = reads.get("source");
    let target = writes.get_mut("target");
    let axis = args.iteration as usize;
    let size = source.size;
    let code = |at: [usize; 3]| (source.one(at[0], at[1], at[2]) * 255.0).round() as u32;
    target.fill_slices(0..size[2], |at| {
        let (kind, own) = (code(at) >> 6, code(at) & 63);
        let mut best = own;
        for along in (0..size[axis]).filter(|along| *along != at[axis]) {
            let away = along.abs_diff(at[axis]) as u32;
            let mut there = at;
            there[axis] = along;
            let other = code(there);
            best = best.min(if other >> 6 == kind { away.max(other & 63) } else { away });
        }
        if beyond != kind {
            best = best.min(at[axis] as u32 + 1).min((size[axis] - at[axis]) as u32);
        }
        [f64::from(kind * 64 + best) / 255.0]
    });
}
