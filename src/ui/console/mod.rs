//! The console of the live view. It connects the stream with gestures, keys, panels and the screen. It depends on no window: inputs, the
//! time and a screen (which may be missing) are passed in, so that everything a window can do is tested without one.

mod brushing;
mod first_steps;
mod frame;
mod input;
mod measuring;
mod opening;
mod options;
mod presets;
mod quality;
mod saving;
mod turning;

use self::first_steps::FirstSteps;
use self::frame::LostFluid;
use self::measuring::Counting;
use self::opening::Opening;
pub use self::options::{ConsoleOptions, OpenFile, Opened, StartupFault};
use self::presets::Presets;
use super::cine_player::{CinePlayer, Loop};
use super::clipboard::Clipboard;
use super::command::{Command, HeldKeys};
use super::controls::{Change, Controls};
use super::export::Exporter;
use super::frame_budget::{self, Pace, Quality, Rung};
use super::gestures::Gestures;
use super::keyboard_pointer::KeyboardPointer;
use super::panels::accesskit::{ActionRequest, TreeUpdate};
use super::panels::{self, Note, Panels, Rail};
use super::silence::Silence;
use super::source_supervisor::{OpenSource, SourceSupervisor};
use super::times::Times;
use crate::gpu::shader_reload::{ShaderFolder, Watch};
use crate::gpu::window::Screen;
use crate::gpu::{Context, GpuError};
use crate::kiosk::chord::Chord;
use crate::live::metrics::LiveMetrics;
use crate::live::{self, Feed, StartStep, Stream, StreamError};
use crate::passes::unveil::StartLine;
use crate::plan::Work;
use crate::progress_lines::Progress;
use crate::scene::{Scene, Settings};
use crate::source::live::SourceKind;
use crate::texts;
use crate::workspace::Origin;
use glam::DVec3;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a note is shown.
const NOTE_TIME: Duration = Duration::from_secs(5);
/// How long the banner of a device that did not finish is shown.
const STALL_TIME: Duration = Duration::from_secs(10);
/// Interval of the checks whether a startup fault is resolved.
const FAULT_CHECK_INTERVAL: Duration = Duration::from_secs(2);
/// Largest number of notes that are shown at once; the newest ones win.
const MAX_NOTES: usize = 4;
/// Escape leaves the program no sooner after another recording came: it was meant for the reading of it.
const ESCAPE_PAUSE: Duration = Duration::from_secs(1);
/// How long after the last input pipelines that may be needed next are compiled.
const REST_BEFORE_WARMING: Duration = Duration::from_secs(1);
/// A pause after which the same drag or key is another step for undo.
const STEP_PAUSE: Duration = Duration::from_millis(500);

/// What the event loop does after an update of the console.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoopRequest {
    /// When to update again even if no event comes. None: wait for an event.
    pub wake_at: Option<Instant>,
    pub exit: bool,
    pub toggle_full_screen: bool,
    /// Replace this console with a new one.
    pub restart: bool,
}

/// Why the console cannot continue by itself.
#[derive(Debug, thiserror::Error)]
pub enum ConsoleError {
    /// [`Console::revive`] continues on another device.
    #[error("{0}")]
    DeviceLost(GpuError),
    /// The screen is lost; [`Console::set_screen`] continues on another one.
    #[error("{0}")]
    Screen(GpuError),
}

