//! Cameras of a turntable: one turn about the vertical axis of the view, without a change of scale.
//!
//! The camera of a single picture fits the region into the picture, so its scale depends on the direction of view. In a turn that would
//! show as a zoom in and out. Here all pictures have the scale of the one that needs most room, and nothing of the region is cut off.

use super::camera::full_size;
use super::region::{depth_offset, framed_low, is_still};
use super::settings::Camera;
use super::{Scene, SceneError, camera, refuse};
use glam::DVec3;

impl Scene {
    /// The cameras of `count` pictures of one turn; a `count` of 0 gives one. The first looks in the direction of the scene's camera. From each to the next,
    /// and from the last to the first, the view direction turns right by 360 / `count` degrees about the picture's vertical axis through the target.
    /// Each has a `zoom` of its own, so that all have one scale: that of the picture that needs most room with the scene's zoom.
    ///
    /// # Errors
    /// The mode shows planes, which do not turn with the view; or a start depth leaves nothing of the region.
    pub fn turntable(&self, count: u32) -> Result<Vec<Camera>, SceneError> {
        if self.is_flat() {
            return refuse("mode", "shows planes, which do not turn with the view: a turntable needs a rendering");
        }
        let framed = framed_low(&self.geometry, &self.settings, self.low, self.high)?;
        let half = (self.high - framed) / 2.0;
        let along = |axis: DVec3| axis.abs().dot(half);
        let [width, height] = full_size(&self.settings).map(f64::from);
        let settings = &self.settings.camera;
        let tilt = if is_still(&self.geometry) { 90.0 } else { 0.0 };
        let start = camera::rays(&self.settings, framed, self.high, depth_offset(&self.geometry), tilt > 0.0);
        let views: Vec<View> = (0..count.max(1))
            .map(|n| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(n) / f64::from(count.max(1))).sin_cos();
                let (right, forward) =
                    (start.right * cos - start.forward * sin, start.forward * cos + start.right * sin);
                let fit = (along(start.up) / height).max(along(right) / width);
                View { right, forward, fit, near: along(forward) }
            })
            .collect();
        // mm per pixel at the target, or, in perspective, at the near side of the region.
        let pixel = |view: &View| 2.0 * view.fit / settings.zoom;
        let spread = 2.0 * (settings.field_of_view.to_radians() / 2.0).tan() / height;
        let is_perspective = settings.field_of_view > 0.0;
        let size = |view: &View| if is_perspective { pixel(view) / spread + view.near } else { pixel(view) };
        // The scale of a parallel view, or the distance of a camera.
        let largest = views.iter().map(size).fold(0.0, f64::max);
        let camera_of = |view: &View| {
            let pixel = if is_perspective { (largest - view.near) * spread } else { largest };
            let [azimuth, elevation, roll] = angles(view.right, view.forward);
            let zoom = 2.0 * view.fit / pixel;
            Camera { azimuth, elevation: elevation - tilt, roll, zoom, ..settings.clone() }
        };
        Ok(views.iter().map(camera_of).collect())
    }
}

/// The axes of a camera of the turn, and what of the region lies along them.
struct View {
    right: DVec3,
    forward: DVec3,
    /// mm per pixel at which the region just fits.
    fit: f64,
    /// Half of the region's extent along the view, mm.
    near: f64,
}

