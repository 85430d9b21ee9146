//! The sigma filters: known answers, extremes, misses, refusals; plans of every filter in a row.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::passes::{Arrays, DispatchArgs, Frequency, MISS, Pass, Slot, Texels, by_name, is_hit};
use echolume::low_level::plan::Plan;
use echolume::low_level::scene::Scene;
use std::collections::BTreeMap;

pub const CENTRES: [&str; 4] = ["median", "perona-malik", "gradient-inverse", "nagao-matsuyama"];

/// One slice in f32, so that the result of a filter is read before the volume's format rounds it.
pub fn plane(size: [usize; 2], filters: &str) -> Scene {
    scene(cartesian([size[0], size[1], 1]), FLOATS, &format!("slices = {{ format = 'r32f', {filters} }}"))
}

/// Values that f32 holds.
pub fn texels(size: [usize; 2], f: impl Fn(usize, usize) -> f64) -> Texels {
    Texels::from_fn([size[0], size[1], 1], 1, |[x, y, _], _| f64::from(f(x, y) as f32))
}

pub fn noise(size: [usize; 2], seed: u64) -> Texels {
    let mut noise = Noise(seed);
    let values: Vec<f64> = (0..size[0] * size[1]).map(|_| noise.next()).collect();
    texels(size, |x, y| values[y * size[0] + x])
}

/// All iterations of one pass in a row, each on the result of the previous one.
fn filtered(
    scene: &Scene,
    name: &str,
    source: &Texels,
    mut run: impl FnMut(&'static Pass, &DispatchArgs, &Arrays) -> Arrays,
) -> Texels {
    let pass = by_name(name).expect("pass");
    assert!(pass.is_needed(scene), "{name}: {:?}", pass.needed(scene));
    let mut held: BTreeMap<Slot, Texels> = BTreeMap::new();
    let mut result = source.clone();
    for iteration in 0..(pass.repeat)(scene) {
        let args = DispatchArgs { iteration, ..DispatchArgs::default() };
        let mut inputs = Arrays::default();
        for bind in pass.reads(scene, &args) {
            // Only the source of the first step was not written by a dispatch.
            inputs.insert(bind.name, held.get(&bind.slot).unwrap_or(source).clone());
        }
        let written = run(pass, &args, &inputs);
        for bind in pass.writes(scene, &args) {
            result = written.get(bind.name).clone();
            held.insert(bind.slot, result.clone());
        }
    }
    result
}

pub fn on_device(single: &mut PassRunner, scene: &Scene, name: &str, source: &Texels) -> Texels {
    filtered(scene, name, source, |pass, args, held| single.run(scene, pass, args, held, 0.654).expect("dispatch"))
}

pub fn by_reference(scene: &Scene, name: &str, source: &Texels) -> Texels {
    filtered(scene, name, source, |pass, args, held| reference(scene, pass, args, held))
}

fn reference(scene: &Scene, pass: &Pass, args: &DispatchArgs, inputs: &Arrays) -> Arrays {
    let mut written = Arrays::default();
    for bind in pass.writes(scene, args) {
        let size = bind.slot.array_size(scene);
        written.insert(bind.name, Texels::untouched(size, bind.slot.format(scene).channels()));
    }
    pass.reference(scene, args, inputs, &mut written);
    written
}

pub fn largest_difference(a: &Texels, b: &Texels) -> f64 {
    assert_eq!(a.values.len(), b.values.len());
    // Not f64::max, which drops NaN.
    a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, |m, d| if d <= m { m } else { d })
}

/// The sigma filter and the enhanced one about each centre, as settings of a slice, with the pass that runs.
fn sigma_filters(window: u32, largest: u32, sigma: &str) -> Vec<(String, &'static str)> {
    let enhanced = CENTRES.map(|centre| {
        let of = format!("window = {window}, largest = {largest}, sigma = {sigma}, centre = '{centre}'");
        (format!("enhanced_sigma = {{ {of} }}"), "enhanced_sigma_slice")
    });
    let lee = (format!("sigma = {{ window = {window}, sigma = {sigma} }}"), "sigma_slice");
    [vec![lee], enhanced.to_vec()].concat()
}

#[test]
fn filters_keep_a_constant_and_remove_a_hot_pixel() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let size = [21, 15];
    for (filter, pass) in sigma_filters(5, 11, "0.1") {
        let scene = plane(size, &filter);
        for value in [0.0, 0.37, 1.0] {
            let flat = texels(size, |_, _| value);
            assert_eq!(on_device(&mut single, &scene, pass, &flat), flat, "{filter} on {value}");
        }
        for at in [(10, 7), (0, 0), (20, 3)] {
            let hot = texels(size, |x, y| f64::from((x, y) == at));
            let got = on_device(&mut single, &scene, pass, &hot);
            assert!(got.values.iter().all(|v| *v == 0.0), "{filter}: a hot pixel at {at:?} is left");
        }
    }
}

