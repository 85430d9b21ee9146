//! The console: the stream on one side, hands and eyes on the other. It knows no window, only inputs, the time, and a screen to show
//! things on, which may be missing; so that whatever can be done in a window is tested without one.

mod frame;

use super::command::{Command, Tool};
use super::controls::{Change, Controls};
use super::export::Exporter;
use super::frame_budget::FrameBudget;
use super::gestures::Gestures;
use super::input::Input;
use super::keys::Keys;
use super::panels::{self, Note, Panels};
use super::picking::Picture;
use super::quality_ladder::Rung;
use super::source_supervisor::{Open, SourceSupervisor};
use super::times::Times;
use crate::gpu::shader_reload::{ShaderFolder, Watch};
use crate::gpu::window::Screen;
use crate::gpu::{Context, GpuError, Wake};
use crate::kiosk::chord::Chord;
use crate::live::cine::CineLimits;
use crate::live::{self, Feed, Stream, StreamError, Update};
use crate::scene::Settings;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a note stays.
const NOTE: Duration = Duration::from_secs(5);
/// Between two looks whether what is amiss is mended.
const LOOK: Duration = Duration::from_secs(2);
/// Notes at once, the newest.
const NOTES: usize = 4;

pub struct Options {
    pub settings: Settings,
    pub update: Update,
    /// Volume images that take turns, 2 or 3.
    pub images: u32,
    pub queues: Option<usize>,
    pub cine: CineLimits,
    /// Time of a picture that is held while the view moves.
    pub budget: Option<Duration>,
    pub rungs: Vec<Rung>,
    /// How long to wait before a source that ended is opened again; none ends with it.
    pub retry: Option<Duration>,
    /// Every frame goes there too.
    pub record: Option<PathBuf>,
    /// Where pictures and loops are saved.
    pub folder: PathBuf,
    /// Anything besides the picture is drawn at all.
    pub overlay: bool,
    /// Sliders and buttons, to begin with.
    pub panels: bool,
    /// Pixels a point.
    pub scale: f32,
    /// The only way out of a kiosk, if there is any.
    pub exit: Option<Chord>,
    pub is_kiosk: bool,
    /// Called when [`Console::tick`] has something to do.
    pub wake: Wake,
    /// Nothing of this can be right: only why is shown.
    pub amiss: Option<Amiss>,
    /// Shaders to use instead of the embedded ones; the folder is watched, and what changes there is shown.
    pub shaders: Option<Arc<ShaderFolder>>,
}

impl Options {
    /// Of a window that somebody looks into, full quality always, nothing kept; nobody is told when there is something to do.
    pub fn usual() -> Options {
        Options {
            settings: Settings::default(),
            update: Update::Whole,
            images: 3,
            queues: None,
            cine: CineLimits::default(),
            budget: None,
            rungs: super::quality_ladder::built_in(),
            retry: None,
            record: None,
            folder: ".".into(),
            overlay: true,
            panels: true,
            scale: 1.0,
            exit: None,
            is_kiosk: false,
            wake: Arc::new(|| ()),
            amiss: None,
            shaders: None,
        }
    }
}

/// What keeps everything from being shown, and how to find out that it is gone.
pub struct Amiss {
    pub title: String,
    pub why: String,
    /// Asked every two seconds: when it is mended another console is asked for.
    pub is_mended: Box<dyn Fn() -> bool>,
}

/// What whoever drives the console does next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Next {
    /// When to tick again, whatever comes; none: when something does.
    pub at: Option<Instant>,
    pub exit: bool,
    pub toggles_full_screen: bool,
    /// Another console is to take the place of this one.
    pub renews: bool,
}

/// Why the console cannot go on by itself.
#[derive(Debug, thiserror::Error)]
pub enum ConsoleError {
    /// [`Console::revive`] goes on.
    #[error("{0}")]
    DeviceLost(GpuError),
    /// The screen is gone; [`Console::set_screen`] goes on.
    #[error("{0}")]
    Screen(GpuError),
}

