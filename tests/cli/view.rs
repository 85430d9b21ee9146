//! `echolume view` without a display or without an input: one line that says so. Windows are in tests/window.

use crate::common::program::*;
use std::process::Command;

/// Without a windowing system.
fn bare(arguments: &[&str]) -> Ran {
    let mut command = Command::new(PROGRAM);
    finish(command.arg("view").args(arguments).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY"))
}

#[test]
fn impossible_views_are_refused_in_one_line_before_a_window_opens() {
    let folder = Folder::new("view");
    let cut = folder.write("cut.mha", &std::fs::read(SWEEP).expect("read")[..3000]);
    let wrong = folder.write("cart.toml", "source = 'phantom'\nrate = -1\n");
    let config = folder.write("right.toml", "source = 'phantom'\n");
    for (arguments, code, named) in [
        (&["--source", "/nowhere.mha"][..], 2, &["/nowhere.mha"][..]),
        (&["--source", &cut], 2, &["cut.mha", "cut short"]),
        (&[SWEEP, "/nowhere.mha"], 2, &["/nowhere.mha"]),
        (&[SWEEP; 17], 2, &["17 files", "16"]),
        (&["--scale", "9"], 2, &["--scale 9", "0.5..=4"]),
        (&["--budget", "soon"], 2, &["--budget soon", "16ms"]),
        (&["--update", "slowly"], 2, &["--update slowly", "whole or rolling"]),
        (&["--config", "/nowhere.toml"], 2, &["/nowhere.toml"]),
        (&["--config", &wrong], 2, &["line 2", "rate"]),
        (&["--config", SWEEP], 2, &["sweep.mha"]),
        (&["--report", SWEEP], 2, &["sweep.mha"]),
        (&["--record", "exam.mha"], 2, &["must end in .frames"]),
        (&[], 1, &["no window", "DISPLAY", "--direct"]),
    ] {
        refuses(arguments, &bare(arguments), code, named);
    }
    // Flags cannot override a configuration.
    let (code, _, err) = bare(&["--config", &config, "--source", SWEEP]);
    assert!(code == Some(2) && err.contains("cannot be used with"), "{err}");
}
