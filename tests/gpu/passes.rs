//! Every pass alone against its f64 reference, looped over `PASSES`: on noise, on extremes, at awkward sizes, in every
//! variant of the geometry. Each pass gets its own inputs, so that errors do not add up. A perturbed reference must fail.

use crate::common::*;
use crate::scenes::{ALL_FILTERS, scenes};
use echolume::gpu::renderer::size_of;
use echolume::gpu::single::Single;
use echolume::gpu::{Fetch, Options, Renderer};
use echolume::passes::slots::{Filled, Shape};
use echolume::passes::{Arrays, Bind, MISS, PASSES, Part, Pass, Slot, Texels, Turn, measure};
use echolume::plan::Plan;
use echolume::probe::Geometry;
use echolume::scene::{Sampling, Scene};
use std::collections::HashSet;

/// What outputs hold before a pass: no pass computes it by chance, and every format stores it (nearly).
const POISON: f64 = 0.654_321;

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

/// What the passes between a volume and its rays make of it, by their references.
fn leaps_of(scene: &Scene, slot: Slot, volume: &Texels) -> Texels {
    let mut slots = std::collections::BTreeMap::from([(Slot::Volume, volume.clone())]);
    let made = |name: &str| ["tile_ranges", "brick_ranges", "classify", "leap"].iter().any(|p| name.starts_with(p));
    for step in Plan::new(scene).steps.iter().filter(|s| made(s.pass.name)) {
        let turn = Turn { slices: scene.slices(), ..step.turn() };
        let (mut inputs, mut outputs) = (Arrays::default(), Arrays::default());
        for bind in (step.pass.reads)(scene, &turn) {
            let there = slots.get(&bind.slot).cloned();
            inputs.insert(bind.name, there.unwrap_or_else(|| input(scene, &bind, "zero", &mut Noise(1))));
        }
        for bind in (step.pass.writes)(scene, &turn) {
            let channels = bind.slot.format(scene).channels();
            outputs.insert(bind.name, Texels::untouched(size_of(bind.slot.shape(scene)), channels));
        }
        (step.pass.reference)(scene, &turn, &inputs, &mut outputs);
        for bind in (step.pass.writes)(scene, &turn) {
            slots.insert(bind.slot, outputs.get(bind.name).clone());
        }
        if slots.contains_key(&slot) {
            break;
        }
    }
    slots.remove(&slot).expect("made")
}

fn turn_of(scene: &Scene, iteration: u32) -> Turn {
    Turn { layer: 2, slice: scene.slices() / 2, slices: scene.slices().div_ceil(3), iteration, image: 0 }
}

fn inputs_of(scene: &Scene, pass: &Pass, turn: &Turn, kind: &str, seed: u64) -> Arrays {
    let mut noise = Noise(seed);
    let mut inputs = Arrays::default();
    let reads = (pass.reads)(scene, turn);
    for (n, bind) in reads.iter().enumerate() {
        // One image bound under two names has one content.
        let made = reads[..n].iter().find(|b| b.slot == bind.slot).map(|b| inputs.get(b.name).clone());
        inputs.insert(bind.name, made.unwrap_or_else(|| input(scene, bind, kind, &mut noise)));
    }
    if let Some(bricks) = reads.iter().find(|b| b.name == "bricks") {
        // What rays leap by says what the volume says.
        let leaps = leaps_of(scene, bricks.slot, inputs.get("volume"));
        inputs.insert("bricks", leaps);
    }
    if reads.iter().any(|b| b.slot == Slot::Quads) {
        let mut quads = Arrays::default();
        let channels = Slot::Quads.format(scene).channels();
        quads.insert("quads", Texels::untouched(size_of(Slot::Quads.shape(scene)), channels));
        let all = Turn { slices: scene.slices(), ..Turn::default() };
        (echolume::passes::preprocess::quads::PASS.reference)(scene, &all, &inputs, &mut quads);
        inputs.insert("quads", quads.get("quads").clone());
    }
    inputs
}

