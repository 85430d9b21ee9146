//! Stills: paths of light against known answers, against an independent estimate of their expectation in f64, and however they are divided into
//! dispatches.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Bands, Renderer, RendererOptions};
use echolume::low_level::passes::raycast::still::{Medium, final_sums, luminance};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Two-sided quantile of the normal distribution for a confidence of 99.9 %.
const Z: f64 = 3.29;

/// White matter of an extinction, 1/mm, where the sample value is 1, and half of it where that is 0.5.
fn white(extinction: f64) -> String {
    format!(
        "volume = {{ window = [0, 1], extinction = {extinction}, transfer = [{{ at = 0, colour = [1, 1, 1], opacity = 0 }}, \
         {{ at = 1, colour = [1, 1, 1], opacity = 1 }}] }}\n"
    )
}

/// A slab, 6 mm deep, and its frames, all 1.
fn slab(toml: &str) -> (Scene, Vec<Texels>) {
    let grid = Grid { size: [16, 13, 16], spacing: [0.5; 3], origin: [0.0; 3] };
    let mut scene = scene(Geometry::Cartesian(grid), FLOATS, toml);
    scene.settings.picture.size = [12, 12];
    let scene = Scene::new(scene.geometry, scene.input, scene.settings).expect("scene");
    let frames = frames(&scene, |_| 1.0);
    (scene, frames)
}

/// A sweep of speckle.
fn speckle(toml: &str, size: u32) -> (Scene, Vec<Texels>) {
    let mut scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
    scene.settings.picture.size = [size; 2];
    scene.settings.slices.pixels = 48;
    let scene = Scene::new(scene.geometry, scene.input, scene.settings).expect("scene");
    let mut noise = Noise(11);
    let grains: Vec<f64> = (0..8192).map(|_| noise.next()).collect();
    let at = |p: f64| (p * 1.7).abs() as usize;
    let frames = body_frames(&scene, |p| grains[(at(p.x) + 53 * at(p.y) + 911 * at(p.z + 40.0)) % grains.len()]);
    (scene, frames)
}

/// The sums of light and collisions, and of squares, over all paths.
fn sums(renderer: &mut Renderer) -> [Texels; 2] {
    renderer.picture().expect("picture");
    final_sums(renderer.scene()).map(|slot| renderer.read(slot).expect("read").expect("a slot of the plan"))
}

fn samples(scene: &Scene) -> f64 {
    f64::from(scene.still().expect("a still").samples)
}

/// Pixels all of whose rays enter the near face of the slab, and leave it by the far one.
fn pixels_inside(scene: &Scene) -> Vec<[usize; 2]> {
    let [width, height] = scene.ray_size().map(|n| n as usize);
    let is_inside = |x: usize, y: usize| {
        [(0, 0), (0, 1), (1, 0), (1, 1)].iter().all(|(right, down)| {
            let (origin, _) = scene.rays.at((x + right) as f64, (y + down) as f64);
            (scene.low.x..scene.high.x).contains(&origin.x) && (scene.low.z..scene.high.z).contains(&origin.z)
        })
    };
    let all = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    all.filter(|[x, y]| is_inside(*x, *y)).collect()
}

/// Mean of the luminance over some pixels, and its standard error.
fn mean_luminance(scene: &Scene, sums: &[Texels; 2], pixels: &[[usize; 2]]) -> (f64, f64) {
    let n = samples(scene) * pixels.len() as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for [x, y] in pixels {
        let light = sums[0].get([*x, *y, 0]);
        sum += luminance([light[0], light[1], light[2], light[3]]);
        squares += sums[1].one(*x, *y, 0);
    }
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
}

