//! Median, Gaussian, bilateral and sigma filter.

use super::*;

/// True if `value` occurs, at most `below` values are smaller, and more than `below` are not larger.
fn is_ranked(values: &[f64], rank: usize, value: f64) -> bool {
    let below = values.iter().filter(|v| **v < value).count();
    let not_above = values.iter().filter(|v| **v <= value).count();
    values.contains(&value) && below <= rank && rank < not_above
}

/// Beyond the border the nearest pixel is repeated.
fn clamped(source: &Texels, x: usize, y: usize, radius: i64) -> Vec<f64> {
    let (x, y) = (x as i64, y as i64);
    (-radius..=radius)
        .flat_map(|j| (-radius..=radius).map(move |i| (i, j)))
        .map(|(i, j)| source.clamped(x + i, y + j, 0))
        .collect()
}

#[test]
fn a_median_has_as_many_below_as_above() {
    let source = noise([9, 7], 2);
    let got = filtered(&slices([9, 7], "median = true"), "median_slice", &source);
    for (x, y) in window(source.size, 0, 0, 9) {
        assert!(is_ranked(&clamped(&source, x, y, 1), 4, got.one(x, y, 0)), "at {x}, {y}");
    }
    let corner = rows([[1.0, 2.0, 9.0], [3.0, 4.0, 9.0], [9.0, 9.0, 9.0]]);
    let got = filtered(&slices([3, 3], "median = true"), "median_slice", &corner);
    // Of 1 1 2, 1 1 2, 3 3 4; and of all nine.
    assert_eq!((got.one(0, 0, 0), got.one(1, 1, 0), got.one(2, 2, 0)), (2.0, 9.0, 9.0));
}

/// The median of an even number of hits is the lower of the middle two; a majority of misses gives a miss.
#[test]
fn a_median_of_distances_lets_misses_vote_first() {
    for edge in [3, 5] {
        let source = holed([11, 8], edge);
        let got = filtered(&distances([11, 8], &format!("median = {edge}")), "median_distance", &source);
        let (mut missed, mut even) = (0, 0);
        for (x, y) in window(source.size, 0, 0, 11) {
            let all = clamped(&source, x, y, edge as i64 / 2);
            let hits: Vec<f64> = all.iter().copied().filter(|v| *v < MISS).collect();
            let got = got.one(x, y, 0);
            if hits.len() * 2 < all.len() {
                assert_eq!(got, MISS, "at {x}, {y}");
                missed += 1;
            } else {
                assert!(is_ranked(&hits, hits.len().div_ceil(2) - 1, got), "{got} of {hits:?}");
                even += usize::from(hits.len().is_multiple_of(2));
            }
        }
        assert!(even > 5 && (edge > 3 || missed > 0), "{even} of even number, {missed} missed");
    }
}

/// Weights of a Gaussian of deviation 1, whose window ends at 3.
fn weights() -> [f64; 7] {
    [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0].map(|i: f64| (-i * i / 2.0).exp())
}

#[test]
fn a_gaussian_spreads_a_point_by_its_weights_along_its_own_axis() {
    let all: f64 = weights().iter().sum();
    let point = plane([15, 15], |x, y| f64::from((x, y) == (7, 7)));
    for (name, axis) in [("gaussian_lateral", "lateral"), ("gaussian_depth", "depth")] {
        let scene = slices([15, 15], &format!("smooth = {{ {axis} = 1.0 }}"));
        let got = filtered(&scene, name, &point);
        let expected = plane([15, 15], |x, y| {
            let (along, across) = if axis == "lateral" { (x, y) } else { (y, x) };
            if across == 7 && (4..11).contains(&along) { weights()[along - 4] / all } else { 0.0 }
        });
        same(&got, &expected, name);
        assert!((got.values.iter().sum::<f64>() - 1.0).abs() < 1e-12, "what there is stays");
        // A slope is kept inside; at the border only existing pixels are weighted.
        let slope = plane([9, 9], |x, y| if axis == "lateral" { x as f64 } else { y as f64 });
        let got = filtered(&scene, name, &slope);
        let first = (1..4).map(|i| i as f64 * weights()[3 + i]).sum::<f64>() / weights()[3..].iter().sum::<f64>();
        let at = |n: usize| if axis == "lateral" { got.one(n, 4, 0) } else { got.one(4, n, 0) };
        assert!((at(4) - 4.0).abs() < 1e-12 && (at(5) - 5.0).abs() < 1e-12);
        assert!((at(0) - first).abs() < 1e-12 && (at(8) - (8.0 - first)).abs() < 1e-12, "{} {}", at(0), at(8));
    }
}

