//! Settings of the modes that show sections: planes, and the volume as a solid block.

use super::Smooth;
use crate::scene::number::Allowed::Range;
use crate::scene::number::Group::Planes as Group;
use crate::scene::number::{ANGLE, Allowed, LARGEST, LENGTH, LENGTH_OR_0, Number, PLACE, SHARE, number};
use crate::scene::planes::MAX_TILES;
use crate::scene::{Mode, Scene, Settings};
use crate::tree::{Defaults, FromNode, ToNode};

/// Modes plane, orthogonal and tomography, and the planes of layouts four and beside. A position and three angles define one coordinate frame for all
/// planes. A is the B-mode plane (lateral to the right, depth down), B is perpendicular to it (elevation to the right, depth down), C is the coronal
/// plane (lateral to the right, elevation up). All tiles are centred on the middle of the region, so that scrolling does not shift them, and have the
/// same scale unless the line of a curved plane is too long for it.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Planes {
    /// Grey window: samples in this interval are stretched to 0..1.
    #[value([0.0, 1.0])]
    pub window: [f64; 2],
    /// The common point of the three planes: lateral, depth, elevation in mm as in `region`. Absent: the middle of the region.
    pub position: Option<[f64; 3]>,
    /// Rotation about the depth axis, deg: +90 turns the right of plane A towards +elevation.
    pub azimuth: f64,
    /// Rotation about the resulting lateral axis, deg: moves the lower edge of plane A towards +elevation.
    pub tilt: f64,
    /// Rotation about the resulting elevation axis, deg: rotates the picture of plane A clockwise.
    pub roll: f64,
    /// Slab thickness, mm, half on either side of the plane; 0 is a thin plane.
    pub thickness: f64,
    /// How the samples through the slab are combined.
    pub slab: Slab,
    /// Zoom factor, 0.001..=1000; 1 fits the region into a tile.
    #[value(1.0)]
    pub zoom: f64,
    /// The plane that mode plane shows, and that the slices of tomography are parallel to.
    pub plane: PlaneName,
    /// Columns of tomography; at most 64 tiles in all.
    #[value(4)]
    pub columns: u32,
    /// Rows of tomography.
    #[value(3)]
    pub rows: u32,
    /// Distance between the planes of neighbouring tiles, mm. The middle tile is at `position`; of an even number of tiles the middle two are equally
    /// far from it. From tile to tile A moves towards +elevation, B towards +lateral, C along depth. Absent: the planes divide the region evenly.
    pub spacing: Option<f64>,
    /// The first tile of tomography is a reference: a plane across the slices (B if they are of plane A, else A), with a line where each of them is.
    /// The viewer and `render` draw the lines.
    pub reference: bool,
    /// Draws cross-lines where the other planes cut a tile, and a frame in the plane's colour: A yellow, B magenta, C cyan. Tomography has
    /// thin grey lines between tiles.
    #[value(true)]
    pub lines: bool,
    /// Layouts four and beside: Gaussian of a volume of their own that the planes are cut from. It is filtered by nothing else and has all of the
    /// sector: region, clip planes and filters of the rendering do not apply to it. Absent: the planes are cut from what is rendered. It takes a
    /// second volume's memory, and scan conversion and this Gaussian once more for each frame.
    pub smooth: Option<Smooth>,
    /// A curved plane: the section along a line that is drawn on one of the planes, perpendicular to that plane, straightened. Mode orthogonal shows it in
    /// its fourth tile, mode plane below or beside the plane that the line is drawn on. Across it shows the length along the line, down the direction
    /// perpendicular to the plane, both in mm of the same scale: that of the planes, unless the line is too long for its tile. A slab reaches to both sides of
    /// the line. Other modes do not show it.
    pub curve: Option<Curve>,
}

/// The line of a curved plane: `curve = { plane = 'a', points = [[-20, 40], [0, 50], [20, 40]] }`.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Curve {
    /// The plane that the line is drawn on. The line turns with that plane, and stays in the volume when the plane is stepped.
    pub plane: PlaneName,
    /// 2 to 64 points of the plane, mm: lateral and depth on A, elevation and depth on B, lateral and -elevation on C, as in `region`. Where planes
    /// are turned, the points turn about the middle of the insonified region. The line is a smooth cubic through them; two points make a straight
    /// line.
    pub points: Vec<[f64; 2]>,
}

/// Most points of the line of a curved plane.
pub const MAX_CURVE_POINTS: usize = 64;

/// How the samples through a slab are combined. Only samples that are inside the insonified region and are not cut off by region or clip planes
/// count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Slab {
    /// Mean: less speckle, contrast of soft tissue.
    #[default]
    Mean = 0,
    /// Maximum: bright structures such as bone.
    Max = 1,
    /// Minimum: dark structures such as vessels and cysts.
    Min = 2,
}

/// The three orthogonal planes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum PlaneName {
    /// The B-mode plane: lateral to the right, depth down.
    #[default]
    A,
    /// Elevation to the right, depth down.
    B,
    /// Coronal: lateral to the right, elevation up.
    C,
}

/// Mode cube: the region as a solid block. Its faces show the samples that they cut.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Cube {
    /// Grey window: samples in this interval are stretched to 0..1.
    #[value([0.0, 1.0])]
    pub window: [f64; 2],
    /// Distance that each face is moved inwards, mm. Insets that leave nothing of the block are refused.
    pub inset: Inset,
    /// Tilt of each face about its middle.
    pub tilt: Tilt,
    /// Share of its brightness that a face loses where it is seen edge-on; 0 shows samples unchanged.
    #[value(0.3)]
    pub shading: f64,
    /// Draws thin lines where two faces meet. The borders of the insonified region count as faces.
    #[value(true)]
    pub edges: bool,
}

