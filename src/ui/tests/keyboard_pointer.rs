//! Gestures by keys alone: each does what the mouse does at the same places.

use super::*;
use crate::input::Key;
use crate::keyboard_pointer::KeyboardPointer;
use crate::keys::HeldKeys;
use crate::picking::Picker;
use crate::scene::MeasureKind;

/// A window whose mouse is the keyboard.
struct Keyboard {
    window: TestWindow,
    pointer: KeyboardPointer,
    keys: HeldKeys,
    at: [f64; 2],
}

impl Keyboard {
    fn new(toml: &str) -> Keyboard {
        let window = TestWindow::new(toml);
        let mut keyboard =
            Keyboard { window, pointer: KeyboardPointer::default(), keys: HeldKeys::default(), at: [0.0; 2] };
        let pointed = keyboard.pointer.toggle(None, keyboard.picture());
        keyboard.point(pointed);
        keyboard
    }

    fn picture(&self) -> ([u32; 2], [u32; 2]) {
        let size = self.window.scene().picture_size().map(|n| (f64::from(n) * self.window.enlarged) as u32);
        (self.window.corner.map(|n| n as u32), size)
    }

    fn point(&mut self, pointed: Vec<(Input, Modifiers)>) {
        for (input, held) in pointed {
            if let Input::Moved(at) = input {
                self.at = at;
            }
            self.window.held = held;
            self.window.input(input);
        }
    }

    fn press(&mut self, key: Key) {
        let pointed = self.pointer.key(key, &self.keys, self.picture()).expect("a key of the pointer");
        self.point(pointed);
        for pressed in [true, false] {
            self.keys.input(&Input::Key { key, pressed });
        }
    }

    fn hold(&mut self, shift: bool, control: bool) {
        self.keys.input(&Input::Modifiers(Modifiers { shift, control, alt: false }));
    }

    /// Moves to a place on the picture, first in steps and then by single pixels.
    fn go(&mut self, to: [f64; 2]) {
        let to = self.window.at(to).map(f64::floor);
        let step = 0.02 * f64::from(self.picture().1.into_iter().min().unwrap_or(1));
        for (shift, nearer) in [(false, step + 1.0), (true, 1.0)] {
            self.hold(shift, false);
            for _ in 0..2000 {
                let [x, y] = [0, 1].map(|n| to[n] - self.at[n]);
                match () {
                    () if x.abs() >= nearer => self.press(if x > 0.0 { Key::Right } else { Key::Left }),
                    () if y.abs() >= nearer => self.press(if y > 0.0 { Key::Down } else { Key::Up }),
                    () => break,
                }
            }
            self.hold(false, false);
        }
        assert_eq!(self.at, to);
    }

    fn drag(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.go(from);
        self.press(Key::Space);
        self.go(to);
        self.press(Key::Space);
    }
}

/// Prevents a caliper that needs a mouse: by clicks, by a drag, and a point of it that is moved afterwards.
#[test]
fn a_caliper_by_keys_is_that_of_the_mouse() {
    let ends = [[60.0, 50.0], [130.0, 95.0]];
    let measured = |window: &TestWindow| window.controls.measures().to_vec();
    let start = || {
        let mut mouse = TestWindow::new("mode='plane'");
        mouse.tool(Tool::Measure(MeasureKind::Distance));
        let mut keyboard = Keyboard::new("mode='plane'");
        keyboard.window.tool(Tool::Measure(MeasureKind::Distance));
        (mouse, keyboard)
    };
    let (mut mouse, mut keyboard) = start();
    for end in ends {
        mouse.click(end);
        mouse.now += Duration::from_secs(1);
        keyboard.go(end);
        keyboard.press(Key::Enter);
    }
    assert_eq!(measured(&keyboard.window).len(), 1);
    assert_eq!(measured(&keyboard.window), measured(&mouse));
    // Its end is moved.
    let before = measured(&mouse);
    mouse.drag(Button::Left, ends[1], [150.0, 60.0]);
    keyboard.drag(ends[1], [150.0, 60.0]);
    assert_eq!(measured(&keyboard.window), measured(&mouse));
    assert_ne!(measured(&mouse), before);
    let (mut mouse, mut keyboard) = start();
    mouse.drag(Button::Left, ends[0], ends[1]);
    keyboard.drag(ends[0], ends[1]);
    assert_eq!(measured(&keyboard.window).len(), 1);
    assert_eq!(measured(&keyboard.window), measured(&mouse));
}

