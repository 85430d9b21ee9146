//! The view that shows a measurement: that of the scene, or else the plane that its points lie in, or the rendering that they were picked on.

use crate::measure::{made, overlay, shapes};
use crate::scene::load::Layers;
use crate::scene::{MeasureKind, Measurement, Mode, PlaneName, Scene};
use crate::tree::ToNode;
use glam::DVec3;

/// Largest distance of a point from the plane that is moved to it, mm.
const IN_PLANE: f64 = 0.1;
/// Angles of a view that was written to a tenth of a degree.
const SAME_ANGLE: f64 = 0.051;
/// Two points, or points on one line, lie in many planes: area of a triangle as a share of the square of its extent.
const ON_A_LINE: f64 = 1e-6;

/// A view of a scene.
#[derive(Clone, Debug)]
pub(super) struct View {
    /// What differs from the settings of the scene, as assignments of `--set`.
    pub(super) set: Vec<String>,
    pub(super) scene: Scene,
    /// The measurement is drawn on it. It is not if no plane holds its points, or if it is a box.
    pub(super) is_drawn: bool,
}

/// The view of the measurement with this index, which belongs to this volume.
///
/// # Errors
/// One line: the scene allows none of the views.
pub(super) fn of(scene: &Scene, index: usize, volume: u32) -> Result<View, String> {
    let measured = &scene.settings.drawn.measure[index];
    let (moved, own) = match measured.on_surface {
        true => {
            let turned = turned(scene, measured);
            (turned.iter().cloned().collect(), turned.is_none())
        }
        false => (planes(scene, measured), true),
    };
    let candidates = own.then(Vec::new).into_iter().chain(moved).chain([Vec::new()]);
    let mut last = None;
    for set in candidates {
        let view = with(scene, set, index, volume)?;
        if view.is_drawn {
            return Ok(view);
        }
        last = Some(view);
    }
    last.ok_or_else(|| "no view".into())
}

/// A view with these assignments.
///
/// # Errors
/// One line: an assignment that is not allowed.
pub(super) fn with(scene: &Scene, set: Vec<String>, index: usize, volume: u32) -> Result<View, String> {
    let mut layers = Layers::of(&scene.settings).ok_or("the settings cannot be written")?;
    set.iter().try_for_each(|set| layers.set(set)).map_err(|e| e.to_string())?;
    let settings = layers.finish().map_err(|e| e.to_string())?;
    let scene = match set.is_empty() {
        true => scene.clone(),
        false => Scene::new(scene.geometry.clone(), scene.input, settings).map_err(|e| e.to_string())?,
    };
    let drawn = overlay::drawn(&scene, Some(volume), &scene.settings.drawn.measure);
    let is_within = |drawn: &overlay::Drawn| {
        let [corner, size] = drawn.tile;
        let all = drawn.lines.iter().flatten().chain(drawn.points.iter().map(|(_, at)| at));
        all.into_iter().all(|at| (0..2).all(|a| at[a] >= corner[a] && at[a] <= corner[a] + size[a]))
    };
    let is_drawn = drawn.iter().any(|drawn| drawn.index == index && !drawn.is_of_other && is_within(drawn));
    Ok(View { set, scene, is_drawn })
}

/// The rendering in the direction in which the points were picked; None if the scene shows that.
fn turned(scene: &Scene, measured: &Measurement) -> Option<Vec<String>> {
    let camera = &scene.settings.camera;
    let now = [camera.azimuth, camera.elevation, camera.roll];
    let picked = measured.made.as_ref().and_then(|made| made::direction(&made.plane)).unwrap_or(now);
    let is_same = now.iter().zip(picked).all(|(now, picked)| (now - picked).abs() < SAME_ANGLE);
    if is_same && !scene.is_flat() {
        return None;
    }
    let mode = if scene.is_flat() { Mode::Surface } else { scene.settings.mode };
    let angles = ["azimuth", "elevation", "roll"].iter().zip(picked);
    let mut set = vec![assigned("mode", mode)?, "layout=single".into()];
    set.extend(angles.filter(|_| !is_same).map(|(name, angle)| format!("camera.{name}={angle}")));
    Some(set)
}

/// A value for a setting, as `--set` takes it.
fn assigned(key: &str, value: impl ToNode) -> Option<String> {
    Some(match value.to_node().into_toml().ok()? {
        toml::Value::String(word) => format!("{key}={word}"),
        value => format!("{key}={value}"),
    })
}

