//! How much of a pixel the near side of an edge covers, from the distances of the rays around it: antialiasing from the distance map alone.
//!
//! An edge between rays is a staircase of runs of pixels. Where a run is short, the number of near rays in a column across the edge is the edge's height
//! there, to within half a ray, and a straight line through the heights of seven columns, by weighted least squares, is the edge to a tenth of a ray. Where
//! a run is longer than half of that window, or the heights lie on no line, the edge crosses the middles of the steps at the run's ends (Reshetov 2009,
//! Morphological antialiasing): a straight line between a step up and a step down, a parabola between two steps the same way. The area below it in the pixel
//! is the share.

/// Columns on both sides of a pixel, and rays on both sides of it in each, through whose heights a line is laid.
const WINDOW: i64 = 3;
/// Variance of the heights about a line, square rays, up to which they are one. Rounding to whole rays makes 1/12.
const LINE: f64 = 0.16;
/// Pixels of a run from which its ends tell more than seven columns.
const LONG: i64 = 4;
/// Pixels on both sides up to which a run's ends are looked for.
const REACH: i64 = 16;

/// Estimates the share (0..1) of a pixel's area that the surface nearer than `limit` covers. `distance` gives the distance of the ray at an offset
/// (columns, rows) from the pixel. The result is at least 0.5 if the pixel's own ray is near and at most 0.5 if not; it is 1 or 0 where no edge can
/// be recognised. `is_outline`: nothing was hit on the far side. Between two surfaces it is false: each may reach the other's distance a few pixels
/// away, so that only the run of pixels along the edge is used, whose limit follows both surfaces.
pub(crate) fn near_share(distance: &dyn Fn(i64, i64) -> f64, limit: f64, is_outline: bool) -> f64 {
    let is_near = |dx: i64, dy: i64| distance(dx, dy) < limit;
    let side = |dx: i64, dy: i64| f64::from(u8::from(is_near(dx, dy)));
    let rise = |at: &dyn Fn(i64, i64) -> f64| -> f64 {
        [(-1, 1.0), (0, 2.0), (1, 1.0)].iter().map(|(across, weight)| weight * (at(1, *across) - at(-1, *across))).sum()
    };
    let is_upright = rise(&|d, a| side(d, a)).abs() > rise(&|d, a| side(a, d)).abs();
    let turned = |i: i64, j: i64| if is_upright { distance(j, i) } else { distance(i, j) };
    let run = share_of_run(&turned, limit);
    let is_long = run.is_some_and(|(_, length)| length >= LONG);
    let line = (is_outline && !is_long).then(|| share_of_line(&|i, j| turned(i, j) < limit)).flatten();
    match (line.or(run.map(|(share, _)| share)), is_near(0, 0)) {
        (Some(share), true) => share.max(0.5),
        (Some(share), false) => share.min(0.5),
        (None, own) => f64::from(u8::from(own)),
    }
}

/// The near share by the ends of the run that the pixel is in, and the run's length; none where the edge is on neither side of the pixel, or on both.
fn share_of_run(distance: &dyn Fn(i64, i64) -> f64, limit: f64) -> Option<(f64, i64)> {
    let is_near = distance(0, 0) < limit;
    let is_beyond = |j: i64| (distance(0, j) < limit) != is_near;
    let across = match (is_beyond(-1), is_beyond(1)) {
        (true, false) => -1,
        (false, true) => 1,
        _ => return None,
    };
    // Columns to the end of the run, and which way its step goes: 1 where the pixel's side grows, 0 where the edge ends; none within the reach.
    let end = |step: i64| -> (i64, Option<f64>) {
        let mut limit = limit;
        for columns in 1..=REACH {
            let [own, other] = [distance(step * columns, 0), distance(step * columns, across)];
            match [own, other].map(|d| (d < limit) == is_near) {
                [true, false] => limit = 0.5 * own + 0.5 * other,
                [true, true] => return (columns, Some(1.0)),
                [false, false] => return (columns, Some(-1.0)),
                [false, true] => return (columns, Some(0.0)),
            }
        }
        (REACH + 1, None)
    };
    let ((left, before), (right, after)) = (end(-1), end(1));
    // Of a run whose other end is out of reach, the edge is a straight line as far as it was seen.
    let [before, after] = [before.or(after.map(|t| -t)), after.or(before.map(|t| -t))].map(|turn| turn.unwrap_or(0.0));
    let half = 0.5 * (left + right - 1) as f64;
    // The pixel's place between the ends, -1..1.
    let at = 0.5 * (left - right) as f64 / half;
    let (height, rise) = match before == -after {
        true => (0.5 * after * at, 0.5 * after / half),
        false => {
            let turn = if at < 0.0 { before } else { after };
            (0.5 * turn * at * at, turn * at / half)
        }
    };
    let own = area(0.5 + height, rise.abs());
    Some((if is_near { own } else { 1.0 - own }, left + right - 1))
}

