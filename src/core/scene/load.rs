//! Layers of settings: defaults, presets, a scene file and the command line. Each layer overrides the one before.

use super::file_version::FileVersion;
use super::look::is_look;
use super::{Settings, SharedLabels, TransferPoint};
use crate::files;
use crate::text::printable;
use crate::tree::{self, Fault, FromNode, Node, NodeError, ToNode};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Maximum size of a settings file, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// The built-in presets: name and TOML text of each.
pub const PRESETS: &[(&str, &str)] = &[
    ("bmode", include_str!("presets/bmode.toml")),
    ("bone", include_str!("presets/bone.toml")),
    ("face", include_str!("presets/face.toml")),
    ("face-classic", include_str!("presets/face-classic.toml")),
    ("fetal", include_str!("presets/fetal.toml")),
    ("glass", include_str!("presets/glass.toml")),
    ("skeleton", include_str!("presets/skeleton.toml")),
    ("thesis", include_str!("presets/thesis.toml")),
    ("vessel", include_str!("presets/vessel.toml")),
];

/// Keys of one table that give the same size in two units.
const RIVALS: &[(&str, &str)] = &[
    ("median", "median_mm"),
    ("window", "window_mm"),
    ("largest", "largest_mm"),
    ("pixels", "mm"),
    ("elevation", "elevation_mm"),
    ("low_pass", "low_pass_mm"),
];

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    #[error("preset {name:?} is unknown; there are: {}", PRESETS.iter().map(|p| p.0).collect::<Vec<_>>().join(", "))]
    UnknownPreset { name: String },
    #[error("{path}: {fault}")]
    File { path: String, fault: String },
    #[error("{layer}: {fault}")]
    Layer { layer: String, fault: String },
}

/// Layers of settings as TOML tables, merged key by key: each layer overrides the ones before.
#[derive(Clone, Debug, Default)]
pub struct Layers {
    merged: Table,
    /// The presets among them.
    presets: Vec<String>,
    /// The paths of the values that other layers than presets give.
    given: BTreeSet<String>,
    /// The files of transfer functions that were read.
    transfers: BTreeSet<PathBuf>,
    /// The labels that are shown, which are in no table.
    labels: Option<SharedLabels>,
}

impl Layers {
    /// Sets the labels that the settings show, in place of any before.
    pub fn show_labels(&mut self, labels: SharedLabels) {
        self.labels = Some(labels);
    }

    /// One layer that holds all of `settings`. None if they cannot be written as TOML.
    pub fn of(settings: &Settings) -> Option<Layers> {
        let labels = settings.labels.volume.clone();
        settings.to_table().ok().map(|merged| Layers { merged, labels, ..Layers::default() })
    }

    /// These layers with those of `over` on top. The result keeps presets and given values of `over` only.
    pub(super) fn with(mut self, over: &Layers) -> Layers {
        merge(&mut self.merged, over.merged.clone(), &mut Vec::new());
        // A `none` of these layers left nothing to merge.
        for path in over.given.iter().filter(|path| !holds(&over.merged, path)) {
            remove(&mut self.merged, path);
        }
        Layers { presets: over.presets.clone(), given: over.given.clone(), labels: over.labels.clone(), ..self }
    }

    /// The names of the built-in presets in the order in which they were added ([`Layers::preset`]). Presets of the user ([`Layers::look`]) are not
    /// among them.
    pub fn presets(&self) -> &[String] {
        &self.presets
    }

