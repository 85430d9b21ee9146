//! The configuration of a view: device, window and console, from flags or from a configuration file.

use crate::args::{SceneArgs, SourceArgs, pipeline_folder};
use crate::baselines::Stored;
use crate::error_report::Report;
use crate::gpu::window::{MonitorChoice, Target};
use crate::gpu::{Context, ContextOptions, GpuError, Wake};
use crate::kiosk::config::Config;
use crate::live::StreamOptions;
use crate::live::cine::CineLimits;
use crate::source::live::Live;
use crate::source::live::SourceKind;
use crate::sync::locked;
use crate::terminal::{Failure, failed, input};
use crate::ui::console::{Console, ConsoleOptions, StartupFault};
use crate::ui::export::timestamp;
use crate::ui::frame_budget::{Rung, built_in_ladder, measured_ladder};
use crate::ui::source_supervisor::OpenSource;
use crate::ui::window::{self, MakeConsole, WindowOptions};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime};

/// Default size of the window, pixels.
const DEFAULT_SIZE: [u32; 2] = [1280, 800];

/// A source that takes longer to be opened is waited for in the window. What opens sooner and cannot be opened is a fault in the terminal.
const WINDOW_AFTER: Duration = Duration::from_secs(1);
const PANICKED: &str = "the thread that opens the source panicked";

/// The device and the window of the viewer, which stay the same for the whole run.
pub struct WindowConfig {
    pub device: ContextOptions,
    pub shape: WindowOptions,
    /// The monitor to draw on directly, without a window system. None: a window.
    pub direct: Option<MonitorChoice>,
    /// Present on a surface of the window's size that nobody sees.
    pub unseen: bool,
}

impl WindowConfig {
    /// The default: the best device, and a window of [`DEFAULT_SIZE`].
    pub fn usual() -> WindowConfig {
        let device = ContextOptions { pipeline_cache: pipeline_folder(), ..ContextOptions::default() };
        let shape = WindowOptions { size: DEFAULT_SIZE, ..WindowOptions::default() };
        WindowConfig { device, shape, direct: None, unseen: false }
    }

    /// Opens the window and runs the console (the viewer's user interface) that `make` creates, until the user leaves it or the time in `shape` is
    /// over. Returns the console and its last context.
    ///
    /// # Errors
    /// There is no window system or no such monitor, no device can present there, the input devices of a direct monitor cannot be read, or the device
    /// or the monitor is lost repeatedly.
    pub fn run(self, make: Box<MakeConsole>) -> Result<(Console, Arc<Context>), GpuError> {
        let unseen = self.unseen.then_some(Target::Unseen(self.shape.size));
        match unseen.or(self.direct.map(Target::Monitor)) {
            None => window::run(&self.device, self.shape, make),
            #[cfg(target_os = "linux")]
            Some(target) => {
                let (present_mode, time) = (self.shape.present_mode, self.shape.time);
                let options = crate::ui::direct::DirectOptions { target, present_mode, time };
                crate::ui::direct::run(&self.device, options, make)
            }
            #[cfg(not(target_os = "linux"))]
            Some(_) => Err(GpuError::Window("--direct and --unseen are for Linux".into())),
        }
    }

    /// The device and the window that a configuration asks for.
    pub fn configured(config: &Config) -> Result<WindowConfig, Failure> {
        let mut place = WindowConfig::usual();
        let display = &config.display;
        place.shape.size = display.size;
        place.shape.full_screen = display.full_screen;
        place.shape.monitor = display.monitor.clone();
        place.shape.present_mode = display.present;
        let choice = MonitorChoice { monitor: display.monitor.clone(), ..MonitorChoice::default() };
        place.direct = display.direct.then_some(choice);
        if let Some(device) = &config.device {
            let Ok(device) = device.parse();
            place.device.device = device;
        }
        Ok(place)
    }
}

/// A source whose opening began before the window was opened.
pub enum First {
    Open(Box<dyn Live>),
    /// Another thread is opening the source, and sends it when it is open.
    BeingOpened(Receiver<Result<Box<dyn Live>, Failure>>),
}

/// The source, and the options of the console (the viewer's user interface). A kiosk makes it again from its configuration after a fault.
pub struct ConsoleConfig {
    /// The source of frames. None: the console shows only a message.
    pub source: Option<SourceArgs>,
    /// The source itself, if it was opened before the window or another thread is opening it.
    pub first: Option<First>,
    pub options: ConsoleOptions,
}

