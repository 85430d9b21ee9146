//! The storage of the volume for the rays: frames in the volume's format are copied, and packed neighbours equal eight texels.

use crate::common::gpu::*;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::slots::Format;
use echolume::low_level::passes::{Slot, Texels, chain, is_hit};
use echolume::low_level::plan::{Plan, Rerun};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Input, Sampling, Scene};
use echolume::low_level::source::StoredType;
use glam::DVec3;

const LOOK: &str =
    "picture.size = [72, 56]\ncamera = { azimuth = 25, elevation = -15 }\nray.step = 0.3\nsurface.edge = 1.2";

const LOOK_COARSE: &str = "picture.size = [72, 56]\ncamera = { azimuth = 25, elevation = -15 }";

fn volume(stored: StoredType, full: f64, toml: &str) -> Scene {
    scene(cartesian([24, 33, 11]), Input { stored, range: [0.0, full] }, &format!("{toml}\n{LOOK}"))
}

fn blob(p: DVec3) -> f64 {
    let off = p.distance(DVec3::new(2.0, 8.0, 1.5));
    if off < 4.0 { 0.9 - 0.08 * off } else { 0.05 * (p.x * 2.0).sin().abs() }
}

#[test]
fn frames_in_the_volume_format_are_copied_without_a_pass() {
    let device = Device::new();
    for (stored, full, format) in
        [(StoredType::U8, 255.0, "r8"), (StoredType::U16, 65535.0, "r16"), (StoredType::F32, 1.0, "r32f")]
    {
        for smooth in ["", ", smooth = { elevation = 1.0 }"] {
            let set = format!("mode = 'mip'\nslices = {{ format = '{format}'{smooth} }}");
            let scene = volume(stored, full, &set);
            let target = chain::copied(&scene).expect("copied");
            assert_eq!(target, if smooth.is_empty() { Slot::Volume } else { Slot::SharpVolume });
            let frames = body_frames(&scene, blob);
            let mut renderer = rendered(&device, scene.clone(), &frames);
            assert!(!renderer.plan().slots.contains(&Slot::Frames), "no array of frames is kept");
            assert!(!renderer.plan().steps.iter().any(|s| s.pass.name == "load_slice"));
            let there = renderer.read(target).expect("read").expect("the volume");
            for (z, frame) in frames.iter().enumerate() {
                let slice = Texels::from_fn([24, 33, 1], 1, |[x, y, _], _| there.one(x, y, z));
                let format = Slot::Frames.format(&scene);
                assert_eq!(slice.encode(format), frame.encode(format), "{format:?}, slice {z}");
            }
            // The same through a pass, into a format that rounds them.
            let passed = scene.settings.clone();
            let mut passed = Scene::new(scene.geometry.clone(), scene.input, passed).expect("scene");
            use echolume::low_level::scene::VolumeFormat::{R16, R16f};
            passed.settings.slices.format = if format == "r32f" { R16 } else { R16f };
            assert_eq!(chain::copied(&passed), None);
            let other = rendered(&device, passed, &frames).picture().expect("picture");
            let (_, largest) = difference(&renderer.picture().expect("picture"), &other);
            assert!(largest <= 1.0, "{format}{smooth}: {largest} levels");
        }
    }
}

/// Frames that are not scaled: the first filter reads them in their layers. All frames of the volume differ, and there are more than layers.
#[test]
fn the_first_filter_reads_unscaled_frames_as_they_are() {
    let device = Device::new();
    for (stored, full) in [(StoredType::U8, 255.0), (StoredType::U16, 65535.0)] {
        for filters in ["median = true", "smooth = { lateral = 0.5, depth = 0.5 }", "perona_malik = { repeat = 2 }"] {
            let scene = volume(stored, full, &format!("mode = 'mip'\nslices = {{ format = 'r32f', {filters} }}"));
            let frames = body_frames(&scene, blob);
            let frames: Vec<Texels> = (frames.iter())
                .map(|f| Texels::decode(f.size, Slot::Frames.format(&scene), &f.encode(Slot::Frames.format(&scene))))
                .collect();
            let mut renderer = rendered(&device, scene.clone(), &frames);
            assert!(!renderer.plan().steps.iter().any(|s| s.pass.name == "load_slice"), "{filters}");
            let there = renderer.read(Slot::Volume).expect("read").expect("the volume");
            let expected = echolume::low_level::reference::render(&scene, &frames);
            let off = there.values.iter().zip(&expected[&Slot::Volume].values).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 2e-6, "{stored:?}, {filters}");
        }
    }
}

