//! The mouse on the picture, the cine loop, the list of files and files that are dropped, held against closed formulas and what `render` draws.

use crate::desktop::*;
use echolume::low_level::measure::outcome;
use echolume::low_level::scene::{Input, MeasureKind, Scene};
use echolume::low_level::workspace::Workspace;
use glam::DVec3;
use std::cell::Cell;
use std::f64::consts::PI;
use std::path::Path;
use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, AtomEnum, ClientMessageEvent, ConnectionExt, EventMask, PropMode, SELECTION_NOTIFY_EVENT,
    SelectionNotifyEvent, SelectionRequestEvent, Window, WindowClass,
};
use x11rb::wrapper::ConnectionExt as _;

const WINDOW: [u32; 2] = [700, 500];
const SIZE: [&str; 2] = ["--size", "700x500"];
const HOME: u32 = 0xff50;
const LEFT: u32 = 0xff51;
const RIGHT: u32 = 0xff53;
const WHEEL_DOWN: u8 = 5;

fn picture() -> ([u32; 2], [u32; 2]) {
    echolume::low_level::ui::panels::picture_area(WINDOW, 1.0, true)
}

/// A point of the picture in the window.
fn place([x, y]: [f64; 2]) -> [i16; 2] {
    let (corner, _) = picture();
    [x + f64::from(corner[0]), y + f64::from(corner[1])].map(|n| n.round() as i16)
}

/// Waits until a click is no part of a double click.
fn apart() {
    pace(Duration::from_millis(450));
}

fn clicks(view: &View, points: &[[f64; 2]]) {
    for at in points.iter().map(|at| place(*at)) {
        view.click(at[0], at[1]);
        apart();
    }
}

/// Drags along these points of the picture.
fn draws(view: &View, way: impl IntoIterator<Item = [f64; 2]>) {
    let mut way = way.into_iter().map(place);
    let start = way.next().expect("a way");
    view.hover(start[0], start[1]);
    view.button(1, true);
    for at in way {
        view.hover(at[0], at[1]);
        pace(Duration::from_millis(8));
    }
    view.button(1, false);
}

/// The points of a square of this edge about the middle of the picture, every four pixels.
fn square(edge: f64) -> impl Iterator<Item = [f64; 2]> {
    let middle = picture().1.map(|n| f64::from(n) / 2.0);
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let steps = (edge / 4.0) as usize;
    (0..4 * steps).map(move |n| {
        let (side, share) = (n / steps, (n % steps) as f64 / steps as f64);
        let (a, b) = (corners[side], corners[(side + 1) % 4]);
        [0, 1].map(|axis| middle[axis] + edge * (a[axis] + (b[axis] - a[axis]) * share))
    })
}

/// The text on the clipboard, as another program gets it.
fn clipboard(desk: &Desk) -> String {
    let connection = &desk.connection;
    let own = own_window(desk);
    let [clipboard, text, kept] = ["CLIPBOARD", "UTF8_STRING", "KEPT"].map(|name| atom(desk, name));
    until("a text on the clipboard", || {
        connection.convert_selection(own, clipboard, text, kept, x11rb::CURRENT_TIME).expect("ask");
        connection.flush().expect("flush");
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(1) {
            if let Some(Event::SelectionNotify(event)) = connection.poll_for_event().expect("an event")
                && event.property != x11rb::NONE
            {
                let found = connection.get_property(true, own, kept, AtomEnum::ANY, 0, 1 << 16).expect("ask");
                return String::from_utf8(found.reply().expect("a property").value).ok();
            }
            poll();
        }
        None
    })
}

fn atom(desk: &Desk, name: &str) -> Atom {
    desk.connection.intern_atom(false, name.as_bytes()).expect("ask").reply().expect("an atom").atom
}

/// A window of this test, which nobody sees.
fn own_window(desk: &Desk) -> Window {
    let own = desk.connection.generate_id().expect("a name for a window");
    let made = desk.connection.create_window(
        0,
        own,
        desk.root,
        0,
        0,
        1,
        1,
        0,
        WindowClass::INPUT_ONLY,
        x11rb::COPY_FROM_PARENT,
        &Default::default(),
    );
    made.expect("a window");
    own
}

