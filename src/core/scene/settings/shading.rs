//! Settings of stages 3 and 4: filters of the distance map, light, shadow, occlusion and skin; filters, tone and colour of the picture.

use super::preprocess::{EnhancedSigma, PeronaMalik, Sigma};
use crate::scene::number::Allowed::{OffOr, OffOrOdd, Range};
use crate::scene::number::Group::{Image, Light as Group, Surface};
use crate::scene::number::{Allowed, LENGTH, LENGTH_OR_0, Number, PLACE, SHARE, number};
use crate::scene::{MAX_WINDOW, Settings};
use crate::tree::{Defaults, FromNode, ToNode};
use glam::DVec3;

/// Stage 3: edge-preserving filters of the distance map, which run in the order in which they are listed.
#[derive(Clone, Debug, Default, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Distance {
    /// Window size of the median filter, pixels of the distance map; odd, 0 for none.
    pub median: u32,
    /// Window size of the median filter in mm at the middle of the region, in place of `median`: the nearest odd number of pixels. It is limited to 63
    /// pixels; below two pixels there is no filter.
    pub median_mm: Option<f64>,
    /// Bilateral filter.
    pub bilateral: Option<Bilateral>,
    /// Sigma filter; sigma in mm.
    pub sigma: Option<Sigma>,
    /// Enhanced sigma filter; sigma and edge in mm. A miss (a ray that meets no surface) stays a miss and does not count.
    pub enhanced_sigma: Option<EnhancedSigma>,
    /// Perona-Malik diffusion; edge in mm, explicit scheme. Nothing flows to or from a miss (a ray that meets no surface).
    pub perona_malik: Option<PeronaMalik>,
}

impl Distance {
    /// The filters for half as many rays along each axis: windows cover about the same part of the picture, and have at least 3 rays along each axis.
    /// Diffusion spreads as far.
    pub fn halved(&self) -> Distance {
        let window = |edge: u32| 2 * (edge / 4).max(1) + 1;
        let half = |mm: Option<f64>| mm.map(|mm| mm / 2.0);
        Distance {
            median: if self.median > 0 { window(self.median) } else { 0 },
            median_mm: half(self.median_mm),
            bilateral: self.bilateral.map(|b| Bilateral { pixels: b.pixels / 2.0, mm: half(b.mm), ..b }),
            sigma: self.sigma.map(|s| Sigma { window: window(s.window), window_mm: half(s.window_mm), ..s }),
            enhanced_sigma: self.enhanced_sigma.map(|e| {
                let (start, largest) = (window(e.window), window(e.largest));
                let (window_mm, largest_mm) = (half(e.window_mm), half(e.largest_mm));
                EnhancedSigma { window: start, largest, window_mm, largest_mm, ..e }
            }),
            perona_malik: self.perona_malik.map(|p| {
                // Time goes as the square of a length.
                let repeat = p.repeat.div_ceil(4);
                let step = p.step * f64::from(p.repeat) / (4.0 * f64::from(repeat));
                // A width in mm sets the number of steps itself.
                let step = if p.width_mm.is_some() { p.step } else { step };
                PeronaMalik { step, repeat, width_mm: half(p.width_mm), ..p }
            }),
        }
    }
}

/// Bilateral filter: Gaussian in space and in distance.
#[derive(Clone, Copy, Debug, PartialEq, FromNode, ToNode)]
#[tree(deny_unknown_fields)]
pub struct Bilateral {
    /// Standard deviation in the picture, pixels of the distance map.
    #[tree(default)]
    pub pixels: f64,
    /// Standard deviation in the picture in mm at the middle of the region, in place of `pixels`. It is limited to 10 pixels; below a tenth of a pixel
    /// there is no filter.
    #[tree(default)]
    pub mm: Option<f64>,
    /// Standard deviation of the distance, mm.
    pub distance: f64,
    /// How many times the filter is applied.
    #[tree(default = "once")]
    pub repeat: u32,
}

impl Bilateral {
    /// Smallest standard deviation in the picture, pixels.
    pub(crate) const MIN_PIXELS: f64 = 0.1;
    pub const MAX_PIXELS: f64 = 10.0;
}