#[test]
fn scaled_clamped_or_filtered_frames_are_not_copied() {
    let copied = |stored, full, toml: &str| chain::copied(&volume(stored, full, toml));
    assert!(copied(StoredType::U8, 255.0, "slices.format = 'r8'").is_some());
    assert_eq!(copied(StoredType::U8, 200.0, "slices.format = 'r8'"), None, "another range");
    assert_eq!(copied(StoredType::U8, 255.0, "slices.format = 'r16f'"), None, "another format");
    assert_eq!(copied(StoredType::U8, 200.0, "slices.format = 'r16'"), None, "another range in a wider format");
    assert!(copied(StoredType::F32, 1.0, "slices.format = 'r32f'").is_some());
    assert_eq!(copied(StoredType::F32, 2.0, "slices.format = 'r32f'"), None, "another range of floats");
    assert_eq!(copied(StoredType::F32, 1.0, "slices.format = 'r16'"), None, "floats in another format");
    assert_eq!(copied(StoredType::U8, 255.0, "slices = { format = 'r8', median = true }"), None, "a filter");
    let polar = scene(Geometry::Sweep(wobbler()), BYTES, "slices.format = 'r8'");
    assert_eq!(chain::copied(&polar), None, "polar frames");
}

/// Integers in a wider format: what is copied is the nearest value to v/255 or v/65535, on every device, and what the pass would store but for
/// what a driver's own conversion is off. Frames go in batches, and one by one.
#[test]
fn widened_frames_are_what_the_pass_stores() {
    let device = Device::new();
    for (stored, full, format, bytes) in
        [(StoredType::U8, 255u32, "r16", 1usize), (StoredType::U8, 255, "r32f", 1), (StoredType::U16, 65535, "r32f", 2)]
    {
        let of = |more: &str| {
            let set = format!("mode = 'mip'\nray.sampling = 'exact'\nslices = {{ format = '{format}'{more} }}");
            volume(stored, f64::from(full), &set)
        };
        // A median of a single column and row would be a pass too; a range that is off by less than f64 shows is none of the copied ones.
        let copied = of("");
        let passed = Scene { input: Input { stored, range: [0.0, f64::from(full).next_up()] }, ..copied.clone() };
        assert_eq!((chain::copied(&copied), chain::copied(&passed)), (Some(Slot::Volume), None), "{format}");
        let said = Plan::new(&copied).explain(&copied);
        assert!(said.contains("slices: copied into the 3D image as they arrive, by no pass, widened from R"), "{said}");
        // Every value that a byte has, and many that two bytes have.
        let texels = 24 * 33;
        let frame = |z: usize| -> Vec<u8> {
            let values = (0..texels).map(|n| ((n + z * texels) as u32 * if bytes == 1 { 1 } else { 151 }) % (full + 1));
            values.flat_map(|v| v.to_le_bytes()[..bytes].to_vec()).collect()
        };
        let draw = |scene: &Scene, each: bool| {
            let mut renderer = Renderer::new(&device, scene.clone(), &RendererOptions::default()).expect("renderer");
            for z in 0..11usize {
                renderer.frame(z as u32, &frame(z), 0).expect("frame");
                if each {
                    renderer.show(0).expect("the batch is sent");
                }
            }
            renderer.show(0).expect("show");
            (renderer.picture().expect("picture"), renderer.read(Slot::Volume).expect("read").expect("there"))
        };
        let (picture, there) = draw(&copied, false);
        assert!(draw(&copied, true) == (picture.clone(), there.clone()), "{format}: one by one");
        for z in 0..11 {
            let values = frame(z)
                .chunks(bytes)
                .map(|b| b.iter().rev().fold(0u32, |v, b| 256 * v + u32::from(*b)))
                .collect::<Vec<_>>();
            for (n, value) in values.into_iter().enumerate() {
                let exact = f64::from(value) / f64::from(full);
                let nearest = if format == "r16" { f64::from(257 * value) / 65535.0 } else { f64::from(exact as f32) };
                assert_eq!(there.one(n % 24, n / 24, z), nearest, "{format}: {value}");
            }
        }
        let (other, by_pass) = draw(&passed, false);
        let pairs = by_pass.values.iter().zip(&there.values);
        let differ = pairs.clone().filter(|(a, b)| a != b).count();
        let largest = pairs.map(|(a, b)| (a - b).abs() / Texels::spacing(Format::R32f, *b)).fold(0.0, f64::max);
        println!("{stored:?} in {format}: {differ} of {} texels differ by {largest} units at most", there.values.len());
        // Drivers multiply by 1/255 in f32, which is off by a unit in the last place for every second byte.
        assert!(if format == "r16" { differ == 0 } else { largest <= 1.0 }, "{format}: {largest}");
        let (mean, most) = difference(&other, &picture);
        assert!(mean < 0.01 && most <= 1.0 && (differ > 0 || most == 0.0), "{format}: {mean}, {most}");
    }
}

