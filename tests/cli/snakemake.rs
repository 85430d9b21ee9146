//! `tools/cluster/Snakefile` under Snakemake itself.
#![cfg(unix)]

use crate::common::files::repository;
use crate::common::program::*;
#[cfg(target_os = "linux")]
use crate::common::wait::eventually;
use std::process::Command;

/// Installing Snakemake by pip takes a minute and a half, once, and needs a network: the gate does it while it compiles, and
/// ECHOLUME_SNAKEMAKE=1 allows this test to. Where it is installed, the test always runs.
#[test]
fn snakemake_does_twelve_units_once_each() {
    let mut command = Command::new(repository("tools/cluster/test-snakemake"));
    if std::env::var_os("ECHOLUME_SNAKEMAKE").is_none() {
        command.arg("--no-install");
    }
    let (code, out, err) = finish(command.env("PROGRAM", PROGRAM));
    match code {
        Some(77) => eprintln!("left out: {err}; ECHOLUME_SNAKEMAKE=1 installs it by pip"),
        code => assert!(code == Some(0) && out.contains("passed: 11 outputs of 12 units"), "{code:?}: {out}{err}"),
    }
}

/// Prevents a test that begins while the gate still installs, and then is left out or installs over it.
#[cfg(target_os = "linux")]
#[test]
fn who_needs_snakemake_waits_for_the_process_that_installs_it() {
    let script = std::fs::read_to_string(repository("tools/cluster/test-snakemake")).expect("the script");
    let version = script.lines().find_map(|line| line.strip_prefix("version=")).expect("a version");
    let folder = Folder::new("snakemake-lock");
    let (venv, begun) = (folder.path("venv"), folder.join("begun"));
    // Another process, which installs for a second.
    let install = format!("touch {}; sleep 1; mkdir {venv}; echo {version} > {venv}/installed", begun.display());
    let mut other = start(Command::new("flock").args([&format!("{venv}.lock"), "-c", &install]));
    assert!(eventually(|| begun.exists()), "it does not begin");
    let mut command = Command::new(repository("tools/cluster/test-snakemake"));
    // A program that fails at once: the test goes no further than to it.
    let (code, _, err) = finish(command.args(["--no-install", &venv]).env("PROGRAM", "/bin/false"));
    assert!(code == Some(1) && !err.contains("is not in"), "{code:?}: {err}");
    assert!(other.wait().expect("it ends").success());
}