    /// True if a layer other than a built-in preset sets the value at `path`, a value in the table at `path`, or the table that contains it.
    pub fn gives(&self, path: &str) -> bool {
        self.given.iter().any(|given| {
            let (longer, shorter) =
                if given.len() > path.len() { (given.as_str(), path) } else { (path, given.as_str()) };
            longer.strip_prefix(shorter).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    }

    /// True if any layer, presets included, sets the value or table at `path`.
    pub fn has(&self, path: &str) -> bool {
        self.gives(path) || holds(&self.merged, path)
    }

    /// The files of transfer functions that the layers read, whether a flag or a file of settings names them.
    pub fn transfer_files(&self) -> impl Iterator<Item = &Path> {
        self.transfers.iter().map(PathBuf::as_path)
    }

    pub fn preset(&mut self, name: &str) -> Result<(), LoadError> {
        let (_, text) =
            PRESETS.iter().find(|p| p.0 == name).ok_or_else(|| LoadError::UnknownPreset { name: name.to_string() })?;
        let given = self.given.clone();
        self.add(&format!("preset {name}"), text, None)?;
        self.given = given;
        self.presets.push(name.to_string());
        Ok(())
    }

    /// Adds a user's preset: the look of `settings` replaces that of the layers so far, and counts as set by the user ([`Layers::gives`]). `name` is
    /// for messages.
    ///
    /// # Errors
    /// The layers so far are no valid settings, or the settings cannot be written as TOML.
    pub fn look(&mut self, name: &str, settings: &Settings) -> Result<(), LoadError> {
        let fault =
            |e: &dyn std::fmt::Display| LoadError::Layer { layer: format!("preset {name}"), fault: e.to_string() };
        let before = self.settings().map_err(|e| fault(&e))?;
        self.merged = settings.look_over(&before).to_table().map_err(|e| fault(&e))?;
        let mut given = BTreeSet::new();
        add_paths(&settings.to_table().map_err(|e| fault(&e))?, "", &mut given);
        self.given.extend(given.into_iter().filter(|path| is_look(path)));
        Ok(())
    }

    /// Adds the presets of the built-in phantom: `face-classic`, which shows the face as a lit surface. If `is_plain` (the user chose no look), it
    /// adds `face` over it, volume rendering with a light volume.
    ///
    /// # Errors
    /// None in practice: the presets are embedded, and a test reads them.
    pub fn phantom(&mut self, is_plain: bool) -> Result<(), LoadError> {
        self.preset("face-classic")?;
        if is_plain { self.preset("face") } else { Ok(()) }
    }

    pub fn file(&mut self, path: &Path) -> Result<(), LoadError> {
        let text = read(path, "scene")?;
        self.add(&path.display().to_string(), &text, path.parent())
    }

    /// Adds a layer: a table with the keys of a scene file. `layer` names it in messages; relative file names in it refer to `folder`.
    ///
    /// # Errors
    /// One line: a value is invalid, alone or with the layers so far, or a file that it names cannot be read.
    pub fn table(&mut self, layer: &str, table: Table, folder: &Path) -> Result<(), LoadError> {
        self.merge_checked(layer, table, Some(folder))
    }

    /// Adds the assignment of a flag `--set key.path=value`. The value is TOML, or a plain word.
    ///
    /// # Errors
    /// One line: it is no assignment, the value is invalid, alone or with the layers so far, or a file that it names cannot be read.
    pub fn set(&mut self, assignment: &str) -> Result<(), LoadError> {
        self.set_by(&format!("--set {assignment}"), assignment)
    }

    /// Adds an assignment `key.path=value`, whose value is TOML or a plain word. `flag`: the flag that it comes from, as it was typed, for messages.
    ///
    /// # Errors
    /// One line: it is no assignment, the value is invalid, alone or with the layers so far, or a file that it names cannot be read.
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
        put(&mut layer, path.trim(), value);
        self.merge_checked(flag, layer, None)
    }

    fn add(&mut self, layer: &str, text: &str, folder: Option<&Path>) -> Result<(), LoadError> {
        let fault = |e: &NodeError| LoadError::Layer { layer: layer.into(), fault: one_line(e, text) };
        let mut table = toml::from_str::<Table>(text).map_err(|e| fault(&e.into()))?;
        if let Some(version) = table.remove("version") {
            FileVersion::from_node(Node::from(version)).map_err(|e| fault(&e))?;
        }
        // Check this layer alone first: only then can a message name its line.
        if transfer_file(&table).is_none() {
            let mut without_none = Table::new();
            merge(&mut without_none, table.clone(), &mut Vec::new());
            if Settings::from_table(without_none).is_err() {
                let refused =
                    |e: &NodeError| e.span().and_then(|span| text.get(span)).map(|t| t.trim_matches(['"', '\'']));
                // A `none` that removes a setting is refused by the text alone. Then another one is at fault, and the check below names it.
                Settings::from_toml(text).or_else(|e| match refused(&e) {
                    Some("none") => Ok(Settings::default()),
                    _ => Err(fault(&e)),
                })?;
            }
        }
        self.merge_checked(layer, table, folder)
    }

    /// Checks the merged settings after every layer, so that the message names the layer at fault.
    fn merge_checked(&mut self, layer: &str, mut table: Table, folder: Option<&Path>) -> Result<(), LoadError> {
        if let Some(name) = transfer_file(&table) {
            let path = folder.unwrap_or(Path::new("")).join(name);
            let points = points(&path)?;
            self.transfers.insert(path);
            if let Some(Value::Table(volume)) = table.get_mut("volume") {
                volume.insert("transfer".into(), points);
            }
        }
        Settings::rename(&mut table);
        add_paths(&table, "", &mut self.given);
        merge(&mut self.merged, table, &mut Vec::new());
        self.settings().map(drop).map_err(|e| LoadError::Layer { layer: layer.into(), fault: one_line(&e, "") })
    }

    fn settings(&self) -> Result<Settings, NodeError> {
        let mut settings = Settings::from_table(self.merged.clone())?;
        settings.labels.volume.clone_from(&self.labels);
        Ok(settings)
    }

    /// The settings of all layers together.
    ///
    /// # Errors
    /// One line: the layers together are no valid settings.
    pub fn finish(self) -> Result<Settings, LoadError> {
        self.settings().map_err(|e| LoadError::Layer { layer: "scene".into(), fault: one_line(&e, "") })
    }
}

/// `current`, with every value that differs between `before` and `after` set to that of `after`, unless `current` itself differs from `before` there.
/// A table in which `current` differs stays, even if `after` lacks it. None if the result is no valid settings.
pub fn rebase(current: &Settings, before: &Settings, after: &Settings) -> Option<Settings> {
    let table = |settings: &Settings| settings.to_table().ok();
    let mut rebased = table(current)?;
    rebase_table(&mut rebased, &table(before)?, &table(after)?);
    let mut rebased = Settings::from_table(rebased).ok()?;
    rebased.labels.volume.clone_from(&current.labels.volume);
    Some(rebased)
}

fn rebase_table(current: &mut Table, before: &Table, after: &Table) {
    let keys: BTreeSet<String> = before.keys().chain(after.keys()).cloned().collect();
    for key in keys {
        let was = before.get(&key);
        if current.get(&key) == was {
            match after.get(&key) {
                Some(value) => drop(current.insert(key, value.clone())),
                None => drop(current.remove(&key)),
            }
        } else if let (Some(Value::Table(current)), Some(Value::Table(was)), Some(Value::Table(after))) =
            (current.get_mut(&key), was, after.get(&key))
        {
            rebase_table(current, was, after);
        }
    }
}

/// The settings that a preset alone makes. None if there is no such preset.
pub(super) fn preset_settings(name: &str) -> Option<Settings> {
    let mut layers = Layers::default();
    layers.preset(name).ok()?;
    layers.finish().ok()
}

/// Adds the paths of all values of a table.
fn add_paths(table: &Table, before: &str, paths: &mut BTreeSet<String>) {
    for (key, value) in table {
        let path = if before.is_empty() { key.clone() } else { format!("{before}.{key}") };
        match value {
            Value::Table(inner) if !inner.is_empty() => add_paths(inner, &path, paths),
            _ => drop(paths.insert(path)),
        }
    }
}

/// True if a table has a value at `path`.
fn holds(table: &Table, path: &str) -> bool {
    match path.split_once('.') {
        None => table.contains_key(path),
        Some((key, rest)) => table.get(key).and_then(Value::as_table).is_some_and(|inner| holds(inner, rest)),
    }
}

/// Sets `key.path` in a table.
pub(super) fn put(table: &mut Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => drop(table.insert(path.into(), value)),
        Some((key, rest)) => {
            let inner = table.entry(key).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(inner) = inner {
                put(inner, rest, value);
            }
        }
    }
}