pub struct Console {
    // Dropped in this order: what shows before what is shown.
    screen: Option<Screen>,
    stream: Stream,
    context: Arc<Context>,
    supply: SourceSupervisor,
    controls: Controls,
    hand: Gestures,
    keys: Keys,
    keep: Exporter,
    pace: FrameBudget,
    rungs: Vec<Rung>,
    panels: Panels,
    times: Times,
    options: Shape,
    /// Of the window, pixels.
    size: [u32; 2],
    began: Instant,
    /// The settings that the stream was given last, and the rung that they stand on.
    sent: Option<Settings>,
    rung: usize,
    /// Settings that could not be drawn are told once.
    refused: Option<Settings>,
    notes: Vec<(Instant, Note)>,
    /// Something besides the picture looks different.
    stale: bool,
    /// A picture was drawn that has not been shown.
    fresh: bool,
    help: bool,
    hud: bool,
    is_panelled: bool,
    /// Where it is to be drawn, pixels of the window.
    pointer: Option<[f64; 2]>,
    playing: Option<Instant>,
    /// The first thing that a hand did which no settings have taken up yet, and which no picture has shown yet.
    touched: Option<Instant>,
    awaited: Option<(Instant, Instant)>,
    /// When statistics were taken last, and when anything came last.
    counted: Instant,
    heard: Instant,
    frames: u64,
    /// Of the device, since the last picture.
    faults: u32,
    /// Since when nothing that was drawn can be shown.
    blank: Option<Instant>,
    again: Option<Instant>,
    /// There was nothing to show things on: not tried again before.
    nowhere: Option<Instant>,
    amiss: Option<(Amiss, Instant)>,
    next: Next,
    shaders: Option<Arc<ShaderFolder>>,
    /// Why what is shown is not drawn with the shaders as they are written now.
    shader_fault: Option<String>,
    /// Keeps `shaders` up to date.
    _watch: Option<Watch>,
}

/// What stays as it was given.
struct Shape {
    overlay: bool,
    exit: Option<Chord>,
    is_kiosk: bool,
}

impl Console {
    /// `size`: of the window, pixels.
    pub fn new(context: &Arc<Context>, open: Open, options: Options, size: [u32; 2]) -> Console {
        let now = Instant::now();
        let is_panelled = options.panels && options.overlay;
        let mut controls = Controls::new(options.settings);
        controls.resize(panels::place(size, options.scale, is_panelled).1);
        let streamed = live::StreamOptions {
            update: options.update,
            images: options.images,
            queues: options.queues,
            readback: false,
            cine: options.cine,
            wake: Some(options.wake.clone()),
            shaders: options.shaders.clone(),
        };
        let watch = options.shaders.as_ref().map(|folder| Watch::new(folder, options.wake.clone()));
        let (watch, unwatched) = match watch.transpose() {
            Ok(watch) => (watch, None),
            Err(fault) => (None, Some(fault)),
        };
        let shares: Vec<f64> = options.rungs.iter().map(|rung| rung.share).collect();
        let mut console = Console {
            screen: None,
            stream: Stream::new(context, Feed::none(), controls.settings().clone(), streamed),
            context: context.clone(),
            supply: SourceSupervisor::new(open, options.retry, options.record, options.wake.clone()),
            controls,
            hand: Gestures::default(),
            keys: Keys::default(),
            keep: Exporter::new(options.folder, options.wake),
            pace: FrameBudget::new(options.budget, &shares),
            rungs: options.rungs,
            panels: Panels::new(options.scale),
            times: Times::default(),
            options: Shape { overlay: options.overlay, is_kiosk: options.is_kiosk, exit: options.exit },
            size,
            began: now,
            sent: None,
            rung: 0,
            refused: None,
            notes: Vec::new(),
            stale: true,
            fresh: false,
            help: false,
            hud: false,
            is_panelled,
            pointer: None,
            playing: None,
            touched: None,
            awaited: None,
            counted: now,
            heard: now,
            frames: 0,
            faults: 0,
            blank: None,
            again: None,
            nowhere: None,
            amiss: options.amiss.map(|amiss| (amiss, now + LOOK)),
            next: Next::default(),
            shaders: options.shaders,
            shader_fault: None,
            _watch: watch,
        };
        if let Some(fault) = unwatched {
            console.say(&fault, true);
        }
        console
    }

    /// What to show things on.
    pub fn set_screen(&mut self, screen: Option<Screen>) {
        // The old one goes first: a window has one surface at a time.
        self.screen = None;
        self.screen = screen;
        self.panels.renew();
        self.stale = true;
    }

    /// What it showed things on, for another.
    pub fn into_screen(mut self) -> Option<Screen> {
        self.screen.take()
    }

