//! The presets of a user: named looks in one file. The view saves, renames and deletes them, and `--preset` takes them by name.

use crate::files;
use crate::scene::Settings;
use crate::scene::load::{PRESETS, line_of};
use crate::text::printable;
use crate::tree::{self, FromNode, ToNode};
use std::path::Path;
use toml::Table;

/// Maximum size of the file, bytes.
const MAX_BYTES: u64 = 4 << 20;
/// The version of the file that this program writes and reads.
const VERSION: u32 = 1;
/// Largest number of presets in a file.
pub const MAX_PRESETS: usize = 32;
/// Longest name of a preset, characters.
pub const MAX_NAME: usize = 40;

/// A preset that a user saved: a name, and the settings of a look.
#[derive(Clone, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct UserPreset {
    pub name: String,
    /// Settings of a scene file. They are read when they are used: one preset of another version leaves the others usable.
    settings: Table,
}

#[derive(FromNode, ToNode)]
#[tree(deny_unknown_fields)]
struct Kept {
    version: u32,
    #[tree(default)]
    preset: Vec<UserPreset>,
}

impl UserPreset {
    /// A preset of this name with those of `settings` that belong to a look.
    ///
    /// # Errors
    /// One line: the name is not allowed, or the settings cannot be written as TOML.
    pub fn new(name: &str, settings: &Settings) -> Result<UserPreset, String> {
        let name = checked_name(name)?;
        let settings = settings.look().to_table();
        settings.map(|settings| UserPreset { name, settings }).map_err(|e| format!("a preset cannot be written: {e}"))
    }

    /// The settings of the preset. Settings that belong to an examination and not to a look have their defaults.
    ///
    /// # Errors
    /// One line that names the preset: a setting is not known, or not allowed.
    pub fn look(&self) -> Result<Settings, String> {
        let fault = |e: &str| format!("preset {:?}: {}", self.name, printable(e));
        let settings = Settings::from_table(self.settings.clone()).map_err(|e| fault(e.message()))?;
        settings.check().map_err(|e| fault(&e.to_string()))?;
        Ok(settings.look())
    }
}

/// The name without blanks at its ends.
///
/// # Errors
/// One line: it is empty, longer than [`MAX_NAME`], has control characters, or is that of a built-in preset.
pub fn checked_name(name: &str) -> Result<String, String> {
    let name = spelled(name)?;
    match PRESETS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)) {
        Some((known, _)) => Err(format!("{known} is a built-in preset: choose another name")),
        None => Ok(name.into()),
    }
}

/// A name without blanks at its ends.
fn spelled(name: &str) -> Result<&str, String> {
    let name = name.trim();
    match name.is_empty() || name.chars().count() > MAX_NAME || name.chars().any(char::is_control) {
        true => Err(format!("a preset has a name of 1 to {MAX_NAME} letters")),
        false => Ok(name),
    }
}

/// Reads the presets in a file; none if there is no file.
///
/// # Errors
/// One line that names the file: it cannot be read, is damaged, or is of another version.
pub fn read(file: &Path) -> Result<Vec<UserPreset>, String> {
    let fault = |fault: &str| format!("{}: {}", file.display(), printable(fault));
    if file.symlink_metadata().is_err_and(|e| e.kind() == std::io::ErrorKind::NotFound) {
        return Ok(Vec::new());
    }
    let text = files::read_text(file, MAX_BYTES, "list of presets").map_err(|e| fault(&e))?;
    let kept: Kept = tree::from_toml(&text).map_err(|e| {
        let line = e.span().map_or(String::new(), |span| format!("line {}: ", line_of(&text, span.start)));
        fault(&format!("{line}{}", e.message()))
    })?;
    if kept.version != VERSION {
        return Err(fault(&format!("is of version {}, this program reads version {VERSION}", kept.version)));
    }
    if kept.preset.len() > MAX_PRESETS {
        return Err(fault(&format!("has {} presets, at most {MAX_PRESETS} are kept", kept.preset.len())));
    }
    for (n, preset) in kept.preset.iter().enumerate() {
        // One that has become the name of a built-in preset can still be changed.
        let name = spelled(&preset.name).map_err(|e| fault(&e))?;
        if name != preset.name || kept.preset[..n].iter().any(|other| other.name == name) {
            return Err(fault(&format!("has the name {name:?} twice, or with blanks")));
        }
    }
    Ok(kept.preset)
}

/// Replaces the presets in a file, which need not exist. If this fails, the file stays unchanged.
///
/// # Errors
/// One line: [`read`] refuses the existing file, there are more than [`MAX_PRESETS`] presets, or the file cannot be written.
pub fn write(file: &Path, presets: &[UserPreset]) -> Result<(), String> {
    read(file).map_err(|e| format!("{e}; the file is left as it is"))?;
    if presets.len() > MAX_PRESETS {
        return Err(format!("{MAX_PRESETS} presets are kept: delete one first"));
    }
    let kept = Kept { version: VERSION, preset: presets.to_vec() };
    let text = tree::to_toml(&kept).map_err(|e| format!("presets cannot be written: {e}"))?;
    let text = format!("# Presets that were saved in `echolume view`; `--preset NAME` takes them too.\n{text}");
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    files::replace(file, text.as_bytes())
}