fn once() -> u32 {
    1
}

/// Stage 3: the light. The direction uses the axes that `follows` names, the position those of the camera: right, up, towards the viewer.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Light {
    /// Direction from the surface to a distant light, in the axes that `follows` names. Its length does not matter, but must not be 0.
    #[value(DVec3::new(-0.5, 0.6, 0.6))]
    pub direction: DVec3,
    /// What the direction is relative to.
    pub follows: Follows,
    /// Position of a near (point) light, mm from the camera's target along right, up and towards the viewer. Absent: the light is distant.
    pub position: Option<DVec3>,
    /// Ambient coefficient of Blinn-Phong shading; it may exceed 1.
    #[value(0.18)]
    pub ambient: f64,
    /// Diffuse coefficient of Blinn-Phong shading; it may exceed 1.
    #[value(0.75)]
    pub diffuse: f64,
    /// Specular coefficient of Blinn-Phong shading; it may exceed 1.
    #[value(0.18)]
    pub specular: f64,
    /// Specular exponent, 0..=1e6.
    #[value(24.0)]
    pub shininess: f64,
    /// Colour of the light, 0..=10.
    #[value([1.0, 1.0, 1.0])]
    pub colour: [f64; 3],
    /// Colour of the surface, 0..=10.
    #[value([0.93, 0.72, 0.56])]
    pub surface_colour: [f64; 3],
    /// How much a weak echo at the surface darkens its colour: 0 not at all, 1 in proportion to the echo.
    pub texture: f64,
    /// Neighbours whose distances differ by more than this belong to two surfaces, mm. Normals do not cross the gap.
    #[value(2.0)]
    pub cliff: f64,
    /// Shadow.
    pub shadow: Option<Shadow>,
    /// Ambient occlusion.
    pub occlusion: Option<Occlusion>,
    /// Skin shading.
    pub skin: Option<Skin>,
    /// Light that goes through the composited volume and is scattered in it: for volume rendering, the layer of mode mixed, and surfaces that
    /// the volume colours. It takes a distant light.
    pub volume: Option<LightVolume>,
}

/// What the direction to a light is relative to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Follows {
    /// The camera: the light stays where it is in the picture.
    #[default]
    Camera,
    /// The region: the light stays where it is in the body, in the axes of a camera that is not turned. A view that turns then needs no new
    /// light volume.
    Region,
}

/// Light volume: light is propagated through a lattice of cells over the region, absorbed by what the transfer function makes opaque, red least,
/// spread as it goes, and scattered on in tissue. The coefficients of the light are those of `light`. Surfaces have no film curve: for them ambient
/// and diffuse are divided by their sum where that exceeds 1. Colours are linear light: Narkowicz's fit (2015) of the ACES film curve compresses
/// them, so that no highlight is cut off, and a gamma of 2.2 encodes them for a screen.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct LightVolume {
    /// Edge of a cell, mm. Absent: half the standard deviation of the Gaussian that the volume is smoothed with (`slices.smooth`), and a slice pixel
    /// at least. Where there would be more cells than `cells` they are larger; `--explain` says what they are and why.
    pub cell: Option<f64>,
    /// Most cells, but for rounding up to an even number along each edge; also at most 1024 along an edge. A cell takes about 45 bytes of the
    /// device's memory.
    #[value(4_000_000)]
    pub cells: u32,
    /// Samples along each edge of a cell.
    #[value(1)]
    pub taps: u32,
    /// Depth of light: the path through the most opaque tissue, mm, after which 1/e of green light is left.
    #[value(1.4)]
    pub depth: f64,
    /// Warmth, 0..=2: how much deeper red light goes than green, and green than blue; 0 is grey.
    #[value(1.0)]
    pub warmth: f64,
    /// Standard deviation over which light has spread after 1 mm, mm; it grows with the square root of the path. The lattice spreads light
    /// over at least half a cell a layer.
    #[value(0.35)]
    pub widening: f64,
    /// Standard deviation over which tissue scatters green light, mm; red further, blue less.
    #[value(0.9)]
    pub scatter: f64,
    /// Reach of ambient light, mm: matter farther away than this does not occlude it.
    #[value(20.0)]
    pub reach: f64,
    /// Slope of the echo (0..1) per mm from which on the orientation of a surface is certain. The default is half the slope of skin in fluid after a
    /// Gaussian of 1.5 mm. Where the echo is flatter, light depends less on the orientation.
    #[value(0.04)]
    pub slope: f64,
    /// How much light depends on the orientation of the tissue's surface: 0 not at all, 1 fully.
    #[value(0.85)]
    pub relief: f64,
    /// How far the light wraps around to the side that faces away from it: 0 not at all, 1 fully.
    #[value(0.35)]
    pub wrap: f64,
    /// Coefficient of the back light, 0..=10.
    #[value(0.12)]
    pub back: f64,
    /// Direction from the tissue to the back light, in the same axes as `light.direction`.
    #[value(DVec3::new(0.7, 0.6, -0.45))]
    pub back_direction: DVec3,
    /// Colour of the back light, 0..=10.
    #[value([0.9, 0.4, 0.22])]
    pub back_colour: [f64; 3],
    /// Exposure: factor of the light before the film curve, 0..=100.
    #[value(1.0)]
    pub exposure: f64,
    /// The backdrop that fills the picture behind the volume, in mode volume without first-hit shading. Absent: black.
    pub ground: Option<Ground>,
}

