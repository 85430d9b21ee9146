//! User input, from a window or from input devices. Positions are in pixels from the upper left corner.

pub use crate::kiosk::chord::{Key, Modifiers};

/// An input event of mouse, fingers or keyboard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// The pointer moved to this position, pixels of the window.
    Moved([f64; 2]),
    Button {
        button: Button,
        pressed: bool,
    },
    /// The wheel turned by this number of notches; positive is away from the user.
    Scroll(f64),
    /// A key was pressed (repeatedly while it is held) or released.
    Key {
        key: Key,
        pressed: bool,
    },
    /// These modifiers are held from now on.
    Modifiers(Modifiers),
    Touch {
        finger: u64,
        phase: Phase,
        at: [f64; 2],
    },
    /// The pointer left the window. Keys stay held, and a drag goes on: the window still gets the moves and the release of its button.
    PointerLeft,
    /// The window lost the focus: nothing counts as held any more.
    FocusLost,
}

/// Largest coordinate that is accepted, pixels. No window is this large; some drivers report such values.
const MAX_COORDINATE: f64 = 1e6;
/// Largest number of wheel notches in one event.
const MAX_NOTCHES: f64 = 20.0;

impl Input {
    /// The same event with numbers limited to what a window and a wheel can produce. None if a position is not a number or far outside.
    pub(super) fn sanitized(self) -> Option<Input> {
        let is_near = |at: [f64; 2]| at.iter().all(|n| n.abs() <= MAX_COORDINATE);
        match self {
            Input::Moved(at) | Input::Touch { at, .. } if !is_near(at) => None,
            Input::Scroll(notches) if notches.is_nan() => None,
            Input::Scroll(notches) => Some(Input::Scroll(notches.clamp(-MAX_NOTCHES, MAX_NOTCHES))),
            other => Some(other),
        }
    }
}

/// A mouse button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    Left,
    Right,
    Middle,
}

/// The phase of a touch by a finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Down,
    Moved,
    Up,
    /// The touch turned out to be something else, such as a palm.
    Cancelled,
}
