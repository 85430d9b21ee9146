//! What two profiles do not have in common, before their times are held against each other.

use super::Profile;
use std::collections::BTreeMap;
use toml::{Table, Value};

/// In words, one difference a line, old before new.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Differences {
    /// The two ran different work: their times say nothing about each other.
    pub work: Vec<String>,
    /// The same work under other conditions: worth comparing, and worth knowing.
    pub conditions: Vec<String>,
}

impl Differences {
    pub fn between(old: &Profile, new: &Profile) -> Differences {
        let mut found = Differences::default();
        found.work.extend(settings(&old.scene, &new.scene));
        let sizes = [&old.sizes, &new.sizes];
        let work = [
            ("input", [old, new].map(|p| p.input.clone())),
            ("frame", sizes.map(|s| format!("{} x {} samples", s.frame[0], s.frame[1]))),
            ("slices", sizes.map(|s| s.slices.to_string())),
            ("volume", sizes.map(|s| format!("{} x {} x {} texels", s.volume[0], s.volume[1], s.volume[2]))),
            ("turn", [old, new].map(|p| format!("{} deg", p.turn))),
            ("picture", sizes.map(|s| format!("{} x {} pixels", s.picture[0], s.picture[1]))),
        ];
        let devices = [&old.device, &new.device];
        let conditions = [
            ("device", devices.map(|d| d.name.clone())),
            ("driver", devices.map(|d| d.driver.clone())),
            ("Vulkan", devices.map(|d| d.api.clone())),
            ("clocks", devices.map(|d| d.clocks.clone().unwrap_or_else(|| "not known".into()))),
            ("ns a tick", devices.map(|d| d.timestamp_period_ns.to_string())),
            ("time stamp bits", devices.map(|d| d.valid_bits.to_string())),
            ("program", [old, new].map(|p| p.program.clone())),
            ("repeats", [old, new].map(|p| p.repeats.to_string())),
            ("warm-up", [old, new].map(|p| p.warm_up.to_string())),
        ];
        for (list, pairs) in [(&mut found.work, &work[..]), (&mut found.conditions, &conditions[..])] {
            for (what, [old, new]) in pairs.iter().filter(|(_, [old, new])| old != new) {
                list.push(format!("{what}: {old} -> {new}"));
            }
        }
        found
    }
}

/// Setting by setting, under their full keys.
fn settings(old: &str, new: &str) -> Vec<String> {
    if old == new {
        return Vec::new();
    }
    let (Ok(old), Ok(new)) = (old.parse::<Table>(), new.parse::<Table>()) else {
        return vec!["scene: the settings differ, and at least one side is not TOML".into()];
    };
    let [mut a, mut b] = [BTreeMap::new(), BTreeMap::new()];
    flatten("", &Value::Table(old), &mut a);
    flatten("", &Value::Table(new), &mut b);
    let missing = "not set";
    let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let value = |side: &BTreeMap<String, String>, key: &String| side.get(key).map_or(missing.into(), String::clone);
    let pairs = keys.into_iter().map(|key| (key, value(&a, key), value(&b, key)));
    pairs.filter(|(_, old, new)| old != new).map(|(key, old, new)| format!("scene {key}: {old} -> {new}")).collect()
}

fn flatten(key: &str, value: &Value, into: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) if !table.is_empty() || key.is_empty() => {
            for (name, inner) in table {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                flatten(&key, inner, into);
            }
        }
        other => {
            into.insert(key.into(), other.to_string());
        }
    }
}
