//! Filters whose sizes are in mm do the same to the body at any size of the picture and of the slices.

use crate::common::gpu::*;
use echolume::low_level::error_report::metrics;
use echolume::low_level::passes::Texels;
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::Geometry;
use glam::DVec3;

/// The mean of squares of pixels.
fn brought_down(picture: &Picture, by: usize) -> Texels {
    let [width, height] = [picture.width as usize / by, picture.height as usize / by];
    let at = |x: usize, y: usize, c: usize| f64::from(picture.rgba[4 * (y * picture.width as usize + x) + c]);
    let share = 255.0 * (by * by) as f64;
    Texels::from_fn([width, height, 1], 3, |[x, y, _], c| {
        (0..by * by).map(|n| at(by * x + n % by, by * y + n / by, c)).sum::<f64>() / share
    })
}

/// A face of bumps with speckle in its echo.
fn body(p: DVec3) -> f64 {
    let cell = (p * 2.0).floor();
    let bits = (cell.x as i64).wrapping_mul(73_856_093) ^ (cell.y as i64).wrapping_mul(19_349_663);
    let speckle = Noise((bits ^ (cell.z as i64).wrapping_mul(83_492_791)) as u64 | 1).next();
    let surface = 40.0 + 2.5 * (0.5 * p.x).sin() * (0.45 * p.z).cos();
    (0.75 + 0.25 * speckle) / (1.0 + (-1.5 * (p.y - surface)).exp())
}

/// Mean difference of two pictures in levels, and SSIM.
fn apart(a: &Texels, b: &Texels) -> (f64, f64) {
    let sum: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).sum();
    let errors = metrics::pictures(a, b).expect("pictures of one size");
    (255.0 * sum / a.values.len() as f64, errors.ssim.expect("a window fits"))
}

#[test]
fn a_large_picture_brought_down_equals_a_small_one() {
    let device = Device::new();
    let picture = |size: u32, filters: &str| {
        let toml = format!(
            "mode = 'sr'\npicture.size = [{size}, {size}]\nslices = {{ pixels = 192, smooth = {{ lateral = 0.5, depth = 0.5, elevation_mm = 1.5 }} }}
             surface = {{ threshold = 0.1, edge = 3 }}\nray.step = 0.6\nlight = {{ shadow = {{}}, occlusion = {{}} }}\n{filters}"
        );
        let scene = scene(Geometry::Sweep(wobbler()), BYTES, &toml);
        let frames = body_frames(&scene, body);
        let sizes: Vec<String> = scene.resolved_sizes.iter().map(|size| size.to_string()).collect();
        (rendered(&device, scene, &frames).picture().expect("picture"), sizes)
    };
    let mm = "distance = { median_mm = 0.9, bilateral = { mm = 0.5, distance = 2 } }";
    // As many pixels as these are of the small picture.
    let pixels = "distance = { median = 5, bilateral = { pixels = 2.44, distance = 2 } }";
    let mut figures = Vec::new();
    for filters in [mm, pixels] {
        let ((small, sizes), (large, large_sizes)) = (picture(384, filters), picture(1536, filters));
        let (mean, ssim) = apart(&brought_down(&large, 4), &brought_down(&small, 1));
        println!(
            "{filters}: a mean of {mean:.2} levels, SSIM {ssim:.4}\n{}\n{}",
            sizes.join("\n"),
            large_sizes.join("\n")
        );
        figures.push((mean, ssim));
    }
    let (mean, ssim) = figures[0];
    assert!(mean <= 4.0 && ssim >= 0.95, "{mean} levels, {ssim}");
    for (names, (mean, ssim)) in [["mm-levels", "mm-ssim"], ["pixels-levels", "pixels-ssim"]].iter().zip(&figures) {
        device.figure(names[0], &format!("{mean:.2}"));
        device.figure(names[1], &format!("{ssim:.3}"));
    }
    assert!(figures[1].1 < ssim, "sizes in pixels change the picture more: {figures:?}");
}