/// Drops a file on the window as a file manager does, by XDND version 5.
fn drop_file(view: &View, file: &str) {
    let (desk, connection) = (view.desk, &view.desk.connection);
    let own = own_window(desk);
    let of = |name: &str| atom(desk, name);
    let (selection, list, copy) = (of("XdndSelection"), of("text/uri-list"), of("XdndActionCopy"));
    connection.set_selection_owner(own, selection, x11rb::CURRENT_TIME).expect("own");
    let tell = |name: &str, data: [u32; 5]| {
        let event = ClientMessageEvent::new(32, view.window, of(name), data);
        connection.send_event(false, view.window, EventMask::NO_EVENT, event).expect("send");
        connection.flush().expect("flush");
    };
    // Answers what is asked of the file until the window says this.
    let answered = Cell::new(false);
    let hears = |name: &str| {
        let wanted = of(name);
        until(name, || {
            while let Some(event) = connection.poll_for_event().expect("an event") {
                match event {
                    Event::SelectionRequest(asked) => {
                        answer(desk, &asked, file);
                        answered.set(true);
                    }
                    Event::ClientMessage(said) if said.type_ == wanted => return Some(said.data.as_data32()),
                    _ => {}
                }
            }
            None
        })
    };
    let ([left, top], [width, height]) = view.place();
    let [x, y] = [left + width as i16 / 2, top + height as i16 / 2].map(|n| n as u32);
    tell("XdndEnter", [own, 5 << 24, list, 0, 0]);
    tell("XdndPosition", [own, 0, x << 16 | y, x11rb::CURRENT_TIME, copy]);
    assert_eq!(hears("XdndStatus")[1] & 1, 1, "it takes files");
    // What is dropped before the window knows its name is refused: a hand is slower.
    while !answered.get() {
        tell("XdndPosition", [own, 0, x << 16 | y, x11rb::CURRENT_TIME, copy]);
        hears("XdndStatus");
    }
    tell("XdndPosition", [own, 0, x << 16 | y, x11rb::CURRENT_TIME, copy]);
    hears("XdndStatus");
    tell("XdndDrop", [own, 0, x11rb::CURRENT_TIME, 0, 0]);
    assert_eq!(hears("XdndFinished")[1] & 1, 1, "it took the file");
}

fn answer(desk: &Desk, asked: &SelectionRequestEvent, file: &str) {
    let connection = &desk.connection;
    let uri = format!("file://{file}\r\n");
    let put =
        connection.change_property8(PropMode::REPLACE, asked.requestor, asked.property, asked.target, uri.as_bytes());
    put.expect("a property");
    let said = SelectionNotifyEvent {
        response_type: SELECTION_NOTIFY_EVENT,
        sequence: 0,
        time: asked.time,
        requestor: asked.requestor,
        selection: asked.selection,
        target: asked.target,
        property: asked.property,
    };
    connection.send_event(false, asked.requestor, EventMask::NO_EVENT, said).expect("send");
    connection.flush().expect("flush");
}

/// An ellipse, a traced square and a volume of two traced squares, in pixels of known size, in the workspace and as a table on the clipboard.
#[test]
fn what_is_drawn_by_the_mouse_is_measured_kept_and_copied() {
    let desk = Desk::new(false);
    let folder = Folder::new("measured");
    let kept = folder.path("kept");
    let view = desk.view(&[&SIZE[..], &["--source", SWEEP, "--mode", "mpr", "--save-to", &kept]].concat());
    let (_, size) = picture();
    view.shows_middle(&headless(size, &["--mode", "mpr"]), "the plane");
    let middle = size.map(|n| f64::from(n) / 2.0);
    desk.tap('e');
    clicks(&view, &[[-60.0, 0.0], [60.0, 0.0], [0.0, 40.0]].map(|[x, y]| [middle[0] + x, middle[1] + y]));
    desk.tap('o');
    draws(&view, square(80.0));
    desk.tap('w');
    draws(&view, square(120.0));
    view.button(WHEEL_DOWN, true);
    view.button(WHEEL_DOWN, false);
    apart();
    draws(&view, square(120.0));
    desk.tap(RETURN);
    let file = desk.save_workspace(&kept);
    let workspace = until("the whole workspace", || Workspace::read(&file).ok());
    let settings = workspace.layers.clone().finish().expect("settings");
    let recording = echolume::low_level::source::open(SWEEP.as_ref(), None).expect("it opens");
    let input = Input { stored: recording.stored_type(), range: recording.range() };
    let pixel = Scene::new(recording.geometry(0), input, settings.clone()).expect("a scene").tiling().pixel;
    let measured: Vec<(MeasureKind, f64)> =
        settings.drawn.measure.iter().map(|m| (m.kind, outcome::quantities(m).expect("results")[0].value)).collect();
    let cm2 = pixel * pixel / 100.0;
    // A notch is 1 mm. winit 0.30 takes press and release of a wheel without smooth scrolling, as this server has one, for a notch each.
    let contours = &settings.drawn.measure[2].contours;
    let apart = (DVec3::from(contours[1][0]) - DVec3::from(contours[0][0])).z.abs();
    assert!([1.0, 2.0].iter().any(|mm| (apart - mm).abs() < 1e-6), "the wheel moved the plane by {apart} mm");
    let truth = [
        (MeasureKind::Ellipse, PI * 60.0 * 40.0 * cm2),
        (MeasureKind::Trace, 80.0 * 80.0 * cm2),
        // Each area counts half of the way to the other plane on both of its sides.
        (MeasureKind::Volume, 2.0 * 120.0 * 120.0 * cm2 * apart / 10.0),
    ];
    assert_eq!(measured.len(), truth.len(), "{measured:?}");
    for ((kind, found), (wanted, value)) in measured.iter().zip(truth) {
        assert!(*kind == wanted && (found - value).abs() < 0.03 * value, "{kind:?}: {found}, not {value}");
    }
    desk.control('c');
    let table = clipboard(&desk);
    let name = Path::new(SWEEP).file_name().expect("a name").to_string_lossy();
    assert_eq!(table, outcome::csv(&settings.drawn.measure, &name));
    for (n, (_, found)) in measured.iter().enumerate() {
        let line = table.lines().find(|line| line.starts_with(&format!("{},", n + 1))).expect("a line");
        let value: f64 = line.split(',').nth(4).and_then(|value| value.parse().ok()).expect("a number");
        assert!((value - found).abs() < 1e-3, "{line}");
    }
    view.leave();
}

