//! Cuts: a contour drawn on a rendering removes what lies along the view inside or outside of it; a brush removes what is near its strokes.

use super::{Change, Controls, drawable, finite};
use crate::command::{Command, Tool};
use crate::scene::{Brush, Cut, KeptSide, MAX_BRUSH_POINTS, MAX_CUTS, Scene, Settings};
use crate::texts;

/// Most points of a contour in work. A drag longer than that goes on without more.
const MAX_OUTLINE: usize = 20_000;

/// Radius of the brush at the start, mm; [`BRUSH_RADII`] are its limits.
pub(super) const BRUSH_RADIUS: f64 = 4.0;
pub(crate) const BRUSH_RADII: [f64; 2] = [0.5, 20.0];

/// If these settings cannot be drawn because of cuts, the start at the fluid or the start curve: a message that names which of these is the
/// reason, or that they are it together. Otherwise None.
pub(super) fn in_the_way(now: &Scene, settings: &Settings) -> Option<&'static str> {
    // Cuts, the start at the fluid, the curved start line: what of them is left out.
    let ways = [
        ([true, false, false], texts::CUTS_IN_THE_WAY),
        ([false, true, false], texts::UNVEILING_IN_THE_WAY),
        ([false, false, true], texts::CURVE_IN_THE_WAY),
        ([true; 3], texts::SEVERAL_IN_THE_WAY),
    ];
    let can_be_drawn_without = |[cuts, fluid, curve]: [bool; 3]| {
        let mut without = settings.clone();
        without.cuts.retain(|_| !cuts);
        without.unveil.enabled &= !fluid;
        without.region.start_curve.take_if(|_| curve);
        without != *settings && drawable(now, without).is_some()
    };
    ways.into_iter().find(|(left_out, _)| can_be_drawn_without(*left_out)).map(|(_, why)| why)
}

impl Controls {
    /// The contour of a cut that is being drawn: positions in pixels from the picture's upper left corner; empty if none is being drawn.
    pub fn outline(&self) -> &[[f64; 2]] {
        &self.outline
    }

    /// The side of the next contour of a cut that is kept.
    pub(crate) fn kept_side(&self) -> KeptSide {
        self.kept_side
    }

    /// Radius of the brush, mm.
    pub(crate) fn brush_radius(&self) -> f64 {
        self.brush_radius
    }

    /// Ends a stroke of the brush and returns its positions, in pixels of the picture.
    pub(crate) fn take_stroke(&mut self) -> Vec<[f64; 2]> {
        std::mem::take(&mut self.outline)
    }

    /// Applies a command about cuts. None if the command is about something else; the contour that is being drawn is then discarded.
    pub(super) fn cut(&mut self, command: &Command, scene: Option<&Scene>) -> Option<Change> {
        Some(match *command {
            Command::BeginCut(at) if finite(&at) => {
                self.outline = vec![at];
                Change::Marks
            }
            Command::CutAlong(at) if finite(&at) && !self.outline.is_empty() => {
                if self.outline.len() < MAX_OUTLINE {
                    self.outline.push(at);
                }
                Change::Marks
            }
            // The caller knows where the surface is.
            Command::EndCut if self.tool == Tool::Brush => Change::Caller(*command),
            Command::BrushRadius(radius) if radius.is_finite() => {
                self.brush_radius = radius.clamp(BRUSH_RADII[0], BRUSH_RADII[1]);
                Change::Tool
            }
            Command::ScaleBrush(factor) => return self.cut(&Command::BrushRadius(self.brush_radius * factor), scene),
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
                self.put(Settings { cuts: Vec::new(), ..self.settings.clone() }, command)
            }
            Command::CancelCut if !self.outline.is_empty() => {
                self.outline.clear();
                Change::Marks
            }
            Command::CancelCut
            | Command::BeginCut(_)
            | Command::CutAlong(_)
            | Command::BrushRadius(_)
            | Command::KeepSide(_)
            | Command::ClearCuts => Change::Nothing,
            _ => {
                self.outline.clear();
                return None;
            }
        })
    }

    /// Removes tissue near strokes of the brush on the surface. Their positions are lateral, depth, elevation, mm. Strokes with the same radius
    /// become one cut.
    pub(crate) fn brush(&mut self, strokes: Vec<Vec<[f64; 3]>>, scene: &Scene) -> Change {
        let radius = self.brush_radius;
        let mut new = self.settings.clone();
        for mut rest in strokes {
            // A long stroke goes on in the next cut, from the point where it was divided.
            while !rest.is_empty() {
                let stroke: Vec<[f64; 3]> = rest.iter().take(MAX_BRUSH_POINTS).copied().collect();
                rest.drain(..if rest.len() > stroke.len() { stroke.len() - 1 } else { rest.len() });
                let last = new.cuts.last_mut().and_then(|cut| cut.brush.as_mut());
                match last.filter(|last| last.radius == radius && last.points() + stroke.len() <= MAX_BRUSH_POINTS) {
                    Some(last) => last.strokes.push(stroke),
                    None => {
                        new.cuts.push(Cut { brush: Some(Brush { radius, strokes: vec![stroke] }), ..Cut::default() })
                    }
                }
            }
        }
        self.take_cut(new, &Command::EndCut, scene)
    }

    fn cut_along(&mut self, command: &Command, outline: &[[f64; 2]], scene: &Scene) -> Change {
        if self.settings.cuts.len() >= MAX_CUTS {
            return Change::Refused(texts::TOO_MANY_CUTS);
        }
        if !scene.renders() {
            return Change::Refused(texts::CUTS_NEED_RENDERING);
        }
        let Some(cut) = scene.cut_along(outline, self.kept_side) else {
            return Change::Refused(texts::CONTOUR_TOO_SMALL);
        };
        let mut new = self.settings.clone();
        new.cuts.push(cut);
        self.take_cut(new, command, scene)
    }

    /// Takes settings with more cuts.
    fn take_cut(&mut self, new: Settings, command: &Command, scene: &Scene) -> Change {
        if new.cuts.len() > MAX_CUTS {
            return Change::Refused(texts::TOO_MANY_CUTS);
        }
        self.put_if_drawable(new, command, scene, texts::CANNOT_CUT_BOTH)
    }
}
