//! A volume that is compared with the shown one: it is read on a thread and drawn by a stream of its own, only while the window shows it.

use crate::compare::{self, Difference};
use crate::gpu::{Context, Wake};
use crate::live::{Feed, Step, Stream, StreamError, StreamOptions};
use crate::picture::Picture;
use crate::probe::{Frame, Geometry, Rigid};
use crate::scene::Settings;
use crate::segment::registration::{Registered, register};
use crate::source::convert::Volume;
use crate::source::live::{Event, Live};
use crate::source::recorder::Header;
use crate::source::{self, Source};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

/// How the compared volume is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareView {
    /// Beside the shown one.
    #[default]
    Tiles,
    /// Beside it, with the difference of both pictures as a third tile.
    Difference,
    /// Over it, beyond a line that the user moves.
    Wipe,
}

impl CompareView {
    /// The number of tiles that the room for the picture is divided into.
    pub(super) fn tiles(self) -> usize {
        match self {
            CompareView::Wipe => 1,
            CompareView::Tiles => 2,
            CompareView::Difference => 3,
        }
    }
}

/// What the compared volume has in common with the shown one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// Camera and region.
    View,
    /// Position and direction of planes.
    Planes,
    /// Windows, filters, light and all other settings.
    Look,
    /// Position in the loop.
    Volume,
}

impl Link {
    pub(super) const ALL: [Link; 4] = [Link::View, Link::Planes, Link::Look, Link::Volume];
}

/// Time for the stream in one update, so that inputs are handled between.
const SLICE: Duration = Duration::from_millis(4);

/// The state of the comparison that the window shows.
#[derive(Clone, Debug, Default)]
pub(super) struct Shown {
    pub view: CompareView,
    /// Position of the wipe's line from the left, 0..=1 of the picture's width.
    pub wipe: f64,
    /// Whether each link of [`Link::ALL`] holds.
    pub links: [bool; 4],
    /// Name of the shown volume; `name`: that of the compared one.
    pub first: String,
    pub name: String,
    /// Whether the compared volume is of the phantom.
    pub is_synthetic: bool,
    /// The compared volume's picture; None until it is drawn.
    pub picture: Option<Arc<Picture>>,
    /// The difference of both pictures; None unless it is shown and both are drawn.
    pub difference: Option<Arc<Picture>>,
    /// Whether the compared volume is moved onto the shown one.
    pub is_aligned: bool,
    /// Whether the motion of the compared volume onto the shown one is being searched for.
    pub is_aligning: bool,
}

/// The compared volume: what reads it, what draws it, and how it is linked to the shown one.
pub(super) struct Comparison {
    stream: Stream,
    asks: Sender<Asked>,
    read: Receiver<Read>,
    wake: Wake,
    shown: Shown,
    /// The settings that it has where a link is cut.
    own: Settings,
    /// The settings that its stream has, and the volume that was asked for.
    sent: Option<Settings>,
    asked: Option<usize>,
}

/// What the reading thread is asked for.
enum Asked {
    /// The volume with this number; the last one if there are fewer.
    Volume(usize),
    /// To move what is read onto this volume.
    Align(Box<Volume>),
    /// To leave what is read where it is.
    Apart,
}

/// What the reading thread has to tell.
enum Read {
    Volume(Box<Header>, VecDeque<Frame>),
    Aligned(Registered),
    Fault(String),
}

/// What an update of the comparison found out.
pub(super) enum News {
    Aligned(Registered),
    Fault(String),
}

/// The source of compared volumes, on its thread.
enum Held {
    Recording(Box<dyn Source>),
    /// One volume in memory.
    Pinned(Box<Header>, Volume),
}

impl Comparison {
    /// Compares with a recording. Its settings are those of the shown volume.
    ///
    /// # Errors
    /// One line: the file is no recording, or no thread can be started.
    pub(super) fn with_file(
        context: &Arc<Context>,
        file: &Path,
        settings: &Settings,
        wake: &Wake,
    ) -> Result<Comparison, String> {
        let held = Held::Recording(source::open(file, None).map_err(|e| e.to_string())?);
        Comparison::new(context, held, file_name(file), settings, wake)
    }

    /// Compares with a volume in memory, which stays as it is; so do its settings: nothing but the view and the planes is linked.
    ///
    /// # Errors
    /// One line: no thread can be started.
    pub(super) fn with_volume(
        context: &Arc<Context>,
        (header, volume): (Header, Volume),
        name: String,
        settings: &Settings,
        wake: &Wake,
    ) -> Result<Comparison, String> {
        let held = Held::Pinned(Box::new(header), volume);
        let mut compared = Comparison::new(context, held, name, settings, wake)?;
        compared.shown.links = [true, true, false, false];
        Ok(compared)
    }

