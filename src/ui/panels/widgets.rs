//! What controls are made of: the sliders of settings, those of other lengths, switches, and the frame of messages.

use super::colours::{ACCENT, BUTTON, MESSAGE, ON_SELECTED, SELECTED, TEXT, WEAK_TEXT};
use super::names::{self, Tell};
use super::{PanelState, TEXT_SIZE, TOUCH_SIZE};
use crate::command::Command;
use crate::scene::Settings;
use crate::sliders::SLIDERS;
use crate::texts;
use egui::accesskit::Role;
use egui::{
    Align, Color32, FontId, Frame, Margin, PointerButton, Rect, RichText, Sense, Slider, Stroke, StrokeKind, Ui,
    WidgetInfo, WidgetType, pos2, vec2,
};

/// Between messages, points.
pub(super) const BETWEEN_MESSAGES: f32 = 8.0;
/// Between messages and the upper and the lower edge of the picture.
pub(super) const MESSAGE_EDGES: [f32; 2] = [12.0, 14.0];

/// The frame of a message with an edge of this colour.
pub(super) fn message_frame(edge: Color32) -> Frame {
    Frame::new().fill(MESSAGE).inner_margin(Margin::symmetric(16, 10)).corner_radius(8).stroke(Stroke::new(2.0, edge))
}

/// The index of the first slider of these keys that the mode has.
pub(super) fn front(keys: &[&str], settings: &Settings) -> Option<usize> {
    keys.iter().find_map(|key| SLIDERS.iter().position(|s| s.key == *key && s.applies(settings)))
}

pub(super) fn slider(
    ui: &mut Ui,
    state: &PanelState,
    number: usize,
    name: &str,
    is_large: bool,
    execute: &mut dyn FnMut(Command),
) {
    let slider = &SLIDERS[number];
    let settings = state.controls.settings();
    let [low, high] = state.scene.map_or(slider.range, |scene| slider.range_in(scene));
    let before = slider.get(settings);
    if slider.is_switch() {
        let mut on = before >= 0.5;
        if switch(ui, &mut on, name, slider.hint) {
            execute(Command::SetSlider(number, f64::from(u8::from(on))));
        }
        return;
    }
    let mut value = before.clamp(low, high.max(low));
    let digits = (-slider.step.log10().floor()).clamp(0.0, 3.0) as usize;
    let space = if slider.unit.is_empty() || slider.unit == "°" { "" } else { " " };
    let shown = match slider.key {
        "cuts.depth" if before <= 0.0 => texts::THROUGH_ALL.to_string(),
        "cap.level" | "ray.step" | "planes.spacing" if before <= 0.0 => texts::AUTOMATIC.to_string(),
        _ => format!("{before:.digits$}{space}{}", slider.unit),
    };
    let text = RichText::new(name);
    name_and_value(ui, if is_large { text.strong() } else { text }, RichText::new(&shown).color(ACCENT));
    ui.spacing_mut().slider_width = ui.available_width();
    // Tall enough for a finger, although the rail is thin.
    ui.spacing_mut().interact_size.y = TOUCH_SIZE * if is_large { 0.62 } else { 0.5 };
    let response = ui.add(Slider::new(&mut value, low..=high.max(low)).show_value(false).step_by(slider.step));
    let response = response.tell(&texts::slider_hint(slider.hint)).named(name).with_value(&shown);
    // egui's sliders are dragged, not clicked.
    let is_on_it = response.drag_stopped() || response.contains_pointer();
    if is_on_it && ui.input(|input| input.pointer.button_double_clicked(PointerButton::Primary)) {
        execute(Command::ResetSlider(number));
        return;
    }
    // egui also reports a change when it rounds a value to the step, without any input.
    let is_held = response.dragged() || response.clicked() || response.is_pointer_button_down_on();
    let is_asked = names::asks_for_value(ui, &response);
    if (is_held || is_asked) && value != before {
        execute(Command::SetSlider(number, value));
    }
}

/// The name of a slider and its value, in a row as low as its text: every control in front is to be in sight.
pub(super) fn name_and_value(ui: &mut Ui, name: RichText, value: RichText) {
    let finger = std::mem::replace(&mut ui.spacing_mut().interact_size.y, TEXT_SIZE);
    ui.horizontal(|ui| {
        ui.label(name);
        ui.with_layout(egui::Layout::right_to_left(Align::Center), |ui| {
            ui.label(value);
        });
    });
    ui.spacing_mut().interact_size.y = finger;
    ui.add_space(-ui.spacing().item_spacing.y / 2.0);
}

/// A slider in mm of what is no setting of its own. Returns the value that the user sets.
pub(super) fn plain_slider(ui: &mut Ui, name: &str, before: f64, range: [f64; 2], hint: &str) -> Option<f64> {
    scale_slider(ui, name, before, (range, 0.5), texts::millimetres(before), hint)
}

/// A slider of what is no setting of its own, with its range and its step; `shown`: the value as the user reads it. Returns the value that the user
/// sets.
pub(super) fn scale_slider(
    ui: &mut Ui,
    name: &str,
    before: f64,
    ([low, high], step): ([f64; 2], f64),
    shown: String,
    hint: &str,
) -> Option<f64> {
    let mut value = before.clamp(low, high.max(low));
    name_and_value(ui, RichText::new(name), RichText::new(&shown).color(ACCENT));
    ui.spacing_mut().slider_width = ui.available_width();
    ui.spacing_mut().interact_size.y = TOUCH_SIZE * 0.5;
    let slider = ui.add(Slider::new(&mut value, low..=high.max(low)).show_value(false).step_by(step));
    let slider = slider.tell(hint).named(name).with_value(&shown);
    let is_held = slider.dragged() || slider.clicked() || slider.is_pointer_button_down_on();
    ((is_held || names::asks_for_value(ui, &slider)) && value != before).then_some(value)
}

/// A switch with its name; the whole row reacts. True if the user changed it.
pub(super) fn switch(ui: &mut Ui, on: &mut bool, name: &str, hint: &str) -> bool {
    let (width, height) = (44.0, 24.0);
    // A long name has two lines, and ends before the switch.
    let room = (ui.available_width() - width - 6.0).max(0.0);
    let label = ui.painter().layout(name.to_string(), FontId::proportional(TEXT_SIZE), TEXT, room);
    let size = vec2(ui.available_width(), (TOUCH_SIZE * 0.75).max(label.size().y + 4.0));
    let (area, response) = ui.allocate_exact_size(size, Sense::click());
    if response.clicked() {
        *on = !*on;
    }
    response.widget_info(|| WidgetInfo::selected(WidgetType::Checkbox, true, *on, name));
    let response = response.tell(hint).with_role(Role::Switch);
    let right = pos2(area.right() - width, area.center().y - height / 2.0);
    let track = Rect::from_min_size(right, vec2(width, height));
    let painter = ui.painter();
    let fill = if *on { SELECTED } else { BUTTON };
    painter.rect_filled(track, height / 2.0, fill);
    let edge = if response.hovered() || response.has_focus() { TEXT } else { WEAK_TEXT };
    painter.rect_stroke(track, height / 2.0, Stroke::new(1.0, edge), StrokeKind::Inside);
    let x = if *on { track.right() - height / 2.0 } else { track.left() + height / 2.0 };
    painter.circle_filled(pos2(x, track.center().y), height / 2.0 - 4.0, ON_SELECTED);
    let at = pos2(area.left(), area.center().y - label.size().y / 2.0);
    let clip = Rect::from_min_max(area.min, pos2(track.left() - 6.0, area.bottom()));
    painter.with_clip_rect(clip).galley(at, label, TEXT);
    response.clicked()
}
