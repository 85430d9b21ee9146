//! Opening recordings and workspaces while the view runs, from a list, by dropping files, or from those that are open already: what is shown stays
//! until the next one is open, and is kept as it was left.

use super::{Console, OpenFile, Opened};
use crate::files::progress::{Progress, Share};
use crate::gpu::Wake;
use crate::open_list::{self, Kind};
use crate::panels::Reading;
use crate::recordings::{Display, Kept, MAX_OPEN, Named, OpenRecordings, Recordings};
use crate::source::live::SourceKind;
use crate::source_supervisor::SourceState;
use crate::texts;
use std::path::{Path, PathBuf};
use std::sync::MutexGuard;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Reading that takes longer is shown.
const SHOWN_AFTER: Duration = Duration::from_millis(200);
/// How often it is looked at how far it is.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);

/// What can be opened, and what is being opened.
pub(super) struct Opening {
    open: Option<OpenFile>,
    recent: Option<PathBuf>,
    wake: Wake,
    recordings: OpenRecordings,
    /// The file that is being read, in place of which the present one is still shown.
    file: Option<BeingRead>,
    /// Files that were dropped on the window since the last update.
    dropped: Vec<PathBuf>,
    /// The list while it is shown.
    list: Option<List>,
    /// The source of this console, while it is being opened.
    source: Progress,
    /// What the window said last of what is being read.
    told: Option<Reading>,
}

struct BeingRead {
    path: PathBuf,
    progress: Progress,
    opened: Receiver<Result<Opened, String>>,
    since: Instant,
    /// It was not in the list of recordings before.
    is_new: bool,
    /// The recording that is shown is closed for it.
    closes: bool,
    /// What was opened goes on to be read.
    is_opened: bool,
}

impl Drop for BeingRead {
    /// Nobody waits for it any more.
    fn drop(&mut self) {
        if !self.is_opened {
            self.progress.cancel();
        }
    }
}

impl Drop for Opening {
    /// What is still read for this console is read for nobody.
    fn drop(&mut self) {
        self.source.cancel();
    }
}

struct List {
    /// What the list says of itself.
    title: String,
    entries: Vec<(Kind, PathBuf)>,
    names: Vec<String>,
}

impl Opening {
    pub(super) fn new(
        open: Option<OpenFile>,
        recent: Option<PathBuf>,
        recordings: OpenRecordings,
        source: Progress,
        wake: Wake,
    ) -> Opening {
        let (file, dropped, list, told) = (None, Vec::new(), None, None);
        Opening { open, recent, wake, recordings, file, dropped, list, source, told }
    }

    pub(super) fn is_shown(&self) -> bool {
        self.list.is_some()
    }

    /// The list while it is shown: its title and its entries.
    pub(super) fn shown(&self) -> Option<(&str, &[String])> {
        self.list.as_ref().map(|list| (list.title.as_str(), list.names.as_slice()))
    }

    /// The recordings that are open.
    pub(super) fn named(&self) -> Vec<Named> {
        self.recordings().list()
    }

    /// What is being read, as the window says it.
    pub(super) fn told(&self) -> Option<&Reading> {
        self.told.as_ref()
    }

    fn recordings(&self) -> MutexGuard<'_, Recordings> {
        self.recordings.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Puts a file first on the list of recent files, if one is kept.
    pub(super) fn remember(&self, file: &Path) {
        self.recent.iter().filter(|_| file.exists()).for_each(|list| open_list::remember(list, file));
    }

    /// The list of a folder; with the recent files first if asked for.
    fn list(&self, folder: &Path, with_recent: bool) -> List {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let recent = self.recent.as_deref().filter(|_| with_recent).map(open_list::recent).unwrap_or_default();
        let mut names: Vec<String> = recent.iter().map(|file| file.display().to_string()).collect();
        let mut entries: Vec<_> = recent.into_iter().map(|file| (Kind::File, file)).collect();
        for (kind, path) in open_list::entries(&folder) {
            let name = path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
            names.push(match kind {
                Kind::FolderAbove => texts::FOLDER_ABOVE.into(),
                Kind::Series(count) => texts::files_as_series(count),
                Kind::Folder => format!("{name}/"),
                Kind::File => name,
            });
            entries.push((kind, path));
        }
        List { title: folder.display().to_string(), entries, names }
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
        let chosen = self.opening.list.as_ref().and_then(|list| list.entries.get(n)).cloned();
        let Some((kind, path)) = chosen else { return };
        if matches!(kind, Kind::Folder | Kind::FolderAbove) {
            self.opening.list = Some(self.opening.list(&path, false));
            self.needs_redraw = true;
        } else {
            self.opening.list = None;
            self.open_path(&path);
        }
    }

    /// Takes a file that was dropped on the window. Of several that are dropped together the first is shown, the others are listed.
    pub fn drop_file(&mut self, path: &Path) {
        self.opening.dropped.push(path.to_path_buf());
    }

