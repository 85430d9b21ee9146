//! What devices say, as what hands do. It knows no device, only numbers that stand for them.

use super::device::{Device, Event, Since, State};
use super::fingers::Area;
use super::layout::Meaning;
use super::pad::Moved;
use super::profile::{Pointing, Profile};
use crate::ui::input::{Input, Modifiers};
use evdev::{AbsoluteAxisCode as Abs, EventType, KeyCode, RelativeAxisCode as Rel, SynchronizationCode};
use std::collections::BTreeMap;

/// Of a wheel that says parts of notches.
const PARTS: f64 = 120.0;
/// Keys between two reports; more are told before the report comes.
const MOST_KEYS: usize = 64;

/// What all devices do together: one pointer, one set of modifiers.
pub struct Translator {
    area: Area,
    pointer: [f64; 2],
    /// Whoever listens knows where the pointer is.
    is_told: bool,
    modifiers: Modifiers,
    devices: BTreeMap<u32, Device>,
    fingers: u64,
}

impl Translator {
    /// `size`: of the screen, pixels.
    pub fn new(size: [u32; 2]) -> Translator {
        let area = Area(size);
        let pointer = area.inside(area.middle());
        let (modifiers, devices) = (Modifiers::default(), BTreeMap::new());
        Translator { area, pointer, is_told: false, modifiers, devices, fingers: 0 }
    }

