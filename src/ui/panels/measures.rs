//! Measuring: its tools, the list of results, and the measurements over the picture.

use super::canvas::Canvas;
use super::colours::{ACCENT, BACKING, MEASURE, OUTLINE, TEXT, WARNING, WEAK_TEXT};
use super::names::{self, Tell};
use super::overlays::first;
use super::widgets::{cell, say_step};
use super::{Execute, PanelState, ROW_HEIGHT, SMALL_TEXT, ShownPicture, TEXT_SIZE, icons, rail, section};
use crate::command::{Command, Effect, Tool};
use crate::measure::outcome::{self, Quantity};
use crate::measure::overlay::{self, Drawn};
use crate::picking::Picker;
use crate::scene::{MeasureKind, Scene};
use crate::texts;
use crate::texts::hints;
use egui::accesskit::Role;
use egui::{Button, Color32, FontId, Label, Painter, Pos2, Rect, RichText, Stroke, StrokeKind, Ui, pos2, vec2};

/// Tools that measure, and those that mark.
const MEASURING: [(MeasureKind, &str); 7] = [
    (MeasureKind::Distance, texts::CALIPER),
    (MeasureKind::Surface, texts::TAPE),
    (MeasureKind::Angle, texts::ANGLE),
    (MeasureKind::Ellipse, texts::ELLIPSE),
    (MeasureKind::Trace, texts::TRACE),
    (MeasureKind::Volume, texts::CONTOURS),
    (MeasureKind::Threshold, texts::AUTOMATIC_VOLUME),
];
const MARKING: [(Tool, &str); 3] = [
    (Tool::Measure(MeasureKind::Text), texts::TEXT),
    (Tool::Measure(MeasureKind::Arrow), texts::ARROW),
    (Tool::BodyMark, texts::BODY_MARK),
];

/// Half the size of a cross, and the length of an arrow's head, points.
const CROSS: f32 = 5.0;
const HEAD: f64 = 12.0;

/// Shows the buttons of the measuring tools, in rows `width` points wide.
pub(super) fn show_tools(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    names::group(ui, texts::MEASURE, |ui| {
        ui.add_space(2.0);
        for row in MEASURING.chunks(3) {
            let gaps = ui.spacing().item_spacing.x * (row.len() - 1) as f32;
            // What counts at once has the longest name, alone in its row.
            let size = vec2((width - gaps) / row.len() as f32, ROW_HEIGHT);
            ui.horizontal(|ui| {
                row.iter().for_each(|(kind, name)| tool_button(ui, state, Tool::Measure(*kind), name, size, execute));
            });
        }
    });
}

/// Shows the buttons of the tools for texts, arrows and body marks.
pub(super) fn show_marks(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    names::group(ui, texts::TAB_MARKS[0], |ui| {
        ui.add_space(2.0);
        let size = vec2((width - 2.0 * ui.spacing().item_spacing.x) / 3.0, ROW_HEIGHT);
        ui.horizontal(|ui| MARKING.iter().for_each(|(tool, name)| tool_button(ui, state, *tool, name, size, execute)));
        if let Tool::Measure(kind @ (MeasureKind::Text | MeasureKind::Arrow)) = state.controls.tool() {
            say_next_step(ui, state, kind);
        }
    });
}

fn tool_button(ui: &mut Ui, state: &PanelState, tool: Tool, name: &str, size: egui::Vec2, execute: Execute) {
    let is_on = state.controls.tool() == tool && tool != Tool::Measure(MeasureKind::Threshold);
    let command = match tool {
        // It counts at once.
        Tool::Measure(MeasureKind::Threshold) => Command::MeasureBody,
        // A second click leaves the tool.
        tool => Command::Tool(if is_on { Tool::default() } else { tool }),
    };
    let button = Button::selectable(is_on, name).frame_when_inactive(true).min_size(size);
    ui.add(button).tell(hints::of_tool(tool)).gives(command, execute);
}

/// Shows the list of results, `width` points wide, or a line that says that there are none.
pub(super) fn show_results(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let measures = state.controls.measures();
    let is_measuring = matches!(state.controls.tool(), Tool::Measure(_));
    if measures.is_empty() && state.controls.work().is_none() && !is_measuring {
        ui.add(Label::new(RichText::new(texts::NO_MEASUREMENTS).size(SMALL_TEXT).color(WEAK_TEXT)).wrap());
        return;
    }
    section(ui, texts::MEASUREMENTS, |ui| results(ui, state, width, execute));
}

