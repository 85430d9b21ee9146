//! SIGINT, SIGTERM and SIGHUP, for whoever has something to end first: a motor that turns, a recording without its index, a file that is
//! half written. Where nobody has, they end the process as they always do.

use signal_hook::SigId;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::{flag, low_level};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

#[cfg(unix)]
const SIGNALS: &[i32] = &[SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
#[cfg(not(unix))]
const SIGNALS: &[i32] = &[SIGINT, SIGTERM];

/// The process' signal handlers, registered once.
struct Handlers {
    /// The number of the last signal; 0: none.
    received: Arc<AtomicUsize>,
    /// Nobody holds the signals: they do what they do by default.
    unheld: Arc<AtomicBool>,
    /// One has come, and the next does what it does by default.
    again: Arc<AtomicBool>,
    holders: Mutex<Holders>,
}

#[derive(Default)]
struct Holders {
    /// [`Held`] in all, and those that no second signal may break.
    held: usize,
    patient: usize,
    writing: usize,
    /// What notes the first signal for the second.
    noting: Vec<SigId>,
}

fn handlers() -> &'static Handlers {
    static HANDLERS: OnceLock<Handlers> = OnceLock::new();
    HANDLERS.get_or_init(|| {
        let (received, unheld) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(true)));
        let again = Arc::new(AtomicBool::new(false));
        for signal in caught() {
            let registered = flag::register_conditional_default(signal, unheld.clone())
                .and_then(|_| flag::register_conditional_default(signal, again.clone()))
                .and_then(|_| flag::register_usize(signal, received.clone(), signal as usize));
            if let Err(error) = registered {
                tracing::warn!("signal {signal} cannot be caught and would not stop the motor: {error}");
            }
        }
        Handlers { received, unheld, again, holders: Mutex::default() }
    })
}

/// All but those that whoever started the process had it ignore, as `nohup` does.
fn caught() -> impl Iterator<Item = i32> {
    let ignored = std::fs::read_to_string("/proc/self/status").ok().and_then(|status| {
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
        u64::from_str_radix(mask.trim(), 16).ok()
    });
    SIGNALS.iter().copied().filter(move |signal| ignored.is_none_or(|mask| mask >> (signal - 1) & 1 == 0))
}

impl Handlers {
    fn lock(&self) -> MutexGuard<'_, Holders> {
        self.holders.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Lets go of one more or less of the holders.
    fn change(&self, how: impl FnOnce(&mut Holders)) {
        let mut holders = self.lock();
        if holders.held + holders.writing == 0 {
            self.received.store(0, Ordering::SeqCst);
        }
        how(&mut holders);
        let is_held = holders.held + holders.writing > 0;
        let is_patient = !is_held || holders.patient > 0;
        if is_patient && !holders.noting.is_empty() {
            holders.noting.drain(..).for_each(|id| _ = low_level::unregister(id));
            self.again.store(false, Ordering::SeqCst);
        } else if !is_patient && holders.noting.is_empty() {
            let noting = caught().filter_map(|signal| flag::register(signal, self.again.clone()).ok());
            holders.noting = noting.collect();
            self.again.store(self.signal().is_some(), Ordering::SeqCst);
        }
        self.unheld.store(!is_held, Ordering::SeqCst);
    }

    fn signal(&self) -> Option<(i32, &'static str)> {
        match self.received.load(Ordering::SeqCst) as i32 {
            0 => None,
            SIGINT => Some((SIGINT, "SIGINT")),
            SIGTERM => Some((SIGTERM, "SIGTERM")),
            other => Some((other, "SIGHUP")),
        }
    }
}

/// The last signal that came while somebody held them, if any: for work that can end early.
pub fn received() -> Option<&'static str> {
    handlers().signal().map(|(_, name)| name)
}

/// While one exists, SIGINT, SIGTERM and SIGHUP do not end the process but are told by [`Held::signal`].
#[derive(Debug)]
pub struct Held {
    patient: bool,
}

impl Held {
    /// However many come: what must not be left in motion is stopped first.
    pub fn take() -> Held {
        Held::with(true)
    }

    /// The first that comes; the second ends the process at once, unless somebody else holds all of them.
    pub fn first() -> Held {
        Held::with(false)
    }

    fn with(patient: bool) -> Held {
        handlers().change(|holders| {
            holders.held += 1;
            holders.patient += usize::from(patient);
        });
        Held { patient }
    }

    /// The last signal that came, if any.
    pub fn signal(&self) -> Option<&'static str> {
        handlers().signal().map(|(_, name)| name)
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        handlers().change(|holders| {
            holders.held -= 1;
            holders.patient -= usize::from(self.patient);
        });
    }
}

/// While one exists and nobody has a [`Held`], the first signal waits: it ends the process when the last of these is gone.
#[derive(Debug)]
pub struct Writing(());

impl Writing {
    pub fn begin() -> Writing {
        handlers().change(|holders| holders.writing += 1);
        Writing(())
    }

    /// The signal that waits, so that whoever writes gives up; none where it is somebody else's to say what it means.
    pub fn signal(&self) -> Option<&'static str> {
        let handlers = handlers();
        let (_, name) = handlers.signal()?;
        (handlers.lock().held == 0).then_some(name)
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        let handlers = handlers();
        let mut last = false;
        handlers.change(|holders| {
            holders.writing -= 1;
            last = holders.held + holders.writing == 0;
        });
        if let Some((signal, _)) = handlers.signal().filter(|_| last) {
            // Does not come back.
            let _ = low_level::emulate_default_handler(signal);
        }
    }
}
