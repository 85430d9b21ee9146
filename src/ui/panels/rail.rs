//! The rail on the left: every tool as an icon, with a word if there is room. If not all icons have room, a button opens them in the inspector.

use super::colours::{ACCENT, BUTTON, CHOSEN, EDGE, PANEL, TEXT, WEAK_TEXT};
use super::icons::{self, Icon};
use super::names::{self, Tell};
use super::widgets::in_rows;
use super::{Execute, PanelState, RAIL_WIDTH, SMALL_TEXT, section};
use crate::command::{Command, InspectorTab, Tool};
use crate::scene::MeasureKind;
use crate::texts;
use crate::texts::hints;
use egui::accesskit::Role;
use egui::{
    Align2, FontId, Frame, Panel, Rect, Response, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, WidgetType, vec2,
};

/// A button of the rail: what it is called, its icon, and the tools that it stands for (the first is chosen by it).
type Place = (&'static str, Icon, &'static [Tool]);

/// In the order of the rail; measuring begins with the second part.
const PLACES: [&[Place]; 2] = [
    &[
        (texts::TURN, icons::TURN, &[Tool::Rotate]),
        (texts::LIGHT, icons::LIGHT, &[Tool::Light]),
        (texts::REGION, icons::REGION, &[Tool::Region]),
        (texts::CLIP, icons::CLIP, &[Tool::Clip]),
        (texts::CUT, icons::CUT, &[Tool::Cut]),
        (texts::BRUSH, icons::BRUSH, &[Tool::Brush]),
        (texts::CROSSHAIR, icons::CROSSHAIR, &[Tool::Plane]),
        (texts::CURVE, icons::CURVE, &[Tool::Curve]),
    ],
    &[
        (
            texts::DISTANCE,
            icons::DISTANCE,
            &[Tool::Measure(MeasureKind::Distance), Tool::Measure(MeasureKind::Surface)],
        ),
        (texts::AREA, icons::AREA, &[Tool::Measure(MeasureKind::Ellipse), Tool::Measure(MeasureKind::Trace)]),
        (texts::ANGLE, icons::ANGLE, &[Tool::Measure(MeasureKind::Angle)]),
        (texts::MEASURED_VOLUME, icons::VOLUME, &[Tool::Measure(MeasureKind::Volume)]),
        (texts::LABELS, icons::LABELS, &[Tool::Labels]),
        (texts::TEXT, icons::TEXT, &[Tool::Measure(MeasureKind::Text), Tool::Measure(MeasureKind::Arrow)]),
        (texts::BODY, icons::BODY, &[Tool::BodyMark]),
    ],
];

/// Height of a button: at most, the least with a word, and the least with the icon alone, points.
const HEIGHTS: [f32; 3] = [52.0, 37.0, 28.0];
/// Between the two parts, and above and below all, points.
const GAPS: f32 = 16.0;

/// Height of a button in a rail (the column of tools) of this height, points; none if not all of them have room.
pub(super) fn button_height(height: f32) -> Option<f32> {
    let count: usize = PLACES.iter().map(|part| part.len()).sum();
    let each = (height - GAPS) / count as f32;
    (each >= HEIGHTS[2]).then(|| each.min(HEIGHTS[0]).floor())
}

pub(super) fn show(ui: &mut Ui, state: &PanelState, height: f32, execute: Execute) {
    let frame = Frame::new().fill(PANEL);
    let rail = Panel::left("rail").exact_size(RAIL_WIDTH).resizable(false).show_separator_line(false).frame(frame);
    rail.show(ui, |ui| {
        names::name(ui, Role::Toolbar, texts::TOOLS);
        ui.spacing_mut().item_spacing = Vec2::ZERO;
        ui.add_space(4.0);
        let size = |height: f32| vec2(RAIL_WIDTH, height);
        let Some(each) = button_height(height) else {
            // The most used, as many as have room, and what opens all.
            let shown = ((height - 8.0) / HEIGHTS[0]).floor() as usize;
            for place in PLACES.into_iter().flatten().take(shown.saturating_sub(1)) {
                tool(ui, state, place, size(HEIGHTS[0]), execute);
            }
            let [name, hint] = texts::TAB_TOOLS;
            let more = button(ui, icons::TOOLS, name, size(HEIGHTS[0]), false);
            more.tell(hint).gives(Command::InspectorTab(InspectorTab::Tools), execute);
            return;
        };
        for (n, part) in PLACES.into_iter().enumerate() {
            if n > 0 {
                let (line, _) = ui.allocate_exact_size(size(GAPS - 8.0), Sense::hover());
                ui.painter().hline(line.x_range().shrink(16.0), line.center().y, Stroke::new(1.0, EDGE));
            }
            part.iter().for_each(|place| tool(ui, state, place, size(each), execute));
        }
    });
}

