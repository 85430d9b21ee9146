//! The camera as rays. The origin and direction of a pixel's ray are affine functions of the pixel's position, in parallel and
//! perspective projection.

use super::Settings;
use glam::DVec3;

/// How far the eye of a parallel view stands off the box beyond a 20th of the box's extent along the view: this share of half its diagonal. About 1 mm
/// for a fetal head; the least that keeps a ray's entry above 0 by more than f32 loses.
const OFF: f64 = 1.0 / 128.0;

/// The rays of a picture. A position (px, py) counts rays, not pixels, from the upper left corner of the rendering, and may be fractional. The ray
/// there has the origin `origin + px origin_dx + py origin_dy`; its direction is `direction + px direction_dx + py direction_dy`, normalised. Places
/// are in mm in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rays {
    pub origin: DVec3,
    pub origin_dx: DVec3,
    pub origin_dy: DVec3,
    pub direction: DVec3,
    pub direction_dx: DVec3,
    pub direction_dy: DVec3,
    /// Camera axes in space, unit vectors: `right` and `up` in the picture, `forward` away from the viewer.
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// The point that the camera looks at, mm in space.
    pub target: DVec3,
    pub is_perspective: bool,
}

impl Rays {
    /// Origin and unit direction of the ray through (px, py); (0.5, 0.5) is the centre of the upper left ray's cell.
    pub fn at(&self, px: f64, py: f64) -> (DVec3, DVec3) {
        let origin = self.origin + self.origin_dx * px + self.origin_dy * py;
        let direction = self.direction + self.direction_dx * px + self.direction_dy * py;
        (origin, direction.normalize())
    }

    /// Converts a direction from the camera's axes (right, up, towards the viewer) to space.
    pub(crate) fn out_of_camera(&self, v: DVec3) -> DVec3 {
        self.right * v.x + self.up * v.y - self.forward * v.z
    }
}

/// Number of rays along each axis: the pixels of the rendering times `ray.rays`, divided by `ray.subsampling` (rounded up).
pub fn ray_size(settings: &Settings) -> [u32; 2] {
    full_size(settings).map(|n| n.div_ceil(settings.ray.subsampling))
}

/// Number of rays along each axis without `ray.subsampling`: the pixels of the rendering times `ray.rays`.
pub fn full_size(settings: &Settings) -> [u32; 2] {
    settings.layout.rendering(settings.picture.size).size.map(|n| n * settings.ray.rays)
}

