//! 3D Gaussian in texture space (lateral, depth, elevation), one axis a pass. The two in-plane axes are filtered on each
//! slice as it arrives; the third when its neighbours are there, for the slices that a new frame is near.

use crate::passes::pass::*;
use crate::scene::Scene;

/// The volume that is smoothed: deviations in pixels, pixels and slices, and taps on one side.
#[derive(Clone, Copy)]
struct Volume {
    deviations: fn(&Scene) -> [f64; 3],
    radius: fn(&Scene) -> [u32; 3],
}

/// The volume that rays are cast through.
const RENDERED: Volume = Volume { deviations: Scene::smoothing, radius: Scene::smoothing_radius };
/// The volume that planes beside a rendering are cut from.
const SECTIONS: Volume = Volume { deviations: Scene::section_smoothing, radius: Scene::section_smoothing_radius };

const WHY: &str = "at most 63 weighted values in f32, exp to 3 ulp; R16F stores 1 to 4.9e-4";
const TOLERANCE: Tolerance = Tolerance { absolute: 6e-4, relative: 0.0, outliers: 0.0, why: WHY };

pub const LATERAL: Pass = Pass {
    name: "gaussian_lateral",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    link: Link::Filter(Filter::of_slices(|s| Some([s.smoothing_radius()[0], 0]))),
    shader: |_, t| {
        if t.writes_volume() { "filter/gaussian.slice" } else { "filter/gaussian.plane" }
    },
    needed: |s| need(RENDERED, s, 0),
    reads: reads_source,
    writes: writes_target,
    extent: |s, t| in_runs(slice_extent(s, t), 0),
    repeat: once,
    params: |s, t| params(RENDERED, s, 0, t),
    constants: |s, _| constants(RENDERED, s, 0),
    tolerance: TOLERANCE,
    reference: |s, t, reads, writes| reference(RENDERED, s, 0, t, reads, writes),
};

pub const DEPTH: Pass = Pass {
    name: "gaussian_depth",
    link: Link::Filter(Filter::of_slices(|s| Some([0, s.smoothing_radius()[1]]))),
    shader: |_, t| {
        if t.writes_volume() { "filter/gaussian.slice" } else { "filter/gaussian.plane" }
    },
    needed: |s| need(RENDERED, s, 1),
    reads: reads_source,
    writes: writes_target,
    extent: |s, t| in_runs(slice_extent(s, t), 1),
    params: |s, t| params(RENDERED, s, 1, t),
    constants: |s, _| constants(RENDERED, s, 1),
    reference: |s, t, reads, writes| reference(RENDERED, s, 1, t, reads, writes),
    ..LATERAL
};

pub const ELEVATION: Pass = Pass {
    name: "gaussian_elevation",
    stage: Stage::Preprocess,
    frequency: Frequency::Volume,
    link: Link::AfterSlices,
    shader: |_, _| "filter/gaussian.volume",
    needed: |s| if s.sharpens() { Ok(SHARPENED) } else { need(RENDERED, s, 2) },
    reads: |s, _| {
        let part = Part::Around(s.smoothing_radius()[2]);
        vec![Bind { part, ..whole("source", Slot::SharpVolume) }]
    },
    writes: |s, _| {
        let target = if s.drops_floating() { Slot::WholeVolume } else { Slot::Volume };
        vec![Bind { part: Part::Around(0), ..whole("target", target) }]
    },
    extent: |s, t| in_runs([s.grid.size[0], s.grid.size[1], t.slices], 2),
    repeat: once,
    params: |s, t| params(RENDERED, s, 2, t).i32("slices", t.slices),
    constants: |s, _| constants(RENDERED, s, 2),
    tolerance: TOLERANCE,
    reference: |s, t, reads, writes| match s.sharpens() {
        true => sharpened(t, reads, writes),
        false => reference(RENDERED, s, 2, t, reads, writes),
    },
};

/// The same for the volume of the planes beside a rendering.
pub const SECTION_LATERAL: Pass = Pass {
    name: "section_lateral",
    link: Link::Filter(Filter { reach: |s| Some([s.section_smoothing_radius()[0], 0]), ..Filter::of(Chain::Sections) }),
    needed: |s| of_sections(s, need(SECTIONS, s, 0)),
    params: |s, t| params(SECTIONS, s, 0, t),
    constants: |s, _| constants(SECTIONS, s, 0),
    reference: |s, t, reads, writes| reference(SECTIONS, s, 0, t, reads, writes),
    ..LATERAL
};

