//! The loop between a feed and a renderer, one step at a time.

mod state;

use super::asked::Asked;
use super::cine::{Cine, CineLimits};
use super::feed::{Arrived, Feed, FeedCounts};
use super::first_pipelines::FirstPipelines;
use super::first_volume::FirstVolume;
use super::options::StreamOptions;
use super::phase::Phase;
use super::session::{Begun, FinishedPicture, Pending, Session, Views};
use super::statistics::Statistics;
use super::volume_pool::VolumePool;
use crate::gpu::{self, Bands, Context, GpuError, Preparation, Renderer, SceneMaker};
use crate::probe::Probe;
use crate::scene::default_look::Defaults;
use crate::scene::{SceneError, Settings};
use crate::source::Frame;
use crate::source::live::Event;
use crate::source::recorder::Header;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest wait for an event while a picture is being drawn. The end of the picture is noticed no later than that.
const DRAWING_WAIT: Duration = Duration::from_micros(200);

/// What a stream does, or waits for, before its first picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartStep {
    /// It waits for the source, from which nothing has arrived.
    Source,
    /// `done` of `count` pipelines are compiled.
    Compiling { done: usize, count: usize },
    /// `done` of `count` frames of the first volume have arrived.
    Frames { done: u64, count: u64 },
    /// It is about to draw the first picture.
    Picture,
}

/// What a call of [`Stream::step`] did.
#[derive(Debug)]
pub enum Step {
    /// A picture is finished.
    Picture(FinishedPicture),
    /// A frame or a change of settings was refused, or the source reported a fault, for the given reason. The stream goes on.
    Fault(String),
    /// Other work was done, or there was nothing to do.
    Progress,
    /// The source has ended; the reason if that was not expected. No complete volume waits to be drawn.
    End(Option<String>),
}

/// The reason why a step or a change of settings failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StreamError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// Renders a live source. The caller drives it by repeated calls of [`Stream::step`] on one thread.
pub struct Stream {
    context: Arc<Context>,
    feed: Feed,
    /// The counts of earlier feeds.
    earlier_feeds: FeedCounts,
    asked: Asked,
    options: StreamOptions,
    first_volume: Option<FirstVolume>,
    /// The basis of default settings that was found and not yet returned by [`Stream::take_found`].
    found: Option<Defaults>,
    /// None before the first frame header, and after a geometry that could not be set up.
    session: Option<Session>,
    cine: Cine,
    /// Frames that arrive are not shown.
    is_frozen: bool,
    /// The geometry of the frames, also if no session could be made for it.
    header: Option<Header>,
    /// A geometry that begins when the picture in flight is done.
    next_header: Option<Header>,
    /// Added to the volume numbers of the current source, so that volumes of several sources differ in the cine loop.
    volume_base: u32,
    /// The number of frames when the current geometry began.
    frames_before: u64,
    /// The highest volume number so far.
    newest: Option<u32>,
    /// Its counts go on in the next session.
    previous_pool: Option<VolumePool>,
    first_pipelines: FirstPipelines,
    /// The source has ended, and why.
    end: Option<Option<String>>,
    began: Instant,
    /// How often the device was lost. It may have been lost to a watchdog, so each time halves what a submission may take.
    losses: u32,
    statistics: Statistics,
    /// The statistics that were reported last.
    reported: Statistics,
}

impl Stream {
    /// A stream that renders the frames of `feed`. Nothing is created on the device before the first frame header arrives.
    pub fn new(context: &Arc<Context>, feed: Feed, settings: Settings, options: StreamOptions) -> Stream {
        Stream {
            context: context.clone(),
            feed,
            earlier_feeds: FeedCounts::default(),
            asked: Asked { full: settings, lowered: None, is_coarse: options.coarse_first },
            first_volume: options.chosen.clone().map(FirstVolume::new),
            found: None,
            first_pipelines: FirstPipelines::default(),
            options,
            session: None,
            cine: Cine::new(CineLimits::default(), 0),
            is_frozen: false,
            header: None,
            next_header: None,
            volume_base: 0,
            frames_before: 0,
            newest: None,
            previous_pool: None,
            end: None,
            began: Instant::now(),
            losses: 0,
            statistics: Statistics::default(),
            reported: Statistics::default(),
        }
    }

