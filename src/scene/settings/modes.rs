//! Settings of stage 2 by mode.

use serde::{Deserialize, Serialize};

/// Mode VR.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Volume {
    /// Samples are stretched from this interval to 0..1 before anything else.
    pub window: [f64; 2],
    /// Nothing above this depth is drawn, mm below the probe's face (Cartesian: along the depth axis).
    pub start_depth: Option<f64>,
    pub transfer: Transfer,
    /// Samples below this are transparent, 0..1 after the window.
    pub threshold: f64,
    pub compositing: Compositing,
    pub shading: Shading,
    /// Depth-coded: colours are multiplied by this where the box is nearest to the viewer ...
    pub near_tint: [f64; 3],
    /// ... and by this where it is farthest, 0..10.
    pub far_tint: [f64; 3],
    /// First hit: the opacity at which a ray has hit what is lit, 0.001..1.
    pub hit: f64,
    /// Mode mixed: how much of the composited volume is laid over the surface, 0..1.
    pub veil: f64,
}

impl Default for Volume {
    fn default() -> Self {
        Volume {
            window: [0.0, 1.0],
            start_depth: None,
            transfer: Transfer::Named(TransferName::Grey),
            threshold: 0.0,
            compositing: Compositing::Corrected,
            shading: Shading::None,
            near_tint: [1.05, 1.0, 0.9],
            far_tint: [0.3, 0.42, 0.75],
            hit: 0.3,
            veil: 1.0,
        }
    }
}

/// How samples become opacity over a step of length h; y = kappa h, kappa the absorption of the transfer function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compositing {
    /// a = y, at most 1: right for thin steps only.
    Riemann,
    /// a = 1 - exp(-y): right for any step through an even medium.
    #[default]
    Corrected,
    /// The same with the mean absorption, and the mean colour weighted by it, between the values at the step's two ends: no
    /// layer of the transfer function is stepped over (Engel, Kraus, Ertl 2001).
    PreIntegrated,
}

/// What gives a volume its depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shading {
    #[default]
    None,
    /// Colours go from a near to a far tint.
    DepthCoded,
    /// The place where each ray becomes opaque enough is lit as a surface is, by stage 3.
    FirstHit,
}

/// A named transfer function, or its points.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "must be grey, sepia, skin, bone, cool, warm, a .toml file of points, or a list of points { at, colour, opacity }"
)]
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
    /// Blue to white.
    Cool,
    /// Red to yellow.
    Warm,
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
    pub detector: Detector,
    /// Of the adaptive and the lasting detector: standard deviations of the noise before it that an edge must exceed to be
    /// a surface at once, 0..=10.
    pub noise: f64,
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
            detector: Detector::Threshold,
            noise: 2.5,
            threshold: 0.1,
            rough_threshold: None,
            rough: 2,
            sign: Sign::Bright,
            place: Place::Peak,
            number: 1,
        }
    }
}

/// What makes an edge a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Detector {
    /// The difference exceeds the threshold: the thesis' own.
    #[default]
    Threshold,
    /// It also stands out from the noise before it. A ray without such an edge takes its tallest one above the threshold, if
    /// the echo behind that lasts.
    Adaptive,
    /// Adaptive, and edges whose echo is gone half a ring behind them (specks in the fluid, thin shells before a wall) are
    /// passed over unless the ray has nothing better.
    Lasting,
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

/// Modes MIP, MinIP and mean.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Projection {
    /// Samples are stretched from this interval to 0..1 before anything else.
    pub window: [f64; 2],
    /// Nothing above this depth is drawn, mm below the probe's face.
    pub start_depth: Option<f64>,
}

impl Default for Projection {
    fn default() -> Self {
        Projection { window: [0.0, 1.0], start_depth: None }
    }
}
