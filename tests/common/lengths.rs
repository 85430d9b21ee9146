//! The settings that are lengths, each with what becomes of it when a volume is scaled.

use echolume::low_level::scene::{Edge, EnhancedSigma, PeronaMalik, Settings, Sigma, Smooth};

/// A setting in mm, in a power of mm, or in mm by a root of mm.
pub struct Length {
    /// As `--set` takes it.
    pub path: &'static str,
    /// The power of the factor that the volume is scaled by.
    pub power: f64,
    scale: fn(&mut Settings, f64),
}

const fn length(path: &'static str, scale: fn(&mut Settings, f64)) -> Length {
    Length { path, power: 1.0, scale }
}

const fn power(path: &'static str, power: f64, scale: fn(&mut Settings, f64)) -> Length {
    Length { path, power, scale }
}

/// All of them. `tests/unit_pure/lengths.rs` compares the list with docs/settings.md.
pub const LENGTHS: &[Length] = &[
    power("floating", 3.0, |s, k| s.floating *= k),
    length("conditioning.low_pass_mm", |s, k| all(&mut s.conditioning.low_pass_mm, k)),
    length("conditioning.tgc.depth", |s, k| s.conditioning.tgc.iter_mut().for_each(|gain| gain.depth *= k)),
    length("slices.sigma.window_mm", |s, k| window(&mut s.slices.sigma, k)),
    length("slices.enhanced_sigma.window_mm", |s, k| start(&mut s.slices.enhanced_sigma, k)),
    length("slices.enhanced_sigma.largest_mm", |s, k| largest(&mut s.slices.enhanced_sigma, k)),
    length("slices.perona_malik.width_mm", |s, k| width(&mut s.slices.perona_malik, k)),
    length("slices.smooth.lateral", |s, k| lateral(&mut s.slices.smooth, k)),
    length("slices.smooth.depth", |s, k| depth(&mut s.slices.smooth, k)),
    length("slices.smooth.elevation_mm", |s, k| elevation(&mut s.slices.smooth, k)),
    length("region.lateral", |s, k| all(s.region.lateral.iter_mut().flatten(), k)),
    length("region.depth", |s, k| all(s.region.depth.iter_mut().flatten(), k)),
    length("region.elevation", |s, k| all(s.region.elevation.iter_mut().flatten(), k)),
    length("region.start_curve", |s, k| all(s.region.start_curve.iter_mut().flatten().flatten(), k)),
    length("region.fade", |s, k| s.region.fade *= k),
    length("clip.at", |s, k| all(s.clip.iter_mut().flat_map(|clip| &mut clip.at), k)),
    length("cuts.contour", |s, k| all(s.cuts.iter_mut().flat_map(|cut| &mut cut.contour).flatten(), k)),
    length("cuts.depth", |s, k| all(s.cuts.iter_mut().flat_map(|cut| &mut cut.depth), k)),
    length("cuts.view.at", |s, k| all(s.cuts.iter_mut().flat_map(|cut| &mut cut.view.at), k)),
    length("cuts.view.eye", |s, k| all(s.cuts.iter_mut().flat_map(|cut| &mut cut.view.eye), k)),
    length("cuts.brush.radius", |s, k| brushes(s).for_each(|brush| brush.radius *= k)),
    length("cuts.brush.strokes", |s, k| all(brushes(s).flat_map(|brush| &mut brush.strokes).flatten().flatten(), k)),
    length("camera.target", |s, k| all(s.camera.target.iter_mut().flatten(), k)),
    length("ray.step", |s, k| all(&mut s.ray.step, k)),
    length("volume.start_depth", |s, k| all(&mut s.volume.start_depth, k)),
    power("volume.extinction", -1.0, |s, k| all(&mut s.volume.extinction, k)),
    length("surface.start_depth", |s, k| all(&mut s.surface.start_depth, k)),
    length("surface.edge", |s, k| {
        if let Some(Edge::Length(edge)) = &mut s.surface.edge {
            *edge *= k;
        }
    }),
    length("surface.colour_depth", |s, k| s.surface.colour_depth *= k),
    length("projection.start_depth", |s, k| all(&mut s.projection.start_depth, k)),
    length("planes.position", |s, k| all(s.planes.position.iter_mut().flatten(), k)),
    length("planes.thickness", |s, k| s.planes.thickness *= k),
    length("planes.spacing", |s, k| all(&mut s.planes.spacing, k)),
    length("planes.smooth.lateral", |s, k| lateral(&mut s.planes.smooth, k)),
    length("planes.smooth.depth", |s, k| depth(&mut s.planes.smooth, k)),
    length("planes.smooth.elevation_mm", |s, k| elevation(&mut s.planes.smooth, k)),
    length("planes.curve.points", |s, k| all(s.planes.curve.iter_mut().flat_map(|c| &mut c.points).flatten(), k)),
    length("cube.inset.left", |s, k| s.cube.inset.left *= k),
    length("cube.inset.right", |s, k| s.cube.inset.right *= k),
    length("cube.inset.near", |s, k| s.cube.inset.near *= k),
    length("cube.inset.far", |s, k| s.cube.inset.far *= k),
    length("cube.inset.bottom", |s, k| s.cube.inset.bottom *= k),
    length("cube.inset.top", |s, k| s.cube.inset.top *= k),
    length("distance.median_mm", |s, k| all(&mut s.distance.median_mm, k)),
    length("distance.bilateral.mm", |s, k| all(s.distance.bilateral.iter_mut().flat_map(|b| &mut b.mm), k)),
    length("distance.bilateral.distance", |s, k| all(s.distance.bilateral.iter_mut().map(|b| &mut b.distance), k)),
    length("distance.sigma.window_mm", |s, k| window(&mut s.distance.sigma, k)),
    length("distance.sigma.sigma", |s, k| all(s.distance.sigma.iter_mut().map(|f| &mut f.sigma), k)),
    length("distance.enhanced_sigma.window_mm", |s, k| start(&mut s.distance.enhanced_sigma, k)),
    length("distance.enhanced_sigma.largest_mm", |s, k| largest(&mut s.distance.enhanced_sigma, k)),
    length("distance.enhanced_sigma.sigma", |s, k| {
        all(s.distance.enhanced_sigma.iter_mut().map(|f| &mut f.sigma), k);
    }),
    length("distance.enhanced_sigma.edge", |s, k| all(s.distance.enhanced_sigma.iter_mut().map(|f| &mut f.edge), k)),
    length("distance.perona_malik.edge", |s, k| all(s.distance.perona_malik.iter_mut().map(|f| &mut f.edge), k)),
    length("distance.perona_malik.width_mm", |s, k| width(&mut s.distance.perona_malik, k)),
    length("light.position", |s, k| s.light.position.iter_mut().for_each(|place| *place *= k)),
    length("light.cliff", |s, k| s.light.cliff *= k),
    length("light.shadow.reach", |s, k| all(s.light.shadow.iter_mut().map(|shadow| &mut shadow.reach), k)),
    length("light.shadow.thickness", |s, k| all(s.light.shadow.iter_mut().map(|shadow| &mut shadow.thickness), k)),
    length("light.shadow.bias", |s, k| all(s.light.shadow.iter_mut().map(|shadow| &mut shadow.bias), k)),
    length("light.occlusion.radius", |s, k| all(s.light.occlusion.iter_mut().map(|o| &mut o.radius), k)),
    length("light.skin.depth", |s, k| all(s.light.skin.iter_mut().map(|skin| &mut skin.depth), k)),
    length("light.volume.cell", |s, k| all(s.light.volume.iter_mut().flat_map(|v| &mut v.cell), k)),
    length("light.volume.depth", |s, k| all(s.light.volume.iter_mut().map(|v| &mut v.depth), k)),
    // The variance of light grows with its path.
    power("light.volume.widening", 0.5, |s, k| all(s.light.volume.iter_mut().map(|v| &mut v.widening), k)),
    length("light.volume.scatter", |s, k| all(s.light.volume.iter_mut().map(|v| &mut v.scatter), k)),
    length("light.volume.reach", |s, k| all(s.light.volume.iter_mut().map(|v| &mut v.reach), k)),
    power("light.volume.slope", -1.0, |s, k| all(s.light.volume.iter_mut().map(|v| &mut v.slope), k)),
];

