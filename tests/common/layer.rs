//! The program under the layer of tools/drivers.d, which counts what it asks of a device and injects failures.

use super::files::repository;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The folder of the built layer. It is built once.
fn folder() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("layer");
        let done =
            Command::new(repository("tools/drivers")).arg("layer").arg(&folder).output().expect("start tools/drivers");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        folder
    })
}

/// Runs a command under the layer, with settings such as `("HANG", "20")`.
pub fn under_layer<'a>(command: &'a mut Command, settings: &[(&str, &str)]) -> &'a mut Command {
    command.env("VK_ADD_LAYER_PATH", folder()).env("VK_INSTANCE_LAYERS", "VK_LAYER_ECHOLUME_faults");
    for (name, value) in settings {
        command.env(format!("ECHOLUME_LAYER_{name}"), value);
    }
    command
}

/// The layer's report of every device, in the order in which they were destroyed.
pub fn reports(path: &str) -> Vec<Value> {
    let text = std::fs::read_to_string(path).expect("the layer wrote its report");
    text.lines().map(|line| serde_json::from_str(line).expect("the report is JSON")).collect()
}

/// The drivers of `tools/drivers setup`, if they were downloaded; otherwise says that they were not.
pub fn downloaded_drivers() -> Option<PathBuf> {
    let home = || std::env::var_os("HOME").map(|home| Path::new(&home).join(".cache/echolume-drivers"));
    let folder = std::env::var_os("ECHOLUME_DRIVERS").map(PathBuf::from).or_else(home)?;
    let is_there = folder.join("sid/.done").exists();
    if !is_there {
        eprintln!("left out: no drivers in {} (tools/drivers setup)", folder.display());
    }
    is_there.then_some(folder)
}