    /// Does the next piece of work: finishes or begins a picture, or processes an event of the source, for which it waits at most `patience`.
    ///
    /// # Errors
    /// The device fails, or a new geometry cannot be drawn with the settings.
    pub fn step(&mut self, patience: Duration) -> Result<Step, StreamError> {
        self.first_pipelines.forget_ended();
        let result = self.advance(patience);
        // A renderer that cannot draw any more is made anew with the next geometry.
        if result.is_err()
            && let Some(Session { pool, .. }) = self.session.take_if(|session| session.renderer.needs_rebuild())
        {
            self.previous_pool = Some(pool);
        }
        result
    }

    /// Chooses the next piece of work and does it.
    fn advance(&mut self, mut patience: Duration) -> Result<Step, StreamError> {
        // The picture in flight is finished first, and no more events are taken.
        let is_ending = self.end.is_some() || (self.next_header.is_some() && !self.is_frozen);
        if let Some(session) = &mut self.session {
            let mut replays = true;
            match session.phase {
                Phase::Drawing(_) => {
                    // With zero patience the call does not block.
                    if !session.renderer.is_drawing()? || (is_ending && !patience.is_zero()) {
                        return self.finish_picture(is_ending);
                    }
                    if is_ending {
                        return Ok(Step::Progress);
                    }
                    patience = patience.min(DRAWING_WAIT);
                    let is_full = session.renderer.is_paced() && !session.renderer.takes_frame()?;
                    if is_full || (self.feed.can_wait() && session.pool.is_waiting()) {
                        // A frame would wait for the picture; a further volume would replace the one that waits to be shown.
                        std::thread::sleep(patience);
                        return Ok(Step::Progress);
                    }
                }
                Phase::Draining(_) if !is_ending => (patience, replays) = (Duration::ZERO, false),
                Phase::Idle | Phase::Draining(_) => {
                    if let Some(step) = self.begin_picture()? {
                        return Ok(step);
                    }
                }
            }
            if let Some(session) = self.session.as_mut().filter(|session| replays && session.replay.is_some()) {
                session.continue_replay()?;
                return Ok(Step::Progress);
            }
        }
        // A new geometry would discard the volume that is frozen.
        let shows_frozen = self.is_frozen && self.session.is_some();
        if self.next_header.is_some() && !shows_frozen {
            let is_prepared = self.has_prepared().inspect_err(|error| self.cannot_prepare(error))?;
            if let Some(header) = self.next_header.take_if(|_| is_prepared) {
                let begun = self.begin_geometry(header);
                self.first_pipelines.release();
                begun?;
            }
            return Ok(Step::Progress);
        }
        if let Some(end) = &self.end {
            return Ok(Step::End(end.clone()));
        }
        if self.is_held() {
            std::thread::sleep(patience);
            return Ok(Step::Progress);
        }
        let arrived = self.feed.next(patience);
        if let Some(session) = &mut self.session {
            session.phase.drained(arrived.is_none());
        }
        let step = arrived.map_or(Ok(Step::Progress), |Arrived { event, at }| self.take(event, at));
        self.submit_last()?;
        step
    }

    /// Waits for the picture in flight.
    fn finish_picture(&mut self, is_ending: bool) -> Result<Step, StreamError> {
        let Some(session) = &mut self.session else { return Ok(Step::Progress) };
        // Of a source that does not wait, a newer volume may have come whole meanwhile: that one is to be shown next.
        let drains = (session.pool.is_rolling() || !self.feed.can_wait()) && !is_ending;
        let queued = if drains { self.feed.waiting() } else { 0 };
        let picture = session.finish(queued, &mut self.statistics)?;
        let is_coarse = self.draw_in_full()?;
        Ok(Step::Picture(FinishedPicture { is_coarse, ..picture }))
    }

    /// The first picture is there: what follows is drawn in full. True if it had fewer rays.
    fn draw_in_full(&mut self) -> Result<bool, StreamError> {
        let coarse = self.asked.drawn();
        self.asked.is_coarse = false;
        let was_coarse = coarse != self.asked.drawn();
        if let (true, Some(session), Some(header)) = (was_coarse, &mut self.session, &self.header) {
            session.pending = Pending::ready(views(header, &self.asked, &self.options)?);
        }
        Ok(was_coarse)
    }