/// The live view without its window.
pub struct Console {
    // Fields are dropped in this order: the screen before the stream whose pictures it shows.
    screen: Option<Screen>,
    stream: Stream,
    context: Arc<Context>,
    source: SourceSupervisor,
    controls: Controls,
    gestures: Gestures,
    keys: HeldKeys,
    keyboard_pointer: KeyboardPointer,
    exporter: Exporter,
    pace: Pace,
    rungs: Arc<Vec<Rung>>,
    panels: Panels,
    times: Times,
    fixed: FixedOptions,
    /// Size of the window, pixels.
    size: [u32; 2],
    started: Instant,
    /// The settings that the stream was given last, and what they leave out.
    sent_settings: Option<Settings>,
    quality: Quality,
    /// Settings that could not be drawn, to report them only once.
    rejected_settings: Option<Settings>,
    notes: Vec<(Instant, Note)>,
    /// Something besides the picture changed.
    needs_redraw: bool,
    /// A picture was drawn that has not been shown.
    has_new_picture: bool,
    /// Number of volumes that had come from a live source.
    live_volumes: u64,
    /// When a light moved last.
    light_moved: Option<Instant>,
    /// Number of presentations of the panels while a picture was being drawn.
    shown_between: u64,
    shows_help: bool,
    shows_times: bool,
    shows_panels: bool,
    rail: Rail,
    /// Saves pictures with a bar.
    /// What the help is searched for; none while it is not.
    help_search: Option<String>,
    shows_exports: bool,
    /// When the turntable of the view turned last, while it does.
    turning: Option<Instant>,
    /// How far the export in work is, as far as it says so.
    export_progress: Option<Progress>,
    /// Asks whether to save the loop before leaving.
    asks_to_leave: bool,
    first_steps: FirstSteps,
    /// Leaves when the loop up to this volume is saved.
    leaves_when_saved: Option<u32>,
    is_full_screen: bool,
    /// The newest volume of the loops that were saved whole.
    saved_volume: Option<u32>,
    /// Where the rendering that is shown starts on planes beside it.
    start_lines: Vec<StartLine>,
    /// What is said of the fluid at which rendering should start.
    fluid: LostFluid,
    /// Where to draw the pointer, pixels of the window.
    pointer: Option<[f64; 2]>,
    player: CinePlayer,
    /// The first input whose settings the stream has not been given yet.
    unsent_input: Option<Instant>,
    /// The first input that no picture shows yet, and when its settings were given to the stream.
    unshown_input: Option<(Instant, Instant)>,
    /// When the user acted last, and changed something last.
    last_input: Instant,
    last_change: Instant,
    /// The settings around which pipelines were compiled in advance last.
    warmed: Option<Settings>,
    /// When statistics were taken last.
    statistics_at: Instant,
    statistics_interval: Duration,
    silence: Silence,
    /// Why the source is not connected, as it was shown last.
    disconnected: Option<String>,
    frames: u64,
    metrics: Option<LiveMetrics>,
    /// Faults of the device since the last picture.
    device_faults: u32,
    /// The device did not finish and was opened again; a banner says so until then.
    stall_shown_until: Option<Instant>,
    /// What is done before the first picture, as the screen says it; and since when.
    start_step: Option<StartStep>,
    start_step_at: Instant,
    /// The screen says that the first picture is being drawn.
    tells_of_picture: bool,
    /// The start is over: a picture was presented.
    has_started: bool,
    /// Since when there is no picture to show.
    blank_since: Option<Instant>,
    /// What a screen reader says of the panels, since they were laid out last.
    tree: Option<TreeUpdate>,
    /// When the panels want to be drawn again.
    repaint_at: Option<Instant>,
    /// There was no surface to present to; do not try again before this time.
    present_retry_at: Option<Instant>,
    /// The startup fault, and when to check it next.
    startup_fault: Option<(StartupFault, Instant)>,
    request: LoopRequest,
    /// What can be opened, and what is being opened.
    opening: Opening,
    /// The volume of a recording that was frozen when it was left, until it is there again.
    frozen_volume: Option<u32>,
    /// The settings are those with which the recording was left.
    is_kept: bool,
    /// It came in place of another one.
    follows_another: bool,
    presets: Presets,
    clipboard: Clipboard,
    /// Counts voxels in the background.
    counting: Counting,
    /// Where the first end of a distance on the surface was picked.
    surface_from: Option<DVec3>,
    shaders: Option<Arc<ShaderFolder>>,
    /// Why the picture is not drawn with the shaders as they are in their folder now.
    shader_fault: Option<String>,
    /// Reloads `shaders`.
    _shader_watch: Option<Watch>,
}

/// Options that never change.
struct FixedOptions {
    overlay: bool,
    exit: Option<Chord>,
    is_kiosk: bool,
    warms: bool,
    source: SourceKind,
    /// Everything that arrives is recorded to a file.
    records: bool,
    /// What a workspace keeps of the source.
    origin: Option<Origin>,
    plays_once: bool,
    /// Most volumes of the cine loop.
    cine_volumes: usize,
}

