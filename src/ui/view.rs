//! How commands change the camera, the light, the viewer's clip plane, the planes and the region. Every function takes any finite numbers and returns
//! numbers that [`Scene::new`] accepts.

use super::picking::{Picker, nearest};
use crate::probe::{Geometry, Motion};
use crate::scene::{Camera, Clip, MAX_CLIPS, PlaneName, Scene, Settings, insonified_box};
use glam::{DVec2, DVec3};

/// Limits of the zoom for gestures and keys. A zoom beyond them that a scene file set stays reachable.
const ZOOM: [f64; 2] = [0.2, 20.0];

/// Converts a point in space, mm, to the coordinates of the settings, in which depth is counted from the probe's face.
pub(super) fn below_face(scene: &Scene, point: DVec3) -> DVec3 {
    point - DVec3::Y * scene.probe().map_or(0.0, |probe| probe.array_radius())
}

/// An angle wrapped to -180..=180 degrees.
pub(super) fn wrap_degrees(degrees: f64) -> f64 {
    if (-180.0..=180.0).contains(&degrees) { degrees } else { (degrees + 180.0).rem_euclid(360.0) - 180.0 }
}

/// The largest depth at which the mode starts to draw, as Y in space, mm.
pub(super) fn start_depth(scene: &Scene) -> f64 {
    scene.start_depth()
}

/// The elevation that looks along the depth axis. A single frame is shown from its side at elevation 0, 90 degrees further.
fn level(geometry: &Geometry) -> f64 {
    match geometry {
        Geometry::Sweep(probe) if matches!(probe.motion, Motion::Still { .. }) => -90.0,
        _ => 0.0,
    }
}

/// The same view with its elevation within 90 degrees of level. Beyond that the camera is upside down, and a drag to the right would
/// rotate the volume to the left.
pub(super) fn upright(camera: &Camera, geometry: &Geometry) -> Camera {
    let level = level(geometry);
    let above = wrap_degrees(camera.elevation - level);
    if above.abs() <= 90.0 {
        return Camera { elevation: level + above, ..camera.clone() };
    }
    Camera {
        azimuth: wrap_degrees(camera.azimuth + 180.0),
        elevation: level + wrap_degrees(180.0 - above),
        roll: wrap_degrees(camera.roll + 180.0),
        ..camera.clone()
    }
}

/// The camera after a rotation by azimuth and elevation, degrees. Azimuth wraps around. Elevation is limited so that the camera looks at most
/// straight from above or below: beyond that everything would be upside down, and the far side is 180 degrees of azimuth away.
pub(super) fn rotate(now: &Scene, [azimuth, elevation]: [f64; 2]) -> Camera {
    let camera = upright(&now.settings.camera, &now.geometry);
    let level = level(&now.geometry);
    let elevation = (camera.elevation + elevation).clamp(level - 90.0, level + 90.0);
    Camera { azimuth: wrap_degrees(camera.azimuth + azimuth), elevation, ..camera }
}

/// A side from which a rendering is viewed, relative to its orientation at the start and not to the patient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Viewpoint {
    /// From the side of the probe.
    Front,
    Left,
    Right,
    Top,
}

/// The camera that looks from a viewpoint, upright.
pub(super) fn look_from(now: &Scene, viewpoint: Viewpoint) -> Camera {
    let [azimuth, elevation] = match viewpoint {
        Viewpoint::Front => [0.0, 0.0],
        Viewpoint::Left => [90.0, 0.0],
        Viewpoint::Right => [-90.0, 0.0],
        Viewpoint::Top => [0.0, -90.0],
    };
    Camera { azimuth, elevation: level(&now.geometry) + elevation, roll: 0.0, ..now.settings.camera.clone() }
}

/// True if the camera looks from this viewpoint.
pub(super) fn is_seen_from(now: &Scene, viewpoint: Viewpoint) -> bool {
    let angles = |camera: &Camera| [camera.azimuth, camera.elevation, camera.roll];
    angles(&now.settings.camera) == angles(&look_from(now, viewpoint))
}

/// The zoom multiplied by a factor, and limited to [`ZOOM`].
pub(super) fn scale_zoom(zoom: f64, factor: f64) -> f64 {
    (zoom * factor).clamp(ZOOM[0].min(zoom), ZOOM[1].max(zoom))
}

/// The target of the camera after what is shown at its distance was moved to the right and down, by shares of the picture's height. Coordinates
/// are those of the settings, mm.
pub(super) fn pan(now: &Scene, shares: [f64; 2]) -> [f64; 3] {
    let height = f64::from(now.picture_size()[1]) * Picker::of(now).mm_per_pixel();
    let [right, down] = shares.map(|s| s.clamp(-10.0, 10.0) * height);
    let rays = &now.rays;
    clamp_to_data(now, rays.target, rays.target - rays.right * right + rays.up * down)
}

/// A point in space limited to the insonified box, in the coordinates of the settings. A point that was outside does not jump inside.
fn clamp_to_data(now: &Scene, was: DVec3, point: DVec3) -> [f64; 3] {
    let (low, high) = insonified_box(&now.geometry);
    below_face(now, point.max(low.min(was)).min(high.max(was))).to_array()
}