/// Pixels of 0.5 mm: a deviation of 1 mm is two of them.
#[test]
fn a_gaussian_has_the_requested_width() {
    let grid = Grid { size: [41, 3, 1], spacing: [0.5, 1.0, 1.0], origin: [0.0; 3] };
    let scene = scenes::scene(Geometry::Cartesian(grid), FLOATS, "slices = { smooth = { lateral = 1.0 } }");
    let got = filtered(&scene, "gaussian_lateral", &plane([41, 3], |x, _| f64::from(x == 20)));
    let variance: f64 = (0..41).map(|x| got.one(x, 1, 0) * (x as f64 - 20.0).powi(2)).sum();
    // Cut off at three deviations it is 1.2 % less than 4.
    assert!((variance - 3.951).abs() < 0.001, "{variance}");
    assert!((got.one(22, 1, 0) / got.one(20, 1, 0) - (-0.5f64).exp()).abs() < 1e-12);
}

#[test]
fn a_gaussian_across_slices_writes_only_the_slices_of_its_dispatch() {
    let scene = scene([2, 2, 9], "slices = { smooth = { elevation = 1.0 } }");
    let source = Texels::from_fn([2, 2, 9], 1, |[x, y, z], _| if z == 4 { 1.0 + (2 * y + x) as f64 } else { 0.0 });
    let (mut reads, mut writes) = (Arrays::default(), Arrays::default());
    reads.insert("source", source.clone());
    writes.insert("target", Texels::untouched([2, 2, 9], 1));
    let args = DispatchArgs { slice: 3, slices: 2, ..DispatchArgs::default() };
    pass("gaussian_elevation").reference(&scene, &args, &reads, &mut writes);
    let target = writes.get("target");
    let all: f64 = weights().iter().sum();
    for (x, y) in window(source.size, 0, 0, 2) {
        let value = 1.0 + (2 * y + x) as f64;
        assert!((target.one(x, y, 3) - value * weights()[2] / all).abs() < 1e-12);
        assert!((target.one(x, y, 4) - value * weights()[3] / all).abs() < 1e-12);
        assert!([0, 1, 2, 5, 6, 7, 8].iter().all(|z| target.one(x, y, *z).is_nan()));
    }
}

/// One slice of a value between others of 0.5: 8/6 and -1/6 of what it has more, clamped; the border is repeated.
#[test]
fn slices_are_sharpened_across_elevation_by_their_kernel() {
    let scene = scene([2, 1, 6], "ray = { elevation = 'bspline-sharp' }");
    let source = Texels::from_fn([2, 1, 6], 1, |[x, _, z], _| match (x, z) {
        (0, 2) => 0.74,
        (1, 0) => 0.8,
        (1, 5) => 1.0,
        _ => 0.5,
    });
    let (mut reads, mut writes) = (Arrays::default(), Arrays::default());
    reads.insert("source", source);
    writes.insert("target", Texels::untouched([2, 1, 6], 1));
    let args = DispatchArgs { slice: 0, slices: 6, ..DispatchArgs::default() };
    pass("gaussian_elevation").reference(&scene, &args, &reads, &mut writes);
    let target = writes.get("target");
    for (z, expected) in [0.5, 0.46, 0.82, 0.46, 0.5, 0.5].into_iter().enumerate() {
        assert!((target.one(0, 0, z) - expected).abs() < 1e-12, "{z}: {}", target.one(0, 0, z));
    }
    for (z, expected) in [0.85, 0.45, 0.5, 0.5, 0.5 - 0.5 / 6.0, 1.0].into_iter().enumerate() {
        assert!((target.one(1, 0, z) - expected).abs() < 1e-12, "{z}: {}", target.one(1, 0, z));
    }
    // A wave of w radians a slice: the kernel passes (4 - cos w) / 3, the B-spline at a slice (2 + cos w) / 3.
    let w = 0.4f64;
    let wave = Texels::from_fn([1, 1, 64], 1, |[_, _, z], _| 0.5 + 0.3 * (w * z as f64).cos());
    let scene = self::scene([1, 1, 64], "ray = { elevation = 'bspline-sharp' }");
    reads.insert("source", wave.clone());
    writes.insert("target", Texels::untouched([1, 1, 64], 1));
    let args = DispatchArgs { slice: 0, slices: 64, ..DispatchArgs::default() };
    pass("gaussian_elevation").reference(&scene, &args, &reads, &mut writes);
    let passed = (4.0 - w.cos()) / 3.0 * (2.0 + w.cos()) / 3.0;
    for z in 5..59 {
        let met = writes.get("target").bspline_across_slices([0.0, 0.0, z as f64]);
        assert!((met - 0.5 - passed * (wave.one(0, 0, z) - 0.5)).abs() < 1e-12, "slice {z}");
    }
    assert!(1.0 - passed < 0.003, "nearly interpolating: {passed}");
}

