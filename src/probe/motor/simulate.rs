//! A simulated TMCL module on a pseudo-terminal, for tests and for users without the hardware: [`Simulator`].
//!
//! It models ramps, a load with inertia, a position counter and switches. The shaft's own position is counted from the edge of the home
//! switch, in microsteps. The module's counter starts at 0 wherever the shaft is, until a search. The home switch is a flag over half
//! the travel: closed left of home (right of it if `home_direction` is right). A reference search goes straight to it. This is a model of
//! the protocol and of how a motor moves, not of the firmware of a product.

use super::table::{MotorTable, Side};
use super::tmcl::{self, LENGTH, Reply, Request, SUCCESS, WRONG_CHECKSUM, axis, command};
use crate::sync::locked;
use crate::tree::{All, Name};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, ioctl_tiocnxcl, tcgetattr, tcsetattr};
use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The faults of a motor's module that can be simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, All, Name)]
#[tree(rename_all = "kebab-case")]
pub enum FaultKind {
    /// Carries out requests but does not reply.
    Mute,
    /// The checksum of every reply is wrong.
    Checksum,
    /// The right limit switch closes and stays closed.
    LimitSwitch,
    /// The rotor is blocked; the module notices and stops.
    Stall,
    /// The port disappears.
    Unplugged,
    /// The firmware reports the number of another module.
    WrongModule,
    /// Noise precedes every reply. Some of the noise is complete replies with a wrong checksum.
    Noise,
    /// Every reply is three seconds late.
    Slow,
}

/// A simulated fault and when it begins. As text, `NAME` begins at once, and `NAME@SECONDS` that many seconds after the first request to move to a
/// position; a sweep begins with one. `after` is None for a fault that begins at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedFault {
    pub kind: FaultKind,
    pub after: Option<Duration>,
}

impl FromStr for SimulatedFault {
    type Err = String;

    fn from_str(text: &str) -> Result<SimulatedFault, String> {
        let (name, after) = text.split_once('@').map_or((text, None), |(name, after)| (name, Some(after)));
        let kind = FaultKind::ALL.into_iter().find(|kind| kind.name() == name);
        let names = FaultKind::ALL.map(FaultKind::name).join(", ");
        let kind = kind.ok_or_else(|| format!("'{name}' is not a fault; the faults are {names}"))?;
        let time = |text: &str| {
            let seconds = text.parse().ok().filter(|s| (0.0..=3600.0).contains(s));
            seconds.map(Duration::from_secs_f64).ok_or_else(|| format!("'{text}' must be 0 to 3600 seconds"))
        };
        Ok(SimulatedFault { kind, after: after.map(time).transpose()? })
    }
}

/// The properties of a simulated module: its `[motor]` table, its watchdog, and the fault that is simulated, if any.
#[derive(Clone, Debug, Default)]
pub struct SimulatorOptions {
    pub table: MotorTable,
    pub fault: Option<SimulatedFault>,
    /// True if the module has no watchdog.
    pub no_watchdog: bool,
}

struct Shared {
    module: Mutex<Module>,
    received: Mutex<Vec<Request>>,
    end: AtomicBool,
}

/// A simulated TMCL module on a pseudo-terminal. The simulation runs until this value is dropped, or its port is unplugged or fails.
pub struct Simulator {
    path: PathBuf,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Simulator {
    /// Starts the simulation on a thread of its own.
    ///
    /// # Errors
    /// The system provides no pseudo-terminal or no thread.
    pub fn start(options: SimulatorOptions) -> std::io::Result<Simulator> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let path = PathBuf::from(ptsname(&master, Vec::new())?.to_string_lossy().into_owned());
        // Kept open, so that the terminal outlives its users and keeps its settings: no echo.
        let slave = ioctl_tiocgptpeer(&master, OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings)?;

        let module = Mutex::new(Module { watchdog: !options.no_watchdog, ..Module::new(&options.table) });
        let shared = Arc::new(Shared { module, received: Mutex::default(), end: AtomicBool::new(false) });
        let (master, address) = (master.into(), options.table.address);
        let line = Line { master, slave, shared: shared.clone(), address, fault: options.fault };
        let thread = std::thread::Builder::new().name("simulated module".into()).spawn(move || line.run())?;
        Ok(Simulator { path, shared, thread: Some(thread) })
    }

