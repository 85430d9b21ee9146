//! The console of the live view. It connects the stream with gestures, keys, panels and the screen. It depends on no window: inputs, the time and an
//! optional screen are passed in, so that everything is tested without one.

mod activity;
mod brushing;
mod commands;
mod comparing;
mod connection;
mod faults;
mod first_steps;
mod frame;
mod hands;
mod input;
mod labelling;
mod layout;
mod leaving;
mod looks;
mod measured;
mod measured_on;
mod measuring;
mod notes;
mod opening;
mod options;
mod presentation;
mod presets;
mod quality;
mod reel;
mod render_start;
mod replay;
mod saving;
mod start;
mod surface;
mod survey;
mod switching;
mod turntable;

use self::activity::Activity;
use self::connection::Connection;
use self::faults::Faults;
use self::first_steps::FirstSteps;
use self::hands::Hands;
use self::labelling::LabelWork;
use self::leaving::Leaving;
use self::measured::Measured;
use self::notes::Notes;
use self::opening::Opening;
pub use self::options::{ConsoleOptions, OpenFile, Opened, OpeningOptions, StartupFault, WorldOf};
use self::presentation::Presentation;
use self::presets::Presets;
use self::quality::PictureQuality;
use self::render_start::RenderStart;
use self::replay::Replay;
use self::start::Start;
use self::survey::Survey;
use super::comparison::Comparison;
use super::controls::Controls;
use super::export::Exporter;
use super::frame_budget::{self, Quality};
use super::panels::accesskit::{ActionRequest, TreeUpdate};
use super::panels::{Panels, Room, Visible};
use super::source_supervisor::{OpenSource, SourceSupervisor};
use crate::gpu::window::Screen;
use crate::gpu::{Context, GpuError, Wake};
use crate::kiosk::chord::Chord;
use crate::live::metrics::LiveMetrics;
use crate::live::{Feed, Stream, StreamError, StreamOptions};
use crate::sync::locked;
use crate::texts;
use crate::workspace::Origin;
use std::sync::Arc;
use std::time::Instant;

/// What [`Console::update`] asks of the event loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoopRequest {
    /// Time of the next update if no event comes before; `None`: an event is awaited.
    pub wake_at: Option<Instant>,
    pub exit: bool,
    pub toggle_full_screen: bool,
    /// True if this console has to be replaced by a new one.
    pub restart: bool,
}

/// Why a [`Console`] cannot continue until its caller replaces the device or the screen.
#[derive(Debug, thiserror::Error)]
pub enum ConsoleError {
    /// The device is lost; [`Console::revive`] continues on another one.
    #[error("{0}")]
    DeviceLost(GpuError),
    /// The screen is lost; [`Console::set_screen`] continues on another one.
    #[error("{0}")]
    Screen(GpuError),
}

/// The console: the viewer's live picture, panels and state, without the window. It owns its parts, none of which knows another, and passes
/// between them what they need.
pub struct Console {
    // Fields are dropped in this order: the screen, which is in the first, before the stream whose pictures it shows.
    presentation: Presentation,
    stream: Stream,
    /// The volume that is compared with the shown one.
    comparison: Option<Comparison>,
    context: Arc<Context>,
    connection: Connection,
    quality: PictureQuality,
    controls: Controls,
    hands: Hands,
    activity: Activity,
    panels: Panels,
    visible: Visible,
    notes: Notes,
    leaving: Leaving,
    exporter: Exporter,
    opening: Opening,
    presets: Presets,
    replay: Replay,
    survey: Survey,
    label_work: LabelWork,
    render_start: RenderStart,
    start: Start,
    faults: Faults,
    measured: Measured,
    fixed: Fixed,
    request: LoopRequest,
}

/// What never changes.
struct Fixed {
    started: Instant,
    wake: Wake,
    overlay: bool,
    exit: Option<Chord>,
    is_kiosk: bool,
    /// What a workspace stores of the source.
    origin: Option<Origin>,
    world: Option<WorldOf>,
    plays_once: bool,
    /// Whether the panels have thumbnails of looks and volumes.
    small_pictures: bool,
    /// Most volumes of the cine loop.
    cine_volumes: usize,
    /// Whether the settings are those with which the recording was left.
    is_kept: bool,
    /// Whether this console replaced another one.
    follows_another: bool,
}

