//! Marks of a picture: for each tile its position, its scale, the letters of the patient's sides at its edges, and the side of the probe's
//! marker. The viewer and written pictures draw the same marks.

use super::areas::Area;
use super::planes::{CURVE_COLOUR, Plane, colour};
use super::region::depth_offset;
use super::{Marks, Mode, PlaneName, ProbeMarker, Scene, Sides};
use crate::tree::All;
use glam::DVec3;

/// Directions whose components differ by less are as far from one edge as from the other.
const SAME: f64 = 1e-6;
/// The lengths that a scale bar can have, mm.
pub const BAR_LENGTHS: [f64; 9] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0];

/// An axis of the volume; `sides` counts on their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, All)]
pub enum VolumeAxis {
    Lateral,
    Depth,
    Elevation,
}

impl Marks {
    /// The sides of the patient at the low and the high end of an axis of the volume.
    pub fn sides(&self, axis: VolumeAxis) -> Sides {
        [self.lateral, self.depth, self.elevation][axis as usize]
    }

    fn sides_mut(&mut self, axis: VolumeAxis) -> &mut Sides {
        match axis {
            VolumeAxis::Lateral => &mut self.lateral,
            VolumeAxis::Depth => &mut self.depth,
            VolumeAxis::Elevation => &mut self.elevation,
        }
    }

    /// True if the sides of the three axes together fit only the mirror image of a patient.
    pub(crate) fn are_mirrored(&self) -> bool {
        self.lateral.direction().dot(self.depth.direction().cross(self.elevation.direction())) < 0.0
    }

    /// These marks with `sides` along an axis. Another axis that had this pair of sides loses it. The sides of a third axis that are not known follow
    /// from the other two. If all three are known and fit only a mirrored patient, a second axis is reversed, as if the probe were turned: elevation,
    /// or lateral if `axis` is elevation.
    pub fn with_sides(mut self, axis: VolumeAxis, sides: Sides) -> Marks {
        for other in [&mut self.lateral, &mut self.depth, &mut self.elevation] {
            if *other == sides || *other == sides.exchanged() {
                *other = Sides::None;
            }
        }
        *self.sides_mut(axis) = sides;
        if sides == Sides::None {
            return self;
        }
        let [lateral, depth, elevation] = [self.lateral, self.depth, self.elevation].map(Sides::direction);
        let third = [
            (VolumeAxis::Lateral, depth.cross(elevation)),
            (VolumeAxis::Depth, elevation.cross(lateral)),
            (VolumeAxis::Elevation, lateral.cross(depth)),
        ];
        for (unknown, direction) in third {
            if self.sides(unknown) == Sides::None && direction != DVec3::ZERO {
                *self.sides_mut(unknown) = Sides::along(direction);
            }
        }
        self.turned_with(axis)
    }

    /// These marks with L and R exchanged on the axis that has them. If the result would be mirrored, a second axis is reversed too, as in
    /// [`Marks::with_sides`].
    pub fn left_and_right_exchanged(mut self) -> Marks {
        let is_across = |axis: &VolumeAxis| matches!(self.sides(*axis), Sides::LeftRight | Sides::RightLeft);
        let Some(axis) = VolumeAxis::ALL.into_iter().find(is_across) else { return self };
        *self.sides_mut(axis) = self.sides(axis).exchanged();
        self.turned_with(axis)
    }

    /// These marks without a mirror: a second axis is the other way, too, if `axis` was changed alone.
    fn turned_with(mut self, axis: VolumeAxis) -> Marks {
        if self.are_mirrored() {
            let second = if axis == VolumeAxis::Elevation { VolumeAxis::Lateral } else { VolumeAxis::Elevation };
            *self.sides_mut(second) = self.sides(second).exchanged();
        }
        self
    }
}

/// One of the four edges of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    Left,
    Right,
    Top,
    Bottom,
}

impl Edge {
    fn opposite(self) -> Edge {
        match self {
            Edge::Left => Edge::Right,
            Edge::Right => Edge::Left,
            Edge::Top => Edge::Bottom,
            Edge::Bottom => Edge::Top,
        }
    }

