//! Volumes that are compared with the shown one: each is read on a thread and drawn by a stream of its own, only while the window shows it.

use crate::compare::{self, Difference, MAX_TILES};
use crate::gpu::{Context, Wake};
use crate::live::{Feed, Step, Stream, StreamError, StreamOptions};
use crate::picture::Picture;
use crate::probe::{Frame, Geometry, Rigid};
use crate::scene::picker::Picker;
use crate::scene::{Scene, Settings};
use crate::segment::registration::{Registered, centre, register};
use crate::source::convert::Volume;
use crate::source::live::{Event, Live};
use crate::source::recorder::Header;
use crate::source::{self, Source};
use crate::texts;
use crate::tree::All;
use glam::{DAffine3, DVec3};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

/// How the compared volumes are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CompareView {
    /// All compared volumes are beside the shown one, each on a tile.
    #[default]
    Tiles,
    /// The first compared volume is beside the shown one, with the difference of both pictures as a third tile.
    Difference,
    /// The first compared volume covers the shown one beyond a line that the user moves.
    Wipe,
}

/// What the compared volumes have in common with the shown one. They always have its mode and layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, All)]
pub enum Link {
    /// Camera and region.
    View,
    /// Position, direction and zoom of planes, and which plane is selected.
    Planes,
    /// Windows, filters, light and all other settings that no other link has.
    Look,
    /// The volume in time: a compared recording shows the volume whose index is the position of the shown one in the cine loop.
    Volume,
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
    /// Name of the shown volume.
    pub first: String,
    /// The compared volumes, one at least.
    pub others: Vec<Other>,
    /// The difference of the pictures of the shown volume and the first compared one; None unless it is shown and both are drawn.
    pub difference: Option<Arc<Picture>>,
}

/// What the window shows of a compared volume.
#[derive(Clone, Debug, Default)]
pub(super) struct Other {
    pub name: String,
    /// True if the volume is the phantom's.
    pub is_synthetic: bool,
    /// The picture of the volume; None until it is drawn.
    pub picture: Option<Arc<Picture>>,
    /// The length, mm, and the angle, degrees, by which the volume is moved; None if it is where its recording says.
    pub moved: Option<[f64; 2]>,
    /// True if the motion was found by [`register`] and the user has not changed it since.
    pub is_aligned: bool,
    /// True while the motion of the volume onto the shown one is being searched for.
    pub is_aligning: bool,
}

impl Shown {
    /// The number of compared volumes that the view shows.
    pub(super) fn visible(&self) -> usize {
        if self.view == CompareView::Tiles { self.others.len() } else { 1 }
    }

    /// The number of tiles that the room for the picture is divided into.
    pub(super) fn tiles(&self) -> usize {
        match self.view {
            CompareView::Wipe => 1,
            CompareView::Tiles => 1 + self.others.len(),
            CompareView::Difference => 3,
        }
    }

    /// The difference, then the pictures of the compared volumes; each None until it is drawn.
    pub(super) fn pictures(&self) -> Vec<Option<Arc<Picture>>> {
        [self.difference.clone()].into_iter().chain(self.others.iter().map(|other| other.picture.clone())).collect()
    }
}

/// The compared volumes: what reads them, what draws them, and how they are linked to the shown one.
pub(super) struct Comparison {
    wake: Wake,
    compared: Vec<Compared>,
    /// What the window shows of it.
    pub(super) shown: Shown,
    /// The settings that they have where a link is cut.
    own: Settings,
}

/// A compared volume: what reads it and what draws it.
struct Compared {
    stream: Stream,
    asks: Sender<Asked>,
    read: Receiver<Read>,
    /// The settings that its stream has, and the volume that was asked for.
    sent: Option<Settings>,
    asked: Option<usize>,
    /// From where its recording says to where it is drawn, mm.
    motion: DAffine3,
}

/// What the reading thread is asked for.
enum Asked {
    /// The volume with this number; the last one if there are fewer.
    Volume(usize),
    /// To move what is read onto this volume.
    Align(Box<Volume>),
    /// To move what is read by this motion, onto this geometry; None: to leave it where it is.
    Move(Option<(DAffine3, Box<Geometry>)>),
}

