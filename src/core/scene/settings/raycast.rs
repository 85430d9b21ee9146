//! Settings of stage 2, ray casting: camera, rays, volume rendering, surface rendering and projections.

use crate::scene::number::Allowed::{Any, OffOr, OneOf, Range};
use crate::scene::number::Group::{Quality, Volume as Group};
use crate::scene::number::{ANGLE, LENGTH, Number, PLACE, SHARE, number, start_depths};
use crate::scene::{Mode, Settings};
use crate::tree::{Defaults, FromNode, ToNode};

/// The camera. With all angles zero it looks from the probe into the body, with lateral to the right. A single frame is seen from the side instead,
/// like a B-mode picture.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Camera {
    /// Angle by which the direction of view turns towards +lateral, deg.
    pub azimuth: f64,
    /// Angle by which the direction of view, turned by `azimuth`, rises towards +elevation, deg.
    pub elevation: f64,
    /// Clockwise rotation of the picture, deg.
    pub roll: f64,
    /// Zoom factor, 0.001..=1000; 1 fits the region into the picture.
    #[value(1.0)]
    pub zoom: f64,
    /// Vertical field of view, deg; 0 is parallel projection.
    pub field_of_view: f64,
    /// The point that the camera looks at: lateral, depth, elevation in mm as in `region`. Absent: the middle of the region.
    pub target: Option<[f64; 3]>,
}

/// The rays of every mode that casts some.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Ray {
    /// Distance between samples, mm. Absent: one slice pixel.
    pub step: Option<f64>,
    /// Samples along the smallest side of a voxel: the step is at most that side divided by this, whatever `step` says. The side
    /// is that of a slice pixel, or the slice pitch of a Cartesian volume if it is smaller. Thesis 3.5.2.1 takes 2. Absent: `step` alone.
    pub samples_per_voxel: Option<u32>,
    /// Early ray termination of VR: a ray ends when its transmittance is at most this. At most this share of the light from behind is lost; 0 never
    /// ends early.
    #[value(1.0 / 512.0)]
    pub early_end: f64,
    /// How a sample is interpolated.
    pub sampling: Sampling,
    /// How a sample is interpolated between slices, by rays and planes.
    pub elevation: Elevation,
    /// Growth of the step with the range, as the samples of a convex sweep spread apart: 0 keeps the step constant, 1 makes it
    /// proportional to the distance from the array's apex, up to 8 times. Curved arrays only.
    pub spread: f64,
    /// The 3D filter of the thesis (4.4.2): a Gaussian of 3 or 5 samples along each axis, applied at every sample while the ray is
    /// cast; 0 for none.
    pub sliding: u32,
    /// How the slice index at a position of the sweep is computed.
    pub slice_index: SliceIndex,
    /// Entries of the look-up table of the slice index, where no polynomial replaces it, and of the table of the lines. Linear interpolation between
    /// entries h apart is off by at most h^2/8 times the second derivative of the index: with 1025 entries by less than 1e-5 slices for a sweep of
    /// 142 frames over 85 deg.
    #[value(1025)]
    pub entries: u32,
    /// Rays per pixel along each axis: the picture is rendered larger and averaged.
    #[value(1)]
    pub rays: u32,
    /// Adaptive supersampling: all of `rays` only in pixels at edges, where the colour bends by more than two levels of 8 bits; one in each of the
    /// others. It may miss detail that is narrower than a pixel. Only in mode volume, and not with first-hit shading, cut faces or `still`: other
    /// pictures have all rays.
    pub adaptive: bool,
    /// Largest error of a pixel that its rays and their steps may leave, 0.01..=64 levels of 8 bits of the finished picture; 0 takes the same steps
    /// in all pixels. A ray through every other pixel of every other row begins with `step`, at most a slice pixel. It takes shorter steps, down to a
    /// 32nd of that, where its light differs by more than the tolerance from that of steps of twice the length. The pixels between are means of these
    /// rays where the picture bends little from ray to ray, and have rays of their own elsewhere. Light is integrated between samples whatever
    /// `volume.compositing` says. The error is an estimate; only of pixels whose rays meet nothing but empty bricks it is known to be 0. Only in mode
    /// volume, and not with first-hit shading, `still`, `ray.sliding` or `ray.adaptive`.
    pub tolerance: f64,
    /// Brick size of empty-space skipping, texels; 0 takes every sample. Rays skip bricks that cannot change the picture, so
    /// that it stays the same bit for bit. Absent: 8; a CPU skips only where this saves more time in one picture of a volume than computing
    /// the ranges of the bricks takes, or with `slices.still`.
    pub brick: Option<u32>,
    /// Pixels from ray to ray along each axis, for a view that moves: 2 casts one ray for four pixels. The pixels between are interpolated, but not across
    /// the edges of surfaces. Windows of filters of the distance map have fewer rays, so that they cover about the same part of the picture. Above 1
    /// `rays` must be 1.
    #[value(1)]
    pub subsampling: u32,
}

