//! A few stored pictures, made by the f64 reference, so that no driver is the truth. `tools/goldens` regenerates them.

use crate::common::gpu::*;
use echolume::low_level::passes::{Slot, Texels};
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::{Advance, Geometry, Probe};
use echolume::low_level::reference;
use echolume::low_level::scene::Scene;
use glam::DVec3;
use std::path::PathBuf;

/// Name, scene, frames: a ball with a knob behind a wall.
fn goldens() -> Vec<(&'static str, Scene, Vec<Texels>)> {
    let body = |p: DVec3| {
        let ball = ((9.0 - p.distance(DVec3::new(1.0, 52.0, 0.0))) / 2.0 + 0.5).clamp(0.0, 1.0);
        let knob = ((2.5 - p.distance(DVec3::new(3.0, 43.5, 2.0))) / 2.0 + 0.5).clamp(0.0, 1.0);
        0.1 + 0.8 * ball.max(knob)
    };
    let probe = Probe { advance: Advance::Same(0.03), ..wobbler() };
    let all = "slices = { pixels = 96, median = true, smooth = { lateral = 0.8, depth = 0.8, elevation = 0.5 } }
        picture = { size = [96, 80] }
        ray = { step = 0.5, sampling = 'exact' }
        distance = { median = 3, bilateral = { pixels = 1.5, distance = 2.0 } }
        post = { sigma = { window = 3, sigma = 0.05 }, gamma = 1.3 }";
    let mut goldens = Vec::new();
    for (name, geometry, mode, more) in [
        (
            "fan-surface",
            Geometry::Sweep(probe.clone()),
            "sr",
            "surface = { threshold = 0.15, edge = 2 }\ncamera = { azimuth = 15, elevation = 10, field_of_view = 25, zoom = 3.2, target = [1.0, 32.0, 0.0] }",
        ),
        (
            "fan-volume",
            Geometry::Sweep(probe),
            "vr",
            "volume = { transfer = 'skin' }\ncamera = { azimuth = -30, zoom = 2.5, target = [1.0, 32.0, 0.0] }",
        ),
        (
            "cartesian-surface",
            cartesian([32, 40, 16]),
            "sr",
            "surface = { threshold = 0.15, edge = 2 }\ncamera = { azimuth = 15, elevation = 10 }",
        ),
    ] {
        let scene = scene(geometry, FLOATS, &format!("mode = '{mode}'\n{all}\n{more}"));
        let frames = match &scene.geometry {
            Geometry::Sweep(_) => body_frames(&scene, body),
            Geometry::Cartesian(_) => body_frames(&scene, |p| body(p * 2.0 + DVec3::new(-3.0, 36.0, 0.0))),
        };
        goldens.push((name, scene, frames));
    }
    goldens
}

fn file(name: &str) -> PathBuf {
    repository("tests/goldens").join(format!("{name}.png"))
}

#[test]
fn pictures_match_the_goldens_of_the_reference() {
    let device = Device::new();
    for (name, scene, frames) in goldens() {
        let expected = as_picture(&reference::render(&scene, &frames)[&Slot::Screen]);
        if std::env::var_os("ECHOLUME_MAKE_GOLDENS").is_some() {
            std::fs::create_dir_all(file(name).parent().expect("folder")).expect("folder");
            expected.save(&file(name)).expect("saved");
        }
        // A missing file is a failure.
        let stored = Picture::load(&file(name)).expect("golden");
        let (_, largest) = difference(&expected, &stored);
        assert!(
            largest <= 1.0,
            "{name}: the reference is off its own picture by {largest}; run tools/goldens if it should be"
        );
        let got = rendered(&device, scene, &frames).picture().expect("picture");
        let (mean, largest) = difference(&got, &stored);
        println!("{name}: mean difference {mean:.4}, largest {largest}");
        // About a level of rounding; the edge of a surface may move by a pixel at the threshold.
        if mean > 0.25 {
            let failed = std::env::temp_dir().join(format!("echolume-{name}"));
            got.save(&failed.with_extension("actual.png")).expect("saved");
            stored.save(&failed.with_extension("expected.png")).expect("saved");
            apart(&got, &stored).save(&failed.with_extension("difference.png")).expect("saved");
            panic!("{name}: mean difference {mean}, largest {largest}; pictures at {}.*.png", failed.display());
        }
    }
}

/// Differences, eight times as bright.
fn apart(a: &Picture, b: &Picture) -> Picture {
    let rgba = a.rgba.iter().zip(&b.rgba).map(|(a, b)| a.abs_diff(*b).saturating_mul(8)).collect();
    Picture { rgba, ..*a }
}
