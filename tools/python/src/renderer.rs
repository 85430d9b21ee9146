//! A volume on the device.

use crate::volume::{Given, Volume};
use crate::{Chosen, Pixels, context_of, invalid, json, of_device, picture_array};
use echolume_base::picture::Picture;
use echolume_core::passes::{chain::distance_end, is_hit};
use echolume_core::plan::Rerun;
use echolume_core::scene::default_look::Recorded;
use echolume_core::scene::load::Layers;
use echolume_core::scene::picker::Picker;
use echolume_core::scene::{EchoLevels, Input, Scene, Settings};
use echolume_gpu::RendererOptions;
use echolume_session::marked::{self, Demo};
use echolume_session::measure::outcome::quantities;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard};

/// The picture as `echolume render` saves it: with its measurements, and with marks and a bar if the settings ask for them.
pub fn saved(
    picture: &Picture,
    renderer: &echolume_gpu::Renderer,
    volume: Option<u32>,
    is_synthetic: bool,
) -> PyResult<Pixels> {
    let demo = is_synthetic.then_some(Demo::WithOthers);
    let picture =
        marked::as_set(picture, renderer.scene(), volume, renderer.unveiled(), demo).map_err(of_device)?.into_owned();
    Ok((picture.rgba, [picture.height as usize, picture.width as usize]))
}

/// What a renderer holds.
struct Drawing {
    renderer: echolume_gpu::Renderer,
    layers: Layers,
    volume: Arc<Given>,
    looks: Looks,
}

/// What settings that nobody chose follow from: the first volume, so that the look stays when others come.
struct Looks {
    of: Arc<Given>,
    /// Its levels in a range, as they were counted last.
    counted: Option<(Input, Option<EchoLevels>)>,
}

impl Looks {
    fn scene(&mut self, layers: &Layers) -> PyResult<Scene> {
        let (geometry, stated) = (self.of.geometry().clone(), self.of.stated);
        let shift = self.of.sample.shift();
        let mut recorded = Recorded { geometry, stated, shift, levels: None, is_completed: true };
        if recorded.needs_levels(layers) {
            let input = recorded.samples(&layers.clone().finish().map_err(invalid)?);
            let known = self.counted.filter(|(counted, _)| *counted == input);
            let (_, levels) = known.unwrap_or_else(|| (input, self.of.levels(input)));
            self.counted = Some((input, levels));
            recorded.levels = levels;
        }
        recorded.scene(layers).map_err(invalid)
    }
}

impl Drawing {
    fn send(&mut self) -> PyResult<()> {
        for (slice, bytes) in self.volume.samples.frames().iter().enumerate().filter(|(_, bytes)| !bytes.is_empty()) {
            self.renderer.frame(slice as u32, bytes, 0).map_err(of_device)?;
        }
        self.renderer.show(0).map_err(of_device)
    }

    fn change(&mut self, scene: Scene) -> PyResult<()> {
        match self.renderer.change(scene).map_err(of_device)? {
            Rerun::Steps { .. } => Ok(()),
            Rerun::Frames | Rerun::Everything => self.send(),
        }
    }

    fn picture(&mut self) -> PyResult<Pixels> {
        let picture = self.renderer.picture().map_err(of_device)?;
        saved(&picture, &self.renderer, Some(self.volume.number), self.volume.is_synthetic)
    }

    /// The pictures of one turn, one after the other, and the height and width of each. Leaves the camera at the last one.
    fn turn(&mut self, count: u32) -> PyResult<Pixels> {
        let scene = self.renderer.scene().clone();
        let mut all = (Vec::new(), [0; 2]);
        for camera in scene.turntable(count).map_err(invalid)? {
            // A signal of Python, as Ctrl-C, ends the turn.
            Python::attach(|py| py.check_signals())?;
            let settings = Settings { camera, ..scene.settings.clone() };
            let turned = Scene::new(scene.geometry.clone(), scene.input, settings).map_err(invalid)?;
            self.change(turned)?;
            let (rgba, size) = self.picture()?;
            all.0.extend(rgba);
            all.1 = size;
        }
        Ok(all)
    }

