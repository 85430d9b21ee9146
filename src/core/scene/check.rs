//! Checks of settings. Each error names the setting and its limits.

use super::planes::{MAX_SLAB, MAX_TILES, SAME_POINT};
use super::{
    Bilateral, CINE_SPEEDS, Cine, Clip, Compositing, Conditioning, Curve, Distance, Edge, Elevation, EnhancedSigma,
    Layout, Light, MAX_CLIPS, MAX_CURVE_POINTS, MAX_DEVIATION, MAX_PICTURE, MAX_WINDOW, Mode, Noise, PeronaMalik,
    Scene, SceneError, Scheme, Settings, Sigma, Smooth, refuse, transfer,
};
use crate::probe::Geometry;
use glam::DVec3;

/// The least and the largest length of a setting, mm: a thousandth of the smallest voxel that a volume may have, and a thousand of the largest. A scene may so
/// be drawn at any size.
pub(super) const LENGTHS: [f64; 2] = [1e-9, 1e9];

/// A tolerance needs rays whose samples another step takes as well, and whose colour is all that makes a pixel.
fn check_tolerance(settings: &Settings) -> Result<(), SceneError> {
    let (ray, levels) = (&settings.ray, settings.ray.tolerance);
    if levels == 0.0 {
        return Ok(());
    }
    within("ray.tolerance", levels, 0.01, 64.0)?;
    if settings.mode != Mode::Volume || settings.still.is_some() {
        return Ok(());
    }
    let fault = if ray.sliding != 0 {
        "takes other steps, and ray.sliding filters samples at distances of one step: set one of them"
    } else if ray.adaptive && ray.rays > 1 {
        "chooses the steps of each pixel, ray.adaptive the rays: set one of them"
    } else {
        return Ok(());
    };
    refuse("ray.tolerance", fault)
}

