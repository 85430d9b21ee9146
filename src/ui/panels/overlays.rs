//! Drawn over the picture: banner and notes, times, help, a question with its answers, and the pointer where no windowing system draws one.

use super::annotations;
use super::colours::{
    ACCENT, BAR, FAULT, FOCUS_EDGE, GOOD, MESSAGE, ON_SELECTED, PANEL, POINTER, SELECTED, SHADE, TEXT, WARNING,
    WEAK_TEXT, WHOLE_BAR,
};
use super::names::{self, Tell};
use super::widgets::{BETWEEN_MESSAGES, MESSAGE_EDGES, cell, message_frame};
use super::{Execute, LARGE_TEXT, Note, PanelState, SMALL_TEXT, TEXT_SIZE, TOUCH_SIZE, picture_rect};
use crate::command::Command;
use crate::texts::keys;
use crate::texts::{self, Unsaved};
use crate::times::RecentTimes;
use egui::accesskit::Role;
use egui::text::LayoutJob;
use egui::{
    Align2, Area, Button, Color32, FontId, Frame, Galley, Id, LayerId, Margin, Mesh, Order, Rect, RichText, ScrollArea,
    Shape, Stroke, Ui, Vec2, WidgetInfo, WidgetType, pos2, vec2,
};
use std::sync::Arc;

/// Sizes of the text of messages, title first, where the picture has room for them, and where it is small.
const MESSAGE_TEXT: [f32; 2] = [LARGE_TEXT, TEXT_SIZE];
const SMALL_MESSAGE_TEXT: [f32; 2] = [TEXT_SIZE, SMALL_TEXT];
/// A picture with less room has small messages, points.
const MIN_FOR_LARGE_MESSAGES: [f32; 2] = [340.0, 260.0];
/// Frame and margins of a message, together on two sides.
const MESSAGE_FRAME: [f32; 2] = [36.0, 24.0];

/// A message whose text is laid out.
struct Message {
    parts: Vec<Arc<Galley>>,
    edge: Color32,
    spoken: String,
    is_fault: bool,
}

impl Message {
    /// Lays texts out in so much room for a message, each with its size and colour. What has no room ends in dots.
    fn new(ui: &Ui, texts: &[(&str, f32, Color32)], room: Vec2, edge: Color32, is_fault: bool) -> Message {
        let [across, down] = MESSAGE_FRAME;
        let width = (room.x - across).clamp(60.0, 760.0);
        let mut left = room.y - down;
        let mut parts: Vec<Arc<Galley>> = Vec::new();
        for (text, size, colour) in texts.iter().filter(|(text, ..)| !text.is_empty()) {
            let font = FontId::proportional(*size);
            let row = ui.fonts_mut(|fonts| fonts.row_height(&font));
            let rows = (left / row).floor();
            if rows < 1.0 && !parts.is_empty() {
                break;
            }
            let mut job = LayoutJob::simple((*text).to_string(), font, *colour, width);
            job.wrap.max_rows = (rows as usize).max(1);
            let galley = ui.fonts_mut(|fonts| fonts.layout_job(job));
            left -= galley.size().y + BETWEEN_MESSAGES;
            parts.push(galley);
        }
        let spoken = texts.iter().map(|(text, ..)| *text).collect::<Vec<_>>().join(". ");
        Message { parts, edge, spoken, is_fault }
    }

    fn size(&self) -> Vec2 {
        let gaps = self.parts.len().saturating_sub(1) as f32 * BETWEEN_MESSAGES;
        let sizes = self.parts.iter().map(|part| part.size());
        let size = sizes.fold(Vec2::ZERO, |all, one| vec2(all.x.max(one.x), all.y + one.y));
        vec2(size.x + MESSAGE_FRAME[0], size.y + gaps + MESSAGE_FRAME[1])
    }

    fn show(self, ui: &mut Ui) {
        message_frame(self.edge).show(ui, |ui| {
            names::announce(ui, &self.spoken, self.is_fault);
            self.parts.into_iter().for_each(|part| _ = ui.label(part));
        });
    }
}