fn results(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let measures = state.controls.measures();
    if let Tool::Measure(kind) = state.controls.tool() {
        say_next_step(ui, state, kind);
    }
    if let Some(work) = state.controls.work().filter(|work| work.kind.complete_at().is_none()) {
        let is_between = work.kind == MeasureKind::Volume && work.points.is_empty();
        let name = if is_between { texts::END_VOLUME } else { texts::CLOSE_CONTOUR };
        let button = ui.add_sized(vec2(width, ROW_HEIGHT), first(RichText::new(name)));
        button.tell(texts::END_TRACING_HINT).gives(Command::EndMeasure, execute);
    }
    for (n, measured) in measures.iter().enumerate() {
        ui.horizontal(|ui| {
            let found = outcome::quantities(measured).unwrap_or_default();
            let main = found.first().map_or(String::new(), Quantity::shown);
            let name = match (measured.kind, measured.text.is_empty()) {
                (_, false) => &measured.text,
                (MeasureKind::Threshold, true) => texts::AUTOMATIC_VOLUME,
                (_, true) => measured.title(),
            };
            let typing = if state.controls.typing() == Some(n) { "_" } else { "" };
            let text = RichText::new(format!("{} {name}{typing}", n + 1)).size(SMALL_TEXT);
            ui.spacing_mut().item_spacing.x = 4.0;
            let row = vec2((width - 32.0).max(40.0), ROW_HEIGHT);
            cell(ui, row, |ui| {
                let rest = found.iter().map(|q| format!("{}: {}", q.name, q.shown()));
                let hint: Vec<String> = rest.chain([texts::TYPE_TEXT_HINT.to_string()]).collect();
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.label(RichText::new(&main).color(MEASURE).size(SMALL_TEXT));
                    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                        let label = ui.add(Label::new(text).truncate().sense(egui::Sense::click()));
                        let spoken = format!("{} {name} {main}", n + 1);
                        let label = label.tell(&hint.join("\n")).with_role(Role::Button);
                        label.named(spoken.trim_end()).gives(Command::LabelMeasure(n), execute);
                    });
                });
            });
            let delete = rail::icon_button(ui, icons::CLOSE, ("", texts::DELETE), vec2(26.0, 28.0), (true, false));
            let delete = delete.tell(texts::DELETE_MEASUREMENT_HINT);
            delete.named(&texts::delete_measurement(n + 1)).gives(Command::DeleteMeasure(n), execute);
        });
    }
    if !measures.is_empty() {
        let third = vec2((width - 2.0 * ui.spacing().item_spacing.x) / 3.0, ROW_HEIGHT);
        ui.horizontal(|ui| {
            for (command, [name, hint]) in [
                (Command::CopyMeasures, texts::COPY),
                (Command::SaveMeasures, [texts::SAVE, texts::SAVE_RESULTS_HINT]),
                (Command::ClearMeasures, texts::CLEAR),
            ] {
                let button = Button::new(RichText::new(name).size(SMALL_TEXT + 1.0)).min_size(third);
                ui.add(button).tell(hint).gives(command, execute);
            }
        });
    }
}

fn say_next_step(ui: &mut Ui, state: &PanelState, kind: MeasureKind) {
    let work = state.controls.work().filter(|work| work.kind == kind);
    let set = work.map_or(0, |work| work.points.len());
    let has_contours = work.is_some_and(|work| !work.contours.is_empty());
    let is_typing = state.controls.typing().is_some();
    say_step(ui, if is_typing { texts::STEP_TYPE } else { hints::of_step(kind, set, has_contours) }, ACCENT);
}

