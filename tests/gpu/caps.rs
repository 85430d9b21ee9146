//! Caps: the cut faces of clip planes show what planes show, whatever the light is; fluid stays open; and without clip planes, or with caps
//! switched off, nothing changes.

use crate::common::gpu::*;
use echolume::low_level::passes::{Slot, Texels, is_hit};
use echolume::low_level::picture::Picture;
use echolume::low_level::plan::Plan;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use echolume::low_level::scene::planes::Plane;
use glam::DVec3;

const SOLID: &str = "volume.transfer = [{ at = 0, colour = [0.9, 0.5, 0.3], opacity = 1 }]";

/// 48 x 40 x 44 voxels of 0.5 mm.
fn voxels() -> Geometry {
    Geometry::Cartesian(Grid { size: [48, 40, 44], spacing: [0.5; 3], origin: [-12.0, 1.0, -11.0] })
}

fn of(geometry: &Geometry, toml: &str) -> Scene {
    scene(
        geometry.clone(),
        FLOATS,
        &format!("slices = {{ pixels = 100, format = 'r32f' }}\nray.sampling = 'exact'\n{toml}"),
    )
}

/// The picture, and where cut faces are: echo and opacity.
fn capped(device: &Device, scene: Scene, frames: &[Texels]) -> (Picture, Texels) {
    let mut renderer = rendered(device, scene, frames);
    let picture = renderer.picture().expect("picture");
    (picture, renderer.read(Slot::Cap).expect("read").expect("there"))
}

fn picture(device: &Device, scene: Scene, frames: &[Texels]) -> Picture {
    rendered(device, scene, frames).picture().expect("picture")
}

/// Tissue of 0.25 to 0.85 with structure of some millimetres.
fn tissue(p: DVec3) -> f64 {
    0.55 + 0.15 * (0.9 * p.x + 0.2 * p.y).sin() + 0.15 * (0.8 * p.z - 0.5 * p.y).cos()
}

/// The camera that looks along a plane's normal, with the plane's right to the right.
fn along(Plane { right, normal, .. }: Plane) -> String {
    let (azimuth, elevation) = (normal.x.atan2(normal.y), normal.z.asin());
    let level = DVec3::new(azimuth.cos(), -azimuth.sin(), 0.0);
    let roll = right.dot(level.cross(normal)).atan2(right.dot(level));
    let [azimuth, elevation, roll] = [azimuth, elevation, roll].map(f64::to_degrees);
    format!("camera = {{ azimuth = {azimuth}, elevation = {elevation}, roll = {roll} }}")
}

/// The section of a clip plane that is seen along its normal is the picture of the same plane, pixel for pixel: within one level, as the
/// places differ by rounding. Prevents faces beside the clip plane, with another window or tone, and faces that a light or a step changes.
#[test]
fn a_cut_face_is_the_picture_of_its_plane() {
    let device = Device::new();
    let window = "window = [0.15, 0.9]";
    let tone = "post = { gamma = 1.4, contrast = 1.2, brightness = 0.05, colour_map = 'sepia', antialias = false }\npicture.size = [61, 53]";
    let shadow =
        "mode = 'sr'\nsurface.threshold = 0.05\nlight = { shadow = {}, occlusion = {}, skin = {}, texture = 0.5 }";
    let lit = format!("mode = 'vr'\n{SOLID}\nlight.volume = {{ cell = 4 }}\nray.step = 0.7");
    for (name, geometry) in [("fan", Geometry::Sweep(wobbler())), ("Cartesian", voxels())] {
        let (low, high) = echolume::low_level::scene::insonified_box(&geometry);
        for plane in ["plane = 'a'", "plane = 'b'", "plane = 'c'", TURNED] {
            let flat = of(&geometry, &format!("mode = 'plane'\nplanes = {{ {plane}, {window} }}\n{tone}"));
            let cut = flat.plane(flat.settings.planes.plane);
            // Plane B is seen from the other side than its normal's.
            let forward = cut.right.cross(cut.down);
            let face = cut.at - DVec3::Y * flat.probe().map_or(0.0, |p| p.array_radius());
            let clip = format!("clip = [{{ at = {:?}, normal = {:?} }}]", face.to_array(), (-forward).to_array());
            let frames = body_frames(&flat, tissue);
            let expected = picture(&device, flat, &frames);
            for mode in [shadow, &lit] {
                let solid = of(
                    &geometry,
                    &format!(
                        "{mode}\n{}\n{clip}\nplanes = {{ {window} }}\n{tone}",
                        along(Plane { normal: forward, ..cut })
                    ),
                );
                assert_eq!((solid.low, solid.high), (low, high), "{name}: the same pixels");
                let (got, faces) = capped(&device, solid, &frames);
                let (mut on_face, mut on_plane, mut worst) = (0, 0, 0u8);
                for n in 0..61 * 53 {
                    let [is, shows] = [&got, &expected].map(|picture| &picture.rgba[4 * n..4 * n + 3]);
                    on_plane += usize::from(shows.iter().any(|c| *c > 0));
                    if faces.values[2 * n + 1] > 0.0 {
                        on_face += 1;
                        worst = is.iter().zip(shows).fold(worst, |worst, (a, b)| worst.max(a.abs_diff(*b)));
                    }
                }
                println!("{name}, {plane}: {on_face} pixels of {on_plane}, {worst} levels off");
                assert!(worst <= 1, "{name}, {plane}, {mode}: {worst} levels off");
                assert!(on_face > 400 && on_face + 20 >= on_plane, "{name}, {plane}, {mode}: {on_face} of {on_plane}");
            }
        }
    }
}

