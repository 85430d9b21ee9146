//! The keyboard on the panels, and what a screen reader asks of them, through the console.

use super::*;
use crate::common::wait;
use echolume::low_level::scene::{MeasureKind, Measurement};
use echolume::low_level::ui::panels::accesskit::{Action, ActionRequest, NodeId, Role, TreeId, TreeUpdate};

const TEXT: Tool = Tool::Measure(MeasureKind::Text);

fn desk(device: &Arc<Context>) -> Desk {
    let mut desk = Desk::new(device, ConsoleOptions { panels: true, ..options() });
    desk.console.resize([1000, 700]);
    desk.begin();
    (0..3).for_each(|number| _ = desk.live(number));
    desk.console.describe(true);
    desk
}

/// The tree after the last layout.
fn tree(desk: &mut Desk) -> TreeUpdate {
    desk.console.redraw();
    desk.rest();
    desk.console.take_tree().expect("a tree")
}

/// The name of the control that has the keyboard.
fn focused(desk: &mut Desk) -> Option<String> {
    let TreeUpdate { nodes, focus, .. } = tree(desk);
    let node = nodes.into_iter().find(|(id, _)| *id == focus).map(|(_, node)| node).expect("it is in the tree");
    node.label().map(str::to_string)
}

/// Prevents keys that never reach the panels, keys that are lost because several come between two pictures, and a Tab that is no longer the view's.
#[test]
fn control_tab_gives_the_keyboard_to_the_panels_and_back() {
    let device = Device::new();
    let mut desk = desk(&device);
    assert_eq!(focused(&mut desk), None);
    desk.held(CONTROL, Key::Tab);
    assert_eq!(focused(&mut desk).as_deref(), Some("Open"));
    desk.press(Key::Tab);
    assert_eq!(focused(&mut desk).as_deref(), Some("Save workspace"));
    // To the bar at the bottom, past the bar at the top.
    for _ in 0..40 {
        if focused(&mut desk).as_deref() == Some("Previous volume") {
            break;
        }
        desk.press(Key::Tab);
    }
    assert_eq!(focused(&mut desk).as_deref(), Some("Previous volume"));
    assert_eq!(desk.console.controls().settings().layout, Layout::Single);
    let newest = desk.console.stream().cine_position();
    desk.press(Key::Space);
    desk.rest();
    assert!(desk.console.stream().is_frozen() && desk.console.stream().cine_position() != newest);
    // A letter is the view's, whoever has the keyboard.
    desk.press(Key::Char('2'));
    desk.rest();
    assert_eq!(desk.console.controls().settings().mode, echolume::low_level::scene::Mode::Volume);
    desk.press(Key::Escape);
    assert_eq!(focused(&mut desk), None, "Escape leaves the panels, not the program");
    desk.press(Key::Tab);
    desk.rest();
    assert_eq!(desk.console.controls().settings().layout, Layout::Four);
    desk.held(SHIFT, Key::Tab);
    desk.rest();
    assert_eq!(desk.console.controls().settings().layout, Layout::Single);
    desk.held(CONTROL, Key::Tab);
    desk.held(CONTROL, Key::Tab);
    assert_eq!(focused(&mut desk), None, "there and back");
}

#[test]
fn what_a_screen_reader_asks_is_done() {
    let device = Device::new();
    let mut desk = desk(&device);
    let found: Vec<NodeId> = tree(&mut desk)
        .nodes
        .into_iter()
        .filter(|(_, node)| node.role() == Role::Button && node.label() == Some("Freeze"))
        .map(|(id, _)| id)
        .collect();
    assert_eq!(found.len(), 1);
    desk.console.act(ActionRequest {
        action: Action::Click,
        target_tree: TreeId::ROOT,
        target_node: found[0],
        data: None,
    });
    desk.rest();
    assert!(desk.console.stream().is_frozen());
    desk.console.describe(false);
    desk.console.redraw();
    desk.rest();
    assert!(desk.console.take_tree().is_none(), "nothing is made while nobody listens");
}

const SHIFT: Modifiers = Modifiers { shift: true, control: false, alt: false };

fn press(desk: &mut Desk, key: Key, times: usize) {
    (0..times).for_each(|_| desk.press(key));
}

