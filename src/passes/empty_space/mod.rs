//! Empty-space skipping: value ranges of tiles and bricks, updated slice by slice; the kind of each brick to a mode; and the
//! distance to the nearest brick of another kind. Each mode's rule is exact: the picture is the same bit for bit.

pub mod classify;
pub mod distance;
pub mod ranges;

use crate::passes::pass::{Need, Slot};
use crate::scene::{Mode, Scene};

/// Kinds of bricks, as in classify.comp. The samples of an active brick are needed.
const ACTIVE: u32 = 0;
/// Outside the insonified region, or transparent.
const EMPTY: u32 = 1;
/// Inside, and the result of its samples is known.
const HOMOGENEOUS: u32 = 2;
/// Largest distance that is stored, bricks; the kind is in the two bits above.
const MAX_DISTANCE: u32 = 16;

/// How a ray caster skips empty space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::passes) enum Skipping {
    /// Not at all: it takes every sample.
    None,
    /// By the kinds of bricks and the distance to the nearest brick of another kind, in this slot.
    Kinds(Slot),
    /// By the value ranges of bricks, which are compared with the largest or smallest sample so far.
    Ranges,
}

impl Skipping {
    /// The 3D texture that shaders name "bricks".
    pub fn slot(self) -> Option<Slot> {
        match self {
            Skipping::None => None,
            Skipping::Kinds(slot) => Some(slot),
            Skipping::Ranges => Some(Slot::BrickRanges),
        }
    }

    /// SKIP of empty_space.glsl.
    pub fn constant(self) -> (&'static str, i32) {
        let value = match self {
            Skipping::None => 0,
            Skipping::Kinds(_) => 1,
            Skipping::Ranges => 2,
        };
        ("SKIP", value)
    }
}

/// How the surface detector skips empty space.
pub(in crate::passes) fn surface_skipping(scene: &Scene) -> Skipping {
    if scene.skips() { Skipping::Kinds(Slot::SurfaceBrickDistances) } else { Skipping::None }
}

/// How compositing and projections skip empty space.
pub(in crate::passes) fn volume_skipping(scene: &Scene) -> Skipping {
    match scene.settings.mode {
        _ if !scene.skips() => Skipping::None,
        Mode::Mip | Mode::MinIp => Skipping::Ranges,
        _ => Skipping::Kinds(Slot::VolumeBrickDistances),
    }
}

fn asked(scene: &Scene) -> Need {
    match scene.skips() {
        true => Ok("rays skip bricks that cannot change the picture"),
        false => Err("no ray skips bricks: none is cast, or every sample is asked for"),
    }
}
