//! The list of open recordings, and the file that is being read.

use super::colours::{ACCENT, BAR, EDGE, TEXT, WHOLE_BAR};
use super::names::{self, Tell};
use super::widgets::{BETWEEN_MESSAGES, MESSAGE_EDGES, command_button, message_frame};
use super::{Execute, PanelState, ROW_HEIGHT, SMALL_TEXT, TEXT_SIZE, TOUCH_SIZE, icons, picture_rect, rail, section};
use crate::command::Command;
use crate::texts;
use egui::accesskit::Role;
use egui::{
    Align2, Area, Button, FontId, Id, Label, Order, Pos2, Rect, RichText, Sense, Stroke, StrokeKind, Ui, WidgetInfo,
    WidgetType, vec2,
};

/// The name of the file that is being read, and its progress.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    pub name: String,
    /// Progress from 0 to 1; None if not known. `text` states it in words.
    pub share: Option<f32>,
    pub text: String,
}

/// Width of the button that closes a recording, points.
const CLOSE: f32 = 36.0;

/// Shows the list of open recordings, if more than one is open.
pub(super) fn show_list(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    if state.recordings.len() < 2 {
        return;
    }
    let height = ROW_HEIGHT;
    let name = vec2(width - CLOSE - ui.spacing().item_spacing.x, height);
    section(ui, texts::RECORDINGS, |ui| {
        for (n, recording) in state.recordings.iter().enumerate() {
            ui.horizontal(|ui| {
                let button = Button::selectable(recording.is_shown, &recording.name).frame_when_inactive(true);
                let button = ui.add_sized(name, button.truncate());
                let button = button.tell(&texts::recording_hint(&recording.path)).named(&recording.name);
                button.gives(Command::ShowRecording(n), execute);
                let close = rail::icon_button(ui, icons::CLOSE, ("", texts::CLOSE), vec2(CLOSE, height), (true, false));
                let close = close.tell(texts::CLOSE_RECORDING_HINT);
                close.named(&texts::close_recording(&recording.name)).gives(Command::CloseRecording(n), execute);
            });
        }
    });
}

/// Height of what [`show_reading`] draws, with and without bar and button, points.
const HEIGHTS: [f32; 2] = [102.0, 44.0];
/// A picture of less height has the name and how far it is alone, points.
const MIN_FOR_BAR: f32 = 240.0;
const CANCEL: f32 = 96.0;

/// What [`show_reading`] draws over a picture.
struct ReadingPlace {
    has_bar: bool,
    height: f32,
    width: f32,
    /// The middle of the upper edge.
    top: Pos2,
    /// Whether nothing else is shown, so that it is in the middle of the picture.
    is_alone: bool,
}

fn reading_place(state: &PanelState, scale: f32) -> ReadingPlace {
    let picture = picture_rect(state, scale);
    let has_bar = picture.height() >= MIN_FOR_BAR;
    let height = HEIGHTS[usize::from(!has_bar)];
    let width = (picture.width() - 60.0).clamp(60.0, 420.0);
    let is_alone = state.picture.is_none() && state.notes.is_empty() && state.banner.is_none();
    let low = picture.center_bottom() - vec2(0.0, MESSAGE_EDGES[1] + height);
    let top = if is_alone { picture.center() - vec2(0.0, height / 2.0) } else { low };
    ReadingPlace { has_bar, height, width, top, is_alone }
}

/// The area that [`show_reading`] covers, points; None if no file is being read.
pub(super) fn reading_area(state: &PanelState, scale: f32) -> Option<Rect> {
    state.reading?;
    let ReadingPlace { height, width, top, .. } = reading_place(state, scale);
    // With its frame.
    Some(Rect::from_min_size(top - vec2(width / 2.0, 0.0), vec2(width, height)).expand2(vec2(16.0, 0.0)))
}

/// Shows the progress of the file that is being read over the picture, below the messages. Returns the height that it takes from them, points.
pub(super) fn show_reading(ui: &mut Ui, state: &PanelState, scale: f32, execute: Execute) -> f32 {
    let Some(reading) = state.reading else { return 0.0 };
    let ReadingPlace { has_bar, height, width, top, is_alone } = reading_place(state, scale);
    let area = Area::new(Id::new("reading")).order(Order::Middle).pivot(Align2::CENTER_TOP).fixed_pos(top);
    area.interactable(has_bar).show(ui.ctx(), |ui| {
        message_frame(ACCENT).show(ui, |ui| {
            ui.set_width(width);
            names::announce(ui, &texts::reading(&reading.name), false);
            let title = texts::reading(&reading.name);
            let (title, size) =
                if has_bar { (title, TEXT_SIZE) } else { (format!("{title}  {}", reading.text), SMALL_TEXT) };
            ui.add(Label::new(RichText::new(title).size(size).color(TEXT)).truncate());
            if has_bar {
                ui.horizontal(|ui| {
                    bar(ui, reading, width - CANCEL - ui.spacing().item_spacing.x);
                    let size = vec2(CANCEL, TOUCH_SIZE * 0.75);
                    command_button(ui, size, texts::CANCEL_READING, Command::CancelReading, execute);
                });
            }
        });
    });
    if is_alone { 0.0 } else { height + BETWEEN_MESSAGES }
}

fn bar(ui: &mut Ui, reading: &Reading, width: f32) {
    let (area, response) = ui.allocate_exact_size(vec2(width, TOUCH_SIZE * 0.5), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::ProgressIndicator, true, texts::READING_SHARE));
    let response = response.with_role(Role::ProgressIndicator).with_value(&reading.text);
    names::progress(&response, reading.share);
    let painter = ui.painter();
    painter.rect_filled(area, 3.0, WHOLE_BAR);
    let filled = Rect::from_min_size(area.min, vec2(area.width() * reading.share.unwrap_or(0.0), area.height()));
    painter.rect_filled(filled, 3.0, BAR);
    painter.rect_stroke(area, 3.0, Stroke::new(1.0, EDGE), StrokeKind::Inside);
    painter.text(area.center(), Align2::CENTER_CENTER, &reading.text, FontId::proportional(TEXT_SIZE), TEXT);
}
