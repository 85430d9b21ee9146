//! SIGINT, SIGTERM and SIGHUP for code that must finish something first: a moving motor, a recording without its index, an incomplete file.
//! At other times the signals end the process. After [`hangups`] SIGHUP does neither.

use crate::sync::locked;
use signal_hook::SigId;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::{flag, low_level};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

#[cfg(unix)]
const SIGNALS: &[i32] = &[SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
#[cfg(not(unix))]
const SIGNALS: &[i32] = &[SIGINT, SIGTERM];

/// The signal handlers of the process, registered once.
struct Handlers {
    /// Number of the last signal; 0 for none.
    received: Arc<AtomicUsize>,
    /// True while no [`Held`] or [`Writing`] exists: signals have their default effect.
    unheld: Arc<AtomicBool>,
    /// True after a first signal if the next one has its default effect.
    again: Arc<AtomicBool>,
    holders: Mutex<Holders>,
}

#[derive(Default)]
struct Holders {
    /// Number of [`Held`], and of those that no second signal may interrupt.
    held: usize,
    patient: usize,
    writing: usize,
    /// The handlers that record the first signal, so that the second has its default effect.
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

/// Becomes true with SIGHUP, where that does not end the process.
static HANGUPS: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// From now on SIGHUP does not end this process but sets the returned value to true. Call it before the first use of [`Held`], [`Writing`] or
/// [`received`].
///
/// # Errors
/// The signal cannot be caught.
pub fn hangups() -> std::io::Result<Arc<AtomicBool>> {
    let hangups = HANGUPS.get_or_init(Arc::default).clone();
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGHUP, hangups.clone())?;
    Ok(hangups)
}

/// The signals to catch: all except those that the parent process made this one ignore, as `nohup` does, and that mean something else.
fn caught() -> impl Iterator<Item = i32> {
    let ignored = std::fs::read_to_string("/proc/self/status").ok().and_then(|status| {
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
        u64::from_str_radix(mask.trim(), 16).ok()
    });
    let is_ending = |signal: &i32| HANGUPS.get().is_none() || [SIGINT, SIGTERM].contains(signal);
    let is_ignored = move |signal: &i32| ignored.is_some_and(|mask| mask >> (signal - 1) & 1 == 1);
    SIGNALS.iter().copied().filter(move |signal| is_ending(signal) && !is_ignored(signal))
}

impl Handlers {
    /// Changes the counts of holders and updates the handlers.
    fn change(&self, how: impl FnOnce(&mut Holders)) {
        let mut holders = locked(&self.holders);
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

/// The name of a signal number, for example SIGSEGV; None if the number is not a signal's.
pub fn name_of(signal: i32) -> Option<&'static str> {
    low_level::signal_name(signal)
}

/// Sends this process a segmentation fault, to simulate a driver that accesses invalid memory.
pub fn raise_segmentation_fault() {
    // The first one only removes the handler of the standard library, which looks for an exhausted stack.
    for _ in 0..2 {
        let _ = low_level::raise(signal_hook::consts::SIGSEGV);
    }
}

/// Name of the last signal that arrived while a [`Held`] or [`Writing`] existed; None if none did. A new [`Held`] or [`Writing`] forgets it if no
/// other one exists. Work that can end early polls this.
pub fn received() -> Option<&'static str> {
    handlers().signal().map(|(_, name)| name)
}

/// While a value of this type exists, SIGINT, SIGTERM and SIGHUP do not end the process ([`Held::first`]: not the first time); [`Held::signal`]
/// reports them. Dropping the value does not raise them again.
#[derive(Debug)]
pub struct Held {
    patient: bool,
}

impl Held {
    /// Defers every signal, for work that must never be interrupted, such as stopping a motor.
    pub fn take() -> Held {
        Held::with(true)
    }

    /// Defers only the first signal: the second ends the process at once, unless a value of [`Held::take`] exists.
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

    /// Name of the last signal, as [`received`] returns it. It may have arrived before this value was made, while another one existed.
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

/// While values of this type exist and no [`Held`] does, the first signal is deferred: it ends the process when the last of them is dropped.
#[derive(Debug)]
pub struct Writing(());

impl Writing {
    pub fn begin() -> Writing {
        handlers().change(|holders| holders.writing += 1);
        Writing(())
    }

    /// Name of the deferred signal, after which the writer has to stop. None without one, and while a [`Held`] decides what the signal means.
    pub fn signal(&self) -> Option<&'static str> {
        let handlers = handlers();
        let (_, name) = handlers.signal()?;
        (locked(&handlers.holders).held == 0).then_some(name)
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
            // This call does not return.
            let _ = low_level::emulate_default_handler(signal);
        }
    }
}