/// Where a clip plane meets a ray, the linear field is what it is there, in every projection and behind several planes: the last one that a ray
/// enters counts.
#[test]
fn faces_of_several_planes_show_the_field_where_rays_enter_them() {
    let device = Device::new();
    let field = |p: DVec3| 0.5 + 0.012 * p.x + 0.015 * (p.y - 11.0) - 0.01 * p.z;
    let planes = [
        (DVec3::new(0.0, 6.0, 0.0), DVec3::new(0.6, -1.0, 0.1)),
        (DVec3::new(0.0, 7.0, 0.0), DVec3::new(-0.8, -1.0, 0.4)),
        (DVec3::new(2.0, 0.0, 6.0), DVec3::new(0.1, 0.2, 1.0)),
    ];
    let clips = planes.map(|(at, normal)| format!("{{ at = {:?}, normal = {:?} }}", at.to_array(), normal.to_array()));
    for view in ["azimuth = 20, elevation = -30", "azimuth = -25, elevation = -35, field_of_view = 50"] {
        let toml = format!(
            "mode = 'sr'\nsurface.threshold = 0.05\npost.floats = true\nplanes.window = [0.1, 0.9]\npicture.size = [40, 36]\ncamera = {{ {view} }}\nclip = [{}]",
            clips.join(", ")
        );
        let scene = of(&voxels(), &toml);
        let (_, faces) = capped(&device, scene.clone(), &body_frames(&scene, field));
        let (mut seen, mut worst) = ([0; 3], 0.0f64);
        for (x, y) in (0..36).flat_map(|y| (0..40).map(move |x| (x, y))) {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            let entries = scene.clips().map(|(normal, limit)| match normal.dot(direction) {
                towards if towards < 0.0 => (limit - normal.dot(origin)) / towards,
                _ => f64::MIN,
            });
            let (last, enter) = entries.enumerate().fold((0, f64::MIN), |a, b| if b.1 > a.1 { b } else { a });
            let place = origin + direction * enter;
            let is_kept = scene.clips().all(|(normal, limit)| normal.dot(place) < limit + 1e-9);
            let is_inside = place.cmpgt(scene.low + 0.26).all() && place.cmplt(scene.high - 0.26).all();
            let [echo, opacity] = [0, 1].map(|c| faces.get([x, y, 0])[c]);
            if is_kept && is_inside && entries_from_outside(&scene, origin, direction, enter) {
                assert_eq!(opacity, 1.0, "{view}: no face at {x}, {y}");
                worst = worst.max((echo - (field(place) - 0.1) / 0.8).abs());
                seen[last] += 1;
            }
        }
        println!("{view}: {seen:?} pixels of the faces, {worst:.1e} off");
        // Echoes are stored in half floats.
        assert!(worst < 5e-4 && seen.iter().all(|n| *n > 20), "{view}: {seen:?}, {worst}");
    }
}

/// True if the ray is within the box where it meets the face, and before that was outside of what is kept.
fn entries_from_outside(scene: &Scene, origin: DVec3, direction: DVec3, enter: f64) -> bool {
    let before = origin + direction * (enter - 0.05);
    before.cmpgt(scene.low).all() && before.cmplt(scene.high).all()
}