/// Checks that need no geometry.
pub(super) fn check(settings: &Settings) -> Result<(), SceneError> {
    let [width, height] = settings.picture.size;
    if !(1..=MAX_PICTURE).contains(&width) || !(1..=MAX_PICTURE).contains(&height) {
        return refuse("picture.size", format!("is {width}x{height}, each edge must lie in 1..={MAX_PICTURE}"));
    }
    within("ray.spread", settings.ray.spread, 0.0, 1.0)?;
    within("ray.samples_per_voxel", f64::from(settings.ray.samples_per_voxel.unwrap_or(1)), 1.0, 16.0)?;
    if let Some(brick) = settings.ray.brick.filter(|brick| *brick != 0) {
        within("ray.brick", f64::from(brick), 4.0, 64.0)?;
    }
    within("ray.entries", f64::from(settings.ray.entries), 2.0, 65536.0)?;
    if !matches!(settings.ray.sliding, 0 | 3 | 5) {
        return refuse("ray.sliding", format!("is {}, must be 0 (none), 3 or 5", settings.ray.sliding));
    }
    check_clip(&settings.clip)?;
    within("cap.level", settings.cap.level.unwrap_or(0.0), 0.0, 1.0)?;
    within("ray.rays", f64::from(settings.ray.rays), 1.0, 4.0)?;
    let ray = &settings.ray;
    if !matches!(ray.subsampling, 1 | 2 | 4 | 8) {
        return refuse("ray.subsampling", format!("is {}, must be 1 (every pixel), 2, 4 or 8", ray.subsampling));
    }
    if ray.subsampling > 1 && ray.rays > 1 {
        let (pixels, rays) = (ray.subsampling.pow(2), ray.rays);
        return refuse(
            "ray.subsampling",
            format!("takes one ray for {pixels} pixels, ray.rays={rays} several for each: set one of them"),
        );
    }
    check_tolerance(settings)?;
    let [width, height] = super::camera::ray_size(settings);
    if width > MAX_PICTURE || height > MAX_PICTURE {
        return refuse("ray.rays", format!("makes {width}x{height} rays, each edge must lie in 1..={MAX_PICTURE}"));
    }
    if settings.layout == Layout::Four && settings.mode.is_flat() {
        return refuse("layout", "four shows three planes and a rendering: the mode must be one that renders");
    }
    if settings.layout == Layout::Pair && settings.mode != Mode::Surface {
        return refuse("layout", "pair shows a volume and the surface found in the same march: set mode=surface");
    }
    within("floating", settings.floating, 0.0, LENGTHS[1].powi(3))?;
    within("unveil.offset", settings.unveil.offset, -100.0, 100.0)?;
    within("unveil.smoothing", settings.unveil.smoothing, 0.0, 20.0)?;
    let s = &settings.slices;
    within("slices.pixels", f64::from(s.pixels), 2.0, 4096.0)?;
    check_smooth(
        s.smooth,
        [
            "slices.smooth.lateral",
            "slices.smooth.depth",
            "slices.smooth.elevation",
            "slices.smooth.elevation_mm",
            "slices.smooth.kernel",
        ],
    )?;
    let smooths =
        s.smooth.is_some_and(|smooth| smooth.elevation_mm.unwrap_or(smooth.elevation) > 0.0 || smooth.kernel.is_some());
    if settings.ray.elevation == Elevation::BsplineSharp && smooths {
        return refuse("ray.elevation", "bspline-sharp sharpens across slices, slices.smooth smooths: set one of them");
    }
    check_sigma("slices.sigma", s.sigma)?;
    within("slices.estimator_edge", s.estimator_edge, 0.0, f64::INFINITY)?;
    check_enhanced("slices.enhanced_sigma", s.enhanced_sigma)?;
    check_perona_malik("slices.perona_malik", s.perona_malik)?;
    check_distance(&settings.distance)?;
    check_sigma("post.sigma", settings.post.sigma)?;
    check_enhanced("post.enhanced_sigma", settings.post.enhanced_sigma)?;
    check_perona_malik("post.perona_malik", settings.post.perona_malik)?;
    if settings.post.perona_malik.is_some_and(|p| matches!(p.scheme, Scheme::AosRichardson | Scheme::Rkl1)) {
        return refuse("post.perona_malik", "pictures take the schemes explicit and aos only");
    }
    let post = &settings.post;
    for (field, has_mm) in [
        ("post.sigma", post.sigma.is_some_and(|s| s.window_mm.is_some())),
        ("post.enhanced_sigma", post.enhanced_sigma.is_some_and(|e| e.window_mm.or(e.largest_mm).is_some())),
        ("post.perona_malik", post.perona_malik.is_some_and(|p| p.width_mm.is_some())),
    ] {
        if has_mm {
            return refuse(field, "filters the pixels of a finished picture: give its size in pixels");
        }
    }
    if settings.post.enhanced_sigma.is_some_and(|e| e.growth) {
        return refuse("post.enhanced_sigma", NO_GROWTH);
    }
    for (field, [low, high]) in [
        ("volume.window", settings.volume.window),
        ("surface.window", settings.surface.window),
        ("projection.window", settings.projection.window),
        ("planes.window", settings.planes.window),
        ("cube.window", settings.cube.window),
    ] {
        if !(low.is_finite() && high.is_finite() && low < high) {
            return refuse(field, format!("[{low}, {high}] must be finite and rise"));
        }
    }
    let c = &settings.camera;
    for (field, value) in [("camera.azimuth", c.azimuth), ("camera.elevation", c.elevation), ("camera.roll", c.roll)] {
        within(field, value, -360.0, 360.0)?;
    }
    within("camera.zoom", c.zoom, 1e-3, 1e3)?;
    within("camera.field_of_view", c.field_of_view, 0.0, 150.0)?;
    if c.field_of_view > 0.0 && c.field_of_view < 1.0 {
        // The camera would be so far away that f32 cannot resolve the body.
        return refuse(
            "camera.field_of_view",
            format!("is {}, must be 0 (parallel) or at least 1 deg", c.field_of_view),
        );
    }
    for value in c.target.iter().flatten() {
        within("camera.target", *value, -1e10, 1e10)?;
    }
    if let Some(step) = settings.ray.step {
        length("ray.step", step)?;
    }
    within("ray.early_end", settings.ray.early_end, 0.0, 1.0)?;
    if let Some(fault) = transfer::fault(&settings.volume.transfer) {
        return refuse("volume.transfer", fault);
    }
    if let Err(fault) = transfer::entries(&settings.volume) {
        let field = if settings.volume.entries.is_some() { "volume.entries" } else { "volume.transfer" };
        return refuse(field, fault);
    }
    let v = &settings.volume;
    within("volume.threshold", v.threshold, 0.0, 1.0)?;
    within("volume.hit", v.hit, 1e-3, 1.0)?;
    within("volume.veil", v.veil, 0.0, 1.0)?;
    for tint in [v.near_tint, v.far_tint] {
        tint.iter().try_for_each(|c| within("volume.near_tint, volume.far_tint", *c, 0.0, 10.0))?;
    }
    let f = &settings.surface;
    within("surface.threshold", f.threshold, 1e-6, 1.0)?;
    within("surface.rough_threshold", f.rough_threshold.unwrap_or(f.threshold), 1e-6, 1.0)?;
    if let Some(Edge::Length(edge)) = f.edge {
        length("surface.edge", edge)?;
    }
    within("surface.noise", f.noise, 0.0, 10.0)?;
    within("surface.rough", f64::from(f.rough), 1.0, 8.0)?;
    within("surface.number", f64::from(f.number), 1.0, 8.0)?;
    length("surface.colour_depth", f.colour_depth)?;
    check_light(&settings.light)?;
    within("region.fade", settings.region.fade, 0.0, LENGTHS[1])?;
    within("volume.extinction", settings.volume.extinction.unwrap_or(1.0), 1.0 / LENGTHS[1], 1.0 / LENGTHS[0])?;
    if settings.volume.compositing == Compositing::Exponential {
        let table = "needs volume.compositing=riemann, corrected or pre-integrated: exponential takes the light of a step from a table";
        if settings.light.volume.is_some() {
            return refuse("light.volume", table);
        }
        if settings.region.fade > 0.0 {
            return refuse("region.fade", table);
        }
    }
    within("post.brightness", settings.post.brightness, -1.0, 1.0)?;
    within("post.contrast", settings.post.contrast, 0.0, 10.0)?;
    within("post.gamma", settings.post.gamma, 0.1, 10.0)
}