    /// Path of the pseudo-terminal, to be opened as the serial port.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// All valid requests that the module received so far, in order.
    pub fn received(&self) -> Vec<Request> {
        locked(&self.shared.received).clone()
    }

    /// True while the motor moves.
    pub fn is_moving(&self) -> bool {
        locked(&self.shared.module).is_moving()
    }

    /// The true angle of the simulated array, degrees; 0 is the middle of the sweep.
    pub fn angle(&self) -> f64 {
        locked(&self.shared.module).angle()
    }

    /// True if the simulation has ended, because the port was unplugged or has failed.
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

/// The thread between the pseudo-terminal and the module.
struct Line {
    master: File,
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

    fn serve(&self) -> std::io::Result<()> {
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
                let count = (&self.master).read(&mut bytes)?;
                pending.extend_from_slice(&bytes[..count]);
            } else {
                // A user that was killed left the port in exclusive mode; the next one must be able to open it.
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
                        replies.push(module.answer(&request));
                        pending = rest.to_vec();
                    }
                    // For another module: no reply.
                    Some(_) => pending = rest.to_vec(),
                    // A request for this module whose bytes were changed on the way. No whole one begins within it.
                    None if first[0] == self.address && !has_request(&pending[1..], self.address) => {
                        let (module, command) = (self.address, first[1]);
                        replies.push(Reply { host: HOST, module, status: WRONG_CHECKSUM, command, value: 0 }.bytes());
                        pending = rest.to_vec();
                    }
                    // Out of step: the next byte may be the first.
                    None => drop(pending.remove(0)),
                }
            }
            drop(module);
            for reply in replies {
                answers += 1;
                let wait = Duration::from_secs(if due == Some(FaultKind::Slow) { 3 } else { 0 });
                outgoing.push_back((now + wait, with_fault(reply, due, answers)));
            }
            while let Some((_, bytes)) = outgoing.pop_front_if(|(at, _)| *at <= now) {
                (&self.master).write_all(&bytes)?;
            }
        }
        Ok(())
    }

    /// The fault that is present.
    fn due(&self, positioned: Option<Instant>) -> Option<FaultKind> {
        let fault = self.fault?;
        let is_begun = fault.after.is_none_or(|after| positioned.is_some_and(|since| since.elapsed() >= after));
        is_begun.then_some(fault.kind)
    }
}

/// True if a whole request for a module is among the bytes.
fn has_request(bytes: &[u8], address: u8) -> bool {
    let requests = bytes.windows(LENGTH).filter_map(|w| Request::parse(w.try_into().ok()?));
    requests.into_iter().any(|request| request.address == address)
}

/// The bytes that are sent for reply number `count`.
fn with_fault(mut reply: [u8; LENGTH], due: Option<FaultKind>, count: usize) -> Vec<u8> {
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

/// Longest step of the integration, s.
const MAX_STEP: f64 = 5e-4;
/// Angle of the shaft when the module is switched on, degrees from home.
const START_ANGLE: f64 = 7.0;
/// Distance of the limit switches from the ends of the largest sweep, degrees.
const LIMIT_MARGIN: f64 = 3.0;
/// Address of the host.
const HOST: u8 = 2;
/// Version of the firmware: 1.16.
const VERSION: i32 = 0x0110;
/// Status codes.
const BAD_COMMAND: u8 = 2;
const BAD_TYPE: u8 = 3;
const BAD_VALUE: u8 = 4;

/// What the module is carrying out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Activity {
    /// Microsteps a second.
    Velocity(f64),
    /// The module's counter, microsteps.
    Position(f64),
    Search,
}

