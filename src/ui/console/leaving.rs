//! Leaving the program: whether that loses volumes or handiwork that are in no file, the question about them, and leaving once everything is saved.
//! Volumes are identified by their numbers.

use crate::export::Holds;
use crate::source::live::SourceKind;
use crate::texts::Unsaved;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a warning holds: what is asked for again within this time is done.
const WARNED: Duration = Duration::from_secs(10);

/// Whether leaving the program loses anything, and the question that is asked then.
#[derive(Debug, Default)]
pub(super) struct Leaving {
    /// Whether the source delivers each volume only once.
    comes_once: bool,
    /// Whether everything that arrives is recorded to a file.
    is_recorded: bool,
    /// The question, while it is shown.
    pub(super) question: Option<&'static Unsaved>,
    /// Number of files that have to be saved before the program ends.
    awaited: Option<usize>,
    /// The newest volume of the completely saved loops.
    saved: Option<u32>,
    /// The recording whose closing was warned of last, and when.
    warned: Option<(PathBuf, Instant)>,
}

impl Leaving {
    /// `is_recorded`: all frames that arrive are recorded to a file.
    pub(super) fn new(source: SourceKind, is_recorded: bool) -> Leaving {
        let comes_once = matches!(source, SourceKind::Probe | SourceKind::Pipe);
        Leaving { comes_once, is_recorded, ..Leaving::default() }
    }

    /// True if volumes of the cine loop are in no file: neither in the recording that they were read from, nor in one that is being made, nor in
    /// a saved loop. `newest`: number of the loop's newest volume; `unrecorded`: number of volumes or frames that the recording lacks.
    pub(super) fn loses(&self, newest: Option<u32>, unrecorded: u64) -> bool {
        let is_only_here = self.comes_once && !(self.is_recorded && unrecorded == 0);
        is_only_here && newest.is_some() && newest != self.saved
    }

    pub(super) fn asks(&self) -> bool {
        self.question.is_some()
    }

    /// Closes the question. Returns false if none was shown.
    pub(super) fn dismiss(&mut self) -> bool {
        self.question.take().is_some()
    }

    /// Ends the program once this number of files is saved. 0: does not end it.
    pub(super) fn after(&mut self, files: usize) {
        self.awaited = Some(files).filter(|files| *files > 0);
    }

    /// Notes that a file was saved. Returns true if the program has to end now.
    pub(super) fn saved(&mut self, holds: &Holds) -> bool {
        if let Holds::Loop(newest) = holds {
            self.saved = self.saved.max(Some(*newest));
        }
        if *holds != Holds::Nothing {
            self.awaited = self.awaited.map(|files| files.saturating_sub(1));
        }
        self.awaited == Some(0)
    }

    /// Notes that a file could not be saved. If the end of the program waited for it, the program continues.
    pub(super) fn not_saved(&mut self, holds: &Holds) {
        if *holds != Holds::Nothing {
            self.awaited = None;
        }
    }

    /// True if the user has to be warned before this recording is closed, because no warning about it was given within the last seconds.
    pub(super) fn warns_of(&mut self, recording: &Path, now: Instant) -> bool {
        let is_warned =
            |(path, at): (PathBuf, Instant)| path == recording && now.saturating_duration_since(at) < WARNED;
        let warns = !self.warned.take().is_some_and(is_warned);
        self.warned = warns.then(|| (recording.to_path_buf(), now));
        warns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controls::Handiwork;
    use crate::texts;

    /// Requirement: what a probe sent is not lost without a question, and nobody is asked about what is in a file.
    #[test]
    fn only_volumes_that_exist_nowhere_else_are_asked_about() {
        for (source, comes_once) in [
            (SourceKind::Probe, true),
            (SourceKind::Pipe, true),
            (SourceKind::Recording, false),
            (SourceKind::Demo, false),
        ] {
            let mut leaving = Leaving::new(source, false);
            assert!(!leaving.loses(None, 0), "{source:?}: an empty loop");
            assert_eq!(leaving.loses(Some(3), 0), comes_once, "{source:?}");
            assert!(!leaving.saved(&Holds::Loop(3)) && !leaving.loses(Some(3), 0), "{source:?}: saved");
            assert!(!leaving.saved(&Holds::Nothing), "{source:?}: a picture");
            assert_eq!(leaving.loses(Some(4), 0), comes_once, "{source:?}: one came since");
            let recorded = Leaving::new(source, true);
            assert!(!recorded.loses(Some(3), 0), "{source:?}");
            assert_eq!(recorded.loses(Some(3), 1), comes_once, "{source:?}: the disk was full");
        }
    }

    #[test]
    fn the_program_ends_with_the_files_that_it_waits_for_and_not_with_a_fault() {
        let (mut leaving, work) =
            (Leaving::new(SourceKind::Probe, false), || Holds::Work { kept: None, work: Handiwork::default() });
        leaving.question = Some(&texts::UNSAVED_LOOP);
        assert!(leaving.asks() && leaving.dismiss() && !leaving.dismiss());
        assert!(!leaving.saved(&Holds::Loop(5)), "nothing is waited for");
        leaving.after(2);
        assert!(!leaving.saved(&Holds::Nothing) && !leaving.saved(&work()) && leaving.saved(&Holds::Loop(7)));
        leaving.after(1);
        leaving.not_saved(&Holds::Nothing);
        leaving.not_saved(&work());
        assert!(!leaving.saved(&work()), "the user saves it later, and stays");
        leaving.after(0);
        assert!(!leaving.saved(&work()), "nothing could be saved");
    }

    #[test]
    fn a_recording_with_unsaved_work_is_closed_when_that_is_asked_twice() {
        let (mut leaving, now) = (Leaving::default(), Instant::now());
        let mut warns =
            |name: &str, seconds: u64| leaving.warns_of(Path::new(name), now + Duration::from_secs(seconds));
        assert!(warns("a", 0) && !warns("a", 3), "at the second time");
        assert!(warns("a", 4) && warns("b", 5) && warns("a", 6), "another one");
        assert!(warns("a", 17), "long ago");
    }
}
