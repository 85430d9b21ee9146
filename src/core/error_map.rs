//! A map of the error that the step along rays leaves in a picture: for each pixel the difference from the picture of half the step. For a
//! rule of order 1 this is half of the error, for order 2 three quarters of it. Both pictures have the same `ray.early_end`, tables,
//! formats and bricks, so the map does not show the errors of these.

use crate::passes::Texels;
use crate::picture::Picture;
use crate::scene::{Edge, EdgeName, Mode, Scene};

/// The smallest and the largest difference, in values of 0..1, that have colours of their own; the scale between them is logarithmic.
pub const SCALE: [f64; 2] = [1e-4, 1.0];

/// Pixels between two lines of the hatching.
const HATCH: usize = 6;

/// Colours of evenly rising lightness (CIE L* 8, 30, 52, 74, 95), from nearly black over violet and orange to pale yellow: they are
/// told apart in grey as well.
const COLOURS: [[f64; 3]; 5] =
    [[0.07, 0.08, 0.17], [0.41, 0.15, 0.46], [0.80, 0.33, 0.38], [0.97, 0.64, 0.35], [0.99, 0.95, 0.75]];

/// A picture of the error of each pixel, with statistics. The error of a pixel is the largest difference of red, green and blue (0..1) between the
/// picture and one with half the step.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorMap {
    pub picture: Picture,
    /// Root mean square of the errors of all pixels; `largest` is the largest error of any pixel. Both in 0..1.
    pub rms: f64,
    pub largest: f64,
    /// Share (0..1) of the pixels whose error exceeds the tolerance.
    pub share_above: f64,
}

/// Why the difference from a picture with a shorter step does not show the error of the step along rays, and what to set instead: there are no steps,
/// other settings choose them, or the step is part of a filter. The text follows a colon. None if a shorter step makes the picture more accurate.
pub fn step_fault(scene: &Scene) -> Option<&'static str> {
    let settings = &scene.settings;
    if scene.is_flat() || settings.mode == Mode::Cube || scene.still().is_some() {
        return Some("this mode takes no steps along rays: set mode to volume, surface, mixed, mip, minip or mean");
    }
    if scene.tolerance().is_some() {
        return Some("ray.tolerance chooses the steps of each pixel, and states their error: set ray.tolerance=0");
    }
    if settings.ray.sliding != 0 {
        return Some(
            "ray.sliding filters samples at distances of one step, so that another step is another filter: set ray.sliding=0",
        );
    }
    let has_edges = scene.detects_surface() || scene.has_caps();
    let counts_steps = settings.surface.edge == Some(Edge::Named(EdgeName::Samples));
    (has_edges && counts_steps).then_some(
        "surface.edge=samples is four steps long, so that another step looks for other edges: set surface.edge to a length in mm",
    )
}

/// The scene with half the step along rays. If the scene shows surfaces and composites no volume, the new step is half the step of the surface
/// detector, which may be shorter than `ray.step`.
///
/// # Errors
/// The reason why half the step tells nothing about the error of this picture, and what to set instead (the text follows a colon), or a fault of the
/// new settings.
pub fn finer(scene: &Scene) -> Result<Scene, String> {
    if let Some(why) = step_fault(scene) {
        return Err(why.into());
    }
    let is_surface_alone = scene.detects_surface() && !scene.composites();
    let mut settings = scene.settings.clone();
    settings.ray.step = Some(if is_surface_alone { scene.ring.step } else { scene.step } / 2.0);
    // An edge that is not set is four slice pixels long at any step.
    let finer = Scene::new(scene.geometry.clone(), scene.input, settings).map_err(|e| e.to_string())?;
    if scene.detects_surface() && finer.ring.half == scene.ring.half {
        let (step, ring) = (scene.step, scene.ring);
        let edge = ring.step * f64::from(ring.half);
        return Err(match step > ring.step {
            true => format!(
                "surfaces are found in steps of {:.4} mm, a quarter of their edges, whether ray.step is {step:.4} mm or half of it: set \
                 ray.step={:.4}",
                ring.step,
                edge / 4.0
            ),
            false => format!(
                "surface.edge={edge:.4} mm already has the most samples, {}: set a longer ray.step, {:.4} at least",
                ring.half,
                2.0 * ring.step
            ),
        });
    }
    Ok(finer)
}

/// Draws the error of each pixel as a colour, hatched where it exceeds `tolerance` (0..1). The error is the largest difference of red, green and blue
/// between both pictures.
///
/// # Errors
/// One line: the pictures differ in size or in their number of channels, or have fewer than 3 channels.
pub fn error_map(picture: &Texels, finer: &Texels, tolerance: f64) -> Result<ErrorMap, String> {
    if picture.size != finer.size || picture.channels != finer.channels || picture.channels < 3 {
        return Err(format!("error map: {:?} and {:?} cannot be compared", picture.size, finer.size));
    }
    let channels = picture.channels;
    let pairs = picture.values.chunks_exact(channels).zip(finer.values.chunks_exact(channels));
    let differences: Vec<f64> = pairs.map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)).collect();
    let [width, height, _] = picture.size;
    let mut rgba = Vec::with_capacity(4 * differences.len());
    for (n, difference) in differences.iter().enumerate() {
        let (x, y) = (n % width.max(1), n / width.max(1));
        let hatched = *difference > tolerance && (x + y) % HATCH < 2;
        let colour = colour(*difference);
        // White lines on dark colours, black ones on light colours.
        let line = if colour[1] < 0.5 { 1.0 } else { 0.0 };
        rgba.extend(colour.map(|c| ((if hatched { line } else { c }) * 255.0_f64).round() as u8));
        rgba.push(255);
    }
    let count = differences.len().max(1) as f64;
    Ok(ErrorMap {
        picture: Picture { width: width as u32, height: height as u32, rgba },
        rms: (differences.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
        largest: differences.iter().copied().fold(0.0, f64::max),
        share_above: differences.iter().filter(|d| **d > tolerance).count() as f64 / count,
    })
}

