//! Controls for the patient's sides along the axes of the volume and for the position of the probe's marker.

use super::names::{self, Tell};
use super::widgets::switch;
use super::{Execute, PanelState, ROW_HEIGHT, SMALL_TEXT, section};
use crate::command::Command;
use crate::scene::{Marks, ProbeMarker, Sides, VolumeAxis};
use crate::texts;
use egui::accesskit::Role;
use egui::{Button, CollapsingHeader, RichText, Ui, Vec2, vec2};

/// In the order in which letters go before each other on a tile.
const AXES: [VolumeAxis; 3] = [VolumeAxis::Lateral, VolumeAxis::Elevation, VolumeAxis::Depth];
/// Each pair above the same the other way round.
const CHOICES: [[Option<Sides>; 4]; 2] = [
    [Some(Sides::None), Some(Sides::LeftRight), Some(Sides::HeadFeet), Some(Sides::FrontBack)],
    [None, Some(Sides::RightLeft), Some(Sides::FeetHead), Some(Sides::BackFront)],
];
const MARKERS: [ProbeMarker; 3] = [ProbeMarker::First, ProbeMarker::Last, ProbeMarker::Hidden];

pub(super) fn show(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let marks = &state.controls.settings().drawn.marks;
    let shown =
        CollapsingHeader::new(title(marks)).id_salt(texts::SIDES).default_open(true).show_unindented(ui, |ui| {
            names::name(ui, Role::Group, texts::SIDES);
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.spacing_mut().button_padding.x = 3.0;
            let has = |axis| matches!(marks.sides(axis), Sides::LeftRight | Sides::RightLeft);
            let [name, hint] = texts::EXCHANGE_LEFT_AND_RIGHT;
            let exchange = Button::new(name).min_size(vec2(width, ROW_HEIGHT));
            let exchange = ui.add_enabled(AXES.into_iter().any(has), exchange);
            exchange.tell(hint).on_disabled_hover_text(hint).gives(Command::ExchangeLeftAndRight, execute);
            for axis in AXES {
                section(ui, texts::axis(axis), |ui| {
                    for row in CHOICES {
                        ui.horizontal(|ui| {
                            let size = size_in(ui, width, row.len());
                            for sides in row {
                                let Some(sides) = sides else {
                                    ui.add_space(size.x + ui.spacing().item_spacing.x);
                                    continue;
                                };
                                let (text, [name, hint]) = (in_short(sides), texts::sides(axis, sides));
                                let button = (marks.sides(axis) == sides, &*text, size);
                                choice(ui, button, [&name, &hint], Command::Sides(axis, sides), execute);
                            }
                        });
                    }
                });
            }
            section(ui, texts::PROBE_MARKER, |ui| {
                ui.horizontal(|ui| {
                    let size = size_in(ui, width, MARKERS.len());
                    for marker in MARKERS {
                        let about = texts::probe_marker(marker);
                        let button = (marks.probe == marker, about[0], size);
                        choice(ui, button, about, Command::ProbeMarker(marker), execute);
                    }
                });
            });
        });
    switch(ui, marks.bar, texts::BAR_ON_SAVED_PICTURES, Command::SavesBar, execute);
    let header = shown.header_response.expanded(shown.openness > 0.5);
    header.tell(texts::SIDES_HINT).named(texts::SIDES).with_value(&known(marks));
}

/// The title, with the sides that are known.
fn title(marks: &Marks) -> String {
    match known(marks) {
        none if none.is_empty() => texts::SIDES.into(),
        known => texts::sides_in_short(known),
    }
}

/// The sides that are known, such as "R-L, H-F".
fn known(marks: &Marks) -> String {
    let known = AXES.map(|axis| marks.sides(axis)).into_iter().filter(|sides| *sides != Sides::None);
    known.map(in_short).collect::<Vec<_>>().join(", ")
}

fn in_short(sides: Sides) -> String {
    sides.letters().map_or(texts::NO_SIDES_SHORT.into(), |[low, high]| format!("{low}-{high}"))
}

/// The size of one of so many buttons in a row.
fn size_in(ui: &Ui, width: f32, count: usize) -> Vec2 {
    let gaps = ui.spacing().item_spacing.x * count.saturating_sub(1) as f32;
    vec2((width - gaps) / count.max(1) as f32, ROW_HEIGHT)
}

/// A button of which one is chosen: whether it is this one, its text and its size; its name and its hint.
fn choice(
    ui: &mut Ui,
    (is_chosen, text, size): (bool, &str, Vec2),
    [name, hint]: [&str; 2],
    command: Command,
    execute: Execute,
) {
    let button = Button::selectable(is_chosen, RichText::new(text).size(SMALL_TEXT)).frame_when_inactive(true);
    ui.add(button.min_size(size)).tell(hint).named(name).gives(command, execute);
}