/// A ball of fluid in tissue, cut in half: tissue is capped up to the ball's rim, and within it the rays go on to its far wall.
#[test]
fn one_looks_into_fluid() {
    let device = Device::new();
    let (centre, radius) = (DVec3::new(0.3, 8.0, -0.4), 7.0);
    let body = |p: DVec3| 0.1 + 0.6 * ((p.distance(centre) - radius) / 0.8 + 0.5).clamp(0.0, 1.0);
    let clip = "clip = [{ at = [0, 8, 0], normal = [0, -1, 0] }]";
    let toml = format!(
        "mode = 'sr'\nsurface = {{ threshold = 0.3, edge = 1.6 }}\npicture.size = [64, 60]\nray.step = 0.2\n{clip}"
    );
    let scene = of(&voxels(), &toml);
    let mut renderer = rendered(&device, scene.clone(), &body_frames(&scene, body));
    renderer.picture().expect("picture");
    let [faces, distances] = [Slot::Cap, Slot::Distance].map(|slot| renderer.read(slot).expect("read").expect("there"));
    let (mut closed, mut open, mut worst) = (0, 0, 0.0f64);
    for (x, y) in (0..60).flat_map(|y| (0..64).map(move |x| (x, y))) {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let enter = (8.0 - origin.y) / direction.y;
        let place = origin + direction * enter;
        if place.cmplt(scene.low).any() || place.cmpgt(scene.high).any() {
            continue;
        }
        let (away, distance) = (place.distance(centre), distances.one(x, y, 0));
        let is_capped = faces.get([x, y, 0])[1] > 0.0;
        if away > radius + 0.5 {
            assert!(is_capped && (distance - enter).abs() < 1e-3, "{x}, {y}: {away} mm from the middle of the ball");
            closed += 1;
        } else if away < radius - 0.5 {
            assert!(!is_capped && is_hit(distance), "{x}, {y}: {away} mm from the middle of the ball");
            if away < 0.8 * radius {
                let wall = (radius * radius - away * away).sqrt();
                worst = worst.max((distance - enter - wall).abs());
            }
            open += 1;
        }
    }
    println!("{closed} rays end at the face, {open} at the wall of the ball, at most {worst:.2} mm off");
    assert!(closed > 500 && open > 500 && worst < 0.2, "{closed}, {open}, {worst} mm");
}

/// Light, skin, shadow, occlusion and the light in the volume change what is lit, and no bit of a cut face.
#[test]
fn no_light_changes_a_cut_face() {
    let device = Device::new();
    // A ball whose upper left quarter is cut away: most of it is seen beside the cut face.
    let body = |p: DVec3| if p.distance(DVec3::new(0.0, 11.0, 0.0)) < 8.0 { tissue(p) } else { 0.02 };
    let clip = "clip = [{ at = [-3, 0, 0], normal = [-1, 0, 0] }]\ncamera.azimuth = 50\npicture.size = [56, 56]";
    // Antialiased, the face's border is mixed with what is beside it.
    let surface = "mode = 'sr'\nsurface.threshold = 0.1\npost.antialias = false";
    let volume = format!("mode = 'vr'\n{SOLID}\nvolume.threshold = 0.15\ncap.level = 0.15\npost.antialias = false");
    for (mode, lights) in [
        (
            surface,
            &[
                "light = { direction = [-1, 0, 0.2] }",
                "light = { ambient = 0.9, surface_colour = [0.9, 0.2, 0.1] }",
                "light = { shadow = {}, occlusion = {}, direction = [1, 0.1, 0.2] }",
                "light = { skin = {}, texture = 1.0, specular = 1.0 }",
                "surface.colour = 'behind'",
                "surface.colour = 'rendered'",
            ][..],
        ),
        (
            &volume,
            &[
                "light.volume = { cell = 2 }",
                "light = { direction = [-1, 0, 0.2], volume = { cell = 2, exposure = 2 } }",
                "volume.shading = 'first-hit'\nlight = { shadow = {}, occlusion = {} }",
                "volume.shading = 'depth-coded'",
            ],
        ),
    ] {
        let plain = of(&voxels(), &format!("{mode}\n{clip}"));
        let frames = body_frames(&plain, body);
        let (base, faces) = capped(&device, plain, &frames);
        assert!(faces.values.chunks_exact(2).filter(|face| face[1] > 0.0).count() > 300, "{mode}");
        for light in lights {
            let (lit, same) = capped(&device, of(&voxels(), &format!("{mode}\n{light}\n{clip}")), &frames);
            assert_eq!(same, faces, "{mode}, {light}");
            let pixels = base.rgba.chunks_exact(4).zip(lit.rgba.chunks_exact(4)).zip(faces.values.chunks_exact(2));
            let mut others = 0;
            for ((a, b), face) in pixels {
                match face[1] > 0.0 {
                    true => assert_eq!(a, b, "{mode}, {light}"),
                    false => others += usize::from(a != b),
                }
            }
            assert!(others > 100, "{mode}, {light}: {others} other pixels changed");
        }
    }
}

