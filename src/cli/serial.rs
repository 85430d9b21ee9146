//! The serial line to the motor's module: the arguments of every command that drives it, and what is common to its failures.

use super::{Failure, failed, input};
use crate::probe::ProbeFile;
use crate::probe::motor::{Fault, MotorError, MotorTable, Parity, Settings, StopBits};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

#[derive(Clone, Args)]
pub struct Serial {
    /// Bits a second to the motor
    #[arg(long, value_name = "N", default_value_t = 9600, value_parser = clap::value_parser!(u32).range(300..=4_000_000))]
    baud: u32,
    /// Of the line to the motor
    #[arg(long, value_name = "PARITY", default_value = "none")]
    parity: ParityName,
    /// 1 or 2
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=2))]
    stop_bits: u8,
    /// Longest wait for a reply of the motor, ms
    #[arg(long, value_name = "MS", default_value_t = 500, value_parser = clap::value_parser!(u64).range(20..=10_000))]
    timeout: u64,
}

#[derive(Clone, Copy, ValueEnum)]
enum ParityName {
    None,
    Even,
    Odd,
}

impl Serial {
    pub fn settings(&self, port: &str) -> Settings {
        Settings {
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

/// Bad input where the fault is in what was asked, failed where it is in the motor.
pub fn fault(error: MotorError) -> Failure {
    match error.fault {
        Fault::OutOfRange(_) => input(error),
        _ => failed(error),
    }
}

/// The [motor] table of a probe file, where one is given.
pub fn table(file: Option<&PathBuf>) -> Result<Option<MotorTable>, Failure> {
    let Some(file) = file else { return Ok(None) };
    motor_of(&ProbeFile::read(file).map_err(input)?).map(Some)
}

/// The [motor] table, which must be there.
pub fn motor_of(probe: &ProbeFile) -> Result<MotorTable, Failure> {
    probe.motor().cloned().ok_or_else(|| input(format!("{}: has no [motor] table", probe.path().display())))
}
