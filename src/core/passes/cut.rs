//! Cuts: the volume that rays are cast through, without what lies within (or outside of) the contours that the user drew, and in front of the
//! render start that the user drew (`region.start_curve`) or that follows the fluid (`unveil`), whichever is deeper. The volume stays as it is beside it, so that a cut that is drawn, changed or taken back needs no
//! frame again.
//!
//! A texel is removed if its centre is, and gets a value of which the rendering draws nothing. What skips empty space, packed neighbours and the light
//! volume read what is left.

use super::lookup_tables;
use super::pass::*;
use super::raycast::ray;
use crate::probe::{Geometry, Motion};
use crate::scene::{Scene, start_curve};

pub(crate) const PASS: Pass = Pass {
    name: "cut",
    shader: |_, _| "preprocess/cut",
    needed: |s| match (s.has_cuts(), s.unveils(), s.starts_at_curve()) {
        (true, false, false) => Ok("what was cut away is not drawn"),
        (true, ..) => Ok("what was cut away, and what is in front of the render start, is not drawn"),
        (false, true, false) => Ok("what is in front of the fluid is not drawn"),
        (false, _, true) => Ok("what is in front of the render start is not drawn"),
        (false, false, false) => Err("nothing is cut away, or nothing is drawn that could be"),
    },
    // A slice changes with the frames that are smoothed into it.
    reads: |s, _| {
        let mut reads = vec![Bind { part: Part::Around(s.reach_to_frames()), ..whole("source", Slot::Volume) }];
        if s.has_cuts() {
            reads.extend([whole("slice_places", Slot::SlicePlaces), whole("cuts", Slot::Cuts)]);
            reads.extend(s.moves_in_frames().then_some(whole("line_shares", Slot::LineShares)));
        }
        reads.extend(s.unveils().then_some(whole("start_surface", Slot::StartSurface)));
        reads.extend(s.starts_at_curve().then_some(whole("start_curve", Slot::StartCurve)));
        reads
    },
    writes: |_, _| vec![Bind { part: Part::Around(0), ..whole("target", Slot::CutVolume) }],
    params: |s, t| {
        let (grid, local) = (&s.grid, s.local_origin());
        Params::default()
            .f32("removed", removed(s))
            .i32("cut_count", s.settings.cuts.len() as u32)
            .vec2("grid_origin", [grid.origin[0] - local.x, grid.origin[1] - local.y])
            .vec2("grid_pitch", grid.pitch)
            .f32("axis_depth", s.probe().map_or(0.0, |probe| probe.axis_depth()))
            .i32("slice", t.slice)
    },
    constants: |s, _| {
        vec![
            ("SWEEP", ray::sweep(s)),
            ("INTRA_FRAME_MOTION", (s.has_cuts() && s.moves_in_frames()) as i32),
            ("CUTS", s.has_cuts() as i32),
            ("UNVEILS", s.unveils() as i32),
            ("CURVED_START", s.starts_at_curve() as i32),
        ]
    },
    tolerance: Tolerance::absolute(5e-4).outliers(1e-3).because(
        "a copy, but for what is removed; R16F stores 1 to 4.9e-4; a texel whose centre is within 1e-5 of its distance \
         from the origin of a contour's edge may be on either side",
    ),
    reference: |scene, args, reads, writes| {
        let source = reads.get("source");
        let cuts: Vec<_> = scene.cuts().collect();
        let curve = scene.start_curve();
        writes.get_mut("target").fill_slices(args.written(), |[x, y, z]| {
            let place = scene.texel_place([x, y, z].map(|n| n as u32));
            let is_before = scene.unveils() && (y as f64) < reads.get("start_surface").one(x, z, 0);
            let is_before = is_before || curve.as_ref().is_some_and(|curve| start_curve::is_before(curve, place));
            let is_removed = is_before || cuts.iter().any(|cut| cut.removes(place));
            [if is_removed { removed(scene) } else { source.one(x, y, z) }]
        });
    },
    ..Pass::AFTER_SLICES
};

