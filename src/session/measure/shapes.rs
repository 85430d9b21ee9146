//! Lengths, angles and areas of points in space. All in f64, in mm, mm^2 and degrees.

use crate::segment::sections::vector_area;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Length of an open path, mm.
pub fn length(path: &[DVec3]) -> f64 {
    path.windows(2).map(|ends| ends[0].distance(ends[1])).sum()
}

/// Length of a closed path, mm, whose last point is joined to its first.
pub(crate) fn perimeter(contour: &[DVec3]) -> f64 {
    match contour {
        [first, .., last] => length(contour) + last.distance(*first),
        _ => 0.0,
    }
}

/// The angle at `vertex` between the directions to the two other points, 0..=180 degrees; None if one of them is equal to the vertex.
pub fn angle(leg: DVec3, vertex: DVec3, other: DVec3) -> Option<f64> {
    let (a, b) = (leg - vertex, other - vertex);
    // Exact for small and for straight angles too, where the arc cosine is not.
    let is_one = a.length_squared() > 0.0 && b.length_squared() > 0.0;
    is_one.then(|| a.cross(b).length().atan2(a.dot(b)).to_degrees())
}

/// The area that a contour in a plane encloses, mm^2. If the contour crosses itself, parts of opposite sense are subtracted from each other.
pub fn area(contour: &[DVec3]) -> f64 {
    vector_area(contour).length()
}

/// An ellipse in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    pub centre: DVec3,
    /// The two semi-axes as vectors, perpendicular to each other, mm.
    pub semi: [DVec3; 2],
}

impl Ellipse {
    /// The ellipse of three points: the first two are the ends of one axis, and the distance of the third from that axis is the other semi-axis.
    /// None if an axis has no length.
    pub fn of(points: [DVec3; 3]) -> Option<Ellipse> {
        let [from, to, side] = points;
        let (centre, first) = ((from + to) / 2.0, (to - from) / 2.0);
        let second = (side - centre).reject_from(first);
        let is_one = first.length_squared() > 0.0 && second.is_finite() && second.length_squared() > 0.0;
        is_one.then_some(Ellipse { centre, semi: [first, second] })
    }

    /// Lengths of both axes, the longer one first, mm.
    pub fn axes(&self) -> [f64; 2] {
        let [a, b] = self.semi.map(|semi| 2.0 * semi.length());
        [a.max(b), a.min(b)]
    }

    /// Area of the ellipse, mm^2.
    pub fn area(&self) -> f64 {
        let [a, b] = self.axes();
        PI * a * b / 4.0
    }

    /// Circumference of the ellipse, mm, by the arithmetic-geometric mean, which gives the complete elliptic integral up to rounding.
    pub fn circumference(&self) -> f64 {
        let [mut a, mut b] = self.axes().map(|axis| axis / 2.0);
        let (mut sum, mut power) = (a * a - (a * a - b * b) / 2.0, 1.0);
        // Each step doubles the digits.
        for _ in 0..64 {
            let c = (a - b) / 2.0;
            (a, b) = ((a + b) / 2.0, (a * b).sqrt());
            sum -= power * c * c;
            power *= 2.0;
            if c <= 1e-16 * a {
                break;
            }
        }
        TAU * sum / a
    }

    /// `count` points on the ellipse, evenly spaced in its parameter.
    pub fn outline(&self, count: usize) -> impl Iterator<Item = DVec3> + '_ {
        let [first, second] = self.semi;
        (0..count).map(move |n| {
            let (sin, cos) = (TAU * n as f64 / count as f64).sin_cos();
            self.centre + first * cos + second * sin
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs().max(1e-12), "{a} is not {b}");
    }

    /// An oblique frame, so that no axis is special.
    fn placed(x: f64, y: f64) -> DVec3 {
        let right = DVec3::new(2.0, -1.0, 0.5).normalize();
        let up = right.cross(DVec3::new(0.3, 0.4, -1.0)).normalize();
        DVec3::new(700.0, -20.0, 3.0) + right * x + up * y
    }

    #[test]
    fn lengths_and_angles_have_their_known_values() {
        near(length(&[placed(0.0, 0.0), placed(3.0, 4.0), placed(3.0, 16.0)]), 17.0, 1e-12);
        near(perimeter(&[placed(0.0, 0.0), placed(3.0, 0.0), placed(3.0, 4.0)]), 12.0, 1e-12);
        assert_eq!((length(&[]), perimeter(&[DVec3::ONE])), (0.0, 0.0));
        for degrees in [1e-6, 30.0, 90.0, 135.0, 179.999_999, 180.0] {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let found = angle(placed(5.0, 0.0), placed(0.0, 0.0), placed(2.0 * cos, 2.0 * sin)).expect("an angle");
            assert!((found - degrees).abs() < 1e-8, "{found} is not {degrees}");
        }
        assert_eq!(angle(DVec3::ONE, DVec3::ONE, DVec3::X), None);
    }

    #[test]
    fn areas_of_polygons_are_those_of_the_shoelace_formula() {
        let corners = [[0.0, 0.0], [6.0, 0.0], [6.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]];
        let shape: Vec<DVec3> = corners.iter().map(|[x, y]| placed(*x, *y)).collect();
        near(area(&shape), 18.0, 1e-12);
        let back: Vec<DVec3> = shape.iter().rev().copied().collect();
        near(area(&back), 18.0, 1e-12);
        assert_eq!(area(&[]), 0.0);
        let circle: Vec<DVec3> = Ellipse::of([placed(-10.0, 0.0), placed(10.0, 0.0), placed(0.0, 10.0)])
            .expect("a circle")
            .outline(720)
            .collect();
        near(area(&circle), PI * 100.0, 2e-5);
        near(perimeter(&circle), TAU * 10.0, 1e-5);
    }

    #[test]
    fn ellipses_have_their_area_and_circumference() {
        let ellipse = |a: f64, b: f64| Ellipse::of([placed(-a, 0.0), placed(a, 0.0), placed(0.0, b)]).expect("one");
        near(ellipse(7.0, 7.0).circumference(), TAU * 7.0, 1e-13);
        // Abramowitz and Stegun, table 17.1: E(m = 0.5) = 1.350643881047675.
        near(ellipse(1.0, 0.5f64.sqrt()).circumference(), 4.0 * 1.350_643_881_047_675_5, 1e-13);
        // A flat one is its axis forth and back.
        near(ellipse(10.0, 1e-9).circumference(), 40.0, 1e-9);
        near(ellipse(3.0, 5.0).area(), PI * 15.0, 1e-12);
        let [long, short] = ellipse(3.0, 5.0).axes();
        near(long, 10.0, 1e-12);
        near(short, 6.0, 1e-12);
        // The third point gives the distance from the axis, wherever along it.
        near(Ellipse::of([placed(-4.0, 0.0), placed(4.0, 0.0), placed(3.0, 2.0)]).expect("one").axes()[1], 4.0, 1e-12);
        assert_eq!(Ellipse::of([DVec3::ONE; 3]), None);
        assert_eq!(Ellipse::of([DVec3::ZERO, DVec3::X, DVec3::X * 3.0]), None);
    }
}
