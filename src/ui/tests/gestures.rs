//! Known answers for gestures of a mouse and of fingers.

use super::*;
use crate::command::Viewpoint;
use crate::gestures::DEGREES_PER_HEIGHT;
use crate::input::Phase;
use crate::keys::HeldKeys;
use crate::picking::Picker;
use crate::view::{self, face_axis, nearest_face};

fn near(a: f64, b: f64, off: f64) {
    assert!((a - b).abs() <= off, "{a} is not {b}");
}

#[test]
fn a_drag_to_the_right_rotates_by_the_documented_angle_and_the_front_follows() {
    for (azimuth, four) in [("0.0", false), ("35.0", false), ("-60.0", true)] {
        for roll in [0.0, 50.0, 170.0] {
            let layout = if four { "four" } else { "single" };
            let mut window = TestWindow::new(&format!(
                "camera.azimuth={azimuth}\ncamera.elevation=20\ncamera.roll={roll}\nlayout='{layout}'"
            ));
            let before = window.scene();
            let picker = Picker::of(&before);
            let (middle, height) = (picker.centre(), picker.size()[1]);
            let front = before.rays.target - before.rays.forward * 20.0;
            let from = project(&window, front);
            // The slop is 3 pixels of the picture.
            window.drag(Button::Left, middle, [middle[0] + 3.0 + height / 20.0, middle[1]]);
            let to = project(&window, front);
            assert!(to[0] - from[0] > 3.0 && (to[1] - from[1]).abs() < (to[0] - from[0]) / 2.0, "{from:?} {to:?}");
            if roll == 0.0 {
                let azimuth = before.settings.camera.azimuth + DEGREES_PER_HEIGHT / 20.0;
                near(window.controls.settings().camera.azimuth, azimuth, 1e-9);
                near(window.controls.settings().camera.elevation, 20.0, 1e-9);
            }
            window.controls.reset();
            window.drag(Button::Left, middle, [middle[0], middle[1] + 3.0 + height / 20.0]);
            let to = project(&window, front);
            assert!(to[1] > from[1] + 3.0, "down: {from:?} {to:?}");
        }
    }
}

#[test]
fn elevation_is_limited_and_an_upside_down_view_does_not_jump() {
    let mut window = TestWindow::new("camera.elevation=130\ncamera.azimuth=20\ncamera.roll=10");
    let before = window.scene().rays;
    window.controls.apply(&Command::Rotate([1e-9, 0.0]), Some(&window.scene()));
    let after = window.scene().rays;
    assert!((before.up - after.up).length() < 1e-6 && (before.forward - after.forward).length() < 1e-6);
    near(window.controls.settings().camera.elevation, 50.0, 1e-6);
    window.drag(Button::Left, [256.0, 400.0], [256.0, 3000.0]);
    assert_eq!(window.controls.settings().camera.elevation.abs(), 90.0);
}

#[test]
fn rotated_planes_follow_the_pointer() {
    for (x, y) in [(60.0, 0.0), (0.0, 60.0)] {
        let mut window = TestWindow::new("mode='plane'");
        let plane = window.scene().plane(PlaneName::A);
        window.drag(Button::Left, [200.0, 200.0], [200.0 + x, 200.0 + y]);
        let turned = window.scene().plane(PlaneName::A);
        // A point on the viewer's side of the plane.
        let front = -plane.normal;
        assert!(front.dot(turned.right) * x + front.dot(turned.down) * y > 1.0, "{turned:?}");
    }
}

#[test]
fn dragging_up_moves_the_clip_plane_and_the_plane_deeper_by_the_same_distance() {
    let mut window = TestWindow::new("");
    window.tool(Tool::Clip);
    let near = window.scene().low.y - 40.0;
    window.drag(Button::Left, [200.0, 300.0], [200.0, 197.0]);
    near_mm(window.controls.settings().clip[0].at[1] - near, Picker::of(&window.scene()).mm_per_pixel());
    let mut window = TestWindow::new("mode='plane'\nplanes.plane='c'");
    window.tool(Tool::Plane);
    let before = window.scene().plane(PlaneName::C).at.y;
    window.drag(Button::Left, [200.0, 300.0], [200.0, 197.0]);
    near_mm(window.scene().plane(PlaneName::C).at.y - before, window.scene().tiling().pixel);
}

