//! A body between contours that were drawn on planes: parallel ones, or ones that are turned about an axis.
//!
//! Between two planes the shape is interpolated by signed distances (Raya and Udupa, Shape-based interpolation of multidimensional objects,
//! IEEE Transactions on Medical Imaging 9, 1990), cubic in the position of the plane or in its angle, which is periodic. Beyond the
//! first and the last of parallel planes the last contour shrinks as the areas of the sections say, whose second difference is constant for
//! an ellipsoid.

use crate::lattice::Region;
use crate::probe::Grid;
use crate::sections::{Arrangement, Plane, SAME_ANGLE, SAME_PLANE, arranged};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Most points of all contours.
const MAX_POINTS: usize = 65_536;

/// Linear indices (x is the fastest axis) of the voxels of `grid` whose centres lie in the body between contours. A contour is a closed polygon in a
/// plane, its points in mm in the coordinates of the grid. Several contours in one plane bound the same section; one within another is a hole.
///
/// # Errors
/// One line: fewer than two planes, a contour without area, planes that are neither parallel nor share an axis, too many points.
pub fn voxels(grid: &Grid, contours: &[Vec<DVec3>]) -> Result<Vec<u32>, String> {
    let points = contours.iter().map(Vec::len).sum::<usize>();
    if points > MAX_POINTS {
        return Err(format!("{points} points of contours are too many: at most {MAX_POINTS}"));
    }
    let body = Body::of(contours)?;
    let Some(region) = Region::within(grid, body.bounds(contours)) else { return Ok(Vec::new()) };
    let [low, size] = [region.low[2], region.size[2]];
    let of_slice = |z| {
        let slice = Region { low: [region.low[0], region.low[1], z], size: [region.size[0], region.size[1], 1] };
        let places = slice.places(grid);
        places.filter(|(_, place)| body.distance(*place) > 0.0).map(|(n, _)| n as u32).collect::<Vec<u32>>()
    };
    let inside: Vec<Vec<u32>> = (low..low + size).into_par_iter().map(of_slice).collect();
    Ok(inside.concat())
}

/// Polygons in a plane.
#[derive(Clone, Debug)]
struct Section {
    /// Height above the first plane, mm, or angle, radians.
    at: f64,
    polygons: Vec<Vec<DVec2>>,
}

impl Section {
    /// Distance from the outline, mm, positive inside.
    fn distance(&self, p: DVec2) -> f64 {
        let (mut nearest, mut is_inside) = (f64::INFINITY, false);
        for polygon in &self.polygons {
            for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
                let (along, from) = (*b - *a, p - *a);
                let share = (from.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                nearest = nearest.min(from.distance_squared(along * share));
                if (a.y > p.y) != (b.y > p.y) && p.x < a.x + along.x * (p.y - a.y) / along.y {
                    is_inside = !is_inside;
                }
            }
        }
        nearest.sqrt() * if is_inside { 1.0 } else { -1.0 }
    }

    /// The area, mm^2, and its centroid.
    fn area(&self) -> (f64, DVec2) {
        let (mut all, mut moment) = (0.0, DVec2::ZERO);
        for polygon in &self.polygons {
            let about = polygon.first().copied().unwrap_or_default();
            let (mut area, mut sum) = (0.0, DVec2::ZERO);
            for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
                let (a, b) = (*a - about, *b - about);
                area += a.perp_dot(b) / 2.0;
                sum += (a + b) * a.perp_dot(b) / 6.0;
            }
            let sense = area.signum();
            all += sense * area;
            moment += sense * (sum + about * area);
        }
        (all, moment / all.max(f64::MIN_POSITIVE))
    }
}

/// What lies beyond the first or the last plane.
#[derive(Clone, Debug)]
struct Cap {
    section: Section,
    /// Area relative to that of the section, and shift of the centroid, mm, at a distance from the plane, mm: factors of its powers.
    area: [f64; 2],
    shift: DVec2,
    centroid: DVec2,
    /// Where it ends, mm from the plane.
    end: f64,
}

impl Cap {
    /// `nearest`: up to three sections, from the border inwards; two at least.
    fn of(nearest: &[&Section]) -> Cap {
        let (area, centroid) = nearest[0].area();
        let off = |n: usize| (nearest[n].at - nearest[0].at).abs();
        let change = |n: usize| (nearest[n].area().0 / area.max(f64::MIN_POSITIVE) - 1.0) / off(n);
        let gap = off(1);
        // Through the areas at distances 0, -off(1) and -off(2).
        let factors = match nearest.len() {
            2 => [-change(1), 0.0],
            _ => {
                let second = (change(2) - change(1)) / (off(2) - gap);
                [-(change(1) - second * gap), second]
            }
        };
        let value = |t: f64| 1.0 + factors[0] * t + factors[1] * t * t;
        let shift = (centroid - nearest[1].area().1) / gap;
        // The body is not in the next plane; where the areas do not say where it ends, halfway.
        let is_ended = |step: &i32| value(gap * f64::from(*step) / 256.0) <= 0.0;
        let end = (1..=256).find(is_ended).map_or(gap / 2.0, |step| gap * f64::from(step) / 256.0);
        Cap { section: nearest[0].clone(), area: factors, shift, centroid, end }
    }

    fn distance(&self, p: DVec2, t: f64) -> f64 {
        let area = (1.0 + self.area[0] * t + self.area[1] * t * t).min(1.0);
        if t > self.end || area <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let scale = area.sqrt();
        scale * self.section.distance(self.centroid + (p - self.centroid - self.shift * t) / scale)
    }
}

/// The planes of contours with what is drawn in them, and the coordinates that they are described in.
enum Body {
    /// Heights are along z of the axes.
    Parallel { axes: DMat3, through: DVec3, sections: Vec<Section>, caps: Box<[Cap; 2]> },
    /// Half planes about z of the axes, by their angle from x: x is away from the axis.
    Rotated { axes: DMat3, through: DVec3, halves: Vec<Section> },
}