    /// Begins a picture if there is anything new to show. None if there is nothing that a step would end with.
    fn begin_picture(&mut self) -> Result<Option<Step>, StreamError> {
        let Some(session) = &mut self.session else { return Ok(None) };
        if let Some(folder) = &self.options.shaders
            && let Some(changed) = folder.take_changed()
        {
            match session.reload_shaders(&changed) {
                Ok(()) => folder.accept(),
                Err(error) if error.is_device_lost() => return Err(error.into()),
                // The previous pipelines remain.
                Err(error) => folder.refuse(changed, error.to_string()),
            }
        }
        match session.begin()? {
            Begun::Picture => return Ok(Some(Step::Progress)),
            Begun::Refused(fault) => {
                // Another geometry or device does not try the refused settings again.
                if session.pending.is_none() {
                    self.asked.go_back_to(&session.views.first().settings);
                }
                return Ok(Some(Step::Fault(fault)));
            }
            Begun::Restore(volume) => session.restore(volume, &self.cine),
            Begun::Nothing => {}
        }
        Ok(None)
    }

    /// True if the next geometry can begin: what it needs is compiled, or will be when it begins. Otherwise that is being compiled.
    fn has_prepared(&mut self) -> Result<bool, StreamError> {
        let prepares = self.options.prepares && self.session.is_none();
        let mut pipelines = std::mem::take(&mut self.first_pipelines);
        let (Some(header), Some(wake), true) = (&self.next_header, &self.options.wake, prepares) else {
            pipelines.release();
            self.first_pipelines = pipelines;
            return Ok(true);
        };
        let asked = self.first_asked(header);
        let begin = |asked: &Asked| {
            let views = views(header, asked, &self.options)?;
            let options = self.renderer_options(self.options.images);
            Ok(Preparation::begin(&self.context, views.first().clone(), &options, wake.clone())?)
        };
        let is_prepared = pipelines.advance(asked, begin);
        self.first_pipelines = pipelines;
        is_prepared
    }

    /// The settings that a geometry would begin with now.
    fn first_asked(&self, header: &Header) -> Asked {
        let found = self.first_volume.as_ref().and_then(|search| search.at_begin(header));
        let found = found.and_then(|found| found.settings().ok());
        found.map_or_else(|| self.asked.clone(), |found| self.asked.with_look(found))
    }

    /// The next geometry cannot begin. After the loss of the device it is prepared again, otherwise it may begin on another device.
    fn cannot_prepare(&mut self, error: &StreamError) {
        if matches!(error, StreamError::Gpu(error) if error.is_device_lost()) {
            return;
        }
        let next = self.next_header.take();
        if next.is_some() && next != self.header {
            // Its volumes are of the geometry before.
            self.cine = Cine::new(CineLimits::default(), 0);
            self.header = next;
        }
    }

    fn renderer_options(&self, volume_images: u32) -> gpu::RendererOptions {
        let mut options = gpu::RendererOptions {
            volume_images,
            queues: self.options.queues,
            readback: self.options.readback,
            wake: self.options.wake.clone(),
            time_stamps: self.options.time_stamps,
            bands: Bands::Measured { losses: self.losses },
            paced: self.options.paced,
            ..gpu::RendererOptions::default()
        };
        if let Some(folder) = &self.options.shaders {
            options.shaders = folder.shaders_or_embedded();
        }
        options
    }

    /// What the stream does before the first picture. None once a picture exists or is being drawn.
    pub fn start_step(&self) -> Option<StartStep> {
        let Some(session) = &self.session else {
            let progress = self.first_pipelines.progress();
            return Some(progress.map_or(StartStep::Source, |[done, count]| StartStep::Compiling { done, count }));
        };
        let frames = || {
            let count = u64::from(session.renderer.scene().slices());
            StartStep::Frames { done: (self.statistics.frames - self.frames_before).min(count), count }
        };
        (!session.renderer.has_drawn()).then(|| if session.pool.has_new() { StartStep::Picture } else { frames() })
    }

    /// Submits what was taken from the feed, unless more waits there: frames that wait together go through stage 1 together.
    fn submit_last(&mut self) -> Result<(), StreamError> {
        match &mut self.session {
            Some(session) if self.feed.waiting() == 0 => Ok(session.renderer.submit_frames()?),
            _ => Ok(()),
        }
    }

