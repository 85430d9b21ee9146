//! Everything that depends on the geometry of the frames: the scenes, the renderer with its volume images, and the state of the picture.

use super::cine::{Cine, CineVolume};
use super::phase::{Display, InFlight, Phase, Replay};
use super::statistics::Statistics;
use super::volume_pool::{Update, VolumePool};
use crate::gpu::{GpuError, Renderer, SceneMaker};
use crate::picture::Picture;
use crate::plan::{Rerun, Work};
use crate::probe::Geometry;
use crate::scene::{Input, Scene, SceneError, Settings};
use crate::source::recorder::Header;
use std::borrow::Cow;
use std::collections::HashSet;
use std::time::{Duration, Instant};

/// Frames of a replay that one step sends: a few milliseconds of work.
const REPLAY_FRAMES: usize = 8;

/// A picture of a stream that the device has finished.
#[derive(Debug)]
pub struct FinishedPicture {
    /// Number of the volume that the picture shows; of a rolling one that of the newest slice.
    pub volume: u32,
    /// The pixels. None if pictures stay on the device ([`StreamOptions::readback`](super::StreamOptions::readback)).
    pub picture: Option<Picture>,
    /// Time from the arrival of the newest frame that no earlier picture shows to the completion of the picture; 0 if earlier pictures show all
    /// frames.
    pub latency: Duration,
    /// Time from the start of the drawing to the completion of the picture.
    pub took: Duration,
    /// Which stages had to run again for the picture.
    pub work: Work,
    /// True if the picture was drawn with few rays and will be drawn in full next
    /// ([`StreamOptions::coarse_first`](super::StreamOptions::coarse_first)).
    pub is_coarse: bool,
}

/// The scenes of a stream: one for each direction of the sweep, and mixtures of both for rolling volumes. All have the same visible bounds,
/// so that a frame can be filtered before its scene is known.
pub struct Views {
    forward: Scene,
    backward: Scene,
    /// The geometry depends on the direction.
    is_directional: bool,
    /// Slices of both directions may be shown together. Then every scene has a mixed geometry, so that passes and slots stay the same.
    is_mixed: bool,
}

impl Views {
    /// The scenes for a geometry and settings.
    ///
    /// # Errors
    /// The geometry cannot be drawn with the settings.
    pub fn new(header: &Header, settings: &Settings, update: Update) -> Result<Views, SceneError> {
        let input = Input { stored: header.stored, range: header.range };
        let scene = |geometry: &Geometry| Scene::new(geometry.clone(), input, settings.clone());
        let (mut forward, mut backward) = (scene(&header.forward)?, scene(&header.backward)?);
        forward.visible_bounds = forward.visible_bounds.with(backward.visible_bounds);
        backward.visible_bounds = forward.visible_bounds;
        let is_directional = header.forward != header.backward;
        Ok(Views { forward, backward, is_directional, is_mixed: is_directional && update == Update::Rolling })
    }

    /// The same scenes with visible bounds so large that one result of stage 1 (the filters of frames) also serves pictures with the settings `full`
    /// and with those that `lowered` makes of them. Settings that cannot be drawn are ignored.
    ///
    /// # Errors
    /// The geometry cannot be drawn with the settings `full`.
    pub fn sharing(
        self,
        header: &Header,
        full: &Settings,
        lowered: &dyn Fn(&Scene) -> Vec<Settings>,
    ) -> Result<Views, SceneError> {
        let input = Input { stored: header.stored, range: header.range };
        let scene = |geometry: &Geometry, of: &Settings| Scene::new(geometry.clone(), input, of.clone());
        let mut geometries = vec![&header.forward];
        geometries.extend(self.is_directional.then_some(&header.backward));
        let full = scene(&header.forward, full)?;
        let others = lowered(&full);
        let others: Vec<Scene> =
            geometries.into_iter().flat_map(|g| others.iter().filter_map(|s| scene(g, s).ok())).collect();
        let others: Vec<&Scene> = others.iter().chain([&self.forward, &self.backward]).collect();
        let (forward, backward) = (self.forward.clone(), self.backward.clone());
        Ok(Views { forward: forward.sharing(&full, &others), backward: backward.sharing(&full, &others), ..self })
    }