/// The module and its motor.
#[derive(Debug)]
struct Module {
    table: MotorTable,
    /// Number in the firmware's version.
    number: u16,
    /// It has a watchdog.
    watchdog: bool,
    /// Steepest ramp under load, microsteps/s2. Above it the motor stalls.
    strength: f64,
    /// The rotor no longer follows, and the module has noticed and stopped.
    stalled: bool,
    /// The right limit switch is closed wherever the shaft is.
    limit_closed: bool,
    activity: Activity,
    /// Microsteps from the home switch's edge.
    shaft: f64,
    /// Counter minus shaft.
    offset: f64,
    /// Microsteps a second.
    speed: f64,
    axes: BTreeMap<u8, i32>,
    watchdog_ms: i32,
    since_command: f64,
}

impl Module {
    fn new(table: &MotorTable) -> Module {
        let shaft = START_ANGLE * table.steps_per_degree();
        let mut axes = BTreeMap::from([(axis::SEARCH_MODE, 1), (axis::SWITCH_SPEED, 1)]);
        axes.extend([(axis::RUN_CURRENT, 128), (axis::STANDBY_CURRENT, 8), (axis::FREEWHEELING, 0)]);
        axes.extend([(axis::RIGHT_LIMIT_OFF, 0), (axis::LEFT_LIMIT_OFF, 0)]);
        axes.insert(axis::MICROSTEPS, table.microsteps.trailing_zeros().cast_signed());
        axes.insert(axis::MAX_SPEED, table.velocity(table.search_speed()));
        axes.insert(axis::SEARCH_SPEED, table.velocity(table.search_speed()));
        axes.insert(axis::MAX_ACCELERATION, table.acceleration(table.acceleration_deg_per_s2));
        Module {
            number: table.module.unwrap_or(1140),
            watchdog: true,
            strength: 3.0 * table.acceleration_deg_per_s2 * table.steps_per_degree(),
            stalled: false,
            limit_closed: false,
            activity: Activity::Velocity(0.0),
            shaft,
            offset: -shaft,
            speed: 0.0,
            axes,
            watchdog_ms: 0,
            since_command: 0.0,
            table: table.clone(),
        }
    }

    /// Angle of the array in the sweep, degrees, whatever the counter is.
    fn angle(&self) -> f64 {
        self.table.angle(self.shaft.round() as i32)
    }

    /// True while the motor moves.
    fn is_moving(&self) -> bool {
        self.speed != 0.0
    }

    fn register(&self, parameter: u8) -> f64 {
        self.axes.get(&parameter).copied().map_or(0.0, f64::from)
    }

    fn limits(&self) -> [f64; 2] {
        let half = self.table.largest_angle_deg / 2.0 + LIMIT_MARGIN;
        let ends = [-half, half].map(|angle| f64::from(self.table.position(angle)));
        [ends[0].min(ends[1]), ends[0].max(ends[1])]
    }

    fn closed(&self, side: Side) -> bool {
        match side {
            Side::Left => self.shaft <= self.limits()[0],
            Side::Right => self.limit_closed || self.shaft >= self.limits()[1],
        }
    }

    fn home_closed(&self) -> bool {
        let closed = if self.table.home_direction == Side::Left { self.shaft <= 0.0 } else { self.shaft >= 0.0 };
        closed != self.table.home_inverted
    }

    /// Advances the simulation. `idle`: no command is waiting to be read, so the watchdog may act.
    fn pass(&mut self, time: Duration, idle: bool) {
        let mut left = time.as_secs_f64();
        self.since_command += left;
        if idle && self.watchdog && self.watchdog_ms > 0 && self.since_command * 1e3 > f64::from(self.watchdog_ms) {
            self.activity = Activity::Velocity(0.0);
        }
        while left > 0.0 {
            let step = left.min(MAX_STEP);
            self.step(step);
            left -= step;
        }
    }

