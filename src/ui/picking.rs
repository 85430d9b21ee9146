//! Picking: finds what is under a pixel of the window.

pub(super) use crate::scene::picker::Picker;

use crate::measure::{body_marks, overlay};
use crate::scene::{BodyMark, MeasureKind, Measurement, PlaneName, Scene};
use glam::DVec3;
use std::time::Duration;

/// Position along a straight line (a point and a unit vector) at which a ray comes closest to it, mm from the point; None if both are parallel.
pub(super) fn closest_along(line: (DVec3, DVec3), ray: (DVec3, DVec3)) -> Option<f64> {
    let (apart, slant) = (line.0 - ray.0, line.1.dot(ray.1));
    let across = 1.0 - slant * slant;
    let at = (slant * ray.1.dot(apart) - line.1.dot(apart)) / across;
    (across > 1e-6 && at.is_finite()).then_some(at)
}

/// The nearest of things with their distances, if it is within `reach`.
pub(super) fn nearest<T>(things: impl Iterator<Item = (f64, T)>, reach: f64) -> Option<T> {
    let near = things.filter(|(away, _)| *away <= reach);
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, thing)| thing)
}

/// Where the picture is in the window at the time of an input, and what it shows.
#[derive(Clone, Copy)]
pub(super) struct Viewport<'a> {
    /// Upper left corner of the picture, pixels of the window.
    pub(super) corner: [f64; 2],
    /// Width and height of the picture in the window, pixels of the window: its own size or an enlargement of it.
    pub(super) size: [f64; 2],
    /// The scene of the picture. Without one nothing can be dragged.
    pub(super) scene: Option<&'a Scene>,
    /// Number of the volume that the picture shows; None if not known.
    pub(super) volume: Option<u32>,
    /// The measurements that are drawn over the picture.
    pub(super) measures: &'a [Measurement],
    /// The body marks that are drawn over the picture.
    pub(super) body_marks: &'a [BodyMark],
    /// The points of the region's start curve: lateral and depth, mm; empty while it is straight.
    pub(super) start_line: &'a [[f64; 2]],
    /// True if the points of a measurement or of a curved plane's line are being set.
    pub(super) has_work: bool,
    /// True if a panel covers the pointer, so that a press does not reach the picture.
    pub(super) is_covered: bool,
    /// Time of the input since any fixed moment, by which a double click is recognised.
    pub(super) now: Duration,
}

/// A part of the picture: the rendering, or a tile with a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pane {
    Rendering,
    /// The tile of planes with this index.
    Plane(usize),
}

impl<'a> Viewport<'a> {
    /// The scene, and the pixel of the picture at a position in the window; it may be outside of the picture. None without a scene.
    pub(super) fn pixel_at(&self, at: [f64; 2]) -> Option<(&'a Scene, [f64; 2])> {
        let scene = self.scene?;
        let size = scene.picture_size().map(f64::from);
        let pixel: [f64; 2] = std::array::from_fn(|a| (at[a] - self.corner[a]) / self.size[a] * size[a]);
        pixel.iter().all(|v| v.is_finite()).then_some((scene, pixel))
    }

    /// For a position (pixels of the window) on the volume of a pair, the distance to the surface on the same rays, columns of the picture;
    /// elsewhere 0. Both halves show the same rays, so that a press on the volume acts as one on the surface.
    pub(super) fn columns_to_surface(&self, at: [f64; 2]) -> f64 {
        match self.pixel_at(at) {
            Some((scene, [x, _])) if scene.is_pair() && x < Picker::of(scene).corner()[0] => {
                Picker::of(scene).corner()[0]
            }
            _ => 0.0,
        }
    }

    /// The pane at a position (pixels of the window); None outside of the picture and in empty tiles.
    pub(super) fn pane_at(&self, at: [f64; 2]) -> Option<Pane> {
        let (scene, pixel) = self.pixel_at(at)?;
        let size = scene.picture_size().map(f64::from);
        if !(0..2).all(|a| (0.0..size[a]).contains(&pixel[a])) {
            return None;
        }
        let tiles = if scene.cuts_planes() { scene.tiling().tiles } else { Vec::new() };
        let tile = tiles.iter().position(|tile| tile.has(pixel)).map(Pane::Plane);
        tile.or((!scene.is_flat()).then_some(Pane::Rendering))
    }

    /// The point in space, mm, that a tile of planes shows at a position (pixels of the window).
    pub(super) fn point_on_plane(&self, tile: usize, at: [f64; 2]) -> Option<DVec3> {
        let (scene, pixel) = self.pixel_at(at)?;
        let tiling = scene.tiling();
        Some(tiling.point(tiling.tiles.get(tile)?, pixel))
    }

    /// The index of the body mark at a position (pixels of the window), and the part of it that is there; None if there is none. `reach`:
    /// largest distance from the probe at which it is grabbed, pixels of the window.
    pub(super) fn body_mark_at(&self, at: [f64; 2], reach: f64) -> Option<(usize, body_marks::Part)> {
        let (scene, pixel) = self.pixel_at(at)?;
        body_marks::part_at(self.body_marks, scene.picture_size().map(f64::from), pixel, reach * self.scale())
    }

    /// The point of a measurement that is drawn nearest to a position on a tile of planes, within `reach` (both in pixels of the window): index
    /// of the measurement, index of its point. None if there is none.
    pub(super) fn measure_point_at(&self, tile: usize, at: [f64; 2], reach: f64) -> Option<(usize, usize)> {
        let (scene, pixel) = self.pixel_at(at)?;
        let tiling = scene.tiling();
        let corner = tiling.tiles.get(tile)?.corner.map(f64::from);
        let on_tile = overlay::drawn(scene, self.volume, self.measures).into_iter();
        let on_tile = on_tile.filter(|drawn| drawn.tile[0] == corner && !drawn.is_of_other);
        // The points of a way make one line.
        let on_tile = on_tile.filter(|drawn| self.measures[drawn.index].kind != MeasureKind::Surface);
        let points =
            on_tile.flat_map(|drawn| drawn.points.into_iter().map(move |(point, at)| (drawn.index, point, at)));
        let away = points.map(|(index, point, [x, y])| ((x - pixel[0]).hypot(y - pixel[1]), (index, point)));
        nearest(away, reach * self.scale())
    }

