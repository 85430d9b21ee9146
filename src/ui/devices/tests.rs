//! Known answers for events of devices, and properties that hold for any sequence of them.

use super::profile::{Pointing, Profile, Span};
use super::translator::{Event, State, Translator};
use crate::input::{Button, Input, Key, Modifiers, Phase};
use evdev::{AbsoluteAxisCode as Abs, EventType, KeyCode, RelativeAxisCode as Rel, SynchronizationCode as Sync};
use proptest::prelude::*;
use std::collections::BTreeSet;

const SIZE: [u32; 2] = [1001, 501];
const SPANS: [Span; 2] = [Span { low: 0, high: 2000 }, Span { low: -500, high: 500 }];

/// A translator with devices that are numbered in order.
struct FakeDevices {
    translator: Translator,
    count: u32,
}

impl FakeDevices {
    fn new() -> FakeDevices {
        FakeDevices { translator: Translator::new(SIZE), count: 0 }
    }

    fn plug(&mut self, pointing: Pointing) -> u32 {
        self.plug_as(pointing, &State::default())
    }

    fn plug_as(&mut self, pointing: Pointing, state: &State) -> u32 {
        self.count += 1;
        let profile = Profile { pointing, has_fine_wheel: self.count == 1 };
        self.translator.add(self.count, profile, state, &mut Vec::new());
        self.count
    }

    /// Sends a report of these events.
    fn report(&mut self, number: u32, events: &[(EventType, u16, i32)]) -> Vec<Input> {
        let mut out = Vec::new();
        let report = (EventType::SYNCHRONIZATION, Sync::SYN_REPORT.0, 0);
        for (kind, code, value) in events.iter().chain([&report]) {
            self.translator.event(number, Event { kind: kind.0, code: *code, value: *value }, &mut out);
        }
        out
    }

    fn key(&mut self, number: u32, code: KeyCode, value: i32) -> Vec<Input> {
        self.report(number, &[(EventType::KEY, code.0, value)])
    }

    fn unplug(&mut self, number: u32) -> Vec<Input> {
        let mut out = Vec::new();
        self.translator.remove(number, &mut out);
        out
    }
}

fn key(code: KeyCode, value: i32) -> (EventType, u16, i32) {
    (EventType::KEY, code.0, value)
}

fn rel(code: Rel, value: i32) -> (EventType, u16, i32) {
    (EventType::RELATIVE, code.0, value)
}

fn abs(code: Abs, value: i32) -> (EventType, u16, i32) {
    (EventType::ABSOLUTE, code.0, value)
}

/// A finger that touches or leaves in a slot.
fn tracked(slot: i32, number: i32) -> [(EventType, u16, i32); 2] {
    [abs(Abs::ABS_MT_SLOT, slot), abs(Abs::ABS_MT_TRACKING_ID, number)]
}

fn placed(x: i32, y: i32) -> [(EventType, u16, i32); 2] {
    [abs(Abs::ABS_MT_POSITION_X, x), abs(Abs::ABS_MT_POSITION_Y, y)]
}

fn touch(finger: u64, phase: Phase, at: [f64; 2]) -> Input {
    Input::Touch { finger, phase, at }
}

fn pressed(c: char) -> Input {
    Input::Key { key: Key::Char(c), pressed: true }
}

const SHIFT: Modifiers = Modifiers { shift: true, control: false, alt: false };
const DROPPED: (EventType, u16, i32) = (EventType::SYNCHRONIZATION, Sync::SYN_DROPPED.0, 0);

#[test]
fn a_mouse_moves_first_and_then_presses_and_stays_on_the_screen() {
    let mut devices = FakeDevices::new();
    let mouse = devices.plug(Pointing::Relative);
    let inputs = devices.report(mouse, &[key(KeyCode::BTN_LEFT, 1), rel(Rel::REL_X, 10), rel(Rel::REL_Y, -5)]);
    let button = Input::Button { button: Button::Left, pressed: true };
    assert_eq!(inputs, [Input::Moved([510.0, 245.0]), button]);
    assert_eq!(
        devices.report(mouse, &[rel(Rel::REL_X, i32::MAX), rel(Rel::REL_Y, i32::MIN)]),
        [Input::Moved([1000.0, 0.0])]
    );
    assert_eq!(devices.report(mouse, &[rel(Rel::REL_X, 1)]), [], "the pointer stays on the screen");
    devices.translator.resize([200, 100]);
    let inputs = devices.key(mouse, KeyCode::BTN_RIGHT, 1);
    assert_eq!(inputs[0], Input::Moved([199.0, 0.0]), "the press is where the pointer is");
}

