//! The turntable of the view: the rendering turns by itself, as long as nobody turns it by hand.

use super::Console;
use crate::command::Command;
use crate::controls::Change;
use crate::plan::Work;
use crate::texts;
use std::time::{Duration, Instant};

/// Speed, degrees a second: a turn takes twelve seconds.
const SPEED: f64 = 30.0;
/// Time that one picture turns by at most: after a long one the view goes on from where it is.
const LONGEST: Duration = Duration::from_millis(250);
/// Time between two pictures at least.
const SHORTEST: Duration = Duration::from_millis(16);

impl Console {
    /// Begins to turn, or ends it.
    pub(super) fn toggle_turning(&mut self, now: Instant) {
        let turns = self.stream.scene().is_some_and(|scene| !scene.is_flat());
        match (self.turning.take(), turns) {
            (Some(_), _) => {}
            (None, true) => self.turning = Some(now),
            (None, false) => self.notify(texts::NOTHING_TURNS, true),
        }
    }

    /// A command of the user that turns the view ends the turntable.
    pub(super) fn stop_turning_for(&mut self, command: &Command) {
        let turns = matches!(
            command,
            Command::Rotate(_)
                | Command::LookFrom(_)
                | Command::Roll(_)
                | Command::Reset
                | Command::Undo
                | Command::Redo
        );
        if turns && self.turning.take().is_some() {
            self.needs_redraw = true;
        }
    }

    /// Turns on by the time since the last step. The picture before is finished first: a slow device turns in larger steps.
    pub(super) fn turn(&mut self, now: Instant) {
        let Some(last) = self.turning.filter(|last| now.saturating_duration_since(*last) >= SHORTEST) else { return };
        if self.stream.is_drawing() || !self.stream.is_idle() {
            return;
        }
        let by = SPEED * now.saturating_duration_since(last).min(LONGEST).as_secs_f64();
        self.turning = Some(now);
        let is_flat = self.stream.scene().is_none_or(|scene| scene.is_flat());
        match self.controls.apply(&Command::Rotate([by, 0.0]), self.stream.scene()) {
            Change::Settings => {
                self.last_change = now;
                self.pace.moved(Work::Rays, now);
            }
            // The mode has nothing that turns.
            _ if is_flat => (self.turning, self.needs_redraw) = (None, true),
            _ => {}
        }
    }

    /// When the next step is due, while the view turns.
    pub(super) fn turns_at(&self) -> Option<Instant> {
        self.turning.map(|last| last + SHORTEST)
    }
}
