//! The bar at the bottom: the freeze button, the cine loop as a time line with its marks, and the save buttons. Its controls keep their places and
//! widths whatever they show.

use super::colours::{
    ACCENT, BACKGROUND, BUTTON, CHOSEN, EDGE, ON_SELECTED, ON_WARNING, PANEL, SELECTED, TEXT, UNCOLOURED, WARNING,
    WEAK_TEXT,
};
use super::icons::{self, Icon};
use super::names::{self, Tell};
use super::rail::icon_button;
use super::top::{INSPECTOR, Item, place, show_item};
use super::{Execute, PanelState, Pictures, SMALL_TEXT, TEXT_SIZE};
use crate::cine_player::{CineState, SPEEDS};
use crate::command::Command;
use crate::texts;
use egui::accesskit::{Action, Role};
use egui::{
    Align2, FontId, Frame, Key, Panel, Rect, Response, Sense, Stroke, StrokeKind, Ui, UiBuilder, WidgetInfo,
    WidgetType, pos2, vec2,
};
use std::time::Duration;

/// Width of the window from which on buttons have texts, the loop has all of its buttons, it has its steps, and there is more than what is needed most,
/// points.
const WITH_TEXTS: f32 = 1180.0;
const WITH_SPEED: f32 = 900.0;
const WITH_STEPS: f32 = 600.0;
const WITH_LINE: f32 = 330.0;
const GAP: f32 = 8.0;
/// Width of a button with an icon, points; the second in the smallest windows.
const ICON: [f32; 2] = [44.0, 42.0];

const EXPORTS: Item = (icons::EXPORT, texts::EXPORT, Command::Exports);
const SAVE_LOOP: Item = (icons::FILM, texts::SAVE_LOOP, Command::SaveLoop);
const SAVE_PICTURE: Item = (icons::CAMERA, texts::SAVE_PICTURE, Command::SavePicture);

pub(super) fn show(ui: &mut Ui, state: &PanelState, height: f32, pictures: Pictures, execute: Execute) {
    let panel = Panel::bottom("bar").exact_size(height).resizable(false).show_separator_line(false);
    panel.frame(Frame::new().fill(PANEL)).show(ui, |ui| {
        names::name(ui, Role::Toolbar, texts::CINE_LOOP);
        let bar = ui.max_rect();
        let width = bar.width();
        let row = bar.shrink2(vec2(GAP, if height > 70.0 { 12.0 } else { 6.0 }));
        let icon = ICON[usize::from(width < WITH_LINE)];
        let mut left = row.left();
        let frozen = match width {
            WITH_TEXTS.. => 132.0,
            WITH_STEPS.. => 112.0,
            WITH_LINE.. => 92.0,
            _ => 76.0,
        };
        freeze(ui, state, place(row, left, frozen), execute);
        left += frozen + GAP;
        let has_texts = width >= WITH_TEXTS;
        let with_text = |text: f32| if has_texts { text } else { icon };
        let more = (width >= WITH_STEPS).then_some([(EXPORTS, with_text(100.0)), (SAVE_LOOP, with_text(120.0))]);
        let save = (SAVE_PICTURE, with_text(140.0));
        let drawer = (state.room.has_drawer && !state.room.has_top).then_some((INSPECTOR, icon));
        let of_right: Vec<_> = more.into_iter().flatten().chain([save]).chain(drawer).collect();
        let right = row.right() - of_right.iter().map(|(_, width)| width + GAP).sum::<f32>();
        cine(ui, state, (row.with_min_x(left).with_max_x(right), width), pictures, execute);
        let mut from = right + GAP;
        for (item, width) in of_right {
            show_item(ui, state, item, has_texts, place(row, from, width), execute);
            from += width + GAP;
        }
    });
}

