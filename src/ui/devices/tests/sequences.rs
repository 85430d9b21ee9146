//! Whatever devices say, in whatever order: places are on the screen, and nothing is held for ever.

use super::*;
use proptest::prelude::*;
use std::collections::BTreeSet;

const MOST: u32 = 4;

/// What may happen.
#[derive(Clone, Debug)]
enum Step {
    Says(u32, Event),
    /// In several of the ways in which a driver may.
    Plug(u32, Profile, State),
    Unplug(u32),
    Resync(u32, State),
    Resize([u32; 2]),
}

/// Numbers as devices give them, and as broken ones do.
fn number() -> impl Strategy<Value = i32> {
    prop_oneof![4 => -2..4, 4 => -600..2200, 1 => any::<i32>(), 1 => Just(i32::MIN), 1 => Just(i32::MAX)]
}

/// Codes that mean something, mostly.
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
        40 => (0..MOST, event()).prop_map(|(device, event)| Step::Says(device, event)),
        3 => (0..MOST, profile(), state()).prop_map(|(device, profile, state)| Step::Plug(device, profile, state)),
        1 => (0..MOST).prop_map(Step::Unplug),
        1 => (0..MOST, state()).prop_map(|(device, state)| Step::Resync(device, state)),
        1 => prop_oneof![Just([1001, 501]), Just([0, 0]), any::<[u32; 2]>()].prop_map(Step::Resize),
    ]
}

/// What whoever listens takes to be held.
#[derive(Default)]
struct Held {
    buttons: Vec<Button>,
    keys: Vec<Key>,
    fingers: BTreeSet<u64>,
    modifiers: Modifiers,
}

impl Held {
    fn hear(&mut self, input: &Input, size: [u32; 2]) {
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
                    Phase::Up | Phase::Gone => self.fingers.remove(&finger),
                };
                assert!(is_right, "{finger} {phase:?}");
            }
            // Fingers are told of one by one, whatever else is let go.
            Input::Left => *self = Held { fingers: std::mem::take(&mut self.fingers), ..Held::default() },
        }
    }
}

proptest! {
    #[test]
    fn nothing_that_devices_say_leaves_the_screen_or_is_held_when_they_are_gone(
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
                Step::Says(device, event) => translator.event(device, event, &mut out),
                Step::Plug(device, profile, state) => translator.add(device, profile, &state, &mut out),
                Step::Unplug(device) => translator.remove(device, &mut out),
                Step::Resync(device, state) => translator.resync(device, &state, &mut out),
                Step::Resize(to) => {
                    size = to;
                    translator.resize(to);
                }
            }
            out.iter().for_each(|input| held.hear(input, size));
        }
        for device in 0..MOST {
            let mut out = Vec::new();
            translator.remove(device, &mut out);
            out.iter().for_each(|input| held.hear(input, size));
        }
        prop_assert!(held.buttons.is_empty() && held.keys.is_empty() && held.fingers.is_empty());
        prop_assert_eq!(held.modifiers, Modifiers::default());
    }
}
