//! Line conditioning of one polar frame before scan conversion (thesis 4.3): time gain compensation, Gaussian low pass and
//! decimation along the lines, log compression. Sample j of the result is centred on sample j M of the frame.

use super::scan_convert::normalisation;
use crate::passes::pass::*;
use crate::scene::{Conditioning, Scene, gaussian_radius};

pub const PASS: Pass = Pass {
    name: "condition",
    stage: Stage::Preprocess,
    frequency: Frequency::Frame,
    link: Link::None,
    shader: |s, _| {
        if s.settings.conditioning.tgc.is_empty() {
            "preprocess/condition.plain"
        } else {
            "preprocess/condition.gained"
        }
    },
    needed: |s| match s.probe() {
        None => Err("the volume is Cartesian already: it has no lines"),
        Some(_) if s.conditions() => Ok("asked for, or lines are longer than asked for"),
        Some(_) => Err("not asked for, and no line is longer than asked for"),
    },
    reads: |s, _| {
        let mut reads = vec![layer("frames", Slot::Frames)];
        reads.extend((!s.settings.conditioning.tgc.is_empty()).then_some(whole("tgc", Slot::Tgc)));
        reads
    },
    writes: |_, _| vec![whole("conditioned", Slot::Conditioned)],
    extent: |s, _| {
        let [samples, lines] = s.line_lattice();
        [samples, lines, 1]
    },
    repeat: once,
    params: |s, _| {
        let (gain, offset) = normalisation(s);
        let deviation = s.settings.conditioning.deviation(s.decimation());
        let range = s.settings.conditioning.dynamic_range.unwrap_or(1.0);
        Params::default()
            .f32("gain", gain)
            .f32("offset", offset)
            .f32("narrowness", if deviation > 0.0 { 0.5 / (deviation * deviation) } else { 0.0 })
            .f32("per_octave", 20.0 * 2f64.log10() / range)
    },
    constants: |s, _| {
        let c = &s.settings.conditioning;
        vec![
            ("RADIUS", gaussian_radius(c.deviation(s.decimation())) as i32),
            ("FACTOR", s.decimation() as i32),
            ("LOG", c.dynamic_range.is_some() as i32),
        ]
    },
    tolerance: Tolerance {
        absolute: 5e-5,
        relative: 0.0,
        outliers: 0.0,
        why: "a positive sum in f32 is good to 2e-6 of its value, log2 to 5e-7, both 6 dB an octave over a range of at least \
              20 dB; one level of u16 above the darkest loses 1e-4 of itself in the offset",
    },
    reference: |scene, _, reads, writes| {
        let frames = reads.get("frames");
        let target = writes.get_mut("conditioned");
        let (c, factor) = (&scene.settings.conditioning, scene.decimation() as usize);
        let kernel = low_pass(c.deviation(scene.decimation()));
        for y in 0..target.size[1] {
            let line: Vec<f64> = (0..frames.size[0]).map(|i| gained(scene, c, i, frames.one(i, y, 0))).collect();
            for x in 0..target.size[0] {
                // (place, weight) of the taps that lie on the line.
                let taps = kernel.iter().filter_map(|(i, w)| {
                    (x * factor).checked_add_signed(*i as isize).filter(|i| *i < line.len()).map(|i| (i, *w))
                });
                let (sum, weight) = taps.fold((0.0, 0.0), |(sum, weight), (i, w)| (sum + w * line[i], weight + w));
                target.set([x, y, 0], &[compressed(c, sum / weight)]);
            }
        }
    },
};

/// A stored sample as 0..1 times, or plus, its depth's gain.
fn gained(scene: &Scene, c: &Conditioning, sample: usize, stored: f64) -> f64 {
    let (gain, offset) = normalisation(scene);
    let value = (stored * gain + offset).clamp(0.0, 1.0);
    let gain = scene.probe().map_or(0.0, |p| c.gain(p.start_depth + p.sample_pitch * sample as f64));
    match c.dynamic_range {
        Some(_) => value * 10f64.powf(gain / 20.0),
        None => value + gain / c.compressed_range,
    }
}

/// Offsets and weights of a sampled Gaussian out to three deviations.
fn low_pass(deviation: f64) -> Vec<(i64, f64)> {
    if deviation <= 0.0 {
        return vec![(0, 1.0)];
    }
    let radius = i64::from(gaussian_radius(deviation));
    (-radius..=radius).map(|i| (i, (-0.5 * (i as f64 / deviation).powi(2)).exp())).collect()
}

/// v' = clamp(1 + 20 log10(v) / DR); f64 has a logarithm of 0, and it clamps to 0.
fn compressed(c: &Conditioning, value: f64) -> f64 {
    match c.dynamic_range {
        Some(range) => (1.0 + 20.0 * value.log10() / range).clamp(0.0, 1.0),
        None => value.clamp(0.0, 1.0),
    }
}
