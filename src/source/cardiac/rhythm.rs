//! The rhythm of a heart in the frames of a slow sweep.
//!
//! STIC takes it from the autocorrelation of the frames (DeVore, Falkensammer, Sklansky and Platt, Ultrasound Obstet Gynecol 22, 380-387, 2003; US
//! patent 6,980,844): what moves with the heart is the same again a cycle later. Here the signals are the mean grey values of 8 x 8 blocks of
//! the frame, and there are two steps.
//!
//! 1. **The mean rate**: the peak of the blocks' summed power spectrum, the Fourier transform of their autocorrelation. The sweep moves
//!    speckle through every block, and its spectrum falls with frequency; a local maximum of the autocorrelation is then often of
//!    speckle alone. So a peak counts by how far it rises above the geometric mean of the spectrum 1.3 times below and above, which a
//!    falling power law does not.
//! 2. **The phase of each frame**: the blocks are demodulated at that rate and at twice that rate, in windows of six cycles, and the phase between
//!    a place of the sweep and the next one is that of the sum of z*(n) z(n + 1) over the blocks (Kasai, Namekawa, Koyano and Omoto, IEEE
//!    Trans Sonics Ultrason 32, 458-464, 1985). A block in which the heart is bright at the end of systole counts like one in which it is dark, and a sign that
//!    changes as the sweep goes on costs nothing. The sum is smoothed along the sweep, and demodulation is repeated with the phases found.
//!
//! What it cannot see: a phase that drifts through all blocks alike while the sweep passes a wall is taken for a change of the rate.

use crate::{Frame, StoredType};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Blocks along an edge of a frame. With 16 the errors on simulated sweeps were larger: while a wall crosses a small block, its waveform changes.
const BLOCKS: usize = 8;
/// Least height of a peak of the spectrum, dB. That of speckle at rest was 1.4 dB at most on simulated sweeps, that of a small heart (6 to 8 mm) 6 dB
/// and that of a large one 20 dB.
const LEAST_HEIGHT: f64 = 3.5;
/// Least share of all changes of the blocks that a heart has. Edges that the sweep moves over samples repeat as well, but had 1e-4 at most without any
/// speckle, which hides them; a small heart has 1e-2.
const LEAST_SHARE: f64 = 3e-4;
/// The surroundings of a rate are the spectrum at so many times the rate and at its inverse.
const ASIDE: f64 = 1.3;
/// Half of the band around a rate, as a share of it, over which the spectrum is averaged: a heart's rate is not constant.
const BAND: f64 = 0.04;
/// Least frames of the shortest cycle, and cycles in all: fewer do not set a peak apart from its surroundings.
const LEAST_FRAMES: f64 = 6.0;
const LEAST_CYCLES: f64 = 8.0;
/// Length of the window of demodulation, and of smoothing along the sweep, in cycles.
const WINDOW: f64 = 6.0;
/// Demodulations, each with the phases of the one before.
const ROUNDS: usize = 3;
/// Harmonics that are demodulated.
const HARMONICS: usize = 2;
/// Weight of the mean rate, as a share of the mean weight of what is seen. It decides where no heart is seen.
const PRIOR: f64 = 0.05;

/// Between two R waves, s.
const INTERVALS: std::ops::RangeInclusive<f64> = 0.06..=6.0;
/// Most cycles before the first or after the last R wave.
const MOST_BEYOND: f64 = 2.0;

/// Mean grey values of blocks of pixels of each frame, from which the heartbeat is found.
pub struct Motion {
    /// Samples of a line, and lines.
    size: [usize; 2],
    stored: StoredType,
    /// By frame, [`BLOCKS`] squared values.
    means: Vec<Vec<f64>>,
}

impl Motion {
    /// Starts without frames. `size`: samples a line, lines a frame.
    pub fn new(size: [usize; 2], stored: StoredType) -> Motion {
        Motion { size, stored, means: Vec::new() }
    }