/// Prevents an outline whose last click cannot be a double one.
#[test]
fn two_clicks_by_one_key_end_an_outline() {
    let mut keyboard = Keyboard::new("mode='plane'");
    keyboard.window.tool(Tool::Measure(MeasureKind::Trace));
    for at in [[60.0, 50.0], [110.0, 50.0], [110.0, 90.0]] {
        keyboard.go(at);
        keyboard.press(Key::Enter);
    }
    keyboard.go([60.0, 90.0]);
    keyboard.hold(true, false);
    keyboard.press(Key::Enter);
    let measures = keyboard.window.controls.measures();
    assert!(keyboard.window.controls.work().is_none());
    assert_eq!(measures.iter().map(|measured| measured.points.len()).collect::<Vec<_>>(), [4]);
}

#[test]
fn a_face_of_the_region_is_moved_by_keys() {
    let toml = "mode='volume'\ncamera.azimuth=50\nregion.depth=[30, 80]";
    let (mut mouse, mut keyboard) = (TestWindow::new(toml), Keyboard::new(toml));
    for window in [&mut mouse, &mut keyboard.window] {
        window.tool(Tool::Region);
    }
    let [x, y] = Picker::of(&mouse.scene()).centre();
    let ends = [[x, y], [x + 30.0, y - 20.0]];
    let before = mouse.controls.settings().region.clone();
    mouse.drag(Button::Left, ends[0], ends[1]);
    keyboard.drag(ends[0], ends[1]);
    let region = |window: &TestWindow| window.scene().low.extend(window.scene().high.x).to_array();
    assert_ne!(mouse.controls.settings().region, before);
    let [by_mouse, by_keys] = [&mouse, &keyboard.window].map(region);
    // The way through the slop differs, and with it what is lost there.
    assert!(by_mouse.iter().zip(by_keys).all(|(a, b)| (a - b).abs() < 3.0), "{by_mouse:?} {by_keys:?}");
    assert_ne!(keyboard.window.controls.settings().region, before);
}

#[test]
fn a_cut_is_drawn_round_something_by_keys() {
    let mut keyboard = Keyboard::new("mode='volume'");
    keyboard.window.tool(Tool::Cut);
    let [x, y] = Picker::of(&keyboard.window.scene()).centre();
    let corners = [[-30.0, -25.0], [30.0, -25.0], [30.0, 25.0], [-30.0, 25.0]].map(|[a, b]| [x + a, y + b]);
    keyboard.go(corners[0]);
    keyboard.press(Key::Space);
    corners[1..].iter().for_each(|corner| keyboard.go(*corner));
    assert!(keyboard.window.controls.outline().len() > 20, "it is shown while it is drawn");
    keyboard.press(Key::Space);
    assert_eq!(keyboard.window.controls.settings().cuts.len(), 1);
    let scene = keyboard.window.scene();
    let cut = scene.cuts().next().expect("a cut");
    for (beside, expected) in [([0.0, 0.0], true), ([25.0, 20.0], true), ([36.0, 0.0], false), ([0.0, -31.0], false)] {
        let (origin, direction) = Picker::of(&scene).ray([x + beside[0], y + beside[1]]);
        let place = origin + direction * (scene.rays.target - origin).length();
        assert_eq!(cut.removes(place), expected, "{beside:?}");
    }
    // One that is given up leaves nothing behind.
    keyboard.go(corners[0]);
    keyboard.press(Key::Space);
    keyboard.go(corners[2]);
    keyboard.press(Key::Escape);
    assert!(keyboard.window.controls.outline().is_empty() && !keyboard.window.gestures.is_pressed());
    keyboard.press(Key::Left);
    assert_eq!(keyboard.window.controls.settings().cuts.len(), 1);
}

/// With the tool; and without it by the keys that hold the button as Ctrl and Shift do.
#[test]
fn the_light_and_the_picture_are_moved_by_keys() {
    let light = |window: &TestWindow| window.controls.settings().light.direction;
    let mut keyboard = Keyboard::new("mode='surface'");
    keyboard.window.tool(Tool::Light);
    let [x, y] = Picker::of(&keyboard.window.scene()).centre();
    let before = light(&keyboard.window);
    keyboard.drag([x, y], [x + 40.0, y]);
    let moved = light(&keyboard.window);
    assert!(moved.x > before.x + 0.1 && (moved.y - before.y).abs() < 0.05, "{before} {moved}");
    keyboard.window.tool(Tool::Rotate);
    let camera = keyboard.window.controls.settings().camera.clone();
    for (shift, control) in [(false, true), (true, false)] {
        keyboard.go([x, y]);
        keyboard.hold(shift, control);
        keyboard.press(Key::Space);
        keyboard.hold(false, false);
        keyboard.go([x - 40.0, y]);
        keyboard.press(Key::Space);
        assert!(light(&keyboard.window).x < moved.x - 0.1, "Ctrl moves the light");
        let now = &keyboard.window.controls.settings().camera;
        assert_eq!(now.target != camera.target, shift, "Shift moves the picture");
        assert_eq!((now.azimuth, now.elevation), (camera.azimuth, camera.elevation));
    }
}
