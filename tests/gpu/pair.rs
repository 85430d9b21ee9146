//! SR and VR of one march (thesis 4.4.2): one ray caster makes the same distance map, and the same colours of whole rays, as two do; and
//! the pair of both pictures is the two pictures.

use crate::common::gpu::*;
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::{Slot, Stage, by_name};
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::{Advance, Geometry};
use echolume::low_level::scene::Scene;
use glam::DVec3;

/// A wavy wall with specks in front of it, noisy behind, and a second wall farther away.
fn body(p: DVec3) -> f64 {
    let noise = Noise((p.x.to_bits() ^ p.y.to_bits().rotate_left(17) ^ p.z.to_bits().rotate_left(31)) | 1).next();
    let depth = p.y - 38.0 + 3.0 * (0.4 * p.x).sin() + 2.0 * (0.3 * p.z).cos();
    let wall = if (0.0..6.0).contains(&depth) || depth > 13.0 { 0.55 + 0.4 * noise } else { 0.12 * noise };
    if noise > 0.985 && depth < 0.0 { 0.7 } else { wall }
}

fn geometries() -> Vec<(&'static str, Geometry)> {
    let mut moving = wobbler();
    moving.advance = Advance::Same(0.7 * moving.slices.pitch());
    vec![
        ("fan", Geometry::Sweep(wobbler())),
        ("fan, moving and uneven", Geometry::Sweep(uneven(moving))),
        ("translated", Geometry::Sweep(linear())),
        (
            "Cartesian",
            Geometry::Cartesian(echolume::low_level::probe::Grid {
                size: [40, 70, 30],
                spacing: [0.6, 0.8, 0.9],
                origin: [-12.0, 12.0, -13.0],
            }),
        ),
    ]
}

/// Detectors, and what is composited, in every way that decides where samples are taken.
const LOOKS: [&str; 9] = [
    "surface = { threshold = 0.15 }",
    "surface = { threshold = 0.15, rough = 2, place = 'first-crossing', edge = 'samples' }\nray = { step = 0.4, sliding = 3 }",
    "surface = { threshold = 0.15, rough = 3, place = 'middle', edge = 4 }\nvolume = { compositing = 'riemann', threshold = 0.3 }",
    "surface = { threshold = 0.1, detector = 'adaptive' }\nvolume = { window = [0.2, 0.9], shading = 'depth-coded', transfer = 'warm' }",
    "surface = { threshold = 0.1, detector = 'lasting', rough = 2 }\nray = { early_end = 0, sampling = 'quads' }",
    "surface = { threshold = 0.1, detector = 'lasting', edge = 5, number = 2 }\nray = { step = 0.3 }",
    "surface = { threshold = 0.15, number = 3, sign = 'dark', window = [0.1, 0.8] }\nlight = { texture = 0.5, skin = {} }",
    "surface = { threshold = 0.9 }\nclip = [{ at = [0, 30, 0], normal = [0.3, -1, 0.2] }]\ncap.enabled = false",
    // Tissue of the same level in both.
    "surface = { threshold = 0.2 }\nclip = [{ at = [0, 30, 0], normal = [0.3, -1, 0.2] }]\ncap.level = 0.3\n\
     volume = { transfer = [{ at = 0.2, colour = [1, 1, 1], opacity = 0 }, { at = 0.6, colour = [1, 0.8, 0.6], opacity = 1 }] }",
];

fn look(geometry: &Geometry, mode: &str, look: &str, [width, height]: [u32; 2]) -> Scene {
    let camera = "camera = { azimuth = 15, elevation = -10, field_of_view = 30, zoom = 1.6 }";
    let toml =
        format!("{mode}\n{look}\n{camera}\npicture = {{ size = [{width}, {height}] }}\nslices = {{ pixels = 64 }}");
    scene(geometry.clone(), BYTES, &toml)
}

/// With the step of the detector's ring for the volume as well.
fn with_step_of_ring(mut scene: Scene) -> Scene {
    let step = scene.ring.step;
    scene.settings.ray.step = Some(step);
    let scene = Scene::new(scene.geometry, scene.input, scene.settings).expect("scene");
    assert_eq!(scene.step, step);
    scene
}

fn values(renderer: &mut Renderer, slot: Slot) -> Vec<f64> {
    renderer.read(slot).expect("read").expect("the slot is there").values
}