    /// The scene by which the first frames are filtered. The filters of stage 1 are the same in all scenes.
    pub fn first(&self) -> &Scene {
        &self.forward
    }

    /// The scene of a volume. `backward`: for each slice, true if it was swept backwards. All slices get the direction of the majority if volumes are
    /// shown whole, or if neighbouring slices of different directions would cross.
    pub fn of(&self, backward: &[bool]) -> Cow<'_, Scene> {
        let count = backward.iter().filter(|b| **b).count();
        let majority = 2 * count > backward.len();
        let mix = |marked: &[bool]| self.forward.geometry.with_mixed_directions(&self.backward.geometry, marked);
        let mixed = self.is_mixed.then(|| mix(backward).or_else(|| mix(&vec![majority; backward.len()]))).flatten();
        match mixed {
            Some(geometry) => Cow::Owned(Scene { geometry, ..self.forward.clone() }),
            None if self.is_directional && majority => Cow::Borrowed(&self.backward),
            None => Cow::Borrowed(&self.forward),
        }
    }
}

/// What the step between two pictures did.
pub(super) enum Begun {
    /// It began to draw a picture.
    Picture,
    /// Changed settings were refused for the given reason. The previous ones remain.
    Refused(String),
    /// The volume of this number has to go through stage 1 again before it can be drawn.
    Restore(u32),
    Nothing,
}

/// Scenes of changed settings, which pictures do not use yet.
pub(super) struct Pending {
    pub views: Views,
    /// Their pipelines are being compiled in the background. Each step between pictures checks this; the end of a compilation wakes the caller.
    /// Otherwise the next step that may begin a picture applies them or starts to compile their pipelines.
    pub is_compiling: bool,
}

impl Pending {
    /// Scenes to apply or compile in the next step that may begin a picture.
    pub fn ready(views: Views) -> Option<Pending> {
        Some(Pending { views, is_compiling: false })
    }
}

/// The part of a stream's state that depends on the geometry of the frames, and is created anew with each geometry.
pub(super) struct Session {
    pub views: Views,
    pub renderer: Renderer,
    pub pool: VolumePool,
    pub phase: Phase,
    pub replay: Option<Replay>,
    pub pending: Option<Pending>,
    pub display: Display,
    /// Time at which the last picture was begun.
    pub begun: Instant,
    /// Number of the volume of the last picture, even if that is still being drawn; None before the first.
    pub drawn: Option<u32>,
    /// By volume image: the volume of its last frame, and when those frames arrived that no picture shows yet.
    arrived: Vec<(u32, Vec<Instant>)>,
    /// By slice of the volume on display: swept backwards.
    pub backward: Vec<bool>,
    /// Pipelines of changed settings are compiled in the background; the settings wait for them.
    compiles_async: bool,
    /// Why changed settings were not applied; not reported yet.
    refused: Option<String>,
    /// A volume that was on display and has to be sent again before it can be drawn.
    to_restore: Option<u32>,
    /// True if pipelines of settings that may follow were requested ([`Session::warm`]).
    pub has_warmed: bool,
}

impl Session {
    /// Starts without volumes. `compiles_async`: pipelines of changed settings are compiled in the background. `to_restore`: number of a volume
    /// of the cine loop to show first; None: the first one to show arrives from the source.
    pub fn new(
        views: Views,
        renderer: Renderer,
        pool: VolumePool,
        compiles_async: bool,
        to_restore: Option<u32>,
    ) -> Session {
        Session {
            arrived: vec![(0, Vec::new()); pool.images() as usize],
            backward: vec![false; views.first().slices() as usize],
            views,
            renderer,
            pool,
            phase: Phase::Idle,
            replay: None,
            pending: None,
            display: Display::Empty,
            begun: Instant::now(),
            drawn: None,
            compiles_async,
            refused: None,
            to_restore,
            has_warmed: false,
        }
    }

