//! Empty-space skipping: rays that skip bricks make the same picture, bit for bit, as rays that take every sample; and bricks are skipped.

use crate::common::gpu::*;
use echolume::Source;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::probe::{Advance, Geometry, Probe};
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{Input, Scene};
use echolume::low_level::source::Recording;
use glam::DVec3;

/// A shell with a knob on it in dark fluid, with speckle on both and a wall before them.
fn body(p: DVec3, noise: f64) -> f64 {
    let centre = DVec3::new(1.0, 45.0, -1.0);
    let off = p.distance(centre);
    let knob = p.distance(centre + DVec3::new(-4.0, -11.0, 3.0));
    let wall = (p.y - 24.0).abs() < 0.8;
    let shell = (9.0..12.0).contains(&off) || knob < 3.0;
    match (wall, shell) {
        (true, _) => 0.5 + 0.3 * noise,
        (_, true) => 0.6 + 0.4 * noise,
        _ if noise > 0.9 => 0.02,
        _ => 0.0,
    }
}

fn body_of(scene: &Scene) -> Vec<Texels> {
    let speckle =
        |p: DVec3| Noise((p.x.to_bits() ^ p.y.to_bits().rotate_left(17) ^ p.z.to_bits().rotate_left(31)) | 1).next();
    body_frames(scene, |p| body(p, speckle(p)))
}

fn geometries() -> Vec<(&'static str, Geometry)> {
    let moved = |mut p: Probe, share: f64| {
        p.advance = Advance::Same(share * p.slices.pitch());
        p
    };
    let each = (0..9).map(|k| if k < 4 { 0.02 } else { -0.02 }).collect();
    vec![
        ("fan", Geometry::Sweep(wobbler())),
        ("fan, moving", Geometry::Sweep(moved(wobbler(), 0.7))),
        ("fan, uneven", Geometry::Sweep(uneven(wobbler()))),
        ("fan, uneven and moving", Geometry::Sweep(Probe { advance: Advance::Each(each), ..uneven(wobbler()) })),
        ("translated", Geometry::Sweep(linear())),
        ("translated, moving backwards", Geometry::Sweep(moved(linear(), -0.9))),
        ("still", Geometry::Sweep(still())),
        ("radial, moving", Geometry::Sweep(moved(radial(), 0.6))),
        ("Cartesian", {
            let grid = echolume::low_level::probe::Grid {
                size: [60, 110, 40],
                spacing: [0.5, 0.5, 0.7],
                origin: [-14.0, 18.0, -14.0],
            };
            Geometry::Cartesian(grid)
        }),
    ]
}