/// A backdrop that is brightest a little above the middle of the picture and falls off to its edges. Colours are linear light, like those of the
/// transfer function, and may exceed 1.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Ground {
    /// Colour where it is brightest.
    #[value([0.022, 0.013, 0.009])]
    pub middle: [f64; 3],
    /// Colour at the edges.
    #[value([0.004, 0.0025, 0.002])]
    pub edge: [f64; 3],
}

/// Shadow by tracing the distance map towards the light (thesis Fig. 41).
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Shadow {
    /// Share of the light named by `dims` that a full shadow removes.
    #[value(0.6)]
    pub strength: f64,
    /// Width of the shadow's edge per mm of distance to the obstacle, 0..=10; 0 is a hard edge.
    #[value(0.15)]
    pub softness: f64,
    /// Maximum distance of an obstacle from the place that it shades, mm.
    #[value(40.0)]
    pub reach: f64,
    /// Assumed thickness of the visible surface, mm: light that passes farther behind it is not blocked.
    #[value(25.0)]
    pub thickness: f64,
    /// Bias, mm: light is blocked only where it passes more than this behind the visible surface, so that noise of the distance map casts no shadow.
    #[value(0.6)]
    pub bias: f64,
    /// What a shadow dims.
    pub dims: Dims,
}

/// What a shadow dims.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum Dims {
    /// Diffuse and specular light: ambient light still arrives.
    #[default]
    Light,
    /// The pixel, ambient light included (thesis Fig. 41).
    Pixel,
}

/// Ambient occlusion from the distance map around each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Occlusion {
    /// Radius around a place on the surface within which the surface occludes it, mm.
    #[value(6.0)]
    pub radius: f64,
    /// Strength, 0..=4: factor of the share of the hemisphere that is hidden. Ambient light loses the product.
    #[value(1.0)]
    pub strength: f64,
}

/// Skin shading: light wraps around the terminator, red further than blue, and shines through thin tissue.
#[derive(Clone, Copy, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Skin {
    /// How far the light wraps around the terminator: 0 not at all, 1 fully.
    #[value(0.35)]
    pub wrap: f64,
    /// Translucency: factor, 0..1, of the light that passes through thin tissue.
    #[value(0.3)]
    pub translucency: f64,
    /// Depth behind the surface over which echoes are averaged to tell thin tissue, mm.
    #[value(5.0)]
    pub depth: f64,
    /// Colour of the light that passes through tissue, 0..=10.
    #[value([0.9, 0.25, 0.12])]
    pub colour: [f64; 3],
}

