//! The bar at the top: files and open recordings, views, undo and redo, the search of all commands, and help.

use super::colours::{ACCENT, BUTTON, CHOSEN, EDGE, PANEL, TEXT, WARNING, WEAK_TEXT};
use super::icons::{self, Icon};
use super::names::{self, Tell};
use super::rail::{icon_button, paint};
use super::widgets::{row_of, truncated};
use super::{Execute, PanelState, ROW_HEIGHT, TEXT_SIZE};
use crate::command::Command;
use crate::scene::{Layout, Mode, Settings};
use crate::texts;
use crate::texts::hints;
use egui::accesskit::Role;
use egui::{
    Align, Align2, Button, FontId, Frame, Panel, Rect, Sense, Stroke, StrokeKind, Ui, UiBuilder, WidgetInfo,
    WidgetType, pos2, vec2,
};

/// The views: what chooses them, their names, and what they show.
const VIEWS: [(Command, [&str; 2]); 7] = [
    (Command::Rendering, texts::VIEW_3D),
    (Command::Layout(Layout::Beside), [texts::LAYOUT_BESIDE, hints::of_layout(Layout::Beside)]),
    (Command::Layout(Layout::Four), [texts::LAYOUT_FOUR, hints::of_layout(Layout::Four)]),
    (Command::Layout(Layout::Pair), [texts::LAYOUT_PAIR, hints::of_layout(Layout::Pair)]),
    (Command::Mode(Mode::Orthogonal), [Mode::Orthogonal.title(), hints::of_mode(Mode::Orthogonal)]),
    (Command::Mode(Mode::Plane), [Mode::Plane.title(), hints::of_mode(Mode::Plane)]),
    (Command::Mode(Mode::Tomography), [Mode::Tomography.title(), hints::of_mode(Mode::Tomography)]),
];

fn is_view(settings: &Settings, view: Command) -> bool {
    match view {
        Command::Mode(mode) => settings.mode == mode,
        Command::Layout(layout) => settings.layout == layout && !settings.mode.is_flat(),
        _ => settings.layout == Layout::Single && !settings.mode.is_flat(),
    }
}

