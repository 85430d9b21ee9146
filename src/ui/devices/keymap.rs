//! The meaning of key codes: by position on a US keyboard, independent of the layout in use. A number pad always gives numbers.

use crate::ui::input::{Button, Key};
use evdev::KeyCode;

/// The meaning of a key code.
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

/// The meaning of a key code, if it has one here.
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

/// The meaning of a key code on a tablet, where the pen has the buttons.
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
    use crate::ui::keys::KEY_BINDINGS;

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
