//! The solid block of mode cube as half-spaces in mm: the box, its moved and tilted faces, and the clip planes.

use super::{Scene, SceneError, refuse};
use glam::{DMat3, DQuat, DVec3};

/// A half-space. Points p with dot(normal, p) > limit are outside; the normal is a unit vector that points outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    pub normal: DVec3,
    pub limit: f64,
}

impl HalfSpace {
    /// Distance of a point to the plane, mm; positive inside.
    pub fn room(&self, place: DVec3) -> f64 {
        self.limit - self.normal.dot(place)
    }
}

/// The axis perpendicular to each face (left, right, near, far, bottom and top), and the outward sign.
const SIDES: [(usize, f64); 6] = [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)];

impl Scene {
    /// The half-spaces whose intersection is the block of mode cube: its faces and the clip planes.
    pub fn block(&self) -> Vec<HalfSpace> {
        let mut faces = self.faces();
        faces.extend(self.clips().map(|(normal, limit)| HalfSpace { normal, limit }));
        faces
    }

    /// The half-spaces of the faces, and those of the box that tilted faces leave in effect.
    fn faces(&self) -> Vec<HalfSpace> {
        let (inset, tilt) = (&self.settings.cube.inset, &self.settings.cube.tilt);
        let insets = [inset.left, inset.right, inset.near, inset.far, inset.bottom, inset.top];
        let tilts = [tilt.left, tilt.right, tilt.near, tilt.far, tilt.bottom, tilt.top];
        let mut faces = Vec::new();
        for ((axis, out), (inset, [first, second])) in SIDES.iter().zip(insets.iter().zip(tilts)) {
            let outwards = DVec3::AXES[*axis] * *out;
            let side = if *out > 0.0 { self.high } else { self.low };
            let in_face: Vec<DVec3> = (0..3).filter(|a| a != axis).map(|a| DVec3::AXES[a]).collect();
            let turned = DMat3::from_quat(
                DQuat::from_axis_angle(in_face[1], second.to_radians())
                    * DQuat::from_axis_angle(in_face[0], first.to_radians()),
            );
            let mut middle = (self.low + self.high) / 2.0;
            middle[*axis] = side[*axis] - out * inset;
            let normal = turned * outwards;
            faces.push(HalfSpace { normal, limit: normal.dot(middle) });
            if first != 0.0 || second != 0.0 {
                faces.push(HalfSpace { normal: outwards, limit: outwards.dot(side) });
            }
        }
        faces
    }

    /// Refuses insets and tilts that leave nothing of the block.
    pub(super) fn check_block(&self) -> Result<(), SceneError> {
        // About the box's centre, and relative to its size: a volume may be a micrometre wide, or a kilometre away.
        let centre = (self.low + self.high) / 2.0;
        let about = |f: HalfSpace| HalfSpace { limit: f.room(centre), ..f };
        let faces: Vec<HalfSpace> = self.faces().into_iter().map(about).collect();
        let slack = 1e-8 * (self.high - self.low).max_element();
        match middle_of(&faces, slack) {
            Some(middle) if faces.iter().all(|f| f.room(middle) > slack) => Ok(()),
            _ => {
                let [x, y, z] = (self.high - self.low).to_array();
                refuse("cube.inset", format!("leaves nothing of the block of {x:.2} x {y:.2} x {z:.2} mm"))
            }
        }
    }
}

/// The mean of the corners of a convex solid, a point strictly inside it. None if the solid is flat or empty. `slack`: by how many mm
/// rounding may put a corner beyond a face.
fn middle_of(faces: &[HalfSpace], slack: f64) -> Option<DVec3> {
    let corners = corners(faces, 1e-9, slack);
    (!corners.is_empty()).then(|| corners.iter().sum::<DVec3>() / corners.len() as f64)
}

/// Corners of the intersection of half-spaces. Three planes have none if the determinant of their normals is below `least`. `slack`: by how many mm
/// rounding may put a corner beyond a plane.
pub(super) fn corners(planes: &[HalfSpace], least: f64, slack: f64) -> Vec<DVec3> {
    let mut corners = Vec::new();
    for (i, a) in planes.iter().enumerate() {
        for (j, b) in planes.iter().enumerate().skip(i + 1) {
            for c in planes.iter().skip(j + 1) {
                let across = DMat3::from_cols(a.normal, b.normal, c.normal).transpose();
                if across.determinant().abs() < least {
                    continue;
                }
                let corner = across.inverse() * DVec3::new(a.limit, b.limit, c.limit);
                if planes.iter().all(|plane| plane.room(corner) >= -slack) {
                    corners.push(corner);
                }
            }
        }
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sides(low: DVec3, high: DVec3) -> Vec<HalfSpace> {
        let side = |&(axis, out): &(usize, f64)| {
            let normal = DVec3::AXES[axis] * out;
            HalfSpace { normal, limit: normal.dot(if out > 0.0 { high } else { low }) }
        };
        SIDES.iter().map(side).collect()
    }

    #[test]
    fn the_middle_of_a_box_is_its_centre_and_of_nothing_there_is_none() {
        let (low, high) = (DVec3::new(-3.0, 10.0, -1.0), DVec3::new(5.0, 40.0, 2.0));
        let middle = middle_of(&sides(low, high), 1e-6).unwrap();
        assert!(middle.distance((low + high) / 2.0) < 1e-9);
        let mut faces = sides(low, high);
        faces.push(HalfSpace { normal: DVec3::X, limit: -3.5 });
        assert!(middle_of(&faces, 1e-6).is_none());
    }
}
