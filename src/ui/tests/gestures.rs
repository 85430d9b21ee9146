//! Known answers for gestures of a mouse and of fingers.

use super::*;
use crate::ui::gestures::TURN;
use crate::ui::input::Phase;
use crate::ui::picking::Picker;
use crate::ui::view::{face_axis, nearest_face};

fn near(a: f64, b: f64, off: f64) {
    assert!((a - b).abs() <= off, "{a} is not {b}");
}

#[test]
fn a_drag_to_the_right_turns_by_what_is_documented_and_the_front_follows() {
    for (turned, four) in [("0.0", false), ("35.0", false), ("-60.0", true)] {
        for roll in [0.0, 50.0, 170.0] {
            let layout = if four { "four" } else { "single" };
            let mut desk = Desk::new(&format!(
                "camera.azimuth={turned}\ncamera.elevation=20\ncamera.roll={roll}\nlayout='{layout}'"
            ));
            let before = desk.scene();
            let eye = Picker::of(&before);
            let (middle, height) = (eye.middle(), eye.size()[1]);
            let front = before.rays.target - before.rays.forward * 20.0;
            let from = seen(&desk, front);
            // The first 3 pixels of the picture are those of a click.
            desk.drag(Button::Left, middle, [middle[0] + 3.0 + height / 20.0, middle[1]]);
            let to = seen(&desk, front);
            assert!(to[0] - from[0] > 3.0 && (to[1] - from[1]).abs() < (to[0] - from[0]) / 2.0, "{from:?} {to:?}");
            if roll == 0.0 {
                let azimuth = before.settings.camera.azimuth + TURN / 20.0;
                near(desk.controls.settings().camera.azimuth, azimuth, 1e-9);
                near(desk.controls.settings().camera.elevation, 20.0, 1e-9);
            }
            desk.controls.reset();
            desk.drag(Button::Left, middle, [middle[0], middle[1] + 3.0 + height / 20.0]);
            let to = seen(&desk, front);
            assert!(to[1] > from[1] + 3.0, "down: {from:?} {to:?}");
        }
    }
}

#[test]
fn elevation_ends_above_and_below_and_a_view_on_its_head_does_not_jump() {
    let mut desk = Desk::new("camera.elevation=130\ncamera.azimuth=20\ncamera.roll=10");
    let before = desk.scene().rays;
    desk.controls.apply(&Command::Turn([1e-9, 0.0]), Some(&desk.scene()));
    let after = desk.scene().rays;
    assert!((before.up - after.up).length() < 1e-6 && (before.forward - after.forward).length() < 1e-6);
    near(desk.controls.settings().camera.elevation, 50.0, 1e-6);
    desk.drag(Button::Left, [256.0, 400.0], [256.0, 3000.0]);
    assert_eq!(desk.controls.settings().camera.elevation.abs(), 90.0);
}

#[test]
fn planes_are_turned_as_if_the_volume_were_under_the_hand() {
    for (x, y) in [(60.0, 0.0), (0.0, 60.0)] {
        let mut desk = Desk::new("mode='plane'");
        let plane = desk.scene().plane(PlaneName::A);
        desk.drag(Button::Left, [200.0, 200.0], [200.0 + x, 200.0 + y]);
        let turned = desk.scene().plane(PlaneName::A);
        // On the viewer's side of the plane.
        let front = -plane.normal;
        assert!(front.dot(turned.right) * x + front.dot(turned.down) * y > 1.0, "{turned:?}");
    }
}

#[test]
fn dragged_up_the_clip_plane_and_the_plane_go_deeper_as_far_as_the_hand_goes() {
    let mut desk = Desk::new("");
    desk.tool(Tool::Clip);
    let near = desk.scene().low.y - 40.0;
    desk.drag(Button::Left, [200.0, 300.0], [200.0, 197.0]);
    near_mm(desk.controls.settings().clip[0].at[1] - near, Picker::of(&desk.scene()).pixel());
    let mut desk = Desk::new("mode='plane'\nplanes.plane='c'");
    desk.tool(Tool::Plane);
    let before = desk.scene().plane(PlaneName::C).at.y;
    desk.drag(Button::Left, [200.0, 300.0], [200.0, 197.0]);
    near_mm(desk.scene().plane(PlaneName::C).at.y - before, desk.scene().sheet().pixel);
}

