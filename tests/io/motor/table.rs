//! Units and the `[motor]` table, the speed of a pass, and positions over time.

use crate::common::files::{Folder, MOTOR_PROBE};
use crate::common::motor::table;
use echolume::low_level::probe::ProbeFile;
use echolume::low_level::probe::motor::simulate::SimulatedFault;
use echolume::low_level::probe::motor::table::Units;
use echolume::low_level::probe::motor::{ArrayState, Direction, MotorTable, Position, Sweep, Track};
use proptest::prelude::*;
use std::time::Duration;

proptest! {
    #[test]
    fn an_angle_comes_back_to_half_a_microstep(
        angle in -180.0..180.0_f64,
        home in -40.0..40.0_f64,
        gear in 0.5..50.0_f64,
        fine in 0..9_u32,
        reversed: bool,
    ) {
        let table = MotorTable { gear, microsteps: 1 << fine, reversed, home_angle_deg: home, ..table() };
        let back = table.angle(table.position(angle));
        prop_assert!((back - angle).abs() <= 0.5 / table.steps_per_degree() + 1e-9, "{angle} came back as {back}");
        prop_assert_eq!(table.position(table.angle(1234)), 1234);
    }
}

#[test]
fn steps_per_degree_follow_from_steps_and_gear() {
    let table = table();
    // 200 full steps of 16 microsteps, 12 turns for one.
    assert!((table.steps_per_degree() - 200.0 * 16.0 * 12.0 / 360.0).abs() < 1e-9);
    assert_eq!((table.position(30.5), table.velocity(90.0)), (3253, 9600));
    assert_eq!(table, MotorTable::default(), "the example is the simulated module's own");
    // TMC429 at 16 MHz, no pulse divisor: 1 is 16e6 / 65536 = 244.14 microsteps a second.
    let old = MotorTable { units: Units::Tmc429, ..table };
    assert_eq!(old.velocity(90.0), (9600.0_f64 / 244.140625).round() as i32);
    assert!((old.speed(39) - 39.0 * 244.140625 / old.steps_per_degree()).abs() < 1e-9);
}

#[test]
fn every_wrong_table_is_refused_in_one_line_that_names_the_field() {
    let text = std::fs::read_to_string(MOTOR_PROBE).expect("the example");
    let folder = Folder::new("motor-table");
    for (from, to, named) in [
        ("steps_per_turn = 200", "steps_per_turn = 0", "motor.steps_per_turn"),
        ("microsteps = 16", "microsteps = 17", "motor.microsteps"),
        ("gear = 12.0", "gear = nan", "motor.gear"),
        ("gear = 12.0", "gears = 12.0", "gears"),
        ("address = 1 ", "address = 0 ", "motor.address"),
        ("motor = 0", "motor = 6", "motor.motor"),
        ("\"reference-search\"  ", "\"luck\"  ", "luck"),
        ("largest_angle_deg = 85.0", "largest_angle_deg = 400", "motor.largest_angle_deg"),
        ("largest_rate = 5.0", "largest_rate = 0", "motor.largest_rate"),
        ("largest_speed_deg_per_s = 600.0", "largest_speed_deg_per_s = 1", "motor.search_speed_deg_per_s"),
        ("acceleration_deg_per_s2 = 8000.0", "acceleration_deg_per_s2 = inf", "motor.acceleration_deg_per_s2"),
        ("units = \"pps\"", "ramp_divisor = 13\nunits = \"tmc429\"", "motor.acceleration_deg_per_s2"),
        ("watchdog_ms = 2000", "watchdog_ms = 5", "motor.watchdog_ms"),
    ] {
        assert!(text.contains(from), "{from}");
        let file = folder.join("probe.toml");
        std::fs::write(&file, text.replace(from, to)).expect("written");
        let error = ProbeFile::read(&file).expect_err(to).to_string();
        assert!(error.contains(named) && error.lines().count() == 1, "{to}: {error}");
    }
}

#[test]
fn a_pass_takes_the_time_that_its_rate_leaves() {
    let trip = Duration::from_millis(20);
    let speed = |angle, rate, volumes| Sweep { angle, rate, volumes }.speed(&table(), trip);
    let v = speed(61.0, 2.0, None).expect("the thesis' sweep");
    // Distance over speed, plus the time of one ramp: the duration of a trapezoidal profile.
    assert!((61.0 / v + v / 8000.0 - (0.5 - 2.5 * 0.02)).abs() < 1e-9);
    for (angle, rate, volumes, named) in [
        (85.1, 1.0, None, "--angle"),
        (0.0, 1.0, None, "--angle"),
        (f64::NAN, 1.0, None, "--angle"),
        (61.0, 5.1, None, "--rate"),
        (61.0, -1.0, None, "--rate"),
        // The speed would round to 0, and the time of a pass would be infinite.
        (61.0, 1e-9, None, "--rate"),
        (1e-300, 1.0, None, "--angle"),
        (61.0, f64::INFINITY, None, "--rate"),
        (61.0, 5.0, None, "at most"),
        (61.0, 2.0, Some(0), "--volumes"),
    ] {
        let fault = speed(angle, rate, volumes).expect_err(named).to_string();
        assert!(fault.contains(named), "{fault}");
    }
}

