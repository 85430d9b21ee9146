//! The motor that wobbles the array: a stepper behind a TMCL module on a serial port.
//!
//! [`tmcl`] is the protocol and [`port`] the serial port. [`guard`] stops the motor in every case. [`drive`] finds home and sweeps,
//! [`sweep`] computes the speed and gives each frame its angle and direction, [`background_sweep`] sweeps on a thread of its own during
//! a stream, and [`simulate`] is a simulated module for tests and demonstrations.

pub mod background_sweep;
pub mod drive;
pub mod fault;
pub mod guard;
pub mod port;
#[cfg(target_os = "linux")]
pub mod simulate;
pub mod sweep;
pub mod table;
pub mod tmcl;

pub use background_sweep::{BackgroundSweep, PositionLog};
pub use drive::{Drive, MotorStatus};
pub use fault::{Fault, MotorError, Stopped};
pub use guard::Interrupter;
pub use port::{Parity, PortSettings, StopBits};
pub use sweep::{ArrayState, Direction, Position, Sweep, Track};
pub use table::MotorTable;
