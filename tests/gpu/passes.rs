//! Every pass alone against its f64 reference, looped over `PASSES`: on noise, on extremes, at awkward sizes, in every
//! variant of the geometry. Each pass gets its own inputs, so that errors do not add up. A perturbed reference must fail.

use crate::common::*;
use echolume::gpu::renderer::size_of;
use echolume::gpu::single::Single;
use echolume::passes::slots::{Filled, Shape};
use echolume::passes::{Arrays, Bind, MISS, PASSES, Part, Pass, Slot, Texels, Turn, measure};
use echolume::probe::{Advance, Geometry, Probe};
use echolume::scene::{Input, Scene};
use echolume::source::StoredType;

/// What outputs hold before a pass: no pass computes it by chance, and every format stores it (nearly).
const POISON: f64 = 0.654_321;

const ALL_FILTERS: &str = "
    slices = { pixels = 41, median = true, sigma = { window = 5, sigma = 0.08 }, smooth = { lateral = 2.0, depth = 3.0, elevation = 0.8 } }
    distance = { median = 5, bilateral = { pixels = 1.5, distance = 2.0, repeat = 2 }, sigma = { window = 7, sigma = 0.7 } }
    post = { sigma = { window = 5, sigma = 0.05 }, brightness = 0.05, contrast = 1.3, gamma = 1.8, colour_map = 'skin' }
    light = { texture = 0.4, shininess = 40.0, shadow = { softness = 0.3 }, occlusion = {}, position = [5.0, 10.0, 30.0] }
    picture = { size = [37, 29] }
    camera = { azimuth = 20, elevation = -35, roll = 10, field_of_view = 30 }
    ray = { step = 0.5, sampling = 'exact' }
    surface = { threshold = 0.12 }
";

fn moved(mut probe: Probe, share: f64) -> Probe {
    probe.advance = Advance::Same(share * probe.slices.pitch());
    probe
}

