//! The render start that follows the fluid, in the viewer: the console says when the fluid is lost.

use super::*;

/// A wall, fluid and tissue, or one grey.
fn layers(number: u32, has_fluid: bool) -> Vec<Frame> {
    crate::live::volume(number, move |_, i| match i % 64 {
        _ if !has_fluid => 150,
        sample if sample < 22 => 150,
        sample if sample < 42 => 15,
        _ => 200,
    })
}

fn show(desk: &mut Desk, frames: Vec<Frame>) {
    let before = desk.console.stream().volumes_shown();
    desk.frames(frames);
    let begun = Instant::now();
    while desk.console.stream().volumes_shown() == before {
        assert!(begun.elapsed() < BOUND, "it is not shown");
        desk.tick(Instant::now() + LATER);
    }
    desk.rest();
}

/// Said when the fluid is lost, and not before.
#[test]
fn the_console_says_when_the_fluid_is_lost() {
    let device = Device::new();
    let settings = settings("mode = 'vr'\nslices = { pixels = 40, format = 'r8' }\nunveil.enabled = true");
    let mut desk = Desk::new(&device, ConsoleOptions { settings, panels: true, ..options() });
    desk.console.resize([1000, 700]);
    desk.console.describe(true);
    desk.begin();
    let said = |desk: &mut Desk| {
        desk.console.redraw();
        desk.rest();
        let tree = desk.console.take_tree().expect("a tree");
        let texts = tree
            .nodes
            .into_iter()
            .flat_map(|(_, node)| [node.label(), node.value()].map(|text| text.map(str::to_string)));
        texts
            .flatten()
            .any(|text| text.starts_with("Auto render start: ") && text.ends_with("so the start line stays."))
    };
    let outcome = |desk: &mut Desk| {
        desk.console.stream().renderer().and_then(|renderer| renderer.unveiled().map(|found| found.outcome))
    };
    show(&mut desk, layers(0, true));
    assert!(outcome(&mut desk).is_some_and(|outcome| outcome.is_found()), "{:?}", outcome(&mut desk));
    assert!(!said(&mut desk));
    show(&mut desk, layers(1, false));
    assert!(outcome(&mut desk).is_some_and(|outcome| !outcome.is_found()));
    assert!(said(&mut desk));
}
