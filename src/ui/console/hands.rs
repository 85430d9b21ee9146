//! The keys that are held, the gestures of mice and fingers, and the pointer by keyboard.

use crate::command::{Command, Tool};
use crate::gestures::{self, Gestures};
use crate::input::{Input, Key, Modifiers};
use crate::keyboard_pointer::{KeyboardPointer, PictureArea, Pointed, PointerMark};
use crate::keys::HeldKeys;
use crate::picking::Viewport;

/// The state of the user's inputs: keys, gestures, and the pointer.
#[derive(Default)]
pub(super) struct Hands {
    gestures: Gestures,
    keys: HeldKeys,
    pointer: KeyboardPointer,
}

impl Hands {
    pub(super) fn modifiers(&self) -> Modifiers {
        self.keys.modifiers()
    }

    /// Notes an input, whatever handles it.
    pub(super) fn see(&mut self, input: &Input) {
        self.pointer.other_input(input);
    }

    /// The command of a key that was pressed; None if it has none.
    pub(super) fn key(&mut self, input: &Input) -> Option<Command> {
        self.keys.input(input)
    }

    /// The commands that an input gives as part of a gesture on the picture.
    pub(super) fn gesture(&mut self, input: &Input, on: &Viewport, tool: Tool, modifiers: Modifiers) -> Vec<Command> {
        self.gestures.input(input, on, tool, modifiers)
    }

    /// The command that sets the position of a text that the user starts by typing.
    pub(super) fn place_of_text(&self, on: &Viewport) -> Option<Command> {
        gestures::place_of_text(on, self.gestures.pointer())
    }

    /// Position of an input, otherwise that of the pointer, pixels of the window; None if neither is known.
    pub(super) fn place(&self, input: &Input) -> Option<[f64; 2]> {
        match input {
            Input::Moved(at) | Input::Touch { at, .. } => Some(*at),
            _ => self.gestures.pointer(),
        }
    }

    /// True while the pointer is moved by keys.
    pub(super) fn points(&self) -> bool {
        self.pointer.is_on()
    }

    /// True while a key holds the pointer's button down, so that a drag may pause between two keys.
    pub(super) fn holds(&self) -> bool {
        self.pointer.is_held()
    }

    /// Turns moving the pointer by keys on or off. Returns the mouse inputs that stand for this.
    pub(super) fn toggle_pointer(&mut self, picture: PictureArea) -> Vec<Pointed> {
        self.pointer.toggle(self.gestures.pointer(), picture)
    }

    /// The mouse inputs that a key stands for while the pointer is moved by keys; None if the key does not move it.
    pub(super) fn point(&mut self, key: Key, picture: PictureArea) -> Option<Vec<Pointed>> {
        self.pointer.key(key, &self.keys, picture)
    }

    /// How the pointer that keys move is drawn; None while that is off.
    pub(super) fn mark(&self, picture: PictureArea) -> Option<PointerMark> {
        self.pointer.mark(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        hands.see(&moved);
        assert!(hands.gesture(&moved, &on, Tool::default(), Modifiers::default()).is_empty());
        assert_eq!(hands.place(&Input::FocusLost), Some([40.0, 30.0]));
        assert!(!hands.points() && hands.point(Key::Right, area).is_none());
        let begun = hands.toggle_pointer(area);
        assert_eq!(begun, [(moved, Modifiers::default())]);
        let shift = Modifiers { shift: true, ..Modifiers::default() };
        assert_eq!(hands.key(&Input::Modifiers(shift)), None);
        let pointed = hands.point(Key::Right, area).expect("a step");
        assert_eq!(pointed, [(Input::Moved([41.0, 30.0]), Modifiers::default())], "one pixel with Shift");
        assert_eq!(hands.point(Key::Space, area).map(|pointed| pointed.len()), Some(2));
        assert!(hands.points() && hands.holds());
    }
}
