//! Lists over the window from which an entry is chosen: the files to open, and the formats of an export.

use super::colours::{FAULT, TEXT, WEAK_TEXT};
use super::names::{self, Tell};
use super::overlays::LOW_WINDOW;
use super::walking::Walk;
use super::widgets::dialog;
use super::{Execute, SMALL_TEXT, TOUCH_SIZE, heading};
use crate::command::Command;
use crate::progress_lines::Progress;
use crate::texts;
use crate::volume_export::FORMATS;
use egui::{Align2, Button, Color32, FontId, Label, RichText, ScrollArea, Ui, vec2};
use std::ffi::OsStr;
use std::path::Path;

/// The list of files to open, as it is shown.
pub(in super::super) struct FilesShown<'a> {
    pub(in super::super) folder: &'a str,
    /// Number of recent files, which are the first entries of the list.
    pub(in super::super) recent: usize,
    pub(in super::super) names: &'a [String],
    /// The path that is being typed, and why it was rejected, if it was; None if no path is being typed.
    pub(in super::super) typed: Option<(&'a str, Option<&'a str>)>,
}

/// A list with a line below what it is about has this height of the window, at most.
const SHARE: f32 = 0.6;

struct List<'a> {
    title: &'a str,
    about: &'a str,
    /// The path that is being typed, shown instead of the description.
    typed: Option<&'a str>,
    /// A line below the description. Its room is kept free, so that the size of the list is constant.
    line: Option<(&'a str, Color32)>,
    /// Headings, each with the index of the entry that it precedes.
    headings: &'a [(usize, &'a str)],
    /// The close button: its tooltip and command.
    close: (&'a str, Command),
    /// True if a button before the entries cancels the running export.
    can_cancel: bool,
}

/// Shows the list of files to open.
pub(super) fn show_files(ui: &Ui, files: &FilesShown, execute: Execute) {
    let line = match files.typed {
        Some((_, Some(fault))) => (fault, FAULT),
        Some((_, None)) => (texts::HOW_TO_TYPE_A_PATH, WEAK_TEXT),
        None => (texts::HOW_TO_BEGIN_A_PATH, WEAK_TEXT),
    };
    let folder = Path::new(files.folder).file_name().and_then(OsStr::to_str).unwrap_or(files.folder);
    let headings = [(0, texts::RECENT), (files.recent, folder)];
    let list = List {
        title: texts::OPEN[0],
        about: files.folder,
        typed: files.typed.map(|typed| typed.0),
        line: Some(line),
        headings: &headings[usize::from(files.recent == 0)..],
        close: (texts::CLOSE_OPEN_HINT, Command::OpenFiles),
        can_cancel: false,
    };
    let hint = |name: &String| match name.as_str() {
        texts::FOLDER_ABOVE => texts::FOLDER_ABOVE_HINT.into(),
        name if name.ends_with('/') => texts::open_folder_hint(name),
        name => texts::open_file_hint(name),
    };
    let hints: Vec<String> = files.names.iter().map(hint).collect();
    let entries = files.names.iter().zip(&hints).map(|(name, hint)| (name.as_str(), hint.as_str()));
    list.show(ui, entries, Command::OpenFile, execute);
}

/// Shows the list of export formats. `running`: name and progress of the running export.
pub(super) fn show_exports(ui: &Ui, running: Option<(&str, Option<Progress>)>, execute: Execute) {
    let about = match running {
        Some((name, Some(progress))) => texts::is_exported_so_far(name, progress.done, progress.of),
        Some((name, None)) => texts::is_being_exported(name),
        None => texts::VOLUME_SHOWN.into(),
    };
    let (close, can_cancel) = ((texts::CLOSE_EXPORT_HINT, Command::Exports), running.is_some());
    let list =
        List { title: texts::EXPORT[0], about: &about, typed: None, line: None, headings: &[], close, can_cancel };
    let entries = FORMATS.iter().map(|format| (format.name, format.hint));
    list.show(ui, entries, Command::Export, execute);
}

/// A text that is being typed, with a mark where it goes on; without its beginning, if that has no room.
fn end_of(ui: &Ui, typed: &str, width: f32) -> String {
    let font = FontId::proportional(SMALL_TEXT);
    let mut left = width - 40.0;
    let fits = |(_, letter): &(usize, char)| {
        left -= ui.fonts_mut(|fonts| fonts.glyph_width(&font, *letter));
        left > 0.0
    };
    match typed.char_indices().rev().take_while(fits).last() {
        Some((0, _)) | None => format!("{typed}_"),
        Some((from, _)) => format!("...{}_", &typed[from..]),
    }
}

impl List<'_> {
    /// `entries`: names and tooltips; `choose`: the command of the n-th one.
    fn show<'a>(
        &self,
        ui: &Ui,
        entries: impl ExactSizeIterator<Item = (&'a str, &'a str)>,
        choose: impl Fn(usize) -> Command,
        execute: Execute,
    ) {
        let screen = ui.ctx().content_rect();
        let is_low = screen.height() < LOW_WINDOW;
        let margin = if is_low { 6 } else { 16 };
        dialog(ui, self.title, (Align2::CENTER_CENTER, 0.0), margin, [120.0, 720.0], |ui, width| {
            ui.horizontal(|ui| {
                ui.heading(self.title);
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    let close = ui.button(texts::CLOSE_BUTTON).tell(self.close.0).named(texts::CLOSE);
                    close.gives(self.close.1, execute);
                });
            });
            let small = |text: &str, colour| Label::new(RichText::new(text).size(SMALL_TEXT).color(colour)).truncate();
            match self.typed {
                Some(typed) => {
                    let label = small(&end_of(ui, typed, width), TEXT);
                    ui.add(label).named(texts::PATH).with_value(typed);
                }
                None => _ = ui.add(small(self.about, WEAK_TEXT)),
            }
            // Below the title and what it is about.
            let mut height = (screen.height() - if is_low { 100.0 } else { 160.0 }).max(30.0);
            if let Some((line, colour)) = self.line {
                ui.add(small(line, colour));
                height = (height - 30.0).min(screen.height() * SHARE).max(20.0);
            }
            // Another folder is seen from its beginning.
            let area = ScrollArea::vertical().id_salt(self.about).max_height(height).min_scrolled_height(0.0);
            area.auto_shrink([true, self.line.is_none()]).show(ui, |ui| {
                if self.can_cancel {
                    let [name, hint] = texts::CANCEL_EXPORT;
                    ui.button(name).tell(hint).gives(Command::CancelExport, execute);
                }
                names::list(ui, self.about, |ui| {
                    if entries.len() == 0 {
                        ui.label(texts::NO_RECORDING_HERE);
                    }
                    let walk = Walk::new(ui, self.title, entries.len(), 1);
                    for (n, (name, hint)) in entries.enumerate() {
                        self.headings.iter().filter(|(at, _)| *at == n).for_each(|(_, text)| heading(ui, text));
                        let key = if n < 9 { format!("{}   ", n + 1) } else { "     ".into() };
                        let button = Button::new(format!("{key}{name}")).truncate();
                        let button = button.min_size(vec2(width - 20.0, TOUCH_SIZE * 0.7));
                        let entry = ui.add(button).tell(hint).named(name);
                        walk.entry(n, &entry);
                        entry.gives(choose(n), execute);
                    }
                });
            });
        });
    }
}
