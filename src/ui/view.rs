//! How commands change the camera, the light, the viewer's clip plane, the planes and the region. Every function takes finite numbers of
//! any size and returns numbers that [`Scene::new`] accepts.

use super::command::Face;
use super::picking::Picker;
use crate::probe::{Geometry, Motion};
use crate::scene::{Camera, Clip, MAX_CLIPS, Mode, PlaneName, Scene, Settings, insonified_box};
use glam::{DVec2, DVec3};

/// Nearest and farthest zoom by hand. What a scene file asks for beyond them stays in reach.
pub const ZOOM: [f64; 2] = [0.2, 20.0];

/// A place in space as settings have it: depth from the probe's face.
pub(super) fn below_face(scene: &Scene, place: DVec3) -> DVec3 {
    place - DVec3::Y * scene.probe().map_or(0.0, |probe| probe.array_radius())
}

/// Degrees in -180..=180.
pub(super) fn wrapped(degrees: f64) -> f64 {
    if (-180.0..=180.0).contains(&degrees) { degrees } else { (degrees + 180.0).rem_euclid(360.0) - 180.0 }
}

/// The deepest start depth that the mode draws from, as Y in space.
pub(super) fn start_depth(scene: &Scene) -> f64 {
    let (surface, volume, projection) = (scene.surface_view(), scene.volume_view(), scene.projection_view());
    match scene.settings.mode {
        Mode::Surface => surface.low.y,
        Mode::Volume => volume.low.y,
        Mode::Mixed => surface.low.y.max(volume.low.y),
        Mode::Mip | Mode::MinIp | Mode::Mean => projection.low.y,
        _ => scene.low.y,
    }
}

/// The elevation that looks along the depth axis. A single frame is shown from its side at 0, a quarter turn further.
fn level(geometry: &Geometry) -> f64 {
    match geometry {
        Geometry::Sweep(probe) if matches!(probe.motion, Motion::Still { .. }) => -90.0,
        _ => 0.0,
    }
}

/// The same view with its elevation within a quarter turn of level: beyond it the camera stands on its head, and a hand that drags
/// to the right would turn the volume to the left.
pub(super) fn upright(camera: &Camera, geometry: &Geometry) -> Camera {
    let level = level(geometry);
    let above = wrapped(camera.elevation - level);
    if above.abs() <= 90.0 {
        return Camera { elevation: level + above, ..camera.clone() };
    }
    Camera {
        azimuth: wrapped(camera.azimuth + 180.0),
        elevation: level + wrapped(180.0 - above),
        roll: wrapped(camera.roll + 180.0),
        ..camera.clone()
    }
}

/// Azimuth goes round and round. Elevation ends where the volume is seen from above or below: beyond that all would be upside down,
/// and the far side is half a turn of azimuth away.
pub(super) fn turn(now: &Scene, [azimuth, elevation]: [f64; 2]) -> Camera {
    let camera = upright(&now.settings.camera, &now.geometry);
    let level = level(&now.geometry);
    let elevation = (camera.elevation + elevation).clamp(level - 90.0, level + 90.0);
    Camera { azimuth: wrapped(camera.azimuth + azimuth), elevation, ..camera }
}

pub(super) fn zoomed(zoom: f64, times: f64) -> f64 {
    (zoom * times).clamp(ZOOM[0].min(zoom), ZOOM[1].max(zoom))
}

/// What the camera looks at, so that all that is at its distance moves by these shares of the picture's height.
pub(super) fn pan(now: &Scene, shares: [f64; 2]) -> [f64; 3] {
    let height = f64::from(now.picture_size()[1]) * Picker::of(now).pixel();
    let [right, down] = shares.map(|s| s.clamp(-10.0, 10.0) * height);
    let rays = &now.rays;
    within(now, rays.target, rays.target - rays.right * right + rays.up * down)
}

/// A place in space, as settings have it, that is kept to where there are echoes. One that was outside need not jump there.
fn within(now: &Scene, was: DVec3, place: DVec3) -> [f64; 3] {
    let (low, high) = insonified_box(&now.geometry);
    below_face(now, place.max(low.min(was)).min(high.max(was))).to_array()
}

/// The direction of the light, and the place of one that is near, moved on the dome of the viewer's side. Its rim is a little above
/// the horizon, where a surface that faces the viewer still has some light.
pub(super) fn light(settings: &mut Settings, shares: [f64; 2]) {
    const RIM: f64 = 0.98;
    let light = &mut settings.light;
    let was = light.position.unwrap_or(light.direction);
    let away = if light.position.is_some() { was.length().clamp(1.0, 1e6) } else { 1.0 };
    let [right, down] = shares.map(|s| 2.0 * s.clamp(-10.0, 10.0));
    // The picture is as high as the dome is wide.
    let on_dome = was.normalize_or(DVec3::Z).truncate() + DVec2::new(right, -down);
    let on_dome = on_dome.clamp_length_max(RIM);
    let direction = on_dome.extend((1.0 - on_dome.length_squared()).sqrt());
    match &mut light.position {
        Some(position) => *position = direction * away,
        None => light.direction = direction,
    }
}

