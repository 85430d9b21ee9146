//! The echoes along scan lines, and speckle: the interference of many unresolved scatterers.
//!
//! Complex Gaussian noise times the root of the echogenicity, convolved in polar space with a separable point-spread
//! function; its magnitude is the envelope. Where the medium is constant that is fully developed speckle: Rayleigh in
//! amplitude (mean / sd 1.913), Fisher-Tippett in dB (sd 5.57 dB).

use super::sampling::PointSpread;
use crate::probe::{Indices, Probe};
use crate::statistics::mix;
use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

/// Range of the grey scale, dB: grey 255 is 0 dB re full scale, grey 0 is this many dB below.
pub const DYNAMIC_RANGE: f64 = 50.0;

/// Position, direction and time of one scan line, in the coordinates of [`Probe`], mm.
pub(super) struct Beam {
    /// Position of sample 0 of the line, mm.
    pub first: DVec3,
    /// Vector from a sample to the next, mm. It is the same for all samples of the line, which is straight.
    pub step: DVec3,
    /// Distance from sample to sample, mm.
    pub pitch: f64,
    /// Distance of sample 0 from the face of the array, mm.
    pub start_depth: f64,
    /// Distance of sample 0 from the in-plane apex, mm. `line_angle` and `motor_angle` are in rad.
    pub range: f64,
    pub line_angle: f64,
    pub motor_angle: f64,
    /// Time at which the line was fired, s.
    pub time: f64,
}

impl Beam {
    /// The beam of line `line` at a fractional slice, which may lie beyond the ends of the sweep, fired at `time` s.
    pub fn new(probe: &Probe, line: usize, slice: f64, time: f64) -> Beam {
        let line = line as f64;
        let place = |sample| probe.to_space(Indices { sample, line, slice });
        // Computed over the whole length, for precision.
        let last = (probe.samples - 1) as f64;
        Beam {
            first: place(0.0),
            step: (place(last) - place(0.0)) / last,
            pitch: probe.sample_pitch,
            start_depth: probe.start_depth,
            range: probe.first_range(),
            line_angle: probe.lines.at(line),
            motor_angle: probe.slice_position(line, slice),
            time,
        }
    }

    /// The beam as a body sees it that was moved by the inverse of this map.
    pub fn moved(mut self, back: &DAffine3) -> Beam {
        (self.first, self.step) = (back.transform_point3(self.first), back.transform_vector3(self.step));
        self
    }

    pub fn place(&self, sample: usize) -> DVec3 {
        self.first + self.step * sample as f64
    }

    /// Unit vector along the line, away from the probe.
    pub fn direction(&self) -> Vec3 {
        (self.step / self.pitch).as_vec3()
    }
}

/// Levels of the echo from a point, dB re full scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// Level of the echo from many unresolved scatterers, which causes speckle.
    pub diffuse: f32,
    /// Level of the specular echo from a surface or wire, which has no speckle.
    pub mirror: f32,
}

impl Echo {
    /// No echo: levels far below the dynamic range.
    pub(crate) const SILENT: Echo = Echo { diffuse: -200.0, mirror: -200.0 };

    /// The level without speckle, dB re full scale: that of the sum of both powers.
    pub fn bare(self) -> f32 {
        if self.mirror <= Echo::SILENT.mirror {
            return self.diffuse;
        }
        10.0 * (10f32.powf(self.diffuse / 10.0) + 10f32.powf(self.mirror / 10.0)).log10()
    }
}

/// Grey value of a level in dB re full scale; saturates at 0 and 255.
pub(super) fn grey(level: f32) -> u8 {
    // Saturates at 0 and 255.
    ((1.0 + level / DYNAMIC_RANGE as f32) * 255.0).round() as u8
}

/// How much wider the beam is at 40 mm from the focus, as a share of its width at the focus.
const DEFOCUS: f32 = 0.37;
/// Depth of the focus, mm.
const FOCUS: f64 = 55.0;

/// Specular echoes add up in phase over the point-spread function, those of scatterers do not. This factor compensates for it.
const MIRROR: f32 = 0.3;

/// Complex samples of one slice, line by line.
struct Field {
    re: Vec<f32>,
    im: Vec<f32>,
}

/// Grey values of all slices of a volume with speckle. `echoes` and the result: one list for each slice, in geometric order. `seed` and `volume`
/// determine the noise.
pub(super) fn slices(echoes: &[Vec<Echo>], probe: &Probe, psf: &PointSpread, seed: u64, volume: u64) -> Vec<Vec<u8>> {
    let blur = Blur::new(probe, psf);
    let fields: Vec<Field> = echoes
        .par_iter()
        .enumerate()
        .map(|(slice, echoes)| blur.apply(scattered(echoes, stream(seed, volume, slice as u64))))
        .collect();
    (0..fields.len())
        .into_par_iter()
        .map(|slice| {
            let near = blur.across_slices(slice, fields.len());
            // At the ends of the fan the existing frames carry all the power.
            let power: f32 = near.clone().map(|(_, w)| w * w).sum();
            let mut sum = Field::silent(echoes[slice].len());
            for (other, weight) in near {
                sum.add(&fields[other], weight / power.sqrt());
            }
            sum.re.iter().zip(&sum.im).map(|(re, im)| grey(10.0 * (re * re + im * im + 1e-20).log10())).collect()
        })
        .collect()
}

