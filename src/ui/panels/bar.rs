//! Freeze, the cine loop, and what is saved: along the lower edge.

use super::theme::{ACCENT, FAINT, FINGER, WARNING};
use super::{BAR, Facts};
use crate::ui::command::Command;
use egui::{Align, Button, Color32, Layout, Panel, RichText, Slider, Ui, vec2};

pub fn show(ui: &mut Ui, facts: &Facts, ask: &mut dyn FnMut(Command)) {
    Panel::bottom("bar").exact_size(BAR).resizable(false).show_separator_line(false).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            let (words, fill) = match facts.is_frozen {
                true => ("FROZEN", WARNING.gamma_multiply(0.75)),
                false => ("Freeze", ACCENT.gamma_multiply(0.45)),
            };
            let text = RichText::new(words).color(Color32::WHITE).strong();
            if ui.add(Button::new(text).fill(fill).min_size(vec2(120.0, FINGER))).clicked() {
                ask(Command::Freeze);
            }
            cine(ui, facts, ask);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let mut button = |words: &str, width: f32, command| {
                    if ui.add(Button::new(words).min_size(vec2(width, FINGER))).clicked() {
                        ask(command);
                    }
                };
                button("?", 52.0, Command::Help);
                button("Full screen", 110.0, Command::FullScreen);
                button("Times", 70.0, Command::Hud);
                button("Reset", 70.0, Command::Reset);
                button("Save loop", 100.0, Command::SaveLoop);
                button("Save picture", 120.0, Command::SavePicture);
            });
        });
    });
}

fn cine(ui: &mut Ui, facts: &Facts, ask: &mut dyn FnMut(Command)) {
    let (count, place) = facts.cine;
    if count == 0 {
        ui.label(RichText::new("no volumes yet").color(FAINT));
        return;
    }
    let words = if facts.is_playing { "Stop" } else { "Play" };
    if ui.add(Button::new(words).min_size(vec2(64.0, FINGER))).clicked() {
        ask(Command::CinePlay);
    }
    for (words, by) in [("<", -1), (">", 1)] {
        if ui.add(Button::new(words).min_size(vec2(44.0, FINGER))).clicked() {
            ask(Command::Cine(by));
        }
    }
    // What the buttons on the right need is theirs.
    ui.spacing_mut().slider_width = (ui.available_width() - 690.0).clamp(60.0, 400.0);
    let mut at = place.map_or(count, |p| p + 1);
    let slider = ui.add_enabled(count > 1, Slider::new(&mut at, 1..=count).show_value(false));
    let is_held = slider.dragged() || slider.clicked() || slider.is_pointer_button_down_on();
    if is_held && place != Some(at - 1) {
        ask(Command::CineAt(at - 1));
    }
    let shown = place.map_or("-".into(), |p| (p + 1).to_string());
    ui.label(format!("{shown} of {count}"));
}
