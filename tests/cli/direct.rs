//! A missing monitor, and a surface that nobody sees. Only names that no monitor has: a machine with a monitor would show something on it.

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
        (&["--unseen", "--direct"], "--direct"),
        (&["--unseen", "--kiosk"], "--kiosk"),
    ] {
        let all = [&["view", "--source", "phantom"], arguments].concat();
        let (code, _, err) = run(&all);
        assert!(code == Some(2) && err.contains(named) && !err.contains("panicked"), "{all:?}: {code:?} {err}");
    }
}

/// Prevents a presentation that only a window or a monitor can test: it runs with validation, and says how late pictures are.
#[test]
fn pictures_of_a_live_source_are_presented_on_a_surface_that_nobody_sees() {
    let view = ["view", "--unseen", "--size", "500x400", "--no-panels", "--validate", "--mode", "mip"];
    // How long the first volume takes depends on the machine.
    for time in ["2s", "5s", "10s", "20s", "40s"] {
        let mut command = Command::new(PROGRAM);
        command.args(view).args(["--set", "slices.pixels=64", "--for", time]);
        let (code, said, err) = finish(command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY"));
        if code == Some(1) {
            // Drivers before Mesa 23.1 have no such surface.
            assert_eq!(err, "echolume: no window: no Vulkan driver has VK_EXT_headless_surface\n");
            return;
        }
        assert_eq!(code, Some(0), "{said}{err}");
        let Some((_, times)) = said.split_once("last frame to presentation ") else { continue };
        let number = |name: &str| {
            let rest = times.split_once(name).expect(&said).1;
            rest.split([' ', ',', '\n']).next().and_then(|ms| ms.parse::<f64>().ok()).expect(&said)
        };
        assert!(0.0 < number("p50 ") && number("p50 ") <= number("p99 "), "{said}");
        let shown = said.split(", ").find_map(|part| part.strip_suffix(" shown on the window")).expect(&said);
        assert!(shown.parse::<u32>().is_ok_and(|shown| shown > 0), "{said}");
        return;
    }
    panic!("no picture within 40 s");
}
