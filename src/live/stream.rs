//! The loop between a feed and a renderer, one step at a time.

use super::feed::{Arrived, Feed};
use super::now::Now;
use super::statistics::Statistics;
use super::turns::{Counts, Turns, Update};
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
    /// The geometry of now, also where nothing could be made for it.
    header: Option<Header>,
    /// A geometry that begins when what is on its way has been shown.
    next: Option<Header>,
    /// Of a geometry that nothing could be made after.
    before: Option<Turns>,
    end: Option<Option<String>>,
    began: Instant,
    statistics: Statistics,
    taken: Statistics,
}

impl Stream {
    pub fn new(context: &Arc<Context>, feed: Feed, settings: Settings, options: Options) -> Stream {
        Stream {
            context: context.clone(),
            feed,
            settings,
            options,
            now: None,
            header: None,
            next: None,
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
        let mut patience = patience;
        // What is on its way is shown first, and nothing more is taken.
        let over = self.end.is_some() || self.next.is_some();
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
                    return Ok(Step::Went);
                }
            } else if now.behind > 0 && !over {
                now.behind -= 1;
                if let Some(Arrived { event, at }) = self.feed.next(Duration::ZERO) {
                    return self.take(event, at);
                }
                now.behind = 0;
                return Ok(Step::Went);
            } else if now.begin()? {
                return Ok(Step::Went);
            }
        }
        if let Some(header) = self.next.take() {
            return self.make(header).map(|()| Step::Went);
        }
        if let Some(end) = &self.end {
            return Ok(Step::End(end.clone()));
        }
        match self.feed.next(patience) {
            Some(Arrived { event, at }) => self.take(event, at),
            None => Ok(Step::Went),
        }
    }

    fn take(&mut self, event: Event, at: Instant) -> Result<Step, StreamError> {
        match event {
            Event::Begin(header) => {
                self.next = Some(*header).filter(|h| self.now.is_none() || Some(h) != self.header.as_ref())
            }
            Event::Frame(frame) => return self.lines(&frame, None, at),
            Event::Lines { frame, first } => return self.lines(&frame, Some(first), at),
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
        match self.header.clone() {
            Some(header) => self.make(header),
            None => Ok(()),
        }
    }

    /// Makes everything for a geometry.
    fn make(&mut self, header: Header) -> Result<(), StreamError> {
        self.header = Some(header.clone());
        // Gone before the new one comes: both may not fit the device.
        if let Some(Now { turns, .. }) = self.now.take() {
            self.before = Some(turns);
        }
        let views = Views::new(&header, &self.settings, self.options.update)?;
        let slices = views.first().slices() as usize;
        let mut turns = Turns::new(self.options.update, self.options.images, slices);
        let options =
            gpu::Options { volume_images: turns.images(), queues: self.options.queues, ..gpu::Options::default() };
        let renderer = Renderer::new(&self.context, views.first().clone(), &options)?;
        if let Some(before) = self.before.take() {
            turns.go_on_from(before);
        }
        self.now = Some(Now {
            arrived: vec![(0, Vec::new()); turns.images() as usize],
            backward: vec![false; slices],
            views,
            renderer,
            turns,
            drawing: None,
            changed: false,
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
            None => match now.turns.place(frame.volume, || feed.is_behind(frame.volume)) {
                Some(image) => {
                    now.renderer.lines(slice, first, &frame.bytes, image).map(|whole| whole.then_some(image))
                }
                None => Ok(None),
            },
        };
        match went {
            Ok(Some(image)) => {
                now.came(image, frame.volume, at);
                now.turns.arrived(frame.slice, frame.backward);
                Ok(Step::Went)
            }
            Ok(None) => Ok(Step::Went),
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
            now.views = Views::new(header, &settings, self.options.update)?;
            now.changed = true;
        }
        self.settings = settings;
        Ok(())
    }

    /// Of the whole stream; latencies and passes since they were taken last.
    pub fn statistics(&mut self) -> Result<Statistics, StreamError> {
        self.statistics.time = self.began.elapsed();
        self.statistics.lost = self.feed.lost();
        self.statistics.passes = self.now.as_mut().map_or(Vec::new(), |now| now.renderer.times_so_far());
        self.statistics.volumes = self.turns().map_or(Counts::default(), Turns::counts);
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
        self.turns().map_or(0, |turns| turns.counts().shown)
    }

    fn turns(&self) -> Option<&Turns> {
        self.now.as_ref().map(|now| &now.turns).or(self.before.as_ref())
    }

    /// What could not be recorded, frames as a rule.
    pub fn unrecorded(&self) -> u64 {
        self.feed.unrecorded()
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
