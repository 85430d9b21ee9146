//! A volume with fewer samples, for small pictures of it: means of neighbouring samples, lines and frames, in the same sector.

use crate::Frame;
use crate::probe::{Advance, Axis, Geometry, Grid, Probe, StoredType};
use rayon::prelude::*;
use std::sync::Arc;

/// Most samples of a line, lines of a frame, and frames.
const WANTED: [usize; 3] = [128, 64, 48];

/// Reduces a volume to 128 to 255 samples a line, 64 to 127 lines and 48 to 95 frames; axes of less than 256, 128 and 96 keep their lengths. Each
/// sample is the mean of a block of samples; what is less than a block at the far end of an axis is dropped. None if a frame is missing or has
/// another size.
pub fn coarse(geometry: &Geometry, stored: StoredType, frames: &[Arc<Frame>]) -> Option<(Geometry, Vec<Frame>)> {
    let [samples, lines] = geometry.frame_size();
    let slices = geometry.slices();
    let factors: [usize; 3] = std::array::from_fn(|axis| ([samples, lines, slices][axis] / WANTED[axis]).max(1));
    let bytes = samples * lines * stored.bytes();
    let mut ordered: Vec<Option<&Frame>> = vec![None; slices];
    for frame in frames.iter().filter(|frame| frame.bytes.len() == bytes) {
        *ordered.get_mut(frame.slice)? = Some(frame);
    }
    let ordered: Vec<&Frame> = ordered.into_iter().collect::<Option<_>>()?;
    let coarser = match geometry {
        Geometry::Sweep(probe) => Geometry::Sweep(coarser_probe(probe, factors)),
        Geometry::Cartesian(grid) => Geometry::Cartesian(coarser_grid(grid, factors)),
    };
    let made: Vec<Frame> = ordered
        .par_chunks_exact(factors[2])
        .enumerate()
        .map(|(slice, some)| Frame {
            backward: some[0].backward,
            ..Frame::of_slice(0, slice, mean(some, [samples, lines], factors, stored))
        })
        .collect();
    Some((coarser, made))
}

/// The means of blocks of samples of some frames, as they are stored.
fn mean(frames: &[&Frame], [samples, lines]: [usize; 2], factors: [usize; 3], stored: StoredType) -> Vec<u8> {
    let [along, across, _] = factors;
    let count = (along * across * frames.len()) as f64;
    let mut made = Vec::new();
    for line in 0..lines / across {
        for sample in 0..samples / along {
            let of_line = |frame: &Frame, n: usize| -> f64 {
                let first = (line * across + n) * samples + sample * along;
                (first..first + along).map(|at| read(&frame.bytes, at, stored)).sum()
            };
            let sum: f64 = frames.iter().map(|frame| (0..across).map(|n| of_line(frame, n)).sum::<f64>()).sum();
            stored.append(sum / count, &mut made);
        }
    }
    made
}

/// The n-th sample; 0 beyond the end.
fn read(bytes: &[u8], n: usize, stored: StoredType) -> f64 {
    let at = n * stored.bytes();
    bytes.get(at..at + stored.bytes()).map_or(0.0, |sample| stored.value(sample))
}

fn coarser_axis(axis: &Axis, factor: usize) -> Axis {
    let middle = (factor - 1) as f64 / 2.0;
    match axis {
        Axis::Even { first, pitch, count } => {
            Axis::Even { first: first + pitch * middle, pitch: pitch * factor as f64, count: count / factor }
        }
        Axis::Table(_) => {
            Axis::from_table((0..axis.len() / factor).map(|n| axis.at((n * factor) as f64 + middle)).collect())
        }
    }
}

fn coarser_probe(probe: &Probe, [along, across, between]: [usize; 3]) -> Probe {
    let middle = |factor: usize| (factor - 1) as f64 / 2.0;
    let advance = match &probe.advance {
        Advance::Each(table) => {
            let mean = |some: &[f64]| some.iter().sum::<f64>() / some.len() as f64;
            Advance::Each(table.chunks_exact(between).map(mean).collect())
        }
        same => same.clone(),
    };
    Probe {
        lines: coarser_axis(&probe.lines, across),
        start_depth: probe.start_depth + probe.sample_pitch * middle(along),
        sample_pitch: probe.sample_pitch * along as f64,
        samples: probe.samples / along,
        slices: coarser_axis(&probe.slices, between),
        advance,
        ..probe.clone()
    }
}

