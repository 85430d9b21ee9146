//! Where each key of the file stands: a message is of little use to whoever stands before a cart unless it says where to look.

use super::check::allowed;
use super::error::ConfigError;
use crate::scene::load::line_of;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

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