    /// The screen has this size from here on, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.area = Area(size);
        self.pointer = self.area.inside(self.pointer);
        self.is_told = false;
    }

    /// A device that is there from here on. Of what is down already only modifiers count: nobody saw the rest go down.
    pub fn add(&mut self, number: u32, profile: Profile, state: &State, out: &mut Vec<Input>) {
        self.remove(number, out);
        self.devices.insert(number, Device::new(profile));
        self.resync(number, state, out);
    }

    /// A device that is gone: what was held with it is held no more.
    pub fn remove(&mut self, number: u32, out: &mut Vec<Input>) {
        let Some(mut device) = self.devices.remove(&number) else { return };
        device.fingers.drop(&self.area, out);
        let is_held = device.held.iter().any(|code| device.meaning(*code).is_some_and(|held| !held.is_modifier()));
        if is_held {
            // A button that was let go would be a click.
            out.push(Input::Left);
            (self.is_told, self.modifiers) = (false, Modifiers::default());
        }
        self.tell_modifiers(out);
    }

    /// Whether events of a device were lost: [`Translator::resync`] goes on.
    pub fn is_behind(&self, number: u32) -> bool {
        self.devices.get(&number).is_some_and(|device| device.is_behind)
    }

    /// How a device stands after what was lost: what is up now is let go; fingers are gone.
    pub fn resync(&mut self, number: u32, state: &State, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get_mut(&number) else { return };
        device.stand(state, &self.area, out);
        let up: Vec<u16> = device.held.difference(&state.keys).copied().collect();
        let is_modifier = |code: &&u16| device.meaning(**code).is_some_and(Meaning::is_modifier);
        let down: Vec<u16> = state.keys.iter().filter(is_modifier).copied().collect();
        up.into_iter().for_each(|code| self.key(number, code, 0, out));
        down.into_iter().for_each(|code| self.key(number, code, 1, out));
    }

    pub fn event(&mut self, number: u32, event: Event, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get_mut(&number) else { return };
        let Event { kind, code, value } = event;
        let since = &mut device.since;
        match EventType(kind) {
            EventType::SYNCHRONIZATION => match SynchronizationCode(code) {
                SynchronizationCode::SYN_DROPPED => device.is_torn = true,
                SynchronizationCode::SYN_REPORT if device.is_torn => {
                    (device.is_torn, device.is_behind, device.since) = (false, true, Since::default());
                }
                SynchronizationCode::SYN_REPORT => self.report(number, out),
                _ => {}
            },
            _ if device.is_torn => {}
            EventType::KEY => {
                device.pad.key(code, value != 0);
                match (&device.profile.pointing, KeyCode(code)) {
                    (Pointing::Finger(_), KeyCode::BTN_TOUCH) => device.fingers.track(if value == 0 { -1 } else { 0 }),
                    _ if since.keys.len() < MOST_KEYS => since.keys.push((code, value)),
                    _ => {
                        let keys = std::mem::replace(&mut since.keys, vec![(code, value)]);
                        keys.into_iter().for_each(|(code, value)| self.key(number, code, value, out));
                    }
                }
            }
            EventType::RELATIVE => match Rel(code) {
                Rel::REL_X => since.motion[0] += f64::from(value),
                Rel::REL_Y => since.motion[1] += f64::from(value),
                // Those that say parts say whole notches too.
                Rel::REL_WHEEL if !device.profile.has_fine_wheel => since.notches += f64::from(value),
                Rel::REL_WHEEL_HI_RES => since.notches += f64::from(value) / PARTS,
                _ => {}
            },
            EventType::ABSOLUTE => device.axis(Abs(code), value),
            _ => {}
        }
    }

    /// What was said since the last report: where first, and then what was pressed there.
    fn report(&mut self, number: u32, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get_mut(&number) else { return };
        let Since { mut motion, is_placed, keys, mut notches } = std::mem::take(&mut device.since);
        let mut to = None;
        match (&device.profile.pointing, device.place) {
            (Pointing::Absolute(spans), [Some(x), Some(y)]) if is_placed => to = Some(self.area.scaled([x, y], spans)),
            (Pointing::Pad(spans), _) => match device.pad.tell(spans) {
                Some(Moved::By(by)) => [0, 1].iter().for_each(|n| motion[*n] += by[*n] * f64::from(self.area.0[0])),
                Some(Moved::Scrolled(by)) => notches += by,
                None => {}
            },
            _ => {}
        }
        let to = to.unwrap_or(self.pointer);
        self.point(self.area.inside([to[0] + motion[0], to[1] + motion[1]]), out);
        keys.into_iter().for_each(|(code, value)| self.key(number, code, value, out));
        if notches != 0.0 {
            self.tell_pointer(out);
            out.push(Input::Scroll(notches));
        }
        let before = out.len();
        if let Some(Device { profile, fingers, .. }) = self.devices.get_mut(&number)
            && let Pointing::Finger(spans) | Pointing::Fingers(spans) = &profile.pointing
        {
            fingers.tell(&self.area, spans, &mut self.fingers, out);
            // Panels take a finger for the pointer.
            self.is_told &= out.len() == before;
        }
    }

    fn point(&mut self, at: [f64; 2], out: &mut Vec<Input>) {
        if at != self.pointer {
            (self.pointer, self.is_told) = (at, false);
            self.tell_pointer(out);
        }
    }

    fn tell_pointer(&mut self, out: &mut Vec<Input>) {
        if !std::mem::replace(&mut self.is_told, true) {
            out.push(Input::Moved(self.pointer));
        }
    }

    fn key(&mut self, number: u32, code: u16, value: i32, out: &mut Vec<Input>) {
        let Some(device) = self.devices.get(&number) else { return };
        let Some(meaning) = device.meaning(code) else { return };
        let was_held = self.is_held(meaning);
        let Some(device) = self.devices.get_mut(&number) else { return };
        let is_news = match value {
            0 => device.held.remove(&code),
            1 => {
                device.held.insert(code);
                true
            }
            // Again, by itself; of a key that went down before we listened it says nothing.
            2 => device.held.contains(&code),
            _ => false,
        };
        if !is_news {
            return;
        }
        // The same key may be down elsewhere too: the last that comes up counts.
        let pressed = self.is_held(meaning);
        match meaning {
            Meaning::Key(key) if pressed == (value != 0) => out.push(Input::Key { key, pressed }),
            Meaning::Button(button) if pressed != was_held => {
                self.tell_pointer(out);
                out.push(Input::Button { button, pressed });
            }
            Meaning::Key(_) | Meaning::Button(_) => {}
            Meaning::Shift | Meaning::Control | Meaning::Alt => self.tell_modifiers(out),
        }
    }

    fn is_held(&self, wanted: Meaning) -> bool {
        self.devices.values().any(|d| d.held.iter().any(|code| d.meaning(*code) == Some(wanted)))
    }

    fn tell_modifiers(&mut self, out: &mut Vec<Input>) {
        let held = [Meaning::Shift, Meaning::Control, Meaning::Alt].map(|key| self.is_held(key));
        let modifiers = Modifiers { shift: held[0], control: held[1], alt: held[2] };
        if modifiers != self.modifiers {
            self.modifiers = modifiers;
            out.push(Input::Modifiers(modifiers));
        }
    }
}
