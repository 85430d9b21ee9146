//! Settings of stage 1: conditioning of polar lines, filters of slices, storage of the volume.

use crate::scene::number::Allowed::{Any, Odd, OneOf, Range};
use crate::scene::number::Group::Filters;
use crate::scene::number::{Allowed, LENGTH, LENGTH_OR_0, NOT_NEGATIVE, Number, number};
use crate::scene::{MAX_DEVIATION, MAX_WINDOW};
use crate::tree::{Defaults, FromNode, Name, ToNode};

/// Conditioning of the samples of polar frames before scan conversion (thesis 4.3), in this order: time gain compensation, low pass and
/// decimation, log compression. Everything is off by default.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Conditioning {
    /// Time gain compensation: gains at increasing depths. Linear in dB between them, constant beyond the first and the last.
    pub tgc: Vec<Gain>,
    /// Dynamic range of log compression, dB, for linear envelopes (20 dB per decade). Absent: the samples are compressed already.
    pub dynamic_range: Option<f64>,
    /// Dynamic range, dB, that 0..1 stands for in samples that are compressed already: a gain of so many dB adds 1 to a sample.
    #[value(60.0)]
    pub compressed_range: f64,
    /// Standard deviation of the Gaussian low pass along each line, 0..=32 samples; 0 for none. Absent: half the decimation factor if
    /// lines are decimated, else none.
    pub low_pass: Option<f64>,
    /// Standard deviation of the low pass in mm along the line, in place of `low_pass`. It is limited to 32 samples.
    pub low_pass_mm: Option<f64>,
    /// Most samples per line. Longer lines are low-passed and decimated by the smallest integer factor that meets this.
    pub samples: Option<u32>,
}

/// A point of the time gain compensation curve.
#[derive(Clone, Copy, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Gain {
    /// Depth along the line from the probe's face, mm.
    pub depth: f64,
    /// Gain, dB.
    pub gain: f64,
}

impl Conditioning {
    /// Gain, dB, at a depth along the line from the probe's face, mm, by the curve `tgc`; 0 without one.
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

    /// Decimation factor for lines of `samples` samples, by the setting `samples`; 1 if it is absent.
    pub fn factor(&self, samples: usize) -> u32 {
        let most = self.samples.map_or(samples, |most| most.max(1) as usize);
        samples.div_ceil(most).max(1) as u32
    }

    /// Standard deviation of the low pass for a decimation factor, samples: `low_pass` if it is set. `low_pass_mm` does not count.
    ///
    /// By default half the factor M: a Gaussian of deviation s passes exp(-2 pi^2 s^2 f^2), so what would alias onto a constant
    /// (f = 1/M) is 43 dB down and what stays below half the new Nyquist frequency (f < 1/(4 M)) loses less than 3 dB.
    pub fn deviation(&self, factor: u32) -> f64 {
        self.low_pass.unwrap_or(if factor > 1 { f64::from(factor) / 2.0 } else { 0.0 })
    }
}

/// Stage 1: how a frame becomes a slice. The filters run in the order in which they are listed.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Slices {
    /// Pixels along the longer edge of a slice (sweeps only; a Cartesian volume keeps its voxels).
    #[value(512)]
    pub pixels: u32,
    /// Median filter of 3x3 pixels.
    pub median: bool,
    /// A local estimator, applied as a filter. Absent: none.
    pub estimator: Option<Estimator>,
    /// Edge constant k of a Perona-Malik estimator, at least 0, in sample values of 0..1: differences above it are preserved.
    #[value(0.1)]
    pub estimator_edge: f64,
    /// Sigma filter.
    pub sigma: Option<Sigma>,
    /// Enhanced sigma filter.
    pub enhanced_sigma: Option<EnhancedSigma>,
    /// Perona-Malik diffusion.
    pub perona_malik: Option<PeronaMalik>,
    /// Gaussian smoothing.
    pub smooth: Option<Smooth>,
    /// Slight Gaussian blur of 3x3 against wood grain, the trace of the pixel lattice on a tilted surface (thesis Fig. 32, 33); `rendered`: in modes that
    /// cast rays, and not in planes. Has no effect where `smooth` blurs slices already.
    #[value(Blur::Always(false))]
    pub blur: Blur,
    /// Texel format of the volume.
    pub format: VolumeFormat,
    /// Converts and filters the whole volume, not only the part that the region, start depths and clip planes leave visible, or that the
    /// shown planes cross. The picture is the same; a region that grows or a plane that moves then needs no new frames. The viewer sets it
    /// while planes are shown.
    pub everything: bool,
    /// The volume is rendered many times before it changes, which makes precomputed data worth its cost. The picture is the same, except that samples
    /// interpolated from `quads` may differ in their last digit.
    pub still: bool,
}

