//! The simulated TMCL module and what hangs on it: ramps, a load with inertia, a position counter, switches.
//!
//! The shaft's own position counts from the edge of the home switch, in microsteps; the module's counter starts at 0 wherever
//! the shaft is, until a search. The home switch is a flag over half the travel: closed left of home (right of it where
//! `home_direction` is right). A reference search goes straight there. It is a model of the protocol and of how a motor moves, not of any one product's firmware.

use crate::probe::motor::table::{MotorTable, Side};
use crate::probe::motor::tmcl::{self, Reply, Request, SUCCESS, axis, command};
use std::collections::BTreeMap;
use std::time::Duration;

/// Longest step of the integration, s.
const STEP: f64 = 5e-4;
/// Where the shaft is when the module is switched on, degrees from home.
const BEGIN: f64 = 7.0;
/// How far beyond the largest sweep the limit switches are, degrees.
const BEYOND: f64 = 3.0;
/// Status codes.
const BAD_COMMAND: u8 = 2;
const BAD_TYPE: u8 = 3;
const BAD_VALUE: u8 = 4;

/// What the module is carrying out.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Doing {
    /// Microsteps a second.
    Velocity(f64),
    /// The module's counter, microsteps.
    Position(f64),
    Search,
}

/// The module and its motor.
#[derive(Debug)]
pub struct Module {
    table: MotorTable,
    /// Number in the firmware's version.
    pub number: u16,
    /// Whether it has a watchdog.
    pub watchdog: bool,
    /// The load takes no steeper ramp: beyond it the motor stalls. Microsteps a second squared.
    pub strength: f64,
    /// The rotor does not follow any more, and the module has noticed and stopped.
    pub stalled: bool,
    /// The right limit switch is closed wherever the shaft is.
    pub limit_closed: bool,
    doing: Doing,
    /// Microsteps from the home switch's edge.
    shaft: f64,
    /// The counter less the shaft.
    offset: f64,
    /// Microsteps a second.
    speed: f64,
    axes: BTreeMap<u8, i32>,
    watchdog_ms: i32,
    since_command: f64,
}

impl Module {
    pub fn new(table: &MotorTable) -> Module {
        let shaft = BEGIN * table.steps_per_degree();
        let mut axes = BTreeMap::from([(axis::SEARCH_MODE, 1), (axis::SWITCH_SPEED, 1)]);
        axes.insert(axis::LARGEST_SPEED, table.velocity(table.search_speed()));
        axes.insert(axis::SEARCH_SPEED, table.velocity(table.search_speed()));
        axes.insert(axis::LARGEST_ACCELERATION, table.acceleration(table.acceleration_deg_per_s2));
        Module {
            number: table.module.unwrap_or(1140),
            watchdog: true,
            strength: 3.0 * table.acceleration_deg_per_s2 * table.steps_per_degree(),
            stalled: false,
            limit_closed: false,
            doing: Doing::Velocity(0.0),
            shaft,
            offset: -shaft,
            speed: 0.0,
            axes,
            watchdog_ms: 0,
            since_command: 0.0,
            table: table.clone(),
        }
    }

    /// Degrees of the array in the sweep, whatever the counter says.
    pub fn angle(&self) -> f64 {
        self.table.angle(self.shaft.round() as i32)
    }

    /// The motor turns, or would.
    pub fn turning(&self) -> bool {
        self.speed != 0.0
    }

    fn register(&self, parameter: u8) -> f64 {
        self.axes.get(&parameter).copied().map_or(0.0, f64::from)
    }

