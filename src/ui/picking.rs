//! Where a place in space is on the picture, and what lies under a pixel of it.

use crate::scene::planes::{Tile, cell};
use crate::scene::{Layout, Rays, Scene};
use glam::DVec3;

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