/// Texel format of the volume: memory against error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, Name, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum VolumeFormat {
    /// `r16f`. On a device that truncates what it stores as such (llvmpipe) `r16`, which is more accurate there in the same time, unless a filter
    /// may leave values beyond 0..1 (`slices.perona_malik` with scheme aos-richardson).
    #[default]
    Auto,
    /// 8 bits, normalised.
    R8,
    /// 16 bits, normalised.
    R16,
    /// Half-precision float.
    R16f,
    /// Single-precision float.
    R32f,
}

/// Lee's sigma filter: the mean of the pixels of a window whose values lie within 2 sigma of the centre. Where too few do, it is the mean of the four
/// neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Sigma {
    /// Window size, pixels; odd.
    #[value(7)]
    pub window: u32,
    /// Window size in mm, in place of `window`: the nearest odd number of pixels, at most 63; less than two are no filter. Not in `post`.
    pub window_mm: Option<f64>,
    /// Standard deviation of the noise. A neighbour counts within 2 sigma. In 0..1 on slices and pictures, in mm on distances; relative to
    /// the centre's value if the noise is multiplicative.
    #[value(0.1)]
    pub sigma: f64,
    /// Model of the noise.
    pub noise: Noise,
    /// How often the filter runs, each time on its own result; thesis 5.3: one or two.
    #[value(1)]
    pub repeat: u32,
}

/// Noise model (Lee 1983): how the noise depends on the value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Noise {
    /// Independent of the value: speckle after log compression. A neighbour counts within 2 sigma.
    #[default]
    Additive,
    /// Proportional to the value: speckle of linear envelopes. A neighbour counts within 2 sigma times the centre.
    Multiplicative,
}

/// The enhanced sigma filter (thesis 5.4): a sigma filter that estimates the centre first. Its window grows, ring by ring, until as many pixels are
/// within 2 sigma of the estimate as the starting window holds, or until it has its largest size.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct EnhancedSigma {
    /// Starting window size, pixels; odd.
    #[value(5)]
    pub window: u32,
    /// Largest window size, pixels; odd. Thesis Tables 7-9: 17, 19, 19 (21 in Table 8), 21, 21, 23 for starts of 3, 5, 7, 9, 11, 13.
    #[value(19)]
    pub largest: u32,
    /// Starting window size in mm, in place of `window`: the nearest odd number of pixels, at least 3 and at most 63. Not in `post`.
    pub window_mm: Option<f64>,
    /// Largest window size in mm, in place of `largest`: at least that of the starting window; less than two pixels are no filter. Not in `post`.
    pub largest_mm: Option<f64>,
    /// Standard deviation of the noise. A neighbour counts within 2 sigma of the centre. In 0..1 on slices and on the brightness of
    /// pictures, in mm on distances; relative to the centre if the noise is multiplicative.
    #[value(0.1)]
    pub sigma: f64,
    /// Model of the noise.
    pub noise: Noise,
    /// Estimator of the centre. Absent: Perona-Malik in modes of planes, the median in all others (thesis 5.7).
    pub centre: Option<Estimator>,
    /// Edge constant k of a Perona-Malik centre, at least 0: differences above it are preserved. In 0..1 on slices and on the brightness of pictures, in
    /// millimetres on distances, also if the noise is multiplicative.
    #[value(0.1)]
    pub edge: f64,
    /// Records by how many rings each pixel's window grew (thesis Tables 7-9). Slices only.
    pub growth: bool,
}

/// Estimate of a pixel without noise from its neighbourhood (thesis 5.3.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, Name, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Estimator {
    /// Median of 3x3.
    #[default]
    Median,
    /// One explicit step of 0.2 with four neighbours (Perona and Malik 1990).
    PeronaMalik,
    /// Half the pixel, half its eight neighbours weighted by the inverse of their difference (Wang, Vagnucci and Li 1981).
    GradientInverse,
    /// Mean of the mask with the least variance, of nine masks in 5x5 (Nagao and Matsuyama 1979).
    NagaoMatsuyama,
}