fn check_clip(planes: &[Clip]) -> Result<(), SceneError> {
    if planes.len() > MAX_CLIPS {
        return refuse("clip", format!("has {} planes, at most {MAX_CLIPS}", planes.len()));
    }
    for plane in planes {
        for value in plane.at {
            within("clip.at", value, -1e10, 1e10)?;
        }
        let normal = DVec3::from(plane.normal);
        if !normal.is_finite() || normal.length() < 1e-9 {
            return refuse("clip.normal", "must be finite and not zero");
        }
    }
    Ok(())
}

/// Checks the conditioning of lines by itself and against the geometry of the frames.
pub(super) fn check_conditioning(c: &Conditioning, geometry: &Geometry) -> Result<(), SceneError> {
    for (i, point) in c.tgc.iter().enumerate() {
        within("conditioning.tgc", point.depth, 0.0, 1e4)?;
        within("conditioning.tgc", point.gain, -120.0, 120.0)?;
        if i > 0 && c.tgc[i - 1].depth >= point.depth {
            return refuse("conditioning.tgc", format!("point {}: depths must rise from point to point", i + 1));
        }
    }
    if let Some(range) = c.dynamic_range {
        within("conditioning.dynamic_range", range, 1.0, 200.0)?;
    }
    within("conditioning.compressed_range", c.compressed_range, 1.0, 200.0)?;
    if let Some(deviation) = c.low_pass {
        within("conditioning.low_pass", deviation, 0.0, MAX_DEVIATION)?;
    }
    if let Some(mm) = c.low_pass_mm {
        within("conditioning.low_pass_mm", mm, 0.0, LENGTHS[1])?;
    }
    if let Some(samples) = c.samples {
        within("conditioning.samples", f64::from(samples), 2.0, 65536.0)?;
    }
    match geometry {
        Geometry::Cartesian(_) => {
            // `samples` limits the length of lines. Without lines it has no effect and is allowed.
            for (field, asked) in [
                ("conditioning.tgc", !c.tgc.is_empty()),
                ("conditioning.dynamic_range", c.dynamic_range.is_some()),
                ("conditioning.low_pass", c.low_pass.is_some_and(|d| d > 0.0)),
                ("conditioning.low_pass_mm", c.low_pass_mm.is_some_and(|d| d > 0.0)),
            ] {
                if asked {
                    return refuse(field, "conditions the lines of polar frames, and this volume is Cartesian already");
                }
            }
            Ok(())
        }
        Geometry::Sweep(probe) => {
            let factor = c.factor(probe.samples);
            // One in mm is cut to the largest.
            match c.low_pass_mm.is_some() || c.deviation(factor) <= MAX_DEVIATION {
                true => Ok(()),
                false => refuse(
                    "conditioning.samples",
                    format!(
                        "makes one sample of {factor}, whose low pass of {} samples is more than the {MAX_DEVIATION} that \
                         can be filtered; ask for at least {} samples, or set conditioning.low_pass",
                        c.deviation(factor),
                        probe.samples.div_ceil(2 * MAX_DEVIATION as usize)
                    ),
                ),
            }
        }
    }
}