/// The viewer's clip plane is the one after those of the start. It lies across the view; where the view was turned since, it turns
/// about the point of it on the middle line of the volume. Nothing if there is no room for one.
pub(super) fn clip(now: &Scene, others: usize, by: f64) -> Option<Vec<Clip>> {
    let mut planes = now.settings.clip.clone();
    let mine = if planes.len() > others { planes.pop() } else { None };
    if planes.len() >= MAX_CLIPS {
        return None;
    }
    let (middle, forward) = (below_face(now, (now.low + now.high) / 2.0), now.rays.forward);
    let half = forward.abs().dot((now.high - now.low) / 2.0);
    // Behind the nearest corner of the region.
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

/// Where the planes meet once the named one has moved along its normal.
pub(super) fn stepped(now: &Scene, name: PlaneName, by: f64) -> [f64; 3] {
    let plane = now.plane(name);
    within(now, plane.at, plane.at + plane.normal * by.clamp(-1e6, 1e6))
}

/// A place given as settings have it, kept to where there are echoes.
pub(super) fn meeting(now: &Scene, place: [f64; 3]) -> [f64; 3] {
    let offset = now.low - below_face(now, now.low);
    let place = DVec3::from(place) + offset;
    let (low, high) = insonified_box(&now.geometry);
    below_face(now, place.clamp(low, high)).to_array()
}

/// Settings whose region or view differs from what is shown now, with the zoom and target at which the picture keeps its scale and
/// place. What fits the picture is another box, or the same seen from elsewhere: a face would run away from the hand that drags it,
/// and a volume that is turned would swell and shrink.
pub(super) fn held(now: &Scene, mut settings: Settings) -> Option<Settings> {
    let middle = Settings { camera: Camera { target: None, ..settings.camera.clone() }, ..settings.clone() };
    let fitted = Scene::new(now.geometry.clone(), now.input, middle).ok()?;
    let zoom = settings.camera.zoom;
    let distance = |scene: &Scene| (scene.rays.target - scene.rays.origin).dot(scene.rays.forward);
    let held = if now.rays.is_perspective {
        // The distance is a / zoom + b, b half the box along the view from zoom 1 on.
        let half = fitted.rays.forward.abs().dot(fitted.high - fitted.rays.target);
        let a = zoom * (distance(&fitted) - if zoom >= 1.0 { half } else { 0.0 });
        let (close, far) = (a / (distance(now) - half), a / distance(now));
        if close >= 1.0 { close } else { far }
    } else {
        zoom * Picker::of(&fitted).pixel() / Picker::of(now).pixel()
    };
    if held.is_finite() {
        settings.camera.zoom = held.clamp(1e-3, 1e3);
    }
    if settings.camera.target.is_none() && fitted.rays.target != now.rays.target {
        settings.camera.target = Some(below_face(now, now.rays.target).to_array());
    }
    Some(settings)
}

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
pub(super) fn face_axis(scene: &Scene, face: Face) -> (DVec3, DVec3) {
    let middle = (scene.low + scene.high) / 2.0;
    let half = (scene.high - scene.low) / 2.0;
    (middle + outwards(face) * half, outwards(face))
}

/// How far a face can be moved outwards, mm: at least (not above 0), at most (not below 0). A region that is thinner than
/// [`THINNEST`] already only grows.
pub(super) fn face_travel(scene: &Scene, face: Face) -> [f64; 2] {
    let (low, high) = insonified_box(&scene.geometry);
    let a = face.axis;
    // What lies above the start depth is not drawn: it does not count.
    let least = if a == 1 && face.high { scene.low.y.max(start_depth(scene)) } else { scene.low[a] };
    let inwards = (scene.high[a] - least - THINNEST).max(0.0);
    let out = if face.high { high[a] - scene.high[a] } else { scene.low[a] - low[a] };
    [-inwards, out.max(0.0)]
}

/// The same region with a face moved outwards, as far as there is room.
pub(super) fn move_face(scene: &Scene, face: Face, by: f64) -> Settings {
    let [least, most] = face_travel(scene, face);
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
pub(super) fn nearest_face(scene: &Scene, at: [f64; 2]) -> Option<Face> {
    let eye = Picker::of(scene);
    let distance = |face: &Face| {
        let (middle, out) = face_axis(scene, *face);
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