/// Beer and Lambert: the share of rays that pass a homogeneous slab without a collision is exp(-extinction length), with bricks and without.
#[test]
fn a_slab_transmits_what_the_law_of_beer_and_lambert_says() {
    let device = Device::new();
    for (extinction, brick) in [(0.02, 4), (0.2, 0), (0.2, 4), (1.0, 5)] {
        let (scene, frames) = slab(&format!(
            "mode = 'vr'\nray = {{ brick = {brick} }}\nstill = {{ samples = 64, albedo = 0, seed = 5, batch = 16 }}\n{}",
            white(extinction)
        ));
        let length = scene.high.y - scene.low.y;
        assert!((scene.rays.forward - DVec3::Y).length() < 1e-9 && length > 5.0, "along depth");
        let mut renderer = rendered(&device, scene.clone(), &frames);
        let [light, _] = sums(&mut renderer);
        let pixels = pixels_inside(&scene);
        let n = samples(&scene) * pixels.len() as f64;
        assert!(n > 4000.0, "{n} rays");
        let collided: f64 = pixels.iter().map(|[x, y]| light.get([*x, *y, 0])[3]).sum();
        let expected = -(-extinction * length).exp_m1();
        let error = (expected * (1.0 - expected) / n).sqrt();
        assert!(
            (collided / n - expected).abs() < Z * error,
            "{extinction}, bricks of {brick}: {} {expected}",
            collided / n
        );
        assert!(light.values.chunks_exact(4).all(|p| p[..3] == [0.0; 3]), "what absorbs all is black");
    }
}

/// The white furnace: what absorbs nothing is, under light of radiance 1 from everywhere, as bright as what is behind it. Every path brings exactly
/// that light, whatever the medium, the phase function and the bricks.
#[test]
fn what_absorbs_nothing_cannot_be_seen_in_a_white_furnace() {
    let device = Device::new();
    for (extinction, g, brick) in [(0.3, 0.0, 4), (2.0, 0.7, 4), (0.3, -0.5, 0)] {
        let (scene, frames) = speckle(
            &format!(
                "mode = 'vr'\nray = {{ brick = {brick} }}\nstill = {{ samples = 4, anisotropy = {g}, events = 1024 }}\n\
                 light = {{ diffuse = 0, ambient = 1 }}\nclip = [{{ at = [0, 20, 0], normal = [0.3, -1, 0.2] }}]\n{}",
                white(extinction)
            ),
            16,
        );
        let [light, _] = sums(&mut rendered(&device, scene, &frames));
        let mut collided = 0.0;
        for pixel in light.values.chunks_exact(4) {
            assert!(pixel[..3].iter().all(|c| (c - pixel[3]).abs() <= 2e-5 * pixel[3]), "{extinction}, {g}: {pixel:?}");
            collided += pixel[3];
        }
        assert!(collided > 200.0, "{collided} paths met the medium");
    }
}

/// Single scattering in a homogeneous slab, by the integral over the depth of the collision: with the light behind the camera
/// a p(-1) E (1 - exp(-2 s L)) / 2, with the light behind the slab a p(1) E s L exp(-s L).
#[test]
fn a_slab_that_scatters_once_is_as_bright_as_the_closed_formula_says() {
    let device = Device::new();
    let (albedo, extinction, g) = (0.8, 0.15, 0.4);
    let phase = |cosine: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
    for (towards, is_behind) in [(1.0, false), (-1.0, true)] {
        let (scene, frames) = slab(&format!(
            "mode = 'vr'\nray = {{ brick = 4 }}\nlight = {{ direction = [0, 0, {towards}], diffuse = 1, ambient = 0 }}\n\
             still = {{ samples = 64, albedo = {albedo}, anisotropy = {g}, events = 1, batch = 16 }}\n{}",
            white(extinction)
        ));
        let depth = extinction * (scene.high.y - scene.low.y);
        let sums = sums(&mut rendered(&device, scene.clone(), &frames));
        let (mean, error) = mean_luminance(&scene, &sums, &pixels_inside(&scene));
        let expected = albedo
            * PI
            * match is_behind {
                true => phase(1.0) * depth * (-depth).exp(),
                false => phase(-1.0) * (1.0 - (-2.0 * depth).exp()) / 2.0,
            };
        assert!(error < 0.05 * expected, "{error} {expected}");
        assert!((mean - expected).abs() < Z * error, "{towards}: {mean} +- {error}, {expected}");
    }
}

const MANY: &str = "mode = 'vr'\nray = { brick = 4 }\nregion.fade = 4\nlight = { ambient = 0.3, volume = { back = 0.4 } }\n\
                    volume = { window = [0.1, 0.9], extinction = 0.6, transfer = 'skin' }\n";