#[test]
fn an_infinite_sigma_is_the_box_mean_and_a_sigma_of_0_is_no_pass() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    // The second window is larger than the picture.
    for (size, window) in [([23, 17], 5u32), ([5, 4], 63), ([1, 1], 3)] {
        let source = noise(size, 3);
        let radius = window as usize / 2;
        let mean = texels(size, |x, y| {
            let (left, right) = (x.saturating_sub(radius), (x + radius).min(size[0] - 1));
            let (low, high) = (y.saturating_sub(radius), (y + radius).min(size[1] - 1));
            let sum: f64 =
                (low..=high).flat_map(|j| (left..=right).map(move |i| (i, j))).map(|(i, j)| source.one(i, j, 0)).sum();
            sum / ((right - left + 1) * (high - low + 1)) as f64
        });
        for (filter, pass) in sigma_filters(window, 63, "inf") {
            // Fewer pixels than K, which depends on the window, but all that exist.
            let got = on_device(&mut single, &plane(size, &filter), pass, &source);
            let error = largest_difference(&got, &mean);
            assert!(error < 1e-6, "{filter} on {size:?}: {error}");
        }
    }
    for (filter, pass) in sigma_filters(5, 11, "0.0") {
        let scene = plane([9, 9], &filter);
        assert!(!by_name(pass).expect("pass").is_needed(&scene), "{filter}");
    }
}

#[test]
fn noise_stays_in_range_and_multiplicative_noise_is_judged_by_the_centre() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let size = [33, 27];
    for (filter, pass) in sigma_filters(7, 19, "0.05") {
        let got = on_device(&mut single, &plane(size, &filter), pass, &noise(size, 8));
        assert!(got.values.iter().all(|v| (0.0..=1.0).contains(v)), "{filter} leaves the range");
    }
    // Two flat halves whose noise is a tenth of them: 2 sigma additive spans all of the dark half and little of the bright.
    let mut random = Noise(4);
    let rough: Vec<f64> = (0..size[0] * size[1]).map(|_| random.range(-0.1, 0.1)).collect();
    let level = |x: usize| if x < 16 { 0.08 } else { 0.8 };
    let source = texels(size, |x, y| level(x) * (1.0 + rough[y * size[0] + x]));
    let spread = |got: &Texels, columns: std::ops::Range<usize>| {
        let off = (4..23).flat_map(|y| columns.clone().map(move |x| got.one(x, y, 0) / level(x) - 1.0));
        let squares: Vec<f64> = off.map(|d| d * d).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let run = |single: &mut PassRunner, settings: &str| {
        let scene = plane(size, &format!("sigma = {{ window = 7, {settings} }}"));
        on_device(single, &scene, "sigma_slice", &source)
    };
    let multiplicative = run(&mut single, "sigma = 0.1, noise = 'multiplicative'");
    let additive = run(&mut single, "sigma = 0.01");
    let (dark, bright) = (4..12, 20..29);
    // The multiplicative filter leaves the same share of noise in both halves, the additive one does not.
    let even = spread(&multiplicative, bright.clone()) / spread(&multiplicative, dark.clone());
    assert!((0.8..1.25).contains(&even), "{even}");
    let uneven = spread(&additive, bright) / spread(&additive, dark);
    assert!(uneven > 2.0, "{uneven}");
}

/// Blocks of 3 x 3 samples of 8 bits, a centre of `level` and, in this order, what lies `away` levels from it. Levels of which one would leave
/// 0..255 are left out.
fn blocks(range: fn(i32) -> i32, away: fn(i32) -> [i32; 8]) -> (Texels, Vec<i32>) {
    let around = |level: i32| away(range(level)).map(|d| level + d);
    let fits = |level: &i32| (range(*level) > 0) && around(*level).iter().all(|v| (0..=255).contains(v));
    let levels: Vec<i32> = (0..=255).filter(fits).collect();
    let picture = texels([3, 3 * levels.len()], |x, y| {
        let n = 3 * (y % 3) + x;
        let level = levels[y / 3];
        f64::from(if n == 4 { level } else { around(level)[n - usize::from(n > 4)] }) / 255.0
    });
    (picture, levels)
}

