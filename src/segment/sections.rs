//! The planes of contours that were drawn on sections, and how they are arranged.

use glam::{DMat3, DVec3};

/// Planes whose normals are closer than this are parallel: sine of the angle, 1 degree.
const PARALLEL: f64 = 0.0175;
/// Largest distance of the common axis from a plane that is turned about it, mm.
const OFF_AXIS: f64 = 1.0;
/// Contours lie in the same plane if their parallel planes are less than this apart, mm.
pub const SAME_PLANE: f64 = 0.05;
/// Contours lie in the same plane if the angle between their planes is less than this, rad.
pub const SAME_ANGLE: f64 = 0.002;

/// The plane of a contour, and the area that the contour encloses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The mean of the contour's points, mm.
    pub at: DVec3,
    /// Unit normal of the plane.
    pub normal: DVec3,
    /// Area that the contour encloses, mm^2.
    pub area: f64,
}

/// How the planes of contours are arranged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// They are parallel; `normal` is that of the first.
    Parallel { normal: DVec3 },
    /// They contain a common axis, about which they are rotated: the unit vector `axis` through the point `through`, mm.
    Rotated { axis: DVec3, through: DVec3 },
}

/// The plane of each contour, and how the planes are arranged. Coordinates are in mm.
///
/// # Errors
/// One line: there are fewer than two contours, a contour has no area, or the planes are neither parallel nor share an axis.
pub fn arranged(contours: &[Vec<DVec3>]) -> Result<(Vec<Plane>, Arrangement), &'static str> {
    let areas: Vec<DVec3> = contours.iter().map(|contour| vector_area(contour)).collect();
    if areas.len() < 2 {
        return Err("a volume needs contours in two planes or more");
    }
    if areas.iter().any(|area| !area.is_finite() || area.length() < 1e-9) {
        return Err("a contour encloses no area");
    }
    let plane = |(contour, area): (&Vec<DVec3>, &DVec3)| Plane {
        at: centroid(contour),
        normal: area.normalize(),
        area: area.length(),
    };
    let planes: Vec<Plane> = contours.iter().zip(&areas).map(plane).collect();
    let normal = planes[0].normal;
    if planes.iter().all(|plane| plane.normal.cross(normal).length() < PARALLEL) {
        return Ok((planes, Arrangement::Parallel { normal }));
    }
    let (axis, through) =
        common_axis(&planes).ok_or("the contours lie neither in parallel planes nor in planes through one axis")?;
    Ok((planes, Arrangement::Rotated { axis, through }))
}

/// The axis that all planes contain, a unit vector, and the point on it next to their middle.
fn common_axis(planes: &[Plane]) -> Option<(DVec3, DVec3)> {
    // Perpendicular to all normals: the sum of their products, with one sense.
    let mut axis = DVec3::ZERO;
    for (n, plane) in planes.iter().enumerate() {
        for other in &planes[n + 1..] {
            let across = plane.normal.cross(other.normal);
            axis += if across.dot(axis) < 0.0 { -across } else { across };
        }
    }
    let axis = axis.normalize_or_zero();
    let middle = centroid(&planes.iter().map(|plane| plane.at).collect::<Vec<_>>());
    let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    // The point on the axis nearest to all planes.
    let (mut sums, mut right) = (outer(axis), axis * axis.dot(middle));
    for plane in planes {
        sums += outer(plane.normal);
        right += plane.normal * plane.normal.dot(plane.at);
    }
    let through = sums.inverse() * right;
    let is_through = |plane: &Plane| {
        plane.normal.dot(axis).abs() < PARALLEL && plane.normal.dot(through - plane.at).abs() <= OFF_AXIS
    };
    (axis != DVec3::ZERO && through.is_finite() && planes.iter().all(is_through)).then_some((axis, through))
}

/// The area of a closed contour of points in mm, the last of which is joined to the first, as a vector along its normal, mm^2 (Newell). The direction
/// follows from the order of the points by the right-hand rule. For a plane contour its length is the enclosed area, as by the shoelace formula. For
/// another contour it is the area of the projection onto the plane in which that is largest.
pub fn vector_area(contour: &[DVec3]) -> DVec3 {
    let Some((first, rest)) = contour.split_first() else { return DVec3::ZERO };
    rest.windows(2).map(|ends| (ends[0] - first).cross(ends[1] - first)).sum::<DVec3>() / 2.0
}

/// The mean of the points; 0 without points.
pub fn centroid(points: &[DVec3]) -> DVec3 {
    points.iter().sum::<DVec3>() / points.len().max(1) as f64
}
