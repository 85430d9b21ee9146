//! A motor that turns the array beside a stream of frames, and places them: the arguments, and what follows from them.

use super::serial::{Serial, fault, table};
use super::{Failure, failed, input};
use echolume::probe::ProbeFile;
use echolume::probe::motor::{Drive, MotorTable, Settings, Sweep, Turning};
use echolume::source::live::Live;
use echolume::source::swept::{Clock, Options, Swept};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub struct Driven {
    /// Serial port of the motor that turns the array: frames are placed by where it is. Needs a probe file with a [motor] table
    #[arg(long, value_name = "PORT", requires_all = ["angle", "sweeps"])]
    motor: Option<String>,
    /// The motor's sweep from end to end, degrees; a pitch wider than the frames lie, so that none is taken while it turns round
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
    /// What is to be driven, if anything. `recording`: the file that is played, whose own probe file may say how.
    pub fn checked(&self, probe: Option<&PathBuf>, recording: Option<&Path>) -> Result<Option<Driving<'_>>, Failure> {
        let (Some(port), Some(angle), Some(rate)) = (&self.motor, self.angle, self.sweeps) else { return Ok(None) };
        if !(0.0..=10_000.0).contains(&self.delay) {
            return Err(input(format!("--delay {}: must be 0 to 10000 ms", self.delay)));
        }
        let beside = recording.and_then(ProbeFile::beside);
        let table = table(probe.or(beside.as_ref()))?
            .ok_or_else(|| input("--motor needs --probe FILE, whose [motor] table says how far to turn"))?;
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