fn remove(table: &mut Table, path: &str) {
    match path.split_once('.') {
        None => drop(table.remove(path)),
        Some((key, rest)) => {
            if let Some(Value::Table(inner)) = table.get_mut(key) {
                remove(inner, rest);
            }
        }
    }
}

/// Reads a text file of at most 1 MiB. `what` names the kind of file in messages.
///
/// # Errors
/// The file cannot be read, is larger than 1 MiB, or is no UTF-8.
pub fn read(path: &Path, what: &str) -> Result<String, LoadError> {
    files::read_text(path, MAX_BYTES, what).map_err(|fault| LoadError::File { path: path.display().to_string(), fault })
}

/// The name of the file of transfer function points that `volume.transfer` of a layer's table states. None if it is no name that ends with `.toml`.
pub fn transfer_file(table: &Table) -> Option<String> {
    let name = table.get("volume")?.get("transfer")?.as_str()?;
    name.ends_with(".toml").then(|| name.to_string())
}

/// Reads a transfer function file: a list `points` of { at, colour, opacity }.
fn points(path: &Path) -> Result<Value, LoadError> {
    #[derive(FromNode)]
    #[tree(deny_unknown_fields)]
    struct Listed {
        points: Vec<TransferPoint>,
    }
    let text = read(path, "transfer function")?;
    let fault = |e: &dyn std::fmt::Display| LoadError::File { path: path.display().to_string(), fault: e.to_string() };
    let listed = tree::from_toml::<Listed>(&text).map_err(|e| fault(&one_line(&e, &text)))?;
    listed.points.to_node().into_toml().map_err(|e| fault(&e))
}

