//! The sliders of the view: those declared with the settings, and those that belong to no single setting.

use crate::scene::{Group, MAX_DEVIATION, Mode, Scene, Settings, Slider, Smooth, Transfer, numbers, start_depths};
use crate::texts;
use std::sync::LazyLock;

/// All groups of sliders with their names, in the order in which they are shown.
pub(super) const GROUPS: [(Group, &str); 7] = [
    (Group::Image, texts::IMAGE),
    (Group::Surface, texts::SURFACE),
    (Group::Volume, texts::VOLUME),
    (Group::Light, texts::LIGHTING),
    (Group::Planes, texts::PLANES),
    (Group::Filters, texts::FILTERS),
    (Group::Quality, texts::QUALITY),
];

/// Sliders that keys and gestures use are in front, so that their indices in [`SLIDERS`] stay.
const USED_BY_KEYS: [&str; 3] = ["post.brightness", "threshold", "planes.zoom"];
pub(super) const GAIN: usize = 0;
pub(super) const THRESHOLD: usize = 1;
pub(super) const PLANES_ZOOM: usize = 2;

/// All sliders; those of a group are in the order in which they are shown. Sliders of windows, thresholds and start depths change the values of
/// the present mode; for a mixed picture there are two of each, one for its surface and one for its volume layer.
pub static SLIDERS: LazyLock<Vec<Slider>> = LazyLock::new(|| {
    let mut all: Vec<Slider> = numbers().filter_map(|number| number.slider).collect();
    for (ahead_of, sliders) in OF_SEVERAL {
        let at = all.iter().position(|slider| slider.key == ahead_of).unwrap_or(all.len());
        all.splice(at..at, sliders.iter().copied());
    }
    all.sort_by_key(|slider| USED_BY_KEYS.iter().position(|key| *key == slider.key).unwrap_or(USED_BY_KEYS.len()));
    all
});

/// Sliders of echoes: they are shown in the unit of the samples, and stored as a share of their range.
const OF_ECHOES: [&str; 6] =
    ["threshold", "window.low", "window.high", "planes.window.low", "planes.window.high", "cap.level"];

/// The limits of the samples in the unit that a slider of echoes shows; 0 to 1 for other sliders.
fn unit_of(slider: &Slider, scene: &Scene) -> [f64; 2] {
    if OF_ECHOES.contains(&slider.key) { scene.input.range } else { [0.0, 1.0] }
}

/// Converts a value of the setting to the unit in which the slider shows it.
pub(super) fn to_shown(slider: &Slider, scene: &Scene, value: f64) -> f64 {
    let [low, high] = unit_of(slider, scene);
    low + value * (high - low)
}

/// Converts a value in the unit in which the slider shows it to that of the setting.
pub(super) fn from_shown(slider: &Slider, scene: &Scene, shown: f64) -> f64 {
    let [low, high] = unit_of(slider, scene);
    if high > low { (shown - low) / (high - low) } else { shown }
}

