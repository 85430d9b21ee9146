//! Pictures of several planes: lines, tiles, passes that run for them and run again, and refused settings.

use crate::common::gpu::*;
use crate::common::scenes::settings;
use crate::planes::picture;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{PlaneName, Scene, SceneError};
use glam::DVec3;

/// A black volume shows only lines: their centre of light along a row or column is the position of the other plane.
#[test]
fn cross_lines_run_through_the_place_where_the_planes_meet() {
    let device = Device::new();
    let position = DVec3::new(3.3, 31.0, -2.1);
    for (layout, angles) in [
        ("mode = 'orthogonal'", ""),
        ("mode = 'orthogonal'", TURNED),
        // Each pass that draws lines: where the picture is assembled, and where it is toned.
        ("mode = 'vr'\nlayout = 'beside'", ""),
        ("mode = 'vr'\nlayout = 'beside'\npost = { colour_map = 'sepia', gamma = 2.0, floats = true }", TURNED),
    ] {
        let post = if layout.contains("post") { "" } else { "post = { colour_map = 'sepia', gamma = 2.0 }" };
        let toml = format!(
            "{layout}\nplanes = {{ position = [3.3, 11.0, -2.1], {angles} }}\npicture = {{ size = [121, 101] }}\nslices = {{ pixels = 40 }}
             {post}"
        );
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, &toml.replace(",  }", " }"));
        let frames = frames(&scene, |_| 0.0);
        let screen = rendered(&device, scene.clone(), &frames).picture().expect("picture");
        let tiling = scene.tiling();
        assert_eq!(tiling.tiles.len(), 3);
        for (n, tile) in tiling.tiles.iter().enumerate() {
            // The intersection of the three planes, in pixels from the corner of the tile.
            let away = position - tile.plane.at;
            let meet: [f64; 2] = [tile.plane.right, tile.plane.down].map(|axis| away.dot(axis) / tiling.pixel);
            let meet = [meet[0] + f64::from(tile.size[0]) / 2.0, meet[1] + f64::from(tile.size[1]) / 2.0];
            // Far from the crossing, where there is only one line.
            for axis in 0..2 {
                let across =
                    if meet[1 - axis] > f64::from(tile.size[1 - axis]) / 2.0 { 4 } else { tile.size[1 - axis] - 5 };
                let (mut sum, mut weight) = (0.0, 0.0);
                for along in 1..tile.size[axis] - 1 {
                    let mut at = [along + tile.corner[0], across + tile.corner[1]];
                    if axis == 1 {
                        at = [across + tile.corner[0], along + tile.corner[1]];
                    }
                    let pixel = &screen.rgba[4 * (at[1] * 121 + at[0]) as usize..][..3];
                    let light: f64 = pixel.iter().map(|v| f64::from(*v)).sum();
                    sum += light * (f64::from(along) + 0.5);
                    weight += light;
                }
                assert!(weight > 100.0, "tile {n} has its line");
                assert!((sum / weight - meet[axis]).abs() < 0.03, "tile {n}: {} for {}", sum / weight, meet[axis]);
            }
            let corner = 4 * (tile.corner[1] * 121 + tile.corner[0]) as usize;
            let name = [PlaneName::A, PlaneName::B, PlaneName::C][n];
            // 0.1 lies half-way between two levels, and may be stored as either.
            let drawn = &screen.rgba[corner..corner + 3];
            let is_near = |(drawn, c): (&u8, f64)| (f64::from(*drawn) - c * 255.0).abs() < 0.51;
            let frame = echolume::low_level::scene::planes::colour(name);
            assert!(
                drawn.iter().zip(frame).all(is_near),
                "tile {n}: {drawn:?} is framed in its plane's colour {frame:?}"
            );
        }
    }
}

