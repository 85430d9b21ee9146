//! Cuts: renderings are those of a volume from which the same was removed before it came, to the last bit, and planes show all of it.

use crate::common::gpu::*;
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::picture::Picture;
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::{Geometry, Grid};
use echolume::low_level::scene::Scene;
use glam::DVec3;

const PRISM: &str = "{ contour = [[-3.1, -2.7], [3.3, -2.9], [2.1, 3.7], [-1.9, 2.2]], view = { at = [0, 10, 0], direction = [0.1, 1, 0.2], up = [0, 0, 1] } }";
const CONE: &str = "{ contour = [[-2.1, -1.7], [2.3, -1.9], [0.1, 2.7]], view = { at = [2, 9, 1], direction = [1, 0.3, 0.2], up = [0, 0, 1], eye = 21 }, depth = 2.3 }";
const TRIMMED: &str = "{ contour = [[-5.1, -4.7], [5.3, -4.9], [0.1, 6.7]], view = { at = [0, 10, 0], direction = [0, 1, 0.1], up = [0, 0, 1] }, keep = 'inside', depth = 3.3 }";

const BRUSH: &str = "{ brush = { radius = 2.31, strokes = [[[-3, 8, 1], [2.1, 5.2, -2], [3, 6, 2]], [[-1, 14, 3]]] } }";

/// Voxels that are stored as they come, in a box about (0, 10, 0).
fn voxels() -> Geometry {
    Geometry::Cartesian(Grid { size: [34, 33, 32], spacing: [0.5, 0.6, 0.55], origin: [-8.3, 0.4, -8.5] })
}

fn of(geometry: &Geometry, mode: &str, cuts: &[&str]) -> Scene {
    let sampling = if mode.contains("sampling") { "" } else { "ray.sampling = 'exact'" };
    let toml = format!(
        "{mode}\ncuts = [{}]\nslices.pixels = 72\npicture.size = [48, 44]\n{sampling}\n\
         volume.transfer = [{{ at = 0.4, colour = [0.5, 0.4, 0.3], opacity = 0 }}, {{ at = 0.7, colour = [1, 0.9, 0.8], opacity = 0.5 }}]",
        cuts.join(", ")
    );
    scene(geometry.clone(), BYTES, &toml)
}

/// A ball with layers in fluid.
fn echo(p: DVec3) -> f64 {
    let away = (p - DVec3::new(0.0, 10.0, 0.0)).length();
    if away < 7.0 { 0.7 + 0.2 * (2.0 * away).sin() } else { 0.1 }
}

fn picture(device: &Device, scene: Scene, frames: &[Texels]) -> Picture {
    rendered(device, scene, frames).picture().expect("picture")
}

/// Every mode, from every side, with and without empty-space skipping: what skips reads the volume that was cut.
#[test]
fn a_rendering_with_cuts_is_that_of_a_volume_without_what_they_remove() {
    let device = Device::new();
    for (mode, removed) in [
        ("mode = 'vr'\nlight.volume = {}", 0.0),
        ("mode = 'vr'\nray.elevation = 'bspline'", 0.0),
        ("mode = 'sr'\nsurface.edge = 1.5", 0.0),
        ("mode = 'mixed'\nsurface.edge = 1.5\nlayout = 'four'", 0.0),
        ("mode = 'mip'", 0.0),
        ("mode = 'minip'", 1.0),
        ("mode = 'mean'", 0.0),
    ] {
        let mut seen = 0;
        for cuts in [&[PRISM][..], &[CONE, PRISM], &[TRIMMED], &[BRUSH, CONE]] {
            for view in [
                "ray.brick = 0",
                "ray.brick = 4\ncamera = { azimuth = 50, elevation = -20 }",
                "camera = { azimuth = -140, field_of_view = 40 }",
            ] {
                let scene = of(&voxels(), &format!("{mode}\n{view}"), cuts);
                let whole = of(&voxels(), &format!("{mode}\n{view}"), &[]);
                let shapes: Vec<_> = scene.cuts().collect();
                let is_removed = |p: DVec3| shapes.iter().any(|cut| cut.removes(p));
                let frames = body_frames(&whole, echo);
                let before = body_frames(&whole, |p| if is_removed(p) { removed } else { echo(p) });
                let got = picture(&device, scene, &frames);
                let mut expected = picture(&device, whole.clone(), &before);
                let all = picture(&device, whole.clone(), &frames);
                if mode.contains("four") {
                    // Planes keep what is removed.
                    let [width, height] = [expected.width as usize, expected.height as usize];
                    let of_planes = (0..width * height).filter(|n| n % width < width / 2 || n / width < height / 2);
                    of_planes
                        .for_each(|n| expected.rgba[4 * n..4 * n + 4].copy_from_slice(&all.rgba[4 * n..4 * n + 4]));
                }
                assert!(got == expected, "{mode}, {view}, {cuts:?}: {:?}", difference(&got, &expected));
                seen += usize::from(got != all);
            }
        }
        // The smallest echo of a ray is often one that stays.
        let least = if removed > 0.5 { 3 } else { 9 };
        assert!(seen >= least, "{mode}: cuts are seen in {seen} pictures only");
    }
}

