//! 3D Gaussian in texture space (lateral, depth, elevation), one axis a pass. The two in-plane axes are filtered on each
//! slice as it arrives; the third when its neighbours are there, for the slices that a new frame is near.

use crate::passes::pass::*;
use crate::scene::Scene;

/// A volume that is smoothed.
struct Volume {
    chain: Chain,
    /// Pixels, pixels, slices.
    deviations: fn(&Scene) -> [f64; 3],
    /// Taps on one side.
    radius: fn(&Scene) -> [u32; 3],
    /// What its passes need besides.
    needed: fn(&Scene, Need) -> Need,
    /// Smoothed within the slices only.
    sharp: Slot,
}

/// The volume that rays are cast through, and that which planes beside a rendering are cut from. A pass refers to its volume by number,
/// because its functions can capture nothing but constants.
const VOLUMES: [Volume; 2] = [
    Volume {
        chain: Chain::Slices,
        deviations: Scene::smoothing,
        radius: Scene::smoothing_radius,
        needed: |_, need| need,
        sharp: Slot::SharpVolume,
    },
    Volume {
        chain: Chain::Sections,
        deviations: Scene::section_smoothing,
        radius: Scene::section_smoothing_radius,
        needed: of_sections,
        sharp: Slot::SharpSectionVolume,
    },
];
const RENDERED: usize = 0;
const SECTIONS: usize = 1;

/// Number of adjacent texels, along the axis that is filtered, that one invocation computes: RUN of glsl/filter/gaussian.comp.
pub const RUN: u32 = 8;

/// Words of the tile of a workgroup along rows: TILE_PITCH and TILE_ROWS of glsl/filter/gaussian.comp.
fn tile_words(radius: u32) -> u32 {
    let columns = GROUP * RUN + 2 * radius;
    ((columns + columns / RUN + 7) / 16 * 16 + 8) * GROUP
}

const WHY: &str = "at most 193 weighted values in f32; R16F stores 1 to 4.9e-4";
const TOLERANCE: Tolerance = Tolerance::absolute(6e-4).because(WHY);

pub const LATERAL: Pass = within_slices::<RENDERED, 0>("gaussian_lateral");
pub const DEPTH: Pass = within_slices::<RENDERED, 1>("gaussian_depth");
pub(crate) const ELEVATION: Pass = across_slices::<RENDERED>("gaussian_elevation");
pub(crate) const SECTION_LATERAL: Pass = within_slices::<SECTIONS, 0>("section_lateral");
pub(crate) const SECTION_DEPTH: Pass = within_slices::<SECTIONS, 1>("section_depth");
pub(crate) const SECTION_ELEVATION: Pass = across_slices::<SECTIONS>("section_elevation");

/// The pass of an axis of the slices.
const fn within_slices<const VOLUME: usize, const AXIS: usize>(name: &'static str) -> Pass {
    Pass {
        name,
        link: Link::Filter(Filter {
            reach: |s| {
                let mut reach = [0; 2];
                reach[AXIS] = (VOLUMES[VOLUME].radius)(s)[AXIS];
                Some(reach)
            },
            run: RUN,
            ..Filter::of(VOLUMES[VOLUME].chain)
        }),
        shader: |_, _| "filter/gaussian",
        needed: |s| need(VOLUME, s, AXIS),
        extent: |s, t| in_runs_of(RUN, slice_extent(s, t), AXIS),
        params: |s, t| params(VOLUME, s, AXIS, t),
        constants: |s, _| constants(VOLUME, s, AXIS),
        tolerance: TOLERANCE,
        reference: |s, t, reads, writes| reference(VOLUME, s, AXIS, t, reads, writes),
        ..Pass::OF_SLICES
    }
}

