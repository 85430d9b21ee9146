//! Playback of the cine loop: its marks, speed and direction. The picture does not change.

use super::{Change, Controls};
use crate::cine_player::{marked, stepped};
use crate::command::Command;
use crate::scene::Cine;

impl Controls {
    /// Applies a command about playback that can be done without the volumes. None if the command is about something else.
    pub(super) fn play(&mut self, command: &Command) -> Option<Change> {
        let now = self.settings.drawn.cine;
        let cine = match *command {
            Command::WholeCine => Cine { first: None, last: None, ..now },
            Command::CineSpeed(by) => Cine { speed: stepped(now.speed, by), ..now },
            Command::BackAndForth(on) => Cine { back_and_forth: on, ..now },
            _ => return None,
        };
        Some(self.play_as(cine, command))
    }

    /// Makes the volume of this number the first (`end` false) or the last one of the cine loop that is played.
    pub(crate) fn mark_cine(&mut self, volume: u32, end: bool) -> Change {
        self.play_as(marked(self.settings.drawn.cine, volume, end), &Command::MarkCine(end))
    }

    fn play_as(&mut self, cine: Cine, command: &Command) -> Change {
        if cine == self.settings.drawn.cine {
            return Change::Nothing;
        }
        self.mark(command, |settings| settings.drawn.cine = cine)
    }
}
