//! The part of the volume that each way of rendering shows.

use super::{Mode, Scene, depth_offset};
use glam::DVec3;

/// The box and grey window that a pass of stage 2 renders with. They depend on the mode, because each mode has its own start depth: rays that start
/// at the probe would meet the uterine wall first.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub window: [f64; 2],
    /// Lower corner of the box, at the start depth where that is deeper than the region's near face, mm in space.
    pub low: DVec3,
    /// Upper corner of the box, mm in space.
    pub high: DVec3,
}

/// A sample after the grey window `low`..`high`, 0..1.
pub(crate) fn windowed([low, high]: [f64; 2], sample: f64) -> f64 {
    ((sample - low) / (high - low)).clamp(0.0, 1.0)
}

impl Scene {
    /// The box and grey window of the surface detector.
    pub fn surface_view(&self) -> View {
        self.view(self.settings.surface.window, self.settings.surface.start_depth)
    }

    /// The box and grey window of volume rendering.
    pub fn volume_view(&self) -> View {
        self.view(self.settings.volume.window, self.settings.volume.start_depth)
    }

    /// The box and grey window of projections.
    pub(crate) fn projection_view(&self) -> View {
        self.view(self.settings.projection.window, self.settings.projection.start_depth)
    }

    /// Y coordinate in space, mm, at which rendering starts unless the start surface or start curve is deeper. In mode mixed it is the deeper of the
    /// start depths of both layers; planes and mode cube start at the region's near face.
    pub fn start_depth(&self) -> f64 {
        let (surface, volume, projection) = (self.surface_view(), self.volume_view(), self.projection_view());
        match self.settings.mode {
            Mode::Surface => surface.low.y,
            Mode::Volume => volume.low.y,
            Mode::Mixed => surface.low.y.max(volume.low.y),
            Mode::Mip | Mode::MinIp | Mode::Mean => projection.low.y,
            _ => self.low.y,
        }
    }

    /// The whole region with this grey window, without a start depth.
    pub(crate) fn whole_view(&self, window: [f64; 2]) -> View {
        self.view(window, None)
    }

    fn view(&self, window: [f64; 2], start: Option<f64>) -> View {
        let start = start.map_or(self.low.y, |s| s + depth_offset(&self.geometry));
        View { window, low: self.low.with_y(self.low.y.max(start)), high: self.high }
    }
}
