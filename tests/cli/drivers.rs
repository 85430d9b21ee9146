//! The program on drivers that fail or that other machines have: tools/drivers and its layer.

use crate::common::layer::{on_drivers_of_other_vendors, reports, under_layer};
use crate::common::program::*;
use std::process::Command;

/// What the layer drops, validation has to notice: otherwise its silence on an intact run means nothing.
#[test]
fn validation_notices_barriers_that_are_dropped() {
    let folder = Folder::new("dropped");
    let (picture, report) = (folder.path("x.png"), folder.path("report.json"));
    let arguments = ["render", "--validate", "--size", "64x64", "-o", &picture];
    let render = |settings: &[(&str, &str)]| {
        finish(under_layer(Command::new(PROGRAM).args(arguments), &[&[("REPORT", &report as &str)], settings].concat()))
    };
    let (code, _, err) = render(&[]);
    assert_eq!(code, Some(0), "{err}");
    let (code, _, err) = render(&[("DROP_BARRIERS", "10")]);
    assert!(code == Some(1) && err.contains("HAZARD"), "{code:?}: {err}");
    let reports = reports(&report);
    let dropped: Vec<_> = reports.iter().map(|r| r["dropped_barriers"].as_u64()).collect();
    let [Some(0), Some(dropped)] = dropped[..] else { panic!("{reports:?}") };
    assert_eq!(Some(dropped + 9), reports[1]["barriers"].as_u64(), "all from the tenth on");
}

/// Drivers of other vendors compile every shader and validate every command. What they do not do is draw.
#[test]
fn drivers_of_other_vendors_are_asked_for_nothing_that_they_lack() {
    let folder = Folder::new("drivers");
    let picture = folder.path("x.png");
    on_drivers_of_other_vendors(&["render", "--validate", "--size", "64x64", "-o", &picture], |_, _| ());
}
