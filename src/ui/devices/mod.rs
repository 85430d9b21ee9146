//! Keyboards, mice and touch screens straight from the kernel (evdev), where there is no windowing system. [`translator`] makes inputs
//! of what they say, [`profile`] knows what each is, [`reader`] reads them.
//!
//! One thread waits for all of them at once and for the clock, and hands on what they do through a channel of bounded length. Were it a
//! thread for each, one that nobody touches could not be ended, and would hold its device as long as the program lives; were they read
//! between pictures, the kernel would drop a gesture whenever one takes long. Where the channel is full the thread waits, and what the
//! kernel then drops is known as lost.

mod keymap;
mod profile;
mod reader;
#[cfg(test)]
mod tests;
mod touch;
mod translator;

pub use reader::Told;

use super::input::Input;
use crate::gpu::Wake;
use reader::Opened;
use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};
use std::io;
use std::os::fd::OwnedFd;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Between two looks for devices that came.
const LOOK: Duration = Duration::from_secs(2);
/// What may wait to be asked for: half a second of a quick mouse.
const MOST: usize = 512;

/// All input devices of this machine, until it is dropped.
pub struct Devices {
    /// None once nobody listens any more, which ends a thread that waits for room.
    told: Option<Receiver<Told>>,
    sender: SyncSender<Told>,
    is_woken: Arc<AtomicBool>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread is told.
struct Shared {
    /// Of the screen, pixels.
    size: Mutex<[u32; 2]>,
    ends: AtomicBool,
    /// Something of the above is new.
    rouse: OwnedFd,
}

impl Devices {
    /// Begins to listen. `size`: of the screen, pixels; `grab`: nobody else gets what they say, such as a text console behind.
    ///
    /// # Errors
    /// A machine that has no room for another thread. That there is no device, or none may be read, is no error: they may come.
    pub fn listen(size: [u32; 2], grab: bool) -> io::Result<Devices> {
        let (sender, told) = sync_channel(MOST);
        let rouse = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
        let shared = Arc::new(Shared { size: Mutex::new(size), ends: AtomicBool::new(false), rouse });
        let (theirs, tells) = (shared.clone(), sender.clone());
        let thread = std::thread::Builder::new().name("input".into()).spawn(move || serve(&theirs, grab, &tells))?;
        Ok(Devices { told: Some(told), sender, is_woken: Arc::default(), shared, thread: Some(thread) })
    }

    /// Ends a [`Devices::wait`].
    pub fn wake(&self) -> Wake {
        let (sender, is_woken) = (self.sender.clone(), self.is_woken.clone());
        Arc::new(move || {
            // One is as good as many, and where there is no room there is enough to wake for.
            if !is_woken.swap(true, Ordering::AcqRel) {
                let _ = sender.try_send(Told::Woken);
            }
        })
    }

    /// What was told since the last time, waiting for anything until then; without a time as long as it takes.
    pub fn wait(&self, until: Option<Instant>) -> Vec<Told> {
        let Some(told) = &self.told else { return Vec::new() };
        let first = match until {
            Some(at) => told.recv_timeout(at.saturating_duration_since(Instant::now())),
            None => told.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        // Before what it is about is looked at.
        self.is_woken.swap(false, Ordering::AcqRel);
        first.into_iter().chain(told.try_iter().take(MOST)).collect()
    }

    /// The screen has this size from here on, pixels.
    pub fn resize(&self, size: [u32; 2]) {
        *self.shared.size.lock().unwrap_or_else(PoisonError::into_inner) = size;
        self.shared.rouse();
    }
}

impl Drop for Devices {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Release);
        self.told = None;
        self.shared.rouse();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn rouse(&self) {
        // A counter that is full rouses as well.
        let _ = rustix::io::write(&self.rouse, &1u64.to_ne_bytes());
    }
}

/// Nobody listens any more.
struct Over;

/// The thread: a kiosk goes on without hands no longer than it must.
fn serve(shared: &Shared, grab: bool, sender: &SyncSender<Told>) {
    let tell = |told: Told| if sender.send(told).is_ok() { Ok(()) } else { Err(Over) };
    while !shared.ends.load(Ordering::Acquire) {
        let fault = match catch_unwind(AssertUnwindSafe(|| follow(shared, grab, &tell))) {
            Ok(Ok(Over)) => return,
            Ok(Err(fault)) => fault.to_string(),
            Err(_) => "what reads them broke down".into(),
        };
        // All of them begin anew.
        if tell(Told::Input(Input::Left)).and_then(|()| tell(Told::Note(format!("input devices: {fault}")))).is_err() {
            return;
        }
        let _ = wait(&mut [PollFd::new(&shared.rouse, PollFlags::IN)], LOOK);
    }
}

/// Follows all devices until it is over.
fn follow(shared: &Shared, grab: bool, tell: &dyn Fn(Told) -> Result<(), Over>) -> io::Result<Over> {
    let size = || *shared.size.lock().unwrap_or_else(PoisonError::into_inner);
    let (mut opened, mut known) = (Opened::new(size(), grab), size());
    let (mut look, mut out) = (Instant::now(), Vec::new());
    while !shared.ends.load(Ordering::Acquire) {
        if look <= Instant::now() {
            look = Instant::now() + LOOK;
            opened.look(&mut out);
        }
        if size() != known {
            known = size();
            opened.resize(known);
        }
        let ready: Vec<usize> = {
            let rouse = PollFd::new(&shared.rouse, PollFlags::IN);
            let devices = opened.waits().map(|fd| PollFd::from_borrowed_fd(fd, PollFlags::IN));
            let mut all: Vec<PollFd> = std::iter::once(rouse).chain(devices).collect();
            // What was found at the look has waited long enough.
            let time = if out.is_empty() { look.saturating_duration_since(Instant::now()) } else { Duration::ZERO };
            wait(&mut all, time)?;
            (0..all.len() - 1).filter(|n| !all[n + 1].revents().is_empty()).collect()
        };
        // Until a counter that nobody adds to is empty; it never blocks.
        let _ = rustix::io::read(&shared.rouse, &mut [0; 8]);
        // From the last: one that is gone moves those behind it.
        ready.into_iter().rev().for_each(|place| opened.read(place, &mut out));
        for told in out.drain(..) {
            if tell(told).is_err() {
                return Ok(Over);
            }
        }
    }
    Ok(Over)
}

/// Waits so long at most for any of them.
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

    /// Whatever devices this machine has, they are left to whom they belong.
    #[test]
    fn whoever_waits_is_woken_once_and_the_thread_ends() {
        let devices = Devices::listen([100, 100], false).unwrap();
        let wake = devices.wake();
        (0..5000).for_each(|_| wake());
        let told = devices.wait(None);
        assert_eq!(told.iter().filter(|told| **told == Told::Woken).count(), 1);
        wake();
        assert!(devices.wait(Some(Instant::now() + Duration::from_secs(60))).contains(&Told::Woken));
        devices.wait(Some(Instant::now()));
        devices.resize([50, 50]);
        let begun = Instant::now();
        drop(devices);
        assert!(begun.elapsed() < LOOK, "it does not wait for the next look");
        wake();
    }
}
