//! The faces of the region that hands move.

use super::command::Face;
use super::picking::Picker;
use super::view::{below_face, start_depth};
use crate::scene::{Scene, Settings, insonified_box};
use glam::DVec3;

/// Least thickness of what is left, mm.
pub const THINNEST: f64 = 2.0;

const FACES: [Face; 6] = [
    Face { axis: 0, high: false },
    Face { axis: 0, high: true },
    Face { axis: 1, high: false },
    Face { axis: 1, high: true },
    Face { axis: 2, high: false },
    Face { axis: 2, high: true },
];

fn outwards(face: Face) -> DVec3 {
    DVec3::AXES[face.axis] * if face.high { 1.0 } else { -1.0 }
}

/// The middle of a face in space and the way out, a unit vector.
pub(super) fn axis(scene: &Scene, face: Face) -> (DVec3, DVec3) {
    let middle = (scene.low + scene.high) / 2.0;
    let half = (scene.high - scene.low) / 2.0;
    (middle + outwards(face) * half, outwards(face))
}

/// How far a face can be moved outwards, mm: at least (not above 0), at most (not below 0). A region that is thinner than
/// [`THINNEST`] already only grows.
pub(super) fn room(scene: &Scene, face: Face) -> [f64; 2] {
    let (low, high) = insonified_box(&scene.geometry);
    let a = face.axis;
    // What lies above the start depth is not drawn: it does not count.
    let least = if a == 1 && face.high { scene.low.y.max(start_depth(scene)) } else { scene.low[a] };
    let inwards = (scene.high[a] - least - THINNEST).max(0.0);
    let out = if face.high { high[a] - scene.high[a] } else { scene.low[a] - low[a] };
    [-inwards, out.max(0.0)]
}

/// The same region with a face moved outwards, as far as there is room.
pub(super) fn moved(scene: &Scene, face: Face, by: f64) -> Settings {
    let [least, most] = room(scene, face);
    let by = by.clamp(least, most);
    let (low, high) = (below_face(scene, scene.low)[face.axis], below_face(scene, scene.high)[face.axis]);
    let mut settings = scene.settings.clone();
    let region = &mut settings.region;
    let side = match face.axis {
        0 => &mut region.lateral,
        1 => &mut region.depth,
        _ => &mut region.elevation,
    };
    *side = Some(if face.high { [low, high + by] } else { [low - by, high] });
    settings
}

/// An axis that is seen at a smaller share of its length moves too much under a hand.
const FORESHORTENED: f64 = 0.25;

/// The face whose axis, from its middle outwards, is seen nearest to a place on the picture.
pub(super) fn nearest(scene: &Scene, at: [f64; 2]) -> Option<Face> {
    let eye = Picker::of(scene);
    let distance = |face: &Face| {
        let (middle, out) = axis(scene, *face);
        let (from, to) = (eye.seen(middle)?, eye.seen(middle + out)?);
        let seen = [to[0] - from[0], to[1] - from[1]];
        let length = seen[0].hypot(seen[1]);
        if length * eye.pixel() < FORESHORTENED {
            return None;
        }
        let grab = [at[0] - from[0], at[1] - from[1]];
        let along = (grab[0] * seen[0] + grab[1] * seen[1]) / length;
        let across = (grab[0] * seen[1] - grab[1] * seen[0]) / length;
        Some(across.hypot(along.min(0.0)))
    };
    let seen = FACES.iter().filter_map(|face| Some((*face, distance(face)?)));
    seen.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(face, _)| face)
}
