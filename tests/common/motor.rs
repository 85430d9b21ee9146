//! The simulated motor: a TMCL module on a pseudo-terminal.

use super::files::MOTOR_PROBE;
use echolume::low_level::probe::ProbeFile;
use echolume::low_level::probe::motor::simulate::{Simulator, SimulatorOptions};
use echolume::low_level::probe::motor::tmcl::{Request, command};
use echolume::low_level::probe::motor::{MotorTable, Parity, PortSettings, StopBits};
use std::path::Path;
use std::time::Duration;

pub fn table() -> MotorTable {
    ProbeFile::read(Path::new(MOTOR_PROBE)).expect("the example is right").motor().expect("and has a motor").clone()
}

pub fn simulated(fault: Option<&str>) -> Simulator {
    let fault = fault.map(|f| f.parse().expect("a fault's name"));
    Simulator::start(SimulatorOptions { table: table(), fault, no_watchdog: false }).expect("a pseudo-terminal")
}

pub fn settings(simulator: &Simulator, timeout_ms: u64) -> PortSettings {
    let (path, timeout) = (simulator.path().to_str().expect("a plain name").into(), Duration::from_millis(timeout_ms));
    PortSettings { path, baud: 9600, parity: Parity::None, stop_bits: StopBits::One, timeout }
}

/// True if the module received a stop after the last request that moves it.
pub fn stopped_at_last(received: &[Request]) -> bool {
    let last = |of: &dyn Fn(&Request) -> bool| received.iter().rposition(of);
    last(&|r| r.command == command::STOP) > last(&|r| r.moves())
}