/// What each button does: its icon, name and explanation, and command.
pub(super) type Item = (Icon, [&'static str; 2], Command);
const OPEN: Item = (icons::OPEN, texts::OPEN, Command::OpenFiles);
const SAVE: Item = (icons::SAVE, texts::SAVE_WORKSPACE, Command::SaveWorkspace);
const UNDO: Item = (icons::UNDO, texts::UNDO, Command::Undo);
const REDO: Item = (icons::REDO, texts::REDO, Command::Redo);
const FIND: Item = (icons::SEARCH, [texts::FIND, texts::FIND_HINT], Command::Find);
const TIMES: Item = (icons::TIMES, texts::TIMES, Command::ToggleTimes);
const FULL_SCREEN: Item = (icons::FULL_SCREEN, texts::FULL_SCREEN, Command::ToggleFullScreen);
const HELP: Item = (icons::HELP, texts::HELP, Command::ToggleHelp);
pub(super) const INSPECTOR: Item = (icons::INSPECTOR, [texts::INSPECTOR, texts::DRAWER_HINT], Command::ToggleDrawer);

/// Width of a button with its icon alone, with a text, and of the search with its text, points.
const ICON: f32 = 38.0;
const WITH_TEXT: f32 = 92.0;
const SEARCH: f32 = 190.0;
const GAP: f32 = 6.0;
/// In a window of this width there are texts beside the icons, and in one of that the name of the program.
const WIDE: f32 = 1180.0;
const WIDEST: f32 = 1360.0;
/// A bar of less width has not the times and full screen, points.
const NARROW: f32 = 760.0;
/// Widths of a tab, points.
const TAB: [f32; 2] = [72.0, 190.0];

pub(super) fn show(ui: &mut Ui, state: &PanelState, height: f32, execute: Execute) {
    let panel = Panel::top("top").exact_size(height).resizable(false).show_separator_line(false);
    panel.frame(Frame::new().fill(PANEL)).show(ui, |ui| {
        names::name(ui, Role::Toolbar, texts::TOP_BAR);
        let bar = ui.max_rect();
        let is_wide = bar.width() >= WIDE;
        let row = bar.shrink2(vec2(GAP + 2.0, (height - ROW_HEIGHT) / 2.0));
        let mut left = if bar.width() >= WIDEST { name_program(ui, row) + 2.0 * GAP } else { row.left() };
        for item in [OPEN, SAVE] {
            let has_text = is_wide && item.2 == Command::OpenFiles;
            let width = if has_text { WITH_TEXT } else { ICON };
            show_item(ui, state, item, has_text, place(row, left, width), execute);
            left += width + GAP;
        }
        let drawer = state.room.has_drawer.then_some(INSPECTOR);
        let extra = if bar.width() >= NARROW { &[TIMES, FULL_SCREEN][..] } else { &[] };
        let of_right: Vec<Item> =
            [UNDO, REDO, FIND].iter().chain(extra).chain(&[HELP]).copied().chain(drawer).collect();
        let width_of = |item: &Item| if is_wide && item.2 == Command::Find { SEARCH } else { ICON };
        let right = row.right() - of_right.iter().map(|item| width_of(item) + GAP).sum::<f32>() + GAP;
        let font = FontId::proportional(TEXT_SIZE);
        let words = |ui: &Ui, text: &str| ui.painter().layout_no_wrap(text.into(), font.clone(), TEXT).size().x;
        let spare = if is_wide { 20.0 } else { 10.0 };
        let names = VIEWS.map(|(_, [name, _])| if is_wide { name } else { short(name) });
        let segments = names.map(|name| (name, words(ui, name) + spare));
        let all: f32 = segments.iter().map(|(_, width)| width).sum();
        // In the middle of the window where that leaves room for the tabs, else as far to the right as it goes.
        let of_tabs = state.recordings.len() as f32 * TAB[0] + GAP;
        let from = (bar.center().x - all / 2.0).max(left + of_tabs).clamp(left, (right - all - 2.0 * GAP).max(left));
        let tabs = from - GAP - left;
        // In the order in which they are read.
        if tabs >= TAB[0] {
            show_tabs(ui, state, place(row, left, tabs), execute);
        }
        show_views(ui, state, place(row, from, all.min(right - 2.0 * GAP - from)), &segments, execute);
        let mut at = right;
        for item in of_right {
            let width = width_of(&item);
            show_item(ui, state, item, width > ICON, place(row, at, width), execute);
            at += width + GAP;
        }
    });
}

pub(super) fn place(row: Rect, left: f32, width: f32) -> Rect {
    Rect::from_min_size(pos2(left, row.top()), vec2(width, row.height()))
}

/// The name of the program with its mark. Returns where it ends.
fn name_program(ui: &Ui, row: Rect) -> f32 {
    let painter = ui.painter();
    let centre = pos2(row.left() + 12.0, row.center().y);
    painter.circle_filled(centre, 8.0, super::colours::MARK);
    painter.circle_filled(centre + vec2(-2.5, -2.5), 3.0, super::colours::MARK_LIGHT);
    let at = pos2(row.left() + 28.0, row.center().y);
    painter.text(at, Align2::LEFT_CENTER, texts::PROGRAM, FontId::proportional(TEXT_SIZE), TEXT).right()
}

/// Shows a button of a bar in this area. `has_text`: its name stands beside its icon.
pub(super) fn show_item(
    ui: &mut Ui,
    state: &PanelState,
    (icon, [name, hint], command): Item,
    has_text: bool,
    area: Rect,
    execute: Execute,
) {
    let [can_undo, can_redo] = state.controls.can_undo();
    let is_enabled = match command {
        Command::Undo => can_undo,
        Command::Redo => can_redo,
        _ => true,
    };
    let is_on = match command {
        Command::ToggleTimes => state.visible.times,
        Command::ToggleDrawer => state.visible.inspector.is_open,
        _ => false,
    };
    ui.scope_builder(UiBuilder::new().max_rect(area), |ui| {
        let text = if has_text { name } else { "" };
        let button = icon_button(ui, icon, (text, name), area.size(), (is_enabled, is_on));
        let button = button.tell(hint).named(name);
        let button = if command == Command::ToggleDrawer { button.expanded(is_on) } else { button };
        button.on_disabled_hover_text(hint).gives(command, execute);
    });
}

/// The name of a view where there is little room.
fn short(name: &'static str) -> &'static str {
    match name {
        texts::LAYOUT_BESIDE => texts::LAYOUT_BESIDE_SHORT,
        texts::LAYOUT_PAIR => texts::LAYOUT_PAIR_SHORT,
        name => name,
    }
}

/// The views as parts of one button: the text on each, and its width.
fn show_views(ui: &mut Ui, state: &PanelState, area: Rect, segments: &[(&str, f32)], execute: Execute) {
    let settings = state.controls.settings();
    ui.scope_builder(UiBuilder::new().max_rect(area), |ui| {
        names::name(ui, Role::Group, texts::VIEW);
        ui.painter().rect_stroke(area, 6.0, Stroke::new(1.0, EDGE), StrokeKind::Inside);
        let share = area.width() / segments.iter().map(|(_, width)| width).sum::<f32>();
        let mut left = area.left();
        for ((command, [name, hint]), (text, width)) in VIEWS.into_iter().zip(segments) {
            let part = place(area, left, width * share);
            left += width * share;
            let is_chosen = is_view(settings, command);
            let response = ui.allocate_rect(part, Sense::click());
            response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_chosen, name));
            let is_over = response.hovered() || response.has_focus();
            let painter = ui.painter();
            if is_chosen {
                painter.rect(part.shrink(2.0), 5.0, CHOSEN, Stroke::new(1.0, ACCENT), StrokeKind::Inside);
            } else if is_over {
                painter.rect_filled(part.shrink(2.0), 5.0, BUTTON);
            }
            let colour = if is_chosen || is_over { TEXT } else { WEAK_TEXT };
            painter.text(part.center(), Align2::CENTER_CENTER, text, FontId::proportional(TEXT_SIZE), colour);
            response.tell(hint).gives(command, execute);
        }
    });
}

/// The recordings that are open, as tabs, in order; those that have no room are reached by the last button.
fn show_tabs(ui: &mut Ui, state: &PanelState, area: Rect, execute: Execute) {
    let count = state.recordings.len();
    if count < 2 {
        let name = state.origin.or(state.recordings.first().map(|recording| recording.name.as_str()));
        if let Some(name) = name {
            let colour = if state.origin.is_some() { WARNING } else { TEXT };
            ui.painter().circle_filled(pos2(area.left() + 8.0, area.center().y), 3.5, colour);
            clipped(ui, name, Rect::from_min_max(pos2(area.left() + 18.0, area.top()), area.max));
        }
        return;
    }
    let fit = ((area.width() / TAB[0]).floor() as usize).max(1);
    let has_all = fit >= count;
    let shown = state.recordings.iter().position(|recording| recording.is_shown).unwrap_or_default();
    let room = if has_all { area.width() } else { area.width() - 34.0 };
    let fit = if has_all { count } else { ((room / TAB[0]).floor() as usize).max(1) };
    let first = (shown + 1).saturating_sub(fit).min(count - fit);
    let width = (room / fit as f32 - 4.0).min(TAB[1]);
    ui.scope_builder(UiBuilder::new().max_rect(area), |ui| {
        names::name(ui, Role::Group, texts::RECORDINGS);
        for (n, recording) in state.recordings.iter().enumerate().skip(first).take(fit) {
            let tab = place(area, area.left() + (n - first) as f32 * (width + 4.0), width);
            let [name, close] = [tab.with_max_x(tab.right() - 26.0), tab.with_min_x(tab.right() - 26.0)];
            let response = ui.allocate_rect(name, Sense::click());
            let is_shown = recording.is_shown;
            response.widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, true, is_shown, &recording.name));
            let is_over = response.hovered() || response.has_focus();
            if is_shown || is_over {
                ui.painter().rect_filled(tab, 6.0, if is_shown { CHOSEN } else { BUTTON });
            }
            clipped(ui, &recording.name, name.shrink2(vec2(8.0, 0.0)));
            let response = response.tell(&texts::recording_hint(&recording.path)).named(&recording.name);
            response.gives(Command::ShowRecording(n), execute);
            let response = ui.allocate_rect(close, Sense::click());
            let closes = texts::close_recording(&recording.name);
            response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, &closes));
            let colour = if response.hovered() || response.has_focus() { TEXT } else { WEAK_TEXT };
            paint(ui.painter(), icons::CLOSE, Rect::from_center_size(close.center(), vec2(14.0, 14.0)), colour);
            response.tell(texts::CLOSE_RECORDING_HINT).named(&closes).gives(Command::CloseRecording(n), execute);
        }
        if !has_all {
            let more = place(area, area.right() - 30.0, 30.0);
            let response = ui.put(more, Button::new(texts::MORE)).tell(texts::NEXT_RECORDING_HINT);
            response.named(texts::NEXT_RECORDING).gives(Command::StepRecording(1), execute);
        }
    });
}

