//! The loop between a feed and a renderer, one step at a time.

use super::cine::{Cine, CineLimits};
use super::feed::{Arrived, Feed};
use super::replay::Replay;
use super::session::Session;
use super::statistics::Statistics;
use super::views::Views;
use super::volume_pool::{Update, VolumePool};
use crate::gpu::pipelines::embedded;
use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::{self, Context, GpuError, Renderer, Wake};
use crate::picture::Picture;
use crate::scene::{SceneError, Settings};
use crate::source::Frame;
use crate::source::live::Event;
use crate::source::recorder::Header;
use std::sync::Arc;
use std::time::{Duration, Instant};

#[derive(Clone)]
pub struct StreamOptions {
    pub update: Update,
    /// Volume images that take turns where volumes are whole: 2, or 3 so that a volume need not wait for a picture.
    pub images: u32,
    /// Queues that share the work; as many as the device has unless given.
    pub queues: Option<usize>,
    /// Bring every picture back; otherwise it stays on the device, where it is shown.
    pub readback: bool,
    /// How much of what came last is kept for looking back.
    pub cine: CineLimits,
    /// Called when there is something to look at: a source said something, something was made beside the drawing.
    pub wake: Option<Wake>,
    /// Shaders to use instead of the embedded ones; what changes there is drawn with from then on.
    pub shaders: Option<Arc<ShaderFolder>>,
}

impl Default for StreamOptions {
    fn default() -> StreamOptions {
        StreamOptions {
            update: Update::Whole,
            images: 3,
            queues: None,
            readback: true,
            cine: CineLimits::default(),
            wake: None,
            shaders: None,
        }
    }
}

/// What became of a step.
#[derive(Debug)]
pub enum Step {
    /// A picture is done.
    Picture(FinishedPicture),
    /// Something was left out, and why; the stream goes on.
    Fault(String),
    /// Something else was done, or nothing.
    Progress,
    /// No more frames will come, and why if that was not to be expected; all that came is in the last picture.
    End(Option<String>),
}

/// A picture, and what it is of.
#[derive(Debug)]
pub struct FinishedPicture {
    /// The volume that is shown; rolling: the newest that has a slice in it.
    pub volume: u32,
    /// None where pictures stay on the device.
    pub picture: Option<Picture>,
    /// From the arrival of the last frame that is new in it to now.
    pub latency: Duration,
    /// From the beginning of its drawing to now.
    pub took: Duration,
}

