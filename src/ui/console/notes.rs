//! Notes over the picture: messages about events, each shown for a while.

use crate::panels::Note;
use std::time::{Duration, Instant};

/// How long a note is shown.
const NOTE_TIME: Duration = Duration::from_secs(5);
/// Largest number of notes that are shown at once; the newest ones win.
const MAX_NOTES: usize = 4;

/// The messages (notes) that are shown for a few seconds: each with the time of its end, the oldest first.
#[derive(Debug, Default)]
pub(super) struct Notes(Vec<(Instant, Note)>);

impl Notes {
    /// Shows a message for the full time from `now` on, even if it is shown already.
    pub(super) fn add(&mut self, text: &str, is_fault: bool, now: Instant) {
        let note = Note { text: text.into(), is_fault };
        self.0.retain(|(_, known)| *known != note);
        self.0.push((now + NOTE_TIME, note));
        if self.0.len() > MAX_NOTES {
            self.0.remove(0);
        }
    }

    /// Removes messages whose time is over. Returns true if there was one.
    pub(super) fn end(&mut self, now: Instant) -> bool {
        let before = self.0.len();
        self.0.retain(|(until, _)| *until > now);
        self.0.len() != before
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn shown(&self) -> impl Iterator<Item = Note> {
        self.0.iter().map(|(_, note)| note.clone())
    }

    /// Times at which messages end.
    pub(super) fn due(&self) -> impl Iterator<Item = Instant> {
        self.0.iter().map(|(until, _)| *until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Prevents notes that stay, that fill the window, or that are shown twice.
    #[test]
    fn a_note_ends_after_five_seconds_and_the_newest_four_are_shown() {
        let begin = Instant::now();
        let at = |seconds: u64| begin + Duration::from_secs(seconds);
        let texts = |notes: &Notes| notes.shown().map(|note| note.text).collect::<Vec<_>>();
        let mut notes = Notes::default();
        notes.add("a", false, at(0));
        notes.add("b", true, at(1));
        notes.add("a", false, at(3));
        assert_eq!(texts(&notes), ["b", "a"], "said again, it is the newest");
        assert!(!notes.end(at(5)) && notes.end(at(6)) && !notes.end(at(7)));
        assert_eq!(texts(&notes), ["a"], "its time began anew");
        assert_eq!(notes.due().collect::<Vec<_>>(), [at(8)]);
        ["c", "d", "e", "f"].into_iter().for_each(|text| notes.add(text, false, at(7)));
        assert_eq!(texts(&notes), ["c", "d", "e", "f"]);
        assert!(notes.end(at(12)) && notes.is_empty());
    }
}
