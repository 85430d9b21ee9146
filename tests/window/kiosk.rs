//! A kiosk reports what is missing, retries, and continues by itself once it is there.

use crate::common::layer::under_layer;
use crate::desktop::*;
use echolume::low_level::files::Lock;
use std::fs;
use std::process::Command;

/// True if a banner of a fault is shown: its red frame.
fn is_amiss(view: &View) -> bool {
    let Some(seen) = view.look() else { return false };
    seen.rgba.chunks(4).filter(|p| p[0] == 240 && p[1] == 96 && p[2] == 84).count() > 300
}

fn leave(view: View) {
    for (key, down) in [(CONTROL, true), (ALT, true), (u32::from('q'), true)] {
        view.desk.press(key, down);
    }
    view.ended();
}

#[test]
fn a_wrong_configuration_is_reported_and_loaded_once_it_is_corrected() {
    let (desk, folder) = (Desk::new(true), Folder::new("configuration"));
    let file = folder.path("cart.toml");
    fs::write(&file, "source = 'phantom'\nrate = -1\n").expect("write");
    let mut view = desk.view(&["--kiosk", "--config", &file]);
    until("why", || is_amiss(&view).then_some(()));
    assert!(view.is_running());
    let saved = folder.join("saved");
    fs::create_dir(&saved).expect("a folder");
    let text = format!("source = '{SWEEP}'\nloop = true\n[display]\npanels = false\n[files]\npictures = 'saved'\n");
    fs::write(&file, text).expect("write");
    until("the picture", || (!is_amiss(&view)).then_some(()));
    let full = headless([1024, 768], &[]);
    view.shows_part(&full, [256, 192], [512, 384], "what the configuration says");
    let why = Lock::take(&saved).expect_err("another kiosk with this folder is refused");
    assert!(why.contains("is in use by process"), "{why}");
    leave(view);
    Lock::take(&saved).expect("free again");
}

#[test]
fn a_missing_source_is_reported_and_shown_when_it_appears() {
    let (desk, folder) = (Desk::new(true), Folder::new("source"));
    let (file, later) = (folder.path("cart.toml"), folder.path("sweep.mha"));
    let log = folder.path("kiosk.log");
    let text =
        format!("source = '{later}'\n[live]\nretry = '200ms'\n[display]\npanels = false\n[files]\nlog = '{log}'\n");
    fs::write(&file, text).expect("write");
    let logged = |what: &str| {
        let text = fs::read_to_string(&log).unwrap_or_default();
        text.lines().filter(|line| line.contains(what)).count()
    };
    let missing = format!("WARN source: {later}: file: ");
    let view = desk.view(&["--kiosk", "--config", &file]);
    until("why", || is_amiss(&view).then_some(()));
    until("a line in the log", || (logged(&missing) > 0).then_some(()));
    // As logrotate does.
    let before = fs::read_to_string(&log).expect("the log");
    fs::rename(&log, folder.path("kiosk.log.old")).expect("renamed");
    view.signal(rustix::process::Signal::HUP);
    fs::copy(SWEEP, &later).expect("copy");
    let full = headless([1024, 768], &[]);
    view.shows_part(&full, [256, 192], [512, 384], "the source that came");
    assert_eq!((logged(&missing), logged("INFO source: it is open now")), (0, 1), "in the new log");
    assert_eq!(before.matches(&missing).count(), 1, "each is said once");
    leave(view);
}

/// Prevents a picture that stands still without a word: a device that hangs is opened again, and a banner says so for a while.
#[test]
fn a_device_that_hangs_is_opened_again_under_a_banner() {
    let (desk, folder) = (Desk::new(true), Folder::new("hang"));
    let (file, fault) = (folder.path("cart.toml"), folder.path("fault"));
    fs::write(&file, format!("source = '{SWEEP}'\nloop = true\n[display]\npanels = false\n")).expect("write");
    let mut program = Command::new(PROGRAM);
    let arguments = ["--kiosk", "--config", &file, "--device-timeout", "12s", PLAIN[0], PLAIN[1]];
    let mut view = desk.view_by(under_layer(&mut program, &[("FAULT", &fault)]), &arguments);
    let hung = view.window;
    let full = plain([1024, 768], &[]);
    let is_shown = |view: &View| view.shows_part(&full, [256, 192], [512, 384], "the source");
    is_shown(&view);
    fs::write(&fault, "h").expect("write");
    // The window of a device that is given up is left alone.
    view.window = until("another window", || desk.window(desk.root).filter(|window| *window != hung));
    assert!(!fs::exists(&fault).expect("look"), "the layer took the request");
    until("the banner", || is_amiss(&view).then_some(()));
    until("the end of the banner", || (!is_amiss(&view)).then_some(()));
    is_shown(&view);
    leave(view);
}
