//! The cine loop's marks, speed and direction, and the bar of saved pictures, as settings of the user.

use super::shown::Shown;
use super::*;
use crate::command::InspectorTab;
use crate::panels::accesskit::{Action, Role};
use crate::scene::Cine;
use crate::workspace::{Origin, text};

/// Prevents a loop that undo forgets, and one that makes the picture be drawn again.
#[test]
fn how_the_loop_is_played_is_undone_step_by_step() {
    let mut shown = Shown::new("");
    let rendered = shown.scene.settings.clone();
    let mut expected = vec![Cine::default()];
    let mut then = |change: &dyn Fn(&mut Cine)| {
        let mut next = expected[expected.len() - 1];
        change(&mut next);
        expected.push(next);
    };
    assert_eq!(shown.controls.mark_cine(3, false), Change::Marks);
    then(&|cine| cine.first = Some(3));
    assert_eq!(shown.controls.mark_cine(8, true), Change::Marks);
    then(&|cine| cine.last = Some(8));
    for _ in 0..2 {
        assert_eq!(shown.apply(Command::CineSpeed(-1)), Change::Marks);
    }
    then(&|cine| cine.speed = 0.5);
    then(&|cine| cine.speed = 0.25);
    assert_eq!(shown.apply(Command::BackAndForth(true)), Change::Marks);
    then(&|cine| cine.back_and_forth = true);
    assert_eq!(shown.apply(Command::BackAndForth(true)), Change::Nothing);
    assert_eq!(shown.apply(Command::WholeCine), Change::Marks);
    then(&|cine| (cine.first, cine.last) = (None, None));
    for cine in expected.iter().rev() {
        assert_eq!(shown.controls.settings().drawn.cine, *cine);
        shown.apply(Command::Undo);
    }
    for cine in &expected[1..] {
        assert_eq!(shown.apply(Command::Redo), Change::Marks);
        assert_eq!(shown.controls.settings().drawn.cine, *cine);
    }
    assert_eq!(shown.scene.settings, rendered, "the picture is not drawn again");
    // A reset of the view keeps it, as it keeps the measurements.
    shown.apply(Command::Reset);
    assert_eq!(shown.controls.settings().drawn.cine, expected[expected.len() - 1]);
}

/// Prevents a workspace that is rendered without the bar which the window saves, and a loop that begins anew with each opening.
#[test]
fn a_workspace_keeps_the_bar_and_the_loop() {
    let mut shown = Shown::new("marks.bar=true\ncine={first=2,speed=4}");
    shown.tab(InspectorTab::Marks);
    let bar = shown.find("Marks", Role::Switch, "Bar on saved pictures");
    assert_eq!(shown.ask(bar, Action::Click, None), [Command::SavesBar(false)]);
    let read = |shown: &Shown| {
        let saved = text(shown.controls.settings(), &Origin::of(None)).expect("a workspace");
        let mut table: toml::Table = toml::from_str(&saved).expect("a table");
        table.remove("workspace");
        let mut layers = Layers::default();
        layers.table("workspace", table, std::path::Path::new("")).expect("settings");
        layers.finish().expect("settings")
    };
    let settings = read(&shown);
    assert_eq!(
        (settings.drawn.marks.bar, settings.drawn.cine),
        (false, Cine { first: Some(2), speed: 4.0, ..Cine::default() })
    );
    assert_eq!(shown.apply(Command::Undo), Change::Marks);
    assert!(read(&shown).drawn.marks.bar);
}

/// Requirement: on the line of time a press shows a volume, the ends of the loop are dragged, a double click plays all, and keys and a screen reader
/// step.
#[test]
fn the_line_of_time_seeks_and_trims() {
    let mut shown = Shown::new("mode='surface'");
    let line = shown.find("Cine loop", Role::Slider, "Volume of the loop");
    let bounds = shown.tree[&line].bounds().expect("its place");
    // The area that reacts is wider than the line.
    let (left, width) = (bounds.x0 + 4.0, bounds.x1 - bounds.x0 - 8.0);
    let y = (bounds.y0 + bounds.y1) / 2.0;
    let at = |index: f64| [left + width * index / 20.0, y];
    let button = |pressed| Input::Button { button: Button::Left, pressed };
    let mut does = |inputs: &[Input]| {
        let mut commands = Vec::new();
        for input in inputs {
            shown.panels.input(input);
            commands.extend(shown.lay_out());
        }
        shown.time += 1.0;
        commands
    };
    let seeks = does(&[Input::Moved(at(7.5)), button(true), button(false)]);
    assert!(!seeks.is_empty() && seeks.iter().all(|command| *command == Command::SeekCine(7)), "{seeks:?}");
    let drags =
        does(&[Input::Moved(at(0.0)), button(true), Input::Moved(at(3.1)), Input::Moved(at(4.0)), button(false)]);
    assert!(drags.contains(&Command::TrimCine(3, false)) && drags.contains(&Command::TrimCine(4, false)), "{drags:?}");
    let drags = does(&[Input::Moved(at(20.0)), button(true), Input::Moved(at(12.0)), button(false)]);
    assert!(drags.contains(&Command::TrimCine(11, true)), "{drags:?}");
    let twice = does(&[Input::Moved(at(9.5)), button(true), button(false), button(true), button(false)]);
    assert!(twice.contains(&Command::WholeCine), "{twice:?}");
    assert_eq!(shown.ask(line, Action::Increment, None), [Command::SeekCine(3)], "the third of 20 is shown");
    shown.ask(line, Action::Focus, None);
    assert_eq!(shown.key(crate::input::Key::Left, false), [Command::SeekCine(1)]);
    let data = Some(crate::panels::accesskit::ActionData::NumericValue(20.0));
    assert_eq!(shown.ask(line, Action::SetValue, data), [Command::SeekCine(19)]);
}