/// An estimate of the light of a pixel's path that has nothing in common with the pass but the medium: collisions with one majorant for all, both lights at each of
/// them by random walks, no roulette, and other random numbers.
fn independent(scene: &Scene, medium: &Medium, majorant: f64, [x, y]: [usize; 2], noise: &mut Noise) -> f64 {
    let still = scene.still().expect("a still");
    let lights = scene.still_lights();
    let view = scene.volume_view();
    let g = still.anisotropy;
    // Distance to where a ray leaves the box.
    let leaves = |from: DVec3, along: DVec3| {
        let each = (0..3).map(|a| {
            let face = if along[a] > 0.0 { view.high[a] } else { view.low[a] };
            if along[a] == 0.0 { f64::INFINITY } else { (face - from[a]) / along[a] }
        });
        each.fold(f64::INFINITY, f64::min)
    };
    let collide = |from: DVec3, along: DVec3, begin: f64, noise: &mut Noise| {
        let (mut at, leave) = (begin, leaves(from, along));
        loop {
            at -= (1.0 - noise.next()).ln() / majorant;
            if at >= leave {
                return None;
            }
            let place = from + along * at;
            let (albedo, extinction) = medium.at(place);
            if noise.next() * majorant < extinction {
                return Some((place, albedo));
            }
        }
    };
    let (mut place, mut along) = scene.rays.at(x as f64 + noise.next(), y as f64 + noise.next());
    // To the box, which the camera is outside of.
    let enters = (0..3).map(|a| {
        let face = if along[a] > 0.0 { view.low[a] } else { view.high[a] };
        if along[a] == 0.0 { f64::NEG_INFINITY } else { (face - place[a]) / along[a] }
    });
    let mut begin = enters.fold(0.0, f64::max);
    let (mut light, mut throughput) = (0.0, [1.0; 3]);
    let bright = |weights: [f64; 3], light: [f64; 3], factor: f64| {
        factor * luminance([weights[0] * light[0], weights[1] * light[1], weights[2] * light[2], 0.0])
    };
    for event in 0..still.events {
        let Some((p, albedo)) = collide(place, along, begin, noise) else {
            return light + if event > 0 { bright(throughput, lights.environment, 1.0) } else { 0.0 };
        };
        begin = 0.0;
        (0..3).for_each(|c| throughput[c] *= albedo[c]);
        for lamp in [&lights.key, &lights.back] {
            if collide(p, lamp.towards, 0.0, noise).is_none() {
                let cosine = along.dot(lamp.towards);
                let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
                light += bright(throughput, lamp.irradiance, phase);
            }
        }
        // Directions by rejection: uniform ones, weighted by the phase function.
        let most = (1.0 - g * g) / (1.0 - g.abs()).powi(3);
        along = loop {
            let turned = DVec3::new(noise.range(-1.0, 1.0), noise.range(-1.0, 1.0), noise.range(-1.0, 1.0));
            let length = turned.length();
            if !(1e-3..=1.0).contains(&length) {
                continue;
            }
            let turned = turned / length;
            let density = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * along.dot(turned)).powf(1.5);
            if noise.next() * most < density {
                break turned;
            }
        };
        place = p;
    }
    light
}

