//! One scan line as a straight line in space.

use crate::probe::{Indices, Probe};
use glam::{DVec3, Vec3};

/// Where and when one scan line looks. Space is that of [`Probe`], mm.
pub(super) struct Beam {
    /// Place of sample 0.
    pub first: DVec3,
    /// From one sample to the next: both maps of the probe are linear along a line.
    pub step: DVec3,
    /// mm from sample to sample.
    pub pitch: f64,
    /// Depth of sample 0 below the array, mm.
    pub start_depth: f64,
    /// Range of sample 0 from the in-plane apex, mm; angle of the line and of the motor, rad.
    pub range: f64,
    pub line_angle: f64,
    pub motor_angle: f64,
    /// When it was fired, s.
    pub time: f64,
}

impl Beam {
    pub fn new(probe: &Probe, line: usize, slice: usize, time: f64) -> Beam {
        let (line, slice) = (line as f64, slice as f64);
        let place = |sample| probe.to_space(Indices { sample, line, slice });
        // Over the whole length, so that no digits are lost.
        let last = (probe.samples - 1) as f64;
        Beam {
            first: place(0.0),
            step: (place(last) - place(0.0)) / last,
            pitch: probe.sample_pitch,
            start_depth: probe.start_depth,
            range: probe.first_range(),
            line_angle: probe.lines.at(line),
            motor_angle: probe.slice_position(line, slice),
            time,
        }
    }

    pub fn place(&self, sample: usize) -> DVec3 {
        self.first + self.step * sample as f64
    }

    /// In f32, for bodies whose distances need no more.
    pub fn rough_place(&self, sample: usize) -> Vec3 {
        self.place(sample).as_vec3()
    }

    /// Unit vector away from the probe.
    pub fn direction(&self) -> Vec3 {
        (self.step / self.pitch).as_vec3()
    }
}
