//! Measures error against run time: renders and times every setting of every dial, and compares it with the f64 reference or, if that
//! is too slow, with a converged picture whose own error is estimated. Then it does the same with combinations of several dials.

use super::choose::{self, Bound, Changes};
use super::dials::Dial;
use crate::error_report::convergence::{self, Range};
use crate::error_report::metrics;
use crate::error_report::{self, Combination, Errors, FORMAT, Measure, Point, Reference, Report, Sizes, Time, Times};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::machine;
use crate::passes::chain::distance_end;
use crate::passes::shade::normal;
use crate::passes::{Frequency, PASSES, Slot, Texels};
use crate::reference;
use crate::scene::load::{Layers, LoadError};
use crate::scene::{Scene, SceneError};
use crate::source::Frame;
use std::sync::Arc;

/// Why a measurement failed.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    #[error("{0}")]
    Gpu(#[from] GpuError),
    #[error("dial {dial} at {set}: {fault}")]
    Place { dial: &'static str, set: String, fault: String },
    #[error("{0}")]
    NoChoice(String),
}

/// Samples that the f64 reference takes in about a minute.
const MAX_F64_SAMPLES: f64 = 6e7;

/// Combinations of several dials that are measured.
pub const MAX_COMBINATIONS: usize = 24;

/// Which reference to compare with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferenceChoice {
    /// F64 if it takes about a minute or less, otherwise converged.
    Auto,
    F64,
    Converged,
}

/// What to measure, and on which device.
pub struct ErrorMeasurement<'a> {
    pub context: &'a Arc<Context>,
    /// Settings before any dial is changed.
    pub layers: &'a Layers,
    pub scene: &'a Scene,
    pub frames: &'a [Frame],
    /// Description of the input.
    pub input: &'a str,
    pub repeats: u32,
    pub reference: ReferenceChoice,
}

/// A rendered scene: the picture before the tone mapping of stage 4, and the filtered distance map.
struct Rendering {
    scene: Scene,
    picture: Texels,
    distance: Option<Texels>,
}

/// The picture of a scene with the finest setting of every numerical dial: what combinations are compared with.
pub struct Finest {
    rendering: Rendering,
    /// Its RMSE against the next coarser picture; 0 in f64.
    error: f64,
}

/// A choice that kept its bound when it was measured again.
pub struct Verified {
    /// As measured again.
    pub choice: Combination,
    /// Those that did not keep it then.
    pub failed: Vec<Combination>,
}

/// A scene on the device.
struct Running<'a> {
    renderer: Renderer,
    frames: &'a [Frame],
}

impl Running<'_> {
    /// Ingests the volume and renders a picture. Returns the times of both, ns; none without time stamps.
    fn run(&mut self) -> Result<Option<[f64; 2]>, GpuError> {
        for frame in self.frames {
            self.renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
        }
        self.renderer.show(0)?;
        self.renderer.picture()?;
        let taken = self.renderer.take_times()?;
        let is_of_picture = |name: &str| {
            let pass = PASSES.iter().find(|pass| pass.name == name);
            name == "readback" || pass.is_some_and(|pass| pass.frequency == Frequency::Picture)
        };
        let (picture, volume): (Vec<_>, Vec<_>) = taken.iter().partition(|t| is_of_picture(t.name));
        let sum = |times: &[&crate::passes::PassTime]| times.iter().map(|t| t.total).sum::<f64>();
        Ok((!taken.is_empty()).then(|| [sum(&volume), sum(&picture)]))
    }

    fn read(&mut self) -> Result<Rendering, GpuError> {
        let scene = self.renderer.scene().clone();
        let missing = || GpuError::Broken("the plan has no picture".into());
        let picture = self.renderer.read(Slot::Picture)?.ok_or_else(missing)?;
        let distance = match scene.has_distance() {
            true => self.renderer.read(distance_end(&scene))?,
            false => None,
        };
        Ok(Rendering { scene, picture, distance })
    }
}

/// Runs of a scene in turn with the default: [volume, picture], ns.
#[derive(Default)]
struct Runs {
    own: Vec<[f64; 2]>,
    default: Vec<[f64; 2]>,
}

