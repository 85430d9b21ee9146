//! What is seen: the picture and the panels, shown when either is new, and not at all otherwise.

use super::tick::SILENCE;
use super::{Console, ConsoleError};
use crate::gpu::window::PresentOutcome;
use crate::ui::panels::{Banner, Facts};
use crate::ui::source_supervisor::Condition;
use std::time::{Duration, Instant};

/// So long what was seen stays, while what is shown is made anew: less disturbing than a black moment.
const PATIENCE: Duration = Duration::from_millis(400);
/// Between two attempts to show something where there was nothing to show it on.
const NOWHERE: Duration = Duration::from_millis(100);
/// The help is shown in windows that are higher, points.
const HELP: f32 = 200.0;
/// Of a compiler's message, at most.
const SHADER_LINES: usize = 12;

impl Console {
    pub(super) fn show(&mut self, now: Instant) -> Result<(), ConsoleError> {
        // A picture that is on its way would be waited for: it and the panels are then shown together.
        if !(self.fresh || self.stale) || self.stream.is_drawing() || self.nowhere.is_some_and(|until| now < until) {
            return Ok(());
        }
        let has_drawn = self.stream.renderer().is_some_and(|renderer| renderer.has_drawn());
        if !has_drawn && !self.stream.is_idle() {
            let since = *self.blank.get_or_insert(now);
            if now.saturating_duration_since(since) < PATIENCE {
                return Ok(());
            }
        }
        self.blank = None;
        let panels = self.options.overlay.then(|| self.lay_out(now, has_drawn));
        if !self.options.overlay && !has_drawn && self.screen.as_ref().is_some_and(|s| s.shown() > 0) {
            self.stale = false;
            return Ok(());
        }
        let at = self.place().0;
        let Some(screen) = &mut self.screen else {
            (self.fresh, self.stale) = (false, false);
            return Ok(());
        };
        let seen = match self.stream.renderer().filter(|_| has_drawn) {
            Some(renderer) => renderer.present(screen, at, panels),
            None => screen.show(panels),
        };
        match seen {
            Ok(PresentOutcome::Shown) => {
                (self.fresh, self.stale, self.nowhere) = (false, self.panels.is_waiting(), None);
                self.answered();
            }
            // Asked again when the window says so, or in a moment.
            Ok(PresentOutcome::Nowhere) => self.nowhere = Some(now + NOWHERE),
            Err(lost) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
            Err(fault) => return Err(ConsoleError::Screen(fault)),
        }
        Ok(())
    }

    /// The picture that was shown answers what a hand did before it was begun.
    fn answered(&mut self) {
        let drawn = self.stream.last_begun();
        if let Some((touched, _)) = self.awaited.take_if(|(_, sent)| drawn.is_some_and(|begun| begun >= *sent)) {
            self.times.hands.add(touched.elapsed());
        }
    }

    /// What came of it, in a line.
    pub fn summary(&mut self) -> String {
        let ms = |value: Option<f64>| value.map_or("-".into(), |ms| format!("{ms:.1}"));
        let of = |last: &crate::ui::times::Last| {
            format!("p50 {} p95 {}", ms(last.percentile(0.5)), ms(last.percentile(0.95)))
        };
        let (shown, dispatched) = (self.screen.as_ref().map_or(0, |s| s.shown()), self.stream.dispatches());
        let still = self.stream.last_begun().map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        format!(
            "{:.1} s: {} volumes, {} shown on the window, {dispatched} dispatches, none in the last {still:.1} s; ms: picture {}, \
             hand to picture {}",
            self.began.elapsed().as_secs_f64(),
            self.stream.volumes_shown(),
            shown,
            of(&self.times.pictures),
            of(&self.times.hands),
        )
    }

    fn lay_out(&mut self, now: Instant, is_drawn: bool) -> crate::gpu::window::Panels {
        let notes: Vec<_> = self.notes.iter().map(|(_, note)| note.clone()).collect();
        let quality = self.rungs.get(self.rung).map_or("full quality", |rung| rung.words.as_str());
        let exit_key = match (&self.options.exit, self.options.is_kiosk) {
            (Some(chord), true) => chord.to_string(),
            (None, true) => String::new(),
            (_, false) => "Escape, Q".into(),
        };
        let facts = Facts {
            controls: &self.controls,
            scene: self.stream.scene(),
            times: &self.times,
            picture: self.place(),
            is_panelled: self.is_panelled,
            // egui breaks at a list that has less than no room.
            help: self.help && self.size[1] as f32 > HELP * self.panels.scale(),
            hud: self.hud,
            is_frozen: self.stream.is_frozen(),
            is_playing: self.playing.is_some(),
            cine: (self.stream.cine().volumes().len(), self.stream.cine_position()),
            is_drawn,
            quality,
            budget: self.pace.budget(),
            banner: self.banner(now),
            notes: &notes,
            exit_key: &exit_key,
            pointer: self.pointer,
        };
        let laid = self.panels.lay_out(&facts, self.size, now.saturating_duration_since(self.began).as_secs_f64());
        self.again = (laid.again < Duration::from_secs(3600)).then(|| now + laid.again);
        for command in laid.commands {
            self.command(&command, now);
        }
        laid.panels
    }

    /// What is amiss, while it is.
    fn banner(&self, now: Instant) -> Option<Banner> {
        let banner = |title: &str, text: &str, is_fault| Banner { title: title.into(), text: text.into(), is_fault };
        if let Some((amiss, _)) = &self.amiss {
            return Some(banner(&amiss.title, &amiss.why, true));
        }
        if let Some(fault) = &self.shader_fault {
            // A compiler may complain of every line.
            let text: String = fault.lines().take(SHADER_LINES).map(|line| format!("{line}\n")).collect();
            return Some(banner("A shader has a fault: the last good one is shown", text.trim_end(), true));
        }
        let silent = now.saturating_duration_since(self.heard) >= SILENCE && !self.stream.is_frozen();
        match self.supply.condition() {
            Condition::Opening => Some(banner("Connecting to the probe", "", false)),
            Condition::Waiting(why) => Some(banner("No probe: trying again", why, true)),
            Condition::Over(Some(why)) => Some(banner("The source ended", why, true)),
            Condition::Open if silent => {
                Some(banner("No frames from the probe", "It is connected and says nothing.", true))
            }
            Condition::Over(None) | Condition::Open => None,
        }
    }
}
