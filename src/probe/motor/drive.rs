//! Drives the motor of a probe: status, home, sweep, stop. Nothing moves before the limits are checked, and every fault stops the motor.
//!
//! Home is found by the module's own reference search, or by this program with the home switch.

use super::guard::{Guard, Interrupter};
use super::port::{Answer, PERIOD, Port, PortSettings};
use super::sweep::{Direction, Position, Sweep};
use super::table::{Home, MotorTable, Side};
use super::tmcl::{self, Request, axis};
use super::{Fault, MotorError, Stopped};
use std::time::{Duration, Instant};

/// Without any movement for so long the motor has stalled.
const STALL_TIME: Duration = Duration::from_millis(400);
/// The limit switch ahead is read after so many positions.
const LOOK_AHEAD: usize = 8;

/// What a motor's module reports about itself and its motor.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorStatus {
    /// Type and firmware of the module, for example `TMCM-1140 firmware 1.16`.
    pub module: String,
    /// Angle of the array, degrees; 0 is the middle of the sweep. It is valid only after [`Drive::home`].
    pub angle: f64,
    /// Speed of the array, deg/s; positive towards larger angles.
    pub speed: f64,
    pub home_switch: bool,
    pub left_limit: bool,
    pub right_limit: bool,
    /// Time-out of the module's own watchdog; zero if it is off, None if it has none.
    pub watchdog: Option<Duration>,
}

/// An open motor. Dropping it, also in a panic, stops the motor if it may be moving. While it exists, SIGINT, SIGTERM and SIGHUP do not end the
/// process: they end the current operation, and the motor is stopped.
pub struct Drive {
    pub(super) guard: Guard,
    pub(super) table: MotorTable,
    module: String,
}

impl Drive {
    /// Opens the port and checks that its module is the one of the `[motor]` table. Moves nothing.
    ///
    /// # Errors
    /// Any [`Fault`] of the port, [`Fault::WrongModule`], and [`Fault::Interrupted`]; a motor that is already moving is then stopped if possible.
    pub fn open(settings: &PortSettings, table: &MotorTable) -> Result<Drive, MotorError> {
        let mut drive = Drive::connect("open", settings, table)?;
        drive.module = drive.act("open", Drive::identify)?;
        Ok(drive)
    }

    fn connect(operation: &'static str, settings: &PortSettings, table: &MotorTable) -> Result<Drive, MotorError> {
        let port = Port::open(settings).map_err(|fault| {
            // Another process may have left it moving.
            let is_asked = operation == "stop";
            let stopped = if is_asked { Stopped::Failed("the port was not opened".into()) } else { Stopped::NotMoved };
            MotorError { port: settings.path.clone(), operation, fault, stopped }
        })?;
        Ok(Drive { guard: Guard::new(port, table), table: table.clone(), module: String::new() })
    }

    /// Reads position, speed, switches and watchdog. Moves nothing.
    ///
    /// # Errors
    /// Any [`Fault`] of the port, and [`Fault::Interrupted`]; a motor that is moving is then stopped if possible.
    pub fn status(&mut self) -> Result<MotorStatus, MotorError> {
        self.act("status", |drive| {
            let (position, velocity) = (drive.get(axis::POSITION)?, drive.get(axis::SPEED)?);
            Ok(MotorStatus {
                module: drive.module.clone(),
                angle: drive.table.angle(position),
                speed: drive.table.speed(velocity),
                home_switch: drive.at_home_switch()?,
                left_limit: drive.limit_closed(Side::Left)?,
                right_limit: drive.limit_closed(Side::Right)?,
                watchdog: drive.watchdog()?,
            })
        })
    }

    /// Moves the motor until it has found home, the position from which all others are counted.
    ///
    /// # Errors
    /// Any [`Fault`]; the motor is then stopped if possible.
    pub fn home(&mut self) -> Result<(), MotorError> {
        self.act("home", |drive| {
            drive.set_watchdog()?;
            drive.find_home()
        })
    }

    /// Moves to the start of the sweep and then back and forth over it. [`Drive::home`] has to be called before. Each position that the first request
    /// for it returns during the passes is passed to `on_position`, with its time in s since `start`, in order of time. Returns the number of passes.
    ///
    /// # Errors
    /// Any [`Fault`], after which the motor is stopped if possible. With [`Fault::OutOfRange`] nothing moved.
    pub fn sweep(
        &mut self,
        sweep: &Sweep,
        start: Instant,
        on_position: &mut dyn FnMut(Position),
    ) -> Result<usize, MotorError> {
        self.act("sweep", |drive| drive.sweep_all(sweep, start, on_position))
    }

