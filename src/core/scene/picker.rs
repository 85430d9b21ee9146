//! The projection of the rendered part of a picture: from points in space to pixels, and from pixels to rays.

use super::{Rays, Scene};
use glam::DVec3;

/// Converts between positions on the picture, the rays of its rendered part, and points in space, mm. Positions are in pixels from the picture's upper
/// left corner; the centre of the first pixel is at (0.5, 0.5).
pub struct Picker<'a> {
    rays: &'a Rays,
    /// Columns and rows of the picture before the rendered part; in a pair, the surface.
    corner: [f64; 2],
    size: [f64; 2],
    /// Rays along each edge of a pixel; 0.5 at half resolution.
    rays_per_pixel: f64,
}

impl<'a> Picker<'a> {
    pub fn of(scene: &'a Scene) -> Picker<'a> {
        let area = scene.rendering_area();
        let ray = &scene.settings.ray;
        Picker {
            rays: &scene.rays,
            corner: area.corner.map(f64::from),
            size: area.size.map(f64::from),
            rays_per_pixel: f64::from(ray.rays) / f64::from(ray.subsampling),
        }
    }

    /// Upper left corner of the rendered part in the picture, pixels; in a pair, of the part with the surface.
    pub fn corner(&self) -> [f64; 2] {
        self.corner
    }

    /// Width and height of the rendered part, pixels.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// The centre of the rendered part, pixels; the camera's target is there.
    pub fn centre(&self) -> [f64; 2] {
        std::array::from_fn(|a| self.corner[a] + self.size[a] / 2.0)
    }

    /// Origin and unit direction of the ray through a position on the picture.
    pub fn ray(&self, at: [f64; 2]) -> (DVec3, DVec3) {
        let [x, y] = self.in_rays(at);
        self.rays.at(x, y)
    }

    /// Origin and unit direction of the ray with this column and row among the rays.
    pub fn ray_at(&self, [x, y]: [usize; 2]) -> (DVec3, DVec3) {
        self.rays.at(x as f64 + 0.5, y as f64 + 0.5)
    }

    /// A position on the picture in rays from the first.
    fn in_rays(&self, at: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|a| (at[a] - self.corner[a]) * self.rays_per_pixel)
    }

    /// Column and row of the ray nearest to a position on the picture, and origin and unit direction of that ray. None outside the cells of all rays,
    /// which cover the rendered part. `rays`: number of rays along each axis.
    pub fn nearest_ray(&self, at: [f64; 2], rays: [u32; 2]) -> Option<([usize; 2], (DVec3, DVec3))> {
        let place = self.in_rays(at).map(f64::floor);
        let is_in = (0..2).all(|a| place[a] >= 0.0 && place[a] < f64::from(rays[a]));
        is_in.then(|| (place.map(|n| n as usize), self.rays.at(place[0] + 0.5, place[1] + 0.5)))
    }

    /// Column and row of the upper left of the four rays around a position on the picture, and how far the position is from it towards the others,
    /// 0..1. None if one of the four does not exist. `rays`: number of rays along each axis.
    pub fn rays_around(&self, at: [f64; 2], rays: [u32; 2]) -> Option<([usize; 2], [f64; 2])> {
        let place = self.in_rays(at).map(|n| n - 0.5);
        let is_in = (0..2).all(|a| place[a] >= 0.0 && place[a] + 1.0 < f64::from(rays[a]));
        is_in.then(|| (place.map(|n| n as usize), place.map(f64::fract)))
    }

    /// Column and row of the picture's pixel that contains a ray's centre. If one ray makes several pixels, it may be the first pixel beyond the
    /// rendered part.
    pub fn pixel_of_ray(&self, ray: [usize; 2]) -> [usize; 2] {
        std::array::from_fn(|a| ((ray[a] as f64 + 0.5) / self.rays_per_pixel + self.corner[a]) as usize)
    }

    /// The position on the picture, pixels, of a point in space, mm. None behind the camera of a perspective view.
    pub fn project(&self, point: DVec3) -> Option<[f64; 2]> {
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
    pub fn mm_per_pixel(&self) -> f64 {
        let away = (self.rays.target - self.rays.origin).dot(self.rays.forward);
        (self.rays.origin_dx + self.rays.direction_dx * away).length() * self.rays_per_pixel
    }
}
