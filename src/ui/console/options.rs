//! The options of a console.

use crate::files::progress::Progress;
use crate::frame_budget::{Rung, built_in_ladder};
use crate::gpu::Wake;
use crate::kiosk::chord::Chord;
use crate::live::StreamOptions;
use crate::probe::World;
use crate::recordings::OpenRecordings;
use crate::scene::Settings;
use crate::source::live::SourceKind;
use crate::tree::Defaults;
use crate::workspace::Origin;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Options of a [`Console`](super::Console). The default is an interactive window at full quality, without recording; `wake` does nothing.
#[derive(Defaults)]
pub struct ConsoleOptions {
    pub settings: Settings,
    /// Options of the stream: chosen settings, volume images, queues, time stamps, cine loop, and the watched folder of shaders. The console
    /// itself sets those that depend on its window.
    pub stream: StreamOptions,
    /// Time between two statistics in the log and in the display of times.
    #[value(Duration::from_secs(1))]
    pub statistics_interval: Duration,
    /// The frame budget: longest time that a picture may take while the view moves; `None`: no limit.
    pub budget: Option<Duration>,
    /// The rungs of the quality ladder. The first is full quality.
    #[value(built_in_ladder())]
    pub rungs: Vec<Rung>,
    /// Time after which a source that ended or could not be opened is opened again; `None`: it is not.
    pub retry: Option<Duration>,
    /// Kind of the source, for messages.
    pub source: SourceKind,
    /// Path of a file to which all frames that arrive are recorded; `None`: they are not.
    pub record: Option<PathBuf>,
    /// Path of a file with metrics for Prometheus, which is rewritten at intervals; `None`: there is none.
    pub prometheus: Option<PathBuf>,
    /// Folder for files that the user saves or exports.
    #[value(".".into())]
    pub folder: PathBuf,
    /// True if panels, messages and marks are drawn over the picture.
    #[value(true)]
    pub overlay: bool,
    /// True if sliders and buttons are shown at the start.
    #[value(true)]
    pub panels: bool,
    /// Pixels of the window per point, the unit of text and buttons.
    #[value(1.0)]
    pub scale: f32,
    /// The key combination that ends the console at once, also in a kiosk; `None`: there is none.
    pub exit: Option<Chord>,
    pub is_kiosk: bool,
    /// What a workspace stores about the source; `None`: no workspace can be saved.
    pub origin: Option<Origin>,
    /// True if volume numbers of the stream are those of the recording.
    pub plays_once: bool,
    pub opening: OpeningOptions,
    /// Path of an empty file that is created once the hints of the first start are shown; `None`: they are not shown. The console does not check
    /// whether the file exists.
    pub first_steps: Option<PathBuf>,
    /// Path of the file with the user's presets; `None`: the user can save no presets.
    pub presets: Option<PathBuf>,
    /// Called on any thread when [`Console::update`](super::Console::update) has something to do.
    #[value(Arc::new(|| ()))]
    pub wake: Wake,
    /// A fault that prevents the view, so that only its message is shown.
    pub startup_fault: Option<StartupFault>,
    /// True if the pipelines of every mode, layout and preset are compiled in advance while the user does nothing.
    #[value(true)]
    pub warms: bool,
    /// True if thumbnails of presets and of the cine loop's volumes are drawn while the user does nothing. In a kiosk they are not.
    #[value(true)]
    pub small_pictures: bool,
}

/// Options for opening files besides the console's own source.
#[derive(Clone, Default)]
pub struct OpeningOptions {
    /// Opens another recording or workspace; `None`: the user can open none.
    pub open_file: Option<OpenFile>,
    /// The list of open recordings, one of which is shown.
    pub recordings: OpenRecordings,
    /// Progress of opening the console's own source, by which it can also be cancelled.
    pub progress: Progress,
    /// Path of the file with the list of recent files; `None`: the list is not stored.
    pub recent: Option<PathBuf>,
    /// Where the volume of the console's own source is; `None`: in coordinates of its own.
    pub world: Option<WorldOf>,
}

/// A function that reads where a volume is in the world, which may take long; None if its file does not say so.
pub type WorldOf = Arc<dyn Fn() -> Option<World> + Send + Sync>;

/// A function that opens a recording or a workspace, or returns in one line why it cannot. It may take long; [`Progress`] reports how far it is
/// and can cancel it.
pub type OpenFile = Arc<dyn Fn(&Path, &Progress) -> Result<Opened, String> + Send + Sync>;

/// An opened file: a function that makes the next console show it. If it is dropped without a call, nothing changes.
pub type Opened = Box<dyn FnOnce() + Send>;

/// A fault that prevents the view, such as a wrong configuration, and how to check whether it is resolved.
pub struct StartupFault {
    pub title: String,
    pub why: String,
    /// Called every two seconds. Once it returns true, the console asks to be replaced.
    pub is_resolved: Box<dyn Fn() -> bool>,
}