    /// A handle that stops the motor from another thread, within one request and its reply.
    pub(crate) fn interrupter(&self) -> Interrupter {
        self.guard.interrupter().clone()
    }

    /// Opens the port and stops the motor before anything else is requested, whichever module is there.
    ///
    /// # Errors
    /// The port cannot be opened ([`Fault::NotOpened`]), the module does not confirm the stop, the motor keeps moving for 5 s, its speed cannot be
    /// read, or a signal has come ([`Fault::Interrupted`]).
    pub fn stop_at(settings: &PortSettings, table: &MotorTable) -> Result<(), MotorError> {
        Drive::connect("stop", settings, table)?.stop()
    }

    /// Stops the motor and waits until it is at rest.
    ///
    /// # Errors
    /// The module does not confirm the stop, the motor keeps moving for 5 s, its speed cannot be read, or a signal has come
    /// ([`Fault::Interrupted`]).
    pub fn stop(&mut self) -> Result<(), MotorError> {
        let stopped = self.guard.stop();
        if stopped != Stopped::Confirmed {
            let PortSettings { path, timeout, .. } = self.guard.port().settings().clone();
            let fault = Fault::NoReply { request: "MST".into(), timeout };
            return Err(MotorError { port: path, operation: "stop", fault, stopped });
        }
        self.act("stop", Drive::wait_still)
    }

    /// Carries out an operation. After a fault the motor is stopped.
    fn act<T>(
        &mut self,
        operation: &'static str,
        act: impl FnOnce(&mut Drive) -> Result<T, Fault>,
    ) -> Result<T, MotorError> {
        act(self).map_err(|fault| self.guard.fail(operation, fault))
    }

    fn ask(&mut self, request: impl Fn(u8, u8) -> Request) -> Result<Answer, Fault> {
        self.guard.ask(&request(self.table.address, self.table.motor))
    }

    fn get(&mut self, parameter: u8) -> Result<i32, Fault> {
        self.ask(|a, m| Request::get_axis(a, m, parameter)).map(|answer| answer.value)
    }

    fn set(&mut self, parameter: u8, value: i32) -> Result<(), Fault> {
        self.ask(|a, m| Request::set_axis(a, m, parameter, value)).map(drop)
    }

    fn identify(&mut self) -> Result<String, Fault> {
        let answer = self.guard.ask(&Request::version(self.table.address))?.value as u32;
        let (mut module, mut version) = ((answer >> 16) as u16, format!("{}.{}", answer >> 8 & 0xff, answer & 0xff));
        if module == 0 {
            // Older firmware reports its number as text only.
            let bytes = self.guard.ask_raw(&Request::version_text(self.table.address))?;
            (module, version) = tmcl::version_text(&bytes).unwrap_or((0, version));
        }
        match self.table.module.filter(|expected| *expected != module) {
            Some(expected) => {
                let found = format!("module {module}, firmware {version}");
                Err(Fault::WrongModule { found, wanted: format!("module {expected}") })
            }
            None => Ok(format!("TMCM-{module} firmware {version}")),
        }
    }

    fn watchdog(&mut self) -> Result<Option<Duration>, Fault> {
        match self.guard.ask(&Request::get_global(self.table.address, tmcl::WATCHDOG)) {
            Ok(answer) => Ok(Some(Duration::from_millis(answer.value.max(0) as u64))),
            // The module has no such parameter, or no global parameters at all.
            Err(Fault::Refused { status: 2..=4 | 6, .. }) => Ok(None),
            Err(fault) => Err(fault),
        }
    }

    /// Sets the module's watchdog to the value of the table. The module stores it permanently, so it is written only if it differs.
    fn set_watchdog(&mut self) -> Result<(), Fault> {
        let Some(expected) = self.table.watchdog_ms else { return Ok(()) };
        match self.watchdog()? {
            None => tracing::warn!("the module has no watchdog: if this process is killed, the motor is not stopped"),
            Some(now) if now.as_millis() == u128::from(expected) => {}
            Some(_) => {
                self.guard.ask(&Request::set_global(self.table.address, tmcl::WATCHDOG, i32::from(expected)))?;
            }
        }
        Ok(())
    }

