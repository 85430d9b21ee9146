//! The loop between a feed and a renderer, one step at a time.

use super::feed::{Arrived, Feed};
use super::statistics::Statistics;
use super::turns::{Turns, Update};
use super::views::Views;
use crate::gpu::{self, Context, GpuError, Renderer};
use crate::picture::Picture;
use crate::scene::{Scene, SceneError, Settings};
use crate::source::Frame;
use crate::source::live::Event;
use crate::source::recorder::Header;
use std::sync::Arc;
use std::time::{Duration, Instant};

#[derive(Clone, Debug)]
pub struct Options {
    pub update: Update,
    /// Volume images that take turns where volumes are whole: 2, or 3 so that a volume need not wait for a picture.
    pub images: u32,
    /// Queues that share the work; as many as the device has unless given.
    pub queues: Option<usize>,
}

impl Default for Options {
    fn default() -> Options {
        Options { update: Update::Whole, images: 3, queues: None }
    }
}

/// What became of a step.
#[derive(Debug)]
pub enum Step {
    /// A picture is done.
    Picture(Shown),
    /// Something was left out, and why; the stream goes on.
    Fault(String),
    /// Something else was done, or nothing.
    Went,
    /// No more frames will come, and why if that was not to be expected; all that came is in the last picture.
    End(Option<String>),
}

/// A picture, and what it is of.
#[derive(Debug)]
pub struct Shown {
    /// The volume that is shown; rolling: the newest that has a slice in it.
    pub volume: u32,
    pub picture: Picture,
    /// From the arrival of the last frame that is new in it to now.
    pub latency: Duration,
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
    context: Arc<Context>,
    feed: Feed,
    settings: Settings,
    options: Options,
    now: Option<Now>,
    end: Option<Option<String>>,
    began: Instant,
    statistics: Statistics,
    taken: Statistics,
}

/// What follows from a geometry.
struct Now {
    header: Header,
    views: Views,
    renderer: Renderer,
    turns: Turns,
    /// By volume image: when the frames arrived that no picture has shown yet.
    arrived: Vec<Vec<Instant>>,
    /// The frames that the picture on its way shows for the first time, and its volume.
    drawing: Option<(u32, Vec<Instant>)>,
    /// What is shown stands in another scene than it was drawn in.
    changed: bool,
    /// By slice, the way of what is shown.
    backward: Vec<bool>,
    /// The last volume that was shown.
    volume: Option<u32>,
    /// Frames that waited when the last picture was done, and that the next one shows: beginning it after the first of them would
    /// fall ever further behind.
    behind: usize,
}

