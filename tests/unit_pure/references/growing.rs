//! The enhanced sigma filter and how far its windows grow, counted by brute force.

use super::*;
use crate::common::growth::growth_shares;
use echolume::low_level::probe::{Axis, Motion, Probe};

/// The expected result at a pixel with a known centre: the rings that its window grows by, and the mean.
struct Expected {
    rings: usize,
    mean: Vec<f64>,
}

fn brightness(texel: &[f64]) -> f64 {
    match texel {
        [r, g, b, ..] => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        _ => texel[0],
    }
}

/// `sizes`: radius of the window at first and at last, and K.
fn expected(source: &Texels, [x, y]: [usize; 2], centre: f64, range: f64, [start, last, few]: [usize; 3]) -> Expected {
    let hits = |radius: usize| -> Vec<&[f64]> {
        window(source.size, x, y, radius).map(|(i, j)| source.get([i, j, 0])).filter(|v| v[0] < MISS).collect()
    };
    let alike = |radius: usize| -> Vec<&[f64]> {
        hits(radius)
            .into_iter()
            .filter(|v| brightness(v) >= centre - range && brightness(v) <= centre + range)
            .collect()
    };
    let wanted = hits(start).len();
    let rings = (start..=last).find(|r| alike(*r).len() >= wanted).unwrap_or(last) - start;
    let mut found = alike(start + rings);
    if found.len() <= few && found.len() < wanted {
        let beside = |(i, j): &(usize, usize)| i.abs_diff(x) + j.abs_diff(y) == 1;
        found = window(source.size, x, y, 1).filter(beside).map(|(i, j)| source.get([i, j, 0])).collect();
        found.retain(|v| v[0] < MISS);
    }
    if found.is_empty() {
        found.push(source.get([x, y, 0]));
    }
    let mean = (0..source.channels).map(|c| mean(&found.iter().map(|v| v[c]).collect::<Vec<_>>())).collect();
    Expected { rings, mean }
}

/// The median of the hits around a pixel, the lower of two; beyond the border the nearest pixel is repeated.
fn median(source: &Texels, x: usize, y: usize) -> f64 {
    let at = |at: usize, step: i64, count: usize| (at as i64 + step).clamp(0, count as i64 - 1) as usize;
    let nine = (0..9).map(|n| source.get([at(x, n % 3 - 1, source.size[0]), at(y, n / 3 - 1, source.size[1]), 0]));
    let mut nine: Vec<f64> = nine.map(brightness).filter(|v| *v < MISS).collect();
    nine.sort_by(f64::total_cmp);
    nine[(nine.len() - 1) / 2]
}

/// Two levels, with noise that is wider than the range to the right.
fn patchy(size: [usize; 2], seed: usize) -> Texels {
    let rough = noise(size, seed);
    let width = |x: usize| if x < 8 { 0.08 } else { 0.6 };
    plane(size, |x, y| if y < 6 { 0.3 } else { 0.7 } + width(x) * (rough.one(x, y, 0) - 0.5))
}

#[test]
fn windows_grow_until_they_hold_as_many_like_the_centre_as_they_began_with() {
    let mut all_rings = [0; 3];
    for (window, largest, few) in [(3, 7, 1), (5, 9, 2)] {
        let source = patchy([14, 12], window);
        let settings = |more: &str| {
            format!(
                "enhanced_sigma = {{ window = {window}, largest = {largest}, growth = true, centre = 'median', {more} }}"
            )
        };
        let scene = slices([14, 12], &settings("sigma = 0.03125"));
        let (means, rings) =
            (filtered(&scene, "enhanced_sigma_slice", &source), filtered(&scene, "growth_slice", &source));
        let scene = slices([14, 12], &settings("sigma = 0.0625, noise = 'multiplicative'"));
        let share = filtered(&scene, "enhanced_sigma_slice", &source);
        for (x, y) in super::window(source.size, 0, 0, 14) {
            let centre = median(&source, x, y);
            let sizes = [window / 2, largest / 2, few];
            let expected_at = expected(&source, [x, y], centre, 0.0625, sizes);
            assert!((means.one(x, y, 0) - expected_at.mean[0]).abs() < 1e-12, "at {x}, {y}");
            assert_eq!(rings.one(x, y, 0), expected_at.rings as f64, "at {x}, {y}");
            all_rings[expected_at.rings] += 1;
            let expected_at = expected(&source, [x, y], centre, 0.125 * centre, sizes);
            assert!((share.one(x, y, 0) - expected_at.mean[0]).abs() < 1e-12, "at {x}, {y}, multiplicative");
        }
    }
    assert!(all_rings.iter().all(|n| *n > 5), "{all_rings:?}");
}