/// Anisotropic diffusion with four neighbours (Perona and Malik 1990; thesis 5-9..5-12).
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct PeronaMalik {
    /// Time stepping.
    pub scheme: Scheme,
    /// Edge constant k: differences above it are preserved. In 0..1 on slices and pictures, in mm on distances. Infinity preserves none
    /// (the heat equation), 0 preserves all.
    #[value(0.1)]
    pub edge: f64,
    /// Conductance function: how the diffusion falls with the difference of neighbouring values.
    pub conductance: Conductance,
    /// Diffusion time of one step, pixels^2. Lambda of the explicit scheme is at most 1/4, where a checkerboard, the highest frequency, only flips
    /// its sign at each step; at 1/5 three fifths of it are left. Tau of AOS is at most 1e9, that of RKL1 at most 200.
    #[value(0.2)]
    pub step: f64,
    /// Number of steps.
    #[value(5)]
    pub repeat: u32,
    /// Width of the diffusion in mm: the standard deviation of the Gaussian that it is where no edge stops it. It takes the
    /// place of `repeat` in the explicit scheme, whose step is then at most `step`, and of `step` in the others. Not in `post`.
    pub width_mm: Option<f64>,
}

impl PeronaMalik {
    /// How far the diffusion reaches, pixels: three standard deviations of the heat equation, whose variance is twice the time. The explicit scheme
    /// reaches at most one pixel per step. At most 64.
    pub fn reach(&self) -> f64 {
        let steps = f64::from(self.repeat);
        let spread = 3.0 * (2.0 * self.step * steps).sqrt();
        let carried = if self.scheme == Scheme::Explicit { spread.min(steps) } else { spread };
        carried.min(64.0)
    }

    /// Number of stages s of an RKL1 step: the smallest odd number, at least 3, for which the step is at most (s^2 + s)/2 times the explicit scheme's
    /// limit of 1/4 (Meyer, Balsara and Aslam 2014). Odd numbers damp the highest frequencies.
    pub fn stages(&self) -> u32 {
        (1..).map(|n| 2 * n + 1).find(|s| f64::from(s * s + s) / 8.0 >= self.step.min(200.0)).unwrap_or(3)
    }
}

/// Time stepping of the diffusion equation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Scheme {
    /// Forward Euler: one dispatch per step.
    #[default]
    Explicit,
    /// Additive operator splitting (Weickert, ter Haar Romeny and Viergever 1998): semi-implicit, stable at any step, inaccurate at large ones; two
    /// or four dispatches per step, on a CPU four.
    Aos,
    /// AOS with Richardson's extrapolation: twice the result of two half steps, less that of one step. Second order in the limit of short steps; the order
    /// measured on smooth data is 1.1 at steps of 4 and 1.7 at steps of 1/4. Stable, but values may leave the range of their neighbours. Slices only; six or
    /// twelve dispatches per step, on a CPU twelve.
    AosRichardson,
    /// Runge-Kutta-Legendre super time steps of first order (RKL1; Meyer, Balsara and Aslam 2014): explicit stages, as many as the step needs
    /// to be stable, about sqrt(8 step). Slices only; a dispatch per stage.
    Rkl1,
}

/// Conductance as a function of the difference g of two neighbours, with the edge constant k: the two of Perona and Malik (1990, section V), which
/// the thesis takes over (5.4.2). The paper says what each of them favours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Conductance {
    /// 1 / (1 + (g/k)^2): favours wide regions.
    #[default]
    Quotient,
    /// exp(-(g/k)^2): favours edges of high contrast.
    Exponential,
}

/// Separable 3D Gaussian in texture space: standard deviations (0 for none), or the size of a small kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Smooth {
    /// Standard deviation along lateral, mm.
    pub lateral: f64,
    /// Standard deviation along depth, mm.
    pub depth: f64,
    /// Standard deviation along elevation, slices.
    pub elevation: f64,
    /// Standard deviation along elevation in mm at the middle of the region, in place of `elevation`: it follows the slice pitch. It is limited to 32
    /// slices.
    pub elevation_mm: Option<f64>,
    /// Taps along each axis, in place of the deviations above: n taps of a Gaussian with the standard deviation of their binomial, sqrt(n - 1) / 2 pixels
    /// within slices and as many slices across them.
    pub kernel: Option<u32>,
}

fn with_sigma(filter: Option<Sigma>, sigma: f64) -> Option<Sigma> {
    (sigma > 0.0).then(|| Sigma { sigma, ..filter.unwrap_or_default() })
}

fn with_enhanced_sigma(filter: Option<EnhancedSigma>, sigma: f64) -> Option<EnhancedSigma> {
    (sigma > 0.0).then(|| EnhancedSigma { sigma, ..filter.unwrap_or_default() })
}

const WINDOW: Allowed = Odd(3.0, MAX_WINDOW as f64);

