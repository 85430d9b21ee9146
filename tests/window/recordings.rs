//! Several recordings in one window: each is shown as `render` draws it, and comes back as it was left.

use crate::desktop::*;
use echolume::picture::Picture;
use std::path::Path;

const WINDOW: [u32; 2] = [1000, 700];
const PAGE_UP: u32 = 0xff55;
const PAGE_DOWN: u32 = 0xff56;

fn control(desk: &Desk, key: impl Into<u32>) {
    desk.press(CONTROL, true);
    desk.tap(key);
    desk.press(CONTROL, false);
}

/// Waits until the middle of the picture, which has no marks, equals that of a headless one.
fn shows(view: &View, wanted: &Picture, what: &str) {
    let (corner, size) = echolume::ui::panels::picture_area(WINDOW, 1.0, true);
    let (from, middle) = (size.map(|n| n / 4), size.map(|n| n / 2));
    view.shows_at(wanted, [corner[0] + from[0], corner[1] + from[1]], from, middle, what);
}

#[test]
fn recordings_are_shown_in_turn_and_come_back_as_they_were_left() {
    let desk = Desk::new(false);
    let folder = Folder::new("recordings");
    let (_, size) = echolume::ui::panels::picture_area(WINDOW, 1.0, true);
    // The same sweep, so that a picture tells the settings.
    let second = folder.path("second.mha");
    std::fs::copy(SWEEP, &second).expect("a copy");
    std::fs::copy(Path::new(SWEEP).with_file_name("probe.toml"), folder.path("probe.toml")).expect("its probe");
    let [start, volume] = [&[][..], &["--mode", "vr"]].map(|flags| headless(size, flags));
    let view = desk.view(&["--size", "1000x700", SWEEP, &second]);
    shows(&view, &start, "the first recording");
    desk.tap('2');
    shows(&view, &volume, "another mode");
    control(&desk, PAGE_DOWN);
    shows(&view, &start, "the second recording, as at its start");
    control(&desk, PAGE_UP);
    shows(&view, &volume, "the first as it was left");
    // The first entry of the list is at the top left, below its heading; its x is at its right.
    view.click(190, 44);
    shows(&view, &start, "the second, since the first is closed");
    let said = view.leave();
    assert!(!said.contains("validation"), "{said}");
}
