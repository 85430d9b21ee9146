//! Undo and redo: the settings before each change. A drag or a held key is one step.

use crate::command::Command;
use crate::scene::Settings;

/// Most steps that can be undone.
const MAX_STEPS: usize = 100;
/// Most steps of a recording that is not shown: settings with many cuts take up to 400 KiB each.
const MAX_KEPT: usize = 20;

/// Undo and redo: the settings before each step, and those of steps that were undone.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    past: Vec<Settings>,
    future: Vec<Settings>,
    /// The command of the last step, while further commands may continue it.
    last: Option<Command>,
}

impl History {
    /// Stores the settings before a change by a command. Steps that were undone can then no longer be redone.
    pub(super) fn record(&mut self, before: Settings, command: &Command) {
        self.future.clear();
        let goes_on = self.last.as_ref().is_some_and(|last| command.continues(last));
        self.last = Some(*command);
        if goes_on {
            return;
        }
        if self.past.len() == MAX_STEPS {
            self.past.remove(0);
        }
        self.past.push(before);
    }

    /// Makes the next change a step of its own, even if it continues the last one.
    pub(super) fn seal(&mut self) {
        self.last = None;
    }

    /// Returns the settings before the last step; None if there is none. `now`: the present settings, which [`History::redo`] restores.
    pub(super) fn undo(&mut self, now: &Settings) -> Option<Settings> {
        self.last = None;
        let before = self.past.pop()?;
        self.future.push(now.clone());
        Some(before)
    }

    /// Returns the settings after the step that was undone last; None if there is none. `now`: the present settings, which undo restores.
    pub(super) fn redo(&mut self, now: &Settings) -> Option<Settings> {
        self.last = None;
        let after = self.future.pop()?;
        self.past.push(now.clone());
        Some(after)
    }

    /// True if there is a step to undo; true if there is one to redo.
    pub(super) fn has(&self) -> [bool; 2] {
        [!self.past.is_empty(), !self.future.is_empty()]
    }

    /// Removes all steps except for the last ones.
    pub(super) fn shorten(&mut self) {
        for steps in [&mut self.past, &mut self.future] {
            steps.drain(..steps.len().saturating_sub(MAX_KEPT));
            steps.shrink_to_fit();
        }
        self.last = None;
    }

    /// Removes all steps, because the settings now belong to another source.
    pub(super) fn clear(&mut self) {
        *self = History::default();
    }
}
