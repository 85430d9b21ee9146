//! Parts that float are not drawn, and nothing else changes.

use crate::common::gpu::*;
use echolume::low_level::gpu::Renderer;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::picture::Picture;
use echolume::low_level::plan::Rerun;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::{Scene, insonified_box};
use glam::DVec3;

const TRANSFER: &str = "volume.transfer = [{ at = 0.4, colour = [0.5, 0.4, 0.3], opacity = 0 }, { at = 0.7, colour = [1, 0.9, 0.8], opacity = 0.5 }]";

fn of(geometry: &Geometry, more: &str) -> Scene {
    let toml = format!("{more}\nslices.pixels = 72\npicture.size = [40, 36]\nray.sampling = 'exact'\n{TRANSFER}");
    scene(geometry.clone(), BYTES, &toml)
}

/// A ball in fluid, and beside it three specks that do not touch it.
fn body(scene: &Scene, has_specks: bool) -> Vec<Texels> {
    let (low, high) = insonified_box(&scene.geometry);
    let (middle, size) = ((low + high) / 2.0, (high - low).min_element());
    let radius = 0.22 * size;
    let specks = [DVec3::new(-1.0, 0.1, 0.0), DVec3::new(0.9, 0.3, 0.1), DVec3::new(0.1, -1.0, -0.1)]
        .map(|v| middle + v * 2.0 * radius);
    body_frames(scene, |p| {
        let ball = (p - middle).length() < radius;
        let speck = has_specks && specks.iter().any(|s| (p - *s).length() < 0.3 * radius);
        if ball {
            0.8
        } else if speck {
            0.7
        } else {
            0.1
        }
    })
}

fn picture(device: &Device, scene: Scene, frames: &[Texels]) -> Picture {
    rendered(device, scene, frames).picture().expect("picture")
}

/// Pixels that show something where a picture of the ball alone shows nothing.
fn lit_beside(picture: &Picture, ball: &Picture) -> usize {
    let is_lit = |pixel: &[u8]| pixel[..3].iter().any(|level| *level > 8);
    picture.rgba.chunks_exact(4).zip(ball.rgba.chunks_exact(4)).filter(|(a, b)| is_lit(a) && !is_lit(b)).count()
}

/// The device's picture of a ball and specks is that of the ball alone, to the last bit, in every geometry and way to sample. The surface
/// detector also compares what lies an edge's length in front of a surface: specks are not drawn there either, but may move it.
#[test]
fn specks_are_gone_and_the_rest_is_as_if_they_had_never_been() {
    let device = Device::new();
    let mut compared = [0; 2];
    for (name, geometry) in geometries().into_iter().filter(|(name, _)| *name != "single frame") {
        for mode in [
            "mode = 'vr'",
            "mode = 'vr'\nray.elevation = 'bspline'",
            "mode = 'sr'\nsurface.window = [0.3, 0.9]\nsurface.threshold = 0.2",
        ] {
            let all = of(&geometry, mode);
            let (low, high) = insonified_box(&geometry);
            let radius = 0.22 * (high - low).min_element();
            let finds_surface = all.detects_surface();
            let (with, without) = (body(&all, true), body(&all, false));
            let ball = picture(&device, all.clone(), &without);
            let specks = picture(&device, all, &with);
            // Between the sizes of a speck and of the ball.
            let ball_size = 4.19 * radius.powi(3);
            let dropped = picture(&device, of(&geometry, &format!("{mode}\nfloating = {}", 0.25 * ball_size)), &with);
            match finds_surface {
                false => assert!(dropped == ball, "{name}, {mode}"),
                true => {
                    let [left, before] = [&dropped, &specks].map(|picture| lit_beside(picture, &ball));
                    assert!(left * 20 <= before, "{name}: {left} pixels of {before} are left");
                }
            }
            compared[usize::from(finds_surface)] += usize::from(specks != ball);
            // Larger than the ball: nothing is left.
            let nothing = picture(&device, of(&geometry, &format!("{mode}\nfloating = {}", 20.0 * ball_size)), &with);
            let empty = picture(&device, of(&geometry, mode), &body_frames(&of(&geometry, mode), |_| 0.1));
            assert!(nothing == empty, "{name}, {mode}");
        }
    }
    assert!(compared[0] > 10 && compared[1] > 1, "specks are seen in {compared:?} pictures only");
}

