//! The simulated wobbler's head against the surface that the simulator was given (tests/data/wobbler-4dc7/sweep.json).

use crate::common::*;
use echolume::gpu::{Options, Renderer};
use echolume::passes::chain::distance_end;
use echolume::passes::{Texels, is_hit};
use echolume::scene::{Input, Scene, Settings};
use echolume::source::Recording;
use glam::DVec3;

/// Parallel rays along the depth axis. The window begins above the speckle of the fluid, the rays below the wall; the Gaussian
/// is 0.8 frames, 1.5 lines and 2.5 samples at the head.
const SETTINGS: &str = "mode = 'sr'
    picture = { size = [512, 512] }
    slices = { smooth = { lateral = 1.4, depth = 0.63, elevation = 0.8 } }
    region = { depth = [24, 99] }
    surface = { window = [0.63, 1.0], threshold = 0.08 }
    ray = { step = 0.4 }
    distance = { median = 11, bilateral = { pixels = 8, distance = 2 } }";

/// Lateral, elevation of the five wires, mm.
const WIRES: [[f64; 2]; 5] = [[0.0, 0.0], [20.0, 0.0], [-20.0, 0.0], [0.0, 12.0], [0.0, -12.0]];

/// 0 on the head's surface, negative inside; (lateral, depth, elevation) in mm from the motor's axis.
fn level(place: DVec3) -> f64 {
    let q = (place - DVec3::new(4.0, 95.0, -3.0)) / DVec3::new(26.0, 26.0, 22.0);
    let u = q.normalize();
    let bump = |x: f64, z: f64| (-((u.x - x).powi(2) + (u.z - z).powi(2)) / 0.02).exp();
    let radius = 1.0 + 0.22 * bump(-0.05, 0.05) - 0.12 * bump(0.38, 0.30) - 0.12 * bump(-0.48, 0.30);
    q.length() / radius - 1.0
}

/// Depth at which a ray along the depth axis meets the head, and the cosine between the ray and the surface's normal.
fn truth(lateral: f64, elevation: f64) -> Option<(f64, f64)> {
    let at = |depth: f64| level(DVec3::new(lateral, depth, elevation));
    let first = (0..800).map(|i| 55.0 + 0.05 * f64::from(i)).find(|depth| at(*depth) <= 0.0)?;
    let (mut outside, mut inside) = (first - 0.05, first);
    for _ in 0..40 {
        let middle = (outside + inside) / 2.0;
        if at(middle) > 0.0 { outside = middle } else { inside = middle }
    }
    let place = DVec3::new(lateral, inside, elevation);
    let slope = |step: DVec3| (level(place + step) - level(place - step)) / 2e-4;
    let gradient = DVec3::new(slope(DVec3::X * 1e-4), slope(DVec3::Y * 1e-4), slope(DVec3::Z * 1e-4));
    Some((inside, -gradient.y / gradient.length()))
}

struct Errors {
    hits: f64,
    /// Share of hits more than 3 mm off.
    off: f64,
    median: f64,
    /// After subtracting the median.
    rms: f64,
}

/// Over all rays that meet the surface within 45 deg of its normal and 4 mm or more beside a wire. A side of -1 mirrors the
/// truth in lateral or elevation.
fn errors(scene: &Scene, distances: &Texels, sides: [f64; 2]) -> Errors {
    let axis = scene.probe().expect("a sweep").axis_depth();
    let (mut rays, mut errors) = (0.0, Vec::new());
    for y in 0..distances.size[1] {
        for x in 0..distances.size[0] {
            let (origin, direction) = scene.rays.at(x as f64 + 0.5, y as f64 + 0.5);
            assert!((direction - DVec3::Y).length() < 1e-12);
            if WIRES.iter().any(|w| (w[0] - origin.x).hypot(w[1] - origin.z) < 4.0) {
                continue;
            }
            let Some((depth, cosine)) = truth(sides[0] * origin.x, sides[1] * origin.z) else { continue };
            if cosine < std::f64::consts::FRAC_1_SQRT_2 {
                continue;
            }
            rays += 1.0;
            let distance = distances.one(x, y, 0);
            if is_hit(distance) {
                errors.push(origin.y + distance - axis - depth);
            }
        }
    }
    assert!(rays > 3000.0, "{rays} rays meet the head");
    errors.sort_by(f64::total_cmp);
    let count = errors.len() as f64;
    let median = errors[errors.len() / 2];
    Errors {
        hits: count / rays,
        off: errors.iter().filter(|e| e.abs() > 3.0).count() as f64 / count,
        median,
        rms: (errors.iter().map(|e| (e - median).powi(2)).sum::<f64>() / count).sqrt(),
    }
}

#[test]
fn the_wobblers_head_lies_where_the_simulator_put_it() {
    let device = Device::new();
    let mut recording = Recording::open(&data("wobbler-4dc7/sweep.mha"), None).expect("recording");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let settings: Settings = toml::from_str(SETTINGS).expect("settings");
    let scene = Scene::new(recording.geometry(0), input, settings).expect("scene");
    let mut renderer = Renderer::new(&device, scene.clone(), &Options::default()).expect("renderer");
    while let Some(frame) = recording.next_frame().expect("frame") {
        renderer.frame(frame.slice as u32, &frame.bytes, 0).expect("frame");
    }
    renderer.show(0).expect("show");
    renderer.picture().expect("picture");
    let distances = renderer.read(distance_end(&scene)).expect("read").expect("there");
    let Errors { hits, off, median, rms } = errors(&scene, &distances, [1.0, 1.0]);
    println!("head: {:.2} % hit, {:.2} % off, median {median:.3} mm, RMS {rms:.3} mm", 100.0 * hits, 100.0 * off);
    assert!(hits >= 0.97, "{hits}");
    assert!(off <= 0.01, "{off}");
    assert!(rms <= 0.6, "{rms}");
    // The echo begins before the surface by about half a pulse, and the Gaussian spreads it further.
    assert!(median.abs() < 1.2, "{median}");
    for (name, sides) in [("lateral", [-1.0, 1.0]), ("elevation", [1.0, -1.0])] {
        let mirrored = errors(&scene, &distances, sides);
        println!("mirrored in {name}: RMS {:.2} mm", mirrored.rms);
        assert!(mirrored.rms > 2.0, "mirrored in {name} went unnoticed: {}", mirrored.rms);
    }
}
