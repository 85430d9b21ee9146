//! The keyboard on the panels, and what a screen reader asks of them, through the console.

use super::*;
use echolume::ui::panels::accesskit::{Action, ActionRequest, NodeId, Role, TreeId, TreeUpdate};

const CONTROL: Modifiers = Modifiers { shift: false, control: true, alt: false };

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
    assert_eq!(focused(&mut desk).as_deref(), Some("Freeze"));
    desk.press(Key::Tab);
    desk.press(Key::Tab);
    assert_eq!(focused(&mut desk).as_deref(), Some("One volume back"));
    assert_eq!(desk.console.controls().settings().layout, Layout::Single);
    let newest = desk.console.stream().cine_position();
    desk.press(Key::Space);
    desk.rest();
    assert!(desk.console.stream().is_frozen() && desk.console.stream().cine_position() != newest);
    // A letter is the view's, whoever has the keyboard.
    desk.press(Key::Char('2'));
    desk.rest();
    assert_eq!(desk.console.controls().settings().mode, echolume::scene::Mode::Volume);
    desk.press(Key::Escape);
    assert_eq!(focused(&mut desk), None, "Escape leaves the panels, not the program");
    desk.press(Key::Tab);
    desk.rest();
    assert_eq!(desk.console.controls().settings().layout, Layout::Four);
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
