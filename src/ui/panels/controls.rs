//! The panels with buttons and sliders: modes and tools on the left, sliders on the right, the cine loop below.

use super::{
    ACCENT, CINE_BAR_HEIGHT, MODES_WIDTH, PanelState, SLIDERS_WIDTH, SMALL_TEXT, TOUCH_SIZE, WARNING, WEAK_TEXT,
};
use crate::scene::{ColourMap, Layout, Mode, PlaneName, Transfer, TransferName};
use crate::ui::command::{Command, Tool};
use crate::ui::sliders::{Group, SLIDERS};
use egui::{Align, Button, Color32, Panel, RichText, ScrollArea, Slider, Ui, vec2};

/// All modes, in the order of their keys.
const MODES: [(Mode, &str); 10] = [
    (Mode::Surface, "Surface"),
    (Mode::Volume, "Volume"),
    (Mode::Mixed, "Mixed"),
    (Mode::Mip, "MIP"),
    (Mode::MinIp, "MinIP"),
    (Mode::Mean, "X-ray"),
    (Mode::Plane, "Plane"),
    (Mode::Orthogonal, "3 planes"),
    (Mode::Tomography, "Slices"),
    (Mode::Cube, "Cube"),
];

const TOOLS: [(Tool, &str); 5] = [
    (Tool::Rotate, "Turn"),
    (Tool::Light, "Light"),
    (Tool::Region, "Region"),
    (Tool::Clip, "Clip"),
    (Tool::Plane, "Planes"),
];

const PLANES: [(PlaneName, &str); 3] = [(PlaneName::A, "A"), (PlaneName::B, "B"), (PlaneName::C, "C")];

pub(super) fn show_modes(ui: &mut Ui, state: &PanelState, execute: &mut dyn FnMut(Command)) {
    Panel::left("rail").exact_size(MODES_WIDTH).resizable(false).show_separator_line(false).show(ui, |ui| {
        let settings = state.controls.settings();
        ui.add_space(6.0);
        heading(ui, "Mode");
        pairs(ui, &MODES, |mode| settings.mode == mode, |mode| execute(Command::Mode(mode)));
        heading(ui, "Layout");
        let layouts = [(Layout::Single, "Single"), (Layout::Four, "4-up"), (Layout::Pair, "VR | SR")];
        pairs(ui, &layouts, |layout| settings.layout == layout, |layout| execute(Command::Layout(layout)));
        heading(ui, "Drag");
        pairs(ui, &TOOLS, |tool| state.controls.tool() == tool, |tool| execute(Command::Tool(tool)));
        if settings.mode.is_flat() && settings.mode != Mode::Orthogonal {
            heading(ui, "Plane");
            row(ui, &PLANES, 3, |plane| settings.planes.plane == plane, |plane| execute(Command::Plane(plane)));
        }
    });
}

fn heading(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).size(SMALL_TEXT).color(WEAK_TEXT));
}

fn pairs<T: Copy>(ui: &mut Ui, all: &[(T, &str)], is: impl Fn(T) -> bool, mut select: impl FnMut(T)) {
    for two in all.chunks(2) {
        row(ui, two, 2, &is, &mut select);
    }
}

/// A row of buttons, each with the width of one of `columns`.
fn row<T: Copy>(ui: &mut Ui, all: &[(T, &str)], columns: usize, is: impl Fn(T) -> bool, mut select: impl FnMut(T)) {
    ui.horizontal(|ui| {
        let gap = ui.spacing().item_spacing.x;
        let width = (MODES_WIDTH - 16.0 - gap * (columns - 1) as f32) / columns as f32;
        for (value, name) in all {
            let button = Button::selectable(is(*value), *name).frame_when_inactive(true);
            if ui.add(button.min_size(vec2(width, TOUCH_SIZE * 0.92))).clicked() {
                select(*value);
            }
        }
    });
}

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

pub(super) fn show_sliders(ui: &mut Ui, state: &PanelState, execute: &mut dyn FnMut(Command)) {
    let settings = state.controls.settings();
    Panel::right("column").exact_size(SLIDERS_WIDTH).resizable(false).show_separator_line(false).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            // Leaves room for the scroll bar, which covers the edge.
            ui.set_max_width(SLIDERS_WIDTH - 32.0);
            ui.add_space(6.0);
            for (group, name) in Group::ALL {
                let mut there = SLIDERS.iter().enumerate().filter(|(_, s)| s.group == group && s.applies(settings));
                let Some(first) = there.next() else { continue };
                ui.label(RichText::new(name).size(SMALL_TEXT).color(WEAK_TEXT));
                for (number, _) in std::iter::once(first).chain(there) {
                    slider(ui, state, number, execute);
                }
                match group {
                    Group::Volume => {
                        let is = |name| settings.volume.transfer == Transfer::Named(name);
                        choices(ui, "Transfer function", &TRANSFERS, is, |name| execute(Command::Transfer(name)));
                    }
                    Group::Image => {
                        let is = |map| settings.post.colour_map == map;
                        choices(ui, "Colours", &MAPS, is, |map| execute(Command::ColourMap(map)));
                    }
                    Group::Light => {
                        let on = settings.light.shadow.is_some();
                        choices(
                            ui,
                            "Shadow",
                            &[(true, "On"), (false, "Off")],
                            |s| s == on,
                            |s| execute(Command::Shadow(s)),
                        );
                    }
                    _ => {}
                }
                ui.add_space(6.0);
            }
        });
    });
}

