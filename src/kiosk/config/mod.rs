//! Everything that a cart is told, in one file of TOML. `tools/kiosk/echolume.toml` shows all of it.
//!
//! Every key may be left out. Paths are relative to the folder of the file. What cannot be meant is refused in one line that names the
//! file, the line, the key, and what is allowed.

mod error;
mod flags;

pub use error::ConfigError;

use super::chord::Chord;
use crate::live::Update;
use crate::scene::Settings;
use crate::scene::load::{self, Layers, LoadError, transfer_file};
use error::{Places, allowed};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Where the service looks for its configuration.
pub const USUAL: &str = "/etc/echolume/echolume.toml";
/// Where the configuration that comes with the program has the log.
pub const USUAL_LOG: &str = "/var/log/echolume/echolume.log";
/// The source that needs no file.
pub const PHANTOM: &str = "phantom";

/// The configuration of a cart.
///
/// Where frames come from is said by the keys at the top, which are the flags of `echolume stream` with `_` for `-` and are checked
/// where those are; the rest stands in tables.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// `phantom` (the default), a recording, or `igtl://HOST[:PORT]`.
    pub source: String,
    /// Geometry of the probe (TOML), where the source does not bring its own. Default: none.
    pub probe: Option<PathBuf>,
    /// Volumes a second of a recording or the phantom, above 0, at most 1e6. Default: as fast as they are taken; the phantom 1.
    pub rate: Option<f64>,
    /// Play a recording as it was stamped. Default: false.
    pub real_time: bool,
    /// Times that a recording is played, 1 or more. Default: 1.
    pub rounds: Option<u32>,
    /// Play a recording over and over, as a demonstration does. Default: false.
    #[serde(rename = "loop")]
    pub forever: bool,
    /// OpenIGTLink: whose TRANSFORM, or which tool of TDATA, places 2D frames; `image`: their own matrix. Default: any TRANSFORM.
    pub tool: Option<String>,
    /// The part of each tracked frame that is ultrasound, pixels: x, y, width, height. Default: all of it.
    pub clip: Option<[u32; 4]>,
    /// Distance between the voxels that tracked frames are compounded into, 0.01 to 1000 mm. Default: between the frames' pixels.
    pub spacing: Option<f64>,
    /// Widest gap between tracked frames that is bridged, 0 to 1000 mm. Default: 2.
    pub hole: Option<f64>,
    /// Presets of the scene, each over the one before. Default: none.
    pub preset: Vec<String>,
    /// Vulkan device, by number or part of its name. Default: the best.
    pub device: Option<String>,
    /// The motor that turns the array. Default: none.
    pub motor: Option<Motor>,
    /// What a scene file holds, over the presets. Default: nothing.
    pub scene: toml::Table,
    pub display: Display,
    pub keys: Keys,
    pub live: Live,
    pub files: Files,
    /// Of the file itself.
    #[serde(skip)]
    places: Places,
}

/// The motor of the probe: the flags of `echolume stream --motor`. `port` and `sweeps` are needed.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Motor {
    /// Serial port.
    pub port: Option<String>,
    /// Sweep from end to end, degrees. Default: a twentieth wider than the frames lie.
    pub angle: Option<f64>,
    /// Passes over the angle, and so volumes, a second.
    pub sweeps: Option<f64>,
    /// Home was found before and the module has not been off since. Default: false.
    pub homed: bool,
    /// From a frame's last line to its arrival here, 0 to 10000 ms. Default: 0.
    pub delay: Option<f64>,
    /// Frames are stamped with the time of their first line by this machine's clock. Default: false.
    pub stamps: bool,
    /// Bits a second, 300 to 4000000. Default: 9600.
    pub baud: Option<u32>,
    /// `none`, `even` or `odd`. Default: none.
    pub parity: Option<String>,
    /// 1 or 2. Default: 1.
    pub stop_bits: Option<u8>,
    /// Longest wait for a reply, 20 to 10000 ms. Default: 500.
    pub timeout: Option<u64>,
}

/// The screen.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Display {
    /// Default: true.
    pub full_screen: bool,
    /// The screen itself (VK_KHR_display), without a window system. Default: false.
    pub direct: bool,
    /// A part of the name of the monitor. Default: the first.
    pub monitor: Option<String>,
    /// Of a window that is not full-screen, pixels, each edge 64 to 16384. Default: 1280 x 800.
    pub size: [u32; 2],
    /// Default: fifo.
    pub present: Present,
    /// Sliders and buttons are there from the start. Default: true.
    pub panels: bool,
    /// Of letters and what is pressed, 0.5 to 4. Default: 1.
    pub scale: f64,
    /// Longest time that a picture may take while the view moves, 1 ms to 10 s; none where the file says `none`. Default: 33 ms.
    #[serde(with = "optional_duration")]
    pub budget: Option<Duration>,
    /// The error.json of `echolume report error` that the budget is kept by. Default: dials that are built in.
    pub report: Option<PathBuf>,
}