fn check_light(l: &Light) -> Result<(), SceneError> {
    if !l.direction.is_finite() || l.direction.length() < 1e-6 {
        return refuse("light.direction", "must be finite and not zero");
    }
    for value in l.position.iter().flat_map(|p| p.to_array()) {
        within("light.position", value, -1e10, 1e10)?;
    }
    let shadow = l.shadow.unwrap_or_default();
    let occlusion = l.occlusion.unwrap_or_default();
    let skin = l.skin.unwrap_or_default();
    let volume = l.volume.unwrap_or_default();
    if !volume.back_direction.is_finite() || volume.back_direction.length() < 1e-6 {
        return refuse("light.volume.back_direction", "must be finite and not zero");
    }
    if l.volume.is_some() && l.position.is_some() {
        return refuse("light.volume", "takes a distant light: leave light.position out");
    }
    let [least, most] = LENGTHS;
    for (field, value, low, high) in [
        ("light.ambient", l.ambient, 0.0, 10.0),
        ("light.diffuse", l.diffuse, 0.0, 10.0),
        ("light.specular", l.specular, 0.0, 10.0),
        ("light.shininess", l.shininess, 0.0, 1e6),
        ("light.texture", l.texture, 0.0, 1.0),
        ("light.cliff", l.cliff, 0.0, most),
        ("light.shadow.strength", shadow.strength, 0.0, 1.0),
        ("light.shadow.softness", shadow.softness, 0.0, 10.0),
        ("light.shadow.reach", shadow.reach, least, most),
        ("light.shadow.thickness", shadow.thickness, 0.0, most),
        ("light.shadow.bias", shadow.bias, 0.0, most),
        ("light.occlusion.radius", occlusion.radius, least, most),
        ("light.occlusion.strength", occlusion.strength, 0.0, 4.0),
        ("light.skin.wrap", skin.wrap, 0.0, 1.0),
        ("light.skin.translucency", skin.translucency, 0.0, 1.0),
        ("light.skin.depth", skin.depth, 0.0, most),
        ("light.volume.cell", volume.cell.unwrap_or(1.0), least, most),
        ("light.volume.cells", f64::from(volume.cells), 1e3, 1e9),
        ("light.volume.taps", f64::from(volume.taps), 1.0, 4.0),
        ("light.volume.depth", volume.depth, least, most),
        ("light.volume.warmth", volume.warmth, 0.0, 2.0),
        ("light.volume.widening", volume.widening, 0.0, most.sqrt()),
        ("light.volume.scatter", volume.scatter, 0.0, most),
        ("light.volume.reach", volume.reach, least, most),
        ("light.volume.slope", volume.slope, 1.0 / most, 1.0 / least),
        ("light.volume.relief", volume.relief, 0.0, 1.0),
        ("light.volume.wrap", volume.wrap, 0.0, 1.0),
        ("light.volume.back", volume.back, 0.0, 10.0),
        ("light.volume.exposure", volume.exposure, 0.0, 100.0),
    ] {
        within(field, value, low, high)?;
    }
    let colours = [
        ("light.colour", l.colour),
        ("light.surface_colour", l.surface_colour),
        ("light.skin.colour", skin.colour),
        ("light.volume.back_colour", volume.back_colour),
        ("light.volume.ground.middle", volume.ground.unwrap_or_default().middle),
        ("light.volume.ground.edge", volume.ground.unwrap_or_default().edge),
    ];
    colours.iter().try_for_each(|(field, colour)| colour.iter().try_for_each(|v| within(field, *v, 0.0, 10.0)))
}

