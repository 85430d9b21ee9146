//! `tools/kiosk/echolume.service`: the program accepts its command line.

use crate::common::program::*;
use std::process::Command;

const UNIT: &str = include_str!("../../tools/kiosk/echolume.service");
const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tools/kiosk/echolume.toml");

#[test]
fn the_service_starts_what_the_program_takes() {
    let start = UNIT.lines().find_map(|l| l.strip_prefix("ExecStart=")).expect("it starts something");
    let words: Vec<&str> = start.split(' ').collect();
    assert_eq!(
        words,
        ["/usr/local/bin/echolume", "view", "--kiosk", "--config", echolume::low_level::kiosk::config::DEFAULT_PATH]
    );
    let (code, out, err) = run(&["view", "--kiosk", "--config", EXAMPLE, "--help"]);
    assert!(code == Some(0) && out.contains("--config"), "{out}{err}");
}

#[cfg(target_os = "linux")]
#[test]
fn systemd_finds_no_fault_in_the_service() {
    let folder = Folder::new("service");
    // Neither its program nor its user need exist here.
    let unit = UNIT.replace("/usr/local/bin/echolume", PROGRAM).replace("User=echolume", "User=root");
    let file = folder.write("echolume-test.service", unit);
    let Ok(output) = Command::new("systemd-analyze").args(["verify", "--man=no", &file]).output() else { return };
    let said = String::from_utf8_lossy(&output.stderr);
    let ours: Vec<&str> = said.lines().filter(|l| l.contains("echolume-test")).collect();
    assert!(ours.is_empty(), "{ours:?}");
}
