//! Settings of stage 1: filters of the slices, storage of the volume.

use serde::{Deserialize, Serialize};

/// Stage 1: how a frame becomes a slice.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Slices {
    /// Pixels along the longer edge of a slice (sweeps only; a Cartesian volume keeps its own).
    pub pixels: u32,
    /// Median 3x3 on each slice.
    pub median: bool,
    pub sigma: Option<Sigma>,
    pub smooth: Option<Smooth>,
    pub format: VolumeFormat,
}

impl Default for Slices {
    fn default() -> Self {
        Slices { pixels: 512, median: false, sigma: None, smooth: None, format: VolumeFormat::R16f }
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

/// The sigma filter with a window that grows where too few neighbours are like the centre (thesis 5.4), about a centre
/// estimated by a median of 3x3.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnhancedSigma {
    /// Odd edge of the window to start with, pixels.
    pub window: u32,
    /// Odd edge of the largest window, pixels.
    pub largest: u32,
    /// Standard deviation of the noise, 0..1: a neighbour counts within 2 sigma of brightness.
    pub sigma: f64,
}

impl Default for EnhancedSigma {
    fn default() -> Self {
        EnhancedSigma { window: 5, largest: 19, sigma: 0.1 }
    }
}

/// Separable 3D Gaussian in texture space; standard deviations, 0 for none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Smooth {
    /// mm.
    pub lateral: f64,
    /// mm.
    pub depth: f64,
    /// Slices.
    pub elevation: f64,
}