/// The button that freezes: what the picture is, and what a press does.
fn freeze(ui: &mut Ui, state: &PanelState, area: Rect, execute: Execute) {
    let (title, about, fill, colour) = match (state.timeliness.is_frozen, state.timeliness.ended) {
        (true, _) => (texts::FROZEN, texts::GO_LIVE, WARNING, ON_WARNING),
        (false, None) if state.timeliness.is_live || state.origin.is_some() => {
            (texts::LIVE, texts::TO_FREEZE, SELECTED, ON_SELECTED)
        }
        (false, None) if state.cine.count == 0 => (texts::WAITING, texts::TO_FREEZE, BUTTON, TEXT),
        (false, None) => (texts::NEWEST, texts::TO_FREEZE, SELECTED, ON_SELECTED),
        (false, Some(_)) => (texts::HAS_ENDED_BUTTON, texts::TO_FREEZE, BUTTON, TEXT),
    };
    let ended = state.timeliness.ended.map(texts::ended_for);
    if ended.is_some() {
        // It says another time then.
        ui.ctx().request_repaint_after(Duration::from_secs(1));
    }
    let (name, hint) = match (state.timeliness.is_frozen, &ended) {
        (true, _) => (texts::UNFREEZE, texts::FREEZE_HINT),
        (false, None) => (texts::FREEZE, texts::FREEZE_HINT),
        (false, Some(ended)) => (ended.as_str(), texts::ENDED_HINT),
    };
    let response = ui.allocate_rect(area, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, name));
    let painter = ui.painter();
    let edge = if response.hovered() || response.has_focus() { TEXT } else { fill };
    painter.rect(area, 8.0, fill, Stroke::new(2.0, edge), StrokeKind::Inside);
    let has_two = area.height() >= 44.0 && area.width() >= 90.0;
    let up = if has_two { 9.0 } else { 0.0 };
    let middle = area.center();
    let [large, small] = [TEXT_SIZE, SMALL_TEXT].map(FontId::proportional);
    painter.text(middle - vec2(0.0, up), Align2::CENTER_CENTER, title, large, colour);
    if has_two {
        painter.text(middle + vec2(0.0, up), Align2::CENTER_CENTER, about, small, colour);
    }
    response.tell(hint).named(name).gives(Command::Freeze, execute);
}

/// The cine loop in this area of a window so wide.
fn cine(ui: &mut Ui, state: &PanelState, (area, window): (Rect, f32), pictures: Pictures, execute: Execute) {
    let cine = &state.cine;
    let mut left = area.left();
    // Each with its icon, its text, its name and hint, its command and its width.
    let mut buttons: Vec<(Icon, &str, [&str; 2], Command, f32)> = Vec::new();
    let with_icon = |icon, about, command| (icon, "", about, command, ICON[0]);
    let (icon, name) = if cine.is_playing { (icons::STOP, texts::STOP) } else { (icons::PLAY, texts::PLAY) };
    let play = with_icon(icon, [name, texts::PLAY_HINT], Command::PlayCine);
    let speed = format!("{}x", cine.speed);
    let of_speed = texts::speed(&speed);
    if window >= WITH_STEPS {
        buttons.push(with_icon(icons::PREVIOUS, texts::PREVIOUS_VOLUME, Command::StepCine(-1)));
        buttons.push(play);
        buttons.push(with_icon(icons::NEXT, texts::NEXT_VOLUME, Command::StepCine(1)));
    } else if window >= WITH_LINE {
        buttons.push(play);
    }
    if window >= WITH_SPEED {
        // After the fastest comes the slowest.
        let faster = if cine.speed >= SPEEDS[SPEEDS.len() - 1] { -(SPEEDS.len() as i32) } else { 1 };
        buttons.push((&[], &speed, [&of_speed, texts::SPEED_HINT], Command::CineSpeed(faster), 56.0));
        buttons.push(match cine.goes_back_and_forth {
            true => with_icon(icons::BACK_AND_FORTH, texts::BACK_AND_FORTH, Command::BackAndForth(false)),
            false => with_icon(icons::FORWARDS, texts::FORWARDS, Command::BackAndForth(true)),
        });
    }
    for (icon, text, [name, hint], command, width) in buttons {
        let place = place(area, left, width);
        let add = |ui: &mut Ui| icon_button(ui, icon, (text, name), place.size(), (cine.count > 0, false));
        let response = ui.scope_builder(UiBuilder::new().max_rect(place), add).inner;
        response.tell(hint).named(name).gives(command, execute);
        left += width + GAP;
    }
    let line = area.with_min_x(left + 4.0).with_max_x(area.right() - 4.0);
    if line.width() >= 60.0 {
        time_line(ui, cine, line, pictures, execute);
    }
}

/// Height of the labels below the line, points; a lower bar has none.
const LABELS: f32 = 16.0;
/// A press so near to a mark moves it, points.
const HANDLE: f32 = 9.0;

