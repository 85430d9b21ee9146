//! Settings of stage 2 that every mode shares: the camera and its rays.

use serde::{Deserialize, Serialize};

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
    /// Looked at: lateral, depth, elevation in mm as in [`Region`](super::Region). Absent: the middle of the region.
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
    /// How far steps grow with the range, as the samples of a convex sweep spread apart: 0 even steps, 1 in proportion to the
    /// range (twice as far from the array's apex twice as long, at most 8 times). Curved arrays only.
    pub spread: f64,
    /// The 3D filter of the thesis (4.3): a Gaussian of 3 or 5 samples along each edge about every sample, made while the ray
    /// is cast; 0 for none.
    pub sliding: u32,
    /// Entries of the sweep and line look-up tables, 2..=65536. The half tangent is smooth: linear interpolation between 1025 is
    /// off by h^2/8 times its second derivative, under 1e-6 slices for a sweep of 142 frames over 85 deg.
    pub entries: u32,
    /// Rays for each pixel along each edge, 1..=4: the picture is rendered larger and averaged.
    pub rays: u32,
    /// Edge of the bricks that rays leap over where nothing in them can change the picture, texels: 4..=64, 0 takes every
    /// sample. The picture is the same bit for bit.
    pub brick: u32,
    /// One ray for four pixels, and the picture enlarged between rays: for a view while it moves. Windows of the distance map's
    /// filters span as much of the picture as before, in half as many rays. `rays` must be 1.
    pub half: bool,
}

impl Default for Ray {
    fn default() -> Self {
        Ray {
            step: None,
            early_end: 1.0 / 512.0,
            sampling: Sampling::Auto,
            spread: 0.0,
            sliding: 0,
            entries: 1025,
            rays: 1,
            brick: 8,
            half: false,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Sampling {
    /// Whichever the device takes faster: a GPU filters in hardware, a CPU loads texels sooner than it works through a sampler, and
    /// quads soonest, where a picture takes six samples for each or `slices.still`, and no more than 2^27 of them are needed.
    #[default]
    Auto,
    /// The device's own trilinear filter; its weights may have no more than 8 bits.
    Hardware,
    /// Eight texels and our own interpolation in f32.
    Exact,
    /// The same from two texels that hold four neighbours each, where the volume is stored in 8 or 16 bits: four times its memory
    /// more, and one more pass over every new slice.
    Quads,
}

impl Sampling {
    /// For `--explain` and profiles.
    pub fn words(self) -> &'static str {
        match self {
            Sampling::Auto => "as the device takes them fastest",
            Sampling::Hardware => "by the device's trilinear filter",
            Sampling::Exact => "eight texels each, interpolated in f32",
            Sampling::Quads => "two texels of four neighbours each, interpolated in f32",
        }
    }
}
