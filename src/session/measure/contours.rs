//! The volume of a body from contours of its sections: parallel planes by Cavalieri's principle, and planes through one axis by Pappus'
//! theorem (the method of rotated contours of ultrasound systems).

use crate::segment::sections::{Arrangement, Plane, SAME_ANGLE, SAME_PLANE, arranged};
use glam::DVec3;
use std::f64::consts::PI;

/// The volume that contours (in mm) enclose, mm^3, and the arrangement of their planes.
///
/// In parallel planes each area counts from halfway to the previous plane to halfway to the next one; the outermost areas extend as far outwards
/// as inwards. In planes through an axis each half of a contour is rotated about the axis by its share of half a turn.
///
/// # Errors
/// One line: there are fewer than two planes, a contour has no area, or the planes are neither parallel nor share an axis.
pub fn volume(contours: &[Vec<DVec3>]) -> Result<(f64, Arrangement), &'static str> {
    let (planes, arrangement) = arranged(contours)?;
    let mm3 = match arrangement {
        Arrangement::Parallel { normal } => parallel(&planes, normal)?,
        Arrangement::Rotated { axis, through } => rotated(contours, &planes, axis, through),
    };
    Ok((mm3, arrangement))
}

fn parallel(planes: &[Plane], normal: DVec3) -> Result<f64, &'static str> {
    let sections = sections(planes.iter().map(|plane| (plane.at.dot(normal), plane.area)), SAME_PLANE);
    let [(low, first), .., (high, last)] = sections[..] else {
        return Err("all contours lie in one plane: step the plane between them");
    };
    let ends = first * (sections[1].0 - low) + last * (high - sections[sections.len() - 2].0);
    let between: f64 = sections.windows(2).map(|pair| (pair[1].0 - pair[0].0) * (pair[0].1 + pair[1].1)).sum();
    Ok((ends + between) / 2.0)
}

fn rotated(contours: &[Vec<DVec3>], planes: &[Plane], axis: DVec3, through: DVec3) -> f64 {
    let reference = planes[0].normal;
    let of = |(contour, plane): (&Vec<DVec3>, &Plane)| {
        let outwards = plane.normal.cross(axis).normalize();
        let turned = plane.normal.cross(reference).dot(axis).atan2(plane.normal.dot(reference)).rem_euclid(PI);
        // A plane at the angle 0 may be a rounding below half a turn.
        let turned = if turned > PI - SAME_ANGLE { turned - PI } else { turned };
        (turned, moment(contour, through, outwards, axis))
    };
    let sections = sections(contours.iter().zip(planes).map(of), SAME_ANGLE);
    let count = sections.len();
    let gap = |n: usize| match n + 1 == count {
        true => sections[0].0 + PI - sections[n].0,
        false => sections[n + 1].0 - sections[n].0,
    };
    (0..count).map(|n| sections[n].1 * (gap(n) + gap((n + count - 1) % count)) / 2.0).sum()
}

/// Adds up parts, each a place (mm or radians) and an amount: those less than `reach` beyond the first of a section, as in one plane, belong to it. In
/// rising order of places.
fn sections(parts: impl Iterator<Item = (f64, f64)>, reach: f64) -> Vec<(f64, f64)> {
    let mut sections: Vec<(f64, f64)> = parts.collect();
    sections.sort_by(|a, b| a.0.total_cmp(&b.0));
    sections.dedup_by(|later, earlier| {
        let is_same = later.0 - earlier.0 < reach;
        earlier.1 += if is_same { later.1 } else { 0.0 };
        is_same
    });
    sections
}

/// The integral of the distance from the axis over the area of a contour, mm^3: what it sweeps in a turn of one radian, of both sides.
fn moment(contour: &[DVec3], through: DVec3, outwards: DVec3, axis: DVec3) -> f64 {
    let flat: Vec<[f64; 2]> =
        contour.iter().map(|p| [(*p - through).dot(outwards), (*p - through).dot(axis)]).collect();
    let side = |sense: f64| -> f64 {
        let kept = clipped(&flat, sense);
        let ends = kept.iter().zip(kept.iter().cycle().skip(1));
        let sum: f64 = ends.map(|([x, y], [u, v])| (x + u) * (x * v - u * y)).sum();
        (sum / 6.0).abs()
    };
    side(1.0) + side(-1.0)
}