/// Which end of the loop is dragged.
#[derive(Clone, Copy, PartialEq)]
enum Grip {
    Place,
    Begin,
    End,
}

/// The volumes in a row: the one that is shown, and the part that is played, whose ends can be dragged.
fn time_line(ui: &mut Ui, cine: &CineState, area: Rect, pictures: Pictures, execute: Execute) {
    let strip =
        if area.height() >= 44.0 { area.with_max_y(area.bottom() - LABELS) } else { area.shrink2(vec2(0.0, 6.0)) };
    let sense = if cine.count > 0 { Sense::click_and_drag() } else { Sense::hover() };
    let response = ui.interact(strip.expand2(vec2(4.0, 2.0)), ui.id().with("line"), sense);
    let painter = ui.painter().clone();
    painter.rect_filled(strip, 4.0, BACKGROUND);
    let small = || FontId::proportional(SMALL_TEXT);
    if cine.count == 0 {
        painter.rect_stroke(strip, 4.0, Stroke::new(1.0, EDGE), StrokeKind::Inside);
        painter.text(strip.center(), Align2::CENTER_CENTER, texts::NO_VOLUMES_YET, small(), WEAK_TEXT);
        return;
    }
    let each = strip.width() / cine.count as f32;
    let left_of = |index: usize| strip.left() + each * index as f32;
    let cell =
        |index: usize| Rect::from_min_max(pos2(left_of(index), strip.top()), pos2(left_of(index + 1), strip.bottom()));
    for index in 0..cine.count {
        let cell = cell(index).shrink2(vec2(if each > 6.0 { 0.5 } else { 0.0 }, 1.0));
        let is_played = cine.range.contains(&index);
        match pictures.get(index).copied().flatten() {
            Some(picture) => {
                // The middle of the picture.
                let share = (cell.width() / cell.height() / 1.6).min(1.0);
                let part = Rect::from_min_max(pos2(0.5 - share / 2.0, 0.0), pos2(0.5 + share / 2.0, 1.0));
                let tint = if is_played { UNCOLOURED } else { UNCOLOURED.gamma_multiply(0.45) };
                painter.image(picture, cell, part, tint);
            }
            None => _ = painter.rect_filled(cell, 1.0, if is_played { CHOSEN } else { BUTTON }),
        }
    }
    painter.rect_stroke(strip, 4.0, Stroke::new(1.0, EDGE), StrokeKind::Inside);
    let ends = [left_of(*cine.range.start()), left_of(*cine.range.end() + 1)];
    if cine.is_trimmed {
        let played = Rect::from_min_max(pos2(ends[0], strip.top()), pos2(ends[1], strip.bottom()));
        painter.rect_stroke(played, 4.0, Stroke::new(2.0, ACCENT), StrokeKind::Inside);
    }
    for end in ends {
        let handle = Rect::from_center_size(pos2(end, strip.center().y), vec2(5.0, 13.0_f32.min(strip.height())));
        painter.rect(handle, 2.0, ACCENT, Stroke::new(1.0, BACKGROUND), StrokeKind::Outside);
    }
    let shown = cine.shown.unwrap_or(cine.count - 1).min(cine.count - 1);
    let x = cell(shown).center().x;
    painter.vline(x, strip.y_range().expand(3.0), Stroke::new(2.0, TEXT));
    painter.rect_filled(Rect::from_center_size(pos2(x, strip.top() - 2.0), vec2(9.0, 6.0)), 2.0, TEXT);
    labels(&painter, cine, area, x);
    react(ui, cine, response, (strip, each, ends), execute);
}

