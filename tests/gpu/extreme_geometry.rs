//! Extreme geometries, cameras and pictures, one test a case: drawn as by the f64 reference, or refused in one line that
//! names the fault.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};
use echolume::low_level::reference;
use echolume::low_level::scene::Scene;
use std::f64::consts::PI;

/// A speck of tissue in fluid, smooth over a few samples of any lattice: a function of the indices of the frame.
fn tissue(scene: &Scene) -> Vec<Texels> {
    let [samples, lines] = scene.frame_size().map(f64::from);
    frames(scene, |[i, j, k]| {
        let [u, v] = [i as f64 / samples, j as f64 / lines];
        0.5 + 0.3 * (7.0 * u).sin() * (5.0 * v + 0.4 * k as f64).cos()
    })
}

/// Draws a scene in volume mode and compares it with the f64 reference. Returns the share of lit pixels.
fn drawn_as_the_reference(device: &Device, name: &str, mut scene: Scene) -> f64 {
    scene.settings.post.floats = true;
    let frames = tissue(&scene);
    let mut renderer = rendered(device, scene.clone(), &frames);
    renderer.picture().expect("picture");
    let picture = renderer.read(Slot::Picture).expect("read").expect("there");
    let expected = &reference::render(&scene, &quantised(&scene, &frames))[&Slot::Picture];
    let off = |i: usize| (picture.values[i] - expected.values[i]).abs() > 0.02;
    let wrong = (0..picture.values.len()).filter(|i| off(*i)).count() as f64 / picture.values.len() as f64;
    assert!(picture.values.iter().all(|v| (0.0..=1.0).contains(v)), "{name}: a pixel leaves 0..1");
    // A ray along the border of the insonified region may count as inside or outside.
    assert!(wrong < 0.02, "{name}: {:.1} % of the picture are not the reference's", 100.0 * wrong);
    picture.values.chunks_exact(4).filter(|c| c[3] > 0.0).count() as f64 * 4.0 / picture.values.len() as f64
}

fn quantised(scene: &Scene, frames: &[Texels]) -> Vec<Texels> {
    let format = frame_format(scene);
    frames.iter().map(|f| Texels::decode(f.size, format, &f.encode(format))).collect()
}

/// The surface mode of the same: finite distances within the box, or misses.
fn surface_is_finite(device: &Device, name: &str, mut scene: Scene) {
    scene.settings.post.floats = true;
    let frames = tissue(&scene);
    let mut renderer = rendered(device, scene.clone(), &frames);
    renderer.picture().expect("picture");
    let distances = renderer.read(Slot::Distance).expect("read").expect("there");
    let corners = (scene.high - scene.low).length() + (scene.low + scene.high).length() + scene.rays.target.length();
    for (x, y) in (0..distances.size[1]).flat_map(|y| (0..distances.size[0]).map(move |x| (x, y))) {
        let d = distances.one(x, y, 0);
        let reach = corners + scene.rays.at(x as f64, y as f64).0.length();
        assert!(!is_hit(d) || (0.0..=reach).contains(&d), "{name}: a distance of {d} at {x}, {y}");
        assert!(d.is_finite(), "{name}: {d}");
    }
    for slot in [Slot::Picture, Slot::Surface] {
        let Some(texels) = renderer.read(slot).expect("read") else {
            assert!(slot == Slot::Surface && !renderer.scene().lights_by_echo(), "{name}: slot '{}'", slot.name());
            continue;
        };
        assert!(texels.values.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}: slot '{}'", slot.name());
    }
}