/// Grey values of all slices of a volume as the mean over all realisations of the speckle, which is the ideal result of a speckle filter.
/// `echoes` and the result: one list for each slice, in geometric order. The power of the scatterers is blurred by the square of the
/// point-spread function, the specular echo by the function itself.
pub(super) fn mean_slices(echoes: &[Vec<Echo>], probe: &Probe, psf: &PointSpread) -> Vec<Vec<u8>> {
    let blur = Blur::new(probe, psf);
    let squared = blur.squared();
    // Amplitude of the specular echo, power of the scatterers.
    let parts: Vec<[Vec<f32>; 2]> = echoes
        .par_iter()
        .map(|echoes| {
            let is_mirror = |e: &Echo| e.mirror > Echo::SILENT.mirror;
            let mirror = echoes.iter().map(|e| if is_mirror(e) { root(e.mirror) * MIRROR } else { 0.0 });
            let power = echoes.iter().map(|e| root(e.diffuse).powi(2));
            [blur.both_ways(&mirror.collect::<Vec<_>>()), squared.both_ways(&power.collect::<Vec<_>>())]
        })
        .collect();
    (0..parts.len())
        .into_par_iter()
        .map(|slice| {
            let near = || blur.across_slices(slice, parts.len());
            let power: f32 = near().map(|(_, w)| w * w).sum();
            let mean = |i: usize| {
                let mirror: f32 = near().map(|(k, w)| w * parts[k][0][i]).sum();
                let scattered: f32 = near().map(|(k, w)| w * w * parts[k][1][i]).sum();
                mean_grey(f64::from(scattered / power), f64::from(mirror * mirror / power))
            };
            (0..echoes[slice].len()).map(mean).collect()
        })
        .collect()
}

/// Grey values of all slices of a body that moves while the sweep goes on, in geometric order. The scatterers lie on planes of constant slice.
/// A frame sees those that the point-spread function reaches, at the time of the frame: the motion is blurred in space and not over
/// the times of other frames. `along` gives the echoes of such a plane, a fractional slice, at the time of a frame; only the diffuse ones are
/// shown. `seed`: one realisation of the speckle, or else the mean over all.
pub(super) fn moving_slices(
    probe: &Probe,
    psf: &PointSpread,
    seed: Option<u64>,
    along: impl Fn(usize, f64, &mut [Echo]) + Sync,
) -> Vec<Vec<u8>> {
    let (blur, frames) = (Blur::new(probe, psf), probe.slices.len());
    let squared = blur.squared();
    // Samples of a Gaussian one standard deviation apart have its power to 1e-4, wherever they begin.
    let apart = blur.elevation.max(1.0);
    let reach = reach(blur.elevation / apart);
    let near = |frame: usize| {
        let middle = (frame as f32 / apart).round() as isize;
        let sd = blur.elevation;
        (middle - reach..=middle + reach).map(move |k| (k, bell(k as f32 * apart - frame as f32, sd)))
    };
    let length = probe.lines.len() * probe.samples;
    let last = ((frames - 1) as f32 / apart).round() as isize + reach;
    let noise: Vec<Vec<(f32, f32)>> = (-reach..=last)
        .into_par_iter()
        .map(|k| {
            let Some(seed) = seed else { return Vec::new() };
            let stream = stream(seed, 0, k as u64);
            (0..length as u64).map(|i| gaussian_pair(stream, i)).collect()
        })
        .collect();
    (0..frames)
        .into_par_iter()
        .map(|frame| {
            let power: f32 = near(frame).map(|(_, w)| w * w).sum();
            let mut echoes = vec![Echo::SILENT; length];
            let mut sum = Field::silent(length);
            for (k, weight) in near(frame) {
                along(frame, f64::from(k as f32 * apart), &mut echoes);
                let noise = &noise[(k + reach) as usize];
                for (i, echo) in echoes.iter().enumerate() {
                    match noise.get(i) {
                        Some((re, im)) => {
                            let amplitude = weight * root(echo.diffuse) * (0.5 / power).sqrt();
                            sum.re[i] += re * amplitude;
                            sum.im[i] += im * amplitude;
                        }
                        None => sum.re[i] += (weight * root(echo.diffuse)).powi(2) / power,
                    }
                }
            }
            if seed.is_none() {
                return squared.both_ways(&sum.re).into_iter().map(|power| mean_grey(f64::from(power), 0.0)).collect();
            }
            let sum = blur.apply(sum);
            sum.re.iter().zip(&sum.im).map(|(re, im)| grey(10.0 * (re * re + im * im + 1e-20).log10())).collect()
        })
        .collect()
}

