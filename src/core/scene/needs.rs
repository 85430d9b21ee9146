//! What a scene needs: which passes its settings ask for.

use super::{Compositing, Detector, Layout, Mode, Scene, Shading, Skin, SurfaceColour};
use crate::probe::Array;

impl Scene {
    /// True if only pixels at edges have several rays (`ray.adaptive`). It needs a mode in which a pixel follows from the colours along its rays
    /// alone.
    pub fn adapts_rays(&self) -> bool {
        let ray = &self.settings.ray;
        let is_alone = self.settings.mode == Mode::Volume && !self.lights_volume();
        ray.adaptive && ray.rays > 1 && is_alone && self.still().is_none() && !self.has_caps()
    }

    /// The tolerance of `ray.tolerance`, levels of 8 bits, by which the steps of each pixel are chosen. None if it is 0, or if the scene is not
    /// volume rendering, lights first hits, or is a still.
    pub fn tolerance(&self) -> Option<f64> {
        let is_alone = self.settings.mode == Mode::Volume && !self.lights_volume() && self.still().is_none();
        Some(self.settings.ray.tolerance).filter(|levels| *levels > 0.0 && is_alone)
    }

    /// True if pixels at edges of a surface, or of a cut face, mix the near and the far side by the share of the pixel that each covers. With several
    /// rays a pixel it is false: the mean of the rays does this.
    pub fn antialiases(&self) -> bool {
        let ray = &self.settings.ray;
        self.settings.post.antialias
            && (self.has_distance() || self.has_caps())
            && ray.rays == 1
            && ray.subsampling == 1
    }

    /// True if stages 2 and 3 render into a slot other than the picture, which is then assembled from it: several rays make a pixel, one ray makes
    /// several pixels, edges are antialiased, or planes or a second rendering are beside it.
    pub fn assembles(&self) -> bool {
        let ray = &self.settings.ray;
        let is_beside =
            ray.rays > 1 || ray.subsampling > 1 || self.settings.layout != Layout::Single || self.antialiases();
        is_beside && !self.is_flat()
    }

    /// True if assembling the picture also converts it to 8 bits, because no other pass of stage 4 reads it.
    pub(crate) fn tones_assembled(&self) -> bool {
        self.assembles() && self.only_tones()
    }

    /// True if nothing is done to a picture but toning.
    pub(super) fn only_tones(&self) -> bool {
        let post = &self.settings.post;
        let filtered = post.sigma.is_some() || post.enhanced_sigma.is_some() || post.perona_malik.is_some();
        !filtered && !post.floats
    }

    /// True if the scene runs a surface detector.
    pub fn detects_surface(&self) -> bool {
        matches!(self.settings.mode, Mode::Surface | Mode::Mixed)
    }

    /// True if the surface of each ray is chosen among several candidates, by what neighbouring rays found.
    pub(crate) fn chooses_surface(&self) -> bool {
        self.detects_surface() && self.settings.surface.detector == Detector::Consistent
    }

    /// True if stage 3 lights a distance map: of a surface, or of the first hits of volume rendering.
    pub fn has_distance(&self) -> bool {
        self.detects_surface() || self.lights_volume()
    }

    /// True if volume rendering lights the first hit of each ray like a surface (`volume.shading`).
    pub fn lights_volume(&self) -> bool {
        self.settings.mode == Mode::Volume && self.settings.volume.shading == Shading::FirstHit
    }

    /// True if the steps along a ray grow with the distance from the array's apex (`ray.spread`).
    pub fn spreads(&self) -> bool {
        let curved = self.probe().is_some_and(|p| matches!(p.array, Array::Curved { .. }));
        curved && self.settings.ray.spread > 0.0
    }

    /// True if samples are composited through the transfer function.
    pub fn composites(&self) -> bool {
        matches!(self.settings.mode, Mode::Volume | Mode::Mixed) || self.colours_surface() || self.is_pair()
    }

    /// True if volume rendering gives the surface its colour (`surface.colour`).
    pub(crate) fn colours_surface(&self) -> bool {
        self.settings.mode == Mode::Surface && self.settings.surface.colour != SurfaceColour::Constant
    }

    /// True if layout pair shows volume rendering and the surface side by side.
    pub fn is_pair(&self) -> bool {
        self.settings.layout == Layout::Pair
    }

    /// Whether one pass finds the surface and composites the whole ray (thesis 4.4.2): `Ok` with the reason, or `Err` with the reason why not.
    pub(crate) fn marches_once(&self) -> Result<&'static str, &'static str> {
        let settings = &self.settings;
        let is_whole = settings.surface.colour == SurfaceColour::Rendered || self.is_pair();
        if settings.mode != Mode::Surface {
            return Err("no surface is found and no whole ray composited in this mode");
        }
        if !is_whole {
            return Err("no whole ray is composited");
        }
        if self.chooses_surface() {
            return Err("two passes: the surface is chosen among neighbouring rays");
        }
        if settings.ray.sliding == 0 && !self.is_pair() {
            // Measured: docs/experiments/one-march.md.
            return Err("two passes: where samples are cheap (no ray.sliding) they are no slower than one march");
        }
        if matches!(settings.volume.compositing, Compositing::PreIntegrated | Compositing::Exponential) {
            return Err(
                "two passes: this compositing takes samples at the ends of steps, the detector in their middles",
            );
        }
        if self.spreads() {
            return Err("two passes: steps that grow have no sample of the detector in their middles");
        }
        if self.surface_view().low != self.volume_view().low {
            return Err("two passes: rays of the volume and of the surface start at different depths");
        }
        Ok("one march finds the surface and composites the whole ray")
    }

    /// True if the mode is a projection: the largest, smallest or mean sample of each ray.
    pub(crate) fn projects(&self) -> bool {
        matches!(self.settings.mode, Mode::Mip | Mode::MinIp | Mode::Mean)
    }

    /// True if the picture has planes: a mode of planes, or a layout with planes beside the rendering.
    pub fn cuts_planes(&self) -> bool {
        self.is_flat() || self.settings.layout.has_planes()
    }

    /// True if the mode cuts planes and casts no rays.
    pub fn is_flat(&self) -> bool {
        self.settings.mode.is_flat()
    }

    /// Number of samples behind the surface that skin shading averages; 0 if it needs none.
    pub(crate) fn samples_behind(&self) -> u32 {
        match self.settings.light.skin {
            Some(skin) if skin.translucency > 0.0 => ((skin.depth / self.ring.step).ceil() as u32).clamp(1, 256),
            _ => 0,
        }
    }

    /// Distance between the samples behind the surface that skin shading averages, mm. Together the steps span the skin's depth.
    pub(crate) fn step_behind(&self) -> f64 {
        self.settings.light.skin.map_or(0.0, |skin| skin.depth) / f64::from(self.samples_behind().max(1))
    }

    /// True if the light on a surface depends on the echo at or behind it: by `light.texture`, or the translucency of skin.
    pub fn lights_by_echo(&self) -> bool {
        let is_translucent = self.skin().is_some_and(|s| s.translucency > 0.0);
        self.detects_surface() && (self.settings.light.texture > 0.0 || is_translucent)
    }

    /// Skin shading, if it has an effect: wrap or translucency is above 0. Otherwise None.
    pub fn skin(&self) -> Option<Skin> {
        self.settings.light.skin.filter(|s| s.wrap > 0.0 || s.translucency > 0.0)
    }
}
