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

/// The options with which a console is created.
pub struct ConsoleOptions {
    pub settings: Settings,
    /// Options of the stream: chosen settings, volume images, queues, time stamps, cine loop, and the watched folder of shaders. The console sets
    /// what depends on its window.
    pub stream: StreamOptions,
    /// Interval of the statistics in the log and in the display of times.
    pub statistics_interval: Duration,
    /// The frame budget: longest time of a picture while the view moves.
    pub budget: Option<Duration>,
    /// The quality ladder, from full quality down.
    pub rungs: Vec<Rung>,
    /// Time before a source that ended is opened again; `None`: the end of the source is final.
    pub retry: Option<Duration>,
    /// Where the frames come from, for messages.
    pub source: SourceKind,
    /// A file for all frames that arrive.
    pub record: Option<PathBuf>,
    /// A file for metrics of Prometheus, which is rewritten at intervals.
    pub prometheus: Option<PathBuf>,
    /// The folder for saved pictures and loops.
    pub folder: PathBuf,
    /// Whether panels, notes and marks are drawn over the picture.
    pub overlay: bool,
    /// Whether sliders and buttons are shown at the start.
    pub panels: bool,
    /// Pixels per point.
    pub scale: f32,
    /// The keys that end a kiosk, if any.
    pub exit: Option<Chord>,
    pub is_kiosk: bool,
    /// What a workspace stores of the source; `None`: no workspace can be saved.
    pub origin: Option<Origin>,
    /// Whether the volumes of the source are numbered as in its recording.
    pub plays_once: bool,
    pub opening: OpeningOptions,
    /// The file that records that the hints of the first start were shown; `None`: they are never shown.
    pub first_steps: Option<PathBuf>,
    /// The file with the presets of the user.
    pub presets: Option<PathBuf>,
    /// Called when [`Console::update`] has something to do.
    pub wake: Wake,
    /// A fault that prevents the view: only its message is shown.
    pub startup_fault: Option<StartupFault>,
    /// Whether the pipelines of every mode, layout and preset are compiled in advance while the user rests.
    pub warms: bool,
    /// Whether thumbnails of looks and of the loop's volumes are made while the user rests. A kiosk makes none.
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

/// The files that can be opened besides the console's own source.
#[derive(Clone, Default)]
pub struct OpeningOptions {
    /// Opens another recording or workspace; `None`: none can be opened.
    pub open_file: Option<OpenFile>,
    /// The open recordings, one of which is shown.
    pub recordings: OpenRecordings,
    /// Progress of opening the console's own source.
    pub progress: Progress,
    /// The file with the list of recent files.
    pub recent: Option<PathBuf>,
}

/// Opens a recording or a workspace, or returns the reason in one line. It may take long; [`Progress`] reports how far it is and can cancel it.
pub type OpenFile = Arc<dyn Fn(&Path, &Progress) -> Result<Opened, String> + Send + Sync>;

/// An opened file. Called when the console asks to be replaced: the next one shows the file. Nothing changes if it is dropped.
pub type Opened = Box<dyn FnOnce() + Send>;

/// A fault that prevents the view, such as a wrong configuration, and how to find out that it is resolved.
pub struct StartupFault {
    pub title: String,
    pub why: String,
    /// Called every two seconds. When it returns true, the console asks to be replaced.
    pub is_resolved: Box<dyn Fn() -> bool>,
}