/// Twice a sigma of 0.1 is 51 of 255 levels: what is 51 levels away is within the interval (5-3), at every level, however f32 rounds their
/// difference, and what is 52 away is not. The same of a fifth of the centre, for multiplicative noise.
#[test]
fn samples_at_the_very_end_of_the_range_are_within_it() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let additive: fn(i32) -> i32 = |_| 51;
    let multiplicative: fn(i32) -> i32 = |level| if level % 5 == 0 { level / 5 } else { 0 };
    for (noise, range) in [("additive", additive), ("multiplicative", multiplicative)] {
        // Four at the upper end, two at the lower, two a level beyond: the centre is the median, and the mean of seven two ranges / 7 off.
        let (mixed, levels) = blocks(range, |r| [r, -r, r, -r - 1, -r - 1, r, -r, r]);
        assert!(levels.len() > 35, "{levels:?}");
        let settings = format!("sigma = 0.1, noise = '{noise}'");
        let growing =
            format!("enhanced_sigma = {{ window = 3, largest = 3, centre = 'median', growth = true, {settings} }}");
        let lee = format!("sigma = {{ window = 3, {settings} }}");
        for (filter, pass) in [(&lee, "sigma_slice"), (&growing, "enhanced_sigma_slice")] {
            for input in [FLOATS, BYTES] {
                let of = format!("slices = {{ format = 'r32f', {filter} }}");
                let scene = scene(cartesian([3, 3 * levels.len(), 1]), input, &of);
                let (got, reference) =
                    (on_device(&mut single, &scene, pass, &mixed), by_reference(&scene, pass, &mixed));
                for (n, level) in levels.iter().enumerate() {
                    let expected = (f64::from(*level) + f64::from(2 * range(*level)) / 7.0) / 255.0;
                    for (by, picture) in [("device", &got), ("reference", &reference)] {
                        let value = picture.one(1, 3 * n + 1, 0);
                        assert!(
                            (value - expected).abs() < 1e-6,
                            "{filter} at level {level}, {by}: {value}, {expected}"
                        );
                    }
                }
            }
        }
        // All nine are within the range, so that no window grows.
        let (ends, levels) = blocks(range, |r| [r, -r, r, -r, -r, r, -r, r]);
        let scene = plane([3, 3 * levels.len()], &growing.replace("largest = 3", "largest = 5"));
        for rings in
            [on_device(&mut single, &scene, "growth_slice", &ends), by_reference(&scene, "growth_slice", &ends)]
        {
            assert!((0..levels.len()).all(|n| rings.one(1, 3 * n + 1, 0) == 0.0), "{noise}: {:?}", rings.values);
        }
    }
}

#[test]
fn a_second_sigma_filter_runs_on_the_result_of_the_first() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let source = noise([33, 27], 5);
    let once = plane([33, 27], "sigma = { window = 5, sigma = 0.2 }");
    let twice = plane([33, 27], "sigma = { window = 5, sigma = 0.2, repeat = 2 }");
    let first = on_device(&mut single, &once, "sigma_slice", &source);
    let both = on_device(&mut single, &twice, "sigma_slice", &source);
    assert_eq!(both, on_device(&mut single, &once, "sigma_slice", &first));
    assert!(largest_difference(&both, &first) > 0.01);
}

#[test]
fn no_filter_of_distances_invents_a_surface() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let mut random = Noise(2);
    let rough: Vec<f64> = (0..80 * 80).map(|_| random.range(-0.3, 0.3)).collect();
    // Two plates 15 mm apart, nothing below, a hole in one and a single hit elsewhere.
    let source = texels([80, 80], |x, y| match (x * 3 + y < 140, y > 55) {
        _ if (x, y) == (60, 70) => 38.0,
        (_, true) => MISS,
        _ if (x, y) == (10, 20) => MISS,
        (true, _) => 30.0 + rough[y * 80 + x],
        (false, _) => 45.0 + rough[y * 80 + x],
    });
    let centres = CENTRES.map(|c| {
        (
            format!("enhanced_sigma = {{ window = 5, largest = 13, sigma = 0.2, centre = '{c}', edge = 0.5 }}"),
            "enhanced_sigma_distance",
        )
    });
    let diffusions = ["quotient", "exponential"].map(|c| {
        (format!("perona_malik = {{ edge = 0.5, conductance = '{c}', repeat = 8 }}"), "perona_malik_distance")
    });
    for (filter, pass) in centres.into_iter().chain(diffusions) {
        let toml = format!("mode = 'sr'\npicture = {{ size = [80, 80] }}\ndistance = {{ {filter} }}");
        let scene = scene(cartesian([8, 8, 8]), FLOATS, &toml);
        let got = on_device(&mut single, &scene, pass, &source);
        let is_near = |v: f64, plate: f64| (v - plate).abs() < 0.5;
        for (before, after) in source.values.iter().zip(&got.values) {
            assert_eq!(is_hit(*before), is_hit(*after), "{filter}: hits stay hits and misses misses");
            assert!(
                *before == 38.0 || !is_hit(*after) || is_near(*after, if *before < 35.0 { 30.0 } else { 45.0 }),
                "{filter}: {before} became {after}"
            );
        }
        assert_eq!(got.one(60, 70, 0), 38.0, "{filter}: a hit that is alone stays");
        let spread = |map: &Texels| {
            let inside: Vec<f64> = (25..50).flat_map(|y| (2..22).map(move |x| map.one(x, y, 0) - 30.0)).collect();
            (inside.iter().map(|v| v * v).sum::<f64>() / inside.len() as f64).sqrt()
        };
        assert!(spread(&got) < 0.6 * spread(&source), "{filter} smooths: {} of {}", spread(&got), spread(&source));
    }
}

