//! How samples of the volume are taken: by the device's filter, from eight texels, or from quads, whichever is fastest where it runs.

use super::{Sampling, Scene, VolumeFormat};

/// Most texels of a volume that quads are made of without being asked for: four times as many values.
const MOST_QUADS: u64 = 1 << 27;
/// Samples of a picture for each quad above which quads are made for a single picture.
const SAMPLES_A_QUAD: f64 = 6.0;

impl Scene {
    /// The scene where samples are taken fastest in this way: what `auto` becomes on a device.
    pub fn sampled(mut self, fastest: Sampling) -> Scene {
        if self.settings.ray.sampling == Sampling::Auto {
            let pays = fastest != Sampling::Quads || self.quads_pay();
            self.sampling = if pays { fastest } else { Sampling::Exact };
        }
        self
    }

    /// Whether samples save more by quads than it takes to make them. A quad takes as long to make as three to six samples save.
    fn quads_pay(&self) -> bool {
        let texels: u64 = self.volume_size().iter().map(|n| u64::from(*n)).product();
        let rays: u64 = self.ray_size().iter().map(|n| u64::from(*n)).product();
        // A view that moves keeps the quads that it takes when it stands.
        let rays = if self.settings.ray.half { 4 * rays } else { rays };
        // Half the box's diagonal: some rays miss it, some end early.
        let samples = rays as f64 * 0.5 * (self.high - self.low).length() / self.step;
        let made = texels as f64 * self.share_seen();
        texels <= MOST_QUADS && (self.settings.slices.still || samples >= SAMPLES_A_QUAD * made)
    }

    /// The scene as it is sampled where quads do not fit, unless they were asked for.
    pub fn without_quads(mut self) -> Scene {
        if self.settings.ray.sampling == Sampling::Auto && self.sampling == Sampling::Quads {
            self.sampling = Sampling::Exact;
        }
        self
    }

    /// Whether samples of the volume go through the device's own filter.
    pub fn filters_in_hardware(&self) -> bool {
        matches!(self.sampling, Sampling::Auto | Sampling::Hardware)
    }

    /// Whether rays are cast through texels that hold the four neighbours of a slice: not of floats, which would take 16 bytes.
    pub fn packs(&self) -> bool {
        let stored = self.settings.slices.format != VolumeFormat::R32f;
        self.sampling == Sampling::Quads && stored && (self.composites() || self.detects_surface() || self.projects())
    }
}