/// Expects the distance of 103 pixels, 3 of which are the slop.
fn near_mm(distance: f64, pixel: f64) {
    near(distance, 100.0 * pixel, 1e-6);
}

#[test]
fn a_pan_keeps_the_point_under_the_pointer() {
    for camera in
        ["camera.azimuth=30\ncamera.elevation=-25\ncamera.roll=40", "camera.field_of_view=40", "layout='four'"]
    {
        for (button, shift) in [(Button::Right, false), (Button::Middle, false), (Button::Left, true)] {
            let mut window = TestWindow::new(camera);
            window.held.shift = shift;
            let (centre, target) = (Picker::of(&window.scene()).centre(), window.scene().rays.target);
            let place = target + window.scene().rays.right * 7.0;
            let from = project(&window, place);
            window.drag(button, centre, [centre[0] - 31.0, centre[1] + 17.0]);
            let to = project(&window, place);
            near(to[0] - from[0], -31.0, 1e-6);
            near(to[1] - from[1], 17.0, 1e-6);
        }
    }
}

#[test]
fn a_face_of_the_region_follows_the_pointer_and_the_picture_does_not_move() {
    for field_of_view in [0.0, 35.0] {
        for (azimuth, elevation) in [(0.0, 0.0), (40.0, 25.0), (-120.0, 60.0)] {
            let toml = format!(
                "camera.zoom=0.7\ncamera.azimuth={azimuth}\ncamera.elevation={elevation}\ncamera.field_of_view={field_of_view}\n\
                 region.lateral=[-25, 25]\nregion.depth=[20, 70]\nregion.elevation=[-20, 20]"
            );
            for high in [false, true] {
                for a in 0..3 {
                    let face = Face { axis: a, high };
                    let mut window = TestWindow::new(&toml);
                    window.tool(Tool::Region);
                    let (middle, out) = face_axis(&window.scene(), face);
                    let grab = project(&window, middle);
                    if nearest_face(&window.scene(), grab) != Some(face) {
                        continue; // its axis points along the view
                    }
                    let fixed = window.scene().rays.target + DVec3::new(3.0, -2.0, 5.0);
                    let before_drag = project(&window, fixed);
                    let to = project(&window, middle + out * 4.0);
                    window.drag(Button::Left, grab, to);
                    let moved = window.scene();
                    let now = project(&window, face_axis(&moved, face).0);
                    // The slop is not dragged.
                    let off = (now[0] - to[0]).hypot(now[1] - to[1]);
                    assert!(
                        (off - 3.0).abs() < 1.0,
                        "{toml} {face:?}: {off} {:?} {:?}",
                        face_axis(&moved, face).0,
                        middle
                    );
                    let [x, y] = project(&window, fixed);
                    near((x - before_drag[0]).hypot(y - before_drag[1]), 0.0, 1e-3);
                    // Beyond its range, the face waits for the pointer to come back.
                    let mut window = TestWindow::new(&toml);
                    window.tool(Tool::Region);
                    let far = project(&window, middle - out * 70.0);
                    window.input(Input::Moved(window.at(grab)));
                    window.input(Input::Button { button: Button::Left, pressed: true });
                    window.input(Input::Moved(window.at(far)));
                    let scene = window.scene();
                    near((scene.high - scene.low)[a], 2.0, 1e-6);
                    let back = [grab[0] + (to[0] - grab[0]) * 0.5, grab[1] + (to[1] - grab[1]) * 0.5];
                    window.input(Input::Moved(window.at(back)));
                    let now = project(&window, face_axis(&window.scene(), face).0);
                    near((now[0] - back[0]).hypot(now[1] - back[1]), 3.0, 1.0);
                }
            }
        }
    }
}

