//! User input, from a window or from input devices. Positions are in pixels from the upper left corner.

pub use crate::kiosk::chord::{Key, Modifiers};

/// One input event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// New position of the pointer.
    Moved([f64; 2]),
    Button {
        button: Button,
        pressed: bool,
    },
    /// Notches of the wheel; positive is away from the user.
    Scroll(f64),
    /// A key went down (repeatedly while it is held) or up.
    Key {
        key: Key,
        pressed: bool,
    },
    /// The modifiers that are held from now on.
    Modifiers(Modifiers),
    Touch {
        finger: u64,
        phase: Phase,
        at: [f64; 2],
    },
    /// The pointer left, or the window lost the focus: nothing is held any more.
    FocusLost,
}

/// Largest coordinate that is accepted, pixels. No window is this large; some drivers report such values.
const MAX_COORDINATE: f64 = 1e6;
/// Largest number of wheel notches in one event.
const MAX_NOTCHES: f64 = 20.0;

impl Input {
    /// The event with its numbers limited to what a window and a wheel can produce; none if the position is out of range or not a number.
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

/// The phase of a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Down,
    Moved,
    Up,
    /// The touch turned out to be something else, such as a palm.
    Cancelled,
}
