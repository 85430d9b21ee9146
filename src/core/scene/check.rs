//! Checks of several settings together, and of what is no number; `number` checks each number alone. Each error names the setting and its limits.

use super::planes::{MAX_SLAB, MAX_TILES, SAME_POINT};
use super::{
    Clip, Compositing, Conditioning, Curve, Detector, Distance, Elevation, EnhancedSigma, Layout, Light,
    MAX_BODY_MARKS, MAX_CLIPS, MAX_CURVE_POINTS, MAX_DEVIATION, MAX_PICTURE, Mode, Noise, PeronaMalik, Place, Planes,
    Scene, SceneError, Scheme, Settings, Sign, Smooth, Surface, refuse, transfer,
};
use crate::probe::Geometry;
use glam::DVec3;

/// A tolerance needs rays whose samples another step takes as well, and whose colour is all that makes a pixel.
fn check_tolerance(settings: &Settings) -> Result<(), SceneError> {
    let ray = &settings.ray;
    if ray.tolerance == 0.0 || settings.mode != Mode::Volume || settings.still.is_some() {
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

/// A detector that chooses among neighbouring rays looks at all edges of a ray in one march.
fn check_consistent(surface: &Surface) -> Result<(), SceneError> {
    if surface.detector != Detector::Consistent {
        return Ok(());
    }
    for (field, is_other, needed) in [
        ("surface.rough", surface.rough != 1, "1"),
        ("surface.number", surface.number != 1, "1"),
        ("surface.place", surface.place != Place::Peak, "peak"),
    ] {
        if is_other {
            return refuse(field, format!("must be {needed} with surface.detector=consistent"));
        }
    }
    Ok(())
}

/// Checks settings as far as no geometry is needed.
pub(super) fn check(settings: &Settings) -> Result<(), SceneError> {
    check_clip(&settings.clip)?;
    let ray = &settings.ray;
    if ray.subsampling > 1 && ray.rays > 1 {
        let (pixels, rays) = (ray.subsampling.pow(2), ray.rays);
        return refuse(
            "ray.subsampling",
            format!("takes one ray for {pixels} pixels, ray.rays={rays} several for each: set one of them"),
        );
    }
    check_tolerance(settings)?;
    check_consistent(&settings.surface)?;
    let [width, height] = super::camera::ray_size(settings);
    if width > MAX_PICTURE || height > MAX_PICTURE {
        return refuse("ray.rays", format!("makes {width}x{height} rays, each edge must lie in 1..={MAX_PICTURE}"));
    }
    if settings.layout.has_planes() && settings.mode.is_flat() {
        return refuse("layout", "four and beside show planes and a rendering: the mode must be one that renders");
    }
    if settings.drawn.marks.are_mirrored() {
        return refuse(
            "marks.elevation",
            "lateral, depth and elevation are those of a mirror image: exchange the sides of one",
        );
    }
    if settings.surface.sign == Sign::Any && settings.surface.detector != Detector::Threshold {
        return refuse(
            "surface.sign",
            "any takes surface.detector=threshold: the others learn the noise on one side of an edge",
        );
    }
    if settings.layout == Layout::Pair && settings.mode != Mode::Surface {
        return refuse("layout", "pair shows a volume beside a surface: set mode=surface");
    }
    let s = &settings.slices;
    check_smooth(s.smooth, "slices.smooth.kernel")?;
    let smooths =
        s.smooth.is_some_and(|smooth| smooth.elevation_mm.unwrap_or(smooth.elevation) > 0.0 || smooth.kernel.is_some());
    if settings.ray.elevation == Elevation::BsplineSharp && smooths {
        return refuse("ray.elevation", "bspline-sharp sharpens across slices, slices.smooth smooths: set one of them");
    }
    check_enhanced("slices.enhanced_sigma", s.enhanced_sigma)?;
    check_perona_malik("slices.perona_malik", s.perona_malik)?;
    check_distance(&settings.distance)?;
    let post = &settings.post;
    check_enhanced("post.enhanced_sigma", post.enhanced_sigma)?;
    check_perona_malik("post.perona_malik", post.perona_malik)?;
    if post.perona_malik.is_some_and(|p| matches!(p.scheme, Scheme::AosRichardson | Scheme::Rkl1)) {
        return refuse("post.perona_malik", "pictures take the schemes explicit and aos only");
    }
    for (field, has_mm) in [
        ("post.sigma", post.sigma.is_some_and(|s| s.window_mm.is_some())),
        ("post.enhanced_sigma", post.enhanced_sigma.is_some_and(|e| e.window_mm.or(e.largest_mm).is_some())),
        ("post.perona_malik", post.perona_malik.is_some_and(|p| p.width_mm.is_some())),
    ] {
        if has_mm {
            return refuse(field, "filters the pixels of a finished picture: give its size in pixels");
        }
    }
    if post.enhanced_sigma.is_some_and(|e| e.growth) {
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
    if let Some(fault) = transfer::fault(&settings.volume.transfer) {
        return refuse("volume.transfer", fault);
    }
    if let Err(fault) = transfer::entries(&settings.volume) {
        let field = if settings.volume.entries.is_some() { "volume.entries" } else { "volume.transfer" };
        return refuse(field, fault);
    }
    check_light(&settings.light)?;
    if let (Some(first), Some(last)) = (settings.drawn.cine.first, settings.drawn.cine.last)
        && first > last
    {
        return refuse("cine.last", format!("is {last}, must not be below cine.first, {first}"));
    }
    let count = settings.drawn.body_marks.len();
    if count > MAX_BODY_MARKS {
        return refuse("body_marks", format!("has {count} entries, at most {MAX_BODY_MARKS}"));
    }
    if settings.volume.compositing == Compositing::Exponential {
        let table = "needs volume.compositing=riemann, corrected or pre-integrated: exponential takes the light of a step from a table";
        if settings.light.volume.is_some() {
            return refuse("light.volume", table);
        }
        if settings.region.fade > 0.0 {
            return refuse("region.fade", table);
        }
    }
    Ok(())
}

/// Refuses a direction that is not finite, or shorter than `least`.
fn check_direction(field: &'static str, direction: DVec3, least: f64) -> Result<(), SceneError> {
    match direction.is_finite() && direction.length() >= least {
        true => Ok(()),
        false => refuse(field, "must be finite and not zero"),
    }
}

fn check_clip(planes: &[Clip]) -> Result<(), SceneError> {
    if planes.len() > MAX_CLIPS {
        return refuse("clip", format!("has {} planes, at most {MAX_CLIPS}", planes.len()));
    }
    planes.iter().try_for_each(|plane| check_direction("clip.normal", plane.normal.into(), 1e-9))
}

/// Checks the conditioning of lines by itself and against the geometry of the frames.
pub(super) fn check_conditioning(c: &Conditioning, geometry: &Geometry) -> Result<(), SceneError> {
    if let Some(n) = c.tgc.windows(2).position(|pair| pair[0].depth >= pair[1].depth) {
        return refuse("conditioning.tgc", format!("point {}: depths must rise from point to point", n + 2));
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
    let back = l.volume.unwrap_or_default().back_direction;
    check_direction("light.direction", l.direction, 1e-6)?;
    check_direction("light.volume.back_direction", back, 1e-6)?;
    if l.volume.is_some() && l.position.is_some() {
        return refuse("light.volume", "takes a distant light: leave light.position out");
    }
    Ok(())
}

const NO_GROWTH: &str = "growth is counted on slices only: leave it out";

fn check_distance(d: &Distance) -> Result<(), SceneError> {
    if d.bilateral.is_some_and(|b| b.mm.is_none() && b.pixels == 0.0) {
        return refuse("distance.bilateral.pixels", "is 0: set it, or distance.bilateral.mm");
    }
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
    match d.perona_malik.is_some_and(|p| p.scheme != Scheme::Explicit) {
        true => refuse("distance.perona_malik", "distances take scheme explicit only: misses tear the rows of others"),
        false => Ok(()),
    }
}

fn check_enhanced(field: &'static str, enhanced: Option<EnhancedSigma>) -> Result<(), SceneError> {
    let Some(e) = enhanced else { return Ok(()) };
    // A window in mm is resolved to one that is no larger than the largest.
    match e.largest < e.window && e.window_mm.is_none() && e.largest_mm.is_none() {
        true => refuse(field, format!("largest is {}, less than window {}", e.largest, e.window)),
        false => Ok(()),
    }
}

fn check_perona_malik(field: &'static str, settings: Option<PeronaMalik>) -> Result<(), SceneError> {
    let Some(p) = settings else { return Ok(()) };
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

/// `field`: the name of its kernel.
fn check_smooth(smooth: Option<Smooth>, field: &'static str) -> Result<(), SceneError> {
    match smooth {
        Some(Smooth { kernel: Some(_), lateral, depth, elevation, elevation_mm })
            if [lateral, depth, elevation, elevation_mm.unwrap_or(0.0)] != [0.0; 4] =>
        {
            refuse(field, "stands instead of lateral, depth and elevation: set it, or them")
        }
        _ => Ok(()),
    }
}

/// Checks the settings of planes as far as no geometry is needed.
pub(super) fn check_planes(planes: &Planes) -> Result<(), SceneError> {
    check_smooth(planes.smooth, "planes.smooth.kernel")?;
    let Some(Curve { points, .. }) = &planes.curve else { return Ok(()) };
    let (field, count) = ("planes.curve.points", points.len());
    if !(2..=MAX_CURVE_POINTS).contains(&count) {
        return refuse(field, format!("has {count} points, a line has 2 to {MAX_CURVE_POINTS}"));
    }
    let apart = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
    let extent = points.iter().map(|point| apart(&[points[0], *point])).fold(0.0, f64::max);
    match points.windows(2).position(|pair| apart(pair) <= SAME_POINT * extent) {
        Some(n) => refuse(field, format!("points {} and {} coincide: leave one of them out", n + 1, n + 2)),
        None => Ok(()),
    }
}

/// Checks planes against the volume: number of tiles and of samples through a slab, and whether anything is left of the block of mode cube.
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
    let ([columns, rows], [width, height]) = (scene.tile_grid(), scene.tile_area().size);
    if columns > width || rows > height {
        let [width, height] = scene.picture_size();
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
