//! Opens recordings and workspaces while the view runs: from a list, by dropping files, or from the open recordings. The present one stays until the
//! next is open, and its state is kept.

use super::options::{OpenFile, Opened, OpeningOptions};
use crate::files::progress::{Progress, Share};
use crate::gpu::Wake;
use crate::input::Key;
use crate::open_list::{self, Kind};
use crate::panels::{FilesShown, Reading};
use crate::recordings::{Display, Kept, MAX_OPEN, Named, OpenRecordings, Recordings};
use crate::sync::locked;
use crate::texts;
use std::path::{Path, PathBuf};
use std::sync::MutexGuard;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

/// Reading that takes longer is shown.
const SHOWN_AFTER: Duration = Duration::from_millis(200);
/// How often it is looked at how far it is.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);

/// The list of files to open, the open recordings, and the file that is being read.
pub(super) struct Opening {
    open: Option<OpenFile>,
    recent: Option<PathBuf>,
    wake: Wake,
    recordings: OpenRecordings,
    /// The file that is being read while the present one is still shown.
    file: Option<BeingRead>,
    /// Files dropped on the window since the last update.
    pub(super) dropped: Vec<PathBuf>,
    /// The list, while it is shown.
    list: Option<List>,
    /// Progress of opening this console's own source.
    pub(super) source: Progress,
    /// The file that is being read and its progress, as the window shows it; None if it shows none.
    pub(super) told: Option<Reading>,
}

/// A file that is being read in the background.
pub(super) struct BeingRead {
    path: PathBuf,
    progress: Progress,
    opened: Receiver<Result<Opened, String>>,
    since: Instant,
    /// Whether it was not in the list of recordings before.
    is_new: bool,
    /// Whether the shown recording is closed for it.
    closes: bool,
    /// Whether it was opened, and its volume is still being read.
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
    folder: String,
    /// Number of recent files, which are the first entries.
    recent: usize,
    entries: Vec<(Kind, PathBuf)>,
    names: Vec<String>,
    /// The path that is being typed, and why it was rejected.
    typed: Option<(String, Option<String>)>,
}

/// Longest path that is typed, characters.
const MAX_TYPED: usize = 1000;

/// What a key does while the list of files is shown.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum ListKey {
    /// It chooses the n-th entry.
    Entry(usize),
    /// It opens the file of this path.
    Open(PathBuf),
    /// It was typed into the path, or has no effect.
    Taken,
}

impl Opening {
    pub(super) fn new(options: OpeningOptions, wake: Wake) -> Opening {
        let OpeningOptions { open_file: open, recent, recordings, progress: source, .. } = options;
        let (file, dropped, list, told) = (None, Vec::new(), None, None);
        Opening { open, recent, wake, recordings, file, dropped, list, source, told }
    }

    pub(super) fn is_shown(&self) -> bool {
        self.list.is_some()
    }

