//! The devices that are open: those of /dev/input that mean something to us, as they come and go.

use super::profile::{Abilities, Profile, Span};
use super::translator::{Event, State, Translator};
use crate::ui::input::Input;
use evdev::raw_stream::RawDevice;
use evdev::{AbsoluteAxisCode as Abs, PropType};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

const FOLDER: &str = "/dev/input";
/// More are not opened.
const MOST: usize = 32;

/// What comes from devices, or from whoever woke us.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    Input(Input),
    /// Something is amiss.
    Note(String),
    Woken,
}

struct Reader {
    path: PathBuf,
    number: u32,
    device: RawDevice,
    grab: Grab,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Grab {
    /// When no key of it is down: one that went down for the text console has to come up for it too, or it repeats there for ever.
    Wanted,
    Had,
    NotWanted,
}

/// All that are open, and what they say.
pub struct Opened {
    readers: Vec<Reader>,
    translator: Translator,
    grab: bool,
    number: u32,
    /// Devices that mean nothing to us, by the number of their file: another may come under the same name.
    passed: BTreeMap<PathBuf, u64>,
    /// Those that could not be read the last time.
    refused: BTreeSet<PathBuf>,
    is_refusal_told: bool,
}

impl Opened {
    pub fn new(size: [u32; 2], grab: bool) -> Opened {
        Opened {
            readers: Vec::new(),
            translator: Translator::new(size),
            grab,
            number: 0,
            passed: BTreeMap::new(),
            refused: BTreeSet::new(),
            is_refusal_told: false,
        }
    }

    pub fn resize(&mut self, size: [u32; 2]) {
        self.translator.resize(size);
    }

    /// What to wait for, in the order in which [`Opened::read`] numbers them.
    pub fn waits(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.readers.iter().map(|reader| reader.device.as_fd())
    }

    /// Looks for devices that came. Those that went say so themselves.
    pub fn look(&mut self, out: &mut Vec<Told>) {
        // Without the folder there are none: a machine that nothing is plugged into.
        let listed = std::fs::read_dir(FOLDER).into_iter().flatten().flatten().map(|entry| entry.path());
        let is_event =
            |path: &PathBuf| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"event"));
        let there: BTreeSet<PathBuf> = listed.filter(is_event).take(8 * MOST).collect();
        self.passed.retain(|path, _| there.contains(path));
        let mut refused = BTreeSet::new();
        for path in there {
            if self.readers.len() >= MOST || self.readers.iter().any(|reader| reader.path == path) {
                continue;
            }
            let file = path.metadata().map_or(0, |file| file.ino());
            if self.passed.get(&path) == Some(&file) {
                continue;
            }
            match self.open(&path, out) {
                Ok(true) => {}
                Ok(false) => drop(self.passed.insert(path, file)),
                Err(fault) if fault.kind() == ErrorKind::PermissionDenied => drop(refused.insert(path)),
                Err(fault) => tracing::debug!("{}: {fault}", path.display()),
            }
        }
        // A device that has just come belongs to nobody for a moment.
        let still = refused.intersection(&self.refused).count();
        if still > 0 && !self.is_refusal_told {
            self.is_refusal_told = true;
            let text = format!(
                "{still} input devices cannot be read: this user is not in the group input (as root: usermod -aG input USER)"
            );
            out.push(Told::Note(text));
        }
        self.refused = refused;
    }

    /// False of a device that means nothing to us.
    fn open(&mut self, path: &Path, out: &mut Vec<Told>) -> io::Result<bool> {
        let device = RawDevice::open(path)?;
        let Some(profile) = Profile::of(&abilities(&device)?) else { return Ok(false) };
        let state = state(&device)?;
        self.number += 1;
        let name = device.name().unwrap_or("nameless").to_owned();
        tracing::info!("input: {} ({name})", path.display());
        let grab = if self.grab { Grab::Wanted } else { Grab::NotWanted };
        self.readers.push(Reader { path: path.to_owned(), number: self.number, device, grab });
        self.tell(out, |translator, number, inputs| translator.add(number, profile, &state, inputs), self.number);
        if let Some(reader) = self.readers.last_mut() {
            reader.grab(out);
        }
        Ok(true)
    }

    /// Reads what the device of this number among [`Opened::waits`] has; one that is gone is let go.
    pub fn read(&mut self, place: usize, out: &mut Vec<Told>) {
        let Some(reader) = self.readers.get_mut(place) else { return };
        let number = reader.number;
        let events: io::Result<Vec<Event>> = reader
            .device
            .fetch_events()
            .map(|events| events.map(|e| Event { kind: e.event_type().0, code: e.code(), value: e.value() }).collect());
        let read = events.and_then(|events| {
            for event in events {
                self.tell(out, |translator, number, inputs| translator.event(number, event, inputs), number);
                if self.translator.is_behind(number) {
                    let state = self.readers.get(place).map(|reader| state(&reader.device)).transpose()?;
                    let state = state.unwrap_or_default();
                    self.tell(out, |translator, number, inputs| translator.resync(number, &state, inputs), number);
                }
            }
            Ok(())
        });
        match read {
            Ok(()) => self.readers[place].grab(out),
            Err(fault) if matches!(fault.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {}
            // Unplugged, mostly; what is there still is found again at the next look.
            Err(fault) => self.let_go(place, &fault, out),
        }
    }

    /// Lets go of a device: it was unplugged.
    fn let_go(&mut self, place: usize, fault: &io::Error, out: &mut Vec<Told>) {
        let reader = self.readers.remove(place);
        tracing::info!("input: {} is gone ({fault})", reader.path.display());
        self.tell(out, |translator, number, inputs| translator.remove(number, inputs), reader.number);
    }

    fn tell(&mut self, out: &mut Vec<Told>, what: impl FnOnce(&mut Translator, u32, &mut Vec<Input>), number: u32) {
        let mut inputs = Vec::new();
        what(&mut self.translator, number, &mut inputs);
        out.extend(inputs.into_iter().map(Told::Input));
    }
}