/// Shows the banner and the notes over the picture, one above the other. If there is not enough room, newer notes displace older ones and then
/// the banner, until they end. `taken`: height at the lower edge of the picture that is in use, points. Returns the covered areas, points:
/// letters of sides and markers are not drawn there, and the scale only if it has no other place.
pub(super) fn show_notes(ui: &mut Ui, state: &PanelState, scale: f32, taken: f32) -> Vec<Rect> {
    if state.banner.is_none() && state.notes.is_empty() {
        return Vec::new();
    }
    let picture = picture_rect(state, scale);
    let marks = if state.visible.panels { annotations::areas(state, scale) } else { Default::default() };
    // Messages are narrower where whole ones would cover a mark; and the newest one is alone where all would.
    let attempts = [usize::MAX, 1].into_iter().flat_map(|count| WIDTHS.map(|share| (count, share)));
    let mut placed = attempts.map(|(count, share)| messages(ui, state, picture, taken, (count, share), &marks));
    let Some(mut least) = placed.next() else { return Vec::new() };
    while least.covered != 0.0
        && let Some(messages) = placed.next()
    {
        if messages.covered < least.covered {
            least = messages;
        }
    }
    let mut areas = Vec::new();
    for (name, (place, messages)) in [("banner", least.banner), ("notes", least.notes)] {
        if messages.is_empty() {
            continue;
        }
        areas.push(place);
        let area = Area::new(Id::new(name)).order(Order::Middle).fixed_pos(place.min).interactable(false);
        area.show(ui.ctx(), |ui| {
            ui.spacing_mut().item_spacing.y = BETWEEN_MESSAGES;
            ui.set_width(place.width());
            ui.vertical_centered(|ui| messages.into_iter().for_each(|message| message.show(ui)));
        });
    }
    areas
}

/// Shares of the room's width that messages may have.
const WIDTHS: [f32; 4] = [1.0, 0.7, 0.5, 0.35];

/// Banner and notes where they are shown, the oldest first.
struct Messages {
    banner: (Rect, Vec<Message>),
    notes: (Rect, Vec<Message>),
    /// How much the covered annotations matter; 0 if nothing is covered.
    covered: f32,
}

fn messages(
    ui: &Ui,
    state: &PanelState,
    picture: Rect,
    taken: f32,
    (count, share): (usize, f32),
    marks: &[Vec<Rect>; 2],
) -> Messages {
    let is_large = picture.width() >= MIN_FOR_LARGE_MESSAGES[0] && picture.height() >= MIN_FOR_LARGE_MESSAGES[1];
    let [title_size, text_size] = if is_large { MESSAGE_TEXT } else { SMALL_MESSAGE_TEXT };
    let [above, below] = [MESSAGE_EDGES[0], MESSAGE_EDGES[1] + taken];
    let room = vec2((picture.width() - 24.0) * share, picture.height() - above - below);
    let note = |note: &Note| {
        let texts = [(note.text.as_str(), text_size, TEXT)];
        Message::new(ui, &texts, room, if note.is_fault { FAULT } else { ACCENT }, note.is_fault)
    };
    let newest = state.notes.last().map_or(0.0, |newest| note(newest).size().y + BETWEEN_MESSAGES);
    let banner = state.banner.as_ref().map(|banner| {
        let colour = if banner.is_fault { FAULT } else { WARNING };
        let texts = [(banner.title.as_str(), title_size, colour), (banner.text.as_str(), text_size, TEXT)];
        Message::new(ui, &texts, vec2(room.x, room.y - newest), colour, banner.is_fault)
    });
    let banner = banner.filter(|banner| banner.size().y + newest <= room.y);
    let mut left = room.y - banner.as_ref().map_or(0.0, |banner| banner.size().y + BETWEEN_MESSAGES);
    // In the centre without a picture and without notes, at the top over one.
    let is_at_top = state.picture.is_some() || !state.notes.is_empty();
    let mut shown: Vec<Message> = Vec::new();
    for message in state.notes.iter().rev().take(count).map(note) {
        left -= message.size().y + BETWEEN_MESSAGES;
        if left < -BETWEEN_MESSAGES && !shown.is_empty() {
            break;
        }
        shown.push(message);
    }
    shown.reverse();
    let free = Rect::from_min_max(picture.min + vec2(12.0, above), picture.max - vec2(12.0, below));
    let mut covered = 0.0;
    let mut place = |messages: Vec<Message>, from: Align2, others: &[Rect]| {
        let (place, is_bad) = place(stack(&messages), free, from, marks, others);
        covered += if messages.is_empty() { 0.0 } else { is_bad };
        (place, messages)
    };
    let from = if is_at_top { Align2::CENTER_TOP } else { Align2::CENTER_CENTER };
    let banner = place(banner.into_iter().collect(), from, &[]);
    let notes =
        place(shown, Align2::CENTER_BOTTOM, if banner.1.is_empty() { &[] } else { std::slice::from_ref(&banner.0) });
    Messages { banner, notes, covered }
}