impl Console {
    /// `size`: of the window, pixels.
    pub fn new(context: &Arc<Context>, open: OpenSource, options: ConsoleOptions, size: [u32; 2]) -> Console {
        let now = Instant::now();
        let (kept, display) = options.recordings.lock().unwrap_or_else(|e| e.into_inner()).take_kept();
        let shows_panels = display.map_or(options.panels, |display| display.panels) && options.overlay;
        let (kept, frozen_volume) = kept.map_or((None, None), |kept| (Some(kept.controls), kept.frozen));
        // Settings that were kept are complete.
        let is_kept = kept.is_some();
        let mut chosen = options.chosen.filter(|_| !is_kept);
        let mut settings = options.settings;
        // Saved pictures have their bar unless a file says otherwise, or the window shows another recording without.
        if let Some(layers) = chosen.as_mut().filter(|layers| !layers.has("marks.bar")) {
            settings.marks.bar = display.is_none_or(|display| display.bar);
            // It is a setting: it is not refused.
            let _ = layers.set(&format!("marks.bar={}", settings.marks.bar));
        }
        let mut controls = kept.unwrap_or_else(|| Controls::new(settings));
        controls.resize(panels::picture_area(size, options.scale, shows_panels).1);
        let (rungs, records) = (Arc::new(options.rungs), options.record.is_some());
        let lowered = options.budget.map(|_| {
            let rungs = rungs.clone();
            Arc::new(move |scene: &Scene| frame_budget::lowered(&rungs, scene)) as live::Lowered
        });
        let stream_options = live::StreamOptions {
            update: options.update,
            images: options.images,
            queues: options.queues,
            time_stamps: options.time_stamps,
            readback: false,
            cine: options.cine,
            wake: Some(options.wake.clone()),
            shaders: options.shaders.clone(),
            chosen,
            lowered,
            prepares: true,
            // Full quality always means the first picture too.
            coarse_first: options.budget.is_some(),
            // Without panels, nothing is to be drawn between.
            paced: options.overlay,
        };
        let watch = options.shaders.as_ref().map(|folder| Watch::new(folder, options.wake.clone())).transpose();
        let (shader_watch, watch_fault) = match watch {
            Ok(watch) => (watch, None),
            Err(fault) => (None, Some(fault)),
        };
        let metrics = options.prometheus.as_deref().map(|file| LiveMetrics::new(file, "view")).transpose();
        let (metrics, metrics_fault) = metrics.map_or_else(|fault| (None, Some(fault)), |metrics| (metrics, None));
        let mut console = Console {
            screen: None,
            stream: Stream::new(context, Feed::none(), controls.settings().clone(), stream_options),
            context: context.clone(),
            source: SourceSupervisor::new(open, options.retry, options.record, options.wake.clone()),
            controls,
            gestures: Gestures::default(),
            keys: HeldKeys::default(),
            keyboard_pointer: KeyboardPointer::default(),
            opening: Opening::new(
                options.open_file,
                options.recent,
                options.recordings,
                options.progress,
                options.wake.clone(),
            ),
            frozen_volume,
            is_kept,
            follows_another: display.is_some(),
            presets: Presets::new(options.presets, options.wake.clone()),
            clipboard: Clipboard::default(),
            counting: Counting::new(options.wake.clone()),
            surface_from: None,
            exporter: Exporter::new(options.folder, options.wake),
            pace: Pace::new(options.budget, &rungs, frame_budget::first_rung(context.candidate.has_unified_memory())),
            rungs,
            panels: Panels::new(options.scale),
            times: Times::default(),
            fixed: FixedOptions {
                overlay: options.overlay,
                is_kiosk: options.is_kiosk,
                exit: options.exit,
                warms: options.warms,
                source: options.source,
                records,
                origin: options.origin,
                plays_once: options.plays_once,
                cine_volumes: options.cine.volumes,
            },
            size,
            started: now,
            sent_settings: None,
            quality: Quality::default(),
            rejected_settings: None,
            notes: Vec::new(),
            needs_redraw: true,
            has_new_picture: false,
            live_volumes: 0,
            light_moved: None,
            shown_between: 0,
            shows_help: false,
            shows_times: display.is_some_and(|display| display.times),
            shows_panels,
            rail: Rail::default(),
            help_search: None,
            shows_exports: false,
            turning: None,
            export_progress: None,
            asks_to_leave: false,
            first_steps: FirstSteps::new(options.first_steps),
            leaves_when_saved: None,
            is_full_screen: false,
            saved_volume: None,
            start_lines: Vec::new(),
            fluid: LostFluid::default(),
            pointer: None,
            player: CinePlayer::default(),
            unsent_input: None,
            unshown_input: None,
            last_input: now,
            last_change: now,
            warmed: None,
            statistics_at: now,
            statistics_interval: options.statistics_interval,
            silence: Silence::new(now),
            disconnected: None,
            frames: 0,
            metrics,
            device_faults: 0,
            stall_shown_until: None,
            start_step: None,
            start_step_at: now,
            tells_of_picture: false,
            has_started: false,
            blank_since: None,
            tree: None,
            repaint_at: None,
            present_retry_at: None,
            startup_fault: options.startup_fault.map(|fault| (fault, now + FAULT_CHECK_INTERVAL)),
            request: LoopRequest::default(),
            shaders: options.shaders,
            shader_fault: None,
            _shader_watch: shader_watch,
        };
        for fault in watch_fault.into_iter().chain(metrics_fault) {
            console.notify(&fault, true);
        }
        if display.is_some_and(|display| display.has_focus) && console.shows_panels {
            console.panels.toggle_focus();
        }
        console
    }