/// How a sample is interpolated between texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Sampling {
    /// The fastest for the device. A GPU filters in hardware. A CPU loads texels faster than it emulates a sampler; it uses quads if a picture takes
    /// at least six samples per texel, or with `slices.still`, and if the volume has at most 2^27 texels.
    #[default]
    Auto,
    /// The trilinear filter of the device. Its weights may have only 8 bits.
    Hardware,
    /// Eight texels, interpolated in f32 by the shader.
    Exact,
    /// Like `exact`, from packed neighbours: of 8-bit samples one texel with four in each of two slices, of 16-bit samples two texels with four each.
    /// Needs 8 bytes for each texel of the volume in addition, and one more pass over every new slice.
    #[tree(rename = "quads")]
    PackedNeighbours,
}

impl Sampling {
    /// Description of the sampling for `--explain` and profiles.
    pub fn words(self) -> &'static str {
        match self {
            Sampling::Auto => "the fastest for the device",
            Sampling::Hardware => "by the device's trilinear filter",
            Sampling::Exact => "eight texels each, interpolated in f32",
            Sampling::PackedNeighbours => "packed neighbours, interpolated in f32",
        }
    }
}

/// How the slice index at a position of the sweep is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum SliceIndex {
    /// By a polynomial with an error of at most 1e-6 slices; by the table for a fan so wide that the polynomial would need more than 10 terms.
    #[default]
    Auto,
    /// By a look-up table of `entries` entries.
    Table,
}

/// How a sample is interpolated between slices. Within a slice it is bilinear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Elevation {
    /// Linear between two slices: slopes change at every slice.
    #[default]
    Linear,
    /// The uniform cubic B-spline of four slices, without a prefilter: slopes change gradually. It smooths with a variance of 1/3
    /// slice^2, where linear interpolation has 1/6 on average; `slices.smooth.elevation` is lowered by the difference, so that the total
    /// variance stays. Takes twice the loads, or four fetches of the device's filter instead of one.
    Bspline,
    /// Like `bspline`, of slices that were sharpened across elevation by (-1, 8, -1)/6, so that it nearly meets their values. The kernel
    /// needs the next slice, so that the last slice of a live sweep is shown one frame late. Not with smoothing across slices.
    BsplineSharp,
}

