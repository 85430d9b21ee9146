//! Every key, every gesture.

use super::Facts;
use super::theme::{ACCENT, FAINT, LETTERS, PANEL, SMALL};
use crate::ui::command::Command;
use crate::ui::keys;
use egui::{Align2, Area, Frame, Id, Margin, Order, RichText, ScrollArea, Stroke, Ui, vec2};

/// What hands do on the picture itself.
const HANDS: [(&str, &str); 9] = [
    ("drag", "what the tool says: turn, light, region, clip, planes"),
    ("Shift + drag, middle drag", "move the picture"),
    ("Ctrl + drag", "move the light"),
    ("wheel", "closer, further; over a plane: step it"),
    ("two fingers", "pinch closer, twist, move"),
    ("double click on a tile", "that tile alone, and back"),
    ("Region, then drag", "the face of the box that is nearest"),
    ("Clip, then drag up", "cut away what is nearer to you"),
    ("Planes, then click", "where the three planes meet"),
];

pub fn show(ui: &mut Ui, facts: &Facts, ask: &mut dyn FnMut(Command)) {
    let screen = ui.ctx().content_rect();
    let mut is_closed = false;
    Area::new(Id::new("help")).order(Order::Foreground).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0)).show(
        ui.ctx(),
        |ui| {
            let frame = Frame::new()
                .fill(PANEL.gamma_multiply(0.97))
                .inner_margin(Margin::same(18))
                .corner_radius(10)
                .stroke(Stroke::new(1.0, FAINT));
            frame.show(ui, |ui| {
                let width = (screen.width() - 80.0).clamp(100.0, 1080.0);
                ui.set_width(width);
                ui.horizontal(|ui| {
                    ui.heading("Keys and hands");
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        is_closed = ui.button("Close").clicked();
                    });
                });
                let height = (screen.height() - 150.0).max(0.0);
                ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
                    let keys: Vec<(String, &str)> = keys::help().collect();
                    let half = keys.len().div_ceil(2);
                    let rows = |ui: &mut Ui, rows: &[(String, &str)]| {
                        for (key, words) in rows {
                            row(ui, key, words);
                        }
                    };
                    match width > 760.0 {
                        true => ui.columns(2, |columns| {
                            rows(&mut columns[0], &keys[..half]);
                            rows(&mut columns[1], &keys[half..]);
                        }),
                        false => rows(ui, &keys),
                    }
                    if !facts.exit_key.is_empty() {
                        row(ui, facts.exit_key, "leave");
                    }
                    ui.separator();
                    for (hand, words) in HANDS {
                        row(ui, hand, words);
                    }
                    ui.add_space(8.0);
                    ui.label(RichText::new("Echolume is not a medical device.").size(SMALL).color(FAINT));
                });
            });
        },
    );
    if is_closed {
        ask(Command::Help);
    }
}

fn row(ui: &mut Ui, key: &str, words: &str) {
    ui.horizontal(|ui| {
        ui.add_sized([150.0, LETTERS], egui::Label::new(RichText::new(key).color(ACCENT).size(LETTERS - 2.0)));
        ui.label(RichText::new(words).size(LETTERS - 2.0));
    });
}
