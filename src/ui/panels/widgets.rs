//! Building blocks of panels: dialogs, rows, buttons, sliders of settings and of other values, switches, shortened texts, and the frame of messages.

use super::colours::{
    ABSENT, ACCENT, BACKGROUND, BUTTON, EDGE, MESSAGE, ON_SELECTED, PANEL, SELECTED, TEXT, WEAK_TEXT,
};
use super::names::{self, Tell};
use super::{Execute, PanelState, ROW_HEIGHT, SMALL_TEXT, TEXT_SIZE, section};
use crate::command::Command;
use crate::scene::Settings;
use crate::sliders::{self, SLIDERS};
use crate::texts;
use egui::accesskit::Role;
use egui::text::{LayoutJob, TextWrapping};
use egui::{
    Align, Align2, Area, Button, Color32, FontId, Frame, Galley, Id, Label, Layout, Margin, Order, PointerButton, Rect,
    Response, RichText, Sense, Slider, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, WidgetType, pos2, vec2,
};
use std::sync::Arc;

/// Distance between two messages, points.
pub(super) const BETWEEN_MESSAGES: f32 = 8.0;
/// Distance of messages from the upper and from the lower edge of the picture, points.
pub(super) const MESSAGE_EDGES: [f32; 2] = [12.0, 14.0];

/// Height of a row with a slider or a switch, points: a finger has it, too.
const SLIDER_ROW: f32 = 34.0;
/// Height of a slider, points; its knob has 0.8 of it.
const KNOB: f32 = 26.0;

/// The frame of a message, with an outline of this colour.
pub(super) fn message_frame(edge: Color32) -> Frame {
    Frame::new().fill(MESSAGE).inner_margin(Margin::symmetric(16, 10)).corner_radius(8).stroke(Stroke::new(2.0, edge))
}

/// Shows a dialog over everything else. `place`, `below`: its anchor in the window and the distance below it; `margin`: around its content; `widths`: the
/// smallest and the largest width of the content; all in points. `add` adds the content and gets its width.
pub(super) fn dialog(
    ui: &Ui,
    title: &str,
    (place, below): (Align2, f32),
    margin: i8,
    widths: [f32; 2],
    add: impl FnOnce(&mut Ui, f32),
) {
    let area = Area::new(Id::new(title)).order(Order::Foreground).anchor(place, vec2(0.0, below));
    area.show(ui.ctx(), |ui| {
        names::name(ui, Role::Dialog, title);
        let frame = Frame::new().fill(PANEL).inner_margin(Margin::same(margin)).corner_radius(10);
        frame.stroke(Stroke::new(2.0, ACCENT)).show(ui, |ui| {
            let width = ui.ctx().content_rect().width() - 2.0 * f32::from(margin) - 12.0;
            let width = width.clamp(widths[0], widths[1]);
            ui.set_width(width);
            add(ui, width);
        });
    });
}

/// Shows entries in rows of `columns`, at least 1.
pub(super) fn in_rows<T>(
    ui: &mut Ui,
    entries: impl IntoIterator<Item = T>,
    columns: usize,
    mut add: impl FnMut(&mut Ui, T),
) {
    let mut entries = entries.into_iter().peekable();
    while entries.peek().is_some() {
        ui.horizontal(|ui| entries.by_ref().take(columns.max(1)).for_each(|entry| add(ui, entry)));
    }
}

/// A part of a row that is so wide whatever is in it.
pub(super) fn cell(ui: &mut Ui, size: Vec2, add: impl FnOnce(&mut Ui)) {
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_width(size.x);
        add(ui);
    });
}

/// The index of the slider for the first of these keys that exists with these settings; None if none does.
pub(super) fn front(keys: &[&str], settings: &Settings) -> Option<usize> {
    keys.iter().find_map(|key| SLIDERS.iter().position(|s| s.key == *key && s.applies(settings)))
}

