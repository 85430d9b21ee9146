//! Bodies with speckle, as ultrasound has it: complex noise times the root of the power of the scatterers, blurred by a point-spread function; its
//! magnitude in decibels.

use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::source::convert::Volume;
use echolume::low_level::source::{Frame, StoredType};
use echolume::low_level::statistics::mix;
use glam::DVec3;
use rayon::prelude::*;

/// Range of the grey scale, dB.
pub const RANGE_DB: f64 = 60.0;
/// Standard deviations of the point-spread function of the field: lateral, axial, elevation, mm.
const POINT_SPREAD: [f64; 3] = [0.6, 0.3, 0.8];

/// A lattice of cubes around 0.
pub fn cube(count: usize, spacing: f64) -> Grid {
    Grid { size: [count; 3], spacing: [spacing; 3], origin: [-0.5 * spacing * (count - 1) as f64; 3] }
}

/// The volume of a medium: its level in dB re full scale at a place, mm. The same seed gives the same volume.
pub fn speckled(grid: Grid, seed: u64, level: impl Fn(DVec3) -> f64 + Sync) -> Volume {
    let [width, height, depth] = grid.size;
    let slice = width * height;
    let mut fields = [0, 1].map(|part| {
        let mut field = vec![0.0f32; slice * depth];
        field.par_chunks_mut(slice).enumerate().for_each(|(z, out)| {
            let mut random = Random(seed << 32 | (part << 16) | z as u64);
            for (n, out) in out.iter_mut().enumerate() {
                let at = DVec3::from_array([n % width, n / width, z].map(|i| i as f64));
                let place = DVec3::from(grid.origin) + at * DVec3::from(grid.spacing);
                *out = (random.normal() * 10f64.powf(level(place) / 20.0)) as f32;
            }
        });
        field
    });
    let strides = [1, width, slice];
    for field in &mut fields {
        for axis in 0..3 {
            *field = blurred(field, strides[axis], grid.size[axis], POINT_SPREAD[axis] / grid.spacing[axis]);
        }
    }
    let mut volume = Volume::new(Geometry::Cartesian(grid), StoredType::U8);
    for z in 0..depth {
        let grey = |n: usize| {
            let power = fields.iter().map(|field| f64::from(field[z * slice + n]).powi(2)).sum::<f64>() / 2.0;
            (255.0 * (1.0 + 10.0 * power.log10() / RANGE_DB)).round() as u8
        };
        volume.take(Frame::of_slice(0, z, (0..slice).map(grey).collect()));
    }
    volume
}

/// A field convolved along an axis by a Gaussian whose squares add up to 1, so that the mean power stays.
fn blurred(field: &[f32], stride: usize, count: usize, deviation: f64) -> Vec<f32> {
    let reach = (4.0 * deviation).ceil() as usize;
    let weight = |n: usize| (-0.5 * (n as f64 / deviation).powi(2)).exp();
    let power: f64 = (0..=2 * reach).map(|n| weight(n.abs_diff(reach)).powi(2)).sum();
    let kernel: Vec<f32> = (0..=2 * reach).map(|n| (weight(n.abs_diff(reach)) / power.sqrt()) as f32).collect();
    let one = |n: usize| {
        let place = n / stride % count;
        let near = place.saturating_sub(reach)..(place + reach + 1).min(count);
        near.map(|other| kernel[other + reach - place] * field[n + other * stride - place * stride]).sum()
    };
    (0..field.len()).into_par_iter().map(one).collect()
}

/// Pseudo-random numbers (splitmix64).
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// By Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
