//! Classifies a device by its abilities, and gives key codes their meaning: by position on a US keyboard, independent of the layout in use.
//! A number pad always gives numbers.

use crate::input::{Button, Key};
use evdev::{AbsoluteAxisCode as Abs, KeyCode, RelativeAxisCode as Rel};
use std::collections::{BTreeMap, BTreeSet};

/// The range of the values of a device's axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) low: i32,
    pub(super) high: i32,
}

impl Span {
    /// The position of a value in the range, as a share from 0 to 1.
    pub(super) fn fraction(&self, value: i32) -> f64 {
        ((f64::from(value) - f64::from(self.low)) / self.length()).clamp(0.0, 1.0)
    }

    /// Largest value minus smallest, at least 1.
    pub(super) fn length(&self) -> f64 {
        (f64::from(self.high) - f64::from(self.low)).max(1.0)
    }
}

/// What a device can report, in the kernel's codes.
#[derive(Clone, Debug, Default)]
pub(super) struct Abilities {
    pub(super) keys: BTreeSet<u16>,
    pub(super) relative: BTreeSet<u16>,
    pub(super) absolute: BTreeMap<u16, Span>,
    /// True for a touch screen: the touched position is the position on the screen.
    pub(super) is_direct: bool,
    pub(super) is_accelerometer: bool,
}

/// How a device moves the pointer. Spans are those of the horizontal and the vertical axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Pointing {
    /// It moves the pointer relative to its position, or not at all.
    #[default]
    Relative,
    /// It sets the position of the pointer, as a pen does, or the tablet that a virtual machine uses as a mouse.
    Absolute([Span; 2]),
    /// It is a touch pad: a finger moves the pointer relative to its position.
    Pad([Span; 2]),
    /// It is a touch screen that recognises one finger.
    Finger([Span; 2]),
    /// It is a touch screen that recognises several fingers, each in a slot.
    Fingers([Span; 2]),
}

/// What kind of device it is: how it points, and what its wheel reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Profile {
    pub(super) pointing: Pointing,
    /// True if the wheel also reports fractions of notches.
    pub(super) has_fine_wheel: bool,
}

impl Profile {
    /// The kind of a device with these abilities. None if the program uses no input of it, as of a joystick, a power button or a lid switch.
    pub(super) fn of(abilities: &Abilities) -> Option<Profile> {
        if abilities.is_accelerometer {
            return None;
        }
        let axes = |x: Abs, y: Abs| {
            let spans = [*abilities.absolute.get(&x.0)?, *abilities.absolute.get(&y.0)?];
            spans.iter().all(|span| span.low < span.high).then_some(spans)
        };
        let has = |key: KeyCode| abilities.keys.contains(&key.0);
        let moves = |axis: Rel| abilities.relative.contains(&axis.0);
        let is_pen = has(KeyCode::BTN_TOOL_PEN) || has(KeyCode::BTN_STYLUS);
        let is_pad = has(KeyCode::BTN_TOOL_FINGER) && !is_pen && !abilities.is_direct;
        let is_touched = abilities.is_direct || has(KeyCode::BTN_TOUCH);
        let one = axes(Abs::ABS_X, Abs::ABS_Y);
        let several = axes(Abs::ABS_MT_POSITION_X, Abs::ABS_MT_POSITION_Y)
            .filter(|_| abilities.absolute.contains_key(&Abs::ABS_MT_SLOT.0));
        let pointing = match (one, several) {
            (Some(spans), _) if is_pen => Pointing::Absolute(spans),
            (Some(spans), _) if is_pad => Pointing::Pad(spans),
            (_, Some(spans)) if is_touched && !is_pen && !is_pad => Pointing::Fingers(spans),
            (Some(spans), _) if abilities.is_direct => Pointing::Finger(spans),
            (Some(spans), _) if has(KeyCode::BTN_LEFT) => Pointing::Absolute(spans),
            (Some(spans), _) if is_touched => Pointing::Finger(spans),
            _ => Pointing::Relative,
        };
        let means = |code: &u16| match pointing {
            Pointing::Absolute(_) => pen_meaning(*code).is_some(),
            _ => meaning(*code).is_some(),
        };
        let has_wheel = moves(Rel::REL_WHEEL) || moves(Rel::REL_WHEEL_HI_RES);
        let is_mouse = (moves(Rel::REL_X) && moves(Rel::REL_Y)) || has_wheel;
        let is_any = pointing != Pointing::Relative || is_mouse || abilities.keys.iter().any(means);
        is_any.then_some(Profile { pointing, has_fine_wheel: moves(Rel::REL_WHEEL_HI_RES) })
    }
}

