//! Sampling across elevation: how much the slope of a surface ripples between slices.

use crate::common::gpu::*;
use crate::detector_convergence::normal_distribution;
use echolume::low_level::passes::{Slot, is_hit};
use echolume::low_level::probe::{Geometry, Grid};
use glam::DVec3;

/// Distance of two slices, mm.
const PITCH: f64 = 2.4;

/// Root mean square of the difference of the slope of a wall along elevation from its true slope, degrees. The wall is tilted by `tilt` degrees and its
/// echo rises like an error function of deviation 1.2 mm across it.
fn ripple(device: &Device, tilt: f64, settings: &str) -> f64 {
    let grid = Grid { size: [8, 160, 17], spacing: [0.5, 0.25, PITCH], origin: [-1.75, 0.0, -8.0 * PITCH] };
    let toml = format!(
        "mode = 'sr'\npicture = {{ size = [8, 256] }}\nregion = {{ elevation = [-13, 13], lateral = [-0.5, 0.5] }}
         slices.format = 'r32f'\nsurface = {{ threshold = 0.05, edge = 3 }}\n{settings}"
    );
    let scene = scene(Geometry::Cartesian(grid), FLOATS, &toml);
    let (sin, cos) = tilt.to_radians().sin_cos();
    let wall = |p: DVec3| normal_distribution(((p.y - 20.0) * cos - p.z * sin) / 1.2);
    let mut renderer = rendered(device, scene.clone(), &body_frames(&scene, wall));
    renderer.picture().expect("picture");
    let map = renderer.read(Slot::Distance).expect("read").expect("there");
    // (elevation, depth) of the surface, row by row.
    let places: Vec<[f64; 2]> = (0..map.size[1])
        .filter(|y| is_hit(map.one(4, *y, 0)))
        .map(|y| {
            let (origin, direction) = scene.rays.at(4.5, y as f64 + 0.5);
            let place = origin + direction * map.one(4, y, 0);
            [place.z, place.y]
        })
        .filter(|[z, _]| z.abs() < 4.0 * PITCH)
        .collect();
    assert!(places.len() > 150, "{} places", places.len());
    // Over two pixels, a tenth of a slice.
    let slope = |w: &[[f64; 2]]| (w[w.len() - 1][1] - w[0][1]) / (w[w.len() - 1][0] - w[0][0]);
    let slopes: Vec<f64> = places.windows(3).map(|w| slope(w).atan().to_degrees() - tilt).collect();
    // Interpolation moves no wall as a whole.
    let whole = slope(&places).atan().to_degrees();
    assert!((whole - tilt).abs() < 0.5, "{settings}: the wall stands at {whole} degrees");
    (slopes.iter().map(|s| s * s).sum::<f64>() / slopes.len() as f64).sqrt()
}

/// The normal of a surface, and with it its light, changes from slice to slice where samples between them are interpolated linearly: bands
/// across a face.
#[test]
fn the_slope_of_a_tilted_wall_ripples_half_as_much_with_the_bspline() {
    let device = Device::new();
    let mut ratios = Vec::new();
    for sampling in ["exact", "hardware"] {
        for tilt in [10.0, 20.0, 35.0, 50.0] {
            for (smooth, sharp) in [("", tilt < 40.0), ("slices.smooth = { elevation = 0.8 }", false)] {
                // At 50 degrees an edge moves from slice to slice by 1.5 times its width: there sharpening brings steps back.
                let of = |elevation: &str| {
                    let ray = format!("ray = {{ step = 0.1, sampling = '{sampling}', elevation = '{elevation}' }}");
                    ripple(&device, tilt, &format!("{smooth}\n{ray}"))
                };
                let (linear, bspline) = (of("linear"), of("bspline"));
                println!("{sampling}, {tilt} deg, {smooth}: {linear:.4} deg linear, {bspline:.4} B-spline");
                assert!(bspline <= 0.5 * linear, "{sampling}, {tilt} deg, {smooth}: {bspline} of {linear}");
                ratios.push(bspline / linear);
                if sharp {
                    let sharp = of("bspline-sharp");
                    println!("{sampling}, {tilt} deg: {sharp:.4} sharpened B-spline");
                    assert!(sharp <= 0.5 * linear, "{sampling}, {tilt} deg: {sharp} of {linear}");
                }
            }
        }
    }
    device.figure("ripple-least", &format!("{:.2}", ratios.iter().copied().fold(f64::MAX, f64::min)));
    device.figure("ripple-most", &format!("{:.2}", ratios.iter().copied().fold(0.0, f64::max)));
}
