//! Measures error against run time. It renders and times every setting of every dial, and compares the picture with the f64 reference or,
//! if that is too slow, with a converged picture whose own error is estimated. Dials of rays are compared with exact rays if these exist.
//! Then it does the same with combinations of several dials.

use super::budget::{self, Budget, FLOOR, Share};
use super::choose::{self, Bound, Changes};
use super::dials::Dial;
use super::running::{Rendering, Running, Runs, in_floats};
use crate::baselines::Stored;
use crate::error_report::convergence::{self, Range};
use crate::error_report::metrics;
use crate::error_report::richardson;
use crate::error_report::{
    self, Combination, Errors, Kind as DialKind, Measure, OwnError, Point, Reference, Report, Sizes, Times,
};
use crate::exact_ray::picture::{self, Effort};
use crate::gpu::{Context, GpuError};
use crate::machine;
use crate::passes::shade::normal;
use crate::passes::{Texels, is_hit};
use crate::scene::default_look::Recorded;
use crate::scene::load::Layers;
use crate::scene::{Layout, Scene};
use crate::source::Frame;
use std::sync::Arc;

/// Why a measurement failed.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    #[error("{0}")]
    Gpu(#[from] GpuError),
    #[error("dial {dial} at {set}: {fault}")]
    Setting { dial: &'static str, set: String, fault: String },
    #[error("{0}")]
    NoChoice(String),
    #[error("dial {dial}: {fault}")]
    Reference { dial: &'static str, fault: String },
}

/// Samples that the f64 reference takes in about a minute.
const MAX_F64_SAMPLES: f64 = 6e7;
/// Segments of exact rays that take about a minute.
const MAX_EXACT_SEGMENTS: f64 = 5e7;
/// How many times more accurate than a point its reference must be, if the point takes part in the fit of an order.
const BETTER: f64 = 10.0;

/// Largest number of combinations of several dials that are measured, the scene with its own settings included.
pub const MAX_COMBINATIONS: usize = 24;

/// Which reference errors are measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceChoice {
    /// Exact rays ([`Reference::Exact`]) for dials that change how rays take samples, if they exist for the scene; otherwise f64, but not for a scene
    /// with a light volume. Each is used only if it takes about a minute or less; otherwise the reference is a converged picture of the device.
    Auto,
    /// Exact rays for every dial but looks; an error if they do not exist for the scene.
    Exact,
    /// The picture of the reference renderer, in f64 on the CPU, however long it takes.
    F64,
    /// A picture of the device itself, as accurate as the settings allow.
    Converged,
}

/// What to measure, and on which device.
pub struct ErrorMeasurement<'a> {
    pub context: &'a Arc<Context>,
    /// The recording from which every scene of the report is made.
    pub recorded: &'a Recorded,
    /// The layers of settings before any dial is changed and before defaults complete them.
    pub layers: &'a Layers,
    pub scene: &'a Scene,
    pub frames: &'a [Frame],
    /// Description of the input, for the report.
    pub input: &'a str,
    /// Number of timed runs of each setting.
    pub repeats: u32,
    pub reference: ReferenceChoice,
}

/// What a dial is compared with.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Look,
    F64,
    Exact,
    Converged,
}

/// The picture of a scene with the finest setting of every source of error ([`budget::sources`]), against which combinations are measured.
pub struct Finest {
    rendering: Rendering,
    reference: Reference,
    /// Against the next coarser picture; by exact rays their own estimate; 0 in f64 with fine steps.
    error: OwnError,
}

/// A chosen combination that kept its bound when it was measured again.
pub struct Verified {
    /// The combination with its second measurement.
    pub choice: Combination,
    /// Times of the scene with its own settings, measured alternately with the combination. None if the device has no time stamps.
    pub unchanged: Option<Times>,
    /// The combinations that were chosen first, and did not keep the bound in their second measurement.
    pub failed: Vec<Combination>,
}

