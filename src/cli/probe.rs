//! `echolume probe`: drives the motor of a probe.

use crate::args::{SerialArgs, check_outputs, motor_failure, motor_table};
use crate::files::replace;
use crate::files::signals::Held;
use crate::probe::motor::{Drive, Fault, MotorError, MotorTable, PortSettings, Position, Sweep, port};
use crate::terminal::{Failure, failed, input, say};
use clap::{Args, Subcommand};
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

const KILLED: &str = "A command that moves the motor stops it when it ends, fails, panics, or gets SIGINT, SIGTERM or SIGHUP. Every \
command stops it if the module does not answer as it should. A process that is killed outright (SIGKILL, power) cannot stop it. Where the module has a watchdog (TMCL global parameter 68, \"serial \
heartbeat\"; `probe status` says so), set watchdog_ms = 1000 in the [motor] table: the module then stops the motor itself when \
no command has come for so long. home and sweep write it into the module, which keeps it. Where it has none, keep a switch for \
the motor's power at hand.\n\nExit codes: 0 done, also if a signal ends a sweep without --volumes, 1 failed, 2 bad input.";

#[derive(Args)]
#[command(after_help = KILLED)]
pub struct Probe {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// List the serial ports
    Ports,
    /// Print the module, the motor's position and its switches; nothing moves
    #[command(after_help = KILLED)]
    Status(Line),
    /// Find the home position, the origin of angles
    #[command(after_help = KILLED)]
    Home(Line),
    /// Find the home position, then sweep back and forth over an angle
    #[command(after_help = KILLED)]
    Sweep(SweepArguments),
    /// Stop the motor
    #[command(after_help = KILLED)]
    Stop(Line),
    /// Simulate a module on a pseudo-terminal until SIGINT; prints its path
    #[cfg(target_os = "linux")]
    Simulate(Simulate),
}

/// The serial port of the module, and the motor behind it.
#[derive(Args)]
struct Line {
    /// Serial port, such as /dev/ttyUSB0; `echolume probe ports` lists all
    #[arg(long, value_name = "PORT")]
    port: String,
    /// Probe file whose [motor] table describes the motor; home and sweep need it
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
    #[command(flatten)]
    serial: SerialArgs,
}

#[derive(Args)]
struct SweepArguments {
    #[command(flatten)]
    line: Line,
    /// Sweep from end to end, degrees
    #[arg(long, value_name = "DEG")]
    angle: f64,
    /// Sweeps, and so volumes, per second
    #[arg(long, value_name = "RATE")]
    rate: f64,
    /// Number of sweeps [default: until SIGINT]
    #[arg(long, value_name = "N")]
    volumes: Option<usize>,
    /// Write the array's positions: time in s since the sweep began, angle in degrees, direction
    #[arg(long, value_name = "FILE.csv")]
    positions: Option<PathBuf>,
    /// Skip homing: the home position is known and the module has stayed on since
    #[arg(long)]
    homed: bool,
}

#[cfg(target_os = "linux")]
#[derive(Args)]
struct Simulate {
    /// Probe file whose [motor] table describes the simulated module [default: a motor of 200 steps, geared 12 to 1]
    #[arg(long, value_name = "FILE")]
    probe: Option<PathBuf>,
    /// Fault to inject: mute, checksum, limit-switch, stall, unplugged, wrong-module, noise, slow; with @SECONDS that long after
    /// the sweep began
    #[arg(long, value_name = "NAME[@SECONDS]")]
    fault: Option<crate::probe::motor::simulate::SimulatedFault>,
    /// Simulate a module without a watchdog
    #[arg(long)]
    no_watchdog: bool,
}

impl Probe {
    pub fn run(&self) -> Result<(), Failure> {
        match &self.action {
            Action::Ports => ports(),
            Action::Status(line) => status(line),
            Action::Home(line) => home(line),
            Action::Sweep(sweep) => sweep.run(),
            Action::Stop(line) => stop(line),
            #[cfg(target_os = "linux")]
            Action::Simulate(simulate) => simulate.run(),
        }
    }
}

impl Line {
    fn settings(&self) -> PortSettings {
        self.serial.settings(&self.port)
    }

    /// The table of the probe file. Commands that move nothing accept any module at the default address.
    fn any_table(&self) -> Result<MotorTable, Failure> {
        Ok(motor_table(self.probe.as_ref())?.unwrap_or(MotorTable { module: None, ..MotorTable::default() }))
    }

    fn table(&self) -> Result<MotorTable, Failure> {
        motor_table(self.probe.as_ref())?
            .ok_or_else(|| input("--probe FILE is needed: its [motor] table says how far to turn"))
    }
}