#[test]
fn too_few_similar_pixels_fall_back_to_the_four_neighbours() {
    let scene =
        slices([3, 3], "enhanced_sigma = { window = 3, largest = 3, sigma = 0.01, centre = 'gradient-inverse' }");
    // The estimate lies half-way between 0 and its neighbours, where no pixel is.
    let source = rows([[9.0, 1.0, 9.0], [2.0, 0.0, 3.0], [9.0, 4.0, 9.0]]);
    assert_eq!(filtered(&scene, "enhanced_sigma_slice", &source).one(1, 1, 0), 2.5);
    // Two similar pixels in a picture of two are few, but there are no more.
    let two = rows([[0.5, 0.51]]);
    let scene = slices([2, 1], "enhanced_sigma = { window = 5, largest = 5, sigma = 0.1 }");
    assert!((filtered(&scene, "enhanced_sigma_slice", &two).one(0, 0, 0) - 0.505).abs() < 1e-12);
    // A picture of one pixel.
    let one = rows([[0.4]]);
    let scene = slices([1, 1], "enhanced_sigma = { window = 3, largest = 5, sigma = 0.01 }");
    assert_eq!(filtered(&scene, "enhanced_sigma_slice", &one).one(0, 0, 0), 0.4);
}

/// Slopes whose centre is estimated at 3 + 9/7 along x and at 3 - 9/7 along y, by the first of two masks that are as flat: the pixels
/// alike are the column at 4, and the row at 2.
#[test]
fn a_centre_is_estimated_with_the_chosen_estimator() {
    let scene = slices([7, 7], "enhanced_sigma = { window = 3, largest = 3, sigma = 0.2, centre = 'nagao-matsuyama' }");
    let at = |slope: Texels| filtered(&scene, "enhanced_sigma_slice", &slope).one(3, 3, 0);
    assert_eq!(at(plane([7, 7], |x, _| x as f64)), 4.0);
    assert_eq!(at(plane([7, 7], |_, y| y as f64)), 2.0);
}

#[test]
fn windows_of_distances_count_hits_only() {
    let scene = distances([12, 9], "enhanced_sigma = { window = 3, largest = 9, sigma = 0.125, centre = 'median' }");
    let mut grown = 0;
    for seed in 0..3 {
        let source = holed([12, 9], 90 + seed);
        let got = filtered(&scene, "enhanced_sigma_distance", &source);
        for (x, y) in window(source.size, 0, 0, 12) {
            if source.one(x, y, 0) == MISS {
                assert_eq!(got.one(x, y, 0), MISS);
                continue;
            }
            let expected = expected(&source, [x, y], median(&source, x, y), 0.25, [1, 4, 1]);
            assert!((got.one(x, y, 0) - expected.mean[0]).abs() < 1e-12, "at {x}, {y}");
            grown += usize::from(expected.rings > 0);
        }
    }
    assert!(grown > 20, "{grown}");
    let lonely = rows([[MISS, MISS, MISS], [MISS, 7.0, MISS], [MISS, MISS, MISS]]);
    for centre in ["median", "perona-malik", "gradient-inverse", "nagao-matsuyama"] {
        let scene = distances(
            [3, 3],
            &format!("enhanced_sigma = {{ window = 3, largest = 3, sigma = 0.1, centre = '{centre}' }}"),
        );
        same(&filtered(&scene, "enhanced_sigma_distance", &lonely), &lonely, centre);
    }
}