/// Times below the line, or numbers of volumes where no time stamps state them.
fn labels(painter: &egui::Painter, cine: &CineState, area: Rect, x: f32) {
    if area.height() < 44.0 {
        return;
    }
    let font = FontId::proportional(SMALL_TEXT);
    let place = texts::place_in_loop(cine.shown.map_or("-".into(), |p| (p + 1).to_string()), cine.count);
    let middle = cine.seconds.map_or(place, texts::seconds);
    let (first, last) = match cine.length {
        Some(length) => (texts::seconds(0.0), texts::seconds(length)),
        None => ("1".to_string(), cine.count.to_string()),
    };
    let trimmed = cine.is_trimmed.then(|| texts::played_part(cine.range.start() + 1, cine.range.end() + 1));
    let y = area.bottom() - 1.0;
    let mut taken: Vec<Rect> = Vec::new();
    let mut write = |x: f32, align: Align2, text: &str, colour| {
        let galley = painter.layout_no_wrap(text.to_string(), font.clone(), colour);
        let mut place = align.anchor_size(pos2(x, y), galley.size());
        place = place.translate(vec2((area.left() - place.left()).max(0.0), 0.0));
        place = place.translate(vec2((area.right() - place.right()).min(0.0), 0.0));
        if taken.iter().all(|other| !other.expand(6.0).intersects(place)) {
            taken.push(place);
            painter.galley(place.min, galley, colour);
        }
    };
    write(x, Align2::CENTER_BOTTOM, &middle, TEXT);
    write(area.left(), Align2::LEFT_BOTTOM, &first, WEAK_TEXT);
    write(area.right(), Align2::RIGHT_BOTTOM, &last, WEAK_TEXT);
    if let Some(trimmed) = trimmed {
        let at = area.left() + area.width() * *cine.range.start() as f32 / cine.count as f32;
        write(at, Align2::LEFT_BOTTOM, &trimmed, ACCENT);
    }
}

/// What pointer, keyboard and screen reader do on the line.
fn react(ui: &Ui, cine: &CineState, response: Response, (strip, each, ends): (Rect, f32, [f32; 2]), execute: Execute) {
    let last = cine.count - 1;
    let shown = cine.shown.unwrap_or(last).min(last);
    let value = texts::place_in_loop(shown + 1, cine.count);
    response.widget_info(|| WidgetInfo::slider(true, (shown + 1) as f64, texts::VOLUME_OF_THE_LOOP));
    names::range(&response, [1.0, cine.count as f64], 1.0);
    let response = response.tell(texts::VOLUME_OF_THE_LOOP_HINT).named(texts::VOLUME_OF_THE_LOOP).with_value(&value);
    let grip = response.id.with("grip");
    if response.double_clicked() {
        return execute(Command::WholeCine);
    }
    if let Some(at) = response.interact_pointer_pos() {
        let nearest = [(Grip::Begin, ends[0]), (Grip::End, ends[1])]
            .into_iter()
            .map(|(grip, x)| (grip, (at.x - x).abs()))
            .filter(|(_, away)| *away <= HANDLE && 2.0 * *away <= each.max(2.0 * HANDLE));
        let held = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(Grip::Place, |(grip, _)| grip);
        let begins = ui.input(|input| input.pointer.primary_pressed());
        let held = ui.data_mut(|data| match begins {
            true => {
                data.insert_temp(grip, held);
                held
            }
            false => data.get_temp(grip).unwrap_or(Grip::Place),
        });
        let share = ((at.x - strip.left()) / each).clamp(0.0, last as f32 + 0.99);
        let index = (share.floor() as usize).min(last);
        match held {
            Grip::Place if cine.shown != Some(index) => execute(Command::SeekCine(index)),
            Grip::Begin if !begins => {
                let first = (share.round() as usize).min(*cine.range.end());
                if first != *cine.range.start() {
                    execute(Command::TrimCine(first, false));
                }
            }
            Grip::End if !begins => {
                let end = (share.round() as usize).saturating_sub(1).clamp(*cine.range.start(), last);
                if end != *cine.range.end() {
                    execute(Command::TrimCine(end, true));
                }
            }
            _ => {}
        }
        return;
    }
    // Before the input is locked: both are of the context.
    let has_focus = response.has_focus();
    let stepped = ui.input(|input| {
        let pressed = |key| has_focus && input.key_pressed(key);
        let asked = |action| input.has_accesskit_action_request(response.id, action);
        let set =
            input.accesskit_action_requests(response.id, Action::SetValue).find_map(|request| match request.data {
                Some(egui::accesskit::ActionData::NumericValue(value)) => Some(value.round() as i64 - 1),
                _ => None,
            });
        let by = i64::from(pressed(Key::ArrowRight) || asked(Action::Increment))
            - i64::from(pressed(Key::ArrowLeft) || asked(Action::Decrement));
        set.or((by != 0).then_some(shown as i64 + by))
    });
    let index = stepped.map(|index| index.clamp(0, last as i64) as usize);
    if let Some(index) = index.filter(|_| cine.shown != index) {
        execute(Command::SeekCine(index));
    }
}
