//! Every pass separately against its f64 reference, looped over `PASSES`: on noise, on extremes, at awkward sizes, in every
//! variant of the geometry. Each pass gets its own inputs, so that errors do not add up. A perturbed reference must fail.

use crate::common::gpu::*;
use echolume::low_level::gpu::pass_runner::PassRunner;
use echolume::low_level::gpu::{ContextOptions, Renderer, RendererOptions, TexelAccess};
use echolume::low_level::passes::slots::Shape;
use echolume::low_level::passes::{Arrays, DispatchArgs, PASSES, Slot, Texels, device_limits};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Sampling, Scene};
use echolume::low_level::verify::each_pass::{POISON, dispatch_args_of, inputs_of, run_with_reference};
use echolume::low_level::verify::report::{Level, Verdict};
use echolume::low_level::verify::{self, DeviceUnderTest, ExtraTolerance};
use std::collections::HashSet;

/// The pass checks of `echolume verify`.
#[test]
fn every_pass_matches_its_reference() {
    passes_match(Level::Quick);
}

/// The pass checks of `echolume verify --full`: every input in every scene.
#[test]
fn every_pass_matches_its_reference_with_every_input() {
    passes_match(Level::Full);
}

fn passes_match(level: Level) {
    let device = Device::new();
    println!("device: {}", device.describe());
    let options =
        ContextOptions { device: chosen(), validation: true, specialize: Some(true), ..ContextOptions::default() };
    let mut bench = DeviceUnderTest::new(&options, level).expect("bench");
    let checks = verify::each_pass::checks(level);
    assert_eq!(checks.len(), PASSES.len());
    let mut group = None;
    let outcomes: Vec<_> = checks.iter().map(|check| check.run_after(&mut group, &mut bench)).collect();
    for outcome in &outcomes {
        let figure = |n: usize| format!("{} {:.2e}", outcome.figures[n].what, outcome.figures[n].value);
        println!("{:24} {}, {}; {}", outcome.name, figure(0), figure(1), outcome.notes.join(" "));
    }
    let failed = outcomes.iter().filter(|o| o.verdict == Verdict::Failed);
    let failures: Vec<_> = failed.map(|o| format!("{}: {:?}", o.name, o.faults)).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// The method of reading texels may change the time, but no bit: every pass that reads some, in every format and variant of the scenes.
#[test]
fn storage_loads_and_texture_fetches_give_the_same_texels() {
    let device = Device::new();
    let ways = [TexelAccess::Textures, TexelAccess::Storage];
    let mut singles = ways.map(|fetch| PassRunner::with_texel_access(&device, fetch).expect("single"));
    let (mut shaders, mut formats, mut loaded) = (HashSet::new(), HashSet::new(), 0);
    for (name, mut scene) in scenes() {
        // Automatic sampling would differ between the two methods.
        if scene.settings.ray.sampling == Sampling::Auto {
            (scene.settings.ray.sampling, scene.sampling) = (Sampling::Exact, Sampling::Exact);
        }
        for pass in PASSES.iter().filter(|p| p.is_needed(&scene)) {
            // Each shader once, and each format of an input once: the rewriting of a binding depends on nothing else.
            let is_new_shader = shaders.insert(pass.shader(&scene, &DispatchArgs::default()));
            let reads = pass.reads(&scene, &DispatchArgs::default());
            let new_formats = reads.iter().filter(|b| formats.insert((b.name, b.slot.format(&scene)))).count();
            if !is_new_shader && new_formats == 0 {
                continue;
            }
            let args = dispatch_args_of(&scene, pass, 0);
            let inputs = inputs_of(&scene, pass, &args, "noise", 3);
            let [fetched, stored] =
                singles.each_mut().map(|s| s.run(&scene, pass, &args, &inputs, POISON).expect("dispatch"));
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
        let options = RendererOptions { texel_access: fetch, ..RendererOptions::default() };
        let mut renderer = Renderer::new(&device, scene.clone(), &options).expect("renderer");
        let before = renderer.scene().sampling;
        renderer.change(scene).expect("change");
        assert_eq!(before, renderer.scene().sampling, "a change of scene changes nothing of it");
        before
    };
    let (textures, storage) = (Some(TexelAccess::Textures), Some(TexelAccess::Storage));
    assert_eq!(of(textures, "auto", 64, true), Sampling::Hardware);
    assert_eq!(of(storage, "auto", 64, false), Sampling::PackedNeighbours);
    assert_eq!(of(storage, "auto", 4, true), Sampling::PackedNeighbours, "many pictures of one volume");
    assert_eq!(of(storage, "auto", 4, false), Sampling::Exact, "fewer samples than pay for quads");
    assert_eq!(of(storage, "hardware", 64, true), Sampling::Hardware);
    assert_eq!(of(textures, "exact", 64, true), Sampling::Exact);
    assert_eq!(of(None, "auto", 64, true), TexelAccess::for_device(&device.candidate).sampling());
}

#[test]
fn device_measurements_compute_the_stated_result() {
    let device = Device::new();
    let scene = device_limits::scene(11, 19).expect("scene");
    for fetch in [TexelAccess::Textures, TexelAccess::Storage] {
        let mut single = PassRunner::with_texel_access(&device, fetch).expect("single");
        for pass in device_limits::MEASURES {
            let worst =
                run_with_reference(&mut single, &scene, pass, 0, "noise", 7).expect("dispatch").comparison.worst;
            assert!(worst.is_none(), "{}: {worst:?}", pass.name);
        }
    }
}

#[test]
fn a_perturbed_input_swapped_parameters_and_half_a_pixel_are_each_noticed() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let base = scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'vr'\n{ALL_FILTERS}"));
    let lit = scene(Geometry::Sweep(wobbler()), BYTES, &format!("mode = 'sr'\n{ALL_FILTERS}"));
    // Reference and device differ by one small change.
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
    narrow.slice_filters.sigma.as_mut().expect("sigma").sigma *= 0.8;
    let cases: [(&str, &str, &Scene, &Scene); 6] = [
        ("half a pixel", "raycast_volume", &base, &half_pixel),
        ("half a slice pixel", "scan_convert", &base, &half_slice_pixel),
        ("ambient and diffuse swapped", "light", &lit, &swapped),
        ("mirrored", "raycast_surface", &lit, &mirrored),
        ("two levels brighter", "tone", &base, &toned),
        ("a narrower sigma", "sigma_slice", &base, &narrow),
    ];
    for (fault, name, told, wrong) in cases {
        let pass = echolume::low_level::passes::by_name(name).expect("pass");
        let right = run_with_reference(&mut single, told, pass, 0, "noise", 5).expect("dispatch");
        assert!(right.comparison.worst.is_none(), "{name}, unperturbed: {:?}", right.comparison);
        let args = dispatch_args_of(told, pass, 0);
        let mut expected = Arrays::default();
        for bind in &right.writes {
            let channels = bind.slot.format(told).channels();
            expected.insert(bind.name, Texels::untouched(bind.slot.array_size(told), channels));
        }
        pass.reference(wrong, &args, &right.inputs, &mut expected);
        let compared = verify::compare_outputs(
            pass,
            told,
            ExtraTolerance::default(),
            POISON,
            &expected,
            &right.got,
            &right.writes,
        );
        assert!(compared.worst.is_some(), "{fault} went unnoticed in {name}");
    }
    // One voxel.
    let pass = echolume::low_level::passes::by_name("median_slice").expect("pass");
    let right = run_with_reference(&mut single, &base, pass, 0, "zero", 5).expect("dispatch");
    let mut inputs = right.inputs;
    let mut source = inputs.get("source").clone();
    let middle = source.size[0] * (source.size[1] / 2) + source.size[0] / 2;
    (0..2).for_each(|dy| source.values[middle + dy * source.size[0]..][..3].fill(1.0));
    inputs.insert("source", source);
    let mut expected = Arrays::default();
    expected.insert("target", Texels::untouched(right.writes[0].slot.array_size(&base), 1));
    pass.reference(&base, &dispatch_args_of(&base, pass, 0), &inputs, &mut expected);
    let compared =
        verify::compare_outputs(pass, &base, ExtraTolerance::default(), POISON, &expected, &right.got, &right.writes);
    assert!(compared.worst.is_some(), "changed pixels went unnoticed");
}

#[test]
fn texels_outside_the_sector_are_not_written() {
    let device = Device::new();
    let mut single = PassRunner::new(&device).expect("single");
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'vr'\nslices = { pixels = 64, format = 'r16f' }");
    let pass = echolume::low_level::passes::by_name("scan_convert").expect("pass");
    let result = run_with_reference(&mut single, &scene, pass, 0, "one", 1).expect("dispatch");
    let (expected, got) = (result.expected, result.got);
    let Shape::Three([width, height, _]) = Slot::Volume.shape(&scene) else { panic!("volume") };
    let args = dispatch_args_of(&scene, pass, 0);
    assert!(args.slices > 1, "a batch");
    let (first, texels) = ((args.slice * width * height) as usize, (args.slices * width * height) as usize);
    let outside = texels - expected.get("target").values.iter().filter(|v| !v.is_nan()).count();
    let poison = Texels::decode(
        [1; 3],
        Slot::Volume.format(&scene),
        &Texels::from_fn([1; 3], 1, |_, _| POISON).encode(Slot::Volume.format(&scene)),
    );
    let left = got.get("target").values[first..][..texels].iter().filter(|v| **v == poison.values[0]).count();
    assert!(outside > 500, "a sector leaves corners: {outside}");
    assert_eq!(left, outside);
}
