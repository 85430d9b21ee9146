//! What a user may ask of a picture: the TOML scene file, its presets and defaults. Lengths in mm, angles in degrees,
//! samples and opacities in 0..1. Every struct refuses unknown keys, so that a typing error is not silently a default.

pub use super::settings_shade::*;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    pub mode: Mode,
    pub picture: Picture,
    pub slices: Slices,
    pub region: Region,
    pub camera: Camera,
    pub ray: Ray,
    pub volume: Volume,
    pub surface: Surface,
    pub distance: Distance,
    pub light: Light,
    pub post: Post,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// VR: emission and absorption through a transfer function.
    #[serde(alias = "vr")]
    Volume,
    /// SR: the first surface on each ray, lit.
    #[default]
    #[serde(alias = "sr")]
    Surface,
}

#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Picture {
    /// Width and height in pixels, 1..=16384.
    pub size: [u32; 2],
}

impl Default for Picture {
    fn default() -> Self {
        Picture { size: [512, 512] }
    }
}

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
    /// Standard deviation of the noise: a neighbour counts within 2 sigma. In 0..1 on slices and pictures, mm on distances.
    pub sigma: f64,
}

impl Default for Sigma {
    fn default() -> Self {
        Sigma { window: 7, sigma: 0.1 }
    }
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

/// The box that is rendered, mm: lateral from the middle, depth from the probe's face, elevation from the middle frame
/// (Cartesian volumes: along their own axes). Absent: all there is.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Region {
    pub lateral: Option<[f64; 2]>,
    pub depth: Option<[f64; 2]>,
    pub elevation: Option<[f64; 2]>,
}

/// Where the picture is taken from. All zero looks from the probe into the body, lateral to the right.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Turns the view towards +lateral, deg.
    pub azimuth: f64,
    /// Turns the view towards +elevation, deg.
    pub elevation: f64,
    /// Turns the picture clockwise, deg.
    pub roll: f64,
    /// 1 fits the region into the picture; larger is closer.
    pub zoom: f64,
    /// Vertical field of view, deg; 0 is parallel projection.
    pub field_of_view: f64,
    /// Looked at: lateral, depth, elevation in mm as in [`Region`]. Absent: the middle of the region.
    pub target: Option<[f64; 3]>,
}

impl Default for Camera {
    fn default() -> Self {
        Camera { azimuth: 0.0, elevation: 0.0, roll: 0.0, zoom: 1.0, field_of_view: 0.0, target: None }
    }
}

#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ray {
    /// Distance between samples, mm. Absent: one slice pixel.
    pub step: Option<f64>,
    /// A ray of VR ends when less than this share of light is left; 0 never ends early. The error is at most this.
    pub early_end: f64,
    pub sampling: Sampling,
}

impl Default for Ray {
    fn default() -> Self {
        Ray { step: None, early_end: 1.0 / 512.0, sampling: Sampling::Hardware }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// The device's own trilinear filter; its weights may have no more than 8 bits.
    #[default]
    Hardware,
    /// Eight fetches and our own interpolation in f32.
    Exact,
}

/// Mode VR.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Volume {
    /// Samples are stretched from this interval to 0..1 before anything else.
    pub window: [f64; 2],
    /// Nothing above this depth is drawn, mm below the probe's face (Cartesian: along the depth axis).
    pub start_depth: Option<f64>,
    pub transfer: Transfer,
}

impl Default for Volume {
    fn default() -> Self {
        Volume { window: [0.0, 1.0], start_depth: None, transfer: Transfer::Named(TransferName::Grey) }
    }
}

/// A named transfer function, or its points.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged, expecting = "must be grey, sepia, skin, bone, or a list of points { at, colour, opacity }")]
pub enum Transfer {
    Named(TransferName),
    Points(Vec<TransferPoint>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TransferName {
    Grey,
    Sepia,
    Skin,
    Bone,
}

/// Colour and opacity at a sample value, linear in between. Opacity is that of one voxel (one slice pixel).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TransferPoint {
    pub at: f64,
    pub colour: [f64; 3],
    pub opacity: f64,
}

/// Mode SR: the surface detector (thesis 4-3).
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Surface {
    pub window: [f64; 2],
    pub start_depth: Option<f64>,
    /// The detector fires above this difference of the means of the newer and the older half of its ring.
    pub threshold: f64,
    /// The rough detector's own threshold. Absent: the fine one's.
    pub rough_threshold: Option<f64>,
    /// Steps of the rough detector in fine steps, 1..=8; 1 is no rough detector.
    pub rough: u32,
    pub sign: Sign,
    pub place: Place,
    /// Which surface of the ray, 1..=8: 1 is the outermost, 2 the next behind it.
    pub number: u32,
}

impl Default for Surface {
    fn default() -> Self {
        Surface {
            window: [0.0, 1.0],
            start_depth: None,
            threshold: 0.1,
            rough_threshold: None,
            rough: 2,
            sign: Sign::Bright,
            place: Place::Peak,
            number: 1,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sign {
    /// Bright tissue in dark fluid.
    #[default]
    Bright,
    /// A dark cavity in bright tissue.
    Dark,
}

/// Where on the edge the surface is put.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Where the difference is largest within a ring's length, refined by a parabola: does not depend on the edge's height.
    #[default]
    Peak,
    /// Where the difference first exceeds the threshold: the thesis' own.
    FirstCrossing,
}

/// Stage 4.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Post {
    pub sigma: Option<Sigma>,
    pub enhanced_sigma: Option<EnhancedSigma>,
    /// Added, -1..1.
    pub brightness: f64,
    /// Multiplied about the middle grey, 0..10.
    pub contrast: f64,
    /// The exponent is 1 / gamma; above 1 lifts the dark parts. 0.1..10.
    pub gamma: f64,
    pub colour_map: ColourMap,
}

impl Default for Post {
    fn default() -> Self {
        Post {
            sigma: None,
            enhanced_sigma: None,
            brightness: 0.0,
            contrast: 1.0,
            gamma: 1.0,
            colour_map: ColourMap::None,
        }
    }
}

/// Recolours the picture's brightness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ColourMap {
    /// Colours stay.
    #[default]
    None,
    Grey,
    Sepia,
    Skin,
    Ice,
}
