//! Probe files, their `[motor]` table, and replies of the motor.

use super::{Bytes, told, written};
use echolume::low_level::probe::motor::tmcl::{LENGTH, Reply, Request, axis, status_words, version_text};
use echolume::low_level::probe::motor::{MotorTable, Sweep};
use echolume::low_level::probe::{Indices, Probe, ProbeFile};
use std::time::Duration;

/// The geometry of a valid probe file, for its motor.
const GEOMETRY: &[u8] =
    b"array = { kind = 'curved', radius_mm = 40 }\nlines = { sector_angle_deg = 70 }\ndepth = { end_mm = 120 }\n\
                          motion = { kind = 'fan', wobble_radius_mm = 25, fan_angle_deg = 60 }\n[motor]\n";

pub fn probe_file(bytes: &[u8]) -> String {
    let file = match ProbeFile::read(&written("probe.toml", bytes)) {
        Ok(file) => file,
        Err(error) => return told(error),
    };
    let mut outcome = file.motor().map(turns).unwrap_or_default();
    for [samples, lines, frames] in [[64, 16, 8], [2, 2, 1], [400, 128, 31], [1, 1, 1]] {
        match file.geometry(samples, lines, frames) {
            Ok((probe, volumes)) => {
                places(&probe);
                for volume in 0..2 {
                    places(&volumes.swept(volume, &probe));
                }
                outcome += "a probe";
            }
            Err(error) => outcome += &told(error),
        }
    }
    outcome
}

/// A checked geometry has a finite position for every sample, and a box around all.
fn places(probe: &Probe) {
    probe.check().expect("was checked");
    let last = [probe.samples - 1, probe.lines.len() - 1, probe.slices.len() - 1].map(|n| n as f64);
    for corner in 0..8 {
        let at = |axis: usize| if corner >> axis & 1 == 1 { last[axis] } else { 0.0 };
        let place = probe.to_space(Indices { sample: at(0), line: at(1), slice: at(2) });
        assert!(place.is_finite(), "{place} of corner {corner}");
        let back = probe.to_indices(place);
        assert!(back.sample.is_finite() && back.line.is_finite() && back.slice.is_finite(), "{back:?} of {place}");
    }
    let (low, high) = probe.bounds();
    assert!(low.is_finite() && high.is_finite() && low.cmple(high).all(), "{low} to {high}");
    assert!(probe.acquisition_time().is_finite());
}

pub fn motor_table(bytes: &[u8]) -> String {
    match ProbeFile::read(&written("motor.toml", &[GEOMETRY, bytes].concat())) {
        Ok(file) => file.motor().map(turns).unwrap_or_default(),
        Err(error) => told(error),
    }
}

/// A checked table gives finite numbers for any angle, and allowed sweeps are within its speed.
fn turns(table: &MotorTable) -> String {
    for angle in [0.0, -180.0, 180.0, table.largest_angle_deg / 2.0] {
        let back = table.angle(table.position(angle));
        assert!(back.is_finite(), "{angle} deg comes back as {back}");
    }
    for speed in [1e-6, table.search_speed(), table.largest_speed_deg_per_s] {
        assert!(table.velocity(speed) >= 1 && table.speed(table.velocity(speed)).is_finite());
    }
    assert!(table.acceleration(table.acceleration_deg_per_s2) >= 1);
    let mut allowed = 0;
    for angle in [table.largest_angle_deg, 1.0, 1e-9, 1e-300, f64::NAN] {
        for rate in [table.largest_rate, 1.0, 1e-3, 1e-9, 1e-300, f64::INFINITY] {
            let sweep = Sweep { angle, rate, volumes: None };
            let Ok(speed) = sweep.speed(table, Duration::from_millis(20)) else { continue };
            allowed += 1;
            assert!(speed > 0.0 && speed <= table.largest_speed_deg_per_s, "{speed} deg/s for {sweep:?}");
            // The time limit of a pass follows from this.
            let longest = angle / speed + speed / table.acceleration_deg_per_s2;
            assert!(longest < 1e9, "{longest} s for {sweep:?}");
        }
    }
    format!("{} sweeps", (allowed > 0) as u8)
}

/// Bytes that came over the serial line in answer to a request.
pub fn replies(bytes: &[u8]) -> String {
    let mut input = Bytes(bytes);
    let requests = [
        Request::get_axis(1, 0, axis::POSITION),
        Request::version(input.u8()),
        Request::move_to(input.u8(), input.u8(), i32::from(input.u8())),
    ];
    let mut outcome = String::new();
    for request in requests {
        outcome += &told(request);
        if let Some(reply) = Reply::find(bytes, &request) {
            assert!(reply.module == request.address && reply.command == request.command && reply.status != 128);
            outcome += status_words(reply.status);
            assert_eq!(Reply::parse(&reply.bytes()), Some(reply));
        }
    }
    for nine in bytes.windows(LENGTH).filter_map(|w| <&[u8; LENGTH]>::try_from(w).ok()) {
        if let Some((module, version)) = version_text(nine) {
            outcome += &format!("{} {}", module.min(1), told(version));
        }
        if let Some(request) = Request::parse(nine) {
            assert_eq!(request.bytes(), *nine);
            outcome += if request.moves() { "moves" } else { "asks" };
            assert!(!(request.moves() && request.repeatable()), "{request}");
        }
    }
    outcome
}