fn fan(ra: f64, rw: f64, d0: f64, sector: f64, sweep: f64) -> Probe {
    Probe {
        array: Array::Curved { radius: ra },
        lines: Axis::centred(sector / 31.0, 32),
        start_depth: d0,
        sample_pitch: 0.8,
        samples: 48,
        motion: Motion::Fan { wobble_radius: rw },
        slices: Axis::centred(sweep / 10.0, 11),
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

fn still(probe: Probe) -> Probe {
    Probe { motion: Motion::Still { thickness: 2.0 }, slices: Axis::centred(1.0, 1), ..probe }
}

fn translated(probe: Probe, pitch: f64) -> Probe {
    Probe { motion: Motion::Translated, slices: Axis::centred(pitch, 9), ..probe }
}

const OBLIQUE: &str = "picture = { size = [28, 24] }
    camera = { azimuth = 25, elevation = 35 }
    ray = { sampling = 'exact', early_end = 0.0 }
    slices = { pixels = 64, format = 'r32f' }
    volume = { transfer = [{ at = 0, colour = [0, 0, 0], opacity = 0.02 }, { at = 1, colour = [1, 0.8, 0.6], opacity = 0.1 }] }";

/// Row: Ra = 0, Rw = 0, single frame, T and F near 180 deg, 1:1000 anisotropy.
#[test]
fn probes_at_the_limits_of_what_is_built_are_drawn() {
    let device = Device::new();
    let linear = |pitch: f64, probe: Probe| Probe { array: Array::Linear, lines: Axis::centred(pitch, 24), ..probe };
    let wide = 179.8 / 180.0 * PI;
    let plain = fan(20.0, 12.0, 2.0, 1.1, 0.6);
    let two = Probe {
        slices: Axis::centred(0.3, 2),
        lines: Axis::centred(0.5, 2),
        samples: 2,
        sample_pitch: 20.0,
        ..plain.clone()
    };
    let geometries = [
        ("Ra = 0: a phased array at its apex", fan(0.0, 12.0, 0.0, 1.1, 0.6)),
        ("Rw = 0: the axis in the face", fan(20.0, 0.0, 10.0, 1.1, 0.6)),
        ("Ra = Rw = 0: everything turns about one point", fan(0.0, 0.0, 3.0, 1.1, 0.6)),
        ("Ra = Rw = 0 at a depth of almost 0", fan(0.0, 0.0, 1e-3, 1.1, 0.6)),
        ("T near 180 deg, still", still(fan(10.0, 0.0, 0.0, wide, 0.1))),
        ("T near 180 deg, translated", translated(fan(10.0, 0.0, 0.0, wide, 0.1), 2.0)),
        ("T near 180 deg, fan about the apex", fan(10.0, 10.0, 0.0, wide, 0.5)),
        ("T = 180 deg, translated", translated(fan(10.0, 0.0, 0.0, PI, 0.1), 2.0)),
        ("T = 200 deg, still", still(fan(10.0, 0.0, 2.0, 3.5, 0.1))),
        ("T = 290 deg, translated", translated(fan(6.0, 0.0, 1.0, 5.06, 0.1), 2.0)),
        ("T of a circle but for a line", translated(fan(6.0, 0.0, 1.0, 2.0 * PI * 31.0 / 32.0, 0.1), 2.0)),
        ("T = 240 deg, fan about an axis behind the apex", fan(10.0, 30.0, 0.5, 4.2, 0.5)),
        ("T = 240 deg to one side", {
            let lines = Axis::Even { first: -1.0, pitch: 0.13, count: 32 };
            translated(Probe { lines, ..fan(6.0, 0.0, 1.0, 1.0, 0.1) }, 2.0)
        }),
        ("F near 180 deg", fan(20.0, 12.0, 2.0, 1.1, wide)),
        ("T and F near 180 deg", fan(10.0, 10.0, 0.5, wide, wide)),
        ("Ra = 10 m: f32 places are off by 0.5 um", fan(1e4, 12.0, 2.0, 6e-3, 0.6)),
        ("Ra = 100 m: f32 places are off by 4 um", fan(1e5, 12.0, 2.0, 6e-4, 0.6)),
        ("single frame", still(plain.clone())),
        ("two of everything", two),
        (
            "samples a thousandth of the lines' pitch",
            linear(10.0, translated(Probe { sample_pitch: 0.01, ..plain.clone() }, 10.0)),
        ),
        (
            "lines a thousandth of the samples' pitch",
            linear(0.01, translated(Probe { sample_pitch: 10.0, ..plain.clone() }, 10.0)),
        ),
        ("frames a thousandth of the lines' pitch", linear(1.0, translated(plain.clone(), 0.001))),
    ];
    for (name, probe) in geometries {
        let scene = |mode: &str| {
            Scene::new(Geometry::Sweep(probe.clone()), BYTES, settings(&format!("mode = '{mode}'\n{OBLIQUE}")))
                .unwrap_or_else(|e| panic!("{name}: {e}"))
        };
        let seen = drawn_as_the_reference(&device, name, scene("vr"));
        assert!(seen > 0.01, "{name}: {seen} of the picture show something");
        surface_is_finite(&device, name, scene("sr"));
    }
    for spacing in [[1.0, 1000.0, 1.0], [1000.0, 1.0, 1.0], [1.0, 1.0, 1000.0], [1e-3, 1.0, 1.0]] {
        let grid = Geometry::Cartesian(Grid { size: [12, 10, 9], spacing, origin: [0.0; 3] });
        // Near enough that a pixel is narrower than the needle.
        let near = OBLIQUE.replace("elevation = 35", "elevation = 35, zoom = 100");
        let scene = |mode: &str| scene(grid.clone(), BYTES, &format!("mode = '{mode}'\n{near}"));
        let seen = drawn_as_the_reference(&device, "anisotropic voxels", scene("vr"));
        assert!(seen > 0.01, "{spacing:?}: {seen}");
        surface_is_finite(&device, "anisotropic voxels", scene("sr"));
    }
}

/// Row: single line, F = 0, and geometries without a picture: a clear error at load.
#[test]
fn probes_without_a_valid_geometry_are_refused_by_name() {
    let plain = fan(20.0, 12.0, 2.0, 1.1, 0.6);
    let cases = [
        ("single line", Probe { lines: Axis::centred(0.1, 1), ..plain.clone() }, "scan lines", "at least 2"),
        ("no line", Probe { lines: Axis::centred(0.1, 0), ..plain.clone() }, "scan lines", "at least 2"),
        ("single sample", Probe { samples: 1, ..plain.clone() }, "samples", "at least 2"),
        ("single frame of a fan", Probe { slices: Axis::centred(0.1, 1), ..plain.clone() }, "frames", "still"),
        ("F = 0", fan(20.0, 12.0, 2.0, 1.1, 0.0), "frames", "rise"),
        ("T = 0", fan(20.0, 12.0, 2.0, 0.0, 0.5), "scan lines", "rise"),
        ("T = 360 deg", fan(20.0, 20.0, 2.0, 2.0 * PI, 0.5), "sector angle", "under 180"),
        ("F = 180 deg", fan(20.0, 12.0, 2.0, 1.0, PI), "fan angle", "under 90"),
        (
            "all of the sector lies before the axis",
            Probe { lines: Axis::Even { first: 1.5, pitch: 0.001, count: 9 }, ..fan(20.0, 0.0, 2.0, 1.1, 0.6) },
            "wobble radius",
            "beyond the axis",
        ),
        ("no sample pitch", Probe { sample_pitch: 0.0, ..plain.clone() }, "sample pitch", "1e-6"),
        ("no number", Probe { start_depth: f64::NAN, ..plain.clone() }, "start depth", "must lie"),
        ("a radius of a kilometre and more", fan(1.1e6, 12.0, 2.0, 1.1, 0.6), "array radius", "must lie"),
    ];
    for (name, probe, field, fault) in cases {
        let refused = Scene::new(Geometry::Sweep(probe), BYTES, settings("")).expect_err(name).to_string();
        assert!(refused.contains(field) && refused.contains(fault), "{name}: {refused}");
        assert_eq!(refused.lines().count(), 1, "{name}");
    }
    // A millionth: a step that is set and makes more steps than a ray may have is refused by its name; one that nobody set is lengthened.
    let grid = Geometry::Cartesian(Grid { size: [64, 64, 64], spacing: [1e-4, 1.0, 1.0], origin: [0.0; 3] });
    let refused = Scene::new(grid.clone(), BYTES, settings("[ray]\nstep = 5e-5")).expect_err("steps").to_string();
    assert!(refused.contains("ray.step") && refused.contains("65536"), "{refused}");
    let lengthened = Scene::new(grid, BYTES, settings("")).expect("a default is no reason to refuse");
    assert!(lengthened.found.iter().any(|line| line.contains("ray.step")), "{:?}", lengthened.found);
}

/// Row: a part of the sector before the wobble axis, which is cut, and a phased array whose lines meet at its face.
#[test]
fn a_sector_that_folds_about_its_axis_is_drawn_beyond_it() {
    let device = Device::new();
    for (name, probe) in [
        ("endocavitary", fan(10.5, 6.0, 0.5, 146f64.to_radians(), 0.9)),
        ("the axis at the face", fan(20.0, 0.0, 2.0, 1.1, 0.6)),
        ("phased", fan(0.0, 0.0, 0.0, 1.1, 0.6)),
        ("phased, behind its axis", fan(0.0, 5.0, 0.0, 1.3, 0.6)),
        ("phased, a single frame", still(fan(0.0, 0.0, 0.0, 1.4, 0.1))),
        ("phased, translated", translated(fan(0.0, 0.0, 0.0, 1.4, 0.1), 2.0)),
        ("phased and radial", translated(fan(0.0, 0.0, 0.0, 4.6, 0.1), 2.0)),
        ("endocavitary and radial", fan(10.5, 6.0, 0.5, 3.9, 0.9)),
    ] {
        let of = |mode: &str| scene(Geometry::Sweep(probe.clone()), BYTES, &format!("mode = '{mode}'\n{OBLIQUE}"));
        let seen = drawn_as_the_reference(&device, name, of("vr"));
        assert!(seen > 0.01, "{name}: {seen} of the picture show something");
        surface_is_finite(&device, name, of("sr"));
    }
}

/// Row: camera inside the volume, ray parallel to a face or to the slices.
#[test]
fn cameras_inside_and_rays_along_faces_see_what_the_reference_sees() {
    let device = Device::new();
    let cameras = [
        ("inside, wide", "camera = { field_of_view = 120, zoom = 30, target = [1.0, 18.0, 2.0] }"),
        ("inside, at the target itself", "camera = { field_of_view = 60, zoom = 1000 }"),
        ("along the lines' plane", "camera = { elevation = 90 }"),
        ("along the slices", "camera = { azimuth = 90 }"),
        ("against the depth", "camera = { azimuth = 180 }"),
        ("upside down, along a face", "camera = { elevation = -90, roll = 180 }"),
        ("in the plane of the first slice", "camera = { azimuth = 90, target = [0.0, 20.0, 0.0] }"),
    ];
    let sweep = Geometry::Sweep(fan(20.0, 12.0, 2.0, 1.1, 0.6));
    let straight = Geometry::Sweep(Probe { motion: Motion::Translated, slices: Axis::centred(1.5, 9), ..linear() });
    for (body, geometry) in [("fan", &sweep), ("box of lines", &straight), ("Cartesian", &cartesian([40, 50, 20]))] {
        for (camera, toml) in cameras {
            let name = format!("{body}, {camera}");
            let scene = |mode: &str| {
                let rest: Vec<&str> = OBLIQUE.lines().filter(|l| !l.trim().starts_with("camera")).collect();
                scene(geometry.clone(), BYTES, &format!("mode = '{mode}'\n{toml}\n{}", rest.join("\n")))
            };
            let seen = drawn_as_the_reference(&device, &name, scene("vr"));
            assert!(seen > 0.01, "{name}: {seen} of the picture show something");
            surface_is_finite(&device, &name, scene("sr"));
        }
    }
}

/// A ray within a face of the box, and one next to it: Beer's law inside, nothing outside, no NaN.
#[test]
fn a_ray_within_a_face_gives_no_nan() {
    let device = Device::new();
    let block = Geometry::Cartesian(Grid { size: [20, 20, 20], spacing: [1.0; 3], origin: [0.5; 3] });
    // 40 pixels of 0.5 mm over 20 mm, shifted by half a pixel: some rays run exactly in the faces x = 0 and x = 20.
    for shift in [0.0, 0.25, 0.5] {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [80, 80] }}\ncamera = {{ zoom = 0.5, target = [{}, 10.0, {}] }}\n\
             ray = {{ step = 1.0, early_end = 0.0 }}\nvolume = {{ transfer = [{{ at = 0, colour = [1, 1, 1], opacity = 0.1 }}] }}",
            10.0 + shift,
            10.0 + shift
        );
        let scene = scene(block.clone(), BYTES, &toml);
        let mut renderer = rendered(&device, scene.clone(), &frames(&scene, |_| 1.0));
        renderer.picture().expect("picture");
        let picture = renderer.read(Slot::Picture).expect("read").expect("there");
        let full = 1.0 - 0.9f64.powi(20);
        for (x, y) in (0..80).flat_map(|y| (0..80).map(move |x| (x, y))) {
            let (origin, _) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let inside = [origin.x, origin.z]
                .map(|v| if (v - 10.0).abs() < 9.99 { 1 } else { -i32::from((v - 10.0).abs() > 10.01) });
            let got = picture.get([x, y, 0])[3];
            match inside.iter().min() {
                Some(1) => assert!((got - full).abs() < 2e-3, "{got} for {full} at {x}, {y}"),
                Some(-1) => assert_eq!(got, 0.0, "outside at {x}, {y}"),
                _ => assert!(got == 0.0 || (got - full).abs() < 2e-3, "{got} on a face at {x}, {y}"),
            }
        }
    }
}

