//! Streams under control: freezing, the cine loop, other settings, sources and devices. Pictures show exactly the sent frames.

mod async_compilation;
mod cine;
mod sources;

use crate::common::gpu::*;
use crate::live::*;
use echolume::low_level::gpu::{Renderer, RendererOptions};
use echolume::low_level::live::Views;
use echolume::low_level::live::cine::CineLimits;
use echolume::low_level::live::{self, Feed, FinishedPicture, Step, Stream, Update};
use echolume::low_level::picture::Picture;
use echolume::low_level::source::Frame;
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::source::recorder::Header;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// A limit far above the duration of any step here.
pub const BOUND: Duration = Duration::from_secs(120);
pub const ROOM: CineLimits = CineLimits { volumes: 8, bytes: 1 << 24 };
const MARK: &str = "so far";

/// A source that yields the events that it is sent.
pub struct Fed {
    pub said: Receiver<Event>,
    pub is_recording: bool,
}

impl Live for Fed {
    fn next(&mut self, patience: Duration) -> Event {
        match self.said.recv_timeout(patience) {
            Ok(event) => event,
            Err(RecvTimeoutError::Timeout) => Event::Idle,
            Err(RecvTimeoutError::Disconnected) => Event::End(None),
        }
    }

    fn can_wait(&self) -> bool {
        true
    }

    fn is_recording(&self) -> bool {
        self.is_recording
    }
}

pub fn fed(record: Option<&Path>) -> (Sender<Event>, Feed) {
    let (say, said) = channel();
    (say, Feed::new(Box::new(Fed { said, is_recording: false }), record).expect("thread"))
}

/// A stream with its sender of events.
struct Bench {
    stream: Stream,
    say: Sender<Event>,
    faults: Vec<String>,
}

impl Bench {
    fn new(device: &Device, toml: &str, options: live::StreamOptions) -> Bench {
        Bench::recorded(device, toml, options, None)
    }

    fn recorded(device: &Device, toml: &str, options: live::StreamOptions, record: Option<&Path>) -> Bench {
        let (say, feed) = fed(record);
        Bench { stream: Stream::new(device, feed, settings(toml), options), say, faults: Vec::new() }
    }

    /// Of a recording that is read.
    fn reading(device: &Device, toml: &str, options: live::StreamOptions) -> Bench {
        let (say, said) = channel();
        let feed = Feed::new(Box::new(Fed { said, is_recording: true }), None).expect("thread");
        Bench { stream: Stream::new(device, feed, settings(toml), options), say, faults: Vec::new() }
    }

    fn begin(&self, header: Header) {
        self.say.send(Event::Begin(Box::new(header))).expect("listens");
    }

    fn frames(&self, frames: impl IntoIterator<Item = Frame>) {
        frames.into_iter().for_each(|frame| self.say.send(Event::Frame(frame)).expect("listens"));
    }

    /// Steps until all sent events are handled and the stream is idle. Returns the pictures.
    fn settle(&mut self) -> Vec<FinishedPicture> {
        self.say.send(Event::Fault(MARK.into())).expect("listens");
        let (mut shown, mut is_marked, begun) = (Vec::new(), false, Instant::now());
        while !is_marked || !self.stream.is_idle() {
            assert!(begun.elapsed() < BOUND, "it does not come to rest");
            match self.stream.step(Duration::from_millis(1)).expect("step") {
                Step::Picture(picture) => shown.push(picture),
                Step::Fault(fault) if fault == MARK => is_marked = true,
                Step::Fault(fault) => self.faults.push(fault),
                Step::Progress => {}
                Step::End(why) => panic!("the end: {why:?}"),
            }
        }
        shown
    }

    /// The last picture after all sent events, and its volume.
    fn picture(&mut self) -> (u32, Picture) {
        let last = self.settle().pop().expect("a picture");
        (last.volume, last.picture.expect("brought back"))
    }

    /// Sends a volume, and returns its picture.
    fn live(&mut self, number: u32) -> Picture {
        self.frames(speckled(number));
        let (volume, picture) = self.picture();
        assert_eq!(volume, number);
        picture
    }

    fn dispatches(&self) -> u64 {
        self.stream.dispatches()
    }
}

fn kept(update: Update) -> live::StreamOptions {
    live::StreamOptions { update, cine: ROOM, ..live::StreamOptions::default() }
}

/// A volume drawn by a separate renderer.
fn fresh(device: &Device, toml: &str, header: &Header, update: Update, frames: &[Frame]) -> Picture {
    let views = Views::new(header, &settings(toml), update).expect("views");
    let backward = vec![frames[0].backward; frames.len()];
    let scene = views.of(&backward).into_owned();
    let mut plain = Renderer::new(device, scene, &RendererOptions::default()).expect("renderer");
    frames.iter().for_each(|f| plain.frame(f.slice as u32, &f.bytes, 0).expect("frame"));
    plain.show(0).expect("show");
    plain.picture().expect("picture")
}

fn of(device: &Device, toml: &str, number: u32) -> Picture {
    fresh(device, toml, &header(0.3), Update::Whole, &speckled(number))
}

/// Pipelines that were compiled while drawing waited for them.
fn waited_for(device: &Device) -> u64 {
    let counts = &device.counts;
    counts.pipelines.load(Ordering::Relaxed) - counts.async_pipelines.load(Ordering::Relaxed)
}