#[test]
fn filter_settings_beyond_a_limit_are_refused_by_name_and_limit() {
    for (toml, words) in [
        ("distance = { sigma = { noise = 'multiplicative' } }", ["distance.sigma", "additive"]),
        ("distance = { enhanced_sigma = { noise = 'multiplicative' } }", ["distance.enhanced_sigma", "additive"]),
        ("distance = { enhanced_sigma = { growth = true } }", ["distance.enhanced_sigma", "slices only"]),
        ("post = { enhanced_sigma = { growth = true } }", ["post.enhanced_sigma", "slices only"]),
        ("slices = { enhanced_sigma = { window = 9, largest = 7 } }", ["slices.enhanced_sigma", "less than window 9"]),
        ("slices = { enhanced_sigma = { edge = -1.0 } }", ["slices.enhanced_sigma", "at least 0"]),
        ("slices = { enhanced_sigma = { edge = nan } }", ["slices.enhanced_sigma", "at least 0"]),
        ("slices = { estimator_edge = nan }", ["slices.estimator_edge", "0"]),
        ("slices = { perona_malik = { step = 0.2500001 } }", ["0.25", "aos"]),
        ("post = { perona_malik = { step = 10.0 } }", ["0.25", "aos"]),
        ("slices = { perona_malik = { step = 0.0 } }", ["slices.perona_malik", "0.25"]),
        ("slices = { perona_malik = { scheme = 'aos', step = inf } }", ["slices.perona_malik", "1e9"]),
        ("slices = { perona_malik = { repeat = 0 } }", ["slices.perona_malik", "1..=1000"]),
        ("distance = { perona_malik = { scheme = 'aos' } }", ["distance.perona_malik", "explicit"]),
        ("slices = { smooth = { kernel = 4 } }", ["slices.smooth.kernel", "3 or 5"]),
        ("slices = { smooth = { kernel = 3, depth = 1.0 } }", ["slices.smooth.kernel", "instead"]),
    ] {
        let settings = settings(toml);
        let error = Scene::new(cartesian([8, 8, 8]), BYTES, settings).expect_err(toml).to_string();
        assert!(words.iter().all(|w| error.contains(w)) && !error.contains('\n'), "{toml}: {error}");
    }
}

/// Runs the references of every step of a plan with this frequency on the contents of the slots.
pub fn run_by_references(scene: &Scene, frequency: Frequency, slots: &mut BTreeMap<Slot, Texels>) {
    for (_, step) in Plan::new(scene).steps_of(frequency) {
        let args = DispatchArgs { iteration: step.iteration, ..DispatchArgs::default() };
        let mut inputs = Arrays::default();
        for bind in step.pass.reads(scene, &args) {
            inputs
                .insert(bind.name, slots.get(&bind.slot).unwrap_or_else(|| panic!("{:?} is empty", bind.slot)).clone());
        }
        let written = reference(scene, step.pass, &args, &inputs);
        for bind in step.pass.writes(scene, &args) {
            slots.insert(bind.slot, written.get(bind.name).clone());
        }
    }
}

