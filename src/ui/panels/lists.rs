//! Lists over the window of which an entry is chosen: the files to open, and the formats of an export.

use super::colours::{ACCENT, PANEL, WEAK_TEXT};
use super::names::{self, Tell};
use super::overlays::LOW_WINDOW;
use super::walking::Walk;
use super::{SMALL_TEXT, TOUCH_SIZE};
use crate::command::Command;
use crate::progress_lines::Progress;
use crate::texts;
use crate::volume_export::FORMATS;
use egui::accesskit::Role;
use egui::{Align2, Area, Button, Frame, Id, Label, Margin, Order, RichText, ScrollArea, Stroke, Ui, vec2};

struct List<'a> {
    title: &'a str,
    about: &'a str,
    /// The tooltip of closing it, and what does so.
    close: (&'a str, Command),
    /// What an empty list says.
    empty: &'a str,
}

/// Shows the files to open. `files`: where they are, and their names.
pub(super) fn show_files(ui: &Ui, files: (&str, &[String]), execute: &mut dyn FnMut(Command)) {
    let list = List {
        title: texts::OPEN,
        about: files.0,
        close: (texts::CLOSE_OPEN_HINT, Command::OpenFiles),
        empty: texts::NO_RECORDING_HERE,
    };
    let hint = |name: &String| match name.as_str() {
        texts::FOLDER_ABOVE => texts::FOLDER_ABOVE_HINT.into(),
        name if name.ends_with('/') => texts::open_folder_hint(name),
        name => texts::open_file_hint(name),
    };
    let hints: Vec<String> = files.1.iter().map(hint).collect();
    let entries = files.1.iter().zip(&hints).map(|(name, hint)| (name.as_str(), hint.as_str()));
    list.show(ui, entries, |n, execute| execute(Command::OpenFile(n)), |_, _| {}, execute);
}

/// Shows the formats of an export. `running`: the name of the one in work; `progress`: how far it is.
pub(super) fn show_exports(ui: &Ui, running: Option<(&str, Option<Progress>)>, execute: &mut dyn FnMut(Command)) {
    let about = match running {
        Some((name, Some(progress))) => texts::is_exported_so_far(name, progress.done, progress.of),
        Some((name, None)) => texts::is_being_exported(name),
        None => texts::VOLUME_SHOWN.into(),
    };
    let list =
        List { title: texts::EXPORT, about: &about, close: (texts::CLOSE_EXPORT_HINT, Command::Exports), empty: "" };
    let entries = FORMATS.iter().map(|format| (format.name, format.hint));
    let cancel = |ui: &mut Ui, execute: &mut dyn FnMut(Command)| {
        let hint = texts::CANCEL_EXPORT_HINT;
        if running.is_some() && ui.button(texts::CANCEL_EXPORT).tell(hint).clicked() {
            execute(Command::CancelExport);
        }
    };
    list.show(ui, entries, |n, execute| execute(Command::Export(n)), cancel, execute);
}

impl List<'_> {
    /// `entries`: names and tooltips. `more` is drawn before them.
    fn show<'a>(
        &self,
        ui: &Ui,
        entries: impl ExactSizeIterator<Item = (&'a str, &'a str)>,
        choose: impl Fn(usize, &mut dyn FnMut(Command)),
        more: impl Fn(&mut Ui, &mut dyn FnMut(Command)),
        execute: &mut dyn FnMut(Command),
    ) {
        let screen = ui.ctx().content_rect();
        let area =
            Area::new(Id::new(self.title)).order(Order::Foreground).anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0));
        area.show(ui.ctx(), |ui| {
            names::name(ui, Role::Dialog, self.title);
            let is_low = screen.height() < LOW_WINDOW;
            let margin = if is_low { 6 } else { 16 };
            let frame = Frame::new().fill(PANEL).inner_margin(Margin::same(margin)).corner_radius(10);
            frame.stroke(Stroke::new(2.0, ACCENT)).show(ui, |ui| {
                let width = (screen.width() - 2.0 * f32::from(margin) - 12.0).clamp(120.0, 720.0);
                ui.set_width(width);
                ui.horizontal(|ui| {
                    ui.heading(self.title);
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        if ui.button(texts::CLOSE_BUTTON).tell(self.close.0).named(texts::CLOSE).clicked() {
                            execute(self.close.1);
                        }
                    });
                });
                ui.add(Label::new(RichText::new(self.about).size(SMALL_TEXT).color(WEAK_TEXT)).truncate());
                // Below the title and what it is about.
                let height = (screen.height() - if is_low { 100.0 } else { 160.0 }).max(30.0);
                ScrollArea::vertical().max_height(height).min_scrolled_height(0.0).show(ui, |ui| {
                    more(ui, execute);
                    names::list(ui, self.about, |ui| {
                        if entries.len() == 0 {
                            ui.label(self.empty);
                        }
                        let walk = Walk::new(ui, self.title, entries.len(), 1);
                        for (n, (name, hint)) in entries.enumerate() {
                            let key = if n < 9 { format!("{}   ", n + 1) } else { "     ".into() };
                            let button = Button::new(format!("{key}{name}")).truncate();
                            let button = button.min_size(vec2(width - 20.0, TOUCH_SIZE * 0.7));
                            let entry = ui.add(button).tell(hint).named(name);
                            walk.entry(n, &entry);
                            if entry.clicked() {
                                choose(n, execute);
                            }
                        }
                    });
                });
            });
        });
    }
}