/// Moves the light to the right and down over a dome on the viewer's side, by shares of the picture's height: its direction, or the position of
/// a near light. The rim of the dome is slightly above the horizon, where a surface that faces the viewer still gets some light.
pub(super) fn move_light(settings: &mut Settings, shares: [f64; 2]) {
    const RIM: f64 = 0.98;
    let light = &mut settings.light;
    let was = light.position.unwrap_or(light.direction);
    let away = if light.position.is_some() { was.length().clamp(1.0, 1e6) } else { 1.0 };
    let [right, down] = shares.map(|s| 2.0 * s.clamp(-10.0, 10.0));
    // The height of the picture corresponds to the width of the dome.
    let on_dome = was.normalize_or(DVec3::Z).truncate() + DVec2::new(right, -down);
    let on_dome = on_dome.clamp_length_max(RIM);
    let direction = on_dome.extend((1.0 - on_dome.length_squared()).sqrt());
    match &mut light.position {
        Some(position) => *position = direction * away,
        None => light.direction = direction,
    }
}

/// The clip planes after the viewer's plane was moved by `by` mm into the volume. The viewer's plane is the one after the first `others`. It
/// faces the viewer; if the view was rotated since, the plane rotates about its point on the volume's central line. None if all clip planes are
/// in use.
pub(super) fn move_clip(now: &Scene, others: usize, by: f64) -> Option<Vec<Clip>> {
    let mut planes = now.settings.clip.clone();
    let mine = if planes.len() > others { planes.pop() } else { None };
    if planes.len() >= MAX_CLIPS {
        return None;
    }
    let (middle, forward) = (below_face(now, (now.low + now.high) / 2.0), now.rays.forward);
    let half = forward.abs().dot((now.high - now.low) / 2.0);
    // Depth behind the nearest corner of the region.
    let was = mine.map_or(0.0, |plane| (DVec3::from(plane.at) - middle).dot(forward) + half);
    let depth = (was + by).min(2.0 * half - 1.0);
    if depth > 0.0 {
        let from = mine.map_or(middle, |plane| DVec3::from(plane.at));
        let at = from + forward * (depth - half - (from - middle).dot(forward));
        planes.push(Clip {
            at: at.clamp(DVec3::splat(-1e6), DVec3::splat(1e6)).to_array(),
            normal: (-forward).to_array(),
        });
    }
    Some(planes)
}

/// The point where the three planes cross, in the coordinates of the settings, mm, after the named plane was moved along its normal by `by` mm.
pub(super) fn step_plane(now: &Scene, name: PlaneName, by: f64) -> [f64; 3] {
    let plane = now.plane(name);
    clamp_to_data(now, plane.at, plane.at + plane.normal * by.clamp(-1e6, 1e6))
}

/// The point where the planes cross, in the coordinates of the settings, mm, limited to the box around the insonified region.
pub(super) fn clamp_crossing(now: &Scene, point: [f64; 3]) -> [f64; 3] {
    let offset = now.low - below_face(now, now.low);
    let point = DVec3::from(point) + offset;
    let (low, high) = insonified_box(&now.geometry);
    below_face(now, point.clamp(low, high)).to_array()
}

/// The settings, which have another region or view than the scene, with zoom and target adjusted so that the picture keeps its scale and
/// position. The camera fits the box of the region into the picture: without this a face would run away from the pointer that drags it, and a
/// volume would grow and shrink while it rotates. None if they cannot be drawn.
pub(super) fn keep_scale(now: &Scene, mut settings: Settings) -> Option<Settings> {
    let middle = Settings { camera: Camera { target: None, ..settings.camera.clone() }, ..settings.clone() };
    let fitted = Scene::new(now.geometry.clone(), now.input, middle).ok()?;
    let zoom = settings.camera.zoom;
    let distance = |scene: &Scene| (scene.rays.target - scene.rays.origin).dot(scene.rays.forward);
    let kept_zoom = if now.rays.is_perspective {
        // The distance is a / zoom + half the box along the view.
        let half = fitted.rays.forward.abs().dot(fitted.high - fitted.rays.target);
        let a = zoom * (distance(&fitted) - half);
        // A box that has grown past the camera is seen from as near as the camera may be.
        a / (distance(now) - half).max(1e-9)
    } else {
        zoom * Picker::of(&fitted).mm_per_pixel() / Picker::of(now).mm_per_pixel()
    };
    if kept_zoom.is_finite() {
        settings.camera.zoom = kept_zoom.clamp(1e-3, 1e3);
    }
    if settings.camera.target.is_none() && fitted.rays.target != now.rays.target {
        settings.camera.target = Some(below_face(now, now.rays.target).to_array());
    }
    Some(settings)
}

/// Least thickness of the region after a face moved, mm.
const MIN_THICKNESS: f64 = 2.0;

/// A face of the region's box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Axis of its normal: 0 lateral, 1 depth, 2 elevation.
    pub axis: usize,
    /// True for the face at the higher end of the axis.
    pub high: bool,
}

