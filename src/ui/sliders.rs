//! The sliders of the view: one table with their names, ranges and the settings that they change.

use crate::scene::{
    Bilateral, EnhancedSigma, Layout, MAX_DEVIATION, Mode, Occlusion, Scene, Settings, Shading, Shadow, Sigma, Skin,
    Smooth, Transfer,
};
use crate::texts;

/// A group of sliders in the panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Group {
    Image,
    Surface,
    Volume,
    Light,
    Planes,
    Filters,
    Quality,
}

impl Group {
    /// All groups with their names, in display order.
    pub(super) const ALL: [(Group, &'static str); 7] = [
        (Group::Image, texts::IMAGE),
        (Group::Surface, texts::SURFACE),
        (Group::Volume, texts::VOLUME),
        (Group::Light, texts::LIGHT),
        (Group::Planes, texts::PLANES),
        (Group::Filters, texts::FILTERS),
        (Group::Quality, texts::QUALITY),
    ];
}

use Group::{Filters, Image, Light, Planes, Quality, Surface, Volume};

/// A slider and the setting that it changes.
pub struct Slider {
    pub(super) name: &'static str,
    /// Unit of its value; may be empty.
    pub(super) unit: &'static str,
    pub(super) group: Group,
    /// Its range for any volume; [`Slider::range_in`] gives the range for one scene.
    pub(super) range: [f64; 2],
    /// How far a key moves it.
    pub(super) step: f64,
    /// Stage 1 runs again: slices are filtered differently, or other slices become visible (unless `slices.everything` processed them all).
    pub(super) reruns_frames: bool,
    applies: fn(&Settings) -> bool,
    get: fn(&Settings) -> f64,
    write: fn(&mut Settings, f64),
    limits: fn(&Scene) -> [f64; 2],
}

impl Slider {
    /// True if the picture depends on it.
    pub(super) fn applies(&self, settings: &Settings) -> bool {
        (self.applies)(settings)
    }

    /// Its value; outside of the range if a scene file set it so.
    pub(super) fn get(&self, settings: &Settings) -> f64 {
        (self.get)(settings)
    }

    /// Sets the nearest value in the range. NaN changes nothing.
    pub(super) fn set(&self, settings: &mut Settings, value: f64) {
        if !value.is_nan() {
            (self.write)(settings, value.clamp(self.range[0], self.range[1]));
        }
    }

    /// The range for this scene; never empty.
    pub(super) fn range_in(&self, scene: &Scene) -> [f64; 2] {
        let [low, high] = (self.limits)(scene);
        let low = self.range[0].max(low).min(self.range[1]);
        [low, self.range[1].min(high).max(low)]
    }

    const fn of(
        mut self,
        applies: fn(&Settings) -> bool,
        get: fn(&Settings) -> f64,
        set: fn(&mut Settings, f64),
    ) -> Self {
        (self.applies, self.get, self.write) = (applies, get, set);
        self
    }

    const fn within(mut self, limits: fn(&Scene) -> [f64; 2]) -> Slider {
        self.limits = limits;
        self
    }

