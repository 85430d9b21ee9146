//! The program under the layer of tools/drivers.d, which counts what it asks of a device and injects failures.

use super::files::repository;
use super::program::{PROGRAM, finish};
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

/// Of the drivers of `tools/drivers`, one for each vendor's way to compile and to queue.
const VENDORS: [&str; 3] = ["ada", "navi31", "adreno"];

/// Runs the program on drivers of other vendors, which must succeed, and hands the driver's name and the standard output to `check`. Where
/// the drivers were not downloaded, it says so and runs nothing.
pub fn on_drivers_of_other_vendors(arguments: &[&str], check: impl Fn(&str, &str)) {
    let home = || std::env::var_os("HOME").map(|home| Path::new(&home).join(".cache/echolume-drivers"));
    let folder = std::env::var_os("ECHOLUME_DRIVERS").map(PathBuf::from).or_else(home);
    if !folder.is_some_and(|folder| folder.join("sid/.done").exists()) {
        eprintln!("left out: no drivers were downloaded (tools/drivers setup)");
        return;
    }
    for driver in VENDORS {
        let mut command = Command::new(repository("tools/drivers"));
        let (code, out, err) = finish(command.args(["on", driver, PROGRAM]).args(arguments));
        assert_eq!(code, Some(0), "{driver}: {err}");
        check(driver, &out);
    }
}