/// The mean of a picture of speckle lies within its confidence interval of 99.9 % of the expectation, except for about as many pixels as chance leaves outside.
#[test]
fn the_mean_of_speckle_lies_within_its_confidence_interval_of_the_expectation() {
    let device = Device::new();
    let toml = format!("{MANY}still = {{ samples = 256, anisotropy = 0.3, events = 6, batch = 64 }}");
    let (scene, frames) = speckle(&toml, 18);
    let mut renderer = rendered(&device, scene.clone(), &frames);
    let sums = sums(&mut renderer);
    let volume = renderer.read(Slot::Volume).expect("read").expect("volume");
    let table = renderer_table(&scene);
    let majorant = table.values.iter().skip(3).step_by(4).copied().fold(0.0, f64::max);
    let medium = Medium::of(&scene, &volume, &table, None);
    let count = 1000;
    let pixels: Vec<[usize; 2]> = (0..18).flat_map(|y| (0..18).map(move |x| [x, y])).collect();
    let expected: Vec<(f64, f64)> = pixels
        .par_iter()
        .map(|pixel| {
            let mut noise = Noise(1 + pixel[0] as u64 + 1000 * pixel[1] as u64);
            let paths = (0..count).map(|_| independent(&scene, &medium, majorant, *pixel, &mut noise));
            let (sum, squares) = paths.fold((0.0, 0.0), |(sum, squares), light| (sum + light, squares + light * light));
            let mean = sum / f64::from(count);
            (mean, (squares / f64::from(count) - mean * mean).max(0.0) / f64::from(count - 1))
        })
        .collect();
    let (mut outside, mut judged, mut apart, mut variance) = (0, 0, 0.0, 0.0);
    for (pixel, (expected, spread)) in pixels.iter().zip(&expected) {
        let (mean, error) = mean_luminance(&scene, &sums, &[*pixel]);
        let total = error * error + spread;
        (apart, variance) = (apart + mean - expected, variance + total);
        // A mean of fewer paths is not distributed normally.
        if sums[0].get([pixel[0], pixel[1], 0])[3] >= 30.0 {
            judged += 1;
            outside += u32::from((mean - expected).abs() > Z * total.sqrt());
        }
    }
    // Of at most 324 pixels one in a thousand is expected outside; four or more have a probability below 4e-4.
    assert!(judged > 80 && outside <= 3, "{outside} of {judged} pixels outside");
    // All pixels together: a bias that no single pixel shows.
    assert!(apart.abs() < Z * variance.sqrt(), "all pixels: {apart} +- {}", variance.sqrt());
    println!("{outside} of {judged} pixels outside; sum off by {:.2} standard errors", apart / variance.sqrt());
}

/// The medium of a scene as the CPU makes it.
fn renderer_table(scene: &Scene) -> Texels {
    let echolume::low_level::passes::slots::Initializer::ByScene(make) = Slot::StillMedium.initializer() else {
        panic!("a table")
    };
    let values: Vec<f64> = make(scene).into_iter().map(f64::from).collect();
    Texels { size: [values.len(), 1, 1], channels: 1, values }
}

/// The same bits in one dispatch of 8 samples as in 8 of one, and in bands; another seed draws another picture.
#[test]
fn no_division_into_dispatches_changes_a_bit() {
    let device = Device::new();
    let of = |batch: u32, seed: u32, bands: Bands| {
        let (scene, frames) = speckle(&format!("{MANY}still = {{ samples = 8, batch = {batch}, seed = {seed} }}"), 24);
        let mut renderer =
            Renderer::new(&device, scene, &RendererOptions { bands, ..RendererOptions::default() }).expect("renderer");
        send(&mut renderer, &frames, 0);
        sums(&mut renderer).map(|sum| sum.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>())
    };
    let whole = of(8, 1, Bands::default());
    for (batch, bands) in [(1, Bands::default()), (3, Bands::default()), (2, Bands::Fixed(64))] {
        assert!(of(batch, 1, bands) == whole, "{batch} samples a dispatch");
    }
    assert!(of(8, 2, Bands::default()) != whole, "another seed");
}

/// Prevents a still of many samples that fails because its dispatches have more parameters than a command buffer takes.
#[test]
fn as_many_samples_as_anybody_asks_for_fit_into_a_picture() {
    let device = Device::new();
    let (scene, frames) = speckle(&format!("{MANY}still = {{ samples = 600, batch = 1 }}"), 8);
    let mut renderer = rendered(&device, scene, &frames);
    renderer.picture().expect("a picture");
    let many = speckle(&format!("{MANY}still = {{ samples = 65536, batch = 1 }}"), 8).0;
    assert!(Plan::new(&many).steps.len() < 200, "its parameters fit too");
}