pub const SECTION_DEPTH: Pass = Pass {
    name: "section_depth",
    link: Link::Filter(Filter { reach: |s| Some([0, s.section_smoothing_radius()[1]]), ..Filter::of(Chain::Sections) }),
    needed: |s| of_sections(s, need(SECTIONS, s, 1)),
    params: |s, t| params(SECTIONS, s, 1, t),
    constants: |s, _| constants(SECTIONS, s, 1),
    reference: |s, t, reads, writes| reference(SECTIONS, s, 1, t, reads, writes),
    ..DEPTH
};

pub const SECTION_ELEVATION: Pass = Pass {
    name: "section_elevation",
    needed: |s| of_sections(s, if s.sharpens() { Ok(SHARPENED) } else { need(SECTIONS, s, 2) }),
    reads: |s, _| {
        let part = Part::Around(s.section_smoothing_radius()[2]);
        vec![Bind { part, ..whole("source", Slot::SharpSectionVolume) }]
    },
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("target", Slot::SectionVolume) }],
    params: |s, t| params(SECTIONS, s, 2, t).i32("slices", t.slices),
    constants: |s, _| constants(SECTIONS, s, 2),
    reference: |s, t, reads, writes| match s.sharpens() {
        true => sharpened(t, reads, writes),
        false => reference(SECTIONS, s, 2, t, reads, writes),
    },
    ..ELEVATION
};

const SHARPENED: &str = "the cubic B-spline is to meet the slices";

/// The need of a pass of the volume that planes beside a rendering are cut from.
pub(in crate::passes) fn of_sections(scene: &Scene, need: Need) -> Need {
    if scene.has_sections() { need } else { Err("no planes are cut from a volume of their own") }
}

fn need(volume: Volume, scene: &Scene, axis: usize) -> Need {
    if (volume.deviations)(scene)[axis] > 0.0 { Ok("asked for") } else { Err("not asked for") }
}

fn params(volume: Volume, scene: &Scene, axis: usize, args: &DispatchArgs) -> Params {
    let deviation = (volume.deviations)(scene)[axis];
    // Without a Gaussian the shader has other weights, and no use for this one.
    let narrowness = if deviation > 0.0 { 0.5 / (deviation * deviation) } else { 0.0 };
    Params::default().f32("narrowness", narrowness).i32("slice", args.slice)
}

fn constants(volume: Volume, scene: &Scene, axis: usize) -> Vec<(&'static str, i32)> {
    let sharpens = axis == 2 && scene.sharpens();
    vec![("RADIUS", (volume.radius)(scene)[axis] as i32), ("AXIS", axis as i32), ("SHARPENS", sharpens as i32)]
}

/// (-1, 8, -1)/6 across slices, the border repeated. The cubic B-spline passes 1 - w^2/6 of a slow wave of w radians a slice; this kernel
/// passes 1 + w^2/6.
fn sharpened(args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let source = reads.get("source");
    let target = writes.get_mut("target");
    for z in args.slice as usize..(args.slice + args.slices) as usize {
        for (x, y) in (0..source.size[1]).flat_map(|y| (0..source.size[0]).map(move |x| (x, y))) {
            let tap = |away: i64| source.clamped(x as i64, y as i64, z as i64 + away);
            target.set([x, y, z], &[((8.0 * tap(0) - tap(-1) - tap(1)) / 6.0).clamp(0.0, 1.0)]);
        }
    }
}

fn reference(volume: Volume, scene: &Scene, axis: usize, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let source = reads.get("source");
    let target = writes.get_mut("target");
    let deviation = (volume.deviations)(scene)[axis];
    let radius = i64::from((volume.radius)(scene)[axis]);
    let slices = if axis < 2 { 0..1 } else { args.slice as usize..(args.slice + args.slices) as usize };
    for z in slices {
        for y in 0..source.size[1] {
            for x in 0..source.size[0] {
                let centre = [x, y, z];
                let (mut sum, mut weight) = (0.0, 0.0);
                for i in -radius..=radius {
                    let along = centre[axis] as i64 + i;
                    if along < 0 || along >= source.size[axis] as i64 {
                        continue;
                    }
                    let mut tap = centre;
                    tap[axis] = along as usize;
                    let w = (-0.5 * (i as f64 / deviation).powi(2)).exp();
                    sum += w * source.one(tap[0], tap[1], tap[2]);
                    weight += w;
                }
                let z = if axis < 2 && target.size[2] > 1 { args.slice as usize } else { z };
                target.set([x, y, z], &[sum / weight]);
            }
        }
    }
}
