//! Default settings that follow from the recording itself, so that a recording without a preset gives a useful picture.
//!
//! - Without a preset, windows, threshold and ramp follow from the levels of the echoes ([`EchoLevels`]), and filters from the size of the volume:
//!   volume rendering under light, with a ramp between the threshold and the brighter class.
//! - A single frame is shown as a plane.
//! - Planes and the solid block are cut from a lightly filtered volume over the full sector, whatever a preset of a rendering crops and smooths.
//! - So are the planes beside a rendering, which has its own filters and region.
//! - The solid block is turned and cut. The minimum projection takes a slab: over the whole depth every ray meets fluid or shadow somewhere.
//!
//! What a user sets wins, key by key. A default is left out only where a key that means the same was set: a window and what is drawn through it
//! belong together, and so do the filters of a slice and the sides of the region. Keys of accuracy, such as formats, tables and steps, change no
//! default. No default makes a scene that is refused: it is cut, or left out, and one line says so.

use super::echo_levels::EchoLevels;
use super::load::{Layers, LoadError, preset_settings, put, rebase};
use super::region::{self, insonified_box, slice_grid};
use super::{
    Compositing, EchoHistogram, Elevation, Input, Layout, MAX_DEVIATION, Mode, Scene, SceneError, Settings, Transfer,
    TransferPoint, Volume, transfer,
};
use crate::probe::Geometry;
use crate::tree::ToNode;
use std::path::Path;
use toml::{Table, Value};

/// Presets whose planes are those of their filters. The others smooth and crop the volume for a rendering.
const AS_THEY_ARE: [&str; 2] = ["bmode", "thesis"];
/// Share of the volume's longest edge that the smoothing has as its standard deviation: 1.1 mm of 120.
const SMOOTHING: f64 = 0.009;
/// Limits of it, mm: below is speckle, above lids and lips go.
const SMOOTHING_RANGE: [f64; 2] = [0.3, 1.2];
/// The smoothing of planes and blocks as a share of it: speckle becomes finer, edges stay.
const LIGHT: f64 = 0.3;
/// Thickness of the slab of the minimum projection, mm.
const SLAB: f64 = 12.0;
/// Edge of a block of the histogram, in standard deviations of the smoothing: a box of 2.5 in two dimensions averages about as much speckle
/// as the Gaussian in three leaves of a mode's width.
const BLOCK: f64 = 2.5;
/// Extinction of the ramp times the smoothing's standard deviation: 1.4/mm at 1.1 mm. A shell of tissue is as opaque in a smaller volume.
const OPTICAL_DEPTH: f64 = 1.54;

/// The filters of a slice: one that is set is the choice of all.
const SLICE_FILTERS: [&str; 7] = [
    "slices.smooth",
    "slices.sigma",
    "slices.enhanced_sigma",
    "slices.perona_malik",
    "slices.estimator",
    "slices.median",
    "slices.blur",
];
/// What is rendered of a volume: one side that is set is the choice of the region.
const REGION: [&str; 4] = ["region.lateral", "region.depth", "region.elevation", "region.start_curve"];

/// Levels of a face in fluid.
const UNKNOWN: EchoLevels =
    EchoLevels { dark: 0.05, threshold: 0.4, bright: 0.68, mean: 0.3, low: 0.02, high: 0.95, start: None };

/// Settings completed by defaults that follow from the recording. `said` has lines of text that tell how defaults were found; some have no line.
#[derive(Clone, Debug, PartialEq)]
pub struct Completed {
    pub settings: Settings,
    pub said: Vec<String>,
}

/// Standard deviation, mm, of the Gaussian that smooths a volume by default, the same along every axis: 0.9 % of the longest edge of the box around
/// the insonified region, but at least 0.3 and at most 1.2.
pub fn smoothing(geometry: &Geometry) -> f64 {
    let (low, high) = insonified_box(geometry);
    let [least, most] = SMOOTHING_RANGE;
    let wanted = SMOOTHING * (high - low).max_element();
    if wanted.is_finite() { wanted.clamp(least, most) } else { most }
}

/// Edge length, mm, of the blocks of samples whose means [`EchoHistogram`] divides into a darker and a brighter class.
pub fn block_edge(geometry: &Geometry) -> f64 {
    BLOCK * smoothing(geometry)
}

