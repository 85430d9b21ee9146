//! The controls in front: where they are, and what the pointer does on them.

use super::shown::Shown;
use super::*;
use crate::panels::accesskit::{Node, Role};
use crate::panels::drawn::Kind;
use crate::panels::picture_area;
use crate::scene::MeasureKind;

const FRONT: [&str; 6] = ["Threshold", "Gain", "Smooth", "Brightness", "Lamp", "Depth"];

/// Left, top, right, bottom of a control, points.
fn place(shown: &Shown, role: Role, name: &str) -> [f64; 4] {
    let is_it = |node: &&Node| node.role() == role && node.label() == Some(name);
    let bounds = shown.tree.values().find(is_it).and_then(Node::bounds).unwrap_or_else(|| panic!("no {role:?} {name}"));
    [bounds.x0, bounds.y0, bounds.x1, bounds.y1]
}

/// One layout for each input: what the pointer is over is known from the layout before.
fn input(shown: &mut Shown, inputs: &[Input]) -> Vec<Command> {
    let mut commands = Vec::new();
    for input in inputs {
        shown.panels.input(input);
        commands.extend(shown.lay_out());
    }
    commands
}

fn button(pressed: bool) -> Input {
    Input::Button { button: Button::Left, pressed }
}

/// Prevents controls that are below the fold while a tool has much to say: with the tool for the region and a bent start line, with measurements, with a clip plane and
/// cuts.
#[test]
fn the_controls_in_front_stay_in_sight_with_every_tool() {
    for size in [[1280, 800], [1600, 900], [1920, 1080]] {
        let is_in_sight = |shown: &Shown, role: Role, name: &str| {
            let ([_, top], [_, height]) = picture_area(size, 1.0, true);
            let [_, y0, _, y1] = place(shown, role, name);
            y0 >= f64::from(top) && y1 <= f64::from(top + height)
        };
        let check = |shown: &Shown, what: &str| {
            for name in FRONT {
                assert!(is_in_sight(shown, Role::Slider, name), "{size:?}, {what}: {name} is out of sight");
            }
        };
        let mut shown = Shown::sized("mode='surface'", size, 1.0);
        check(&shown, "at first");
        shown.apply(Command::Tool(Tool::Region));
        shown.apply(Command::ToggleStartCurve);
        assert!(is_in_sight(&shown, Role::Slider, "Handle 3"), "its handles come first");
        let mut shown = Shown::sized("mode='surface'\nlayout='four'", size, 1.0);
        shown.apply(Command::Tool(Tool::Measure(MeasureKind::Distance)));
        for n in 0..6 {
            shown.apply(Command::Point([0.0, 30.0 + f64::from(n * n), 0.0], false));
        }
        for name in ["1 Caliper 1.0 mm", "3 Caliper 9.0 mm", "Copy", "Clear"] {
            assert!(is_in_sight(&shown, Role::Button, name), "{name} is out of sight");
        }
        let mut shown = Shown::sized("mode='surface'\nlayout='four'", size, 1.0);
        shown.apply(Command::MoveClip(5.0));
        shown.apply(Command::Tool(Tool::Cut));
        assert!(is_in_sight(&shown, Role::Switch, "Keep inside"), "the options of the tool come first");
    }
}

