//! Undo and redo: the settings before each change, or the labels that it changed. A drag or a held key is one step.

use crate::command::Command;
use crate::scene::Settings;
use crate::segment::Patch;

/// Most steps that can be undone.
const MAX_STEPS: usize = 100;
/// Most steps of a recording that is not shown: settings with many cuts take up to 400 KiB each.
const MAX_KEPT: usize = 20;
/// Most bytes of all edits of labels that can be undone: a hundred dabs of the widest brush, 81 voxels of 0.5 mm along each edge of their boxes,
/// take 53 MB.
const MAX_BYTES: usize = 64 << 20;

/// A step that can be undone.
#[derive(Clone, Debug)]
enum Step {
    /// The settings before it, without labels.
    Settings(Box<Settings>),
    /// What of the labels was other before it.
    Labels(Patch),
}

impl Step {
    fn of(settings: &Settings) -> Step {
        let mut settings = settings.clone();
        // They are not undone by settings, and each would keep a volume.
        settings.labels.volume = None;
        Step::Settings(settings.into())
    }

    /// Bytes of labels.
    fn bytes(&self) -> usize {
        if let Step::Labels(patch) = self { patch.bytes() } else { 0 }
    }
}

/// Undo and redo: what was before each step, and before those that were undone.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    past: Vec<Step>,
    future: Vec<Step>,
    /// The command of the last step, while further commands may continue it.
    last: Option<Command>,
}

impl History {
    /// Stores the settings before a change by a command. Steps that were undone can then no longer be redone.
    pub(super) fn record(&mut self, before: Settings, command: &Command) {
        self.future.clear();
        let goes_on = self.last.as_ref().is_some_and(|last| command.continues(last));
        self.last = Some(*command);
        if !goes_on {
            self.push(Step::of(&before));
        }
    }

    fn push(&mut self, step: Step) {
        self.past.push(step);
        if self.past.len() > MAX_STEPS {
            self.past.remove(0);
        }
    }

    /// Stores what an edit of labels changed. Where edits take too many bytes, the oldest can no longer be undone.
    pub(super) fn record_labels(&mut self, patch: Patch) {
        (self.last, self.future) = (None, Vec::new());
        self.push(Step::Labels(patch));
        while self.past.iter().map(Step::bytes).sum::<usize>() > MAX_BYTES {
            let oldest = self.past.iter().position(|step| step.bytes() > 0);
            oldest.into_iter().for_each(|n| _ = self.past.remove(n));
        }
    }

    /// Makes the next change a step of its own, even if it continues the last one.
    pub(super) fn seal(&mut self) {
        self.last = None;
    }

    /// Goes a step back, or forth again: returns the settings to go to, where the inner None means that `exchange` was called for the labels.
    /// None if there is no step. `now`: the present settings, to which the opposite step returns.
    pub(super) fn travel(
        &mut self,
        back: bool,
        now: &Settings,
        exchange: impl FnOnce(&mut Patch),
    ) -> Option<Option<Settings>> {
        self.last = None;
        let [from, to] = match back {
            true => [&mut self.past, &mut self.future],
            false => [&mut self.future, &mut self.past],
        };
        match from.pop()? {
            Step::Settings(settings) => {
                to.push(Step::of(now));
                Some(Some(*settings))
            }
            Step::Labels(mut patch) => {
                exchange(&mut patch);
                to.push(Step::Labels(patch));
                Some(None)
            }
        }
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
