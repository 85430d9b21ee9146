//! Floating parts: small parts of a volume that touch no other drawn part.

use super::{Scene, SceneError, Sign, refuse, region, transfer};
use crate::probe::{Geometry, Motion, Probe};

/// Sizes of parts are integers, so that their sums are exact: of so many a texel, of a fan one at its end. 16 billion of them fit.
const PER_TEXEL: f64 = (1u64 << 30) as f64;

impl Scene {
    /// True if floating parts are dropped: `floating` is set, the mode composites or detects a surface, and the volume has several slices.
    pub fn drops_floating(&self) -> bool {
        let is_still = region::is_still(&self.geometry);
        self.settings.floating > 0.0 && (self.composites() || self.detects_surface()) && self.slices() > 1 && !is_still
    }

    /// The largest sample value of which nothing is drawn: up to it the transfer function is transparent and no edge reaches the detector's
    /// threshold. Texels above it form parts. None if dark samples are drawn.
    pub fn floating_level(&self) -> Option<f64> {
        let (volume, surface) = (&self.settings.volume, &self.settings.surface);
        let sample = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
        let of_volume = || {
            let table = transfer::table_of(volume, self.reference_length(), self.transfer_entries());
            // Between two entries the table is linear.
            let last = match table.iter().position(|entry| entry[3] > 0.0) {
                Some(first) => first.checked_sub(1)?,
                None => table.len() - 1,
            };
            Some(sample(volume.window, last as f64 / (table.len() - 1) as f64))
        };
        let of_surface = || (surface.sign != Sign::Dark).then(|| sample(surface.window, surface.threshold));
        match (self.composites(), self.detects_surface()) {
            (true, true) => Some(of_volume()?.min(of_surface()?)),
            (true, false) => of_volume(),
            _ => of_surface(),
        }
    }

    /// The unit in which sizes of parts are counted, mm^3: the volume of the largest texel of slices at their mean distance, divided by 2^30.
    pub fn part_unit(&self) -> f64 {
        let [across, down] = self.grid.pitch;
        let along = match &self.geometry {
            Geometry::Cartesian(grid) => grid.spacing[2],
            Geometry::Sweep(probe) => (probe.slices.pitch() * arc(probe, probe.last_range())).abs(),
        };
        across * down * along / PER_TEXEL
    }

    /// The size below which a part is dropped, in units of [`Scene::part_unit`].
    pub(crate) fn least_part(&self) -> u64 {
        (self.settings.floating / self.part_unit()).ceil() as u64
    }

    /// How many slices two texels may be apart so that one interpolated sample can touch both.
    pub(crate) fn part_reach(&self) -> usize {
        if self.takes_bspline() { 3 } else { 1 }
    }

    /// The size of each texel in units of [`Scene::part_unit`], by slice and row: entry `slice * rows + row`. In a fan a texel is as long across
    /// slices as its arc.
    pub fn texel_sizes(&self) -> Vec<u64> {
        let ([across, down], unit) = (self.grid.pitch, self.part_unit());
        // Above the axis of a fan, radii are negative.
        let size = |along: f64| (across * down * along / unit).abs().round() as u64;
        let rows = self.grid.size[1];
        let each = |slice: u32, row: u32| match &self.geometry {
            Geometry::Cartesian(grid) => size(grid.spacing[2]),
            Geometry::Sweep(probe) => {
                let at = f64::from(slice);
                let pitch = probe.slices.at(at + 0.5) - probe.slices.at(at - 0.5);
                size(pitch * arc(probe, self.grid.place(0.0, f64::from(row)).1))
            }
        };
        (0..self.slices()).flat_map(|slice| (0..rows).map(move |row| (slice, row))).map(|(s, r)| each(s, r)).collect()
    }

    /// A key of the settings that decide which parts float: scenes with equal keys find the same parts in the same volume.
    pub(crate) fn floating_basis(&self) -> impl PartialEq + use<> {
        (self.least_part(), self.floating_level(), self.part_reach())
    }
}

/// Length across slices at a depth in the plane, mm, per unit of the slice's position.
fn arc(probe: &Probe, depth: f64) -> f64 {
    match probe.motion {
        Motion::Fan { .. } => depth - probe.axis_depth(),
        Motion::Translated | Motion::Still { .. } => 1.0,
    }
}

/// Checks whether floating parts can be told from what surrounds them.
///
/// # Errors
/// Dark matter is drawn, and so is everything around the parts.
pub(super) fn check_floating(scene: &Scene) -> Result<(), SceneError> {
    match scene.drops_floating() && scene.floating_level().is_none() {
        true => refuse(
            "floating",
            "drops bright parts in the dark, and here what is dark is drawn (surface.sign=dark, or a transfer function that is opaque at 0): \
             set floating=0",
        ),
        false => Ok(()),
    }
}
