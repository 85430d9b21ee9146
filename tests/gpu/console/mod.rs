//! The console without a screen: input, pictures, and faults.

mod budget;
mod comparing;
mod failures;
mod gestures;
mod idle;
mod kept_picture;
mod keyboard;
mod labelling;
mod metrics;
mod monkey;
mod presets;
mod recordings;
mod render_start;
mod shaders;
mod tasks;
mod turning;
mod warming;

use crate::common::gpu::*;
use crate::common::scenes::settings;
use crate::common::wait;
use crate::live::header;
use crate::live_control::{BOUND, Fed, ROOM};
use echolume::low_level::gpu::{self, Context, Renderer};
use echolume::low_level::live::{StreamOptions, Update, Views};
use echolume::low_level::picture::Picture;
use echolume::low_level::scene::{Layout, Settings};
use echolume::low_level::source::Frame;
use echolume::low_level::source::live::SourceKind;
use echolume::low_level::source::live::{Event, Live};
use echolume::low_level::ui::command::{Command, Tool};
use echolume::low_level::ui::console::{Console, ConsoleError, ConsoleOptions, LoopRequest, OpeningOptions};
use echolume::low_level::ui::frame_budget::{Quality, built_in_ladder};
use echolume::low_level::ui::input::{Button, Input, Key, Modifiers};
use echolume::low_level::ui::source_supervisor::OpenSource;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const CONTROL: Modifiers = Modifiers { shift: false, control: true, alt: false };
pub const SIZE: [u32; 2] = [80, 72];
/// Longer than a view counts as moving after an input.
const LATER: Duration = Duration::from_millis(300);

pub fn plain() -> Settings {
    settings("mode = 'sr'\nslices = { pixels = 40, format = 'r8' }")
}

/// Without a screen, a budget or a second source.
pub fn options() -> ConsoleOptions {
    ConsoleOptions {
        settings: plain(),
        stream: StreamOptions { cine: ROOM, ..StreamOptions::default() },
        statistics_interval: Duration::from_secs(1),
        budget: None,
        rungs: built_in_ladder(),
        retry: None,
        source: SourceKind::Probe,
        record: None,
        prometheus: None,
        folder: std::env::temp_dir(),
        overlay: true,
        panels: false,
        scale: 1.0,
        exit: None,
        is_kiosk: false,
        wake: Arc::new(|| ()),
        origin: None,
        plays_once: false,
        first_steps: None,
        small_pictures: false,
        opening: OpeningOptions::default(),
        presets: None,
        startup_fault: None,
        warms: false,
    }
}

impl Folder {
    /// Waits for the first readable file with this ending.
    pub fn wait<T>(&self, ending: &str, mut read: impl FnMut(&std::path::Path) -> Option<T>) -> T {
        let begun = Instant::now();
        loop {
            assert!(begun.elapsed() < BOUND, "no {ending}");
            let files = std::fs::read_dir(&self.0).into_iter().flatten().flatten().map(|file| file.path());
            if let Some(it) = files.filter(|f| f.extension().is_some_and(|e| e == ending)).find_map(|f| read(&f)) {
                return it;
            }
            wait::poll();
        }
    }
}

/// A body with a round front that differs in every volume.
pub fn body(number: u32) -> Vec<Frame> {
    let tilt = number as usize;
    crate::live::volume(number, |slice, i| {
        let (sample, line) = (i % 64, i / 64);
        let front = 14 + (line.abs_diff(12 + tilt % 3)).pow(2) / 8 + slice.abs_diff(4) * 2 + tilt % 5;
        if sample < front { (i * 7 % 13) as u8 } else { 120 + ((i * 31 + slice * 17) % 90) as u8 }
    })
}

/// A console with its sender of events.
pub struct Desk {
    pub console: Console,
    pub say: Sender<Event>,
}

impl Desk {
    pub fn new(device: &Arc<Context>, options: ConsoleOptions) -> Desk {
        let (say, said) = channel();
        let desk = Desk::of(device, options, Arc::new(Mutex::new(vec![said])));
        Desk { say, ..desk }
    }

