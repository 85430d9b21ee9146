//! One iteration of the console: inputs go in, what is due is drawn, and what was drawn is shown. Nothing is shown that did not change.

use super::{Console, ConsoleError, Next};
use crate::gpu::window::PresentOutcome;
use crate::live::{Feed, FinishedPicture, Step, StreamError};
use crate::ui::panels::{Banner, Facts};
use crate::ui::source_supervisor::Condition;
use crate::ui::times::Last;
use std::time::{Duration, Instant};

/// The stream has so long at a time before hands are asked again.
const SHARE: Duration = Duration::from_millis(4);
/// Faults of a device without a picture in between, after which it is opened anew.
const FAULTS: u32 = 5;
/// Between two looks at the statistics.
const SECOND: Duration = Duration::from_secs(1);
/// A source that says nothing for so long is said to.
const SILENCE: Duration = Duration::from_secs(3);

impl Console {
    /// Does what is due, and says when to come again.
    ///
    /// # Errors
    /// A device or a screen that is gone.
    pub fn tick(&mut self, now: Instant) -> Result<Next, ConsoleError> {
        if let Some((amiss, at)) = &mut self.amiss
            && now >= *at
        {
            *at = now + super::LOOK;
            self.next.renews |= (amiss.is_mended)();
        }
        if let Some(feed) = self.supply.poll(now).filter(|_| self.amiss.is_none()) {
            self.stream.replace_source(feed);
            (self.heard, self.stale) = (now, true);
        }
        while let Some(saved) = self.keep.poll() {
            match saved {
                Ok(file) => self.say(&format!("saved {}", file.display()), false),
                Err(fault) => self.say(&format!("not saved: {fault}"), true),
            }
        }
        self.play(now);
        self.adjust(now);
        self.run(now)?;
        let shader_fault = self.shaders.as_ref().and_then(|folder| folder.fault());
        self.stale |= shader_fault != self.shader_fault;
        self.shader_fault = shader_fault;
        self.count(now);
        let before = self.notes.len();
        self.notes.retain(|(until, _)| *until > now);
        self.stale |= self.notes.len() != before || self.again.is_some_and(|at| at <= now);
        self.show(now)?;
        Ok(Next { at: self.due(now), ..std::mem::take(&mut self.next) })
    }

    /// Gives the stream the settings as they are to be drawn now.
    fn adjust(&mut self, now: Instant) {
        let (rung, wanted) = self.wanted(now);
        if self.sent.as_ref() == Some(&wanted) || self.refused.as_ref() == Some(&wanted) {
            return;
        }
        self.stale |= rung != self.rung;
        self.rung = rung;
        match self.stream.change(wanted.clone()) {
            Ok(()) => {
                self.sent = Some(wanted);
                self.awaited =
                    self.touched.take().or(self.awaited.map(|a| a.0)).map(|touched| (touched, Instant::now()));
            }
            Err(fault) => {
                self.refused = Some(wanted);
                self.say(&fault.to_string(), true);
            }
        }
    }

    fn run(&mut self, now: Instant) -> Result<(), ConsoleError> {
        let begun = Instant::now();
        loop {
            match self.stream.step(Duration::ZERO) {
                Ok(Step::Picture(shown)) => {
                    self.drew(&shown);
                    self.faults = 0;
                    // Shown before the next one begins, which would take its place.
                    break;
                }
                Ok(Step::Fault(fault)) => self.say(&fault, true),
                Ok(Step::Progress) => {}
                Ok(Step::End(why)) => self.ended(why, now),
                Err(StreamError::Gpu(lost)) if lost.is_device_lost() => return Err(ConsoleError::DeviceLost(lost)),
                // One that fails whatever comes is as good as lost.
                Err(StreamError::Gpu(fault)) if self.faults >= FAULTS => {
                    self.faults = 0;
                    return Err(ConsoleError::DeviceLost(fault));
                }
                // What came cannot be drawn: too large, or beyond what settings allow.
                Err(fault) => {
                    self.faults += u32::from(matches!(fault, StreamError::Gpu(_)));
                    self.ended(Some(fault.to_string()), now);
                    break;
                }
            }
            let waits = self.stream.is_drawing() && !self.stream.has_waiting();
            if begun.elapsed() >= SHARE || waits || self.stream.is_idle() {
                break;
            }
        }
        let frames = self.stream.frames();
        if frames != self.frames {
            (self.frames, self.heard) = (frames, now);
        }
        Ok(())
    }

    pub(super) fn ended(&mut self, why: Option<String>, now: Instant) {
        if let Some(why) = &why {
            tracing::warn!("source: {why}");
        }
        self.supply.ended(why, now);
        self.stream.replace_source(Feed::none());
        self.stale = true;
    }

    fn drew(&mut self, shown: &FinishedPicture) {
        self.fresh = true;
        self.pace.took(self.rung, shown.took);
        self.times.pictures.add(shown.took);
    }

    /// The statistics of a second in which anything happened.
    fn count(&mut self, now: Instant) {
        if now.saturating_duration_since(self.counted) < SECOND {
            return;
        }
        self.counted = now;
        let floor = self.stream.acquisition_time();
        // Without a picture or a frame they cannot fail, and nothing is worth more than going on.
        if let Ok(since) = self.stream.take_statistics() {
            self.stale |= self.hud && (since.pictures > 0 || since.frames > 0);
            if since.pictures > 0 || since.frames > 0 {
                tracing::debug!("{}", since.line(floor));
            }
            self.times.second(&since, floor);
        }
    }

    /// When something is due that nothing brings.
    fn due(&self, now: Instant) -> Option<Instant> {
        if self.stream.is_drawing() && !self.stream.has_waiting() {
            // It is asked for, not waited for; a device that is a CPU needs the core that would ask all the time.
            return Some(now + Duration::from_millis(1));
        }
        let shows = self.stale && self.screen.is_some() && self.blank.is_none() && self.nowhere.is_none();
        if !self.stream.is_idle() || shows {
            return Some(now);
        }
        let notes = self.notes.iter().map(|(until, _)| *until);
        let listens = matches!(self.supply.condition(), Condition::Open);
        let silence = Some(self.heard + SILENCE).filter(|at| listens && !self.stream.is_frozen() && *at > now);
        let counts = self.hud.then_some(self.counted + SECOND).filter(|_| self.times.pictures.newest().is_some());
        let looks = self.amiss.as_ref().map(|(_, at)| *at);
        [
            looks,
            self.nowhere,
            self.supply.wakes_at(),
            self.pace.rests_at(now),
            self.again,
            self.playing,
            silence,
            counts,
        ]
        .into_iter()
        .flatten()
        .chain(notes)
        .chain(self.blank.map(|_| now + Duration::from_millis(20)))
        .min()
    }
}

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
        let of = |last: &Last| format!("p50 {} p95 {}", ms(last.percentile(0.5)), ms(last.percentile(0.95)));
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
