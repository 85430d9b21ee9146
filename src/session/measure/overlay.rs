//! The drawing of measurements over a picture: lines, calipers and labels in pixels of the picture, tile by tile. The viewer and written
//! pictures draw the same.

use super::outcome;
use super::shapes::Ellipse;
use crate::scene::picker::Picker;
use crate::scene::planes::{Plane, Tile, Tiling};
use crate::scene::{MeasureKind, Measurement, Scene};
use glam::DVec3;

/// Points of the outline of an ellipse.
const OUTLINE: usize = 72;
/// Largest distance from the plane of a tile, mm, of a point that counts as in the plane. In a slab, half of its thickness is used.
const IN_PLANE: f64 = 0.5;

/// The drawing of one measurement on one tile of a picture. Positions are in pixels of the picture, from its upper left corner.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Index of the measurement in the list.
    pub index: usize,
    /// The tile on which it is drawn: upper left corner, and width and height.
    pub tile: [[f64; 2]; 2],
    /// The lines to draw, each as a list of points. A closed line repeats its first point at the end.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// The points that the user set: the index of each in the measurement, and its position, where a cross is drawn and it can be dragged. Of a path
    /// along a surface both ends, with the indices 0 and 1; they cannot be dragged. Empty for traces, contours of a volume and boxes.
    pub points: Vec<(usize, [f64; 2])>,
    /// The tip of an arrow's head, and a point on its shaft, from which the direction follows; None if it is no arrow.
    pub head: Option<[[f64; 2]; 2]>,
    pub label: String,
    /// The measurement belongs to another volume than the one that is shown, so that it is dimmed and cannot be dragged.
    pub is_of_other: bool,
    /// Position of the lower left corner of the label.
    pub at: [f64; 2],
}

/// The drawings of all measurements over the picture of a scene, one for each tile that shows the measurement. `all`: the list in
/// [`crate::scene::Settings::measure`]; `volume`: number of the volume that the picture shows. None: not known, all measurements count as made on it.
pub fn drawn(scene: &Scene, volume: Option<u32>, all: &[Measurement]) -> Vec<Drawn> {
    if all.is_empty() {
        return Vec::new();
    }
    let mut found = Vec::new();
    if scene.cuts_planes() {
        let tiling = scene.tiling();
        let reach = IN_PLANE.max(scene.settings.planes.thickness / 2.0);
        for tile in &tiling.tiles {
            let view = OnTile { tiling: &tiling, tile, reach };
            let area = [tile.corner, tile.size].map(|[x, y]| [f64::from(x), f64::from(y)]);
            let drawn = all.iter().enumerate().filter(|(_, measured)| !measured.on_surface);
            // What is straight in space, and its length, is another thing on a curved plane.
            let is_curved = tile.section.is_some();
            let fits = |kind| matches!(kind, MeasureKind::Surface | MeasureKind::Text | MeasureKind::Arrow);
            let drawn = drawn.filter(|(_, measured)| !is_curved || fits(measured.kind));
            let plane = Some(&tile.plane);
            let of = |(index, measured)| of(scene, index, measured, area, plane, |p| view.project(p));
            found.extend(drawn.filter_map(of));
        }
    }
    if !scene.is_flat() {
        let picker = Picker::of(scene);
        let drawn = all.iter().enumerate().filter(|(_, measured)| measured.on_surface);
        let area = [picker.corner(), picker.size()];
        let of = |(index, measured)| of(scene, index, measured, area, None, |p| picker.project(p));
        found.extend(drawn.filter_map(of));
    }
    for drawn in &mut found {
        if let Some(other) = all[drawn.index].other_volume(volume) {
            drawn.is_of_other = true;
            drawn.label = format!("{} (volume {})", drawn.label, u64::from(other) + 1).trim_start().to_string();
        }
    }
    found
}

