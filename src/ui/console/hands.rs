//! The keys that are held, the gestures of mice and fingers, and the pointer by keyboard.

use super::turntable::Turntable;
use crate::command::Command;
use crate::gestures::{self, Gestures};
use crate::input::{Input, Key};
use crate::keyboard_pointer::{KeyboardPointer, PictureArea, Pointed};
use crate::keys::HeldKeys;
use crate::picking::Viewport;

/// The state of the user's inputs: keys, gestures, and the pointer.
#[derive(Default)]
pub(super) struct Hands {
    pub(super) gestures: Gestures,
    pub(super) keys: HeldKeys,
    /// The pointer that keys move.
    pub(super) pointer: KeyboardPointer,
    /// What rotates the view in place of the user's hands.
    pub(super) turntable: Turntable,
}

impl Hands {
    /// The command that sets the position of a text that the user starts by typing.
    pub(super) fn place_of_text(&self, on: &Viewport) -> Option<Command> {
        gestures::place_of_text(on, self.gestures.pointer)
    }

    /// Position of an input, otherwise that of the pointer, pixels of the window; None if neither is known.
    pub(super) fn place(&self, input: &Input) -> Option<[f64; 2]> {
        match input {
            Input::Moved(at) | Input::Touch { at, .. } => Some(*at),
            _ => self.gestures.pointer,
        }
    }

    /// Turns moving the pointer by keys on or off. Returns the mouse inputs that stand for this.
    pub(super) fn toggle_pointer(&mut self, picture: PictureArea) -> Vec<Pointed> {
        self.pointer.toggle(self.gestures.pointer, picture)
    }

    /// The mouse inputs that a key stands for while the pointer is moved by keys; None if the key does not move it.
    pub(super) fn point(&mut self, key: Key, picture: PictureArea) -> Option<Vec<Pointed>> {
        self.pointer.key(key, &self.keys, picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Tool;
    use crate::input::Modifiers;
    use std::time::Duration;

    /// Prevents a pointer by keyboard that begins elsewhere than the mouse, and a shift key that counts for one of them only.
    #[test]
    fn the_pointer_by_keyboard_goes_on_from_the_mouse_with_the_keys_that_are_held() {
        let (mut hands, area) = (Hands::default(), ([0, 0], [200, 100]));
        let on = Viewport {
            corner: [0.0; 2],
            size: [200.0, 100.0],
            scene: None,
            volume: None,
            measures: &[],
            body_marks: &[],
            start_line: &[],
            has_work: false,
            is_covered: false,
            now: Duration::ZERO,
        };
        let moved = Input::Moved([40.0, 30.0]);
        hands.pointer.other_input(&moved);
        assert!(hands.gestures.input(&moved, &on, Tool::default(), Modifiers::default()).is_empty());
        assert_eq!(hands.place(&Input::FocusLost), Some([40.0, 30.0]));
        assert!(!hands.pointer.is_on && hands.point(Key::Right, area).is_none());
        let begun = hands.toggle_pointer(area);
        assert_eq!(begun, [(moved, Modifiers::default())]);
        let shift = Modifiers { shift: true, ..Modifiers::default() };
        assert_eq!(hands.keys.input(&Input::Modifiers(shift)), None);
        let pointed = hands.point(Key::Right, area).expect("a step");
        assert_eq!(pointed, [(Input::Moved([41.0, 30.0]), Modifiers::default())], "one pixel with Shift");
        assert_eq!(hands.point(Key::Space, area).map(|pointed| pointed.len()), Some(2));
        assert!(hands.pointer.is_on && hands.pointer.is_held());
    }
}