/// Sliders of no single setting, each with the one that they stand in front of.
const OF_SEVERAL: [(&str, &[Slider]); 5] = [
    (
        "distance.median",
        &[
            Slider::of_several(
                ["threshold", texts::THRESHOLD_OF_MODE[0], "", texts::THRESHOLD_OF_MODE[1]],
                Group::Image,
                [0.0, 1.0],
                0.005,
                |s, take| take(threshold(s)),
                set_threshold,
            )
            .when(has_threshold),
            share(
                "window.low",
                texts::WINDOW_LOW,
                Group::Image,
                |s, take| take(window(s)[0]),
                |s, v| set_low(window_mut(s), v),
            ),
            share(
                "window.high",
                texts::WINDOW_HIGH,
                Group::Image,
                |s, take| take(window(s)[1]),
                |s, v| set_high(window_mut(s), v),
            ),
            Slider::of_several(
                ["start_depth", texts::START_DEPTH[0], "mm", texts::START_DEPTH[1]],
                Group::Image,
                [0.0, 400.0],
                1.0,
                |s, take| start_depth(s).flatten().into_iter().for_each(take),
                set_start_depth,
            )
            .when(|s| start_depth(s).is_some())
            .within(start_depths),
            Slider::of_several(
                ["cuts.depth", texts::DEPTH_OF_CUT[0], "mm", texts::DEPTH_OF_CUT[1]],
                Group::Image,
                [0.0, 200.0],
                1.0,
                |s, take| s.cuts.last().and_then(|cut| cut.depth).into_iter().for_each(take),
                |s, v| s.cuts.iter_mut().next_back().into_iter().for_each(|cut| cut.depth = (v > 0.0).then_some(v)),
            )
            .when(|s| {
                s.cuts.last().is_some_and(|cut| cut.brush.is_none()) && !s.mode.is_flat() && s.mode != Mode::Cube
            }),
        ],
    ),
    (
        "cube.inset.left",
        &[
            share(
                "planes.window.low",
                texts::PLANES_WINDOW_LOW,
                Group::Planes,
                |s, take| take(s.planes.window[0]),
                |s, v| set_low(&mut s.planes.window, v),
            )
            .when(|s| s.layout.has_planes()),
            share(
                "planes.window.high",
                texts::PLANES_WINDOW_HIGH,
                Group::Planes,
                |s, take| take(s.planes.window[1]),
                |s, v| set_high(&mut s.planes.window, v),
            )
            .when(|s| s.layout.has_planes()),
        ],
    ),
    (
        "volume.hit",
        &[Slider::of_several(
            ["opacity", texts::OPACITY[0], "", texts::OPACITY[1]],
            Group::Volume,
            [0.01, 1.0],
            0.02,
            |s, take| take(opacity(s)),
            set_opacity,
        )
        .when(has_opacity)],
    ),
    (
        "volume.start_depth",
        &[
            share(
                "volume.window.low",
                texts::VOLUME_WINDOW_LOW,
                Group::Volume,
                |s, take| take(s.volume.window[0]),
                |s, v| set_low(&mut s.volume.window, v),
            )
            .when(Settings::has_own_volume),
            share(
                "volume.window.high",
                texts::VOLUME_WINDOW_HIGH,
                Group::Volume,
                |s, take| take(s.volume.window[1]),
                |s, v| set_high(&mut s.volume.window, v),
            )
            .when(Settings::has_own_volume),
        ],
    ),
    (
        "slices.median",
        &[Slider::of_several(
            ["smoothing", texts::SMOOTHING[0], "mm", texts::SMOOTHING[1]],
            Group::Filters,
            [0.0, 3.0],
            0.1,
            |s, take| take(smoothing(s)),
            set_smoothing,
        )
        .within(smoothing_limits)],
    ),
];

