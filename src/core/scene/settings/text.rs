//! Settings as TOML and JSON.

use super::Settings;
use crate::scene::file_version::FileVersion;
use crate::tree::{self, FromNode, Node, NodeError, ToNode};
use std::sync::Once;
use toml::{Table, Value};

/// `ray.subsampling` by the flags that it was before, which are taken out of their table. None if it has none of them.
fn subsampling(mut taken: impl FnMut(&str) -> Option<bool>) -> Option<i64> {
    let flags = [("eighth", 8), ("quarter", 4), ("half", 2)].map(|(name, pixels)| (taken(name), pixels));
    if flags.iter().all(|(flag, _)| flag.is_none()) {
        return None;
    }
    static REPORTED: Once = Once::new();
    REPORTED
        .call_once(|| tracing::warn!("ray.half, ray.quarter and ray.eighth are read as ray.subsampling = 2, 4 and 8"));
    Some(flags.iter().find(|(flag, _)| *flag == Some(true)).map_or(1, |(_, pixels)| *pixels))
}

impl Settings {
    /// Parses a scene file. Absent settings have their defaults. Limits of values are left to [`Settings::check`].
    ///
    /// # Errors
    /// The text is not valid TOML, a key is unknown, a value does not fit its type, or the version is not 1. The error has the position.
    pub fn from_toml(text: &str) -> Result<Settings, NodeError> {
        Settings::read(Node::parse(text)?)
    }

    /// Reads settings from a node of a larger parsed text. Limits of values are left to [`Settings::check`].
    ///
    /// # Errors
    /// A key is unknown, a value does not fit its type, or the version is not 1. The error has the position in the text.
    pub fn read(mut node: Node) -> Result<Settings, NodeError> {
        node.take("version").map(FileVersion::from_node).transpose()?;
        if let Some(ray) = node.at("ray") {
            let pixels = subsampling(|name| {
                let is_set = ray.at(name).and_then(|flag| flag.as_bool())?;
                ray.take(name).map(|_| is_set)
            });
            if let Some(pixels) = pixels {
                ray.add("subsampling", pixels);
            }
        }
        Settings::from_node(node)
    }

    /// Reads settings from a table with the keys of a scene file. Limits of values are left to [`Settings::check`].
    ///
    /// # Errors
    /// A key is unknown, a value does not fit its type, or the version is not 1.
    pub fn from_table(table: Table) -> Result<Settings, NodeError> {
        Settings::read(Node::from(Value::Table(table)))
    }

    /// The settings as a scene file.
    ///
    /// # Errors
    /// TOML cannot represent a value.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        tree::to_toml(self)
    }

    /// The settings as a table with the keys of a scene file.
    ///
    /// # Errors
    /// TOML cannot represent a value.
    pub fn to_table(&self) -> Result<Table, NodeError> {
        Table::from_node(self.to_node())
    }

    /// The settings as JSON. Numbers that are infinite or NaN become `null`.
    ///
    /// # Errors
    /// A value cannot be serialized.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        tree::to_json(self)
    }

    /// Renames keys of former versions in a table of settings to those of today, so that a later table overrides them.
    pub(crate) fn rename(table: &mut Table) {
        if let Some(Value::Table(ray)) = table.get_mut("ray") {
            let pixels = subsampling(|name| {
                let is_set = ray.get(name)?.as_bool()?;
                ray.remove(name).map(|_| is_set)
            });
            if let Some(pixels) = pixels {
                ray.entry("subsampling").or_insert(Value::Integer(pixels));
            }
        }
    }
}
