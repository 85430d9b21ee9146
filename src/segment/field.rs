//! Linear echoes on a lattice: what bodies are searched in, and what volumes are measured by.

use crate::lattice;
use crate::memory;
use crate::mesh::smooth::Smoother;
use crate::probe::{Geometry, Grid};
use crate::source::convert::Volume;
use crate::source::{Frame, StoredType};

/// Bytes of a voxel while bodies are searched: echoes, smoothed echoes, distances, labels and the numbers of voxels.
const BYTES: u64 = 32;
/// Distance of two samples of a line whose speckle is independent, mm.
const APART: f64 = 1.5;
/// The median of the absolute difference of two levels of independent speckle: ln 3 nepers of power, dB.
const MEDIAN_DIFFERENCE_DB: f64 = 4.771_212_547;
/// Ranges of a log compression that are believed, dB over the sample range. Others are no speckle.
const BELIEVED_DB: [f64; 2] = [20.0, 100.0];
/// A usual range, by which the sum of two levels is judged.
const USUAL_DB: f64 = 60.0;
/// Least power of the samples around two, of their sum: less is on the other side of an edge.
const NEAR: f64 = 0.1;
/// Most pairs of samples that are compared.
const MAX_PAIRS: usize = 1 << 20;

/// How stored sample values depend on the echo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// The value is proportional to the echo.
    Linear,
    /// The value is the logarithm of the echo. The sample range spans this number of dB.
    Decibels(f64),
}

impl Scale {
    /// Estimates the scale of a volume from its speckle: levels of fully developed speckle differ by 4.77 dB in the median, whatever the tissue
    /// is (their difference has a logistic distribution). Linear if the samples do not look like that. `range`: the stored values at both ends
    /// of the sample range.
    pub fn by_speckle(volume: &Volume, range: [f64; 2]) -> Scale {
        let (stride, pitch) = match volume.geometry() {
            Geometry::Sweep(probe) => (1, probe.sample_pitch),
            Geometry::Cartesian(grid) => (grid.size[0], grid.spacing[1]),
        };
        let [first, second] = volume.geometry().frame_size();
        let (length, lag) = (if stride == 1 { first } else { second }, (APART / pitch).round().max(1.0) as usize);
        let stored = volume.stored();
        let share = |bytes: &[u8], n: usize| {
            let at = n * stored.bytes();
            bytes.get(at..at + stored.bytes()).map(|bytes| (stored.value(bytes) - range[0]) / (range[1] - range[0]))
        };
        let pairs = volume.frames().len() * first * second;
        let every = (pairs / MAX_PAIRS).max(1);
        let usual = |share: f64| Scale::Decibels(USUAL_DB).echo(share);
        let (mut differences, least) = (Vec::new(), usual(0.45));
        for frame in volume.frames() {
            for n in (0..first * second).step_by(every).filter(|n| n / stride % length + 3 * lag < length) {
                let four = [0, 1, 2, 3].map(|step| share(frame, n + step * lag * stride));
                let [Some(before), Some(a), Some(b), Some(after)] = four else { continue };
                // The ratio of a and b is independent of their sum and of what is around them: by these, edges and what is cut off at the low end of
                // the range are left out.
                let [before, sum, after] = [usual(before), usual(a) + usual(b), usual(after)];
                if sum > least && before.min(after) > NEAR * sum {
                    differences.push((a - b).abs());
                }
            }
        }
        differences.sort_by(f64::total_cmp);
        // The middle fifth, as whole numbers have a rough median.
        let middle = &differences[differences.len() * 2 / 5..differences.len() * 3 / 5];
        let range = MEDIAN_DIFFERENCE_DB * middle.len() as f64 / middle.iter().sum::<f64>();
        let [least, most] = BELIEVED_DB;
        if (least..=most).contains(&range) { Scale::Decibels(range) } else { Scale::Linear }
    }

    /// The echo of a share of the sample range, 0..=1; in power with decibels.
    fn echo(self, share: f64) -> f64 {
        match self {
            Scale::Linear => share,
            Scale::Decibels(range) => 10f64.powf((share - 1.0) * range / 10.0),
        }
    }

    /// The quantity that bodies are searched in, for a sample at `share` (0..=1) of the sample range: the echo itself if linear, otherwise the
    /// amplitude of the echo, in which speckle is weaker than in its power; 0..=1.
    pub fn searched(self, share: f64) -> f64 {
        self.searched_of(self.echo(share))
    }

    fn searched_of(self, echo: f64) -> f64 {
        if self == Scale::Linear { echo } else { echo.sqrt() }
    }