/// The drawings of an unfinished measurement, as if `hover`, the place under the pointer (lateral, depth from the probe's face, elevation, mm),
/// were its next point; None: without it. `number`: that of its label; `on_section`: the pointer is on a curved plane.
pub fn preview(
    scene: &Scene,
    number: usize,
    work: &Measurement,
    hover: Option<[f64; 3]>,
    on_section: bool,
) -> Vec<Drawn> {
    let mut shown = work.clone();
    // On a curved plane the caliper is the way that is straight there.
    let ends = work.points.first().copied().zip(hover).map(|(from, to)| [from, to].map(|point| scene.place_of(point)));
    if let (MeasureKind::Distance, 1, Some([from, to])) = (work.kind, work.points.len(), ends.filter(|_| on_section))
        && let Some(way) = scene.way_on_section(from, to)
    {
        let points = way.into_iter().map(|place| scene.point_of(place)).collect();
        let way = Measurement { kind: MeasureKind::Surface, points, ..Measurement::default() };
        let mut found = drawn(scene, None, &[way]);
        found.iter_mut().for_each(|drawn| drawn.label = drawn.label.replacen("1:", &format!("{number}:"), 1));
        return found;
    }
    let is_open = work.kind.complete_at().is_none_or(|count| work.points.len() < count);
    shown.points.extend(hover.filter(|_| is_open && !work.points.is_empty()));
    let closed = Measurement { points: Vec::new(), ..shown.clone() };
    shown.contours.clear();
    shown.kind = match (work.kind, shown.points.len()) {
        (_, 0 | 1) => MeasureKind::Text,
        (MeasureKind::Ellipse | MeasureKind::Angle, 2) => MeasureKind::Distance,
        (MeasureKind::Volume, _) => MeasureKind::Trace,
        (kind, _) => kind,
    };
    let mut found = drawn(scene, None, &[shown, closed]);
    for drawn in &mut found {
        // What is not complete has no result yet.
        let is_caliper = work.kind == MeasureKind::Distance && drawn.points.len() == 2;
        drawn.label = if is_caliper { drawn.label.replacen("1:", &format!("{number}:"), 1) } else { String::new() };
    }
    found
}

/// A label with the distance between the slices of a tomography, for its reference tile; empty with fewer than two slices.
pub fn spacing_label(tiling: &Tiling) -> String {
    match &tiling.tiles[..] {
        [_, first, second, ..] => format!("every {:.1} mm", second.plane.at.distance(first.plane.at)),
        _ => String::new(),
    }
}

/// The two lines of an arrow's head; `length`: its extent along the shaft, pixels. The first argument is the tip and a point on the shaft. Empty if
/// both are the same.
pub fn arrow_head([tip, tail]: [[f64; 2]; 2], length: f64) -> Vec<[[f64; 2]; 2]> {
    let (x, y) = (tail[0] - tip[0], tail[1] - tip[1]);
    let shaft = x.hypot(y);
    if shaft < 1e-6 {
        return Vec::new();
    }
    let (x, y) = (x / shaft * length, y / shaft * length);
    let turned = |share: f64| [tip[0] + x - share * y, tip[1] + y + share * x];
    vec![[tip, turned(0.45)], [tip, turned(-0.45)]]
}

/// The upper left corner, in pixels of the picture, for a label of this size (pixels) next to its measurement and within its tile.
pub fn label_corner(drawn: &Drawn, size: [f64; 2]) -> [f64; 2] {
    let [corner, tile] = drawn.tile;
    let wanted = [drawn.at[0], drawn.at[1] - size[1]];
    std::array::from_fn(|a| wanted[a].min(corner[a] + tile[a] - size[a]).max(corner[a]))
}

struct OnTile<'a> {
    tiling: &'a Tiling,
    tile: &'a Tile,
    reach: f64,
}

impl OnTile<'_> {
    fn project(&self, point: DVec3) -> Option<[f64; 2]> {
        let (at, off) = self.tiling.project(self.tile, point);
        (off.abs() <= self.reach).then_some(at)
    }
}

