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
        name: "after.mha".into(),
        is_synthetic: true,
        picture: picture(),
        difference: picture(),
        is_aligned: false,
        is_aligning: false,
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
            (texts::COMPARED_TILES, Command::CompareView(CompareView::Tiles)),
            (texts::COMPARED_DIFFERENCE, Command::CompareView(CompareView::Difference)),
            (texts::COMPARED_WIPE, Command::CompareView(CompareView::Wipe)),
            (texts::LINK_VIEW, Command::ToggleLink(Link::View)),
            (texts::LINK_PLANES, Command::ToggleLink(Link::Planes)),
            (texts::LINK_LOOK, Command::ToggleLink(Link::Look)),
            (texts::LINK_VOLUME, Command::ToggleLink(Link::Volume)),
            (texts::ALIGN, Command::Align),
            (texts::END_COMPARISON, Command::Compare),
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