/// Requirement: a value is typed in the unit that is shown: echoes of bytes from 0 to 255, lengths in mm.
#[test]
fn a_value_is_typed_in_the_unit_that_it_is_shown_in() {
    let mut shown = Shown::new("mode='surface'");
    let said = |shown: &Shown, name: &str| {
        shown.tree[&shown.find("Controls", Role::Slider, name)].value().unwrap_or_default().to_string()
    };
    let type_value = |shown: &mut Shown, name: &str, text: &str| {
        let value = shown.find("Controls", Role::Button, &format!("Value of {name}"));
        let asked = shown.ask(value, crate::panels::accesskit::Action::Click, None);
        let [Command::TypeValue(number)] = asked[..] else { panic!("{asked:?}") };
        shown.inspector_does(&Command::TypeValue(number));
        for letter in text.chars() {
            let key = crate::input::Key::Char(letter);
            assert_eq!(shown.visible.key(key, Modifiers::default()), Some(Vec::new()));
        }
        shown.settle();
        let typed = format!("{}_", text.replace(',', "."));
        let is_shown = |drawn: &crate::panels::drawn::Drawn| match &drawn.kind {
            Kind::Text { text, .. } => *text == typed,
            _ => false,
        };
        assert!(shown.drawn.iter().any(is_shown), "{name}: what is typed is not shown");
        let commands = shown.visible.key(crate::input::Key::Enter, Modifiers::default()).expect("its key");
        commands.into_iter().for_each(|command| _ = shown.apply(command));
    };
    type_value(&mut shown, "Threshold", "51");
    assert!((shown.scene.settings.surface.threshold - 0.2).abs() < 1e-9, "{:?}", shown.scene.settings.surface);
    assert_eq!(said(&shown, "Threshold"), "51 /255");
    type_value(&mut shown, "Depth", "20");
    assert_eq!(said(&shown, "Depth"), "20 mm");
    type_value(&mut shown, "Gain", "0,1");
    assert!((SLIDERS[GAIN].get(shown.controls.settings()) - 0.1).abs() < 1e-9);
    let before = shown.controls.settings().clone();
    type_value(&mut shown, "Threshold", "9999");
    assert!(shown.scene.settings.surface.threshold <= 1.0, "beyond its range");
    shown.apply(Command::Undo);
    assert_eq!(*shown.controls.settings(), before, "one step for undo");
}

#[test]
fn a_double_click_on_a_control_in_front_restores_its_start() {
    let mut shown = Shown::new("mode='surface'");
    let start = SLIDERS[GAIN].get(shown.controls.settings());
    let [left, top, right, bottom] = place(&shown, Role::Slider, "Gain");
    let at = [left + 0.8 * (right - left), (top + bottom) / 2.0];
    let first = input(&mut shown, &[Input::Moved(at), button(true), button(false)]);
    assert!(matches!(first[..], [Command::SetSlider(GAIN, _)]), "a click sets it: {first:?}");
    assert_ne!(SLIDERS[GAIN].get(shown.controls.settings()), start);
    let second = input(&mut shown, &[button(true), button(false)]);
    assert_eq!(second, [Command::ResetSlider(GAIN)]);
    assert_eq!(SLIDERS[GAIN].get(shown.controls.settings()), start);
}

#[test]
fn a_drag_on_the_light_ball_moves_the_lamp() {
    let mut shown = Shown::new("mode='surface'");
    // Its edge; nothing else in the column is as large a circle.
    let balls = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
        Kind::Circle { centre, radius: 32.0, .. } => Some(centre.map(f64::from)),
        _ => None,
    });
    let balls: Vec<[f64; 2]> = balls.collect();
    let [[x, y]] = balls[..] else { panic!("{balls:?}") };
    let light = |shown: &Shown| {
        let light = &shown.controls.settings().light;
        light.position.unwrap_or(light.direction).normalize()
    };
    let before = light(&shown);
    let of_ball =
        |shown: &Shown| shown.tree[&shown.find("Controls", Role::Image, "Light ball")].value().map(str::to_string);
    let told = of_ball(&shown);
    input(&mut shown, &[Input::Moved([x, y]), button(true)]);
    assert_eq!(light(&shown), before);
    let mut moved = Vec::new();
    for n in 1..=4 {
        moved.extend(input(&mut shown, &[Input::Moved([x + 4.0 * f64::from(n), y - 3.0 * f64::from(n)])]));
    }
    input(&mut shown, &[button(false)]);
    assert!(!moved.is_empty() && moved.iter().all(|command| matches!(command, Command::MoveLight(_))), "{moved:?}");
    // The lamp stays under the pointer: 16 and 12 points of a ball with a radius of 32.
    let by = light(&shown) - before;
    assert!((by.x - 0.5).abs() < 0.1 && (by.y - 0.375).abs() < 0.1, "{by}");
    // A screen reader says where the lamp is.
    assert!(told.as_ref().is_some_and(|told| told.contains("° above")) && told != of_ball(&shown), "{told:?}");
    let rests = input(&mut shown, &[Input::Moved([x - 20.0, y])]);
    assert_eq!(rests, [], "the button is up");
}
