//! What both ray casters share: the parameters of rays and sweep map, and in f64 a ray's way through the volume.

use crate::passes::tables::{LUT_ENTRIES, is_uneven, line_parameter, sweep_span};
use crate::passes::*;
use crate::probe::{Advance, Array, Geometry, Motion, Probe};
use crate::scene::{MAX_CLIPS, Sampling, Scene};

/// Picks the variant that has the tables this geometry needs, and no other.
macro_rules! variant {
    ($scene:expr, $shader:literal) => {
        match crate::passes::raycast::ray::tables($scene) {
            (false, _, _) => concat!($shader, ".plain"),
            (true, false, false) => concat!($shader, ".even"),
            (true, false, true) => concat!($shader, ".moved"),
            (true, true, false) => concat!($shader, ".uneven"),
            (true, true, true) => concat!($shader, ".uneven_moved"),
        }
    };
}
pub(super) use variant;

/// Whether the sweep look-up table, the table of slices, and the line look-up table are needed.
pub(super) fn tables(scene: &Scene) -> (bool, bool, bool) {
    match &scene.geometry {
        Geometry::Sweep(probe) => {
            let swept = !matches!(probe.motion, Motion::Still { .. });
            let moved = match &probe.advance {
                Advance::None => false,
                Advance::Same(a) => *a != 0.0,
                Advance::Each(table) => table.iter().any(|a| *a != 0.0),
            };
            (swept, swept && is_uneven(&scene.geometry), swept && moved)
        }
        Geometry::Cartesian(_) => (false, false, false),
    }
}

pub(super) fn reads(scene: &Scene) -> Vec<Bind> {
    let (swept, uneven, moved) = tables(scene);
    let mut reads = vec![whole("volume", Slot::Volume)];
    reads.extend(swept.then_some(whole("sweep_lut", Slot::SweepLut)));
    reads.extend(moved.then_some(whole("line_lut", Slot::LineLut)));
    reads.extend(uneven.then_some(whole("slice_table", Slot::SliceTable)));
    reads
}

pub(super) fn constants(scene: &Scene) -> Vec<(&'static str, i32)> {
    let (sweep, array) = match &scene.geometry {
        Geometry::Cartesian(_) => (0, 0),
        Geometry::Sweep(probe) => (
            match probe.motion {
                Motion::Fan { .. } => 1,
                Motion::Translated => 2,
                Motion::Still { .. } => 3,
            },
            match probe.array {
                Array::Linear => 0,
                Array::Curved { .. } => 1,
            },
        ),
    };
    let sampling = match scene.settings.ray.sampling {
        Sampling::Hardware => 0,
        Sampling::Exact => 1,
    };
    vec![("SWEEP", sweep), ("ARRAY", array), ("SAMPLING", sampling), ("CLIPS", scene.settings.clip.len() as i32)]
}

