//! The options of the tool for labels, and the list of labels with their volumes.

use super::colours::{self, EDGE};
use super::names::{self, Tell};
use super::widgets::{command_button, row_of, switch};
use super::{Execute, PanelState, ROW_HEIGHT, TEXT_SIZE, tools};
use crate::command::{Command, Effect, LabelCommand, Tool};
use crate::scene::{MeasureKind, Measurement};
use crate::texts;
use egui::{Align2, Button, FontId, Rect, RichText, Stroke, StrokeKind, Ui, vec2};

/// Each effect with its name and its hint.
const EFFECTS: [(Effect, [&str; 2]); 4] = [
    (Effect::Paint, texts::PAINT),
    (Effect::Erase, texts::ERASE),
    (Effect::GrowDark, texts::GROW_DARK),
    (Effect::GrowBright, texts::GROW_BRIGHT),
];

/// Shows, while the tool for labels is selected, what it does, the brush, and the labels.
pub(super) fn show(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let is_chosen = state.controls.tool() == Tool::Labels;
    let Some(labels) = state.controls.labelling().filter(|_| is_chosen) else { return };
    names::group(ui, texts::LABELS, |ui| {
        ui.set_max_width(width);
        let choose = |effect| Command::Labels(LabelCommand::Effect(effect));
        let effects = EFFECTS.map(|(effect, about)| (choose(effect), about));
        row_of(ui, texts::LABELS, &effects, (2, width), |command| command == choose(labels.effect), execute);
        if matches!(labels.effect, Effect::Paint | Effect::Erase) {
            tools::brush_radius(ui, state, execute);
            let about = [texts::SPHERE_BRUSH, texts::SPHERE_BRUSH_HINT];
            switch(ui, labels.is_ball, about, |is_ball| Command::Labels(LabelCommand::Ball(is_ball)), execute);
        }
        let size = vec2(width, ROW_HEIGHT);
        for (segment, volume) in labels.volumes() {
            // The name begins after the colour.
            let name = RichText::new(format!("       {}", segment.name));
            let button = Button::selectable(segment.label == labels.chosen, name).frame_when_inactive(true);
            let row = ui.add_sized(size, button.right_text("").truncate().min_size(size));
            let colour = Rect::from_center_size(row.rect.left_center() + vec2(18.0, 0.0), vec2(14.0, 14.0));
            let (fill, edge) = (colours::of_scene(segment.colour), Stroke::new(1.0, EDGE));
            ui.painter().rect(colour, 3.0, fill, edge, StrokeKind::Inside);
            let (at, volume) = (row.rect.right_center() - vec2(10.0, 0.0), texts::volume_of_label(volume));
            let text = ui.visuals().widgets.inactive.fg_stroke.color;
            ui.painter().text(at, Align2::RIGHT_CENTER, &volume, FontId::proportional(TEXT_SIZE), text);
            let name = format!("{} {volume}", segment.name);
            row.tell(texts::CHOOSE_LABEL_HINT)
                .named(&name)
                .gives(Command::Labels(LabelCommand::Choose(segment.label)), execute);
        }
        command_button(ui, size, texts::ADD_LABEL, Command::Labels(LabelCommand::Add), execute);
        let has_contours = |(_, measured): &(usize, &Measurement)| measured.kind == MeasureKind::Volume;
        for (n, _) in state.controls.measures().iter().enumerate().filter(has_contours) {
            let (name, fill) = (texts::label_measured(n + 1), Command::Labels(LabelCommand::Fill(n)));
            command_button(ui, size, [&name, texts::LABEL_MEASURED_HINT], fill, execute);
        }
    });
}
