//! What hands do, whatever told of it: a window, or input devices where there is none. Places are in pixels from the upper left corner.

pub use crate::kiosk::chord::{Key, Modifiers};

/// Something that was done by hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// The pointer is here now.
    Moved([f64; 2]),
    Button {
        button: Button,
        pressed: bool,
    },
    /// Notches of the wheel, away from the user positive.
    Scroll(f64),
    /// A key went down (again and again while it is held) or up.
    Key {
        key: Key,
        pressed: bool,
    },
    /// Which of them are held from here on.
    Modifiers(Modifiers),
    Touch {
        finger: u64,
        phase: Phase,
        at: [f64; 2],
    },
    /// The pointer left, or another window is typed into: nothing is held any more.
    Left,
}

/// No window is as wide, pixels: drivers that say so are not believed.
pub const FAR: f64 = 1e6;
/// Notches of the wheel at once.
pub const MOST_NOTCHES: f64 = 20.0;

impl Input {
    /// The same with numbers that a window and a wheel may have; nothing where there is no such place.
    pub fn believed(self) -> Option<Input> {
        let is_near = |at: [f64; 2]| at.iter().all(|n| n.abs() <= FAR);
        match self {
            Input::Moved(at) | Input::Touch { at, .. } if !is_near(at) => None,
            Input::Scroll(notches) if notches.is_nan() => None,
            Input::Scroll(notches) => Some(Input::Scroll(notches.clamp(-MOST_NOTCHES, MOST_NOTCHES))),
            other => Some(other),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    Left,
    Right,
    Middle,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    Down,
    Moved,
    Up,
    /// The finger is taken for something else, such as a palm.
    Gone,
}