/// Merges `over` into `under`, which is at `path` in the scene. The word `none` removes a setting that may be absent.
fn merge(under: &mut Table, over: Table, path: &mut Vec<String>) {
    // A size in one unit takes the place of an earlier layer's in the other.
    for (pixels, mm) in RIVALS {
        let gives = |key: &str| over.get(key).is_some_and(|value| value.as_str() != Some("none"));
        match (gives(pixels), gives(mm)) {
            (true, false) => drop(under.remove(*mm)),
            (false, true) => drop(under.remove(*pixels)),
            _ => {}
        }
    }
    for (key, value) in over {
        path.push(key.clone());
        match (under.get_mut(&key), value) {
            (_, Value::String(word)) if word == "none" && may_be_absent(path) => drop(under.remove(&key)),
            (Some(Value::Table(under)), Value::Table(over)) => merge(under, over, path),
            // So that a `none` within the table is seen.
            (None, Value::Table(over)) => {
                let mut inner = Table::new();
                merge(&mut inner, over, path);
                under.insert(key, Value::Table(inner));
            }
            (_, value) => drop(under.insert(key, value)),
        }
        path.pop();
    }
}

/// True if a scene may have no value at this path: a table, as `light.shadow`, or an optional value, as `ray.step`.
fn may_be_absent(path: &[String]) -> bool {
    let nested =
        path.iter().rev().fold(Table::new(), |inner, key| Table::from_iter([(key.clone(), Value::Table(inner))]));
    match Settings::from_table(nested) {
        Ok(_) => true,
        // A table with fields that must be given is one too.
        Err(e) if e.fault() == Fault::MissingKey => true,
        Err(e) if e.fault() == Fault::UnknownKey => false,
        // A value. Settings without a value are not written.
        Err(_) => {
            let written = Value::Table(Settings::default().to_table().unwrap_or_default());
            path.iter().try_fold(&written, |at, key| at.get(key)).is_none()
        }
    }
}

fn one_line(error: &NodeError, text: &str) -> String {
    let span = error.span().filter(|_| !text.is_empty());
    let place = span.map_or(String::new(), |span| format!("line {}: ", line_of(text, span.start)));
    place + &printable(error.message())
}

