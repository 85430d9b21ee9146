//! The start of the view: the steps before the first picture, and the text about them on the screen.

use super::first_steps::FirstSteps;
use crate::live::StartStep;
use crate::panels::Banner;
use crate::texts;
use std::time::{Duration, Instant};

/// Longest that the screen says less of the start than is known: each drawing of it takes the processor from what it tells of.
const START_INTERVAL: Duration = Duration::from_millis(100);

/// How far the start of the view is, and what the screen says about it.
#[derive(Debug)]
pub(super) struct Start {
    /// The step that the screen names, and since when.
    step: Option<StartStep>,
    step_at: Instant,
    /// Whether the screen says that the first picture is being drawn.
    tells_of_picture: bool,
    /// Whether a picture was drawn in full.
    pub(super) is_over: bool,
    pub(super) first_steps: FirstSteps,
}

impl Start {
    pub(super) fn new(first_steps: FirstSteps, now: Instant) -> Start {
        Start { step: None, step_at: now, tells_of_picture: false, is_over: false, first_steps }
    }

    /// True once, before the first picture is drawn: the screen has to announce it first, because panels cannot be presented while the device
    /// draws.
    pub(super) fn tells_first(&mut self, step: Option<StartStep>) -> bool {
        let is_first = !self.tells_of_picture && step == Some(StartStep::Picture);
        self.tells_of_picture |= is_first;
        is_first
    }

    /// Notes that a picture is finished. `is_coarse`: it was drawn with few rays.
    pub(super) fn picture_finished(&mut self, is_coarse: bool) {
        if !self.is_over {
            tracing::debug!("start: a picture {}", if is_coarse { "with few rays" } else { "in full" });
        }
        self.is_over |= !is_coarse;
    }

    /// Notes the present step of the stream. Returns true if the screen has to name it.
    pub(super) fn follow(&mut self, step: Option<StartStep>, now: Instant) -> bool {
        let kind = |step: Option<StartStep>| step.map(|step| std::mem::discriminant(&step));
        let is_due = now.saturating_duration_since(self.step_at) >= START_INTERVAL;
        let is_said = kind(step) != kind(self.step) || (step != self.step && is_due);
        if is_said {
            (self.step, self.step_at) = (step, now);
        }
        is_said
    }

    /// Writes to the log what the screen says about the start.
    pub(super) fn presented(&self) {
        if let Some(step) = self.step.filter(|_| !self.is_over) {
            tracing::debug!("start: the screen says {step:?}");
        }
    }

    /// The banner about the present step; None if the message about the source covers it. `title`: what the source does, the title while frames
    /// are awaited.
    pub(super) fn banner(&self, title: &str) -> Option<Banner> {
        let banner = |title: &str, text: &str| Banner { title: title.into(), text: text.into(), is_fault: false };
        Some(match self.step? {
            StartStep::Compiling { count: 0, .. } => banner(texts::PREPARING_THE_DEVICE, ""),
            StartStep::Compiling { done, count } => {
                banner(texts::PREPARING_THE_DEVICE, &texts::shaders_compiled(done, count))
            }
            StartStep::Frames { done: 0, .. } => banner(title, texts::WAITING_FOR_FRAME),
            StartStep::Frames { done, count } => banner(title, &texts::frames_of_first_volume(done, count)),
            StartStep::Picture => banner(texts::DRAWING_FIRST_PICTURE, ""),
            StartStep::Source => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a start that takes longer because the screen tells of every frame, and one that does not say what it does.
    #[test]
    fn the_screen_says_another_step_at_once_and_progress_ten_times_a_second() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let frames = |done| Some(StartStep::Frames { done, count: 9 });
        let mut start = Start::new(FirstSteps::default(), begin);
        assert!(start.banner("Waiting").is_none() && !start.follow(None, at(0)));
        assert!(start.follow(Some(StartStep::Source), at(1)) && start.follow(frames(0), at(2)));
        assert!(!start.follow(frames(1), at(50)), "a moment later");
        assert!(start.follow(frames(5), at(102)) && !start.follow(frames(5), at(900)));
        assert_eq!(start.banner("Waiting").map(|banner| banner.title).as_deref(), Some("Waiting"));
        assert!(start.follow(Some(StartStep::Picture), at(103)));
        assert!(!start.tells_first(frames(9)) && start.tells_first(Some(StartStep::Picture)), "before it is drawn");
        assert!(!start.tells_first(Some(StartStep::Picture)), "once");
        start.picture_finished(true);
        assert!(!start.is_over, "it has few rays");
        start.picture_finished(false);
        start.picture_finished(true);
        assert!(start.is_over);
    }
}
