//! Settings of stage 3: filters of the distance map, lights, shadow, occlusion, skin. Lengths in mm.

use super::slices::{EnhancedSigma, PeronaMalik, Sigma};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Stage 3: edge-preserving filters of the distance map, in this order.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Distance {
    /// Odd edge of a median's window, pixels; 0 for none.
    pub median: u32,
    pub bilateral: Option<Bilateral>,
    /// A sigma filter whose sigma is in mm.
    pub sigma: Option<Sigma>,
    /// Sigma and edge in mm. A miss stays a miss and counts nowhere.
    pub enhanced_sigma: Option<EnhancedSigma>,
    /// Edge in mm, explicit scheme. Nothing flows to or from a miss.
    pub perona_malik: Option<PeronaMalik>,
}

impl Distance {
    /// The same filters for half as many rays along each edge: what they span of the picture, and how long they diffuse.
    pub fn halved(&self) -> Distance {
        let window = |edge: u32| 2 * (edge / 4).max(1) + 1;
        Distance {
            median: if self.median > 0 { window(self.median) } else { 0 },
            bilateral: self.bilateral.map(|b| Bilateral { pixels: b.pixels / 2.0, ..b }),
            sigma: self.sigma.map(|s| Sigma { window: window(s.window), ..s }),
            enhanced_sigma: self.enhanced_sigma.map(|e| {
                let (start, largest) = (window(e.window), window(e.largest));
                EnhancedSigma { window: start, largest, ..e }
            }),
            perona_malik: self.perona_malik.map(|p| {
                // Time goes as the square of a length.
                let repeat = p.repeat.div_ceil(4);
                PeronaMalik { step: p.step * f64::from(p.repeat) / (4.0 * f64::from(repeat)), repeat, ..p }
            }),
        }
    }
}

/// Gaussian in place and in distance.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Bilateral {
    /// Standard deviation in the picture, pixels.
    pub pixels: f64,
    /// Standard deviation of the distance, mm.
    pub distance: f64,
    /// Times in a row, 1..=16.
    #[serde(default = "once")]
    pub repeat: u32,
}

fn once() -> u32 {
    1
}

/// Stage 3: the light. Directions and places are the camera's: right, up, towards the viewer.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Light {
    /// From the surface to a light that is far away.
    pub direction: DVec3,
    /// A light that is near instead: its place, mm from what the camera looks at.
    pub position: Option<DVec3>,
    pub ambient: f64,
    pub diffuse: f64,
    pub specular: f64,
    pub shininess: f64,
    pub colour: [f64; 3],
    pub surface_colour: [f64; 3],
    /// How much the echo at the surface darkens its colour, 0..1.
    pub texture: f64,
    /// Neighbours further apart than this are two surfaces: no normal is taken across, mm.
    pub cliff: f64,
    pub shadow: Option<Shadow>,
    pub occlusion: Option<Occlusion>,
    pub skin: Option<Skin>,
}

impl Default for Light {
    fn default() -> Self {
        Light {
            direction: DVec3::new(-0.5, 0.6, 0.6),
            position: None,
            ambient: 0.18,
            diffuse: 0.75,
            specular: 0.18,
            shininess: 24.0,
            colour: [1.0, 1.0, 1.0],
            surface_colour: [0.93, 0.72, 0.56],
            texture: 0.0,
            cliff: 2.0,
            shadow: None,
            occlusion: None,
            skin: None,
        }
    }
}

/// Shadow, by tracing the distance map towards the light (thesis Fig. 41).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shadow {
    /// Shadow coefficient: the share of diffuse and specular light that a shadow takes, 0..1.
    pub strength: f64,
    /// Width of the edge a mm of distance to what casts it; 0 is a hard edge.
    pub softness: f64,
    /// How far an obstacle is looked for, mm.
    pub reach: f64,
    /// How far behind the distance map matter is taken to extend, mm.
    pub thickness: f64,
    /// Clearance that is not a shadow yet, mm: what noise of the distance map must not cast.
    pub bias: f64,
}

impl Default for Shadow {
    fn default() -> Self {
        Shadow { strength: 0.6, softness: 0.15, reach: 40.0, thickness: 25.0, bias: 0.6 }
    }
}

/// Ambient light that corners keep out, from the distance map around each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Occlusion {
    /// mm.
    pub radius: f64,
    /// 0..4; 1 is what a hemisphere of sky would lose.
    pub strength: f64,
}

impl Default for Occlusion {
    fn default() -> Self {
        Occlusion { radius: 6.0, strength: 1.0 }
    }
}

/// The look of skin: light that wraps around the terminator, red further than blue, and shines through where little tissue
/// lies behind the surface.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Skin {
    /// How far light wraps around, 0..1.
    pub wrap: f64,
    /// Light that comes through thin tissue, 0..1.
    pub translucency: f64,
    /// How deep behind the surface echoes are averaged, mm.
    pub depth: f64,
    /// Colour of light that went through tissue.
    pub colour: [f64; 3],
}

impl Default for Skin {
    fn default() -> Self {
        Skin { wrap: 0.35, translucency: 0.3, depth: 5.0, colour: [0.9, 0.25, 0.12] }
    }
}
