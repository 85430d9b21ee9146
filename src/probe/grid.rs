//! Frames that are pictures already, and the choice between those and the polar frames of a sweep.

use super::geometry::{GeometryError, Probe};
use serde::{Deserialize, Serialize};

/// No place or spacing is further than this, mm: f32 on the GPU keeps squares of it finite.
const FAR: f64 = 1e6;

/// Voxels on a straight lattice, as in a volume that was scan-converted by others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Voxels along x (fastest), y, and z (one a frame).
    pub size: [usize; 3],
    /// Distance between voxels, mm.
    pub spacing: [f64; 3],
    /// Place of the centre of voxel (0, 0, 0), mm.
    pub origin: [f64; 3],
}

impl Grid {
    /// Refuses a lattice without voxels, or one whose voxels have no finite place.
    pub fn check(&self) -> Result<(), GeometryError> {
        let fault = |field, fault: String| Err(GeometryError { field, fault });
        for axis in 0..3 {
            let (size, spacing, origin) = (self.size[axis], self.spacing[axis], self.origin[axis]);
            if size == 0 {
                return fault("size", "is 0, must be at least 1 voxel".into());
            }
            if !(1.0 / FAR..=FAR).contains(&spacing) {
                return fault("spacing", format!("is {spacing:e} mm, must lie in 1e-6 .. 1e6"));
            }
            if !(-FAR..=FAR).contains(&origin) {
                return fault("origin", format!("is {origin:e} mm, must lie within 1e6 of 0"));
            }
        }
        Ok(())
    }
}

/// Where the samples of a volume lie.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Geometry {
    /// Polar frames of a probe.
    Sweep(Probe),
    /// Pictures on a lattice.
    Cartesian(Grid),
}

impl Geometry {
    /// Samples and lines of a polar frame; width and height of a picture. The first runs fastest.
    pub fn frame_size(&self) -> [usize; 2] {
        match self {
            Geometry::Sweep(probe) => [probe.samples, probe.lines.len()],
            Geometry::Cartesian(grid) => [grid.size[0], grid.size[1]],
        }
    }

    /// Frames a volume.
    pub fn slices(&self) -> usize {
        match self {
            Geometry::Sweep(probe) => probe.slices.len(),
            Geometry::Cartesian(grid) => grid.size[2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_without_extent_is_refused() {
        let good = Grid { size: [2, 3, 1], spacing: [0.5; 3], origin: [0.0; 3] };
        assert!(good.check().is_ok());
        assert!(Grid { size: [2, 0, 1], ..good }.check().is_err());
        assert!(Grid { spacing: [0.5, -0.5, 0.5], ..good }.check().is_err());
        assert!(Grid { spacing: [0.5, 1e300, 0.5], ..good }.check().is_err());
        assert!(Grid { origin: [f64::NAN, 0.0, 0.0], ..good }.check().is_err());
    }
}
