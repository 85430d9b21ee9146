//! The turntable: the rendering rotates by itself until the user rotates it.

use crate::command::Command;
use std::time::{Duration, Instant};

/// Speed, degrees a second: a turn takes twelve seconds.
const SPEED: f64 = 30.0;
/// Time that one picture turns by at most: after a long one the view goes on from where it is.
const LONGEST: Duration = Duration::from_millis(250);
/// Time between two pictures at least.
const SHORTEST: Duration = Duration::from_millis(16);

/// The continuous rotation of the view: the time of its last step, None while it is off.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turntable(Option<Instant>);

impl Turntable {
    pub(super) fn is_on(&self) -> bool {
        self.0.is_some()
    }

    pub(super) fn begin(&mut self, now: Instant) {
        self.0 = Some(now);
    }

    /// Stops the turntable. Returns false if it did not run.
    pub(super) fn stop(&mut self) -> bool {
        self.0.take().is_some()
    }

    /// Stops the turntable if the command rotates the view. Returns true if it was stopped.
    pub(super) fn stop_for(&mut self, command: &Command) -> bool {
        use Command::{LookFrom, Redo, Reset, Roll, Rotate, Undo, UndoAll};
        matches!(command, Rotate(_) | LookFrom(_) | Roll(_) | Reset | Undo | UndoAll | Redo) && self.stop()
    }

    /// Angle by which to rotate the view now, degrees, for the time since the last step; None if no step is due. `can_draw`: the previous
    /// picture is finished. On a slow device steps are larger.
    pub(super) fn step(&mut self, can_draw: bool, now: Instant) -> Option<f64> {
        let passed = now.saturating_duration_since(self.0?);
        if passed < SHORTEST || !can_draw {
            return None;
        }
        self.0 = Some(now);
        Some(SPEED * passed.min(LONGEST).as_secs_f64())
    }

    /// Time of the next step; None while the turntable is off.
    pub(super) fn due(&self) -> Option<Instant> {
        self.0.map(|last| last + SHORTEST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents a view that leaps after a long picture, or turns against the hand of the user.
    #[test]
    fn the_view_turns_by_the_time_that_passed_until_the_user_turns_it() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let mut turntable = Turntable::default();
        assert_eq!((turntable.step(true, at(0)), turntable.due()), (None, None));
        turntable.begin(at(0));
        assert_eq!(turntable.step(true, at(15)), None);
        assert_eq!(turntable.step(false, at(50)), None, "a picture is being drawn");
        assert_eq!(turntable.step(true, at(100)), Some(3.0));
        assert_eq!(turntable.due(), Some(at(116)));
        assert_eq!(turntable.step(true, at(60_000)), Some(7.5), "time that was lost is not caught up");
        assert!(!turntable.stop_for(&Command::Freeze) && turntable.is_on());
        assert!(turntable.stop_for(&Command::Rotate([1.0, 0.0])) && !turntable.stop() && !turntable.is_on());
    }
}
