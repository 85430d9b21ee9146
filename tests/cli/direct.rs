//! A monitor that is not there. Only names that no monitor has: a machine that has one would show things on it.

use crate::common::program::*;
use std::process::Command;

const DIRECT: [&str; 5] = ["view", "--source", "phantom", "--direct", "--monitor"];

#[test]
fn without_such_a_monitor_one_line_says_so() {
    let nowhere = [&DIRECT[..], &["no such monitor", "--size", "640x480", "--refresh", "60"]].concat();
    let ran = run(&nowhere);
    refuses(&nowhere, &ran, 1, &[]);
    // A driver may know monitors and have none, or know none.
    let why = ["no monitor is connected", "no monitor is called", "VK_KHR_display", "VK_KHR_surface"];
    assert!(why.iter().any(|why| ran.2.contains(why)), "{ran:?}");
    let blind = finish(without_device(Command::new(PROGRAM).args(&nowhere)));
    refuses(&nowhere, &blind, 1, &["no window", "VK_KHR_"]);
}

#[test]
fn what_only_a_monitor_has_is_not_taken_elsewhere() {
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
