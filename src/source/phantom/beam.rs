//! One scan line as a straight line in space, and the echoes along it.

use crate::probe::{Indices, Probe};
use glam::{DVec3, Vec3};

/// Range of the grey scale, dB: 255 is 0 dB, 0 is so far below.
pub const DYNAMIC_RANGE: f64 = 50.0;

/// Position, direction and time of one scan line. Space is that of [`Probe`], mm.
pub(super) struct Beam {
    /// Position of sample 0.
    pub first: DVec3,
    /// Step from one sample to the next. Both maps of the probe are linear along a line.
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
        // Computed over the whole length, for precision.
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

    /// In f32, for bodies that need no higher precision.
    pub(crate) fn rough_place(&self, sample: usize) -> Vec3 {
        self.place(sample).as_vec3()
    }

    /// Unit vector away from the probe.
    pub fn direction(&self) -> Vec3 {
        (self.step / self.pitch).as_vec3()
    }
}

/// Echo of a point, dB re full scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// From many unresolved scatterers, which give speckle.
    pub diffuse: f32,
    /// From a surface or wire, without speckle.
    pub mirror: f32,
}

impl Echo {
    /// Far below the dynamic range.
    pub const SILENT: Echo = Echo { diffuse: -200.0, mirror: -200.0 };

    /// The level without speckle: the sum of both powers, dB.
    pub fn bare(self) -> f32 {
        if self.mirror <= Echo::SILENT.mirror {
            return self.diffuse;
        }
        10.0 * (10f32.powf(self.diffuse / 10.0) + 10f32.powf(self.mirror / 10.0)).log10()
    }
}

/// Grey value of an echo in dB re full scale.
pub(super) fn grey(level: f32) -> u8 {
    // Saturates at 0 and 255.
    ((1.0 + level / DYNAMIC_RANGE as f32) * 255.0).round() as u8
}
