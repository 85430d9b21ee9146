//! Signed distances of simple shapes, mm, negative inside, and how shapes are combined.

use glam::{Vec3, vec3};

pub(super) fn ball(p: Vec3, centre: Vec3, radius: f32) -> f32 {
    (p - centre).length() - radius
}

pub(super) fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let scaled = (p - centre) / radii;
    let slope = (scaled / radii).length();
    let k = scaled.length();
    // At the centre the slope vanishes; there the smallest radius is the distance.
    if slope < 1e-6 { -radii.min_element() } else { k * (k - 1.0) / slope }
}

/// Distance of a position from a rod with round ends, mm, negative inside. `radii`: at `from` and at `to`, interpolated between them.
pub(super) fn rod(p: Vec3, from: Vec3, to: Vec3, radii: [f32; 2]) -> f32 {
    let along = to - from;
    let share = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (p - from - along * share).length() - radii[0] - (radii[1] - radii[0]) * share
}

/// Union of two shapes, given by their distances `a` and `b`. The crease between them is filled over `width` mm.
pub(super) fn join(a: f32, b: f32, width: f32) -> f32 {
    let overlap = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - overlap * overlap * width / 4.0
}

/// The shape with distance `a` without the shape with distance `b`. The edge between them is rounded over `width` mm.
pub(super) fn carve(a: f32, b: f32, width: f32) -> f32 {
    -join(-a, b, width)
}

/// A function that is 1 at 0 and falls to 1/e at `width`: the profile of a groove or a ridge.
pub(super) fn bell(x: f32, width: f32) -> f32 {
    (-(x / width).powi(2)).exp()
}

/// A function that is 0 up to `from`, 1 from `to` on, and smooth between.
pub(super) fn smooth_step(x: f32, from: f32, to: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The point with its x made positive, so that a shape that exists on both sides is modelled once.
pub(super) fn one_side(p: Vec3) -> Vec3 {
    vec3(p.x.abs(), p.y, p.z)
}

/// Gradient of a distance field at a point, computed from four samples at the corners of a tetrahedron.
pub(super) fn gradient(p: Vec3, field: impl Fn(Vec3) -> f32) -> Vec3 {
    const REACH: f32 = 0.3;
    const CORNERS: [Vec3; 4] =
        [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::ONE];
    CORNERS.iter().map(|corner| *corner * field(p + *corner * REACH)).sum::<Vec3>() / (4.0 * REACH)
}

/// Unit gradient of a distance field at a point: the normal of its surface.
pub(super) fn normal(p: Vec3, field: impl Fn(Vec3) -> f32) -> Vec3 {
    gradient(p, field).normalize_or_zero()
}
