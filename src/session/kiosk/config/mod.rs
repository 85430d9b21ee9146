//! The configuration of a cart: one TOML file. `tools/kiosk/echolume.toml` is an example with all keys.
//!
//! Every key is optional. Paths are relative to the folder of the file. An error ([`ConfigError`]) is one line that names the file, the
//! line, the key and the allowed values. The keys of the source are converted to the flags of `echolume stream`, which are checked in one
//! place; and flags back to keys in messages.

use super::chord::Chord;
use crate::live::Update;
use crate::scene::PresentMode;
use crate::scene::load::{self, Layers, LoadError, line_of, transfer_file};
use crate::scene::{FileVersion, Settings};
use crate::text::printable;
use crate::tree::{self, Defaults, FromNode, Node, NodeError, ToNode};
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;
use toml::de::{DeTable, DeValue};

/// Default path of the configuration file of the service.
pub const DEFAULT_PATH: &str = "/etc/echolume/echolume.toml";
/// Path of the log file in the example configuration.
pub(crate) const DEFAULT_LOG: &str = "/var/log/echolume/echolume.log";
/// Value of [`Config::source`] that stands for the built-in phantom.
pub const PHANTOM: &str = "phantom";

/// The configuration of a kiosk, such as the program on an ultrasound cart.
///
/// The keys at the top select the source. They are the flags of `echolume stream` with `_` for `-`, and are checked as those. Everything else is
/// in tables.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Config {
    /// The version of this file's keys. Default: 1, the only one.
    #[value(FileVersion)]
    version: FileVersion,
    /// The source of frames: `phantom` (the default), a recording, or `igtl://HOST[:PORT]`.
    #[value(PHANTOM.into())]
    pub source: String,
    /// Path of the probe file (TOML) with the geometry, if the source does not state it. Default: none.
    pub probe: Option<PathBuf>,
    /// Volumes per second at which a recording or the phantom is played, above 0, at most 1e6. Default: as fast as possible; the phantom 1.
    pub rate: Option<f64>,
    /// Play a recording at the times of its time stamps. Default: false.
    pub real_time: bool,
    /// Number of times that a recording is played, 1 or more. Default: 1.
    pub rounds: Option<u32>,
    /// Play a recording again and again, for demonstrations. Default: false.
    #[tree(rename = "loop")]
    pub(crate) forever: bool,
    /// OpenIGTLink: the TRANSFORM or the tool of TDATA that gives the poses of 2D frames; `image`: the matrix of each image. Default: any
    /// TRANSFORM.
    pub tool: Option<String>,
    /// OpenIGTLink: name of the device whose images are used, if there are several. Default: all.
    pub device_name: Option<String>,
    /// OpenIGTLink: accept messages with the checksum 0 without verifying it. Default: false.
    pub no_checksum: bool,
    /// The part of each tracked frame that is used, pixels: x, y, width, height. Default: all of it.
    pub clip: Option<[u32; 4]>,
    /// Voxel spacing of the volume that tracked frames are compounded into, 0.01 to 1000 mm. Default: the distance between the frames' pixels.
    pub spacing: Option<f64>,
    /// Widest gap between tracked frames that is filled, 0 to 1000 mm. Default: 2.
    pub hole: Option<f64>,
    /// Length of a freehand sweep, 0 to 1000 mm, for which its volume has room from the first frames on. Default: not stated.
    pub extent: Option<f64>,
    /// Names of presets of the scene; later ones take precedence. Default: none.
    pub preset: Vec<String>,
    /// Vulkan device, by number or part of its name. Default: the best.
    pub device: Option<String>,
    /// The motor that sweeps the array. Default: none.
    pub motor: Option<Motor>,
    /// Settings as in a scene file, which take precedence over the presets. Default: empty.
    pub scene: toml::Table,
    pub display: Display,
    pub keys: Keys,
    pub live: Live,
    pub files: Files,
    /// Path of the file, and where its keys are.
    #[tree(skip)]
    locations: KeyLocations,
}