/// Row: zero-area region.
#[test]
fn a_region_without_extent_is_refused_by_name() {
    for (toml, field, fault) in [
        ("region = { lateral = [3.0, 3.0] }", "region.lateral", "rise"),
        ("region = { depth = [9.0, 4.0] }", "region.depth", "rise"),
        ("region = { elevation = [0.0, nan] }", "region.elevation", "finite"),
        ("region = { depth = [500.0, 501.0] }", "region.depth", "misses the volume"),
        ("surface = { start_depth = 400.0 }", "surface.start_depth", "leaves nothing"),
    ] {
        let refused = Scene::new(Geometry::Sweep(wobbler()), BYTES, settings(toml)).expect_err(toml).to_string();
        assert!(refused.contains(field) && refused.contains(fault), "{toml}: {refused}");
    }
    // The thinnest that has one is drawn.
    let device = Device::new();
    let thin = "region = { lateral = [3.0, 3.0001], depth = [20.0, 20.001] }";
    let toml = format!("mode = 'vr'\n{thin}\n{OBLIQUE}").replace("0.02 }", "0.5 }");
    drawn_as_the_reference(&device, "a thread", scene(Geometry::Sweep(wobbler()), BYTES, &toml));
}

/// Row: 1x1 and 16k pictures.
#[test]
fn pictures_of_one_pixel_and_of_16384_by_one_are_drawn_and_larger_ones_refused() {
    let device = Device::new();
    for (size, zoom, least) in [([1, 1], 1.0, 0.9), ([16384, 1], 1000.0, 0.02), ([1, 16384], 1000.0, 0.02)] {
        let toml = format!("mode = 'vr'\n{OBLIQUE}")
            .replace("[28, 24]", &format!("{size:?}"))
            .replace("azimuth = 25, elevation = 35", &format!("zoom = {zoom}"));
        let volume = scene(Geometry::Sweep(wobbler()), BYTES, &toml);
        let seen = drawn_as_the_reference(&device, &format!("{size:?}"), volume);
        assert!(seen > least, "{size:?}: {seen} of the picture show something");
        surface_is_finite(
            &device,
            &format!("{size:?}"),
            scene(Geometry::Sweep(wobbler()), BYTES, &toml.replace("'vr'", "'sr'")),
        );
    }
    // As a plan only: it is not allocated.
    let largest = scene(Geometry::Sweep(wobbler()), BYTES, "mode = 'vr'\npicture = { size = [16384, 16384] }");
    let plan = Plan::new(&largest);
    assert_eq!(Slot::Picture.bytes(&largest), 16384 * 16384 * 8);
    assert!(plan.bytes(&largest) >= 3 << 30, "{}", plan.bytes(&largest));
    let limits = device.candidate.limits;
    if limits.max_image_dimension2_d < 16384 || device.candidate.max_allocation < Slot::Picture.bytes(&largest) {
        let refused = Renderer::new(&device, largest, &RendererOptions::default()).err().expect("no room").to_string();
        assert!(refused.contains("image '") && refused.contains("the device allows"), "{refused}");
    }
    for size in ["[16385, 1]", "[1, 16385]", "[0, 5]"] {
        let refused =
            Scene::new(Geometry::Sweep(wobbler()), BYTES, settings(&format!("picture = {{ size = {size} }}")));
        let refused = refused.expect_err(size).to_string();
        assert!(refused.contains("picture.size") && refused.contains("1..=16384"), "{refused}");
    }
}
