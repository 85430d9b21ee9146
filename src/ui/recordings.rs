//! The recordings that are open in a window. One is shown, and only that one is in memory; for the others the user's work is kept: settings,
//! measurements and the frozen volume.

use super::controls::{Controls, Handiwork};
use super::texts;
use crate::source::live::SourceKind;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Largest number of recordings that can be open.
pub const MAX_OPEN: usize = 16;

/// The list of the open recordings of a window, which its successive consoles share.
pub type OpenRecordings = Arc<Mutex<Recordings>>;

/// The state of a recording that is kept while another one is shown.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    pub(super) controls: Controls,
    /// Number of the volume that was frozen; None if none was.
    pub(super) frozen: Option<u32>,
}

/// The state of the panels, which does not depend on the recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct Display {
    pub(super) panels: bool,
    pub(super) times: bool,
    pub(super) bar: bool,
    /// True if a panel has the keyboard focus.
    pub(super) has_focus: bool,
}

/// An open recording, as the window lists it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Named {
    /// Name of the recording, different from that of every other open one.
    pub(super) name: String,
    pub(super) path: String,
    pub(super) is_shown: bool,
}

#[derive(Debug)]
struct Entry {
    path: PathBuf,
    /// Shown instead of the file's name.
    title: Option<&'static str>,
    /// Whether it can be opened again; a pipe cannot.
    returns: bool,
    kept: Option<Kept>,
}

/// The list of open recordings, in the order in which they were opened.
#[derive(Debug, Default)]
pub struct Recordings {
    all: Vec<Entry>,
    shown: usize,
    display: Option<Display>,
}

/// Paths are compared as absolute ones, except for what is no file.
fn absolute(path: &Path) -> PathBuf {
    let is_file = path.exists();
    std::path::absolute(path).ok().filter(|_| is_file).unwrap_or_else(|| path.to_path_buf())
}

impl Recordings {
    /// A list of one source, which is shown. `kind`: its kind; a pipe cannot be opened again. `path`: the path or name by which a source of
    /// another kind is opened again.
    pub fn of(kind: SourceKind, path: &Path) -> Recordings {
        let title = match kind {
            SourceKind::Demo => Some(texts::DEMO_DATA),
            SourceKind::Pipe => Some(texts::STANDARD_INPUT),
            SourceKind::Recording | SourceKind::Probe => None,
        };
        let entry = Entry { path: absolute(path), title, returns: kind != SourceKind::Pipe, kept: None };
        Recordings { all: vec![entry], ..Recordings::default() }
    }

    /// Appends a recording unless it is in the list. Returns false if there is no room.
    pub fn add(&mut self, path: &Path) -> bool {
        let path = absolute(path);
        let is_there = self.place(&path).is_some();
        if !is_there && self.all.len() < MAX_OPEN {
            self.all.push(Entry { path, title: None, returns: true, kept: None });
            return true;
        }
        is_there
    }

    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    fn place(&self, path: &Path) -> Option<usize> {
        self.all.iter().position(|entry| entry.path == path)
    }

    pub(super) fn shown(&self) -> Option<&Path> {
        self.all.get(self.shown).map(|entry| entry.path.as_path())
    }

    pub(super) fn path(&self, n: usize) -> Option<&Path> {
        self.all.get(n).map(|entry| entry.path.as_path())
    }

    pub fn index(&self, path: &Path) -> Option<usize> {
        self.place(path).or_else(|| self.place(&absolute(path)))
    }

    /// The recording that is `by` positions after the recording `from`; after the last one comes the first.
    pub(super) fn step(&self, from: &Path, by: i32) -> Option<&Path> {
        let at = self.index(from).unwrap_or(self.shown) as i64 + i64::from(by);
        self.path(at.rem_euclid(self.all.len().max(1) as i64) as usize)
    }

    /// The name of the recording with this path.
    pub(super) fn name(&self, path: &Path) -> String {
        let own = || Entry { path: path.to_path_buf(), title: None, returns: true, kept: None }.file_name();
        self.index(path).and_then(|at| self.names().into_iter().nth(at)).unwrap_or_else(own)
    }

