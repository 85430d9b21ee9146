//! Times and keys as a person writes them: `2s`, `ctrl+alt+q`.

use crate::kiosk::chord::Chord;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};
use std::time::Duration;

fn time<E: Error>(text: &str) -> Result<Duration, E> {
    humantime::parse_duration(text).map_err(|fault| E::custom(format!("{text:?} is no time: {fault}")))
}

fn say<S: Serializer>(time: Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&humantime::format_duration(time))
}

/// A time that is always there.
pub(super) mod always {
    use super::*;

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
        time(&String::deserialize(deserializer)?)
    }

    pub fn serialize<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
        say(*time, serializer)
    }
}

/// A time, or the word `none`.
pub(super) mod perhaps {
    use super::*;

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Duration>, D::Error> {
        let text = String::deserialize(deserializer)?;
        if text == "none" { Ok(None) } else { time(&text).map(Some) }
    }

    pub fn serialize<S: Serializer>(time: &Option<Duration>, serializer: S) -> Result<S::Ok, S::Error> {
        match time {
            Some(time) => say(*time, serializer),
            None => serializer.serialize_str("none"),
        }
    }
}

/// Keys, or the word `none`.
pub(super) mod keys {
    use super::*;

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Chord>, D::Error> {
        match String::deserialize(deserializer)?.as_str() {
            "none" => Ok(None),
            text => Chord::parse(text).map(Some).map_err(Error::custom),
        }
    }

    pub fn serialize<S: Serializer>(keys: &Option<Chord>, serializer: S) -> Result<S::Ok, S::Error> {
        match keys {
            Some(chord) => serializer.collect_str(chord),
            None => serializer.serialize_str("none"),
        }
    }
}