/// Inset of each face of the block, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Inset {
    /// How far the face towards -lateral is moved inwards, mm.
    pub left: f64,
    /// How far the face towards +lateral is moved inwards, mm.
    pub right: f64,
    /// How far the face nearest to the probe is moved inwards, mm.
    pub near: f64,
    /// How far the face farthest from the probe is moved inwards, mm.
    pub far: f64,
    /// How far the face towards -elevation is moved inwards, mm.
    pub bottom: f64,
    /// How far the face towards +elevation is moved inwards, mm.
    pub top: f64,
}

/// Tilt of each face of the block: two angles in deg about the two axes in the face.
#[derive(Clone, Copy, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Tilt {
    /// Tilt of the face towards -lateral: right-handed about depth, then elevation, deg.
    pub left: [f64; 2],
    /// Tilt of the face towards +lateral: right-handed about depth, then elevation, deg.
    pub right: [f64; 2],
    /// Tilt of the face nearest to the probe: right-handed about lateral, then elevation, deg.
    pub near: [f64; 2],
    /// Tilt of the face farthest from the probe: right-handed about lateral, then elevation, deg.
    pub far: [f64; 2],
    /// Tilt of the face towards -elevation: right-handed about lateral, then depth, deg.
    pub bottom: [f64; 2],
    /// Tilt of the face towards +elevation: right-handed about lateral, then depth, deg.
    pub top: [f64; 2],
}

/// An inset of a face that leaves 2 mm to the opposite face, whose inset is `across`.
fn inset_limits(scene: &Scene, axis: usize, across: f64) -> [f64; 2] {
    [0.0, (scene.high - scene.low)[axis] - across - 2.0]
}

/// Makes the [`Number`](crate::scene::Number) of the inset of one face.
macro_rules! inset {
    ($face:ident, $axis:expr, $opposite:ident, $name:expr, $hint:expr) => {
        number!(cube.inset.$face, "mm", LENGTH_OR_0)
            .slider(Group, $name, [0.0, 400.0], 1.0, Settings::is_cube, $hint)
            .within(|scene| inset_limits(scene, $axis, scene.settings.cube.inset.$opposite))
    };
}

/// A face that is tilted to 90 degrees would no longer bound its side.
const TILT: Allowed = Range(-80.0, 80.0);
const TURN: [f64; 2] = [-180.0, 180.0];

pub(super) const NUMBERS: &[Number] = &[
    number!(planes.position, "mm", PLACE),
    number!(planes.zoom, "", Range(1e-3, 1e3);
        Group, "Planes zoom", [0.2, 20.0], 0.1, Settings::shows_planes, "Enlarges the planes."),
    number!(planes.thickness, "mm", LENGTH_OR_0;
        Group, "Slab", [0.0, 40.0], 0.5, Settings::shows_planes,
        "Thickness of the planes: a thick slab shows less speckle and more of what runs along it."),
    number!(planes.spacing, "mm", LENGTH;
        Group, "Spacing", [0.0, 40.0], 0.5, |s| s.mode == Mode::Tomography, "Distance between neighbouring slices. 0: they divide the region evenly.")
        .off_below(0.1),
    number!(planes.azimuth, "°", ANGLE;
        Group, "Planes azimuth", TURN, 5.0, Settings::shows_planes, "Turns the planes about the depth axis."),
    number!(planes.tilt, "°", ANGLE;
        Group, "Planes tilt", TURN, 5.0, Settings::shows_planes, "Tilts the planes about the lateral axis."),
    number!(planes.roll, "°", ANGLE;
        Group, "Planes roll", TURN, 5.0, Settings::shows_planes, "Turns the planes about the elevation axis."),
    number!(planes.columns, "", Range(1.0, MAX_TILES as f64);
        Group, "Columns", [1.0, 8.0], 1.0, |s| s.mode == Mode::Tomography, "Slices beside each other."),
    number!(planes.rows, "", Range(1.0, MAX_TILES as f64);
        Group, "Rows", [1.0, 8.0], 1.0, |s| s.mode == Mode::Tomography, "Slices above each other."),
    number!(planes.curve => points, "mm", Range(-LARGEST, LARGEST)),
    inset!(left, 0, right, "Cut left", "Cuts the block from its left face."),
    inset!(right, 0, left, "Cut right", "Cuts the block from its right face."),
    inset!(near, 1, far, "Cut near", "Cuts the block from the face next to the probe."),
    inset!(far, 1, near, "Cut far", "Cuts the block from its deepest face."),
    inset!(bottom, 2, top, "Cut bottom", "Cuts the block from the first slice on."),
    inset!(top, 2, bottom, "Cut top", "Cuts the block from the last slice on."),
    number!(cube.tilt.left, "°", TILT),
    number!(cube.tilt.right, "°", TILT),
    number!(cube.tilt.near, "°", TILT),
    number!(cube.tilt.far, "°", TILT),
    number!(cube.tilt.bottom, "°", TILT),
    number!(cube.tilt.top, "°", TILT),
    number!(cube.shading, "", SHARE;
        Group, "Face shading", [0.0, 1.0], 0.05, Settings::is_cube, "Darkens faces of the block that are turned away."),
];