/// Requirement: whoever has no mouse sets points and drags by keys, and the keys mean what they did before as soon as the pointer is left.
#[test]
fn the_pointer_by_keyboard_does_what_the_mouse_does() {
    let device = Device::new();
    let [mut mouse, mut keys] = [(); 2].map(|()| {
        let mut desk = Desk::new(&device, options());
        desk.begin();
        desk.live(0);
        desk
    });
    // The light, with its tool: from the middle, a pixel a step in a picture this small.
    for desk in [&mut mouse, &mut keys] {
        desk.press(Key::Char('l'));
    }
    mouse.drag([40.0, 36.0], [60.0, 36.0]);
    keys.held(SHIFT, Key::Char('m'));
    keys.press(Key::Space);
    press(&mut keys, Key::Right, 12);
    // A drag that pauses is one step for undo.
    wait::pace(Duration::from_millis(600));
    press(&mut keys, Key::Right, 8);
    keys.press(Key::Space);
    let light = |desk: &Desk| desk.console.controls().settings().light.direction;
    assert!((light(&keys) - light(&mouse)).length() < 1e-9, "{} {}", light(&keys), light(&mouse));
    assert!((light(&keys) - plain().light.direction).length() > 0.1);
    assert!(!keys.console.stream().is_frozen(), "Space is the pointer's");
    keys.held(CONTROL, Key::Char('z'));
    assert_eq!(light(&keys), plain().light.direction);
    // A caliper: Enter clicks.
    for desk in [&mut mouse, &mut keys] {
        desk.press(Key::Char('7'));
        desk.rest();
        desk.press(Key::Char('m'));
    }
    let click = |desk: &mut Desk, at: [f64; 2]| {
        desk.console.input(&Input::Moved(at));
        for pressed in [true, false] {
            desk.console.input(&Input::Button { button: Button::Left, pressed });
        }
    };
    click(&mut mouse, [30.0, 30.0]);
    click(&mut mouse, [50.0, 44.0]);
    press(&mut keys, Key::Left, 30);
    press(&mut keys, Key::Up, 6);
    keys.press(Key::Enter);
    press(&mut keys, Key::Right, 20);
    press(&mut keys, Key::Down, 14);
    keys.press(Key::Enter);
    // The light of one was taken back: their settings differ.
    let measured = |desk: &Desk| {
        let all = desk.console.controls().settings().drawn.measure.iter();
        all.map(|measured| Measurement { made: None, ..measured.clone() }).collect::<Vec<_>>()
    };
    assert_eq!((measured(&keys).len(), measured(&keys)), (1, measured(&mouse)));
    // An outline of three clicks ends by Ctrl+Enter.
    keys.press(Key::Char('o'));
    for way in [Key::Left, Key::Up, Key::Right] {
        press(&mut keys, way, 12);
        keys.press(Key::Enter);
    }
    assert!(keys.console.controls().work().is_some());
    keys.held(CONTROL, Key::Enter);
    assert_eq!(measured(&keys).last().map(|measured| measured.points.len()), Some(3));
    // A text: while it is typed, the keys are letters.
    keys.press(Key::Char('i'));
    // Not there again, which would be a double click.
    press(&mut keys, Key::Down, 14);
    keys.press(Key::Enter);
    for key in [Key::Char('a'), Key::Space, Key::Char('b'), Key::Enter] {
        keys.press(key);
    }
    assert_eq!(measured(&keys).last().map(|measured| measured.text.clone()).as_deref(), Some("a b"));
    // Escape gives the drag up, then leaves the pointer, then the tool; and never the program.
    keys.console.execute(&Command::Tool(Tool::Rotate), Instant::now());
    keys.press(Key::Char('1'));
    keys.rest();
    keys.press(Key::Space);
    press(&mut keys, Key::Right, 8);
    keys.press(Key::Escape);
    let camera = keys.console.controls().settings().camera.clone();
    press(&mut keys, Key::Right, 8);
    assert_eq!(keys.console.controls().settings().camera, camera, "the drag was given up");
    keys.press(Key::Escape);
    assert!(!keys.rest().exit);
    keys.press(Key::Space);
    keys.rest();
    assert!(keys.console.stream().is_frozen(), "the keys are those of the view again");
}