/// The size of messages one above the other.
fn stack(messages: &[Message]) -> Vec2 {
    let sizes = messages.iter().map(Message::size);
    let size = sizes.fold(Vec2::ZERO, |all, one| vec2(all.x.max(one.x), all.y + one.y + BETWEEN_MESSAGES));
    size - vec2(0.0, BETWEEN_MESSAGES)
}

/// The place of messages nearest to where they belong that covers no mark and nothing else, or as little as possible; and how bad that is.
fn place(size: Vec2, free: Rect, from: Align2, marks: &[Vec<Rect>; 2], others: &[Rect]) -> (Rect, f32) {
    const STEPS: f32 = 24.0;
    let home = from.align_size_within_rect(size, free);
    let moves = |room: f32| {
        let step = (room / STEPS).max(6.0);
        (0..=(room.max(0.0) / step) as i32).map(move |n| n as f32 * step)
    };
    let [fixed, giving_way] = marks;
    let is_on =
        |area: Rect, marks: &[Rect]| marks.iter().filter(|mark| mark.expand(2.0).intersects(area)).count() as f32;
    let mut best = (home, f32::INFINITY);
    for down in moves(free.height() - size.y) {
        for across in moves((free.width() - size.x) / 2.0) {
            for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
                let area = home.translate(vec2(x * across, y * down));
                let is_in = down == 0.0 && across == 0.0 || free.expand(0.5).contains_rect(area);
                let bad = 1000.0 * is_on(area, others) + 10.0 * is_on(area, fixed) + is_on(area, giving_way);
                if is_in && bad < best.1 {
                    best = (area, bad);
                }
                if best.1 == 0.0 {
                    return best;
                }
            }
        }
    }
    best
}

const WIDTH: f32 = 316.0;
/// Largest number of passes that are listed; the others share one line.
const MAX_PASSES: usize = 9;

pub(super) fn show_times(ui: &mut Ui, state: &PanelState, scale: f32) {
    let at = picture_rect(state, scale).left_top() + vec2(12.0, 12.0);
    Area::new(Id::new("times")).order(Order::Middle).fixed_pos(at).interactable(false).show(ui.ctx(), |ui| {
        names::name(ui, Role::Group, texts::TIMES[0]);
        let frame = Frame::new().fill(MESSAGE).inner_margin(Margin::same(12)).corner_radius(8);
        frame.show(ui, |ui| {
            ui.set_width(WIDTH);
            ui.spacing_mut().item_spacing.y = 3.0;
            figures(ui, state);
            ui.add_space(4.0);
            bars(ui, state);
        });
    });
}

fn figures(ui: &mut Ui, state: &PanelState) {
    let times = state.times;
    let ms = |value: Option<f64>| value.map_or("-".into(), texts::milliseconds);
    let percentiles = |of: &RecentTimes| [0.5, 0.95].map(|share| ms(of.percentile(share)));
    let (quality, budget) = state.quality;
    let colour_of_time = match (budget, times.pictures.percentile(0.95)) {
        (Some(budget), Some(p95)) if p95 > budget.as_secs_f64() * 1e3 => WARNING,
        (Some(_), Some(_)) => GOOD,
        _ => TEXT,
    };
    ui.label(RichText::new(texts::picture_time(ms(times.pictures.newest()))).size(LARGE_TEXT).color(colour_of_time));
    let budget = budget.map_or(texts::NO_BUDGET.into(), |b| texts::budget(b.as_secs_f64() * 1e3));
    let [p50, p95] = percentiles(&times.pictures);
    small(ui, texts::picture_times(p50, p95, budget), WEAK_TEXT);
    small(ui, quality.to_string(), ACCENT);
    small(ui, texts::rates(times.volumes, times.frames, times.shown), TEXT);
    if let Some(acquisition_time) = times.acquisition_time.filter(|f| *f > 0.0) {
        let share = 100.0 * times.volumes * acquisition_time;
        small(ui, texts::acquisition(acquisition_time * 1e3, share), WEAK_TEXT);
    }
    small(ui, texts::frame_to_picture(ms(times.latency)), TEXT);
    let [p50, p95] = percentiles(&times.input_latency);
    small(ui, texts::input_to_picture(p50, p95), TEXT);
    if times.scan_out.newest().is_some() {
        let [p50, p95] = percentiles(&times.scan_out);
        small(ui, texts::presentation_to_monitor(p50, p95), TEXT);
    }
    let colour = if times.dropped + times.lost > 0 { WARNING } else { WEAK_TEXT };
    small(ui, texts::losses(times.dropped, times.lost), colour);
}

