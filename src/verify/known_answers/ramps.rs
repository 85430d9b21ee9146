//! Ramps of space: where a texel lies is read off its value.

use super::{fault, fine, show};
use crate::gpu::GpuError;
use crate::passes::slots::Format;
use crate::passes::{Slot, Texels};
use crate::probe::Geometry;
use crate::verify::built_in::{FLOATS, body_frames, scene};
use crate::verify::report::{Figure, Unit};
use crate::verify::{Bench, Found, drawn};
use glam::DVec3;

/// A plane through the sweep, and what is allowed there.
struct View {
    plane: &'static str,
    turn: f64,
    position: [f64; 3],
    zoom: f64,
    /// mm of the ramp that are shown from black to white.
    shown: f64,
    /// mm.
    allowed: f64,
}

/// A wide view is off by what its picture's 11 bits hold of 80 mm. A near one shows what lies between samples, lines and frames, where
/// straight lines stand for arcs: 0.013 rad at 60 mm are 1.3 um aside, and the texture's own lattice adds as much.
const VIEWS: [View; 4] = {
    let wide = View { plane: "a", turn: 0.0, position: [0.7, 40.3, -0.4], zoom: 3.0, shown: 80.0, allowed: 0.05 };
    [
        View { ..wide },
        View { plane: "b", ..wide },
        View { turn: 20.0, ..wide },
        View { plane: "b", turn: 20.0, position: [3.7, 47.3, 9.4], zoom: 12.0, shown: 4.0, allowed: 0.003 },
    ]
};

/// A value that grows along an axis of space is, in the plane of a sweep that was converted, what it is in space: nothing is
/// mirrored, swapped or half a texel aside.
pub(super) fn in_space(bench: &mut Bench) -> Result<Found, GpuError> {
    let (mut found, mut wide, mut near) = (Found::default(), 0.0f64, 0.0f64);
    for axis in 0..3 {
        for view in &VIEWS {
            let error = along(bench, axis, view, &mut found)?;
            let largest = if view.shown > 10.0 { &mut wide } else { &mut near };
            *largest = if error.is_nan() { error } else { largest.max(error) };
        }
    }
    found.figures.push(Figure::error("largest error beyond rounding", wide, VIEWS[0].allowed, Unit::Millimetres));
    found.figures.push(Figure::error("the same from near", near, VIEWS[3].allowed, Unit::Millimetres));
    Ok(found)
}

/// The largest error of one ramp in one view, mm.
fn along(bench: &mut Bench, axis: usize, view: &View, found: &mut Found) -> Result<f64, GpuError> {
    let name = ["lateral", "depth", "elevation"][axis];
    let View { plane, turn, position, zoom, shown, allowed } = *view;
    // In 0..1 over 80 mm, so that nothing is cut off; the window shows a part of it.
    let low = if axis == 1 { 0.0 } else { -40.0 };
    let level = |p: DVec3| (p[axis] - low) / 80.0;
    let of = |window: [f64; 2]| {
        let toml = format!(
            "mode = 'plane'\npicture = {{ size = [48, 40] }}\nslices = {{ pixels = 160, format = 'r32f' }}\npost = {{ floats = true }}\n\
             planes = {{ plane = '{plane}', azimuth = {turn}, position = {position:?}, zoom = {zoom}, lines = false, window = {window:?} }}\n\
             ray = {{ sampling = 'exact' }}"
        );
        scene(Geometry::Sweep(fine()), FLOATS, &toml).map_err(GpuError::Broken)
    };
    let whole = of([0.0, 1.0])?;
    // What the middle of the picture shows.
    let middle = whole.sheet().tiles.first().map_or(0.5, |tile| level(tile.plane.at));
    let window = if shown < 80.0 { [-0.5, 0.5].map(|side| middle + side * shown / 80.0) } else { [0.0, 1.0] };
    let scene = of(window)?;
    let got = drawn::slot(&bench.context, &scene, &body_frames(&scene, level), Slot::Picture)?;
    let (sheet, mut largest, mut judged) = (scene.sheet(), 0.0f64, 0);
    let ([tile], Some(sweep)) = (&sheet.tiles[..], scene.probe()) else { return Ok(f64::NAN) };
    let (faults, mut known) = (found.faults.len(), Vec::new());
    let from_middle = |at: usize, axis: usize| (at as f64 + 0.5 - f64::from(tile.size[axis]) / 2.0) * sheet.pixel;
    for (x, y) in (0..got.size[1]).flat_map(|y| (0..got.size[0]).map(move |x| (x, y))) {
        let p = tile.plane.at + tile.plane.right * from_middle(x, 0) + tile.plane.down * from_middle(y, 1);
        // Away from the border, where black is mixed in.
        let (at, within) = (sweep.to_indices(p), |v: f64, n: usize| v > 1.0 && v < n as f64 - 2.0);
        let expected = (level(p) - window[0]) / (window[1] - window[0]);
        let is_seen = within(at.sample, sweep.samples)
            && within(at.line, sweep.lines.len())
            && within(at.slice, sweep.slices.len())
            && (0.01..0.99).contains(&expected);
        if !is_seen {
            continue;
        }
        judged += 1;
        known.push(([x, y, 0], expected));
        let seen = got.get([x, y, 0])[0];
        // A driver may store the value below or the one above.
        let rounding = Texels::spacing(Format::Rgba16f, expected);
        let error = ((seen - expected).abs() - rounding).max(0.0) * shown;
        largest = if error.is_nan() || largest.is_nan() { f64::NAN } else { largest.max(error) };
        if (error.is_nan() || error > allowed) && found.faults.len() < 4 {
            let input =
                format!("a ramp along {name}, plane {plane} turned by {turn} deg, {shown} mm from black to white");
            let at = [x, y, 0];
            found.faults.push(fault(input, "what is there is somewhere else", "picture", at, [expected, seen]));
        }
    }
    if found.faults.len() > faults {
        show(found, &format!("a ramp along {name}, plane {plane}"), &got, 0, known);
    }
    found.expect(judged > 200, || format!("only {judged} texels of a ramp along {name} can be judged"));
    Ok(largest)
}
