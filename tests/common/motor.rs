//! The simulated motor: a TMCL module on a pseudo-terminal.

use super::files::MOTOR_PROBE;
use echolume::probe::ProbeFile;
use echolume::probe::motor::simulate::{Options, Simulator};
use echolume::probe::motor::tmcl::{Request, command};
use echolume::probe::motor::{MotorTable, Settings};
use std::path::Path;
use std::time::Duration;

pub fn table() -> MotorTable {
    ProbeFile::read(Path::new(MOTOR_PROBE)).expect("the example is right").motor().expect("and has a motor").clone()
}

pub fn simulated(fault: Option<&str>) -> Simulator {
    let fault = fault.map(|f| f.parse().expect("a fault's name"));
    Simulator::start(Options { table: table(), fault, no_watchdog: false }).expect("a pseudo-terminal")
}

pub fn settings(simulator: &Simulator, timeout_ms: u64) -> Settings {
    let path = simulator.path().to_str().expect("a plain name");
    Settings { timeout: Duration::from_millis(timeout_ms), ..Settings::new(path) }
}

/// The module was told to stop after the last thing that moves it.
pub fn stopped_at_last(received: &[Request]) -> bool {
    let last = |of: &dyn Fn(&Request) -> bool| received.iter().rposition(of);
    last(&|r| r.command == command::STOP) > last(&|r| r.moves())
}
