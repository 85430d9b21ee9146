//! Why a configuration is refused.

use crate::text::printable;
use std::fmt;
use std::path::{Path, PathBuf};

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

    pub(super) fn new(path: &Path, line: Option<usize>, key: &str, fault: &str) -> ConfigError {
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