/// Volume rendering.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Volume {
    /// Grey window: samples in this interval are stretched to 0..1 before the transfer function is applied.
    #[value([0.0, 1.0])]
    pub window: [f64; 2],
    /// Start depth, mm below the probe's face (Cartesian: along the depth axis): rays ignore everything nearer to the probe. Absent: the region's
    /// near face.
    pub start_depth: Option<f64>,
    /// Transfer function.
    #[value(Transfer::Named(TransferName::Grey))]
    pub transfer: Transfer,
    /// Colours of this function in place of those of `transfer` (thesis Figs. 34 and 35: curves of colour and opacity are chosen apart).
    pub colour: Option<TransferName>,
    /// Opacities of this function in place of those of `transfer`.
    pub opacity: Option<TransferName>,
    /// Extinction where the transfer function's opacity is 1, 1/mm; elsewhere it is in proportion to the opacity. Absent: an opacity is that of
    /// matter as thick as one voxel (one slice pixel).
    pub extinction: Option<f64>,
    /// Entries of the transfer function's table, 16..=4096 (at most 1024 with compositing pre-integrated or exponential); absorption is linear
    /// between two. Absent: 256, or as many as it takes to meet points of the transfer function that are closer than an entry.
    pub entries: Option<u32>,
    /// Samples that are below this after the window are transparent.
    pub threshold: f64,
    /// Compositing rule.
    pub compositing: Compositing,
    /// Shading.
    pub shading: Shading,
    /// Depth-coded shading: factor of the colours at the nearest point of the box, 0..=10.
    #[value([1.05, 1.0, 0.9])]
    pub near_tint: [f64; 3],
    /// Depth-coded shading: factor of the colours at the farthest point of the box, 0..=10.
    #[value([0.3, 0.42, 0.75])]
    pub far_tint: [f64; 3],
    /// First-hit shading: the accumulated opacity that counts as the hit, 0.001..=1.
    #[value(0.3)]
    pub hit: f64,
    /// Mode mixed: opacity factor of the volume layer over the surface.
    #[value(1.0)]
    pub veil: f64,
}

/// Compositing rule: the opacity a of a step of length h, with y = kappa h and kappa the absorption of the transfer function.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Compositing {
    /// a = min(y, 1): accurate for thin steps only.
    Riemann,
    /// a = 1 - exp(-y): exact for any step in a homogeneous medium.
    #[default]
    Corrected,
    /// Like `corrected`, with the mean absorption between the values at both ends of the step and the mean colour weighted by it. No
    /// narrow feature of the transfer function is missed (Engel, Kraus, Ertl 2001).
    PreIntegrated,
    /// Premultiplied colour and opacity of a step along which the value changes linearly, each place dimmed by the matter in front of it
    /// in the same step. Not with `light.volume` or `region.fade`, nor with `ray.spread`, whose steps have different lengths.
    Exponential,
}

/// Shading of volume rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Shading {
    /// Colours of the transfer function alone.
    #[default]
    None,
    /// Colours are multiplied by a tint that goes from `near_tint` at the nearest point of the box to `far_tint` at the farthest.
    DepthCoded,
    /// The point where a ray's opacity reaches `hit` is lit like a surface, by stage 3.
    FirstHit,
}

/// A named transfer function, or its points.
#[derive(Clone, Debug, PartialEq, FromNode, ToNode)]
#[tree(
    untagged,
    expecting = "must be grey, sepia, skin, bone, cool, warm, a .toml file of points, or a list of points { at, colour, opacity }"
)]
pub enum Transfer {
    Named(TransferName),
    Points(Vec<TransferPoint>),
}

/// The named transfer functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum TransferName {
    /// Grey ramp.
    Grey,
    /// Sepia ramp.
    Sepia,
    /// Skin tones.
    Skin,
    /// Bone: brown to white, bright samples almost opaque.
    Bone,
    /// Blue to white.
    Cool,
    /// Red to yellow.
    Warm,
}

/// A point of a transfer function. Colour and opacity are linear between points.
#[derive(Clone, Copy, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct TransferPoint {
    /// Sample value after the grey window, 0..1.
    pub at: f64,
    /// Colour, red, green and blue in 0..1.
    pub colour: [f64; 3],
    /// Opacity of matter as thick as one voxel (one slice pixel), 0..1; with `volume.extinction` the share of that extinction instead.
    pub opacity: f64,
}

