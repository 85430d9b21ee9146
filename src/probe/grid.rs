//! The geometry of a volume: polar frames of a swept probe, or slices of a Cartesian grid.

use super::axis::Axis;
use super::geometry::{Advance, GeometryError, Probe};
use crate::tree::{FromNode, ToNode};

/// Largest coordinate and spacing, mm. Its square is finite in f32, which the GPU computes in.
const MAX_LENGTH: f64 = 1e6;

/// Voxels on an axis-aligned Cartesian grid, as in a volume that was scan-converted elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, ToNode, FromNode)]
pub struct Grid {
    /// Number of voxels along x (lateral, fastest), y (depth) and z (elevation). A frame is one slice of constant z.
    pub size: [usize; 3],
    /// Distance between voxels along x, y and z, mm.
    pub spacing: [f64; 3],
    /// Position of the centre of voxel (0, 0, 0), mm.
    pub origin: [f64; 3],
}

impl Grid {
    /// Checks every number of the grid.
    ///
    /// # Errors
    /// A size of 0, a spacing outside 1e-6..=1e6 mm, an origin beyond 1e6 mm.
    pub fn check(&self) -> Result<(), GeometryError> {
        let fault = |field, fault: String| Err(GeometryError { field, fault });
        for axis in 0..3 {
            let (size, spacing, origin) = (self.size[axis], self.spacing[axis], self.origin[axis]);
            if size == 0 {
                return fault("size", "is 0, must be at least 1 voxel".into());
            }
            if !(1.0 / MAX_LENGTH..=MAX_LENGTH).contains(&spacing) {
                return fault("spacing", format!("is {spacing:e} mm, must lie in 1e-6 .. 1e6"));
            }
            if !(-MAX_LENGTH..=MAX_LENGTH).contains(&origin) {
                return fault("origin", format!("is {origin:e} mm, must lie within 1e6 of 0"));
            }
        }
        Ok(())
    }
}

/// The positions of the samples of a volume.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
pub enum Geometry {
    /// Polar frames of a probe.
    Sweep(Probe),
    /// Slices of a Cartesian grid.
    Cartesian(Grid),
}

impl Geometry {
    /// Samples a line and scan lines of a polar frame; width and height of a Cartesian slice. The first index is the fastest.
    pub fn frame_size(&self) -> [usize; 2] {
        match self {
            Geometry::Sweep(probe) => [probe.samples, probe.lines.len()],
            Geometry::Cartesian(grid) => [grid.size[0], grid.size[1]],
        }
    }

    /// Number of frames of a volume.
    pub fn slices(&self) -> usize {
        match self {
            Geometry::Sweep(probe) => probe.slices.len(),
            Geometry::Cartesian(grid) => grid.size[2],
        }
    }

    /// True if the two geometries differ at most in the motor's travel during a frame ([`Advance`]), which leaves line 0 of each slice where it is.
    pub fn equals_except_advance(&self, other: &Geometry) -> bool {
        match (self, other) {
            (Geometry::Sweep(a), Geometry::Sweep(b)) => {
                let fields = |p: &Probe| (p.array, p.start_depth, p.sample_pitch, p.samples, p.motion, p.sound_speed);
                fields(a) == fields(b) && a.lines == b.lines && a.slices == b.slices
            }
            _ => self == other,
        }
    }

    /// True if the two geometries differ at most in the motor's travel during a frame and in the line that fires first. The distance of each slice in
    /// one from the same slice in the other is then at most the sum of both travels.
    pub fn equals_except_travel(&self, other: &Geometry) -> bool {
        let (Geometry::Sweep(a), Geometry::Sweep(b)) = (self, other) else { return self == other };
        let moved = Geometry::Sweep(Probe { slices: a.slices.clone(), ..b.clone() });
        let is_near = |k: f64| {
            let travel = a.advance_at(k).abs() + b.advance_at(k).abs();
            a.slices.at(k) == b.slices.at(k) || (a.slices.at(k) - b.slices.at(k)).abs() <= travel
        };
        a.slices.len() == b.slices.len()
            && self.equals_except_advance(&moved)
            && (0..a.slices.len()).all(|k| is_near(k as f64))
    }

    /// True if the two geometries differ at most in the direction of the motor's travel during each frame. Line 0 of each slice is at the same place
    /// in both.
    pub fn equals_except_direction(&self, other: &Geometry) -> bool {
        let travels = |geometry: &Geometry| match geometry {
            Geometry::Sweep(p) => (0..p.slices.len()).map(|k| p.advance_at(k as f64).abs()).collect(),
            Geometry::Cartesian(_) => Vec::new(),
        };
        self == other || (self.equals_except_advance(other) && travels(self) == travels(other))
    }

    /// The geometry of a volume with slices of both directions of the motor: slice k is as in `backward` if `marked[k]` is true, otherwise as in
    /// `self`, also if `marked` has no entry for it. None for Cartesian geometries, if the last lines of neighbouring slices would cross, or if
    /// [`Geometry::equals_except_travel`] is false.
    pub fn with_mixed_directions(&self, backward: &Geometry, marked: &[bool]) -> Option<Geometry> {
        let (Geometry::Sweep(forward), Geometry::Sweep(back)) = (self, backward) else { return None };
        let of = |k: usize| if marked.get(k) == Some(&true) { back } else { forward };
        let all = 0..forward.slices.len();
        let slices = match forward.slices == back.slices {
            true => forward.slices.clone(),
            false => Axis::Table(all.clone().map(|k| of(k).slices.at(k as f64)).collect()),
        };
        let each = all.map(|k| of(k).advance_at(k as f64)).collect();
        let probe = Probe { slices, advance: Advance::Each(each), ..forward.clone() };
        (self.equals_except_travel(backward) && probe.check().is_ok()).then_some(Geometry::Sweep(probe))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_without_extent_is_refused() {
        let good = Grid { size: [2, 3, 1], spacing: [0.5; 3], origin: [0.0; 3] };
        assert!(good.check().is_ok());
        assert!(Grid { size: [2, 0, 1], ..good }.check().is_err());
        assert!(Grid { spacing: [0.5, -0.5, 0.5], ..good }.check().is_err());
        assert!(Grid { spacing: [0.5, 1e300, 0.5], ..good }.check().is_err());
        assert!(Grid { origin: [f64::NAN, 0.0, 0.0], ..good }.check().is_err());
    }

    #[test]
    fn a_grid_is_accepted_up_to_its_limits() {
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
        use crate::{Advance, Array, Axis, Motion};
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
    use crate::{Array, Axis, Motion};

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
    fn slices_of_both_directions_keep_their_own_advance() {
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