fn scenes() -> Vec<(String, Scene)> {
    let mut scenes = Vec::new();
    let mut add = |name: &str, geometry: &Geometry, input: Input, toml: &str| {
        if toml.starts_with("mode") {
            scenes.push((name.to_string(), scene(geometry.clone(), input, toml)));
            return;
        }
        for mode in ["'sr'", "'vr'", "'mip'", "'mixed'", "'vr'\nvolume = { shading = 'first-hit' }"] {
            let scene = scene(geometry.clone(), input, &format!("mode = {mode}\n{toml}"));
            scenes.push((format!("{name}, {mode}"), scene));
        }
    };
    let sweep = Geometry::Sweep(wobbler());
    add("fan with every filter", &sweep, BYTES, ALL_FILTERS);
    let each = (0..9).map(|k| if k < 4 { 0.02 } else { -0.02 }).collect();
    let geometries = [
        ("fan, motor moving", Geometry::Sweep(moved(wobbler(), 0.7))),
        ("fan, uneven", Geometry::Sweep(uneven(wobbler()))),
        ("fan, uneven and moving", Geometry::Sweep(Probe { advance: Advance::Each(each), ..uneven(wobbler()) })),
        ("linear array, translated", Geometry::Sweep(linear())),
        ("linear array, translated and moving backwards", Geometry::Sweep(moved(linear(), -0.9))),
        ("single frame", Geometry::Sweep(still())),
        ("Cartesian", cartesian([17, 23, 9])),
        ("Cartesian, one slice", cartesian([9, 8, 1])),
    ];
    for (name, geometry) in &geometries {
        let toml = "slices = { pixels = 33 }
            picture = { size = [19, 33] }
            camera = { azimuth = -30, elevation = 25 }
            ray = { step = 0.45, sampling = 'exact' }";
        add(name, geometry, BYTES, toml);
    }
    for format in ["r8", "r16", "r16f", "r32f"] {
        let toml = format!(
            "slices = {{ pixels = 24, format = '{format}' }}\npicture = {{ size = [16, 16] }}\nray = {{ step = 0.6 }}"
        );
        add(&format!("volume in {format}, the device's filter"), &sweep, BYTES, &toml);
    }
    for (name, stored, range) in [("u16", StoredType::U16, [1000.0, 40000.0]), ("f32", StoredType::F32, [-0.25, 1.5])] {
        let toml = "slices = { pixels = 9 }\npicture = { size = [1, 1] }\nray = { sampling = 'exact' }";
        add(&format!("frames in {name}, one pixel"), &sweep, Input { stored, range }, toml);
    }
    for (name, stored, range, conditioning) in [
        ("decimated, the last sample left over", StoredType::U8, [0.0, 255.0], "samples = 13"),
        ("decimated to the least", StoredType::U8, [0.0, 255.0], "samples = 2"),
        ("decimated without a low pass", StoredType::U8, [0.0, 255.0], "samples = 22, low_pass = 0"),
        (
            "every conditioning",
            StoredType::U16,
            [1000.0, 40000.0],
            "samples = 17, low_pass = 1.3, dynamic_range = 20, tgc = [{ depth = 3, gain = -20 }, { depth = 40, gain = 35.5 }]",
        ),
        ("log alone", StoredType::F32, [-0.25, 1.5], "dynamic_range = 60"),
        ("low pass wider than the line", StoredType::F32, [0.0, 1.0], "low_pass = 32"),
        (
            "gain of compressed lines",
            StoredType::U8,
            [0.0, 255.0],
            "compressed_range = 45, tgc = [{ depth = 0, gain = 12 }, { depth = 12.5, gain = -30 }]",
        ),
    ] {
        let toml =
            format!("conditioning = {{ {conditioning} }}\nslices = {{ pixels = 33 }}\npicture = {{ size = [9, 7] }}");
        add(name, &sweep, Input { stored, range }, &toml);
        add(&format!("{name}, linear array"), &Geometry::Sweep(linear()), Input { stored, range }, &toml);
    }
    for (name, toml) in [
        ("sigma 0", "slices = { pixels = 20, sigma = { window = 7, sigma = 0.0 } }"),
        (
            "infinite sigma",
            "slices = { pixels = 20, sigma = { window = 63, sigma = inf } }\npost = { sigma = { window = 9, sigma = inf } }",
        ),
        (
            "first crossing, no rough detector",
            "surface = { place = 'first-crossing', rough = 1 }\nslices = { pixels = 30 }",
        ),
        (
            "dark cavity, roughest",
            "surface = { sign = 'dark', rough = 8, rough_threshold = 0.05 }\nslices = { pixels = 30 }",
        ),
        ("parallel to a face", "camera = { elevation = 90 }\nslices = { pixels = 30 }"),
        ("inside the volume", "camera = { field_of_view = 90, zoom = 20 }\nslices = { pixels = 30 }"),
        ("shadow, hard", "light = { shadow = { softness = 0.0, bias = 0.4 } }\nslices = { pixels = 12 }"),
        (
            "shadow, soft, near light",
            "light = { position = [10.0, 15.0, 25.0], shadow = {} }\nslices = { pixels = 12 }",
        ),
        ("occlusion", "light = { occlusion = { radius = 8.0, strength = 1.5 } }\nslices = { pixels = 12 }"),
        ("skin", "light = { skin = {}, shadow = {}, occlusion = {} }\nslices = { pixels = 30 }"),
        ("light on the surface", "light = { position = [0.0, 0.0, 0.0], shadow = {} }\nslices = { pixels = 12 }"),
        (
            "light behind",
            "light = { direction = [0.0, 0.0, -1.0], shadow = {}, skin = { translucency = 1.0 } }\nslices = { pixels = 12 }",
        ),
        ("second surface", "surface = { number = 2, threshold = 0.05 }\nslices = { pixels = 30 }"),
        (
            "third surface, no rough detector",
            "surface = { number = 3, threshold = 0.05, rough = 1, place = 'first-crossing' }\nslices = { pixels = 30 }",
        ),
        ("adaptive", "surface = { detector = 'adaptive', threshold = 0.02 }\nslices = { pixels = 30 }"),
        (
            "adaptive, no rough detector, second surface",
            "surface = { detector = 'adaptive', threshold = 0.02, noise = 1.5, rough = 1, number = 2 }\nslices = { pixels = 30 }",
        ),
        (
            "adaptive, dark, roughest, first crossing",
            "surface = { detector = 'adaptive', sign = 'dark', rough = 8, threshold = 0.02, place = 'first-crossing' }\nslices = { pixels = 30 }",
        ),
        ("lasting", "surface = { detector = 'lasting', threshold = 0.02, noise = 1.0 }\nslices = { pixels = 30 }"),
        (
            "lasting, no rough detector, first crossing",
            "surface = { detector = 'lasting', threshold = 0.02, rough = 1, noise = 1.0, place = 'first-crossing' }\nslices = { pixels = 30 }",
        ),
        (
            "lasting, dark, second surface",
            "surface = { detector = 'lasting', threshold = 0.02, sign = 'dark', number = 2, noise = 0.0, rough = 3 }\nslices = { pixels = 30 }",
        ),
        (
            "enhanced sigma",
            "post = { enhanced_sigma = { window = 3, largest = 11, sigma = 0.08 } }\nslices = { pixels = 12 }",
        ),
        (
            "both sigmas",
            "post = { sigma = { window = 3, sigma = 0.1 }, enhanced_sigma = { window = 5, largest = 5, sigma = inf } }\nslices = { pixels = 12 }",
        ),
        ("smallest", "mode = 'minip'\nslices = { pixels = 30 }"),
        ("mean", "mode = 'mean'\nslices = { pixels = 30 }"),
        (
            "clipped, lit volume",
            "mode = 'vr'\nvolume = { shading = 'first-hit', hit = 0.1 }\nlight = { shadow = {}, occlusion = {} }\nslices = { pixels = 30 }
             clip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }, { at = [5, 0, 0], normal = [1, 0, 0] }]",
        ),
        ("clipped surface", "slices = { pixels = 30 }\nclip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]"),
        ("veil over a surface", "mode = 'mixed'\nvolume = { veil = 0.5 }\nlight = { occlusion = {} }\nslices = { pixels = 30 }"),
        ("veil and shadow", "mode = 'mixed'\nlight = { shadow = {} }\nslices = { pixels = 30 }"),
        ("lit volume, shadow", "mode = 'vr'\nvolume = { shading = 'first-hit' }\nlight = { shadow = {}, skin = {} }\nslices = { pixels = 12 }"),
        ("lit volume, occlusion", "mode = 'vr'\nvolume = { shading = 'first-hit' }\nlight = { occlusion = {} }\nslices = { pixels = 12 }"),
        ("depth-coded", "mode = 'vr'\nvolume = { shading = 'depth-coded', transfer = 'warm' }\nslices = { pixels = 30 }"),
        ("Riemann", "mode = 'vr'\nvolume = { compositing = 'riemann', transfer = 'cool' }\nslices = { pixels = 30 }"),
        ("pre-integrated", "mode = 'vr'\nvolume = { compositing = 'pre-integrated', threshold = 0.5 }\nslices = { pixels = 30 }"),
        ("two rays", "mode = 'vr'\nslices = { pixels = 12 }\nray = { rays = 2 }"),
        ("4-up, three rays", "mode = 'mip'\nlayout = 'four'\nslices = { pixels = 12 }\nray = { rays = 3 }"),
        (
            "every diffusion, explicit",
            "slices = { pixels = 20, perona_malik = { repeat = 3 }, smooth = { lateral = 1.0 } }\n\
             distance = { perona_malik = { edge = 0.8, conductance = 'exponential', step = 0.25, repeat = 2 } }\n\
             post = { perona_malik = { edge = 0.3, conductance = 'exponential', repeat = 3 } }",
        ),
        (
            "diffusion with sharpest and dullest edges",
            "slices = { pixels = 20, perona_malik = { edge = 1e-30, conductance = 'exponential', repeat = 1 } }\n\
             distance = { perona_malik = { edge = 1e-30, repeat = 1 } }\npost = { perona_malik = { edge = inf, repeat = 1 } }",
        ),
        (
            "the heat equation, edges of 0",
            "slices = { pixels = 20, perona_malik = { edge = inf, repeat = 2 } }\n\
             distance = { perona_malik = { edge = inf, repeat = 1 } }\npost = { perona_malik = { edge = 0.0 } }",
        ),
        (
            "AOS",
            "slices = { pixels = 41, perona_malik = { scheme = 'aos', step = 2.0, repeat = 2 } }\n\
             post = { perona_malik = { scheme = 'aos', step = 5.0, repeat = 2, conductance = 'exponential' } }",
        ),
        (
            "AOS in huge steps, between filters",
            "slices = { pixels = 20, median = true, perona_malik = { scheme = 'aos', edge = inf, step = 1e6, repeat = 1 }, smooth = { depth = 1.0 } }\n\
             post = { perona_malik = { scheme = 'aos', edge = 1e-30, step = 1e9, repeat = 1 } }",
        ),
        (
            "enhanced sigmas, Perona-Malik centre, growth",
            "slices = { pixels = 24, enhanced_sigma = { window = 3, largest = 17, sigma = 0.05, centre = 'perona-malik', growth = true } }\n\
             distance = { enhanced_sigma = { window = 5, largest = 11, sigma = 0.3, centre = 'perona-malik', edge = 0.5 } }\n\
             post = { enhanced_sigma = { window = 3, largest = 7, sigma = 0.1, centre = 'perona-malik', noise = 'multiplicative' } }",
        ),
        (
            "enhanced sigmas, gradient-inverse centre, growth",
            "slices = { pixels = 24, enhanced_sigma = { window = 5, largest = 9, sigma = 0.2, noise = 'multiplicative', centre = 'gradient-inverse', growth = true }, smooth = { lateral = 1.0 } }\n\
             distance = { enhanced_sigma = { window = 3, largest = 9, sigma = 0.2, centre = 'gradient-inverse' } }\n\
             post = { enhanced_sigma = { window = 3, largest = 7, sigma = 0.1, centre = 'gradient-inverse' } }",
        ),
        (
            "enhanced sigmas, Nagao-Matsuyama centre",
            "slices = { pixels = 24, enhanced_sigma = { window = 5, largest = 9, sigma = 0.1, centre = 'nagao-matsuyama' } }\n\
             distance = { enhanced_sigma = { window = 3, largest = 9, sigma = 0.2, centre = 'nagao-matsuyama' } }\n\
             post = { enhanced_sigma = { window = 3, largest = 7, sigma = 0.1, centre = 'nagao-matsuyama' } }",
        ),
        (
            "enhanced sigmas, median centre, window beyond the picture",
            "slices = { pixels = 24, enhanced_sigma = { window = 63, largest = 63, sigma = inf } }\n\
             distance = { enhanced_sigma = { window = 3, largest = 63, sigma = 0.2, centre = 'median' } }",
        ),
        ("Gaussian of 3x3x3", "slices = { pixels = 20, smooth = { kernel = 3 } }"),
        ("Gaussian of 5x5x5", "slices = { pixels = 20, smooth = { kernel = 5 } }"),
        ("slight blur", "slices = { pixels = 20, blur = true }"),
        ("slight blur and frames joined", "slices = { pixels = 20, blur = true, smooth = { elevation = 1.0 } }"),
        ("median estimator", "slices = { pixels = 20, estimator = 'median' }"),
        (
            "Perona-Malik estimator, between filters",
            "slices = { pixels = 20, estimator = 'perona-malik', sigma = { window = 3, sigma = 0.1 } }",
        ),
        ("gradient-inverse estimator", "slices = { pixels = 20, estimator = 'gradient-inverse' }"),
        ("Nagao-Matsuyama estimator", "slices = { pixels = 20, estimator = 'nagao-matsuyama' }"),
        (
            "sigmas of multiplicative noise",
            "slices = { pixels = 20, sigma = { window = 5, sigma = 0.3, noise = 'multiplicative' } }\n\
             post = { sigma = { window = 7, sigma = 0.15, noise = 'multiplicative' } }",
        ),
        (
            "infinite sigma of multiplicative noise",
            "slices = { pixels = 20, sigma = { window = 5, sigma = inf, noise = 'multiplicative' } }",
        ),
        ("shininess 0", "light = { shininess = 0.0, texture = 1.0 }\nslices = { pixels = 12 }"),
        ("shininess 1e6", "light = { shininess = 1e6 }\nslices = { pixels = 12 }"),
    ] {
        let ray = "sampling = 'exact', step = 0.7, early_end = 0.0";
        let toml = match toml.split_once("ray = { ") {
            Some((before, after)) => format!("{before}ray = {{ {ray}, {after}"),
            None => format!("{toml}\nray = {{ {ray} }}"),
        };
        add(name, &sweep, BYTES, &format!("{toml}\npicture = {{ size = [23, 17] }}"));
    }
    for ray in ["spread = 1.0", "sliding = 3", "sliding = 5, spread = 0.5"] {
        for mode in ["'sr'", "'vr'", "'mean'", "'vr'\nvolume = { compositing = 'pre-integrated' }"] {
            let toml = format!(
                "mode = {mode}\nslices = {{ pixels = 30 }}\npicture = {{ size = [15, 11] }}\nclip = [{{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }}]
                 camera = {{ azimuth = 35, elevation = 8, roll = 11, field_of_view = 40 }}\nray = {{ sampling = 'exact', step = 0.9, early_end = 0.0, {ray} }}"
            );
            scenes.push((format!("{ray}, {mode}"), scene(sweep.clone(), BYTES, &toml)));
        }
    }
    scenes.extend(crate::planes::scenes());
    scenes
}

