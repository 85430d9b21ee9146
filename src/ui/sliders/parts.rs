//! What of the settings a slider is: that of the shown mode, on from some value on, kept in order.

use crate::scene::{Bilateral, Layout, MAX_DEVIATION, Mode, Scene, Settings, Shading, Sigma, Smooth, Transfer};

pub(super) fn always(_: &Settings) -> bool {
    true
}

pub(super) fn casts(s: &Settings) -> bool {
    !s.mode.is_flat()
}

pub(super) fn cuts(s: &Settings) -> bool {
    s.mode.is_flat() || is_four(s)
}

pub(super) fn is_four(s: &Settings) -> bool {
    s.layout == Layout::Four
}

pub(super) fn is_cube(s: &Settings) -> bool {
    s.mode == Mode::Cube
}

pub(super) fn is_mixed(s: &Settings) -> bool {
    s.mode == Mode::Mixed
}

pub(super) fn is_first_hit(s: &Settings) -> bool {
    s.mode == Mode::Volume && s.volume.shading == Shading::FirstHit
}

pub(super) fn lit(s: &Settings) -> bool {
    matches!(s.mode, Mode::Surface | Mode::Mixed) || is_first_hit(s)
}

/// A filter or a step that is off below its least value.
pub(super) fn above(value: f64, least: f64) -> Option<f64> {
    (value >= least).then_some(value)
}

/// The odd window that is nearest; 0 is none.
pub(super) fn odd(value: f64) -> u32 {
    if value < 2.0 { 0 } else { 2 * ((value - 1.0) / 2.0).round() as u32 + 1 }
}

/// The same look with another strength. It stays where its strength is 0, which no pass runs for: its other numbers are kept.
pub(super) fn kept<T: Copy + Default>(look: Option<T>, value: f64, part: fn(&mut T) -> &mut f64) -> Option<T> {
    if look.is_none() && value == 0.0 {
        return None;
    }
    let mut look = look.unwrap_or_default();
    *part(&mut look) = value;
    Some(look)
}

pub(super) fn sigma(filter: Option<Sigma>, value: f64) -> Option<Sigma> {
    (value > 0.0).then(|| Sigma { sigma: value, ..filter.unwrap_or_default() })
}

pub(super) fn window(s: &Settings) -> [f64; 2] {
    match s.mode {
        Mode::Surface | Mode::Mixed => s.surface.window,
        Mode::Volume => s.volume.window,
        Mode::Mip | Mode::MinIp | Mode::Mean => s.projection.window,
        Mode::Plane | Mode::Orthogonal | Mode::Tomography => s.planes.window,
        Mode::Cube => s.cube.window,
    }
}

pub(super) fn window_mut(s: &mut Settings) -> &mut [f64; 2] {
    match s.mode {
        Mode::Surface | Mode::Mixed => &mut s.surface.window,
        Mode::Volume => &mut s.volume.window,
        Mode::Mip | Mode::MinIp | Mode::Mean => &mut s.projection.window,
        Mode::Plane | Mode::Orthogonal | Mode::Tomography => &mut s.planes.window,
        Mode::Cube => &mut s.cube.window,
    }
}

/// One grey level of 8 bits, rounded up: a narrower window shows nothing but black and white.
const NARROWEST: f64 = 0.005;

pub(super) fn set_low(window: &mut [f64; 2], value: f64) {
    let low = value.min(window[1] - NARROWEST);
    if low < window[1] {
        window[0] = low;
    }
}

pub(super) fn set_high(window: &mut [f64; 2], value: f64) {
    let high = value.max(window[0] + NARROWEST);
    if window[0] < high {
        window[1] = high;
    }
}

pub(super) fn has_threshold(s: &Settings) -> bool {
    matches!(s.mode, Mode::Surface | Mode::Mixed | Mode::Volume)
}

pub(super) fn threshold(s: &Settings) -> f64 {
    if s.mode == Mode::Volume { s.volume.threshold } else { s.surface.threshold }
}

