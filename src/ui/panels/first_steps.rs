//! The hints of the first start: a card in the lower left part of the picture.

use super::annotations::MIN_FOR_AXES;
use super::colours::{ACCENT, MESSAGE, TEXT};
use super::names::{self, Tell};
use super::widgets::cell;
use super::{Execute, PanelState, ROW_HEIGHT, SMALL_TEXT, TEXT_SIZE, picture_rect};
use crate::command::Command;
use crate::texts;
use egui::accesskit::Role;
use egui::{Align2, Area, Button, Frame, Id, Label, Margin, Order, RichText, Stroke, Ui, vec2};

/// A smaller picture has no hints, points: they would hide it.
const MIN_PICTURE: [f32; 2] = [360.0, 280.0];
/// Width of the card without its margins, points.
const WIDTH: f32 = 320.0;
/// Between the card and the lower edge of the picture, where the letter of that edge is, points.
const BELOW: f32 = 40.0;
/// The same where the axes are in that corner.
const ABOVE_AXES: f32 = 118.0;
/// Between the card and the left edge, where a letter is, points.
const BESIDE: f32 = 28.0;

/// True if the hints of the first start fit into a picture of this size, pixels. `scale`: pixels per point.
pub(crate) fn has_room(picture: [u32; 2], scale: f32) -> bool {
    let [width, height] = picture.map(|edge| edge as f32 / scale);
    width >= MIN_PICTURE[0] && height >= MIN_PICTURE[1]
}

pub(super) fn show(ui: &Ui, state: &PanelState, scale: f32, execute: Execute) {
    let picture = picture_rect(state, scale);
    let below = if picture.width().min(picture.height()) >= MIN_FOR_AXES { ABOVE_AXES } else { BELOW };
    let at = picture.left_bottom() + vec2(BESIDE, -below);
    let area = Area::new(Id::new(texts::FIRST_STEPS)).order(Order::Middle).pivot(Align2::LEFT_BOTTOM).fixed_pos(at);
    area.show(ui.ctx(), |ui| {
        names::name(ui, Role::Group, texts::FIRST_STEPS);
        let frame = Frame::new().fill(MESSAGE).inner_margin(Margin::symmetric(14, 10)).corner_radius(8);
        frame.stroke(Stroke::new(2.0, ACCENT)).show(ui, |ui| {
            ui.set_width(WIDTH);
            ui.spacing_mut().item_spacing.y = 4.0;
            ui.spacing_mut().interact_size.y = TEXT_SIZE;
            for (action, effect) in texts::HINTS {
                ui.horizontal(|ui| {
                    let action = RichText::new(action).color(ACCENT).size(SMALL_TEXT);
                    cell(ui, vec2(64.0, TEXT_SIZE + 4.0), |ui| _ = ui.add(Label::new(action)));
                    ui.add(Label::new(RichText::new(effect).color(TEXT).size(SMALL_TEXT)));
                });
            }
            let close = Button::new(texts::CLOSE_BUTTON).min_size(vec2(WIDTH, ROW_HEIGHT));
            ui.add(close).tell(texts::CLOSE_HINTS_HINT).named(texts::CLOSE).gives(Command::CloseHints, execute);
        });
    });
}