    fn sweep_all(
        &mut self,
        sweep: &Sweep,
        start: Instant,
        on_position: &mut dyn FnMut(Position),
    ) -> Result<usize, Fault> {
        let speed = sweep.speed(&self.table, self.guard.port().settings().round_trip())?;
        self.set_watchdog()?;
        for side in [Side::Left, Side::Right] {
            self.check_limit(side)?;
        }
        self.set(axis::MAX_ACCELERATION, self.table.acceleration(self.table.acceleration_deg_per_s2))?;
        self.set(axis::MAX_SPEED, self.table.velocity(self.table.search_speed()))?;
        self.travel(-sweep.angle / 2.0, self.table.search_speed(), &mut |_, _| {})?;
        self.set(axis::MAX_SPEED, self.table.velocity(speed))?;
        let mut last = f64::NEG_INFINITY;
        let volumes = sweep.volumes.unwrap_or(usize::MAX);
        for pass in 0..volumes {
            let direction = if pass.is_multiple_of(2) { Direction::Forward } else { Direction::Backward };
            let end = sweep.angle / 2.0 * direction.sign();
            self.travel(end, speed, &mut |at, angle| {
                let time = at.saturating_duration_since(start).as_secs_f64();
                if time > last {
                    last = time;
                    on_position(Position { time, angle, direction, pass });
                }
            })?;
        }
        // A position that equals the target may be read shortly before the motor is at rest.
        self.wait_still()?;
        self.guard.at_rest();
        Ok(volumes)
    }

    /// Moves to an angle, reading positions until it is reached.
    fn travel(&mut self, angle: f64, speed: f64, on_position: &mut dyn FnMut(Instant, f64)) -> Result<(), Fault> {
        let target = self.table.position(angle);
        let begin = self.get(axis::POSITION)?;
        let from = self.table.angle(begin);
        let ramps = 2.0 * speed / self.table.acceleration_deg_per_s2;
        let limit = Duration::from_secs_f64(3.0 + 3.0 * ((angle - from).abs() / speed + ramps));
        let ahead = if target >= begin { Side::Right } else { Side::Left };
        self.ask(|a, m| Request::move_to(a, m, target))?;
        let (start, mut moved, mut last) = (Instant::now(), Instant::now(), None);
        for count in 1.. {
            let asked = Instant::now();
            let answer = self.ask(|a, m| Request::get_axis(a, m, axis::POSITION))?;
            if !answer.repeated {
                on_position(answer.at, self.table.angle(answer.value));
            }
            if answer.value == target {
                return Ok(());
            }
            if last != Some(answer.value) {
                (last, moved) = (Some(answer.value), Instant::now());
            }
            let still = moved.elapsed() > STALL_TIME;
            if still || usize::is_multiple_of(count, LOOK_AHEAD) {
                self.check_limit(ahead)?;
            }
            if still {
                self.check_limit(ahead.other())?;
                return Err(Fault::Stalled { angle: self.table.angle(answer.value) });
            }
            if start.elapsed() > limit {
                return Err(Fault::TooLong { what: "the move to the end of the sweep", limit });
            }
            std::thread::sleep(PERIOD.saturating_sub(asked.elapsed()));
        }
        Ok(())
    }

    fn limit_closed(&mut self, side: Side) -> Result<bool, Fault> {
        let switch = if side == Side::Left { axis::LEFT_LIMIT } else { axis::RIGHT_LIMIT };
        Ok(self.get(switch)? != 0)
    }

    fn check_limit(&mut self, side: Side) -> Result<(), Fault> {
        if self.limit_closed(side)? {
            let position = self.get(axis::POSITION)?;
            return Err(Fault::LimitSwitch { side, angle: self.table.angle(position) });
        }
        Ok(())
    }

    fn at_home_switch(&mut self) -> Result<bool, Fault> {
        Ok((self.get(axis::HOME_SWITCH)? != 0) != self.table.home_inverted)
    }

    /// Waits until the motor is at rest, 5 s at most.
    fn wait_still(&mut self) -> Result<(), Fault> {
        let (start, limit) = (Instant::now(), Duration::from_secs(5));
        while self.get(axis::SPEED)? != 0 {
            if start.elapsed() > limit {
                return Err(Fault::TooLong { what: "slowing down", limit });
            }
            std::thread::sleep(PERIOD);
        }
        Ok(())
    }
}

/// Without any movement for so long a search has stalled. The module's own search may pause between its steps.
const SEARCH_STALL_TIME: Duration = Duration::from_millis(1500);
/// Speed of the last, exact approach to the switch, as a fraction of that of the first.
const SLOW_APPROACH: f64 = 0.1;

impl Drive {
    fn find_home(&mut self) -> Result<(), Fault> {
        self.set(axis::MAX_ACCELERATION, self.table.acceleration(self.table.acceleration_deg_per_s2))?;
        match self.table.home {
            Home::ReferenceSearch => self.search_by_module(),
            Home::Switch => self.search_by_switch(),
        }?;
        self.wait_still()?;
        self.guard.at_rest();
        Ok(())
    }

    /// Longest time that a search may take: twice the time to and fro over the whole travel.
    fn longest_search(&self) -> Duration {
        Duration::from_secs_f64(5.0 + 4.0 * self.table.largest_angle_deg / self.table.search_speed())
    }

