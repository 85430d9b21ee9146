//! When the user last acted and changed something, and how long an input waits for the picture that shows its effect.

use std::time::{Duration, Instant};

/// A pause after which the same drag or key is another step for undo.
const STEP_PAUSE: Duration = Duration::from_millis(500);

/// A picture that takes longer is said to be drawn.
const PATIENCE: Duration = Duration::from_millis(500);

/// Times of the user's last actions, and of those whose effect no picture shows yet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Activity {
    /// Time of the user's last action.
    pub(super) acted: Instant,
    changed: Instant,
    /// The first input whose settings are not sent to the stream yet.
    unsent: Option<Instant>,
    /// The first input that no picture shows yet, and when its settings were sent to the stream.
    unshown: Option<(Instant, Instant)>,
}

impl Activity {
    pub(super) fn new(now: Instant) -> Activity {
        Activity { acted: now, changed: now, unsent: None, unshown: None }
    }

    /// Notes that the user did something.
    pub(super) fn acts(&mut self, now: Instant) {
        self.acted = self.acted.max(now);
    }

    /// Notes that settings, or marks on the picture, were changed.
    pub(super) fn changes(&mut self, now: Instant) {
        self.changed = now;
    }

    /// Notes that settings were changed, the effect of which a picture will show.
    pub(super) fn changes_settings(&mut self, now: Instant) {
        self.changes(now);
        self.awaits_picture(now);
    }

    /// Notes that a picture will show the effect of what the user did.
    pub(super) fn awaits_picture(&mut self, now: Instant) {
        self.unsent.get_or_insert(now);
    }

    /// True if the last change was so long ago that the next one becomes a step of undo of its own.
    pub(super) fn has_paused(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.changed) > STEP_PAUSE
    }

    /// Notes that settings were sent to the stream.
    pub(super) fn settings_sent(&mut self, now: Instant) {
        let first = self.unsent.take().or(self.unshown.map(|(input, _)| input));
        self.unshown = first.map(|input| (input, now));
    }

    /// Time from which on the window says that the picture with the effect of the user's action is being drawn. None if no such picture is
    /// awaited.
    pub(super) fn says_it_works_at(&self) -> Option<Instant> {
        let since = self.unshown.map(|(input, _)| input).or(self.unsent)?;
        Some(since + PATIENCE)
    }

    /// Notes that a picture is shown whose drawing began at the time `begun`. Returns the time of the first input whose effect it shows; None if
    /// it shows none.
    pub(super) fn answered_by(&mut self, begun: Option<Instant>) -> Option<Instant> {
        let answered = self.unshown.take_if(|(_, sent)| begun.is_some_and(|begun| begun >= *sent));
        answered.map(|(input, _)| input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents latencies of a picture that was begun before the settings of the input, or of a later input than the first.
    #[test]
    fn the_first_input_is_answered_by_the_first_picture_begun_after_its_settings() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let mut activity = Activity::new(begin);
        activity.settings_sent(at(1));
        assert_eq!(activity.answered_by(Some(at(2))), None, "the settings of nobody's input");
        activity.changes_settings(at(10));
        activity.changes_settings(at(12));
        assert_eq!(activity.answered_by(Some(at(13))), None, "not sent yet");
        activity.settings_sent(at(14));
        assert_eq!(activity.says_it_works_at(), Some(at(510)), "counted from the first input");
        assert_eq!(activity.answered_by(None), None);
        assert_eq!(activity.answered_by(Some(at(13))), None, "of earlier settings");
        // The view rests and is drawn in full: the input still waits.
        activity.settings_sent(at(20));
        assert_eq!(activity.answered_by(Some(at(15))), None);
        assert_eq!(activity.answered_by(Some(at(20))), Some(at(10)));
        assert_eq!(activity.answered_by(Some(at(30))), None, "once");
        assert_eq!(activity.says_it_works_at(), None);
    }

    #[test]
    fn half_a_second_without_a_change_begins_another_step() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let mut activity = Activity::new(begin);
        activity.changes(at(100));
        activity.awaits_picture(at(500));
        assert!(!activity.has_paused(at(600)) && activity.has_paused(at(601)));
        activity.acts(at(700));
        activity.acts(at(650));
        assert_eq!(activity.acted, at(700), "inputs may be handled late");
    }
}
