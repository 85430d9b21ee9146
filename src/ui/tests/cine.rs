//! The cine loop's marks, speed and direction, and the bar of saved pictures, as settings of the user.

use super::shown::Shown;
use super::*;
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
        assert_eq!(shown.controls.settings().cine, *cine);
        shown.apply(Command::Undo);
    }
    for cine in &expected[1..] {
        assert_eq!(shown.apply(Command::Redo), Change::Marks);
        assert_eq!(shown.controls.settings().cine, *cine);
    }
    assert_eq!(shown.scene.settings, rendered, "the picture is not drawn again");
    // A reset of the view keeps it, as it keeps the measurements.
    shown.apply(Command::Reset);
    assert_eq!(shown.controls.settings().cine, expected[expected.len() - 1]);
}

/// Prevents a workspace that is rendered without the bar which the window saves, and a loop that begins anew with each opening.
#[test]
fn a_workspace_keeps_the_bar_and_the_loop() {
    let mut shown = Shown::new("marks.bar=true\ncine={first=2,speed=4}");
    let bar = shown.find("Controls", Role::Switch, "Bar on saved pictures");
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
    assert_eq!((settings.marks.bar, settings.cine), (false, Cine { first: Some(2), speed: 4.0, ..Cine::default() }));
    assert_eq!(shown.apply(Command::Undo), Change::Marks);
    assert!(read(&shown).marks.bar);
}