/// A slider from 0 to 1.
const fn share(
    key: &'static str,
    [name, hint]: [&'static str; 2],
    group: Group,
    each: fn(&Settings, &mut dyn FnMut(f64)),
    put: fn(&mut Settings, f64),
) -> Slider {
    Slider::of_several([key, name, "", hint], group, [0.0, 1.0], 0.01, each, put)
}

fn window(s: &Settings) -> [f64; 2] {
    match s.mode {
        Mode::Surface | Mode::Mixed => s.surface.window,
        Mode::Volume => s.volume.window,
        Mode::Mip | Mode::MinIp | Mode::Mean => s.projection.window,
        Mode::Plane | Mode::Orthogonal | Mode::Tomography => s.planes.window,
        Mode::Cube => s.cube.window,
    }
}

fn window_mut(s: &mut Settings) -> &mut [f64; 2] {
    match s.mode {
        Mode::Surface | Mode::Mixed => &mut s.surface.window,
        Mode::Volume => &mut s.volume.window,
        Mode::Mip | Mode::MinIp | Mode::Mean => &mut s.projection.window,
        Mode::Plane | Mode::Orthogonal | Mode::Tomography => &mut s.planes.window,
        Mode::Cube => &mut s.cube.window,
    }
}

/// Minimum width of a window: one grey level of 8 bits, rounded up. A narrower window shows only black and white.
const MIN_WINDOW: f64 = 0.005;

fn set_low(window: &mut [f64; 2], value: f64) {
    let low = value.min(window[1] - MIN_WINDOW);
    if low < window[1] {
        window[0] = low;
    }
}

fn set_high(window: &mut [f64; 2], value: f64) {
    let high = value.max(window[0] + MIN_WINDOW);
    if window[0] < high {
        window[1] = high;
    }
}

fn has_threshold(s: &Settings) -> bool {
    matches!(s.mode, Mode::Surface | Mode::Mixed | Mode::Volume)
}

fn threshold(s: &Settings) -> f64 {
    if s.mode == Mode::Volume { s.volume.threshold } else { s.surface.threshold }
}

fn set_threshold(s: &mut Settings, value: f64) {
    match s.mode {
        Mode::Volume => s.volume.threshold = value,
        // At a threshold of 0 the detector finds its surface at the start of the ray.
        _ => s.surface.threshold = value.max(0.005),
    }
}

/// The start depth of the mode, if it has one.
fn start_depth(s: &Settings) -> Option<Option<f64>> {
    match s.mode {
        Mode::Surface | Mode::Mixed => Some(s.surface.start_depth),
        Mode::Volume => Some(s.volume.start_depth),
        Mode::Mip | Mode::MinIp | Mode::Mean => Some(s.projection.start_depth),
        _ => None,
    }
}

fn set_start_depth(s: &mut Settings, value: f64) {
    let value = (value > 0.0).then_some(value);
    match s.mode {
        Mode::Surface | Mode::Mixed => s.surface.start_depth = value,
        Mode::Volume => s.volume.start_depth = value,
        Mode::Mip | Mode::MinIp | Mode::Mean => s.projection.start_depth = value,
        _ => {}
    }
}

/// The largest opacity of the points of a transfer function; 0 for that of a name.
fn opacity(s: &Settings) -> f64 {
    match &s.volume.transfer {
        Transfer::Points(points) if s.volume.opacity.is_none() => points.iter().map(|p| p.opacity).fold(0.0, f64::max),
        _ => 0.0,
    }
}

fn has_opacity(s: &Settings) -> bool {
    (s.mode == Mode::Volume || s.has_own_volume()) && opacity(s) > 0.0
}

fn set_opacity(s: &mut Settings, value: f64) {
    let largest = opacity(s);
    if let Transfer::Points(points) = &mut s.volume.transfer
        && largest > 0.0
    {
        points.iter_mut().for_each(|p| p.opacity = (p.opacity / largest * value).min(1.0));
    }
}

fn smoothing(s: &Settings) -> f64 {
    s.slices.smooth.map_or(0.0, |f| f.lateral.max(f.depth))
}

/// Scales an existing Gaussian in proportion. A new one is isotropic in the slice and includes the neighbouring slices.
fn set_smoothing(s: &mut Settings, value: f64) {
    if value < 1e-3 {
        return s.slices.smooth = None;
    }
    let (wide, filter, was) = (value, s.slices.smooth.unwrap_or_default(), smoothing(s));
    let scaled = |deviation: f64, most: f64| if was > 0.0 { (deviation * (wide / was)).min(most) } else { most };
    s.slices.smooth = Some(Smooth {
        lateral: scaled(filter.lateral, wide),
        depth: scaled(filter.depth, wide),
        elevation: if was > 0.0 { scaled(filter.elevation, 8.0) } else { filter.elevation.max(1.0) },
        elevation_mm: filter.elevation_mm.filter(|_| was > 0.0).map(|mm| scaled(mm, 1000.0)),
        kernel: None,
    });
}

/// The range of a Gaussian on slices of this pitch, mm.
fn smoothing_limits(scene: &Scene) -> [f64; 2] {
    [0.0, MAX_DEVIATION * scene.grid.pitch[0].min(scene.grid.pitch[1])]
}