const MODES: [&str; 32] = [
    "mode = 'sr'\nsurface = { threshold = 0.2 }",
    "mode = 'sr'\nsurface = { threshold = 0.2, rough = 1 }",
    "mode = 'sr'\nsurface = { threshold = 0.2, rough = 4, rough_threshold = 0.1, number = 2 }",
    "mode = 'sr'\nsurface = { threshold = 0.2, sign = 'dark' }\nlight = { skin = {} }",
    "mode = 'sr'\nsurface = { threshold = 0.1, place = 'first-crossing', window = [0.1, 0.7] }",
    "mode = 'sr'\nsurface = { detector = 'adaptive', threshold = 0.1 }",
    "mode = 'sr'\nsurface = { detector = 'consistent', threshold = 0.1 }",
    "mode = 'sr'\nsurface = { detector = 'lasting', threshold = 0.1, rough = 1 }",
    "mode = 'sr'\nsurface = { threshold = 0.2, edge = 5, place = 'middle' }",
    "mode = 'sr'\nsurface = { detector = 'lasting', threshold = 0.1, edge = 7 }",
    "mode = 'sr'\nsurface = { threshold = 0.2, start_depth = 8 }\nclip = [{ at = [0, 25, 0], normal = [0.3, -1, 0.2] }]",
    "mode = 'vr'",
    "mode = 'vr'\nvolume = { transfer = 'warm', threshold = 0.3, compositing = 'riemann' }",
    "mode = 'vr'\nvolume = { threshold = 0.3, compositing = 'pre-integrated' }",
    "mode = 'vr'\nvolume = { threshold = 0.3, compositing = 'pre-integrated', window = [0.2, 0.9] }",
    "mode = 'vr'\nvolume = { threshold = 0.3, compositing = 'exponential' }",
    "mode = 'vr'\nvolume = { threshold = 0.2, shading = 'depth-coded' }",
    "mode = 'vr'\nvolume = { threshold = 0.2, shading = 'first-hit' }\nlight = { shadow = {} }",
    "mode = 'mip'",
    "mode = 'mip'\nprojection = { window = [0.1, 0.95] }",
    "mode = 'minip'",
    "mode = 'minip'\nregion = { depth = [20, 32], lateral = [-6, 8] }",
    "mode = 'mean'",
    "mode = 'mean'\nprojection = { window = [0.05, 0.8] }",
    "mode = 'sr'\nsurface = { threshold = 0.2, colour = 'rendered' }\nvolume = { threshold = 0.3 }",
    "mode = 'sr'\nsurface = { threshold = 0.2, rough = 2, place = 'first-crossing', colour = 'rendered' }\nvolume = { threshold = 0.3 }",
    "mode = 'sr'\nlayout = 'pair'\nsurface = { threshold = 0.2 }\nvolume = { threshold = 0.55, transfer = 'warm', compositing = 'riemann' }",
    "mode = 'sr'\nlayout = 'pair'\nsurface = { threshold = 0.2, sign = 'dark', number = 2, colour = 'behind' }\nvolume = { window = [0.3, 1] }",
    "mode = 'sr'\nlayout = 'pair'\nsurface = { detector = 'lasting', threshold = 0.1, rough = 4 }\nvolume = { threshold = 0.3, shading = 'depth-coded' }",
    "mode = 'sr'\nsurface = { threshold = 0.2, colour = 'behind' }\nvolume = { threshold = 0.3, compositing = 'pre-integrated' }",
    "mode = 'mixed'\nsurface = { threshold = 0.2 }\nvolume = { threshold = 0.3 }",
    "mode = 'mixed'\nsurface = { threshold = 0.2, sign = 'dark' }\nvolume = { threshold = 0.3, compositing = 'pre-integrated' }",
];

const RAYS: [&str; 10] = [
    "sampling = 'quads', step = 0.4",
    "sampling = 'hardware', step = 0.55, early_end = 0.0",
    "sampling = 'hardware', step = 0.4, spread = 1.0",
    "sampling = 'hardware', step = 0.13",
    "sampling = 'exact', step = 0.4, sliding = 3",
    "sampling = 'hardware', step = 0.25, sliding = 5",
    "sampling = 'exact', step = 0.3, sliding = 5, spread = 0.5",
    "sampling = 'quads', step = 0.4, elevation = 'bspline'",
    "sampling = 'hardware', step = 0.4, elevation = 'bspline'",
    "sampling = 'exact', step = 0.4, elevation = 'bspline-sharp'",
];

const CAMERAS: [&str; 3] =
    ["azimuth = 25, elevation = -15, field_of_view = 35", "elevation = 90", "azimuth = 170, elevation = 3, zoom = 2"];

/// The results of stage 2 that the scene has.
const RESULTS: [Slot; 7] = [
    Slot::Distance,
    Slot::Surface,
    Slot::VolumeLayer,
    Slot::VolumeBesideSurface,
    Slot::Rendered,
    Slot::Picture,
    Slot::Screen,
];

fn results(renderer: &mut Renderer) -> Vec<(Slot, Vec<u64>)> {
    renderer.picture().expect("picture");
    let slots: Vec<Slot> = RESULTS.into_iter().filter(|s| renderer.plan().slots.contains(s)).collect();
    let bits = |t: Texels| t.values.iter().map(|v| v.to_bits()).collect();
    slots.into_iter().map(|s| (s, bits(renderer.read(s).expect("read").expect("image")))).collect()
}

/// Bricks that rays skip, singly or several at once: their share of all.
fn leapt(renderer: &mut Renderer) -> [f64; 2] {
    let mut shares = [0.0f64; 2];
    for slot in [Slot::SurfaceBrickDistances, Slot::VolumeBrickDistances] {
        let Some(leaps) = renderer.read(slot).expect("read") else { continue };
        let share = |test: fn(u32) -> bool| {
            let codes = leaps.values.iter().map(|v| (v * 255.0).round() as u32);
            codes.filter(|c| test(*c)).count() as f64 / leaps.values.len() as f64
        };
        shares = [share(|c| c >> 6 > 0).max(shares[0]), share(|c| c >> 6 > 0 && c & 63 > 1).max(shares[1])];
    }
    shares
}