/// Floats beyond 0..1, and what is no number, are stored as a pass would store them.
#[test]
fn copied_floats_are_clamped() {
    let device = Device::new();
    let scene = volume(StoredType::F32, 1.0, "mode = 'mip'\nslices.format = 'r32f'");
    assert_eq!(chain::copied(&scene), Some(Slot::Volume));
    assert!(Plan::new(&scene).explain(&scene).contains("slices: copied into the 3D image"));
    let values = [-3.0f32, -0.25, 0.0, 0.25, 1.0, 7.0, f32::INFINITY, f32::NAN];
    let bytes: Vec<u8> = (0..24 * 33).flat_map(|n| values[n % 8].to_ne_bytes()).collect();
    let mut renderer = Renderer::new(&device, scene, &RendererOptions::default()).expect("renderer");
    (0..11).for_each(|slice| renderer.frame(slice, &bytes, 0).expect("frame"));
    renderer.show(0).expect("show");
    let there = renderer.read(Slot::Volume).expect("read").expect("there");
    let expected = [0.0, 0.0, 0.0, 0.25, 1.0, 1.0, 1.0, 0.0];
    assert!(there.values.iter().enumerate().all(|(n, v)| *v == expected[n % 8]));
}

/// Where a part of the columns and rows is seen, neighbours are packed of that part.
#[test]
fn packed_neighbours_and_bricks_are_as_large_as_what_is_seen() {
    let device = Device::new();
    let of = |toml: &str| {
        let set = "mode = 'vr'\nslices.pixels = 200\nray = { sampling = 'quads', brick = 8, step = 0.3 }";
        scene(Geometry::Sweep(wobbler()), BYTES, &format!("{set}\n{toml}\n{LOOK_COARSE}"))
    };
    let (all, part) = (of(""), of("region = { lateral = [-8, 4], depth = [22, 34] }"));
    let bytes = |slot: Slot| (slot.bytes(&part) as f64) / slot.bytes(&all) as f64;
    let share = part.visible_share();
    assert!(share < 0.15, "{share}");
    // Complete workgroups of 32 texels, and a brick more on each side.
    assert!(bytes(Slot::PackedNeighbours) < 0.3, "{}", bytes(Slot::PackedNeighbours));
    assert!(bytes(Slot::BrickRanges) < 0.3, "{}", bytes(Slot::BrickRanges));
    let frames = body_frames(&all, |p| 0.5 + 0.4 * (p.x + 0.7 * p.y + p.z).sin());
    let picture = |scene: &Scene| rendered(&device, scene.clone(), &frames).picture().expect("picture");
    let everything = of("region = { lateral = [-8, 4], depth = [22, 34] }\nslices.everything = true");
    assert_eq!(Slot::BrickRanges.bytes(&everything), Slot::BrickRanges.bytes(&all));
    let seen = picture(&part);
    assert!(seen.rgba.iter().any(|v| *v > 0 && *v < 255));
    assert_eq!(seen.rgba, picture(&everything).rgba, "the same bits");
    // To a smaller region and back. Neighbours and ranges were made of the smaller one, so that frames are asked for.
    let mut renderer = rendered(&device, all.clone(), &frames);
    let whole = renderer.picture().expect("picture");
    assert!(matches!(renderer.change(part).expect("change"), Rerun::Steps { .. }));
    assert_eq!(renderer.picture().expect("picture").rgba, seen.rgba);
    assert_eq!(renderer.change(all).expect("change"), Rerun::Frames);
    send(&mut renderer, &frames, 0);
    assert_eq!(renderer.picture().expect("picture").rgba, whole.rgba);
}

