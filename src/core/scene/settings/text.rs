//! Settings as TOML and JSON. The code of serde for their some hundred types is compiled here, once for reading and once for writing: other members call
//! these functions.

use super::Settings;
use crate::tree::{Node, NodeError};
use serde::Deserialize;
use toml::{Table, Value};

impl Settings {
    /// The settings of a scene file.
    ///
    /// # Errors
    /// The text is no TOML, or a value is not what its setting asks for; with its place.
    pub fn from_toml(text: &str) -> Result<Settings, NodeError> {
        Settings::from_node(Node::parse(text)?)
    }

    /// The settings of a part of a larger text.
    ///
    /// # Errors
    /// A value is not what its setting asks for; with its place in the text.
    pub fn from_node(node: Node) -> Result<Settings, NodeError> {
        Settings::deserialize(node)
    }

    /// The settings of a table with the keys of a scene file.
    ///
    /// # Errors
    /// A value is not what its setting asks for.
    pub fn from_table(table: Table) -> Result<Settings, NodeError> {
        Settings::from_node(Node::from(Value::Table(table)))
    }

    /// The settings as a scene file.
    ///
    /// # Errors
    /// A value that TOML does not have.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self.erased())
    }

    /// The settings as a table with the keys of a scene file.
    ///
    /// # Errors
    /// A value that TOML does not have.
    pub fn to_table(&self) -> Result<Table, toml::ser::Error> {
        Table::try_from(self.erased())
    }

    /// The settings as JSON.
    ///
    /// # Errors
    /// A value that JSON does not have.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self.erased())
    }

    fn erased(&self) -> &dyn erased_serde::Serialize {
        self
    }
}
