//! The controls of clip faces: there while something is clipped, and undone.

use super::shown::Shown;
use super::*;
use crate::panels::accesskit::Role;

const CLIP_ECHOES: &str = "Clip echoes";
const CLIP_THRESHOLD: &str = "Clip threshold";

fn slider(name: &str) -> usize {
    SLIDERS.iter().position(|slider| slider.name == name).expect("a slider")
}

/// Once each, in a group of their own, and not under Advanced.
fn controls(shown: &Shown) -> [bool; 2] {
    let labels =
        |role: Role| shown.tree.values().filter(move |node| node.role() == role).filter_map(|node| node.label());
    let there = [(Role::Switch, CLIP_ECHOES), (Role::Slider, CLIP_THRESHOLD)].map(|(role, name)| {
        let count = labels(role).filter(|label| *label == name).count();
        assert!(count <= 1, "{count} of {name}");
        count == 1
    });
    assert_eq!(labels(Role::Group).any(|label| label == "Clip"), there != [false; 2]);
    there
}

#[test]
fn while_something_is_clipped_a_switch_shows_the_echoes_of_its_face() {
    let mut shown = Shown::new("mode = 'sr'");
    assert_eq!(controls(&shown), [false; 2], "nothing is clipped");
    shown.apply(Command::MoveClip(30.0));
    assert!(shown.scene.has_caps());
    assert_eq!(controls(&shown), [true; 2]);
    shown.apply(Command::SetSlider(slider(CLIP_ECHOES), 0.0));
    assert!(!shown.scene.has_caps());
    assert_eq!(controls(&shown), [true, false]);
    shown.apply(Command::Undo);
    assert!(shown.scene.has_caps() && shown.controls.settings().clip.len() == 1);
    shown.apply(Command::Redo);
    assert!(!shown.scene.has_caps());
    shown.apply(Command::SetSlider(slider(CLIP_ECHOES), 1.0));
    let found = shown.scene.cap_level();
    shown.apply(Command::SetSlider(slider(CLIP_THRESHOLD), 0.2));
    assert_eq!(shown.scene.cap_level(), Some(0.2));
    shown.apply(Command::SetSlider(slider(CLIP_THRESHOLD), 0.0));
    assert_eq!((shown.scene.cap_level(), shown.controls.settings().cap.level), (found, None));
    for (mode, has) in
        [(Mode::Mip, false), (Mode::Plane, false), (Mode::Cube, false), (Mode::Mixed, true), (Mode::Volume, true)]
    {
        shown.apply(Command::Mode(mode));
        assert_eq!(controls(&shown), [has; 2], "{mode:?}");
    }
    shown.apply(Command::MoveClip(-1e5));
    assert_eq!(controls(&shown), [false; 2], "nothing is clipped any more");
}