/// Between slices the B-spline has a variance of 1/3 slice^2 and linear interpolation 1/6 on average.
#[test]
fn the_gaussian_across_slices_leaves_the_bspline_its_part_of_the_variance() {
    for elevation in [0.0, 0.3, 0.5, 0.8, 2.0] {
        let of = |ray: &str| {
            let toml = format!(
                "slices = {{ smooth = {{ lateral = 1.0, elevation = {elevation} }} }}\nray.elevation = '{ray}'"
            );
            self::scene([3, 3, 9], &toml)
        };
        let ([a, b, linear], [c, d, bspline]) = (of("linear").smoothing(), of("bspline").smoothing());
        assert_eq!((a, b, linear), (c, d, elevation));
        let left = elevation * elevation + 1.0 / 6.0 - 1.0 / 3.0;
        assert!((bspline * bspline - left.max(0.0)).abs() < 1e-12, "{elevation}: {bspline}");
        assert_eq!(of("bspline").filters_across_slices(), left > 0.0, "{elevation}");
    }
    // The variance of the B-spline itself: of a point, over all places between slices.
    let point = Texels::from_fn([1, 1, 9], 1, |[_, _, z], _| f64::from(z == 4));
    let places = (0..8000).map(|n| f64::from(n) * 1e-3);
    let moments = places.fold([0.0; 2], |[sum, squares], z| {
        let weight = point.bspline_across_slices([0.0, 0.0, z]) * 1e-3;
        [sum + weight, squares + weight * (z - 4.0).powi(2)]
    });
    assert!((moments[0] - 1.0).abs() < 1e-6 && (moments[1] - 1.0 / 3.0).abs() < 1e-6, "{moments:?}");
}

/// Every hit of a window is weighted by its distance and its similarity; misses stay and have no weight.
#[test]
fn a_bilateral_filter_weighs_by_place_and_by_distance() {
    let source = holed([9, 8], 7);
    let got =
        filtered(&distances([9, 8], "bilateral = { pixels = 0.8, distance = 1.5 }"), "bilateral_distance", &source);
    let bell = |away: f64, deviation: f64| (-(away / deviation).powi(2) / 2.0).exp();
    let expected = plane([9, 8], |x, y| {
        let here = source.one(x, y, 0);
        let (mut sum, mut weights) = (0.0, 0.0);
        // Twice 0.8 pixels, rounded up.
        for (i, j) in window(source.size, x, y, 2).filter(|(i, j)| source.one(*i, *j, 0) < MISS) {
            let there = source.one(i, j, 0);
            let weight = bell(i.abs_diff(x) as f64, 0.8) * bell(j.abs_diff(y) as f64, 0.8) * bell(there - here, 1.5);
            sum += weight * there;
            weights += weight;
        }
        if here < MISS { sum / weights } else { MISS }
    });
    same(&got, &expected, "bilateral");
    // Two plates further apart than any weight are not changed.
    let plates = plane([6, 4], |x, _| if x < 3 { 20.0 } else { 60.0 });
    same(
        &filtered(&distances([6, 4], "bilateral = { pixels = 1.0, distance = 1.0 }"), "bilateral_distance", &plates),
        &plates,
        "plates",
    );
}

