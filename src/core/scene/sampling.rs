//! How the volume is stored, how rays sample it, and whether they skip bricks: what is best for a scene on a device.

use super::Scene;
use super::camera;
use super::settings::{Mode, Sampling, Scheme, VolumeFormat};

/// Maximum number of texels for which packed neighbours are chosen automatically: 1 GiB.
const MAX_PACKED_TEXELS: u64 = 1 << 27;
/// Samples per texel of one picture above which packed neighbours pay off.
const SAMPLES_PER_PACKED_TEXEL: f64 = 6.0;

// What bricks cost and save, ns: medians over the real bone, the simulated head and the phantom at 96^2 to 512^2, `render --timings`,
// least of 3 runs, with and without bricks; llvmpipe (Mesa 22.3.6, LLVM 15), two shared cores, 2026-11-23.

/// Range of the tile that a texel belongs to, per texel (1.3 to 1.5).
const TEXEL_COST: f64 = 1.4;
/// Range of a brick, per tile that it may touch (0.5 to 1.2).
const TILE_COST: f64 = 1.0;
/// Kind of a brick and its distance to the next of another kind, per brick (80 to 100).
const BRICK_COST: f64 = 90.0;
/// The dispatches of all of these, where there is little to do.
const DISPATCHES_COST: f64 = 1e6;
/// Saved per sample of a ray by compositing (1 to 10).
const COMPOSITING_SAVING: f64 = 3.0;
/// Saved per sample of a ray by the largest or the smallest value (1.2 to 1.6).
const EXTREME_SAVING: f64 = 1.4;
/// Saved per sample of a ray by the surface detector and the mean: from -1.9 to 1.1, about nothing in the median.
const NO_SAVING: f64 = 0.0;

impl Scene {
    /// The texel format of the volume: as set, or for `auto` R16F; or R16 on a device that truncates what it stores, if values stay within 0..1. R16F
    /// has 11 bits, of which truncation loses one, always downwards. R16 has 16 bits for 0..1.
    pub fn volume_format(&self) -> VolumeFormat {
        match self.settings.slices.format {
            VolumeFormat::Auto if self.device.truncates_halves && !self.may_overshoot() => VolumeFormat::R16,
            VolumeFormat::Auto => VolumeFormat::R16f,
            format => format,
        }
    }

    /// True if a filter of slices may leave values beyond 0..1: Richardson's extrapolation in time subtracts one result from another.
    fn may_overshoot(&self) -> bool {
        self.slice_filters.perona_malik.is_some_and(|p| p.scheme == Scheme::AosRichardson)
    }

    /// A line on the texel format of the volume and the reason for it, for `--explain`.
    pub(crate) fn format_choice(&self) -> String {
        let why = match (self.settings.slices.format, self.device.truncates_halves, self.may_overshoot()) {
            (VolumeFormat::Auto, true, true) => {
                "the device truncates what it stores so, but scheme aos-richardson may leave values beyond 0..1"
            }
            (VolumeFormat::Auto, true, false) => "the device truncates what it stores as r16f",
            (VolumeFormat::Auto, false, _) => "no device that truncates what it stores so",
            _ => "as set",
        };
        format!("format of the volume: {}, {why}", self.volume_format().name())
    }

    /// The scene with `ray.sampling = "auto"` replaced by `fastest`, the fastest sampling of the device, or by exact sampling where packed neighbours
    /// do not pay. Bricks are left out where they cost more time than they save. That is only known for a CPU, which is recognised by packed
    /// neighbours as its fastest sampling.
    pub fn sampled(mut self, fastest: Sampling) -> Scene {
        self.bricks_pay = fastest != Sampling::PackedNeighbours || self.settings.slices.still || {
            let [cost, saving] = self.brick_balance();
            saving >= cost
        };
        if self.settings.ray.sampling == Sampling::Auto {
            let pays = fastest != Sampling::PackedNeighbours || self.packed_neighbours_pay();
            self.sampling = if pays { fastest } else { Sampling::Exact };
        }
        self
    }