/// The number, from 1, of the line that contains the byte at index `byte` of a text.
pub fn line_of(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|b| *b == b'\n').count() + 1
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
    fn none_switches_off_what_a_preset_asked_for() {
        let mut layers = Layers::default();
        layers.preset("fetal").unwrap();
        layers.set("light.shadow=none").unwrap();
        let settings = layers.finish().unwrap();
        assert!(settings.light.shadow.is_none() && settings.light.occlusion.is_some());
    }

    #[test]
    fn a_size_in_one_unit_takes_the_place_of_an_earlier_one_in_the_other() {
        let sizes = |sets: &[&str]| {
            let mut layers = Layers::default();
            layers.preset("fetal").unwrap();
            sets.iter().for_each(|set| layers.set(set).unwrap());
            let settings = layers.finish().unwrap();
            let smooth = settings.slices.smooth.unwrap();
            (settings.distance.median, settings.distance.median_mm, smooth.elevation, smooth.elevation_mm)
        };
        assert_eq!(sizes(&[]), (19, None, 1.4, None));
        assert_eq!(sizes(&["distance.median_mm=4"]), (0, Some(4.0), 1.4, None));
        assert_eq!(sizes(&["distance.median_mm=4", "distance.median=7"]), (7, None, 1.4, None));
        assert_eq!(sizes(&["distance.median_mm=none"]), (19, None, 1.4, None));
        assert_eq!(sizes(&["slices.smooth.elevation_mm=2.5"]), (19, None, 0.0, Some(2.5)));
        assert_eq!(sizes(&["slices.smooth={elevation=1,elevation_mm=2.5}"]), (19, None, 1.0, Some(2.5)));
    }

    #[test]
    fn none_works_in_a_file_and_for_any_setting_that_may_be_absent() {
        let mut layers = Layers::default();
        layers.preset("face-classic").unwrap();
        let text = "[ray]\nstep = 'none'\n[camera]\ntarget = 'none'\n[distance]\nbilateral = 'none'\n[slices]\nestimator = 'none'";
        layers.add("scene.toml", text, None).unwrap();
        let settings = layers.clone().finish().unwrap();
        assert_eq!((settings.ray.step, settings.camera.target, settings.distance.bilateral), (None, None, None));
        assert_eq!(settings.post.colour_map, super::super::ColourMap::None);
        for wrong in ["ray.stp=none", "ray.entries=none", "mode=none", "light.shadow.depth=none"] {
            assert!(layers.set(wrong).is_err(), "{wrong}");
        }
        for (text, line) in [("[ray]\nentries = 'none'", ""), ("[ray]\nstep = 'none'\nentries = 'x'", "line 3")] {
            let said = layers.add("scene.toml", text, None).unwrap_err().to_string();
            assert!(said.contains(line) && said.lines().count() == 1, "{said}");
        }
    }

    #[test]
    fn a_transfer_function_may_lie_in_a_file_of_its_own() {
        let work = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-transfer-").unwrap();
        let folder = work.path();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        write(
            "fire.toml",
            "points = [{ at = 0, colour = [0, 0, 0], opacity = 0 }, { at = 1, colour = [1, 0.5, 0], opacity = 0.5 }]",
        );
        write("scene.toml", "[volume]\ntransfer = 'fire.toml'");
        write("broken.toml", "points = [{ at = 0, color = [0, 0, 0] }]");
        let mut layers = Layers::default();
        layers.file(&folder.join("scene.toml")).unwrap();
        let crate::scene::Transfer::Points(points) = layers.finish().unwrap().volume.transfer else { panic!("points") };
        assert_eq!((points.len(), points[1].colour), (2, [1.0, 0.5, 0.0]));
        let broken = format!("volume.transfer={}", folder.join("broken.toml").display());
        let error = Layers::default().set(&broken).unwrap_err().to_string();
        assert!(error.contains("broken.toml") && error.contains("color") && error.lines().count() == 1, "{error}");
        let missing = Layers::default().set("volume.transfer=missing.toml").unwrap_err().to_string();
        assert!(missing.contains("missing.toml: cannot be read"), "{missing}");
    }

    #[test]
    fn flags_of_before_are_read_as_subsampling() {
        let of = |sets: &[&str]| {
            let mut layers = Layers::default();
            sets.iter().try_for_each(|set| layers.set(set)).map(|()| layers.finish().expect("settings").ray.subsampling)
        };
        for (sets, pixels) in [
            (&["ray.half=true"][..], 2),
            (&["ray.quarter=true", "ray.half=false"], 1),
            (&["ray={half=true,eighth=true}"], 8),
            (&["ray={half=true,subsampling=4}"], 4),
            (&["ray.half=true", "ray.subsampling=1"], 1),
            (&["ray.subsampling=1", "ray.quarter=true"], 4),
        ] {
            assert_eq!(of(sets).expect("read"), pixels, "{sets:?}");
        }
        assert!(of(&["ray.half=2"]).unwrap_err().to_string().contains("half"));
        let mut layers = Layers::default();
        layers.add("scene", "mode = 'sr'\n[ray]\nquarter = true\n", None).expect("a file of before");
        assert_eq!(layers.finish().expect("settings").ray.subsampling, 4);
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

    /// Prevents a pasted assignment that works only over a preset which happens to set the same table.
    #[test]
    fn none_switches_off_what_an_earlier_layer_set_and_what_none_did() {
        for path in [
            "slices.smooth",
            "slices.sigma",
            "slices.enhanced_sigma",
            "slices.perona_malik",
            "distance.bilateral",
            "post.sigma",
            "light.shadow",
            "light.occlusion",
            "light.skin",
        ] {
            let mut layers = Layers::default();
            layers.set(&format!("{path}=none")).expect(path);
            let fields = if path == "distance.bilateral" { "{pixels=2,distance=3}" } else { "{}" };
            layers.set(&format!("{path}={fields}")).expect(path);
            assert_ne!(layers.settings().expect("settings"), Settings::default(), "{path} has an effect");
            layers.set(&format!("{path}=none")).expect(path);
            layers.set(&format!("{path}=none")).expect(path);
            assert_eq!(layers.finish().expect("settings"), Settings::default(), "{path}");
        }
        // A word of its own, numbers, and keys that do not exist.
        let mut layers = Layers::default();
        layers.set("volume.shading=none").expect("a word");
        for wrong in ["slices.smoooth=none", "camera.zoom=none", "light.shadow.softness=none", "none=none"] {
            assert!(layers.set(wrong).is_err(), "{wrong}");
        }
    }
}
