//! Keyboards, mice and touch screens read from the kernel (evdev), for a machine without a windowing system. `reader` reads them,
//! `profile` classifies them and their keys, and `translator` converts their events to inputs.
//!
//! One thread waits for all devices and sends messages through a channel of bounded length. With a thread per device, the thread of an
//! idle device could not be ended and would hold its device. If devices were read between pictures, the kernel would drop events during
//! a slow picture. If the channel is full the thread waits; events that the kernel then drops are detected and resynchronised.

mod profile;
mod reader;
#[cfg(test)]
mod tests;
mod touch;
mod translator;

pub(super) use reader::DeviceMessage;

use super::input::Input;
use crate::gpu::Wake;
use crate::sync::locked;
use crate::texts;
use reader::OpenDevices;
use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};
use std::io;
use std::os::fd::OwnedFd;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval of the scans for new devices.
const SCAN_INTERVAL: Duration = Duration::from_secs(2);
/// Capacity of the channel: half a second of a fast mouse.
const MAX_QUEUED: usize = 512;

/// All input devices of this machine, read without a window system. Dropping it releases them.
pub struct Devices {
    /// `None` once the drop began, which ends a thread that waits for room in the channel.
    receiver: Option<Receiver<DeviceMessage>>,
    sender: SyncSender<DeviceMessage>,
    wake_pending: Arc<AtomicBool>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// State that is shared with the thread.
struct Shared {
    /// Size of the screen, pixels.
    size: Mutex<[u32; 2]>,
    ends: AtomicBool,
    /// Wakes the thread after a change of these fields.
    wake_event: OwnedFd,
}

impl Devices {
    /// Starts to read devices. `size`: that of the screen, pixels; `grab`: other programs, such as the text console, get no events.
    ///
    /// # Errors
    /// The thread cannot be started. Missing or unreadable devices are no error: they may appear later.
    pub fn open(size: [u32; 2], grab: bool) -> io::Result<Devices> {
        let mut devices = Devices::none()?;
        devices.resize(size);
        let (shared, sender) = (devices.shared.clone(), devices.sender.clone());
        let thread = std::thread::Builder::new().name("input".into());
        devices.thread = Some(thread.spawn(move || run_thread(&shared, grab, &sender))?);
        Ok(devices)
    }

    /// Reads no device: [`Devices::wait`] returns for its time and for [`Devices::wake`] alone.
    ///
    /// # Errors
    /// The system has no descriptor left.
    pub fn none() -> io::Result<Devices> {
        let (sender, receiver) = sync_channel(MAX_QUEUED);
        let wake_event = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
        let shared = Arc::new(Shared { size: Mutex::new([0; 2]), ends: AtomicBool::new(false), wake_event });
        Ok(Devices { receiver: Some(receiver), sender, wake_pending: Arc::default(), shared, thread: None })
    }

    /// A function that makes [`Devices::wait`] return.
    pub fn wake(&self) -> Wake {
        let (sender, wake_pending) = (self.sender.clone(), self.wake_pending.clone());
        Arc::new(move || {
            // One message is enough, and a full channel wakes the receiver anyway.
            if !wake_pending.swap(true, Ordering::AcqRel) {
                let _ = sender.try_send(DeviceMessage::Woken);
            }
        })
    }