impl ErrorMeasurement<'_> {
    /// Measures the dials one after the other, then combinations of them, then the error budget. `progress` is called before each step, with the name
    /// of the dial and that of the setting (or "its reference"), then with "combination" and its number, and with "error budget" and an empty text.
    /// With a bound, more of the combinations are near it.
    ///
    /// # Errors
    /// A setting is refused, a reference shows nothing or cannot be computed by exact rays as asked for, or the device fails.
    pub fn report(
        &self,
        dials: &[Dial],
        finest: &Finest,
        bound: Option<Bound>,
        mut progress: impl FnMut(&str, &str),
    ) -> Result<Report, MeasureError> {
        let (mut measured, mut singles) = (Vec::new(), Vec::new());
        for dial in dials {
            measured.push(self.measure_dial(dial, finest, &mut singles, &mut progress)?);
        }
        let mut choices = Vec::new();
        for changes in choose::proposals(&measured, bound, MAX_COMBINATIONS) {
            progress("combination", &(choices.len() + 1).to_string());
            // The points of a dial alone were measured with it.
            if changes.len() != 1 {
                choices.push(self.combination(finest, &measured, &changes)?);
            }
        }
        choices.extend(singles);
        progress("error budget", "");
        let budget = self.budget(finest)?;
        let machine = machine::device(self.context);
        Ok(Report {
            format: Report::FORMAT.into(),
            device: machine.name,
            driver: machine.driver,
            date: machine::date(),
            scene: format!("{}\n{}", self.input, self.scene.settings.to_toml().unwrap_or_default()),
            sizes: Sizes { volume: self.scene.volume_size(), picture: self.scene.picture_size() },
            repeats: self.repeats,
            dials: measured,
            choices,
            budget,
        })
    }

    /// Renders the picture against which combinations are measured. It has the finest setting of every source of error of the scene, also of dials
    /// that are not measured.
    ///
    /// # Errors
    /// A setting is refused, exact rays were asked for and do not exist for the scene, or the device fails.
    pub fn finest(&self) -> Result<Finest, MeasureError> {
        let sources = budget::sources(self.scene);
        let all = |of: fn(&budget::Source) -> &[String]| sources.iter().flat_map(of).cloned().collect::<Vec<String>>();
        let (finest, nearly) = (all(|s| &s.finest), all(|s| &s.nearly));
        let best = self.scene_with("combination", &finest)?;
        let (kind, _) = self.kind("combination", false, true, &best)?;
        self.reference("combination", kind, &best, &finest, &nearly)
    }

    /// The reference of a kind. `best`: the scene with the settings `finest`.
    fn reference(
        &self,
        dial: &'static str,
        kind: Kind,
        best: &Scene,
        finest: &[String],
        nearly: &[String],
    ) -> Result<Finest, MeasureError> {
        Ok(match kind {
            Kind::Look => {
                Finest { rendering: self.rendered(best)?, reference: Reference::AsItIs, error: OwnError::default() }
            }
            Kind::F64 => {
                let rendering = Rendering::in_f64(best, self.frames, &mut |_, _, _| false);
                Finest { rendering, reference: Reference::F64, error: OwnError::default() }
            }
            Kind::Exact => {
                let (mut effort, scene) = (Effort::default(), in_floats(best));
                // Exact rays in place of stage 2.
                let rendering = Rendering::in_f64(&scene, self.frames, &mut |pass, reads, writes| {
                    picture::replace(&scene, pass, reads, writes, &mut effort)
                });
                let Effort { estimate, pieces, .. } = effort;
                let error = OwnError { rmse: estimate, levels: 255.0 * estimate };
                Finest { rendering, reference: Reference::Exact { estimate, pieces }, error }
            }
            Kind::Converged => self.converged(dial, finest, nearly)?,
        })
    }

    /// The picture that settings converge to, and its own error: the finest one by its difference from the next, or, of a scene that a light volume
    /// lights, what three lattices of it converge to.
    fn converged(&self, dial: &'static str, finest: &[String], nearly: &[String]) -> Result<Finest, MeasureError> {
        let (best, next) = (self.scene_with(dial, finest)?, self.scene_with(dial, nearly)?);
        let mut rendering = self.rendered(&best)?;
        let is_lit = best.lit_by_volume().is_some() && next.lit_by_volume().is_some();
        let cells = [&next, &best].map(|scene| scene.light_lattice().cell);
        if !is_lit || cells[0] <= cells[1] {
            let error = OwnError::of(&compare(dial, &[], &self.rendered(&next)?, &rendering)?);
            let reference = Reference::Converged { set: finest.to_vec(), rmse: error.rmse };
            return Ok(Finest { rendering, reference, error });
        }
        // What is finest but for its light, with cells whose edges have one ratio, and the converse. A ratio of two leaves all cones of ambient light as wide as
        // cells of the pyramid, or as far between two.
        let with = |set: &[String], cell: f64| {
            let set: Vec<String> = set.iter().cloned().chain([format!("light.volume.cell={cell}")]).collect();
            self.scene_with(dial, &set)
        };
        let coarser = [with(finest, cells[0] * cells[0] / cells[1])?, with(finest, cells[0])?];
        let [coarse, middle] = [self.rendered(&coarser[0])?, self.rendered(&coarser[1])?];
        let edges = [coarser[0].light_lattice().cell, coarser[1].light_lattice().cell, cells[1]];
        let others = with(nearly, cells[1])?;
        let others = match others.settings == best.settings {
            true => OwnError::default(),
            false => OwnError::of(&compare(dial, &[], &self.rendered(&others)?, &rendering)?),
        };
        let found = richardson::extrapolated([&coarse.picture, &middle.picture, &rendering.picture], edges);
        let (before, order) = match found {
            Ok(found) if found.order.is_finite() => {
                rendering.picture = found.picture;
                (Rendering { picture: found.coarser, ..middle }, Some(found.order))
            }
            // The same light in both, or differences that are no power of the cell: the last of them bounds what is left.
            _ => (middle, None),
        };
        let light = OwnError::of(&compare(dial, &[], &before, &rendering)?);
        let (rmse, levels) = (light.rmse.hypot(others.rmse), light.levels.hypot(others.levels));
        let set = finest.to_vec();
        let reference = match order {
            Some(order) => Reference::Extrapolated { set, cells: edges, order, rmse },
            None => Reference::Converged { set, rmse },
        };
        Ok(Finest { rendering, reference, error: OwnError { rmse, levels } })
    }

    /// What each source adds to the error of the scene, and all of them.
    fn budget(&self, finest: &Finest) -> Result<Budget, MeasureError> {
        let against = |scene: &Scene| compare("error budget", &[], &self.rendered(scene)?, &finest.rendering);
        let sources = budget::sources(self.scene);
        let without = |left: Option<usize>| {
            let others = sources.iter().enumerate().filter(|(n, _)| Some(*n) != left);
            self.scene_with("error budget", &others.flat_map(|(_, source)| source.finest.clone()).collect::<Vec<_>>())
        };
        let mut shares = Vec::new();
        for (n, source) in sources.iter().enumerate() {
            // A source that is as fine as it gets adds nothing.
            if self.scene_with("error budget", &source.finest)?.settings == self.scene.settings {
                continue;
            }
            let errors = against(&without(Some(n))?)?;
            shares.push(Share { source: source.name.into(), label: source.label.clone(), errors });
        }
        let label = "everything as fine as it gets".into();
        shares.push(Share { source: FLOOR.into(), label, errors: against(&without(None)?)? });
        Ok(Budget {
            reference: finest.reference.clone(),
            reference_error: finest.error,
            shares,
            total: against(self.scene)?,
        })
    }

    /// Chooses a combination of the report, and measures it again `runs` times. A combination that does not keep the bound then is discarded, and the
    /// next best is tried. A time bound is kept if the 95th percentile, increased by the share [`choose::TIME_MARGIN`], is within it. With an error
    /// bound, combinations that may be the fastest are first run alternately, `runs` times each.
    ///
    /// # Errors
    /// No combination of the report has both a time and an error by `measure`, none keeps the bound, or the device fails.
    pub fn choose(
        &self,
        finest: &Finest,
        report: &Report,
        measure: Measure,
        bound: Bound,
        runs: u32,
    ) -> Result<Verified, MeasureError> {
        let mut refused = Vec::new();
        let mut failed = Vec::new();
        loop {
            let mut found = choose::choose(report, measure, bound, &refused).map_err(MeasureError::NoChoice)?;
            if let Bound::Error(error) = bound {
                let contenders = choose::contenders(report, measure, error, &refused);
                found = self.fastest(report, &contenders, runs)?.unwrap_or(found);
            }
            let choice = &report.choices[found];
            let (errors, measured) = self.measure_set(finest, &choice.set, runs)?;
            let (times, unchanged) = (Times::of(&measured.own), Times::of(&measured.default));
            let again = Combination { errors, times, reference_error: finest.error, ..choice.clone() };
            let kept = match bound {
                Bound::Error(error) => again.error_limit(measure).is_some_and(|limit| limit <= error),
                Bound::Time(time) => again.times.is_some_and(|t| t.total.p95 * (1.0 + choose::TIME_MARGIN) <= time),
            };
            if kept {
                return Ok(Verified { choice: again, unchanged, failed });
            }
            refused.push(found);
            failed.push(again);
        }
    }

    /// The fastest of several choices, by the median of so many runs in turn; none of one.
    fn fastest(&self, report: &Report, contenders: &[usize], runs: u32) -> Result<Option<usize>, MeasureError> {
        if contenders.len() < 2 {
            return Ok(None);
        }
        let mut all = Vec::new();
        for index in contenders {
            let scene = self.scene_with("combination", &report.choices[*index].set)?;
            all.push((*index, self.running(&scene)?, Vec::new()));
        }
        for n in 0..runs as usize {
            let count = all.len();
            // Each goes first as often as the others.
            for place in 0..count {
                let (_, running, times) = &mut all[(n + place) % count];
                times.extend(running.run()?);
            }
        }
        let medians = all.iter().filter_map(|(index, _, times)| Some((*index, Times::of(times)?.total.median)));
        Ok(medians.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index))
    }

    fn combination(
        &self,
        finest: &Finest,
        dials: &[error_report::Dial],
        changes: &Changes,
    ) -> Result<Combination, MeasureError> {
        let points = changes.iter().map(|(d, p)| (&dials[*d], &dials[*d].points[*p]));
        let (changed, sets): (Vec<_>, Vec<_>) =
            points.map(|(dial, point)| ((dial.name.clone(), point.label.clone()), point.set.clone())).unzip();
        let set = sets.concat();
        let (errors, runs) = self.measure_set(finest, &set, self.repeats)?;
        let times = Times::of(&runs.own);
        Ok(Combination { changed, set, errors, reference_error: finest.error, times })
    }

    fn measure_set(&self, finest: &Finest, set: &[String], runs: u32) -> Result<(Errors, Runs), MeasureError> {
        let mut default = self.running(self.scene)?;
        let (rendering, runs) = self.in_turn(&self.scene_with("combination", set)?, &mut default, runs)?;
        Ok((compare("combination", set, &rendering, &finest.rendering)?, runs))
    }

    fn measure_dial(
        &self,
        dial: &Dial,
        finest: &Finest,
        singles: &mut Vec<Combination>,
        progress: &mut impl FnMut(&str, &str),
    ) -> Result<error_report::Dial, MeasureError> {
        progress(dial.name, "its reference");
        let best = self.scene_with(dial.name, &dial.best)?;
        let (kind, note) = self.kind(dial.name, dial.kind == DialKind::Look, dial.samples_rays(), &best)?;
        let Finest { rendering: expected, reference, .. } =
            self.reference(dial.name, kind, &best, &dial.best, &dial.nearly)?;
        if let Some(fault) = nothing_in(&expected) {
            return Err(MeasureError::Reference { dial: dial.name, fault });
        }
        let mut points = Vec::new();
        let (mut default, mut default_runs) = (self.running(self.scene)?, Vec::new());
        for (n, setting) in dial.settings.iter().enumerate() {
            progress(dial.name, &setting.label);
            let (rendering, runs) =
                self.in_turn(&self.scene_with(dial.name, &setting.set)?, &mut default, self.repeats)?;
            default_runs.extend(&runs.default);
            // What a choice may take is compared with the picture that all choices are compared with, too.
            if n > 0 && matches!(dial.kind, DialKind::Numerical | DialKind::Several) {
                singles.push(Combination {
                    changed: vec![(dial.name.into(), setting.label.clone())],
                    set: setting.set.clone(),
                    errors: compare(dial.name, &setting.set, &rendering, &finest.rendering)?,
                    reference_error: finest.error,
                    times: Times::of(&runs.own),
                });
            }
            points.push(Point {
                label: setting.label.clone(),
                set: setting.set.clone(),
                value: setting.value,
                errors: compare(dial.name, &setting.set, &rendering, &expected)?,
                times: Times::of(&runs.own),
                ratios: runs.ratios(),
                is_default: n == 0,
            });
        }
        // The first point is the default, which ran beside every other point as well.
        if let Some(first) = points.first_mut() {
            first.times = Times::of(&default_runs);
        }
        let steps = dial.name == "step";
        // The error of the device if only its arithmetic differs.
        let floor = match steps && matches!(kind, Kind::F64 | Kind::Exact) {
            true => Some(compare(dial.name, &[], &self.rendered(&best)?, &expected)?.rmse),
            false => None,
        };
        let fitted = || {
            // A reference of finer steps is off by as many times less as its step is shorter, if the order is 1.
            let good = |p: &&Point| match &reference {
                // Its estimate is of distances where these are measured.
                Reference::Exact { estimate, .. } => {
                    let distances = p.errors.mm.as_ref().and_then(|mm| mm.error.as_ref());
                    distances.map_or(p.errors.rmse, |mm| mm.rms) >= BETTER * estimate
                }
                Reference::Converged { rmse, .. } | Reference::Extrapolated { rmse, .. } => {
                    p.errors.rmse >= BETTER * rmse
                }
                Reference::F64 | Reference::AsItIs => p.value >= BETTER * best.step * (1.0 - 1e-9),
            };
            let pairs: Vec<[f64; 2]> = points.iter().filter(good).map(|p| [p.value, p.errors.rmse]).collect();
            let pixel = self.scene.grid.pitch[0].min(self.scene.grid.pitch[1]);
            convergence::fit(&pairs, Range { step: [pixel / 64.0, 0.75 * pixel], floor: floor.unwrap_or(0.0) }).ok()
        };
        let order = if steps { fitted() } else { None };
        Ok(error_report::Dial {
            name: dial.name.into(),
            kind: dial.kind,
            is_ordered: dial.is_ordered,
            unit: dial.unit.into(),
            reference,
            points,
            order,
            floor,
            note,
        })
    }

    /// The reference of a dial, and why it is not the exact one if the dial is of rays.
    fn kind(
        &self,
        dial: &'static str,
        is_look: bool,
        samples_rays: bool,
        best: &Scene,
    ) -> Result<(Kind, Option<String>), MeasureError> {
        if is_look {
            return Ok((Kind::Look, None));
        }
        // The lattice of a light volume has an error of its own, which f64 keeps and an extrapolated picture states.
        let is_f64 = best.lit_by_volume().is_none() && cost(best) <= MAX_F64_SAMPLES;
        let in_f64 = if is_f64 { Kind::F64 } else { Kind::Converged };
        let fault = picture::fault(best);
        let too_long = (picture::cost(best) + cost_of_slices(best) > MAX_EXACT_SEGMENTS)
            .then(|| "exact rays would take longer than a minute".to_string());
        match (self.reference, fault) {
            (ReferenceChoice::F64, _) => Ok((Kind::F64, None)),
            (ReferenceChoice::Converged, _) => Ok((Kind::Converged, None)),
            (ReferenceChoice::Exact, None) => Ok((Kind::Exact, None)),
            (ReferenceChoice::Exact, Some(why)) => {
                Err(MeasureError::Reference { dial, fault: format!("has no exact reference: {why}") })
            }
            (ReferenceChoice::Auto, _) if !samples_rays => Ok((in_f64, None)),
            (ReferenceChoice::Auto, fault) => match fault.or(too_long) {
                None => Ok((Kind::Exact, None)),
                Some(why) => {
                    let instead = if in_f64 == Kind::F64 { "f64 with fine steps" } else { "a converged picture" };
                    Ok((in_f64, Some(format!("no exact reference: {why}; the reference is {instead}"))))
                }
            },
        }
    }

    fn scene_with(&self, dial: &'static str, set: &[String]) -> Result<Scene, MeasureError> {
        let fault = |fault: String| MeasureError::Setting { dial, set: set.join(" "), fault };
        let mut layers = self.layers.clone();
        set.iter().try_for_each(|assignment| layers.set(assignment)).map_err(|e| fault(e.to_string()))?;
        self.recorded.scene(&layers).map_err(|e| fault(e.to_string()))
    }

    fn running(&self, scene: &Scene) -> Result<Running<'_>, GpuError> {
        Running::new(self.context, self.frames, scene)
    }

    fn rendered(&self, scene: &Scene) -> Result<Rendering, GpuError> {
        self.running(scene)?.read()
    }

    /// Renders a scene, and times it in turn with the default.
    fn in_turn(&self, scene: &Scene, default: &mut Running, runs: u32) -> Result<(Rendering, Runs), GpuError> {
        let mut own = self.running(scene)?;
        let all = Runs::in_turn(&mut own, default, runs)?;
        Ok((own.read()?, all))
    }
}

