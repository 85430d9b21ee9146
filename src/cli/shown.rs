//! What a view is made of, whether flags or a configuration say so.

use super::arriving::Arriving;
use super::look::Look;
use super::view::rungs;
use super::{Failure, input};
use crate::gpu::window::{PresentMode, display};
use crate::gpu::{Choice, Context, ContextOptions, GpuError, Wake};
use crate::kiosk::config::{Config, Present};
use crate::live::cine::Room;
use crate::source::live::Live;
use crate::ui::console::{Amiss, Console, Options};
use crate::ui::source_supervisor::Open;
use crate::ui::window::{self, Make, Shape};
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

/// Of a window, where nothing else is said, pixels.
const SIZE: [u32; 2] = [1280, 800];

/// The device and the window: what stays as it was at the start.
pub struct Place {
    pub device: ContextOptions,
    pub shape: Shape,
    /// A monitor that no desktop holds, instead of a window.
    pub direct: Option<display::Wanted>,
}

impl Place {
    pub fn usual() -> Place {
        let device = ContextOptions { device: Choice::Best, validation: false };
        let (monitor, pace, time) = (None, PresentMode::Fifo, None);
        let direct = None;
        Place { device, direct, shape: Shape { size: SIZE, full_screen: false, monitor, pace, stays: false, time } }
    }

    /// Runs what is made there until someone leaves.
    ///
    /// # Errors
    /// As of [`window::run`].
    pub fn run(self, make: Box<Make>) -> Result<(Console, Arc<Context>), GpuError> {
        match self.direct {
            None => window::run(&self.device, self.shape, make),
            #[cfg(target_os = "linux")]
            Some(wanted) => {
                // What is typed would otherwise reach the shell behind, and be run there at the end.
                let (pace, time) = (self.shape.pace, self.shape.time);
                let shape = crate::ui::direct::Shape { wanted, pace, grab: true, time };
                crate::ui::direct::run(&self.device, shape, make)
            }
            #[cfg(not(target_os = "linux"))]
            Some(_) => Err(GpuError::Window("--direct is for Linux".into())),
        }
    }

    pub fn configured(config: &Config) -> Result<Place, Failure> {
        let mut place = Place::usual();
        let display = &config.display;
        place.shape.size = display.size;
        place.shape.full_screen = display.full_screen;
        place.shape.monitor = display.monitor.clone();
        place.shape.pace = match display.present {
            Present::Fifo => PresentMode::Fifo,
            Present::Mailbox => PresentMode::Mailbox,
        };
        place.direct = config.display.direct.then(|| display::Wanted {
            monitor: config.display.monitor.clone(),
            size: None,
            refresh: None,
        });
        if let Some(device) = &config.device {
            let Ok(device) = device.parse();
            place.device.device = device;
        }
        Ok(place)
    }
}

/// Everything else.
pub struct Wanted {
    /// None: there is nothing to see.
    pub source: Option<Arriving>,
    /// It was opened before there was a window.
    pub first: Option<Box<dyn Live>>,
    pub options: Options,
}

impl Wanted {
    /// Nothing to see, for a console that only says why; also without a configuration there is a way out.
    pub fn nothing() -> Wanted {
        let exit = Config::default().keys.exit;
        let options = Options { panels: false, exit, is_kiosk: true, ..Options::usual() };
        Wanted { source: None, first: None, options }
    }

    pub fn configured(config: &Config, look: &Look) -> Result<Wanted, Failure> {
        let layers = config.layers().map_err(|e| input(config.refuse(&e.to_string())))?;
        let (live, display, files) = (&config.live, &config.display, &config.files);
        let record = live.record.as_ref().map(|folder| folder.join(format!("echolume-{}.frames", stamp())));
        let options = Options {
            settings: look.layers_over(layers, &[])?.finish().map_err(input)?,
            update: live.update,
            cine: Room { volumes: live.cine_volumes as usize, bytes: (live.cine_memory_mb as usize) << 20 },
            budget: display.budget,
            rungs: rungs(display.report.as_deref())?,
            retry: Some(live.retry),
            record,
            folder: files.pictures.clone().unwrap_or(".".into()),
            panels: display.panels,
            scale: display.scale as f32,
            ..Options::usual()
        };
        Ok(Wanted { source: Some(Arriving::configured(config)?), first: None, options })
    }

    /// With its source open.
    ///
    /// # Errors
    /// Why it cannot be opened.
    pub fn opened(mut self) -> Result<Wanted, Failure> {
        self.first = self.source.as_ref().map(Arriving::open).transpose()?;
        Ok(self)
    }

    /// As the console takes it. `factor`: pixels a point of the window system.
    pub fn options(self, factor: f32, wake: Wake, amiss: Option<Amiss>) -> (Open, Options) {
        let (source, first) = (self.source, Mutex::new(self.first));
        let open: Open = Arc::new(move || match first.lock().unwrap_or_else(|e| e.into_inner()).take() {
            Some(source) => Ok(source),
            None => match source.as_ref().map(Arriving::open) {
                Some(opened) => opened.map_err(Failure::message),
                None => Err("there is no source".into()),
            },
        });
        let scale = self.options.scale * factor;
        (open, Options { scale, wake, amiss, ..self.options })
    }
}

/// Now, as it goes into names of files.
fn stamp() -> String {
    crate::ui::export::stamp(SystemTime::now())
}