/// Shows the slider with the index `number`: name, rail, and value, which can be typed after a click.
pub(super) fn slider(ui: &mut Ui, state: &PanelState, number: usize, name: &str, execute: Execute) {
    let slider = &SLIDERS[number];
    let settings = state.controls.settings();
    let [low, high] = state.scene.map_or(slider.range, |scene| slider.range_in(scene));
    let before = slider.get(settings);
    let is_sought = state.visible.inspector.sought == Some(number);
    if slider.is_switch() {
        let set = |on| Command::SetSlider(number, f64::from(u8::from(on)));
        let response = switch(ui, before >= 0.5, [name, slider.hint], set, execute);
        if is_sought {
            find(&response);
        }
        return;
    }
    let shown = shown_value(slider, state, before);
    let typed = state.visible.value.as_ref().filter(|(typed, _)| *typed == number).map(|(_, text)| format!("{text}_"));
    let mut value = before.clamp(low, high.max(low));
    let hint = texts::slider_hint(slider.hint);
    let (response, about) = row(ui, name, typed.as_deref().unwrap_or(&shown), typed.is_some(), |ui| {
        let slider = Slider::new(&mut value, low..=high.max(low)).show_value(false).step_by(slider.step);
        ui.add(slider).tell(&hint).named(name).with_value(&shown)
    });
    about.tell(texts::TYPE_VALUE_HINT).named(&texts::value_of(name)).gives(Command::TypeValue(number), execute);
    if is_sought {
        find(&response);
    }
    // egui's sliders are dragged, not clicked.
    let is_on_it = response.drag_stopped() || response.contains_pointer();
    if is_on_it && ui.input(|input| input.pointer.button_double_clicked(PointerButton::Primary)) {
        execute(Command::ResetSlider(number));
        return;
    }
    if names::asks_for_value(ui, &response) && value != before {
        execute(Command::SetSlider(number, value));
    }
}

/// Gives the keyboard to a control that was searched for, once, and scrolls to it.
fn find(control: &Response) {
    let id = Id::new("sought");
    let is_new = control.ctx.data_mut(|data| data.get_temp(id) != Some(control.id));
    if is_new {
        control.ctx.data_mut(|data| data.insert_temp(id, control.id));
        control.request_focus();
    }
    if control.has_focus() {
        control.scroll_to_me(Some(Align::Center));
    }
}

/// A value with its unit, as the user reads it.
fn shown_value(slider: &crate::scene::Slider, state: &PanelState, value: f64) -> String {
    match slider.key {
        "cuts.depth" if value <= 0.0 => return texts::THROUGH_ALL.to_string(),
        "cap.level" | "ray.step" | "planes.spacing" if value <= 0.0 => return texts::AUTOMATIC.to_string(),
        _ => {}
    }
    let in_unit = |value: f64| state.scene.map_or(value, |scene| sliders::to_shown(slider, scene, value));
    let step = in_unit(slider.step) - in_unit(0.0);
    let digits = (-(step * 1.01).log10().floor()).clamp(0.0, 3.0) as usize;
    let shown = in_unit(value);
    let most = in_unit(1.0);
    match slider.unit {
        "" if most > 1.0 => format!("{shown:.digits$} /{most:.0}"),
        "" | "°" => format!("{shown:.digits$}{}", slider.unit),
        unit => format!("{shown:.digits$} {unit}"),
    }
}

/// Width of the name of a control and of its value in a row, points.
const NAME: f32 = 98.0;
const VALUE: f32 = 70.0;