#[test]
fn a_click_on_a_plane_moves_the_crossing_of_the_planes() {
    for toml in
        ["mode='orthogonal'", "layout='four'", "mode='tomography'", "layout='four'\nplanes.tilt=20\nplanes.azimuth=-15"]
    {
        let tiles = TestWindow::new(toml).scene().tiling().tiles;
        for (n, tile) in tiles.iter().enumerate() {
            let mut window = TestWindow::new(toml);
            window.tool(Tool::Plane);
            let at = [0, 1].map(|a| f64::from(tile.corner[a]) + f64::from(tile.size[a]) * [0.55, 0.45][a]);
            let clicked = window.click(at);
            assert!(matches!(clicked[..], [Command::MoveCrossing(_)]), "{toml} {n}: {clicked:?}");
            let scene = window.scene();
            let (tiling, place) = (scene.tiling(), scene.plane(PlaneName::A).at);
            // The crossing is in the plane of the clicked tile, at the clicked pixel.
            let tile = if scene.shows_three() { &tiling.tiles[n] } else { tile };
            let from = place - tile.plane.at;
            near(from.dot(tile.plane.normal), 0.0, 1e-9);
            let pixel = [from.dot(tile.plane.right), from.dot(tile.plane.down)].map(|mm| mm / tiling.pixel);
            for a in 0..2 {
                near(f64::from(tile.corner[a]) + f64::from(tile.size[a]) / 2.0 + pixel[a], at[a], 1e-6);
            }
        }
    }
}

#[test]
fn the_wheel_zooms_and_steps_the_plane_under_the_pointer() {
    let mut window = TestWindow::new("layout='four'");
    let over = |window: &mut TestWindow, at: [f64; 2], control: bool| {
        window.held.control = control;
        window.input(Input::Moved(window.at(at)));
        window.input(Input::Scroll(2.0))
    };
    assert_eq!(over(&mut window, [400.0, 400.0], false), [Command::Zoom(1.1f64.powf(2.0))]);
    let before = window.scene().plane(PlaneName::B).at;
    assert_eq!(over(&mut window, [400.0, 100.0], false), [Command::Plane(PlaneName::B), Command::StepPlane(2.0)]);
    assert!((window.scene().plane(PlaneName::B).at - before - DVec3::X * 2.0).length() < 1e-9);
    assert_eq!(window.controls.settings().layout, Layout::Four, "a visible plane is only selected");
    over(&mut window, [100.0, 100.0], true);
    near(window.controls.settings().planes.zoom, 1.21, 1e-9);
    near(window.controls.settings().camera.zoom, 1.21, 1e-9);
    let mut flat = TestWindow::new("mode='plane'");
    assert_eq!(over(&mut flat, [100.0, 100.0], false), [Command::StepPlane(2.0)]);
    assert_eq!(over(&mut flat, [100.0, 100.0], true), [Command::Zoom(1.1f64.powf(2.0))]);
}

#[test]
fn a_double_click_shows_a_tile_alone_and_all_of_them_again() {
    for (at, mode) in [([100.0, 400.0], Mode::Plane), ([400.0, 400.0], Mode::Surface)] {
        let mut window = TestWindow::new("layout='four'");
        window.click(at);
        window.click(at);
        let shown = window.controls.settings().clone();
        assert_eq!((shown.layout, shown.mode), (Layout::Single, mode));
        assert!(mode == Mode::Surface || shown.planes.plane == PlaneName::C);
        window.now += Duration::from_secs(5);
        window.click(at);
        assert_eq!(window.controls.settings(), &shown, "a single click does nothing");
        window.click(at);
        assert_eq!((window.controls.settings().layout, window.controls.settings().mode), (Layout::Four, Mode::Surface));
    }
}

#[test]
fn a_press_outside_of_the_picture_and_a_lost_focus_drag_nothing() {
    let mut window = TestWindow::new("");
    let start = window.controls.settings().clone();
    window.drag(Button::Left, [-20.0, 50.0], [300.0, 300.0]);
    assert_eq!(window.controls.settings(), &start, "outside of the picture");
    window.input(Input::Moved(window.at([50.0, 50.0])));
    window.input(Input::Button { button: Button::Left, pressed: true });
    window.input(Input::FocusLost);
    window.input(Input::Moved(window.at([300.0, 300.0])));
    assert_eq!(window.controls.settings(), &start, "lost");
    let scene = window.scene();
    let on = Viewport {
        corner: [0.0; 2],
        size: [512.0; 2],
        scene: Some(&scene),
        volume: None,
        measures: &[],
        body_marks: &[],
        start_line: &[],
        has_work: false,
        is_covered: true,
        now: window.now,
    };
    for input in [
        Input::Moved([50.0; 2]),
        Input::Button { button: Button::Left, pressed: true },
        Input::Moved([90.0; 2]),
        Input::Scroll(1.0),
    ] {
        assert!(window.gestures.input(&input, &on, Tool::Rotate, Modifiers::default()).is_empty(), "on a panel");
    }
}