#[test]
fn empty_space_skipping_changes_no_bit_in_any_mode() {
    let device = Device::new();
    let (mut tried, mut leapt_far) = (0, 0);
    for (g, (name, geometry)) in geometries().iter().enumerate() {
        for (m, mode) in MODES.iter().enumerate() {
            // Every mode has every ninth geometry, and a fan in any case; rays and cameras alternate.
            if g > 0 && (g + m) % 9 != 1 {
                continue;
            }
            // Exponential steps, and those of a surface with the volume behind it in the same march, have one length.
            let is_even = mode.contains("exponential") || (mode.contains("pair") && mode.contains("behind"));
            let rays: Vec<&str> = RAYS.into_iter().filter(|ray| !is_even || !ray.contains("spread")).collect();
            let (ray, camera) = (rays[(g + m) % rays.len()], CAMERAS[(g + m / 2) % CAMERAS.len()]);
            let toml = |brick: u32| {
                let more =
                    format!("picture = {{ size = [31, 27] }}\nslices = {{ pixels = 128 }}\ncamera = {{ {camera} }}");
                format!("{mode}\n{more}\nray = {{ {ray}, brick = {brick} }}")
            };
            let plain = scene(geometry.clone(), BYTES, &toml(0));
            let frames = body_of(&plain);
            let mut renderer = rendered(&device, plain, &frames);
            let expected = results(&mut renderer);
            for brick in [[4, 9][(g + m) % 2]] {
                renderer.change(scene(geometry.clone(), BYTES, &toml(brick))).expect("change");
                let what = format!("{name}, {mode}, {ray}, {camera}, bricks of {brick}");
                assert!(renderer.plan().slots.contains(&Slot::BrickRanges), "{what}: nothing to leap over");
                for ((slot, a), (_, b)) in expected.iter().zip(results(&mut renderer)) {
                    let differ = a.iter().zip(&b).filter(|(a, b)| a != b).count();
                    assert_eq!(differ, 0, "{what}: {differ} of {} values of '{}' differ", a.len(), slot.name());
                }
                tried += 1;
                let [any, far] = leapt(&mut renderer);
                leapt_far += u32::from(any > 0.2 && far > 0.01);
            }
        }
    }
    println!("{tried} pictures, {leapt_far} with long leaps over a fifth of all bricks or more");
    // The smallest and the largest sample on a ray are found by ranges: 4 of 22 modes. A single frame has few bricks.
    assert!(2 * leapt_far > tried, "only {leapt_far} of {tried}");
}

/// The bone with steps of three voxels, so that a ray may leave an empty brick after one step: the next step begins with that sample.
#[test]
fn a_step_behind_a_single_skipped_one_has_its_front_sample() {
    let device = Device::new();
    let picture = |compositing: &str, brick: u32| {
        let mut recording = Recording::open(&data("bone-l14/bone.mha"), None).expect("recording");
        let input = Input { stored: recording.stored_type(), range: recording.range() };
        let mut layers = Layers::default();
        layers.preset("bone").expect("preset");
        for set in ["mode=vr", "picture.size=[160,160]", "ray.step=0.9", "volume.threshold=0.4"] {
            layers.set(set).expect("set");
        }
        layers.set(&format!("volume.compositing={compositing}")).expect("set");
        layers.set(&format!("ray.brick={brick}")).expect("set");
        let scene = Scene::new(recording.geometry(0), input, layers.finish().expect("settings")).expect("scene");
        let mut renderer = Renderer::new(&device, scene, &RendererOptions::default()).expect("renderer");
        while let Some(frame) = recording.next_frame().expect("frame") {
            renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
        }
        renderer.show(0).expect("show");
        results(&mut renderer)
    };
    for compositing in ["pre-integrated", "exponential"] {
        let expected = picture(compositing, 0);
        for brick in [4, 9] {
            assert!(expected == picture(compositing, brick), "{compositing}, bricks of {brick}: the picture differs");
        }
    }
}
