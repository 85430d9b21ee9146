//! Arguments of commands that drive the motor of a probe: the serial line, and a motor that sweeps the array while frames arrive.

use super::number::check_number;
use crate::probe::ProbeFile;
use crate::probe::motor::{
    BackgroundSweep, Drive, Fault, MotorError, MotorTable, Parity, PortSettings, StopBits, Sweep,
};
use crate::source::live::Live;
use crate::source::motor_tracking::{Clock, MotorTracked, MotorTrackingOptions};
use crate::terminal::{Failure, failed, input};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Ratio of the motor's default sweep angle to the angle that the frames cover. The rest is for the turning points.
const SWEEP_MARGIN: f64 = 1.05;

/// The arguments for a motor that sweeps the array while frames arrive.
#[derive(Clone, clap::Args)]
pub struct MotorArgs {
    /// Serial port of the motor that sweeps the array. Its position gives each frame its place. Needs a probe file with a [motor] table
    #[arg(long, value_name = "PORT", requires = "sweeps")]
    motor: Option<String>,
    /// The motor's sweep from end to end, degrees [default: 5 % more than the angle of the frames, for the turning points]
    #[arg(long, value_name = "DEG", requires = "motor")]
    angle: Option<f64>,
    /// Sweeps of the motor, and so volumes, per second
    #[arg(long, value_name = "RATE", requires = "motor")]
    sweeps: Option<f64>,
    /// Skip homing: the home position is known and the module has stayed on since
    #[arg(long, requires = "motor")]
    homed: bool,
    /// Delay from a frame's last line to its arrival, ms
    #[arg(long, value_name = "MS", requires = "motor", conflicts_with = "stamps", default_value_t = 0.0)]
    delay: f64,
    /// Frames carry the time of their first line: seconds since 1970 by this machine's clock
    #[arg(long, requires = "motor")]
    stamps: bool,
    #[command(flatten)]
    serial: SerialArgs,
}

/// A sweep that was checked against the limits of the motor. The port is not open yet.
pub struct PlannedSweep<'a> {
    arguments: &'a MotorArgs,
    settings: PortSettings,
    table: MotorTable,
    sweep: Sweep,
    /// Speed of the array between the ramps at both ends, deg/s.
    pub speed: f64,
}

impl MotorArgs {
    /// Checks the values that can be checked without opening the port.
    pub fn check(&self) -> Result<(), Failure> {
        check_number("--delay", self.delay, |ms| (0.0..=10_000.0).contains(&ms), "must be 0 to 10000 ms")
    }

    /// The requested sweep; None without `--motor`. `probe`: path of the probe file. `recording`: path of the recording that is played, whose probe
    /// file is used if `probe` is None. `fan`: angle between the first and the last frame, degrees, from which the angle of the sweep follows unless
    /// `--angle` states it; None: that of the probe file.
    ///
    /// # Errors
    /// `--delay` is out of range, there is no probe file with a motor, the angle of the sweep is not known, or the sweep exceeds the limits of the
    /// motor.
    pub fn plan(
        &self,
        probe: Option<&Path>,
        recording: Option<&Path>,
        fan: Option<f64>,
    ) -> Result<Option<PlannedSweep<'_>>, Failure> {
        let (Some(port), Some(rate)) = (&self.motor, self.sweeps) else { return Ok(None) };
        self.check()?;
        let Some(file) = probe.map(Path::to_path_buf).or(recording.and_then(ProbeFile::find_for)) else {
            return Err(input("--motor needs --probe FILE, whose [motor] table says how far to turn"));
        };
        let probe = ProbeFile::read(&file).map_err(input)?;
        let table = required_motor_table(&probe)?;
        let widened = || fan.or(probe.fan_angle()).map(|fan| (SWEEP_MARGIN * fan).min(table.largest_angle_deg));
        let Some(angle) = self.angle.or_else(widened) else {
            return Err(input(format!("--angle DEG is needed: {} has no fan", file.display())));
        };
        let (settings, sweep) = (self.serial.settings(port), Sweep { angle, rate, volumes: None });
        // The message names the flags of `echolume probe sweep`.
        let speed = sweep.speed(&table, settings.round_trip());
        let speed = speed.map_err(|fault| input(fault.to_string().replace("--rate", "--sweeps")))?;
        Ok(Some(PlannedSweep { arguments: self, settings, table, sweep, speed }))
    }
}

impl PlannedSweep<'_> {
    /// Opens the port, and starts a thread that finds the home position (unless `--homed` is given) and then sweeps.
    pub fn start(&self) -> Result<BackgroundSweep, Failure> {
        let drive = Drive::open(&self.settings, &self.table).map_err(motor_failure)?;
        BackgroundSweep::start(drive, self.sweep, self.arguments.homed).map_err(failed)
    }

    /// The frames of `source`, assigned to slices by the position of `motor`. `holds`: see [`MotorTrackingOptions::holds`].
    pub fn track(&self, source: Box<dyn Live>, motor: BackgroundSweep, holds: bool) -> Box<dyn Live> {
        let clock = match self.arguments.stamps {
            true => Clock::Stamp,
            false => Clock::Arrival { delay: self.arguments.delay * 1e-3 },
        };
        Box::new(MotorTracked::new(source, motor, MotorTrackingOptions { clock, holds }))
    }
}

/// The serial line to the motor's module.
#[derive(Clone, Args)]
pub struct SerialArgs {
    /// Baud rate of the serial line to the motor
    #[arg(long, value_name = "N", default_value_t = 9600, value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: u32,
    /// Parity of the serial line to the motor
    #[arg(long, value_name = "PARITY", default_value = "none")]
    parity: ParityName,
    /// Stop bits of the serial line to the motor, 1 or 2
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    stop_bits: u8,
    /// Time-out for a reply of the motor, ms
    #[arg(long, value_name = "MS", default_value_t = 500, value_parser = clap::value_parser!(u64).range(20..=10_000))]
    timeout: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum ParityName {
    None,
    Even,
    Odd,
}

impl SerialArgs {
    /// The settings for opening the serial port of this name.
    pub fn settings(&self, port: &str) -> PortSettings {
        PortSettings {
            path: port.into(),
            baud: self.baud,
            parity: match self.parity {
                ParityName::None => Parity::None,
                ParityName::Even => Parity::Even,
                ParityName::Odd => Parity::Odd,
            },
            stop_bits: if self.stop_bits == 2 { StopBits::Two } else { StopBits::One },
            timeout: Duration::from_millis(self.timeout),
        }
    }
}

/// The failure of a command that drives the motor: a request out of range is bad input, any other fault is a failure.
pub fn motor_failure(error: MotorError) -> Failure {
    match error.fault {
        Fault::OutOfRange(_) => input(error),
        _ => failed(error),
    }
}

/// The `[motor]` table of a probe file; None if no file is given. An error if the file cannot be read or has no such table.
pub fn motor_table(file: Option<&PathBuf>) -> Result<Option<MotorTable>, Failure> {
    let Some(file) = file else { return Ok(None) };
    required_motor_table(&ProbeFile::read(file).map_err(input)?).map(Some)
}

/// The [motor] table of a probe file.
///
/// # Errors
/// The file has none.
fn required_motor_table(probe: &ProbeFile) -> Result<MotorTable, Failure> {
    probe.motor().cloned().ok_or_else(|| input(format!("{}: has no [motor] table", probe.path().display())))
}