impl Reader {
    /// Has it for us alone, as soon as that does no harm.
    fn grab(&mut self, out: &mut Vec<Told>) {
        let is_free = || self.device.get_key_state().is_ok_and(|down| down.iter().next().is_none());
        if self.grab != Grab::Wanted || !is_free() {
            return;
        }
        self.grab = Grab::Had;
        if let Err(fault) = self.device.grab() {
            self.grab = Grab::NotWanted;
            let (name, path) = (self.device.name().unwrap_or("nameless"), self.path.display());
            out.push(Told::Note(format!("{name} ({path}) cannot be had alone: {fault}")));
        }
    }
}

fn abilities(device: &RawDevice) -> io::Result<Abilities> {
    let absolute = device.get_absinfo()?.map(|(axis, i)| (axis.0, Span { low: i.minimum(), high: i.maximum() }));
    let keys = device.supported_keys().into_iter().flatten().map(|key| key.0);
    let relative = device.supported_relative_axes().into_iter().flatten().map(|axis| axis.0);
    Ok(Abilities {
        keys: keys.collect(),
        relative: relative.collect(),
        absolute: absolute.collect(),
        is_direct: device.properties().contains(PropType::DIRECT),
        is_accelerometer: device.properties().contains(PropType::ACCELEROMETER),
    })
}

fn state(device: &RawDevice) -> io::Result<State> {
    let mut state = State::default();
    if device.supported_keys().is_some() {
        state.keys = device.get_key_state()?.iter().map(|key| key.0).collect();
    }
    for (axis, value) in device.get_absinfo()?.map(|(axis, i)| (axis, i.value())) {
        match axis {
            Abs::ABS_X => state.place[0] = Some(value),
            Abs::ABS_Y => state.place[1] = Some(value),
            Abs::ABS_MT_SLOT => state.slot = value,
            _ => {}
        }
    }
    Ok(state)
}