/// A row with a name, what sets a value, and the value in a frame. A long name has a line of its own.
fn row(
    ui: &mut Ui,
    name: &str,
    value: &str,
    is_typed: bool,
    add: impl FnOnce(&mut Ui) -> Response,
) -> (Response, Response) {
    let width = ui.available_width();
    let words = ui.painter().layout_no_wrap(name.to_string(), FontId::proportional(TEXT_SIZE), TEXT);
    let is_long = words.size().x > NAME || width < 2.5 * NAME;
    if is_long {
        let (area, _) = ui.allocate_exact_size(vec2(width, TEXT_SIZE + 4.0), Sense::hover());
        ui.painter().galley(area.left_top(), words.clone(), TEXT);
        ui.add_space(-6.0);
    }
    ui.horizontal(|ui| {
        ui.set_min_height(SLIDER_ROW);
        ui.spacing_mut().item_spacing.x = 8.0;
        let mut rest = width - VALUE - 8.0;
        if !is_long {
            let (area, _) = ui.allocate_exact_size(vec2(NAME, SLIDER_ROW), Sense::hover());
            ui.painter().galley(pos2(area.left(), area.center().y - words.size().y / 2.0), words, TEXT);
            rest -= NAME + 8.0;
        }
        ui.spacing_mut().slider_width = rest.max(40.0);
        ui.spacing_mut().interact_size.y = KNOB;
        let set = add(ui);
        let (area, shown) = ui.allocate_exact_size(vec2(VALUE, SLIDER_ROW - 6.0), Sense::click());
        shown.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, value));
        let painter = ui.painter();
        let is_over = is_typed || shown.hovered() || shown.has_focus();
        let stroke = Stroke::new(1.0, if is_over { ACCENT } else { EDGE });
        painter.rect(area, 4.0, BACKGROUND, stroke, StrokeKind::Inside);
        let text = truncated(ui, value, TEXT_SIZE, VALUE - 8.0);
        let at = pos2(area.right() - 6.0 - text.size().x, area.center().y - text.size().y / 2.0);
        painter.galley(at.max(area.left_top()), text, TEXT);
        (set, shown)
    })
    .inner
}

/// A text of one line that ends in dots where it has no room.
pub(super) fn truncated(ui: &Ui, text: &str, size: f32, width: f32) -> Arc<Galley> {
    let mut job = LayoutJob::simple_singleline(text.to_string(), FontId::proportional(size), TEXT);
    job.wrap = TextWrapping::truncate_at_width(width);
    ui.painter().layout_job(job)
}

/// Shows a name in place of a control that the present mode does not have.
pub(super) fn absent(ui: &mut Ui, name: &str) {
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), SLIDER_ROW), Sense::hover());
    let font = FontId::proportional(TEXT_SIZE);
    let at = area.left_center();
    ui.painter().text(at, Align2::LEFT_CENTER, name, font.clone(), ABSENT);
    ui.painter().text(area.right_center() - vec2(6.0, 0.0), Align2::RIGHT_CENTER, "-", font, ABSENT);
    response.on_hover_text(texts::NO_SUCH_CONTROL);
}

/// Shows buttons of which one is selected, under a title, in rows of `columns` buttons that are `width` points wide: of each its command, its name and
/// its hint.
pub(super) fn row_of(
    ui: &mut Ui,
    title: &str,
    all: &[(Command, [&str; 2])],
    (columns, width): (usize, f32),
    is_chosen: impl Fn(Command) -> bool,
    execute: Execute,
) {
    section(ui, title, |ui| {
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        ui.spacing_mut().button_padding.x = 2.0;
        let each = (width - 4.0 * (columns - 1) as f32) / columns as f32;
        in_rows(ui, all, columns, |ui, (command, [name, hint])| {
            let button = Button::selectable(is_chosen(*command), *name).frame_when_inactive(true);
            ui.add(button.min_size(vec2(each, ROW_HEIGHT))).tell(hint).gives(*command, execute);
        });
    });
}

/// Shows a button with a name and a hint that gives a command.
pub(super) fn command_button(ui: &mut Ui, size: Vec2, [name, hint]: [&str; 2], command: Command, execute: Execute) {
    ui.add_sized(size, Button::new(name)).tell(hint).gives(command, execute);
}

