//! Stiff and extreme cases of light, samples and distance maps, one test a case. Cases of time stamps are in `echolume verify`, those of
//! geometry and pictures in `extreme_geometry`, those of filters (diffusion beyond its step limit, sigma of 0 and infinity, hot
//! pixels, windows wider than the picture) in `filters` and, against every reference, in `passes`.

use crate::common::gpu::*;
use crate::common::program;
use crate::shading::{map, plate, run};
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{MISS, Slot, Texels, is_hit};
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::{Input, transfer};
use echolume::low_level::source::Recording;
use half::f16;

/// One ray through `voxels` of constant opacity in steps of `step` voxels: its accumulated opacity against 1 - exp(-y).
struct Medium {
    voxels: usize,
    step: f64,
    opacity: f64,
}

impl Medium {
    /// Absorption of the complete path.
    fn depth(&self) -> f64 {
        self.voxels as f64 * transfer::absorption(self.opacity)
    }

    /// Colour and opacity of the middle ray for a colour of the medium.
    fn seen(&self, device: &Device, colour: [f64; 3]) -> Vec<f64> {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [2, 2] }}\nray = {{ step = {}, early_end = 0.0, brick = 0 }}\n\
             [volume]\ntransfer = [{{ at = 0.0, colour = {colour:?}, opacity = {:?} }}]",
            0.5 * self.step,
            self.opacity
        );
        let block = Geometry::Cartesian(Grid { size: [4, self.voxels, 4], spacing: [0.5; 3], origin: [0.0; 3] });
        let scene = scene(block, BYTES, &toml);
        let frames = frames(&scene, |_| 1.0);
        let mut renderer = rendered(device, scene, &frames);
        renderer.picture().expect("picture");
        renderer.read(Slot::Picture).expect("read").expect("there").get([1, 1, 0]).to_vec()
    }

    /// True if the f32 result of the shader is within `share` of `expected`. The 11 bits of the R16F picture cannot show it; but
    /// the choice between two neighbouring R16F values for a colour c times the result shows on which side of their border b it
    /// is, so with c = b / (expected (1 +- share)) the two colours must fall on different sides. The border depends on the
    /// device: it `rounds` to the nearest, or truncates.
    fn is_within(&self, device: &Device, rounds: bool, expected: f64, share: f64) -> bool {
        let low = f16::from_f64(0.9 * expected);
        let high = f16::from_bits(low.to_bits() + 1);
        let border = if rounds { (f64::from(low) + f64::from(high)) / 2.0 } else { f64::from(high) };
        let [below, above] = [1.0 + share, 1.0 - share].map(|s| border / (expected * s));
        let seen = self.seen(device, [below, above, 0.0]);
        assert!(seen.iter().all(|v| (0.0..=1.0).contains(v)), "leaves 0..1: {seen:?}");
        (seen[0], seen[1]) == (f64::from(low), f64::from(high))
    }
}

/// True if storing as R16F rounds to the nearest (Vulkan leaves it open): found with a colour beyond the middle of two
/// neighbours, behind an opaque step.
fn rounds(device: &Device) -> bool {
    let (low, high) = (f16::from_f64(0.75), f16::from_bits(f16::from_f64(0.75).to_bits() + 1));
    let beyond = f64::from(low) + 0.75 * (f64::from(high) - f64::from(low));
    Medium { voxels: 1, step: 1.0, opacity: 1.0 }.seen(device, [beyond; 3])[0] == f64::from(high)
}

/// Row: kappa ds from 1e-6 to 1e6, a = 1, 1e4 samples of a = 1e-4: relative error under 1e-5.
#[test]
fn opacity_keeps_five_digits_from_absorptions_of_a_millionth_to_a_million() {
    let device = Device::new();
    let rounds = rounds(&device);
    // One step of y = kappa ds; beyond y = 36 no opacity below 1 is left in f64, and a = 1 is y = 1e6.
    let single = (-12..=3).map(|e| 10f64.powf(f64::from(e) / 2.0)).chain([0.4999, 0.5001, 0.7, 2.0, 20.0]);
    let mut media: Vec<Medium> =
        single.map(|y| Medium { voxels: 1, step: 1.0, opacity: transfer::opacity(y) }).collect();
    media.push(Medium { voxels: 1, step: 1.0, opacity: 1.0 });
    // 1e4 samples of a = 1e-4 each (0.0025 voxels long), and a thousand and one with a fraction of a step.
    media.push(Medium { voxels: 25, step: 0.0025, opacity: -(400.0 * (-1e-4f64).ln_1p()).exp_m1() });
    media.push(Medium { voxels: 25, step: 0.02497, opacity: 0.03 });
    // 1e4 samples of kappa ds = 1e-6.
    media.push(Medium { voxels: 40, step: 0.004, opacity: transfer::opacity(1e-6 / 0.004) });
    media.push(Medium { voxels: 40, step: 0.004, opacity: 1.0 });
    for medium in &media {
        let expected = transfer::opacity(medium.depth());
        let said = format!("{} voxels of {} in steps of {}", medium.voxels, medium.opacity, medium.step);
        assert!(medium.is_within(&device, rounds, expected, 1e-5), "{said}: more than 1e-5 from {expected}");
    }
    // The measurement itself: three times the allowed error, in either direction, is detected.
    for medium in [&media[6], &media[21], &media[22]] {
        let expected = transfer::opacity(medium.depth());
        for wrong in [expected * (1.0 + 3e-5), expected * (1.0 - 3e-5)] {
            assert!(!medium.is_within(&device, rounds, wrong, 1e-5), "an error of 3e-5 went unnoticed at {expected}");
        }
    }
}