    fn limits(&self) -> [f64; 2] {
        let half = self.table.largest_angle_deg / 2.0 + BEYOND;
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

    /// Lets time pass. `idle`: no command is waiting to be read, so the watchdog may bark.
    pub fn pass(&mut self, time: Duration, idle: bool) {
        let mut left = time.as_secs_f64();
        self.since_command += left;
        if idle && self.watchdog && self.watchdog_ms > 0 && self.since_command * 1e3 > f64::from(self.watchdog_ms) {
            self.doing = Doing::Velocity(0.0);
        }
        while left > 0.0 {
            let step = left.min(STEP);
            self.step(step);
            left -= step;
        }
    }

    fn step(&mut self, time: f64) {
        let acceleration = self.register(axis::LARGEST_ACCELERATION) / self.table.acceleration_scale();
        let towards = |from: f64, to: f64, most: f64| {
            // As fast as can still be braked, a little less for the size of the steps.
            let fast = (1.9 * acceleration * (to - from).abs()).sqrt();
            fast.min(most).copysign(to - from)
        };
        let (wanted, end) = match self.doing {
            Doing::Velocity(velocity) => (velocity, None),
            Doing::Position(target) => {
                let most = self.register(axis::LARGEST_SPEED) / self.table.speed_scale();
                let end = target - self.offset;
                (towards(self.shaft, end, most), Some(end))
            }
            Doing::Search => {
                let most = self.register(axis::SEARCH_SPEED) / self.table.speed_scale();
                (towards(self.shaft, 0.0, most), Some(0.0))
            }
        };
        if self.stalled {
            self.halt();
            return;
        }
        let change = (wanted - self.speed).clamp(-acceleration * time, acceleration * time);
        if change != 0.0 && acceleration > self.strength {
            self.stalled = true;
        }
        self.speed += change;
        let before = self.shaft;
        self.shaft += self.speed * time;
        if let Some(end) = end {
            let crossed = (before - end) * (self.shaft - end) <= 0.0;
            if (crossed || (self.shaft - end).abs() < 0.5) && self.speed.abs() <= 4.0 * acceleration * time {
                (self.shaft, self.speed) = (end, 0.0);
                if self.doing == Doing::Search {
                    self.offset = 0.0;
                    self.doing = Doing::Velocity(0.0);
                }
            }
        }
        let ahead = if self.speed > 0.0 { Side::Right } else { Side::Left };
        if self.speed != 0.0 && self.closed(ahead) {
            self.halt();
        }
    }

    /// Stands at once. A search goes on by itself no more.
    fn halt(&mut self) {
        self.speed = 0.0;
        if let Doing::Velocity(_) | Doing::Position(_) = self.doing {
            self.doing = Doing::Velocity(0.0);
        }
    }

    fn counter(&self) -> i32 {
        (self.shaft + self.offset).round() as i32
    }

    /// Carries a request out.
    pub fn answer(&mut self, request: &Request) -> Reply {
        self.since_command = 0.0;
        let (status, value) = match self.carry_out(request) {
            Ok(value) => (SUCCESS, value),
            Err(status) => (status, 0),
        };
        Reply { host: 2, module: self.table.address, status, command: request.command, value }
    }

    fn carry_out(&mut self, request: &Request) -> Result<i32, u8> {
        let Request { command, kind, motor, value, .. } = *request;
        let of_axis = matches!(command, command::ROTATE_RIGHT..=command::GET_AXIS | command::REFERENCE_SEARCH);
        if of_axis && motor != self.table.motor {
            return Err(BAD_VALUE);
        }
        match command {
            command::ROTATE_RIGHT => self.doing = Doing::Velocity(f64::from(value) / self.table.speed_scale()),
            command::ROTATE_LEFT => self.doing = Doing::Velocity(-f64::from(value) / self.table.speed_scale()),
            command::STOP => self.doing = Doing::Velocity(0.0),
            command::MOVE_TO => match kind {
                0 => self.doing = Doing::Position(f64::from(value)),
                1 => self.doing = Doing::Position(f64::from(self.counter()) + f64::from(value)),
                _ => return Err(BAD_TYPE),
            },
            command::SET_AXIS => return self.set(kind, value),
            command::GET_AXIS => return self.get(kind),
            command::SET_GLOBAL if kind == tmcl::WATCHDOG && self.watchdog => self.watchdog_ms = value,
            command::GET_GLOBAL if kind == tmcl::WATCHDOG && self.watchdog => return Ok(self.watchdog_ms),
            command::SET_GLOBAL | command::GET_GLOBAL => return Err(BAD_TYPE),
            command::REFERENCE_SEARCH => match kind {
                0 => self.doing = Doing::Search,
                1 if self.doing == Doing::Search => self.doing = Doing::Velocity(0.0),
                1 => {}
                2 => return Ok(i32::from(self.doing == Doing::Search)),
                _ => return Err(BAD_TYPE),
            },
            command::GET_INPUT => return Ok(0),
            command::VERSION => return Ok(i32::from(self.number) << 16 | 0x0110),
            _ => return Err(BAD_COMMAND),
        }
        Ok(value)
    }

    fn set(&mut self, parameter: u8, value: i32) -> Result<i32, u8> {
        match parameter {
            axis::TARGET => self.doing = Doing::Position(f64::from(value)),
            axis::POSITION => self.offset = f64::from(value) - self.shaft,
            axis::LARGEST_SPEED | axis::LARGEST_ACCELERATION | axis::SEARCH_SPEED | axis::SWITCH_SPEED if value < 0 => {
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
            axis::TARGET => match self.doing {
                Doing::Position(target) => target as i32,
                _ => self.counter(),
            },
            axis::POSITION => self.counter(),
            axis::SPEED => (self.speed * self.table.speed_scale()).round() as i32,
            axis::REACHED => i32::from(matches!(self.doing, Doing::Position(t) if t as i32 == self.counter())),
            axis::HOME_SWITCH => i32::from(self.home_closed()),
            axis::RIGHT_LIMIT => i32::from(self.closed(Side::Right)),
            axis::LEFT_LIMIT => i32::from(self.closed(Side::Left)),
            other => *self.axes.get(&other).ok_or(BAD_TYPE)?,
        })
    }
}