    fn step(&mut self, time: f64) {
        let acceleration = self.register(axis::MAX_ACCELERATION) / self.table.acceleration_scale();
        let towards = |from: f64, to: f64, most: f64| {
            // The speed from which it can still brake, slightly less because of the finite steps.
            let fast = (1.9 * acceleration * (to - from).abs()).sqrt();
            fast.min(most).copysign(to - from)
        };
        let (target_speed, end) = match self.activity {
            Activity::Velocity(velocity) => (velocity, None),
            Activity::Position(target) => {
                let most = self.register(axis::MAX_SPEED) / self.table.speed_scale();
                let end = target - self.offset;
                (towards(self.shaft, end, most), Some(end))
            }
            Activity::Search => {
                let most = self.register(axis::SEARCH_SPEED) / self.table.speed_scale();
                (towards(self.shaft, 0.0, most), Some(0.0))
            }
        };
        if self.stalled {
            self.halt();
            return;
        }
        let change = (target_speed - self.speed).clamp(-acceleration * time, acceleration * time);
        if change != 0.0 && acceleration > self.strength {
            self.stalled = true;
        }
        self.speed += change;
        let before = self.shaft;
        self.shaft += self.speed * time;
        if let Some(end) = end {
            let crossed = (before - end) * (self.shaft - end) <= 0.0;
            // The counter shows the target from half a microstep before it on. The speed of braking is there below
            // sqrt(acceleration), and a few steps of the integration may be missing. So the motor is at rest where its counter
            // shows the target, however short or long a step is.
            let slow = acceleration.sqrt() + 4.0 * acceleration * time;
            if (crossed || (self.shaft - end).abs() < 0.5) && self.speed.abs() <= slow {
                (self.shaft, self.speed) = (end, 0.0);
                if self.activity == Activity::Search {
                    self.offset = 0.0;
                    self.activity = Activity::Velocity(0.0);
                }
            }
        }
        let (ahead, off) = match self.speed > 0.0 {
            true => (Side::Right, axis::RIGHT_LIMIT_OFF),
            false => (Side::Left, axis::LEFT_LIMIT_OFF),
        };
        if self.speed != 0.0 && self.closed(ahead) && self.register(off) == 0.0 {
            self.halt();
        }
    }

    /// Stops at once. A search does not continue.
    fn halt(&mut self) {
        self.speed = 0.0;
        if self.activity != Activity::Search {
            self.activity = Activity::Velocity(0.0);
        }
    }

    fn counter(&self) -> i32 {
        (self.shaft + self.offset).round() as i32
    }

    /// Carries a request out. Returns the bytes of the reply, which is text where the version was asked for as text.
    fn answer(&mut self, request: &Request) -> [u8; LENGTH] {
        self.since_command = 0.0;
        if (request.command, request.kind) == (command::VERSION, 0) {
            let text = format!("{:04}V{}{:02}", self.number % 10_000, VERSION >> 8, VERSION & 0xff);
            let mut bytes = [0; LENGTH];
            bytes[0] = HOST;
            bytes[1..].iter_mut().zip(text.bytes()).for_each(|(byte, letter)| *byte = letter);
            return bytes;
        }
        let (status, value) = match self.carry_out(request) {
            Ok(value) => (SUCCESS, value),
            Err(status) => (status, 0),
        };
        Reply { host: HOST, module: self.table.address, status, command: request.command, value }.bytes()
    }

    fn carry_out(&mut self, request: &Request) -> Result<i32, u8> {
        let Request { command, kind, motor, value, .. } = *request;
        let of_axis = matches!(command, command::ROTATE_RIGHT..=command::GET_AXIS | command::REFERENCE_SEARCH);
        if of_axis && motor != self.table.motor {
            return Err(BAD_VALUE);
        }
        match command {
            command::ROTATE_RIGHT => self.activity = Activity::Velocity(f64::from(value) / self.table.speed_scale()),
            command::ROTATE_LEFT => self.activity = Activity::Velocity(-f64::from(value) / self.table.speed_scale()),
            command::STOP => self.activity = Activity::Velocity(0.0),
            command::MOVE_TO => match kind {
                0 => self.activity = Activity::Position(f64::from(value)),
                1 => self.activity = Activity::Position(f64::from(self.counter()) + f64::from(value)),
                _ => return Err(BAD_TYPE),
            },
            command::SET_AXIS => return self.set(kind, value),
            command::GET_AXIS => return self.get(kind),
            command::SET_GLOBAL if kind == tmcl::WATCHDOG && self.watchdog => self.watchdog_ms = value,
            command::GET_GLOBAL if kind == tmcl::WATCHDOG && self.watchdog => return Ok(self.watchdog_ms),
            command::SET_GLOBAL | command::GET_GLOBAL => return Err(BAD_TYPE),
            command::REFERENCE_SEARCH => match kind {
                0 => self.activity = Activity::Search,
                1 if self.activity == Activity::Search => self.activity = Activity::Velocity(0.0),
                1 => {}
                2 => return Ok(i32::from(self.activity == Activity::Search)),
                _ => return Err(BAD_TYPE),
            },
            command::GET_INPUT => return Ok(0),
            command::VERSION if kind == 1 => return Ok(i32::from(self.number) << 16 | VERSION),
            command::VERSION => return Err(BAD_TYPE),
            _ => return Err(BAD_COMMAND),
        }
        Ok(value)
    }