/// Prevents a drag that ends at the border of the window, and keys that count as released there.
#[test]
fn a_drag_goes_on_outside_of_the_window_and_keys_stay_held() {
    let dragged = |leaves: bool| {
        let mut window = TestWindow::new("");
        window.input(Input::Moved(window.at([50.0, 50.0])));
        window.input(Input::Button { button: Button::Left, pressed: true });
        window.input(Input::Moved(window.at([200.0, 90.0])));
        if leaves {
            window.input(Input::PointerLeft);
        }
        window.input(Input::Moved(window.at([-300.0, 90.0])));
        window.input(Input::Button { button: Button::Left, pressed: false });
        window.controls.settings().clone()
    };
    assert_eq!(dragged(true), dragged(false));
    assert!(dragged(true) != *TestWindow::new("").controls.settings(), "the drag turns the view");
    let mut keys = HeldKeys::default();
    let shift = Modifiers { shift: true, ..Modifiers::default() };
    assert!(keys.input(&Input::Modifiers(shift)).is_none() && keys.input(&Input::PointerLeft).is_none());
    assert_eq!(keys.modifiers, shift);
    keys.input(&Input::FocusLost);
    assert_eq!(keys.modifiers, Modifiers::default());
}

/// A touch at a position on the picture.
fn touch(window: &mut TestWindow, finger: u64, phase: Phase, at: [f64; 2]) -> Vec<Command> {
    window.input(Input::Touch { finger, phase, at: window.at(at) })
}

/// The point in the plane of the camera target at a position on the picture.
fn under(window: &TestWindow, at: [f64; 2]) -> DVec3 {
    let scene = window.scene();
    let (origin, direction) = Picker::of(&scene).ray(at);
    origin + direction * ((scene.rays.target - origin).dot(scene.rays.forward) / direction.dot(scene.rays.forward))
}

fn project(window: &TestWindow, place: DVec3) -> [f64; 2] {
    Picker::of(&window.scene()).project(place).unwrap()
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Both halves of a pair show the same rays: a press on the volume acts like one on the surface, also where it leaves its half.
#[test]
fn a_gesture_on_the_volume_of_a_pair_acts_like_the_same_on_the_surface() {
    let settings = |tool: Tool, columns: f64| {
        let mut window = TestWindow::new("layout='pair'\ncamera.azimuth=35\ncamera.elevation=20\ncamera.roll=10");
        window.tool(tool);
        window.drag(Button::Left, [columns + 60.0, 120.0], [columns + 330.0, 190.0]);
        for (n, at) in [[60.0, 200.0], [150.0, 260.0]].into_iter().enumerate() {
            touch(&mut window, n as u64, Phase::Down, [columns + at[0], at[1]]);
        }
        touch(&mut window, 0, Phase::Moved, [columns + 20.0, 170.0]);
        let s = window.controls.settings();
        let target = s.camera.target.unwrap_or_default();
        let region = [s.region.lateral, s.region.depth, s.region.elevation].map(Option::unwrap_or_default);
        let clip = s.clip.first().map_or([0.0; 3], |clip| clip.at);
        let camera = [s.camera.azimuth, s.camera.elevation, s.camera.roll, s.camera.zoom];
        [target.as_slice(), region.as_flattened(), &clip, &camera].concat()
    };
    for tool in [Tool::Rotate, Tool::Light, Tool::Region, Tool::Clip] {
        let (volume, surface) = (settings(tool, 0.0), settings(tool, 256.0));
        let off = volume.iter().zip(&surface).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "{tool:?}: {volume:?}, {surface:?}");
    }
}

