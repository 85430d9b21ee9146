//! Picking: projects points of space onto the picture and finds what is under a pixel of the window.

use crate::scene::planes::{Tile, cell};
use crate::scene::{Layout, PlaneName, Rays, Scene};
use glam::DVec3;
use std::time::Duration;

/// The projection of the rendered part of the picture. Positions are in pixels of the picture from its upper left corner.
pub(super) struct Picker<'a> {
    rays: &'a Rays,
    /// Columns and rows of the picture before the rendered part; in a pair, the surface.
    corner: [f64; 2],
    size: [f64; 2],
    /// Rays along each edge of a pixel; 0.5 at half resolution.
    rays_per_pixel: f64,
}

impl<'a> Picker<'a> {
    pub(super) fn of(scene: &'a Scene) -> Picker<'a> {
        let size = scene.picture_size();
        let corner = match scene.settings.layout {
            Layout::Single => [0, 0],
            Layout::Four => size.map(|n| cell(n, 1, 2)),
            Layout::Pair => [cell(size[0], 1, 2), 0],
        };
        let ray = &scene.settings.ray;
        Picker {
            rays: &scene.rays,
            corner: corner.map(f64::from),
            size: std::array::from_fn(|a| f64::from(size[a] - corner[a])),
            rays_per_pixel: f64::from(ray.rays) / f64::from(ray.apart()),
        }
    }

    /// Width and height of the rendered part, pixels.
    pub(super) fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The centre of the rendered part, where the camera's target is.
    pub(super) fn centre(&self) -> [f64; 2] {
        std::array::from_fn(|a| self.corner[a] + self.size[a] / 2.0)
    }

    /// Origin and unit direction of the ray through a position on the picture.
    pub(super) fn ray(&self, at: [f64; 2]) -> (DVec3, DVec3) {
        let [x, y]: [f64; 2] = std::array::from_fn(|a| (at[a] - self.corner[a]) * self.rays_per_pixel);
        self.rays.at(x, y)
    }

    /// The position on the picture of a point in space; none behind the camera.
    pub(super) fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let r = self.rays;
        let from = point - r.origin;
        let away = from.dot(r.forward);
        if r.is_perspective && away <= 0.0 {
            return None;
        }
        let (dx, dy) = (r.origin_dx + r.direction_dx * away, r.origin_dy + r.direction_dy * away);
        let across = from - r.direction * away;
        let [x, y] = [across.dot(dx) / dx.length_squared(), across.dot(dy) / dy.length_squared()];
        let at = [x / self.rays_per_pixel + self.corner[0], y / self.rays_per_pixel + self.corner[1]];
        at.iter().all(|v| v.is_finite()).then_some(at)
    }

    /// Size of a pixel at the distance of the camera's target, mm.
    pub(super) fn mm_per_pixel(&self) -> f64 {
        let away = (self.rays.target - self.rays.origin).dot(self.rays.forward);
        (self.rays.origin_dx + self.rays.direction_dx * away).length() * self.rays_per_pixel
    }
}

/// The point of a tile's plane that a position on the picture shows. `pixel`: size of a pixel of the sheet, mm.
fn point_on_tile(tile: &Tile, pixel: f64, at: [f64; 2]) -> DVec3 {
    let [x, y]: [f64; 2] = std::array::from_fn(|a| at[a] - f64::from(tile.corner[a]) - f64::from(tile.size[a]) / 2.0);
    tile.plane.at + (tile.plane.right * x + tile.plane.down * y) * pixel
}

/// Where along a straight line (a point and a unit vector) a ray comes closest to it, mm; none if both are parallel.
pub(super) fn closest_along(line: (DVec3, DVec3), ray: (DVec3, DVec3)) -> Option<f64> {
    let (apart, slant) = (line.0 - ray.0, line.1.dot(ray.1));
    let across = 1.0 - slant * slant;
    let at = (slant * ray.1.dot(apart) - line.1.dot(apart)) / across;
    (across > 1e-6 && at.is_finite()).then_some(at)
}

/// The picture in the window at the time of an input.
#[derive(Clone, Copy)]
pub(super) struct Viewport<'a> {
    /// Its upper left corner, pixels of the window.
    pub(super) corner: [f64; 2],
    /// Its width and height, pixels of the window: `picture.size`, or that enlarged.
    pub(super) size: [f64; 2],
    /// The scene that it shows; without one nothing can be dragged.
    pub(super) scene: Option<&'a Scene>,
    /// The pointer is over a panel: a press there does not reach the picture.
    pub(super) is_covered: bool,
    /// The current time, since any fixed moment; it distinguishes a double click from two clicks.
    pub(super) now: Duration,
}