#[test]
fn a_wheel_with_high_resolution_is_not_counted_twice() {
    let mut devices = FakeDevices::new();
    let (fine, plain) = (devices.plug(Pointing::Relative), devices.plug(Pointing::Relative));
    let middle = Input::Moved([500.0, 250.0]);
    let whole = [rel(Rel::REL_WHEEL, 1), rel(Rel::REL_WHEEL_HI_RES, 120)];
    assert_eq!(devices.report(fine, &whole), [middle, Input::Scroll(1.0)]);
    assert_eq!(devices.report(fine, &[rel(Rel::REL_WHEEL_HI_RES, -30)]), [Input::Scroll(-0.25)]);
    assert_eq!(devices.report(plain, &[rel(Rel::REL_WHEEL, -2)]), [Input::Scroll(-2.0)]);
}

#[test]
fn a_key_that_is_held_repeats_and_one_that_was_down_before_does_not() {
    let mut devices = FakeDevices::new();
    let board = devices.plug_as(Pointing::Relative, &State { keys: [KeyCode::KEY_ENTER.0].into(), ..State::default() });
    assert_eq!(devices.key(board, KeyCode::KEY_ENTER, 2), [], "it was down before the device was opened");
    assert_eq!(devices.key(board, KeyCode::KEY_ENTER, 0), []);
    for value in [1, 2, 2] {
        assert_eq!(devices.key(board, KeyCode::KEY_Q, value), [pressed('q')]);
    }
    assert_eq!(devices.key(board, KeyCode::KEY_Q, 0), [Input::Key { key: Key::Char('q'), pressed: false }]);
    assert_eq!(devices.key(board, KeyCode::KEY_POWER, 1), []);
}

#[test]
fn shift_on_one_keyboard_counts_for_another() {
    let mut devices = FakeDevices::new();
    let (left, right) = (devices.plug(Pointing::Relative), devices.plug(Pointing::Relative));
    assert_eq!(devices.key(left, KeyCode::KEY_LEFTSHIFT, 1), [Input::Modifiers(SHIFT)]);
    assert_eq!(devices.key(right, KeyCode::KEY_RIGHTSHIFT, 1), [], "shift is already held");
    assert_eq!(devices.key(right, KeyCode::KEY_X, 1), [pressed('x')]);
    assert_eq!(devices.key(left, KeyCode::KEY_LEFTSHIFT, 0), [], "shift is still held");
    // Everything that it held is released, including shift.
    assert_eq!(devices.unplug(right), [Input::FocusLost]);
    let both = devices.report(left, &[key(KeyCode::KEY_RIGHTCTRL, 1), key(KeyCode::KEY_Z, 1)]);
    assert_eq!(both, [Input::Modifiers(Modifiers { control: true, ..Modifiers::default() }), pressed('z')]);
}

#[test]
fn a_key_on_two_keyboards_is_up_when_both_are() {
    let mut devices = FakeDevices::new();
    let (left, right) = (devices.plug(Pointing::Relative), devices.plug(Pointing::Relative));
    let enter = |pressed| Input::Key { key: Key::Enter, pressed };
    assert_eq!(devices.key(left, KeyCode::KEY_ENTER, 1), [enter(true)]);
    assert_eq!(devices.key(right, KeyCode::KEY_KPENTER, 1), [enter(true)]);
    assert_eq!(devices.key(left, KeyCode::KEY_ENTER, 0), []);
    assert_eq!(devices.key(right, KeyCode::KEY_KPENTER, 0), [enter(false)]);
}

#[test]
fn modifiers_survive_the_removal_of_another_device() {
    let mut devices = FakeDevices::new();
    let (board, mouse) = (devices.plug(Pointing::Relative), devices.plug(Pointing::Relative));
    devices.key(board, KeyCode::KEY_LEFTSHIFT, 1);
    devices.key(mouse, KeyCode::BTN_LEFT, 1);
    assert_eq!(devices.unplug(mouse), [Input::FocusLost, Input::Modifiers(SHIFT)]);
    assert_eq!(devices.unplug(board), [Input::Modifiers(Modifiers::default())]);
    assert_eq!(devices.unplug(board), [], "it is removed");
}

