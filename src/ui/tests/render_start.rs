//! The render start that follows the fluid: its switch, its sliders, and its line on planes.

use super::shown::Shown;
use super::*;
use crate::panels;
use crate::panels::colours::START;
use crate::panels::drawn::Kind;
use crate::passes::unveil::StartLine;
use crate::texts::AUTO_RENDER_START as AUTO_START;

const START_OFFSET: &str = "Start offset";

fn slider(name: &str) -> usize {
    SLIDERS.iter().position(|slider| slider.name == name).expect("a slider")
}

fn names(shown: &Shown) -> Vec<String> {
    shown.tree.values().filter_map(|node| Some(node.label()?.to_string())).collect()
}

/// The switch and, while it is on, its offset are in sight; where nothing is rendered, or everything is drawn, there is no start.
#[test]
fn a_switch_starts_rendering_at_the_fluid() {
    let mut shown = Shown::new("mode = 'vr'");
    let has = |shown: &Shown, name: &str| names(shown).iter().any(|known| known == name);
    assert!(has(&shown, AUTO_START) && !has(&shown, START_OFFSET));
    shown.apply(Command::SetSlider(slider(AUTO_START), 1.0));
    assert!(shown.scene.unveils() && has(&shown, START_OFFSET));
    shown.apply(Command::SetSlider(slider(START_OFFSET), 4.0));
    shown.apply(Command::SetSlider(slider("Start smoothing"), 3.0));
    let unveil = shown.controls.settings().unveil;
    assert_eq!((unveil.offset, unveil.smoothing), (4.0, 3.0));
    shown.apply(Command::Mode(Mode::Tomography));
    assert!(!has(&shown, AUTO_START) && !shown.scene.unveils());
    shown.apply(Command::Mode(Mode::Volume));
    assert!(shown.scene.unveils(), "planes in between leave it on");
    shown.apply(Command::SetSlider(slider(AUTO_START), 0.0));
    assert!(!shown.scene.unveils() && !has(&shown, START_OFFSET));
    shown.apply(Command::Undo);
    assert!(shown.scene.unveils());
}

/// What draws dark and bright cannot lose anything: the switch says so, and a mode that does is reached all the same.
#[test]
fn where_everything_is_drawn_rendering_cannot_start_at_the_fluid() {
    let all =
        "volume.transfer = [{ at = 0, colour = [1, 1, 1], opacity = 1 }, { at = 1, colour = [1, 1, 1], opacity = 1 }]";
    let mut shown = Shown::new(&format!("mode = 'sr'\n{all}"));
    shown.apply(Command::SetSlider(slider(AUTO_START), 1.0));
    assert!(shown.scene.unveils());
    shown.apply(Command::Mode(Mode::Volume));
    assert_eq!((shown.controls.settings().mode, shown.scene.unveils()), (Mode::Volume, false));
    let on = Command::SetSlider(slider(AUTO_START), 1.0);
    let refused = shown.controls.apply(&on, Some(&shown.scene));
    assert!(matches!(refused, Change::Refused(why) if why.contains("dark and what is bright")), "{refused:?}");
}

/// The line lies on the tile of its plane, where the picture is.
#[test]
fn the_line_of_the_start_is_drawn_on_its_plane() {
    let mut shown = Shown::new("mode = 'vr'\nlayout = 'four'");
    let tile = [[0.0, 0.0], [300.0, 200.0]];
    shown.start_lines = vec![StartLine { tile, pieces: vec![[[10.0, 50.0], [40.0, 60.0]]] }];
    shown.settle();
    let ([x, y], _) = panels::picture_area(shown.size, 1.0, true);
    let [x, y] = [x as f32, y as f32];
    let is_it = |kind: &Kind| {
        matches!(kind, Kind::Line { ends, colour, .. }
        if *ends == [[x + 10.0, y + 50.0], [x + 40.0, y + 60.0]] && *colour == START.to_array())
    };
    let line = shown.drawn.iter().find(|drawn| is_it(&drawn.kind)).expect("a line");
    assert_eq!(line.clip, [x, y, x + 300.0, y + 200.0]);
}
