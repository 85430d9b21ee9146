//! `echolume view`.

use super::arriving::Arriving;
use super::look::Look;
use super::report_error::{nanoseconds, read};
use super::shown::{Place, Wanted};
use super::turns::Turns;
use super::{Failure, failed, input, say};
use crate::gpu::shader_reload::ShaderFolder;
use crate::gpu::window::{PresentMode, display};
use crate::gpu::{Context, GpuError, Wake};
use crate::kiosk::config::{self, Config};
use crate::live::cine::Room;
use crate::ui::console::{Amiss, Console, Options};
use crate::ui::quality_ladder::{self, Rung};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

#[derive(clap::Args)]
#[command(
    after_help = "Drag turns, the wheel comes closer, H lists every key. Settings come in layers: defaults, --preset, --scene, then flags and \
                  --set, each overriding the one before.\n\nExamples:\n  \
                  echolume view\n  \
                  echolume view --source sweep.frames --real-time --rounds 100\n  \
                  echolume view --source igtl://localhost:18944 --full-screen\n  \
                  echolume view --source phantom --rate 3 --budget 16ms --report error.json\n  \
                  echolume view --direct --monitor HDMI --size 1920x1080\n  \
                  echolume view --kiosk --config /etc/echolume/echolume.toml"
)]
pub struct View {
    #[command(flatten)]
    source: Arriving,
    #[command(flatten)]
    look: Look,
    /// No way out but the configured keys (Ctrl+Alt+Q); a source or a configuration that fails is tried again for ever, and why is shown
    #[arg(long)]
    kiosk: bool,
    /// Source, screen, keys and files from one file of TOML (tools/kiosk/echolume.toml shows all of it) [default with --kiosk:
    /// /etc/echolume/echolume.toml, where it is there]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["source", "probe", "rate", "real_time", "rounds", "tool", "clip", "spacing", "hole", "motor"])]
    config: Option<PathBuf>,
    /// Fill a monitor
    #[arg(long)]
    full_screen: bool,
    /// The monitor to fill, by part of its name
    #[arg(long, value_name = "NAME")]
    monitor: Option<String>,
    /// On a monitor that no desktop holds, with keys, mice and touch screens straight from the kernel (needs the group input)
    #[arg(long, conflicts_with = "full_screen")]
    direct: bool,
    /// Refreshes of the monitor a second [default: the most at its size; --size gives another]
    #[arg(long, value_name = "HZ", requires = "direct")]
    refresh: Option<f64>,
    /// fifo: each picture with a refresh of the monitor; mailbox: the newest, with less latency
    #[arg(long, value_name = "HOW", default_value = "fifo")]
    present: PresentMode,
    /// The picture alone: no panels, no marks, nothing over it
    #[arg(long)]
    no_ui: bool,
    /// Begin without sliders and buttons (F3 brings them)
    #[arg(long)]
    no_panels: bool,
    /// Size of letters and buttons, 0.5 to 4
    #[arg(long, value_name = "N", default_value_t = 1.0)]
    scale: f32,
    #[command(flatten)]
    turns: Turns,
    /// Time of a picture that is held while the view moves, such as 16ms; none: full quality always
    #[arg(long, value_name = "TIME", default_value = "33ms")]
    budget: String,
    /// The dials to hold it with: an error.json of `echolume report error` [default: built in]
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Volumes that are kept for looking back, at most 1000
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(0..=1000))]
    cine: u32,
    /// MiB of them at most
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=65536))]
    cine_memory: u32,
    /// Write every frame that arrives to this file (.frames)
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Folder for pictures and loops that are saved
    #[arg(long, value_name = "DIR", default_value = ".")]
    save_to: PathBuf,
    /// End after so long, such as 90s or 10m
    #[arg(long = "for", value_name = "TIME")]
    time: Option<humantime::Duration>,
    /// Run with Vulkan validation; any message is a failure
    #[arg(long)]
    validate: bool,
    /// Compile the shaders from this folder instead of using the built-in ones, and again whenever a file there changes; what does not
    /// compile is reported over the picture (needs glslc or glslangValidator)
    #[arg(long, value_name = "DIR")]
    glsl: Option<PathBuf>,
}