fn ports() -> Result<(), Failure> {
    let ports = port::list().map_err(failed)?;
    if ports.is_empty() {
        say!("no serial ports: plug the module in, or try `echolume probe simulate`");
    }
    for (name, about) in ports {
        say!("{name} ({about})");
    }
    Ok(())
}

fn status(line: &Line) -> Result<(), Failure> {
    let table = line.any_table()?;
    let mut drive = Drive::open(&line.settings(), &table).map_err(motor_failure)?;
    let status = drive.status().map_err(motor_failure)?;
    say!("module: {}", status.module);
    if line.probe.is_some() {
        say!("angle: {:.3} deg, if home was found since power-on", status.angle);
        say!("speed: {:.3} deg/s", status.speed);
    } else {
        say!("motor: {}; its angle needs --probe", if status.speed == 0.0 { "at rest" } else { "turning" });
    }
    let word = |closed| if closed { "closed" } else { "open" };
    say!(
        "switches: home {}, left limit {}, right limit {}",
        word(status.home_switch),
        word(status.left_limit),
        word(status.right_limit)
    );
    match status.watchdog {
        None => say!("watchdog: none: if the program is killed, the motor is not stopped"),
        Some(Duration::ZERO) => say!("watchdog: off: set watchdog_ms in the [motor] table"),
        Some(time) => say!("watchdog: stops the motor after {time:?} without a command"),
    }
    Ok(())
}

fn home(line: &Line) -> Result<(), Failure> {
    let table = line.table()?;
    let mut drive = Drive::open(&line.settings(), &table).map_err(motor_failure)?;
    drive.home().map_err(motor_failure)?;
    say!("home: found; the array is at {:.3} deg", drive.status().map_err(motor_failure)?.angle);
    Ok(())
}

fn stop(line: &Line) -> Result<(), Failure> {
    Drive::stop_at(&line.settings(), &line.any_table()?).map_err(motor_failure)?;
    say!("stopped");
    Ok(())
}

impl SweepArguments {
    fn run(&self) -> Result<(), Failure> {
        let (table, settings) = (self.line.table()?, self.line.settings());
        let sweep = Sweep { angle: self.angle, rate: self.rate, volumes: self.volumes };
        // Check before the port is opened.
        let speed = sweep.speed(&table, settings.round_trip()).map_err(input)?;
        check_outputs(&[("--positions", self.positions.as_deref())], self.line.probe.as_deref())?;
        let mut drive = Drive::open(&settings, &table).map_err(motor_failure)?;
        if !self.homed {
            drive.home().map_err(motor_failure)?;
        }
        say!("sweep: {} deg at {} volumes/s, {speed:.1} deg/s at most", self.angle, self.rate);
        let (mut positions, mut passes, start) = (Vec::new(), 0, Instant::now());
        if self.positions.is_some() {
            say!("time 0 of the positions: {}", humantime::format_rfc3339_micros(SystemTime::now()));
        }
        let swept = drive.sweep(&sweep, start, &mut |position| {
            passes = position.pass;
            if self.positions.is_some() {
                positions.push(position);
            }
        });
        // Keep the positions up to a fault, too.
        let kept = self.positions.as_ref().map_or(Ok(()), |file| replace(file, csv(&positions).as_bytes()));
        match swept {
            Ok(volumes) => say!("swept: {volumes} volumes"),
            // Without --volumes a signal is the normal end.
            Err(MotorError { fault: Fault::Interrupted(signal), stopped, .. })
                if self.volumes.is_none() && stopped == crate::probe::motor::Stopped::Confirmed =>
            {
                say!("swept: {passes} volumes; the motor was stopped by {signal}");
            }
            Err(error) => return Err(motor_failure(error)),
        }
        kept.map_err(failed)
    }
}

fn csv(positions: &[Position]) -> String {
    let mut text = String::from("time_s,angle_deg,direction\n");
    for position in positions {
        text += &format!("{:.6},{:.4},{}\n", position.time, position.angle, position.direction.name());
    }
    text
}

#[cfg(target_os = "linux")]
impl Simulate {
    fn run(&self) -> Result<(), Failure> {
        use crate::probe::motor::simulate::{Simulator, SimulatorOptions};
        let held = Held::take();
        let options = SimulatorOptions {
            table: motor_table(self.probe.as_ref())?.unwrap_or_default(),
            fault: self.fault,
            no_watchdog: self.no_watchdog,
        };
        let simulator = Simulator::start(options).map_err(|e| failed(format!("cannot open a pseudo-terminal: {e}")))?;
        say!("{}", simulator.path().display());
        while held.signal().is_none() && !simulator.ended() {
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(())
    }
}
