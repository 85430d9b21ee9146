//! How densely a phantom's sweep is sampled, and how far the probe blurs it.

use super::{PhantomOptions, refusal};
use crate::files::InputError;
use crate::tree::{All, Name};

/// Standard deviations of the Gaussian point-spread function of the complex field, whose magnitude is the image. 0 is no blur.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointSpread {
    /// Standard deviation along a scan line, mm, 0..=5.
    pub axial_mm: f64,
    /// Standard deviation across scan lines at the focus, degrees, 0..=10. It is larger away from the focus.
    pub lateral_deg: f64,
    /// Standard deviation across frames, degrees, 0..=10.
    pub elevation_deg: f64,
}

/// Named sets of [`PhantomOptions`]: how densely the head is scanned, how wide the beam is, and whether the fetus moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, All, Name)]
#[tree(rename_all = "lowercase")]
pub enum Sampling {
    /// As a live probe acquires in under a second: 37 frames of 128 lines.
    #[default]
    Live,
    /// A slow, dense sweep of a fetus at rest, for stills: 111 frames of 192 lines and a narrower beam.
    Gallery,
}

impl Sampling {
    /// Options for one volume of the head with this sampling.
    pub fn options(self) -> PhantomOptions {
        let live = PhantomOptions::default();
        match self {
            Sampling::Live => live,
            Sampling::Gallery => PhantomOptions {
                frames: 111,
                lines: 192,
                point_spread: PointSpread { lateral_deg: 0.6, elevation_deg: 0.6, ..live.point_spread },
                still: true,
                ..live
            },
        }
    }
}

named!(Sampling, "sampling");
