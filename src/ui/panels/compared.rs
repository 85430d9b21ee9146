//! The compared volumes: their pictures beside that of the shown one or over it, the difference, and the buttons of the comparison.

use super::colours::{BACKING, MARK, TEXT, UNCOLOURED, WEAK_TEXT};
use super::names::{self, Tell};
use super::{Execute, PanelState, Pictures, ROW_HEIGHT, SMALL_TEXT, TOUCH_SIZE, picture_rect, tile_rect};
use crate::command::Command;
use crate::compare::{DIFFERENCE, MAX_TILES, tile_name};
use crate::comparison::{CompareView, Link, Shown};
use crate::texts;
use egui::accesskit::Role;
use egui::{
    Align2, Area, Button, CursorIcon, FontId, Frame, Id, Margin, Order, Painter, PointerButton, Rect, RichText, Sense,
    Stroke, Ui, WidgetInfo, WidgetType, pos2, vec2,
};

/// The views with their names and hints.
const VIEWS: [(CompareView, [&str; 2]); 3] = [
    (CompareView::Tiles, texts::COMPARED_TILES),
    (CompareView::Difference, texts::COMPARED_DIFFERENCE),
    (CompareView::Wipe, texts::COMPARED_WIPE),
];

/// The links with their names and hints.
fn about(link: Link) -> [&'static str; 2] {
    match link {
        Link::View => texts::LINK_VIEW,
        Link::Planes => texts::LINK_PLANES,
        Link::Look => texts::LINK_LOOK,
        Link::Volume => texts::LINK_VOLUME,
    }
}

/// Distance of names and buttons from the edges of a tile, points.
const EDGE: f32 = 10.0;

/// Paints the compared pictures and the difference, below everything that is drawn over pictures. `textures`: as [`Shown::pictures`].
pub(super) fn paint(ui: &Ui, state: &PanelState, textures: Pictures, scale: f32) {
    let Some(shown) = state.compared else { return };
    let painter = ui.painter();
    let texture = |n: usize| textures.get(n).copied().flatten();
    if shown.view == CompareView::Wipe {
        let (area, share) = (picture_rect(state, scale), shown.wipe as f32);
        let right = area.with_min_x(area.left() + share * area.width());
        if let Some(texture) = texture(1) {
            let part = Rect::from_min_max(pos2(share, 0.0), pos2(1.0, 1.0));
            painter.image(texture, right, part, UNCOLOURED);
        }
        painter.line_segment([right.left_top(), right.left_bottom()], Stroke::new(2.0, TEXT));
        return;
    }
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    for n in 1..=shown.visible() {
        let tile = tile_rect(state, n as u32, scale);
        match texture(n) {
            Some(texture) => _ = painter.image(texture, tile, whole, UNCOLOURED),
            None => {
                let font = FontId::proportional(SMALL_TEXT);
                painter.text(tile.center(), Align2::CENTER_CENTER, texts::NOT_DRAWN_YET, font, WEAK_TEXT);
            }
        }
    }
    if let Some(texture) = texture(0).filter(|_| shown.view == CompareView::Difference) {
        painter.image(texture, tile_rect(state, 2, scale), whole, UNCOLOURED);
    }
}

/// Shows the names of the tiles, the handle of the wipe, and the buttons.
pub(super) fn show(ui: &Ui, state: &PanelState, scale: f32, execute: Execute) {
    let Some(shown) = state.compared else { return };
    let (painter, first) = (ui.painter(), picture_rect(state, scale));
    let is_wipe = shown.view == CompareView::Wipe;
    let second = match is_wipe {
        true => first.with_min_x(first.left() + shown.wipe as f32 * first.width()),
        false => tile_rect(state, 1, scale),
    };
    for (n, other) in shown.others.iter().take(shown.visible()).enumerate() {
        let area = if is_wipe { second } else { tile_rect(state, n as u32 + 1, scale) };
        let mut text = tile_name(char::from(b'B' + n as u8), &other.name, other.is_synthetic);
        other.moved.iter().for_each(|moved| text += &texts::moved_by(*moved));
        if !is_wipe {
            hand(ui, n, area, scale, execute);
        }
        name(painter, area, &text, true);
    }
    name(painter, first, &tile_name('A', &shown.first, false), !is_wipe);
    match shown.view {
        CompareView::Difference => name(painter, tile_rect(state, 2, scale), DIFFERENCE, true),
        CompareView::Wipe => handle(ui, first, second.left(), execute),
        CompareView::Tiles => {}
    }
    // Over the picture that no gesture is made on.
    buttons(ui, shown, if is_wipe { first } else { second }, execute);
}