/// How pictures reach the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Present {
    /// Every picture, in turn.
    #[default]
    Fifo,
    /// The latest picture, where the device can.
    Mailbox,
}

/// What is pressed.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Keys {
    /// Ends the program; none where the file says `none`. Default: ctrl+alt+q.
    #[serde(with = "optional_chord")]
    pub exit: Option<Chord>,
}

/// From the source to the picture.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Live {
    /// Default: whole.
    pub update: Update,
    /// Volumes that can be looked back at, 1 to 1000. Default: 20.
    pub cine_volumes: u32,
    /// Memory that those may take, 16 to 65536 MiB; where it is short there are fewer of them. Default: 512.
    pub cine_memory_mb: u32,
    /// Between attempts to open the source, 100 ms to 10 min. Default: 2 s.
    #[serde(with = "duration")]
    pub retry: Duration,
    /// Every frame that arrives is written into this folder. Default: none, and nothing is kept.
    pub record: Option<PathBuf>,
}

/// What is left on the disk.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Files {
    /// Pictures and loops that are saved. Default: the folder in which the program was started.
    pub pictures: Option<PathBuf>,
    /// Default: standard error, which a service's journal keeps.
    pub log: Option<PathBuf>,
    /// Of one file of the log, 1 to 1024 MiB. Default: 10.
    pub log_size_mb: u32,
    /// Files of the log, the one that is written included, 1 to 100. Default: 5.
    pub log_files: u32,
}

impl Default for Config {
    fn default() -> Config {
        Config {
            source: PHANTOM.into(),
            probe: None,
            rate: None,
            real_time: false,
            rounds: None,
            forever: false,
            tool: None,
            clip: None,
            spacing: None,
            hole: None,
            preset: Vec::new(),
            device: None,
            motor: None,
            scene: toml::Table::new(),
            display: Display::default(),
            keys: Keys::default(),
            live: Live::default(),
            files: Files::default(),
            places: Places::default(),
        }
    }
}

impl Default for Display {
    fn default() -> Display {
        Display {
            full_screen: true,
            direct: false,
            monitor: None,
            size: [1280, 800],
            present: Present::Fifo,
            panels: true,
            scale: 1.0,
            budget: Some(Duration::from_millis(33)),
            report: None,
        }
    }
}

impl Default for Keys {
    fn default() -> Keys {
        Keys { exit: Chord::parse("ctrl+alt+q").ok() }
    }
}

impl Default for Live {
    fn default() -> Live {
        let retry = Duration::from_secs(2);
        Live { update: Update::Whole, cine_volumes: 20, cine_memory_mb: 512, retry, record: None }
    }
}

impl Default for Files {
    fn default() -> Files {
        Files { pictures: None, log: None, log_size_mb: 10, log_files: 5 }
    }
}

impl Config {
    /// Reads the file, of at most 1 MiB.
    ///
    /// # Errors
    /// One line: it is missing, no file, too long or no text, or as of [`Config::parse`].
    pub fn read(path: &Path) -> Result<Config, ConfigError> {
        let text = load::read(path, "configuration").map_err(|error| match error {
            LoadError::File { fault, .. } => ConfigError::of_file(path, fault),
            other => ConfigError::of_file(path, other.to_string()),
        })?;
        Config::parse(&text, path)
    }

    /// Reads the text of a file that lies at `path`, and checks all of it that no source and no device is needed for.
    ///
    /// # Errors
    /// One line that names the file, the line and the key, and what is allowed.
    pub fn parse(text: &str, path: &Path) -> Result<Config, ConfigError> {
        let places = Places::of(text, path)?;
        let mut config: Config = toml::from_str(text).map_err(|e| places.refuse(&e))?;
        config.places = places;
        config.check(text)?;
        config.root()?;
        Ok(config)
    }

    /// All of it as TOML, also what the file left out.
    ///
    /// # Errors
    /// One line: a path that is not UTF-8.
    pub fn to_toml(&self) -> Result<String, String> {
        toml::to_string(self).map_err(|e| crate::text::printable(&e.to_string()))
    }

    /// What is to be drawn: the presets and the scene, over the phantom's own preset where that is the source.
    ///
    /// # Errors
    /// As of a scene file.
    pub fn layers(&self) -> Result<Layers, LoadError> {
        let mut layers = Layers::default();
        if self.source == PHANTOM {
            layers.preset(PHANTOM)?;
        }
        for preset in &self.preset {
            layers.preset(preset)?;
        }
        layers.table("[scene]", self.scene.clone(), self.places.folder())?;
        Ok(layers)
    }

