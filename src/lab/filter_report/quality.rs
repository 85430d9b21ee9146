//! Measures of a filtered picture: noise in tissue of one kind, contrast, and, if the clean picture is known, edges and error.

use crate::error_report::metrics::similarity;
use crate::picture::{Level, Region};

/// Deviation of the Gaussian whose derivative finds edges, pixels.
const EDGE_SCALE: f64 = 1.5;
/// Weight of a displaced edge in the figure of merit (Pratt 1978, Abdou and Pratt 1979: 1/9).
const DISPLACEMENT: f64 = 1.0 / 9.0;
/// Steepness that makes a pixel of the clean picture an edge, as a share of its steepest.
const IDEAL_STEEPNESS: f64 = 0.1;

/// Measures of the quality of a filtered slice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Mean over standard deviation in tissue of one kind. None if the standard deviation is 0.
    pub snr: Option<f64>,
    /// Contrast-to-noise ratio of tissue of one kind against the background. None if neither has noise.
    pub cnr: Option<f64>,
    /// Pratt's figure of merit, 0..1: 1 if all edges are where those of the clean slice are. None if the clean slice is not known.
    pub edges: Option<f64>,
    /// Root mean square difference from the clean slice, 0..1. None if the clean slice is not known.
    pub rmse: Option<f64>,
    /// Structural similarity (SSIM) to the clean slice, at most 1. None if the clean slice is not known, or the slice is smaller than 11 x 11 pixels.
    pub ssim: Option<f64>,
}

/// Measures a slice of `size` (columns, rows) pixels, row by row, with values in 0..1. `clean`: the same slice without speckle, if known; `levels`:
/// the regions of tissue and of background, in this order, for SNR and CNR.
pub fn quality(pixels: &[f64], clean: Option<&[f64]>, size: [usize; 2], levels: [&Region; 2]) -> Quality {
    let [tissue, behind]: [Level; 2] = levels.map(|region| region.level(pixels, size[0] as u32));
    let mean_square = |clean: &[f64]| {
        pixels.iter().zip(clean).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / pixels.len().max(1) as f64
    };
    Quality {
        snr: tissue.snr(),
        cnr: tissue.cnr(&behind),
        edges: clean.map(|clean| figure_of_merit(pixels, clean, size)),
        rmse: clean.map(|clean| mean_square(clean).sqrt()),
        ssim: clean.and_then(|clean| similarity(pixels, clean, [size[0], size[1], 1])),
    }
}

/// Pratt's figure of merit of the edges of a picture against those of the clean one: the mean of 1 / (1 + d^2 / 9) over
/// the detected edge pixels, where d is the distance to the nearest ideal one, pixels. As many edge pixels are detected as there are
/// ideal ones, the steepest first, so that no threshold decides.
fn figure_of_merit(pixels: &[f64], clean: &[f64], size: [usize; 2]) -> f64 {
    let ideal = crests(clean, size);
    let steepest = ideal.iter().map(|c| c.0).fold(0.0, f64::max);
    let ideal: Vec<usize> = ideal.iter().filter(|c| c.0 > IDEAL_STEEPNESS * steepest).map(|c| c.1).collect();
    let mut detected = crests(pixels, size);
    detected.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    detected.truncate(ideal.len());
    let squares = squared_distances(&ideal, size);
    let merit = |at: usize| 1.0 / (1.0 + DISPLACEMENT * squares[at]);
    detected.iter().map(|c| merit(c.1)).sum::<f64>() / ideal.len().max(1) as f64
}

/// Steepness and index of every pixel that is steepest along its gradient (Canny 1986, without his thresholds).
fn crests(pixels: &[f64], [width, height]: [usize; 2]) -> Vec<(f64, usize)> {
    let smooth = bell(pixels, [width, height]);
    let at = |x: usize, y: usize| smooth[y * width + x];
    let mut slopes = vec![[0.0; 2]; width * height];
    for (x, y) in inner([width, height]) {
        slopes[y * width + x] = [(at(x + 1, y) - at(x - 1, y)) / 2.0, (at(x, y + 1) - at(x, y - 1)) / 2.0];
    }
    let steepness: Vec<f64> = slopes.iter().map(|[x, y]| x.hypot(*y)).collect();
    let mut found = Vec::new();
    for (x, y) in inner([width, height]) {
        let here = y * width + x;
        let ([dx, dy], steep) = (slopes[here], steepness[here]);
        if steep == 0.0 {
            continue;
        }
        // The neighbours on both sides along the gradient, interpolated between two pixels.
        let (a, b) = if dx.abs() > dy.abs() { ([1, 0], dy / dx) } else { ([0, 1], dx / dy) };
        let diagonal = if a[0] == 1 { [1, b.signum() as isize] } else { [b.signum() as isize, 1] };
        let beside = |sign: isize| {
            let value = |[sx, sy]: [isize; 2]| {
                steepness[(y as isize + sign * sy) as usize * width + (x as isize + sign * sx) as usize]
            };
            value(a) * (1.0 - b.abs()) + value(diagonal) * b.abs()
        };
        // A plateau counts once.
        if steep > beside(1) && steep >= beside(-1) {
            found.push((steep, here));
        }
    }
    found
}