/// The points that a picture has to show: of the contours of a volume the largest.
pub(super) fn shown_points(measured: &Measurement) -> &[[f64; 3]] {
    let area =
        |contour: &[[f64; 3]]| shapes::area(&contour.iter().map(|point| (*point).into()).collect::<Vec<DVec3>>());
    let largest = measured.contours.iter().max_by(|a, b| area(a).total_cmp(&area(b)));
    largest.map_or(&measured.points, Vec::as_slice)
}

/// Single planes that hold the points of a measurement, the most likely one first.
fn planes(scene: &Scene, measured: &Measurement) -> Vec<Vec<String>> {
    let points: Vec<DVec3> = shown_points(measured).iter().map(|point| scene.place_of(*point)).collect();
    if points.is_empty() {
        return Vec::new();
    }
    let centre = points.iter().sum::<DVec3>() / points.len() as f64;
    let holds = |normal: DVec3| points.iter().all(|point| (*point - centre).dot(normal).abs() <= IN_PLANE);
    let is_box = measured.kind == MeasureKind::Threshold;
    let hint = measured.made.as_ref().and_then(|made| made::normal(&made.plane));
    let names = [scene.settings.planes.plane, PlaneName::A, PlaneName::B, PlaneName::C];
    let named = names.map(|name| (name, scene.plane(name).normal, false));
    let turned = across(&points, hint).map(|normal| (PlaneName::A, normal, true));
    let all = named.into_iter().chain(turned);
    let mut found: Vec<_> = all.filter(|(_, normal, is_turned)| holds(*normal) || (is_box && !is_turned)).collect();
    // Of the planes through two points the one that they were set on, which is known to three decimals.
    let apart = |normal: DVec3| hint.map_or(0.0, |hint| (normal.cross(hint).length() * 1e3).round());
    found.sort_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
    let position = scene.point_of(centre).map(|mm| (mm * 1e4).round() / 1e4);
    let zooms = if scene.settings.planes.zoom == 1.0 { &[None][..] } else { &[None, Some("planes.zoom=1")] };
    let set = |(name, normal, is_turned): &(PlaneName, DVec3, bool), zoom: Option<&str>| {
        let mut set = vec![assigned("mode", Mode::Plane)?, "layout=single".into(), assigned("planes.plane", name)?];
        set.push(assigned("planes.position", position)?);
        // A curved plane would take half of the picture.
        set.extend(scene.settings.planes.curve.is_some().then(|| "planes.curve=none".into()));
        if *is_turned {
            let [azimuth, tilt] = angles(*normal);
            set.extend([format!("planes.azimuth={azimuth}"), format!("planes.tilt={tilt}"), "planes.roll=0".into()]);
        }
        set.extend(zoom.map(str::to_string));
        Some(set)
    };
    found.iter().flat_map(|plane| zooms.iter().filter_map(|zoom| set(plane, *zoom))).collect()
}

/// The normal of the plane through points. Of the many through a line the one with a normal next to `hint`, or else next to the elevation.
fn across(points: &[DVec3], hint: Option<DVec3>) -> Option<DVec3> {
    let first = points.first()?;
    let farthest = |a: &&DVec3, b: &&DVec3| a.distance_squared(*first).total_cmp(&b.distance_squared(*first));
    let along = *points.iter().max_by(farthest)? - *first;
    let normals = points.iter().map(|point| along.cross(*point - *first));
    let normal = normals.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    if normal.length() > ON_A_LINE * along.length_squared() {
        return normal.try_normalize();
    }
    let along = along.try_normalize();
    let next = |to: DVec3| along.map_or(to, |along| to.reject_from_normalized(along));
    let hints = hint.into_iter().chain([DVec3::Z, DVec3::X]).map(next);
    hints.into_iter().find(|normal| normal.length() > 0.1)?.try_normalize()
}

/// Azimuth and tilt, in degrees, that turn the normal of plane A there. Planes have two sides: the one towards +elevation is taken.
fn angles(normal: DVec3) -> [f64; 2] {
    let normal = if normal.z < 0.0 { -normal } else { normal };
    [(-normal.x).atan2(normal.z), -normal.y.clamp(-1.0, 1.0).asin()].map(f64::to_degrees)
}
