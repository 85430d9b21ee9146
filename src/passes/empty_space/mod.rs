//! What lets rays leap: ranges of tiles and bricks, kept up to date slice by slice; what each brick is to a mode; and how far
//! the nearest brick of another kind is. Each mode's rule is exact: the picture is the same bit for bit.

pub mod brick_ranges;
pub mod classify;
pub mod distance;
pub mod tile_ranges;

use crate::passes::{Need, Slot};
use crate::scene::{Bricks, Mode, Reach, Scene, Side};
use rayon::prelude::*;

/// Kinds of bricks, as classify.comp has them.
const WANTED: u32 = 0;
const NOTHING: u32 = 1;
const KNOWN: u32 = 2;
/// Bricks that a distance goes up to; a kind has the two bits above.
const FARTHEST: u32 = 16;

/// What a ray caster leaps by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaps {
    /// It takes every sample.
    None,
    /// Kinds of bricks, and how far around they are the same.
    Kinds(Slot),
    /// What the largest sample so far is compared with.
    Ranges,
}

impl Leaps {
    /// The 3D texture that shaders name "bricks".
    pub fn slot(self) -> Option<Slot> {
        match self {
            Leaps::None => None,
            Leaps::Kinds(slot) => Some(slot),
            Leaps::Ranges => Some(Slot::BrickRanges),
        }
    }

    /// SKIP of skip.glsl.
    pub fn constant(self) -> (&'static str, i32) {
        let value = match self {
            Leaps::None => 0,
            Leaps::Kinds(_) => 1,
            Leaps::Ranges => 2,
        };
        ("SKIP", value)
    }
}

pub fn surface_leaps(scene: &Scene) -> Leaps {
    if scene.skips() { Leaps::Kinds(Slot::SurfaceLeaps) } else { Leaps::None }
}

pub fn volume_leaps(scene: &Scene) -> Leaps {
    match scene.settings.mode {
        _ if !scene.skips() => Leaps::None,
        Mode::Mip | Mode::MinIp => Leaps::Ranges,
        _ => Leaps::Kinds(Slot::VolumeLeaps),
    }
}

fn asked(scene: &Scene) -> Need {
    match scene.skips() {
        true => Ok("rays leap over bricks that cannot change the picture"),
        false => Err("no ray leaps: none is cast, or every sample is asked for"),
    }
}

/// What each brick looks at, x fastest.
fn reaches(scene: &Scene, bricks: &Bricks) -> Vec<Reach> {
    let [width, height, _] = bricks.count.map(u64::from);
    let cell = |n: u64| [n % width, n / width % height, n / (width * height)].map(|n| n as u32);
    (0..bricks.total()).into_par_iter().map(|n| scene.reach(bricks, cell(n))).collect()
}

fn side_code(side: Side) -> u32 {
    match side {
        Side::Outside => 0,
        Side::Across => 1,
        Side::Inside => 2,
    }
}

/// The table of bricks: tile columns, tile rows and slices (first * 4096 + last, exact in f32), and the side.
pub fn table(scene: &Scene) -> Vec<f32> {
    let packed = |[first, last]: [u32; 2]| (first * 4096 + last) as f32;
    let entry = |reach: &Reach| {
        let [columns, rows] = reach.tiles;
        // Bricks outside look at nothing, and are written whatever slice is new.
        let slices = if reach.side == Side::Outside { [0, 4095] } else { reach.slices };
        [packed(columns), packed(rows), packed(slices), side_code(reach.side) as f32]
    };
    reaches(scene, &scene.bricks()).iter().flat_map(entry).collect()
}