/// What a key code of the kernel stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Key(Key),
    Button(Button),
    Shift,
    Control,
    Alt,
}

impl Meaning {
    pub(super) fn is_modifier(self) -> bool {
        matches!(self, Meaning::Shift | Meaning::Control | Meaning::Alt)
    }
}

/// Keys with consecutive codes, from the first code.
const ROWS: [(KeyCode, &str); 5] = [
    (KeyCode::KEY_1, "1234567890-="),
    (KeyCode::KEY_Q, "qwertyuiop[]"),
    (KeyCode::KEY_A, "asdfghjkl;'`"),
    (KeyCode::KEY_BACKSLASH, "\\zxcvbnm,./"),
    (KeyCode::KEY_KP7, "789-456+1230."),
];

/// What a key code stands for; None if it is not used.
pub(super) fn meaning(code: u16) -> Option<Meaning> {
    let in_row = |(first, keys): &(KeyCode, &str)| {
        let place = code.checked_sub(first.0)?;
        keys.chars().nth(usize::from(place)).map(Key::Char)
    };
    if let Some(key) = ROWS.iter().find_map(in_row) {
        return Some(Meaning::Key(key));
    }
    let key = match KeyCode(code) {
        KeyCode::KEY_LEFTSHIFT | KeyCode::KEY_RIGHTSHIFT => return Some(Meaning::Shift),
        KeyCode::KEY_LEFTCTRL | KeyCode::KEY_RIGHTCTRL => return Some(Meaning::Control),
        KeyCode::KEY_LEFTALT | KeyCode::KEY_RIGHTALT => return Some(Meaning::Alt),
        KeyCode::BTN_LEFT => return Some(Meaning::Button(Button::Left)),
        KeyCode::BTN_RIGHT => return Some(Meaning::Button(Button::Right)),
        KeyCode::BTN_MIDDLE => return Some(Meaning::Button(Button::Middle)),
        KeyCode::KEY_ESC => Key::Escape,
        KeyCode::KEY_ENTER | KeyCode::KEY_KPENTER => Key::Enter,
        KeyCode::KEY_TAB => Key::Tab,
        KeyCode::KEY_SPACE => Key::Space,
        KeyCode::KEY_BACKSPACE => Key::Backspace,
        KeyCode::KEY_DELETE => Key::Delete,
        KeyCode::KEY_LEFT => Key::Left,
        KeyCode::KEY_RIGHT => Key::Right,
        KeyCode::KEY_UP => Key::Up,
        KeyCode::KEY_DOWN => Key::Down,
        KeyCode::KEY_PAGEUP => Key::PageUp,
        KeyCode::KEY_PAGEDOWN => Key::PageDown,
        KeyCode::KEY_HOME => Key::Home,
        KeyCode::KEY_END => Key::End,
        KeyCode::KEY_102ND => Key::Char('<'),
        KeyCode::KEY_KPSLASH => Key::Char('/'),
        KeyCode::KEY_KPASTERISK => Key::Char('*'),
        KeyCode::KEY_F11 => Key::Function(11),
        KeyCode::KEY_F12 => Key::Function(12),
        KeyCode(f) if (KeyCode::KEY_F1.0..=KeyCode::KEY_F10.0).contains(&f) => {
            Key::Function((f - KeyCode::KEY_F1.0 + 1) as u8)
        }
        _ => return None,
    };
    Some(Meaning::Key(key))
}