/// What the reading thread has to tell.
enum Read {
    Volume(Box<Header>, VecDeque<Frame>),
    Aligned(Registered),
    Fault(String),
}

/// What an update of the comparison found out: that a volume is aligned, or a fault.
pub(super) type News = Result<Registered, String>;

/// The source of compared volumes, on its thread.
enum Held {
    Recording(Box<dyn Source>),
    /// One volume in memory.
    Pinned(Box<Header>, Volume),
}

impl Comparison {
    /// A comparison with a volume of `held` and the settings of the shown one.
    ///
    /// # Errors
    /// One line: no thread can be started.
    fn new(context: &Arc<Context>, held: Held, name: String, settings: &Settings, wake: &Wake) -> Result<Self, String> {
        let own = settings.clone().without_drawings();
        let shown = Shown { wipe: 0.5, links: [true; 4], ..Shown::default() };
        let mut comparison = Comparison { wake: wake.clone(), compared: Vec::new(), shown, own };
        comparison.add(context, held, name)?;
        Ok(comparison)
    }

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
        Comparison::new(context, Held::open(file)?, file_name(file), settings, wake)
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
        let mut comparison = Comparison::new(context, Held::Pinned(Box::new(header), volume), name, settings, wake)?;
        comparison.shown.links = [true, true, false, false];
        Ok(comparison)
    }

    /// Compares with a further recording.
    ///
    /// # Errors
    /// One line: the file is no recording, there are as many tiles as there can be, or no thread can be started.
    pub(super) fn add_file(&mut self, context: &Arc<Context>, file: &Path) -> Result<(), String> {
        if self.compared.len() + 1 >= MAX_TILES {
            return Err(texts::why_no_more_tiles(MAX_TILES));
        }
        self.add(context, Held::open(file)?, file_name(file))?;
        // It would be drawn nowhere else.
        self.set_view(CompareView::Tiles);
        Ok(())
    }

    fn add(&mut self, context: &Arc<Context>, held: Held, name: String) -> Result<(), String> {
        self.compared.push(Compared::new(context, held, &self.own, &self.wake)?);
        self.shown.others.push(Other { name, ..Other::default() });
        Ok(())
    }

    pub(super) fn set_view(&mut self, view: CompareView) {
        self.shown.view = view;
        self.shown.difference = None;
    }

    /// Sets the position of the wipe's line from the left, 0..=1 of the picture's width.
    pub(super) fn set_wipe(&mut self, share: f64) {
        self.shown.wipe = share.clamp(0.0, 1.0);
    }

    /// Cuts a link, so that the compared volumes keep what they have, or ties it again.
    pub(super) fn toggle_link(&mut self, link: Link) {
        if let Some(held) = self.compared[0].sent.clone() {
            self.own = held;
        }
        for (other, is_linked) in Link::ALL.iter().zip(&mut self.shown.links) {
            *is_linked ^= *other == link;
        }
    }

    /// Begins to move the visible volumes onto this one, or leaves them where they are if they are aligned or about to be.
    pub(super) fn align(&mut self, onto: Option<Volume>) {
        let visible = self.shown.visible();
        let is_done = |other: &Other| other.is_aligned || other.is_aligning;
        let onto = onto.filter(|_| !self.shown.others[..visible].iter().all(is_done));
        for (compared, other) in self.compared.iter_mut().zip(&mut self.shown.others).take(visible) {
            let asked = onto.as_ref().map_or(Asked::Move(None), |onto| Asked::Align(Box::new(onto.clone())));
            (compared.motion, other.moved, other.is_aligned) = (DAffine3::IDENTITY, None, false);
            // Without the thread its fault is told by the next update.
            other.is_aligning = compared.asks.send(asked).is_ok() && onto.is_some();
        }
    }

    /// Moves the n-th compared volume as a drag over its picture does, from one pixel to another: it follows the pointer in the plane of the tile, or in
    /// that of the picture, or turns about the middle of it. `onto`: the geometry of the shown volume.
    pub(super) fn drag(&mut self, n: usize, pixels: [[f64; 2]; 2], turns: bool, onto: &Geometry) {
        let Some((compared, other)) = self.compared.get_mut(n).zip(self.shown.others.get_mut(n)) else { return };
        let Some(step) = compared.stream.scene().and_then(|scene| dragged(scene, pixels, turns)) else { return };
        compared.motion = step * compared.motion;
        let motion = Rigid::of(&compared.motion, centre(onto));
        other.moved = Some([motion.shift.length(), motion.angle()]);
        (other.is_aligned, other.is_aligning) = (false, false);
        // Without the thread its fault is told by the next update.
        let _ = compared.asks.send(Asked::Move(Some((compared.motion, Box::new(onto.clone())))));
    }

    /// The settings of a compared volume, by those of the shown one.
    fn linked(&self, settings: &Settings, is_moved: bool) -> Settings {
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
        if !is_moved {
            linked.labels.volume = None;
        }
        linked
    }

    /// Does what is due. `settings`: those of the shown volume; `volume`: its position in the loop. Returns whether the
    /// window shows anything else, and what the user is to be told.
    ///
    /// # Errors
    /// The device fails, or a volume cannot be drawn with these settings.
    pub(super) fn update(
        &mut self,
        settings: &Settings,
        volume: Option<usize>,
    ) -> Result<(bool, Option<News>), StreamError> {
        let (mut is_other, mut news) = (false, None);
        for n in 0..self.shown.visible() {
            let linked = self.linked(settings, self.shown.others[n].moved.is_some());
            let (compared, other) = (&mut self.compared[n], &mut self.shown.others[n]);
            let own = compared.asked.unwrap_or(0);
            compared.ask(if self.shown.links[3] { volume.unwrap_or(own) } else { own });
            match compared.read.try_recv() {
                Ok(Read::Volume(header, frames)) => {
                    other.is_synthetic = header.synthetic;
                    let frames = Frames { header: Some(header), frames };
                    match Feed::observed(Box::new(frames), None, Some(self.wake.clone()), None) {
                        Ok(feed) => compared.stream.replace_source(feed),
                        Err(fault) => news = Some(Err(fault.to_string())),
                    }
                }
                // It was moved meanwhile.
                Ok(Read::Aligned(_)) if !other.is_aligning => {}
                Ok(Read::Aligned(found)) => {
                    let motion = found.motion;
                    (compared.motion, other.moved) = (motion.map(), Some([motion.shift.length(), motion.angle()]));
                    (other.is_aligned, other.is_aligning, is_other) = (true, false, true);
                    news = Some(Ok(found));
                }
                Ok(Read::Fault(fault)) => {
                    (other.is_aligning, is_other) = (false, true);
                    news = Some(Err(fault));
                }
                Err(TryRecvError::Disconnected) => news = Some(Err(other.name.clone())),
                Err(TryRecvError::Empty) => {}
            }
            if let Some(picture) = compared.step(linked)? {
                other.picture = picture;
                if n == 0 {
                    self.shown.difference = None;
                }
                is_other = true;
            }
        }
        Ok((is_other, news))
    }

    /// True if the difference is shown and is not that of the picture of the shown volume, or of the compared one.
    pub(super) fn lacks_difference(&self) -> bool {
        let has_picture = self.shown.others[0].picture.is_some();
        self.shown.view == CompareView::Difference && has_picture && self.shown.difference.is_none()
    }

    /// Makes the difference with the picture of the shown volume. Pictures of different sizes have none: one of them is still of another window.
    pub(super) fn make_difference(&mut self, first: &Picture) {
        let second = self.shown.others[0].picture.as_ref();
        let made = second.and_then(|second| compare::difference(first, second).ok());
        self.shown.difference = made.map(|Difference { picture, .. }| Arc::new(picture));
    }

    /// When it is to be updated again without an event.
    pub(super) fn due(&self, now: Instant) -> Option<Instant> {
        let streams = || self.compared[..self.shown.visible()].iter().map(|compared| &compared.stream);
        if streams().any(|stream| !stream.is_waiting() && !stream.is_idle()) {
            return Some(now);
        }
        // As for the shown picture.
        streams().any(Stream::is_waiting).then(|| now + Duration::from_millis(1))
    }
}

