//! Echolume as a Python module. Arrays are made by numpy itself, from bytes that are copied once.

use echolume::low_level::live::{Feed, Step};
use echolume::low_level::marked;
use echolume::low_level::picture::Picture;
use echolume::low_level::probe::Geometry;
use echolume::low_level::scene::default_look::block_edge;
use echolume::low_level::scene::load::Layers;
use echolume::low_level::scene::{EchoHistogram, Input, Scene, Settings};
use echolume::low_level::source::live::{Playback, PlaybackSource};
use echolume::low_level::source::phantom::{Phantom, PhantomOptions, PhantomSource};
use echolume::low_level::source::SampleType;
use echolume::low_level::source::{self, Frame, OpenOptions, Source};
use echolume::{Context, ContextOptions, DeviceChoice, RendererOptions, StreamOptions};
use pyo3::create_exception;
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyDict, PyTuple};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

create_exception!(_echolume, DeviceError, PyRuntimeError, "A Vulkan device is missing, failed or was lost.");

/// How long a step of a stream waits, so that Ctrl-C of Python is seen.
const PATIENCE: Duration = Duration::from_millis(50);

fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn of_device(error: impl std::fmt::Display) -> PyErr {
    DeviceError::new_err(error.to_string())
}

/// A numpy array of these bytes, which it owns and may change.
fn array<'py>(py: Python<'py>, bytes: &[u8], dtype: &str, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    let numpy = py.import("numpy")?;
    let flat = numpy.call_method1("frombuffer", (PyByteArray::new(py, bytes), dtype))?;
    flat.call_method1("reshape", (PyTuple::new(py, shape)?,))
}

/// The recording at a path; without one the phantom.
fn open(path: Option<&PathBuf>, options: OpenOptions) -> PyResult<Box<dyn Source>> {
    match path {
        Some(path) => source::open_with(path, options).map_err(invalid),
        None => {
            let phantom = Phantom::new(PhantomOptions::default()).map_err(invalid)?;
            Ok(Box::new(PhantomSource::new(phantom)))
        }
    }
}

fn check_volume(source: &dyn Source, volume: usize) -> PyResult<()> {
    match source.volumes() {
        count if volume >= count => {
            Err(PyIndexError::new_err(format!("volume {volume}: there are {count}, numbered from 0")))
        }
        _ => Ok(()),
    }
}

/// Every frame of a volume, in the order of the recording.
fn frames(source: &mut dyn Source, volume: usize) -> PyResult<Vec<Frame>> {
    source.skip_to_volume(volume).map_err(invalid)?;
    let (mut found, mut number) = (Vec::new(), None);
    for _ in 0..source.frames_per_volume() {
        let Some(frame) = source.next_frame().map_err(invalid)? else { break };
        if *number.get_or_insert(frame.volume) != frame.volume {
            break;
        }
        found.push(frame);
    }
    Ok(found)
}

/// Layers of settings: presets, then assignments such as `mode=mip`.
fn layers_of(presets: &[String], settings: &[String], is_phantom: bool) -> PyResult<Layers> {
    let mut layers = Layers::default();
    if is_phantom {
        layers.phantom(presets.is_empty()).map_err(invalid)?;
    }
    for preset in presets {
        layers.preset(preset).map_err(invalid)?;
    }
    for assignment in settings {
        layers.set(assignment).map_err(invalid)?;
    }
    Ok(layers)
}

fn context_of(device: Option<&str>) -> PyResult<Arc<Context>> {
    let device = match device {
        Some(name) => name.parse::<DeviceChoice>().map_err(invalid)?,
        None => DeviceChoice::default(),
    };
    Context::new(&ContextOptions { device, ..ContextOptions::default() }).map_err(of_device)
}