/// The mean of the pixels of a window within the range; the mean of the four neighbours if no more than K pixels are.
fn lee(source: &Texels, radius: usize, few: usize, range: impl Fn(f64) -> f64) -> (Texels, usize) {
    let lone = std::cell::Cell::new(0);
    let texels = plane([source.size[0], source.size[1]], |x, y| {
        let here = source.one(x, y, 0);
        let hits = |at: &mut dyn Iterator<Item = (usize, usize)>| -> Vec<f64> {
            at.map(|(i, j)| source.one(i, j, 0)).filter(|v| *v < MISS).collect()
        };
        if here == MISS {
            return MISS;
        }
        let all = hits(&mut window(source.size, x, y, radius));
        let close: Vec<f64> =
            all.iter().copied().filter(|v| *v >= here - range(here) && *v <= here + range(here)).collect();
        if close.len() > few || close.len() == all.len() {
            return mean(&close);
        }
        lone.set(lone.get() + 1);
        let four = hits(&mut window(source.size, x, y, 1).filter(|(i, j)| i.abs_diff(x) + j.abs_diff(y) == 1));
        if four.is_empty() { here } else { mean(&four) }
    });
    (texels, lone.get())
}

#[test]
fn a_sigma_filter_averages_only_similar_samples() {
    for (window, few) in [(3, 1), (5, 2), (7, 3)] {
        let source = noise([10, 8], window);
        let got = filtered(
            &slices([10, 8], &format!("sigma = {{ window = {window}, sigma = 0.03125 }}")),
            "sigma_slice",
            &source,
        );
        let (expected, lone) = lee(&source, window / 2, few, |_| 0.0625);
        same(&got, &expected, "additive");
        assert!(lone > 0, "some pixel has too few like it");
        let of = format!("sigma = {{ window = {window}, sigma = 0.125, noise = 'multiplicative' }}");
        let (expected, lone) = lee(&source, window / 2, few, |here| 0.25 * here);
        same(&filtered(&slices([10, 8], &of), "sigma_slice", &source), &expected, "multiplicative");
        assert!(lone > 0);
    }
}

#[test]
fn a_sigma_filter_of_distances_ignores_misses() {
    for seed in 0..4 {
        let source = holed([10, 8], 40 + seed);
        let got = filtered(&distances([10, 8], "sigma = { window = 5, sigma = 0.0625 }"), "sigma_distance", &source);
        let (expected, lone) = lee(&source, 2, 2, |_| 0.125);
        same(&got, &expected, "distances");
        assert!(lone > 0);
    }
    // A hit between misses is kept; a hit that is similar only to itself takes the mean of its neighbours.
    let lonely = rows([[MISS, MISS, MISS], [MISS, 7.0, MISS], [MISS, MISS, MISS]]);
    let scene = distances([3, 3], "sigma = { window = 3, sigma = 0.1 }");
    same(&filtered(&scene, "sigma_distance", &lonely), &lonely, "a lone hit");
    let odd = rows([[20.0, MISS, 20.0], [MISS, 7.0, 30.0], [20.0, 40.0, 20.0]]);
    assert_eq!(filtered(&scene, "sigma_distance", &odd).one(1, 1, 0), 35.0);
    let walled = rows([[20.0, MISS, 20.0], [MISS, 7.0, MISS], [20.0, MISS, 20.0]]);
    assert_eq!(filtered(&scene, "sigma_distance", &walled).one(1, 1, 0), 7.0, "no neighbour to take");
}

/// At exactly two sigma a pixel counts.
#[test]
fn a_pixel_at_the_end_of_the_range_counts_as_similar() {
    let source = rows([[0.75, 0.25, 0.5], [0.75, 0.5, 0.0], [1.0, 1.0, 1.0]]);
    let got = filtered(&slices([3, 3], "sigma = { window = 3, sigma = 0.125 }"), "sigma_slice", &source);
    assert_eq!(got.one(1, 1, 0), (0.75 + 0.25 + 0.5 + 0.75 + 0.5) / 5.0);
}

#[test]
fn a_sigma_filter_of_pictures_filters_each_channel_separately() {
    let source = colours([7, 6], 5);
    let got = filtered(&picture([7, 6], "sigma = { window = 3, sigma = 0.0625 }"), "sigma_picture", &source);
    for c in 0..4 {
        same(&channel(&got, c), &lee(&channel(&source, c), 1, 1, |_| 0.125).0, "a channel");
    }
}