impl Runs {
    /// Times of each run relative to the default's beside it.
    fn ratios(&self) -> Option<Times> {
        let of = |part: fn(&[f64; 2]) -> f64| {
            let ratios = self.own.iter().zip(&self.default).map(|(own, default)| part(own) / part(default));
            Time::of(&ratios.filter(|r| r.is_finite()).collect::<Vec<_>>())
        };
        Some(Times { volume: of(|r| r[0])?, picture: of(|r| r[1])?, total: of(|r| r[0] + r[1])? })
    }
}

impl ErrorMeasurement<'_> {
    /// Measures the dials one after the other, then combinations of them. `progress` is called with dial and label before each setting
    /// is rendered. With a bound, more of the combinations are near it.
    ///
    /// # Errors
    /// A setting is refused, or the device fails.
    pub fn report(
        &self,
        dials: &[Dial],
        finest: &Finest,
        bound: Option<Bound>,
        mut progress: impl FnMut(&str, &str),
    ) -> Result<Report, MeasureError> {
        let mut measured = Vec::new();
        for dial in dials {
            measured.push(self.measure_dial(dial, &mut progress)?);
        }
        let mut choices = Vec::new();
        for changes in choose::proposals(&measured, bound, MAX_COMBINATIONS) {
            progress("combination", &(choices.len() + 1).to_string());
            choices.push(self.combination(finest, &measured, &changes)?);
        }
        let machine = machine::device(self.context);
        Ok(Report {
            format: FORMAT.into(),
            device: machine.name,
            driver: machine.driver,
            date: machine::date(),
            scene: format!("{}\n{}", self.input, toml::to_string(&self.scene.settings).unwrap_or_default()),
            sizes: Sizes { volume: self.scene.volume_size(), picture: self.scene.picture_size() },
            repeats: self.repeats,
            dials: measured,
            choices,
        })
    }

    /// The picture that combinations are compared with: the finest setting of every numerical dial of the scene, whether it is among
    /// those that are measured or not.
    ///
    /// # Errors
    /// As [`ErrorMeasurement::report`].
    pub fn finest(&self) -> Result<Finest, MeasureError> {
        let of = |assignments: fn(&Dial) -> &[String]| {
            let dials = super::dials::NAMES.iter().filter_map(|name| super::dials::dial(name, self.scene).ok());
            let numerical: Vec<Dial> = dials.filter(Dial::is_numerical).collect();
            // The number of rays is another picture: the mean over a pixel in place of its middle.
            let sets = numerical.iter().flat_map(assignments).filter(|set| !set.starts_with("ray.rays="));
            sets.cloned().collect::<Vec<String>>()
        };
        let scene_of = |set: &[String]| self.scene_with("combination", set);
        let best = scene_of(&of(|dial| &dial.best))?;
        if self.takes_f64(&best) {
            return Ok(Finest { rendering: self.in_f64(&best), error: 0.0 });
        }
        let (rendering, nearly) = (self.rendered(&best)?, self.rendered(&scene_of(&of(|dial| &dial.nearly))?)?);
        let error = compare("combination", &[], &nearly, &rendering)?.rmse;
        Ok(Finest { rendering, error })
    }

    /// Renders and times a combination anew.
    ///
    /// # Errors
    /// As [`ErrorMeasurement::report`].
    fn measure_again(&self, finest: &Finest, choice: &Combination, runs: u32) -> Result<Combination, MeasureError> {
        let (errors, times) = self.measure_set(finest, &choice.set, runs)?;
        Ok(Combination { errors, times, reference_error: finest.error, ..choice.clone() })
    }

    /// Chooses a combination of the report, and measures it anew. What does not keep the bound then is no choice, and the next best is
    /// tried. A time is kept if the 95th percentile, longer by [`choose::TIME_MARGIN`], is within the bound.
    ///
    /// # Errors
    /// As [`choose::choose`], or the device fails.
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
            let found = choose::choose(report, measure, bound, &refused).map_err(MeasureError::NoChoice)?;
            let again = self.measure_again(finest, &report.choices[found], runs)?;
            let kept = match bound {
                Bound::Error(error) => again.error_limit(measure).is_some_and(|limit| limit <= error),
                Bound::Time(time) => again.times.is_some_and(|t| t.total.p95 * (1.0 + choose::TIME_MARGIN) <= time),
            };
            if kept {
                return Ok(Verified { choice: again, failed });
            }
            refused.push(found);
            failed.push(again);
        }
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
        let (errors, times) = self.measure_set(finest, &set, self.repeats)?;
        Ok(Combination { changed, set, errors, reference_error: finest.error, times })
    }

    fn measure_set(&self, finest: &Finest, set: &[String], runs: u32) -> Result<(Errors, Option<Times>), MeasureError> {
        let mut default = self.running(self.scene)?;
        let (rendering, runs) = self.in_turn(&self.scene_with("combination", set)?, &mut default, runs)?;
        Ok((compare("combination", set, &rendering, &finest.rendering)?, Times::of(&runs.own)))
    }

    fn takes_f64(&self, scene: &Scene) -> bool {
        match self.reference {
            ReferenceChoice::F64 => true,
            ReferenceChoice::Converged => false,
            ReferenceChoice::Auto => cost(scene) <= MAX_F64_SAMPLES,
        }
    }

    fn measure_dial(
        &self,
        dial: &Dial,
        progress: &mut impl FnMut(&str, &str),
    ) -> Result<error_report::Dial, MeasureError> {
        progress(dial.name, "its reference");
        let best = self.scene_at(dial, &dial.best)?;
        let exact = self.takes_f64(&best);
        let (expected, reference) = match exact {
            _ if dial.is_look => (self.rendered(&best)?, Reference::AsItIs),
            true => (self.in_f64(&best), Reference::F64),
            false => {
                let rendering = self.rendered(&best)?;
                let nearly = self.rendered(&self.scene_at(dial, &dial.nearly)?)?;
                let own = compare(dial.name, &[], &nearly, &rendering)?.rmse;
                (rendering, Reference::Converged { set: dial.best.clone(), rmse: own })
            }
        };
        let mut points = Vec::new();
        let (mut default, mut default_runs) = (self.running(self.scene)?, Vec::new());
        for (n, place) in dial.places.iter().enumerate() {
            progress(dial.name, &place.label);
            let (rendering, runs) = self.in_turn(&self.scene_at(dial, &place.set)?, &mut default, self.repeats)?;
            default_runs.extend(&runs.default);
            points.push(Point {
                label: place.label.clone(),
                set: place.set.clone(),
                value: place.value,
                errors: compare(dial.name, &place.set, &rendering, &expected)?,
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
        let floor = match exact && steps {
            true => Some(compare(dial.name, &[], &self.rendered(&best)?, &expected)?.rmse),
            false => None,
        };
        let fitted = || {
            let pairs: Vec<[f64; 2]> = points.iter().map(|p| [p.value, p.errors.rmse]).collect();
            let pixel = self.scene.grid.pitch[0].min(self.scene.grid.pitch[1]);
            convergence::fit(&pairs, Range { step: [pixel / 64.0, 0.75 * pixel], floor: floor.unwrap_or(0.0) }).ok()
        };
        let order = if steps { fitted() } else { None };
        Ok(error_report::Dial {
            name: dial.name.into(),
            is_numerical: dial.is_numerical(),
            unit: dial.unit.into(),
            reference,
            points,
            order,
            floor,
        })
    }

    fn scene_at(&self, dial: &Dial, set: &[String]) -> Result<Scene, MeasureError> {
        self.scene_with(dial.name, set)
    }

    fn scene_with(&self, dial: &'static str, set: &[String]) -> Result<Scene, MeasureError> {
        let fault = |fault: String| MeasureError::Place { dial, set: set.join(" "), fault };
        let layered = || -> Result<_, LoadError> {
            let mut layers = self.layers.clone();
            set.iter().try_for_each(|assignment| layers.set(assignment))?;
            layers.finish()
        };
        let settings = layered().map_err(|e| fault(e.to_string()))?;
        let made: Result<Scene, SceneError> = Scene::new(self.scene.geometry.clone(), self.scene.input, settings);
        made.map_err(|e| fault(e.to_string()))
    }

    /// The scene on the device, after a first run that compiles its shaders.
    fn running(&self, scene: &Scene) -> Result<Running<'_>, GpuError> {
        let renderer = Renderer::new(self.context, in_floats(scene), &RendererOptions::default())?;
        let mut running = Running { renderer, frames: self.frames };
        running.run()?;
        Ok(running)
    }

    fn rendered(&self, scene: &Scene) -> Result<Rendering, GpuError> {
        self.running(scene)?.read()
    }

    /// Renders a scene, and times it in turn with the default, which goes first in every other run: what slows the machine down slows
    /// both.
    fn in_turn(&self, scene: &Scene, default: &mut Running, runs: u32) -> Result<(Rendering, Runs), GpuError> {
        let mut own = self.running(scene)?;
        let mut all = Runs::default();
        for n in 0..runs {
            let first = if n % 2 == 0 { default.run()? } else { None };
            let mine = own.run()?;
            let last = if n % 2 == 1 { default.run()? } else { None };
            if let (Some(mine), Some(default)) = (mine, first.or(last)) {
                all.own.push(mine);
                all.default.push(default);
            }
        }
        Ok((own.read()?, all))
    }

    fn in_f64(&self, scene: &Scene) -> Rendering {
        let scene = &in_floats(scene);
        let format = Slot::Frames.format(scene);
        let [width, height] = scene.frame_size().map(|n| n as usize);
        let mut frames: Vec<&Frame> = self.frames.iter().collect();
        frames.sort_by_key(|f| f.slice);
        let frames: Vec<Texels> = frames.iter().map(|f| Texels::decode([width, height, 1], format, &f.bytes)).collect();
        let mut slots = reference::render(scene, &frames);
        let distance = if scene.has_distance() { slots.remove(&distance_end(scene)) } else { None };
        let picture = slots.remove(&Slot::Picture).unwrap_or_else(|| Texels::untouched([0; 3], 4));
        Rendering { scene: scene.clone(), picture, distance }
    }
}

/// The scene with a picture of floats: steps of 8 bits are as large as many errors.
fn in_floats(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.settings.post.floats = true;
    scene
}

/// Number of samples that the f64 reference of a scene takes, filters of slices included.
fn cost(scene: &Scene) -> f64 {
    let rays = scene.ray_size().iter().map(|n| f64::from(*n)).product::<f64>();
    let taps = f64::from(scene.settings.ray.sliding.max(1)).powi(3);
    let steps = if scene.is_flat() { 1.0 } else { (scene.high - scene.low).length() / scene.step };
    let pixels = scene.volume_size().iter().map(|n| f64::from(*n)).product::<f64>();
    let slices = &scene.settings.slices;
    let window = slices.sigma.map_or(0, |s| s.window.pow(2)) + slices.enhanced_sigma.map_or(0, |s| s.largest.pow(2));
    let diffused = slices.perona_malik.map_or(0, |p| 8 * p.repeat);
    // A filter tap costs a tenth of a sample through the inverse map.
    rays * steps * taps + 0.1 * pixels * f64::from(16 + window + diffused)
}

fn compare(
    dial: &'static str,
    set: &[String],
    rendering: &Rendering,
    reference: &Rendering,
) -> Result<Errors, MeasureError> {
    let fault = |fault: String| MeasureError::Place { dial, set: set.join(" "), fault };
    let picture = enlarged(&rendering.picture, reference.picture.size);
    let mut errors = Errors::from(metrics::pictures(&picture, &reference.picture).map_err(fault)?);
    let maps = rendering.distance.as_ref().zip(reference.distance.as_ref());
    if let Some((measured, expected)) = maps.filter(|(a, b)| a.size == b.size) {
        errors.mm = Some(metrics::distances(measured, expected).map_err(fault)?);
        let (measured, expected) = (normals(&rendering.scene, measured), normals(&reference.scene, expected));
        errors.degrees = Some(metrics::normals(&measured, &expected).map_err(fault)?);
    }
    Ok(errors)
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