/// Stage 4, postprocessing. The filters run in the order in which they are listed, then contrast, brightness, gamma and the colour map.
#[derive(Clone, Debug, PartialEq, Defaults, FromNode, ToNode)]
#[tree(deny_unknown_fields, default)]
pub struct Post {
    /// Sigma filter.
    pub sigma: Option<Sigma>,
    /// Enhanced sigma filter.
    pub enhanced_sigma: Option<EnhancedSigma>,
    /// Perona-Malik diffusion.
    pub perona_malik: Option<PeronaMalik>,
    /// Antialiasing of surfaces, and of cut faces, that have one ray a pixel. A pixel at an outline, or at a fold where distances differ by
    /// `light.cliff`, mixes what is near and what is far by the share of its area that each covers. At folds this begins at half of `light.cliff`.
    /// The edge between them follows from the distances of the pixels around it.
    #[value(true)]
    pub antialias: bool,
    /// Added to the brightness, whose range is 0..1, after the contrast: -1..=1.
    pub brightness: f64,
    /// Contrast factor about middle grey, 0..=10.
    #[value(1.0)]
    pub contrast: f64,
    /// Gamma: the exponent is 1 / gamma, so that values above 1 brighten dark parts.
    #[value(1.0)]
    pub gamma: f64,
    /// Colour map.
    pub colour_map: ColourMap,
    /// Keeps a float picture in addition to the 8-bit one even if no pass needs it. Planes are then cut and tone-mapped by two passes instead of one.
    pub floats: bool,
}

/// Colour map of the picture's brightness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, FromNode, ToNode)]
#[tree(rename_all = "lowercase")]
pub enum ColourMap {
    /// Keeps the colours.
    #[default]
    None,
    /// Grey.
    Grey,
    /// Sepia.
    Sepia,
    /// Skin tones.
    Skin,
    /// Blue to white.
    Ice,
}

/// The nearest odd window size; 0 is off.
fn odd(value: f64) -> u32 {
    if value < 2.0 { 0 } else { 2 * ((value - 1.0) / 2.0).round() as u32 + 1 }
}

fn set_bilateral(s: &mut Settings, pixels: f64) {
    let filter = s.distance.bilateral.unwrap_or(Bilateral { pixels: 0.0, mm: None, distance: 2.0, repeat: 1 });
    s.distance.bilateral = (pixels > 0.0).then_some(Bilateral { pixels, mm: None, ..filter });
}

/// An effect with another strength. It stays set at strength 0, for which no pass runs, so that its other values are kept.
fn with_strength<T: Copy + Default>(effect: Option<T>, value: f64, strength: fn(&mut T) -> &mut f64) -> Option<T> {
    if effect.is_none() && value == 0.0 {
        return None;
    }
    let mut effect = effect.unwrap_or_default();
    *strength(&mut effect) = value;
    Some(effect)
}

const COEFFICIENT: Allowed = Range(0.0, 10.0);

