//! The search of all commands and controls: a line for typing, and the results.

use super::colours::{ACCENT, BACKGROUND, CHOSEN, EDGE, TEXT, WEAK_TEXT};
use super::icons;
use super::names::{self, Tell};
use super::overlays::LOW_WINDOW;
use super::visible::Search;
use super::widgets::dialog;
use super::{Execute, ROW_HEIGHT, SMALL_TEXT, TEXT_SIZE, rail};
use crate::command::Command;
use crate::palette::{self, Entry};
use crate::texts;
use egui::accesskit::Role;
use egui::{Align2, FontId, Rect, ScrollArea, Sense, Stroke, StrokeKind, Ui, WidgetInfo, WidgetType, pos2, vec2};

/// Most entries that are shown: more is found by another word.
const MAX_SHOWN: usize = 60;

pub(super) fn show(ui: &Ui, search: &Search, execute: Execute) {
    let screen = ui.ctx().content_rect();
    let (margin, top) = if screen.height() < LOW_WINDOW { (6, 4.0) } else { (12, 56.0) };
    dialog(ui, texts::FIND, (Align2::CENTER_TOP, top), margin, [100.0, 620.0], |ui, width| {
        ui.spacing_mut().item_spacing.y = 2.0;
        typed(ui, search, width, execute);
        ui.add_space(4.0);
        let found = palette::found(&search.text);
        let height = (screen.height() - top - ROW_HEIGHT - 2.0 * f32::from(margin) - 24.0).clamp(30.0, 460.0);
        let area = ScrollArea::vertical().max_height(height).min_scrolled_height(height).auto_shrink([false, true]);
        area.show(ui, |ui| {
            names::list(ui, texts::FOUND, |ui| {
                if found.is_empty() {
                    ui.label(texts::NOTHING_FOUND);
                }
                for (n, entry) in found.iter().take(MAX_SHOWN).enumerate() {
                    if row(ui, entry, n == search.chosen, width - 16.0) {
                        execute(Command::Find);
                        execute(entry.command);
                    }
                }
            });
        });
    });
}

/// What is typed, and what closes the search.
fn typed(ui: &mut Ui, search: &Search, width: f32, execute: Execute) {
    ui.horizontal(|ui| {
        let (area, response) = ui.allocate_exact_size(vec2(width - ROW_HEIGHT - 8.0, ROW_HEIGHT), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Label, true, texts::FIND));
        let painter = ui.painter();
        painter.rect(area, 6.0, BACKGROUND, Stroke::new(1.0, EDGE), StrokeKind::Inside);
        let icon = Rect::from_center_size(pos2(area.left() + 18.0, area.center().y), vec2(18.0, 18.0));
        rail::paint(painter, icons::SEARCH, icon, WEAK_TEXT);
        let (text, colour) = match search.text.is_empty() {
            true => (texts::HOW_TO_FIND.to_string(), WEAK_TEXT),
            false => (format!("{}_", search.text), TEXT),
        };
        let at = pos2(area.left() + 36.0, area.center().y);
        let clip = painter.with_clip_rect(area.shrink(4.0));
        clip.text(at, Align2::LEFT_CENTER, text, FontId::proportional(TEXT_SIZE), colour);
        response.with_value(&search.text);
        let size = vec2(ROW_HEIGHT, ROW_HEIGHT);
        let close = rail::icon_button(ui, icons::CLOSE, ("", texts::CLOSE), size, (true, false));
        close.tell(texts::CLOSE_SEARCH_HINT).named(texts::CLOSE).gives(Command::Find, execute);
    });
}

/// A command or a control: its name, what it does, and its key. True if it is chosen.
fn row(ui: &mut Ui, entry: &Entry, is_chosen: bool, width: f32) -> bool {
    let (area, response) = ui.allocate_exact_size(vec2(width, ROW_HEIGHT + 6.0), Sense::click());
    let spoken = format!("{} {}", entry.name, entry.key);
    response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_chosen, &spoken));
    if is_chosen || response.hovered() || response.has_focus() {
        ui.painter().rect_filled(area, 6.0, CHOSEN);
    }
    // Once: the pointer and the keyboard scroll too.
    let id = egui::Id::new("chosen");
    if is_chosen && ui.data_mut(|data| data.get_temp(id) != Some(spoken.clone())) {
        ui.data_mut(|data| data.insert_temp(id, spoken.clone()));
        response.scroll_to_me(None);
    }
    let painter = ui.painter().with_clip_rect(area.shrink2(vec2(8.0, 0.0)));
    let (end, small) = (area.right_center() - vec2(8.0, 0.0), FontId::proportional(SMALL_TEXT));
    let key = painter.text(end, Align2::RIGHT_CENTER, &entry.key, small, ACCENT);
    let painter = painter.with_clip_rect(area.shrink2(vec2(8.0, 0.0)).with_max_x(key.left() - 8.0));
    let name = FontId::proportional(TEXT_SIZE);
    let up = if entry.about.is_empty() { 0.0 } else { 8.0 };
    painter.text(area.left_center() + vec2(8.0, -up), Align2::LEFT_CENTER, &entry.name, name, TEXT);
    let about = FontId::proportional(SMALL_TEXT - 1.0);
    painter.text(area.left_center() + vec2(8.0, 10.0), Align2::LEFT_CENTER, &entry.about, about, WEAK_TEXT);
    let told = if entry.about.is_empty() { format!("{}: {}", entry.name, entry.key) } else { entry.about.clone() };
    response.tell(&told).named(spoken.trim_end()).with_role(Role::Button).clicked()
}