fn half(picture: &Picture, from: u32, width: u32) -> Vec<u8> {
    let row = |y: u32| (4 * (y * picture.width + from)) as usize;
    (0..picture.height).flat_map(|y| picture.rgba[row(y)..row(y) + 4 * width as usize].to_vec()).collect()
}

fn ray_casters(renderer: &mut Renderer) -> Vec<&'static str> {
    let names = renderer.dispatched_passes(|r| r.picture()).expect("picture");
    names
        .into_iter()
        // Faces of clip planes are found once for all ray casters.
        .filter(|n| {
            n.starts_with("raycast") && *n != "raycast_cap" && by_name(n).is_some_and(|p| p.stage == Stage::Raycast)
        })
        .collect()
}

/// Also in a picture of odd width, whose halves have a column of rays more than the left one shows.
#[test]
fn the_halves_of_a_pair_are_the_pictures_of_both_modes_bit_for_bit() {
    let device = Device::new();
    let (mut hits, mut rays) = (0, 0);
    for (g, (name, geometry)) in geometries().iter().enumerate() {
        // Every look in two geometries.
        for (n, settings) in LOOKS.iter().enumerate().filter(|(n, _)| (g + n) % 2 == 1) {
            let width = if (g + n) % 4 == 1 { 48 } else { 47 };
            let pair = look(geometry, "mode = 'sr'\nlayout = 'pair'", settings, [width, 21]);
            let frames = body_frames(&pair, body);
            let size = pair.ray_size();
            assert_eq!(size, [24, 21]);
            let mut both = rendered(&device, pair.clone(), &frames);
            assert_eq!(ray_casters(&mut both), ["raycast_surface_and_volume"], "{name}, {settings}");
            let picture = both.picture().expect("picture");
            let mut alone = rendered(&device, look(geometry, "mode = 'sr'", settings, size), &frames);
            let surface = alone.picture().expect("picture");
            let map = values(&mut both, Slot::Distance);
            hits += map.iter().filter(|d| **d < 3e38).count();
            rays += map.len();
            let same_map = same_values(&device, &map, &values(&mut alone, Slot::Distance), GPU_MM);
            assert!(same_map, "{name}, {settings}: another distance map");
            if pair.lights_by_echo() {
                let echoes = [&mut both, &mut alone].map(|renderer| values(renderer, Slot::Surface));
                assert!(same_values(&device, &echoes[0], &echoes[1], 1e-3), "{name}, {settings}: echoes");
            }
            let same = |a: &[u8], b: &[u8]| same_values(&device, a, b, GPU_LEVELS);
            let right = half(&picture, width / 2, width.div_ceil(2));
            assert!(same(&right, &surface.rgba), "{name}, {settings}: right half");
            let vr = with_step_of_ring(look(geometry, "mode = 'vr'", settings, size));
            let volume = rendered(&device, vr, &frames).picture().expect("picture");
            let lefts = [&picture, &volume].map(|picture| half(picture, 0, width / 2));
            assert!(same(&lefts[0], &lefts[1]), "{name}, {settings}: left half");
        }
    }
    println!("{hits} of {rays} rays hit");
    assert!(hits * 8 > rays && hits * 20 < rays * 19, "{hits} of {rays} rays hit: the looks show little");
}

