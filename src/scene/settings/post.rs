//! Settings of stage 4.

use super::slices::{EnhancedSigma, PeronaMalik, Sigma};
use serde::{Deserialize, Serialize};

/// Stage 4.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Post {
    pub sigma: Option<Sigma>,
    pub enhanced_sigma: Option<EnhancedSigma>,
    pub perona_malik: Option<PeronaMalik>,
    /// Added, -1..1.
    pub brightness: f64,
    /// Multiplied about the middle grey, 0..10.
    pub contrast: f64,
    /// The exponent is 1 / gamma; above 1 lifts the dark parts. 0.1..10.
    pub gamma: f64,
    pub colour_map: ColourMap,
    /// Keep the picture in floats beside that in 8 bits also where nothing needs it: planes are then cut first and toned after.
    pub floats: bool,
}

impl Default for Post {
    fn default() -> Self {
        Post {
            sigma: None,
            enhanced_sigma: None,
            perona_malik: None,
            brightness: 0.0,
            contrast: 1.0,
            gamma: 1.0,
            colour_map: ColourMap::None,
            floats: false,
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