    /// Why the picture is not drawn with the shaders as they are in their folder now.
    pub fn shader_fault(&self) -> Option<&str> {
        self.shader_fault.as_deref()
    }

    /// Sets the screen to present to.
    pub(super) fn set_screen(&mut self, screen: Option<Screen>) {
        // Drop the old one first: a window has one surface at a time.
        self.screen = None;
        self.screen = screen;
        self.panels.reset();
        self.needs_redraw = true;
    }

    /// Ends the console and returns its screen for another one.
    pub(super) fn into_screen(mut self) -> Option<Screen> {
        self.screen.take()
    }

    /// Continues on another device, or on the same one opened again. The cine loop is kept; the live picture continues with the next
    /// volume.
    ///
    /// # Errors
    /// The device cannot hold what is shown.
    pub fn revive(&mut self, context: &Arc<Context>, screen: Option<Screen>) -> Result<(), StreamError> {
        self.screen = None;
        self.presets.device_lost();
        self.context = context.clone();
        let revived = self.stream.revive(context);
        self.set_screen(screen);
        match &revived {
            Ok(()) => self.notify(texts::DEVICE_OPENED_AGAIN, false),
            // Opening the source again sends its geometry, from which everything is created.
            Err(fault) => self.source_ended(Some(fault.to_string()), Instant::now()),
        }
        revived
    }

    /// Shows for a while that the device did not finish and was opened again.
    pub(crate) fn show_stall(&mut self, now: Instant) {
        (self.stall_shown_until, self.needs_redraw) = (Some(now + STALL_TIME), true);
    }

    /// Sets the size of the window, pixels; 0 while it is minimised.
    pub fn resize(&mut self, size: [u32; 2]) {
        if let Some(screen) = &mut self.screen {
            screen.resize(size);
        }
        if size.contains(&0) {
            return;
        }
        self.size = size;
        self.resize_picture();
    }

    /// Draws the window again: its content was lost.
    pub fn redraw(&mut self) {
        (self.needs_redraw, self.present_retry_at) = (true, None);
    }

    /// Fits the picture into the area that the panels leave.
    fn resize_picture(&mut self) {
        self.controls.resize(self.picture_area().1);
        self.needs_redraw = true;
    }

    /// Upper left corner and size of the picture, pixels of the window.
    fn picture_area(&self) -> ([u32; 2], [u32; 2]) {
        panels::picture_area(self.size, self.panels.scale(), self.shows_panels)
    }

