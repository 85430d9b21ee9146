//! The options of a console.

use crate::files::progress::Progress;
use crate::frame_budget::{Rung, built_in_ladder};
use crate::gpu::Wake;
use crate::kiosk::chord::Chord;
use crate::live::StreamOptions;
use crate::recordings::OpenRecordings;
use crate::scene::Settings;
use crate::source::live::SourceKind;
use crate::workspace::Origin;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// What a console is created with.
pub struct ConsoleOptions {
    pub settings: Settings,
    /// Of the stream: what was chosen of the settings, volume images, queues, time stamps, the cine loop, and shaders, whose folder is watched. The console sets
    /// what follows from its window.
    pub stream: StreamOptions,
    /// Interval of the statistics in the log and in the display of times.
    pub statistics_interval: Duration,
    /// The frame budget: longest time of a picture while the view moves.
    pub budget: Option<Duration>,
    /// The quality ladder, from full quality down.
    pub rungs: Vec<Rung>,
    /// How long to wait before a source that ended is opened again. None: the end of the source is final.
    pub retry: Option<Duration>,
    /// Where the frames come from, for messages.
    pub source: SourceKind,
    /// A file for all frames that arrive.
    pub record: Option<PathBuf>,
    /// A file for metrics of Prometheus, which is rewritten at intervals.
    pub prometheus: Option<PathBuf>,
    /// The folder for saved pictures and loops.
    pub folder: PathBuf,
    /// Draws panels, notes and marks over the picture.
    pub overlay: bool,
    /// Shows sliders and buttons at the start.
    pub panels: bool,
    /// Pixels per point.
    pub scale: f32,
    /// The keys that end a kiosk, if any.
    pub exit: Option<Chord>,
    pub is_kiosk: bool,
    /// What a workspace keeps of the source. None: it cannot be saved.
    pub origin: Option<Origin>,
    /// The volumes of the source are numbered as in its recording.
    pub plays_once: bool,
    pub opening: OpeningOptions,
    /// The file that keeps that the hints of the first start were shown. None: they are not to be shown.
    pub first_steps: Option<PathBuf>,
    /// The file with the presets of the user.
    pub presets: Option<PathBuf>,
    /// Called when [`Console::update`] has something to do.
    pub wake: Wake,
    /// A fault that prevents the view: only its message is shown.
    pub startup_fault: Option<StartupFault>,
    /// Compiles the pipelines of every mode, layout and preset in advance while the user rests.
    pub warms: bool,
    /// While the user rests, makes small pictures of looks and of the volumes of the loop for the panels. A kiosk makes none.
    pub small_pictures: bool,
}

impl Default for ConsoleOptions {
    /// An interactive window at full quality, without recording. `wake` does nothing.
    fn default() -> ConsoleOptions {
        ConsoleOptions {
            settings: Settings::default(),
            stream: StreamOptions::default(),
            statistics_interval: Duration::from_secs(1),
            budget: None,
            rungs: built_in_ladder(),
            retry: None,
            source: SourceKind::default(),
            record: None,
            prometheus: None,
            folder: ".".into(),
            overlay: true,
            panels: true,
            scale: 1.0,
            exit: None,
            is_kiosk: false,
            origin: None,
            plays_once: false,
            opening: OpeningOptions::default(),
            first_steps: None,
            presets: None,
            wake: Arc::new(|| ()),
            startup_fault: None,
            warms: true,
            small_pictures: true,
        }
    }
}

/// What else can be opened than the source of the console.
#[derive(Clone, Default)]
pub struct OpeningOptions {
    /// How another recording or workspace is opened. None: none is.
    pub open_file: Option<OpenFile>,
    /// The recordings that are open, of which one is shown.
    pub recordings: OpenRecordings,
    /// How far the source of the console is read while it is being opened.
    pub progress: Progress,
    /// The file with the list of recent files.
    pub recent: Option<PathBuf>,
}

/// Opens a recording or a workspace, or returns the reason in one line. It may take long; how far it is is in the progress, by which it can be
/// ended.
pub type OpenFile = Arc<dyn Fn(&Path, &Progress) -> Result<Opened, String> + Send + Sync>;

/// What was opened. Called when the console asks to be replaced: the next one shows it. Dropped, nothing changes.
pub type Opened = Box<dyn FnOnce() + Send>;

/// A fault that prevents the view, such as a wrong configuration, and how to find out that it is resolved.
pub struct StartupFault {
    pub title: String,
    pub why: String,
    /// Called every two seconds. When it returns true, the console asks to be replaced.
    pub is_resolved: Box<dyn Fn() -> bool>,
}
