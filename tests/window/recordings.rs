//! Several recordings in one window: each is shown as `render` draws it, and comes back as it was left.

use crate::desktop::*;
use std::path::Path;

const WINDOW: [u32; 2] = [1000, 700];
const PAGE_UP: u32 = 0xff55;
const PAGE_DOWN: u32 = 0xff56;

#[test]
fn recordings_are_shown_in_turn_and_come_back_as_they_were_left() {
    let desk = Desk::new(false);
    let folder = Folder::new("recordings");
    let (_, size) = echolume::low_level::ui::panels::picture_area(WINDOW, 1.0, true);
    // The same sweep, so that a picture tells the settings.
    let second = folder.path("second.mha");
    std::fs::copy(SWEEP, &second).expect("a copy");
    std::fs::copy(Path::new(SWEEP).with_file_name("probe.toml"), folder.path("probe.toml")).expect("its probe");
    let [start, volume] = [&[][..], &["--mode", "vr"]].map(|flags| plain(size, flags));
    let view = desk.view(&["--size", "1000x700", PLAIN[0], PLAIN[1], SWEEP, &second]);
    view.shows_middle(&start, "the first recording");
    desk.tap('2');
    view.shows_middle(&volume, "another mode");
    desk.control(PAGE_DOWN);
    view.shows_middle(&start, "the second recording, as at its start");
    desk.control(PAGE_UP);
    view.shows_middle(&volume, "the first as it was left");
    // The first entry of the list is at the top left, below its heading; its x is at its right.
    view.click(190, 44);
    view.shows_middle(&start, "the second, since the first is closed");
    let said = view.leave();
    assert!(!said.contains("validation"), "{said}");
}