    /// All recordings, as the window lists them.
    pub(super) fn list(&self) -> Vec<Named> {
        let names = self.names().into_iter().zip(&self.all).enumerate();
        let named = |(n, (name, entry)): (usize, (String, &Entry))| Named {
            name,
            path: entry.path.display().to_string(),
            is_shown: n == self.shown,
        };
        names.map(named).collect()
    }

    /// Names that differ: those of files, with the folder where two are the same, and with a number where the folders are called the same too.
    fn names(&self) -> Vec<String> {
        let short: Vec<String> = self.all.iter().map(Entry::file_name).collect();
        let is_twice = |names: &[String], n: usize| names.iter().filter(|name| **name == names[n]).count() > 1;
        let folder = |entry: &Entry| {
            let folder = entry.path.parent().and_then(Path::file_name);
            folder.map_or(String::new(), |name| name.to_string_lossy().into_owned())
        };
        let long = (0..short.len()).map(|n| match is_twice(&short, n) {
            true => format!("{}/{}", folder(&self.all[n]), short[n]),
            false => short[n].clone(),
        });
        let long: Vec<String> = long.collect();
        let number = |n: usize| long[..n].iter().filter(|name| **name == long[n]).count() + 1;
        let names = (0..long.len()).map(|n| match is_twice(&long, n) {
            true => format!("{} ({})", long[n], number(n)),
            false => long[n].clone(),
        });
        names.collect()
    }

    /// Makes the recording with this path the shown one. `kept`: the state of the one that was shown. `closes`: remove that one from the list; a
    /// source that cannot be opened again is removed in any case.
    pub(super) fn show(&mut self, path: &Path, kept: Option<Kept>, closes: bool, display: Display) {
        self.display = Some(display);
        let Some(next) = self.index(path) else { return };
        let before = std::mem::replace(&mut self.shown, next);
        let Some(left) = self.all.get_mut(before).filter(|_| before != next) else {
            // It is read anew.
            self.all[next].kept = None;
            return;
        };
        left.kept = kept.or(left.kept.take());
        if closes || !left.returns {
            self.remove(before);
        }
    }

    /// The kept state of the n-th recording if it has measurements, annotations, body marks or cuts that are in no file; otherwise None.
    pub(super) fn unsaved(&self, n: usize) -> Option<&Kept> {
        self.all.get(n)?.kept.as_ref().filter(|kept| n != self.shown && kept.controls.is_unsaved())
    }

    /// Notes that these measurements, annotations, body marks and cuts of the recording with this path are in a file.
    pub(super) fn saved(&mut self, path: &Path, work: Handiwork) {
        if let Some(kept) = self.index(path).and_then(|n| self.all[n].kept.as_mut()) {
            kept.controls.saved(work);
        }
    }

    /// Removes the n-th recording, which must not be the shown one.
    pub(super) fn remove(&mut self, n: usize) {
        if n < self.all.len() && n != self.shown {
            self.all.remove(n);
            self.shown -= usize::from(n < self.shown);
        }
    }

    /// Takes the kept state of the shown recording, and that of the panels; None for what was not kept.
    pub(super) fn take_kept(&mut self) -> (Option<Kept>, Option<Display>) {
        let kept = self.all.get_mut(self.shown).and_then(|entry| entry.kept.take());
        (kept, self.display)
    }
}