    /// Adds the next frame. A frame of another size counts as black.
    pub fn take(&mut self, frame: &Frame) {
        let [samples, lines] = self.size;
        let (mut sums, mut counts) = (vec![0.0; BLOCKS * BLOCKS], vec![0usize; BLOCKS * BLOCKS]);
        if frame.bytes.len() == samples * lines * self.stored.bytes() {
            for (line, row) in frame.bytes.chunks_exact(samples * self.stored.bytes()).enumerate() {
                for (sample, bytes) in row.chunks_exact(self.stored.bytes()).enumerate() {
                    let block = line * BLOCKS / lines * BLOCKS + sample * BLOCKS / samples;
                    sums[block] += self.stored.value(bytes);
                    counts[block] += 1;
                }
            }
        }
        sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum /= count.max(1) as f64);
        self.means.push(sums);
    }

    /// The power spectrum, summed over the blocks, between two frequencies in cycles a frame.
    fn spectrum(&self, low: f64, high: f64) -> Spectrum {
        let frames = self.means.len();
        // Four values a line width of the Hann window, so that a peak between two is not missed.
        let pitch = 0.25 / frames as f64;
        let first = (low / pitch).floor().max(1.0);
        let count = (high / pitch).ceil() as usize + 2 - first as usize;
        let middle = 0.5 * (frames as f64 - 1.0);
        let windows: Vec<f64> =
            (0..frames).map(|n| 0.5 - 0.5 * (TAU * (n as f64 + 0.5) / frames as f64).cos()).collect();
        let spread: f64 = (0..frames).map(|n| (n as f64 - middle).powi(2)).sum();
        let mut signals = vec![vec![0.0; BLOCKS * BLOCKS]; frames];
        // Rounding is far below; frames without any change have this power and no peak.
        let mut floor = f64::MIN_POSITIVE;
        for block in 0..BLOCKS * BLOCKS {
            let mean = self.means.iter().map(|means| means[block]).sum::<f64>() / frames as f64;
            let along = self.means.iter().enumerate().map(|(n, means)| (n as f64 - middle) * means[block]).sum::<f64>();
            floor += (1e-6 * mean * frames as f64).powi(2);
            for (n, out) in signals.iter_mut().enumerate() {
                out[block] = windows[n] * (self.means[n][block] - mean - along / spread * (n as f64 - middle));
            }
        }
        let energy = signals.iter().flatten().map(|x| x * x).sum::<f64>();
        let power = |k: usize| {
            let (mut re, mut im) = (vec![0.0; BLOCKS * BLOCKS], vec![0.0; BLOCKS * BLOCKS]);
            for (n, signals) in signals.iter().enumerate() {
                let (sin, cos) = (TAU * (first + k as f64) * pitch * n as f64).sin_cos();
                for ((re, im), x) in re.iter_mut().zip(&mut im).zip(signals) {
                    *re += x * cos;
                    *im += x * sin;
                }
            }
            floor + re.iter().zip(&im).map(|(re, im)| re * re + im * im).sum::<f64>()
        };
        let powers: Vec<f64> = (0..count).into_par_iter().map(power).collect();
        let mut sums = vec![0.0; count + 1];
        (0..count).for_each(|k| sums[k + 1] = sums[k] + powers[k]);
        Spectrum { first, pitch, sums, energy }
    }

    /// The blocks demodulated with `harmonic` times the phases, at a frame: the sum over a Blackman window of `half` frames to each side, less what a
    /// constant would give.
    fn demodulated(&self, frame: usize, half: usize, harmonic: f64, phases: &[f64]) -> [Vec<f64>; 2] {
        let (mut re, mut im) = (vec![0.0; BLOCKS * BLOCKS], vec![0.0; BLOCKS * BLOCKS]);
        let (mut mean, mut all) = (vec![0.0; BLOCKS * BLOCKS], [0.0; 3]);
        let from = frame.saturating_sub(half);
        let within = self.means.iter().zip(phases).enumerate().take(frame + half + 1).skip(from);
        for (n, (means, phase)) in within {
            let at = TAU * (n as f64 - frame as f64) / (2 * half + 2) as f64;
            let weight = 0.42 + 0.5 * at.cos() + 0.08 * (2.0 * at).cos();
            let (sin, cos) = (-TAU * harmonic * phase).sin_cos();
            all = [all[0] + weight, all[1] + weight * cos, all[2] + weight * sin];
            let each = re.iter_mut().zip(&mut im).zip(&mut mean).zip(means);
            for (((re, im), mean), x) in each {
                *re += x * weight * cos;
                *im += x * weight * sin;
                *mean += x * weight;
            }
        }
        for ((re, im), mean) in re.iter_mut().zip(&mut im).zip(&mean) {
            *re -= mean * all[1] / all[0];
            *im -= mean * all[2] / all[0];
        }
        [re, im]
    }
}