#[test]
fn two_fingers_pinch() {
    let mut devices = FakeDevices::new();
    let screen = devices.plug(Pointing::Fingers(SPANS));
    let both = [tracked(0, 45), placed(400, 0), tracked(1, 46), placed(1600, 0)].concat();
    assert_eq!(
        devices.report(screen, &both),
        [touch(1, Phase::Down, [200.0, 250.0]), touch(2, Phase::Down, [800.0, 250.0])]
    );
    // The kernel reports only changes: the values still belong to slot 1.
    let closer = [abs(Abs::ABS_MT_POSITION_X, 1400), abs(Abs::ABS_MT_SLOT, 0), abs(Abs::ABS_MT_POSITION_X, 600)];
    assert_eq!(
        devices.report(screen, &closer),
        [touch(1, Phase::Moved, [300.0, 250.0]), touch(2, Phase::Moved, [700.0, 250.0])]
    );
    // Values still belong to slot 0.
    assert_eq!(devices.report(screen, &[abs(Abs::ABS_MT_TRACKING_ID, -1)]), [touch(1, Phase::Up, [300.0, 250.0])]);
    // A new finger at the same position has no new coordinates. The other finger leaves in the same report.
    let next = [&tracked(0, 47)[..], &tracked(1, -1)].concat();
    assert_eq!(
        devices.report(screen, &next),
        [touch(3, Phase::Down, [300.0, 250.0]), touch(2, Phase::Up, [700.0, 250.0])]
    );
    assert_eq!(devices.unplug(screen), [touch(3, Phase::Cancelled, [300.0, 250.0])]);
}

#[test]
fn a_slot_may_change_its_finger_in_one_report_and_a_palm_is_cancelled() {
    let mut devices = FakeDevices::new();
    let screen = devices.plug(Pointing::Fingers(SPANS));
    devices.report(screen, &[tracked(0, 1), placed(0, -500)].concat());
    assert_eq!(
        devices.report(screen, &[tracked(0, 2), placed(2000, 500)].concat()),
        [touch(1, Phase::Up, [0.0, 0.0]), touch(2, Phase::Down, [1000.0, 500.0])]
    );
    let palm = abs(Abs::ABS_MT_TOOL_TYPE, 2);
    assert_eq!(devices.report(screen, &[palm]), [touch(2, Phase::Cancelled, [1000.0, 500.0])]);
    assert_eq!(devices.report(screen, &placed(10, 10)), []);
    assert_eq!(devices.report(screen, &[tracked(1, 3), tracked(99, 4)].concat()), [], "their positions are unknown");
}

#[test]
fn dropped_events_are_detected_and_resynchronised() {
    let mut devices = FakeDevices::new();
    let screen = devices.plug(Pointing::Fingers(SPANS));
    devices.report(screen, &[tracked(0, 1), placed(1000, 0)].concat());
    assert_eq!(devices.report(screen, &[&[DROPPED], &tracked(1, 2)[..], &placed(3, 3)].concat()), []);
    assert!(devices.translator.needs_resync(screen));
    let mut out = Vec::new();
    devices.translator.resync(screen, &State { slot: 1, ..State::default() }, &mut out);
    assert_eq!(out, [touch(1, Phase::Cancelled, [500.0, 250.0])]);
    assert!(!devices.translator.needs_resync(screen));
    // The first finger still touches and is ignored until it is lifted.
    assert_eq!(devices.report(screen, &[&[abs(Abs::ABS_MT_SLOT, 0)], &placed(7, 7)[..]].concat()), []);
    let down = [tracked(0, -1), tracked(0, 5), placed(2000, 500)].concat();
    assert_eq!(devices.report(screen, &down), [touch(2, Phase::Down, [1000.0, 500.0])]);
    // Keys that are up now are released. Shift counts even without its event.
    let board = devices.plug(Pointing::Relative);
    devices.report(board, &[key(KeyCode::KEY_A, 1), key(KeyCode::KEY_B, 1)]);
    devices.report(board, &[DROPPED, key(KeyCode::KEY_A, 0)]);
    let keys = [KeyCode::KEY_B.0, KeyCode::KEY_C.0, KeyCode::KEY_LEFTSHIFT.0].into();
    let mut out = Vec::new();
    devices.translator.resync(board, &State { keys, ..State::default() }, &mut out);
    assert_eq!(out, [Input::Key { key: Key::Char('a'), pressed: false }, Input::Modifiers(SHIFT)]);
}