#[test]
fn the_points_under_two_fingers_stay_under_them() {
    for toml in [
        "",
        "camera.azimuth=40\ncamera.elevation=-30\ncamera.roll=20\nray.subsampling=2",
        "layout='four'",
        "layout='pair'",
        "ray.rays=2",
    ] {
        let mut window = TestWindow::new(toml);
        let [x, y] = Picker::of(&window.scene()).centre();
        let from = [[x + 10.0, y - 40.0], [x + 60.0, y + 30.0]];
        let to = [[x - 25.0, y - 50.0], [x + 70.0, y + 62.0]];
        let touched = from.map(|at| under(&window, at));
        (0..2).for_each(|n| drop(touch(&mut window, n as u64, Phase::Down, from[n])));
        for step in 1..=30 {
            let share = f64::from(step) / 30.0;
            for n in 0..2 {
                let at = [0, 1].map(|a| from[n][a] + (to[n][a] - from[n][a]) * share);
                touch(&mut window, n as u64, Phase::Moved, at);
            }
        }
        for n in 0..2 {
            assert!(
                apart(project(&window, touched[n]), to[n]) < 1e-6,
                "{toml} {n}: {:?} {:?}",
                project(&window, touched[n]),
                to[n]
            );
        }
    }
}

#[test]
fn adding_and_removing_fingers_moves_nothing() {
    let mut window = TestWindow::new("");
    for (finger, phase, at) in [
        (1, Phase::Down, [200.0, 200.0]),
        (2, Phase::Down, [300.0, 210.0]),
        (3, Phase::Down, [250.0, 400.0]),
        (3, Phase::Moved, [20.0, 30.0]),
        (1, Phase::Up, [200.0, 200.0]),
        (4, Phase::Down, [90.0, 80.0]),
        (2, Phase::Cancelled, [500.0, 500.0]),
        (4, Phase::Up, [90.0, 80.0]),
        (3, Phase::Moved, [22.0, 33.0]),
        (3, Phase::Up, [22.0, 33.0]),
    ] {
        assert_eq!(touch(&mut window, finger, phase, at), [], "finger {finger} {phase:?}");
    }
    assert!(!window.gestures.is_pressed());
}

#[test]
fn lifting_two_fingers_in_turn_is_no_tap() {
    let mut window = TestWindow::new("layout='four'");
    window.tool(Tool::Plane);
    for _ in 0..2 {
        for (finger, phase) in [(1, Phase::Down), (2, Phase::Down), (1, Phase::Up), (2, Phase::Up)] {
            assert_eq!(touch(&mut window, finger, phase, [60.0 + 40.0 * finger as f64, 90.0]), []);
        }
    }
}

#[test]
fn one_finger_rotates_and_a_double_tap_shows_a_tile() {
    let mut window = TestWindow::new("");
    touch(&mut window, 7, Phase::Down, [200.0, 200.0]);
    assert_eq!(touch(&mut window, 7, Phase::Moved, [204.0, 200.0]), [], "less than the slop of a glove");
    assert!(matches!(touch(&mut window, 7, Phase::Moved, [260.0, 200.0])[..], [Command::Rotate([by, _])] if by > 0.0));
    touch(&mut window, 7, Phase::Up, [260.0, 200.0]);
    let mut window = TestWindow::new("layout='four'");
    for _ in 0..2 {
        touch(&mut window, 8, Phase::Down, [100.0, 100.0]);
        touch(&mut window, 8, Phase::Up, [103.0, 100.0]);
    }
    assert_eq!(window.controls.settings().layout, Layout::Single);
}

/// A viewpoint is upright, looks along its axis at the middle of the region, and the picture keeps its scale.
#[test]
fn a_viewpoint_looks_along_its_axis_at_the_same_scale() {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let views = [(Viewpoint::Left, x, z), (Viewpoint::Top, -z, y), (Viewpoint::Right, -x, z), (Viewpoint::Front, y, z)];
    for toml in ["mode='vr'", "mode='sr'\ncamera.azimuth=37\ncamera.elevation=-20\ncamera.roll=12\ncamera.zoom=1.7"] {
        let mut window = TestWindow::new(toml);
        let scale = |window: &TestWindow| Picker::of(&window.scene()).mm_per_pixel();
        let before = scale(&window);
        for (viewpoint, forward, up) in views {
            apply(&mut window, Command::LookFrom(viewpoint));
            let scene = window.scene();
            assert!(scene.rays.forward.distance(forward) < 1e-9, "{viewpoint:?}: {:?}", scene.rays.forward);
            assert!(scene.rays.up.distance(up) < 1e-9, "{viewpoint:?}: {:?}", scene.rays.up);
            assert!((scale(&window) / before - 1.0).abs() < 1e-9, "{viewpoint:?}");
            assert!(views.iter().all(|(other, ..)| view::is_seen_from(&scene, *other) == (*other == viewpoint)));
        }
    }
}