    fn pick(&mut self, at: [f64; 2]) -> PyResult<Option<[f64; 3]>> {
        // Distances of what is shown.
        self.renderer.picture().map_err(of_device)?;
        let map = self.renderer.read(distance_end(self.renderer.scene())).map_err(of_device)?;
        let map = map.ok_or_else(|| invalid("pick: this mode finds no surface; surface and mixed do"))?;
        let scene = self.renderer.scene();
        let rays = [map.size[0] as u32, map.size[1] as u32];
        let Some(([x, y], (origin, direction))) = Picker::of(scene).nearest_ray(at, rays) else { return Ok(None) };
        let distance = map.get([x, y, 0]).first().copied().filter(|mm| is_hit(*mm));
        Ok(distance.map(|mm| scene.point_of(origin + direction * mm)))
    }
}

/// What a measurement found, or why it found nothing: its quantities with values and units.
type Measured = (Vec<(&'static str, f64, &'static str)>, Option<&'static str>);

/// Renders a volume.
#[pyclass(module = "echolume._echolume", frozen)]
pub struct Renderer {
    drawing: Mutex<Drawing>,
}

impl Renderer {
    fn lock(&self) -> MutexGuard<'_, Drawing> {
        self.drawing.lock().unwrap_or_else(|e| e.into_inner())
    }
}

#[pymethods]
impl Renderer {
    /// `is_phantom`: presets of the phantom come first.
    #[new]
    fn new(
        py: Python<'_>,
        volume: &Volume,
        chosen: Chosen,
        device: Option<String>,
        is_phantom: bool,
    ) -> PyResult<Self> {
        let given = volume.0.clone();
        py.detach(|| {
            let mut layers = Layers::default();
            if is_phantom {
                layers.phantom(chosen.presets.is_empty()).map_err(invalid)?;
            }
            let layers = chosen.over(layers)?;
            let mut looks = Looks { of: given.clone(), counted: None };
            let scene = looks.scene(&layers)?;
            let context = context_of(device.as_deref())?;
            let options = RendererOptions::default();
            let renderer = echolume_gpu::Renderer::new(&context, scene, &options).map_err(of_device)?;
            let mut drawing = Drawing { renderer, layers, volume: given, looks };
            drawing.send()?;
            Ok(Renderer { drawing: Mutex::new(drawing) })
        })
    }

    fn picture<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        let picture = py.detach(|| self.lock().picture())?;
        picture_array(py, picture)
    }

    fn set(&self, py: Python<'_>, chosen: Chosen) -> PyResult<()> {
        py.detach(|| {
            let mut drawing = self.lock();
            let layers = chosen.over(drawing.layers.clone())?;
            let scene = drawing.looks.scene(&layers)?;
            drawing.change(scene)?;
            drawing.layers = layers;
            Ok(())
        })
    }

    /// Shows another volume of the same geometry and type, in the range and with the look of the first.
    fn update(&self, py: Python<'_>, volume: &Volume) -> PyResult<()> {
        let given = volume.0.clone();
        py.detach(|| {
            let mut drawing = self.lock();
            let (old, new) = (&drawing.volume, &given);
            if old.geometry() != new.geometry() || old.sample != new.sample {
                return Err(invalid("update: another geometry or type of samples needs a Renderer of its own"));
            }
            drawing.volume = given;
            drawing.send()
        })
    }

    /// The settings that are drawn, as JSON.
    fn settings(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| json(&self.lock().renderer.scene().settings))
    }

    fn measurements(&self, py: Python<'_>) -> Vec<Measured> {
        py.detach(|| {
            let drawing = self.lock();
            let found = drawing.renderer.scene().settings.drawn.measure.iter().map(|measured| match quantities(measured) {
                Ok(all) => (all.into_iter().map(|found| (found.name, found.value, found.unit)).collect(), None),
                Err(why) => (Vec::new(), Some(why)),
            });
            found.collect()
        })
    }

    fn pick(&self, py: Python<'_>, column: f64, row: f64) -> PyResult<Option<[f64; 3]>> {
        py.detach(|| self.lock().pick([column, row]))
    }

    fn turntable<'py>(&self, py: Python<'py>, count: u32) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        let (bytes, [height, width]) = py.detach(|| {
            let mut drawing = self.lock();
            let scene = drawing.renderer.scene().clone();
            let turned = drawing.turn(count);
            // Also where a picture of the turn failed: the next picture looks as before.
            let restored = drawing.change(scene);
            let turned = turned?;
            restored.map(|()| turned)
        })?;
        crate::array(py, bytes, &[count as usize, height, width, 4])
    }
}
