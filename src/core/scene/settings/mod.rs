//! The settings of a scene: keys, types, defaults and units of the TOML scene file. Lengths are in mm, angles in degrees, samples and
//! opacities in 0..1. Every struct refuses unknown keys, so that a typing error does not silently become a default.

mod body_marks;
mod cine;
mod cuts;
mod labels;
mod marks;
mod measurements;
mod planes;
mod preprocess;
mod raycast;
mod shading;
mod still;
mod text;
mod unveil;

pub use body_marks::*;
pub use cine::*;
pub use cuts::*;
pub use labels::*;
pub use marks::*;
pub use measurements::*;
pub use planes::*;
pub use preprocess::*;
pub use raycast::*;
pub use shading::*;
pub use still::*;
pub use unveil::*;

use super::MAX_PICTURE;
use super::number::Allowed::{Any, Range};
use super::number::{Group, LARGEST, LENGTH_OR_0, Number, PLACE, SHARE, number};
use crate::tree::{Defaults, FromNode, Name, Part, Slot, ToNode};

/// Fewest points of a curved render start (`region.start_curve`).
pub const MIN_START_POINTS: usize = 3;
pub const MAX_START_POINTS: usize = 5;

/// All settings of a scene.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Settings {
    /// What a pixel shows.
    pub mode: Mode,
    /// How the picture is divided.
    pub layout: Layout,
    /// Volume and surface rendering: parts that float and are smaller than this are not drawn, mm^3; 0 draws all. A part consists of texels of the
    /// sector that are dense enough to be drawn and touch one another. With it, a rendering that draws what is dark is refused. Takes a second
    /// volume, the whole sector in stage 1, and time of the CPU for each volume.
    pub floating: f64,
    /// Size of the picture.
    pub picture: Picture,
    /// The values of the samples of a recording.
    pub samples: Samples,
    /// Stage 1: conditioning of polar lines.
    pub conditioning: Conditioning,
    /// Stage 1: filters of slices and storage of the volume.
    pub slices: Slices,
    /// Region of interest.
    pub region: Region,
    /// Clip planes, at most 4. Each removes the side that its normal points to.
    pub clip: Vec<Clip>,
    /// The cut faces of clip planes.
    pub cap: Cap,
    /// Cuts, at most 32: each removes a part of the volume from renderings, by a contour that was drawn on one or by a brush. Planes and the block of
    /// mode cube show everything. The edges of cuts are as fine as the texels of the volume.
    pub cuts: Vec<Cut>,
    /// The automatic render start, at the fluid in front of a face.
    pub unveil: Unveil,
    /// Stage 2: the camera.
    pub camera: Camera,
    /// Stage 2: the rays of every mode that casts some, and how rays and planes sample the volume.
    pub ray: Ray,
    /// Stage 2: volume rendering (modes volume and mixed, layout pair, and surfaces that it gives their colour).
    pub volume: Volume,
    /// Stage 2: surface rendering (modes surface and mixed).
    pub surface: Surface,
    /// Stage 2: projections (modes mip, minip and mean).
    pub projection: Projection,
    /// Stage 2: planes (modes plane, orthogonal and tomography, and layouts four and beside).
    pub planes: Planes,
    /// Stage 2: the solid block (mode cube).
    pub cube: Cube,
    /// Stage 3: filters of the distance map.
    pub distance: Distance,
    /// Stage 3: light, shadow, occlusion and skin.
    pub light: Light,
    /// Stage 2: volume rendering by random paths of light. Absent: by emission and absorption.
    pub still: Option<Still>,
    /// Stage 4: filters, tone and colour of the picture.
    pub post: Post,
    /// Stage 4: the labels of a segmentation, over the picture.
    pub labels: Labels,
    /// What no pass reads.
    #[tree(flatten)]
    pub drawn: Drawings,
}

/// The settings that no pass reads: what is drawn over a picture, and the cine loop. Their keys are keys of [`Settings`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawings {
    /// Marks beside the picture.
    pub marks: Marks,
    /// Measurements and annotations, at most 64. The viewer makes them; `render` draws them.
    pub measure: Vec<Measurement>,
    /// Body marks, at most 4: a part of the body with the place of the probe. The viewer and `render` draw them.
    pub body_marks: Vec<BodyMark>,
    /// The cine loop.
    pub cine: Cine,
}

