//! `tools/cluster/Snakefile` under Snakemake itself.
#![cfg(unix)]

use crate::common::files::repository;
use crate::common::program::*;
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
