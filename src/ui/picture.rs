//! Where the picture lies in the window, and what of it is where.

use super::picking::{Picker, on_tile};
use crate::scene::{PlaneName, Scene};
use glam::DVec3;
use std::time::Duration;

/// The picture as it is in the window while something is done by hand.
#[derive(Clone, Copy)]
pub struct Picture<'a> {
    /// Its upper left corner, pixels of the window.
    pub corner: [f64; 2],
    /// Its width and height there: `picture.size`, or that enlarged.
    pub size: [f64; 2],
    /// What it shows; nothing can be grasped without it.
    pub scene: Option<&'a Scene>,
    /// The pointer is over a panel: what begins there is none of the picture's.
    pub taken: bool,
    /// Now, since any moment: clicks that follow soon are double.
    pub now: Duration,
}

/// What is at a place of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spot {
    Rendering,
    /// The n-th tile of planes.
    Plane(usize),
}

impl<'a> Picture<'a> {
    /// A place of the window in pixels of the picture.
    fn pixels(&self, scene: &Scene, at: [f64; 2]) -> Option<[f64; 2]> {
        let size = scene.picture_size().map(f64::from);
        let there: [f64; 2] = std::array::from_fn(|a| (at[a] - self.corner[a]) / self.size[a] * size[a]);
        there.iter().all(|v| v.is_finite()).then_some(there)
    }

    /// What is shown, and a place of it in pixels of the picture, wherever it lies.
    pub(super) fn place(&self, at: [f64; 2]) -> Option<(&'a Scene, [f64; 2])> {
        let scene = self.scene?;
        Some((scene, self.pixels(scene, at)?))
    }

    /// What is shown at a place of the window; nothing outside of the picture and in cells that are empty.
    pub(super) fn spot(&self, at: [f64; 2]) -> Option<Spot> {
        let (scene, pixel) = self.place(at)?;
        let lies_in = |corner: [u32; 2], size: [u32; 2]| {
            (0..2).all(|a| pixel[a] >= f64::from(corner[a]) && pixel[a] < f64::from(corner[a] + size[a]))
        };
        if !lies_in([0, 0], scene.picture_size()) {
            return None;
        }
        if scene.cuts_planes() {
            let tile = scene.sheet().tiles.iter().position(|tile| lies_in(tile.corner, tile.size));
            if let Some(n) = tile {
                return Some(Spot::Plane(n));
            }
        }
        (!scene.is_flat()).then_some(Spot::Rendering)
    }

    /// The place in space that a tile of planes shows there, and mm a pixel of the picture.
    pub(super) fn on_plane(&self, tile: usize, at: [f64; 2]) -> Option<(DVec3, f64)> {
        let (scene, pixel) = self.place(at)?;
        let sheet = scene.sheet();
        Some((on_tile(sheet.tiles.get(tile)?, sheet.pixel, pixel), sheet.pixel))
    }

    /// Pixels of the picture for one of the window.
    pub(super) fn scale(&self) -> f64 {
        let scale = self.scene.map_or(1.0, |scene| f64::from(scene.picture_size()[1]) / self.size[1]);
        if scale.is_finite() { scale } else { 0.0 }
    }

    /// Height in the window of what lies at a spot.
    pub(super) fn height(&self, spot: Spot) -> f64 {
        let scale = self.scale();
        let pixels = match (self.scene, spot) {
            (Some(scene), Spot::Rendering) => Picker::of(scene).size()[1],
            (Some(scene), Spot::Plane(n)) => scene.sheet().tiles.get(n).map_or(1.0, |tile| f64::from(tile.size[1])),
            (None, _) => 1.0,
        };
        if scale > 0.0 { pixels.max(1.0) / scale } else { f64::INFINITY }
    }

    /// The middle of the rendering in the window.
    pub(super) fn middle(&self) -> [f64; 2] {
        let (scale, middle) = (self.scale(), self.scene.map_or([0.0; 2], |scene| Picker::of(scene).middle()));
        std::array::from_fn(|a| self.corner[a] + if scale > 0.0 { middle[a] / scale } else { 0.0 })
    }

    /// The plane of a tile, where tiles show different ones.
    pub(super) fn name(&self, tile: usize) -> Option<PlaneName> {
        let shows_three = self.scene.is_some_and(Scene::shows_three);
        [PlaneName::A, PlaneName::B, PlaneName::C].get(tile).copied().filter(|_| shows_three)
    }
}
