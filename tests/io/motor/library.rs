//! Home, sweep and stop over the simulated module, from Rust.

use crate::common::motor::{settings, simulated, stopped_at_last, table};
use crate::common::wait::eventually;
use echolume::low_level::probe::motor::simulate::{Simulator, SimulatorOptions};
use echolume::low_level::probe::motor::table::{Home, Side, Units};
use echolume::low_level::probe::motor::tmcl::{Request, axis, command};
use echolume::low_level::probe::motor::{
    ArrayState, Direction, Drive, Fault, MotorTable, Position, Stopped, Sweep, Track,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

const SWEEP: Sweep = Sweep { angle: 24.0, rate: 4.0, volumes: Some(3) };

#[test]
fn status_describes_the_module_and_moves_nothing() {
    let simulator = simulated(None);
    let status = Drive::open(&settings(&simulator, 2000), &table()).expect("opened").status().expect("answered");
    assert_eq!(status.module, "TMCM-1140 firmware 1.16");
    assert_eq!((status.angle, status.speed, status.watchdog), (0.0, 0.0, Some(Duration::ZERO)));
    assert!(!status.left_limit && !status.right_limit && !status.home_switch);
    assert!(!simulator.received().iter().any(Request::moves));
    assert!((simulator.angle() - 7.0).abs() < 0.01);
}

#[test]
fn home_is_where_the_switch_is_however_it_is_looked_for() {
    let found = |home, home_direction, reversed, home_angle_deg| {
        let table = MotorTable { home, home_direction, reversed, home_angle_deg, ..table() };
        let options = SimulatorOptions { table: table.clone(), ..SimulatorOptions::default() };
        let simulator = Simulator::start(options).expect("a pseudo-terminal");
        let mut drive = Drive::open(&settings(&simulator, 2000), &table).expect("opened");
        drive.home().expect("found");
        let status = drive.status().expect("answered");
        assert_eq!(status.speed, 0.0);
        // The module now counts from the real position of the shaft, not from its start, 7 deg away. It is only as exact as
        // the switch is polled, which on a busy machine is seldom.
        let off = (status.angle - simulator.angle()).abs();
        assert!(off < 0.5, "{home:?} {home_direction:?} {reversed}: {off} deg beside it");
    };
    found(Home::ReferenceSearch, Side::Left, false, 0.0);
    found(Home::ReferenceSearch, Side::Left, true, -5.0);
    found(Home::Switch, Side::Left, false, 0.0);
    found(Home::Switch, Side::Right, false, 3.0);
}

#[test]
fn a_sweep_covers_its_angle_in_order_of_time_and_places_frames() {
    let simulator = simulated(None);
    let mut drive = Drive::open(&settings(&simulator, 2000), &table()).expect("opened");
    drive.home().expect("home");
    let mut positions: Vec<Position> = Vec::new();
    assert_eq!(drive.sweep(&SWEEP, Instant::now(), &mut |p| positions.push(p)).expect("swept"), 3);
    assert!(positions.windows(2).all(|w| w[0].time < w[1].time), "time rises");
    for pass in 0..3 {
        let within: Vec<_> = positions.iter().filter(|p| p.pass == pass).collect();
        let end = within.last().expect("a pass has positions").angle;
        let most = within.iter().map(|p| p.angle.abs()).fold(0.0, f64::max);
        let wanted = if pass % 2 == 0 { 12.0 } else { -12.0 };
        assert!((end - wanted).abs() < 0.02 && most < 12.02, "pass {pass} ends at {end}, and went to {most}");
        let direction = if pass % 2 == 0 { Direction::Forward } else { Direction::Backward };
        assert!(within.iter().all(|p| p.direction == direction));
    }
    let (first, last) = (positions[0].time, positions[positions.len() - 1].time);
    let count = positions.len();
    let mut track = Track::new(10.0);
    assert!(positions.into_iter().all(|p| track.push(p)), "in order");
    assert_eq!(track.at(first - 1e-3), ArrayState::Unknown);
    assert_eq!(track.at(last + 1e-3), ArrayState::Unknown);
    assert!(
        matches!(track.at((first + last) / 2.0), ArrayState::Sweeping { .. } | ArrayState::Reversing { .. }),
        "{count}"
    );
    // The sweep ended with the motor at rest, as the module reported: nothing to stop.
    let before = simulator.received();
    let last = before.last().expect("requests");
    assert_eq!((last.command, last.kind), (command::GET_AXIS, axis::SPEED));
    drop(drive);
    assert_eq!(simulator.received().len(), before.len());
    assert!(!simulator.is_moving() && (simulator.angle() - 12.0).abs() < 0.02);
}

#[test]
fn a_reversed_motor_on_an_older_controller_sweeps_the_same_angle() {
    let table = MotorTable { units: Units::Tmc429, ramp_divisor: 9, reversed: true, ..table() };
    table.check().expect("within the controller's registers");
    let options = SimulatorOptions { table: table.clone(), ..SimulatorOptions::default() };
    let simulator = Simulator::start(options).expect("a pseudo-terminal");
    let mut drive = Drive::open(&settings(&simulator, 2000), &table).expect("opened");
    drive.home().expect("home");
    let mut least = f64::INFINITY;
    drive.sweep(&SWEEP, Instant::now(), &mut |p| least = least.min(p.angle)).expect("swept");
    assert!((least + 12.0).abs() < 0.02, "the second pass ends at {least}");
    assert!((simulator.angle() - 12.0).abs() < 0.02, "the third at {}", simulator.angle());
}

#[test]
fn nothing_moves_before_the_limits_are_checked() {
    let simulator = simulated(None);
    let mut drive = Drive::open(&settings(&simulator, 2000), &table()).expect("opened");
    let error = drive.sweep(&Sweep { angle: 90.0, ..SWEEP }, Instant::now(), &mut |_| {}).expect_err("too wide");
    assert!(matches!(error.fault, Fault::OutOfRange(_)) && error.stopped == Stopped::NotMoved, "{error}");
    assert!(!simulator.received().iter().any(Request::moves));
}

#[test]
fn a_panic_in_the_caller_and_an_early_drop_stop_the_motor() {
    let simulator = simulated(None);
    let slow = Sweep { angle: 40.0, rate: 0.1, volumes: None };
    let panicked = catch_unwind(AssertUnwindSafe(|| {
        let mut drive = Drive::open(&settings(&simulator, 2000), &table()).expect("opened");
        drive.home().expect("home");
        let _ = drive.sweep(&slow, Instant::now(), &mut |p| {
            if p.angle > -19.0 {
                panic!("of the caller");
            }
        });
    }));
    assert!(panicked.is_err());
    assert!(stopped_at_last(&simulator.received()));
    assert!(eventually(|| !simulator.is_moving()));
    assert!(simulator.angle() < 19.0, "long before the end of the pass");
}

#[test]
fn a_load_too_heavy_for_the_ramp_stalls_and_is_noticed() {
    // The simulated load takes three times what its own table has.
    let simulator = simulated(None);
    let brisk = MotorTable { acceleration_deg_per_s2: 40_000.0, ..table() };
    let mut drive = Drive::open(&settings(&simulator, 2000), &brisk).expect("opened");
    let error = drive.home().expect_err("stalls");
    assert!(matches!(error.fault, Fault::Stalled { .. }), "{error}");
    assert!(error.stopped == Stopped::Confirmed && stopped_at_last(&simulator.received()), "{error}");
}

#[test]
fn the_watchdog_is_written_only_when_it_differs_and_only_where_there_is_one() {
    let simulator = simulated(None);
    let mut drive = Drive::open(&settings(&simulator, 2000), &table()).expect("opened");
    drive.home().expect("home");
    drive.home().expect("home again");
    assert_eq!(drive.status().expect("answered").watchdog, Some(Duration::from_secs(2)));
    let written = simulator.received().iter().filter(|r| r.command == command::SET_GLOBAL).count();
    assert_eq!(written, 1);
    let options = SimulatorOptions { table: table(), no_watchdog: true, fault: None };
    let without = Simulator::start(options).expect("a pseudo-terminal");
    let mut drive = Drive::open(&settings(&without, 2000), &table()).expect("opened");
    assert_eq!(drive.status().expect("answered").watchdog, None);
    drive.home().expect("home");
    assert!(!without.received().iter().any(|r| r.command == command::SET_GLOBAL));
}

#[test]
fn moving_requests_are_sent_once_and_queries_are_repeated() {
    let simulator = simulated(Some("mute@0"));
    let mut drive = Drive::open(&settings(&simulator, 300), &table()).expect("opened");
    drive.home().expect("home");
    drive.sweep(&SWEEP, Instant::now(), &mut |_| {}).expect_err("mute");
    let received = simulator.received();
    assert_eq!(received.iter().filter(|r| r.command == command::MOVE_TO).count(), 1);
    let asked = received.iter().rev().take_while(|r| r.command != command::MOVE_TO);
    let stops = asked.filter(|r| r.command == command::STOP).count();
    assert_eq!(stops, 3, "stopping is tried three times");
    let position = Request::get_axis(1, 0, axis::POSITION);
    assert!(received.contains(&position));
}