impl Stream {
    pub fn new(context: &Arc<Context>, feed: Feed, settings: Settings, options: Options) -> Stream {
        Stream {
            context: context.clone(),
            feed,
            settings,
            options,
            now: None,
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
        let mut patience = patience;
        if let Some(now) = &mut self.now {
            if now.drawing.is_some() {
                if !now.renderer.is_drawing()? {
                    now.behind = if now.turns.is_rolling() { self.feed.waiting() } else { 0 };
                    return Ok(Step::Picture(now.finish(&mut self.statistics)?));
                }
                patience = patience.min(Duration::from_micros(200));
                if self.feed.can_wait() && now.turns.is_waiting() {
                    // Another volume would take its place.
                    std::thread::sleep(patience);
                    return Ok(Step::Went);
                }
            } else if now.behind > 0 {
                now.behind -= 1;
                if let Some(Arrived { event, at }) = self.feed.next(Duration::ZERO) {
                    return self.take(event, at);
                }
                now.behind = 0;
                return Ok(Step::Went);
            } else if now.begin()? {
                return Ok(Step::Went);
            }
            if self.end.is_some() {
                if now.drawing.is_some() {
                    return Ok(Step::Picture(now.finish(&mut self.statistics)?));
                }
                return Ok(Step::End(self.end.clone().flatten()));
            }
        } else if let Some(end) = &self.end {
            return Ok(Step::End(end.clone()));
        }
        match self.feed.next(patience) {
            Some(Arrived { event, at }) => self.take(event, at),
            None => Ok(Step::Went),
        }
    }

    fn take(&mut self, event: Event, at: Instant) -> Result<Step, StreamError> {
        match event {
            Event::Begin(header) => self.begin(*header)?,
            Event::Frame(frame) => return self.lines(&frame, 0, at),
            Event::Lines { frame, first } => return self.lines(&frame, first, at),
            Event::Fault(fault) => return Ok(Step::Fault(fault)),
            Event::End(why) => {
                self.now.iter_mut().for_each(|now| now.turns.end());
                self.end = Some(why);
            }
            Event::Idle => {}
        }
        Ok(Step::Went)
    }

    /// Goes on with another device, or the same one anew after it was lost: with the volume that begins next.
    ///
    /// # Errors
    /// A device that cannot hold what the geometry needs.
    pub fn revive(&mut self, context: &Arc<Context>) -> Result<(), StreamError> {
        self.context = context.clone();
        match self.now.as_ref().map(|now| now.header.clone()) {
            Some(header) => self.make(header),
            None => Ok(()),
        }
    }

    /// Another geometry, or the first.
    fn begin(&mut self, header: Header) -> Result<(), StreamError> {
        match self.now.as_ref().is_some_and(|now| now.header == header) {
            true => Ok(()),
            false => self.make(header),
        }
    }

    /// Makes everything for a geometry.
    fn make(&mut self, header: Header) -> Result<(), StreamError> {
        let views = Views::new(&header, &self.settings, self.options.update)?;
        // Before the new one: both may not fit the device.
        let before = self.now.take().map(|now| now.turns);
        let slices = views.first().slices() as usize;
        let mut turns = Turns::new(self.options.update, self.options.images, slices);
        if let Some(before) = before {
            turns.go_on_from(before);
        }
        let options =
            gpu::Options { volume_images: turns.images(), queues: self.options.queues, ..gpu::Options::default() };
        let renderer = Renderer::new(&self.context, views.first().clone(), &options)?;
        self.now = Some(Now {
            arrived: vec![Vec::new(); turns.images() as usize],
            backward: vec![false; slices],
            header,
            views,
            renderer,
            turns,
            drawing: None,
            changed: false,
            volume: None,
            behind: 0,
        });
        Ok(())
    }

    fn lines(&mut self, frame: &Frame, first: usize, at: Instant) -> Result<Step, StreamError> {
        self.statistics.frames += u64::from(first == 0);
        let feed = &self.feed;
        let Some(now) = &mut self.now else {
            return Ok(Step::Fault("a frame came before anything was said about its geometry".into()));
        };
        let slice = frame.slice as u32;
        if frame.slice >= now.renderer.scene().slices() as usize {
            self.statistics.refused += 1;
            let error = GpuError::FrameSlice { slice, slices: now.renderer.scene().slices() };
            return Ok(Step::Fault(error.to_string()));
        }
        let Some(image) = now.turns.place(frame.volume, || feed.is_behind(frame.volume)) else { return Ok(Step::Went) };
        match now.renderer.lines(slice, first as u32, &frame.bytes, image) {
            Ok(false) => {}
            Ok(true) => {
                now.arrived[image as usize].push(at);
                now.turns.arrived(frame.slice, frame.backward);
            }
            Err(error @ (GpuError::FrameSize { .. } | GpuError::FrameLines { .. })) => {
                self.statistics.refused += 1;
                return Ok(Step::Fault(error.to_string()));
            }
            Err(error) => return Err(error.into()),
        }
        Ok(Step::Went)
    }

    /// Other settings: what is shown is drawn anew, and of what has to go through stage 1 again the frames that come from here on.
    ///
    /// # Errors
    /// Settings that cannot be drawn: those before stay.
    pub fn change(&mut self, settings: Settings) -> Result<(), StreamError> {
        if let Some(now) = &mut self.now {
            now.views = Views::new(&now.header, &settings, self.options.update)?;
            now.changed = true;
        }
        self.settings = settings;
        Ok(())
    }

    /// Of the whole stream; latencies and passes since they were taken last.
    pub fn statistics(&mut self) -> Result<Statistics, StreamError> {
        self.statistics.time = self.began.elapsed();
        self.statistics.lost = self.feed.lost();
        if let Some(now) = &mut self.now {
            self.statistics.volumes = now.turns.counts();
            self.statistics.passes = now.renderer.times_so_far();
        }
        Ok(self.statistics.clone())
    }

    /// What happened since this was asked last.
    pub fn take_statistics(&mut self) -> Result<Statistics, StreamError> {
        let now = self.statistics()?;
        let since = now.since(&self.taken);
        self.statistics.latency.reset();
        self.taken = now;
        Ok(since)
    }

    /// Volumes that were shown so far.
    pub fn volumes_shown(&self) -> u64 {
        self.now.as_ref().map_or(0, |now| now.turns.counts().shown)
    }

    /// The time that sound needs for a volume, s; none before the first frame and of what is not swept.
    pub fn acquisition_time(&self) -> Option<f64> {
        self.now.as_ref()?.views.first().probe().map(|p| p.acquisition_time())
    }

    pub fn scene(&self) -> Option<&Scene> {
        self.now.as_ref().map(|now| now.renderer.scene())
    }

    /// For looking at what is there.
    pub fn renderer(&mut self) -> Option<&mut Renderer> {
        self.now.as_mut().map(|now| &mut now.renderer)
    }
}

impl Now {
    /// Begins a picture if there is anything new to show.
    fn begin(&mut self) -> Result<bool, GpuError> {
        let ready = self.turns.take();
        if ready.is_none() && !(self.changed && self.volume.is_some()) {
            return Ok(false);
        }
        if let Some(ready) = ready {
            self.renderer.show(ready.image)?;
            self.backward = ready.backward;
            self.volume = Some(ready.volume);
            self.drawing = Some((ready.volume, std::mem::take(&mut self.arrived[ready.image as usize])));
        } else {
            self.drawing = self.volume.map(|volume| (volume, Vec::new()));
        }
        self.changed = false;
        let scene = self.views.of(&self.backward);
        if self.renderer.is_other(&scene) {
            self.renderer.change(scene.into_owned())?;
        }
        self.renderer.begin_picture()?;
        Ok(true)
    }

    fn finish(&mut self, statistics: &mut Statistics) -> Result<Shown, GpuError> {
        let picture = self.renderer.end_picture()?;
        let (volume, arrived) = self.drawing.take().unwrap_or_default();
        let now = Instant::now();
        arrived.iter().for_each(|at| statistics.seen_after(now.saturating_duration_since(*at)));
        statistics.pictures += 1;
        let latency = arrived.iter().max().map_or(Duration::ZERO, |at| now.saturating_duration_since(*at));
        Ok(Shown { volume, picture, latency })
    }
}