pub(super) fn check_cine(cine: &Cine) -> Result<(), SceneError> {
    within("cine.speed", cine.speed, CINE_SPEEDS[0], CINE_SPEEDS[1])?;
    match (cine.first, cine.last) {
        (Some(first), Some(last)) if first > last => {
            refuse("cine.last", format!("is {last}, must not be below cine.first, {first}"))
        }
        _ => Ok(()),
    }
}

pub(super) fn within(field: &'static str, value: f64, low: f64, high: f64) -> Result<(), SceneError> {
    match value >= low && value <= high {
        true => Ok(()),
        false => refuse(field, format!("is {value}, must lie in {low}..={high}")),
    }
}

/// A length, mm.
fn length(field: &'static str, mm: f64) -> Result<(), SceneError> {
    let [least, most] = LENGTHS;
    match (least..=most).contains(&mm) {
        true => Ok(()),
        false => refuse(field, format!("is {mm} mm, must lie in {least:e}..={most:e} mm")),
    }
}

/// A size of a filter in mm.
fn in_mm(field: &'static str, mm: Option<f64>) -> Result<(), SceneError> {
    mm.map_or(Ok(()), |mm| length(field, mm))
}

/// `key`: the name of the window in that table, as the user wrote it.
fn check_window(field: &'static str, key: &str, window: u32) -> Result<(), SceneError> {
    match window % 2 == 1 && (3..=MAX_WINDOW).contains(&window) {
        true => Ok(()),
        false => refuse(field, format!("{key} is {window}, must be odd and lie in 3..={MAX_WINDOW}")),
    }
}

fn check_sigma(field: &'static str, sigma: Option<Sigma>) -> Result<(), SceneError> {
    let Some(sigma) = sigma else { return Ok(()) };
    in_mm(field, sigma.window_mm)?;
    check_window(field, "window", sigma.window)?;
    // Infinity is allowed: the filter is then the box mean.
    match sigma.sigma >= 0.0 {
        true => Ok(()),
        false => refuse(field, format!("sigma is {}, must be at least 0", sigma.sigma)),
    }
}

const NO_GROWTH: &str = "growth is counted on slices only: leave it out";

fn check_distance(d: &Distance) -> Result<(), SceneError> {
    in_mm("distance.median_mm", d.median_mm)?;
    if d.median > 0 {
        check_window("distance.median", "window", d.median)?;
    }
    if let Some(b) = d.bilateral {
        match b.mm {
            Some(mm) => in_mm("distance.bilateral.mm", Some(mm))?,
            None => within("distance.bilateral.pixels", b.pixels, Bilateral::MIN_PIXELS, Bilateral::MAX_PIXELS)?,
        }
        length("distance.bilateral.distance", b.distance)?;
        within("distance.bilateral.repeat", f64::from(b.repeat), 1.0, 16.0)?;
    }
    check_sigma("distance.sigma", d.sigma)?;
    check_enhanced("distance.enhanced_sigma", d.enhanced_sigma)?;
    check_perona_malik("distance.perona_malik", d.perona_malik)?;
    let noises =
        [("distance.sigma", d.sigma.map(|s| s.noise)), ("distance.enhanced_sigma", d.enhanced_sigma.map(|e| e.noise))];
    for (field, noise) in noises {
        // The noise of a distance does not depend on the distance.
        if noise == Some(Noise::Multiplicative) {
            return refuse(
                field,
                "noise is multiplicative, distances take additive only: leave it out, sigma is in mm",
            );
        }
    }
    if d.enhanced_sigma.is_some_and(|e| e.growth) {
        return refuse("distance.enhanced_sigma", NO_GROWTH);
    }
    match d.perona_malik {
        Some(p) if p.scheme != Scheme::Explicit => {
            refuse("distance.perona_malik", "distances take scheme explicit only: misses tear the rows of others")
        }
        _ => Ok(()),
    }
}

