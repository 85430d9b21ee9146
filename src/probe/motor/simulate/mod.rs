//! A TMCL module on a pseudo-terminal, for tests and for anyone without the hardware: [`Simulator`].

mod module;

use super::table::MotorTable;
use super::tmcl::{LENGTH, Request, command};
use module::Module;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, ioctl_tiocnxcl, tcgetattr, tcsetattr};
use std::collections::VecDeque;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What can be made to go wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// Obeys, but does not answer.
    Mute,
    /// Every answer's checksum is wrong.
    Checksum,
    /// The right limit switch closes and stays closed.
    LimitSwitch,
    /// The rotor is held fast; the module notices and stops.
    Stall,
    /// The port vanishes.
    Unplugged,
    /// The firmware gives another module's number.
    WrongModule,
    /// Bytes of noise come before every answer, some of which are whole answers with a wrong checksum.
    Noise,
    /// Every answer comes three seconds late.
    Slow,
}

impl FaultKind {
    pub const ALL: [(&'static str, FaultKind); 8] = [
        ("mute", FaultKind::Mute),
        ("checksum", FaultKind::Checksum),
        ("limit-switch", FaultKind::LimitSwitch),
        ("stall", FaultKind::Stall),
        ("unplugged", FaultKind::Unplugged),
        ("wrong-module", FaultKind::WrongModule),
        ("noise", FaultKind::Noise),
        ("slow", FaultKind::Slow),
    ];
}

/// A fault and when it begins: `NAME`, from the start; `NAME@SECONDS`, so long after the module was first sent to a position,
/// which is when a sweep begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedFault {
    pub kind: FaultKind,
    pub after: Option<Duration>,
}

impl FromStr for SimulatedFault {
    type Err = String;

    fn from_str(text: &str) -> Result<SimulatedFault, String> {
        let (name, after) = text.split_once('@').map_or((text, None), |(name, after)| (name, Some(after)));
        let kind = FaultKind::ALL.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind);
        let names = FaultKind::ALL.map(|(name, _)| name).join(", ");
        let kind = kind.ok_or_else(|| format!("'{name}' is no fault; there are {names}"))?;
        let seconds = |text: &str| text.parse::<f64>().ok().filter(|s| (0.0..=3600.0).contains(s));
        let after = match after {
            None => None,
            Some(text) => Some(seconds(text).ok_or_else(|| format!("'{text}' must be 0 to 3600 seconds"))?),
        };
        Ok(SimulatedFault { kind, after: after.map(Duration::from_secs_f64) })
    }
}

/// What the simulator is to be.
#[derive(Clone, Debug, Default)]
pub struct SimulatorOptions {
    pub table: MotorTable,
    pub fault: Option<SimulatedFault>,
    /// The module has no watchdog.
    pub no_watchdog: bool,
}

struct Shared {
    module: Mutex<Module>,
    received: Mutex<Vec<Request>>,
    end: AtomicBool,
}

/// A simulated module, running until it is dropped.
pub struct Simulator {
    path: PathBuf,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Simulator {
    /// # Errors
    /// The system has no pseudo-terminal to give.
    pub fn start(options: SimulatorOptions) -> std::io::Result<Simulator> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let path = PathBuf::from(ptsname(&master, Vec::new())?.to_string_lossy().into_owned());
        // Held open here, the terminal outlives its users and keeps the settings: no echo of what is sent.
        let slave = ioctl_tiocgptpeer(&master, OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings)?;

        let mut module = Module::new(&options.table);
        module.watchdog = !options.no_watchdog;
        let (module, received) = (Mutex::new(module), Mutex::new(Vec::new()));
        let shared = Arc::new(Shared { module, received, end: AtomicBool::new(false) });
        let line = Line { master, slave, shared: shared.clone(), address: options.table.address, fault: options.fault };
        let thread = std::thread::Builder::new().name("simulated module".into()).spawn(move || line.run())?;
        Ok(Simulator { path, shared, thread: Some(thread) })
    }

    /// The port to open.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Every request that was understood so far, in order.
    pub fn received(&self) -> Vec<Request> {
        locked(&self.shared.received).clone()
    }

    /// The motor turns at this moment.
    pub fn turning(&self) -> bool {
        locked(&self.shared.module).turning()
    }