    fn new(
        context: &Arc<Context>,
        held: Held,
        name: String,
        settings: &Settings,
        wake: &Wake,
    ) -> Result<Comparison, String> {
        let (asks, asked) = channel();
        let (sender, read) = channel();
        let woken = wake.clone();
        let work = move || read_as_asked(held, &asked, &sender, &woken);
        let thread = std::thread::Builder::new().name("comparison".into());
        thread.spawn(work).map_err(|e| e.to_string())?;
        let options =
            StreamOptions { wake: Some(wake.clone()), prepares: true, paced: true, ..StreamOptions::default() };
        let shown = Shown { wipe: 0.5, links: [true; 4], name, ..Shown::default() };
        let own = settings.clone().without_drawings();
        let stream = Stream::new(context, Feed::none(), own.clone(), options);
        Ok(Comparison { stream, asks, read, wake: wake.clone(), shown, own, sent: None, asked: None })
    }

    /// What the window shows of it.
    pub(super) fn shown(&self) -> &Shown {
        &self.shown
    }

    /// Sets the name of the shown volume.
    pub(super) fn name_first(&mut self, name: String) {
        self.shown.first = name;
    }

    pub(super) fn set_view(&mut self, view: CompareView) {
        self.shown.view = view;
        self.shown.difference = None;
    }

    /// Sets the position of the wipe's line from the left, 0..=1 of the picture's width.
    pub(super) fn set_wipe(&mut self, share: f64) {
        self.shown.wipe = share.clamp(0.0, 1.0);
    }

    /// Cuts a link, so that the compared volume keeps what it has, or ties it again.
    pub(super) fn toggle_link(&mut self, link: Link) {
        if let Some(held) = self.sent.clone() {
            self.own = held;
        }
        for (other, is_linked) in Link::ALL.iter().zip(&mut self.shown.links) {
            *is_linked ^= *other == link;
        }
        self.asked = self.asked.filter(|_| link != Link::Volume);
    }

    /// Begins to move the compared volume onto this one, or leaves it where it is if it is moved.
    pub(super) fn align(&mut self, onto: Option<Volume>) {
        let (asked, is_aligning) = match onto.filter(|_| !self.shown.is_aligned) {
            Some(volume) => (Asked::Align(Box::new(volume)), true),
            None => (Asked::Apart, false),
        };
        self.shown.is_aligned = false;
        // Without the thread its fault is told by the next update.
        self.shown.is_aligning = self.asks.send(asked).is_ok() && is_aligning;
    }

    /// The settings of the compared volume, by those of the shown one.
    fn linked(&self, settings: &Settings) -> Settings {
        let [view, planes, look, _] = self.shown.links;
        let of = |is_linked: bool| if is_linked { settings } else { &self.own };
        let mut linked = of(look).clone().without_drawings();
        (linked.mode, linked.layout) = (settings.mode, settings.layout);
        (linked.camera, linked.region) = (of(view).camera.clone(), of(view).region.clone());
        let from = &of(planes).planes;
        let to = &mut linked.planes;
        (to.position, to.azimuth, to.tilt, to.roll) = (from.position, from.azimuth, from.tilt, from.roll);
        (to.zoom, to.plane) = (from.zoom, from.plane);
        linked.picture.size = settings.picture.size;
        // Labels lie where the shown volume does.
        if !self.shown.is_aligned {
            linked.labels.volume = None;
        }
        linked
    }

    /// Does what is due. `settings`: those of the shown volume; `volume`: its position in the loop. Returns whether the
    /// window shows anything else, and what the user is to be told.
    ///
    /// # Errors
    /// The device fails, or the volume cannot be drawn with these settings.
    pub(super) fn update(
        &mut self,
        settings: &Settings,
        volume: Option<usize>,
    ) -> Result<(bool, Option<News>), StreamError> {
        let volume = if self.shown.links[3] { volume.or(self.asked).unwrap_or(0) } else { self.asked.unwrap_or(0) };
        if self.asked != Some(volume) {
            self.asked = Some(volume);
            // Without the thread its fault is told below.
            let _ = self.asks.send(Asked::Volume(volume));
        }
        let (mut is_other, mut news) = (false, None);
        match self.read.try_recv() {
            Ok(Read::Volume(header, frames)) => {
                self.shown.is_synthetic = header.synthetic;
                let frames = Frames { header: Some(header), frames };
                match Feed::waking(Box::new(frames), None, Some(self.wake.clone())) {
                    Ok(feed) => self.stream.replace_source(feed),
                    Err(fault) => news = Some(News::Fault(fault.to_string())),
                }
            }
            Ok(Read::Aligned(found)) => {
                (self.shown.is_aligned, self.shown.is_aligning, is_other) = (true, false, true);
                news = Some(News::Aligned(found));
            }
            Ok(Read::Fault(fault)) => {
                (self.shown.is_aligning, is_other) = (false, true);
                news = Some(News::Fault(fault));
            }
            Err(TryRecvError::Disconnected) => news = Some(News::Fault(self.shown.name.clone())),
            Err(TryRecvError::Empty) => {}
        }
        let linked = self.linked(settings);
        if self.sent.as_ref() != Some(&linked) {
            self.stream.change(linked.clone())?;
            self.sent = Some(linked);
        }
        let begun = Instant::now();
        loop {
            if let Step::Picture(picture) = self.stream.step(Duration::ZERO)? {
                self.shown.picture = picture.picture.map(Arc::new);
                self.shown.difference = None;
                is_other = true;
                break;
            }
            if begun.elapsed() >= SLICE || self.stream.is_waiting() || self.stream.is_idle() {
                break;
            }
        }
        Ok((is_other, news))
    }

