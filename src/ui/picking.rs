//! Picking: where a place in space is on the picture, where the picture is in the window, and what is under a pixel of it.

use crate::scene::planes::{Tile, cell};
use crate::scene::{Layout, PlaneName, Rays, Scene};
use glam::DVec3;
use std::time::Duration;

/// How the part of the picture that is rendered is looked at. Places on the picture are in its pixels from its upper left corner.
pub(super) struct Picker<'a> {
    rays: &'a Rays,
    /// Columns and rows before the part.
    corner: [f64; 2],
    size: [f64; 2],
    /// Rays along each edge of a pixel; half a one where one goes for four pixels.
    per_pixel: f64,
}

impl<'a> Picker<'a> {
    pub fn of(scene: &'a Scene) -> Picker<'a> {
        let size = scene.picture_size();
        let corner = if scene.settings.layout == Layout::Four { size.map(|n| cell(n, 1, 2)) } else { [0, 0] };
        let ray = &scene.settings.ray;
        Picker {
            rays: &scene.rays,
            corner: corner.map(f64::from),
            size: std::array::from_fn(|a| f64::from(size[a] - corner[a])),
            per_pixel: f64::from(ray.rays) * if ray.half { 0.5 } else { 1.0 },
        }
    }

    /// Width and height of the part, pixels.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The middle of the part, which shows what the camera looks at.
    pub fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|a| self.corner[a] + self.size[a] / 2.0)
    }

    /// Origin and unit direction of the ray through a place on the picture.
    pub fn ray(&self, at: [f64; 2]) -> (DVec3, DVec3) {
        let [x, y]: [f64; 2] = std::array::from_fn(|a| (at[a] - self.corner[a]) * self.per_pixel);
        self.rays.at(x, y)
    }

    /// Where a place in space is seen; behind the camera nothing is.
    pub fn seen(&self, place: DVec3) -> Option<[f64; 2]> {
        let r = self.rays;
        let from = place - r.origin;
        let away = from.dot(r.forward);
        if r.is_perspective && away <= 0.0 {
            return None;
        }
        let (dx, dy) = (r.origin_dx + r.direction_dx * away, r.origin_dy + r.direction_dy * away);
        let across = from - r.direction * away;
        let [x, y] = [across.dot(dx) / dx.length_squared(), across.dot(dy) / dy.length_squared()];
        let at = [x / self.per_pixel + self.corner[0], y / self.per_pixel + self.corner[1]];
        at.iter().all(|v| v.is_finite()).then_some(at)
    }

    /// mm a pixel at the distance of what the camera looks at.
    pub fn pixel(&self) -> f64 {
        let away = (self.rays.target - self.rays.origin).dot(self.rays.forward);
        (self.rays.origin_dx + self.rays.direction_dx * away).length() * self.per_pixel
    }
}

/// What a place on the picture shows of a tile's plane; `pixel` is the sheet's, mm.
pub(super) fn on_tile(tile: &Tile, pixel: f64, at: [f64; 2]) -> DVec3 {
    let [x, y]: [f64; 2] = std::array::from_fn(|a| at[a] - f64::from(tile.corner[a]) - f64::from(tile.size[a]) / 2.0);
    tile.plane.at + (tile.plane.right * x + tile.plane.down * y) * pixel
}

/// How far along a straight line (a point and a unit vector) a ray passes it by most closely, mm; nothing where both are parallel.
pub(super) fn along(line: (DVec3, DVec3), ray: (DVec3, DVec3)) -> Option<f64> {
    let (apart, slant) = (line.0 - ray.0, line.1.dot(ray.1));
    let across = 1.0 - slant * slant;
    let at = (slant * ray.1.dot(apart) - line.1.dot(apart)) / across;
    (across > 1e-6 && at.is_finite()).then_some(at)
}

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