/// A face that fades lies over what the ray finds behind it, which is lit as without the face. Prevents a rim of the region through which one
/// sees the background although tissue is behind it.
#[test]
fn a_face_that_fades_covers_nothing_else() {
    let device = Device::new();
    // Antialiased, the face's border is mixed with what is beside it.
    let view = "picture.size = [64, 60]\npost.antialias = false\nregion.fade = 6\ncamera = { azimuth = 35, elevation = 12 }\n\
                clip = [{ at = [0, 8, 0], normal = [0.2, -1, 0] }]\nplanes.window = [0, 1]";
    for mode in ["shading = 'none'", "shading = 'first-hit'", "shading = 'none'\nlight.volume = { cell = 4 }"] {
        let made =
            |is: &str| of(&voxels(), &format!("mode = 'vr'\n{SOLID}\nvolume.{mode}\n{view}\ncap.enabled = {is}"));
        let frames = body_frames(&made("true"), tissue);
        let (got, faces) = capped(&device, made("true"), &frames);
        let plain = picture(&device, made("false"), &frames);
        let (mut faded, mut worst) = (0, 0.0f64);
        for (n, face) in faces.values.chunks_exact(2).enumerate().filter(|(_, face)| face[1] > 0.0) {
            faded += usize::from((0.05..0.95).contains(&face[1]));
            for c in 0..3 {
                let behind = f64::from(plain.rgba[4 * n + c]) / 255.0;
                let expected = face[1] * face[0] + (1.0 - face[1]) * behind;
                worst = worst.max((f64::from(got.rgba[4 * n + c]) / 255.0 - expected).abs());
            }
        }
        println!("{mode}: {faded} pixels that fade, {worst:.4} off");
        assert!(faded > 200 && worst < 1.6 / 255.0, "{mode}: {faded} pixels, {worst} off");
    }
}

/// Without clip planes there is no such pass, whatever the settings of caps are, and the picture is the same to the last bit. With them, switched
/// off, no pass knows of them, and a volume is the one that begins at the plane.
#[test]
fn without_clip_planes_or_switched_off_nothing_changes() {
    let device = Device::new();
    let body = |p: DVec3| if p.distance(DVec3::new(0.0, 11.0, 0.0)) < 8.0 { tissue(p) } else { 0.02 };
    let clip = "clip = [{ at = [0, 8, 0], normal = [0, -1, 0] }]";
    let view = format!("picture.size = [48, 44]\nsurface.threshold = 0.1\nvolume.threshold = 0.1\n{SOLID}");
    for mode in
        ["mode = 'sr'", "mode = 'vr'", "mode = 'mixed'", "layout = 'pair'", "mode = 'vr'\nlight.volume = { cell = 3 }"]
    {
        let made = |more: &str| of(&voxels(), &format!("{mode}\n{view}\n{more}"));
        let has_pass = |scene: &Scene| Plan::new(scene).steps.iter().any(|step| step.pass.name == "raycast_cap");
        let frames = body_frames(&made(""), body);
        let [plain, other] = [made(""), made("cap = { enabled = false, level = 0.3 }")];
        assert!(!has_pass(&plain) && !has_pass(&other), "{mode}");
        assert_eq!(picture(&device, plain, &frames), picture(&device, other, &frames), "{mode}");
        let [on, off] = ["true", "false"].map(|is| made(&format!("cap.enabled = {is}\n{clip}")));
        assert!(has_pass(&on) && !has_pass(&off), "{mode}");
        // Nothing that runs knows of a face.
        for step in &Plan::new(&off).steps {
            assert!(step.reads(&off).iter().all(|slot| *slot != Slot::Cap), "{mode}: {}", step.pass.name);
            let constants = step.pass.constants(&off, &step.args());
            assert!(constants.iter().all(|constant| *constant != ("CAPPED", 1)), "{mode}: {}", step.pass.name);
        }
        let off = picture(&device, off, &frames);
        if mode == "mode = 'vr'" {
            let (mean, most) = difference(&off, &picture(&device, made("volume.start_depth = 8"), &frames));
            // A ray enters both at places that differ by rounding.
            assert!(most <= 1.0 && mean < 1e-3, "{mode}: {mean}, {most}");
        }
        let (mean, _) = difference(&picture(&device, on, &frames), &off);
        assert!(mean > 2.0, "{mode}: caps change the picture by {mean} levels");
    }
    for mode in ["mip", "minip", "mean", "plane", "orthogonal", "tomography", "cube"] {
        assert!(!of(&voxels(), &format!("mode = '{mode}'\n{clip}")).has_caps(), "{mode}");
    }
}