/// Mean grey value of an echo of which the scatterers and the specular part have these mean powers, re full scale.
///
/// Without a specular part the power is exponential with the mean d, and the mean of max(0, ln(p / p0)) is E1(p0 / d), where p0 is the foot of
/// the dynamic range. With a specular part m it is Rician, and the mean of ln p is ln m + E1(m / d). Each of them is
/// a lower bound; the other is lower still where it does not hold.
fn mean_grey(scattered: f64, mirror: f64) -> u8 {
    let foot = 10f64.powf(-DYNAMIC_RANGE / 10.0);
    let alone = if scattered > 0.0 { exponential_integral(foot / scattered) } else { 0.0 };
    let ratio = if scattered > 0.0 { exponential_integral(mirror / scattered) } else { 0.0 };
    let both = if mirror > 0.0 { (mirror / foot).ln() + ratio } else { 0.0 };
    (255.0 * alone.max(both) * 10.0 / std::f64::consts::LN_10 / DYNAMIC_RANGE).round() as u8
}

/// E1(x), the integral of e^-t / t from x > 0 to infinity, to 1e-12: the power series below 1, above it the continued fraction
/// (Abramowitz and Stegun 5.1.11 and 5.1.22).
fn exponential_integral(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if x < 1.0 {
        let (mut sum, mut power) = (-EULER - x.ln(), 1.0);
        for k in 1..=20 {
            power *= -x / f64::from(k);
            sum -= power / f64::from(k);
        }
        return sum;
    }
    // From its tail, which is far beyond the precision from x = 1 on.
    let tail = (1..=200).rev().fold(0.0, |tail, k| f64::from(k) / (1.0 + f64::from(k) / (x + tail)));
    (-x).exp() / (x + tail)
}

/// Noise of unit power times the square root of the echogenicity, plus the specular echo in phase.
fn scattered(echoes: &[Echo], stream: u64) -> Field {
    let mut field = Field::silent(echoes.len());
    for (i, echo) in echoes.iter().enumerate() {
        let (re, im) = gaussian_pair(stream, i as u64);
        let amplitude = root(echo.diffuse) * std::f32::consts::FRAC_1_SQRT_2;
        field.re[i] = re * amplitude;
        field.im[i] = im * amplitude;
        if echo.mirror > Echo::SILENT.mirror {
            field.re[i] += root(echo.mirror) * MIRROR;
        }
    }
    field
}

/// Amplitude of a level in dB.
fn root(level: f32) -> f32 {
    // 10^(level / 20) as a power of two.
    (level * 0.166_096_4).exp2()
}

impl Field {
    fn silent(length: usize) -> Field {
        Field { re: vec![0.0; length], im: vec![0.0; length] }
    }

    fn add(&mut self, other: &Field, weight: f32) {
        for (sums, values) in [(&mut self.re, &other.re), (&mut self.im, &other.im)] {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
    }
}

/// The point-spread function within a slice, each part of unit power, so that speckle keeps the mean of the echogenicity.
struct Blur {
    samples: usize,
    axial: Vec<f32>,
    /// Weights of each line from -reach to reach, one a sample: the beam widens away from its focus.
    lateral: Vec<Vec<f32>>,
    /// Standard deviation across slices, in slices.
    elevation: f32,
}

impl Blur {
    fn new(probe: &Probe, psf: &PointSpread) -> Blur {
        // From lengths and angles to samples, lines and slices.
        let axial = (psf.axial_mm / probe.sample_pitch) as f32;
        let focused = (psf.lateral_deg.to_radians() / probe.lines.pitch()) as f32;
        let elevation = (psf.elevation_deg.to_radians() / probe.slices.pitch()) as f32;
        let width = |sample: usize| {
            let depth = probe.start_depth + probe.sample_pitch * sample as f64;
            focused * (1.0 + DEFOCUS * ((depth - FOCUS) / 40.0).powi(2).min(2.0) as f32)
        };
        let widest = (0..probe.samples).map(width).fold(0.0, f32::max);
        let bells = |sd: f32, reach: isize| {
            let bells: Vec<f32> = (-reach..=reach).map(|d| bell(d as f32, sd)).collect();
            let power: f32 = bells.iter().map(|w| w * w).sum();
            bells.into_iter().map(move |w| w / power.sqrt()).collect::<Vec<f32>>()
        };
        let reach_across = reach(widest);
        let mut lateral = vec![vec![0.0; probe.samples]; 2 * reach_across as usize + 1];
        for sample in 0..probe.samples {
            for (weights, w) in lateral.iter_mut().zip(bells(width(sample), reach_across)) {
                weights[sample] = w;
            }
        }
        Blur { samples: probe.samples, axial: bells(axial, reach(axial)), lateral, elevation }
    }