fn bars(ui: &mut Ui, state: &PanelState) {
    // Each with its mean time, and with that of all its runs.
    let mut passes: Vec<(&str, f64, f64)> =
        state.times.passes.iter().map(|(name, mean, runs)| (*name, *mean, mean * *runs as f64)).collect();
    let all: f64 = passes.iter().map(|p| p.2).sum();
    if all <= 0.0 {
        return small(ui, texts::NO_TIMES.into(), WEAK_TEXT);
    }
    passes.sort_by(|a, b| b.2.total_cmp(&a.2));
    let (listed, others) = passes.split_at(passes.len().min(MAX_PASSES));
    for (name, mean, time) in listed {
        bar(ui, name, time / all, format!("{mean:.2}"));
    }
    if !others.is_empty() {
        let rest: f64 = others.iter().map(|p| p.2).sum();
        bar(ui, &texts::more_passes(others.len()), rest / all, String::new());
    }
    small(ui, texts::TIMES_LEGEND.into(), WEAK_TEXT);
}

fn bar(ui: &mut Ui, name: &str, share: f64, figure: String) {
    let (area, response) = ui.allocate_exact_size(vec2(WIDTH, SMALL_TEXT + 5.0), egui::Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Label, true, format!("{name} {figure}")));
    let filled = Rect::from_min_size(area.min, vec2((area.width() * share as f32).max(1.0), area.height()));
    let painter = ui.painter();
    painter.rect_filled(area, 2.0, WHOLE_BAR);
    painter.rect_filled(filled, 2.0, BAR);
    let font = FontId::proportional(SMALL_TEXT);
    let middle = area.center().y;
    painter.text(pos2(area.left() + 6.0, middle), egui::Align2::LEFT_CENTER, name, font.clone(), TEXT);
    painter.text(pos2(area.right() - 6.0, middle), egui::Align2::RIGHT_CENTER, figure, font, TEXT);
}

fn small(ui: &mut Ui, text: String, colour: Color32) {
    ui.label(RichText::new(text).size(SMALL_TEXT).color(colour));
}

/// The rows of the help. All of them have to fit one page.
fn help_rows(exit_key: &str, has_keyboard_pointer: bool) -> Vec<HelpRow> {
    let line = |(key, does): (&str, &'static str)| HelpRow::Line(key.into(), does);
    let mut rows = Vec::new();
    if has_keyboard_pointer {
        rows.push(HelpRow::Heading(keys::BY_KEYBOARD));
        rows.extend(keys::POINTER_KEYS.map(line));
    }
    rows.push(HelpRow::Heading(texts::KEYS));
    rows.extend(keys::help().map(|(key, does)| HelpRow::Line(key, does)));
    if !exit_key.is_empty() {
        rows.push(line((exit_key, texts::QUIT)));
    }
    rows.push(HelpRow::Heading(texts::GESTURES));
    rows.extend(texts::GESTURES_OF_HELP.map(line));
    rows
}

pub(super) fn show_help(ui: &mut Ui, state: &PanelState, execute: Execute) {
    let screen = ui.ctx().content_rect();
    let area = Area::new(Id::new("help")).order(Order::Foreground).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0));
    area.show(ui.ctx(), |ui| {
        names::name(ui, Role::Dialog, texts::KEYS_AND_GESTURES);
        let frame = Frame::new().fill(PANEL).inner_margin(Margin::same(14)).corner_radius(10);
        frame.stroke(Stroke::new(1.0, WEAK_TEXT)).show(ui, |ui| {
            let width = (screen.width() - 48.0).clamp(100.0, 1400.0);
            ui.set_width(width);
            ui.spacing_mut().item_spacing.y = 3.0;
            ui.horizontal(|ui| {
                ui.heading(texts::KEYS_AND_GESTURES);
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.button(texts::CLOSE).tell(texts::CLOSE_HELP_HINT).gives(Command::ToggleHelp, execute);
                    if ui.button(texts::FIND).tell(texts::FIND_HINT).clicked() {
                        execute(Command::ToggleHelp);
                        execute(Command::Find);
                    }
                });
            });
            let height = (screen.height() - 110.0).max(0.0);
            let lines = help_rows(state.exit_key, state.pointers.of_keys.is_some());
            ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
                let columns = ((width / 330.0) as usize).clamp(1, 3);
                let each = lines.len().div_ceil(columns).max(1);
                // As small as it has to be for one page, and no smaller than can be read.
                let size = (height / (each as f32 + 1.0) - 4.0).clamp(MIN_HELP_TEXT, TEXT_SIZE - 2.0);
                ui.columns(columns, |columns| {
                    for (column, lines) in columns.iter_mut().zip(lines.chunks(each)) {
                        lines.iter().for_each(|line| help_line(column, line, size));
                    }
                });
                ui.label(RichText::new(texts::NO_MEDICAL_DEVICE).size(MIN_HELP_TEXT).color(WEAK_TEXT));
            });
        });
    });
}