impl Entry {
    fn file_name(&self) -> String {
        let name = || self.path.file_name().map(|name| name.to_string_lossy().into_owned());
        let name = self.title.map(str::to_string).or_else(name);
        name.unwrap_or_else(|| self.path.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Settings;

    const DISPLAY: Display = Display { panels: true, times: false, bar: true, has_focus: false };

    fn kept(exposure: f64) -> Option<Kept> {
        let mut settings = Settings::default();
        settings.post.brightness = exposure;
        Some(Kept { controls: Controls::new(settings), frozen: Some(7) })
    }

    fn names(list: &Recordings) -> Vec<String> {
        list.list()
            .into_iter()
            .map(|named| if named.is_shown { format!("> {}", named.name) } else { named.name })
            .collect()
    }

    fn of(paths: &[&str]) -> Recordings {
        let mut list = Recordings::of(SourceKind::Recording, Path::new(paths[0]));
        assert!(paths[1..].iter().all(|path| list.add(Path::new(path))));
        list
    }

    #[test]
    fn each_recording_has_a_name_of_its_own() {
        let list = of(&["/a/1/sweep.mha", "/a/b/c.nrrd", "/a/2/sweep.mha", "/b/2/sweep.mha", "/a/1/still.mha"]);
        assert_eq!(names(&list), ["> 1/sweep.mha", "c.nrrd", "2/sweep.mha (1)", "2/sweep.mha (2)", "still.mha"]);
        assert_eq!(list.name(Path::new("/b/2/sweep.mha")), "2/sweep.mha (2)");
        assert_eq!(list.name(Path::new("/elsewhere/x.mha")), "x.mha");
        let demo = Recordings::of(SourceKind::Demo, Path::new("phantom"));
        assert_eq!((names(&demo)[0].as_str(), demo.shown()), ("> Demo data (phantom)", Some(Path::new("phantom"))));
    }

    #[test]
    fn what_is_kept_of_a_recording_comes_back_with_it_once() {
        let mut list = of(&["/a.mha", "/b.mha"]);
        let [a, b] = ["/a.mha", "/b.mha"].map(Path::new);
        assert!(list.take_kept().0.is_none());
        list.show(b, kept(2.0), false, DISPLAY);
        assert!(list.take_kept().0.is_none() && list.shown() == Some(b), "nothing is known of the second one");
        list.show(a, kept(3.0), false, DISPLAY);
        let back = list.take_kept().0.expect("what was kept");
        assert_eq!((back.controls.settings().post.brightness, back.frozen), (2.0, Some(7)));
        assert!(list.take_kept().0.is_none());
        // One that is left before anything was drawn keeps what was known of it before.
        list.show(b, None, false, DISPLAY);
        list.show(a, None, false, DISPLAY);
        list.show(b, None, false, DISPLAY);
        assert_eq!(list.take_kept().0.expect("kept").controls.settings().post.brightness, 3.0);
    }

    #[test]
    fn the_list_is_stepped_in_a_circle_and_bounded() {
        let mut list = of(&["/a", "/b", "/c"]);
        let step = |list: &Recordings, from: &str, by| list.step(Path::new(from), by).map(Path::to_path_buf);
        assert_eq!(step(&list, "/a", 1), Some("/b".into()));
        assert_eq!((step(&list, "/c", 1), step(&list, "/a", -1)), (Some("/a".into()), Some("/c".into())));
        assert_eq!(Recordings::default().step(Path::new("/a"), 1), None);
        for n in 0..20 {
            list.add(Path::new(&format!("/more-{n}")));
        }
        assert_eq!(list.list().len(), MAX_OPEN);
        assert!(list.add(Path::new("/b")) && !list.add(Path::new("/new")), "what is there needs no room");
    }

    #[test]
    fn what_is_closed_leaves_the_list_and_the_shown_one_stays_shown() {
        let mut list = of(&["/a", "/b", "/c", "/d"]);
        list.show(Path::new("/c"), None, false, DISPLAY);
        list.remove(0);
        assert_eq!(names(&list), ["b", "> c", "d"]);
        list.remove(1);
        assert_eq!(names(&list), ["b", "> c", "d"], "the shown one is replaced first");
        list.show(Path::new("/d"), kept(1.0), true, DISPLAY);
        assert_eq!(names(&list), ["b", "> d"]);
        // Standard input cannot be read again.
        let mut list = Recordings::of(SourceKind::Pipe, Path::new("-"));
        list.add(Path::new("/a"));
        list.show(Path::new("/a"), kept(1.0), false, DISPLAY);
        assert_eq!(names(&list), ["> a"]);
    }
}