fn check_enhanced(field: &'static str, enhanced: Option<EnhancedSigma>) -> Result<(), SceneError> {
    let Some(e) = enhanced else { return Ok(()) };
    check_sigma(field, Some(Sigma { window: e.window, window_mm: e.window_mm, sigma: e.sigma, noise: e.noise }))?;
    in_mm(field, e.largest_mm)?;
    check_window(field, "largest", e.largest)?;
    check_edge(field, e.edge)?;
    // A window in mm is resolved to one that is no larger than the largest.
    match e.largest < e.window && e.window_mm.is_none() && e.largest_mm.is_none() {
        true => refuse(field, format!("largest is {}, less than window {}", e.largest, e.window)),
        false => Ok(()),
    }
}

fn check_perona_malik(field: &'static str, settings: Option<PeronaMalik>) -> Result<(), SceneError> {
    let Some(p) = settings else { return Ok(()) };
    check_edge(field, p.edge)?;
    in_mm(field, p.width_mm)?;
    if !(1..=1000).contains(&p.repeat) {
        return refuse(field, format!("repeat is {}, must lie in 1..=1000", p.repeat));
    }
    match p.scheme {
        // With four neighbours and a step above 1/4, a checkerboard grows at every step.
        Scheme::Explicit if !(p.step > 0.0 && p.step <= 0.25) => refuse(
            field,
            format!(
                "step is {}, the explicit scheme is stable in 0..=0.25 only: take less, or scheme 'aos', stable at any step",
                p.step
            ),
        ),
        Scheme::Rkl1 if !(p.step > 0.0 && p.step <= 200.0) => {
            refuse(field, format!("step is {}, must lie above 0 and be at most 200 for scheme 'rkl1'", p.step))
        }
        Scheme::Aos | Scheme::AosRichardson if !(p.step > 0.0 && p.step <= 1e9) => {
            refuse(field, format!("step is {}, must lie above 0 and be at most 1e9", p.step))
        }
        _ => Ok(()),
    }
}

/// Checks an edge constant. Infinity is allowed: no difference is then an edge.
fn check_edge(field: &'static str, edge: f64) -> Result<(), SceneError> {
    match edge >= 0.0 {
        true => Ok(()),
        false => refuse(field, format!("edge is {edge}, must be at least 0")),
    }
}