    /// True if packed neighbours save more time than packing takes. Packing one texel takes as long as three to six samples save.
    fn packed_neighbours_pay(&self) -> bool {
        let texels: u64 = self.volume_size().iter().map(|n| u64::from(*n)).product();
        let enough = self.expected_samples() >= SAMPLES_PER_PACKED_TEXEL * self.visible_texels();
        texels <= MAX_PACKED_TEXELS && (self.settings.slices.still || enough)
    }

    /// Samples of all rays of a picture, about.
    fn expected_samples(&self) -> f64 {
        // A moving view, whose rays are fewer, uses the same sampling and bricks as a still one.
        let rays: u64 = camera::full_size(&self.settings).iter().map(|n| u64::from(*n)).product();
        // Mean ray length: half the diagonal of the box, since some rays miss it and some end early.
        let paths = self.still().map_or(1.0, |still| f64::from(still.samples));
        rays as f64 * paths * 0.5 * (self.high - self.low).length()
            / self.shared.as_ref().map_or(self.step, |shared| shared.step)
    }

    fn visible_texels(&self) -> f64 {
        self.volume_size().iter().map(|n| f64::from(*n)).product::<f64>() * self.visible_share()
    }

    /// What bricks cost one new volume and its one picture, and what they save of it, ns on a CPU.
    fn brick_balance(&self) -> [f64; 2] {
        let (bricks, [_, _, slices]) = (self.bricks(), self.volume_size());
        let total = bricks.total() as f64;
        // A brick may touch three tiles along both axes of a slice, and a slice on each side of its own.
        let touched = 9.0 * (f64::from(slices) / f64::from(bricks.count[2]) + 2.0).min(f64::from(slices));
        let cost = DISPATCHES_COST + TEXEL_COST * self.visible_texels() + total * (TILE_COST * touched + BRICK_COST);
        let of_mode = match self.settings.mode {
            Mode::Mip | Mode::MinIp => EXTREME_SAVING,
            _ if self.composites() => COMPOSITING_SAVING,
            _ => NO_SAVING,
        };
        [cost, of_mode * self.expected_samples()]
    }

    /// A line on whether rays skip bricks and why, for `--explain`. None if no ray takes samples.
    pub(crate) fn brick_choice(&self) -> Option<String> {
        if !self.renders() {
            return None;
        }
        let [cost, saving] = self.brick_balance().map(|ns| ns * 1e-6);
        let balance = format!("on a CPU they cost {cost:.1} ms a volume and save {saving:.1} ms a picture, estimated");
        Some(match (self.settings.ray.brick, self.skips()) {
            (Some(0), _) => "bricks: none, as set".into(),
            (Some(n), true) => format!("bricks: of {n} texels, as set; {balance}"),
            (None, true) if self.settings.slices.still => format!("bricks: the volume is shown many times; {balance}"),
            (None, true) => format!("bricks: they pay for one picture of a volume, or the device is no CPU; {balance}"),
            (None, false) if !self.bricks_pay => format!("bricks: none for one picture of a volume; {balance}"),
            (_, false) => "bricks: none, as places or the sweep's table are too coarse for them".into(),
        })
    }

    /// The scene without packed neighbours, unless the setting requires them: for devices that lack the memory.
    pub fn without_quads(mut self) -> Scene {
        if self.settings.ray.sampling == Sampling::Auto && self.sampling == Sampling::PackedNeighbours {
            self.sampling = Sampling::Exact;
        }
        self
    }

    /// True if samples use the device's trilinear filter.
    pub fn filters_in_hardware(&self) -> bool {
        matches!(self.sampling, Sampling::Auto | Sampling::Hardware)
    }

    /// True if rays sample packed neighbours, texels that hold four neighbours of one or two slices. Never for volumes of 32-bit floats, whose packed texels
    /// would take 16 bytes.
    pub fn packs(&self) -> bool {
        let is_small = self.volume_format() != VolumeFormat::R32f;
        self.sampling == Sampling::PackedNeighbours && is_small && self.renders()
    }
}
