//! Errors in the configuration: each names the file, the line, the key and the values that are allowed there.

use crate::scene::load::line_of;
use crate::text::printable;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Longest part of a message that the file decides, in characters.
const LONGEST: usize = 400;

/// Why a configuration is refused, in one line: the file, and where it is known the line and the key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub struct ConfigError {
    path: PathBuf,
    /// From 1.
    line: Option<usize>,
    key: String,
    fault: String,
}

impl ConfigError {
    pub(super) fn of_file(path: &Path, fault: String) -> ConfigError {
        ConfigError::new(path, None, "", &fault)
    }

    fn new(path: &Path, line: Option<usize>, key: &str, fault: &str) -> ConfigError {
        let short = |text: &str| match text.char_indices().nth(LONGEST) {
            Some((end, _)) => format!("{} ...", &text[..end]),
            None => text.to_string(),
        };
        ConfigError { path: path.into(), line, key: short(&printable(key)), fault: short(&printable(fault)) }
    }

    /// The key at fault, such as `display.scale`; empty where it is the file itself.
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

/// The file, and its keys from the upper ones inwards.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Places {
    path: PathBuf,
    keys: Vec<Place>,
}

#[derive(Clone, Debug, PartialEq)]
struct Place {
    /// With those of the tables around it, parted by dots.
    key: String,
    line: usize,
    /// Of its last part, and of the value, bytes.
    name: Range<usize>,
    value: Range<usize>,
}

impl Places {
    /// # Errors
    /// What is no TOML.
    pub fn of(text: &str, path: &Path) -> Result<Places, ConfigError> {
        let table = DeTable::parse(text).map_err(|e| {
            let line = e.span().map(|span| line_of(text, span.start));
            ConfigError::new(path, line, "", e.message())
        })?;
        let mut keys = Vec::new();
        walk("", table.get_ref(), text, &mut keys);
        Ok(Places { path: path.into(), keys })
    }

    /// That of the file.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    fn line(&self, key: &str) -> Option<usize> {
        self.keys.iter().find(|place| place.key == key).map(|place| place.line)
    }

    /// What is wrong with the value of a key; where the file does not have it, of the table that would.
    pub fn fault(&self, key: &str, fault: &str) -> ConfigError {
        let mut at = key;
        let line = loop {
            match (self.line(at), at.rsplit_once('.')) {
                (None, Some((table, _))) => at = table,
                (line, _) => break line,
            }
        };
        ConfigError::new(&self.path, line, key, fault)
    }

    /// What the parser found wrong, at the key whose value or name that is in, with what is allowed there.
    pub fn refuse(&self, error: &toml::de::Error) -> ConfigError {
        let at = error.span().unwrap_or_default();
        let holds = |range: &Range<usize>| range.start <= at.start && at.end <= range.end;
        let place = self.keys.iter().rfind(|place| holds(&place.name));
        match place.or_else(|| self.keys.iter().rfind(|place| holds(&place.value))) {
            None => ConfigError::new(&self.path, None, "", error.message()),
            Some(place) => {
                // A key that there is not is refused with those that there are.
                let allowed = allowed(&place.key).map_or(String::new(), |allowed| format!("; must be {allowed}"));
                let fault = format!("{}{allowed}", error.message());
                ConfigError::new(&self.path, Some(place.line), &place.key, &fault)
            }
        }
    }
}

fn walk(above: &str, table: &DeTable, text: &str, keys: &mut Vec<Place>) {
    for (name, value) in table {
        let key = match above {
            "" => name.get_ref().to_string(),
            above => format!("{above}.{}", name.get_ref()),
        };
        let line = line_of(text, name.span().start);
        keys.push(Place { key: key.clone(), line, name: name.span(), value: value.span() });
        if let DeValue::Table(inner) = value.get_ref() {
            walk(&key, inner, text, keys);
        }
    }
}

/// What each key may be, said when it is not. The ranges of the source's keys are those of the flags, which `cli` checks.
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
    ("display.report", "the error.json of `echolume report error`, with display.budget beside it"),
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

pub(super) fn allowed(key: &str) -> Option<&'static str> {
    ALLOWED.iter().find(|(name, _)| *name == key).map(|(_, allowed)| *allowed)
}
