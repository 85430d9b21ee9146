//! Body marks on a picture: the positions of their outlines and of the probe on them, in pixels, and which part is under the pointer. The
//! viewer and written pictures draw the same.

use super::body_outlines::outline;
use crate::scene::BodyMark;

/// Half the length of the probe's bar, and the radius of the dot at its marked end, in units in which the square of a mark is from -1 to 1.
const HALF_BAR: f64 = 0.26;
const DOT: f64 = 0.09;
/// Distance between a mark and the edge of the picture, as a share of the picture's shorter edge.
const MARGIN: f64 = 0.01;

/// The drawing of a body mark. Positions and lengths are in pixels of the picture, from its upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Index of the mark in the list of body marks.
    pub index: usize,
    /// Upper left corner of the mark's square; its side length is `edge`.
    pub corner: [f64; 2],
    pub edge: f64,
    /// The lines of the body's outline.
    pub outline: Vec<Vec<[f64; 2]>>,
    /// The ends of the probe's bar: the one with the marker, and the other one.
    pub probe: [[f64; 2]; 2],
    /// Radius of the dot at the marked end of the probe.
    pub dot: f64,
}

/// A part of a body mark that can be dragged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The bar of the probe.
    Probe,
    /// The rest of the mark's square.
    Body,
}

/// The square of a mark on a picture of this size: upper left corner and edge, pixels. It is never beyond the edges of the picture.
fn square(mark: &BodyMark, picture: [f64; 2]) -> ([f64; 2], f64) {
    let shorter = picture[0].min(picture[1]);
    let (edge, margin) = (mark.size * shorter, MARGIN * shorter);
    let corner =
        |a: usize| (mark.at[a] * picture[a] - edge / 2.0).clamp(margin, (picture[a] - edge - margin).max(margin));
    ([corner(0), corner(1)], edge)
}

/// Computes the drawings of body marks on a picture of size `picture` (width, height), pixels.
pub fn drawn(marks: &[BodyMark], picture: [f64; 2]) -> Vec<Drawn> {
    let one = |(index, mark): (usize, &BodyMark)| {
        let (corner, edge) = square(mark, picture);
        let pixel = |[x, y]: [f64; 2]| [corner[0] + (x + 1.0) / 2.0 * edge, corner[1] + (y + 1.0) / 2.0 * edge];
        let side = if mark.mirrored { -1.0 } else { 1.0 };
        let lines = outline(mark.body).into_iter();
        let outline = lines.map(|line| line.into_iter().map(|[x, y]| pixel([side * x, y])).collect()).collect();
        let (sin, cos) = mark.angle.to_radians().sin_cos();
        let end = |by: f64| pixel([mark.probe[0] + by * sin, mark.probe[1] - by * cos]);
        Drawn { index, corner, edge, outline, probe: [end(HALF_BAR), end(-HALF_BAR)], dot: DOT * edge / 2.0 }
    };
    marks.iter().enumerate().map(one).collect()
}

/// The index of the body mark at a pixel of the picture, and the part of it that is there. `reach`: largest distance from the probe at which the
/// pixel counts as on it, pixels. Of overlapping marks the last one counts, which is drawn on top. None if there is none at the pixel.
pub fn part_at(marks: &[BodyMark], picture: [f64; 2], pixel: [f64; 2], reach: f64) -> Option<(usize, Part)> {
    let part = |drawn: &Drawn| {
        let [a, b] = drawn.probe;
        let middle = [0, 1].map(|i| (a[i] + b[i]) / 2.0);
        let along = [b[0] - a[0], b[1] - a[1]];
        let from = [pixel[0] - middle[0], pixel[1] - middle[1]];
        let squared = along[0] * along[0] + along[1] * along[1];
        let share = ((from[0] * along[0] + from[1] * along[1]) / squared.max(1e-12)).clamp(-0.5, 0.5);
        let off = (from[0] - share * along[0]).hypot(from[1] - share * along[1]);
        if off <= reach {
            return Some(Part::Probe);
        }
        let is_in = (0..2).all(|i| (drawn.corner[i]..=drawn.corner[i] + drawn.edge).contains(&pixel[i]));
        is_in.then_some(Part::Body)
    };
    drawn(marks, picture).iter().rev().find_map(|drawn| Some((drawn.index, part(drawn)?)))
}

/// The mark with its probe moved to a pixel of the picture, or to the nearest position within its square.
pub fn with_probe_at(mark: &BodyMark, picture: [f64; 2], pixel: [f64; 2]) -> BodyMark {
    let (corner, edge) = square(mark, picture);
    let probe = [0, 1].map(|i| short(((pixel[i] - corner[i]) / edge * 2.0 - 1.0).clamp(-1.0, 1.0)));
    BodyMark { probe, ..*mark }
}

/// The middle of the probe of a mark, in pixels of the picture.
pub fn probe_of(mark: &BodyMark, picture: [f64; 2]) -> [f64; 2] {
    let (corner, edge) = square(mark, picture);
    [0, 1].map(|i| corner[i] + (mark.probe[i] + 1.0) / 2.0 * edge)
}