/// The samples with the range that the settings ask for, and the settings that show a volume: what nobody chose follows from its echoes, as in
/// `echolume render`.
fn completed(layers: &Layers, geometry: &Geometry, stored: Stored, frames: &[Frame]) -> PyResult<(Input, Settings)> {
    let input = stored.input.in_range_of(&layers.clone().finish().map_err(invalid)?, stored.shift);
    let levels = layers.needs_levels().then(|| {
        let mut histogram = EchoHistogram::new(geometry, input, block_edge(geometry));
        frames.iter().for_each(|frame| histogram.take(&frame.bytes));
        histogram.levels()
    });
    let settings = match levels {
        // Of a volume that is all the same nothing follows.
        Some(None) => layers.clone().finish().map_err(invalid)?,
        levels => layers.completed(geometry, levels.flatten().as_ref()).map_err(invalid)?.settings,
    };
    Ok((input, settings))
}

/// The picture as `echolume render` saves it: with its measurements, and with marks and a bar if the settings ask for them. Its bytes, RGBA, and
/// its height and width.
fn saved(picture: &Picture, renderer: &echolume::Renderer) -> PyResult<(Vec<u8>, [usize; 2])> {
    let picture = marked::as_set(picture, renderer.scene(), renderer.unveiled(), None).map_err(of_device)?.into_owned();
    Ok((picture.rgba, [picture.height as usize, picture.width as usize]))
}

/// Reads one volume of a recording into memory. See the stubs for all it returns.
#[pyfunction]
#[pyo3(signature = (path, volume=0, *, probe=None, voxel_spacing=None))]
fn read<'py>(
    py: Python<'py>,
    path: PathBuf,
    volume: usize,
    probe: Option<PathBuf>,
    voxel_spacing: Option<[f64; 3]>,
) -> PyResult<Bound<'py, PyDict>> {
    let (source, frames) = py.detach(|| {
        let mut source =
            open(Some(&path), OpenOptions { probe: probe.as_deref(), voxel_spacing, ..OpenOptions::default() })?;
        check_volume(&*source, volume)?;
        let frames = frames(&mut *source, volume)?;
        PyResult::Ok((source, frames))
    })?;
    let (geometry, sample) = (source.geometry(volume), source.sample_type());
    let [columns, rows] = geometry.frame_size();
    let slices = geometry.slices();
    let each = columns * rows * source.stored_type().bytes();
    let mut bytes = vec![0; each * slices];
    for frame in frames.iter().filter(|frame| frame.slice < slices && frame.bytes.len() == each) {
        bytes[each * frame.slice..each * (frame.slice + 1)].copy_from_slice(&frame.bytes);
    }
    let dtype = match sample {
        SampleType::U8 => "u1",
        SampleType::U16 => "<u2",
        SampleType::I16 => "<i2",
        SampleType::F32 => "<f4",
    };
    if sample == SampleType::I16 {
        // Signed samples are stored with an offset of half the range.
        bytes.chunks_exact_mut(2).for_each(|two| two[1] ^= 0x80);
    }
    let found = PyDict::new(py);
    found.set_item("samples", array(py, &bytes, dtype, &[slices, rows, columns])?)?;
    found.set_item("range", source.range().map(|v| v - sample.shift()))?;
    found.set_item("volumes", source.volumes())?;
    let world = match &geometry {
        Geometry::Cartesian(grid) => {
            found.set_item("geometry", "cartesian")?;
            found.set_item("spacing", grid.spacing)?;
            let world = source.world().unwrap_or_else(|| echolume::low_level::probe::World::of(grid));
            let column = |v: glam::DVec3, w: f64| [v.x, v.y, v.z, w];
            let columns = [
                column(world.axis(0), 0.0),
                column(world.axis(1), 0.0),
                column(world.axis(2), 0.0),
                column(world.origin(), 1.0),
            ];
            let rows: Vec<u8> = (0..4).flat_map(|r| columns.map(|c| c[r])).flat_map(f64::to_le_bytes).collect();
            Some(array(py, &rows, "<f8", &[4, 4])?)
        }
        Geometry::Sweep(_) => {
            found.set_item("geometry", "sweep")?;
            found.set_item("spacing", None::<[f64; 3]>)?;
            None
        }
    };
    found.set_item("voxel_to_world", world)?;
    Ok(found)
}

/// The samples of a recording.
#[derive(Clone, Copy)]
struct Stored {
    /// As the recording states them.
    input: Input,
    /// What signed samples are stored with.
    shift: f64,
}

