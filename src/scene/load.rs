//! Settings from layers: defaults, a preset, a scene file, and the command line, each overriding the one before.

use super::Settings;
use serde::Deserialize;
use std::io::Read;
use std::path::Path;
use toml::{Table, Value};

/// Longest scene file, bytes.
const LONGEST: u64 = 1 << 20;

/// Settings that suit a kind of picture, as TOML.
pub const PRESETS: &[(&str, &str)] = &[
    ("bmode", include_str!("presets/bmode.toml")),
    ("bone", include_str!("presets/bone.toml")),
    ("fetal", include_str!("presets/fetal.toml")),
    ("phantom", include_str!("presets/phantom.toml")),
    ("thesis", include_str!("presets/thesis.toml")),
];

#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    #[error("preset {name:?} is unknown; there are: {}", PRESETS.iter().map(|p| p.0).collect::<Vec<_>>().join(", "))]
    UnknownPreset { name: String },
    #[error("{path}: {fault}")]
    File { path: String, fault: String },
    #[error("{layer}: {fault}")]
    Layer { layer: String, fault: String },
}

/// Layers of TOML tables, merged key by key.
#[derive(Default)]
pub struct Layers(Table);

impl Layers {
    pub fn preset(&mut self, name: &str) -> Result<(), LoadError> {
        let (_, text) =
            PRESETS.iter().find(|p| p.0 == name).ok_or_else(|| LoadError::UnknownPreset { name: name.to_string() })?;
        self.add(&format!("preset {name}"), text)
    }

    pub fn file(&mut self, path: &Path) -> Result<(), LoadError> {
        let shown = path.display().to_string();
        let fault = |fault: String| LoadError::File { path: shown.clone(), fault };
        let unreadable = |e: std::io::Error| fault(format!("cannot be read: {e}"));
        // A pipe would be waited for.
        if !std::fs::metadata(path).map_err(unreadable)?.is_file() {
            return Err(fault("is not a regular file".into()));
        }
        let mut text = String::new();
        let file = std::fs::File::open(path).map_err(unreadable)?;
        file.take(LONGEST + 1).read_to_string(&mut text).map_err(unreadable)?;
        if text.len() as u64 > LONGEST {
            return Err(fault("is longer than 1 MiB, which no scene is".into()));
        }
        self.add(&shown, &text)
    }

    /// One `key.path=value` of `--set`; the value is TOML, or a plain word.
    pub fn set(&mut self, assignment: &str) -> Result<(), LoadError> {
        self.set_by(&format!("--set {assignment}"), assignment)
    }

    /// The same for a flag that stands for a setting: messages name the flag as it was typed.
    pub fn set_by(&mut self, flag: &str, assignment: &str) -> Result<(), LoadError> {
        let fault = |fault: &str| LoadError::Layer { layer: flag.into(), fault: fault.into() };
        let (path, text) = assignment.split_once('=').ok_or_else(|| fault("must read key.path=value"))?;
        if text.contains('\n') {
            return Err(fault("unknown field after a line break"));
        }
        let value: Value = toml::from_str::<Table>(&format!("v = {text}"))
            .ok()
            .and_then(|mut t| t.remove("v"))
            .unwrap_or_else(|| Value::String(text.trim().to_string()));
        let mut layer = Table::new();
        let mut at = &mut layer;
        let mut keys = path.trim().split('.').peekable();
        while let Some(key) = keys.next() {
            if keys.peek().is_none() {
                at.insert(key.to_string(), value);
                break;
            }
            let inner = at.entry(key).or_insert_with(|| Value::Table(Table::new()));
            at = inner.as_table_mut().ok_or_else(|| fault("names a key twice"))?;
        }
        self.merge_checked(flag, layer)
    }

    fn add(&mut self, layer: &str, text: &str) -> Result<(), LoadError> {
        let fault = |e: &toml::de::Error| LoadError::Layer { layer: layer.into(), fault: one_line(e, text) };
        // Read by itself first: only then does a message know its line.
        toml::from_str::<Settings>(text).map_err(|e| fault(&e))?;
        let table = toml::from_str::<Table>(text).map_err(|e| fault(&e))?;
        self.merge_checked(layer, table)
    }

    /// Checks after every layer, so that the message names the layer at fault.
    fn merge_checked(&mut self, layer: &str, table: Table) -> Result<(), LoadError> {
        merge(&mut self.0, table);
        self.settings().map(drop).map_err(|e| LoadError::Layer { layer: layer.into(), fault: one_line(&e, "") })
    }

    fn settings(&self) -> Result<Settings, toml::de::Error> {
        Settings::deserialize(self.0.clone())
    }

    pub fn finish(self) -> Result<Settings, LoadError> {
        self.settings().map_err(|e| LoadError::Layer { layer: "scene".into(), fault: one_line(&e, "") })
    }
}

fn merge(under: &mut Table, over: Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(Value::Table(under)), Value::Table(over)) => merge(under, over),
            (_, value) => drop(under.insert(key, value)),
        }
    }
}

fn one_line(error: &toml::de::Error, text: &str) -> String {
    let before = error.span().and_then(|span| text.get(..span.start));
    let place = before.map_or(String::new(), |b| format!("line {}: ", b.matches('\n').count() + 1));
    format!("{place}{}", error.message().lines().collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_parses_and_later_layers_win() {
        for (name, _) in PRESETS {
            let mut layers = Layers::default();
            layers.preset(name).unwrap();
            layers.set("surface.threshold=0.3").unwrap();
            layers.set("mode=volume").unwrap();
            let settings = layers.finish().unwrap();
            assert_eq!(settings.surface.threshold, 0.3, "{name}");
            assert_eq!(settings.mode, super::super::Mode::Volume);
        }
    }

    #[test]
    fn a_misspelt_key_is_an_error_that_names_it() {
        let error = Layers::default().set("surface.treshold=0.3").unwrap_err().to_string();
        assert!(error.contains("treshold"), "{error}");
        assert_eq!(error.lines().count(), 1);
        assert!(Layers::default().set("nonsense").is_err());
        assert!(Layers::default().set("mode=sideways").is_err());
        assert!(Layers::default().preset("nothing").unwrap_err().to_string().contains("bone"));
    }
}
