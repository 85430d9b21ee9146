//! Measures error against run time: renders and times every setting of every dial, and compares it with the f64 reference or, if that
//! is too slow, with a converged picture whose own error is estimated.

use super::dials::{Dial, Place};
use crate::error_report::convergence::{self, Range};
use crate::error_report::metrics;
use crate::error_report::{self, Errors, FORMAT, Point, Reference, Report, Sizes, Time};
use crate::gpu::{Context, GpuError, Renderer, RendererOptions};
use crate::machine;
use crate::passes::chain::distance_end;
use crate::passes::shade::normal;
use crate::passes::{Slot, Texels};
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
}

/// Samples that the f64 reference takes in about a minute.
const MAX_F64_SAMPLES: f64 = 6e7;

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
    times: Vec<f64>,
}

impl ErrorMeasurement<'_> {
    /// Measures the dials one after the other. `progress` is called with dial and label before each setting is rendered.
    ///
    /// # Errors
    /// A setting is refused, or the device fails.
    pub fn report(&self, dials: &[Dial], mut progress: impl FnMut(&str, &str)) -> Result<Report, MeasureError> {
        let mut measured = Vec::new();
        for dial in dials {
            measured.push(self.measure_dial(dial, &mut progress)?);
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
        })
    }

    fn measure_dial(
        &self,
        dial: &Dial,
        progress: &mut impl FnMut(&str, &str),
    ) -> Result<error_report::Dial, MeasureError> {
        progress(dial.name, "its reference");
        let best = self.scene_at(dial, &dial.best)?;
        let exact = match self.reference {
            ReferenceChoice::F64 => true,
            ReferenceChoice::Converged => false,
            ReferenceChoice::Auto => cost(&best) <= MAX_F64_SAMPLES,
        };
        let (expected, reference) = match exact {
            _ if dial.is_look => (self.rendered(&best, 0)?, Reference::AsItIs),
            true => (self.in_f64(&best), Reference::F64),
            false => {
                let rendering = self.rendered(&best, 0)?;
                let nearly = self.rendered(&self.scene_at(dial, &dial.nearly)?, 0)?;
                let own = compare(dial, &[], &nearly, &rendering)?.rmse;
                (rendering, Reference::Converged { set: dial.best.clone(), rmse: own })
            }
        };
        let mut points = Vec::new();
        for (n, place) in dial.places.iter().enumerate() {
            progress(dial.name, &place.label);
            let rendering = self.rendered(&self.scene_at(dial, &place.set)?, self.repeats)?;
            let errors = compare(dial, &place.set, &rendering, &expected)?;
            points.push(point(place, errors, &rendering, n == 0));
        }
        let steps = dial.name == "step";
        // The error of the device if only its arithmetic differs.
        let floor = match exact && steps {
            true => Some(compare(dial, &[], &self.rendered(&best, 0)?, &expected)?.rmse),
            false => None,
        };
        let fitted = || {
            let pairs: Vec<[f64; 2]> = points.iter().map(|p| [p.value, p.errors.rmse]).collect();
            let pixel = self.scene.grid.pitch[0].min(self.scene.grid.pitch[1]);
            convergence::fit(&pairs, Range { step: [pixel / 64.0, 0.75 * pixel], floor: floor.unwrap_or(0.0) }).ok()
        };
        let order = if steps { fitted() } else { None };
        Ok(error_report::Dial { name: dial.name.into(), unit: dial.unit.into(), reference, points, order, floor })
    }

    fn scene_at(&self, dial: &Dial, set: &[String]) -> Result<Scene, MeasureError> {
        let fault = |fault: String| MeasureError::Place { dial: dial.name, set: set.join(" "), fault };
        let layered = || -> Result<_, LoadError> {
            let mut layers = self.layers.clone();
            set.iter().try_for_each(|assignment| layers.set(assignment))?;
            layers.finish()
        };
        let settings = layered().map_err(|e| fault(e.to_string()))?;
        let made: Result<Scene, SceneError> = Scene::new(self.scene.geometry.clone(), self.scene.input, settings);
        made.map_err(|e| fault(e.to_string()))
    }

    fn rendered(&self, scene: &Scene, repeats: u32) -> Result<Rendering, GpuError> {
        let scene = &in_floats(scene);
        let mut renderer = Renderer::new(self.context, scene.clone(), &RendererOptions::default())?;
        let mut times = Vec::new();
        // The first run compiles shaders and is not counted.
        for n in 0..=repeats {
            for frame in self.frames {
                renderer.frame(frame.slice as u32, &frame.bytes, 0)?;
            }
            renderer.show(0)?;
            renderer.picture()?;
            let taken = renderer.take_times()?;
            if n > 0 && !taken.is_empty() {
                times.push(taken.iter().map(|t| t.total).sum());
            }
        }
        let missing = || GpuError::Broken("the plan has no picture".into());
        let picture = renderer.read(Slot::Picture)?.ok_or_else(missing)?;
        let distance = match scene.has_distance() {
            true => renderer.read(distance_end(scene))?,
            false => None,
        };
        Ok(Rendering { scene: scene.clone(), picture, distance, times })
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
        Rendering { scene: scene.clone(), picture, distance, times: Vec::new() }
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

fn compare(dial: &Dial, set: &[String], rendering: &Rendering, reference: &Rendering) -> Result<Errors, MeasureError> {
    let fault = |fault: String| MeasureError::Place { dial: dial.name, set: set.join(" "), fault };
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

fn point(place: &Place, errors: Errors, rendering: &Rendering, is_default: bool) -> Point {
    Point {
        label: place.label.clone(),
        set: place.set.clone(),
        value: place.value,
        errors,
        time: Time::of(&rendering.times),
        is_default,
    }
}