impl Compared {
    /// # Errors
    /// One line: no thread can be started.
    fn new(context: &Arc<Context>, held: Held, settings: &Settings, wake: &Wake) -> Result<Compared, String> {
        let (asks, asked) = channel();
        let (sender, read) = channel();
        let woken = wake.clone();
        let work = move || read_as_asked(held, &asked, &sender, &woken);
        let thread = std::thread::Builder::new().name("comparison".into());
        thread.spawn(work).map_err(|e| e.to_string())?;
        let options =
            StreamOptions { wake: Some(wake.clone()), prepares: true, paced: true, ..StreamOptions::default() };
        let stream = Stream::new(context, Feed::none(), settings.clone(), options);
        Ok(Compared { stream, asks, read, sent: None, asked: None, motion: DAffine3::IDENTITY })
    }

    /// Asks for the volume with this number, if it is another one.
    fn ask(&mut self, volume: usize) {
        if self.asked.replace(volume) != Some(volume) {
            // Without the thread its fault is told by the next update.
            let _ = self.asks.send(Asked::Volume(volume));
        }
    }

    /// Lets its stream work for a while with these settings. Returns a new picture, if one is drawn.
    fn step(&mut self, settings: Settings) -> Result<Option<Option<Arc<Picture>>>, StreamError> {
        if self.sent.as_ref() != Some(&settings) {
            self.stream.change(settings.clone())?;
            self.sent = Some(settings);
        }
        let begun = Instant::now();
        loop {
            if let Step::Picture(picture) = self.stream.step(Duration::ZERO)? {
                return Ok(Some(picture.picture.map(Arc::new)));
            }
            if begun.elapsed() >= SLICE || self.stream.is_waiting() || self.stream.is_idle() {
                return Ok(None);
            }
        }
    }
}

