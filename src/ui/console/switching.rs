//! Recordings and workspaces in the console: opening one, and leaving the shown one.

use super::Console;
use crate::recordings::{Display, Kept, MAX_OPEN};
use crate::source::live::SourceKind;
use crate::texts;
use std::path::{Path, PathBuf};
use std::time::Instant;

impl Console {
    /// Shows the list of files to open, or closes it.
    pub(super) fn toggle_files(&mut self) {
        if !self.opening.close_list() {
            if !self.opening.is_offered() {
                return self.notify(texts::OPENS_NO_OTHER_FILES, true);
            }
            let recording = self.fixed.origin.as_ref().and_then(|origin| origin.recording.as_deref());
            let beside = recording.and_then(Path::parent).filter(|folder| folder.is_dir());
            self.opening.show_list(beside.unwrap_or(&self.exporter.folder));
        }
        self.presentation.redraw();
    }

    /// Opens the n-th entry of the list of files: shows a file, or lists the content of a folder.
    pub(super) fn open_entry(&mut self, n: usize) {
        if let Some(path) = self.opening.choose(n) {
            self.open_path(&path);
        }
    }

    /// Notes a file that was dropped on the window. Of several dropped together the first will be shown, and the others are added to the open
    /// recordings.
    pub fn drop_file(&mut self, path: &Path) {
        self.opening.dropped.push(path.to_path_buf());
    }

    fn open_dropped(&mut self) {
        let dropped = std::mem::take(&mut self.opening.dropped);
        let Some((first, others)) = dropped.split_first() else { return };
        self.open_path(first);
        if self.opening.is_reading() && !self.opening.add(others) {
            self.notify(&texts::too_many_recordings(MAX_OPEN), true);
        }
    }

    /// Reads a recording or a workspace in the background, and then shows it. If it is the one that is shown, it is read again. Refused with a
    /// message if no other files can be opened, if too many are open, or if unsaved volumes or measurements would be lost.
    pub fn open_path(&mut self, path: &Path) {
        self.read(path, false);
    }

    /// Reads a file in the background. `closes`: the recording that is shown is closed for it.
    fn read(&mut self, path: &Path, closes: bool) {
        if self.opening.is_offered() && self.has_unsaved_loop() {
            return self.notify(texts::SAVE_THE_LOOP_FIRST, true);
        }
        // A pipe leaves the list.
        if self.opening.is_offered() && self.connection.kind == SourceKind::Pipe && self.controls.is_unsaved() {
            return self.notify(texts::SAVE_THE_WORKSPACE_FIRST, true);
        }
        match self.opening.read(path, closes) {
            Ok(()) => self.presentation.redraw(),
            Err(why) => self.notify(&why, true),
        }
    }

    /// Cancels the reading of a file at the user's request. Returns false if none is being read.
    pub(super) fn cancel_reading(&mut self) -> bool {
        if let Some(name) = self.opening.end_reading() {
            self.notify(&texts::not_read_further(name), false);
            return true;
        }
        let is_cancelled = self.reads_source() && self.connection.source.cancel();
        if is_cancelled {
            self.opening.source.cancel();
            self.presentation.redraw();
        }
        is_cancelled
    }

    /// True while the console's own source is being opened in a way that the user can cancel.
    pub(super) fn reads_source(&self) -> bool {
        let is_opening = self.connection.is_opening() && !self.faults.prevents_view();
        is_opening && self.connection.kind == SourceKind::Recording && !self.fixed.is_kiosk
    }

    /// Shows the n-th open recording.
    pub(super) fn show_recording(&mut self, n: usize) {
        match self.opening.recording(n) {
            // Who chooses it again stays with it.
            Some((_, true)) => {
                let is_ended = self.opening.end_reading().is_some();
                self.presentation.redraw_if(is_ended);
            }
            Some((path, false)) => self.read(&path, false),
            None => {}
        }
    }

    /// Shows the recording `by` positions after the one that is being read, or else the shown one.
    pub(super) fn step_recording(&mut self, by: i32) {
        match self.opening.further(by) {
            Some(next) => self.show_recording(next),
            None => self.notify(texts::ONLY_RECORDING, false),
        }
    }

    /// Closes the n-th recording and, if it was shown, shows the next one, or else the previous one. Measurements, marks or cuts on it that are
    /// in no file are discarded only if the user asks for it twice.
    pub(super) fn close_recording(&mut self, n: usize, now: Instant) {
        let Some((name, path, is_shown)) = self.opening.to_close(n) else { return };
        let next = self.opening.in_its_place().filter(|_| is_shown);
        if is_shown && next.is_none() {
            return self.notify(texts::ONLY_RECORDING, false);
        }
        let is_kept = |(other, _): &(PathBuf, Kept)| *other == path;
        let loses = if is_shown { self.controls.is_unsaved() } else { self.opening.unsaved().iter().any(is_kept) };
        if loses && self.leaving.warns_of(&path, now) {
            return self.notify(&texts::loses_work(name), true);
        }
        match next {
            Some(next) => self.read(&next, true),
            None => {
                self.opening.close(&path);
                self.notify(&texts::is_closed(name), false);
            }
        }
    }

    /// If a file was opened, asks for this console to be replaced by one that shows it.
    pub(super) fn poll_opening(&mut self, now: Instant) {
        self.open_dropped();
        match self.opening.poll() {
            None => {}
            Some(Ok(file)) => {
                let (kept, display) = (self.kept(), self.display());
                self.opening.show(&file, kept, display);
                self.request.restart = true;
            }
            Some(Err(fault)) => self.notify(&texts::not_opened(fault), true),
        }
        let source_since = self.reads_source().then_some(self.fixed.started);
        let is_other = self.opening.look(source_since, now);
        self.presentation.redraw_if(is_other);
    }

    /// What is kept of the recording that is shown. Nothing before its first picture: its settings do not follow from it
    /// yet.
    fn kept(&mut self) -> Option<Kept> {
        let has_drawn = self.stream.renderer().is_some_and(|renderer| renderer.has_drawn());
        if !has_drawn && !self.fixed.is_kept {
            return None;
        }
        let is_numbered = self.fixed.plays_once && self.connection.kind == SourceKind::Recording;
        let shown = self.cine_volume().map(|kept| kept.volume);
        let frozen = self.replay.frozen.or(shown.filter(|_| self.stream.is_frozen() && is_numbered));
        Some(Kept { controls: self.controls.set_aside(), frozen })
    }

    fn display(&self) -> Display {
        let (panels, times, bar) = (self.visible.panels, self.visible.times, self.controls.settings().drawn.marks.bar);
        Display { panels, times, bar, has_focus: self.panels.has_focus() }
    }

    /// Freezes the volume that was frozen when the recording was last left, once it is loaded.
    pub(super) fn refreeze(&mut self) {
        let volumes = self.stream.cine().volumes().iter().map(|kept| kept.volume);
        if let Some(at) = self.replay.refreeze(volumes, self.fixed.cine_volumes, self.connection.is_over()) {
            self.show_cine_volume(at);
        }
    }
}