/// The motor of the probe: the flags that `echolume stream --motor` has. `port` and `sweeps` are required.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Motor {
    /// Serial port of the motor, for example `/dev/ttyUSB0`.
    pub port: Option<String>,
    /// Angle of the sweep from end to end, degrees. Default: 5 % wider than the frames.
    pub angle: Option<f64>,
    /// Passes over the angle per second; each pass gives a volume.
    pub sweeps: Option<f64>,
    /// The motor's home is known: it was found before, and its controller has been on since. Default: false.
    pub homed: bool,
    /// Time from the last line of a frame to its arrival, 0 to 10000 ms. Default: 0.
    pub delay: Option<f64>,
    /// The time stamp of a frame is the time of its first line on the clock of this machine. Default: false.
    pub stamps: bool,
    /// Baud rate of the serial port, bits a second, 300 to 4000000. Default: 9600.
    pub baud: Option<u32>,
    /// Parity of the serial port: `none`, `even` or `odd`. Default: none.
    pub parity: Option<String>,
    /// Stop bits of the serial port: 1 or 2. Default: 1.
    pub stop_bits: Option<u8>,
    /// Longest wait for a reply of the controller, 20 to 10000 ms. Default: 500.
    pub timeout: Option<u64>,
}

/// Table `display`: the screen and the window.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Display {
    /// Show the window in full screen. Default: true.
    #[value(true)]
    pub full_screen: bool,
    /// Draw directly on the monitor (VK_KHR_display), without a window system. Default: false.
    pub direct: bool,
    /// A part of the name of the monitor to use. Default: the monitor of the window; if `direct` is true, the first monitor.
    pub monitor: Option<String>,
    /// Width and height of a window that is not full-screen, pixels, 64 to 16384 each. Default: 1280 x 800.
    #[value([1280, 800])]
    pub size: [u32; 2],
    /// How pictures reach the screen. Default: fifo.
    pub present: PresentMode,
    /// Show sliders and buttons at the start. Default: true.
    #[value(true)]
    pub panels: bool,
    /// Scale of text and buttons, 0.5 to 4. Default: 1.
    #[value(1.0)]
    pub scale: f64,
    /// Frame budget: longest time of a picture while the view moves, 1 ms to 10 s; `none` (None): no limit. Default: 33 ms.
    #[tree(with = "optional_duration")]
    #[value(Some(Duration::from_millis(33)))]
    pub budget: Option<Duration>,
    /// Path of the error.json of `echolume report error` from which the quality ladder for the budget is made. Default: the built-in ladder.
    pub report: Option<PathBuf>,
}

/// Table `keys`: key combinations of the kiosk.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Keys {
    /// The key combination that ends the program; `none` (the value None): no combination does. Default: ctrl+alt+q.
    #[tree(with = "optional_chord")]
    #[value(Chord::parse("ctrl+alt+q").ok())]
    pub exit: Option<Chord>,
}

/// Table `live`: how live volumes are shown and kept.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Live {
    /// How arriving frames become visible. Default: whole.
    pub update: Update,
    /// Largest number of volumes in the cine loop, 1 to 1000. Default: 20.
    #[value(20)]
    pub cine_volumes: u32,
    /// Largest memory of the cine loop, 16 to 65536 MiB, which also limits the number of its volumes. Default: 512.
    #[value(512)]
    pub cine_memory_mb: u32,
    /// Time between attempts to open the source, 100 ms to 10 min. Default: 2 s.
    #[tree(with = "duration")]
    #[value(Duration::from_secs(2))]
    pub retry: Duration,
    /// Folder in which all frames that arrive are recorded. Default: none, no recording.
    pub record: Option<PathBuf>,
}