    /// Its sources are taken from the end of `sources`; opening fails if there is none.
    pub fn of(device: &Arc<Context>, options: ConsoleOptions, sources: Arc<Mutex<Vec<Receiver<Event>>>>) -> Desk {
        let open: OpenSource = Arc::new(move || match sources.lock().expect("lock").pop() {
            Some(said) => Ok(Box::new(Fed { said, is_recording: false }) as Box<dyn Live>),
            None => Err("no probe".into()),
        });
        Desk { console: Console::new(device, open, options, SIZE), say: channel().0 }
    }

    pub fn begin(&self) {
        self.say.send(Event::Begin(Box::new(header(0.3)))).expect("listens");
    }

    pub fn frames(&self, frames: Vec<Frame>) {
        frames.into_iter().for_each(|frame| self.say.send(Event::Frame(frame)).expect("listens"));
    }

    pub fn tick(&mut self, now: Instant) -> LoopRequest {
        self.console.update(now).expect("the device is there")
    }

    /// The settings of the idle picture.
    pub fn drawn(&self) -> Settings {
        let mut settings = self.console.controls().settings().clone().without_drawings();
        let cuts_planes = settings.mode.is_flat() || settings.layout.has_planes();
        settings.slices.everything |=
            cuts_planes || matches!(self.console.controls().tool(), Tool::Region | Tool::Clip);
        settings
    }

    /// Ticks until all events and inputs are drawn, at a time after any movement.
    pub fn rest(&mut self) -> LoopRequest {
        self.rest_or_lost().expect("the device is there")
    }

    pub fn rest_or_lost(&mut self) -> Result<LoopRequest, ConsoleError> {
        let begun = Instant::now();
        // Sent events take a moment to arrive, without a notification.
        let mut still = 0;
        loop {
            assert!(begun.elapsed() < BOUND, "it does not come to rest");
            let next = self.console.update(Instant::now() + LATER)?;
            let drawn = self.drawn();
            let stream = self.console.stream();
            let is_drawn = stream.scene().is_none_or(|scene| scene.settings == drawn);
            still = if stream.is_idle() && is_drawn { still + 1 } else { 0 };
            if still > 20 {
                return Ok(next);
            }
            if still > 0 {
                wait::poll();
            }
        }
    }

    /// Sends the volume with this number, and returns its picture.
    pub fn live(&mut self, number: u32) -> Picture {
        let before = self.console.stream().volumes_shown();
        self.frames(body(number));
        let begun = Instant::now();
        while self.console.stream().volumes_shown() == before {
            assert!(begun.elapsed() < BOUND, "volume {number} is not shown");
            self.tick(Instant::now() + LATER);
        }
        self.rest();
        self.picture()
    }

    pub fn picture(&mut self) -> Picture {
        let renderer = self.console.stream().renderer().expect("begun");
        assert!(renderer.has_drawn());
        renderer.end_picture().expect("picture")
    }

    pub fn press(&mut self, key: Key) {
        self.console.input(&Input::Key { key, pressed: true });
        self.console.input(&Input::Key { key, pressed: false });
    }

    pub fn held(&mut self, held: Modifiers, key: Key) {
        self.console.input(&Input::Modifiers(held));
        self.press(key);
        self.console.input(&Input::Modifiers(Modifiers::default()));
    }

    /// Drags with the left button; the picture follows.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.console.input(&Input::Moved(from));
        self.console.input(&Input::Button { button: Button::Left, pressed: true });
        for n in 1..=8 {
            let at = [0, 1].map(|a| from[a] + (to[a] - from[a]) * f64::from(n) / 8.0);
            self.console.input(&Input::Moved(at));
            self.tick(Instant::now());
        }
        self.console.input(&Input::Button { button: Button::Left, pressed: false });
    }
}

/// A volume drawn by a separate renderer.
pub fn headless(device: &Arc<Context>, settings: &Settings, frames: &[Frame]) -> Picture {
    let views = Views::new(&header(0.3), settings, Update::Whole).expect("views");
    let scene = views.of(&vec![frames[0].backward; frames.len()]).into_owned();
    let mut renderer = Renderer::new(device, scene, &gpu::RendererOptions::default()).expect("renderer");
    frames.iter().for_each(|f| renderer.frame(f.slice as u32, &f.bytes, 0).expect("frame"));
    renderer.show(0).expect("show");
    renderer.picture().expect("picture")
}
