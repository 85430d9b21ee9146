//! Cuts: a contour that is drawn on a rendering takes away what lies along the view within it, or outside of it.

use super::{Change, Controls, drawable};
use crate::scene::{KeptSide, MAX_CUTS, Scene, Settings};
use crate::ui::command::Command;

/// Most points of a contour in work. A drag longer than that goes on without more.
const MAX_OUTLINE: usize = 20_000;

/// Why a mode or a control does nothing.
pub const CUTS_IN_THE_WAY: &str =
    "That draws both what is dark and what is bright, of which nothing can be cut: remove the cuts first (Shift+F).";

/// True if settings cannot be drawn with their cuts, and can without.
pub(super) fn is_in_the_way(now: &Scene, settings: Settings) -> bool {
    let has_cuts = !settings.cuts.is_empty();
    has_cuts && drawable(now, Settings { cuts: Vec::new(), ..settings }).is_some()
}

impl Controls {
    /// The contour in work, pixels of the picture.
    pub fn outline(&self) -> &[[f64; 2]] {
        &self.outline
    }

    /// The side of the next contour that stays.
    pub fn kept_side(&self) -> KeptSide {
        self.kept_side
    }

    /// Applies a command about cuts; none if it is about something else, which leaves the contour in work.
    pub(super) fn cut(&mut self, command: &Command, scene: Option<&Scene>) -> Option<Change> {
        Some(match *command {
            Command::BeginCut(at) if is_position(at) => {
                self.outline = vec![at];
                Change::Marks
            }
            Command::CutAlong(at) if is_position(at) && !self.outline.is_empty() => {
                if self.outline.len() < MAX_OUTLINE {
                    self.outline.push(at);
                }
                Change::Marks
            }
            Command::EndCut => {
                let outline = std::mem::take(&mut self.outline);
                match scene.filter(|_| !outline.is_empty()) {
                    Some(scene) => self.cut_along(command, &outline, scene),
                    None => Change::Nothing,
                }
            }
            Command::KeepSide(side) if side != self.kept_side => {
                self.kept_side = side;
                Change::Tool
            }
            Command::ClearCuts if !self.settings.cuts.is_empty() => {
                let before = self.settings.clone();
                self.settings.cuts.clear();
                self.history.record(before, command);
                Change::Settings
            }
            Command::CancelCut if !self.outline.is_empty() => {
                self.outline.clear();
                Change::Marks
            }
            Command::CancelCut
            | Command::BeginCut(_)
            | Command::CutAlong(_)
            | Command::KeepSide(_)
            | Command::ClearCuts => Change::Nothing,
            _ => {
                self.outline.clear();
                return None;
            }
        })
    }

    fn cut_along(&mut self, command: &Command, outline: &[[f64; 2]], scene: &Scene) -> Change {
        if self.settings.cuts.len() >= MAX_CUTS {
            return Change::Refused("There are as many cuts as a scene can have: remove them, or take one back.");
        }
        if !(scene.composites() || scene.detects_surface() || scene.projects()) {
            return Change::Refused("Cuts are made on a rendering: the block shows all of the volume.");
        }
        let Some(cut) = scene.cut_along(outline, self.kept_side) else {
            return Change::Refused("The contour is too small, or beside the volume.");
        };
        let mut new = self.settings.clone();
        new.cuts.push(cut);
        let now = self.current(scene);
        match now.and_then(|now| drawable(&now, new)) {
            Some(settings) => {
                let before = std::mem::replace(&mut self.settings, settings);
                self.history.record(before, command);
                Change::Settings
            }
            None => Change::Refused("Nothing can be cut where both what is dark and what is bright is drawn."),
        }
    }
}

fn is_position(at: [f64; 2]) -> bool {
    at.iter().all(|n| n.is_finite())
}