/// One ray caster alone runs where a whole ray is composited for a surface; two where the march does not fit. What they write is the same.
#[test]
fn one_ray_caster_runs_and_writes_what_two_do() {
    let device = Device::new();
    let geometry = Geometry::Sweep(wobbler());
    let once = "raycast_surface_and_volume";
    for (mode, more, expected) in [
        ("mode = 'sr'\nlayout = 'pair'", "", vec![once]),
        ("mode = 'sr'\nlayout = 'pair'\nsurface.colour = 'rendered'", "", vec![once]),
        ("mode = 'sr'\nlayout = 'pair'\nsurface.colour = 'behind'", "", vec![once, "raycast_volume"]),
        ("mode = 'sr'\nsurface.colour = 'rendered'", "ray.sliding = 3", vec![once]),
        ("mode = 'sr'\nsurface.colour = 'rendered'", "ray.sliding = 3\nvolume.compositing = 'riemann'", vec![once]),
        ("mode = 'sr'\nsurface.colour = 'rendered'", "", vec!["raycast_surface", "raycast_volume"]),
        (
            "mode = 'sr'\nsurface.colour = 'rendered'",
            "ray.sliding = 3\nvolume.compositing = 'pre-integrated'",
            vec!["raycast_surface", "raycast_volume"],
        ),
        (
            "mode = 'sr'\nlayout = 'pair'",
            "volume.compositing = 'exponential'",
            vec!["raycast_surface", "raycast_volume"],
        ),
        ("mode = 'sr'\nlayout = 'pair'", "ray.spread = 1", vec!["raycast_surface", "raycast_volume"]),
        ("mode = 'sr'\nlayout = 'pair'", "surface.start_depth = 9", vec!["raycast_surface", "raycast_volume"]),
        ("mode = 'sr'\nlayout = 'pair'", "surface.start_depth = 9\nvolume.start_depth = 9", vec![once]),
        ("mode = 'sr'\nsurface.colour = 'behind'", "", vec!["raycast_surface", "raycast_volume"]),
        ("mode = 'sr'", "", vec!["raycast_surface"]),
    ] {
        let of = |mode: &str| look(&geometry, mode, &format!("surface.threshold = 0.15\n{more}"), [30, 20]);
        let mut renderer = rendered(&device, of(mode), &body_frames(&of(mode), body));
        // A turned camera casts every ray again.
        let mut turned = of(mode);
        turned.settings.camera.azimuth = 20.0;
        renderer.change(Scene::new(turned.geometry, turned.input, turned.settings).expect("scene")).expect("change");
        assert_eq!(ray_casters(&mut renderer), expected, "{mode}, {more}");
    }
}

/// The march composites what volume rendering alone does at the detector's step, bit for bit.
#[test]
fn the_colours_of_whole_rays_are_those_of_volume_rendering() {
    let device = Device::new();
    for (g, (name, geometry)) in geometries().into_iter().enumerate() {
        // Every look in half of the geometries: those that the test above leaves out.
        for (_, settings) in LOOKS.into_iter().enumerate().filter(|(n, _)| (g + n) % 2 == 0) {
            let whole = |mode: &str, size| with_step_of_ring(look(&geometry, mode, settings, size));
            let scene = whole("mode = 'sr'\nlayout = 'pair'", [48, 21]);
            let frames = body_frames(&scene, body);
            let mut once = rendered(&device, scene, &frames);
            once.picture().expect("picture");
            let mut volume = rendered(&device, whole("mode = 'vr'\npost.antialias = false", [24, 21]), &frames);
            volume.picture().expect("picture");
            let layers = [values(&mut once, Slot::VolumeLayer), values(&mut volume, Slot::Picture)];
            assert!(same_values(&device, &layers[0], &layers[1], 2e-3), "{name}, {settings}");
        }
    }
}

/// Settings that cannot be shown are refused with the key and what to do.
#[test]
fn a_pair_is_refused_where_no_surface_is_found() {
    let refused = |toml: &str| {
        let settings = crate::common::scenes::settings(toml);
        Scene::new(Geometry::Sweep(wobbler()), BYTES, settings).expect_err("refused").to_string()
    };
    for mode in ["vr", "mixed", "mip", "plane", "cube"] {
        let error = refused(&format!("mode = '{mode}'\nlayout = 'pair'"));
        assert!(error.contains("layout") && error.contains("mode=surface"), "{error}");
    }
    let error = refused("layout = 'pair'\nsurface.colour = 'behind'\nvolume.compositing = 'exponential'");
    assert!(error.contains("surface.colour") && error.contains("volume.compositing=corrected"), "{error}");
}

/// Half resolution and several rays a pixel: each half is what its mode alone assembles.
#[test]
fn a_pair_is_assembled_from_several_rays_and_from_half_of_them() {
    let device = Device::new();
    let geometry = Geometry::Sweep(wobbler());
    for ray in ["ray.rays = 3", "ray.subsampling = 2", "ray.subsampling = 4"] {
        let settings = format!("{}\n{ray}", LOOKS[0]);
        let pair = look(&geometry, "mode = 'sr'\nlayout = 'pair'", &settings, [50, 23]);
        let frames = body_frames(&pair, body);
        let picture = rendered(&device, pair, &frames).picture().expect("picture");
        let surface = rendered(&device, look(&geometry, "mode = 'sr'", &settings, [25, 23]), &frames).picture();
        assert!(half(&picture, 25, 25) == surface.expect("picture").rgba, "{ray}: right half");
        let vr = with_step_of_ring(look(&geometry, "mode = 'vr'", &settings, [25, 23]));
        let volume = rendered(&device, vr, &frames).picture().expect("picture");
        assert!(half(&picture, 0, 25) == volume.rgba, "{ray}: left half");
    }
}
