//! The quality of the next picture: what is left out of it while the view moves, and the pipelines of that, compiled in advance.

use super::{Console, REST_BEFORE_WARMING};
use crate::command::Tool;
use crate::frame_budget::{self, Quality};
use crate::scene::{Follows, Layout, Settings, variants};
use std::time::Instant;

impl Console {
    /// While the user rests, compiles what may be asked for next: every mode, layout and preset, and the lower rungs of the quality
    /// ladder. Frames that arrive meanwhile are drawn as before.
    pub(super) fn warm(&mut self, now: Instant) {
        let is_due = self.fixed.warms && now >= self.last_input + REST_BEFORE_WARMING;
        let is_done = self.stream.has_warmed() && self.warmed.as_ref() == Some(self.controls.settings());
        // The first picture in full has the processor for itself.
        let has_drawn = self.has_started && self.stream.renderer().is_some_and(|renderer| renderer.has_drawn());
        if !is_due || is_done || !has_drawn {
            return;
        }
        let (_, settings) = self.effective_settings(now);
        let lowered = self.rungs.iter().skip(1).filter(|_| self.pace.budget().is_some());
        let lowered = lowered.flat_map(|rung| {
            let lowered = rung.apply(&settings);
            let coarsely_lit = frame_budget::coarsely_lit(lowered.clone());
            let is_another = coarsely_lit != lowered;
            let both = [Some(lowered), is_another.then_some(coarsely_lit)];
            both.into_iter().flatten().map(|one| (one, Some(settings.clone()))).collect::<Vec<_>>()
        });
        let switches = variants::switches(&settings, |to| self.controls.switched(to)).into_iter();
        let next = lowered.chain(switches.map(|variant| (variant.settings, None))).collect();
        self.stream.warm(next);
        self.warmed = Some(self.controls.settings().clone());
    }

    /// When pipelines are compiled in advance, if that is not yet done.
    pub(super) fn warms_at(&self, now: Instant) -> Option<Instant> {
        let at = self.last_input + REST_BEFORE_WARMING;
        (self.fixed.warms && self.warmed.is_none() && at > now).then_some(at)
    }

    /// The settings of a view at rest.
    pub(super) fn full_settings(&self) -> Settings {
        let mut full = self.controls.settings().clone().without_drawings();
        // A region that grows and a plane that moves show slices that were left out. With all of them processed, dragging needs no frame
        // again.
        let cuts_planes = full.mode.is_flat() || full.layout == Layout::Four;
        full.slices.everything |= cuts_planes || matches!(self.controls.tool(), Tool::Region | Tool::Clip);
        full
    }

    /// The quality that keeps the frame budget now, and the settings of it.
    pub(super) fn effective_settings(&self, now: Instant) -> (Quality, Settings) {
        let quality = self.pace.quality(now);
        let full = self.full_settings();
        let lowered = match self.rungs.get(quality.rays) {
            Some(rung) => rung.apply(&full),
            None => full,
        };
        let lowered = match quality.rays > 0 && self.makes_light(now) {
            true => frame_budget::coarsely_lit(lowered),
            false => lowered,
        };
        (quality, frame_budget::shaded(lowered, quality.shading))
    }

    /// True if the light of a light volume is made again for every picture of a view that moves: the light itself moves, or follows the camera, or volumes keep
    /// coming.
    fn makes_light(&self, now: Instant) -> bool {
        let has_moved = self.light_moved.is_some_and(|at| now.saturating_duration_since(at) < frame_budget::REST_DELAY);
        has_moved || self.pace.is_live(now) || self.controls.settings().light.follows == Follows::Camera
    }
}