#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    #[error(transparent)]
    Gpu(#[from] GpuError),
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// A source that is being rendered.
pub struct Stream {
    pub(super) context: Arc<Context>,
    pub(super) feed: Feed,
    settings: Settings,
    options: StreamOptions,
    pub(super) now: Option<Session>,
    pub(super) cine: Cine,
    /// A volume of the cine loop that is being sent once more.
    pub(super) replay: Option<Replay>,
    /// What comes is not shown.
    pub(super) frozen: bool,
    /// The geometry of now, also where nothing could be made for it.
    pub(super) header: Option<Header>,
    /// A geometry that begins when what is on its way has been shown.
    next: Option<Header>,
    /// What the volumes of this source are numbered from, and the newest number: volumes of several sources lie in one cine loop.
    pub(super) first: u32,
    pub(super) newest: Option<u32>,
    /// Of a geometry that nothing could be made after.
    pub(super) before: Option<VolumePool>,
    pub(super) end: Option<Option<String>>,
    pub(super) began: Instant,
    pub(super) statistics: Statistics,
    pub(super) taken: Statistics,
}

impl Stream {
    pub fn new(context: &Arc<Context>, feed: Feed, settings: Settings, options: StreamOptions) -> Stream {
        Stream {
            context: context.clone(),
            feed,
            settings,
            options,
            now: None,
            cine: Cine::new(CineLimits::default(), 0),
            replay: None,
            frozen: false,
            header: None,
            next: None,
            first: 0,
            newest: None,
            before: None,
            end: None,
            began: Instant::now(),
            statistics: Statistics::default(),
            taken: Statistics::default(),
        }
    }

    /// What comes next: a picture that is done, a new one to begin, or an event of the source, waiting for that at most so long.
    ///
    /// # Errors
    /// A device that fails, and settings that cannot be drawn of a geometry that has begun.
    pub fn step(&mut self, patience: Duration) -> Result<Step, StreamError> {
        let went = self.go(patience);
        // What cannot draw any more is made anew with the next geometry that is told.
        if went.is_err()
            && let Some(Session { turns, .. }) = self.now.take_if(|now| now.renderer.is_broken())
        {
            (self.before, self.replay) = (Some(turns), None);
        }
        went
    }

    fn go(&mut self, mut patience: Duration) -> Result<Step, StreamError> {
        // What is on its way is shown first, and nothing more is taken.
        let over = self.end.is_some() || (self.next.is_some() && !self.frozen);
        if let Some(now) = &mut self.now {
            if now.drawing.is_some() {
                if over || !now.renderer.is_drawing()? {
                    now.behind = if now.turns.is_rolling() && !over { self.feed.waiting() } else { 0 };
                    return Ok(Step::Picture(now.finish(&mut self.statistics)?));
                }
                patience = patience.min(Duration::from_micros(200));
                if self.feed.can_wait() && now.turns.is_waiting() {
                    // Another volume would take its place.
                    std::thread::sleep(patience);
                    return Ok(Step::Progress);
                }
            } else if now.behind > 0 && !over {
                now.behind -= 1;
                if let Some(Arrived { event, at }) = self.feed.next(Duration::ZERO) {
                    return self.take(event, at);
                }
                now.behind = 0;
                return Ok(Step::Progress);
            } else {
                if let Some(folder) = &self.options.shaders
                    && let Some(changed) = folder.take_changed()
                {
                    match now.renew_shaders(&changed) {
                        Ok(()) => folder.accept(),
                        Err(error) if error.is_device_lost() => return Err(error.into()),
                        // What was drawn before stays.
                        Err(error) => folder.refuse(changed, error.to_string()),
                    }
                }
                let begun = now.begin()?;
                // What was sent of a volume went through stage 1 as it was before.
                if std::mem::take(&mut now.anew)
                    && let Some(replay) = self.replay.take()
                {
                    now.lost = Some(replay.kept.volume);
                }
                if begun {
                    return Ok(Step::Progress);
                } else if let Some(fault) = now.fault.take() {
                    // What could not be drawn is not to be made of another geometry or device either.
                    if now.next.is_none() {
                        self.settings = now.views.first().settings.clone();
                    }
                    return Ok(Step::Fault(fault));
                } else if let Some(volume) = now.lost.take() {
                    self.show_again(volume);
                }
            }
        }
        if self.replay.is_some() {
            return self.send_again().map(|()| Step::Progress);
        }
        // A geometry that begins would take what is frozen away.
        let shows = self.frozen && self.now.is_some();
        if let Some(header) = self.next.take_if(|_| !shows) {
            return self.make(header).map(|()| Step::Progress);
        }
        if let Some(end) = &self.end {
            return Ok(Step::End(end.clone()));
        }
        match self.feed.next(patience) {
            Some(Arrived { event, at }) => self.take(event, at),
            None => Ok(Step::Progress),
        }
    }

    fn take(&mut self, event: Event, at: Instant) -> Result<Step, StreamError> {
        match event {
            Event::Begin(header) => {
                self.next = Some(*header).filter(|h| self.now.is_none() || Some(h) != self.header.as_ref())
            }
            Event::Frame(_) | Event::Lines { .. } if self.frozen || self.next.is_some() => {}
            Event::Frame(mut frame) => {
                frame.volume = frame.volume.saturating_add(self.first);
                let went = self.lines(&frame, None, at);
                if matches!(went, Ok(Step::Progress)) {
                    self.cine.frame(frame);
                }
                return went;
            }
            Event::Lines { mut frame, first } => {
                frame.volume = frame.volume.saturating_add(self.first);
                let went = self.lines(&frame, Some(first), at);
                if let (Ok(Step::Progress), Some(now)) = (&went, &self.now) {
                    let (whole, lines) = (now.renderer.frame_bytes(), now.renderer.scene().frame_size()[1] as usize);
                    self.cine.lines(frame, first * (whole / lines), whole);
                }
                return went;
            }
            Event::Fault(fault) => return Ok(Step::Fault(fault)),
            Event::End(why) => {
                self.now.iter_mut().for_each(|now| now.turns.end());
                self.end = Some(why);
            }
            Event::Idle => {}
        }
        Ok(Step::Progress)
    }

    /// Goes on with another device, or the same one anew after it was lost: with the volume that begins next.
    ///
    /// # Errors
    /// A device that cannot hold what the geometry needs.
    pub fn revive(&mut self, context: &Arc<Context>) -> Result<(), StreamError> {
        self.context = context.clone();
        match self.header.clone() {
            Some(header) => self.make(header),
            None => Ok(()),
        }
    }

    /// Makes everything for a geometry. Where it is the one of before, what was kept stays, and what was shown comes again.
    fn make(&mut self, header: Header) -> Result<(), StreamError> {
        let is_same = self.header.as_ref() == Some(&header);
        let (asked, now) = (self.replay.take().map(|replay| replay.kept.volume), self.now.as_ref());
        let shown = asked.or_else(|| now.and_then(Session::seen));
        let shown = shown.or_else(|| self.cine.volumes().back().map(|kept| kept.volume)).filter(|_| is_same);
        self.header = Some(header.clone());
        // Gone before the new one comes: both may not fit the device.
        if let Some(Session { turns, .. }) = self.now.take() {
            self.before = Some(turns);
        }
        let views = Views::new(&header, &self.settings, self.options.update)?;
        let slices = views.first().slices() as usize;
        if !is_same || !self.cine.is_of(slices) {
            self.cine = Cine::new(self.options.cine, slices);
        }
        self.cine.cut();
        let mut turns = VolumePool::new(self.options.update, self.options.images, slices);
        let options = gpu::Options {
            volume_images: turns.images(),
            queues: self.options.queues,
            readback: self.options.readback,
            wake: self.options.wake.clone(),
            shaders: self.options.shaders.as_ref().map_or_else(embedded, ShaderFolder::shaders_or_embedded),
            ..gpu::Options::default()
        };
        let renderer = Renderer::new(&self.context, views.first().clone(), &options)?;
        if let Some(before) = self.before.take() {
            turns.go_on_from(before);
        }
        self.now = Some(Session {
            arrived: vec![(0, Vec::new()); turns.images() as usize],
            backward: vec![false; slices],
            views,
            renderer,
            turns,
            drawing: None,
            begun: Instant::now(),
            next: None,
            waits: false,
            fault: None,
            prepares: self.options.wake.is_some(),
            lost: shown,
            anew: false,
            redraw: false,
            volume: None,
            behind: 0,
        });
        Ok(())
    }

    /// A whole frame, or lines of one from `first` on.
    fn lines(&mut self, frame: &Frame, first: Option<usize>, at: Instant) -> Result<Step, StreamError> {
        self.statistics.frames += u64::from(first.unwrap_or(0) == 0);
        let feed = &self.feed;
        let Some(now) = &mut self.now else {
            return Ok(Step::Fault("a frame came of a geometry that was not told or cannot be drawn".into()));
        };
        let (slice, slices) = (frame.slice as u32, now.renderer.scene().slices());
        let (got, expected) = (frame.bytes.len(), now.renderer.frame_bytes());
        // Before its volume's number is believed.
        let wrong = match first {
            _ if frame.slice >= slices as usize => Some(GpuError::FrameSlice { slice, slices }),
            None if got != expected => Some(GpuError::FrameSize { got, expected }),
            _ => None,
        };
        let first = first.unwrap_or(0) as u32;
        let went = match wrong {
            Some(wrong) => Err(wrong),
            None => match now.turns.place(frame.volume, || feed.is_behind(frame.volume - self.first)) {
                Some(image) => {
                    now.renderer.lines(slice, first, &frame.bytes, image).map(|whole| whole.then_some(image))
                }
                None => Ok(None),
            },
        };
        match went {
            Ok(Some(image)) => {
                now.came(image, frame.volume, at);
                self.newest = self.newest.max(Some(frame.volume));
                now.turns.arrived(frame.slice, frame.backward);
                Ok(Step::Progress)
            }
            Ok(None) => Ok(Step::Progress),
            Err(error @ (GpuError::FrameSize { .. } | GpuError::FrameLines { .. } | GpuError::FrameSlice { .. })) => {
                self.statistics.refused += 1;
                Ok(Step::Fault(error.to_string()))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Other settings: what is shown is drawn anew, and of what has to go through stage 1 again the frames that come from here on.
    ///
    /// # Errors
    /// Settings that cannot be drawn: those before stay.
    pub fn change(&mut self, settings: Settings) -> Result<(), StreamError> {
        if let (Some(now), Some(header)) = (&mut self.now, &self.header) {
            now.next = Some(Views::new(header, &settings, self.options.update)?);
        }
        self.settings = settings;
        Ok(())
    }
}
