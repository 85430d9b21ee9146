//! The hints of the first start: when they are shown, and that they are shown once.

use crate::command::Command;
use crate::files;
use std::path::{Path, PathBuf};

/// The hints of the first start.
#[derive(Debug, Default)]
pub(super) struct FirstSteps {
    /// The file that records that they were shown; `None`: they are never shown.
    file: Option<PathBuf>,
    is_shown: bool,
}

impl FirstSteps {
    pub(super) fn new(file: Option<PathBuf>) -> FirstSteps {
        FirstSteps { file, is_shown: false }
    }

    /// Shows the hints if they have not been ended, and stores once that they were shown. Returns true while they are shown.
    pub(super) fn show(&mut self) -> bool {
        let Some(file) = &self.file else { return false };
        if !std::mem::replace(&mut self.is_shown, true) {
            keep(file);
        }
        true
    }

    /// Ends the hints at the user's first action. Returns true if the command does nothing but close them.
    pub(super) fn end(&mut self, command: &Command) -> bool {
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