/// Inputs by kind: noise, all zero, all one, one hot texel; for distances smooth hits with cliffs and misses, all misses, one
/// hit; for volumes blurred noise, so that rays see something like tissue.
const KINDS: [&str; 4] = ["noise", "zero", "one", "hot"];

fn input(scene: &Scene, bind: &Bind, kind: &str, noise: &mut Noise) -> Texels {
    let format = bind.slot.format(scene);
    let mut size = size_of(bind.slot.shape(scene));
    if bind.part == Part::Layer {
        size[2] = 1;
    }
    let mut texels = Texels::from_fn(size, format.channels(), |_, _| 0.0);
    if let Filled::ByScene(make) = bind.slot.filled() {
        texels.values = make(scene).into_iter().map(f64::from).collect();
        return texels;
    }
    let count = texels.values.len();
    let is_distance = matches!(bind.slot, Slot::Distance | Slot::DistanceA | Slot::DistanceB);
    let tilt = noise.range(-0.4, 0.4);
    for i in 0..count {
        let (x, y) = ((i / format.channels() % size[0]) as f64, (i / format.channels() / size[0]) as f64);
        texels.values[i] = match (kind, is_distance) {
            ("noise", true) => match noise.next() {
                share if share < 0.1 => MISS,
                share if share < 0.2 => noise.range(10.0, 90.0),
                _ => 60.0 + tilt * x - 0.2 * y + if x > 9.0 { 8.0 } else { 0.0 } + noise.range(-0.3, 0.3),
            },
            ("zero", true) => MISS,
            ("one", true) => 42.0,
            ("hot", true) if i == count / 2 => 33.0,
            ("hot", true) => MISS,
            ("noise", false) => noise.next(),
            ("one", false) => 1.0,
            ("hot", false) if i == count / 2 => 1.0,
            _ => 0.0,
        };
    }
    if bind.slot == Slot::Picture || bind.slot == Slot::SmoothPicture {
        // Alpha is 0 or 1, as the passes leave it.
        texels.values.chunks_exact_mut(4).for_each(|p| p[3] = p[3].round());
    }
    if bind.slot == Slot::Surface {
        texels.values.chunks_exact_mut(2).for_each(|p| p[1] = p[1].round());
    }
    if bind.slot == Slot::Volume && kind == "noise" {
        texels = blurred(&texels);
    }
    // Both sides see what the slot's format can hold.
    Texels::decode(size, format, &texels.encode(format))
}