#[test]
fn a_touch_screen_for_one_finger_and_a_tablet_as_a_mouse() {
    let mut devices = FakeDevices::new();
    let state = State { place: [Some(1000), Some(0)], ..State::default() };
    let screen = devices.plug_as(Pointing::Finger(SPANS), &state);
    assert_eq!(devices.key(screen, KeyCode::BTN_TOUCH, 1), [touch(1, Phase::Down, [500.0, 250.0])]);
    assert_eq!(devices.report(screen, &[abs(Abs::ABS_X, 0)]), [touch(1, Phase::Moved, [0.0, 250.0])]);
    assert_eq!(devices.key(screen, KeyCode::BTN_TOUCH, 0), [touch(1, Phase::Up, [0.0, 250.0])]);
    let tablet = devices.plug_as(Pointing::Absolute(SPANS), &state);
    assert_eq!(devices.report(tablet, &[abs(Abs::ABS_X, 2000)]), [Input::Moved([1000.0, 250.0])]);
    let pen = devices.report(tablet, &[key(KeyCode::BTN_TOUCH, 1), abs(Abs::ABS_Y, 500)]);
    let button = Input::Button { button: Button::Left, pressed: true };
    assert_eq!(pen, [Input::Moved([1000.0, 500.0]), button]);
}

#[test]
fn a_pad_moves_the_pointer_relative_to_its_position() {
    let mut devices = FakeDevices::new();
    let pad = devices.plug(Pointing::Pad(SPANS));
    let at = |x, y| [abs(Abs::ABS_X, x), abs(Abs::ABS_Y, y)];
    let finger = [key(KeyCode::BTN_TOUCH, 1), key(KeyCode::BTN_TOOL_FINGER, 1)];
    assert_eq!(devices.report(pad, &[&finger[..], &at(200, 100)].concat()), [], "it touched");
    // The width of the pad is the width of the screen, for both axes.
    let by = [20.0, -40.0].map(|n| n / 2000.0 * 1001.0);
    assert_eq!(devices.report(pad, &at(220, 60)), [Input::Moved([500.0 + by[0], 250.0 + by[1]])]);
    let two = [key(KeyCode::BTN_TOOL_FINGER, 0), key(KeyCode::BTN_TOOL_DOUBLETAP, 1)];
    assert_eq!(devices.report(pad, &[&two[..], &at(900, 60)].concat()), [], "the second finger is elsewhere");
    assert!(matches!(devices.report(pad, &at(900, -140))[..], [Input::Scroll(by)] if by > 0.0));
}

const DEVICE_COUNT: u32 = 4;

/// An action of the property test.
#[derive(Clone, Debug)]
enum Step {
    Event(u32, Event),
    Plug(u32, Profile, State),
    Unplug(u32),
    Resync(u32, State),
    Resize([u32; 2]),
}

/// Values of devices, including broken ones.
fn number() -> impl Strategy<Value = i32> {
    prop_oneof![4 => -2..4, 4 => -600..2200, 1 => any::<i32>(), 1 => Just(i32::MIN), 1 => Just(i32::MAX)]
}

/// Events, mostly with codes that have a meaning.
fn event() -> impl Strategy<Value = Event> {
    let keys = [
        KeyCode::KEY_A,
        KeyCode::KEY_LEFTSHIFT,
        KeyCode::KEY_RIGHTALT,
        KeyCode::KEY_KPENTER,
        KeyCode::BTN_LEFT,
        KeyCode::BTN_TOUCH,
        KeyCode::BTN_STYLUS,
        KeyCode::BTN_TOOL_DOUBLETAP,
    ];
    let of = |kind: EventType, code, value| Event { kind: kind.0, code, value };
    let axes = prop_oneof![0u16..2, Just(Abs::ABS_MT_SLOT.0), 0x30u16..0x3e];
    prop_oneof![
        6 => (prop::sample::select(keys.to_vec()), 0..3).prop_map(move |(key, v)| of(EventType::KEY, key.0, v)),
        6 => (axes, number()).prop_map(move |(axis, v)| of(EventType::ABSOLUTE, axis, v)),
        3 => (0u16..13, number()).prop_map(move |(axis, v)| of(EventType::RELATIVE, axis, v)),
        8 => Just(of(EventType::SYNCHRONIZATION, Sync::SYN_REPORT.0, 0)),
        1 => Just(of(EventType::SYNCHRONIZATION, Sync::SYN_DROPPED.0, 0)),
        1 => (any::<u16>(), any::<u16>(), any::<i32>()).prop_map(|(kind, code, value)| Event { kind, code, value }),
    ]
}

fn state() -> impl Strategy<Value = State> {
    let keys = prop::collection::btree_set(prop_oneof![0u16..120, 0x110u16..0x150], 0..5);
    (keys, any::<[Option<i32>; 2]>(), number()).prop_map(|(keys, place, slot)| State { keys, place, slot })
}