    fn open_dropped(&mut self) {
        let dropped = std::mem::take(&mut self.opening.dropped);
        let Some((first, others)) = dropped.split_first() else { return };
        self.open_path(first);
        if self.opening.file.is_none() {
            return;
        }
        let is_full = {
            let mut list = self.opening.recordings();
            others.iter().filter(|path| !list.add(path)).count() > 0
        };
        if is_full {
            self.notify(&texts::too_many_recordings(MAX_OPEN), true);
        }
    }

    /// Opens a recording or a workspace and shows it. The one that is shown already is read anew.
    pub fn open_path(&mut self, path: &Path) {
        self.read(path, false);
    }

    /// Reads a file in the background, in place of another one that is being read. `closes`: the recording that is shown is closed for it.
    fn read(&mut self, path: &Path, closes: bool) {
        let Some(open) = self.opening.open.clone() else {
            return self.notify(texts::OPENS_NO_OTHER_FILES, true);
        };
        if self.has_unsaved_loop() {
            return self.notify(texts::SAVE_THE_LOOP_FIRST, true);
        }
        // What was being read stays in the list.
        self.opening.file = None;
        let (is_new, has_room) = {
            let mut list = self.opening.recordings();
            (list.index(path).is_none(), list.add(path))
        };
        if !has_room {
            return self.notify(&texts::too_many_recordings(MAX_OPEN), true);
        }
        let (sender, opened) = channel();
        let (wake, progress) = (self.opening.wake.clone(), Progress::default());
        let (path, own) = (path.to_path_buf(), progress.clone());
        let file = path.clone();
        let work = move || {
            let _ = sender.send(own.during(|| open(&file, &own)));
            wake();
        };
        let being_read = BeingRead { path, progress, opened, since: Instant::now(), is_new, closes, is_opened: false };
        self.needs_redraw = true;
        match std::thread::Builder::new().name("opening".into()).spawn(work) {
            Ok(_) => self.opening.file = Some(being_read),
            Err(e) => {
                let name = self.opening.recordings().name(&being_read.path);
                self.forget(&being_read);
                self.notify(&texts::cannot_be_opened(name, e), true);
            }
        }
    }

    /// A file that was not opened leaves the list, unless it was there before.
    fn forget(&self, file: &BeingRead) {
        let mut list = self.opening.recordings();
        if let Some(n) = list.index(&file.path).filter(|_| file.is_new) {
            list.remove(n);
        }
    }

    /// Ends the reading of a file. Its name, if one was being read.
    fn end_reading(&mut self) -> Option<String> {
        let file = self.opening.file.take()?;
        let name = self.opening.recordings().name(&file.path);
        self.forget(&file);
        self.needs_redraw = true;
        Some(name)
    }

    /// Ends what is being read, at the wish of the user. False if nothing is.
    pub(super) fn cancel_reading(&mut self) -> bool {
        if let Some(name) = self.end_reading() {
            self.notify(&texts::not_read_further(name), false);
            return true;
        }
        let is_cancelled = self.reads_source() && self.source.cancel();
        if is_cancelled {
            self.opening.source.cancel();
            self.needs_redraw = true;
        }
        is_cancelled
    }

    /// True while the source of this console is being opened and the user may end that.
    fn reads_source(&self) -> bool {
        let is_opening = *self.source.state() == SourceState::Opening && self.startup_fault.is_none();
        is_opening && self.fixed.source == SourceKind::Recording && !self.fixed.is_kiosk
    }

    /// Shows the n-th of the recordings that are open.
    pub(super) fn show_recording(&mut self, n: usize) {
        let (path, is_shown) = {
            let list = self.opening.recordings();
            let path = list.path(n).map(Path::to_path_buf);
            let is_shown = path.as_deref() == list.shown();
            (path, is_shown)
        };
        match path {
            // Who chooses it again stays with it.
            Some(_) if is_shown => _ = self.end_reading(),
            Some(path) => self.read(&path, false),
            None => {}
        }
    }

    /// Shows a recording so many places further than the one that is shown, or on its way to be.
    pub(super) fn step_recording(&mut self, by: i32) {
        let next = {
            let list = self.opening.recordings();
            let from = self.opening.file.as_ref().map(|file| file.path.as_path()).or(list.shown());
            from.and_then(|from| list.index(list.step(from, by)?)).filter(|_| list.list().len() > 1)
        };
        match next {
            Some(next) => self.show_recording(next),
            None => self.notify(texts::ONLY_RECORDING, false),
        }
    }

