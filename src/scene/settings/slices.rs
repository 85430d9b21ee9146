//! Settings of stage 1: filters of the slices, storage of the volume.

use serde::{Deserialize, Serialize};

/// Stage 1: how a frame becomes a slice. Its filters run in this order.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Slices {
    /// Pixels along the longer edge of a slice (sweeps only; a Cartesian volume keeps its own).
    pub pixels: u32,
    /// Median 3x3 on each slice.
    pub median: bool,
    /// A local estimator as a filter of its own.
    pub estimator: Option<Estimator>,
    /// Edge constant k of a Perona-Malik estimator, 0..1.
    pub estimator_edge: f64,
    pub sigma: Option<Sigma>,
    pub enhanced_sigma: Option<EnhancedSigma>,
    pub perona_malik: Option<PeronaMalik>,
    pub smooth: Option<Smooth>,
    /// A slight Gaussian blur of 3x3 against wood grain (thesis Fig. 32, 33): what is left of the pixel lattice on a tilted
    /// surface. Where `smooth` blurs slices already, this adds nothing.
    pub blur: bool,
    pub format: VolumeFormat,
    /// Converts and filters all of the volume, not only what the region, start depths and clip planes leave to be seen. The
    /// picture is the same; a region that is dragged then needs no frames anew when it grows.
    pub everything: bool,
    /// The volume is rendered many times before it changes: what is worth being made once for all of these pictures is made. The
    /// picture is the same but for the last digit of its samples.
    pub still: bool,
}

impl Default for Slices {
    fn default() -> Self {
        Slices {
            pixels: 512,
            median: false,
            estimator: None,
            estimator_edge: 0.1,
            sigma: None,
            enhanced_sigma: None,
            perona_malik: None,
            smooth: None,
            blur: false,
            format: VolumeFormat::R16f,
            everything: false,
            still: false,
        }
    }
}

/// Storage of the volume: bytes against error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum VolumeFormat {
    R8,
    R16,
    #[default]
    R16f,
    R32f,
}

/// Lee's sigma filter: the mean of the pixels of a window that lie within `range` of its centre.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sigma {
    /// Odd edge of the window, pixels.
    pub window: u32,
    /// Standard deviation of the noise: a neighbour counts within 2 sigma. In 0..1 on slices and pictures, mm on distances;
    /// a share of the centre's value where the noise is multiplicative.
    pub sigma: f64,
    pub noise: Noise,
}

impl Default for Sigma {
    fn default() -> Self {
        Sigma { window: 7, sigma: 0.1, noise: Noise::Additive }
    }
}

/// How noise goes with the value that it is on (Lee 1983): what a sigma is measured in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Noise {
    /// The same everywhere: speckle after log compression. A neighbour counts within 2 sigma.
    #[default]
    Additive,
    /// In proportion to the value: speckle of linear envelopes. A neighbour counts within 2 sigma times the centre.
    Multiplicative,
}

/// The sigma filter with a window that grows where too few neighbours are like the centre (thesis 5.4), about a centre that
/// is estimated first.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnhancedSigma {
    /// Odd edge of the window to start with, pixels.
    pub window: u32,
    /// Odd edge of the largest window, pixels. Thesis Tables 7-9: 17, 19, 19, 21, 21, 23 for starts of 3, 5, 7, 9, 11, 13.
    pub largest: u32,
    /// Standard deviation of the noise: a neighbour counts within 2 sigma of the centre. In 0..1 of a slice's samples or a
    /// picture's brightness, mm on distances; a share of the centre where the noise is multiplicative.
    pub sigma: f64,
    pub noise: Noise,
    /// What estimates the centre. Absent: Perona-Malik in modes of planes, the median in all others (thesis 5.5).
    pub centre: Option<Estimator>,
    /// Edge constant k of a Perona-Malik centre, in the units of sigma.
    pub edge: f64,
    /// Keeps by how many rings each pixel's window grew (thesis Tables 7-9). Slices only.
    pub growth: bool,
}

impl Default for EnhancedSigma {
    fn default() -> Self {
        EnhancedSigma {
            window: 5,
            largest: 19,
            sigma: 0.1,
            noise: Noise::Additive,
            centre: None,
            edge: 0.1,
            growth: false,
        }
    }
}

/// What a pixel would be without noise, from its neighbours alone (thesis 5.4).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Of 3x3.
    #[default]
    Median,
    /// One explicit step of 0.2 with four neighbours (Perona and Malik 1990).
    PeronaMalik,
    /// Half the pixel, half its eight neighbours by the inverse of their difference (Wang, Vagnucci and Li 1981).
    GradientInverse,
    /// Mean of the one of nine masks in 5x5 that varies least (Nagao and Matsuyama 1979).
    NagaoMatsuyama,
}

/// Anisotropic diffusion with four neighbours (Perona and Malik 1990; thesis 5-9..5-12).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct PeronaMalik {
    pub scheme: Scheme,
    /// Edge constant k: differences above it are kept. In 0..1 on slices and pictures, mm on distances; infinity keeps none,
    /// which is the heat equation, and 0 keeps all.
    pub edge: f64,
    pub conductance: Conductance,
    /// Diffusion time of one step, pixels^2: lambda of the explicit scheme, at most 1/4; tau of AOS, of any size.
    pub step: f64,
    /// Steps in a row, 1..=1000.
    pub repeat: u32,
}

impl Default for PeronaMalik {
    fn default() -> Self {
        PeronaMalik { scheme: Scheme::Explicit, edge: 0.1, conductance: Conductance::Quotient, step: 0.2, repeat: 5 }
    }
}

impl PeronaMalik {
    /// How far it carries a value, pixels: three standard deviations of the heat equation, whose variance is twice the time;
    /// the explicit scheme no further than a pixel a step. At most 64.
    pub fn reach(&self) -> f64 {
        let steps = f64::from(self.repeat);
        let spread = 3.0 * (2.0 * self.step * steps).sqrt();
        let carried = if self.scheme == Scheme::Explicit { spread.min(steps) } else { spread };
        carried.min(64.0)
    }
}

/// How the diffusion equation is stepped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scheme {
    /// Forward Euler: one dispatch a step.
    #[default]
    Explicit,
    /// Additive operator splitting (Weickert, ter Haar Romeny and Viergever 1998): semi-implicit, stable at any step though
    /// not accurate at large ones; four dispatches a step.
    Aos,
}

/// How well a difference g of neighbours conducts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Conductance {
    /// 1 / (1 + (g/k)^2): favours wide regions.
    #[default]
    Quotient,
    /// exp(-(g/k)^2): favours edges of high contrast.
    Exponential,
}

/// Separable 3D Gaussian in texture space; standard deviations, 0 for none, or the edge of a small kernel instead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Smooth {
    /// mm.
    pub lateral: f64,
    /// mm.
    pub depth: f64,
    /// Slices.
    pub elevation: f64,
    /// Taps along each axis, 3 or 5: a Gaussian in pixels, pixels and slices, as wide as the binomial of as many
    /// (deviation sqrt(n - 1) / 2) and cut off there. Instead of the deviations above.
    pub kernel: Option<u32>,
}