    /// Goes on with another device, or the same one anew: with what was kept, and the volume that comes next.
    ///
    /// # Errors
    /// A device that cannot hold what is shown.
    pub fn revive(&mut self, context: &Arc<Context>, screen: Option<Screen>) -> Result<(), StreamError> {
        self.screen = None;
        self.context = context.clone();
        let revived = self.stream.revive(context);
        self.set_screen(screen);
        match &revived {
            Ok(()) => self.say("the device was lost and opened anew", false),
            // A source that is opened again tells its geometry, of which everything is made then.
            Err(fault) => self.ended(Some(fault.to_string()), Instant::now()),
        }
        revived
    }

    /// The window has this size from here on, pixels; 0 while it is minimised.
    pub fn resize(&mut self, size: [u32; 2]) {
        if let Some(screen) = &mut self.screen {
            screen.resize(size);
        }
        if size.contains(&0) {
            return;
        }
        self.size = size;
        self.fit();
    }

    /// What was on the window is gone.
    pub fn expose(&mut self) {
        (self.stale, self.nowhere) = (true, None);
    }

    /// The picture has the room that the panels leave.
    fn fit(&mut self) {
        self.controls.resize(self.place().1);
        self.stale = true;
    }

    /// Where the picture lies, pixels of the window.
    fn place(&self) -> ([u32; 2], [u32; 2]) {
        panels::place(self.size, self.panels.scale(), self.is_panelled)
    }

    /// What was done by hand.
    pub fn input(&mut self, input: &Input) {
        let now = Instant::now();
        // Panels break at places that are none.
        let Some(input) = &input.believed() else { return };
        if self.options.overlay {
            self.panels.input(input);
            self.stale = true;
        }
        if let (Some(exit), Input::Key { key, pressed: true }) = (&self.options.exit, input)
            && exit.is(*key, self.keys.modifiers())
        {
            self.next.exit = true;
        }
        if let Some(command) = self.keys.input(input) {
            self.command(&command, now);
        }
        let place = self.place();
        let at = match input {
            Input::Moved(at) | Input::Touch { at, .. } => Some(*at),
            _ => None,
        };
        let on = Picture {
            corner: place.0.map(f64::from),
            size: place.1.map(f64::from),
            scene: self.stream.scene(),
            taken: at.or(self.hand.pointer()).is_some_and(|at| self.panels.covers(at)) && self.options.overlay,
            now: now.saturating_duration_since(self.began),
        };
        for command in self.hand.input(input, &on, self.controls.tool(), self.keys.modifiers()) {
            self.command(&command, now);
        }
    }

    /// Draws a pointer there, pixels, from here on: where no windowing system does.
    pub fn point(&mut self, at: Option<[f64; 2]>) {
        self.stale |= self.pointer != at;
        self.pointer = at;
    }

    /// Something to be said, for a few seconds and in the log.
    pub fn say(&mut self, text: &str, is_fault: bool) {
        match is_fault {
            true => tracing::warn!("{text}"),
            false => tracing::info!("{text}"),
        }
        let note = Note { text: text.into(), is_fault };
        self.notes.retain(|(_, known)| *known != note);
        self.notes.push((Instant::now() + NOTE, note));
        if self.notes.len() > NOTES {
            self.notes.remove(0);
        }
        self.stale = true;
    }

    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    pub fn stream(&mut self) -> &mut Stream {
        &mut self.stream
    }

    pub fn times(&self) -> &Times {
        &self.times
    }

    /// Why what is shown is not drawn with the shaders as they are written now.
    pub fn shader_fault(&self) -> Option<&str> {
        self.shader_fault.as_deref()
    }

    pub fn screen(&self) -> Option<&Screen> {
        self.screen.as_ref()
    }

    /// The rung of the ladder that the last settings stand on.
    pub fn rung(&self) -> usize {
        self.rung
    }

    /// Does what is asked for, by whomever.
    pub fn command(&mut self, command: &Command, now: Instant) {
        tracing::debug!("{command:?}");
        self.act(command, now);
    }
}

/// Between two volumes of a loop that is played.
pub(super) const LOOP: Duration = Duration::from_millis(200);

impl Console {
    pub(super) fn act(&mut self, command: &Command, now: Instant) {
        match self.controls.apply(command, self.stream.scene()) {
            Change::Nothing => return,
            Change::Tool => {}
            Change::Settings => {
                self.touched.get_or_insert(now);
                if is_move(command) {
                    self.pace.moves(now);
                } else {
                    // Another scene takes another time.
                    self.pace.forget();
                }
            }
            Change::Screen(command) => self.on_screen(&command, now),
        }
        self.stale = true;
    }