/// No extinction within a brick exceeds its majorant, in every geometry, with both interpolations between slices.
#[test]
fn no_sample_in_a_brick_exceeds_its_majorant() {
    let device = Device::new();
    let geometries =
        [Geometry::Sweep(wobbler()), Geometry::Sweep(linear()), Geometry::Sweep(radial()), cartesian([24, 20, 9])];
    let (mut checked, mut lower) = (0, 0);
    for (n, geometry) in geometries.into_iter().enumerate() {
        for elevation in ["linear", "bspline"] {
            let toml = format!(
                "mode = 'vr'\nslices.pixels = 48\npicture.size = [8, 8]\nray = {{ brick = 4, elevation = '{elevation}' }}\n\
                 still = {{ samples = 1 }}\nvolume = {{ window = [0.2, 0.8], transfer = [{{ at = 0, colour = [1, 1, 1], opacity = 0 }}, \
                 {{ at = 0.4, colour = [1, 1, 1], opacity = 0.9 }}, {{ at = 0.6, colour = [1, 1, 1], opacity = 0 }}] }}"
            );
            let scene = scene(geometry.clone(), FLOATS, &toml);
            let mut noise = Noise(n as u64);
            let grains: Vec<f64> = (0..4096).map(|_| noise.next()).collect();
            let frames = frames(&scene, |[x, y, k]| grains[(x / 3 + 31 * (y / 3) + 577 * k) % grains.len()]);
            let mut renderer = rendered(&device, scene.clone(), &frames);
            renderer.picture().expect("picture");
            let read = |renderer: &mut Renderer, slot| renderer.read(slot).expect("read").expect("slot");
            let (volume, majorants) = (read(&mut renderer, Slot::Volume), read(&mut renderer, Slot::StillMajorants));
            let table = renderer_table(&scene);
            let medium = Medium::of(&scene, &volume, &table, None);
            let (view, bricks) = (scene.volume_view(), scene.bricks());
            let largest = majorants.values.iter().copied().fold(0.0, f64::max);
            for _ in 0..20_000 {
                let share = DVec3::new(noise.next(), noise.next(), noise.next());
                let place = view.low + (view.high - view.low) * share;
                let cell = ((place - bricks.low) / bricks.edge).floor().as_ivec3();
                let inside = (0..3).all(|a| (0..bricks.count[a] as i32).contains(&cell[a]));
                if !inside {
                    continue;
                }
                let bound = majorants.one(cell.x as usize, cell.y as usize, cell.z as usize);
                let (_, extinction) = medium.at(place);
                assert!(
                    extinction <= bound * (1.0 + 1e-5) + 1e-6,
                    "{n}, {elevation}: {extinction} in a brick of {bound}"
                );
                checked += 1;
                lower += u32::from(bound < largest);
            }
        }
    }
    assert!(
        checked > 50_000 && lower > 1000,
        "{checked} places, {lower} of them in bricks with less than the largest majorant"
    );
}

/// Finite light in media that are empty, opaque, or do not absorb, and validation that says nothing.
#[test]
fn extreme_media_have_finite_light() {
    let device = Device::new();
    let media = [
        ("empty", "volume = { transfer = [{ at = 0, colour = [1, 1, 1], opacity = 0 }] }\nstill = { samples = 2 }"),
        ("no extinction", "volume.transfer = 'skin'\nstill = { samples = 2, extinction = 0 }"),
        (
            "opaque",
            "volume = { transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }] }\nstill = { samples = 2, extinction = 100 }",
        ),
        (
            "grains of the largest extinction",
            "volume = { transfer = [{ at = 0.9, colour = [1, 1, 1], opacity = 0 }, { at = 1, colour = [1, 1, 1], opacity = 1 }] }\n\
             still = { samples = 2, anisotropy = 0.95, events = 1024 }",
        ),
        (
            "backwards",
            "volume.transfer = 'bone'\nstill = { samples = 2, anisotropy = -0.95, events = 1 }\nlight = { diffuse = 10, ambient = 10 }",
        ),
    ];
    for (name, toml) in media {
        for brick in [0, 8] {
            let (scene, frames) = speckle(&format!("mode = 'vr'\nray = {{ brick = {brick} }}\n{toml}"), 8);
            let mut renderer = rendered(&device, scene, &frames);
            for texels in sums(&mut renderer) {
                assert!(texels.values.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}, bricks of {brick}");
            }
            let picture = renderer.read(Slot::Picture).expect("read").expect("picture");
            assert!(picture.values.iter().all(|v| v.is_finite()), "{name}");
        }
    }
}
