//! The version that files of settings state.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The version of a file of settings, its key `version`: 1, also where the file states none. A file of any other version is refused, because its keys
/// may have other meanings. New keys that change nothing where they are absent do not make a new version.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FileVersion;

impl FileVersion {
    const NUMBER: i64 = 1;
}

impl<'de> Deserialize<'de> for FileVersion {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<FileVersion, D::Error> {
        match i64::deserialize(deserializer)? {
            FileVersion::NUMBER => Ok(FileVersion),
            other => {
                Err(D::Error::custom(format!("version {other}: this program reads version {}", FileVersion::NUMBER)))
            }
        }
    }
}

impl Serialize for FileVersion {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_i64(FileVersion::NUMBER)
    }
}
