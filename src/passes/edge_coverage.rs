//! How much of a pixel the near side of an edge covers, from which rays around it are near: antialiasing from the distance map alone.
//!
//! Across the edge, the number of near rays in a column is the edge's height there, to within half a ray. A straight line through the heights of seven
//! columns, by weighted least squares, is the edge to a tenth of a ray; the area below it in the pixel is the share.

/// Columns on both sides of a pixel, and rays on both sides of it in each, that tell how much of it is near. Where the heights of the wider window are no
/// line, three columns may be.
const WINDOWS: [(i64, i64); 2] = [(3, 3), (1, 2)];
/// Variance of the heights about a line, square rays, up to which they are one. Rounding to whole rays makes 1/12.
const LINE: f64 = 0.16;

/// The share of a pixel that is near, if rays at an offset from it are near as `is_near` says. The pixel keeps half of itself, at least: its ray tells
/// where its middle lies; and all of itself where the rays around it lie on no line. `reach`: columns on both sides that may be looked at, 1..3.
pub fn near_share(is_near: &dyn Fn(i64, i64) -> bool, reach: i64) -> f64 {
    let side = |dx: i64, dy: i64| f64::from(u8::from(is_near(dx, dy)));
    let rise = |at: &dyn Fn(i64, i64) -> f64| -> f64 {
        [(-1, 1.0), (0, 2.0), (1, 1.0)].iter().map(|(across, weight)| weight * (at(1, *across) - at(-1, *across))).sum()
    };
    let is_upright = rise(&|d, a| side(d, a)).abs() > rise(&|d, a| side(a, d)).abs();
    let turned = |i: i64, j: i64| if is_upright { is_near(j, i) } else { is_near(i, j) };
    let share = WINDOWS.iter().filter(|w| w.0 <= reach).find_map(|w| share_of_line(&turned, *w));
    match (share, is_near(0, 0)) {
        (Some(share), true) => share.max(0.5),
        (Some(share), false) => share.min(0.5),
        (None, own) => f64::from(u8::from(own)),
    }
}

/// The share below a line through the heights of the columns; none if they lie on no line.
fn share_of_line(is_near: &dyn Fn(i64, i64) -> bool, (columns, rows): (i64, i64)) -> Option<f64> {
    let mut ends = [false; 2];
    let mut points = vec![];
    for i in -columns..=columns {
        let column: Vec<bool> = (-rows..=rows).map(|j| is_near(i, j)).collect();
        match column.windows(2).filter(|pair| pair[0] != pair[1]).count() {
            0 => {}
            1 => ends[usize::from(column[0])] = true,
            _ => return None,
        }
        let near = column.iter().filter(|n| **n).count() as f64;
        points.push((((columns + 1).pow(2) - i * i) as f64, i as f64, near - column.len() as f64 / 2.0));
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

    /// Root of the mean square of the share's error at pixels that an edge goes through, the median over shapes that a function of a seed tells the inside
    /// of: of one ray a pixel, of the mean of 2 x 2, and of the share here. The truth is the mean of 32 x 32.
    fn errors(shape: &dyn Fn(f64) -> Box<dyn Fn(f64, f64) -> bool>) -> [f64; 3] {
        let mut of_shapes = [const { Vec::new() }; 3];
        for seed in 0..24 {
            let mut squares = [0.0; 3];
            let mut edges = 0.0;
            // By the golden ratio, seeds are spread evenly over 0..1.
            let is_inside = shape((f64::from(seed) * 0.618_034).fract());
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
                let share = near_share(&|dx, dy| is_inside((x + dx) as f64, (y + dy) as f64), 3);
                for (square, share) in squares.iter_mut().zip([centre, mean(x, y, 2), share]) {
                    *square += (share - truth).powi(2);
                }
                edges += 1.0;
            }
            of_shapes.iter_mut().zip(squares).for_each(|(errors, square)| errors.push((square / edges).sqrt()));
        }
        of_shapes.map(|mut errors: Vec<f64>| {
            errors.sort_by(f64::total_cmp);
            errors[errors.len() / 2]
        })
    }

    /// Straight edges are better than with four rays, but for those along the rays' own rows, where the window sees no step; round and small shapes are
    /// better than with one ray.
    #[test]
    fn shares_of_straight_and_round_shapes_are_those_of_many_rays() {
        let straight = errors(&|seed| {
            let (sin, cos) = (seed * std::f64::consts::TAU).sin_cos();
            Box::new(move |x, y| x * cos + y * sin < 7.3 * seed - 3.0)
        });
        let disc = |least: f64, most: f64| {
            move |seed: f64| -> Box<dyn Fn(f64, f64) -> bool> {
                let radius = least + (most - least) * seed;
                let [cx, cy] = [0.31, 0.77].map(|n| (seed * 100.0 + n).fract());
                Box::new(move |x, y| (x - cx).hypot(y - cy) < radius)
            }
        };
        let (round, small) = (errors(&disc(6.0, 20.0)), errors(&disc(2.0, 5.0)));
        println!("one ray, 2 x 2, share: straight {straight:.3?}, round {round:.3?}, small {small:.3?}");
        assert!(straight[2] < straight[1] && straight[2] < 0.25 * straight[0], "{straight:?}");
        assert!(round[2] < 0.65 * round[0], "{round:?}");
        assert!(small[2] < 0.75 * small[0], "{small:?}");
    }

    /// A pixel without an edge around it, a speck and a checkerboard keep what their ray says.
    #[test]
    fn what_is_no_line_keeps_the_pixels_own_side() {
        for reach in 1..=3 {
            for own in [false, true] {
                let own_share = f64::from(u8::from(own));
                assert_eq!(near_share(&|_, _| own, reach), own_share);
                assert_eq!(near_share(&|x, y| ((x, y) == (0, 0)) == own, reach), own_share);
                assert_eq!(near_share(&|x, y| ((x + y) % 2 == 0) == own, reach), own_share);
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
