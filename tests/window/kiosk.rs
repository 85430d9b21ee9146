//! A kiosk reports what is missing, retries, and continues by itself once it is there.

use crate::desktop::*;
use std::fs;

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
    fs::write(&file, format!("source = '{SWEEP}'\nloop = true\n[display]\npanels = false\n")).expect("write");
    until("the picture", || (!is_amiss(&view)).then_some(()));
    let full = headless([1024, 768], &[]);
    view.shows_part(&full, [256, 192], [512, 384], "what the configuration says");
    leave(view);
}

#[test]
fn a_missing_source_is_reported_and_shown_when_it_appears() {
    let (desk, folder) = (Desk::new(true), Folder::new("source"));
    let (file, later) = (folder.path("cart.toml"), folder.path("sweep.mha"));
    let text = format!("source = '{later}'\n[live]\nretry = '200ms'\n[display]\npanels = false\n");
    fs::write(&file, text).expect("write");
    let view = desk.view(&["--kiosk", "--config", &file]);
    until("why", || is_amiss(&view).then_some(()));
    fs::copy(SWEEP, &later).expect("copy");
    let full = headless([1024, 768], &[]);
    view.shows_part(&full, [256, 192], [512, 384], "the source that came");
    leave(view);
}