    /// The messages since the last call. If there is none, waits for one until this time; `None`: without limit.
    pub fn wait(&self, until: Option<Instant>) -> Vec<DeviceMessage> {
        let Some(receiver) = &self.receiver else { return Vec::new() };
        let first = match until {
            Some(at) => receiver.recv_timeout(at.saturating_duration_since(Instant::now())),
            None => receiver.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        // Cleared before the messages are handled, so that no later wake is missed.
        self.wake_pending.swap(false, Ordering::AcqRel);
        first.into_iter().chain(receiver.try_iter().take(MAX_QUEUED)).collect()
    }

    /// Sets the size of the screen, pixels.
    pub fn resize(&self, size: [u32; 2]) {
        *locked(&self.shared.size) = size;
        self.shared.notify();
    }
}

impl Drop for Devices {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        self.receiver = None;
        self.shared.notify();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn notify(&self) {
        // A full counter also wakes the thread.
        let _ = rustix::io::write(&self.wake_event, &1u64.to_ne_bytes());
    }
}

/// The receiver is gone.
struct Stopped;

/// The thread. After a fault it starts again, so that a kiosk stays usable.
fn run_thread(shared: &Shared, grab: bool, sender: &SyncSender<DeviceMessage>) {
    let send = |message: DeviceMessage| if sender.send(message).is_ok() { Ok(()) } else { Err(Stopped) };
    while !shared.ends.load(Ordering::Acquire) {
        let fault = match catch_unwind(AssertUnwindSafe(|| read_devices(shared, grab, &send))) {
            Ok(Ok(Stopped)) => return,
            Ok(Err(fault)) => fault.to_string(),
            Err(_) => texts::WHY_DEVICES_LOST.into(),
        };
        // All devices are opened again.
        if send(DeviceMessage::Input(Input::FocusLost))
            .and_then(|()| send(DeviceMessage::Warning(texts::devices_lost(fault))))
            .is_err()
        {
            return;
        }
        let _ = wait(&mut [PollFd::new(&shared.wake_event, PollFlags::IN)], SCAN_INTERVAL);
    }
}

/// Reads all devices until the receiver is gone or the drop begins.
fn read_devices(
    shared: &Shared,
    grab: bool,
    send: &dyn Fn(DeviceMessage) -> Result<(), Stopped>,
) -> io::Result<Stopped> {
    let size = || *locked(&shared.size);
    let (mut opened, mut current_size) = (OpenDevices::new(size(), grab), size());
    let (mut next_scan, mut out) = (Instant::now(), Vec::new());
    while !shared.ends.load(Ordering::Acquire) {
        if next_scan <= Instant::now() {
            next_scan = Instant::now() + SCAN_INTERVAL;
            opened.scan(&mut out);
        }
        if size() != current_size {
            current_size = size();
            opened.resize(current_size);
        }
        let ready: Vec<usize> = {
            let wake_event = PollFd::new(&shared.wake_event, PollFlags::IN);
            let devices = opened.descriptors().map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN));
            let mut all: Vec<PollFd> = std::iter::once(wake_event).chain(devices).collect();
            // Messages of the scan are sent without waiting.
            let time =
                if out.is_empty() { next_scan.saturating_duration_since(Instant::now()) } else { Duration::ZERO };
            wait(&mut all, time)?;
            (0..all.len() - 1).filter(|n| !all[n + 1].revents().is_empty()).collect()
        };
        // Resets the counter; it never blocks.
        let _ = rustix::io::read(&shared.wake_event, &mut [0; 8]);
        // From the last one: removing a device shifts those behind it.
        ready.into_iter().rev().for_each(|place| opened.read(place, &mut out));
        if out.drain(..).try_for_each(send).is_err() {
            return Ok(Stopped);
        }
    }
    Ok(Stopped)
}

/// Waits for any of the descriptors, at most for this time.
fn wait(all: &mut [PollFd], time: Duration) -> io::Result<()> {
    let time = Timespec { tv_sec: time.as_secs().min(3600) as i64, tv_nsec: time.subsec_nanos().into() };
    match poll(all, Some(&time)) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(fault) => Err(fault.into()),
    }
}

#[cfg(test)]
mod thread_tests {
    use super::*;

    /// No device of this machine is grabbed.
    #[test]
    fn a_wait_is_woken_once_and_the_thread_ends() {
        let devices = Devices::open([100, 100], false).unwrap();
        let wake = devices.wake();
        (0..5000).for_each(|_| wake());
        let messages = devices.wait(None);
        assert_eq!(messages.iter().filter(|message| **message == DeviceMessage::Woken).count(), 1);
        wake();
        assert!(devices.wait(Some(Instant::now() + Duration::from_secs(60))).contains(&DeviceMessage::Woken));
        devices.wait(Some(Instant::now()));
        devices.resize([50, 50]);
        let begun = Instant::now();
        drop(devices);
        assert!(begun.elapsed() < SCAN_INTERVAL, "it does not wait for the next scan");
        wake();
    }
}