/// Power at equally spaced frequencies, as its running sum.
struct Spectrum {
    /// The first frequency, in steps of `pitch` cycles a frame.
    first: f64,
    pitch: f64,
    sums: Vec<f64>,
    /// Energy of the signals at all frequencies.
    energy: f64,
}

impl Spectrum {
    /// Power of the band around a frequency, and its width in steps of the pitch.
    fn band(&self, frequency: f64) -> (f64, f64) {
        // At least the width of a line.
        let half = (BAND * frequency).max(4.0 * self.pitch);
        let sum = |frequency: f64| {
            let at = (frequency / self.pitch - self.first).clamp(0.0, (self.sums.len() - 1) as f64);
            let n = (at as usize).min(self.sums.len() - 2);
            self.sums[n] + (self.sums[n + 1] - self.sums[n]) * (at - n as f64)
        };
        (sum(frequency + half) - sum(frequency - half), 2.0 * half / self.pitch)
    }

    /// Logarithm of the mean power around a frequency.
    fn level(&self, frequency: f64) -> f64 {
        let (power, width) = self.band(frequency);
        (power / width).max(f64::MIN_POSITIVE).ln()
    }

    /// Share of the energy in the band around a frequency, by Parseval's theorem.
    fn share(&self, frequency: f64) -> f64 {
        if self.energy > 0.0 { 2.0 * self.pitch * self.band(frequency).0 / self.energy } else { 0.0 }
    }

    /// How far the spectrum at a frequency rises above its surroundings, dB.
    fn height(&self, frequency: f64) -> f64 {
        let around = 0.5 * (self.level(frequency / ASIDE) + self.level(frequency * ASIDE));
        (self.level(frequency) - around) * 10.0 / std::f64::consts::LN_10
    }

    /// The frequency of the largest height between two frequencies, and the height.
    fn peak(&self, low: f64, high: f64) -> (f64, f64) {
        let steps = ((high / low).ln() / 0.004).ceil().max(1.0);
        let at = |n: usize| low * (high / low).powf(n as f64 / steps);
        let heights = (0..=steps as usize).map(|n| (at(n), self.height(at(n))));
        heights.fold((low, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best })
    }
}

/// The phase of the heart in each frame of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Rhythm {
    /// For each frame the number of heart cycles, rising and fractional, since the first frame or, if R waves were given, since the first of them
    /// (negative before it).
    pub phases: Vec<f64>,
    /// Mean heart rate, cycles a frame. Frames count by how clearly they show a heart, or all alike if R waves were given.
    pub mean: f64,
    /// Height of the peak at the heart rate in the power spectrum of the blocks of [`Motion`], above the spectrum around it, dB. None if the times of
    /// R waves were given.
    pub height: Option<f64>,
}