/// Shows two buttons side by side, one that adds and one that removes, together `width` points wide: of each its command, its name and hint, and whether
/// it can be pressed.
pub(super) fn add_and_remove(ui: &mut Ui, width: f32, both: [(Command, [&str; 2], bool); 2], execute: Execute) {
    let half = vec2((width - ui.spacing().item_spacing.x) / 2.0, ROW_HEIGHT);
    ui.horizontal(|ui| {
        for (word, (command, [name, hint], is_enabled)) in [texts::ADD, texts::REMOVE].into_iter().zip(both) {
            let button = ui.add_enabled(is_enabled, Button::new(word).min_size(half));
            button.tell(hint).on_disabled_hover_text(hint).named(name).gives(command, execute);
        }
    });
}

/// Shows what to do next with a tool, and announces it.
pub(super) fn say_step(ui: &mut Ui, step: &str, colour: Color32) {
    names::group(ui, step, |ui| {
        names::announce(ui, step, false);
        ui.add(Label::new(RichText::new(step).size(SMALL_TEXT).color(colour)).wrap());
    });
}

/// Shows a slider for a value that is no setting, with its range and step. `before`: the present value; `shown`: the value as displayed. A new value
/// of the user gives the command for it.
pub(super) fn scale_slider(
    ui: &mut Ui,
    [name, hint]: [&str; 2],
    (before, shown): (f64, String),
    ([low, high], step): ([f64; 2], f64),
    command: impl FnOnce(f64) -> Command,
    execute: Execute,
) {
    let mut value = before.clamp(low, high.max(low));
    let width = ui.available_width();
    ui.horizontal(|ui| {
        ui.label(RichText::new(name));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(RichText::new(&shown).color(ACCENT));
        });
    });
    ui.add_space(-6.0);
    ui.spacing_mut().slider_width = width;
    ui.spacing_mut().interact_size.y = KNOB;
    let slider = ui.add(Slider::new(&mut value, low..=high.max(low)).show_value(false).step_by(step));
    let slider = slider.tell(hint).named(name).with_value(&shown);
    if names::asks_for_value(ui, &slider) && value != before {
        execute(command(value));
    }
}

/// Shows a switch with its name; the whole row reacts. A click gives the command for the other position.
pub(super) fn switch(
    ui: &mut Ui,
    is_on: bool,
    [name, hint]: [&str; 2],
    command: impl FnOnce(bool) -> Command,
    execute: Execute,
) -> Response {
    let (width, height) = (40.0, 22.0);
    // A long name has two lines, and ends before the switch.
    let room = (ui.available_width() - width - 6.0).max(0.0);
    let label = ui.painter().layout(name.to_string(), FontId::proportional(TEXT_SIZE), TEXT, room);
    let size = vec2(ui.available_width(), SLIDER_ROW.max(label.size().y + 4.0));
    let (area, response) = ui.allocate_exact_size(size, Sense::click());
    let on = is_on ^ response.clicked();
    response.widget_info(|| WidgetInfo::selected(WidgetType::Checkbox, true, on, name));
    let response = response.tell(hint).with_role(Role::Switch);
    let right = pos2(area.right() - width, area.center().y - height / 2.0);
    let track = Rect::from_min_size(right, vec2(width, height));
    let painter = ui.painter();
    let fill = if on { SELECTED } else { BUTTON };
    painter.rect_filled(track, height / 2.0, fill);
    let edge = if response.hovered() || response.has_focus() { TEXT } else { WEAK_TEXT };
    painter.rect_stroke(track, height / 2.0, Stroke::new(1.0, edge), StrokeKind::Inside);
    let x = if on { track.right() - height / 2.0 } else { track.left() + height / 2.0 };
    painter.circle_filled(pos2(x, track.center().y), height / 2.0 - 4.0, ON_SELECTED);
    let at = pos2(area.left(), area.center().y - label.size().y / 2.0);
    let clip = Rect::from_min_max(area.min, pos2(track.left() - 6.0, area.bottom()));
    painter.with_clip_rect(clip).galley(at, label, TEXT);
    if response.clicked() {
        execute(command(on));
    }
    response
}