fn blurred(noise: &Texels) -> Texels {
    Texels::from_fn(noise.size, 1, |[x, y, z], _| {
        let mut sum = 0.0;
        for (dx, dy, dz) in (0..125).map(|i| (i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2)) {
            sum += noise.clamped(x as i64 + dx, y as i64 + dy, z as i64 + dz);
        }
        (0.5 + 4.0 * (sum / 125.0 - 0.5)).clamp(0.0, 1.0)
    })
}

/// The worst texel beyond tolerance, if there are more such texels than the pass allows.
fn compare(pass: &Pass, scene: &Scene, expected: &Arrays, got: &Arrays, writes: &[Bind]) -> Result<f64, String> {
    let mut largest = 0.0f64;
    for (name, expected) in expected.iter() {
        let got = got.get(name);
        let format = writes.iter().find(|b| b.name == name).expect("declared").slot.format(scene);
        let (mut beyond, mut worst) = (0, None);
        for (i, (e, g)) in expected.values.iter().zip(&got.values).enumerate() {
            let untouched = e.is_nan();
            let e = if untouched { POISON } else { *e };
            let rounding = 1.01 * Texels::spacing(format, e);
            let allowed = if untouched {
                rounding
            } else {
                pass.tolerance.absolute.max(pass.tolerance.relative * e.abs()) + rounding
            };
            let error = (e - g).abs();
            if error <= allowed {
                largest = largest.max(error);
            } else {
                beyond += 1;
                if worst.is_none_or(|(_, _, _, w)| error > w) {
                    worst = Some((i, e, *g, error));
                }
            }
        }
        let share = beyond as f64 / expected.values.len() as f64;
        if share > pass.tolerance.outliers {
            let (i, e, g, _) = worst.expect("something is beyond");
            let texel = i / expected.channels;
            let at = (texel % expected.size[0], texel / expected.size[0] % expected.size[1]);
            return Err(format!("'{name}' at {at:?}: expected {e}, got {g}; {beyond} texels beyond tolerance"));
        }
    }
    Ok(largest)
}

