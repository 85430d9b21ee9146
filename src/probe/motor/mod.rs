//! The motor that wobbles the array: a stepper behind a TMCL module on a serial port.
//!
//! [`tmcl`] is the protocol and [`port`] the serial port. `guard` stops the motor in every case. [`drive`] finds home and sweeps,
//! [`sweep`] computes the speed and gives each frame its angle and direction, `background_sweep` sweeps on a thread of its own during a
//! stream, and [`simulate`] is a simulated module for tests and demonstrations. A [`MotorError`] is one line with the fault, the port, what
//! to do and whether the motor was stopped.

pub(crate) mod background_sweep;
pub mod drive;
pub(crate) mod guard;
pub mod port;
#[cfg(target_os = "linux")]
pub mod simulate;
pub mod sweep;
pub mod table;
pub mod tmcl;

pub use background_sweep::{BackgroundSweep, PositionLog};
pub use drive::{Drive, MotorStatus};
pub use guard::Interrupter;
pub use port::{Parity, PortSettings, StopBits};
pub use sweep::{ArrayState, Direction, Position, Sweep, Track};
pub use table::MotorTable;

use std::time::Duration;
use table::Side;
use tmcl::status_words;

/// A fault of the motor or its port. Its message says what to do about it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    #[error("the port cannot be opened: {0}; take one that `echolume probe ports` lists and nothing else uses")]
    NotOpened(String),
    #[error(
        "no reply to {request} within {timeout:?}; check the module's power, the cable, --baud, --timeout and the address"
    )]
    NoReply { request: String, timeout: Duration },
    #[error("the reply to {request} is damaged: wrong checksum; check the cable, its ground, --baud and --parity")]
    Checksum { request: String },
    #[error("the module refuses {request}: status {status}, {}; check the [motor] table", status_words(*.status))]
    Refused { request: String, status: u8 },
    #[error("the {} limit switch is closed at {angle:.2} deg; rotate the array off it by hand, then run home", .side.name())]
    LimitSwitch { side: Side, angle: f64 },
    #[error("the motor has stalled at {angle:.2} deg; free the array or lower the acceleration, then run home")]
    Stalled { angle: f64 },
    #[error("the port is gone: {0}; is it unplugged? Plug it in, then run home")]
    Unplugged(String),
    #[error("this is the wrong module: {found}, and not {wanted} as in the probe file; check the cable and --port")]
    WrongModule { found: String, wanted: String },
    #[error("the home switch was not found within the probe's travel; check the switch, home_inverted and home")]
    HomeNotFound,
    #[error("{what} has not ended after {limit:?}; check the speeds in the [motor] table and in the module")]
    TooLong { what: &'static str, limit: Duration },
    #[error("interrupted by {0}")]
    Interrupted(&'static str),
    /// The request exceeds the limits of the probe or the module, or no thread can be started, as the text says. Nothing moved.
    #[error("{0}")]
    OutOfRange(String),
}

/// Whether the motor was stopped after a fault. Its message is what follows that of the fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stopped {
    /// The failed operation did not move the motor and sent no command to stop it.
    #[error("")]
    NotMoved,
    /// The module confirmed the command to stop.
    #[error(". The motor was stopped")]
    Confirmed,
    /// The command to stop was sent, but the module did not confirm it for the given reason.
    #[error(". The motor was told to stop but has not confirmed it ({0}): if it turns, cut its power")]
    Unconfirmed(String),
    /// The port failed while the command to stop was sent or confirmed, for the given reason.
    #[error(". The motor could not be stopped: {0}: cut its power")]
    Failed(String),
}

/// A fault, the port and the operation at which it occurred, and whether the motor was stopped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{port}: {operation}: {fault}{stopped}")]
pub struct MotorError {
    pub port: String,
    /// The operation that failed: "sweep", "home" ...
    pub operation: &'static str,
    pub fault: Fault,
    pub stopped: Stopped,
}
