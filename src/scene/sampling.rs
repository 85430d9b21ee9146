//! The choice of sampling: the device's filter, eight texels, or packed neighbours.

use super::{Sampling, Scene, VolumeFormat};

/// Maximum number of texels for which packed neighbours are chosen automatically: four times as many values.
const MAX_PACKED_TEXELS: u64 = 1 << 27;
/// Samples per texel of one picture above which packed neighbours pay off.
const SAMPLES_PER_PACKED_TEXEL: f64 = 6.0;

impl Scene {
    /// The scene with `auto` replaced by `fastest`, the fastest sampling of the device.
    pub fn sampled(mut self, fastest: Sampling) -> Scene {
        if self.settings.ray.sampling == Sampling::Auto {
            let pays = fastest != Sampling::Quads || self.quads_pay();
            self.sampling = if pays { fastest } else { Sampling::Exact };
        }
        self
    }

    /// True if packed neighbours save more time than packing takes. Packing one texel takes as long as three to six samples save.
    fn quads_pay(&self) -> bool {
        let texels: u64 = self.volume_size().iter().map(|n| u64::from(*n)).product();
        let rays: u64 = self.ray_size().iter().map(|n| u64::from(*n)).product();
        // A moving view uses the same sampling as a still one.
        let rays = if self.settings.ray.half { 4 * rays } else { rays };
        // Mean ray length: half the diagonal of the box, since some rays miss it and some end early.
        let samples = rays as f64 * 0.5 * (self.high - self.low).length() / self.step;
        let made = texels as f64 * self.share_seen();
        texels <= MAX_PACKED_TEXELS && (self.settings.slices.still || samples >= SAMPLES_PER_PACKED_TEXEL * made)
    }

    /// The scene without packed neighbours, unless the setting requires them. For devices that lack the memory.
    pub fn without_quads(mut self) -> Scene {
        if self.settings.ray.sampling == Sampling::Auto && self.sampling == Sampling::Quads {
            self.sampling = Sampling::Exact;
        }
        self
    }

    /// True if samples use the device's trilinear filter.
    pub fn filters_in_hardware(&self) -> bool {
        matches!(self.sampling, Sampling::Auto | Sampling::Hardware)
    }

    /// True if rays sample packed neighbours: texels that hold four neighbours of a slice. Not for 32-bit floats, which would take 16 bytes.
    pub fn packs(&self) -> bool {
        let stored = self.settings.slices.format != VolumeFormat::R32f;
        self.sampling == Sampling::Quads && stored && (self.composites() || self.detects_surface() || self.projects())
    }
}