    /// Paths from the folder of the file.
    fn root(&mut self) -> Result<(), ConfigError> {
        let folder = self.places.folder().to_path_buf();
        if self.is_file() {
            let joined = folder.join(&self.source).into_os_string().into_string();
            self.source =
                joined.map_err(|_| self.places.fault("source", "lies in a folder whose name is not UTF-8"))?;
        }
        let files = [&mut self.probe, &mut self.display.report, &mut self.live.record, &mut self.files.pictures];
        for file in files.into_iter().chain([&mut self.files.log]).flatten() {
            *file = folder.join(&*file);
        }
        Ok(())
    }
}

impl Config {
    /// A recording is the source.
    fn is_file(&self) -> bool {
        self.source != PHANTOM && !self.source.contains("://")
    }

    fn check(&self, text: &str) -> Result<(), ConfigError> {
        let unless = |right: bool, key: &str| match (right, allowed(key)) {
            (true, _) => Ok(()),
            (false, allowed) => {
                Err(self.places.fault(key, &format!("must be {}", allowed.unwrap_or("something else"))))
            }
        };
        // A service has no standard input.
        let network = self.source.strip_prefix("igtl://").is_some_and(|host| !host.is_empty());
        let is_source = network || self.source == PHANTOM || (self.is_file() && !["", "-"].contains(&&*self.source));
        unless(is_source, "source")?;
        if self.forever && self.rounds.is_some() {
            return Err(self.places.fault("loop", "cannot be true beside rounds: set one of them"));
        }
        let whole = self.motor.as_ref().is_none_or(|motor| motor.port.is_some() && motor.sweeps.is_some());
        unless(whole, "motor")?;
        let display = &self.display;
        unless(display.size.iter().all(|edge| (64..=16384).contains(edge)), "display.size")?;
        unless((0.5..=4.0).contains(&display.scale), "display.scale")?;
        let time = |time: Duration, [from, to]: [u64; 2]| {
            (Duration::from_millis(from)..=Duration::from_millis(to)).contains(&time)
        };
        unless(display.budget.is_none_or(|budget| time(budget, [1, 10_000])), "display.budget")?;
        unless(display.report.is_none() || display.budget.is_some(), "display.report")?;
        let (live, files) = (&self.live, &self.files);
        unless((1..=1000).contains(&live.cine_volumes), "live.cine_volumes")?;
        unless((16..=65536).contains(&live.cine_memory_mb), "live.cine_memory_mb")?;
        unless(time(live.retry, [100, 600_000]), "live.retry")?;
        unless((1..=1024).contains(&files.log_size_mb), "files.log_size_mb")?;
        unless((1..=100).contains(&files.log_files), "files.log_files")?;
        self.check_scene(text)
    }

    /// As a scene file is, with the line.
    fn check_scene(&self, text: &str) -> Result<(), ConfigError> {
        #[derive(Deserialize)]
        struct Rest {
            #[serde(default, rename = "scene")]
            _scene: Settings,
        }
        // By itself first: merged settings no longer know their lines. A transfer function that lies in a file is none yet.
        if transfer_file(&self.scene).is_none() {
            toml::from_str::<Rest>(text).map_err(|e| self.places.refuse(&e))?;
        }
        for preset in &self.preset {
            let known = crate::scene::load::Layers::default().preset(preset);
            known.map_err(|e| self.places.fault("preset", &e.to_string()))?;
        }
        let settings = self.layers().and_then(|layers| layers.finish());
        let settings = settings.map_err(|e| self.places.fault("scene", &e.to_string()))?;
        settings.check().map_err(|e| self.places.fault(&format!("scene.{}", e.field), &e.fault))
    }
}

fn time<E: Error>(text: &str) -> Result<Duration, E> {
    humantime::parse_duration(text).map_err(|fault| E::custom(format!("{text:?} is no time: {fault}")))
}

fn say<S: Serializer>(time: Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&humantime::format_duration(time))
}

/// A time that is always there.
mod duration {
    use super::*;

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
        time(&String::deserialize(deserializer)?)
    }

    pub fn serialize<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
        say(*time, serializer)
    }
}

/// A time, or the word `none`.
mod optional_duration {
    use super::*;

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Duration>, D::Error> {
        let text = String::deserialize(deserializer)?;
        if text == "none" { Ok(None) } else { time(&text).map(Some) }
    }

    pub fn serialize<S: Serializer>(time: &Option<Duration>, serializer: S) -> Result<S::Ok, S::Error> {
        match time {
            Some(time) => say(*time, serializer),
            None => serializer.serialize_str("none"),
        }
    }
}

/// Keys, or the word `none`.
mod optional_chord {
    use super::*;

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Chord>, D::Error> {
        match String::deserialize(deserializer)?.as_str() {
            "none" => Ok(None),
            text => Chord::parse(text).map(Some).map_err(Error::custom),
        }
    }

    pub fn serialize<S: Serializer>(keys: &Option<Chord>, serializer: S) -> Result<S::Ok, S::Error> {
        match keys {
            Some(chord) => serializer.collect_str(chord),
            None => serializer.serialize_str("none"),
        }
    }
}

#[cfg(test)]
mod tests;