/// The rays of the settings' camera, which frames the box `low`..`high`, mm in space. `depth_offset`, mm, is added to depths below the probe's face
/// to give Y in space. `still`: the recording is a single frame, which is viewed from the side like a B-mode picture, with the probe on top.
pub fn rays(settings: &Settings, low: DVec3, high: DVec3, depth_offset: f64, still: bool) -> Rays {
    let camera = &settings.camera;
    let azimuth = camera.azimuth.to_radians();
    let elevation = (camera.elevation + if still { 90.0 } else { 0.0 }).to_radians();
    let forward = DVec3::new(azimuth.sin() * elevation.cos(), azimuth.cos() * elevation.cos(), elevation.sin());
    let right = DVec3::new(azimuth.cos(), -azimuth.sin(), 0.0);
    let up = right.cross(forward);
    let (sin, cos) = camera.roll.to_radians().sin_cos();
    let (right, up) = (right * cos + up * sin, up * cos - right * sin);

    let half = (high - low) / 2.0;
    let target = match camera.target {
        Some([lateral, depth, elevation]) => DVec3::new(lateral, depth + depth_offset, elevation),
        None => (low + high) / 2.0,
    };
    // Half extents of the box along the camera's axes.
    let along = |axis: DVec3| axis.abs().dot(half);
    let [width, height] = full_size(settings).map(f64::from);
    let fit = (along(up) / height).max(along(right) / width);
    // mm per pixel at the target.
    let pixel = 2.0 * fit / camera.zoom;
    // A share of the box, so that its picture is the same whatever its size in mm is. The second term keeps the camera off a thin box.
    let away = along(forward) * 1.05 + half.length() * OFF;

    // Offset of the picture's upper left corner from its middle, pixels.
    let corner = |right: DVec3, up: DVec3| right * (-width / 2.0) + up * (height / 2.0);
    // The ray of several pixels passes through their middle.
    let apart = f64::from(settings.ray.subsampling);
    let parallel = Rays {
        origin: target - forward * away + corner(right, up) * pixel,
        origin_dx: right * pixel * apart,
        origin_dy: -up * pixel * apart,
        direction: forward,
        direction_dx: DVec3::ZERO,
        direction_dy: DVec3::ZERO,
        right,
        up,
        forward,
        target,
        is_perspective: false,
    };
    if camera.field_of_view <= 0.0 {
        return parallel;
    }
    let spread = 2.0 * (camera.field_of_view.to_radians() / 2.0).tan() / height;
    // The picture fits the near side of the box at zoom 1. As the zoom grows the camera comes nearer to that side, and never into the box.
    let distance = pixel / spread + along(forward);
    Rays {
        origin: target - forward * distance,
        origin_dx: DVec3::ZERO,
        origin_dy: DVec3::ZERO,
        direction: forward + corner(right, up) * spread,
        direction_dx: right * spread * apart,
        direction_dy: -up * spread * apart,
        is_perspective: true,
        ..parallel
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(change: impl Fn(&mut Settings)) -> Rays {
        let mut settings = Settings::default();
        settings.picture.size = [200, 100];
        change(&mut settings);
        rays(&settings, DVec3::new(-40.0, 10.0, -20.0), DVec3::new(40.0, 60.0, 20.0), 0.0, false)
    }

    #[test]
    fn the_view_from_the_probe_is_not_mirrored() {
        let rays = view(|_| {});
        let (left, direction) = rays.at(0.5, 50.0);
        let (right, _) = rays.at(199.5, 50.0);
        let (top, _) = rays.at(100.0, 0.5);
        assert!((direction - DVec3::Y).length() < 1e-12);
        assert!(right.x > left.x && top.z > left.z);
        assert!((rays.right.cross(rays.up) + rays.forward).length() < 1e-12, "the camera is right-handed");
    }

    #[test]
    fn the_middle_of_the_picture_looks_at_the_target_in_both_projections() {
        for field_of_view in [0.0, 40.0] {
            let rays = view(|s| {
                s.camera.field_of_view = field_of_view;
                (s.camera.azimuth, s.camera.elevation, s.camera.roll) = (30.0, -20.0, 70.0);
                s.camera.target = Some([5.0, 30.0, -3.0]);
            });
            let (origin, direction) = rays.at(100.0, 50.0);
            let target = DVec3::new(5.0, 30.0, -3.0);
            assert!((target - origin).cross(direction).length() < 1e-9);
            assert!((target - origin).dot(direction) > 0.0);
        }
    }

    /// Prevents a camera that jumps where the zoom passes 1.
    #[test]
    fn the_size_of_the_target_grows_with_the_zoom_without_a_jump() {
        for field_of_view in [0.0, 30.0, 120.0] {
            let pixels_per_mm = |zoom: f64| {
                let rays = view(|s| (s.camera.zoom, s.camera.field_of_view) = (zoom, field_of_view));
                let target = DVec3::new(0.0, 35.0, 0.0);
                let at = |x: f64| {
                    let (origin, direction) = rays.at(x, 50.0);
                    origin + direction * ((target - origin).dot(rays.forward) / direction.dot(rays.forward))
                };
                1.0 / (at(100.5) - at(99.5)).length()
            };
            let mut before = pixels_per_mm(0.2);
            for n in 1..=1600 {
                let here = pixels_per_mm(0.2 + f64::from(n) * 0.001);
                let ratio = here / before;
                assert!(
                    (1.0..1.006).contains(&ratio),
                    "{field_of_view} deg, zoom {}: {ratio}",
                    0.2 + f64::from(n) * 0.001
                );
                before = here;
            }
        }
    }

    #[test]
    fn the_box_fits_into_the_picture_at_zoom_one() {
        let rays = view(|_| {});
        let (left, _) = rays.at(0.0, 50.0);
        let (right, _) = rays.at(200.0, 50.0);
        assert!(right.x - left.x >= 80.0 - 1e-9);
    }
}
