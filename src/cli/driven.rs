//! A motor that turns the array beside a stream of frames, and places them: the arguments, and what follows from them.

use super::serial::{Serial, fault, motor_of};
use super::{Failure, failed, input};
use crate::probe::ProbeFile;
use crate::probe::motor::{Drive, MotorTable, Settings, Sweep, Turning};
use crate::source::live::Live;
use crate::source::motor_tracking::{Clock, Options, Swept};
use std::path::Path;

/// The motor's sweep, of what the frames lie over.
const WIDER: f64 = 1.05;

#[derive(Clone, clap::Args)]
pub struct Driven {
    /// Serial port of the motor that turns the array: frames are placed by where it is. Needs a probe file with a [motor] table
    #[arg(long, value_name = "PORT", requires = "sweeps")]
    motor: Option<String>,
    /// The motor's sweep from end to end, degrees [default: a twentieth wider than the frames lie, which leaves it room to turn round]
    #[arg(long, value_name = "DEG", requires = "motor")]
    angle: Option<f64>,
    /// Passes of the motor over the angle, and so volumes, a second
    #[arg(long, value_name = "RATE", requires = "motor")]
    sweeps: Option<f64>,
    /// Home was found before and the module has not been off since: do not look for it
    #[arg(long, requires = "motor")]
    homed: bool,
    /// From a frame's last line to its arrival here, ms
    #[arg(long, value_name = "MS", requires = "motor", conflicts_with = "stamps", default_value_t = 0.0)]
    delay: f64,
    /// Frames are stamped with the time of their first line, s since 1970 by this machine's clock
    #[arg(long, requires = "motor")]
    stamps: bool,
    #[command(flatten)]
    serial: Serial,
}

/// A sweep that the motor can do. Nothing has been touched yet.
pub struct Driving<'a> {
    arguments: &'a Driven,
    settings: Settings,
    table: MotorTable,
    sweep: Sweep,
    /// Degrees a second between the ramps.
    pub speed: f64,
}

impl Driven {
    /// What can be told before anything is opened.
    pub fn check(&self) -> Result<(), Failure> {
        match (0.0..=10_000.0).contains(&self.delay) {
            true => Ok(()),
            false => Err(input(format!("--delay {}: must be 0 to 10000 ms", self.delay))),
        }
    }

    /// What is to be driven, if anything. `recording`: the file that is played, whose own probe file may say how. `fan`: what the
    /// frames lie over, degrees, where that does not come from the probe file.
    pub fn checked(
        &self,
        probe: Option<&Path>,
        recording: Option<&Path>,
        fan: Option<f64>,
    ) -> Result<Option<Driving<'_>>, Failure> {
        let (Some(port), Some(rate)) = (&self.motor, self.sweeps) else { return Ok(None) };
        self.check()?;
        let Some(file) = probe.map(Path::to_path_buf).or(recording.and_then(ProbeFile::beside)) else {
            return Err(input("--motor needs --probe FILE, whose [motor] table says how far to turn"));
        };
        let probe = ProbeFile::read(&file).map_err(input)?;
        let table = motor_of(&probe)?;
        let widened = || fan.or(probe.fan_angle()).map(|fan| (WIDER * fan).min(table.largest_angle_deg));
        let Some(angle) = self.angle.or_else(widened) else {
            return Err(input(format!("--angle DEG is needed: {} has no fan", file.display())));
        };
        let (settings, sweep) = (self.serial.settings(port), Sweep { angle, rate, volumes: None });
        // The sweep names the flags of `echolume probe sweep`.
        let speed = sweep.speed(&table, settings.round_trip());
        let speed = speed.map_err(|fault| input(fault.to_string().replace("--rate", "--sweeps")))?;
        Ok(Some(Driving { arguments: self, settings, table, sweep, speed }))
    }
}

impl Driving<'_> {
    /// The motor begins to look for home.
    pub fn start(&self) -> Result<Turning, Failure> {
        let drive = Drive::open(&self.settings, &self.table).map_err(fault)?;
        Turning::start(drive, self.sweep, self.arguments.homed).map_err(failed)
    }

    /// `holds`: see [`Options::holds`].
    pub fn place(&self, source: Box<dyn Live>, motor: Turning, holds: bool) -> Box<dyn Live> {
        let clock = match self.arguments.stamps {
            true => Clock::Stamp,
            false => Clock::Arrival { delay: self.arguments.delay * 1e-3 },
        };
        Box::new(Swept::new(source, motor, Options { clock, holds }))
    }
}