    const fn reruns(mut self) -> Slider {
        self.reruns_frames = true;
        self
    }
}

const fn slider(name: &'static str, unit: &'static str, group: Group, range: [f64; 2], step: f64) -> Slider {
    let limits: fn(&Scene) -> [f64; 2] = |_| [f64::NEG_INFINITY, f64::INFINITY];
    Slider {
        name,
        unit,
        group,
        range,
        step,
        reruns_frames: false,
        applies: |_| false,
        get: |_| 0.0,
        write: |_, _| {},
        limits,
    }
}

/// Indices in [`SLIDERS`] that keys and gestures use.
pub(super) const GAIN: usize = 0;
pub(super) const THRESHOLD: usize = 3;
pub(super) const PLANES_ZOOM: usize = 7;

/// Greatest depth of a cut that the slider sets, mm.
const DEEPEST: f64 = 200.0;

/// All sliders. Those of windows, thresholds and start depths change the values of the current mode. A mixed picture has them for its
/// surface, and again for its volume layer.
pub const SLIDERS: &[Slider] = &[
    slider(texts::GAIN, "", Image, [-1.0, 1.0], 0.02).of(always, |s| s.post.brightness, |s, v| s.post.brightness = v),
    slider(texts::CONTRAST, "", Image, [0.0, 3.0], 0.05).of(always, |s| s.post.contrast, |s, v| s.post.contrast = v),
    slider(texts::GAMMA, "", Image, [0.3, 3.0], 0.05).of(always, |s| s.post.gamma, |s, v| s.post.gamma = v),
    slider(texts::THRESHOLD, "", Image, [0.0, 1.0], 0.005).of(has_threshold, threshold, set_threshold),
    slider(texts::WINDOW_LOW, "", Image, [0.0, 1.0], 0.01).of(
        always,
        |s| window(s)[0],
        |s, v| set_low(window_mut(s), v),
    ),
    slider(texts::WINDOW_HIGH, "", Image, [0.0, 1.0], 0.01).of(
        always,
        |s| window(s)[1],
        |s, v| set_high(window_mut(s), v),
    ),
    slider(texts::START_DEPTH, "mm", Image, [0.0, 400.0], 1.0).within(depth_limits).reruns().of(
        |s| start_depth(s).is_some(),
        |s| start_depth(s).flatten().unwrap_or(0.0),
        set_start_depth,
    ),
    slider(texts::PLANES_ZOOM, "", Planes, [0.2, 20.0], 0.1).of(
        shows_planes,
        |s| s.planes.zoom,
        |s, v| s.planes.zoom = v,
    ),
    slider(texts::SLAB, "mm", Planes, [0.0, 40.0], 0.5).of(
        shows_planes,
        |s| s.planes.thickness,
        |s, v| s.planes.thickness = v,
    ),
    slider(texts::SPACING, "mm", Planes, [0.0, 40.0], 0.5).of(
        |s| s.mode == Mode::Tomography,
        |s| s.planes.spacing.unwrap_or(0.0),
        |s, v| s.planes.spacing = above(v, 0.1),
    ),
    slider(texts::PLANES_AZIMUTH, "°", Planes, [-180.0, 180.0], 5.0).of(
        shows_planes,
        |s| s.planes.azimuth,
        |s, v| s.planes.azimuth = v,
    ),
    slider(texts::PLANES_TILT, "°", Planes, [-180.0, 180.0], 5.0).of(
        shows_planes,
        |s| s.planes.tilt,
        |s, v| s.planes.tilt = v,
    ),
    slider(texts::PLANES_ROLL, "°", Planes, [-180.0, 180.0], 5.0).of(
        shows_planes,
        |s| s.planes.roll,
        |s, v| s.planes.roll = v,
    ),
    slider(texts::PLANES_WINDOW_LOW, "", Planes, [0.0, 1.0], 0.01).of(
        is_four,
        |s| s.planes.window[0],
        |s, v| set_low(&mut s.planes.window, v),
    ),
    slider(texts::PLANES_WINDOW_HIGH, "", Planes, [0.0, 1.0], 0.01).of(
        is_four,
        |s| s.planes.window[1],
        |s, v| set_high(&mut s.planes.window, v),
    ),
    slider(texts::CUT_LEFT, "mm", Planes, [0.0, 400.0], 1.0)
        .within(|c| inset_limits(c, 0, c.settings.cube.inset.right))
        .reruns()
        .of(is_cube, |s| s.cube.inset.left, |s, v| s.cube.inset.left = v),
    slider(texts::CUT_RIGHT, "mm", Planes, [0.0, 400.0], 1.0)
        .within(|c| inset_limits(c, 0, c.settings.cube.inset.left))
        .reruns()
        .of(is_cube, |s| s.cube.inset.right, |s, v| s.cube.inset.right = v),
    slider(texts::CUT_NEAR, "mm", Planes, [0.0, 400.0], 1.0)
        .within(|c| inset_limits(c, 1, c.settings.cube.inset.far))
        .reruns()
        .of(is_cube, |s| s.cube.inset.near, |s, v| s.cube.inset.near = v),
    slider(texts::CUT_FAR, "mm", Planes, [0.0, 400.0], 1.0)
        .within(|c| inset_limits(c, 1, c.settings.cube.inset.near))
        .reruns()
        .of(is_cube, |s| s.cube.inset.far, |s, v| s.cube.inset.far = v),
    slider(texts::CUT_BOTTOM, "mm", Planes, [0.0, 400.0], 1.0)
        .within(|c| inset_limits(c, 2, c.settings.cube.inset.top))
        .reruns()
        .of(is_cube, |s| s.cube.inset.bottom, |s, v| s.cube.inset.bottom = v),
    slider(texts::CUT_TOP, "mm", Planes, [0.0, 400.0], 1.0)
        .within(|c| inset_limits(c, 2, c.settings.cube.inset.bottom))
        .reruns()
        .of(is_cube, |s| s.cube.inset.top, |s, v| s.cube.inset.top = v),
    slider(texts::FACE_SHADING, "", Planes, [0.0, 1.0], 0.05).of(
        is_cube,
        |s| s.cube.shading,
        |s, v| s.cube.shading = v,
    ),
    slider(texts::OPACITY, "", Volume, [0.01, 1.0], 0.02).of(has_opacity, opacity, set_opacity),
    slider(texts::OPACITY_OF_A_HIT, "", Volume, [0.01, 1.0], 0.02).of(
        is_first_hit,
        |s| s.volume.hit,
        |s, v| s.volume.hit = v,
    ),
    slider(texts::VEIL, "", Volume, [0.0, 1.0], 0.05).of(is_mixed, |s| s.volume.veil, |s, v| s.volume.veil = v),
    slider(texts::VOLUME_THRESHOLD, "", Volume, [0.0, 1.0], 0.01).of(
        has_own_volume,
        |s| s.volume.threshold,
        |s, v| s.volume.threshold = v,
    ),
    slider(texts::VOLUME_WINDOW_LOW, "", Volume, [0.0, 1.0], 0.01).of(
        has_own_volume,
        |s| s.volume.window[0],
        |s, v| set_low(&mut s.volume.window, v),
    ),
    slider(texts::VOLUME_WINDOW_HIGH, "", Volume, [0.0, 1.0], 0.01).of(
        has_own_volume,
        |s| s.volume.window[1],
        |s, v| set_high(&mut s.volume.window, v),
    ),
    slider(texts::VOLUME_START_DEPTH, "mm", Volume, [0.0, 400.0], 1.0).within(depth_limits).reruns().of(
        has_own_volume,
        |s| s.volume.start_depth.unwrap_or(0.0),
        |s, v| s.volume.start_depth = above(v, 1e-9),
    ),
    slider(texts::SURFACE_MEDIAN, "px", Surface, [0.0, 31.0], 2.0).of(
        is_lit,
        |s| f64::from(s.distance.median),
        |s, v| (s.distance.median, s.distance.median_mm) = (odd(v), None),
    ),
    slider(texts::SURFACE_SMOOTHING, "px", Surface, [0.0, 10.0], 0.5).of(
        is_lit,
        |s| s.distance.bilateral.map_or(0.0, |b| b.pixels),
        set_bilateral,
    ),
    slider(texts::SURFACE_EDGE, "mm", Surface, [0.1, 20.0], 0.2).of(
        |s| is_lit(s) && s.distance.bilateral.is_some(),
        |s| s.distance.bilateral.map_or(0.1, |b| b.distance),
        set_edge,
    ),
    slider(texts::AMBIENT, "", Light, [0.0, 2.0], 0.02).of(has_light, |s| s.light.ambient, |s, v| s.light.ambient = v),
    slider(texts::DIFFUSE, "", Light, [0.0, 2.0], 0.02).of(has_light, |s| s.light.diffuse, |s, v| s.light.diffuse = v),
    slider(texts::SPECULAR, "", Light, [0.0, 2.0], 0.02).of(
        has_light,
        |s| s.light.specular,
        |s, v| s.light.specular = v,
    ),
    slider(texts::LIGHT_DEPTH, "mm", Light, [0.2, 8.0], 0.1).of(
        is_lit_inside,
        |s| s.light.volume.map_or(0.2, |l| l.depth),
        |s, v| s.light.volume.iter_mut().for_each(|l| l.depth = v),
    ),
    slider(texts::LIGHT_WARMTH, "", Light, [0.0, 2.0], 0.05).of(
        is_lit_inside,
        |s| s.light.volume.map_or(0.0, |l| l.warmth),
        |s, v| s.light.volume.iter_mut().for_each(|l| l.warmth = v),
    ),
    slider(texts::EXPOSURE, "", Light, [0.1, 4.0], 0.05).of(
        is_lit_inside,
        |s| s.light.volume.map_or(0.1, |l| l.exposure),
        |s, v| s.light.volume.iter_mut().for_each(|l| l.exposure = v),
    ),
    slider(texts::SHADOW, "", Light, [0.0, 1.0], 0.05).of(
        is_lit,
        |s| s.light.shadow.map_or(0.0, |l| l.strength),
        |s, v| s.light.shadow = with_strength(s.light.shadow, v, |l: &mut Shadow| &mut l.strength),
    ),
    slider(texts::OCCLUSION, "", Light, [0.0, 4.0], 0.1).of(
        is_lit,
        |s| s.light.occlusion.map_or(0.0, |l| l.strength),
        |s, v| s.light.occlusion = with_strength(s.light.occlusion, v, |l: &mut Occlusion| &mut l.strength),
    ),
    slider(texts::TRANSLUCENCY, "", Light, [0.0, 1.0], 0.05).of(
        is_lit,
        |s| s.light.skin.map_or(0.0, |l| l.translucency),
        |s, v| s.light.skin = with_strength(s.light.skin, v, |l: &mut Skin| &mut l.translucency),
    ),
    slider(texts::SMOOTHING, "mm", Filters, [0.0, 3.0], 0.1).within(smoothing_limits).reruns().of(
        always,
        smoothing,
        set_smoothing,
    ),
    slider(texts::MEDIAN, "", Filters, [0.0, 1.0], 1.0).reruns().of(
        always,
        |s| f64::from(u8::from(s.slices.median)),
        |s, v| s.slices.median = v >= 0.5,
    ),
    slider(texts::SPECKLE, "", Filters, [0.0, 0.5], 0.01).reruns().of(
        always,
        |s| s.slices.sigma.map_or(0.0, |f| f.sigma),
        |s, v| s.slices.sigma = sigma(s.slices.sigma, v),
    ),
    slider(texts::SPECKLE_ENHANCED, "", Filters, [0.0, 0.5], 0.01).reruns().of(
        always,
        |s| s.slices.enhanced_sigma.map_or(0.0, |f| f.sigma),
        |s, v| s.slices.enhanced_sigma = enhanced_sigma(s.slices.enhanced_sigma, v),
    ),
    slider(texts::PICTURE_SPECKLE, "", Filters, [0.0, 0.5], 0.01).of(
        always,
        |s| s.post.sigma.map_or(0.0, |f| f.sigma),
        |s, v| s.post.sigma = sigma(s.post.sigma, v),
    ),
    slider(texts::DEPTH_OF_CUT, "mm", Image, [0.0, DEEPEST], 1.0).of(
        |s| s.cuts.last().is_some_and(|cut| cut.brush.is_none()) && !s.mode.is_flat() && s.mode != Mode::Cube,
        |s| s.cuts.last().and_then(|cut| cut.depth).unwrap_or(0.0),
        |s, v| {
            if let Some(cut) = s.cuts.last_mut() {
                cut.depth = (v > 0.0).then_some(v);
            }
        },
    ),
    slider(texts::AUTO_RENDER_START, "", Image, [0.0, 1.0], 1.0).reruns().of(
        can_unveil,
        |s| f64::from(u8::from(s.unveil.enabled)),
        |s, v| s.unveil.enabled = v >= 0.5,
    ),
    slider(texts::START_OFFSET, "mm", Image, [-10.0, 30.0], 0.5).of(
        unveils,
        |s| s.unveil.offset,
        |s, v| s.unveil.offset = v,
    ),
    slider(texts::START_SMOOTHING, "mm", Image, [0.0, 10.0], 0.5).of(
        unveils,
        |s| s.unveil.smoothing,
        |s, v| s.unveil.smoothing = v,
    ),
    slider(texts::CLIP_ECHOES, "", Image, [0.0, 1.0], 1.0).of(
        |s| s.can_cap(),
        |s| f64::from(u8::from(s.cap.enabled)),
        |s, v| s.cap.enabled = v >= 0.5,
    ),
    slider(texts::CLIP_THRESHOLD, "", Image, [0.0, 1.0], 0.01).of(
        |s| s.can_cap() && s.cap.enabled,
        |s| s.cap.level.unwrap_or(0.0),
        |s, v| s.cap.level = above(v, 1e-9),
    ),
    slider(texts::STEP, "mm", Quality, [0.0, 2.0], 0.05).of(
        renders_rays,
        |s| s.ray.step.unwrap_or(0.0),
        |s, v| s.ray.step = above(v, 0.05),
    ),
    slider(texts::FIELD_OF_VIEW, "°", Quality, [0.0, 90.0], 5.0).of(
        renders_rays,
        |s| s.camera.field_of_view,
        |s, v| s.camera.field_of_view = above(v, 1.0).unwrap_or(0.0),
    ),
    slider(texts::RAYS_A_PIXEL, "", Quality, [1.0, 4.0], 1.0).of(
        |s| renders_rays(s) && s.ray.subsampling == 1,
        |s| f64::from(s.ray.rays),
        |s, v| s.ray.rays = if s.ray.subsampling > 1 { 1 } else { v.round() as u32 },
    ),
    slider(texts::LARGEST_ERROR, "", Quality, [0.0, 8.0], 0.5).of(
        can_tolerate,
        |s| s.ray.tolerance,
        |s, v| s.ray.tolerance = above(v, 0.25).unwrap_or(0.0),
    ),
];

/// True if rendering may start at the fluid.
fn can_unveil(s: &Settings) -> bool {
    !s.mode.is_flat() && s.mode != Mode::Cube
}

fn unveils(s: &Settings) -> bool {
    can_unveil(s) && s.unveil.enabled
}

fn always(_: &Settings) -> bool {
    true
}

fn renders_rays(s: &Settings) -> bool {
    !s.mode.is_flat()
}

/// True if each pixel may have steps of its own.
fn can_tolerate(s: &Settings) -> bool {
    let is_alone = s.mode == Mode::Volume && s.volume.shading != Shading::FirstHit && s.still.is_none();
    is_alone && s.ray.sliding == 0 && !s.ray.adaptive
}

fn shows_planes(s: &Settings) -> bool {
    s.mode.is_flat() || is_four(s)
}

fn is_four(s: &Settings) -> bool {
    s.layout == Layout::Four
}

fn is_cube(s: &Settings) -> bool {
    s.mode == Mode::Cube
}

/// A volume shown with a surface has a window, a threshold and a start depth of its own.
fn has_own_volume(s: &Settings) -> bool {
    s.mode == Mode::Mixed || s.layout == Layout::Pair
}

fn is_mixed(s: &Settings) -> bool {
    s.mode == Mode::Mixed
}

fn is_first_hit(s: &Settings) -> bool {
    s.mode == Mode::Volume && s.volume.shading == Shading::FirstHit
}

fn is_lit(s: &Settings) -> bool {
    matches!(s.mode, Mode::Surface | Mode::Mixed) || is_first_hit(s)
}

/// Whether light goes through the volume.
fn is_lit_inside(s: &Settings) -> bool {
    s.light.volume.is_some() && matches!(s.mode, Mode::Volume | Mode::Mixed)
}

fn has_light(s: &Settings) -> bool {
    is_lit(s) || is_lit_inside(s)
}

/// A value that is off below its minimum.
fn above(value: f64, least: f64) -> Option<f64> {
    (value >= least).then_some(value)
}

/// The nearest odd window size; 0 is off.
fn odd(value: f64) -> u32 {
    if value < 2.0 { 0 } else { 2 * ((value - 1.0) / 2.0).round() as u32 + 1 }
}

/// An effect with another strength. It stays set at strength 0, for which no pass runs, so that its other values are kept.
fn with_strength<T: Copy + Default>(effect: Option<T>, value: f64, strength: fn(&mut T) -> &mut f64) -> Option<T> {
    if effect.is_none() && value == 0.0 {
        return None;
    }
    let mut effect = effect.unwrap_or_default();
    *strength(&mut effect) = value;
    Some(effect)
}

fn sigma(filter: Option<Sigma>, value: f64) -> Option<Sigma> {
    (value > 0.0).then(|| Sigma { sigma: value, ..filter.unwrap_or_default() })
}

fn enhanced_sigma(filter: Option<EnhancedSigma>, value: f64) -> Option<EnhancedSigma> {
    (value > 0.0).then(|| EnhancedSigma { sigma: value, ..filter.unwrap_or_default() })
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
    let value = above(value, 1e-9);
    match s.mode {
        Mode::Surface | Mode::Mixed => s.surface.start_depth = value,
        Mode::Volume => s.volume.start_depth = value,
        Mode::Mip | Mode::MinIp | Mode::Mean => s.projection.start_depth = value,
        _ => {}
    }
}

/// The range of start depths that leaves 1 mm of the region.
fn depth_limits(scene: &Scene) -> [f64; 2] {
    [f64::NEG_INFINITY, super::view::below_face(scene, scene.high).y - 1.0]
}

/// The range of a face's inset along an axis that leaves 2 mm to the opposite face, whose inset is `across`.
fn inset_limits(scene: &Scene, axis: usize, across: f64) -> [f64; 2] {
    [0.0, (scene.high - scene.low)[axis] - across - 2.0]
}

/// The largest opacity of the points of a transfer function; 0 for a named one.
fn opacity(s: &Settings) -> f64 {
    match &s.volume.transfer {
        Transfer::Points(points) => points.iter().map(|p| p.opacity).fold(0.0, f64::max),
        Transfer::Named(_) => 0.0,
    }
}

fn has_opacity(s: &Settings) -> bool {
    (s.mode == Mode::Volume || has_own_volume(s)) && opacity(s) > 0.0
}

fn set_opacity(s: &mut Settings, value: f64) {
    let largest = opacity(s);
    if let Transfer::Points(points) = &mut s.volume.transfer
        && largest > 0.0
    {
        points.iter_mut().for_each(|p| p.opacity = (p.opacity / largest * value).min(1.0));
    }
}

fn set_bilateral(s: &mut Settings, value: f64) {
    let filter = s.distance.bilateral.unwrap_or(Bilateral { pixels: 0.0, mm: None, distance: 2.0, repeat: 1 });
    s.distance.bilateral = above(value, 0.1).map(|pixels| Bilateral { pixels, mm: None, ..filter });
}

fn set_edge(s: &mut Settings, value: f64) {
    if let Some(filter) = &mut s.distance.bilateral {
        filter.distance = value;
    }
}

fn smoothing(s: &Settings) -> f64 {
    s.slices.smooth.map_or(0.0, |f| f.lateral.max(f.depth))
}

/// Scales an existing Gaussian in proportion. A new one is isotropic in the slice and includes the neighbouring slices.
fn set_smoothing(s: &mut Settings, value: f64) {
    let Some(wide) = above(value, 1e-3) else { return s.slices.smooth = None };
    let (filter, was) = (s.slices.smooth.unwrap_or_default(), smoothing(s));
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