/// The colour of a difference: linear between the colours over its logarithm.
fn colour(difference: f64) -> [f64; 3] {
    let [least, most] = SCALE;
    let share = (difference.max(least) / least).ln() / (most / least).ln();
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let n = (at as usize).min(COLOURS.len() - 2);
    std::array::from_fn(|c| COLOURS[n][c] + (COLOURS[n + 1][c] - COLOURS[n][c]) * (at - n as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::test_block::block;

    /// Lightness of CIELAB over sRGB (IEC 61966-2-1).
    fn lightness([r, g, b]: [f64; 3]) -> f64 {
        let linear = |c: f64| if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        let y = 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    #[test]
    fn colours_rise_evenly_in_lightness() {
        let steps: Vec<f64> = COLOURS.map(lightness).windows(2).map(|p| p[1] - p[0]).collect();
        assert!(steps.iter().all(|s| (15.0..30.0).contains(s)), "{:?} rises by {steps:?}", COLOURS.map(lightness));
    }

    fn scene(assignments: &str) -> Scene {
        block(&assignments.split_whitespace().collect::<Vec<_>>(), [20; 3])
    }

    /// Prevents a map of the difference of two different pictures, and one that is black because both pictures are the same.
    #[test]
    fn half_the_step_halves_the_step_of_what_is_shown_or_is_refused() {
        for (set, step) in [("", 0.5), ("ray.step=0.8", 0.4), ("ray.samples_per_voxel=4", 0.125), ("ray.step=3", 1.5)] {
            let of = |mode: &str| finer(&scene(&format!("mode={mode} {set}"))).expect("a finer scene");
            assert!((of("volume").step - step).abs() < 1e-12 && (of("mip").step - step).abs() < 1e-12, "{set}");
            // The detector takes a quarter of an edge of 4 mm at most.
            let (coarse, fine) = (scene(&format!("mode=surface {set}")), of("surface"));
            assert!(fine.ring.half >= 2 * coarse.ring.half - 1 && fine.ring.half > coarse.ring.half, "{set}");
            let edge = |scene: &Scene| scene.ring.step * f64::from(scene.ring.half);
            assert!((edge(&coarse) - edge(&fine)).abs() < 1e-12, "{set}: another edge");
        }
        let clip = "clip=[{at=[10,10,10],normal=[0,0,1]}]";
        for (set, named) in [
            ("mode=plane".to_string(), "no steps"),
            ("mode=cube".into(), "no steps"),
            ("mode=volume still={}".into(), "no steps"),
            ("mode=volume ray.sliding=3".into(), "ray.sliding=0"),
            ("mode=surface surface.edge=samples".into(), "surface.edge"),
            (format!("mode=volume surface.edge=samples {clip}"), "surface.edge"),
            ("mode=mixed ray.step=3".into(), "ray.step=1.0000"),
            ("mode=surface surface.edge=4 ray.step=0.01".into(), "ray.step"),
        ] {
            let said = finer(&scene(&set)).expect_err(&set);
            assert!(said.contains(named) && said.contains("set ") && !said.contains('\n'), "{set}: {said}");
        }
        assert!(finer(&scene(&format!("mode=volume surface.edge=samples {clip} cap.enabled=false"))).is_ok());
    }

    #[test]
    fn differences_become_colours_and_hatching_above_the_tolerance_alone() {
        let flat = |v: f64| Texels { size: [12, 12, 1], channels: 4, values: [v, 0.5, 0.5, 1.0].repeat(144) };
        let colours = |map: &ErrorMap| {
            let mut all: Vec<_> = map.picture.rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
            all.sort();
            all.dedup();
            all
        };
        let below = error_map(&flat(0.2), &flat(0.204), 0.01).expect("same size");
        assert_eq!((colours(&below).len(), below.share_above), (1, 0.0));
        assert!((below.rms - 0.004).abs() < 1e-15 && (below.largest - 0.004).abs() < 1e-15);
        let above = error_map(&flat(0.2), &flat(0.25), 0.01).expect("same size");
        assert_eq!((colours(&above).len(), above.share_above), (2, 1.0));
        let none = error_map(&flat(0.2), &flat(0.2), 0.01).expect("same size");
        assert_eq!(colours(&none), [COLOURS[0].map(|c| (c * 255.0).round() as u8)]);
        let small = Texels { size: [1, 1, 1], channels: 4, values: vec![0.0; 4] };
        assert!(error_map(&flat(0.2), &small, 0.01).is_err());
    }
}
