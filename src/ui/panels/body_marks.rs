//! Body marks over the picture, and their controls while their tool is selected.

use super::colours::{BODY, MEASURE, OUTLINE, SELECTED, TEXT, WEAK_TEXT};
use super::names::Tell;
use super::widgets::{add_and_remove, in_rows, say_step, scale_slider, switch};
use super::{Execute, PanelState, ROW_HEIGHT, picture_rect, section, shown};
use crate::command::{Command, Tool};
use crate::measure::body_marks::{self, Drawn};
use crate::scene::{BODY_MARK_SIZES, Body, BodyMark, MAX_BODY_MARKS};
use crate::texts;
use egui::{Button, Painter, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, WidgetInfo, WidgetType, vec2};

/// Columns of the buttons of parts of the body.
const COLUMNS: usize = 4;

/// Draws the body marks over the picture. While their tool is selected, their squares are drawn, too, the selected one brighter.
pub(super) fn paint(ui: &Ui, state: &PanelState, scale: f32) {
    let Some((shown, picture)) = shown(state, scale) else { return };
    let painter = ui.ctx().layer_painter(egui::LayerId::background()).with_clip_rect(picture_rect(state, scale));
    let is_chosen = state.controls.tool() == Tool::BodyMark;
    let about = state.controls.body_mark().map(|(index, _)| index);
    for drawn in body_marks::drawn(state.controls.body_marks(), shown.scene.picture_size().map(f64::from)) {
        if is_chosen {
            let colour = if about == Some(drawn.index) { MEASURE } else { WEAK_TEXT };
            let area = area_of(&drawn, &picture, scale);
            painter.rect_stroke(area, 3.0, Stroke::new(1.0, colour), StrokeKind::Inside);
        }
        draw(&painter, |place| at(&picture, scale, place), scale, &drawn);
    }
}

/// The squares of the body marks, points, which other annotations do not cover.
pub(super) fn areas(state: &PanelState, scale: f32) -> Vec<Rect> {
    let Some((shown, picture)) = shown(state, scale) else { return Vec::new() };
    let marks = body_marks::drawn(state.controls.body_marks(), shown.scene.picture_size().map(f64::from));
    marks.iter().map(|drawn| area_of(drawn, &picture, scale)).collect()
}

fn area_of(drawn: &Drawn, picture: &Rect, scale: f32) -> Rect {
    Rect::from_min_size(at(picture, scale, drawn.corner), vec2(1.0, 1.0) * drawn.edge as f32 / scale)
}

fn at(picture: &Rect, scale: f32, [x, y]: [f64; 2]) -> Pos2 {
    picture.min + vec2(x as f32, y as f32) / scale
}

/// Draws a mark: the body as a thin line, the probe as a bar with a dot at its marker, all with a dark edge.
fn draw(painter: &Painter, place: impl Fn([f64; 2]) -> Pos2, scale: f32, drawn: &Drawn) {
    let edge = drawn.edge as f32 / scale;
    let width = (edge / 65.0).clamp(1.0, 3.0);
    let lines: Vec<Vec<Pos2>> =
        drawn.outline.iter().map(|line| line.iter().map(|point| place(*point)).collect()).collect();
    for stroke in [Stroke::new(width + 2.0, OUTLINE), Stroke::new(width, BODY)] {
        lines.iter().for_each(|line| _ = painter.line(line.clone(), stroke));
    }
    let [marker, other] = drawn.probe.map(place);
    for (wider, colour) in [(2.0, OUTLINE), (0.0, MEASURE)] {
        painter.line_segment([marker, other], Stroke::new(2.0 * width + wider, colour));
        painter.circle_filled(marker, drawn.dot as f32 / scale + wider / 2.0, colour);
    }
}