/// A cosine of 20 deg, one period a second, from -20: forwards for half a second, backwards for half a second.
fn cosine(time: f64) -> f64 {
    -20.0 * (std::f64::consts::TAU * time).cos()
}

fn track(pitch: f64) -> Track {
    let positions = (0..).map(|i| f64::from(i) * pitch).take_while(|t| *t < 2.0).map(|time| {
        let pass = (time * 2.0) as usize;
        let direction = if pass.is_multiple_of(2) { Direction::Forward } else { Direction::Backward };
        Position { time, angle: cosine(time), direction, pass }
    });
    track_of(positions)
}

fn track_of(positions: impl IntoIterator<Item = Position>) -> Track {
    let mut track = Track::new(0.1);
    assert!(positions.into_iter().all(|p| track.push(p)), "in order");
    track
}

#[test]
fn frames_get_the_angle_and_direction_of_their_time() {
    let pitch = 0.013;
    let track = track(pitch);
    // Of linear interpolation, at most the largest acceleration times the pitch squared over 8.
    let bound = 20.0 * std::f64::consts::TAU.powi(2) * pitch * pitch / 8.0 + 1e-9;
    let mut turning = 0;
    for i in 0..1900 {
        let time = f64::from(i) * 1e-3 + 0.0003;
        match track.at(time) {
            ArrayState::Sweeping { angle, direction, pass } => {
                assert!((angle - cosine(time)).abs() <= bound, "{time}: {angle} for {}", cosine(time));
                assert_eq!(pass, (time * 2.0) as usize, "{time}");
                assert_eq!(direction == Direction::Forward, pass % 2 == 0);
            }
            ArrayState::Reversing { angle } => {
                turning += 1;
                let from_turn = (time * 2.0 - (time * 2.0).round()).abs() / 2.0;
                assert!(from_turn <= pitch && (angle - cosine(time)).abs() <= bound, "{time}");
            }
            ArrayState::Unknown => panic!("{time} is within"),
        }
    }
    assert!(turning > 0 && turning <= 3 * 2 * 13, "{turning}");
}

#[test]
fn times_outside_the_track_have_no_angle() {
    let at = |time, angle| Position { time, angle, direction: Direction::Forward, pass: 0 };
    let track = track_of([at(1.0, 0.0), at(1.05, 1.0), at(3.0, 2.0), at(3.05, 2.0)]);
    for time in [0.9, 3.1, 2.0, f64::NAN, f64::INFINITY] {
        assert_eq!(track.at(time), ArrayState::Unknown, "{time}");
    }
    assert_eq!(track.at(1.05), ArrayState::Sweeping { angle: 1.0, direction: Direction::Forward, pass: 0 });
    assert_eq!(track.at(3.025), ArrayState::Reversing { angle: 2.0 }, "it stood");
    assert_eq!(Track::new(1.0).at(0.0), ArrayState::Unknown);
}

#[test]
fn a_track_that_grows_forgets_the_oldest_and_refuses_what_is_not_later() {
    let at = |time: f64| Position { time, angle: cosine(time), direction: Direction::Forward, pass: 0 };
    let mut track = Track::new(0.1);
    for i in 0..1000 {
        assert!(track.push(at(f64::from(i) * 1e-3)));
        track.forget_all_but(100);
        assert!(track.positions().len() <= 200 && track.positions().len() > i.min(99) as usize);
    }
    for wrong in [0.999, 0.5, f64::NAN, f64::INFINITY] {
        assert!(!track.push(at(wrong)), "{wrong}");
    }
    let nowhere = Position { angle: f64::INFINITY, ..at(2.0) };
    assert!(!track.push(nowhere));
    assert!(matches!(track.at(0.95), ArrayState::Reversing { .. } | ArrayState::Sweeping { .. }));
    assert_eq!(track.at(0.5), ArrayState::Unknown, "long forgotten");
}

#[test]
fn faults_are_asked_for_by_name_and_time() {
    assert!("stall@0.5".parse::<SimulatedFault>().is_ok_and(|i| i.after == Some(Duration::from_millis(500))));
    assert!("mute".parse::<SimulatedFault>().is_ok_and(|i| i.after.is_none()));
    for wrong in ["", "fire", "stall@", "stall@-1", "stall@nan", "stall@1e9", "@1"] {
        assert!(wrong.parse::<SimulatedFault>().is_err(), "{wrong}");
    }
}
