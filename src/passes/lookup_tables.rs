//! Tables that the CPU makes from the scene, in f64: what shaders look up instead of computing it for every sample.

use crate::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use crate::scene::{Scene, transfer};

fn floats(values: impl IntoIterator<Item = f64>) -> Vec<f32> {
    values.into_iter().map(|v| v as f32).collect()
}

/// (sample, line) of every slice pixel in f32, -1 where the pixel is left out. With an apron of 0 the PLUS toolkit's rule
/// holds: both neighbours must exist in both directions, so the last sample and line themselves are out.
pub fn scan_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let [width, height] = scene.grid.size;
    let mut lut = Vec::with_capacity(2 * width as usize * height as usize);
    for row in 0..height {
        for column in 0..width {
            let (x, y) = scene.grid.place(f64::from(column), f64::from(row));
            let (sample, line) = scan_index(scene, probe, x, y).unwrap_or((-1.0, -1.0));
            lut.extend([sample as f32, line as f32]);
        }
    }
    lut
}

/// Gain of every sample of a line: a factor of linear envelopes, an addend of samples that are compressed already.
pub fn tgc(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let c = &scene.settings.conditioning;
    floats((0..probe.samples).map(|i| {
        let gain = c.gain(probe.start_depth + probe.sample_pitch * i as f64);
        if c.dynamic_range.is_some() { 10f64.powf(gain / 20.0) } else { gain / c.compressed_range }
    }))
}

/// Fractional (sample, line) that a slice pixel at in-plane (x, y) shows, or none. Samples are counted on the lattice that is
/// scan-converted: decimated by M, sample j lies at sample j M of the frame, and what lies beyond the last takes the last.
pub fn scan_index(scene: &Scene, probe: &Probe, x: f64, y: f64) -> Option<(f64, f64)> {
    let (sample, line) = probe.plane_indices(x, y);
    let factor = f64::from(scene.decimation());
    let kept = factor * f64::from(scene.line_lattice()[0] - 1);
    let (last_sample, last_line) = ((probe.samples - 1) as f64, (probe.lines.len() - 1) as f64);
    if scene.apron <= 0.0 {
        let inside = sample >= 0.0 && sample < kept && line >= 0.0 && line < last_line;
        return inside.then_some((sample / factor, line));
    }
    let (near_sample, near_line) = (sample.clamp(0.0, last_sample), line.clamp(0.0, last_line));
    let (near_x, near_y) = probe.plane_point(near_sample, near_line);
    let [px, py] = scene.grid.pitch;
    let away = ((x - near_x) / px).hypot((y - near_y) / py);
    (away <= scene.apron).then_some((near_sample.min(kept) / factor, near_line))
}

/// The parameter that the sweep look-up table is entered by: the tangent of half the angle about the wobble axis, or mm.
pub fn sweep_parameter(motion: Motion, position: f64) -> f64 {
    match motion {
        Motion::Fan { .. } => (position / 2.0).tan(),
        _ => position,
    }
}

fn sweep_position(motion: Motion, parameter: f64) -> f64 {
    match motion {
        Motion::Fan { .. } => 2.0 * parameter.atan(),
        _ => parameter,
    }
}

/// The parameter that the line look-up table is entered by: the tangent of half the in-plane angle, or mm.
pub fn line_parameter(array: Array, position: f64) -> f64 {
    match array {
        Array::Curved { .. } => (position / 2.0).tan(),
        Array::Linear => position,
    }
}

/// Lowest and highest parameter of the sweep table.
pub fn sweep_span(probe: &Probe) -> (f64, f64) {
    let (first, last) = probe.slice_bounds();
    (sweep_parameter(probe.motion, first), sweep_parameter(probe.motion, last))
}

/// Slice position in mean pitches from slice 0, over the sweep's parameter: the slice index itself for an even sweep.
pub fn sweep_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let entries = scene.settings.ray.entries;
    let (low, high) = sweep_span(probe);
    floats((0..entries).map(|i| {
        let parameter = low + (high - low) * f64::from(i) / f64::from(entries - 1);
        (sweep_position(probe.motion, parameter) - probe.slices.first()) / probe.slices.pitch()
    }))
}

/// Share of a frame's lines that fired before the line at each parameter.
pub fn line_lut(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let entries = scene.settings.ray.entries;
    let low = line_parameter(probe.array, probe.lines.first());
    let high = line_parameter(probe.array, probe.lines.last());
    floats((0..entries).map(|i| {
        let parameter = low + (high - low) * f64::from(i) / f64::from(entries - 1);
        let position = match probe.array {
            Array::Curved { .. } => 2.0 * parameter.atan(),
            Array::Linear => parameter,
        };
        probe.lines.index_of(position) / probe.lines.len() as f64
    }))
}

/// Position and advance of every slice, in mean pitches from slice 0.
pub fn slice_table(scene: &Scene) -> Vec<f32> {
    let Some(probe) = scene.probe() else { return Vec::new() };
    let pitch = probe.slices.pitch();
    floats((0..probe.slices.len()).flat_map(|k| {
        let advance = match &probe.advance {
            Advance::None => 0.0,
            Advance::Same(a) => *a,
            Advance::Each(table) => table.get(k).copied().unwrap_or(0.0),
        };
        [(probe.slices.at(k as f64) - probe.slices.first()) / pitch, advance / pitch]
    }))
}

/// Whether slices lie unevenly or were taken in mixed directions, so that a slice is found by bracketing.
pub fn is_uneven(geometry: &Geometry) -> bool {
    match geometry {
        Geometry::Sweep(p) => matches!(p.slices, Axis::Table(_)) || matches!(p.advance, Advance::Each(_)),
        Geometry::Cartesian(_) => false,
    }
}

/// Red, green, blue and absorption over the sample value.
pub fn transfer_table(scene: &Scene) -> Vec<f32> {
    floats(transfer_of(scene).into_iter().flatten())
}

/// How many entries before each are not transparent, and in all.
pub fn opaque_before(scene: &Scene) -> Vec<f32> {
    let absorption: Vec<f32> = transfer_table(scene).chunks_exact(4).map(|entry| entry[3]).collect();
    let mut before = vec![0.0];
    before.extend(absorption.iter().scan(0.0, |count, a| {
        *count += if *a > 0.0 { 1.0 } else { 0.0 };
        Some(*count)
    }));
    before
}

/// The same between every two sample values.
pub fn pre_integrated_table(scene: &Scene) -> Vec<f32> {
    floats(transfer::pre_integrated(&transfer_of(scene)).into_iter().flatten())
}

fn transfer_of(scene: &Scene) -> Vec<[f64; 4]> {
    transfer::table(&scene.settings.volume.transfer, scene.settings.volume.threshold)
}

/// The tiles of a picture of planes, as `Sheet::table` lays them out.
pub fn tile_table(scene: &Scene) -> Vec<f32> {
    floats(scene.sheet().table(scene.settings.planes.thickness))
}

/// Outward normal and limit of each half-space of the block.
pub fn block_table(scene: &Scene) -> Vec<f32> {
    floats(scene.block().iter().flat_map(|f| [f.normal.x, f.normal.y, f.normal.z, f.limit]))
}