/// Bricks are made where they are asked for, or where they save more than they take: in large pictures that composite.
#[test]
fn bricks_are_made_where_they_pay() {
    let of = |toml: &str| {
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, &format!("slices.pixels = 96\n{toml}"));
        let scene = scene.sampled(Sampling::PackedNeighbours);
        let text = Plan::new(&scene).explain(&scene);
        (scene.skips(), text.lines().find(|line| line.starts_with("bricks")).expect("said").to_string())
    };
    for (toml, skips, why) in [
        ("mode = 'vr'\npicture.size = [512, 512]", true, "they pay"),
        ("mode = 'vr'\npicture.size = [16, 16]", false, "none for one picture"),
        ("mode = 'sr'\npicture.size = [512, 512]", false, "none for one picture"),
        ("mode = 'sr'\npicture.size = [16, 16]\nslices.still = true", true, "many times"),
        ("mode = 'sr'\npicture.size = [16, 16]\nray.brick = 8", true, "as set"),
        ("mode = 'vr'\npicture.size = [512, 512]\nray.brick = 0", false, "as set"),
    ] {
        let (does, said) = of(toml);
        assert_eq!(does, skips, "{toml}: {said}");
        assert!(said.contains(why), "{toml}: {said}");
    }
    let on_a_gpu = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'sr'").sampled(Sampling::Hardware);
    assert!(on_a_gpu.skips(), "what bricks cost a GPU has not been measured");
}

#[test]
fn switching_a_filter_on_or_off_asks_for_the_frames_again() {
    let device = Device::new();
    let plain = volume(StoredType::U8, 255.0, "mode = 'mip'\nslices.format = 'r8'");
    let filtered = volume(StoredType::U8, 255.0, "mode = 'mip'\nslices = { format = 'r8', median = true }");
    let frames = body_frames(&plain, blob);
    let mut renderer = rendered(&device, plain.clone(), &frames);
    let first = renderer.picture().expect("picture");
    assert_eq!(renderer.change(filtered).expect("change"), Rerun::Everything);
    send(&mut renderer, &frames, 0);
    assert!(difference(&renderer.picture().expect("picture"), &first).1 > 2.0, "the median is seen");
    assert_eq!(renderer.change(plain).expect("change"), Rerun::Everything);
    send(&mut renderer, &frames, 0);
    assert_eq!(renderer.picture().expect("picture").rgba, first.rgba);
}

/// Modes that take samples in different ways.
const MODES: [&str; 5] = [
    "mode = 'sr'\nsurface.threshold = 0.2",
    "mode = 'vr'\nvolume.threshold = 0.3",
    "mode = 'mip'",
    "mode = 'mean'",
    "mode = 'vr'\nvolume.shading = 'first-hit'\nray.sliding = 3",
];

#[test]
fn packed_neighbours_give_the_samples_of_eight_texels() {
    let device = Device::new();
    let geometries = [Geometry::Sweep(wobbler()), Geometry::Sweep(uneven(linear())), cartesian([24, 33, 11])];
    for (g, geometry) in geometries.into_iter().enumerate() {
        for (f, format) in ["r8", "r16", "r16f"].into_iter().enumerate() {
            // Every mode with every format, each in one geometry.
            for mode in MODES.into_iter().enumerate().filter(|(m, _)| (m + f + g) % 3 == 0).map(|(_, mode)| mode) {
                let of = |sampling: &str| {
                    let set = format!("{mode}\nray.sampling = '{sampling}'\nslices.format = '{format}'\n{LOOK}");
                    scene(geometry.clone(), BYTES, &set)
                };
                let (quads, exact) = (of("quads"), of("exact"));
                let frames = body_frames(&quads, |p| if p.y > 25.0 && p.y < 31.0 { 0.8 } else { 0.1 } + 0.1 * blob(p));
                let mut with = rendered(&device, quads.clone(), &frames);
                assert!(with.plan().steps.iter().any(|s| s.pass.name == "packed_neighbours"));
                let mut without = rendered(&device, exact, &frames);
                assert!(!without.plan().steps.iter().any(|s| s.pass.name == "packed_neighbours"));
                let (a, b) = (with.picture().expect("picture"), without.picture().expect("picture"));
                let (mean, largest) = difference(&a, &b);
                let what = format!("geometry {g}, {format}, {mode}");
                // Sums of the same eight products, rounded in another order.
                assert!(mean < 0.02 && largest <= 2.0, "{what}: {mean} levels on average, {largest} at most");
                if quads.has_distance() {
                    let read = |r: &mut Renderer| r.read(Slot::Distance).expect("read").expect("a map");
                    let (a, b) = (read(&mut with), read(&mut without));
                    let off = |(a, b): (&f64, &f64)| is_hit(*a) != is_hit(*b) || (is_hit(*a) && (a - b).abs() > 1e-3);
                    let apart = a.values.iter().zip(&b.values).filter(|pair| off(*pair)).count();
                    assert!(apart * 500 <= a.values.len(), "{what}: {apart} distances differ");
                }
            }
        }
    }
}

