//! Translates the events of all devices into inputs. It knows devices only by number, so it is tested without hardware.

use super::profile::{self, Meaning, Pointing, Profile};
use super::touch::{Area, Fingers, Pad, PadMotion};
use crate::input::{Input, Modifiers};
use evdev::{AbsoluteAxisCode as Abs, EventType, KeyCode, RelativeAxisCode as Rel, SynchronizationCode};
use std::collections::{BTreeMap, BTreeSet};

/// Value of ABS_MT_TOOL_TYPE for a palm.
const PALM: i32 = 2;

/// An event of an input device, as the kernel reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Event {
    pub(super) kind: u16,
    pub(super) code: u16,
    pub(super) value: i32,
}

/// The present state of a device, as queried from the kernel.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// Key codes that are down.
    pub(super) keys: BTreeSet<u16>,
    /// Values of ABS_X and ABS_Y; None if the device has no such axis.
    pub(super) place: [Option<i32>; 2],
    /// Value of ABS_MT_SLOT: the slot to which the next values of fingers belong.
    pub(super) slot: i32,
}

/// What is known of a device from its events.
#[derive(Default)]
pub(super) struct Device {
    pub(super) profile: Profile,
    /// Codes of the keys and buttons of this device that are held.
    pub(super) held: BTreeSet<u16>,
    pub(super) place: [Option<i32>; 2],
    pub(super) fingers: Fingers,
    pub(super) pad: Pad,
    pub(super) pending: PendingReport,
    /// True if the rest of the current report is ignored, because the kernel dropped events.
    pub(super) skips_report: bool,
    /// True if the state of the device has to be queried, because the kernel dropped events.
    pub(super) needs_resync: bool,
}

/// The events since the last complete report of a device.
#[derive(Default)]
pub(super) struct PendingReport {
    pub(super) motion: [f64; 2],
    pub(super) has_position: bool,
    pub(super) keys: Vec<(u16, i32)>,
    pub(super) notches: f64,
}

impl Device {
    /// What a key or button of this device stands for; None if it is not used.
    pub(super) fn meaning(&self, code: u16) -> Option<Meaning> {
        match self.profile.pointing {
            Pointing::Absolute(_) => profile::pen_meaning(code),
            _ => profile::meaning(code),
        }
    }

    /// Sets the queried state. The keys that are held do not change.
    fn reset_to(&mut self, state: &State, area: &Area, out: &mut Vec<Input>) {
        (self.needs_resync, self.skips_report, self.pending) = (false, false, PendingReport::default());
        self.fingers.cancel_all(area, out);
        self.fingers.select_slot(if matches!(self.profile.pointing, Pointing::Fingers(_)) { state.slot } else { 0 });
        self.pad = Pad::default();
        state.keys.iter().for_each(|code| self.pad.set_key(*code, true));
        self.place = [None; 2];
        for (axis, value) in [Abs::ABS_X, Abs::ABS_Y].into_iter().zip(state.place) {
            if let Some(value) = value {
                self.axis(axis, value);
            }
        }
        self.pending.has_position = false;
    }

    pub(super) fn axis(&mut self, axis: Abs, value: i32) {
        match (axis, &self.profile.pointing) {
            (Abs::ABS_X | Abs::ABS_Y, pointing) => {
                let axis = usize::from(axis == Abs::ABS_Y);
                self.place[axis] = Some(value);
                self.pending.has_position = true;
                self.pad.set_position(axis, value);
                if matches!(pointing, Pointing::Finger(_)) {
                    self.fingers.set_position(axis, value);
                }
            }
            (Abs::ABS_MT_SLOT, Pointing::Fingers(_)) => self.fingers.select_slot(value),
            (Abs::ABS_MT_TRACKING_ID, Pointing::Fingers(_)) => self.fingers.set_tracking_id(value),
            (Abs::ABS_MT_POSITION_X, Pointing::Fingers(_)) => self.fingers.set_position(0, value),
            (Abs::ABS_MT_POSITION_Y, Pointing::Fingers(_)) => self.fingers.set_position(1, value),
            (Abs::ABS_MT_TOOL_TYPE, Pointing::Fingers(_)) => self.fingers.set_palm(value == PALM),
            _ => {}
        }
    }
}