/// Names a tile in its upper left corner; where it is covered by the other picture, above that corner's letter.
fn name(painter: &Painter, tile: Rect, text: &str, is_alone: bool) {
    let font = FontId::proportional(SMALL_TEXT);
    let below = if is_alone { 0.0 } else { SMALL_TEXT + 8.0 };
    let galley = painter.layout_no_wrap(text.to_string(), font, TEXT);
    let galley_size = galley.size().min(tile.size() - vec2(2.0 * EDGE, 2.0 * EDGE));
    let at = pos2(tile.left() + EDGE, tile.bottom() - EDGE - galley_size.y - below);
    let painter = painter.with_clip_rect(tile.intersect(painter.clip_rect()));
    painter.rect_filled(Rect::from_min_size(at, galley_size).expand(4.0), 3.0, BACKING);
    painter.galley(at, galley, TEXT);
}

/// Lets drags over the picture of the n-th compared volume move it: with Shift or the right button they turn it.
fn hand(ui: &Ui, n: usize, tile: Rect, scale: f32, execute: Execute) {
    let area = Area::new(Id::new((texts::COMPARISON, n))).order(Order::Background).fixed_pos(tile.min).constrain(false);
    area.show(ui.ctx(), |ui| {
        let (_, response) = ui.allocate_exact_size(tile.size(), Sense::DRAG);
        let response = response.on_hover_cursor(CursorIcon::Move);
        let (Some(to), by) = (response.interact_pointer_pos(), response.drag_delta()) else { return };
        if response.dragged() && by != egui::Vec2::ZERO {
            let pixels = [to - by, to].map(|at| [at.x - tile.left(), at.y - tile.top()].map(|n| f64::from(n * scale)));
            let turns = response.dragged_by(PointerButton::Secondary) || ui.input(|input| input.modifiers.shift);
            execute(Command::MoveCompared(n, pixels, turns));
        }
    });
}

/// Shows the handle on the line of the wipe, which is at `at` in an area.
fn handle(ui: &Ui, area: Rect, at: f32, execute: Execute) {
    let handle = Rect::from_center_size(pos2(at, area.center().y), vec2(0.5 * TOUCH_SIZE, TOUCH_SIZE));
    let around = Area::new(Id::new(texts::WIPE_LINE)).order(Order::Middle).fixed_pos(handle.min).constrain(false);
    around.show(ui.ctx(), |ui| {
        let (drawn, response) = ui.allocate_exact_size(handle.size(), Sense::drag());
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Slider, true, texts::WIPE_LINE));
        let drawn = drawn.shrink2(vec2(6.0, 4.0));
        ui.painter().rect(drawn, 6.0, MARK, Stroke::new(1.0, TEXT), egui::StrokeKind::Inside);
        let response = response.on_hover_cursor(CursorIcon::ResizeHorizontal).tell(texts::WIPE_LINE_HINT);
        if let Some(place) = response.interact_pointer_pos().filter(|_| response.dragged()) {
            execute(Command::MoveWipe(f64::from((place.x - area.left()) / area.width())));
        }
    });
}

/// Shows the buttons of the comparison at the upper edge of an area.
fn buttons(ui: &Ui, shown: &Shown, over: Rect, execute: Execute) {
    let place = over.center_top() + vec2(0.0, EDGE);
    let area = Area::new(Id::new(texts::COMPARISON)).order(Order::Middle).pivot(Align2::CENTER_TOP).fixed_pos(place);
    area.show(ui.ctx(), |ui| {
        names::name(ui, Role::Group, texts::COMPARISON);
        Frame::new().fill(BACKING).inner_margin(Margin::same(4)).corner_radius(6).show(ui, |ui| {
            ui.set_max_width((over.width() - 2.0 * EDGE).max(80.0));
            ui.spacing_mut().item_spacing = vec2(4.0, 4.0);
            ui.horizontal_wrapped(|ui| {
                let mut button = |ui: &mut Ui, text: &str, [name, hint]: [&str; 2], is_on: bool, command: Command| {
                    let words = RichText::new(text).size(SMALL_TEXT);
                    let button = Button::selectable(is_on, words).min_size(vec2(0.0, ROW_HEIGHT - 6.0));
                    ui.add(button).tell(hint).named(name).gives(command, execute);
                };
                for (view, about) in VIEWS {
                    button(ui, about[0], about, shown.view == view, Command::CompareView(view));
                }
                ui.label(RichText::new(texts::LINKED).size(SMALL_TEXT).color(WEAK_TEXT));
                for (link, is_on) in Link::ALL.into_iter().zip(shown.links) {
                    button(ui, about(link)[0], about(link), is_on, Command::ToggleLink(link));
                }
                let visible = &shown.others[..shown.visible()];
                let is_aligning = visible.iter().any(|other| other.is_aligning);
                let is_on = is_aligning || visible.iter().all(|other| other.is_aligned);
                let align = if is_aligning { texts::ALIGNING } else { texts::ALIGN };
                button(ui, align, [texts::ALIGN, texts::ALIGN_HINT], is_on, Command::Align);
                if shown.others.len() + 1 < MAX_TILES {
                    button(ui, texts::ADD_COMPARED[0], texts::ADD_COMPARED, false, Command::CompareFurther);
                }
                button(ui, texts::CLOSE, texts::END_COMPARISON, false, Command::Compare);
            });
        });
    });
}