impl Rhythm {
    /// Finds the heartbeat in frames that follow each other at `rate` frames a second. `heart_rate`: least and largest that is looked for,
    /// cycles a minute.
    ///
    /// # Errors
    /// One line: too few frames a second or too few frames in all for `heart_rate`, or nothing that repeats at such a rate.
    pub fn find(motion: &Motion, rate: f64, heart_rate: [f64; 2]) -> Result<Rhythm, String> {
        let frames = motion.means.len() as f64;
        let [least, most] = heart_rate;
        let per_frame = |rate_a_minute: f64| rate_a_minute / 60.0 / rate;
        if per_frame(most) * LEAST_FRAMES > 1.0 {
            return Err(format!(
                "{rate:.1} frames a second are too few for {most} cycles a minute: a cycle must have {LEAST_FRAMES} frames or more"
            ));
        }
        let low = per_frame(least).max(LEAST_CYCLES / frames);
        let high = per_frame(most);
        if low >= high {
            let needed = (LEAST_CYCLES / high).ceil();
            return Err(format!("{frames} frames are too few: {LEAST_CYCLES} cycles of {most} a minute have {needed}"));
        }
        let widest = ASIDE * (1.0 + BAND);
        let spectrum = motion.spectrum(low / widest - 1.0 / frames, high * widest + 1.0 / frames);
        let (mut mean, mut height) = spectrum.peak(low, high);
        // Twice the rate of a heart may be the highest peak: much moves twice in a cycle.
        if mean / 2.0 >= low {
            let half = spectrum.peak((mean / 2.0 * (1.0 - BAND)).max(low), mean / 2.0 * (1.0 + BAND));
            if half.1 >= LEAST_HEIGHT {
                (mean, height) = half;
            }
        }
        let (height, share) = (height.max(0.0), spectrum.share(mean));
        if height < LEAST_HEIGHT || share < LEAST_SHARE {
            let why = match height < LEAST_HEIGHT {
                true => format!("is {height:.1} dB above its surroundings, where {LEAST_HEIGHT} are needed"),
                false => format!("has {share:.0e} of all changes, where {LEAST_SHARE:.0e} are needed"),
            };
            return Err(format!(
                "nothing in the frames repeats {least} to {most} times a minute: the highest peak of their spectrum, at {:.0}, {why}",
                mean * rate * 60.0
            ));
        }
        let (phases, mean) = followed(motion, mean);
        Ok(Rhythm { phases, mean, height: Some(height) })
    }

    /// The phases of frames at `times` from `triggers`, the times of an ECG's R waves; both in s on the clock of the frames. Before the first R
    /// wave and after the last, the nearest cycle is repeated.
    ///
    /// # Errors
    /// One line: no frames, fewer than two R waves during the sweep, more than two cycles of the sweep before the first or after the last, times that
    /// do not rise, or R waves less than 0.06 s or more than 6 s apart.
    pub fn of_triggers(times: &[f64], triggers: &[f64]) -> Result<Rhythm, String> {
        for (name, of) in [("R wave", triggers), ("frame", times)] {
            if let Some(n) = (1..of.len()).find(|n| !(of[*n] > of[*n - 1] && of[*n].is_finite() && of[0].is_finite())) {
                return Err(format!(
                    "{name} {}, at {} s, does not come after the one at {} s",
                    n + 1,
                    of[n],
                    of[n - 1]
                ));
            }
        }
        // As `--heart-rate` allows. Detectors find one wave twice, or miss some.
        if let Some(n) = (1..triggers.len()).find(|n| !INTERVALS.contains(&(triggers[*n] - triggers[*n - 1]))) {
            return Err(format!(
                "R wave {} comes {} s after the one before it, must be {} to {} s",
                n + 1,
                triggers[n] - triggers[n - 1],
                INTERVALS.start(),
                INTERVALS.end()
            ));
        }
        let (Some(first), Some(last)) = (times.first(), times.last()) else { return Err("no frames".into()) };
        let within = triggers.iter().filter(|t| (first..=last).contains(t)).count();
        if within < 2 {
            return Err(format!(
                "{within} of {} R waves lie between {first:.3} and {last:.3} s, when the frames were acquired: at least 2 bound a cycle",
                triggers.len()
            ));
        }
        let phase = |time: f64| {
            let n = triggers.partition_point(|t| *t <= time).clamp(1, triggers.len() - 1) - 1;
            n as f64 + (time - triggers[n]) / (triggers[n + 1] - triggers[n])
        };
        // The nearest cycle says little of one that is far from it.
        let beyond = (-phase(*first)).max(phase(*last) - (triggers.len() - 1) as f64);
        if beyond > MOST_BEYOND {
            return Err(format!(
                "{beyond:.1} cycles of the sweep lie before the first or after the last R wave; at most {MOST_BEYOND}"
            ));
        }
        let mean = (phase(*last) - phase(*first)) / (times.len() - 1) as f64;
        Ok(Rhythm { phases: times.iter().map(|time| phase(*time)).collect(), mean, height: None })
    }