    /// What of the lines along which three planes cross is near a position on one of their tiles (pixels of the window). Returns the vector from
    /// there to the common point of the planes, mm, and the normal along which a drag of that line moves the point; None in its place at the
    /// centre. `reach`: largest distances from a line and from the centre, pixels of the window.
    pub(super) fn cross_at(&self, tile: usize, at: [f64; 2], reach: [f64; 2]) -> Option<(DVec3, Option<DVec3>)> {
        let (scene, pixel) = self.pixel_at(at)?;
        let tiling = scene.tiling();
        let shown = tiling.tiles.get(tile).filter(|_| scene.shows_three() && scene.draws_lines())?;
        if shown.section.is_some() {
            return None;
        }
        let way = scene.plane(PlaneName::A).at - tiling.point(shown, pixel);
        let others = tiling
            .tiles
            .iter()
            .enumerate()
            .filter(|(n, other)| *n != tile && other.section.is_none())
            .map(|(_, other)| other.plane.normal);
        let away: Vec<(DVec3, f64)> = others.map(|normal| (normal, way.dot(normal).abs() / tiling.pixel)).collect();
        let [of_line, of_centre] = reach.map(|reach| reach * self.scale());
        if away.iter().all(|(_, pixels)| *pixels <= of_centre) {
            return Some((way, None));
        }
        let nearest = away.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        (nearest.1 <= of_line).then_some((way, Some(nearest.0)))
    }

    /// Pixels of the picture for one pixel of the window.
    pub(super) fn scale(&self) -> f64 {
        let scale = self.scene.map_or(1.0, |scene| f64::from(scene.picture_size()[1]) / self.size[1]);
        if scale.is_finite() { scale } else { 0.0 }
    }

    /// Height of a pane, pixels of the window.
    pub(super) fn pane_height(&self, pane: Pane) -> f64 {
        let scale = self.scale();
        let pixels = match (self.scene, pane) {
            (Some(scene), Pane::Rendering) => Picker::of(scene).size()[1],
            (Some(scene), Pane::Plane(n)) => scene.tiling().tiles.get(n).map_or(1.0, |tile| f64::from(tile.size[1])),
            (None, _) => 1.0,
        };
        if scale > 0.0 { pixels.max(1.0) / scale } else { f64::INFINITY }
    }

    /// The centre of the rendering, pixels of the window; in a pair, that of the half in which the position `at` is.
    pub(super) fn rendering_centre(&self, at: [f64; 2]) -> [f64; 2] {
        let (scale, mut centre) = (self.scale(), self.scene.map_or([0.0; 2], |scene| Picker::of(scene).centre()));
        centre[0] -= self.columns_to_surface(at);
        std::array::from_fn(|a| self.corner[a] + if scale > 0.0 { centre[a] / scale } else { 0.0 })
    }

    /// The middle of the selected plane's tile or, if no plane is shown, of the rendering, pixels of the window. None without a scene.
    pub(super) fn middle(&self) -> Option<[f64; 2]> {
        let (scene, scale) = (self.scene?, self.scale());
        if !scene.cuts_planes() || scale <= 0.0 {
            return Some(self.rendering_centre(self.corner));
        }
        let tiles = scene.tiling().tiles;
        let selected = (0..tiles.len()).find(|n| scene.plane_of_tile(*n) == Some(scene.settings.planes.plane));
        let tile = tiles.get(selected.unwrap_or(0))?;
        let middle = |a: usize| f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0;
        Some(std::array::from_fn(|a| self.corner[a] + middle(a) / scale))
    }

    /// The plane that a tile shows, if the tiles show different planes; for a curved plane the one on which its line lies.
    pub(super) fn plane_name(&self, tile: usize) -> Option<PlaneName> {
        let scene = self.scene.filter(|scene| scene.shows_three())?;
        scene.plane_of_tile(tile).or(scene.curve().map(|curve| curve.plane))
    }

    /// True if a tile shows a curved plane.
    pub(super) fn is_curved(&self, tile: usize) -> bool {
        self.scene.is_some_and(|scene| scene.tiling().tiles.get(tile).is_some_and(|tile| tile.section.is_some()))
    }

    /// The plane that a tile shows, and the coordinates on it, mm, of a position (pixels of the window). None if it shows none of the three
    /// planes.
    pub(super) fn coordinates(&self, tile: usize, at: [f64; 2]) -> Option<(PlaneName, [f64; 2])> {
        let (scene, place) = (self.scene?, self.point_on_plane(tile, at)?);
        let name = scene.plane_of_tile(tile)?;
        Some((name, scene.point_on_plane(name, place)))
    }

    /// The index of the point of the curved plane's line that is drawn nearest to a position on a tile, within `reach` (both in pixels of the
    /// window). None if there is none.
    pub(super) fn curve_point_at(&self, tile: usize, at: [f64; 2], reach: f64) -> Option<usize> {
        let (scene, pixel) = self.pixel_at(at)?;
        let line = scene.curve_line(&scene.tiling()).filter(|line| line.tile == tile)?;
        let away = line.points.iter().map(|[x, y]| (x - pixel[0]).hypot(y - pixel[1]));
        nearest(away.zip(0..), reach * self.scale())
    }
}
