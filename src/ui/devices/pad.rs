//! A touch pad: one finger moves the pointer, two are a wheel. Its buttons are pressed, not tapped.

use super::profile::Span;
use evdev::KeyCode;

/// Notches of the wheel for two fingers all the way down.
const NOTCHES: f64 = 30.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Moved {
    /// The pointer, in widths of the pad.
    By([f64; 2]),
    /// Notches of the wheel.
    Scrolled(f64),
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Pad {
    raw: [Option<i32>; 2],
    /// Where the fingers were before.
    last: Option<[i32; 2]>,
    is_touched: bool,
    /// More than one finger.
    are_several: bool,
}

impl Pad {
    pub fn place(&mut self, axis: usize, value: i32) {
        if let Some(raw) = self.raw.get_mut(axis) {
            *raw = Some(value);
        }
    }

    /// Whether something touches it, and how many.
    pub fn key(&mut self, code: u16, is_down: bool) {
        match KeyCode(code) {
            KeyCode::BTN_TOUCH => self.is_touched = is_down,
            KeyCode::BTN_TOOL_DOUBLETAP
            | KeyCode::BTN_TOOL_TRIPLETAP
            | KeyCode::BTN_TOOL_QUADTAP
            | KeyCode::BTN_TOOL_QUINTTAP => self.are_several = is_down,
            KeyCode::BTN_TOOL_FINGER => {}
            _ => return,
        }
        // With another finger the place is another's.
        self.last = None;
    }

    /// What the values since the last time come to.
    pub fn tell(&mut self, spans: &[Span; 2]) -> Option<Moved> {
        let [Some(x), Some(y)] = self.raw else { return None };
        if !self.is_touched {
            return None;
        }
        let [from_x, from_y] = self.last.replace([x, y])?;
        // Both by the width: pads have square counts, and a circle has to stay one.
        let by = [[x, from_x], [y, from_y]].map(|[to, from]| (f64::from(to) - f64::from(from)) / spans[0].length());
        match (self.are_several, by) {
            (_, [0.0, 0.0]) => None,
            (false, by) => Some(Moved::By(by)),
            (true, [_, down]) => Some(Moved::Scrolled((-down * NOTCHES).clamp(-NOTCHES, NOTCHES))),
        }
    }
}