#[test]
fn a_moving_view_keeps_its_packed_neighbours() {
    for size in [8, 24, 48, 96, 192] {
        let set = format!("mode = 'mip'\npicture.size = [{size}, {size}]\nslices = {{ pixels = 60, format = 'r8' }}");
        let still = scene(Geometry::Sweep(wobbler()), BYTES, &set);
        let moving = Scene::new(still.geometry.clone(), still.input, still.settings.moving()).expect("scene");
        assert!(moving.settings.ray.subsampling == 2);
        assert_eq!(
            still.sampled(Sampling::PackedNeighbours).sampling,
            moving.sampled(Sampling::PackedNeighbours).sampling,
            "{size}"
        );
    }
}

#[test]
fn a_volume_that_stays_is_packed_without_new_frames_and_a_texture_of_floats_never() {
    let device = Device::new();
    let of = |toml: &str| scene(cartesian([48, 64, 40]), BYTES, &format!("mode = 'mip'\n{LOOK}\n{toml}"));
    let (moving, still) = (of("slices.format = 'r8'"), of("slices = { format = 'r8', still = true }"));
    let frames = body_frames(&moving, blob);
    let mut renderer = rendered(&device, moving.clone(), &frames);
    let first = renderer.picture().expect("picture");
    let packs = |r: &Renderer| r.plan().steps.iter().any(|s| s.pass.name == "packed_neighbours");
    assert!(!packs(&renderer), "fewer than six samples a texel do not pay");
    let software = renderer.texel_access() == echolume::low_level::gpu::TexelAccess::Storage;
    assert!(matches!(renderer.change(still.clone()).expect("change"), Rerun::Steps { .. }));
    assert_eq!(packs(&renderer), software, "a GPU filters by itself");
    assert!(difference(&renderer.picture().expect("picture"), &first).1 <= 1.0);
    // Only the new slice is packed.
    renderer.frame(7, &frames[3].encode(Format::R8), 0).expect("frame");
    renderer.show(0).expect("show");
    let changed = renderer.picture().expect("picture");
    let mut others = frames.clone();
    others[7] = frames[3].clone();
    assert_eq!(changed.rgba, rendered(&device, still, &others).picture().expect("picture").rgba);
    let floats = of("ray.sampling = 'quads'\nslices = { format = 'r32f', still = true }");
    assert!(!packs(&Renderer::new(&device, floats, &RendererOptions::default()).expect("renderer")));
}

/// Measures what `slices.format = auto` relies on: whether a float between two half floats is stored as the nearer one, or as the one nearer to 0.
#[test]
fn a_device_that_truncates_halves_is_known_and_stores_volumes_as_r16() {
    let device = Device::new();
    let scene = volume(StoredType::U8, 255.0, "mode = 'mip'\nslices.format = 'r16f'");
    let level = |x: usize, y: usize| (x + 24 * y) % 256;
    let frame = Texels::from_fn([24, 33, 1], 1, |[x, y, _], _| level(x, y) as f64 / 255.0);
    let mut renderer = rendered(&device, scene, &vec![frame; 11]);
    assert!(renderer.plan().steps.iter().any(|step| step.pass.name == "load_slice"), "a shader stores the texels");
    let stored = renderer.read(Slot::Volume).expect("read").expect("the volume");
    let (mut up, mut down) = (0, 0);
    for (x, y) in (0..10).flat_map(|y| (0..24).map(move |x| (x, y))) {
        let value = f64::from((level(x, y) as f64 / 255.0) as f32);
        let one = Texels::from_fn([1; 3], 1, |_, _| value);
        let nearest = Texels::decode([1; 3], Format::R16f, &one.encode(Format::R16f)).values[0];
        let found = stored.one(x, y, 0);
        assert!((value - found).abs() < 1e-3, "{value} is stored as {found}");
        // Those that round up, away from 0.
        if nearest > value && found == nearest {
            up += 1;
        } else if nearest > value {
            down += 1;
        }
    }
    println!("{}: of {} values that round up, {down} are truncated", device.describe(), up + down);
    assert!(up + down > 50 && (up == 0 || down == 0), "{up} up, {down} down");
    if device.candidate.is_software() {
        assert_eq!(device.candidate.truncates_halves(), down > 0);
    }
    let auto = rendered(&device, volume(StoredType::U8, 255.0, "mode = 'mip'"), &[]);
    let expected = if device.candidate.truncates_halves() { Format::R16 } else { Format::R16f };
    assert_eq!(Slot::Volume.format(auto.scene()), expected);
}