    /// The share of the sample range, 0..=1, at which the searched quantity has this value (0..=1): the inverse of [`Scale::searched`]. 0 for what
    /// is below the range.
    pub fn share(self, searched: f64) -> f64 {
        match self {
            Scale::Linear => searched,
            Scale::Decibels(range) => (1.0 + 20.0 * searched.log10() / range).max(0.0),
        }
    }
}

/// The quantity that bodies are searched in ([`Scale::searched`]), 0..=1, at each voxel of a grid; NaN outside the insonified region.
#[derive(Clone, Debug)]
pub struct Field {
    grid: Grid,
    scale: Scale,
    /// As [`Scale::searched`]; NaN where nothing is known.
    amplitudes: Vec<f32>,
}

impl Field {
    /// Resamples the echoes of a volume on a grid. They are made linear before they are interpolated: power adds up, levels do not. `range`: the
    /// stored values at both ends of the sample range. `each` is called after every slice.
    ///
    /// # Errors
    /// One line: the grid is not valid or takes too much memory.
    pub fn of(volume: &Volume, range: [f64; 2], scale: Scale, grid: Grid, each: impl Fn()) -> Result<Field, String> {
        let voxels = lattice::voxels(&grid)?;
        let linear = linear(volume, range, scale, voxels as u64)?;
        let mut amplitudes = Vec::with_capacity(voxels);
        let mut slice = vec![0.0; grid.size[0] * grid.size[1]];
        for z in 0..grid.size[2] {
            linear.slice(&grid, z, &mut slice);
            amplitudes.extend(slice.iter().map(|echo| scale.searched_of(*echo) as f32));
            each();
        }
        Ok(Field { grid, scale, amplitudes })
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    pub(crate) fn amplitudes(&self) -> &[f32] {
        &self.amplitudes
    }

    /// The echo at the voxel with index `n`, 0..=1, as a quantity that is additive where a voxel or the beam is partly in a body: the power if
    /// samples are in dB.
    pub(crate) fn echo(&self, n: usize) -> f64 {
        let amplitude = f64::from(self.amplitudes[n]);
        match self.scale {
            Scale::Linear => amplitude,
            Scale::Decibels(_) => amplitude * amplitude,
        }
    }

    /// True if the echoes were computed from levels in dB, whose range may be estimated wrongly.
    pub(crate) fn is_from_levels(&self) -> bool {
        self.scale != Scale::Linear
    }

    /// The searched quantity at each voxel, smoothed by a Gaussian whose standard deviation is `deviation` mm.
    pub(crate) fn smoothed(&self, deviation: f64) -> Vec<f32> {
        let Grid { size, spacing, .. } = self.grid;
        smoothed(size, spacing, deviation, |n| f64::from(self.amplitudes[n]), |value| value as f32)
    }
}

/// The values of the voxels of a lattice (`value`, by the linear index), smoothed by a Gaussian whose standard deviation is `deviation` mm, in the
/// form in which `kept` keeps them.
pub(crate) fn smoothed<T>(
    size: [usize; 3],
    spacing: [f64; 3],
    deviation: f64,
    value: impl Fn(usize) -> f64,
    kept: impl Fn(f64) -> T,
) -> Vec<T> {
    let each = size[0] * size[1];
    let (mut smoother, mut slice) = (Smoother::new(size, spacing, deviation), vec![0.0; each]);
    let mut all = Vec::with_capacity(each * size[2]);
    for z in 0..size[2] {
        smoother.slice(z, &mut slice, |z, out| {
            out.iter_mut().enumerate().for_each(|(n, out)| *out = value(z * each + n));
        });
        all.extend(slice.iter().map(|value| kept(*value)));
    }
    all
}

/// The same volume with linear echoes.
fn linear(volume: &Volume, range: [f64; 2], scale: Scale, voxels: u64) -> Result<Volume, String> {
    let stored = volume.stored();
    let bytes: u64 = volume.frames().iter().map(|frame| 4 * (frame.len() / stored.bytes()) as u64).sum();
    memory::check(voxels.saturating_mul(BYTES) + bytes).map_err(|why| format!("the search for bodies {why}"))?;
    let mut linear = Volume::new(volume.geometry().clone(), StoredType::F32);
    for (slice, frame) in volume.frames().iter().enumerate().filter(|(_, frame)| !frame.is_empty()) {
        let mut bytes = Vec::with_capacity(4 * (frame.len() / stored.bytes()));
        for sample in frame.chunks_exact(stored.bytes()) {
            let share = ((stored.value(sample) - range[0]) / (range[1] - range[0])).clamp(0.0, 1.0);
            bytes.extend((scale.echo(share) as f32).to_le_bytes());
        }
        linear.take(Frame::of_slice(0, slice, bytes));
    }
    Ok(linear)
}