    /// Where the array really is, in degrees of the sweep.
    pub fn angle(&self) -> f64 {
        locked(&self.shared.module).angle()
    }

    /// It was unplugged, or its port has failed.
    pub fn ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        self.shared.end.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

/// The thread between the pseudo-terminal and the module.
struct Line {
    master: OwnedFd,
    slave: OwnedFd,
    shared: Arc<Shared>,
    address: u8,
    fault: Option<SimulatedFault>,
}

impl Line {
    fn run(self) {
        if let Err(error) = self.serve() {
            tracing::warn!("the simulated module's port has failed: {error}");
        }
    }

    fn serve(&self) -> rustix::io::Result<()> {
        let (mut pending, mut bytes, mut outgoing) = (Vec::new(), [0; 256], VecDeque::new());
        let (mut last, mut positioned, mut answers) = (Instant::now(), None, 0_usize);
        let pause = Timespec { tv_sec: 0, tv_nsec: 5_000_000 };
        while !self.shared.end.load(Ordering::SeqCst) {
            let mut fds = [PollFd::new(&self.master, PollFlags::IN)];
            let ready = match poll(&mut fds, Some(&pause)) {
                Err(rustix::io::Errno::INTR) => continue,
                ready => ready? > 0,
            };
            if ready {
                let count = rustix::io::read(&self.master, &mut bytes)?;
                pending.extend_from_slice(&bytes[..count]);
            } else {
                // Whoever was killed has left the port to itself alone; the next one is to have it.
                let _ = ioctl_tiocnxcl(&self.slave);
            }
            let (now, before) = (Instant::now(), last);
            last = now;
            let due = self.due(positioned);
            if due == Some(FaultKind::Unplugged) {
                return Ok(());
            }
            let mut module = locked(&self.shared.module);
            module.stalled |= due == Some(FaultKind::Stall);
            module.limit_closed |= due == Some(FaultKind::LimitSwitch);
            if due == Some(FaultKind::WrongModule) {
                module.number = 3110;
            }
            module.pass(now - before, !ready);
            let mut replies = Vec::new();
            while let Some((first, rest)) = pending.split_first_chunk::<LENGTH>() {
                match Request::parse(first) {
                    Some(request) if request.address == self.address => {
                        locked(&self.shared.received).push(request);
                        if request.command == command::MOVE_TO {
                            positioned.get_or_insert(now);
                        }
                        replies.push(module.answer(&request).bytes());
                        pending = rest.to_vec();
                    }
                    // Another module's: this one says nothing.
                    Some(_) => pending = rest.to_vec(),
                    // Shifted: the next byte may be the first.
                    None => drop(pending.remove(0)),
                }
            }
            drop(module);
            for reply in replies {
                answers += 1;
                let wait = Duration::from_secs(if due == Some(FaultKind::Slow) { 3 } else { 0 });
                outgoing.push_back((now + wait, spoilt(reply, due, answers)));
            }
            while outgoing.front().is_some_and(|(at, _)| *at <= now) {
                let (_, bytes) = outgoing.pop_front().unwrap_or((now, Vec::new()));
                self.write(&bytes)?;
            }
        }
        Ok(())
    }

    /// The fault that is present.
    fn due(&self, positioned: Option<Instant>) -> Option<FaultKind> {
        let fault = self.fault?;
        let begun = match (fault.after, positioned) {
            (None, _) => true,
            (Some(after), Some(since)) => since.elapsed() >= after,
            (Some(_), None) => false,
        };
        begun.then_some(fault.kind)
    }

    fn write(&self, mut left: &[u8]) -> rustix::io::Result<()> {
        while !left.is_empty() {
            let written = rustix::io::write(&self.master, left)?;
            left = &left[written..];
        }
        Ok(())
    }
}

/// What of the reply number `count` goes over the wire.
fn spoilt(mut reply: [u8; LENGTH], due: Option<FaultKind>, count: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    match due {
        Some(FaultKind::Mute) => return bytes,
        Some(FaultKind::Checksum) => reply[8] ^= 0x55,
        Some(FaultKind::Noise) => {
            bytes.extend([0xff, 0x02, 0x01, 0x64].repeat(1 + count % 5));
            if count.is_multiple_of(7) {
                bytes.extend(reply.map(|b| b.wrapping_add(1)));
            }
        }
        _ => {}
    }
    bytes.extend(reply);
    bytes
}
