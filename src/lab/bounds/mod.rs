//! Proven bounds of a picture in volume mode: for every ray and channel an interval that contains the exact integral of the sampled field
//! (docs/numerics.md, "The exact reference of a ray"). All numbers are computed in interval arithmetic with outward rounding, so that the
//! bounds hold for any quadrature, step or rounding of a renderer.

pub mod field;
pub mod interval;
pub mod ray;

use crate::exact_ray::fade::Fade as Kinks;
use crate::exact_ray::volume::{Medium as Hints, cut};
use crate::exact_ray::{Line, segments};
use crate::passes::Texels;
use crate::passes::postprocess::toned;
use crate::passes::raycast::ray::span;
use crate::passes::raycast::volume::{depth_axis, reference_length};
use crate::scene::transfer::{self, Absorption};
use crate::scene::{ColourMap, Mode, Scene, Shading};
use glam::DVec3;
use interval::Interval;
use rayon::prelude::*;

/// When to stop refining the bounds of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// A ray is not refined further once its widest channel (upper less lower bound, 0..1) is at most this wide.
    pub width: f64,
    /// A ray is not refined further once it has this number of parts that are not surely transparent. Its first division, at the faces of cells and
    /// the points of the transfer function, may have more.
    pub parts: usize,
}

/// Proven bounds of the light of every ray of a picture.
#[derive(Clone, Debug)]
pub struct PictureBounds {
    /// Lower bounds of red, green, blue and opacity before stage 4 (postprocess), a texel for each ray; `high` has the upper bounds.
    pub low: Texels,
    pub high: Texels,
    /// Number of parts of all rays together, without those that are surely transparent.
    pub parts: u64,
}

impl PictureBounds {
    /// For each ray, row by row, the width, upper less lower bound, of its widest channel.
    pub fn widths(&self) -> Vec<f64> {
        let pairs = self.low.values.chunks_exact(4).zip(self.high.values.chunks_exact(4));
        pairs.map(|(low, high)| (0..4).map(|c| high[c] - low[c]).fold(0.0, f64::max)).collect()
    }

    /// The width, upper less lower bound, of the widest channel of each ray whose opacity may be above 0, row by row. Other rays have no entry.
    pub fn widths_of_hits(&self) -> Vec<f64> {
        let hits = self.high.values.chunks_exact(4).map(|high| high[3] > 0.0);
        self.widths().into_iter().zip(hits).filter(|(_, hit)| *hit).map(|(width, _)| width).collect()
    }
}

/// What the bounds prove about the error of a drawn pixel. The tolerance is that of [`proven`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proof {
    /// The error is within the tolerance.
    Kept,
    /// The error is beyond the tolerance.
    Broken,
    /// The bounds are too wide to tell.
    Open,
}

impl Proof {
    /// What an interval of red, green, blue and opacity before stage 4 proves of a drawn pixel. `tolerance`: levels of 255 after toning, of the worst
    /// channel.
    fn of(scene: &Scene, [r, g, b, opacity]: [Interval; 4], drawn: [f64; 4], tolerance: f64) -> Proof {
        let shown = |[r, g, b]: [f64; 3], opacity: f64| if opacity > 0.0 { toned(scene, [r, g, b]) } else { [0.0; 3] };
        let (low, high) = (toned(scene, [r.low, g.low, b.low]), shown([r.high, g.high, b.high], opacity.high));
        // Where there may be nothing, the screen may be black.
        let low = low.map(|value| if opacity.low <= 0.0 { value.min(0.0) } else { value });
        let drawn = shown([drawn[0], drawn[1], drawn[2]], drawn[3]);
        let worst = |of: &dyn Fn(usize) -> f64| (0..3).map(of).fold(f64::MIN, f64::max) * 255.0;
        let most = worst(&|c| (drawn[c] - low[c]).max(high[c] - drawn[c]));
        let least = worst(&|c| (low[c] - drawn[c]).max(drawn[c] - high[c]));
        match (most <= tolerance, least > tolerance) {
            (true, _) => Proof::Kept,
            (_, true) => Proof::Broken,
            _ => Proof::Open,
        }
    }
}

/// Why a scene has no bounds, and which setting to use instead, as the end of a sentence. None if it has bounds. Every setting that affects a ray of
/// volume rendering is respected by [`picture`] or named here (tests/unit_pure/ray_keys.rs).
pub fn fault(scene: &Scene) -> Option<&'static str> {
    match scene.settings.mode {
        Mode::Volume if scene.still().is_some() => Some("a still is a mean of random paths: set still=none"),
        Mode::Volume if scene.lights_volume() => {
            Some("volume.shading=first-hit is lit by stage 3: set volume.shading=none or depth-coded")
        }
        Mode::Volume if scene.lit_by_volume().is_some() => {
            Some("light.volume takes light from a lattice of cells: set light.volume=none")
        }
        Mode::Volume if scene.tolerance().is_some() => {
            Some("ray.tolerance chooses the steps of each pixel: set ray.tolerance=0")
        }
        Mode::Volume if scene.settings.ray.sliding != 0 => {
            Some("ray.sliding filters samples, at distances of one step: set ray.sliding=0")
        }
        Mode::Volume if scene.has_caps() && scene.cap_level().is_some() => {
            Some("cap.enabled shows echoes where clip planes cut: set cap.enabled=false")
        }
        Mode::Volume => None,
        _ => Some("only the integral of volume rendering (--mode vr) is bounded"),
    }
}

/// The bounds of all rays of a scene for which [`fault`] returns None. `volume`: the texels that stage 1 (preprocess) makes.
pub fn picture(scene: &Scene, volume: &Texels, effort: Effort) -> PictureBounds {
    enclosed(scene, volume, effort, |_, _| false)
}

