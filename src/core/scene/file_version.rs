//! The version that files of settings state.

use crate::tree::{FromNode, Node, NodeError, ToNode};

/// The version of a file of settings, its key `version`: 1, also where the file states none. A file of any other version is refused, because its keys
/// may have other meanings. New keys that change nothing where they are absent do not make a new version.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FileVersion;

impl FileVersion {
    const NUMBER: i64 = 1;
}

impl FromNode for FileVersion {
    fn from_node(node: Node) -> Result<FileVersion, NodeError> {
        match i64::from_node(node.clone())? {
            FileVersion::NUMBER => Ok(FileVersion),
            other => Err(node.fault(format!("version {other}: this program reads version {}", FileVersion::NUMBER))),
        }
    }
}

impl ToNode for FileVersion {
    fn to_node(&self) -> Node {
        FileVersion::NUMBER.to_node()
    }
}
