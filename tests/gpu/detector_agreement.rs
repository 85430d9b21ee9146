//! The detector that chooses among neighbouring rays: false surfaces and lost walls in noise and speckle, outlines, and the shader against its reference.

use crate::common::gpu::*;
use crate::detector::{STEP, columns, depths, ramp};
use crate::detector_false_positives::{DEPTH, Found, noisy, normal, speckle, walls, walls_of};

/// Two layers in noise: one of 8 steps, and 8 steps behind it a brighter one. A ray that takes the second has lost the first.
fn layers(noise: &mut Noise, deviation: f64) -> (Vec<f64>, f64) {
    let edge = 60.0 + noise.next();
    let value = |x: f64| 0.6 * (ramp(x, edge, 2.0) - ramp(x, edge + 8.0, 2.0)) + ramp(x, edge + 16.0, 2.0);
    ((0..DEPTH).map(|i| (value(i as f64) + deviation * normal(noise)).clamp(0.0, 1.0)).collect(), edge)
}

/// Prevents a choice among neighbours without an advantage: of the rays on which the adaptive detector is early or takes none or a second layer, at most a third.
#[test]
fn neighbours_have_a_third_of_the_false_surfaces() {
    let device = Device::new();
    type Make<'a> = &'a dyn Fn(&mut Noise) -> (Vec<f64>, f64);
    let cases: [(&str, Make); 8] = [
        ("no noise", &|n| noisy(n, 0.0, 0.0, 1.0)),
        ("noise of 0.1", &|n| noisy(n, 0.1, 0.0, 1.0)),
        ("noise of 0.2", &|n| noisy(n, 0.2, 0.0, 1.0)),
        ("noise of 0.1, a third of the height", &|n| noisy(n, 0.1, 0.2, 0.3)),
        ("two layers, noise of 0.1", &|n| layers(n, 0.1)),
        ("two layers, noise of 0.2", &|n| layers(n, 0.2)),
        ("speckle of 1.5 samples", &|n| speckle(n, 1.5, 1)),
        ("smoothed speckle of 3 samples", &|n| speckle(n, 3.0, 4)),
    ];
    for (name, make) in cases {
        let columns = walls_of(23, make);
        let by = |detector: &str| {
            let found = walls(&device, &format!("detector = '{detector}'\nthreshold = 0.1"), &columns);
            println!("{name}, {detector}: {found:.4?}");
            found
        };
        let (adaptive, consistent) = (by("adaptive"), by("consistent"));
        let what = format!("{name}: {adaptive:?}, {consistent:?}");
        let wrong = |found: &Found| found.early + found.missed;
        assert!(wrong(&consistent) <= wrong(&adaptive) / 3.0 + 0.001, "no better, {what}");
        assert!(consistent.missed <= 1.1 * adaptive.missed + 0.001, "walls are lost, {what}");
        assert!(consistent.steps <= 1.1 * adaptive.steps + 0.01, "placed worse, {what}");
    }
}

/// Prevents outlines that neighbours blur: a plate in front of a wall with a hole in it, noise of 0.1.
#[test]
fn outlines_stay_where_they_are() {
    let device = Device::new();
    let scene = columns([48, 120, 48], STEP, "detector = 'consistent'\nthreshold = 0.1");
    let mut noise = Noise(5);
    let noise: Vec<f64> = (0..48 * 120 * 48).map(|_| 0.1 * normal(&mut noise)).collect();
    // The plate is 10 steps thick; the hole has no wall behind it.
    let plate = |x: usize| (8..24).contains(&x);
    let hole = |x: usize, z: usize| (30..42).contains(&x) && (10..30).contains(&z);
    let frames = frames(&scene, |[x, y, z]| {
        let at = y as f64;
        let tissue = match (plate(x), hole(x, z)) {
            (true, _) => ramp(at, 40.0, 2.0) - ramp(at, 50.0, 2.0) + ramp(at, 80.0, 2.0),
            (_, true) => 0.0,
            _ => ramp(at, 80.0, 2.0),
        };
        (tissue + noise[(z * 120 + y) * 48 + x]).clamp(0.0, 1.0)
    });
    let wrong: Vec<_> = depths(&device, &scene, &frames)
        .into_iter()
        .filter(|([x, z], found)| match found {
            None => !hole(*x, *z),
            Some(_) if hole(*x, *z) => true,
            Some(d) => (d / STEP - if plate(*x) { 40.0 } else { 80.0 }).abs() > 3.0,
        })
        .collect();
    println!("{} of {} rays are wrong: {wrong:?}", wrong.len(), 48 * 48);
    assert!(wrong.len() <= 12, "{wrong:?}");
}