/// Number of samples that the f64 reference of a scene takes, filters of slices included.
fn cost(scene: &Scene) -> f64 {
    let rays = scene.ray_size().iter().map(|n| f64::from(*n)).product::<f64>();
    let taps = f64::from(scene.settings.ray.sliding.max(1)).powi(3);
    let steps = if scene.is_flat() { 1.0 } else { (scene.high - scene.low).length() / scene.step };
    rays * steps * taps + cost_of_slices(scene)
}

/// The filters of slices, in samples of a ray.
fn cost_of_slices(scene: &Scene) -> f64 {
    let pixels = scene.volume_size().iter().map(|n| f64::from(*n)).product::<f64>();
    let slices = &scene.slice_filters;
    let window = slices.sigma.map_or(0, |s| s.window.pow(2)) + slices.enhanced_sigma.map_or(0, |s| s.largest.pow(2));
    let diffused = slices.perona_malik.map_or(0, |p| 8 * p.repeat);
    // A filter tap costs a tenth of a sample through the inverse map.
    0.1 * pixels * f64::from(16 + window + diffused)
}

/// Why a reference is none, in one line: there is nothing in it that a picture could differ from.
fn nothing_in(reference: &Rendering) -> Option<String> {
    let scene = &reference.scene;
    if let Some(map) = &reference.distance
        && scene.detects_surface()
        && !map.values.iter().any(|d| is_hit(*d))
    {
        let threshold = scene.settings.surface.threshold;
        return Some(format!(
            "no ray of the reference hits a surface (surface.threshold={threshold}): lower it, or change the camera or region"
        ));
    }
    let colours =
        reference.picture.values.chunks_exact(reference.picture.channels.max(1)).flat_map(|p| p.iter().take(3));
    let is_black = !colours.into_iter().any(|c| *c != 0.0);
    is_black.then(|| {
        let what = if scene.composites() { "volume.transfer, volume.window" } else { "the mode's window" };
        format!("its reference is black everywhere: change {what}, the camera or the region")
    })
}