/// Table `files`: files that the program writes.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Files {
    /// Folder for saved pictures and cine loops. Default: the current folder.
    pub pictures: Option<PathBuf>,
    /// Path of the log file. Default: none; the log goes to standard error, which is the journal of a service.
    pub log: Option<PathBuf>,
    /// Largest size of one log file, 1 to 1024 MiB. Default: 10.
    #[value(10)]
    pub log_size_mb: u32,
    /// Number of log files, including the current one, 1 to 100. Default: 5.
    #[value(5)]
    pub log_files: u32,
    /// Path of a file with metrics for Prometheus, rewritten every 15 s. Default: none.
    pub prometheus: Option<PathBuf>,
    /// True: recordings, pictures, workspaces and logs can be read by the program's user alone, whatever the umask. False: the umask decides.
    /// Default: true.
    #[value(true)]
    pub private: bool,
}

impl Config {
    /// Reads a configuration file of at most 1 MiB.
    ///
    /// # Errors
    /// One line: the file is missing, not a regular file, too long or not text, or [`Config::parse`] refuses it.
    pub fn read(path: &Path) -> Result<Config, ConfigError> {
        let text = load::read(path, "configuration").map_err(|error| match error {
            LoadError::File { fault, .. } => ConfigError::of_file(path, fault),
            other => ConfigError::of_file(path, other.to_string()),
        })?;
        Config::parse(&text, path)
    }

    /// Parses the text of a configuration, and checks it. The ranges of the keys of [`Config::source_arguments`] are not checked: they are those of
    /// the flags. `path`: that of its file, for messages and for the paths in it, which are relative to its folder.
    ///
    /// # Errors
    /// One line that names the file and, as far as they are known, the line, the key and the allowed values.
    pub fn parse(text: &str, path: &Path) -> Result<Config, ConfigError> {
        let locations = KeyLocations::of(text, path)?;
        let mut config: Config = tree::from_toml(text).map_err(|e| locations.parse_error(&e))?;
        config.locations = locations;
        config.check(text)?;
        config.resolve_paths()?;
        Ok(config)
    }

    /// The complete configuration as TOML, including defaults.
    ///
    /// # Errors
    /// One line: a path is not UTF-8.
    pub fn to_toml(&self) -> Result<String, String> {
        tree::to_toml(self).map_err(|e| printable(&e.to_string()))
    }

    /// The settings of the scene as layers, of which later ones take precedence: the presets of the phantom if that is the source, the presets,
    /// the settings in `scene`.
    ///
    /// # Errors
    /// A preset is not known, or a setting or a file that `scene` names is wrong.
    pub fn layers(&self) -> Result<Layers, LoadError> {
        let mut layers = Layers::default();
        if self.source == PHANTOM {
            let is_pair = self.scene.get("layout").and_then(|layout| layout.as_str()) == Some("pair");
            layers.phantom(self.preset.is_empty() && !self.scene.contains_key("mode") && !is_pair)?;
        }
        for preset in &self.preset {
            layers.preset(preset)?;
        }
        layers.table("[scene]", self.scene.clone(), self.locations.folder())?;
        Ok(layers)
    }

    /// Makes paths relative to the folder of the file.
    fn resolve_paths(&mut self) -> Result<(), ConfigError> {
        let folder = self.locations.folder().to_path_buf();
        if self.is_file() {
            let joined = folder.join(&self.source).into_os_string().into_string();
            self.source =
                joined.map_err(|_| self.locations.error_at("source", "is in a folder whose name is not UTF-8"))?;
        }
        let files = [&mut self.probe, &mut self.display.report, &mut self.live.record, &mut self.files.pictures];
        for file in files.into_iter().chain([&mut self.files.log, &mut self.files.prometheus]).flatten() {
            *file = folder.join(&*file);
        }
        Ok(())
    }

    /// True if the source is a recording.
    fn is_file(&self) -> bool {
        self.source != PHANTOM && !self.source.contains("://")
    }

