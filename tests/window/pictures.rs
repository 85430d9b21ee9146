//! A window shows what `echolume render` writes, byte for byte.

use crate::desktop::*;

#[test]
fn every_mode_in_a_window_is_the_headless_picture_byte_for_byte() {
    let size = [300, 220];
    let desk = Desk::new(false);
    let view = desk.view(&["--no-ui", "--size", "300x220", "--source", SWEEP]);
    view.shows(&headless(size, &[]), "the mode at the start");
    let modes = [
        ('2', "vr"),
        ('3', "mixed"),
        ('4', "mip"),
        ('5', "minip"),
        ('6', "xray"),
        ('7', "mpr"),
        ('8', "orthogonal"),
        ('9', "tomography"),
        ('0', "cube"),
        ('1', "sr"),
    ];
    for (key, mode) in modes {
        desk.tap(key);
        view.shows(&headless(size, &["--mode", mode]), mode);
    }
    desk.tap(TAB);
    view.shows(&headless(size, &["--layout", "4up", "--mode", "sr"]), "4-up");
    view.leave();
}

#[test]
fn a_window_that_is_resized_shows_a_picture_of_its_size() {
    let desk = Desk::new(false);
    let view = desk.view(&["--no-ui", "--size", "300x220", PLAIN[0], PLAIN[1], "--source", SWEEP]);
    for size in [[300, 220], [417, 333], [128, 64], [640, 480]] {
        view.resize(size[0], size[1]);
        view.shows(&plain(size, &[]), &format!("{size:?}"));
    }
    // Smaller than any picture: nothing breaks, and the picture returns.
    view.resize(1, 1);
    until("the tiny window", || (view.place().1 == [1, 1]).then_some(()));
    view.resize(200, 160);
    view.shows(&plain([200, 160], &[]), "back from one pixel");
    view.leave();
}
