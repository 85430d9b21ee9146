//! Proven bounds of pictures against the exact reference: 50 scenes drawn by a fixed seed, and faults planted in the volume and in the
//! bounds.

use crate::common::probes::{voxels, wobbler};
use crate::common::scenes::{FLOATS, scene};
use echolume::low_level::bounds::{Effort, PictureBounds, Proof, fault, picture, proven};
use echolume::low_level::exact_ray;
use echolume::low_level::passes::{Arrays, Texels};
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Motion, Probe};
use echolume::low_level::scene::Scene;
use echolume::low_level::statistics::mix;

/// Numbers in 0..1, the same in every run (SplitMix64; Steele, Lea, Flood 2014).
struct Draw(u64);

impl Draw {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn of(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize % count
    }
}

fn geometry(draw: &mut Draw) -> Geometry {
    if draw.of(2) == 0 {
        return voxels([draw.of(7) + 2, draw.of(7) + 2, draw.of(7) + 1]);
    }
    let slices = [
        Axis::centred(0.06, 9),
        Axis::from_table((0..9).map(|k| 0.06 * f64::from(k) - 0.25 + 0.015 * f64::from(k).sin()).collect()),
    ];
    let turning = slices[draw.of(2)].clone();
    let (motion, slices) = match draw.of(3) {
        0 => (Motion::Translated, Axis::centred(2.0, 9)),
        1 => (Motion::Fan { wobble_radius: 30.0 }, turning),
        _ => (Motion::Fan { wobble_radius: 12.0 }, turning),
    };
    let advance = match draw.of(3) {
        0 => Advance::Same(0.5 * (slices.at(1.0) - slices.at(0.0))),
        _ => Advance::None,
    };
    let (array, lines) = match draw.of(4) {
        0 => (Array::Linear, Axis::centred(2.0, 16)),
        1 => (Array::Curved { radius: 20.0 }, Axis::centred(0.3, 16)),
        _ => (Array::Curved { radius: 20.0 }, Axis::centred(0.05, 16)),
    };
    Geometry::Sweep(Probe { array, lines, motion, slices, advance, ..wobbler() })
}

/// `more`: further settings.
fn random_scene(draw: &mut Draw, more: &str) -> Scene {
    let count = draw.of(4) + 1;
    let mut points: Vec<f64> = (0..count).map(|_| draw.unit()).collect();
    points.sort_by(f64::total_cmp);
    points.dedup_by(|b, a| *b - *a < 0.01);
    let tallest = [0.05, 0.3, 1.0][draw.of(3)];
    let points: Vec<String> = points
        .iter()
        .map(|at| {
            let [r, g, b, a] = [0; 4].map(|_| draw.unit());
            format!("{{ at = {at}, colour = [{r}, {g}, {b}], opacity = {} }}", a * tallest)
        })
        .collect();
    let shading = ["none", "depth-coded"][draw.of(2)];
    let threshold = [0.0, 0.4][draw.of(2)];
    let toml = format!(
        "mode = 'vr'\npicture = {{ size = [8, 6] }}\nslices = {{ pixels = 16 }}\n{more}\n\
         volume = {{ transfer = [{}], threshold = {threshold}, shading = '{shading}', window = [{}, {}] }}\n\
         camera = {{ azimuth = {}, elevation = {}, roll = {}, zoom = {}, field_of_view = {} }}",
        points.join(", "),
        draw.between(-0.2, 0.2),
        draw.between(0.7, 1.2),
        draw.between(-180.0, 180.0),
        draw.between(-80.0, 80.0),
        draw.between(-90.0, 90.0),
        draw.between(0.8, 1.6),
        [0.0, 40.0][draw.of(2)],
    );
    let geometry = geometry(draw);
    scene(geometry, FLOATS, &toml)
}

fn noise(scene: &Scene, draw: &mut Draw) -> Texels {
    let size = scene.volume_size().map(|n| n as usize);
    let values = (0..size.iter().product::<usize>()).map(|_| draw.unit()).collect();
    Texels { size, channels: 1, values }
}

/// The exact picture by quadrature.
fn integrated(scene: &Scene, volume: &Texels) -> Texels {
    let [width, height] = scene.ray_size().map(|n| n as usize);
    let (mut reads, mut writes) = (Arrays::default(), Arrays::default());
    reads.insert("volume", volume.clone());
    writes.insert("picture", Texels::untouched([width, height, 1], 4));
    let mut effort = exact_ray::picture::Effort::default();
    assert!(exact_ray::picture::replace(scene, "raycast_volume", &reads, &mut writes, &mut effort));
    assert!(effort.estimate < 1e-8, "{effort:?}");
    writes.get("picture").clone()
}

/// Channels of a picture that are outside of their bounds by more than the quadrature's own error.
fn outside(bounds: &PictureBounds, exact: &Texels) -> usize {
    let pairs = exact.values.iter().zip(bounds.low.values.iter().zip(&bounds.high.values));
    pairs.filter(|(v, (low, high))| **v < **low - 1e-10 || **v > **high + 1e-10).count()
}

const COARSE: Effort = Effort { width: 0.02, parts: 1500 };