/// Row: A in 0..1 and monotone in kappa.
#[test]
fn more_absorption_is_never_less_opaque() {
    let device = Device::new();
    for (voxels, step) in [(1, 1.0), (30, 0.37), (30, 1000.0)] {
        let mut last = 0.0;
        for e in -24..=6 {
            let opacity = if e == 6 { 1.0 } else { transfer::opacity(10f64.powf(f64::from(e) / 4.0)) };
            let seen = Medium { voxels, step, opacity }.seen(&device, [1.0, 0.5, 0.0])[3];
            assert!(
                (last..=1.0).contains(&seen),
                "{voxels} voxels, step {step}, opacity {opacity}: {seen} after {last}"
            );
            last = seen;
        }
        assert_eq!(last, 1.0, "an opaque medium is opaque");
    }
}

/// Row: NaN, Inf, denormal and negative samples. (Counting and storing: tests/io/sources.)
#[test]
fn non_finite_samples_reach_no_pass() {
    let device = Device::new();
    let hostile = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40, -1e-42, -3.0, f32::MIN_POSITIVE / 2.0];
    let folder = Folder::new("extremes");
    let header = "ObjectType = Image\nNDims = 3\nDimSize = 20 22 18\nElementSpacing = 0.5 0.5 0.5\n\
                  ElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
    let values = |bad: &dyn Fn(f32) -> f32| -> Vec<u8> {
        let value = |i: usize| match i % 11 {
            0 => bad(hostile[i / 11 % hostile.len()]),
            _ => (i as f32 * 0.37).sin().abs(),
        };
        header.bytes().chain((0..20 * 22 * 18).flat_map(|i| value(i).to_le_bytes())).collect()
    };
    let drawn = |name: &str, bytes: Vec<u8>| {
        let file = folder.join(name);
        std::fs::write(&file, bytes).expect("written");
        let mut recording = Recording::open(&file, None).expect("recording");
        let input = Input { stored: recording.stored_type(), range: recording.range() };
        let filters = "slices = { median = true, sigma = {}, enhanced_sigma = {}, perona_malik = {}, \
                       smooth = { lateral = 0.5, depth = 0.5, elevation = 0.7 }, format = 'r32f' }";
        let mut pictures = Vec::new();
        for mode in ["vr", "sr"] {
            recording.rewind();
            let toml = format!("mode = '{mode}'\npicture = {{ size = [24, 24] }}\n{filters}");
            let mut renderer =
                Renderer::new(&device, scene(recording.geometry(0), input, &toml), &RendererOptions::default())
                    .expect("renderer");
            while let Some(frame) = recording.next_frame().expect("frame") {
                renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
            }
            renderer.show(0).expect("show");
            pictures.push(renderer.picture().expect("picture"));
            for slot in renderer.plan().slots.clone() {
                let Some(texels) = renderer.read(slot).expect("read") else { continue };
                assert!(texels.values.iter().all(|v| v.is_finite()), "{mode}: slot '{}' is not finite", slot.name());
            }
        }
        ((recording.replaced(), recording.flushed()), pictures)
    };
    let ((replaced, flushed), dirty) = drawn("dirty.mha", values(&|v| v));
    // 720 bad samples: three kinds not finite, three denormal, one negative, which is valid.
    let of = |kinds: &[usize]| (0..720).filter(|n| kinds.contains(&(n % 7))).count() as u64;
    assert_eq!((replaced, flushed), (of(&[0, 1, 2]), of(&[3, 4, 6])));
    let (counted, clean) = drawn("clean.mha", values(&|v| if v.is_normal() { v } else { 0.0 }));
    assert_eq!(counted, (0, 0));
    assert!(dirty == clean, "a replaced sample is not a sample of 0");
    // Reported once, however many frames have them, and counted in the facts of the file.
    let (_, said, warned) = program::run(&["info", &folder.path("dirty.mha")]);
    assert_eq!(warned.matches("read as 0").count(), 1, "{warned}");
    assert!(said.contains(&format!("{replaced} not finite, {flushed} denormal")), "{said}");
}

