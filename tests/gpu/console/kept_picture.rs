//! The picture that is shown while another one is drawn: what is said of it and what is measured on it is its own.

use super::*;
use echolume::low_level::measure::outcome;
use echolume::low_level::scene::{MeasureKind, Mode};
use echolume::low_level::ui::panels::accesskit::Role;

/// What a screen reader is told of the picture: the panels describe what their marks are drawn of. Without the delay, which other programs cause, too.
fn words(desk: &mut Desk) -> Option<String> {
    let tree = desk.console.take_tree()?;
    let node =
        tree.nodes.into_iter().find(|(_, node)| node.role() == Role::Image && node.label() != Some("Light ball"))?.1;
    let parts = node.label()?.split(", ").filter(|part| !part.ends_with(" behind"));
    Some(parts.collect::<Vec<_>>().join(", "))
}

/// The words of a layout from now on.
fn told(desk: &mut Desk) -> String {
    _ = desk.console.take_tree();
    let begun = Instant::now();
    loop {
        desk.console.redraw();
        desk.tick(Instant::now() + LATER);
        if let Some(words) = words(desk) {
            return words;
        }
        assert!(begun.elapsed() < BOUND, "no layout");
        wait::poll();
    }
}

/// A window with panels, which are told to a screen reader, and two volumes.
fn with_panels(device: &Device) -> Desk {
    let mut desk = Desk::new(device, ConsoleOptions { panels: true, ..options() });
    desk.console.resize([1000, 700]);
    desk.begin();
    (0..2).for_each(|number| _ = desk.live(number));
    desk.console.describe(true);
    desk
}

/// Ticks until a picture is being drawn.
fn until_drawing(desk: &mut Desk) {
    let begun = Instant::now();
    while !desk.console.stream().is_drawing() {
        assert!(begun.elapsed() < BOUND, "nothing is drawn");
        desk.tick(Instant::now() + LATER);
    }
}

/// Prevents letters, rulers and measurements of the next picture over the one that is still shown: the device holds each picture until it is let go.
#[test]
fn the_panels_are_about_the_picture_that_is_shown_until_the_next_one_is_there() {
    let device = Device::alone();
    let mut desk = with_panels(&device);
    let changes: [Command; 11] = [
        Command::Layout(Layout::Four),
        Command::Layout(Layout::Beside),
        Command::Mode(Mode::Mip),
        Command::Mode(Mode::Orthogonal),
        Command::Mode(Mode::Plane),
        Command::Mode(Mode::Tomography),
        Command::Layout(Layout::Pair),
        Command::Layout(Layout::Single),
        Command::Rotate([40.0, 10.0]),
        Command::Mode(Mode::Volume),
        Command::StepCine(-1),
    ];
    let mut others = 0;
    for command in changes {
        let before = told(&mut desk);
        device.faults.hold_pictures(true);
        desk.console.execute(&command, Instant::now());
        until_drawing(&mut desk);
        // A frozen picture is called so at once.
        let was = if command == Command::StepCine(-1) { before.replace("live", "frozen") } else { before.clone() };
        for _ in 0..3 {
            assert_eq!(told(&mut desk), was, "{command:?}");
        }
        device.faults.hold_pictures(false);
        desk.rest();
        others += usize::from(told(&mut desk) != before);
    }
    assert!(others >= 8, "only {others} changes are told");
}

/// Requirement: a change whose picture takes more than half a second says that it works, and no other does.
#[test]
fn a_picture_that_takes_long_is_said_to_be_drawn() {
    let device = Device::alone();
    let mut desk = with_panels(&device);
    let says = |desk: &mut Desk, at: Instant| {
        _ = desk.console.take_tree();
        let begun = Instant::now();
        loop {
            desk.tick(at);
            let tree = desk.console.take_tree();
            let nodes = tree.into_iter().flat_map(|tree| tree.nodes).map(|(_, node)| node);
            let mut pictures = nodes.filter(|node| node.role() == Role::Image && node.label() != Some("Light ball"));
            if let Some(picture) = pictures.next() {
                return picture.description().unwrap_or_default().starts_with("The next picture is being drawn");
            }
            assert!(begun.elapsed() < BOUND, "no layout");
            desk.console.redraw();
            wait::poll();
        }
    };
    for command in [Command::Preset(4), Command::Layout(Layout::Four)] {
        device.faults.hold_pictures(true);
        let now = Instant::now();
        desk.console.execute(&command, now);
        until_drawing(&mut desk);
        assert!(!says(&mut desk, now + Duration::from_millis(450)), "{command:?}: too early");
        assert!(says(&mut desk, now + Duration::from_millis(2000)), "{command:?}: it is not said");
        device.faults.hold_pictures(false);
        desk.rest();
        assert!(!says(&mut desk, now + Duration::from_secs(60)), "{command:?}: it is done");
    }
}

/// Requirement: a measurement says on which volume it was made, and lies on no other as if it were that one's.
#[test]
fn a_measurement_belongs_to_the_volume_on_which_it_was_made() {
    let device = Device::new();
    let mut desk = Desk::new(&device, options());
    desk.begin();
    (0..3).for_each(|number| _ = desk.live(number));
    let now = Instant::now;
    desk.console.execute(&Command::Mode(Mode::Plane), now());
    desk.console.execute(&Command::StepCine(-1), now());
    desk.rest();
    desk.console.execute(&Command::Tool(Tool::Measure(MeasureKind::Distance)), now());
    let at = |desk: &mut Desk, x: f64| {
        let scene = desk.console.stream().scene().expect("begun");
        let tiling = scene.tiling();
        scene.point_of(tiling.point(&tiling.tiles[0], [x, 36.0]))
    };
    let ends = [30.0, 50.0].map(|x| at(&mut desk, x));
    desk.console.execute(&Command::Point(ends[0], false), now());
    // The other end on another volume: it stays that on which it was begun.
    desk.console.execute(&Command::StepCine(1), now());
    desk.rest();
    desk.console.execute(&Command::Point(ends[1], false), now());
    let measured = desk.console.controls().measures()[0].clone();
    let made = measured.made.clone().expect("on something");
    assert_eq!((made.volume, made.plane.starts_with("A at "), made.settings.starts_with("Plane ")), (1, true, true));
    assert!(measured.other_volume(Some(2)) == Some(1) && measured.other_volume(Some(1)).is_none());
    let table = outcome::csv(desk.console.controls().measures(), "sweep.mha");
    assert!(table.lines().nth(1).is_some_and(|line| line.contains(",mm,\"sweep.mha\",1,")), "{table}");
    // Its ends cannot be grabbed there: a drag sets a new one, which is of the volume that is shown.
    desk.drag([50.0, 36.0], [60.0, 50.0]);
    let all = desk.console.controls().measures();
    assert_eq!((all.len(), &all[0]), (2, &measured));
    assert_eq!(all[1].made.as_ref().map(|made| made.volume), Some(2));
}
