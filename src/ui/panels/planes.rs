//! The inspector's part for planes: which one is moved, where they cross, and their look.

use super::names::{self, Tell};
use super::widgets::{row_of, slider, switch};
use super::{Execute, PanelState, ROW_HEIGHT, SMALL_TEXT, tools};
use crate::command::Command;
use crate::scene::{Group, Mode, PlaneName};
use crate::sliders::SLIDERS;
use crate::texts;
use egui::{Button, Label, RichText, Ui, vec2};

pub(super) fn show(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let settings = state.controls.settings();
    let has_planes = settings.mode.is_flat() || settings.layout.has_planes();
    tools::curve(ui, state, width, execute);
    if has_planes && settings.mode != Mode::Orthogonal {
        let about = |plane: PlaneName| (Command::Plane(plane), [plane.letter(), texts::PLANE_HINT]);
        let planes = [PlaneName::A, PlaneName::B, PlaneName::C].map(about);
        let is_chosen = |command| command == Command::Plane(settings.planes.plane);
        row_of(ui, texts::PLANE, &planes, (3, width), is_chosen, execute);
    }
    if has_planes {
        let recentre = Button::new(texts::RECENTRE_PLANES).min_size(vec2(width, ROW_HEIGHT));
        ui.add(recentre).tell(texts::RECENTRE_PLANES_HINT).gives(Command::Recentre, execute);
    } else {
        let text = RichText::new(texts::NO_PLANES).size(SMALL_TEXT).color(super::colours::WEAK_TEXT);
        ui.add(Label::new(text).wrap());
    }
    if settings.mode == Mode::Tomography {
        switch(ui, settings.planes.reference, texts::REFERENCE_PICTURE, Command::Reference, execute);
    }
    names::group(ui, texts::PLANES, |ui| {
        for (number, control) in SLIDERS.iter().enumerate() {
            if control.group == Group::Planes && control.applies(settings) {
                slider(ui, state, number, control.name, execute);
            }
        }
    });
}
