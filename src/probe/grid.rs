//! Frames that are pictures already, and the choice between those and the polar frames of a sweep.

use super::geometry::{Advance, GeometryError, Probe};
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

impl Geometry {
    /// Whether the two differ at most in the motor's way during a frame.
    pub fn equals_except_advance(&self, other: &Geometry) -> bool {
        match (self, other) {
            (Geometry::Sweep(a), Geometry::Sweep(b)) => {
                let lies = |p: &Probe| (p.array, p.start_depth, p.sample_pitch, p.samples, p.motion, p.sound_speed);
                lies(a) == lies(b) && a.lines == b.lines && a.slices == b.slices
            }
            _ => self == other,
        }
    }

    /// Whether the two differ at most in the direction of the motor's way during each frame.
    pub fn equals_except_direction(&self, other: &Geometry) -> bool {
        let ways = |geometry: &Geometry| match geometry {
            Geometry::Sweep(p) => (0..p.slices.len()).map(|k| p.advance_at(k as f64).abs()).collect(),
            Geometry::Cartesian(_) => Vec::new(),
        };
        self == other || (self.equals_except_advance(other) && ways(self) == ways(other))
    }

    /// Slices of two directions side by side: each lies as in `backward` where that is marked, else as in `self`. None where the last
    /// lines of neighbours would cross, and of geometries that differ in more than the motor's way.
    pub fn with_mixed_directions(&self, backward: &Geometry, marked: &[bool]) -> Option<Geometry> {
        let (Geometry::Sweep(forward), Geometry::Sweep(back)) = (self, backward) else { return None };
        let way = |k: usize| {
            if marked.get(k) == Some(&true) { back.advance_at(k as f64) } else { forward.advance_at(k as f64) }
        };
        let each = (0..forward.slices.len()).map(way).collect();
        let probe = Probe { advance: Advance::Each(each), ..forward.clone() };
        (self.equals_except_advance(backward) && probe.check().is_ok()).then_some(Geometry::Sweep(probe))
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

    #[test]
    fn a_lattice_is_taken_up_to_its_limits() {
        let good = Grid { size: [2, 3, 1], spacing: [1e-6, 1e6, 1.0], origin: [-1e6, 1e6, 0.0] };
        assert_eq!(good.check(), Ok(()));
        let fault = |grid: Grid| grid.check().map_err(|e| e.field);
        assert_eq!(fault(Grid { size: [2, 3, 0], ..good }), Err("size"));
        assert_eq!(fault(Grid { spacing: [0.9e-6, 1.0, 1.0], ..good }), Err("spacing"));
        assert_eq!(fault(Grid { spacing: [1.0, 1.0, 1.1e6], ..good }), Err("spacing"));
        assert_eq!(fault(Grid { origin: [0.0, -1.1e6, 0.0], ..good }), Err("origin"));
        assert_eq!(fault(Grid { origin: [0.0, 0.0, 1.1e6], ..good }), Err("origin"));
    }

    #[test]
    fn the_first_index_of_a_frame_runs_along_a_line_and_of_a_picture_along_x() {
        use crate::probe::{Advance, Array, Axis, Motion};
        let cartesian = Geometry::Cartesian(Grid { size: [7, 5, 3], spacing: [1.0; 3], origin: [0.0; 3] });
        assert_eq!((cartesian.frame_size(), cartesian.slices()), ([7, 5], 3));
        let sweep = Geometry::Sweep(Probe {
            array: Array::Linear,
            lines: Axis::centred(1.0, 24),
            start_depth: 0.0,
            sample_pitch: 0.5,
            samples: 64,
            motion: Motion::Translated,
            slices: Axis::centred(1.0, 9),
            advance: Advance::None,
            sound_speed: 1540.0,
        });
        assert_eq!((sweep.frame_size(), sweep.slices()), ([64, 24], 9));
    }
}

#[cfg(test)]
mod direction_tests {
    use super::*;
    use crate::probe::{Array, Axis, Motion};

    fn probe(advance: Advance) -> Geometry {
        Geometry::Sweep(Probe {
            array: Array::Curved { radius: 30.0 },
            lines: Axis::centred(0.05, 16),
            start_depth: 0.0,
            sample_pitch: 0.5,
            samples: 64,
            motion: Motion::Fan { wobble_radius: 15.0 },
            slices: Axis::centred(0.05, 4),
            advance,
            sound_speed: 1540.0,
        })
    }

    #[test]
    fn slices_of_two_ways_lie_side_by_side_each_as_it_was_swept() {
        let (forth, back) = (probe(Advance::Same(0.02)), probe(Advance::Same(-0.02)));
        assert!(forth.equals_except_direction(&back) && forth != back);
        let mixed = forth.with_mixed_directions(&back, &[false, true, true, false]).expect("no lines cross");
        assert_eq!(mixed, probe(Advance::Each(vec![0.02, -0.02, -0.02, 0.02])));
        assert!(mixed.equals_except_direction(&forth));
        let fast = |sign: f64| probe(Advance::Same(sign * 0.04));
        assert_eq!(
            fast(1.0).with_mixed_directions(&fast(-1.0), &[false, false, true, true]),
            None,
            "their last lines cross"
        );
        assert!(!fast(1.0).equals_except_direction(&forth) && fast(1.0).equals_except_advance(&forth));
    }
}
