//! Body marks: what drags, clicks, the wheel, buttons and keys do to them, in every mode and layout.

use super::shown::Shown;
use super::*;
use crate::input::Key;
use crate::keys::binding;
use crate::measure::body_marks::{centre_of, drawn, probe_of};
use crate::panels::accesskit::{Action, Role};
use crate::panels::colours::{BODY, MEASURE};
use crate::panels::drawn::Kind;
use crate::scene::{Body, BodyMark, MAX_BODY_MARKS};
use crate::texts;

const MARK: &str = "body_marks=[{body='neck',at=[0.75,0.25],size=0.3,probe=[0.2,-0.1],angle=30}]";
const MODES: [&str; 6] = [
    "mode='surface'",
    "mode='volume'\nlayout='four'",
    "layout='pair'",
    "mode='plane'",
    "mode='tomography'",
    "mode='cube'",
];

fn window(toml: &str) -> TestWindow {
    let mut window = TestWindow::new(&format!("{toml}\n{MARK}"));
    window.tool(Tool::BodyMark);
    window
}

fn mark(window: &TestWindow) -> BodyMark {
    window.controls.body_marks()[0]
}

fn size(window: &TestWindow) -> [f64; 2] {
    window.scene().picture_size().map(f64::from)
}

/// Requirement: what is grabbed stays under the pointer, on a rendering, on planes and where no tile is.
#[test]
fn the_probe_and_the_mark_follow_the_pointer_and_nothing_else_moves() {
    for toml in MODES {
        let mut window = window(toml);
        let (before, picture) = (window.controls.settings().clone(), size(&window));
        let from = probe_of(&mark(&window), picture);
        let to = [from[0] - 20.0, from[1] + 25.0];
        window.drag(Button::Left, from, to);
        let [x, y] = probe_of(&mark(&window), picture);
        // The slop is 3 pixels of the picture.
        assert!((x - to[0]).hypot(y - to[1]) <= 3.1, "{toml}: {x} {y} {to:?}");
        let probed = mark(&window);
        assert_eq!(BodyMark { probe: probed.probe, ..before.drawn.body_marks[0] }, probed, "{toml}");
        // The body, off the probe.
        let centre = centre_of(&probed, picture);
        let from = [centre[0] + 60.0, centre[1] - 60.0];
        window.drag(Button::Left, from, [from[0] - 100.0, from[1] + 90.0]);
        let [x, y] = centre_of(&mark(&window), picture);
        assert!((x - centre[0] + 100.0).hypot(y - centre[1] - 90.0) <= 3.2, "{toml}: {x} {y}");
        assert_eq!(BodyMark { at: mark(&window).at, ..probed }, mark(&window), "{toml}");
        let after = window.controls.settings().clone();
        assert_eq!(after.clone().with_drawings_of(&before), before, "{toml}: the picture stays as it is");
        apply(&mut window, Command::Undo);
        assert_eq!(window.controls.settings(), &before, "{toml}: drags of one mark are one step");
        apply(&mut window, Command::Redo);
        assert_eq!(window.controls.settings(), &after);
    }
}

#[test]
fn a_click_puts_the_probe_there_and_the_wheel_turns_it() {
    for toml in MODES {
        let mut window = window(toml);
        let picture = size(&window);
        let before = window.controls.settings().clone();
        let centre = centre_of(&mark(&window), picture);
        let at = [centre[0] - 30.0, centre[1] - 40.0];
        window.click(at);
        assert!(probe_of(&mark(&window), picture).iter().zip(at).all(|(a, b)| (a - b).abs() < 0.1), "{toml}");
        // A second click there is no double click on the tile below.
        window.click(at);
        window.input(Input::Scroll(1.0));
        window.input(Input::Scroll(1.0));
        assert_eq!(mark(&window).angle, 60.0, "{toml}");
        window.input(Input::Scroll(-14.0));
        assert_eq!(mark(&window).angle, -150.0, "{toml}");
        let settings = window.controls.settings().clone();
        assert_eq!(settings.with_drawings_of(&before), before, "{toml}: neither zoom nor planes nor layout");
    }
}

/// Prevents marks that are in the way of other tools, and a tool that holds the view.
#[test]
fn other_tools_pass_through_marks_and_beside_marks_their_tool_turns_the_view() {
    let mut window = window("mode='surface'");
    let (before, picture) = (window.controls.settings().clone(), size(&window));
    window.drag(Button::Left, [picture[0] * 0.3, picture[1] * 0.7], [picture[0] * 0.4, picture[1] * 0.6]);
    assert_ne!(window.controls.settings().camera, before.camera);
    assert_eq!(window.controls.body_marks(), before.drawn.body_marks);
    let turned = window.controls.settings().camera.clone();
    window.tool(Tool::Rotate);
    let probe = probe_of(&mark(&window), picture);
    window.drag(Button::Left, probe, [probe[0] - 40.0, probe[1]]);
    assert_ne!(window.controls.settings().camera, turned);
    assert_eq!(window.controls.body_marks(), before.drawn.body_marks);
}

