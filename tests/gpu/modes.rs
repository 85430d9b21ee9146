//! For every mode: its passes and slots, reruns after a change (counted from recorded dispatches), and the
//! incremental update of the volume by slices.

use crate::common::gpu::*;
use echolume::low_level::passes::filter::gaussian;
use echolume::low_level::passes::{Slot, in_runs_of};
use echolume::low_level::plan::{Plan, affected};
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::Scene;

fn of(toml: &str) -> Scene {
    let slices = if toml.contains("slices") { "" } else { "slices = { pixels = 40 }" };
    let mut scene =
        scene(Geometry::Sweep(wobbler()), BYTES, &format!("{toml}\npicture = {{ size = [24, 24] }}\n{slices}"));
    // So small a picture would not be worth its bricks.
    scene.settings.ray.brick = Some(8);
    scene
}

/// A mode with its settings, its passes, its slots.
const MODES: &[(&str, &str, &str)] = &[
    (
        "mode = 'vr'",
        "scan_convert tile_ranges brick_ranges classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume tone",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy volume_brick_distances opaque_before transfer picture screen",
    ),
    (
        "mode = 'vr'\nvolume = { compositing = 'pre-integrated', shading = 'depth-coded' }",
        "scan_convert tile_ranges brick_ranges classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume tone",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy volume_brick_distances opaque_before pre_integrated picture screen",
    ),
    (
        "mode = 'vr'\nvolume = { shading = 'first-hit' }",
        "scan_convert tile_ranges brick_ranges classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy volume_brick_distances opaque_before transfer distance_map volume_layer rendered screen",
    ),
    (
        "mode = 'sr'",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface raycast_surface light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances distance_map rendered screen",
    ),
    (
        "mode = 'sr'\nsurface = { colour = 'rendered' }",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface raycast_surface classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances volume_brick_distances opaque_before transfer distance_map volume_layer rendered screen",
    ),
    (
        "mode = 'sr'\nsurface = { colour = 'rendered' }\nray = { sliding = 3 }",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_surface_and_volume light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances volume_brick_distances opaque_before transfer distance_map volume_layer rendered screen",
    ),
    (
        "mode = 'mixed'",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface raycast_surface classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_volume light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances volume_brick_distances opaque_before transfer distance_map volume_layer rendered screen",
    ),
    (
        "mode = 'mip'",
        "scan_convert tile_ranges brick_ranges raycast_projection tone",
        "frames scan_lut volume tile_ranges brick_table brick_ranges picture screen",
    ),
    (
        "mode = 'minip'",
        "scan_convert tile_ranges brick_ranges raycast_projection tone",
        "frames scan_lut volume tile_ranges brick_table brick_ranges picture screen",
    ),
    (
        "mode = 'mean'",
        "scan_convert tile_ranges brick_ranges classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_projection tone",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy volume_brick_distances picture screen",
    ),
    (
        "mode = 'mip'\nray = { rays = 2 }",
        "scan_convert tile_ranges brick_ranges raycast_projection assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges rendered screen",
    ),
    ("mode = 'plane'", "scan_convert raycast_planes_toned", "frames scan_lut volume tiles screen"),
    (
        "mode = 'orthogonal'\npost = { floats = true }",
        "scan_convert raycast_planes tone",
        "frames scan_lut volume tiles picture screen",
    ),
    (
        "mode = 'tomography'\npost = { sigma = {} }",
        "scan_convert raycast_planes sigma_picture tone",
        "frames scan_lut volume tiles picture smooth_picture screen",
    ),
    ("mode = 'cube'", "scan_convert raycast_cube tone", "frames scan_lut volume block picture screen"),
    (
        "mode = 'sr'\nlayout = '4up'",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface raycast_surface raycast_planes light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances tiles distance_map rendered planes screen",
    ),
    (
        "mode = 'sr'\nlayout = 'beside'\npost.floats = true",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface raycast_surface raycast_planes light assemble tone",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances tiles distance_map rendered planes picture screen",
    ),
    (
        "mode = 'sr'\nlayout = 'pair'",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_surface_and_volume light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances volume_brick_distances opaque_before transfer distance_map volume_layer rendered screen",
    ),
    (
        "mode = 'sr'\nlayout = 'pair'\nsurface = { colour = 'behind' }",
        "scan_convert tile_ranges brick_ranges classify_bricks_surface brick_distance_surface brick_distance_surface brick_distance_surface classify_bricks_volume brick_distance_volume brick_distance_volume brick_distance_volume raycast_surface_and_volume raycast_volume light assemble_toned",
        "frames scan_lut volume tile_ranges brick_table brick_ranges brick_kinds brick_distances_x brick_distances_xy surface_brick_distances volume_brick_distances opaque_before transfer distance_map volume_layer volume_beside_surface rendered screen",
    ),
];

#[test]
fn every_mode_has_its_passes_and_slots_and_no_others() {
    for (mode, passes, slots) in MODES {
        let plan = Plan::new(&of(mode));
        let names: Vec<_> = plan.steps.iter().map(|s| s.pass.name).collect();
        assert_eq!(names.join(" "), *passes, "{mode}");
        let names: Vec<_> = plan.slots.iter().map(|s| s.name()).collect();
        assert_eq!(names.join(" "), *slots, "{mode}");
    }
}

