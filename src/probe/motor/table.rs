//! The `[motor]` table of a probe file, and conversions between degrees and the units of the module. Angles are those of the sweep, in
//! degrees: 0 in the middle, increasing forwards.

use crate::tree::{Defaults, FromNode, Name};

/// Clock of the motion controllers whose velocities are not in microsteps a second, Hz.
const TMC429_CLOCK: f64 = 16e6;

/// How the motor finds home, the position from which all others are counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode)]
#[tree(rename_all = "kebab-case")]
pub enum Home {
    /// The module does its own reference search (the TMCL command RFS), in the mode that is set in the module.
    #[default]
    ReferenceSearch,
    /// The motor rotates until the home switch closes, and slowly back until it opens; there is home.
    Switch,
}

/// A direction of rotation of the motor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, Name)]
#[tree(rename_all = "lowercase")]
pub enum Side {
    /// Towards smaller position counts of the module.
    #[default]
    Left,
    /// Towards larger position counts of the module.
    Right,
}

impl Side {
    pub fn other(self) -> Side {
        if self == Side::Left { Side::Right } else { Side::Left }
    }
}

/// Unit in which the module states velocities and accelerations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode)]
#[tree(rename_all = "lowercase")]
pub enum Units {
    /// Microsteps/s and microsteps/s2.
    #[default]
    Pps,
    /// Integers from 0 to 2047. The pulse divisor (axis parameter 154) scales velocities; it and the ramp divisor (153) scale accelerations.
    Tmc429,
}

/// The `[motor]` table of a probe file. `tests/data/motor/probe.toml` is a commented example. Its `Default`, the values below, is the table of the
/// simulated module; keys that a file may leave out have values of their own.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode)]
#[tree(deny_unknown_fields)]
pub struct MotorTable {
    /// Full steps in one revolution of the motor, 4 to 10000.
    #[value(200)]
    pub steps_per_turn: u32,
    /// Microsteps in a full step, as set in the module: a power of 2 from 1 to 256.
    #[value(16)]
    pub microsteps: u32,
    /// Revolutions of the motor for one revolution of the array, 0.001 to 10000.
    #[value(12.0)]
    pub gear: f64,
    /// True if increasing positions of the motor move the array towards smaller angles.
    #[tree(default)]
    pub reversed: bool,
    /// Address of the module in TMCL requests, 1 to 255.
    #[tree(default = "one")]
    #[value(1)]
    pub address: u8,
    /// Number of the motor's axis in its module, 0 to 5.
    #[tree(default)]
    pub motor: u8,
    /// Type of the module that the firmware has to report (1140 for a TMCM-1140); None: any TMCL module.
    #[value(Some(1140))]
    pub module: Option<u16>,
    #[tree(default)]
    pub home: Home,
    /// Direction in which the home switch is searched for first, with `home = 'switch'`.
    #[tree(default)]
    pub home_direction: Side,
    /// True if the input of the home switch reads 0 while the switch is closed; false if it then reads 1.
    #[tree(default)]
    pub home_inverted: bool,
    /// Angle of the array at home, degrees; 0 is the middle of the sweep.
    #[tree(default)]
    pub home_angle_deg: f64,
    /// Speed of the array while home is searched, deg/s. None: the module's own speed for its reference search; for a search by the switch 10, or the
    /// largest speed if that is lower.
    #[value(Some(30.0))]
    pub search_speed_deg_per_s: Option<f64>,
    /// Largest angle of a sweep from end to end, degrees, up to 360.
    #[value(85.0)]
    pub largest_angle_deg: f64,
    /// Largest number of passes (volumes) a second, up to 100.
    #[value(5.0)]
    pub largest_rate: f64,
    /// Largest speed of the array, deg/s.
    #[value(600.0)]
    pub largest_speed_deg_per_s: f64,
    /// Acceleration of the array at both ends of a pass, deg/s2. The motor must be able to follow it under its load.
    #[value(8000.0)]
    pub acceleration_deg_per_s2: f64,
    #[tree(default)]
    pub units: Units,
    /// Pulse divisor that is set in the module, 0 to 13; used only with `units = 'tmc429'`.
    #[tree(default)]
    pub pulse_divisor: u8,
    #[tree(default)]
    pub ramp_divisor: u8,
    /// Time-out of the module's own watchdog, 100 to 65535 ms: the module stops the motor if no command arrives for this time. 0 switches
    /// the watchdog off. None leaves the setting of the module unchanged.
    #[value(Some(2000))]
    pub watchdog_ms: Option<u16>,
}

fn one() -> u8 {
    1
}