fn removed(scene: &Scene) -> f64 {
    scene.removed_value().unwrap_or(0.0)
}

/// Vectors of four before the edges of a cut: HEADER of cut.comp.
const HEADER: usize = 5;

/// What tells a brush from a contour: its header has the corners of its bounds in place of the axes.
const BRUSH: f64 = 2.0;

/// Length of the table of all cuts, in vectors of four floats.
pub(super) fn table_length(scene: &Scene) -> usize {
    HEADER * scene.settings.cuts.len() + scene.cut_corners()
}

/// The table of cuts as cut.comp reads it; places are relative to [`Scene::local_origin`].
pub(super) fn table(scene: &Scene) -> Vec<f32> {
    let mut table: Vec<f64> = Vec::with_capacity(4 * table_length(scene));
    for cut in scene.cuts() {
        if let Some(brush) = &cut.brush {
            brush.bounds().into_iter().for_each(|corner| table.extend(scene.to_local(corner).extend(0.0).to_array()));
            let count = brush.strokes.iter().map(Vec::len).sum::<usize>();
            table.extend([0.0; 4]);
            table.extend([brush.radius, 0.0, BRUSH, count as f64]);
            table.extend([0.0; 4]);
            for stroke in &brush.strokes {
                // A stroke begins where w is 1.
                let points = stroke.iter().enumerate().map(|(n, point)| (scene.to_local(*point), f64::from(n == 0)));
                table.extend(points.flat_map(|(point, begins)| point.extend(begins).to_array()));
            }
            continue;
        }
        let at = scene.to_local(cut.at);
        for axis in [cut.right, cut.up, cut.forward] {
            table.extend(axis.extend(-axis.dot(at)).to_array());
        }
        // The largest float is deeper than everything.
        let depth = cut.depth.unwrap_or(MISS);
        let removes_inside = if cut.removes_inside { 1.0 } else { 0.0 };
        table.extend([cut.eye.unwrap_or(0.0), depth, removes_inside, cut.contour.len() as f64]);
        let [low, high] = cut.bounds();
        table.extend([low.x, low.y, high.x, high.y]);
        let next = cut.contour.iter().cycle().skip(1);
        table.extend(cut.contour.iter().zip(next).flat_map(|(from, to)| [from.x, from.y, to.x, to.y]));
    }
    lookup_tables::floats(table)
}

/// The place of each slice as cut.comp reads it, four floats a slice: cosine and sine of its angle in a fan, otherwise 0 and its z relative to
/// [`Scene::local_origin`], mm; the motor's travel while its frame is acquired (rad or mm); and 0.
pub(super) fn slice_places(scene: &Scene) -> Vec<f32> {
    let place = |slice: u32| {
        let slice = f64::from(slice);
        match &scene.geometry {
            Geometry::Cartesian(grid) => {
                [0.0, grid.origin[2] + slice * grid.spacing[2] - scene.local_origin().z, 0.0, 0.0]
            }
            Geometry::Sweep(probe) => {
                let (at, advance) = (probe.slices.at(slice), probe.advance_at(slice));
                match probe.motion {
                    Motion::Fan { .. } => [at.cos(), at.sin(), advance, 0.0],
                    Motion::Translated => [0.0, at, advance, 0.0],
                    Motion::Still { .. } => [0.0; 4],
                }
            }
        }
    };
    lookup_tables::floats((0..scene.slices()).flat_map(place))
}

/// The row at which rendering starts by `region.start_curve`, for each column and slice of the volume.
pub(super) fn start_curve(scene: &Scene) -> Vec<f32> {
    scene.start_curve_rows().into_iter().map(|row| row as f32).collect()
}

/// For each texel of a slice, the share (0..1) of the frame's lines that fired before the line through that texel.
pub(super) fn line_shares(scene: &Scene) -> Vec<f32> {
    lookup_tables::floats(pixels(scene.grid.size).map(|(column, row)| scene.share_fired(column, row)))
}