    fn search_by_module(&mut self) -> Result<(), Fault> {
        if let Some(speed) = self.table.search_speed_deg_per_s {
            let velocity = self.table.velocity(speed);
            self.set(axis::SEARCH_SPEED, velocity)?;
            self.set(axis::SWITCH_SPEED, (velocity / 2).max(1))?;
        }
        let limit = self.longest_search();
        self.ask(Request::search_start)?;
        let (start, mut moved, mut last) = (Instant::now(), Instant::now(), None);
        while self.ask(Request::search_status)?.value != 0 {
            let position = self.get(axis::POSITION)?;
            if last != Some(position) {
                (last, moved) = (Some(position), Instant::now());
            }
            self.check_moves(position, moved)?;
            if start.elapsed() > limit {
                return Err(Fault::TooLong { what: "the module's reference search", limit });
            }
        }
        Ok(())
    }

    /// Rotates towards the switch, reversing once at a limit switch, then slowly back over its edge, which is home. The edge is always
    /// approached from the same side, so that the backlash of the gear has no effect.
    fn search_by_switch(&mut self) -> Result<(), Fault> {
        let (towards, speed) = (self.table.home_direction, self.table.search_speed());
        if !self.at_home_switch()? && self.rotate(towards, speed, true)?.is_none() {
            self.find_edge(towards.other(), speed, true)?;
        }
        // Fast off the switch and onto it again, so that the slow approach below is short wherever the search began.
        self.find_edge(towards.other(), speed, false)?;
        self.find_edge(towards, speed * SLOW_APPROACH.sqrt(), true)?;
        let edge = self.find_edge(towards.other(), speed * SLOW_APPROACH, false)?;
        self.rest()?;
        // Position and target are set together, at rest, so that the motor does not move.
        let position = self.get(axis::POSITION)?.saturating_sub(edge);
        self.set(axis::POSITION, position)?;
        self.set(axis::TARGET, position)
    }

    fn rest(&mut self) -> Result<(), Fault> {
        self.ask(Request::stop)?;
        self.wait_still()
    }

    /// Rotates from rest until the home switch is closed (or open). Returns the position of its edge.
    ///
    /// # Errors
    /// Among others [`Fault::HomeNotFound`]: the limit switch ahead was closed first.
    fn find_edge(&mut self, side: Side, speed: f64, until_closed: bool) -> Result<i32, Fault> {
        self.rest()?;
        self.rotate(side, speed, until_closed)?.ok_or(Fault::HomeNotFound)
    }

    /// Rotates until the home switch is closed (or open), and returns the position of its edge; None if the limit switch ahead is closed first.
    fn rotate(&mut self, side: Side, speed: f64, until_closed: bool) -> Result<Option<i32>, Fault> {
        let (velocity, limit) = (self.table.velocity(speed), self.longest_search().mul_f64(1.0 / SLOW_APPROACH));
        let request = if side == Side::Left { Request::rotate_left } else { Request::rotate_right };
        if self.limit_closed(side)? {
            return Ok(None);
        }
        let first = self.get(axis::POSITION)?;
        let travel = 1.5 * self.table.largest_angle_deg * self.table.steps_per_degree();
        self.ask(|a, m| request(a, m, velocity))?;
        let (start, mut moved, mut last) = (Instant::now(), Instant::now(), None);
        loop {
            // The switch changed between the position before and the one after.
            let before = self.get(axis::POSITION)?;
            if self.at_home_switch()? == until_closed {
                let after = self.get(axis::POSITION)?;
                return Ok(Some(((i64::from(before) + i64::from(after)) / 2) as i32));
            }
            if self.limit_closed(side)? {
                return Ok(None);
            }
            if last != Some(before) {
                (last, moved) = (Some(before), Instant::now());
            }
            self.check_moves(before, moved)?;
            if (f64::from(before) - f64::from(first)).abs() > travel {
                return Err(Fault::HomeNotFound);
            }
            if start.elapsed() > limit {
                return Err(Fault::TooLong { what: "the search for the home switch", limit });
            }
        }
    }

    /// Checks that the motor moved lately.
    ///
    /// # Errors
    /// It did not: it is at a limit switch, or has stalled.
    fn check_moves(&mut self, position: i32, moved: Instant) -> Result<(), Fault> {
        if moved.elapsed() < SEARCH_STALL_TIME {
            return Ok(());
        }
        let angle = self.table.angle(position);
        for side in [Side::Left, Side::Right] {
            if self.limit_closed(side)? {
                return Err(Fault::LimitSwitch { side, angle });
            }
        }
        Err(Fault::Stalled { angle })
    }
}