const LIGHTS: [&str; 9] = [
    "direction = [-0.6, 0.5, 0.6]",
    "direction = [0.0, 0.0, -1.0]",
    "direction = [1.0, 0.0, 0.0]",
    "position = [0.0, 0.0, 0.0]",
    "position = [0.0, 0.0, -50.0]",
    "position = [5.0, -10.0, 45.0]",
    "shininess = 0.0",
    "shininess = 1000000.0",
    "shininess = 1000000.0, direction = [0.0, 0.0, 1.0]",
];

/// Row: cliff at infinity, no false edge. (All misses, one hit and the lights' extremes: `shading`.)
#[test]
fn a_cliff_at_infinity_leaves_the_surface_before_it_alone() {
    let device = Device::new();
    for light in LIGHTS {
        for skin in ["", ", skin = { wrap = 0.0, translucency = 0.0 }"] {
            let scene = plate(&format!(
                "light = {{ {light}, shadow = {{}}, occlusion = {{}} {skin} }}\n\
                 distance = {{ median = 5, bilateral = {{ pixels = 2.0, distance = 1.0 }}, sigma = {{}}, \
                 enhanced_sigma = {{}}, perona_malik = {{}} }}"
            ));
            let (origin, direction) = scene.rays.at(122.5, 122.5);
            let is_lit = match scene.light_place() {
                Some(place) => (place - origin).dot(direction) < 31.0,
                None => scene.settings.light.direction.z > 0.1,
            };
            let whole = map(&scene, |_, _| 31.5);
            let half = map(&scene, |x, y| if x + y / 3 < 160 { 31.5 } else { MISS });
            for pass in ["median_distance", "bilateral_distance", "sigma_distance", "enhanced_sigma_distance"] {
                let filtered = run(&device, &scene, pass, &half);
                let off = filtered.values.iter().find(|v| is_hit(**v) && (**v - 31.5).abs() > 1e-4);
                assert!(off.is_none(), "{pass} draws the surface to {off:?}");
            }
            for pass in ["shadow", "occlusion", "light"] {
                // Light from behind or along the plane adds nothing to the colour, and may pass its edge.
                let unseen = pass == "shadow" && !is_lit;
                let (whole, cut) = (run(&device, &scene, pass, &whole), run(&device, &scene, pass, &half));
                for (i, (a, b)) in whole.values.iter().zip(&cut.values).enumerate() {
                    let texel = i / whole.channels;
                    if is_hit(half.values[texel]) && !unseen {
                        assert!((a - b).abs() < 2e-3, "{pass} under {light}: {b} beside the cliff, {a} without it");
                    }
                    assert!(b.is_finite() && *b >= 0.0, "{pass} under {light}: {b}");
                }
            }
        }
    }
}

/// Row: light on the surface: at a point that was hit, and in the middle of a hollow.
#[test]
fn a_light_on_the_surface_itself_gives_finite_colours() {
    let device = Device::new();
    // The target of the plate is 30 mm deep and its rays start in front of the box: the surface passes through the light.
    for light in ["position = [0.0, 0.0, 0.0]", "position = [0.125, 0.125, 0.0]", "position = [0.0, 0.0, 1e-6]"] {
        for shininess in ["0.0", "16.0", "1e6"] {
            let scene =
                plate(&format!("light = {{ {light}, shininess = {shininess}, shadow = {{}}, occlusion = {{}} }}"));
            let place = scene.light_place().expect("a near light");
            let (origin, direction) = scene.rays.at(122.5, 122.5);
            let through = (place - origin).dot(direction);
            for hollow in [0.0, 0.002] {
                let surface =
                    map(&scene, |x, y| through - hollow * ((x as f64 - 122.0).powi(2) + (y as f64 - 122.0).powi(2)));
                for pass in ["shadow", "occlusion", "light"] {
                    let result = run(&device, &scene, pass, &surface);
                    let wrong = result.values.iter().find(|v| !v.is_finite() || **v < 0.0 || **v > 20.0);
                    assert!(wrong.is_none(), "{pass} under {light}, shininess {shininess}: {wrong:?}");
                }
            }
        }
    }
}

/// One hit among misses has no neighbour for a normal: every light that shines on it lights it, it is not black.
#[test]
fn a_single_hit_among_misses_is_lit() {
    let device = Device::new();
    let scene = plate("light = { direction = [0.2, 0.1, 0.9], shadow = {}, occlusion = {} }");
    let one = map(&scene, |x, y| if (x, y) == (120, 77) { 31.5 } else { MISS });
    let picture: Texels = run(&device, &scene, "light", &one);
    let lit: Vec<usize> =
        picture.values.chunks_exact(4).enumerate().filter(|(_, c)| c[3] > 0.0).map(|(i, _)| i).collect();
    assert_eq!(lit, [77 * 244 + 120]);
    assert!(picture.get([120, 77, 0])[..3].iter().all(|c| *c > 0.05), "{:?}", picture.get([120, 77, 0]));
}
