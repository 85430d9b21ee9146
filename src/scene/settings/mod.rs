//! What a user may ask of a picture: the TOML scene file, its presets and defaults. Lengths in mm, angles in degrees,
//! samples and opacities in 0..1. Every struct refuses unknown keys, so that a typing error is not silently a default.

mod conditioning;
mod modes;
mod planes;
mod post;
mod rays;
mod shade;
mod slices;

pub use conditioning::*;
pub use modes::*;
pub use planes::*;
pub use post::*;
pub use rays::*;
pub use shade::*;
pub use slices::*;

use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    pub mode: Mode,
    pub layout: Layout,
    pub picture: Picture,
    pub conditioning: Conditioning,
    pub slices: Slices,
    pub region: Region,
    /// Planes that cut away what lies on the side that their normal points to; at most 4.
    pub clip: Vec<Clip>,
    pub camera: Camera,
    pub ray: Ray,
    pub volume: Volume,
    pub surface: Surface,
    pub projection: Projection,
    pub planes: Planes,
    pub cube: Cube,
    pub distance: Distance,
    pub light: Light,
    pub post: Post,
}

impl Settings {
    /// What is shown while the view moves: a quarter of the rays at most. Stage 1 stays as it is.
    pub fn moving(&self) -> Settings {
        Settings { ray: Ray { half: true, rays: 1, ..self.ray.clone() }, ..self.clone() }
    }
}

/// What a pixel holds.
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
    /// VR in front of SR: what lies before the surface is a veil over it.
    Mixed,
    /// Largest sample on the ray.
    Mip,
    /// Smallest sample on the ray, within the insonified region.
    #[serde(alias = "minip")]
    MinIp,
    /// Mean of the samples on the ray within the insonified region: an X-ray.
    #[serde(alias = "xray")]
    Mean,
    /// MPR: one free plane through the volume.
    #[serde(alias = "mpr")]
    Plane,
    /// Three orthogonal planes with cross-lines.
    Orthogonal,
    /// Parallel planes side by side.
    Tomography,
    /// The volume as a solid block, seen from outside; each face can be pushed in and tilted.
    Cube,
}

impl Mode {
    /// Cuts planes and casts no ray.
    pub fn is_flat(self) -> bool {
        matches!(self, Mode::Plane | Mode::Orthogonal | Mode::Tomography)
    }
}

/// How the picture is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    #[default]
    Single,
    /// 4-up: the three orthogonal planes, and what the mode renders.
    #[serde(alias = "4up", alias = "4-up")]
    Four,
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

/// The box that is rendered, mm: lateral from the middle, depth from the probe's face, elevation from the middle frame
/// (Cartesian volumes: along their own axes). Absent: all there is.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Region {
    pub lateral: Option<[f64; 2]>,
    pub depth: Option<[f64; 2]>,
    pub elevation: Option<[f64; 2]>,
}

/// Cuts away the side of a plane that its normal points to. Place and normal as lateral, depth (from the probe's face),
/// elevation.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Clip {
    /// A point of the plane, mm.
    pub at: [f64; 3],
    /// Of any length but 0.
    pub normal: [f64; 3],
}