/// A pane of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pane {
    Rendering,
    /// The n-th tile of the planes.
    Plane(usize),
}

impl<'a> Viewport<'a> {
    /// Converts a position in the window to pixels of the picture.
    fn pixel_of(&self, scene: &Scene, at: [f64; 2]) -> Option<[f64; 2]> {
        let size = scene.picture_size().map(f64::from);
        let pixel: [f64; 2] = std::array::from_fn(|a| (at[a] - self.corner[a]) / self.size[a] * size[a]);
        pixel.iter().all(|v| v.is_finite()).then_some(pixel)
    }

    /// The scene, and a position in the window as pixels of the picture; it may be outside of the picture.
    pub(super) fn pixel_at(&self, at: [f64; 2]) -> Option<(&'a Scene, [f64; 2])> {
        let scene = self.scene?;
        Some((scene, self.pixel_of(scene, at)?))
    }

    /// Columns of the picture from the volume of a pair to the surface on the same rays, where a position is on the volume; 0 elsewhere.
    /// Both halves show the same rays: what is pressed on the volume acts as if it were pressed on the surface.
    pub(super) fn columns_to_surface(&self, at: [f64; 2]) -> f64 {
        match self.pixel_at(at) {
            Some((scene, [x, _])) if scene.is_pair() && x < Picker::of(scene).corner[0] => Picker::of(scene).corner[0],
            _ => 0.0,
        }
    }

    /// The pane at a position in the window; none outside of the picture and in empty cells.
    pub(super) fn pane_at(&self, at: [f64; 2]) -> Option<Pane> {
        let (scene, pixel) = self.pixel_at(at)?;
        let is_in = |corner: [u32; 2], size: [u32; 2]| {
            (0..2).all(|a| pixel[a] >= f64::from(corner[a]) && pixel[a] < f64::from(corner[a] + size[a]))
        };
        if !is_in([0, 0], scene.picture_size()) {
            return None;
        }
        if scene.cuts_planes() {
            let tile = scene.sheet().tiles.iter().position(|tile| is_in(tile.corner, tile.size));
            if let Some(n) = tile {
                return Some(Pane::Plane(n));
            }
        }
        (!scene.is_flat()).then_some(Pane::Rendering)
    }

    /// The point in space that a tile of planes shows at a position in the window.
    pub(super) fn point_on_plane(&self, tile: usize, at: [f64; 2]) -> Option<DVec3> {
        let (scene, pixel) = self.pixel_at(at)?;
        let sheet = scene.sheet();
        Some(point_on_tile(sheet.tiles.get(tile)?, sheet.pixel, pixel))
    }

    /// Pixels of the picture per pixel of the window.
    pub(super) fn scale(&self) -> f64 {
        let scale = self.scene.map_or(1.0, |scene| f64::from(scene.picture_size()[1]) / self.size[1]);
        if scale.is_finite() { scale } else { 0.0 }
    }

    /// Height of a pane, pixels of the window.
    pub(super) fn pane_height(&self, pane: Pane) -> f64 {
        let scale = self.scale();
        let pixels = match (self.scene, pane) {
            (Some(scene), Pane::Rendering) => Picker::of(scene).size()[1],
            (Some(scene), Pane::Plane(n)) => scene.sheet().tiles.get(n).map_or(1.0, |tile| f64::from(tile.size[1])),
            (None, _) => 1.0,
        };
        if scale > 0.0 { pixels.max(1.0) / scale } else { f64::INFINITY }
    }

    /// The centre of the rendered part, pixels of the window; in a pair, of the half at this position.
    pub(super) fn rendering_centre(&self, at: [f64; 2]) -> [f64; 2] {
        let (scale, mut centre) = (self.scale(), self.scene.map_or([0.0; 2], |scene| Picker::of(scene).centre()));
        centre[0] -= self.columns_to_surface(at);
        std::array::from_fn(|a| self.corner[a] + if scale > 0.0 { centre[a] / scale } else { 0.0 })
    }

    /// The plane of a tile, if the tiles show different planes.
    pub(super) fn plane_name(&self, tile: usize) -> Option<PlaneName> {
        let shows_three = self.scene.is_some_and(Scene::shows_three);
        [PlaneName::A, PlaneName::B, PlaneName::C].get(tile).copied().filter(|_| shows_three)
    }
}