pub(super) const FACES: [Face; 6] = [
    Face { axis: 0, high: false },
    Face { axis: 0, high: true },
    Face { axis: 1, high: false },
    Face { axis: 1, high: true },
    Face { axis: 2, high: false },
    Face { axis: 2, high: true },
];

/// The outward unit normal of a face of the region.
fn outwards(face: Face) -> DVec3 {
    DVec3::AXES[face.axis] * if face.high { 1.0 } else { -1.0 }
}

/// The centre of a face of the region in space, mm, and its outward unit normal.
pub(super) fn face_axis(scene: &Scene, face: Face) -> (DVec3, DVec3) {
    let middle = (scene.low + scene.high) / 2.0;
    let half = (scene.high - scene.low) / 2.0;
    (middle + outwards(face) * half, outwards(face))
}

/// How far a face can move outwards, mm: the smallest distance (at most 0) and the largest (at least 0). A region that is already thinner than
/// [`MIN_THICKNESS`] can only grow.
pub(super) fn face_travel(scene: &Scene, face: Face) -> [f64; 2] {
    let (low, high) = insonified_box(&scene.geometry);
    let a = face.axis;
    // What is above the start depth is not drawn and does not count.
    let least = if a == 1 && face.high { scene.low.y.max(start_depth(scene)) } else { scene.low[a] };
    let inwards = (scene.high[a] - least - MIN_THICKNESS).max(0.0);
    let out = if face.high { high[a] - scene.high[a] } else { scene.low[a] - low[a] };
    [-inwards, out.max(0.0)]
}

/// The settings with a face of the region moved outwards by `by` mm, as far as it can move.
pub(super) fn move_face(scene: &Scene, face: Face, by: f64) -> Settings {
    let [least, most] = face_travel(scene, face);
    let by = by.clamp(least, most);
    let (low, high) = (below_face(scene, scene.low)[face.axis], below_face(scene, scene.high)[face.axis]);
    let mut settings = scene.settings.clone();
    let region = &mut settings.region;
    let sides = [&mut region.lateral, &mut region.depth, &mut region.elevation];
    *sides[face.axis] = Some(if face.high { [low, high + by] } else { [low - by, high] });
    settings
}

/// How far the region can move along each axis, mm: towards lower coordinates (at most 0) and towards higher ones (at least 0).
pub(super) fn region_travel(scene: &Scene) -> [DVec3; 2] {
    let (low, high) = insonified_box(&scene.geometry);
    [(low - scene.low).min(DVec3::ZERO), (high - scene.high).max(DVec3::ZERO)]
}

/// The settings with the region and its start curve moved by a vector, mm, as far as they can move.
pub(super) fn move_region(scene: &Scene, by: DVec3) -> Settings {
    let [least, most] = region_travel(scene);
    let by = by.clamp(least, most);
    let (low, high) = (below_face(scene, scene.low), below_face(scene, scene.high));
    let mut settings = scene.settings.clone();
    let region = &mut settings.region;
    for (axis, side) in [&mut region.lateral, &mut region.depth, &mut region.elevation].into_iter().enumerate() {
        if by[axis] != 0.0 {
            *side = Some([low[axis] + by[axis], high[axis] + by[axis]]);
        }
    }
    for point in region.start_curve.iter_mut().flatten() {
        *point = [point[0] + by.x, point[1] + by.y];
    }
    settings
}

/// A face cannot be dragged if its axis appears shorter than this fraction of its length: small drags would move it too far.
const MIN_FORESHORTENING: f64 = 0.25;

/// The centre of a face in the picture, and the way from there along its normal, outwards, for a millimetre, both in pixels. None if the normal is too
/// short in the picture for the face to be dragged.
pub(super) fn drawn_axis(scene: &Scene, picker: &Picker, face: Face) -> Option<([f64; 2], [f64; 2])> {
    let (middle, out) = face_axis(scene, face);
    let (from, to) = (picker.project(middle)?, picker.project(middle + out)?);
    let way = [to[0] - from[0], to[1] - from[1]];
    (way[0].hypot(way[1]) * picker.mm_per_pixel() >= MIN_FORESHORTENING).then_some((from, way))
}

/// The face of the region whose normal, drawn from its centre outwards, is nearest to a position (pixels of the picture). None if no face can be
/// dragged.
pub(super) fn nearest_face(scene: &Scene, at: [f64; 2]) -> Option<Face> {
    let picker = Picker::of(scene);
    let distance = |face: &Face| {
        let (from, projected) = drawn_axis(scene, &picker, *face)?;
        let length = projected[0].hypot(projected[1]);
        let grab = [at[0] - from[0], at[1] - from[1]];
        let along = (grab[0] * projected[0] + grab[1] * projected[1]) / length;
        let across = (grab[0] * projected[1] - grab[1] * projected[0]) / length;
        Some(across.hypot(along.min(0.0)))
    };
    nearest(FACES.iter().filter_map(|face| Some((distance(face)?, *face))), f64::INFINITY)
}
