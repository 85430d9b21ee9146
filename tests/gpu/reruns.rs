//! Reruns after a change, counted from recorded dispatches; and omitted barriers, detected by validation.

use crate::common::gpu::*;
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::{PASSES, Stage};
use echolume::low_level::plan::{Plan, Rerun};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Scene, Settings};

const SETTINGS: &str = "mode = 'sr'
    picture = { size = [24, 24] }
    slices = { pixels = 40, median = true, smooth = { lateral = 1.0, depth = 1.0, elevation = 0.7 } }
    distance = { median = 3, bilateral = { pixels = 1.0, distance = 2.0 } }
    post = { sigma = { window = 3, sigma = 0.1 } }";

fn with(more: &str) -> Scene {
    scene(Geometry::Sweep(wobbler()), BYTES, &format!("{SETTINGS}\n{more}"))
}

fn drawn(device: &Device) -> Renderer {
    let scene = with("");
    let frames = body_frames(&scene, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
    let mut renderer = rendered(device, scene, &frames);
    renderer.picture().expect("picture");
    renderer
}

#[test]
fn a_change_reruns_only_the_affected_passes() {
    let device = Device::alone();
    let mut renderer = drawn(&device);
    let picture = renderer.picture().expect("picture");
    assert_eq!(renderer.dispatched_passes(|r| r.picture()).unwrap(), [""; 0], "nothing changed, nothing runs");

    let stages = |names: &[&str]| -> Vec<Stage> {
        let mut stages: Vec<_> = PASSES.iter().filter(|p| names.contains(&p.name)).map(|p| p.stage).collect();
        stages.dedup();
        stages
    };
    let cases: [(&str, &[Stage]); 5] = [
        ("camera = { azimuth = 10 }", &[Stage::Raycast, Stage::Shade, Stage::Postprocess]),
        ("surface = { threshold = 0.2 }", &[Stage::Raycast, Stage::Shade, Stage::Postprocess]),
        ("light = { direction = [1.0, 0.0, 0.5] }", &[Stage::Shade, Stage::Postprocess]),
        ("", &[Stage::Shade, Stage::Postprocess]),
        ("", &[]),
    ];
    renderer.change(with("camera = { azimuth = 10 }")).expect("change");
    renderer.change(with("")).expect("change");
    renderer.picture().expect("picture");
    for (i, (change, expected)) in cases.iter().enumerate() {
        // The light case starts from the plain scene, so that only the light differs.
        if i == 2 {
            renderer.change(with("")).expect("change");
            renderer.picture().expect("picture");
        }
        let names = renderer
            .dispatched_passes(|r| {
                r.change(with(change))?;
                r.picture()
            })
            .expect("picture");
        assert_eq!(stages(&names), *expected, "{change}: {names:?}");
        if *expected == [Stage::Shade, Stage::Postprocess] {
            assert_eq!(names[0], "light", "filters of the distance map need not run for a light");
        }
    }
    assert_eq!(renderer.picture().expect("picture"), picture, "back where it was");

    let tone = SETTINGS.replace("window = 3, sigma = 0.1 }", "window = 3, sigma = 0.1 }, gamma = 2.0");
    let scene = scene(Geometry::Sweep(wobbler()), BYTES, &tone);
    let names = renderer.dispatched_passes(|r| r.change(scene).and_then(|_| r.picture())).expect("picture");
    assert_eq!(names, ["tone"]);
}

/// Prevents a turntable that sends its volume again for every picture.
#[test]
fn a_turn_casts_rays_of_one_volume_only() {
    let device = Device::alone();
    let mut renderer = drawn(&device);
    let scene = renderer.scene().clone();
    for camera in scene.turntable(5).expect("cameras").into_iter().skip(1) {
        let settings = Settings { camera, ..scene.settings.clone() };
        let turned = Scene::new(scene.geometry.clone(), scene.input, settings).expect("a scene");
        let names = renderer
            .dispatched_passes(|r| {
                let rerun = r.change(turned)?;
                assert!(matches!(rerun, Rerun::Steps { .. }), "frames are sent again: {rerun:?}");
                r.picture()
            })
            .expect("picture");
        let stages: Vec<_> = PASSES.iter().filter(|p| names.contains(&p.name)).map(|p| p.stage).collect();
        assert!(stages.contains(&Stage::Raycast) && !stages.contains(&Stage::Preprocess), "{names:?}");
    }
}

#[test]
fn a_filter_switched_on_keeps_the_volume_and_a_frame_goes_through_stage_one_alone() {
    let device = Device::alone();
    let mut renderer = drawn(&device);
    let plain = SETTINGS.replace("median = 3, bilateral = { pixels = 1.0, distance = 2.0 }", "");
    let unfiltered = scene(Geometry::Sweep(wobbler()), BYTES, &plain);
    let names =
        renderer.dispatched_passes(|r| r.change(unfiltered.clone()).and_then(|_| r.picture())).expect("picture");
    assert_eq!(names, ["light", "assemble", "sigma_picture", "tone"]);
    let names = renderer.dispatched_passes(|r| r.change(with("")).and_then(|_| r.picture())).expect("picture");
    assert_eq!(names, ["median_distance", "bilateral_distance", "light", "assemble", "sigma_picture", "tone"]);

    let frame = vec![0u8; renderer.frame_bytes()];
    let names = renderer.dispatched_passes(|r| r.frame(3, &frame, 0)).expect("frame");
    assert_eq!(names, ["scan_convert", "median_slice", "gaussian_lateral", "gaussian_depth"]);

    let sharper =
        SETTINGS.replace("median = true, smooth = { lateral = 1.0", "median = true, smooth = { lateral = 1.2");
    let sharper = scene(Geometry::Sweep(wobbler()), BYTES, &sharper);
    let plan = Plan::new(&sharper);
    assert_eq!(plan.rerun(&with(""), &sharper), Rerun::Frames);
}

#[test]
fn a_scene_has_the_passes_and_slots_it_needs_and_no_others() {
    let names = |toml: &str| {
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
        let plan = Plan::new(&scene);
        let passes: Vec<_> = plan.steps.iter().map(|s| s.pass.name).collect();
        let slots: Vec<_> = plan.slots.iter().map(|s| s.name()).collect();
        (passes.join(" "), slots.join(" "))
    };
    let (passes, slots) = names("mode = 'vr'");
    assert_eq!(
        passes,
        "scan_convert tile_ranges brick_ranges classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume tone"
    );
    assert_eq!(
        slots,
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy volume_brick_distances opaque_before transfer picture screen"
    );
    let (passes, slots) = names("mode = 'sr'\ndistance = { bilateral = { pixels = 1.0, distance = 1.0, repeat = 3 } }");
    assert_eq!(
        passes,
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface raycast_surface bilateral_distance bilateral_distance bilateral_distance light assemble_toned"
    );
    assert_eq!(
        slots,
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances distance_map distance_a distance_b rendered screen"
    );
    // Texture and translucent skin take the echo at the surface, and nothing else does.
    for (light, is_read) in [
        ("texture = 0.5", true),
        ("skin = {}", true),
        ("skin = { translucency = 0.0 }", false),
        ("shadow = {}, occlusion = {}", false),
    ] {
        for mode in ["sr", "mixed"] {
            let (_, slots) = names(&format!("mode = '{mode}'\nlight = {{ {light} }}"));
            assert_eq!(slots.split(' ').any(|s| s == "surface"), is_read, "{mode}, {light}");
        }
    }
    let (passes, slots) = names("mode = 'vr'\nslices = { sigma = { window = 5, sigma = 0.0 } }");
    assert_eq!(
        passes,
        "scan_convert tile_ranges brick_ranges classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume tone",
        "a sigma of 0 changes nothing"
    );
    assert!(!slots.contains("slice_a"));
}

/// Filters of a chain alternate between two slots, so a filter that runs again may find its input overwritten by a later one.
/// After any change the picture equals that of a new renderer for the new scene.
#[test]
fn any_change_gives_the_picture_of_a_fresh_renderer() {
    let device = Device::alone();
    let medians = ["median = 3, ", "median = 5, ", ""];
    let bilaterals = [
        "",
        "bilateral = { pixels = 1.0, distance = 2.0, repeat = 2 }, ",
        "bilateral = { pixels = 1.0, distance = 0.5, repeat = 3 }, ",
    ];
    let sigmas = [
        "",
        "sigma = { window = 3, sigma = 0.5 }",
        "sigma = { window = 5, sigma = 0.2 }",
        "enhanced_sigma = { window = 3, largest = 5, sigma = 0.2 }, perona_malik = { edge = 0.5, repeat = 2 }",
        "perona_malik = { edge = 0.5, repeat = 3 }",
    ];
    let lights = ["", "light = { direction = [1.0, 0.0, 0.4], shadow = {} }", "light = { occlusion = {}, skin = {} }"];
    let posts = [
        "",
        "post = { sigma = { window = 3, sigma = 0.2 } }",
        "post = { gamma = 2.0, sigma = { window = 3, sigma = 0.2 }, enhanced_sigma = { window = 3, largest = 7, sigma = 0.1 } }",
        "post = { perona_malik = { repeat = 2 } }",
        "post = { perona_malik = { scheme = 'aos', step = 2.0, repeat = 2 } }",
        "post = { sigma = { window = 3, sigma = 0.2 }, perona_malik = { scheme = 'aos', step = 4.0, repeat = 1 } }",
    ];
    let modes = ["sr", "sr", "sr", "vr"];
    let mut noise = Noise(3);
    let mut pick = |n: usize| (noise.next() * n as f64) as usize;
    let mut next = || {
        let toml = format!(
            "mode = '{}'\npicture = {{ size = [24, 20] }}\nslices = {{ pixels = 32 }}\ndistance = {{ {}{}{} }}\n{}\n{}",
            modes[pick(4)],
            medians[pick(3)],
            bilaterals[pick(3)],
            sigmas[pick(5)],
            lights[pick(3)],
            posts[pick(6)]
        );
        scene(Geometry::Sweep(wobbler()), BYTES, &toml.replace(", }", " }"))
    };
    let first = next();
    let frames =
        body_frames(&first, |p| (0.5 + 0.4 * (p.y - 45.0 + 3.0 * (p.x * 0.7).sin()).clamp(-1.0, 1.0)).clamp(0.0, 1.0));
    let mut renderer = rendered(&device, first, &frames);
    for round in 0..60 {
        let scene = next();
        // Sometimes two changes before a picture.
        if round % 3 == 0 {
            renderer.change(next()).expect("change");
        }
        let rerun = renderer.change(scene.clone()).expect("change");
        assert!(matches!(rerun, Rerun::Steps { .. }), "the volume stays: {rerun:?}");
        let picture = renderer.picture().expect("picture");
        let fresh = rendered(&device, scene.clone(), &frames).picture().expect("picture");
        assert!(picture == fresh, "round {round}: {:?}", scene.settings);
    }
}

/// The layer detects a missing barrier between a writer and a reader; one between two writers is left to the oracle.
#[test]
fn synchronization_validation_reports_a_dropped_barrier() {
    // Frames one by one take more barriers than batches do.
    let barriers_without = |device: &Device, dropped: Option<u32>| {
        let scene = with("");
        let frames = body_frames(&scene, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
        let mut renderer = Renderer::new(device, scene, &Default::default()).expect("renderer");
        dropped.iter().for_each(|n| renderer.drop_barrier(*n));
        for (k, frame) in frames.iter().enumerate() {
            renderer.frame(k as u32, &frame.encode(frame_format(renderer.scene())), 0).expect("frame");
            renderer.submit_frames().expect("submitted");
        }
        renderer.show(0).expect("show");
        renderer.picture().expect("picture");
        renderer.barriers()
    };
    let recorded = barriers_without(&Device::alone(), None);
    assert!(recorded > 20, "{recorded}");
    let mut seen = 0;
    let tried = recorded.min(60);
    for n in 1..=tried {
        let mut device = Device::alone();
        device.provoked = true;
        barriers_without(&device, Some(n));
        let messages = device.messages();
        assert!(messages.iter().all(|m| m.contains("SYNC-HAZARD")), "{messages:?}");
        seen += u32::from(!messages.is_empty());
    }
    println!("{seen} of {tried} dropped barriers were seen");
    assert!(seen * 2 > tried, "only {seen} of {tried} were seen");
}