    /// True if tools and controls are in a drawer.
    fn has_drawer(&self) -> bool {
        panels::has_drawer(self.size, self.panels.scale(), self.shows_panels)
    }

    /// Describes the panels to a screen reader from now on, or no longer.
    pub fn describe(&mut self, is_described: bool) {
        self.panels.describe(is_described && self.fixed.overlay);
        (self.tree, self.needs_redraw) = (None, true);
    }

    #[cfg(feature = "screen-reader")]
    pub(crate) fn is_described(&self) -> bool {
        self.panels.is_described()
    }

    /// What a screen reader says of the panels, if they were laid out since the last call.
    pub fn take_tree(&mut self) -> Option<TreeUpdate> {
        self.tree.take()
    }

    /// Does what a screen reader asks of a control.
    pub fn act(&mut self, request: ActionRequest) {
        self.user_acts(Instant::now());
        self.panels.act(request);
        self.needs_redraw = true;
    }

    /// Sets where to draw a pointer, pixels, if no windowing system draws one.
    pub(super) fn set_pointer(&mut self, at: Option<[f64; 2]>) {
        self.needs_redraw |= self.pointer != at;
        self.pointer = at;
    }

    /// Shows a message for a few seconds and writes it to the log.
    pub(super) fn notify(&mut self, text: &str, is_fault: bool) {
        match is_fault {
            true => tracing::warn!("{text}"),
            false => tracing::info!("{text}"),
        }
        let note = Note { text: text.into(), is_fault };
        self.notes.retain(|(_, known)| *known != note);
        self.notes.push((Instant::now() + NOTE_TIME, note));
        if self.notes.len() > MAX_NOTES {
            self.notes.remove(0);
        }
        self.needs_redraw = true;
    }

    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    pub fn stream(&mut self) -> &mut Stream {
        &mut self.stream
    }

    pub(super) fn screen(&self) -> Option<&Screen> {
        self.screen.as_ref()
    }

    /// What the last settings that were sent to the stream leave out.
    pub fn quality(&self) -> Quality {
        self.quality
    }

    /// Executes a command.
    pub fn execute(&mut self, command: &Command, now: Instant) {
        tracing::debug!("{command:?}");
        self.user_acts(now);
        if self.end_first_steps(command) {
            return;
        }
        self.stop_turning_for(command);
        let before = is_of_tone(command).then(|| self.controls.settings().clone());
        // A drag by keyboard is one step, however long it rests.
        if now.saturating_duration_since(self.last_change) > STEP_PAUSE && !self.keyboard_pointer.is_held() {
            self.controls.seal();
        }
        match self.controls.apply(command, self.stream.scene()) {
            Change::Nothing => return,
            Change::Tool => self.surface_from = None,
            Change::Marks => self.last_change = now,
            Change::Refused(why) => self.notify(why, true),
            Change::Settings => {
                self.last_change = now;
                self.unsent_input.get_or_insert(now);
                if command.is_continuous() {
                    if before.as_ref().is_some_and(|before| before.light != self.controls.settings().light) {
                        self.light_moved = Some(now);
                    }
                    let work = before.map_or(Work::Rays, |before| self.work_since(before));
                    self.pace.moved(work, now);
                } else {
                    // Another scene takes another time.
                    self.pace.forget();
                }
            }
            Change::Caller(command) => self.execute_own(&command, now),
        }
        self.needs_redraw = true;
    }

    /// How much of the picture a change from these settings draws again.
    fn work_since(&self, before: Settings) -> Work {
        let Some(shown) = self.stream.scene() else { return Work::Rays };
        let scene = |settings: Settings| Scene::new(shown.geometry.clone(), shown.input, settings);
        match (scene(before), scene(self.controls.settings().clone())) {
            (Ok(before), Ok(after)) => Work::between(&before, &after),
            _ => Work::Rays,
        }
    }