/// 103 pixels, 3 of which are those of a click.
fn near_mm(gone: f64, pixel: f64) {
    near(gone, 100.0 * pixel, 1e-6);
}

#[test]
fn what_is_panned_stays_under_the_pointer() {
    for camera in
        ["camera.azimuth=30\ncamera.elevation=-25\ncamera.roll=40", "camera.field_of_view=40", "layout='four'"]
    {
        for (button, shift) in [(Button::Right, false), (Button::Middle, false), (Button::Left, true)] {
            let mut desk = Desk::new(camera);
            desk.held.shift = shift;
            let (eye_middle, target) = (Picker::of(&desk.scene()).middle(), desk.scene().rays.target);
            let place = target + desk.scene().rays.right * 7.0;
            let from = seen(&desk, place);
            desk.drag(button, eye_middle, [eye_middle[0] - 31.0, eye_middle[1] + 17.0]);
            let to = seen(&desk, place);
            near(to[0] - from[0], -31.0, 1e-6);
            near(to[1] - from[1], 17.0, 1e-6);
        }
    }
}

#[test]
fn a_face_of_the_region_follows_the_pointer_and_the_picture_stands_still() {
    for field_of_view in [0.0, 35.0] {
        for (azimuth, elevation) in [(0.0, 0.0), (40.0, 25.0), (-120.0, 60.0)] {
            let toml = format!(
                "camera.zoom=0.7\ncamera.azimuth={azimuth}\ncamera.elevation={elevation}\ncamera.field_of_view={field_of_view}\n\
                 region.lateral=[-25, 25]\nregion.depth=[20, 70]\nregion.elevation=[-20, 20]"
            );
            for high in [false, true] {
                for a in 0..3 {
                    let face = Face { axis: a, high };
                    let mut desk = Desk::new(&toml);
                    desk.tool(Tool::Region);
                    let (middle, out) = face_axis(&desk.scene(), face);
                    let grab = seen(&desk, middle);
                    if nearest_face(&desk.scene(), grab) != Some(face) {
                        continue; // seen along its axis
                    }
                    let still = desk.scene().rays.target + DVec3::new(3.0, -2.0, 5.0);
                    let stood = seen(&desk, still);
                    let to = seen(&desk, middle + out * 4.0);
                    desk.drag(Button::Left, grab, to);
                    let moved = desk.scene();
                    let now = seen(&desk, face_axis(&moved, face).0);
                    // The pixels of a click are not dragged.
                    let off = (now[0] - to[0]).hypot(now[1] - to[1]);
                    assert!(
                        (off - 3.0).abs() < 1.0,
                        "{toml} {face:?}: {off} {:?} {:?}",
                        face_axis(&moved, face).0,
                        middle
                    );
                    let [x, y] = seen(&desk, still);
                    near((x - stood[0]).hypot(y - stood[1]), 0.0, 1e-3);
                    // Beyond the room that there is, it waits for the pointer to come back.
                    let mut desk = Desk::new(&toml);
                    desk.tool(Tool::Region);
                    let far = seen(&desk, middle - out * 70.0);
                    desk.input(Input::Moved(desk.at(grab)));
                    desk.input(Input::Button { button: Button::Left, pressed: true });
                    desk.input(Input::Moved(desk.at(far)));
                    let scene = desk.scene();
                    near((scene.high - scene.low)[a], 2.0, 1e-6);
                    let back = [grab[0] + (to[0] - grab[0]) * 0.5, grab[1] + (to[1] - grab[1]) * 0.5];
                    desk.input(Input::Moved(desk.at(back)));
                    let now = seen(&desk, face_axis(&desk.scene(), face).0);
                    near((now[0] - back[0]).hypot(now[1] - back[1]), 3.0, 1.0);
                }
            }
        }
    }
}

