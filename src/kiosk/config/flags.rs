//! The keys of the source as the flags that they stand for, so that one place knows what those may be; and back, in messages.

use super::error::ConfigError;
use super::{Config, Motor};
use std::path::Path;

/// Every key that stands for a flag.
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

/// The flag that a key stands for.
fn flag(key: &str) -> String {
    match key {
        "motor.port" => "--motor".into(),
        key => format!("--{}", key.trim_start_matches("motor.").replace('_', "-")),
    }
}

impl Config {
    /// The arguments of `echolume stream` that say the same of where frames come from, each as one word `--flag=value`.
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

    /// A message about those arguments as one about the file: it names keys where it named flags, and the line of the first.
    pub fn refuse(&self, message: &str) -> ConfigError {
        let mut said = message.to_string();
        let mut first: Option<(usize, &str)> = None;
        for key in KEYS {
            let flag = flag(key);
            let mut from = 0;
            while let Some(at) = said[from..].find(&flag).map(|at| from + at) {
                let end = at + flag.len();
                from = end;
                // Not the beginning of a longer one.
                if said[end..].starts_with(|c: char| c == '-' || c.is_alphanumeric()) {
                    continue;
                }
                // What usage says of the value belongs to the flag.
                let value = said[end..].strip_prefix(" <").and_then(|rest| rest.find('>')).map_or(0, |n| n + 3);
                said.replace_range(at..end + value, key);
                from = at + key.len();
                first = Some(first.filter(|(earlier, _)| *earlier < at).unwrap_or((at, key)));
            }
        }
        match first {
            // It begins with the key itself, and the value.
            Some((0, key)) => self.places.fault(key, said[key.len()..].trim_start_matches([':', ' '])),
            Some((_, key)) => self.places.fault(key, &said),
            None => self.places.fault("", &said),
        }
    }
}
