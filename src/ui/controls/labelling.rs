//! Labels: the edits of a label volume are steps of undo like any other change.

use super::{Change, Controls};
use crate::command::Command;
use crate::labelling::{LabelCommand, Labelling};
use crate::segment::Labels;
use crate::source::segmentation::Segment;
use crate::texts;
use std::sync::Arc;

impl Controls {
    /// The labels that can be edited; None until the tool was chosen.
    pub fn labelling(&self) -> Option<&Labelling> {
        self.labelling.as_ref()
    }

    /// Makes labels editable: those that are shown, or empty ones.
    pub(crate) fn begin_labels(&mut self, labelling: Labelling) {
        self.labelling = Some(labelling);
    }

    /// Begins or goes on with an edit of the labels.
    pub(crate) fn edit_labels(&mut self, edit: impl FnOnce(&mut Labelling)) {
        if let Some(labelling) = &mut self.labelling {
            edit(labelling);
        }
    }

    /// Ends the edit of labels in progress, which becomes a step of undo. Returns false if nothing was changed.
    pub(crate) fn end_edit_of_labels(&mut self) -> bool {
        let Some(patch) = self.labelling.as_mut().and_then(Labelling::end) else { return false };
        self.history.record_labels(patch);
        self.show_labels();
        true
    }

    /// Lets the picture show the labels as they are now. Returns false if it shows them already.
    pub(crate) fn show_labels(&mut self) -> bool {
        let Some(shown) = self.labelling.as_mut().and_then(Labelling::take_shown) else { return false };
        self.settings.labels.volume = shown;
        true
    }

    /// The labels and their segments; None until the tool was chosen, and if no voxel has a label.
    pub(crate) fn labels_to_export(&self) -> Option<(Arc<Labels>, Vec<Segment>)> {
        self.labelling.as_ref().and_then(Labelling::parts)
    }

    /// The labels and their segments, if they are not those that were there at the start; the inner None: no voxel has one.
    pub(crate) fn edited_labels(&self) -> Option<Option<(Arc<Labels>, Vec<Segment>)>> {
        let [shown, start] = [&self.settings, &self.start].map(|settings| &settings.labels.volume);
        (shown != start).then(|| self.labels_to_export())
    }

    /// Applies a command about labels. None if the command is about something else.
    pub(super) fn label(&mut self, command: &Command) -> Option<Change> {
        let Command::Labels(of_labels) = *command else { return None };
        // The caller knows where the planes and the surface are, and has threads.
        if matches!(of_labels, LabelCommand::Stroke(..) | LabelCommand::EndStroke | LabelCommand::Fill(_)) {
            return Some(Change::Caller(*command));
        }
        let Some(labelling) = &mut self.labelling else { return Some(Change::Refused(texts::NO_LABELS_YET)) };
        match of_labels {
            LabelCommand::Effect(effect) => labelling.effect = effect,
            LabelCommand::Ball(is_ball) => labelling.is_ball = is_ball,
            LabelCommand::Choose(label) => labelling.chosen = label,
            LabelCommand::Add if !labelling.add() => return Some(Change::Refused(texts::TOO_MANY_LABELS)),
            _ => {}
        }
        Some(Change::Tool)
    }
}
