//! Converts the keys of the source to the flags of `echolume stream`, which are checked in one place; and flags back to keys in messages.

use super::error::ConfigError;
use super::{Config, Motor};
use std::path::Path;

/// All keys that correspond to flags.
const KEYS: &[&str] = &[
    "source",
    "probe",
    "rate",
    "real_time",
    "rounds",
    "tool",
    "clip",
    "spacing",
    "hole",
    "motor.port",
    "motor.angle",
    "motor.sweeps",
    "motor.homed",
    "motor.delay",
    "motor.stamps",
    "motor.baud",
    "motor.parity",
    "motor.stop_bits",
    "motor.timeout",
];

/// The flag of a key.
fn flag(key: &str) -> String {
    match key {
        "motor.port" => "--motor".into(),
        key => format!("--{}", key.trim_start_matches("motor.").replace('_', "-")),
    }
}

impl Config {
    /// The arguments of `echolume stream` for the same source, each as one word `--flag=value`.
    pub fn source_arguments(&self) -> Vec<String> {
        let path = |path: &Path| path.to_string_lossy().into_owned();
        let clip = self.clip.map(|clip| clip.map(|n| n.to_string()).join(","));
        let rounds = if self.forever { Some(u32::MAX) } else { self.rounds };
        let Motor { port, angle, sweeps, homed, delay, stamps, baud, parity, stop_bits, timeout } =
            self.motor.clone().unwrap_or_default();
        fn text<T: ToString>(value: Option<T>) -> Option<String> {
            value.map(|value| value.to_string())
        }
        let values = [
            ("source", Some(self.source.clone())),
            ("probe", self.probe.as_deref().map(path)),
            ("rate", text(self.rate)),
            ("rounds", text(rounds)),
            ("tool", self.tool.clone()),
            ("clip", clip),
            ("spacing", text(self.spacing)),
            ("hole", text(self.hole)),
            ("motor.port", port),
            ("motor.angle", text(angle)),
            ("motor.sweeps", text(sweeps)),
            ("motor.delay", text(delay)),
            ("motor.baud", text(baud)),
            ("motor.parity", parity),
            ("motor.stop_bits", text(stop_bits)),
            ("motor.timeout", text(timeout)),
        ];
        let switches = [("real_time", self.real_time), ("motor.homed", homed), ("motor.stamps", stamps)];
        let values = values.into_iter().filter_map(|(key, value)| Some(format!("{}={}", flag(key), value?)));
        values.chain(switches.into_iter().filter(|(_, on)| *on).map(|(key, _)| flag(key))).collect()
    }

    /// Converts a message about those arguments to one about the file: with keys instead of flags, and the line of the first key.
    pub fn flag_error(&self, message: &str) -> ConfigError {
        let mut text_with_keys = message.to_string();
        let mut first: Option<(usize, &str)> = None;
        for key in KEYS {
            let flag = flag(key);
            let mut from = 0;
            while let Some(at) = text_with_keys[from..].find(&flag).map(|at| from + at) {
                let end = at + flag.len();
                from = end;
                // Not the start of a longer flag.
                if text_with_keys[end..].starts_with(|c: char| c == '-' || c.is_alphanumeric()) {
                    continue;
                }
                // The placeholder of the value, such as `<N>`, belongs to the flag.
                let value =
                    text_with_keys[end..].strip_prefix(" <").and_then(|rest| rest.find('>')).map_or(0, |n| n + 3);
                text_with_keys.replace_range(at..end + value, key);
                from = at + key.len();
                first = Some(first.filter(|(earlier, _)| *earlier < at).unwrap_or((at, key)));
            }
        }
        match first {
            // The message begins with the key and its value.
            Some((0, key)) => self.locations.error_at(key, text_with_keys[key.len()..].trim_start_matches([':', ' '])),
            Some((_, key)) => self.locations.error_at(key, &text_with_keys),
            None => self.locations.error_at("", &text_with_keys),
        }
    }
}