#[test]
fn a_click_on_a_plane_is_where_the_planes_meet() {
    for toml in
        ["mode='orthogonal'", "layout='four'", "mode='tomography'", "layout='four'\nplanes.tilt=20\nplanes.azimuth=-15"]
    {
        let tiles = Desk::new(toml).scene().sheet().tiles;
        for (n, tile) in tiles.iter().enumerate() {
            let mut desk = Desk::new(toml);
            desk.tool(Tool::Plane);
            let at = [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) * [0.55, 0.45][a]);
            let clicked = desk.click(at);
            assert!(matches!(clicked[..], [Command::Meet(_)]), "{toml} {n}: {clicked:?}");
            let scene = desk.scene();
            let (sheet, place) = (scene.sheet(), scene.plane(PlaneName::A).at);
            // In the clicked tile's own plane, at the pixel that was clicked.
            let tile = if scene.shows_three() { &sheet.tiles[n] } else { tile };
            let from = place - tile.plane.at;
            near(from.dot(tile.plane.normal), 0.0, 1e-9);
            let pixel = [from.dot(tile.plane.right), from.dot(tile.plane.down)].map(|mm| mm / sheet.pixel);
            for a in 0..2 {
                near(f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0 + pixel[a], at[a], 1e-6);
            }
        }
    }
}

#[test]
fn the_wheel_zooms_and_over_planes_it_steps_the_one_that_it_is_over() {
    let mut desk = Desk::new("layout='four'");
    let over = |desk: &mut Desk, at: [f64; 2], control: bool| {
        desk.held.control = control;
        desk.input(Input::Moved(desk.at(at)));
        desk.input(Input::Scroll(2.0))
    };
    assert_eq!(over(&mut desk, [400.0, 400.0], false), [Command::Zoom(1.1f64.powf(2.0))]);
    let before = desk.scene().plane(PlaneName::B).at;
    assert_eq!(over(&mut desk, [400.0, 100.0], false), [Command::Plane(PlaneName::B), Command::PlaneBy(2.0)]);
    assert!((desk.scene().plane(PlaneName::B).at - before - DVec3::X * 2.0).length() < 1e-9);
    assert_eq!(desk.controls.settings().layout, Layout::Four, "a plane that is shown is only picked");
    over(&mut desk, [100.0, 100.0], true);
    near(desk.controls.settings().planes.zoom, 1.21, 1e-9);
    near(desk.controls.settings().camera.zoom, 1.21, 1e-9);
    let mut flat = Desk::new("mode='plane'");
    assert_eq!(over(&mut flat, [100.0, 100.0], false), [Command::PlaneBy(2.0)]);
    assert_eq!(over(&mut flat, [100.0, 100.0], true), [Command::Zoom(1.1f64.powf(2.0))]);
}

#[test]
fn a_double_click_shows_a_tile_alone_and_all_of_them_again() {
    for (at, mode) in [([100.0, 400.0], Mode::Plane), ([400.0, 400.0], Mode::Surface)] {
        let mut desk = Desk::new("layout='four'");
        desk.click(at);
        desk.click(at);
        let shown = desk.controls.settings().clone();
        assert_eq!((shown.layout, shown.mode), (Layout::Single, mode));
        assert!(mode == Mode::Surface || shown.planes.plane == PlaneName::C);
        desk.now += Duration::from_secs(5);
        desk.click(at);
        assert_eq!(desk.controls.settings(), &shown, "one click is none");
        desk.click(at);
        assert_eq!((desk.controls.settings().layout, desk.controls.settings().mode), (Layout::Four, Mode::Surface));
    }
}

#[test]
fn nothing_is_held_that_began_elsewhere_or_was_lost() {
    let mut desk = Desk::new("");
    let start = desk.controls.settings().clone();
    desk.drag(Button::Left, [-20.0, 50.0], [300.0, 300.0]);
    assert_eq!(desk.controls.settings(), &start, "outside of the picture");
    desk.input(Input::Moved(desk.at([50.0, 50.0])));
    desk.input(Input::Button { button: Button::Left, pressed: true });
    desk.input(Input::Left);
    desk.input(Input::Moved(desk.at([300.0, 300.0])));
    assert_eq!(desk.controls.settings(), &start, "lost");
    let scene = desk.scene();
    let on = Picture { corner: [0.0; 2], size: [512.0; 2], scene: Some(&scene), taken: true, now: desk.now };
    for input in [
        Input::Moved([50.0; 2]),
        Input::Button { button: Button::Left, pressed: true },
        Input::Moved([90.0; 2]),
        Input::Scroll(1.0),
    ] {
        assert!(desk.hand.input(&input, &on, Tool::Turn, Modifiers::default()).is_empty(), "on a panel");
    }
}

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

fn seen(desk: &Desk, place: DVec3) -> [f64; 2] {
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
            assert!(apart(seen(&desk, held[n]), to[n]) < 1e-6, "{toml} {n}: {:?} {:?}", seen(&desk, held[n]), to[n]);
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