/// The settings of the same picture of a volume that is so many times as large along each axis.
pub fn scaled(settings: &Settings, factor: f64) -> Settings {
    let mut settings = settings.clone();
    LENGTHS.iter().for_each(|length| (length.scale)(&mut settings, factor.powf(length.power)));
    settings
}

fn all<'a>(values: impl IntoIterator<Item = &'a mut f64>, factor: f64) {
    values.into_iter().for_each(|value| *value *= factor);
}

fn brushes(settings: &mut Settings) -> impl Iterator<Item = &mut echolume::low_level::scene::Brush> {
    settings.cuts.iter_mut().flat_map(|cut| &mut cut.brush)
}

fn window(filter: &mut Option<Sigma>, k: f64) {
    all(filter.iter_mut().flat_map(|filter| &mut filter.window_mm), k);
}

fn start(filter: &mut Option<EnhancedSigma>, k: f64) {
    all(filter.iter_mut().flat_map(|filter| &mut filter.window_mm), k);
}

fn largest(filter: &mut Option<EnhancedSigma>, k: f64) {
    all(filter.iter_mut().flat_map(|filter| &mut filter.largest_mm), k);
}

fn width(filter: &mut Option<PeronaMalik>, k: f64) {
    all(filter.iter_mut().flat_map(|filter| &mut filter.width_mm), k);
}

fn lateral(smooth: &mut Option<Smooth>, k: f64) {
    all(smooth.iter_mut().map(|smooth| &mut smooth.lateral), k);
}

fn depth(smooth: &mut Option<Smooth>, k: f64) {
    all(smooth.iter_mut().map(|smooth| &mut smooth.depth), k);
}

fn elevation(smooth: &mut Option<Smooth>, k: f64) {
    all(smooth.iter_mut().flat_map(|smooth| &mut smooth.elevation_mm), k);
}