#[test]
fn the_integral_lies_within_its_bounds_on_every_pixel_of_fifty_scenes() {
    let mut draw = Draw(7);
    let (mut widths, mut parts) = (Vec::new(), 0);
    for n in 0..50 {
        let scene = random_scene(&mut draw, "");
        assert_eq!(fault(&scene), None);
        let volume = noise(&scene, &mut draw);
        let (bounds, exact) = (picture(&scene, &volume, COARSE), integrated(&scene, &volume));
        assert_eq!(outside(&bounds, &exact), 0, "scene {n}: {:?}", scene.settings);
        assert!(bounds.widths().iter().all(|w| (0.0..=4.0).contains(w)), "scene {n}");
        let hits = exact.values.chunks_exact(4).map(|p| p[3] > 0.05);
        widths.extend(bounds.widths().into_iter().zip(hits).filter(|(_, hit)| *hit).map(|(width, _)| width));
        parts += bounds.parts;
    }
    widths.sort_by(f64::total_cmp);
    let at = |share: f64| widths[(share * (widths.len() - 1) as f64) as usize];
    println!("{} rays met something, {parts} parts: median {:.4}, p95 {:.4}", widths.len(), at(0.5), at(0.95));
    assert!(widths.len() > 500, "{} rays met something", widths.len());
    assert!(at(0.5) <= 0.02 && at(0.95) < 0.05, "median {}, p95 {}", at(0.5), at(0.95));
}

/// The same with each setting that changes absorption or the field along a ray, and all of them.
#[test]
fn the_integral_lies_within_its_bounds_where_matter_fades_or_slices_are_splined() {
    let mut draw = Draw(23);
    for n in 0..32 {
        let extinction = [0.02, 0.2, 1.0, 30.0][draw.of(4)];
        let fade = format!("region.fade = {}", [0.4, 1.5, 6.0, 40.0][draw.of(4)]);
        let elevation = "ray.elevation = 'bspline'".to_string();
        let more = match n % 4 {
            0 => String::new(),
            1 => fade,
            2 => elevation,
            _ => [fade, elevation].join("\n"),
        };
        let mut scene = random_scene(&mut draw, &more);
        // The table of the volume is closed in the text.
        scene.settings.volume.extinction = matches!(n % 4, 0 | 3).then_some(extinction);
        assert_eq!(fault(&scene), None);
        let volume = noise(&scene, &mut draw);
        let (bounds, exact) = (picture(&scene, &volume, COARSE), integrated(&scene, &volume));
        assert_eq!(outside(&bounds, &exact), 0, "scene {n}, {more}: {:?}", scene.settings);
        let widths = bounds.widths_of_hits();
        let within = widths.iter().filter(|w| **w <= 4.0 * COARSE.width).count();
        assert!(10 * within >= 9 * widths.len(), "scene {n}, {more}: {within} of {} are narrow", widths.len());
        // The fault planted: the same picture without the setting.
        if n % 4 < 2 && exact.values.iter().any(|v| *v > 0.1) {
            let mut plain = scene.clone();
            plain.settings.volume.extinction = None;
            plain.settings.region.fade = 0.0;
            assert!(outside(&bounds, &integrated(&plain, &volume)) > 0, "scene {n}: bounds without {more}");
        }
    }
}

/// The faults planted: bounds that are a tenth as wide, and those of a volume that differs in one of its texels.
#[test]
fn bounds_that_are_too_narrow_or_of_another_volume_are_noticed() {
    let mut draw = Draw(11);
    let (mut narrow, mut other) = (0, 0);
    for _ in 0..12 {
        let scene = random_scene(&mut draw, "");
        let volume = noise(&scene, &mut draw);
        let exact = integrated(&scene, &volume);
        let mut bounds = picture(&scene, &volume, Effort { width: 1.0, parts: 16 });
        let pairs = bounds.low.values.iter_mut().zip(&mut bounds.high.values);
        for (low, high) in pairs {
            let middle = (*low + *high) / 2.0;
            (*low, *high) = (middle + 0.1 * (*low - middle), middle + 0.1 * (*high - middle));
        }
        narrow += usize::from(outside(&bounds, &exact) > 0);
        let mut changed = volume.clone();
        let middle = changed.values.len() / 2;
        changed.values[middle] = 1.0 - changed.values[middle].round();
        let bounds = picture(&scene, &changed, Effort { width: 0.002, parts: 4000 });
        other += usize::from(outside(&bounds, &exact) > 0);
    }
    println!("{narrow} and {other} of 12 scenes notice");
    assert!(narrow >= 6 && other >= 2, "{narrow} and {other} of 12 scenes notice");
}

#[test]
fn a_drawn_pixel_is_kept_or_broken_by_proof() {
    let mut draw = Draw(7);
    let scene = random_scene(&mut draw, "post = { gamma = 1, contrast = 1, brightness = 0 }");
    let texels = noise(&scene, &mut draw);
    let exact = integrated(&scene, &texels);
    let effort = Effort { width: 1e-4, parts: 8000 };
    let proofs = |levels: f64, by: f64| {
        let off = |n: usize, value: &f64| if n % 4 < 3 { value + by / 255.0 } else { *value };
        let drawn =
            Texels { values: exact.values.iter().enumerate().map(|(n, v)| off(n, v)).collect(), ..exact.clone() };
        proven(&scene, &texels, effort, &drawn, levels).expect("the same size").1
    };
    let hits: Vec<bool> =
        exact.values.chunks_exact(4).map(|p| p[3] > 0.01 && p.iter().take(3).all(|c| *c < 0.9)).collect();
    let count = |proofs: Vec<Proof>, which: Proof| {
        proofs.iter().zip(&hits).filter(|(proof, hit)| **hit && **proof == which).count()
    };
    let all = hits.iter().filter(|hit| **hit).count();
    assert!(all > 8, "{all} of the rays meet something");
    assert_eq!(count(proofs(1.0, 0.0), Proof::Kept), all, "the exact picture");
    assert_eq!(count(proofs(1.0, 0.8), Proof::Kept), all, "off by less than the tolerance");
    assert_eq!(count(proofs(1.0, 1.3), Proof::Broken), all, "off by more");
    let other = Texels { size: [1, 1, 1], channels: 4, values: vec![0.0; 4] };
    assert!(proven(&scene, &texels, effort, &other, 1.0).is_err());
}
