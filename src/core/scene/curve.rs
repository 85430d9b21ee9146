//! A smooth line through points of a plane, by arc length: each segment is a cubic, and at a point the line has the direction of the parabola
//! through it and its neighbours. Parameters grow with the square root of the distance between points (centripetal Catmull-Rom), so that a line through
//! unevenly spaced points has no loops of its own. Two points make a straight line.

use glam::DVec2;

/// Pieces of a segment whose lengths are added up.
const PIECES: usize = 16;
/// Nodes and weights of Gauss-Legendre quadrature over 0..1: a piece of a cubic is exact to 1e-9 of its length.
const GAUSS: [[f64; 2]; 5] = [
    [0.046_910_077_030_668, 0.118_463_442_528_095],
    [0.230_765_344_947_158, 0.239_314_335_249_683],
    [0.5, 0.284_444_444_444_444],
    [0.769_234_655_052_842, 0.239_314_335_249_683],
    [0.953_089_922_969_332, 0.118_463_442_528_095],
];

/// A segment: its ends, and the derivatives there by its own parameter 0..1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    from: DVec2,
    to: DVec2,
    leaves: DVec2,
    arrives: DVec2,
}

impl Segment {
    fn at(&self, t: f64) -> DVec2 {
        let (u, t2) = (1.0 - t, t * t);
        let (near, far) = (u * u * (1.0 + 2.0 * t), t2 * (3.0 - 2.0 * t));
        self.from * near + self.to * far + self.leaves * (t * u * u) - self.arrives * (t2 * u)
    }

    fn velocity(&self, t: f64) -> DVec2 {
        let u = 1.0 - t;
        (self.to - self.from) * (6.0 * t * u)
            + self.leaves * (u * (1.0 - 3.0 * t))
            + self.arrives * (t * (3.0 * t - 2.0))
    }

    /// Length between two parameters.
    fn length(&self, from: f64, to: f64) -> f64 {
        let speed = |[node, weight]: [f64; 2]| self.velocity(from + (to - from) * node).length() * weight;
        (to - from) * GAUSS.into_iter().map(speed).sum::<f64>()
    }
}

/// A smooth line in a plane, mm. Positions on it are found by their distance along the line.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    segments: Vec<Segment>,
    /// Distance along the line at the start of each piece, and its end; mm.
    starts: Vec<f64>,
    /// The places there; none of a line without length.
    places: Vec<DVec2>,
}

impl Line {
    /// The line through points. Consecutive points must differ; fewer than two points make a line without length.
    pub fn through(points: &[[f64; 2]]) -> Line {
        let points: Vec<DVec2> = points.iter().map(|point| DVec2::from(*point)).collect();
        let steps: Vec<f64> = points.windows(2).map(|p| p[0].distance(p[1]).sqrt()).collect();
        let slopes: Vec<DVec2> = points.windows(2).zip(&steps).map(|(p, step)| (p[1] - p[0]) / step).collect();
        // The derivative of the parabola through three neighbours, at the middle one; at an end that of the nearest parabola.
        let inner = |n: usize| (slopes[n - 1] * steps[n] + slopes[n] * steps[n - 1]) / (steps[n - 1] + steps[n]);
        let derivative = |n: usize| match (n, slopes.len()) {
            (_, 1) => slopes[0],
            (0, _) => slopes[0] * 2.0 - inner(1),
            (n, count) if n == count => slopes[n - 1] * 2.0 - inner(n - 1),
            (n, _) => inner(n),
        };
        let segment = |n: usize| Segment {
            from: points[n],
            to: points[n + 1],
            leaves: derivative(n) * steps[n],
            arrives: derivative(n + 1) * steps[n],
        };
        let segments: Vec<Segment> = (0..steps.len()).map(segment).collect();
        let mut starts = vec![0.0];
        for segment in &segments {
            for piece in 0..PIECES {
                let [from, to] = [piece, piece + 1].map(|n| n as f64 / PIECES as f64);
                starts.push(starts.last().copied().unwrap_or(0.0) + segment.length(from, to));
            }
        }
        let mut line = Line { segments, starts, places: Vec::new() };
        let starts = (0..line.starts.len()).filter_map(|n| line.start_of(n));
        line.places = starts.map(|(segment, t)| segment.at(t)).collect();
        line
    }

    /// Length of the line, mm.
    pub fn length(&self) -> f64 {
        self.starts.last().copied().unwrap_or(0.0)
    }

