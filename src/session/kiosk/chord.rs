//! Key combinations as text, such as `ctrl+alt+q`.

use std::fmt;

/// Names of keys. The first name of a key is the one that is displayed. Function keys and characters need no entry.
const NAMES: &[(&str, Key)] = &[
    ("escape", Key::Escape),
    ("esc", Key::Escape),
    ("enter", Key::Enter),
    ("return", Key::Enter),
    ("tab", Key::Tab),
    ("space", Key::Space),
    ("backspace", Key::Backspace),
    ("delete", Key::Delete),
    ("del", Key::Delete),
    ("left", Key::Left),
    ("right", Key::Right),
    ("up", Key::Up),
    ("down", Key::Down),
    ("page_up", Key::PageUp),
    ("pageup", Key::PageUp),
    ("page_down", Key::PageDown),
    ("pagedown", Key::PageDown),
    ("home", Key::Home),
    ("end", Key::End),
    // The character itself separates keys.
    ("plus", Key::Char('+')),
];
/// Highest number of a function key.
const MAX_FUNCTION_KEY: u8 = 24;

/// A key by its label, independent of modifiers; letters are lower-case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Key {
    Char(char),
    Function(u8),
    Escape,
    Enter,
    Tab,
    Space,
    Backspace,
    Delete,
    Left,
    Right,
    Up,
    Down,
    PageUp,
    PageDown,
    Home,
    End,
}

/// The modifier keys that are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Modifiers {
    pub shift: bool,
    pub control: bool,
    pub alt: bool,
}

/// A key combination: a key with the modifiers that are held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Chord {
    pub key: Key,
    pub modifiers: Modifiers,
}

/// The reason why a text is not a key combination.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{fault}; examples of keys: ctrl+alt+q, shift+f12, escape (any of ctrl, alt and shift, then one key)")]
pub struct ChordError {
    fault: String,
}

impl Chord {
    /// Parses a key combination: words separated by `+`, in upper or lower case. `ctrl` (or `control`), `alt` and `shift` come first in any
    /// order, then the key: a character, `f1` to `f24`, or a name such as `escape`, `page_up` or `plus`.
    ///
    /// # Errors
    /// One line with the wrong word and examples.
    pub fn parse(text: &str) -> Result<Chord, ChordError> {
        let refuse = |fault: String| Err(ChordError { fault });
        let (held, last) = match text.rsplit_once('+') {
            Some((held, last)) => (held.split('+').collect(), last),
            None => (Vec::new(), text),
        };
        let mut modifiers = Modifiers::default();
        for word in held {
            let flag = match word.trim().to_lowercase().as_str() {
                "ctrl" | "control" => &mut modifiers.control,
                "alt" => &mut modifiers.alt,
                "shift" => &mut modifiers.shift,
                other => return refuse(format!("{other:?} is not a modifier key")),
            };
            if std::mem::replace(flag, true) {
                return refuse(format!("{:?} is given twice", word.trim()));
            }
        }
        match key(last.trim()) {
            Some(key) => Ok(Chord { key, modifiers }),
            None => refuse(format!("{:?} is not a key", last.trim())),
        }
    }

    /// True if `key` and `modifiers` are exactly this combination.
    pub fn is(&self, key: Key, modifiers: Modifiers) -> bool {
        *self == Chord { key, modifiers }
    }
}

fn key(word: &str) -> Option<Key> {
    let mut characters = word.chars();
    if let (Some(c), None) = (characters.next(), characters.next()) {
        // Keyboards report the lower-case label of the key. Some letters have no single lower-case character.
        let mut lower = c.to_lowercase();
        return match (lower.next(), lower.next()) {
            (Some(c), None) if !c.is_control() && !c.is_whitespace() => Some(Key::Char(c)),
            _ => None,
        };
    }
    let word = word.to_lowercase();
    if let Some((_, key)) = NAMES.iter().find(|(name, _)| *name == word) {
        return Some(*key);
    }
    let number = word.strip_prefix('f').filter(|n| n.bytes().all(|b| b.is_ascii_digit()))?;
    number.parse().ok().filter(|n| (1..=MAX_FUNCTION_KEY).contains(n)).map(Key::Function)
}

impl fmt::Display for Chord {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Modifiers { shift, control, alt } = self.modifiers;
        for (_, word) in [(control, "ctrl"), (alt, "alt"), (shift, "shift")].iter().filter(|(held, _)| *held) {
            write!(f, "{word}+")?;
        }
        match (self.key, NAMES.iter().find(|(_, key)| *key == self.key)) {
            (_, Some((name, _))) => write!(f, "{name}"),
            (Key::Function(n), None) => write!(f, "f{n}"),
            (Key::Char(c), None) => write!(f, "{c}"),
            // Every other key has a name; a test checks this.
            (other, None) => write!(f, "{other:?}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn keys_are_parsed() {
        let held = |control, alt, shift| Modifiers { control, alt, shift };
        for (text, key, modifiers) in [
            ("ctrl+alt+q", Key::Char('q'), held(true, true, false)),
            ("Alt + Control + Q", Key::Char('q'), held(true, true, false)),
            ("escape", Key::Escape, held(false, false, false)),
            ("shift+F12", Key::Function(12), held(false, false, true)),
            ("ctrl+plus", Key::Char('+'), held(true, false, false)),
            ("f", Key::Char('f'), held(false, false, false)),
            ("PageUp", Key::PageUp, held(false, false, false)),
            ("alt+Ä", Key::Char('ä'), held(false, true, false)),
        ] {
            let chord = Chord::parse(text).expect(text);
            assert_eq!(chord, Chord { key, modifiers }, "{text}");
            assert!(chord.is(key, modifiers) && !chord.is(key, held(true, true, true)));
        }
        assert_eq!(Chord::parse("SHIFT+ctrl+Del").expect("keys").to_string(), "ctrl+shift+delete");
    }

    #[test]
    fn a_wrong_key_is_named_in_one_line() {
        for (text, named) in [
            ("", "\"\" is not a key"),
            ("ctrl+", "\"\" is not a key"),
            ("ctrl+alt", "\"alt\" is not a key"),
            ("ctrl+ctrl+q", "twice"),
            ("super+q", "\"super\" is not a modifier key"),
            ("q+ctrl", "\"q\" is not a modifier key"),
            ("f0", "f0"),
            ("f25", "f25"),
            ("f+1", "\"f\""),
            ("ctrl+\n", "is not a key"),
            ("quit", "quit"),
        ] {
            let error = Chord::parse(text).expect_err(text).to_string();
            assert!(error.contains(named) && error.contains("ctrl+alt+q") && error.lines().count() == 1, "{error}");
        }
    }

    #[test]
    fn every_named_key_is_displayed_by_its_name() {
        for (_, key) in NAMES {
            let chord = Chord { key: *key, modifiers: Modifiers::default() };
            assert_eq!(Chord::parse(&chord.to_string()), Ok(chord));
        }
    }

    proptest! {
        #[test]
        fn a_displayed_combination_parses_to_itself(text in "\\PC{0,12}|((ctrl|alt|shift)\\+){0,3}(\\PC|f[0-9]{1,2}|home)") {
            if let Ok(chord) = Chord::parse(&text) {
                prop_assert_eq!(Chord::parse(&chord.to_string()), Ok(chord));
            }
        }
    }
}
