//! Fingers on a touch screen and on a touch pad. A screen reports each finger in a slot whose values persist until the kernel changes
//! them (multi-touch protocol B); a screen for one finger has one slot. A pad moves the pointer with one finger and scrolls with two.

use super::profile::Span;
use crate::input::{Input, Phase};
use evdev::KeyCode;

/// Largest number of fingers.
const MAX_SLOTS: usize = 16;

/// Size of the screen, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Area(pub [u32; 2]);

impl Area {
    /// The position on the screen that is nearest to `at`, pixels.
    pub(super) fn clamp(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|n| at[n].clamp(0.0, f64::from(self.0[n].max(1)) - 1.0))
    }

    /// Converts values of the horizontal and the vertical axis to a position on the screen, pixels.
    pub(super) fn scaled(&self, raw: [i32; 2], spans: &[Span; 2]) -> [f64; 2] {
        self.clamp([0, 1].map(|n| spans[n].fraction(raw[n]) * (f64::from(self.0[n].max(1)) - 1.0)))
    }

    pub(super) fn centre(&self) -> [f64; 2] {
        self.0.map(|n| f64::from(n / 2))
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// The kernel's tracking ID of the finger.
    tracking_id: Option<i32>,
    /// Whether the finger is another one than the reported one.
    is_replaced: bool,
    is_palm: bool,
    /// The last values of the axes. They are kept when the finger is lifted, as the kernel does not repeat equal values for the next finger.
    raw: [Option<i32>; 2],
    /// The reported finger: its number in the inputs, and its position.
    reported: Option<(u64, [f64; 2])>,
}

/// The fingers on one touch screen, by slot of the kernel's protocol.
#[derive(Clone, Debug, Default)]
pub(super) struct Fingers {
    slots: [Slot; MAX_SLOTS],
    /// The slot to which values belong.
    current: usize,
}

impl Fingers {
    /// Selects the slot to which the following values belong. If the slot is invalid, they are ignored.
    pub(super) fn select_slot(&mut self, slot: i32) {
        self.current = usize::try_from(slot).unwrap_or(MAX_SLOTS);
    }

    /// Sets the tracking ID of the selected slot; a negative one means that the finger was lifted.
    pub(super) fn set_tracking_id(&mut self, number: i32) {
        let Some(slot) = self.slots.get_mut(self.current) else { return };
        let tracking_id = (number >= 0).then_some(number);
        if tracking_id != slot.tracking_id {
            (slot.tracking_id, slot.is_replaced, slot.is_palm) = (tracking_id, true, false);
        }
    }

    /// Sets a coordinate of the selected slot. `axis`: 0 horizontal, 1 vertical.
    pub(super) fn set_position(&mut self, axis: usize, value: i32) {
        if let Some(slot) = self.slots.get_mut(self.current) {
            slot.raw[axis] = Some(value);
        }
    }

    pub(super) fn set_palm(&mut self, is_palm: bool) {
        if let Some(slot) = self.slots.get_mut(self.current) {
            slot.is_palm = is_palm;
        }
    }

    /// Appends the touch inputs that follow from the values since the last call. `count`: number of fingers so far, on all devices, by which
    /// each gets its number.
    pub(super) fn report(&mut self, area: &Area, spans: &[Span; 2], count: &mut u64, out: &mut Vec<Input>) {
        for slot in &mut self.slots {
            if let Some((finger, at)) = slot.reported.take_if(|_| slot.is_replaced || slot.is_palm) {
                let phase = if slot.is_palm { Phase::Cancelled } else { Phase::Up };
                out.push(Input::Touch { finger, phase, at: area.clamp(at) });
            }
            slot.is_replaced = false;
            // A finger without a position is reported once it moves.
            let (Some(_), false, [Some(x), Some(y)]) = (slot.tracking_id, slot.is_palm, slot.raw) else { continue };
            let at = area.scaled([x, y], spans);
            match &mut slot.reported {
                None => {
                    *count += 1;
                    slot.reported = Some((*count, at));
                    out.push(Input::Touch { finger: *count, phase: Phase::Down, at });
                }
                Some((finger, last)) if *last != at => {
                    *last = at;
                    out.push(Input::Touch { finger: *finger, phase: Phase::Moved, at });
                }
                Some(_) => {}
            }
        }
    }

    /// Ends the touch of all fingers as cancelled. Those that still touch are ignored until they are lifted.
    pub(super) fn cancel_all(&mut self, area: &Area, out: &mut Vec<Input>) {
        for (finger, at) in self.slots.iter().filter_map(|slot| slot.reported) {
            out.push(Input::Touch { finger, phase: Phase::Cancelled, at: area.clamp(at) });
        }
        *self = Fingers { current: self.current, ..Fingers::default() };
    }
}

/// Notches of the wheel for two fingers from top to bottom.
const NOTCHES_PER_HEIGHT: f64 = 30.0;

/// What fingers did on a touch pad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PadMotion {
    /// They moved the pointer by these shares of the pad's width: right, down.
    Pointer([f64; 2]),
    /// They scrolled by this number of notches of a wheel.
    Scroll(f64),
}

/// The fingers on one touch pad. Its buttons have to be pressed: taps are ignored.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pad {
    raw: [Option<i32>; 2],
    /// The previous position.
    last: Option<[i32; 2]>,
    is_touched: bool,
    has_several_fingers: bool,
}

impl Pad {
    pub(super) fn set_position(&mut self, axis: usize, value: i32) {
        self.raw[axis] = Some(value);
    }

    /// Notes a key code that says whether fingers touch the pad, and how many.
    pub(super) fn set_key(&mut self, code: u16, is_down: bool) {
        match KeyCode(code) {
            KeyCode::BTN_TOUCH => self.is_touched = is_down,
            KeyCode::BTN_TOOL_DOUBLETAP
            | KeyCode::BTN_TOOL_TRIPLETAP
            | KeyCode::BTN_TOOL_QUADTAP
            | KeyCode::BTN_TOOL_QUINTTAP => self.has_several_fingers = is_down,
            KeyCode::BTN_TOOL_FINGER => {}
            _ => return,
        }
        // With another number of fingers the position jumps.
        self.last = None;
    }

    /// What fingers did since the last call; None if nothing.
    pub(super) fn report(&mut self, spans: &[Span; 2]) -> Option<PadMotion> {
        let [Some(x), Some(y)] = self.raw else { return None };
        if !self.is_touched {
            return None;
        }
        let [from_x, from_y] = self.last.replace([x, y])?;
        // Both axes are divided by the width: counts are square, and a circle must stay a circle.
        let by = [[x, from_x], [y, from_y]].map(|[to, from]| (f64::from(to) - f64::from(from)) / spans[0].length());
        match (self.has_several_fingers, by) {
            (_, [0.0, 0.0]) => None,
            (false, by) => Some(PadMotion::Pointer(by)),
            (true, [_, down]) => {
                Some(PadMotion::Scroll((-down * NOTCHES_PER_HEIGHT).clamp(-NOTCHES_PER_HEIGHT, NOTCHES_PER_HEIGHT)))
            }
        }
    }
}