/// Masks with a miss are ignored, however flat their other pixels are.
#[test]
fn a_mask_with_a_miss_is_no_estimate() {
    // Flat below but for a miss in each mask there; a slope above, whose mask ends at 10.
    let source = plane([5, 5], |x, y| match (x, y) {
        (2, 3) | (0, 2) | (4, 2) | (1, 2) | (3, 2) => MISS,
        (_, 0) => 10.2,
        (_, 1) => 10.1,
        _ => 10.0,
    });
    let scene =
        distances([5, 5], "enhanced_sigma = { window = 3, largest = 3, sigma = 0.04, centre = 'nagao-matsuyama' }");
    // The mask above: 10, three of 10.1 and of 10.2, mean 10.129; within 0.08 of it only the three above.
    let got = filtered(&scene, "enhanced_sigma_distance", &source).one(2, 2, 0);
    assert!((got - 10.1).abs() < 1e-12, "{got}");
}

/// Colours are similar if their brightness is; all channels are filtered together.
#[test]
fn pictures_are_judged_by_brightness() {
    let source = colours([9, 8], 6);
    let scene = picture([9, 8], "enhanced_sigma = { window = 3, largest = 5, sigma = 0.03125, centre = 'median' }");
    let got = filtered(&scene, "enhanced_sigma_picture", &source);
    for (x, y) in window(source.size, 0, 0, 9) {
        let expected = expected(&source, [x, y], median(&source, x, y), 0.0625, [1, 2, 1]);
        for c in 0..4 {
            assert!((got.get([x, y, 0])[c] - expected.mean[c]).abs() < 1e-12, "at {x}, {y}");
        }
    }
}

#[test]
fn shares_of_growth_count_what_a_line_passes_through_and_sum_to_one() {
    let growing = |e: &str| slices([4, 2], &format!("enhanced_sigma = {{ {e}, growth = true }}"));
    // Cartesian: every pixel. Beyond the largest window, and before the first, there is nothing.
    let map = rows([[0.0, 1.0, 1.0, 2.0], [0.0, -1.0, 2.0, 9.0]]);
    assert_eq!(growth_shares(&growing("window = 3, largest = 7"), &map), [3.0 / 8.0, 2.0 / 8.0, 3.0 / 8.0]);
    assert_eq!(growth_shares(&growing("window = 5, largest = 5"), &map), [1.0]);
    // Only pixels inside the sector: outside, every window would have grown by one.
    let probe = Probe { motion: Motion::Translated, slices: Axis::centred(1.0, 3), ..wobbler() };
    let filters = "slices = { pixels = 40, enhanced_sigma = { window = 3, largest = 7, growth = true } }";
    let scene = scenes::scene(Geometry::Sweep(probe), FLOATS, filters);
    let inside = |x: usize, y: usize| {
        let (x, y) = scene.grid.place(x as f64, y as f64);
        let (range, angle) = (x.hypot(y), (x / y).atan());
        (22.0..=22.0 + 63.0 * 0.8).contains(&range) && angle.abs() <= 0.05 * 23.0 / 2.0
    };
    let size = scene.grid.size.map(|n| n as usize);
    let outside = window([size[0], size[1], 1], 0, 0, 99).filter(|(x, y)| !inside(*x, *y)).count();
    assert!(outside > 100, "{outside} pixels lie outside");
    let map = plane(size, |x, y| match (inside(x, y), x % 2) {
        (false, _) => 2.0,
        (true, odd) => odd as f64,
    });
    let odd = window(map.size, 0, 0, 99).filter(|(x, y)| inside(*x, *y) && x % 2 == 1).count();
    let share = odd as f64 / (size[0] * size[1] - outside) as f64;
    let got = growth_shares(&scene, &map);
    assert!(
        (got[0] - 1.0 + share).abs() < 1e-12 && (got[1] - share).abs() < 1e-12 && got[2] == 0.0,
        "{got:?}, {share}"
    );
}