/// Azimuth, elevation and roll, degrees, of a camera with these axes: the inverse of [`camera::rays`].
fn angles(right: DVec3, forward: DVec3) -> [f64; 3] {
    let elevation = forward.z.atan2(forward.x.hypot(forward.y));
    let azimuth = forward.x.atan2(forward.y);
    // The axes that such a camera has without roll.
    let level = DVec3::new(azimuth.cos(), -azimuth.sin(), 0.0);
    let roll = right.dot(level.cross(forward)).atan2(right.dot(level));
    [azimuth, elevation, roll].map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::StoredType;
    use crate::probe::{Geometry, Grid};
    use crate::scene::{Input, Mode, Rays, Settings};

    fn scene(change: impl Fn(&mut Settings)) -> Scene {
        let grid = Grid { size: [81, 51, 41], spacing: [1.0; 3], origin: [-40.0, 10.0, -20.0] };
        let mut settings = Settings::default();
        settings.picture.size = [200, 100];
        change(&mut settings);
        let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
        Scene::new(Geometry::Cartesian(grid), input, settings).expect("a scene")
    }

    fn views(change: impl Fn(&mut Settings), count: u32) -> (Scene, Vec<Rays>) {
        let scene = scene(change);
        let cameras = scene.turntable(count).expect("cameras");
        let rays = cameras.into_iter().map(|camera| {
            let settings = Settings { camera, ..scene.settings.clone() };
            Scene::new(scene.geometry.clone(), scene.input, settings).expect("a scene").rays
        });
        let rays = rays.collect();
        (scene, rays)
    }

    /// Looks of a camera: level, tilted, rolled, straight down, and near.
    const LOOKS: [[f64; 4]; 5] = [
        [0.0, 0.0, 0.0, 0.0],
        [30.0, -25.0, 0.0, 0.0],
        [200.0, 40.0, 70.0, 35.0],
        [10.0, 90.0, 0.0, 0.0],
        [0.0, 0.0, 90.0, 60.0],
    ];

    fn look([azimuth, elevation, roll, field_of_view]: [f64; 4]) -> impl Fn(&mut Settings) {
        move |s| {
            (s.camera.azimuth, s.camera.elevation, s.camera.roll) = (azimuth, elevation, roll);
            s.camera.field_of_view = field_of_view;
        }
    }

    #[test]
    fn equal_steps_about_the_vertical_axis_of_the_view_make_one_turn() {
        for angles in LOOKS {
            for count in [1, 7, 24] {
                let (scene, rays) = views(look(angles), count);
                let step = std::f64::consts::TAU / f64::from(count);
                for (n, here) in rays.iter().enumerate() {
                    let next = &rays[(n + 1) % rays.len()];
                    assert!(here.up.distance(scene.rays.up) < 1e-9, "{angles:?}: the axis turns");
                    assert!(here.target.distance(scene.rays.target) < 1e-9);
                    // The angle from each view to the next one, and from the last to the first, with its sign.
                    let turned = here.forward.cross(next.forward).dot(here.forward.cross(here.right));
                    let angle = turned.atan2(here.forward.dot(next.forward)).rem_euclid(std::f64::consts::TAU);
                    let off = (angle - step).abs().min((angle - step + std::f64::consts::TAU).abs());
                    assert!(off.min((off - std::f64::consts::TAU).abs()) < 1e-7, "{angles:?}, {n} of {count}: {angle}");
                }
                assert!(
                    rays[0].forward.distance(scene.rays.forward) < 1e-9
                        && rays[0].right.distance(scene.rays.right) < 1e-9
                );
            }
        }
    }

    /// Prevents a turn that zooms in and out, and one that cuts off corners of the region.
    #[test]
    fn the_scale_is_that_of_the_view_that_needs_most_room() {
        for angles in LOOKS {
            let (scene, rays) = views(look(angles), 24);
            // The size of a pixel at the target and the distance of the camera.
            let seen = |rays: &Rays| {
                let at = |x: f64| {
                    let (origin, direction) = rays.at(x, 50.0);
                    origin + direction * ((rays.target - origin).dot(rays.forward) / direction.dot(rays.forward))
                };
                (at(100.5).distance(at(99.5)), (rays.target - rays.at(100.0, 50.0).0).length())
            };
            let (pixel, distance) = seen(&rays[0]);
            for (n, rays) in rays.iter().enumerate() {
                let (here, away) = seen(rays);
                assert!((here / pixel - 1.0).abs() < 1e-9, "{angles:?}, {n}: {here} instead of {pixel} mm a pixel");
                assert!(!rays.is_perspective || (away / distance - 1.0).abs() < 1e-9);
                // Every corner of a parallel view is in the picture.
                for corner in (0..8).filter(|_| !rays.is_perspective) {
                    let side = |axis: usize| if corner >> axis & 1 == 1 { scene.high[axis] } else { scene.low[axis] };
                    let off = DVec3::from([0, 1, 2].map(side)) - rays.target;
                    let [x, y] = [off.dot(rays.right) / here, off.dot(rays.up) / here];
                    assert!(x.abs() < 100.0 + 1e-6 && y.abs() < 50.0 + 1e-6, "{angles:?}, {n}: {x} {y}");
                }
            }
            // No more room is taken than one view needs.
            let (alone, _) = seen(&scene.rays);
            assert!(pixel >= alone * (1.0 - 1e-9));
        }
        let (scene, _) = views(|_| {}, 1);
        let zoom = |n: usize| scene.turntable(4).expect("cameras")[n].zoom;
        assert!((zoom(0) - zoom(2)).abs() < 1e-12 && (0..4).any(|n| (zoom(n) - 1.0).abs() < 1e-12));
    }

    /// Prevents a turn whose pictures are all the same.
    #[test]
    fn modes_that_show_planes_are_refused() {
        for mode in [Mode::Plane, Mode::Orthogonal, Mode::Tomography] {
            let fault = scene(|s| s.mode = mode).turntable(4).expect_err("planes do not turn").to_string();
            assert!(fault.starts_with("scene: mode: shows planes, which do not turn"), "{mode:?}: {fault}");
        }
        for mode in [Mode::Cube, Mode::Mip, Mode::Surface] {
            assert!(scene(|s| s.mode = mode).turntable(4).is_ok(), "{mode:?}");
        }
    }
}