    /// Number of heart cycles from the first frame to the last.
    pub fn cycles(&self) -> f64 {
        match (self.phases.first(), self.phases.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}

/// The phase of each frame, in cycles from the first one, and the mean rate where a heart is seen, in cycles a frame, of which `mean` is about
/// right.
fn followed(motion: &Motion, mut mean: f64) -> (Vec<f64>, f64) {
    let frames = motion.means.len();
    let half = (0.5 * WINDOW / mean) as usize;
    // The phases that were found are less than a turn apart between places of the sweep this near.
    let apart = ((0.125 / mean) as usize).max(1);
    let places: Vec<usize> = (0..frames).step_by(apart).collect();
    let reach = half / apart;
    let bells: Vec<f64> =
        (0..=2 * reach).map(|k| 0.5 - 0.5 * (TAU * (k + 1) as f64 / (2 * reach + 2) as f64).cos()).collect();
    let mut phases: Vec<f64> = (0..frames).map(|n| n as f64 * mean).collect();
    for _ in 0..ROUNDS {
        // Turns from each place to the next, beyond those of `phases`, and their weight.
        let (mut turns, mut weights) = (vec![0.0; places.len() - 1], vec![0.0; places.len() - 1]);
        for harmonic in 1..=HARMONICS {
            let order = harmonic as f64;
            let z: Vec<_> = places.par_iter().map(|frame| motion.demodulated(*frame, half, order, &phases)).collect();
            let products: Vec<[f64; 2]> = z.windows(2).map(|z| product(&z[0], &z[1])).collect();
            for (n, (turn, weight)) in turns.iter_mut().zip(&mut weights).enumerate() {
                let (mut re, mut im) = (0.0, 0.0);
                for (k, bell) in bells.iter().enumerate() {
                    if let Some([a, b]) = (n + k).checked_sub(reach).and_then(|n| products.get(n)) {
                        (re, im) = (re + bell * a, im + bell * b);
                    }
                }
                // The turn of a harmonic is that of the heart times its order, and as much more precise.
                *turn += order * re.hypot(im) * im.atan2(re) / TAU;
                *weight += order * order * re.hypot(im);
            }
        }
        // What each pair of places says of the phase between them, and the mean over the places where a heart is seen.
        let said: Vec<f64> = (0..turns.len())
            .map(|n| {
                let so_far = phases[places[n + 1]] - phases[places[n]];
                so_far + if weights[n] > 0.0 { turns[n] / weights[n] } else { 0.0 }
            })
            .collect();
        let all: f64 = weights.iter().sum();
        if all <= 0.0 {
            break;
        }
        let usual = said.iter().zip(&weights).map(|(said, weight)| said * weight).sum::<f64>() / all;
        let prior = PRIOR * all / weights.len() as f64;
        if !(0.5..=2.0).contains(&(usual / apart as f64 / mean)) {
            break;
        }
        mean = usual / apart as f64;
        let more: Vec<f64> = (0..said.len())
            .map(|n| {
                let wanted = (weights[n] * said[n] + prior * usual) / (weights[n] + prior);
                (wanted - (phases[places[n + 1]] - phases[places[n]])) / apart as f64
            })
            .collect();
        let mut before = phases[0];
        for n in 1..frames {
            let more = more[((n - 1) / apart).min(more.len() - 1)];
            // A heart changes its rate by less. Phases have to rise.
            let step = (phases[n] - before + more).clamp(0.6 * mean, 1.6 * mean);
            before = phases[n];
            phases[n] = phases[n - 1] + step;
        }
    }
    (phases, mean)
}

/// The sum of a* b over the blocks.
fn product(a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for (((ar, ai), br), bi) in a[0].iter().zip(&a[1]).zip(&b[0]).zip(&b[1]) {
        sum = [sum[0] + ar * br + ai * bi, sum[1] + ar * bi - ai * br];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of 32 x 16 in which each sample swings with an offset of its own, while a slow change and noise go over them.
    fn swinging(phases: &[f64], noise: f64) -> Motion {
        let mut motion = Motion::new([32, 16], StoredType::F32);
        let mut state = 1u64;
        for (n, phase) in phases.iter().enumerate() {
            let bytes: Vec<u8> = (0..32 * 16)
                .flat_map(|i| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let random = (state >> 40) as f64 / (1u64 << 24) as f64 - 0.5;
                    let offset = i as f64 * 0.07;
                    let turn = TAU * phase + offset;
                    let beat = turn.sin() + 0.5 * (2.0 * turn).cos();
                    let slow = 3.0 * (n as f64 * 0.003 + offset).sin();
                    ((100.0 + 5.0 * beat + slow + noise * random) as f32).to_le_bytes()
                })
                .collect();
            motion.take(&Frame::of_slice(0, n, bytes));
        }
        motion
    }

    #[test]
    fn phases_follow_a_heart_that_becomes_faster() {
        // From 2 to 2.4 cycles a second at 100 frames a second.
        let truth: Vec<f64> = (0..700).map(|n| n as f64 / 100.0).map(|t| 2.0 * t + 0.5 * 0.4 / 7.0 * t * t).collect();
        let rhythm = Rhythm::find(&swinging(&truth, 4.0), 100.0, [90.0, 200.0]).expect("a rhythm");
        let worst = rhythm.phases.iter().zip(&truth).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 0.05, "{worst} of a cycle");
        assert!((rhythm.cycles() - truth[699]).abs() < 0.05, "{} cycles", rhythm.cycles());
    }

    #[test]
    fn the_lower_of_two_rates_is_the_hearts_where_one_is_twice_the_other() {
        let truth: Vec<f64> = (0..700).map(|n| n as f64 * 0.016).collect();
        let rhythm = Rhythm::find(&swinging(&truth, 4.0), 100.0, [60.0, 220.0]).expect("a rhythm");
        assert!((rhythm.cycles() - truth[699]).abs() < 0.05, "{} cycles", rhythm.cycles());
    }

    #[test]
    fn noise_alone_has_no_rhythm_and_short_recordings_are_refused() {
        let still = vec![0.0; 400];
        for noise in [0.0, 60.0] {
            let error = Rhythm::find(&swinging(&still, noise), 100.0, [90.0, 200.0]).expect_err("noise");
            assert!(error.contains("repeats"), "{error}");
        }
        let constant = Motion { means: vec![vec![7.0; BLOCKS * BLOCKS]; 400], ..swinging(&[], 0.0) };
        assert!(Rhythm::find(&constant, 100.0, [90.0, 200.0]).expect_err("constant").contains("repeats"));
        let short: Vec<f64> = (0..60).map(|n| n as f64 * 0.02).collect();
        let error = Rhythm::find(&swinging(&short, 0.0), 100.0, [90.0, 200.0]).expect_err("60 frames");
        assert!(error.contains("60 frames are too few"), "{error}");
        let error = Rhythm::find(&swinging(&short, 0.0), 15.0, [90.0, 200.0]).expect_err("15 frames a second");
        assert!(error.contains("15.0 frames a second"), "{error}");
    }

    #[test]
    fn r_waves_give_whole_cycles_and_what_lies_between_is_linear() {
        let rhythm = Rhythm::of_triggers(&[0.0, 0.5, 1.0, 1.25, 1.5, 2.0], &[0.5, 1.0, 1.5]).expect("a rhythm");
        assert_eq!(rhythm.phases, [-1.0, 0.0, 1.0, 1.5, 2.0, 3.0]);
        let times = [0.0, 1.0, 2.0];
        for (times, triggers, wanted) in [
            (times, vec![1.0], "1 of 1 R waves"),
            (times, vec![7.0, 8.0, 9.0], "0 of 3 R waves"),
            (times, vec![0.5, 0.5], "R wave 2"),
            (times, vec![f64::NAN, 0.5, 1.0], "R wave 2"),
            (times, vec![0.2, 0.5, f64::INFINITY], "R wave 3"),
            (times, vec![0.2, 0.5, 0.500001], "R wave 3"),
            (times, vec![0.1, 0.3], "8.5 cycles of the sweep lie"),
            ([0.0, 2.0, 1.0], vec![0.2, 0.5, 1.0], "frame 3"),
        ] {
            let error = Rhythm::of_triggers(&times, &triggers).expect_err(wanted);
            assert!(error.contains(wanted), "{error}");
        }
    }
}