/// `fields`: the names of its settings.
fn check_smooth(smooth: Option<Smooth>, fields: [&'static str; 5]) -> Result<(), SceneError> {
    let Some(smooth) = smooth else { return Ok(()) };
    let [lateral, depth, elevation, elevation_mm, kernel] = fields;
    let deviations = [
        (lateral, smooth.lateral, LENGTHS[1]),
        (depth, smooth.depth, LENGTHS[1]),
        (elevation, smooth.elevation, 1000.0),
        (elevation_mm, smooth.elevation_mm.unwrap_or(0.0), LENGTHS[1]),
    ];
    deviations.iter().try_for_each(|(field, deviation, most)| within(field, *deviation, 0.0, *most))?;
    match smooth.kernel {
        Some(taps) if taps != 3 && taps != 5 => refuse(kernel, format!("is {taps}, must be 3 or 5")),
        Some(_) if deviations.iter().any(|(_, deviation, _)| *deviation != 0.0) => {
            refuse(kernel, "stands instead of lateral, depth and elevation: set it, or them")
        }
        _ => Ok(()),
    }
}

/// Checks of planes, tiles and the block that need no geometry.
pub(super) fn check_planes(settings: &Settings) -> Result<(), SceneError> {
    let p = &settings.planes;
    for value in p.position.iter().flatten() {
        within("planes.position", *value, -1e10, 1e10)?;
    }
    for (field, value) in [("planes.azimuth", p.azimuth), ("planes.tilt", p.tilt), ("planes.roll", p.roll)] {
        within(field, value, -360.0, 360.0)?;
    }
    check_smooth(
        p.smooth,
        [
            "planes.smooth.lateral",
            "planes.smooth.depth",
            "planes.smooth.elevation",
            "planes.smooth.elevation_mm",
            "planes.smooth.kernel",
        ],
    )?;
    within("planes.thickness", p.thickness, 0.0, LENGTHS[1])?;
    within("planes.zoom", p.zoom, 1e-3, 1e3)?;
    within("planes.columns", f64::from(p.columns), 1.0, f64::from(MAX_TILES))?;
    within("planes.rows", f64::from(p.rows), 1.0, f64::from(MAX_TILES))?;
    if let Some(spacing) = p.spacing {
        length("planes.spacing", spacing)?;
    }
    check_curve(p.curve.as_ref())?;
    let (inset, tilt) = (&settings.cube.inset, &settings.cube.tilt);
    for (field, inset, tilt) in [
        ("cube.inset.left, cube.tilt.left", inset.left, tilt.left),
        ("cube.inset.right, cube.tilt.right", inset.right, tilt.right),
        ("cube.inset.near, cube.tilt.near", inset.near, tilt.near),
        ("cube.inset.far, cube.tilt.far", inset.far, tilt.far),
        ("cube.inset.bottom, cube.tilt.bottom", inset.bottom, tilt.bottom),
        ("cube.inset.top, cube.tilt.top", inset.top, tilt.top),
    ] {
        within(field, inset, 0.0, LENGTHS[1])?;
        // A face that is tilted to 90 degrees would no longer bound its side.
        tilt.iter().try_for_each(|angle| within(field, *angle, -80.0, 80.0))?;
    }
    within("cube.shading", settings.cube.shading, 0.0, 1.0)
}

fn check_curve(curve: Option<&Curve>) -> Result<(), SceneError> {
    let Some(Curve { points, .. }) = curve else { return Ok(()) };
    let (field, count) = ("planes.curve.points", points.len());
    if !(2..=MAX_CURVE_POINTS).contains(&count) {
        let fault = format!("has {count} points, a line has 2 to {MAX_CURVE_POINTS}");
        return refuse(field, fault);
    }
    points.iter().flatten().try_for_each(|value| within(field, *value, -LENGTHS[1], LENGTHS[1]))?;
    let apart = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
    let extent = points.iter().map(|point| apart(&[points[0], *point])).fold(0.0, f64::max);
    match points.windows(2).position(|pair| apart(pair) <= SAME_POINT * extent) {
        Some(n) => refuse(field, format!("points {} and {} coincide: leave one of them out", n + 1, n + 2)),
        None => Ok(()),
    }
}

/// Checks that need the volume: number of tiles and samples, and whether anything is left of the block.
pub(super) fn check_planes_resolved(scene: &Scene) -> Result<(), SceneError> {
    if scene.settings.mode == Mode::Cube {
        scene.check_block()?;
    }
    if !scene.cuts_planes() {
        return Ok(());
    }
    let tiles = scene.tile_count();
    if tiles > MAX_TILES {
        return refuse("planes.columns, planes.rows", format!("make {tiles} tiles, at most {MAX_TILES} can be drawn"));
    }
    let ([columns, rows], [width, height]) = (scene.tile_grid(), scene.picture_size());
    if columns > width || rows > height {
        return refuse(
            "picture.size",
            format!("is {width}x{height}: {columns} x {rows} tiles need at least one pixel each"),
        );
    }
    let samples = scene.slab_samples();
    if samples > MAX_SLAB {
        let thickness = scene.settings.planes.thickness;
        return refuse(
            "planes.thickness",
            format!("{thickness} mm makes {samples:.0} samples through the slab, at most {MAX_SLAB}"),
        );
    }
    Ok(())
}