impl ConsoleConfig {
    /// A console without a source, which shows only a message. The default exit keys work.
    pub fn nothing() -> ConsoleConfig {
        let exit = Config::default().keys.exit;
        let options = ConsoleOptions { panels: false, exit, is_kiosk: true, ..ConsoleOptions::default() };
        ConsoleConfig { source: None, first: None, options }
    }

    /// The console that a configuration asks for. The flags in `scene` take precedence over the settings of the configuration.
    ///
    /// # Errors
    /// A preset, a setting or a key of the source is wrong, or the report for the quality ladder cannot be read.
    pub fn configured(config: &Config, scene: &SceneArgs) -> Result<ConsoleConfig, Failure> {
        let layers = config.layers().map_err(|e| input(config.flag_error(&e.to_string())))?;
        let (live, display, files) = (&config.live, &config.display, &config.files);
        let record =
            live.record.as_ref().map(|folder| folder.join(format!("echolume-{}.frames", timestamp(SystemTime::now()))));
        let layers = scene.layers_over(layers, &[])?;
        let options = ConsoleOptions {
            settings: layers.clone().finish().map_err(input)?,
            stream: StreamOptions {
                chosen: Some(layers),
                update: live.update,
                cine: CineLimits { volumes: live.cine_volumes as usize, bytes: (live.cine_memory_mb as usize) << 20 },
                ..StreamOptions::default()
            },
            budget: display.budget,
            rungs: rungs(display.report.as_deref())?,
            retry: Some(live.retry),
            record,
            folder: files.pictures.clone().unwrap_or(".".into()),
            prometheus: files.prometheus.clone(),
            panels: display.panels,
            scale: display.scale as f32,
            ..ConsoleOptions::default()
        };
        Ok(ConsoleConfig { source: Some(SourceArgs::from_config(config)?), first: None, options })
    }

    /// Begins to open the source on a thread, and waits for it for one second. In the returned configuration, `first` is the open source or, if
    /// opening takes longer, the channel on which the thread sends it; the window then shows the progress. Does nothing without a source, or if
    /// `first` is set.
    ///
    /// # Errors
    /// Opening the source failed within that second, or no thread can be started.
    pub fn begun(mut self) -> Result<ConsoleConfig, Failure> {
        let Some(source) = self.source.clone().filter(|_| self.first.is_none()) else { return Ok(self) };
        let (sender, opened) = channel();
        let progress = self.options.opening.progress.clone();
        let work = move || {
            // The receiver may be gone.
            let _ = sender.send(progress.during(|| source.open()));
        };
        let thread = std::thread::Builder::new().name("opening".into()).spawn(work);
        thread.map_err(|e| failed(format!("a thread cannot be started: {e}")))?;
        self.first = Some(match opened.recv_timeout(WINDOW_AFTER) {
            Ok(source) => First::Open(source?),
            Err(RecvTimeoutError::Timeout) => First::BeingOpened(opened),
            Err(RecvTimeoutError::Disconnected) => return Err(failed(PANICKED)),
        });
        Ok(self)
    }

    /// A function that opens the source, and the options of the console. `factor`: pixels per point of the window system. `wake`: wakes the
    /// event loop.
    pub fn options(self, factor: f32, wake: Wake, startup_fault: Option<StartupFault>) -> (OpenSource, ConsoleOptions) {
        let scale = self.options.scale * factor;
        let kind = self.source.as_ref().map_or(SourceKind::default(), SourceArgs::kind);
        let (source, first, progress) = (self.source, Mutex::new(self.first), self.options.opening.progress.clone());
        let open: OpenSource = Arc::new(move || {
            let first = locked(&first).take();
            let opened = match (first, &source) {
                (Some(First::Open(source)), _) => Ok(source),
                (Some(First::BeingOpened(opened)), _) => opened.recv().unwrap_or_else(|_| Err(failed(PANICKED))),
                (None, Some(source)) => progress.during(|| source.open()),
                (None, None) => Err(failed("there is no source")),
            };
            opened.map_err(Failure::message)
        });
        (open, ConsoleOptions { scale, source: kind, wake, startup_fault, ..self.options })
    }
}

/// The quality ladder: changes of settings, from full quality to the fastest, of which a moving view chooses one to meet the frame budget. `report`:
/// file of the error report that states them; None: the built-in ladder. An error if the report cannot be read or gives no ladder.
pub fn rungs(report: Option<&Path>) -> Result<Vec<Rung>, Failure> {
    match report {
        None => Ok(built_in_ladder()),
        Some(file) => {
            let report = Report::load(file).map_err(input)?;
            measured_ladder(&report).map_err(|e| failed(format!("--report {}: {e}", file.display())))
        }
    }
}