    /// The middle of this edge: right and down from the middle of the tile, in halves of the tile's width and height.
    pub fn offset(self) -> [f64; 2] {
        match self {
            Edge::Left => [-1.0, 0.0],
            Edge::Right => [1.0, 0.0],
            Edge::Top => [0.0, -1.0],
            Edge::Bottom => [0.0, 1.0],
        }
    }
}

/// What is marked on one tile of the picture, which shows a plane or a rendering.
#[derive(Clone, Debug, PartialEq)]
pub struct TileMarks {
    /// Upper left corner (`corner`) and width and height of the tile, pixels of the picture.
    pub corner: [f64; 2],
    pub size: [f64; 2],
    /// Size of a pixel, mm; for a rendering at the distance of the camera's target.
    pub pixel: f64,
    /// True for a rendering, false for a plane.
    pub is_rendering: bool,
    /// Depth below the probe's face of the tile's upper edge, mm. None if depth runs more than 8 degrees off straight down on the tile.
    pub depth_from: Option<f64>,
    pub letters: Vec<(Edge, &'static str)>,
    /// The edge at which the dot for the probe's marker is drawn. None if the marker is hidden, or if its side points more towards or away from the
    /// viewer than to any edge.
    pub probe: Option<Edge>,
    /// Letter (S for a curved plane) and colour of the plane. None for a rendering, for the slices of tomography, and if only one plane is shown.
    pub plane: Option<(&'static str, [f64; 3])>,
    /// For a curved plane the length of its line, mm; else None.
    pub along: Option<f64>,
    /// For a plane across an axis of the volume, the name of the axis and the position on it, mm (depth from the probe's face); else None.
    pub place: Option<(&'static str, f64)>,
}

impl Scene {
    /// The marks of every tile, in the order of the tiles; the rendering is the last one.
    pub fn marks(&self) -> Vec<TileMarks> {
        self.marks_with(&self.settings.drawn.marks)
    }

    /// The marks of every tile like [`Scene::marks`], but from `marks` instead of the marks in the scene's settings, which a viewer may have changed
    /// since the scene was made.
    pub fn marks_with(&self, marks: &Marks) -> Vec<TileMarks> {
        let mut all = Vec::new();
        if self.cuts_planes() {
            let tiling = self.tiling();
            all.extend(tiling.tiles.iter().enumerate().map(|(n, tile)| {
                // Along a line that bends away, left and right are no sides of the patient.
                let heading = tile.section.as_ref().map_or(tile.plane.right, |section| section.heading());
                let (letters, probe) = sides(marks, heading, tile.plane.down);
                let middle = tile.plane.at.y - depth_offset(&self.geometry);
                let is_upright = tile.plane.down.y > 0.99;
                TileMarks {
                    corner: tile.corner.map(f64::from),
                    size: tile.size.map(f64::from),
                    pixel: tile.pixel,
                    is_rendering: false,
                    depth_from: is_upright.then(|| middle - tile.pixel * f64::from(tile.size[1]) / 2.0),
                    letters,
                    probe,
                    plane: match &tile.section {
                        Some(_) => Some(("S", CURVE_COLOUR)),
                        None if self.has_curve() || self.shows_three() => {
                            self.plane_of_tile(n).map(|name| (name.letter(), colour(name)))
                        }
                        None => None,
                    },
                    along: tile.section.as_ref().map(|section| section.line.length()),
                    place: (tile.section.is_none()).then(|| self.place_of_plane(&tile.plane)).flatten(),
                }
            }));
        }
        if !self.is_flat() {
            all.push(self.marks_of_rendering(marks));
        }
        all
    }

    fn place_of_plane(&self, plane: &Plane) -> Option<(&'static str, f64)> {
        let at = self.point_of(plane.at);
        let axes = [("lateral", plane.normal.x), ("depth", plane.normal.y), ("elevation", plane.normal.z)];
        let across = axes.iter().position(|(_, share)| share.abs() > 1.0 - 1e-6)?;
        Some((axes[across].0, at[across]))
    }

    fn marks_of_rendering(&self, marks: &Marks) -> TileMarks {
        let (rays, Area { corner, size }) = (&self.rays, self.rendering_area());
        let apart = match rays.is_perspective {
            true => rays.direction_dx.length() * (rays.target - rays.origin).dot(rays.forward),
            false => rays.origin_dx.length(),
        };
        let (letters, probe) = sides(marks, rays.right, -rays.up);
        TileMarks {
            corner: corner.map(f64::from),
            size: size.map(f64::from),
            pixel: apart * f64::from(self.ray_size()[0]) / f64::from(size[0].max(1)),
            is_rendering: true,
            depth_from: None,
            letters,
            probe,
            plane: None,
            along: None,
            place: None,
        }
    }
}

/// The edges to which a direction of the volume points, on a tile with these directions in space: one, or two that are as near. None if it points
/// more towards or away from the viewer than to any edge: then it has no side on the picture.
fn edges_of(axis: DVec3, right: DVec3, down: DVec3) -> Vec<Edge> {
    let [across, along] = [axis.dot(right), axis.dot(down)];
    let away = (1.0 - across * across - along * along).max(0.0).sqrt();
    let nearest = across.abs().max(along.abs());
    if nearest + SAME < away {
        return Vec::new();
    }
    let edges = [
        (across.abs(), if across > 0.0 { Edge::Right } else { Edge::Left }),
        (along.abs(), if along > 0.0 { Edge::Bottom } else { Edge::Top }),
    ];
    edges.into_iter().filter(|(share, _)| share + SAME >= nearest).map(|(_, edge)| edge).collect()
}

/// Letters and the marker's edge of a tile with these directions in space.
fn sides(marks: &Marks, right: DVec3, down: DVec3) -> (Vec<(Edge, &'static str)>, Option<Edge>) {
    let mut letters: Vec<(Edge, &'static str)> = Vec::new();
    for (axis, sides) in [(DVec3::X, marks.lateral), (DVec3::Z, marks.elevation), (DVec3::Y, marks.depth)] {
        let Some([low, high]) = sides.letters() else { continue };
        let is_free = |edge: &Edge| letters.iter().all(|(taken, _)| taken != edge && *taken != edge.opposite());
        if let Some(edge) = edges_of(axis, right, down).into_iter().find(is_free) {
            letters.extend([(edge.opposite(), low), (edge, high)]);
        }
    }
    let last = edges_of(DVec3::X, right, down).first().copied();
    let probe = match marks.probe {
        ProbeMarker::First => last.map(Edge::opposite),
        ProbeMarker::Last => last,
        ProbeMarker::Hidden => None,
    };
    (letters, probe)
}

impl PlaneName {
    /// The plane's letter: A, B or C.
    pub fn letter(self) -> &'static str {
        match self {
            PlaneName::A => "A",
            PlaneName::B => "B",
            PlaneName::C => "C",
        }
    }
}

impl TileMarks {
    /// Where the plane's letter is drawn: the upper right corner, or the upper left one if the probe's marker is at the right edge. It is given right
    /// and down from the middle of the tile, in halves of the tile's width and height.
    pub fn plane_corner(&self) -> [f64; 2] {
        match self.probe {
            Some(Edge::Right) => [-1.0, -1.0],
            _ => [1.0, -1.0],
        }
    }

    /// The label of a curved plane, with the length of its line. None for other tiles.
    pub fn along_label(&self) -> Option<String> {
        self.along.map(|mm| format!("along the line: {mm:.1} mm"))
    }

    /// The label of a plane's position, such as "elevation 2.5 mm". None for other tiles.
    pub fn place_label(&self) -> Option<String> {
        // Without the sign of a zero.
        self.place.map(|(axis, mm)| format!("{axis} {:.1} mm", (mm * 10.0).round() / 10.0 + 0.0))
    }

    /// The longest scale bar that covers at most `share` (0..1) of the tile's width: its length in mm and in pixels. None if none fits.
    pub fn bar(&self, share: f64) -> Option<(f64, f64)> {
        let most = self.size[0] * share * self.pixel;
        let mm = BAR_LENGTHS.into_iter().rev().find(|mm| *mm <= most && self.pixel > 0.0 && self.pixel.is_finite())?;
        Some((mm, mm / self.pixel))
    }
}

impl Mode {
    /// The name of the mode that the user reads.
    pub const fn title(self) -> &'static str {
        match self {
            Mode::Volume => "Volume",
            Mode::Surface => "Surface",
            Mode::Mixed => "Mixed",
            Mode::Mip => "MIP",
            Mode::MinIp => "MinIP",
            Mode::Mean => "X-ray",
            Mode::Plane => "Plane",
            Mode::Orthogonal => "3 planes",
            Mode::Tomography => "Slices",
            Mode::Cube => "Cube",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::test_block::block;

    fn scene(lines: &[&str]) -> Scene {
        block(&[&["picture.size=[200,100]"], lines].concat(), [40, 30, 20])
    }

    const SIDES: [&str; 2] = ["marks.lateral='right-left'", "marks.elevation='feet-head'"];

    /// Requirement: only sides that a patient has can be stated; the third axis follows from two.
    #[test]
    fn no_sequence_of_statements_gives_a_mirrored_patient() {
        use VolumeAxis::{Depth, Elevation, Lateral};
        let all = [
            Sides::None,
            Sides::LeftRight,
            Sides::RightLeft,
            Sides::HeadFeet,
            Sides::FeetHead,
            Sides::FrontBack,
            Sides::BackFront,
        ];
        // A probe on the belly, with its first scan line at the patient's right.
        let marks = Marks::default().with_sides(Lateral, Sides::RightLeft);
        assert_eq!([marks.depth, marks.elevation], [Sides::None; 2]);
        let marks = marks.with_sides(Depth, Sides::FrontBack);
        assert_eq!(marks.elevation, Sides::FeetHead);
        let turned = marks.clone().with_sides(Lateral, Sides::LeftRight);
        assert_eq!(
            [turned.lateral, turned.depth, turned.elevation],
            [Sides::LeftRight, Sides::FrontBack, Sides::HeadFeet]
        );
        assert_eq!(marks.clone().left_and_right_exchanged(), turned);
        assert_eq!(marks.with_sides(Elevation, Sides::HeadFeet), turned, "the other way round");
        // All that can be reached.
        let mut reached = vec![Marks::default()];
        let mut n = 0;
        while n < reached.len() {
            let from = reached[n].clone();
            let stated = [Lateral, Depth, Elevation].into_iter().flat_map(|axis| all.map(|sides| (axis, sides)));
            let mut next: Vec<Marks> = stated.map(|(axis, sides)| from.clone().with_sides(axis, sides)).collect();
            next.push(from.left_and_right_exchanged());
            next.retain(|marks| !reached.contains(marks));
            next.dedup();
            reached.extend(next);
            n += 1;
        }
        let whole = |marks: &&Marks| ![marks.lateral, marks.depth, marks.elevation].contains(&Sides::None);
        assert!(reached.iter().all(|marks| !marks.are_mirrored()));
        let mut wholes: Vec<_> = reached.iter().filter(whole).map(|m| format!("{m:?}")).collect();
        wholes.sort();
        wholes.dedup();
        assert_eq!(wholes.len(), 24, "each way to hold a probe");
        for axes in [[1, 3, 5], [2, 3, 5], [1, 4, 5], [1, 3, 6]].map(|axes| axes.map(|n: usize| all[n])) {
            let [lateral, elevation, depth] = axes;
            let marks = Marks { lateral, depth, elevation, ..Marks::default() };
            let volume = lateral.direction().cross(depth.direction()).dot(elevation.direction());
            assert_eq!(marks.are_mirrored(), volume < 0.0, "{marks:?}");
        }
    }

    #[test]
    fn letters_stand_where_the_axes_point() {
        let plane = scene(&[SIDES[0], SIDES[1], "mode='plane'"]).marks();
        assert_eq!(plane[0].letters, [(Edge::Left, "R"), (Edge::Right, "L")], "plane A: lateral to the right");
        assert_eq!((plane[0].probe, plane[0].depth_from.is_some()), (Some(Edge::Left), true));
        let coronal = scene(&[SIDES[0], SIDES[1], "mode='plane'", "planes.plane='c'"]).marks();
        let expected = [(Edge::Left, "R"), (Edge::Right, "L"), (Edge::Bottom, "F"), (Edge::Top, "H")];
        assert_eq!(coronal[0].letters, expected, "plane C: elevation up");
        assert_eq!(coronal[0].depth_from, None);
        let turned = scene(&[SIDES[0], "mode='plane'", "planes.azimuth=180", "marks.probe='last'"]).marks();
        assert_eq!(turned[0].letters, [(Edge::Right, "R"), (Edge::Left, "L")], "seen from behind");
        assert_eq!(turned[0].probe, Some(Edge::Left));
    }

    /// Prevents tiles that lose the marker and the letters at some angle within the picture, and letters at an edge to which nothing points.
    #[test]
    fn a_direction_has_the_edge_it_points_to_most_unless_it_points_at_the_viewer() {
        let [x, y] = [DVec3::X, DVec3::Y];
        let at = |degrees: f64, axis: DVec3| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            edges_of(axis, x * cos + y * sin, y * cos - x * sin)
        };
        for degrees in 0..360 {
            let edge = at(f64::from(degrees), x);
            let expected: &[Edge] = match degrees {
                45 => &[Edge::Right, Edge::Top],
                135 => &[Edge::Left, Edge::Top],
                225 => &[Edge::Left, Edge::Bottom],
                315 => &[Edge::Right, Edge::Bottom],
                46..135 => &[Edge::Top],
                136..225 => &[Edge::Left],
                226..315 => &[Edge::Bottom],
                _ => &[Edge::Right],
            };
            assert_eq!(edge, expected, "{degrees} degrees in the picture");
            assert!(at(f64::from(degrees), DVec3::Z).is_empty(), "it points at the viewer");
        }
        // Turned in the picture and tilted out of it: the share along the edge decides.
        let marks = Marks { lateral: Sides::RightLeft, depth: Sides::FrontBack, ..Marks::default() };
        for roll in [0.0, 30.0, 44.0, 45.0, 46.0, 90.0] {
            let (sin, cos) = f64::to_radians(roll).sin_cos();
            let (letters, probe) = super::sides(&marks, x * cos + y * sin, y * cos - x * sin);
            assert_eq!((letters.len(), probe.is_some()), (4, true), "{roll}: {letters:?}");
        }
        let probe = |lines: &[&str]| scene(lines).marks()[0].probe;
        assert_eq!(probe(&["camera.azimuth=0"]), Some(Edge::Left));
        assert_eq!(probe(&["camera.azimuth=40", "camera.roll=30"]), Some(Edge::Left));
        assert_eq!(probe(&["camera.azimuth=50"]), None, "it points more at the viewer than to an edge");
        assert_eq!(probe(&["camera.azimuth=90", "camera.roll=45"]), None);
    }

    #[test]
    fn every_tile_has_marks_and_none_has_letters_that_nobody_set() {
        let four = scene(&["layout='four'"]).marks();
        assert_eq!(four.len(), 4);
        assert!(four.iter().all(|tile| tile.letters.is_empty()) && four[3].is_rendering);
        let slices = scene(&[SIDES[0], "mode='tomography'"]).marks();
        assert!(slices.len() == 12 && slices.iter().all(|tile| tile.letters.len() == 2 && tile.probe.is_some()));
        let single = scene(&["camera.azimuth=45"]).marks();
        assert_eq!((single.len(), single[0].size), (1, [200.0, 100.0]));
    }

    #[test]
    fn a_scale_bar_has_its_length_in_pixels() {
        let marks = scene(&["mode='plane'"]).marks();
        let (mm, pixels) = marks[0].bar(0.3).expect("a bar");
        assert!((mm - pixels * marks[0].pixel).abs() < 1e-9 && pixels <= 0.3 * marks[0].size[0]);
    }
}
