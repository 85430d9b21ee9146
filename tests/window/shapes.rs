//! Actions of a window manager on a window.

use crate::desktop::*;
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{ClientMessageEvent, ConnectionExt, EventMask};

/// Asks the window manager, or the program itself, for something.
fn ask(view: &View, to: x11rb::protocol::xproto::Window, name: &str, words: [u32; 5]) {
    let connection = &view.desk.connection;
    let atom = connection.intern_atom(false, name.as_bytes()).expect("ask").reply().expect("an atom").atom;
    let event = ClientMessageEvent::new(32, view.window, atom, words);
    let mask = if to == view.window { EventMask::NO_EVENT } else { EventMask::SUBSTRUCTURE_REDIRECT };
    connection.send_event(false, to, mask, event).expect("send");
    connection.flush().expect("flush");
}

fn close(view: &View) {
    let connection = &view.desk.connection;
    let delete = connection.intern_atom(false, b"WM_DELETE_WINDOW").expect("ask").reply().expect("an atom").atom;
    ask(view, view.window, "WM_PROTOCOLS", [delete, 0, 0, 0, 0]);
}

#[test]
fn full_screen_and_minimised_windows_return_to_the_same_picture() {
    let desk = Desk::new(true);
    let view = desk.view(&["--no-ui", "--size", "300x220", "--source", SWEEP]);
    let small = headless([300, 220], &[]);
    view.shows(&small, "the window");
    desk.tap(F1 + 10);
    until("full screen", || (view.place() == ([0, 0], [1024, 768])).then_some(()));
    view.shows(&headless([1024, 768], &[]), "full screen");
    desk.tap(F1 + 10);
    until("the window", || (view.place().1 == [300, 220]).then_some(()));
    view.shows(&small, "the window again");
    // IconicState, and back by mapping it.
    ask(&view, desk.root, "WM_CHANGE_STATE", [3, 0, 0, 0, 0]);
    until("the icon", || {
        let attributes = desk.connection.get_window_attributes(view.window).ok()?.reply().ok()?;
        (attributes.map_state != x11rb::protocol::xproto::MapState::VIEWABLE).then_some(())
    });
    desk.connection.map_window(view.window).expect("map");
    desk.connection.flush().expect("flush");
    view.shows(&small, "after it was an icon");
    close(&view);
    view.ended();
}

#[test]
fn a_destroyed_window_ends_the_view_without_an_error() {
    let desk = Desk::new(false);
    let view = desk.view(&["--no-ui", "--size", "300x220", PLAIN[0], PLAIN[1], "--source", SWEEP]);
    view.shows(&plain([300, 220], &[]), "the window");
    desk.connection.destroy_window(view.window).expect("destroy");
    desk.connection.flush().expect("flush");
    view.ended();
}

#[test]
fn a_kiosk_stays_when_it_is_closed_and_comes_back_when_it_is_destroyed() {
    let desk = Desk::new(true);
    let mut view = desk.view(&["--kiosk", "--no-ui", PLAIN[0], PLAIN[1], "--source", SWEEP]);
    let full = plain([1024, 768], &[]);
    view.shows(&full, "a kiosk fills the screen");
    close(&view);
    for key in [ESCAPE, u32::from('q'), F1 + 10] {
        desk.tap(key);
    }
    assert!(view.is_running());
    desk.connection.destroy_window(view.window).expect("destroy");
    desk.connection.flush().expect("flush");
    view.window = until("another window", || desk.window(desk.root).filter(|w| *w != view.window));
    view.shows(&full, "the other window");
    for (key, down) in [(CONTROL, true), (ALT, true), (u32::from('q'), true), (u32::from('q'), false)] {
        desk.press(key, down);
    }
    view.ended();
}