fn run_one(
    single: &mut Single,
    scene: &Scene,
    pass: &'static Pass,
    iteration: u32,
    kind: &str,
    seed: u64,
) -> (Arrays, Arrays, Arrays, Vec<Bind>) {
    let turn = turn_of(scene, iteration);
    let inputs = inputs_of(scene, pass, &turn, kind, seed);
    let writes = (pass.writes)(scene, &turn);
    let mut expected = Arrays::default();
    for bind in &writes {
        let channels = bind.slot.format(scene).channels();
        expected.insert(bind.name, Texels::untouched(size_of(bind.slot.shape(scene)), channels));
    }
    pass.expected(scene, &turn, &inputs, &mut expected);
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

/// How texels are read may cost time, never a bit: every pass that reads some, in every format and variant that the scenes have.
#[test]
fn texels_loaded_are_the_texels_fetched() {
    let device = Device::new();
    let ways = [Fetch::Textures, Fetch::Storage];
    let mut singles = ways.map(|fetch| Single::fetching(&device, fetch).expect("single"));
    let (mut seen, mut loaded) = (HashSet::new(), 0);
    for (name, mut scene) in scenes() {
        // Automatic sampling would be another for each way.
        if scene.settings.ray.sampling == Sampling::Auto {
            (scene.settings.ray.sampling, scene.sampling) = (Sampling::Exact, Sampling::Exact);
        }
        for pass in PASSES.iter().filter(|p| p.is_needed(&scene)) {
            let reads: Vec<_> = (pass.reads)(&scene, &Turn::default()).iter().map(|b| b.slot.format(&scene)).collect();
            // Once with each shader and the formats of what it reads: that is what is rewritten.
            if !seen.insert(((pass.shader)(&scene, &Turn::default()), reads)) {
                continue;
            }
            let turn = turn_of(&scene, 0);
            let inputs = inputs_of(&scene, pass, &turn, "noise", 3);
            let [fetched, stored] =
                singles.each_mut().map(|s| s.run(&scene, pass, &turn, &inputs, POISON).expect("dispatch"));
            for ((name_of, fetched), (_, stored)) in fetched.iter().zip(stored.iter()) {
                let differ = fetched.values.iter().zip(&stored.values).filter(|(a, b)| a.to_bits() != b.to_bits());
                assert_eq!(differ.count(), 0, "texels of '{name_of}' by {} in '{name}'", pass.name);
            }
            loaded += 1;
        }
    }
    assert!(loaded > 50, "{loaded} passes were held against each other");
}

#[test]
fn automatic_sampling_is_what_the_device_takes_fastest_and_what_was_asked_for_stays() {
    let device = Device::new();
    let of = |fetch, asked: &str, size: u32, still: bool| {
        let toml = format!(
            "picture.size = [{size}, {size}]\nslices = {{ pixels = 24, still = {still} }}\nray.sampling = '{asked}'"
        );
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, &toml);
        let options = Options { fetch, ..Options::default() };
        let mut renderer = Renderer::new(&device, scene.clone(), &options).expect("renderer");
        let before = renderer.scene().sampling;
        renderer.change(scene).expect("change");
        assert_eq!(before, renderer.scene().sampling, "a change of scene changes nothing of it");
        before
    };
    let (textures, storage) = (Some(Fetch::Textures), Some(Fetch::Storage));
    assert_eq!(of(textures, "auto", 64, true), Sampling::Hardware);
    assert_eq!(of(storage, "auto", 64, false), Sampling::Quads);
    assert_eq!(of(storage, "auto", 4, true), Sampling::Quads, "many pictures of one volume");
    assert_eq!(of(storage, "auto", 4, false), Sampling::Exact, "fewer samples than pay for quads");
    assert_eq!(of(storage, "hardware", 64, true), Sampling::Hardware);
    assert_eq!(of(textures, "exact", 64, true), Sampling::Exact);
    assert_eq!(of(None, "auto", 64, true), Fetch::of(&device.candidate).sampling());
}

#[test]
fn what_measures_the_device_computes_what_it_says() {
    let device = Device::new();
    let scene = measure::scene(11, 19).expect("scene");
    for fetch in [Fetch::Textures, Fetch::Storage] {
        let mut single = Single::fetching(&device, fetch).expect("single");
        for pass in measure::MEASURES {
            let (_, expected, got, writes) = run_one(&mut single, &scene, pass, 0, "noise", 7);
            compare(pass, &scene, &expected, &got, &writes).unwrap_or_else(|e| panic!("{}: {e}", pass.name));
        }
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
