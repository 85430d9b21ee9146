//! What a scanner has knobs for: sliders on the right, those alone that the mode uses.

use super::theme::{ACCENT, FAINT, FINGER, SMALL};
use super::{COLUMN, Facts};
use crate::scene::{ColourMap, Transfer, TransferName};
use crate::ui::command::Command;
use crate::ui::sliders::{Group, SLIDERS};
use egui::{Button, Panel, RichText, ScrollArea, Slider, Ui, vec2};

const TRANSFERS: [(TransferName, &str); 6] = [
    (TransferName::Grey, "Grey"),
    (TransferName::Sepia, "Sepia"),
    (TransferName::Skin, "Skin"),
    (TransferName::Bone, "Bone"),
    (TransferName::Cool, "Cool"),
    (TransferName::Warm, "Warm"),
];

const MAPS: [(ColourMap, &str); 5] = [
    (ColourMap::None, "As is"),
    (ColourMap::Grey, "Grey"),
    (ColourMap::Sepia, "Sepia"),
    (ColourMap::Skin, "Skin"),
    (ColourMap::Ice, "Ice"),
];

pub fn show(ui: &mut Ui, facts: &Facts, ask: &mut dyn FnMut(Command)) {
    let settings = facts.controls.settings();
    Panel::right("column").exact_size(COLUMN).resizable(false).show_separator_line(false).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            // The bar that scrolls lies over what is at the edge.
            ui.set_max_width(COLUMN - 32.0);
            ui.add_space(6.0);
            for (group, name) in Group::ALL {
                let mut there = SLIDERS.iter().enumerate().filter(|(_, s)| s.group == group && s.applies(settings));
                let Some(first) = there.next() else { continue };
                ui.label(RichText::new(name).size(SMALL).color(FAINT));
                for (number, _) in std::iter::once(first).chain(there) {
                    slider(ui, facts, number, ask);
                }
                match group {
                    Group::Volume => {
                        let is = |name| settings.volume.transfer == Transfer::Named(name);
                        choices(ui, "Transfer function", &TRANSFERS, is, |name| ask(Command::Transfer(name)));
                    }
                    Group::Image => {
                        let is = |map| settings.post.colour_map == map;
                        choices(ui, "Colours", &MAPS, is, |map| ask(Command::ColourMap(map)));
                    }
                    Group::Light => {
                        let on = settings.light.shadow.is_some();
                        choices(
                            ui,
                            "Shadow",
                            &[(true, "On"), (false, "Off")],
                            |s| s == on,
                            |s| ask(Command::Shadow(s)),
                        );
                    }
                    _ => {}
                }
                ui.add_space(6.0);
            }
        });
    });
}

fn slider(ui: &mut Ui, facts: &Facts, number: usize, ask: &mut dyn FnMut(Command)) {
    let slider = &SLIDERS[number];
    let settings = facts.controls.settings();
    let [low, high] = facts.scene.map_or(slider.range, |scene| slider.range_in(scene));
    let before = slider.get(settings);
    let mut value = before.clamp(low, high.max(low));
    let digits = (-slider.step.log10().floor()).clamp(0.0, 3.0) as usize;
    ui.horizontal(|ui| {
        ui.label(slider.name);
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let unit = if slider.unit.is_empty() { String::new() } else { format!(" {}", slider.unit) };
            ui.label(RichText::new(format!("{before:.digits$}{unit}")).color(ACCENT));
        });
    });
    ui.spacing_mut().slider_width = COLUMN - 44.0;
    // As tall as a finger is wide, although its rail is thin.
    ui.spacing_mut().interact_size.y = FINGER * 0.62;
    let response = ui.add(Slider::new(&mut value, low..=high.max(low)).show_value(false).step_by(slider.step));
    // It calls itself changed when it rounds a value to its steps, too, which nobody asked for.
    let is_held = response.dragged() || response.clicked() || response.is_pointer_button_down_on();
    if is_held && value != before {
        ask(Command::Slide(number, value));
    }
}

fn choices<T: Copy>(ui: &mut Ui, name: &str, all: &[(T, &str)], is: impl Fn(T) -> bool, mut asked: impl FnMut(T)) {
    ui.label(name);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(6.0, 6.0);
        let width = (COLUMN - 44.0 - 12.0) / 3.0;
        for (what, name) in all {
            let button = Button::selectable(is(*what), *name).frame_when_inactive(true);
            if ui.add(button.min_size(vec2(width, FINGER * 0.8))).clicked() {
                asked(*what);
            }
        }
    });
}