fn slider(ui: &mut Ui, state: &PanelState, number: usize, execute: &mut dyn FnMut(Command)) {
    let slider = &SLIDERS[number];
    let settings = state.controls.settings();
    let [low, high] = state.scene.map_or(slider.range, |scene| slider.range_in(scene));
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
    ui.spacing_mut().slider_width = SLIDERS_WIDTH - 44.0;
    // Tall enough for a finger, although the rail is thin.
    ui.spacing_mut().interact_size.y = TOUCH_SIZE * 0.62;
    let response = ui.add(Slider::new(&mut value, low..=high.max(low)).show_value(false).step_by(slider.step));
    // egui also reports a change when it rounds a value to the step, without any input.
    let is_held = response.dragged() || response.clicked() || response.is_pointer_button_down_on();
    if is_held && value != before {
        execute(Command::SetSlider(number, value));
    }
}

fn choices<T: Copy>(ui: &mut Ui, name: &str, all: &[(T, &str)], is: impl Fn(T) -> bool, mut select: impl FnMut(T)) {
    ui.label(name);
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(6.0, 6.0);
        let width = (SLIDERS_WIDTH - 44.0 - 12.0) / 3.0;
        for (value, name) in all {
            let button = Button::selectable(is(*value), *name).frame_when_inactive(true);
            if ui.add(button.min_size(vec2(width, TOUCH_SIZE * 0.8))).clicked() {
                select(*value);
            }
        }
    });
}

pub(super) fn show_cine_bar(ui: &mut Ui, state: &PanelState, execute: &mut dyn FnMut(Command)) {
    Panel::bottom("bar").exact_size(CINE_BAR_HEIGHT).resizable(false).show_separator_line(false).show(ui, |ui| {
        ui.horizontal_centered(|ui| {
            let (label, fill) = match state.is_frozen {
                true => ("FROZEN", WARNING.gamma_multiply(0.75)),
                false => ("Freeze", ACCENT.gamma_multiply(0.45)),
            };
            let text = RichText::new(label).color(Color32::WHITE).strong();
            if ui.add(Button::new(text).fill(fill).min_size(vec2(120.0, TOUCH_SIZE))).clicked() {
                execute(Command::Freeze);
            }
            cine(ui, state, execute);
            ui.with_layout(egui::Layout::right_to_left(Align::Center), |ui| {
                let mut button = |label: &str, width: f32, command| {
                    if ui.add(Button::new(label).min_size(vec2(width, TOUCH_SIZE))).clicked() {
                        execute(command);
                    }
                };
                button("?", 52.0, Command::ToggleHelp);
                button("Full screen", 110.0, Command::ToggleFullScreen);
                button("Times", 70.0, Command::ToggleTimes);
                button("Reset", 70.0, Command::Reset);
                button("Save loop", 100.0, Command::SaveLoop);
                button("Save picture", 120.0, Command::SavePicture);
            });
        });
    });
}

fn cine(ui: &mut Ui, state: &PanelState, execute: &mut dyn FnMut(Command)) {
    let (count, place) = state.cine;
    if count == 0 {
        ui.label(RichText::new("no volumes yet").color(WEAK_TEXT));
        return;
    }
    let label = if state.is_playing { "Stop" } else { "Play" };
    if ui.add(Button::new(label).min_size(vec2(64.0, TOUCH_SIZE))).clicked() {
        execute(Command::PlayCine);
    }
    for (label, by) in [("<", -1), (">", 1)] {
        if ui.add(Button::new(label).min_size(vec2(44.0, TOUCH_SIZE))).clicked() {
            execute(Command::StepCine(by));
        }
    }
    // Leaves room for the buttons on the right.
    ui.spacing_mut().slider_width = (ui.available_width() - 690.0).clamp(60.0, 400.0);
    let mut at = place.map_or(count, |p| p + 1);
    let slider = ui.add_enabled(count > 1, Slider::new(&mut at, 1..=count).show_value(false));
    let is_held = slider.dragged() || slider.clicked() || slider.is_pointer_button_down_on();
    if is_held && place != Some(at - 1) {
        execute(Command::SeekCine(at - 1));
    }
    let shown = place.map_or("-".into(), |p| (p + 1).to_string());
    ui.label(format!("{shown} of {count}"));
}