/// Surface rendering: the surface detector (thesis, equation 4-3).
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Surface {
    /// Grey window: samples in this interval are stretched to 0..1 before the surface is detected.
    #[value([0.0, 1.0])]
    pub window: [f64; 2],
    /// Start depth, mm below the probe's face: rays ignore everything nearer to the probe. Absent: the region's near face.
    pub start_depth: Option<f64>,
    /// Detection rule.
    pub detector: Detector,
    /// Detectors `adaptive` and `lasting`: the difference at an edge must exceed this many standard deviations of the noise in front of the edge. A
    /// weaker edge counts only if the ray has no other.
    #[value(2.5)]
    pub noise: f64,
    /// Length of an edge, mm. The detector's difference at a place is the mean echo over this length behind the place minus the mean echo over this
    /// length in front of it, at any step of the rays. The detector takes at least 4 and at most 256 samples of this length. `samples`: 4 steps of
    /// the rays, as in the thesis, so that the step decides which edges are found. Absent: 4 slice pixels.
    pub edge: Option<Edge>,
    /// Detection threshold: an edge is where the detector's difference (see `edge`), after the window, exceeds it.
    #[value(0.1)]
    pub threshold: f64,
    /// Threshold of the rough detector (`rough`). Absent: `threshold`.
    pub rough_threshold: Option<f64>,
    /// Step of the rough detector in steps of the fine one; 1 disables it. The rough detector searches first. Where it fires, the ray steps back and
    /// the fine detector finds the place. The rough one passes over specks and some noise, and misses walls that are weak or thinner than its ring of
    /// samples. The thesis has one of 2.
    #[value(1)]
    pub rough: u32,
    /// Sign of the edge.
    pub sign: Sign,
    /// Location of the surface within the edge.
    pub place: Place,
    /// Which surface along the ray; 1 is the outermost.
    #[value(1)]
    pub number: u32,
    /// The colour of the lit surface: a constant one, or that of the volume through the transfer function.
    pub colour: SurfaceColour,
    /// Depth, mm, of the volume behind the surface that gives the surface its colour with `colour = "behind"`.
    #[value(3.0)]
    pub colour_depth: f64,
}

/// The colour of a surface that is lit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum SurfaceColour {
    /// `light.surface_colour`.
    #[default]
    Constant,
    /// The colour that volume rendering gives the whole ray. It takes the place of the ambient light's colour; diffuse and specular light
    /// have the colour of the light (thesis 4-5 to 4-7).
    Rendered,
    /// The colour that volume rendering gives the ray over `surface.colour_depth` behind the surface. Ambient and diffuse light take it.
    Behind,
}

/// Length of an edge.
#[derive(Clone, Copy, Debug, PartialEq, FromNode, ToNode)]
#[tree(untagged, expecting = "must be a length in mm, or \"samples\"")]
pub enum Edge {
    /// In mm.
    Length(f64),
    Named(EdgeName),
}

/// The named lengths of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum EdgeName {
    /// Four steps of the rays (thesis).
    Samples,
}

/// Detection rule of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Detector {
    /// The difference exceeds the threshold (thesis).
    #[default]
    Threshold,
    /// The difference also stands out from the noise before it. A ray without such an edge takes its largest edge above the threshold, if
    /// the echo behind it lasts.
    Adaptive,
    /// Like `adaptive`, and ignores edges of which less than half of the height is left one edge's length behind them (specks in fluid, thin
    /// shells before a wall), unless the ray has no other.
    Lasting,
    /// Of the two edges of each ray that are most likely a surface, the one on which neighbouring rays agree, or none: for speckle and noise that no filter
    /// removes. `rough` and `number` must be 1, and `place` peak.
    Consistent,
}

/// Sign of the edge at a surface; the thesis lists it among the settings, too (4.4.2.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Sign {
    /// Bright tissue in dark fluid.
    #[default]
    Bright,
    /// A dark cavity in bright tissue.
    Dark,
    /// Both: the absolute value of the difference counts. With detector `threshold` only.
    Any,
}

/// Location of the surface within the edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "kebab-case")]
pub enum Place {
    /// The maximum of the difference, refined by a parabola: a place that does not depend on the edge's height. The difference is followed until it
    /// falls below 0.7 of its maximum, over at most the edge's length times 0.25 / threshold, which counts as at least 1 and at most 16.
    #[default]
    Peak,
    /// The middle between the two places where the difference is 0.7 of its maximum: more accurate for low edges in samples of 8 bits.
    Middle,
    /// The point where the difference first exceeds the threshold (thesis).
    FirstCrossing,
}