    fn take(&mut self, event: Event, at: Instant) -> Result<Step, StreamError> {
        match event {
            Event::Begin(header) => {
                let is_new = self.session.is_none() || Some(&*header) != self.header.as_ref();
                self.next_header = is_new.then_some(*header);
            }
            Event::Frame(frame) if self.keeps() => return Ok(self.keep(frame)),
            Event::Frame(_) if self.passes_over() => self.statistics.frozen += 1,
            Event::Frame(mut frame) => {
                frame.volume = frame.volume.saturating_add(self.volume_base);
                let result = self.upload(&frame, at);
                self.look_at(&frame);
                if matches!(result, Ok(Step::Progress)) {
                    self.cine.frame(frame);
                }
                return result;
            }
            Event::Fault(fault) => {
                self.statistics.faults.reported += 1;
                return Ok(Step::Fault(fault));
            }
            Event::End(why) => {
                self.statistics.faults.ended += u64::from(why.is_some());
                self.session.iter_mut().for_each(|session| session.pool.end());
                self.end = Some(why);
            }
            // The feed assembles lines.
            Event::Lines { .. } | Event::Idle => {}
        }
        Ok(Step::Progress)
    }

    /// True while frames are not taken: the picture is frozen, and with it the geometry. Outside of that a new geometry begins before its frames
    /// are taken.
    fn passes_over(&self) -> bool {
        self.is_frozen || self.next_header.is_some()
    }

    /// True while frames come into the loop only: those of a recording while the picture is frozen.
    fn keeps(&self) -> bool {
        self.is_frozen && self.next_header.is_none() && self.feed.is_recording()
    }

    /// True while frames wait until the picture is no longer frozen, because there is no room in the loop.
    fn is_held(&self) -> bool {
        self.keeps() && self.session.is_some() && self.cine.is_full()
    }

    /// Keeps a frame in the loop.
    fn keep(&mut self, mut frame: Frame) -> Step {
        self.statistics.frames += 1;
        frame.volume = frame.volume.saturating_add(self.volume_base);
        let Some(session) = &mut self.session else { return Step::Progress };
        if let Err(refused) = session.renderer.check_frame(frame.slice, &frame.bytes) {
            self.statistics.refused += 1;
            return Step::Fault(refused.to_string());
        }
        let volume = frame.volume;
        self.newest = self.newest.max(Some(volume));
        if self.cine.frame(frame) {
            session.pool.pass_over(volume);
        }
        Step::Progress
    }

    /// Uploads a frame.
    fn upload(&mut self, frame: &Frame, at: Instant) -> Result<Step, StreamError> {
        self.statistics.frames += 1;
        let feed = &self.feed;
        let Some(session) = &mut self.session else {
            return Ok(Step::Fault("a frame has a geometry that was not announced or cannot be drawn".into()));
        };
        // Before the frame's volume number has any effect.
        if let Err(refused) = session.renderer.check_frame(frame.slice, &frame.bytes) {
            self.statistics.refused += 1;
            return Ok(Step::Fault(refused.to_string()));
        }
        let image = session.pool.place(frame.volume, || feed.is_behind(frame.volume - self.volume_base));
        if let Some(image) = image {
            session.renderer.frame(frame.slice as u32, &frame.bytes, image)?;
            session.frame_arrived(image, frame.volume, at);
            self.newest = self.newest.max(Some(frame.volume));
            session.pool.arrived(frame.slice, frame.backward);
        }
        Ok(Step::Progress)
    }

    /// Looks for the levels of the first whole volume, and draws by them from then on.
    fn look_at(&mut self, frame: &Frame) {
        let Some(found) = self.first_volume.as_mut().and_then(|search| search.frame(frame)) else { return };
        // A user may have changed settings meanwhile. The caller knows, and lays its own over these.
        match found.settings().map(|settings| self.asked.with_look(settings)) {
            Ok(asked) => {
                if let Err(fault) = self.change_to(asked) {
                    tracing::debug!("windows of the first volume: {fault}");
                }
                self.found = Some(found);
            }
            Err(fault) => tracing::debug!("windows of the first volume: {fault}"),
        }
    }