impl View {
    pub fn run(mut self) -> Result<(), Failure> {
        if self.kiosk && self.config.is_none() && Path::new(config::USUAL).exists() {
            self.config = Some(config::USUAL.into());
        }
        if self.kiosk {
            // What breaks a cart down is to be read in its log, where the support bundle finds it.
            let usual = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |why| {
                tracing::error!("{why}");
                usual(why);
            }));
        }
        let (kiosk, device) = (self.kiosk, self.look.device.clone());
        let mut place = match self.config() {
            None => self.place()?,
            Some(Ok(config)) => Place::configured(&config)?,
            // Why is shown on the screen.
            Some(Err(_)) if kiosk => Place::configured(&Config::default())?,
            Some(Err(fault)) => return Err(input(fault)),
        };
        if self.direct || place.direct.is_some() {
            place.direct = Some(self.on_monitor(place.direct)?);
        }
        place.shape.full_screen |= self.full_screen;
        place.shape.stays = kiosk;
        place.shape.time = self.time.map(Into::into);
        place.device.validation = self.validate;
        if let Some(device) = device {
            place.device.device = device;
        }
        let mut first = match kiosk {
            true => None,
            // Before a window opens: what cannot be opened now is told where it was typed.
            false => Some(self.wanted()?.opened()?),
        };
        let shaders = self.glsl.as_deref().map(ShaderFolder::open).transpose().map_err(input)?;
        let view = Arc::new(self);
        let make = move |context: &Arc<Context>, size: [u32; 2], factor: f32, wake: Wake| {
            let note = if context.candidate.is_software() { " (software: no GPU is used)" } else { "" };
            say!("device: {}{note}, {}", context.candidate.name, context.candidate.driver.trim());
            let wanted = first.take().map_or_else(|| view.wanted(), Ok);
            let (wanted, amiss) = match wanted {
                Ok(wanted) => (wanted, None),
                Err(failure) => {
                    let why = failure.message();
                    tracing::error!("{why}");
                    (Wanted::nothing(), Some(view.amiss(why)))
                }
            };
            let (open, options) = wanted.options(factor, wake, amiss);
            Console::new(context, open, Options { shaders: shaders.clone(), ..options }, size)
        };
        let ran = place.run(Box::new(make)).map_err(|e| match e {
            GpuError::NoSuchDevice { .. } => input(e),
            e => failed(e),
        });
        finish(ran?)
    }

    /// Where the log goes, if the configuration says.
    pub fn log(&self) -> Option<(PathBuf, u64, u32)> {
        let files = self.config()?.ok()?.files;
        Some((files.log?, u64::from(files.log_size_mb) << 20, files.log_files))
    }

    fn config(&self) -> Option<Result<Config, config::ConfigError>> {
        self.config.as_deref().map(Config::read)
    }

    /// Everything that is wanted, as it is written now.
    fn wanted(&self) -> Result<Wanted, Failure> {
        let usual = Config::default();
        let (mut wanted, exit) = match self.config() {
            Some(config) => {
                let config = config.map_err(input)?;
                (Wanted::configured(&config, &self.look)?, config.keys.exit)
            }
            None => (self.flagged()?, usual.keys.exit),
        };
        let options = &mut wanted.options;
        options.is_kiosk = self.kiosk;
        options.exit = exit.filter(|_| self.kiosk);
        // Without a kiosk the end of the source is the end.
        options.retry = options.retry.or(Some(usual.live.retry)).filter(|_| self.kiosk);
        options.overlay = !self.no_ui;
        (options.images, options.queues) = (self.turns.images, self.turns.queues());
        Ok(wanted)
    }

    /// The same from flags alone.
    fn flagged(&self) -> Result<Wanted, Failure> {
        if let Some(file) = &self.record {
            super::stream::check_record(file, self.source.path())?;
        }
        let options = Options {
            settings: self.look.layers(self.source.is_phantom(), &[])?.finish().map_err(input)?,
            update: self.turns.update()?,
            cine: Room { volumes: self.cine as usize, bytes: (self.cine_memory as usize) << 20 },
            budget: self.budget()?,
            rungs: rungs(self.report.as_deref())?,
            record: self.record.clone(),
            folder: self.save_to.clone(),
            panels: !self.no_panels,
            scale: self.scale,
            ..Options::usual()
        };
        Ok(Wanted { source: Some(self.source.clone()), first: None, options })
    }

    fn place(&self) -> Result<Place, Failure> {
        if !(0.5..=4.0).contains(&self.scale) {
            return Err(input(format!("--scale {}: must lie in 0.5..=4", self.scale)));
        }
        let mut place = Place::usual();
        if self.look.has_size() {
            place.shape.size = self.look.layers(false, &[])?.finish().map_err(input)?.picture.size;
        }
        place.shape.full_screen = self.kiosk || self.monitor.is_some();
        place.shape.monitor = self.monitor.clone();
        place.shape.pace = self.present;
        Ok(place)
    }

    /// The monitor and its mode, as flags say over the configuration.
    fn on_monitor(&self, configured: Option<display::Wanted>) -> Result<display::Wanted, Failure> {
        if let Some(hz) = self.refresh.filter(|hz| !(1.0..=1000.0).contains(hz)) {
            return Err(input(format!("--refresh {hz}: must lie in 1..=1000")));
        }
        let configured = configured.unwrap_or_default();
        let size = match self.look.has_size() {
            true => Some(self.look.layers(false, &[])?.finish().map_err(input)?.picture.size),
            false => configured.size,
        };
        let monitor = self.monitor.clone().or(configured.monitor);
        Ok(display::Wanted { monitor, size, refresh: self.refresh })
    }

    fn budget(&self) -> Result<Option<Duration>, Failure> {
        match self.budget.as_str() {
            "none" => Ok(None),
            time => nanoseconds("--budget", time).map(|ns| Some(Duration::from_nanos(ns as u64))),
        }
    }

    /// What is wrong with the configuration, and a way to know when it is not any more.
    fn amiss(self: &Arc<View>, why: String) -> Amiss {
        let view = self.clone();
        let is_mended = Box::new(move || view.wanted().is_ok());
        Amiss { title: "The configuration cannot be used".into(), why, is_mended }
    }
}

/// The dials that hold a budget.
pub fn rungs(report: Option<&Path>) -> Result<Vec<Rung>, Failure> {
    match report {
        None => Ok(quality_ladder::built_in()),
        Some(file) => {
            quality_ladder::measured(&read(file)?).map_err(|e| failed(format!("--report {}: {e}", file.display())))
        }
    }
}

/// What came of it, in a line; and whether validation was silent.
fn finish((mut console, context): (Console, Arc<Context>)) -> Result<(), Failure> {
    let line = console.summary();
    let unrecorded = console.stream().unrecorded();
    drop(console);
    say!("{line}");
    if unrecorded > 0 {
        return Err(failed(format!("--record: {unrecorded} frames could not be written")));
    }
    match context.messages().first() {
        None => Ok(()),
        Some(first) => Err(failed(format!("validation: {first}"))),
    }
}
