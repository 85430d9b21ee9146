//! The motor: the protocol, units, positions to angles; and home, sweep, stop and every fault over a simulated module on a
//! pseudo-terminal, through the library and through the program; frames that the motor places. No assertion is on how long anything takes.

mod library;
mod program;
mod table;
mod tmcl;
mod tracking;

use echolume::probe::ProbeFile;
use echolume::probe::motor::simulate::{Options, Simulator};
use echolume::probe::motor::tmcl::{Request, command};
use echolume::probe::motor::{MotorTable, Settings};
use std::path::Path;
use std::time::{Duration, Instant};

pub const PROBE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/motor/probe.toml");

pub fn table() -> MotorTable {
    ProbeFile::read(Path::new(PROBE)).expect("the example is right").motor().expect("and has a motor").clone()
}

pub fn simulated(fault: Option<&str>) -> Simulator {
    let fault = fault.map(|f| f.parse().expect("a fault's name"));
    Simulator::start(Options { table: table(), fault, no_watchdog: false }).expect("a pseudo-terminal")
}

pub fn settings(simulator: &Simulator, timeout_ms: u64) -> Settings {
    let path = simulator.path().to_str().expect("a plain name");
    Settings { timeout: Duration::from_millis(timeout_ms), ..Settings::new(path) }
}

/// Waits until something is so; whether it was within half a minute, which is for a machine busy with other things.
pub fn eventually(mut so: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(30) {
        if so() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    false
}

/// The module was told to stop after the last thing that moves it.
pub fn stopped_at_last(received: &[Request]) -> bool {
    let last = |of: &dyn Fn(&Request) -> bool| received.iter().rposition(of);
    last(&|r| r.command == command::STOP) > last(&|r| r.moves())
}
