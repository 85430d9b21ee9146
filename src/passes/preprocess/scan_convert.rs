//! Scan conversion of one polar frame into one slice, through the look-up table (thesis 4.3, Fig. 31).

use crate::passes::lookup_tables::scan_index;
use crate::passes::pass::*;
use crate::scene::Scene;
use crate::source::StoredType;

pub const PASS: Pass = Pass {
    name: "scan_convert",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    link: Link::Filter(Filter::of(Chain::Slices)),
    shader: |_, t| {
        if t.writes_volume() { "preprocess/scan_convert.slice" } else { "preprocess/scan_convert.plane" }
    },
    needed: |s| match s.probe() {
        Some(_) => Ok("frames are polar"),
        None => Err("the volume is Cartesian already"),
    },
    reads: |s, _| {
        let frames = if s.conditions() { whole("frames", Slot::Conditioned) } else { layer("frames", Slot::Frames) };
        vec![frames, whole("scan_lut", Slot::ScanLut)]
    },
    writes: writes_target,
    extent: slice_extent,
    repeat: once,
    params: |s, t| {
        let (gain, offset) = scale(s);
        Params::default().f32("gain", gain).f32("offset", offset).i32("slice", t.slice)
    },
    constants: no_constants,
    tolerance: Tolerance {
        absolute: 1e-3,
        relative: 0.0,
        outliers: 0.0,
        why: "a table entry near 3640 has 2.4e-4 samples of rounding in f32, times a step of at most 1 between samples, \
              twice over two interpolations; R16F stores 1 to 4.9e-4",
    },
    reference: |scene, args, reads, writes| {
        let Some(probe) = scene.probe() else { return };
        let frames = reads.get("frames");
        let target = writes.get_mut("target");
        let z = if target.size[2] > 1 { args.slice as usize } else { 0 };
        let (gain, offset) = scale(scene);
        for row in 0..scene.grid.size[1] {
            for column in 0..scene.grid.size[0] {
                let (x, y) = scene.grid.place(f64::from(column), f64::from(row));
                let Some((sample, line)) = scan_index(scene, probe, x, y) else {
                    // The volume's own texels there are never written; filters must not see what an earlier frame left.
                    if !args.writes_volume() {
                        target.set([column as usize, row as usize, z], &[0.0]);
                    }
                    continue;
                };
                let value = bilinear(frames, sample, line);
                let value = (value * gain + offset).clamp(0.0, 1.0);
                target.set([column as usize, row as usize, z], &[value]);
            }
        }
    },
};

fn bilinear(frames: &Texels, sample: f64, line: f64) -> f64 {
    let (i, j) = (sample.floor() as i64, line.floor() as i64);
    let (u, v) = (sample - i as f64, line - j as f64);
    let at = |di, dj| frames.clamped(i + di, j + dj, 0);
    (1.0 - v) * ((1.0 - u) * at(0, 0) + u * at(1, 0)) + v * ((1.0 - u) * at(0, 1) + u * at(1, 1))
}

/// Of what is converted: conditioned frames are scaled already.
fn scale(scene: &Scene) -> (f64, f64) {
    if scene.conditions() { (1.0, 0.0) } else { normalisation(scene) }
}

/// Gain and offset from what the frame's texture yields to 0..1.
pub(super) fn normalisation(scene: &Scene) -> (f64, f64) {
    let [low, high] = scene.input.range;
    let full = match scene.input.stored {
        StoredType::U8 => 255.0,
        StoredType::U16 => 65535.0,
        StoredType::F32 => 1.0,
    };
    (full / (high - low), -low / (high - low))
}

pub(super) fn load_params(scene: &Scene, args: &DispatchArgs) -> Params {
    let (gain, offset) = normalisation(scene);
    Params::default().f32("gain", gain).f32("offset", offset).i32("slice", args.slice)
}