/// Shows the tools as a grid in the inspector, `width` points wide.
pub(super) fn show_grid(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    section(ui, texts::TOOLS, |ui| {
        let columns = (width / RAIL_WIDTH).floor().max(1.0);
        let size = vec2(width / columns, HEIGHTS[0]);
        ui.spacing_mut().item_spacing = Vec2::ZERO;
        let all = PLACES.into_iter().flatten();
        in_rows(ui, all, columns as usize, |ui, place| tool(ui, state, place, size, execute));
    });
}

fn tool(ui: &mut Ui, state: &PanelState, &(name, icon, tools): &Place, size: Vec2, execute: Execute) {
    let is_chosen = tools.contains(&state.controls.tool());
    let response = button(ui, icon, name, size, is_chosen);
    // A second click leaves a tool.
    let command = Command::Tool(if is_chosen { Tool::default() } else { tools[0] });
    response.tell(hints::of_tool(tools[0])).gives(command, execute);
}

/// An icon, with its name below it where there is room.
fn button(ui: &mut Ui, icon: Icon, name: &str, size: Vec2, is_chosen: bool) -> Response {
    let (area, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_chosen, name));
    let inner = area.shrink2(vec2(4.0, 1.0));
    let is_over = response.hovered() || response.has_focus();
    let painter = ui.painter();
    if is_chosen {
        painter.rect(inner, 6.0, CHOSEN, Stroke::new(1.0, ACCENT), StrokeKind::Inside);
    } else if is_over {
        painter.rect_filled(inner, 6.0, BUTTON);
    }
    let has_word = size.y >= HEIGHTS[1];
    let colour = match (is_chosen, is_over) {
        (true, _) => ACCENT,
        (false, true) => TEXT,
        (false, false) => WEAK_TEXT,
    };
    let edge = if has_word { (size.y - 20.0).clamp(16.0, 22.0) } else { 20.0_f32.min(size.y - 8.0) };
    let rows = edge + if has_word { SMALL_TEXT + 1.0 } else { 0.0 };
    let top = area.center().y - rows / 2.0;
    let middle = Rect::from_min_size(egui::pos2(area.center().x - edge / 2.0, top), vec2(edge, edge));
    paint(painter, icon, middle, colour);
    if has_word {
        let at = egui::pos2(area.center().x, top + rows);
        let word = if is_chosen { ACCENT } else { TEXT };
        painter.text(at, Align2::CENTER_BOTTOM, name, FontId::proportional(SMALL_TEXT - 1.0), word);
    }
    response
}

/// Draws an icon into a square, points.
pub(super) fn paint(painter: &egui::Painter, icon: Icon, square: Rect, colour: egui::Color32) {
    let stroke = Stroke::new((square.width() / 12.0).max(1.2), colour);
    for line in icon.split(|n| *n == u8::MAX) {
        let (points, _) = line.as_chunks::<2>();
        let at = |[x, y]: &[u8; 2]| square.min + vec2(f32::from(*x), f32::from(*y)) * (square.width() / 240.0);
        painter.line(points.iter().map(at).collect(), stroke);
    }
}

/// A button with an icon and a text, which may be empty. `name`: its name for a screen reader; `size`: points.
pub(super) fn icon_button(
    ui: &mut Ui,
    icon: Icon,
    (text, name): (&str, &str),
    size: Vec2,
    (is_enabled, is_chosen): (bool, bool),
) -> Response {
    let sense = if is_enabled { Sense::click() } else { Sense::hover() };
    let response = ui.add_enabled_ui(is_enabled, |ui| ui.allocate_exact_size(size, sense).1).inner;
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, is_enabled, name));
    let area = response.rect;
    let (is_over, painter) = (is_enabled && (response.hovered() || response.has_focus()), ui.painter());
    let fill = if is_chosen { CHOSEN } else { BUTTON };
    let edge = if is_over { TEXT } else { EDGE };
    let stroke = Stroke::new(1.0, if is_chosen { ACCENT } else { edge });
    painter.rect(area.shrink(0.5), 6.0, fill, stroke, StrokeKind::Inside);
    let colour = match (is_enabled, is_chosen) {
        (false, _) => super::colours::ABSENT,
        (true, true) => ACCENT,
        (true, false) => TEXT,
    };
    let edge = if icon.is_empty() { 0.0 } else { 18.0_f32.min(size.y - 8.0) };
    let font = FontId::proportional(super::TEXT_SIZE);
    let words = painter.layout_no_wrap(text.to_string(), font, colour);
    let gap = if text.is_empty() || icon.is_empty() { 0.0 } else { 8.0 };
    let left = area.center().x - (edge + gap + words.size().x) / 2.0;
    let square = Rect::from_center_size(egui::pos2(left + edge / 2.0, area.center().y), vec2(edge, edge));
    paint(painter, icon, square, colour);
    painter.galley(egui::pos2(left + edge + gap, area.center().y - words.size().y / 2.0), words, colour);
    response
}
