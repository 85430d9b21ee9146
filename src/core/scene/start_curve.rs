//! The curved render start: a line of depth over lateral position, the same at every elevation, above which nothing is rendered.
//!
//! Between its points the line is a monotone cubic (Fritsch and Carlson 1980, with the slopes of Fritsch and Butland 1984; SciPy's
//! `PchipInterpolator` is the same). It has no corners at its points and never leaves the depths of the two points that it is between: where
//! neighbours have the same depth it is level, and it turns at points only. Beyond its ends it stays at their depths.

use super::{MAX_START_POINTS, MIN_START_POINTS, Scene, SceneError, Settings, refuse, region};
use glam::DVec3;

/// Least lateral distance of neighbouring points, as a share of the distance from the first to the last: a micrometre of a curve over 100 mm.
const LEAST_GAP: f64 = 1e-5;

/// The start curve: the depth at which rendering starts as a smooth function of the lateral position, at any elevation. Depths are counted as those
/// of the points that it is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct StartCurve {
    /// Lateral, and depth from wherever depths count: mm, ascending.
    points: Vec<[f64; 2]>,
    /// Depth over lateral position at each point.
    slopes: Vec<f64>,
}

impl StartCurve {
    /// The monotone cubic through points (lateral, depth), mm, whose lateral positions ascend.
    pub fn new(points: &[[f64; 2]]) -> StartCurve {
        let spans: Vec<(f64, f64)> = points.windows(2).map(|two| span(two[0], two[1])).collect();
        let slope = |n: usize| match (n.checked_sub(1).and_then(|before| spans.get(before)), spans.get(n)) {
            (Some(before), Some(behind)) => inner_slope(*before, *behind),
            (None, Some(first)) => spans.get(1).map_or(first.1, |next| end_slope(*first, *next)),
            (Some(last), None) => n.checked_sub(2).map_or(last.1, |other| end_slope(*last, spans[other])),
            (None, None) => 0.0,
        };
        StartCurve { points: points.to_vec(), slopes: (0..points.len()).map(slope).collect() }
    }

    /// The depth at which rendering starts at a lateral position, mm; counted like the depths of the points of [`StartCurve::new`].
    pub fn depth(&self, lateral: f64) -> f64 {
        let behind = self.points.partition_point(|point| point[0] <= lateral);
        let Some(n) = behind.checked_sub(1) else { return self.points.first().map_or(0.0, |first| first[1]) };
        let Some(([x0, from], [x1, to])) = self.points.get(n).copied().zip(self.points.get(behind).copied()) else {
            return self.points[n][1];
        };
        let length = x1 - x0;
        let t = (lateral - x0) / length;
        let s = 1.0 - t;
        // Hermite's cubic, by the share of the way and by what is left of it.
        let ends = from * (1.0 + 2.0 * t) * s * s + to * (1.0 + 2.0 * s) * t * t;
        ends + length * t * s * (self.slopes[n] * s - self.slopes[behind] * t)
    }
}

/// Length and slope of the straight line between two points.
fn span(from: [f64; 2], to: [f64; 2]) -> (f64, f64) {
    (to[0] - from[0], (to[1] - from[1]) / (to[0] - from[0]))
}

/// The slope at a point between two spans: their weighted harmonic mean, or 0 where the line turns.
fn inner_slope((h0, d0): (f64, f64), (h1, d1): (f64, f64)) -> f64 {
    if d0 * d1 <= 0.0 {
        return 0.0;
    }
    let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
    (w0 + w1) / (w0 / d0 + w1 / d1)
}

/// The slope at an end: that of the parabola through three points, as far as the line stays monotone.
fn end_slope((h0, d0): (f64, f64), (h1, d1): (f64, f64)) -> f64 {
    let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    if slope * d0 <= 0.0 {
        0.0
    } else if d0 * d1 <= 0.0 && slope.abs() > 3.0 * d0.abs() {
        3.0 * d0
    } else {
        slope
    }
}

impl Scene {
    /// True if the rendering starts at a curve (`region.start_curve`). Planes and the block of mode cube show everything.
    pub(crate) fn starts_at_curve(&self) -> bool {
        self.settings.region.start_curve.is_some() && self.renders()
    }

