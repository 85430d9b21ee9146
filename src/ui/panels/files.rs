//! The list of files to open: the recent ones and those of a folder.

use super::{ACCENT, PANEL, SMALL_TEXT, TOUCH_SIZE, WEAK_TEXT};
use crate::ui::command::Command;
use egui::{Align2, Area, Button, Frame, Id, Margin, Order, RichText, ScrollArea, Stroke, Ui, vec2};

/// Shows the list over the window. `files`: where its entries are, and the entries.
pub(super) fn show(ui: &Ui, files: (&str, &[String]), execute: &mut dyn FnMut(Command)) {
    let screen = ui.ctx().content_rect();
    let area = Area::new(Id::new("files")).order(Order::Foreground).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0));
    area.show(ui.ctx(), |ui| {
        let frame = Frame::new().fill(PANEL).inner_margin(Margin::same(16)).corner_radius(10);
        frame.stroke(Stroke::new(2.0, ACCENT)).show(ui, |ui| {
            let width = (screen.width() - 80.0).clamp(120.0, 720.0);
            ui.set_width(width);
            ui.horizontal(|ui| {
                ui.heading("Open");
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    if ui.button("Close  (Esc)").on_hover_text("Opens nothing.").clicked() {
                        execute(Command::OpenFiles);
                    }
                });
            });
            ui.label(RichText::new(files.0).size(SMALL_TEXT).color(WEAK_TEXT));
            let height = (screen.height() - 200.0).max(60.0);
            ScrollArea::vertical().max_height(height).show(ui, |ui| {
                for (n, name) in files.1.iter().enumerate() {
                    let key = if n < 9 { format!("{}   ", n + 1) } else { "     ".into() };
                    let button = Button::new(format!("{key}{name}")).truncate();
                    let button = button.min_size(vec2(width - 20.0, TOUCH_SIZE * 0.7));
                    if ui.add(button).on_hover_text(name).clicked() {
                        execute(Command::OpenFile(n));
                    }
                }
                if files.1.is_empty() {
                    ui.label("There is no recording and no workspace here.");
                }
            });
        });
    });
}
