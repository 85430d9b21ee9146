//! Filters of slices on the sector of a sweep: its border, and the artefacts of the pixel lattice on a tilted wall.

use crate::common::gpu::*;
use echolume::low_level::passes::{Slot, is_hit};
use echolume::low_level::probe::Geometry;

/// Outside the border there are no data, and no filter may use it: pixels repeat the nearest sample as far as the filters reach.
#[test]
fn no_filter_blends_the_sector_border_with_the_outside() {
    let device = Device::new();
    for (filters, tolerance) in [
        ("median = true, sigma = { window = 9, sigma = inf }", 0.0),
        ("estimator = 'nagao-matsuyama', enhanced_sigma = { window = 5, largest = 19, sigma = inf }", 0.0),
        ("smooth = { kernel = 5 }", 0.0),
        ("blur = true", 0.0),
        // Diffusion without edges has an unlimited reach: 0.13 % comes from more than three standard deviations away.
        ("perona_malik = { edge = inf, step = 0.25, repeat = 40 }", 0.6 * 0.0014),
        // An implicit step spreads as a two-sided exponential: the sum of eight has an excess kurtosis of 3/8, and 0.19 % there.
        ("perona_malik = { edge = inf, scheme = 'aos', step = 5.0, repeat = 8 }", 0.6 * 0.002),
        ("perona_malik = { edge = 0.1, scheme = 'aos', step = 5.0, repeat = 8 }", 0.6 * 0.002),
    ] {
        let toml = format!(
            "mode = 'vr'\npicture = {{ size = [8, 8] }}\nslices = {{ pixels = 180, format = 'r32f', {filters} }}\nray = {{ sampling = 'exact' }}"
        );
        let scene = scene(Geometry::Sweep(wobbler()), FLOATS, &toml);
        let frames = frames(&scene, |_| 0.6);
        let mut renderer = rendered(&device, scene.clone(), &frames);
        renderer.picture().expect("picture");
        let volume = renderer.read(Slot::Volume).expect("read").expect("there");
        let (mut inside, mut worst) = (0, 0.0f64);
        for row in 0..volume.size[1] {
            for column in 0..volume.size[0] {
                let (x, y) = scene.grid.place(column as f64, row as f64);
                let (r, angle) = (x.hypot(y), x.atan2(y).abs());
                if (22.0..=22.0 + 63.0 * 0.8).contains(&r) && angle <= 0.05 * 11.5 {
                    worst = worst.max((volume.one(column, row, 4) - 0.6).abs());
                    inside += 1;
                }
            }
        }
        assert!(inside > 8000, "{inside}");
        println!("{filters}: {worst:.1e}");
        assert!(worst <= tolerance + 1e-6, "{filters}: the rim is {worst} off");
    }
}

/// An oblique wall in SR: the root mean square of its distances less the plane through them, mm.
fn ripple(device: &Device, slices: &str) -> f64 {
    let mut probe = wobbler();
    probe.lines = echolume::low_level::probe::Axis::centred(1.1 / 127.0, 128);
    probe.slices = echolume::low_level::probe::Axis::centred(0.8 / 60.0, 61);
    probe.sample_pitch = 0.4;
    probe.samples = 160;
    let toml = format!(
        "mode = 'sr'\npicture = {{ size = [96, 96] }}\nray = {{ step = 0.2 }}\nsurface = {{ threshold = 0.2, edge = 0.8 }}\n\
         camera = {{ zoom = 4.0, target = [0, 30, 0] }}\nslices = {{ pixels = 160, {slices} }}"
    );
    let scene = scene(Geometry::Sweep(probe), FLOATS, &toml);
    // A sharp edge: only the artefacts of the lattice remain.
    let frames = body_frames(&scene, |p| if p.y > 50.0 + 0.31 * p.x + 0.12 * p.z { 0.8 } else { 0.0 });
    let mut renderer = rendered(device, scene, &frames);
    renderer.picture().expect("picture");
    let map = renderer.read(Slot::Distance).expect("read").expect("there");
    let at = |x: usize, y: usize| (x as f64 / 47.5 - 1.0, y as f64 / 47.5 - 1.0, map.one(x, y, 0));
    let points: Vec<_> = (0..96).flat_map(|y| (0..96).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
    assert!(points.iter().all(|p| is_hit(p.2)), "a hole in the wall");
    // Least squares: x, y and 1 are orthogonal over the picture.
    let n = points.len() as f64;
    let mean = points.iter().map(|p| p.2).sum::<f64>() / n;
    let along = |f: &dyn Fn(&(f64, f64, f64)) -> f64| {
        points.iter().map(|p| f(p) * p.2).sum::<f64>() / points.iter().map(|p| f(p) * f(p)).sum::<f64>()
    };
    let (a, b) = (along(&|p| p.0), along(&|p| p.1));
    (points.iter().map(|p| (p.2 - mean - a * p.0 - b * p.1).powi(2)).sum::<f64>() / n).sqrt()
}

/// Thesis Fig. 32, 33.
#[test]
fn a_slight_blur_removes_wood_grain_artefacts() {
    let device = Device::new();
    let [plain, blurred, three, five] =
        ["", "blur = true", "smooth = { kernel = 3 }", "smooth = { kernel = 5 }"].map(|slices| ripple(&device, slices));
    println!("wood grain {plain:.4} mm, blurred {blurred:.4}, 3x3x3 {three:.4}, 5x5x5 {five:.4}");
    assert!(plain > 0.02, "there is grain: {plain} mm");
    for (name, grain) in [("grain", plain), ("grain-blur", blurred), ("grain-3", three), ("grain-5", five)] {
        device.figure(name, &format!("{grain:.3}"));
    }
    assert!(blurred < 0.8 * plain, "{blurred} of {plain} mm");
    assert!(five < three && three < plain, "{five}, {three}, {plain} mm");
}