    fn check(&self, text: &str) -> Result<(), ConfigError> {
        let check = |right: bool, key: &str| match (right, allowed(key)) {
            (true, _) => Ok(()),
            (false, allowed) => {
                Err(self.locations.error_at(key, &format!("must be {}", allowed.unwrap_or("something else"))))
            }
        };
        // A service has no standard input, so `-` is refused.
        let network = self.source.strip_prefix("igtl://").is_some_and(|host| !host.is_empty());
        let is_source = network || self.source == PHANTOM || (self.is_file() && !["", "-"].contains(&&*self.source));
        check(is_source, "source")?;
        if self.forever && self.rounds.is_some() {
            return Err(self.locations.error_at("loop", "cannot be true if rounds is set"));
        }
        let whole = self.motor.as_ref().is_none_or(|motor| motor.port.is_some() && motor.sweeps.is_some());
        check(whole, "motor")?;
        let display = &self.display;
        check(display.size.iter().all(|edge| (64..=16384).contains(edge)), "display.size")?;
        check((0.5..=4.0).contains(&display.scale), "display.scale")?;
        let time = |time: Duration, [from, to]: [u64; 2]| {
            (Duration::from_millis(from)..=Duration::from_millis(to)).contains(&time)
        };
        check(display.budget.is_none_or(|budget| time(budget, [1, 10_000])), "display.budget")?;
        check(display.report.is_none() || display.budget.is_some(), "display.report")?;
        let (live, files) = (&self.live, &self.files);
        check((1..=1000).contains(&live.cine_volumes), "live.cine_volumes")?;
        check((16..=65536).contains(&live.cine_memory_mb), "live.cine_memory_mb")?;
        check(time(live.retry, [100, 600_000]), "live.retry")?;
        check((1..=1024).contains(&files.log_size_mb), "files.log_size_mb")?;
        check((1..=100).contains(&files.log_files), "files.log_files")?;
        self.check_scene(text)
    }

    /// Checks the scene like a scene file, with line numbers.
    fn check_scene(&self, text: &str) -> Result<(), ConfigError> {
        // First without the layers, because merged settings have no line numbers. A transfer function in a file is not resolved yet.
        if transfer_file(&self.scene).is_none() {
            let scene = Node::parse(text).map(|mut all| all.take("scene"));
            scene
                .and_then(|scene| scene.map_or(Ok(Settings::default()), Settings::read))
                .map_err(|e| self.locations.parse_error(&e))?;
        }
        for preset in &self.preset {
            Layers::default().preset(preset).map_err(|e| self.locations.error_at("preset", &e.to_string()))?;
        }
        let settings = self.layers().and_then(|layers| layers.finish());
        let settings = settings.map_err(|e| self.locations.error_at("scene", &e.to_string()))?;
        settings.check().map_err(|e| self.locations.error_at(&format!("scene.{}", e.field), &e.fault))
    }
}

/// A time as text, such as `2s`.
mod duration {
    use super::*;

    pub fn from_node(node: Node) -> Result<Duration, NodeError> {
        let text = String::from_node(node.clone())?;
        humantime::parse_duration(&text).map_err(|fault| node.fault(format!("{text:?} is not a time: {fault}")))
    }

    pub fn to_node(time: &Duration) -> Node {
        humantime::format_duration(*time).to_string().to_node()
    }
}

/// The value None of a key with a value of its own for that.
const NONE: &str = "none";

/// True if the value is the word `none`.
fn is_none(node: &Node) -> bool {
    String::from_node(node.clone()).is_ok_and(|word| word == NONE)
}

/// A time as text, or `none`.
mod optional_duration {
    use super::*;

    pub fn from_node(node: Node) -> Result<Option<Duration>, NodeError> {
        if is_none(&node) { Ok(None) } else { duration::from_node(node).map(Some) }
    }

    pub fn to_node(time: &Option<Duration>) -> Node {
        time.as_ref().map_or(NONE.to_node(), duration::to_node)
    }
}

/// Keys as text, such as `ctrl+alt+q`, or `none`.
mod optional_chord {
    use super::*;