/// Smallest text of the help, points.
const MIN_HELP_TEXT: f32 = 11.0;

/// A row of the help.
enum HelpRow {
    Heading(&'static str),
    /// Keys or a gesture, and what they do.
    Line(String, &'static str),
}

fn help_line(ui: &mut Ui, row: &HelpRow, size: f32) {
    match row {
        HelpRow::Heading(name) => _ = ui.label(RichText::new(*name).size(size).color(WEAK_TEXT)),
        HelpRow::Line(key, label) => {
            ui.horizontal(|ui| {
                let width = (ui.available_width() * 0.4).min(190.0);
                let key = egui::Label::new(RichText::new(key).color(ACCENT).size(size)).truncate();
                cell(ui, vec2(width, size + 2.0), |ui| _ = ui.add(key));
                ui.add(egui::Label::new(RichText::new(*label).size(size)).truncate()).on_hover_text(*label);
            });
        }
    }
}

/// A button with this text as the primary button of a question.
pub(super) fn first<'a>(text: RichText) -> Button<'a> {
    Button::new(text.color(ON_SELECTED)).fill(SELECTED)
}

/// Height of a window, points, below which lists and questions have their smallest size.
pub(super) const LOW_WINDOW: f32 = 360.0;

/// Shows the question whether to save what would be lost when the program ends.
pub(super) fn ask_to_leave(ui: &Ui, unsaved: &Unsaved, execute: Execute) {
    let screen = ui.ctx().content_rect();
    // Nothing behind it reacts.
    let shade = Area::new(Id::new("shade")).order(Order::Foreground).fixed_pos(screen.min);
    shade.show(ui.ctx(), |ui| {
        // The keyboard goes past it.
        ui.allocate_rect(screen, egui::Sense::CLICK | egui::Sense::DRAG);
        ui.painter().rect_filled(screen, 0.0, SHADE);
    });
    let area = Area::new(Id::new("leave")).order(Order::Tooltip).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0));
    area.show(ui.ctx(), |ui| {
        names::name(ui, Role::AlertDialog, unsaved.title);
        // In a low window the three answers go before all else.
        let is_low = screen.height() < LOW_WINDOW;
        let (margin, title, text) = if is_low { (8, TEXT_SIZE, SMALL_TEXT) } else { (20, LARGE_TEXT, TEXT_SIZE) };
        let height = if is_low { ((screen.height() - 80.0) / 3.0).clamp(24.0, 40.0) } else { TOUCH_SIZE * 0.85 };
        let frame = Frame::new().fill(PANEL).inner_margin(Margin::same(margin)).corner_radius(10);
        frame.stroke(Stroke::new(2.0, ACCENT)).show(ui, |ui| {
            ui.set_width((screen.width() - 2.0 * f32::from(margin) - 12.0).clamp(120.0, 420.0));
            if is_low {
                ui.spacing_mut().item_spacing.y = 4.0;
                ui.spacing_mut().interact_size.y = height;
                ui.spacing_mut().button_padding.y = 1.0;
            }
            ui.label(RichText::new(unsaved.title).size(title));
            if !is_low {
                ui.label(RichText::new(unsaved.about).size(text));
                ui.add_space(8.0);
            }
            let answers = [
                ([texts::SAVE_AND_LEAVE, unsaved.save], Command::SaveAndExit),
                ([texts::LEAVE_WITHOUT_SAVING, unsaved.discard], Command::Discard),
                (texts::STAY, Command::Back),
            ];
            for ([answer, hint], command) in answers {
                let shown = RichText::new(answer).size(text);
                let button = if command == Command::SaveAndExit { first(shown) } else { Button::new(shown) };
                let button = button.truncate().min_size(vec2(ui.available_width(), height));
                ui.add(button).tell(hint).gives(command, execute);
            }
        });
    });
}

