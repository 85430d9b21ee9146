//! `echolume view`: shows live frames in a window.

use super::view_config::{ConsoleConfig, First, WindowConfig, rungs};
use super::view_open::{OpenedInWindow, Shown, check_later};
use crate::args::{
    SceneArgs, SourceArgs, StreamArgs, check_messages, check_number, check_outputs, device_failure, first_steps,
    parse_nanoseconds, presets_file, recent_list,
};
use crate::files::Lock;
use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::window::{MonitorChoice, PresentMode};
use crate::gpu::{Context, Wake};
use crate::kiosk::config::{self, Config};
use crate::live::StreamOptions;
use crate::live::cine::CineLimits;
use crate::sync::locked;
use crate::terminal::{Failure, failed, input, say};
use crate::ui::console::{Console, ConsoleOptions, OpenFile, Opened, OpeningOptions, StartupFault};
use crate::ui::recordings::{MAX_OPEN, Recordings};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

#[derive(clap::Args)]
#[command(
    after_help = "Drag rotates the view, the wheel zooms, H lists every key. Settings come in layers: defaults, --preset, --scene, then flags and \
                  --set, each overriding the one before.\n\nExamples:\n  \
                  echolume view\n  \
                  echolume view echolume-20261123-231205-1.toml    (a workspace that was saved with Ctrl+S)\n  \
                  echolume view before.mha after.mha\n  \
                  echolume view --source sweep.frames --real-time --rounds 100\n  \
                  echolume view --source igtl://localhost:18944 --full-screen\n  \
                  echolume view --source phantom --rate 3 --budget 16ms --report error.json\n  \
                  echolume view --direct --monitor HDMI --size 1920x1080\n  \
                  echolume view --unseen --size 1920x1080 --for 1m\n  \
                  echolume view --kiosk --config /etc/echolume/echolume.toml"
)]
pub struct View {
    /// A recording, or a workspace (.toml) that was saved in the view; as --source. Of several the first is shown; Ctrl+Page down shows the
    /// next
    #[arg(conflicts_with_all = ["source", "config"])]
    files: Vec<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Segmentation of the recording to show with it (.seg.nrrd): outline and fill on planes, a shell in renderings [default: that of the workspace]
    #[arg(long, value_name = "FILE", conflicts_with = "config")]
    labels: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneArgs,
    /// What was opened in the window since.
    #[arg(skip)]
    opened: OpenedInWindow,
    /// What no other process may write to at the same time.
    #[arg(skip)]
    locks: Arc<Mutex<Vec<(PathBuf, Lock)>>>,
    /// Kiosk mode: only the configured keys (Ctrl+Alt+Q) end it. A failing source or configuration is shown and retried for ever
    #[arg(long)]
    kiosk: bool,
    /// Read source, screen, keys and files from a TOML file (tools/kiosk/echolume.toml shows every key) [default with --kiosk:
    /// /etc/echolume/echolume.toml, if it exists]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source", "probe", "rate", "real_time", "rounds", "tool", "clip", "spacing", "hole", "extent", "freehand_size", "motor"])]
    config: Option<PathBuf>,
    #[command(flatten)]
    screen: ScreenArgs,
    /// Show the picture alone: no panels, no marks, no messages. Leaving asks nothing, also if the loop is not saved
    #[arg(long)]
    no_ui: bool,
    /// Start without sliders and buttons (F3 shows them)
    #[arg(long)]
    no_panels: bool,
    /// Scale of text and buttons, 0.5 to 4
    #[arg(long, value_name = "N", default_value_t = 1.0)]
    scale: f32,
    #[command(flatten)]
    stream: StreamArgs,
    /// Frame budget while the view moves, such as 16ms; none: always full quality
    #[arg(long, value_name = "TIME", default_value = "33ms")]
    budget: String,
    /// Quality steps that hold the budget: an error.json of `echolume report error` [default: built in]
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Number of volumes in the cine loop, at most 1000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=1000))]
    cine: u32,
    /// Memory limit of the cine loop, MiB
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=65536))]
    cine_memory: u32,
    /// Write every frame that arrives to this file (.frames)
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Write metrics in Prometheus' text format every 15 s and at the end, for the textfile collector of its node exporter (name it
    /// *.prom); it overrides `prometheus` of the configuration
    #[arg(long, value_name = "FILE")]
    prometheus: Option<PathBuf>,
    /// Folder for saved pictures and loops
    #[arg(long, value_name = "DIR", default_value = ".")]
    save_to: PathBuf,
    /// End after this time, such as 90s or 10m
    #[arg(long = "for", value_name = "TIME")]
    time: Option<humantime::Duration>,
    /// Run with Vulkan validation; any message is a failure
    #[arg(long)]
    validate: bool,
    /// Compile the shaders from this folder instead of using the built-in ones, and again whenever a file there changes. A shader that
    /// does not compile is reported over the picture (needs glslc or glslangValidator)
    #[arg(long, value_name = "DIR")]
    glsl: Option<PathBuf>,
}