fn inner([width, height]: [usize; 2]) -> impl Iterator<Item = (usize, usize)> {
    (1..height.saturating_sub(1)).flat_map(move |y| (1..width.saturating_sub(1)).map(move |x| (x, y)))
}

/// A separable Gaussian of [`EDGE_SCALE`]; the border is continued.
fn bell(pixels: &[f64], [width, height]: [usize; 2]) -> Vec<f64> {
    let reach = (3.0 * EDGE_SCALE).ceil() as isize;
    let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / EDGE_SCALE).powi(2)).exp()).collect();
    let all: f64 = weights.iter().sum();
    let along = |source: &[f64], count: usize, index: &dyn Fn(usize) -> usize, n: usize| {
        let tap = |k: isize| source[index((n as isize + k).clamp(0, count as isize - 1) as usize)];
        (-reach..=reach).zip(&weights).map(|(k, w)| w * tap(k)).sum::<f64>() / all
    };
    let places = || (0..pixels.len()).map(|i| (i % width, i / width));
    let rows: Vec<f64> = places().map(|(x, y)| along(pixels, width, &|x| y * width + x, x)).collect();
    places().map(|(x, y)| along(&rows, height, &|y| y * width + x, y)).collect()
}

/// Squared distance of every pixel to the nearest of `marked`, pixels^2; infinite without any. Separable: the nearest in each
/// column, then the least over the columns.
fn squared_distances(marked: &[usize], [width, height]: [usize; 2]) -> Vec<f64> {
    let mut column = vec![f64::INFINITY; width * height];
    marked.iter().for_each(|&i| column[i] = 0.0);
    for x in 0..width {
        for (y, before) in (1..height).map(|y| (y, y - 1)).chain((1..height).rev().map(|y| (y - 1, y))) {
            column[y * width + x] = column[y * width + x].min(column[before * width + x] + 1.0);
        }
    }
    let least = |x: usize, y: usize| {
        let to = |other: usize| (x.abs_diff(other) as f64).powi(2) + column[y * width + other].powi(2);
        (0..width).map(to).fold(f64::INFINITY, f64::min)
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| least(x, y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [48, 40];

    /// A vertical step whose middle is the column `at`.
    fn step(at: usize, height: f64) -> Vec<f64> {
        let share = |i: usize| match (i % SIZE[0]).cmp(&at) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => 0.5,
            std::cmp::Ordering::Greater => 1.0,
        };
        (0..SIZE[0] * SIZE[1]).map(|i| 0.2 + height * share(i)).collect()
    }

    #[test]
    fn merit_is_one_at_home_and_falls_by_the_formula_with_displacement() {
        let clean = step(20, 0.5);
        assert!((figure_of_merit(&clean, &clean, SIZE) - 1.0).abs() < 1e-12);
        // Contrast does not matter, displacement does: 1 / (1 + d^2 / 9).
        assert!((figure_of_merit(&step(20, 0.1), &clean, SIZE) - 1.0).abs() < 1e-12);
        for d in 1..=6 {
            let merit = figure_of_merit(&step(20 + d, 0.5), &clean, SIZE);
            let expected = 1.0 / (1.0 + (d * d) as f64 / 9.0);
            assert!((merit - expected).abs() < 1e-12, "{d}: {merit}, not {expected}");
        }
        // A flat picture has no edge at all.
        assert_eq!(figure_of_merit(&vec![0.5; SIZE[0] * SIZE[1]], &clean, SIZE), 0.0);
    }

    #[test]
    fn distances_are_those_of_brute_force() {
        let marked = [5, 77, 403, 1000, 1833];
        let place = |i: usize| ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
        for (i, found) in squared_distances(&marked, SIZE).into_iter().enumerate() {
            let to = |m: &usize| (place(*m).0 - place(i).0).powi(2) + (place(*m).1 - place(i).1).powi(2);
            assert_eq!(found, marked.iter().map(to).fold(f64::INFINITY, f64::min), "pixel {i}");
        }
        assert!(squared_distances(&[], SIZE).iter().all(|d| d.is_infinite()));
    }

    #[test]
    fn levels_and_errors_are_those_of_the_formulas() {
        let clean = step(24, 0.4);
        // A chequerboard of +-0.05 as noise.
        let sign = |i: usize| if (i % SIZE[0] + i / SIZE[0]).is_multiple_of(2) { 1.0 } else { -1.0 };
        let noisy: Vec<f64> = clean.iter().enumerate().map(|(i, v)| v + 0.05 * sign(i)).collect();
        let [left, right] = [4, 30].map(|x| Region { at: [x, 4], size: [16, 16] });
        let found = quality(&noisy, Some(&clean), SIZE, [&right, &left]);
        let near = |a: Option<f64>, b: f64| assert!((a.expect("a value") - b).abs() < 1e-9, "{a:?}, not {b}");
        near(found.snr, 0.6 / 0.05);
        near(found.cnr, 0.4 / 0.05f64.hypot(0.05));
        near(found.rmse, 0.05);
        assert!(found.ssim.expect("similarity") < 0.9);
        assert_eq!(quality(&noisy, None, SIZE, [&right, &left]).edges, None);
    }
}
