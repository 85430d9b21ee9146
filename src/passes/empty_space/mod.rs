//! What lets rays leap: ranges of tiles and bricks, kept up to date slice by slice; what each brick is to a mode; and how far
//! the nearest brick of another kind is. Each mode's rule is exact: the picture is the same bit for bit.

pub mod brick_ranges;
pub mod classify;
pub mod distance;
pub mod tile_ranges;

use crate::passes::pass::{Need, Slot};
use crate::scene::{Mode, Scene};

/// Kinds of bricks, as classify.comp has them.
const ACTIVE: u32 = 0;
const EMPTY: u32 = 1;
const HOMOGENEOUS: u32 = 2;
/// Bricks that a distance goes up to; a kind has the two bits above.
const MAX_DISTANCE: u32 = 16;

/// How a ray caster skips empty space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skipping {
    /// It takes every sample.
    None,
    /// Kinds of bricks, and how far around they are the same.
    Kinds(Slot),
    /// What the largest sample so far is compared with.
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

    /// SKIP of skip.glsl.
    pub fn constant(self) -> (&'static str, i32) {
        let value = match self {
            Skipping::None => 0,
            Skipping::Kinds(_) => 1,
            Skipping::Ranges => 2,
        };
        ("SKIP", value)
    }
}

pub fn surface_skipping(scene: &Scene) -> Skipping {
    if scene.skips() { Skipping::Kinds(Slot::SurfaceBrickDistances) } else { Skipping::None }
}

pub fn volume_skipping(scene: &Scene) -> Skipping {
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