fn compare(
    dial: &'static str,
    set: &[String],
    rendering: &Rendering,
    reference: &Rendering,
) -> Result<Errors, MeasureError> {
    let fault = |fault: String| MeasureError::Setting { dial, set: set.join(" "), fault };
    let size = reference.picture.size;
    let mut picture = enlarged(&rendering.picture, size);
    let maps = rendering.distance.as_ref().zip(reference.distance.as_ref());
    let cliff = reference.scene.cliff();
    // Where tiles share the picture, a pixel has no ray of its own.
    let is_single = reference.scene.settings.layout == Layout::Single;
    let changed = match maps.filter(|_| is_single && reference.scene.detects_surface()) {
        Some((measured, expected)) => metrics::changed_rays(measured, expected, cliff, size),
        None => vec![false; size[0] * size[1]],
    };
    let (channels, all) = (picture.channels.max(1), picture.values.len() / picture.channels.max(1));
    for (n, _) in changed.iter().enumerate().filter(|(_, is_changed)| **is_changed) {
        let texel = n * channels..(n + 1) * channels;
        let expected = reference.picture.values.get(texel.clone());
        if let Some((own, expected)) = picture.values.get_mut(texel).zip(expected) {
            own.copy_from_slice(expected);
        }
    }
    let own = metrics::pictures(&picture, &reference.picture).map_err(fault)?;
    let counted = changed.iter().filter(|is_changed| !**is_changed).count().max(1);
    // The mean is over what was compared.
    let rmse = own.rmse * (all as f64 / counted as f64).sqrt();
    let psnr = (rmse > 0.0).then(|| -20.0 * rmse.log10());
    let levels = metrics::levels(&rendering.toned(&picture), &reference.toned(&reference.picture), &changed);
    let levels = levels.map_err(fault)?;
    let mut errors = Errors { rmse, max: own.max, psnr, ssim: own.ssim, levels, mm: None, degrees: None };
    if let Some((measured, expected)) = maps.filter(|(a, b)| a.size == b.size) {
        errors.mm = Some(metrics::surfaces(measured, expected, cliff).map_err(fault)?);
        let same = same_surface(measured, expected, cliff);
        let (measured, expected) = (normals(&rendering.scene, &same), normals(&reference.scene, expected));
        errors.degrees = Some(metrics::normals(&measured, &expected).map_err(fault)?);
    }
    Ok(errors)
}

