//! Work that a watchdog would end: the layer loses the device at a dispatch of too many workgroups.

use crate::common::layer::{reports, under_layer};
use crate::common::program::*;
use std::process::Command;

/// Prevents a large picture that can never be drawn on a device with a watchdog: it is drawn in smaller and smaller parts, and is the
/// same picture.
#[test]
fn a_picture_that_loses_the_device_is_drawn_in_parts() {
    let folder = Folder::new("watchdog");
    let report = folder.path("report.json");
    let render = |name: &str, settings: &[(&str, &str)]| {
        let picture = folder.path(name);
        let flags = ["--mode", "mip", "--size", "1000x900", "--set", "slices.pixels=100", "-o", &picture];
        let mut command = Command::new(PROGRAM);
        command.arg("render").arg(SWEEP).args(flags);
        let (code, _, err) = finish(under_layer(&mut command, settings));
        assert_eq!(code, Some(0), "{err}");
        (std::fs::read(&picture).expect("a picture"), err)
    };
    let (whole, err) = render("whole.png", &[]);
    assert!(!err.contains("lost"), "{err}");
    // 125 x 113 workgroups in one piece.
    let (parts, err) = render("parts.png", &[("MAX_GROUPS", "4096"), ("REPORT", &report)]);
    let losses = err.matches("its work is divided into smaller parts").count();
    assert!((1..=4).contains(&losses), "{err}");
    assert!(whole == parts, "the picture differs in parts");
    let reports = reports(&report);
    assert_eq!(reports.len(), losses + 1);
    let largest: Vec<_> = reports.iter().map(|r| r["largest_dispatch"].as_u64().expect("counted")).collect();
    let (last, lost) = largest.split_last().expect("a device");
    assert!(*last <= 4096 && lost.iter().all(|groups| *groups > 4096), "{largest:?}");
    // A device that has no watchdog draws it at once: no part more than the passes.
    let dispatches = |n: usize| reports[n]["dispatches"].as_u64().expect("counted");
    assert!(dispatches(losses) > dispatches(0), "{reports:?}");
}

/// Prevents a series that panics if the device is lost after its last picture, as when the times are read, and one that begins anew.
#[test]
fn a_series_that_loses_the_device_near_its_end_is_whole() {
    let folder = Folder::new("series-lost");
    let report = folder.path("report.json");
    let series = |name: &str, settings: &[(&str, &str)]| {
        let turn = folder.path(name);
        let flags = ["--mode", "mip", "--size", "24x16", "--turntable", "2", "--timings", "-o", &turn];
        let mut command = Command::new(PROGRAM);
        command.arg("render").arg(BONE).args(flags);
        let (code, said, err) = finish(under_layer(&mut command, settings));
        assert_eq!(code, Some(0), "{settings:?}: {said}{err}");
        let pictures = [0, 1].map(|n| std::fs::read(format!("{turn}/picture-{n:06}.png")).expect("a picture"));
        (pictures, said, err)
    };
    let (whole, ..) = series("whole", &[("REPORT", &report)]);
    let waits = reports(&report)[0]["waits"].as_u64().expect("counted");
    let (mut lost, mut without_times) = (0, 0);
    // From the end: the waits before the device is destroyed, those for the times, then those for the last picture. How many there
    // are differs from run to run, so the search goes on until a picture was drawn again.
    for wait in (1..=waits).rev() {
        let (pictures, said, err) = series("lost", &[("LOSE_WAIT", &wait.to_string())]);
        assert!(pictures == whole, "lost at wait {wait} of {waits}: other pictures");
        lost += usize::from(err.contains("the device is reopened"));
        without_times += usize::from(said.contains("no times: the device was lost before they were read"));
        if lost > without_times {
            break;
        }
    }
    assert!(
        lost > without_times && without_times > 0,
        "{lost} losses, {without_times} after the last picture, of {waits} waits"
    );
}

/// Prevents a stream that ends where its pictures are too large for the device: the volumes after the loss are shown.
#[test]
fn a_stream_that_loses_the_device_continues_with_smaller_parts() {
    let folder = Folder::new("watchdog-stream");
    let report = folder.path("report.json");
    let flags = ["--null", "--volumes", "3", "--mode", "mip", "--size", "520x520", "--set", "slices.pixels=100"];
    let mut command = Command::new(PROGRAM);
    command.arg("stream").args(flags);
    let settings = [("MAX_GROUPS", "4000"), ("REPORT", report.as_str())];
    let (code, out, err) = finish(under_layer(&mut command, &settings));
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("the device is reopened"), "{err}");
    assert!(out.contains("volumes shown"), "{out}");
    let reports = reports(&report);
    let largest = reports.last().expect("a device")["largest_dispatch"].as_u64();
    assert!(reports.len() > 1 && largest.is_some_and(|groups| groups <= 4000), "{reports:?}");
}