/// Shows the controls of the selected body mark while the tool for body marks is selected.
pub(super) fn show(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    if state.controls.tool() != Tool::BodyMark {
        return;
    }
    let about = state.controls.body_mark();
    section(ui, texts::BODY_MARK, |ui| {
        ui.set_max_width(width);
        let step = if about.is_some() { texts::BODY_MARK_STEP } else { texts::BODY_MARK_FIRST_STEP };
        say_step(ui, step, TEXT);
        bodies(ui, about, width, execute);
        let Some((index, mark)) = about else { return };
        let change = |new: BodyMark| Command::ChangeBodyMark(index, new);
        let mirror = |mirrored| change(BodyMark { mirrored, ..mark });
        switch(ui, mark.mirrored, texts::MIRRORED, mirror, execute);
        let words = [texts::TURN_OF_PROBE, texts::TURN_OF_PROBE_HINT];
        let turned = (mark.angle, format!("{:.0}°", mark.angle));
        let turn = |angle| change(BodyMark { angle, ..mark });
        scale_slider(ui, words, turned, ([-180.0, 180.0], 5.0), turn, execute);
        let in_percent = |share: f64| (share, format!("{:.0} %", share * 100.0));
        let with = |mut shares: [f64; 2], axis: usize, share: f64| {
            shares[axis] = share;
            shares
        };
        for (axis, name) in [texts::PROBE_ACROSS, texts::PROBE_DOWN].into_iter().enumerate() {
            let (words, share) = ([name, texts::PROBE_ON_BODY_HINT], in_percent(mark.probe[axis]));
            let to = |share| change(BodyMark { probe: with(mark.probe, axis, share), ..mark });
            scale_slider(ui, words, share, ([-1.0, 1.0], 0.05), to, execute);
        }
        let resize = |size| change(BodyMark { size, ..mark });
        scale_slider(ui, texts::SIZE_OF_MARK, in_percent(mark.size), (BODY_MARK_SIZES, 0.01), resize, execute);
        for (axis, name) in [texts::MARK_ACROSS, texts::MARK_DOWN].into_iter().enumerate() {
            let (words, share) = ([name, texts::PLACE_OF_MARK_HINT], in_percent(mark.at[axis]));
            let to = |share| change(BodyMark { at: with(mark.at, axis, share), ..mark });
            scale_slider(ui, words, share, ([0.0, 1.0], 0.01), to, execute);
        }
        others(ui, state, (index, mark), width, execute);
    });
}

/// Buttons with the parts of the body: a press gives the mark that part, or adds the first mark.
fn bodies(ui: &mut Ui, about: Option<(usize, BodyMark)>, width: f32, execute: Execute) {
    let gap = ui.spacing().item_spacing.x;
    let edge = ((width - gap * (COLUMNS - 1) as f32) / COLUMNS as f32).min(52.0);
    in_rows(ui, Body::ALL, COLUMNS, |ui, body| {
        let is_on = about.is_some_and(|(_, mark)| mark.body == body);
        let (area, response) = ui.allocate_exact_size(vec2(edge, edge), Sense::click());
        let name = body.title();
        response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_on, name));
        let response = response.tell(name);
        let visuals = ui.style().interact_selectable(&response, is_on);
        let painter = ui.painter();
        let fill = if is_on { SELECTED } else { visuals.weak_bg_fill };
        painter.rect(area, 4.0, fill, visuals.bg_stroke, StrokeKind::Inside);
        let inner = area.shrink(edge * 0.1);
        // As the mark will be: alone in a picture that it fills.
        let mirrored = about.is_some_and(|(_, mark)| mark.mirrored);
        let shown = BodyMark { body, mirrored, at: [0.5; 2], size: 1.0, ..BodyMark::default() };
        for drawn in body_marks::drawn(&[shown], [f64::from(inner.width()); 2]) {
            for line in &drawn.outline {
                let line = line.iter().map(|place| at(&inner, 1.0, *place)).collect();
                painter.line(line, Stroke::new(1.0, visuals.text_color()));
            }
        }
        let command = match about {
            Some((index, mark)) => Command::ChangeBodyMark(index, BodyMark { body, ..mark }),
            None => Command::AddBodyMark(body),
        };
        response.gives(command, execute);
    });
}

/// The numbers of several marks, and buttons that add one and remove this one.
fn others(ui: &mut Ui, state: &PanelState, (index, mark): (usize, BodyMark), width: f32, execute: Execute) {
    let (count, gap) = (state.controls.body_marks().len(), ui.spacing().item_spacing.x);
    if count > 1 {
        let each = vec2((width - gap * (count - 1) as f32) / count as f32, ROW_HEIGHT);
        ui.horizontal(|ui| {
            for n in 0..count {
                let name = texts::body_mark(n + 1);
                let button = Button::selectable(n == index, (n + 1).to_string()).frame_when_inactive(true);
                let response = ui.add(button.min_size(each)).tell(texts::SELECT_BODY_MARK_HINT);
                response.named(&name).gives(Command::SelectBodyMark(n), execute);
            }
        });
    }
    let both = [
        (Command::AddBodyMark(mark.body), texts::ADD_BODY_MARK, count < MAX_BODY_MARKS),
        (Command::RemoveBodyMark(index), texts::REMOVE_BODY_MARK, true),
    ];
    add_and_remove(ui, width, both, execute);
}
