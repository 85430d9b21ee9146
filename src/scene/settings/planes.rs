//! Settings of the modes that show sections: planes that are cut without casting a ray, and the volume as a solid block.

use serde::{Deserialize, Serialize};

/// Modes plane, orthogonal and tomography, and the planes of a 4-up picture. All planes belong to one frame of three axes,
/// which a place and three angles set: plane A is the B-mode picture (lateral to the right, depth down), B crosses it
/// (elevation to the right, depth down), C is the coronal plane (lateral to the right, elevation up) that no 2D probe shows.
/// Every tile of a picture has the same scale and is centred on the middle of the region, so that scrolling does not shift it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Planes {
    /// Samples are stretched from this interval to 0..1.
    pub window: [f64; 2],
    /// Where the three planes meet: lateral, depth, elevation in mm as in [`super::Region`]. Absent: the middle of the region.
    pub position: Option<[f64; 3]>,
    /// Turns the frame about its depth axis, deg: +90 lays the right of plane A along elevation.
    pub azimuth: f64,
    /// Turns it about the lateral axis that it has then, deg: plane A's lower edge goes towards +elevation.
    pub tilt: f64,
    /// Turns it about the elevation axis that it has then, deg: the picture of plane A turns clockwise.
    pub roll: f64,
    /// Thickness of the slab that makes one picture, mm, half of it on either side of the plane; 0 is a thin plane.
    pub thickness: f64,
    /// What is made of the samples through the slab.
    pub slab: Slab,
    /// 1 fits the region into a tile; larger is closer.
    pub zoom: f64,
    /// The plane of mode plane, and the one that tomography steps.
    pub plane: PlaneName,
    /// Tiles of tomography side by side and below one another, at most 64 in all.
    pub columns: u32,
    pub rows: u32,
    /// Distance between neighbouring tiles' planes, mm. The middle of the tiles is at `position`; A steps towards +elevation,
    /// B towards +lateral, C into the depth. Absent: the region is divided evenly.
    pub spacing: Option<f64>,
    /// Draws where the other planes cut a tile and frames it in its plane's colour: A yellow, B magenta, C cyan. Tomography
    /// has thin grey lines between tiles instead.
    pub lines: bool,
}

impl Default for Planes {
    fn default() -> Self {
        Planes {
            window: [0.0, 1.0],
            position: None,
            azimuth: 0.0,
            tilt: 0.0,
            roll: 0.0,
            thickness: 0.0,
            slab: Slab::Mean,
            zoom: 1.0,
            plane: PlaneName::A,
            columns: 4,
            rows: 3,
            spacing: None,
            lines: true,
        }
    }
}

/// What becomes of the samples through a slab. Only those inside the insonified region count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Slab {
    /// Less speckle: contrast of soft tissue.
    #[default]
    Mean,
    /// Bright structures: bone.
    Max,
    /// Dark structures: vessels, cysts.
    Min,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PlaneName {
    /// The B-mode plane: lateral to the right, depth down.
    #[default]
    A,
    /// Elevation to the right, depth down.
    B,
    /// Coronal: lateral to the right, elevation up.
    C,
}

/// Mode cube: the region as a solid block whose faces show the samples that they cut.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cube {
    /// Samples are stretched from this interval to 0..1.
    pub window: [f64; 2],
    /// How far each face is pushed in, mm; together they must leave something.
    pub inset: Inset,
    /// How each face is turned about its middle.
    pub tilt: Tilt,
    /// How much darker a face is that is seen edge-on, 0..1; 0 shows samples as they are.
    pub shading: f64,
    /// Draws thin lines where two faces meet; the borders of the insonified region are faces too.
    pub edges: bool,
}

impl Default for Cube {
    fn default() -> Self {
        Cube { window: [0.0, 1.0], inset: Inset::default(), tilt: Tilt::default(), shading: 0.3, edges: true }
    }
}

/// A distance for each face of the block, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Inset {
    /// -lateral.
    pub left: f64,
    /// +lateral.
    pub right: f64,
    /// Towards the probe.
    pub near: f64,
    /// Away from it.
    pub far: f64,
    /// -elevation.
    pub bottom: f64,
    /// +elevation.
    pub top: f64,
}

/// Two angles for each face of the block, deg, right-handed about the two axes that lie in the face, the first one first:
/// (depth, elevation) of left and right, (lateral, elevation) of near and far, (lateral, depth) of bottom and top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tilt {
    pub left: [f64; 2],
    pub right: [f64; 2],
    pub near: [f64; 2],
    pub far: [f64; 2],
    pub bottom: [f64; 2],
    pub top: [f64; 2],
}