    /// True if the difference is shown and is not that of the picture of the shown volume, or of the compared one.
    pub(super) fn lacks_difference(&self) -> bool {
        self.shown.view == CompareView::Difference && self.shown.picture.is_some() && self.shown.difference.is_none()
    }

    /// Makes the difference with the picture of the shown volume. Pictures of different sizes have none: one of them is still of another window.
    pub(super) fn make_difference(&mut self, first: &Picture) {
        let second = self.shown.picture.as_ref();
        let made = second.and_then(|second| compare::difference(first, second).ok());
        self.shown.difference = made.map(|Difference { picture, .. }| Arc::new(picture));
    }

    /// Notes that one of both pictures is another one.
    pub(super) fn picture_changed(&mut self) {
        self.shown.difference = None;
    }

    /// When it is to be updated again without an event.
    pub(super) fn due(&self, now: Instant) -> Option<Instant> {
        match (self.stream.is_waiting(), self.stream.is_idle()) {
            // As for the shown picture.
            (true, _) => Some(now + Duration::from_millis(1)),
            (false, false) => Some(now),
            _ => None,
        }
    }
}

/// The name of a file without its folder.
fn file_name(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// The volume of these frames of one geometry.
pub(super) fn volume_of<'a>(header: &Header, frames: impl Iterator<Item = &'a Frame>) -> Volume {
    let mut frames = frames.peekable();
    let is_backward = frames.peek().is_some_and(|frame| frame.backward);
    let geometry = if is_backward { &header.backward } else { &header.forward };
    let mut volume = Volume::new(geometry.clone(), header.stored);
    frames.for_each(|frame| volume.take(frame.clone()));
    volume
}

/// Reads what is asked for, until nobody asks.
fn read_as_asked(mut held: Held, asked: &Receiver<Asked>, sender: &Sender<Read>, wake: &Wake) {
    let (mut number, mut motion): (usize, Option<(Rigid, Geometry)>) = (0, None);
    while let Ok(mut next) = asked.recv() {
        // Of several volumes only the last is of use.
        while let (Asked::Volume(_), Ok(later)) = (&next, asked.try_recv()) {
            next = later;
        }
        let mut told = Vec::new();
        let read = match &next {
            Asked::Volume(n) => {
                number = *n;
                held.read(number)
            }
            _ => held.read(number),
        };
        match read {
            Ok((header, volume)) => {
                match next {
                    Asked::Volume(_) => {}
                    Asked::Apart => motion = None,
                    Asked::Align(onto) => match register(&onto, &volume) {
                        Ok(found) => {
                            motion = Some((found.motion, onto.geometry().clone()));
                            told.push(Read::Aligned(found));
                        }
                        Err(fault) => told.push(Read::Fault(fault)),
                    },
                }
                let (header, frames) = moved(header, volume, motion.as_ref());
                told.push(Read::Volume(Box::new(header), frames));
            }
            Err(fault) => told.push(Read::Fault(fault)),
        }
        if told.into_iter().any(|read| sender.send(read).is_err()) {
            return;
        }
        wake();
    }
}

/// The frames of a volume as they are drawn: where they are, or moved onto another geometry.
fn moved(header: Header, volume: Volume, motion: Option<&(Rigid, Geometry)>) -> (Header, VecDeque<Frame>) {
    let volume = match motion {
        Some((motion, geometry)) => {
            let back = motion.map().inverse();
            volume.moved_onto(geometry, |place| back.transform_point3(place), header.range[0])
        }
        None => volume,
    };
    let geometry = volume.geometry().clone();
    let frames = volume.frames().iter().enumerate().filter(|(_, bytes)| !bytes.is_empty());
    let frames = frames.map(|(slice, bytes)| Frame::of_slice(0, slice, bytes.clone())).collect();
    (Header { forward: geometry.clone(), backward: geometry, ..header }, frames)
}

impl Held {
    /// The header and the samples of a volume; the last one if there are fewer.
    fn read(&mut self, number: usize) -> Result<(Header, Volume), String> {
        match self {
            Held::Pinned(header, volume) => Ok(((**header).clone(), volume.clone())),
            Held::Recording(source) => {
                let number = number.min(source.volumes().saturating_sub(1));
                let (volume, _) = Volume::read(&mut **source, number, |_| ()).map_err(|e| e.to_string())?;
                Ok((source.header(), volume))
            }
        }
    }
}

/// The frames of one volume in memory, as a source.
struct Frames {
    header: Option<Box<Header>>,
    frames: VecDeque<Frame>,
}

impl Live for Frames {
    fn next(&mut self, _: Duration) -> Event {
        match self.header.take() {
            Some(header) => Event::Begin(header),
            None => self.frames.pop_front().map_or(Event::End(None), Event::Frame),
        }
    }

    fn can_wait(&self) -> bool {
        true
    }
}