/// The pass across the slices, which also sharpens them for the cubic B-spline.
const fn across_slices<const VOLUME: usize>(name: &'static str) -> Pass {
    Pass {
        name,
        shader: |_, _| "filter/gaussian",
        needed: |s| match s.sharpens() {
            true => (VOLUMES[VOLUME].needed)(s, Ok("the cubic B-spline is to meet the slices")),
            false => need(VOLUME, s, 2),
        },
        reads: |s, _| {
            let part = Part::Around((VOLUMES[VOLUME].radius)(s)[2]);
            vec![Bind { part, ..whole("source", VOLUMES[VOLUME].sharp) }]
        },
        writes: |s, _| {
            let target = VOLUMES[VOLUME].chain.volume(s).into_iter();
            target.map(|slot| Bind { part: Part::Around(0), ..whole("target", slot) }).collect()
        },
        extent: |s, t| in_runs_of(RUN, slice_extent(s, t), 2),
        params: |s, t| params(VOLUME, s, 2, t),
        constants: |s, _| [constants(VOLUME, s, 2), vec![("LAYERED", 0)]].concat(),
        tolerance: TOLERANCE,
        reference: |s, t, reads, writes| match s.sharpens() {
            true => sharpened(t, reads, writes),
            false => reference(VOLUME, s, 2, t, reads, writes),
        },
        ..Pass::AFTER_SLICES
    }
}

fn need(volume: usize, scene: &Scene, axis: usize) -> Need {
    let Volume { deviations, needed, .. } = VOLUMES[volume];
    needed(scene, if deviations(scene)[axis] > 0.0 { Ok("asked for") } else { Err("not asked for") })
}

fn params(volume: usize, scene: &Scene, axis: usize, args: &DispatchArgs) -> Params {
    let weights = match sharpens(scene, axis) {
        true => vec![8.0 / 6.0, -1.0 / 6.0],
        false => {
            let deviation = (VOLUMES[volume].deviations)(scene)[axis];
            let radius = (VOLUMES[volume].radius)(scene)[axis];
            let bell: Vec<f64> = (0..=radius).map(|i| (-0.5 * (f64::from(i) / deviation).powi(2)).exp()).collect();
            let sum = 2.0 * bell.iter().sum::<f64>() - bell[0];
            bell.iter().map(|w| w / sum).collect()
        }
    };
    Params::default().i32("slice", args.slice).i32("slices", args.slices).floats("weights", &weights)
}

/// True of the pass across slices that are sharpened.
fn sharpens(scene: &Scene, axis: usize) -> bool {
    axis == 2 && scene.sharpens()
}

fn constants(volume: usize, scene: &Scene, axis: usize) -> Vec<(&'static str, i32)> {
    let radius = (VOLUMES[volume].radius)(scene)[axis];
    // Along columns, adjacent invocations read adjacent texels anyhow: there the tile cost an H200 a tenth more.
    let is_tiled = axis == 0 && reads_tile(scene, tile_words(radius));
    vec![
        ("RADIUS", radius as i32),
        ("AXIS", axis as i32),
        ("SHARPENS", i32::from(sharpens(scene, axis))),
        ("TILED", i32::from(is_tiled)),
    ]
}

/// (-1, 8, -1)/6 across slices, the border repeated. The cubic B-spline passes 1 - w^2/6 of a slow wave of w radians a slice; this kernel
/// passes 1 + w^2/6.
fn sharpened(args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let source = reads.get("source");
    writes.get_mut("target").fill_slices(args.written(), |[x, y, z]| {
        let tap = |away: i64| source.clamped(x as i64, y as i64, z as i64 + away);
        [((8.0 * tap(0) - tap(-1) - tap(1)) / 6.0).clamp(0.0, 1.0)]
    });
}

fn reference(volume: usize, scene: &Scene, axis: usize, args: &DispatchArgs, reads: &Arrays, writes: &mut Arrays) {
    let source = reads.get("source");
    let target = writes.get_mut("target");
    let deviation = (VOLUMES[volume].deviations)(scene)[axis];
    let radius = i64::from((VOLUMES[volume].radius)(scene)[axis]);
    let slices = if axis < 2 { 0..1 } else { args.written() };
    for z in slices {
        for (x, y) in source.pixels() {
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
