//! A sweep: its speed, and the position and direction of the array at any time, from the positions that were read. Pure.

use super::Fault;
use super::port::PERIOD;
use super::table::MotorTable;
use crate::tree::{FromNode, Name};
use std::time::Duration;

/// Fewest passes a second. Slower ones would exceed every time-out.
const MIN_RATE: f64 = 1e-3;
/// Narrowest sweep, degrees.
const MIN_ANGLE: f64 = 1e-3;

/// A sweep that is requested of the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// Angle of the sweep from end to end, degrees. The sweep is centred on angle 0.
    pub angle: f64,
    /// Passes over the angle a second; each pass is one volume.
    pub rate: f64,
    /// Number of passes; None: passes until interrupted.
    pub volumes: Option<usize>,
}

impl Sweep {
    /// Speed of the array between the ramps of a pass, deg/s, that gives the requested rate. `round_trip`: time of a request and its reply.
    ///
    /// # Errors
    /// [`Fault::OutOfRange`], which names the limit that the sweep exceeds.
    pub fn speed(&self, table: &MotorTable, round_trip: Duration) -> Result<f64, Fault> {
        let Sweep { angle, rate, volumes } = *self;
        let refuse = |fault: String| Err(Fault::OutOfRange(fault));
        if !(MIN_ANGLE..=table.largest_angle_deg).contains(&angle) {
            let widest = table.largest_angle_deg;
            return refuse(format!("--angle {angle}: must be {MIN_ANGLE} to {widest} deg, the probe's widest"));
        }
        if !(MIN_RATE..=table.largest_rate).contains(&rate) {
            let most = table.largest_rate;
            return refuse(format!("--rate {rate}: must be {MIN_RATE} to {most} volumes/s, the probe's most"));
        }
        if volumes == Some(0) {
            return refuse("--volumes 0: must be at least 1".into());
        }
        // At each end: the end is noticed, and the next pass is requested.
        let pause = 2.5 * round_trip.max(PERIOD).as_secs_f64();
        let (time, acceleration) = (1.0 / rate - pause, table.acceleration_deg_per_s2);
        // Ramps of a trapezoid over `angle` in `time`: v = (a t - sqrt((a t)^2 - 4 a angle)) / 2, written without cancellation.
        let least = (4.0 * angle / acceleration).sqrt();
        if time < least {
            let (pass, most) = (format!("over {angle} deg at {acceleration} deg/s2"), 1.0 / (least + pause));
            return refuse(format!("--rate {rate}: {pass} at most {most:.2} volumes/s can be done"));
        }
        let at = acceleration * time;
        let speed = 2.0 * acceleration * angle / (at + (at * at - 4.0 * acceleration * angle).max(0.0).sqrt());
        if speed > table.largest_speed_deg_per_s {
            let (takes, most) = (format!("takes {speed:.1} deg/s"), table.largest_speed_deg_per_s);
            return refuse(format!("--rate {rate}: over {angle} deg {takes}, and the probe's largest is {most}"));
        }
        Ok(speed)
    }
}

/// The direction of a pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, Name)]
#[tree(rename_all = "lowercase")]
pub enum Direction {
    /// Towards larger angles.
    #[default]
    Forward,
    /// Towards smaller angles.
    Backward,
}

impl Direction {
    /// 1 for forward, -1 for backward.
    pub fn sign(self) -> f64 {
        if self == Direction::Forward { 1.0 } else { -1.0 }
    }
}

/// A position of the array that was read during a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Time of the reading, s, on a clock that positions and frames share.
    pub time: f64,
    /// Angle of the array, degrees; 0 is the middle of the sweep.
    pub angle: f64,
    /// Direction of the pass during which the position was read.
    pub direction: Direction,
    /// Number of the pass during which the position was read, from 0.
    pub pass: usize,
}

/// Position of the array at a time, such as that of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArrayState {
    /// Within a pass at the given angle, degrees.
    Sweeping { angle: f64, direction: Direction, pass: usize },
    /// Near a reversal between two passes, at the given angle in degrees; the direction is not known.
    Reversing { angle: f64 },
    /// Not known: the time is before the first or after the last position, or within a gap between positions.
    Unknown,
}

/// The positions of the array over time, in order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    positions: Vec<Position>,
    longest_gap: f64,
}

impl Track {
    /// A track without positions. At a time between two positions that are more than `longest_gap` seconds apart, the state of the array is
    /// [`ArrayState::Unknown`].
    pub fn new(longest_gap: f64) -> Track {
        Track { positions: Vec::new(), longest_gap }
    }

    pub fn positions(&self) -> &[Position] {
        &self.positions
    }

    /// Appends a position. Returns false, and ignores it, if it is not finite or not later than the last.
    pub fn push(&mut self, position: Position) -> bool {
        let later = self.positions.last().is_none_or(|last| position.time > last.time);
        let fits = later && position.time.is_finite() && position.angle.is_finite();
        if fits {
            self.positions.push(position);
        }
        fits
    }

    /// Removes old positions so that at least the `newest` newest remain and never more than twice as many.
    pub fn forget_all_but(&mut self, newest: usize) {
        if self.positions.len() > 2 * newest {
            self.positions.drain(..self.positions.len() - newest);
        }
    }

    /// Position of the array at a time, interpolated linearly between the two positions around it. The error is at most a dt^2 / 8 for
    /// an acceleration a and positions dt apart: 0.1 deg for 8000 deg/s2 and 10 ms.
    pub fn at(&self, time: f64) -> ArrayState {
        let after = self.positions.partition_point(|p| p.time < time);
        let Some(b) = self.positions.get(after) else { return ArrayState::Unknown };
        if b.time == time {
            return ArrayState::Sweeping { angle: b.angle, direction: b.direction, pass: b.pass };
        }
        let Some(a) = after.checked_sub(1).and_then(|i| self.positions.get(i)) else { return ArrayState::Unknown };
        let gap = b.time - a.time;
        if gap.is_nan() || gap > self.longest_gap || time.is_nan() {
            return ArrayState::Unknown;
        }
        let angle = a.angle + (b.angle - a.angle) * ((time - a.time) / gap);
        // A movement against the direction of the pass is an oscillation at its end.
        let along = (b.angle - a.angle) * a.direction.sign() > 0.0;
        if a.pass == b.pass && along {
            ArrayState::Sweeping { angle, direction: a.direction, pass: a.pass }
        } else {
            ArrayState::Reversing { angle }
        }
    }
}