/// The motion of a drag over the picture of a scene, from one pixel to another, mm: in the plane of the tile or of the picture. None on a curved plane.
fn dragged(scene: &Scene, [from, to]: [[f64; 2]; 2], turns: bool) -> Option<DAffine3> {
    let tiling = scene.cuts_planes().then(|| scene.tiling());
    let on = tiling.as_ref().and_then(|tiling| Some((tiling, tiling.tiles.iter().find(|tile| tile.has(from))?)));
    let ([a, b], middle, axis) = match on {
        Some((_, tile)) if tile.section.is_some() => return None,
        Some((tiling, tile)) => ([from, to].map(|at| tiling.point(tile, at)), tile.plane.at, tile.plane.normal),
        None => {
            let (picker, rays) = (Picker::of(scene), &scene.rays);
            let on_plane = |at| {
                let (origin, direction) = picker.ray(at);
                origin + direction * ((rays.target - origin).dot(rays.forward) / direction.dot(rays.forward))
            };
            ([from, to].map(on_plane), rays.target, rays.forward)
        }
    };
    if !turns {
        return Some(DAffine3::from_translation(b - a));
    }
    let (before, after): (DVec3, DVec3) = (a - middle, b - middle);
    let angle = before.cross(after).dot(axis).atan2(before.dot(after));
    let back = DAffine3::from_translation(-middle);
    Some(DAffine3::from_translation(middle) * DAffine3::from_axis_angle(axis, angle) * back)
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
    let (mut number, mut motion): (usize, Option<(DAffine3, Box<Geometry>)>) = (0, None);
    while let Ok(first) = asked.recv() {
        let mut onto = None;
        // Of several volumes and motions only the last is of use.
        for asked in std::iter::once(first).chain(asked.try_iter()) {
            match asked {
                Asked::Volume(n) => number = n,
                Asked::Move(other) => (motion, onto) = (other, None),
                Asked::Align(volume) => onto = Some(volume),
            }
        }
        let mut told = Vec::new();
        match held.read(number) {
            Ok((header, volume)) => {
                match onto.map(|onto| (register(&onto, &volume), onto)) {
                    None => {}
                    Some((Ok(found), onto)) => {
                        motion = Some((found.motion.map(), Box::new(onto.geometry().clone())));
                        told.push(Read::Aligned(found));
                    }
                    Some((Err(fault), _)) => told.push(Read::Fault(fault)),
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
fn moved(header: Header, volume: Volume, motion: Option<&(DAffine3, Box<Geometry>)>) -> (Header, VecDeque<Frame>) {
    let volume = match motion {
        Some((motion, geometry)) => {
            let back = motion.inverse();
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
    fn open(file: &Path) -> Result<Held, String> {
        Ok(Held::Recording(source::open(file, None).map_err(|e| e.to_string())?))
    }

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