/// Makes the [`Number`](crate::scene::Number) rows of filters that slices, distance maps and pictures have, except those with sliders.
macro_rules! filters {
    ($of:ident) => {
        &[
            number!($of.sigma => window, "", WINDOW),
            number!($of.sigma => window_mm, "mm", LENGTH),
            number!($of.sigma => repeat, "", Range(1.0, 10.0)),
            number!($of.enhanced_sigma => window, "", WINDOW),
            number!($of.enhanced_sigma => largest, "", WINDOW),
            number!($of.enhanced_sigma => window_mm, "mm", LENGTH),
            number!($of.enhanced_sigma => largest_mm, "mm", LENGTH),
            number!($of.enhanced_sigma => edge, "", NOT_NEGATIVE),
            number!($of.perona_malik => edge, "", NOT_NEGATIVE),
            number!($of.perona_malik => repeat, "", Range(1.0, 1000.0)),
            number!($of.perona_malik => width_mm, "mm", LENGTH),
        ]
    };
}

/// Makes the rows of the numbers of a Gaussian ([`Smooth`]).
macro_rules! smooth {
    ($of:ident) => {
        &[
            number!($of.smooth => lateral, "mm", LENGTH_OR_0),
            number!($of.smooth => depth, "mm", LENGTH_OR_0),
            number!($of.smooth => elevation, "slices", Range(0.0, 1000.0)),
            number!($of.smooth => elevation_mm, "mm", LENGTH_OR_0),
            number!($of.smooth => kernel, "", OneOf(&[3.0, 5.0])),
        ]
    };
}

pub(super) const FILTERS: [&[Number]; 5] =
    [filters!(slices), filters!(distance), filters!(post), smooth!(slices), smooth!(planes)];

pub(super) const NUMBERS: &[Number] = &[
    number!(conditioning.tgc => depth, "mm", Range(0.0, 1e4)),
    number!(conditioning.tgc => gain, "dB", Range(-120.0, 120.0)),
    number!(conditioning.dynamic_range, "dB", Range(1.0, 200.0)),
    number!(conditioning.compressed_range, "dB", Range(1.0, 200.0)),
    number!(conditioning.low_pass, "", Range(0.0, MAX_DEVIATION)),
    number!(conditioning.low_pass_mm, "mm", LENGTH_OR_0),
    number!(conditioning.samples, "", Range(2.0, 65536.0)),
    number!(slices.pixels, "", Range(2.0, 4096.0)),
    number!(slices.estimator_edge, "", NOT_NEGATIVE),
    number!(slices.median, "", Any;
        Filters, "Median", [0.0, 1.0], 1.0, |_| true, "Removes speckle from each slice and keeps its edges. The volume is filtered again."),
    number!(slices.sigma => sigma, "", NOT_NEGATIVE;
        Filters, "Speckle", [0.0, 0.5], 0.01, |_| true, "Averages speckle within tissue of one brightness. The volume is filtered again.")
        .set_by(|s, v| s.slices.sigma = with_sigma(s.slices.sigma, v)),
    number!(slices.enhanced_sigma => sigma, "", NOT_NEGATIVE;
        Filters, "Speckle, enhanced", [0.0, 0.5], 0.01, |_| true, "The same with a window that follows the tissue. The volume is filtered again.")
        .set_by(|s, v| s.slices.enhanced_sigma = with_enhanced_sigma(s.slices.enhanced_sigma, v)),
    number!(post.sigma => sigma, "", NOT_NEGATIVE;
        Filters, "Picture speckle", [0.0, 0.5], 0.01, |_| true, "Averages speckle in the finished picture.")
        .set_by(|s, v| s.post.sigma = with_sigma(s.post.sigma, v)),
    number!(post.enhanced_sigma => sigma, "", NOT_NEGATIVE),
    number!(distance.sigma => sigma, "", NOT_NEGATIVE),
    number!(distance.enhanced_sigma => sigma, "", NOT_NEGATIVE),
];

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

/// Whether slices get a slight blur.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromNode, ToNode)]
#[tree(untagged, expecting = "must be true, false, or \"rendered\"")]
pub enum Blur {
    Always(bool),
    Named(BlurName),
}

/// The named choices of a blur.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum BlurName {
    /// In modes that cast rays, and not in modes of planes.
    Rendered,
}

impl Blur {
    /// True if slices are blurred. `is_flat`: true for modes of planes, false for modes that cast rays.
    pub fn is_on(self, is_flat: bool) -> bool {
        match self {
            Blur::Always(on) => on,
            Blur::Named(BlurName::Rendered) => !is_flat,
        }
    }
}
