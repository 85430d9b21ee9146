//! Opening another recording or workspace while the view runs: from a list, or a file that was dropped on the window.

use super::{Console, OpenFile};
use crate::gpu::Wake;
use crate::ui::open_list;
use crate::ui::texts;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// What can be opened, and what is being opened.
pub(super) struct Opening {
    open: Option<OpenFile>,
    recent: Option<PathBuf>,
    wake: Wake,
    opened: Option<Receiver<Result<PathBuf, String>>>,
    /// The list while it is shown.
    list: Option<List>,
}

struct List {
    /// What the list says of itself.
    title: String,
    paths: Vec<PathBuf>,
    names: Vec<String>,
}

impl Opening {
    pub(super) fn new(open: Option<OpenFile>, recent: Option<PathBuf>, wake: Wake) -> Opening {
        Opening { open, recent, wake, opened: None, list: None }
    }

    pub(super) fn is_shown(&self) -> bool {
        self.list.is_some()
    }

    /// The list while it is shown: its title and its entries.
    pub(super) fn shown(&self) -> Option<(&str, &[String])> {
        self.list.as_ref().map(|list| (list.title.as_str(), list.names.as_slice()))
    }

    /// Puts a file first on the list of recent files, if one is kept.
    pub(super) fn remember(&self, file: &Path) {
        self.recent.iter().for_each(|list| open_list::remember(list, file));
    }

    /// The list of a folder; with the recent files first if asked for.
    fn list(&self, folder: &Path, with_recent: bool) -> List {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let recent = self.recent.as_deref().filter(|_| with_recent).map(open_list::recent).unwrap_or_default();
        let named = recent.iter().map(|file| file.display().to_string());
        let mut names: Vec<String> = named.collect();
        let mut paths = recent;
        for (n, path) in open_list::entries(&folder).into_iter().enumerate() {
            let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
            let is_above = n == 0 && folder.parent() == Some(&path);
            names.push(match (is_above, path.is_dir()) {
                (true, _) => texts::FOLDER_ABOVE.into(),
                (_, true) => format!("{name}/"),
                (_, false) => name,
            });
            paths.push(path);
        }
        List { title: folder.display().to_string(), paths, names }
    }
}

impl Console {
    /// Shows the list of files to open, or closes it.
    pub(super) fn toggle_files(&mut self) {
        self.opening.list = match self.opening.list {
            Some(_) => None,
            None if self.opening.open.is_none() => {
                self.notify(texts::OPENS_NO_OTHER_FILES, true);
                None
            }
            None => {
                let recording = self.fixed.origin.as_ref().and_then(|origin| origin.recording.as_deref());
                let beside = recording.and_then(Path::parent).filter(|folder| folder.is_dir());
                let folder = beside.unwrap_or(self.exporter.folder()).to_path_buf();
                Some(self.opening.list(&folder, true))
            }
        };
        self.needs_redraw = true;
    }

    /// Opens the n-th entry of the list: a file, or a folder, whose list is shown then.
    pub(super) fn open_entry(&mut self, n: usize) {
        let Some(path) = self.opening.list.as_ref().and_then(|list| list.paths.get(n)).cloned() else { return };
        if path.is_dir() {
            self.opening.list = Some(self.opening.list(&path, false));
            self.needs_redraw = true;
        } else {
            self.opening.list = None;
            self.open_path(&path);
        }
    }

    /// Opens a recording or a workspace in place of what is shown, in the background.
    pub fn open_path(&mut self, path: &Path) {
        let Some(open) = self.opening.open.clone() else {
            return self.notify(texts::OPENS_NO_OTHER_FILES, true);
        };
        if self.opening.opened.is_some() {
            return self.notify(texts::STILL_OPENING, true);
        }
        if self.has_unsaved_loop() {
            return self.notify(texts::SAVE_THE_LOOP_FIRST, true);
        }
        let (sender, receiver) = channel();
        let (wake, path) = (self.opening.wake.clone(), path.to_path_buf());
        let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        let work = move || {
            let _ = sender.send(open(&path).map(|()| path));
            wake();
        };
        match std::thread::Builder::new().name("opening".into()).spawn(work) {
            Ok(_) => {
                self.opening.opened = Some(receiver);
                self.notify(&texts::opening(name), false);
            }
            Err(e) => self.notify(&texts::cannot_be_opened(name, e), true),
        }
    }

    /// Takes what was opened: the console asks to be replaced by one that shows it.
    pub(super) fn poll_opening(&mut self) {
        let opened = match self.opening.opened.as_ref().map(Receiver::try_recv) {
            None | Some(Err(TryRecvError::Empty)) => return,
            Some(Ok(opened)) => opened,
            Some(Err(TryRecvError::Disconnected)) => Err(texts::WHY_FILE_NOT_READ.into()),
        };
        self.opening.opened = None;
        match opened {
            Ok(path) => {
                self.opening.remember(&path);
                self.request.restart = true;
            }
            Err(fault) => self.notify(&texts::not_opened(fault), true),
        }
    }
}