fn run_one(
    single: &mut Single,
    scene: &Scene,
    pass: &'static Pass,
    iteration: u32,
    kind: &str,
    seed: u64,
) -> (Arrays, Arrays, Arrays, Vec<Bind>) {
    let turn = Turn { layer: 2, slice: scene.slices() / 2, slices: scene.slices().div_ceil(3), iteration, image: 0 };
    let mut noise = Noise(seed);
    let mut inputs = Arrays::default();
    for bind in (pass.reads)(scene, &turn) {
        inputs.insert(bind.name, input(scene, &bind, kind, &mut noise));
    }
    let writes = (pass.writes)(scene, &turn);
    let mut expected = Arrays::default();
    for bind in &writes {
        let channels = bind.slot.format(scene).channels();
        expected.insert(bind.name, Texels::untouched(size_of(bind.slot.shape(scene)), channels));
    }
    (pass.reference)(scene, &turn, &inputs, &mut expected);
    let got = single.run(scene, pass, &turn, &inputs, POISON).expect("dispatch");
    (inputs, expected, got, writes)
}

#[test]
fn every_pass_matches_its_reference() {
    let device = Device::new();
    println!("device: {}", device.describe());
    let mut single = Single::new(&device).expect("single");
    let mut failures = Vec::new();
    let mut errors: Vec<(&str, f64, u32)> = PASSES.iter().map(|p| (p.name, 0.0, 0)).collect();
    for (name, scene) in scenes() {
        for (n, pass) in PASSES.iter().enumerate().filter(|(_, p)| p.is_needed(&scene)) {
            for (k, kind) in KINDS.iter().enumerate() {
                for iteration in 0..(pass.repeat)(&scene) {
                    let seed = (n * 8 + k) as u64;
                    let (_, expected, got, writes) = run_one(&mut single, &scene, pass, iteration, kind, seed);
                    match compare(pass, &scene, &expected, &got, &writes) {
                        Ok(error) => errors[n].1 = error.max(errors[n].1),
                        Err(fault) => {
                            failures.push(format!("{} ({iteration}) in '{name}' on {kind}: {fault}", pass.name))
                        }
                    }
                    errors[n].2 += 1;
                }
            }
        }
    }
    for (name, error, runs) in &errors {
        println!("{name:20} largest error {error:.2e} over {runs} runs");
        assert!(*runs > 0, "no scene needs {name}");
    }
    assert!(failures.is_empty(), "{} failures:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn what_measures_the_device_computes_what_it_says() {
    let device = Device::new();
    let mut single = Single::new(&device).expect("single");
    let scene = measure::scene(11, 19).expect("scene");
    for pass in measure::MEASURES {
        let (_, expected, got, writes) = run_one(&mut single, &scene, pass, 0, "noise", 7);
        compare(pass, &scene, &expected, &got, &writes).unwrap_or_else(|e| panic!("{}: {e}", pass.name));
    }
}

#[test]
fn a_perturbed_input_swapped_parameters_and_half_a_pixel_are_each_noticed() {
    let device = Device::new();
    let mut single = Single::new(&device).expect("single");
    let base = scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'vr'\n{ALL_FILTERS}"));
    let lit = scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'sr'\n{ALL_FILTERS}"));
    // What the reference is told differs from what the device is told, by one small thing.
    let mut half_pixel = base.clone();
    half_pixel.rays.origin += half_pixel.rays.right * 0.3;
    let mut half_slice_pixel = base.clone();
    half_slice_pixel.grid.origin[0] += 0.5 * half_slice_pixel.grid.pitch[0];
    let mut swapped = lit.clone();
    std::mem::swap(&mut swapped.settings.light.ambient, &mut swapped.settings.light.diffuse);
    let mut mirrored = lit.clone();
    mirrored.rays.direction_dx = -mirrored.rays.direction_dx;
    let mut toned = base.clone();
    toned.settings.post.brightness += 2.5 / 255.0;
    let mut narrow = base.clone();
    narrow.settings.slices.sigma.as_mut().expect("sigma").sigma *= 0.8;
    let cases: [(&str, &str, &Scene, &Scene); 6] = [
        ("half a pixel", "raycast_volume", &base, &half_pixel),
        ("half a slice pixel", "scan_convert", &base, &half_slice_pixel),
        ("ambient and diffuse swapped", "light", &lit, &swapped),
        ("mirrored", "raycast_surface", &lit, &mirrored),
        ("two levels brighter", "tone", &base, &toned),
        ("a narrower sigma", "sigma_slice", &base, &narrow),
    ];
    for (fault, name, told, wrong) in cases {
        let pass = echolume::passes::by_name(name).expect("pass");
        let (inputs, right, got, writes) = run_one(&mut single, told, pass, 0, "noise", 5);
        compare(pass, told, &right, &got, &writes).expect("unperturbed");
        let turn = Turn { layer: 2, slice: told.slices() / 2, slices: 1, iteration: 0, image: 0 };
        let mut expected = Arrays::default();
        for bind in &writes {
            let channels = bind.slot.format(told).channels();
            expected.insert(bind.name, Texels::untouched(size_of(bind.slot.shape(told)), channels));
        }
        (pass.reference)(wrong, &turn, &inputs, &mut expected);
        assert!(compare(pass, told, &expected, &got, &writes).is_err(), "{fault} went unnoticed in {name}");
    }
    // One voxel.
    let pass = echolume::passes::by_name("median_slice").expect("pass");
    let (mut inputs, _, got, writes) = run_one(&mut single, &base, pass, 0, "zero", 5);
    let mut source = inputs.get("source").clone();
    let middle = source.size[0] * (source.size[1] / 2) + source.size[0] / 2;
    (0..2).for_each(|dy| source.values[middle + dy * source.size[0]..][..3].fill(1.0));
    inputs.insert("source", source);
    let mut expected = Arrays::default();
    expected.insert("target", Texels::untouched(size_of(writes[0].slot.shape(&base)), 1));
    (pass.reference)(&base, &Turn::default(), &inputs, &mut expected);
    assert!(compare(pass, &base, &expected, &got, &writes).is_err(), "changed pixels went unnoticed");
}

#[test]
fn what_is_outside_the_sector_is_not_touched() {
    let device = Device::new();
    let mut single = Single::new(&device).expect("single");
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'vr'\nslices = { pixels = 64 }");
    let pass = echolume::passes::by_name("scan_convert").expect("pass");
    let (_, expected, got, _) = run_one(&mut single, &scene, pass, 0, "one", 1);
    let Shape::Three([width, height, _]) = Slot::Volume.shape(&scene) else { panic!("volume") };
    let outside = (width * height) as usize - expected.get("target").values.iter().filter(|v| !v.is_nan()).count();
    let poison = Texels::decode(
        [1; 3],
        Slot::Volume.format(&scene),
        &Texels::from_fn([1; 3], 1, |_, _| POISON).encode(Slot::Volume.format(&scene)),
    );
    let slice =
        &got.get("target").values[(scene.slices() / 2 * width * height) as usize..][..(width * height) as usize];
    let left = slice.iter().filter(|v| **v == poison.values[0]).count();
    assert!(outside > 500, "a sector leaves corners: {outside}");
    assert_eq!(left, outside);
}