    pub fn from_node(node: Node) -> Result<Option<Chord>, NodeError> {
        if is_none(&node) {
            return Ok(None);
        }
        let text = String::from_node(node.clone())?;
        Chord::parse(&text).map(Some).map_err(|fault| node.fault(fault.to_string()))
    }

    pub fn to_node(keys: &Option<Chord>) -> Node {
        keys.as_ref().map_or(NONE.to_node(), |chord| chord.to_string().to_node())
    }
}

/// A key with its value.
type Key<T> = (&'static str, T);

/// The flag of a key.
fn flag(key: &str) -> String {
    match key {
        "motor.port" => "--motor".into(),
        key => format!("--{}", key.trim_start_matches("motor.").replace('_', "-")),
    }
}

impl Config {
    /// The keys that correspond to flags, with their values: those of flags with a value, and switches.
    fn source_keys(&self) -> ([Key<Option<String>>; 18], [Key<bool>; 4]) {
        let path = |path: &Path| path.to_string_lossy().into_owned();
        let clip = self.clip.map(|clip| clip.map(|n| n.to_string()).join(","));
        let rounds = if self.forever { Some(u32::MAX) } else { self.rounds };
        let Motor { port, angle, sweeps, homed, delay, stamps, baud, parity, stop_bits, timeout } =
            self.motor.clone().unwrap_or_default();
        fn text<T: ToString>(value: Option<T>) -> Option<String> {
            value.map(|value| value.to_string())
        }
        let values = [
            ("source", Some(self.source.clone())),
            ("probe", self.probe.as_deref().map(path)),
            ("rate", text(self.rate)),
            ("rounds", text(rounds)),
            ("tool", self.tool.clone()),
            ("device_name", self.device_name.clone()),
            ("clip", clip),
            ("spacing", text(self.spacing)),
            ("hole", text(self.hole)),
            ("extent", text(self.extent)),
            ("motor.port", port),
            ("motor.angle", text(angle)),
            ("motor.sweeps", text(sweeps)),
            ("motor.delay", text(delay)),
            ("motor.baud", text(baud)),
            ("motor.parity", parity),
            ("motor.stop_bits", text(stop_bits)),
            ("motor.timeout", text(timeout)),
        ];
        let switches = [
            ("real_time", self.real_time),
            ("no_checksum", self.no_checksum),
            ("motor.homed", homed),
            ("motor.stamps", stamps),
        ];
        (values, switches)
    }

    /// The arguments of `echolume stream` that select the source of this configuration, each as one word: `--flag=value`, or `--flag` for a switch.
    pub fn source_arguments(&self) -> Vec<String> {
        let (values, switches) = self.source_keys();
        let values = values.into_iter().filter_map(|(key, value)| Some(format!("{}={}", flag(key), value?)));
        values.chain(switches.into_iter().filter(|(_, on)| *on).map(|(key, _)| flag(key))).collect()
    }

    /// Converts an error message about the arguments of [`Config::source_arguments`] to one about the configuration file: with keys in place of
    /// flags, and the line of the first key.
    pub fn flag_error(&self, message: &str) -> ConfigError {
        let mut text_with_keys = message.to_string();
        let mut first: Option<(usize, &str)> = None;
        let (values, switches) = self.source_keys();
        for key in values.map(|(key, _)| key).into_iter().chain(switches.map(|(key, _)| key)) {
            let flag = flag(key);
            let mut from = 0;
            while let Some(at) = text_with_keys[from..].find(&flag).map(|at| from + at) {
                let end = at + flag.len();
                from = end;
                // Not the start of a longer flag.
                if text_with_keys[end..].starts_with(|c: char| c == '-' || c.is_alphanumeric()) {
                    continue;
                }
                // The placeholder of the value, such as `<N>`, belongs to the flag.
                let value =
                    text_with_keys[end..].strip_prefix(" <").and_then(|rest| rest.find('>')).map_or(0, |n| n + 3);
                text_with_keys.replace_range(at..end + value, key);
                from = at + key.len();
                first = Some(first.filter(|(earlier, _)| *earlier < at).unwrap_or((at, key)));
            }
        }
        match first {
            // The message begins with the key and its value.
            Some((0, key)) => self.locations.error_at(key, text_with_keys[key.len()..].trim_start_matches([':', ' '])),
            Some((_, key)) => self.locations.error_at(key, &text_with_keys),
            None => self.locations.error_at("", &text_with_keys),
        }
    }
}

/// Longest part of a message that comes from the file, characters.
const MAX_MESSAGE: usize = 400;

/// An error in a configuration file, as one line: the file, the line and the key if they are known, and the fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct ConfigError {
    path: PathBuf,
    /// Line number from 1.
    line: Option<usize>,
    key: String,
    fault: String,
}

