//! The outlines of body marks: smooth curves through a few points in a square from -1 to 1, right and down, seen from the front. Drawn for this
//! program.

use crate::scene::Body;

/// Pieces of a curve between two of its points.
const PIECES: usize = 6;

type Point = [f64; 2];

/// A line of an outline.
enum Line {
    /// Through these points, smooth.
    Open(&'static [Point]),
    /// The same, back to the first point.
    Closed(&'static [Point]),
    /// Through these points, with corners.
    Straight(&'static [Point]),
    /// Centre and radii.
    Ellipse(Point, Point),
}

use Line::{Closed, Ellipse, Open, Straight};

const SIDE: &[Line] =
    &[Open(&[[-0.70, -1.0], [-0.60, -0.55], [-0.50, -0.10], [-0.58, 0.30], [-0.68, 0.65], [-0.70, 1.0]])];
const GROIN: &[Line] = &[Open(&[[-0.52, 0.50], [-0.30, 0.72], [-0.10, 0.88]])];
const ABDOMEN: &[Line] = &[
    Open(&[[-0.40, -0.30], [-0.25, -0.62], [0.0, -0.78], [0.25, -0.62], [0.40, -0.30]]),
    Ellipse([0.0, 0.12], [0.05, 0.06]),
    Open(&[[-0.05, 1.0], [0.0, 0.86], [0.05, 1.0]]),
];

const WIDE_SIDE: &[Line] = &[
    Open(&[[-0.62, -1.0], [-0.66, -0.72], [-0.84, -0.30], [-0.90, 0.10], [-0.80, 0.52], [-0.74, 1.0]]),
    Open(&[[-0.50, 0.66], [-0.28, 0.86], [-0.08, 0.96]]),
];
/// Head down, its back on the left.
const FETUS: &[Line] = &[
    // Nape, skull, and the face down to the throat.
    Open(&[
        [-0.21, 0.24],
        [-0.26, 0.43],
        [-0.15, 0.60],
        [0.03, 0.64],
        [0.17, 0.54],
        [0.20, 0.42],
        [0.25, 0.35],
        [0.19, 0.31],
        [0.17, 0.21],
        [0.09, 0.16],
    ]),
    // Back and buttocks.
    Open(&[[-0.21, 0.24], [-0.31, 0.09], [-0.34, -0.15], [-0.26, -0.41], [-0.05, -0.53], [0.12, -0.48]]),
    // A leg, bent at hip and knee.
    Open(&[
        [0.12, -0.48],
        [0.29, -0.29],
        [0.34, -0.07],
        [0.28, -0.03],
        [0.19, -0.22],
        [0.22, -0.46],
        [0.31, -0.51],
        [0.26, -0.58],
        [0.12, -0.56],
    ]),
    // Chest, and an arm.
    Open(&[[0.09, 0.16], [0.12, 0.04], [0.10, -0.12], [0.17, -0.20]]),
    Open(&[[-0.09, 0.14], [-0.05, -0.03], [0.09, -0.07], [0.22, 0.09], [0.26, 0.17]]),
];

const UTERUS: &[Line] = &[
    Closed(&[
        [0.0, -0.62],
        [0.28, -0.58],
        [0.40, -0.36],
        [0.32, 0.0],
        [0.20, 0.30],
        [0.18, 0.62],
        [0.10, 0.74],
        [0.0, 0.76],
        [-0.10, 0.74],
        [-0.18, 0.62],
        [-0.20, 0.30],
        [-0.32, 0.0],
        [-0.40, -0.36],
        [-0.28, -0.58],
    ]),
    // The cavity and the canal.
    Straight(&[[-0.02, 0.60], [-0.03, 0.10], [-0.20, -0.42], [0.0, -0.37], [0.20, -0.42], [0.03, 0.10], [0.02, 0.60]]),
];
const ADNEXA: &[Line] = &[
    Open(&[[-0.38, -0.52], [-0.60, -0.66], [-0.82, -0.56], [-0.92, -0.34]]),
    Ellipse([-0.68, -0.16], [0.16, 0.11]),
    Open(&[[-0.18, 0.62], [-0.26, 0.80], [-0.26, 1.0]]),
];

const HEAD: &[Line] = &[
    Closed(&[
        [0.0, -0.86],
        [0.34, -0.74],
        [0.60, -0.36],
        [0.68, 0.08],
        [0.58, 0.52],
        [0.32, 0.82],
        [0.0, 0.90],
        [-0.32, 0.82],
        [-0.58, 0.52],
        [-0.68, 0.08],
        [-0.60, -0.36],
        [-0.34, -0.74],
    ]),
    Open(&[[-0.12, -0.86], [0.0, -1.0], [0.12, -0.86]]),
    // The great fontanelle, and the sutures from it.
    Straight(&[[0.0, -0.42], [0.14, -0.24], [0.0, -0.02], [-0.14, -0.24], [0.0, -0.42]]),
    Straight(&[[0.0, -0.02], [0.0, 0.46]]),
    Open(&[[-0.40, 0.62], [0.0, 0.46], [0.40, 0.62]]),
];
const SIDE_OF_HEAD: &[Line] = &[
    Open(&[[-0.67, -0.12], [-0.82, -0.10], [-0.80, 0.14], [-0.68, 0.20]]),
    Straight(&[[-0.14, -0.24], [-0.56, -0.16]]),
];

const NECK: &[Line] = &[
    Open(&[[-0.36, -0.72], [-0.20, -0.52], [0.0, -0.46], [0.20, -0.52], [0.36, -0.72]]),
    // The isthmus of the thyroid.
    Open(&[[-0.07, 0.14], [0.0, 0.17], [0.07, 0.14]]),
    Open(&[[-0.07, 0.28], [0.0, 0.25], [0.07, 0.28]]),
];
const SIDE_OF_NECK: &[Line] = &[
    Open(&[[-0.34, -1.0], [-0.36, -0.66], [-0.30, -0.10], [-0.36, 0.40], [-0.62, 0.64], [-1.0, 0.78]]),
    // A lobe of the thyroid, and a collar bone.
    Open(&[[-0.07, 0.14], [-0.20, -0.16], [-0.25, -0.06], [-0.23, 0.24], [-0.13, 0.38], [-0.07, 0.28]]),
    Open(&[[-0.80, 0.86], [-0.40, 0.80], [-0.08, 0.92]]),
];

const BREAST: &[Line] = &[
    Ellipse([0.12, 0.12], [0.72, 0.72]),
    Ellipse([0.12, 0.12], [0.17, 0.17]),
    Ellipse([0.12, 0.12], [0.05, 0.05]),
    // Towards the armpit.
    Open(&[[-0.60, 0.10], [-0.70, -0.30], [-0.88, -0.80]]),
    Open(&[[0.05, -0.60], [-0.35, -0.72], [-0.66, -1.0]]),
    // As on the face of a clock: 12, 6, 3 and 9.
    Straight(&[[0.12, -0.60], [0.12, -0.50]]),
    Straight(&[[0.12, 0.84], [0.12, 0.74]]),
    Straight(&[[0.84, 0.12], [0.74, 0.12]]),
    Straight(&[[-0.60, 0.12], [-0.50, 0.12]]),
];

/// The lines of the outline of a part of the body. Coordinates of their points are from -1 to 1, to the right and down.
pub(super) fn outline(body: Body) -> Vec<Vec<Point>> {
    // Lines that are there once, lines that are there on both sides, and by how many quarters a fetus is turned from head down.
    let (once, on_both, quarters): (&[&[Line]], &[&[Line]], Option<u8>) = match body {
        Body::Abdomen => (&[ABDOMEN], &[SIDE, GROIN], None),
        Body::FetusCephalic => (&[], &[WIDE_SIDE], Some(0)),
        Body::FetusBreech => (&[], &[WIDE_SIDE], Some(2)),
        Body::FetusTransverse => (&[], &[WIDE_SIDE], Some(1)),
        Body::Uterus => (&[UTERUS], &[ADNEXA], None),
        Body::Head => (&[HEAD], &[SIDE_OF_HEAD], None),
        Body::Neck => (&[NECK], &[SIDE_OF_NECK], None),
        Body::Breast => (&[BREAST], &[], None),
    };
    let mut found: Vec<Vec<Point>> = once.iter().copied().flatten().map(points).collect();
    for line in on_both.iter().copied().flatten().map(points) {
        found.push(line.iter().map(|[x, y]| [-x, *y]).collect());
        found.push(line);
    }
    if let Some(quarters) = quarters {
        let turned = |[x, y]: Point| (0..quarters).fold([x, y], |[x, y], _| [-y, x]);
        found.extend(FETUS.iter().map(|line| points(line).into_iter().map(turned).collect()));
    }
    found
}

/// The points of a line.
fn points(line: &Line) -> Vec<Point> {
    match line {
        Open(through) => smooth(through, false),
        Closed(through) => smooth(through, true),
        Straight(through) => through.to_vec(),
        Ellipse([x, y], [across, down]) => {
            let angles = (0..=36).map(|n| f64::from(n * 10).to_radians());
            angles.map(|angle| [x + across * angle.cos(), y + down * angle.sin()]).collect()
        }
    }
}

/// A Catmull-Rom curve through points.
fn smooth(through: &[Point], is_closed: bool) -> Vec<Point> {
    let count = through.len();
    let at = |n: usize, by: isize| -> Point {
        let n = n as isize + by;
        match is_closed {
            true => through[n.rem_euclid(count as isize) as usize],
            false => through[n.clamp(0, count as isize - 1) as usize],
        }
    };
    let spans = if is_closed { count } else { count.saturating_sub(1) };
    let mut found: Vec<Point> = Vec::with_capacity(spans * PIECES + 1);
    for n in 0..spans {
        let [a, b, c, d] = [at(n, -1), at(n, 0), at(n, 1), at(n, 2)];
        found.extend((0..PIECES).map(|piece| {
            let t = piece as f64 / PIECES as f64;
            std::array::from_fn(|i| {
                let [slope, bend] = [c[i] - a[i], 2.0 * a[i] - 5.0 * b[i] + 4.0 * c[i] - d[i]];
                b[i] + 0.5 * t * (slope + t * (bend + t * (3.0 * b[i] - a[i] - 3.0 * c[i] + d[i])))
            })
        }));
    }
    found.extend(if is_closed { through.first() } else { through.last() });
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outline_lies_in_its_square_and_no_two_are_equal() {
        let all = Body::ALL.map(outline);
        for (body, lines) in Body::ALL.iter().zip(&all) {
            assert!(lines.len() > 5, "{body:?}");
            for [x, y] in lines.iter().flatten() {
                assert!(x.abs() <= 1.01 && y.abs() <= 1.01, "{body:?}: {x}, {y}");
            }
        }
        assert!((1..8).all(|n| !all[..n].contains(&all[n])));
    }

    #[test]
    fn a_smooth_line_passes_its_points_and_a_closed_one_comes_back() {
        let through = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for is_closed in [false, true] {
            let line = smooth(&through, is_closed);
            assert!(through.iter().all(|point| line.contains(point)));
            assert_eq!(line.first() == line.last(), is_closed);
        }
        // The middle between two points of a circle is on it within the error of the spline: 0.2 % at 30 degrees.
        let circle: Vec<_> = (0..12).map(|n| f64::from(n * 30).to_radians().sin_cos()).map(|(s, c)| [c, s]).collect();
        assert!(smooth(&circle, true).iter().all(|[x, y]| (x.hypot(*y) - 1.0).abs() < 2e-3));
    }

    #[test]
    fn a_fetus_has_its_head_where_its_name_says() {
        // The first line of a fetus is that of its head; its fourth point is on the vertex.
        let skull =
            |body| outline(body).iter().rev().nth(FETUS.len() - 1).map(|line| line[3 * PIECES]).expect("a head");
        let (cephalic, breech, across) =
            (skull(Body::FetusCephalic), skull(Body::FetusBreech), skull(Body::FetusTransverse));
        assert!(cephalic[1] > 0.5 && breech[1] < -0.5 && across[0] < -0.5, "{cephalic:?} {breech:?} {across:?}");
    }
}
