//! Fills a surface to a solid that can be printed: everything behind the surface, as seen from the probe, down to a flat base.
//!
//! Rows of a slice run into the body. In each column the first crossing of the threshold stays where it is, and from there on everything is
//! inside, up to one plane for all columns. A column that crosses nowhere stays empty.

/// Fills everything behind the surface, as seen from the probe, down to a flat base, so that the mesh can be printed. The caller passes all slices
/// twice: first to [`Base::survey`], which finds the deepest point of the surface, then to [`Base::fill`].
#[derive(Clone, Debug)]
pub struct Base {
    width: usize,
    threshold: f64,
    /// The deepest row at which a column is inside for the first time.
    deepest: Option<usize>,
}

impl Base {
    /// For slices of `width` columns. Values of at least `threshold` are solid.
    pub fn new(width: usize, threshold: f64) -> Base {
        Base { width, threshold, deepest: None }
    }

    /// First reading: takes the values of one slice, row by row.
    pub fn survey(&mut self, slice: &[f64]) {
        for column in 0..self.width {
            let mut values = slice.iter().skip(column).step_by(self.width);
            self.deepest = self.deepest.max(values.position(|value| *value >= self.threshold));
        }
    }

    /// The largest row at which any column first reaches the threshold, over all slices that were surveyed. None if no column reaches it.
    pub fn deepest(&self) -> Option<usize> {
        self.deepest
    }

    /// Second reading: copies a slice to `out`. In each column, from the first value of at least the threshold down to the last row of `out`, a value
    /// becomes the largest one so far. `out` may have more rows than `slice`; these rows are NaN in columns without such a value.
    pub fn fill(&self, slice: &[f64], out: &mut [f64]) {
        for column in 0..self.width {
            let mut values = slice.iter().skip(column).step_by(self.width);
            let mut filled = f64::NAN;
            for out in out.iter_mut().skip(column).step_by(self.width) {
                let value = values.next().copied().unwrap_or(f64::NAN);
                // Unknown values leave what is filled as it is.
                filled = if filled >= self.threshold { filled.max(value) } else { value };
                *out = filled;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::nets::{Surface, surface_net};
    use super::*;
    use glam::DVec3;
    use std::f64::consts::PI;

    /// A ball between fluid, with unknown values below it: a hemisphere on a cylinder.
    #[test]
    fn a_ball_becomes_a_hemisphere_on_a_cylinder() {
        const N: usize = 41;
        const R: f64 = 14.3;
        let centre = DVec3::new(20.2, 17.0, 19.7);
        let slice = |z: usize, out: &mut [f64]| {
            for (n, out) in out.iter_mut().enumerate() {
                let at = DVec3::new((n % N) as f64, (n / N) as f64, z as f64);
                *out = if at.y > 36.5 { f64::NAN } else { R - at.distance(centre) };
            }
        };
        let (mut base, mut raw) = (Base::new(N, 0.0), vec![0.0; N * N]);
        assert_eq!(base.deepest(), None);
        for z in 0..N {
            slice(z, &mut raw);
            base.survey(&raw);
        }
        // The deepest first crossing is that of a column near the equator, at most its row and the next.
        let rows = base.deepest().expect("something is inside") + 31;
        assert!((47..=48).contains(&rows), "{rows}");
        let filled = |z: usize, out: &mut [f64]| {
            slice(z, &mut raw);
            base.fill(&raw, out);
            Ok::<(), String>(())
        };
        let surface = Surface { threshold: 0.0, closed: true };
        let mesh = surface_net([N, rows, N], surface, filled, |at| at).expect("a mesh");
        assert_eq!(mesh.open_edges, 0);
        // The base is flat, half a voxel below the last row, whatever was known there.
        let end = rows as f64 - 0.5;
        let flat = mesh.vertices.iter().filter(|v| v.y == end).count() as f64;
        assert!((0.85..1.0).contains(&(flat / (PI * R * R))), "{flat} vertices of the base, without those of its rim");
        assert!(mesh.vertices.iter().all(|v| v.y <= end));
        let expected = 2.0 / 3.0 * PI * R.powi(3) + PI * R * R * (end - centre.y);
        // As in nets.rs: nothing lies deeper than 2/R below a surface of this radius; the rim is cut by half a voxel.
        let lost = 1.0 - mesh.volume() / expected;
        assert!((0.0..4.0 / (R * R) + 0.005).contains(&lost), "{lost}");
        // The upper half is where it was.
        let upper = mesh.vertices.iter().filter(|v| v.y < centre.y - 2.0);
        assert!(upper.clone().all(|v| (v.distance(centre) - R).abs() < 0.1) && upper.count() > 200);
    }

    #[test]
    fn columns_that_cross_nowhere_stay_empty_and_one_crossing_is_left() {
        // Two columns: one in and out again, one always below.
        let slice = [0.2, 0.1, 0.9, f64::NAN, 0.3, 0.2, f64::NAN, 0.4];
        let mut base = Base::new(2, 0.5);
        base.survey(&slice);
        let mut out = vec![0.0; 2 * (base.deepest().expect("inside") + 5)];
        base.fill(&slice, &mut out);
        let column = |n: usize| out.iter().skip(n).step_by(2).copied().collect::<Vec<_>>();
        assert_eq!(column(0), [0.2, 0.9, 0.9, 0.9, 0.9, 0.9]);
        let other = column(1);
        assert!(other[0] == 0.1 && other[1].is_nan() && other[2..4] == [0.2, 0.4] && other[5].is_nan());
    }
}