impl ConfigError {
    fn of_file(path: &Path, fault: String) -> ConfigError {
        ConfigError::new(path, None, "", &fault)
    }

    fn new(path: &Path, line: Option<usize>, key: &str, fault: &str) -> ConfigError {
        let short = |text: &str| match text.char_indices().nth(MAX_MESSAGE) {
            Some((end, _)) => format!("{} ...", &text[..end]),
            None => text.to_string(),
        };
        ConfigError { path: path.into(), line, key: short(&printable(key)), fault: short(&printable(fault)) }
    }

    /// The wrong key, such as `display.scale`; empty if the fault is in the file itself or the key is not known.
    pub fn key(&self) -> &str {
        &self.key
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: ", printable(&self.path.display().to_string()))?;
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        write!(f, "{}", self.fault)
    }
}

/// The path of the file, and where its keys are, outer keys first.
#[derive(Clone, Debug, Default, PartialEq)]
struct KeyLocations {
    path: PathBuf,
    keys: Vec<KeyLocation>,
}

#[derive(Clone, Debug, PartialEq)]
struct KeyLocation {
    /// The complete key with its tables, separated by dots.
    key: String,
    line: usize,
    /// Byte ranges of the last part of the key, and of the value.
    name: Range<usize>,
    value: Range<usize>,
}

impl KeyLocations {
    /// Finds the keys of a text.
    ///
    /// # Errors
    /// The text is not TOML.
    fn of(text: &str, path: &Path) -> Result<KeyLocations, ConfigError> {
        let table = DeTable::parse(text).map_err(|e| {
            let line = e.span().map(|span| line_of(text, span.start));
            ConfigError::new(path, line, "", e.message())
        })?;
        let mut keys = Vec::new();
        collect_keys("", table.get_ref(), text, &mut keys);
        Ok(KeyLocations { path: path.into(), keys })
    }

    /// The folder of the file.
    fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    fn line(&self, key: &str) -> Option<usize> {
        self.keys.iter().find(|place| place.key == key).map(|place| place.line)
    }

    /// An error about the value of a key, with its line. If the file lacks the key, the line is that of the table it belongs to.
    fn error_at(&self, key: &str, fault: &str) -> ConfigError {
        let mut at = key;
        let line = loop {
            match (self.line(at), at.rsplit_once('.')) {
                (None, Some((table, _))) => at = table,
                (line, _) => break line,
            }
        };
        ConfigError::new(&self.path, line, key, fault)
    }

    /// Converts an error of the parser to one that names the key and the allowed values.
    fn parse_error(&self, error: &NodeError) -> ConfigError {
        let at = error.span().unwrap_or_default();
        let holds = |range: &Range<usize>| range.start <= at.start && at.end <= range.end;
        let place = self.keys.iter().rfind(|place| holds(&place.name));
        match place.or_else(|| self.keys.iter().rfind(|place| holds(&place.value))) {
            None => ConfigError::new(&self.path, None, "", error.message()),
            Some(place) => {
                // For an unknown key the parser lists the existing ones.
                let allowed = allowed(&place.key).map_or(String::new(), |allowed| format!("; must be {allowed}"));
                let fault = format!("{}{allowed}", error.message());
                ConfigError::new(&self.path, Some(place.line), &place.key, &fault)
            }
        }
    }
}

