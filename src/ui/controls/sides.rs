//! The patient's sides and the probe's marker, as the user states them, and the bar of saved pictures. They are drawn over and below the rendered
//! picture, which does not change.

use super::{Change, Controls};
use crate::command::Command;

impl Controls {
    /// Applies a command about the letters of the patient's sides, the probe's marker or the bar of saved pictures.
    pub(super) fn mark_sides(&mut self, command: &Command) -> Change {
        let mut marks = self.settings.drawn.marks.clone();
        match *command {
            Command::Sides(axis, sides) => marks = marks.with_sides(axis, sides),
            Command::ExchangeLeftAndRight => marks = marks.left_and_right_exchanged(),
            Command::ProbeMarker(marker) => marks.probe = marker,
            Command::SavesBar(on) => marks.bar = on,
            _ => {}
        }
        if marks == self.settings.drawn.marks {
            return Change::Nothing;
        }
        self.mark(command, |settings| settings.drawn.marks = marks)
    }
}