/// Where pictures are presented.
#[derive(clap::Args)]
struct ScreenArgs {
    /// Fill the screen
    #[arg(long)]
    full_screen: bool,
    /// Monitor to fill, by part of its name
    #[arg(long, value_name = "NAME")]
    monitor: Option<String>,
    /// Use a monitor without a desktop (VK_KHR_display); keys, mice and touch screens come from the kernel (needs the group input)
    #[arg(long, conflicts_with = "full_screen")]
    direct: bool,
    /// Present on a surface that nobody sees (VK_EXT_headless_surface), without input: to measure a machine without a monitor. --size is its size
    #[arg(long, conflicts_with_all = ["full_screen", "monitor", "direct", "kiosk", "config"])]
    unseen: bool,
    /// Refresh rate of the monitor [default: the highest at its size; --size selects a size]
    #[arg(long, value_name = "HZ", requires = "direct")]
    refresh: Option<f64>,
    /// fifo: every picture, at the monitor's refresh; mailbox: only the newest picture, with less latency
    #[arg(long, value_name = "HOW", default_value = "fifo")]
    present: PresentMode,
}

impl View {
    pub fn run(self) -> Result<(), Failure> {
        if self.kiosk {
            // Panics go to the log, where the support bundle finds them.
            let usual = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |why| {
                tracing::error!("{why}");
                usual(why);
            }));
        }
        let (kiosk, device) = (self.kiosk, self.scene.device.clone());
        if !kiosk {
            // A kiosk shows its pictures without metrics too, and tries again.
            let read = self.config.is_none().then(|| self.source.path());
            check_outputs(&[("--prometheus", self.prometheus.as_deref())], read)?;
        }
        let locks = self.locks.clone();
        self.lock(&self.config().and_then(Result::ok).unwrap_or_default())?;
        let deadline = self.scene.deadline()?;
        let mut place = match self.config() {
            None => self.place()?,
            Some(Ok(config)) => WindowConfig::configured(&config)?,
            // The console shows the fault.
            Some(Err(_)) if kiosk => WindowConfig::configured(&Config::default())?,
            Some(Err(fault)) => return Err(input(fault)),
        };
        if self.screen.direct || place.direct.is_some() {
            place.direct = Some(self.monitor_request(place.direct)?);
        }
        place.unseen = self.screen.unseen;
        place.shape.full_screen |= self.screen.full_screen;
        place.shape.stays_open = kiosk;
        place.shape.time = self.time.map(Into::into);
        (place.device.validation, place.device.deadline) = (self.validate, deadline);
        if let Some(device) = device {
            place.device.device = device;
        }
        let shaders = self.glsl.as_deref().map(ShaderFolder::open).transpose().map_err(input)?;
        if self.files.len() > MAX_OPEN {
            return Err(input(format!("{} files: at most {MAX_OPEN} are open at once", self.files.len())));
        }
        self.files.iter().skip(1).try_for_each(|file| check_later(file))?;
        let mut first = match kiosk {
            true => None,
            // The source is opened before the window: a fault is then reported in the terminal.
            false => Some(self.console_config()?.begun()?),
        };
        let view = Arc::new(self);
        let make = move |context: &Arc<Context>, size: [u32; 2], factor: f32, wake: Wake| {
            let note = if context.candidate.is_software() { " (software: no GPU is used)" } else { "" };
            say!("device: {}{note}, {}", context.candidate.name, context.candidate.driver.trim());
            let wanted = first.take().map_or_else(|| view.console_config(), Ok);
            let (wanted, startup_fault) = match wanted {
                Ok(wanted) => (wanted, None),
                Err(failure) => {
                    let why = failure.message();
                    tracing::error!("{why}");
                    let mut nothing = ConsoleConfig::nothing();
                    nothing.options.prometheus = view.prometheus.clone();
                    (nothing, Some(view.startup_fault(why)))
                }
            };
            view.list(wanted.source.as_ref());
            let (open, mut options) = wanted.options(factor, wake, startup_fault);
            options.stream.shaders = shaders.clone();
            options.opening.open_file = Some(view.open_file()).filter(|_| !view.kiosk);
            options.opening.recordings = view.opened.recordings.clone();
            Console::new(context, open, options, size)
        };
        let ran = place.run(Box::new(make)).map_err(device_failure);
        let finished = finish(ran?);
        locked(&locks).clear();
        finished
    }

    pub fn is_kiosk(&self) -> bool {
        self.kiosk
    }

    /// True if the files that the program writes are readable by its user alone; false if the configuration lets the umask decide.
    pub fn is_private(&self) -> bool {
        self.config().and_then(Result::ok).is_none_or(|config| config.files.private)
    }

    /// Locks what no other process may write to at the same time, unless this one has it already: the metrics, and the folders of a kiosk.
    fn lock(&self, config: &Config) -> Result<(), Failure> {
        let Config { files, live, .. } = config;
        let folders = [&files.pictures, &live.record].into_iter().flatten().filter(|_| self.kiosk);
        let mut held = locked(&self.locks);
        for place in self.prometheus.as_ref().or(files.prometheus.as_ref()).into_iter().chain(folders) {
            if held.iter().all(|(other, _)| other != place) {
                held.push((place.clone(), Lock::take(place).map_err(failed)?));
            }
        }
        Ok(())
    }

    /// The log that the configuration asks for: its path, the largest size of a file in bytes, and the number of files. None if it asks for none,
    /// there is no configuration, or it cannot be read.
    pub fn log(&self) -> Option<(PathBuf, u64, u32)> {
        let files = self.config()?.ok()?.files;
        Some((files.log?, u64::from(files.log_size_mb) << 20, files.log_files))
    }

    /// The value of `--config`, or the usual path of a kiosk if there is a file.
    fn config_path(&self) -> Option<&Path> {
        let usual = Path::new(config::DEFAULT_PATH);
        self.config.as_deref().or((self.kiosk && usual.exists()).then_some(usual))
    }

    fn config(&self) -> Option<Result<Config, config::ConfigError>> {
        self.config_path().map(Config::read)
    }

    /// The configuration of the console, read anew from the file and the flags.
    fn console_config(&self) -> Result<ConsoleConfig, Failure> {
        let usual = Config::default();
        let (mut wanted, exit) = match self.config().filter(|_| !self.opened.is_some()) {
            Some(config) => {
                let config = config.map_err(input)?;
                // A file with a fault at the start named no place.
                self.lock(&config)?;
                (ConsoleConfig::configured(&config, &self.scene)?, config.keys.exit)
            }
            None => (self.config_from_flags()?, usual.keys.exit),
        };
        let options = &mut wanted.options;
        options.is_kiosk = self.kiosk;
        options.exit = exit.filter(|_| self.kiosk);
        // Only a kiosk reopens a source that ends.
        options.retry = options.retry.or(Some(usual.live.retry)).filter(|_| self.kiosk);
        options.overlay = !self.no_ui;
        options.prometheus = self.prometheus.clone().or(options.prometheus.take());
        (options.stream.images, options.stream.queues) = (self.stream.images, self.stream.queues());
        options.stream.time_stamps = self.stream.time_stamps();
        Ok(wanted)
    }

    /// Begins the list of open recordings with what the program is started with. `source`: of the first console.
    fn list(&self, source: Option<&SourceArgs>) {
        let mut recordings = locked(&self.opened.recordings);
        if let Some(source) = source.filter(|_| recordings.is_empty()) {
            *recordings = Recordings::of(source.kind(), self.files.first().map_or(source.path(), PathBuf::as_path));
            self.files.iter().skip(1).for_each(|file| _ = recordings.add(file));
        }
    }

    /// Opens a file for the next console.
    fn open_file(self: &Arc<View>) -> OpenFile {
        let view = self.clone();
        Arc::new(move |file, _| view.open(file).map_err(Failure::message))
    }

    /// Opens a recording of the list, or a file.
    fn open(&self, file: &Path) -> Result<Opened, Failure> {
        let is_it = |given: &Path| given == file || std::path::absolute(given).is_ok_and(|given| given == file);
        let shown = match self.files.iter().find(|given| is_it(given)) {
            Some(given) => Shown::of(&self.source, Some(given))?,
            None if self.config.is_none() && is_it(self.source.path()) => Shown::of(&self.source, None)?,
            None => match self.config().transpose().map_err(input)? {
                // The source of the configuration is shown with its settings.
                Some(config) if is_it(SourceArgs::from_config(&config)?.path()) => {
                    return Ok(self.opened.next(None, SourceArgs::from_config(&config)?.open()?));
                }
                _ => Shown::opened(&self.source, file)?,
            },
        };
        let source = shown.source.open()?;
        Ok(self.opened.next(Some(shown), source))
    }

    /// The configuration of the console from the flags alone.
    fn config_from_flags(&self) -> Result<ConsoleConfig, Failure> {
        let Shown { source, workspace, labels, is_given } = match self.opened.shown() {
            Some(shown) => shown,
            None => Shown::of(&self.source, self.files.first().map(PathBuf::as_path))?,
        };
        if let Some(file) = &self.record {
            super::stream::check_record(file, source.path())?;
        }
        let is_complete = workspace.is_some();
        let mut layers = match workspace {
            // The flags are about what the program was started with.
            Some(layers) if !is_given => layers,
            Some(layers) => self.scene.layers_over(layers, &[])?,
            None => self.scene.layers(source.is_phantom(), &[])?,
        };
        let labels = self.labels.clone().filter(|_| is_given).or(labels);
        if let Some(file) = &labels {
            source.show_labels(&mut layers, file)?;
        }
        let (mut origin, placed) = (source.origin(), source.clone());
        origin.labels = labels.map(|file| std::path::absolute(&file).unwrap_or(file));
        let options = ConsoleOptions {
            settings: layers.clone().finish().map_err(input)?,
            stream: StreamOptions {
                // The settings of a workspace are complete.
                chosen: Some(layers).filter(|_| !is_complete),
                update: self.stream.update()?,
                cine: CineLimits { volumes: self.cine as usize, bytes: (self.cine_memory as usize) << 20 },
                ..StreamOptions::default()
            },
            origin: Some(origin),
            plays_once: source.plays_once(),
            opening: OpeningOptions {
                recent: recent_list().filter(|_| !self.kiosk),
                world: Some(Arc::new(move || placed.world())),
                ..OpeningOptions::default()
            },
            first_steps: first_steps().filter(|_| !self.kiosk && !self.no_ui && !self.no_panels),
            presets: presets_file().filter(|_| !self.kiosk),
            budget: self.budget()?,
            rungs: rungs(self.report.as_deref())?,
            record: self.record.clone(),
            folder: self.save_to.clone(),
            panels: !self.no_panels,
            scale: self.scale,
            ..ConsoleOptions::default()
        };
        let first = self.opened.take_source().map(First::Open);
        Ok(ConsoleConfig { source: Some(source), first, options })
    }

    fn place(&self) -> Result<WindowConfig, Failure> {
        if !(0.5..=4.0).contains(&self.scale) {
            return Err(input(format!("--scale {}: must lie in 0.5..=4", self.scale)));
        }
        let mut place = WindowConfig::usual();
        if self.scene.has_size() {
            place.shape.size = self.scene.layers(false, &[])?.finish().map_err(input)?.picture.size;
        }
        place.shape.full_screen = self.kiosk || self.screen.monitor.is_some();
        place.shape.monitor = self.screen.monitor.clone();
        place.shape.present_mode = self.screen.present;
        Ok(place)
    }

    /// The monitor and its mode. Flags override the configuration.
    fn monitor_request(&self, configured: Option<MonitorChoice>) -> Result<MonitorChoice, Failure> {
        check_number("--refresh", self.screen.refresh, |hz| (1.0..=1000.0).contains(&hz), "must lie in 1..=1000")?;
        let configured = configured.unwrap_or_default();
        let size = match self.scene.has_size() {
            true => Some(self.scene.layers(false, &[])?.finish().map_err(input)?.picture.size),
            false => configured.size,
        };
        let monitor = self.screen.monitor.clone().or(configured.monitor);
        Ok(MonitorChoice { monitor, size, refresh: self.screen.refresh })
    }

    fn budget(&self) -> Result<Option<Duration>, Failure> {
        match self.budget.as_str() {
            "none" => Ok(None),
            time => parse_nanoseconds("--budget", time).map(|ns| Some(Duration::from_nanos(ns as u64))),
        }
    }

    /// The fault of the configuration, and a test for when it is gone.
    fn startup_fault(self: &Arc<View>, why: String) -> StartupFault {
        let view = self.clone();
        let is_resolved = Box::new(move || view.console_config().is_ok());
        StartupFault { title: "The configuration cannot be used".into(), why, is_resolved }
    }
}

/// Prints the summary. Fails on lost recordings and on validation messages.
fn finish((mut console, context): (Console, Arc<Context>)) -> Result<(), Failure> {
    console.end_metrics();
    let (line, not_opened) = (console.summary(), console.source_fault());
    let unrecorded = console.stream().feed_counts().unrecorded;
    drop(console);
    say!("{line}");
    if let Some(why) = not_opened {
        return Err(input(why));
    }
    if unrecorded > 0 {
        return Err(failed(format!("--record: {unrecorded} frames could not be written")));
    }
    check_messages(&context)
}
