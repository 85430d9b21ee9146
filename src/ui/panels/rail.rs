//! Modes, layouts and tools: large buttons on the left.

use super::theme::{FAINT, FINGER, SMALL};
use super::{Facts, RAIL};
use crate::scene::{Layout, Mode, PlaneName};
use crate::ui::command::{Command, Tool};
use egui::{Button, Panel, RichText, Ui, vec2};

/// In the order of their keys.
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
    (Tool::Turn, "Turn"),
    (Tool::Light, "Light"),
    (Tool::Region, "Region"),
    (Tool::Clip, "Clip"),
    (Tool::Plane, "Planes"),
];

const PLANES: [(PlaneName, &str); 3] = [(PlaneName::A, "A"), (PlaneName::B, "B"), (PlaneName::C, "C")];

pub fn show(ui: &mut Ui, facts: &Facts, ask: &mut dyn FnMut(Command)) {
    Panel::left("rail").exact_size(RAIL).resizable(false).show_separator_line(false).show(ui, |ui| {
        let settings = facts.controls.settings();
        ui.add_space(6.0);
        heading(ui, "Mode");
        pairs(ui, &MODES, |mode| settings.mode == mode, |mode| ask(Command::Mode(mode)));
        heading(ui, "Layout");
        let layouts = [(Layout::Single, "Single"), (Layout::Four, "4-up")];
        pairs(ui, &layouts, |layout| settings.layout == layout, |layout| ask(Command::Layout(layout)));
        heading(ui, "Drag");
        pairs(ui, &TOOLS, |tool| facts.controls.tool() == tool, |tool| ask(Command::Tool(tool)));
        if settings.mode.is_flat() && settings.mode != Mode::Orthogonal {
            heading(ui, "Plane");
            row(ui, &PLANES, 3, |plane| settings.planes.plane == plane, |plane| ask(Command::Plane(plane)));
        }
    });
}

fn heading(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).size(SMALL).color(FAINT));
}

fn pairs<T: Copy>(ui: &mut Ui, all: &[(T, &str)], is: impl Fn(T) -> bool, mut asked: impl FnMut(T)) {
    for two in all.chunks(2) {
        row(ui, two, 2, &is, &mut asked);
    }
}

/// Buttons side by side, as wide as if there were `columns` of them.
fn row<T: Copy>(ui: &mut Ui, all: &[(T, &str)], columns: usize, is: impl Fn(T) -> bool, mut asked: impl FnMut(T)) {
    ui.horizontal(|ui| {
        let gap = ui.spacing().item_spacing.x;
        let width = (RAIL - 16.0 - gap * (columns - 1) as f32) / columns as f32;
        for (what, name) in all {
            let button = Button::selectable(is(*what), *name).frame_when_inactive(true);
            if ui.add(button.min_size(vec2(width, FINGER * 0.92))).clicked() {
                asked(*what);
            }
        }
    });
}