type Change = fn(&mut Scene);

/// The effect of a change: the passes from which on all readers run again.
#[test]
fn in_every_mode_a_change_reruns_only_the_affected_passes() {
    let device = Device::new();
    for (mode, passes, _) in MODES {
        let base = of(mode);
        let frames = body_frames(&base, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
        let mut renderer = rendered(&device, base.clone(), &frames);
        renderer.picture().expect("picture");
        let all: Vec<&str> = passes.split(' ').collect();
        let from = |first: &[&str]| -> Vec<&str> {
            all.iter().position(|p| first.contains(p)).map_or(Vec::new(), |i| all[i..].to_vec())
        };
        // Planes and bricks do not depend on the camera.
        let aside = [
            "raycast_planes",
            "tile_ranges",
            "brick_ranges",
            "classify_bricks_surface",
            "brick_distance_surface",
            "classify_bricks_volume",
            "brick_distance_volume",
        ];
        let moved = |p: &&str| !aside.contains(p);
        let seen_from_elsewhere = match base.is_flat() {
            true => Vec::new(),
            false => all[1..].iter().copied().filter(moved).collect(),
        };
        let changes: [(&str, Change, Vec<&str>); 5] = [
            ("camera", |s| s.settings.camera.azimuth = 20.0, seen_from_elsewhere),
            (
                "transfer function",
                |s| {
                    s.settings.volume.transfer =
                        echolume::low_level::scene::Transfer::Named(echolume::low_level::scene::TransferName::Warm)
                },
                if base.composites() { from(&["classify_bricks_volume"]) } else { vec![] },
            ),
            ("light", |s| s.settings.light.ambient = 0.4, from(&["light"])),
            ("contrast", |s| s.settings.post.contrast = 1.5, vec![all[all.len() - 1]]),
            ("what the mode does not use", |s| s.settings.light.occlusion = None, vec![]),
        ];
        for (what, change, expected) in changes {
            let back = renderer.scene().clone();
            let mut settings = back.clone();
            change(&mut settings);
            let scene = Scene::new(settings.geometry, settings.input, settings.settings).expect("scene");
            let names = renderer.dispatched_passes(|r| r.change(scene).and_then(|_| r.picture())).expect("picture");
            assert_eq!(names, expected, "{mode}: {what}");
            renderer.change(base.clone()).expect("change");
            renderer.picture().expect("picture");
        }
        let frame = vec![0u8; renderer.frame_bytes()];
        let names = renderer.dispatched_passes(|r| r.frame(3, &frame, 0)).expect("frame");
        assert_eq!(names, ["scan_convert"], "{mode}: one frame");
        let names = renderer.dispatched_passes(|r| r.show(0).and_then(|_| r.picture())).expect("picture");
        assert_eq!(names, all[1..], "{mode}: its volume");
    }
}

fn smoothed() -> Scene {
    of("mode = 'mip'\nslices = { pixels = 40, smooth = { lateral = 1.0, elevation = 0.3 } }")
}

/// The 3D filter is updated by slices: a new frame refilters only the slices near it, and the result equals
/// that of filtering the complete volume.
#[test]
fn a_new_frame_refilters_only_the_slices_near_it() {
    let device = Device::new();
    let size = smoothed().grid.size;
    let first = body_frames(&smoothed(), |p| if p.y > 40.0 { 0.9 } else { 0.1 });
    let second = body_frames(&smoothed(), |p| if p.y > 45.0 { 0.8 } else { 0.2 });
    for slices in [vec![0], vec![4], vec![2, 3], vec![0, 8], vec![1, 7, 4]] {
        let mut frames = first.clone();
        let mut renderer = rendered(&device, smoothed(), &frames);
        renderer.picture().expect("picture");
        let format = Slot::Frames.format(&smoothed());
        for slice in &slices {
            frames[*slice] = second[*slice].clone();
            renderer.frame(*slice as u32, &frames[*slice].encode(format), 0).expect("frame");
        }
        renderer.show(0).expect("show");
        let recorded = renderer.dispatch_extents(|r| r.picture()).expect("picture");
        let reach = Plan::new(&smoothed()).steps.iter().map(|s| s.reach(&smoothed())).max().expect("steps");
        let mut changed = vec![false; frames.len()];
        slices.iter().for_each(|s| changed[*s] = true);
        let expected: Vec<_> = affected(&changed, reach)
            .iter()
            .map(|run| ("gaussian_elevation", in_runs_of(gaussian::RUN, [size[0], size[1], run.end - run.start], 2)))
            .collect();
        let got: Vec<_> = recorded.into_iter().filter(|(name, _)| *name == "gaussian_elevation").collect();
        assert_eq!(got, expected, "{slices:?}");
        let volume = renderer.read(Slot::Volume).expect("read").expect("there");
        let mut fresh = rendered(&device, smoothed(), &frames);
        fresh.picture().expect("picture");
        assert!(fresh.read(Slot::Volume).expect("read").expect("there") == volume, "{slices:?}");
        // No new frame: nothing to filter.
        renderer.show(0).expect("show");
        let names = renderer.dispatched_passes(|r| r.picture()).expect("picture");
        assert!(!names.contains(&"gaussian_elevation"), "{names:?}");
    }
}
