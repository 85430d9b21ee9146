//! The motor that wobbles the array: a stepper behind a TMCL module on a serial port.
//!
//! [`tmcl`] is the protocol and [`port`] the line; [`guard`] stops the motor whatever happens; [`drive`] finds home and sweeps;
//! [`sweep`] gives each frame its angle and direction; [`turning`] sweeps on a thread of its own beside a stream of frames;
//! [`simulate`] is a module for those who have none.

pub mod drive;
pub mod fault;
pub mod guard;
mod home;
pub mod port;
#[cfg(target_os = "linux")]
pub mod simulate;
pub mod sweep;
pub mod table;
pub mod tmcl;
pub mod turning;

pub use drive::{Drive, Status};
pub use fault::{Fault, MotorError, Stopped};
pub use guard::Interrupter;
pub use port::{Parity, Settings, StopBits};
pub use sweep::{Direction, Place, Position, Sweep, Track};
pub use table::MotorTable;
pub use turning::{Turning, Watch};