    /// Closes the n-th recording. In place of the one that is shown comes the next, or else the one before.
    pub(super) fn close_recording(&mut self, n: usize) {
        let list = self.opening.recordings().list();
        let shown = list.iter().position(|named| named.is_shown);
        let n = if n == usize::MAX { shown.unwrap_or(n) } else { n };
        let Some(name) = list.get(n).map(|named| named.name.clone()) else { return };
        if shown != Some(n) {
            let path = self.opening.recordings().path(n).map(Path::to_path_buf);
            if self.opening.file.as_ref().is_some_and(|file| Some(&file.path) == path.as_ref()) {
                self.opening.file = None;
            }
            let mut list = self.opening.recordings();
            if let Some(n) = path.and_then(|path| list.index(&path)) {
                list.remove(n);
            }
            drop(list);
            return self.notify(&texts::is_closed(name), false);
        }
        let next = if n + 1 < list.len() { Some(n + 1) } else { n.checked_sub(1) };
        let next = next.and_then(|next| self.opening.recordings().path(next).map(Path::to_path_buf));
        match next {
            Some(next) => self.read(&next, true),
            None => self.notify(texts::ONLY_RECORDING, false),
        }
    }

    /// Takes what was opened: the console asks to be replaced by one that shows it.
    pub(super) fn poll_opening(&mut self, now: Instant) {
        self.open_dropped();
        let opened = self.opening.file.as_ref().map(|file| file.opened.try_recv());
        match opened {
            None | Some(Err(TryRecvError::Empty)) => {}
            Some(Ok(Ok(opened))) => self.show_opened(opened),
            Some(Ok(Err(fault))) => self.not_opened(&fault),
            Some(Err(TryRecvError::Disconnected)) => self.not_opened(texts::WHY_FILE_NOT_READ),
        }
        let told = self.being_read(now);
        self.needs_redraw |= told != self.opening.told;
        self.opening.told = told;
    }

    fn show_opened(&mut self, opened: Opened) {
        let Some(mut file) = self.opening.file.take() else { return };
        file.is_opened = true;
        opened();
        self.opening.remember(&file.path);
        let (kept, display) = (self.kept(), self.display());
        self.opening.recordings().show(&file.path, kept, file.closes, display);
        self.request.restart = true;
    }

    fn not_opened(&mut self, fault: &str) {
        self.end_reading();
        self.notify(&texts::not_opened(fault), true);
    }

    /// What is kept of the recording that is shown. Nothing before its first picture: its settings do not follow from it
    /// yet.
    fn kept(&mut self) -> Option<Kept> {
        let has_drawn = self.stream.renderer().is_some_and(|renderer| renderer.has_drawn());
        if !has_drawn && !self.is_kept {
            return None;
        }
        let volumes = self.stream.cine().volumes();
        let is_numbered = self.fixed.plays_once && self.fixed.source == SourceKind::Recording;
        let shown = self.stream.cine_position().and_then(|at| volumes.get(at)).map(|kept| kept.volume);
        let frozen = self.frozen_volume.or(shown.filter(|_| self.stream.is_frozen() && is_numbered));
        Some(Kept { controls: self.controls.set_aside(), frozen })
    }

    fn display(&self) -> Display {
        let (panels, times, bar) = (self.shows_panels, self.shows_times, self.controls.settings().marks.bar);
        Display { panels, times, bar, has_focus: self.panels.has_focus() }
    }

    /// What is being read, and how far it is.
    fn being_read(&self, now: Instant) -> Option<Reading> {
        let (path, progress, since) = match &self.opening.file {
            Some(file) => (Some(file.path.as_path()), &file.progress, file.since),
            None => (None, &self.opening.source, self.started),
        };
        let is_shown = now.saturating_duration_since(since) >= SHOWN_AFTER && (path.is_some() || self.reads_source());
        if !is_shown {
            return None;
        }
        let list = self.opening.recordings();
        let name = path.or(list.shown()).map_or(String::new(), |path| list.name(path));
        let (share, text) = match progress.share() {
            Share::Unknown => (None, String::new()),
            Share::Files { done, count } => {
                (Some(done as f32 / count.max(1) as f32), texts::files_of_folder(done, count))
            }
            Share::Percent(percent) => (Some(f32::from(percent) / 100.0), texts::percent(percent)),
        };
        Some(Reading { name, share, text })
    }

    /// When it is to be looked at what is being read.
    pub(super) fn reading_wakes_at(&self, now: Instant) -> Option<Instant> {
        let is_reading = self.opening.file.is_some() || self.reads_source();
        is_reading.then_some(now + LOOK_INTERVAL)
    }

    /// Freezes the volume of a recording that was frozen when it was left, once it is there: at the end of the recording, or when the loop would
    /// drop it.
    pub(super) fn refreeze(&mut self) {
        let Some(wanted) = self.frozen_volume else { return };
        let volumes = self.stream.cine().volumes();
        let at = volumes.iter().position(|kept| kept.volume == wanted);
        let is_over = matches!(self.source.state(), SourceState::Ended(_));
        let is_full = volumes.len() >= self.fixed.cine_volumes;
        match at {
            Some(at) if is_over || (is_full && at < 2) => {
                self.frozen_volume = None;
                self.show_cine_volume(at);
            }
            None if is_over => self.frozen_volume = None,
            _ => {}
        }
    }
}