/// What a renderer holds.
struct Drawing {
    renderer: echolume::Renderer,
    layers: Layers,
    frames: Vec<Frame>,
    geometry: Geometry,
    stored: Stored,
}

impl Drawing {
    fn scene(&self, layers: &Layers) -> PyResult<Scene> {
        let (input, settings) = completed(layers, &self.geometry, self.stored, &self.frames)?;
        Scene::new(self.geometry.clone(), input, settings).map_err(invalid)
    }

    fn send(&mut self) -> PyResult<()> {
        for frame in &self.frames {
            self.renderer.frame(frame.slice as u32, &frame.bytes, 0).map_err(of_device)?;
        }
        self.renderer.show(0).map_err(of_device)
    }

    fn change(&mut self, scene: Scene) -> PyResult<()> {
        use echolume::low_level::plan::Rerun;
        match self.renderer.change(scene).map_err(of_device)? {
            Rerun::Steps { .. } => Ok(()),
            Rerun::Frames | Rerun::Everything => self.send(),
        }
    }

    /// The picture, RGBA, and its height and width.
    fn picture(&mut self) -> PyResult<(Vec<u8>, [usize; 2])> {
        let picture = self.renderer.picture().map_err(of_device)?;
        saved(&picture, &self.renderer)
    }

    /// The pictures of one turn, one after the other, and the height and width of each. Leaves the camera at the last one.
    fn turn(&mut self, count: u32) -> PyResult<(Vec<u8>, [usize; 2])> {
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
}

/// Renders a volume of a recording. See the stubs.
#[pyclass]
struct Renderer {
    drawing: Mutex<Drawing>,
}

impl Renderer {
    fn lock(&self) -> MutexGuard<'_, Drawing> {
        self.drawing.lock().unwrap_or_else(|e| e.into_inner())
    }
}

#[pymethods]
impl Renderer {
    #[new]
    #[pyo3(signature = (path=None, volume=0, *, presets=Vec::new(), settings=Vec::new(), device=None, probe=None, voxel_spacing=None))]
    // Keywords of Python.
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        path: Option<PathBuf>,
        volume: usize,
        presets: Vec<String>,
        settings: Vec<String>,
        device: Option<String>,
        probe: Option<PathBuf>,
        voxel_spacing: Option<[f64; 3]>,
    ) -> PyResult<Renderer> {
        py.detach(|| {
            let options = OpenOptions { probe: probe.as_deref(), voxel_spacing, ..OpenOptions::default() };
            let layers = layers_of(&presets, &settings, path.is_none())?;
            let mut source = open(path.as_ref(), options)?;
            check_volume(&*source, volume)?;
            let frames = frames(&mut *source, volume)?;
            let stated = Input { stored: source.stored_type(), range: source.range() };
            let stored = Stored { input: stated, shift: source.sample_type().shift() };
            let geometry = source.geometry(volume);
            let (input, settings) = completed(&layers, &geometry, stored, &frames)?;
            let scene = Scene::new(geometry.clone(), input, settings).map_err(invalid)?;
            let context = context_of(device.as_deref())?;
            let renderer = echolume::Renderer::new(&context, scene, &RendererOptions::default()).map_err(of_device)?;
            let mut drawing = Drawing { renderer, layers, frames, geometry, stored };
            drawing.send()?;
            Ok(Renderer { drawing: Mutex::new(drawing) })
        })
    }

    /// Draws the picture: uint8, (height, width, 4), red, green, blue, alpha.
    fn picture<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (rgba, [height, width]) = py.detach(|| self.lock().picture())?;
        array(py, &rgba, "u1", &[height, width, 4])
    }

    /// Changes settings; the next picture runs only what depends on them.
    #[pyo3(signature = (*assignments))]
    fn set(&self, py: Python<'_>, assignments: Vec<String>) -> PyResult<()> {
        py.detach(|| {
            let mut drawing = self.lock();
            let mut layers = drawing.layers.clone();
            for assignment in &assignments {
                layers.set(assignment).map_err(invalid)?;
            }
            let scene = drawing.scene(&layers)?;
            drawing.change(scene)?;
            drawing.layers = layers;
            Ok(())
        })
    }

    /// Pictures of one turn about the vertical axis of the view: uint8, (count, height, width, 4).
    fn turntable<'py>(&self, py: Python<'py>, count: u32) -> PyResult<Bound<'py, PyAny>> {
        if !(1..=3600).contains(&count) {
            return Err(invalid(format!("turntable({count}): must lie in 1..=3600 pictures")));
        }
        let (bytes, [height, width]) = py.detach(|| {
            let mut drawing = self.lock();
            let scene = drawing.renderer.scene().clone();
            let turned = drawing.turn(count);
            // Also where a picture of the turn failed: the next picture looks as before.
            let restored = drawing.change(scene);
            let turned = turned?;
            restored.map(|()| turned)
        })?;
        array(py, &bytes, "u1", &[count as usize, height, width, 4])
    }
}

