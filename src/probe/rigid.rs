//! Rigid motions of a body in space.

use glam::{DAffine3, DQuat, DVec3};
use std::fmt;
use std::str::FromStr;

/// A rigid motion: a rotation about a point, then a shift. Axes are lateral, depth and elevation.
///
/// As text it is six numbers with commas between them: the shift, mm, then the rotation vector, degrees. The text does not contain the point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rigid {
    /// The translation after the rotation, mm.
    pub shift: DVec3,
    /// The rotation vector, degrees: its direction is the axis, its length the angle. A vector along elevation turns lateral to depth.
    pub turn: DVec3,
    /// The point that only the shift moves, mm.
    pub about: DVec3,
}

impl Rigid {
    /// The motion as an affine map of positions, mm.
    pub fn map(&self) -> DAffine3 {
        let rotation = DQuat::from_scaled_axis(self.turn * 1f64.to_radians());
        DAffine3::from_translation(self.about + self.shift)
            * DAffine3::from_quat(rotation)
            * DAffine3::from_translation(-self.about)
    }

    /// The rotation angle, degrees.
    pub fn angle(&self) -> f64 {
        self.turn.length()
    }

    /// The motion that a map without scale makes, with this point as [`Rigid::about`].
    pub fn of(map: &DAffine3, about: DVec3) -> Rigid {
        let turn = DQuat::from_mat3(&map.matrix3).to_scaled_axis() / 1f64.to_radians();
        Rigid { shift: map.transform_point3(about) - about, turn, about }
    }
}

impl fmt::Display for Rigid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [a, b, c] = self.shift.to_array();
        let [u, v, w] = self.turn.to_array();
        write!(f, "{a:.3},{b:.3},{c:.3},{u:.3},{v:.3},{w:.3}")
    }
}

impl FromStr for Rigid {
    type Err = String;

    /// # Errors
    /// One line: not six finite numbers, a shift above 1000 mm, or a turn above 180 degrees.
    fn from_str(text: &str) -> Result<Rigid, String> {
        let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
        let six = numbers.and_then(|n| <[f64; 6]>::try_from(n).ok()).filter(|n| n.iter().all(|n| n.is_finite()));
        let [a, b, c, u, v, w] = six.ok_or(
            "must be six numbers LATERAL,DEPTH,ELEVATION,X,Y,Z: a shift in mm and a rotation vector in degrees",
        )?;
        let rigid = Rigid { shift: DVec3::new(a, b, c), turn: DVec3::new(u, v, w), about: DVec3::ZERO };
        if rigid.shift.length() > 1000.0 || rigid.angle() > 180.0 {
            return Err("must shift by at most 1000 mm and turn by at most 180 degrees".into());
        }
        Ok(rigid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_read_and_moves_places_as_the_formula_says() {
        let read: Rigid = "1, 2,3,0,0,90".parse().expect("a motion");
        let motion = Rigid { about: DVec3::new(10.0, 0.0, 0.0), ..read };
        // A quarter turn about elevation takes lateral to depth.
        let moved = motion.map().transform_point3(DVec3::new(12.0, 0.0, 5.0));
        assert!(moved.abs_diff_eq(DVec3::new(11.0, 4.0, 8.0), 1e-12), "{moved}");
        assert_eq!(motion.to_string(), "1.000,2.000,3.000,0.000,0.000,90.000");
        let again = Rigid::of(&motion.map(), motion.about);
        assert!(again.shift.abs_diff_eq(motion.shift, 1e-12) && again.turn.abs_diff_eq(motion.turn, 1e-9), "{again}");
        // About another point the same map has another shift.
        let other = Rigid::of(&motion.map(), DVec3::ONE).map().transform_point3(DVec3::new(12.0, 0.0, 5.0));
        assert!(other.abs_diff_eq(moved, 1e-9), "{other}");
    }

    #[test]
    fn what_is_no_motion_is_refused() {
        for text in ["", "1,2,3", "1,2,3,4,5,x", "nan,0,0,0,0,0", "1,2,3,4,5,6,7", "2000,0,0,0,0,0", "0,0,0,170,170,0"]
        {
            assert!(text.parse::<Rigid>().is_err(), "{text}");
        }
    }
}
