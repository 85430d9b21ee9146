//! Opens and reads the devices in /dev/input that give inputs, as they appear and disappear.

use super::profile::{Abilities, Profile, Span};
use super::translator::{Event, State, Translator};
use crate::input::Input;
use crate::texts;
use evdev::raw_stream::RawDevice;
use evdev::{AbsoluteAxisCode as Abs, PropType};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

const FOLDER: &str = "/dev/input";
/// Largest number of open devices.
const MAX_DEVICES: usize = 32;

/// What [`Devices::wait`](super::Devices::wait) returns: an input, a warning, or a request to wake up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DeviceMessage {
    Input(Input),
    /// A fault of a device that the user has to know.
    Warning(String),
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
    /// Waits until no key is down: a key pressed in the text console must also be released there, or it repeats forever.
    Pending,
    Active,
    Off,
}

/// All open devices.
pub(super) struct OpenDevices {
    readers: Vec<Reader>,
    translator: Translator,
    grab: bool,
    number: u32,
    /// Devices that give no inputs, with the inode of their file, as another device may appear under the same name.
    ignored: BTreeMap<PathBuf, u64>,
    /// Devices that could not be read at the last scan.
    refused: BTreeSet<PathBuf>,
    refusal_is_reported: bool,
}

impl OpenDevices {
    pub(super) fn new(size: [u32; 2], grab: bool) -> OpenDevices {
        OpenDevices {
            readers: Vec::new(),
            translator: Translator::new(size),
            grab,
            number: 0,
            ignored: BTreeMap::new(),
            refused: BTreeSet::new(),
            refusal_is_reported: false,
        }
    }

    pub(super) fn resize(&mut self, size: [u32; 2]) {
        self.translator.resize(size);
    }

    /// The file descriptors to wait for. Their indices are those for [`OpenDevices::read`].
    pub(super) fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.readers.iter().map(|reader| reader.device.as_fd())
    }

    /// Opens devices that were plugged in since the last call. Unplugged ones are noticed when they are read.
    pub(super) fn scan(&mut self, out: &mut Vec<DeviceMessage>) {
        // Without the folder there are no devices.
        let listed = std::fs::read_dir(FOLDER).into_iter().flatten().flatten().map(|entry| entry.path());
        let is_event =
            |path: &PathBuf| path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"event"));
        let there: BTreeSet<PathBuf> = listed.filter(is_event).take(8 * MAX_DEVICES).collect();
        self.ignored.retain(|path, _| there.contains(path));
        let mut refused = BTreeSet::new();
        for path in there {
            if self.readers.len() >= MAX_DEVICES || self.readers.iter().any(|reader| reader.path == path) {
                continue;
            }
            let file = path.metadata().map_or(0, |file| file.ino());
            if self.ignored.get(&path) == Some(&file) {
                continue;
            }
            match self.open(&path, out) {
                Ok(true) => {}
                Ok(false) => drop(self.ignored.insert(path, file)),
                Err(fault) if fault.kind() == ErrorKind::PermissionDenied => drop(refused.insert(path)),
                Err(fault) => tracing::debug!("{}: {fault}", path.display()),
            }
        }
        // A new device has no permissions for a moment: report it at the second scan.
        let still = refused.intersection(&self.refused).count();
        if still > 0 && !self.refusal_is_reported {
            self.refusal_is_reported = true;
            out.push(DeviceMessage::Warning(texts::devices_not_read(still)));
        }
        self.refused = refused;
    }

    /// Opens a device. False if it gives no inputs.
    fn open(&mut self, path: &Path, out: &mut Vec<DeviceMessage>) -> io::Result<bool> {
        let device = RawDevice::open(path)?;
        let Some(profile) = Profile::of(&abilities(&device)?) else { return Ok(false) };
        let state = state(&device)?;
        self.number += 1;
        let name = device.name().unwrap_or("unnamed").to_owned();
        tracing::info!("input: {} ({name})", path.display());
        let grab = if self.grab { Grab::Pending } else { Grab::Off };
        let mut reader = Reader { path: path.to_owned(), number: self.number, device, grab };
        self.translate(out, |translator, inputs| translator.add(reader.number, profile, &state, inputs));
        reader.try_grab(out);
        self.readers.push(reader);
        Ok(true)
    }

    /// Reads the pending events of the device with this index in [`OpenDevices::descriptors`]. A device that is gone is removed.
    pub(super) fn read(&mut self, index: usize, out: &mut Vec<DeviceMessage>) {
        let Some(reader) = self.readers.get_mut(index) else { return };
        let number = reader.number;
        let events: io::Result<Vec<Event>> = reader
            .device
            .fetch_events()
            .map(|events| events.map(|e| Event { kind: e.event_type().0, code: e.code(), value: e.value() }).collect());
        let read = events.and_then(|events| {
            for event in events {
                self.translate(out, |translator, inputs| translator.event(number, event, inputs));
                if self.translator.needs_resync(number) {
                    let state = state(&self.readers[index].device)?;
                    self.translate(out, |translator, inputs| translator.resync(number, &state, inputs));
                }
            }
            Ok(())
        });
        match read {
            Ok(()) => self.readers[index].try_grab(out),
            Err(fault) if matches!(fault.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {}
            // Usually unplugged. If it is still there, the next scan opens it again.
            Err(fault) => {
                let reader = self.readers.remove(index);
                tracing::info!("input: {} is gone ({fault})", reader.path.display());
                self.translate(out, |translator, inputs| translator.remove(number, inputs));
            }
        }
    }

    fn translate(&mut self, out: &mut Vec<DeviceMessage>, what: impl FnOnce(&mut Translator, &mut Vec<Input>)) {
        let mut inputs = Vec::new();
        what(&mut self.translator, &mut inputs);
        out.extend(inputs.into_iter().map(DeviceMessage::Input));
    }
}

impl Reader {
    /// Grabs the device exclusively, as soon as no key is down.
    fn try_grab(&mut self, out: &mut Vec<DeviceMessage>) {
        let is_free = || self.device.get_key_state().is_ok_and(|down| down.iter().next().is_none());
        if self.grab != Grab::Pending || !is_free() {
            return;
        }
        self.grab = Grab::Active;
        if let Err(fault) = self.device.grab() {
            self.grab = Grab::Off;
            let (name, path) = (self.device.name().unwrap_or("unnamed"), self.path.display());
            out.push(DeviceMessage::Warning(texts::device_not_grabbed(name, path, fault)));
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
