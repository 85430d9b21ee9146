//! The estimators of the enhanced sigma filter against values by hand, and the growth of its windows against a brute-force count.

use crate::common::gpu::*;
use crate::common::growth::growth_shares;
use crate::filters::{by_reference, on_device, plane, texels};
use echolume::Source;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Input;
use echolume::low_level::source::Recording;

#[test]
fn estimators_by_hand() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let mut run = |filter: &str, size, source: &Texels, at: [usize; 2]| {
        let scene = plane(size, filter);
        let got = on_device(&mut single, &scene, "estimator_slice", source).one(at[0], at[1], 0);
        assert!((by_reference(&scene, "estimator_slice", source).one(at[0], at[1], 0) - got).abs() < 1e-6, "{filter}");
        got
    };
    // Four at 0.4, four at 0.7 around 0.2: (20 x 0.4 + 8 x 0.7) / 28 is half of it.
    let star = texels([3, 3], |x, y| match (x + y) % 2 {
        _ if (x, y) == (1, 1) => 0.2,
        0 => 0.7,
        _ => 0.4,
    });
    let got = run("estimator = 'gradient-inverse'", [3, 3], &star, [1, 1]);
    assert!((got - (0.1 + 0.5 * 13.6 / 28.0)).abs() < 1e-6, "{got}");
    // Four neighbours 0.2 away at k = 0.1 conduct 1/5 each.
    let got = run("estimator = 'perona-malik', estimator_edge = 0.1", [3, 3], &star, [1, 1]);
    assert!((got - (0.2 + 0.2 * 4.0 * 0.2 / 5.0)).abs() < 1e-6, "{got}");
    let got = run("estimator = 'perona-malik', estimator_edge = 0.0", [3, 3], &star, [1, 1]);
    assert!((got - 0.2).abs() < 1e-7, "{got}");
    let got = run("estimator = 'median'", [3, 3], &star, [1, 1]);
    assert!((got - 0.4).abs() < 1e-7, "{got}");
    // A dark stripe next to a bright slope: the mask away from the stripe varies least, 24/49 of a squared step of
    // the slope against 28/49 towards its corners; it holds the pixel, three a step on, and three two steps on.
    let step = texels([7, 7], |x, _| if x < 3 { 0.1 } else { 0.8 + 0.01 * x as f64 });
    let got = run("estimator = 'nagao-matsuyama'", [7, 7], &step, [3, 3]);
    assert!((got - (0.83 + 0.01 * 9.0 / 7.0)).abs() < 1e-6, "{got}");
}

#[test]
fn planes_take_perona_malik_for_a_centre_and_renderings_the_median() {
    use echolume::low_level::scene::Estimator;
    for (mode, usual) in [("sr", Estimator::Median), ("vr", Estimator::Median), ("mpr", Estimator::PeronaMalik)] {
        let scene = scene(cartesian([8, 8, 8]), BYTES, &format!("mode = '{mode}'"));
        let mut enhanced = echolume::low_level::scene::EnhancedSigma::default();
        assert_eq!(scene.centre(enhanced), usual, "{mode}");
        enhanced.centre = Some(Estimator::GradientInverse);
        assert_eq!(scene.centre(enhanced), Estimator::GradientInverse, "{mode}");
    }
}

/// How far a window grows, by a brute-force count, and whether a pixel is so near the end of the range that f32 may differ.
fn grown(source: &Texels, centre: f64, at: [usize; 2], e: echolume::low_level::scene::EnhancedSigma) -> (u32, bool) {
    let range = 2.0 * e.sigma;
    let count = |radius: i64, close: &dyn Fn(f64) -> bool| {
        let mut n = 0;
        for y in 0..source.size[1] {
            for x in 0..source.size[0] {
                let away = (x as i64 - at[0] as i64).abs().max((y as i64 - at[1] as i64).abs());
                n += u32::from(away <= radius && close((source.one(x, y, 0) - centre).abs()));
            }
        }
        n
    };
    let wanted = count(i64::from(e.window / 2), &|_| true);
    let most = (e.largest - e.window) / 2;
    let rings = (0..most).find(|r| count(i64::from(e.window / 2 + r), &|d| d <= range) >= wanted).unwrap_or(most);
    (rings, count(i64::from(e.largest / 2), &|d| (d - range).abs() < 2e-6) > 0)
}

