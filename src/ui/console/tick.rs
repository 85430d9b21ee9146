//! One turn of the console: what came goes in, what is due is drawn, and what was drawn is shown.

use super::{Console, ConsoleError, Next};
use crate::live::{Feed, FinishedPicture, Step, StreamError};
use std::time::{Duration, Instant};

/// The stream has so long at a time before hands are asked again.
const SHARE: Duration = Duration::from_millis(4);
/// Faults of a device without a picture in between, after which it is opened anew.
const FAULTS: u32 = 5;
/// Between two looks at the statistics.
const SECOND: Duration = Duration::from_secs(1);
/// A source that says nothing for so long is said to.
pub(super) const SILENCE: Duration = Duration::from_secs(3);

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
        let listens = matches!(self.supply.condition(), super::super::source_supervisor::Condition::Open);
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
