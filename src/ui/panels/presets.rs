//! The list of presets: a tile with a thumbnail of the present volume for each, and buttons to save, rename and delete the user's.

use super::colours::{ACCENT, BACKGROUND, BUTTON, EDGE, FAULT, TEXT, UNCOLOURED, WEAK_TEXT};
use super::names::{self, Tell};
use super::overlays::{LOW_WINDOW, first};
use super::walking::Walk;
use super::widgets::{dialog, in_rows, truncated};
use super::{Execute, PanelState, Pictures, ROW_HEIGHT, SMALL_TEXT, TEXT_SIZE, TOUCH_SIZE};
use crate::command::Command;
use crate::picture::Picture;
use crate::texts;
use egui::{
    Align2, Button, ColorImage, Context, FontId, Label, Pos2, Rect, Response, RichText, ScrollArea, Sense, Stroke,
    StrokeKind, TextureHandle, TextureId, TextureOptions, Ui, WidgetInfo, WidgetType, pos2, vec2,
};
use std::sync::Arc;

/// The list of presets, as it is shown.
pub(crate) struct PresetsShown<'a> {
    pub tiles: Vec<PresetTile<'a>>,
    /// True if the user can save presets.
    pub(crate) can_save: bool,
    /// The reason why the user's presets cannot be read; None if they can.
    pub fault: Option<&'a str>,
    /// The name that is being typed, and true if it renames a preset; None if no name is being typed.
    pub naming: Option<(&'a str, bool)>,
    pub(crate) can_restore: bool,
}

/// A preset in the list, with its thumbnail.
pub(crate) struct PresetTile<'a> {
    pub name: &'a str,
    pub hint: &'a str,
    pub picture: Option<Arc<Picture>>,
    /// The index among the user's presets; None for a built-in preset.
    pub own: Option<usize>,
}

/// Width of a tile where there is room, points; and width over height of its picture.
const TILE: f32 = 170.0;
const SHAPE: f32 = 1.6;
const GAP: f32 = 8.0;
/// Height of the name below the picture.
const NAME: f32 = 26.0;
/// Height of the buttons below a preset of the user.
const BUTTONS: f32 = 36.0;

/// The textures of thumbnails, each with its picture.
#[derive(Default)]
pub(super) struct Textures(Vec<(Arc<Picture>, TextureHandle)>);

impl Textures {
    /// The textures of the pictures in each list; None where there is no picture. Textures of other pictures are released.
    pub(super) fn of<const N: usize>(
        &mut self,
        context: &Context,
        lists: [&[Option<Arc<Picture>>]; N],
    ) -> [Vec<Option<TextureId>>; N] {
        let is_shown = |picture: &Arc<Picture>| {
            lists.iter().any(|list| list.iter().flatten().any(|other| Arc::ptr_eq(picture, other)))
        };
        self.0.retain(|(picture, _)| is_shown(picture));
        let mut texture = |picture: &Arc<Picture>| {
            if let Some((_, texture)) = self.0.iter().find(|(known, _)| Arc::ptr_eq(known, picture)) {
                return texture.id();
            }
            let size = [picture.width as usize, picture.height as usize];
            let image = ColorImage::from_rgba_unmultiplied(size, &picture.rgba);
            let texture = context.load_texture("thumbnail", image, TextureOptions::LINEAR);
            let id = texture.id();
            self.0.push((picture.clone(), texture));
            id
        };
        lists.map(|list| list.iter().map(|picture| picture.as_ref().map(&mut texture)).collect())
    }
}

/// Columns and rows of the looks in the inspector, and height of the name below a picture, points.
const COLUMNS: usize = 4;
const ROWS: usize = 2;
const SMALL_NAME: f32 = 16.0;

