//! The hints of the first start: when they are shown, and that they do not come again.

use super::Console;
use crate::command::Command;
use crate::files;
use crate::panels::first_steps;
use std::path::{Path, PathBuf};

/// The hints of the first start.
#[derive(Debug, Default)]
pub(super) struct FirstSteps {
    /// The file that keeps that they were shown. None: they are not to be shown.
    file: Option<PathBuf>,
    is_shown: bool,
}

impl FirstSteps {
    pub(super) fn new(file: Option<PathBuf>) -> FirstSteps {
        FirstSteps { file, is_shown: false }
    }

    /// Shows them if that is due, and keeps that they were shown. True while they are.
    fn show(&mut self) -> bool {
        let Some(file) = &self.file else { return false };
        if !std::mem::replace(&mut self.is_shown, true) {
            keep(file);
        }
        true
    }

    /// Ends them with the first action of the user. True if the command was meant for them alone.
    fn end(&mut self, command: &Command) -> bool {
        if !std::mem::take(&mut self.is_shown) {
            return *command == Command::CloseHints;
        }
        self.file = None;
        matches!(command, Command::CloseHints | Command::Back)
    }
}

/// Keeps that the hints were shown. That it cannot be written is no fault of the view.
fn keep(file: &Path) {
    let folder = file.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|e| e.to_string());
    if let Err(why) = folder.and_then(|()| files::replace(file, b"")) {
        tracing::debug!("that the hints were shown is not kept: {why}");
    }
}

impl Console {
    /// True if the hints of the first start are shown now: over a picture, while nothing else is.
    pub(super) fn shows_first_steps(&mut self, is_free: bool) -> bool {
        let is_seen = self.fixed.overlay && self.shows_panels && !self.fixed.is_kiosk;
        let has_room = first_steps::has_room(self.picture_area().1, self.panels.scale());
        let is_open = self.shows_help
            || self.shows_times
            || self.shows_exports
            || self.asks_to_leave
            || self.opening.is_shown()
            || self.presets.is_shown()
            || (self.rail.is_open && self.has_drawer());
        is_free && is_seen && has_room && !is_open && self.notes.is_empty() && self.first_steps.show()
    }

    /// Ends the hints of the first start. True if the command does nothing else.
    pub(super) fn end_first_steps(&mut self, command: &Command) -> bool {
        let is_done = self.first_steps.end(command);
        self.needs_redraw |= is_done;
        is_done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents hints that come again, that outlive the first action, or that are shown where nothing is kept.
    #[test]
    fn hints_are_shown_once_and_go_with_the_first_action() {
        let folder = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-test-").expect("a folder");
        let file = folder.path().join("state/hints-shown");
        for (command, is_for_them) in
            [(Command::CloseHints, true), (Command::Back, true), (Command::Freeze, false), (Command::ToggleHelp, false)]
        {
            let mut hints = FirstSteps::new(Some(file.clone()));
            assert!(!hints.end(&Command::Freeze), "before the first picture actions are not for them");
            assert!(hints.show() && hints.show());
            assert!(file.exists(), "kept as soon as they are seen");
            assert_eq!(hints.end(&command), is_for_them, "{command:?}");
            assert!(!hints.show() && !hints.end(&Command::Back), "{command:?}: they are gone");
        }
        assert!(!FirstSteps::new(None).show());
        // A folder that cannot be written.
        let mut hints = FirstSteps::new(Some("/proc/none/hints-shown".into()));
        assert!(hints.show());
    }
}
