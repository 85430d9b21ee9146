//! Errors in the configuration: each names the file, the line, the key and the values that are allowed there.

use crate::scene::load::line_of;
use crate::text::printable;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Longest part of a message that comes from the file, characters.
const MAX_MESSAGE: usize = 400;

/// An error in a configuration, in one line: the file, the line and the key if they are known, and the fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct ConfigError {
    path: PathBuf,
    /// Line number from 1.
    line: Option<usize>,
    key: String,
    fault: String,
}

impl ConfigError {
    pub(super) fn of_file(path: &Path, fault: String) -> ConfigError {
        ConfigError::new(path, None, "", &fault)
    }

    fn new(path: &Path, line: Option<usize>, key: &str, fault: &str) -> ConfigError {
        let short = |text: &str| match text.char_indices().nth(MAX_MESSAGE) {
            Some((end, _)) => format!("{} ...", &text[..end]),
            None => text.to_string(),
        };
        ConfigError { path: path.into(), line, key: short(&printable(key)), fault: short(&printable(fault)) }
    }

    /// The wrong key, such as `display.scale`; empty if the fault is in the file itself.
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
pub(super) struct KeyLocations {
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
    pub fn of(text: &str, path: &Path) -> Result<KeyLocations, ConfigError> {
        let table = DeTable::parse(text).map_err(|e| {
            let line = e.span().map(|span| line_of(text, span.start));
            ConfigError::new(path, line, "", e.message())
        })?;
        let mut keys = Vec::new();
        collect_keys("", table.get_ref(), text, &mut keys);
        Ok(KeyLocations { path: path.into(), keys })
    }

    /// The folder of the file.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    fn line(&self, key: &str) -> Option<usize> {
        self.keys.iter().find(|place| place.key == key).map(|place| place.line)
    }

    /// An error about the value of a key, with its line. If the file lacks the key, the line is that of the table it belongs to.
    pub fn error_at(&self, key: &str, fault: &str) -> ConfigError {
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
    pub fn parse_error(&self, error: &toml::de::Error) -> ConfigError {
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
pub(super) const ALLOWED: &[(&str, &str)] = &[
    ("source", "\"phantom\", a file (.mha, .mhd, .vol, .frames) or \"igtl://HOST[:PORT]\""),
    ("probe", "a file, as \"probe.toml\""),
    ("rate", "volumes a second, above 0, at most 1e6"),
    ("real_time", "true or false"),
    ("rounds", "a whole number of times, 1 or more"),
    ("loop", "true or false"),
    ("tool", "the name of a TRANSFORM or tool, or \"image\""),
    ("clip", "[x, y, width, height] in pixels"),
    ("spacing", "0.01 to 1000 mm"),
    ("hole", "0 to 1000 mm"),
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
];

/// The allowed values of a key.
pub(super) fn allowed(key: &str) -> Option<&'static str> {
    ALLOWED.iter().find(|(name, _)| *name == key).map(|(_, allowed)| *allowed)
}