/// What all scenes of one recorded volume have in common. Every command that renders a recording makes its scenes here, so that a picture,
/// a report and a profile of the same arguments show the same scene.
#[derive(Clone, Debug)]
pub struct Recorded {
    pub geometry: Geometry,
    /// The type of the samples, and the value range that the source states.
    pub stated: Input,
    /// What was added to signed samples to store them as unsigned ([`SampleType::shift`](crate::probe::SampleType::shift)).
    pub shift: f64,
    /// Levels of the volume's echoes. None if no default depends on them, or if the samples are too few or all equal.
    pub levels: Option<EchoLevels>,
    /// True if defaults complete the settings. False if the settings are complete already, such as those of a workspace.
    pub is_completed: bool,
}

/// Why no scene can be made of layers of settings and a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordedFault {
    #[error("{0}")]
    Layers(#[from] LoadError),
    #[error("{0}")]
    Scene(#[from] SceneError),
}

impl Recorded {
    /// A recording whose scenes take the settings as they are, without defaults.
    pub fn as_set(geometry: Geometry, stated: Input) -> Recorded {
        Recorded { geometry, stated, shift: 0.0, levels: None, is_completed: false }
    }

    /// Type and value range of the samples: the range that `samples.range` sets, or else the one that the source states.
    pub fn samples(&self, settings: &Settings) -> Input {
        self.stated.in_range_of(settings, self.shift)
    }

    /// True if defaults for these layers depend on the levels of the echoes ([`Recorded::levels`]).
    pub fn needs_levels(&self, layers: &Layers) -> bool {
        self.is_completed && layers.needs_levels()
    }

    /// An empty histogram for the echoes of the volume. Once it has taken all frames ([`EchoHistogram::take`]), its levels are those for
    /// [`Recorded::levels`].
    ///
    /// # Errors
    /// One line: the layers together are no valid settings.
    pub fn histogram(&self, layers: &Layers) -> Result<EchoHistogram, LoadError> {
        let samples = self.samples(&layers.clone().finish()?);
        Ok(EchoHistogram::new(&self.geometry, samples, block_edge(&self.geometry)))
    }

    /// The scene of these layers of settings on the recording. If `is_completed`, defaults complete the settings, unless they depend on levels of
    /// echoes ([`Recorded::needs_levels`]) and `levels` is None.
    ///
    /// # Errors
    /// The layers together are no valid settings, or a setting cannot be rendered with this geometry.
    pub fn scene(&self, layers: &Layers) -> Result<Scene, RecordedFault> {
        // Of a volume that is all the same nothing follows, and what was set explains the picture best.
        let is_alike = layers.needs_levels() && self.levels.is_none();
        let completed = match self.is_completed && !is_alike {
            true => layers.completed(&self.geometry, self.levels.as_ref())?,
            false => Completed { settings: layers.clone().finish()?, said: Vec::new() },
        };
        let samples = self.samples(&completed.settings);
        let mut scene = Scene::new(self.geometry.clone(), samples, completed.settings)?;
        scene.found.splice(0..0, completed.said);
        Ok(scene)
    }
}

/// What default settings are computed from.
#[derive(Clone, Debug)]
pub struct Defaults {
    pub layers: Layers,
    pub geometry: Geometry,
    /// Levels of the volume's echoes. None before the first whole volume.
    pub levels: Option<EchoLevels>,
}

impl Defaults {
    /// The settings of the layers, completed by defaults for their mode.
    ///
    /// # Errors
    /// One line: the layers together are no valid settings.
    pub fn settings(&self) -> Result<Settings, LoadError> {
        Ok(self.layers.completed(&self.geometry, self.levels.as_ref())?.settings)
    }

    /// The settings as if the mode and the layout of `other` were chosen.
    fn of_mode(&self, other: &Settings) -> Option<Settings> {
        let layers = self.layers.clone().in_mode(other.mode, other.layout)?;
        Some(layers.completed(&self.geometry, self.levels.as_ref()).ok()?.settings)
    }

    /// `to`, with the values that still equal the defaults of the mode and layout of `from` replaced by those of its own mode and layout. Other
    /// values, which the user changed, stay. If mode and layout are the same, or if no defaults can be computed, `to` is returned as it is.
    pub fn switched(&self, from: &Settings, to: Settings) -> Settings {
        if (from.mode, from.layout) == (to.mode, to.layout) {
            return to;
        }
        match (self.of_mode(from), self.of_mode(&to)) {
            (Some(before), Some(after)) => rebase(&to, &before, &after).unwrap_or(to),
            _ => to,
        }
    }
}

impl Layers {
    /// The layers with this mode and layout on top, as if the user had set them. None if the layers cannot be merged with them.
    pub fn in_mode(mut self, mode: Mode, layout: Layout) -> Option<Layers> {
        let table = Table::from_iter([
            ("mode".to_string(), mode.to_node().into_toml().ok()?),
            ("layout".to_string(), layout.to_node().into_toml().ok()?),
        ]);
        self.table("mode", table, Path::new("")).ok()?;
        Some(self)
    }

    /// True if defaults depend on the levels of the echoes, because no built-in preset was chosen.
    pub fn needs_levels(&self) -> bool {
        self.presets().is_empty()
    }

    /// The settings of the layers for a geometry, completed by defaults. Without a preset, the ramp of volume rendering and the grey windows follow
    /// from `levels` where no layer sets them. If `levels` is None, the ramp is that of a face in fluid, and the windows of surfaces, projections and
    /// planes stay at their defaults.
    ///
    /// # Errors
    /// One line: the layers together are no valid settings.
    pub fn completed(&self, geometry: &Geometry, levels: Option<&EchoLevels>) -> Result<Completed, LoadError> {
        let chosen = self.clone().finish()?;
        let mut found =
            Found { layers: self, chosen: &chosen, under: Table::new(), over: Table::new(), said: Vec::new() };
        let mode = found.mode(geometry);
        let is_plain = self.presets().is_empty();
        let is_section = mode.is_flat() || mode == Mode::Cube;
        if is_section && !found.is_as_it_is() {
            found.section(geometry);
        }
        if mode == Mode::Cube {
            found.cube(geometry);
        }
        if chosen.layout.has_planes() && !mode.is_flat() {
            found.planes_beside_rendering(geometry);
        }
        if mode == Mode::MinIp {
            found.slab(geometry);
        }
        if is_plain && !is_section {
            found.filters(geometry, mode);
        }
        if is_plain {
            found.windows(geometry, levels, mode);
        }
        let Found { under, over, said, .. } = found;
        let mut layers = Layers::default();
        layers.table("defaults of the recording", under, Path::new(""))?;
        let mut layers = layers.with(self);
        layers.table("defaults of the mode", over, Path::new(""))?;
        Ok(Completed { settings: layers.finish()?, said })
    }
}

/// The defaults that were found: below the layers, and above those of presets.
struct Found<'a> {
    layers: &'a Layers,
    /// The layers without the defaults.
    chosen: &'a Settings,
    under: Table,
    over: Table,
    said: Vec<String>,
}

