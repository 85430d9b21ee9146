//! A tree of vessels in tissue: a portal vein that divides as Murray's law says.
//!
//! C. D. Murray, "The physiological principle of minimum work", PNAS 12 (1926): the cube of a vessel's radius is the sum of the cubes of its
//! daughters' radii, and the daughters leave it at angles (J. Gen. Physiol. 9, 1926) at which forces in proportion to the squares of the radii
//! balance.

use glam::{DQuat, DVec3};

/// A piece of a vessel between two divisions: a truncated cone with round ends, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vessel {
    pub from: DVec3,
    pub to: DVec3,
    /// Radius of the blood at `from` and at `to`, mm.
    pub radii: [f64; 2],
    /// Index in [`VesselTree::vessels`] of the piece that this one branches from. None for the trunk.
    pub parent: Option<usize>,
}

impl Vessel {
    /// Distance of a position from the blood of this piece, mm, negative inside, measured perpendicular to its axis, so that it is exact on the
    /// surface.
    pub fn distance(&self, place: DVec3) -> f64 {
        let along = self.to - self.from;
        let share = ((place - self.from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let [first, last] = self.radii;
        (place - self.from - along * share).length() - first - (last - first) * share
    }
}

/// A tree of vessels in liver tissue, all with a wall of the same thickness, and the grey values of blood, wall and tissue.
#[derive(Clone, Debug, PartialEq)]
pub struct VesselTree {
    /// The pieces of the tree: the trunk first, and each one after its parent.
    pub vessels: Vec<Vessel>,
    /// Thickness of the wall of all vessels, mm.
    pub wall: f64,
    pub blood: f64,
    pub muscle: f64,
    pub tissue: f64,
}

/// Radius of the trunk where it begins, mm: a portal vein is 8 to 13 mm wide.
const TRUNK: f64 = 4.0;
/// Thickness of the wall with its sheath, mm.
const WALL: f64 = 1.0;
/// Where the trunk begins, mm: lateral, depth, elevation. It leads to the right, across the beams.
const BEGIN: [f64; 3] = [-42.0, 57.5, -2.4];
const TOWARDS: [f64; 3] = [1.0, 0.12, 0.1];
/// Radius at the end of a vessel as a share of that at its beginning; the last ones end thin.
const TAPER: f64 = 0.95;
const LAST_TAPER: f64 = 0.5;
/// Of each generation: length as a multiple of the radius; radius of the lesser daughter as a share of the other's; angle by which the plane of
/// the division is turned from that of the one before, degrees. The tree is broad across the beams and no two vessels touch.
const GENERATIONS: [Generation; 5] = [
    Generation { length: 7.0, lesser: 0.9, turn: 0.0 },
    Generation { length: 5.2, lesser: 0.85, turn: 55.0 },
    Generation { length: 5.2, lesser: 0.85, turn: -50.0 },
    Generation { length: 5.6, lesser: 0.85, turn: 60.0 },
    Generation { length: 7.5, lesser: 1.0, turn: 0.0 },
];

struct Generation {
    length: f64,
    lesser: f64,
    turn: f64,
}

/// Radii of two daughters, of which the second is `lesser` times the first.
fn daughters(parent: f64, lesser: f64) -> [f64; 2] {
    let greater = parent / (1.0 + lesser.powi(3)).cbrt();
    [greater, lesser * greater]
}

/// Angles between a vessel's axis and those of its daughters, rad.
fn angles(parent: f64, [a, b]: [f64; 2]) -> [f64; 2] {
    let angle = |one: f64, other: f64| {
        ((parent.powi(4) + one.powi(4) - other.powi(4)) / (2.0 * parent.powi(2) * one.powi(2))).acos()
    };
    [angle(a, b), angle(b, a)]
}

/// Where a vessel begins.
struct Bud {
    from: DVec3,
    towards: DVec3,
    /// Normal of the plane of the division that it comes from.
    normal: DVec3,
    radius: f64,
    parent: Option<usize>,
    /// To which side of that plane's parent it leaves: 1 or -1. Trees on both sides are mirror images in their turns.
    side: f64,
}

impl VesselTree {
    /// A tree in front of an array whose face is at Y = `face` mm, with the grey values of blood, wall and tissue.
    pub fn new(face: f64, [blood, muscle, tissue]: [f64; 3]) -> VesselTree {
        let towards = DVec3::from(TOWARDS).normalize();
        let mut vessels = Vec::new();
        // The first division lies across the beams.
        let normal = towards.cross(DVec3::Z).normalize();
        let from = DVec3::from(BEGIN) + DVec3::Y * face;
        let mut buds = vec![Bud { from, towards, normal, radius: TRUNK, parent: None, side: 1.0 }];
        for (number, generation) in GENERATIONS.iter().enumerate() {
            let last = number + 1 == GENERATIONS.len();
            let mut next = Vec::new();
            for bud in buds {
                let to = bud.from + bud.towards * generation.length * bud.radius;
                let end = bud.radius * if last { LAST_TAPER } else { TAPER };
                let parent = Some(vessels.len());
                vessels.push(Vessel { from: bud.from, to, radii: [bud.radius, end], parent: bud.parent });
                let turn = DQuat::from_axis_angle(bud.towards, (generation.turn * bud.side).to_radians());
                let normal = turn * bud.normal;
                let radii = daughters(end, generation.lesser);
                for ((radius, angle), way) in radii.into_iter().zip(angles(end, radii)).zip([1.0, -1.0]) {
                    let towards = DQuat::from_axis_angle(normal, way * bud.side * angle) * bud.towards;
                    next.push(Bud { from: to, towards, normal, radius, parent, side: way });
                }
            }
            buds = next;
        }
        VesselTree { vessels, wall: WALL, blood, muscle, tissue }
    }

    /// Distance of a position from the blood of the nearest vessel, mm, negative inside.
    pub fn distance(&self, place: DVec3) -> f64 {
        self.vessels.iter().map(|vessel| vessel.distance(place)).fold(f64::MAX, f64::min)
    }
}