/// Every tile of a tomography equals the picture of a plane at its offset, bit for bit.
#[test]
fn a_tile_of_tomography_is_the_single_plane_at_its_offset() {
    let device = Device::new();
    for plane in ["a", "b", "c"] {
        let with = |toml: String| {
            let toml = format!("{toml}\nslices = {{ pixels = 48 }}");
            scene(Geometry::Sweep(wobbler()), BYTES, &toml)
        };
        let all = with(format!(
            "mode = 'tomography'\npicture = {{ size = [96, 60] }}
             planes = {{ plane = '{plane}', columns = 3, rows = 2, spacing = 2.0, position = [1.0, 20.0, -0.5] }}"
        ));
        let frames =
            body_frames(&all, |p| (0.5 + 0.3 * (0.9 * p.x).sin() + 0.2 * (0.7 * p.y + p.z).cos()).clamp(0.0, 1.0));
        let mut renderer = rendered(&device, all, &frames);
        let tiles = picture(&mut renderer);
        let mut lit = 0;
        for n in 0..6 {
            let offset = 2.0 * (f64::from(n) - 2.5);
            let mut position = [1.0, 20.0, -0.5];
            position[match plane {
                "a" => 2,
                "b" => 0,
                _ => 1,
            }] += offset;
            let one = with(format!(
                "mode = 'plane'\npicture = {{ size = [32, 30] }}\nplanes = {{ plane = '{plane}', position = {position:?} }}"
            ));
            renderer.change(one).expect("change");
            let single = picture(&mut renderer);
            for (x, y) in (0..30).flat_map(|y| (0..32).map(move |x| (x, y))) {
                let tile = tiles.get([x + 32 * (n as usize % 3), y + 30 * (n as usize / 3), 0]);
                assert_eq!(tile, single.get([x, y, 0]), "plane {plane}, tile {n} at {x}, {y}");
                lit += usize::from(tile[3] > 0.0);
            }
        }
        assert!(lit > 500, "{lit} pixels of plane {plane} show something");
    }
}

#[test]
fn flat_modes_have_no_ray_no_transfer_and_no_distance_map() {
    let plan = |toml: &str| {
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, toml);
        let plan = Plan::new(&scene);
        let passes: Vec<_> = plan.steps.iter().map(|s| s.pass.name).collect();
        let slots: Vec<_> = plan.slots.iter().map(|s| s.name()).collect();
        (passes.join(" "), slots.join(" "))
    };
    let flat = "frames scan_lut volume tiles screen";
    for mode in ["plane", "orthogonal", "tomography"] {
        let (passes, slots) =
            plan(&format!("mode = '{mode}'\nlight = {{ shadow = {{}} }}\ndistance = {{ median = 3 }}"));
        assert_eq!((passes.as_str(), slots.as_str()), ("scan_convert raycast_planes_toned", flat), "{mode}");
    }
    let (passes, slots) = plan("mode = 'cube'");
    assert_eq!(passes, "scan_convert raycast_cube tone");
    assert_eq!(slots, "frames scan_lut volume block picture screen");
    let (passes, slots) = plan("mode = 'vr'");
    assert!(!passes.contains("planes") && !slots.contains("tiles") && !slots.contains("block"));
    let (passes, slots) = plan("mode = 'vr'\nlayout = 'four'");
    assert!(passes.contains("raycast_volume raycast_planes") && slots.contains("tiles"), "{passes}: {slots}");
    assert!(slots.contains("rendered planes"), "{slots}");
}

#[test]
fn only_a_moved_plane_runs_again() {
    let device = Device::new();
    let with = |toml: &str| {
        scene(
            Geometry::Sweep(wobbler()),
            BYTES,
            &format!("picture = {{ size = [24, 24] }}\nslices = {{ pixels = 40 }}\n{toml}"),
        )
    };
    let first = with("mode = 'orthogonal'");
    let frames = body_frames(&first, |p| if p.y > 40.0 { 0.9 } else { 0.1 });
    let mut renderer = rendered(&device, first, &frames);
    renderer.picture().expect("picture");
    for (toml, expected) in [
        ("mode = 'orthogonal'\nplanes = { position = [1, 20, 2] }", &["raycast_planes_toned"][..]),
        (
            "mode = 'orthogonal'\nplanes = { position = [1, 20, 2] }\ncamera = { azimuth = 30 }\nray = { step = 0.3 }",
            &[],
        ),
        ("mode = 'orthogonal'\nplanes = { position = [1, 20, 2], lines = false }", &["raycast_planes_toned"]),
        (
            "mode = 'orthogonal'\nplanes = { position = [1, 20, 2], lines = false }\npost = { gamma = 2 }",
            &["raycast_planes_toned"],
        ),
        ("mode = 'tomography'\nplanes = { columns = 3, rows = 2 }", &["raycast_planes_toned"]),
        ("mode = 'cube'", &["raycast_cube", "tone"]),
        ("mode = 'cube'\ncube = { inset = { left = 3 } }", &["raycast_cube", "tone"]),
        ("mode = 'cube'\ncube = { inset = { left = 3 }, tilt = { left = [5, 0] } }", &["raycast_cube", "tone"]),
    ] {
        let scene = with(toml);
        let names = renderer.dispatched_passes(|r| r.change(scene.clone()).and_then(|_| r.picture())).expect("picture");
        assert_eq!(names, expected, "{toml}");
        let fresh = rendered(&device, scene, &frames).picture().expect("picture");
        assert_eq!(renderer.picture().expect("picture"), fresh, "{toml}");
    }
}