pub(super) fn set_threshold(s: &mut Settings, value: f64) {
    match s.mode {
        Mode::Volume => s.volume.threshold = value,
        // A detector that fires at nothing finds its surface where the ray begins.
        _ => s.surface.threshold = value.max(0.005),
    }
}

/// That of the mode, if it has one.
pub(super) fn start(s: &Settings) -> Option<Option<f64>> {
    match s.mode {
        Mode::Surface | Mode::Mixed => Some(s.surface.start_depth),
        Mode::Volume => Some(s.volume.start_depth),
        Mode::Mip | Mode::MinIp | Mode::Mean => Some(s.projection.start_depth),
        _ => None,
    }
}

pub(super) fn set_start(s: &mut Settings, value: f64) {
    let value = above(value, 1e-9);
    match s.mode {
        Mode::Surface | Mode::Mixed => s.surface.start_depth = value,
        Mode::Volume => s.volume.start_depth = value,
        Mode::Mip | Mode::MinIp | Mode::Mean => s.projection.start_depth = value,
        _ => {}
    }
}

/// Depths below the face that leave 1 mm of the region.
pub(super) fn depths(scene: &Scene) -> [f64; 2] {
    [f64::NEG_INFINITY, crate::ui::view::below_face(scene, scene.high).y - 1.0]
}

/// What a face can be pushed in along an axis and leave 2 mm between it and the one across.
pub(super) fn inset(scene: &Scene, axis: usize, across: f64) -> [f64; 2] {
    [0.0, (scene.high - scene.low)[axis] - across - 2.0]
}

/// The largest opacity of the points. Named functions have theirs.
pub(super) fn opacity(s: &Settings) -> f64 {
    match &s.volume.transfer {
        Transfer::Points(points) => points.iter().map(|p| p.opacity).fold(0.0, f64::max),
        Transfer::Named(_) => 0.0,
    }
}

pub(super) fn has_opacity(s: &Settings) -> bool {
    matches!(s.mode, Mode::Volume | Mode::Mixed) && opacity(s) > 0.0
}

pub(super) fn set_opacity(s: &mut Settings, value: f64) {
    let largest = opacity(s);
    if let Transfer::Points(points) = &mut s.volume.transfer
        && largest > 0.0
    {
        points.iter_mut().for_each(|p| p.opacity = (p.opacity / largest * value).min(1.0));
    }
}

pub(super) fn set_bilateral(s: &mut Settings, value: f64) {
    let filter = s.distance.bilateral.unwrap_or(Bilateral { pixels: 0.0, distance: 2.0, repeat: 1 });
    s.distance.bilateral = above(value, 0.1).map(|pixels| Bilateral { pixels, ..filter });
}

pub(super) fn set_edge(s: &mut Settings, value: f64) {
    if let Some(filter) = &mut s.distance.bilateral {
        filter.distance = value;
    }
}

pub(super) fn smoothing(s: &Settings) -> f64 {
    s.slices.smooth.map_or(0.0, |f| f.lateral.max(f.depth))
}

/// Keeps the proportions of a Gaussian that was there; a new one is round in the plane and joins neighbouring slices.
pub(super) fn set_smoothing(s: &mut Settings, value: f64) {
    let Some(wide) = above(value, 1e-3) else { return s.slices.smooth = None };
    let (filter, was) = (s.slices.smooth.unwrap_or_default(), smoothing(s));
    let scaled = |deviation: f64, most: f64| if was > 0.0 { (deviation * (wide / was)).min(most) } else { most };
    s.slices.smooth = Some(Smooth {
        lateral: scaled(filter.lateral, wide),
        depth: scaled(filter.depth, wide),
        elevation: if was > 0.0 { scaled(filter.elevation, 8.0) } else { filter.elevation.max(1.0) },
        kernel: None,
    });
}

/// What a Gaussian may be on slices of this pitch, mm.
pub(super) fn smoothings(scene: &Scene) -> [f64; 2] {
    [0.0, MAX_DEVIATION * scene.grid.pitch[0].min(scene.grid.pitch[1])]
}