/// Seen as it was drawn, the hole has the form of its contour, in every geometry: nothing is left within, and all without.
#[test]
fn the_hole_has_the_form_of_the_contour() {
    let device = Device::new();
    for (name, geometry) in geometries().into_iter().filter(|(name, _)| *name != "single frame") {
        for field_of_view in [0.0, 35.0] {
            let view = format!(
                "mode = 'vr'\nvolume.transfer = 'grey'\npicture.size = [96, 96]\nslices.pixels = 200\ncamera = {{ azimuth = 8, elevation = 5, field_of_view = {field_of_view} }}"
            );
            let whole = scene(geometry.clone(), BYTES, &view);
            let rays = whole.rays;
            // In the plane through the camera's target, as wide as most of the volume.
            let size = (whole.high - whole.low).min_element() / 1.6;
            let corners = [[-1.0, -0.8], [1.1, -0.9], [0.2, 1.2]].map(|corner| corner.map(|v: f64| v * size));
            let eye = (rays.target - rays.origin).dot(rays.forward);
            let eye = if field_of_view > 0.0 { format!(", eye = {eye}") } else { String::new() };
            let cut = format!(
                "cuts = [{{ contour = {corners:?}, view = {{ at = {:?}, direction = {:?}, up = {:?}{eye} }} }}]",
                whole.point_of(rays.target),
                rays.forward.to_array(),
                rays.up.to_array()
            );
            let scene = scene(geometry.clone(), BYTES, &format!("{cut}\n{view}"));
            let frames = body_frames(&whole, |_| 0.9);
            let (before, after) = (picture(&device, whole.clone(), &frames), picture(&device, scene.clone(), &frames));
            let Some(shape) = scene.cuts().next() else { panic!("no cut") };
            // Slices are farthest apart: what is interpolated towards a texel that stays. Nearer to the eye than the plane that is wider in it.
            let [mut within, mut without, mut faults] = [0, 0, 0];
            let [low, high] = [whole.low, whole.high].map(|corner| corner.to_array());
            let corners =
                (0..8).map(|n| DVec3::from(std::array::from_fn(|a| if n >> a & 1 == 1 { high[a] } else { low[a] })));
            let nearest = corners.map(|corner| shape.project(corner).1).fold(f64::INFINITY, f64::min);
            let wider = shape.eye.map_or(1.0, |eye| eye / (eye + nearest));
            let pitch = 1.2 * slice_distance(&whole) * wider.max(1.0);
            for (n, (old, new)) in before.rgba.chunks_exact(4).zip(after.rgba.chunks_exact(4)).enumerate() {
                let (origin, direction) = rays.at((n % 96) as f64 + 0.5, (n / 96) as f64 + 0.5);
                let along = (rays.target - origin).dot(rays.forward) / direction.dot(rays.forward);
                let (Some(at), _) = shape.project(origin + direction * along) else { panic!("in front of the eye") };
                let around =
                    (0..16).map(|n| pitch * glam::DVec2::from_angle(f64::from(n) * std::f64::consts::FRAC_PI_8));
                let inside = around.clone().filter(|by| shape.winds_about(at + *by)).count();
                match inside {
                    16 => (within, faults) = (within + 1, faults + usize::from(new[0] > 2)),
                    0 if !shape.winds_about(at) => (without, faults) = (without + 1, faults + usize::from(old != new)),
                    _ => {}
                }
            }
            assert!(within > 20 && without > 1000, "{name}: {within} {without}");
            assert_eq!(faults, 0, "{name}, {field_of_view}: of {within} within and {without} without");
        }
    }
}