    /// Executes a command that does not concern settings.
    fn execute_own(&mut self, command: &Command, now: Instant) {
        let count = self.stream.cine().volumes().len();
        if matches!(*command, Command::Freeze | Command::StepCine(_) | Command::SeekCine(_) | Command::PlayCine) {
            self.frozen_volume = None;
        }
        match *command {
            Command::Freeze => {
                self.player.stop();
                self.stream.freeze(!self.stream.is_frozen());
            }
            Command::StepCine(by) => {
                let at = self.stream.cine_position().unwrap_or(count.saturating_sub(1)) as i64 + i64::from(by);
                self.show_cine_volume(at.clamp(0, count.saturating_sub(1) as i64) as usize);
                self.unsent_input.get_or_insert(now);
            }
            Command::SeekCine(index) => {
                self.show_cine_volume(index.min(count.saturating_sub(1)));
                self.unsent_input.get_or_insert(now);
            }
            Command::PlayCine => {
                self.stream.freeze(true);
                self.player.toggle(loop_of(&self.controls, &self.stream), now);
            }
            Command::MarkCine(end) => {
                let at = self.stream.cine_position().unwrap_or(count.saturating_sub(1));
                let volume = self.stream.cine().volumes().get(at).map(|kept| kept.volume);
                if volume.is_some_and(|volume| self.controls.mark_cine(volume, end) == Change::Marks) {
                    self.last_change = now;
                }
            }
            Command::SavePicture => self.save_picture(),
            Command::SaveLoop => _ = self.save_loop(),
            Command::ToggleHelp => (self.shows_help, self.help_search) = (!self.shows_help, None),
            Command::SearchHelp => self.help_search = Some(String::new()),
            Command::ToggleTimes => self.shows_times = !self.shows_times,
            Command::TogglePanels => {
                self.shows_panels = !self.shows_panels && self.fixed.overlay;
                self.resize_picture();
            }
            Command::FocusPanels if self.fixed.overlay => {
                self.shows_panels = true;
                self.resize_picture();
                self.panels.toggle_focus();
            }
            Command::RailTab(_) | Command::SwitchRail | Command::ToggleDrawer => {
                let has_drawer = self.has_drawer();
                self.rail.apply(command, has_drawer);
            }
            Command::KeyboardPointer => self.toggle_keyboard_pointer(now),
            Command::ToggleFullScreen => self.request.toggle_full_screen |= !self.fixed.is_kiosk,
            Command::EndCut => self.end_stroke(now),
            Command::PickSurface(at) => self.pick_surface(at),
            Command::CountVoxels => self.count_voxels(),
            Command::CopyMeasures => self.copy_measures(),
            Command::SaveMeasures => self.save_measures(),
            Command::SaveWorkspace => self.save_workspace(),
            Command::OpenFiles => self.toggle_files(),
            Command::OpenFile(n) => self.open_entry(n),
            Command::Turntable => self.toggle_turning(now),
            Command::ShowRecording(n) => self.show_recording(n),
            Command::StepRecording(by) => self.step_recording(by),
            Command::CloseRecording(n) => self.close_recording(n),
            Command::CancelReading => _ = self.cancel_reading(),
            Command::Exports => self.shows_exports = !self.shows_exports,
            Command::Export(n) => self.export_volume(n),
            Command::CancelExport => self.exporter.cancel_export(),
            Command::Presets => self.toggle_presets(),
            Command::Preset(n) => self.take_preset(n, now),
            Command::NamePreset => self.begin_naming(None),
            Command::RenamePreset(n) => self.begin_naming(Some(n)),
            Command::EndNaming => self.end_naming(),
            Command::DeletePreset(n) => self.delete_preset(n),
            Command::RestorePresets => self.restore_presets(),
            Command::Back => self.go_back(),
            // A kiosk ends only with its exit keys: a sleeve may press Escape.
            Command::Exit if self.fixed.is_kiosk => {}
            // Without panels nobody sees a question.
            Command::Exit if self.fixed.overlay && self.has_unsaved_loop() => self.asks_to_leave = true,
            Command::Exit | Command::Discard => self.request.exit |= !self.fixed.is_kiosk,
            Command::SaveAndExit => {
                self.asks_to_leave = false;
                // The question names all volumes.
                self.controls.apply(&Command::WholeCine, None);
                let newest = self.stream.cine().volumes().back().map(|newest| newest.volume);
                self.leaves_when_saved = newest.filter(|_| self.save_loop());
            }
            _ => {}
        }
    }