/// The corners of the pointer relative to its tip, points: the head, and the tail between its two halves.
const CORNERS: [Vec2; 7] = [
    vec2(0.0, 0.0),
    vec2(0.0, 24.0),
    vec2(5.5, 18.8),
    vec2(9.4, 27.2),
    vec2(13.2, 25.4),
    vec2(9.4, 17.4),
    vec2(17.0, 17.4),
];
/// The triangles that fill the pointer: it is not convex.
const TRIANGLES: [[u32; 3]; 5] = [[0, 1, 2], [0, 2, 5], [0, 5, 6], [2, 3, 4], [2, 4, 5]];

/// Radius of the ring around the pointer by keyboard, points, and of the one within it while the button is held.
const RING: [f32; 2] = [16.0, 8.0];

pub(super) fn paint_pointer(ui: &Ui, state: &PanelState, scale: f32) {
    let at = |[x, y]: [f64; 2]| pos2(x as f32 / scale, y as f32 / scale);
    // On top of everything, in a layer that receives no clicks.
    let painter = ui.ctx().layer_painter(LayerId::new(Order::Debug, Id::new("pointer")));
    if let Some(mark) = state.pointers.of_keys {
        for radius in &RING[..=usize::from(mark.is_held)] {
            for stroke in names::FOCUS_STROKES {
                painter.circle_stroke(at(mark.at), *radius, stroke);
            }
        }
    }
    let by_keyboard = state.pointers.of_keys.filter(|mark| mark.has_arrow).map(|mark| mark.at);
    let Some(tip) = by_keyboard.or(state.pointers.of_mouse).map(at) else { return };
    let corners = CORNERS.map(|corner| tip + corner);
    let mut mesh = Mesh::default();
    corners.iter().for_each(|corner| mesh.colored_vertex(*corner, POINTER));
    TRIANGLES.iter().for_each(|[a, b, c]| mesh.add_triangle(*a, *b, *c));
    painter.add(mesh);
    // A dark outline around a bright arrow is visible on any picture.
    painter.add(Shape::closed_line(corners.to_vec(), Stroke::new(1.5, FOCUS_EDGE)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_has_every_key_and_gesture() {
        let is_line = |row: &&HelpRow| matches!(row, HelpRow::Line(..));
        let all = help_rows("", false);
        assert_eq!(all.iter().filter(is_line).count(), keys::help().count() + texts::GESTURES_OF_HELP.len());
        let on = help_rows("Ctrl+Alt+Q", true);
        assert!(matches!(on[0], HelpRow::Heading(keys::BY_KEYBOARD)), "while it is on");
        assert_eq!(on[1..].iter().take_while(is_line).count(), keys::POINTER_KEYS.len(), "while it is on");
        let off = help_rows("Ctrl+Alt+Q", false);
        let mut of_keys = off[1..].iter().take_while(is_line);
        assert!(of_keys.any(|row| matches!(row, HelpRow::Line(key, _) if key == "Ctrl+Alt+Q")));
    }

    #[test]
    fn the_triangles_fill_the_outline() {
        let doubled_area = |corners: &[Vec2]| -> f32 {
            let next = corners.iter().cycle().skip(1);
            corners.iter().zip(next).map(|(a, b)| a.x * b.y - a.y * b.x).sum()
        };
        let filled = TRIANGLES.map(|corners| doubled_area(&corners.map(|n| CORNERS[n as usize])));
        // All have the same orientation, so none covers another.
        assert!(filled.iter().all(|area| *area < 0.0), "{filled:?}");
        assert!((filled.iter().sum::<f32>() - doubled_area(&CORNERS)).abs() < 1e-3);
    }
}
