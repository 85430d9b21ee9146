//! What of a geometry the motor's way during a frame changes: nothing but where the later lines of each slice lie.

use super::{Advance, Geometry, Probe};

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