    /// What default settings are derived from, if it was found since the last call. Pictures already use the derived settings; the caller may
    /// derive its own from it.
    pub fn take_found(&mut self) -> Option<Defaults> {
        self.found.take()
    }

    /// Creates the session of a geometry. If the geometry is the previous one, the cine loop is kept and the volume on display is
    /// sent again.
    fn begin_geometry(&mut self, header: Header) -> Result<(), StreamError> {
        let is_same = self.header.as_ref() == Some(&header);
        let session = self.session.take();
        let shown = session.as_ref().and_then(|session| session.replayed_volume().or(session.current_volume()));
        let to_restore = shown.or_else(|| self.cine.volumes().back().map(|kept| kept.volume)).filter(|_| is_same);
        self.header = Some(header.clone());
        self.frames_before = self.statistics.frames;
        let found = self.first_volume.as_mut().and_then(|search| search.begin(&header));
        if let Some(settings) = found.as_ref().and_then(|found| found.settings().ok()) {
            self.asked = self.asked.with_look(settings);
            self.found = found;
        }
        // Freed before the new one is created: both may not fit into device memory. The compiled pipelines are kept for the new one.
        let _pipelines = session.map(|Session { pool, renderer, .. }| {
            self.previous_pool = Some(pool);
            renderer.into_pipelines()
        });
        let views = views(&header, &self.asked, &self.options)?;
        if let Some(cut) = views.first().probe().and_then(Probe::folded) {
            tracing::warn!("{cut}");
        }
        let slices = views.first().slices() as usize;
        if !is_same || !self.cine.is_of(slices) {
            self.cine = Cine::new(self.options.cine, slices);
        }
        self.cine.discard_partial();
        let mut pool = VolumePool::new(self.options.update, self.options.images, slices);
        let options = self.renderer_options(pool.images());
        let renderer = Renderer::new(&self.context, views.first().clone(), &options)?;
        if let Some(previous) = self.previous_pool.take() {
            pool.continue_from(previous);
        }
        self.session = Some(Session::new(views, renderer, pool, self.options.wake.is_some(), to_restore));
        Ok(())
    }

    /// Continues on another device, or on the same one after it was lost. The volume on display is sent again from the cine loop.
    ///
    /// # Errors
    /// The device fails or lacks memory for the geometry, or the geometry cannot be drawn with the settings.
    pub fn revive(&mut self, context: &Arc<Context>) -> Result<(), StreamError> {
        self.context = context.clone();
        self.losses += 1;
        // Its pipelines are of the device before. The next step compiles them for this one.
        let was_preparing = self.first_pipelines.cancel();
        match self.header.clone() {
            Some(header) if !was_preparing => self.begin_geometry(header),
            _ => Ok(()),
        }
    }

    /// Changes the settings. The volume on display is drawn again. If stage 1 (the filters of frames) must run again, the volume is sent again from
    /// the cine loop.
    ///
    /// # Errors
    /// The geometry cannot be drawn with the settings; the previous ones remain. If only the device refuses them, a later [`Step::Fault`]
    /// reports it.
    pub fn change(&mut self, settings: Settings) -> Result<(), StreamError> {
        self.change_to(Asked { full: settings, lowered: None, is_coarse: self.asked.is_coarse })
    }

    /// Changes the settings as [`Stream::change`] does, to ones of lower quality that temporarily replace `full`, those at full quality.
    ///
    /// # Errors
    /// The geometry cannot be drawn with the settings; the previous ones remain.
    pub fn lower(&mut self, settings: Settings, full: Settings) -> Result<(), StreamError> {
        self.change_to(Asked { full, lowered: Some(settings), is_coarse: self.asked.is_coarse })
    }

    fn change_to(&mut self, asked: Asked) -> Result<(), StreamError> {
        if let (Some(session), Some(header)) = (&mut self.session, &self.header) {
            session.pending = Pending::ready(views(header, &asked, &self.options)?);
        }
        self.asked = asked;
        Ok(())
    }