/// Shows presets as thumbnails, and a button that opens the list in which presets are saved, renamed and deleted. `textures`: the thumbnails.
pub(super) fn show_strip(ui: &mut Ui, state: &PanelState, textures: Pictures, width: f32, execute: Execute) {
    names::group(ui, texts::QUICK_LOOKS, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new(texts::LOOKS).size(SMALL_TEXT).color(WEAK_TEXT));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let manage = Button::new(RichText::new(texts::MANAGE_LOOKS).size(SMALL_TEXT).color(ACCENT));
                let manage = ui.add(manage.frame(false)).tell(texts::PRESETS_HINT);
                manage.named(texts::PRESETS).gives(Command::Presets, execute);
            });
        });
        ui.spacing_mut().item_spacing = vec2(6.0, 4.0);
        if !state.small.are_drawn {
            return names_of_looks(ui, state, width, execute);
        }
        let each = (width - 6.0 * (COLUMNS - 1) as f32) / COLUMNS as f32;
        // The others are in the list.
        let all = state.small.looks.iter().enumerate().take(ROWS * COLUMNS);
        in_rows(ui, all, COLUMNS, |ui, (n, tile)| {
            let picture = vec2(each, each / SHAPE);
            let (area, response) = ui.allocate_exact_size(picture + vec2(0.0, SMALL_NAME), Sense::click());
            response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, tile.name));
            let inside = Rect::from_min_size(area.min, picture);
            paint_picture(ui, inside, textures.get(n).copied().flatten());
            let is_over = response.hovered() || response.has_focus();
            let stroke = Stroke::new(if is_over { 2.0 } else { 1.0 }, if is_over { TEXT } else { EDGE });
            ui.painter().rect_stroke(inside, 4.0, stroke, StrokeKind::Inside);
            let galley = truncated(ui, tile.name, SMALL_TEXT, each);
            let at = pos2(area.center().x - galley.size().x / 2.0, inside.bottom() + 1.0);
            ui.painter().galley(at, galley, TEXT);
            response.tell(tile.hint).named(tile.name).gives(Command::Preset(n), execute);
        });
    });
}

/// The looks by their names, where no pictures are made.
fn names_of_looks(ui: &mut Ui, state: &PanelState, width: f32, execute: Execute) {
    let size = vec2((width - 12.0) / 3.0, ROW_HEIGHT);
    in_rows(ui, state.small.looks.iter().enumerate().take(9), 3, |ui, (n, tile)| {
        let button = Button::new(tile.name).truncate().min_size(size);
        ui.add_sized(size, button).tell(tile.hint).named(tile.name).gives(Command::Preset(n), execute);
    });
}

/// A picture, or a dark area while there is none.
fn paint_picture(ui: &Ui, area: Rect, texture: Option<TextureId>) {
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    match texture {
        Some(texture) => _ = ui.painter().image(texture, area, whole, UNCOLOURED),
        None => _ = ui.painter().rect_filled(area, 4.0, BACKGROUND),
    }
}

pub(super) fn show(ui: &Ui, shown: &PresetsShown, textures: Pictures, execute: Execute) {
    let screen = ui.ctx().content_rect();
    let is_low = screen.height() < LOW_WINDOW;
    let margin = if is_low { 6 } else { 12 };
    dialog(ui, texts::PRESETS, (Align2::CENTER_CENTER, 0.0), margin, [120.0, 720.0], |ui, width| {
        // In a low window all of it scrolls.
        if !is_low {
            header(ui, shown, execute);
        }
        let height = (screen.height() - ui.min_rect().height() - 2.0 * f32::from(margin) - 24.0).max(30.0);
        // The area takes its place from its size of the layout before, which tells nothing of the room that there is.
        ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, |ui| {
            if is_low {
                header(ui, shown, execute);
            }
            names::list(ui, texts::LOOKS, |ui| tiles(ui, shown, textures, width - 20.0, execute));
        });
    });
}

/// The title, and what closes the list and saves a preset; or the name that is being typed. Below it the fault.
fn header(ui: &mut Ui, shown: &PresetsShown, execute: Execute) {
    ui.horizontal_wrapped(|ui| {
        let mut add = |ui: &mut Ui, button: Button, [name, hint]: [&str; 2], command: Command| {
            ui.add(button).tell(hint).named(name).gives(command, execute);
        };
        if let Some((text, is_rename)) = shown.naming {
            let about = if is_rename { texts::NEW_NAME } else { texts::NAME };
            let typed = ui.add(Label::new(RichText::new(format!("{about}: {text}_")).size(TEXT_SIZE)).wrap());
            typed.named(about).with_value(text);
            let (keep, cancel) = (first(RichText::new(texts::KEEP_BUTTON)), Button::new(texts::CANCEL_BUTTON));
            add(ui, keep, [texts::KEEP, texts::KEEP_PRESET_HINT], Command::EndNaming);
            add(ui, cancel, [texts::CANCEL, texts::CANCEL_NAMING_HINT], Command::Back);
            return;
        }
        ui.heading(texts::PRESETS);
        if shown.can_save {
            let about = [texts::SAVE_PRESENT_LOOK, texts::SAVE_PRESENT_LOOK_HINT];
            add(ui, Button::new(texts::SAVE_PRESENT_LOOK_BUTTON), about, Command::NamePreset);
        }
        if shown.can_restore {
            let about = [texts::UNDO[0], texts::UNDO_PRESETS_HINT];
            add(ui, Button::new(texts::UNDO_PRESETS_BUTTON), about, Command::RestorePresets);
        }
        add(ui, Button::new(texts::CLOSE_BUTTON), [texts::CLOSE, texts::CLOSE_PRESETS_HINT], Command::Presets);
    });
    if let Some(fault) = shown.fault {
        ui.add(Label::new(RichText::new(fault).size(SMALL_TEXT).color(FAULT)).truncate()).on_hover_text(fault);
    }
}