#[test]
fn a_plan_of_every_filter_is_what_its_references_make_in_a_row() {
    let device = Device::new();
    let size = [37, 29];
    let source = noise(size, 21);
    let before = "median = true, estimator = 'gradient-inverse', sigma = { window = 5, sigma = 0.4 }, enhanced_sigma = { window = 3, largest = 9, sigma = 0.4, growth = true }";
    for (after, flat) in [
        (
            "perona_malik = { scheme = 'aos', step = 3.0, repeat = 2 }",
            "perona_malik = { scheme = 'aos', step = 3.0, repeat = 2 }",
        ),
        ("perona_malik = { repeat = 3 }, blur = true", "sigma = { sigma = 0.3 }, perona_malik = { repeat = 3 }"),
    ] {
        let toml = format!(
            "mode = 'vr'\nray = {{ sampling = 'exact' }}\npicture = {{ size = [31, 23] }}\nslices = {{ format = 'r32f', {before}, {after} }}\npost = {{ {flat} }}"
        );
        let scene = scene(cartesian([size[0], size[1], 1]), FLOATS, &toml);
        let mut renderer = rendered(&device, scene.clone(), std::slice::from_ref(&source));
        renderer.picture().expect("picture");
        let mut read = |slot| renderer.read(slot).expect("read").expect("there");
        let mut slots = BTreeMap::from([(Slot::Frames, source.clone())]);
        run_by_references(&scene, Frequency::Frame, &mut slots);
        let error = largest_difference(&read(Slot::Volume), &slots[&Slot::Volume]);
        // Rounding before a sigma filter may move a pixel across its range's edge: none does here.
        assert!(error < 5e-6, "{after}: slices are {error} off");
        // From the picture of stage 2, through the filters of stage 4.
        let mut slots = BTreeMap::from([(Slot::Picture, read(Slot::Picture))]);
        let end = echolume::low_level::passes::chain::picture_end(&scene);
        for pass in ["sigma_picture", "perona_malik_picture", "aos_picture"].map(|n| by_name(n).expect("pass")) {
            for iteration in 0..if pass.is_needed(&scene) { (pass.repeat)(&scene) } else { 0 } {
                let args = DispatchArgs { iteration, ..DispatchArgs::default() };
                let mut inputs = Arrays::default();
                pass.reads(&scene, &args).iter().for_each(|b| inputs.insert(b.name, slots[&b.slot].clone()));
                let written = reference(&scene, pass, &args, &inputs);
                pass.writes(&scene, &args).iter().for_each(|b| {
                    slots.insert(b.slot, written.get(b.name).clone());
                });
            }
        }
        assert!(!std::ptr::eq(&slots[&Slot::Picture], &slots[&end]), "the filters write elsewhere");
        let error = largest_difference(&read(end), &slots[&end]);
        // R16F between the filters: 2.5e-4 each below 1, four of them.
        assert!(error < 1e-3, "{flat}: the picture is {error} off");
    }
}

/// The Gaussian at every width that is allowed: it keeps a constant, and spreads a single bright pixel as its formula says.
#[test]
fn the_widest_gaussian_has_all_of_its_weights() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let size = [240, 24];
    let pitch = plane(size, "").grid.pitch;
    for deviation in [1.0, 10.0, 10.4, 21.0, 32.0] {
        for (axis, name, pass) in [(0, "lateral", "gaussian_lateral"), (1, "depth", "gaussian_depth")] {
            let size = if axis == 0 { size } else { [size[1], size[0]] };
            let scene = plane(size, &format!("smooth = {{ {name} = {} }}", deviation * pitch[axis]));
            let constant = on_device(&mut single, &scene, pass, &texels(size, |_, _| 0.5));
            assert!(largest_difference(&constant, &texels(size, |_, _| 0.5)) < 1e-6, "{name}, {deviation} pixels");
            let along = |x: usize, y: usize| [x, y][axis] as f64 - 120.0;
            let reach = (3.0 * deviation).ceil();
            let bell = |d: f64| if d.abs() <= reach { (-0.5 * (d / deviation).powi(2)).exp() } else { 0.0 };
            let sum: f64 = (0..240).map(|n| bell(f64::from(n) - 120.0)).sum();
            let spread =
                on_device(&mut single, &scene, pass, &texels(size, |x, y| f64::from(u8::from(along(x, y) == 0.0))));
            let expected = texels(size, |x, y| bell(along(x, y)) / sum);
            // Near the border the weights are those of the taps that are there: a pixel's share of them is larger.
            let inner = |t: &Texels| {
                let within = |n: usize| n as f64 >= reach && (n as f64) < 240.0 - reach;
                texels(size, |x, y| if within([x, y][axis]) { t.get([x, y, 0])[0] } else { 0.0 })
            };
            let off = largest_difference(&inner(&spread), &inner(&expected));
            assert!(off < 1e-6, "{name}, {deviation} pixels: {off}");
        }
    }
}