/// Prevents entries of a list that no key but Tab reaches, and keys of it that are lost because several come between two pictures.
#[test]
fn arrows_walk_through_a_list_and_escape_closes_it() {
    let device = Device::new();
    let mut desk = desk(&device);
    let before = desk.console.controls().settings().clone();
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Down);
    desk.press(Key::Right);
    assert_eq!(focused(&mut desk).as_deref(), Some("Skeleton"));
    desk.press(Key::Escape);
    assert_eq!(focused(&mut desk), None, "one Escape closes the list");
    desk.held(CONTROL, Key::Char('p'));
    for key in [Key::End, Key::Left, Key::Enter] {
        desk.press(key);
    }
    desk.rest();
    let taken = desk.console.controls().settings().clone();
    assert_ne!(taken, before);
    desk.held(CONTROL, Key::Char('z'));
    desk.held(CONTROL, Key::Char('p'));
    desk.press(Key::Char('5'));
    desk.rest();
    assert_eq!(desk.console.controls().settings(), &taken, "the fifth of six");
    // Without a list the arrows are the view's.
    desk.press(Key::Left);
    desk.rest();
    assert!(desk.console.stream().is_frozen());
}

/// Prevents "cord" as four commands: a letter that was meant for a text chose another tool, wrote files, and Backspace reset everything.
#[test]
fn with_the_tool_for_texts_letters_are_a_text_wherever_the_pointer_is() {
    let (device, folder) = (Device::new(), Folder::new("letters"));
    let mut desk = Desk::new(&device, ConsoleOptions { folder: folder.0.clone(), ..options() });
    desk.begin();
    desk.live(0);
    let texts = |desk: &Desk| -> Vec<String> {
        desk.console.controls().measures().iter().map(|measured| measured.text.clone()).collect()
    };
    desk.press(Key::Char('7'));
    desk.press(Key::Char(']'));
    desk.rest();
    desk.press(Key::Char('i'));
    let before = desk.console.controls().settings().clone().without_drawings();
    desk.press(Key::Backspace);
    assert_eq!(desk.console.controls().settings().clone().without_drawings(), before, "nothing is reset");
    // Outside of the picture first, then over it.
    desk.console.input(&Input::Moved([-40.0, 9.0]));
    "cord".chars().for_each(|letter| desk.press(Key::Char(letter)));
    (0..6).for_each(|_| desk.press(Key::Backspace));
    assert_eq!((texts(&desk), desk.console.controls().typing()), (vec![String::new()], Some(0)));
    "cord".chars().for_each(|letter| desk.press(Key::Char(letter)));
    desk.press(Key::Enter);
    desk.press(Key::Backspace);
    desk.console.input(&Input::Moved([50.0, 30.0]));
    desk.held(Modifiers { shift: true, ..Modifiers::default() }, Key::Char('p'));
    "r".chars().for_each(|letter| desk.press(Key::Char(letter)));
    desk.press(Key::Enter);
    assert_eq!(texts(&desk), ["cord", "Pr"]);
    let after = desk.console.controls().settings().clone();
    assert_eq!((desk.console.controls().tool(), after.clone().without_drawings()), (TEXT, before));
    let scene = desk.console.stream().scene().expect("begun");
    let (tiling, at) = (scene.tiling(), |n: usize| scene.place_of(after.drawn.measure[n].points[0]));
    let [middle, pointed] = [0, 1].map(|n| tiling.project(&tiling.tiles[0], at(n)).0);
    for (found, [x, y]) in [(middle, SIZE.map(|n| f64::from(n) / 2.0)), (pointed, [50.0, 30.0])] {
        assert!((found[0] - x).hypot(found[1] - y) < 0.1, "{found:?}, not {x}, {y}");
    }
    assert!(std::fs::read_dir(&folder.0).expect("its folder").next().is_none(), "a file was written");
    // Ctrl is a command still, and Esc leaves the tool.
    desk.held(CONTROL, Key::Char('z'));
    assert_ne!(texts(&desk), ["cord", "Pr"]);
    desk.press(Key::Escape);
    desk.press(Key::Char('o'));
    assert_eq!(desk.console.controls().tool(), Tool::Measure(MeasureKind::Trace));
}