/// Projections: modes mip, minip and mean.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Projection {
    /// Grey window: samples in this interval are stretched to 0..1 before the projection.
    #[value([0.0, 1.0])]
    pub window: [f64; 2],
    /// Start depth, mm below the probe's face: rays ignore everything nearer to the probe. Absent: the region's near face.
    pub start_depth: Option<f64>,
}

pub(super) const NUMBERS: &[Number] = &[
    number!(volume.hit, "", Range(1e-3, 1.0);
        Group, "Opacity of surface", [0.01, 1.0], 0.02, Settings::is_first_hit, "How much the first surface hides what is behind it."),
    number!(volume.veil, "", SHARE;
        Group, "Volume layer", [0.0, 1.0], 0.05, |s| s.mode == Mode::Mixed, "How much of the volume is laid over the surface."),
    number!(volume.threshold, "", SHARE;
        Group, "Volume threshold", [0.0, 1.0], 0.01, Settings::has_own_volume, "The threshold of the volume layer alone."),
    number!(volume.start_depth, "mm", Any;
        Group, "Volume start depth", [0.0, 400.0], 1.0, Settings::has_own_volume, "The start depth of the volume layer alone.")
        .within(start_depths),
    number!(volume.extinction, "1/mm", LENGTH),
    number!(volume.near_tint, "", Range(0.0, 10.0)),
    number!(volume.far_tint, "", Range(0.0, 10.0)),
    number!(ray.step, "mm", LENGTH;
        Quality, "Step", [0.0, 2.0], 0.05, Settings::renders_rays,
        "Distance of samples along a ray: short is exact, long is fast. 0: one slice pixel.")
        .off_below(0.05),
    number!(camera.field_of_view, "°", OffOr(1.0, 150.0);
        Quality, "Field of view", [0.0, 90.0], 5.0, Settings::renders_rays, "0 draws without perspective; more draws near things larger.")
        .off_below(1.0),
    number!(ray.rays, "", Range(1.0, 4.0);
        Quality, "Rays a pixel", [1.0, 4.0], 1.0, |s| s.renders_rays() && s.ray.subsampling == 1, "More rays give smoother edges and take longer.")
        .set_by(|s, v| s.ray.rays = if s.ray.subsampling > 1 { 1 } else { v.round() as u32 }),
    number!(ray.tolerance, "", OffOr(0.01, 64.0);
        Quality, "Largest error", [0.0, 8.0], 0.5, Settings::can_tolerate,
        "Of a pixel by its steps, levels of 255. 0 takes the same steps everywhere.")
        .off_below(0.25),
    number!(ray.samples_per_voxel, "", Range(1.0, 16.0)),
    number!(ray.early_end, "", SHARE),
    number!(ray.spread, "", SHARE),
    number!(ray.sliding, "", OneOf(&[0.0, 3.0, 5.0])),
    number!(ray.entries, "", Range(2.0, 65536.0)),
    number!(ray.brick, "", OffOr(4.0, 64.0)),
    number!(ray.subsampling, "", OneOf(&[1.0, 2.0, 4.0, 8.0])),
    number!(camera.azimuth, "°", ANGLE),
    number!(camera.elevation, "°", ANGLE),
    number!(camera.roll, "°", ANGLE),
    number!(camera.zoom, "", Range(1e-3, 1e3)),
    number!(camera.target, "mm", PLACE),
    number!(surface.noise, "", Range(0.0, 10.0)),
    number!(surface.edge, "mm", LENGTH),
    number!(surface.threshold, "", Range(1e-6, 1.0)),
    number!(surface.rough_threshold, "", Range(1e-6, 1.0)),
    number!(surface.rough, "", Range(1.0, 8.0)),
    number!(surface.number, "", Range(1.0, 8.0)),
    number!(surface.colour_depth, "mm", LENGTH),
];