/// Draws measurements and annotations, and the contour of a cut in progress, over the picture.
pub(super) fn paint(ui: &Ui, state: &PanelState, scale: f32) {
    let Some((ShownPicture { scene, volume, .. }, canvas)) = Canvas::of(ui, state, scale) else { return };
    let (measures, outline) = (state.controls.measures(), state.controls.outline());
    let effect = state.controls.labelling().map(|labels| labels.effect);
    let is_brush = match state.controls.tool() {
        Tool::Brush => !scene.is_flat(),
        Tool::Labels => matches!(effect, Some(Effect::Paint | Effect::Erase)),
        _ => false,
    };
    let is_empty = measures.is_empty() && state.controls.work().is_none() && outline.is_empty() && !is_brush;
    if is_empty {
        return;
    }
    let hover = canvas.hovered(ui);
    for mut drawn in overlay::drawn(scene, Some(*volume), measures) {
        if state.controls.typing() == Some(drawn.index) {
            drawn.label.push('_');
        }
        canvas.draw(&drawn);
    }
    if is_brush {
        let place = outline.last().map(|at| canvas.at(*at)).or(hover);
        // On a plane in its scale.
        let on_plane = place.and_then(|at| {
            let [x, y] = canvas.pixel(at).map(|n| n.max(0.0) as usize);
            scene.cuts_planes().then(|| scene.tiling().tile_at(x, y).map(|tile| tile.pixel)).flatten()
        });
        let place = place.filter(|_| on_plane.is_some() == (state.controls.tool() == Tool::Labels) || !scene.is_flat());
        let pixel = on_plane.unwrap_or_else(|| Picker::of(scene).mm_per_pixel());
        let radius = (state.controls.brush_radius() / pixel) as f32 / scale;
        if let Some(place) = place.filter(|_| radius.is_finite()) {
            for stroke in [Stroke::new(3.5, OUTLINE), Stroke::new(1.5, MEASURE)] {
                canvas.painter.circle_stroke(place, radius.min(1e4), stroke);
            }
        }
    }
    if let Some(last) = outline.last() {
        // A contour goes back to where it began, as it will be closed.
        let closing = [[*last, outline[0]]].into_iter().filter(|_| !is_brush);
        let ends = outline.windows(2).map(|ends| [ends[0], ends[1]]).chain(closing);
        canvas.lines(&canvas.painter, &ends.map(|ends| ends.map(|at| canvas.at(at))).collect::<Vec<_>>(), MEASURE);
    }
    if let Some(work) = state.controls.work() {
        let hover = hover.and_then(|at| place_at(scene, canvas.pixel(at)));
        let hover = hover.filter(|_| !work.on_surface);
        let is_curved = hover.is_some_and(|(_, is_curved)| is_curved);
        overlay::preview(scene, measures.len() + 1, work, hover.map(|(point, _)| point), is_curved)
            .iter()
            .for_each(|drawn| canvas.draw(drawn));
    }
}

/// The point of the settings that a plane shows at a position on the picture, mm; and whether that is a curved plane.
fn place_at(scene: &Scene, at: [f64; 2]) -> Option<([f64; 3], bool)> {
    let tiling = scene.cuts_planes().then(|| scene.tiling())?;
    let tile = tiling.tile_at(at[0].max(0.0) as usize, at[1].max(0.0) as usize)?;
    Some((scene.point_of(tiling.point(tile, at)), tile.section.is_some()))
}

impl Canvas {
    /// A dark edge along the bright line is visible on any picture.
    fn lines(&self, painter: &Painter, strokes: &[[Pos2; 2]], colour: Color32) {
        for stroke in [Stroke::new(3.5, OUTLINE), Stroke::new(1.5, colour)] {
            strokes.iter().for_each(|ends| _ = painter.line_segment(*ends, stroke));
        }
    }

    fn draw(&self, drawn: &Drawn) {
        let [corner, size] = drawn.tile;
        let painter = self.within(corner, size);
        let mut strokes: Vec<[Pos2; 2]> = Vec::new();
        for line in &drawn.lines {
            strokes.extend(line.windows(2).map(|ends| [self.at(ends[0]), self.at(ends[1])]));
        }
        for (_, at) in &drawn.points {
            let at = self.at(*at);
            strokes.push([at - vec2(CROSS, 0.0), at + vec2(CROSS, 0.0)]);
            strokes.push([at - vec2(0.0, CROSS), at + vec2(0.0, CROSS)]);
        }
        let heads = drawn.head.iter().flat_map(|head| overlay::arrow_head(*head, HEAD * f64::from(self.scale)));
        strokes.extend(heads.map(|ends| ends.map(|at| self.at(at))));
        // What belongs to another volume is dimmed.
        let line = if drawn.is_of_other { WEAK_TEXT } else { MEASURE };
        self.lines(&painter, &strokes, line);
        if drawn.label.is_empty() {
            return;
        }
        let colour = match (drawn.label.as_str(), drawn.is_of_other) {
            ("_", _) => WARNING,
            (_, true) => WEAK_TEXT,
            (_, false) => TEXT,
        };
        let galley = painter.layout_no_wrap(drawn.label.clone(), FontId::proportional(TEXT_SIZE - 2.0), colour);
        let size = (galley.size() + vec2(8.0, 2.0)) * self.scale;
        let corner = self.at(overlay::label_corner(drawn, [f64::from(size.x), f64::from(size.y)]));
        let area = Rect::from_min_size(corner, size / self.scale);
        painter.rect_filled(area, 3.0, BACKING);
        painter.rect_stroke(area, 3.0, Stroke::new(1.0, line.gamma_multiply(0.5)), StrokeKind::Inside);
        painter.galley(pos2(area.left() + 4.0, area.center().y - galley.size().y / 2.0), galley, colour);
    }
}
