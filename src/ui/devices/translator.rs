//! Translates the events of all devices into inputs. It knows devices only by number, so it is tested without hardware.

use super::keymap::{self, Meaning};
use super::profile::{Pointing, Profile};
use super::touch::{Area, Fingers, Moved, Pad};
use crate::ui::input::{Input, Modifiers};
use evdev::{AbsoluteAxisCode as Abs, EventType, KeyCode, RelativeAxisCode as Rel, SynchronizationCode};
use std::collections::{BTreeMap, BTreeSet};

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
            Pointing::Absolute(_) => keymap::of_pen(code),
            _ => keymap::meaning(code),
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
