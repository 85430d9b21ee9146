//! The quality of the next picture: what it leaves out while the view moves, and the pipelines of the lower qualities, compiled in advance.

use crate::command::Tool;
use crate::controls::Controls;
use crate::frame_budget::{self, Pace, Quality, Rung};
use crate::live::Lowered;
use crate::plan::Work;
use crate::scene::{Follows, Scene, Settings, variants};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long after the last input pipelines that may be needed next are compiled.
const REST_BEFORE_WARMING: Duration = Duration::from_secs(1);

/// Chooses the quality of pictures by the frame budget, and knows the settings that were sent to the stream.
pub(super) struct PictureQuality {
    pub(super) pace: Pace,
    rungs: Arc<Vec<Rung>>,
    /// The quality of the settings that were sent to the stream last.
    pub(super) quality: Quality,
    /// The last settings that were sent.
    pub(super) sent: Option<Settings>,
    /// Settings that could not be drawn, to report them only once.
    pub(super) rejected: Option<Settings>,
    /// Number of volumes received from a live source.
    live_volumes: u64,
    /// When a light last moved.
    pub(super) light_moved: Option<Instant>,
    /// Whether pipelines are compiled in advance.
    warms: bool,
    /// The settings around which pipelines were last compiled in advance.
    warmed: Option<Settings>,
}

impl PictureQuality {
    /// `first`: rung for a moving view before any picture was timed; `warms`: compile pipelines in advance while the user does nothing.
    pub(super) fn new(budget: Option<Duration>, rungs: Vec<Rung>, first: usize, warms: bool) -> PictureQuality {
        PictureQuality {
            pace: Pace::new(budget, &rungs, first),
            rungs: Arc::new(rungs),
            quality: Quality::default(),
            sent: None,
            rejected: None,
            live_volumes: 0,
            light_moved: None,
            warms,
            warmed: None,
        }
    }

    /// A function that gives the settings of all lower rungs for a scene at full quality, so that stage 1 can serve them; None without a budget.
    pub(super) fn lowered(&self) -> Option<Lowered> {
        let rungs = self.rungs.clone();
        self.pace.budget().map(|_| Arc::new(move |scene: &Scene| frame_budget::lowered(&rungs, scene)) as Lowered)
    }

    /// The present quality in words, for the display of times.
    pub(super) fn label(&self) -> &str {
        frame_budget::label(self.quality, &self.rungs)
    }

    /// Measures the rate at which volumes arrive. `count`: number that arrived so far from a live source; `None` without one.
    pub(super) fn follow_volumes(&mut self, count: Option<u64>, now: Instant) {
        match count {
            Some(count) if count > self.live_volumes => self.pace.volumes_came(count - self.live_volumes, now),
            Some(_) => {}
            None => self.pace.volumes_stopped(),
        }
        self.live_volumes = count.unwrap_or(self.live_volumes);
    }

    pub(super) fn picture_took(&mut self, work: Work, time: Duration) {
        self.pace.picture_took(work, self.quality, time);
    }

    /// The quality and settings to send to the stream now; None if it has these settings, or cannot draw them.
    pub(super) fn to_send(&self, controls: &Controls, now: Instant) -> Option<(Quality, Settings)> {
        let (quality, settings) = self.effective(controls, now);
        let is_known = self.sent.as_ref() == Some(&settings) || self.rejected.as_ref() == Some(&settings);
        (!is_known).then_some((quality, settings))
    }

    /// Notes that settings of this quality are sent to the stream. Returns true if the quality changes.
    pub(super) fn choose(&mut self, quality: Quality) -> bool {
        std::mem::replace(&mut self.quality, quality) != quality
    }

    /// The quality that keeps the frame budget now, and the settings of it.
    fn effective(&self, controls: &Controls, now: Instant) -> (Quality, Settings) {
        let quality = self.pace.quality(now);
        let full = full_settings(controls);
        let mut lowered = self.rungs.get(quality.rays).map(|rung| rung.apply(&full)).unwrap_or(full);
        if quality.rays > 0 && self.makes_light(controls.settings(), now) {
            lowered = frame_budget::coarsely_lit(lowered);
        }
        (quality, frame_budget::shaded(lowered, quality.shading))
    }

    /// True if the light of a light volume is made again for every picture of a view that moves: the light itself moves, or follows the camera, or volumes keep
    /// coming.
    fn makes_light(&self, settings: &Settings, now: Instant) -> bool {
        let has_moved = self.light_moved.is_some_and(|at| now.saturating_duration_since(at) < frame_budget::REST_DELAY);
        has_moved || self.pace.is_live(now) || settings.light.follows == Follows::Camera
    }