    /// The start curve with depths converted to Y in space. None if the rendering has none.
    pub fn start_curve(&self) -> Option<StartCurve> {
        let points = self.settings.region.start_curve.as_ref().filter(|_| self.starts_at_curve())?;
        let offset = region::depth_offset(&self.geometry);
        Some(StartCurve::new(&points.iter().map(|[lateral, depth]| [*lateral, depth + offset]).collect::<Vec<_>>()))
    }

    /// For each column and slice of the volume, the column fastest, the first row that is not in front of the start curve, or the number of rows if
    /// all are. All 0 without a curve.
    pub fn start_curve_rows(&self) -> Vec<u32> {
        let [columns, rows] = self.grid.size;
        let Some(curve) = self.start_curve() else { return vec![0; (columns * self.slices()) as usize] };
        let is_before = |texel: [u32; 3]| is_before(&curve, self.texel_place(texel));
        let mut row = 0;
        let texels = (0..self.slices()).flat_map(|slice| (0..columns).map(move |column| (column, slice)));
        texels
            .map(|(column, slice)| {
                // Depth grows with the row, and neighbours start at similar rows.
                while row > 0 && !is_before([column, row - 1, slice]) {
                    row -= 1;
                }
                while row < rows && is_before([column, row, slice]) {
                    row += 1;
                }
                row
            })
            .collect()
    }

    /// True if the start curve gives the other scene other start rows.
    pub(crate) fn start_curve_differs(&self, other: &Scene) -> bool {
        self.start_curve() != other.start_curve() || self.geometry != other.geometry || self.grid != other.grid
    }
}

/// True if a place in space, mm, is nearer to the probe than `curve`, whose depths are Y in space like those of [`Scene::start_curve`].
pub fn is_before(curve: &StartCurve, place: DVec3) -> bool {
    place.y < curve.depth(place.x)
}