#[test]
fn marks_are_added_in_the_corners_and_kept_within_their_limits() {
    let mut window = TestWindow::new("");
    for n in 0..MAX_BODY_MARKS {
        assert_eq!(apply(&mut window, Command::AddBodyMark(Body::Head)), Change::Marks);
        assert_eq!(window.controls.body_mark().map(|(index, _)| index), Some(n), "the new one");
    }
    let all = window.controls.body_marks().to_vec();
    let squares = drawn(&all, size(&window));
    for (n, one) in squares.iter().enumerate() {
        let apart = |other: &&crate::measure::body_marks::Drawn| {
            (0..2).any(|i| (one.corner[i] - other.corner[i]).abs() >= one.edge)
        };
        assert_eq!(squares[..n].iter().filter(apart).count(), n, "they do not lie over each other");
    }
    let full = apply(&mut window, Command::AddBodyMark(Body::Neck));
    assert_eq!(full, Change::Refused(texts::TOO_MANY_BODY_MARKS));
    let wild = BodyMark { at: [7.0, -3.0], size: 9.0, probe: [-5.0, 2.0], angle: 725.0, ..all[1] };
    apply(&mut window, Command::ChangeBodyMark(1, wild));
    let kept = window.controls.body_marks()[1];
    assert_eq!((kept.at, kept.size, kept.probe, kept.angle), ([1.0, 0.0], 0.5, [-1.0, 1.0], 5.0));
    for wrong in [BodyMark { angle: f64::NAN, ..kept }, BodyMark { at: [f64::INFINITY, 0.0], ..kept }] {
        assert_eq!(apply(&mut window, Command::ChangeBodyMark(1, wrong)), Change::Nothing);
    }
    assert_eq!(apply(&mut window, Command::ChangeBodyMark(9, kept)), Change::Nothing);
    assert_eq!(apply(&mut window, Command::RemoveBodyMark(0)), Change::Marks);
    assert_eq!(window.controls.body_marks(), [kept, all[2], all[3]]);
    apply(&mut window, Command::Undo);
    assert_eq!(window.controls.body_marks().len(), MAX_BODY_MARKS);
    // Reset is about the picture: what was drawn over it stays.
    apply(&mut window, Command::Reset);
    assert_eq!(window.controls.body_marks().len(), MAX_BODY_MARKS);
    // Another part of the body is a step of its own.
    apply(&mut window, Command::ChangeBodyMark(0, BodyMark { angle: 10.0, ..all[0] }));
    apply(&mut window, Command::ChangeBodyMark(0, BodyMark { angle: 10.0, body: Body::Uterus, ..all[0] }));
    apply(&mut window, Command::Undo);
    assert_eq!(window.controls.body_marks()[0], BodyMark { angle: 10.0, ..all[0] });
}

/// By buttons and sliders alone, as a keyboard or a screen reader asks for them.
#[test]
fn buttons_choose_the_body_and_sliders_place_it_without_a_pointer() {
    let key = binding(Key::Char('b'), Modifiers { shift: true, ..Modifiers::default() }).expect("a key");
    assert_eq!(key.command, Command::Tool(Tool::BodyMark));
    let mut shown = Shown::new("");
    let find = |shown: &Shown, name: &str| {
        shown.tree.iter().find(|(_, node)| node.label() == Some(name) && node.role() != Role::Label).map(|(id, _)| *id)
    };
    assert!(find(&shown, Body::Neck.title()).is_none());
    shown.apply(Command::Tool(Tool::BodyMark));
    for body in Body::ALL {
        assert!(find(&shown, body.title()).is_some(), "{body:?}");
    }
    let press = |shown: &mut Shown, name: &str| {
        let node = find(shown, name).unwrap_or_else(|| panic!("no {name}"));
        shown.ask(node, Action::Click, None);
    };
    press(&mut shown, Body::FetusBreech.title());
    press(&mut shown, Body::Neck.title());
    press(&mut shown, texts::MIRRORED[0]);
    let expected = BodyMark { body: Body::Neck, mirrored: true, ..BodyMark::default() };
    assert_eq!(shown.controls.body_marks(), [expected]);
    let names = [
        texts::TURN_OF_PROBE,
        texts::PROBE_ACROSS,
        texts::PROBE_DOWN,
        texts::SIZE_OF_MARK[0],
        texts::MARK_ACROSS,
        texts::MARK_DOWN,
    ];
    for name in names {
        let before = shown.controls.body_marks()[0];
        let node = find(&shown, name).unwrap_or_else(|| panic!("no {name}"));
        shown.ask(node, Action::Increment, None);
        assert_ne!(shown.controls.body_marks()[0], before, "{name}");
    }
    press(&mut shown, texts::ADD_BODY_MARK[0]);
    assert_eq!(shown.controls.body_marks().len(), 2);
    press(&mut shown, &texts::body_mark(1));
    press(&mut shown, texts::REMOVE_BODY_MARK[0]);
    assert_eq!(shown.controls.body_marks(), [BodyMark { at: [0.12, 0.8], body: Body::Neck, ..BodyMark::default() }]);
}

/// Every line of the outline, and the probe in yellow, where `render` draws them; squares only while the tool is chosen.
#[test]
fn a_mark_is_drawn_over_the_picture_where_saved_pictures_have_it() {
    let mut shown = Shown::new(MARK);
    let is = |kind: &Kind, wanted: [u8; 4]| match kind {
        Kind::Line { colour, .. } | Kind::Circle { fill: colour, .. } => *colour == wanted,
        _ => false,
    };
    let count = |shown: &Shown, colour: [u8; 4]| shown.drawn.iter().filter(|drawn| is(&drawn.kind, colour)).count();
    let lines = drawn(shown.controls.body_marks(), shown.scene.picture_size().map(f64::from))[0].outline.len();
    assert!(count(&shown, BODY.to_array()) >= lines, "{} of {lines}", count(&shown, BODY.to_array()));
    assert_eq!(count(&shown, MEASURE.to_array()), 2, "bar and dot of the probe");
    shown.has_drawn = false;
    shown.settle();
    assert_eq!(count(&shown, BODY.to_array()), 0, "nothing over no picture");
}