/// The share below a line through the heights of the columns; none if they lie on no line.
fn share_of_line(is_near: &dyn Fn(i64, i64) -> bool) -> Option<f64> {
    let mut ends = [false; 2];
    let mut points = vec![];
    for i in -WINDOW..=WINDOW {
        let column: Vec<bool> = (-WINDOW..=WINDOW).map(|j| is_near(i, j)).collect();
        match column.windows(2).filter(|pair| pair[0] != pair[1]).count() {
            0 => {}
            1 => ends[usize::from(column[0])] = true,
            _ => return None,
        }
        let near = column.iter().filter(|n| **n).count() as f64;
        points.push((((WINDOW + 1).pow(2) - i * i) as f64, i as f64, near - column.len() as f64 / 2.0));
    }
    if ends == [true; 2] {
        return None;
    }
    // Columns are symmetric about the pixel: the mean and the slope do not depend on each other.
    let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|(weight, i, h)| weight * of(*i, *h)).sum::<f64>();
    let height = sum(&|_, h| h) / sum(&|_, _| 1.0);
    let rise = sum(&|i, h| i * h) / sum(&|i, _| i * i);
    let variance = sum(&|i, h| (h - height - rise * i).powi(2)) / sum(&|_, _| 1.0);
    (variance <= LINE).then(|| area(height, rise.abs()))
}