    /// Freezes the display, or continues. Frames that arrive while it is frozen are not shown, but still recorded if the feed records. Frames of a
    /// recording go into the cine loop while that has room, and then wait.
    pub fn freeze(&mut self, is_frozen: bool) {
        if self.is_frozen == is_frozen {
            return;
        }
        self.is_frozen = is_frozen;
        // The volume that is being filled stays incomplete: its remaining frames are not shown, or its first ones were not.
        if !self.feed.is_recording() {
            self.cine.discard_partial();
        }
        if let Some(session) = &mut self.session {
            session.pool.end();
        }
    }

    pub fn is_frozen(&self) -> bool {
        self.is_frozen
    }

    /// The cine loop: the most recent complete volumes.
    pub fn cine(&self) -> &Cine {
        &self.cine
    }

    /// Position in the cine loop of the volume on display, or, while frozen, of the one that will be displayed next; 0 is the oldest. None
    /// if it is not in the loop.
    pub fn cine_position(&self) -> Option<usize> {
        let session = self.session.as_ref()?;
        // What was sent again waits for the picture that is being drawn.
        let waiting = session.pool.waiting().filter(|_| self.is_frozen);
        let volume = session.replayed_volume().or(waiting).or(session.display.volume())?;
        self.cine.volumes().iter().position(|kept| kept.volume == volume)
    }

    /// Shows the volume at this position of the cine loop, 0 for the oldest. A position beyond the last is ignored.
    pub fn show_cine_volume(&mut self, position: usize) {
        if let (Some(volume), Some(session)) = (self.cine.volumes().get(position), &mut self.session) {
            session.start_replay(volume.clone());
        }
    }

    /// Continues with another source. The numbers of its volumes continue those of the previous source. The display stays until the new
    /// source has a volume to show.
    pub fn replace_source(&mut self, feed: Feed) {
        self.earlier_feeds = self.feed_counts();
        (self.feed, self.end) = (feed, None);
        // A geometry of the source before that did not begin yet is not shown any more.
        self.next_header = None;
        self.first_pipelines.cancel();
        self.cine.discard_partial();
        // Two volumes with one number could not be distinguished in the cine loop.
        if let Some(newest) = self.newest.take() {
            self.volume_base = newest.checked_add(1).unwrap_or_else(|| {
                self.cine.clear();
                0
            });
        }
        if let Some(session) = &mut self.session {
            session.pool.restart_numbering();
        }
    }

    /// Compiles the pipelines of these settings in the background, in this order, while no other pipeline is needed. Each entry has settings,
    /// and the settings at full quality that they replace, if any. A new call replaces the entries of an earlier one; settings that cannot be
    /// drawn are left out. Nothing happens before the first geometry has begun, and without [`StreamOptions::wake`].
    pub fn warm(&mut self, next: Vec<(Settings, Option<Settings>)>) {
        let (Some(session), Some(header)) = (&mut self.session, &self.header) else { return };
        let (header, options) = (Arc::new(header.clone()), self.options.clone());
        let scenes = next.into_iter().map(|(settings, full)| {
            let (header, options, backward) = (header.clone(), options.clone(), session.backward.clone());
            let make = move || {
                let asked = match full {
                    Some(full) => Asked { full, lowered: Some(settings), is_coarse: false },
                    None => Asked { full: settings, lowered: None, is_coarse: false },
                };
                let views = views(&header, &asked, &options).ok()?;
                Some(views.of(&backward).into_owned())
            };
            Box::new(make) as SceneMaker
        });
        let scenes = scenes.collect();
        session.warm(scenes);
    }

    /// Removes the settings of [`Stream::warm`] whose pipelines are not compiled yet.
    pub fn stop_warming(&self) {
        self.session.iter().for_each(|session| session.renderer.stop_warming());
    }

    /// True if [`Stream::warm`] was called for the present geometry and device.
    pub fn has_warmed(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.has_warmed)
    }

    /// True while pipelines of [`Stream::warm`] are left to compile.
    pub fn is_warming(&self) -> bool {
        self.session.as_ref().is_some_and(|session| session.renderer.is_warming())
    }
}

/// The scenes of the settings that were asked for.
fn views(header: &Header, asked: &Asked, options: &StreamOptions) -> Result<Views, SceneError> {
    let views = Views::new(header, &asked.drawn(), options.update)?;
    match &options.lowered {
        Some(lowered) => views.sharing(header, &asked.full, &**lowered),
        None => Ok(views),
    }
}