    /// Notes that a frame of `volume`, which arrived at `at`, is in the volume image `image`.
    pub(crate) fn frame_arrived(&mut self, image: u32, volume: u32, at: Instant) {
        let (previous, arrived) = &mut self.arrived[image as usize];
        // Arrivals of a volume that was never shown are discarded. A rolling volume takes the frames of all.
        if *previous != volume && !self.pool.is_rolling() {
            arrived.clear();
        }
        *previous = volume;
        arrived.push(at);
    }

    /// Applies the pending settings when all their pipelines are compiled. If stage 1 must run again, whole volumes that were filtered
    /// before are discarded, so that slices of both settings are never mixed. A rolling volume fills again by itself.
    fn apply_pending(&mut self) -> Result<(), GpuError> {
        let Some(Pending { views: next, .. }) = self.pending.take() else { return Ok(()) };
        let scene = next.of(&self.backward);
        if !self.renderer.differs_from(&scene) {
            drop(scene);
            self.views = next;
            self.display.invalidate();
            return Ok(());
        }
        if self.compiles_async {
            let prepared = self.renderer.prepare(&scene);
            if !matches!(prepared, Ok(true)) {
                drop(scene);
                match prepared {
                    Ok(_) => self.pending = Some(Pending { views: next, is_compiling: true }),
                    Err(error) if error.is_device_lost() => {
                        self.pending = Pending::ready(next);
                        return Err(error);
                    }
                    // The previous settings remain.
                    Err(error) => self.refused = Some(error.to_string()),
                }
                return Ok(());
            }
        }
        let rerun = match self.renderer.change(scene.into_owned()) {
            Ok(rerun) => {
                self.views = next;
                rerun
            }
            Err(error) if error.is_device_lost() => {
                self.pending = Pending::ready(next);
                return Err(error);
            }
            // Memory may have run out half-way. It was enough for the previous settings.
            Err(error) => {
                self.refused = Some(error.to_string());
                self.renderer.change(self.views.of(&self.backward).into_owned())?
            }
        };
        self.run_again(&rerun);
        Ok(())
    }

    /// Compiles the pipelines of the changed shaders again; later pictures use them.
    ///
    /// # Errors
    /// A shader cannot be compiled, or the device fails.
    pub fn reload_shaders(&mut self, shaders: &HashSet<String>) -> Result<(), GpuError> {
        let rerun = self.renderer.reload_shaders(shaders)?;
        self.run_again(&rerun);
        Ok(())
    }

    /// Compiles the pipelines of scenes that may follow, if pipelines are compiled in the background.
    pub fn warm(&mut self, scenes: Vec<SceneMaker>) {
        self.has_warmed = true;
        if self.compiles_async
            && let Err(fault) = self.renderer.warm(scenes)
        {
            tracing::debug!("compiled in advance: {fault}");
        }
    }

    fn run_again(&mut self, rerun: &Rerun) {
        self.display.invalidate();
        if !matches!(rerun, Rerun::Steps { .. }) {
            // A replay is interrupted: its first frames went through the previous stage 1.
            let interrupted = self.replay.take().map(|replay| replay.volume.volume);
            self.to_restore = interrupted.or(self.current_volume());
            if !self.pool.is_rolling() {
                self.pool.forget();
                self.arrived.iter_mut().for_each(|(_, arrived)| arrived.clear());
                self.display = Display::Empty;
            }
        }
    }

    /// Number of the volume that will be displayed next, or else of the one on display; None if there is neither.
    pub(crate) fn current_volume(&self) -> Option<u32> {
        self.pool.waiting().or(self.display.volume()).or(self.to_restore)
    }

    /// Number of the volume that is being sent to the device again; None if none is.
    pub(crate) fn replayed_volume(&self) -> Option<u32> {
        self.replay.as_ref().map(|replay| replay.volume.volume)
    }

