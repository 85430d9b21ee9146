//! Settings of line conditioning: what is done to the samples of a polar frame before it is scan-converted (thesis 4.3).

use serde::{Deserialize, Serialize};

/// Line conditioning, in this order: time gain compensation, low pass and decimation, log compression. Everything is off
/// unless asked for; for polar frames only.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Conditioning {
    /// Time gain compensation: gains at rising depths, linear between them in dB, level beyond the first and the last.
    pub tgc: Vec<Gain>,
    /// Samples are linear envelopes: 20 dB a decade are compressed to this many dB, 1..=200. Absent: they are compressed already.
    pub dynamic_range: Option<f64>,
    /// What 0..1 of samples that are compressed already stands for, dB, 1..=200: by how much a gain moves them.
    pub compressed_range: f64,
    /// Standard deviation of the Gaussian low pass along each line, samples, 0..=32; 0 for none. Absent: half the factor of
    /// decimation, or none.
    pub low_pass: Option<f64>,
    /// Longer lines are low-passed and decimated, by the smallest whole factor that leaves at most this many samples, 2..=65536.
    pub samples: Option<u32>,
}

impl Default for Conditioning {
    fn default() -> Self {
        Conditioning { tgc: Vec::new(), dynamic_range: None, compressed_range: 60.0, low_pass: None, samples: None }
    }
}

/// A point of the curve of time gain compensation.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Gain {
    /// Along the line, from the face, mm.
    pub depth: f64,
    /// dB, -120..=120.
    pub gain: f64,
}

impl Conditioning {
    /// Gain at a depth in mm, dB.
    pub fn gain(&self, depth: f64) -> f64 {
        let after = self.tgc.partition_point(|g| g.depth <= depth);
        match (after.checked_sub(1).and_then(|i| self.tgc.get(i)), self.tgc.get(after)) {
            (Some(low), Some(high)) => {
                low.gain + (high.gain - low.gain) * (depth - low.depth) / (high.depth - low.depth)
            }
            (Some(end), None) | (None, Some(end)) => end.gain,
            (None, None) => 0.0,
        }
    }

    /// Samples of a line that become one.
    pub fn factor(&self, samples: usize) -> u32 {
        let most = self.samples.map_or(samples, |most| most.max(1) as usize);
        samples.div_ceil(most).max(1) as u32
    }

    /// Standard deviation of the low pass for a factor of decimation, samples.
    ///
    /// By default half the factor M: a Gaussian of deviation s passes exp(-2 pi^2 s^2 f^2), so what would alias onto a constant
    /// (f = 1/M) is 43 dB down and what stays below half the new Nyquist frequency (f < 1/(4 M)) loses less than 3 dB.
    pub fn deviation(&self, factor: u32) -> f64 {
        self.low_pass.unwrap_or(if factor > 1 { f64::from(factor) / 2.0 } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_are_linear_between_points_and_level_beyond() {
        let tgc = vec![Gain { depth: 10.0, gain: -6.0 }, Gain { depth: 30.0, gain: 4.0 }];
        let c = Conditioning { tgc, ..Conditioning::default() };
        assert_eq!([0.0, 10.0, 15.0, 30.0, 99.0].map(|d| c.gain(d)), [-6.0, -6.0, -3.5, 4.0, 4.0]);
        assert_eq!(Conditioning::default().gain(5.0), 0.0);
    }

    #[test]
    fn a_line_keeps_at_most_the_samples_asked_for_and_is_not_cut_further_than_needed() {
        for samples in [2usize, 3, 5, 97, 512, 513, 3640] {
            for most in [2u32, 3, 96, 512, 4096] {
                let c = Conditioning { samples: Some(most), ..Conditioning::default() };
                let kept = |factor: u32| (samples - 1) / factor as usize + 1;
                let factor = c.factor(samples);
                assert!((2..=most as usize).contains(&kept(factor)), "{samples} to {most}");
                assert!(factor == 1 || kept(factor - 1) > most as usize, "{samples} to {most}");
            }
        }
    }
}