/// Bounds that are as narrow as needed, or as `effort` allows, to prove for each pixel of the picture `drawn` (red, green, blue and opacity before
/// stage 4, postprocess) that its error is within `tolerance`, levels of 255 after toning, or that it is not. Returns the bounds and a proof for each
/// pixel, row by row. [`fault`] must return None for the scene.
///
/// # Errors
/// One line: the scene has a colour map, which does not keep the order of values, or `drawn` does not have one pixel of four channels for each ray.
pub fn proven(
    scene: &Scene,
    volume: &Texels,
    effort: Effort,
    drawn: &Texels,
    tolerance: f64,
) -> Result<(PictureBounds, Vec<Proof>), String> {
    if scene.settings.post.colour_map != ColourMap::None {
        return Err("post.colour_map shows values in no order of their own: set post.colour_map=none".into());
    }
    let (pixels, [width, height]) = (drawn.values.as_chunks::<4>().0, scene.ray_size());
    if drawn.channels != 4 || pixels.len() != width as usize * height as usize {
        return Err(format!("the picture has {} pixels, and there are {width} x {height} rays", pixels.len()));
    }
    let proof = |n: usize, rgba: [Interval; 4]| Proof::of(scene, rgba, pixels[n], tolerance);
    let bounds = enclosed(scene, volume, effort, |n, found| proof(n, found.rgba) != Proof::Open);
    let ends = bounds.low.values.as_chunks::<4>().0.iter().zip(bounds.high.values.as_chunks::<4>().0);
    let interval = |(low, high): (&[f64; 4], &[f64; 4])| std::array::from_fn(|c| Interval::between(low[c], high[c]));
    let proofs = ends.map(interval).enumerate().map(|(n, rgba)| proof(n, rgba)).collect();
    Ok((bounds, proofs))
}

/// Bounds of all rays. `enough`: whether those of a ray are.
fn enclosed(
    scene: &Scene,
    volume: &Texels,
    effort: Effort,
    enough: impl Fn(usize, &ray::Bounds) -> bool + Sync,
) -> PictureBounds {
    let [width, height] = scene.ray_size().map(|n| n as usize);
    let (least, most) = volume.values.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let one = |n: usize| {
        let (origin, direction) = scene.rays.at((n % width) as f64 + 0.5, (n / width) as f64 + 0.5);
        let (enter, leave) = span(scene, scene.volume_view(), origin, direction);
        let line = Line { scene, base: origin + direction * enter, direction };
        bounds_of(&line, volume, [least, most], leave - enter, effort, |found| enough(n, found))
    };
    let found: Vec<ray::Bounds> = (0..width * height).into_par_iter().with_min_len(4).map(one).collect();
    let map = |of: fn(Interval) -> f64| Texels {
        size: [width, height, 1],
        channels: 4,
        values: found.iter().flat_map(|b| b.rgba.map(of)).collect(),
    };
    PictureBounds { low: map(|v| v.low), high: map(|v| v.high), parts: found.iter().map(|b| b.parts as u64).sum() }
}

/// Bounds of one ray from 0 to `path` mm along a line. `range`: smallest and largest texel of the volume.
fn bounds_of(
    line: &Line,
    volume: &Texels,
    range: [f64; 2],
    path: f64,
    effort: Effort,
    enough: impl Fn(&ray::Bounds) -> bool,
) -> ray::Bounds {
    let scene = line.scene;
    let view = scene.volume_view();
    let settings = &scene.settings.volume;
    if path <= 0.0 {
        return ray::Bounds { rgba: [Interval::ZERO; 4], parts: 0 };
    }
    let tint = (settings.shading == Shading::DepthCoded).then(|| {
        let (axis, near) = depth_axis(scene);
        let dot = |a: DVec3, b: DVec3| {
            (0..3).map(|n| Interval::of(a[n]) * Interval::of(b[n])).fold(Interval::ZERO, |sum, v| sum + v)
        };
        let (start, rate) = (dot(line.base, axis) - Interval::of(near), dot(line.direction, axis));
        let apart = |c: usize| Interval::of(settings.far_tint[c]) - Interval::of(settings.near_tint[c]);
        let at_start = |c: usize| Interval::of(settings.near_tint[c]) + apart(c) * start;
        [std::array::from_fn(at_start), std::array::from_fn(|c| apart(c) * rate)]
    });
    let absorption = Absorption::of(settings, reference_length(scene));
    let (points, threshold, fade) = (transfer::of(settings), settings.threshold, ray::Fade::of(line));
    let medium = ray::Medium { points, threshold, absorption, tint, fade };
    let field = field::Field { line, volume, window: view.window, range };
    ray::bounds(&field, &medium, &hints(line, volume, path), effort.width, effort.parts, enough)
}

/// Where parts should end: cells, the border of the region, the points of the transfer function, and kinks of the fade, to rounding.
fn hints(line: &Line, volume: &Texels, path: f64) -> Vec<f64> {
    let scene = line.scene;
    let medium = Hints::of(scene, line, 1.0);
    let mut places = line.breakpoints([0.0, path]);
    places.extend(Kinks::of(line).map(|fade| fade.kinks([0.0, path])).into_iter().flatten());
    let mut cuts = Vec::new();
    for segment in segments(line, volume, scene.volume_view().window, [0.0, path]) {
        cut(&segment, medium.levels(), &mut cuts);
        places.extend(cuts.iter().filter(|x| x.abs() < 1.0).map(|x| segment.place(*x)));
    }
    places.sort_by(f64::total_cmp);
    places.dedup();
    places
}