pub(super) fn params(scene: &Scene, [window_low, window_high]: [f64; 2]) -> Params {
    let grid = &scene.grid;
    let mut clips = [[0.0; 4]; MAX_CLIPS];
    for (clip, (normal, limit)) in clips.iter_mut().zip(scene.clips()) {
        *clip = [normal.x, normal.y, normal.z, limit];
    }
    let [clip_0, clip_1, clip_2, clip_3] = clips;
    let params = ray_params(scene)
        .vec4("clip_0", clip_0)
        .vec4("clip_1", clip_1)
        .vec4("clip_2", clip_2)
        .vec4("clip_3", clip_3)
        .vec3("box_low", scene.low)
        .vec3("box_high", scene.high)
        .f32("step_length", scene.step)
        .f32("window_low", window_low)
        .f32("window_scale", 1.0 / (window_high - window_low))
        .vec2("grid_origin", grid.origin)
        .vec2("grid_density", grid.pitch.map(|p| 1.0 / p));
    match &scene.geometry {
        Geometry::Cartesian(volume) => sector(params, [0.0; 4])
            .f32("slice_origin", volume.origin[2])
            .f32("slice_density", 1.0 / volume.spacing[2])
            .f32("axis_depth", 0.0)
            .f32("sweep_low", 0.0)
            .f32("sweep_density", 0.0)
            .f32("line_density", 0.0)
            .f32("advance", 0.0),
        Geometry::Sweep(probe) => {
            let low = line_parameter(probe.array, probe.lines.first());
            let high = line_parameter(probe.array, probe.lines.last());
            let (sweep_low, sweep_high) = sweep_span(probe);
            let entries = (LUT_ENTRIES - 1) as f64;
            let advance = match &probe.advance {
                Advance::Same(a) => a / probe.slices.pitch(),
                _ => 0.0,
            };
            let swept = tables(scene).0;
            sector(params, [probe.first_range(), probe.last_range(), low, high])
                .f32("slice_origin", 0.0)
                .f32("slice_density", 0.0)
                .f32("axis_depth", probe.axis_depth())
                .f32("sweep_low", if swept { sweep_low } else { 0.0 })
                .f32("sweep_density", if swept { entries / (sweep_high - sweep_low) } else { 0.0 })
                .f32("line_density", entries / (high - low))
                .f32("advance", if swept { advance } else { 0.0 })
        }
    }
}

fn sector(params: Params, [range_low, range_high, line_low, line_high]: [f64; 4]) -> Params {
    params
        .f32("range_low", range_low)
        .f32("range_high", range_high)
        .f32("line_low", line_low)
        .f32("line_high", line_high)
}

/// Where a ray enters and leaves the box, mm; leave < enter is a miss.
pub(super) fn span(scene: &Scene, origin: DVec3, direction: DVec3) -> (f64, f64) {
    let (mut enter, mut leave) = (0.0f64, f64::MAX);
    for axis in 0..3 {
        let (low, high) = (scene.low[axis] - origin[axis], scene.high[axis] - origin[axis]);
        if direction[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return (0.0, -1.0);
            }
            continue;
        }
        let (a, b) = (low / direction[axis], high / direction[axis]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    for (normal, limit) in scene.clips() {
        let (towards, room) = (normal.dot(direction), limit - normal.dot(origin));
        match towards.abs() < 1e-12 {
            true if room < 0.0 => return (0.0, -1.0),
            true => {}
            false if towards > 0.0 => leave = leave.min(room / towards),
            false => enter = enter.max(room / towards),
        }
    }
    (enter, leave)
}

/// Texture indices of a place in space; none outside the insonified region. By the exact inverse of the probe's maps, not by the
/// tables that the shader reads.
pub(super) fn texel(scene: &Scene, place: DVec3) -> Option<[f64; 3]> {
    let grid = &scene.grid;
    let column = |x: f64, y: f64| [(x - grid.origin[0]) / grid.pitch[0], (y - grid.origin[1]) / grid.pitch[1]];
    match &scene.geometry {
        Geometry::Cartesian(volume) => {
            let [i, j] = column(place.x, place.y);
            Some([i, j, (place.z - volume.origin[2]) / volume.spacing[2]])
        }
        Geometry::Sweep(probe) => {
            let (x, y, _) = probe.unswept(place);
            let at = probe.to_indices(place);
            let [i, j] = column(x, y);
            inside(probe, at).then_some([i, j, at.slice])
        }
    }
}

fn inside(probe: &Probe, at: crate::probe::Indices) -> bool {
    let within = |index: f64, count: usize| index >= 0.0 && index <= (count - 1) as f64;
    within(at.sample, probe.samples) && within(at.line, probe.lines.len()) && within(at.slice, probe.slices.len())
}

/// The windowed sample at a place on a ray; none outside the insonified region.
pub(super) fn sample(scene: &Scene, volume: &Texels, place: DVec3) -> Option<f64> {
    let [low, high] = scene.window();
    texel(scene, place).map(|at| ((volume.trilinear(at) - low) / (high - low)).clamp(0.0, 1.0))
}