/// What a key code of a tablet stands for, on which the pen has the buttons; None if it is not used.
pub(super) fn pen_meaning(code: u16) -> Option<Meaning> {
    match KeyCode(code) {
        KeyCode::BTN_TOUCH => Some(Meaning::Button(Button::Left)),
        KeyCode::BTN_STYLUS => Some(Meaning::Button(Button::Right)),
        KeyCode::BTN_STYLUS2 => Some(Meaning::Button(Button::Middle)),
        _ => meaning(code),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::KEY_BINDINGS;

    fn can(keys: &[KeyCode], relative: &[Rel], absolute: &[Abs], is_direct: bool) -> Abilities {
        Abilities {
            keys: keys.iter().map(|k| k.0).collect(),
            relative: relative.iter().map(|r| r.0).collect(),
            absolute: absolute.iter().map(|a| (a.0, Span { low: 0, high: 4095 })).collect(),
            is_direct,
            is_accelerometer: false,
        }
    }

    #[test]
    fn every_kind_of_device_is_classified() {
        use KeyCode as K;
        let spans = [Span { low: 0, high: 4095 }; 2];
        let (xy, slots) =
            ([Abs::ABS_X, Abs::ABS_Y], [Abs::ABS_MT_SLOT, Abs::ABS_MT_POSITION_X, Abs::ABS_MT_POSITION_Y]);
        let both = [&xy[..], &slots[..]].concat();
        let pad = [K::BTN_LEFT, K::BTN_TOUCH, K::BTN_TOOL_FINGER, K::BTN_TOOL_DOUBLETAP];
        for (what, abilities, pointing) in [
            ("keyboard", can(&[K::KEY_A, K::KEY_ENTER], &[], &[], false), Some(Pointing::Relative)),
            ("pedal", can(&[K::KEY_B], &[], &[], false), Some(Pointing::Relative)),
            ("mouse", can(&[K::BTN_LEFT], &[Rel::REL_X, Rel::REL_Y], &[], false), Some(Pointing::Relative)),
            ("wheel", can(&[], &[Rel::REL_WHEEL], &[], false), Some(Pointing::Relative)),
            ("QEMU's tablet", can(&[K::BTN_LEFT], &[Rel::REL_WHEEL], &xy, false), Some(Pointing::Absolute(spans))),
            ("pen", can(&[K::BTN_TOOL_PEN, K::BTN_TOUCH], &[], &xy, true), Some(Pointing::Absolute(spans))),
            ("touch pad", can(&pad, &[], &both, false), Some(Pointing::Pad(spans))),
            ("touch screen", can(&[K::BTN_TOUCH], &[], &both, true), Some(Pointing::Fingers(spans))),
            ("touch screen of one finger", can(&[K::BTN_TOUCH], &[], &xy, false), Some(Pointing::Finger(spans))),
            (
                "touch screen without slots",
                can(&[K::BTN_TOUCH], &[], &[&xy[..], &slots[1..]].concat(), true),
                Some(Pointing::Finger(spans)),
            ),
            ("joystick", can(&[K::BTN_TRIGGER], &[], &xy, false), None),
            ("power button", can(&[K::KEY_POWER], &[], &[], false), None),
            ("nothing", Abilities::default(), None),
            ("accelerometer", Abilities { is_accelerometer: true, ..can(&[K::KEY_A], &[], &xy, false) }, None),
        ] {
            assert_eq!(Profile::of(&abilities).map(|p| p.pointing), pointing, "{what}");
        }
    }

    #[test]
    fn an_axis_without_length_is_ignored() {
        let mut flat = can(&[KeyCode::BTN_TOUCH], &[], &[Abs::ABS_X, Abs::ABS_Y], true);
        flat.absolute.insert(Abs::ABS_Y.0, Span { low: 7, high: 7 });
        assert_eq!(Profile::of(&flat), None);
        let odd = Span { low: i32::MAX, high: i32::MIN };
        assert!((0.0..=1.0).contains(&odd.fraction(0)));
    }

    #[test]
    fn every_bound_key_has_a_code() {
        let known: Vec<Meaning> = (0..=u16::MAX).filter_map(meaning).collect();
        for binding in KEY_BINDINGS {
            // Plus is on the number pad, and on the key of the equals sign with shift.
            assert!(known.contains(&Meaning::Key(binding.key)), "{:?}", binding.key);
        }
    }

    #[test]
    fn rows_end_where_their_keys_do() {
        for (code, key) in [
            (KeyCode::KEY_EQUAL, Some('=')),
            (KeyCode::KEY_RIGHTBRACE, Some(']')),
            (KeyCode::KEY_L, Some('l')),
            (KeyCode::KEY_GRAVE, Some('`')),
            (KeyCode::KEY_Z, Some('z')),
            (KeyCode::KEY_SLASH, Some('/')),
            (KeyCode::KEY_KPDOT, Some('.')),
            (KeyCode::KEY_KPPLUS, Some('+')),
            (KeyCode::KEY_SYSRQ, None),
            (KeyCode::KEY_POWER, None),
        ] {
            assert_eq!(meaning(code.0), key.map(|c| Meaning::Key(Key::Char(c))), "{code:?}");
        }
        assert_eq!(meaning(KeyCode::KEY_F10.0), Some(Meaning::Key(Key::Function(10))));
    }
}
