//! Settings of the modes that cut planes out of the volume instead of casting rays through it.

use serde::{Deserialize, Serialize};

/// Modes plane, orthogonal and tomography, and the planes of a 4-up picture.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Planes {
    /// Samples are stretched from this interval to 0..1.
    pub window: [f64; 2],
}

impl Default for Planes {
    fn default() -> Self {
        Planes { window: [0.0, 1.0] }
    }
}

/// Mode cube.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cube {
    /// Samples are stretched from this interval to 0..1.
    pub window: [f64; 2],
}

impl Default for Cube {
    fn default() -> Self {
        Cube { window: [0.0, 1.0] }
    }
}
