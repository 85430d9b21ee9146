//! The tiles, the names and the buttons of a comparison.

use super::shown::Shown;
use super::*;
use crate::command::{CompareView, Link};
use crate::comparison;
use crate::panels::accesskit::{Action, Role};
use crate::picture::Picture;
use crate::texts;
use std::sync::Arc;

fn compared(view: CompareView, size: [u32; 2]) -> Shown {
    let mut shown = Shown::sized("", size, 1.0);
    let picture = || Some(Arc::new(Picture::filled([8, 8], [200, 100, 50])));
    shown.compared = Some(comparison::Shown {
        view,
        wipe: 0.25,
        links: [true, false, true, false],
        first: "before.mha".into(),
        others: vec![comparison::Other {
            name: "after.mha".into(),
            is_synthetic: true,
            picture: picture(),
            ..comparison::Other::default()
        }],
        difference: picture(),
    });
    shown.settle();
    shown
}

#[test]
fn every_button_of_a_comparison_gives_its_command() {
    for size in [[1600, 900], [800, 600]] {
        let mut shown = compared(CompareView::Tiles, size);
        shown.check("comparison");
        for (name, command) in [
            (texts::COMPARED_TILES[0], Command::CompareView(CompareView::Tiles)),
            (texts::COMPARED_DIFFERENCE[0], Command::CompareView(CompareView::Difference)),
            (texts::COMPARED_WIPE[0], Command::CompareView(CompareView::Wipe)),
            (texts::LINK_VIEW[0], Command::ToggleLink(Link::View)),
            (texts::LINK_PLANES[0], Command::ToggleLink(Link::Planes)),
            (texts::LINK_LOOK[0], Command::ToggleLink(Link::Look)),
            (texts::LINK_VOLUME[0], Command::ToggleLink(Link::Volume)),
            (texts::ALIGN, Command::Align),
            (texts::ADD_COMPARED[0], Command::CompareFurther),
            (texts::END_COMPARISON[0], Command::Compare),
        ] {
            let node = shown.find(texts::COMPARISON, Role::Button, name);
            assert_eq!(shown.ask(node, Action::Click, None), [command], "{name}");
        }
    }
}

/// Tiles lie beside each other in the room of the picture, in a high one above each other, and the last one ends where the room does.
#[test]
fn tiles_share_the_room_of_the_picture() {
    for size in [[1600, 900], [700, 1300]] {
        let whole = crate::panels::picture_area(size, 1.0, true);
        for (view, count) in [(CompareView::Tiles, 2), (CompareView::Difference, 3), (CompareView::Wipe, 1)] {
            let room = compared(view, size).room();
            let axis = usize::from(whole.1[0] < whole.1[1]);
            let (first, last) = (room.tile(0), room.tile(count - 1));
            assert_eq!((first.0, room.picture), (whole.0, first));
            let end = last.0[axis] + last.1[axis];
            let of_room = whole.0[axis] + whole.1[axis];
            assert!(end <= of_room && of_room - end < count, "{view:?} {size:?}: {last:?} in {whole:?}");
            assert_eq!(last.1[1 - axis], whole.1[1 - axis], "{view:?}");
        }
    }
}

/// A drag of the handle moves the line of the wipe to where the pointer is.
#[test]
fn the_line_of_the_wipe_follows_the_pointer() {
    let mut shown = compared(CompareView::Wipe, [1600, 900]);
    let (corner, size) = shown.room().picture;
    let y = f64::from(corner[1]) + 0.5 * f64::from(size[1]);
    let at = |share: f64| [f64::from(corner[0]) + share * f64::from(size[0]), y];
    shown.panels.input(&Input::Moved(at(0.25)));
    shown.lay_out();
    shown.panels.input(&Input::Button { button: Button::Left, pressed: true });
    shown.lay_out();
    shown.panels.input(&Input::Moved(at(0.6)));
    let commands = shown.lay_out();
    let moved = commands.iter().rev().find_map(|command| match command {
        Command::MoveWipe(share) => Some(*share),
        _ => None,
    });
    assert!(moved.is_some_and(|share| (share - 0.6).abs() < 0.01), "{commands:?}");
}

/// Four tiles are a square whose last tile ends where the room does; there is no button for a fifth.
#[test]
fn four_tiles_are_a_square() {
    let mut shown = compared(CompareView::Tiles, [1600, 900]);
    let others = shown.compared.as_mut().map(|shown| &mut shown.others).expect("a comparison");
    others.extend([others[0].clone(), others[0].clone()]);
    shown.settle();
    shown.check("four tiles");
    let (room, whole) = (shown.room(), crate::panels::picture_area([1600, 900], 1.0, true));
    assert_eq!((room.tile(1).0[1], room.tile(2).0[0]), (whole.0[1], whole.0[0]), "rows of two");
    for axis in 0..2 {
        let (end, of_room) = (room.tile(3).0[axis] + room.tile(3).1[axis], whole.0[axis] + whole.1[axis]);
        assert!(end <= of_room && of_room - end < 2, "{axis}");
    }
    assert!(shown.all(texts::COMPARISON, Role::Button, texts::ADD_COMPARED[0]).is_empty());
}

/// A drag over B moves it, with Shift it turns, in pixels of its picture.
#[test]
fn a_drag_over_the_compared_picture_moves_its_volume() {
    for turns in [false, true] {
        let mut shown = compared(CompareView::Tiles, [1600, 900]);
        let (corner, size) = shown.room().tile(1);
        let at = |x: f64, y: f64| [0, 1].map(|a| f64::from(corner[a]) + [x, y][a] * f64::from(size[a]));
        if turns {
            shown.panels.input(&Input::Modifiers(Modifiers { shift: true, ..Modifiers::default() }));
        }
        shown.panels.input(&Input::Moved(at(0.4, 0.5)));
        shown.lay_out();
        shown.panels.input(&Input::Button { button: Button::Left, pressed: true });
        shown.lay_out();
        let mut ends: Vec<[[f64; 2]; 2]> = Vec::new();
        for x in [0.5, 0.6] {
            shown.panels.input(&Input::Moved(at(x, 0.5)));
            for command in shown.lay_out() {
                let Command::MoveCompared(0, pixels, turned) = command else { panic!("{command:?}") };
                assert_eq!(turned, turns);
                ends.push(pixels);
            }
        }
        let [from, to] = [ends[0][0], ends[ends.len() - 1][1]];
        let expected = [0.4, 0.6].map(|share| [share * f64::from(size[0]), 0.5 * f64::from(size[1])]);
        let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        assert!(off(from, expected[0]) < 1.0 && off(to, expected[1]) < 1.0, "{from:?} {to:?}, not {expected:?}");
    }
}