    fn set(&mut self, parameter: u8, value: i32) -> Result<i32, u8> {
        match parameter {
            axis::TARGET => self.activity = Activity::Position(f64::from(value)),
            axis::TARGET_SPEED => self.activity = Activity::Velocity(f64::from(value) / self.table.speed_scale()),
            // The simulated motor has the microsteps of its table.
            axis::MICROSTEPS if self.axes.get(&parameter) != Some(&value) => return Err(BAD_VALUE),
            axis::RUN_CURRENT | axis::STANDBY_CURRENT if !(0..=255).contains(&value) => return Err(BAD_VALUE),
            axis::RIGHT_LIMIT_OFF | axis::LEFT_LIMIT_OFF if !(0..=1).contains(&value) => return Err(BAD_VALUE),
            axis::FREEWHEELING if !(0..=65535).contains(&value) => return Err(BAD_VALUE),
            axis::POSITION => self.offset = f64::from(value) - self.shaft,
            axis::MAX_SPEED | axis::MAX_ACCELERATION | axis::SEARCH_SPEED | axis::SWITCH_SPEED if value < 0 => {
                return Err(BAD_VALUE);
            }
            known if self.axes.contains_key(&known) => {
                self.axes.insert(known, value);
            }
            _ => return Err(BAD_TYPE),
        }
        Ok(value)
    }

    fn get(&self, parameter: u8) -> Result<i32, u8> {
        Ok(match parameter {
            axis::TARGET => match self.activity {
                Activity::Position(target) => target as i32,
                _ => self.counter(),
            },
            axis::POSITION => self.counter(),
            axis::TARGET_SPEED => match self.activity {
                Activity::Velocity(speed) => (speed * self.table.speed_scale()).round() as i32,
                _ => (self.speed * self.table.speed_scale()).round() as i32,
            },
            axis::SPEED => (self.speed * self.table.speed_scale()).round() as i32,
            axis::REACHED => i32::from(matches!(self.activity, Activity::Position(t) if t as i32 == self.counter())),
            axis::HOME_SWITCH => i32::from(self.home_closed()),
            axis::RIGHT_LIMIT => i32::from(self.closed(Side::Right)),
            axis::LEFT_LIMIT => i32::from(self.closed(Side::Left)),
            other => *self.axes.get(&other).ok_or(BAD_TYPE)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProbeFile;

    /// The counter and the shaft at rest are one state, whether the port is served every 10 us or every 20 ms.
    #[test]
    fn the_motor_is_at_rest_where_its_counter_shows_the_target() {
        let probe = ProbeFile::read(Path::new("../../tests/data/motor/probe.toml")).expect("the example is right");
        let table = probe.motor().expect("and has a motor");
        for step in [1e-5, 3e-4, 5e-3, 2e-2].map(Duration::from_secs_f64) {
            let mut module = Module::new(table);
            for angle in [4.0, -12.0, 12.0] {
                let target = table.position(angle);
                module.activity = Activity::Position(f64::from(target));
                let longest = (2.0 / step.as_secs_f64()) as usize;
                let steps = (0..longest).take_while(|_| {
                    module.pass(step, true);
                    module.counter() != target
                });
                assert!(steps.count() < longest, "{step:?}: {angle} deg was not reached in 2 s");
                assert!(!module.is_moving(), "{step:?}: at {angle} deg with {} microsteps/s", module.speed);
            }
        }
    }
}