impl Part for Drawings {
    fn slots(&mut self) -> Vec<(&'static str, &mut dyn Slot)> {
        let Drawings { marks, measure, body_marks, cine } = self;
        vec![("marks", marks), ("measure", measure), ("body_marks", body_marks), ("cine", cine)]
    }

    fn entries(&self) -> Vec<(&'static str, Option<&dyn ToNode>)> {
        let Drawings { marks, measure, body_marks, cine } = self;
        vec![("marks", Some(marks)), ("measure", Some(measure)), ("body_marks", Some(body_marks)), ("cine", Some(cine))]
    }
}

impl Settings {
    /// The settings while the view moves: `ray.rays` is 1 and `ray.subsampling` at least 2, which is one ray for four pixels. Stage 1 stays the same.
    pub fn moving(&self) -> Settings {
        let subsampling = self.ray.subsampling.max(2);
        Settings { ray: Ray { subsampling, rays: 1, ..self.ray.clone() }, ..self.clone() }
    }

    /// These settings with those of `other` that no pass reads: measurements, annotations, body marks and marks, which are drawn over the
    /// picture, and the settings of the cine loop.
    pub fn with_drawings_of(self, other: &Settings) -> Settings {
        Settings { drawn: other.drawn.clone(), ..self }
    }

    /// These settings without measurements, annotations and body marks, with the default [`Marks`], and with the cine loop of a whole recording.
    pub fn without_drawings(self) -> Settings {
        self.with_drawings_of(&Settings::default())
    }

    /// Changes the mode. The layout becomes single if it does not fit: modes of planes take no other, and layout pair needs mode surface.
    pub fn set_mode(&mut self, mode: Mode) {
        self.mode = mode;
        if mode.is_flat() || (self.layout == Layout::Pair && mode != Mode::Surface) {
            self.layout = Layout::Single;
        }
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, Name, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Mode {
    /// VR: volume rendering, emission and absorption through a transfer function.
    #[tree(alias = "vr")]
    Volume,
    /// SR: surface rendering, the first surface on each ray, lit.
    #[default]
    #[tree(alias = "sr")]
    Surface,
    /// VR over SR: the volume in front of the surface is composited over it.
    Mixed,
    /// Maximum intensity projection: the largest sample on the ray.
    Mip,
    /// Minimum intensity projection: the smallest sample on the ray, within the insonified region.
    #[tree(alias = "minip")]
    MinIp,
    /// X-ray: the mean of the samples on the ray, within the insonified region.
    #[tree(alias = "xray")]
    Mean,
    /// MPR: one free plane through the volume.
    #[tree(alias = "mpr")]
    Plane,
    /// MPR: three orthogonal planes with cross-lines.
    Orthogonal,
    /// Tomographic view: parallel planes side by side.
    Tomography,
    /// The volume as a solid block seen from outside. Each face can be moved inwards and tilted.
    Cube,
}

impl Mode {
    /// All modes, in the order of the viewer's keys for them (1 to 9, then 0).
    pub const ALL: [Mode; 10] = [
        Mode::Surface,
        Mode::Volume,
        Mode::Mixed,
        Mode::Mip,
        Mode::MinIp,
        Mode::Mean,
        Mode::Plane,
        Mode::Orthogonal,
        Mode::Tomography,
        Mode::Cube,
    ];

    /// True for modes that cut planes and cast no rays.
    pub fn is_flat(self) -> bool {
        matches!(self, Mode::Plane | Mode::Orthogonal | Mode::Tomography)
    }
}

/// How the picture is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Layout {
    /// One picture: the rendering or the planes of the mode.
    #[default]
    Single,
    /// 4-up: the three orthogonal planes and the rendering of the mode.
    #[tree(alias = "4up", alias = "4-up")]
    Four,
    /// The rendering of the mode, and the three orthogonal planes in a column on its right; in a picture that is higher than wide, in a row below it.
    Beside,
    /// Volume rendering on the left and surface rendering on the right, along the same rays. Mode surface only.
    Pair,
}

/// The picture.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Picture {
    /// Width and height in pixels.
    #[value([512, 512])]
    pub size: [u32; 2],
}

/// The values of the samples. Applies to recordings that are opened to be rendered; a stream has the range that its source states.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Samples {
    /// The values of the file that become 0 and 1; samples beyond are clamped. Absent: those that the probe file states, otherwise 0 and 255 for 8
    /// bits, otherwise the smallest and largest sample, without far outliers.
    pub range: Option<[f64; 2]>,
}