    fn on_screen(&mut self, command: &Command, now: Instant) {
        let count = self.stream.cine().volumes().len();
        match *command {
            Command::Freeze => {
                self.playing = None;
                self.stream.freeze(!self.stream.is_frozen());
            }
            Command::Cine(by) => {
                let at = self.stream.cine_position().unwrap_or(count.saturating_sub(1)) as i64 + i64::from(by);
                self.look_back(at.clamp(0, count.saturating_sub(1) as i64) as usize);
                self.touched.get_or_insert(now);
            }
            Command::CineAt(place) => {
                self.look_back(place.min(count.saturating_sub(1)));
                self.touched.get_or_insert(now);
            }
            Command::CinePlay => {
                self.stream.freeze(true);
                self.playing = match self.playing {
                    None if count > 1 => Some(now),
                    _ => None,
                };
            }
            Command::SavePicture => self.save_picture(),
            Command::SaveLoop => self.save_loop(),
            Command::Help => self.help = !self.help,
            Command::Hud => self.hud = !self.hud,
            Command::Panels => {
                self.is_panelled = !self.is_panelled && self.options.overlay;
                self.fit();
            }
            Command::FullScreen => self.next.toggles_full_screen |= !self.options.is_kiosk,
            // A kiosk has one way out, and it is not a key that a sleeve may press.
            Command::Exit => self.next.exit |= !self.options.is_kiosk,
            _ => {}
        }
    }

    fn look_back(&mut self, place: usize) {
        self.playing = None;
        self.stream.freeze(true);
        self.stream.show_cine_volume(place);
    }

    /// The next volume of a loop that is played, when it is due.
    pub(super) fn play(&mut self, now: Instant) {
        let (Some(due), count) = (self.playing, self.stream.cine().volumes().len()) else { return };
        if count < 2 {
            self.playing = None;
        } else if now >= due && !self.stream.is_replaying() {
            let next = self.stream.cine_position().map_or(0, |place| (place + 1) % count);
            self.stream.show_cine_volume(next);
            self.playing = Some((due + LOOP).max(now));
        }
    }

    fn save_picture(&mut self) {
        let picture = match self.stream.renderer().filter(|renderer| renderer.has_drawn()) {
            Some(renderer) => renderer.end_picture().map_err(|e| e.to_string()),
            None => Err("there is no picture yet".into()),
        };
        if let Err(fault) = picture.and_then(|picture| self.keep.picture(picture)) {
            self.say(&format!("the picture was not saved: {fault}"), true);
        }
    }

    fn save_loop(&mut self) {
        let kept: Vec<_> = self.stream.cine().volumes().iter().cloned().collect();
        let saved = match self.stream.header() {
            Some(header) if !kept.is_empty() => {
                let header = header.clone();
                self.keep.volumes(header, kept)
            }
            _ => Err("there are no volumes yet".into()),
        };
        if let Err(fault) = saved {
            self.say(&format!("the loop was not saved: {fault}"), true);
        }
    }

    /// The settings as they are to be drawn now: the hand's, on the rung that holds the budget.
    pub(super) fn wanted(&self, now: Instant) -> (usize, Settings) {
        let rung = self.pace.rung(now).min(self.rungs.len().saturating_sub(1));
        let voxel = self.stream.scene().map_or(0.5, |scene| scene.grid.pitch[0].min(scene.grid.pitch[1]));
        let settings = self.controls.settings();
        let mut wanted = match self.rungs.get(rung) {
            Some(stands) => stands.apply(settings, voxel),
            None => settings.clone(),
        };
        // A region that grows shows what was left out: with all of it made, dragging a face needs no frame again.
        wanted.slices.everything |= matches!(self.controls.tool(), Tool::Region | Tool::Clip);
        (rung, wanted)
    }
}

/// Whether a command is one of many, as those of a drag are.
fn is_move(command: &Command) -> bool {
    matches!(
        command,
        Command::Turn(_)
            | Command::Roll(_)
            | Command::Zoom(_)
            | Command::Pan(_)
            | Command::Light(_)
            | Command::Face(..)
            | Command::Clip(_)
            | Command::PlaneBy(_)
            | Command::Meet(_)
            | Command::PlaneTurn(_)
            | Command::Slide(..)
            | Command::Nudge(..)
    )
}