/// A frame that comes later joins a speck to the ball, or leaves one alone: what floats is found again, in all slices.
#[test]
fn what_floats_is_found_again_with_every_frame() {
    let device = Device::new();
    let geometry = Geometry::Sweep(wobbler());
    let (low, high) = insonified_box(&geometry);
    let size = 4.19 * (0.22 * (high - low).min_element()).powi(3);
    let scene = of(&geometry, &format!("mode = 'vr'\nfloating = {}", 0.25 * size));
    let with = body(&scene, true);
    let bright = body_frames(&scene, |_| 0.75);
    let mut renderer = rendered(&device, scene.clone(), &with);
    let first = renderer.picture().expect("picture");
    let middle = with.len() / 2;
    let mut joined = with.clone();
    joined[middle] = bright[middle].clone();
    // One frame alone: what floats changes in slices that no frame came for.
    let mut replace = |frame: &Texels| {
        let bytes = frame.encode(frame_format(renderer.scene()));
        renderer.frame(middle as u32, &bytes, 0).expect("a frame");
        renderer.show(0).expect("show");
        renderer.picture().expect("picture")
    };
    let second = replace(&joined[middle]);
    assert!(second == picture(&device, scene.clone(), &joined), "as of a volume that came at once");
    assert!(second != first);
    assert!(replace(&with[middle]) == first);
}

/// Another size finds other parts in the same volume: no frame is sent again.
#[test]
fn another_size_needs_no_frame_again() {
    let device = Device::new();
    let geometry = Geometry::Sweep(wobbler());
    let (low, high) = insonified_box(&geometry);
    let size = 4.19 * (0.22 * (high - low).min_element()).powi(3);
    let with = |share: f64| of(&geometry, &format!("mode = 'vr'\nfloating = {}", share * size));
    let frames = body(&with(0.25), true);
    let mut renderer: Renderer = rendered(&device, with(0.25), &frames);
    let few = renderer.picture().expect("picture");
    assert!(matches!(renderer.change(with(1e-4)).expect("change"), Rerun::Steps { .. }));
    let all = renderer.picture().expect("picture");
    assert!(all != few && all == picture(&device, of(&geometry, "mode = 'vr'"), &frames));
    assert!(matches!(renderer.change(with(0.25)).expect("change"), Rerun::Steps { .. }));
    assert!(renderer.picture().expect("picture") == few);
    assert!(renderer.read(Slot::Floating).expect("read").expect("there").values.iter().any(|v| *v > 0.5));
}

/// Planes beside a rendering show the echoes as they are, also those that the rendering drops.
#[test]
fn planes_beside_a_rendering_keep_what_floats() {
    let device = Device::new();
    let mut renderings_differ = 0;
    for (name, geometry) in geometries().into_iter().filter(|(name, _)| *name != "single frame") {
        let (low, high) = insonified_box(&geometry);
        let size = 4.19 * (0.22 * (high - low).min_element()).powi(3);
        let four = |more: &str| of(&geometry, &format!("mode = 'vr'\nlayout = 'four'\n{more}"));
        let frames = body(&four(""), true);
        let [all, dropped] =
            [String::new(), format!("floating = {}", 0.25 * size)].map(|more| picture(&device, four(&more), &frames));
        let differs = |is_rendering: bool| {
            let [width, height] = [all.width as usize, all.height as usize];
            let pixels =
                (0..width * height).filter(|n| (n % width >= width / 2 && n / width >= height / 2) == is_rendering);
            pixels.filter(|n| all.rgba[4 * n..4 * n + 4] != dropped.rgba[4 * n..4 * n + 4]).count()
        };
        assert_eq!(differs(false), 0, "{name}: planes");
        renderings_differ += differs(true);
    }
    // In the small rendering of some geometries the body hides what floats.
    assert!(renderings_differ > 0, "nothing is dropped");
}
