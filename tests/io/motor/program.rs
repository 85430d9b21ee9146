//! `echolume probe` over the simulated module: messages and exit codes, fault by fault.

use crate::common::files::{Folder, MOTOR_PROBE, data};
use crate::common::motor::{simulated, stopped_at_last};
use crate::common::program::{PROGRAM, Ran, with_default_signals};
use crate::common::wait::eventually;
use echolume::low_level::probe::motor::simulate::Simulator;
use echolume::low_level::probe::motor::tmcl::{Request, command};
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

fn probe(simulator: &Simulator, action: &str, more: &[&str]) -> Command {
    let mut command = with_default_signals();
    command.args(["probe", action, "--probe", MOTOR_PROBE, "--port"]).arg(simulator.path()).args(more);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Waits for the program, which must end by itself.
fn finish(mut child: Child) -> Ran {
    if !eventually(|| child.try_wait().expect("wait for the program").is_some()) {
        child.kill().expect("end the program");
    }
    let output = child.wait_with_output().expect("the program ends");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn run(command: &mut Command) -> Ran {
    finish(command.spawn().expect("start the program"))
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).expect("send a signal");
}

/// A sweep in progress whose pass takes ten seconds.
fn long_sweep(simulator: &Simulator, more: &[&str]) -> Child {
    let arguments = ["--angle", "40", "--rate", "0.1", "--timeout", "2000"];
    let child = probe(simulator, "sweep", &[&arguments, more].concat()).spawn().expect("start the program");
    let moves = || simulator.received().iter().filter(|r| r.command == command::MOVE_TO).count();
    assert!(eventually(|| moves() == 2 && simulator.is_moving()), "the pass begins");
    child
}

#[test]
fn the_fault_matrix() {
    let sweep = ["--angle", "24", "--rate", "4", "--volumes", "8", "--timeout"];
    // Fault, time-out in ms (short only where nothing answers in time, however fast the machine is), exit code, message, whether the module receives a stop (MST).
    let matrix: &[(&str, &str, i32, &[&str], bool)] = &[
        ("mute", "300", 1, &["open: no reply", "power, the cable", "told to stop but has not confirmed"], true),
        ("mute@0.3", "500", 1, &["sweep: no reply to", "told to stop but has not confirmed"], true),
        ("checksum", "2000", 1, &["open: the reply", "wrong checksum", "has not confirmed"], true),
        ("checksum@0.3", "2000", 1, &["sweep: the reply", "wrong checksum", "--baud", "has not confirmed"], true),
        ("limit-switch", "2000", 1, &["sweep: the right limit switch is closed", "The motor was stopped"], true),
        ("limit-switch@0.7", "2000", 1, &["sweep: the right limit switch is closed at", "was stopped"], true),
        ("stall", "2000", 1, &["home: the motor has stalled at", "free the array", "The motor was stopped"], true),
        ("stall@0.3", "2000", 1, &["sweep: the motor has stalled at", "The motor was stopped"], true),
        ("unplugged@0.3", "2000", 1, &["the port is gone", "could not be stopped", "cut its power"], false),
        ("wrong-module", "2000", 1, &["open: this is the wrong module", "3110", "1140", "was stopped"], true),
        ("slow", "300", 1, &["open: no reply", "--timeout", "has not confirmed"], true),
        // Its late replies may confirm the stop.
        ("slow@0.3", "500", 1, &["sweep: no reply"], true),
        ("noise", "2000", 0, &[], false),
        ("noise@0.3", "2000", 0, &[], false),
    ];
    // Two at a time: each waits most of the time, but a simulator must answer within the time-out on a machine that is busy.
    let next = std::sync::atomic::AtomicUsize::new(0);
    let one = || {
        while let Some((fault, timeout, code, named, told)) =
            matrix.get(next.fetch_add(1, std::sync::atomic::Ordering::SeqCst))
        {
            let simulator = simulated(Some(fault));
            let ran = run(&mut probe(&simulator, "sweep", &[&sweep[..], &[timeout]].concat()));
            let said = format!("{fault}: {ran:?}");
            assert_eq!(ran.0, Some(*code), "{said}");
            assert!(named.iter().all(|n| ran.2.contains(n)), "{said}");
            if *code != 0 {
                let line = ran.2.lines().last().unwrap_or("");
                let path = simulator.path().to_str().expect("a plain name");
                assert!(line.starts_with(&format!("echolume: {path}: ")) && ran.2.lines().count() == 1, "{said}");
            }
            let stopped = || {
                let received = simulator.received();
                received.iter().any(|r| r.command == command::STOP) && stopped_at_last(&received)
            };
            assert!(if *told { eventually(stopped) } else { !stopped() }, "{said}: {:?}", simulator.received());
            if *told {
                assert!(eventually(|| !simulator.is_moving()), "{said}");
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(one);
        }
    });
}

#[test]
fn home_sweep_status_and_stop_do_what_they_say() {
    let simulator = simulated(None);
    let folder = Folder::new("positions");
    let file = &folder.path("positions.csv");
    let (code, out, err) = run(&mut probe(&simulator, "home", &["--timeout", "2000"]));
    assert!(code == Some(0) && out.contains("home: found"), "{out}{err}");
    let sweep = ["--angle", "24", "--rate", "4", "--volumes", "3", "--homed", "--timeout", "2000", "--positions", file];
    let (code, out, err) = run(&mut probe(&simulator, "sweep", &sweep));
    assert!(code == Some(0) && out.contains("swept: 3 volumes"), "{out}{err}");
    let text = std::fs::read_to_string(file).expect("the positions");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time_s,angle_deg,direction"));
    let rows: Vec<(f64, f64, &str)> = lines
        .map(|l| {
            let cells: Vec<&str> = l.split(',').collect();
            (cells[0].parse().expect("a time"), cells[1].parse().expect("an angle"), cells[2])
        })
        .collect();
    assert!(rows.windows(2).all(|w| w[0].0 < w[1].0));
    let reach = |f: fn(f64, f64) -> f64| rows.iter().map(|r| r.1).fold(0.0, f);
    assert!((reach(f64::max) - 12.0).abs() < 0.02 && (reach(f64::min) + 12.0).abs() < 0.02, "{text}");
    assert!(["forward", "backward"].iter().all(|d| rows.iter().any(|r| r.2 == *d)));
    let (code, out, err) = run(&mut probe(&simulator, "status", &["--timeout", "2000"]));
    assert!(code == Some(0) && out.contains("TMCM-1140") && out.contains("angle: 12.0"), "{out}{err}");
    assert!(out.contains("watchdog: stops the motor after 2s"), "{out}");
    let (code, out, err) = run(&mut probe(&simulator, "stop", &["--timeout", "2000"]));
    assert!(code == Some(0) && out == "stopped\n", "{out}{err}");
    assert!(simulator.received().iter().any(|r| r.command == command::STOP));
}

#[test]
fn a_stop_that_is_not_confirmed_is_no_success() {
    let simulator = simulated(Some("mute"));
    let (code, out, err) = run(&mut probe(&simulator, "stop", &["--timeout", "300"]));
    assert!(
        code == Some(1) && out.is_empty() && err.contains("has not confirmed") && err.contains("power"),
        "{out}{err}"
    );
    // At once, before the first request.
    let stops = vec![Request::stop(1, 0); 3];
    assert!(eventually(|| simulator.received() == stops), "{:?}", simulator.received());
}

#[test]
fn a_signal_stops_the_motor() {
    let one = |wanted, name: &str| {
        let simulator = simulated(None);
        let child = long_sweep(&simulator, &["--volumes", "5"]);
        signal(&child, wanted);
        let (code, _, err) = finish(child);
        assert!(code == Some(1) && err.contains(&format!("interrupted by {name}. The motor was stopped")), "{err}");
        assert!(stopped_at_last(&simulator.received()));
        assert!(eventually(|| !simulator.is_moving()) && simulator.angle() < 19.0);
    };
    std::thread::scope(|scope| {
        for (wanted, name) in [(Signal::INT, "SIGINT"), (Signal::TERM, "SIGTERM"), (Signal::HUP, "SIGHUP")] {
            scope.spawn(move || one(wanted, name));
        }
    });
}

#[test]
fn a_sweep_without_end_ends_well_by_a_signal() {
    let simulator = simulated(None);
    let child = long_sweep(&simulator, &[]);
    signal(&child, Signal::INT);
    let (code, out, err) = finish(child);
    assert!(code == Some(0) && out.contains("stopped by SIGINT"), "{out}{err}");
    assert!(stopped_at_last(&simulator.received()));
}

#[test]
fn a_killed_sweep_is_stopped_by_the_watchdog_and_the_port_is_free_again() {
    let simulator = simulated(None);
    let child = long_sweep(&simulator, &[]);
    signal(&child, Signal::KILL);
    finish(child);
    assert!(!stopped_at_last(&simulator.received()), "nobody was left to");
    assert!(eventually(|| !simulator.is_moving()));
    assert!(simulator.angle() < 19.0, "the watchdog, and not the end of the pass");
    let (code, out, err) = run(&mut probe(&simulator, "status", &["--timeout", "2000"]));
    assert_eq!(code, Some(0), "{out}{err}");
}

#[test]
fn wrong_input_is_refused_before_the_port_is_touched() {
    let simulator = simulated(None);
    let plain = data("wobbler-4dc7/probe.toml");
    let plain = plain.to_str().expect("a plain name");
    let path = simulator.path().to_str().expect("a plain name");
    for (arguments, named) in [
        (&["probe", "sweep", "--port", path, "--angle", "24", "--rate", "1"][..], "--probe FILE is needed"),
        (&["probe", "home", "--port", path, "--probe", plain], "has no [motor] table"),
        (&["probe", "sweep", "--port", path, "--probe", MOTOR_PROBE, "--angle", "99", "--rate", "1"], "--angle 99"),
        (&["probe", "sweep", "--port", path, "--probe", MOTOR_PROBE, "--angle", "61", "--rate", "4.9"], "at most"),
        (&["probe", "simulate", "--fault", "fire"], "fire"),
        (&["probe", "status"], "--port"),
        (&["probe", "status", "--port", path, "--baud", "3"], "--baud"),
        (&["stream", "--null", "--motor", path], "--sweeps"),
        (&["stream", "--null", "--homed"], "--motor"),
        (&["stream", "--null", "--motor", path, "--angle", "24", "--sweeps", "1"], "[motor] table"),
        (&["stream", "--null", "--motor", path, "--angle", "24", "--sweeps", "1", "--probe", plain], "[motor] table"),
        (
            &["stream", "--null", "--motor", path, "--angle", "99", "--sweeps", "1", "--probe", MOTOR_PROBE],
            "--angle 99",
        ),
        (
            &["stream", "--null", "--motor", path, "--angle", "24", "--sweeps", "9", "--probe", MOTOR_PROBE],
            "--sweeps 9",
        ),
    ] {
        let (code, _, err) = run(Command::new(PROGRAM).args(arguments).stdin(Stdio::null()).stderr(Stdio::piped()));
        assert!(code == Some(2) && err.contains(named), "{arguments:?}: {err}");
    }
    assert_eq!(simulator.received(), Vec::<Request>::new());
    let nowhere = PathBuf::from("/dev/echolume-no-such-port");
    let status = Command::new(PROGRAM).args(["probe", "status", "--port"]).arg(&nowhere).output().expect("run");
    let err = String::from_utf8_lossy(&status.stderr).into_owned();
    assert!(
        status.status.code() == Some(1) && err.contains("cannot be opened") && err.contains("probe ports"),
        "{err}"
    );
    let help = Command::new(PROGRAM).args(["probe", "sweep", "--help"]).output().expect("run");
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    assert!(help.contains("SIGKILL") && help.contains("watchdog_ms"), "{help}");
}

#[test]
fn the_simulator_runs_until_it_is_signalled() {
    let mut child = with_default_signals()
        .args(["probe", "simulate"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("start the program");
    let mut path = String::new();
    let out = child.stdout.take().expect("its output");
    BufReader::new(out).read_line(&mut path).expect("a line");
    let status = Command::new(PROGRAM).args(["probe", "status", "--timeout", "2000", "--port", path.trim()]).output();
    let status = status.expect("run");
    assert!(status.status.success(), "{}", String::from_utf8_lossy(&status.stderr));
    signal(&child, Signal::INT);
    let (code, _, err) = finish(child);
    assert_eq!(code, Some(0), "{err}");
}