impl Body {
    fn of(contours: &[Vec<DVec3>]) -> Result<Body, String> {
        let (planes, arrangement) = arranged(contours)?;
        match arrangement {
            Arrangement::Parallel { normal } => Body::parallel(contours, &planes, normal),
            Arrangement::Rotated { axis, through } => Ok(Body::rotated(contours, &planes, axis, through)),
        }
    }

    fn parallel(contours: &[Vec<DVec3>], planes: &[Plane], normal: DVec3) -> Result<Body, String> {
        let (x, y) = normal.any_orthonormal_pair();
        let (axes, through) = (DMat3::from_cols(x, y, normal), planes[0].at);
        let of = |(contour, plane): (&Vec<DVec3>, &Plane)| {
            let polygon = contour.iter().map(|p| (axes.transpose() * (*p - through)).truncate()).collect();
            Section { at: (plane.at - through).dot(normal), polygons: vec![polygon] }
        };
        let sections = joined(contours.iter().zip(planes).map(of).collect(), SAME_PLANE);
        if sections.len() < 2 {
            return Err("all contours lie in one plane: step the plane between them".into());
        }
        let first: Vec<&Section> = sections.iter().take(3).collect();
        let last: Vec<&Section> = sections.iter().rev().take(3).collect();
        let caps = Box::new([Cap::of(&first), Cap::of(&last)]);
        Ok(Body::Parallel { axes, through, sections, caps })
    }

    fn rotated(contours: &[Vec<DVec3>], planes: &[Plane], axis: DVec3, through: DVec3) -> Body {
        let x = axis.any_orthonormal_vector();
        let axes = DMat3::from_cols(x, axis.cross(x), axis);
        let of = |(contour, plane): (&Vec<DVec3>, &Plane)| {
            // Away from the axis, within the plane; half a turn of angles.
            let away = axis.cross(plane.normal);
            let turned = away.dot(axes.y_axis).atan2(away.dot(x)).rem_euclid(PI);
            let at = if turned > PI - SAME_ANGLE { turned - PI } else { turned };
            let out = x * at.cos() + axes.y_axis * at.sin();
            let flat = |p: &DVec3| DVec2::new((*p - through).dot(out), (*p - through).dot(axis));
            Section { at, polygons: vec![contour.iter().map(flat).collect()] }
        };
        let sections = joined(contours.iter().zip(planes).map(of).collect(), SAME_ANGLE);
        let mirrored = |section: &Section| Section {
            at: section.at + PI,
            polygons: section.polygons.iter().map(|p| p.iter().map(|v| DVec2::new(-v.x, v.y)).collect()).collect(),
        };
        let other: Vec<Section> = sections.iter().map(mirrored).collect();
        Body::Rotated { axes, through, halves: [sections, other].concat() }
    }

    /// Corners of a box that holds the body.
    fn bounds(&self, contours: &[Vec<DVec3>]) -> [DVec3; 2] {
        let points = || contours.iter().flatten().copied();
        let (low, high) = points().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        // Between and beyond planes a shape may be wider than in them, but not by its size.
        let more = DVec3::splat(low.distance(high) / 2.0);
        [low - more, high + more]
    }

    /// Distance from the surface, interpolated, mm; positive inside.
    fn distance(&self, place: DVec3) -> f64 {
        match self {
            Body::Parallel { axes, through, sections, caps } => {
                let at = axes.transpose() * (place - *through);
                let (p, z) = (at.truncate(), at.z);
                let (first, last) = (sections[0].at, sections[sections.len() - 1].at);
                match z {
                    _ if z < first => caps[0].distance(p, first - z),
                    _ if z > last => caps[1].distance(p, z - last),
                    _ => {
                        let next = sections.partition_point(|section| section.at < z).clamp(1, sections.len() - 1);
                        let near = (next.saturating_sub(2)..(next + 2).min(sections.len())).collect::<Vec<_>>();
                        interpolated(z, near.iter().map(|n| (sections[*n].at, &sections[*n])), p)
                    }
                }
            }
            Body::Rotated { axes, through, halves } => {
                let at = axes.transpose() * (place - *through);
                let (angle, p) = (at.y.atan2(at.x).rem_euclid(TAU), DVec2::new(at.x.hypot(at.y), at.z));
                let (count, next) = (halves.len() as isize, halves.partition_point(|half| half.at < angle) as isize);
                let near = (next - 2..next + 2).map(|n| {
                    let half = &halves[n.rem_euclid(count) as usize];
                    (half.at + TAU * n.div_euclid(count) as f64, half)
                });
                interpolated(angle, near, p)
            }
        }
    }
}

/// Sections in order; those of one plane are joined.
fn joined(mut sections: Vec<Section>, same: f64) -> Vec<Section> {
    sections.sort_by(|a, b| a.at.total_cmp(&b.at));
    sections.dedup_by(|later, earlier| {
        let is_same = later.at - earlier.at < same;
        if is_same {
            earlier.polygons.append(&mut later.polygons);
        }
        is_same
    });
    sections
}

/// The polynomial through the distances of a point from the outlines of sections (Lagrange).
fn interpolated<'a>(at: f64, near: impl Iterator<Item = (f64, &'a Section)> + Clone, p: DVec2) -> f64 {
    let weight = |n: usize, own: f64| {
        let others = near.clone().enumerate().filter(|(other, _)| *other != n);
        others.map(|(_, (other, _))| (at - other) / (own - other)).product::<f64>()
    };
    near.clone().enumerate().map(|(n, (own, section))| weight(n, own) * section.distance(p)).sum()
}