fn profile() -> impl Strategy<Value = Profile> {
    let span = prop_oneof![Just(SPANS[0]), (any::<i32>(), any::<i32>()).prop_map(|(low, high)| Span { low, high })];
    ([span.clone(), span], 0..5, any::<bool>()).prop_map(|(spans, kind, has_fine_wheel)| {
        let pointing = match kind {
            0 => Pointing::Relative,
            1 => Pointing::Absolute(spans),
            2 => Pointing::Pad(spans),
            3 => Pointing::Finger(spans),
            _ => Pointing::Fingers(spans),
        };
        Profile { pointing, has_fine_wheel }
    })
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        40 => (0..DEVICE_COUNT, event()).prop_map(|(device, event)| Step::Event(device, event)),
        3 => (0..DEVICE_COUNT, profile(), state()).prop_map(|(device, profile, state)| Step::Plug(device, profile, state)),
        1 => (0..DEVICE_COUNT).prop_map(Step::Unplug),
        1 => (0..DEVICE_COUNT, state()).prop_map(|(device, state)| Step::Resync(device, state)),
        1 => prop_oneof![Just([1001, 501]), Just([0, 0]), any::<[u32; 2]>()].prop_map(Step::Resize),
    ]
}

/// What is held according to the inputs.
#[derive(Default)]
struct Held {
    buttons: Vec<Button>,
    keys: Vec<Key>,
    fingers: BTreeSet<u64>,
    modifiers: Modifiers,
}

impl Held {
    fn apply(&mut self, input: &Input, size: [u32; 2]) {
        let is_inside = |at: [f64; 2]| (0..2).all(|n| (0.0..=f64::from(size[n].max(1)) - 1.0).contains(&at[n]));
        match *input {
            Input::Moved(at) => assert!(is_inside(at), "{at:?}"),
            Input::Button { button, pressed: true } => {
                assert!(!self.buttons.contains(&button), "twice {button:?}");
                self.buttons.push(button);
            }
            Input::Button { button, .. } => self.buttons.retain(|held| *held != button),
            Input::Scroll(notches) => assert!(notches.is_finite()),
            Input::Key { key, pressed: true } => self.keys.push(key),
            Input::Key { key, .. } => self.keys.retain(|held| *held != key),
            Input::Modifiers(modifiers) => {
                assert_ne!(self.modifiers, modifiers);
                self.modifiers = modifiers;
            }
            Input::Touch { finger, phase, at } => {
                assert!(is_inside(at), "{at:?}");
                let is_right = match phase {
                    Phase::Down => self.fingers.insert(finger),
                    Phase::Moved => self.fingers.contains(&finger),
                    Phase::Up | Phase::Cancelled => self.fingers.remove(&finger),
                };
                assert!(is_right, "{finger} {phase:?}");
            }
            // Fingers are cancelled one by one.
            // Devices know of no window.
            Input::PointerLeft => unreachable!("{input:?}"),
            Input::FocusLost => *self = Held { fingers: std::mem::take(&mut self.fingers), ..Held::default() },
        }
    }
}

proptest! {
    #[test]
    fn positions_stay_on_the_screen_and_nothing_is_held_after_all_devices_are_removed(
        steps in prop::collection::vec(step(), 1..400),
    ) {
        let (mut translator, mut size, mut held) = (Translator::new(SIZE), SIZE, Held::default());
        for number in 0..2 {
            let pointing = if number == 0 { Pointing::Relative } else { Pointing::Fingers(SPANS) };
            translator.add(number, Profile { pointing, has_fine_wheel: true }, &State::default(), &mut Vec::new());
        }
        for step in steps {
            let mut out = Vec::new();
            match step {
                Step::Event(device, event) => translator.event(device, event, &mut out),
                Step::Plug(device, profile, state) => translator.add(device, profile, &state, &mut out),
                Step::Unplug(device) => translator.remove(device, &mut out),
                Step::Resync(device, state) => translator.resync(device, &state, &mut out),
                Step::Resize(to) => {
                    size = to;
                    translator.resize(to);
                }
            }
            out.iter().for_each(|input| held.apply(input, size));
        }
        for device in 0..DEVICE_COUNT {
            let mut out = Vec::new();
            translator.remove(device, &mut out);
            out.iter().for_each(|input| held.apply(input, size));
        }
        prop_assert!(held.buttons.is_empty() && held.keys.is_empty() && held.fingers.is_empty());
        prop_assert_eq!(held.modifiers, Modifiers::default());
    }
}