/// A text that ends in dots where it has no room.
fn clipped(ui: &Ui, text: &str, area: Rect) {
    let galley = truncated(ui, text, TEXT_SIZE - 1.0, area.width());
    ui.painter().galley(pos2(area.left(), area.center().y - galley.size().y / 2.0), galley, TEXT);
}

/// Shows the buttons of the bar at the top in the inspector, if the window has no such bar.
pub(super) fn show_buttons(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    if state.room.has_top {
        return;
    }
    let settings = state.controls.settings();
    let columns = ((width / WITH_TEXT) as usize).clamp(1, 3);
    row_of(ui, texts::VIEW, &VIEWS, (columns, width), |view| is_view(settings, view), execute);
    names::group(ui, texts::PROGRAM, |ui| {
        let all = [OPEN, SAVE, UNDO, REDO, FIND, HELP, TIMES, FULL_SCREEN];
        let columns = (width / 52.0).floor().clamp(1.0, 8.0);
        let size = vec2(width / columns - 4.0, ROW_HEIGHT + 4.0);
        ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
        for row in all.chunks(columns as usize) {
            ui.with_layout(egui::Layout::left_to_right(Align::Min).with_main_wrap(false), |ui| {
                for item in row {
                    let (area, _) = ui.allocate_exact_size(size, Sense::hover());
                    show_item(ui, state, *item, false, area, execute);
                }
            });
        }
    });
}