/// Region of interest: the box that is rendered, mm. Lateral counts from the middle, depth from the probe's face, elevation from the
/// middle frame; a Cartesian volume uses its own axes. Where bounds are absent, the volume is whole along their axis.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Region {
    /// Lower and upper lateral bound, mm.
    pub lateral: Option<[f64; 2]>,
    /// Lower and upper depth bound, mm.
    pub depth: Option<[f64; 2]>,
    /// Lower and upper elevation bound, mm.
    pub elevation: Option<[f64; 2]>,
    /// Curved render start: 3 to 5 points [lateral, depth] of a line, mm, lateral ascending, by a hundred-thousandth of the line's width at least.
    /// What is nearer to the probe than the line is not rendered, at any elevation. The line is a monotone cubic: smooth, and between two points
    /// never beyond their depths; left of the first point and right of the last it stays at their depths. Planes and the block of mode cube show
    /// everything; planes beside a rendering have the line in green. With `unveil`, start depths and the region, rendering starts at the deepest of
    /// them. Takes a second volume. Absent: rendering starts at the region's near face.
    pub start_curve: Option<Vec<[f64; 2]>>,
    /// Length, mm, over which what is composited fades towards the faces of the region, except the shallowest. It is also the radius of the region's
    /// edges and corners.
    pub fade: f64,
}

/// A clip plane. It removes the side that its normal points to. Coordinates are lateral, depth (from the probe's face), elevation.
#[derive(Clone, Copy, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Clip {
    /// Any point of the plane, mm.
    pub at: [f64; 3],
    /// Normal of the plane, of any length but 0.
    pub normal: [f64; 3],
}

/// Caps: the cut faces of clip planes in surface and volume rendering. Where a ray enters tissue through a clip plane, the picture shows the echo
/// of the section there, as planes show it (`planes.window`), without light. Fluid stays open, so that one looks into a cavity. What is drawn
/// translucent, such as preset glass, has no cut faces, and neither have renderings of what is dark. Cut faces show the volume that is rendered, with
/// its filters.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Cap {
    /// Show the echoes of cut faces.
    #[value(true)]
    pub enabled: bool,
    /// The echo from which on there is tissue, before any grey window. It is compared with means over a disc of the cut face; the disc's radius is
    /// the length of an edge (`surface.edge`). Absent: of surfaces the echo at `surface.threshold` within `surface.window`, of volume rendering the
    /// least echo from which on all are opaque. A lower level fills darker tissue, too, such as the brain within a skull.
    pub level: Option<f64>,
}

/// The [`Number`]s of the settings. Within each [`Group`], those with a slider are in the order in which the viewer shows the sliders.
pub fn numbers() -> impl Iterator<Item = &'static Number> {
    NUMBERS.iter().copied().flatten()
}

const NUMBERS: &[&[Number]] = &[
    shading::NUMBERS,
    unveil::NUMBERS,
    COMMON,
    planes::NUMBERS,
    raycast::NUMBERS,
    preprocess::NUMBERS,
    preprocess::FILTERS[0],
    preprocess::FILTERS[1],
    preprocess::FILTERS[2],
    preprocess::FILTERS[3],
    preprocess::FILTERS[4],
    cuts::NUMBERS,
    still::NUMBERS,
    labels::NUMBERS,
    measurements::NUMBERS,
    body_marks::NUMBERS,
    cine::NUMBERS,
];

const COMMON: &[Number] = &[
    number!(cap.enabled, "", Any;
        Group::Image, "Clip echoes", [0.0, 1.0], 1.0, Settings::can_cap,
        "Tissue that a clip plane cuts shows its echoes there, as planes do. Off: what is behind it is drawn, lit. Fluid is open either way."),
    number!(cap.level, "", SHARE;
        Group::Image, "Clip threshold", [0.0, 1.0], 0.01, |s| s.can_cap() && s.cap.enabled,
        "Weaker echoes stay open on the clip face: lower it to fill dark tissue, such as the brain. 0: what is rendered as solid is filled."),
    number!(floating, "mm^3", Range(0.0, 1e27)),
    number!(picture.size, "", Range(1.0, MAX_PICTURE as f64)),
    number!(region.fade, "mm", LENGTH_OR_0),
    number!(region.start_curve, "mm", Range(-LARGEST, LARGEST)),
    number!(clip => at, "mm", PLACE),
];