impl Console {
    /// A console that opens its source by `open`. `size`: that of the window, pixels.
    pub fn new(context: &Arc<Context>, open: OpenSource, options: ConsoleOptions, size: [u32; 2]) -> Console {
        let now = Instant::now();
        let (kept, display) = locked(&options.opening.recordings).take_kept();
        let (kept, frozen) = kept.map_or((None, None), |kept| (Some(kept.controls), kept.frozen));
        // Settings that were kept are complete.
        let is_kept = kept.is_some();
        let mut chosen = options.stream.chosen.filter(|_| !is_kept);
        let mut settings = options.settings;
        // Saved pictures have their bar unless a file says otherwise, or the window shows another recording without.
        if let Some(layers) = chosen.as_mut().filter(|layers| !layers.has("marks.bar")) {
            settings.drawn.marks.bar = display.is_none_or(|display| display.bar);
            // It is a setting: it is not refused.
            let _ = layers.set(&format!("marks.bar={}", settings.drawn.marks.bar));
        }
        let visible = Visible {
            panels: display.map_or(options.panels, |display| display.panels) && options.overlay,
            times: display.is_some_and(|display| display.times),
            ..Visible::default()
        };
        let mut controls = kept.unwrap_or_else(|| Controls::new(settings));
        controls.resize(Room::of(size, options.scale, visible.panels).picture.1);
        let (wake, is_recorded, world) = (options.wake, options.record.is_some(), options.opening.world.clone());
        let first = frame_budget::first_rung(context.candidate.has_unified_memory());
        let quality = PictureQuality::new(options.budget, options.rungs, first, options.warms);
        let stream_options = StreamOptions {
            readback: false,
            wake: Some(wake.clone()),
            chosen,
            lowered: quality.lowered(),
            prepares: true,
            // Full quality always means the first picture too.
            coarse_first: options.budget.is_some(),
            // Without panels, nothing is to be drawn between.
            paced: options.overlay,
            ..options.stream
        };
        let cine_volumes = stream_options.cine.volumes;
        // The device of a kiosk is for its picture alone.
        let small_pictures = options.small_pictures && options.overlay && !options.is_kiosk;
        let mut faults = Faults::new(options.startup_fault, now);
        let watch_fault = stream_options.shaders.as_ref().and_then(|folder| faults.watch(folder, wake.clone()).err());
        let metrics = options.prometheus.as_deref().map(|file| LiveMetrics::new(file, "view")).transpose();
        let (metrics, metrics_fault) = metrics.map_or_else(|fault| (None, Some(fault)), |metrics| (metrics, None));
        let source = SourceSupervisor::new(open, options.retry, options.record, wake.clone());
        let mut console = Console {
            presentation: Presentation::new(size),
            stream: Stream::new(context, Feed::none(), controls.settings().clone(), stream_options),
            comparison: None,
            context: context.clone(),
            connection: Connection::new(source, options.source, now),
            quality,
            controls,
            hands: Hands::default(),
            activity: Activity::new(now),
            panels: Panels::new(options.scale),
            visible,
            notes: Notes::default(),
            leaving: Leaving::new(options.source, is_recorded),
            exporter: Exporter::new(options.folder, wake.clone()),
            opening: Opening::new(options.opening, wake.clone()),
            presets: Presets::new(options.presets, small_pictures),
            replay: Replay::new(frozen),
            survey: Survey::default(),
            label_work: LabelWork::default(),
            render_start: RenderStart::default(),
            start: Start::new(FirstSteps::new(options.first_steps), now),
            faults,
            measured: Measured::new(options.statistics_interval, metrics, now),
            fixed: Fixed {
                started: now,
                wake: wake.clone(),
                overlay: options.overlay,
                exit: options.exit,
                is_kiosk: options.is_kiosk,
                origin: options.origin,
                world,
                plays_once: options.plays_once,
                small_pictures,
                cine_volumes,
                is_kept,
                follows_another: display.is_some(),
            },
            request: LoopRequest::default(),
        };
        for fault in watch_fault.into_iter().chain(metrics_fault) {
            console.notify(&fault, true);
        }
        if display.is_some_and(|display| display.has_focus) && console.visible.panels {
            console.panels.toggle_focus();
        }
        console
    }