    /// The settings whose pipelines are to be compiled in advance while the user does nothing: every mode, layout and preset, and the lower
    /// rungs of the quality ladder, each with its settings at full quality. None if it is not the time for that. `acted`: time of the user's
    /// last action; `has_warmed`: the stream was given such settings for the present source.
    pub(super) fn warm(
        &mut self,
        controls: &Controls,
        acted: Instant,
        has_warmed: bool,
        now: Instant,
    ) -> Option<Vec<(Settings, Option<Settings>)>> {
        let is_due = self.warms && now >= acted + REST_BEFORE_WARMING;
        if !is_due || (has_warmed && self.warmed.as_ref() == Some(controls.settings())) {
            return None;
        }
        let (_, settings) = self.effective(controls, now);
        let lowered = self.rungs.iter().skip(1).filter(|_| self.pace.budget().is_some());
        let lowered = lowered.flat_map(|rung| {
            let lowered = rung.apply(&settings);
            let coarsely_lit = frame_budget::coarsely_lit(lowered.clone());
            let is_another = coarsely_lit != lowered;
            let both = [Some(lowered), is_another.then_some(coarsely_lit)];
            both.into_iter().flatten().map(|one| (one, Some(settings.clone()))).collect::<Vec<_>>()
        });
        let switches = variants::switches(&settings, |to| controls.switched(to)).into_iter();
        let next = lowered.chain(switches.map(|variant| (variant.settings, None))).collect();
        self.warmed = Some(controls.settings().clone());
        Some(next)
    }

    /// Stops compiling pipelines in advance, because the user acts. Returns true if it was in progress.
    pub(super) fn stop_warming(&mut self) -> bool {
        self.warmed.take().is_some()
    }

    /// Time at which compiling in advance begins; None if it is done.
    pub(super) fn warms_at(&self, acted: Instant, now: Instant) -> Option<Instant> {
        let at = acted + REST_BEFORE_WARMING;
        (self.warms && self.warmed.is_none() && at > now).then_some(at)
    }
}

/// The settings at full quality, with which a view at rest is drawn.
pub(super) fn full_settings(controls: &Controls) -> Settings {
    let mut full = controls.settings().clone().without_drawings();
    // A region that grows and a plane that moves show slices that were left out. With all of them processed, dragging needs no frame
    // again.
    let cuts_planes = full.mode.is_flat() || full.layout.has_planes();
    full.slices.everything |= cuts_planes || matches!(controls.tool(), Tool::Region | Tool::Clip);
    full
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quality(warms: bool) -> (PictureQuality, Controls) {
        let rungs = frame_budget::built_in_ladder();
        let controls = Controls::new(Settings::default());
        (PictureQuality::new(Some(Duration::from_millis(16)), rungs, 1, warms), controls)
    }

    /// Prevents settings that are sent or refused again and again, and a view at rest that leaves something out.
    #[test]
    fn settings_are_sent_once_and_a_moving_view_sends_lower_ones_until_it_rests() {
        let (mut quality, controls) = quality(false);
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let (rung, full) = quality.to_send(&controls, at(0)).expect("the first");
        assert_eq!((rung, &full), (Quality::default(), &full_settings(&controls)));
        assert!(!quality.choose(rung));
        quality.sent = Some(full.clone());
        assert!(quality.to_send(&controls, at(1)).is_none());
        quality.pace.moved(Work::Rays, at(10));
        let (rung, lower) = quality.to_send(&controls, at(11)).expect("it moves");
        assert!(rung.rays == 1 && lower != full && quality.choose(rung) && !quality.choose(rung));
        assert_eq!((quality.quality, quality.pace.rests_at(at(11))), (rung, Some(at(260))));
        quality.rejected = Some(lower);
        assert!(quality.to_send(&controls, at(12)).is_none(), "it was refused");
        assert!(quality.to_send(&controls, at(260)).is_none(), "the stream still has those at rest");
    }

    #[test]
    fn pipelines_are_compiled_once_after_a_second_of_rest() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let (mut never, controls) = quality(false);
        assert!(never.warm(&controls, begin, false, at(5000)).is_none() && never.warms_at(begin, begin).is_none());
        let (mut quality, controls) = quality(true);
        assert_eq!(quality.warms_at(begin, at(999)), Some(at(1000)));
        assert!(quality.warm(&controls, begin, false, at(999)).is_none() && !quality.stop_warming());
        let next = quality.warm(&controls, begin, false, at(1000)).expect("due");
        assert!(next.iter().any(|(_, full)| full.is_some()) && next.iter().any(|(_, full)| full.is_none()));
        assert!(quality.warm(&controls, begin, true, at(2000)).is_none(), "done");
        assert!(quality.warm(&controls, begin, false, at(2000)).is_some(), "another source");
        assert!(quality.stop_warming() && !quality.stop_warming());
    }
}