fn coarser_grid(grid: &Grid, factors: [usize; 3]) -> Grid {
    Grid {
        size: std::array::from_fn(|a| grid.size[a] / factors[a]),
        spacing: std::array::from_fn(|a| grid.spacing[a] * factors[a] as f64),
        origin: std::array::from_fn(|a| grid.origin[a] + grid.spacing[a] * (factors[a] - 1) as f64 / 2.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Array, Indices, Motion};

    /// A volume whose echo is linear in sample, line and slice: a mean lies where the coarse geometry says.
    #[test]
    fn a_coarse_volume_has_each_echo_at_its_place() {
        let wobbler = Probe {
            array: Array::Curved { radius: 40.0 },
            lines: Axis::centred(0.01, 131),
            start_depth: 2.0,
            sample_pitch: 0.2,
            samples: 514,
            motion: Motion::Fan { wobble_radius: 25.0 },
            slices: Axis::from_table((0..98).map(|n| 0.01 * f64::from(n) + 1e-5 * f64::from(n * n)).collect()),
            advance: Advance::Each(vec![0.0; 98]),
            sound_speed: 1540.0,
        };
        let grid = Grid { size: [257, 64, 100], spacing: [0.4, 0.5, 0.6], origin: [-3.0, 1.0, 2.0] };
        for geometry in [Geometry::Sweep(wobbler), Geometry::Cartesian(grid)] {
            let [samples, lines] = geometry.frame_size();
            let echo = |sample: f64, line: f64, slice: f64| sample + 10.0 * line + 100.0 * slice;
            let frame = |slice: usize| {
                let of = |n: usize| echo((n % samples) as f64, (n / samples) as f64, slice as f64) as f32;
                let bytes = (0..samples * lines).flat_map(|n| of(n).to_le_bytes()).collect();
                Arc::new(Frame::of_slice(7, slice, bytes))
            };
            let frames: Vec<_> = (0..geometry.slices()).map(frame).collect();
            let (coarser, made) = coarse(&geometry, StoredType::F32, &frames).expect("a whole volume");
            let [fewer, rows] = coarser.frame_size();
            assert!(fewer <= 2 * WANTED[0] && rows <= 2 * WANTED[1] && made.len() == coarser.slices());
            for at in [[0, 0, 0], [3, 5, 7], [fewer - 1, rows - 1, made.len() - 1]] {
                let [sample, line, slice] = at.map(|n| n as f64);
                let found = read(&made[at[2]].bytes, at[1] * fewer + at[0], StoredType::F32);
                let back = match (&geometry, &coarser) {
                    (Geometry::Sweep(fine), Geometry::Sweep(coarse)) => {
                        let there = fine.to_indices(coarse.to_space(Indices { sample, line, slice }));
                        [there.sample, there.line, there.slice]
                    }
                    (Geometry::Cartesian(fine), Geometry::Cartesian(coarse)) => std::array::from_fn(|a| {
                        let place = coarse.origin[a] + coarse.spacing[a] * at[a] as f64;
                        (place - fine.origin[a]) / fine.spacing[a]
                    }),
                    _ => panic!("another kind of geometry"),
                };
                let wanted = echo(back[0], back[1], back[2]);
                // Of f32; the table of slices is not quite even.
                assert!((found - wanted).abs() < 0.1, "{at:?}: {found}, not {wanted}");
            }
            assert!(coarse(&geometry, StoredType::F32, &frames[1..]).is_none(), "a frame is missing");
        }
    }

    #[test]
    fn a_small_volume_stays_as_it_is() {
        let grid = Grid { size: [4, 3, 1], spacing: [1.0; 3], origin: [0.0; 3] };
        for (stored, bytes) in [(StoredType::U8, (0..12).collect::<Vec<u8>>()), (StoredType::U16, (0..24).collect())] {
            let frames = [Arc::new(Frame::of_slice(0, 0, bytes.clone()))];
            let (same, made) = coarse(&Geometry::Cartesian(grid), stored, &frames).expect("a volume");
            assert_eq!((same, &made[0].bytes), (Geometry::Cartesian(grid), &bytes));
        }
    }
}
