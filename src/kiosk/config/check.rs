//! What each key may be, and what is looked at before anything is opened.

use super::error::ConfigError;
use super::{Config, PHANTOM};
use crate::scene::Settings;
use crate::scene::load::transfer_file;
use serde::Deserialize;
use std::time::Duration;

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

impl Config {
    /// A recording is the source.
    pub(super) fn is_file(&self) -> bool {
        self.source != PHANTOM && !self.source.contains("://")
    }

    pub(super) fn check(&self, text: &str) -> Result<(), ConfigError> {
        let unless = |right: bool, key: &str| match (right, allowed(key)) {
            (true, _) => Ok(()),
            (false, allowed) => {
                Err(self.places.fault(key, &format!("must be {}", allowed.unwrap_or("something else"))))
            }
        };
        // A service has no standard input.
        let network = self.source.strip_prefix("igtl://").is_some_and(|host| !host.is_empty());
        let is_source = network || self.source == PHANTOM || (self.is_file() && !["", "-"].contains(&&*self.source));
        unless(is_source, "source")?;
        if self.forever && self.rounds.is_some() {
            return Err(self.places.fault("loop", "cannot be true beside rounds: set one of them"));
        }
        let whole = self.motor.as_ref().is_none_or(|motor| motor.port.is_some() && motor.sweeps.is_some());
        unless(whole, "motor")?;
        let display = &self.display;
        unless(display.size.iter().all(|edge| (64..=16384).contains(edge)), "display.size")?;
        unless((0.5..=4.0).contains(&display.scale), "display.scale")?;
        let time = |time: Duration, [from, to]: [u64; 2]| {
            (Duration::from_millis(from)..=Duration::from_millis(to)).contains(&time)
        };
        unless(display.budget.is_none_or(|budget| time(budget, [1, 10_000])), "display.budget")?;
        unless(display.report.is_none() || display.budget.is_some(), "display.report")?;
        let (live, files) = (&self.live, &self.files);
        unless((1..=1000).contains(&live.cine_volumes), "live.cine_volumes")?;
        unless((16..=65536).contains(&live.cine_memory_mb), "live.cine_memory_mb")?;
        unless(time(live.retry, [100, 600_000]), "live.retry")?;
        unless((1..=1024).contains(&files.log_size_mb), "files.log_size_mb")?;
        unless((1..=100).contains(&files.log_files), "files.log_files")?;
        self.check_scene(text)
    }

    /// As a scene file is, with the line.
    fn check_scene(&self, text: &str) -> Result<(), ConfigError> {
        #[derive(Deserialize)]
        struct Rest {
            #[serde(default, rename = "scene")]
            _scene: Settings,
        }
        // By itself first: merged settings no longer know their lines. A transfer function that lies in a file is none yet.
        if transfer_file(&self.scene).is_none() {
            toml::from_str::<Rest>(text).map_err(|e| self.places.refuse(&e))?;
        }
        for preset in &self.preset {
            let known = crate::scene::load::Layers::default().preset(preset);
            known.map_err(|e| self.places.fault("preset", &e.to_string()))?;
        }
        let settings = self.layers().and_then(|layers| layers.finish());
        let settings = settings.map_err(|e| self.places.fault("scene", &e.to_string()))?;
        settings.check().map_err(|e| self.places.fault(&format!("scene.{}", e.field), &e.fault))
    }
}