/// Checks the points of the curve as far as no geometry is needed.
pub(super) fn check(settings: &Settings) -> Result<(), SceneError> {
    const FIELD: &str = "region.start_curve";
    let Some(points) = &settings.region.start_curve else { return Ok(()) };
    if !(MIN_START_POINTS..=MAX_START_POINTS).contains(&points.len()) {
        let count = points.len();
        return refuse(FIELD, format!("has {count} points, must have {MIN_START_POINTS} to {MAX_START_POINTS}"));
    }
    let width = points.iter().map(|point| (point[0] - points[0][0]).abs()).fold(0.0, f64::max);
    for (n, two) in points.windows(2).enumerate() {
        let ([before, _], [lateral, _]) = (two[0], two[1]);
        if lateral <= before || lateral - before < LEAST_GAP * width {
            return refuse(
                FIELD,
                format!(
                    "point {}: lateral {lateral} mm must be more than that of the point before, {before} mm, by at least {LEAST_GAP:e} of the line's width",
                    n + 2
                ),
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(points: &[[f64; 2]]) -> Option<String> {
        let mut settings = Settings::default();
        settings.region.start_curve = Some(points.to_vec());
        settings.check().err().map(|fault| fault.to_string())
    }

    #[test]
    fn wrong_curves_are_refused_in_one_line_that_says_what_is_allowed() {
        let points = |count: usize| (0..count).map(|n| [n as f64, 20.0]).collect::<Vec<_>>();
        assert!((3..=5).all(|count| fault(&points(count)).is_none()));
        for (wrong, said) in [
            (points(0), "has 0 points, must have 3 to 5"),
            (points(2), "has 2 points, must have 3 to 5"),
            (points(6), "has 6 points, must have 3 to 5"),
            (vec![[0.0, 20.0], [f64::NAN, 20.0], [9.0, 20.0]], "is NaN, must lie in"),
            (vec![[0.0, 20.0], [4.0, f64::INFINITY], [9.0, 20.0]], "is inf, must lie in"),
            (
                vec![[0.0, 20.0], [4.0, 20.0], [4.0, 21.0]],
                "point 3: lateral 4 mm must be more than that of the point before, 4 mm",
            ),
            (vec![[0.0, 20.0], [-4.0, 20.0], [9.0, 20.0]], "point 2: lateral -4 mm"),
        ] {
            let fault = fault(&wrong).expect("refused");
            assert!(fault.starts_with("scene: region.start_curve: ") && fault.contains(said), "{fault}");
            assert!(!fault.contains('\n'));
        }
    }

    /// Known answers: of `PchipInterpolator` of SciPy 1.17.1, of a parabola through three points, and of a straight line.
    #[test]
    fn the_curve_is_the_monotone_cubic() {
        let four: &[[f64; 2]] = &[[-9.0, 20.0], [-2.0, 26.0], [3.0, 24.0], [11.0, 31.0]];
        let of_four = [22.181268221574346, 25.459669582118565, 25.0, 24.208, 24.47139423076923, 28.03918269230769];
        let five: &[[f64; 2]] = &[[-9.0, 20.0], [-8.0, 21.0], [3.0, 29.0], [11.0, 29.0], [12.0, 2.0]];
        let of_five = [20.517749165971644, 24.830850777852067, 28.334845153330257, 28.886461858711456, 29.0, 19.25];
        for (points, lateral, expected) in
            [(four, [-7.5, -4.0, 0.5, 2.0, 5.0, 9.0], of_four), (five, [-8.5, -4.0, 0.5, 2.0, 5.0, 11.5], of_five)]
        {
            let curve = StartCurve::new(points);
            let depths = lateral.map(|x| curve.depth(x));
            assert!(depths.iter().zip(expected).all(|(got, wanted)| (got - wanted).abs() < 1e-12), "{depths:?}");
        }
        let arc = StartCurve::new(&[[-10.0, 20.0], [0.0, 30.0], [10.0, 20.0]]);
        for n in -100..=100 {
            let x = f64::from(n) / 10.0;
            assert!((arc.depth(x) - (30.0 - x * x / 10.0)).abs() < 1e-12, "{x}");
        }
        let line = StartCurve::new(&[[-10.0, 20.0], [-4.0, 23.0], [0.0, 25.0], [10.0, 30.0]]);
        assert!((-100..=100).all(|n| (line.depth(f64::from(n) / 10.0) - (25.0 + f64::from(n) / 20.0)).abs() < 1e-12));
        assert_eq!([-1e9, -10.0, 10.0, 1e9].map(|x| line.depth(x)), [20.0, 20.0, 30.0, 30.0], "level beyond its ends");
    }

    /// Prevents a line that bulges beyond what the user drew: between two points it stays between their depths, and does not turn.
    #[test]
    fn the_curve_never_overshoots_and_has_no_corners() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        for case in 0..500 {
            let mut lateral = -20.0;
            let points: Vec<[f64; 2]> = (0..3 + case % 3)
                .map(|_| {
                    lateral += 0.01 + 15.0 * random() * random();
                    [lateral, 60.0 * random()]
                })
                .collect();
            let curve = StartCurve::new(&points);
            for (n, two) in points.windows(2).enumerate() {
                let (x0, x1) = (two[0][0], two[1][0]);
                let depths: Vec<f64> = (0..=64).map(|k| curve.depth(x0 + (x1 - x0) * f64::from(k) / 64.0)).collect();
                assert!((depths[0] - two[0][1]).abs() < 1e-9 && (depths[64] - two[1][1]).abs() < 1e-9, "{points:?}");
                let sign = (two[1][1] - two[0][1]).signum();
                assert!(depths.windows(2).all(|d| (d[1] - d[0]) * sign > -1e-9), "{points:?}");
                if n > 0 {
                    let step = 1e-7 * (x1 - x0).min(x0 - points[n - 1][0]);
                    let [left, right] = [-step, step].map(|by| (curve.depth(x0 + by) - curve.depth(x0)) / by);
                    assert!(
                        (left - right).abs() <= 1e-2 * (1.0 + left.abs() + right.abs()),
                        "{points:?}: {left} {right}"
                    );
                }
            }
        }
    }
}
