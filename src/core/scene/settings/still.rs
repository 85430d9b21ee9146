//! Settings of stills: volume rendering by paths of light.

use crate::scene::number::Allowed::Range;
use crate::scene::number::{Number, SHARE, number};
use crate::tree::{Defaults, FromNode, ToNode};

/// A still: mode volume by paths of light that collide many times, without a denoiser. The transfer function describes the medium: its opacities give the
/// extinction, and its colours are those that a half-space of the medium has under even light. The key light is `light.diffuse` in `light.direction`, and
/// light comes from all around with the radiance `light.ambient`. Back light, exposure and ground are those of `light.volume`; without it there is no back
/// light and no ground, and the exposure is 1. Specular light, cut faces of clip planes and early ray termination do not apply.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Still {
    /// Paths of a pixel. The standard error of the picture falls with the square root of their number.
    #[value(64)]
    pub samples: u32,
    /// Seed of the random numbers. The same seed and number of samples give the same picture.
    pub seed: u32,
    /// Factor of the extinction, 0..=100.
    #[value(1.0)]
    pub extinction: f64,
    /// Factor of the albedo.
    #[value(1.0)]
    pub albedo: f64,
    /// Anisotropy, -0.95..=0.95: the mean cosine of Henyey and Greenstein's phase function; 0 scatters evenly.
    pub anisotropy: f64,
    /// Most collisions of a path; what light would do after them is missing.
    #[value(128)]
    pub events: u32,
    /// Paths of a pixel in each dispatch; more where all of them would take over 64 dispatches. The value changes no bit of the picture.
    #[value(4)]
    pub batch: u32,
}

impl Still {
    /// Largest number of samples (paths) of a pixel: their sums are 32-bit floats.
    pub const MAX_SAMPLES: u32 = 65536;
    /// Most dispatches of a picture: the parameters of so many fit into a command buffer's (64 KiB), where each begins at a multiple of 256 bytes.
    const MAX_DISPATCHES: u32 = 64;

    /// Number of samples (paths) of a pixel in each dispatch but the last.
    pub(crate) fn samples_at_once(&self) -> u32 {
        self.batch.max(self.samples.div_ceil(Still::MAX_DISPATCHES))
    }

    /// Number of dispatches that trace the paths of a picture.
    pub fn dispatches(&self) -> u32 {
        self.samples.div_ceil(self.samples_at_once())
    }
}

pub(super) const NUMBERS: &[Number] = &[
    number!(still => samples, "", Range(1.0, Still::MAX_SAMPLES as f64)),
    number!(still => extinction, "", Range(0.0, 100.0)),
    number!(still => albedo, "", SHARE),
    number!(still => anisotropy, "", Range(-0.95, 0.95)),
    number!(still => events, "", Range(1.0, 1024.0)),
    number!(still => batch, "", Range(1.0, 64.0)),
];
