//! The rendered surface, by its distance map.

use super::Console;
use crate::mesh::sheet::STEEPEST;
use crate::passes::{Texels, chain};
use crate::scene::Scene;
use crate::scene::picker::Picker;
use crate::texts;
use glam::DVec3;

/// Distances along a ray from here on mean that it met no surface, mm.
const MISSED: f64 = 1e30;
/// Distance between the points of a path along the surface, mm: less would follow the noise of the surface.
const PATH_STEP: f64 = 1.0;
/// Most points of such a path.
const PATH_POINTS: usize = 256;
/// The points of the rendered surface, from its distance map.
pub(super) struct SurfaceMap<'a> {
    pub(super) picker: Picker<'a>,
    size: [u32; 2],
    distances: &'a Texels,
}

impl Console {
    /// The scene of the picture, and the distances of its surface. `no_surface`: what is said where it has none.
    ///
    /// # Errors
    /// One line: there is no picture, it has no surface, or the device fails.
    pub(super) fn drawn_surface(&mut self, no_surface: &str) -> Result<(Scene, Texels), String> {
        let renderer = self.stream.renderer().filter(|r| r.has_drawn()).ok_or(texts::NO_PICTURE_TO_USE)?;
        let scene = renderer.scene().clone();
        let slot = scene.has_distance().then(|| chain::distance_end(&scene)).ok_or(no_surface)?;
        Ok((scene, renderer.read(slot).map_err(|e| e.to_string())?.ok_or(no_surface)?))
    }
}

impl<'a> SurfaceMap<'a> {
    pub(super) fn of(scene: &'a Scene, distances: &'a Texels) -> SurfaceMap<'a> {
        SurfaceMap { picker: Picker::of(scene), size: scene.ray_size(), distances }
    }
}

impl SurfaceMap<'_> {
    /// The point of the surface under a pixel of the picture, in space, mm; None if there is no surface.
    pub(super) fn at(&self, pixel: [f64; 2]) -> Option<DVec3> {
        let on_nearest = || {
            let ([x, y], (origin, direction)) = self.picker.nearest_ray(pixel, self.size)?;
            Some(origin + direction * self.distance([x, y])?)
        };
        self.between(pixel).or_else(on_nearest)
    }

    /// The distance along a ray; none where it hits nothing.
    fn distance(&self, [x, y]: [usize; 2]) -> Option<f64> {
        Some(self.distances.one(x, y, 0)).filter(|away| away.abs() < MISSED)
    }

    /// The point between the four rays around a pixel, if they hit one surface: while the view moves, rays are up to four pixels apart.
    fn between(&self, pixel: [f64; 2]) -> Option<DVec3> {
        let ([x, y], [right, down]) = self.picker.rays_around(pixel, self.size)?;
        let mut away = [0.0; 4];
        for (n, away) in away.iter_mut().enumerate() {
            *away = self.distance([x + n % 2, y + n / 2])?;
        }
        let mean = away.iter().sum::<f64>() / 4.0;
        let place = |x: usize, y: usize| {
            let (origin, direction) = self.picker.ray_at([x, y]);
            origin + direction * mean
        };
        let [low, high] = [f64::min, f64::max].map(|least| away.into_iter().fold(mean, least));
        if high - low > STEEPEST * place(x, y).distance(place(x + 1, y + 1)) {
            return None;
        }
        let across = |a: f64, b: f64, share: f64| a + (b - a) * share;
        let away = across(across(away[0], away[1], right), across(away[2], away[3], right), down);
        let (origin, direction) = self.picker.ray(pixel);
        Some(origin + direction * away)
    }

    /// The points of the surface, in space, mm, along the line that is straight on the picture between two of its points. None if an end
    /// cannot be projected onto the picture.
    pub(super) fn path(&self, from: DVec3, to: DVec3) -> Option<Vec<DVec3>> {
        let (a, b) = (self.picker.project(from)?, self.picker.project(to)?);
        let pixels = (b[0] - a[0]).hypot(b[1] - a[1]);
        let count = (pixels * self.picker.mm_per_pixel() / PATH_STEP).ceil().clamp(1.0, PATH_POINTS as f64) as usize;
        let share = |n: usize| n as f64 / count as f64;
        let between = (1..count).filter_map(|n| self.at([0, 1].map(|i| a[i] + (b[i] - a[i]) * share(n))));
        Some([from].into_iter().chain(between).chain([to]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::shapes;
    use crate::probe::{Geometry, Grid};
    use crate::scene::{Input as Samples, load::Layers};
    use crate::source::StoredType;

    /// A ball of 15 mm, as a distance map shows it: the path along it is an arc of known length.
    #[test]
    fn a_path_along_a_ball_has_the_length_of_its_arc() {
        // Also as it is drawn while the view moves.
        for (toml, within) in [
            (&["picture.size=[300,240]"][..], 0.002),
            (&["picture.size=[301,240]", "layout='four'", "camera.azimuth=30"], 0.002),
            (&["picture.size=[300,240]", "ray.subsampling=4"], 0.005),
        ] {
            let mut layers = Layers::default();
            toml.iter().for_each(|line| layers.set(line).expect(line));
            let grid = Grid { size: [41, 41, 41], spacing: [1.0; 3], origin: [-20.0, 0.0, -20.0] };
            let input = Samples { stored: StoredType::U8, range: [0.0, 255.0] };
            let scene =
                Scene::new(Geometry::Cartesian(grid), input, layers.finish().expect("settings")).expect("scene");
            let (centre, radius) = (scene.rays.target, 15.0);
            let size = scene.ray_size();
            let distances = Texels::from_fn([size[0] as usize, size[1] as usize, 1], 1, |[x, y, _], _| {
                let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
                let middle = (centre - origin).dot(direction);
                let off = (origin + direction * middle - centre).length_squared();
                if off < radius * radius { middle - (radius * radius - off).sqrt() } else { f64::from(f32::MAX) }
            });
            let map = SurfaceMap::of(&scene, &distances);
            let on_ball = |angle: f64| {
                let place = centre + (scene.rays.right * angle.sin() - scene.rays.forward * angle.cos()) * radius;
                let pixel = map.picker.project(place).expect("in front");
                map.at(pixel).expect("on the ball")
            };
            let ends = [on_ball(-0.6), on_ball(0.7)];
            let path = map.path(ends[0], ends[1]).expect("a path");
            let (found, truth) = (shapes::length(&path), 1.3 * radius);
            assert!((found / truth - 1.0).abs() < within, "{toml:?}: {found} of {truth}");
            assert!((ends[0].distance(centre) - radius).abs() < 0.05, "{toml:?}: {}", ends[0].distance(centre));
            assert!(map.at([0.5, 0.5]).is_none(), "beside the ball");
        }
    }
}