    /// The reason why pictures are not drawn with the present shaders of the watched folder; None if they are.
    pub fn shader_fault(&self) -> Option<&str> {
        self.faults.of_shaders.as_deref()
    }

    /// Sets the screen on which pictures are presented; None: there is none.
    pub(super) fn set_screen(&mut self, screen: Option<Screen>) {
        self.presentation.set_screen(screen);
        self.panels.reset();
    }

    /// Ends the console and returns its screen for the next one.
    pub(super) fn into_screen(mut self) -> Option<Screen> {
        self.presentation.screen.take()
    }

    /// Continues on another device, or on the same one opened again. The cine loop is kept; the live picture continues with the next volume. A
    /// comparison ends.
    ///
    /// # Errors
    /// The device cannot hold the slots of what is shown.
    pub fn revive(&mut self, context: &Arc<Context>, screen: Option<Screen>) -> Result<(), StreamError> {
        self.presentation.screen = None;
        self.comparison = None;
        self.presets.device_lost();
        self.replay.reel.forget();
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

    /// Shows for a while a banner that says that the device hung and was opened again.
    pub(crate) fn show_stall(&mut self, now: Instant) {
        self.faults.show_stall(now);
        self.presentation.redraw();
    }

    /// Sets the size of the window, pixels; 0 while it is minimised.
    pub fn resize(&mut self, size: [u32; 2]) {
        if self.presentation.resize(size) {
            self.resize_picture();
        }
    }

    /// Draws the window again, because its content was lost.
    pub fn redraw(&mut self) {
        self.presentation.content_lost();
    }

    /// Fits the picture into the area that the panels leave.
    fn resize_picture(&mut self) {
        self.controls.resize(self.room().picture.1);
        self.presentation.redraw();
    }

    /// What the panels leave and have in the window.
    fn room(&self) -> Room {
        let room = Room::of(self.presentation.size, self.panels.scale(), self.visible.panels);
        let compared = self.comparison.as_ref().filter(|_| self.fixed.overlay);
        compared.map_or(room, |comparison| room.divided(comparison.shown.tiles()))
    }

    /// Sets whether the panels are described to a screen reader.
    pub fn describe(&mut self, is_described: bool) {
        self.panels.describe(is_described && self.fixed.overlay);
        _ = self.presentation.tree.take();
        self.presentation.redraw();
    }

    #[cfg(feature = "screen-reader")]
    pub(crate) fn is_described(&self) -> bool {
        self.panels.is_described()
    }

    /// The accessibility tree of the panels for a screen reader; None if they were not laid out since the last call.
    pub fn take_tree(&mut self) -> Option<TreeUpdate> {
        self.presentation.tree.take()
    }

    /// Does what a screen reader requests of a control, such as a press.
    pub fn act(&mut self, request: ActionRequest) {
        self.user_acts(Instant::now());
        self.panels.act(request);
        self.presentation.redraw();
    }

    /// Sets the position of the pointer, pixels of the window, if no window system draws it; None: it is not drawn.
    pub(super) fn set_pointer(&mut self, at: Option<[f64; 2]>) {
        self.presentation.set_pointer(at);
    }

    /// Shows a message in the window for a few seconds, and writes it to the log.
    pub(super) fn notify(&mut self, text: &str, is_fault: bool) {
        match is_fault {
            true => tracing::warn!("{text}"),
            false => tracing::info!("{text}"),
        }
        self.notes.add(text, is_fault, Instant::now());
        self.presentation.redraw();
    }

    pub fn controls(&self) -> &Controls {
        &self.controls
    }

    pub fn stream(&mut self) -> &mut Stream {
        &mut self.stream
    }

    pub(super) fn screen(&self) -> Option<&Screen> {
        self.presentation.screen.as_ref()
    }

    /// The quality of the settings that were sent to the stream last.
    pub fn quality(&self) -> Quality {
        self.quality.quality
    }

    /// Leaves the processor to what the user asks for.
    fn user_acts(&mut self, now: Instant) {
        self.activity.acts(now);
        if self.quality.stop_warming() {
            self.stream.stop_warming();
        }
    }
}