/// The centre of the square of a mark, in pixels of the picture.
pub fn centre_of(mark: &BodyMark, picture: [f64; 2]) -> [f64; 2] {
    let (corner, edge) = square(mark, picture);
    corner.map(|from| from + edge / 2.0)
}

/// The mark with its centre moved to a pixel of the picture, or as near to it as the edges of the picture allow.
pub fn moved_to(mark: &BodyMark, picture: [f64; 2], pixel: [f64; 2]) -> BodyMark {
    let at = [0, 1].map(|i| (pixel[i] / picture[i].max(1.0)).clamp(0.0, 1.0));
    // Where it is drawn, so that the next drag begins there.
    let centre = centre_of(&BodyMark { at, ..*mark }, picture);
    BodyMark { at: [0, 1].map(|i| short((centre[i] / picture[i].max(1.0)).clamp(0.0, 1.0))), ..*mark }
}

/// Files stay short.
fn short(share: f64) -> f64 {
    (share * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Body;

    const PICTURE: [f64; 2] = [400.0, 200.0];

    #[test]
    fn a_mark_lies_on_the_picture_wherever_it_is_put_and_whatever_its_size() {
        for (at, size) in [([0.0, 0.0], 0.06), ([1.0, 1.0], 0.5), ([0.0, 1.0], 0.2), ([0.5, 0.5], 0.18)] {
            let mark = BodyMark { at, size, ..BodyMark::default() };
            for picture in [PICTURE, [64.0, 64.0], [100.0, 3000.0]] {
                let drawn = &drawn(&[mark], picture)[0];
                let edge = size * picture[0].min(picture[1]);
                assert!((drawn.edge - edge).abs() < 1e-9);
                for i in 0..2 {
                    assert!(drawn.corner[i] >= 0.0 && drawn.corner[i] + edge <= picture[i], "{at:?} on {picture:?}");
                }
            }
        }
    }

    #[test]
    fn the_marker_points_where_the_angle_says() {
        for (angle, [x, y]) in [(0.0, [0.0, -1.0]), (90.0, [1.0, 0.0]), (-90.0, [-1.0, 0.0]), (180.0, [0.0, 1.0])] {
            let mark = BodyMark { angle, at: [0.5, 0.5], size: 0.5, probe: [0.2, -0.4], ..BodyMark::default() };
            let [end, other] = drawn(&[mark], PICTURE)[0].probe;
            // Half of the square's edge of 100 pixels is 50.
            let by = HALF_BAR * 50.0;
            let middle = [200.0 + 0.2 * 50.0, 100.0 - 0.4 * 50.0];
            assert_eq!(probe_of(&mark, PICTURE).map(|v| (v * 1e6).round() / 1e6), middle);
            for (place, sign) in [(end, 1.0), (other, -1.0)] {
                let expected = [middle[0] + sign * by * x, middle[1] + sign * by * y];
                assert!((0..2).all(|i| (place[i] - expected[i]).abs() < 1e-9), "{angle}: {place:?}, {expected:?}");
            }
        }
    }

    #[test]
    fn a_mirrored_mark_has_left_and_right_exchanged_and_its_probe_where_it_was() {
        let mark = BodyMark { body: Body::Breast, at: [0.5, 0.5], ..BodyMark::default() };
        let both = drawn(&[mark, BodyMark { mirrored: true, ..mark }], PICTURE);
        assert_eq!(both[0].probe, both[1].probe);
        for (right, left) in both[0].outline.iter().flatten().zip(both[1].outline.iter().flatten()) {
            assert!((right[0] + left[0] - 400.0).abs() < 1e-9 && right[1] == left[1]);
        }
    }

    #[test]
    fn parts_are_found_where_they_are_drawn_and_moved_where_they_are_dragged() {
        let marks = [
            BodyMark { at: [0.2, 0.5], size: 0.3, ..BodyMark::default() },
            BodyMark { at: [0.7, 0.5], size: 0.3, probe: [0.5, 0.5], ..BodyMark::default() },
        ];
        let part = |pixel| part_at(&marks, PICTURE, pixel, 4.0);
        assert_eq!(part(probe_of(&marks[0], PICTURE)), Some((0, Part::Probe)));
        assert_eq!(part(probe_of(&marks[1], PICTURE)), Some((1, Part::Probe)));
        assert_eq!(part([260.0, 80.0]), Some((1, Part::Body)));
        assert_eq!(part([180.0, 100.0]), None);
        let moved = moved_to(&marks[0], PICTURE, [300.0, 90.0]);
        assert_eq!(moved.at, [0.75, 0.45]);
        let stopped = moved_to(&marks[0], PICTURE, [-50.0, 900.0]);
        let centre = centre_of(&stopped, PICTURE);
        assert!((0..2).all(|i| (stopped.at[i] * PICTURE[i] - centre[i]).abs() < 0.03), "{stopped:?}");
        let probed = with_probe_at(&marks[0], PICTURE, [80.0 + 15.0, 100.0 - 30.0]);
        assert_eq!(probed.probe, [0.5, -1.0]);
        assert_eq!(with_probe_at(&marks[0], PICTURE, [1e9, f64::MIN]).probe, [1.0, -1.0]);
    }
}