    fn apply(&self, field: Field) -> Field {
        Field { re: self.both_ways(&field.re), im: self.both_ways(&field.im) }
    }

    fn both_ways(&self, part: &[f32]) -> Vec<f32> {
        self.across(&self.along(part))
    }

    /// The square of the point-spread function, which blurs power.
    fn squared(&self) -> Blur {
        let square = |weights: &Vec<f32>| weights.iter().map(|w| w * w).collect();
        Blur {
            samples: self.samples,
            axial: square(&self.axial),
            lateral: self.lateral.iter().map(square).collect(),
            ..*self
        }
    }

    /// The slices that the point-spread function of a slice reaches, with their weights.
    fn across_slices(&self, slice: usize, count: usize) -> impl Iterator<Item = (usize, f32)> + Clone {
        let (reach, sd) = (reach(self.elevation), self.elevation);
        (-reach..=reach).filter_map(move |k| {
            let other = slice.checked_add_signed(k).filter(|other| *other < count)?;
            Some((other, bell(k as f32, sd)))
        })
    }

    /// Along the lines.
    fn along(&self, part: &[f32]) -> Vec<f32> {
        let reach = self.axial.len() / 2;
        let mut out = vec![0.0; part.len()];
        for (line, out) in part.chunks_exact(self.samples).zip(out.chunks_exact_mut(self.samples)) {
            for (tap, weight) in self.axial.iter().enumerate() {
                // out[i] += weight * line[i + tap - reach], where both exist.
                let (from, to) = (tap.saturating_sub(reach), reach.saturating_sub(tap));
                for (sum, value) in out.iter_mut().skip(to).zip(line.iter().skip(from)) {
                    *sum += weight * value;
                }
            }
        }
        out
    }

    /// From line to line.
    fn across(&self, part: &[f32]) -> Vec<f32> {
        let reach = (self.lateral.len() / 2) as isize;
        let lines = part.len() / self.samples;
        let mut out = vec![0.0; part.len()];
        for (line, out) in out.chunks_exact_mut(self.samples).enumerate() {
            for (tap, weights) in self.lateral.iter().enumerate() {
                let Some(other) = line.checked_add_signed(tap as isize - reach).filter(|l| *l < lines) else {
                    continue;
                };
                let other = &part[other * self.samples..][..self.samples];
                for ((sum, value), weight) in out.iter_mut().zip(other).zip(weights) {
                    *sum += weight * value;
                }
            }
        }
        out
    }
}

/// Beyond so many steps a bell is neglected.
fn reach(sd: f32) -> isize {
    (3.0 * sd).ceil() as isize
}

/// 1 at distance 0. Without width it is 0 everywhere else.
fn bell(distance: f32, sd: f32) -> f32 {
    if distance == 0.0 {
        return 1.0;
    }
    (-0.5 * (distance / sd).powi(2)).exp()
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Start of the counter of one slice.
fn stream(seed: u64, volume: u64, slice: u64) -> u64 {
    [volume, slice]
        .into_iter()
        .fold(mix(seed.wrapping_add(GOLDEN)), |state, part| mix(state ^ mix(part.wrapping_add(1).wrapping_mul(GOLDEN))))
}

/// Two independent standard normal numbers (Box and Muller 1958), from a counter and not from a state, so that threads are independent.
fn gaussian_pair(stream: u64, counter: u64) -> (f32, f32) {
    let bits = mix(stream.wrapping_add(counter.wrapping_mul(GOLDEN)));
    // Never 0, whose logarithm is infinite.
    let share = ((bits >> 40) as f32 + 0.5) / (1u64 << 24) as f32;
    let phase = (bits & 0xff_ffff) as f32 / (1u64 << 24) as f32;
    let radius = (-2.0 * share.ln()).sqrt();
    let (sin, cos) = (phase * std::f32::consts::TAU).sin_cos();
    (radius * cos, radius * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_integral_has_its_tabulated_values() {
        // Abramowitz and Stegun, tables 5.1 and 5.2; the last by its asymptotic series.
        let table =
            [(0.01, 4.037_929_576_538), (0.1, 1.822_923_958_419), (1.0, 0.219_383_934_396), (5.0, 1.148_295_591_3e-3)];
        for (x, value) in table {
            assert!((exponential_integral(x) / value - 1.0).abs() < 1e-10, "E1({x}) = {}", exponential_integral(x));
        }
        // Both forms meet.
        assert!((exponential_integral(1.0 - 1e-9) - exponential_integral(1.0 + 1e-9)).abs() < 1e-8);
    }
}
