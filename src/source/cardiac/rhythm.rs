//! The rhythm of a heart in the frames of a slow sweep. What moves with the heart repeats after each cycle, and what the sweep changes is slower.
//! So the mean grey values of blocks of the frame, less their moving average, correlate with themselves one cycle later. The lag of the
//! largest correlation in a window of a few cycles is the length of a cycle there; the phase is the integral of its inverse.

use crate::source::{Frame, StoredType};

/// Blocks along an edge of a frame. The lag was 0.1 % too short with 8 and 0.4 % with 16 on a simulated sweep of 24 cycles: where a wall crosses
/// a small block, its time changes as the sweep goes on.
const BLOCKS: usize = 8;
/// Least correlation one cycle apart that counts as a rhythm. Frames of noise alone stay below 0.1.
const LEAST_CORRELATION: f64 = 0.2;
/// Least frames of the shortest cycle, and cycles in all.
const LEAST_FRAMES: f64 = 6.0;
const LEAST_CYCLES: f64 = 4.0;

/// Mean grey values of the blocks of each frame.
pub struct Motion {
    /// Samples of a line, and lines.
    size: [usize; 2],
    stored: StoredType,
    /// By frame, [`BLOCKS`] squared values.
    means: Vec<Vec<f64>>,
}

impl Motion {
    /// Of frames with that many samples a line and lines.
    pub fn new(size: [usize; 2], stored: StoredType) -> Motion {
        Motion { size, stored, means: Vec::new() }
    }

    /// Takes the next frame. One of another size is taken as black.
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

    /// Each block's values less their mean over `window` frames around each.
    fn without_slow_changes(&self, window: usize) -> Vec<Vec<f64>> {
        let frames = self.means.len();
        let half = window / 2;
        let mut fast = vec![vec![0.0; BLOCKS * BLOCKS]; frames];
        for block in 0..BLOCKS * BLOCKS {
            let mut sums = vec![0.0; frames + 1];
            for n in 0..frames {
                sums[n + 1] = sums[n] + self.means[n][block];
            }
            for (n, out) in fast.iter_mut().enumerate() {
                let (low, high) = (n.saturating_sub(half), (n + half + 1).min(frames));
                out[block] = self.means[n][block] - (sums[high] - sums[low]) / (high - low) as f64;
            }
        }
        fast
    }
}

/// The cycles of the heart, by frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Rhythm {
    /// Cycles since the first frame; rising.
    pub phases: Vec<f64>,
    /// Correlation of what moves with itself one cycle later, -1..1; `None` if the cycles were given.
    pub correlation: Option<f64>,
}

impl Rhythm {
    /// Finds the rhythm of frames that follow each other at `rate` frames a second. `heart_rate`: least and largest, cycles a minute.
    ///
    /// # Errors
    /// In words: too few frames for such a rate, or nothing that repeats.
    pub fn find(motion: &Motion, rate: f64, heart_rate: [f64; 2]) -> Result<Rhythm, String> {
        let frames = motion.means.len();
        let [shortest, longest] = [60.0 * rate / heart_rate[1], 60.0 * rate / heart_rate[0]];
        if shortest < LEAST_FRAMES {
            let [_, most] = heart_rate;
            return Err(format!(
                "{rate:.1} frames a second are too few for {most} cycles a minute: a cycle must have {LEAST_FRAMES} frames or more"
            ));
        }
        if (frames as f64) < LEAST_CYCLES * shortest {
            let [_, most] = heart_rate;
            return Err(format!(
                "{frames} frames are too few: {LEAST_CYCLES} cycles of {most} a minute have {:.0}",
                (LEAST_CYCLES * shortest).ceil()
            ));
        }
        let longest = longest.min(frames as f64 / LEAST_CYCLES).max(shortest + 1.0);
        let fast = motion.without_slow_changes(longest.ceil() as usize | 1);
        let lags = shortest.floor() as usize..=longest.ceil() as usize;
        let everywhere = |_: usize| 1.0;
        let (period, correlation) = best_lag(&fast, &lags, everywhere, 0..frames).ok_or_else(|| {
            let [least, most] = heart_rate;
            format!("nothing in the frames repeats between {least} and {most} times a minute")
        })?;
        if correlation < LEAST_CORRELATION {
            return Err(format!(
                "nothing in the frames repeats: a correlation of {correlation:.2} at {:.0} a minute, where a heart has {LEAST_CORRELATION} or more",
                60.0 * rate / period
            ));
        }
        // The length of a cycle around each frame: at most a fifth from the mean.
        let around = (0.8 * period).floor() as usize..=(1.2 * period).ceil() as usize;
        let reach = 2.5 * period;
        let apart = (period / 4.0).max(1.0) as usize;
        let found: Vec<f64> = (0..=(frames - 1).div_ceil(apart))
            .map(|n| {
                let frame = n * apart;
                let weight = |n: usize| {
                    let away = (n as f64 + 0.5 * period - frame as f64) / reach;
                    if away.abs() < 1.0 { (0.5 * std::f64::consts::PI * away).cos().powi(2) } else { 0.0 }
                };
                let low = (frame as f64 - 0.5 * period - reach).max(0.0) as usize;
                let high = ((frame as f64 - 0.5 * period + reach).max(0.0) as usize + 1).min(frames);
                let local = best_lag(&fast, &around, weight, low..high);
                local.filter(|(_, correlation)| *correlation >= LEAST_CORRELATION).map_or(period, |(length, _)| length)
            })
            .collect();
        let length = |frame: usize| {
            let (n, share) = (frame / apart, (frame % apart) as f64 / apart as f64);
            let next = found[(n + 1).min(found.len() - 1)];
            found[n] + (next - found[n]) * share
        };
        let mut phases = vec![0.0; frames];
        for n in 1..frames {
            phases[n] = phases[n - 1] + 0.5 * (1.0 / length(n - 1) + 1.0 / length(n));
        }
        Ok(Rhythm { phases, correlation: Some(correlation) })
    }