/// Area of the unit square about 0 below a line of a height at 0 and a slope of 0 or more.
fn area(height: f64, rise: f64) -> f64 {
    let [low, high] = [-0.5, 0.5].map(|x| height + 0.5 + x * rise);
    // Flat, or nearly: the quotient below would lose its digits.
    if high - low < 1e-2 {
        return (height + 0.5).clamp(0.0, 1.0);
    }
    let integral = |h: f64| h.clamp(0.0, 1.0).powi(2) / 2.0 + (h - 1.0).max(0.0);
    (integral(high) - integral(low)) / (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::MISS;

    /// Whether a ray at an offset from a pixel is near.
    type Side<'a> = &'a dyn Fn(i64, i64) -> bool;

    /// The share at an outline.
    fn of_outline(is_near: Side) -> f64 {
        near_share(&|x, y| if is_near(x, y) { 1.0 } else { MISS }, 0.5 * MISS, true)
    }

    /// Sums of the squares of the share's error at pixels beside a shape's edge, or at those that it crosses alone, and their number: of one ray a pixel, of
    /// the mean of 2 x 2, and of the share here. The truth is the mean of 32 x 32.
    fn squares(is_inside: &dyn Fn(f64, f64) -> bool, are_crossed: bool) -> ([f64; 3], f64) {
        let (mut squares, mut edges) = ([0.0; 3], 0.0);
        let mean = |x: i64, y: i64, n: i64| {
            let at = |i: i64| (i as f64 + 0.5) / n as f64 - 0.5;
            let hits = (0..n * n).filter(|k| is_inside(x as f64 + at(k % n), y as f64 + at(k / n))).count();
            hits as f64 / (n * n) as f64
        };
        for (x, y) in (-24..24).flat_map(|y| (-24..24).map(move |x| (x, y))) {
            let centre = mean(x, y, 1);
            if (-1..=1).all(|d| mean(x + d, y, 1) == centre && mean(x, y + d, 1) == centre) {
                continue;
            }
            let truth = mean(x, y, 32);
            if are_crossed && (truth == 0.0 || truth == 1.0) {
                continue;
            }
            let share = of_outline(&|dx, dy| is_inside((x + dx) as f64, (y + dy) as f64));
            for (square, share) in squares.iter_mut().zip([centre, mean(x, y, 2), share]) {
                *square += (share - truth).powi(2);
            }
            edges += 1.0;
        }
        (squares, edges)
    }

    /// 24 numbers in 0..1. By the golden ratio, seeds are spread evenly.
    fn seeds() -> impl Iterator<Item = f64> {
        (0..24).map(|seed| (f64::from(seed) * 0.618_034).fract())
    }

    /// Roots of the mean squares of these errors, the median over shapes that a function of a seed tells the inside of.
    fn errors(shape: &dyn Fn(f64) -> Box<dyn Fn(f64, f64) -> bool>) -> [f64; 3] {
        let mut of_shapes = [const { Vec::new() }; 3];
        for seed in seeds() {
            let (squares, edges) = squares(&*shape(seed), false);
            of_shapes.iter_mut().zip(squares).for_each(|(errors, square)| errors.push((square / edges).sqrt()));
        }
        of_shapes.map(|mut errors: Vec<f64>| {
            errors.sort_by(f64::total_cmp);
            errors[errors.len() / 2]
        })
    }

    /// Straight edges are better than with four rays, in any direction and nearly along the rays' own rows; round, small and rough shapes are better than with
    /// one ray.
    #[test]
    fn shares_of_straight_and_round_shapes_are_those_of_many_rays() {
        let line = |sin: f64, cos: f64, at: f64| -> Box<dyn Fn(f64, f64) -> bool> {
            Box::new(move |x, y| x * cos + y * sin < at)
        };
        let straight = errors(&|seed| {
            let (sin, cos) = (seed * std::f64::consts::TAU).sin_cos();
            line(sin, cos, 7.3 * seed - 3.0)
        });
        let flat = errors(&|seed| {
            let (sin, cos) = (1.0 + 5.0 * seed).to_radians().sin_cos();
            line(cos, sin, 7.3 * seed - 3.0)
        });
        let disc = |least: f64, most: f64| {
            move |seed: f64| -> Box<dyn Fn(f64, f64) -> bool> {
                let radius = least + (most - least) * seed;
                let [cx, cy] = [0.31, 0.77].map(|n| (seed * 100.0 + n).fract());
                Box::new(move |x, y| (x - cx).hypot(y - cy) < radius)
            }
        };
        let (round, small) = (errors(&disc(6.0, 20.0)), errors(&disc(2.0, 5.0)));
        // Waves of 3 to 9 pixels, 0.6 high: as a surface of speckle.
        let rough = errors(&|seed| {
            let (sin, cos) = (seed * std::f64::consts::TAU).sin_cos();
            Box::new(move |x, y| {
                let along = x * sin - y * cos;
                let wave = |pixels: f64| (along * std::f64::consts::TAU / pixels + 40.0 * seed).sin();
                x * cos + y * sin < 0.3 * (wave(3.1) + wave(5.3) + wave(8.9))
            })
        });
        println!(
            "one ray, 2 x 2, share: straight {straight:.3?}, near the rows {flat:.3?}, round {round:.3?}, small {small:.3?}, rough {rough:.3?}"
        );
        assert!(straight[2] < 0.8 * straight[1] && straight[2] < 0.25 * straight[0], "{straight:?}");
        assert!(flat[2] < 0.4 * flat[1] && flat[2] < 0.15 * flat[0], "{flat:?}");
        assert!(round[2] < 0.65 * round[0], "{round:?}");
        assert!(small[2] < 0.75 * small[0], "{small:?}");
        assert!(rough[2] < 0.85 * rough[0], "{rough:?}");
    }

    /// The errors that docs/numerics.md states of straight edges, by their angle to the rows of rays, so that what is stated stays what is done. At 1 and 1.5
    /// degrees runs are longer than they are followed, and nothing tells where in a step the edge is; at 45 degrees all heights of an edge within
    /// a pixel have the same rays inside.
    #[test]
    fn shares_of_straight_edges_at_each_angle_are_as_accurate_as_stated() {
        let stated = [
            (1.0, [0.109, 0.155]),
            (1.5, [0.064, 0.091]),
            (2.0, [0.028, 0.040]),
            (5.0, [0.012, 0.017]),
            (10.0, [0.027, 0.035]),
            (30.0, [0.030, 0.034]),
            (45.0, [0.169, 0.170]),
        ];
        for (angle, stated) in stated {
            let (sin, cos) = f64::to_radians(angle).sin_cos();
            let found = [false, true].map(|are_crossed| {
                let all = seeds().map(|seed| squares(&|x, y| y * cos - x * sin < 6.0 * seed - 3.0, are_crossed));
                let (sums, edges) = all.fold(([0.0; 3], 0.0), |(sums, count), (squares, edges)| {
                    ([0, 1, 2].map(|n| sums[n] + squares[n]), count + edges)
                });
                sums.map(|sum| (sum / edges).sqrt())
            });
            println!("{angle} degrees: one ray, 2 x 2, share beside the edge and where it crosses: {found:.4?}");
            for ([one, _, share], stated) in found.into_iter().zip(stated) {
                // Half of the last digit that is stated.
                assert!((share - stated).abs() <= 6e-4, "{angle} degrees: {share:.4}, stated {stated}");
                assert!(share < 0.75 * one, "{angle} degrees: {share:.3} is hardly better than {one:.3} of one ray");
            }
        }
    }

    /// A pixel without an edge around it, a speck and a checkerboard keep what their ray says.
    #[test]
    fn what_is_no_line_keeps_the_pixels_own_side() {
        for is_outline in [false, true] {
            for own in [false, true] {
                let share =
                    |is_near: Side| near_share(&|x, y| if is_near(x, y) { 40.0 } else { 60.0 }, 50.0, is_outline);
                let own_share = f64::from(u8::from(own));
                assert_eq!(share(&|_, _| own), own_share);
                assert_eq!(share(&|x, y| ((x, y) == (0, 0)) == own), own_share);
                assert_eq!(share(&|x, y| ((x + y) % 2 == 0) == own), own_share);
            }
        }
    }

    /// Along a fold, both surfaces come nearer or go away: its edge is where their distances differ, whatever the distances are.
    #[test]
    fn a_fold_of_tilted_surfaces_has_the_edge_of_level_ones() {
        for slant in [0.09, 0.14, 0.31] {
            let share = |x: i64, y: i64, tilt: f64| {
                let distance = |dx: i64, dy: i64| {
                    let [x, y] = [x + dx, y + dy].map(|n| n as f64);
                    40.0 + tilt * x + if y < slant * x { 0.0 } else { 3.0 }
                };
                let beyond = [-1, 1].map(|dy| distance(0, dy)).into_iter().find(|d| (d - distance(0, 0)).abs() > 1.0);
                near_share(&distance, 0.5 * (distance(0, 0) + beyond.unwrap_or(MISS)), false)
            };
            for x in -20..20_i64 {
                let edge = (slant * x as f64).ceil() as i64 - 1;
                for y in [edge, edge + 1] {
                    let (level, tilted) = (share(x, y, 0.0), share(x, y, 0.8));
                    assert_eq!(level, tilted, "{slant}: {x}, {y}");
                    let line = area(slant * x as f64 - y as f64, slant);
                    assert!((tilted - line).abs() < 0.2, "{slant}: {x}, {y}: {tilted} {line}");
                }
            }
        }
    }

    /// Prevents a branch of the area that does not meet its neighbour.
    #[test]
    fn the_area_below_a_line_is_that_of_many_columns() {
        for rise in [0.0, 0.009_9, 0.010_1, 0.3, 1.0, 2.5] {
            for height in [-2.0, -0.6, -0.2, 0.0, 0.31, 0.5, 0.9, 2.0] {
                let columns = (0..4000).map(|n| (f64::from(n) + 0.5) / 4000.0 - 0.5);
                let mean = columns.map(|x| (height + 0.5 + rise * x).clamp(0.0, 1.0)).sum::<f64>() / 4000.0;
                // What is nearly flat ignores its slope, 0.01 over a pixel, of which an eighth counts where the line meets a corner.
                assert!((area(height, rise) - mean).abs() < 1.3e-3, "{height} {rise}: {} {mean}", area(height, rise));
            }
        }
    }
}