/// The switch needs no frame again, and a light or a window of the rendering no face.
#[test]
fn the_switch_runs_the_rays_again_and_nothing_before_them() {
    let device = Device::new();
    let base = of(
        &voxels(),
        "mode = 'sr'\nsurface.threshold = 0.1\npicture.size = [32, 32]\nclip = [{ at = [0, 8, 0], normal = [0, -1, 0] }]",
    );
    let mut renderer = rendered(&device, base.clone(), &body_frames(&base, tissue));
    renderer.picture().expect("picture");
    let mut after = |change: fn(&mut Scene)| {
        let mut settings = base.clone();
        change(&mut settings);
        let scene = Scene::new(settings.geometry, settings.input, settings.settings).expect("scene");
        let names = renderer.dispatched_passes(|r| r.change(scene).and_then(|_| r.picture())).expect("picture");
        renderer.change(base.clone()).expect("change");
        renderer.picture().expect("picture");
        names
    };
    assert_eq!(after(|s| s.settings.cap.enabled = false), ["raycast_surface", "light", "assemble_toned"]);
    assert_eq!(
        after(|s| s.settings.cap.level = Some(0.5)),
        ["raycast_cap", "raycast_surface", "light", "assemble_toned"]
    );
    assert_eq!(
        after(|s| s.settings.planes.window = [0.2, 0.8]),
        ["raycast_cap", "raycast_surface", "light", "assemble_toned"]
    );
    assert_eq!(after(|s| s.settings.light.ambient = 0.5), ["light", "assemble_toned"]);
}

/// What a cut removes is removed from the face too, and planes keep it. The faces of the region's box, and those of a cut, have no caps.
#[test]
fn a_cut_goes_through_the_face_and_has_none_of_its_own() {
    let device = Device::new();
    let cut = "cuts = [{ contour = [[-4, -4], [4, -4], [4, 4], [-4, 4]], view = { at = [0, 10, 0], direction = [0, 1, 0], up = [0, 0, 1] } }]";
    let clip = "clip = [{ at = [0, 8, 0], normal = [0, -1, 0] }]";
    let made =
        |more: &str| of(&voxels(), &format!("mode = 'sr'\nsurface.threshold = 0.1\npicture.size = [64, 60]\n{more}"));
    let scene = made(&format!("{clip}\n{cut}"));
    let frames = body_frames(&scene, tissue);
    let (_, faces) = capped(&device, scene.clone(), &frames);
    let (mut through, mut kept) = (0, 0);
    for (x, y) in (0..60).flat_map(|y| (0..64).map(move |x| (x, y))) {
        let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
        let place = origin + direction * ((8.0 - origin.y) / direction.y);
        if place.cmplt(scene.low + 0.5).any() || place.cmpgt(scene.high - 0.5).any() {
            continue;
        }
        let is_capped = faces.get([x, y, 0])[1] > 0.0;
        let off = place.x.abs().max(place.z.abs());
        if off < 3.0 {
            assert!(!is_capped, "at {place}");
            through += 1;
        } else if off > 5.0 {
            assert!(is_capped, "at {place}");
            kept += 1;
        }
    }
    assert!(through > 100 && kept > 500, "{through}, {kept}");
    assert!(!made("region = { depth = [8, 20] }").has_caps() && !made(cut).has_caps());
}