    /// The rhythm from the times of an ECG's R waves, s, on the clock of the frames. Before the first and after the last, the nearest cycle
    /// repeats.
    ///
    /// # Errors
    /// In words: fewer than two times, or times that do not rise.
    pub fn of_triggers(times: &[f64], triggers: &[f64]) -> Result<Rhythm, String> {
        let count = triggers.len();
        if count < 2 {
            return Err(format!("{count} R waves: at least 2 bound a cycle"));
        }
        if let Some(n) = (1..count).find(|n| !(triggers[*n] > triggers[n - 1] && triggers[*n].is_finite())) {
            return Err(format!("R wave {}: {} s does not come after {} s", n + 1, triggers[n], triggers[n - 1]));
        }
        let phase = |time: f64| {
            let n = triggers.partition_point(|t| *t <= time).clamp(1, count - 1) - 1;
            n as f64 + (time - triggers[n]) / (triggers[n + 1] - triggers[n])
        };
        Ok(Rhythm { phases: times.iter().map(|time| phase(*time)).collect(), correlation: None })
    }

    /// Cycles from the first frame to the last.
    pub fn cycles(&self) -> f64 {
        match (self.phases.first(), self.phases.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}

/// The lag of the largest correlation, between frames by a parabola, and the correlation. Half of it if that correlates nearly as well: two
/// cycles correlate as one does.
fn best_lag(
    fast: &[Vec<f64>],
    lags: &std::ops::RangeInclusive<usize>,
    weight: impl Fn(usize) -> f64,
    frames: std::ops::Range<usize>,
) -> Option<(f64, f64)> {
    let at = |lag: usize| {
        let (mut product, mut here, mut there) = (0.0, 0.0, 0.0);
        for n in frames.start..frames.end.min(fast.len().saturating_sub(lag)) {
            let w = weight(n);
            if w > 0.0 {
                for (a, b) in fast[n].iter().zip(&fast[n + lag]) {
                    product += w * a * b;
                    here += w * a * a;
                    there += w * b * b;
                }
            }
        }
        if here > 0.0 && there > 0.0 { product / (here * there).sqrt() } else { 0.0 }
    };
    let first = lags.start().saturating_sub(1).max(1);
    let values: Vec<f64> = (first..=lags.end() + 1).map(at).collect();
    let is_peak = |i: &usize| values[*i] >= values[i - 1] && values[*i] > values[i + 1];
    let peaks: Vec<usize> = (1..values.len() - 1).filter(is_peak).collect();
    let largest = peaks.iter().copied().max_by(|a, b| values[*a].total_cmp(&values[*b]))?;
    let is_half = |i: usize| (first + largest).abs_diff(2 * (first + i)) * 10 < first + largest;
    let peak = peaks.into_iter().find(|i| is_half(*i) && values[*i] >= 0.9 * values[largest]).unwrap_or(largest);
    if values[peak] <= 0.0 {
        return None;
    }
    let (before, middle, after) = (values[peak - 1], values[peak], values[peak + 1]);
    let bend = before - 2.0 * middle + after;
    let offset = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    Some(((first + peak) as f64 + offset, middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of 32 x 16 in which each block swings with an offset of its own, while a slow ramp and noise go over them.
    fn swinging(phases: &[f64], noise: f64) -> Motion {
        let mut motion = Motion::new([32, 16], StoredType::F32);
        let mut state = 1u64;
        for (n, phase) in phases.iter().enumerate() {
            let bytes: Vec<u8> = (0..32 * 16)
                .flat_map(|i| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let random = (state >> 40) as f64 / (1u64 << 24) as f64 - 0.5;
                    let offset = i as f64 * 0.7;
                    let turn = std::f64::consts::TAU * phase + offset;
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
        assert!(worst < 0.12, "{worst} of a cycle");
        assert!((rhythm.cycles() - truth[699]).abs() < 0.1, "{} cycles", rhythm.cycles());
    }

    #[test]
    fn noise_alone_has_no_rhythm_and_short_recordings_are_refused() {
        let still = vec![0.0; 400];
        let error = Rhythm::find(&swinging(&still, 60.0), 100.0, [90.0, 200.0]).expect_err("noise");
        assert!(error.contains("repeats"), "{error}");
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
        assert!(Rhythm::of_triggers(&[0.0], &[1.0]).is_err());
        assert!(Rhythm::of_triggers(&[0.0], &[1.0, 1.0]).expect_err("equal").contains("R wave 2"));
    }
}