/// The distances of a map, those of the reference where they jump to another surface: normals are not compared across.
fn same_surface(measured: &Texels, expected: &Texels, cliff: f64) -> Texels {
    let mut same = measured.clone();
    for (own, other) in same.values.iter_mut().zip(&expected.values) {
        if is_hit(*own) && is_hit(*other) && (*own - other).abs() > cliff {
            *own = *other;
        }
    }
    same
}

fn normals(scene: &Scene, distances: &Texels) -> Texels {
    let at = |x: usize, y: usize| normal(scene, distances, x as i64, y as i64).map_or([0.0; 3], |n| n.to_array());
    let mut texels = Texels::untouched(distances.size, 3);
    for (x, y) in (0..distances.size[1]).flat_map(|y| (0..distances.size[0]).map(move |x| (x, y))) {
        texels.set([x, y, 0], &at(x, y));
    }
    texels
}

/// A picture scaled to another size by bilinear interpolation.
fn enlarged(picture: &Texels, size: [usize; 3]) -> Texels {
    if picture.size == size {
        return picture.clone();
    }
    let along = |i: usize, axis: usize| {
        let at = (i as f64 + 0.5) * picture.size[axis] as f64 / size[axis] as f64 - 0.5;
        let at = at.clamp(0.0, (picture.size[axis] - 1) as f64);
        (at as usize, (at as usize + 1).min(picture.size[axis] - 1), at.fract())
    };
    Texels::from_fn(size, picture.channels, |[x, y, _], c| {
        let ((x0, x1, u), (y0, y1, v)) = (along(x, 0), along(y, 1));
        let at = |x, y| picture.get([x, y, 0])[c];
        (1.0 - v) * ((1.0 - u) * at(x0, y0) + u * at(x1, y0)) + v * ((1.0 - u) * at(x0, y1) + u * at(x1, y1))
    })
}