impl Found<'_> {
    /// True if a layer other than a preset gives one of these, or a table around or in it.
    fn gives_any(&self, keys: &[&str]) -> bool {
        keys.iter().any(|key| self.layers.gives(key))
    }

    /// A Gaussian with a standard deviation along every axis, mm: along the axes of a slice no more than can be filtered. Across slices a size in mm is
    /// cut where it is resolved.
    fn gaussian(&mut self, key: &str, deviation: f64, geometry: &Geometry) -> Table {
        let pitches = slice_grid(geometry, self.chosen.slices.pixels).pitch;
        let mut table = Table::new();
        // What is sharpened across slices is not smoothed there.
        if self.chosen.ray.elevation != Elevation::BsplineSharp {
            table.insert("elevation_mm".into(), rounded(deviation).into());
        }
        for (axis, pitch) in ["lateral", "depth"].into_iter().zip(pitches) {
            let most = MAX_DEVIATION * pitch;
            let taken = if deviation > most { rounded_down(most) } else { rounded(deviation) };
            if deviation > most {
                self.said.push(format!(
                    "{key}.{axis}: {taken} mm: {MAX_DEVIATION} pixels are the most that can be filtered"
                ));
            }
            table.insert(axis.into(), taken.into());
        }
        table
    }

    /// True if a preset's filters are those of its planes, too.
    fn is_as_it_is(&self) -> bool {
        self.layers.presets().iter().any(|preset| AS_THEY_ARE.contains(&preset.as_str()))
    }

    fn mode(&mut self, geometry: &Geometry) -> Mode {
        let chosen = self.chosen;
        let is_frame = geometry.slices() == 1 || region::is_still(geometry);
        // A pair is of mode surface; a single frame has no layout.
        let is_fixed = chosen.layout == Layout::Pair || (chosen.layout.has_planes() && is_frame);
        if self.layers.has("mode") || is_fixed || !self.layers.presets().is_empty() {
            return chosen.mode;
        }
        let (mode, name, why) = match is_frame {
            true => (Mode::Plane, "plane", "a single frame"),
            false => (Mode::Volume, "volume", "no preset"),
        };
        put(&mut self.under, "mode", name.into());
        self.said.push(format!("mode: {name}: {why}"));
        mode
    }

    /// The planes of a 4-up picture have a lightly filtered volume over the full sector: the rendering has its own filters and region.
    fn planes_beside_rendering(&mut self, geometry: &Geometry) {
        if self.is_as_it_is() || self.layers.has("planes.smooth") {
            return;
        }
        let deviation = rounded(LIGHT * smoothing(geometry));
        let smooth = self.gaussian("planes.smooth", deviation, geometry);
        put(&mut self.over, "planes.smooth", smooth.into());
        self.said.push(format!("planes.smooth: {deviation} mm: planes beside a rendering have a volume of their own"));
    }

    /// A lightly filtered volume over the full sector.
    fn section(&mut self, geometry: &Geometry) {
        let deviation = rounded(LIGHT * smoothing(geometry));
        let is_preset = !self.layers.presets().is_empty();
        if !self.gives_any(&REGION) && is_preset {
            for side in ["lateral", "depth", "elevation"] {
                put(&mut self.over, &format!("region.{side}"), "none".into());
            }
            if !self.layers.gives("region.fade") {
                put(&mut self.over, "region.fade", 0.0.into());
            }
            self.said.push("region: all of the sector, for sections".into());
        }
        if !self.gives_any(&SLICE_FILTERS) {
            for filter in ["sigma", "enhanced_sigma", "perona_malik", "estimator"] {
                put(&mut self.over, &format!("slices.{filter}"), "none".into());
            }
            put(&mut self.over, "slices.median", false.into());
            let smooth = self.gaussian("slices.smooth", deviation, geometry);
            put(&mut self.over, "slices.smooth", smooth.into());
            self.said.push(format!("slices.smooth: {deviation} mm, light, for sections"));
        }
    }

    fn cube(&mut self, geometry: &Geometry) {
        if !["azimuth", "elevation"].iter().any(|angle| self.layers.has(&format!("camera.{angle}"))) {
            put(&mut self.over, "camera.azimuth", (-30.0).into());
            put(&mut self.over, "camera.elevation", 30.0.into());
            // What a preset aims at is a face, seen from the front.
            if !self.gives_any(&["camera.target", "camera.zoom"]) {
                put(&mut self.over, "camera.target", "none".into());
                put(&mut self.over, "camera.zoom", 1.0.into());
            }
            self.said.push("camera: the block is turned by 30 degrees".into());
        }
        if !self.layers.has("cube.inset") && !self.gives_any(&REGION) {
            let (low, high) = insonified_box(geometry);
            let inset = rounded(0.4 * (high - low).z);
            put(&mut self.over, "cube.inset.bottom", inset.into());
            self.said.push(format!("cube.inset.bottom: {inset} mm: the block is cut open"));
        }
    }

    fn slab(&mut self, geometry: &Geometry) {
        let chosen = self.chosen;
        if self.gives_any(&REGION) || self.layers.gives("projection.start_depth") || geometry.slices() == 1 {
            return;
        }
        let offset = super::region::depth_offset(geometry);
        let (low, high) = insonified_box(geometry);
        let [near, far] = chosen.region.depth.unwrap_or([low.y - offset, high.y - offset]);
        let (middle, half) = ((near + far) / 2.0, (far - near).min(SLAB) / 2.0);
        let depth = [middle - half, middle + half].map(rounded);
        put(&mut self.over, "region.depth", Value::from(depth.to_vec()));
        if let Some([lateral, _, elevation]) = chosen.camera.target.filter(|_| !self.layers.gives("camera.target")) {
            put(&mut self.over, "camera.target", Value::from(vec![lateral, rounded(middle), elevation]));
        }
        self.said.push(format!("region.depth: {} to {} mm: a minimum projection takes a slab", depth[0], depth[1]));
    }

    /// The filters of a rendering, by the size of the volume.
    fn filters(&mut self, geometry: &Geometry, mode: Mode) {
        let deviation = smoothing(geometry);
        if !self.gives_any(&SLICE_FILTERS) {
            let smooth = self.gaussian("slices.smooth", deviation, geometry);
            put(&mut self.under, "slices.smooth", smooth.into());
            self.said.push(format!("slices.smooth: {} mm, by the size of the volume", rounded(deviation)));
        }
        if matches!(mode, Mode::Surface | Mode::Mixed) && !self.layers.gives("distance") {
            put(&mut self.under, "distance.median_mm", rounded(2.5 * deviation).into());
            put(&mut self.under, "distance.bilateral.mm", rounded(1.2 * deviation).into());
            put(&mut self.under, "distance.bilateral.distance", rounded(2.5 * deviation).into());
        }
        if !self.layers.gives("ray.elevation") {
            put(&mut self.under, "ray.elevation", "bspline".into());
        }
    }

    /// Windows and ramp. Without `levels`, before the first volume of a stream, they are those of a face in fluid: what changes later are numbers
    /// alone, and no pipeline is compiled again.
    fn windows(&mut self, geometry: &Geometry, levels: Option<&EchoLevels>, mode: Mode) {
        let EchoLevels { dark, threshold, bright, mean, low, high, start } = *levels.unwrap_or(&UNKNOWN);
        let source = if levels.is_some() { "from the echoes" } else { "as no echoes are known" };
        let layers = self.layers;
        let window = |low: f64, high: f64| {
            let low = low.clamp(0.0, 0.98);
            Value::from([low, high.clamp(low + 0.02, 1.0)].map(rounded).to_vec())
        };
        self.said.extend(levels.map(|_| format!(
            "echoes: darker class {dark:.3}, threshold {threshold:.3}, brighter class {bright:.3}; samples {low:.3} to {high:.3}"
        )));
        let (under, said) = (&mut self.under, &mut self.said);
        let set = |key: &str, value: Value, under: &mut Table, said: &mut Vec<String>| {
            said.push(format!("{key}: {value}, {source}"));
            put(under, key, value);
        };
        let mut has_ramp = false;
        if matches!(mode, Mode::Volume | Mode::Mixed | Mode::Surface) {
            let is_window = layers.gives("volume.window") || layers.gives("volume.threshold");
            if layers.gives("volume.transfer") || layers.gives("volume.opacity") {
                if !is_window {
                    // Transfer functions with a name are transparent up to a fifth of the window.
                    set("volume.window", window(threshold - (bright - threshold), high), under, said);
                }
            } else if !is_window {
                has_ramp = true;
                let (from, to) = (rounded(threshold), rounded(bright.max(threshold + 0.02).min(1.0)));
                let (points, cut) = fitting_ramp(from, to, &self.chosen.volume);
                said.push(format!("volume.transfer: opaque from {from} to {to}, {source}{}", cut.unwrap_or_default()));
                put(under, "volume.transfer", points.to_node().into_toml().unwrap_or(Value::Array(Vec::new())));
                let extinction = rounded(OPTICAL_DEPTH / smoothing(geometry));
                put(under, "volume.extinction", extinction.into());
            }
            if levels.is_some() && !layers.gives("surface.window") && !layers.gives("surface.threshold") {
                set("surface.window", window(threshold, bright + 1.5 * (bright - threshold)), under, said);
                set("surface.threshold", 0.12.into(), under, said);
            }
        }
        // The light belongs to the ramp. Of a preset's light only what nobody set.
        let is_lit = mode == Mode::Volume && has_ramp && !layers.gives("volume.shading");
        if is_lit && let Some(Value::Table(light)) = light_of_face() {
            let is_exponential = self.chosen.volume.compositing == Compositing::Exponential;
            let refused = is_exponential.then_some("volume.compositing=exponential");
            let refused = refused.or(self.chosen.light.position.map(|_| "light.position"));
            match refused {
                Some(key) => said.push(format!("light: none in the volume, which {key} does not go with")),
                None => {
                    said.push("light: as in preset face".into());
                    under.insert("light".into(), Value::Table(light));
                }
            }
        }
        let is_rendering = matches!(mode, Mode::Volume | Mode::Mixed | Mode::Surface | Mode::Mip);
        let starts = ["volume.start_depth", "surface.start_depth", "projection.start_depth"];
        let is_start_chosen = REGION.iter().chain(&starts).any(|key| layers.gives(key));
        if let Some(start) = start.filter(|_| is_rendering && !is_start_chosen) {
            let (low, high) = insonified_box(geometry);
            let (start, end) = (rounded(start), rounded(high.y - super::region::depth_offset(geometry)));
            if start < end && start > low.y - super::region::depth_offset(geometry) {
                said.push(format!("region.depth: from {start} mm: in front of it is a layer next to the probe"));
                put(under, "region.depth", Value::from(vec![start, end]));
            }
        }
        // Windows alone change no pipeline: until the echoes are known they stay as they are.
        if levels.is_none() {
            return;
        }
        if !layers.gives("projection.window") {
            let shown = match mode {
                Mode::Mip => window(threshold, high),
                Mode::MinIp => window(low, bright),
                Mode::Mean => window(0.2 * mean, 2.2 * mean),
                _ => window(dark, high),
            };
            set("projection.window", shown, under, said);
        }
        for key in ["planes.window", "cube.window"] {
            if !layers.gives(key) {
                set(key, window(low, high), under, said);
            }
        }
    }
}

