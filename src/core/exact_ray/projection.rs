//! The largest, the smallest and the mean value of the field along a ray, exactly: the field is a polynomial on each segment.

use super::field::Segment;
use super::volume::cut;
use crate::scene::Mode;

/// Positive nodes and weights of the Gauss-Legendre rule of four nodes on -1..1, exact up to degree 7 (Abramowitz and Stegun 1964,
/// table 25.4).
const GAUSS_4: [[f64; 2]; 2] =
    [[0.339_981_043_584_856_26, 0.652_145_154_862_546_1], [0.861_136_311_594_052_6, 0.347_854_845_137_453_85]];

/// The value of a ray in a projection, clamped to 0..1. None if `segments` is empty. MinIP takes the smallest value, the mean is taken over the
/// length inside the insonified region, and every other mode takes the largest value.
pub fn projected(segments: &[Segment], mode: Mode) -> Option<f64> {
    if segments.is_empty() {
        return None;
    }
    match mode {
        Mode::Mean => {
            let length: f64 = segments.iter().map(|s| s.to - s.from).sum();
            Some(segments.iter().map(integral).sum::<f64>() / length)
        }
        Mode::MinIp => Some(1.0 - largest(segments, -1.0, 1.0)),
        _ => Some(largest(segments, 1.0, 0.0)),
    }
}

/// The largest value of offset + sign times the field, clamped to 0..1.
fn largest(segments: &[Segment], sign: f64, offset: f64) -> f64 {
    let mut best = f64::MIN;
    let mut places = Vec::new();
    for segment in segments {
        let [low, high] = segment.field.range();
        if offset + (sign * low).max(sign * high) <= best {
            continue;
        }
        places.clear();
        segment.field.slope().roots(&mut places);
        places.extend([-1.0, 1.0]);
        best = places.iter().map(|x| offset + sign * segment.field.at(*x)).fold(best, f64::max);
    }
    best.clamp(0.0, 1.0)
}

/// Integral over a segment of its field clamped to 0..1, mm.
pub(super) fn integral(segment: &Segment) -> f64 {
    let mut cuts = Vec::new();
    cut(segment, &[0.0, 1.0], &mut cuts);
    cuts.windows(2).map(|pair| integral_between(segment, pair[0], pair[1])).sum()
}

/// Integral of the clamped field between two positions (-1..1) of a segment, mm. The field must not cross 0 or 1 between them.
pub(super) fn integral_between(segment: &Segment, from: f64, to: f64) -> f64 {
    let half = (to - from) / 2.0;
    let value = |x: f64| segment.field.at(from + half * (1.0 + x)).clamp(0.0, 1.0);
    let sum: f64 = GAUSS_4.iter().map(|[x, weight]| weight * (value(-x) + value(*x))).sum();
    sum * half * segment.half()
}