    /// True if a step has work to do without any event of the source. A replay does not count.
    pub fn is_busy(&self) -> bool {
        matches!(self.phase, Phase::Drawing(_) | Phase::Draining(_))
            || self.pending.as_ref().is_some_and(|pending| !pending.is_compiling)
            || self.refused.is_some()
            || self.to_restore.is_some()
            || self.pool.has_new()
            || matches!(self.display, Display::Stale(_))
    }

    /// Applies changed settings, and begins a picture if there is anything new to show.
    ///
    /// # Errors
    /// The device fails.
    pub fn begin(&mut self) -> Result<Begun, GpuError> {
        self.apply_pending()?;
        let mut arrived = Vec::new();
        if let Some(ready) = self.pool.take() {
            self.renderer.show(ready.image)?;
            (self.backward, self.display) = (ready.backward, Display::Stale(ready.volume));
            arrived = std::mem::take(&mut self.arrived[ready.image as usize].1);
        }
        let Display::Stale(volume) = self.display else {
            let refused = self.refused.take().map(Begun::Refused);
            return Ok(refused.or_else(|| self.to_restore.take().map(Begun::Restore)).unwrap_or(Begun::Nothing));
        };
        let scene = self.views.of(&self.backward);
        if self.renderer.differs_from(&scene) {
            self.renderer.change(scene.into_owned())?;
        }
        self.renderer.begin_picture()?;
        self.phase = Phase::Drawing(InFlight { volume, arrived });
        (self.display, self.begun, self.drawn) = (Display::Current(volume), Instant::now(), Some(volume));
        Ok(Begun::Picture)
    }

    /// Waits for the picture that is being drawn. `queued`: number of events to take before the next picture begins.
    ///
    /// # Errors
    /// The device fails.
    pub fn finish(&mut self, queued: usize, statistics: &mut Statistics) -> Result<FinishedPicture, GpuError> {
        let picture = self.renderer.end_drawing()?;
        let InFlight { volume, arrived } = self.phase.finish(queued);
        // Pipelines of pending settings may have been compiled meanwhile: the next step looks again.
        self.pending.iter_mut().for_each(|pending| pending.is_compiling = false);
        let now = Instant::now();
        arrived.iter().for_each(|at| statistics.record_latency(now.saturating_duration_since(*at)));
        statistics.pictures += 1;
        let latency = arrived.iter().max().map_or(Duration::ZERO, |at| now.saturating_duration_since(*at));
        let (took, work) = (now.saturating_duration_since(self.begun), self.renderer.drawn_work());
        Ok(FinishedPicture { volume, picture, latency, took, work, is_coarse: false })
    }

    /// Starts to send a volume of the cine loop to the device, in place of one that is being sent. Does nothing if no volume image is free.
    pub(crate) fn start_replay(&mut self, volume: CineVolume) {
        let image = self.replay.as_ref().map(|replay| replay.image).or_else(|| self.pool.spare());
        if let Some(image) = image {
            self.replay = Some(Replay { volume, sent: 0, image });
        }
    }

    /// Shows a volume again that was discarded because of changed settings or another device: the one of this number if it is in the cine loop,
    /// otherwise the newest of the loop.
    pub fn restore(&mut self, volume: u32, cine: &Cine) {
        let volumes = cine.volumes();
        if let Some(volume) = volumes.iter().find(|kept| kept.volume == volume).or(volumes.back()) {
            self.start_replay(volume.clone());
        }
    }

    /// Sends the next frames of the replay to the device.
    ///
    /// # Errors
    /// The device fails.
    pub(crate) fn continue_replay(&mut self) -> Result<(), GpuError> {
        let Some(replay) = &mut self.replay else { return Ok(()) };
        let (frames, image) = (&replay.volume.frames, replay.image);
        for frame in frames.iter().skip(replay.sent).take(REPLAY_FRAMES) {
            self.renderer.frame(frame.slice as u32, &frame.bytes, image)?;
            replay.sent += 1;
        }
        if replay.sent >= frames.len() {
            let backward = frames.iter().map(|frame| frame.backward).collect();
            self.pool.put(image, replay.volume.volume, backward);
            self.replay = None;
        }
        Ok(())
    }
}