/// Prevents planes that differ when they are toned together by more than the rounding of 16-bit floats, one level.
#[test]
fn planes_toned_together_equal_planes_toned_afterwards() {
    let device = Device::new();
    let tone = "gamma = 1.4, contrast = 1.3, brightness = 0.05";
    for toml in [
        "mode = 'plane'\nplanes = { thickness = 3 }",
        "mode = 'orthogonal'",
        "mode = 'orthogonal'\nplanes = { lines = false }",
        "mode = 'tomography'",
        "mode = 'tomography'\nplanes = { columns = 3, rows = 2, lines = false }",
    ] {
        let with = |floats: bool, map: &str| {
            let post = format!("post = {{ {tone}, colour_map = '{map}', floats = {floats} }}");
            let head = "picture = { size = [61, 47] }\nslices = { pixels = 40 }\nray = { sampling = 'exact' }";
            scene(Geometry::Sweep(wobbler()), BYTES, &format!("{toml}\n{post}\n{head}"))
        };
        for map in ["none", "sepia"] {
            let at_once = with(false, map);
            let frames = body_frames(&at_once, |p| (p.y / 80.0 + 0.1 * p.x.sin()).clamp(0.0, 1.0));
            let got = rendered(&device, at_once, &frames).picture().expect("picture");
            let expected = rendered(&device, with(true, map), &frames).picture().expect("picture");
            let off = got.rgba.iter().zip(&expected.rgba).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(off <= Some(1), "{toml}, {map}: {off:?} levels");
            assert!(got.rgba.chunks_exact(4).any(|p| p[0] > 100), "{toml}: nothing is seen");
        }
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    for (toml, field) in [
        ("mode = 'tomography'\nplanes = { columns = 9, rows = 8 }", "planes.columns"),
        ("mode = 'tomography'\nplanes = { columns = 0 }", "planes.columns"),
        ("mode = 'tomography'\nplanes = { columns = 5 }\npicture = { size = [4, 9] }", "picture.size"),
        ("mode = 'orthogonal'\npicture = { size = [1, 9] }", "picture.size"),
        ("layout = 'four'\npicture = { size = [1, 1] }", "picture.size"),
        ("layout = 'beside'\npicture = { size = [4, 2] }", "picture.size"),
        ("mode = 'plane'\nlayout = 'beside'", "layout"),
        ("mode = 'plane'\nplanes = { thickness = 50000 }", "planes.thickness"),
        ("mode = 'plane'\nplanes = { thickness = -1 }", "planes.thickness"),
        ("mode = 'plane'\nplanes = { position = [0, nan, 0] }", "planes.position"),
        ("mode = 'plane'\nplanes = { azimuth = inf }", "planes.azimuth"),
        ("mode = 'plane'\nplanes = { zoom = 0 }", "planes.zoom"),
        ("mode = 'plane'\nplanes = { window = [0.5, 0.5] }", "planes.window"),
        ("mode = 'plane'\nplanes = { spacing = 0 }", "planes.spacing"),
        ("mode = 'cube'\ncube = { inset = { left = 40, right = 50 } }", "cube.inset"),
        ("mode = 'cube'\ncube = { inset = { near = 500 } }", "cube.inset"),
        ("mode = 'cube'\ncube = { inset = { near = -1 } }", "cube.inset.near"),
        ("mode = 'cube'\ncube = { tilt = { top = [85, 0] } }", "cube.tilt.top"),
        ("mode = 'cube'\ncube = { shading = 1.5 }", "cube.shading"),
    ] {
        let settings = settings(toml);
        let Err(SceneError { field: named, fault }) = Scene::new(Geometry::Sweep(wobbler()), BYTES, settings) else {
            panic!("{toml} was not refused")
        };
        assert!(named.contains(field) && !fault.contains('\n'), "{toml}: {named}: {fault}");
    }
}