/// The part of a polygon on one side of the axis (Sutherland and Hodgman).
fn clipped(polygon: &[[f64; 2]], sense: f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::new();
    for (from, to) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (a, b) = (from[0] * sense, to[0] * sense);
        if a >= 0.0 {
            kept.push(*from);
        }
        if (a >= 0.0) != (b >= 0.0) {
            let share = a / (a - b);
            kept.push([0.0, from[1] + (to[1] - from[1]) * share]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::shapes::Ellipse;

    const CENTRE: DVec3 = DVec3::new(4.0, 62.0, -3.0);

    /// The section of a ball of 20 mm by a plane, `off` its middle.
    fn section(normal: DVec3, off: f64) -> Option<Vec<DVec3>> {
        let radius = (400.0 - off * off).max(0.0).sqrt();
        let right = normal.any_orthonormal_vector();
        let (at, up) = (CENTRE + normal * off, normal.cross(right));
        let ring = Ellipse::of([at - right * radius, at + right * radius, at + up * radius])?;
        Some(ring.outline(180).collect())
    }

    const BALL: f64 = 4.0 / 3.0 * PI * 8000.0;

    #[test]
    fn parallel_contours_of_a_ball_give_its_volume_to_one_percent() {
        let normal = DVec3::new(0.2, 1.0, -0.4).normalize();
        for count in [8, 12, 20] {
            let step = 40.0 / f64::from(count);
            let stack: Vec<_> =
                (0..count).filter_map(|n| section(normal, (f64::from(n) + 0.5) * step - 20.0)).collect();
            let (found, how) = volume(&stack).expect("a volume");
            let is_parallel = matches!(how, Arrangement::Parallel { .. });
            assert!(is_parallel && (found / BALL - 1.0).abs() < 0.01, "{count}: {found} of {BALL}");
            // In any order, and whatever the sense of a contour.
            let mut mixed = stack.clone();
            mixed.reverse();
            mixed[0].reverse();
            assert!((volume(&mixed).expect("a volume").0 - found).abs() < 1e-6 * found);
        }
    }

    #[test]
    fn rotated_contours_of_a_ball_give_its_volume_to_one_percent() {
        for count in [2, 3, 6] {
            let axis = DVec3::new(0.1, 1.0, 0.3).normalize();
            let first = axis.any_orthonormal_vector();
            let planes = (0..count).map(|n| {
                let (sin, cos) = (PI * f64::from(n) / f64::from(count)).sin_cos();
                first * cos + axis.cross(first) * sin
            });
            let turned: Vec<_> = planes.filter_map(|normal| section(normal, 0.0)).collect();
            let (found, how) = volume(&turned).expect("a volume");
            let is_rotated = matches!(how, Arrangement::Rotated { .. });
            assert!(is_rotated && (found / BALL - 1.0).abs() < 0.002, "{count}: {found} of {BALL}");
        }
    }

    /// An ellipsoid with semi-axes 10, 15 and 25 mm, turned about the longest: its sections there are not alike.
    #[test]
    fn rotated_contours_follow_a_body_that_is_not_round() {
        let turned: Vec<Vec<DVec3>> = (0..6)
            .map(|n| {
                let (sin, cos) = (PI * f64::from(n) / 6.0).sin_cos();
                let radius = 1.0 / (cos * cos / 100.0 + sin * sin / 225.0).sqrt();
                let out = DVec3::new(cos, 0.0, sin) * radius;
                Ellipse::of([-out, out, DVec3::Y * 25.0]).expect("one").outline(180).collect()
            })
            .collect();
        let (found, truth) = (volume(&turned).expect("a volume").0, 4.0 / 3.0 * PI * 10.0 * 15.0 * 25.0);
        assert!((found / truth - 1.0).abs() < 0.01, "{found} of {truth}");
    }

    #[test]
    fn a_box_by_its_sections_is_exact_and_parts_of_a_plane_are_added() {
        let square = |x: f64, z: f64| {
            [[0.0, 0.0], [4.0, 0.0], [4.0, 5.0], [0.0, 5.0]].map(|[u, v]| DVec3::new(x + u, v, z)).to_vec()
        };
        let stack = vec![square(0.0, 1.0), square(10.0, 1.0), square(0.0, 3.0), square(10.0, 3.0)];
        let (found, _) = volume(&stack).expect("a volume");
        assert!((found - 2.0 * 20.0 * 4.0).abs() < 1e-9, "{found}");
    }

    #[test]
    fn contours_that_make_no_volume_are_refused() {
        let ring = section(DVec3::Y, 0.0).expect("a ring");
        assert!(volume(std::slice::from_ref(&ring)).is_err());
        assert!(volume(&[ring.clone(), ring.clone()]).is_err_and(|why| why.contains("one plane")));
        assert!(volume(&[ring.clone(), vec![DVec3::ONE; 3]]).is_err_and(|why| why.contains("area")));
        let far: Vec<DVec3> = section(DVec3::X, 0.0).expect("a ring").iter().map(|p| *p + DVec3::X * 50.0).collect();
        let turned = section(DVec3::new(1.0, 1.0, 1.0).normalize(), 10.0).expect("a ring");
        assert!(volume(&[ring, far, turned]).is_err_and(|why| why.contains("neither")));
    }
}
