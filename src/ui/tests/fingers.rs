//! Known answers of what fingers do.

use super::*;
use crate::scene::Layout;
use crate::ui::input::Phase;
use crate::ui::picking::Picker;
use glam::DVec3;

/// A finger at a place of the picture.
fn touch(desk: &mut Desk, finger: u64, phase: Phase, at: [f64; 2]) -> Vec<Command> {
    desk.input(Input::Touch { finger, phase, at: desk.at(at) })
}

/// The place in the plane of the target that is seen there.
fn under(desk: &Desk, at: [f64; 2]) -> DVec3 {
    let scene = desk.scene();
    let (origin, direction) = Picker::of(&scene).ray(at);
    origin + direction * ((scene.rays.target - origin).dot(scene.rays.forward) / direction.dot(scene.rays.forward))
}

fn shown(desk: &Desk, place: DVec3) -> [f64; 2] {
    Picker::of(&desk.scene()).seen(place).unwrap()
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn what_is_under_two_fingers_stays_under_them() {
    for toml in
        ["", "camera.azimuth=40\ncamera.elevation=-30\ncamera.roll=20\nray.half=true", "layout='four'", "ray.rays=2"]
    {
        let mut desk = Desk::new(toml);
        let [x, y] = Picker::of(&desk.scene()).middle();
        let from = [[x + 10.0, y - 40.0], [x + 60.0, y + 30.0]];
        let to = [[x - 25.0, y - 50.0], [x + 70.0, y + 62.0]];
        let held = from.map(|at| under(&desk, at));
        (0..2).for_each(|n| drop(touch(&mut desk, n as u64, Phase::Down, from[n])));
        for step in 1..=30 {
            let share = f64::from(step) / 30.0;
            for n in 0..2 {
                let at = [0, 1].map(|a| from[n][a] + (to[n][a] - from[n][a]) * share);
                touch(&mut desk, n as u64, Phase::Moved, at);
            }
        }
        for n in 0..2 {
            assert!(apart(shown(&desk, held[n]), to[n]) < 1e-6, "{toml} {n}: {:?} {:?}", shown(&desk, held[n]), to[n]);
        }
    }
}

#[test]
fn a_finger_that_comes_or_goes_moves_nothing() {
    let mut desk = Desk::new("");
    for (finger, phase, at) in [
        (1, Phase::Down, [200.0, 200.0]),
        (2, Phase::Down, [300.0, 210.0]),
        (3, Phase::Down, [250.0, 400.0]),
        (3, Phase::Moved, [20.0, 30.0]),
        (1, Phase::Up, [200.0, 200.0]),
        (4, Phase::Down, [90.0, 80.0]),
        (2, Phase::Gone, [500.0, 500.0]),
        (4, Phase::Up, [90.0, 80.0]),
        (3, Phase::Moved, [22.0, 33.0]),
        (3, Phase::Up, [22.0, 33.0]),
    ] {
        assert_eq!(touch(&mut desk, finger, phase, at), [], "finger {finger} {phase:?}");
    }
    assert!(!desk.hand.is_busy());
}

#[test]
fn two_fingers_that_go_one_after_the_other_are_no_tap() {
    let mut desk = Desk::new("layout='four'");
    desk.tool(Tool::Plane);
    for _ in 0..2 {
        for (finger, phase) in [(1, Phase::Down), (2, Phase::Down), (1, Phase::Up), (2, Phase::Up)] {
            assert_eq!(touch(&mut desk, finger, phase, [60.0 + 40.0 * finger as f64, 90.0]), []);
        }
    }
}

#[test]
fn one_finger_turns_taps_and_a_double_tap_leads_to_a_tile() {
    let mut desk = Desk::new("");
    touch(&mut desk, 7, Phase::Down, [200.0, 200.0]);
    assert_eq!(touch(&mut desk, 7, Phase::Moved, [204.0, 200.0]), [], "a glove rolls a little");
    assert!(matches!(touch(&mut desk, 7, Phase::Moved, [260.0, 200.0])[..], [Command::Turn([by, _])] if by > 0.0));
    touch(&mut desk, 7, Phase::Up, [260.0, 200.0]);
    let mut desk = Desk::new("layout='four'");
    for _ in 0..2 {
        touch(&mut desk, 8, Phase::Down, [100.0, 100.0]);
        touch(&mut desk, 8, Phase::Up, [103.0, 100.0]);
    }
    assert_eq!(desk.controls.settings().layout, Layout::Single);
}
