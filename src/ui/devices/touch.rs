//! Fingers on a touch screen and on a touch pad. A screen reports each finger in a slot whose values persist until the kernel changes
//! them (multi-touch protocol B); a screen for one finger has one slot. A pad moves the pointer with one finger and scrolls with two.

use super::profile::Span;
use crate::ui::input::{Input, Phase};
use evdev::KeyCode;

/// More fingers than this are not looked at.
const SLOTS: usize = 16;

/// The screen that is touched, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area(pub [u32; 2]);

impl Area {
    /// The place itself, or the nearest on the screen.
    pub fn inside(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|n| at[n].clamp(0.0, f64::from(self.0[n].max(1)) - 1.0))
    }

    pub fn scaled(&self, raw: [i32; 2], spans: &[Span; 2]) -> [f64; 2] {
        self.inside([0, 1].map(|n| spans[n].share(raw[n]) * (f64::from(self.0[n].max(1)) - 1.0)))
    }

    pub fn middle(&self) -> [f64; 2] {
        self.0.map(|n| f64::from(n / 2))
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    /// The kernel's number of the finger.
    tracked: Option<i32>,
    /// Another finger than the one that was told of.
    is_other: bool,
    is_palm: bool,
    /// Kept when the finger is lifted: what is the same for the next one is not said again.
    raw: [Option<i32>; 2],
    /// Our number of the finger, and where it was said to be.
    told: Option<(u64, [f64; 2])>,
}

#[derive(Clone, Debug, Default)]
pub struct Fingers {
    slots: [Slot; SLOTS],
    /// The one that values belong to.
    current: usize,
}

impl Fingers {
    /// Which slot values belong to from here on; one that is none takes them nowhere.
    pub fn choose(&mut self, slot: i32) {
        self.current = usize::try_from(slot).unwrap_or(SLOTS);
    }

    /// A finger comes to the slot, or leaves it (negative).
    pub fn track(&mut self, number: i32) {
        let Some(slot) = self.slots.get_mut(self.current) else { return };
        let tracked = (number >= 0).then_some(number);
        if tracked != slot.tracked {
            (slot.tracked, slot.is_other, slot.is_palm) = (tracked, true, false);
        }
    }

    /// `axis`: 0 across, 1 down.
    pub fn place(&mut self, axis: usize, value: i32) {
        let raw = self.slots.get_mut(self.current).and_then(|slot| slot.raw.get_mut(axis));
        if let Some(raw) = raw {
            *raw = Some(value);
        }
    }

    pub fn palm(&mut self, is_palm: bool) {
        if let Some(slot) = self.slots.get_mut(self.current) {
            slot.is_palm = is_palm;
        }
    }

    /// What the values since the last time come to. `count`: fingers so far, of all devices.
    pub fn tell(&mut self, area: &Area, spans: &[Span; 2], count: &mut u64, out: &mut Vec<Input>) {
        for slot in &mut self.slots {
            if let Some((finger, at)) = slot.told.take_if(|_| slot.is_other || slot.is_palm) {
                let phase = if slot.is_palm { Phase::Gone } else { Phase::Up };
                out.push(Input::Touch { finger, phase, at: area.inside(at) });
            }
            slot.is_other = false;
            // A finger whose place is not known yet comes when it is: at its first movement.
            let (Some(_), false, [Some(x), Some(y)]) = (slot.tracked, slot.is_palm, slot.raw) else { continue };
            let at = area.scaled([x, y], spans);
            match &mut slot.told {
                None => {
                    *count += 1;
                    slot.told = Some((*count, at));
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

    /// All of them are gone, whatever they did. Those that still touch are not known again before they are lifted.
    pub fn drop(&mut self, area: &Area, out: &mut Vec<Input>) {
        for (finger, at) in self.slots.iter().filter_map(|slot| slot.told) {
            out.push(Input::Touch { finger, phase: Phase::Gone, at: area.inside(at) });
        }
        *self = Fingers { current: self.current, ..Fingers::default() };
    }
}

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
