//! One device as the translator knows it: what it said since its last report, and what is held with it.

use super::fingers::{Area, Fingers};
use super::layout::{self, Meaning};
use super::pad::Pad;
use super::profile::{Pointing, Profile};
use crate::ui::input::Input;
use evdev::AbsoluteAxisCode as Abs;
use std::collections::BTreeSet;

/// ABS_MT_TOOL_TYPE of a palm.
const PALM: i32 = 2;

/// What a device says, in the kernel's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    pub kind: u16,
    pub code: u16,
    pub value: i32,
}

/// How a device stands, asked for and not told.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// That are down.
    pub keys: BTreeSet<u16>,
    /// ABS_X and ABS_Y.
    pub place: [Option<i32>; 2],
    /// ABS_MT_SLOT.
    pub slot: i32,
}

/// What came of a device's events.
pub struct Device {
    pub profile: Profile,
    /// Keys and buttons that went down here.
    pub held: BTreeSet<u16>,
    pub place: [Option<i32>; 2],
    pub fingers: Fingers,
    pub pad: Pad,
    pub since: Since,
    /// Events are missing up to the next report.
    pub is_torn: bool,
    /// They were missing: how it stands has to be asked for.
    pub is_behind: bool,
}

/// What was said since the last report.
#[derive(Default)]
pub struct Since {
    pub motion: [f64; 2],
    pub is_placed: bool,
    pub keys: Vec<(u16, i32)>,
    pub notches: f64,
}

impl Device {
    pub fn new(profile: Profile) -> Device {
        Device {
            profile,
            held: BTreeSet::new(),
            place: [None; 2],
            fingers: Fingers::default(),
            pad: Pad::default(),
            since: Since::default(),
            is_torn: false,
            is_behind: false,
        }
    }

    /// What a key or button of it means, if anything to us.
    pub fn meaning(&self, code: u16) -> Option<Meaning> {
        match self.profile.pointing {
            Pointing::Absolute(_) => layout::of_pen(code),
            _ => layout::meaning(code),
        }
    }

    /// How it stands now, whatever was said before. What it holds is left as it is.
    pub fn stand(&mut self, state: &State, area: &Area, out: &mut Vec<Input>) {
        (self.is_behind, self.is_torn, self.since) = (false, false, Since::default());
        self.fingers.drop(area, out);
        self.fingers.choose(if matches!(self.profile.pointing, Pointing::Fingers(_)) { state.slot } else { 0 });
        self.pad = Pad::default();
        state.keys.iter().for_each(|code| self.pad.key(*code, true));
        self.place = [None; 2];
        for (axis, value) in [Abs::ABS_X, Abs::ABS_Y].into_iter().zip(state.place) {
            if let Some(value) = value {
                self.axis(axis, value);
            }
        }
        self.since.is_placed = false;
    }

    pub fn axis(&mut self, axis: Abs, value: i32) {
        match (axis, &self.profile.pointing) {
            (Abs::ABS_X | Abs::ABS_Y, pointing) => {
                let axis = usize::from(axis == Abs::ABS_Y);
                self.place[axis] = Some(value);
                self.since.is_placed = true;
                self.pad.place(axis, value);
                if matches!(pointing, Pointing::Finger(_)) {
                    self.fingers.place(axis, value);
                }
            }
            (Abs::ABS_MT_SLOT, Pointing::Fingers(_)) => self.fingers.choose(value),
            (Abs::ABS_MT_TRACKING_ID, Pointing::Fingers(_)) => self.fingers.track(value),
            (Abs::ABS_MT_POSITION_X, Pointing::Fingers(_)) => self.fingers.place(0, value),
            (Abs::ABS_MT_POSITION_Y, Pointing::Fingers(_)) => self.fingers.place(1, value),
            (Abs::ABS_MT_TOOL_TYPE, Pointing::Fingers(_)) => self.fingers.palm(value == PALM),
            _ => {}
        }
    }
}