/// The light of preset `face`.
fn light_of_face() -> Option<Value> {
    let settings = preset_settings("face")?;
    settings.light.to_node().into_toml().ok()
}

/// The points of preset `face`, a soft shell from dark to light skin, over another interval of echoes. Where the table of `volume` is too small for them,
/// the ends alone, and as far apart as an entry at least; then with the end of a line that says so.
fn fitting_ramp(from: f64, to: f64, volume: &Volume) -> (Vec<TransferPoint>, Option<&'static str>) {
    let points = preset_settings("face").map(|s| transfer::resolved(&s.volume.transfer)).unwrap_or_default();
    let (first, last) = (points.first().map_or(0.0, |p| p.at), points.last().map_or(1.0, |p| p.at));
    let over = |points: &[TransferPoint], from: f64, to: f64| -> Vec<TransferPoint> {
        points
            .iter()
            .map(|p| TransferPoint { at: from + (to - from) * (p.at - first) / (last - first), ..*p })
            .collect()
    };
    let is_held = |points: &[TransferPoint]| {
        transfer::entries(&Volume { transfer: Transfer::Points(points.to_vec()), ..volume.clone() }).is_ok()
    };
    let whole = over(&points, from, to);
    let (Some(begin), Some(end)) = (points.first(), points.last()) else { return (whole, None) };
    if is_held(&whole) {
        return (whole, None);
    }
    let ends = over(&[*begin, *end], from, to);
    if is_held(&ends) {
        return (ends, Some("; its ends alone, as volume.entries are few"));
    }
    // An entry and a little, for rounding.
    let half = 0.505 / f64::from(volume.entries.unwrap_or(2).max(2) - 1);
    let middle = ((from + to) / 2.0).clamp(half, 1.0 - half);
    (
        over(&[*begin, *end], middle - half, middle + half),
        Some("; widened to an entry of the table, as volume.entries are few"),
    )
}

/// To four digits after the point: settings that are read by people.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// To three digits, downwards.
fn rounded_down(value: f64) -> f64 {
    let unit = 10f64.powf(value.log10().floor() - 2.0);
    // The quotient of a value with three digits may lie just below a whole number.
    (value / unit + 1e-9).floor() * unit
}