/// Pictures of a recording that is played. See the stubs.
#[pyclass]
struct Stream {
    stream: Mutex<echolume::Stream>,
}

#[pymethods]
impl Stream {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<(u32, Bound<'py, PyAny>)>> {
        loop {
            py.check_signals()?;
            let step = py.detach(|| {
                let mut stream = self.stream.lock().unwrap_or_else(|e| e.into_inner());
                let step = stream.step(PATIENCE).map_err(of_device)?;
                let Step::Picture(shown) = step else { return Ok(Err(step)) };
                // The renderer still has the scene that it drew.
                let picture = shown.picture.as_ref().zip(stream.renderer());
                let saved = picture.map(|(picture, renderer)| saved(picture, renderer)).transpose()?;
                PyResult::Ok(Ok((shown.volume, saved)))
            })?;
            let step = match step {
                Ok((_, None)) => continue,
                Ok((volume, Some((rgba, [height, width])))) => {
                    return Ok(Some((volume, array(py, &rgba, "u1", &[height, width, 4])?)));
                }
                Err(step) => step,
            };
            match step {
                Step::Picture(_) => continue,
                Step::Fault(why) => return Err(invalid(why)),
                Step::End(Some(why)) => return Err(invalid(why)),
                Step::End(None) => return Ok(None),
                Step::Progress => {}
            }
        }
    }
}

/// Plays a recording and draws each of its volumes. See the stubs.
#[pyfunction]
#[pyo3(signature = (path, *, presets=Vec::new(), settings=Vec::new(), device=None, probe=None, voxel_spacing=None, rate=None))]
// Keywords of Python.
#[allow(clippy::too_many_arguments)]
fn stream(
    py: Python<'_>,
    path: PathBuf,
    presets: Vec<String>,
    settings: Vec<String>,
    device: Option<String>,
    probe: Option<PathBuf>,
    voxel_spacing: Option<[f64; 3]>,
    rate: Option<f64>,
) -> PyResult<Stream> {
    let playback = match rate {
        None => Playback::Fast,
        Some(rate) if rate > 0.0 && rate <= 1e6 => Playback::Volumes(rate),
        Some(rate) => return Err(invalid(format!("rate={rate}: must be above 0, at most 1e6 volumes a second"))),
    };
    py.detach(|| {
        let layers = layers_of(&presets, &settings, false)?;
        let options = OpenOptions { probe: probe.as_deref(), voxel_spacing, ..OpenOptions::default() };
        let source = open(Some(&path), options)?;
        let chosen = layers.clone().finish().map_err(invalid)?;
        if chosen.samples.range.is_some() {
            return Err(invalid("samples.range: a stream has the range that its recording states; only a Renderer takes another"));
        }
        let context = context_of(device.as_deref())?;
        let feed = Feed::new(Box::new(PlaybackSource::new(source, playback, 1)), None).map_err(of_device)?;
        let options = StreamOptions { chosen: Some(layers), ..StreamOptions::default() };
        Ok(Stream { stream: Mutex::new(echolume::Stream::new(&context, feed, chosen, options)) })
    })
}

#[pymodule]
fn _echolume(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("DeviceError", module.py().get_type::<DeviceError>())?;
    module.add_class::<Renderer>()?;
    module.add_class::<Stream>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(stream, module)?)
}
