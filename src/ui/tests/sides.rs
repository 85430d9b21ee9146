//! The patient's sides and the probe's marker as the user states them.

use super::shown::Shown;
use super::*;
use crate::command::InspectorTab;
use crate::panels::accesskit::{Action, Role};
use crate::panels::colours::{ACCENT, SIDES};
use crate::panels::drawn::Kind;
use crate::scene::marks::Edge;
use crate::scene::{ProbeMarker, Sides, VolumeAxis};
use crate::workspace::{Origin, text};

const LATERAL: &str = "Scan lines, first to last";

/// The inspector with the sides.
fn opened(toml: &str) -> Shown {
    let mut shown = Shown::new(toml);
    shown.tab(InspectorTab::Marks);
    shown
}

fn press(shown: &mut Shown, group: &str, name: &str) -> Vec<Command> {
    let button = shown.find(group, Role::Button, name);
    let commands = shown.ask(button, Action::Click, None);
    shown.settle();
    commands
}

/// The letters over the picture, and the number of dots.
fn marks(shown: &Shown) -> (Vec<String>, usize) {
    // Controls may have a white letter too.
    let ([left, _], [width, _]) = crate::panels::picture_area(shown.size, 1.0, true);
    let picture = left as f32..(left + width) as f32;
    let letters = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
        Kind::Text { area, text, colours, .. }
            if text.len() == 1 && colours[0] == SIDES.to_array() && picture.contains(&area[0]) =>
        {
            Some(text.clone())
        }
        _ => None,
    });
    let is_dot = |kind: &Kind| matches!(kind, Kind::Circle { radius: 5.0, fill, .. } if *fill == ACCENT.to_array());
    (letters.collect(), shown.drawn.iter().filter(|drawn| is_dot(&drawn.kind)).count())
}

/// Prevents sides that only a file can state, and letters that change the picture itself.
#[test]
fn the_user_states_the_sides_by_controls_and_takes_them_back() {
    let mut shown = opened("layout='four'\nmode='surface'");
    assert_eq!(marks(&shown), (Vec::new(), 3), "plane B looks along the scan lines: it has no dot");
    let rendered = shown.scene.settings.clone();
    let asked = press(&mut shown, LATERAL, "right to left");
    assert_eq!(asked, [Command::Sides(VolumeAxis::Lateral, Sides::RightLeft)]);
    assert_eq!(shown.controls.settings().drawn.marks.lateral, Sides::RightLeft);
    assert_eq!(shown.scene.settings, rendered, "the picture is not drawn again");
    let tiles = shown.scene.marks_with(&shown.controls.settings().drawn.marks);
    let across = [(Edge::Left, "R"), (Edge::Right, "L")];
    assert!(tiles.iter().filter(|tile| tile.letters == across).count() == 3, "{tiles:?}");
    let (mut letters, dots) = marks(&shown);
    letters.sort();
    assert_eq!((letters.concat().as_str(), dots), ("LLLRRR", 3), "on each tile that shows the axis");
    let header = shown.find("Marks", Role::Button, "Sides");
    assert_eq!(shown.tree[&header].value(), Some("R-L"));
    let saved = text(shown.controls.settings(), &Origin::of(None)).expect("a workspace");
    assert!(saved.contains("lateral = \"right-left\""), "{saved}");
    for (command, sides, count) in [
        (Command::ExchangeLeftAndRight, Sides::LeftRight, 6),
        (Command::Undo, Sides::RightLeft, 6),
        (Command::Undo, Sides::None, 0),
        (Command::Redo, Sides::RightLeft, 6),
    ] {
        shown.apply(command);
        assert_eq!(shown.controls.settings().drawn.marks.lateral, sides, "{command:?}");
        assert_eq!((marks(&shown).0.len(), &shown.scene.settings), (count, &rendered), "{command:?}");
    }
}

#[test]
fn the_letters_are_exchanged_and_a_pair_lies_along_one_axis() {
    let mut shown = opened("mode='plane'\nmarks.lateral='left-right'");
    assert_eq!(press(&mut shown, "Sides", "Exchange L and R"), [Command::ExchangeLeftAndRight]);
    assert_eq!(shown.controls.settings().drawn.marks.lateral, Sides::RightLeft);
    press(&mut shown, "Slices, first to last", "left to right");
    let marks = &shown.controls.settings().drawn.marks;
    assert_eq!((marks.lateral, marks.elevation), (Sides::None, Sides::LeftRight), "L and R cannot lie along two axes");
    press(&mut shown, "From the probe down", "front to back");
    press(&mut shown, "Slices, first to last", "no letters");
    let marks = &shown.controls.settings().drawn.marks;
    assert_eq!((marks.depth, marks.elevation), (Sides::FrontBack, Sides::None));
    let exchange = shown.find("Sides", Role::Button, "Exchange L and R");
    assert!(shown.tree[&exchange].is_disabled(), "there is neither L nor R");
}

#[test]
fn the_user_states_where_the_marker_of_the_probe_is() {
    let mut shown = opened("mode='plane'");
    let edge = |shown: &Shown| shown.scene.marks_with(&shown.controls.settings().drawn.marks)[0].probe;
    assert_eq!(edge(&shown), Some(Edge::Left));
    assert_eq!(press(&mut shown, "Probe marker (dot)", "Last"), [Command::ProbeMarker(ProbeMarker::Last)]);
    assert_eq!((edge(&shown), marks(&shown).1), (Some(Edge::Right), 1));
    press(&mut shown, "Probe marker (dot)", "Hidden");
    assert_eq!((edge(&shown), marks(&shown).1), (None, 0));
    shown.apply(Command::Undo);
    assert_eq!(edge(&shown), Some(Edge::Right), "one step each");
}

/// Prevents sides that need a pointer, and a group that a narrow window has not.
#[test]
fn the_group_is_reached_by_the_keyboard_and_in_a_window_without_a_column() {
    let mut shown = opened("mode='plane'");
    let button = shown.find(LATERAL, Role::Button, "left to right");
    shown.ask(button, Action::Focus, None);
    assert_eq!(shown.key(crate::input::Key::Space, false), [Command::Sides(VolumeAxis::Lateral, Sides::LeftRight)]);
    let mut narrow = Shown::sized("mode='plane'", [640, 480], 1.0);
    narrow.tab(InspectorTab::Marks);
    narrow.check("a narrow window");
    assert_eq!(press(&mut narrow, LATERAL, "right to left"), [Command::Sides(VolumeAxis::Lateral, Sides::RightLeft)]);
}