/// Steps per notch of a wheel with high resolution.
const HIGH_RESOLUTION_STEPS: f64 = 120.0;
/// Keys between two reports; beyond these, keys are handled before the report ends.
const MAX_PENDING_KEYS: usize = 64;

/// Translates events of all devices to inputs. The devices share one pointer and one set of modifiers.
pub(super) struct Translator {
    area: Area,
    pointer: [f64; 2],
    /// Whether the current position of the pointer was sent.
    pointer_is_sent: bool,
    modifiers: Modifiers,
    devices: BTreeMap<u32, Device>,
    fingers: u64,
}

impl Translator {
    /// `size`: that of the screen, pixels.
    pub(super) fn new(size: [u32; 2]) -> Translator {
        let area = Area(size);
        let pointer = area.clamp(area.centre());
        let (modifiers, devices) = (Modifiers::default(), BTreeMap::new());
        Translator { area, pointer, pointer_is_sent: false, modifiers, devices, fingers: 0 }
    }

    /// Sets the size of the screen, pixels.
    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.area = Area(size);
        self.pointer = self.area.clamp(self.pointer);
        self.pointer_is_sent = false;
    }

    /// Adds a device with this number. Keys that are already down are ignored, except for modifiers.
    pub(super) fn add(&mut self, number: u32, profile: Profile, state: &State, out: &mut Vec<Input>) {
        self.remove(number, out);
        self.devices.insert(number, Device { profile, ..Device::default() });
        self.resync(number, state, out);
    }

    /// Removes the device with this number, and appends the inputs that release what it held.
    pub(super) fn remove(&mut self, number: u32, out: &mut Vec<Input>) {
        let Some(mut device) = self.devices.remove(&number) else { return };
        device.fingers.cancel_all(&self.area, out);
        let is_held = device.held.iter().any(|code| device.meaning(*code).is_some_and(|held| !held.is_modifier()));
        if is_held {
            // Releasing a button would be a click, so everything is cancelled.
            out.push(Input::FocusLost);
            (self.pointer_is_sent, self.modifiers) = (false, Modifiers::default());
        }
        self.send_modifiers(out);
    }

    /// True if events of the device were dropped, so that [`Translator::resync`] has to be called.
    pub(super) fn needs_resync(&self, number: u32) -> bool {
        self.devices.get(&number).is_some_and(|device| device.needs_resync)
    }

    /// Applies the queried state of a device after events were dropped: keys that are up are released, and fingers are cancelled.
    pub(super) fn resync(&mut self, number: u32, state: &State, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get_mut(&number) else { return };
        device.reset_to(state, &self.area, out);
        let up: Vec<u16> = device.held.difference(&state.keys).copied().collect();
        let is_modifier = |code: &&u16| device.meaning(**code).is_some_and(Meaning::is_modifier);
        let down: Vec<u16> = state.keys.iter().filter(is_modifier).copied().collect();
        up.into_iter().for_each(|code| self.key(number, code, 0, out));
        down.into_iter().for_each(|code| self.key(number, code, 1, out));
    }

    /// Translates an event of the device with this number and appends the inputs.
    pub(super) fn event(&mut self, number: u32, event: Event, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get_mut(&number) else { return };
        let Event { kind, code, value } = event;
        let pending = &mut device.pending;
        match EventType(kind) {
            EventType::SYNCHRONIZATION => match SynchronizationCode(code) {
                SynchronizationCode::SYN_DROPPED => device.skips_report = true,
                SynchronizationCode::SYN_REPORT if device.skips_report => {
                    (device.skips_report, device.needs_resync, device.pending) =
                        (false, true, PendingReport::default());
                }
                SynchronizationCode::SYN_REPORT => self.report(number, out),
                _ => {}
            },
            _ if device.skips_report => {}
            EventType::KEY => {
                device.pad.set_key(code, value != 0);
                match (&device.profile.pointing, KeyCode(code)) {
                    (Pointing::Finger(_), KeyCode::BTN_TOUCH) => {
                        device.fingers.set_tracking_id(if value == 0 { -1 } else { 0 })
                    }
                    _ if pending.keys.len() < MAX_PENDING_KEYS => pending.keys.push((code, value)),
                    _ => {
                        let keys = std::mem::replace(&mut pending.keys, vec![(code, value)]);
                        keys.into_iter().for_each(|(code, value)| self.key(number, code, value, out));
                    }
                }
            }
            EventType::RELATIVE => match Rel(code) {
                Rel::REL_X => pending.motion[0] += f64::from(value),
                Rel::REL_Y => pending.motion[1] += f64::from(value),
                // A wheel with high resolution also reports whole notches.
                Rel::REL_WHEEL if !device.profile.has_fine_wheel => pending.notches += f64::from(value),
                Rel::REL_WHEEL_HI_RES => pending.notches += f64::from(value) / HIGH_RESOLUTION_STEPS,
                _ => {}
            },
            EventType::ABSOLUTE => device.axis(Abs(code), value),
            _ => {}
        }
    }

    /// Ends a report: first the position, then what was pressed there.
    fn report(&mut self, number: u32, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get_mut(&number) else { return };
        let PendingReport { mut motion, has_position, keys, mut notches } = std::mem::take(&mut device.pending);
        let mut to = None;
        match (&device.profile.pointing, device.place) {
            (Pointing::Absolute(spans), [Some(x), Some(y)]) if has_position => {
                to = Some(self.area.scaled([x, y], spans))
            }
            (Pointing::Pad(spans), _) => match device.pad.report(spans) {
                Some(PadMotion::Pointer(by)) => {
                    [0, 1].iter().for_each(|n| motion[*n] += by[*n] * f64::from(self.area.0[0]))
                }
                Some(PadMotion::Scroll(by)) => notches += by,
                None => {}
            },
            _ => {}
        }
        let to = to.unwrap_or(self.pointer);
        self.move_pointer(self.area.clamp([to[0] + motion[0], to[1] + motion[1]]), out);
        keys.into_iter().for_each(|(code, value)| self.key(number, code, value, out));
        if notches != 0.0 {
            self.send_pointer(out);
            out.push(Input::Scroll(notches));
        }
        let before = out.len();
        if let Some(Device { profile, fingers, .. }) = self.devices.get_mut(&number)
            && let Pointing::Finger(spans) | Pointing::Fingers(spans) = &profile.pointing
        {
            fingers.report(&self.area, spans, &mut self.fingers, out);
            // Panels treat a finger as the pointer.
            self.pointer_is_sent &= out.len() == before;
        }
    }

    fn move_pointer(&mut self, at: [f64; 2], out: &mut Vec<Input>) {
        if at != self.pointer {
            (self.pointer, self.pointer_is_sent) = (at, false);
            self.send_pointer(out);
        }
    }

    fn send_pointer(&mut self, out: &mut Vec<Input>) {
        if !std::mem::replace(&mut self.pointer_is_sent, true) {
            out.push(Input::Moved(self.pointer));
        }
    }

    fn key(&mut self, number: u32, code: u16, value: i32, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get(&number) else { return };
        let Some(meaning) = device.meaning(code) else { return };
        let was_held = self.is_held(meaning);
        let Some(device) = self.devices.get_mut(&number) else { return };
        let is_change = match value {
            0 => device.held.remove(&code),
            1 => {
                device.held.insert(code);
                true
            }
            // A repetition; ignored for a key that was down before the device was opened.
            2 => device.held.contains(&code),
            _ => false,
        };
        if !is_change {
            return;
        }
        // The same key may be down on another device: it is up when all of them are.
        let pressed = self.is_held(meaning);
        match meaning {
            Meaning::Key(key) if pressed == (value != 0) => out.push(Input::Key { key, pressed }),
            Meaning::Button(button) if pressed != was_held => {
                self.send_pointer(out);
                out.push(Input::Button { button, pressed });
            }
            Meaning::Key(_) | Meaning::Button(_) => {}
            Meaning::Shift | Meaning::Control | Meaning::Alt => self.send_modifiers(out),
        }
    }

    fn is_held(&self, meaning: Meaning) -> bool {
        self.devices.values().any(|d| d.held.iter().any(|code| d.meaning(*code) == Some(meaning)))
    }

    fn send_modifiers(&mut self, out: &mut Vec<Input>) {
        let held = [Meaning::Shift, Meaning::Control, Meaning::Alt].map(|key| self.is_held(key));
        let modifiers = Modifiers { shift: held[0], control: held[1], alt: held[2] };
        if modifiers != self.modifiers {
            self.modifiers = modifiers;
            out.push(Input::Modifiers(modifiers));
        }
    }
}
