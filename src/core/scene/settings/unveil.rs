//! Settings of unveiling: the render start that follows the fluid.

use crate::scene::Settings;
use crate::scene::number::Allowed::{Any, Range};
use crate::scene::number::{Group, Number, number};
use crate::tree::{Defaults, FromNode, ToNode};

/// Automatic render start: what lies in front of the fluid before a face, such as the uterine wall, is not rendered. In each volume the start surface
/// is the near face of the pocket of fluid, within the region. Planes and the block of mode cube show everything; planes beside a rendering have the
/// surface as a green line. Where no pocket can be told from the tissue around it, nothing is removed and one line says so: rendering starts at the
/// region's or the mode's start depth. Takes a second volume, the whole sector in stage 1, and time of the CPU for each volume.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Unveil {
    /// Find the fluid and start there.
    pub enabled: bool,
    /// How far behind the near face of the fluid rendering starts, mm: more removes more.
    #[value(1.0)]
    pub offset: f64,
    /// Standard deviation of the Gaussian that smooths the start surface, mm.
    #[value(2.0)]
    pub smoothing: f64,
}

fn unveils(s: &Settings) -> bool {
    s.can_unveil() && s.unveil.enabled
}

pub(super) const NUMBERS: &[Number] = &[
    number!(unveil.enabled, "", Any;
        Group::Image, "Auto render start", [0.0, 1.0], 1.0, Settings::can_unveil,
        "Starts rendering at the fluid before the face: the wall in front of it goes. Where no fluid is found, nothing changes."),
    number!(unveil.offset, "mm", Range(-100.0, 100.0);
        Group::Image, "Start offset", [-10.0, 30.0], 0.5, unveils, "How far behind the near face of the fluid rendering starts: more removes more."),
    number!(unveil.smoothing, "mm", Range(0.0, 20.0);
        Group::Image, "Start smoothing", [0.0, 10.0], 0.5, unveils, "Smooths the surface at which rendering starts."),
];
