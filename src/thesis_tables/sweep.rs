//! The synthetic input of the tables: a sweep with the geometry of the thesis (4.3) through a ball in front of a wall, both in dark
//! fluid, so that rays end where those of an examination do. Computed from a formula, so it is the same on every machine.

use crate::probe::{Advance, Array, Axis, Indices, Motion, Probe};
use crate::source::Frame;
use crate::thesis_tables::{DEPTH, FAN_ANGLE, SAMPLES, SECTOR_ANGLE, SOUND_SPEED};
use glam::DVec3;
use rayon::prelude::*;

/// Radius of the array, mm. The thesis does not state it; typical of abdominal wobblers, as in the phantom.
const ARRAY_RADIUS: f64 = 40.0;
/// Radius of the wobble, mm.
const WOBBLE_RADIUS: f64 = 25.0;

/// Radius of the ball, mm: as wide as a fetal head.
pub const BALL_RADIUS: f64 = 45.0;
/// Depth of its centre below the face, mm.
pub const BALL_DEPTH: f64 = 100.0;
/// Depth of the wall below the face, mm.
pub const WALL_DEPTH: f64 = 130.0;

/// Value of samples in fluid, 0..1.
const FLUID: f64 = 0.15;
/// Value that the bodies add.
const TISSUE: f64 = 0.6;
/// Width of the edges of bodies, mm.
const EDGE: f64 = 1.0;
/// Standard deviation of the grain: far below the threshold of the detector, even without a filter.
const GRAIN: f64 = 0.01;

/// The probe of a sweep of `frames` frames of `lines` scan lines.
pub fn probe(frames: usize, lines: usize) -> Probe {
    let spread = |angle: f64, count: usize| Axis::centred(angle.to_radians() / (count - 1) as f64, count);
    Probe {
        array: Array::Curved { radius: ARRAY_RADIUS },
        lines: spread(SECTOR_ANGLE, lines),
        start_depth: 0.0,
        sample_pitch: DEPTH / (SAMPLES - 1) as f64,
        samples: SAMPLES,
        motion: Motion::Fan { wobble_radius: WOBBLE_RADIUS },
        slices: spread(FAN_ANGLE, frames),
        advance: Advance::None,
        sound_speed: SOUND_SPEED,
    }
}

/// Depth below the face of the first surface on a line parallel to the depth axis at (lateral, elevation), mm.
pub fn surface_depth(lateral: f64, elevation: f64) -> f64 {
    let half_chord_squared = BALL_RADIUS.powi(2) - lateral.powi(2) - elevation.powi(2);
    if half_chord_squared > 0.0 { WALL_DEPTH.min(BALL_DEPTH - half_chord_squared.sqrt()) } else { WALL_DEPTH }
}

/// Value at a place, without grain.
fn echo(place: DVec3) -> f64 {
    let depth = place.y - ARRAY_RADIUS;
    let from_ball = (place - DVec3::new(0.0, ARRAY_RADIUS + BALL_DEPTH, 0.0)).length() - BALL_RADIUS;
    let outside = from_ball.min(WALL_DEPTH - depth);
    FLUID + TISSUE * (0.5 - outside / EDGE).clamp(0.0, 1.0)
}

/// Noise of mean 0 and standard deviation 1, nearly normal: the sum of four uniform values, which are bytes of a mixed number (Steele,
/// Lea and Flood, Fast splittable pseudorandom number generators, OOPSLA 2014).
fn grain(number: u64) -> f64 {
    let mut z = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    let sum: f64 = z.to_le_bytes()[..4].iter().map(|b| f64::from(*b) / 255.0 - 0.5).sum();
    sum * 3f64.sqrt()
}

/// The frames of one volume, u8 for 0..1.
pub fn frames(frames: usize, lines: usize) -> Vec<Frame> {
    let probe = probe(frames, lines);
    let sample = |slice: usize, line: usize, sample: usize| {
        let at = Indices { sample: sample as f64, line: line as f64, slice: slice as f64 };
        let number = ((slice * lines + line) * SAMPLES + sample) as u64;
        let value = echo(probe.to_space(at)) + GRAIN * grain(number);
        (value.clamp(0.0, 1.0) * 255.0).round() as u8
    };
    (0..frames)
        .into_par_iter()
        .map(|slice| {
            let places = (0..lines).flat_map(|line| (0..SAMPLES).map(move |i| (line, i)));
            let bytes = places.map(|(line, i)| sample(slice, line, i)).collect();
            Frame { volume: 0, number: slice as u32, slice, backward: false, time: None, bytes }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sweep_has_the_geometry_and_the_least_time_that_the_thesis_states() {
        let probe = probe(35, 64);
        probe.check().expect("a probe");
        let degrees = |axis: &Axis| (axis.last() - axis.first()).to_degrees();
        assert!((degrees(&probe.lines) - 77.0).abs() < 1e-9 && (degrees(&probe.slices) - 61.0).abs() < 1e-9);
        assert!((probe.last_range() - probe.first_range() - 160.0).abs() < 1e-9);
        assert!((probe.acquisition_time() * 1e3 - 465.45).abs() < 0.01, "{}", probe.acquisition_time());
    }

    #[test]
    fn grain_has_the_moments_it_claims() {
        let values: Vec<f64> = (0..100_000).map(grain).collect();
        let mean = values.iter().sum::<f64>() / 1e5;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 1e5).sqrt();
        assert!(mean.abs() < 0.01 && (deviation - 1.0).abs() < 0.01, "{mean} {deviation}");
    }

    #[test]
    fn echoes_rise_at_the_surface() {
        for (x, z) in [(0.0, 0.0), (20.0, 30.0), (55.0, 10.0), (-30.0, -30.0)] {
            let at = |depth: f64| echo(DVec3::new(x, ARRAY_RADIUS + depth, z));
            let depth = surface_depth(x, z);
            assert!((at(depth) - FLUID - TISSUE / 2.0).abs() < 1e-9 && at(depth - 2.0) == FLUID, "{x} {z}");
        }
    }
}
