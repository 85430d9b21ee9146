//! Workspaces: scene files that also name a recording. The settings, with measurements and annotations, are those of a scene file. The
//! table `[workspace]` names the source of the volumes. `view` and `render` open a workspace in place of a recording.

use crate::files;
use crate::scene::Settings;
use crate::scene::load::Layers;
use crate::text::printable;
use crate::tree::{FromNode, Node, ToNode};
use std::io::Read;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// Maximum size of a workspace, bytes.
const MAX_BYTES: u64 = 4 << 20;
/// The version of the table that this program writes and reads.
const VERSION: u32 = 1;
/// The table that tells a workspace from a scene file.
const TABLE: &str = "workspace";
/// Value of [`Origin::recording`] that stands for the built-in phantom.
pub const PHANTOM: &str = "phantom";
/// Bytes at the start of a file in which the table must be, to be listed as a workspace.
const HEAD: u64 = 4096;

/// Which recording and which of its volumes a workspace shows, with the flags of its geometry.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Origin {
    version: u32,
    /// Path of the recording, or [`PHANTOM`]. None: the volumes were live and are in no file.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub recording: Option<PathBuf>,
    /// Index of the volume that was shown, from 0.
    #[tree(default)]
    pub volume: usize,
    /// Path of the segmentation that is shown with the recording; None if none is.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub labels: Option<PathBuf>,
    /// Path of the probe file that was given with `--probe`; None if it was not given.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<PathBuf>,
    /// Value of `--depth-axis`, such as `-z`; None if it was not given.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub depth_axis: Option<String>,
    /// Value of `--voxel-spacing`: distance of columns, rows and pictures, mm; None if it was not given.
    #[tree(default, skip_serializing_if = "Option::is_none")]
    pub voxel_spacing: Option<[f64; 3]>,
}

impl Origin {
    /// The origin with this recording, its first volume and no flags.
    pub fn of(recording: Option<PathBuf>) -> Origin {
        Origin { version: VERSION, recording, ..Origin::default() }
    }
}

/// A workspace that was read.
#[derive(Clone, Debug)]
pub struct Workspace {
    pub origin: Origin,
    /// All settings of the workspace as one layer.
    pub layers: Layers,
}

/// True if a path has the file name ending of a workspace, which no recording has.
pub fn is_named(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"))
}

/// True if a file has the ending of a workspace and begins as one. At most 4 KiB of it are read.
pub fn is_workspace(path: &Path) -> bool {
    if !(is_named(path) && std::fs::metadata(path).is_ok_and(|about| about.is_file())) {
        return false;
    }
    let mut head = Vec::new();
    let read = std::fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && String::from_utf8_lossy(&head).contains(&format!("[{TABLE}]"))
}

impl Workspace {
    /// Reads a workspace file. Paths in it are relative to its folder.
    ///
    /// # Errors
    /// One line that names the file: it cannot be read, is no workspace or one of another version, or has a setting that is not allowed.
    pub fn read(path: &Path) -> Result<Workspace, String> {
        let fault = |fault: &str| format!("{}: {}", path.display(), printable(fault));
        let text = files::read_text(path, MAX_BYTES, TABLE).map_err(|e| fault(&e))?;
        Workspace::of_text(path, &text)
    }

    /// Reads a workspace from `text`, which may be a part of the file at `path`. Paths in it are relative to the folder of that file.
    ///
    /// # Errors
    /// One line that names the file: the text is no workspace or one of another version, or has a setting that is not allowed.
    pub fn of_text(path: &Path, text: &str) -> Result<Workspace, String> {
        let fault = |fault: &str| format!("{}: {}", path.display(), printable(fault));
        let line = |e: &toml::de::Error| match e.span() {
            Some(span) => format!("line {}: {}", crate::scene::load::line_of(text, span.start), e.message()),
            None => e.message().to_string(),
        };
        let mut table = toml::from_str::<Table>(text).map_err(|e| fault(&line(&e)))?;
        let Some(origin) = table.remove(TABLE) else {
            return Err(fault("has no table [workspace]: a file of settings alone is given with --scene"));
        };
        let mut origin =
            Origin::from_node(Node::from(origin)).map_err(|e| fault(&format!("[workspace]: {}", e.message())))?;
        if origin.version != VERSION {
            let version = origin.version;
            return Err(fault(&format!("[workspace] is of version {version}, this program reads version {VERSION}")));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        for file in [&mut origin.recording, &mut origin.labels, &mut origin.probe].into_iter().flatten() {
            if file.as_os_str() != PHANTOM {
                *file = folder.join(&*file);
            }
        }
        belong_to(&mut table, origin.volume);
        let mut layers = Layers::default();
        layers.table(&path.display().to_string(), table, folder).map_err(|e| e.to_string())?;
        let settings = layers.clone().finish().map_err(|e| e.to_string())?;
        settings.check().map_err(|e| fault(&e.to_string()))?;
        Ok(Workspace { origin, layers })
    }

    /// Path of the recording to open. `path`: that of the workspace, for messages.
    ///
    /// # Errors
    /// One line: the workspace was saved from live volumes.
    pub fn recording(&self, path: &Path) -> Result<&Path, String> {
        let fault = || {
            format!(
                "{}: names no recording, since its volumes were live; save the loop and set workspace.recording",
                path.display()
            )
        };
        self.origin.recording.as_deref().ok_or_else(fault)
    }
}

/// Measurements that do not say of which volume they are belong to the one that was shown.
fn belong_to(table: &mut Table, volume: usize) {
    let Some(Value::Array(all)) = table.get_mut("measure") else { return };
    for measured in all.iter_mut().filter_map(Value::as_table_mut).filter(|measured| !measured.contains_key("made")) {
        let volume = Value::Integer(i64::try_from(volume).unwrap_or(i64::MAX));
        measured.insert("made".into(), Value::Table(Table::from_iter([("volume".to_string(), volume)])));
    }
}

/// The text of a workspace file with all settings.
///
/// # Errors
/// One line: the settings cannot be written as TOML, or the text would be longer than 4 MiB.
pub fn text(settings: &Settings, origin: &Origin) -> Result<String, String> {
    let fault = |e: &dyn std::fmt::Display| format!("a workspace cannot be written: {e}");
    let head = Table::from_iter([(TABLE.to_string(), origin.to_node().into_toml().map_err(|e| fault(&e))?)]);
    let (head, settings) = (toml::to_string(&head), settings.to_toml());
    let (head, settings) = (head.map_err(|e| fault(&e))?, settings.map_err(|e| fault(&e))?);
    // The settings begin with values that belong to no table, which the table follows.
    let (values, tables) = match settings.find("\n[") {
        Some(at) => settings.split_at(at + 1),
        None => (settings.as_str(), ""),
    };
    let about = "# Echolume workspace: `echolume view FILE` and `echolume render FILE` open it.";
    let text = format!("{about}\n{values}\n{head}\n{tables}");
    match text.len() as u64 <= MAX_BYTES {
        true => Ok(text),
        false => Err(fault(&format!("it would be longer than {} MiB", MAX_BYTES >> 20))),
    }
}