/// The largest distance of two neighbouring slices, mm.
fn slice_distance(scene: &Scene) -> f64 {
    let [columns, rows, slices] = scene.volume_size();
    let corners = [[0, 0], [columns - 1, 0], [0, rows - 1], [columns - 1, rows - 1], [columns / 2, rows - 1]];
    let apart = |[x, y]: [u32; 2]| {
        let place = move |z| scene.texel_place([x, y, z]);
        (1..slices).map(move |z| place(z).distance(place(z - 1)))
    };
    corners.into_iter().flat_map(apart).fold(0.0, f64::max)
}

/// A cut that is drawn, changed or taken back needs no frame again, and is what a fresh renderer draws.
#[test]
fn another_cut_needs_no_frame_again() {
    let device = Device::new();
    for geometry in [Geometry::Sweep(wobbler()), voxels()] {
        for mode in
            ["mode = 'vr'\nray.brick = 4", "mode = 'sr'\nfloating = 3\nray.sampling = 'quads'\nsurface.edge = 2"]
        {
            let with = |cuts: &[&str]| of(&geometry, mode, cuts);
            let frames =
                body_frames(&with(&[]), |p| echo(p * 0.5 + DVec3::Y * if geometry == voxels() { 5.0 } else { -8.0 }));
            let mut renderer: Renderer = rendered(&device, with(&[]), &frames);
            let whole = renderer.picture().expect("picture");
            for cuts in [&[PRISM][..], &[PRISM, CONE], &[TRIMMED], &[]] {
                let cuts: Vec<String> = cuts.iter().map(|cut| cut.replace("at = [0, 10", "at = [0, 30")).collect();
                let cuts: Vec<&str> = cuts.iter().map(String::as_str).collect();
                assert!(
                    matches!(renderer.change(with(&cuts)).expect("change"), Rerun::Steps { .. }),
                    "{mode} {cuts:?}"
                );
                let got = renderer.picture().expect("picture");
                assert!(got == picture(&device, with(&cuts), &frames), "{mode} {cuts:?}");
                assert_eq!(got == whole, cuts.is_empty(), "{mode} {cuts:?}");
            }
        }
    }
}

/// A frame that comes later is cut too, and the others stay.
#[test]
fn frames_that_come_later_are_cut() {
    let device = Device::new();
    let scene = of(&voxels(), "mode = 'mip'\nray.sampling = 'quads'", &[PRISM]);
    let (first, second) = (body_frames(&scene, echo), body_frames(&scene, |p| 0.9 - 0.5 * echo(p)));
    let mut renderer = rendered(&device, scene.clone(), &first);
    renderer.picture().expect("picture");
    let mut mixed = first.clone();
    mixed[16] = second[16].clone();
    renderer.frame(16, &mixed[16].encode(frame_format(&scene)), 0).expect("a frame");
    renderer.show(0).expect("show");
    assert!(renderer.picture().expect("picture") == picture(&device, scene.clone(), &mixed));
    // What planes would be cut from, and exports read, still has everything.
    let whole = renderer.read(Slot::Volume).expect("read").expect("there");
    let cut = renderer.read(Slot::CutVolume).expect("read").expect("there");
    let [before, after] = [&whole, &cut].map(|volume| volume.values.iter().filter(|v| **v > 0.05).count());
    assert!(before == whole.values.len() && after < before, "{before} {after}");
}
