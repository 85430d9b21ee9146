//! Pictures of a source that plays.

use crate::renderer::saved;
use crate::{Chosen, Pixels, context_of, invalid, json, of_device, picture_array};
use echolume_core::scene::load::Layers;
use echolume_session::live::{self, Feed, Step, StreamOptions};
use echolume_source::igtl::{self, Network, NetworkOptions, Poses};
use echolume_source::live::{Live, Playback, PlaybackSource};
use echolume_source::phantom::{Phantom, PhantomOptions, PhantomSource};
use echolume_source::piped::Piped;
use echolume_source::{self as source, OpenOptions};
use pyo3::prelude::*;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

/// How long a step waits, so that Ctrl-C of Python is seen.
const PATIENCE: Duration = Duration::from_millis(50);
/// Volumes of the phantom, which are played in a loop.
const PHANTOM_VOLUMES: usize = 4;

/// Where frames come from.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Origin {
    /// `file`, `pipe`, `igtl` or `phantom`.
    kind: String,
    /// The file, the pipe, or the address of the server.
    place: PathBuf,
    probe: Option<PathBuf>,
    voxel_spacing: Option<[f64; 3]>,
    /// Volumes in a second.
    rate: Option<f64>,
    rounds: u32,
    /// OpenIGTLink: the device whose images are taken, and what tracks them.
    device_name: Option<String>,
    tool: Option<String>,
}

impl Origin {
    fn open(self) -> PyResult<Box<dyn Live>> {
        let playback = self.rate.map_or(Playback::Fast, Playback::Volumes);
        Ok(match self.kind.as_str() {
            "phantom" => {
                let options = PhantomOptions { volumes: PHANTOM_VOLUMES, both_ways: true, ..PhantomOptions::default() };
                let phantom = PhantomSource::cached(Phantom::new(options).map_err(invalid)?);
                Box::new(PlaybackSource::new(Box::new(phantom), playback, u32::MAX))
            }
            "igtl" => Box::new(self.network()?),
            "pipe" => {
                let pipe = File::open(&self.place).map_err(|e| invalid(format!("{}: {e}", self.place.display())))?;
                Box::new(Piped::new(pipe, self.probe.as_deref()).map_err(invalid)?)
            }
            _ => {
                let (probe, voxel_spacing) = (self.probe.as_deref(), self.voxel_spacing);
                let options = OpenOptions { probe, voxel_spacing, ..OpenOptions::default() };
                let mut recording = source::open_with(&self.place, options).map_err(invalid)?;
                recording.prepare().map_err(invalid)?;
                Box::new(PlaybackSource::new(recording, playback, self.rounds))
            }
        })
    }

    fn network(&self) -> PyResult<Network> {
        let address = self.place.to_str().unwrap_or_default();
        if address.is_empty() || igtl::port(address).is_none_or(|port| port == 0) {
            return Err(invalid(format!("igtl://{address}: must read igtl://HOST or igtl://HOST:PORT")));
        }
        let mut options = NetworkOptions { device: self.device_name.clone(), ..NetworkOptions::default() };
        match (&mut options.poses, self.tool.as_deref()) {
            (poses, Some("image")) => *poses = Poses::Image,
            (Poses::Messages { device, .. }, tool) => *device = tool.map(str::to_string),
            (Poses::Image, _) => {}
        }
        Network::connect(address, options).map_err(|e| invalid(format!("igtl://{address}: {e}")))
    }
}

/// What a step of a stream led to.
enum Next {
    Picture(u32, Pixels),
    Fault(String),
    End,
    Nothing,
}

/// Pictures of a source that plays.
#[pyclass(module = "echolume._echolume", frozen)]
pub struct Stream {
    /// None when it was closed.
    stream: Mutex<Option<live::Stream>>,
    is_synthetic: bool,
}

impl Stream {
    fn lock(&self) -> MutexGuard<'_, Option<live::Stream>> {
        self.stream.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn step(&self) -> PyResult<Next> {
        let mut stream = self.lock();
        let Some(stream) = stream.as_mut() else { return Ok(Next::End) };
        Ok(match stream.step(PATIENCE).map_err(of_device)? {
            Step::Picture(shown) => {
                // The renderer still has the scene that it drew.
                match shown.picture.as_ref().zip(stream.renderer()) {
                    None => Next::Nothing,
                    Some((picture, renderer)) => {
                        let pixels = saved(picture, renderer, Some(shown.volume), self.is_synthetic)?;
                        Next::Picture(shown.volume, pixels)
                    }
                }
            }
            Step::Fault(why) => Next::Fault(why),
            Step::End(Some(why)) => return Err(invalid(why)),
            Step::End(None) => Next::End,
            Step::Progress => Next::Nothing,
        })
    }
}

/// The number of a volume and its picture, or in words what was left out.
type Shown<'py> = (Option<(u32, Bound<'py, numpy::PyArrayDyn<u8>>)>, Option<String>);

#[pymethods]
impl Stream {
    #[new]
    fn new(py: Python<'_>, origin: Origin, chosen: Chosen, device: Option<String>) -> PyResult<Stream> {
        py.detach(|| {
            let is_synthetic = origin.kind == "phantom";
            let mut layers = Layers::default();
            if is_synthetic {
                layers.phantom(chosen.presets.is_empty()).map_err(invalid)?;
            }
            let layers = chosen.over(layers)?;
            let settings = layers.clone().finish().map_err(invalid)?;
            if settings.samples.range.is_some() {
                return Err(invalid(
                    "samples.range: a stream has the range that its recording states; only a Renderer takes another",
                ));
            }
            let live = origin.open()?;
            let context = context_of(device.as_deref())?;
            let feed = Feed::new(live, None::<&Path>).map_err(of_device)?;
            let options = StreamOptions { chosen: Some(layers), ..StreamOptions::default() };
            let stream = live::Stream::new(&context, feed, settings, options);
            Ok(Stream { stream: Mutex::new(Some(stream)), is_synthetic })
        })
    }

    /// The next picture or the next fault; None at the end. Waits without the GIL.
    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<Shown<'py>>> {
        loop {
            py.check_signals()?;
            match py.detach(|| self.step())? {
                Next::Picture(volume, pixels) => {
                    return Ok(Some((Some((volume, picture_array(py, pixels)?)), None)));
                }
                Next::Fault(why) => return Ok(Some((None, Some(why)))),
                Next::End => return Ok(None),
                Next::Nothing => {}
            }
        }
    }

    /// The settings that are drawn, as JSON; None before the first frame.
    fn settings(&self, py: Python<'_>) -> PyResult<Option<String>> {
        py.detach(|| {
            let stream = self.lock();
            let scene = stream.as_ref().and_then(|stream| stream.scene());
            scene.map(|scene| json(&scene.settings)).transpose()
        })
    }

    /// Ends it, with its connection.
    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.lock().take()));
    }
}
