//! `tools/cluster/Snakefile` under Snakemake itself.
#![cfg(unix)]

use crate::common::files::repository;
use crate::common::program::*;
use std::process::Command;

/// Installing Snakemake by pip takes a minute and a half, once, and needs a network: only with ECHOLUME_SNAKEMAKE=1.
#[test]
fn snakemake_does_twelve_units_once_each() {
    if std::env::var_os("ECHOLUME_SNAKEMAKE").is_none() {
        eprintln!("left out: it installs Snakemake by pip; set ECHOLUME_SNAKEMAKE=1");
        return;
    }
    let (code, out, err) = finish(Command::new(repository("tools/cluster/test-snakemake")).env("PROGRAM", PROGRAM));
    match code {
        Some(77) => eprintln!("left out: {err}"),
        code => assert!(code == Some(0) && out.contains("passed: 11 outputs of 12 units"), "{code:?}: {out}{err}"),
    }
}