    /// Position and unit direction at a distance along the line, mm. A distance beyond an end is clamped to it. A line without length gives (0, 0)
    /// and the x axis.
    pub fn at(&self, along: f64) -> (DVec2, DVec2) {
        let along = along.clamp(0.0, self.length());
        let piece = self.starts.partition_point(|start| *start <= along).clamp(1, self.starts.len().max(2) - 1) - 1;
        let Some(segment) = self.segments.get(piece / PIECES) else { return (DVec2::ZERO, DVec2::X) };
        let [from, to] = [piece % PIECES, piece % PIECES + 1].map(|n| n as f64 / PIECES as f64);
        let (rest, whole) = (along - self.starts[piece], self.starts[piece + 1] - self.starts[piece]);
        let mut t = from + (to - from) * if whole > 0.0 { rest / whole } else { 0.0 };
        for _ in 0..4 {
            let speed = segment.velocity(t).length();
            if speed > 0.0 {
                t = (t - (segment.length(from, t) - rest) / speed).clamp(from, to);
            }
        }
        // Where the line turns back on itself it has no direction: that of its segment serves.
        let direction = segment.velocity(t).try_normalize().or((segment.to - segment.from).try_normalize());
        (segment.at(t), direction.unwrap_or(DVec2::X))
    }

    /// The point of the line that is nearest to `point`, as its distance along the line, and how far it is from `point`; mm. (0, infinity) for a line
    /// without length.
    pub fn nearest(&self, point: DVec2) -> (f64, f64) {
        self.near(point, 0.0).into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, f64::INFINITY))
    }

    /// True if two different stretches of the line pass `point` within `reach` mm.
    pub(crate) fn passes_twice(&self, point: DVec2, reach: f64) -> bool {
        let near: Vec<f64> =
            self.near(point, reach).into_iter().filter(|(_, off)| *off <= reach).map(|(along, _)| along).collect();
        // Two pieces beside each other are one passage.
        let [low, high] = [f64::min, f64::max].map(|of| near.iter().copied().reduce(of).unwrap_or(0.0));
        high - low > 4.0 * reach
    }

    /// The place nearest to a point in each piece that may hold the nearest of all, or one that is farther than that by `more` at most: the distance along
    /// the line and from the point. In a piece that distance has one minimum, unless the line turns sharply.
    fn near(&self, point: DVec2, more: f64) -> Vec<(f64, f64)> {
        let away: Vec<f64> = self.places.iter().map(|place| place.distance(point)).collect();
        let nearest = away.iter().copied().fold(f64::INFINITY, f64::min);
        let may_hold = |piece: &usize| {
            // No place of a piece is nearer than an end by more than half its length.
            let half = (self.starts[piece + 1] - self.starts[*piece]) / 2.0;
            away[*piece].min(away[piece + 1]) - half <= nearest + more
        };
        let within = |piece: usize| {
            let segment = self.segments.get(piece / PIECES)?;
            let start = (piece % PIECES) as f64 / PIECES as f64;
            let (mut low, mut high) = (start, start + 1.0 / PIECES as f64);
            for _ in 0..50 {
                let third = (high - low) / 3.0;
                match segment.at(low + third).distance_squared(point)
                    <= segment.at(high - third).distance_squared(point)
                {
                    true => high -= third,
                    false => low += third,
                }
            }
            let t = (low + high) / 2.0;
            Some((self.starts[piece] + segment.length(start, t), segment.at(t).distance(point)))
        };
        (0..self.places.len().saturating_sub(1)).filter(may_hold).filter_map(within).collect()
    }

    /// The segment of a piece and its parameter at the start of the piece; behind the last piece the end of the line.
    fn start_of(&self, piece: usize) -> Option<(&Segment, f64)> {
        match self.segments.get(piece / PIECES) {
            Some(segment) => Some((segment, (piece % PIECES) as f64 / PIECES as f64)),
            None => self.segments.last().map(|last| (last, 1.0)),
        }
    }

    /// Points along the line, close enough to draw it by straight pieces. Empty for a line without length.
    pub fn outline(&self) -> Vec<DVec2> {
        let straight = self.segments.len() == 1;
        self.places.iter().copied().step_by(if straight { PIECES } else { 1 }).collect()
    }

    /// The unit direction from the first point to the last, if the whole line deviates from it by at most 45 degrees; else None.
    pub fn heading(&self) -> Option<DVec2> {
        let (first, last) = (self.segments.first()?, self.segments.last()?);
        let chord = (last.to - first.from).try_normalize()?;
        let mut starts = (0..self.starts.len()).filter_map(|n| self.start_of(n));
        let along = |(segment, t): (&Segment, f64)| segment.velocity(t).normalize_or_zero().dot(chord);
        starts.all(|start| along(start) >= std::f64::consts::FRAC_1_SQRT_2).then_some(chord)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(radius: f64, degrees: f64, points: usize) -> Vec<[f64; 2]> {
        let at = |n: usize| (degrees * n as f64 / (points - 1) as f64).to_radians();
        (0..points).map(|n| [radius * at(n).sin(), 60.0 - radius * at(n).cos()]).collect()
    }

    #[test]
    fn two_points_make_a_straight_line_of_their_distance() {
        let line = Line::through(&[[-3.0, 10.0], [9.0, 26.0]]);
        assert!((line.length() - 20.0).abs() < 1e-12);
        for along in [0.0, 3.7, 10.0, 20.0] {
            let (at, direction) = line.at(along);
            let wanted = DVec2::new(-3.0, 10.0) + DVec2::new(0.6, 0.8) * along;
            assert!(at.distance(wanted) < 1e-10 && direction.distance(DVec2::new(0.6, 0.8)) < 1e-12, "{along}: {at}");
        }
        assert_eq!(line.outline().len(), 2);
        assert_eq!(line.at(-5.0).0, DVec2::new(-3.0, 10.0), "before the start is the start");
        assert!(line.heading().is_some_and(|h| h.distance(DVec2::new(0.6, 0.8)) < 1e-12));
    }

    /// A circle is no cubic: with a point each 15 degrees the line stays within 0.02 mm of it, by length and place.
    #[test]
    fn a_line_through_points_of_an_arc_has_its_length() {
        let (radius, degrees) = (25.0, 150.0f64);
        let line = Line::through(&arc(radius, degrees, 11));
        let truth = radius * degrees.to_radians();
        assert!((line.length() - truth).abs() < 0.02, "{} of {truth}", line.length());
        for n in 0..=100 {
            let along = line.length() * f64::from(n) / 100.0;
            let (at, _) = line.at(along);
            let angle = along / radius;
            let wanted = DVec2::new(radius * angle.sin(), 60.0 - radius * angle.cos());
            assert!(at.distance(wanted) < 0.05, "{along}: {}", at.distance(wanted));
            let (found, away) = line.nearest(at);
            assert!((found - along).abs() < 1e-4 && away < 1e-6, "{along}: {found} {away}");
        }
        assert!(line.heading().is_none(), "it bends by 150 degrees");
        assert!(Line::through(&arc(radius, 60.0, 5)).heading().is_some());
    }

    #[test]
    fn the_line_passes_its_points_and_is_measured_by_length() {
        let points = [[0.0, 0.0], [1.0, 0.2], [14.0, -6.0], [15.0, 4.0], [40.0, 5.0]];
        let line = Line::through(&points);
        for point in points {
            let (_, away) = line.nearest(DVec2::from(point));
            assert!(away < 1e-6, "{point:?}: {away}");
        }
        // Equal steps along it are equally long: 1e-3 of them are chords.
        let count = 4000;
        let step = line.length() / f64::from(count);
        let at = |n: i32| line.at(step * f64::from(n)).0;
        let worst = (0..count).map(|n| (at(n).distance(at(n + 1)) / step - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-3, "{worst}");
        // A line that turns back on itself has a place and a direction everywhere.
        let back = Line::through(&[[0.0, 0.0], [10.0, 0.0], [0.0, 0.0]]);
        for n in 0..=50 {
            let (at, direction) = back.at(back.length() * f64::from(n) / 50.0);
            assert!(at.is_finite() && (direction.length() - 1.0).abs() < 1e-9);
        }
    }

    /// Prevents a length that is measured to the other passage of a line that crosses itself, or to the other end of one that is closed.
    #[test]
    fn the_nearest_place_is_found_where_strands_pass_each_other() {
        // Nearer to a vertex of one strand than to any of the other, on which the point lies.
        let line = Line::through(&[[0.0, 0.0], [40.0, 0.0], [44.0, 20.0], [20.0, 30.0], [19.0, 4.0], [19.5, -20.0]]);
        for n in 0..=400 {
            let along = line.length() * f64::from(n) / 400.0;
            let (at, _) = line.at(along);
            let (found, away) = line.nearest(at);
            assert!(away < 1e-6, "{along}: {away}");
            let twice = line.passes_twice(at, 0.5);
            assert!(twice || (found - along).abs() < 1e-3, "{along}: {found}");
        }
        let crossing =
            (0..2000).map(|n| line.length() * f64::from(n) / 2000.0).filter(|s| line.passes_twice(line.at(*s).0, 0.5));
        let crossing: Vec<f64> = crossing.collect();
        assert!(!crossing.is_empty() && crossing.len() < 100, "{crossing:?}");
        let closed = Line::through(&[[0.0, 0.0], [30.0, 0.0], [15.0, 25.0], [0.0, 0.0]]);
        assert!(closed.passes_twice(DVec2::ZERO, 0.5) && !closed.passes_twice(closed.at(40.0).0, 0.5));
    }
}
