//! A missing monitor. Only names that no monitor has: a machine with a monitor would show something on it.

use crate::common::program::*;
use std::process::Command;

const DIRECT: [&str; 5] = ["view", "--source", "phantom", "--direct", "--monitor"];

#[test]
fn a_missing_monitor_is_reported_in_one_line() {
    let nowhere = [&DIRECT[..], &["no such monitor", "--size", "640x480", "--refresh", "60"]].concat();
    let ran = run(&nowhere);
    refuses(&nowhere, &ran, 3, &[]);
    // A driver may support monitors and have none, or not support them.
    let why = ["no monitor is connected", "no monitor is called", "VK_KHR_display", "VK_KHR_surface"];
    assert!(why.iter().any(|why| ran.2.contains(why)), "{ran:?}");
    let blind = finish(without_device(Command::new(PROGRAM).args(&nowhere)));
    refuses(&nowhere, &blind, 1, &["no window", "VK_KHR_"]);
}

#[test]
fn options_of_a_monitor_are_refused_elsewhere() {
    for (arguments, named) in [
        (&["--refresh", "60"][..], "--direct"),
        (&["--direct", "--full-screen"], "--full-screen"),
        (&["--direct", "--refresh", "0"], "--refresh 0"),
        (&["--direct", "--refresh", "nan"], "--refresh NaN"),
    ] {
        let all = [&["view", "--source", "phantom"], arguments].concat();
        let (code, _, err) = run(&all);
        assert!(code == Some(2) && err.contains(named) && !err.contains("panicked"), "{all:?}: {code:?} {err}");
    }
}