fn tiles(ui: &mut Ui, shown: &PresetsShown, textures: Pictures, width: f32, execute: Execute) {
    let columns = ((width + GAP) / (TILE + GAP)).floor().clamp(1.0, 3.0) as usize;
    let each = (width - GAP * (columns - 1) as f32) / columns as f32;
    ui.spacing_mut().item_spacing = vec2(GAP, GAP);
    let all: Vec<(usize, &PresetTile)> = shown.tiles.iter().enumerate().collect();
    let walk = Walk::new(ui, texts::PRESETS, all.len(), columns);
    for row in all.chunks(columns) {
        ui.horizontal_top(|ui| {
            for (n, tile) in row {
                ui.vertical(|ui| {
                    ui.set_width(each);
                    let entry = button(ui, *n, tile, textures.get(*n).copied().flatten(), each);
                    walk.entry(*n, &entry);
                    entry.gives(Command::Preset(*n), execute);
                    if let Some(own) = tile.own {
                        own_buttons(ui, own, tile.name, each, execute);
                    }
                });
            }
        });
    }
}

/// A picture with a name.
fn button(ui: &mut Ui, n: usize, tile: &PresetTile, texture: Option<TextureId>, width: f32) -> Response {
    let edge = 4.0;
    let picture = vec2(width - 2.0 * edge, (width - 2.0 * edge) / SHAPE);
    let (area, response) = ui.allocate_exact_size(vec2(width, picture.y + NAME + 2.0 * edge), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, tile.name));
    let painter = ui.painter();
    let stroke = Stroke::new(if response.hovered() { 2.0 } else { 1.0 }, if response.hovered() { TEXT } else { EDGE });
    painter.rect(area, 6.0, BUTTON, stroke, StrokeKind::Inside);
    let inside = Rect::from_min_size(area.min + vec2(edge, edge), picture);
    paint_picture(ui, inside, texture);
    let key = if n < 9 { format!("{}  ", n + 1) } else { String::new() };
    let font = FontId::proportional(TEXT_SIZE - 2.0);
    let mut job = egui::text::LayoutJob::default();
    job.append(&key, 0.0, egui::TextFormat::simple(font.clone(), WEAK_TEXT));
    job.append(tile.name, 0.0, egui::TextFormat::simple(font, TEXT));
    job.wrap = egui::text::TextWrapping::truncate_at_width(width - 4.0 * edge);
    let galley = painter.layout_job(job);
    let at = pos2(area.left() + 2.0 * edge, inside.bottom() + (NAME + edge - galley.size().y) / 2.0);
    painter.galley(at, galley, TEXT);
    response.tell(tile.hint).named(tile.name)
}

/// What renames and deletes a preset of the user.
fn own_buttons(ui: &mut Ui, own: usize, name: &str, width: f32, execute: Execute) {
    let size = vec2((width - GAP) / 2.0, BUTTONS.min(TOUCH_SIZE * 0.7));
    ui.horizontal(|ui| {
        for (command, [label, hint]) in [
            (Command::RenamePreset(own), texts::RENAME),
            (Command::DeletePreset(own), [texts::DELETE, texts::DELETE_PRESET_HINT]),
        ] {
            let button = Button::new(RichText::new(label).size(SMALL_TEXT)).min_size(size);
            ui.add(button).tell(hint).named(&format!("{label} {name}")).gives(command, execute);
        }
    });
}