impl MotorTable {
    /// Checks that all fields are in their ranges.
    ///
    /// # Errors
    /// The first field that is out of its range, and what is wrong with it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let limits = [
            ("motor.steps_per_turn", f64::from(self.steps_per_turn), 4.0, 1e4),
            ("motor.microsteps", f64::from(self.microsteps), 1.0, 256.0),
            ("motor.gear", self.gear, 1e-3, 1e4),
            ("motor.address", f64::from(self.address), 1.0, 255.0),
            ("motor.motor", f64::from(self.motor), 0.0, 5.0),
            ("motor.home_angle_deg", self.home_angle_deg, -180.0, 180.0),
            ("motor.search_speed_deg_per_s", self.search_speed_deg_per_s.unwrap_or(1.0), 0.01, 1e4),
            ("motor.largest_angle_deg", self.largest_angle_deg, 0.1, 360.0),
            ("motor.largest_rate", self.largest_rate, 0.01, 100.0),
            ("motor.largest_speed_deg_per_s", self.largest_speed_deg_per_s, 0.01, 1e5),
            ("motor.acceleration_deg_per_s2", self.acceleration_deg_per_s2, 0.01, 1e7),
            ("motor.pulse_divisor", f64::from(self.pulse_divisor), 0.0, 13.0),
            ("motor.ramp_divisor", f64::from(self.ramp_divisor), 0.0, 13.0),
            ("motor.watchdog_ms", f64::from(self.watchdog_ms.filter(|ms| *ms > 0).unwrap_or(100)), 100.0, 65535.0),
        ];
        for (field, value, least, most) in limits {
            if !(least..=most).contains(&value) {
                return Err((field, format!("is {value}, must be {least} to {most}")));
            }
        }
        if !self.microsteps.is_power_of_two() {
            return Err(("motor.microsteps", format!("is {}, must be 1, 2, 4 ... 256", self.microsteps)));
        }
        if self.search_speed_deg_per_s.is_some_and(|s| s > self.largest_speed_deg_per_s) {
            return Err(("motor.search_speed_deg_per_s", "is above largest_speed_deg_per_s".into()));
        }
        let registers = [
            ("motor.largest_speed_deg_per_s", self.speed_register(self.largest_speed_deg_per_s)),
            ("motor.acceleration_deg_per_s2", self.acceleration_register(self.acceleration_deg_per_s2)),
            ("motor.search_speed_deg_per_s", self.speed_register(self.search_speed())),
        ];
        for (field, register) in registers {
            // The largest pps values are those of the modules' own ramp generators, 2^24 - 1.
            let most = if self.units == Units::Tmc429 { 2047.0 } else { 16_777_215.0 };
            if !(1.0..=most).contains(&register) {
                return Err((field, format!("makes {register:.1} in the module, which takes 1 to {most}")));
            }
        }
        // A sweep needs at least two microsteps, and its ends must fit into an i32.
        if self.largest_angle_deg * self.steps_per_degree() < 2.0 || self.steps_per_degree() > 4e6 {
            return Err(("motor.gear", format!("makes {} microsteps a degree", self.steps_per_degree())));
        }
        Ok(())
    }

    /// Microsteps of the motor that rotate the array by one degree; positive in either direction.
    pub fn steps_per_degree(&self) -> f64 {
        f64::from(self.steps_per_turn) * f64::from(self.microsteps) * self.gear / 360.0
    }

    /// The motor's position, in microsteps from home, that is nearest to an angle of the array in degrees. Saturates.
    pub fn position(&self, angle: f64) -> i32 {
        ((angle - self.home_angle_deg) * self.steps_per_degree() * self.sign()).round() as i32
    }

    /// Angle of the array, degrees, at a position of the motor in microsteps from home.
    pub fn angle(&self, position: i32) -> f64 {
        f64::from(position) * self.sign() / self.steps_per_degree() + self.home_angle_deg
    }

    fn sign(&self) -> f64 {
        if self.reversed { -1.0 } else { 1.0 }
    }

    /// Speed of the array in a search for the home switch and on its way to the start of a sweep, deg/s: `search_speed_deg_per_s`, or if that is None
    /// 10, or the largest speed if that is lower.
    pub fn search_speed(&self) -> f64 {
        self.search_speed_deg_per_s.unwrap_or(self.largest_speed_deg_per_s.min(10.0))
    }

    fn speed_register(&self, speed: f64) -> f64 {
        speed * self.steps_per_degree() * self.speed_scale()
    }

    fn acceleration_register(&self, acceleration: f64) -> f64 {
        acceleration * self.steps_per_degree() * self.acceleration_scale()
    }

    /// One microstep/s in the module's unit of velocity.
    pub(crate) fn speed_scale(&self) -> f64 {
        match self.units {
            Units::Pps => 1.0,
            // TMC429 data sheet: v = clock * velocity / (2^pulse_divisor * 2048 * 32).
            Units::Tmc429 => 2f64.powi(i32::from(self.pulse_divisor) + 16) / TMC429_CLOCK,
        }
    }

    /// One microstep/s2 in the module's unit of acceleration.
    pub(crate) fn acceleration_scale(&self) -> f64 {
        match self.units {
            Units::Pps => 1.0,
            // TMC429 data sheet: a = clock^2 * acceleration / 2^(pulse_divisor + ramp_divisor + 29).
            Units::Tmc429 => {
                2f64.powi(i32::from(self.pulse_divisor) + i32::from(self.ramp_divisor) + 29) / TMC429_CLOCK.powi(2)
            }
        }
    }

    /// Converts a speed of the array, deg/s, to the module's unit of velocity, at least 1.
    pub fn velocity(&self, speed: f64) -> i32 {
        (self.speed_register(speed).round() as i32).max(1)
    }

    /// Converts a velocity in the module's unit to a speed of the array, deg/s. The velocity is positive towards larger
    /// positions, the speed towards larger angles.
    pub fn speed(&self, velocity: i32) -> f64 {
        f64::from(velocity) / self.speed_scale() / self.steps_per_degree() * self.sign()
    }

    /// Converts an acceleration of the array, deg/s2, to the module's unit, at least 1.
    pub fn acceleration(&self, acceleration: f64) -> i32 {
        (self.acceleration_register(acceleration).round() as i32).max(1)
    }
}