/// The wheel and the right button need no tool, and each turn is taken back by one undo.
#[test]
fn the_wheel_and_the_right_button_change_the_view_without_a_tool() {
    let desk = Desk::new(false);
    let view = desk.view(&[&SIZE[..], &PLAIN, &["--source", SWEEP]].concat());
    let (_, size) = picture();
    let start = plain(size, &[]);
    view.shows_middle(&start, "the start");
    let [x, y] = place(size.map(|n| f64::from(n) / 2.0));
    let looks = |what: &str| {
        let (corner, _) = picture();
        let (from, half) = (size.map(|n| n / 4), size.map(|n| n / 2));
        let wanted = crop(&start, from, half).expect("the middle");
        until(what, || {
            let seen = view.look_at([corner[0] + from[0], corner[1] + from[1]], half)?;
            (seen != wanted).then_some(())
        });
    };
    view.hover(x, y);
    view.button(4, true);
    view.button(4, false);
    looks("closer by the wheel");
    desk.control('z');
    view.shows_middle(&start, "taken back");
    view.button(3, true);
    for n in 1..=8 {
        view.hover(x + 4 * n, y);
        pace(Duration::from_millis(10));
    }
    view.button(3, false);
    looks("moved by the right button");
    desk.control('z');
    view.shows_middle(&start, "taken back again");
    view.leave();
}

/// The volumes of the loop are those of the recording; a dropped file and a folder of DICOM files from the list are shown as `render` draws them.
#[test]
fn volumes_dropped_files_and_folders_of_the_list_are_shown() {
    let desk = Desk::new(false);
    let folder = Folder::new("shown");
    let [sweep, other] = ["sweep.mha", "with space.mha"].map(|name| folder.path(name));
    let phantom = |more: &[&str]| {
        let mut command = std::process::Command::new(PROGRAM);
        let output = command.args(["phantom", "--frames", "12", "--lines", "32"]).args(more).output();
        let output = output.expect("the program runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    phantom(&["--volumes", "3", "--both-ways", "-o", &sweep]);
    phantom(&["--body", "sphere", "-o", &other]);
    let series = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dicom/series");
    for file in std::fs::read_dir(&series).expect("a folder").flatten() {
        std::fs::copy(file.path(), folder.path(&file.file_name().to_string_lossy())).expect("a copy");
    }
    // The window of a live volume would follow from the first one.
    let mip = ["--mode", "mip", "--set", "projection.window=[0,1]"];
    let view = desk.view(&[&SIZE[..], &["--source", &sweep], &mip].concat());
    let (_, size) = picture();
    let of = |n: &str| rendered(&sweep, size, &[&mip[..], &["--volume", n]].concat());
    let volumes = ["0", "1", "2"].map(of);
    assert!(volumes[0] != volumes[1] && volumes[1] != volumes[2]);
    view.shows_middle(&volumes[2], "the newest volume");
    for (key, n, what) in [(HOME, 0, "the oldest"), (RIGHT, 1, "the next"), (RIGHT, 2, "the last"), (LEFT, 1, "back")] {
        desk.tap(key);
        view.shows_middle(&volumes[n], what);
    }
    drop_file(&view, &other.replace(' ', "%20"));
    view.shows_middle(&rendered(&other, size, &mip), "the dropped file");
    desk.control('o');
    // The folder above, then its DICOM files as one recording.
    let wanted = rendered(&series.to_string_lossy(), size, &mip);
    apart();
    desk.tap('2');
    view.shows_middle(&wanted, "the folder of DICOM files");
    let said = view.leave();
    assert!(!said.contains("validation"), "{said}");
}