fn collect_keys(above: &str, table: &DeTable, text: &str, keys: &mut Vec<KeyLocation>) {
    for (name, value) in table {
        let key = match above {
            "" => name.get_ref().to_string(),
            above => format!("{above}.{}", name.get_ref()),
        };
        let line = line_of(text, name.span().start);
        keys.push(KeyLocation { key: key.clone(), line, name: name.span(), value: value.span() });
        if let DeValue::Table(inner) = value.get_ref() {
            collect_keys(&key, inner, text, keys);
        }
    }
}

/// The allowed values of each key, for error messages. The ranges of the source's keys are those of the flags, which `cli` checks.
const ALLOWED: &[(&str, &str)] = &[
    ("version", "1"),
    ("source", "\"phantom\", the file of a recording or \"igtl://HOST[:PORT]\""),
    ("probe", "a file, as \"probe.toml\""),
    ("rate", "volumes a second, above 0, at most 1e6"),
    ("real_time", "true or false"),
    ("rounds", "a whole number of times, 1 or more"),
    ("loop", "true or false"),
    ("tool", "the name of a TRANSFORM or tool, or \"image\""),
    ("device_name", "the name of an IMAGE device, as \"Image_Reference\""),
    ("no_checksum", "true or false"),
    ("clip", "[x, y, width, height] in pixels"),
    ("spacing", "0.01 to 1000 mm"),
    ("hole", "0 to 1000 mm"),
    ("extent", "0 to 1000 mm"),
    ("preset", "a list of names, as [\"fetal\"]"),
    ("device", "a text: the number of a device or a part of its name"),
    ("motor", "a table with port and sweeps"),
    ("motor.port", "a serial port, as \"/dev/ttyUSB0\""),
    ("motor.angle", "degrees"),
    ("motor.sweeps", "passes a second"),
    ("motor.homed", "true or false"),
    ("motor.delay", "0 to 10000 ms"),
    ("motor.stamps", "true or false"),
    ("motor.baud", "300 to 4000000 bits a second"),
    ("motor.parity", "\"none\", \"even\" or \"odd\""),
    ("motor.stop_bits", "1 or 2"),
    ("motor.timeout", "20 to 10000 ms"),
    ("scene", "what a scene file holds"),
    ("display", "a table"),
    ("display.full_screen", "true or false"),
    ("display.direct", "true or false"),
    ("display.monitor", "a part of the monitor's name"),
    ("display.size", "[width, height] in pixels, each 64 to 16384"),
    ("display.present", "\"fifo\" or \"mailbox\""),
    ("display.panels", "true or false"),
    ("display.scale", "0.5 to 4"),
    ("display.budget", "a time from 1ms to 10s, or none"),
    ("display.report", "the error.json of `echolume report error`, needs display.budget"),
    ("keys", "a table"),
    ("keys.exit", "keys as \"ctrl+alt+q\", or \"none\""),
    ("live", "a table"),
    ("live.update", "\"whole\" or \"rolling\""),
    ("live.cine_volumes", "1 to 1000"),
    ("live.cine_memory_mb", "16 to 65536 MiB"),
    ("live.retry", "a time from 100ms to 10min"),
    ("live.record", "a folder"),
    ("files", "a table"),
    ("files.pictures", "a folder"),
    ("files.log", "a file"),
    ("files.log_size_mb", "1 to 1024 MiB"),
    ("files.log_files", "1 to 100"),
    ("files.prometheus", "a file"),
    ("files.private", "true or false"),
];

/// The allowed values of a key.
fn allowed(key: &str) -> Option<&'static str> {
    ALLOWED.iter().find(|(name, _)| *name == key).map(|(_, allowed)| *allowed)
}

#[cfg(test)]
mod tests;
