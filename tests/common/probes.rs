//! Small probes. This file needs nothing but the probe module: tools/mutants copies it.

use echolume::low_level::probe::{Advance, Array, Axis, Geometry, Grid, Motion, Probe};

/// A small abdominal wobbler: 24 lines over 66 deg, 9 frames over 27 deg, 64 samples of 0.8 mm. Tests that need other sizes change
/// those fields.
pub fn wobbler() -> Probe {
    Probe {
        array: Array::Curved { radius: 20.0 },
        lines: Axis::centred(0.05, 24),
        start_depth: 2.0,
        sample_pitch: 0.8,
        samples: 64,
        motion: Motion::Fan { wobble_radius: 12.0 },
        slices: Axis::centred(0.06, 9),
        advance: Advance::None,
        sound_speed: 1540.0,
    }
}

/// Cubic voxels of 1 mm.
pub fn voxels(size: [usize; 3]) -> Geometry {
    Geometry::Cartesian(Grid { size, spacing: [1.0; 3], origin: [0.0; 3] })
}
