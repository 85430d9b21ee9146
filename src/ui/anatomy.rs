//! Where the picture shows recorded data, dark or bright. Overlays keep away from there if they have room elsewhere.

use crate::picking::Picker;
use crate::probe::{Geometry, Motion, Probe};
use crate::scene::planes::Tiling;
use crate::scene::{Scene, insonified_box};
use glam::DVec3;

/// Places along a ray at which it is looked for data.
const STEPS: u32 = 64;

/// Tells which positions of a picture show recorded data and which only background.
pub(super) struct Anatomy<'a> {
    scene: &'a Scene,
    tiling: Option<Tiling>,
    /// Corners of the box that rays are drawn in, mm.
    bounds: (DVec3, DVec3),
}

impl<'a> Anatomy<'a> {
    pub(super) fn of(scene: &'a Scene) -> Anatomy<'a> {
        let (low, high) = insonified_box(&scene.geometry);
        let tiling = scene.cuts_planes().then(|| scene.tiling());
        Anatomy { scene, tiling, bounds: (low.max(scene.low), high.min(scene.high)) }
    }

    /// True if the plane or the ray at this position (pixels of the picture) meets recorded data. Cuts and thresholds are ignored.
    pub(super) fn is_at(&self, at: [f64; 2]) -> bool {
        let on = self.tiling.as_ref().and_then(|tiling| Some((tiling, tiling.tiles.iter().find(|tile| tile.has(at))?)));
        if let Some((tiling, tile)) = on {
            // A thick plane shows what is before and behind it too.
            let place = tiling.point(tile, at);
            let aside = tile.plane.normal * self.scene.settings.planes.thickness / 2.0;
            let places = [place - aside, place, place + aside];
            // Beside a rendering, planes reach out of the region.
            let is_shown = |place: &DVec3| self.scene.has_sections() || is_within(*place, self.bounds);
            return places.into_iter().filter(is_shown).any(|place| self.is_recorded(place));
        }
        !self.scene.is_flat() && self.is_on_ray(at)
    }

    fn is_on_ray(&self, at: [f64; 2]) -> bool {
        let picker = Picker::of(self.scene);
        // Both halves of a pair show the same rays.
        let shift = if self.scene.is_pair() && at[0] < picker.corner()[0] { picker.corner()[0] } else { 0.0 };
        let (origin, direction) = picker.ray([at[0] + shift, at[1]]);
        let [a, b] = [self.bounds.0, self.bounds.1].map(|corner| (corner - origin) / direction);
        let from = a.min(b).max_element().max(0.0);
        let to = a.max(b).min_element();
        let step = (to - from) / f64::from(STEPS);
        to > from && (0..=STEPS).any(|n| self.is_recorded(origin + direction * (from + step * f64::from(n))))
    }

    fn is_recorded(&self, place: DVec3) -> bool {
        is_within(place, insonified_box(&self.scene.geometry))
            && match &self.scene.geometry {
                Geometry::Sweep(probe) => is_in_sector(probe, place),
                Geometry::Cartesian(_) => true,
            }
    }
}

/// True if a place is in a box between two corners, or at its edge.
fn is_within(place: DVec3, (low, high): (DVec3, DVec3)) -> bool {
    place.cmpge(low - 1e-9).all() && place.cmple(high + 1e-9).all()
}

fn is_in_sector(probe: &Probe, place: DVec3) -> bool {
    let at = probe.to_indices(place);
    let is_in = |n: f64, count: usize| n >= -0.5 && n <= count as f64 - 0.5;
    let is_still = matches!(probe.motion, Motion::Still { .. });
    is_in(at.sample, probe.samples)
        && is_in(at.line, probe.lines.len())
        && (is_still || is_in(at.slice, probe.slices.len()))
}
