//! What the surface detector learns of the noise before an edge.

use crate::scene::RING;

/// Samples that the noise is learnt from: two rings. More would hold on to what is long past, a slope of the gain above all.
const MEMORY: f64 = 16.0;

/// Mean and variance of the samples that have left the ring's newer half; `learnt` of them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    pub learnt: f64,
    pub mean: f64,
    pub variance: f64,
}

impl Noise {
    /// The older half, newest first: all of it to begin with, then what has just come into it.
    pub fn learn(&mut self, older: [f64; RING as usize / 2]) {
        if self.learnt == 0.0 {
            let count = older.len() as f64;
            self.learnt = count;
            self.mean = older.iter().sum::<f64>() / count;
            self.variance = older.iter().map(|v| (v - self.mean).powi(2)).sum::<f64>() / (count - 1.0);
            return;
        }
        self.learnt += 1.0;
        // The recursions of the mean and the unbiased variance of n samples (Welford), held at n = MEMORY.
        let n = self.learnt.min(MEMORY);
        let off = older[0] - self.mean;
        self.mean += off / n;
        self.variance = self.variance * (n - 2.0) / (n - 1.0) + off * off / n;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up to MEMORY samples they are the mean and the unbiased variance of all; then the oldest are forgotten.
    #[test]
    fn the_noise_is_that_of_the_samples_and_forgets() {
        let samples: Vec<f64> = (0..16).map(|i| 0.4 + 0.3 * (f64::from(i) * 1.7).sin()).collect();
        let mut noise = Noise::default();
        // Newest first.
        noise.learn([samples[3], samples[2], samples[1], samples[0]]);
        samples[4..].iter().for_each(|newest| noise.learn([*newest, 9.0, 9.0, 9.0]));
        let mean = samples.iter().sum::<f64>() / 16.0;
        let variance = samples.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 15.0;
        assert!((noise.mean - mean).abs() < 1e-12 && (noise.variance - variance).abs() < 1e-12, "{noise:?}");
        (0..200).for_each(|_| noise.learn([0.9; 4]));
        assert!((noise.mean - 0.9).abs() < 1e-4 && noise.variance < 1e-4, "{noise:?}");
    }
}