pub(super) const NUMBERS: &[Number] = &[
    number!(post.brightness, "", Range(-1.0, 1.0);
        Image, "Gain", [-1.0, 1.0], 0.02, |_| true, "Makes the picture brighter or darker as a whole."),
    number!(post.contrast, "", Range(0.0, 10.0);
        Image, "Contrast", [0.0, 3.0], 0.05, |_| true, "Spreads bright and dark apart."),
    number!(post.gamma, "", Range(0.1, 10.0);
        Image, "Gamma", [0.3, 3.0], 0.05, |_| true, "Brightens (above 1) or darkens the middle tones; black and white stay."),
    number!(distance.median, "px", OffOrOdd(3.0, MAX_WINDOW as f64);
        Surface, "Surface median", [0.0, 31.0], 2.0, Settings::is_lit, "Removes single outliers from the surface.")
    .set_by(|s, v| (s.distance.median, s.distance.median_mm) = (odd(v), None)),
    number!(distance.median_mm, "mm", LENGTH),
    number!(distance.bilateral => pixels, "px", OffOr(Bilateral::MIN_PIXELS, Bilateral::MAX_PIXELS);
        Surface, "Surface smoothing", [0.0, 10.0], 0.5, Settings::is_lit, "Smooths the surface and keeps its steps.")
    .set_by(set_bilateral)
    .off_below(Bilateral::MIN_PIXELS),
    number!(distance.bilateral => distance, "mm", LENGTH;
        Surface, "Surface edge", [0.1, 20.0], 0.2, |s| s.is_lit() && s.distance.bilateral.is_some(),
        "Steps of the surface beyond this height stay sharp."),
    number!(distance.bilateral => mm, "mm", LENGTH),
    number!(distance.bilateral => repeat, "", Range(1.0, 16.0)),
    number!(light.ambient, "", COEFFICIENT;
        Group, "Ambient", [0.0, 2.0], 0.02, Settings::has_light, "Light from everywhere: brightens shaded places."),
    number!(light.diffuse, "", COEFFICIENT;
        Group, "Diffuse", [0.0, 2.0], 0.02, Settings::has_light, "Strength of the lamp on matt skin."),
    number!(light.specular, "", COEFFICIENT;
        Group, "Specular", [0.0, 2.0], 0.02, Settings::has_light, "Strength of glossy highlights."),
    number!(light.volume => depth, "mm", LENGTH;
        Group, "Light depth", [0.2, 8.0], 0.1, Settings::is_lit_inside, "How deep light enters tissue."),
    number!(light.volume => warmth, "", Range(0.0, 2.0);
        Group, "Light warmth", [0.0, 2.0], 0.05, Settings::is_lit_inside, "How much tissue reddens the light in it."),
    number!(light.volume => exposure, "", Range(0.0, 100.0);
        Group, "Exposure", [0.1, 4.0], 0.05, Settings::is_lit_inside, "Brightness of the light inside tissue."),
    number!(light.shadow => strength, "", SHARE;
        Group, "Shadow", [0.0, 1.0], 0.05, Settings::is_lit, "How dark cast shadows are.")
    .set_by(|s, v| s.light.shadow = with_strength(s.light.shadow, v, |l: &mut Shadow| &mut l.strength)),
    number!(light.occlusion => strength, "", Range(0.0, 4.0);
        Group, "Occlusion", [0.0, 4.0], 0.1, Settings::is_lit, "How dark folds and corners are.")
    .set_by(|s, v| s.light.occlusion = with_strength(s.light.occlusion, v, |l: &mut Occlusion| &mut l.strength)),
    number!(light.skin => translucency, "", SHARE;
        Group, "Translucency", [0.0, 1.0], 0.05, Settings::is_lit, "How much light shines through skin.")
    .set_by(|s, v| s.light.skin = with_strength(s.light.skin, v, |l: &mut Skin| &mut l.translucency)),
    number!(light.position, "mm", PLACE),
    number!(light.shininess, "", Range(0.0, 1e6)),
    number!(light.colour, "", COEFFICIENT),
    number!(light.surface_colour, "", COEFFICIENT),
    number!(light.texture, "", SHARE),
    number!(light.cliff, "mm", LENGTH_OR_0),
    number!(light.shadow => softness, "", Range(0.0, 10.0)),
    number!(light.shadow => reach, "mm", LENGTH),
    number!(light.shadow => thickness, "mm", LENGTH_OR_0),
    number!(light.shadow => bias, "mm", LENGTH_OR_0),
    number!(light.occlusion => radius, "mm", LENGTH),
    number!(light.skin => wrap, "", SHARE),
    number!(light.skin => depth, "mm", LENGTH_OR_0),
    number!(light.skin => colour, "", COEFFICIENT),
    number!(light.volume => cell, "mm", LENGTH),
    number!(light.volume => cells, "", Range(1e3, 1e9)),
    number!(light.volume => taps, "", Range(1.0, 4.0)),
    number!(light.volume => widening, "mm", Range(0.0, 3e4)),
    number!(light.volume => scatter, "mm", LENGTH_OR_0),
    number!(light.volume => reach, "mm", LENGTH),
    number!(light.volume => slope, "1/mm", LENGTH),
    number!(light.volume => relief, "", SHARE),
    number!(light.volume => wrap, "", SHARE),
    number!(light.volume => back, "", COEFFICIENT),
    number!(light.volume => back_colour, "", COEFFICIENT),
    number!(light.volume => ground => middle, "", COEFFICIENT),
    number!(light.volume => ground => edge, "", COEFFICIENT),
];