    /// The list of files to open; None while it is not shown.
    pub(super) fn shown(&self) -> Option<FilesShown<'_>> {
        let List { folder, recent, names, typed, .. } = self.list.as_ref()?;
        let typed = typed.as_ref().map(|(text, fault)| (text.as_str(), fault.as_deref()));
        Some(FilesShown { folder, recent: *recent, names, typed })
    }

    /// True while a path is being typed.
    pub(super) fn is_typing(&self) -> bool {
        self.list.as_ref().is_some_and(|list| list.typed.is_some())
    }

    /// Discards the path that is being typed. Returns false if there is none.
    pub(super) fn stop_typing(&mut self) -> bool {
        self.list.as_mut().is_some_and(|list| list.typed.take().is_some())
    }

    /// Handles a key while the list of files is shown. None for Escape, which the list does not handle. `is_upper`: Shift is held.
    pub(super) fn key(&mut self, key: Key, is_upper: bool) -> Option<ListKey> {
        let list = self.list.as_mut()?;
        // A keyboard without a windowing system tells its keys, not their signs.
        let key = match key {
            Key::Char('`') if is_upper => Key::Char('~'),
            Key::Char('-') if is_upper => Key::Char('_'),
            key => key,
        };
        let Some((text, fault)) = &mut list.typed else {
            match key {
                Key::Char(digit @ '1'..='9') => return Some(ListKey::Entry(digit as usize - '1' as usize)),
                Key::Char(letter @ ('/' | '~')) => list.typed = Some((letter.into(), None)),
                Key::Escape => return None,
                _ => {}
            }
            return Some(ListKey::Taken);
        };
        match key {
            Key::Escape => return None,
            Key::Enter => {
                let path = open_list::expanded(text);
                if path.is_dir() {
                    self.list = Some(self.list(&path, false));
                } else if path.exists() {
                    self.list = None;
                    return Some(ListKey::Open(path));
                } else {
                    *fault = Some(texts::is_not_there(text));
                }
                return Some(ListKey::Taken);
            }
            Key::Backspace => _ = text.pop(),
            Key::Tab => text.push_str(&open_list::completion(text)),
            Key::Space if text.chars().count() < MAX_TYPED => text.push(' '),
            Key::Char(letter) if text.chars().count() < MAX_TYPED => match is_upper {
                true => text.extend(letter.to_uppercase()),
                false => text.push(letter),
            },
            _ => return Some(ListKey::Taken),
        }
        *fault = None;
        if text.is_empty() {
            list.typed = None;
        }
        Some(ListKey::Taken)
    }

    /// All open recordings, as the window lists them.
    pub(super) fn named(&self) -> Vec<Named> {
        self.recordings().list()
    }

    pub(super) fn recordings(&self) -> MutexGuard<'_, Recordings> {
        locked(&self.recordings)
    }

    /// Puts a file at the top of the list of recent files, if that is stored.
    pub(super) fn remember(&self, file: &Path) {
        self.recent.iter().filter(|_| file.exists()).for_each(|list| open_list::remember(list, file));
    }

    /// The list of a folder; with the recent files first if asked for.
    fn list(&self, folder: &Path, with_recent: bool) -> List {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
        let recent = self.recent.as_deref().filter(|_| with_recent).map(open_list::recent).unwrap_or_default();
        let count = recent.len();
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
        List { folder: folder.display().to_string(), recent: count, entries, names, typed: None }
    }

    /// True if the user can open files.
    pub(super) fn is_offered(&self) -> bool {
        self.open.is_some()
    }

    /// Shows the list of files: the recent ones first, then those of a folder.
    pub(super) fn show_list(&mut self, folder: &Path) {
        self.list = Some(self.list(folder, true));
    }

    /// Closes the list of files. Returns false if it is not shown.
    pub(super) fn close_list(&mut self) -> bool {
        self.list.take().is_some()
    }

    /// Chooses the n-th entry of the list of files. The path of a file is returned, for the caller to open; the content of a folder is listed.
    pub(super) fn choose(&mut self, n: usize) -> Option<PathBuf> {
        let (kind, path) = self.list.as_ref()?.entries.get(n)?.clone();
        let is_folder = matches!(kind, Kind::Folder | Kind::FolderAbove);
        self.list = is_folder.then(|| self.list(&path, false));
        (!is_folder).then_some(path)
    }

    /// Adds recordings to the list of open ones. Returns false if there was no room for all.
    pub(super) fn add(&self, paths: &[PathBuf]) -> bool {
        let mut list = self.recordings();
        paths.iter().filter(|path| !list.add(path)).count() == 0
    }

    pub(super) fn is_reading(&self) -> bool {
        self.file.is_some()
    }

    /// Starts to read a file on a thread. A file that was being read is given up, but stays in the list. `closes`: the shown recording is closed
    /// for it.
    ///
    /// # Errors
    /// One line: other files cannot be opened, too many are open, or no thread can be started.
    pub(super) fn read(&mut self, path: &Path, closes: bool) -> Result<(), String> {
        let open = self.open.clone().ok_or(texts::OPENS_NO_OTHER_FILES)?;
        self.file = None;
        let (is_new, has_room) = {
            let mut list = self.recordings();
            (list.index(path).is_none(), list.add(path))
        };
        if !has_room {
            return Err(texts::too_many_recordings(MAX_OPEN));
        }
        let (sender, opened) = channel();
        let (wake, progress) = (self.wake.clone(), Progress::default());
        let (path, own) = (path.to_path_buf(), progress.clone());
        let file = path.clone();
        let work = move || {
            let _ = sender.send(own.during(|| open(&file, &own)));
            wake();
        };
        let being_read = BeingRead { path, progress, opened, since: Instant::now(), is_new, closes, is_opened: false };
        match std::thread::Builder::new().name("opening".into()).spawn(work) {
            Ok(_) => self.file = Some(being_read),
            Err(e) => {
                let name = self.recordings().name(&being_read.path);
                self.forget(&being_read);
                return Err(texts::cannot_be_opened(name, e));
            }
        }
        Ok(())
    }

    /// A file that was not opened leaves the list, unless it was there before.
    fn forget(&self, file: &BeingRead) {
        let mut list = self.recordings();
        if let Some(n) = list.index(&file.path).filter(|_| file.is_new) {
            list.remove(n);
        }
    }

    /// Gives up reading a file and returns its name; None if none was being read.
    pub(super) fn end_reading(&mut self) -> Option<String> {
        let file = self.file.take()?;
        let name = self.recordings().name(&file.path);
        self.forget(&file);
        Some(name)
    }

    /// Path of the n-th open recording, and whether it is shown. None if there is no n-th.
    pub(super) fn recording(&self, n: usize) -> Option<(PathBuf, bool)> {
        let list = self.recordings();
        let path = list.path(n)?;
        Some((path.to_path_buf(), Some(path) == list.shown()))
    }

    /// Index of the recording `by` positions after the one that is being read, or else the shown one; None if only one is open.
    pub(super) fn further(&self, by: i32) -> Option<usize> {
        let list = self.recordings();
        let from = self.file.as_ref().map(|file| file.path.as_path()).or(list.shown())?;
        list.index(list.step(from, by)?).filter(|_| list.list().len() > 1)
    }

    /// Name and path of the n-th recording, or of the shown one if `n` is `usize::MAX`, and whether it is shown. None if there is no n-th.
    pub(super) fn to_close(&self, n: usize) -> Option<(String, PathBuf, bool)> {
        let list = self.recordings();
        let path = if n == usize::MAX { list.shown() } else { list.path(n) }?;
        Some((list.name(path), path.to_path_buf(), Some(path) == list.shown()))
    }

    /// The recording that takes the place of the shown one when that is closed: the next one, or else the previous one. None if there is no other.
    pub(super) fn in_its_place(&self) -> Option<PathBuf> {
        let list = self.recordings();
        let shown = list.index(list.shown()?)?;
        list.path(shown + 1).or_else(|| list.path(shown.checked_sub(1)?)).map(Path::to_path_buf)
    }

    /// Closes a recording that is not shown.
    pub(super) fn close(&mut self, path: &Path) {
        self.file.take_if(|file| file.path == path);
        let mut list = self.recordings();
        if let Some(n) = list.index(path) {
            list.remove(n);
        }
    }

    /// The recordings that are not shown and have measurements, marks or cuts that are in no file, with the state kept of each.
    pub(super) fn unsaved(&self) -> Vec<(PathBuf, Kept)> {
        let recordings = self.recordings();
        let of = |n: usize| Some((recordings.path(n)?.to_path_buf(), recordings.unsaved(n)?.clone()));
        (0..MAX_OPEN).filter_map(of).collect()
    }

    /// The file whose reading has ended since the last call; None if there is none.
    ///
    /// # Errors
    /// One line: why the file could not be opened. Reading it has ended.
    pub(super) fn poll(&mut self) -> Option<Result<BeingRead, String>> {
        let fault = match self.file.as_ref()?.opened.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(Ok(opened)) => {
                let mut file = self.file.take()?;
                file.is_opened = true;
                opened();
                self.remember(&file.path);
                return Some(Ok(file));
            }
            Ok(Err(fault)) => fault,
            Err(TryRecvError::Disconnected) => texts::WHY_FILE_NOT_READ.into(),
        };
        self.end_reading();
        Some(Err(fault))
    }

    /// Makes the next console show this file. `kept`: the state of the recording that is shown now, to restore it later.
    pub(super) fn show(&self, file: &BeingRead, kept: Option<Kept>, display: Display) {
        self.recordings().show(&file.path, kept, file.closes, display);
    }

    /// Checks the progress of reading. `source_since`: time at which the opening of the console's own source began, while it lasts. Returns true
    /// if the text in the window changes.
    pub(super) fn look(&mut self, source_since: Option<Instant>, now: Instant) -> bool {
        let told = self.being_read(source_since, now);
        let is_other = told != self.told;
        self.told = told;
        is_other
    }

    fn being_read(&self, source_since: Option<Instant>, now: Instant) -> Option<Reading> {
        let (path, progress, since) = match &self.file {
            Some(file) => (Some(file.path.as_path()), &file.progress, file.since),
            None => (None, &self.source, source_since?),
        };
        if now.saturating_duration_since(since) < SHOWN_AFTER {
            return None;
        }
        let list = self.recordings();
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

    /// Time at which the progress of reading has to be checked again. `reads_source`: the console's own source is being opened.
    pub(super) fn due(&self, reads_source: bool, now: Instant) -> Option<Instant> {
        (self.is_reading() || reads_source).then_some(now + LOOK_INTERVAL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::live::SourceKind;
    use std::sync::mpsc::{Receiver, Sender};
    use std::sync::{Arc, Mutex};

    /// Files whose name says whether they can be opened, each read when the test says so.
    fn opening() -> (Opening, Sender<()>, Receiver<()>) {
        let (sender, woken) = channel();
        let (release, released) = channel();
        let released = Mutex::new(released);
        let open: OpenFile = Arc::new(move |path, _| {
            released.lock().map_err(|e| e.to_string())?.recv().map_err(|e| e.to_string())?;
            match path.ends_with("good") {
                true => Ok(Box::new(|| ()) as Opened),
                false => Err("it is bad".into()),
            }
        });
        let recordings = Arc::new(Mutex::new(Recordings::of(SourceKind::Recording, Path::new("shown"))));
        let options = OpeningOptions { open_file: Some(open), recordings, ..OpeningOptions::default() };
        (Opening::new(options, Arc::new(move || _ = sender.send(()))), release, woken)
    }

    /// Prevents a file that could not be read from staying in the list, and a window that flickers at every fast one.
    #[test]
    fn a_file_is_shown_when_it_is_read_and_leaves_the_list_if_it_cannot_be() {
        let (mut opening, release, woken) = opening();
        assert!(opening.poll().is_none() && opening.due(false, Instant::now()).is_none());
        opening.read(Path::new("bad"), false).expect("a thread");
        let begun = Instant::now();
        assert!(opening.poll().is_none() && opening.is_reading() && opening.named().len() == 2);
        assert!(!opening.look(None, begun) && opening.told.is_none(), "too short to be told");
        assert!(opening.look(None, begun + SHOWN_AFTER) && opening.told.is_some());
        release.send(()).expect("it waits");
        woken.recv().expect("it was read");
        assert_eq!(opening.poll().map(|read| read.err()), Some(Some("it is bad".into())));
        assert!(!opening.is_reading() && opening.named().len() == 1);
        opening.read(Path::new("good"), false).expect("a thread");
        release.send(()).expect("it waits");
        woken.recv().expect("it was read");
        assert!(opening.poll().is_some_and(|read| read.is_ok()) && opening.named().len() == 2);
        // Ended by the user.
        opening.read(Path::new("other"), false).expect("a thread");
        assert_eq!((opening.end_reading().as_deref(), opening.named().len()), (Some("other"), 2));
        assert_eq!(opening.end_reading(), None);
    }

    /// Prevents a digit of a path that opens an entry, a path that is lost because a letter of it is wrong, and one that Escape does not take back.
    #[test]
    fn a_path_is_typed_completed_and_opened() {
        let work = crate::files::WorkFolder::new(&std::env::temp_dir(), "echolume-test-").expect("a folder");
        std::fs::create_dir(work.path().join("Heart 2")).expect("a folder");
        for name in ["Heart 2/a1.mha", "Heart 2/a12.mha"] {
            std::fs::write(work.path().join(name), "").expect("a file");
        }
        let (mut opening, ..) = opening();
        opening.show_list(work.path());
        let text = |opening: &Opening| opening.shown().and_then(|shown| shown.typed.map(|typed| typed.0.to_string()));
        let type_text = |opening: &mut Opening, text: &str| {
            for letter in text.chars() {
                let key = if letter == ' ' { Key::Space } else { Key::Char(letter.to_ascii_lowercase()) };
                assert_eq!(opening.key(key, letter.is_uppercase()), Some(ListKey::Taken), "{letter}");
            }
        };
        assert_eq!(opening.key(Key::Char('2'), false), Some(ListKey::Entry(1)));
        assert_eq!((opening.key(Key::Char('x'), false), text(&opening)), (Some(ListKey::Taken), None));
        let folder = work.path().display().to_string();
        type_text(&mut opening, &format!("{folder}/H"));
        opening.key(Key::Tab, false);
        assert_eq!(text(&opening), Some(format!("{folder}/Heart 2/")));
        opening.key(Key::Tab, false);
        assert_eq!(text(&opening), Some(format!("{folder}/Heart 2/a1")), "as far as both names agree");
        opening.key(Key::Enter, false);
        let fault = opening.shown().and_then(|shown| shown.typed.and_then(|typed| typed.1.map(str::to_string)));
        assert!(fault.is_some_and(|fault| fault.contains("a1") && !fault.contains('\n')) && opening.is_typing());
        opening.key(Key::Backspace, false);
        assert!(opening.shown().is_some_and(|shown| shown.typed.is_some_and(|typed| typed.1.is_none())));
        assert_eq!((opening.key(Key::Escape, false), opening.stop_typing()), (None, true));
        assert!(!opening.is_typing() && opening.is_shown() && !opening.stop_typing());
        type_text(&mut opening, &format!("{folder}/Heart 2"));
        assert_eq!(opening.key(Key::Enter, false), Some(ListKey::Taken));
        assert_eq!(opening.shown().map(|shown| shown.folder.to_string()), Some(format!("{folder}/Heart 2")));
        type_text(&mut opening, &format!("{folder}/Heart 2/a12.mha"));
        let file = work.path().join("Heart 2").join("a12.mha");
        assert_eq!((opening.key(Key::Enter, false), opening.is_shown()), (Some(ListKey::Open(file)), false));
        assert_eq!(opening.key(Key::Enter, false), None);
    }
}