    fn show_cine_volume(&mut self, index: usize) {
        self.player.stop();
        self.stream.freeze(true);
        self.stream.show_cine_volume(index);
    }

    /// The cine loop as it is played.
    fn cine_loop(&self) -> Loop<'_> {
        loop_of(&self.controls, &self.stream)
    }

    /// Shows the next volume of the cine loop when it is due.
    fn advance_cine(&mut self, now: Instant) {
        if self.stream.is_replaying() {
            return;
        }
        let shown = self.stream.cine_position();
        if let Some(next) = self.player.advance(loop_of(&self.controls, &self.stream), shown, now) {
            self.stream.show_cine_volume(next);
        }
    }

    /// Closes the uppermost of what is open; else leaves full screen; else leaves the program.
    fn go_back(&mut self) {
        if self.asks_to_leave {
            self.asks_to_leave = false;
        } else if self.opening.is_shown() {
            self.toggle_files();
        } else if self.shows_exports {
            self.shows_exports = false;
        } else if self.leave_presets() {
            self.needs_redraw = true;
        } else if self.help_search.is_some() {
            self.help_search = None;
        } else if self.shows_help {
            self.shows_help = false;
        } else if self.cancel_reading() {
            self.needs_redraw = true;
        } else if self.shows_times {
            self.shows_times = false;
        } else if self.rail.is_open && self.has_drawer() {
            self.rail.is_open = false;
        } else if self.keyboard_pointer.is_on() && self.controls.work().is_none() && self.controls.line().is_none() {
            self.toggle_keyboard_pointer(Instant::now());
        } else if self.leave_measuring() || self.turning.take().is_some() {
            self.needs_redraw = true;
        } else if self.is_full_screen && !self.fixed.is_kiosk {
            self.request.toggle_full_screen = true;
        } else if !self.follows_another || self.started.elapsed() >= ESCAPE_PAUSE {
            self.execute_own(&Command::Exit, Instant::now());
        }
    }

    /// True if volumes of the loop exist nowhere else: neither in a file that they were read from or recorded to, nor in one that was saved.
    fn has_unsaved_loop(&self) -> bool {
        let is_recorded = self.fixed.records && self.stream.feed_counts().unrecorded == 0;
        let is_only_here = matches!(self.fixed.source, SourceKind::Probe | SourceKind::Pipe) && !is_recorded;
        let newest = self.stream.cine().volumes().back().map(|kept| kept.volume);
        is_only_here && newest.is_some() && newest != self.saved_volume
    }

    /// The user asked the windowing system to close the window: asks first if that loses a loop. False if it may be closed at once.
    pub(super) fn asks_before_closing(&mut self) -> bool {
        if self.asks_to_leave || !self.fixed.overlay || !self.has_unsaved_loop() {
            return false;
        }
        (self.asks_to_leave, self.needs_redraw) = (true, true);
        true
    }

    /// Tells whether the window fills the screen and can leave it.
    pub fn set_full_screen(&mut self, is_full_screen: bool) {
        self.is_full_screen = is_full_screen;
    }

    /// True while the console asks whether to save the loop before it leaves.
    pub fn asks_to_leave(&self) -> bool {
        self.asks_to_leave
    }

    /// Leaves the processor to what the user asks for.
    fn user_acts(&mut self, now: Instant) {
        self.last_input = self.last_input.max(now);
        if self.warmed.take().is_some() {
            self.stream.stop_warming();
        }
    }
}

/// The cine loop as it is played.
fn loop_of<'a>(controls: &'a Controls, stream: &'a Stream) -> Loop<'a> {
    Loop { cine: &controls.settings().cine, volumes: stream.cine().volumes() }
}

/// True for continuous commands that may leave the rays as they are.
fn is_of_tone(command: &Command) -> bool {
    use Command::{MoveCrossing, MoveCurvePoint, MoveLight, RotatePlanes, SetSlider, StepPlane, StepSlider};
    matches!(
        command,
        MoveCurvePoint(..)
            | MoveLight(_)
            | StepPlane(_)
            | MoveCrossing(_)
            | RotatePlanes(_)
            | SetSlider(..)
            | StepSlider(..)
    )
}