#[test]
fn growth_is_what_a_count_by_brute_force_finds() {
    let device = Device::new();
    let size = [48, 36];
    let mut random = Noise(12);
    let rough: Vec<f64> = (0..size[0] * size[1]).map(|_| random.range(-0.12, 0.12)).collect();
    let body = |x: usize, y: usize| if (x as f64 - 20.0).hypot(y as f64 - 16.0) < 11.0 { 0.7 } else { 0.25 };
    let source = texels(size, |x, y| body(x, y) + rough[y * size[0] + x]);
    for (window, centre) in [(3u32, "median"), (5, "perona-malik"), (7, "median")] {
        let filter = format!(
            "enhanced_sigma = {{ window = {window}, largest = 17, sigma = 0.06, centre = '{centre}', growth = true }}"
        );
        let scene = plane(size, &filter);
        let e = scene.settings.slices.enhanced_sigma.expect("enhanced");
        // Through the renderer: the map that the plan keeps.
        let renderer = &mut rendered(&device, scene.clone(), std::slice::from_ref(&source));
        renderer.picture().expect("picture");
        let map = renderer.read(Slot::Growth).expect("read").expect("there");
        let near = |x: usize, y: usize, dx: i64, dy: i64| source.clamped(x as i64 + dx, y as i64 + dy, 0);
        let (mut unsure, mut counts) = (0, vec![0.0; 9]);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let here = source.one(x, y, 0);
                let estimate = if centre == "median" {
                    let mut nine: Vec<f64> = (0..9).map(|i| near(x, y, i % 3 - 1, i / 3 - 1)).collect();
                    nine.sort_by(f64::total_cmp);
                    nine[4]
                } else {
                    let g = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy)| near(x, y, dx, dy) - here);
                    here + 0.2 * g.map(|g| g / (1.0 + g * g / 0.01)).iter().sum::<f64>()
                };
                let (rings, is_unsure) = grown(&source, estimate, [x, y], e);
                counts[rings as usize] += 1.0 / source.values.len() as f64;
                unsure += u32::from(is_unsure);
                assert!(is_unsure || map.one(x, y, 0) == f64::from(rings), "{filter} at {x}, {y}");
            }
        }
        let unsure = f64::from(unsure) / source.values.len() as f64;
        assert!(unsure < 0.01, "{unsure} of the pixels prove nothing");
        let shares = growth_shares(&scene, &map);
        println!("{filter}: {:?}", shares.iter().map(|s| (s * 1000.0).round() / 10.0).collect::<Vec<_>>());
        assert_eq!(shares.len() as u32, (17 - window) / 2 + 1);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        assert!(shares.iter().zip(&counts).all(|(a, b)| (a - b).abs() <= unsure + 1e-9), "{shares:?}, {counts:?}");
        assert!(shares[0] > 0.05 && shares[1..].iter().any(|s| *s > 0.05), "some grow and some do not");
    }
    let silent = plane(size, "enhanced_sigma = { window = 3, largest = 17, sigma = 0.06 }");
    assert!(!Plan::new(&silent).slots.contains(&Slot::Growth));
}

#[test]
fn growth_beyond_the_sector_does_not_count() {
    let scene =
        scene(Geometry::Sweep(wobbler()), BYTES, "slices = { pixels = 90, enhanced_sigma = { growth = true } }");
    let [width, height] = scene.grid.size.map(|n| n as usize);
    let map = texels([width, height], |column, row| {
        let (x, y) = scene.grid.place(column as f64, row as f64);
        let beyond = (x.atan2(y).abs() - 0.05 * 11.5) * x.hypot(y);
        let outside = beyond.max(22.0 - x.hypot(y)).max(x.hypot(y) - 22.0 - 63.0 * 0.8);
        // Pixels on both sides of the border are similar to those inside.
        if outside > 1.0 { 3.0 } else { 1.0 }
    });
    assert!(map.values.iter().filter(|v| **v == 3.0).count() > 500);
    let shares = growth_shares(&scene, &map);
    assert_eq!((shares[0], shares[1], shares[3]), (0.0, 1.0, 0.0));
}

/// The table of thesis 5.5 (Tables 7-9) for a simulated body: windows of 3 to 13 to start with, up to the sizes where the
/// thesis' own tables end.
#[test]
fn the_larger_a_window_starts_the_more_often_it_grows() {
    let device = Device::new();
    let mut recording = Recording::open(&data("wobbler-4dc7/sweep.mha"), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let geometry = recording.geometry(0);
    let mut frame = recording.next_frame().expect("frame").expect("a frame");
    while frame.slice != 15 {
        frame = recording.next_frame().expect("frame").expect("a frame");
    }
    let mut whole = Vec::new();
    for (window, largest) in [(3, 17), (5, 19), (7, 19), (9, 21), (11, 21), (13, 23)] {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [8, 8] }}\n\
             slices = {{ pixels = 200, enhanced_sigma = {{ window = {window}, largest = {largest}, sigma = 0.1, growth = true }} }}"
        );
        let scene = scene(geometry.clone(), input, &toml);
        let mut renderer = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
        renderer.show(0).expect("show");
        let shares = growth_shares(&scene, &renderer.read(Slot::Growth).expect("read").expect("there"));
        println!(
            "{window:2} to {largest}: {:?} %",
            shares.iter().map(|s| (s * 1000.0).round() / 10.0).collect::<Vec<_>>()
        );
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        whole.push(shares);
    }
    // More pixels have to be similar at once.
    assert!(whole.windows(2).all(|w| w[1][0] < w[0][0]), "{whole:?}");
    // Few are cut off where the tables end.
    assert!(whole.iter().all(|s| s.last().is_some_and(|last| *last < 0.05)), "{whole:?}");
}