/// The outline, in order, of the section of a box with a plane; empty if they do not meet. `corners`: the lowest and the highest.
fn section([low, high]: [DVec3; 2], plane: &Plane) -> Vec<DVec3> {
    let corner = |n: usize| DVec3::from([0, 1, 2].map(|a| if n >> a & 1 == 1 { high[a] } else { low[a] }));
    let crossing = |(from, to): (DVec3, DVec3)| {
        let [a, b] = [from, to].map(|end| (end - plane.at).dot(plane.normal));
        ((a < 0.0) != (b < 0.0)).then(|| from.lerp(to, a / (a - b)))
    };
    let edges =
        (0..8).flat_map(|n| (0..3).filter(move |a| n >> a & 1 == 0).map(move |a| (corner(n), corner(n | 1 << a))));
    let mut points: Vec<DVec3> = edges.filter_map(crossing).collect();
    let middle = points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    let (x, y) = plane.normal.any_orthonormal_pair();
    let angle = |p: &DVec3| (*p - middle).dot(y).atan2((*p - middle).dot(x));
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    points
}

/// A measurement with a projection; none if a point that it needs is not shown there. `plane`: what is drawn on, None for a rendering.
fn of(
    scene: &Scene,
    index: usize,
    measured: &Measurement,
    tile: [[f64; 2]; 2],
    plane: Option<&Plane>,
    project: impl Fn(DVec3) -> Option<[f64; 2]>,
) -> Option<Drawn> {
    let path = |points: &[[f64; 3]]| -> Option<Vec<[f64; 2]>> {
        points.iter().map(|point| project(scene.place_of(*point))).collect()
    };
    let closed = |mut line: Vec<[f64; 2]>| {
        line.extend(line.first().copied());
        line
    };
    let mut head = None;
    let mut points = Vec::new();
    let lines = match measured.kind {
        MeasureKind::Threshold => {
            let [a, b] = measured.points[..] else { return None };
            let [a, b] = [a, b].map(|point| scene.place_of(point));
            let outline = Some(section([a.min(b), a.max(b)], plane?)).filter(|outline| !outline.is_empty())?;
            vec![closed(outline.into_iter().map(&project).collect::<Option<Vec<_>>>()?)]
        }
        MeasureKind::Volume => {
            let shown: Vec<_> = measured.contours.iter().filter_map(|contour| path(contour)).map(closed).collect();
            Some(shown).filter(|shown| !shown.is_empty())?
        }
        MeasureKind::Trace => vec![closed(path(&measured.points)?)],
        MeasureKind::Ellipse => {
            let places: Vec<DVec3> = measured.points.iter().map(|point| scene.place_of(*point)).collect();
            let ellipse = <[DVec3; 3]>::try_from(&places[..]).ok().and_then(Ellipse::of)?;
            points = path(&measured.points)?;
            vec![closed(ellipse.outline(OUTLINE).map(&project).collect::<Option<_>>()?)]
        }
        MeasureKind::Distance | MeasureKind::Angle | MeasureKind::Surface | MeasureKind::Arrow => {
            let line = path(&measured.points)?;
            points = match (measured.kind, &line[..]) {
                (MeasureKind::Surface, [first, .., last]) => vec![*first, *last],
                _ => line.clone(),
            };
            head = line[..].try_into().ok().filter(|_| measured.kind == MeasureKind::Arrow);
            vec![line]
        }
        MeasureKind::Text => {
            points = path(&measured.points)?;
            Vec::new()
        }
    };
    let points: Vec<_> = points.into_iter().enumerate().collect();
    let shown = lines.iter().flatten().chain(points.iter().map(|(_, at)| at));
    let at = match measured.kind {
        MeasureKind::Text => points.first().map(|(_, at)| *at)?,
        // At the tail, away from what the tip shows.
        MeasureKind::Arrow => points.last().map(|(_, at)| *at)?,
        // Beside the right edge: names and scales of the tile are in its corners.
        MeasureKind::Threshold => {
            let (count, ends) = (shown.clone().count() as f64, [f64::NEG_INFINITY, 0.0]);
            let [right, sum] = shown.fold(ends, |[right, sum], at| [right.max(at[0]), sum + at[1]]);
            [right, sum / count]
        }
        _ => shown.copied().reduce(|a, b| if b[0] > a[0] { b } else { a })?,
    };
    Some(Drawn {
        index,
        tile,
        lines,
        points,
        head,
        label: outcome::label(index + 1, measured),
        is_of_other: false,
        at: [at[0] + 7.0, at[1] - 4.0],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Made;
    use crate::test_block::block;

    fn scene(lines: &[&str]) -> Scene {
        block(&[&["picture.size=[200,100]"], lines].concat(), [41, 31, 21])
    }

    fn caliper(from: [f64; 3], to: [f64; 3]) -> Measurement {
        Measurement { points: vec![from, to], ..Measurement::default() }
    }

    #[test]
    fn a_caliper_is_drawn_on_the_planes_that_it_lies_in_at_its_points() {
        let across = caliper([-5.0, 15.0, 0.0], [5.0, 15.0, 0.0]);
        for (toml, tiles) in [("mode='plane'", 1), ("mode='orthogonal'", 2), ("planes.plane='b'", 0)] {
            let scene = scene(&["mode='plane'", toml]);
            let found = drawn(&scene, None, std::slice::from_ref(&across));
            assert_eq!(found.len(), tiles, "{toml}");
            for Drawn { points, label, .. } in &found {
                let apart = points[1].1[0] - points[0].1[0];
                assert!((apart * scene.tiling().pixel - 10.0).abs() < 1e-9, "{apart} pixels");
                assert_eq!(label, "1: 10.0 mm");
            }
        }
        let stepped = scene(&["mode='plane'", "planes.position=[0,15,3]"]);
        assert!(drawn(&stepped, None, std::slice::from_ref(&across)).is_empty(), "the plane was stepped away");
        let slab = scene(&["mode='plane'", "planes.position=[0,15,3]", "planes.thickness=8"]);
        assert_eq!(drawn(&slab, None, &[across]).len(), 1, "the slab holds it");
    }

    /// Prevents a caliper of one volume that lies over another as if it were that one's.
    #[test]
    fn a_caliper_of_another_volume_says_of_which() {
        let scene = scene(&["mode='plane'"]);
        let made = Some(Made { volume: 3, ..Made::default() });
        let of_volume = Measurement { made, ..caliper([-5.0, 15.0, 0.0], [5.0, 15.0, 0.0]) };
        let anywhere = Measurement { made: None, ..of_volume.clone() };
        let all = [of_volume, anywhere];
        for (shown, is_of_other) in [(Some(3), false), (None, false), (Some(2), true), (Some(4), true)] {
            let found = drawn(&scene, shown, &all);
            assert_eq!([0, 1].map(|n| found[n].is_of_other), [is_of_other, false], "{shown:?}");
            let label = if is_of_other { "1: 10.0 mm (volume 4)" } else { "1: 10.0 mm" };
            assert_eq!([0, 1].map(|n| found[n].label.as_str()), [label, "2: 10.0 mm"], "{shown:?}");
        }
    }

    #[test]
    fn the_lines_of_a_reference_are_where_its_slices_are() {
        for plane in ["a", "b", "c"] {
            let plane = format!("planes.plane='{plane}'");
            let scene =
                scene(&["mode='tomography'", "planes.reference=true", "planes.spacing=3", "planes.azimuth=20", &plane]);
            let tiling = scene.tiling();
            let (reference, lines) = (&tiling.tiles[0], tiling.slice_lines());
            assert_eq!((tiling.tiles.len(), lines.len()), (12, 11));
            assert!(reference.plane.normal.dot(tiling.tiles[1].plane.normal).abs() < 1e-12, "across the slices");
            for (slice, ends) in tiling.tiles[1..].iter().zip(&lines) {
                for end in ends {
                    // Each end is a point of both planes.
                    let off = tiling.project(slice, tiling.point(reference, *end)).1;
                    assert!(off.abs() < 1e-9, "{plane}: {off} mm");
                }
            }
            assert_eq!(spacing_label(&tiling), "every 3.0 mm");
        }
        assert!(!scene(&["mode='tomography'"]).has_reference(), "only if asked for");
    }

    /// An arrow points with its head to its first point, its text is at the tail; a text is at its point.
    #[test]
    fn an_arrow_points_to_what_was_clicked_and_texts_stand_where_they_were_put() {
        let scene = scene(&["mode='plane'"]);
        let points = vec![[2.0, 12.0, 0.0], [8.0, 20.0, 0.0]];
        let arrow = Measurement { kind: MeasureKind::Arrow, points, text: "lip".into(), ..Measurement::default() };
        let text = Measurement {
            kind: MeasureKind::Text,
            points: vec![[-5.0, 9.0, 0.0]],
            text: "nose".into(),
            ..Measurement::default()
        };
        let found = drawn(&scene, None, &[arrow.clone(), text]);
        let pixel = |point: [f64; 3]| scene.tiling().project(&scene.tiling().tiles[0], scene.place_of(point)).0;
        let [tip, tail] = [arrow.points[0], arrow.points[1]].map(pixel);
        let (drawn, head) = (&found[0], found[0].head.expect("a head"));
        assert_eq!((head, &drawn.lines[..], drawn.label.as_str()), ([tip, tail], &[vec![tip, tail]][..], "lip"));
        assert!((drawn.at[0] - tail[0]).hypot(drawn.at[1] - tail[1]) < 10.0, "at the tail");
        for [from, to] in arrow_head(head, 12.0) {
            assert_eq!(from, tip);
            // The strokes go back along the shaft, to both sides of it.
            let (along, across) = ([tail[0] - tip[0], tail[1] - tip[1]], [to[0] - tip[0], to[1] - tip[1]]);
            let cosine =
                (along[0] * across[0] + along[1] * across[1]) / (along[0].hypot(along[1]) * across[0].hypot(across[1]));
            assert!((cosine - 1.0 / (1.0 + 0.45_f64.powi(2)).sqrt()).abs() < 1e-9, "{cosine}");
        }
        assert_eq!((arrow_head(head, 12.0).len(), arrow_head([tip, tip], 12.0).len()), (2, 0));
        let at = pixel([-5.0, 9.0, 0.0]);
        assert_eq!((found[1].points[0].1, found[1].label.as_str(), found[1].head), (at, "nose", None));
        assert!((found[1].at[0] - at[0]).hypot(found[1].at[1] - at[1]) < 10.0);
    }

    #[test]
    fn what_is_on_the_surface_is_drawn_on_the_rendering_alone() {
        let on = Measurement { on_surface: true, ..caliper([0.0, 10.0, 0.0], [4.0, 10.0, 0.0]) };
        let four = scene(&["layout='four'"]);
        let found = drawn(&four, None, &[on, caliper([0.0, 15.0, 0.0], [4.0, 15.0, 0.0])]);
        let on_rendering: Vec<usize> = found.iter().filter(|d| d.tile[0] == [100.0, 50.0]).map(|d| d.index).collect();
        assert_eq!(on_rendering, [0]);
        assert!(found.iter().filter(|d| d.tile[0] != [100.0, 50.0]).all(|d| d.index == 1) && found.len() > 1);
    }

    /// A box is a rectangle of its size on a plane through it, and nothing on another one.
    #[test]
    fn a_box_is_drawn_where_a_plane_goes_through_it() {
        let found = Measurement {
            kind: MeasureKind::Threshold,
            points: vec![[-3.0, 4.0, -2.0], [5.0, 9.0, 6.0]],
            counted: Some(1000.0),
            ..Measurement::default()
        };
        for (elevation, is_there) in [(1.0, true), (5.9, true), (6.1, false), (-2.1, false)] {
            let position = format!("planes.position=[0,5,{elevation}]");
            let scene = scene(&["mode=plane", "planes.plane=a", &position]);
            let drawn = drawn(&scene, None, std::slice::from_ref(&found));
            assert_eq!(drawn.len(), usize::from(is_there), "{elevation}");
            let Some(drawn) = drawn.first() else { continue };
            let tiling = scene.tiling();
            let line = &drawn.lines[0];
            let edges = line.windows(2).map(|ends| (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]));
            let mut edges: Vec<f64> = edges.map(|pixels| pixels * tiling.tiles[0].pixel).collect();
            edges.sort_by(f64::total_cmp);
            let expected = [5.0, 5.0, 8.0, 8.0];
            assert!(edges.len() == 4 && edges.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{edges:?}");
        }
    }
}
